#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Calibrates the metals of potentials/metals.evp and writes doc/metals.md: targets, errors, other specimens, curves beside Johnson-Cook's.

  metals.py                     everything; runs that --work has already are not repeated
  metals.py --only steel_4340   calibrates these only; the others must be in --work already

tools/calibrate.py fits each row. The row is then tested with -var material on specimens that it was not fitted to, one of another
seed and one of 4000 spheres, on the first of them in tension to a strain of 20 % and in compression to 40 %. Writes the potential file, the page, a CSV of the same
name with the measured values, and figures/metals.png with its CSV. About an hour and a half on one core.
"""

import json
from typing import NamedTuple

from study import CHECKOUT, DECKS, RunError, Study, deck_command, write_csv
import calibrate
import numpy as np
from evp import calibration, figures, rates
from evp.calibration import Targets
from johnson_cook import JohnsonCook, from_handbook

MPA = 1e6
POTENTIALS = CHECKOUT / "potentials" / "metals.evp"
SIDES = {"tension": (0.05, 0.1, 0.2), "compression": (-0.1, -0.2, -0.4)}  # strains at which differences are told; the last one ends the curve
WITHIN = 0.06  # of Johnson-Cook's stress: the strains between which a row is so near are told
INCREMENT, STEP = 0.008, 0.0005  # of strain: of these curves; between two of their differences
SPHERES, SEED = 2000, 1  # of the specimens that rows are fitted to
CHECKS = ((2000, 2), (4000, 3))  # spheres and seed of specimens that they were not fitted to
TIMEOUT = 1800.0
BALLISTICS = "Johnson and Cook, 7th Int. Symp. on Ballistics, The Hague, 1983"
PULLED, PUSHED, FAR, PRESSED = (0.02, 0.05), (-0.02, -0.05), (-0.05, -0.3), (-0.02, -0.05, -0.1, -0.2, -0.3)  # strains of the stresses that rows are fitted to


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
        "copper of the Taylor benchmark", JohnsonCook(117e9, 400e6, 100e6, 1.0), 8930.0, 0.35, FAR,
        "The usual benchmark of a copper bar of 32.4 x 6.4 mm at 227 m/s: yield 400 MPa, linear hardening 100 MPa"),
    "steel_4340": Metal("4340 steel", JohnsonCook(205e9, 792e6, 510e6, 0.26), 7830.0, 0.29, PUSHED, BALLISTICS + "; E of handbooks"),
    "titanium_6Al4V": Metal("Ti-6Al-4V", JohnsonCook(114e9, 1098e6, 1092e6, 0.93), 4430.0, 0.33, PUSHED,
                            "Lesuer, DOT/FAA/AR-00/25, 2000; E and Poisson's ratio of handbooks"),
}
METALS.update({f"{name}_pressed": METALS[name]._replace(title=f"{METALS[name].title}, pressed", strains=PRESSED) for name in ("steel_4340",)})


def targets_of(metal):
    """Targets of a metal: E, 0.2 % yield and stresses of Johnson-Cook's curve, nominal; Poisson's ratio."""
    first = metal.law.offset_yield(np.sign(metal.strains[0]))
    points = tuple((float(f"{stress:.6g}"), strain) for stress, strain in zip(metal.law.nominal(metal.strains), metal.strains))
    return Targets(metal.law.modulus, float(f"{first:.6g}"), points, metal.density, metal.poisson)


def words_of(aims):
    """Of the command that asks for them."""
    words = ["--E", f"{aims.modulus:g}", "--yield", f"{aims.yield_stress:g}"]
    return words + [word for stress, strain in aims.points for word in ("--stress", f"{stress:g}@{strain:g}")] + ["--nu", f"{aims.nu:g}"]


def calibrated(name, study):
    """Path of the potential file with the row of the metal alone, and of its run table; made where --work does not hold them."""
    out, runs_of = study.work / f"{name}.evp", study.work / f"{name}.{name}.jsonl"
    if out.exists():
        return out, runs_of
    if name not in study.only:
        raise RunError(f"{study.work} has no row of {name}: run without --only")
    metal = METALS[name]
    words = [*words_of(targets_of(metal)), "--density", f"{metal.density:g}", "--name", name, "--out", str(out), "--spheres", str(SPHERES), "--seed", str(SEED),
             "--ranks", str(study.ranks), "--timeout", f"{TIMEOUT:g}"]
    calibrate.main(words)  # a miss is told by the page
    if not out.exists():
        raise RunError(f"no row for {name}")
    return out, runs_of


def pulled(out, name, aims, spheres, seed, study):
    """{found} of the row on a body, by -var material, to the largest strain of the targets; {failed: reason} where the body did not come to rest."""
    body, row = calibration.make_body(study.work, spheres, seed, aims.density, TIMEOUT), f"{out}:{name}"
    try:
        return {"found": calibration.pull_material(body, {"material": row}, rates.given_row(row)[0].xi_s, aims, 1.0, study.ranks, study.work, TIMEOUT, f"{name}, {spheres} spheres")[0]}
    except (calibration.Failed, calibration.CurveError) as failure:
        return {"failed": str(failure)}


def far(out, name, side, study):
    """{strain, stress [Pa]} of the row on the first body that it was not fitted to, by -var material, to the last strain of the side, or as far as the
    body comes to rest."""
    (spheres, seed), end, prefix = CHECKS[0], SIDES[side][-1], f"{name}_{side}"
    body = study.runs.body(f"far_{spheres}_{seed}", n=spheres, seed=seed)
    first = calibration.legs(rates.given_row(f"{out}:{name}")[0].xi_s, targets_of(METALS[name])._replace(points=((1.0, end),)), 1.0)[:2]
    for number, (strain, increment) in enumerate([*first, (calibration.OVERSHOOT * end, INCREMENT)]):
        try:
            study.runs.keep(f"{prefix}_{number}", deck_command(DECKS / "in.quasistatic", {
                "specimen": body, "material": f"{out}:{name}", **calibration.RULES, "strain": f"{strain:.9g}", "increment": f"{increment:.9g}",
                "resume": "yes" if number else "no", "out": prefix}, study.ranks))
        except RunError as error:
            if "did not come to rest" not in str(error):
                raise
            break
    strain, stress = calibration.read_curve(study.runs.folder / f"{prefix}.csv")
    stress = np.append(stress[strain < abs(end)], np.interp(min(abs(end), strain[-1]), strain, stress))
    strain = np.append(strain[strain < abs(end)], min(abs(end), strain[-1]))
    return {"strain": [float(f"{value:.6g}") for value in strain], "stress": [float(f"{value:.6g}") for value in stress]}


def measure(name, study):
    """What the page tells of a row: found, off, runs, checks by (spheres, seed), and the two curves; kept in --work."""
    out, runs_of = calibrated(name, study)
    kept, aims = study.work / f"{name}.json", targets_of(METALS[name])
    sides = {side: far(out, name, side, study) for side in SIDES}
    if kept.exists():
        return {**json.loads(kept.read_text(encoding="utf-8")), **sides}
    runs = [json.loads(line) for line in runs_of.read_text(encoding="utf-8").splitlines()][1:]
    best = next(one["found"] for one in runs if one["state"] == "done" and one["material"][0] == list(rates.given_row(f"{out}:{name}")[0]))
    one = {"found": best, "runs": len(runs), "checks": {f"{spheres}, {seed}": pulled(out, name, aims, spheres, seed, study) for spheres, seed in CHECKS}}
    kept.write_text(json.dumps(one), encoding="utf-8")
    return {**one, **sides}


def far_cells(metal, curve, side):
    """'0.7 to 1.9, 11.7 to 18.0', the ranges of strains [%] above the 0.2 % yield strain where a stress is within WITHIN of Johnson-Cook's, or 'none';
    and the differences at the strains of the side; where the body came to rest no more, up to which strain it did."""
    sign, strain, stress = np.sign(SIDES[side][-1]), curve["strain"], curve["stress"]
    first = metal.law.offset_yield(sign) / metal.law.modulus + calibration.YIELD_OFFSET
    at = np.append(np.arange(first, strain[-1], STEP), strain[-1])
    off = np.interp(at, strain, stress) / metal.law.nominal(sign * at) - 1.0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], np.abs(off) <= WITHIN, [0])).astype(int)))
    near = ", ".join(f"{100.0 * at[first]:.1f} to {100.0 * at[last - 1]:.1f}" for first, last in zip(edges[::2], edges[1::2])) or "none"
    return near, *(f"{100.0 * np.interp(abs(end), at, off):+.1f} %" if at[-1] > abs(end) - 1e-6 else f"at rest to {100.0 * at[-1]:.1f} %" for end in SIDES[side])


def draw(study, curves):
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
                strain, stress = np.array(curve["strain"]), np.array(curve["stress"]) / MPA
                axis.plot(100.0 * strain, stress, label=f"evp/lj, {side}", **{**figures.line_style(k), "linestyle": dashes})
                rows += [(name, f"evp/lj, {side}", f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress)]
            aims = targets_of(metal)
            points = [(100.0 * (aims.yield_strain + calibration.YIELD_OFFSET), aims.yield_stress / MPA)]
            points += [(100.0 * abs(strain), stress / MPA) for stress, strain in aims.points]
            axis.plot(*zip(*points), "o", color="black", label="targets of the fit", zorder=5)
            axis.set(title=metal.title, xlim=(0, None), xlabel="nominal strain [%]", ylim=(0, None))
        for axis in axes[:, 0]:
            axis.set_ylabel("nominal stress [MPa]")
        for axis in axes.flat[len(METALS):]:
            axis.axis("off")
        handles, labels = axes.flat[0].get_legend_handles_labels()
        axes.flat[-1].legend(handles, labels, loc="center")
        figure.tight_layout()
        study.save(figure, ("metal", "curve", "strain_percent", "stress_MPa"), rows)


def cells(off, aims):
    """Errors [%] of E, yield stress, stresses and nu."""
    percent = {what: f"{100.0 * value:+.2f}" for what, value in off.items()}
    return percent["E"], percent["yield"], ", ".join(percent[calibration.at(strain)] for _, strain in aims.points), percent["nu"]


def page(results):
    """Values of the page, of {name: what measure() found}."""
    targets, others, worst, apart, unfitted = [], [], [], [], []
    for name, one in results.items():
        metal, aims = METALS[name], targets_of(METALS[name])
        off = aims.off(one["found"])
        modulus, first, stresses, nu = cells(off, aims)
        targets.append((name, metal.title, f"{aims.modulus / 1e9:.4g}", modulus, f"{aims.yield_stress / MPA:.1f}", first,
                        ", ".join(f"{stress / MPA:.1f} at {strain:g}" for stress, strain in aims.points), stresses, f"{aims.nu:g}", nu, one["runs"]))
        worst += map(abs, off.values())
        for spheres, seed in CHECKS:
            check = one["checks"][f"{spheres}, {seed}"]
            if "failed" in check:
                others.append((name, spheres, seed, check["failed"], "", "", ""))
                continue
            others.append((name, spheres, seed, *cells(aims.off(check["found"]), aims)))
            unfitted += map(abs, aims.off(check["found"]).values())
            apart += (abs(check["found"][what] / one["found"][what] - 1.0) for what in aims.aims)
    beyond = [(name, *(cell for side in SIDES for cell in far_cells(METALS[name], one[side], side))) for name, one in results.items()]
    sources = [f"- {name}: E {metal.law.modulus / 1e9:g} GPa, A {metal.law.a / MPA:.4g} MPa, B {metal.law.b / MPA:.4g} MPa, n {metal.law.n:.3g}, {metal.density:g} kg/m3. {metal.source}."
               for name, metal in METALS.items()]
    return {"count": len(results), "spheres": SPHERES, "sources": "\n".join(sources),
            **{key: f"{100.0 * max(values, default=float('nan')):.1f}" for key, values in (("fitted", worst), ("unfitted", unfitted), ("apart", apart))},
            "targets": (("row", "metal", "E [GPa]", "error [%]", "0.2 % yield stress [MPa]", "error [%]", "stresses [MPa] at strains", "errors [%]", "nu", "error [%]", "runs"), targets),
            "within": f"{100.0 * WITHIN:g}", "increment": f"{100.0 * INCREMENT:g}", "far_spheres": CHECKS[0][0],
            "differences": (("row", *(title for side, ends in SIDES.items() for title in (f"{side}: strains [%]", *(f"at {100.0 * abs(end):g} %" for end in ends)))), beyond),
            "others": (("row", "spheres", "seed", "error of E [%]", "of the yield stress [%]", "of the stresses [%]", "of nu [%]"), others)}


def main(words=None):
    with Study(__doc__, "metals", only=list(METALS), ranks=1).started(words) as study:
        results = {name: measure(name, study) for name in study.each(METALS)}
        rows = []
        for name, metal in METALS.items():
            *head, blank, targets, date, command, row = (study.work / f"{name}.evp").read_text(encoding="utf-8").splitlines()
            rows += [blank, targets, f"#   source: {metal.title}: {metal.source}", date, command, row]
        POTENTIALS.write_text("\n".join([*head, *rows, ""]), encoding="utf-8")
        draw(study, results)
        write_csv(study.out.with_suffix(".csv"), ("row", "body", "what", "target", "found"), [
            (name, body, what, f"{value:.6g}", f"{check['found'][what]:.6g}")
            for name, one in results.items() for body, check in {"found on": one, **one["checks"]}.items() if "found" in check
            for what, (value, _) in targets_of(METALS[name]).aims.items()])
        study.write(**page(results))


if __name__ == "__main__":
    main()
