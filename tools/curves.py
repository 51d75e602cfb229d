#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Moduli, stresses and figures from the output of the decks.

  curves.py numbers  results/a.csv results/b.csv [--fit 0 0.002]
  curves.py plot     results/a.csv results/b.csv --labels 1/s 10/s --out curves.png
  curves.py cycle    results/a.csv results/b.csv [--out unloading.png]
  curves.py table    results/*.csv [--at 0.002,0.01] [--target metal.csv] [--csv table.csv]
  curves.py columns  taylor.csv --x time --y force
  curves.py law      --coeff "80 8 4 3 8 4 0.005 0 1.5" --measured two_spheres.csv --out law.png
  curves.py rate     damped.csv --twin undamped.csv --rate 10 --specimen specimen.data --coeff "80 8 4 3 8 4 0.005 1000 1.5"

Curves are PREFIX.csv of in.traction, or of your own deck (columns strain,stress_grip,stress_virial; Pa). With every PNG a CSV of its
data is written (A.png.csv with A.png).
PREFIX.csv of in.torsion (shear strain and stress of the surface; the modulus is G), in.bending (outer fibre) and in.shear are
curves, too. For a curve that unloads, `numbers` uses the part before the first reversal.
`numbers` fits E to the elastic part and prints the range: from strain 0 to 0.003, or to 3/4 of the
longest range in which the slope over the second half is at least 90 % of that over the first, where
this ends before strain 0.004. `--fit LO HI` gives another range.
`cycle` evaluates curves that unload, as of in.cyclic: strain and stress at the first reversal, residual strain
at zero stress, of what sprang back the elastic part, stress over unloading modulus, and the rest; slope over the first 0.004 of
unloading (less where the body flows back before), and area of the last loop.
`table` prints one line per curve, also in compression or with unloading: E, yield stress and stresses of the first loading, residual
strain, unloading modulus, the area of each loop; '-' where a curve has no such number. Stresses are
fitted over +-0.0006 of strain, or interpolated where the rows are farther apart. A target has rows strain,stress in Pa, or a line above that
names its columns, of strain and stress with their units (strain_percent,stress_MPa; Strain [%];Stress / MPa) and any others, apart by commas,
semicolons, tabs or blanks; decimal commas where commas are not between the columns. The differences of the first loading from it are taken
at its rows, with the same fit of both where the target has three rows in this range.
"""

import math
import pathlib

from evp import curves, figures, law, measured, rates, specimen
import numpy as np
from evp.report import command_line, errors_in_one_line, positive, print_table, typed, write_csv

PARTED, SOFTENED = 0.1, 0.9  # of the largest stress that is left
ELASTIC_END = 0.004  # strain at which the first pairs of Table 1 come to the second regime
TITLES = {  # {E}: what the modulus is called
    "E_GPa": "{E} [GPa]",
    "range": "over strain",
    "yield_MPa": "0.2 % yield [MPa]",
    "stress_1pc_MPa": "stress at 1 % [MPa]",
    "stress_2pc_MPa": "at 1.95 % [MPa]",
    "departure_strain": "tangent < 0.9 {E} at",
    "turn_strain": "turn at strain",
    "turn_MPa": "stress there [MPa]",
    "residual_strain": "residual strain",
    "elastic_strain": "elastic part",
    "rest_strain": "the rest",
    "unloading_GPa": "unloading modulus [GPa]",
    "area_MJ_per_m3": "last loop area [MJ/m3]",
    "areas": "loop areas [MJ/m3]",
}
NUMBERS = ("E_GPa", "range", "yield_MPa", "stress_1pc_MPa", "stress_2pc_MPa", "departure_strain")
CYCLE = ("turn_strain", "turn_MPa", "residual_strain", "elastic_strain", "rest_strain", "unloading_GPa", "area_MJ_per_m3")
WHY_NONE = {  # notes where there is no such number
    "residual_strain": "the way back ends before zero stress; -var lower release of in.cyclic and in.quasistatic goes there",
    "unloading_GPa": "the way back has too few rows",
    "area_MJ_per_m3": "the stress of the surface is not that of the whole section",
}


def check_not_read(what, path, read):
    """ValueError where a file to write is one of those that are read."""
    if pathlib.Path(path).resolve() in [pathlib.Path(other).resolve() for other in read]:
        raise ValueError(f"{what} {path} would be written over a file that is read: give another name")


def check_picture(path, read):
    """ValueError where a picture is none, or it or its CSV is one of the files that are read."""
    for file in (path, f"{path}.csv"):
        check_not_read("--out", file, read)
    if pathlib.Path(path).suffix.lower() != ".png":
        raise ValueError(f"--out {path}: the name of a picture ends in .png")


def tell(path, found=None):
    """Notes on a curve without E, on a line of E that does not begin at zero, and on another load than tension. found: of table_numbers()."""
    load, found = curves.load_of(path), found or {}
    if found.get("why_no_E"):
        print(f"NOTE: {path} has no {load.modulus}: {found['why_no_E']}")
    if found.get("jump_share", 0.0) > curves.JUMP_SHARE:
        print(f"NOTE: {path}: the line that E is the slope of has {found['jump_MPa']:.4g} MPa at "
              "strain 0. Unless strong damping did it, the elastic part ends before the first rows")
    if load != curves.TENSION:
        print(f"NOTE: {path} is of {load.deck}: {load.strain}, {load.stress}; its modulus is {load.modulus}")


def modulus_of(paths):
    """What the modulus of these curves is called: E, G, or 'E or G' of several loads."""
    return " or ".join(sorted({curves.load_of(path).modulus for path in paths}))


def labels_of(words, paths):
    """Of the curves of a picture: `words`, or short names of their files where none are given. ValueError where they do not tell the curves apart."""
    if words and (len(words) != len(paths) or len(set(words)) != len(words)):
        raise ValueError(f"--labels must give {len(paths)} words, one per curve, and no two the same")
    return words or figures.short_names(paths)


def one_load(paths, strain):
    """The load of all curves of a picture over a column of strain; ValueError where they have several."""
    first, load = paths[0], curves.load_of(paths[0])
    for path in paths[1:]:
        other = curves.load_of(path)
        if other != load:
            raise ValueError(f"{first} is of {load.deck} and {path} of {other.deck}: their axes are not the same; draw each load apart")
    return load if strain == "strain" else load._replace(strain="nominal strain of the extensometer")


def evaluated(args, numbers):
    """({path: (curve, turns)}, {path: numbers(curve, turns)}); the turns are those of the grips, as the strain of an extensometer jitters."""
    low, high = getattr(args, "fit", None) or (0.0, 1.0)
    if not 0.0 <= low < high < math.inf:
        raise ValueError(f"the range of E must be 0 <= low < high, got {low:g} {high:g}")
    read = {}
    for path in dict.fromkeys(args.curves):
        curve = curves.read_curve(path, args.strain)
        read[path] = curve, curves.turns((curve if args.strain == "strain" else curves.read_curve(path)).strain)
    found = {path: curves.named(path, numbers, curve, turns) for path, (curve, turns) in read.items()}
    for path, line in found.items():
        if curves.load_of(path).deck in ("in.torsion", "in.bending"):  # stress and strain of the surface
            line.update({name: curves.NAN for name in line if name.startswith("area_")})
    return read, found


def print_numbers(found, names, digits=5):
    """The table of these numbers; found: {path: {name: number}}."""
    modulus = modulus_of(found)
    titles = [TITLES[name].format(E=modulus) if name in TITLES else f"at {name.split('_')[2]} [MPa]" for name in names]
    for line in found.values():
        line["range"] = "-" if line.get("why_no_E", "-") else f"{line['E_from']:g}..{line['E_to']:.3g}"
    print_table(["", *titles], [[path, *(line[name] for name in names)] for path, line in found.items()], digits)


def show_numbers(args):
    """Print one line of numbers for each curve."""
    read, found = evaluated(args, lambda curve, turns: curves.table_numbers(curve, args.fit, (), turns))
    path, line = next(iter(found.items()))
    if all(one["why_no_E"] for one in found.values()):
        raise curves.CurveError(f"{path}: {line['why_no_E']}")
    print_numbers(found, NUMBERS)
    for path, (curve, turns) in read.items():
        if len(turns):
            print(f"NOTE: {path} turns back at strain {curve.strain[turns[0]]:g}: the numbers above are those of the way there. "
                  f"{typed('curves.py')} cycle and {typed('curves.py')} table give those of the way back, too")
        peak = int(curve.virial.argmax())
        gone = peak + np.flatnonzero(curve.virial[peak:] < PARTED * curve.virial[peak])
        if not len(turns) and curve.virial[-1] < SOFTENED * curve.virial[peak]:
            print(f"{path}: largest stress {1e-6 * curve.virial[peak]:.5g} MPa at strain {curve.strain[peak]:.4g}, "
                  + (f"a tenth of it is left at strain {curve.strain[gone[0]]:.4g}" if len(gone) else f"{1e-6 * curve.virial[-1]:.5g} MPa at the end"))
        tell(path, found[path])


def show_cycles(args):
    """Print one line of numbers for each curve that turns back, and draw them where a picture is asked for."""
    paths = list(dict.fromkeys(args.curves))
    if args.out:
        check_picture(args.out, paths)
        load, labels = one_load(paths, args.strain), labels_of(args.labels, paths)
    read, found = evaluated(args, lambda curve, turns: curves.cycle_numbers(curve, turns))
    print_numbers(found, CYCLE, digits=4)
    for path, line in found.items():
        for name, why in WHY_NONE.items():
            if line[name] != line[name]:
                print(f"NOTE: {path} has no {TITLES[name].split(' [')[0]}: {why}")
    for path in paths:
        tell(path)
    if args.out:
        drawn, turns = (dict(zip(labels, values)) for values in zip(*read.values()))
        print(figures.unloading(drawn, args.out, load, turns))


def strains(word):
    """Those of a word such as '0.002,0.01'."""
    return [positive(part) for part in word.strip(",").split(",")]


def show_table(args):
    """Print one line for each curve, the departures from a target below, and write a CSV of both."""
    places = list(dict.fromkeys(strain for group in args.at for strain in group)) or curves.STRAINS
    target = measured.read_target(args.target) if args.target else None
    if args.csv:
        check_not_read("--csv", args.csv, [*args.curves, *filter(None, [args.target])])
    read, found = evaluated(args, lambda curve, turns: curves.table_numbers(curve, args.fit, places, turns))
    apart = {path: curves.named(path, curves.departure, curve, target, turns) for path, (curve, turns) in read.items()} if target else {}
    stresses = [f"stress_at_{at:g}_MPa" for at in places]
    areas = list(dict.fromkeys(name for line in found.values() for name in line if name.startswith("area_")))
    for line in found.values():
        line["areas"] = " ".join(f"{line[name]:.5g}" for name in areas if line.get(name, curves.NAN) == line.get(name)) or "-"
    print_numbers(found, ["E_GPa", "range", "yield_MPa", *stresses, "turn_strain", "residual_strain", "unloading_GPa", "areas"])
    if target:
        print(f"\ndeparture from {args.target}, curve minus target, at its rows")
        print_table(["", *curves.DEPARTURE.values()],
                    [[path, *list(line.values())[:-1], f"{line['departure_rows']} of {len(target[0])}"] for path, line in apart.items()])
    if args.csv:
        modulus = modulus_of(args.curves).replace(" ", "_")
        names = ["E_GPa", "E_from", "E_to", "yield_MPa", *stresses, "turn_strain", "turn_MPa", "residual_strain", "unloading_GPa", *areas,
                 *(curves.DEPARTURE if target else ())]
        lines = {path: {**line, **apart.get(path, {})} for path, line in found.items()}
        write_csv(args.csv, ["curve", *(modulus + name[1:] if name.startswith("E_") else name for name in names)],
                  [[path, *(f"{line[name]:.9g}" if name in line and line[name] == line[name] else "" for name in names)] for path, line in lines.items()])
    for path, line in found.items():
        tell(path, line)


def plot_columns(args):
    """One column over another, a curve for each file."""
    check_picture(args.out, args.files)
    read = {path: curves.read_columns(path, (args.x, args.y)) for path in args.files}
    print(figures.two_columns(dict(zip(figures.short_names(read), read.values())), args.x, args.y, args.out, args.title))


def plot_curves(args):
    """Draw all curves into one picture."""
    check_picture(args.out, args.curves)
    load, labels = one_load(args.curves, args.strain), labels_of(args.labels, args.curves)
    read = [curves.read_curve(path, args.strain) for path in args.curves]
    drawn = list(zip(labels, read))
    title = load.deck.replace("in.", "").capitalize() if args.title is None else args.title
    print(figures.stress_strain({title: drawn}, args.out, load))


def plot_law(args):
    """Draw the force law of one row."""
    check_picture(args.out, [args.measured] if args.measured else [])
    measured = curves.read_columns(args.measured, figures.MEASURED) if args.measured else None
    print(figures.force_law(law.Row.parse(args.coeff), args.out, measured))


def show_rate_shares(args):
    """Print what theory expects, where it is asked for, and a line of shares for each strain."""
    if len({value is None for value in (args.specimen, args.rate, args.coeff)}) > 1:
        raise ValueError("--rate, --specimen and --coeff are given together, or none of them")
    damped, twin = curves.read_curve(args.damped), curves.read_curve(args.twin)
    if damped.strain[-1] < 0.0:
        raise ValueError(f"{args.damped} is of compression: shares of a rate are those of tension")
    rates.check_twin(damped, twin)
    places = args.strains or rates.reached(damped)
    if not places:
        raise ValueError(f"{args.damped} ends at strain {damped.strain.max():g}: give --strains")
    found = [rates.shares_at(damped, twin, at) for at in places]
    if args.specimen:
        body, size = specimen.read_data(args.specimen), specimen.read_body(args.specimen)
        row, density = rates.run_row(args.coeff, body, size["volume"])
        modulus = curves.modulus(twin.strain, twin.virial)
        tau, viscous, inertial = rates.expected(body, row, density, args.rate, modulus, size["length"])
        print(f"expected at {args.rate:g}/s with E {1e-9 * modulus:.2f} GPa of the twin and tau {tau:.4g} s: E tau rate {1e-6 * viscous:.3f} MPa "
              f"viscous in the elastic part; inertia below rho c L rate {1e-6 * inertial:.3f} MPa")
    for s in found:
        print(f"strain {100 * s.strain:.2f} %: stress {1e-6 * s.stress:.2f} MPa, viscous {100 * s.viscous / s.stress:.2f} %, inertial {100 * s.inertial / s.stress:.2f} % "
              f"({1e-6 * s.viscous:.3f} +- {1e-6 * s.resolution:.3f} MPa, {1e-6 * s.inertial:.3f} MPa)")
    if max(places) > ELASTIC_END:
        print("+- is the vibration of the twin; beyond the elastic part the pairs that only one of the runs lost or met count as viscous too, "
              "see doc/Howto_evp_paper.rst")


def parser():
    """The command line."""
    top = command_line(__doc__)
    commands = top.add_subparsers(dest="command", required=True)

    def command(name, action, text, out=None):
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(action=action)
        if out:
            sub.add_argument("--out", default=out, metavar="PNG")
        return sub

    def curve_command(name, action, text, out=None, fit=False):
        sub = command(name, action, text, out)
        sub.add_argument("curves", nargs="+", metavar="CSV")
        sub.add_argument("--strain", choices=("strain", "strain_gauge"), default="strain", help="of the grips, or between layers at 0.3 and 0.7 of the length")
        if fit:
            sub.add_argument("--fit", nargs=2, type=float, metavar=("LO", "HI"), help="range of strain that E is fitted to (default: the elastic part)")
        return sub

    curve_command("numbers", show_numbers, "E, yield, stress at 1 and 2 percent, where it bends", fit=True)
    sub = curve_command("cycle", show_cycles, "residual strain, unloading modulus and loop area")
    sub.add_argument("--out", metavar="PNG", help="a picture of the curves")
    sub.add_argument("--labels", nargs="+", help="of the curves in the picture, one each (default: the files' names)")
    sub = curve_command("table", show_table, "all of these for any number of curves, and how far they are from a target", fit=True)
    sub.add_argument("--at", nargs="+", type=strains, default=[], metavar="STRAIN",
                     help="strains that the stress is given at, with commas or blanks (default: 0.002,0.01)")
    sub.add_argument("--target", metavar="FILE", help="rows strain,stress to compare with")
    sub.add_argument("--csv", metavar="FILE", help="the table as a file")
    sub = curve_command("plot", plot_curves, "stress-strain curves", "curves.png")
    sub.add_argument("--labels", nargs="+", help="one per curve (default: the files' names, with as many folders as tell them apart)")
    sub.add_argument("--title", help="(default: the load)")
    sub = command("columns", plot_columns, "one column of CSV files over another", "columns.png")
    sub.add_argument("files", nargs="+", metavar="CSV")
    sub.add_argument("--x", required=True, metavar="NAME", help="column, such as time")
    sub.add_argument("--y", required=True, metavar="NAME", help="column, such as force")
    sub.add_argument("--title", default="")
    sub = command("law", plot_law, "force against distance of one pair (the paper's figure 2)", "force_law.png")
    sub.add_argument("--coeff", default="80 8 4 3 8 4 0.005 0 1.5", help="e1 m1 n1 e2 m2 n2 xi_s gamma alpha (default: Table 1)")
    sub.add_argument("--measured", metavar="CSV", help="PREFIX.csv of in.two_spheres")
    sub = command("rate", show_rate_shares, "viscous and inertial share of a damped run's stress")
    sub.add_argument("damped", metavar="CSV")
    sub.add_argument("--twin", required=True, metavar="CSV", help="the same run at the same rate with gamma = 0")
    sub.add_argument("--strains", nargs="+", type=float, metavar="STRAIN", help="(default: 0.002 0.005 0.01 0.0195, as far as the damped run goes)")
    sub.add_argument("--rate", type=float, help="of both runs [1/s], for what theory expects: E tau rate and rho c L rate")
    sub.add_argument("--specimen", metavar="FILE", help="data file that both runs read, beside it FILE.body, likewise")
    sub.add_argument("--coeff", metavar="ROW", help="row of the damped run, as given to the deck: nine numbers with their keywords, or FILE:ROW")
    return top


def main(argv=None):
    """Run one command; ends with one message on bad input."""
    args = parser().parse_args(argv)
    with errors_in_one_line("curves.py"):
        args.action(args)


if __name__ == "__main__":
    main()
