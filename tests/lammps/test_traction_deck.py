# SPDX-License-Identifier: GPL-2.0-only
"""What in.traction lets users add, its rows, its end and what it prints."""

import re

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import specimen
from lammps_run import read_csv

LEDGER_SHARE = 1e-3  # of the work: what the robustness tests allow
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"
LEDGER = "fix ledger all evp/energy\nthermo_style custom step c_dt f_ledger f_ledger[7] f_bonds[3]\nthermo_modify colname c_dt c_dt\n"


def test_energy_is_the_work_of_the_grips(lmp, tmp_path):
    """Commands of the user are taken in before the pull: to 0.5 % the work is the trapezoid of the grip forces at every step."""
    (tmp_path / "more.lmp").write_text(LEDGER + 'fix work all print 1 "$(v_strain_now:%.12g),$(v_stress_grip:%.12g)" file work.txt screen no title strain,stress\n')
    table = lmp("in.traction", variables={"specimen": REFERENCE, "strain": 0.005, "out": "pull", "also": "more.lmp"}).ok().thermo()
    curve = read_csv(tmp_path / "work.txt")
    assert len(curve["strain"]) == table["Step"][-1] + 1, "control: every step has a row"
    work = np.pi * 0.02**2 * 0.04 * np.sum(0.5 * (curve["stress"][1:] + curve["stress"][:-1]) * np.diff(curve["strain"]))
    assert table["f_ledger[7]"][-1] == pytest.approx(work, rel=5e-4) and work > 5.0
    assert np.abs(table["f_ledger"]).max() < LEDGER_SHARE * work


def test_new_contacts_in_compression(lmp, tmp_path):
    """Pairs that meet with literal contact are fast and few: with the timestep of the start the energy balance closes to a strain of -0.1."""
    (tmp_path / "more.lmp").write_text(LEDGER)
    variables = {"specimen": REFERENCE, "rate": 50, "strain": -0.1, "row": 0.0005, "out": "push", "also": "more.lmp"}
    table = lmp("in.traction", variables=variables).ok().thermo()
    assert np.abs(table["f_ledger"]).max() < LEDGER_SHARE * np.abs(table["f_ledger[7]"]).max()
    assert table["f_bonds[3]"][-1] > 100, "control: pairs have met"
    assert read_csv(tmp_path / "push.csv")["stress_virial"][-1] < -100e6


@pytest.mark.parametrize("ranks, choices", [(1, {"row": 0.0007, "rate": -10}), (2, {"row": 0.0003, "rate": 8, "coeff": TABLE2, "integrator": "implicit"})])
def test_rows_and_end(lmp, tmp_path, ranks, choices):
    """Rows are no farther apart than asked and divide the strain, at which the run ends. A misspelled choice is seen in the line of choices."""
    sign = -1 if choices["rate"] < 0 else 1
    run = lmp("in.traction", ranks, {"specimen": REFERENCE, "contact": "none", "out": "pull", "strain": 0.001, "streain": 0.5, **choices}).ok()
    assert re.search(r"^in\.traction: .*, strain 0\.001, ", run.stdout, re.M) and len(run.stdout.splitlines()) <= 100
    strains = sign * read_csv(tmp_path / "pull.csv")["strain"]
    rows = np.ceil(0.001 / choices["row"] - 1e-9)
    assert len(strains) == rows + 1 and np.diff(strains[1:]) == pytest.approx(0.001 / rows, rel=1e-5)
    x = run.dump("pull_state.dump")[-1]["x"] - specimen.read_data(REFERENCE).x[:, 0]
    assert sign * (x.max() - x.min()) == pytest.approx(sign * 0.04 * 0.001, rel=1e-3), "the grips are the outermost"


def test_inertia_is_told(lmp, tmp_path):
    """The strain while a wave crosses the body, over xi_s, from the speed of sound of Table 1: within a fifth."""
    sound = np.sqrt(21e9 / (2700 * 0.586))
    run = lmp("in.traction", variables={"specimen": REFERENCE, "rate": 100, "strain": 0.0005, "out": "pull"}).ok()
    said = float(re.search(r"while a wave crosses the body: (\S+) xi_s", run.stdout)[1])
    assert said == pytest.approx(100 * 0.05 / sound / 0.005, rel=0.2)
