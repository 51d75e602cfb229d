#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Work of rupture against the spacing of the spheres, with `break XI`.

in.traction pulls cylinders of the same size with increasing numbers of spheres to rupture, with constant XI and with XI ~ 1/spacing.
"""

import statistics
from typing import NamedTuple

from study import RunError, Study, errors_in_one_line
import numpy as np
from evp import curves

SPHERES = (500, 1000, 2000, 4000)
FREE_LENGTH = 0.04  # between the grips [m]
PARTED = 0.1  # of the largest stress: below it the body has parted
PULL = {"coeff": "80 8 4 3 8 4 0.005 100 1.5", "contact": "repulsive", "plasticity": "isotropic", "rate": 100, "strain": 0.15, "row": 0.0005,
        "dtfraction": 0.8}


class Rupture(NamedTuple):
    """Of a pull: largest stress [MPa], strain at it, strain of rupture, work of the grips up to and beyond it per cross-section [kJ/m2], bonds that broke."""

    peak: float
    at: float
    strain: float
    before: float
    after: float
    broken: int

    @property
    def work(self):
        return self.before + self.after


def rupture_of(curve, broken):
    """The Rupture of a curve. RunError where the body has not parted."""
    strain, stress = curve.strain, curve.grip
    top = int(np.argmax(stress))
    gone = np.nonzero(stress[top:] < PARTED * stress[top])[0]
    if len(gone) == 0:
        raise RunError(f"the body has not parted at a strain of {strain[-1]:g}: {stress[-1]:.3g} Pa of {stress[top]:.3g} Pa are left")
    work = np.append(0.0, np.cumsum(0.5 * (stress[1:] + stress[:-1]) * np.diff(strain))) * FREE_LENGTH / 1e3
    end = top + gone[0]
    return Rupture(stress[top] / 1e6, strain[top], strain[end], work[top], work[end] - work[top], broken)


def pull(runs, data, xi, **choices):
    """(Rupture, curve) of a body."""
    name = f"{data[:-len('.data')]}_{xi:.4g}"
    runs.run("in.traction", name, specimen=data, **{"break": f"{xi:.6g}"}, **choices)
    curve = curves.read_curve(runs.folder / f"{name}.csv")
    return rupture_of(curve, int(runs.curve(name, "broken")["broken"][-1])), curve


def number(values, form):
    """Mean, and of several bodies the largest departure of one."""
    mean = statistics.mean(values)
    return f"{mean:{form}}" + (f" +- {max(abs(value - mean) for value in values):{form}}" if len(values) > 1 else "")


def main(words=None):
    study, results = Study(__doc__, "rupture_work", xi=0.05, seeds=2, spheres=list(SPHERES)).parse(words), {}
    few = study.spheres[0]
    with errors_in_one_line("rupture_work.py"):
        cases = dict.fromkeys((n, xi) for scale in (0.0, 1.0 / 3.0) for n in study.spheres for xi in [study.xi * (n / few) ** scale])
        plan = [(n, xi, seed) for n, xi in cases for seed in range(1, study.seeds + 1)]
        for n, xi, seed in study.each(plan, lambda run: f"{run[0]} spheres, XI {run[1]:.3g}, seed {run[2]}", lambda run: run[0] ** (4.0 / 3.0)):
            data = study.runs.body(f"specimen_{n}_{seed}", n=n, seed=seed)
            results.setdefault((n, xi), []).append(pull(study.runs, data, xi, **PULL)[0])
        rows = [(n, f"{xi:.3g}", *(number([getattr(one, name) for one in found], ".0f") for name in ("peak", "before", "after", "work", "broken")))
                for (n, xi), found in results.items()]
        study.write(few=few, seeds=study.seeds, table=(
            ("spheres", "XI", "largest stress [MPa]", "work up to it [kJ/m2]", "work beyond it [kJ/m2]", "all work [kJ/m2]", "bonds broken"), rows))


if __name__ == "__main__":
    main()
