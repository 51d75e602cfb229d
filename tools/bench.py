#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Times pair style evp/lj beside the styles that users might take instead, and writes doc/performance.md.

    tools/bench.py [--repeats 5] [--sections lattice build random effects scale ranks] [--million] [--quick]

All scenes of a section run in turn, several rounds; the ratios are those within a round. A section that is not run keeps its
part of the page. Times are LAMMPS' own (Pair,
Bond, Neigh, loop). EVP_LMP and EVP_MPIRUN as for the tests. --quick runs small scenes once, to see that all of it works.
"""

import argparse
import csv
import pathlib
import sys
import tempfile

from evp import bench_sections
from evp.bench_figure import draw
from evp.bench_run import Bench
from evp.bench_sections import Sizes
from evp.run import CHECKOUT, RunError

START, END = "<!-- table: tools/bench.py -->", "<!-- end of table -->"
SECTIONS = ("lattice", "build", "effects", "random", "scale", "ranks")


def part_mark(name):
    return f"<!-- part: {name} -->"


def read_doc(path):
    """The text of the doc; RunError without the markers."""
    text = path.read_text(encoding="utf-8")
    if text.count(START) != 1 or text.count(END) != 1:
        raise RunError(f"{path} must hold '{START}' and '{END}' once each")
    return text


def write_doc(path, parts):
    """Replaces the parts {section: lines} between the markers of the doc; the others stay."""
    text = read_doc(path)
    head, rest = text.split(START)
    middle, tail = rest.split(END)
    kept = {}
    for name in SECTIONS:
        if part_mark(name) in middle:
            kept[name] = middle.split(part_mark(name))[1].split("<!-- part: ")[0].strip("\n")
    kept.update({name: "\n".join(lines).strip("\n") for name, lines in parts.items()})
    blocks = [f"{part_mark(name)}\n{kept[name]}\n" for name in SECTIONS if name in kept]
    path.write_text(head + START + "\n" + "\n".join(blocks) + END + tail, encoding="utf-8")


def write_csv(path, parts, rows):
    """Replaces the rows of the sections that were run."""
    kept = []
    if path.exists():
        with open(path, newline="", encoding="utf-8") as source:
            kept = [row for row in csv.DictReader(source) if row.get("section") in SECTIONS and row["section"] not in parts]
    rows = sorted(kept + rows, key=lambda row: SECTIONS.index(row["section"]))
    with open(path, "w", newline="", encoding="utf-8") as target:
        writer = csv.DictWriter(target, ("section", "name", "x", "value"), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return rows


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5, help="rounds (default 5)")
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=SECTIONS, help="default: all")
    parser.add_argument("--million", action="store_true", help="with a lattice of 1 000 188 spheres, and a random specimen of 256 000 on two ranks (half an hour more)")
    parser.add_argument("--quick", action="store_true", help="small scenes, once; writes no doc unless --out is given")
    parser.add_argument("--out", type=pathlib.Path, help="default: doc/performance.md")
    options = parser.parse_args(words)
    if options.repeats < 1:
        parser.error("--repeats must be 1 at least")
    sizes = Sizes(options.quick, options.million)
    out = options.out or (None if options.quick else CHECKOUT / "doc" / "performance.md")
    parts, rows = {}, []
    try:
        if out:
            read_doc(out)  # before the runs, not after them
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(folder, 1 if options.quick else options.repeats)
            for name in options.sections:
                parts[name], data = getattr(bench_sections, name + "_section")(bench, sizes)
                rows += data
        if out:
            write_doc(out, parts)
            draw(write_csv(out.with_suffix(".csv"), parts, rows), out.parent / "figures" / (out.stem + ".png"))
    except (RunError, OSError) as error:
        sys.exit(f"bench.py: error: {error}")
    for lines in parts.values():
        print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
