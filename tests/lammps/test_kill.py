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
from flowing import assert_flowed, flowing_pair, largest_difference, read_pairs
from small_bodies import MOVE, assert_same_curve, check_forces, head, lattice_body, pair, write_body

TOTAL, EVERY = 1200, 10  # steps of the run, and from one restart file to the next
TRIES = 5
KILLS = 10
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


@pytest.mark.parametrize("ranks, seed", [(1, 11), (2, 12)])
def test_killed_runs_resume(tmp_path, ranks, seed):
    """Five kills each, at seeded moments of the first half, so that the run is not over. gamma = 0, no sorting of atoms
    and the same ranks: the restart file holds every bit, so thermo table and last state are the same to the last digit."""
    body = lattice_body((6, 4, 4))
    write_body(tmp_path / "body.data", body)
    deck = head(sort="sort 0 0") + pair() + SWING + MOVE.replace("thermo 10\n", "") + ROWS
    (tmp_path / "in.whole").write_text(deck)
    last = "write_dump all custom {} id x y z vx vy vz fx fy fz modify format float %.17g\n"
    whole = run_lammps(deck + last.format("whole.dump"), ranks, cwd=tmp_path).ok()
    table = whole.thermo()
    check_forces(whole.dump("whole.dump")[-1], body)
    assert table["f_bonds[2]"].max() > 20 and table["f_bonds[1]"].max() > 0, "control: bonds do change"

    moments = random.Random(seed)
    resumed_at = []
    for kill in range(KILLS // 2):
        kill_in_mid_run(tmp_path, ranks, moments)
        files = whole_files(tmp_path)
        assert files, "of two files that take turns one is always whole"
        files[0].rename(tmp_path / "resumed.restart")
        text = head(start="read_restart resumed.restart", sort="sort 0 0") + "fix bonds all evp/bonds\n"
        rest = run_lammps(text + MOVE.replace("thermo 10\n", "") + ROWS + last.format("rest.dump"), ranks, cwd=tmp_path).ok()
        assert "recorded" not in rest.stdout
        again = rest.thermo()
        resumed_at.append(again["Step"][0])
        for name, values in again.items():
            assert np.array_equal(values, table[name][-len(values):]), (kill, name)
        end, expected = rest.dump("rest.dump")[-1], whole.dump("whole.dump")[-1]
        assert all(np.array_equal(end[name], values) for name, values in expected.columns.items())
    assert len(set(resumed_at)) > 1, "control: at different moments"


# flows both ways and breaks bonds all the way
FLOWING_SWING = """
variable ax atom 30*sin(1.3*id)
variable ay atom 30*cos(2.7*id)
variable az atom 30*sin(3.9*id)
velocity all set v_ax v_ay v_az
velocity all zero linear
velocity all ramp vx -60 60 x 0 0.06 sum yes
"""
RESUMED = 0.0


@pytest.mark.parametrize("ranks, seed", [(1, 21), (2, 22)])
def test_killed_runs_with_flow_resume(tmp_path, ranks, seed):
    """The same with offsets, broken bonds and volume strains, to round-off. Without contacts: what is
    left of a bond of spheres that overlap repels from the next evaluation of forces on, which after a restart is the set-up."""
    body = lattice_body((6, 4, 4))
    write_body(tmp_path / "body.data", body)
    fixes = "fix bonds all evp/bonds\nfix volume all evp/volume 500\n"
    move = MOVE_FLOWING.replace("thermo 10\n", "") + ROWS
    last = "write_dump all custom {0}.dump id x y z vx vy vz fx fy fz modify format float %.17g\nwrite_evp_bonds {0}.bonds\n"
    deck = head(sort="sort 0 0") + flowing_pair("none", 0.05, fix="fix bonds all evp/bonds zone 1.4") + FLOWING_SWING + move
    (tmp_path / "in.whole").write_text(deck)
    whole = run_lammps(deck + last.format("whole"), ranks, cwd=tmp_path).ok()
    table = whole.thermo()
    assert_flowed(read_pairs(tmp_path / "whole.bonds"), contacts=0)
    assert np.all(np.diff(table["f_bonds[5]"][[3, 20, 60, -1]]) > 0), "control: bonds break all the way"

    moments = random.Random(seed)
    for kill in range(KILLS // 2):
        kill_in_mid_run(tmp_path, ranks, moments)
        whole_files(tmp_path)[0].rename(tmp_path / "resumed.restart")
        rest = run_lammps(head(start="read_restart resumed.restart", sort="sort 0 0") + fixes + move + last.format("rest"), ranks, cwd=tmp_path).ok()
        assert_same_curve(rest.thermo(), table, RESUMED)
        end, expected = rest.dump("rest.dump")[-1], whole.dump("whole.dump")[-1]
        for name in ("x", "vy", "fz"):
            assert np.abs(end[name] - expected[name]).max() <= RESUMED * np.abs(expected[name]).max(), (kill, name)
        assert largest_difference(read_pairs(tmp_path / "rest.bonds"), read_pairs(tmp_path / "whole.bonds")) <= RESUMED, kill
