# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/bench.py runs, counts what it times, and refuses what it cannot use."""

import csv
import os
import pathlib
import subprocess
import sys

import bench
import pytest

CHECKOUT = pathlib.Path(__file__).resolve().parents[2]


def tool(name, *words):
    environment = {**os.environ, "PYTHONPATH": str(CHECKOUT / "tools")}
    return subprocess.run([sys.executable, str(CHECKOUT / "doc" / "studies" / name), *map(str, words)], env=environment, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=300)


@pytest.fixture()
def page(tmp_path):
    path = tmp_path / "page.md"
    parts = "".join(f"<!-- {name}: doc/studies/bench.py -->\nold {name}\n<!-- end of {name} -->\n" for name in ("summary", *bench.SECTIONS))
    path.write_text(f"before\n{parts}after\n", encoding="utf-8")
    return path


def test_quick_bench_writes_its_tables(page):
    """Every section on small scenes; between the markers of the page only. Each time is one of LAMMPS' own, so above zero."""
    run = tool("bench.py", "--quick", "--out", page)
    assert run.returncode == 0, run.stderr[-2000:]
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n") and text.endswith("after\n") and "\nold" not in text
    for title in ("Pair loop", "Neighbor build", "Cost of each effect", "Whole step", "Scale", "Ranks"):
        assert f"### {title}" in text, title
    with open(page.with_suffix(".csv"), encoding="utf-8") as source:
        times = {row["name"]: float(row["value"]) for row in csv.DictReader(source) if row["section"] == "lattice"}
    assert {"evp/lj", "evp/lj, gamma > 0", "lj/cut"} <= set(times)
    assert all(value > 0.0 for value in times.values()), times
    share = float(text.split("*pairs crossing xi_s* ")[1].split(" %")[0])
    assert share >= 2.0, "control: pairs do cross xi_s in that scene"
    assert "about" in run.stderr and "left" in run.stderr, "progress with the time left"
    assert (page.parent / "figures" / "page.png").stat().st_size > 10000
