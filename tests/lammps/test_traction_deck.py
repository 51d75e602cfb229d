# SPDX-License-Identifier: GPL-2.0-only
"""What in.traction lets users add, its rows and its end, and very long pulls."""

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


def test_new_contacts_in_compression_cost_no_steps(lmp, tmp_path):
    """Pairs that meet with literal contact are fast and few: the timestep is the one planned to the end, the energy balance closes, and a smaller
    displacement per step is what the deck spares."""
    (tmp_path / "more.lmp").write_text("fix ledger all evp/energy\nthermo_style custom step f_step[1] f_step[2] f_ledger f_ledger[7]\n")
    variables = {"specimen": REFERENCE, "rate": 50, "strain": -0.1, "row": 0.0005, "out": "push", "also": "more.lmp"}
    run = lmp("in.traction", variables=variables).ok()
    table, planned = run.thermo(), int(re.search(r"; (\d+) steps$", run.stdout, re.M)[1])
    assert table["Step"][-1] == planned
    assert np.abs(table["f_ledger"]).max() < LEDGER_SHARE * np.abs(table["f_ledger[7]"]).max()
    assert (0.1 * table["f_step[2]"]).min() < 0.5 * (0.4 * table["f_step[1]"]).min(), "control: a tenth of the displacement would take steps twice as many"


def test_missing_file_of_commands(lmp):
    run = lmp("in.traction", variables={"specimen": REFERENCE, "out": "pull", "also": "absent.lmp"})
    assert run.returncode != 0 and "absent.lmp" in run.stdout


def test_pull_of_millions_of_steps(lmp, tmp_path):
    """More than LAMMPS' largest number of steps over a thousand; stopped by the clock, it says how far it came."""
    (tmp_path / "clock.lmp").write_text("timer timeout 0:00:01\n")
    variables = {"specimen": REFERENCE, "coeff": TABLE2, "rate": 0.1, "strain": 0.02, "row": 1e-6, "samples": 1, "out": "pull", "also": "clock.lmp"}
    run = lmp("in.traction", variables=variables).ok()
    assert "WARNING: the run ended at a strain of" in run.stdout
    steps = int(next(line for line in run.stdout.splitlines() if line.startswith("timestep ")).split(";")[1].split()[0])
    assert steps > 2**31 / 1000, "control: that many steps"


def test_pull_that_ends_on_strain_does_not_warn(lmp):
    run = lmp("in.traction", variables={"specimen": REFERENCE, "strain": 0.0005, "out": "pull"}).ok()
    assert "WARNING: the run ended" not in run.stdout


def test_zone_of_the_bonds(lmp):
    """Fewer bonds with a smaller zone, the number that the pairs of the data file give; one beyond alpha is refused."""
    body = specimen.read_data(REFERENCE)
    variables = {"specimen": REFERENCE, "strain": 0.0002, "out": "pull", "contact": "none"}
    for zone, reach in ((0, 1.5), (1.3, 1.3)):
        run = lmp("in.traction", variables={**variables, "zone": zone}).ok()
        assert f"recorded {len(specimen.pairs_within(body, reach)[0])} pairs" in run.stdout, zone
    run = lmp("in.traction", variables={**variables, "zone": 1.6})
    assert run.returncode != 0 and "zone 1.6 reaches beyond" in run.stdout


def ends(folder, lmp, **variables):
    """Strains of the rows of both files of a pull of the reference specimen, and what it printed."""
    run = lmp("in.traction", variables={"specimen": REFERENCE, "contact": "none", "out": "pull", **variables}).ok()
    return read_csv(folder / "pull.csv")["strain"], read_csv(folder / "pull_bonds.csv")["strain"], run


@pytest.mark.parametrize("rate, timestep, samples", [(8, 1.2e-5, 1), (4, 1.2e-5, 2), (2, 1.5e-5, 3), (0.9, 1.1e-5, 10)])
def test_rows_are_no_farther_apart_than_asked_with_large_timesteps(lmp, tmp_path, rate, timestep, samples):
    """The samples of a row are those that it has timesteps for; ten are asked for."""
    strains, states, run = ends(tmp_path, lmp, coeff=TABLE2, integrator="implicit", rate=rate, timestep=timestep, strain=0.0011)
    assert np.diff(strains).max() <= 1e-4 * (1 + 1e-6) and np.diff(states).max() <= 1e-4 * (1 + 1e-6)
    assert (f"samples per row: {samples}, not 10" in run.stdout) == (samples < 10)
    assert -1e-9 < states[-1] - 0.0011 < rate * timestep
    assert len(states) > 11, "control"


@pytest.mark.parametrize("ranks, choices", [
    (1, {"row": 0.00035}), (2, {"row": 0.00035, "samples": 1}), (1, {"row": 0.0007, "timestep": 7e-7}),
    (2, {"row": 0.0003, "rate": 8, "coeff": TABLE2, "integrator": "implicit", "timestep": 1.2e-5})])
def test_pull_ends_on_a_strain_that_rows_do_not_divide(lmp, tmp_path, ranks, choices):
    """Both files and the dump end less than a timestep beyond the strain asked for, and no row is longer."""
    strain, rate = 0.001, choices.get("rate", 10)
    strains, states, run = ends(tmp_path, lambda deck, variables: lmp(deck, ranks, variables), strain=strain, **choices)
    printed = next(line for line in run.stdout.splitlines() if line.startswith("timestep "))
    beyond = 1.0001 * rate * float(printed.split()[1])
    for found in (strains, states):
        assert -1e-9 < found[-1] - strain < beyond and np.diff(found).max() <= choices["row"] * (1 + 1e-6)
    x = run.dump("pull_state.dump")[-1]["x"] - specimen.read_data(REFERENCE).x[:, 0]
    assert x.max() - x.min() == pytest.approx(0.04 * states[-1], rel=1e-4), "the grips are the outermost"


@pytest.mark.parametrize("choices", [{"row": 0.0001}, {"row": 0.00025, "timestep": 2.5e-7, "samples": 4}, {"row": 0.0005}])
def test_rows_that_divide_the_strain_are_all(lmp, tmp_path, choices):
    """No row is added to them, whatever the round-off of the timestep."""
    strains, states, _ = ends(tmp_path, lmp, strain=0.0005, **choices)
    assert len(strains) == len(states) == 1 + round(0.0005 / choices["row"])
    assert states[-1] == pytest.approx(0.0005, rel=1e-8)


def test_shorter_last_row_goes_on_from_the_others(lmp, tmp_path):
    """Implicit damping leaves no vibration: the stress at the end is on the line through the rows, and the ledger stays closed."""
    (tmp_path / "more.lmp").write_text(
        'fix ledger all evp/energy\nfix mine all print 1 "open $(f_ledger) of $(f_ledger[7])" file ledger.txt screen no\n')
    choices = {"coeff": TABLE2, "integrator": "implicit", "rate": 9, "timestep": 3e-6, "row": 0.0003, "also": "more.lmp"}
    ends(tmp_path, lmp, strain=0.0017, **choices)
    curve = read_csv(tmp_path / "pull.csv")
    assert len(curve["strain"]) == 9, "control: the first state, six rows, what was left, the end"
    line = np.polyfit(curve["strain"][2:-2], curve["stress_virial"][2:-2], 2)
    assert curve["stress_virial"][-2:] == pytest.approx(np.polyval(line, curve["strain"][-2:]), rel=3e-3)
    rows = [line.split() for line in (tmp_path / "ledger.txt").read_text().splitlines() if line.startswith("open")]
    assert abs(float(rows[-1][1])) < LEDGER_SHARE * float(rows[-1][3])


@pytest.mark.parametrize("choices, message", [
    ({"row": 0.4}, "row = 0.4 is more than strain = 0.02: give -var row 0.02 or less"),
    ({"row": 0.0007, "strain": 0.0006}, "row = 0.0007 is more than strain = 0.0006: give -var row 0.0006 or less"),
    ({"timestep": 1.3e-5, "rate": 20, "coeff": TABLE2, "integrator": "implicit"}, "the strain per timestep is 0.00026, more than row = 0.0001: "
                                                                                  "give -var row 0.00026, or -var timestep 5e-06 or less")])
def test_rows_that_cannot_be_are_refused(lmp, tmp_path, choices, message):
    run = lmp("in.traction", variables={"specimen": REFERENCE, "out": "pull", **choices}, seconds=20)
    assert run.returncode != 0 and f"\nERROR: {message}\n" in run.stdout, run.stdout[-1000:]
    assert not (tmp_path / "pull.csv").exists()


@pytest.mark.parametrize("deck", ["in.traction", "in.cyclic"])
def test_unstable_timestep_is_told_before_its_rows(lmp, tmp_path, deck):
    """The remedy is the timestep, though the strain per timestep is more than a row as well; and the remedy works."""
    choices = {"specimen": REFERENCE, "out": "pull", "strain": 0.0004, "row": 0.0002, "rate": 50}
    run = lmp(deck, variables={**choices, "timestep": 1e-4})
    found = re.search(r"^ERROR: the timestep 0.0001 s is (\S+) times the largest stable timestep .* give -var timestep (\S+) or less$", run.stdout, re.M)
    assert run.returncode != 0 and found and float(found[1]) > 10.0, run.stdout[-1000:]
    assert "strain per timestep" not in run.stdout and not (tmp_path / "pull.csv").exists()
    lmp(deck, variables={**choices, "timestep": found[2]}).ok()


def test_coefficients_of_the_paper_warn_on_a_body_of_another_size(lmp, tmp_path):
    """E is that of the warning; a row with its spacing, as it says, gives that of the paper without a word."""
    lmp("in.specimen", variables={"n": 300, "length": 0.03, "radius": 0.01, "out": "small.data"}).ok()
    choices = {"specimen": "small.data", "strain": 2e-4, "increment": 1e-4, "restart": 0, "contact": "none"}
    run = lmp("in.quasistatic", variables={**choices, "out": "paper"}).ok()
    found = re.search(r"^WARNING: the volume of the body is 0.15 of that of the paper.*E is about (\S+) times as large; "
                      r"give -var material potentials/gado2017.evp:table1_any", run.stdout, re.M)
    row = POTENTIALS / "gado2017.evp:table1_any"
    silent = lmp("in.quasistatic", variables={**choices, "out": "any", "material": row}).ok()
    of_paper = lmp("in.quasistatic", variables={**choices, "out": "same", "specimen": REFERENCE}).ok()
    assert "the volume of the body" not in silent.stdout + of_paper.stdout
    stress = {name: read_csv(tmp_path / f"{name}.csv")["stress_grip"][-1] for name in ("paper", "any", "same")}
    assert stress["paper"] / stress["any"] == pytest.approx(float(found[1]), rel=0.2)


def test_remedies_for_refused_rows_work(lmp, tmp_path):
    for choices in ({"row": 0.0006, "strain": 0.0006}, {"timestep": 1.3e-5, "rate": 20, "row": 0.00026}, {"timestep": 5e-6, "rate": 20}):
        ends(tmp_path, lmp, **{"strain": 0.0006, "coeff": TABLE2, "integrator": "implicit", **choices})
