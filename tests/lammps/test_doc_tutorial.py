# SPDX-License-Identifier: GPL-2.0-only
"""All commands of doc/tutorial.rst are run, with smaller bodies; what they print has the form and about the figures of the page."""

import importlib.util
import re

import pytest
import tutorial_page
from evp import surface
from lammps_run import LMP
from study import run_blocks

PAGE = tutorial_page.PAGE.read_text(encoding="utf-8")
STEPS = tutorial_page.steps(PAGE)
# What is smaller here than on the page: bodies, ranks, pictures; and a higher rate.
SMALLER = (("--n 2000", "--n 300"), ("-var increment 0.0001", "-var increment 0.0002"), ("--name alloy --out", "--spheres 250 --name alloy --out"),
           ("-var strain 0.008", "-var rate 40 -var strain 0.008"),
           ("-var frames 20", "-var frames 3"), ("--out my.evp", "--out my.evp || [ $? -eq 3 ]"), ("--pixels 400", "--pixels 150"))
SAME = 0.12  # of the figures, for a fourth of the spheres and other packings
NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?")


def form(text):
    """Of an output: numbers are all the same, and so are blanks; lines of one form count once, as a calibration may take one run more."""
    return list(dict.fromkeys(re.sub(r"\s+", " ", NUMBER.sub("#", line)).strip() for line in text.splitlines()))


def rows(text, name):
    """Cells of the lines of a curve in all tables of evp curves, one after the other, without ranges."""
    return [float("nan" if cell == "-" else cell) for line in re.findall(rf"^{name} +(.+)$", text, re.M) for cell in line.split() if ".." not in cell]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    if importlib.util.find_spec("open3d") is None:
        pytest.skip("no open3d: " + surface.OPEN3D)
    folder = tmp_path_factory.mktemp("tutorial")
    blocks = "\x1e".join(step.commands for step in STEPS).replace("$PWD/build:", f"{LMP.parent}:")
    for words, other in SMALLER:
        assert words in blocks
        blocks = blocks.replace(words, other)
    return folder / "bar", run_blocks(blocks.split("\x1e"), folder, folder)


def test_outputs_are_those_of_the_commands(results):
    folder, found = results
    for step, (text, _) in zip(STEPS, found):
        pattern = re.sub(r"increment [^:|]+:", r"increment \\d+:", step.pattern)  # of other numbers here
        assert form(tutorial_page.lines_shown(text, pattern)) == form(step.shown), f"{step.title}: run doc/studies/tutorial_page.py"
    for picture in re.findall(r"^\.\. image:: tutorial/(\S+)", PAGE, re.M):
        assert (folder / picture).stat().st_size > 1000 and (tutorial_page.PICTURES / picture).stat().st_size < 7e5


def test_figures_of_the_page(results):
    """The curves of both runs: E, yield stress, stress at 1 %, and permanent strain."""
    found = results[1]
    for name, count in (("first.csv", 5), ("pull.csv", 12)):
        own, page = (rows(text, name) for text in (found[5][0], STEPS[5].shown))
        assert len(own) == count and own[:3] + own[5:8] + own[10:] == pytest.approx(page[:3] + page[5:8] + page[10:], rel=SAME, nan_ok=True), name
    modulus, *_, turn, stress, left, _, _, _, _ = rows(found[5][0], "pull.csv")
    assert modulus == pytest.approx(70.0, rel=0.12), "of a bar that is a few spheres wide"
    assert 0.97 < (turn - left) / (1e-3 * stress / modulus) < 1.1, "springback: the stress over E"
