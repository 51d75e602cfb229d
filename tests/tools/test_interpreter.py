# SPDX-License-Identifier: GPL-2.0-only
"""The tools started by their own name, where the first python3 of PATH lacks numpy; runs that do not start."""

import os
import shutil
import subprocess
import sys

import calibrate
import evp
import pytest
import site_pages
from evp import calibration, run, surface
from evp.run import CHECKOUT as ROOT
from evp.run import RunError
from inputs import call, program

TOOLS = ROOT / "tools"
PROGRAMS = sorted(str(path.relative_to(ROOT)) for folder in ("tools", "doc/studies", "tests/maintain") for path in (ROOT / folder).glob("*.py") if os.access(path, os.X_OK))
MODULES = ("numpy", "scipy", "matplotlib")


@pytest.fixture
def bare(tmp_path):
    """The environment of a machine whose first python3 sees the standard library alone."""
    python = program(tmp_path / "bin" / "python3", f'exec {sys.executable} -S "$@"')
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHON", "PYTHONPATH")}
    environment = {**kept, "PATH": f"{python.parent}:{os.environ['PATH']}"}
    assert shutil.which("python3", path=environment["PATH"]) == str(python), "control"
    assert not evp.has_modules(str(python), MODULES), "control"
    return environment


def start(words, environment, folder=TOOLS):
    return subprocess.run([str(word) for word in words], env=environment, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", PROGRAMS)
def test_each_tool_starts_by_its_own_name(bare, tmp_path, name):
    """It goes on in the next Python, here one that only says so, and prints its help in this one; the doctor needs no other."""
    following = {**bare, "PYTHON": str(program(tmp_path / "next", '[ "$1" = -c ] || echo "goes on: $*"'))}
    shown = start([ROOT / name, "--help"], following)
    assert shown.returncode == 0 and not shown.stderr, shown.stderr
    assert shown.stdout.startswith("usage: ") if name == "tools/doctor.py" else shown.stdout == f"goes on: {ROOT / name} --help\n"
    site_pages.help_of(ROOT / name, [])


def test_other_programs_are_told_and_not_started_again(bare, tmp_path):
    program = tmp_path / "mine.py"
    program.write_text(f"import sys\nsys.path.insert(0, {str(TOOLS)!r})\nimport evp\n", encoding="utf-8")
    told = start(["python3", program], bare, tmp_path)
    assert told.returncode == 1 and len(told.stderr.splitlines()) == 1
    assert "has no numpy, scipy, matplotlib: use /" in told.stderr


def test_python_of_the_user_comes_first_then_that_of_set_up(tmp_path):
    """In this order; of each only what is a program."""
    cache = tmp_path / "CMakeCache.txt"
    mine, found = (str(program(tmp_path / name, "exit 0")) for name in ("mine", "found"))
    cache.write_text(f"A:STRING=1\nPython_EXECUTABLE:UNINITIALIZED={found}\n", encoding="utf-8")
    debian = ["/usr/bin/python3"] if os.access("/usr/bin/python3", os.X_OK) else []
    assert evp.candidates({"PYTHON": mine}, cache) == [mine, found, *debian]
    assert evp.candidates({"PYTHON": "/no/such"}, cache) == [found, *debian]
    assert evp.candidates({}, tmp_path / "absent") == debian


@pytest.mark.parametrize("first, text", [("#!/bin/sh", "exit 3"), ("#!/no/such/shell", ""), ("no program", "")])
def test_python_that_does_not_work_is_passed_over(tmp_path, first, text):
    assert not evp.has_modules(str(program(tmp_path / "python", text, first)), MODULES)
    assert evp.has_modules(sys.executable, MODULES), "control"


def test_no_python_that_has_them(monkeypatch):
    monkeypatch.setattr(evp, "candidates", lambda environment: [])
    with pytest.raises(SystemExit, match="has no no_such_module: run tools/setup.sh, .* PYTHON=/path/to/python3$"):
        evp.require("numpy", "no_such_module")
    with pytest.raises(SystemExit, match=r"has no no_such_module: apt-get install python3-open3d \(Debian\), or pip install open3d, or give one: PYTHON="):
        evp.require("no_such_module", remedy=surface.OPEN3D)
    assert evp.require("numpy") is None, "control"


# ---- mpirun as root, an mpirun that refuses, an lmp without its libraries: the message is theirs, and nothing is tried again ----

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


def test_a_calibration_says_it(refusing, tmp_path, monkeypatch):
    """Where ranks cannot be started; there is no second try, and no row."""
    body = calibration.Body(tmp_path / "periodic.data", 4000, 26000, 0.003, 1e-5)
    with pytest.raises(RunError, match=f"in.shear: LAMMPS did not start .exit 1.: {SAID}\n.*run evp doctor"):
        calibration.call("in.shear", {}, 2, tmp_path, "x")
    assert refusing.read_text().split() == ["start"]
    monkeypatch.setenv("EVP_LMP", str(tmp_path / "nowhere"))
    monkeypatch.setattr(calibration, "make_body", lambda *_: body)
    done = call(calibrate.main, *"--E 70e9 --yield 95e6 --stress 150e6@0.05 --density 2700 --name mine --out".split(), tmp_path / "m.evp")
    assert done.returncode == 1 and "run tools/setup.sh first" in done.stderr and not (tmp_path / "m.evp").exists()


def test_an_lmp_without_its_library(tmp_path, monkeypatch):
    """One rank: the loader's line. No second packing is tried."""
    lmp = program(tmp_path / "lmp", f"echo start >> {tmp_path}/starts\necho 'lmp: error while loading shared libraries: liblammps.so.0' >&2\nexit 127")
    monkeypatch.setenv("EVP_LMP", str(lmp))
    with pytest.raises(RunError, match="exit 127.: lmp: error while loading shared libraries: liblammps.so.0\n"):
        calibration.make_body(tmp_path, 100, 1, 2700.0)
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
