#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Rupture by Johnson and Cook's failure and a toughness (damage, rupture): stress states of spheres, strain at which bars part, work of rupture, and what of it depends on the spacing.

Row aluminium_2024T351 of potentials/metals.evp; contact join, in.uniaxial, in.traction and in.blank. About 40 minutes on one core.
"""

import math
import re
import sys
from typing import NamedTuple

from study import CHECKOUT, DECKS, RunError, Study, mean_of
import numpy as np
from evp import curves
from scipy.integrate import trapezoid

POTENTIALS, ROW = CHECKOUT / "potentials" / "metals.evp", "aluminium_2024T351"
JOHNSON_COOK = (0.13, 0.13, -1.5)  # D1 D2 D3 of 2024-T351
NECK, LENGTH, SLICE = 5.0, 40.0, 3.0  # [mm] radius of the section where round bars part, length, thickness of the slice that is looked at
BARS = {"smooth": 0.0, "R 12": 12.0, "R 3": 3.0}  # radius of the notch [mm]; smooth: a shaft between thicker ends
RATE = 100  # [1/s] of bars and sheets
NOTCHED = {"shape": "region", "region": DECKS / "regions" / "notched.lmp", "width": 0.022, "height": 0.012}
NET, FREE = 1e-4, 0.04  # [m2], [m] of the notched bar: net section, length between the grips
XI, OPENING = 0.05, 0.2e-3  # plastic strain at initiation, rupture [m]
LIGAMENTS, TOUGHNESS = (0.005, 0.008), (20e3, 40e3, 80e3)  # [m], [J/m2] of sheets with two notches
SHEET = {"length": 0.04, "width": 0.02, "height": 0.003}
BLANKED = 11e3  # [J/m2] of the sheet that is blanked
PARTED = 0.1  # of the largest force: below it a body has parted
# Taken in by in.traction: of the slice and the spheres at its center, each row
ALSO = """
region          slice block $(0.5*v_length-0.5*v_slice) $(0.5*v_length+0.5*v_slice) INF INF INF INF
group           slice region slice
region          center cylinder x 0 0 ${core} $(0.5*v_length-0.5*v_slice) $(0.5*v_length+0.5*v_slice)
group           center region center
compute         own all evp/state/atom plastic_strain triaxiality damage
compute         slice slice reduce ave c_own[5]
compute         most slice reduce max c_own[7]
compute         center center reduce ave c_own[6]
fix             slice all print ${every} "$(v_strain_now:%.9g),$(c_slice:%.9g),$(c_most:%.9g),$(c_center:%.9g)" &
                file ${out}_slice.csv screen no title strain,plastic_strain,damage,triaxiality
"""
# Taken in by in.uniaxial: mean and mean square of all spheres
SCATTER = """
compute         own all evp/state/atom triaxiality
variable        square atom c_own[5]^2
compute         scatter all reduce ave c_own[5] v_square
fix             scatter all print ${every} "$(v_strain_now:%.9g),$(c_scatter[1]:%.9g),$(c_scatter[2]:%.9g)" &
                file ${out}_scatter.csv screen no title strain,mean,square
"""


class Parted(NamedTuple):
    """largest force [N], strain there and where the body parted, work until then and after the largest force [J]."""

    force: float
    at: float
    strain: float
    work: float
    after: float


def coefficients(damage, rupture):
    """The row with a failure: D1 D2 D3, and the words behind rupture."""
    row = re.search(f"^{ROW} (.*)", POTENTIALS.read_text(encoding="utf-8"), re.M)[1]
    return f"{row} damage {' '.join(map(str, damage))} 0 0 rupture {rupture}"


def strain_at_failure(triaxiality):
    d1, d2, d3 = JOHNSON_COOK
    return d1 + d2 * math.exp(d3 * triaxiality)


def revolved(path, x, r, around=48):
    """Writes an STL file of a body of revolution about x, with the radius r at x [mm]."""
    turn = np.linspace(0.0, 2.0 * math.pi, around, endpoint=False)
    rings = np.stack([np.broadcast_to(x[:, None], (len(x), around)), r[:, None] * np.cos(turn), r[:, None] * np.sin(turn)], axis=-1)
    facets = []
    for one, other in zip(rings[:-1], rings[1:]):
        a, b, c, d = one, np.roll(one, -1, axis=0), np.roll(other, -1, axis=0), other
        facets += [*zip(a, c, b), *zip(a, d, c)]
    for ring, place, turned in ((rings[0], x[0], False), (rings[-1], x[-1], True)):
        middle = np.array([place, 0.0, 0.0])
        facets += [(middle, q, p) if turned == (place == x[0]) else (middle, p, q) for p, q in zip(ring, np.roll(ring, -1, axis=0))]
    lines = ["facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {p[0]:.6g} {p[1]:.6g} {p[2]:.6g}\n" for p in facet) + "endloop\nendfacet\n" for facet in facets]
    path.write_text("solid bar\n" + "".join(lines) + "endsolid bar\n", encoding="ascii")


def pull(study, name, strain, damage, rupture, **choices):
    """The curve of a pull by in.traction, with a failure."""
    study.runs.run("in.traction", name, study.ranks, coeff=coefficients(damage, rupture), plasticity="isotropic", contact="join", rate=RATE, strain=strain, row=strain / 400, **choices)
    return curves.read_curve(study.runs.folder / f"{name}.csv")


def parted(name, strain, force, length):
    """The Parted of a curve. RunError where the body has not parted."""
    top = int(np.argmax(force))
    gone = np.nonzero(force[top:] < PARTED * force[top])[0]
    if len(gone) == 0:
        raise RunError(f"{name} has not parted at a strain of {strain[-1]:g}: {force[-1]:.3g} N of {force[top]:.3g} N are left")
    end = top + gone[0] + 1
    return Parted(force[top], strain[top], strain[end - 1], trapezoid(force[:end], strain[:end]) * length, trapezoid(force[top:end], strain[top:end]) * length)


def states(study):
    """Rows of the triaxialities of the spheres of a periodic body, up to a plastic strain of 0.1."""
    body, also, rows = study.runs.body("periodic", shape="periodic", n=1000, length=0.04, seed=3), study.runs.folder / "scatter.lmp", []
    also.write_text(SCATTER, encoding="utf-8")
    for way, strain, exact in (("tension", 0.1, 1 / 3), ("compression", -0.1, -1 / 3)):
        study.runs.run("in.uniaxial", way, study.ranks, specimen=body, coeff=coefficients((9, 0, 0), 0), contact="join", strain=strain, rows=50, also=also)
        read = study.runs.curve(f"{way}_scatter", "strain", "mean", "square")
        flows = np.abs(read["strain"]) > 0.01
        mean, scatter = read["mean"][flows].mean(), np.sqrt(read["square"] - read["mean"] ** 2)[flows].max()
        rows.append((way, f"{exact:.3f}", f"{mean:.3f}", f"{scatter:.3f}"))
    return rows


def bar(study, name, notch, spheres, seed):
    """The data file of a round bar."""
    x = np.linspace(0.0, LENGTH, 161)
    middle = np.abs(x - 0.5 * LENGTH)
    r = NECK + (np.clip(0.2 * (middle - 9.0), 0.0, 1.5) if notch == 0.0 else np.minimum(3.5, notch - np.sqrt(np.maximum(0.0, notch**2 - np.minimum(middle, notch) ** 2))))
    part = study.runs.folder / f"{name}.stl"
    revolved(part, x, r)
    study.runs.keep(f"{name}.data", [sys.executable, CHECKOUT / "tools" / "body.py", part, "--n", spheres, "--seed", seed, "--out", f"{name}.data"])
    return f"{name}.data"


def round_bars(study):
    """Rows: strain of the slice when its first sphere has parted, beside Johnson and Cook's at the triaxiality of the center, and that of Bridgman."""
    rows, drawn = [], {}
    also = study.runs.folder / "slice.lmp"
    also.write_text(ALSO, encoding="utf-8")
    for (name, notch), seed in study.each([(item, seed) for item in BARS.items() for seed in study.seeds], lambda one: f"bar {one[0][0]}, seed {one[1]}"):
        out = f"bar_{notch:g}_{seed}"
        body = bar(study, f"{out}_body", notch, study.bars, seed)
        curve = pull(study, out, {"smooth": 0.22}.get(name, 0.1), JOHNSON_COOK, f"{OPENING:g}", specimen=body, also=also, slice=1e-3 * SLICE, core=0.2e-3 * NECK)
        read = study.runs.curve(f"{out}_slice", "strain", "plastic_strain", "damage", "triaxiality")
        first = int(np.argmax(read["damage"] >= 1.0))
        if first == 0:
            raise RunError(f"{out}: no sphere of the slice has parted")
        flows = (read["plastic_strain"] > 0.01) & (np.arange(len(read["strain"])) < first)
        found = np.average(read["triaxiality"][flows], weights=np.gradient(read["plastic_strain"])[flows])
        bridgman = 1 / 3 + (math.log(1.0 + NECK / (2.0 * notch)) if notch else 0.0)
        rows.append((name, seed, f"{bridgman:.2f}", f"{read['triaxiality'][flows][0]:.2f}", f"{found:.2f}", f"{strain_at_failure(found):.3f}", f"{read['plastic_strain'][first]:.3f}",
                     f"{read['plastic_strain'][first] / strain_at_failure(found):.2f}"))
        if seed == study.seeds[0]:
            drawn[name] = (100 * curve.strain, curve.grip / 1e6)
    return rows, drawn


def works(study):
    """Rows: work of rupture of the notched bar per net section against the number of spheres."""
    rows = []
    jobs = [(rupture, n) for rupture in (f"{OPENING:g}", "0") for n in study.spheres]
    for rupture, n in study.each(jobs, lambda job: f"notched bar of {job[1]}, rupture {job[0]}", lambda job: job[1] ** (4.0 / 3.0)):
        found = []
        for seed in study.seeds:
            body = study.runs.body(f"notched_{n}_{seed}", n=n, seed=seed, **NOTCHED)
            curve = pull(study, f"notched_{n}_{seed}_{rupture}", 0.05, (XI, 0, 0), rupture, specimen=body)
            area = float(re.search(r"variable area equal (\S+)", (study.runs.folder / f"{body}.body").read_text(encoding="utf-8"))[1])
            found.append(parted(f"notched_{n}_{seed}_{rupture}", curve.strain, curve.grip * area, FREE))
        rows.append((f"damage {XI:g} 0 0 0 0 rupture {rupture}", n, *(mean_of([scale * getattr(one, name) for one in found], form) for name, scale, form in (
            ("force", 1e-3, ".1f"), ("strain", 100, ".2f"), ("work", 1e-3 / NET, ".0f"), ("after", 1e-3 / NET, ".0f")))))
    return rows


def sheets(study):
    """Rows: growth of the work of rupture of sheets with two notches, per ligament, with the toughness that was given."""
    rows = []
    jobs = [(n, ligament) for n in study.sheets for ligament in LIGAMENTS]
    for n, ligament in study.each(jobs, lambda job: f"sheet of {job[0]}, ligament {1e3 * job[1]:g} mm", lambda job: job[0] ** (4.0 / 3.0)):
        name = f"sheet_{n}_{1e3 * ligament:g}"
        half, deep = 0.5 * ligament, 0.5 * SHEET["width"] + 1e-3
        region = study.runs.folder / f"{name}.lmp"
        region.write_text(f"region whole block 0 {SHEET['length']} {-0.5 * SHEET['width']} {0.5 * SHEET['width']} {-0.5 * SHEET['height']} {0.5 * SHEET['height']}\n" + "".join(
            f"region notch{k} block {0.5 * SHEET['length'] - 5e-4} {0.5 * SHEET['length'] + 5e-4} {low} {high} INF INF side out\n"
            for k, (low, high) in enumerate(((-deep, -half), (half, deep)))) + "region body intersect 3 whole notch0 notch1\n", encoding="utf-8")
        body = study.runs.body(name, n=n, shape="region", region=region, length=SHEET["length"], width=SHEET["width"] + 2e-3, height=SHEET["height"] + 1e-3)
        area = float(re.search(r"variable area equal (\S+)", (study.runs.folder / f"{body}.body").read_text(encoding="utf-8"))[1])
        net, found = ligament * SHEET["height"], []
        for toughness in TOUGHNESS:
            out = f"{name}_{toughness:g}"
            curve = pull(study, out, 0.1, JOHNSON_COOK, f"energy {toughness:g}", specimen=body)
            found.append(parted(out, curve.strain, curve.grip * area, 0.8 * SHEET["length"]).work / net)
        rows.append((n, f"{1e3 * ligament:g}", *(f"{1e-3 * work:.0f}" for work in found), *(f"{value:.2f}" for value in np.diff(found) / np.diff(TOUGHNESS))))
    return rows


def blanks(study):
    """Rows of in.blank."""
    rows = []
    for n in study.each(study.blanks, lambda n: f"blanking of {n}", lambda n: n ** (4.0 / 3.0)):
        body = study.runs.body(f"blank_{n}", n=n, shape="sheet", length=0.016, width=0.002, height=0.0012)
        text = study.runs.run("in.blank", f"blank_{n}_cut", study.ranks, specimen=body, coeff=coefficients(JOHNSON_COOK, f"energy {BLANKED:g}"), contact="join", travel=0.45)
        peak, at, rupture = map(float, re.search(r"largest shear stress (\S+) MPa at (\S+) % of the thickness, parted at (\S+) %", text).groups())
        rows.append((n, f"{peak:.0f}", f"{at:.0f}", f"{rupture:.0f}", re.search(r"energy imbalance (\S+) of", text)[1]))
    return rows


def main(words=None):
    with Study(__doc__, "failure", seeds=[1, 2, 3], spheres=[1000, 4000, 16000], bars=6000, sheets=[1500, 5000], blanks=[5000, 20000], ranks=1).started(words) as study:
        state_rows = states(study)
        bar_rows, drawn = round_bars(study)
        work_rows, sheet_rows, blank_rows = works(study), sheets(study), blanks(study)
        study.draw(drawn, ("bar", "strain_percent", "stress_MPa"), xlabel="strain of the grips [%]", ylabel="force over the section of the ends [MPa]")
        study.write(states=(("load", "of the body", "mean of spheres", "scatter"), state_rows),
                    bars=(("bar", "seed", "triaxiality by Bridgman", "at first", "on the way", "strain by the formula", "of the slice", "ratio"), bar_rows),
                    works=(("row", "spheres", "largest force [kN]", "strain of rupture [%]", "work of rupture [kJ/m2]", "after the largest force [kJ/m2]"), work_rows),
                    sheets=(("spheres", "ligament [mm]", *(f"work at {1e-3 * one:g} kJ/m2" for one in TOUGHNESS), *(f"slope {1e-3 * a:g} to {1e-3 * b:g}" for a, b in zip(TOUGHNESS, TOUGHNESS[1:]))),
                            sheet_rows),
                    blanks=(("spheres", "largest shear stress [MPa]", "at [% of the thickness]", "parted at [%]", "energy imbalance"), blank_rows))


if __name__ == "__main__":
    main()
