# SPDX-License-Identifier: GPL-2.0-only
"""A specimen pulled and pushed back without a rate, in numpy: the second writing of what in.quasistatic does with `unload elastic`.

The grips move by an increment of strain, then the energy of the pairs is minimised with the offsets of the last state of rest
held; they move on once the body is at rest. Bonds only (contact none). For checks: a body of 500 takes 0.1 s per increment.
"""

from typing import NamedTuple

import numpy as np
import scipy.optimize

from . import flow, specimen

LENGTH, RADIUS = 0.05, 0.02  # of the cylinder [m]
UNIT = 1e-3  # [m]: what the minimiser sees as 1
TAPER = 1e-3  # of dlim, over which a force that repels ends where it would jump


class Bonds(NamedTuple):
    """Pairs within the zone: atoms (0-based), deq and dlim [m]."""

    i: np.ndarray
    j: np.ndarray
    deq: np.ndarray
    dlim: np.ndarray


def record(body, row):
    """The Bonds of a specimen.Specimen."""
    i, j = specimen.pairs_within(body, row.alpha)[0].T
    deq = np.linalg.norm(body.x[i] - body.x[j], axis=1)
    return Bonds(i, j, deq, row.alpha * (body.radius[i] + body.radius[j]))


def evaluate(x, bonds, row, q, outside="frozen"):
    """(energy since the last state of rest, forces (N,3), offsets after the return map) of positions x.

    outside: what the offset of a pair beyond dlim does. frozen: it keeps the value of dlim; flowing: it goes on with the distance.
    """
    r = x[bonds.i] - x[bonds.j]
    d = np.linalg.norm(r, axis=1)
    acts = d <= bonds.dlim
    within = np.minimum(d, bonds.dlim)
    now = flow.step(within, bonds.deq, row, q)
    energy = np.where(acts, flow.work_since(within, bonds.deq, row, q) - flow.work_since(bonds.dlim, bonds.deq, row, q), 0.0)
    size, after = np.where(acts, now.force, 0.0), now.q
    if outside == "flowing":  # a pair that comes back repels at once: a search has no state of rest where this force jumps
        after = flow.return_map(d, bonds.deq, row, q)
        last = np.maximum(flow.step(bonds.dlim, bonds.deq, row, q).force, 0.0)
        share = np.clip(1.0 - (d / bonds.dlim - 1.0) / TAPER, 0.0, 1.0)
        size = np.where(acts, size, last * share)
        energy += 0.5 * TAPER * bonds.dlim * last * share**2
    pull = (size / d)[:, None] * r
    force = np.zeros_like(x)
    np.add.at(force, bonds.i, pull)
    np.add.at(force, bonds.j, -pull)
    return float(np.sum(energy)), force, after


def relax(x, free, bonds, row, q, left, outside="frozen"):
    """Positions at rest: no force on a free atom above `left`. RuntimeError where the search does not get there."""

    def place(z):
        moved = x.copy()
        moved[free] = UNIT * z.reshape(-1, 3)
        return moved

    def goal(z):
        energy, force, _ = evaluate(place(z), bonds, row, q, outside)
        return energy, -UNIT * force[free].ravel()

    z = x[free].ravel() / UNIT
    for _ in range(8):
        found = scipy.optimize.minimize(goal, z, jac=True, method="L-BFGS-B",
                                        options={"maxiter": 4000, "maxfun": 8000, "maxcor": 30, "ftol": 0.0, "gtol": UNIT * left})
        z = found.x
        if np.abs(found.jac).max() <= UNIT * left:
            return place(z)
    raise RuntimeError(f"not at rest: {np.abs(found.jac).max() / UNIT:g} N is left")


def drive(body, row, strains, left=0.3, outside="frozen"):
    """(strains with 0 in front, stress of the grips [Pa] at rest) along the nominal strains. left: largest force on a free atom [N];
    outside: as in evaluate."""
    x, bonds = body.x.copy(), record(body, row)
    q = np.zeros(len(bonds.deq))
    sides = (x[:, 0] < 0.1 * LENGTH, -1.0), (x[:, 0] > 0.9 * LENGTH, 1.0)
    free = ~(sides[0][0] | sides[1][0])
    stresses, now, last = [0.0], 0.0, None
    for strain in strains:
        step, start = strain - now, x.copy()
        if last is not None and last[1] * step > 0.0:
            start += last[0] * step / last[1]
        else:
            start[free, 0] += step * (x[free, 0] - 0.5 * LENGTH)
        for grip, sign in sides:
            start[grip] = x[grip] + [sign * 0.4 * LENGTH * step, 0.0, 0.0]
        found = relax(start, free, bonds, row, q, left, outside)
        last, x, now = (found - x, step), found, strain
        _, force, q = evaluate(x, bonds, row, q, outside)
        stresses.append(-sum(sign * force[grip, 0].sum() for grip, sign in sides) / 2 / (np.pi * RADIUS**2))
    return np.concatenate([[0.0], strains]), np.array(stresses)
