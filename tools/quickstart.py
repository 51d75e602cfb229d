#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""The paper's traction test, from a random packing to curves and pictures.

Runs in.two_spheres (the force law, figure 2), in.specimen (500 spheres) and in.traction for Tables
1 and 2 (figures 3 and 4); writes CSV and PNG files and prints E, 0.2 % yield stress, stress at 1 %
and the strain of the first bond in the second regime. Table 2 is also pulled at 100/s, where its
damping can be seen. in.cyclic loads and unloads the body with eq. 8 and with `plasticity isotropic`: its
residual strain. About a minute and a half on two cores.
"""

import argparse
import pathlib
import sys

import evp  # noqa: F401  before numpy
from evp import curves, figures, law, run
from evp.report import command_line, write_csv

TABLES = {
    "table1": ("Table 1, no damping", "80 8 4 3 8 4 0.005 0 1.5", (1.0, 10.0)),
    "table2": ("Table 2, damping 1000 N s/m", "80 8 4 3 8 4 0.005 1000 1.5", (1.0, 10.0, 100.0)),
}
UNLOADING = {"none": "eq. 8, the paper's law", "isotropic": "plasticity isotropic"}
UNLOADING_RATE = 10.0
STRAIN = 0.02
DT_FRACTION = 0.8
# Largest stable steps of such a specimen [s], only to share out the progress line.
_TYPICAL_STEP = {"table1": 9e-7, "table2": 3.5e-8}


def parser():
    """The command line."""
    top = command_line(__doc__)
    top.add_argument("--rates", nargs="+", type=_positive, metavar="R",
                     help="strain rates [1/s] for both tables (default: Table 1 at 1 and 10, "
                     "Table 2 at 1, 10 and 100; the time goes as 1/rate)")
    top.add_argument("--out", type=pathlib.Path, default=pathlib.Path("results", "quickstart"), metavar="DIR",
                     help="folder for the results (default: results/quickstart)")
    top.add_argument("--ranks", type=int, choices=range(1, 65), default=2, metavar="N",
                     help="MPI ranks of each traction run (default: 2)")
    return top


def _positive(word):
    """A positive number, for argparse."""
    value = float(word)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"a rate must be positive, got {word}")
    return value


def prepare_jobs(out):
    """The force law and the specimen: one core each, side by side."""
    two = run.Job("two_spheres", "in.two_spheres", {"out": "two_spheres"}, out)
    packing = {"n": 500, "seed": 1, "out": "specimen.data"}
    return [two, run.Job("specimen", "in.specimen", packing, out)]


def traction_job(out, table, rate, ranks):
    """One pull to STRAIN at a rate [1/s]; its progress is read off the growing CSV."""
    name = f"{table}_rate{rate:g}"
    variables = {"specimen": "specimen.data", "coeff": TABLES[table][1], "contact": "literal", "rate": f"{rate:g}",
                 "strain": STRAIN, "dtfraction": DT_FRACTION, "out": name}
    return run.Job(name, "in.traction", variables, out, ranks, cost=STRAIN / rate / (DT_FRACTION * _TYPICAL_STEP[table]),
                   done=lambda: run.last_strain(out / f"{name}.csv") / STRAIN)


def unloading_job(out, plasticity, ranks):
    """One sweep to STRAIN and back to zero stress."""
    name = f"plasticity_{plasticity}"
    variables = {"specimen": "specimen.data", "coeff": TABLES["table1"][1], "plasticity": plasticity, "rate": f"{UNLOADING_RATE:g}", "strain": STRAIN, "lower": "release", "out": name}
    return run.Job(name, "in.cyclic", variables, out, ranks, cost=2 * STRAIN / UNLOADING_RATE / (0.4 * _TYPICAL_STEP["table1"]))


def first_second_regime_strain(path):
    """Strain of the first row of PREFIX.csv with a bond in the second regime, or 'none'."""
    found = curves.read_columns(path, ("strain", "second_regime"))
    reached = found["strain"][found["second_regime"] > 0]
    return f"{reached[0]:.4f}" if len(reached) else "none"


def draw(out, pulled):
    """All pictures; pulled: {(table, rate): job}. Returns their paths."""
    panels = {}
    for (table, rate), job in sorted(pulled.items()):
        curve = curves.read_curve(out / f"{job.name}.csv")
        panels.setdefault(TABLES[table][0], []).append((f"{rate:g}/s", curve))
    measured = curves.read_columns(out / "two_spheres.csv", figures.MEASURED)
    table1 = law.Row.parse(TABLES["table1"][1])
    sweeps = {label: curves.read_curve(out / f"plasticity_{plasticity}.csv") for plasticity, label in UNLOADING.items()}
    return [figures.force_law(table1, out / "force_law.png", measured), figures.stress_strain(panels, out / "stress_strain.png"),
            figures.unloading(sweeps, out / "unloading.png")]


def report(out, pulled):
    """Print the table of numbers and write it to summary.csv."""
    header = ("table", "rate_per_s", "E_GPa", "yield_MPa", "stress_1pc_MPa", "first_second_regime")
    rows, ranges = [], set()
    for (table, rate), job in sorted(pulled.items()):
        found = curves.numbers(curves.read_curve(out / f"{job.name}.csv"))
        values = [f"{found[name]:.2f}" for name in header[2:5]]
        first = first_second_regime_strain(out / f"{job.name}.csv")
        rows.append((table, f"{rate:g}", *values, first))
        ranges.add(f"{found['E_from']:g} to {found['E_to']:.3g}")
    write_csv(out / "summary.csv", header, rows)
    titles = ("table ", "rate [1/s]", "E [GPa]", "0.2 % yield [MPa]", "stress at 1 % [MPa]",
              "first second-regime bond at strain")
    print("  ".join(titles))
    for row in rows:
        print("  ".join(cell.rjust(len(title)) for cell, title in zip(row, titles)))
    for plasticity, label in UNLOADING.items():
        left = curves.cycle_numbers(curves.read_curve(out / f"plasticity_{plasticity}.csv"))
        print(f"{label}: back from {100 * STRAIN:g} %, {figures.residual_text(left['residual_strain'])}")
    print("E is the slope over strain " + ", or ".join(sorted(ranges)))


def main(argv=None):
    """Run all; 0, or 1 after a message that holds LAMMPS' own error."""
    args = parser().parse_args(argv)
    out = args.out.absolute()
    wanted = {(t, r) for t in TABLES for r in (args.rates or TABLES[t][2])}
    pulled = {key: traction_job(out, *key, args.ranks) for key in sorted(wanted)}
    sweeps = [unloading_job(out, plasticity, args.ranks) for plasticity in UNLOADING]
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in ["two_spheres", *(job.name for job in (*pulled.values(), *sweeps))]:
            # An old curve would be taken for progress of the new run.
            (out / f"{name}.csv").unlink(missing_ok=True)
        run.run_jobs(prepare_jobs(out), title="packing and force law:")
        longest_first = sorted((*pulled.values(), *sweeps), key=lambda job: -job.cost)
        run.run_jobs(longest_first, title="traction:")
        paths = draw(out, pulled)
        report(out, pulled)
    except (run.RunError, OSError, ValueError) as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 1
    print("pictures, each with its CSV:")
    for path in paths:
        print(f"  {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
