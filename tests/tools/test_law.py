# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/law.py and tests/oracle/law.py, with which the LAMMPS tests compare, against 60-digit arithmetic; and which rows tools refuse."""

import numpy as np
import pytest
from evp.run import CHECKOUT
from oracle import flow, law

DATA = CHECKOUT / "tests" / "data"
REFERENCE = 1e-12  # see tests/unit/test_law.cpp: the same scale, the same reason


def read(name):
    """A 60-digit table as a dict of columns, and the row of each line."""
    columns = np.genfromtxt(DATA / name, delimiter=",", names=True)
    assert len(columns) > 1000
    return columns, law.Row(*(columns[name] for name in law.Row._fields[:7]), np.zeros(len(columns)), np.full(len(columns), 1.5))


def largest_error(found, true, least):
    return np.max(np.abs(found - true) / np.maximum(np.abs(true), least))


def test_force_energy_and_stiffness_hold_to_twelve_digits():
    """scale: the steeper stiffness at rest times deq^2 [energy], what round-off is measured with."""
    ref, row = read("law_reference.csv")
    d, deq, scale = ref["d"], ref["deq"], np.maximum(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2)
    assert largest_error(law.force(d, deq, row), ref["force"], scale * row.xi_s / deq) < REFERENCE
    energy = law.energy(d, deq, row, ref["dcut"])
    assert largest_error(energy, ref["energy"], scale * row.xi_s) < REFERENCE
    decided = ref["regime"] > 0
    assert np.array_equal(law.regime(d, deq, row)[decided], ref["regime"][decided])
    slope, true, least = (values[decided] for values in (law.stiffness(d, deq, row), ref["stiffness"], scale / deq**2))
    assert largest_error(slope, true, least) < REFERENCE


@pytest.mark.parametrize("words, rule", [
    ("80 4 8 3 8 4 0.005 0 1.5", "m > n > 0"), ("80 4.0003 4 3 8 4 0.005 0 1.5", "m must exceed n by at least"),
    ("80 8 4 3 0.0009 0.00085 0.005 0 1.5", "m must exceed n by at least"), ("-80 8 4 3 8 4 0.005 0 1.5", "zero or positive"),
    ("80 8 4 3 8 4 0 0 1.5", "xi_s"), ("80 8 4 3 8 4 0.005 0 1", "alpha"), ("80 8 4 3 8 4 nan 0 1.5", "finite"), ("80 8 4 3 8 4 0.005 0", "got 8")])
def test_bad_rows_are_refused_with_their_rule(words, rule):
    """Exponents may come as close as the rule says."""
    with pytest.raises(ValueError, match=rule):
        law.Row.parse(words)
    assert law.Row.parse("80 4.0005 4 3 0.0011 0.0009 0.005 0 1.5").m1 == 4.0005


def test_stored_energy_holds_at_any_strain():
    """Against 60 digits, down to strains of the last bit of d; the parts are those of src/core/law.h too."""
    ref, row = read("stored_reference.csv")
    first, second = law.stored(ref["d"], ref["deq"], row)
    total = ref["first"] + ref["second"]
    assert np.sum((np.abs(ref["d"] / ref["deq"] - 1) < 2e-10) & (total > 0)) > 100
    assert np.all(np.abs(first - ref["first"]) <= REFERENCE * ref["first"])
    # numpy has no fused multiply-add: near the threshold, xi - xi_s is rounded to the last bit of xi_s
    rounded = np.abs(law.force(ref["d"], ref["deq"], row)) * ref["deq"] * 3e-16 * row.xi_s
    assert np.all(np.abs(second - ref["second"]) <= REFERENCE * total + rounded)


def test_a_second_regime_that_is_not_softer_does_not_flow():
    with pytest.raises(ValueError, match="softer"):
        flow.hardening(law.TABLE1._replace(e2=80.0))
    assert law.force(1.5, 1.0, law.TABLE1) / law.force(1.005, 1.0, law.TABLE1) == pytest.approx(1.21, abs=0.01), "of the yield force: the pull of a new pair"
