# SPDX-License-Identifier: GPL-2.0-only
"""Inactive effects cost nothing, and one line at set-up says so; what looks like a mistake is warned of."""

import itertools

import numpy as np
import pytest
from lammps_run import write_data
from small_bodies import head, thermo

DECK = head(start="read_data row.data", skin=0.002) + """
pair_style evp/lj {style}
pair_coeff * * {coeff}
{fix}
fix move all nve
timestep 1e-9
""" + thermo("pe fmax") + "run 2\n"
TABLE1 = "80 8 4 3 8 4 0.005 0 1.5"
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"
FIX = "fix bonds all evp/bonds"
NO_FIX = "no fix evp/bonds: every pair has deq = R_i + R_j"


@pytest.fixture
def row(tmp_path):
    """A row of spheres, as row.data."""
    place = np.array([[0.0104 * k, 0.0, 0.0] for k in range(6)])
    write_data(tmp_path / "row.data", place, np.full(6, 0.005), [[-0.05, 0.1], [-0.05, 0.05], [-0.05, 0.05]])


def deck(style="", coeff=TABLE1, fix=FIX, after=""):
    return DECK.format(style=style, coeff=coeff, fix=fix) + after


def lines(result):
    return [line for line in result.ok().stdout.splitlines() if line.startswith("evp/lj: ")]


def test_one_line_says_what_is_on(row, lmp_decks):
    choices = list(itertools.product(("", "contact literal", "contact repulsive", "contact none"), (TABLE1, TABLE2), (FIX, "")))
    for (style, coeff, fix), run in lmp_decks({choice: deck(*choice, after="run 1\n") for choice in choices}, ranks=2).items():
        found = lines(run)
        assert len(found) == 1, "once, though there are two runs"
        for part in ("damping on" if coeff == TABLE2 else "damping off", f"contact {style.split()[-1] if style else 'literal'}",
                     "deq of bonds from fix bonds" if fix else NO_FIX, "overlap warning above 0.3 (R_i + R_j)"):
            assert part in found[0], (style, coeff, fix)


def test_keywords_that_change_no_force_are_named(row, lmp_decks):
    """Soften and rate act with plasticity and fix evp/heat; those that change no force are not named. No warning: such a run is a metal at its reference temperature."""
    plastic, hot = "contact repulsive plasticity isotropic", "fix t all property/atom temperature heatflow ghost yes\nset group all temperature 300\nfix heat all evp/heat\n"
    thermal = " density 2700 conductivity 1 capacity 1"
    choices = {"cold": (plastic, " soften 298 775 1 rate 0.01 1", "fix evp/heat: soften, rate,"), "one": (plastic, thermal + " rate 0.01 1", "fix evp/heat: rate,"),
               "none": (plastic, thermal, ""), "eq. 8": ("", " soften 298 775 1", "plasticity isotropic: soften,")}
    decks = {name: deck(style, TABLE1 + more) for name, (style, more, _) in choices.items()}
    decks["hot"] = deck(plastic, TABLE1 + thermal + " soften 298 775 1", FIX + "\n" + hot, after="unfix heat\nrun 1\n")
    runs = lmp_decks(decks, ranks=2)
    for name, (_, _, said) in choices.items():
        assert [line.partition("inactive without ")[2].partition(" overlap")[0] for line in lines(runs[name])] == [said], name
    assert ["inactive without fix evp/heat: soften," in line for line in lines(runs["hot"])] == [False, True]
    assert not any(run.warnings() for run in runs.values())


def test_a_change_is_said_again(row, lmp):
    found = lines(lmp(deck(after=f"pair_coeff * * {TABLE2}\nrun 1\nunfix bonds\nrun 1\n")))
    assert ["damping on" in line for line in found] == [False, True, True]
    assert [NO_FIX in line for line in found] == [False, False, True]


def test_no_fix_is_no_error_and_means_the_sum_of_radii(row, lmp_decks):
    """A row of gaps 4 % wide: with the fix it is at rest; without it the first and the last are pulled with more than
    the yield force m1 n1 e1 xi_s/deq, their neighbors on both sides in balance. With contact none nothing acts, which is warned of."""
    yield_force, text = 8 * 4 * 80 * 0.005 / 0.01, "no pair interacts"
    runs = lmp_decks({(style, fix): deck(style, fix=fix) for style in ("", "contact none", "contact repulsive") for fix in (FIX, "")})
    assert runs["", FIX].thermo()["Fmax"][0] < 1e-9 * yield_force
    assert runs["", ""].thermo()["Fmax"][0] > 0.9 * yield_force
    assert {key for key, run in runs.items() if any(text in line for line in run.warnings())} == {("contact none", "")}


def test_small_alpha_with_literal_contacts_is_warned_of(row, lmp_decks):
    choices = {("", 1.1): 1, ("", 1.39): 1, ("", 1.4): 0, ("contact none", 1.1): 0}
    runs = lmp_decks({(style, alpha): deck(style, TABLE1.replace("1.5", str(alpha))) for style, alpha in choices})
    for (style, alpha), expected in choices.items():
        assert sum(f"alpha = {alpha} is below 1.4" in w for w in runs[style, alpha].warnings()) == expected, (style, alpha)


def test_overlap_is_counted_and_warned_of_once(tmp_path, lmp_decks):
    """Pairs at 0.5, 0.6 and 0.9 of R_i + R_j, far from each other."""
    place = [[0.00, 0, 0], [0.005, 0, 0], [0.04, 0, 0], [0.046, 0, 0], [0.08, 0, 0], [0.089, 0, 0]]
    write_data(tmp_path / "row.data", np.array(place), np.full(6, 0.005), [[-0.05, 0.1], [-0.05, 0.05], [-0.05, 0.05]])
    expected = {"": 2, "overlap 0.05": 3, "overlap 0.6": 0}
    for overlap, run in lmp_decks({overlap: deck(overlap, after="run 3\n") for overlap in expected}, 2).items():
        warned = [w for w in run.warnings() if "overlap by more than" in w]
        assert len(warned) == (1 if expected[overlap] else 0), "in two runs, as there are no more, by one rank"
        if expected[overlap]:
            assert f"{expected[overlap]} pairs overlap by more than {overlap.split()[-1] if overlap else 0.3} (R_i + R_j)" in warned[0]
