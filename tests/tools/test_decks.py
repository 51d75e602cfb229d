# SPDX-License-Identifier: GPL-2.0-only
"""Decks are short: so many lines, choices and `if`s, and one command that prints all choices; what they have in common is the same text, as LAMMPS finds included
files from the working folder only."""

import re

import pytest
from evp.run import DECKS

TEXT = {path.name: path.read_text(encoding="utf-8") for path in sorted(DECKS.glob("in.*"))}
LONGEST = {"in.specimen": 180, "in.quasistatic": 150, "in.pull": 40, "in.metal": 40, "in.ball": 40}
PLAIN = ("in.pull", "in.metal", "in.ball")
CHOOSING = [name for name in TEXT if name not in PLAIN]
LOADS = ("in.traction", "in.cyclic", "in.quasistatic", "in.torsion", "in.bending")


def choices(name):
    """{choice: its line} of a deck."""
    head = TEXT[name].partition("# -------- choices")[2].partition("\nevp_choices ")[0]
    return {line.split()[1]: line for line in head.splitlines() if re.match(r"variable +\w+ +index ", line)}


@pytest.mark.parametrize("name", TEXT)
def test_decks_are_short(name):
    assert TEXT[name].count("\n") <= LONGEST.get(name, 100)
    assert len(re.findall(r"^if ", TEXT[name], flags=re.M)) <= 6
    assert sum(text.count("\n") for text in TEXT.values()) <= 1466, "all decks"
    assert name not in PLAIN or not re.search(r"^if | index |\${", TEXT[name], flags=re.M), "the first decks have no choice"


@pytest.mark.parametrize("name", CHOOSING)
def test_at_most_twelve_choices_which_one_command_prints(name):
    """It warns of others, such as a misspelled -var."""
    found = choices(name)
    assert 3 < len(found) <= 12
    printed = re.search(rf"^evp_choices +{re.escape(name)} ((?:.*&\n)*.*)$", TEXT[name], flags=re.M)[1].replace("&\n", "")
    *printed, last = printed.split()
    assert {re.match(r"\w*", word)[0] for word in printed if "?" not in word} - {"coeff_ball"} == set(found) and last == "only"
    body = TEXT[name].partition("\nevp_choices ")[2].partition("\n")[2]
    assert all("# " in line and re.search(rf"\$\{{{choice}\}}|\bv_{choice}\b", body) for choice, line in found.items()), "each is explained and used"


@pytest.mark.parametrize("name", LOADS[1:])
def test_load_decks_take_body_and_material_alike(name):
    for choice in ("specimen", "plasticity", "coeff", "contact", "break"):
        assert choices(name)[choice] == choices("in.traction")[choice], choice
    material = TEXT["in.traction"].partition("read_evp_row ")[2].partition("\n")[2].partition("if \"${row_density}")[0]
    lines = [line for line in material.splitlines() if line]
    assert len(lines) == 2
    assert [line for line in lines if line not in TEXT[name]] == []
