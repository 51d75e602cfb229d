# SPDX-License-Identifier: GPL-2.0-only
"""The volume energy of fix evp/volume: one energy per atom by the density of its neighbors, for numpy arrays.

    rho_i = sum_j t_ij^2,  t = 1 - d/dlim;  theta_i = (rho0_i - rho_i)/G_i,  G_i = 1/3 sum_j 2 t d/dlim;  U = sum_i kv_i u(theta_i)

rho0 and G are those of the recorded bonds at rest, rho that of all pairs now, bonds b and fresh ones f. Expanded, u = theta^2/2 up to
`cavitation`, from where its slope falls to 0 at twice that. Compressed, fresh pairs fill the gap to the mean density of the interior without
force: with y+ = max(y, 0), u = ((b - rho0)+^2 + (rho - rho0 - gap)+^2 - (b - rho0 - gap)+^2)/(2 G^2), theta^2/2 where no pair is fresh. theta
of a body that is stretched uniformly is the trace of its strain. Bonds that break are fresh pairs from then on: torn() gives the rest after
that, by which the strain of the bonds and the energy stay; there fresh pairs only push, and so do pairs of two bodies. Part of the second writing, as law.py.

What is taken over from bonds that yield under pressure, of a row with `yield`: 1/2 bulk [s - x0]+^2 is added, s = sqrt(2 u); expanded the added
pull grows from x0 to x0 + 0.006 alone, and goes to 0 between `cavitation` and twice that.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from .brute import sums


class Volume(NamedTuple):
    """theta, energy (N,); force (N,3); pair_force (P,), positive repels; virial (3,3) sum of r_a F_b over the pairs."""

    theta: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    pair_force: np.ndarray
    virial: np.ndarray


class Rest(NamedTuple):
    """rho0, G and the gap (N,) of the bonds at rest."""

    rho: np.ndarray
    slope: np.ndarray
    gap: np.ndarray
    torn: np.ndarray  # have bonds broken?
    lost: np.ndarray  # (N,) what these have added to the gap of fresh pairs


def _both(i, j, of_pair, count):
    return np.bincount(i, of_pair, count) + np.bincount(j, of_pair, count)


def at_rest(i, j, deq, dlim, count, types=None):
    """Rest of bonds (i, j) (P,) 0-based with deq, dlim (P,) [length]; types (N,): each has an interior of its own."""
    t = np.maximum(0.0, 1.0 - np.asarray(deq, dtype=float) / dlim)
    rho, slope = _both(i, j, t * t, count), _both(i, j, 2.0 / 3.0 * t * deq / dlim, count)
    gap = np.zeros(count)
    types = np.zeros(count) if types is None else types
    for kind in np.unique(types[slope > 0.0]):
        deep = own = (types == kind) & (slope > 0.0)
        for _ in range(5):
            mean = rho[deep].mean(), slope[deep].mean()
            deep = own & (slope >= 0.85 * mean[1])
        gap[own] = np.maximum(0.0, mean[0] - rho[own])
    return Rest(rho, slope, gap, np.zeros(count, dtype=bool), np.zeros(count))


def evaluate(x, i, j, dlim, kv, rest, cavitation=0.15, fresh=False, taken=(0.0, 0.0), tension=1.0, across=False):
    """Volume of the pairs (i, j) (P,) at positions x (N,3) [length], all that may come within their dlim (P,) [length].

    kv: a number or (N,) [energy]; cavitation: inf for none; fresh (P,): pairs that were not recorded; across (P,): those of two bodies; taken: bulk [energy] and x0;
    tension (N,): share of what an expansion stores, and so of its pull, that is left.
    """
    x = np.asarray(x, dtype=float)
    count = len(x)
    r = x[i] - x[j]
    d = np.sqrt(np.sum(r * r, axis=1))
    t = np.maximum(0.0, 1.0 - d / dlim)
    rho, bonded, inside = (_both(i, j, np.where(out, 0.0, t * t), count) for out in (False, fresh, across))
    share = np.divide(1.0, rest.slope, out=np.zeros(count), where=rest.slope > 0.0)
    theta, own, gap = (rest.rho - np.where(rest.torn, bonded, inside)) * share, np.maximum(0.0, (bonded - rest.rho) * share), rest.gap * share
    beyond, counted = np.maximum(0.0, (rho - rest.rho) * share - gap), np.maximum(0.0, own - gap + rest.lost * share)
    end, (bulk, x0) = min(cavitation, 1e9), taken
    # expanded: energy and pull, over kv; what is taken over, over bulk
    left = np.maximum(0.0, 2.0 * end - theta)
    u = np.where(theta > end, end**2 - 0.5 * left**2, 0.5 * theta**2)
    pull = np.where(theta > end, left, theta)
    most = min(end - x0, 0.006)
    grown, first = np.clip(theta, x0, end) - x0, np.clip(theta - x0, 0.0, 0.006)
    part = np.clip(theta / end - 1.0, 0.0, 1.0)
    more = np.minimum(first, most) * np.clip(2.0 - theta / end, 0.0, 1.0)
    held = first * (grown - 0.5 * first) + most * end * (part - 0.5 * part**2)
    u, pull, held, more = (np.where(theta > 0.0, tension * one, 0.0) for one in (u, pull, held, more))
    # squeezed
    is_squeezed = (theta < 0.0) | rest.torn | (rho > inside)
    squared = np.where(is_squeezed, own**2 + beyond**2 - counted**2, 0.0)
    push = np.where(is_squeezed, [counted - own - beyond, -beyond, -beyond], 0.0)  # of bonds, fresh pairs and those of two bodies
    y = np.sqrt(np.maximum(0.0, squared))
    beyond_x0 = np.maximum(0.0, y - x0)
    push = push * (kv + bulk * beyond_x0 / np.where(y > 0.0, y, 1.0))
    energy = kv * (u + 0.5 * squared) + bulk * (held + 0.5 * beyond_x0**2)
    pull = kv * pull + bulk * more
    g = (push + [pull, np.where(rest.torn, 0.0, pull), np.zeros(count)]) * share
    g = np.where(across, g[2][i] + g[2][j], np.where(fresh, g[1][i] + g[1][j], g[0][i] + g[0][j]))
    pair_force = -g * 2.0 * t / dlim
    f = (pair_force / d)[:, None] * r
    return Volume(theta, energy, sums(i, f, count) - sums(j, f, count), pair_force, r.T @ f)


def torn(x, i, j, dlim, rest, fresh, broken):
    """The Rest of the pairs (i, j) as in evaluate() after those that are `broken` (P,) have broken at x."""
    count = len(x)
    t = np.maximum(0.0, 1.0 - np.linalg.norm(x[i] - x[j], axis=1) / dlim)
    density, bonded = _both(i, j, t * t, count), _both(i, j, np.where(fresh, 0.0, t * t), count)
    still = bonded - _both(i, j, np.where(broken, t * t, 0.0), count)
    short_of = rest.rho - bonded  # of the bonds, and below of what counts now
    now = np.where(rest.torn | (rest.rho < density), np.where(rest.torn, short_of, np.minimum(0.0, short_of)), rest.rho - density)
    touched = _both(i, j, broken * 1.0, count) > 0.0
    rho = np.where(touched, still + now, rest.rho)
    return Rest(rho, rest.slope, rest.gap + rest.rho - rho, rest.torn | touched, rest.lost + rest.rho - rho)


Moduli = namedtuple("Moduli", "bulk shear young poisson")  # of an isotropic body: [energy/volume], Poisson's ratio


def moduli(network_modulus, kv, number_density):
    """Moduli of a network of modulus E0 [energy/volume], whose Poisson's ratio is 1/4, with the volume energy of N/V atoms."""
    bulk, shear = network_modulus / 1.5 + kv * number_density, 0.4 * network_modulus
    young = 9.0 * bulk * shear / (3.0 * bulk + shear)
    return Moduli(bulk, shear, young, (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear)))
