#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Accuracy versus run time of a tension test: varies one setting at a time and recommends one for each error bound.

    doc/studies/accuracy_cost.py [--budget 30] [--work FOLDER] [--fresh] [--out doc/accuracy_cost.md]
    doc/studies/accuracy_cost.py --table doc/accuracy_cost.csv --out page.md        no runs: writes the page from a CSV
    doc/studies/accuracy_cost.py --quick --out page.md                              a few short runs
    doc/studies/accuracy_cost.py --unloading [--out doc/accuracy_unloading.md]      unloading (plasticity isotropic) and fix evp/volume instead

Writes the page, a CSV of the same name with one row per run, and figures/NAME.png. Runs the decks with the lmp of this checkout,
or with EVP_LMP and EVP_MPIRUN. An interrupted sweep resumes when the command is repeated. --budget is in minutes: the least
important runs are left out where they do not fit.
"""

import pathlib
import sys
import time

from study import CHECKOUT, RunError, command_line, errors_in_one_line, format_seconds, write_csv
import accuracy_cases as cases
import accuracy_unloading as unloading
from accuracy_figure import pareto
from accuracy_report import Results, page
from accuracy_run import COLUMNS, Laboratory, describe, read_results, run_plan, within_budget

SHARE = 0.75  # of the budget that is planned: the rest is for the check on an unseen specimen and for runs that take longer


def sweep(options):
    """Runs what fits and returns all rows."""
    begin = time.monotonic()
    if options.quick:
        return run_plan(Laboratory(options.work, options.fresh, repeats=1), cases.quick_cases())
    laboratory = Laboratory(options.work, options.fresh)
    every = cases.all_cases()
    known = read_results(laboratory.results) if laboratory.results.exists() else {}
    seconds = 60.0 * options.budget
    plan, expected = within_budget(every, known, SHARE * seconds, laboratory.baselines[-1])
    if expected > seconds:
        raise RunError(f"the runs that the page needs take about {format_seconds(expected)}: give --budget {expected / 60.0 / SHARE:.0f} or more")
    print(describe(plan, every, expected), file=sys.stderr, flush=True)
    rows = run_plan(laboratory, plan)
    chosen = [(choice.knob, choice.name) for choice in Results(rows.values()).recommended().values() if choice]
    rows = {**rows, **run_plan(laboratory, cases.check_cases(chosen))}
    print(f"all in {format_seconds(time.monotonic() - begin)}", file=sys.stderr, flush=True)
    return rows


def page_of_unloading(options):
    """The page of accuracy_unloading, from a CSV or from its sweep, which runs in a folder of its own."""
    if options.table:
        rows = unloading.read(options.table)
    else:
        folder = options.work.with_name(options.work.name + "_unloading")
        folder.mkdir(parents=True, exist_ok=True)
        rows = unloading.run_plan(folder, unloading.all_cases(options.quick))
    unloading.write(rows, options.out)
    print(options.out, flush=True)
    return 0


def write(rows, options):
    """CSV, picture and page. True unless an error bound was exceeded on the unseen specimen."""
    quick = ("implicit", "1e-5 s")
    results = Results(rows, quick, quick) if options.quick else Results(rows)
    write_csv(options.out.with_suffix(".csv"), COLUMNS, rows)
    picture = options.out.parent / "figures" / (options.out.stem + ".png")
    if results.target and results.recipe:
        pareto(results, picture)
        print(picture)
    text = page(results, options.out.with_suffix(".csv").name, f"figures/{picture.name}")
    options.out.write_text(text, encoding="utf-8")
    print(options.out, flush=True)
    return "NOT met" not in text


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--budget", type=float, default=30.0, metavar="MINUTES", help="wall time of the sweep (default 30)")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "accuracy_cost", help="specimens and results (default: %(default)s)")
    parser.add_argument("--fresh", action="store_true", help="delete the results in --work first")
    parser.add_argument("--quick", action="store_true", help="a few short runs, to test the tool; needs --out")
    parser.add_argument("--unloading", action="store_true",
                        help="vary timestep size, strain increment and number of spheres; compare residual strain, unloading modulus, loop area, volume strain")
    parser.add_argument("--table", type=pathlib.Path, metavar="CSV", help="write the page from these results, without runs; needs --out")
    parser.add_argument("--out", type=pathlib.Path, help="a .md file (default: doc/accuracy_cost.md)")
    options = parser.parse_args(words)
    if options.budget <= 0.0:
        parser.error("--budget must be positive")
    if (options.quick or options.table) and not options.out:
        parser.error("--quick and --table need --out: doc/ is for complete sweeps")
    options.out = options.out or CHECKOUT / "doc" / ("accuracy_unloading.md" if options.unloading else "accuracy_cost.md")
    if options.out.suffix != ".md" or not options.out.parent.is_dir():
        parser.error(f"--out must be a .md file in an existing folder, got {options.out}")
    try:
        with errors_in_one_line("accuracy_cost.py"):
            if options.unloading:
                return page_of_unloading(options)
            rows = list((read_results(options.table) if options.table else sweep(options)).values())
            kept = write(rows, options)
    except KeyboardInterrupt:
        sys.exit("\naccuracy_cost.py: stopped; repeat the command to resume")
    return 0 if kept else "accuracy_cost.py: an error bound was exceeded on the unseen specimen, see the page"


if __name__ == "__main__":
    sys.exit(main())
