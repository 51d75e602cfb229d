# SPDX-License-Identifier: GPL-2.0-only
"""in.torsion and in.bending take body and material as in.quasistatic does, in the same words, and load bodies alike."""

import pathlib
import re

import pytest

DECKS = pathlib.Path(__file__).resolve().parents[2] / "lammps_inputs"
TEXT = {name: (DECKS / f"in.{name}").read_text(encoding="utf-8") for name in ("quasistatic", "torsion", "bending")}


def section(name, title):
    """Lines of a section of a deck."""
    return re.split(r"^# -------- .* --------$", TEXT[name].partition(f"# -------- {title}")[2], flags=re.M)[0].splitlines()[1:]


def choices(name):
    """{choice: its line} of a deck."""
    return {line.split()[1]: line for line in section(name, "choices") if re.match(r"variable \w+ +index ", line)}


@pytest.mark.parametrize("name", ["torsion", "bending"])
def test_material_is_that_of_in_quasistatic(name):
    lines = [line for line in section(name, "material") if line.strip()]
    assert len(lines) > 15 and [line for line in lines if line not in TEXT["quasistatic"].splitlines()] == []


@pytest.mark.parametrize("name", ["torsion", "bending"])
def test_choices_are_those_of_in_quasistatic(name):
    own, rest = choices(name), choices("quasistatic")
    for choice in ("coeff", "material", "scale", "contact", "plasticity", "break", "kv", "tolerance", "evaluations"):
        assert own[choice] == rest[choice], choice
    contact = [re.findall(r"^.*contact_given.*(?:\n  .*)?$", TEXT[deck], flags=re.M) for deck in (name, "quasistatic")]
    assert contact[0] == contact[1] and len(contact[0]) == 2


def test_both_rest_and_write_alike():
    """But for what turns, and what is printed."""
    torsion, bending = (section(name, "rows and frames") for name in ("torsion", "bending"))
    assert len(torsion) > 60 and sum(line not in bending for line in torsion) < 14
