# SPDX-License-Identifier: GPL-2.0-only
"""Decks take the measures of a body from FILE.body, check them against the spheres, and refuse what cannot be."""

import re
import shutil

import numpy as np
import pytest
from common_bodies import REFERENCE
from lammps_run import read_csv, run_lammps, slope

DECKS = ("in.traction", "in.cyclic", "in.quasistatic")
CYLINDER = {"length": 0.05, "radius": 0.02, "volume": np.pi * 0.02**2 * 0.05, "solid_fraction": 0.58156, "density": 4642.7}
ROW = "80 8 4 3 8 4 0.005 0 1.5"
HEADER = "# DATE: 2026-11-22 UNITS: si CONTRIBUTOR: tests CITATION: none\n"
ROWS = HEADER + f"""own {ROW} spacing 0.005851894738785831 coordination 11.9
plain {ROW}
heavy {ROW} spacing 0.005851894738785831 coordination 11.9 density 2700
stiff {ROW} spacing 0.005851894738785831 coordination 11.9 kv 1000
"""


def write_body(folder, **measures):
    """The reference specimen as body.data with a FILE.body of these measures; none: without one."""
    shutil.copy(REFERENCE, folder / "body.data")
    if measures:
        (folder / "body.data.body").write_text("".join(f"variable {name} index {value:.10g}\n" for name, value in measures.items()))


def pull(folder, deck="in.traction", **variables):
    """A short run of a deck, from its folder."""
    (folder / "rows.evp").write_text(ROWS)
    given = {"specimen": "body.data", "out": "pull", "strain": 0.001, "row": 0.0005, "contact": "none"}
    return run_lammps(deck, 1, {**given, **variables}, folder, seconds=60)


def refused(run, message):
    assert run.returncode != 0 and re.search(r"^ERROR: .*" + message, run.stdout, re.M), run.stdout[-1500:]
    assert len(re.findall(r"^ERROR", run.stdout, re.M)) == 1
    assert not list(run.folder.glob("pull*.csv"))


@pytest.mark.parametrize("deck", DECKS)
def test_same_bits_with_and_without(tmp_path, deck):
    curves = []
    for measures in ({}, CYLINDER):
        write_body(tmp_path, **measures)
        pull(tmp_path, deck).ok()
        curves.append((tmp_path / "pull.csv").read_bytes())
    assert curves[0] == curves[1] and len(curves[0].splitlines()) >= 3


@pytest.mark.parametrize("deck", DECKS)
def test_area_of_the_body_divides_the_force(tmp_path, deck):
    """-var wins over the file, which wins over the paper. Control: the file's area is half of the cylinder's."""
    write_body(tmp_path)
    pull(tmp_path, deck).ok()
    paper = read_csv(tmp_path / "pull.csv")["stress_grip"][-1]
    half = {name: value for name, value in CYLINDER.items() if name != "radius"}
    write_body(tmp_path, **half, area=0.5 * np.pi * 0.02**2 * 1.2)
    pull(tmp_path, deck).ok()
    assert read_csv(tmp_path / "pull.csv")["stress_grip"][-1] == pytest.approx(paper / 0.6, rel=1e-3)
    for given in ({"radius": 0.02}, {"area": np.pi * 0.02**2}):
        pull(tmp_path, deck, **given).ok()
        assert read_csv(tmp_path / "pull.csv")["stress_grip"][-1] == pytest.approx(paper, rel=1e-3)


@pytest.mark.parametrize("deck", DECKS)
@pytest.mark.parametrize("measures, variables, message", [
    ({}, {"radius": 0.025}, "y from -0.01769 to 0.01751 m and z from -0.01746 to 0.01762 m, which is no cylinder of radius 0.025 m .*; correct the given length, radius or area"),
    ({}, {"radius": 0.01}, "no cylinder of radius 0.01 m about the x axis; correct the given length, radius or area"),
    ({}, {"length": 0.06}, "the centers lie from 0.002327 to 0.04765 m along x, not from 0 to length = 0.06 m; correct the given length, radius or area"),
    ({}, {"length": 0.04}, "not from 0 to length = 0.04 m"),
    ({}, {"area": 0.01}, "too little for area = 0.01 m2; correct the given length, radius or area"),
    ({}, {"area": 1e-4}, "the spheres fill 7.46 of area = 0.0001 m2 times length; correct the given length, radius or area"),
    ({}, {"radius": 0.02, "area": 0.00125}, "radius and area are both given"),
    ({}, {"length": -0.05}, "length must be positive, or 0 where it is not given, got -0.05"),
    ({**CYLINDER, "length": 0.08}, {}, "not from 0 to length = 0.08 m; make body.data and body.data.body again"),
    ({**CYLINDER, "radius": 0.04}, {}, "no cylinder of radius 0.04 m about the x axis; make body.data and body.data.body again"),
    ({**CYLINDER, "volume": 7e-5}, {}, r"body.data.body is of another body: the spheres have 3.654e-05 m3, it says 4.071e-05 m3; make both again")])
def test_measures_that_cannot_be(tmp_path, deck, measures, variables, message):
    write_body(tmp_path, **measures)
    refused(pull(tmp_path, deck, **variables), message)


@pytest.mark.parametrize("deck", DECKS)
@pytest.mark.parametrize("shift, stretch, what", [
    (0.02, 1.0, "the centers lie from 0.02233 to 0.06765 m along x"), (0.0, 10.0, "the centers lie from 0.02327 to 0.4765 m along x"),
    (0.0, 0.1, "the centers lie from 0.0002327 to 0.004765 m along x")])
def test_another_body_without_a_file_is_not_taken_for_the_paper_s(tmp_path, deck, shift, stretch, what):
    """Every other line of the data file moved or scaled along x."""
    lines = REFERENCE.read_text().splitlines()
    first = lines.index("Atoms # sphere") + 2
    for k in range(first, first + 500):
        words = lines[k].split()
        words[4] = repr(shift + stretch * float(words[4]))
        lines[k] = " ".join(words)
    text = "\n".join(lines) + "\n"
    (tmp_path / "body.data").write_text(text.replace("-0.02 0.07 xlo xhi", "-0.02 0.7 xlo xhi"))
    refused(pull(tmp_path, deck), what + ", not from 0 to length = 0.05 m; there is no body.data.body: give length, and radius or area")


@pytest.mark.parametrize("deck", DECKS)
def test_a_row_that_names_its_bodies_is_that_of_coeff_on_its_own_body(tmp_path, deck):
    """spacing and coordination of the reference specimen: nothing is scaled. Control: another spacing is another stiffness."""
    write_body(tmp_path)
    stress = {}
    (tmp_path / "other.evp").write_text(HEADER + f"own {ROW} spacing 0.0117 coordination 11.9\n")
    for key, choices in (("coeff", {"coeff": ROW}), ("own", {"material": "rows.evp:own"}), ("plain", {"material": "rows.evp:plain"}),
                         ("other", {"material": str(tmp_path / "other.evp") + ":own"})):
        pull(tmp_path, deck, **choices).ok()
        stress[key] = read_csv(tmp_path / "pull.csv")["stress_virial"]
    assert stress["own"] == pytest.approx(stress["coeff"], rel=1e-5, abs=1e3) and np.array_equal(stress["plain"], stress["coeff"])
    assert np.abs(stress["other"]).max() < 0.2 * np.abs(stress["coeff"]).max(), "control"


@pytest.mark.parametrize("deck", [*DECKS, "in.torsion"])
@pytest.mark.parametrize("choices, contact", [({}, "literal"), ({"material": "rows.evp:plain"}, "repulsive"),
                                              ({"material": "rows.evp:plain", "contact": "literal"}, "literal")])
def test_contact_is_repulsive_with_a_row_unless_given(tmp_path, deck, choices, contact):
    """The paper's default stays. One line says that it is another."""
    write_body(tmp_path)
    (tmp_path / "rows.evp").write_text(ROWS)
    load = {"angle": 0.001} if deck == "in.torsion" else {"strain": 0.001, "row": 0.0005}
    text = run_lammps(deck, 1, {"specimen": "body.data", "out": "pull", **load, **choices}, tmp_path, seconds=60).ok().stdout
    assert f"evp/lj: damping off, contact {contact}, deq of bonds" in text
    told = re.findall(r"^contact repulsive: the default with -var material, ", text, re.M)
    assert len(told) == (contact == "repulsive")


@pytest.mark.parametrize("deck", DECKS)
def test_kv_of_a_row(tmp_path, deck):
    write_body(tmp_path)
    pull(tmp_path, deck, material="rows.evp:stiff").ok()
    stress = read_csv(tmp_path / "pull.csv")["stress_virial"]
    pull(tmp_path, deck, coeff=ROW, kv=1000).ok()
    assert stress == pytest.approx(read_csv(tmp_path / "pull.csv")["stress_virial"], rel=1e-5, abs=1e3)
    pull(tmp_path, deck, coeff=ROW).ok()
    assert np.abs(stress).max() > 1.05 * np.abs(read_csv(tmp_path / "pull.csv")["stress_virial"]).max(), "control"


def test_density_of_a_row_gives_the_body_the_mass_of_its_solid(tmp_path):
    write_body(tmp_path, **CYLINDER)
    (tmp_path / "more.lmp").write_text('print "mass $(mass(all):%.10g)"\n')
    text = pull(tmp_path, material="rows.evp:heavy", also="more.lmp").ok().stdout
    assert float(re.search(r"^mass (\S+)$", text, re.M)[1]) == pytest.approx(2700 * CYLINDER["volume"], rel=1e-4)
    assert "have a mean density of" not in text
    (tmp_path / "body.data.body").unlink()
    text = pull(tmp_path, material="rows.evp:heavy", also="more.lmp", radius=0.021).ok().stdout
    assert float(re.search(r"^mass (\S+)$", text, re.M)[1]) == pytest.approx(2700 * np.pi * 0.021**2 * 0.05, rel=1e-9), "a cylinder has a volume without a file"


@pytest.mark.parametrize("deck", DECKS)
@pytest.mark.parametrize("variables, message", [
    ({"material": "rows.evp:plain", "coeff": ROW}, "material and coeff are both given: give one of them"),
    ({"material": "rows.evp:none"}, "read_evp_row: file rows.evp has no row 'none'; its rows: own, plain, heavy, stiff"),
    ({"material": "absent.evp:own"}, "read_evp_row: cannot read the potential file 'absent.evp'"),
    ({"material": "rows.evp:heavy", "area": 0.00125}, "rows.evp:heavy gives the density of the solid, but body.data.body has no volume, so that the solid fraction "
                                                      "is unknown: make the body by in.specimen, or add the volume there")])
def test_materials_that_cannot_be(tmp_path, deck, variables, message):
    write_body(tmp_path)
    refused(pull(tmp_path, deck, **variables), message)


def test_resumed_run_keeps_body_and_material(tmp_path):
    """Even where FILE.body has gone since, and whatever the command line says."""
    half = {name: value for name, value in CYLINDER.items() if name != "radius"}
    write_body(tmp_path, **half, area=0.0011)
    pull(tmp_path, "in.quasistatic", material="rows.evp:stiff", restart=1, extensometer="yes").ok()
    whole = (tmp_path / "pull.csv").read_text()
    (tmp_path / "body.data.body").unlink()
    pull(tmp_path, "in.quasistatic", resume=1, coeff="1 8 4 1 8 4 0.005 0 1.5").ok()
    rows = [np.array(text.splitlines()[-1].split(","), dtype=float) for text in (whole, (tmp_path / "pull.csv").read_text())]
    assert rows[0] == pytest.approx(rows[1], rel=1e-7, abs=1.0) and len(rows[1]) == 4


@pytest.mark.parametrize("deck", DECKS)
def test_extensometer(tmp_path, deck):
    """The strain between the layers, from the atoms at the end, which the last row is of; without it the other columns are the same bits."""
    from evp import specimen

    write_body(tmp_path)
    pull(tmp_path, deck, out="plain", strain=0.0011).ok()
    run = pull(tmp_path, deck, extensometer="yes", strain=0.0011).ok()
    curve, plain = read_csv(tmp_path / "pull.csv"), read_csv(tmp_path / "plain.csv")
    assert list(curve) == ["strain", "stress_grip", "stress_virial", "strain_gauge"]
    assert all(np.array_equal(curve[name], plain[name]) for name in plain)
    start = specimen.read_data(REFERENCE)
    now = run.dump("pull_state.dump")[-1]["x"]
    half = 0.5 * 2 * (0.6 * CYLINDER["volume"] / (500 * 4 / 3 * np.pi)) ** (1 / 3)
    low, high = (np.abs(start.x[:, 0] - at) < half for at in (0.015, 0.035))
    weigh = [[np.average(x[layer], weights=start.mass[layer]) for layer in (low, high)] for x in (start.x[:, 0], now)]
    assert curve["strain_gauge"][-1] == pytest.approx((weigh[1][1] - weigh[1][0]) / (weigh[0][1] - weigh[0][0]) - 1.0, rel=1e-6, abs=1e-8)
    loaded = curve["strain"] > 2e-4
    assert slope(curve["strain"][loaded], curve["strain_gauge"][loaded]) == pytest.approx(0.95, abs=0.15)


def test_one_row_has_the_same_stiffness_in_bodies_of_other_shapes(tmp_path):
    """A cylinder and a block of the same row, 1500 spheres, at rest: E within the scatter of two packings of that size."""
    (tmp_path / "rows.evp").write_text(ROWS)
    found = {}
    for shape, choices in (("cylinder", {}), ("block", {"width": 0.012, "height": 0.012})):
        run_lammps("in.specimen", 1, {"n": 1500, "shape": shape, "out": "body.data", **choices}, tmp_path).ok()
        pull(tmp_path, "in.quasistatic", material="rows.evp:own", strain=0.002, restart=0).ok()
        curve = read_csv(tmp_path / "pull.csv")
        found[shape] = slope(curve["strain"], curve["stress_virial"]) / 1e9
    assert found["cylinder"] == pytest.approx(22.0, rel=0.03) and found["block"] == pytest.approx(found["cylinder"], rel=0.03)
