# SPDX-License-Identifier: GPL-2.0-only
"""Closed forms of torsion and bending for the decks in.torsion and in.bending, and what the surface of a packing takes from them.

SI units. Bodies of central forces have nu = 1/4 (Cauchy), so that G = E/(2 (1 + nu)) = 0.4 E.
"""

import math
from typing import NamedTuple

import study  # noqa: F401  first
import numpy as np

from evp.specimen import pairs_within

NU = 0.25
SHEAR = 0.5 / (1.0 + NU)  # G/E
KAPPA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU)  # of a rectangle; Cowper, J. Appl. Mech. 33 (1966) 335


def torque(modulus, radius, length, angle):
    """[N m] of a round bar, G J angle/length with G = 0.4 E and J = pi R^4/2."""
    return SHEAR * modulus * 0.5 * math.pi * radius**4 * angle / length


class Beam(NamedTuple):
    """A bar with a rectangular cross-section on two supports, loaded at mid-span: Young's modulus [Pa], lengths [m]."""

    modulus: float
    width: float
    height: float
    span: float

    def deflection(self, force, inertia=1.0):
        """Timoshenko's [m], force S^3/(48 E I) + force S/(4 kappa G A); inertia: second moment of area over width height^3/12."""
        bending = self.span**3 / (4.0 * self.modulus * self.width * self.height**3)
        return force * (bending / inertia + self.span / (4.0 * KAPPA * SHEAR * self.modulus * self.width * self.height))


class Bonds(NamedTuple):
    """Middles [m] and directions of the bonds of a body, (Nb, 3) each."""

    middle: np.ndarray
    direction: np.ndarray


def find_bonds(packing, zone, low, high):
    """The Bonds of a Specimen, pairs within zone (R_i + R_j), whose middle has low < x < high."""
    a, b = np.moveaxis(packing.x[pairs_within(packing, zone)[0]], 1, 0)
    apart, middle = b - a, 0.5 * (a + b)
    kept = (low < middle[:, 0]) & (middle[:, 0] < high)
    return Bonds(middle[kept], apart[kept] / np.linalg.norm(apart[kept], axis=1)[:, None])


def torsion_share(bonds, radius):
    """G J/(E A) of the bonds over that of a full circle, 0.4 R^2/2, both by the energy of an affine strain.

    Each bond stores m n e1 xi^2/2, whatever its length: xi = eps n_x^2 when the body is pulled, xi = theta r n_x n_t, n_t that
    about the axis, when it is twisted by theta per length. Isotropic directions: <n_x^2 n_t^2>/<n_x^4> = 1/3.
    """
    n, y, z = bonds.direction, bonds.middle[:, 1], bonds.middle[:, 2]
    turning = n[:, 2] * y - n[:, 1] * z
    return 3.0 * np.sum((n[:, 0] * turning) ** 2) / np.sum(n[:, 0] ** 4) / (0.5 * radius**2)


def bending_share(bonds, height):
    """I/A of the bonds over that of a rectangle, height^2/12, the neutral fibre at z = 0; weights as in torsion_share."""
    weight = bonds.direction[:, 0] ** 4
    return np.sum(weight * bonds.middle[:, 2] ** 2) / np.sum(weight) / (height**2 / 12.0)
