# SPDX-License-Identifier: GPL-2.0-only
"""From the results of tools/accuracy_cost.py to tables, the recommendation and the picture. Every figure comes from the rows."""

import statistics
from typing import NamedTuple

import numpy as np

from . import accuracy_cases as cases
from .accuracy_cases import KNOBS, RECIPE, TARGET
from .accuracy_run import STRESSES
from .report import spread, table

STRESS = "stress_1pc_MPa"
MEASURES = {"stress_0.5pc_MPa": "stress at 0.5 %", STRESS: "at 1 %", "stress_2pc_MPa": "at 1.95 %", "E_GPa": "E",
            "first_yield_strain": "first yield", "yield_MPa": "0.2 % yield"}
NUMBERS = (*STRESSES, "E_GPa", "first_yield_strain", "yield_MPa")
AT = ", ".join(f"{100 * strain:g}" for strain in STRESSES.values()) + " %"
PROMISES = (1.0, 0.5, 0.1)  # [%] of these stresses
MARGIN = 1.5  # a choice is recommended where its largest error in the sweep is that much smaller than the promise
LARGE = 2000  # spheres from which on the limit of infinitely many is looked for
POWERS = (-1 / 3, -1 / 4, -1 / 2)  # of N in that: the share of the surface, and what else it might be


class Choice(NamedTuple):
    """All seeds of one choice: {seed: {measure: number}}, {seed: time in units of the baseline}, without and with the
    start of LAMMPS."""

    knob: str
    name: str
    by_seed: dict
    times: dict
    started: dict
    ranks: int

    @property
    def time(self):
        return statistics.median(self.times.values())


class Results:
    """The rows of a results file, by choice: of the sweep, of the unseen body (checks), and by the number of spheres (sizes)."""

    def __init__(self, rows, target=TARGET, recipe=RECIPE):
        rows = list(rows)
        self.target_key, self.recipe_key = target, recipe
        self.energy = {(row["knob"], row["choice"]): float(row["energy_open"]) for row in rows if row["kind"] == "ledger"}
        timed = [row for row in rows if row["kind"] != "ledger"]
        self.machine = sorted({(row["lammps"], row["processor"]) for row in timed})

        def of(rows, key):
            grouped = {}
            for row in rows:
                grouped.setdefault(key(row), []).append(row)
            return {name: choice_of(group) for name, group in grouped.items()}

        small = [row for row in timed if row["knob"] != "particles"]
        self.sizes = of([row for row in timed if row["knob"] == "particles"], lambda row: int(row["spheres"]))
        self.choices = of([row for row in small if int(row["seed"]) != cases.CHECK_SEED], lambda row: (row["knob"], row["choice"]))
        self.checks = of([row for row in small if int(row["seed"]) == cases.CHECK_SEED], lambda row: (row["knob"], row["choice"]))

    @property
    def target(self):
        return self.choices.get(self.target_key)

    @property
    def recipe(self):
        return self.choices.get(self.recipe_key)

    def cheaper(self, choice):
        """Times cheaper than the paper's recipe: (without, with) the start of LAMMPS in both."""
        recipe, own = (statistics.median(one.started.values()) for one in (self.recipe, choice))
        return self.recipe.time / choice.time, recipe / own

    def complete(self, choice):
        """Was it run on every body of the target?"""
        return set(choice.by_seed) >= set(self.target.by_seed)

    def recommended(self):
        """{promise: the cheapest Choice whose largest error against the target is below promise / MARGIN, or None}."""
        found = {}
        for promise in PROMISES:
            good = [choice for choice in self.choices.values() if KNOBS[choice.knob].route and choice is not self.target
                    and self.complete(choice) and worst_stress(choice, self.target) <= promise / MARGIN]
            found[promise] = min(good, key=lambda choice: choice.time, default=None)
        return found


def choice_of(rows):
    """The Choice of its rows, one of each seed."""

    def times(*names):
        return {int(row["seed"]): sum(float(row[name]) for name in names) / float(row["baseline_seconds"]) for row in rows}

    return Choice(rows[0]["knob"], rows[0]["choice"], {int(row["seed"]): {name: float(row[name]) for name in NUMBERS} for row in rows},
                  times("seconds"), times("seconds", "start_seconds"), int(rows[0]["ranks"]))


def errors(choice, reference, measure=STRESS):
    """Departures from the reference on the same seeds [%]; not a number where either is none."""
    shared = [seed for seed in choice.by_seed if seed in reference.by_seed]
    return [100.0 * (choice.by_seed[seed][measure] / reference.by_seed[seed][measure] - 1.0) for seed in shared]


def largest(values):
    """Largest absolute value; infinite where there is none, or one is not a number."""
    return max(map(abs, values)) if len(values) and np.all(np.isfinite(values)) else float("inf")


def worst_stress(choice, reference):
    """Largest error of all stresses on any body [%]."""
    return max(largest(errors(choice, reference, measure)) for measure in STRESSES)


def percent(values):
    """'mean (smallest to largest)' of errors, in percent; a dash where there is none."""
    if not len(values) or not np.all(np.isfinite(values)):
        return "-"
    mean = f"{statistics.mean(values):+.3f}"
    return mean if len(values) == 1 else f"{mean} ({min(values):+.3f} to {max(values):+.3f})"


def number(value):
    """Two digits: times hold no more."""
    return f"{value:.2g}" if value < 100 else f"{float(f'{value:.2g}'):.0f}"


def knob_tables(results):
    """A table for each knob: time, errors of the choice alone, error against the target, energy."""
    lines = ["## Every choice by itself\n",
             "Errors in percent, mean over the bodies (smallest to largest), against the choice that is marked *reference*; *target*: the largest error of the",
             f"stresses at {AT} against the target. Time: pulls of the baseline, median of the bodies. Equal runs in several tables show what the times are worth.",
             "Energy: largest energy imbalance in fix evp/energy, over the work, on one body.\n"]
    for name, knob in KNOBS.items():
        own = [choice for choice in results.choices.values() if choice.knob == name]
        reference = results.choices.get((name, knob.reference))
        if not own or reference is None:
            continue
        balances = {choice.name: results.energy.get((name, choice.name)) for choice in own}
        known = any(balance is not None for balance in balances.values())
        header, rows = ["choice", "time", *MEASURES.values(), "target"] + ["energy"] * known, []
        for choice in own:
            row = [choice.name, spread(choice.times.values(), number)]
            if choice is reference:
                row += ["reference"] + [""] * (len(MEASURES) - 1)
            else:
                row += [percent(errors(choice, reference, measure)) for measure in MEASURES]
            row.append(f"{worst_stress(choice, results.target):.3f}" if results.target else "-")
            balance = balances[choice.name]
            rows.append(row + ["-" if balance is None else f"{balance:.1e}"] * known)
        lines += [f"### {knob.title[0].upper()}{knob.title[1:]}\n", *table(header, rows)]
        place = own.index(reference)
        beside = [own[k] for k in (place - 1, place + 1) if 0 <= k < len(own)]
        if beside and knob.converges:
            closest = min(worst_stress(choice, reference) for choice in beside)
            lines.append(f"\nThe choice next to the reference departs from it by at most {closest:.3f} % in the stresses: so far the reference can be trusted.")
        lines.append("")
    return lines


def extrapolate(sizes, measure):
    """Value for infinitely many spheres and what it is uncertain by, a pair; None with under four numbers of spheres.

    A line in N^(-1/3), the share of the surface, through the means of each N from LARGE on, weighted by what a mean is sure of.
    Uncertain: the largest change by another power, or without one of the N.
    """
    large = sorted(n for n in sizes if n >= LARGE)
    if len(large) < 4:
        return None
    means = np.array([statistics.mean(numbers[measure] for numbers in sizes[n].by_seed.values()) for n in large])
    weight = np.sqrt([len(sizes[n].by_seed) * n for n in large])  # scatter of a body falls as 1/sqrt(N)
    n = np.array(large, dtype=float)

    def limit(power, kept):
        return np.polyfit(n[kept] ** power, means[kept], 1, w=weight[kept])[1]

    every = np.ones(len(large), dtype=bool)
    value = limit(POWERS[0], every)
    others = [limit(power, every) for power in POWERS[1:]] + [limit(POWERS[0], np.arange(len(large)) != k) for k in range(len(large))]
    return value, max(abs(other - value) for other in others)


def size_table(results):
    """Number of particles: departure from the limit, scatter over seeds, time."""
    if not results.sizes:
        return []
    limits = {measure: extrapolate(results.sizes, measure) for measure in ("E_GPa", STRESS)}
    lines = ["## How many particles\n", f"Table 1 at 10/s, the material kept (e ~ 1/N). Errors in percent against infinitely many, from a line in N^(-1/3) through the means from {LARGE}",
             "on. Scatter: standard deviation over bodies of other seeds. Times count all ranks, waiting included.\n"]
    rows = []
    for count, choice in sorted(results.sizes.items()):
        row = [count, len(choice.by_seed), choice.ranks, spread(choice.times.values(), number)]
        for measure, limit in limits.items():
            values = [numbers[measure] for numbers in choice.by_seed.values()]
            mean = statistics.mean(values)
            scatter = f"{100 * statistics.stdev(values) / mean:.2f}" if len(values) > 1 else "-"
            row += [f"{mean:.4g}", f"{100 * (mean / limit[0] - 1):+.1f}" if limit else "-", scatter]
        rows.append(row)
    lines += table(("spheres", "bodies", "ranks", "time", "E [GPa]", "error", "scatter", "stress at 1 % [MPa]", "error", "scatter"), rows)
    if all(limits.values()):
        shown = [f"{name} {limit:.4g} {unit} (uncertain by {100 * unsure / limit:.1f} %: other powers of N, one N left out)"
                 for name, unit, (limit, unsure) in zip(("E", "stress at 1 %"), ("GPa", "MPa"), limits.values())]
        lines.append(f"\nLimit: {', '.join(shown)}. Errors smaller than that say little.\n")
    return lines


def reference_table(results):
    """Is the target converged? What other ways to the same curve give."""
    target = results.target
    lines = ["## The target, and whether it is converged\n",
             f"Target: Table 2 at 1/s, {KNOBS[target.knob].title}, {target.name}, of each body. What other small steps give for the same curve, departures in percent:\n"]
    ways = [results.choices[key] for key in (("explicit", "0.2 of the limit"), ("explicit", "0.8 of the limit"), ("explicit", "0.9 of the limit"),
                                             ("implicit", "1e-6 s"), ("implicit", "2e-6 s")) if key in results.choices]
    lines += table(("way", "bodies", *MEASURES.values()), (
        (f"{KNOBS[choice.knob].title}: {choice.name}", len(choice.by_seed), *(percent(errors(choice, target, measure)) for measure in MEASURES))
        for choice in ways))
    if ways:
        lines.append(f"\nLargest departure of a stress: {max(worst_stress(choice, target) for choice in ways):.3f} %; the smallest promise above is {min(PROMISES):g} %.")
    return lines + [""]


def recommendation(results):
    """The recommended setting for each error, how much cheaper it is, and what it gave on a body that the sweep never saw."""
    recipe = results.recipe
    lines = ["## Recommended settings\n",
             f"The question: the stresses at {AT} strain of Table 2 at 1/s (figure 4 of the paper), of a body that is given. The paper's own way is {KNOBS[recipe.knob].title};",
             f"made stable by a step of {recipe.name} it takes {number(recipe.time)} pulls of the baseline. "
             f"The cheapest choice that keeps each promise with a margin of {MARGIN} on every body of the sweep,",
             f"and its errors on a body that the sweep never saw (seed {cases.CHECK_SEED}):\n"]
    target, rows = results.checks.get(results.target_key), []
    for promise, choice in results.recommended().items():
        if choice is None:
            rows.append([f"{promise:g} %", "nothing in the sweep but the target"] + ["-"] * (4 + len(STRESSES)))
            continue
        check = results.checks.get((choice.knob, choice.name))
        seen = [errors(check, target, measure) for measure in STRESSES] if check and target else [[]] * len(STRESSES)
        met = "-" if not seen[0] else "met" if worst_stress(check, target) <= promise else "NOT met"
        rows.append([f"{promise:g} %", f"{KNOBS[choice.knob].title}: {choice.name}", *map(number, results.cheaper(choice)),
                     f"{worst_stress(choice, results.target):.3f}", *map(percent, seen), met])
    return lines + table(("for an error of", "take", "times cheaper than the paper's way", "with the start of LAMMPS", "largest error in the sweep [%]",
                          *(f"unseen: at {100 * strain:g} % [%]" for strain in STRESSES.values()), "promise"), rows) + [""]


def front(points):
    """Of (time, error) those that no other beats in both, by time."""
    best, kept = float("inf"), []
    for point in sorted(points):
        if point[1] < best:
            best = point[1]
            kept.append(point)
    return kept


def page(results, table, picture):
    """The text of the page; table and picture: the names of its CSV and its picture."""
    machines = "; ".join(f"LAMMPS {lammps}, {processor}" for lammps, processor in results.machine)
    lines = ["# Accuracy versus run time\n",
             f"Written by `tools/accuracy_cost.py`; its runs stand in `{table}` ({machines}). One unit of work is a pull to {100 * cases.STRAIN:g} % strain. Times are processor",
             "times without the start of the program, over that of the baseline, which ran beside each: "
             f"Table 1, 500 spheres, {cases.BASELINE['rate']}/s, explicit, `-var dtfraction {cases.BASELINE['dtfraction']}`.\n"]
    if results.target and results.recipe:
        lines += recommendation(results) + [f"![error against time]({picture})\n",
                                            "Left: every choice on bodies of 500 spheres, largest error of all stresses and bodies against the target; "
                                            "errors below 0.001 % are drawn there, the front is",
                                            "circled. Choices that change the model (open marks) are not comparable with the target. "
                                            "Right: the number of particles, an error of its own.\n"] + reference_table(results)
    lines += size_table(results) + knob_tables(results)
    return "\n".join(lines).rstrip() + "\n"
