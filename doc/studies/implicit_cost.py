#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Run time of Table 2 at 1/s with explicit and with implicit damping, and on one and two MPI ranks.

in.traction on the specimen of 500 spheres in tests/data with each integrator in turn, several rounds, and on one of --large spheres by
in.specimen. Times are LAMMPS' loop times. Explicit runs are timed to a twentieth of the strain, as each of their steps costs the
same; stresses are those of complete runs.
"""

import pathlib
import re
import tempfile
from statistics import median
from typing import NamedTuple

from study import CHECKOUT, DECKS, Study, deck_command, edited_deck, errors_in_one_line, in_turn, output_of, ratios, spread
import numpy as np
from evp import figures

SPECIMEN = CHECKOUT / "tests" / "data" / "reference_500" / "specimen_500.data"
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"
STEP, RATE = 1.0e-5, 1.0  # of implicit damping [s]; of strain [1/s]
ROWS = 20  # of the CSV file, per run at most, each with one sample of the stress
SHARE = 0.95  # of the strain where stresses are compared
LOOP = re.compile(r"Loop time of (\S+) on \d+ procs for (\d+) steps with \d+ atoms")


class Pull(NamedTuple):
    """What a run showed: cost and steps per physical second, and the stress on the grips at SHARE of its strain [Pa]."""

    cost: float
    steps: float
    stress: float


def pull(folder, specimen, strain, ranks=1, **variables):
    """A Pull of in.traction to that strain."""
    settings = {"specimen": specimen, "coeff": TABLE2, "rate": RATE, "strain": strain, "row": strain / ROWS, "out": "pull", **variables}
    deck = DECKS / "in.traction"
    if "timestep" in variables:
        step = settings.pop("timestep")
        settings["row"] = max(settings["row"], RATE * step)  # a row is at least a timestep
        deck = edited_deck("in.traction", folder, ("variable        each equal", "variable each equal 1"),
                           ("variable        every equal", f"variable every equal $(ceil(v_row/(v_rate*{step:g})-1e-9))"))
    output = output_of(deck_command(deck, settings, ranks), folder, "in.traction")
    steps, seconds = max((int(steps), float(seconds)) for seconds, steps in LOOP.findall(output))
    curve = figures.read_columns(folder / "pull.csv", ("strain", "stress_grip"))
    return Pull(seconds * RATE / strain, steps * RATE / strain, float(np.interp(SHARE * strain, curve["strain"], curve["stress_grip"])))


def table_of(results, stress):
    """A line per integrator; the ratios are those within each round, to the first."""
    costs = {name: [run.cost for run in runs] for name, runs in results.items()}
    first = next(iter(costs.values()))
    return (("integrator", "steps per second of simulated time", "run time per second of simulated time [s]", "times faster than the first",
             f"grip stress at {SHARE:g} of the strain [MPa]"),
            [(name, f"{results[name][0].steps:.4g}", spread(cost, "{:.4g}".format), spread(ratios(first, cost)), f"{stress[name] / 1e6:.3f}")
             for name, cost in costs.items()])


def main(words=None):
    study = Study(__doc__, "implicit_cost", repeats=9, strain=0.01, large=8000).parse(words)
    with errors_in_one_line("implicit_cost.py"), tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        implicit = {"integrator": "implicit", "timestep": STEP}
        ways = {f"explicit, {share} of the largest stable dt": {"dtfraction": share} for share in (0.8, 0.4)}
        ways[f"implicit, dt = {STEP:g} s"] = implicit
        damping = in_turn({way: lambda words=words: pull(folder, SPECIMEN, study.strain * (1.0 if words is implicit else 0.05), **words) for way, words in ways.items()},
                          study.repeats, "damping")
        stress = {way: pull(folder, SPECIMEN, study.strain, **words).stress for way, words in ways.items()}
        output_of(deck_command(DECKS / "in.specimen", {"n": study.large, "out": "large.data"}, 2), folder, "in.specimen")
        ranks = in_turn({f"{n} MPI rank{'s' * (n > 1)}": lambda n=n: pull(folder, "large.data", 0.1 * study.strain, n, **implicit) for n in (1, 2)},
                        study.repeats, "ranks")
        costs = [[run.cost for run in found] for found in (*damping.values(), *ranks.values())]
        explicit, _, fast = stress.values()
        study.write(rate=f"{RATE:g}", repeats=study.repeats, step=f"{STEP:g}", strain=f"{study.strain:g}", large=study.large, largestrain=f"{0.1 * study.strain:g}",
                    faster=f"{median(ratios(costs[0], costs[2])):.0f}", apart=f"{100.0 * abs(fast / explicit - 1.0):.1g}", ranks=f"{median(ratios(costs[3], costs[4])):.2g}",
                    damping=table_of(damping, stress), scaling=table_of(ranks, {name: runs[0].stress for name, runs in ranks.items()}))


if __name__ == "__main__":
    main()
