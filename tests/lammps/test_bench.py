# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/bench.py and doc/studies/implicit_cost.py run, count what they time, and refuse what they cannot use."""

import csv
import os
import pathlib
import subprocess
import sys

import pytest

CHECKOUT = pathlib.Path(__file__).resolve().parents[2]


def tool(name, *words):
    environment = {**os.environ, "PYTHONPATH": str(CHECKOUT / "tools")}
    return subprocess.run([sys.executable, str(CHECKOUT / "doc" / "studies" / name), *map(str, words)], env=environment, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=300)


@pytest.fixture()
def page(tmp_path):
    path = tmp_path / "page.md"
    path.write_text("before\n<!-- table: doc/studies/bench.py -->\nold\n<!-- end of table -->\nafter\n", encoding="utf-8")
    return path


def test_quick_bench_writes_its_tables(page):
    """Every section on small scenes; between the markers of the page only. Each time is one of LAMMPS' own, so above zero."""
    run = tool("bench.py", "--quick", "--out", page)
    assert run.returncode == 0, run.stderr[-2000:]
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n") and text.endswith("after\n") and "\nold\n" not in text
    for title in ("Pair loop", "Neighbor build", "Cost of each effect", "Whole step", "Scale", "Ranks"):
        assert f"### {title}" in text, title
    with open(page.with_suffix(".csv"), encoding="utf-8") as source:
        times = {row["name"]: float(row["value"]) for row in csv.DictReader(source) if row["section"] == "lattice"}
    assert {"evp/lj", "evp/lj, gamma > 0", "lj/cut"} <= set(times)
    assert all(value > 0.0 for value in times.values()), times
    share = float(text.split("*pairs crossing xi_s* ")[1].split(" %")[0])
    assert share >= 2.0, "control: pairs do cross xi_s in that scene"
    assert "about" in run.stderr and "left" in run.stderr, "progress with the time left"


def test_implicit_cost_writes_its_tables(tmp_path):
    """Both ways end on the same stress; a small second specimen, since the times are not the point here."""
    page = tmp_path / "cost.md"
    run = tool("implicit_cost.py", "--repeats", 1, "--strain", 0.0005, "--large", 400, "--out", page, "--work", tmp_path)
    assert run.returncode == 0, run.stderr[-2000:]
    rows = [line.split("|")[1:-1] for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    stress = {row[0].strip(): float(row[4]) for row in rows if row[0].strip() != "integrator"}
    assert set(stress) == {"explicit, 0.8 of the largest stable dt", "explicit, 0.4 of the largest stable dt", "implicit, dt = 1e-05 s", "1 MPI rank", "2 MPI ranks"}
    assert stress["implicit, dt = 1e-05 s"] == pytest.approx(stress["explicit, 0.4 of the largest stable dt"], rel=1e-2)
    assert stress["2 MPI ranks"] == pytest.approx(stress["1 MPI rank"], rel=1e-3)
