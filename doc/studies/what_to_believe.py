#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What parts of a metal of spheres do beside finite elements with the same flow curve: upsetting, imprints, gripped cylinders, torsion, V-bending, a notched bar.

Rows of potentials/metals.evp; finite elements of doc/studies/fe; bodies are others than those the rows were found on. About an hour on one core.
"""

import math
import re
from dataclasses import dataclass
from typing import Callable

from study import CHECKOUT, STUDIES, Study, mean_of, table
import numpy as np
from evp import dump, figures, specimen
from evp.calibration import MISES
from metals import METALS, targets_of
import sections

POTENTIALS = CHECKOUT / "potentials" / "metals.evp"
REGIONS = CHECKOUT / "lammps_inputs" / "regions"
STEEL, ALUMINIUM = "steel_304", "aluminium_2024T351"
COPPER = f"{POTENTIALS}:copper_taylor"
LENGTH, FOOT = 0.0214, 0.0071  # [m] of the Taylor bar of 32.4 x 6.4 mm at 227 m/s, foot radius; the usual benchmark
SEEDS = (11, 12)  # of bodies
MORE_SEEDS = (11, 12, 13, 14)  # where bodies differ by a tenth
SECTORS = 8  # of the foot, each with its outermost sphere
LIMITS = (5.0, 8.0)  # [%]
BAR, FREE = 0.0125, 0.04  # radius and free length [m] of gripped cylinders
RIM, FAR = (0.004, 0.014), (0.018, 0.024)  # [m] from the axis of an imprint: where rings begin among which is the rim, and where the surface has not moved
OUTSIDE = (0.0075, 0.024)  # [m] from the axis, outside of the imprint
PICTURES = {"upsetting, friction 0.1": "upsetting", "imprint of a ball": "imprint", "V-bending": "v_bending"}  # names of files, by operation
ELASTIC, ALPHA = 6e-4, 1.5  # yield strain of 304, alpha of its row
INNER = 2.0  # spheres are inner ones that are farther from the surface, in mean diameters


@dataclass(frozen=True)
class Part:
    """An operation on a metal: how it is measured, what it is compared with, and where (in the unit of the first column of the reference).

    measure(study, part, seed, spheres) gives the travel and the load, both in the units of the reference."""

    operation: str
    metal: str
    reference: str  # a CSV of doc/studies/fe; empty: closed form
    unit: str  # of the travel, with its name
    columns: tuple
    points: tuple
    measure: Callable
    spheres: tuple = (2000,)  # numbers of them
    friction: float = 0.0
    lengths: tuple = ()  # of the body [m]
    seeds: tuple = SEEDS

    @property
    def row(self):
        return f"{POTENTIALS}:{self.metal}"

    def curve(self):
        """(travel, load) of the reference, on its way there."""
        if not self.reference:
            angles = np.linspace(0.0, max(self.points), 200)
            return angles, np.array([torque(targets_of(METALS[self.metal]), angle) for angle in angles])
        read = read_reference(self)
        travel, load = (np.abs(read[column]) for column in self.columns)
        there = int(np.argmax(travel)) + 1
        return np.append(0.0, travel[:there]), np.append(0.0, load[:there])


def torque(targets, angle):
    """[N m] of a round bar of FREE by BAR twisted by an angle: the flow curve by von Mises at each radius, elastic part included."""
    r = (np.arange(500) + 0.5) / 500 * BAR
    shear_modulus = targets.modulus / (2.0 * (1.0 + targets.nu))
    stress = np.geomspace(1.0, 3e9, 3000)  # shear stress, and the strain at which it is reached
    plastic = np.append(np.geomspace(1e-7, 20.0, 4000), 100.0)
    flow = targets.curve.at(plastic) / MISES
    strain = stress / shear_modulus + MISES * np.interp(stress, flow, plastic, left=0.0)
    return 2.0 * math.pi * np.sum(np.interp(angle * r / FREE, strain, stress) * r**2) * BAR / 500


def body_of(study, part, seed, spheres, **choices):
    """The data file of a body, and the name of its runs."""
    name = "_".join([*re.findall(r"[a-z]+", part.operation.lower())[:2], *(f"{1e3 * length:g}" for length in part.lengths), str(spheres), str(seed)])
    return study.runs.body(name, n=spheres, seed=seed, **choices), f"{name}_{part.metal}_{part.friction:g}"


def upset(study, part, seed, spheres):
    length, radius = part.lengths
    body, name = body_of(study, part, seed, spheres, length=length, radius=radius)
    study.runs.run("in.upset", name, study.ranks, specimen=body, material=part.row, contact="join", friction=part.friction, strain=0.5)
    read = study.runs.curve(name, "strain", "force_lower", "force_upper")
    study.shapes["barrel"][part, spheres, seed] = 1e3 * radius * barrel(study, body, name)
    study.shapes["volume"][part, spheres, seed] = inner_volume(study, body, name)
    study.shapes["plastic"][part, spheres, seed] = plastic_shares(study, name)
    study.states[part, spheres, seed] = study.runs.folder / f"{name}_state.dump"
    return read["strain"], 0.5 * (read["force_lower"] + read["force_upper"])


def imprint(study, part, seed, spheres):
    body, name = body_of(study, part, seed, spheres, shape="block", length=0.02, width=0.05, height=0.05)
    text = study.runs.run("in.indent", name, study.ranks, specimen=body, material=part.row, plasticity="isotropic", contact="join", tool_radius=0.015, depth=0.0015)
    study.shapes["recovery"][part, spheres, seed] = 100.0 - float(re.search(r"released: an imprint of .*, (\S+) % of the depth", text)[1])
    study.shapes["rim"][part, spheres, seed] = rim(study, part, body, name)
    study.states[part, spheres, seed] = study.runs.folder / f"{name}_state.dump"
    read = study.runs.curve(name, "depth", "force")
    there = int(np.argmax(read["depth"])) + 1
    return 1e3 * read["depth"][:there], read["force"][:there]


def grip(study, part, seed, spheres):
    body, name = body_of(study, part, seed, spheres, length=0.05, radius=BAR)
    way = -1.0 if "compression" in part.operation else 1.0
    study.runs.run("in.quasistatic", f"{name}_{way:+g}", study.ranks, specimen=body, material=part.row, plasticity="isotropic", contact="join", strain=way * part.points[-1], increment=0.01)
    read = study.runs.curve(f"{name}_{way:+g}", "strain", "stress_grip")
    return np.abs(read["strain"]), np.abs(read["stress_grip"]) * math.pi * BAR**2


def notched(study, part, seed, spheres):
    body, name = body_of(study, part, seed, spheres, shape="region", region=REGIONS / "notched.lmp", length=0.05, width=0.022, height=0.012)
    study.runs.run("in.quasistatic", f"{name}_pulled", study.ranks, specimen=body, material=part.row, plasticity="isotropic", contact="join", strain=part.points[-1], increment=0.001)
    read = study.runs.curve(f"{name}_pulled", "strain", "stress_grip")
    return read["strain"], read["stress_grip"] * specimen.read_body(study.runs.folder / body)["area"]


def twist(study, part, seed, spheres):
    body, name = body_of(study, part, seed, spheres, length=0.05, radius=BAR)
    study.runs.run("in.torsion", f"{name}_twisted", study.ranks, specimen=body, material=part.row, plasticity="isotropic", contact="join", angle=part.points[-1], increment=0.02)
    read = study.runs.curve(f"{name}_twisted", "angle", "torque_grip")
    return read["angle"], read["torque_grip"]


def bend(study, part, seed, spheres):
    body, name = body_of(study, part, seed, spheres, shape="block", length=0.06, width=0.02, height=0.008)
    text = study.runs.run("in.vbend", name, study.ranks, specimen=body, material=part.row, contact="join", travel=0.008)
    bent, left = map(float, re.search(r"bent by (\S+) degrees, released (\S+) are left", text).groups())
    study.shapes["springback"][part, spheres, seed] = bent - left
    study.states[part, spheres, seed] = study.runs.folder / f"{name}_state.dump"
    read = study.runs.curve(name, "travel", "force_punch")
    return 1e3 * read["travel"], read["force_punch"]


def inner_volume(study, body, name):
    """Change [%] of the volume of the inner spheres' Voronoi cells, by a load and its release."""
    from scipy.spatial import ConvexHull, Voronoi

    def volumes(x):
        cells = Voronoi(x)
        return np.array([np.nan if -1 in (region := cells.regions[k]) or not region else ConvexHull(cells.vertices[region]).volume for k in cells.point_region])

    start = specimen.read_data(study.runs.folder / body)
    x = np.asarray(start.x)
    size = 2.0 * np.mean(start.radius)
    low, high = x[:, 0].min() + INNER * size, x[:, 0].max() - INNER * size
    r = np.hypot(x[:, 1], x[:, 2])
    inner = (x[:, 0] > low) & (x[:, 0] < high) & (r < r.max() - INNER * size)
    before, after = (volumes(place)[inner] for place in (x, dump.last_positions(study.runs.folder / f"{name}_state.dump")))
    kept = np.isfinite(before) & np.isfinite(after)
    return 100.0 * (after[kept].sum() / before[kept].sum() - 1.0)


def plastic_shares(study, name, shares=(0.1, 0.9)):
    """Plastic strains that shares of the volume of the spheres are below."""
    last = dump.index([study.runs.folder / f"{name}_state.dump"])[-1].read()
    order = np.argsort(last["plastic_strain"])
    volume = np.cumsum(last["radius"][order] ** 3)
    return last["plastic_strain"][order][np.searchsorted(volume, np.array(shares) * volume[-1])]


def barrel(study, body, name):
    """Radius of the middle of an upset cylinder over that at the start: of the disc with the mean square distance of its spheres from the axis."""
    start = specimen.read_data(study.runs.folder / body)
    squares = []
    for x in (np.asarray(start.x), dump.last_positions(study.runs.folder / f"{name}_state.dump")):
        middle = np.abs(x[:, 0] - 0.5 * (x[:, 0].min() + x[:, 0].max())) < 2.0 * np.mean(start.radius)
        squares.append(np.mean(x[middle, 1] ** 2 + x[middle, 2] ** 2))
    return math.sqrt(squares[1] / squares[0])


def rim(study, part, body, name):
    """Of an imprint, each of spheres and of finite elements: height [mm] of the rim, the highest mean of the surface in rings as wide as a sphere, over that far from the axis; volume
    [mm3] that has risen outside of the imprint; and by how much [mm3] the volume of the body has changed, 0 of finite elements."""
    start = specimen.read_data(study.runs.folder / body)
    last = dump.index([study.runs.folder / f"{name}_state.dump"])[-1].read()
    x, size = np.asarray(start.x), 2.0 * np.mean(start.radius)
    top = x[:, 0] > x[:, 0].max() - 0.5 * size
    risen, r = (last["x"] - x[:, 0])[top], np.hypot(last["y"], last["z"])[top]
    rings = [FAR, *((a, a + size) for a in np.arange(*RIM, size / 2))]
    beyond = np.linspace(*OUTSIDE, 1 + round((OUTSIDE[1] - OUTSIDE[0]) / size))
    outside = list(zip(beyond, beyond[1:]))
    areas = np.array([1e6 * math.pi * (outer**2 - inner**2) for inner, outer in outside])

    def of_spheres(among):
        return 1e3 * np.array([risen[(r >= inner) & (r < outer)].mean() for inner, outer in among])

    def of_elements(among):
        return sections.mean_in_rings(*section_of(part).top(), 1e3 * np.array(among))

    heights = [of(rings) for of in (of_spheres, of_elements)]
    volume = 1e9 * specimen.read_body(study.runs.folder / body)["volume"]
    return {"rim [mm]": [max(means[1:]) - means[0] for means in heights], "volume of the rim [mm3]": [of(outside) @ areas for of in (of_spheres, of_elements)],
            "change of the body's volume [mm3]": [volume * np.average(last["volume_strain"], weights=last["radius"] ** 3), 0.0]}


def section_of(part):
    """Cells of the finite elements at the end."""
    return sections.read_cells(STUDIES / "fe" / part.reference.replace(".csv", "_section.csv"))


def squat_controls(study):
    """Differences [%] of the force on a squat cylinder from finite elements with friction, at a reduction of 0.1: without friction, slowly, and of the flow curve alone."""
    part = next(part for part in parts_of(study) if "squat" in part.operation)
    targets, (length, radius), at = targets_of(METALS[part.metal]), part.lengths, 0.1
    body, _ = body_of(study, part, SEEDS[0], 2000, length=length, radius=radius)
    loads = {"curve": 1e-6 * targets.curve.true_stress(-math.log(1.0 - at), targets.modulus)[0] * math.pi * (1e3 * radius) ** 2 / (1.0 - at)}
    for name, choices in (("frictionless", {"friction": 0}), ("slow", {"friction": part.friction, "speed": 2})):
        study.runs.run("in.upset", f"squat_{name}", study.ranks, specimen=body, material=part.row, contact="join", strain=0.15, **choices)
        read = study.runs.curve(f"squat_{name}", "strain", "force_lower", "force_upper")
        loads[name] = np.interp(at, read["strain"], 0.5 * (read["force_lower"] + read["force_upper"]))
    return {name: f"{100.0 * (load / np.interp(at, *part.curve()) - 1.0):+.0f}" for name, load in loads.items()}


def off_at(part, travel, load, reference):
    """Differences [%] from the reference, of means over a twentieth of the last point around each of the points."""
    half, found = part.points[-1] / 40.0, []
    for point in part.points:
        near = np.abs(travel - point) <= half if (np.abs(travel - point) <= half).any() else np.abs(travel - point) == np.abs(travel - point).min()
        found.append(100.0 * (load[near].mean() / np.interp(travel[near], *reference).mean() - 1.0))
    return np.array(found)


def range_within(points, off, limit):
    """The longest run of points within a limit, as text."""
    best, begun = (0, 0), None
    for k, good in enumerate([*(np.abs(off) <= limit), False]):
        begun = k if good and begun is None else begun
        if not good and begun is not None:
            best, begun = max(best, (k - begun, begun)), None
    count, first = best
    return "-" if count == 0 else f"{points[first]:g} to {points[first + count - 1]:g}"


def parts_of(study):
    upsets = dict(unit="reduction of the height", columns=("reduction", "force"), points=(0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.49), measure=upset, lengths=(0.03, 0.01))
    imprints = dict(unit="depth [mm]", columns=("depth", "force"), points=(0.3, 0.6, 0.9, 1.2, 1.47), measure=imprint, spheres=tuple(study.plates), seeds=MORE_SEEDS)
    grips = dict(unit="strain of the grips", columns=("strain", "force"), measure=grip)
    return [
        Part("upsetting, friction 0.1", STEEL, "upset_steel_304_mu0.1.csv", spheres=tuple(study.spheres), friction=0.1, **upsets),
        Part("upsetting, friction 0.3", STEEL, "upset_steel_304_mu0.3.csv", friction=0.3, **upsets),
        Part("upsetting, friction 0.1", ALUMINIUM, "upset_aluminium_2024T351_mu0.1.csv", friction=0.1, **upsets),
        Part("upsetting, squat, friction 0.1", STEEL, "upset_squat_steel_304_mu0.1.csv", spheres=tuple(study.spheres), friction=0.1,
             **{**upsets, "lengths": (0.015, 0.01), "points": upsets["points"][:-1]}),
        Part("imprint of a ball", STEEL, "imprint_steel_304.csv", **imprints),
        Part("imprint of a ball", ALUMINIUM, "imprint_aluminium_2024T351.csv", **imprints),
        Part("tension, gripped", STEEL, "tension_steel_304.csv", points=(0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5), **grips),
        Part("compression, gripped", STEEL, "compression_steel_304.csv", points=(0.02, 0.05, 0.1, 0.2, 0.3, 0.35, 0.4), **grips),
        Part("torsion, gripped", STEEL, "", "angle [rad]", (), (0.02, 0.05, 0.1, 0.2, 0.4), twist),
        Part("V-bending", STEEL, "vbend_steel_304.csv", "travel [mm]", ("travel", "force"), (1.0, 2.0, 3.0, 4.0, 6.0, 7.8), bend),
        Part("notched bar", STEEL, "notched_bar_steel_304.csv", "strain of the grips", ("strain", "force"), (0.005, 0.01, 0.02, 0.03, 0.05), notched, spheres=tuple(study.plates)),
    ]


def taylor(study, spheres, contact):
    """Cells of the bar."""
    body = study.runs.body(f"bar_{spheres}", n=spheres, length=0.0324, radius=0.0032, density=8930)
    text = study.runs.run("in.taylor", f"taylor_{contact}_{spheres}", study.ranks, specimen=body, material=COPPER, contact=contact, speed=227)
    length, disc = map(float, re.search(r"final length (\S+) m, foot radius (\S+) m", text).groups())
    x = dump.last_positions(study.runs.folder / f"taylor_{contact}_{spheres}_state.dump")
    radius = specimen.read_data(study.runs.folder / body).radius
    sector = np.floor((np.arctan2(x[:, 2], x[:, 1]) / math.pi + 1.0) * 0.5 * SECTORS).astype(int) % SECTORS
    foot = np.mean([np.max((np.hypot(x[:, 1], x[:, 2]) + radius)[sector == k]) for k in range(SECTORS)])
    return [contact, spheres, f"{1e3 * length:.2f}", f"{100 * (length / LENGTH - 1):+.1f}", f"{1e3 * foot:.2f}", f"{100 * (foot / FOOT - 1):+.1f}", f"{1e3 * disc:.2f}"]


def moduli(study, spheres, seed):
    """Young's and the shear modulus of a gripped cylinder over those of its row, less 1 [%]: stresses through its middle, over the strain and the twist there; and how much larger
    than 1 the bonds of the middle make them [%]: there are more of them than of the whole body, and those at the surface lie along it, but nothing bears as far out as the radius.

    With bonds of stiffness k and length l along n, summed over the middle, E goes as the sum of k l^2 nx^4, and G, as torsion has it, as that of k l^2 nt^2 nx^2 r^2, t around the axis."""
    targets = targets_of(METALS[STEEL])
    shear_modulus = targets.modulus / (2.0 * (1.0 + targets.nu))
    body = study.runs.body(f"moduli_{spheres}_{seed}", n=spheres, seed=seed, density=targets.density, length=0.05, radius=BAR)
    material = {"specimen": body, "material": f"{POTENTIALS}:{STEEL}"}
    strain, angle = 0.5 * ELASTIC, 0.5 * ELASTIC * FREE / BAR
    study.runs.run("in.quasistatic", f"pulled_{spheres}_{seed}", study.ranks, **material, strain=strain, increment=0.5 * strain)
    study.runs.run("in.torsion", f"turned_{spheres}_{seed}", study.ranks, **material, angle=angle, increment=0.5 * angle)
    pulled, turned = (study.runs.curve(f"{name}_{spheres}_{seed}", *columns) for name, columns in (("pulled", ("stress_virial", "strain_gauge")), ("turned", ("torque_virial",))))
    start = specimen.read_data(study.runs.folder / body)
    x, end = np.asarray(start.x), dump.last_positions(study.runs.folder / f"turned_{spheres}_{seed}_state.dump")
    middle = (np.abs(x[:, 0] - 0.025) < 0.01) & (np.hypot(x[:, 1], x[:, 2]) > 0.3 * BAR)
    turns = (x[:, 1] * (end - x)[:, 2] - x[:, 2] * (end - x)[:, 1]) / (x[:, 1] ** 2 + x[:, 2] ** 2)  # small angles
    twist_rate = abs(np.polyfit(x[middle, 0], turns[middle], 1)[0])
    found = (pulled["stress_virial"][-1] / pulled["strain_gauge"][-1] / targets.modulus,
             abs(turned["torque_virial"][-1]) / (0.5 * math.pi * BAR**4 * twist_rate) / shear_modulus)
    i, j = specimen.pairs_within(start, ALPHA)[0].T
    apart, place = x[j] - x[i], 0.5 * (x[i] + x[j])
    square, r = np.sum(apart**2, axis=1), np.hypot(place[:, 1], place[:, 2])
    along, around = apart[:, 0] ** 2 / square, (place[:, 1] * apart[:, 2] - place[:, 2] * apart[:, 1]) ** 2 / (r**2 * square)
    inside = np.abs(place[:, 0] - 0.025) < 0.01
    uniform = 0.4 * square.sum()  # two fifths of the length have two fifths of the bonds
    by_bonds = (5.0 * np.sum((square * along**2)[inside]) / uniform, 30.0 * np.sum((square * along * around * r**2)[inside]) / (uniform * BAR**2))
    return [100.0 * (value - 1.0) for value in (*found, *by_bonds)]


def scene(part, state):
    """Spheres of a state and cells of a section, (left, right, low, high) of the picture, tools as they are at the end of the load, and what is left and right of the axis [mm]."""
    cells = section_of(part)
    if part.measure is upset:
        length, radius = (1e3 * size for size in part.lengths)
        end, wide, high = 0.25 * length, 1.7 * radius, 0.3 * length  # pressed by half
        plates = [np.array([(-wide, way * end), (wide, way * end), (wide, way * high), (-wide, way * high)]) for way in (-1, 1)]
        return sections.read_discs(state, "y", "x", zero=(0.0, None)), cells.mirrored((1, -1)), (-wide, wide, -high, high), plates, "from the axis [mm]"
    if part.measure is imprint:
        return sections.read_discs(state, "y", "x", zero=(0.0, 0.02)), cells, (-15.0, 15.0, -12.0, 2.5), [((0.0, 15.0 - 1.5), 15.0)], "from the axis [mm]"
    tools = [((0.0, 4.0), 4.0), ((-24.0, -4.0), 4.0), ((24.0, -4.0), 4.0)]  # the punch is 8 mm below the upper face
    return sections.read_discs(state, "x", "z", zero=(0.03, -0.004)), sections.Cells(cells.layer, cells.corners * (-1, 1), cells.plastic), (-32.0, 32.0, -10.0, 13.0), tools, "from mid-length [mm]"


def draw(study, name, part, reference, found):
    """figures/what_to_believe_NAME.png: load over travel of both codes, and the section of each; found: {spheres: (travel, load)}. The CSV has the curves, and the spheres of the
    section; doc/studies/fe has the cells."""
    with figures.plt.rc_context(figures.LOOK):
        figure, (left, right) = figures.plt.subplots(1, 2, figsize=(13.5, 4.2), width_ratios=(1.0, 2.0), layout="constrained")
        left.plot(reference[0], reference[1] / 1e3, color="black", linewidth=1.4, label="finite elements")
        rows = [("finite elements", f"{a:.6g}", f"{b:.6g}", "", "") for a, b in zip(*reference)]
        for k, (spheres, (travel, load)) in enumerate(found.items(), start=1):
            left.plot(travel, load / 1e3, label=f"{spheres} spheres", **figures.line_style(k))
            rows += [(f"{spheres} spheres", f"{a:.6g}", f"{b:.6g}", "", "") for a, b in zip(travel, load)]
        left.set(xlim=(0, None), ylim=(0, None), xlabel=part.unit, ylabel="force [kN]")
        left.legend()
        discs, cells, window, tools, across = scene(part, study.states[part, max(found), SEEDS[0]])
        sections.draw(right, discs, cells, window, tools, across)
        right.set_title(f"{max(found)} spheres (dotted: finite elements)", loc="left", fontsize=11)
        right.set_title("finite elements", loc="right", fontsize=11)
        rows += [("section", f"{x:.4f}", f"{y:.4f}", f"{radius:.4f}", f"{p:.4g}") for (x, y), radius, p in zip(*discs)]
        study.save(figure, ("curve", "travel or x_mm", "force_N or y_mm", "radius_mm", "plastic_strain"), rows, f"_{name}")


def main(words=None):
    with Study(__doc__, "what_to_believe", spheres=[2000, 8000], plates=[4000], bars=[2000], rods=[2000, 16000], ranks=1).started(words) as study:
        study.shapes, study.states = {name: {} for name in ("barrel", "volume", "plastic", "recovery", "rim", "springback")}, {}
        verdicts, tables, drawn = [], {}, {}
        jobs = [(part, spheres) for part in parts_of(study) for spheres in part.spheres]
        for part, spheres in study.each(jobs, lambda job: f"{job[0].operation}, {job[0].metal}, {job[1]} spheres", lambda job: len(job[0].seeds) * job[1] ** 1.3):
            reference = part.curve()
            runs = [part.measure(study, part, seed, spheres) for seed in part.seeds]
            each = np.array([off_at(part, *run, reference) for run in runs])
            off = each.mean(axis=0)
            worst = int(np.argmax(np.abs(off)))
            title = METALS[part.metal].title
            verdicts.append((part.operation, title, spheres, f"{part.points[0]:g} to {part.points[-1]:g}, {part.unit}", *(range_within(part.points, off, limit) for limit in LIMITS),
                             f"{off[worst]:+.1f} at {part.points[worst]:g}", f"{np.abs(each - off).max():.1f}"))
            tables.setdefault((part.unit, part.points), []).append((part.operation, title, spheres, *(f"{value:+.1f}" for value in off)))
            if part.operation in PICTURES and part.metal == STEEL:
                drawn.setdefault(part, (PICTURES[part.operation], reference, {}))[2][spheres] = runs[0]
        for part, (name, reference, found) in drawn.items():
            draw(study, name, part, reference, found)
        details = "\n\n".join("\n".join(table(("operation", "metal", "spheres", *(f"{point:g}" for point in points[:-1]), f"{points[-1]:g} ({unit})"), rows))
                              for (unit, points), rows in tables.items())
        shapes, back = [], []  # back: what springs back, over that of finite elements
        for part, spheres in jobs:
            chosen = {name: [found[part, spheres, seed] for seed in part.seeds] for name, found in study.shapes.items() if (part, spheres, part.seeds[0]) in found}
            what = (part.operation, METALS[part.metal].title, spheres)
            fe = read_reference(part) if part.reference else {}
            if "barrel" in chosen and fe["reduction"][-1] == 0.5:
                shapes.append((*what, "radius of the middle, pressed by half [mm]", mean_of(chosen["barrel"], ".2f"), f"{np.interp(0.5, fe['reduction'], fe['radius_middle']):.2f}"))
                shapes.append((*what, "plastic strain, 10 and 90 % of the volume are below", *("{:.2f}, {:.2f}".format(*ends) for ends in (
                    np.mean(chosen["plastic"], axis=0), [np.interp(0.5, fe["reduction"], fe[f"p_{share}"]) for share in (10, 90)]))))
            if "volume" in chosen:
                shapes.append((*what, "volume of inner spheres, released [%]", mean_of(chosen["volume"], ".2f"), "0"))
            if "rim" in chosen:
                for which, form in (("rim [mm]", ".3f"), ("volume of the rim [mm3]", ".1f"), ("change of the body's volume [mm3]", ".1f")):
                    spheres_own, fe_own = zip(*(found[which] for found in chosen["rim"]))
                    shapes.append((*what, which.replace(" [", ", released ["), mean_of(spheres_own, form), f"{np.mean(fe_own):{form}}"))
                shapes.append((*what, "recovery of the depth [%]", mean_of(chosen["recovery"], ".1f"), f"{recovery_of(fe):.1f}"))
                back.append(np.mean(chosen["recovery"]) / recovery_of(fe))
            if "springback" in chosen:
                angles = fe["angle"]
                shapes.append((*what, "springs back [degrees]", mean_of(chosen["springback"], ".2f"), f"{angles.max() - angles[-1]:.2f}"))
                back.append(np.mean(chosen["springback"]) / (angles.max() - angles[-1]))
        bars = [taylor(study, spheres, contact) for spheres in study.each(study.bars, lambda n: f"bar of {n}", lambda n: n**1.3) for contact in ("repulsive", "join")]
        elastic = []
        for spheres in study.each(study.rods, lambda n: f"moduli of {n}", lambda n: n**1.3):
            found = np.array([moduli(study, spheres, seed) for seed in SEEDS]).T
            elastic += [(name, spheres, *(f"{np.mean(values):+.1f} +- {np.ptp(values) / 2:.1f}" for values in (off, by_bonds))) for name, off, by_bonds in zip(("E", "G"), found[:2], found[2:])]
        more, squat = [100.0 * (ratio - 1.0) for ratio in back], squat_controls(study)
        study.write(details=details, seeds=str(len(SEEDS)), more_seeds=str(len(MORE_SEEDS)), back=f"{min(more):.0f} to {max(more):.0f}",
                    squat_curve=squat["curve"], squat_frictionless=squat["frictionless"], squat_slow=squat["slow"],
                    verdicts=(("operation", "metal", "spheres", "from, to", *(f"within {limit:g} %" for limit in LIMITS), "largest difference [%]", "bodies differ by +-"), verdicts),
                    shapes=(("operation", "metal", "spheres", "", "spheres: mean (bodies)", "finite elements"), shapes),
                    elastic=(("modulus", "spheres", "off the row [%]", "by the bonds of the middle [%]"), elastic),
                    bars=(("contact", "N", "length [mm]", "off [%]", "foot radius [mm]", "off [%]", "as a disc [mm]"), bars))


def read_reference(part):
    """The columns of the CSV of a part."""
    lines = [line for line in (STUDIES / "fe" / part.reference).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True)


def recovery_of(fe):
    """[%] of the depth that springs back: where the force of the way back ends."""
    turn = int(np.argmax(fe["depth"]))
    free = np.flatnonzero(fe["force"][turn:] <= 0.001 * fe["force"][turn])
    left = fe["depth"][turn + free[0]] if len(free) else fe["depth"][-1]
    return 100.0 * (1.0 - left / fe["depth"][turn])


if __name__ == "__main__":
    main()
