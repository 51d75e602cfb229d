#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Makes the row of a metal from its E, Poisson's ratio and flow curve, tests it in tension, compression and shear, and appends it to a potential file.

  calibrate.py --E 73e9 --nu 0.33 --johnson-cook 265e6 426e6 0.34 --density 2770 --name al2024 --out my.evp
  calibrate.py --E 69e9 --plastic table.csv ...              a table as in finite elements: plastic_strain, true_stress_MPa
  calibrate.py --E 70e9 --curve test.csv [--true] ...        a measured curve: columns of strain and stress with units
  calibrate.py --E 70e9 --yield 95e6 --stress 120e6@0.02 --stress 150e6@0.05 ...
  calibrate.py ... --rate 5e6@100                            and an over-stress of 5 MPa at 100/s, by damping (gamma in the row)
  calibrate.py ... --damage "0.13 0.13 -1.5" --rupture "energy 14000"           keywords of ductile failure; tested on bars with waists
  calibrate.py ... --heat "conductivity 121 capacity 875 soften 298 775 1"    keywords for fix evp/heat; with --johnson-cook A B n C m: soften 298 775
  calibrate.py ... --heat ... --check 500K               pulls the row at this temperature, too
  calibrate.py ... --like potentials/metals.evp:copper_OFHC      for a first look: scales that row, without a run, within a second

Flow curves are rate-independent, at the reference temperature; without units Pa. Johnson-Cook: A + B p^n of the plastic strain p; C and m are those
of rate RATE0 and of soften TREF TMELT in --heat. A table begins at plastic strain 0, is
straight between its rows and goes on with its last slope; so does a curve, from its largest nominal stress on. A measured curve is one loading from
rest on, nominal unless --true; where strains repeat or fall, or the stress has noise, consecutive rows are averaged, and it prints how many
points are left and the noise. --yield is the 0.2 % offset yield stress, --stress a stress at a strain beyond it, both nominal; negative strains
are compression, stresses are positive numbers.

Packs a body that is periodic on all sides, and measures its moduli for at most 6 rows, each after what the one before missed. The flow curve is
in the row as it is: its spheres flow at it (the keyword yield). The row is then pulled to a true strain of 0.22, pressed to 0.62 and sheared to 3, or as far as the curve is
known; it is appended in any case, with its residuals. The exit status is 3 where E is off by more than 2 %, Poisson's ratio by 3 %, the yield stress by
8 %, the stress by 5 % in tension and compression or 6 % in shear. Also writes FILE.NAME.png with its CSV: flow curve, the ways of the row, residuals. Use the row
with *plasticity isotropic*, *contact join* and fix evp/volume row. LAMMPS is the lmp of this checkout, or EVP_LMP and EVP_MPIRUN.
"""

import argparse
import datetime
import math
import pathlib
import shlex
import sys
import tempfile

import evp  # noqa: F401  before numpy
from evp import calibration, flow, measured, rupture
from evp.calibration import Targets, check, check_file
from evp.rates import given_row
from evp.report import command_line, errors_in_one_line, positive, print_table, target_file, typed, whole
from evp.run import lammps_command

BAR_SPHERES = 3000  # of bars that are pulled to rupture
HEAT = {"conductivity": (1, 1), "capacity": (1, 1), "soften": (2, 4), "melt": (1, 1), "rate": (1, 2), "expansion": (2, 2)}  # keywords: fewest and most numbers
PAGES = {"doc/Howto_evp_heat.rst": [*HEAT], "doc/Howto_evp_metal.rst": ["damage", "rupture"]}  # of keywords that a row may lack
# What --like was measured to miss, of each row of metals.evp by each other
LIKE = "E within 1.5 %, Poisson's ratio within 1.5 %; with the same E stresses are those of a row that was run"


def parser():
    """The command line."""
    top = command_line(__doc__)
    top.add_argument("--E", type=positive, required=True, help="Young's modulus [Pa]")
    top.add_argument("--johnson-cook", type=float, nargs="+", metavar="A B N [C M]", help="flow curve A + B p^N [Pa]")
    top.add_argument("--plastic", type=pathlib.Path, metavar="FILE", help="flow curve, a CSV with columns of plastic strain and true stress")
    top.add_argument("--curve", type=pathlib.Path, metavar="FILE", help="measured curve, a CSV with columns of strain and stress")
    top.add_argument("--true", action="store_true", help="the measured curve is of true stress and true strain")
    top.add_argument("--yield", dest="yield_stress", type=positive, help="0.2 %% offset yield stress, nominal [Pa]")
    top.add_argument("--stress", type=value_at, action="append", default=[], metavar="STRESS@STRAIN",
                     help="nominal stress [Pa] at a nominal strain beyond yield; negative strain: compression; may be repeated")
    top.add_argument("--nu", type=nu_of, default=0.3, help="Poisson's ratio, 0.25 to 0.42 (default 0.3); none: that of the network, about 1/4")
    top.add_argument("--rate", type=value_at, action="append", default=[], metavar="OVERSTRESS@RATE",
                     help="stress above the rate-independent one [Pa] at a strain rate [1/s]")
    top.add_argument("--heat", type=heat_of, default={}, metavar="KEYWORDS",
                     help="keywords of the row for fix evp/heat: conductivity K capacity CP [soften TREF TMELT [M [FLOOR]]] [melt L] [rate [C] RATE0] [expansion ALPHA TREF]")
    top.add_argument("--damage", type=damage_of, default=(), metavar="D1 D2 D3 [D4 D5]", help="of Johnson and Cook's failure, as one word: D3 is not positive, D4 needs rate, D5 soften")
    top.add_argument("--rupture", type=rupture_of, metavar="UF", help="opening at which a sphere that fails has parted [m], or 'energy GF' [J/m2]; with --damage")
    top.add_argument("--check", type=temperature_of, action="append", default=[], metavar="T",
                     help="temperature, such as 500K, at which the row is pulled to a true strain of 0.05 and compared with its flow curve times the factor of soften; "
                     "may be repeated")
    top.add_argument("--like", metavar="FILE:ROW", help="take this row of another metal, scale it to E and nu, give it the flow curve, and run nothing; for a first look")
    top.add_argument("--density", type=positive, required=True, help="of the solid [kg/m3]")
    top.add_argument("--name", required=True, help="of the row")
    top.add_argument("--out", type=target_file, required=True, metavar="FILE", help="potential file to append to; made where there is none")
    top.add_argument("--spheres", type=whole(100), default=calibration.SPHERES, metavar="N", help=f"of the body (default {calibration.SPHERES})")
    top.add_argument("--seed", type=whole(1), default=1, help="of the body (default 1)")
    top.add_argument("--ranks", type=whole(1), default=2, help="runs at once, one MPI rank each (default 2)")
    return top


def nu_of(word):
    """Poisson's ratio of the command line, None for none."""
    return None if word == "none" else float(word)


def temperature_of(word):
    """[K] of --check."""
    if not word.endswith("K"):
        raise argparse.ArgumentTypeError(f"give a temperature such as 500K, got {word}")
    return positive(word[:-1])


def heat_of(text):
    """{keyword: numbers} of --heat."""
    found, words = {}, text.split()
    keys = [k for k, word in enumerate(words) if word[0].isalpha()]
    for k, end in zip(keys, [*keys[1:], len(words)]):
        if words[k] in found:
            raise argparse.ArgumentTypeError(f"{words[k]} is given twice, got {text}")
        found[words[k]] = [float(word) for word in words[k + 1 : end]]
        least, most = HEAT.get(words[k], (0, 0))
        if not least <= len(found[words[k]]) <= most or most == 0:
            raise argparse.ArgumentTypeError(f"expected some of conductivity K capacity CP soften TREF TMELT M [FLOOR] melt L rate C RATE0 expansion ALPHA TREF, got {text}")
        if min(found[words[k]]) < 0.0 or (0.0 in found[words[k]] and words[k] != "soften"):
            raise argparse.ArgumentTypeError(f"the numbers of {words[k]} must be positive, got {text}")
    if keys[:1] != [0]:
        raise argparse.ArgumentTypeError(f"begins with a keyword, got {text}")
    return found


def damage_of(text):
    """The five numbers of --damage."""
    found = [float(word) for word in text.split()]
    found += [0.0] * (5 - len(found) if len(found) == 3 else 0)
    if len(found) != 5 or not all(map(math.isfinite, found)) or min(found[0], found[1], found[4]) < 0.0:
        raise argparse.ArgumentTypeError(f"expected D1 D2 D3 or D1 D2 D3 D4 D5, all but D3 and D4 at least 0, got {text}")
    if found[2] > 0.0:
        raise argparse.ArgumentTypeError(f"D3 is negative where a metal is less ductile under tension: some codes have the other sign, got {text}")
    return tuple(found)


def rupture_of(text):
    """The words of --rupture."""
    key, _, number = text.partition(" ")
    try:
        value = float(number if key == "energy" else text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < math.inf or (key == "energy" and value == 0.0):
        raise argparse.ArgumentTypeError(f"expected an opening UF, at least 0, or energy GF, above 0, got {text}")
    return text


def failure_words(options, heat):
    """The keywords of the row for ductile failure; ValueError where they do not fit together. heat: those for fix evp/heat."""
    if bool(options.damage) != bool(options.rupture):
        raise ValueError("--damage and --rupture go together: at which strain spheres begin to fail, and how they go on")
    if not options.damage:
        return ""
    for k, key in ((3, " rate "), (4, " soften ")):
        if options.damage[k] > 0.0 and key not in heat:
            raise ValueError(f"D{k + 1} of --damage needs{key}in --heat")
    return f" damage {' '.join(f'{value:.6g}' for value in options.damage)} rupture {options.rupture}"


def heat_values(options):
    """{keyword: numbers} of the row for fix evp/heat; ValueError where Johnson-Cook's m and soften do not fit together, or --check has no soften."""
    heat, more = {**options.heat}, options.johnson_cook[3:] if options.johnson_cook else []
    if len(more) == 2:
        if len(heat.get("soften", ())) != 2:
            raise ValueError("--johnson-cook with C and m needs --heat with 'soften TREF TMELT', which takes m as its exponent")
        heat["soften"] = [*heat["soften"], more[1]]
        if len(heat.get("rate", ())) == 1:
            heat["rate"] = [more[0], *heat["rate"]]
    if len(heat.get("soften", (0, 0, 0))) < 3:
        raise ValueError("soften of --heat needs TREF TMELT M: the exponent is given by --johnson-cook A B n C m, or there")
    if "melt" in heat and "soften" not in heat:
        raise ValueError("melt of --heat needs soften TREF TMELT M, which says where it melts")
    if len(heat.get("rate", (0, 0))) < 2:
        raise ValueError("rate of --heat needs C RATE0: C is given by --johnson-cook A B n C m, or there")
    if options.check and "soften" not in heat:
        raise ValueError("--check needs soften TREF TMELT M in --heat, by which the metal softens: doc/Howto_evp_heat.rst has those of metals")
    for temperature in options.check:
        if not heat["soften"][0] <= temperature < heat["soften"][1]:
            raise ValueError(f"--check {temperature:g}K: give a temperature from TREF of soften, {heat['soften'][0]:g}, to below TMELT, {heat['soften'][1]:g}")
    return heat


def heat_words(options):
    """As the row has them."""
    heat = heat_values(options)
    return "".join(f" {name} {' '.join(f'{value:.6g}' for value in heat[name])}" for name in HEAT if name in heat)  # soften in front of melt


def lacking(row):
    """What a row does not have, and the page that has it, as a line; '' where it has all."""
    missing = [(page, [key for key in keys if f" {key} " not in row]) for page, keys in PAGES.items()]
    return "; ".join(f"{' '.join(keys)}: {page}" for page, keys in missing if keys)


def continued(curve):
    """Where a flow curve that is known to a small strain goes on, as a line; '' of another one."""
    if curve.end >= 1.0:
        return ""
    return f"beyond a plastic strain of {curve.end:.3g} the flow curve goes on with its last slope: {1e-6 * float(curve.at(flow.FAR)):.4g} MPa at {flow.FAR:g}"


def value_at(word):
    """(value, place) of VALUE@PLACE, the value above 0."""
    value, _, place = word.partition("@")
    if not place:
        raise argparse.ArgumentTypeError(f"give two numbers VALUE@PLACE, got {word}")
    return positive(value), float(place)


def curve_of(options):
    """The FlowCurve of the command line; ValueError where it gives none, or two."""
    given = {"--johnson-cook": options.johnson_cook, "--plastic": options.plastic, "--curve": options.curve,
             "--yield and --stress": options.yield_stress or options.stress}
    if len([name for name, value in given.items() if value]) != 1 or bool(options.yield_stress) != bool(options.stress):
        raise ValueError(f"give one flow curve: {', or '.join(given)}")
    if options.johnson_cook and len(options.johnson_cook) not in (3, 5):
        raise ValueError(f"--johnson-cook takes A B n, or A B n C m, got {len(options.johnson_cook)} numbers")
    if options.true and not options.curve:
        raise ValueError("--true is about --curve; --plastic and --johnson-cook are true stresses, --yield and --stress are nominal")
    if options.plastic:
        return measured.read_table(options.plastic)
    if options.curve:
        return measured.read_measured(options.curve, options.E, options.true)
    return flow.johnson_cook(*options.johnson_cook[:3]) if options.johnson_cook else flow.through(options.E, options.yield_stress, options.stress)


def targets_of(options):
    """Targets of the command line; ValueError where they have no meaning."""
    targets = Targets(options.E, curve_of(options), options.density, options.nu, tuple(options.rate))
    check(targets)
    return targets


def comments(options, targets, result, over, bars, words):
    """Comment lines above the row. bars: {waist: Parted, or None}."""
    lines = ["", f"# {options.name}: row over target - 1"] + [f"#   {way}: {calibration.told(off)}" for way, off in result.residuals.items()]
    for stress, rate in targets.rates:
        lines.append(f"#   over-stress {stress:.6g} Pa at {rate:g}/s ({100.0 * (over * rate / stress - 1.0):+.2f} %)")
    if bars:
        lines.append(f"#   rupture: {ruptures(options, bars)}")
    lines.append(f"#   DATE: {datetime.date.today().isoformat()}, in.moduli, in.uniaxial and in.shear, plasticity isotropic, contact join, periodic body of {options.spheres} spheres, "
                 f"seed {options.seed}")
    return [*lines, f"#   by: calibrate.py {shown(words)}"]


def ruptures(options, bars):
    """What bars say of Johnson and Cook's formula."""
    ratios = {waist: f"{found.strain / rupture.strain_at_failure(options.damage, found.triaxiality):.2f}" if found else f"not parted at {100 * rupture.WAISTS[waist]:g} %"
              for waist, found in bars.items()}
    return "plastic strain of the section over that of the formula: " + ", ".join(f"{ratio} with a waist of {1e3 * waist:g} mm" for waist, ratio in ratios.items())


def like(options, words):
    """Append a row that another one is scaled to, without a run."""
    if options.rate or options.check:
        raise ValueError("--like runs nothing: leave out --rate and --check")
    targets, more = targets_of(options), heat_words(options)
    more += failure_words(options, more)
    check_file(options.out, options.name)
    path, _, name = options.like.rpartition(":")
    row, keys = given_row(options.like)
    material = calibration.scaled(row, keys, *calibration.elastic_of(pathlib.Path(path).read_text(encoding="utf-8"), name), targets)
    line = f"{options.name} {material.words(*(f'{keys[key]:.6g}' for key in ('spacing', 'coordination')))}{more}"
    calibration.append(options.out.absolute(), ["", f"# {options.name}: scaled from {name}, not run; {LIKE}", f"#   by: calibrate.py {shown(words)}", line])
    print(f"{line}\nappended to {options.out}; scaled from {name}, not run: {LIKE}. For a row to rely on leave out --like")
    if continued(targets.curve):
        print(continued(targets.curve))


def shown(words):
    """The command line, files without their folders."""
    return shlex.join(pathlib.PurePath(word).name if "/" in word and not word.startswith("-") else word for word in words)


def calibrate(options, words):
    """Make the row; returns its Result."""
    targets, heat = targets_of(options), heat_words(options)
    failure = failure_words(options, heat)
    out = options.out.absolute()
    check_file(out, options.name)
    lammps_command()  # stops here where there is no lmp
    with tempfile.TemporaryDirectory(prefix="evp_calibrate_") as name:
        work = pathlib.Path(name)
        body = calibration.make_body(work, options.spheres, options.seed, targets.density)
        search = calibration.Search(targets, body, options.ranks, work, lambda text: print(text, flush=True))
        result = search.result()
        over, material = 0.0, result.material
        if targets.rates:
            gamma, over = search.gamma(result)
            material = material._replace(row=material.row._replace(gamma=gamma))
        row = f"{material.words(f'{body.spacing:.6g}', f'{body.coordination:.6g}')}{heat}{failure}"
        for temperature in options.check:
            hot, run = calibration.at_temperature(f"{result.material.words(f'{body.spacing:.15g}', f'{body.coordination:.15g}')}{heat}", heat_values(options), targets, temperature, body, work)
            way = f"tension at {temperature:g} K"
            result.residuals[way] = {what: value for what, value in hot.residuals(result.moduli, {"tension": run})["tension"].items() if value == value}
            print(f"{way}: {calibration.told(result.residuals[way])}", flush=True)
        line, bars = f"{options.name} {row}", {}
        if failure:
            try:
                bars = rupture.pull_bars(row, work, options.ranks, BAR_SPHERES)
            except KeyboardInterrupt:
                print("interrupted: the row is kept, without a test of its rupture", file=sys.stderr)
        picture = calibration.draw(options.name, targets, result, out.with_name(f"{out.stem}.{options.name}.png"))
        check_file(out, options.name)
        calibration.append(out, comments(options, targets, result, over, bars, words) + [line])
    elastic = {"E": (targets.modulus, result.moduli.young), "nu": (targets.nu, result.moduli.nu)}
    print_table(("", "target", "fit", "off"), [(what, *elastic[what], f"{100.0 * value:+.1f} %") for what, value in result.residuals["elastic"].items()])
    ways = list(result.runs)
    whats = sorted({what for way in ways for what in result.residuals[way]}, key=lambda what: 0.0 if isinstance(what, str) else what)
    print_table(("off the flow curve", *ways), [
        (calibration.name_of(what), *(f"{100.0 * result.residuals[way][what]:+.1f} %" if what in result.residuals[way] else "-" for way in ways)) for what in whats])
    if bars:
        print(f"rupture: {ruptures(options, bars)}")
    print(f"{line}\nappended to {options.out}; picture {options.out.with_name(picture.name)}")
    for told in (continued(targets.curve), f"not in the row: {lacking(row)}" if lacking(row) else ""):
        if told:
            print(told)
    if result.misses():
        print(f"{typed('calibrate.py')}: missed: {'; '.join(f'{way} {calibration.told(off)}' for way, off in result.misses().items())}", file=sys.stderr)
    return result


def main(words=None):
    """0; 3 where a target is missed; 130 when interrupted. Ends with a message and 1 where there is no row."""
    words = list(sys.argv[1:] if words is None else words)
    options = parser().parse_args(words)
    with errors_in_one_line("calibrate.py"):
        if options.like:
            like(options, words)
            return 0
        result = calibrate(options, words)
    return 3 if result.misses() else 0


if __name__ == "__main__":
    sys.exit(main())
