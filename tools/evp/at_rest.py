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


def evaluate(x, bonds, row, q):
    """(energy since the last state of rest, forces (N,3), offsets after the return map) of positions x."""
    r = x[bonds.i] - x[bonds.j]
    d = np.linalg.norm(r, axis=1)
    acts = d <= bonds.dlim
    now = flow.step(np.minimum(d, bonds.dlim), bonds.deq, row, q)  # what left dlim has flowed up to it
    pull = (np.where(acts, now.force, 0.0) / d)[:, None] * r
    force = np.zeros_like(x)
    np.add.at(force, bonds.i, pull)
    np.add.at(force, bonds.j, -pull)
    energy = flow.work_since(d, bonds.deq, row, q) - flow.work_since(bonds.dlim, bonds.deq, row, q)
    return float(np.sum(energy[acts])), force, now.q


def relax(x, free, bonds, row, q, left):
    """Positions at rest: no force on a free atom above `left`. RuntimeError where the search does not get there."""

    def place(z):
        moved = x.copy()
        moved[free] = UNIT * z.reshape(-1, 3)
        return moved

    def goal(z):
        energy, force, _ = evaluate(place(z), bonds, row, q)
        return energy, -UNIT * force[free].ravel()

    z = x[free].ravel() / UNIT
    for _ in range(8):
        found = scipy.optimize.minimize(goal, z, jac=True, method="L-BFGS-B",
                                        options={"maxiter": 4000, "maxfun": 8000, "maxcor": 30, "ftol": 0.0, "gtol": UNIT * left})
        z = found.x
        if np.abs(found.jac).max() <= UNIT * left:
            return place(z)
    raise RuntimeError(f"not at rest: {np.abs(found.jac).max() / UNIT:g} N is left")


def drive(body, row, strains, left=0.3):
    """(strains with 0 in front, stress of the grips [Pa] at rest) along the nominal strains. left: largest force on a free atom [N]."""
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
        found = relax(start, free, bonds, row, q, left)
        last, x, now = (found - x, step), found, strain
        _, force, q = evaluate(x, bonds, row, q)
        stresses.append(-sum(sign * force[grip, 0].sum() for grip, sign in sides) / 2 / (np.pi * RADIUS**2))
    return np.concatenate([[0.0], strains]), np.array(stresses)
