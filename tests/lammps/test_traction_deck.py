# SPDX-License-Identifier: GPL-2.0-only
"""What in.traction lets users add, its rows and its end, and bodies that are not the paper's."""

import pathlib
import re

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import specimen
from lammps_run import read_csv

POTENTIALS = pathlib.Path(__file__).resolve().parents[2] / "potentials"
LEDGER_SHARE = 1e-3  # of the work: what the hard cases allow
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"


def test_commands_of_the_user_are_taken_in_before_the_pull(lmp, tmp_path):
    (tmp_path / "more.lmp").write_text('fix ledger all evp/energy\nfix mine all print 100 "open $(f_ledger) of $(f_ledger[7])" file ledger.txt screen no\n')
    variables = {"specimen": REFERENCE, "strain": 0.005, "out": "pull", "also": "more.lmp"}
    lmp("in.traction", variables=variables).ok()
    rows = [line.split() for line in (tmp_path / "ledger.txt").read_text().splitlines() if line.startswith("open")]
    assert len(rows) > 2
    opened, work = float(rows[-1][1]), float(rows[-1][3])
    assert work > 0.0 and abs(opened) < LEDGER_SHARE * work


def test_new_contacts_in_compression(lmp, tmp_path):
    """Pairs that meet with literal contact are fast and few: with the timestep of the start the energy balance closes to a strain of -0.1."""
    (tmp_path / "more.lmp").write_text("fix ledger all evp/energy\nthermo_style custom step c_dt f_ledger f_ledger[7] f_bonds[3]\nthermo_modify colname c_dt c_dt\n")
    variables = {"specimen": REFERENCE, "rate": 50, "strain": -0.1, "row": 0.0005, "out": "push", "also": "more.lmp"}
    table = lmp("in.traction", variables=variables).ok().thermo()
    assert np.abs(table["f_ledger"]).max() < LEDGER_SHARE * np.abs(table["f_ledger[7]"]).max()
    assert table["f_bonds[3]"][-1] > 100, "control: pairs have met"
    assert read_csv(tmp_path / "push.csv")["stress_virial"][-1] < -100e6


def test_missing_file_of_commands(lmp):
    run = lmp("in.traction", variables={"specimen": REFERENCE, "out": "pull", "also": "absent.lmp"})
    assert run.returncode != 0 and "absent.lmp" in run.stdout


@pytest.mark.parametrize("ranks, choices", [
    (1, {}), (2, {"row": 0.00035}), (1, {"row": 0.0007}), (2, {"rate": -10}), (1, {"rate": 300}),
    (2, {"row": 0.0003, "rate": 8, "coeff": TABLE2, "integrator": "implicit"})])
def test_rows_and_end(lmp, tmp_path, ranks, choices):
    """Rows are no farther apart than asked and divide the strain, at which the run ends."""
    sign = -1 if choices.get("rate", 1) < 0 else 1
    run = lmp("in.traction", ranks, {"specimen": REFERENCE, "contact": "none", "out": "pull", "strain": 0.001, **choices}).ok()
    strains = sign * read_csv(tmp_path / "pull.csv")["strain"]
    rows = np.ceil(0.001 / choices.get("row", 1e-4) - 1e-9)
    assert len(strains) == rows + 1 and np.diff(strains[1:]) == pytest.approx(0.001 / rows, rel=1e-5)
    x = run.dump("pull_state.dump")[-1]["x"] - specimen.read_data(REFERENCE).x[:, 0]
    assert sign * (x.max() - x.min()) == pytest.approx(sign * 0.04 * 0.001, rel=1e-3), "the grips are the outermost"


def test_a_misspelled_choice_is_seen_in_the_line_of_choices(lmp):
    run = lmp("in.traction", variables={"specimen": REFERENCE, "streain": 0.5, "strain": 0.0002, "out": "pull"}).ok()
    assert re.search(r"^in\.traction: .*, strain 0\.0002, ", run.stdout, re.M)
    assert len(run.stdout.splitlines()) <= 100


def test_inertia_is_told(lmp, tmp_path):
    """The strain while a wave crosses the body, over xi_s, from the speed of sound of Table 1: within a fifth."""
    sound = np.sqrt(21e9 / (2700 * 0.586))
    run = lmp("in.traction", variables={"specimen": REFERENCE, "rate": 100, "strain": 0.0005, "out": "pull"}).ok()
    said = float(re.search(r"while a wave crosses the body: (\S+) xi_s", run.stdout)[1])
    assert said == pytest.approx(100 * 0.05 / sound / 0.005, rel=0.2)


def test_nine_numbers_hold_for_a_body_of_any_size(lmp, tmp_path):
    """Scaled with the spheres per volume, as a row with its spacing is by its bonds: E is that of the paper's body."""
    lmp("in.specimen", variables={"n": 300, "length": 0.03, "radius": 0.01, "out": "small.data"}).ok()
    choices = {"specimen": "small.data", "strain": 2e-4, "increment": 1e-4, "contact": "none"}
    lmp("in.quasistatic", variables={**choices, "out": "paper"}).ok()
    lmp("in.quasistatic", variables={**choices, "out": "any", "material": POTENTIALS / "gado2017.evp:table1_any"}).ok()
    lmp("in.quasistatic", variables={**choices, "out": "same", "specimen": REFERENCE}).ok()
    stress = {name: read_csv(tmp_path / f"{name}.csv")["stress_grip"][-1] for name in ("paper", "any", "same")}
    assert stress["paper"] == pytest.approx(stress["any"], rel=0.15) and stress["paper"] == pytest.approx(stress["same"], rel=0.15)
