# SPDX-License-Identifier: GPL-2.0-only
"""A run that is killed at any moment goes on from its last whole restart file as if nothing had happened."""

import os
import random
import signal
import subprocess
import time

import numpy as np
import pytest
from lammps_run import LMP, MPIRUN, SECONDS, run_lammps, thermo_blocks
from lammps_run import _ENVIRONMENT as ENVIRONMENT
from flowing import MOVE as MOVE_FLOWING
from flowing import flowing_pair
from small_bodies import MOVE, head, lattice_body, pair, write_body

TOTAL, EVERY = 1200, 10  # steps of the run, and from one restart file to the next
TRIES = 5
KILLS = 2
END_OF_FILE = b"LammpS RestartT"  # LAMMPS' own mark, the last thing that it writes

# gentle enough for thousands of steps: an oscillation into the second regime and back, without a drift
SWING = "velocity all ramp vx -20 20 x 0 0.06\n"
ROWS = f"thermo {EVERY}\nthermo_modify flush yes\n" + f"restart {EVERY} a.restart b.restart\n" + f"run {TOTAL} upto\n"


def whole_files(folder):
    """The restart files that were written to their end, the last one first."""
    files = [path for path in (folder / "a.restart", folder / "b.restart") if path.is_file()]
    whole = [path for path in files if END_OF_FILE in path.read_bytes()[-64:]]
    return sorted(whole, key=lambda path: path.stat().st_mtime_ns, reverse=True)


def children_of(pid):
    with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:
        return [int(word) for word in file.read().split()]


def rows_printed(folder):
    """Thermo rows of the killed run so far."""
    text = (folder / "killed.out").read_text(encoding="utf-8")
    return text.rpartition("Step ")[2].count("\n") - 1 if "Step " in text else 0


def run_and_kill(folder, ranks, rows, wait):
    """Start in.whole in folder; kill all its processes at once this long after so many rows of its thermo table."""
    command = [*MPIRUN, "-np", str(ranks)] if ranks > 1 else []
    command += [str(LMP), "-log", "none", "-in", "in.whole"]
    with open(folder / "killed.out", "w", encoding="utf-8") as output:
        process = subprocess.Popen(command, cwd=folder, env={**os.environ, **ENVIRONMENT}, stdin=subprocess.DEVNULL,
                                   stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
        try:
            limit = time.monotonic() + SECONDS
            while rows_printed(folder) < rows:
                assert process.poll() is None and time.monotonic() < limit, (folder / "killed.out").read_text()
                time.sleep(0.001)
            time.sleep(wait)
            for pid in (children_of(process.pid) if ranks > 1 else []):
                os.kill(pid, signal.SIGKILL)
        finally:
            if process.poll() is None:
                os.kill(process.pid, signal.SIGKILL)
            process.wait()


def kill_in_mid_run(folder, ranks, moments):
    """A kill that comes when the run is over, as on a busy machine, is tried again at another moment."""
    for _ in range(TRIES):
        for path in (folder / "a.restart", folder / "b.restart"):
            path.unlink(missing_ok=True)
        run_and_kill(folder, ranks, moments.randint(3, TOTAL // EVERY // 2), moments.uniform(0.0, 0.01))
        killed = thermo_blocks((folder / "killed.out").read_text() + "\nLoop time\n")
        if len(killed) == 0 or killed[-1]["Step"][-1] < TOTAL:
            return
    pytest.fail("control: the killed run had not ended")


# flows both ways and breaks bonds all the way
FLOWING_SWING = """
variable ax atom 30*sin(1.3*id)
variable ay atom 30*cos(2.7*id)
variable az atom 30*sin(3.9*id)
velocity all set v_ax v_ay v_az
velocity all zero linear
velocity all ramp vx -60 60 x 0 0.06 sum yes
"""
BONDS, VOLUME = "fix bonds all evp/bonds\n", "fix volume all evp/volume 500\n"
# what is left of a bond of spheres that overlap repels from the next forces on, which after a restart are those of the set-up: no contacts
SCENES = {"eq. 8": (pair() + SWING, BONDS, MOVE), "flow": (flowing_pair("none", 0.05, fix=BONDS.strip() + " zone 1.4") + FLOWING_SWING, BONDS + VOLUME, MOVE_FLOWING)}


@pytest.mark.parametrize("name, ranks", [("eq. 8", 1), ("flow", 2)])
def test_killed_runs_resume(tmp_path, name, ranks):
    """Killed at seeded moments of the first half, so that the run is not over. gamma = 0, no sorting of atoms and the same ranks: the restart file
    holds every bit, so thermo table, last state and bond file are the same to the last digit."""
    body, (start, fixes, move) = lattice_body((6, 4, 4)), SCENES[name]
    write_body(tmp_path / "body.data", body)
    rest = move.replace("thermo 10\n", "") + ROWS
    last = "write_dump all custom {0}.dump id x y z vx vy vz fx fy fz modify format float %.17g\nwrite_evp_bonds {0}.bonds\n"
    deck = head(sort="sort 0 0") + start + rest
    (tmp_path / "in.whole").write_text(deck)
    whole = run_lammps(deck + last.format("whole"), ranks, cwd=tmp_path).ok()
    table, expected = whole.thermo(), whole.dump("whole.dump")[-1]
    changes = "f_bonds[5]" if name == "flow" else "f_bonds[1]"
    assert np.ptp(table[changes]) > 0 and table["f_bonds[2]"].max() > 20, "control: bonds change"

    moments, resumed_at = random.Random(11), []
    for kill in range(KILLS):
        kill_in_mid_run(tmp_path, ranks, moments)
        files = whole_files(tmp_path)
        assert files, "of two files that take turns one is always whole"
        files[0].rename(tmp_path / "resumed.restart")
        run = run_lammps(head(start="read_restart resumed.restart", sort="sort 0 0") + fixes + rest + last.format("rest"), ranks, cwd=tmp_path).ok()
        assert "recorded" not in run.stdout
        again, end = run.thermo(), run.dump("rest.dump")[-1]
        resumed_at.append(again["Step"][0])
        for column, values in again.items():
            assert np.array_equal(values, table[column][-len(values):]), (kill, column)
        assert all(np.array_equal(end[column], values) for column, values in expected.columns.items())
        assert sorted((tmp_path / "rest.bonds").read_text().splitlines()) == sorted((tmp_path / "whole.bonds").read_text().splitlines())
    assert len(set(resumed_at)) > 1, "control: at different moments"
