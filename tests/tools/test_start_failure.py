# SPDX-License-Identifier: GPL-2.0-only
"""Runs that do not start: mpirun as root, an mpirun that refuses, an lmp without its libraries. The message is theirs, and nothing is tried again."""

import os
import subprocess

import calibrate
import pytest
from evp import calibration, run
from evp.calibration import Table, Targets
from evp.run import RunError
from inputs import call, program

SLOTS = f"""{74 * '-'}
There are not enough slots available in the system to satisfy the 2
slots that were requested by the application:

  lmp

Either request fewer slots, or make more available.
{74 * '-'}"""
SAID = "There are not enough slots available in the system to satisfy the 2 slots that were requested by the application:"


@pytest.fixture
def refusing(tmp_path, monkeypatch):
    """An mpirun that counts its starts and refuses each; gives the file of the count."""
    monkeypatch.setenv("EVP_MPIRUN", str(program(tmp_path / "mpirun", f"echo start >> {tmp_path}/starts\ncat >&2 <<'END'\n{SLOTS}\nEND\nexit 1")))
    monkeypatch.setenv("EVP_LMP", "/bin/true")
    return tmp_path / "starts"


def test_root_may_start_ranks(monkeypatch):
    """The variables are those of Open MPI, for root alone; without them the real mpirun refuses root."""
    names = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM")
    for name in names:
        monkeypatch.delenv(name, raising=False)
    started = subprocess.run(["mpirun", "-np", "1", "true"], env=run.environment(), stdin=subprocess.DEVNULL, check=False)
    assert started.returncode == 0
    if os.geteuid() == 0:
        assert subprocess.run(["mpirun", "-np", "1", "true"], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode, "control"
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert [run.environment().get(name) for name in names] == ["1", "1"]
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert [run.environment().get(name) for name in names] == [None, None]


def test_calibration_does_not_try_again(refusing, tmp_path, monkeypatch):
    """A search would halve the increments; the body would be packed twice. The command says it."""
    body = calibration.Body(tmp_path / "body.data", 4000, 26000, 0.003, 1e-5)
    table = Table(tmp_path / "t.jsonl", {})
    try:
        search = calibration.Search(Targets(70e9, 95e6, ((150e6, 0.05),), 2700.0), body, table, 2, tmp_path, 10.0, print)
        with pytest.raises(RunError, match=f"in.quasistatic: LAMMPS did not start .exit 1.: {SAID}\n.*run evp doctor"):
            search.pull()
        assert refusing.read_text().split() == ["start"] and not table.runs
    finally:
        table.close()
    monkeypatch.setattr(calibration, "make_body", lambda *_: body)
    done = call(calibrate.main, *"--E 70e9 --yield 95e6 --stress 150e6@0.05 --density 2700 --name mine --ranks 2 --out".split(), tmp_path / "m.evp")
    assert done.returncode == 1 and SAID in done.stderr and "run evp doctor" in done.stderr and not (tmp_path / "m.evp").exists()


def test_an_lmp_without_its_library(tmp_path, monkeypatch):
    """One rank: the loader's line. No second packing is tried."""
    lmp = program(tmp_path / "lmp", f"echo start >> {tmp_path}/starts\necho 'lmp: error while loading shared libraries: liblammps.so.0' >&2\nexit 127")
    monkeypatch.setenv("EVP_LMP", str(lmp))
    with pytest.raises(RunError, match="exit 127.: lmp: error while loading shared libraries: liblammps.so.0\n"):
        calibration.make_body(tmp_path, 100, 1, 2700.0, 10.0)
    assert (tmp_path / "starts").read_text().split() == ["start"]


@pytest.mark.parametrize("text, code", [
    ("LAMMPS (4 Feb 2025)\nERROR: Lost atoms", 1), ("mpirun noticed that process rank 1 exited on signal 11 (Segmentation fault).", 139),
    ("BAD TERMINATION OF ONE OF YOUR APPLICATION PROCESSES", 11), ("", -11), ("ERROR: Invalid command-line argument", 1)])
def test_runs_that_had_started(text, code):
    """They are tried again, or told in LAMMPS' words."""
    assert run.start_failure(text, code, 2) == "" and run.start_failure(f"{text}\n{SLOTS}", code, 1) == ""
    other = f"{74 * '-'}\nWARNING: no such network\n{74 * '-'}\n{SLOTS}"
    assert run.start_failure(other, 1, 2) == SAID and run.start_failure("", 1, 2) == "it printed nothing", "control"


def test_a_rank_of_pid_0_had_ended():
    lost = "Total wall time: 0:00:00\nmpirun has exited due to process rank 0 with PID 0 on\nnode a exiting improperly.\n"
    assert run.ended_well(0, "") and run.ended_well(1, lost)
    assert not run.ended_well(1, lost.replace("PID 0", "PID 71")) and not run.ended_well(139, lost)
    assert not run.ended_well(1, lost.replace("Total wall time", "Loop time"))
