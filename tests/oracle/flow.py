# SPDX-License-Identifier: GPL-2.0-only
"""Energies and steps of pairs with `plasticity isotropic`, whose return map is in tools/evp/law.py: its names are here, too.

It shares no expression with src/core. Distances, deq, q, k and saturation (0: linear) may have any shapes that broadcast.
"""

from typing import NamedTuple

import numpy as np

from evp.law import elastic_force, hardening, limit, potential_force, return_map  # noqa: F401

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)  # on (-1, 1)


class Step(NamedTuple):
    """What an evaluation at d gives: q [length] and k after the return map, force [positive repels], energy dissipated on the way."""

    q: np.ndarray
    k: np.ndarray
    force: np.ndarray
    dissipated: np.ndarray


def stored(d, deq, row, q):
    """Psi [energy], zero at rest."""
    log_s = np.log1p((deq + q - np.asarray(d, dtype=float)) / (d - q))
    return row.e1 / (row.m1 - row.n1) * (row.n1 * np.expm1(row.m1 * log_s) - row.m1 * np.expm1(row.n1 * log_s))


def dissipated(q0, q1, deq, row, k0, saturation=0.0):
    """D [energy] of a flow from q0 to q1, which began with k0; by Gauss points in k, so that nothing cancels."""
    travel = (np.asarray(q1, dtype=float) - q0) / deq
    half = 0.5 * np.abs(travel)
    nodes, weights = (values.reshape(-1, *[1] * np.ndim(half + k0)) for values in (_NODES, _WEIGHTS))
    y = limit(k0 + half * (1.0 + nodes), row, saturation)[0]
    force = np.abs(potential_force((1.0 + np.sign(travel) * y) * deq, deq, row.e1, row.m1, row.n1))
    return np.sum(weights * force, axis=0) * half * deq


def step(d, deq, row, q, k, saturation=0.0):
    """The Step of bonds that had q and k in the last state of rest, or at the last timestep."""
    after, grown = return_map(d, deq, row, q, k, saturation)
    return Step(after, grown, elastic_force(d, deq, row, after), dissipated(q, after, deq, row, k, saturation))


def contact_step(d, deq, row, q, k, saturation=0.0):
    """The Step of pairs that met later, deq = R_i + R_j: they repel only, flow in compression only, and end beyond deq with q = k = 0."""
    acts = np.asarray(d) <= deq
    now = step(np.minimum(d, deq + q), deq, row, q, k, saturation)
    return Step(*(np.where(acts, value, 0.0) for value in now))


def contact_stored(d, deq, row, q):
    """Psi [energy] of pairs that met later."""
    return np.where(np.asarray(d) <= deq, stored(np.minimum(d, deq + q), deq, row, q), 0.0)
