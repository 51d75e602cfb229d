#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Packs spheres into your own part, a closed surface from a CAD program (STL), for in.traction and the other decks.

    tools/body.py part.stl --n 2000 --unit mm --axis z --out part.data
    tools/body.py --example part.stl         writes a part to try this on: a tension bar along z, in mm

Writes the data file --out (atom_style sphere, SI) with the part's axis along x from x = 0, and beside it OUT.body, from which the
decks read length, cross-section at mid-length, volume and density. Prints the measures of the part and the roughness of the packed surface.
lammps_inputs/in.specimen packs the spheres between fixed points of the surface. LAMMPS is the lmp of this checkout, or EVP_LMP.
Needs Open3D: apt-get install python3-open3d (Debian), or pip install open3d. No other tool needs it.
"""

import argparse
import pathlib
import sys

import evp  # noqa: F401  before numpy
import numpy as np
from evp.part import check_thickness, guessed_radius, pack
from evp.report import command_line, errors_in_one_line, positive, target_file, whole
from evp.surface import AXES, closed_surface, dog_bone, read_mesh, write_mesh

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
USUAL = 1e-4, 10.0  # [m] longest extent of a part: beyond it the unit is asked about


def extents_in_words(extents):
    return " x ".join(f"{value:.4g}" for value in extents) + " m"


class Example(argparse.Action):
    """Writes the example and ends the program, as --help does: nothing else is needed then."""

    def __call__(self, parser, namespace, values, option_string=None):
        if values.exists():
            parser.error(f"{option_string} {values}: there is such a file: give another name")
        try:
            write_mesh(values, dog_bone())
        except OSError as error:
            parser.error(f"{option_string} {values}: {error.strerror}")
        print(f"written: {values}, a tension bar along z in mm")
        parser.exit()


def main(arguments=None):
    parser = command_line(__doc__)
    parser.add_argument("part", type=pathlib.Path, metavar="PART.stl", help="closed surface, STL, or another format that Open3D reads")
    parser.add_argument("--n", type=whole(50), required=True, help="number of spheres, 50 or more")
    parser.add_argument("--out", type=target_file, required=True, metavar="FILE", help="data file to write; FILE.body is written beside it")
    parser.add_argument("--unit", choices=UNITS, default="mm", help="length unit of the file, which STL does not state (default: %(default)s)")
    parser.add_argument("--axis", choices=AXES, default="x", help="axis of the file along which the part is loaded (default: %(default)s)")
    parser.add_argument("--seed", type=whole(1), default=1, help="of the random initial positions (default: %(default)s)")
    parser.add_argument("--density", type=positive, default=2700.0,
                        help="of the solid [kg/m3]: that of the spheres in FILE, as in.specimen has it (%(default)g)")
    parser.add_argument("--example", action=Example, type=pathlib.Path, metavar="FILE.stl", help="write a part to try this on, and end")
    options = parser.parse_args(arguments)
    with errors_in_one_line("body.py", "; nothing was written"):
        surface = closed_surface(read_mesh(options.part), str(options.part)).placed(options.axis, UNITS[options.unit])
        if not USUAL[0] <= surface.extents.max() <= USUAL[1]:
            print(f"WARNING: with --unit {options.unit} the part is {extents_in_words(surface.extents)}: is that its unit?", file=sys.stderr)
        print(f"{options.part}: {len(surface.triangles)} triangles, with --unit {options.unit} {extents_in_words(surface.extents)}, volume {surface.volume():.5g} m3, "
              f"cross-section at mid-length {surface.section_area(0.5 * surface.extents[0]):.5g} m2")
        if options.axis != "x":
            print(f"the axes {', '.join('xyz'[old] for old in AXES[options.axis])} of {options.part} are x, y, z of the body")
        diameter = 2 * guessed_radius(surface.volume(), options.n)
        across, where = min((surface.section_area(0.5 * surface.extents[0]) ** 0.5 / diameter, "at mid-length"),
                            (check_thickness(surface, options.n, np.random.default_rng(options.seed)), "in the thinnest section"))
        print(f"{options.n} spheres of a diameter of about {diameter:.3g} m, {across:.1f} across {where}"
              + (": below ten E and the yield stress come out low, see calibrate.py --body" if across < 10.0 else ""), flush=True)
        packing, smooth = pack(surface, options.n, options.seed, options.density, options.out)
        filled = np.sum(4.0 / 3.0 * np.pi * packing.radius**3) / surface.volume()
        print(f"solid fraction {filled:.4f}; {smooth.touching} spheres touch the surface, {100 * smooth.rms:.2f} % of a radius off it (rms), "
              f"from {100 * smooth.lowest:.1f} to {100 * smooth.highest:.1f} %")
        print(f"written: {options.out} and {options.out}.body")


if __name__ == "__main__":
    main()
