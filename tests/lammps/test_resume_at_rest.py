# SPDX-License-Identifier: GPL-2.0-only
"""in.quasistatic is killed on the way back to zero stress and goes on where it was."""

import os
import signal
import subprocess
import time

import numpy as np
from common_bodies import REFERENCE
from lammps_run import DECKS, LMP, SECONDS, read_csv, run_lammps
from lammps_run import _ENVIRONMENT as ENVIRONMENT

CHOICES = {"specimen": REFERENCE, "contact": "none", "plasticity": "isotropic", "strain": 0.01, "increment": 0.001, "cycles": 1, "lower": "release", "out": "run"}
DIGITS = 1e-6  # of the largest stress: the order of the atoms is another one


def run_and_kill(deck, variables, folder, line):
    """Kills a run of a deck once it has printed this line."""
    words = [word for key, value in variables.items() for word in ("-var", key, str(value))]
    with open(folder / "killed.out", "w", encoding="utf-8") as output:
        process = subprocess.Popen([str(LMP), "-log", "none", "-in", str(DECKS / deck), *words], cwd=folder, env={**os.environ, **ENVIRONMENT},
                                   stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT)
        try:
            limit = time.monotonic() + SECONDS
            while line not in (folder / "killed.out").read_text(encoding="utf-8"):
                assert process.poll() is None and time.monotonic() < limit, (folder / "killed.out").read_text(encoding="utf-8")[-800:]
                time.sleep(0.002)
            os.kill(process.pid, signal.SIGKILL)
        finally:
            process.wait()


def test_a_killed_run_goes_on(tmp_path):
    """Same rows as the run that was not killed, on one rank and on two."""
    (tmp_path / "whole").mkdir()
    run_lammps("in.quasistatic", 1, CHOICES, tmp_path / "whole").ok()
    expected = read_csv(tmp_path / "whole" / "run.csv")
    for ranks in (1, 2):
        killed = tmp_path / f"killed{ranks}"
        killed.mkdir()
        run_and_kill("in.quasistatic", CHOICES, killed, "increment 12:")
        assert len(read_csv(killed / "run.csv")["strain"]) < len(expected["strain"]), "control: it was killed"
        run_lammps("in.quasistatic", ranks, {**CHOICES, "resume": "yes"}, killed).ok()
        found = read_csv(killed / "run.csv")
        for name in ("strain", "stress_grip", "stress_virial", "strain_gauge"):
            assert np.allclose(found[name], expected[name], rtol=0, atol=DIGITS * np.abs(expected[name]).max()), (name, ranks)
    assert abs(expected["stress_grip"][-1]) < 0.001 * expected["stress_grip"].max() and expected["strain"][-1] > 0.002
