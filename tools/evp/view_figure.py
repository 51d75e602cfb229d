# SPDX-License-Identifier: GPL-2.0-only
"""Puts pictures of spheres beside each other, with titles, one color bar and one scale bar; and a row of such pictures into a film."""

import re
import subprocess
import textwrap

import matplotlib
import numpy as np
from matplotlib import animation
from PIL import Image

from . import spheres
from .figures import EngFormatter, plt

DPI = 100
_GAP = 24  # [pixels] between pictures
_BAR = 120  # of the color bar with its text, one line
_LINE = 20  # of each further line of this text
_LETTER = 8  # of a letter there, on average
_FOOT = 64  # of the scale bar with its text
_HEAD = 34  # of a title
OUTER = 0.5  # percent of the values
FILMS = {".gif": "", ".mp4": "h264", ".mkv": "h264", ".webm": "vp9"}  # kinds and their codecs
PLAIN = "#9fb4c8"  # spheres that no column colors


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


def time_text(seconds, longest=None):
    """'37.1 \u00b5s', in the unit that suits the longest time of a series (default: this one)."""
    largest = min(abs(seconds) if longest is None else longest, 999.0)
    power = max(-9, 3 * int(np.floor(np.log10(largest) / 3.0 + 1e-9))) if largest > 0.0 else 0
    return f"{10.0**-power * seconds:.3g} {EngFormatter.ENG_PREFIXES[power]}s"


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
    lines = label_lines(scale.label, int(0.95 * height / _LETTER)) if scale else []
    width = body + (_BAR + _LINE * (len(lines) - 1) if scale else 0)
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
    if scale:
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


def check_film(path):
    """ValueError where a film of this name cannot be written here."""
    kind = path.suffix.lower()
    if kind not in FILMS:
        raise ValueError(f"--film {path}: the name of a film ends in {', '.join(FILMS)}")
    if kind != ".gif" and not animation.FFMpegWriter.isAvailable():
        raise ValueError(f"--film {path}: a film of this kind needs the program ffmpeg, which is not here; a name that ends in .gif does not")


def write_film(frames, path, rate):
    """A film of pictures of one size. ValueError with what ffmpeg says where that fails."""
    if path.suffix.lower() == ".gif":
        first, *others = (Image.fromarray(frame).quantize() for frame in frames)
        first.save(path, save_all=True, append_images=others, duration=round(1000 / rate), loop=0)
        return
    height, width = frames[0].shape[:2]
    figure = plt.figure(figsize=((width + 0.01) / DPI, (height + 0.01) / DPI), dpi=DPI)
    shown = figure.figimage(frames[0])
    writer = animation.FFMpegWriter(fps=rate, codec=FILMS[path.suffix.lower()], extra_args=["-pix_fmt", "yuv420p"])
    try:
        with writer.saving(figure, str(path), DPI):
            for frame in frames:
                shown.set_data(frame)
                writer.grab_frame()
    except subprocess.CalledProcessError as error:
        raise ValueError(f"ffmpeg failed: {' '.join(f'{error.output} {error.stderr}'.split())}") from error
    finally:
        plt.close(figure)
