# SPDX-License-Identifier: GPL-2.0-only
"""Plasticity of pairs (`plasticity isotropic`): two values per pair, q [length] and k, for numpy arrays.

q is the plastic part of a pair's distance, k = sum |dq|/deq its accumulated plastic strain; eps = (d - q)/deq - 1 is the
elastic strain. It never leaves the limit y(k), what is beyond becomes flow (the return map, exact for any increment):

    r = m2 n2 e2/(m1 n1 e1),   h = r/(1 - r),   y(k) = xi_s + h K(k),   K(k) = k, or k_s (1 - exp(-k/k_s))   k_s: `saturation`
    F = F_I(d - q),   Psi = Phi_I(d - q) - Phi_I(deq),   D = integral of |F_I((1 +- y(k)) deq)| deq dk

Part of the second writing of the law, as law.py: it shares no expression with src/core. Distances, deq, q, k and saturation
(0: linear) may have any shapes that broadcast.
"""

from typing import NamedTuple

import numpy as np

from . import law

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)  # on (-1, 1)


class Step(NamedTuple):
    """What an evaluation at d gives: q [length] and k after the return map, force [positive repels], energy dissipated on the way."""

    q: np.ndarray
    k: np.ndarray
    force: np.ndarray
    dissipated: np.ndarray


def hardening(row):
    """h of the limit, from r, the ratio of the two stiffnesses at rest. ValueError where r >= 1."""
    ratio = row.m2 * row.n2 * np.asarray(row.e2, dtype=float) / (row.m1 * row.n1 * row.e1)
    if np.any(ratio >= 1.0):
        raise ValueError("plasticity isotropic needs m2 n2 e2 < m1 n1 e1: the second regime must be the softer one")
    return ratio / (1.0 - ratio)


def limit(k, row, saturation=0.0):
    """(y, dy/dk): the largest elastic strain of a pair that has flowed by k, and its slope."""
    k, saturation = np.broadcast_arrays(np.asarray(k, dtype=float), np.asarray(saturation, dtype=float))
    scale = np.where(saturation > 0.0, saturation, 1.0)
    grown = np.where(saturation > 0.0, -scale * np.expm1(-k / scale), k)
    slope = np.where(saturation > 0.0, np.exp(-k / scale), 1.0)
    h = hardening(row)
    return row.xi_s + h * grown, h * slope


def _increment(strain, row, k, saturation):
    """Plastic strain that brings |elastic strain| to the limit: Newton, from below, on a function that is convex."""
    y, slope = limit(k, row, saturation)
    found = np.maximum(strain - y, 0.0) / (1.0 + slope)
    for _ in range(100):
        y, slope = limit(k + found, row, saturation)
        more = np.where(found > 0.0, (strain - found - y) / (1.0 + slope), 0.0)
        found = found + more
        if np.all(np.abs(more) <= 1e-16 * (1.0 + found)):
            break
    return found


def return_map(d, deq, row, q, k, saturation=0.0):
    """(q, k) after d was reached; as they were where the elastic strain is within the limit."""
    strain = (np.asarray(d, dtype=float) - q - deq) / deq
    increment = _increment(np.abs(strain), row, k, saturation)
    return q + np.sign(strain) * increment * deq, k + increment


def elastic_force(d, deq, row, q):
    """F [energy/length] with q as it is."""
    return law.potential_force(d - q, deq, row.e1, row.m1, row.n1)


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
    force = np.abs(law.potential_force((1.0 + np.sign(travel) * y) * deq, deq, row.e1, row.m1, row.n1))
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


def work_since(d, deq, row, q, k, saturation=0.0):
    """Psi + D at d for bonds that had q and k [energy]: its slope is -F, so that a line search is consistent."""
    now = step(d, deq, row, q, k, saturation)
    return stored(d, deq, row, now.q) + now.dissipated
