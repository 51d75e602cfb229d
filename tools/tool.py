#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Covers the surface of a tool from a CAD program (STL) with one layer of spheres, for in.press.

    tools/tool.py punch.stl --unit mm --size 0.3e-3 --out punch.data

Writes the data file --out (atom_style sphere, SI), whose spheres are of one type; of a text file with several solids, of one for each.
Spheres lie within a closed surface and touch it; on an open one are their centers. The lowest point of the tool along --axis is at 0, the middle
of its box at 0 of the other axes: in.press moves this origin down along --axis. Take --size from a fifth to a half of the spheres of the body:
edges are rounded to half of it. Needs Open3D, as tools/body.py does.
"""

import pathlib

import evp  # noqa: F401  before numpy
import numpy as np
from evp.covering import SPACING, covering, shells_of, solids_of
from evp.report import all_or_nothing, command_line, errors_in_one_line, note, positive, target_file
from evp.surface import UNITS, Surface, read_mesh

FEWEST = 4.0  # spheres side by side along the longest extent of a tool
MOST = 200_000  # spheres of a layer
PER_AREA = 0.6  # spheres per square of their spacing, about
ROUNDED = 0.2  # over the diameter: farther from the spheres are sharp edges alone
DENSITY = 2700.0  # [kg/m3] of no effect where the tool is moved by its velocity


def placed(shells, axis, metre, size):
    """Shells in metres, so that the lowest point of their spheres along an axis and the middle of their box along the others is the origin; extents (3,) of all."""
    boxes = [(shell.surface.low, shell.surface.low + shell.surface.extents, 0.0 if shell.closed else 0.5 * size) for shell in shells]
    low = np.min([metre * low - beyond for low, _, beyond in boxes], axis=0)
    high = np.max([metre * high + beyond for _, high, beyond in boxes], axis=0)
    origin = np.where(np.arange(3) == "xyz".index(axis), low, 0.5 * (low + high))
    return [shell._replace(surface=Surface(metre * shell.surface.corners - origin, shell.surface.triangles)) for shell in shells], high - low


def check_size(shells, extents, size, unit):
    """ValueError where spheres of this size are too few or too many for the tool."""
    long = " x ".join(f"{value:.4g}" for value in extents) + f" m with --unit {unit}"
    if extents.max() < FEWEST * size:
        raise ValueError(f"the tool is {long}, fewer than {FEWEST:g} spheres of {size:g} m: give the --unit of the file, or a smaller --size, which is in m")
    count = PER_AREA * sum(shell.surface.areas.sum() for shell in shells) / (SPACING * size) ** 2
    if count > MOST:
        raise ValueError(f"the tool is {long}, which takes {count:.2g} spheres of {size:g} m, more than {MOST}: give the --unit of the file, or a larger --size, "
                         f"of {size * (count / MOST) ** 0.5:.2g} m at least")


def write_tool(path, centers, solids, names, size):
    """The data file: spheres (N,3) of this diameter, types by their solids (N,)."""
    low, high = centers.min(axis=0) - size, centers.max(axis=0) + size
    title = ", ".join(f"type {k} {name}" for k, name in enumerate(names, start=1) if name)
    with all_or_nothing(path.parent) as place, open(place / path.name, "w", encoding="utf-8") as out:
        out.write(f"tool of spheres of {size:g} m {title}\n\n{len(centers)} atoms\n{len(names)} atom types\n\n")
        out.writelines(f"{a:.9g} {b:.9g} {axis}lo {axis}hi\n" for axis, a, b in zip("xyz", low, high))
        out.write("\nAtoms # sphere\n\n")
        out.writelines(f"{k} {solid + 1} {size:.9g} {DENSITY:g} {x:.9g} {y:.9g} {z:.9g}\n" for k, (solid, (x, y, z)) in enumerate(zip(solids, centers), start=1))


def main(arguments=None):
    parser = command_line(__doc__)
    parser.add_argument("tool", type=pathlib.Path, metavar="TOOL.stl", help="surface of the tool, STL, or another format that Open3D reads")
    parser.add_argument("--size", type=positive, required=True, metavar="D", help="diameter of the spheres [m]")
    parser.add_argument("--out", type=target_file, required=True, metavar="FILE", help="data file to write")
    parser.add_argument("--unit", choices=UNITS, default="mm", help="length unit of the file, which STL does not state (default: %(default)s)")
    parser.add_argument("--axis", choices="xyz", default="z", help="axis along which the tool moves, downwards (default: %(default)s)")
    options = parser.parse_args(arguments)
    with errors_in_one_line("tool.py", "; nothing was written"):
        mesh = read_mesh(options.tool)
        names, solids = solids_of(options.tool, len(mesh.triangles))
        shells, extents = placed(shells_of(mesh, solids, str(options.tool)), options.axis, UNITS[options.unit], options.size)
        print(f"{options.tool}: {sum(len(shell.solids) for shell in shells)} triangles, with --unit {options.unit} "
              + " x ".join(f"{value:.4g}" for value in extents) + f" m, {len(shells)} piece" + "s" * (len(shells) > 1))
        check_size(shells, extents, options.size, options.unit)
        for number, shell in enumerate(shells, start=1):
            if not shell.closed:
                note(f"piece {number} is open: the centers of its spheres are on it, and the tool is {0.5 * options.size:g} m thicker on both sides")
            elif shell.turned:
                note(f"normals of {shell.turned} triangles of piece {number} pointed inwards: they were turned")
        layers = [covering(shell, options.size, np.random.default_rng(1)) for shell in shells]
        centers, solids = np.concatenate([layer.centers for layer in layers]), np.concatenate([layer.solids for layer in layers])
        sink, left = np.concatenate([layer.sink for layer in layers]), max(layer.left.max() for layer in layers)
        write_tool(options.out, centers, solids, names, options.size)
        print(f"{len(centers)} spheres of {options.size:g} m; others of that size sink in between them by {100 * np.sqrt(np.mean(sink**2)):.1f} % of it (rms), "
              f"{100 * sink.max():.0f} % at most" + (f"; sharp edges end up to {left * options.size:.2g} m behind those of the surface" if left > ROUNDED else ""))
        for number, name in enumerate(names, start=1):
            if name:
                print(f"type {number}: solid {name}, {np.sum(solids == number - 1)} spheres")
        print(f"written: {options.out}")


if __name__ == "__main__":
    main()
