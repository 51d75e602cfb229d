#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What a metal of spheres does beside its flow curve and closed forms: tension, compression, upsetting, V-bending, extrusion, shear, release, volume, imprints, the Taylor bar.

Rows of potentials/metals.evp; bodies are others than those they were found on. About 15 minutes on one core.
"""

import re

from study import CHECKOUT, Study
import numpy as np
from evp import calibration, curves, dump, specimen
from evp.calibration import MISES
from metals import METALS, shear_yield, targets_of

POTENTIALS = CHECKOUT / "potentials" / "metals.evp"
STEEL, ALUMINIUM = "steel_304", "aluminium_2024T351"
COPPER = f"{POTENTIALS}:copper_taylor"
LENGTH, FOOT = 0.0214, 0.0071  # [m] of the Taylor bar of 32.4 x 6.4 mm at 227 m/s, foot radius; the usual benchmark
BALL, DEPTH, PLASTIC = 0.015, 0.1, 0.08  # radius [m], depth over it; plastic strain of the flow stress beside the hardness (Tabor)
BRACKET = """region whole block 0 0.06 -0.018 0.018 -0.008 0.008
region rest block 0.01 INF -0.008 INF INF INF side out
region body intersect 2 whole rest
"""  # legs of 60 and 36 mm, 10 mm thick, 16 mm wide
STRAINS, ENDS, FAR = (0.02, 0.05, 0.1), (0.03, 0.1, 0.2, -0.1, -0.4), {"tension": 0.2, "compression": -0.4}
FRICTION, PRESSED = 0.1, 0.5  # of the upset cylinder
SPAN = 0.8  # of V-bending, over the length, as in.vbend has it
SHEARED, SMOOTH = 4.0, 20  # shear strain with contact join; rows over which its stress is averaged
LIMITS, FIRST, RIGID = (5.0, 10.0, 15.0), 0.02, 0.05  # [%]; strain from which they are asked for, in V-bending and shear, whose closed forms are rigid-plastic


def pulled(study, name, body, row, strain, increment=0.002, **more):
    """The Curve of in.quasistatic, over the strain of the middle; that of the grips goes there and back."""
    study.runs.run("in.quasistatic", name, specimen=body, material=row, strain=strain, increment=increment, **more)
    return curves.read_curve(study.runs.folder / f"{name}.csv", strain="strain_gauge")


def true_stress(curve, strain):
    """[Pa] at a true strain, on the way there; flow keeps the volume."""
    way, stress, _ = curves.first_way(curve.strain, curve.virial)
    return np.interp(abs(np.expm1(strain)), way, stress) * np.exp(strain)


def verdict(operation, beside, strain, off):
    """Row of an operation: the strains up to which it is within each of LIMITS, of its differences [%] at strains."""
    strain, off = (np.atleast_1d(values)[np.atleast_1d(strain) >= FIRST] for values in (strain, off))
    beyond = [np.flatnonzero(np.abs(off) > limit) for limit in LIMITS]
    ends = [strain[-1] if not len(at) else strain[at[0] - 1] if at[0] else None for at in beyond]
    worst = int(np.argmax(np.abs(off)))
    return (operation, beside, *("-" if end is None else f"{end:.2f}" for end in ends), f"{strain[-1]:.2f}", f"{off[worst]:+.1f} at {strain[worst]:.2f}")


def along(curve, targets):
    """(true strains, differences from the flow curve [%]) of a Curve on its first way."""
    way, stress, sign = curves.first_way(curve.strain, curve.virial)
    strain, true = np.abs(np.log1p(sign * way))[1:], (stress * (1.0 + sign * way))[1:]
    return strain, 100.0 * (true / targets.curve.true_stress(strain, targets.modulus) - 1.0)


def sheared(study, row, targets):
    """Rows of simple shear of a periodic body in its elastic part; strains and differences of its stress, with contact join, from that of the flow curve by von Mises [%]."""
    body = study.runs.body("periodic", n=1000, shape="periodic", length=0.03)
    study.runs.run("in.shear", "sheared", specimen=body, material=row, strain=0.01, row=0.0002, rate=20)
    study.runs.run("in.shear", "sheared_far", specimen=body, material=row, strain=SHEARED, row=0.005, rate=200, contact="join", dtfraction=0.7)
    curve, far = (curves.read_curve(study.runs.folder / f"{name}.csv") for name in ("sheared", "sheared_far"))
    modulus = curves.modulus(curve.strain, curve.virial)
    strain, stress = (np.convolve(values[far.strain > RIGID], np.full(SMOOTH, 1.0 / SMOOTH), "valid") for values in (far.strain, far.virial))
    return [("shear modulus [GPa]", f"{modulus / 1e9:.1f}", f"{targets.modulus / 2e9 / (1.0 + targets.nu):.1f}", "E/(2 (1 + nu))"),
            ("0.2 % yield stress over that of the flow curve in tension", f"{shear_yield(curve) / targets.curve.offset_yield(targets.modulus):.3f}", f"{1.0 / MISES:.3f}", "von Mises")], \
        strain, 100.0 * (stress * MISES / targets.curve.true_stress(strain / MISES, targets.modulus) - 1.0)


def upset(study, row, targets, contact):
    """Strains, and differences [%] of the force on an upset cylinder from the slab method: flow stress times the area times 1 + mu d/(3 h)."""
    length, radius = 0.03, 0.01
    body = study.runs.body("billet", n=study.spheres, length=length, radius=radius, density=targets.density)
    name = f"upset_{contact}"
    study.runs.run("in.upset", name, specimen=body, material=row, friction=FRICTION, strain=PRESSED, speed=5, contact=contact)
    read = study.runs.curve(name, "strain", "force_upper")
    kept = read["strain"] > FIRST
    height, force = 1.0 - read["strain"][kept], read["force_upper"][kept]
    wide = 2.0 * radius / np.sqrt(height)
    slab = targets.curve.true_stress(-np.log(height), targets.modulus) * np.pi * wide**2 / 4.0 * (1.0 + FRICTION * wide / (3.0 * length * height))
    return -np.log(height), 100.0 * (force / slab - 1.0)


def vbend(study, row, targets):
    """[degrees] bent and sprung back; strains of the outer fibre, angle/2, and differences [%] of the force of V-bending from that of a plastic hinge as long as the sheet is thick."""
    length = 0.06
    body = study.runs.body("sheet", n=study.spheres, shape="block", length=length, width=0.02, height=0.008)
    text = study.runs.run("in.vbend", "vbend", specimen=body, material=row, travel=0.008)
    bent, left, hinge = map(float, re.search(r"bent by (\S+) degrees, released (\S+) are left; a plastic hinge takes (\S+) N", text).groups())
    read, fibre = study.runs.curve("vbend", "travel", "force_punch"), np.linspace(0.005, 0.995, 100)  # distance from the middle, over its largest
    strain = np.arctan(read["travel"] / (0.5 * SPAN * length))
    strain, force = (values[strain > RIGID] for values in (strain, read["force_punch"]))
    mean = np.array([2.0 * np.mean(fibre * targets.curve.at(most * fibre)) for most in strain])
    return bent, bent - left, strain, 100.0 * (1e6 * force / hinge / mean - 1.0)


def extrude(study, row, targets):
    """ln ratio, and difference [%] of the ram's pressure, with contact join and without friction, from Johnson's mean flow stress times 0.8 + 1.2 ln ratio."""
    body = study.runs.body("rod", n=study.spheres, length=0.03, radius=0.01, density=targets.density)
    text = study.runs.run("in.extrude", "extrude", specimen=body, material=row, speed=10, friction=0, contact="join")
    pressure, ideal = map(float, re.search(r"ram pressure (\S+) MPa .*, ln ratio is (\S+)", text).groups())
    mean = np.mean(targets.curve.at(np.linspace(0.0, ideal, 1000)))
    return ideal, 100.0 * (1e6 * pressure / mean / (0.8 + 1.2 * ideal) - 1.0)


def imprint(study, name, metal, row, spheres, tension):
    """Cells of an indentation: flow stress (true, at the plastic strain beside the hardness), contact radius in diameters, hardness over flow stress, recovery over that of Hertz."""
    flow_stress = true_stress(tension, PLASTIC + true_stress(tension, PLASTIC) / metal.modulus)
    body = study.runs.body(f"plate_{spheres}", n=spheres, shape="block", length=0.02, width=0.05, height=0.05)
    text = study.runs.run("in.indent", f"{name}_{spheres}", specimen=body, material=row, tool_radius=BALL, depth=DEPTH * BALL)
    force, radius, diameters, hardness, left = map(float, re.search(
        r"a force of (\S+) N, a contact radius of (\S+) m = (\S+) diameters of a sphere, a hardness of (\S+) MPa; released: .*, (\S+) % of the depth", text).groups())
    hertz = 0.75 * force * (1.0 - metal.nu**2) / (metal.modulus * radius) / (DEPTH * BALL)
    return [name, spheres, f"{diameters:.2f}", f"{flow_stress / 1e6:.0f}", f"{hardness:.0f}", f"{1e6 * hardness / flow_stress:.2f}",
            f"{left:.1f}", f"{100.0 - left:.1f}", f"{(1.0 - 0.01 * left) / hertz:.2f}"]


def taylor(study, spheres, contact):
    """Cells of the bar."""
    body = study.runs.body(f"bar_{spheres}", n=spheres, length=0.0324, radius=0.0032, density=8930)
    text = study.runs.run("in.taylor", f"taylor_{contact}_{spheres}", specimen=body, material=COPPER, contact=contact, speed=227)
    outer, length, foot = map(float, re.search(r"outermost sphere of the foot (\S+) m.*\nfinal length (\S+) m, foot radius (\S+) m", text).groups())
    return [contact, spheres, f"{1e3 * length:.2f}", f"{100 * (length / LENGTH - 1):+.1f}", f"{1e3 * foot:.2f}", f"{100 * (foot / FOOT - 1):+.1f}", f"{1e3 * outer:.2f}"]


def main(words=None):
    with Study(__doc__, "what_to_believe", spheres=2000, plates=[4000], bars=[2000, 8000]).started(words) as study:
        row, alloy, body = f"{POTENTIALS}:{STEEL}", f"{POTENTIALS}:{ALUMINIUM}", study.runs.body("other", n=study.spheres, seed=2, length=calibration.LENGTH, radius=calibration.RADIUS)
        steel, aluminium = targets_of(METALS[STEEL]), targets_of(METALS[ALUMINIUM])
        ends = {strain: pulled(study, f"to_{strain}", body, row, strain, 0.004) for strain in ENDS}
        far = {name: ends[strain] for name, strain in FAR.items()}
        elastic, *shear = sheared(study, row, steel)
        bent, sprang, *bending = vbend(study, row, steel)
        verdicts = [*(verdict(name, "flow curve, true stress", *along(curve, steel)) for name, curve in far.items()),
                    *(verdict(f"upsetting, contact {contact}", f"slab method, friction {FRICTION}", *upset(study, row, steel, contact)) for contact in ("repulsive", "join")),
                    verdict("V-bending", "plastic hinge as long as the sheet is thick", *bending),
                    verdict("extrusion", "mean flow stress (0.8 + 1.2 ln ratio), Johnson", *extrude(study, row, steel)),
                    verdict("shear", "flow curve, von Mises", *shear)]
        tension, compression = (pulled(study, name, body, row, sign * STRAINS[-1], cycles=1, lower="release") for name, sign in (("tension", 1), ("compression", -1)))
        cube = study.runs.body("cube", n=study.spheres, shape="block", length=0.02, width=0.02, height=0.02)
        pressed = pulled(study, "cube_pressed", cube, row, -0.2, 0.004, cycles=1, lower="release")
        (study.runs.folder / "bracket.region").write_text(BRACKET, encoding="utf-8")
        bracket = study.runs.body("bracket", n=study.spheres, shape="region", region="bracket.region", length=0.06, width=0.038, height=0.018)
        pulled_bracket = pulled(study, "bracket_pulled", bracket, row, 0.03, 0.001, cycles=1, lower="release")
        alike = [(f"{100 * e:g} %", *(f"{true_stress(curve, s) / 1e6:.0f}" for curve, s in ((tension, e), (compression, -e))),
                  f"{steel.curve.true_stress(e, steel.modulus)[0] / 1e6:.0f}", f"{true_stress(compression, -e) / true_stress(tension, e):.3f}") for e in STRAINS]
        volumes = []
        for strain in ENDS:
            places = dump.last_positions(study.runs.folder / f"to_{strain}_state.dump")
            axial, lateral = specimen.middle_strains(specimen.read_data(study.runs.folder / body), places, calibration.LENGTH)
            volumes.append((f"{100 * strain:+g} %", f"{100 * ((1.0 + axial) * (1.0 + lateral) ** 2 - 1.0):+.2f}"))  # of the middle
        turned = {"tension to 10 %": tension, "compression to 10 %": compression, "cube pressed by 20 %": pressed, "L-bracket pulled along its long leg": pulled_bracket}
        left = {name: curves.cycle_numbers(curve) for name, curve in turned.items()}
        released = [(name, f"{100 * one['turn_strain']:.2f}", f"{one['turn_MPa']:.0f}", f"{100 * one['residual_strain']:.3f}",
                     f"{100 * one['turn_MPa'] * 1e6 * (1.0 + one['turn_strain']) / steel.modulus:.3f}",
                     f"{100 * (np.log1p(one['turn_strain']) - np.log1p(one['residual_strain'])):.3f}") for name, one in left.items()]
        bars = [taylor(study, spheres, contact) for spheres in study.each(study.bars, lambda n: f"bar of {n}", lambda n: n**1.3) for contact in ("repulsive", "join")]
        indented = [("304", steel, row, tension), ("2024-T351", aluminium, alloy, pulled(study, "alloy", body, alloy, STRAINS[-1]))]
        imprints = [imprint(study, name, metal, own, spheres, curve) for spheres in
                    study.each(study.plates, lambda n: f"plates of {n}", lambda n: n**1.3) for name, metal, own, curve in indented]
        sizes = np.linspace(0.0, 0.5, 100)
        study.draw({"flow curve": (100.0 * sizes, steel.curve.true_stress(sizes, steel.modulus) / 1e6),
                    **{name: (100.0 * np.abs(np.log1p(curve.strain)), np.abs(curve.virial) * (1.0 + curve.strain) / 1e6) for name, curve in far.items()}},
                   ("curve", "strain_percent", "stress_MPa"), xlabel="true strain [%]", ylabel="true stress [MPa]", ylim=(0, None))
        study.write(spheres=study.spheres, shear=(("", "measured", "of a metal", ""), elastic), sheared=f"{SHEARED:g}", first=f"{FIRST:g}", rigid=f"{RIGID:g}",
                    bent=f"{bent:.1f}", sprang=f"{sprang:.2f}",
                    verdicts=(("operation", "compared with", *(f"within {limit:g} % up to" for limit in LIMITS), "measured up to", "largest difference [%]"), verdicts),
                    alike=(("true strain", "tension [MPa]", "compression [MPa]", "flow curve [MPa]", "compression over tension"), alike),
                    released=(("load", "strain [%]", "stress [MPa]", "strain left [%]", "true stress/E [%]", "sprang back, true strain [%]"), released),
                    volumes=(("strain", "volume [%]"), volumes),
                    imprints=(("metal", "N", "contact radius [diameters]", "flow stress [MPa]", "hardness [MPa]", "over the flow stress",
                              "imprint [% of the depth]", "recovery [%]", "over Hertz"), imprints),
                    bars=(("contact", "N", "length [mm]", "off [%]", "foot radius [mm]", "off [%]", "outermost sphere [mm]"), bars))


if __name__ == "__main__":
    main()
