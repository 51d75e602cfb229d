# SPDX-License-Identifier: GPL-2.0-only
"""flake8 by setup.cfg on all Python of the checkout, and no test that asserts a time."""

import ast
import subprocess
import sys

from evp.run import CHECKOUT as REPOSITORY


def test_flake8_finds_nothing():
    words = [sys.executable, "-m", "flake8", "tools", "tests", "doc"]
    found = subprocess.run(words, cwd=REPOSITORY, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert "No module named" not in found.stderr, "flake8 is missing: apt-get install python3-flake8, or pip install flake8"
    assert found.returncode == 0 and not found.stdout, found.stdout


CLOCKS = {"monotonic", "perf_counter", "process_time", "time"}


def elapsed_times(source):
    """Lines that assert something of the difference of a clock and an earlier reading, or of a measured time that a tool has written."""
    names = [node for statement in ast.walk(ast.parse(source)) if isinstance(statement, ast.Assert) for node in ast.walk(statement)]
    clocks = [node for node in names if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub) and isinstance(node.left, ast.Call)
              and isinstance(node.left.func, ast.Attribute) and node.left.func.attr in CLOCKS]
    written = [node for node in names if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "seconds"]
    return [node.lineno for node in clocks + written]


def test_no_test_asserts_a_time():
    """On a loaded machine it fails; steps and evaluations can be counted, and times belong to doc/studies/bench.py."""
    found = {str(path.relative_to(REPOSITORY)): elapsed_times(path.read_text(encoding="utf-8")) for path in REPOSITORY.glob("tests/**/*.py")}
    assert not {path: lines for path, lines in found.items() if lines}
    assert elapsed_times("assert time.monotonic() - start < 5\nassert seconds(a) > seconds(b)\nassert end < 3") == [1, 2, 2], "control"
