# SPDX-License-Identifier: GPL-2.0-only
"""The numbers of doc/gallery.md, and what they should be.

Numbers are read from the files that the commands of a scene leave in a folder, and from what the commands printed. What they should be
is computed from the same bodies, or is a benchmark. SI units.
"""

import math
import re
from typing import NamedTuple, Optional

import numpy as np
from scipy.spatial import cKDTree

import loads
from evp import curves, law, specimen
from evp.law import TABLE1

BENCHMARK = (0.0214, 0.0071)  # final length and foot radius of the Taylor bar [m], README.md of the decks
BALL, FLOW_STRESS = 0.015, 265.0 + 426.0 * 0.08**0.34  # radius [m] of the ball; [MPa] of 2024-T351 at a plastic strain of 8 %, by Johnson and Cook


class Number(NamedTuple):
    """Of a row of the page, whose order is that of the functions below: unit ('' for a ratio), value and expected in it."""

    unit: str
    value: float
    expected: Optional[float] = None


def affine_modulus(bonds, volume, e=TABLE1.e1):
    """E [Pa] of so many bonds in a volume [m3], m n e Nb/(6 V), where the strain is affine."""
    return TABLE1.m1 * TABLE1.n1 * e * bonds / volume / 6.0


def slope(folder, name, x, y):
    """dy/dx of the first two rows of a curve."""
    curve = curves.read_columns(folder / f"{name}.csv", (x, y))
    return (curve[y][1] - curve[y][0]) / (curve[x][1] - curve[x][0])


def two_spheres(folder, _):
    read = curves.read_columns(folder / "two_spheres.csv", ("strain", "force"))
    return [Number("N", float(np.interp(strain, read["strain"], read["force"])), float(law.force(0.0102 * (1.0 + strain), 0.0102, TABLE1))) for strain in (-0.02, 0.02)]


def pull(folder, text):
    slow, fast, rest = (curves.read_curve(folder / f"{name}.csv") for name in ("table1", "table2", "rest"))
    cylinder, volume = specimen.read_data(folder / "cylinder.data"), math.pi * 0.02**2 * 0.05
    deq = specimen.bond_lengths(cylinder, TABLE1.alpha)
    modulus = affine_modulus(len(deq), volume)
    at_one = [curves.stress_at(curve.strain, curve.virial, 0.01) for curve in (slow, fast, rest)]
    viscous = modulus * 1000.0 * np.mean(deq**2) / (TABLE1.m1 * TABLE1.n1 * TABLE1.e1) * 100.0
    packed, partners = float(re.search(r"solid fraction ([\d.]+)", text)[1]), float(re.search(r"([\d.]+) partners per sphere within 1.5 ", text)[1])
    return [Number("", packed, 4.0 / 3.0 * math.pi * np.sum(cylinder.radius**3) / volume),
            Number("", partners, 2.0 * len(deq) / len(cylinder.radius)),
            Number("GPa", curves.modulus(rest.strain, rest.virial) / 1e9, modulus / 1e9),
            Number("MPa", at_one[0] / 1e6, at_one[2] / 1e6), Number("MPa", (at_one[1] - at_one[2]) / 1e6, viscous / 1e6)]


def cyclic(folder, _):
    curve = curves.read_curve(folder / "cycles.csv")
    found = curves.cycle_numbers(curve)
    left = found["turn_strain"] - 1e-3 * found["turn_MPa"] / found["unloading_GPa"]
    reversible = curves.cycle_numbers(curves.read_curve(folder / "eq8.csv"))
    return [Number("%", 100.0 * found["residual_strain"], 100.0 * left),
            Number("%", round(100.0 * reversible["residual_strain"], 1) + 0.0, 0.0),
            Number("", 1e9 * found["unloading_GPa"] / curves.modulus(curve.strain[:40], curve.virial[:40]), 1.0)]


def dog_bone(folder, _):
    curve = curves.read_columns(folder / "bone.csv", ("strain_gauge", "stress_virial"))
    body = specimen.read_body(folder / "bone.data")
    rest = curves.modulus(curve["strain_gauge"][:5], curve["stress_virial"][:5])
    plain = slope(folder, "bone_row", "strain", "stress_virial")
    return [Number("GPa", rest / 1e9, plain / 1e9),
            Number("", body["solid_fraction"], specimen.read_body(folder / "cylinder.data")["solid_fraction"])]


def torsion(folder, _):
    modulus = slope(folder, "shaft_pulled", "strain", "stress_grip")
    curve = curves.read_columns(folder / "twisted.csv", ("angle", "torque_grip"))
    share = loads.torsion_share(loads.find_bonds(specimen.read_data(folder / "shaft.data"), TABLE1.alpha, 0.015, 0.085), 0.02)
    return [Number("N m", curve["torque_grip"][1], share * loads.torque(modulus, 0.02, 0.08, curve["angle"][1]))]


def bending(folder, _):
    modulus = slope(folder, "bar_pulled", "strain", "stress_grip")
    curve = curves.read_columns(folder / "bent.csv", ("strain", "deflection", "force"))
    beam = loads.Beam(modulus, 0.01, 0.02, 0.08)
    share = loads.bending_share(loads.find_bonds(specimen.read_data(folder / "bar.data"), TABLE1.alpha, 0.015, 0.085), 0.02)
    deflection = curve["deflection"][1]
    back = curves.residual_strain(curve["strain"], curve["force"])
    turn = int(np.argmax(curve["strain"]))
    elastic = curve["force"][turn] * curve["strain"][1] / curve["force"][1]
    return [Number("N", curve["force"][1], deflection / beam.deflection(1.0, share)), Number("%", 100.0 * back, 100.0 * (curve["strain"][turn] - elastic))]


def shear(folder, _):
    body = specimen.read_data(folder / "periodic.data")
    period = body.box[:, 1] - body.box[:, 0]
    volume = float(np.prod(period))
    i, j = cKDTree(np.mod(body.x, period), boxsize=period).query_pairs(2 * TABLE1.alpha * body.radius.max(), output_type="ndarray").T
    r = body.x[i] - body.x[j]
    bonds = np.sum(np.linalg.norm(r - period * np.rint(r / period), axis=1) <= TABLE1.alpha * (body.radius[i] + body.radius[j]))
    scaled = TABLE1.e1 * 500 / len(body.radius) * volume / (math.pi * 0.02**2 * 0.05)  # as in.shear does
    curve = curves.read_columns(folder / "sheared.csv", ("strain", "shear_stress"))
    small = curves.read_columns(folder / "shear_elastic.csv", ("strain", "shear_stress"))
    late = small["strain"] > 0.001  # the viscous part is constant by then
    return [Number("GPa", np.polyfit(small["strain"][late], small["shear_stress"][late], 1)[0] / 1e9, 0.4 * affine_modulus(bonds, volume, scaled) / 1e9),
            Number("MPa", curve["shear_stress"].max() / 1e6)]


def notched(folder, _):
    read = curves.read_columns(folder / "notched.csv", ("stress_grip", "failed", "ended_at_dlim"))
    return [Number("MPa", read["stress_grip"].max() / 1e6), Number("", read["failed"][-1] + read["ended_at_dlim"][-1])]


def sliding(_, text):
    found = re.findall(r"^(?:distance|time) (\S+) .* = (\S+) m?s?, ratio", text, re.M)
    return [Number(unit, 1e3 * float(value), 1e3 * float(expected)) for unit, (value, expected) in zip(("mm", "ms"), found)]


def impact(_, text):
    (depth, speed), (fine_depth, fine_speed), (no_depth, no_speed) = (map(float, found) for found in re.findall(
        r"crater depth (\S+) m, rebound speed (\S+) m/s", text))
    imbalance = float(re.search(r"over impact energy: (\S+)", text)[1])
    return [Number("mm", 1e3 * depth, 1e3 * fine_depth), Number("m/s", speed, fine_speed),
            Number("mm", round(1e3 * no_depth, 3) + 0.0, 0.0),
            Number("m/s", no_speed), Number("", imbalance, 0.0)]


def taylor(_, text):
    length, foot = map(float, re.search(r"final length (\S+) m, foot radius (\S+) m", text).groups())
    return [Number("mm", 1e3 * length, 1e3 * BENCHMARK[0]), Number("mm", 1e3 * foot, 1e3 * BENCHMARK[1])]


def rod(folder, text):
    body = specimen.read_body(folder / "rod.data")
    modulus = slope(folder, "rod_pulled", "strain", "stress_grip")
    sound = math.sqrt(modulus / (body["solid_fraction"] * 2700.0))
    rebound, contact = map(float, re.search(r"rebound speed (\S+) m/s, contact time (\S+) s", text).groups())
    read = curves.read_columns(folder / "rod.csv", ("time", "force"))
    plateau = read["force"][(read["time"] > 0.2 * contact) & (read["time"] < 0.8 * contact)].mean()
    return [Number("us", 1e6 * contact, 2e6 * body["length"] / sound),
            Number("N", plateau, math.pi * body["radius"] ** 2 * modulus / sound),
            Number("m/s", rebound, 1.0)]


def indent(folder, text):
    diameters, hardness, left = map(float, re.search(r"= (\S+) diameters of a sphere, a hardness of (\S+) MPa; released: .*, (\S+) % of the depth", text).groups())
    read = curves.read_columns(folder / "indented.csv", ("depth", "contact_radius"))
    turn = int(np.argmax(read["depth"]))
    return [Number("mm", 1e3 * read["contact_radius"][turn], 1e3 * math.sqrt(2 * BALL * read["depth"][turn])),
            Number("MPa", hardness, 3.0 * FLOW_STRESS),
            Number("", diameters, 5.0), Number("%", left)]


def upset(folder, text):
    pressed, left, back = map(float, re.search(r"pressed by (\S+) %, released (\S+) % are left; it sprang back by (\S+) %", text).groups())
    read = curves.read_columns(folder / "upset.csv", ("strain", "force_lower", "force_upper", "width_middle", "width_plates"))
    late = read["strain"] > 0.1
    return [Number("", float(np.mean(read["force_lower"][late] / read["force_upper"][late])), 1.0),
            Number("mm", 1e3 * read["width_middle"][-1], 1e3 * 0.02 / math.sqrt(1.0 - 0.01 * pressed)),
            Number("%", left, pressed)]


def extrude(folder, text):
    """Pressure of an ideal die, A + B ep^n integrated to ln ratio, and the mean plastic strain of what left it."""
    pressure, strain, ideal = map(float, re.search(r"ram pressure (\S+) MPa .* plastic strain of (\S+) in the mean, ln ratio is (\S+)", text).groups())
    read = curves.read_columns(folder / "extrude.csv", ("travel", "force_ram", "force_container", "force_cone", "force_bearing"))
    late = read["travel"] > 0.01
    tools = read["force_container"] + read["force_cone"] + read["force_bearing"]
    mean = 265.0 + 426.0 * ideal**0.34 / 1.34  # flow stress on the way to ln ratio
    return [Number("MPa", pressure, mean * (0.8 + 1.2 * ideal)), Number("", strain, ideal), Number("", float(-np.mean(read["force_ram"][late]) / np.mean(tools[late])), 1.0)]


def vbend(folder, text):
    """Force of a plastic hinge with the flow stress at a plastic strain of 5 %, and springback."""
    force, bent, left, hinge = map(float, re.search(r"in.vbend: (\S+) N at the end; bent by (\S+) degrees, released (\S+) are left; a plastic hinge takes (\S+) N", text).groups())
    return [Number("N", force, hinge * (265.0 + 426.0 * 0.05**0.34)), Number("degrees", bent), Number("degrees", bent - left)]


def blank(_, text):
    """Shear stress of a cut, where it parts, energies."""
    peak, at, parted, _, imbalance = re.search(r"largest shear stress (\S+) MPa at (\S+) % of the thickness, parted at (\S+) %; (\S+) spheres have parted; energy imbalance (\S+) of", text).groups()
    return [Number("MPa", float(peak), (265.0 + 426.0 * 0.26**0.34) / math.sqrt(3.0)), Number("", float(at) / 100.0), Number("", float(parted) / 100.0), Number("", float(imbalance), 0.0)]


def press(folder, text):
    """Forces of the wedge of spheres beside those of the region, and what it leaves."""
    region, spheres = (curves.read_columns(folder / f"{name}.csv", ("travel", "force")) for name in ("region", "press"))
    of_region, of_spheres = (float(np.mean(one["force"][one["travel"] > 0.0005])) for one in (region, spheres))
    _, left = re.findall(r"imprint of (\S+) m is left", text)
    return [Number("N", of_spheres, of_region), Number("N", spheres["force"][-1], region["force"][-1]), Number("mm", 1e3 * float(left))]


def spray(_, text):
    """Joints at both speeds, width of the splat, energies."""
    verdicts = re.findall(r"the particle (?:sticks, joints with the plate: (\d+)|rebounds)", text)
    widths, imbalances = re.findall(r"and width (\S+) of the first", text), re.findall(r"imbalance over impact energy (\S+);", text)
    return [Number("", float(verdicts[0] or 0), 0.0), Number("", float(verdicts[1] or 0)), Number("", float(widths[1])), Number("", float(imbalances[1]), 0.0)]


def weld(_, text):
    """Strength of a seam over that of the solid: not pressed, pressed by 20 and by 40 %, with contact join from 1.2 and from 1.0 on."""
    found = [float(value) for value in re.findall(r"in.weld: strength (\S+) MPa", text)]
    return [Number("", found[0] / found[1], 0.0), Number("", found[2] / found[3]), Number("", found[4] / found[5]), Number("", found[6] / found[7])]


def slab(folder, text):
    """Flux of one and of two materials, the transient, and the temperature where the two meet."""
    found = [[float(value) for value in one] for one in re.findall(r"^in.slab: flux (\S+) at the left and \S+ at the right end of that of Fourier, (\S+) W; in the middle (\S+) K, "
                                                                   r"by Fourier (\S+) K", text, re.M)]
    rms = curves.read_columns(folder / "early.csv", ("rms",))["rms"][-1]
    _, (share, flux, _, _), (share_two, flux_two, middle, by_law) = found
    return [Number("W", share * flux, flux), Number("%", 100.0 * rms, 0.0), Number("W", share_two * flux_two, flux_two), Number("K", middle, by_law)]


def adiabatic(folder, _):
    """Temperatures beside those by hand, stress and energies."""
    start, names = 298.0, ("strain", "shear_stress", "temperature", "temperature_highest", "temperature_by_hand", "plastic_work", "energy_imbalance")
    curve = curves.read_columns(folder / "heated.csv", names)
    at_half, stress = {name: float(np.interp(0.5, curve["strain"], curve[name])) for name in names}, curve["shear_stress"] / 1e6
    rises = [Number("K", at["temperature"] - start, at["temperature_by_hand"] - start) for at in (at_half, {name: curve[name][-1] for name in names})]
    return [*rises, Number("K", curve["temperature_highest"][-1]), Number("MPa", stress.max()), Number("MPa", stress[-1]),
            Number("%", 100.0 * curve["energy_imbalance"][-1] / curve["plastic_work"][-1], 0.0)]


def stir(folder, text):
    """Torque of the pin, cold and hot, what follows it, and temperatures; strength of the seam over that of the uncut plate."""
    names = ("turns", "torque_pin", "follow_first", "temperature_highest", "temperature_near", "energy_imbalance", "heat_imbalance")
    curve = curves.read_columns(folder / "stir.csv", names)
    hot = curve["turns"] > curve["turns"][-1] - 0.5
    torque, radius, depth = np.abs(curve["torque_pin"]), 0.0025 + 0.00102, 0.0025  # radius: of the pin and a sphere beside it, whose far side slips
    stress = (265e6 + 426e6) / math.sqrt(3.0)  # of 2024 at a plastic strain of 1, in shear
    stirred, uncut = map(float, re.search(r"^in.seam: strength (\S+) MPa .* of that of the plate, (\S+) MPa", text, re.M).groups())
    slips = (2.0 * math.pi * radius**2 * depth + 2.0 / 3.0 * math.pi * radius**3) * stress
    return [Number("N m", torque.max(), slips), Number("", torque[hot].mean() / torque.max()), Number("", curve["follow_first"][hot].mean(), 1.0),
            Number("K", curve["temperature_highest"].max(), 775.0), Number("", curve["temperature_near"][-1] / 775.0),
            Number("MPa", stirred), Number("MPa", uncut), Number("", stirred / uncut)]


SCENES = {  # picture on the page: its numbers, of (folder, printed text)
    "dog_bone.png": dog_bone,
    "torsion.png": torsion,
    "bending.png": bending,
    "indent.png": indent,
    "upset.png": upset,
    "extrude.png": extrude,
    "vbend.png": vbend,
    "blank.png": blank,
    "press.png": press,
    "spray.png": spray,
    "weld.png": weld,
    "shear.png": shear,
    "slab.png": slab,
    "adiabatic.png": adiabatic,
    "stir.png": stir,
    "notched.png": notched,
    "impact.png": impact,
    "sliding.png": sliding,
    "taylor.gif": taylor,
    "wall_force.png": rod,
    "force_law.png": two_spheres,
    "traction.png": pull,
    "cyclic.png": cyclic,
}
