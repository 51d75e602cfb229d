#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Calibrates the metals of potentials/metals.evp and writes doc/metals.md: how far each row is from its flow curve, on other bodies.

  metals.py                      everything; runs that --work has already are not repeated
  metals.py --only steel_4340    calibrates these only, unless --work has their rows; the rows of others stay; none: all stay
  metals.py --large steel_4340   only these on 8000 spheres, too; none: no row

tools/calibrate.py fits each row. On bodies of another seed, with -var material, it is then pulled to a strain of 15 %, pressed by
40 %, pressed by 10 % and released, and sheared to a strain of 4; a body of 8000 spheres is pulled and pressed. Writes the potential
file, the page, and figures/metals.png with its CSV. About three hours on two cores.
"""

import json
import math
from typing import NamedTuple

from study import CHECKOUT, RunError, Study
import calibrate
import numpy as np
import scipy.optimize
from evp import calibration, curves, figures, flow, rates
from evp.calibration import MISES, STRAINS, WAYS, YIELD, Run, Targets
from evp.curves import YIELD_OFFSET

MPA = 1e6
POTENTIALS = CHECKOUT / "potentials" / "metals.evp"
SPHERES, SEED = 2000, 1  # of the bodies that rows are fitted to
STOCKY_METAL, STOCKY_RADIUS = "aluminium_2024T351", 0.02  # in a cylinder of the paper, whose grips hold its middle


class Cylinder(NamedTuple):
    """A body that rows were not fitted to. radius [m]."""

    spheres: int
    seed: int
    radius: float = calibration.RADIUS


OTHER, LARGE, STOCKY = Cylinder(2000, 2), Cylinder(8000, 3), Cylinder(2000, 2, STOCKY_RADIUS)
SHEAR_STRAINS = (0.4, 1.0, 2.0, 3.0, 4.0)  # at which the shear stress is told
PRESSED = -0.1  # nominal strain before the release
# Limits beyond which the page tells a miss; others are those of calibration.limit_of().
ALIKE = {0.02: 0.03, 0.05: 0.05, 0.1: 0.08}  # at nominal strains: compression over tension - 1
SHEAR_YIELD = 0.06  # over that in tension, times sqrt(3), - 1
SPRINGBACK = 5e-4  # strain recovered less stress/E
TIMEOUT = 3600.0
BALLISTICS = "Johnson and Cook, 7th Int. Symp. on Ballistics, The Hague, 1983"
LESUER = "Lesuer, Kay and LeBlanc, Modeling large-strain, high-rate deformation in metals, UCRL-JC-134118, 2001"
ASM = "conductivity and capacity: ASM Handbook vol. 1 and 2"
FUSION = "latent heat: that of the pure metal, CRC Handbook of Chemistry and Physics"


def from_handbook(offset_yield, ultimate):
    """(B [Pa], n) of a power law with this 0.2 % yield stress and ultimate tensile stress, nominal [Pa], at the strain where necking begins.

    At the largest nominal stress d(true stress)/d(strain) = true stress (Considere), so that ep = n there and
    ultimate = B n^n exp(-n), elastic strain left out; yield = B 0.002^n.
    """
    ratio = np.log(ultimate / offset_yield)
    n = scipy.optimize.brentq(lambda n: n * np.log(n / YIELD_OFFSET) - n - ratio, 2.0 * YIELD_OFFSET, 1.0)
    return offset_yield / YIELD_OFFSET**n, float(n)


class Metal(NamedTuple):
    """modulus, a, b [Pa], n: of the true stress a + b ep^n; density [kg/m3]; poisson; heat: keywords of the row for fix evp/heat, SI."""

    title: str
    modulus: float
    law: tuple
    density: float
    poisson: float
    source: str
    heat: str
    heat_source: str

    @property
    def words(self):
        """Of the command line of calibrate.py."""
        return [f"--E={self.modulus:g}", "--johnson-cook", *(f"{value:.6g}" for value in self.law), f"--nu={self.poisson:g}", f"--density={self.density:g}"]


METALS = {
    "aluminium_1100O": Metal("pure aluminium, 1100-O", 69e9, (0.0, *from_handbook(34e6, 90e6)), 2710.0, 0.33,
                             "ASM Handbook vol. 2: 0.2 % yield stress 34 MPa, ultimate stress 90 MPa; power law through both, necking by Considere",
                             "conductivity 222 capacity 904", ASM),
    "aluminium_2024T351": Metal("aluminium 2024-T351", 73e9, (265e6, 426e6, 0.34), 2770.0, 0.33, BALLISTICS,
                                "conductivity 121 capacity 875 soften 298 775 1 melt 397e3", f"{BALLISTICS}; {FUSION}"),
    "aluminium_6061T6": Metal("aluminium 6061-T6", 68.9e9, (324e6, 114e6, 0.42), 2700.0, 0.33,
                              LESUER,
                              "conductivity 167 capacity 896 soften 294 925 1.34 melt 397e3", f"softening: {LESUER}; {ASM}; {FUSION}"),
    "copper_OFHC": Metal("OFHC copper", 124e9, (90e6, 292e6, 0.31), 8960.0, 0.34, BALLISTICS,
                         "conductivity 386 capacity 383 soften 298 1356 1.09 melt 209e3", f"{BALLISTICS}; {FUSION}"),
    "copper_taylor": Metal("copper of the Taylor benchmark", 117e9, (400e6, 100e6, 1.0), 8930.0, 0.35,
                           "The usual benchmark of a copper bar of 32.4 x 6.4 mm at 227 m/s: yield 400 MPa, linear hardening 100 MPa",
                           "conductivity 386 capacity 383", f"those of OFHC copper, {BALLISTICS}"),
    "brass_70_30": Metal("cartridge brass", 110e9, (112e6, 505e6, 0.42), 8520.0, 0.37, BALLISTICS + "; E and Poisson's ratio of handbooks",
                         "conductivity 111 capacity 385 soften 298 1189 1.68", BALLISTICS),
    "steel_304": Metal("304 stainless steel, annealed", 193e9, (0.0, *from_handbook(240e6, 580e6)), 7900.0, 0.29,
                       "ASM Handbook vol. 1, typical values: 0.2 % yield stress 240 MPa, ultimate stress 580 MPa; power law through both, necking by Considere",
                       "conductivity 16.2 capacity 500", ASM),
    "steel_4340": Metal("4340 steel", 205e9, (792e6, 510e6, 0.26), 7830.0, 0.29, BALLISTICS + "; E of handbooks",
                        "conductivity 38 capacity 477 soften 298 1793 1.03 melt 247e3", f"{BALLISTICS}; {FUSION}"),
    "titanium_6Al4V": Metal("Ti-6Al-4V", 114e9, (1098e6, 1092e6, 0.93), 4430.0, 0.33, "Lesuer, DOT/FAA/AR-00/25, 2000; E and Poisson's ratio of handbooks",
                            "conductivity 6.7 capacity 560 soften 298 1878 1.1 melt 296e3", f"softening: Lesuer, DOT/FAA/AR-00/25, 2000; {ASM}; {FUSION}"),
}


def targets_of(metal):
    """Targets of a metal."""
    return Targets(metal.modulus, flow.johnson_cook(*(float(f"{value:.6g}") for value in metal.law)), metal.density, metal.poisson)


def calibrated(name, study):
    """FILE:ROW of the metal: a file with this row alone, made where --work does not hold it, or POTENTIALS."""
    out = study.work / f"{name}.evp"
    if out.exists():
        return f"{out}:{name}"
    if name not in study.only:
        return f"{POTENTIALS}:{name}"
    calibrate.main([*METALS[name].words, "--name", name, "--out", str(out), "--spheres", str(SPHERES), "--seed", str(SEED), "--ranks", str(study.ranks),
                    "--timeout", f"{TIMEOUT:g}"])  # a miss is told by the page
    if not out.exists():
        raise RunError(f"no row for {name}")
    return f"{out}:{name}"


def loaded(name, cylinder, study):
    """{way: Run} of a row on a body that it was not fitted to; kept in --work. A way that did not come to rest is left out."""
    spheres, seed, radius = cylinder
    kept, targets, runs = study.work / f"{name}_{spheres}_{seed}_{1e3 * radius:g}.json", targets_of(METALS[name]), {}
    if not kept.exists():
        row = calibrated(name, study)
        body = calibration.make_body(study.work, spheres, seed, targets.density, TIMEOUT, radius)
        for way in WAYS:
            try:
                runs[way] = calibration.load(body, {"material": row}, rates.given_row(row)[0].xi_s, targets.end(way), targets.yield_strain + YIELD_OFFSET, 1.0,
                                             study.ranks, study.work, TIMEOUT, f"{name}, {spheres} spheres, {way}")
            except calibration.Failed as failure:
                print(f"{name}, {spheres} spheres, {way}: {failure}", flush=True)
        kept.write_text(json.dumps({way: run.as_json() for way, run in runs.items()}), encoding="utf-8")
    return {way: Run.from_json(run) for way, run in json.loads(kept.read_text(encoding="utf-8")).items()}


def shear_yield(curve):
    """0.2 % offset yield stress [Pa] of a Curve of simple shear, at the plastic strain of that in tension (von Mises)."""
    strain, stress = curve.strain / MISES, curve.virial * MISES
    return curves.yield_stress(strain, stress, curves.modulus(strain, stress)) / MISES


def further(name, study):
    """Of a row on bodies of another seed, kept in --work: {"shear": Run of a simple shear with contact join; "shear yield": its
    0.2 % offset yield stress [Pa]; "recovered", "elastic": true strain that a release after PRESSED gives back, and true
    stress/E of before}."""
    kept, targets = study.work / f"{name}_further.json", targets_of(METALS[name])
    if not kept.exists():
        material, more = {"material": calibrated(name, study)}, (study.ranks, study.work, TIMEOUT)
        calibration.make_periodic(study.work, OTHER[1], targets.density, TIMEOUT)
        run = calibration.shear(material, targets, SHEAR_STRAINS[-1], 1.0, *more, f"{name}, shear")
        found = {"shear": run.as_json()}
        row = f"{min(2e-4, 0.2 * targets.yield_strain):.3g}"  # some of them before it yields
        first = {"specimen": "periodic.data", **material, "strain": 0.03, "row": row, "out": "yield"}
        calibration.call("in.shear", first, *more, f"{name}, shear yield")
        curve = curves.read_curve(study.work / "yield.csv")
        found["shear yield"] = shear_yield(curve)
        body = calibration.make_body(study.work, OTHER.spheres, OTHER.seed, targets.density, TIMEOUT, OTHER.radius)
        release = {"specimen": body.path.name, **material, "strain": PRESSED, "cycles": 1, "lower": "release",
                   "increment": 0.004, "out": "release"}
        calibration.call("in.quasistatic", release, *more, f"{name}, springback")
        curve = curves.read_curve(study.work / "release.csv", "strain_gauge")
        turn = int(np.argmin(curve.strain))
        found["recovered"] = float(np.log1p(curve.strain[-1]) - np.log1p(curve.strain[turn]))
        found["elastic"] = float(-curve.virial[turn] * (1.0 + curve.strain[turn]) / targets.modulus)
        kept.write_text(json.dumps(found), encoding="utf-8")
    found = json.loads(kept.read_text(encoding="utf-8"))
    return {**found, "shear": Run.from_json(found["shear"])}


def bonds(gradient):
    """(20000, 3) directions of bonds, all directions at first, that have turned with a deformation gradient (3, 3), and (20000) how far they are stretched."""
    k = np.arange(20000) + 0.5
    z, angle = 1.0 - 2.0 * k / len(k), k * np.pi * (1.0 + math.sqrt(5.0))
    now = np.stack([z, *(np.sqrt(1.0 - z**2) * of(angle) for of in (np.cos, np.sin))], axis=1) @ np.transpose(gradient)
    stretch = np.linalg.norm(now, axis=1)
    return now / stretch[:, None], stretch


def flow_stress(gradient, rate, thin=True):
    """Of von Mises, of bonds that have turned with a deformation gradient (3, 3) and flow with a stretching (3, 3) without change of volume, over F d of one that is not
    stretched: the power is the mean of F d |n rate n| over their directions n. F d is that of all, or of those that thin goes with 1/stretch."""
    directions, stretch = bonds(gradient)
    power = np.abs(np.einsum("ki,ij,kj->k", directions, rate, directions)) * (1.0 / stretch if thin else 1.0)
    return np.mean(power) / math.sqrt(2.0 / 3.0 * np.sum(np.square(rate)))


def stretched(strain):
    """Deformation gradient of a nominal strain along x at constant volume."""
    return np.diag([1.0 + strain, *[(1.0 + strain) ** -0.5] * 2])


def turned_in(way, strain, thin=True):
    """flow_stress() over that in tension at first, - 1, at a nominal strain of one of WAYS, or at a shear strain."""
    pull = np.diag([1.0, -0.5, -0.5])
    if way == calibration.SHEARED:
        now = flow_stress([[1.0, strain, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [[0.0, 0.5, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]], thin)
    else:
        now = flow_stress(stretched(math.copysign(strain, WAYS[way])), pull, thin)
    return now / flow_stress(np.eye(3), pull) - 1.0


def softer(strain):
    """By how much the mean of cos^4 of the bonds to the axis, over their stretch, with which E along it goes, has fallen at a nominal strain along it."""
    first, now = (np.mean(directions[:, 0] ** 4 / stretch) for directions, stretch in map(bonds, (np.eye(3), stretched(strain))))
    return 1.0 - now / first


def draw(study, results, more):
    """A panel for each metal: its flow curve, and true stress in each way of its row on bodies that it was not fitted to."""
    rows = []
    with figures.plt.rc_context(figures.LOOK):
        columns = 3
        lines = -(-len(METALS) // columns)
        figure, axes = figures.plt.subplots(lines, columns, figsize=(13.0, 3.9 * lines), squeeze=False)
        for axis, (name, metal) in zip(axes.flat, METALS.items()):
            targets = targets_of(metal)
            true = np.linspace(0.0, 0.51, 200)
            curve = targets.curve.true_stress(true, metal.modulus) / MPA
            axis.plot(100.0 * true, curve, color="black", linewidth=1.2, label="flow curve")
            rows += [(name, "flow curve", f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(true, curve)]
            for k, (way, run) in enumerate({**results[name][OTHER], "shear": more[name]["shear"]}.items(), start=1):
                strain, stress = (values[run.true_curve()[0] <= true[-1]] for values in run.true_curve())
                axis.plot(100.0 * strain, stress / MPA, label=f"evp/lj, {way}", **figures.line_style(k))
                rows += [(name, way, f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress / MPA)]
            axis.set(title=metal.title, xlim=(0, None), xlabel="true strain [%]", ylim=(0, None))
        for axis in axes[:, 0]:
            axis.set_ylabel("true stress [MPa]")
        for axis in axes.flat[len(METALS):]:
            axis.axis("off")
        figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="lower center", ncol=4)
        figure.tight_layout(rect=(0.0, 0.03, 1.0, 1.0))
        study.save(figure, ("metal", "curve", "true_strain_percent", "true_stress_MPa"), rows)


def departures(targets, runs, found):
    """{what: (departure, limit)} of a row on a body: runs as of loaded(), found as of further(), or None."""
    off, told = targets.residuals(runs), {}
    for way, own in off.items():
        for what, value in own.items():
            told[way, what] = value, calibration.limit_of(what)
    for strain, limit in ALIKE.items():
        if all(strain in off.get(way, {}) for way in WAYS):
            tension, compression = (1.0 + off[way][strain] for way in WAYS)
            told["compression over tension", strain] = compression / tension - 1.0, limit
    if found:
        told["shear yield stress"] = MISES * found["shear yield"] / runs["tension"].offset_yield - 1.0, SHEAR_YIELD
        for strain in SHEAR_STRAINS:
            value = float(found["shear"].true_at(strain / MISES) / targets.curve.at(strain / MISES)) - 1.0
            told["shear", strain] = value, calibration.limit_of(strain)
        told["springback"] = found["recovered"] - found["elastic"], SPRINGBACK
    return told


def cell(told, what):
    """A departure [%], bold where it is beyond its limit; empty where there is none."""
    if what not in told:
        return ""
    value, limit = told[what]
    text = f"{100.0 * value:+.{2 if what == 'springback' else 1}f}" if np.isfinite(value) else "-"
    return text if abs(value) <= limit else f"**{text}**"


def sentence(what, values):
    """What is missed, of (departure, limit) of all rows and bodies; empty where nothing is."""
    missed = [value for value, limit in values if not abs(value) <= limit]
    if not missed:
        return ""
    name = what if isinstance(what, str) else f"{what[0]} {calibration.name_of(what[1])}"
    digits = 2 if what == "springback" else 1
    return (f"- {name[0].upper()}{name[1:]}: {len(missed)} of {len(values)} are off by more than "
            f"{100.0 * values[0][1]:g} %, from {100.0 * min(missed):+.{digits}f} to {100.0 * max(missed):+.{digits}f} %.")


def page(results, more):
    """Values of the page, of {name: {(spheres, seed): {way: Run}}} and {name: as of further()}."""
    elastic, stresses, shear, every, large = [], [], [], {}, []
    for name, bodies in results.items():
        for body, runs in bodies.items():
            told = departures(targets_of(METALS[name]), runs, more[name] if body == OTHER else None)
            for what, value in told.items() if body != STOCKY else ():
                every.setdefault(what, []).append(value)
            if body == LARGE:
                large += [any(not abs(value) <= limit for what, (value, limit) in told.items() if what[0] in WAYS)]
            alike = [cell(told, ("compression over tension", strain)) for strain in ALIKE]
            of_elastic = [cell(told, ("elastic", what)) for what in ("E", "nu")]
            size = (body.spheres, body.seed, f"{2e3 * body.radius:g}")
            elastic.append((name, *size, *of_elastic, *alike, cell(told, "springback")))
            stresses += [(name, *size, way, *(cell(told, (way, what)) for what in (YIELD, *STRAINS))) for way in WAYS]
            if body == OTHER:
                shear.append((name, *(cell(told, what) for what in ("shear yield stress", *(("shear", strain) for strain in SHEAR_STRAINS)))))
    sources = [f"- {name}: E {metal.modulus / 1e9:g} GPa, nu {metal.poisson:g}, {metal.density:g} kg/m3, true stress {metal.law[0] / MPA:.4g} + {metal.law[1] / MPA:.4g} ep^{metal.law[2]:.3g} MPa. "
               f"{metal.source}. Heat: {metal.heat}; {metal.heat_source}." for name, metal in METALS.items()]
    percents, missed = [f"{100.0 * strain:g} %" for strain in STRAINS], filter(None, (sentence(*one) for one in every.items()))
    if large:
        missed = [*missed, f"- On {LARGE.spheres} spheres {sum(large)} of {len(large)} rows are beyond a limit of stress in tension or compression."]
    alike = [f"at {100.0 * strain:g} %" for strain in ALIKE]
    turning = {}
    for thin, of in ((True, ""), (False, ", bonds that do not thin")):
        tension, compression = ({strain: turned_in(way, strain, thin) for strain in STRAINS if strain <= abs(end) + 1e-9} for way, end in WAYS.items())
        turning |= {f"tension{of}": tension, f"compression{of}": compression, f"compression over tension{of}": {at: (1.0 + compression[at]) / (1.0 + tension[at]) - 1.0 for at in tension}}
    shear.append(("*bonds that turn*", f"{100.0 * turned_in(calibration.SHEARED, 0.0):+.1f}", *(f"{100.0 * turned_in(calibration.SHEARED, strain):+.1f}" for strain in SHEAR_STRAINS)))
    return {"count": len(results), "spheres": SPHERES, "softer": f"{100.0 * softer(PRESSED):.0f}", "farther": f"{100.0 / (1.0 - softer(PRESSED)) - 100.0:.0f}",
            "length": f"{1e3 * calibration.LENGTH:g}", "width": f"{2e3 * calibration.RADIUS:g}", "stocky": STOCKY_METAL,
            "turning": (("bonds that turn", *percents), [(way, *(f"{100.0 * values[strain]:+.1f}" if strain in values else "" for strain in STRAINS)) for way, values in turning.items()]),
            "sources": "\n".join(sources), "missed": "\n".join(missed),
            "elastic": (("row", "spheres", "seed", "width [mm]", "E", "nu", *alike, "springback"), elastic),
            "stresses": (("row", "spheres", "seed", "width [mm]", "", YIELD, *percents), stresses),
            "shear": (("row", YIELD, *(f"{strain:g}" for strain in SHEAR_STRAINS)), shear)}


def main(words=None):
    with Study(__doc__, "metals", only=list(METALS), large=list(METALS), ranks=2).started(words) as study:
        results, more = {}, {}
        for name in study.each(METALS):
            bodies = (OTHER, *([LARGE] if name in study.large else []), *([STOCKY] if name == STOCKY_METAL else []))
            results[name] = {body: loaded(name, body, study) for body in bodies}
            more[name] = further(name, study)
        head, *blocks = POTENTIALS.read_text(encoding="utf-8").strip().split("\n\n")
        rows, stood = [], {block.splitlines()[-1].split()[0]: block for block in blocks}
        for name, metal in METALS.items():
            if not (study.work / f"{name}.evp").exists():
                rows += ["", *stood[name].splitlines()]
                continue
            mark, rest = (study.work / f"{name}.evp").read_text(encoding="utf-8").partition(f"# {name}:")[1:]
            lines = (mark + rest).splitlines()
            rows += ["", lines[0], f"#   source: {metal.title}: {metal.source}", f"#   heat: {metal.heat_source}", *lines[1:-1], f"{lines[-1]} {metal.heat}"]
        rows += [line for name, block in stood.items() if name not in METALS for line in ("", *block.splitlines())]
        POTENTIALS.write_text("\n".join([head, *rows, ""]), encoding="utf-8")
        draw(study, results, more)
        study.write(**page(results, more))


if __name__ == "__main__":
    main()
