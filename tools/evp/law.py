# SPDX-License-Identifier: GPL-2.0-only
"""The two-regime Lennard-Jones law, written from the paper's equations for numpy arrays.

Source: M. Gado, J.-L. Charles, I. Iordanoff, D. Coupard, CSMA 2017, hal-01899324; equation numbers
are the paper's. This is the project's second writing of the law: it shares no expression with
src/core/law.h, so that a test which compares the two means something.

Distances d and deq may have any shapes that broadcast; units are those of the caller (the decks use
SI: m, J, N). A positive force repels. The fields of a Row may be arrays too, one entry per pair.
"""

from typing import NamedTuple

import numpy as np

CONTACT_MODES = ("literal", "repulsive", "none")


class Row(NamedTuple):
    """One row of the paper's Tables 1 and 2; floats, or arrays with one entry per pair."""

    e1: float  # first regime: depth of the potential [energy]
    m1: float  # exponents m1 > n1 > 0
    n1: float
    e2: float  # second regime
    m2: float
    n2: float
    xi_s: float  # strain of a pair at which the regimes meet, 0 < xi_s < 1
    gamma: float  # damping of eq. 4 [force/velocity]
    alpha: float  # dlim = alpha (R_i + R_j), alpha > 1

    @classmethod
    def parse(cls, text):
        """Row from 'e1 m1 n1 e2 m2 n2 xi_s gamma alpha'; ValueError names what is wrong."""
        words = text.split()
        if len(words) != len(cls._fields):
            raise ValueError(f"a row has the 9 numbers {' '.join(cls._fields)}, got {len(words)}")
        return cls(*(float(w) for w in words)).check()

    def check(self):
        """Return self, or raise ValueError with the rule that is broken."""
        if not np.all(np.isfinite(np.array(self, dtype=float))):
            raise ValueError("all 9 numbers of a row must be finite")
        if not (self.m1 > self.n1 > 0 and self.m2 > self.n2 > 0):
            raise ValueError("exponents must satisfy m > n > 0 in both regimes")
        for m, n in ((self.m1, self.n1), (self.m2, self.n2)):
            if m - n < 1e-4 * max(m, 1.0):
                raise ValueError("m must exceed n by at least 1e-4 and by 1e-4 of m")
        if min(self.e1, self.e2, self.gamma) < 0:
            raise ValueError("e1, e2 and gamma must be zero or positive")
        if not 0 < self.xi_s < 1:
            raise ValueError("xi_s must lie between 0 and 1")
        if not self.alpha > 1:
            raise ValueError("alpha must be greater than 1")
        return self


TABLE1 = Row(80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 0.0, 1.5)
TABLE2 = TABLE1._replace(gamma=1000.0)


def _log_stretch(d, deq):
    """log(deq/d) without loss of digits near d = deq, where the subtraction is exact."""
    return np.log1p((deq - d) / d)


def potential(d, deq, e, m, n):
    """Phi_{e,m,n}(d) of eq. 2 [energy]; -e at d = deq, zero at infinity."""
    log_s = _log_stretch(d, deq)
    return e * (n * np.exp(m * log_s) - m * np.exp(n * log_s)) / (m - n)


def potential_force(d, deq, e, m, n):
    """F_{e,m,n}(d) of eq. 1 [energy/length], by the one formula for both sides of deq."""
    log_s = _log_stretch(d, deq)
    return m * n * e / ((m - n) * deq) * np.exp((n + 1) * log_s) * np.expm1((m - n) * log_s)


def potential_stiffness(d, deq, e, m, n):
    """-dF_{e,m,n}/dd [energy/length^2] (paper 2.4, sign turned): m n e/deq^2 at d = deq."""
    log_s = _log_stretch(d, deq)
    steep, flat = (m + 1) * np.exp((m + 2) * log_s), (n + 1) * np.exp((n + 2) * log_s)
    return m * n * e / ((m - n) * deq**2) * (steep - flat)


def strain(d, deq):
    """xi = |d - deq|/deq of eq. 8."""
    return np.abs(np.asarray(d, dtype=float) - deq) / deq


def regime(d, deq, row):
    """1 or 2, the regime of eq. 8 in force at d (int array)."""
    return np.where(strain(d, deq) <= row.xi_s, 1, 2)


def threshold(d, deq, row):
    """ds of eq. 8 on the side where d lies [length]."""
    return np.where(np.asarray(d) >= deq, 1 + row.xi_s, 1 - row.xi_s) * deq


def _select(d, deq, row, first, second):
    """first(d) in regime I, second(d, ds) in regime II; each is evaluated where it holds."""
    d, deq = np.broadcast_arrays(np.asarray(d, dtype=float), np.asarray(deq, dtype=float))
    is_first = regime(d, deq, row) == 1
    ds = threshold(d, deq, row)
    value_first = first(np.where(is_first, d, deq))
    return np.where(is_first, value_first, second(np.where(is_first, ds, d), ds))


def force(d, deq, row):
    """Force of eq. 8 [energy/length], positive when repulsive; no cut-off is applied here."""

    def first(x):
        return potential_force(x, deq, row.e1, row.m1, row.n1)

    def second(x, ds):
        return potential_force(x - ds + deq, deq, row.e2, row.m2, row.n2) + first(ds)

    return _select(d, deq, row, first, second)


def _energy(d, deq, row):
    """Integral of eq. 8: Phi_I in regime I, continued without a jump in regime II."""

    def first(x):
        return potential(x, deq, row.e1, row.m1, row.n1)

    def second(x, ds):
        gained = potential(x - ds + deq, deq, row.e2, row.m2, row.n2) + row.e2
        slope = potential_force(ds, deq, row.e1, row.m1, row.n1)
        return gained + first(ds) - slope * (x - ds)

    return _select(d, deq, row, first, second)


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

    return _select(d, deq, row, first, second)


def stiffness_at_rest(deq, row):
    """m1 n1 e1/deq^2 [energy/length^2]."""
    return row.m1 * row.n1 * row.e1 / np.asarray(deq, dtype=float) ** 2


def largest_stiffness(contact_distance, row, overlap=0.3):
    """Kmax of eq. 6 [energy/length^2]: |K_I| at (1 - overlap)(R_i + R_j), deq = R_i + R_j."""
    shortest = (1 - overlap) * np.asarray(contact_distance, dtype=float)
    return np.abs(potential_stiffness(shortest, contact_distance, row.e1, row.m1, row.n1))


def damping_force(unit, v_i, v_j, row):
    """Force of eq. 4 on i [force], shape (..., 3); unit points from j to i."""
    closing = np.sum(unit * (v_i - v_j), axis=-1, keepdims=True)
    return -np.asarray(row.gamma)[..., None] * closing * unit


def pair_cut(contact_distance, bonded, row, contact):
    """Distance beyond which the pair does nothing [length]; 0 for pairs that never interact.

    contact_distance: R_i + R_j; bonded: bool array; contact: one of CONTACT_MODES.
    """
    if contact not in CONTACT_MODES:
        raise ValueError(f"contact must be one of {', '.join(CONTACT_MODES)}, got '{contact}'")
    dlim = row.alpha * contact_distance
    unbonded = {"literal": dlim, "repulsive": contact_distance, "none": 0.0 * dlim}[contact]
    return np.where(bonded, dlim, unbonded)
