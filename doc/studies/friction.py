#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Friction by LAMMPS' granular contacts: where a sliding block stops, and what a ball that hits a plate obliquely loses.

    doc/studies/friction.py [--spheres 500] [--out doc/friction.md]

in.sliding on both plates, with both contacts and two coefficients, and in.impact with and without friction. EVP_LMP as for the tests.
"""

import pathlib
import re
import sys
import tempfile

from study import DECKS, add_out, command_line, deck_command, errors_in_one_line, output_of, watched, write_page
import numpy as np

SLIDES = [(plate, normal, mu) for plate in ("wall", "spheres") for normal in ("hooke", "hertz") for mu in (0.3, 0.5)]
IMPACTS = ("off", 0.0, 0.3, 0.6)
BALL, SPEED, TIME = 0.005, 50.0, 8e-5  # radius [m]; across and along the plate [m/s]; end of the run [s]
ALSO = """compute torque ball property/atom tqz
compute torques ball reduce sum c_torque
fix torques all ave/time 1 1 1 c_torques file torque.txt
"""
HEAD = """# Friction, measured

**A block of {spheres} spheres on a rigid plate.** Distance and time to the stop over v^2/(2 mu g) and v/(mu g).
*Wall* is the plane of fix wall/gran, *spheres* are held, overlapping spheres in pair_style hybrid. The time is that of 95 % of the speed, over 0.95.

"""
SLIDE_HEADER = ("plate", "normal contact", "mu", "distance", "time")
IMPACT_HEADER = ("friction", "along/across", "speed along, after [m/s]", "rebound speed [m/s]", "torque dropped", "imbalance")
MIDDLE = """
**A ball of {ball} spheres that hits a plate obliquely**, at {speed:g} m/s across and along it. Both are rough on the scale of their spheres.
*Along/across*: what the ball loses of its speed along the plate, over the change of its speed across. With friction off or 0 it is what the rough surfaces take. On a smooth plate
it is mu as long as the ball slides; friction ends where it rolls, which leaves it 5/7 of the speed along the plate. *Torque dropped*: time
integral of the torques on the spheres of the ball, which fix nve does not act upon, over m R dv of the whole ball with its speed dv lost along the plate.
It is at most the radius of a sphere over that of the ball, {share:.2f}, and less as the rough surfaces take a part of dv.
*Imbalance* is that of fix evp/energy, over the kinetic energy of the ball.

"""
TAIL = "\nWritten by `doc/studies/friction.py --spheres {spheres}`; what the numbers mean: [Howto_evp_friction](Howto_evp_friction.rst).\n"


def specimen(folder, out, **choices):
    """Makes the data file of a body; the mean radius of its spheres [m]."""
    text = output_of(deck_command(DECKS / "in.specimen", {"out": out, **choices}), folder, f"packing of {out}")
    return float(re.search(r"mean radius (\S+) m", text)[1])


def slide(folder, plate, normal, mu):
    """Cells of a row: the ratios that in.sliding prints."""
    choices = {"block": "block.data", "plate": plate, "normal": normal, "friction": mu}
    return re.findall(r"ratio (\S+)", output_of(deck_command(DECKS / "in.sliding", choices), folder, f"slide on {plate}, {normal}, mu {mu}"))


def impact(folder, mu):
    """Cells of a row, of in.impact."""
    choices = {"speed": SPEED, "sideways": SPEED, "time": TIME, "friction": mu, "also": "also.lmp", "out": "run"}
    text = output_of(deck_command(DECKS / "in.impact", choices), folder, f"impact with friction {mu}")
    left, ratio = map(float, re.search(r"along the plate (\S+) m/s, .*: (\S+)", text).groups())
    rebound = re.search(r"rebound speed (\S+) m/s", text)[1]
    imbalance = re.search(r"over impact energy: (\S+)", text)[1]
    dropped = ""
    if mu not in ("off", 0.0):
        steps, torques = np.loadtxt(folder / "torque.txt", unpack=True)
        dt = float(re.findall(r"Time step +: (\S+)", text)[-1])
        mass = 2.0 * float((folder / "run.csv").read_text(encoding="utf-8").splitlines()[1].split(",")[3]) / (2.0 * SPEED**2)
        dropped = f"{abs(dt * (steps[1] - steps[0]) * torques.sum()) / (mass * BALL * (SPEED - left)):.2f}"
    return f"{ratio:.3f}", f"{left:.2f}", f"{float(rebound):.2f}", dropped, imbalance


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--spheres", type=int, default=500, help="of the block (default 500)")
    add_out(parser, "friction.md")
    options = parser.parse_args(words)
    if options.spheres < 100:
        parser.error("--spheres must be 100 at least")
    slides, impacts = [], []
    with errors_in_one_line("friction.py"), tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "also.lmp").write_text(ALSO, encoding="utf-8")
        (folder / "ball.region").write_text(f"region body sphere {BALL} 0 0 {BALL}\n", encoding="utf-8")
        specimen(folder, "block.data", n=options.spheres, shape="block", length=0.02, width=0.01, height=0.01)
        radius = specimen(folder, "plate.data", n=1500, shape="block", length=0.008, width=0.025, height=0.025)
        specimen(folder, "ball.data", n=158, shape="region", region="ball.region", length=2 * BALL)
        ball = int(re.search(r"(\d+) atoms", (folder / "ball.data").read_text(encoding="utf-8"))[1])
        for case in watched("friction.py:", [*SLIDES, *IMPACTS], lambda case: f"in.{'sliding' if isinstance(case, tuple) else 'impact'} {case}"):
            if isinstance(case, tuple):
                slides.append([*case, *slide(folder, *case)])
            else:
                impacts.append([case, *impact(folder, case)])
        write_page(options.out, HEAD.format(spheres=options.spheres), (SLIDE_HEADER, slides),
                   MIDDLE.format(ball=ball, speed=SPEED, share=radius / BALL), (IMPACT_HEADER, impacts), TAIL.format(spheres=options.spheres))


if __name__ == "__main__":
    sys.exit(main())
