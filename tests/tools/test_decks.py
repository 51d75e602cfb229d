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
    assert sum(text.count("\n") for text in TEXT.values()) <= 1375, "all decks"
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


def test_load_decks_take_body_and_material_by_the_same_lines():
    """So that in.traction stands for them in tests/lammps/test_body_file.py."""
    choices = re.search(r"^variable specimen .*?^variable break .*?$", TEXT["in.traction"], re.M | re.S)[0]
    lines = re.findall(r"^(?:include +\$.specimen|read_evp_row|pair_style|pair_coeff|fix +(?:bonds|volume))[^#\n]*", TEXT["in.traction"], re.M)
    assert len(lines) == 6 and all(line in TEXT[name] for line in lines for name in (*LOADS, "in.taylor")) and all(choices in TEXT[name] for name in LOADS)
