# SPDX-License-Identifier: GPL-2.0-only
"""The picture of a calibration: the curve of the row, and the targets as points."""

import numpy as np

from . import calibration_affine as affine
from . import figures

MPA = 1e6


def draw(name, targets, curve, path):
    """Writes path (a .png) and the CSV beside it."""
    strain, stress = 100.0 * curve[0], curve[1] / MPA
    at = 100.0 * (targets.yield_strain + affine.YIELD_OFFSET)
    points = ((at, targets.yield_stress / MPA, "0.2 % yield stress"), (100.0 * abs(targets.strain), targets.stress2 / MPA, "second stress"))
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(1, 2, figsize=(10.0, 4.2))
        for axis, end in zip(axes, (2.0 * at, strain[-1] * 1.04)):
            axis.plot(strain, stress, label=f"row {name}", **{**figures.line_style(1), "linestyle": "-"})
            line = np.array([0.2, at])
            axis.plot(line, targets.modulus / MPA * 0.01 * (line - 0.2), color="#888888", linewidth=1.2, linestyle=(0, (2, 2)), label="E (strain - 0.2 %)")
            for k, (x, y, label) in enumerate(points):
                if x <= end:
                    axis.plot([x], [y], "os"[k], color="#CC3311", markersize=8, label=f"target: {label}", zorder=5)
            axis.set(xlim=(0, end), xlabel="nominal strain [%]")
            inside = stress[strain <= end]
            axis.set_ylim(0, 1.15 * max(inside.max(), points[0][1]))
        axes[0].set_ylabel("nominal stress [MPa]" + (" in compression" if targets.strain < 0.0 else ""))
        handles, labels = axes[1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=4)
        rows = [("curve", f"{a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress)] + [(label, f"{x:.6g}", f"{y:.6g}") for x, y, label in points]
        return figures.save(figure, path, ("what", "strain_percent", "stress_MPa"), rows)
