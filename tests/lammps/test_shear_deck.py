# SPDX-License-Identifier: GPL-2.0-only
"""in.shear, and the periodic packings of in.specimen that it shears: stiffness, strain of the rows, flips, choices."""

import re

import numpy as np
import pytest
from evp import specimen
from evp.figures import read_columns
from lammps_run import DECKS, read_csv, read_dump, run_lammps
from scipy.spatial import cKDTree

COUNT, EDGE = 500, 0.04
SMALL = {"strain": 0.0025, "row": 0.0001, "rate": 10}
ROW = (80.0, 8, 4)  # e1 m1 n1 of the default
REDUCED = 0.969  # of the affine E: periodic random packs reach 0.965 to 0.973
COLUMNS = ["strain", "shear_stress", "pressure", "share_second"]


def gaps(body, reach):
    """Pairs within reach (R_i + R_j), through the boundaries too, and their distances."""
    edge = body.box[:, 1] - body.box[:, 0]
    pairs = cKDTree((body.x - body.box[:, 0]) % edge, boxsize=edge).query_pairs(2.0 * reach * body.radius.max(), output_type="ndarray")
    apart = body.x[pairs[:, 0]] - body.x[pairs[:, 1]]
    distance = np.linalg.norm(apart - edge * np.round(apart / edge), axis=1)
    near = distance <= reach * body.radius[pairs].sum(axis=1)
    return pairs[near], distance[near]


def affine_modulus(body, e1=ROW[0], reach=1.5):
    """m n e1 (Nb/V)/6 [Pa]."""
    return ROW[1] * ROW[2] * e1 * len(gaps(body, reach)[0]) / np.prod(body.box[:, 1] - body.box[:, 0]) / 6.0


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


def modulus(curve, end=0.002):
    """Slope of the shear stress; the row at rest is left out."""
    inside = (curve["strain"] > 0.0) & (curve["strain"] <= end)
    return np.polyfit(curve["strain"][inside], curve["shear_stress"][inside], 1)[0]


# ---- the packing


def test_packing_is_dense_and_isotropic(packed):
    """Frictionless jamming without walls: about 0.64 and six partners; none overlaps, across the boundary neither."""
    path, body = packed
    volume = EDGE**3
    assert np.allclose(body.box, [[0.0, EDGE], [-EDGE / 2, EDGE / 2], [-EDGE / 2, EDGE / 2]])
    assert 4 / 3 * np.pi * np.sum(body.radius**3) / volume == pytest.approx(0.642, abs=0.008)
    pairs, distance = gaps(body, 1.001)
    assert 2 * len(pairs) / COUNT == pytest.approx(6.0, abs=0.3)
    assert (distance / body.radius[pairs].sum(axis=1)).min() > 0.995
    assert 2 * len(gaps(body, 1.5)[0]) / COUNT == pytest.approx(14.95, abs=0.25)
    assert np.mean(body.x[:, 1]) == pytest.approx(0.0, abs=0.05 * EDGE)
    lines = dict(re.findall(r"^variable (\w+) equal (\S+)", (path.parent / "periodic.data.body").read_text(), re.M))
    assert float(lines["length"]) == EDGE and float(lines["area"]) == pytest.approx(EDGE**2) and float(lines["volume"]) == pytest.approx(volume)


def test_shear_modulus_is_the_closed_form(packed, tmp_path):
    """0.4 E0, E0 = 0.969 m n e1 (Nb/V)/6; fix evp/volume leaves it."""
    finer = COUNT / 500 * np.pi * 0.02**2 * 0.05 / EDGE**3
    curve, found = run(packed, tmp_path, **SMALL)
    alone = modulus(curve)
    assert alone == pytest.approx(0.4 * REDUCED * affine_modulus(packed[1], ROW[0] / finer), rel=0.03)
    stiffer, _ = run(packed, tmp_path, coeff="80 8 4 3 8 4 0.005 100 1.5 kv 3000", **SMALL)
    assert modulus(stiffer) == pytest.approx(alone, rel=0.01)
    assert np.abs(stiffer["shear_stress"][5:] / curve["shear_stress"][5:] - 1.0).max() > 1e-5, "control: it acts"


def test_modulus_with_the_spacing_of_a_row(packed, tmp_path):
    """e1 x (s/S)^3 Z/z, from the body's own bonds."""
    spacing, coordination = 0.00585, 11.9
    pairs, distance = gaps(packed[1], 1.5)
    e1 = ROW[0] * (distance.mean() / spacing) ** 3 * coordination / (2 * len(pairs) / COUNT)
    curve, _ = run(packed, tmp_path, coeff=f"80 8 4 3 8 4 0.005 100 1.5 spacing {spacing} coordination {coordination}", **SMALL)
    assert modulus(curve) == pytest.approx(0.4 * REDUCED * affine_modulus(packed[1], e1), rel=0.03)


def test_material_gives_the_solid_its_mass(packed, tmp_path):
    material = f"{DECKS.parent / 'potentials' / 'metals.evp'}:copper_OFHC"
    (tmp_path / "mass.lmp").write_text('print "mass $(mass(all):%.12g)"\n')
    _, found = run(packed, tmp_path, material=material, also="mass.lmp", strain=0.001, row=0.0005, rate=200)
    printed = float(re.search(r"^mass (\S+)", found.stdout, re.M)[1])
    assert printed == pytest.approx(8960.0 * EDGE**3, rel=1e-6)


# ---- strain of the rows

TILT = 'fix tilt all print 1 "$(step) $(xy/ly:%.12g)" file tilt.txt screen no\n'


def tilts(folder):
    """Of the box over its height: at the last forces, and at the end."""
    step, tilt = np.loadtxt(folder / "tilt.txt", comments="#").T
    return tilt[step == step[-1]][[0, -1]]  # printed after the forces, and by the run of no step at the end


@pytest.mark.parametrize("choices, rows", [({}, 20), ({"row": 0.0007}, 3), ({"row": 0.0005}, 4)])
def test_rows_divide_the_strain(packed, tmp_path, choices, rows):
    """Means of rows no farther apart than asked; the box ends on the strain, one timestep after the last forces."""
    (tmp_path / "box.lmp").write_text(TILT)
    choices = {"row": 0.0001, "rate": 100, "strain": 0.002, "also": "box.lmp", **choices}
    curve, _ = run(packed, tmp_path, **choices)
    assert len(curve["strain"]) == 1 + rows and np.diff(curve["strain"][1:]) == pytest.approx(0.002 / rows, rel=1e-5)
    assert tilts(tmp_path)[-1] == pytest.approx(0.002, rel=1e-6)


def test_rows_hold_the_strain_that_the_forces_saw(packed, tmp_path):
    """A row of one sample: its stress is on the line through the origin of the strain that it holds. Off by one of its timesteps it would not be."""
    choices = {"coeff": "80 8 4 3 8 4 0.5 0 1.5", "rate": 50, "row": 1e-5, "strain": 2e-4}
    text = (DECKS / "in.shear").read_text(encoding="utf-8").replace("fix             rows all ave/time ${each} $(v_every/v_each) ${every}", "fix rows all ave/time ${every} 1 ${every}")
    (tmp_path / "box.lmp").write_text(TILT)
    curve, found = run(packed, tmp_path, deck=text, also="box.lmp", **choices)
    before, end = tilts(tmp_path)
    assert curve["strain"][-1] == pytest.approx(before, rel=1e-6) and end > before, "the box one step before the end"


FAST = {"strain": 0.6, "row": 0.02, "rate": 4000, "contact": "repulsive", "plasticity": "isotropic"}


def test_flip_changes_nothing(packed, tmp_path):
    """The tilt passes one half: on two ranks, and without flips on one, the same rows, with the timestep of the start below the limit to the end."""
    (tmp_path / "box.lmp").write_text(TILT + "thermo_style custom step c_dt\n")
    curve, found = run(packed, tmp_path, 2, also="box.lmp", **FAST)
    assert tilts(tmp_path)[-1] == pytest.approx(-0.4, abs=1e-5)
    unflipped = (DECKS / "in.shear").read_text(encoding="utf-8").replace("flip yes", "flip no")
    expected, _ = run(packed, tmp_path, deck=unflipped, also="box.lmp", **FAST)
    assert tilts(tmp_path)[-1] == pytest.approx(0.6, abs=1e-5)
    for name in COLUMNS:
        assert np.abs(curve[name] - expected[name]).max() <= 1e-6 * np.abs(expected[name]).max(), name
    assert curve["share_second"].max() > 0.3, "control: pairs have flowed"
    step = float(re.findall(r"Time step +: (\S+)", found.stdout)[1])
    assert step < 0.6 * found.thermo()["c_dt"].min()


def test_broken_bonds_and_columns_of_the_state(packed, tmp_path):
    _, found = run(packed, tmp_path, coeff="80 8 4 3 8 4 0.005 100 1.5 kv 300", **{**FAST, "break": 0.05, "strain": 0.2})
    assert read_csv(tmp_path / "run.csv")["broken"][-1] > 100 and len(found.stdout.splitlines()) <= 100
    state = read_dump(tmp_path / "run_state.dump")[-1]
    names = ["bonds", "share_second", "share_lost", "new_pairs", "plastic_work", "plastic_strain", "volume_strain", "plastic_strain_sum"]
    assert list(state.columns) == ["id", "x", "y", "z", "radius", *names]
    assert state["plastic_work"].max() > 0.0 and np.abs(state["volume_strain"]).max() > 0.0
