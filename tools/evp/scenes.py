# SPDX-License-Identifier: GPL-2.0-only
"""From the snapshots of dumps to spheres that can be drawn: places, radii, the column that colors them, what is cut away. Puts pictures of spheres
beside each other, with titles, one color bar and one scale bar; a row of such pictures into a film. Files for ParaView: VTK XML unstructured grids
of points (.vtu) and a collection of them in time (.pvd)."""

import base64
import re
import sys
import textwrap
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import matplotlib
import numpy as np

from . import dump, spheres
from .figures import EngFormatter, plt

_PLACES = (("x", "y", "z"), ("xu", "yu", "zu"))
_CUT = re.compile(r"\s*([^<>=\s]+)\s*([<>])\s*(\S+)\s*")
_TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}
_VERTEX = 1  # VTK's number of the cell that is a point
DPI = 100
_GAP = 24  # [pixels] between pictures
_BAR = 120  # of the color bar with its text, one line
_LINE = 20  # of each further line of this text
_LETTER = 8  # of a letter there, on average
_FOOT = 64  # of the scale bar with its text
_HEAD = 34  # of a title
OUTER = 0.5  # percent of the values
PLAIN = "#9fb4c8"  # spheres that no column colors
PARTS = (PLAIN, "#E69F00", "#0072B2", "#009E73", "#CC3311", "#6F4A8E", "#F0E442", "#882255")  # of a few whole numbers


def condition(text):
    """Function that gives the mask of a text such as 'y>0.01' or 'y>0.01 or z<0', in the units of the dump, for a table of columns; ValueError where it
    is none."""
    parts = []
    for part in re.split(r"\sor\s", text):
        found = _CUT.fullmatch(part)
        try:
            parts.append((found[1], found[2] == ">", float(found[3])))
        except (TypeError, ValueError) as error:
            raise ValueError(f"--cut '{text}' is no condition: give COLUMN>NUMBER or COLUMN<NUMBER, such as \"y>0\", or several with the word or "
                             "between them") from error

    def holds(table, where):
        dump.need(table, [name for name, _, _ in parts], where)
        return np.logical_or.reduce([table[name] > limit if above else table[name] < limit for name, above, limit in parts])

    return holds


class Spheres(NamedTuple):
    """x (N, 3) and radius (N,) [length], values (N,) [unit of the dump] of the column that colors them or None."""

    x: np.ndarray
    radius: np.ndarray
    values: np.ndarray


def read_table(snapshot):
    """{name: (N,) array} of a snapshot, with a radius. ValueError where it has none or a place is not finite."""
    table = snapshot.read()
    if snapshot.count == 0:
        raise ValueError(f"{snapshot} has no atoms")
    if "diameter" in table:
        table.setdefault("radius", 0.5 * table["diameter"])
    if "radius" not in table:
        raise ValueError(f"{snapshot} has no column radius; it has {' '.join(table)}: add radius to the dump command")
    x = places(table, snapshot)
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(table["radius"]))):
        raise ValueError(f"{snapshot} has a position or radius that is not finite: the run was unstable")
    if np.any(table["radius"] <= 0.0):
        raise ValueError(f"{snapshot} has a radius that is not positive: {table['radius'].min():g}")
    return table


def places(table, where):
    """(N, 3) from x y z or xu yu zu."""
    names = next((names for names in _PLACES if all(name in table for name in names)), None)
    if names is None:
        dump.need(table, _PLACES[0], where)
    return np.stack([table[name] for name in names], axis=1)


def spheres_of(snapshot, color=None, cuts=()):
    """Spheres of a snapshot. cuts: groups of condition(); those for which all of a group hold are left out.

    ValueError where a column is missing or not finite, or nothing is left.
    """
    table = read_table(snapshot)
    if color:
        dump.need(table, [color], snapshot)
        if not np.all(np.isfinite(table[color])):
            raise ValueError(f"{snapshot}: column {color} has values that are not finite")
    kept = np.ones(snapshot.count, dtype=bool)
    for group in cuts:
        kept &= ~np.logical_and.reduce([one(table, snapshot) for one in group])
    if not kept.any():
        raise ValueError(f"{snapshot}: --cut leaves no sphere")
    return Spheres(places(table, snapshot)[kept], table["radius"][kept], table[color][kept] if color else None)


def evenly(items, count):
    """`count` of the items, evenly spaced, the first and the last among them; all where there are no more. One: the last."""
    if count >= len(items):
        return list(items)
    return [items[k] for k in np.unique(np.round(np.linspace(len(items) - 1, 0, count)).astype(int))]


class ColorScale:
    """Which color a value has: limits [unit of the label], a matplotlib map, and the text beside the bar. None: plain spheres."""

    def __init__(self, low, high, values, label=""):
        """values: lowest and highest that are drawn; the bar shows where they are beyond the limits."""
        self.map = plt.get_cmap("coolwarm" if low < 0.0 < high else "YlOrRd")
        if high <= low:
            low, high = low - 0.5, low + 0.5
        self.low, self.high, self.label = low, high, label
        below, above = values[0] < low, values[1] > high
        self.extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[below, above]

    def share(self, values):
        """Values from 0 to 1 between the limits."""
        return np.clip((values - self.low) / (self.high - self.low), 0.0, 1.0)

    def colors(self):
        return self.map(np.linspace(0.0, 1.0, spheres.SHADES))[:, :3]


class Legend:
    """A color for each of a few whole numbers, such as those of the parts of a body; label: text above them."""

    def __init__(self, numbers, label):
        """numbers: that are drawn, ascending, no more than there are PARTS."""
        self.numbers, self.label = numbers, label

    def share(self, values):
        """The middle of the shades of each value."""
        return (np.searchsorted(self.numbers, values) + 0.5) / len(self.numbers)

    def entries(self):
        """(number as text, color) of each."""
        return [(f"{number:.0f}", PARTS[k]) for k, number in enumerate(self.numbers)]

    def colors(self):
        """LAMMPS blends neighboring shades: those in the middle of each number's are its own."""
        shades = (np.linspace(0.0, 1.0, spheres.SHADES) * len(self.numbers)).astype(int).clip(max=len(self.numbers) - 1)
        return np.array([matplotlib.colors.to_rgb(PARTS[k]) for k in shades])


def few_numbers(columns):
    """The values of arrays, ascending, where they are whole numbers and no more than there are colors for them; else None."""
    found = np.unique(np.concatenate([np.unique(values) for values in columns]))
    return found if len(found) <= len(PARTS) and np.all(found == np.round(found)) else None


def limits(low, high):
    """Limits of the bar for values from low to high: the same on both sides of zero where they have both signs."""
    return (-max(-low, high), max(-low, high)) if low < 0.0 < high else (low, high)


def bulk(values):
    """(low, high) of the values without the outermost half percent of either side, where these alone would take up half of the bar or more;
    else their ends."""
    ends, inner = (values.min(), values.max()), np.percentile(values, (OUTER, 100.0 - OUTER))
    return tuple(inner) if 0.0 < inner[1] - inner[0] < 0.5 * (ends[1] - ends[0]) else ends


def note_of_outer(drawn, shown, unit=""):
    """Words for the label where the bar ends (shown) before the values (drawn) do, '' where it does not; unit: '%' or other, of both."""
    unit = "" if unit == "" or " " in unit else f" {unit}"  # a unit of several words is in the label already
    below, above = drawn[0] < shown[0], drawn[1] > shown[1]
    return ", ".join(f"{name} {value:.3g}{unit}" for name, value, left in (("lowest", drawn[0], below), ("highest", drawn[1], above)) if left)


def plain_colors():
    return np.tile(matplotlib.colors.to_rgb(PLAIN), (spheres.SHADES, 1))


def round_length(longest):
    """The largest 1, 2 or 5 times a power of ten that is no more than this."""
    power = 10.0 ** np.floor(np.log10(longest))
    return max(k * power for k in (1.0, 2.0, 5.0) if k * power <= longest * (1.0 + 1e-9))


def time_text(seconds):
    """'37.1 \u00b5s'."""
    return EngFormatter("s")(float(f"{seconds:.3g}"))


def length_text(length, units):
    """'5 mm'; in units other than SI '5 length units'."""
    return EngFormatter("m")(length) if units == "si" else f"{length:g} length units ({units})"


def label_lines(label, letters):
    """Lines of no more letters than that; a unit in brackets stays in one line where it can."""
    whole = re.sub(r"\[[^]]*\]", lambda unit: unit[0].replace(" ", "\u00a0"), label)
    return [line for text in whole.split("\n") for line in textwrap.wrap(text, letters)]


def compose(pictures, titles, heads, per_pixel, units, scale=None, note=""):
    """A figure: pictures[row][column] of bytes, titles of the columns, heads of the rows ('' for none), per_pixel [length]; note: in the
    lower right corner."""
    widths = [max(row[k].shape[1] for row in pictures) for k in range(len(pictures[0]))]
    heights = [max(picture.shape[0] for picture in row) + (_HEAD if head else 0) for row, head in zip(pictures, heads)]
    head = _HEAD if any(titles) else _GAP // 2
    needed = sum(widths) + _GAP * (len(widths) + 1), sum(heights) + _GAP * (len(heights) - 1) + head + _FOOT
    body, height = max(needed[0], 320), max(needed[1], 260)
    first, spare = _GAP + (body - needed[0]) // 2, (height - needed[1]) // 2  # small pictures are in the middle
    parts = isinstance(scale, Legend)
    lines = label_lines(scale.label, int(_BAR / _LETTER) if parts else int(0.95 * height / _LETTER)) if scale else []
    width = body + (_BAR + _LINE * (0 if parts else len(lines) - 1) if scale else 0)
    # A hundredth of a pixel more, so that round-off takes none away.
    figure = plt.figure(figsize=((width + 0.01) / DPI, (height + 0.01) / DPI), dpi=DPI, facecolor="white")
    top = head + spare
    for row, high, name in zip(pictures, heights, heads):
        left = first
        if name:
            figure.text(0.5 * body / width, 1.0 - (top + 0.5 * _HEAD) / height, name, ha="center", va="center", fontsize=12)
        down = _HEAD if name else 0
        for picture, wide in zip(row, widths):
            tall, broad = picture.shape[:2]
            x, y = left + (wide - broad) // 2, top + down + (high - down - tall) // 2
            figure.figimage(picture, x, height - y - tall, origin="upper")
            left += wide + _GAP
        top += high + _GAP
    left = first
    for title, wide in zip(titles, widths):
        figure.text((left + 0.5 * wide) / width, 1.0 - (spare + 0.55 * _HEAD) / height, title, ha="center", va="center", fontsize=12)
        left += wide + _GAP
    length = round_length(0.35 * widths[0] * per_pixel)
    line = figure.add_axes([_GAP / width, 0.0, body / width, _FOOT / height])
    line.set(xlim=(0, body), ylim=(0, _FOOT))
    line.set_axis_off()
    line.plot([0.0, length / per_pixel], [40, 40], color="black", linewidth=3, solid_capstyle="butt")
    line.text(0.0, 28, length_text(length, units), ha="left", va="top", fontsize=12)
    line.text(body - 2 * _GAP, 28, note, ha="right", va="top", fontsize=12)
    if parts:
        entries = [matplotlib.patches.Patch(color=color, label=name) for name, color in scale.entries()]
        legend = figure.legend(handles=entries, title="\n".join(lines), loc="center left", bbox_to_anchor=(body / width, 0.5), frameon=False, fontsize=12)
        legend.set_title(legend.get_title().get_text(), prop={"size": 12})
    elif scale:
        tall = min(0.8 * height, 420)
        axis = figure.add_axes([(body + 4) / width, 0.5 - 0.5 * tall / height, 18 / width, tall / height])
        colors = matplotlib.cm.ScalarMappable(matplotlib.colors.Normalize(scale.low, scale.high), scale.map)
        bar = figure.colorbar(colors, cax=axis, extend=scale.extend)
        bar.set_label("\n".join(lines), fontsize=12)
        bar.ax.tick_params(labelsize=11)
        bar.formatter.set_powerlimits((-3, 4))
    return figure


def to_pixels(figure):
    """(rows, columns, 3) bytes of a figure."""
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[:, :, :3].copy()
    plt.close(figure)
    return pixels


def _array(name, values):
    """A DataArray: its bytes with their count in front, in base64."""
    values = np.ascontiguousarray(values)
    content = np.uint64(values.nbytes).tobytes() + values.tobytes()
    parts = f" NumberOfComponents=\"{values.shape[1]}\"" if values.ndim == 2 else ""
    return (f"<DataArray type=\"{_TYPES[str(values.dtype)]}\" Name={quoteattr(name)}{parts} format=\"binary\">"
            f"{base64.b64encode(content).decode('ascii')}</DataArray>\n")


def write_points(path, x, columns):
    """A .vtu of the points x (N, 3) with all columns, (N,) each, as arrays: 64 bits, so that no digit is lost; named as ParaView's filters take it,
    c_stress_1 of c_stress[1]."""
    n = len(x)
    whole = {name: name in ("id", "type", "mol") and np.all(values == np.round(values)) for name, values in columns.items()}
    arrays = {name: values.astype(np.int64) if whole[name] else values for name, values in columns.items()}
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    text = [
        f"<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\" header_type=\"UInt64\">\n",
        f"<UnstructuredGrid>\n<Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\">\n<PointData>\n",
        *(_array(re.sub(r"\[(\d+)\]", r"_\1", name), values) for name, values in arrays.items()),
        "</PointData>\n<Points>\n", _array("Points", np.asarray(x, dtype=float)), "</Points>\n<Cells>\n",
        _array("connectivity", np.arange(n, dtype=np.int64)), _array("offsets", np.arange(1, n + 1, dtype=np.int64)),
        _array("types", np.full(n, _VERTEX, dtype=np.uint8)), "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    ]
    with open(path, "w", encoding="utf-8") as target:
        target.writelines(text)


def write_series(path, files):
    """A .pvd; files: (time, name of a .vtu beside it)."""
    rows = "".join(f"<DataSet timestep=\"{time!r}\" file={quoteattr(name)}/>\n" for time, name in files)
    with open(path, "w", encoding="utf-8") as target:
        target.write(f"<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n{rows}</Collection>\n</VTKFile>\n")
