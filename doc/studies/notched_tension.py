#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Rupture of a notched bar against the spacing of the spheres, and the XI of `break XI` that keeps the work of rupture.

in.traction pulls the bar of lammps_inputs/regions/notched.lmp to rupture, with increasing numbers of spheres: with constant XI, with
XI proportional to 1/spacing, and with the power of the spacing in between that keeps the work of rupture from the first size to the
second. --seeds: bodies of each size.
"""

import math
import statistics
from typing import NamedTuple

from study import DECKS, RunError, Study, mean_of
import numpy as np
from evp import curves
from scipy.integrate import trapezoid

BAR = {"shape": "region", "region": DECKS / "regions" / "notched.lmp", "width": 0.022, "height": 0.012}
PULL = {"coeff": "80 8 4 3 8 4 0.005 20 1.5 spacing 0.00585189 coordination 11.9", "contact": "repulsive", "plasticity": "isotropic", "rate": 100,
        "strain": 0.02, "row": 0.00025, "dtfraction": 0.8}
VOLUME = 9.814e-6  # [m3] of the bar
FREE_LENGTH = 0.04  # between the grips [m]
PARTED = 0.1  # of the largest stress: below it the body has parted
NOTCH = 1.0  # radius of the end of a notch [mm]
RULES = CONSTANT, INVERSE, POWER = "constant XI", "XI ~ 1/spacing", "power of the spacing"
HEADER = ("spheres", "specimens", "spacing [mm]", "XI", "rule", "largest stress [MPa]", "strain at it [%]", "rupture strain [%]", "work of rupture [kJ/m2]",
          "bonds ended")


class Rupture(NamedTuple):
    """Of a pull: largest stress [MPa], strain at it, strain of rupture, work of the grips per cross-section [kJ/m2], bonds that ended."""

    peak: float
    at: float
    strain: float
    work: float
    ended: int


def rupture_of(curve, ended):
    """The Rupture of a curve. RunError where the body has not parted."""
    strain, stress = curve.strain, curve.grip
    top = int(np.argmax(stress))
    gone = np.nonzero(stress[top:] < PARTED * stress[top])[0]
    if len(gone) == 0:
        raise RunError(f"the body has not parted at a strain of {strain[-1]:g}: {stress[-1]:.3g} Pa of {stress[top]:.3g} Pa are left")
    end = top + gone[0]
    return Rupture(stress[top] / 1e6, strain[top], strain[end], trapezoid(stress[: end + 1], strain[: end + 1]) * FREE_LENGTH / 1e3, ended)


def pull(runs, data, xi):
    """(Rupture, curve) of a body."""
    name = f"{data[:-len('.data')]}_{xi:.4g}"
    runs.run("in.traction", name, specimen=data, **{"break": f"{xi:.6g}"}, **PULL)
    curve = curves.read_curve(runs.folder / f"{name}.csv")
    ended = runs.curve(name, "failed", "ended_at_dlim")
    return rupture_of(curve, int(ended["failed"][-1] + ended["ended_at_dlim"][-1])), curve


def spacing(spheres):
    """Of the bar [mm]: edge of the cube that a sphere has of the volume."""
    return 1e3 * (VOLUME / spheres) ** (1.0 / 3.0)


def work_of(found):
    return statistics.mean(rupture.work for rupture, _ in found)


def exponent_of(results, few, more):
    """p of XI ~ spacing^-p that keeps the work of `few` spheres at `more`, where the work is a power of XI through those of two rules.

    results: {(spheres, XI, rule): [(Rupture, curve) of each body]}."""
    at = {(n, rule): (xi, work_of(found)) for (n, xi, rule), found in results.items()}
    (xi, kept), (one, work), (other, other_work) = at[few, CONSTANT], at[more, CONSTANT], at[more, INVERSE]
    grown = math.log(other_work / work) / math.log(other / one)
    return math.log(one * (kept / work) ** (1.0 / grown) / xi) / math.log(spacing(few) / spacing(more))


def measure(study, cases):
    """{case: [(Rupture, curve) of each body]} of cases (spheres, XI, rule)."""
    results, plan = {}, [(case, seed) for case in cases for seed in range(1, study.seeds[min(study.spheres.index(case[0]), len(study.seeds) - 1)] + 1)]
    for case, seed in study.each(plan, lambda run: f"{run[0][0]} spheres, XI {run[0][1]:.3g}, seed {run[1]}", lambda run: run[0][0] ** (5.0 / 3.0)):
        data = study.runs.body(f"notched_{case[0]}_{seed}", n=case[0], seed=seed, **BAR)
        results.setdefault(case, []).append(pull(study.runs, data, case[1]))
    return results


def page(results, p, sizes):
    """Values of the page, of the results of all rules and the exponent."""
    def listed(rule, form, value):
        return ", ".join(f"{value(n, xi, found):{form}}" for (n, xi, own), found in results.items() if own == rule)

    rows = [(n, len(found), f"{spacing(n):.2f}", f"{xi:.3g}", rule,
             *(mean_of([scale * getattr(rupture, name) for rupture, _ in found], form)
               for name, scale, form in (("peak", 1, ".0f"), ("at", 100, ".2f"), ("strain", 100, ".2f"), ("work", 1, ".1f"), ("ended", 1, ".0f"))))
            for (n, xi, rule), found in results.items()]
    return {"table": (HEADER, rows), "p": f"{p:.2f}", "few": sizes[0], "more": sizes[1], "notch": f"{NOTCH:g}", "rate": PULL["rate"],
            "spheres": ", ".join(map(str, sizes)), "spacings": ", ".join(f"{spacing(n):.2f}" for n in sizes), "works": listed(CONSTANT, ".1f", lambda n, xi, found: work_of(found)),
            "strains": listed(CONSTANT, ".2f", lambda n, xi, found: 100 * statistics.mean(rupture.strain for rupture, _ in found)),
            "inverse": listed(INVERSE, ".1f", lambda n, xi, found: work_of(found)), "kept": listed(POWER, ".1f", lambda n, xi, found: work_of(found)),
            "xis": listed(POWER, ".3g", lambda n, xi, found: xi), "keptat": ", ".join(map(str, sizes[1:]))}


def main(words=None):
    with Study(__doc__, "notched_tension", spheres=[4000, 16000, 64000], xi=0.05, seeds=[2, 2, 1]).started(words) as study:
        few, more = study.spheres[:2]
        results = measure(study, [*((n, study.xi, CONSTANT) for n in study.spheres), (more, study.xi * spacing(few) / spacing(more), INVERSE)])
        p = exponent_of(results, few, more)
        results.update(measure(study, [(n, study.xi * (spacing(few) / spacing(n)) ** p, POWER) for n in study.spheres[1:]]))
        study.draw({f"N = {n}, XI = {xi:.3g}": (100 * found[0][1].strain, found[0][1].grip / 1e6) for (n, xi, _), found in results.items()},
                   ("curve", "strain_percent", "stress_MPa"), xlabel="nominal strain [%]", ylabel="nominal stress, net section [MPa]")
        study.write(**page(results, p, study.spheres))


if __name__ == "__main__":
    main()
