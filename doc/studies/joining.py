#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""When two bodies join: critical speeds of copper particles by in.spray, and the strength of cold welds by in.weld, with the criterion of exposure and pressure and without.

A critical speed is bracketed by bisection. Bodies are packed by in.specimen."""

import re
from typing import NamedTuple

from study import DECKS, RunError, Study, mean_of
import numpy as np

SPRAY = "join 1.2 all exposure 0.85 pressure 1"  # Y0 of copper: by the critical speed of particles of 25 um
WELD = "join 1.2 all exposure 0.4 pressure 1"
SPEEDS = 200, 300, 400, 500, 600  # [m/s]
SLOWEST, FASTEST, BRACKET = 200.0, 900.0, 25.0  # [m/s] of the bisection, and where it ends
PRESSED = 0.05, 0.2, 0.4, 0.6  # strains of the grips
ALUMINIUM = "aluminium_6061T6"


class Splat(NamedTuple):
    """What in.spray says of a run; lengths over the diameter of the particle."""

    sticks: bool
    height: float
    width: float
    crater: float
    temperature: float  # highest of a sphere [K]
    joints: int
    speed: float  # at the end [m/s]


def splat_of(text):
    """Of the lines at the end of in.spray; RunError where they are not there."""
    found = re.search(r"temperature of a sphere (\S+) K.*height (\S+) and width (\S+) of the first.*crater (\S+);.*"
                      r"the particle (?:sticks, joints with the plate: (\d+)|rebounds at (\S+) m/s)", text, re.S)
    if not found:
        raise RunError(f"in.spray did not come to its end:\n{text[-1000:]}")
    temperature, height, width, crater, joints, speed = found.groups()
    return Splat(joints is not None, float(height), float(width), float(crater), float(temperature), int(joints or 0), float(speed or 0.0))


def bodies(study, diameter, n, seed=1):
    """Choices of in.spray: a ball of n spheres and a plate of as many per volume, of a diameter in um."""
    name, size = f"{diameter:g}um_{n}_{seed}", 1e-6 * diameter
    (study.runs.folder / f"ball_{diameter:g}.region").write_text(f"region body sphere {size / 2:.9g} 0 0 {size / 2:.9g}\n", encoding="utf-8")
    particle = study.runs.body(f"particle_{name}", shape="region", region=f"ball_{diameter:g}.region", length=size, n=n, seed=seed)
    plate = study.runs.body(f"plate_{name}", shape="block", length=0.9 * size, width=2.4 * size, height=2.4 * size, n=5 * n, seed=seed)
    return {"particle": particle, "plate": plate}


def hit(study, case, speed, temperature):
    name = f"{case['particle'].split('.')[0]}_{temperature:g}K_{speed:g}"
    return splat_of(study.runs.run("in.spray", name, **case, contact=SPRAY, speed=speed, temperature_particle=temperature))


def critical(study, case, temperature):
    """Middle between the highest speed that bounces off and the lowest that sticks [m/s]."""
    low, high = SLOWEST, FASTEST
    while high - low > BRACKET:
        speed = round(0.5 * (low + high))
        low, high = (low, speed) if hit(study, case, speed, temperature).sticks else (speed, high)
    return 0.5 * (low + high)


def strength(study, name, **choices):
    """Of in.weld [MPa]."""
    text = study.runs.run("in.weld", name, specimen="bar.data", material=f"{DECKS.parent}/potentials/metals.evp:{ALUMINIUM}", rate=100, pull=0.08, **choices)
    return float(re.search(r"in.weld: strength (\S+) MPa", text)[1])


def main(words=None):
    with Study(__doc__, "joining", n=300, seeds=[1, 2, 3]).started(words) as study:
        cases = [(25, 298, study.n), (10, 298, study.n), (50, 298, study.n), (25, 593, study.n), (25, 298, 2 * study.n)]
        found = {case: [critical(study, bodies(study, case[0], case[2], seed), case[1]) for seed in study.seeds]
                 for case in study.each(cases, lambda case: f"{case[0]} um at {case[1]} K, {case[2]} spheres")}
        first = np.mean(found[cases[0]])
        speeds = [(f"{d:g}", f"{t:g}", n, mean_of(values, ".0f"), f"{np.mean(values) / first:.2f}") for (d, t, n), values in found.items()]
        case = bodies(study, 25, 2 * study.n)
        splats = {speed: hit(study, case, speed, 298) for speed in SPEEDS}
        shapes = [(speed, f"{1.0 - one.height:.2f}", f"{one.width:.2f}", f"{one.crater:.2f}", f"{one.temperature:.0f}",
                   f"sticks, {one.joints} joints" if one.sticks else f"rebounds at {one.speed:.0f} m/s") for speed, one in splats.items()]
        study.runs.body("bar", n=500)
        welds = []
        for press in study.each(PRESSED, lambda press: f"weld pressed by {press:g}"):
            solid = strength(study, f"solid_{press:g}", press=press, cut="no")
            shares = [strength(study, f"{name}_{press:g}", press=press, contact=contact) / solid for name, contact in (("all", "join 1.2 all"), ("exposed", WELD))]
            welds.append((f"{press:g}", f"{solid:.0f}", *(f"{share:.2f}" for share in shares), f"{press * (2.0 - press):.2f}"))
        study.draw({"all": (PRESSED, [float(row[2]) for row in welds]), "exposure 0.4 pressure 1": (PRESSED, [float(row[3]) for row in welds]),
                    "R (2 - R), Vaidyanath et al. 1959": (np.linspace(0.0, 0.6, 61), [r * (2.0 - r) for r in np.linspace(0.0, 0.6, 61)])},
                   ("curve", "reduction", "strength_over_solid"), xlabel="reduction", ylabel="strength over that of the solid", ylim=(0, 1.1))
        study.write(spray=SPRAY, weld=WELD, first=f"{first:.0f}", small=speeds[1][4], large=speeds[2][4], hot=speeds[3][4], n=study.n, seeds=len(study.seeds),
                    speeds=(("diameter [um]", "particle at [K]", "spheres", "critical speed [m/s]", "over the first"), speeds),
                    shapes=(("speed [m/s]", "1 - height", "width", "crater", "highest temperature [K]", ""), shapes),
                    welds=(("pressed by", "solid [MPa]", "*all*, over the solid", "criterion, over the solid", "R (2 - R)"), welds))


if __name__ == "__main__":
    main()
