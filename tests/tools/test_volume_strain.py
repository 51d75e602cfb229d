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


def test_one_pair_by_hand():
    """w cancels: theta = 3 (d/deq - 1) on both atoms, U = 9 kv (d/deq - 1)^2 in all."""
    deq, kv, strain = 0.01, 1000.0, 0.02
    x = np.array([[0.0, 0.0, 0.0], [deq * (1 + strain), 0.0, 0.0]])
    one = np.array([0]), np.array([1]), np.array([deq]), np.array([0.015])
    found = volume.evaluate(x, *one, kv)
    assert found.theta == pytest.approx([3 * strain] * 2, rel=1e-13)
    assert found.energy.sum() == pytest.approx(9 * kv * strain**2, rel=1e-13)
    assert found.force[1] == pytest.approx([-18 * kv * strain / deq, 0.0, 0.0], rel=1e-13)
    beyond = volume.evaluate(x * 1.5, *one, kv)
    assert not beyond.theta.any() and not beyond.force.any()


def test_tetrahedron_by_hand():
    """Four atoms, all edges deq: swollen by s each theta is 3 s, and an edge's force -18 w kv 3 s/(W deq), W = 3 w."""
    deq, dlim, kv, s = 0.01, 0.015, 500.0, 0.01
    corners = deq / np.sqrt(8.0) * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    i, j = np.array(list(itertools.combinations(range(4), 2))).T
    found = volume.evaluate((1 + s) * corners, i, j, np.full(6, deq), np.full(6, dlim), kv)
    assert found.theta == pytest.approx([3 * s] * 4, rel=1e-12)
    assert found.energy.sum() == pytest.approx(18 * kv * s**2, rel=1e-12)
    assert found.pair_force == pytest.approx([-6 * kv * s / deq] * 6, rel=1e-12)


def test_uniform_strain_without_shape_change_is_its_trace():
    """Whatever the neighbors: shrinking by s gives -3 s."""
    x, i, j, deq, dlim = cloud()
    has_pairs = np.bincount(np.concatenate([i, j]), minlength=len(x)) > 0
    theta = volume.evaluate(0.997 * x, i, j, deq, dlim, 1.0).theta
    assert theta[has_pairs] == pytest.approx(-0.009, rel=1e-10) and not theta[~has_pairs].any()


def test_affine_strain_of_isotropic_neighbors_is_its_trace():
    """The mean of u u over the six axes of an icosahedron is 1/3 exactly: theta is tr(strain), to first order."""
    golden = (1 + 5**0.5) / 2
    around = np.array([[0, s, t * golden] for s in (-1, 1) for t in (-1, 1)])
    around = np.concatenate([np.roll(around, k, axis=1) for k in range(3)]) / np.hypot(1, golden)
    x = np.concatenate([np.zeros((1, 3)), 0.01 * around])
    i, j = np.zeros(12, dtype=int), np.arange(1, 13)
    strain = 1e-6 * np.array([[3.0, 1.0, -2.0], [1.0, -1.0, 0.5], [-2.0, 0.5, 0.7]])
    found = volume.evaluate(x + x @ strain, i, j, np.full(12, 0.01), np.full(12, 0.015), 1.0)
    assert found.theta[0] == pytest.approx(np.trace(strain), rel=1e-5)


@pytest.mark.parametrize("per_atom", [False, True])
def test_force_is_minus_the_slope_of_the_energy(per_atom):
    x, i, j, deq, dlim = cloud(3)
    kv = np.random.default_rng(5).uniform(100.0, 2000.0, len(x)) if per_atom else 1000.0
    x = x + np.random.default_rng(4).normal(0.0, 2e-4, x.shape)
    lost = np.arange(len(i)) % 7 == 0
    now = volume.evaluate(x, i, j, deq, dlim, kv, lost)
    step, largest = 1e-8, np.abs(now.force).max()
    assert not np.array_equal(now.force, volume.evaluate(x, i, j, deq, dlim, kv).force), "control: lost pairs"
    for atom, axis in itertools.product((0, 7, 19, 33), range(3)):
        shift = np.zeros_like(x)
        shift[atom, axis] = step
        up, down = (volume.evaluate(x + s * shift, i, j, deq, dlim, kv, lost).energy.sum() for s in (1, -1))
        assert abs((up - down) / (2 * step) + now.force[atom, axis]) < 1e-7 * largest
    assert np.abs(now.force.sum(axis=0)).max() < 1e-12 * largest
    assert np.abs(np.cross(x, now.force).sum(axis=0)).max() < 1e-12 * largest * 0.04
    assert now.virial == pytest.approx(now.virial.T, abs=1e-10 * np.abs(now.virial).max())


def test_frame_independence():
    x, i, j, deq, dlim = cloud(6)
    moved = x + np.random.default_rng(7).normal(0.0, 2e-4, x.shape)
    now = volume.evaluate(moved, i, j, deq, dlim, 1000.0)
    turn = rotation(8)
    turned = volume.evaluate(moved @ turn.T + [0.3, -0.1, 0.2], i, j, deq, dlim, 1000.0)
    assert turned.theta == pytest.approx(now.theta, abs=1e-12)
    assert turned.force == pytest.approx(now.force @ turn.T, abs=1e-10 * np.abs(now.force).max())


def test_lost_pair_leaves_the_sum_but_not_the_weight():
    """Three atoms in line: the middle one, with half of its weight lost, sees half."""
    deq, strain = 0.01, 0.01
    x = np.array([[-1.0, 0, 0], [0, 0, 0], [1.0, 0, 0]]) * deq * (1 + strain)
    pairs = np.array([0, 1]), np.array([1, 2]), np.full(2, deq), np.full(2, 0.015)
    theta = volume.evaluate(x, *pairs, 1.0, lost=np.array([False, True])).theta
    assert theta == pytest.approx([3 * strain, 1.5 * strain, 0.0], rel=1e-12)


def test_weights_by_hand():
    """Bonds of 1 and 1.2 with dlim 1.5 and 1.6, the first stretched by s: the atom between sees 3 s w1/(w1 + w2)."""
    s, w1, w2 = 0.01, 1 - 1 / 2.25, 1 - 1.44 / 2.56
    x = np.array([[-(1 + s), 0, 0], [0, 0, 0], [1.2, 0, 0]])
    pairs = np.array([0, 1]), np.array([1, 2]), np.array([1.0, 1.2]), np.array([1.5, 1.6])
    assert volume.evaluate(x, *pairs, 1.0).theta == pytest.approx([3 * s, 3 * s * w1 / (w1 + w2), 0.0], rel=1e-12)


def test_closed_form_of_the_moduli():
    """Without kv nu is 1/4 and E that of the network; more kv leaves G and tends to nu = 1/2."""
    alone = volume.moduli(21e9, 0.0, 8e6)
    assert alone.poisson == pytest.approx(0.25) and alone.young == pytest.approx(21e9)
    stiff = volume.moduli(21e9, 1e9, 8e6)
    assert stiff.shear == alone.shear and stiff.poisson == pytest.approx(0.5, abs=1e-5)
    # Table 1, 500 spheres in the paper's cylinder: 1000 J gives nu 1/3
    assert volume.moduli(20.65e9, 1000.0, 500 / (np.pi * 0.02**2 * 0.05)).poisson == pytest.approx(1 / 3, abs=0.01)
