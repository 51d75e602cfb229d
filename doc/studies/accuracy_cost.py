#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Accuracy versus run time of four loads: the settings of the decks, one body after the other, and the number of spheres.

Each setting runs on three bodies, and the chosen ones on a fourth. The error of a setting is the largest difference of its numbers from those
of the finest setting on the same body. About a quarter of an hour on one core; runs that --work has are not repeated.
"""

import csv
import re
import statistics
from typing import Callable, NamedTuple

from study import CHECKOUT, DECKS, Study, deck_command, write_csv
import numpy as np
from evp import curves, figures

SEEDS, UNSEEN = (1, 2, 3), 4  # bodies of the sweep, and the one that is no part of it
SIZED = SEEDS[:2]  # bodies of each number of spheres
BOUNDS = {"5 % (draft)": 5.0, "1 %": 1.0, "0.1 %": 0.1}  # [%]
MARGIN = 1.5  # a setting is chosen where its error in the sweep is that much smaller than the bound
FLOOR = 1e-3  # [%]: smaller errors are drawn here
POINTS = 4  # of a panel of the picture, besides two numbers of spheres
SETTING, SPHERES = "#0072B2", "#E69F00"
COLUMNS = ("scene", "setting", "spheres", "seed", "seconds", "steps", "number", "value")
FORECAST = "deck", "load", "choice", "value", "error_percent"  # columns of accuracy_errors.csv
STEP = "/0.2))"  # of in.impact: the share of the largest stable timestep
ALUMINIUM = CHECKOUT / "potentials" / "metals.evp:aluminium_2024T351"


class Setting(NamedTuple):
    """A deck and what is chosen of it; share: of the largest stable timestep, which in.impact has in a line of its own."""

    deck: str
    choices: dict
    share: float = 0.0


class Scene(NamedTuple):
    """settings: by label, the reference last; sizes: numbers of spheres, the sweep has the first; numbers: (folder, name, printed text) -> {what: value}."""

    title: str
    common: dict
    bodies: dict  # {choice of the deck: (name of the body, share of the spheres, choices of in.specimen)}
    sizes: tuple
    settings: dict
    numbers: Callable


class Run(NamedTuple):
    """One run. steps: timesteps and iterations of the minimizations; found: {what: value}."""

    scene: str
    setting: str
    spheres: int
    seed: int
    seconds: float
    steps: int
    found: dict


def pulled(folder, name, _):
    curve = curves.read_curve(folder / f"{name}.csv")
    return {f"stress at {100 * at:g} % [MPa]": 1e-6 * float(np.interp(at, curve.strain, curve.virial)) for at in (0.005, 0.0077, 0.0195)}


def cycled(folder, name, _):
    found = curves.cycle_numbers(curves.read_curve(folder / f"{name}.csv"))
    return {"stress at 2 % [MPa]": found["turn_MPa"], "residual strain [%]": 100 * found["residual_strain"], "unloading modulus [GPa]": found["unloading_GPa"],
            "loop area [MJ/m3]": found["area_MJ_per_m3"]}


def hit(_folder, _name, text):
    depth, speed = map(float, re.search(r"crater depth (\S+) m, rebound speed (\S+) m/s", text).groups())
    return {"crater depth [mm]": 1e3 * depth, "rebound speed [m/s]": speed}


def pressed(_folder, _name, text):
    force, left = map(float, re.search(r"a force of (\S+) N, .*, (\S+) % of the depth", text).groups())
    return {"force [kN]": 1e-3 * force, "imprint [% of the depth]": left}


CYLINDER = {"specimen": ("cylinder", 1.0, {})}
THICK_PLATE = {"specimen": ("thick", 1.0, {"shape": "block", "length": 0.02, "width": 0.05, "height": 0.05})}
BALL_AND_PLATE = {"plate": ("plate", 0.905, {"shape": "block", "length": 0.008, "width": 0.025, "height": 0.025}),
                  "ball": ("ball", 0.095, {"shape": "region", "region": "ball.region", "length": 0.01})}


def increments(*values):
    """Of a load without flow."""
    return {f"increment {value}": Setting("in.quasistatic", {"increment": value}) for value in values}


def paces(deck, name, label, *settings):
    """settings: (pace, increment or number of increments), the latter the choice `name` of the deck."""
    return {f"pace {pace}, {label.format(value)}": Setting(deck, {"pace": pace, name: value}) for pace, value in settings}


SCENES = {
    "pull": Scene(
        "Tension to 2 % at 1/s", {"coeff": "80 8 4 3 8 4 0.005 1000 1.5", "rate": 1}, CYLINDER, (500, 2000, 8000),
        {**increments("0.005", "0.0025", "0.001", "0.0005"),
         **{f"implicit {share}": Setting("in.traction", {"integrator": "implicit", "dtfraction": share}) for share in (0.9, 0.4, 0.1)},
         **{f"explicit {share}": Setting("in.traction", {"dtfraction": share}) for share in (0.9, 0.4)}}, pulled),
    "cycle": Scene(
        "Tension to 2 % and back", {"material": ALUMINIUM, "cycles": 1}, CYLINDER, (500, 2000, 8000),
        {**{f"rate {rate}": Setting("in.cyclic", {"rate": rate}) for rate in (200, 50)},
         "rate 10, 0.9": Setting("in.cyclic", {"rate": 10, "dtfraction": 0.9}),
         **paces("in.quasistatic", "increment", "increment {}", (4, "0.002"), (1, "0.002"), ("0.3", "0.002"), (1, "0.0005"), ("0.3", "0.0005"), ("0.1", "0.0005"),
                 ("0.05", "0.0005"))}, cycled),
    "impact": Scene(
        "Impact of a ball on a plate at 100 m/s", {}, BALL_AND_PLATE, (1650, 6600, 26400),
        {f"timestep {share}": Setting("in.impact", {}, share) for share in (0.4, 0.2, 0.1, 0.05, 0.02)}, hit),
    "indentation": Scene(
        "Imprint of a ball", {"material": ALUMINIUM, "tool_radius": 0.015, "depth": 0.0015}, THICK_PLATE, (1000, 2000, 4000),
        paces("in.indent", "increments", "{} increments", (3, 10), (1, 5), (1, 10), ("0.3", 10), ("0.3", 20), ("0.3", 40), ("0.1", 40), ("0.05", 80)), pressed),
}


def reference(scene):
    """Label of the setting that the others of a scene are compared with."""
    return list(SCENES[scene].settings)[-1]


def measure(runs, key, label, spheres, seed):
    """The Run of a setting on a body."""
    scene, name = SCENES[key], f"{key}_{label}_{spheres}_{seed}".replace(" ", "_").replace(",", "")
    setting, deck = scene.settings[label], DECKS / scene.settings[label].deck
    if setting.share:
        before, after = deck.read_text(encoding="utf-8").split(STEP)
        deck = runs.folder / setting.deck
        deck.write_text(f"{before}/{setting.share})){after}", encoding="utf-8")
    bodies = {choice: runs.body(f"{what}_{spheres}_{seed}", n=round(share * spheres), seed=seed, **of) for choice, (what, share, of) in scene.bodies.items()}
    text = runs.keep(name, deck_command(deck, {**bodies, **scene.common, **setting.choices, "out": name}))
    steps = int((runs.folder / f"{name}_state.dump").read_text(encoding="utf-8").partition("ITEM: TIMESTEP\n")[2].split()[0])
    return Run(key, label, spheres, seed, runs.seconds(name), steps, scene.numbers(runs.folder, name, text))


def errors(rows, scene, label, seeds=SEEDS):
    """{number: largest difference from the reference on the same bodies [%]} of a setting; not a number where the curve is too coarse for it."""
    of = {(run.setting, run.seed): run.found for run in rows if run.scene == scene and run.spheres == SCENES[scene].sizes[0]}
    pairs = [(of[label, seed], of[reference(scene), seed]) for seed in seeds]
    return {number: float(np.max([100 * abs(own[number] / fine[number] - 1.0) for own, fine in pairs])) for number in pairs[0][1]}


def largest(found):
    """Of errors by number."""
    return float(np.max(list(found.values())))


def cost(rows, scene, label, spheres=None):
    """(processor time [s], millions of steps x spheres) of a setting, medians over the bodies."""
    own = [run for run in rows if (run.scene, run.setting, run.spheres) == (scene, label, spheres or SCENES[scene].sizes[0]) and run.seed in SEEDS]
    return tuple(statistics.median(values) for values in zip(*((run.seconds, 1e-6 * run.steps * run.spheres) for run in own)))


def chosen(rows, scene):
    """{bound: the fastest setting whose error in the sweep keeps it, or None}."""
    labels = [label for label in SCENES[scene].settings if label != reference(scene)]
    return {name: min((label for label in labels if largest(errors(rows, scene, label)) <= bound / MARGIN), key=lambda label: cost(rows, scene, label)[0], default=None)
            for name, bound in BOUNDS.items()}


def sized(rows, scene):
    """The setting that ran on all sizes: that for 1 %, that for 5 % where none keeps 1 %."""
    picked = chosen(rows, scene)
    return picked["1 %"] or picked["5 % (draft)"]


def by_size(rows, scene):
    """{number: {spheres: [value of each body]}} of the setting that ran on all sizes."""
    own = [run for run in rows if (run.scene, run.setting) == (scene, sized(rows, scene)) and run.seed in SIZED]
    return {number: {n: [run.found[number] for run in own if run.spheres == n] for n in SCENES[scene].sizes} for number in own[0].found}


def front(points):
    """Of {label: (time, error)} those labels that no other beats in both, by time."""
    best, kept = float("inf"), []
    for label, (_, error) in sorted(points.items(), key=lambda item: item[1]):
        if error < best:
            best = error
            kept.append(label)
    return kept


def errors_of_size(rows, scene):
    """{spheres: largest difference of a mean from that of the most spheres [%]}."""
    means = [{n: statistics.mean(values) for n, values in sizes.items()} for sizes in by_size(rows, scene).values()]
    return {n: max(100 * abs(mean[n] / mean[SCENES[scene].sizes[-1]] - 1.0) for mean in means) for n in SCENES[scene].sizes[:-1]}


def draw(study, rows):
    """A panel for each scene: settings on the Pareto front, and the number of spheres."""
    drawn = []
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(2, 2, figsize=(11.0, 8.0), sharey=True)
        for axis, (key, scene) in zip(axes.flat, SCENES.items()):
            settings = {label: (cost(rows, key, label)[0], max(largest(errors(rows, key, label)), FLOOR)) for label in scene.settings if label != reference(key)}
            best, wanted = front({label: point for label, point in settings.items() if np.isfinite(point[1])}), chosen(rows, key).values()
            best = [label for label in best if label in [*(one for one in best if one in wanted), *(one for one in best[::-1] if one not in wanted)][:POINTS]]
            sizes = {f"{n} spheres": (cost(rows, key, sized(rows, key), n)[0], error) for n, error in errors_of_size(rows, key).items()}
            for points, color, name in (({label: settings[label] for label in best}, SETTING, "setting"), (sizes, SPHERES, "number of spheres")):
                axis.plot(*zip(*points.values()), "o-", color=color, linewidth=0.8, label=name, clip_on=False)
                for k, (label, point) in enumerate(points.items()):
                    side = -1 if k % 2 and color == SETTING else 1  # of a point, so that labels stay apart
                    axis.annotate(label.replace(", ", ",\n"), point, va="bottom" if side > 0 else "top", xytext=(6 * side, 2 * side), textcoords="offset points",
                                  ha="left" if side > 0 else "right", fontsize=9)
                    drawn.append((key, label, *(f"{value:.4g}" for value in point)))
            axis.set(xscale="log", yscale="log", title=scene.title, xlabel="processor time [s]")
            axis.margins(x=0.45, y=0.12)
            axis.xaxis.set_major_locator(figures.plt.LogLocator(subs=(1, 2, 5)))
            axis.xaxis.set_minor_locator(figures.plt.NullLocator())
            axis.xaxis.set_major_formatter("{x:g}")
            axis.yaxis.set_major_formatter("{x:g}")
        for axis in axes[:, 0]:
            axis.set_ylabel("largest error [%]")
        axes.flat[0].legend(loc="center right")
        figure.tight_layout()
        study.save(figure, ("scene", "setting", "seconds", "error_percent"), drawn)


def words(setting):
    """What a user types."""
    text = " ".join([setting.deck, *(f"-var {name} {value}" for name, value in setting.choices.items())])
    return f"`{text}`" + (f", {setting.share} in its line `variable every`" if setting.share else "")


def shown(value):
    """Two digits of an error [%] or a time."""
    return "-" if not np.isfinite(value) else "< 0.001" if value < 0.001 else f"{value:.2g}" if value < 100 else f"{value:.0f}"


def page(rows):
    """Values of the page."""
    settings, parts = [], []
    for key, scene in SCENES.items():
        picked = chosen(rows, key)
        for label in dict.fromkeys(picked.values()):
            bounds = ", ".join(bound for bound in picked if picked[bound] == label)
            if label is None:
                settings.append((scene.title, bounds, "none but the reference", "", "", "", ""))
                continue
            unseen = largest(errors(rows, key, label, (UNSEEN,)))
            kept = all(unseen <= BOUNDS[bound] for bound in picked if picked[bound] == label)
            settings.append((scene.title, bounds, words(scene.settings[label]), *map(shown, cost(rows, key, label)), shown(largest(errors(rows, key, label))),
                             shown(unseen) + ("" if kept else ", NOT within the bound")))
        for number, sizes in by_size(rows, key).items():
            few, more, most = (statistics.mean(values) for values in sizes.values())
            parts.append((scene.title, number, f"{most:.4g}", shown(errors(rows, key, sized(rows, key))[number]), shown(max(100 * abs(value / few - 1.0) for value in sizes[scene.sizes[0]])),
                          *(f"{n}: {100 * (mean / most - 1):+.1f}" for n, mean in zip(sizes, (few, more))), scene.sizes[-1]))
    faster = cost(rows, "pull", "explicit 0.9")[0] / cost(rows, "pull", "implicit 0.9")[0]
    enough = [f"{min((n for n, error in errors_of_size(rows, key).items() if error <= BOUNDS['5 % (draft)']), default='more')} in '{scene.title}'" for key, scene in SCENES.items()]
    return {"enough": ", ".join(enough), "margin": MARGIN, "bodies": len(SEEDS), "spheres": ", ".join(str(scene.sizes[0]) for scene in SCENES.values()), "faster": f"{faster:.0f}",
            "viscous": shown(largest(errors(rows, "pull", "increment 0.0005"))), "vibration": shown(errors(rows, "cycle", "rate 10, 0.9")["stress at 2 % [MPa]"]),
            "jump": shown(errors(rows, "indentation", "pace 0.1, 40 increments")["force [kN]"]),
            "settings": (("load", "error within", "run", "time [s]", "steps x spheres [million]", "error [%]", "on an unseen body [%]"), settings),
            "parts": (("load", "number", "with the most spheres", "setting [%]", "packing [%]", "fewest spheres [%]", "more [%]", "most spheres"), parts)}


def forecast(rows):
    """Rows of accuracy_errors.csv, by which tools/cost.py forecasts: of each deck the errors of its choice, by value, and those of the number of spheres and of the packing."""
    for key, scene in SCENES.items():
        worst = {}
        for label, setting in scene.settings.items():
            choice = next((name for name in ("pace", "increment", "rate", "dtfraction") if name in setting.choices), "timestep")
            if label != reference(key) and (choice != "timestep" or setting.share == 0.2):  # what in.impact takes
                case = setting.deck, choice, float(setting.choices.get(choice, setting.share))
                worst[case] = np.maximum(worst.get(case, FLOOR), largest(errors(rows, key, label)))
        yield from ((deck, scene.title, choice, value, f"{error:.3g}") for (deck, choice, value), error in worst.items() if np.isfinite(error))
        packing = max(max(abs(value / statistics.mean(values) - 1.0) for value in values) for values in (sizes[scene.sizes[0]] for sizes in by_size(rows, key).values()))
        for deck in dict.fromkeys(setting.deck for setting in scene.settings.values()):
            yield from ((deck, scene.title, "spheres", n, f"{error:.3g}") for n, error in errors_of_size(rows, key).items())
            yield deck, scene.title, "packing", scene.sizes[0], f"{100 * packing:.3g}"


def read(path):
    """The Runs of a CSV that main() wrote."""
    found = {}
    with open(path, newline="", encoding="utf-8") as source:
        for row in csv.DictReader(source):
            one = Run(row["scene"], row["setting"], int(row["spheres"]), int(row["seed"]), float(row["seconds"]), int(row["steps"]), {})
            found.setdefault(one[:4], one).found[row["number"]] = float(row["value"])
    return list(found.values())


def main(arguments=None):
    with Study(__doc__, "accuracy_cost").started(arguments) as study:
        (study.runs.folder / "ball.region").write_text("region body sphere 0.005 0 0 0.005\n", encoding="utf-8")
        plan = [(key, label, SCENES[key].sizes[0], seed) for key in SCENES for seed in SEEDS for label in SCENES[key].settings]
        rows = [measure(study.runs, *case) for case in study.each(plan, str)]
        plan = []
        for key in SCENES:
            labels = chosen(rows, key)
            plan += [(key, label, SCENES[key].sizes[0], UNSEEN) for label in dict.fromkeys([*labels.values(), reference(key)]) if label]
            plan += [(key, sized(rows, key), spheres, seed) for spheres in SCENES[key].sizes[1:] for seed in SIZED]
        rows += [measure(study.runs, *case) for case in study.each(plan, str)]
        table = study.out.with_suffix(".csv")
        write_csv(table, COLUMNS, [(*run[:4], f"{run.seconds:.3g}", run.steps, number, f"{value:.8g}") for run in rows for number, value in run.found.items()])
        rows = read(table)  # the page is that of its CSV
        write_csv(study.out.with_name("accuracy_errors.csv"), FORECAST, forecast(rows))
        draw(study, rows)
        study.write(**page(rows))


if __name__ == "__main__":
    main()
