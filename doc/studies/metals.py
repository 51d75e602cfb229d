#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Calibrates the metals of potentials/metals.evp and writes doc/metals.md: targets, errors, other specimens, curves beside Johnson-Cook's.

  metals.py                     everything; runs that --work has already are not repeated
  metals.py --only steel_4340   calibrates these only; the others must be in --work already

tools/calibrate.py fits each row. The row is then tested with -var material on specimens that it was not fitted to, one of another
seed and one of 4000 spheres, in tension to a strain of 10 % and in compression to 20 %. Writes the page, a CSV of the same name with the
measured values, and figures/NAME.png with its CSV. About 20 minutes on two cores. Uses the lmp of this checkout, or EVP_LMP.
"""

import json
import pathlib
import shutil
import sys
from typing import NamedTuple

from study import CHECKOUT, RunError, add_out, command_line, errors_in_one_line, table, watched, write_csv
import calibrate
import numpy as np
from evp import calibration, figures
from evp.calibration import Targets
from johnson_cook import JohnsonCook, from_handbook
from evp.report import write_whole

MPA = 1e6
SIDES = {"tension": (0.05, 0.1), "compression": (-0.1, -0.2)}  # strains to which departures are told; the last one ends the curve
SPHERES, SEED = 2000, 1  # of the specimens that rows are fitted to
CHECKS = ((2000, 2), (4000, 3))  # spheres and seed of specimens that they were not fitted to
TIMEOUT = 1800.0
BALLISTICS = "Johnson and Cook, 7th Int. Symp. on Ballistics, The Hague, 1983"


PULLED, PUSHED = (0.02, 0.05), (-0.02, -0.05)  # strains of the stresses that rows are fitted to


class Metal(NamedTuple):
    """law: its curve; density [kg/m3]; poisson; strains: of the stresses it is fitted to, negative in compression."""

    title: str
    law: JohnsonCook
    density: float
    poisson: float
    strains: tuple
    source: str


METALS = {
    "aluminium_1100O": Metal(
        "pure aluminium, 1100-O", from_handbook(69e9, 34e6, 90e6), 2710.0, 0.33, PULLED,
        "ASM Handbook vol. 2: 1100-O has a 0.2 % yield stress of 34 MPa, an ultimate stress of 90 MPa; power law through both, necking by Considere"),
    "aluminium_2024T351": Metal("aluminium 2024-T351", JohnsonCook(73e9, 265e6, 426e6, 0.34), 2770.0, 0.33, PULLED, BALLISTICS),
    "copper_OFHC": Metal("OFHC copper", JohnsonCook(124e9, 90e6, 292e6, 0.31), 8960.0, 0.34, PULLED, BALLISTICS),
    "copper_taylor": Metal(
        "copper of the Taylor benchmark", JohnsonCook(117e9, 400e6, 100e6, 1.0), 8930.0, 0.35, PUSHED,
        "The usual benchmark of a copper bar of 32.4 x 6.4 mm at 227 m/s: yield 400 MPa, linear hardening 100 MPa"),
    "steel_4340": Metal("4340 steel", JohnsonCook(205e9, 792e6, 510e6, 0.26), 7830.0, 0.29, PUSHED, BALLISTICS + "; E of handbooks"),
    "titanium_6Al4V": Metal("Ti-6Al-4V", JohnsonCook(114e9, 1098e6, 1092e6, 0.93), 4430.0, 0.33, PUSHED,
                            "Lesuer, DOT/FAA/AR-00/25, 2000; E and Poisson's ratio of handbooks"),
}


def targets_of(metal):
    """Targets of a metal: E, 0.2 % yield and stresses of Johnson-Cook's curve, nominal; Poisson's ratio."""
    first = metal.law.offset_yield(np.sign(metal.strains[0]))
    points = tuple((float(f"{stress:.6g}"), strain) for stress, strain in zip(metal.law.nominal(metal.strains), metal.strains))
    return Targets(metal.law.modulus, float(f"{first:.6g}"), points, metal.density, metal.poisson)


def words_of(aims):
    """Of the command that asks for them."""
    words = ["--E", f"{aims.modulus:g}", "--yield", f"{aims.yield_stress:g}"]
    return words + [word for stress, strain in aims.points for word in ("--stress", f"{stress:g}@{strain:g}")] + ["--nu", f"{aims.nu:g}"]


def calibrated(name, metal, options):
    """Path of the potential file with the row of the metal alone, and of its run table; made where --work does not hold them."""
    out, runs_of = options.work / f"{name}.evp", options.work / f"{name}.jsonl"
    if out.exists():
        return out, runs_of
    if options.only and name not in options.only:
        raise RunError(f"{options.work} has no row of {name}: run without --only")
    aims = targets_of(metal)
    words = [*words_of(aims), "--density", f"{aims.density:g}", "--name", name, "--out", str(out), "--spheres", str(options.spheres), "--seed", str(SEED),
             "--ranks", str(options.ranks), "--table", str(runs_of), "--timeout", f"{TIMEOUT:g}", "--source", f"{metal.title}: {metal.source}"]
    if calibrate.main(words) not in (0, 3):  # 3: a miss, which the page tells
        raise RunError(f"no row for {name}")
    return out, runs_of


class Kept:
    """Results of runs by name, in a JSON file: finished runs are not repeated."""

    def __init__(self, path):
        self.path = path
        self.known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}

    def get(self, name, make, *arguments):
        """The result called name; make(*arguments), which is kept, where it is not known."""
        if name not in self.known:
            self.known[name] = make(*arguments)
            write_whole(self.path, json.dumps(self.known))
        return self.known[name]


def pulled(out, name, metal, strain, spheres, seed, options):
    """{found, strain, stress [Pa]} of the row on a body, by -var material, to this strain, None: that of the targets; {failed: reason}
    where the body did not come to rest."""
    row = [line.split() for line in out.read_text(encoding="utf-8").splitlines() if line.startswith(f"{name} ")][0]
    body = calibration.make_body(options.work, spheres, seed, metal.density, TIMEOUT)
    try:
        aims = targets_of(metal) if strain is None else targets_of(metal)._replace(points=((1.0, strain),))
        found, curve = calibration.pull_material(body, {"material": f"{out}:{name}"}, float(row[7]), aims, 1.0, options.ranks, options.work, TIMEOUT, f"{name}, {spheres} spheres")
    except calibration.Failed as failure:
        return {"failed": str(failure)}
    return {"found": found, "strain": [float(f"{value:.6g}") for value in curve[0]], "stress": [float(f"{value:.6g}") for value in curve[1]]}


def largest(metal, curve, end):
    """'+3.1 % at 1.2 %' from the 0.2 % yield strain to the strain `end`; or why there is none."""
    if "failed" in curve:
        return "not at rest"
    strain, stress = np.array(curve["strain"]), np.array(curve["stress"])
    sign = np.sign(end)
    reference = np.maximum(metal.law.nominal(sign * strain), 1e-9 * metal.law.modulus)
    beyond = (strain >= metal.law.offset_yield(sign) / metal.law.modulus + calibration.YIELD_OFFSET) & (strain <= abs(end) + 1e-9)
    off = stress[beyond] / reference[beyond] - 1.0
    k = int(np.argmax(np.abs(off)))
    return f"{100.0 * off[k]:+.1f} % at {100.0 * strain[beyond][k]:.1f} %"


def draw(curves, path):
    """A panel for each metal: tension and compression of its row beside Johnson-Cook's, and the targets."""
    rows = []
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(2, 4, figsize=(17.0, 8.0))
        for axis, (name, metal) in zip(axes.flat, METALS.items()):
            for k, (side, ends) in enumerate(SIDES.items(), start=1):
                curve, sign = curves[name][side], np.sign(ends[-1])
                at = np.linspace(0.0, abs(ends[-1]), 201)
                reference = metal.law.nominal(sign * at)
                dashes = "-" if sign > 0 else (0, (4, 2))
                axis.plot(100.0 * at, reference / MPA, color="#555555", linewidth=1.2, linestyle=dashes, label=f"Johnson-Cook, {side}")
                rows += [(name, f"Johnson-Cook, {side}", f"{100.0 * a:.6g}", f"{b / MPA:.6g}") for a, b in zip(at, reference)]
                if "failed" in curve:
                    continue
                strain, stress = np.array(curve["strain"]), np.array(curve["stress"]) / MPA
                axis.plot(100.0 * strain, stress, label=f"evp/lj, {side}", **{**figures.line_style(k), "linestyle": dashes})
                rows += [(name, f"evp/lj, {side}", f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress)]
            aims = targets_of(metal)
            points = [(100.0 * (aims.yield_strain + calibration.YIELD_OFFSET), aims.yield_stress / MPA)]
            points += [(100.0 * abs(strain), stress / MPA) for stress, strain in aims.points]
            axis.plot(*zip(*points), "o", color="black", label="targets of the fit", zorder=5)
            axis.set(title=metal.title, xlim=(0, 20.5), xlabel="nominal strain [%]", ylim=(0, None))
        for axis in axes[:, 0]:
            axis.set_ylabel("nominal stress [MPa]")
        for axis in axes.flat[len(METALS):]:
            axis.axis("off")
        handles, labels = axes.flat[0].get_legend_handles_labels()
        axes.flat[-1].legend(handles, labels, loc="center")
        figure.tight_layout()
        return figures.save(figure, path, ("metal", "curve", "strain_percent", "stress_MPa"), rows)


HEAD = """# Metals

{answer}

    pair_style evp/lj contact repulsive plasticity isotropic
    pair_coeff * * potentials/metals.evp copper_OFHC

Written by `doc/studies/metals.py`, which calls `tools/calibrate.py` for each row of [potentials/metals.evp](../potentials/metals.evp). Targets are nominal
values of Johnson-Cook's curve (A + B ep^n) in quasi-static loading at room temperature: a true stress s at the true strain s/E + ep is
s exp(-strain) at exp(strain) - 1, in compression with negative strains.

![curves of the rows and of Johnson-Cook](figures/{stem}.png)

"""


def percent(value):
    return f"{100.0 * value:+.2f}"


def page(results, stem):
    """Text of the page. results: by name, what main() collected."""
    lines = [HEAD.format(stem=stem, answer=answer(results)), "## Targets and errors\n"]
    lines += table(("row", "metal", "E [GPa]", "error [%]", "0.2 % yield stress [MPa]", "error [%]", "stresses [MPa] at strains", "errors [%]", "nu", "error [%]",
                    "runs"), [
        (name, METALS[name].title, f"{aims.modulus / 1e9:.4g}", percent(off["E"]), f"{aims.yield_stress / MPA:.1f}", percent(off["yield"]),
         ", ".join(f"{stress / MPA:.1f} at {strain:g}" for stress, strain in aims.points),
         ", ".join(percent(off[calibration.at(strain)]) for _, strain in aims.points), f"{aims.nu:g}", percent(off["nu"]), one["runs"])
        for name, one in results.items() for aims, off in [(targets_of(METALS[name]), one["off"])]])
    lines += ["", f"Specimens of {SPHERES} spheres. Negative strains are compression; yield stress and stresses are then those of compression. *Runs*: of the fit.\n",
              "## Largest difference from Johnson-Cook's curve, from the yield strain on\n"]
    ends = [(side, end) for side, all_ends in SIDES.items() for end in all_ends]
    lines += table(("row", *(f"{side}, to {100.0 * abs(end):g} %" for side, end in ends)), [
        (name, *(largest(METALS[name], one[side], end) for side, end in ends)) for name, one in results.items()])
    lines += ["", WHY, "## Specimens that they were not fitted to\n"]
    lines += table(("row", "spheres", "seed", "error of E [%]", "of the yield stress [%]", "of the stresses [%]", "of nu [%]"), [
        (name, spheres, seed, *checked(one["checks"][f"{spheres}, {seed}"], targets_of(METALS[name])))
        for name, one in results.items() for spheres, seed in CHECKS])
    apart = max(abs(check["found"][what] / one["found"][what] - 1.0) for one in results.values() for check in one["checks"].values() if "found" in check
                for what in one["off"])
    lines += ["", f"The largest is {100.0 * largest_check(results):.1f} %. From what the rows gave on the specimen that they were found on, these differ by at most "
              f"{100.0 * apart:.1f} %.\n", "## Sources\n"]
    for name, metal in METALS.items():
        law = metal.law
        lines.append(f"- {name}: E {law.modulus / 1e9:g} GPa, A {law.a / MPA:.4g} MPa, B {law.b / MPA:.4g} MPa, n {law.n:.3g}, "
                     f"{metal.density:g} kg/m3. {metal.source}.")
    return "\n".join(lines) + "\n"


def largest_check(results):
    """Largest error on the specimens that rows were not fitted to."""
    return max((abs(value) for name, one in results.items() for check in one["checks"].values() if "found" in check
                for value in off_target(check["found"], targets_of(METALS[name])).values()), default=float("nan"))


def answer(results):
    """The first sentence of the page."""
    fitted = max(abs(value) for one in results.values() for value in one["off"].values())
    return (f"{len(results)} rows of [potentials/metals.evp](../potentials/metals.evp) meet Young's modulus, Poisson's ratio, 0.2 % yield stress and two further "
            f"stresses of their metal within {100.0 * fitted:.1f} %,\nand within {100.0 * largest_check(results):.1f} % on specimens that they were not fitted to. "
            "Beyond these strains, and in the other direction, they differ more from Johnson-Cook's curve, as the tables show.")


WHY = """The true stress of Johnson-Cook is the same in tension and compression. That of a specimen is smaller in compression, by what the tables show: sideways
its bonds rotate out of the load. Where Johnson-Cook's nominal stress decreases in tension, as the metal necks, the row was fitted in compression.
Even with e2 = 0 a specimen hardens beyond its 0.2 % yield stress, as its bonds yield one after another: a metal with a sharp yield point is met no nearer.
"""


def off_target(found, aims):
    """found/target - 1 by name."""
    return {name: found[name] / value - 1.0 for name, (value, _) in aims.aims.items()}


def checked(check, aims):
    """Cells of a check."""
    if "failed" in check:
        return (check["failed"], "", "", "")
    off = off_target(check["found"], aims)
    return percent(off["E"]), percent(off["yield"]), ", ".join(percent(off[calibration.at(strain)]) for _, strain in aims.points), percent(off["nu"])


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "metals", help="rows, bodies and runs (default: %(default)s)")
    parser.add_argument("--potentials", type=pathlib.Path, default=CHECKOUT / "potentials" / "metals.evp",
                        help="the potential file to write (default: %(default)s)")
    parser.add_argument("--only", nargs="+", choices=METALS, metavar="NAME", help="calibrate these only")
    parser.add_argument("--spheres", type=int, default=SPHERES, help="of the specimens that rows are fitted to (default: %(default)s)")
    parser.add_argument("--ranks", type=int, default=2, help="MPI ranks of each run (default 2)")
    parser.add_argument("--fresh", action="store_true", help="delete --work first: repeat everything")
    add_out(parser, "metals.md")
    options = parser.parse_args(words)
    if options.fresh:
        shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True, exist_ok=True)
    results, head = {}, None
    with errors_in_one_line("metals.py"):
        for name in watched("metals.py:", list(METALS)):
            metal = METALS[name]
            out, runs_of = calibrated(name, metal, options)
            kept = Kept(options.work / f"{name}.json")
            last = [json.loads(line) for line in runs_of.read_text(encoding="utf-8").splitlines()][1:]
            best = min((one for one in last if one["state"] == "done"), key=lambda one: max(map(abs, off_target(one["found"], targets_of(metal)).values())))
            one = {"found": best["found"], "off": off_target(best["found"], targets_of(metal)), "runs": len(last), "checks": {}}
            for spheres, seed in CHECKS:
                one["checks"][f"{spheres}, {seed}"] = kept.get(f"check {spheres} {seed}", pulled, out, name, metal, None, spheres, seed, options)
            for side, ends in SIDES.items():
                one[side] = kept.get(side, pulled, out, name, metal, ends[-1], *CHECKS[0], options)
            results[name] = one
            head = head or out.read_text(encoding="utf-8").splitlines()[:2]
        rows = [line for name in METALS for line in (options.work / f"{name}.evp").read_text(encoding="utf-8").splitlines()[2:]]
        write_whole(options.potentials, "\n".join([*head, *rows]) + "\n")
        stem = options.out.stem
        draw(results, options.out.parent / "figures" / f"{stem}.png")
        write_csv(options.out.with_suffix(".csv"), ("row", "body", "what", "target", "found"), [
            (name, body, what, f"{value:.6g}", f"{check['found'][what]:.6g}")
            for name, one in results.items() for body, check in {"found on": one, **one["checks"]}.items() if "found" in check
            for what, (value, _) in targets_of(METALS[name]).aims.items()])
        options.out.write_text(page(results, stem), encoding="utf-8")
    print(options.out)


if __name__ == "__main__":
    sys.exit(main())
