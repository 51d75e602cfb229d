# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/notched_tension.py: work read off a known curve, the exponent of a known law."""

import notched_tension
import numpy as np
import pytest
from evp.curves import Curve
from evp.run import RunError
from notched_tension import CONSTANT, INVERSE, POWER

FEW, MORE = 4000, 16000


def curve(strain, stress):
    return Curve(strain, stress, stress)


def test_work_of_a_triangle():
    """Up to 200 MPa at 2 %, down to zero at 6 %: a tenth of the stress is left at 5.6 %."""
    strain = np.linspace(0.0, 0.08, 801)
    found = notched_tension.rupture_of(curve(strain, 200e6 * np.interp(strain, (0.0, 0.02, 0.06), (0.0, 1.0, 0.0))), 12)
    assert found.peak == pytest.approx(200.0) and found.at == pytest.approx(0.02) and found.strain == pytest.approx(0.056, abs=1.01e-4) and found.broken == 12
    assert found.work == pytest.approx((0.5 * 200e6 * 0.02 + 0.5 * (200e6 + 20e6) * 0.036) * 0.04 / 1e3, rel=5e-3)


def test_a_body_that_holds_has_no_work_of_rupture():
    strain = np.linspace(0.0, 0.08, 81)
    with pytest.raises(RunError, match="has not parted at a strain of 0.08"):
        notched_tension.rupture_of(curve(strain, 200e6 * np.interp(strain, (0.0, 0.02, 0.08), (0.0, 1.0, 0.2))), 12)


def test_spacing():
    assert notched_tension.spacing(FEW) == pytest.approx(1.349, abs=1e-3)
    assert notched_tension.spacing(FEW) / notched_tension.spacing(8 * FEW) == pytest.approx(2.0)


def test_exponent_of_a_known_law():
    """Work as spacing^0.5 XI^1.5, which XI ~ spacing^-(1/3) keeps; the table has a row for each case."""
    def bars(n, xi):
        return [(notched_tension.Rupture(200.0, 0.01, 0.02, scale * notched_tension.spacing(n) ** 0.5 * xi**1.5, 12), None) for scale in (995.0, 1005.0)]

    scaled = 0.05 * notched_tension.spacing(FEW) / notched_tension.spacing(MORE)
    results = {(n, xi, rule): bars(n, xi) for n, xi, rule in ((FEW, 0.05, CONSTANT), (MORE, 0.05, CONSTANT), (MORE, scaled, INVERSE))}
    p = notched_tension.exponent_of(results, FEW, MORE)
    assert p == pytest.approx(1.0 / 3.0, rel=1e-6)
    kept = 0.05 * (notched_tension.spacing(FEW) / notched_tension.spacing(MORE)) ** p
    values = notched_tension.page({**results, (MORE, kept, POWER): bars(MORE, kept)}, p, [FEW, MORE])
    assert [row[:2] + (row[4],) for row in values["table"][1]] == [(FEW, 2, CONSTANT), (MORE, 2, CONSTANT), (MORE, 2, INVERSE), (MORE, 2, POWER)]
    assert values["kept"] == values["works"].split(", ")[0] and values["p"] == "0.33"
