#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What a physical second of Table 2 at 1/s costs with explicit and with implicit damping, and on two ranks.

    tools/implicit_cost.py [--repeats 9] [--strain 0.01] [--large 8000] [--out doc/implicit_cost.md]

Pulls the specimen of 500 spheres in tests/data by in.traction, the ways in turn, several times over, and one of --large
spheres made by in.specimen. Times are LAMMPS' own loop times. So that the runs of a round are as short as each other,
explicit ones, whose steps all cost the same, go to a twentieth of the strain only; the stresses are those of whole runs. EVP_LMP and EVP_MPIRUN as for the tests.
"""

import csv
import pathlib
import re
import tempfile
from typing import NamedTuple

import evp  # noqa: F401  before numpy
import numpy as np
from evp.progress import in_turn
from evp.report import add_out, command_line, errors_in_one_line, ratios, spread, table
from evp.run import CHECKOUT, DECKS, deck_command, output_of

SPECIMEN = CHECKOUT / "tests" / "data" / "reference_500" / "specimen_500.data"
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"
IMPLICIT_STEP = 1.0e-5  # [s]
RATE = 1.0  # [1/s]
ROWS = 20  # of the CSV file, per run at most, each with one sample of the stress
SHARE = 0.95  # of the strain where stresses are compared
LOOP = re.compile(r"Loop time of (\S+) on \d+ procs for (\d+) steps with \d+ atoms")

HEAD = """# The cost of implicit damping

Written by `tools/implicit_cost.py`: Table 2 pulled at {rate:g}/s by in.traction, LAMMPS' loop times, medians of {repeats}
(smallest to largest), the ways run in turn; ratios within a round.

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
    row = max(strain / ROWS, RATE * variables.get("timestep", 0.0))  # a row is a timestep at least
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
    """A line per way; the ratios are those within each round, to the first way."""
    header = ("way", "steps per physical second", "computing per physical second [s]", "of the first, times cheaper",
              f"grip stress at {SHARE:g} of the strain [MPa]")
    costs = {name: [run.cost for run in runs] for name, runs in results.items()}
    first = next(iter(costs.values()))
    return "".join(line + "\n" for line in table(header, (
        (name, f"{results[name][0].steps:.4g}", spread(cost, "{:.4g}".format), spread(ratios(first, cost)), f"{stress[name] / 1e6:.3f}")
        for name, cost in costs.items())))


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--repeats", type=int, default=9, help="rounds (default 9)")
    parser.add_argument("--strain", type=float, default=0.01, help="strain that the 500 spheres are pulled to (default 0.01)")
    parser.add_argument("--large", type=int, default=8000, help="spheres of the specimen for one and two ranks (default 8000)")
    add_out(parser, "implicit_cost.md")
    options = parser.parse_args(words)
    if options.repeats < 1 or options.strain <= 0.0 or options.large < 50:
        parser.error("--repeats must be 1 at least, --strain positive and --large 50 at least")

    with errors_in_one_line("implicit_cost.py"), tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        implicit = {"integrator": "implicit", "timestep": IMPLICIT_STEP}
        ways = {f"explicit at {share} of its limit": {"dtfraction": share} for share in (0.8, 0.4)}
        ways[f"implicit at {IMPLICIT_STEP:g} s"] = implicit
        parts = {name: pull_part(folder, options.strain, words) for name, words in ways.items()}
        damping = in_turn(parts, options.repeats, "damping")
        stress = {name: pull(folder, SPECIMEN, options.strain, **words).stress for name, words in ways.items()}
        loop_of(2, "in.specimen", {"n": options.large, "out": "large.data"}, folder)
        ranks = {f"{n} rank{'s' * (n > 1)}": lambda n=n: pull(folder, "large.data", 0.1 * options.strain, n, **implicit) for n in (1, 2)}
        scaling = in_turn(ranks, options.repeats, "ranks")
    text = HEAD.format(rate=RATE, repeats=options.repeats)
    text += f"500 spheres of tests/data/reference_500 to a strain of {options.strain:g}:\n\n" + lines_of(damping, stress)
    text += (f"\n{options.large} spheres of in.specimen to {0.1 * options.strain:g}, the material scaled to their number, implicit at "
             f"{IMPLICIT_STEP:g} s:\n\n") + lines_of(scaling, {name: runs[0].stress for name, runs in scaling.items()})
    options.out.write_text(text, encoding="utf-8")
    print(text, end="")


if __name__ == "__main__":
    main()
