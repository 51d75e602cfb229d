# SPDX-License-Identifier: GPL-2.0-only
"""What decks have in common is the same text: LAMMPS finds included files from the working folder, not from the deck's, so
that each deck, which runs from any folder, holds all of it."""

import pathlib
import re

import pytest

DECKS = pathlib.Path(__file__).resolve().parents[2] / "lammps_inputs"
SHARED = ("specimen", "material", "grips and start: linear velocity profile", "strain and the two stresses")


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


@pytest.mark.parametrize("deck", sorted(path.name for path in DECKS.glob("in.*")))
def test_a_choice_that_is_no_number_is_named(deck):
    """Each choice whose default is a number is in the formula at which LAMMPS names one that is none."""
    text = (DECKS / deck).read_text(encoding="utf-8")
    found = set(re.findall(r"^variable (\w+) +index -?[\d.]", text, flags=re.M))
    summed = re.search(r"^variable +numbers equal \$\((.*)\) ", text, flags=re.M)[1]
    assert found - {"resume"} <= {name[2:] for name in summed.split("+")} and ("resume" in found) == ('if "$(v_resume) < 0' in text)


def test_choices_are_the_same():
    """By name and default, but for what the way is made of."""
    cyclic, traction, rest = map(choices, ("in.cyclic", "in.traction", "in.quasistatic"))
    assert set(cyclic) - set(traction) == {"lower", "cycles"} and not set(traction) - set(cyclic)
    same = set(traction) - {"rate", "strain", "out"}
    assert {name: cyclic[name] for name in same} == {name: traction[name] for name in same}
    for name in ("plasticity", "break", "kv", "scale", "length", "radius", "area", "extensometer", "specimen", "contact"):
        assert rest[name] == traction[name], name


def test_in_quasistatic_takes_body_and_material_as_in_traction_does():
    """Line by line; what stands between them in in.traction is the zone, the volume energy and the text of the readings."""
    rest, traction = (sections(name)["material"].splitlines() for name in ("in.quasistatic", "in.traction"))
    assert len(rest) > 15 and [line for line in rest if line.strip() and line not in traction] == []
    decks = [(DECKS / name).read_text(encoding="utf-8") for name in ("in.quasistatic", "in.traction")]
    for command in ("read_evp_body ", "neighbor ", "neigh_modify ", 'if "${kv} > 0" then', 'if "${kv} == 0 &&'):
        lines = [re.findall(f"^{re.escape(command)}.*$", deck, flags=re.M) for deck in decks]
        assert lines[0] == lines[1] and len(lines[0]) == 1, command
