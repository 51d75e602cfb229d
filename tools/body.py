#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Packs spheres into your own part, a closed surface from a CAD program (STL), for in.traction and the other decks.

    tools/body.py part.stl --n 2000 --unit mm --axis z --out part.data
    tools/body.py lammps_inputs/dog_bone.stl ...     a part to try this on: a tension bar along z, in mm

Writes the data file --out (atom_style sphere, SI) with the part's axis along x from x = 0, and beside it OUT.body, from which the
decks read length, cross-section at mid-length, volume and density. Prints the measures of the part and the roughness of the packed surface.
lammps_inputs/in.specimen packs the spheres between fixed points of the surface. LAMMPS is the lmp of this checkout, or EVP_LMP.
Needs Open3D: apt-get install python3-open3d (Debian), or pip install open3d.
"""

import pathlib
import re
import sys
import tempfile

import evp  # noqa: F401  before numpy
import numpy as np
from evp.report import all_or_nothing, command_line, errors_in_one_line, positive, target_file, whole
from evp.run import Job, RunError, run_jobs
from evp.specimen import read_data
from evp.surface import AXES, UNITS, closed_surface, read_mesh

USUAL = 1e-4, 10.0  # [m] longest extent of a part: beyond it the unit is asked about
FILL = 0.57  # about what the spheres fill of a part: for the first guess of their radius
SPACING = 0.25  # of the points of the surface, over the mean radius: a sphere sinks in by 1 to 2 % of its radius in the mean, 5 % at most
ACROSS = 3.0  # spheres at least, side by side in the thinnest section
TOUCHING = 0.02  # over the mean radius: spheres nearer to the surface than that are held by it
LOST = 0.2  # a sphere this share of its radius beyond the surface is no part of the body


def guessed_radius(volume, spheres):
    """Mean radius of so many spheres that fill a volume."""
    return (3.0 * FILL * volume / (4.0 * np.pi * spheres)) ** (1.0 / 3.0)


def check_thickness(surface, spheres, random):
    """Spheres side by side beneath a twentieth of the surface; ValueError below three, which says how many spheres would do."""
    thin = float(np.quantile(surface.thickness(random), 0.05))
    diameter = 2.0 * guessed_radius(surface.volume(), spheres)
    if thin < ACROSS * diameter:
        needed = 6.0 * FILL * surface.volume() / (np.pi * (thin / ACROSS) ** 3)
        raise ValueError(f"--n {spheres} is too small: the thinnest section is {thin:.3g} m, and {spheres} spheres have a diameter of {diameter:.3g} m; "
                         f"{ACROSS:g} must fit side by side: give --n {int(np.ceil(1.02 * needed))} or more")
    return thin / diameter


def starting_points(surface, spheres, random):
    """Random points (N,3) within the surface, none at it."""
    clear, found = 0.5 * guessed_radius(surface.volume(), spheres), np.zeros((0, 3))
    for _ in range(1000):
        trial = surface.low + surface.extents * random.random((4 * spheres, 3))
        found = np.vstack([found, trial[surface.depth(trial) > clear]])
        if len(found) >= spheres:
            return found[:spheres]
    raise ValueError("no room for spheres within the surface: give a larger --n")


def write_start(path, inside, wall, extents):
    """The data file that in.specimen reads with shape mesh: spheres of type 1, points of the surface of type 2; radii are to come."""
    margin = 0.1 * extents.max()
    points = np.vstack([inside, wall])
    with open(path, "w", encoding="utf-8") as out:
        out.write(f"start of a packing within a surface\n\n{len(points)} atoms\n2 atom types\n\n")
        for axis, low, high in zip("xyz", points.min(axis=0) - margin, points.max(axis=0) + margin):
            out.write(f"{low:.9g} {high:.9g} {axis}lo {axis}hi\n")
        out.write("\nAtoms # sphere\n\n")
        for number, place in enumerate(points, start=1):
            out.write("{} {} {:.3g} 2700 {:.9g} {:.9g} {:.9g}\n".format(number, 1 + (number > len(inside)), 1e-3 * extents.max() / len(inside), *place))


def share_done(log):
    """0..1 of the time of a packing, from what in.specimen has printed."""
    try:
        found = re.findall(r"^Specimen of \d+ spheres: (\d+) % done", pathlib.Path(log).read_text(encoding="utf-8"), re.M)
    except OSError:
        found = []
    return 1.0 - (1.0 - float(found[-1]) / 100.0) ** 2 if found else 0.0  # the first steps take longest


def pack(surface, spheres, seed, density, out, cores=None):
    """Packs spheres into a Surface [m] and writes the data file out and out.body; gives its Specimen and smoothness().

    RunError or ValueError where it cannot be; then no file is left, and those there before stay.
    """
    random = np.random.default_rng(seed)
    check_thickness(surface, spheres, random)
    radius = guessed_radius(surface.volume(), spheres)
    length = float(surface.extents[0])
    out = pathlib.Path(out)
    with tempfile.TemporaryDirectory(prefix="evp_body_") as name:
        folder = pathlib.Path(name)
        write_start(folder / "start.data", starting_points(surface, spheres, random), surface.spread_points(SPACING * radius, random), surface.extents)
        (folder / "start.data.body").write_text(f"variable volume equal {surface.volume():.12g}\n"
                                                f"variable area equal {surface.section_area(0.5 * length):.12g}\n", encoding="utf-8")
        job = Job("packing", "in.specimen", {
            "shape": "mesh", "mesh": "start.data", "length": f"{length:.12g}", "n": spheres, "seed": seed, "density": density, "out": "packed.data"}, folder)
        job.done = lambda: share_done(job.log)
        run_jobs([job], cores, f"packing {spheres} spheres")
        packing = read_data(folder / "packed.data")
        near = smoothness(surface, packing)
        text = (folder / "packed.data").read_text(encoding="utf-8").replace("2 atom types", "1 atom types", 1)
        body = (folder / "packed.data.body").read_text(encoding="utf-8").replace("packed.data", out.name)
        with all_or_nothing(out.parent) as place:
            (place / out.name).write_text(text, encoding="utf-8")
            (place / f"{out.name}.body").write_text(body, encoding="utf-8")
    return packing, near


def smoothness(surface, packing):
    """(T,) how far the spheres that touch a Surface reach beyond it, over the mean radius; negative: they stay within. RunError where one has left it."""
    mean = packing.radius.mean()
    beyond = (packing.radius - surface.depth(packing.x)) / mean
    if (beyond > LOST).any():
        raise RunError(f"{np.sum(beyond > LOST)} spheres have left the surface, one by {beyond.max():.2f} mean radii: give a larger --n, or another --seed")
    return beyond[beyond > -TOUCHING]


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
    options = parser.parse_args(arguments)
    with errors_in_one_line("body.py", "; nothing was written"):
        surface = closed_surface(read_mesh(options.part), str(options.part)).placed(options.axis, UNITS[options.unit])
        extents = " x ".join(f"{value:.4g}" for value in surface.extents) + " m"
        if not USUAL[0] <= surface.extents.max() <= USUAL[1]:
            print(f"WARNING: with --unit {options.unit} the part is {extents}: is that its unit?", file=sys.stderr)
        print(f"{options.part}: {len(surface.triangles)} triangles, with --unit {options.unit} {extents}, volume {surface.volume():.5g} m3, "
              f"cross-section at mid-length {surface.section_area(0.5 * surface.extents[0]):.5g} m2")
        if options.axis != "x":
            print(f"the axes {', '.join('xyz'[old] for old in AXES[options.axis])} of {options.part} are x, y, z of the body")
        diameter = 2 * guessed_radius(surface.volume(), options.n)
        across, where = min((surface.section_area(0.5 * surface.extents[0]) ** 0.5 / diameter, "at mid-length"),
                            (check_thickness(surface, options.n, np.random.default_rng(options.seed)), "in the thinnest section"))
        print(f"{options.n} spheres of a diameter of about {diameter:.3g} m, {across:.1f} across {where}"
              + (": below ten E comes out a few percent off, see validation.md" if across < 10.0 else ""), flush=True)
        packing, near = pack(surface, options.n, options.seed, options.density, options.out)
        filled = np.sum(4.0 / 3.0 * np.pi * packing.radius**3) / surface.volume()
        print(f"solid fraction {filled:.4f}; {len(near)} spheres touch the surface, {100 * np.sqrt(np.mean(near**2)):.2f} % of a radius off it (rms), "
              f"from {100 * near.min():.1f} to {100 * near.max():.1f} %")
        print(f"written: {options.out} and {options.out}.body")


if __name__ == "__main__":
    main()
