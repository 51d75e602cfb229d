# SPDX-License-Identifier: GPL-2.0-only
"""Writes the part of this folder: plate_with_hole.stl in mm, to be pulled along x.

    PYTHONPATH=tools:tests/tools python3 tests/data/parts/make_parts.py [FOLDER]

Own geometry: a plate with a round hole, made of quadrilaterals between the hole and the edge.
"""

import pathlib
import sys

import numpy as np
from inputs import mesh_of, write_mesh


def plate_with_hole(length=60.0, width=24.0, thickness=8.0, radius=5.0, facets=32):
    """A plate along x with a hole through its middle along z [mm]; its outline is met by the same number of rays from the middle."""
    half = 0.5 * np.array([length, width])
    angle = np.sort(np.append(2.0 * np.pi * (np.arange(facets) + 0.5) / facets - np.pi, np.arctan2([half[1], half[1], -half[1], -half[1]], [half[0], -half[0], half[0], -half[0]])))
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    hole, edge = radius * ray, ray * np.min(half / np.maximum(np.abs(ray), 1e-12), axis=1)[:, None]
    up, down = 0.5 * thickness, -0.5 * thickness

    def at(point, z):
        return (point[0], point[1], z)

    triangles = []
    for k in range(len(angle)):
        a, b, c, d = hole[k], edge[k], edge[(k + 1) % len(angle)], hole[(k + 1) % len(angle)]
        triangles += [(at(a, up), at(b, up), at(c, up)), (at(a, up), at(c, up), at(d, up))]
        triangles += [(at(a, down), at(c, down), at(b, down)), (at(a, down), at(d, down), at(c, down))]
        triangles += [(at(b, down), at(c, down), at(c, up)), (at(b, down), at(c, up), at(b, up))]
        triangles += [(at(a, down), at(d, up), at(d, down)), (at(a, down), at(a, up), at(d, up))]
    return mesh_of(np.reshape(triangles, (-1, 3)), np.arange(3 * len(triangles)).reshape(-1, 3))


def main(folder):
    write_mesh(folder / "plate_with_hole.stl", plate_with_hole())


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
