# SPDX-License-Identifier: GPL-2.0-only
"""A packing of spheres within a closed surface: in.specimen between points of the surface, and how smooth it came out."""

import pathlib
import re
import tempfile
from typing import NamedTuple

import numpy as np

from .report import all_or_nothing
from .run import Job, RunError, run_jobs
from .specimen import read_data

FILL = 0.57  # about what the spheres fill of a part: for the first guess of their radius
SPACING = 0.25  # of the points of the surface, over the mean radius: a sphere sinks in by 1 to 2 % of its radius in the mean, 5 % at most
FIRST = 0.45  # of the time of a packing: until its first line
ACROSS = 3.0  # spheres at least, side by side in the thinnest section
TOUCHING = 0.02  # over the mean radius: spheres nearer to the surface than that are held by it
LOST = 0.2  # a sphere this share of its radius beyond the surface is no part of the body


class Smoothness(NamedTuple):
    """Of the spheres that touch the surface: how far they reach beyond it, over the mean radius; negative: they stay within."""

    touching: int
    rms: float
    lowest: float
    highest: float


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
    return FIRST + (1.0 - FIRST) * float(found[-1]) / 100.0 if found else 0.0


def pack(surface, spheres, seed, density, out, cores=None):
    """Packs spheres into a Surface [m] and writes the data file out and out.body; gives its Specimen and Smoothness.

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
        smooth = smoothness(surface, packing)
        text = (folder / "packed.data").read_text(encoding="utf-8").replace("2 atom types", "1 atom types", 1)
        body = (folder / "packed.data.body").read_text(encoding="utf-8").replace("packed.data", out.name)
        with all_or_nothing(out.parent) as place:
            (place / out.name).write_text(text, encoding="utf-8")
            (place / f"{out.name}.body").write_text(body, encoding="utf-8")
    return packing, smooth


def smoothness(surface, packing):
    """Smoothness of a packing within a Surface; RunError where a sphere has left it."""
    mean = packing.radius.mean()
    beyond = (packing.radius - surface.depth(packing.x)) / mean
    if (beyond > LOST).any():
        raise RunError(f"{np.sum(beyond > LOST)} spheres have left the surface, one by {beyond.max():.2f} mean radii: give a larger --n, or another --seed")
    near = beyond[beyond > -TOUCHING]
    return Smoothness(len(near), float(np.sqrt(np.mean(near**2))), float(near.min()), float(near.max()))
