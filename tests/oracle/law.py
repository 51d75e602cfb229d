# SPDX-License-Identifier: GPL-2.0-only
"""Energies, stiffness, damping and cutoffs of the law of tools/evp/law.py, whose names are here, too: what the plugin is compared with.

Written from the paper's equations; it shares no expression with src/core/law/law.h.
"""

import numpy as np

from evp.law import TABLE1, TABLE2, Row, force, log_stretch, potential_force  # noqa: F401


def regime(d, deq, row):
    """1 or 2, the regime of eq. 8 in force at d (int array)."""
    return np.where(np.abs(np.asarray(d, dtype=float) - deq) / deq <= row.xi_s, 1, 2)


def by_regime(d, deq, row, first, second):
    """first(d) in regime I, second(d, ds) in regime II, ds of eq. 8 on the side where d lies [length]; each is evaluated where it holds."""
    d, deq = np.broadcast_arrays(np.asarray(d, dtype=float), np.asarray(deq, dtype=float))
    is_first = regime(d, deq, row) == 1
    ds = np.where(d >= deq, 1 + row.xi_s, 1 - row.xi_s) * deq
    value_first = first(np.where(is_first, d, deq))
    return np.where(is_first, value_first, second(np.where(is_first, ds, d), ds))


def potential(d, deq, e, m, n):
    """Phi_{e,m,n}(d) of eq. 2 [energy]; -e at d = deq, zero at infinity."""
    log_s = log_stretch(d, deq)
    return e * (n * np.exp(m * log_s) - m * np.exp(n * log_s)) / (m - n)


def potential_stiffness(d, deq, e, m, n):
    """-dF_{e,m,n}/dd [energy/length^2] (paper 2.4, sign turned): m n e/deq^2 at d = deq."""
    log_s = log_stretch(d, deq)
    steep, flat = (m + 1) * np.exp((m + 2) * log_s), (n + 1) * np.exp((n + 2) * log_s)
    return m * n * e / ((m - n) * deq**2) * (steep - flat)


def _energy(d, deq, row):
    """Integral of eq. 8: Phi_I in regime I, continued without a jump in regime II."""

    def first(x):
        return potential(x, deq, row.e1, row.m1, row.n1)

    def second(x, ds):
        gained = potential(x - ds + deq, deq, row.e2, row.m2, row.n2) + row.e2
        slope = potential_force(ds, deq, row.e1, row.m1, row.n1)
        return gained + first(ds) - slope * (x - ds)

    return by_regime(d, deq, row, first, second)


def energy(d, deq, row, cut):
    """Energy at d minus energy at the pair's own cut [energy]; no cut-off is applied here."""
    return _energy(d, deq, row) - _energy(cut, deq, row)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)  # on (-1, 1)


def _reduced_pull(log_d, e, m, n):
    """-F_{e,m,n} deq [energy] at log(d/deq)."""
    return -m * n * e / (m - n) * np.exp(-(n + 1) * log_d) * np.expm1(-(m - n) * log_d)


def _work_from_rest(xi, e, m, n):
    """Work against F_{e,m,n} from deq to (1 + xi) deq [energy].

    The integral of eq. 1 over log(d/deq), where the integrand keeps its sign: nothing cancels.
    """
    end = np.log1p(np.asarray(xi, dtype=float))[..., None]
    e, m, n = (np.asarray(value, dtype=float)[..., None] for value in (e, m, n))
    place = 0.5 * end * (1 + _NODES)
    pull = np.exp(place) * _reduced_pull(place, e, m, n)
    return np.sum(0.5 * end * _WEIGHTS * pull, axis=-1)


def stored(d, deq, row):
    """Energy above that at deq [energy], to the last digits: (held up to xi_s, held beyond)."""
    d, deq = np.broadcast_arrays(np.asarray(d, dtype=float), np.asarray(deq, dtype=float))
    xi = (d - deq) / deq
    inside = np.clip(xi, -row.xi_s, row.xi_s)
    first = _work_from_rest(inside, row.e1, row.m1, row.n1)
    beyond = np.where(xi == inside, 0.0, xi - inside)
    pull = _reduced_pull(np.log1p(inside), row.e1, row.m1, row.n1)
    return first, _work_from_rest(beyond, row.e2, row.m2, row.n2) + pull * beyond


def stiffness(d, deq, row):
    """-dF/dd [energy/length^2]; it jumps at the threshold, where regime I's is given."""

    def first(x):
        return potential_stiffness(x, deq, row.e1, row.m1, row.n1)

    def second(x, ds):
        return potential_stiffness(x - ds + deq, deq, row.e2, row.m2, row.n2)

    return by_regime(d, deq, row, first, second)


def stiffness_at_rest(deq, row):
    """m1 n1 e1/deq^2 [energy/length^2]."""
    return row.m1 * row.n1 * row.e1 / np.asarray(deq, dtype=float) ** 2


def largest_stiffness(contact_distance, row):
    """Kmax of eq. 6 [energy/length^2]: |K_I| at 0.7 (R_i + R_j), deq = R_i + R_j."""
    return np.abs(potential_stiffness(0.7 * np.asarray(contact_distance, dtype=float), contact_distance, row.e1, row.m1, row.n1))


def damping_force(unit, v_i, v_j, row):
    """Force of eq. 4 on i [force], shape (..., 3); unit points from j to i."""
    closing = np.sum(unit * (v_i - v_j), axis=-1, keepdims=True)
    return -np.asarray(row.gamma)[..., None] * closing * unit


def pair_cut(contact_distance, bonded, row, contact):
    """Distance beyond which the pair does nothing [length]; 0 for pairs that never interact.

    contact_distance: R_i + R_j; bonded: bool array; contact: literal, repulsive or none.
    """
    dlim = row.alpha * contact_distance
    unbonded = {"literal": dlim, "repulsive": contact_distance, "none": 0.0 * dlim}[contact]
    return np.where(bonded, dlim, unbonded)
