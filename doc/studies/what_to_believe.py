#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What a metal of spheres does beside handbook and closed form: tension, compression, shear, release, a cube, imprints, the Taylor bar.

tools/calibrate.py makes the row of a 304 steel; bodies are others than the one it was found on. About 30 minutes on two cores.
"""

import re
import sys

from study import CHECKOUT, Study
import numpy as np
from evp import curves, dump, specimen

STEEL = {"E": 193e9, "yield": 240e6, "stress": (400e6, 0.05), "nu": 0.29, "density": 7900.0}  # the usual values of annealed 304, nominal
ALUMINIUM = {"E": 73e9, "nu": 0.33}  # 2024-T351, of the row below
METALS = CHECKOUT / "potentials" / "metals.evp"
COPPER = f"{METALS}:copper_taylor"
LENGTH, FOOT = 0.0214, 0.0071  # [m] of the Taylor bar of 32.4 x 6.4 mm at 227 m/s, foot radius; the usual benchmark
BALL, DEPTH, PLASTIC = 0.015, 0.1, 0.08  # radius [m], depth over it; plastic strain of the flow stress beside the hardness (Tabor)
BRACKET = """region whole block 0 0.06 -0.018 0.018 -0.008 0.008
region rest block 0.01 INF -0.008 INF INF INF side out
region body intersect 2 whole rest
"""  # legs of 60 and 36 mm, 10 mm thick, 16 mm wide
STRAINS, ENDS = (0.02, 0.05, 0.1), (0.03, 0.1, -0.1, -0.2, -0.4)


def material(study):
    """FILE:ROW of the steel."""
    path = study.runs.folder / "steel.evp"
    words = ["--E", STEEL["E"], "--yield", STEEL["yield"], "--stress", "{:g}@{:g}".format(*STEEL["stress"]), "--nu", STEEL["nu"], "--density", STEEL["density"]]
    if not path.exists():
        study.runs.keep("calibration", [sys.executable, CHECKOUT / "tools" / "calibrate.py", *words, "--name", "steel_304", "--out", path])
    return f"{path}:steel_304"


def pulled(study, name, body, row, strain, increment=0.002, **more):
    """The Curve of in.quasistatic, over the strain of the middle; that of the grips goes there and back."""
    study.runs.run("in.quasistatic", name, specimen=body, material=row, strain=strain, increment=increment, **more)
    return curves.read_curve(study.runs.folder / f"{name}.csv", strain="strain_gauge")


def true_stress(curve, strain):
    """[Pa] at a nominal strain, on the way there; flow keeps the volume."""
    way, stress, _ = curves.first_way(curve.strain, curve.virial)
    return np.interp(abs(strain), way, stress) * (1.0 + strain)


def sheared(study, row):
    """Rows of simple shear of a periodic body."""
    body = study.runs.body("periodic", n=1000, shape="periodic", length=0.03)
    study.runs.run("in.shear", "sheared", specimen=body, material=row, strain=0.01, row=0.0002, rate=20)
    curve = curves.read_curve(study.runs.folder / "sheared.csv")
    modulus = curves.modulus(curve.strain, curve.virial)
    first = curves.yield_stress(curve.strain, curve.virial, modulus)
    return [("shear modulus [GPa]", f"{modulus / 1e9:.1f}", f"{STEEL['E'] / 2e9 / (1.0 + STEEL['nu']):.1f}", "E/(2 (1 + nu))"),
            ("0.2 % yield stress over that of tension", f"{first / STEEL['yield']:.3f}", f"{3.0 ** -0.5:.3f}", "von Mises")]


def imprint(study, name, metal, row, spheres, tension):
    """Cells of an indentation: flow stress (true, at the plastic strain beside the hardness), contact radius in diameters, hardness over flow stress, recovery over that of Hertz."""
    flow_stress = true_stress(tension, np.expm1(PLASTIC + true_stress(tension, PLASTIC) / metal["E"]))
    body = study.runs.body(f"plate_{spheres}", n=spheres, shape="block", length=0.02, width=0.05, height=0.05)
    text = study.runs.run("in.indent", f"{name}_{spheres}", specimen=body, material=row, tool_radius=BALL, depth=DEPTH * BALL)
    force, radius, diameters, hardness, left = map(float, re.search(
        r"a force of (\S+) N, a contact radius of (\S+) m = (\S+) diameters of a sphere, a hardness of (\S+) MPa; released: .*, (\S+) % of the depth", text).groups())
    hertz = 0.75 * force * (1.0 - metal["nu"] ** 2) / (metal["E"] * radius) / (DEPTH * BALL)
    return [name, spheres, f"{diameters:.2f}", f"{flow_stress / 1e6:.0f}", f"{hardness:.0f}", f"{1e6 * hardness / flow_stress:.2f}",
            f"{left:.1f}", f"{100.0 - left:.1f}", f"{(1.0 - 0.01 * left) / hertz:.2f}"]


def taylor(study, spheres):
    """Cells of the bar."""
    body = study.runs.body(f"bar_{spheres}", n=spheres, length=0.0324, radius=0.0032, density=8930)
    text = study.runs.run("in.taylor", f"taylor_{spheres}", specimen=body, material=COPPER, speed=227)
    outer, length, foot = map(float, re.search(r"outermost sphere of the foot (\S+) m.*\nfinal length (\S+) m, foot radius (\S+) m", text).groups())
    return [spheres, f"{1e3 * length:.2f}", f"{100 * (length / LENGTH - 1):+.1f}", f"{1e3 * foot:.2f}", f"{100 * (foot / FOOT - 1):+.1f}", f"{1e3 * outer:.2f}"]


def main(words=None):
    with Study(__doc__, "what_to_believe", spheres=2000, plates=[4000, 16000], bars=[2000, 8000]).started(words) as study:
        row, body = material(study), study.runs.body("other", n=study.spheres, seed=2)
        tension, compression = (pulled(study, name, body, row, sign * STRAINS[-1], cycles=1, lower="release") for name, sign in (("tension", 1), ("compression", -1)))
        far = {name: pulled(study, f"{name}_far", body, row, strain, 0.004) for name, strain in (("tension", 0.2), ("compression", -0.4))}
        cube = study.runs.body("cube", n=study.spheres, shape="block", length=0.02, width=0.02, height=0.02)
        pressed = pulled(study, "cube_pressed", cube, row, -0.2, 0.004, cycles=1, lower="release")
        (study.runs.folder / "bracket.region").write_text(BRACKET, encoding="utf-8")
        bracket = study.runs.body("bracket", n=study.spheres, shape="region", region="bracket.region", length=0.06, width=0.038, height=0.018)
        bent = pulled(study, "bracket_pulled", bracket, row, 0.03, 0.001, cycles=1, lower="release")
        ratios = [(f"{100 * e:g} %", *(f"{true_stress(curve, s) / 1e6:.0f}" for curve, s in ((tension, e), (compression, -e))),
                   f"{true_stress(compression, -e) / true_stress(tension, e):.3f}") for e in STRAINS]
        volumes = []
        for strain in ENDS:
            pulled(study, f"volume{strain}", body, row, strain, 0.004)
            places = dump.last_positions(study.runs.folder / f"volume{strain}_state.dump")
            axial, lateral = specimen.middle_strains(specimen.read_data(study.runs.folder / body), places, 0.05)
            volumes.append((f"{100 * strain:+g} %", f"{100 * ((1.0 + axial) * (1.0 + lateral) ** 2 - 1.0):+.2f}"))  # of the middle
        turned = {"tension to 10 %": tension, "compression to 10 %": compression, "cube pressed by 20 %": pressed, "L-bracket pulled along its long leg": bent}
        left = {name: curves.cycle_numbers(curve) for name, curve in turned.items()}
        released = [(name, f"{100 * one['turn_strain']:.2f}", f"{one['turn_MPa']:.0f}", f"{100 * one['residual_strain']:.3f}",
                     f"{100 * one['turn_MPa'] * 1e6 / STEEL['E']:.3f}", f"{100 * (one['turn_strain'] - one['residual_strain']):.3f}") for name, one in left.items()]
        alloy = f"{METALS}:aluminium_2024T351"
        indented = [("304", STEEL, row, tension), ("2024-T351", ALUMINIUM, alloy, pulled(study, "alloy", body, alloy, STRAINS[-1]))]
        imprints = [imprint(study, name, metal, own, spheres, curve) for spheres in
                    study.each(study.plates, lambda n: f"plates of {n}", lambda n: n**1.3) for name, metal, own, curve in indented]
        bars = [taylor(study, spheres) for spheres in study.each(study.bars, lambda n: f"bar of {n}", lambda n: n**1.3)]
        study.draw({name: (100.0 * np.abs(np.log1p(curve.strain)), np.abs(curve.virial) * (1.0 + curve.strain) / 1e6) for name, curve in far.items()},
                   ("curve", "strain_percent", "stress_MPa"), xlabel="true strain [%]", ylabel="true stress [MPa]", ylim=(0, None))
        study.write(spheres=study.spheres, shear=(("", "measured", "of a metal", ""), sheared(study, row)),
                    ratios=(("strain", "tension [MPa]", "compression [MPa]", "compression over tension"), ratios),
                    released=(("load", "strain [%]", "stress [MPa]", "strain left [%]", "stress/E [%]", "sprang back [%]"), released),
                    volumes=(("strain", "volume [%]"), volumes),
                    imprints=(("metal", "N", "contact radius [diameters]", "flow stress [MPa]", "hardness [MPa]", "over the flow stress",
                              "imprint [% of the depth]", "recovery [%]", "over Hertz"), imprints),
                    bars=(("N", "length [mm]", "off [%]", "foot radius [mm]", "off [%]", "outermost sphere [mm]"), bars))


if __name__ == "__main__":
    main()
