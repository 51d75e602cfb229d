# SPDX-License-Identifier: GPL-2.0-only
"""The table of releases.sh: compares the curves, prints the table and writes it as Markdown."""

import datetime
import pathlib
import platform
import sys

import tools_path  # noqa: F401  before evp
import numpy as np
from study import table

# The CSV has nine digits: a difference of one unit of the last is up to 1e-8 of a value.
TOLERANCE = 1e-8
HEADER = ("LAMMPS", "compiler", "integers", "build", "unit", "pair tester", "LAMMPS tests", "curve", "seconds", "result")


def difference(curve, reference):
    """Largest difference of two CSV curves, column by column over the largest value of the column; infinite if one is missing."""
    tables = [np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2) for path in (curve, reference) if path.is_file()]
    if len(tables) < 2 or tables[0].shape != tables[1].shape or not tables[0].size:
        return np.inf
    return float(np.max(np.abs(tables[0] - tables[1]) / np.maximum(np.abs(tables[1]).max(axis=0), 1e-300)))


def main(work, checksum, document):
    """Of the rows of the same sources, the plain 4Feb2025 first if it is there: the others' curves are compared with it."""
    rows = [path.read_text(encoding="utf-8").strip().split("|") for path in (pathlib.Path(work) / "rows").iterdir()]
    rows = sorted((row for row in rows if row[0] == checksum), key=lambda row: (row[10] != "4Feb2025-g++-smallbig-Release", row[10]))
    if not rows:
        print("no case was run to its end")
        return 1
    curves = [pathlib.Path(work) / row[10] / "curve.csv" for row in rows]
    off = [difference(curve, curves[0]) for curve in curves]
    passed = [row[9] == "0" and apart <= TOLERANCE for row, apart in zip(rows, off)]
    lines = "\n".join(table(HEADER, [(*row[1:8], f"{apart:.1e}", row[8], "passed" if good else "FAILED") for row, apart, good in zip(rows, off, passed)]))
    print(lines)
    system = " ".join(platform.freedesktop_os_release().get(key, "") for key in ("NAME", "VERSION_ID"))
    pathlib.Path(document).write_text(f"""# Releases, compilers and integer sizes that the plugin was tested with

For those with another LAMMPS or compiler.

Written by `tests/maintain/releases.sh` on {datetime.date.today().isoformat()} ({system}, {platform.machine()}); sources {checksum}
(first digits of the SHA-256 of `CMakeLists.txt cmake/*.* src/*/*.* src/*/*/*.*`). Run it again after a change.

{lines}

Test columns: passed / failed. `unit`: GoogleTest on the pure headers. `pair tester`: LAMMPS' own `test_pair_style` on our
scenes and the check of its numbers; `-` where it cannot be compiled. `LAMMPS tests`:
`all` of `tests/lammps`, or `short`, the tests of forces, records, ghost velocities, timestep, bad input and memory. `curve`: largest difference of the
traction curve (`in.traction`, 500 spheres, strain 0.01 at 50/s, one rank) from that of the first row, over the largest
value of the column; at most {TOLERANCE:g}, one unit of the last of the nine digits of the CSV file. A row has
passed if nothing failed and `packaging/check_install.sh` found its numbers too. Compiler and build type are the plugin's; LAMMPS
itself is built with the system's MPI compiler, Release.
""", encoding="utf-8")
    print(f"written to {document}")
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
