# SPDX-License-Identifier: GPL-2.0-only
"""in.shear, and the periodic packings of in.specimen that it shears: stiffness, strain of the rows, flips, choices; the lines that
doc/studies/large_strain.py adds."""

import re

import large_strain
import numpy as np
import pytest
from evp import specimen
from evp.curves import read_columns
from flowing import largest_difference, read_pairs
from hostile import refused
from lammps_run import DECKS, REFERENCE, edited_deck, read_csv, read_dump, run_lammps
from scipy.spatial import cKDTree

COUNT, EDGE = 500, 0.04
SMALL = {"strain": 0.0025, "row": 0.0001, "rate": 10}
REDUCED = 0.969  # of the affine E: periodic random packs reach 0.965 to 0.973
COLUMNS = ["strain", "shear_stress", "pressure", "share_second", "beyond_dlim", "new_pairs", "lowest_ratio"]


def gaps(body, reach):
    """Pairs within reach (R_i + R_j), through the boundaries too, and their distances."""
    edge = body.box[:, 1] - body.box[:, 0]
    pairs = cKDTree((body.x - body.box[:, 0]) % edge, boxsize=edge).query_pairs(2.0 * reach * body.radius.max(), output_type="ndarray")
    apart = body.x[pairs[:, 0]] - body.x[pairs[:, 1]]
    distance = np.linalg.norm(apart - edge * np.round(apart / edge), axis=1)
    near = distance <= reach * body.radius[pairs].sum(axis=1)
    return pairs[near], distance[near]


def affine_modulus(body, e1):
    """m n e1 (Nb/V)/6 [Pa]."""
    return 8 * 4 * e1 * len(gaps(body, 1.5)[0]) / EDGE**3 / 6.0


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    """A periodic packing: its file and its spheres."""
    folder = tmp_path_factory.mktemp("packed")
    run_lammps("in.specimen", 1, {"n": COUNT, "shape": "periodic", "length": EDGE, "out": "periodic.data"}, folder).ok()
    return folder / "periodic.data", specimen.read_data(folder / "periodic.data")


def run(packed, folder, ranks=1, deck="in.shear", **choices):
    """Columns of PREFIX.csv, and what the run printed."""
    found = run_lammps(deck, ranks, {"specimen": packed[0], "contact": "none", "out": "run", **choices}, folder).ok()
    return read_columns(folder / "run.csv", COLUMNS), found


def modulus(curve):
    """Slope of the shear stress; the row at rest is left out."""
    inside = (curve["strain"] > 0.0) & (curve["strain"] <= 0.002)
    return np.polyfit(curve["strain"][inside], curve["shear_stress"][inside], 1)[0]


def test_packing_is_dense_and_isotropic(packed, tmp_path):
    """Frictionless jamming without walls: about 0.64 and six partners; none overlaps, across the boundary neither. A body with walls is refused."""
    refused(run_lammps("in.shear", 1, {"specimen": REFERENCE}, tmp_path), "give a body of in.specimen -var shape periodic")
    path, body = packed
    assert np.allclose(body.box, [[0.0, EDGE], [-EDGE / 2, EDGE / 2], [-EDGE / 2, EDGE / 2]])
    assert 4 / 3 * np.pi * np.sum(body.radius**3) / EDGE**3 == pytest.approx(0.642, abs=0.008)
    pairs, distance = gaps(body, 1.001)
    assert 2 * len(pairs) / COUNT == pytest.approx(6.0, abs=0.3)
    assert (distance / body.radius[pairs].sum(axis=1)).min() > 0.995
    assert 2 * len(gaps(body, 1.5)[0]) / COUNT == pytest.approx(14.95, abs=0.25)
    assert np.mean(body.x[:, 1]) == pytest.approx(0.0, abs=0.05 * EDGE)
    lines = dict(re.findall(r"^variable (\w+) equal (\S+)", (path.parent / "periodic.data.body").read_text(), re.M))
    assert float(lines["length"]) == EDGE and float(lines["area"]) == pytest.approx(EDGE**2) and float(lines["volume"]) == pytest.approx(EDGE**3)


def test_shear_modulus_is_the_closed_form(packed, tmp_path):
    """0.4 E0, E0 = 0.969 m n e1 (Nb/V)/6; fix evp/volume leaves it; with spacing and coordination of a row e1 x (s/S)^3 Z/z, from the body's bonds."""
    finer = COUNT / 500 * np.pi * 0.02**2 * 0.05 / EDGE**3
    spacing, coordination = 0.00585, 11.9
    pairs, distance = gaps(packed[1], 1.5)
    e1 = 80.0 * (distance.mean() / spacing) ** 3 * coordination / (2 * len(pairs) / COUNT)
    curves = {more: run(packed, tmp_path, coeff=f"80 8 4 3 8 4 0.005 100 1.5 {more}", **SMALL)[0]
              for more in ("", "kv 3000", f"spacing {spacing} coordination {coordination}")}
    alone, stiffer, scaled = map(modulus, curves.values())
    assert alone == pytest.approx(0.4 * REDUCED * affine_modulus(packed[1], 80.0 / finer), rel=0.03)
    assert stiffer == pytest.approx(alone, rel=0.01)
    assert np.abs(curves["kv 3000"]["shear_stress"][5:] / curves[""]["shear_stress"][5:] - 1.0).max() > 1e-5, "control: it acts"
    assert scaled == pytest.approx(0.4 * REDUCED * affine_modulus(packed[1], e1), rel=0.03)


TILT = 'fix tilt all print 1 "$(step) $(xy/ly:%.12g)" file tilt.txt screen no\n'


def tilts(folder):
    """Of the box over its height: at the last forces, and at the end."""
    step, tilt = np.loadtxt(folder / "tilt.txt", comments="#").T
    return tilt[step == step[-1]][[0, -1]]  # the last is printed by the run of no step


def test_rows_divide_the_strain(packed, tmp_path):
    """Means of rows no farther apart than asked; the box ends on the strain, one timestep after the last forces. The row gives the solid its mass."""
    (tmp_path / "box.lmp").write_text(TILT + 'print "mass $(mass(all):%.12g)"\n')
    material = f"{DECKS.parent / 'potentials' / 'metals.evp'}:copper_OFHC"
    curve, found = run(packed, tmp_path, row=0.0007, rate=100, strain=0.002, also="box.lmp", material=material)
    assert len(curve["strain"]) == 1 + 3 and np.diff(curve["strain"][1:]) == pytest.approx(0.002 / 3, rel=1e-5)
    assert tilts(tmp_path)[-1] == pytest.approx(0.002, rel=1e-6)
    assert float(re.search(r"^mass (\S+)", found.stdout, re.M)[1]) == pytest.approx(8960.0 * EDGE**3, rel=1e-6)


def test_distance_of_join(packed, tmp_path):
    """A choice of two words."""
    material = f"{DECKS.parent / 'potentials' / 'metals.evp'}:copper_OFHC"
    _, found = run(packed, tmp_path, rate=100, strain=1e-4, material=material, contact="join 1.1")
    assert "contact join within 1.1 (R_i + R_j)" in found.stdout


def test_rows_hold_the_strain_that_the_forces_saw(packed, tmp_path):
    """A row of one sample: its stress is on the line through the origin of the strain that it holds. Off by one of its timesteps it would not be."""
    choices = {"coeff": "80 8 4 3 8 4 0.5 0 1.5", "rate": 50, "row": 1e-5, "strain": 2e-4}
    deck = edited_deck("in.shear", tmp_path, "fix             rows all ave/time ${each} $(v_every/v_each) ${every}", "fix rows all ave/time ${every} 1 ${every}")
    (tmp_path / "box.lmp").write_text(TILT)
    curve, found = run(packed, tmp_path, deck=deck, also="box.lmp", **choices)
    before, end = tilts(tmp_path)
    assert curve["strain"][-1] == pytest.approx(before, rel=1e-6) and end > before, "the box one step before the end"


FAST = {"strain": 0.6, "row": 0.02, "rate": 4000, "contact": "repulsive", "plasticity": "isotropic"}


def test_flip_changes_nothing(packed, tmp_path):
    """The tilt passes one half: on two ranks, and without flips on one, the same rows, energies, deq of each pair and plastic strains, with the timestep of the
    start below the limit to the end."""
    found, written = {}, {}
    for flip, ranks, tilt in (("yes", 2, -0.4), ("no", 1, 0.6)):
        deck = edited_deck("in.shear", tmp_path, "flip yes", f"flip {flip}")
        deck.write_text(deck.read_text(encoding="utf-8") + "write_evp_bonds end.bonds\n", encoding="utf-8")
        (tmp_path / "box.lmp").write_text(large_strain.ALSO + TILT + "thermo_style custom step c_dt\n")
        curve, output = run(packed, tmp_path, ranks, deck, also="box.lmp", **FAST)
        assert tilts(tmp_path)[-1] == pytest.approx(tilt, abs=1e-5)
        found[flip] = {**curve, **read_columns(tmp_path / "run_energies.csv", large_strain.COLUMNS)}
        written[flip] = read_pairs(tmp_path / "end.bonds")
        step = float(re.search(r"Time step +: (\S+)", output.stdout)[1])
        assert step < 0.6 * output.thermo()["c_dt"].min()
    for name, expected in found["no"].items():
        assert np.abs(found["yes"][name] - expected).max() <= 1e-6 * np.abs(expected).max(), name
    assert largest_difference(written["yes"], written["no"]) < 1e-6
    assert found["no"]["share_second"].max() > 0.3 and found["no"]["plastic"][-1] > 0.2 * found["no"]["spent"][-1], "control"


def test_broken_bonds_and_columns_of_the_state(packed, tmp_path):
    _, found = run(packed, tmp_path, coeff="80 8 4 3 8 4 0.005 100 1.5 kv 300 density 2700 damage 0.05 0 0 0 0 rupture 0", **{**FAST, "strain": 0.2})
    assert read_csv(tmp_path / "run.csv")["failed"][-1] > 100 and len(found.stdout.splitlines()) <= 100
    state = read_dump(tmp_path / "run_state.dump")[-1]
    names = ["bonds", "share_second", "share_lost", "new_pairs", "plastic_work", "plastic_strain", "volume_strain"]
    assert list(state.columns) == ["id", "x", "y", "z", "radius", *names]
    assert state["plastic_work"].max() > 0.0 and np.abs(state["volume_strain"]).max() > 0.0
