# SPDX-License-Identifier: GPL-2.0-only
"""Programs of doc/studies with LAMMPS: what they measure, and the pages that they write."""

import csv
import dataclasses
import os
import re
import statistics
import subprocess
import sys
from collections import defaultdict
from types import SimpleNamespace

import bench
import closed_form_loads
import failure
import gallery
import limits
import matplotlib.image
import numpy as np
import pytest
import time_order
import what_to_believe
from evp import curves, specimen
from lammps_run import DECKS, REPOSITORY, packed, read_dump, run_lammps
from study import Runs

DOC = REPOSITORY / "doc"

# ---- the order of accuracy in dt that the pages of the integrators state ----

ORDER = 0.06  # of an order at the dt used, measured: the next power of dt is still in it


@pytest.mark.parametrize("style, gamma, order", [("nve", 0.0, 2.0), ("nve", 100.0, 1.0), ("nve/evp", 100.0, 1.0)])
def test_damping_makes_time_integration_first_order(tmp_path, style, gamma, order):
    """Control: without damping it is of second order."""
    way = next(way for way in time_order.WAYS if way.style == style and way.gamma == gamma)
    differences, _ = time_order.measure(way._replace(steps=2 * way.steps), 2, tmp_path)
    assert np.log2(differences[0] / differences[1]) == pytest.approx([order, order], abs=ORDER)


# ---- the steps between two updates of plastic strains and limits ----


def test_plastic_strains_lag_by_half_of_the_strain_between_two_updates(tmp_path, monkeypatch):
    """A metal that hardens as p^0.25, just after yield, without a yield condition, which would correct it: a stress of p - lag; twice the steps, twice the lag."""
    of_row = limits.coefficients
    monkeypatch.setattr(limits, "coefficients", lambda *row: re.sub(r" yield \S+", "", of_row(*row)))
    case, runs = next(case for case in limits.CASES if (case.name, case.rate) == ("hardening, shear", 500.0))._replace(at=(0.01, 0.012)), Runs(tmp_path)
    found = {update: limits.measure(case, update, 0.4, runs, "just_yielded") for update in (1, 5, 10)}
    off = {update: limits.differences(found[update], found[1])[0] for update in (5, 10)}
    lag = 10 * found[10].step / 2
    assert off[10] == pytest.approx(-100.0 * 0.25 * lag / (0.01 - 0.001), rel=0.3) and off[5] == pytest.approx(0.5 * off[10], rel=0.3)


# ---- parts beside finite elements ----


@pytest.mark.parametrize("operation, points, off", [
    ("upsetting, friction 0.1", (0.2, 0.49), (7.6, 1.0)), ("tension, gripped", (0.05, 0.1), (1.8, 2.8)), ("torsion, gripped", (0.02, 0.05), (-7.3, -6.2)),
    ("V-bending", (3.0, 7.8), (1.0, -1.1))])
def test_parts_of_500_spheres_beside_finite_elements(tmp_path, operation, points, off):
    """Differences of the load [%], as measured when the page was written, within what a body that flows otherwise would change."""
    study = SimpleNamespace(runs=Runs(tmp_path), ranks=1, spheres=[500], plates=[500], shapes=defaultdict(dict), states={})
    part = next(part for part in what_to_believe.parts_of(study) if (part.operation, part.metal) == (operation, what_to_believe.STEEL))
    part = dataclasses.replace(part, points=points)
    assert what_to_believe.off_at(part, *part.measure(study, part, 11, 500), part.curve()) == pytest.approx(off, abs=2.5)


# ---- torsion and bending of small bodies against closed forms ----


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return [closed_form_loads.measure(1000, seed, Runs(tmp_path_factory.mktemp("loads"))) for seed in (1, 2)]


@pytest.mark.parametrize("load, most, least", [("torsion", 0.92, 0.8), ("bending", 0.93, 0.85)])
def test_stiffness(found, load, most, least):
    """With 1000 spheres the surface takes a tenth (doc/validation.md); the ratio that the places and directions of the bonds give for it is met
    within 4 % in the mean of two packings, and no number is fitted."""
    measured, bonds = ([getattr(one, name) for one in found] for name in (load, f"{load}_bonds"))
    assert statistics.mean(a / b for a, b in zip(measured, bonds)) == pytest.approx(1.0, abs=0.04)
    assert max(bonds) < most and min(measured) > least, "control: the surface is seen"


def test_nine_numbers_are_one_material_in_bodies_of_any_volume(found):
    """pi 0.02^2 0.1 m3 and 2e-5 m3."""
    assert all(one.bar_modulus / one.round_modulus == pytest.approx(1.0, rel=0.12) for one in found)


# ---- bench: it counts what it times ----


@pytest.fixture()
def page(tmp_path):
    path = tmp_path / "page.md"
    parts = "".join(f"<!-- {name}: doc/studies/bench.py -->\nold {name}\n<!-- end of {name} -->\n" for name in ("summary", *bench.SECTIONS))
    path.write_text(f"before\n{parts}after\n", encoding="utf-8")
    return path


def test_quick_bench_writes_its_tables(page):
    """Every section on small scenes; between the markers of the page only. Each time is one of LAMMPS' own, so above zero."""
    words = [sys.executable, REPOSITORY / "doc" / "studies" / "bench.py", "--quick", "--out", page]
    run = subprocess.run(words, env={**os.environ, "PYTHONPATH": str(REPOSITORY / "tools")}, stdin=subprocess.DEVNULL,
                         capture_output=True, text=True, check=False, timeout=300)
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


# ---- gallery: each section has numbers of gallery_scenes.py; the quick ones are run from the page's text ----

SAME = 0.02  # of the numbers, on another machine
PARTS = {part.picture: part for part in gallery.parts()}
QUICK = [part.picture for part in sorted(PARTS.values(), key=lambda part: float((re.search(r"^(\S+) s of processor time", part.written) or ["", "inf"])[1]))[:3]]


def cells_of(text):
    """Of the rows of a table, without its head."""
    return [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in text.splitlines() if line.startswith("| ")][1:]


def numbers_of(rows):
    """{what: number} of rows of cells."""
    return {row[0]: float(row[1].split()[0]) for row in rows}


def test_each_deck_is_on_the_page():
    """But the three to copy, and two that measure a material; each scene has its section."""
    named = set(re.findall(r"lammps_inputs/(in\.\w+)", " ".join(command for part in PARTS.values() for command in part.commands)))
    assert {path.name for path in DECKS.glob("in.*")} - named == {"in.ball", "in.metal", "in.moduli", "in.pull", "in.uniaxial"} and list(PARTS) == list(gallery.SCENES)


@pytest.mark.parametrize("picture", QUICK)
def test_commands_of_the_page(tmp_path, picture):
    gallery.prepare(tmp_path)
    part = PARTS[picture]
    found, printed = numbers_of(gallery.rows(part, gallery.measure(part, tmp_path)[0])), numbers_of(cells_of(part.written))
    exact = {name: value for name, value in printed.items() if "imbalance" not in name}
    assert {name: found[name] for name in exact} == pytest.approx(exact, rel=SAME)
    drawn, shown = (matplotlib.image.imread(folder / picture).shape for folder in (tmp_path, gallery.PAGE.parent / "gallery"))
    assert drawn[:2] == shown[:2]


# ---- regions/notched.lmp, packed by in.specimen and pulled apart by in.traction ----

NET = 1e-4  # cross-section between the notches [m2]
VOLUME = 2e-4 * 0.05 - 2 * (0.002 * 0.004 + np.pi * 0.001**2 / 2) * 0.01  # without two slots with round ends [m3]


bar = packed("notched.data", n=2000, **failure.NOTCHED)


def test_measures_are_those_of_the_drawing(bar):
    lines = dict(re.findall(r"^variable (\w+) equal (\S+)", (bar.parent / "notched.data.body").read_text(encoding="utf-8"), re.M))
    assert float(lines["length"]) == 0.05 and float(lines["area"]) == pytest.approx(NET, rel=0.01)
    assert float(lines["volume"]) == pytest.approx(VOLUME, rel=0.003)
    assert float(lines["solid_fraction"]) == pytest.approx(0.60, abs=0.015)
    body = specimen.read_data(bar)
    assert not ((np.abs(body.x[:, 0] - 0.025) < 0.001) & (np.abs(body.x[:, 1]) > 0.0055)).any(), "in a slot"


def test_it_breaks_at_the_notches(bar, tmp_path):
    """It parts, and what has flowed most and the atoms that lost bonds are near mid-length; stress is that of the net section."""
    row = "80 8 4 3 8 4 0.005 20 1.5 spacing 0.00585189 coordination 11.9 density 2700 damage 0.05 0 0 0 0 rupture 0"
    choices = {"specimen": bar, "coeff": row, "contact": "repulsive", "plasticity": "isotropic", "rate": 100, "strain": 0.03, "row": 0.00025, "dtfraction": 0.8}
    found = run_lammps("in.traction", 1, {**choices, "out": "pull"}, tmp_path).ok()
    assert float(re.search(r"cross-section (\S+) m2", found.stdout)[1]) == pytest.approx(NET, rel=0.01)
    curve = curves.read_curve(tmp_path / "pull.csv")
    read = failure.parted("pull", curve.strain, curve.grip * NET, failure.FREE)
    assert 150e6 < read.force / NET < 230e6 and 0.005 < read.at < read.strain < 0.025 and 20e3 < read.work / NET < 150e3
    state = read_dump(tmp_path / "pull_state.dump")[-1]
    before = specimen.read_data(bar).x[:, 0]
    lost = state["share_lost"] > 0.0
    assert lost.sum() > 50 and np.median(np.abs(before[lost] - 0.025)) < 0.003, "the body is 0.05 m long"
