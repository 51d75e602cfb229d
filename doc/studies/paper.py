#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Bring the numbers and figures of the page on the paper up to date with a run of the quick start.

    tools/quickstart.sh && doc/studies/paper.py

Reads results/quickstart/summary.csv, rewrites the table between the two marks of doc/Howto_evp_paper.rst,
copies the pictures with their CSV files to doc/figures, and draws the specimen there. Nothing else of the page is touched.
"""

import csv
import pathlib
import shutil

from study import CHECKOUT, command_line, errors_in_one_line, list_table, store_picture, write_between
import view

PAGE = CHECKOUT / "doc" / "Howto_evp_paper.rst"
MARKS = ".. table: doc/studies/paper.py\n", ".. end of table"
TITLES = {
    "table": "parameters",
    "rate_per_s": "rate [1/s]",
    "E_GPa": "E [GPa]",
    "yield_MPa": "0.2 % yield [MPa]",
    "stress_1pc_MPa": "stress at 1 % [MPa]",
    "first_second_regime": "first bond beyond xi_s at strain",
}
PICTURES = ("force_law", "stress_strain", "unloading")
FIGURES = CHECKOUT / "doc" / "figures"


def main(argv=None):
    parser = command_line(__doc__)
    parser.add_argument("--results", type=pathlib.Path, default=CHECKOUT / "results" / "quickstart", metavar="DIR")
    args = parser.parse_args(argv)
    with errors_in_one_line("paper.py"):
        with open(args.results / "summary.csv", newline="", encoding="utf-8") as source:
            rows = list(csv.DictReader(source))
        if not rows or list(rows[0]) != list(TITLES):
            raise ValueError(f"{source.name} is not the summary of a quick start")
        lines = [TITLES.values(), *([row["table"].replace("table", "Table "), *list(row.values())[1:]] for row in rows)]
        write_between(PAGE, *MARKS, list_table(lines))
        for picture in PICTURES:
            for suffix in (".png", ".png.csv"):
                shutil.copy(args.results / (picture + suffix), FIGURES)
        view.main([str(args.results / "table1_rate10_state.dump"), "--color", "share_second", "--pixels", "500", "--out", str(args.results / "specimen.png")])
        store_picture(args.results / "specimen.png", FIGURES)


if __name__ == "__main__":
    main()
