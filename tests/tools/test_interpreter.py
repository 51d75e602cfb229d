# SPDX-License-Identifier: GPL-2.0-only
"""The tools started by their own name, where the first python3 of PATH lacks numpy."""

import os
import shutil
import subprocess
import sys

import pytest
import site_pages
from evp import interpreter, surface
from evp.run import CHECKOUT as ROOT
from inputs import program

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
    assert not interpreter.has_modules(str(python), MODULES), "control"
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


def test_a_tool_starts(bare):
    shown = start([TOOLS / "curves.py", "--help"], bare)
    assert shown.returncode == 0 and shown.stdout.startswith("usage: ") and not shown.stderr, shown.stderr


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
    assert interpreter.candidates({"PYTHON": mine}, cache) == [mine, found, *debian]
    assert interpreter.candidates({"PYTHON": "/no/such"}, cache) == [found, *debian]
    assert interpreter.candidates({}, tmp_path / "absent") == debian


@pytest.mark.parametrize("first, text", [("#!/bin/sh", "exit 3"), ("#!/no/such/shell", ""), ("no program", "")])
def test_python_that_does_not_work_is_passed_over(tmp_path, first, text):
    assert not interpreter.has_modules(str(program(tmp_path / "python", text, first)), MODULES)
    assert interpreter.has_modules(sys.executable, MODULES), "control"


def test_no_python_that_has_them(monkeypatch):
    monkeypatch.setattr(interpreter, "candidates", lambda environment: [])
    with pytest.raises(SystemExit, match="has no no_such_module: run tools/setup.sh, .* PYTHON=/path/to/python3$"):
        interpreter.require("numpy", "no_such_module")
    with pytest.raises(SystemExit, match=r"has no no_such_module: apt-get install python3-open3d \(Debian\), or pip install open3d, or give one: PYTHON="):
        interpreter.require("no_such_module", remedy=surface.OPEN3D)
    assert interpreter.require("numpy") is None, "control"
