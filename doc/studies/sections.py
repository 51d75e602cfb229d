# SPDX-License-Identifier: GPL-2.0-only
"""Sections of bodies of spheres beside those of finite elements, colored by plastic strain, for what_to_believe.py. Lengths in mm.

Cells are those of doc/studies/fe/NAME_section.csv; spheres are those of the last state of a run that the plane of the section cuts, and those behind it whose centers are
within a diameter.
"""

from typing import NamedTuple

import numpy as np
from evp import dump, figures
from matplotlib.collections import LineCollection, PatchCollection, PolyCollection
from matplotlib.patches import Circle, Polygon, Rectangle

COLORS = "viridis"
AXIS = 0.05  # what is nearer to the axis is on it [mm]
TOOL = {"facecolor": "#d0d0d0", "edgecolor": "#777777", "linewidth": 0.8}


class Cells(NamedTuple):
    """Half of a section: layer (n,), 0 is the lowest one; corners (n, 4, 2), counter-clockwise or clockwise from the lower one that is nearer to the start of its column;
    plastic strain (n,)."""

    layer: np.ndarray
    corners: np.ndarray
    plastic: np.ndarray

    def mirrored(self, factors):
        """Those, and those at the coordinates times factors."""
        return Cells(np.tile(self.layer, 2), np.concatenate([self.corners, self.corners * factors]), np.tile(self.plastic, 2))

    def top(self):
        """(r, z) of the upper edge of the highest layer, with increasing r."""
        edges = self.corners[self.layer == self.layer.max()][:, [3, 2]]
        points = np.concatenate([edges[:1, 0], edges[:, 1]])
        return points[np.argsort(points[:, 0], kind="stable")].T


class Discs(NamedTuple):
    """Spheres of a section: centers (n, 2), from back to front, radius (n,) and plastic strain (n,)."""

    centers: np.ndarray
    radius: np.ndarray
    plastic: np.ndarray


def read_cells(path):
    """Cells of a file of doc/studies/fe."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")][1:]
    values = np.loadtxt(lines, delimiter=",")
    return Cells(values[:, 0].astype(int), values[:, 1:9].reshape(-1, 4, 2), values[:, 9])


def read_discs(path, across, up, zero):
    """Discs of a state: columns across and up, which are 0 at `zero` [m], None: in the middle of the centers; the third coordinate is 0 in the section."""
    last = dump.index([path])[-1].read()
    (away,) = {"x", "y", "z"} - {across, up}
    rows = np.flatnonzero((last[away] < last["radius"]) & (last[away] > -2.0 * last["radius"]))
    rows = rows[np.argsort(last[away][rows], kind="stable")]
    middles = [0.5 * (last[name].min() + last[name].max()) if at is None else at for name, at in zip((across, up), zero)]
    centers = np.stack([last[name][rows] - middle for name, middle in zip((across, up), middles)], axis=1)
    return Discs(1e3 * centers, 1e3 * last["radius"][rows], last["plastic_strain"][rows])


def mean_in_rings(r, z, rings):
    """Means of a surface z(r) of revolution over rings (inner, outer)."""
    means = []
    for inner, outer in rings:
        at = inner + (np.arange(200) + 0.5) / 200 * (outer - inner)
        means.append(np.average(np.interp(at, r, z), weights=at))
    return np.array(means)


def outline(cells):
    """Edges (n, 2, 2) of one cell alone, without those on the axis."""
    edges = np.concatenate([cells.corners[:, [k, (k + 1) % 4]] for k in range(4)])
    _, where, count = np.unique(np.sort(np.round(edges, 4) + 0.0, axis=1), axis=0, return_index=True, return_counts=True)
    alone = edges[where[count == 1]]
    return alone[np.abs(alone[:, :, 0]).max(axis=1) > AXIS]


def draw(axis, discs, cells, window, tools, across):
    """Discs left of 0, cells right of it, and the edge of the cells around both; a color bar for both. window: (left, right, low, high); tools: polygons (n, 2) or (center, radius)."""
    left, right, low, high = window
    largest = np.ceil(10.0 * max(np.quantile(each.plastic, 0.98) for each in (discs, cells))) / 10.0
    scale = {"cmap": COLORS, "norm": figures.plt.Normalize(0.0, largest)}
    for tool in tools:
        axis.add_patch(Circle(*tool, **TOOL) if np.ndim(tool[1]) == 0 else Polygon(tool, **TOOL))
    there = discs.centers[:, 0] < discs.radius
    half = PatchCollection([Circle(center, radius) for center, radius in zip(discs.centers[there], discs.radius[there])], edgecolor="#333333", linewidth=0.3, **scale)
    half.set_array(discs.plastic[there])
    axis.add_collection(half)
    half.set_clip_path(Rectangle((left, low), -left, high - low, transform=axis.transData))
    filled = PolyCollection(cells.corners, edgecolor="none", antialiased=False, **scale)
    filled.set_array(cells.plastic)
    axis.add_collection(filled)
    edge = outline(cells)
    axis.add_collection(LineCollection(edge, color="black", linewidth=1.2))
    axis.add_collection(LineCollection(edge * (-1, 1), color="black", linewidth=1.2, linestyle=(0, (1, 1))))
    axis.axvline(0.0, color="black", linewidth=1.2)
    axis.set(xlim=(left, right), ylim=(low, high), aspect="equal", xlabel=across, ylabel="height [mm]")
    axis.xaxis.set_major_formatter(lambda x, _: f"{abs(x):g}")
    axis.grid(False)
    axis.figure.colorbar(filled, cax=axis.inset_axes((1.02, 0.0, 0.02, 1.0)), extend="max", label="equivalent plastic strain")
