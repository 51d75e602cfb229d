#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Fits the row of a material to its E, 0.2 % yield stress, stresses at further strains and Poisson's ratio; appends it to a potential file.

  calibrate.py --E 70e9 --yield 95e6 --stress 150e6@0.05 --density 2700 --name mine --out mine.evp
  calibrate.py ... --stress 120e6@0.02 --stress 150e6@0.05   two stresses or more: hardening that is no straight line
  calibrate.py --E 70e9 --curve test.csv --true ...          a measured curve instead: columns of strain and stress with units
  calibrate.py ... --nu 0.33                                 Poisson's ratio, by fix evp/volume (kv in the row); 0.3 unless told otherwise
  calibrate.py ... --rate 5e6@100                            and an over-stress of 5 MPa at 100/s, by damping (gamma in the row)
  calibrate.py ... --body bar.data                           for this body instead of a cylinder of 2000 spheres: in it the row meets the targets

A measured curve is one loading from rest on, as a target of curves.py table, nominal unless --true. Where strains repeat or fall, or the stress has
noise, consecutive rows are averaged, and it prints how many points are left and the noise.

SI units. Stresses and strains are nominal (force over the initial cross-section), as in the output of the decks; a true stress s at a
true strain e is s exp(-e) at exp(e) - 1, which --true does for a curve. --yield is the 0.2 % offset yield stress. Negative strains mean
that all stresses are those of compression; give stresses as positive numbers. The over-stress is the mean over plastic flow between about
1.2 and 2.5 times the strain at yield. It is linear in the rate; --rate twice, within a decade, takes a mean.

Packs a specimen and loads it quasi-statically, in at most 8 runs, each after what the one before missed. The nearest row is appended in
any case, with its residuals; the exit status is 3 where one is above 3 %. Also writes FILE.NAME.jsonl, the table of runs, and
FILE.NAME.png with its CSV: targets, fit, residuals. The same command resumes an interrupted calibration; a run that fails is repeated with
smaller increments. Use the row with *plasticity isotropic* and *contact repulsive*, for which it is fitted. LAMMPS is the lmp of this
checkout, or EVP_LMP and EVP_MPIRUN.
"""

import argparse
import datetime
import hashlib
import pathlib
import shlex
import sys
import tempfile

import evp  # noqa: F401  before numpy
from evp import calibration
from evp.calibration import Table, Targets, check, check_file
from evp.report import command_line, errors_in_one_line, positive, print_table, target_file, typed, whole
from evp.run import lammps_command


def parser():
    """The command line."""
    top = command_line(__doc__)
    top.add_argument("--E", type=positive, required=True, help="Young's modulus [Pa]")
    top.add_argument("--yield", dest="yield_stress", type=positive, help="0.2 %% offset yield stress, nominal [Pa]")
    top.add_argument("--stress", type=value_at, action="append", default=[], metavar="STRESS@STRAIN",
                     help="nominal stress [Pa] at a nominal strain beyond yield; negative strain: compression; may be repeated")
    top.add_argument("--curve", type=pathlib.Path, metavar="FILE", help="measured curve, a CSV, instead of --yield and --stress")
    top.add_argument("--true", action="store_true", help="the curve is of true stress and true strain")
    top.add_argument("--nu", type=nu_of, default=0.3, help="Poisson's ratio, 0.25 to 0.42 (default 0.3); none: that of the network, about 1/4")
    top.add_argument("--rate", type=value_at, action="append", default=[], metavar="OVERSTRESS@RATE",
                     help="stress above the rate-independent one [Pa] at a strain rate [1/s]")
    top.add_argument("--density", type=positive, required=True, help="of the solid [kg/m3]")
    top.add_argument("--name", required=True, help="of the row")
    top.add_argument("--out", type=target_file, required=True, metavar="FILE", help="potential file to append to; made where there is none")
    body = top.add_mutually_exclusive_group()
    body.add_argument("--body", type=pathlib.Path, metavar="FILE",
                      help="data file of the body, beside it FILE.body, by in.specimen or body.py; strains are those between 0.3 and 0.7 of its length")
    body.add_argument("--spheres", type=whole(100), default=2000, metavar="N", help="of the cylinder (default 2000)")
    top.add_argument("--seed", type=whole(1), default=1, help="of the cylinder (default 1)")
    top.add_argument("--ranks", type=whole(1), default=2, help="MPI ranks of each run (default 2)")
    top.add_argument("--timeout", type=positive, default=900.0, help="seconds after which a run has failed (default 900)")
    return top


def nu_of(word):
    """Poisson's ratio of the command line, None for none."""
    return None if word == "none" else float(word)


def value_at(word):
    """(value, place) of VALUE@PLACE, the value above 0."""
    value, _, place = word.partition("@")
    if not place:
        raise argparse.ArgumentTypeError(f"give two numbers VALUE@PLACE, got {word}")
    return positive(value), float(place)


def targets_of(options):
    """Targets of the command line; ValueError where they, or choices of the body, have no meaning."""
    if options.body and options.seed != parser().get_default("seed"):
        raise ValueError("--seed is that of the cylinder: leave it out with --body, which is a body that exists")
    if options.body and options.rate:
        raise ValueError("--rate: not with --body, whose middle may be strained at another rate than its grips; "
                         "take gamma of a calibration without --body")
    if bool(options.curve) == bool(options.yield_stress and options.stress) or options.curve and (options.yield_stress or options.stress):
        raise ValueError("give --yield and --stress, or --curve")
    if options.true and not options.curve:
        raise ValueError("--true is about --curve; --yield and --stress are nominal")
    if options.curve:
        first, points = calibration.read_measured(options.curve, options.E, options.true)
        print(f"{options.curve} gives --yield {first:.6g} and {', '.join(f'--stress {stress:.6g}@{strain:g}' for stress, strain in points)}", flush=True)
    else:
        first, points = options.yield_stress, tuple(options.stress)
    targets = Targets(options.E, first, points, options.density, options.nu, tuple(options.rate))
    check(targets)
    return targets


def comments(options, targets, result, over, words):
    """Comment lines above the row."""
    aims = "; ".join(f"{name} {value:.6g} {unit}".rstrip() + f" ({100.0 * result.residuals[name]:+.2f} %)" for name, (value, unit) in targets.aims.items())
    lines = ["", f"# {options.name}: targets, nominal, and what the row gives beside them: {aims}"]
    for stress, rate in targets.rates:
        lines.append(f"#   over-stress {stress:.6g} Pa at {rate:g}/s ({100.0 * (over * rate / stress - 1.0):+.2f} %)")
    lines.append(f"#   DATE: {datetime.date.today().isoformat()}, {result.runs} runs of in.quasistatic, plasticity isotropic, contact repulsive, "
                 + (f"body {options.body.name}" if options.body else f"{options.spheres} spheres, seed {options.seed}") + f", {options.ranks} ranks")
    shown = [pathlib.PurePath(word).name if "/" in word and not word.startswith("-") else word for word in words]  # files without their folders
    return [*lines, f"#   by: calibrate.py {shlex.join(shown)}"]


def calibrate(options, words):
    """Make the row; returns its Result."""
    targets = targets_of(options)
    out = options.out.absolute()
    check_file(out, options.name)
    lammps_command(options.ranks)  # stops here where there is no lmp
    table_path = out.with_name(f"{out.stem}.{options.name}.jsonl")
    inputs = {**targets._asdict(), "spheres": options.spheres, "seed": options.seed, "ranks": options.ranks, "within": calibration.WITHIN}
    if options.body:
        calibration.measure(options.body)  # says what is wrong with it
        files = b"".join(pathlib.Path(f"{options.body}{end}").read_bytes() for end in ("", ".body"))
        inputs = {**inputs, "spheres": None, "seed": None, "body": hashlib.sha256(files).hexdigest()[:16]}
    table = Table(table_path, inputs)
    try:
        if table.runs:
            print(f"going on after {len(table.runs)} runs of {table_path}", flush=True)
        with tempfile.TemporaryDirectory(prefix="evp_calibrate_") as name:
            work = pathlib.Path(name)
            if options.body:
                body = calibration.given_body(options.body, work)
            else:
                body = calibration.make_body(work, options.spheres, options.seed, targets.density, options.timeout)
            search = calibration.Search(targets, body, table, options.ranks, work, options.timeout, lambda text: print(text, flush=True))
            result = search.pull()
            over, material = 0.0, result.material
            if targets.rates:
                gamma, over = search.gamma(result)
                material = material._replace(row=material.row._replace(gamma=gamma))
        line = f"{options.name} {material.words(f'{body.spacing:.6g}', f'{body.coordination:.6g}')} density {targets.density:.6g}"
        picture = calibration.draw(options.name, targets, result, out.with_name(f"{out.stem}.{options.name}.png"))
        check_file(out, options.name)
        calibration.append(out, comments(options, targets, result, over, words) + [line])
    finally:
        if not table.runs:
            table_path.unlink(missing_ok=True)
        table.close()
    print_table(("", "target", "fit", "", "off"),
                [(name, value, result.found[name], unit, f"{100.0 * result.residuals[name]:+.2f} %") for name, (value, unit) in targets.aims.items()])
    print(f"{line}\nappended to {options.out}; runs in {table_path.name}, picture {picture.name}")
    if result.worst > calibration.MISS:
        print(f"{typed('calibrate.py')}: a target is missed by {100.0 * result.worst:.1f} %. "
              f"The row is the nearest of {result.runs} runs", file=sys.stderr)
    return result


def main(words=None):
    """0; 3 where a target is missed by more than 3 %; 130 when interrupted. Ends with a message and 1 where there is no row."""
    words = list(sys.argv[1:] if words is None else words)
    options = parser().parse_args(words)
    with errors_in_one_line("calibrate.py", "; finished runs are kept, the same command goes on"):
        result = calibrate(options, words)
    return 3 if result.worst > calibration.MISS else 0


if __name__ == "__main__":
    sys.exit(main())
