# SPDX-License-Identifier: GPL-2.0-only
"""Every deck names a choice that is no number, before it does anything."""

import pytest
from common_bodies import REFERENCE
from lammps_run import DECKS, run_lammps

NAMED = {"in.traction": "samples", "in.cyclic": "lower", "in.quasistatic": "tolerance", "in.torsion": "frames", "in.bending": "span",
         "in.shear": "rate", "in.taylor": "frames", "in.impact": "friction", "in.sliding": "rows", "in.specimen": "n",
         "in.two_spheres": "rows", "in.local_output": "pictures"}
OWN_BODIES = ("in.impact", "in.sliding", "in.specimen", "in.two_spheres")  # they have no -var specimen
RESUMED = ("in.quasistatic", "in.torsion", "in.bending")


@pytest.mark.parametrize("deck", sorted(path.name for path in DECKS.glob("in.*")))
def test_choice_that_is_no_number_is_named(tmp_path, deck):
    body = {} if deck in OWN_BODIES else {"specimen": REFERENCE}
    for name in {NAMED[deck], *(["resume"] if deck in RESUMED else [])}:
        found = run_lammps(deck, 1, {**body, "out": "run", name: "1e"}, tmp_path)
        assert found.returncode != 0 and f"ERROR: Variable {name}: Non-numeric variable value" in found.stdout, found.stdout[-800:]
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("deck, name, value, rule", [
    ("in.two_spheres", "rows", 10.5, "in.two_spheres: rows must be a positive integer"), ("in.two_spheres", "rows", -2, "in.two_spheres: rows must be a positive integer"),
    ("in.local_output", "pictures", 0, "pictures must be a positive integer"), ("in.local_output", "pictures", 1.5, "pictures must be a positive integer"),
    ("in.specimen", "seed", 1.5, "in.specimen: seed must be a positive integer"), ("in.impact", "frames", 0.5, "frames must be 0 or a positive integer"),
    ("in.taylor", "frames", 3.5, "frames must be 0 or a positive integer"), ("in.torsion", "restart", -1, "restart must be 0 or a positive integer")])
def test_counts_are_integers(tmp_path, deck, name, value, rule):
    found = run_lammps(deck, 1, {"out": "run", name: value}, tmp_path)
    assert found.returncode != 0 and f"\nERROR: {rule}, got {value}\n" in found.stdout, found.stdout[-800:]
    assert list(tmp_path.iterdir()) == []
