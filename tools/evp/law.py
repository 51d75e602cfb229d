# SPDX-License-Identifier: GPL-2.0-only
"""The two-regime Lennard-Jones law and its plasticity, written from the paper's equations for numpy arrays.

Source: M. Gado, J.-L. Charles, I. Iordanoff, D. Coupard, CSMA 2017, hal-01899324; equation numbers
are the paper's. This is the project's second writing of the law: it shares no expression with
src/core/law.h, so that a test which compares the two means something.

Distances d and deq may have any shapes that broadcast; units are those of the caller (the decks use
SI: m, J, N). A positive force repels. The fields of a Row may be arrays too, one entry per pair.

Plasticity of pairs (`plasticity isotropic`), as in doc/pair_evp_lj.rst: two values per pair, q [length], the plastic part of its
distance, and k, its accumulated plastic strain. The return map is exact for any increment. Saturation 0 is linear hardening.
"""

from typing import NamedTuple

import numpy as np


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
        exponents = ((self.m1, self.n1), (self.m2, self.n2))
        rules = {
            "all 9 numbers of a row must be finite": np.all(np.isfinite(np.array(self, dtype=float))),
            "exponents must satisfy m > n > 0 in both regimes": all(m > n > 0 for m, n in exponents),
            "m must exceed n by at least 1e-4 and by 1e-4 of m": all(m - n >= 1e-4 * max(m, 1.0) for m, n in exponents),
            "e1, e2 and gamma must be zero or positive": min(self.e1, self.e2, self.gamma) >= 0,
            "xi_s must lie between 0 and 1": 0 < self.xi_s < 1,
            "alpha must be greater than 1": self.alpha > 1,
        }
        broken = [rule for rule, holds in rules.items() if not holds]
        if broken:
            raise ValueError(broken[0])
        return self


TABLE1 = Row(80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 0.0, 1.5)
TABLE2 = TABLE1._replace(gamma=1000.0)


def log_stretch(d, deq):
    """log(deq/d) without loss of digits near d = deq, where the subtraction is exact."""
    return np.log1p((deq - d) / d)


def potential_force(d, deq, e, m, n):
    """F_{e,m,n}(d) of eq. 1 [energy/length], by the one formula for both sides of deq."""
    log_s = log_stretch(d, deq)
    return m * n * e / ((m - n) * deq) * np.exp((n + 1) * log_s) * np.expm1((m - n) * log_s)


def force(d, deq, row):
    """Force of eq. 8 [energy/length], positive when repulsive; no cut-off is applied here."""
    d, deq = np.broadcast_arrays(np.asarray(d, dtype=float), np.asarray(deq, dtype=float))
    is_first = np.abs(d - deq) / deq <= row.xi_s
    ds = np.where(d >= deq, 1 + row.xi_s, 1 - row.xi_s) * deq
    first = potential_force(np.where(is_first, d, ds), deq, row.e1, row.m1, row.n1)
    return np.where(is_first, first, potential_force(np.where(is_first, ds, d) - ds + deq, deq, row.e2, row.m2, row.n2) + first)


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
    return potential_force(d - q, deq, row.e1, row.m1, row.n1)
