# SPDX-License-Identifier: GPL-2.0-only
"""From the results of doc/studies/accuracy_cost.py to tables, the recommendation and the picture. Every figure comes from the rows."""

import statistics
from typing import NamedTuple

from study import spread, table
import numpy as np

import accuracy_cases as cases
from accuracy_cases import KNOBS, RECIPE, TARGET
from accuracy_run import STRESSES

STRESS = "stress_1pc_MPa"
MEASURES = {"stress_0.5pc_MPa": "stress at 0.5 %", STRESS: "at 1 %", "stress_2pc_MPa": "at 1.95 %", "E_GPa": "E",
            "first_yield_strain": "first yield strain", "yield_MPa": "0.2 % yield"}
NUMBERS = (*STRESSES, "E_GPa", "first_yield_strain", "yield_MPa")
AT = ", ".join(f"{100 * strain:g}" for strain in STRESSES.values()) + " %"
PROMISES = (1.0, 0.5, 0.1)  # [%] of these stresses
MARGIN = 1.5  # a setting is recommended where its largest error in the sweep is that much smaller than the promise
LARGE = 2000  # spheres from which on the limit of infinitely many is looked for
POWERS = (-1 / 3, -1 / 4, -1 / 2)  # of N in that: the share of the surface, and what else it might be
UNDAMPED = ("step", "0.8 of the limit")
DEFAULT_TOL = ("implicit", "1e-5 s")
LEFT_OUT = ("coeff", "strain", "restart", "samples", "row")  # variables of a deck that do not belong to a recommended setting


class Choice(NamedTuple):
    """All seeds of one setting: {seed: {measure: number}}, {seed: time in units of the baseline}, without and with the
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
    """The rows of a results file, by setting: of the sweep, of the unseen specimen (checks), and by the number of spheres (sizes)."""

    def __init__(self, rows, target=TARGET, recipe=RECIPE):
        rows = list(rows)
        self.target_key, self.recipe_key = target, recipe
        self.energy = {(row["knob"], row["choice"]): float(row["energy_open"]) for row in rows if row["kind"] == "ledger"}
        timed = [row for row in rows if row["kind"] != "ledger"]
        self.machine = sorted({(row["lammps"], row["processor"]) for row in timed})
        self.unit = statistics.median(float(row["baseline_seconds"]) for row in timed)  # of the baseline [s]

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
        """Times faster than the paper's method: (without, with) the start of LAMMPS in both."""
        recipe, own = (statistics.median(one.started.values()) for one in (self.recipe, choice))
        return self.recipe.time / choice.time, recipe / own

    def complete(self, choice):
        """Was it run on every specimen of the target?"""
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
    """Largest error of all stresses on any specimen [%]."""
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
    """A table for each knob: time, errors of the setting alone, error against the target, energy."""
    lines = ["## Every setting by itself\n",
             "Errors in percent, mean over the specimens (smallest to largest), against the setting that is marked *reference*. *Target*: the largest error of the",
             f"stresses at {AT} strain against the target. *Time*: in baseline runs, median over the specimens. The same run is in several tables; the spread of",
             "its times is the uncertainty of the times. *First yield strain*: where the tangent modulus falls below 90 % of E; - where the rows are too far apart for it.",
             "*Energy*: largest energy imbalance of fix evp/energy over the work, on one specimen.\n"]
    for name, knob in KNOBS.items():
        own = [choice for choice in results.choices.values() if choice.knob == name]
        reference = results.choices.get((name, knob.reference))
        if not own or reference is None:
            continue
        balances = {choice.name: results.energy.get((name, choice.name)) for choice in own}
        known = any(balance is not None for balance in balances.values())
        header, rows = ["setting", "time", *MEASURES.values(), "target"] + ["energy"] * known, []
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
            lines.append(f"\nThe stresses of the setting next to the reference differ from those of the reference by at most {closest:.3f} %.")
        lines.append("")
    return lines


def extrapolate(sizes, measure):
    """Value for infinitely many spheres and its uncertainty, a pair; None with under four numbers of spheres.

    A line in N^(-1/3), the share of the surface, through the means of each N from LARGE on, weighted by the certainty of a mean.
    Uncertainty: the largest change by another power, or without one of the N.
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
    """Number of spheres: departure from the limit, scatter over seeds, time."""
    if not results.sizes:
        return []
    limits = {measure: extrapolate(results.sizes, measure) for measure in ("E_GPa", STRESS)}
    lines = ["## Number of spheres\n",
             f"Table 1 at 10/s, the material kept (e ~ 1/N). Errors in percent against infinitely many spheres, by a line in N^(-1/3) through the means from {LARGE} spheres",
             "on. *Scatter*: standard deviation over specimens of other seeds [%]. *Time*: in baseline runs, sum over all MPI ranks, waiting included.\n"]
    rows = []
    for count, choice in sorted(results.sizes.items()):
        row = [count, len(choice.by_seed), choice.ranks, spread(choice.times.values(), number)]
        for measure, limit in limits.items():
            values = [numbers[measure] for numbers in choice.by_seed.values()]
            mean = statistics.mean(values)
            scatter = f"{100 * statistics.stdev(values) / mean:.2f}" if len(values) > 1 else "-"
            row += [f"{mean:.4g}", f"{100 * (mean / limit[0] - 1):+.1f}" if limit else "-", scatter]
        rows.append(row)
    lines += table(("spheres", "specimens", "MPI ranks", "time", "E [GPa]", "error of E", "scatter of E", "stress at 1 % [MPa]", "error of the stress", "scatter of the stress"), rows)
    if all(limits.values()):
        shown = [f"{name} {limit:.4g} {unit} (+- {100 * unsure / limit:.1f} %)"
                 for name, unit, (limit, unsure) in zip(("E", "stress at 1 %"), ("GPa", "MPa"), limits.values())]
        lines.append(f"\nInfinitely many spheres: {', '.join(shown)}. *+-*: largest change of the limit with another power of N, or without one of the numbers of spheres.\n")
    return lines


def reference_table(results):
    """Convergence of the target: what other settings give for the same curve."""
    target = results.target
    lines = ["## Convergence of the target\n",
             f"The target is the curve of Table 2 by {method(target)}, dt = {target.name}, of each specimen. "
             "Differences from it of the same curve by other settings, in percent:\n"]
    ways = [results.choices[key] for key in (("explicit", "0.2 of the limit"), ("explicit", "0.8 of the limit"), ("explicit", "0.9 of the limit"),
                                             ("implicit", "1e-6 s"), ("implicit", "2e-6 s")) if key in results.choices]
    lines += table(("setting", "specimens", *MEASURES.values()), (
        (f"{KNOBS[choice.knob].title}: {choice.name}", len(choice.by_seed), *(percent(errors(choice, target, measure)) for measure in MEASURES))
        for choice in ways))
    if ways:
        lines.append(f"\nThe largest difference of a stress is {max(worst_stress(choice, target) for choice in ways):.3f} %; the smallest error bound above is {min(PROMISES):g} %.")
    return lines + [""]


def commands(key):
    """What a user types for the (knob, choice): deck and variables in Markdown."""
    case = next(case for case in cases.body_cases() if (case.knob, case.choice) == key)
    words = " ".join(f"-var {name} {value}".replace("e-0", "e-") for name, value in case.variables.items() if name not in LEFT_OUT and value)
    return f"`{case.deck} {words}`" + (f", and `{case.hook.strip()}` in the file of `-var also`" if case.hook else "")


def seconds_of(choice, unit):
    """Processor time of a run on one core, the start of LAMMPS included [s]."""
    return number(unit * statistics.median(choice.started.values()))


def settings_table(results):
    """The recommended settings, from the cheapest on, and the two of explicit time integration."""
    target, rows, unit = results.checks.get(results.target_key), [], results.unit
    by_choice = {}
    for promise, choice in results.recommended().items():
        if choice:
            by_choice.setdefault((choice.knob, choice.name), []).append(promise)
    lines = [(f"stress-strain curve within {' or '.join(f'{promise:g}' for promise in promises)} %", key)
             for key, promises in by_choice.items()]
    lines += [("stress-strain curve by the paper's method, explicit damping", results.recipe_key), ("dynamics without damping (gamma = 0), explicit", UNDAMPED)]
    for purpose, key in lines:
        if key not in results.choices:
            continue
        choice, check = results.choices[key], results.checks.get(key)
        unseen = f"{worst_stress(check, target):.2g}" if check and target and key != results.target_key else "-"
        rows.append((purpose, commands(key), f"{worst_stress(choice, results.target):.2g}", unseen, seconds_of(choice, unit)))
    return table(("for", "run", "largest error of the stresses [%]", "on an unseen specimen [%]", "processor time [s]"), rows)


def summary(results):
    """The first lines of the page: what to run, what to expect of it and what limits the accuracy."""
    lines, recipe = ["## Recommended settings\n"], results.recipe
    quick, exact = (results.recommended()[promise] for promise in (max(PROMISES), min(PROMISES)))
    if quick and exact and quick is not exact:
        lines.append(f"For a stress-strain curve at a low strain rate, within {max(PROMISES):g} %, take {method(quick)}: "
                     f"{number(results.cheaper(quick)[0])} times faster than {method(recipe)}.")
        lines.append(f"Where {min(PROMISES):g} % is needed, or the effect of the strain rate, take {method(exact)}: {number(results.cheaper(exact)[0])} times faster.")
        if exact.knob == "tol" and DEFAULT_TOL in results.choices:
            lines.append(f"With the default *tol* it takes {results.choices[DEFAULT_TOL].time / exact.time:.1f} times as long.")
    own = [choice for choice in results.choices.values() if choice.knob == "step"]
    reference = results.choices.get(("step", KNOBS["step"].reference))
    if reference and UNDAMPED in results.choices:
        worst = max(worst_stress(choice, reference) for choice in own)
        lines.append(f"For dynamic problems take explicit time integration with `dtfraction` {UNDAMPED[1].split()[0]}: between {min(share_of(choice) for choice in own):g} and "
                     f"{max(share_of(choice) for choice in own):g} of the largest")
        lines.append(f"stable timestep size the stresses differ by {worst:.1f} % at most in a tension test to 2 % strain.")
        lines.append("Longer runs without damping are slowly heated at this size: take 0.4 or less there, and monitor the energy balance, see [fix dt/evp](fix_dt_evp.rst).")
    limit = extrapolate(results.sizes, STRESS)
    if limit:
        few, many = min(results.sizes), max(results.sizes)
        off = {n: 100 * (statistics.mean(numbers[STRESS] for numbers in results.sizes[n].by_seed.values()) / limit[0] - 1) for n in (few, many)}
        lines.append(f"The number of spheres matters more than all of these: the stress at 1 % strain is off by {off[few]:+.0f} % with {few} spheres and by {off[many]:+.0f} % with {many}.")
    notes = [f"Errors: of the stresses at {AT} strain against the damped curve of Table 2 at 1/s, the largest of all specimens of 500 spheres in the sweep.",
             "Those of in.quasistatic and of gamma = 0 include the viscous stress, which these do not have. Time: one tension test of 500 spheres to 2 % strain on one core,",
             "LAMMPS' start included. To each run belong `-var specimen FILE` and `-var coeff` or `-var material`."]
    return [*lines, "", *settings_table(results), "", *notes, ""]


def share_of(choice):
    """0.8 of '0.8 of the limit'."""
    return float(choice.name.split()[0])


METHODS = {"increment": "quasi-static loading by energy minimization", "rest": "quasi-static loading by energy minimization",
           "tol": "implicit damping", "implicit": "implicit damping", "damped rate": "implicit damping", "explicit": "explicit damping at 1/s"}


def method(choice):
    """What a Choice integrates by, in words."""
    return METHODS.get(choice.knob, KNOBS[choice.knob].title)


def recommendation(results):
    """How the settings were chosen: how much faster each is, and its errors on a specimen that is no part of the sweep."""
    recipe = results.recipe
    lines = ["## How they were chosen\n",
             f"The test: the stresses at {AT} strain of Table 2 at 1/s (figure 4 of the paper), of a given specimen. The paper's method is {method(recipe)};",
             f"with a stable timestep size, {recipe.name}, it takes {number(recipe.time)} baseline runs. "
             f"For each error bound the table has the fastest setting whose error is below the bound over {MARGIN} on",
             f"every specimen of the sweep, and its errors on a specimen that is no part of the sweep (*unseen*, seed {cases.CHECK_SEED}). "
             "*Limit*: the largest stable timestep size, by compute evp/dt.\n"]
    target, rows = results.checks.get(results.target_key), []
    for promise, choice in results.recommended().items():
        if choice is None:
            rows.append([f"{promise:g} %", "none but the target"] + ["-"] * (4 + len(STRESSES)))
            continue
        check = results.checks.get((choice.knob, choice.name))
        seen = [errors(check, target, measure) for measure in STRESSES] if check and target else [[]] * len(STRESSES)
        met = "-" if not seen[0] else "met" if worst_stress(check, target) <= promise else "NOT met"
        rows.append([f"{promise:g} %", f"{KNOBS[choice.knob].title}: {choice.name}", *map(number, results.cheaper(choice)),
                     f"{worst_stress(choice, results.target):.3f}", *map(percent, seen), met])
    return lines + table(("error bound", "fastest setting", "times faster than the paper's method", "with the start of LAMMPS", "largest error in the sweep [%]",
                          *(f"unseen: at {100 * strain:g} % [%]" for strain in STRESSES.values()), "bound on the unseen specimen"), rows) + [""]


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
    written = [f"Written by `doc/studies/accuracy_cost.py` from the runs in `{table}` ({machines}). *Time*: processor time without the start of LAMMPS, in units of a *baseline run*,",
               f"a tension test to {100 * cases.STRAIN:g} % strain run directly before each: Table 1, 500 spheres, {cases.BASELINE['rate']}/s, explicit, "
               f"`-var dtfraction {cases.BASELINE['dtfraction']}` ({number(results.unit)} s).\n"]
    lines = ["# Accuracy versus run time\n"]
    if results.target and results.recipe:
        lines += summary(results) + written + recommendation(results) + [
            f"![error against time]({picture})\n",
            "Left: every setting on specimens of 500 spheres, largest error of all stresses and specimens against the target; errors below 0.001 % are drawn at 0.001 %.",
            "Circles: no other setting is both faster and more accurate (Pareto front). Open marks change the model and are not comparable with the target.",
            "Right: error of the number of spheres, in addition to that of the setting.\n"] + reference_table(results)
    else:
        lines += written
    lines += size_table(results) + knob_tables(results)
    return "\n".join(lines).rstrip() + "\n"
