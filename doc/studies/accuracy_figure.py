# SPDX-License-Identifier: GPL-2.0-only
"""The picture of doc/studies/accuracy_cost.py: error against time, one colour a knob."""

import statistics

import study  # noqa: F401  first
import numpy as np

from accuracy_cases import KNOBS
from accuracy_report import STRESS, extrapolate, front, worst_stress
from evp.figures import LOOK, plt, save

FLOOR = 1e-3  # [%]: smaller errors are drawn here


def pareto(results, path):
    """Left: error of the stresses against time over that of the paper's method; right: number of spheres. Writes path and its CSV."""
    rows = []
    with plt.rc_context(LOOK):
        figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6), gridspec_kw={"width_ratios": (2.2, 1)})
        kept = [(time, max(error, FLOOR)) for time, error in front(draw_choices(left, results, rows))]
        left.plot(*zip(*kept), color="black", linewidth=0.8, zorder=1)
        left.plot(*zip(*kept), "o", markersize=13, markerfacecolor="none", markeredgecolor="black", linestyle="none", label="Pareto front")
        left.set(xscale="log", yscale="log", xlabel=f"processor time / that of the paper's method (dt = {results.recipe.name})",
                 ylabel="largest error of the stresses [%]", title="Settings: Table 2 at 1/s, 500 spheres")
        draw_sizes(right, results, rows)
        figure.tight_layout()
        figure.legend(*left.get_legend_handles_labels(), fontsize=9, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=3)
        return save(figure, path, ("panel", "knob", "choice", "time", "error_percent"), rows)


def draw_choices(axis, results, rows):
    """Marks of all settings but the target itself; the (time, error) of the routes that were run on every specimen."""
    routes = []
    for name, knob in KNOBS.items():
        points = []
        for choice in results.choices.values():
            if choice.knob != name or choice is results.target:
                continue
            time, error = choice.time / results.recipe.time, worst_stress(choice, results.target)
            if np.isfinite(error):
                points.append((time, max(error, FLOOR)))
                rows.append(("choices", name, choice.name, f"{time:.5g}", f"{error:.5g}"))
                if knob.route and results.complete(choice):
                    routes.append((time, error))
        if points:
            axis.plot(*zip(*points), marker="o" if knob.route else "s", markersize=6, linewidth=0.6, linestyle=":", color=knob.colour,
                      markerfacecolor=knob.colour if knob.route else "white", label=knob.title)
    return routes


def draw_sizes(axis, results, rows):
    """Departure from infinitely many spheres against time, with the scatter of one specimen."""
    limit = extrapolate(results.sizes, STRESS)
    if limit is None:
        axis.set_visible(False)
        return
    for count, choice in sorted(results.sizes.items()):
        values = [100.0 * (numbers[STRESS] / limit[0] - 1.0) for numbers in choice.by_seed.values()]
        axis.errorbar(choice.time, abs(statistics.mean(values)), yerr=statistics.stdev(values) if len(values) > 1 else None, fmt="o",
                      color=KNOBS["particles"].colour, capsize=3)
        axis.annotate(f" {count}", (choice.time, abs(statistics.mean(values))), fontsize=9)
        rows.append(("particles", "particles", count, f"{choice.time:.5g}", f"{abs(statistics.mean(values)):.5g}"))
    axis.set(xscale="log", yscale="log", xlabel="processor time / that of the baseline",
             ylabel="error of the stress at 1 % strain [%]", title="Number of spheres: Table 1 at 10/s")
    axis.yaxis.set_major_formatter("{x:g}")
    axis.yaxis.set_minor_formatter("{x:g}")
    axis.margins(x=0.2)
