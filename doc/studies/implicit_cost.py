#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Run time of Table 2 at 1/s with explicit and with implicit damping, and on one and two MPI ranks.

    doc/studies/implicit_cost.py [--repeats 9] [--strain 0.01] [--large 8000] [--out doc/implicit_cost.md]

in.traction on the specimen of 500 spheres in tests/data with each integrator in turn, several rounds, and on one of --large spheres by
in.specimen. Times are LAMMPS' loop times. Explicit runs are timed to a twentieth of the strain, as each of their steps costs the
same; stresses are those of complete runs. Uses the lmp of this checkout, or EVP_LMP and EVP_MPIRUN.
"""

import csv
import pathlib
import re
import tempfile
from statistics import median
from typing import NamedTuple

from study import CHECKOUT, DECKS, add_out, command_line, deck_command, errors_in_one_line, in_turn, output_of, ratios, spread, table, write_page
import numpy as np

SPECIMEN = CHECKOUT / "tests" / "data" / "reference_500" / "specimen_500.data"
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"
IMPLICIT_STEP = 1.0e-5  # [s]
RATE = 1.0  # [1/s]
ROWS = 20  # of the CSV file, per run at most, each with one sample of the stress
SHARE = 0.95  # of the strain where stresses are compared
LOOP = re.compile(r"Loop time of (\S+) on \d+ procs for (\d+) steps with \d+ atoms")

HEAD = """# Run time of implicit damping

Implicit damping at dt = {step:g} s is {faster:.0f} times faster than explicit damping at 0.8 of the largest stable timestep size, for Table 2 at {rate:g}/s; the stresses
agree within {apart:.1g} %. On two MPI ranks it runs {ranks:.2g} times faster than on one, with {large} spheres.

Written by `doc/studies/implicit_cost.py`: Table 2 at {rate:g}/s, in.traction, LAMMPS' loop times, medians of {repeats} rounds
(smallest to largest). All integrators run in turn; ratios are taken within a round.

"""


class Pull(NamedTuple):
    """What a run showed: cost and steps per physical second, and the stress on the grips at SHARE of its strain [Pa]."""

    cost: float
    steps: float
    stress: float


def loop_of(ranks, deck, variables, folder):
    """(seconds, steps) of the longest loop of a run; RunError with LAMMPS' words where it failed."""
    output = output_of(deck_command(DECKS / deck, variables, ranks), folder, deck)
    steps, seconds = max((int(steps), float(seconds)) for seconds, steps in LOOP.findall(output))
    return seconds, steps


def pull(folder, specimen, strain, ranks=1, **variables):
    """A Pull of in.traction to that strain."""
    row = max(strain / ROWS, RATE * variables.get("timestep", 0.0))  # a row is at least a timestep
    settings = {"specimen": specimen, "coeff": TABLE2, "rate": RATE, "strain": strain, "row": row, "samples": 1, "out": "pull", **variables}
    seconds, steps = loop_of(ranks, "in.traction", settings, folder)
    with open(folder / "pull.csv", encoding="utf-8") as source:
        rows = [(float(row["strain"]), float(row["stress_grip"])) for row in csv.DictReader(source)]
    return Pull(seconds * RATE / strain, steps * RATE / strain, float(np.interp(SHARE * strain, *zip(*rows))))


def pull_part(folder, strain, words):
    """Pulls that share of the strain that makes a run of about a second."""
    part = strain if "integrator" in words else 0.05 * strain
    return lambda: pull(folder, SPECIMEN, part, **words)


def lines_of(results, stress):
    """A line per integrator; the ratios are those within each round, to the first."""
    header = ("integrator", "steps per second of simulated time", "run time per second of simulated time [s]", "times faster than the first",
              f"grip stress at {SHARE:g} of the strain [MPa]")
    costs = {name: [run.cost for run in runs] for name, runs in results.items()}
    first = next(iter(costs.values()))
    return "".join(line + "\n" for line in table(header, (
        (name, f"{results[name][0].steps:.4g}", spread(cost, "{:.4g}".format), spread(ratios(first, cost)), f"{stress[name] / 1e6:.3f}")
        for name, cost in costs.items())))


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--repeats", type=int, default=9, help="rounds (default 9)")
    parser.add_argument("--strain", type=float, default=0.01, help="final strain of the 500 spheres (default 0.01)")
    parser.add_argument("--large", type=int, default=8000, help="spheres of the specimen for one and two MPI ranks (default 8000)")
    add_out(parser, "implicit_cost.md")
    options = parser.parse_args(words)
    if options.repeats < 1 or options.strain <= 0.0 or options.large < 50:
        parser.error("--repeats must be at least 1, --strain positive and --large at least 50")

    with errors_in_one_line("implicit_cost.py"), tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        implicit = {"integrator": "implicit", "timestep": IMPLICIT_STEP}
        ways = {f"explicit, {share} of the largest stable dt": {"dtfraction": share} for share in (0.8, 0.4)}
        ways[f"implicit, dt = {IMPLICIT_STEP:g} s"] = implicit
        parts = {name: pull_part(folder, options.strain, words) for name, words in ways.items()}
        damping = in_turn(parts, options.repeats, "damping")
        stress = {name: pull(folder, SPECIMEN, options.strain, **words).stress for name, words in ways.items()}
        loop_of(2, "in.specimen", {"n": options.large, "out": "large.data"}, folder)
        ranks = {f"{n} MPI rank{'s' * (n > 1)}": lambda n=n: pull(folder, "large.data", 0.1 * options.strain, n, **implicit) for n in (1, 2)}
        scaling = in_turn(ranks, options.repeats, "ranks")
    runs = [[run.cost for run in found] for found in (*damping.values(), *scaling.values())]
    text = HEAD.format(rate=RATE, repeats=options.repeats, step=IMPLICIT_STEP, large=options.large, faster=median(ratios(runs[0], runs[2])),
                       apart=100.0 * abs(stress[list(ways)[2]] / stress[list(ways)[0]] - 1.0), ranks=median(ratios(runs[3], runs[4])))
    text += f"500 spheres of tests/data/reference_500 to a strain of {options.strain:g}:\n\n" + lines_of(damping, stress)
    text += (f"\n{options.large} spheres of in.specimen to a strain of {0.1 * options.strain:g}, the material kept (e and gamma scaled with N), implicit, dt = "
             f"{IMPLICIT_STEP:g} s:\n\n") + lines_of(scaling, {name: runs[0].stress for name, runs in scaling.items()})
    write_page(options.out, text)


if __name__ == "__main__":
    main()
