# SPDX-License-Identifier: GPL-2.0-only
"""The numbers of doc/gallery.md, and what they should be.

Numbers are read from the files that the commands of a scene leave in a folder, and from what the commands printed. What they should be
is computed from the same bodies, or is read from the file of another page, or is a benchmark. SI units.
"""

import csv
import math
import re
from typing import NamedTuple

from study import CHECKOUT
import numpy as np
from scipy.spatial import cKDTree

import loads
from evp import curves, figures, law, specimen

TABLE = law.Row(80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 0.0, 1.5)
BENCHMARK = (0.0214, 0.0071)  # final length and foot radius of the Taylor bar [m], README.md of the decks
BALL, FLOW_STRESS = 0.015, 265.0 + 426.0 * 0.08**0.34  # radius [m] of the ball; [MPa] of 2024-T351 at a plastic strain of 8 %, by Johnson and Cook


class Number(NamedTuple):
    """what; value and expected in `unit` ('' for a ratio), expected a number or None; source: where the expectation is from; deck that gives it,
    where it is not that of the scene."""

    what: str
    unit: str
    value: float
    expected: object
    source: str
    deck: str = ""


def body_of(folder, data):
    """{name: number} of DATA.body."""
    text = (folder / f"{data}.body").read_text(encoding="utf-8")
    return {name: float(value) for name, value in re.findall(r"^variable (\w+) (?:index|equal) (\S+)", text, re.M)}


def affine_modulus(bonds, volume, e=TABLE.e1):
    """E [Pa] of so many bonds in a volume [m3], m n e Nb/(6 V), where the strain is affine."""
    return TABLE.m1 * TABLE.n1 * e * bonds / volume / 6.0


def bond_lengths(body, period=None):
    """Distances [m] of the pairs within alpha (R_i + R_j); period (3,): of a periodic box."""
    i, j = cKDTree(body.x if period is None else np.mod(body.x, period), boxsize=period).query_pairs(2 * TABLE.alpha * body.radius.max(), output_type="ndarray").T
    r = body.x[i] - body.x[j]
    d = np.linalg.norm(r if period is None else r - period * np.rint(r / period), axis=1)
    return d[d <= TABLE.alpha * (body.radius[i] + body.radius[j])]


def slope(folder, name, x, y):
    """dy/dx of the first two rows of a curve."""
    curve = figures.read_columns(folder / f"{name}.csv", (x, y))
    return (curve[y][1] - curve[y][0]) / (curve[x][1] - curve[x][0])


def bonds_between(folder, data, low, high):
    """loads.Bonds of a data file whose middle has low < x < high [m]."""
    return loads.find_bonds(specimen.read_data(folder / data), TABLE.alpha, low, high)


def largest_in(page_file, column, curve=None, name=None):
    """Largest value of a column of a CSV file in doc, of the rows whose column `curve` has this name."""
    with open(CHECKOUT / "doc" / page_file, newline="", encoding="utf-8") as source:
        return max(float(row[column]) for row in csv.DictReader(source) if curve is None or row[curve] == name)


def two_spheres(folder, _):
    read = figures.read_columns(folder / "two_spheres.csv", ("strain", "force"))
    return [Number(f"force at a pair strain of {strain:+g}", "N", float(np.interp(strain, read["strain"], read["force"])),
                   float(law.force(0.0102 * (1.0 + strain), 0.0102, TABLE)), "eq. 8: [Howto](Howto_evp.rst)") for strain in (-0.02, 0.02)]


def pull(folder, text):
    slow, fast, rest = (curves.read_curve(folder / f"{name}.csv") for name in ("table1", "table2", "rest"))
    cylinder, volume = specimen.read_data(folder / "cylinder.data"), math.pi * 0.02**2 * 0.05
    deq = bond_lengths(cylinder)
    modulus = affine_modulus(len(deq), volume)
    at_one = [curves.stress_at(curve.strain, curve.virial, 0.01) for curve in (slow, fast, rest)]
    viscous = modulus * 1000.0 * np.mean(deq**2) / (TABLE.m1 * TABLE.n1 * TABLE.e1) * 100.0
    packed, partners = float(re.search(r"solid fraction ([\d.]+)", text)[1]), float(re.search(r"([\d.]+) partners per sphere within 1.5 ", text)[1])
    ours = "affine strain: [pair_style evp/lj](pair_evp_lj.rst)"
    return [Number("solid fraction of 500 spheres", "", packed, 4.0 / 3.0 * math.pi * np.sum(cylinder.radius**3) / volume, "sum over the data file", "in.specimen"),
            Number("partners within 1.5 (R_i + R_j)", "", partners, 2.0 * len(deq) / len(cylinder.radius), "pairs of the data file", "in.specimen"),
            Number("Young's modulus, quasi-static", "GPa", curves.modulus(rest.strain, rest.virial) / 1e9, modulus / 1e9, "m n e1 Nb/(6 V), " + ours, "in.quasistatic"),
            Number("stress at 1 %, Table 1 at 10/s", "MPa", at_one[0] / 1e6, at_one[2] / 1e6, "quasi-static, by in.quasistatic: [accuracy](accuracy_cost.md)"),
            Number("over-stress of Table 2 at 100/s, at 1 %", "MPa", (at_one[1] - at_one[2]) / 1e6, viscous / 1e6, "E tau rate, " + ours)]


def cyclic(folder, _):
    curve = curves.read_curve(folder / "cycles.csv")
    found = curves.cycle_numbers(curve)
    left = found["turn_strain"] - 1e-3 * found["turn_MPa"] / found["unloading_GPa"]
    reversible = curves.cycle_numbers(curves.read_curve(folder / "eq8.csv"))
    return [Number("residual strain after 2 %, *plasticity isotropic*", "%", 100.0 * found["residual_strain"], 100.0 * left,
                   "strain - stress/unloading modulus, at the first turn"),
            Number("residual strain after 2 %, eq. 8", "%", round(100.0 * reversible["residual_strain"], 1) + 0.0, 0.0, "eq. 8 is reversible: [Howto](Howto_evp.rst)"),
            Number("unloading modulus over the first one", "", 1e9 * found["unloading_GPa"] / curves.modulus(curve.strain[:40], curve.virial[:40]), 1.0,
                   "*plasticity isotropic*: [Howto](Howto_evp.rst)")]


def dog_bone(folder, _):
    curve = figures.read_columns(folder / "bone.csv", ("strain_gauge", "stress_virial"))
    body = body_of(folder, "bone.data")
    rest = curves.modulus(curve["strain_gauge"][:5], curve["stress_virial"][:5])
    plain = slope(folder, "bone_row", "strain", "stress_virial")
    return [Number("Young's modulus over the extensometer", "GPa", rest / 1e9, plain / 1e9, "of the same row in the paper's cylinder: [any body](any_body.md)",
                   "in.quasistatic"),
            Number("solid fraction of a part", "", body["solid_fraction"], body_of(folder, "cylinder.data")["solid_fraction"], "of the paper's cylinder")]


def torsion(folder, _):
    modulus = slope(folder, "shaft_pulled", "strain", "stress_grip")
    curve = figures.read_columns(folder / "twisted.csv", ("angle", "torque_grip"))
    share = loads.torsion_share(bonds_between(folder, "shaft.data", 0.015, 0.085), 0.02)
    return [Number("torque at 0.002 rad", "N m", curve["torque_grip"][1], share * loads.torque(modulus, 0.02, 0.08, curve["angle"][1]),
                   "G J/L, G = 0.4 E, times the share of the bonds: [closed forms](closed_form_loads.md)")]


def bending(folder, _):
    modulus = slope(folder, "bar_pulled", "strain", "stress_grip")
    curve = figures.read_columns(folder / "bent.csv", ("strain", "deflection", "force"))
    beam = loads.Beam(modulus, 0.01, 0.02, 0.08)
    share = loads.bending_share(bonds_between(folder, "bar.data", 0.015, 0.085), 0.02)
    deflection = curve["deflection"][1]
    back = curves.residual_strain(curve["strain"], curve["force"])
    turn = int(np.argmax(curve["strain"]))
    elastic = curve["force"][turn] * curve["strain"][1] / curve["force"][1]
    return [Number("force at a strain of 0.0005", "N", curve["force"][1], deflection / beam.deflection(1.0, share),
                   "Timoshenko, with the share of the bonds: [closed forms](closed_form_loads.md)"),
            Number("strain left without force", "%", 100.0 * back, 100.0 * (curve["strain"][turn] - elastic), "strain at the turn - its elastic part")]


def shear(folder, _):
    body = specimen.read_data(folder / "periodic.data")
    bonds = bond_lengths(body, body.box[:, 1] - body.box[:, 0])
    volume = float(np.prod(body.box[:, 1] - body.box[:, 0]))
    scaled = TABLE.e1 * 500 / len(body.radius) * volume / (math.pi * 0.02**2 * 0.05)  # as in.shear does
    curve = figures.read_columns(folder / "sheared.csv", ("strain", "shear_stress"))
    small = figures.read_columns(folder / "shear_elastic.csv", ("strain", "shear_stress"))
    late = small["strain"] > 0.001  # the viscous part is constant by then
    return [Number("shear modulus", "GPa", np.polyfit(small["strain"][late], small["shear_stress"][late], 1)[0] / 1e9,
                   0.4 * affine_modulus(len(bonds), volume, scaled) / 1e9, "0.4 m n e1 Nb/(6 V): [pair_style evp/lj](pair_evp_lj.rst)"),
            Number("largest stress", "MPa", curve["shear_stress"].max() / 1e6, None, "no closed form; larger strains: [large strain](large_strain.md)")]


def notched(folder, _):
    curve = curves.read_curve(folder / "notched.csv")
    return [Number("largest stress of the net section", "MPa", curve.grip.max() / 1e6,
                   largest_in("figures/notched_tension.csv", "stress_MPa", "curve", "N = 4000, XI = 0.05"), "such a bar: [notched tension](notched_tension.md)"),
            Number("bonds broken", "", float(figures.read_columns(folder / "notched.csv", ("broken",))["broken"][-1]), None, "depends on the spacing: [notched tension](notched_tension.md)")]


def sliding(_, text):
    kinds = (("distance to the stop", "mm", "v^2/(2 mu g): [friction](Howto_evp_friction.rst)"), ("time to the stop", "ms", "v/(mu g), likewise"))
    found = re.findall(r"^(?:distance|time) (\S+) .* = (\S+) m?s?, ratio", text, re.M)
    return [Number(what, unit, 1e3 * float(value), 1e3 * float(expected), source) for (what, unit, source), (value, expected) in zip(kinds, found)]


def impact(_, text):
    (depth, speed), (fine_depth, fine_speed), (no_depth, no_speed) = (map(float, found) for found in re.findall(
        r"crater depth (\S+) m, rebound speed (\S+) m/s", text))
    imbalance = float(re.search(r"over impact energy: (\S+)", text)[1])
    return [Number("crater depth at 100 m/s", "mm", 1e3 * depth, 1e3 * fine_depth, "of twice as many spheres, another packing"),
            Number("rebound speed", "m/s", speed, fine_speed, "likewise"),
            Number("crater depth, *plasticity none*", "mm", round(1e3 * no_depth, 3) + 0.0, 0.0, "eq. 8 leaves none, but the plate vibrates"),
            Number("rebound speed, *plasticity none*", "m/s", no_speed, None, "above that with flow; the rest vibrates"),
            Number("energy imbalance over impact energy", "", imbalance, 0.0, "[fix evp/energy](fix_evp_energy.rst)")]


def taylor(_, text):
    length, foot = map(float, re.search(r"final length (\S+) m, foot radius (\S+) m", text).groups())
    return [Number("final length", "mm", 1e3 * length, 1e3 * BENCHMARK[0], "benchmark, copper at 227 m/s: [decks](../lammps_inputs/README.md)"),
            Number("foot radius", "mm", 1e3 * foot, 1e3 * BENCHMARK[1], "likewise; here of the outermost sphere")]


def rod(folder, text):
    body = body_of(folder, "rod.data")
    modulus = slope(folder, "rod_pulled", "strain", "stress_grip")
    sound = math.sqrt(modulus / (body["solid_fraction"] * 2700.0))
    rebound, contact = map(float, re.search(r"rebound speed (\S+) m/s, contact time (\S+) s", text).groups())
    read = figures.read_columns(folder / "rod.csv", ("time", "force"))
    plateau = read["force"][(read["time"] > 0.2 * contact) & (read["time"] < 0.8 * contact)].mean()
    return [Number("contact time", "us", 1e6 * contact, 2e6 * body["length"] / sound, "2 L/c, from E of the same rod; short waves are slower"),
            Number("force of the wall on the way", "N", plateau, math.pi * body["radius"] ** 2 * modulus / sound, "E A v/c"),
            Number("rebound speed", "m/s", rebound, 1.0, "as it came")]


def indent(folder, text):
    diameters, hardness, left = map(float, re.search(r"= (\S+) diameters of a sphere, a hardness of (\S+) MPa; released: .*, (\S+) % of the depth", text).groups())
    read = figures.read_columns(folder / "indented.csv", ("depth", "contact_radius"))
    turn = int(np.argmax(read["depth"]))
    return [Number("contact radius at a depth of 1.5 mm", "mm", 1e3 * read["contact_radius"][turn], 1e3 * math.sqrt(2 * BALL * read["depth"][turn]), "sqrt(2 R h)"),
            Number("hardness", "MPa", hardness, 3.0 * FLOW_STRESS, "Tabor, 3 times the flow stress at 8 %; the more spheres under the ball the nearer"),
            Number("contact radius in diameters of a sphere", "", diameters, 5.0, "at least, for a hardness that is the metal's"),
            Number("imprint over the depth", "%", left, None, "a metal keeps all but stress/E: [what to believe](what_to_believe.md)")]


def upset(folder, text):
    pressed, left, back = map(float, re.search(r"pressed by (\S+) %, released (\S+) % are left; it sprang back by (\S+) %", text).groups())
    read = figures.read_columns(folder / "upset.csv", ("strain", "force_lower", "force_upper", "width_middle", "width_plates"))
    late = read["strain"] > 0.1
    return [Number("force of the lower over that of the upper plate", "", float(np.mean(read["force_lower"][late] / read["force_upper"][late])), 1.0, "slow beside waves"),
            Number("width of the middle at the end", "mm", 1e3 * read["width_middle"][-1], 1e3 * 0.02 / math.sqrt(1.0 - 0.01 * pressed), "at constant volume, without a bulge"),
            Number("strain left", "%", left, pressed, "a metal keeps all but stress/E")]


SCENES = {  # picture on the page: deck, numbers of (folder, printed text)
    "force_law.png": ("in.two_spheres", two_spheres),
    "traction.png": ("in.traction", pull),
    "cyclic.png": ("in.cyclic", cyclic),
    "dog_bone.png": ("tools/body.py", dog_bone),
    "torsion.png": ("in.torsion", torsion),
    "bending.png": ("in.bending", bending),
    "indent.png": ("in.indent", indent),
    "upset.png": ("in.upset", upset),
    "shear.png": ("in.shear", shear),
    "notched.png": ("in.traction", notched),
    "impact.png": ("in.impact", impact),
    "sliding.png": ("in.sliding", sliding),
    "taylor.gif": ("in.taylor", taylor),
    "wall_force.png": ("in.taylor", rod),
}
