# SPDX-License-Identifier: GPL-2.0-only
"""Decks take the measures of a body from FILE.body, and its material from a row: in.traction for those with the same lines, tests/tools/test_project_files.py."""

import re
import shutil

import numpy as np
import pytest
from evp import specimen
from lammps_run import DECKS as FOLDER
from lammps_run import REFERENCE, read_csv, run_lammps, slope

DECKS = ("in.traction", "in.quasistatic")
CYLINDER = {"length": 0.05, "radius": 0.02, "area": np.pi * 0.02**2, "volume": np.pi * 0.02**2 * 0.05, "solid_fraction": 0.58156, "density": 4642.7}
ROW = "80 8 4 3 8 4 0.005 0 1.5"
HEADER = "# DATE: 2026-11-22 UNITS: si CONTRIBUTOR: tests CITATION: none\n"
ROWS = HEADER + f"""own {ROW} spacing 0.005851894738785831 coordination 11.9
plain {ROW}
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
    stress = []
    for share in (1.0, 0.6):
        write_body(tmp_path, **{**CYLINDER, "area": share * CYLINDER["area"]})
        pull(tmp_path, deck).ok()
        stress.append(share * read_csv(tmp_path / "pull.csv")["stress_grip"][-1])
    assert stress[1] == pytest.approx(stress[0], rel=1e-3)


def test_bodies_that_are_refused(tmp_path):
    """Without their file; of dimensions that are equal-style variables, as of in.specimen and tools/body.py, which -var cannot replace in silence."""
    write_body(tmp_path)
    for choices, message in (({}, "^ERROR.*body.data.body"), ({"specimen": REFERENCE, "length": 0.03}, "Cannot redefine .*variable")):
        run = pull(tmp_path, **choices)
        assert run.returncode != 0 and re.search(message, run.stdout, re.M) and not (tmp_path / "pull.csv").exists()


@pytest.mark.parametrize("choices, contact", [({}, "literal"), ({"material": "rows.evp:plain"}, "join"), ({"plasticity": "isotropic"}, "join"), (
    {"material": "rows.evp:plain", "plasticity": "none", "contact": "literal"}, "literal"), ({"plasticity": "isotropic", "contact": "none"}, "none")])
def test_contact_is_join_with_a_row_and_with_flow_unless_given(tmp_path, choices, contact):
    write_body(tmp_path, **CYLINDER)
    (tmp_path / "rows.evp").write_text(ROWS)
    text = run_lammps("in.traction", 1, {"specimen": "body.data", "out": "pull", "strain": 0.001, **choices}, tmp_path).ok().stdout
    assert re.search(rf"evp/lj: damping off, contact {contact}(?: within 1\.2 \(R_i \+ R_j\))?, deq of bonds", text) and f", contact {contact}, plasticity" in text


@pytest.mark.parametrize("deck", DECKS)
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


def test_a_row_that_names_its_bodies_is_that_of_coeff_on_its_own_body(tmp_path):
    """spacing and coordination of the reference specimen: nothing is scaled. kv of a row is that typed. Control: another spacing or kv is another stiffness."""
    write_body(tmp_path, **CYLINDER)
    stress = {}
    (tmp_path / "other.evp").write_text(HEADER + f"own {ROW} spacing 0.0117 coordination 11.9\n")
    for key, choices in (("coeff", {"coeff": ROW}), ("own", {"material": "rows.evp:own"}), ("plain", {"material": "rows.evp:plain"}),
                         ("stiff", {"material": "rows.evp:stiff"}), ("kv", {"coeff": f"{ROW} kv 1000"}), ("other", {"material": f"{tmp_path}/other.evp:own"}),
                         ("shipped", {"material": f"{FOLDER.parent}/potentials/gado2017.evp:table1_any", "plasticity": "none"})):
        pull(tmp_path, **choices).ok()
        stress[key] = read_csv(tmp_path / "pull.csv")["stress_virial"]
    assert stress["own"] == pytest.approx(stress["coeff"], rel=1e-5, abs=1e3) and np.array_equal(stress["plain"], stress["coeff"])
    assert stress["shipped"] == pytest.approx(stress["coeff"], rel=0.01, abs=1e3) and stress["stiff"] == pytest.approx(stress["kv"], rel=1e-5, abs=1e3)
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
