# SPDX-License-Identifier: GPL-2.0-only
"""The sections of doc/performance.md: what each runs, and its table.

A section takes the Bench that runs scenes in rounds and the Sizes, and returns the lines of its part of the page and what its
part of the CSV holds, {(name, x): value}.
"""

import math
import sys
import time
from statistics import median

from study import DECKS, RunError, deck_command, output_of, ratios, spread, table
import bench_scenes as scenes

WHOLE = "{:.0f}".format


class Sizes:
    """What is run: cells of the lattice, steps, spheres of the random specimen, cells of the scale, cells and spheres of two ranks."""

    cells, steps, spheres, scale, ranks, random_ranks = 20, 200, 32000, (5, 13, 20, 40), (20, 40), (32000,)

    def __init__(self, quick, million):
        if quick:
            self.cells, self.steps, self.spheres, self.scale, self.ranks, self.random_ranks = 5, 20, 500, (5, 6), (6,), (500,)
        elif million:
            self.scale += (63,)
            self.random_ranks += (256000,)


def summary(rows):
    """The first lines of the page, of medians: rows of its CSV. Empty where sections are missing."""
    value = {(row["section"], row["name"], row["x"]): float(row["value"]) for row in rows}
    scale = sorted((int(x), number) for (section, name, x), number in value.items() if section == "scale" and name == "evp/lj")
    two_ranks = [number for (section, name, _), number in value.items() if section == "ranks" and name.startswith("strong: random") and "lj/cut" not in name]
    factors = {name: number for (section, name, _), number in value.items() if section == "effects"}
    if not (scale and two_ranks and factors and ("lattice", "evp/lj", "") in value):
        return []

    def factor(start):
        return next((f"{number:.2f}" for name, number in factors.items() if name.startswith(start)), "-")

    return [f"Pair style evp/lj takes {value['lattice', 'evp/lj', '']:.3g} ns per interaction and step on one core, lj/cut {value['lattice', 'lj/cut', '']:.3g} ns and bpm/spring "
            f"{value.get(('lattice', 'bond bpm/spring', ''), float('nan')):.3g} ns on the same lattice.",
            f"A step takes {min(number for _, number in scale):.0f} to {max(number for _, number in scale):.0f} ns per sphere from {scale[0][0]} to {scale[-1][0]} spheres. "
            f"Two MPI ranks are {min(two_ranks):.1f} to {max(two_ranks):.1f} times faster than one on random specimens.",
            f"Run time of a step with an effect over that without it: explicit damping {factor('explicit damping')}, implicit damping {factor('implicit damping')} "
            "(with a much larger timestep size, see [implicit_cost.md](implicit_cost.md)),",
            f"plasticity isotropic {factor('plasticity isotropic, no pair')} to {factor('plasticity isotropic, pairs flow')}, break {factor('break')}, "
            f"fix evp/volume {factor('fix evp/volume')}, fix evp/energy at each step {factor('fix evp/energy')}."]


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
             f"{scenes.REACH} diameters, {sizes.steps} steps without a neighbor build, one core.\n"]
    lines += table(("style", "ns per interaction and step", "over lj/cut", "over evp/lj"), (
        (name, spread(values), spread(ratios(values, cost["lj/cut"])), spread(ratios(values, cost["evp/lj"]))) for name, values in cost.items()))
    last_row = results["evp/lj, pairs crossing xi_s"][-1].output.partition("\nLoop")[0].splitlines()[-1]
    share = float(last_row.split()[1]) / (scenes.HALF_PAIRS * 4 * sizes.cells**3)
    both = {name: [timing.parts["Pair"] + timing.parts["Comm"] for timing in results[name]] for name in cost if name.startswith("evp/lj")}
    own, sent = (spread(ratios(both["evp/lj, gamma > 0" + way], both["evp/lj"])) for way in ("", ", comm_modify vel yes"))
    lines.append(f"\nIn *pairs crossing xi_s* {100 * share:.0f} % of the pairs are in the second regime after {sizes.steps + 5} steps, and none at the start.")
    lines.append(f"Pair and Comm together, gamma > 0 over gamma = 0: {own} where the pair style sends the velocities of ghosts, {sent} with *comm_modify vel yes*, where LAMMPS does.\n")
    return lines, {(name, ""): median(values) for name, values in cost.items()}


def effects_section(bench, sizes):
    """What each effect adds to a whole step."""
    make_specimen(bench.folder, sizes.spheres)
    pairs = scenes.effects(sizes.cells, sizes.steps, "random.data")
    every = {scene.name: scene for _, *both in pairs for scene in both}
    results = bench.rounds(list(every.values()), "effects")
    saved, loops = {}, {}
    for title, with_it, without in pairs:
        both = [results[scene.name] for scene in (with_it, without)]
        if any(timing.builds for timings in both for timing in timings):
            raise RunError(f"effect '{title}': neighbor lists were built, which spoils the comparison")
        saved[title] = ratios(*([timing.loop for timing in timings] for timings in both))
        loops[title] = ratios(*([timing.parts["Pair"] for timing in timings] for timings in both))
    return ["### Cost of each effect\n\nThe same lattice (unless another body is named), one core; run time with the effect over run time without it.\n",
            *table(("effect", "whole step", "Pair"), ((title, spread(values), spread(loops[title])) for title, values in saved.items())), ""], {
                (title, ""): median(values) for title, values in saved.items()}


def build_section(bench, sizes):
    """Time of a neighbor build in the pair style, beside LAMMPS' own."""
    steps = max(20, sizes.steps // 4)
    pair = [scenes.ours("never", sizes.cells, steps), scenes.ours("every step", sizes.cells, steps, neigh=scenes.ALWAYS)]
    results = bench.rounds(pair, "build")
    extra = [(often.parts["Pair"] - never.parts["Pair"]) / often.builds for never, often in zip(results["never"], results["every step"])]
    neigh = [often.parts["Neigh"] / often.builds for often in results["every step"]]
    per = 1e-9 * pair[0].atoms * pair[0].interactions
    return ["### Neighbor build\n\nThe same lattice with a build at every step. The pair style packs its pairs with their deq at each build; this time is part of Pair.\n",
            *table(("", "ns per pair and build", "over LAMMPS' Neigh"), (
                ("LAMMPS' Neigh", spread([value / per for value in neigh]), 1),
                ("packing of the pairs with their deq", spread([value / per for value in extra]), spread(ratios(extra, neigh))))), ""], {
                    ("packing over Neigh", ""): median(ratios(extra, neigh))}


def random_section(bench, sizes):
    """A whole step of the random specimen, beside lj/cut's."""
    make_specimen(bench.folder, sizes.spheres)
    every = [scenes.random_body(style, style, "random.data", sizes.steps) for style in ("evp/lj", "lj/cut")]
    results = bench.rounds(every, "random")
    if any(timing.builds for timings in results.values() for timing in timings):
        raise RunError("whole step: neighbor lists were built, which spoils the comparison")
    cost = {name: [timing.loop / sizes.steps / timing.atoms * 1e9 for timing in timings] for name, timings in results.items()}
    return [f"### Whole step\n\nRandom specimen of {sizes.spheres} spheres by in.specimen, one core; the neighbor list is checked at each step and not rebuilt.\n",
            *table(("style", "ns per particle and step", "over lj/cut"), (
                (name, spread(values, WHOLE), spread(ratios(values, cost["lj/cut"]))) for name, values in cost.items())), ""], {
                    (name, sizes.spheres): median(values) for name, values in cost.items()}


def make_specimen(folder, spheres, name="random.data"):
    """A data file by in.specimen, on two ranks; the seconds that it took, 0 where it was there. RunError where it failed."""
    if (folder / name).exists():
        return 0.0
    print(f"in.specimen, {spheres} spheres on 2 ranks", file=sys.stderr, flush=True)
    begin = time.monotonic()
    output_of(deck_command(DECKS / "in.specimen", {"n": spheres, "out": name}, 2), folder, "in.specimen")
    return time.monotonic() - begin


def scale_section(bench, sizes):
    """Cost and memory per particle against their number."""
    both = []
    for cells in sizes.scale:
        steps = max(20, min(2000, sizes.steps * 32000 // (4 * cells**3)))
        both.append((scenes.ours(f"{4 * cells**3} spheres", cells, steps),
                     scenes.pair_peer("lj/cut", cells, steps, scenes.LENNARD_JONES, name=f"{4 * cells**3} spheres, lj/cut")))
    results = bench.rounds([scene for pair in both for scene in pair], "scale")
    costs = {scene.name: [timing.loop / scene.steps / scene.atoms * 1e9 for timing in results[scene.name]] for pair in both for scene in pair}
    rows, medians = [], {}
    for pair in both:
        own = pair[0]
        growth = [spread(ratios(costs[scene.name], costs[base.name])) for scene, base in zip(pair, both[1])]
        rows.append((own.atoms, spread(costs[own.name], WHOLE), *growth, f"{results[own.name][-1].memory * 1024 / own.atoms:.2f}"))
        medians.update({(name, own.atoms): median(costs[scene.name]) for name, scene in zip(("evp/lj", "lj/cut"), pair)})
    header = ("spheres", "ns per particle and step", f"over that of {both[1][0].atoms} spheres", f"lj/cut: over that of {both[1][0].atoms} spheres", "memory per particle [kB]")
    return ["### Scale\n\nThe same lattice, one core, whole steps. Memory as reported by LAMMPS.\n", *table(header, rows), ""], medians


def ranks_section(bench, sizes):
    """Whole steps on one and two ranks; and what follows for many ranks."""
    watched = scenes.ALWAYS.replace("check no", "check yes")
    lines, rows, speed, scaling = ["### Ranks\n"], [], {}, {}

    def steps(spheres):
        return sizes.steps if sizes.steps < 100 else max(100, min(1000, 32000000 // spheres))

    for cells in sizes.ranks:
        atoms = 4 * cells**3
        scaling[f"strong: lattice of {atoms}"] = [scenes.ours(f"lattice {atoms}, {n} rank", cells, steps(atoms), ranks=n, neigh=watched) for n in (1, 2)]
        scaling[f"weak: lattice of {atoms} per rank"] = [
            scenes.ours(f"lattice {atoms} per rank, {n} rank", cells, steps(2 * atoms), ranks=n, neigh=watched, long=n * cells) for n in (1, 2)]
    for spheres in sizes.random_ranks:
        name = "random.data" if spheres == sizes.spheres else f"random_{spheres}.data"
        took = make_specimen(bench.folder, spheres, name)
        if took:
            lines.append(f"Packing of the random specimen of {spheres} spheres by in.specimen on two MPI ranks: {took:.0f} s.\n")
        for style, title in (("evp/lj", ""), ("lj/cut", ", lj/cut")):
            scaling[f"strong: random specimen of {spheres}{title}"] = [
                scenes.random_body(f"random {spheres}, {n} rank{title}", style, name, steps(spheres), ranks=n) for n in (1, 2)]
    results = bench.rounds([scene for both in scaling.values() for scene in both], "ranks")
    for title, both in scaling.items():
        one, two = ([timing.loop for timing in results[scene.name]] for scene in both)
        share = [100.0 * timing.parts["Comm"] / timing.loop for timing in results[both[1].name]]
        rows.append((title, spread(ratios(one, two)), spread(share, WHOLE) + " %"))
        speed[title, 2] = median(ratios(one, two))
    lines += ["The neighbor list is checked at each step and not rebuilt.\n",
              *table(("body", "two MPI ranks over one: speed-up (strong), efficiency (weak)", "Comm, share of the loop on two MPI ranks"), rows)]
    weak = next(both[0] for title, both in scaling.items() if title.startswith("weak"))
    return lines + [""] + many_ranks(weak, results[weak.name]), speed


NODE_BANDWIDTH, RANKS_PER_NODE, LATENCY, RANKS = 12.5e9, 32, 2e-6, 4096  # [byte/s], [1], [s], [1]: assumptions, a common network of today
MESSAGES = 12  # of a step: six neighbors, positions out and forces back
BYTES = 24 + 48  # per ghost and step: positions; forces and, of atom_style sphere, torques
VELOCITY_BYTES = 24  # with gamma > 0, by six messages more


def ghosts_of(particles):
    """Ghosts about a cube of so many particles of the lattice."""
    reach = scenes.REACH + scenes.SKIN
    side = (particles / 2**0.5) ** (1 / 3)  # of the cube, in diameters: the lattice has sqrt(2) spheres in each cubed
    return 2**0.5 * ((side + 2.0 * reach) ** 3 - side**3)


def many_ranks(scene, timings):
    """An estimate of a step on many ranks from the surface of a rank's cube of particles; timings: of one rank."""
    ghosts = median([timing.ghosts for timing in timings])
    work = median([(timing.parts["Pair"] + timing.parts["Modify"]) / scene.steps / scene.atoms for timing in timings])
    copy = median([timing.parts["Comm"] / scene.steps / timing.ghosts for timing in timings])
    looks = 2.0 * math.log2(RANKS) * LATENCY
    lines = ["#### Many MPI ranks, estimated\n",
             f"Measured on one MPI rank, lattice of {scene.atoms}: {1e9 * work:.0f} ns of forces and time integration per particle and step, "
             f"{1e9 * copy:.1f} ns of copies per ghost, {ghosts:.0f} ghosts (the formula for a cube gives {ghosts_of(scene.atoms):.0f}).",
             f"Assumed: {RANKS} ranks, cubes, equal work, the cost per particle that of this number; {MESSAGES} messages per step, one after the other, "
             f"{1e6 * LATENCY:g} us each; {BYTES} bytes per ghost (gamma > 0: {BYTES + VELOCITY_BYTES}, and {MESSAGES // 2} more messages),",
             f"all of which leave the node (the worst case), where {RANKS_PER_NODE} ranks share {1e-9 * NODE_BANDWIDTH:g} GB/s; "
             "one check of the neighbor list per step, a reduction over a tree; no overlap of work and messages; no neighbor builds.",
             "Efficiency is work over the sum.\n"]
    rows = []
    for n in (100000, 30000, 10000, 3000, 1000):
        parts = (work * n, copy * ghosts_of(n), BYTES * ghosts_of(n) * RANKS_PER_NODE / NODE_BANDWIDTH, MESSAGES * LATENCY, looks)
        rows.append((n, f"{ghosts_of(n):.0f}", *(f"{1e6 * part:.0f}" for part in parts), f"{parts[0] / sum(parts):.2f}"))
    header = ("particles per rank", "ghosts", "work [us]", "copies [us]", "network [us]", "latency [us]", "reduction [us]", "efficiency")
    return [*lines, *table(header, rows), ""]
