# SPDX-License-Identifier: GPL-2.0-only
"""What the studies share. They import it first: it makes the package evp of tools/ importable, and takes them to a Python with numpy.

Bodies and elastic runs are kept in a folder: what is there is not made again.
"""

import pathlib
import sys

sys.path.insert(1, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))

from evp import figures  # noqa: E402
from evp.progress import format_seconds, in_turn, watched  # noqa: E402
from evp.report import add_out, command_line, errors_in_one_line, ratios, split_at_marks, spread, table, write_csv, write_page  # noqa: E402
from evp.run import CHECKOUT, DECKS, RunError, deck_command, environment, lammps_command, lammps_error, output_of  # noqa: E402

__all__ = ("CHECKOUT", "DECKS", "RunError", "add_out", "command_line", "deck_command", "environment", "errors_in_one_line", "format_seconds", "in_turn",
           "lammps_command", "lammps_error", "output_of", "ratios", "split_at_marks", "spread", "table", "watched", "write_csv", "write_page")


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
