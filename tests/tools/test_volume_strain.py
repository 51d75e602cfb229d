# SPDX-License-Identifier: GPL-2.0-only
"""tests/oracle/volume.py: the volume energy against closed forms."""

import itertools

import numpy as np
import pytest
from oracle import brute, volume


def cloud(seed=1, count=40):
    """Positions, recorded pairs (i, j), deq and dlim of spheres at random."""
    random = np.random.default_rng(seed)
    x = random.uniform(0.0, 0.04, (count, 3))
    radius = random.uniform(0.0045, 0.0055, count)
    pairs = brute.find_pairs(x, radius, 1.5)
    return x, pairs.i, pairs.j, pairs.d, 1.5 * pairs.contact_distance


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


DEQ, DLIM = 0.01, 0.015


def around(points, dlim=DLIM):
    """The pairs of the first point with all others, and their densities at rest at this place."""
    i, j = np.zeros(len(points) - 1, dtype=int), np.arange(1, len(points))
    return i, j, volume.at_rest(i, j, np.linalg.norm(points[i] - points[j], axis=1), np.full(len(i), dlim), len(points))


def test_one_pair_by_hand():
    """rho = t^2, G = 2/3 t deq/dlim with t = 1/3: theta is 3 s - 3 s^2 for a strain s."""
    kv, strain = 1000.0, 0.02
    x = np.array([[0.0, 0.0, 0.0], [DEQ * (1 + strain), 0.0, 0.0]])
    i, j, dlim = np.array([0]), np.array([1]), np.array([DLIM])
    rest = volume.at_rest(i, j, np.array([DEQ]), dlim, 2)
    found = volume.evaluate(x, i, j, dlim, kv, rest)
    theta, t = 3 * strain - 3 * strain**2, 1 - DEQ * (1 + strain) / DLIM
    assert found.theta == pytest.approx([theta] * 2, rel=1e-12)
    assert found.energy.sum() == pytest.approx(kv * theta**2, rel=1e-12)
    assert found.force[1] == pytest.approx([-2 * kv * theta / (4 / 27) * 2 * t / DLIM, 0.0, 0.0], rel=1e-12)
    beyond = volume.evaluate(x * 1.5, i, j, dlim, kv, rest)
    assert beyond.theta == pytest.approx([0.75] * 2) and not beyond.force.any(), "torn"
    assert beyond.energy == pytest.approx([kv * 0.15**2] * 2, rel=1e-12)


def test_uniform_strain_without_shape_change_is_its_trace():
    """Whatever the neighbors: shrinking by s gives -3 s, to first order."""
    x, i, j, deq, dlim = cloud()
    rest = volume.at_rest(i, j, deq, dlim, len(x))
    has_pairs = rest.slope > 0.0
    theta = volume.evaluate((1 - 1e-8) * x, i, j, dlim, 1.0, rest).theta
    assert theta[has_pairs] == pytest.approx(-3e-8, rel=1e-5) and not theta[~has_pairs].any()


def test_affine_strain_of_isotropic_neighbors_is_its_trace():
    """The mean of u u over the six axes of an icosahedron is 1/3 exactly: theta is tr(strain), to first order."""
    golden = (1 + 5**0.5) / 2
    axes = np.array([[0, s, t * golden] for s in (-1, 1) for t in (-1, 1)])
    axes = np.concatenate([np.roll(axes, k, axis=1) for k in range(3)]) / np.hypot(1, golden)
    x = np.concatenate([np.zeros((1, 3)), DEQ * axes])
    i, j, rest = around(x)
    strain = 1e-6 * np.array([[3.0, 1.0, -2.0], [1.0, -1.0, 0.5], [-2.0, 0.5, 0.7]])
    found = volume.evaluate(x + x @ strain, i, j, np.full(12, DLIM), 1.0, rest)
    assert found.theta[0] == pytest.approx(np.trace(strain), rel=1e-5)


@pytest.mark.parametrize("per_atom", [False, True])
def test_force_is_minus_the_slope_of_the_energy(per_atom):
    x, i, j, deq, dlim = cloud(3)
    kv = np.random.default_rng(5).uniform(100.0, 2000.0, len(x)) if per_atom else 1000.0
    rest = volume.at_rest(i, j, deq, dlim, len(x))
    rest = rest._replace(rho=rest.rho * np.random.default_rng(4).uniform(0.7, 1.2, len(x)))
    fresh = np.arange(len(i)) % 4 == 0
    now = volume.evaluate(x, i, j, dlim, kv, rest, fresh=fresh)
    assert np.any(now.theta > 0.15) and np.any((now.theta < -0.05) & (rest.gap > 0.0)), "control: both ends of the law"
    step, largest = 1e-8, np.abs(now.force).max()
    for atom, axis in itertools.product((0, 7, 19, 33), range(3)):
        shift = np.zeros_like(x)
        shift[atom, axis] = step
        up, down = (volume.evaluate(x + s * shift, i, j, dlim, kv, rest, fresh=fresh).energy.sum() for s in (1, -1))
        assert abs((up - down) / (2 * step) + now.force[atom, axis]) < 1e-6 * largest
    assert np.abs(now.force.sum(axis=0)).max() < 1e-12 * largest
    assert np.abs(np.cross(x, now.force).sum(axis=0)).max() < 1e-12 * largest * 0.04
    assert now.virial == pytest.approx(now.virial.T, abs=1e-10 * np.abs(now.virial).max())


def test_frame_independence():
    x, i, j, deq, dlim = cloud(6)
    rest = volume.at_rest(i, j, deq, dlim, len(x))
    moved = x + np.random.default_rng(7).normal(0.0, 2e-4, x.shape)
    now = volume.evaluate(moved, i, j, dlim, 1000.0, rest)
    turn = rotation(8)
    turned = volume.evaluate(moved @ turn.T + [0.3, -0.1, 0.2], i, j, dlim, 1000.0, rest)
    assert turned.theta == pytest.approx(now.theta, abs=1e-12)
    assert turned.force == pytest.approx(now.force @ turn.T, abs=1e-10 * np.abs(now.force).max())


def test_closed_form_of_the_moduli():
    """Without kv nu is 1/4 and E that of the network; more kv leaves G and tends to nu = 1/2."""
    alone = volume.moduli(21e9, 0.0, 8e6)
    assert alone.poisson == pytest.approx(0.25) and alone.young == pytest.approx(21e9)
    stiff = volume.moduli(21e9, 1e9, 8e6)
    assert stiff.shear == alone.shear and stiff.poisson == pytest.approx(0.5, abs=1e-5)
    # Table 1, 500 spheres in the paper's cylinder: 1000 J gives nu 1/3
    assert volume.moduli(20.65e9, 1000.0, 500 / (np.pi * 0.02**2 * 0.05)).poisson == pytest.approx(1 / 3, abs=0.01)
