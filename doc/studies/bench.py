#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Times pair style evp/lj beside other styles for the same bodies, and writes doc/performance.md.

    doc/studies/bench.py [--repeats 5] [--sections lattice build random effects scale ranks] [--million] [--quick]

All styles of a section run in turn, several rounds; ratios are taken within a round. A section that is not run keeps its part of
the page. Times are those of LAMMPS' breakdown (Pair, Bond, Neigh, Comm, loop). --quick runs small bodies once, to test the tool.
Uses the lmp of this checkout, or EVP_LMP and EVP_MPIRUN.
"""

import csv
import pathlib
import tempfile

from study import CHECKOUT, command_line, errors_in_one_line, split_at_marks, write_csv
import bench_sections
from bench_figure import draw
from bench_run import Bench
from bench_sections import Sizes

MARKS = "<!-- table: doc/studies/bench.py -->", "<!-- end of table -->"
SUMMARY = "<!-- summary: doc/studies/bench.py -->", "<!-- end of summary -->"
SECTIONS = ("lattice", "build", "effects", "random", "scale", "ranks")


def part_mark(name):
    return f"<!-- part: {name} -->"


def write_doc(path, parts):
    """Replaces the parts {section: lines} between the marks of the doc; the others stay."""
    head, middle, tail = split_at_marks(path, *MARKS)
    kept = {name: middle.split(part_mark(name))[1].split("<!-- part: ")[0].strip("\n") for name in SECTIONS if part_mark(name) in middle}
    kept.update({name: "\n".join(lines).strip("\n") for name, lines in parts.items()})
    blocks = [f"{part_mark(name)}\n{kept[name]}\n" for name in SECTIONS if name in kept]
    path.write_text("".join((head, MARKS[0], "\n", "\n".join(blocks), MARKS[1], tail)), encoding="utf-8")


def write_summary(path, rows):
    """Replaces what stands between the marks of the summary, where the doc has them, by that of the CSV's rows."""
    lines = bench_sections.summary(rows)
    if lines and SUMMARY[0] in path.read_text(encoding="utf-8"):
        head, _, tail = split_at_marks(path, *SUMMARY)
        path.write_text("".join((head, SUMMARY[0], "\n", "\n".join(lines), "\n", SUMMARY[1], tail)), encoding="utf-8")


def renew_csv(path, parts, rows):
    """All rows of the CSV, those of the sections that were run replaced."""
    kept = []
    if path.exists():
        with open(path, newline="", encoding="utf-8") as source:
            kept = [row for row in csv.DictReader(source) if row.get("section") in SECTIONS and row["section"] not in parts]
    rows = sorted(kept + rows, key=lambda row: SECTIONS.index(row["section"]))
    write_csv(path, ("section", "name", "x", "value"), rows)
    return rows


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--repeats", type=int, default=5, help="rounds (default 5)")
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=SECTIONS, help="default: all")
    parser.add_argument("--million", action="store_true", help="add a lattice of 1 000 188 spheres and a random specimen of 256 000 (half an hour more)")
    parser.add_argument("--quick", action="store_true", help="small bodies, once; writes no page unless --out is given")
    parser.add_argument("--out", type=pathlib.Path, help="default: doc/performance.md")
    options = parser.parse_args(words)
    if options.repeats < 1:
        parser.error("--repeats must be at least 1")
    sizes = Sizes(options.quick, options.million)
    out = options.out or (None if options.quick else CHECKOUT / "doc" / "performance.md")
    parts, rows = {}, []
    with errors_in_one_line("bench.py"), tempfile.TemporaryDirectory() as folder:
        if out:
            split_at_marks(out, *MARKS)  # before the runs, not after them
        bench = Bench(folder, 1 if options.quick else options.repeats)
        for name in options.sections:
            parts[name], data = getattr(bench_sections, name + "_section")(bench, sizes)
            rows += [{"section": name, "name": title, "x": x, "value": f"{value:.4g}"} for (title, x), value in data.items()]
        if out:
            write_doc(out, parts)
            kept = renew_csv(out.with_suffix(".csv"), parts, rows)
            write_summary(out, kept)
            draw(kept, out.parent / "figures" / (out.stem + ".png"))
    for lines in parts.values():
        print("\n".join(lines))


if __name__ == "__main__":
    main()
