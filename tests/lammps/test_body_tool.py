# SPDX-License-Identifier: GPL-2.0-only
"""tools/body.py: its faults are named and leave no file, nor does one that is stopped. What it makes of a part: test_doc_tutorial.py."""

import importlib.util
import os
import re
import signal
import subprocess
import sys
import time

import body
import numpy as np
import pytest
from evp import surface
from inputs import call, mesh_of, program, write_mesh
from lammps_run import LMP, REPOSITORY

PARTS = REPOSITORY / "tests" / "data" / "parts"
BONE = REPOSITORY / "lammps_inputs" / "dog_bone.stl"
pytestmark = pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="no open3d: " + surface.OPEN3D)


@pytest.fixture
def tool(tmp_path, monkeypatch):
    """body.py, in the test's own folder; returns its exit code and what it printed."""
    monkeypatch.chdir(tmp_path)

    def run(*words, lmp=LMP):
        monkeypatch.setenv("EVP_LMP", str(lmp))
        done = call(body.main, *words)
        return done.returncode, done.stdout + done.stderr

    return run


def soup_of(path):
    """Triangles (T,3,3) of a file."""
    mesh = surface.read_mesh(path)
    return np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]


def test_plate_is_what_its_script_writes(tmp_path):
    subprocess.run([sys.executable, str(PARTS / "make_parts.py"), str(tmp_path)], check=True, env={**os.environ, "PYTHONPATH": f"{REPOSITORY}/tools:{REPOSITORY}/tests/tools"})
    assert soup_of(tmp_path / "plate_with_hole.stl") == pytest.approx(soup_of(PARTS / "plate_with_hole.stl"), abs=1e-5)


@pytest.mark.parametrize("away, options, message", [
    (None, {"--n": 60}, r"--n 60 is too small: the thinnest section is 0.0079. m, and 60 spheres have a diameter of 0.00447 m; 3 must fit side by side: give --n 29\d or"),
    ([0.0, 7.0, 9.0], {}, "part.stl has 2 separate shells"), (None, {"--out": "."}, r"argument --out: \. is a folder"),
    (None, {"--n": 20}, "argument --n: give a whole number of 50 or more, got 20"), (None, {"--seed": 0}, "argument --seed: give a whole number of 1 or more, got 0"),
    (None, {"--density": 0}, "argument --density: give a positive number, got 0"), (None, {"--out": "no/folder/part.data"}, "argument --out: no/folder/part.data: there is no folder"),
    (None, {"--unit": "km"}, "argument --unit: invalid choice: 'km'")])
def test_faults_are_named_and_leave_no_file(tool, tmp_path, away, options, message):
    """Those of surfaces: tests/tools/test_surface.py."""
    soup = soup_of(BONE) if away is None else np.concatenate([soup_of(BONE), soup_of(BONE) + away])
    write_mesh(tmp_path / "part.stl", mesh_of(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3)))
    options = {"--n": 800, "--out": "part.data", "--axis": "z", **options}
    code, said = tool("part.stl", *(word for item in options.items() for word in item))
    assert code and re.search(message, said) and said.count("error:") == 1, said
    assert [path.name for path in tmp_path.iterdir()] == ["part.stl"]


@pytest.mark.parametrize("unit, warned", [("um", True), ("m", True), ("mm", False)])
def test_odd_unit_is_asked_about(tool, unit, warned):
    _, said = tool(BONE, "--axis", "z", "--n", 60, "--unit", unit, "--out", "part.data")
    assert (f"WARNING: with --unit {unit} the part is" in said) == warned and "is too small" in said


def test_failed_run_leaves_the_files_there_before(tool, tmp_path):
    """LAMMPS cannot be started."""
    (tmp_path / "part.data").write_text("mine")
    code, said = tool(BONE, "--axis", "z", "--n", 800, "--out", "part.data", lmp="/no/lmp")
    assert code and "no program /no/lmp" in said
    assert (tmp_path / "part.data").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


SECONDS = 60


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_stopped_while_it_packs(tmp_path, end):
    """Its lmp says in `work` that it runs, and then does nothing."""
    work, out = tmp_path / "work", tmp_path / "part.data"
    work.mkdir()
    out.write_text("that of before", encoding="utf-8")
    lmp = program(tmp_path / "lmp", f"echo $$ > {work}/running\nexec sleep {SECONDS}")
    process = subprocess.Popen([sys.executable, REPOSITORY / "tools" / "body.py", PARTS / "plate_with_hole.stl", "--n", "1000", "--out", out], stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**os.environ, "EVP_LMP": str(lmp), "TMPDIR": str(work)})
    limit = time.monotonic() + SECONDS
    while not (work / "running").exists() or not (work / "running").read_text(encoding="utf-8").strip():
        assert process.poll() is None and time.monotonic() < limit, process.communicate()[0]
        time.sleep(0.05)
    process.send_signal(end)
    said = process.communicate(timeout=SECONDS)[0]
    assert process.returncode == 130 and said.splitlines()[-1] == "body.py: interrupted; nothing was written" and "Traceback" not in said
    assert [path.name for path in work.iterdir()] == ["running"] and out.read_text(encoding="utf-8") == "that of before"
    with pytest.raises(ProcessLookupError):  # at once, but for the time in which the system takes it away
        while time.monotonic() < limit:
            os.kill(int((work / "running").read_text(encoding="utf-8")), 0)
            time.sleep(0.05)
