# SPDX-License-Identifier: GPL-2.0-only
"""Last positions of a dump, and the strains of the middle of a body by them."""

import numpy as np
import pytest
from evp import dump, specimen


def test_positions_are_sorted_by_id(tmp_path):
    head = "ITEM: TIMESTEP\n9\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ss ss ss\n0 9\n0 9\n0 9\n"
    (tmp_path / "state.dump").write_text(head + "ITEM: ATOMS id x y z radius\n2 4 5 6 1\n1 1 2 3 1\n", encoding="utf-8")
    assert dump.last_positions(tmp_path / "state.dump").tolist() == [[1, 2, 3], [4, 5, 6]]


def test_middle_strains_of_an_affine_body():
    """Those of the displacement's slopes, whatever happens beyond 0.3 and 0.7 of the length."""
    x = np.random.default_rng(1).uniform(-0.02, 0.02, (400, 3)) + [0.025, 0.0, 0.0]
    body = specimen.Specimen(np.arange(1, 401), np.ones(400), np.ones(400), np.ones(400), x, np.zeros((3, 2)))
    moved = x * [1.01, 0.997, 0.999]
    moved[x[:, 0] > 0.036] += 0.01
    assert specimen.middle_strains(body, moved) == pytest.approx((0.01, -0.002), rel=1e-10)
