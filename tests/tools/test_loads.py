# SPDX-License-Identifier: GPL-2.0-only
"""evp.loads: closed forms against integrals, shares of bonds whose places are known; strains of the middle of a body."""

import math

import numpy as np
import pytest
import loads
from evp import specimen

RADIUS, HEIGHT = 0.02, 0.02


def test_torque_is_the_integral_of_the_shear_stress():
    r = (np.arange(2000) + 0.5) * RADIUS / 2000
    integral = np.sum(0.4 * 21e9 * r * 0.001 / 0.04 * r * 2.0 * math.pi * r) * RADIUS / 2000
    assert loads.torque(21e9, RADIUS, 0.04, 0.001) == pytest.approx(integral, rel=1e-6)


def test_deflection_is_the_integral_of_curvature_and_shear():
    beam = loads.Beam(21e9, 0.01, HEIGHT, 0.08)
    x = (np.arange(4000) + 0.5) * 0.04 / 4000  # half the span, force 1 N, unit-load theorem
    bending = 2.0 * np.sum((0.5 * x) ** 2) * 0.04 / 4000 / (21e9 * 0.01 * HEIGHT**3 / 12.0)
    shear = 2.0 * 0.5**2 * 0.04 / (loads.KAPPA * 0.4 * 21e9 * 0.01 * HEIGHT)
    assert beam.deflection(1.0) == pytest.approx(bending + shear, rel=1e-6)
    assert beam.deflection(3.0, 0.5) == pytest.approx(3.0 * (2.0 * bending + shear), rel=1e-6)
    assert loads.KAPPA == pytest.approx(0.847, abs=5e-4)


@pytest.mark.parametrize("filled", [1.0, 0.9])
def test_shares_of_isotropic_bonds_that_fill_the_section_up_to_below_the_surface(filled):
    rng = np.random.default_rng(1)
    n = rng.normal(size=(400000, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    angle, r = rng.uniform(0.0, 2.0 * math.pi, len(n)), filled * RADIUS * np.sqrt(rng.uniform(size=len(n)))
    round_bar = loads.Bonds(np.stack([0.0 * r, r * np.cos(angle), r * np.sin(angle)], axis=1), n)
    assert loads.torsion_share(round_bar, RADIUS) == pytest.approx(filled**2, rel=0.01)
    bar = loads.Bonds(rng.uniform(-0.5, 0.5, (len(n), 3)) * [0.1, 0.01, filled * HEIGHT], n)
    assert loads.bending_share(bar, HEIGHT) == pytest.approx(filled**2, rel=0.01)


def test_bonds_are_pairs_in_the_zone_with_their_middle_in_the_part():
    x = np.array([[0.0, 0.0, 0.0], [1.4, 0.0, 0.0], [3.0, 0.0, 0.0], [4.12, 0.0, 0.84]])
    body = specimen.Specimen(None, None, np.full(4, 0.5), None, x, None)
    found = loads.find_bonds(body, 1.5, 0.0, 5.0)
    assert found.middle == pytest.approx(np.array([[0.7, 0.0, 0.0], [3.56, 0.0, 0.42]]))
    assert found.direction == pytest.approx(np.array([[1.0, 0.0, 0.0], [0.8, 0.0, 0.6]]))
    assert len(loads.find_bonds(body, 1.5, 1.0, 5.0).middle) == 1


def test_middle_strains_of_an_affine_body():
    """Those of the displacement's slopes, whatever happens beyond 0.3 and 0.7 of the length."""
    x = np.random.default_rng(1).uniform(-0.02, 0.02, (400, 3)) + [0.025, 0.0, 0.0]
    body = specimen.Specimen(np.arange(1, 401), np.ones(400), np.ones(400), np.ones(400), x, np.zeros((3, 2)))
    moved = x * [1.01, 0.997, 0.999]
    moved[x[:, 0] > 0.036] += 0.01
    assert specimen.middle_strains(body, moved) == pytest.approx((0.01, -0.002), rel=1e-10)
