#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Calibrates the metals of potentials/metals.evp and writes doc/metals.md: how far each row is from its flow curve, on other bodies.

  metals.py                      everything; runs that --work has already are not repeated
  metals.py --only steel_4340    calibrates these only, unless --work has their rows; the rows of others stay; none: all stay

tools/calibrate.py makes each row. On two periodic bodies of other seeds it is then pulled, pressed and sheared, and its moduli are measured; on one of them also pressed on all sides and
turned. Writes the potential file, the page, and figures/metals.png with its CSV. About half an hour on two cores.
"""

import csv
import json
from typing import NamedTuple

from study import CHECKOUT, RunError, Study
import calibrate
import numpy as np
import scipy.optimize
from evp import calibration, curves, figures, flow
from evp.calibration import MISES, SHEAR_STRAINS, SHEARED, STRAINS, WAYS, YIELD, Moduli, Run, Targets
from evp.curves import YIELD_OFFSET

MPA = 1e6
POTENTIALS = CHECKOUT / "potentials" / "metals.evp"
SEED, OTHERS = 1, (2, 3)  # of the body that a row was found on, and of others
SQUEEZED = 0.02  # volume strain to which a body is pressed on all sides, and turned
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

JOHNSON_COOK = "Johnson and Cook, Engineering Fracture Mechanics 21 (1985) 31"
# Of rows NAME_failing, which go on with it: words of the row, and where they are from. D4 is left out, as these rows have no rate.
FAILURE = {
    "aluminium_2024T351": ("damage 0.13 0.13 -1.5 0 0 rupture energy 14000",
                           "D1 to D3: Johnson and Holmquist, LA-11463-MS, 1989 (D4 0.011, D5 0); toughness: K_IC of 34 MPa m^0.5, typical of plate, as K_IC^2 (1 - nu^2)/E"),
    "steel_4340": ("damage 0.05 3.44 -2.12 0 0.61 rupture 0", f"{JOHNSON_COOK} (D4 0.002), D = 1 at initiation"),
    "copper_OFHC": ("damage 0.54 4.89 -3.03 0 1.12 rupture 0", f"{JOHNSON_COOK} (D4 0.014), D = 1 at initiation"),
}


def failing_rows(lines):
    """Blocks of the rows NAME_failing, of the lines of the others."""
    rows = dict(line.split(" ", 1) for line in lines if line and not line.startswith("#"))
    return [line for name, (words, source) in FAILURE.items()
            for line in ("", f"# {name}_failing: {name} that fails", f"#   source: {source}", f"{name}_failing {rows[name]} {words}")]


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
    calibrate.main([*METALS[name].words, "--name", name, "--out", str(out), "--seed", str(SEED), "--ranks", str(study.ranks)])  # a miss is told by the page
    if not out.exists():
        raise RunError(f"no row for {name}")
    return f"{out}:{name}"


def loaded(name, seed, study):
    """(Moduli, {way: Run}) of a row on a periodic body that it was not found on; kept in --work."""
    kept, targets = study.work / f"{name}_{seed}.json", targets_of(METALS[name])
    if not kept.exists():
        row = calibrated(name, study)
        body = calibration.make_body(study.work, calibration.SPHERES, seed, targets.density)
        material = {"specimen": body.path.name, "material": row}
        moduli = calibration.moduli_of(material, study.work, f"{name}, seed {seed}, moduli")
        runs = calibration.loads(material, targets, body, study.work, study.ranks, f"{name}, seed {seed}")
        kept.write_text(json.dumps({"moduli": moduli, "runs": {way: [run.strain.tolist(), run.stress.tolist()] for way, run in runs.items()}}), encoding="utf-8")
    found = json.loads(kept.read_text(encoding="utf-8"))
    return Moduli(*found["moduli"]), {way: Run(*map(np.array, run)) for way, run in found["runs"].items()}


class Squeezed(NamedTuple):
    """volume strains (compression positive), pressures [Pa] and mean plastic strains on the way to SQUEEZED and back."""

    strain: np.ndarray
    pressure: np.ndarray
    plastic: np.ndarray


def squeezed(name, study):
    """Squeezed of a row, the body of the first of OTHERS pressed alike on all sides; kept in --work."""
    kept, targets = study.work / f"{name}_squeezed.csv", targets_of(METALS[name])
    if not kept.exists():
        body = calibration.make_body(study.work, calibration.SPHERES, OTHERS[0], targets.density)
        variables = {"specimen": body.path.name, "material": calibrated(name, study), "contact": "join", "strain": SQUEEZED, "rate": f"{calibration.rate_of(targets, body, 0.02):.6g}",
                     "out": "squeezed"}
        calibration.call(str(CHECKOUT / "doc" / "studies" / "in.squeezed"), variables, 1, study.work, f"{name}, pressed on all sides")
        (study.work / "squeezed.csv").replace(kept)
    with open(kept, encoding="utf-8") as table:
        rows = [[float(row[key]) for key in ("volume_strain", "pressure", "plastic_strain")] for row in csv.DictReader(table)]
    return Squeezed(*np.array(rows).T)


def shear_yield(curve):
    """0.2 % offset yield stress [Pa] of a Curve of simple shear, at the plastic strain of that in tension (von Mises)."""
    strain, stress = curve.strain / MISES, curve.virial * MISES
    return curves.yield_stress(strain, stress, curves.modulus(strain, stress)) / MISES


def draw(study, results):
    """A panel for each metal: its flow curve, and true stress in each way of its row on the bodies that it was not found on."""
    rows = []
    with figures.plt.rc_context(figures.LOOK):
        columns = 3
        lines = -(-len(METALS) // columns)
        figure, axes = figures.plt.subplots(lines, columns, figsize=(13.0, 3.9 * lines), squeeze=False)
        for axis, (name, metal) in zip(axes.flat, METALS.items()):
            targets = targets_of(metal)
            true = np.linspace(0.0, abs(WAYS["compression"]), 300)
            curve = targets.curve.true_stress(true, metal.modulus) / MPA
            axis.plot(100.0 * true, curve, color="black", linewidth=1.2, label="flow curve")
            rows += [(name, "flow curve", f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(true, curve)]
            for k, (way, run) in enumerate(results[name][OTHERS[0]][1].items(), start=1):
                strain, stress = (run.strain / MISES, run.stress * MISES) if way == SHEARED else run
                near = strain <= true[-1]
                axis.plot(100.0 * strain[near], stress[near] / MPA, label=f"evp/lj, {way}", **figures.line_style(k))
                rows += [(name, way, f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(strain[near], stress[near] / MPA)]
            axis.set(title=metal.title, xlim=(0, None), xlabel="true strain [%]", ylim=(0, None))
        for axis in axes[:, 0]:
            axis.set_ylabel("true stress [MPa]")
        for axis in axes.flat[len(METALS):]:
            axis.axis("off")
        figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="lower center", ncol=4)
        figure.tight_layout(rect=(0.0, 0.03, 1.0, 1.0))
        study.save(figure, ("metal", "curve", "true_strain_percent", "true_stress_MPa"), rows)


def cell(off, way, what):
    """A departure [%], bold where it is beyond its limit; empty where there is none."""
    if what not in off.get(way, {}):
        return ""
    value = off[way][what]
    text = f"{100.0 * value:+.1f}" if np.isfinite(value) else "-"
    return text if abs(value) <= calibration.limit_of(way, what) else f"**{text}**"


def sentence(way, what, values):
    """What is missed, of the departures of all rows and bodies; empty where nothing is."""
    limit = calibration.limit_of(way, what)
    missed = [value for value in values if not abs(value) <= limit]
    if not missed:
        return ""
    return f"- {way}, {calibration.name_of(what)}: {len(missed)} of {len(values)} are off by more than {100.0 * limit:g} %, from {100.0 * min(missed):+.1f} to {100.0 * max(missed):+.1f} %."


def pressure_row(name, found):
    """A row of the table of bodies pressed on all sides."""
    metal, turn = METALS[name], int(np.argmax(found.strain))
    bulk = metal.modulus / (3.0 * (1.0 - 2.0 * metal.poisson))
    there = [100.0 * (float(np.interp(at, found.strain[:turn], found.pressure[:turn])) / (bulk * at) - 1.0) for at in (0.002, 0.005, 0.01, 0.0199)]
    back = np.flatnonzero(found.pressure[turn:] <= 0.0)
    left = f"{100.0 * found.strain[turn + back[0]]:.2f}" if len(back) else "-"
    flow_stress = float(targets_of(metal).curve.at(YIELD_OFFSET))
    return (name, f"{found.pressure.max() / flow_stress:.0f}", *(f"{value:+.0f}" for value in there), left, f"{found.plastic[turn]:.1e}")


def page(results, pressed):
    """Values of the page, of {name: {seed: (Moduli, {way: Run})}} and {name: Squeezed}."""
    elastic, stresses, shear, every = [], [], [], {}
    for name, bodies in results.items():
        for seed, (moduli, runs) in bodies.items():
            off = targets_of(METALS[name]).residuals(moduli, runs)
            for way, own in off.items():
                for what, value in own.items():
                    every.setdefault((way, what), []).append(value)
            elastic.append((name, seed, *(cell(off, "elastic", what) for what in ("E", "nu"))))
            stresses += [(name, seed, way, *(cell(off, way, what) for what in (YIELD, *STRAINS))) for way in WAYS]
            shear.append((name, seed, *(cell(off, SHEARED, strain) for strain in SHEAR_STRAINS)))
    sources = [f"- {name}: E {metal.modulus / 1e9:g} GPa, nu {metal.poisson:g}, {metal.density:g} kg/m3, true stress {metal.law[0] / MPA:.4g} + {metal.law[1] / MPA:.4g} ep^{metal.law[2]:.3g} MPa. "
               f"{metal.source}. Heat: {metal.heat}; {metal.heat_source}." for name, metal in METALS.items()]
    missed = list(filter(None, (sentence(*what, values) for what, values in every.items())))
    return {"count": len(results), "spheres": calibration.SPHERES, "seed": SEED, "squeezed": f"{100.0 * SQUEEZED:g}",
            "sources": "\n".join(sources), "missed": "\n".join(missed or ["Nothing is."]),
            "elastic": (("row", "seed", "E", "nu"), elastic),
            "stresses": (("row", "seed", "", YIELD, *(f"{100.0 * strain:g} %" for strain in STRAINS)), stresses),
            "shear": (("row", "seed", *(f"{strain:g}" for strain in SHEAR_STRAINS)), shear),
            "pressed": (("row", "largest pressure over the yield stress", "at 0.2 %", "0.5 %", "1 %", "2 %", "no pressure at [%]", "p at 2 %"),
                        [pressure_row(name, found) for name, found in pressed.items()])}


def main(words=None):
    with Study(__doc__, "metals", only=list(METALS), ranks=2).started(words) as study:
        results, pressed = {}, {}
        for name in study.each(METALS):
            results[name] = {seed: loaded(name, seed, study) for seed in OTHERS}
            pressed[name] = squeezed(name, study)
        head, *blocks = POTENTIALS.read_text(encoding="utf-8").strip().split("\n\n")
        rows, stood = [], {block.splitlines()[-1].split()[0]: block for block in blocks}
        for name, metal in METALS.items():
            if not (study.work / f"{name}.evp").exists():
                rows += ["", *stood[name].splitlines()]
                continue
            mark, rest = (study.work / f"{name}.evp").read_text(encoding="utf-8").partition(f"# {name}:")[1:]
            lines = (mark + rest).splitlines()
            rows += ["", lines[0], f"#   source: {metal.title}: {metal.source}", f"#   heat: {metal.heat_source}", *lines[1:-1], f"{lines[-1]} {metal.heat}"]
        rows += failing_rows(rows)
        POTENTIALS.write_text("\n".join([head, *rows, ""]), encoding="utf-8")
        draw(study, results)
        study.write(**page(results, pressed))


if __name__ == "__main__":
    main()
