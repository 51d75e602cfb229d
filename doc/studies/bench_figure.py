# SPDX-License-Identifier: GPL-2.0-only
"""The picture of doc/studies/bench.py, from its CSV."""

import study  # noqa: F401  first
from matplotlib import ticker

from evp.figures import LOOK, plt

OWN, OTHER = "#0072B2", "#999999"


def plain_log(axis, subs):
    """A logarithmic axis whose ticks, at subs times powers of ten, read 20 and 10 000 instead of powers."""
    axis.set_major_locator(ticker.LogLocator(subs=subs))
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:,.0f}".replace(",", " ") if value >= 1000 else f"{value:g}"))
    axis.set_minor_formatter(ticker.NullFormatter())


def draw(rows, path):
    """Left: time per interaction of each style; right: time per particle against their number. Writes path, from rows of the CSV."""
    bars = [(row["name"], float(row["value"])) for row in rows if row["section"] == "lattice"]
    scale = {name: sorted((int(row["x"]), float(row["value"])) for row in rows if row["section"] == "scale" and row["name"] == name) for name in ("evp/lj", "lj/cut")}
    path.parent.mkdir(parents=True, exist_ok=True)
    with plt.rc_context(LOOK):
        figure, (left, right) = plt.subplots(1, 2, figsize=(13, 4.8), gridspec_kw={"width_ratios": (1.7, 1)})
        if bars:
            names, values = zip(*sorted(bars, key=lambda bar: -bar[1]))
            left.barh(names, values, color=[OWN if name.startswith("evp/lj") else OTHER for name in names])
            for place, value in enumerate(values):
                left.text(value, place, f" {value:.3g}", va="center", fontsize=9)
            left.set(xscale="log", xlim=(0.6 * min(values), 1.6 * max(values)), xlabel="ns per interaction and step, one core", title="FCC lattice, 9 half pairs per sphere")
            plain_log(left.xaxis, (1, 2, 5))
            left.grid(axis="y", visible=False)
        if scale["evp/lj"]:
            for (name, points), color in zip(scale.items(), (OWN, OTHER)):
                if points:
                    right.plot(*zip(*points), "o-", color=color, label=name)
            right.legend()
            right.set(xscale="log", ylim=(0, 1.25 * max(value for points in scale.values() for _, value in points)), xlabel="spheres", ylabel="ns per sphere and step, one core",
                      title="Cost per sphere")
            plain_log(right.xaxis, (1,))
        figure.tight_layout()
        figure.savefig(path, bbox_inches="tight")
        plt.close(figure)
