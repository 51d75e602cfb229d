#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Order of accuracy in dt of fix nve and fix nve/evp, with and without damping; what the steps between two updates of plastic strains and limits change.

Initial velocities stretch an FCC bar within the first regime. It runs for a fixed time with dt, dt/2, dt/4 ... Differences of velocities
and positions between successive dt decrease as dt to the power of the order. The updates are those of limits.py.
"""

import pathlib
import tempfile
from typing import NamedTuple

from study import Study, deck_command, output_of
import limits
import numpy as np

TIME = 4.0e-5  # [s] about half a period of the bar
DECK = """
units           si
atom_style      sphere
boundary        s s s
lattice         fcc 0.01
region          bar block 0 5 0 2 0 2
create_box      1 bar
create_atoms    1 region bar
set             group all diameter 0.00707 density 2700
neighbor        0.0005 bin
pair_style      evp/lj contact none
pair_coeff      * * 80 8 4 3 8 4 0.1 {gamma} 1.5
fix             bonds all evp/bonds
fix             move all {style}
variable        vx atom 40*(x-0.025)+0.2*sin(1.1*id)
variable        vy atom -10*(y-0.01)+0.2*cos(2.3*id)
velocity        all set v_vx v_vy 0
timestep        {dt:.17g}
run             {steps}
write_dump      all custom end.dump id x y z vx vy vz modify sort id format float %.17g
"""
HEADER = ("integrator", "gamma [N s/m]", "dt [s]", "difference", "order of the velocities", "order of the positions")


class Way(NamedTuple):
    style: str
    gamma: float
    steps: int  # of the largest dt


WAYS = (Way("nve", 0.0, 200), Way("nve", 100.0, 400), Way("nve", 1000.0, 2000),
        Way("nve/evp", 100.0, 200), Way("nve/evp", 1000.0, 200), Way("nve/evp", 1000.0, 2000))


def end_of(way, steps, folder):
    """Positions and velocities after TIME, (2, N, 3)."""
    style = way.style + (" tol 1e-10" if way.style == "nve/evp" else "")
    (folder / "in.order").write_text(DECK.format(gamma=way.gamma, style=style, dt=TIME / steps, steps=steps), encoding="utf-8")
    output_of(deck_command("in.order", {}), folder, f"fix {way.style} with gamma {way.gamma:g} and {steps} timesteps")
    columns = np.loadtxt(folder / "end.dump", skiprows=9, usecols=range(1, 7))
    return np.stack([columns[:, :3], columns[:, 3:]])


def measure(way, halvings, folder):
    """Differences between successive dt: (halvings, 2) of positions and velocities, the latter over the largest; number of spheres."""
    ends = [end_of(way, way.steps * 2**k, folder) for k in range(halvings + 1)]
    largest = np.abs(ends[-1][1]).max()
    return np.array([[np.abs(a[0] - b[0]).max(), np.abs(a[1] - b[1]).max() / largest] for a, b in zip(ends, ends[1:])]), len(ends[0][0])


def main(words=None):
    rows, orders = [], {}
    with Study(__doc__, "time_order", "validation", halvings=4).started(words) as study, tempfile.TemporaryDirectory() as name:
        for way in study.each(WAYS, lambda way: f"fix {way.style}, gamma {way.gamma:g}"):
            differences, atoms = measure(way, study.halvings, pathlib.Path(name))
            order = np.log2(differences[:-1] / differences[1:])
            orders.setdefault((way.style, way.gamma > 0.0), []).append(order[-1, 1])
            for k, (_, velocity) in enumerate(differences):
                rows.append((f"fix {way.style}", f"{way.gamma:g}", f"{TIME / way.steps / 2**k:.3g}", f"{velocity:.2e}",
                             *(f"{one:.2f}" if k else "" for one in order[k - 1, ::-1])))
        ends = {key: " to ".join(dict.fromkeys((f"{min(found):.2f}", f"{max(found):.2f}"))) for key, found in orders.items()}
        plan = [(case, update, fraction) for case in limits.CASES for fraction in limits.FRACTIONS for update in limits.UPDATES]
        steps = study.each(plan, lambda one: f"{one[0].name}, update {one[1]}, dt {one[2]:g}", lambda one: 1.0 / one[2])
        found = {one: limits.measure(*one, study.runs) for one in steps}
        (table, changes), cost = limits.changes(found), limits.costs(study.runs)
        study.write(time=TIME, atoms=atoms, table=(HEADER, rows), undamped=ends["nve", False], explicit=ends["nve", True], implicit=ends["nve/evp", True],
                    limits=table, most_10=changes[10][0], usual_10=changes[10][1], most_40=changes[40][0], usual_40=changes[40][1], within=limits.within(found), share=f"{1 / limits.SHARE:.0f}th",
                    cost_1=cost[1], cost_40=cost[40])


if __name__ == "__main__":
    main()
