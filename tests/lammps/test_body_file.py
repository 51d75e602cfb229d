# SPDX-License-Identifier: GPL-2.0-only
"""Decks take the measures of a body from FILE.body, and its material from a row."""

import re
import shutil

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import specimen
from lammps_run import read_csv, run_lammps, slope

DECKS = ("in.traction", "in.cyclic", "in.quasistatic")
CYLINDER = {"length": 0.05, "radius": 0.02, "area": np.pi * 0.02**2, "volume": np.pi * 0.02**2 * 0.05, "solid_fraction": 0.58156, "density": 4642.7}
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
    given = {"specimen": "body.data", "out": "pull", "strain": 0.001, "contact": "none"}
    return run_lammps(deck, 1, {**given, **variables}, folder, seconds=60)


@pytest.mark.parametrize("deck", DECKS)
def test_area_of_the_body_divides_the_force(tmp_path, deck):
    """That of FILE.body, not of its radius."""
    write_body(tmp_path, **CYLINDER)
    pull(tmp_path, deck).ok()
    paper = read_csv(tmp_path / "pull.csv")["stress_grip"][-1]
    write_body(tmp_path, **{**CYLINDER, "area": 0.6 * CYLINDER["area"]})
    pull(tmp_path, deck).ok()
    assert read_csv(tmp_path / "pull.csv")["stress_grip"][-1] == pytest.approx(paper / 0.6, rel=1e-3)


@pytest.mark.parametrize("name", ["length", "radius"])
def test_dimensions_are_no_choices(tmp_path, name):
    """Those of in.specimen and tools/body.py are equal-style variables, which -var cannot replace in silence."""
    run = run_lammps("in.traction", 1, {"specimen": REFERENCE, "strain": 0.0002, "out": "pull", name: 0.03}, tmp_path)
    assert run.returncode != 0 and re.search("Cannot redefine .*variable", run.stdout)


@pytest.mark.parametrize("deck", [*DECKS, "in.torsion", "in.bending", "in.taylor"])
def test_a_body_without_its_file_stops(tmp_path, deck):
    write_body(tmp_path)
    run = pull(tmp_path, deck)
    assert run.returncode != 0 and re.search(r"^ERROR.*body.data.body", run.stdout, re.M) and not (tmp_path / "pull.csv").exists()


CONTACTS = [({}, "literal"), ({"material": "rows.evp:plain"}, "repulsive"), ({"plasticity": "isotropic"}, "repulsive")]
GIVEN = [({"material": "rows.evp:plain", "plasticity": "none", "contact": "literal"}, "literal"), ({"plasticity": "isotropic", "contact": "none"}, "none")]


@pytest.mark.parametrize("deck, choices, contact", [(deck, *case) for deck in (*DECKS, "in.torsion") for case in CONTACTS + GIVEN * (deck == "in.traction")])
def test_contact_is_repulsive_with_a_row_and_with_flow_unless_given(tmp_path, deck, choices, contact):
    write_body(tmp_path, **CYLINDER)
    (tmp_path / "rows.evp").write_text(ROWS)
    load = {"angle": 0.001} if deck == "in.torsion" else {"strain": 0.001}
    text = run_lammps(deck, 1, {"specimen": "body.data", "out": "pull", **load, **choices}, tmp_path, seconds=60).ok().stdout
    assert f"evp/lj: damping off, contact {contact}, deq of bonds" in text and f", contact {contact}, plasticity" in text


def test_density_of_a_row_gives_the_body_the_mass_of_its_solid(tmp_path):
    write_body(tmp_path, **CYLINDER)
    (tmp_path / "more.lmp").write_text('print "mass $(mass(all):%.10g)"\n')
    text = pull(tmp_path, material="rows.evp:heavy", also="more.lmp").ok().stdout
    assert float(re.search(r"^mass (\S+)$", text, re.M)[1]) == pytest.approx(2700 * CYLINDER["volume"], rel=1e-4)
    assert "have a mean density of" not in text


@pytest.mark.parametrize("deck", ["in.traction", "in.quasistatic"])
def test_strain_between_layers(tmp_path, deck):
    """From the atoms at the end, which the last row is of in.quasistatic, and half a row before in in.traction."""
    write_body(tmp_path, **CYLINDER)
    run = pull(tmp_path, deck, strain=0.0011)
    curve, start, now = read_csv(tmp_path / "pull.csv"), specimen.read_data(REFERENCE), run.ok().dump("pull_state.dump")[-1]["x"]
    half = 0.5 * (6 * CYLINDER["solid_fraction"] * CYLINDER["volume"] / np.pi / 500) ** (1 / 3)
    low, high = (np.abs(start.x[:, 0] - at) < half for at in (0.015, 0.035))
    weigh = [[np.average(x[layer], weights=start.mass[layer]) for layer in (low, high)] for x in (start.x[:, 0], now)]
    measured = (weigh[1][1] - weigh[1][0]) / (weigh[0][1] - weigh[0][0]) - 1.0
    assert curve["strain_gauge"][-1] == pytest.approx(measured, rel=1e-6 if deck == "in.quasistatic" else 0.06, abs=1e-8)
    loaded = curve["strain"] > 2e-4
    assert slope(curve["strain"][loaded], curve["strain_gauge"][loaded]) == pytest.approx(0.95, abs=0.15)


@pytest.mark.parametrize("deck", DECKS)
def test_a_row_that_names_its_bodies_is_that_of_coeff_on_its_own_body(tmp_path, deck):
    """spacing and coordination of the reference specimen: nothing is scaled. kv of a row is that typed. Control: another spacing or kv is another stiffness."""
    write_body(tmp_path, **CYLINDER)
    stress = {}
    (tmp_path / "other.evp").write_text(HEADER + f"own {ROW} spacing 0.0117 coordination 11.9\n")
    for key, choices in (("coeff", {"coeff": ROW}), ("own", {"material": "rows.evp:own"}), ("plain", {"material": "rows.evp:plain"}),
                         ("stiff", {"material": "rows.evp:stiff"}), ("kv", {"coeff": f"{ROW} kv 1000"}), ("other", {"material": str(tmp_path / "other.evp") + ":own"})):
        pull(tmp_path, deck, **choices).ok()
        stress[key] = read_csv(tmp_path / "pull.csv")["stress_virial"]
    assert stress["own"] == pytest.approx(stress["coeff"], rel=1e-5, abs=1e3) and np.array_equal(stress["plain"], stress["coeff"])
    assert stress["stiff"] == pytest.approx(stress["kv"], rel=1e-5, abs=1e3)
    largest = {key: np.abs(values).max() for key, values in stress.items()}
    assert largest["other"] < 0.2 * largest["coeff"] and largest["stiff"] > 1.05 * largest["coeff"], "control"


def test_one_row_has_the_same_stiffness_in_bodies_of_other_shapes(tmp_path):
    """A cylinder and a block of the same row, 1500 spheres, at rest: E within the scatter of two packings of that size."""
    (tmp_path / "rows.evp").write_text(ROWS)
    found = {}
    for shape, choices in (("cylinder", {}), ("block", {"width": 0.012, "height": 0.012})):
        run_lammps("in.specimen", 1, {"n": 1500, "shape": shape, "out": "body.data", **choices}, tmp_path).ok()
        pull(tmp_path, "in.quasistatic", material="rows.evp:own", strain=0.002).ok()
        curve = read_csv(tmp_path / "pull.csv")
        found[shape] = slope(curve["strain"], curve["stress_virial"]) / 1e9
    assert found["cylinder"] == pytest.approx(22.0, rel=0.03) and found["block"] == pytest.approx(found["cylinder"], rel=0.03)
