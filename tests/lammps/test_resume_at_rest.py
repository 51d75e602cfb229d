# SPDX-License-Identifier: GPL-2.0-only
"""in.torsion and in.bending are killed on the way back and go on from their last restart file; what is not resumed. As in.quasistatic."""

import os
import re
import signal
import subprocess
import time

import numpy as np
import pytest
from common_bodies import REFERENCE
from lammps_run import DECKS, LMP, SECONDS, read_csv, read_dump, run_lammps
from lammps_run import _ENVIRONMENT as ENVIRONMENT

BODY = {"contact": "none", "plasticity": "isotropic"}
WAYS = {
    "in.torsion": {"angle": 0.05, "increment": 0.01, "tolerance": 1e-5},
    "in.bending": {"strain": 0.02, "increment": 0.004, "tolerance": 1e-5},
}
GOES_ON = {"cycles": 1, "restart": 3, "frames": 5, "out": "run"}
DIGITS = 1e-6  # of the largest answer: the order of the atoms is another one


def way(deck):
    return {**WAYS[deck], **GOES_ON}


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    """The data file of each deck: a cylinder, and a bar of 400 spheres."""
    folder = tmp_path_factory.mktemp("bodies")
    block = {"shape": "block", "length": 0.1, "width": 0.015, "height": 0.02}
    run_lammps("in.specimen", 1, {"n": 400, "out": "bar.data", **block}, folder).ok()
    return {"in.torsion": REFERENCE, "in.bending": folder / "bar.data"}


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


@pytest.mark.parametrize("deck", WAYS)
def test_a_killed_run_goes_on(tmp_path, bodies, deck):
    """Same rows as the run that was not killed, on one rank and on two; frames after the increment resumed are in a file of their own."""
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    for folder in (whole, killed):
        folder.mkdir()
    choices = {"specimen": bodies[deck], **BODY, **way(deck)}
    run_lammps(deck, 1, choices, whole).ok()
    expected = read_csv(whole / "run.csv")
    run_and_kill(deck, choices, killed, "increment 7 of 10")
    assert len(read_csv(killed / "run.csv")[list(expected)[0]]) < 11, "control: it was killed"
    for ranks in (1, 2):
        run = run_lammps(deck, ranks, {**way(deck), "resume": 6}, killed).ok()
        assert "resumed after increment 6" in run.stdout
        found = read_csv(killed / "run.csv")
        assert list(found) == list(expected)
        for name, values in expected.items():
            assert np.allclose(found[name], values, rtol=0, atol=DIGITS * np.abs(values).max()), (name, ranks)
    answer = expected["torque_grip" if deck == "in.torsion" else "force"]
    assert answer[-1] < -0.1 * answer.max(), "control: flow came back"
    steps = {name: [frame.step for frame in read_dump(folder / name)] for folder, name in ((whole, "run_frames.dump"), (killed, "run_frames_6.dump"))}
    assert len(steps["run_frames.dump"]) == 6 and len(steps["run_frames_6.dump"]) == 2


@pytest.mark.parametrize("deck", WAYS)
def test_what_is_not_resumed(tmp_path, bodies, deck):
    """No file; the restart file of another run; another way; a way that is done. One message, and the rows stay."""
    load = list(WAYS[deck])[0]
    first = {**way(deck), "cycles": 0, "restart": 1, load: 2 * WAYS[deck]["increment"]}
    run_lammps(deck, 1, {"specimen": bodies[deck], **BODY, **first}, tmp_path).ok()
    rows = (tmp_path / "run.csv").read_bytes()
    (tmp_path / "run.3.restart").write_bytes((tmp_path / "run.2.restart").read_bytes())
    for choices, message in (({"resume": 4}, "cannot resume: run_choices.lmp or run.4.restart is missing"),
                             ({"resume": 3}, "cannot resume: run.3.restart was not written by the run that last wrote run_choices.lmp"),
                             ({"resume": 2}, "nothing to do: the load path has 2 increments, and 2 are done"),
                             ({"resume": 1, "increment": WAYS[deck]["increment"] / 2}, f"cannot resume: increment 1 was at an? {load} of "),
                             ({"resume": -1}, "resume must be 0 or a positive integer, got -1")):
        run = run_lammps(deck, 1, {**first, **choices}, tmp_path)
        lines = [line for line in run.stdout.splitlines() if line.startswith("ERROR")]
        assert run.returncode == 1 and len(lines) == 1 and re.search(message, lines[0]), run.stdout[-800:]
        assert (tmp_path / "run.csv").read_bytes() == rows
    run_lammps(deck, 1, {**first, "resume": 2, load: 3 * WAYS[deck]["increment"]}, tmp_path).ok()
    assert (tmp_path / "run.csv").read_bytes().startswith(rows) and len(read_csv(tmp_path / "run.csv")[list(read_csv(tmp_path / "run.csv"))[0]]) == 4


def test_rows_that_are_missing_are_told_and_none_is_lost(tmp_path):
    """As after a crash of the machine."""
    for folder in (tmp_path / "in.torsion", tmp_path / "in.quasistatic"):
        folder.mkdir()
        way_of = {"angle": 0.002} if folder.name == "in.torsion" else {"strain": 1e-3, "row": 5e-4}
        run_lammps("in.specimen", 1, {"n": 60, "seed": 7, "out": "small.data"}, folder).ok()
        run_lammps(folder.name, 1, {"specimen": "small.data", "out": "run", "restart": 2, **way_of}, folder).ok()
        rows = (folder / "run.csv").read_bytes().splitlines(True)
        (folder / "run.csv").write_bytes(b"".join(rows[:2]))
        longer = {key: 2 * value if key != "row" else value for key, value in way_of.items()}
        again = {"out": "run", "restart": 2, "resume": 2, **longer}
        for _ in range(2):
            run = run_lammps(folder.name, 1, again, folder)
            assert run.returncode == 1 and re.search(r"^ERROR: cannot resume: run.csv .*has no row of increment 2: resume after an earlier one", run.stdout, re.M)
            assert (folder / "run.csv").read_bytes() == b"".join(rows[:2])
        (folder / "run.csv").write_bytes(b"".join(rows))
        run_lammps(folder.name, 1, again, folder).ok()
        assert (folder / "run.csv").read_bytes().startswith(b"".join(rows)) and (folder / "run_before.csv").read_bytes() == b"".join(rows)
        assert not list(folder.glob("run_kept*"))
