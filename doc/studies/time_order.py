#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Order of accuracy in dt of fix nve and fix nve/evp, with and without damping.

    doc/studies/time_order.py [--halvings 4] [--out doc/time_order.md]

Initial velocities stretch an FCC bar within the first regime. It runs for a fixed time with dt, dt/2, dt/4 ... Differences of velocities
and positions between successive dt decrease as dt to the power of the order. Uses the lmp of this checkout, or EVP_LMP.
"""

import pathlib
import tempfile
from typing import NamedTuple

from study import add_out, command_line, deck_command, errors_in_one_line, output_of, watched, write_page
import numpy as np

TIME = 4.0e-5  # [s] about half a period of the bar

DECK = """
units           si
atom_style      sphere
atom_modify     map yes
boundary        s s s
lattice         fcc 0.01
region          bar block 0 5 0 2 0 2
create_box      1 bar
create_atoms    1 region bar
set             group all diameter 0.00707
set             group all density 2700
neighbor        0.0005 bin
neigh_modify    every 1 delay 0 check yes
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

HEAD = """# Order of accuracy in the timestep size

{answer}

Written by `doc/studies/time_order.py`: an FCC bar of {atoms} spheres, stretched by its initial velocities within the first regime, for {time:g} s. *Difference*: largest
difference of the final velocities between a run with dt and one with dt/2, over the largest velocity. *Order*: log2 of its ratio to the difference of the next dt.

"""
HEADER = ("integrator", "gamma [N s/m]", "dt [s]", "difference", "order of the velocities", "order of the positions")


class Way(NamedTuple):
    style: str
    gamma: float
    steps: int  # of the largest dt


WAYS = (Way("nve", 0.0, 200), Way("nve", 100.0, 400), Way("nve", 1000.0, 2000),
        Way("nve/evp", 100.0, 200), Way("nve/evp", 1000.0, 200), Way("nve/evp", 1000.0, 2000))


def end_of(way, steps, folder):
    """Positions and velocities after TIME, (2, N, 3); RunError with LAMMPS' words where the run failed."""
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


def rows(way, differences):
    """Rows of the table."""
    for k, (_, velocity) in enumerate(differences):
        orders = ["", ""] if k == 0 else [f"{order:.2f}" for order in np.log2(differences[k - 1] / differences[k])]
        yield f"fix {way.style}", f"{way.gamma:g}", f"{TIME / way.steps / 2**k:.3g}", f"{velocity:.2e}", *orders[::-1]


def answer(orders):
    """The first sentence of the page. orders: {Way: of velocities at the smallest dt}."""
    def of(chosen):
        values = [f"{value:.2f}" for value in sorted(orders[way] for way in orders if chosen(way))]
        return values[0] if values[0] == values[-1] else f"{values[0]} to {values[-1]}"

    return (f"Without damping (fix nve) the order is {of(lambda way: way.gamma == 0.0)}: the error of the velocities is proportional to dt^2. "
            f"With explicit damping (fix nve) it is\n{of(lambda way: way.style == 'nve' and way.gamma > 0.0)}, with implicit damping (fix nve/evp) "
            f"{of(lambda way: way.style == 'nve/evp')}: the error is proportional to dt.")


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--halvings", type=int, default=4, help="differences between successive dt, for each integrator and gamma (default 4)")
    add_out(parser, "time_order.md")
    options = parser.parse_args(words)
    if options.halvings < 2:
        parser.error("--halvings must be at least 2")
    found, orders = [], {}
    with errors_in_one_line("time_order.py"), tempfile.TemporaryDirectory() as name:
        for way in watched("time_order.py:", WAYS, lambda way: f"fix {way.style}, gamma {way.gamma:g}"):
            differences, atoms = measure(way, options.halvings, pathlib.Path(name))
            found += rows(way, differences)
            orders[way] = float(np.log2(differences[-2][1] / differences[-1][1]))
        write_page(options.out, HEAD.format(time=TIME, atoms=atoms, answer=answer(orders)), (HEADER, found))


if __name__ == "__main__":
    main()
