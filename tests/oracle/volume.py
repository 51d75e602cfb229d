# SPDX-License-Identifier: GPL-2.0-only
"""The volume energy of fix evp/volume: one energy per atom over its recorded pairs, for numpy arrays.

    U = 1/2 sum_i kv_i theta_i^2,   theta_i = 3 sum_j w_ij (d_ij/deq_ij - 1) / W_i,   w_ij = 1 - (deq_ij/dlim_ij)^2

W_i is the sum of w_ij at recording; a pair that is lost (beyond dlim, or broken) leaves the sum above it, not W_i. theta of
a body that is stretched uniformly is the trace of its strain. Part of the second writing, as law.py.
"""

from typing import NamedTuple

import numpy as np


class Volume(NamedTuple):
    """theta, energy (N,); force (N,3); pair_force (P,), positive repels; virial (3,3) sum of r_a F_b over the pairs."""

    theta: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    pair_force: np.ndarray
    virial: np.ndarray


def weights(i, j, deq, dlim, count):
    """w of each recorded pair and W of each atom. i, j (P,) 0-based."""
    w = 1.0 - (np.asarray(deq, dtype=float) / dlim) ** 2
    total = np.bincount(i, w, count) + np.bincount(j, w, count)
    return w, total


def evaluate(x, i, j, deq, dlim, kv, lost=None):
    """Volume of the recorded pairs (i, j) at positions x (N,3) [length].

    deq, dlim (P,) [length]; kv: a number or (N,) [energy]; lost (P,) bool: broken pairs; those beyond dlim are found here.
    """
    x = np.asarray(x, dtype=float)
    count = len(x)
    r = x[i] - x[j]
    d = np.sqrt(np.sum(r * r, axis=1))
    w, total = weights(i, j, deq, dlim, count)
    acting = np.where((d > dlim) | (False if lost is None else lost), 0.0, w)
    opening = acting * (d / deq - 1.0)
    share = np.divide(3.0, total, out=np.zeros(count), where=total > 0.0)
    theta = share * (np.bincount(i, opening, count) + np.bincount(j, opening, count))
    g = kv * theta * share
    pair_force = -acting * (g[i] + g[j]) / deq
    f = (pair_force / d)[:, None] * r
    force = np.zeros_like(x)
    np.add.at(force, i, f)
    np.add.at(force, j, -f)
    return Volume(theta, 0.5 * kv * theta**2, force, pair_force, r.T @ f)


class Moduli(NamedTuple):
    """Of an isotropic body: bulk, shear and Young's modulus [energy/volume], Poisson's ratio."""

    bulk: float
    shear: float
    young: float
    poisson: float


def moduli(network_modulus, kv, number_density):
    """Moduli of a network of modulus E0 [energy/volume], whose Poisson's ratio is 1/4, with the volume energy of N/V atoms."""
    bulk, shear = network_modulus / 1.5 + kv * number_density, 0.4 * network_modulus
    young = 9.0 * bulk * shear / (3.0 * bulk + shear)
    return Moduli(bulk, shear, young, (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear)))
