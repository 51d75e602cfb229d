# SPDX-License-Identifier: GPL-2.0-only
"""What decks have in common is the same text: LAMMPS finds included files from the working folder, not from the deck's, so
that each deck, which runs from any folder, holds all of it."""

import pathlib
import re

import pytest

DECKS = pathlib.Path(__file__).resolve().parents[2] / "lammps_inputs"
MEASURES = "measures of the body: those given, else those of SPECIMEN.body, else the paper's"
FIT = "do the centres fit these measures?"
SHARED = ("specimen", MEASURES, FIT, "material", "grips and start: linear velocity profile", "strain and the two stresses")


def sections(name):
    """{title: text} of a deck."""
    parts = re.split(r"^# -------- (.*) --------$", (DECKS / name).read_text(encoding="utf-8"), flags=re.M)
    return dict(zip(parts[1::2], parts[2::2]))


def choices(name):
    """{choice: its line} of a deck."""
    lines = sections(name)["choices (SI units)"].splitlines()
    return {line.split()[1]: line for line in lines if re.match(r"variable \w+ +index ", line)}


@pytest.mark.parametrize("section", SHARED)
def test_in_cyclic_is_in_traction_up_to_the_way(section):
    assert sections("in.cyclic")[section] == sections("in.traction")[section]


def test_choices_are_the_same():
    """By name and default, but for what the way is made of."""
    cyclic, traction, rest = map(choices, ("in.cyclic", "in.traction", "in.quasistatic"))
    assert set(cyclic) - set(traction) == {"lower", "cycles"} and not set(traction) - set(cyclic)
    same = set(traction) - {"rate", "strain", "out"}
    assert {name: cyclic[name] for name in same} == {name: traction[name] for name in same}
    for name in ("unload", "break", "kv", "scale", "length", "radius", "area", "extensometer", "specimen", "contact"):
        assert rest[name] == traction[name], name


@pytest.mark.parametrize("section", (MEASURES, FIT))
def test_in_quasistatic_takes_its_measures_as_in_traction_does(section):
    """But for what follows them there: a resumed run, the neighbor list."""
    rest, traction = (sections(name)[section].strip() for name in ("in.quasistatic", "in.traction"))
    shorter = min(rest, traction, key=len)
    assert shorter.splitlines()[:10] and max(rest, traction, key=len).startswith(shorter)
