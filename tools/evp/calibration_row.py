# SPDX-License-Identifier: GPL-2.0-only
"""A calibrated row as text, and its way into a potential file: whole or not at all."""

import fcntl
import os
import pathlib

from .whole import write_whole

HEAD = """# UNITS: si CONTRIBUTOR: tools/calibrate.py, which appends the rows
# NAME e1 m1 n1 e2 m2 n2 xi_s gamma alpha, then spacing [m] and coordination of the body that it was found on, kv [J], density of the solid [kg/m3]
"""


def rounded(value):
    """The value as the row holds it: six digits."""
    return float(f"{value:.6g}")


def row_line(name, row, spacing, coordination, kv, density):
    """One line of a potential file; row: law.Row."""
    numbers = " ".join(f"{value:.6g}" for value in row)
    volume = f" kv {kv:.6g}" if kv > 0.0 else ""
    return f"{name} {numbers} spacing {spacing:.6g} coordination {coordination:.6g}{volume} density {density:.6g}"


def append(path, lines):
    """Append lines to a potential file, which is made where there is none. The file is replaced in one move; others who append wait."""
    path = pathlib.Path(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        _append(path, lines)
    finally:
        os.close(folder)


def _append(path, lines):
    text = path.read_text(encoding="utf-8") if path.exists() else HEAD
    if not text.endswith("\n"):
        text += "\n"
    write_whole(path, text + "\n".join(lines) + "\n")
