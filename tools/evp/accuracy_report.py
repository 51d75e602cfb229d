# SPDX-License-Identifier: GPL-2.0-only
"""From the results of tools/accuracy_cost.py to tables, the recommendation and the picture. Every figure comes from the rows."""

import statistics
from typing import NamedTuple

import numpy as np

from . import accuracy_cases as cases
from .accuracy_cases import KNOBS, RECIPE, TARGET

MEASURES = {"stress_0.5pc_MPa": "stress at 0.5 %", "stress_1pc_MPa": "at 1 %", "stress_2pc_MPa": "at 1.95 %", "E_GPa": "E",
            "first_yield_strain": "first yield", "yield_MPa": "0.2 % yield"}
STRESS = "stress_1pc_MPa"
STRESSES = ("stress_0.5pc_MPa", STRESS, "stress_2pc_MPa")
PROMISES = (1.0, 0.5, 0.1)  # [%] of these stresses
MARGIN = 1.5  # a choice is recommended where its largest error in the sweep is that much smaller than the promise


class Choice(NamedTuple):
    """All seeds of one choice: {seed: {measure: number}}, and its time in units of the baseline (median of the seeds)."""

    knob: str
    name: str
    by_seed: dict
    time: float


class Results:
    """The rows of a results file, by choice."""

    def __init__(self, rows, target=TARGET, recipe=RECIPE):
        self.target_key, self.recipe_key = target, recipe
        self.choices, self.energy, self.checks, self.sizes = {}, {}, {}, {}
        timed = {}
        for row in rows:
            key, seed = (row["knob"], row["choice"]), int(row["seed"])
            if row["kind"] == "ledger":
                self.energy[key] = float(row["energy_open"])
                continue
            numbers = {name: float(row[name]) for name in MEASURES}
            time = float(row["seconds"]) / float(row["baseline_seconds"])
            group = self.sizes if row["knob"] == "particles" else self.checks if seed == cases.CHECK_SEED else self.choices
            key = int(row["spheres"]) if row["knob"] == "particles" else key
            group.setdefault(key, {})[seed] = numbers
            timed.setdefault((id(group), key), []).append(time)
        for group in (self.choices, self.checks, self.sizes):
            for key, by_seed in group.items():
                knob, name = ("particles", str(key)) if group is self.sizes else key
                group[key] = Choice(knob, name, by_seed, statistics.median(timed[id(group), key]))

    @property
    def target(self):
        return self.choices.get(self.target_key)

    @property
    def recipe(self):
        return self.choices.get(self.recipe_key)

    def cheaper(self, choice):
        """Times cheaper than the paper's recipe."""
        return self.recipe.time / choice.time

    def recommended(self):
        """{promise: the cheapest Choice whose largest error against the target is below promise / MARGIN, or None}."""
        every = len(self.target.by_seed)
        found = {}
        for promise in PROMISES:
            good = [choice for choice in self.choices.values() if KNOBS[choice.knob].route and len(choice.by_seed) >= every
                    and worst_stress(choice, self.target) <= promise / MARGIN]
            found[promise] = min(good, key=lambda choice: choice.time, default=None)
        return found


def errors(choice, reference, measure=STRESS):
    """Departures from the reference on the same seeds [%]; not a number where either is none."""
    shared = [seed for seed in choice.by_seed if seed in reference.by_seed]
    return [100.0 * (choice.by_seed[seed][measure] / reference.by_seed[seed][measure] - 1.0) for seed in shared]


def largest(values):
    """Largest absolute value; infinite where there is none, or one is not a number."""
    return max(map(abs, values)) if len(values) and np.all(np.isfinite(values)) else float("inf")


def worst_stress(choice, reference):
    """Largest error of the stresses at 0.5, 1 and 1.95 % strain on any body [%]."""
    return max(largest(errors(choice, reference, measure)) for measure in STRESSES)


def percent(values):
    """'mean (smallest to largest)' of errors, in percent; a dash where there is none."""
    if not len(values) or not np.all(np.isfinite(values)):
        return "-"
    mean = f"{statistics.mean(values):+.3f}"
    return mean if len(values) == 1 else f"{mean} ({min(values):+.3f} to {max(values):+.3f})"


def number(value):
    """Three digits, without an exponent where that is shorter."""
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def knob_tables(results):
    """A table for each knob: time, errors of the choice alone, error against the target, energy."""
    lines = ["## Every choice by itself\n",
             "Errors in percent, mean over the bodies (smallest to largest). They are those of the choice alone, against the choice of",
             "the same table that is marked *reference*, but for one column against the target. Time: pulls of the baseline.\n"]
    for name, knob in KNOBS.items():
        own = [choice for choice in results.choices.values() if choice.knob == name]
        reference = results.choices.get((name, knob.reference))
        if not own or reference is None:
            continue
        balances = {choice.name: results.energy.get((name, choice.name)) for choice in own}
        known = any(balance is not None for balance in balances.values())
        lines += [f"### {knob.title[0].upper()}{knob.title[1:]}\n",
                  "| choice | time | " + " | ".join(MEASURES.values()) + " | stress at 1 % against the target |" + " energy balance open, over the work |" * known,
                  "|---|---|" + "---|" * (len(MEASURES) + 1 + known)]
        for choice in own:
            cells = ["reference"] + ["0"] * (len(MEASURES) - 1) if choice is reference else [percent(errors(choice, reference, measure)) for measure in MEASURES]
            against = percent(errors(choice, results.target)) if results.target else "-"
            balance = balances[choice.name]
            lines.append(f"| {choice.name} | {number(choice.time)} | " + " | ".join(cells) + f" | {against} |" + (f" {'-' if balance is None else f'{balance:.1e}'} |" if known else ""))
        lines.append("")
    return lines


def extrapolate(sizes, measure):
    """Value for infinitely many spheres, and what its fit is sure of: a line in N^(-1/3), the share of the surface, through
    the means of each N from 2000 on; the uncertainty is the change when the largest N is left out. None with under four N."""
    large = sorted(n for n in sizes if n >= 2000)
    if len(large) < 4:
        return None
    x = np.array([n ** (-1 / 3) for n in large])
    y = np.array([statistics.mean(numbers[measure] for numbers in sizes[n].by_seed.values()) for n in large])
    weight = np.sqrt([len(sizes[n].by_seed) * n for n in large])  # scatter of a body falls as 1/sqrt(N)
    slope, limit = np.polyfit(x, y, 1, w=weight)
    without = np.polyfit(x[:-1], y[:-1], 1, w=weight[:-1])[1]
    return limit, abs(limit - without), slope


def size_table(results):
    """Number of particles: departure from the limit, scatter over seeds, time."""
    if not results.sizes:
        return []
    limits = {measure: extrapolate(results.sizes, measure) for measure in ("E_GPa", STRESS)}
    lines = ["## How many particles\n", "Table 1 at 10/s, the material kept (e ~ 1/N). Errors in percent against infinitely many, from a line in N^(-1/3), the share",
             "of the surface, through the means from 2000 on. Scatter: standard deviation over bodies of other seeds.\n",
             "| spheres | bodies | time | E [GPa] | error | scatter | stress at 1 % [MPa] | error | scatter |", "|---|---|---|---|---|---|---|---|---|"]
    for count, choice in sorted(results.sizes.items()):
        cells = []
        for measure, limit in limits.items():
            values = [numbers[measure] for numbers in choice.by_seed.values()]
            mean = statistics.mean(values)
            scatter = f"{100 * statistics.stdev(values) / mean:.2f}" if len(values) > 1 else "-"
            cells += [f"{mean:.4g}", f"{100 * (mean / limit[0] - 1):+.1f}" if limit else "-", scatter]
        lines.append(f"| {count} | {len(choice.by_seed)} | {number(choice.time)} | " + " | ".join(cells) + " |")
    if all(limits.values()):
        shown = [f"{name} {limit:.4g} {unit} (known to {100 * unsure / limit:.1f} %)"
                 for name, unit, (limit, unsure, _) in zip(("E", "stress at 1 %"), ("GPa", "MPa"), limits.values())]
        lines.append(f"\nLimit: {', '.join(shown)}.\n")
        limit, _, slope = limits[STRESS]
        needed = {promise: (abs(slope) / (0.01 * promise * limit)) ** 3 for promise in (5, 1)}
        lines.append("A body is within 5 % of the limit's stress at 1 % from about "
                     f"{number(needed[5])} spheres on, within 1 % from about {needed[1]:.1e}: where the material's own curve is wanted,"
                     " the number of spheres is the error that counts, and its surface the cause.\n")
    return lines


def reference_table(results):
    """Is the target converged? What other ways to the same curve give."""
    lines = ["## The target, and whether it is converged\n",
             f"Target: Table 2 (gamma 1000) at 1/s with {KNOBS[results.target_key[0]].title}, {results.target.name}, of each body. Other converged ways to the",
             "same curve, departures in percent:\n", "| way | bodies | " + " | ".join(MEASURES.values()) + " |", "|---|---|" + "---|" * len(MEASURES)]
    for key in (("explicit", "0.2 of the limit"), ("explicit", "0.8 of the limit"), ("implicit", "1e-6 s"), ("implicit", "2e-6 s")):
        choice = results.choices.get(key)
        if choice:
            lines.append(f"| {KNOBS[key[0]].title}: {choice.name} | {len(choice.by_seed)} | " + " | ".join(percent(errors(choice, results.target, measure)) for measure in MEASURES) + " |")
    return lines + [""]


def recommendation(results):
    """What to take for which error, how much cheaper it is, and what it gave on a body that the sweep never saw."""
    lines = ["## What to take\n",
             "The question: the stresses at 0.5, 1 and 1.95 % strain of Table 2 at 1/s (figure 4 of the paper), of a body that is given. The paper's own way,",
             f"explicit damping, made stable by a step of {results.recipe.name}, takes {number(results.recipe.time)} pulls of the baseline. The cheapest choice that keeps each promise with",
             f"a margin of {MARGIN} on every body of the sweep, and what it gave on a body that the sweep never saw (seed {cases.CHECK_SEED}):\n",
             "| for an error of | take | times cheaper than the paper's way | largest error in the sweep [%] | on the unseen body: at 0.5 % | at 1 % | at 1.95 % [%] | promise |",
             "|---|---|---|---|---|---|---|---|"]
    target = results.checks.get(results.target_key)
    for promise, choice in results.recommended().items():
        if choice is None:
            lines.append(f"| {promise:g} % | nothing in the sweep | - | - | - | - | - | - |")
            continue
        check = results.checks.get((choice.knob, choice.name))
        seen = [errors(check, target, measure) for measure in STRESSES] if check and target else [[]] * len(STRESSES)
        met = "-" if not seen[0] else "met" if worst_stress(check, target) <= promise else "NOT met"
        lines.append(f"| {promise:g} % | {KNOBS[choice.knob].title}: {choice.name} | {number(results.cheaper(choice))} | {worst_stress(choice, results.target):.3f} | "
                     + " | ".join(map(percent, seen)) + f" | {met} |")
    return lines + [""]


def front(points):
    """Of (time, error) those that no other beats in both, by time."""
    best, kept = float("inf"), []
    for point in sorted(points):
        if point[1] < best:
            best = point[1]
            kept.append(point)
    return kept


def page(results, picture):
    """The text of doc/accuracy_cost.md."""
    lines = ["# What accuracy costs\n", "Written by `tools/accuracy_cost.py` from `doc/accuracy_cost.csv`, the runs of one machine. One unit of work is a pull to 2 %",
             f"strain. Times are processor times without the start of the program, over that of the baseline, which ran beside each: Table 1, 500 spheres, {cases.BASELINE['rate']}/s, explicit at",
             f"{cases.BASELINE['dtfraction']} of the limit.\n"]
    if results.target and results.recipe:
        lines += recommendation(results) + [f"![error against time]({picture})\n",
                                            "Left: every choice on bodies of 500 spheres, largest error of the three stresses and of the bodies against the target; the front is circled. Choices that",
                                            "change the model (open marks) are no ways to the target. Right: the number of particles, which is an error of its own.\n"] + reference_table(results)
    lines += size_table(results) + knob_tables(results)
    return "\n".join(lines).rstrip() + "\n"
