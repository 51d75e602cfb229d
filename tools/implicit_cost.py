#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What a physical second of Table 2 at 1/s costs with explicit and with implicit damping, and on two ranks.

    tools/implicit_cost.py [--repeats 9] [--strain 0.01] [--large 8000] [--out doc/implicit_cost.md]

Pulls the specimen of 500 spheres in tests/data by in.traction, the ways in turn, several times over, and one of --large
spheres made by in.specimen. Times are LAMMPS' own loop times. So that the runs of a round are as short as each other,
explicit ones, whose steps all cost the same, go to a twentieth of the strain only; the stresses are those of whole runs. EVP_LMP and EVP_MPIRUN as for the tests.
"""

import argparse
import csv
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time
from typing import NamedTuple

import evp  # noqa: F401  before numpy
import numpy as np
from evp.run import CHECKOUT, DECKS, RunError, format_seconds, lammps_command

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
    command = lammps_command(ranks) + ["-in", str(DECKS / deck), "-log", "none"]
    for key, value in variables.items():
        command += ["-var", key, str(value)]
    run = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                         encoding="utf-8", errors="replace", check=False)
    loops = [(int(steps), float(seconds)) for seconds, steps in LOOP.findall(run.stdout)]
    if run.returncode or not loops:
        raise RunError(f"{deck} failed (exit {run.returncode}); its output ends with\n" + run.stdout[-1500:])
    steps, seconds = max(loops)
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


def in_turn(ways, repeats, title):
    """{name: [Pull of each repeat]}; the ways in turn, so that a slow moment of the machine meets all of them."""
    results, begin, done = {name: [] for name in ways}, time.monotonic(), 0
    for _ in range(repeats):
        for name, run in ways.items():
            results[name].append(run())
            done += 1
            left = (time.monotonic() - begin) / done * (repeats * len(ways) - done)
            print(f"{title} {done}/{repeats * len(ways)}, about {format_seconds(left)} left: {name}", file=sys.stderr, flush=True)
    return results


def spread(values, form):
    return f"{form % statistics.median(values)} ({form % min(values)} to {form % max(values)})"


def table(results, baseline, stress):
    """A line per way; the ratios are those within each round."""
    lines = ["| way | steps per physical second | computing per physical second [s] | of the first, times cheaper "
             f"| grip stress at {SHARE:g} of the strain [MPa] |\n|---|---|---|---|---|\n"]
    for name, runs in results.items():
        ratios = [other.cost / own.cost for own, other in zip(runs, results[baseline])]
        lines.append(f"| {name} | {runs[0].steps:.4g} | {spread([run.cost for run in runs], '%.4g')} | {spread(ratios, '%.2f')} "
                     f"| {stress[name] / 1e6:.3f} |\n")
    return "".join(lines)


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=9, help="rounds (default 9)")
    parser.add_argument("--strain", type=float, default=0.01, help="strain that the 500 spheres are pulled to (default 0.01)")
    parser.add_argument("--large", type=int, default=8000, help="spheres of the specimen for one and two ranks (default 8000)")
    parser.add_argument("--out", type=pathlib.Path, default=CHECKOUT / "doc" / "implicit_cost.md", help="the file to write")
    options = parser.parse_args(words)
    if options.repeats < 1 or options.strain <= 0.0 or options.large < 50:
        parser.error("--repeats must be 1 at least, --strain positive and --large 50 at least")

    try:
        with tempfile.TemporaryDirectory() as name:
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
    except RunError as error:
        sys.exit(f"implicit_cost.py: error: {error}")
    text = HEAD.format(rate=RATE, repeats=options.repeats)
    text += f"500 spheres of tests/data/reference_500 to a strain of {options.strain:g}:\n\n" + table(damping, next(iter(damping)), stress)
    text += (f"\n{options.large} spheres of in.specimen to {0.1 * options.strain:g}, the material scaled to their number, implicit at "
             f"{IMPLICIT_STEP:g} s:\n\n") + table(scaling, "1 rank", {name: runs[0].stress for name, runs in scaling.items()})
    options.out.write_text(text, encoding="utf-8")
    print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
