# SPDX-License-Identifier: GPL-2.0-only
"""What in.traction lets users add, and very long pulls."""

from conftest import REFERENCE
from evp import specimen

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


def test_missing_file_of_commands(lmp):
    run = lmp("in.traction", variables={"specimen": REFERENCE, "out": "pull", "also": "absent.lmp"})
    assert run.returncode != 0 and "absent.lmp" in run.stdout


def test_pull_of_millions_of_steps(lmp, tmp_path):
    """More than LAMMPS' largest number of steps over a thousand; stopped by the clock, it says how far it came."""
    (tmp_path / "clock.lmp").write_text("timer timeout 0:00:01 every $(v_steps_per_row)\n")  # 29Sep2021 writes the last state of a row only
    variables = {"specimen": REFERENCE, "coeff": TABLE2, "rate": 0.1, "strain": 0.02, "row": 1e-6, "samples": 1, "out": "pull", "also": "clock.lmp"}
    run = lmp("in.traction", variables=variables).ok()
    assert "WARNING: the pull ended at a strain of" in run.stdout
    steps = int(next(line for line in run.stdout.splitlines() if line.startswith("step ")).split(";")[1].split()[0])
    assert steps > 2**31 / 1000, "control: that many steps"


def test_pull_that_ends_on_strain_does_not_warn(lmp):
    run = lmp("in.traction", variables={"specimen": REFERENCE, "strain": 0.0005, "out": "pull"}).ok()
    assert "WARNING: the pull ended" not in run.stdout


def test_zone_of_the_bonds(lmp):
    """Fewer bonds with a smaller zone, the number that the pairs of the data file give; one beyond alpha is refused."""
    body = specimen.read_data(REFERENCE)
    variables = {"specimen": REFERENCE, "strain": 0.0002, "out": "pull", "contact": "none"}
    for zone, reach in ((0, 1.5), (1.3, 1.3)):
        run = lmp("in.traction", variables={**variables, "zone": zone}).ok()
        assert f"recorded {len(specimen.pairs_within(body, reach)[0])} pairs" in run.stdout, zone
    run = lmp("in.traction", variables={**variables, "zone": 1.6})
    assert run.returncode != 0 and "zone 1.6 reaches beyond" in run.stdout
