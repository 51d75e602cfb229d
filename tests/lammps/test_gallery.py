# SPDX-License-Identifier: GPL-2.0-only
"""doc/gallery.md: each section has numbers of doc/studies/gallery_scenes.py; the quick ones, run from the page's text, give its numbers and pictures."""

import re

import gallery
import matplotlib.image
import pytest
from lammps_run import DECKS

SAME = 0.02  # of the numbers, on another machine
PARTS = {part.picture: part for part in gallery.parts()}
QUICK = [part.picture for part in sorted(PARTS.values(), key=lambda part: float(re.search(r"^(\S+) s of processor time", part.written)[1]))[:3]]


def cells_of(text):
    """Of the rows of a table, without its head."""
    return [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in text.splitlines() if line.startswith("| ")][1:]


def numbers_of(rows):
    """{what: number} of rows of cells."""
    return {row[0]: float(row[1].split()[0]) for row in rows}


def test_numbers_of_the_decks_are_those_of_the_page():
    """The table of lammps_inputs/README.md has each number of the page, by deck, and each deck but the three to copy; the page has each scene."""
    _, table, _ = gallery.split_at_marks(DECKS / "README.md", *gallery.MARKS)
    listed = cells_of(table)
    assert [row[1:4] for row in listed] == [row[:3] for part in PARTS.values() for row in cells_of(part.written)], "run doc/studies/gallery.py"
    decks = {row[0].strip("`") for row in listed}
    assert {path.name for path in DECKS.glob("in.*")} - decks == {"in.ball", "in.metal", "in.pull"} and list(PARTS) == list(gallery.SCENES)


@pytest.mark.parametrize("picture", QUICK)
def test_commands_of_the_page(tmp_path, picture):
    gallery.prepare(tmp_path)
    part = PARTS[picture]
    found, printed = numbers_of(gallery.rows(part, gallery.measure(part, tmp_path)[0])), numbers_of(cells_of(part.written))
    exact = {name: value for name, value in printed.items() if "imbalance" not in name}
    assert {name: found[name] for name in exact} == pytest.approx(exact, rel=SAME)
    drawn, shown = (matplotlib.image.imread(folder / picture).shape for folder in (tmp_path, gallery.PAGE.parent / "gallery"))
    assert drawn[:2] == shown[:2]
