# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/metals.py: departures of known curves, and that the page, the rows and the targets that are shipped belong together."""

import metals
import numpy as np
import pytest
from metals import METALS
from evp.run import CHECKOUT

STEEL = METALS["steel_4340"]


def curve(factor, sign=1.0):
    strain = np.linspace(0.0, 0.1, 101)
    return {"strain": list(strain), "stress": list(STEEL.law.nominal(sign * strain) * factor(strain))}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_largest_departure(sign):
    """2 % at 3 % of strain, 4 % at 8 %; what is below the yield strain does not count."""
    one = curve(lambda e: 1.0 + 0.02 * (np.abs(e - 0.03) < 1e-9) - 0.04 * (np.abs(e - 0.08) < 1e-9) + 0.5 * (e < 0.004), sign)
    assert metals.largest(STEEL, one, sign * 0.05) == "+2.0 % at 3.0 %"
    assert metals.largest(STEEL, one, sign * 0.1) == "-4.0 % at 8.0 %"


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
