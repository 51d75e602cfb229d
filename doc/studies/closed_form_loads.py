#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Torsion and three-point bending against G J/L and Timoshenko's beam, over the number of spheres.

Round and rectangular bars of constant size with increasing numbers of spheres: Young's modulus by in.quasistatic, torsion by
in.torsion, bending by in.bending, all within the elastic range.
"""

import statistics
from typing import NamedTuple

from study import Study, mean_of, tangent
import numpy as np
import loads
from evp import dump, specimen

ROUND = {"length": 0.1, "radius": 0.02}  # [m]
BAR = {"shape": "block", "length": 0.1, "width": 0.01, "height": 0.02}
SPAN = 0.8 * BAR["length"]
FREE_LENGTH = 0.8 * ROUND["length"]  # between the grips
STRAIN = 2e-4  # of the farthest fibre at the end: the tangent at no strain is extrapolated
WITHIN = 0.05  # of the closed form: wanted
ENDS = np.array([0.15, 0.85])  # of the length: bonds between them are those of a body
ZONE = 1.5  # bonds are pairs within this times R_i + R_j: alpha of in.quasistatic's coefficients


class Found(NamedTuple):
    """Of one N and seed. Moduli [Pa]; the others are stiffness measured over that of the closed form, and what the bonds give for it."""

    round_modulus: float
    torsion: float
    torsion_bonds: float
    bar_modulus: float
    bending: float
    bending_bonds: float
    nu: float  # of the round bar in tension


def stiffness(runs, deck, name, data, x, y, **choices):
    """dy/dx at the start of an elastic run."""
    runs.run(deck, name, specimen=data, contact="none", **choices)
    return tangent(runs.curve(name, x, y), x, y)


def measure(spheres, seed, runs):
    """The Found of one N and seed."""
    pull = {"strain": STRAIN, "increment": STRAIN / 2}
    name = f"round_{spheres}_{seed}"
    data = runs.body(name, n=spheres, seed=seed, **ROUND)
    round_modulus = stiffness(runs, "in.quasistatic", f"{name}_pulled", data, "strain", "stress_grip", **pull)
    at_end = dump.last_positions(runs.folder / f"{name}_pulled_state.dump")
    body = specimen.read_data(runs.folder / data)
    axial, lateral = specimen.middle_strains(body, at_end, ROUND["length"])
    angle = STRAIN * FREE_LENGTH / ROUND["radius"]
    torque = stiffness(runs, "in.torsion", f"{name}_twisted", data, "angle", "torque_grip", angle=angle, increment=angle / 2)
    twisted = torque / loads.torque(round_modulus, ROUND["radius"], FREE_LENGTH, 1.0)
    turning = loads.torsion_share(loads.find_bonds(body, ZONE, *ENDS * ROUND["length"]), ROUND["radius"])

    name = f"bar_{spheres}_{seed}"
    data = runs.body(name, n=spheres, seed=seed, **BAR)
    bar_modulus = stiffness(runs, "in.quasistatic", f"{name}_pulled", data, "strain", "stress_grip", **pull)
    force = stiffness(runs, "in.bending", f"{name}_bent", data, "deflection", "force", strain=STRAIN, increment=STRAIN / 2)
    beam = loads.Beam(bar_modulus, BAR["width"], BAR["height"], SPAN)
    inertia = loads.bending_share(loads.find_bonds(specimen.read_data(runs.folder / data), ZONE, *ENDS * BAR["length"]), BAR["height"])
    return Found(round_modulus, twisted, turning, bar_modulus, force * beam.deflection(1.0), beam.deflection(1.0) / beam.deflection(1.0, inertia), -lateral / axial)


def trend(results, member):
    """Line through a ratio of all bodies over N^(-1/3): its value as N goes to infinity, and its slope."""
    points = [(spheres ** (-1.0 / 3.0), getattr(found, member)) for spheres, bodies in results.items() for found in bodies]
    slope, limit = np.polyfit(*zip(*points), 1)
    return limit, slope


def needed(limit, slope):
    """From which N on the line is within WITHIN, in words."""
    within = f"within {100 * WITHIN:.0f} %"
    return f"does not come {within}" if limit <= 1.0 - WITHIN else f"is {within} from about {round((slope / (1.0 - WITHIN - limit)) ** 3, -3):.0f} spheres on"


def page(results):
    """Values of the section, of {spheres: [Found of each seed]}."""
    def cell(bodies, member):
        return mean_of([getattr(found, member) for found in bodies], ".3f")

    rows = []
    for spheres, bodies in results.items():
        left = [f"{statistics.mean(getattr(found, kind) / getattr(found, f'{kind}_bonds') for found in bodies):.3f}" for kind in ("torsion", "bending")]
        rows.append([spheres, cell(bodies, "torsion"), cell(bodies, "torsion_bonds"), left[0], cell(bodies, "bending"), cell(bodies, "bending_bonds"), left[1]])
    ends = {kind: trend(results, kind) for kind in ("torsion", "torsion_bonds", "bending", "bending_bonds")}
    lines = {kind: f"{limit:.3f} - {-slope:.2f} N^(-1/3)" for kind, (limit, slope) in ends.items()}
    rows.append(["fitted line", lines["torsion"], lines["torsion_bonds"], "", lines["bending"], lines["bending_bonds"], ""])
    at_most = {kind: statistics.mean(getattr(found, kind) for found in results[max(results)]) for kind in ("torsion", "bending", "nu")}
    header = ("N", "torsion, measured", "torsion, of the bonds", "measured/bonds", "bending, measured", "bending, of the bonds", "measured/bonds")
    return {"table": (header, rows), "most": max(results), "enoughtorsion": needed(*ends["torsion"]), "enoughbending": needed(*ends["bending"]),
            "bynu": f"{100.0 * (1.0 - (1.0 + loads.NU) / (1.0 + at_most['nu'])):.1f}", **{kind: f"{value:.3f}" for kind, value in at_most.items()},
            "bar": " x ".join(f"{BAR[key]:g}" for key in ("length", "width", "height")), "span": f"{SPAN:g}", "kappa": f"{loads.KAPPA:.3f}", "strain": f"{STRAIN:g}",
            "length": ROUND["length"], "radius": ROUND["radius"]}


def main(words=None):
    results = {}
    with Study(__doc__, "closed_form_loads", "validation", spheres=[2000, 4000, 16000], seeds=2).started(words) as study:
        plan = [(spheres, seed) for spheres in sorted(study.spheres) for seed in range(1, study.seeds + 1)]
        for spheres, seed in study.each(plan, lambda case: f"{case[0]} spheres, seed {case[1]}", lambda case: case[0] ** (4.0 / 3.0)):
            results.setdefault(spheres, []).append(measure(spheres, seed, study.runs))
        study.write(seeds=study.seeds, **page(results))


if __name__ == "__main__":
    main()
