#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Calibrates the metals of potentials/metals.evp and writes doc/metals.md: targets, errors, other specimens, curves beside Johnson-Cook's.

  metals.py                     everything; runs that --work has already are not repeated
  metals.py --only steel_4340   calibrates these only; the others must be in --work already

tools/calibrate.py fits each row. The row is then tested with -var material on specimens that it was not fitted to, one of another
seed and one of 4000 spheres, in tension and in compression to a strain of 10 %. Writes the page, a CSV of the same name with the
measured values, and figures/NAME.png with its CSV. About ten minutes on two cores. Uses the lmp of this checkout, or EVP_LMP.
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
END = 0.1  # strain of the curves
SPHERES, SEED = 2000, 1  # of the specimens that rows are fitted to
CHECKS = ((2000, 2), (4000, 3))  # spheres and seed of specimens that they were not fitted to
TIMEOUT = 1800.0
MIDDLE = 0.05  # strain to which departures are told too
BALLISTICS = "Johnson and Cook, 7th Int. Symp. on Ballistics, The Hague, 1983"


class Metal(NamedTuple):
    """law: its curve; density [kg/m3]; poisson: of the metal, for the page; strain: of the second stress, negative in compression."""

    title: str
    law: JohnsonCook
    density: float
    poisson: float
    strain: float
    source: str


METALS = {
    "aluminium_1100O": Metal(
        "pure aluminium, 1100-O", from_handbook(69e9, 34e6, 90e6), 2710.0, 0.33, 0.05,
        "ASM Handbook vol. 2: 1100-O has a 0.2 % yield stress of 34 MPa, an ultimate stress of 90 MPa; power law through both, necking by Considere"),
    "aluminium_2024T351": Metal("aluminium 2024-T351", JohnsonCook(73e9, 265e6, 426e6, 0.34), 2770.0, 0.33, 0.05, BALLISTICS),
    "copper_OFHC": Metal("OFHC copper", JohnsonCook(124e9, 90e6, 292e6, 0.31), 8960.0, 0.34, 0.05, BALLISTICS),
    "copper_taylor": Metal(
        "copper of the Taylor benchmark", JohnsonCook(117e9, 400e6, 100e6, 1.0), 8930.0, 0.35, -0.1,
        "The usual benchmark of a copper bar of 32.4 x 6.4 mm at 227 m/s: yield 400 MPa, linear hardening 100 MPa"),
    "steel_4340": Metal("4340 steel", JohnsonCook(205e9, 792e6, 510e6, 0.26), 7830.0, 0.29, -0.1, BALLISTICS + "; E of handbooks"),
}


def targets_of(metal):
    """Targets of a metal: E, 0.2 % yield and a second stress of Johnson-Cook's curve, nominal."""
    sign = np.sign(metal.strain)
    offset, second = metal.law.offset_yield(sign), metal.law.nominal(metal.strain)[0]
    return Targets(metal.law.modulus, float(f"{offset:.6g}"), float(f"{second:.6g}"), metal.strain, metal.density)


def calibrated(name, metal, options):
    """Path of the potential file with the row of the metal alone, and of its run table; made where --work does not hold them."""
    out, runs_of = options.work / f"{name}.evp", options.work / f"{name}.jsonl"
    if out.exists():
        return out, runs_of
    if options.only and name not in options.only:
        raise RunError(f"{options.work} has no row of {name}: run without --only")
    aims = targets_of(metal)
    words = ["--E", f"{aims.modulus:g}", "--yield", f"{aims.yield_stress:g}", "--stress2", f"{aims.stress2:g}@{aims.strain:g}",
             "--density", f"{aims.density:g}", "--name", name, "--out", str(out), "--spheres", str(options.spheres), "--seed", str(SEED),
             "--ranks", str(options.ranks), "--table", str(runs_of), "--timeout", f"{TIMEOUT:g}", "--source", f"{metal.title}: {metal.source}"]
    if calibrate.main(words):
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
    """{found, strain, stress [Pa]} of the row on a body, by -var material; {failed: reason} where the body did not come to rest."""
    row = [line.split() for line in out.read_text(encoding="utf-8").splitlines() if line.startswith(f"{name} ")][0]
    body = calibration.make_body(options.work, spheres, seed, metal.density, TIMEOUT)
    try:
        found, curve = calibration.pull_material(body, {"material": f"{out}:{name}"}, float(row[7]), targets_of(metal)._replace(strain=strain), 1.0,
                                                 options.ranks, options.work, TIMEOUT, f"{name}, {spheres} spheres")
    except calibration.Failed as failure:
        return {"failed": str(failure)}
    return {"found": found, "strain": [float(f"{value:.6g}") for value in curve[0]], "stress": [float(f"{value:.6g}") for value in curve[1]]}


def largest(metal, curve, sign, end):
    """'+3.1 % at 1.2 %' from the 0.2 % yield strain to `end`; or why there is none."""
    if "failed" in curve:
        return "not at rest up to 10 %"
    strain, stress = np.array(curve["strain"]), np.array(curve["stress"])
    reference = np.maximum(metal.law.nominal(sign * strain), 1e-9 * metal.law.modulus)
    beyond = (strain >= metal.law.offset_yield(sign) / metal.law.modulus + calibration.YIELD_OFFSET) & (strain <= end + 1e-9)
    off = stress[beyond] / reference[beyond] - 1.0
    k = int(np.argmax(np.abs(off)))
    return f"{100.0 * off[k]:+.1f} % at {100.0 * strain[beyond][k]:.1f} %"


def draw(curves, path):
    """A panel for each metal: tension and compression of its row beside Johnson-Cook's, and the targets."""
    rows = []
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(2, 3, figsize=(13.5, 8.0))
        for axis, (name, metal) in zip(axes.flat, METALS.items()):
            for sign, side, k in ((1.0, "tension", 1), (-1.0, "compression", 2)):
                curve = curves[name][side]
                at = np.linspace(0.0, END, 201)
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
            points = ((100.0 * (aims.yield_strain + calibration.YIELD_OFFSET), aims.yield_stress / MPA), (100.0 * abs(aims.strain), aims.stress2 / MPA))
            axis.plot(*zip(*points), "o", color="black", label="targets of the fit", zorder=5)
            axis.set(title=metal.title, xlim=(0, 100.0 * END * 1.03), xlabel="nominal strain [%]")
            axis.set_ylim(0, 1.3 * max(metal.law.nominal(END)[0], metal.law.nominal(-END)[0]) / MPA)
        for axis in axes[:, 0]:
            axis.set_ylabel("nominal stress [MPa]")
        axes.flat[-1].axis("off")
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
    lines += table(("row", "metal", "E [GPa]", "error of E [%]", "0.2 % yield stress [MPa]", "error of the yield stress [%]", "second stress [MPa]", "at strain",
                    "error of the second stress [%]", "runs", "nu of the row", "nu of the metal"), [
        (name, metal.title, f"{aims.modulus / 1e9:.4g}", percent(off["E"]), f"{aims.yield_stress / MPA:.1f}", percent(off["yield"]),
         f"{aims.stress2 / MPA:.1f}", f"{aims.strain:g}", percent(off["stress2"]), one["runs"], f"{one['found']['nu']:.3f}", f"{metal.poisson:g}")
        for name, metal in METALS.items() for one in [results[name]] for aims, off in [(targets_of(metal), one["off"])]])
    lines += ["", f"Specimens of {SPHERES} spheres. A negative strain is compression; yield stress and second stress are then those of compression. *Runs*: of the fit.\n",
              "## Largest difference from Johnson-Cook's curve, from the yield strain on\n"]
    lines += table(("row", "tension, to 5 %", "tension, to 10 %", "compression, to 5 %", "compression, to 10 %"), [
        (name, *(largest(METALS[name], one[side], sign, end) for side, sign in (("tension", 1.0), ("compression", -1.0)) for end in (MIDDLE, END)))
        for name, one in results.items()])
    lines += ["", WHY, "## Specimens that they were not fitted to\n"]
    lines += table(("row", "spheres", "seed", "error of E [%]", "error of the yield stress [%]", "error of the second stress [%]"), [
        (name, spheres, seed, *checked(one["checks"][f"{spheres}, {seed}"], targets_of(METALS[name])))
        for name, one in results.items() for spheres, seed in CHECKS])
    lines += ["", f"The largest is {100.0 * largest_check(results):.1f} %.\n", "## Sources\n"]
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
    return (f"{len(results)} rows of [potentials/metals.evp](../potentials/metals.evp) meet Young's modulus, 0.2 % yield stress and a second stress of their metal within "
            f"{100.0 * fitted:.1f} %, and within {100.0 * largest_check(results):.1f} %\non specimens that they were not fitted to. "
            "Between and beyond these targets they differ more from Johnson-Cook's curve, as the tables show.")


WHY = """The hardening of the law is linear once all bonds flow, that of Johnson-Cook decreases with strain: the more a metal hardens, the more the two differ
between and beyond the targets. The nominal stress of a specimen is nearly the same in tension and compression; that of Johnson-Cook is larger in compression,
as its true stress is the same in both. Even with e2 = 0 a specimen hardens beyond its 0.2 % yield stress, as its bonds yield one after another.
The copper of the Taylor benchmark and the steel harden less than that in tension, where the cross-section shrinks. They were therefore fitted in
compression; in tension their stress is above Johnson-Cook's by as much as the table shows.
Poisson's ratio is not a target: the volume energy of fix evp/volume hardens a specimen in tension by itself, more than the
aluminium alloy, the steel and the copper of the Taylor benchmark harden.
"""


def off_target(found, aims):
    """found/target - 1 by name."""
    return {"E": found["E"] / aims.modulus - 1.0, "yield": found["yield"] / aims.yield_stress - 1.0, "stress2": found["stress2"] / aims.stress2 - 1.0}


def checked(check, aims):
    """Cells of a check."""
    if "failed" in check:
        return (check["failed"], "", "")
    return tuple(percent(value) for value in off_target(check["found"], aims).values())


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
                one["checks"][f"{spheres}, {seed}"] = kept.get(f"check {spheres} {seed}", pulled, out, name, metal, metal.strain, spheres, seed, options)
            for side, sign in (("tension", 1.0), ("compression", -1.0)):
                one[side] = kept.get(side, pulled, out, name, metal, sign * END, *CHECKS[0], options)
            results[name] = one
            head = head or out.read_text(encoding="utf-8").splitlines()[:2]
        rows = [line for name in METALS for line in (options.work / f"{name}.evp").read_text(encoding="utf-8").splitlines()[2:]]
        write_whole(options.potentials, "\n".join([*head, *rows]) + "\n")
        stem = options.out.stem
        draw(results, options.out.parent / "figures" / f"{stem}.png")
        write_csv(options.out.with_suffix(".csv"), ("row", "body", "E_GPa", "yield_MPa", "stress2_MPa"), [
            (name, body, *(f"{check['found'][key] / unit:.6g}" for key, unit in (("E", 1e9), ("yield", MPA), ("stress2", MPA))))
            for name, one in results.items() for body, check in {"found on": one, **one["checks"]}.items() if "found" in check])
        options.out.write_text(page(results, stem), encoding="utf-8")
    print(options.out)


if __name__ == "__main__":
    sys.exit(main())
