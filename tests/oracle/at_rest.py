# SPDX-License-Identifier: GPL-2.0-only
"""A specimen loaded and released without a rate, in numpy: the second writing of what in.quasistatic does with `plasticity isotropic`.

The grips move by an increment of strain, then the energy stored and dissipated by the pairs is minimised with q and k of the last state of
rest held; they move on once the body is at rest. Bonds only (contact none), with the volume energy where kv is given.
For checks: a body of 500 takes 0.1 s per increment.
"""

from typing import NamedTuple

import numpy as np
import scipy.optimize

from evp import specimen

from . import flow, volume

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


class Specimen:
    """A body between its grips: x, q and k of the last state of rest, at the nominal `strain`."""

    def __init__(self, body, row, saturation=0.0, kv=0.0, left=0.3):
        """body: specimen.Specimen; kv of the volume energy [J]; left: largest force on a free atom at rest [N]."""
        self.body, self.row, self.saturation, self.kv, self.left = body, row, saturation, kv, left
        self.bonds = record(body, row)
        self.rest = volume.at_rest(*self.bonds, len(body.x))
        self.x, self.strain = body.x.copy(), 0.0
        self.q, self.k = np.zeros((2, len(self.bonds.deq)))
        self.sides = (body.x[:, 0] < 0.1 * LENGTH, -1.0), (body.x[:, 0] > 0.9 * LENGTH, 1.0)
        self.free = ~(self.sides[0][0] | self.sides[1][0])
        self._last = None  # the last increment of strain, and what it did to x

    def evaluate(self, x):
        """(energy since the last state of rest, forces (N,3), q, k) at positions x. A bond beyond dlim has flowed up to dlim."""
        bonds = self.bonds
        r = x[bonds.i] - x[bonds.j]
        d = np.linalg.norm(r, axis=1)
        within = np.minimum(d, bonds.dlim)
        q, k = flow.return_map(within, bonds.deq, self.row, self.q, self.k, self.saturation)
        flowed = k > self.k
        energy = np.sum(flow.stored(within, bonds.deq, self.row, q))
        energy += np.sum(flow.dissipated(self.q[flowed], q[flowed], bonds.deq[flowed], self.row, self.k[flowed], self.saturation))
        size = np.where(d <= bonds.dlim, flow.elastic_force(within, bonds.deq, self.row, q), 0.0)
        pull = (size / d)[:, None] * r
        force = np.column_stack([np.bincount(bonds.i, along, len(x)) - np.bincount(bonds.j, along, len(x)) for along in pull.T])
        if self.kv > 0.0:
            i, j = specimen.pairs_within(self.body._replace(x=x), self.row.alpha)[0].T
            fresh = np.isin(len(x) * i + j, len(x) * bonds.i + bonds.j, invert=True)
            kept = volume.evaluate(x, i, j, self.row.alpha * (self.body.radius[i] + self.body.radius[j]), self.kv, self.rest, fresh=fresh)
            energy, force = energy + kept.energy.sum(), force + kept.force
        return float(energy), force, q, k

    def relax(self, start):
        """Positions at rest: no force on a free atom above `left`. RuntimeError where the search does not get there."""

        def place(z):
            moved = start.copy()
            moved[self.free] = UNIT * z.reshape(-1, 3)
            return moved

        def goal(z):
            energy, force, _, _ = self.evaluate(place(z))
            return energy, -UNIT * force[self.free].ravel()

        z = start[self.free].ravel() / UNIT
        for _ in range(8):
            found = scipy.optimize.minimize(goal, z, jac=True, method="L-BFGS-B",
                                            options={"maxiter": 4000, "maxfun": 8000, "maxcor": 30, "ftol": 0.0, "gtol": UNIT * self.left})
            z = found.x
            if np.abs(found.jac).max() <= UNIT * self.left:
                return place(z)
        raise RuntimeError(f"not at rest: {np.abs(found.jac).max() / UNIT:g} N is left")

    def move_to(self, strain):
        """The stress of the grips [Pa] at rest at a nominal strain; the first guess goes on as the last increment did."""
        step, start = strain - self.strain, self.x.copy()
        if self._last is not None and self._last[0] * step > 0.0:
            start += self._last[1] * step / self._last[0]
        else:
            start[self.free, 0] += step * (self.x[self.free, 0] - 0.5 * LENGTH)
        for grip, sign in self.sides:
            start[grip] = self.x[grip] + [sign * 0.4 * LENGTH * step, 0.0, 0.0]
        found = self.relax(start)
        _, force, self.q, self.k = self.evaluate(found)
        self._last, self.x, self.strain = (step, found - self.x), found, strain
        return -sum(sign * force[grip, 0].sum() for grip, sign in self.sides) / 2 / (np.pi * RADIUS**2)

    def lost(self):
        """Bonds beyond dlim now."""
        d = np.linalg.norm(self.x[self.bonds.i] - self.x[self.bonds.j], axis=1)
        return int(np.sum(d > self.bonds.dlim))


def drive(body, row, strains, **options):
    """(strains with 0 in front, stress of the grips [Pa] at rest) along the nominal strains; options: those of Specimen."""
    specimen_now = Specimen(body, row, **options)
    return np.concatenate([[0.0], strains]), np.array([0.0, *(specimen_now.move_to(strain) for strain in strains)])
