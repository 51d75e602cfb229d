#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Times pair style evp/lj beside other styles for the same bodies, and writes the tables of doc/performance.md.

    doc/studies/bench.py [--repeats 5] [--sections lattice bonds build random effects scale ranks messages] [--ranks 2] [--million] [--quick]

All styles of a section run in turn, several rounds; ratios are taken within a round. A section that is not run keeps its part of
the page. Times are those of LAMMPS' breakdown (Pair, Bond, Neigh, Comm, loop). --quick runs small bodies once, to test the tool.
Uses the lmp of this checkout, by tools/setup.sh --peers, or EVP_LMP and EVP_MPIRUN: with fewer than 8 cores the messages need EVP_MPIRUN="mpirun --oversubscribe".
"""

import csv
import os
import pathlib
import re
import sys
import tempfile
import time
from statistics import median
from typing import NamedTuple

from study import (CHECKOUT, DECKS, RunError, command_line, deck_command, errors_in_one_line, lammps_command, output_of, ratios, section_marks, split_at_marks, spread,
                   table, watched, write_between, write_csv)
import bench_scenes as scenes
from evp import efficiency, figures

LOOP = re.compile(r"^Loop time of (\S+) on .* with (\d+) atoms", re.M)
LINE = re.compile(r"^(Pair|Bond|Neigh|Comm|Modify) +\| +\S+ +\| +(\S+)", re.M)  # mean over the ranks
MEMORY = re.compile(r"^Per MPI rank memory allocation \(min/avg/max\) = \S+ \| (\S+) \|", re.M)
BUILDS = re.compile(r"^Neighbor list builds = (\d+)", re.M)
WHOLE = "{:.0f}".format
OWN, OTHER = "#0072B2", "#999999"


def marks(section):
    """Around what a section writes."""
    return section_marks(section, "doc/studies/bench.py")


class Timing(NamedTuple):
    """One run of a scene [s]; memory [MB], over all ranks, as LAMMPS counts it; output: of the last run."""

    loop: float
    parts: dict
    atoms: int
    builds: int
    memory: float
    output: str


def run_scene(scene, folder):
    """The Timing of a scene's last run; RunError with the end of the output where it failed."""
    (folder / "scene.lmp").write_text(scene.deck, encoding="utf-8")
    output = output_of(deck_command("scene.lmp", {}, scene.ranks), folder, f"scene '{scene.name}'")
    if not LOOP.search(output):
        raise RunError(f"scene '{scene.name}' ran no timestep")
    last = output[output.rindex("Per MPI rank memory"):]
    loop, atoms = LOOP.findall(last)[-1]
    return Timing(float(loop), {name: float(mean) for name, mean in LINE.findall(last)}, int(atoms), int((BUILDS.findall(last) or [0])[-1]),
                  float(MEMORY.findall(last)[-1]) * scene.ranks, last)


class Bench:
    """Rounds of scenes, with the time left on stderr. What is run: cells of the lattice, steps, spheres of the random specimen, cells of the scale, cells and spheres on ranks,
    numbers of ranks, those on which messages are counted."""

    cells, steps, spheres, scale, ranks, random_ranks, counted = 20, 200, 32000, (5, 13, 20, 40), (20, 40), (32000,), (2, 4, 8)

    def __init__(self, folder, repeats, quick=False, million=False, most=2):
        self.folder, self.repeats, self.counts = pathlib.Path(folder), 1 if quick else repeats, [2**k for k in range(most.bit_length())]
        self.words = set(output_of([*lammps_command(), "-h"], folder, "lmp -h").split())  # the names of all styles among them
        if quick:
            self.cells, self.steps, self.spheres, self.scale, self.ranks, self.random_ranks, self.counted = 5, 20, 500, (5, 6), (6,), (500,), (2,)
        elif million:
            self.scale, self.random_ranks = (*self.scale, 63), (*self.random_ranks, 256000)

    def rounds(self, every, title, may_build=False):
        """{name: [Timing of each round]} of the scenes whose style this LAMMPS has. RunError where neighbor lists were built."""
        held = [scene for scene in every if not scene.needs or scene.needs in self.words]
        if len(held) < len(every):
            print(f"left out: {', '.join(scene.name for scene in every if scene not in held)}: tools/setup.sh --peers builds a LAMMPS that has them", file=sys.stderr)
        found = {scene.name: [] for scene in held}
        for scene in watched(title, self.repeats * held, lambda scene: scene.name):  # in turn, so that a slow moment of the machine meets all
            found[scene.name].append(run_scene(scene, self.folder))
        built = [name for name, timings in found.items() if not may_build and any(timing.builds for timing in timings)]
        if built:
            raise RunError(f"{title}: neighbor lists were built in {', '.join(built)}, which spoils the comparison")
        return found

    def specimen(self, spheres, name="random.data"):
        """Makes a data file by in.specimen, on the most ranks; the seconds that it took, 0 where it was there."""
        if (self.folder / name).exists():
            return 0.0
        print(f"in.specimen, {spheres} spheres on {self.counts[-1]} ranks", file=sys.stderr, flush=True)
        begin = time.monotonic()
        output_of(deck_command(DECKS / "in.specimen", {"n": spheres, "out": name}, self.counts[-1]), self.folder, "in.specimen")
        return time.monotonic() - begin


def lattice_section(bench):
    """Time per interaction and step."""
    every = {scene.name: scene for scene in scenes.variants(bench.cells, bench.steps) + scenes.peers(bench.cells, bench.steps)}
    results = bench.rounds(every.values(), "lattice")
    cost = {name: [1e9 * timing.parts[every[name].counted] / every[name].steps / every[name].atoms / every[name].interactions for timing in timings]
            for name, timings in results.items()}
    last_row = results["evp/lj, pairs crossing xi_s"][-1].output.partition("\nLoop")[0].splitlines()[-1]
    share = float(last_row.split()[1]) / (scenes.HALF_PAIRS * 4 * bench.cells**3)
    return [f"### Pair loop\n\nFCC lattice of {4 * bench.cells**3} spheres, {scenes.HALF_PAIRS} half pairs each within "
            f"{scenes.REACH} diameters, {bench.steps} steps without a neighbor build, one core.\n",
            *table(("style", "ns per interaction and step", "over lj/cut", "over evp/lj"), (
                (name, spread(values), spread(ratios(values, cost["lj/cut"])), spread(ratios(values, cost["evp/lj"]))) for name, values in cost.items())),
            f"\nIn *pairs crossing xi_s* {100 * share:.0f} % of the pairs are in the second regime after {bench.steps + 5} steps, and none at the start."], {
                (name, ""): median(values) for name, values in cost.items()}


def bonds_section(bench):
    """Whole steps and memory beside LAMMPS' bonded styles."""
    steps = 5 * bench.steps
    every = {scene.name: scene for scene in scenes.bonded(bench.cells, steps)}
    results = bench.rounds(every.values(), "bonds")
    speed = {name: [1e-6 * steps * timing.atoms / timing.loop for timing in timings] for name, timings in results.items()}
    return [f"### Beside bonded styles\n\nThe same lattice of {4 * bench.cells**3} spheres, {steps} steps, one core, {scenes.HALF_PAIRS} bonds per sphere; memory of the whole run, "
            "as LAMMPS counts it. bpm/spring/plastic is in LAMMPS from 2Apr2025 on: `EVP_LMP` names such an lmp.\n",
            *table(("style", "million particle-steps per second", "over evp/lj", "bytes per bond"), (
                (name, spread(values), spread(ratios(values, speed["evp/lj"])), f"{results[name][-1].memory * 2**20 / every[name].atoms / scenes.HALF_PAIRS:.0f}")
                for name, values in speed.items()))], {(name, ""): median(values) for name, values in speed.items()}


def build_section(bench):
    """Time of a neighbor build in the pair style, beside LAMMPS' own."""
    steps = max(20, bench.steps // 4)
    pair = [scenes.ours("never", bench.cells, steps), scenes.ours("every step", bench.cells, steps, neigh=scenes.ALWAYS)]
    results = bench.rounds(pair, "build", may_build=True)
    extra = [(often.parts["Pair"] - never.parts["Pair"]) / often.builds for never, often in zip(results["never"], results["every step"])]
    neigh = [often.parts["Neigh"] / often.builds for often in results["every step"]]
    per = 1e-9 * pair[0].atoms * pair[0].interactions
    return ["### Neighbor build\n\nThe same lattice with a build at every step. The pair style packs its pairs with their deq at each build; this time is part of Pair.\n",
            *table(("", "ns per pair and build", "over LAMMPS' Neigh"), (
                ("LAMMPS' Neigh", spread([value / per for value in neigh]), 1),
                ("packing of the pairs with their deq", spread([value / per for value in extra]), spread(ratios(extra, neigh)))))], {
                    ("packing over Neigh", ""): median(ratios(extra, neigh))}


def effects_section(bench):
    """What each effect adds to a whole step."""
    bench.specimen(bench.spheres)
    pairs = scenes.effects(bench.cells, bench.steps, "random.data")
    results = bench.rounds({scene.name: scene for _, *both in pairs for scene in both}.values(), "effects")
    step, loop = ({title: ratios(*([time_of(timing) for timing in results[scene.name]] for scene in both)) for title, *both in pairs}
                  for time_of in (lambda timing: timing.loop, lambda timing: timing.parts["Pair"]))
    return ["### Cost of each effect\n\nThe same lattice (unless another body is named), one core; run time with the effect over run time without it.\n",
            *table(("effect", "whole step", "Pair"), ((title, spread(values), spread(loop[title])) for title, values in step.items()))], {
                (title, ""): median(values) for title, values in step.items()}


def random_section(bench):
    """A whole step of the random specimen, beside lj/cut's."""
    bench.specimen(bench.spheres)
    results = bench.rounds([scenes.random_body(style, style, "random.data", bench.steps) for style in ("evp/lj", "lj/cut")], "random")
    cost = {name: [timing.loop / bench.steps / timing.atoms * 1e9 for timing in timings] for name, timings in results.items()}
    return [f"### Whole step\n\nRandom specimen of {bench.spheres} spheres by in.specimen, one core; the neighbor list is checked at each step and not rebuilt.\n",
            *table(("style", "ns per particle and step", "over lj/cut"), (
                (name, spread(values, WHOLE), spread(ratios(values, cost["lj/cut"]))) for name, values in cost.items()))], {
                    (name, bench.spheres): median(values) for name, values in cost.items()}


def scale_section(bench):
    """Cost and memory per particle against their number."""
    both = []
    for cells in bench.scale:
        steps = max(20, min(2000, bench.steps * 32000 // (4 * cells**3)))
        both.append((scenes.ours(f"{4 * cells**3} spheres", cells, steps),
                     scenes.pair_peer("lj/cut", cells, steps, scenes.LENNARD_JONES, name=f"{4 * cells**3} spheres, lj/cut")))
    results = bench.rounds([scene for pair in both for scene in pair], "scale")
    costs = {scene.name: [timing.loop / scene.steps / scene.atoms * 1e9 for timing in results[scene.name]] for pair in both for scene in pair}
    base = both[1]
    rows = [(pair[0].atoms, spread(costs[pair[0].name], WHOLE), *(spread(ratios(costs[scene.name], costs[one.name])) for scene, one in zip(pair, base)),
             f"{results[pair[0].name][-1].memory * 1024 / pair[0].atoms:.2f}") for pair in both]
    header = ("spheres", "ns per particle and step", f"over that of {base[0].atoms} spheres", f"lj/cut: over that of {base[0].atoms} spheres", "memory per particle [kB]")
    return ["### Scale\n\nThe same lattice, one core, whole steps. Memory as reported by LAMMPS.\n", *table(header, rows)], {
        (name, pair[0].atoms): median(costs[scene.name]) for pair in both for name, scene in zip(("evp/lj", "lj/cut"), pair)}


def ranks_section(bench):
    """Whole steps on one rank and on several."""
    def steps(spheres):
        return bench.steps if bench.steps < 100 else max(100, min(1000, 32000000 // spheres))

    lines, scaling, most = [f"### Ranks\n\nOn a machine of {os.cpu_count()} cores.\n"], {}, bench.counts[-1]
    for cells in bench.ranks:
        atoms = 4 * cells**3
        for title, weak in ((f"strong: lattice of {atoms}", False), (f"weak: lattice of {atoms} per rank", True)):
            scaling[title] = [scenes.ours(f"{title}, {n} rank", cells, steps(most * atoms if weak else atoms), ranks=n, neigh=scenes.WATCHED, long=cells * (n if weak else 1))
                              for n in bench.counts]
    for spheres in bench.random_ranks:
        name = "random.data" if spheres == bench.spheres else f"random_{spheres}.data"
        took = bench.specimen(spheres, name)
        if took:
            lines.append(f"Packing of the random specimen of {spheres} spheres by in.specimen on {most} MPI ranks: {took:.0f} s.\n")
        for style, title in (("evp/lj", ""), ("lj/cut", ", lj/cut")):
            scaling[f"strong: random specimen of {spheres}{title}"] = [
                scenes.random_body(f"random {spheres}, {n} rank{title}", style, name, steps(spheres), ranks=n) for n in bench.counts]
    results = bench.rounds([scene for every in scaling.values() for scene in every], "ranks")
    loops = {title: [[timing.loop for timing in results[scene.name]] for scene in every] for title, every in scaling.items()}
    speed = {title: [ratios(first, other) for other in others] for title, (first, *others) in loops.items()}
    share = {title: [100.0 * timing.parts["Comm"] / timing.loop for timing in results[every[-1].name]] for title, every in scaling.items()}
    return [*lines, "Speed-up over one MPI rank (strong), efficiency (weak). The neighbor list is checked at each step and not rebuilt.\n",
            *table(("body", *(f"{n} MPI ranks" for n in bench.counts[1:]), f"Comm, share of the loop on {most}"),
                   ((title, *map(spread, values), spread(share[title], WHOLE) + " %") for title, values in speed.items()))], {
                       (title, n): median(value) for title, values in speed.items() for n, value in zip(bench.counts[1:], values)}


def messages_section(bench):
    """What a rank sends in a step."""
    counter = pathlib.Path(os.environ.get("EVP_BUILD") or CHECKOUT / "build") / "unit" / "count_collectives.so"
    if not counter.is_file():
        raise RunError(f"no {counter}: build the tests")
    heat = f"{scenes.HEAT}\nfix step all dt/evp 100 0.4 max 1e-3\nfix ledger all evp/energy"
    kinds = {"lj/cut": lambda n, steps: scenes.pair_peer("lj/cut", 10, steps, scenes.LENNARD_JONES)._replace(ranks=n),
             "evp/lj": lambda n, steps: scenes.ours("evp/lj", 10, steps, ranks=n),
             "evp/lj, all of a forming scene and heat": lambda n, steps: scenes.ours(
                 "forming", 10, steps, contact="repulsive", row=scenes.CROSSING, rules=scenes.PLASTIC, more=f"{scenes.VOLUME}\n{heat}", ranks=n)}
    rows, found = [], {}
    for name, scene in kinds.items():
        cells = []
        for n in bench.counted:
            few, many = (counted(scene(n, steps), bench.folder, counter) for steps in (100, 300))
            reductions, messages = ((after - before) / 200 for before, after in zip(few, many))
            cells += [f"{messages:.2f}", f"{reductions:.2f}"]
            found[f"{name}, messages", n], found[f"{name}, reductions", n] = messages, reductions
        rows.append((name, *cells))
    header = ("pair style", *(f"{what} on {n} MPI ranks" for n in bench.counted for what in ("messages", "reductions")))
    return ["### Messages\n",
            "Of the first rank, in a step without a neighbor build: the lattice of 4000 spheres. A reduction goes over all ranks; from 2 to 8 ranks their number stays.\n",
            *table(header, rows)], found


def counted(scene, folder, counter):
    """Reductions and messages of the first rank in a whole run."""
    count = folder / "count.txt"
    (folder / "scene.lmp").write_text(scene.deck, encoding="utf-8")
    preloaded = ["env", f"LD_PRELOAD={counter}", f"EVP_COUNT_COLLECTIVES={count}"]
    output_of([*preloaded, *deck_command("scene.lmp", {}, scene.ranks)], folder, f"scene '{scene.name}'")
    return [int(number) for number in count.read_text(encoding="utf-8").split()]


SECTIONS = {"lattice": lattice_section, "bonds": bonds_section, "build": build_section, "effects": effects_section, "random": random_section, "scale": scale_section, "ranks": ranks_section,
            "messages": messages_section}


def summary(rows):
    """The first lines of the page, of medians: rows of its CSV. Empty where sections are missing."""
    value = {(row["section"], row["name"], row["x"]): float(row["value"]) for row in rows}
    scale = sorted((int(x), number) for (section, name, x), number in value.items() if section == "scale" and name == "evp/lj")
    ranks = [(int(x), number) for (section, name, x), number in value.items() if section == "ranks" and name.startswith("strong: random") and "lj/cut" not in name]
    most = max(ranks, default=(0, 0))[0]
    speed_ups = [number for x, number in ranks if x == most]
    factors = {name: number for (section, name, _), number in value.items() if section == "effects"}
    if not (scale and speed_ups and factors and ("lattice", "evp/lj", "") in value):
        return []

    fit = efficiency.fitted(rows)

    def factor(start):
        return next((f"{number:.2f}" for name, number in factors.items() if name.startswith(start)), "-")

    return [f"Pair style evp/lj takes {value['lattice', 'evp/lj', '']:.3g} ns per interaction and step on one core, lj/cut {value['lattice', 'lj/cut', '']:.3g} ns and bpm/spring "
            f"{value.get(('lattice', 'bond bpm/spring', ''), float('nan')):.3g} ns on the same lattice.",
            f"A step takes {min(number for _, number in scale):.0f} to {max(number for _, number in scale):.0f} ns per sphere from {scale[0][0]} to {scale[-1][0]} spheres. "
            f"{most} MPI ranks are {min(speed_ups):.1f} to {max(speed_ups):.1f} times faster than one on random specimens.",
            f"Run time of a step with an effect over that without it: explicit damping {factor('explicit damping')}, implicit damping {factor('implicit damping')}, "
            f"with Table 2 {factor('implicit damping of Table 2')} (with a much larger timestep, see [accuracy](accuracy_cost.md)),",
            f"plasticity isotropic {factor('plasticity isotropic, no pair')} to {factor('plasticity isotropic, pairs flow')}, break {factor('break')}, "
            f"fix evp/volume {factor('fix evp/volume')}, fix evp/energy at each step {factor('fix evp/energy')}.",
            f"Efficiency of R MPI ranks with N spheres, r of them on each host: 1/(1 + {fit.host:.3g} (r - 1) + {fit.surface:.3g} (R/N)^(1/3)), a fit to the rows of evp/lj under "
            f"*Ranks*, to at most {fit.most} ranks of one host, within {100 * fit.off:.0f} %. *evp cost* takes it for more ranks than your machine has cores."]


def draw(rows, path):
    """Time per interaction of each style. Writes path, from rows of the CSV."""
    bars = sorted(((row["name"], float(row["value"])) for row in rows if row["section"] == "lattice"), key=lambda bar: -bar[1])
    if not bars:
        return
    names, values = zip(*bars)
    path.parent.mkdir(parents=True, exist_ok=True)
    with figures.plt.rc_context(figures.LOOK):
        figure, axis = figures.plt.subplots(figsize=(8.0, 4.8))
        axis.barh(names, values, color=[OWN if name.startswith("evp/lj") else OTHER for name in names])
        for place, value in enumerate(values):
            axis.text(value, place, f" {value:.3g}", va="center", fontsize=9)
        axis.set(xscale="log", xlim=(0.6 * min(values), 1.6 * max(values)), xlabel="ns per interaction and step, one core", title="FCC lattice, 9 half pairs per sphere")
        axis.set_xticks((2, 5, 10, 20, 50))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_locator(figures.plt.NullLocator())
        axis.grid(axis="y", visible=False)
        figure.savefig(path, bbox_inches="tight")
        figures.plt.close(figure)


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--repeats", type=int, default=5, help="rounds (default 5)")
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="default: all")
    parser.add_argument("--ranks", type=int, default=2, help="most MPI ranks, a power of two (default 2)")
    parser.add_argument("--million", action="store_true", help="add a lattice of 1 000 188 spheres and a random specimen of 256 000 (half an hour more)")
    parser.add_argument("--quick", action="store_true", help="small bodies, once; writes no page unless --out is given")
    parser.add_argument("--out", type=pathlib.Path, help="default: doc/performance.md")
    options = parser.parse_args(words)
    if options.repeats < 1 or options.ranks < 2:
        parser.error("--repeats must be at least 1, --ranks at least 2")
    out = options.out or (None if options.quick else CHECKOUT / "doc" / "performance.md")
    parts, rows = {}, []
    with errors_in_one_line("bench.py"), tempfile.TemporaryDirectory() as folder:
        for name in (*options.sections, "summary") if out else ():
            split_at_marks(out, *marks(name))  # before the runs, not after them
        bench = Bench(folder, options.repeats, options.quick, options.million, options.ranks)
        for name in options.sections:
            parts[name], data = SECTIONS[name](bench)
            print("\n".join(parts[name]), end="\n\n")
            rows += [{"section": name, "name": title, "x": x, "value": f"{value:.4g}"} for (title, x), value in data.items()]
        if out:
            path = out.with_suffix(".csv")
            if path.exists():  # rows of the sections that were not run stay
                with open(path, newline="", encoding="utf-8") as source:
                    rows += [row for row in csv.DictReader(source) if row.get("section") in SECTIONS and row["section"] not in parts]
            rows.sort(key=lambda row: list(SECTIONS).index(row["section"]))
            write_csv(path, ("section", "name", "x", "value"), rows)
            for name, lines in {**parts, "summary": summary(rows)}.items():
                write_between(out, *marks(name), "".join(f"{line}\n" for line in lines))
            draw(rows, out.parent / "figures" / (out.stem + ".png"))


if __name__ == "__main__":
    main()
