#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Young's modulus of one row on bodies with different numbers of spheres, sizes and shapes.

    doc/studies/any_body.py [--row potentials/gado2017.evp:table1_any] [--spheres 500 2000 8000] [--work FOLDER] [--fresh] [--out doc/any_body.md]

in.specimen packs the bodies, tools/body.py the dog bone; in.quasistatic measures Young's modulus within the elastic range. Runs that
--work has already are not repeated. Uses the lmp of this checkout, or EVP_LMP.
"""

import pathlib
import shutil
import sys
from typing import NamedTuple
from study import CHECKOUT, add_out, command_line, errors_in_one_line, output_of, pack, run, slope, table, watched, write_page


STRAIN = 2e-4
AT_REST = {"contact": "none", "tolerance": 1e-5}
FEWEST = 2000  # spheres from which on a departure is judged: below, walls take too much of the body
BONE = CHECKOUT / "tests" / "data" / "parts" / "dog_bone.stl"


class Kind(NamedTuple):
    """A shape: its name, choices of in.specimen as pairs (None: the dog bone), the departure that is allowed."""

    name: str
    choices: tuple
    within: float


CYLINDER = Kind("cylinder 0.05 x 0.02 m", (), 0.03)
KINDS = (
    CYLINDER,
    Kind("cylinder 0.08 x 0.015 m", (("length", 0.08), ("radius", 0.015)), 0.06),
    Kind("cylinder 5 x 2 mm", (("length", 0.005), ("radius", 0.002)), 0.03),
    Kind("block 50 x 10 x 10 mm", (("shape", "block"), ("length", 0.05), ("width", 0.01), ("height", 0.01)), 0.06),
    Kind("dog bone, STL", None, 0.06),
)


def packed(folder, kind, spheres):
    """The data file of a body, made where the folder does not hold it."""
    name = f"{KINDS.index(kind)}_{spheres}"
    if kind.choices is not None:
        return pack(folder, name, spheres, 1, dict(kind.choices))
    data = f"{name}.data"
    if not (folder / f"{data}.body").exists():
        output_of([sys.executable, str(CHECKOUT / "tools" / "body.py"), str(BONE), "--axis", "z", "--n", str(spheres), "--out", data],
                  folder, f"packing of {name}")
    return data


def young(folder, kind, spheres, row):
    """Young's modulus [Pa]: of the dog bone over the strain between two layers, as its ends hardly strain."""
    data = packed(folder, kind, spheres)
    strain = "strain" if kind.choices is not None else "strain_gauge"
    out = f"{pathlib.Path(data).stem}_{row.rpartition(':')[2]}"
    run(folder, "in.quasistatic", out, data, **AT_REST, material=row, strain=STRAIN, increment=STRAIN / 2, restart=0, extensometer="yes")
    return slope(folder, out, strain, "stress_virial")


HEAD = """# One row for any body

One row of coefficients gives nearly the same Young's modulus on bodies with other numbers of spheres, sizes and shapes: from {fewest} spheres on the largest
difference from the cylinder of {most} spheres is {worst:.1f} %; {verdict}

A row with *spacing* and *coordination* scales with the body, see [pair_style evp/lj](pair_evp_lj.rst). The remaining difference is that of the
solid fraction, which is lower at walls and with few spheres. The row does not contain it.

Young's modulus [GPa] of the row `{row}`, and its difference from that of the cylinder of {most} spheres:

"""

TAIL = """
Written by `{command}`. Random packings of seed 1; in.quasistatic, contact none, tangent at zero strain, stress by the virial. The dog bone is
tests/data/parts/dog_bone.stl packed by tools/body.py; its strain is that of the extensometer. *Limit*: the difference that is accepted.
"""


def page(found, row, command):
    """Text of the page, of {(Kind, spheres): Young's modulus}."""
    most = max(spheres for kind, spheres in found if kind is CYLINDER)
    reference = found[CYLINDER, most]
    sizes = sorted({spheres for _, spheres in found})
    off = {case: value / reference - 1.0 for case, value in found.items()}
    judged = {case: abs(share) for case, share in off.items() if case[1] >= FEWEST or FEWEST > most}
    rows = [[kind.name, f"{100 * kind.within:.0f} %",
             *(f"{found[kind, n] / 1e9:.2f} ({100 * off[kind, n]:+.1f} %)" for n in sizes)] for kind in KINDS]
    missed = [f"{kind.name} with {spheres} spheres" for (kind, spheres), share in judged.items() if share > kind.within]
    verdict = "all are within their limits." if not missed else f"beyond their limits: {', '.join(missed)}."
    head = HEAD.format(row=row, most=most, verdict=verdict, worst=100 * max(judged.values()), fewest=min(spheres for _, spheres in judged))
    return head + "\n".join(table(["body", "limit", *(f"N = {n}" for n in sizes)], rows)) + "\n" + TAIL.format(command=command)


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--row", default="potentials/gado2017.evp:table1_any", help="FILE:ROW with spacing and coordination (default: %(default)s)")
    parser.add_argument("--spheres", type=int, nargs="+", default=[500, 2000, 8000], help="numbers of spheres (default 500 2000 8000)")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "any_body", help="bodies and runs (default: %(default)s)")
    parser.add_argument("--fresh", action="store_true", help="delete --work first: repeat everything")
    add_out(parser, "any_body.md")
    options = parser.parse_args(words)
    if min(options.spheres) < 500:
        parser.error("--spheres must be at least 500")
    file, _, name = options.row.rpartition(":")
    if not file or not name:
        parser.error(f"--row must be FILE:ROW, got '{options.row}'")
    if options.fresh:
        shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True, exist_ok=True)
    path = pathlib.Path(file) if pathlib.Path(file).exists() else CHECKOUT / file
    found = {}
    with errors_in_one_line("any_body.py"):
        plan = [(kind, spheres) for spheres in sorted(set(options.spheres)) for kind in KINDS]
        for kind, spheres in watched("any_body.py:", plan, lambda case: f"{case[0].name}, {case[1]} spheres", lambda case: case[1] ** (4.0 / 3.0)):
            found[kind, spheres] = young(options.work, kind, spheres, f"{path.resolve()}:{name}")
        command = f"doc/studies/any_body.py --row {options.row} --spheres {' '.join(map(str, sorted(set(options.spheres))))}"
        write_page(options.out, page(found, options.row, command))


if __name__ == "__main__":
    sys.exit(main())
