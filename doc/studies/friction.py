#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Friction by LAMMPS' granular contacts: where a sliding block stops, and what a ball that hits a plate obliquely loses.

in.sliding with both contacts and two coefficients, and in.impact with and without friction.
"""

import re

from study import Study
import numpy as np

SLIDES = [(normal, mu) for normal in ("hooke", "hertz") for mu in (0.3, 0.5)]
IMPACTS = ("off", 0.0, 0.3, 0.6)
BALL, SPEED, TIME = 0.005, 50.0, 8e-5  # radius [m]; across and along the plate [m/s]; end of the run [s]
ALSO = """compute torque ball property/atom tqz
compute torques ball reduce sum c_torque
fix torques all ave/time 1 1 1 c_torques file torque.txt
"""


def impact(runs, mu):
    """Cells of a row, of in.impact."""
    name = f"impact_{mu}"
    (runs.folder / f"{name}.lmp").write_text(ALSO.replace("torque.txt", f"{name}.txt"), encoding="utf-8")
    text = runs.run("in.impact", name, plate="plate.data", ball="ball.data", speed=SPEED, sideways=SPEED, time=TIME, friction=mu, also=f"{name}.lmp")
    left, ratio = map(float, re.search(r"along the plate (\S+) m/s, .*: (\S+)", text).groups())
    rebound, imbalance = re.search(r"rebound speed (\S+) m/s", text)[1], re.search(r"over impact energy: (\S+)", text)[1]
    dropped = ""
    if mu not in ("off", 0.0):
        steps, torques = np.loadtxt(runs.folder / f"{name}.txt", unpack=True)
        dt = float(re.findall(r"Time step +: (\S+)", text)[-1])
        energy = float((runs.folder / f"{name}.csv").read_text(encoding="utf-8").splitlines()[1].split(",")[3])
        dropped = f"{abs(dt * (steps[1] - steps[0]) * torques.sum()) / (energy / SPEED**2 * BALL * (SPEED - left)):.2f}"
    return f"{ratio:.3f}", f"{left:.2f}", f"{float(rebound):.2f}", dropped, imbalance


def main(words=None):
    with Study(__doc__, "friction", "validation", spheres=500).started(words) as study:
        runs, slides, impacts = study.runs, [], []
        (runs.folder / "ball.region").write_text(f"region body sphere {BALL} 0 0 {BALL}\n", encoding="utf-8")
        runs.body("block", n=study.spheres, shape="block", length=0.02, width=0.01, height=0.01)
        plate = runs.run("in.specimen", "plate.data", n=1500, shape="block", length=0.008, width=0.025, height=0.025)
        radius = float(re.findall(r"mean radius (\S+) m", plate)[-1])
        runs.body("ball", n=158, shape="region", region="ball.region", length=2 * BALL)
        for case in study.each([*SLIDES, *IMPACTS], lambda case: f"in.{'sliding' if isinstance(case, tuple) else 'impact'} {case}"):
            if isinstance(case, tuple):
                printed = runs.run("in.sliding", "slide_{}_{}".format(*case), block="block.data", **dict(zip(("normal", "friction"), case)))
                slides.append([*case, *re.findall(r"ratio (\S+)", printed)])
            else:
                impacts.append([case, *impact(runs, case)])
        study.write(spheres=study.spheres, speed=f"{SPEED:g}", ball=re.search(r"(\d+) atoms", (runs.folder / "ball.data").read_text(encoding="utf-8"))[1],
                    share=f"{radius / BALL:.2f}", slides=(("normal contact", "mu", "distance", "time"), slides),
                    impacts=(("friction", "along/across", "speed along, after [m/s]", "rebound speed [m/s]", "torque dropped", "imbalance"), impacts))


if __name__ == "__main__":
    main()
