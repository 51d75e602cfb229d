# SPDX-License-Identifier: GPL-2.0-only
"""Pictures, each with its numbers in a CSV of the same name beside it.

Colours are chosen to stay apart for colour-blind readers; curves that lie on each other are told
apart by their dashes as well.
"""

import pathlib
import textwrap

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.ticker import EngFormatter  # noqa: E402

from . import law  # noqa: E402
from .curves import TENSION, residual_strain  # noqa: E402
from .report import write_csv  # noqa: E402

MEASURED = ("strain", "distance", "force")  # [1], [m], [N]
_COLORS = ("#E69F00", "#0072B2", "#CC3311", "#009E73", "#6F4A8E", "#56B4E9", "#882255", "#555555")
_DASHES = (  # of all curves but the first, so that it can be seen below them
    (0, (5, 2)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1, 1, 1, 1, 1)), (0, (10, 2)),
)
_LINE_WIDTH = 1.8  # of every curve
LOOK = {
    "font.size": 11,
    "axes.titlesize": 12,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "savefig.dpi": 160,
}


def save(figure, path, header, rows):
    """Write figure to path, NAME.png, and rows under header to NAME.png.csv: NAME.csv may be the output of a run."""
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, bbox_inches="tight")
    plt.close(figure)
    write_csv(path.with_name(path.name + ".csv"), header, rows)
    return path


def line_style(k):
    """Colour and dashes of curve k; the first 40 differ."""
    dashes = _DASHES[(k - 1) % len(_DASHES)] if k else "-"
    return {"color": _COLORS[k % len(_COLORS)], "linestyle": dashes, "linewidth": _LINE_WIDTH}


def legend_below(axis, columns, **look):
    """The legend, under the axis."""
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncol=columns, **look)


def short_names(paths):
    """Names for files: the stem, with as many of its folders as tell it from the others."""
    every = [(*path.parent.parts, path.stem) for path in map(pathlib.Path, paths)]

    def alone(words, count):
        return sum(other[-count:] == words[-count:] for other in set(every)) == 1

    counts = [next(n for n in range(1, len(words) + 2) if alone(words, n)) for words in every]
    return ["/".join(words[-count:]) for words, count in zip(every, counts)]


def _is_positive(values):
    """But for round-off and a little vibration."""
    return min(values) > -0.01 * max(map(abs, values))


def stress_strain(panels, path, load=TENSION):
    """Stress-strain curves: panels is {title: [(label, curves.Curve), ...]}, side by side.

    load: curves.Load of all curves. Writes path and its CSV: panel, curve, strain_percent, stress_MPa.
    A label means the same line in every panel; within a panel no two curves share one.
    """
    rows, styles = [], {}
    with plt.rc_context(LOOK):
        figure, axes = plt.subplots(1, len(panels), sharey=True, squeeze=False, figsize=(1.2 + 4.4 * len(panels), 4.2))
        for axis, (title, curves) in zip(axes[0], panels.items()):
            for label, curve in curves:
                percent, stress = 100 * curve.strain, 1e-6 * curve.virial
                axis.plot(percent, stress, label=label, **styles.setdefault(label, line_style(len(styles))))
                rows += [(title, label, f"{a:.6g}", f"{b:.6g}") for a, b in zip(percent, stress)]
            axis.set(title=title, xlabel=f"{load.strain} [%]")
            legend_below(axis, min(3, len(curves)), handlelength=3.0, columnspacing=1.4)
        for axis in axes[0]:  # once all is drawn: the panels share their scale
            if _is_positive([float(strain) for *_, strain, _ in rows]):
                axis.set_xlim(left=0)
            if _is_positive([float(stress) for *_, stress in rows]):
                axis.set_ylim(bottom=0)
        axes[0][0].set_ylabel(textwrap.fill(f"{load.stress} [MPa]", 36))
        return save(figure, path, ("panel", "curve", "strain_percent", "stress_MPa"), rows)


COLUMNS = {  # of PREFIX.csv of the decks, by their unit; "": numbers and ratios
    "": "strain strain_gauge shear_strain share_second volume_change plastic_strain fourier rms poisson anisotropy turns follow_first follow_second regime "
        "travel_over_thickness beyond_dlim second_regime new_pairs lowest_ratio failed ended_at_dlim parted joined joints ended",
    "s": "time",
    "m": "travel depth deflection distance length height width_middle width_plates contact_radius",
    "m/s": "speed",
    "rad": "angle",
    "N": "force force_base force_x force_y force_z force_ram force_container force_cone force_bearing force_lower force_upper force_punch force_left force_right "
         "reaction friction normal",
    "N m": "torque_grip torque_virial torque_pin torque_shoulder",
    "Pa": "stress stress_grip stress_virial lateral_stress shear_stress shear_stress_grip shear_stress_virial pressure hardness young bulk shear",
    "J": "energy kinetic_energy plastic_work work heat imbalance energy_imbalance heat_imbalance",
    "W": "flux_left flux_right",
    "K": "temperature temperature_highest temperature_middle temperature_by_hand temperature_near thermocouple_1 thermocouple_2 thermocouple_3 thermocouple_4 "
         "thermocouple_5",
}
UNITS = {name: unit for unit, names in COLUMNS.items() for name in names.split()}


def unit_on(axis, name):
    """The unit of a column on its axis: at the ticks, with its prefix; kelvins, which take none, in the label."""
    unit = UNITS.get(name, "")
    if unit == "K":
        axis.set_label_text(f"{axis.get_label_text()} [K]")
    elif unit:
        axis.set_major_formatter(EngFormatter(unit))


def two_columns(curves, x, y, path, title=""):
    """Column y over column x: curves is {label: {name: values}}. Writes path and its CSV: curve, x, y, in the units of the decks."""
    rows = []
    with plt.rc_context(LOOK):
        figure, axis = plt.subplots(figsize=(6.4, 3.6))
        for k, (label, columns) in enumerate(curves.items()):
            axis.plot(columns[x], columns[y], label=label, **line_style(k))
            rows += [(label, f"{a:.6g}", f"{b:.6g}") for a, b in zip(columns[x], columns[y])]
        axis.set(xlabel=x.replace("_", " "), ylabel=y.replace("_", " "), title=title)
        for own, name in ((axis.xaxis, x), (axis.yaxis, y)):
            unit_on(own, name)
        if len(curves) > 1:
            axis.legend(frameon=False)
        return save(figure, path, ("curve", x, y), rows)


def percent_left(strain):
    """A residual strain as text, without the sign of a zero."""
    return f"{round(100 * strain, 2) + 0.0:.2f} %"


def residual_text(strain):
    """What is said of a residual strain of curves.py, which is nan where the body is not unloaded."""
    return f"residual strain {percent_left(strain)}" if np.isfinite(strain) else "no residual strain (not unloaded)"


def unloading(curves, path, load=TENSION, turns=None):
    """Curves that turn back: curves is {label: curves.Curve}, turns {label: rows}, as `at` of curves.py, or None; the residual strain is told behind each label, and marked.

    Writes path and its CSV: curve, strain_percent, stress_MPa.
    """
    rows = []
    with plt.rc_context(LOOK):
        figure, axis = plt.subplots(figsize=(6.4, 4.2))
        for k, (label, curve) in enumerate(curves.items()):
            percent, stress, style = 100 * curve.strain, 1e-6 * curve.virial, line_style(k)
            left = residual_strain(curve.strain, curve.virial, turns and turns[label])
            name = f"{label}: {residual_text(left)}"
            axis.plot(percent, stress, label=name, **style)
            axis.plot([100 * left], [0.0], "o", color=style["color"], markeredgecolor="#333333", markeredgewidth=0.5, markersize=6, zorder=3)
            rows += [(name, f"{a:.6g}", f"{b:.6g}") for a, b in zip(percent, stress)]
        axis.axhline(0, color="#333333", linewidth=0.8)
        axis.set(xlabel=f"{load.strain} [%]", ylabel=textwrap.fill(f"{load.stress} [MPa]", 36))
        legend_below(axis, 1, handlelength=3.0)
        return save(figure, path, ("curve", "strain_percent", "stress_MPa"), rows)


def force_law(row, path, measured=None):
    """Force of one pair against its strain (the paper's figure 2): lines from law.py.

    row: law.Row. measured: None, or the columns MEASURED of in.two_spheres as a dict of arrays, drawn as points on the lines.
    Writes path and its CSV: strain_percent, force_N, first_regime_N, source.
    """
    ends, deq = (-0.03, 0.03), 0.01  # of strain; [m]
    if measured is not None:
        points = measured["strain"]
        deq = float(np.median(measured["distance"] / (1 + points)))
        ends = (points.min(), points.max())
    strain = np.linspace(*ends, 801)
    force = law.force((1 + strain) * deq, deq, row)
    first = law.potential_force((1 + strain) * deq, deq, row.e1, row.m1, row.n1)
    shown = 1.25 * np.abs(force).max()
    rows = [(f"{100 * s:.6g}", f"{f:.9g}", f"{g:.9g}", "law") for s, f, g in zip(strain, force, first)]
    with plt.rc_context(LOOK):
        figure, axis = plt.subplots(figsize=(6.4, 4.2))
        axis.axvspan(-100 * row.xi_s, 100 * row.xi_s, color="#eeeeee", linewidth=0)
        axis.plot(100 * strain, 1e-3 * np.where(np.abs(first) <= 1.05 * shown, first, np.nan),
                  color="#888888", linestyle=(0, (4, 2)), linewidth=1.2, label="first regime, extended")
        axis.plot(100 * strain, 1e-3 * force, color="#0072B2", linewidth=2, label="eq. 8")
        if measured is not None:
            thin = np.unique(np.linspace(0, len(points) - 1, 60).astype(int))
            axis.plot(100 * points[thin], 1e-3 * measured["force"][thin], "o", color="#E69F00", markeredgecolor="#333333",
                      markeredgewidth=0.5, markersize=5, label="measured in LAMMPS")
            rows += [(f"{100 * s:.6g}", f"{f:.9g}", "", "LAMMPS") for s, f in zip(points, measured["force"])]
        axis.axhline(0, color="#333333", linewidth=0.8)
        axis.set(xlim=(102 * ends[0], 102 * ends[1]), ylim=(-1e-3 * shown, 1e-3 * shown),
                 xlabel=r"strain of the pair, $(d - d_{eq})/d_{eq}$ [%]", ylabel="force [kN], repulsion positive")
        for middle, name in ((0.0, "first\nregime"), (0.5 * (row.xi_s + ends[1]), "second regime"), (0.5 * (ends[0] - row.xi_s), "second regime")):
            if ends[0] < middle < ends[1]:
                axis.text(100 * middle, 1.01, name, transform=axis.get_xaxis_transform(), ha="center", va="bottom", fontsize=9, color="#555555")
        legend_below(axis, 3)
        header = ("strain_percent", "force_N", "first_regime_N", "source")
        return save(figure, path, header, rows)
