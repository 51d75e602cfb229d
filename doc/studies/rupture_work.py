#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Work of rupture against the spacing of the spheres, with `break XI`; writes the table of the Howto.

    doc/studies/rupture_work.py [--xi 0.05] [--seeds 2] [--work FOLDER] [--fresh] [--out doc/Howto_evp.rst]

in.traction pulls cylinders of the same size with increasing numbers of spheres to rupture, with constant XI and with XI ~ 1/spacing.
Writes the table between the two marks of --out. Runs that --work has already are not repeated. Uses the lmp of this checkout, or EVP_LMP.
"""

import pathlib
import re
import statistics
import sys
from typing import NamedTuple

from study import CHECKOUT, DECKS, RunError, add_out, command_line, deck_command, errors_in_one_line, output_of, split_at_marks, watched
import numpy as np
from evp import curves

SPHERES = (500, 1000, 2000, 4000)
FREE_LENGTH = 0.04  # between the grips [m]
PARTED = 0.1  # of the largest stress: below it the body has parted
START, END = ".. rupture work: this table is written by doc/studies/rupture_work.py\n", ".. end of rupture work\n"
PULL = {"coeff": "80 8 4 3 8 4 0.005 100 1.5", "contact": "repulsive", "plasticity": "isotropic", "rate": 100, "strain": 0.15, "row": 0.0005,
        "samples": 5, "dtfraction": 0.8}


class Found(NamedTuple):
    """Of a pull: largest stress [MPa], work of the grips up to it and beyond per cross-section [kJ/m2], bonds that broke."""

    peak: float
    before: float
    after: float
    broken: int


def read_pull(folder, name):
    """The Found of a pull whose curve and number of broken bonds stand in a folder. RunError where it has not parted."""
    curve = curves.read_curve(folder / f"{name}.csv")
    top = int(np.argmax(curve.grip))
    gone = np.nonzero(curve.grip[top:] < PARTED * curve.grip[top])[0]
    if len(gone) == 0:
        raise RunError(f"{name} has not parted at a strain of {curve.strain[-1]:g}: {curve.grip[-1]:.3g} Pa of {curve.grip[top]:.3g} Pa are left")
    work = np.append(0.0, np.cumsum(0.5 * (curve.grip[1:] + curve.grip[:-1]) * np.diff(curve.strain))) * FREE_LENGTH / 1e3
    broken = int((folder / f"{name}.broken").read_text(encoding="utf-8"))
    return Found(curve.grip[top] / 1e6, work[top], work[top + gone[0]] - work[top], broken)


def pull(spheres, seed, xi, folder):
    """The Found of a body; the run is made where the folder does not hold it."""
    data, name = f"specimen_{spheres}_{seed}.data", f"pull_{spheres}_{seed}_{xi:.4g}"
    if not (folder / f"{name}.broken").exists():
        if not (folder / data).exists():
            output_of(deck_command(DECKS / "in.specimen", {"n": spheres, "seed": seed, "out": data}), folder, f"packing of {spheres}")
        text = output_of(deck_command(DECKS / "in.traction", {**PULL, "specimen": data, "break": f"{xi:.6g}", "out": name}), folder, name)
        (folder / f"{name}.broken").write_text(re.search(r"bonds broken: (\d+)", text).group(1), encoding="utf-8")
    return read_pull(folder, name)


def scaled(xi, spheres):
    """XI that keeps XI times the spacing: what a crack opens by until its bonds break."""
    return xi * (spheres / SPHERES[0]) ** (1.0 / 3.0)


def list_table(header, rows):
    """Lines of a table in reStructuredText."""
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for cells in (header, *rows):
        lines += [f"   {'*' if k == 0 else ' '} - {cell}" for k, cell in enumerate(cells)]
    return lines + [""]


def number(values, form):
    """Mean, and the largest departure of a body from it."""
    mean = statistics.mean(values)
    return f"{mean:{form}} +- {max(abs(value - mean) for value in values):{form}}"


def table_rows(results):
    """Of {(spheres, xi): [Found of each seed]}."""
    for (spheres, xi), found in results.items():
        total = [one.before + one.after for one in found]
        yield [str(spheres), f"{xi:.3g}", number([one.peak for one in found], ".0f"), *(number(values, ".0f") for values in (
            [one.before for one in found], [one.after for one in found], total)), number([one.broken for one in found], ".0f")]


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--xi", type=float, default=0.05, help="XI of the bodies of 500 spheres (default 0.05)")
    parser.add_argument("--seeds", type=int, default=2, help="bodies of each size (default 2)")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "rupture_work", help="specimens and runs (default: %(default)s)")
    parser.add_argument("--fresh", action="store_true", help="repeat the runs that --work has already")
    add_out(parser, "Howto_evp.rst")
    options = parser.parse_args(words)
    if options.xi <= 0.0 or options.seeds < 1:
        parser.error("--xi must be positive and --seeds at least 1")
    options.work.mkdir(parents=True, exist_ok=True)
    if options.fresh:
        for old in options.work.glob("*.broken"):
            old.unlink()
    results = {}
    with errors_in_one_line("rupture_work.py"):
        head, _, tail = split_at_marks(options.out, START, END)
        plan = [(spheres, xi, seed) for choose in (lambda n: options.xi, lambda n: scaled(options.xi, n)) for spheres in SPHERES
                for xi in [choose(spheres)] for seed in range(1, options.seeds + 1)]
        plan = list(dict.fromkeys(plan))  # at 500 spheres both are the same
        for spheres, xi, seed in watched("rupture_work.py:", plan, lambda run: f"{run[0]} spheres, XI {run[1]:.3g}, seed {run[2]}",
                                         lambda run: run[0] ** (4.0 / 3.0)):
            results.setdefault((spheres, xi), []).append(pull(spheres, seed, xi, options.work))
        header = ("spheres", "XI", "largest stress [MPa]", "work up to it [kJ/m2]", "work beyond it [kJ/m2]", "all work [kJ/m2]", "bonds broken")
        lines = list_table(header, table_rows(results))
        options.out.write_text(head + START + "\n" + "\n".join(lines) + "\n" + END + tail, encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    sys.exit(main())
