#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Rupture by Johnson and Cook's failure and a toughness (damage, rupture): stress states of spheres, strain at which bars part, work of rupture, and what of it depends on the spacing.

Row aluminium_2024T351 of potentials/metals.evp; contact join, in.uniaxial, in.traction and in.blank. About 40 minutes on one core.
"""

import re
from typing import NamedTuple

from study import CHECKOUT, DECKS, RunError, Study, mean_of
import numpy as np
from evp import curves, rupture, specimen
from evp.calibration import MISES
from metals import METALS, targets_of
from scipy.integrate import trapezoid

POTENTIALS, ROW = CHECKOUT / "potentials" / "metals.evp", "aluminium_2024T351"
JOHNSON_COOK = (0.13, 0.13, -1.5)  # D1 D2 D3 of 2024-T351
RATE = 100  # [1/s] of bars and sheets
NOTCHED = {"shape": "region", "region": DECKS / "regions" / "notched.lmp", "width": 0.022, "height": 0.012}
NET, FREE = 1e-4, 0.04  # [m2], [m] of the notched bar: net section, length between the grips
PULLED = 0.03  # strain of the notched bar at the end
XI, OPENING = 0.05, 0.2e-3  # plastic strain at initiation, rupture [m]
LIGAMENTS, TOUGHNESS = (0.005, 0.008), (20e3, 40e3, 80e3)  # [m], [J/m2] of sheets with two notches
SHEET = {"length": 0.04, "width": 0.02, "height": 0.003}
BLANKED = 14e3  # [J/m2] of the sheet that is blanked
DRAWN = 0.08  # strain to which the picture shows bars
PARTED = 0.1  # of the largest force: below it a body has parted
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


def coefficients(damage, opening):
    """The row with a failure: D1 D2 D3, and the words behind rupture."""
    row = re.search(f"^{ROW} (.*)", POTENTIALS.read_text(encoding="utf-8"), re.M)[1]
    return f"{row} damage {' '.join(map(str, damage))} 0 0 rupture {opening}"


def pull(study, name, strain, damage, opening, **choices):
    """The curve of a pull by in.traction, with a failure."""
    study.runs.run("in.traction", name, study.ranks, coeff=coefficients(damage, opening), plasticity="isotropic", contact="join", rate=RATE, strain=strain, row=strain / 400, **choices)
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


def round_bars(study):
    """Rows: strain of the slice when its first sphere has parted, beside the formula's at the triaxiality of the axis; stress over strain of one bar of each waist."""
    rows, drawn = [], {}
    also = study.runs.folder / "slice.lmp"
    also.write_text(rupture.ALSO, encoding="utf-8")
    for (waist, end), seed in study.each([(one, seed) for one in rupture.WAISTS.items() for seed in study.seeds], lambda one: f"bar, waist of {1e3 * one[0][0]:g} mm, seed {one[1]}"):
        name = f"bar_{1e3 * waist:g}_{seed}"
        rod = study.runs.body(f"rod_{study.bars}_{seed}", n=study.bars, seed=seed, length=rupture.LENGTH, radius=rupture.NECK + rupture.DEPTH)
        rupture.turn(study.runs.folder / rod, waist, study.runs.folder / f"{name}_body.data")
        curve = pull(study, name, end, JOHNSON_COOK, f"{OPENING:g}", specimen=f"{name}_body.data", also=also)
        found = rupture.read(study.runs.folder / f"{name}_slice.csv")
        formula = rupture.strain_at_failure(JOHNSON_COOK, found.triaxiality)
        rows.append((f"{1e3 * waist:g}", seed, f"{rupture.bridgman(waist):.2f}", f"{found.at_first:.2f}", f"{found.triaxiality:.2f}", f"{formula:.3f}", f"{found.strain:.3f}",
                     f"{found.strain / formula:.2f}"))
        if seed == study.seeds[0]:
            shown = curve.strain < DRAWN
            drawn[f"waist of {1e3 * waist:g} mm"] = (100 * curve.strain[shown], curve.grip[shown] / 1e6)
    return rows, drawn


def works(study):
    """Rows: work of rupture of the notched bar per net section against the number of spheres."""
    rows = []
    jobs = [(opening, n) for opening in (f"{OPENING:g}", "0") for n in study.spheres]
    for opening, n in study.each(jobs, lambda job: f"notched bar of {job[1]}, rupture {job[0]}", lambda job: job[1] ** (4.0 / 3.0)):
        found = []
        for seed in study.seeds if opening != "0" else study.seeds[:1]:
            body = study.runs.body(f"notched_{n}_{seed}", n=n, seed=seed, **NOTCHED)
            curve = pull(study, f"notched_{n}_{seed}_{opening}", PULLED, (XI, 0, 0), opening, specimen=body)
            area = specimen.read_body(study.runs.folder / body)["area"]
            found.append(parted(f"notched_{n}_{seed}_{opening}", curve.strain, curve.grip * area, FREE))
        rows.append((f"damage {XI:g} 0 0 0 0 rupture {opening}", n, *(mean_of([scale * getattr(one, name) for one in found], form) for name, scale, form in (
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
        area = specimen.read_body(study.runs.folder / body)["area"]
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
        text = study.runs.run("in.blank", f"blank_{n}_cut", study.ranks, specimen=body, coeff=coefficients(JOHNSON_COOK, f"energy {BLANKED:g}"), contact="join", travel=0.35)
        peak, at, end = map(float, re.search(r"largest shear stress (\S+) MPa at (\S+) % of the thickness, parted at (\S+) %", text).groups())
        rows.append((n, f"{peak:.0f}", f"{at:.0f}", f"{end:.0f}", re.search(r"energy imbalance (\S+) of", text)[1]))
    return rows


def main(words=None):
    with Study(__doc__, "failure", seeds=[1, 2, 3], spheres=[1000, 4000, 16000], bars=6000, sheets=[1500, 5000], blanks=[5000, 20000], ranks=1).started(words) as study:
        state_rows = states(study)
        bar_rows, drawn = round_bars(study)
        work_rows, sheet_rows, blank_rows = works(study), sheets(study), blanks(study)
        study.draw(drawn, ("bar", "strain_percent", "stress_MPa"), xlabel="strain of the grips [%]", ylabel="force over the smallest section [MPa]")
        ratios = {waist: np.mean([float(row[-1]) for row in bar_rows if row[0] == waist]) for waist in dict.fromkeys(row[0] for row in bar_rows)}
        targets = targets_of(METALS[ROW])
        shear = 1e-6 * targets.curve.at(rupture.strain_at_failure(JOHNSON_COOK, 0.0)) / MISES
        slopes = [float(value) for row in sheet_rows for value in row[-2:]]
        across = 2.0 * rupture.NECK / (6.0 * 0.62 * (rupture.NECK + rupture.DEPTH) ** 2 * rupture.LENGTH / study.bars) ** (1.0 / 3.0)
        study.write(damage=" ".join(f"{value:g}" for value in JOHNSON_COOK), ratios=", ".join(f"{ratio:.2f} (waist of {waist} mm)" for waist, ratio in ratios.items()),
                    after=", ".join(row[-1].split(" +-")[0] for row in work_rows[:len(study.spheres)]), spheres=", ".join(map(str, study.spheres)), bars_n=str(study.bars),
                    across=f"{across:.0f}", opening=f"{1e3 * OPENING:g}", seeds=str(len(study.seeds)), blanked=f"{1e-3 * BLANKED:g}",
                    shear=f"{shear:.0f}", slopes=f"{min(slopes):.2f} to {max(slopes):.2f}",
                    blanked_at=" and ".join(row[3] for row in blank_rows),
                    blanked_off=" and ".join(f"{100.0 * (float(row[1]) / shear - 1.0):.0f}" for row in blank_rows),
                    states=(("load", "of the body", "mean of spheres", "scatter"), state_rows),
                    bars=(("radius of the waist [mm]", "seed", "triaxiality by Bridgman", "at first", "on the way", "strain by the formula", "of the slice", "ratio"), bar_rows),
                    works=(("row", "spheres", "largest force [kN]", "strain of rupture [%]", "work of rupture [kJ/m2]", "after the largest force [kJ/m2]"), work_rows),
                    sheets=(("spheres", "ligament [mm]", *(f"work at {1e-3 * one:g} kJ/m2" for one in TOUGHNESS),
                             *(f"slope {1e-3 * a:g} to {1e-3 * b:g}" for a, b in zip(TOUGHNESS, TOUGHNESS[1:]))), sheet_rows),
                    blanks=(("spheres", "largest shear stress [MPa]", "at [% of the thickness]", "parted at [%]", "energy imbalance"), blank_rows))


if __name__ == "__main__":
    main()
