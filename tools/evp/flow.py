# SPDX-License-Identifier: GPL-2.0-only
"""Flow that stays (`unload elastic`) and bonds that break: one offset q per pair, for numpy arrays.

With q the elastic part of a pair is e = d - q. It never leaves the first regime: what is beyond its threshold ds becomes
flow (the return map), q = d - ds. Then

    F   = F_I(d - q) + F_II(deq + q)
    Psi = Phi_I(e) + Phi_II(deq + q) - F_II(deq + q) (e - deq)       stored, -dPsi/dd = F at fixed q
    D   = -F_I(ds) (q1 - q0) + [F_II(deq + q1) - F_II(deq + q0)] (ds - deq)       dissipated by a flow from q0 to q1

Part of the second writing of the law, as law.py: it shares no expression with src/core. Distances, deq and q [length] may have
any shapes that broadcast.
"""

from typing import NamedTuple

import numpy as np

from . import law


class Step(NamedTuple):
    """What an evaluation at d gives: q after the return map [length], force [positive repels], energy dissipated on the way."""

    q: np.ndarray
    force: np.ndarray
    dissipated: np.ndarray


def return_map(d, deq, row, q):
    """The offset after d was reached [length]; q itself where the elastic part is in the first regime."""
    elastic = np.asarray(d, dtype=float) - q
    stretched, pushed = (1 + row.xi_s) * deq, (1 - row.xi_s) * deq
    return np.where(elastic > stretched, d - stretched, np.where(elastic < pushed, d - pushed, q))


def _first(x, deq, row):
    return law.potential_force(x, deq, row.e1, row.m1, row.n1)


def _second(x, deq, row):
    return law.potential_force(x, deq, row.e2, row.m2, row.n2)


def elastic_force(d, deq, row, q):
    """F [energy/length] with the offset as it is; d - q must be in the first regime."""
    return _first(d - q, deq, row) + _second(deq + q, deq, row)


def dissipated(q0, q1, deq, row):
    """D of a flow from q0 to q1 [energy], which went on with the elastic part at the threshold on that side."""
    beyond = np.where(np.asarray(q1) >= q0, row.xi_s, -np.asarray(row.xi_s)) * deq
    return -_first(deq + beyond, deq, row) * (np.asarray(q1) - q0) + (_second(deq + q1, deq, row) - _second(deq + q0, deq, row)) * beyond


def step(d, deq, row, q):
    """The Step of bonds whose offset was q in the last state of rest, or at the last timestep."""
    after = return_map(d, deq, row, q)
    return Step(after, elastic_force(d, deq, row, after), dissipated(q, after, deq, row))


def contact_step(d, deq, row, q, cut, repulsive=False):
    """The Step of pairs that met later: the force of the return map, but only compression is kept, and nothing beyond the cut.

    So a new pair that is stretched follows eq. 8. repulsive: it only pushes, its cut is deq.
    """
    mapped = step(d, deq, row, q)
    acts = np.asarray(d) <= cut
    force = np.where(acts, np.maximum(mapped.force, 0.0) if repulsive else mapped.force, 0.0)
    kept = np.where(acts, np.minimum(mapped.q, 0.0), 0.0)
    return Step(kept, force, np.where(acts, dissipated(q, kept, deq, row), 0.0))


def hardening(deq, row, q):
    """Phi_II(deq + q) above its minimum [energy]: what unloading to zero elastic part does not give back."""
    return law.potential(deq + q, deq, row.e2, row.m2, row.n2) + row.e2


def stored(d, deq, row, q):
    """Psi above that at rest [energy]; d - q must be in the first regime."""
    elastic = d - q
    coupling = _second(deq + q, deq, row) * (elastic - deq)
    return law.potential(elastic, deq, row.e1, row.m1, row.n1) + row.e1 + hardening(deq, row, q) - coupling


def work_since(d, deq, row, q):
    """Psi + D at d for pairs whose offset was q [energy]: its slope is -F, so that a line search is consistent."""
    after = return_map(d, deq, row, q)
    return stored(d, deq, row, after) + dissipated(q, after, deq, row)


def dissipation_limit(row):
    """q/deq below which flow in compression would give energy back, D < 0: -inf where it never does, 0 where it always does.

    There the second regime has become the stiffer one: K_II(deq + q) (deq - ds) = F_I(ds).
    """
    held = float(_first(1.0 - row.xi_s, 1.0, row))

    def gained(q):
        return float(law.potential_stiffness(1.0 + q, 1.0, row.e2, row.m2, row.n2)) * row.xi_s - held

    if gained(0.0) >= 0.0:
        return 0.0
    low, high = -1.0 + 1e-6, 0.0
    if gained(low) < 0.0:
        return -np.inf
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if gained(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def breaks(d, deq, dlim, strain=None):
    """Is the pair no bond any more? strain: XI of `break XI`, None for the paper's rule, where none breaks."""
    d = np.asarray(d, dtype=float)
    if strain is None:
        return np.zeros(d.shape, dtype=bool)
    return (d > (1 + strain) * deq) | (d > dlim)


def broken_force(d, contact_distance, row, contact):
    """Force of what is left of a broken bond [energy/length]: it repels below R_i + R_j as a new contact does; none: nothing."""
    touching = (np.asarray(d) < contact_distance) & (contact != "none")
    return np.where(touching, np.maximum(law.force(d, contact_distance, row), 0.0), 0.0)
