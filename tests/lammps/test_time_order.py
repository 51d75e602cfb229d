# SPDX-License-Identifier: GPL-2.0-only
"""The order of accuracy in dt that the pages of the integrators state, by the tool that measures it."""

import numpy as np
import pytest
import time_order

ORDER = 0.06  # of an order at the dt used, measured: the next power of dt is still in it


@pytest.mark.parametrize("style, gamma, order", [("nve", 0.0, 2.0), ("nve", 100.0, 1.0), ("nve/evp", 100.0, 1.0)])
def test_damping_makes_time_integration_first_order(tmp_path, style, gamma, order):
    """Control: without damping it is of second order."""
    way = next(way for way in time_order.WAYS if way.style == style and way.gamma == gamma)
    differences, _ = time_order.measure(way._replace(steps=2 * way.steps), 2, tmp_path)
    assert np.log2(differences[0] / differences[1]) == pytest.approx([order, order], abs=ORDER)
