# SPDX-License-Identifier: GPL-2.0-only
"""Bodies and elastic runs of decks that are kept in a folder, for pages that compare many: what is there is not made again."""

from . import figures
from .run import DECKS, deck_command, output_of


def slope(folder, name, x, y):
    """dy/dx at the start of a curve of three rows, the second at half the way."""
    curve = figures.read_columns(folder / f"{name}.csv", (x, y))
    secant = curve[y][1:3] / curve[x][1:3]
    return 2.0 * secant[0] - secant[1]


def run(folder, deck, out, data, **choices):
    """Makes out.csv by a deck where the folder does not hold it."""
    if not (folder / f"{out}.csv").exists():
        output_of(deck_command(DECKS / deck, {"specimen": data, "out": f"new_{out}", **choices}), folder, out)
        (folder / f"new_{out}.csv").replace(folder / f"{out}.csv")


def pack(folder, name, spheres, seed, choices):
    """The data file of a body, made where the folder does not hold it."""
    data = f"{name}.data"
    if not (folder / f"{data}.body").exists():
        output_of(deck_command(DECKS / "in.specimen", {"n": spheres, "seed": seed, "out": data, **choices}), folder, f"packing of {name}")
    return data
