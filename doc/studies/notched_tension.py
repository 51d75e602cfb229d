#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Rupture of a notched bar against the spacing of the spheres, and the XI of `break XI` that keeps the work of rupture.

    doc/studies/notched_tension.py [--spheres 4000 16000] [--xi 0.05] [--seeds 2] [--work FOLDER] [--fresh] [--out doc/notched_tension.md]

in.traction pulls the bar of lammps_inputs/regions/notched.lmp to rupture, with increasing numbers of spheres: with constant XI, with
XI proportional to 1/spacing, and with the power of the spacing in between that keeps the work of rupture from the first size to the
second. Writes the page, figures/NAME.png and its CSV. Runs that --work has already are not repeated. Uses the lmp of this checkout,
or EVP_LMP.
"""

import math
import pathlib
import re
import statistics
import sys
from typing import NamedTuple

from study import CHECKOUT, DECKS, add_out, command_line, deck_command, errors_in_one_line, output_of, table, watched
import numpy as np
from evp import curves, figures
from rupture_work import PARTED, number, read_pull

BAR = {"shape": "region", "region": DECKS / "regions" / "notched.lmp", "width": 0.022, "height": 0.012}
PULL = {"coeff": "80 8 4 3 8 4 0.005 20 1.5 spacing 0.00585189 coordination 11.9", "contact": "repulsive", "plasticity": "isotropic", "rate": 100,
        "strain": 0.02, "row": 0.00025, "samples": 5, "dtfraction": 0.8}
VOLUME = 9.814e-6  # [m3] of the bar
NOTCH = 1.0  # radius of the end of a notch [mm]


class Found(NamedTuple):
    """Of a pull: largest stress [MPa], strain at it, strain of rupture, work of the grips per net cross-section [kJ/m2], bonds that broke."""

    peak: float
    at: float
    rupture: float
    work: float
    broken: int


class Case(NamedTuple):
    """Pulls of several bodies: spheres, XI, and why this XI."""

    spheres: int
    xi: float
    rule: str


def spacing(spheres):
    """Of the bar [mm]: edge of the cube that a sphere has of the volume."""
    return 1e3 * (VOLUME / spheres) ** (1.0 / 3.0)


def read_rupture(folder, name):
    """The Found of a tension test. RunError where the bar has not ruptured."""
    whole, curve = read_pull(folder, name), curves.read_curve(folder / f"{name}.csv")
    top = int(np.argmax(curve.grip))
    parted = top + int(np.argmax(curve.grip[top:] < PARTED * curve.grip[top]))
    return Found(whole.peak, curve.strain[top], curve.strain[parted], whole.before + whole.after, whole.broken)


def names(spheres, seed, xi):
    """Of the data file and of the pull."""
    return f"notched_{spheres}_{seed}.data", f"pull_{spheres}_{seed}_{xi:.4g}"


def pull(spheres, seed, xi, folder):
    """The Found of a bar; the run is made where the folder does not hold it."""
    data, name = names(spheres, seed, xi)
    if not (folder / f"{name}.broken").exists():
        if not (folder / f"{data}.body").exists():
            output_of(deck_command(DECKS / "in.specimen", {**BAR, "n": spheres, "seed": seed, "out": data}), folder, f"packing of {spheres}")
        text = output_of(deck_command(DECKS / "in.traction", {**PULL, "specimen": data, "break": f"{xi:.6g}", "out": name}), folder, name)
        (folder / f"{name}.broken").write_text(re.search(r"bonds broken: (\d+)", text).group(1), encoding="utf-8")
    return read_rupture(folder, name)


def mean_work(found):
    return statistics.mean(one.work for one in found)


def kept_xi(work, one, other):
    """XI of that work, where the work is a power of XI through two (XI, work)."""
    grown = math.log(other[1] / one[1]) / math.log(other[0] / one[0])
    return one[0] * (work / one[1]) ** (1.0 / grown)


def works_of(results, bars=slice(None)):
    """{spheres: [(XI, work) of each of its cases]}, over some of the bars."""
    works = {}
    for case, found in results.items():
        works.setdefault(case.spheres, []).append((case.xi, mean_work(found[bars])))
    return works


def exponent_of(results, spheres, bars=slice(None)):
    """p of XI ~ spacing^-p that keeps the work of the fewest spheres, from the next size."""
    few, more = spheres[:2]
    works = works_of({case: found for case, found in results.items() if case.spheres in (few, more)}, bars)
    xi, work = works[few][0]
    return math.log(kept_xi(work, *works[more][:2]) / xi) / math.log(spacing(few) / spacing(more))


def measured(cases, seeds, folder):
    """{Case: [Found of each seed]}; seeds: {spheres: number of bars}."""
    plan, results = [(case, seed) for case in cases for seed in range(1, seeds[case.spheres] + 1)], {}
    for case, seed in watched("notched_tension.py:", plan, lambda run: f"{run[0].spheres} spheres, XI {run[0].xi:.3g}, seed {run[1]}",
                              lambda run: run[0].spheres ** (5.0 / 3.0)):
        results.setdefault(case, []).append(pull(case.spheres, seed, case.xi, folder))
    return results


def study(spheres, xi, seeds, folder):
    """The results, and the exponent_of() them."""
    few, more = spheres[:2]
    first = [Case(n, xi, "constant XI") for n in spheres] + [Case(more, xi * spacing(few) / spacing(more), "XI ~ 1/spacing")]
    results = measured(first, seeds, folder)
    p = exponent_of(results, spheres)
    kept = [Case(n, xi * (spacing(few) / spacing(n)) ** p, "power of the spacing") for n in spheres[1:]]
    results.update(measured(kept, seeds, folder))
    return results, p


def first_curves(results, folder):
    """{label: (strain [%], stress [MPa])} of the first bar of each case."""
    lines = {}
    for case in results:
        curve = curves.read_curve(folder / f"{names(case.spheres, 1, case.xi)[1]}.csv")
        lines[f"N = {case.spheres}, XI = {case.xi:.3g}"] = 100 * curve.strain, curve.grip / 1e6
    return lines


def draw(lines, path):
    """Stress against strain, by first_curves()."""
    with figures.plt.rc_context(figures.LOOK):
        figure, axis = figures.plt.subplots(figsize=(7.2, 4.6))
        rows = []
        for k, (label, (strain, stress)) in enumerate(lines.items()):
            axis.plot(strain, stress, label=label, **figures.line_style(k))
            rows += [(label, f"{a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress)]
        axis.set(xlabel="nominal strain [%]", ylabel="nominal stress, net section [MPa]", xlim=(0, None))
        figures.legend_below(axis, 2, handlelength=3.0)
        return figures.save(figure, path, ("curve", "strain_percent", "stress_MPa"), rows)


HEADER = ("spheres", "specimens", "spacing [mm]", "XI", "rule", "largest stress [MPa]", "strain at it [%]", "rupture strain [%]", "work of rupture [kJ/m2]",
          "bonds broken")


def number_of(values, form):
    """Mean, and of several bars the largest departure of one."""
    return number(values, form) if len(values) > 1 else f"{values[0]:{form}}"


def rows(results):
    """Of the table."""
    for case, found in results.items():
        yield [case.spheres, len(found), f"{spacing(case.spheres):.2f}", f"{case.xi:.3g}", case.rule, number_of([one.peak for one in found], ".0f"),
               *(number_of([100 * value for value in values], ".2f") for values in ([one.at for one in found], [one.rupture for one in found])),
               number_of([one.work for one in found], ".1f"), number_of([one.broken for one in found], ".0f")]


PAGE = """# Notched bar in tension to rupture

{answer}

Recommendations:

- Choose the number of spheres first. Then choose XI so that the measured work of rupture, or the measured opening at rupture, of one test is met,
  and keep both.
- If the spacing changes afterwards, calibrate XI again: run the test with two values of XI and interpolate the work, as this tool does.
  XI times (old spacing / new spacing)^{p:.2f} is a first guess{scatter}. The exponent holds for this bar and for
  spacings near the radius of the notch; it is smaller where the spacing resolves the notch.
- Do not take XI ~ 1/spacing, and do not refine only near a notch: with one XI bonds break first where the spacing is smallest.
- Stress and strain up to the largest stress depend less on the spacing than those beyond.

![stress against strain](figures/{stem}.png)

Written by `{command}`: a bar of 50 x 20 x 10 mm with two notches, 5 mm deep, their ends round with a radius of {notch:g} mm
(`lammps_inputs/regions/notched.lmp`), Table 1 scaled with the spacing, gamma 20, *plasticity isotropic*, *contact repulsive*, *break XI*, in.traction at
{rate}/s. Stress and work are per net cross-section, 10 x 10 mm. Rupture: the stress on the grips falls below a tenth
of its largest value. The table has means, +- the largest difference of one specimen.

{table}

*Constant XI*: the same for every spacing. *XI ~ 1/spacing*: a crack in one layer of spheres opens by the same length. *Power of the
spacing*: XI ~ spacing^-{p:.2f}, interpolated from the first two at {more} spheres; the works of its rows are measured, not fitted.

Commands for the first specimen:

    build/lmp -in lammps_inputs/in.specimen -var n 4000 -var shape region -var region lammps_inputs/regions/notched.lmp \\
              -var width 0.022 -var height 0.012 -var out notched.data
    build/lmp -in lammps_inputs/in.traction -var specimen notched.data -var coeff "{coeff}" \\
              -var contact repulsive -var plasticity isotropic -var break {xi:g} -var extensometer yes -var rate {rate} -var row 0.00025 -var out notched
"""


def answer(results, p, spheres):
    """The first lines of the page."""
    one = {case.spheres: found for case, found in results.items() if case.rule == "constant XI"}
    power = {case.spheres: found for case, found in results.items() if case.rule == "power of the spacing"}
    scaled = next(found for case, found in results.items() if case.rule == "XI ~ 1/spacing")
    works, few = works_of(results), spheres[0]
    xi = [works[few][0][0]] + [kept_xi(works[few][0][1], *works[n][:2]) for n in spheres[1:]]

    def listed(values, form):
        return ", ".join(f"{value:{form}}" for value in values)

    strains = listed((100.0 * statistics.mean(bar.rupture for bar in one[n]) for n in spheres), ".2f")
    return "\n".join((
        f"With constant XI the work of rupture depends on the spacing of the spheres: {listed((mean_work(one[n]) for n in spheres), '.1f')} kJ/m2 with"
        f" {listed(spheres, 'd')} spheres (spacings of {listed(map(spacing, spheres), '.2f')} mm,",
        f"notch radius {NOTCH:g} mm), and the rupture strain {strains} %. With XI ~ 1/spacing the work is {mean_work(scaled):.1f} kJ/m2 at {spheres[1]} spheres.",
        f"XI = {listed(xi, '.3g')} keep the work of {few} spheres. From the first size to the second that is XI ~ spacing^-{p:.2f}, which gives"
        f" {listed((mean_work(power[n]) for n in spheres[1:]), '.1f')} kJ/m2 at {listed(spheres[1:], 'd')} spheres."))


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--spheres", type=int, nargs="+", default=[4000, 16000], help="at least two numbers of spheres, increasing (default: 4000 16000)")
    parser.add_argument("--xi", type=float, default=0.05, help="XI of the smallest number of spheres (default 0.05)")
    parser.add_argument("--seeds", type=int, nargs="+", default=[2], help="packings of each size: one number for all sizes, or one each (default 2)")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "notched_tension", help="bars and runs (default: %(default)s)")
    parser.add_argument("--fresh", action="store_true", help="repeat the runs that --work has already")
    add_out(parser, "notched_tension.md")
    options = parser.parse_args(words)
    spheres = options.spheres
    if options.xi <= 0.0 or min(options.seeds) < 1:
        parser.error("--xi must be positive and --seeds at least 1")
    if len(options.seeds) not in (1, len(spheres)):
        parser.error("--seeds must be one number, or one for each of --spheres")
    if len(spheres) < 2 or sorted(set(spheres)) != spheres:
        parser.error("--spheres must be at least two numbers, increasing")
    options.work.mkdir(parents=True, exist_ok=True)
    if options.fresh:
        for old in options.work.glob("*.broken"):
            old.unlink()
    with errors_in_one_line("notched_tension.py"):
        seeds = options.seeds if len(options.seeds) > 1 else options.seeds * len(spheres)
        results, p = study(spheres, options.xi, dict(zip(spheres, seeds)), options.work)
        stem = options.out.stem
        picture = draw(first_curves(results, options.work), options.out.parent / "figures" / f"{stem}.png")
        alone = [exponent_of(results, spheres, slice(k, k + 1)) for k in range(min(seeds[:2]))]
        scatter = f" (exponents from single bars: {min(alone):.2f} to {max(alone):.2f})" if len(alone) > 1 else ""
        command = f"doc/studies/notched_tension.py --spheres {' '.join(map(str, spheres))} --seeds {' '.join(map(str, options.seeds))}"
        text = PAGE.format(command=command, answer=answer(results, p, spheres), p=p, scatter=scatter, notch=NOTCH,
                           rate=PULL["rate"], stem=stem, table="\n".join(table(HEADER, rows(results))), more=spheres[1], coeff=PULL["coeff"], xi=options.xi)
        options.out.write_text(text, encoding="utf-8")
    print(text)
    print(picture)


if __name__ == "__main__":
    sys.exit(main())
