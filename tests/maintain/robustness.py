#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs the robustness tests, tests/lammps/test_robust_*.py, and writes their results to doc/validation.md and, test by test, to doc/robustness.csv.

    tests/maintain/robustness.py [--out doc/validation.md]

The suite runs them on one MPI rank: that numbers do not depend on the ranks is for test_matrix.py. Here they run on all that they name.

LAMMPS is the lmp of this checkout, or EVP_LMP and EVP_MPIRUN. Exit code 1 if a test failed; its row says so.
"""

import ast
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from typing import NamedTuple

import tools_path  # noqa: F401  before evp
from study import CHECKOUT, command_line, section_marks, split_at_marks, write_between, write_csv

FILES = sorted((CHECKOUT / "tests" / "lammps").glob("test_robust_*.py"))
HEAD = """## Robustness tests

{answer}
Each test fails with the faults in its row of [robustness.csv](robustness.csv): `tests/maintain/faults.py` builds the plugin with each fault and checks that.

Written by `tests/maintain/robustness.py`; the tests are `tests/lammps/test_robust_*.py`. Columns of robustness.csv:

- *requirement*: what the test asserts. *Control*: what it asserts in addition, so that it cannot pass without the effect.
- *result*: what was measured, for each number of MPI ranks.
- *fails with*: faults of a build.
"""
MARKS = section_marks("robustness", "tests/maintain/robustness.py")
CASE = re.compile(r"test_(\w+)\[(\d+)ranks(?:-(.+))?\]$")


class Test(NamedTuple):
    """name: as a person reads it; node: as pytest does."""

    name: str
    ranks: int
    node: str


def named(node):
    function, ranks, choice = CASE.search(node).groups()
    return Test(function.replace("_", " ") + (f": {choice}" if choice else ""), int(ranks), node)


def pytest(words, **environment):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *map(str, words)]
    return subprocess.run(command, cwd=CHECKOUT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**os.environ, **environment}, check=False)


def collect():
    """All robustness tests; ValueError where pytest finds none."""
    shown = pytest(["--collect-only", *FILES]).stdout
    found = [named(line) for line in shown.splitlines() if CASE.search(line)]
    if not found:
        raise ValueError(f"pytest collects no robustness test:\n{shown[-500:]}")
    return found


def run(nodes, **environment):
    """{(name, ranks): (what it showed, whether it passed)} of these tests."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.xml"
        pytest([f"--junitxml={report}", *nodes], **environment)
        results = {}
        for case in ElementTree.parse(report).iter("testcase"):
            test, failure = named(case.get("name")), case.find("failure")
            shown = [one.get("value") for one in case.iter("property") if one.get("name") == "shown"]
            text = "; ".join(shown) or "passed" if failure is None else "FAILED: " + failure.get("message", "").splitlines()[0]
            results[test.name, test.ranks] = text, failure is None
        return results


def requirements():
    """{function, in words: its docstring}."""
    nodes = [node for path in FILES for node in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")]
    return {node.name[5:].replace("_", " "): " ".join(ast.get_docstring(node).split()) for node in nodes}


def main(words=None):
    from faults import FAULTS, fault_names

    parser = command_line(__doc__)
    parser.add_argument("--out", type=pathlib.Path, default=CHECKOUT / "doc" / "validation.md", help="the page whose section to write")
    options = parser.parse_args(words)
    split_at_marks(options.out, *MARKS)  # before the runs, not after them
    results, demands = run(FILES, EVP_ALL_RANKS="1"), requirements()
    rows = []
    for name in dict.fromkeys(name for name, _ in results):
        shown = [f"{ranks} rank{'s' * (ranks > 1)}: {text}" for (own, ranks), (text, _) in results.items() if own == name]
        rows.append([name, demands[name.partition(":")[0]], "; ".join(shown), "; ".join(FAULTS[fault].what for fault in fault_names(name))])
    failed = sum(not right for _, right in results.values())
    ranks = ", ".join(map(str, sorted({ranks for _, ranks in results})))
    answer = f"{len(rows)} tests: " + (f"{failed} runs FAILED." if failed else f"all pass on {ranks} MPI ranks.")
    write_between(options.out, *MARKS, HEAD.format(answer=answer))
    write_csv(options.out.with_name("robustness.csv"), ("test", "requirement", "result", "fails with"), rows)
    print(f"{answer} {options.out}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
