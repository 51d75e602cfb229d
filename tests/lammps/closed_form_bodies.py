# SPDX-License-Identifier: GPL-2.0-only
"""Bodies whose response is known in closed form, and what the runs on them are read with.

Lengths are in diameters of the spheres, 1 m: R = 0.5 m, the mass of a sphere is 1 kg, and the stiffness of a bond at
rest K = m1 n1 e1/deq^2 with e1 = 1/(m1 n1) J is 1 N/m at deq = 1 m: a time of 1 s is one of sqrt(mass/K)."""

import itertools

import numpy as np
import small_bodies
from evp import law
from lammps_run import write_data
from small_bodies import thermo  # noqa: F401  for the tests of these bodies

MASS, STIFFNESS = 1.0, 1.0
DENSITY = MASS / (4.0 / 3.0 * np.pi * 0.5**3)
ROW = law.Row(1.0 / 32.0, 8.0, 4.0, 3.0 / 80.0 / 32.0, 8.0, 4.0, 0.005, 0.0, 1.5)  # Table 1 with e1 = 1/32 J


def head(row=ROW):
    """Up to the recording, for body.data in a periodic box."""
    return small_bodies.head(boundary="p p p", skin=0.05) + small_bodies.pair(row, "none")


def write_body(folder, x, box):
    write_data(folder / "body.data", x, np.full(len(x), 0.5), box, density=DENSITY)


def fcc(cells):
    """Face-centred cubic lattice of touching spheres, cube edge sqrt(2), [100] along x; places and box."""
    corner = np.array([[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0]]) / 2.0
    grid = np.array(list(itertools.product(*map(range, cells))), dtype=float)
    x = np.sqrt(2.0) * (grid[:, None, :] + corner + 0.25).reshape(-1, 3)
    return x, np.stack([np.zeros(3), np.sqrt(2.0) * np.array(cells)], axis=1)


def chain(count):
    """Touching spheres in a row along x, and a box that is periodic at the first's other neighbor."""
    x = np.stack([np.arange(count) + 0.5, np.full(count, 2.5), np.full(count, 2.5)], axis=1)
    return x, np.array([[0.0, count], [0.0, 5.0], [0.0, 5.0]])


def directions(count):
    """Unit vectors of even density on the sphere: multiples of the golden angle, equal steps of the axial cosine."""
    k = np.arange(count) + 0.5
    cosine, turn = 1.0 - 2.0 * k / count, np.pi * (3.0 - np.sqrt(5.0)) * k
    sine = np.sqrt(1.0 - cosine**2)
    return np.stack([cosine, sine * np.cos(turn), sine * np.sin(turn)], axis=1)


def dumbbells(per_side):
    """per_side^3 pairs that touch each other and nothing else, in all directions: one isotropic set of bonds."""
    centre = 4.0 * (np.array(list(itertools.product(range(per_side), repeat=3)), dtype=float) + 0.5)
    half = 0.5 * directions(per_side**3)
    return np.concatenate([centre - half, centre + half]), np.array([[0.0, 4.0 * per_side]] * 3)


def affine_stress(strain, row, points=4000):
    """Cauchy and nominal stress over E of bonds in all directions under affine motion with no lateral stress; lateral strain.

    strain: axial. Closed form 5: E = K deq^2 (bonds/volume)/6, midpoint rule over the axial cosine."""
    cosine2 = ((np.arange(points) + 0.5) / points) ** 2

    def stresses(lateral):
        axial, across = cosine2 * (1.0 + strain) ** 2, (1.0 - cosine2) * (1.0 + lateral) ** 2
        d = np.sqrt(axial + across)
        pull = -law.force(d, 1.0, row) / d
        volume = (1.0 + strain) * (1.0 + lateral) ** 2
        scale = 6.0 / (row.m1 * row.n1 * row.e1) / volume
        return scale * np.mean(pull * axial), scale * np.mean(pull * across) / 2.0, volume / (1.0 + strain)

    low, high = -strain, 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if stresses(middle)[1] > 0.0 else (middle, high)
    cauchy, _, area = stresses(high)
    return cauchy, cauchy * area, high


def recursion(a, every=1):
    """p, r of a[k+1] = p a[k] - r a[k-1], which a mode sampled at equal times obeys: r = |z|^2, p = 2 |z| cos(turn)."""
    columns = np.stack([a[every:-every:every], -a[: -2 * every : every]], axis=1)
    return np.linalg.lstsq(columns, a[2 * every :: every], rcond=None)[0]


def mode_of(a, interval):
    """Angular frequency and decay rate of a sampled mode: a = exp(-rate t) cos(omega t + phase)."""
    p, r = recursion(a)
    return float(np.arccos(np.clip(p / (2.0 * np.sqrt(r)), -1.0, 1.0)) / interval), float(-np.log(r) / (2.0 * interval))
