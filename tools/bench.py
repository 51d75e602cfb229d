#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Times pair style evp/lj beside the styles that users might take instead, and writes doc/performance.md.

    tools/bench.py [--repeats 5] [--sections lattice build random effects scale ranks] [--million] [--quick]

All scenes of a section run in turn, several rounds; the ratios are those within a round. Times are LAMMPS' own (Pair,
Bond, Neigh, loop). EVP_LMP and EVP_MPIRUN as for the tests. --quick runs small scenes once, to see that all of it works.
"""

import argparse
import csv
import pathlib
import subprocess
import sys
import tempfile

from evp import bench_scenes as scenes
from evp.bench_run import Bench, median, ratios, run_scene, spread
from evp.run import CHECKOUT, DECKS, RunError, lammps_command

START, END = "<!-- table: tools/bench.py -->", "<!-- end of table -->"
SECTIONS = ("lattice", "build", "random", "scale", "ranks")


class Sizes:
    """What is run: cells of the lattice, steps, spheres of the random specimen, cells of the scale and of two ranks."""

    cells, steps, spheres, scale, ranks = 20, 200, 32000, (5, 13, 20, 40), 40

    def __init__(self, quick, million):
        if quick:
            self.cells, self.steps, self.spheres, self.scale, self.ranks = 5, 20, 500, (5, 6), 6
        elif million:
            self.scale += (63,)


def lattice_section(bench, sizes):
    """Time per interaction and step."""
    every = scenes.variants(sizes.cells, sizes.steps) + scenes.peers(sizes.cells, sizes.steps)
    results = bench.rounds(every, "lattice")
    cost = {}
    for scene in every:
        if scene.name in results:
            per = scene.steps * scene.atoms * scene.interactions * 1e-9
            cost[scene.name] = [timing.parts[scene.counted] / per for timing in results[scene.name]]
    lines = [f"### Pair loop\n\nFCC lattice of {4 * sizes.cells**3} spheres, {scenes.HALF_PAIRS} half pairs each within "
             f"{scenes.REACH} diameters, {sizes.steps} steps without a neighbor build, one core.\n",
             "| style | ns per interaction and step | over lj/cut | over evp/lj |", "|---|---|---|---|"]
    for name, values in cost.items():
        lines.append(f"| {name} | {spread(values)} | {spread(ratios(values, cost['lj/cut']))} | {spread(ratios(values, cost['evp/lj']))} |")
    table = results["evp/lj, pairs crossing xi_s"][-1].output.splitlines()
    share = float(table[table.index(next(line for line in table if line.startswith("Loop"))) - 1].split()[1]) / (9 * 4 * sizes.cells**3)
    lines.append(f"\nIn *pairs crossing xi_s* {100 * share:.0f} % of the pairs are in the second regime after {sizes.steps + 5} steps, none at the start.\n")
    rows = [{"style": name, "ns_per_interaction": f"{median(values):.4g}"} for name, values in cost.items()]
    return lines, rows


def build_section(bench, sizes):
    """What a neighbor build costs the pair style, beside LAMMPS' own share."""
    steps = max(20, sizes.steps // 4)
    pair = [scenes.ours("never", sizes.cells, steps), scenes.ours("every step", sizes.cells, steps, neigh=scenes.ALWAYS)]
    results = bench.rounds(pair, "build")
    extra = [(often.parts["Pair"] - never.parts["Pair"]) / often.builds for never, often in zip(results["never"], results["every step"])]
    neigh = [often.parts["Neigh"] / often.builds for often in results["every step"]]
    per = 1e-9 * pair[0].atoms * pair[0].interactions
    return [f"### Neighbor build\n\nThe same lattice with a build at every step; what packing with deq adds to Pair, per build.\n",
            "| | ns per pair and build | over LAMMPS' Neigh |", "|---|---|---|",
            f"| LAMMPS' Neigh | {spread([value / per for value in neigh])} | 1 |",
            f"| packing, pairs joined with their deq | {spread([value / per for value in extra])} | {spread(ratios(extra, neigh))} |\n"], []


def random_section(bench, sizes):
    """A whole step of the random specimen, beside lj/cut's."""
    make_specimen(bench.folder, sizes.spheres)
    every = [scenes.random_body(style, style, "random.data", sizes.steps) for style in ("evp/lj", "lj/cut")]
    results = bench.rounds(every, "random")
    cost = {name: [timing.loop / sizes.steps / timing.atoms * 1e9 for timing in timings] for name, timings in results.items()}
    return [f"### Whole step\n\nRandom specimen of {sizes.spheres} spheres by in.specimen, one core.\n",
            "| style | ns per particle and step | over lj/cut |", "|---|---|---|",
            *(f"| {name} | {spread(values, '%.0f')} | {spread(ratios(values, cost['lj/cut']))} |" for name, values in cost.items()), ""], []


def make_specimen(folder, spheres):
    """random.data by in.specimen, on two ranks; RunError with the end of its output where it failed."""
    command = [*lammps_command(2), "-in", str(DECKS / "in.specimen"), "-log", "none", "-var", "n", str(spheres), "-var", "out", "random.data"]
    run = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    if run.returncode:
        raise RunError("in.specimen failed; its output ends with\n" + run.stdout.decode(errors="replace")[-1500:])


def scale_section(bench, sizes):
    """Cost and memory per particle against their number."""
    lines = ["### Scale\n\nThe same lattice, one core; memory as LAMMPS counts it.\n",
             "| spheres | ns per particle and step | memory per particle [kB] |", "|---|---|---|"]
    every = [scenes.ours(f"{4 * cells**3} spheres", cells, max(20, min(2000, sizes.steps * 32000 // (4 * cells**3)))) for cells in sizes.scale]
    results = bench.rounds(every, "scale")
    for scene in every:
        cost = [timing.loop / scene.steps / scene.atoms * 1e9 for timing in results[scene.name]]
        lines.append(f"| {scene.atoms} | {spread(cost, '%.0f')} | {results[scene.name][-1].memory * 1024 / scene.atoms:.2f} |")
    return lines + [""], []


def ranks_section(bench, sizes):
    """A whole step on one and two ranks."""
    steps = max(20, sizes.steps // 4)
    every = [scenes.ours(f"{n} rank{'s' * (n > 1)}", sizes.ranks, steps, ranks=n, neigh=scenes.ALWAYS.replace("check no", "check yes")) for n in (1, 2)]
    results = bench.rounds(every, "ranks")
    one, two = ([timing.loop for timing in results[scene.name]] for scene in every)
    return [f"### Ranks\n\nLattice of {every[0].atoms} spheres: two ranks are {spread(ratios(one, two))} times as fast as one.\n"], []


def write_doc(path, lines):
    """Replaces what stands between the markers of the doc."""
    text = path.read_text(encoding="utf-8")
    if text.count(START) != 1 or text.count(END) != 1:
        raise RunError(f"{path} must hold '{START}' and '{END}' once each")
    head, tail = text.split(START)[0], text.split(END)[1]
    path.write_text("\n".join([head + START, *lines, END + tail]), encoding="utf-8")


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5, help="rounds (default 5)")
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=SECTIONS, help="default: all")
    parser.add_argument("--million", action="store_true", help="with a lattice of 1 000 188 spheres")
    parser.add_argument("--quick", action="store_true", help="small scenes, once; writes no doc unless --out is given")
    parser.add_argument("--out", type=pathlib.Path, help="default: doc/performance.md")
    options = parser.parse_args(words)
    if options.repeats < 1:
        parser.error("--repeats must be 1 at least")
    sizes = Sizes(options.quick, options.million)
    out = options.out or (None if options.quick else CHECKOUT / "doc" / "performance.md")
    lines, rows = [], []
    try:
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(folder, 1 if options.quick else options.repeats)
            for name in options.sections:
                text, data = globals()[name + "_section"](bench, sizes)
                lines += text
                rows += data
        if out:
            write_doc(out, lines)
            if rows:
                with open(out.with_suffix(".csv"), "w", newline="", encoding="utf-8") as target:
                    writer = csv.DictWriter(target, fieldnames=list(rows[0]))
                    writer.writeheader()
                    writer.writerows(rows)
    except (RunError, OSError) as error:
        sys.exit(f"bench.py: error: {error}")
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
