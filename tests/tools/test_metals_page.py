# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/metals.py: departures of known curves, and that the page, the rows and the targets that are shipped belong together."""

import metals
import numpy as np
import pytest
from metals import METALS
from evp.run import CHECKOUT

STEEL = METALS["steel_4340"]


def curve(factor, end):
    strain = np.linspace(0.0, abs(end), 401)
    return {"strain": strain, "stress": STEEL.law.nominal(np.sign(end) * strain) * factor(strain)}


@pytest.mark.parametrize("side", metals.SIDES)
def test_range_and_differences(side):
    """10 % too small up to 2 % but for 1 %, 2 % too large from there to 0.6 of the strains, 8 % beyond; what is below the yield strain does not count."""
    ends = metals.SIDES[side]
    last = 0.6 * abs(ends[-1])
    one = curve(lambda e: np.where(e < 0.02, np.where(np.abs(e - 0.01) < 1.1e-3, 1.0, 0.9), np.where(e < last, 1.02, 1.08)) * np.where(e < 0.004, 9.0, 1.0), ends[-1])
    (around, found), at = metals.far_cells(STEEL, one, side)[0].split(", "), list(metals.far_cells(STEEL, one, side)[1:])
    assert at == ["+2.0 %" if abs(end) <= last else "+8.0 %" for end in ends]
    assert all(abs(float(word) - 1.0) < 0.2 for word in around.split(" to "))
    begin, end = map(float, found.split(" to "))
    assert abs(begin - 2.0) < 0.15 and abs(end - 100.0 * last) < 0.15


def test_curve_that_ends_early():
    """The body did not come to rest beyond 10 %; nowhere near."""
    side = "tension"
    assert metals.far_cells(STEEL, curve(lambda e: 1.1, 0.1), side) == ("none", "+10.0 %", "+10.0 %", "at rest to 10.0 %")


@pytest.mark.parametrize("name", METALS)
def test_shipped_rows_are_of_these_targets(name):
    """The command in the comment of each row asks for the targets of the metal; the row has its density."""
    lines = (CHECKOUT / "potentials" / "metals.evp").read_text(encoding="utf-8").splitlines()
    aims = metals.targets_of(METALS[name])
    at = next(k for k, line in enumerate(lines) if line.startswith(f"{name} "))
    words = lines[at].split()
    assert float(words[words.index("density") + 1]) == METALS[name].density
    assert " ".join(metals.words_of(aims)) in lines[at - 1]
    assert lines[0].startswith("# UNITS: si ") and "/" not in lines[at - 1].split("by: ")[1]
