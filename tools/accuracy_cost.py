#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What accuracy costs in time: every choice of a pull by itself, error against time, and the cheapest way to a given error.

    tools/accuracy_cost.py [--budget 30] [--work FOLDER] [--fresh] [--out doc/accuracy_cost.md]
    tools/accuracy_cost.py --table doc/accuracy_cost.csv --out page.md        only writes the page again
    tools/accuracy_cost.py --quick --out page.md                              a few short runs

Runs the decks with the lmp of this checkout (EVP_LMP and EVP_MPIRUN as for the tests) and writes the page, beside it a CSV of
the same name with one row per run, and figures/NAME.png. An interrupted sweep goes on where it was when the command is
given again. --budget is in minutes: what does not fit is left out, the least important first.
"""

import argparse
import pathlib
import sys
import time

from evp import accuracy_cases as cases
from evp.accuracy_report import Results, page
from evp.accuracy_run import Laboratory, read_results, run_plan, within_budget
from evp.run import CHECKOUT, RunError, format_seconds


def sweep(options):
    """Runs what fits and returns all rows."""
    begin = time.monotonic()
    laboratory = Laboratory(options.work, options.fresh)
    if options.quick:
        return run_plan(laboratory, cases.quick_cases())
    # a quarter is kept for the check on an unseen body and for what takes longer than expected
    every = [case for case in cases.all_cases() if not case.native or laboratory.has_own_build()]
    plan, expected = within_budget(every, 45.0 * options.budget, laboratory.baseline_seconds)
    if expected > 60.0 * options.budget:
        raise RunError(f"the cases that the page needs take about {format_seconds(expected)}: give --budget {expected / 45.0:.0f} or more")
    left_out = len(every) - len(plan)
    print(f"{len(plan)} runs, about {format_seconds(expected)}" + (f"; {left_out} left out for the budget" if left_out else ""), file=sys.stderr, flush=True)
    rows = run_plan(laboratory, plan)
    chosen = [(choice.knob, choice.name) for choice in Results(rows.values()).recommended().values() if choice]
    rows = {**rows, **run_plan(laboratory, cases.check_cases(chosen))}
    print(f"all in {format_seconds(time.monotonic() - begin)}", file=sys.stderr, flush=True)
    return rows


def write(rows, options):
    """Page, CSV and picture."""
    results = Results(rows)
    if options.quick:
        results.target_key = results.recipe_key = ("implicit", "5e-6 s")
    picture = options.out.parent / "figures" / (options.out.stem + ".png")
    if results.target and results.recipe:
        from evp.accuracy_figure import pareto

        pareto(results, picture)
    options.out.write_text(page(results, f"figures/{picture.name}"), encoding="utf-8")


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--budget", type=float, default=30.0, metavar="MINUTES", help="default 30")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "accuracy_cost", help="specimens and results (default: %(default)s)")
    parser.add_argument("--fresh", action="store_true", help="forget the results that --work holds")
    parser.add_argument("--quick", action="store_true", help="a few short runs, to see that all of it works; needs --out")
    parser.add_argument("--table", type=pathlib.Path, metavar="CSV", help="write the page from these results, without any run")
    parser.add_argument("--out", type=pathlib.Path, help="default: doc/accuracy_cost.md")
    options = parser.parse_args(words)
    if options.budget <= 0.0:
        parser.error("--budget must be positive")
    if options.quick and not options.out:
        parser.error("--quick needs --out: its few runs are no page for doc/")
    options.out = options.out or CHECKOUT / "doc" / "accuracy_cost.md"
    try:
        if options.table:
            rows = read_results(options.table)
        else:
            rows = sweep(options)
            options.out.with_suffix(".csv").write_text(options.work.joinpath("results.csv").read_text(encoding="utf-8"), encoding="utf-8")
        write(rows.values(), options)
    except (RunError, OSError) as error:
        sys.exit(f"accuracy_cost.py: error: {error}")
    print(f"{options.out} and figures/{options.out.stem}.png", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
