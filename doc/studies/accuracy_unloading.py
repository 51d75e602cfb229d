# SPDX-License-Identifier: GPL-2.0-only
"""The sweep of doc/studies/accuracy_cost.py --unloading: what timestep size, strain increment and number of spheres do to residual
strain, unloading modulus, loop area and volume strain.

A case is two runs of a deck with `plasticity isotropic` and contact none, Table 1: one cycle to 2 % and back to no stress, and a tension
test to 2 % with the volume energy KV, at whose end the volume strain of the middle is measured.
"""

import csv
import pathlib
import statistics
from typing import NamedTuple

from study import DECKS, RunError, deck_command, spread, table, watched, write_csv
from evp import curves, dump, specimen
from accuracy_cases import TABLE1
from accuracy_run import processor_seconds

KV = 1000  # [J] of each of 500 spheres
STRAIN = 0.02
MEASURES = {"residual_strain": "residual strain", "unloading_GPa": "unloading modulus", "area_MJ_per_m3": "loop area", "volume_strain": "volume strain"}
COLUMNS = ("knob", "choice", "spheres", "seed", "seconds", *MEASURES)


class Case(NamedTuple):
    """One choice of one knob, on one body. more: variables of the deck, to which the way back is added for the sweep."""

    knob: str
    choice: str
    deck: str
    more: dict
    spheres: int = 500
    seed: int = 1


class Knob(NamedTuple):
    title: str
    reference: str  # choice that its others are compared with, body by body; none: against the mean of the last


KNOBS = {
    "step": Knob("timestep size over the largest stable one, in.cyclic at 10/s", "0.1"),
    "increment": Knob("strain increment, in.quasistatic", "0.0001"),
    "particles": Knob("number of spheres, in.quasistatic, the material kept", ""),
}


def all_cases(quick=False):
    """The plan; quick: three choices of each knob on one body."""
    seeds = (1,) if quick else (1, 2, 3)
    steps = ("0.8", "0.4", "0.1") if quick else ("0.9", "0.8", "0.6", "0.4", "0.2", "0.1")
    increments = ("0.002", "0.0005", "0.0001") if quick else ("0.002", "0.001", "0.0005", "0.00025", "0.0001")
    sizes = ((250, seeds), (500, seeds)) if quick else ((500, (1, 2, 3, 4)), (1000, (1, 2, 3)), (2000, (1, 2)), (4000, (1, 2)))
    cases = [Case("step", word, "in.cyclic", {"rate": 10, "dtfraction": word}, seed=seed) for word in steps for seed in seeds]
    cases += [Case("increment", word, "in.quasistatic", {"increment": word}, seed=seed) for word in increments for seed in seeds]
    cases += [Case("particles", str(n), "in.quasistatic", {}, n, seed) for n, of_size in sizes for seed in of_size]
    return cases


class Runner:
    """Runs cases in a folder, with the specimens that it makes there."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)

    def deck(self, deck, variables):
        """Processor seconds of a run of a deck."""
        return processor_seconds(deck_command(DECKS / deck, variables), self.folder, self.folder / "run.log")

    def specimen(self, spheres, seed):
        name = f"specimen_{spheres}_{seed}.data"
        if not (self.folder / name).exists():
            self.deck("in.specimen", {"n": spheres, "seed": seed, "out": name})
        return name

    def run(self, case):
        """The row of a case, by COLUMNS."""
        body = self.specimen(case.spheres, case.seed)
        words = {"specimen": body, "contact": "none", "plasticity": "isotropic", "strain": STRAIN, "out": "case", **case.more}
        seconds = self.deck(case.deck, {**words, "cycles": 1})
        found = curves.cycle_numbers(curves.read_curve(self.folder / "case.csv"))
        pull = "in.traction" if case.deck == "in.cyclic" else case.deck
        self.deck(pull, {**words, "coeff": f"{TABLE1} kv {KV}"})
        axial, lateral = specimen.middle_strains(specimen.read_data(self.folder / body), dump.last_positions(self.folder / "case_state.dump"))
        found["volume_strain"] = axial + 2.0 * lateral
        numbers = {name: f"{found[name]:.6g}" for name in MEASURES}
        return {"knob": case.knob, "choice": case.choice, "spheres": case.spheres, "seed": case.seed, "seconds": f"{seconds:.3g}", **numbers}


def run_plan(folder, plan):
    """All rows, by COLUMNS."""
    runner = Runner(folder)
    return [runner.run(case) for case in watched("unloading:", plan, lambda case: f"{case.knob} {case.choice}, {case.spheres} spheres, seed {case.seed}",
                                                 lambda case: case.spheres / 500)]


def departures(rows, references, name):
    """Of a number from the reference on the same bodies [%]; a dash where there is none."""
    known = {row["seed"]: float(row[name]) for row in references}
    found = [100.0 * (float(row[name]) / known[row["seed"]] - 1.0) for row in rows if row["seed"] in known]
    return spread(found, "{:+.2f}".format) if found else "-"


def largest(rows, knob, measure):
    """The largest departure of a number from the reference of a knob, any choice and body [%]."""
    known = {row["seed"]: float(row[measure]) for row in rows if row["knob"] == knob and row["choice"] == KNOBS[knob].reference}
    found = [abs(float(row[measure]) / known[row["seed"]] - 1.0) for row in rows if row["knob"] == knob and row["seed"] in known]
    return 100.0 * max(found, default=float("nan"))


def answer(rows):
    """The first lines of the page: what to take, and what each choice changes."""
    def departure(knob):
        return [f"{largest(rows, knob, measure):.2f}" for measure in MEASURES]

    def values(knob, pick, measure):
        own = [row for row in rows if row["knob"] == knob]
        sizes = {row["spheres"] for row in own}
        return statistics.mean(float(row[measure]) for row in own if row["spheres"] == pick(sizes))

    def coarsest(knob):
        return max((row["choice"] for row in rows if row["knob"] == knob), key=float, default="-")

    spheres = sorted({row["spheres"] for row in rows if row["knob"] == "particles"})
    if not spheres:
        return []
    change = [f"{100.0 * (values('particles', max, measure) / values('particles', min, measure) - 1.0):+.1f}" for measure in MEASURES]
    return ["Take `dtfraction` "
            f"{coarsest('step')} in in.cyclic or in.traction, or `increment` {coarsest('increment')} in in.quasistatic: smaller ones change little. The number of spheres matters most.\n",
            *table(("change", "compared with", *(f"{title} [%]" for title in MEASURES.values())), (
                (f"{spheres[0]} spheres", f"{spheres[-1]} spheres, mean", *change),
                (f"timestep size up to {coarsest('step')} of the largest stable one", f"{KNOBS['step'].reference} of it, largest difference of any specimen", *departure("step")),
                (f"strain increment up to {coarsest('increment')}", f"{KNOBS['increment'].reference}, largest difference of any specimen", *departure("increment")))), ""]


def page(rows, name):
    """The text of the page; name: of its CSV."""
    lines = ["# Accuracy of unloading and of volume strain\n", *answer(rows),
             f"Written by `doc/studies/accuracy_cost.py --unloading` from the runs in `{name}`: Table 1, contact none, `plasticity isotropic`, one cycle to {100 * STRAIN:g} % strain and back,",
             f"and a tension test to {100 * STRAIN:g} % with *kv* {KV} J of fix evp/volume (for 500 spheres), whose volume strain is that of the middle. "
             "Tables: differences from the reference in percent, median over",
             "the specimens (smallest to largest); time: processor time of the cycle.\n"]
    for knob, about in KNOBS.items():
        own = [row for row in rows if row["knob"] == knob]
        choices = list(dict.fromkeys(row["choice"] for row in own))
        lines.append(f"## {about.title[0].upper()}{about.title[1:]}\n")
        cells = []
        for choice in choices:
            these = [row for row in own if row["choice"] == choice]
            values = {measure: statistics.mean(float(row[measure]) for row in these) for measure in MEASURES}
            cell = [choice, len(these), spread([float(row["seconds"]) for row in these], "{:.2g}".format)]
            for measure in MEASURES:
                if about.reference and choice != about.reference:
                    cell.append(departures(these, [row for row in own if row["choice"] == about.reference], measure))
                else:
                    scatter = statistics.stdev(float(row[measure]) for row in these) / abs(values[measure]) if len(these) > 1 else None
                    cell.append(f"{values[measure]:.4g}" + (f" +- {100 * scatter:.1f} %" if scatter is not None else ""))
            cells.append(cell)
        lines += [*table(("setting", "specimens", "time [s]", *MEASURES.values()), cells), ""]
        lines.append((f"The reference is {about.reference}, with its values (unloading modulus in GPa, loop area in MJ/m3) and their standard deviation over the specimens."
                      if about.reference else "Means and standard deviations over the specimens (unloading modulus in GPa, loop area in MJ/m3).") + "\n")
    return "\n".join(lines).rstrip() + "\n"


def read(path):
    """The rows of a CSV that write() wrote. RunError where it is not one."""
    with open(path, newline="", encoding="utf-8") as source:
        reader = csv.DictReader(source)
        if tuple(reader.fieldnames or ()) != COLUMNS:
            raise RunError(f"{path} is not a table of results: its first line must be {','.join(COLUMNS)}")
        return [{**row, "spheres": int(row["spheres"])} for row in reader]


def write(rows, out):
    """CSV and page."""
    write_csv(out.with_suffix(".csv"), COLUMNS, rows)
    out.write_text(page(rows, out.with_suffix(".csv").name), encoding="utf-8")
