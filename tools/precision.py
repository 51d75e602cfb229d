#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What double precision costs the pair loop, and what mixed and single precision would spoil: doc/precision.md.

    tools/precision.py [--repeats 100] [--cells 20 40] [--steps 20000] [--build build] [--out doc/precision.md]

Builds tests/precision, the loop of src/core/force_loop.h with its floating-point types left open, and runs it without LAMMPS:
times in rounds with all variants on all instruction sets of this machine in a new order each, errors of the forces
against a sum in long double, and the energy of a body that rings. About two minutes on an idle core.
"""

import argparse
import csv
import pathlib
import shutil
import statistics
import subprocess
import sys

from evp.run import CHECKOUT, RunError

KERNEL, DOUBLE, MIXED, FLOAT, SINGLE = "force_loop.h", "double", "mixed", "mixed, float positions", "single"
CAREFUL = "mixed, strain in double"
RINGING_CELLS = 5
TOLD_STRAIN, TOLD_RINGING = 1e-4, 1e-5  # of those that the program prints, the ones in the text
TYPES = {  # positions, relative positions and pair data, law, sums
    KERNEL: "the project's own loop, for comparison | | |",
    DOUBLE: "double | double | double | double",
    CAREFUL: "double | double, r^2 - 1 too | float, written for small strains | double",
    MIXED: "double | float | float | double",
    FLOAT: "float | float | float | double",
    SINGLE: "float | float | float | float",
}

HEAD = """# Precision

Written by `tools/precision.py`. All of the package computes in double, and there is no switch. What that costs and what it
buys, in the pair loop alone (gather, law, scatter; exponents 8 and 4, no damping, no energy), compiled by {compiler}:

- **What double costs.** On {best} with {spheres} spheres the loop takes {single} of the time of double in single precision and
  {mixed} in mixed precision; with {many} spheres {single_many} and {mixed_many}; on the base instruction set, whose
  vectors are the shortest, {single_base} and {mixed_base} with {spheres}. The rest of a step (time integration, neighbor builds,
  communication) is LAMMPS' own and in double in any case.
- **What float positions spoil.** A bond's strain is a small difference of two large numbers. At a strain of {strain} and
  coordinates up to {reach} diameters the force of a pair is off by {float_rms} (rms) and by {float_max} at worst, the force on a
  sphere, a sum over pairs that share its rounded position, by {sphere_rms} and {sphere_max}. It is as if the strain of every bond were off by
  {float_noise} at any strain, and more in a larger box: nothing beside the {xi_s:g} where the second regime begins, and a great
  deal in a wave, near rest, or in the first step of a traction. A body that rings at a strain of {ring_strain} changes its energy by
  {ring_float} within {ring_steps} steps; with double by {ring_double}, the integrator's own.
- **What mixed precision spoils.** With positions in double and the law in float the force of a pair is off by {mixed_rms} (rms) and
  {mixed_max} at worst at the same strain, a noise of {mixed_noise} in the strain of every bond, whatever the box. The ringing body's energy
  changes by {ring_mixed}.
- **A float law that loses no digits** has to be given r^2 - 1 formed in double. It is off by {careful_max} at worst and takes
  {careful} of the time of double on {best}, {careful_base} on the base instruction set: accuracy is to be had, but then little
  or nothing is saved. It is one way to write such a law, and may not be the best.

So double is the default, and the only choice. What single precision would save is a part of the pair loop, and it would spoil small
strains, with which every result begins. Mixed precision is the one that could be defended: it saves less, its noise does not grow
with the box, and strains in the second regime would not notice; but it needs a switch that users judge by the strains they expect, and a second
tolerance in every test.

LAMMPS holds positions and forces in double in any case: *float positions* means a copy of them at each step, and float sums
one more. Their cost stands in a column of its own and is in no other figure. Float positions relative to an origin nearby
were not tried; their errors would lie between those of *mixed, float positions* and of *mixed*.

| variant | positions | pair data, relative positions | law | sums |
|---|---|---|---|---|
"""
TIMES = """
## Times

ns per pair, medians of {rounds} rounds (smallest to largest); ratios to double are those within a round, median (middle half of the
rounds). One core, FCC lattice with both shells bonded. The copy in double, from which the others are made, differs from the
project's own loop by {off} of the largest pair force.
"""
ERRORS = """
## Errors of the forces

In units of the largest pair force, against a sum in long double at the same positions in double; {spheres} spheres, coordinates up to
{reach} diameters, all pairs at the same strain. Beyond {xi_s:g} the force hardly grows with the strain, so errors of the strain count less.

| strain | variant | pair, rms | pair, largest | sphere, rms | sphere, largest |
|---|---|---|---|---|---|
"""
RINGING = """
## A body that rings

{spheres} spheres up to {reach} diameters from the origin, stretched alike in all directions and let go: {steps} steps of {step} sqrt(m/K) by
velocity Verlet, positions and velocities in double, forces in the variant's types. Energy: largest change of the total energy, of
the energy at the start; that of double is the integrator's own. Momentum: at the end, of the sum of all |m v|.

| strain | variant | energy | momentum |
|---|---|---|---|
"""


def build_program(folder):
    """The path of the program, built; RunError with the compiler's words where it failed."""
    if not (folder / "CMakeCache.txt").is_file():
        raise RunError(f"{folder} holds no build: run tools/setup.sh first, or give --build")
    if shutil.which("cmake") is None:
        raise RunError("no program cmake: install CMake 3.20 or newer")
    run = subprocess.run(["cmake", "--build", str(folder), "--target", "precision"], stdin=subprocess.DEVNULL,
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", check=False)
    if run.returncode:
        raise RunError(f"the build of the target precision in {folder} failed; its output ends with\n" + run.stdout[-2500:])
    return folder / "precision"


def rows_of(program, *words):
    """The program's CSV as dicts, numbers as float; RunError with its own words where it failed."""
    print("precision.py:", *words, file=sys.stderr, flush=True)
    run = subprocess.run([str(program), *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                         encoding="utf-8", errors="replace", check=False)
    rows = [{key: value if key in ("variant", "level", "compiler") else float(value) for key, value in row.items()}
            for row in csv.DictReader(run.stdout.splitlines())]
    if run.returncode or not rows:
        raise RunError(f"{program.name} {' '.join(map(str, words))} failed (exit {run.returncode}): {run.stderr[-1500:]}")
    return rows


class Times:
    """Times of one lattice: by instruction set and variant, a value per round."""

    def __init__(self, rows):
        self.spheres, self.pairs, self.compiler = int(rows[0]["spheres"]), int(rows[0]["pairs"]), rows[0]["compiler"]
        held = {row["level"] for row in rows}
        self.levels = [level for level in ("AVX-512", "AVX2", "base") if level in held]
        self.ns = {}
        self.copies = {}
        for row in sorted(rows, key=lambda row: row["round"]):
            self.ns.setdefault((row["level"], row["variant"]), []).append(row["ns"])
            self.copies.setdefault(row["variant"], []).append(row["copies_ns"])

    def ratios(self, level, variant):
        """Over double, round by round."""
        return [own / double for own, double in zip(self.ns[level, variant], self.ns[level, DOUBLE])]

    def ratio(self, level, variant):
        return f"{statistics.median(self.ratios(level, variant)):.2f}"

    def table(self):
        head = "".join(f" {level} [ns] | over double |" for level in self.levels)
        lines = [f"\n{self.spheres} spheres, {self.pairs} pairs:\n\n| variant |{head} copies [ns] |\n|---|{'---|---|' * len(self.levels)}---|\n"]
        for variant in TYPES:
            cells = "".join(f" {spread(self.ns[level, variant])} | {middle(self.ratios(level, variant))} |" for level in self.levels)
            copies = statistics.median(self.copies[variant])
            lines.append(f"| {variant} |{cells} {f'{copies:.2f}' if copies else ''} |\n")
        return "".join(lines)


def spread(values):
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def middle(values):
    """'median (lower to upper quartile)'."""
    low, half, high = statistics.quantiles(values, n=4, method="inclusive") if len(values) > 1 else 3 * values
    return f"{half:.2f} ({low:.2f} to {high:.2f})"


def percent(value):
    """Two digits, never as a power of ten where it is above a hundredth."""
    return f"{float(f'{100 * value:.2g}'):g} %"


def found(rows, variant, strain):
    return next(row for row in rows if row["variant"] == variant and row["strain"] == strain)


def page(times, errors, ringing):
    """The text of the page."""
    first, last, best = times[0], times[-1], times[0].levels[0]
    rough, mixed, careful = (found(errors, variant, TOLD_STRAIN) for variant in (FLOAT, MIXED, CAREFUL))
    ring, ring_mixed, ring_double = (found(ringing, variant, TOLD_RINGING) for variant in (FLOAT, MIXED, DOUBLE))
    text = HEAD.format(
        compiler=first.compiler, best=best, spheres=first.spheres, single=first.ratio(best, SINGLE), mixed=first.ratio(best, MIXED),
        many=last.spheres, single_many=last.ratio(best, SINGLE), mixed_many=last.ratio(best, MIXED),
        single_base=first.ratio("base", SINGLE), mixed_base=first.ratio("base", MIXED), strain=f"{TOLD_STRAIN:.0e}", reach=f"{rough['reach']:g}",
        float_rms=percent(rough["pair_rms"]), float_max=percent(rough["pair_max"]), sphere_rms=percent(rough["sphere_rms"]),
        sphere_max=percent(rough["sphere_max"]), float_noise=f"{TOLD_STRAIN * rough['pair_rms']:.1e}", xi_s=rough["xi_s"],
        mixed_rms=percent(mixed["pair_rms"]), mixed_max=percent(mixed["pair_max"]), mixed_noise=f"{TOLD_STRAIN * mixed['pair_rms']:.1e}",
        careful_max=f"{careful['pair_max']:.0e}", careful=first.ratio(best, CAREFUL),
        careful_base=first.ratio("base", CAREFUL), ring_strain=f"{TOLD_RINGING:.0e}",
        ring_steps=f"{ring['steps']:g}", ring_float=percent(ring["energy"]), ring_mixed=percent(ring_mixed["energy"]),
        ring_double=percent(ring_double["energy"]))
    text += "".join(f"| {variant} | {types} |\n" for variant, types in TYPES.items())
    off = max(row["off_kernel"] for row in errors if row["variant"] == DOUBLE)
    rounds = len(first.ns[best, DOUBLE])
    text += TIMES.format(rounds=rounds, off=f"{off:.2g}") + "".join(each.table() for each in times)
    text += ERRORS.format(spheres=first.spheres, reach=f"{rough['reach']:g}", xi_s=rough["xi_s"])
    for row in errors:
        cells = " | ".join(f"{row[key]:.1e}" for key in ("pair_rms", "pair_max", "sphere_rms", "sphere_max"))
        text += f"| {row['strain']:.0e} | {row['variant']} | {cells} |\n"
    text += RINGING.format(spheres=f"{ring['spheres']:g}", reach=f"{ring['reach']:g}", steps=f"{ring['steps']:g}", step=f"{ring['step']:g}")
    for row in ringing:
        text += f"| {row['strain']:.0e} | {row['variant']} | {row['energy']:.1e} | {row['momentum']:.0e} |\n"
    return text


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=100, help="rounds (default 100)")
    parser.add_argument("--cells", type=int, nargs="+", default=[20, 40], help="cells along an edge of the lattices that are timed, 4 spheres each; errors "
                        "are those of the first (default 20 40)")
    parser.add_argument("--steps", type=int, default=20000, help="steps of the ringing body (default 20000)")
    parser.add_argument("--build", type=pathlib.Path, default=CHECKOUT / "build", help="the build folder (default: build)")
    parser.add_argument("--out", type=pathlib.Path, default=CHECKOUT / "doc" / "precision.md", help="the file to write")
    options = parser.parse_args(words)
    if options.repeats < 1 or options.steps < 1 or not all(1 <= cells <= 100 for cells in options.cells):
        parser.error("--repeats and --steps must be 1 at least, --cells between 1 and 100")

    try:
        program = build_program(options.build)
        errors = rows_of(program, "errors", options.cells[0])
        ringing = rows_of(program, "ringing", RINGING_CELLS, options.steps)
        times = [Times(rows_of(program, "times", cells, options.repeats)) for cells in options.cells]
        text = page(times, errors, ringing)
        options.out.write_text(text, encoding="utf-8")
    except (RunError, OSError) as error:
        sys.exit(f"precision.py: error: {error}")
    print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
