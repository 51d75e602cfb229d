# SPDX-License-Identifier: GPL-2.0-only
"""The two-regime Lennard-Jones law and its plasticity, written from the paper's equations for numpy arrays.

Source: M. Gado, J.-L. Charles, I. Iordanoff, D. Coupard, CSMA 2017, hal-01899324; equation numbers
are the paper's. This is the project's second writing of the law: it shares no expression with
src/core/law/law.h, so that a test which compares the two means something.

Distances d and deq may have any shapes that broadcast; units are those of the caller (the decks use
SI: m, J, N). A positive force repels. The fields of a Row may be arrays too, one entry per pair.

Plasticity (`plasticity isotropic`), as in doc/pair_evp_lj.rst: flow moves deq. A bond keeps deq and nothing else;
r = d/deq is held within 1 - y and 1 + y. y is the smaller of the limits of its two spheres, y_i = xi_s Y(p_i), where
p_i is the equivalent plastic strain of sphere i. All is in closed form for an increment of any size. Strains, y, p and
|ln| have no unit.
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


# Mean |ln(deq_new/deq)| of the bonds of a sphere over its equivalent plastic strain: measured on random packings.
# Affine flow would give 0.385.
SLIP_PER_STRAIN = 0.31
MOST_POINTS = 32  # of a flow table

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)  # on (-1, 1)


class Flowed(NamedTuple):
    """Pairs after they were brought to d; arrays of the shape to which d, deq, y and the fields of the row broadcast."""

    deq: np.ndarray  # [length]
    force: np.ndarray  # [energy/length], positive repels
    stored: np.ndarray  # Psi [energy], zero at rest
    dissipated: np.ndarray  # D of this increment [energy], zero or positive
    slip: np.ndarray  # |ln(deq_new/deq)|


def hardening(row):
    """h of the linear rule y = xi_s + 0.31 h p: r/(1 - r), r the ratio of the two stiffnesses at rest.

    ValueError where r >= 1."""
    ratio = row.m2 * row.n2 * np.asarray(row.e2, dtype=float) / (row.m1 * row.n1 * row.e1)
    if np.any(ratio >= 1.0):
        raise ValueError("plasticity isotropic without a flow table needs m2 n2 e2 < m1 n1 e1: "
                         "the second regime must be the softer one")
    return ratio / (1.0 - ratio)


def largest_limit(row):
    """The strain at which -F d of eq. 1 is largest, (m1/n1)^(1/(m1 - n1)) - 1: no limit reaches it."""
    excess = np.asarray(row.m1, dtype=float) - row.n1
    return np.expm1(np.log1p(excess / row.n1) / excess)


def check_flow(flow, row):
    """(p, Y), arrays of the points of a table p0 Y0 p1 Y1 ...; ValueError names the rule that is broken."""
    table = np.asarray(flow, dtype=float)
    if table.ndim != 1 or len(table) % 2 or not 2 <= len(table) <= 2 * MOST_POINTS:
        raise ValueError(f"flow needs pairs p Y, {MOST_POINTS} at most")
    p, factor = table[0::2], table[1::2]
    rules = {
        "all numbers of flow must be finite": np.all(np.isfinite(table)),
        "flow must begin with 0 1": p[0] == 0.0 and factor[0] == 1.0,
        "p of flow must ascend": np.all(np.diff(p) > 0.0),
        "Y of flow must be positive": np.all(factor > 0.0),
        "xi_s Y must stay below (m1/n1)^(1/(m1-n1)) - 1": np.all(row.xi_s * np.max(factor) < largest_limit(row)),
    }
    broken = [rule for rule, holds in rules.items() if not holds]
    if broken:
        raise ValueError(broken[0])
    return p, factor


def limit(p, row, flow=None):
    """y of spheres: the largest strain that a bond holds; shape to which p and the fields of the row broadcast.

    p: equivalent plastic strain of the spheres; row: that of their own type.
    flow: p0 Y0 p1 Y1 ..., a table of Y(p), linear between its points, constant beyond the last one: y = xi_s Y(p).
    Without it the linear rule y = xi_s + 0.31 h p, constant from largest_limit(row) on.
    """
    p = np.asarray(p, dtype=float)
    if flow is not None:
        return row.xi_s * np.interp(p, *check_flow(flow, row))
    return np.minimum(row.xi_s + SLIP_PER_STRAIN * hardening(row) * p, largest_limit(row))


def _work_to(log_r, row):
    """Phi_I(r) - Phi_I(1) of eq. 2 [energy] at ln r.

    The integral of -F d over ln r: its integrand keeps its sign, so that nothing cancels."""
    log_r = np.asarray(log_r, dtype=float)[..., None]
    e, m, n = (np.asarray(value, dtype=float)[..., None] for value in (row.e1, row.m1, row.n1))
    place = 0.5 * log_r * (1.0 + _NODES)
    pull = -m * n * e / (m - n) * np.exp(-n * place) * np.expm1(-(m - n) * place)
    return np.sum(0.5 * log_r * _WEIGHTS * pull, axis=-1)


def _held(d, deq, y, least, most):
    """(r_c, ln r_c, ln(r/r_c)): r = d/deq is held at r_c, in 1 + least y .. 1 + most y. Shapes that broadcast."""
    d, deq, y = np.broadcast_arrays(*(np.asarray(value, dtype=float) for value in (d, deq, y)))
    strain = (d - deq) / deq
    held = np.clip(strain, least * y, most * y)
    return 1.0 + held, np.log1p(held), np.log1p((strain - held) / (1.0 + held))


def _reduced_force(log_rc, row):
    """F d of eq. 1 [energy] at ln r_c; a bond that flows keeps it."""
    e, m, n = row.e1, row.m1, row.n1
    return m * n * e / (m - n) * np.exp(-n * log_rc) * np.expm1(-(m - n) * log_rc)


def _flow(d, deq, row, r_c, log_rc, excess):
    """Flowed of pairs held at r_c, ln(r/r_c) = excess: deq_new = d/r_c, F = F_I(r_c), D = |F d| |ln(deq_new/deq)|."""
    reduced, slip = _reduced_force(log_rc, row), np.abs(excess)
    deq = np.where(slip > 0.0, d / r_c, deq)
    return Flowed(*np.broadcast_arrays(deq, reduced / d, _work_to(log_rc, row), np.abs(reduced) * slip, slip))


def flow_bond(d, deq, row, y):
    """Flowed of bonds that had deq and are brought to d [length]; y: the smaller limit of their two spheres."""
    d, deq = np.asarray(d, dtype=float), np.asarray(deq, dtype=float)
    return _flow(d, deq, row, *_held(d, deq, y, -1.0, 1.0))


def flow_contact(d, deq, touching, row, y):
    """Flowed of pairs that only repel, which had deq and are brought to d [length]; touching: R_i + R_j.

    They flow in compression alone. Nothing acts between deq and R_i + R_j; beyond R_i + R_j deq is R_i + R_j again.
    """
    d, deq, touching = (np.asarray(value, dtype=float) for value in (d, deq, touching))
    found = _flow(d, deq, row, *_held(d, deq, y, -1.0, 0.0))
    acts = d < deq
    found = Flowed(*(np.where(acts, value, rest) for value, rest in zip(found, (deq, 0.0, 0.0, 0.0, 0.0))))
    return found._replace(deq=np.where(d > touching, touching, found.deq))


def potential(d, deq, row, y, contact=False):
    """The energy whose slope is the force while deq is held, as in a minimization: Psi + |F| deq r_c |ln(r/r_c)|.

    The second term is D of the flow from deq to where d would bring it. contact: pairs that only repel, bool or an
    array of it; their energy is zero from deq on.
    """
    found = flow_bond(d, deq, row, y)
    return np.where(np.logical_and(contact, np.asarray(d) >= deq), 0.0, found.stored + found.dissipated)
