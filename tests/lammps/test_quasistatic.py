# SPDX-License-Identifier: GPL-2.0-only
"""in.quasistatic on the reference specimen: an independent prototype's curve, resuming. With plasticity: test_plastic_specimen.py.

The state at rest is not unique: at 1 % a single bond at the edge of dlim carries 0.1 to 0.3 % of the stress of 500
spheres, and whether it has gone depends on the way there. Elsewhere the tolerances are those of tests/data/reference_500."""

import json
import re
import shutil

import numpy as np
import pytest
from lammps_run import REFERENCE, edited_deck, read_csv, run_lammps, slope

PUBLISHED = json.loads(REFERENCE.with_suffix(".json").read_text())
MPA = 1e6
AT_REST = np.sqrt(410) * 0.73 / 1.26e-3  # [Pa] what is left on the free atoms: 410 of them with less than 0.73 N each, in random directions, on 1.26e-3 m2


def pull(folder, ranks=1, **choices):
    """A run of the deck, and its curve with the counts of bonds."""
    run = run_lammps("in.quasistatic", ranks, {"specimen": REFERENCE, "out": "rest", **choices}, folder).ok()
    return run, read_csv(folder / "rest.csv")


@pytest.mark.parametrize("contact, tolerance", [("none", 1e-3), ("literal", 3e-3)])
def test_the_curve_of_the_prototype(tmp_path, contact, tolerance):
    """Stress and stiffness; in 41 rows, at most 100 lines, and a fifth of the steps that the slower of the paper's rates, 1/s, takes at 0.9 of the stable
    step. Both stresses are one force; the state at the end is what the counts say."""
    run, curve = pull(tmp_path, contact=contact)
    for strain, stress in PUBLISHED[f"quasistatic_stress_MPa_contact_{contact}"].items():
        row = int(np.argmin(np.abs(curve["strain"] - float(strain))))
        assert curve["strain"][row] == pytest.approx(float(strain), rel=1e-6)
        assert curve["stress_virial"][row] / MPA == pytest.approx(stress, rel=tolerance), strain
    start = curve["strain"] <= 0.00301
    measured = slope(curve["strain"][start], curve["stress_virial"][start]) / 1e9
    assert measured == pytest.approx(PUBLISHED[f"E_GPa_virial_0_0.3pc_10s_{contact}"], rel=0.015)
    assert np.abs(curve["stress_grip"] - curve["stress_virial"]).max() < AT_REST and curve["stress_grip"].max() > 145 * MPA
    state = run.dump("rest_state.dump")[-1]
    assert len(curve["strain"]) == 41 and len(run.stdout.splitlines()) <= 100 and not run.warnings()
    assert 5 * state.step < 0.02 / 1.0 / (0.9 * 9.025e-7)
    recorded, second, lost, fresh = (state[name] for name in ("bonds", "share_second", "share_lost", "new_pairs"))
    for shares, column in ((recorded * second, "second_regime"), (recorded * lost, "beyond_dlim"), (fresh, "new_pairs")):
        assert shares.sum() == pytest.approx(2.0 * curve[column][-1], abs=1e-3), column
        assert (curve[column][-1] > 0) == (column != "new_pairs" or contact == "literal"), "control"


def test_a_run_that_stopped_on_the_way_back_goes_on(tmp_path):
    """In flow, and in the middle of a minimization: the same on as many ranks, stress to 1 Pa; on others to 1e-6 of the largest, as the order of the atoms is
    another one."""
    choices = {"contact": "none", "plasticity": "isotropic", "strain": 0.01, "increment": 0.001, "cycles": 1, "lower": "release"}
    folders = [tmp_path / name for name in ("whole", "one", "two")]
    for folder in folders[:2]:
        folder.mkdir()
    _, whole = pull(folders[0], **choices)
    assert whole["strain"][-1] > 0.002 and abs(whole["stress_grip"][-1]) < 0.001 * whole["stress_grip"].max(), "control: it flowed, and is released"
    (tmp_path / "stop.lmp").write_text('if "${k} == 12" then "quit 1"\n')
    stopped = run_lammps("in.quasistatic", 1, {"specimen": REFERENCE, "out": "rest", **choices, "also": tmp_path / "stop.lmp"}, folders[1])
    assert stopped.returncode != 0 and len(read_csv(folders[1] / "rest.csv")["strain"]) == 13, "control: the row of increment 12 has no restart file"
    shutil.copytree(folders[1], folders[2])
    for ranks, folder in enumerate(folders[1:], start=1):
        run, rest = pull(folder, ranks, **choices, resume="yes")
        assert "recorded" not in run.stdout, "the bonds come from the file"
        for name, digit in (("stress_grip", 1.0), ("stress_virial", 1.0), ("strain", 1e-12), ("strain_gauge", 1e-12)):
            tolerances = (1e-8, digit) if ranks == 1 else (0.0, 1e-6 * np.abs(whole[name]).max())
            assert np.allclose(rest[name], whole[name], *tolerances), (ranks, name)


def test_a_run_goes_on_with_its_own_body_and_material_only(tmp_path):
    """The restart file has those of the first run: others would be named in the output, and would not be what was loaded."""
    choices = {"strain": 0.001, "contact": "none"}
    pull(tmp_path, **choices)
    body = REFERENCE.with_name(REFERENCE.name + ".body").read_text()
    (tmp_path / "other.data.body").write_text(re.sub("variable area equal .*", "variable area equal 1e-3", body))
    for other in ({"coeff": "81 8 4 3 8 4 0.005 0 1.5"}, {"coeff": "80 8 4 3 8 4 0.0051 0 1.5"}, {"coeff": "80 12 4 3 8 4 0.005 0 1.5"},
                  {"plasticity": "isotropic"}, {"contact": "repulsive"}, {"specimen": "other.data"}):
        run = run_lammps("in.quasistatic", 1, {"specimen": REFERENCE, "out": "rest", **choices, "resume": "yes", **other}, tmp_path)
        assert run.returncode != 0 and "ERROR: rest.resume is of another specimen, material, plasticity or contact: " in run.stdout, other
    run = run_lammps("in.quasistatic", 1, {"specimen": REFERENCE, "out": "rest", **choices, "resume": "yes", "break": 0.1}, tmp_path)
    assert run.returncode != 0 and "ERROR: rest.resume: -var break must be none, got '0.1'" in run.stdout
    assert len(pull(tmp_path, **{**choices, "strain": 0.002}, resume="yes")[1]["strain"]) == 5


@pytest.mark.parametrize("deck, choices", [("in.quasistatic", {}), ("in.torsion", {"increment": 0.02}), ("in.bending", {"increment": 0.02})])
def test_an_increment_that_does_not_come_to_rest_stops(tmp_path, deck, choices):
    """Minimizations end after 40000 iterations: here after two."""
    run = run_lammps(edited_deck(deck, tmp_path, "40000 40000", "2 2"), 1, {"specimen": REFERENCE, "out": "rest", **choices}, tmp_path)
    assert run.returncode != 0 and re.search("^ERROR: increment 1 did not come to rest: a force of .* N is left", run.stdout, re.M)
