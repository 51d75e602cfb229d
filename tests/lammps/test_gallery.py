# SPDX-License-Identifier: GPL-2.0-only
"""doc/gallery.md: its commands are those of doc/studies/gallery.py; the quick ones, run from the page's text, give its numbers and pictures."""

import re

import gallery
import matplotlib.image
import pytest
import gallery_scenes
from lammps_run import DECKS, REPOSITORY

PAGE = REPOSITORY / "doc" / "gallery.md"
QUICK = 5.5  # processor time on the page [s]
TOTAL = 11.5  # of the scenes that are run, the quickest first
SAME = 0.02  # of the numbers, on another machine
PARTS = {part.partition("\n")[0]: part for part in PAGE.read_text(encoding="utf-8").split("\n## ")[1:]}
SCENES = {scene.key: scene for scene in gallery_scenes.SCENES}


def seconds(part):
    return float(re.search(r"^(\S+) s of processor time", part, re.M)[1])


def commands(part):
    return [line[4:] for line in part.splitlines() if line.startswith("    ")]


def quick():
    """Keys of the scenes that are run here."""
    found, total = [], 0.0
    for scene in sorted(SCENES.values(), key=lambda scene: seconds(PARTS[scene.title])):
        total += seconds(PARTS[scene.title])
        if total <= TOTAL and seconds(PARTS[scene.title]) <= QUICK:
            found.append(scene.key)
    return found


def cells_of(line):
    """Of a row of a table; [] of other lines."""
    return [cell.strip() for cell in line.strip("| ").split(" | ")] if line.startswith("| ") else []


def numbers_of(rows):
    """{what: number} of rows of cells."""
    return {row[0]: float(row[1].split()[0]) for row in rows}


def test_page_is_of_these_scenes():
    """Titles, commands and pictures; each picture is small, and each link leads to a file."""
    assert list(PARTS) == [scene.title for scene in SCENES.values()], "run doc/studies/gallery.py"
    for scene in SCENES.values():
        assert commands(PARTS[scene.title]) == list(scene.commands), "run doc/studies/gallery.py"
        assert (PAGE.parent / "gallery" / scene.picture).stat().st_size < (150e3 if scene.picture.endswith(".png") else 1e6)
    assert len(quick()) >= 4, "control: some are run"
    for link in re.findall(r"\]\(([^)#]+)\)", PAGE.read_text(encoding="utf-8")):
        assert (PAGE.parent / link).is_file(), link


def test_numbers_of_the_decks_are_those_of_the_page():
    """The table of lammps_inputs/README.md has each number of the page, by deck, and each deck but the three to copy."""
    _, table, _ = gallery.split_at_marks(DECKS / "README.md", *gallery.MARKS)
    listed = [cells_of(line) for line in table.splitlines()[3:] if line]
    shown = [row for part in PARTS.values() for row in map(cells_of, part.splitlines()) if len(row) == 4]
    shown = [row for row in shown if row[0] != "number" and not row[0].startswith("---")]
    assert [row[1:4] for row in listed] == [row[:3] for row in shown], "run doc/studies/gallery.py"
    decks = {row[0].strip("`") for row in listed}
    assert {path.name for path in DECKS.glob("in.*")} - decks == {"in.ball", "in.metal", "in.pull"}
    for link, place in re.findall(r"\]\(([^)#]+)#?([^)]*)\)", table):
        assert (DECKS / link).is_file() and (not place or place in map(gallery.anchor, PARTS)), (link, place)


@pytest.mark.parametrize("key", quick())
def test_commands_of_the_page(tmp_path, key):
    scene = SCENES[key]
    gallery.prepare(tmp_path)
    text, _ = gallery.run(commands(PARTS[scene.title]), tmp_path)
    cells = [cells_of(line) for line in PARTS[scene.title].splitlines() if line.startswith("| ")]
    found, printed = numbers_of(gallery.rows(scene.numbers(tmp_path, text))), numbers_of(cells[1:])
    assert found.keys() == printed.keys()
    exact = {name: value for name, value in printed.items() if "imbalance" not in name}
    assert {name: found[name] for name in exact} == pytest.approx(exact, rel=SAME)
    drawn, shown = (matplotlib.image.imread(folder / scene.picture).shape for folder in (tmp_path, PAGE.parent / "gallery"))
    assert drawn[:2] == shown[:2]
