#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Finite elements on parts, as references: upsetting, imprint of a ball, gripped cylinder, V-bending, a notched bar.

  parts.py                                  all, in about 20 minutes
  parts.py upset_steel_304_mu0.1            this one
  parts.py vbend_steel_304 --work runs      keeps the files of CalculiX in runs; runs that it has are not repeated

Writes NAME.csv beside this program; its header says geometry, friction, flow curve, mesh, and the result of a check of
the mesh: each case is also run with coarser elements. Of some cases also NAME_section.csv: the section of the body at
the end, in cells with their plastic strain. Needs ccx (Debian: apt-get install calculix-ccx).
"""

import argparse
import functools
import pathlib
import sys
import tempfile
import time
from typing import Callable, NamedTuple, Optional

import calculix
import numpy as np
from calculix import Mesh, graded, middles

HERE = pathlib.Path(__file__).resolve().parent
WEDGE = 180.0  # the forces of axisymmetric elements are those of a wedge of 2 degrees
HOLE = 0.02  # radius at which meshes with contact on the axis begin: an element that ends in a point has no contact


class Section(NamedTuple):
    """Cells of a section of the body at the end, a quarter of an element each, around its integration point."""

    words: str  # which section, when, and its coordinates
    titles: tuple  # of the two coordinates
    corners: np.ndarray  # (columns, layers, 4, 2) [mm]; layers from the lowest one
    plastic: np.ndarray  # (columns, layers)


class Found(NamedTuple):
    """Of a run: lines on geometry, mesh and columns for the header, and the columns {title: (n,)}; the first one is the
    displacement of the load, and one is the force [N]."""

    geometry: str
    mesh: str
    meaning: str
    columns: dict
    section: Optional[Section] = None


class Part(NamedTuple):
    """run(work, name, size) -> Found; the sizes of elements, the second one for the check of the mesh, which compares
    forces from `start` of the first column on, while the load grows."""

    metal: str
    run: Callable
    sizes: tuple
    start: float
    start_words: str


def share_below(values, weights, share):
    """The value (n,) that a share of the weights is below, of values and weights (n, m)."""
    out = []
    for value, weight in zip(values, weights):
        order = np.argsort(value)
        sums = np.cumsum(weight[order])
        out.append(value[order][np.searchsorted(sums, share * sums[-1])])
    return np.array(out)


def cells(at, plastic):
    """Corners (2 nx, 2 ny, 4, 2) and plastic strains (2 nx, 2 ny) of quadratic elements.

    at: positions (2 nx + 1, 2 ny + 1, 2) of their nodes, without those of the middles of elements; plastic (nx, ny, 4):
    of integration points, along the first direction first."""
    at = at.copy()
    edges, corners = (at[:-1:2, 1::2] + at[2::2, 1::2] + at[1::2, :-1:2] + at[1::2, 2::2],
                      at[:-1:2, :-1:2] + at[2::2, :-1:2] + at[:-1:2, 2::2] + at[2::2, 2::2])
    at[1::2, 1::2] = 0.5 * edges - 0.25 * corners  # by the functions of an element of eight nodes
    nx, ny = plastic.shape[:2]
    values = plastic.reshape(nx, ny, 2, 2).transpose(0, 3, 1, 2).reshape(2 * nx, 2 * ny)
    return np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=2), values


def positions(mesh, grid, moved, axes):
    """(..., 2) of the nodes of a grid by their displacements moved (n, 3), of a set of all of them; 0 where there is
    none."""
    at = np.zeros((*grid.shape, 2))
    there = grid > 0
    at[there] = mesh.at(grid[there])[:, axes] + moved[np.searchsorted(np.unique(grid[there]), grid[there])][:, axes]
    return at


# ---- upsetting ----

def upset(work, name, size, metal, radius, height, friction, pressed):
    """A cylinder between rigid flat plates: half of its height. Lengths [mm], pressed: largest reduction."""
    mesh, half = Mesh(), 0.5 * height
    r, z = (np.linspace(0.0, length, round(length / size) + 1) for length in (radius, half))
    r[0] = HOLE
    r, z = middles(r), middles(z)
    nodes, elements = mesh.quads("BODY", np.stack(np.meshgrid(r, z, indexing="ij"), -1))
    plate = np.meshgrid(np.linspace(0.0, 2.2 * radius, 25), half + np.linspace(0.0, 2.0, 3), indexing="ij")
    plates, faces = mesh.quads("TOOLS", np.stack(plate, -1))
    for label, own in (("TOOL", plates), ("AXIS", nodes[0]), ("MIDDLE", nodes[:, 0]), ("BELT", nodes[-1, 0]),
                       ("CORNER", nodes[-1, -1]), ("SECTION", nodes)):
        mesh.nset(label, own)
    mesh.surface("SBODY", (elements[:, -1], "S3"), (elements[-1, elements.shape[1] // 2:], "S2"))
    mesh.surface("STOOL", (faces[:, 0], "S1"))
    bounds = ["AXIS, 1, 1, 0", "MIDDLE, 2, 2, 0", "TOOL, 1, 1, 0", f"TOOL, 2, 2, {-pressed * half:.9g}"]
    prints = [("TOOL", "RF"), ("BELT", "U"), ("CORNER", "U"), ("BODY", "PEEQ"), ("BODY", "EVOL"), ("SECTION", "U")]
    found = calculix.run(work, name, [
        *mesh.cards(), *calculix.material(metal), *calculix.tool(),
        *calculix.contact([("SBODY", "STOOL")], 1e6, friction, 2e5),
        *calculix.step(50, bounds, prints, every=2)])
    times, force = found["RF", "TOOL"]
    volume = found["EVOL", "BODY"][1][:, :, 0]
    points = found["PEEQ", "BODY"][1].reshape(*volume.shape, -1)
    plastic = points.mean(axis=2)
    section = cells(positions(mesh, nodes, found["U", "SECTION"][1][-1], (0, 1)),
                    points[-1].reshape(*elements.shape, 8)[:, :, :4])
    return Found(
        f"upsetting of a cylinder, radius {radius:g} mm, height {height:g} mm, between rigid flat plates, "
        f"friction {friction:g}",
        f"CAX8R of {size:g} mm, half the height, NLGEOM, contact surface to surface, 1e6 MPa/mm; static",
        "reduction of the height, force [N], radius at mid-height [mm], radius of the corner that was at the plate "
        "[mm], plastic strain of elements: mean, 10 % and 90 % of the volume are below, largest",
        {"reduction": pressed * times, "force": -WEDGE * force[:, 0, 1],
         "radius_middle": radius + found["U", "BELT"][1][:, 0, 0],
         "radius_corner": radius + found["U", "CORNER"][1][:, 0, 0],
         "p_mean": np.sum(plastic * volume, axis=1) / np.sum(volume, axis=1),
         "p_10": share_below(plastic, volume, 0.1), "p_90": share_below(plastic, volume, 0.9),
         "p_max": plastic.max(axis=1)},
        Section(f"half of the axial section, pressed by {pressed:g} of the height; r from the axis, z from mid-height",
                ("r", "z"), *section))


# ---- imprint of a ball ----

BALL, DEPTH, THICK, HELD = 15.0, 1.5, 20.0, 2.0
DISC = float(np.sqrt(2500.0 / np.pi))  # radius: the area of a block of 50 x 50 mm
NEAR = 8.5  # radius of the fine mesh
BACK = 0.12  # share of the depth that the ball goes back


def contact_edge(gap, radius, force):
    """Radius of the contact of gaps (n,) of nodes at radii (n,), 0 without force. Beside the edge of a contact without
    friction the gap grows with the distance to the power 3/2."""
    if force <= 0.0:
        return 0.0
    k = int(np.flatnonzero(gap < 0.0).max(initial=0))
    near, far = gap[k + 1:k + 3] ** (2.0 / 3.0)
    edge = radius[k + 1] - (radius[k + 2] - radius[k + 1]) * near / (far - near)
    return float(np.clip(edge, radius[k], radius[k + 1]))


def imprint(work, name, size, metal):
    """A rigid ball without friction, pressed into a disc whose lowest layer is held, and drawn back."""
    mesh, top = Mesh(), THICK - HELD
    r = graded(DISC, size, 1.18, NEAR)
    r[0] = HOLE
    grid = np.meshgrid(middles(r), middles(top - graded(top, size, 1.18, 3.0)[::-1]), indexing="ij")
    nodes, elements = mesh.quads("BODY", np.stack(grid, -1))
    turn, along = np.meshgrid(np.radians(np.linspace(0.0, 42.0, 85)), BALL - np.array([0.0, 0.5, 1.0]), indexing="ij")
    ball, faces = mesh.quads("TOOLS", np.stack([along * np.sin(turn), top + BALL - along * np.cos(turn)], -1))
    for label, own in (("TOOL", ball), ("AXIS", nodes[0]), ("BOTTOM", nodes[:, 0]), ("SECTION", nodes)):
        mesh.nset(label, own)
    surface = mesh.at(mesh.nset("TOP", nodes[:, -1]))  # in the order of r
    mesh.surface("SBODY", (elements[:int(np.searchsorted(r, NEAR + 1.0)), -1], "S3"))
    mesh.surface("STOOL", (faces[:, 0], "S1"))
    held, prints = ["AXIS, 1, 1, 0", "BOTTOM, 1, 2, 0", "TOOL, 1, 1, 0"], [("TOOL", "RF"), ("TOP", "U")]
    prints += [("SECTION", "U"), ("BODY", "PEEQ")]
    found = calculix.run(work, name, [
        *mesh.cards(), *calculix.material(metal), *calculix.tool(), *calculix.contact([("SBODY", "STOOL")], 1e6),
        *calculix.step(50, [*held, f"TOOL, 2, 2, {-DEPTH}"], prints),
        *calculix.step(15, [f"TOOL, 2, 2, {-(1.0 - BACK) * DEPTH:.9g}"], prints)])
    times, force = found["RF", "TOOL"]
    force = -WEDGE * force[:, 0, 1]
    last = int(np.argmax((times > 1.0) & (force < 1e-3 * force.max()))) + 1  # the first one without force
    times, force, moved = times[:last], force[:last].copy(), found["U", "TOP"][1][:last, :, :2]
    force[-1] = 0.0
    depth = DEPTH * np.where(times < 1.0, times, 1.0 - BACK * (times - 1.0))
    at = surface + moved
    gap = np.hypot(at[:, :, 0], at[:, :, 1] - (top + BALL - depth[:, None])) - BALL
    contact = np.array([contact_edge(*row) for row in zip(gap, at[:, :, 0], force)])
    area = np.pi * contact**2
    section = cells(positions(mesh, nodes, found["U", "SECTION"][1][last - 1], (0, 1)) - (0.0, top),
                    found["PEEQ", "BODY"][1][last - 1].reshape(*elements.shape, 8)[:, :, :4])
    return Found(
        f"ball of radius {BALL:g} mm, rigid, no friction, pressed {DEPTH:g} mm into a disc of radius {DISC:.1f} mm "
        f"(2500 mm2), {THICK:g} mm thick, lowest {HELD:g} mm held; then drawn back until it does not touch",
        f"CAX8R of {size:g} mm near the contact, NLGEOM, contact surface to surface, 1e6 MPa/mm; static",
        "depth of the ball [mm], force [N], contact radius [mm] where the gap is zero (gap^(2/3) of the two next nodes "
        "is extrapolated), force over contact area [MPa], highest point of the surface [mm]",
        {"depth": depth, "force": force, "contact_radius": contact,
         "hardness": np.divide(force, area, out=np.zeros_like(force), where=area > 0.0),
         "pile_up": moved[:, :, 1].max(axis=1)},
        Section("half of the axial section, when the ball does not touch any more; r from the axis, z = 0 is the "
                "surface at the start",
                ("r", "z"), *section))


# ---- cylinder between grips ----

CYLINDER, FREE = 12.5, 40.0


def gripped(work, name, size, metal, strain):
    """A cylinder of 50 x 25 mm whose ends are held, a tenth of its length each: half of the length between them."""
    mesh, half = Mesh(), 0.5 * FREE
    r, z = (middles(np.linspace(0.0, length, round(length / size) + 1)) for length in (CYLINDER, half))
    nodes, _ = mesh.quads("BODY", np.stack(np.meshgrid(r, z, indexing="ij"), -1))
    for label, own in (("AXIS", nodes[0]), ("MIDDLE", nodes[:, 0]), ("GRIP", nodes[:, -1]), ("BELT", nodes[-1, 0])):
        mesh.nset(label, own)
    section = mesh.at(mesh.nset("GAUGE", nodes[:, len(z) // 2]))[:, 0]
    bounds = ["AXIS, 1, 1, 0", "MIDDLE, 2, 2, 0", "GRIP, 1, 1, 0", f"GRIP, 2, 2, {half * strain:.9g}"]
    found = calculix.run(work, name, [
        *mesh.cards(), *calculix.material(metal),
        *calculix.step(50, bounds, [("GRIP", "RF"), ("GAUGE", "U"), ("BELT", "U")])])
    times, force = found["RF", "GRIP"]
    force = WEDGE * force[:, 0, 1]
    own = section * np.concatenate([[0.5], np.ones(len(section) - 2), [0.5]])  # share of the area of a node
    moved = found["U", "GAUGE"][1][:, :, 1] @ own / own.sum()
    return Found(
        "cylinder of 50 x 25 mm, tenths of its length held at both ends: 40 mm free, radius 12.5 mm",
        f"CAX8R of {size:g} mm, half the length, NLGEOM, ends at r held; static",
        "strain of the grips (over 40 mm), force [N], force over initial area [MPa], strain of the gauge (sections at "
        "15 and 35 mm, mean by area), radius of the middle [mm]",
        {"strain": strain * times, "force": force, "stress": force / (np.pi * CYLINDER**2),
         "strain_gauge": moved / (0.5 * half), "radius_middle": CYLINDER + found["U", "BELT"][1][:, 0, 0]})


# ---- V-bending ----

LENGTH, WIDTH, SHEET, SPAN, TOOL, RUBBING, TRAVEL = 60.0, 20.0, 8.0, 0.8, 4.0, 0.05, 8.0


def arc(center_x, center_z, degrees, radii):
    """Points (turn, 3, 3, 3) of a tool; degrees from z to x; radii: lower layer, upper."""
    turn, y, radius = np.meshgrid(np.radians(degrees), np.linspace(0.0, 0.5 * WIDTH + 3.0, 3), np.linspace(*radii, 3),
                                  indexing="ij")
    return np.stack([center_x + radius * np.sin(turn), y, center_z + radius * np.cos(turn)], -1)


def vbend(work, name, size, metal):
    """A sheet on two supports, bent by a punch, three cylinders with friction, which are then taken away: a quarter.
    size: numbers of elements along half the length, half the width, the thickness."""
    mesh, half = Mesh(), 0.5 * LENGTH
    sides = (middles(np.linspace(0.0, length, count + 1)) for length, count in zip((half, 0.5 * WIDTH, SHEET), size))
    nodes, elements = mesh.bricks("BODY", np.stack(np.meshgrid(*sides, indexing="ij"), -1))
    punch, above = mesh.bricks("TOOLS", arc(half, SHEET + TOOL, np.linspace(-105.0, -205.0, 41), (TOOL, TOOL - 1.0)))
    support, below = mesh.bricks("TOOLS", arc(0.5 * (1.0 - SPAN) * LENGTH, -TOOL, np.linspace(-45.0, 75.0, 49),
                                              (TOOL - 1.0, TOOL)))
    for label, own in (("PUNCH", punch), ("SUPPORT", support), ("MIDDLE", nodes[-1]), ("SYMMETRY", nodes[:, 0])):
        mesh.nset(label, own)
    at = [mesh.at(mesh.nset(label, nodes[round(share * (len(nodes) - 1))]))
          for label, share in (("A", 0.3), ("B", 0.7))]
    mesh.surface("STOP", (elements[size[0] // 2:, :, -1], "S2"))
    mesh.surface("SLOW", (elements[:2 * size[0] // 3, :, 0], "S1"))
    mesh.surface("SPUNCH", (above[:, :, 0], "S1"))
    mesh.surface("SSUPPORT", (below[:, :, -1], "S2"))
    spring = [f"*ELEMENT, TYPE=SPRING1, ELSET=SOFT\n{mesh.elements + 1}, {nodes[-1, 0, 0]}\n*SPRING, ELSET=SOFT\n3\n2."]
    pairs, prints = [("STOP", "SPUNCH"), ("SLOW", "SSUPPORT")], [("PUNCH", "RF"), ("A", "U"), ("B", "U")]
    prints += [("SYMMETRY", "U"), ("BODY", "PEEQ")]
    bounds = ["MIDDLE, 1, 1, 0", "SYMMETRY, 2, 2, 0", "PUNCH, 1, 2, 0", f"PUNCH, 3, 3, {-TRAVEL}", "SUPPORT, 1, 3, 0"]
    found = calculix.run(work, name, [
        *mesh.cards(), *spring, *calculix.material(metal), *calculix.tool(),
        *calculix.contact(pairs, 2e5, RUBBING, 5e4), *calculix.step(50, bounds, prints, first=0.5),
        *calculix.step(1, [f"PUNCH, 3, 3, {-TRAVEL}"], prints, without=pairs)])
    times, force = found["RF", "PUNCH"]
    force = -4.0 * force[:, 0, 2]
    a, b = ((own + found["U", label][1]).mean(axis=1) for own, label in zip(at, "AB"))
    rows = np.flatnonzero((times <= 1.0) | (times == times[-1]))
    loaded, free = (positions(mesh, nodes[:, 0], found["U", "SYMMETRY"][1][row], (0, 2)) for row in rows[-2:])
    section = cells(free + loaded[-1, 0] - free[-1, 0] - (half, 0.0),
                    found["PEEQ", "BODY"][1][-1].reshape(*elements.shape, 2, 2, 2)[:, 0, :, :, 0])
    return Found(
        f"V-bending of a sheet {LENGTH:g} x {WIDTH:g} x {SHEET:g} mm, supports {SPAN * LENGTH:g} mm apart, punch and "
        f"supports cylinders of radius {TOOL:g} mm, friction {RUBBING:g}; the last row is without tools",
        "{} x {} x {} C3D20R (length x width x thickness), a quarter of the sheet, NLGEOM, contact surface to surface, "
        "2e5 MPa/mm; static".format(*size),
        "travel of the punch [mm], force of the punch [N], angle [degrees]: twice the slope between the means of the "
        "sections at 0.15 and 0.35 of the length",
        {"travel": TRAVEL * np.minimum(times, 1.0)[rows], "force": force[rows] * (times[rows] <= 1.0),
         "angle": np.degrees(2.0 * np.arctan2(a[:, 2] - b[:, 2], b[:, 0] - a[:, 0]))[rows]},
        Section("left half of the section at mid-width, when the tools are away; x = 0 is mid-length; z = 0 is the "
                "lower face at the start, and its middle is where it was at the end of the load; plastic strains are "
                f"those of integration points {0.5 * WIDTH / size[1] * (0.5 - 0.5 / 3.0 ** 0.5):.2g} mm beside it",
                ("x", "z"), *section))


# ---- notched bar ----

HALF, DEEP, ROUND, STRAIGHT = 10.0, 5.0, 1.0, 6.0  # half of the bar and of its neck, end of the notch: radius, center


def notched_grid(size):
    """Points (.., .., 2) of two grids of a quarter of the section of regions/notched.lmp, x from mid-length to the grip
    and y from the axis: around the notch, and beyond."""
    beyond = 6.0
    count = max(2, round(0.25 * np.pi * ROUND / size))
    turn = np.radians(np.linspace(-90.0, 0.0, 4 * count + 1))
    up = middles(np.linspace(STRAIGHT, HALF, count + 2))[1:]
    inner = np.concatenate([np.stack([ROUND * np.cos(turn), STRAIGHT + ROUND * np.sin(turn)], -1),
                            np.stack([np.full(len(up), ROUND), up], -1)])
    side = np.concatenate([np.linspace(0.0, STRAIGHT, 2 * count + 1), up])
    low = np.stack([np.linspace(0.0, beyond, 2 * count + 1), np.zeros(2 * count + 1)], -1)
    outer = np.concatenate([low, np.stack([np.full(len(side) - 1, beyond), side[1:]], -1)])
    away = middles(graded(1.0, size / DEEP, 1.25))[:, None, None]
    notch = inner * (1.0 - away) + outer * away
    far = middles(np.linspace(beyond, 0.5 * FREE, round((0.5 * FREE - beyond) / 1.5) + 1))
    return notch, np.stack(np.meshgrid(far, side, indexing="ij"), -1)


def notched(work, name, size, metal, strain, thick):
    """The bar of regions/notched.lmp, thick [mm]: an eighth. Tenths of its length are held at both ends."""
    mesh = Mesh()
    layers = np.linspace(0.0, 0.5 * thick, 2 * round(0.1 * thick / size) + 1)
    for points in notched_grid(size):
        grid = np.broadcast_to(points[:, :, None], (*points.shape[:2], len(layers), 2))
        upward = np.broadcast_to(layers[:, None], (*grid.shape[:3], 1))
        mesh.bricks("BODY", np.concatenate([grid, upward], -1), joined=True)
    at = np.array(mesh.nodes)
    still = ("MIDDLE", "AXIS", "SYMMETRY")
    for label, axis, value in (*((label, axis, 0.0) for axis, label in enumerate(still)), ("GRIP", 0, 0.5 * FREE)):
        mesh.nset(label, 1 + np.flatnonzero(np.isclose(at[:, axis], value)))
    for label, place in (("BELT", (0.0, DEEP, 0.0)), ("FACE", (0.0, 0.0, 0.5 * thick))):
        mesh.nset(label, 1 + np.flatnonzero(np.isclose(at, place).all(axis=1)))
    bounds = [f"{label}, {axis}, {axis}, 0" for axis, label in enumerate(still, 1)]
    bounds += [f"GRIP, {axis}, {axis}, {way:.9g}" for axis, way in ((1, 0.5 * FREE * strain), (2, 0.0), (3, 0.0))]
    found = calculix.run(work, name, [
        *mesh.cards(), *calculix.material(metal),
        *calculix.step(50, bounds, [("GRIP", "RF"), ("BELT", "U"), ("FACE", "U")], first=0.2)])
    times, force = found["RF", "GRIP"]
    force, area = 4.0 * force[:, 0, 0], 2.0 * DEEP * thick
    width, thickness = (start + found["U", label][1][:, 0, axis]
                        for label, axis, start in (("BELT", 1, DEEP), ("FACE", 2, 0.5 * thick)))
    return Found(
        f"bar of 50 x {2.0 * HALF:g} x {thick:g} mm of lammps_inputs/regions/notched.lmp, notches {HALF - DEEP:g} mm "
        f"deep and {2.0 * ROUND:g} mm wide with round ends at mid-length, tenths of its length held at both ends: "
        "40 mm free",
        f"C3D20R of {size:g} mm at the notch in {len(layers) // 2} layers, an eighth of the bar, NLGEOM, ends held "
        "across; static",
        "strain of the grips (over 40 mm), force [N], force over the initial area at mid-length [MPa], "
        f"{area:.6g} mm2, the area in FILE.body of in.specimen, half of the width of the neck at mid-thickness [mm], "
        "half of its thickness on the axis [mm]",
        {"strain": strain * times, "force": force, "stress": force / area, "half_width": width,
         "half_thickness": thickness})


# ---- the cases, and their files ----

STEEL, ALUMINIUM = "steel_304", "aluminium_2024T351"


def part(metal, run, sizes, start, words, **choices):
    """A Part, of a function and what it takes beside work, name and size."""
    return Part(metal, functools.partial(run, metal=metal, **choices), sizes, start, words)


def upsetting(metal, friction, height=30.0, pressed=0.5, sizes=(0.5, 1.0)):
    return part(metal, upset, sizes, 0.02, "a reduction of 0.02", radius=10.0, height=height, friction=friction,
                pressed=pressed)


PARTS = {
    "upset_steel_304_mu0.1": upsetting(STEEL, 0.1),
    "upset_steel_304_mu0.3": upsetting(STEEL, 0.3, sizes=(0.625, 1.0)),
    "upset_aluminium_2024T351_mu0.1": upsetting(ALUMINIUM, 0.1),
    "upset_squat_steel_304_mu0.1": upsetting(STEEL, 0.1, height=15.0, pressed=0.45),
    "imprint_steel_304": part(STEEL, imprint, (0.5, 0.7), 0.3, "a depth of 0.3 mm"),
    "imprint_aluminium_2024T351": part(ALUMINIUM, imprint, (0.5, 0.7), 0.3, "a depth of 0.3 mm"),
    "tension_steel_304": part(STEEL, gripped, (0.625, 1.25), 0.01, "a strain of 0.01", strain=0.5),
    "compression_steel_304": part(STEEL, gripped, (0.625, 1.25), 0.01, "a strain of -0.01", strain=-0.4),
    "vbend_steel_304": part(STEEL, vbend, ((20, 2, 4), (20, 1, 3)), 0.5, "a travel of 0.5 mm"),
    "notched_bar_steel_304": part(STEEL, notched, (0.2, 0.3), 0.002, "a strain of 0.002", strain=0.1, thick=10.0),
}


SECTIONS = ("upset_steel_304_mu0.1", "imprint_steel_304", "imprint_aluminium_2024T351", "vbend_steel_304")


def loading(columns):
    """Displacement (n,), without its sign, and force (n,), while the load grows."""
    x, force = abs(next(iter(columns.values()))), columns["force"]
    end = int(np.argmax(x)) + 1
    return x[:end], force[:end]


def check(own, other, start):
    """Largest difference [%] of the force of two Found from a displacement on, in the first half of the way and
    in all of it."""
    (x, force), other_force = loading(own.columns), loading(other.columns)
    off = 100.0 * abs(np.interp(x, *other_force) / force - 1.0)
    from_start = x >= start * (1.0 - 1e-6)
    return [off[from_start & (x <= share * x[-1])].max() for share in (0.5, 1.0)]


def write(name, work, solver):
    """Runs a case with both meshes, and writes its CSV."""
    one = PARTS[name]
    own, other = (one.run(work, f"{name}_{'fine' if k == 0 else 'coarse'}", size) for k, size in enumerate(one.sizes))
    half, whole = check(own, other, one.start)
    header = [own.geometry, f"{one.metal}: {calculix.metal_line(one.metal)}", f"{solver}, {own.mesh}",
              f"mesh check: with {other.mesh.partition(', ')[0]}, the force differs by at most {half:.2f} % from "
              f"{one.start_words} to half of the way, {whole:.2f} % to its end", own.meaning]
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(*own.columns.values())]
    text = "\n".join([*(f"# {line}" for line in header), ",".join(own.columns), *rows, ""])
    (HERE / f"{name}.csv").write_text(text, encoding="utf-8")
    if name in SECTIONS:
        write_section(name, own, solver)
    print(f"{name}.csv: {header[3]}", flush=True)


def write_section(name, found, solver):
    """NAME_section.csv."""
    one = found.section
    across, up = one.titles
    layers = np.broadcast_to(np.arange(one.plastic.shape[1]), one.plastic.shape)
    header = [f"{found.geometry}: {one.words}", f"{PARTS[name].metal}: {calculix.metal_line(PARTS[name].metal)}",
              f"{solver}, {found.mesh}; written by doc/studies/fe/parts.py {name}",
              "a row is a quarter of an element, around an integration point: its layer, 0 is the lowest one; its four "
              "corners [mm], from the lower one next to the start of its column; equivalent plastic strain"]
    columns = ["layer", *(f"{axis}{k}" for k in range(1, 5) for axis in (across, up)), "plastic_strain"]
    rows = [",".join([str(layer), *(f"{x:.4f}" for x in corners.ravel()), f"{plastic:.4g}"])
            for layer, corners, plastic in zip(layers.ravel(), one.corners.reshape(-1, 4, 2), one.plastic.ravel())]
    text = "\n".join([*(f"# {line}" for line in header), ",".join(columns), *rows, ""])
    (HERE / f"{name}_section.csv").write_text(text, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", metavar="NAME", help=f"of {', '.join(PARTS)}; none: all")
    parser.add_argument("--work", type=pathlib.Path, metavar="FOLDER", help="keeps runs here; else they are not kept")
    choice = parser.parse_args()
    unknown = [name for name in choice.name if name not in PARTS]
    if unknown:
        parser.error(f"unknown case {', '.join(unknown)}: give some of {', '.join(PARTS)}")
    begun = time.monotonic()
    try:
        solver = calculix.version()
        with tempfile.TemporaryDirectory() as folder:
            work = choice.work or pathlib.Path(folder)
            work.mkdir(parents=True, exist_ok=True)
            names = choice.name or list(PARTS)
            for k, name in enumerate(names, 1):
                print(f"{name}: case {k} of {len(names)}, {time.monotonic() - begun:.0f} s since the start", flush=True)
                write(name, work, solver)
    except calculix.Failed as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
