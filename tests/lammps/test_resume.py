# SPDX-License-Identifier: GPL-2.0-only
"""-var resume yes: a run that was killed, at random moments and as it saved, ends with the rows of the whole run; one error where there is nothing to resume."""

import os
import pathlib
import random
import signal
import time

import numpy as np
import pytest
from lammps_run import DECKS, packed, read_csv, run_lammps, start_lammps

ROW = "80 8 4 3 8 4 0.005 20 1.5 spacing 0.00585189 coordination 11.9 density 2700"
body = packed("body.data", n=160)
sheet = packed("sheet.data", n=450, shape="sheet", length=0.008, width=0.002, height=0.0014)
plate = packed("plate.data", n=900, shape="block", length=0.026, width=0.022, height=0.005)


@pytest.fixture(scope="module")
def bodies(tmp_path_factory, body, sheet, plate):
    folder, size = tmp_path_factory.mktemp("spray"), 25e-6
    (folder / "ball.region").write_text(f"region body sphere {size / 2} 0 0 {size / 2}\n")
    run_lammps("in.specimen", 1, {"n": 70, "shape": "region", "region": "ball.region", "length": size, "out": "particle.data"}, folder).ok()
    run_lammps("in.specimen", 1, {"n": 120, "shape": "block", "length": 0.5 * size, "width": 1.6 * size, "height": 1.6 * size, "out": "plate.data"}, folder).ok()
    return {"body": body, "sheet": sheet, "plate": plate, "target": folder / "plate.data", "particle": folder / "particle.data"}


# choices, and MPI ranks of the whole run and of those that are killed and resumed
SCENES = {
    "in.traction": ({"specimen": "body", "coeff": ROW, "plasticity": "isotropic", "rate": 100, "also": DECKS / "frames.lmp"}, (1, 1, 1)),
    "in.cyclic": ({"specimen": "body", "plasticity": "isotropic", "strain": 0.01, "lower": "release", "rate": 100}, (1, 1, 1)),
    "in.quasistatic": ({"specimen": "body", "plasticity": "isotropic", "strain": 0.01, "lower": "release", "also": DECKS / "frames.lmp"}, (1, 1, 1)),
    "in.taylor": ({"specimen": "body", "coeff": ROW, "speed": 50}, (1, 1, 1)),
    "in.upset": ({"specimen": "body", "coeff": ROW, "speed": 20, "strain": 0.2}, (2, 2, 2)),
    "in.extrude": ({"specimen": "body", "coeff": ROW, "speed": 40, "travel": 0.2}, (1, 1, 1)),
    "in.spray": ({"plate": "target", "particle": "particle", "speed": 700, "time": 6e-8, "also": DECKS / "frames.lmp"}, (1, 1, 2)),
    "in.blank": ({"specimen": "sheet", "speed": 100, "travel": 0.15}, (1, 1, 1)),
    "in.stir": ({"specimen": "plate", "pin_radius": 0.003, "depth": 0.001, "dwell": 0.02, "turns": 0.03, "seam": "all"}, (1, 1, 1))}


def kill(process):
    """SIGKILL, of each rank: mpirun then ends by itself."""
    ranks = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text(encoding="utf-8").split()
    for pid in ranks or [process.pid]:
        os.kill(int(pid), signal.SIGKILL)
    process.wait()


def rows_in(file):
    return file.read_bytes().count(b"\n") - 1 if file.exists() else -1


def killed(deck, ranks, choices, folder, row):
    """Starts a run, and kills it once it has that row and has saved."""
    process = start_lammps(deck, ranks, choices, folder)
    out = folder / choices["out"]
    while process.poll() is None and not (rows_in(out.with_suffix(".csv")) >= row and len(list(folder.glob(out.name + ".*res*"))) > 1):
        time.sleep(0.001)
    assert process.returncode is None, "control: it runs"
    kill(process)


def assert_same_rows(file, other, digit):
    """To this share of the largest value of a column, or where it is an imbalance, of the plastic work."""
    mine, theirs = read_csv(file), read_csv(other)
    for name, column in theirs.items():
        largest = np.abs(theirs["plastic_work"] if "imbalance" in name else column).max()
        assert len(mine[name]) == len(column) and np.abs(mine[name] - column).max() <= digit * largest, name


@pytest.mark.parametrize("deck", SCENES)
def test_a_run_that_was_killed_has_the_rows_of_the_whole_run(tmp_path, bodies, deck):
    """To 2e-9, half of the last digit, as the forces of the step before are kept; on another number of ranks to 1e-6. The second time the newest restart
    file is cut off, as of a run that was killed as it wrote. No snapshot is there twice."""
    choices, (before, first, second) = SCENES[deck]
    choices = {name: bodies.get(value, value) if isinstance(value, str) else value for name, value in choices.items()}
    run_lammps(deck, before, {**choices, "out": "whole"}, tmp_path).ok()
    rows, chance = rows_in(tmp_path / "whole.csv"), random.Random(deck)
    part = {**choices, "out": "part"}
    killed(deck, first, part, tmp_path, chance.randint(0, rows // 2))
    again = {**part, "resume": "yes"}
    if deck != "in.stir":  # which saves once here
        killed(deck, first, again, tmp_path, chance.randint(rows // 2, 3 * rows // 4))
        if deck not in ("in.cyclic", "in.quasistatic"):  # whose PREFIX.resume names one that is whole
            newest = max(tmp_path.glob("part.?.restart"), key=lambda path: path.stat().st_mtime_ns)
            os.truncate(newest, chance.randrange(newest.stat().st_size + 1))
    run = run_lammps(deck, second, again, tmp_path).ok()
    assert "recorded" not in run.stdout, "the bonds come from the file"
    assert_same_rows(tmp_path / "part.csv", tmp_path / "whole.csv", 2e-9 if second == before else 1e-6)
    if "also" in choices:
        steps = [[frame.step for frame in run.dump(f"{name}_frames.dump")] for name in ("whole", "part")]
        assert len(steps[0]) == len(steps[1]) > 10 and (steps[0] == steps[1] or deck == "in.quasistatic"), "a minimization may take other iterations"


def test_a_run_that_has_ended_goes_on_to_a_larger_strain(tmp_path, body):
    """As one run would, where the strain of the first is no whole number of rows too: those keep their distance. A negative rate is compression, by strains of either sign."""
    choices = {"specimen": body, "coeff": ROW, "plasticity": "isotropic", "rate": -100, "row": 0.0003}
    run_lammps("in.traction", 1, {**choices, "strain": 0.01, "out": "part"}, tmp_path).ok()
    run_lammps("in.traction", 1, {**choices, "strain": -0.0135, "out": "part", "resume": "yes"}, tmp_path).ok()
    run_lammps("in.traction", 1, {**choices, "strain": 0.01 / 34 * 46, "row": 0.01 / 34, "out": "whole"}, tmp_path).ok()
    assert_same_rows(tmp_path / "part.csv", tmp_path / "whole.csv", 2e-9)


def test_nothing_to_resume(tmp_path, body):
    """One error, before anything is written: nothing saved, another script, choice or row, a value that is none; a CSV file of another run."""
    choices = {"specimen": body, "rate": 400, "strain": 0.005, "out": "pull"}
    again = {**choices, "resume": "yes"}

    def refused(message, deck="in.traction", ranks=1, **others):
        run = run_lammps(deck, ranks, {**again, **others}, tmp_path)
        assert run.returncode == 1 and message in " ".join(run.stdout.split()) and run.stdout.count("ERROR") == 1, run.stdout[-500:]

    refused("ERROR: in.traction: no run has saved a state in pull.resume and pull.K.restart: give -var resume no", ranks=2)
    assert not list(tmp_path.iterdir())
    run_lammps("in.traction", 1, choices, tmp_path).ok()
    rows = (tmp_path / "pull.csv").read_bytes()
    refused("-var resume must be yes or no, got 'Yes'", resume="Yes")
    for name, value in (("row", 0.0002), ("coeff", ROW), ("contact", "join 1.3"), ("specimen", "other.data")):
        refused(f"ERROR: in.traction: pull.resume is of a run with another '{name}': give the choices of that run", **{name: value})
    for strain in (0.0049, -0.006):
        refused(f"ERROR: the run that is resumed goes to a strain of 0.005: give no smaller -var strain, got {strain}", strain=strain)
    refused("ERROR: in.cyclic: pull.resume is of another input script", "in.cyclic")
    assert (tmp_path / "pull.csv").read_bytes() == rows
    run_lammps("in.traction", 1, again, tmp_path).ok()
    assert (tmp_path / "pull.csv").read_bytes() == rows, "a run that has ended ends again"
    for other in (b"", rows[:200], rows.replace(b"stress_grip", b"torque")):
        (tmp_path / "pull.csv").write_bytes(other)
        (tmp_path / "pull.row").unlink(missing_ok=True)
        refused("ERROR: pull.csv is missing or lacks rows of the run that is to be resumed")
        assert (tmp_path / "pull.csv").read_bytes() == other
    metal = {"rate": 100, "strain": 0.002, "material": "metal.evp:row"}
    (tmp_path / "metal.evp").write_text(f"# UNITS: si\nrow {ROW}\n", encoding="utf-8")
    run_lammps("in.traction", 1, {**choices, **metal}, tmp_path).ok()
    (tmp_path / "metal.evp").write_text(f"# UNITS: si\nrow {ROW.replace('80', '90', 1)}\n", encoding="utf-8")
    refused("ERROR: material or body have changed since pull.resume was written", **metal)
    run_lammps("in.traction", 1, {**choices, "strain": 0.0001}, tmp_path).ok()
    refused("no run has saved", strain=0.0001)
