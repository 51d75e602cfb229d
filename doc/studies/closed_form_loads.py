#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Torsion and three-point bending against G J/L and Timoshenko's beam, over the number of spheres.

    doc/studies/closed_form_loads.py [--spheres 2000 4000 16000] [--seeds 2] [--work FOLDER] [--fresh] [--out doc/closed_form_loads.md]

Round and rectangular bars of constant size with increasing numbers of spheres: Young's modulus by in.quasistatic, torsion by
in.torsion, bending by in.bending, all within the elastic range. Runs that --work has already are not repeated. Uses the lmp of this
checkout, or EVP_LMP.
"""

import pathlib
import statistics
import sys
from typing import NamedTuple

from study import CHECKOUT, add_out, command_line, errors_in_one_line, pack, run, slope, table, watched, write_page
import numpy as np
import loads
from evp import dump, specimen

ROUND = {"length": 0.1, "radius": 0.02}  # [m]
BAR = {"shape": "block", "length": 0.1, "width": 0.01, "height": 0.02}
SPAN = 0.8 * BAR["length"]
FREE_LENGTH = 0.8 * ROUND["length"]  # between the grips
STRAIN = 2e-4  # of the farthest fibre at the end: the tangent at no strain is extrapolated
AT_REST = {"contact": "none", "tolerance": 1e-5}
WITHIN = 0.05  # of the closed form: wanted
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


def young(folder, name, data):
    """Young's modulus of a body [Pa]."""
    run(folder, "in.quasistatic", f"{name}_pulled", data, **AT_REST, strain=STRAIN, increment=STRAIN / 2, restart=0)
    return slope(folder, f"{name}_pulled", "strain", "stress_grip")


def bonds_of(folder, data, length):
    """The bonds of a body, its ends left out."""
    body = specimen.read_data(folder / data)
    return loads.find_bonds(body, ZONE, 0.15 * length, 0.85 * length)


def measure(spheres, seed, folder):
    """The Found of one N and seed; runs are made where the folder does not hold them."""
    name = f"round_{spheres}_{seed}"
    data = pack(folder, name, spheres, seed, ROUND)
    round_modulus = young(folder, name, data)
    at_end = dump.last_positions(folder / f"new_{name}_pulled_state.dump")
    axial, lateral = specimen.middle_strains(specimen.read_data(folder / data), at_end, ROUND["length"])
    angle = STRAIN * FREE_LENGTH / ROUND["radius"]
    run(folder, "in.torsion", f"{name}_twisted", data, **AT_REST, angle=angle, increment=angle / 2)
    twisted = slope(folder, f"{name}_twisted", "angle", "torque_grip") / loads.torque(round_modulus, ROUND["radius"], FREE_LENGTH, 1.0)
    turning = loads.torsion_share(bonds_of(folder, data, ROUND["length"]), ROUND["radius"])

    name = f"bar_{spheres}_{seed}"
    data = pack(folder, name, spheres, seed, BAR)
    bar_modulus = young(folder, name, data)
    run(folder, "in.bending", f"{name}_bent", data, **AT_REST, strain=STRAIN, increment=STRAIN / 2)
    beam = loads.Beam(bar_modulus, BAR["width"], BAR["height"], SPAN)
    bent = slope(folder, f"{name}_bent", "deflection", "force") * beam.deflection(1.0)
    inertia = loads.bending_share(bonds_of(folder, data, BAR["length"]), BAR["height"])
    return Found(round_modulus, twisted, turning, bar_modulus, bent, beam.deflection(1.0) / beam.deflection(1.0, inertia),
                 -lateral / axial)


def trend(results, member):
    """Line through a ratio of all bodies over N^(-1/3): its value as N goes to infinity, and its slope."""
    points = [(spheres ** (-1.0 / 3.0), getattr(found, member)) for spheres, bodies in results.items() for found in bodies]
    slope_, limit = np.polyfit(*zip(*points), 1)
    return limit, slope_


def needed(kind, limit, slope_):
    """Sentence: from which N on a line through the ratios is within 5 %."""
    if limit <= 1.0 - WITHIN:
        return f"By the fitted line {kind} does not come within {100 * WITHIN:.0f} %."
    return f"By the fitted line {kind} is within {100 * WITHIN:.0f} % from about {round((slope_ / (1.0 - WITHIN - limit)) ** 3, -3):.0f} spheres on."


def cell(bodies, member):
    """Mean over the seeds, and the largest departure from it."""
    values = [getattr(found, member) for found in bodies]
    mean = statistics.mean(values)
    return f"{mean:.3f}" + (f" +- {max(abs(value - mean) for value in values):.3f}" if len(values) > 1 else "")


HEAD = """# Torsion and bending against closed forms

With {most} spheres the measured stiffness is {torsion:.3f} of the closed form in torsion and {bending:.3f} in bending, with E of the same body in tension and G = 0.4 E.
{within}
Where G J or E I is needed within a few percent, multiply the closed form by the ratio of the bonds (`doc/studies/loads.py`), or measure with these decks.

The difference is mostly due to the surface and goes as N^(-1/3):

- Bonds do not reach the surface: a layer of a fraction of a diameter carries no load. In tension this reduces the area, hence radius^2, and is part of
  E; in torsion it reduces radius^4, in bending height^3. *Of the bonds* is the ratio computed from positions and directions of the bonds
  by the energy of an affine strain, without a fitted number.
- *Measured/bonds* is the rest: the strain is not affine, mostly at the surface. Of this, nu = {nu:.3f} in place of 1/4
  makes {by_nu:.1f} % in torsion.

"""

TAIL = """
Written by `{command}`. Table 1 without damping, e scaled with N, *contact none*. Torsion: a cylinder of length {length} m and radius {radius} m,
in.torsion, `torque_grip`, G J angle/free length. Bending: a block of {bar} m, in.bending, span {span:g} m, deflection
F S^3/(48 E I) + F S/(4 kappa G A) with kappa = {kappa:.3f}. E: in.quasistatic, `stress_grip`. Tangents at zero strain, from strains of the
outermost fibre up to {strain:g}. *+-*: largest difference of {seeds} packings from their mean. *Fitted line*: over N^(-1/3), through all bodies.
"""


def page(results, seeds):
    """Text of the page, of {spheres: [Found of each seed]}."""
    rows = []
    for spheres, bodies in results.items():
        left = [statistics.mean(getattr(found, kind) / getattr(found, f"{kind}_bonds") for found in bodies) for kind in ("torsion", "bending")]
        rows.append([spheres, cell(bodies, "torsion"), cell(bodies, "torsion_bonds"), f"{left[0]:.3f}",
                     cell(bodies, "bending"), cell(bodies, "bending_bonds"), f"{left[1]:.3f}"])
    ends = {kind: trend(results, kind) for kind in Found._fields} if len(results) > 1 else {}
    lines = {kind: f"{limit:.3f} - {-slope_:.2f} N^(-1/3)" for kind, (limit, slope_) in ends.items()}
    if lines:
        rows.append(["fitted line", lines["torsion"], lines["torsion_bonds"], "", lines["bending"], lines["bending_bonds"], ""])
    most = max(results)
    at_most = {kind: statistics.mean(getattr(found, kind) for found in results[most]) for kind in ("torsion", "bending", "nu")}
    head = HEAD.format(most=most, within=" ".join(needed(kind, *ends[kind]) for kind in ("torsion", "bending") if ends), **at_most,
                       by_nu=100.0 * (1.0 - (1.0 + loads.NU) / (1.0 + at_most["nu"])))
    command = f"doc/studies/closed_form_loads.py --spheres {' '.join(map(str, results))} --seeds {seeds}"
    bar = " x ".join(f"{BAR[key]:g}" for key in ("length", "width", "height"))
    tail = TAIL.format(command=command, bar=bar, span=SPAN, kappa=loads.KAPPA, strain=STRAIN, seeds=seeds, **ROUND)
    header = ("N", "torsion, measured", "torsion, of the bonds", "measured/bonds", "bending, measured", "bending, of the bonds", "measured/bonds")
    return head + "\n".join(table(header, rows)) + "\n" + tail


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--spheres", type=int, nargs="+", default=[2000, 4000, 16000], help="numbers of spheres (default 2000 4000 16000)")
    parser.add_argument("--seeds", type=int, default=2, help="packings of each number of spheres (default 2)")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "closed_form_loads", help="bodies and runs (default: %(default)s)")
    parser.add_argument("--fresh", action="store_true", help="repeat the runs that --work has already")
    add_out(parser, "closed_form_loads.md")
    options = parser.parse_args(words)
    if min(options.spheres) < 500 or options.seeds < 1:
        parser.error("--spheres must be at least 500 and --seeds at least 1")
    options.work.mkdir(parents=True, exist_ok=True)
    if options.fresh:
        for old in [*options.work.glob("*.csv"), *options.work.glob("*.body")]:
            old.unlink()
    results = {}
    with errors_in_one_line("closed_form_loads.py"):
        plan = [(spheres, seed) for spheres in sorted(set(options.spheres)) for seed in range(1, options.seeds + 1)]
        for spheres, seed in watched("closed_form_loads.py:", plan, lambda case: f"{case[0]} spheres, seed {case[1]}",
                                     lambda case: case[0] ** (4.0 / 3.0)):
            results.setdefault(spheres, []).append(measure(spheres, seed, options.work))
        write_page(options.out, page(results, options.seeds))


if __name__ == "__main__":
    sys.exit(main())
