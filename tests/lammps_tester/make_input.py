#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Writes data.evp_lj, evp_lj.bonds and evp_lj_flow.bonds into the present folder: the body that LAMMPS' pair tester looks at.

64 spheres of two types in a periodic box. The bonds are those of the body before it was stretched and
shaken: of them some are in either regime and some beyond dlim, and other pairs have met. The YAML files
say how their numbers are made anew after a change here (README.md).
"""

import itertools
import pathlib

import numpy as np
from scipy.spatial import cKDTree

SPACING = 0.01  # of the lattice [m]
CELLS = 4
ZONE = 1.44  # bonds are the pairs with d <= ZONE (R_i + R_j)
STRETCH = np.array([1.04, 1.0, 0.98])
SHAKEN = 2e-4  # [m], largest displacement along an axis


def body():
    """Places before and after, velocities, radii, types and the box lengths after."""
    rng = np.random.default_rng(2017)
    grid = np.array(list(itertools.product(range(CELLS), repeat=3)), dtype=float)
    before = (grid + 0.5 + rng.uniform(-0.12, 0.12, grid.shape)) * SPACING
    radius = rng.uniform(0.0045, 0.0055, len(grid))
    types = rng.integers(1, 3, len(grid))
    after = before * STRETCH + rng.uniform(-SHAKEN, SHAKEN, grid.shape)
    velocity = rng.uniform(-100.0, 100.0, grid.shape)
    return before, after, velocity, radius, types, CELLS * SPACING * STRETCH


def record(x, radius, length):
    """{(id_i, id_j): d} of the pairs within the zone in the periodic cube."""
    steps = [np.array(step) for step in itertools.product((-1, 0, 1), repeat=3)]
    places = np.concatenate([x + length * step for step in steps])
    owner = np.tile(np.arange(len(x)), len(steps))
    tree = cKDTree(places)
    bonds = {}
    for i, near in enumerate(tree.query_ball_point(x, 2.0 * ZONE * radius.max())):
        for k in near:
            j, d = owner[k], np.linalg.norm(places[k] - x[i])
            if i < j and d <= ZONE * (radius[i] + radius[j]):
                bonds[i + 1, j + 1] = d
    return bonds


def offset(i, j):
    """q/deq of a bond that has flowed: both ways by formula, every third not at all."""
    return 0.0 if (i + j) % 3 == 0 else 0.015 * np.sin(1.7 * i + 2.9 * j)


def write(folder):
    before, x, v, radius, types, box = body()
    bonds = record(before, radius, CELLS * SPACING)
    with open(folder / "evp_lj.bonds", "w", encoding="utf-8") as out:
        out.write(f"# EVP bonds COUNT: {len(bonds)} UNITS: si\n")
        for (i, j), deq in sorted(bonds.items()):
            out.write(f"{i} {j} {deq:.17g}\n")
    with open(folder / "evp_lj_flow.bonds", "w", encoding="utf-8") as out:
        some = {pair: deq for pair, deq in sorted(bonds.items()) if sum(pair) % 7}  # the others are new pairs, which repel where they overlap
        out.write(f"# EVP bonds COUNT: {len(some)} UNITS: si\n")
        for (i, j), deq in some.items():
            out.write(f"{i} {j} {deq:.17g} {offset(i, j) * deq:.17g} {abs(offset(i, j)):.17g} 0.25 0\n")
    with open(folder / "data.evp_lj", "w", encoding="utf-8") as out:
        out.write(f"# written by make_input.py\n\n{len(x)} atoms\n2 atom types\n\n")
        for axis, length in zip("xyz", box):
            out.write(f"0 {length:.17g} {axis}lo {axis}hi\n")
        out.write("\nAtoms # sphere\n\n")
        for k, place in enumerate(x):
            words = " ".join(f"{value:.17g}" for value in (2.0 * radius[k], 2700.0, *place))
            out.write(f"{k + 1} {types[k]} {words}\n")
        out.write("\nVelocities\n\n")
        for k, velocity in enumerate(v):
            out.write(f"{k + 1} " + " ".join(f"{value:.17g}" for value in velocity) + " 0 0 0\n")


if __name__ == "__main__":
    write(pathlib.Path())
