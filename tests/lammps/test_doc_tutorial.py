# SPDX-License-Identifier: GPL-2.0-only
"""All commands of doc/tutorial.rst are run, with smaller bodies; what they print has the form and about the figures of the page."""

import importlib.util
import re
import shutil

import doc_blocks
import numpy as np
import pytest
import tutorial_page
from evp import specimen, surface
from lammps_run import DECKS, LMP, read_csv
from study import run_blocks
from test_specimen import read_body

PAGE = tutorial_page.PAGE.read_text(encoding="utf-8")
STEPS = tutorial_page.steps(PAGE)
COUNT = 300  # spheres of the part; the least is 293
# What is smaller here than on the page: bodies, ranks, pictures; and a higher rate.
SMALLER = (("--n 2000", f"--n {COUNT}"), ("-var increment 0.0001", "-var increment 0.0002"), ("--name alloy --out", "--spheres 250 --name alloy --out"),
           ("-var strain 0.008", "-var rate 40 -var strain 0.008"),
           ("-var frames 20", "-var frames 3"), ("--out my.evp", "--out my.evp || [ $? -eq 3 ]"), ("--pixels 400", "--pixels 150"))
SAME = 0.12  # of the figures, for a seventh of the spheres and other packings
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


def test_body_of_the_part(results, tmp_path):
    """Volume and section of the surface, whole spheres within it, jammed, and one atom type. Measures of the part to the last digit of doc/Howto_evp_part.rst, whose
    other commands go on with this body. Elastic: the grips stretch less than the gauge, as twice the section strains half as much."""
    bar, found = results
    doc_blocks.prepare(tmp_path)
    pack, packed, pull, read, numbers = doc_blocks.blocks("doc/Howto_evp_part.rst")[:5]
    assert pack.text == "tools/body.py lammps_inputs/dog_bone.stl --axis z --unit mm --n 800 --out bone.data\n" and "evp body bar.stl --axis z --unit mm --n 2000 " in STEPS[1].commands
    for end in ("", ".body"):
        shutil.copy(bar / f"bar.data{end}", tmp_path / f"bone.data{end}")
    printed = found[1][0] + doc_blocks.run([*pull.commands(), *read.commands()], tmp_path)
    assert packed.text.splitlines()[0].partition("dog_bone.stl")[2] in printed and numbers.text.splitlines()[0] in printed
    packing, measured = specimen.read_data(tmp_path / "bone.data"), read_body(tmp_path / "bone.data.body")
    bone = surface.closed_surface(surface.read_mesh(DECKS / "dog_bone.stl"), "bone").placed("z", 1e-3)
    assert measured["volume"] == pytest.approx(bone.volume(), rel=1e-6) and measured["length"] == pytest.approx(bone.extents[0], rel=1e-6)
    assert measured["area"] == pytest.approx(0.5 * 32 * np.sin(2 * np.pi / 32) * 0.004**2, rel=1e-5)
    assert measured["solid_fraction"] == pytest.approx(np.sum(4 / 3 * np.pi * packing.radius**3) / measured["volume"], rel=1e-6)
    assert "1 atom types" in (tmp_path / "bone.data").read_text() and np.array_equal(packing.ids, np.arange(1, COUNT + 1))
    beyond = (packing.radius - bone.depth(packing.x)) / packing.radius.mean()
    near = beyond[np.abs(beyond) < 0.02]
    assert beyond.max() < 0.07 and np.sum(np.abs(beyond) < 0.05) > 0.6 * COUNT and np.sqrt(np.mean(near**2)) < 0.015
    pairs, ratio = specimen.pairs_within(packing, 1.5)
    assert 2 * np.sum(ratio < 1.001) / COUNT == pytest.approx(3.7, abs=0.7) and ratio.min() > 0.99
    curve = read_csv(tmp_path / "bone.csv")
    assert curve["strain_gauge"][4] / curve["strain"][4] == pytest.approx(1.13, abs=0.06)
