#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Young's modulus of one row on bodies with different numbers of spheres, sizes and shapes.

in.specimen packs the bodies, tools/body.py the dog bone; in.quasistatic measures Young's modulus within the elastic range.
"""

import pathlib
import sys

from study import CHECKOUT, Study, tangent

STRAIN = 2e-4
FEWEST = 2000  # spheres from which on a difference is judged: below, walls take too much of the body
BONE = "dog bone, STL"
# Choices of in.specimen, and the difference that is accepted.
BODIES = {
    "cylinder 0.05 x 0.02 m": ({}, 0.03),
    "cylinder 0.08 x 0.015 m": ({"length": 0.08, "radius": 0.015}, 0.06),
    "cylinder 5 x 2 mm": ({"length": 0.005, "radius": 0.002}, 0.03),
    "block 50 x 10 x 10 mm": ({"shape": "block", "length": 0.05, "width": 0.01, "height": 0.01}, 0.06),
    BONE: (None, 0.06),
}


def young(runs, body, spheres, row):
    """Young's modulus [Pa]: of the dog bone over the strain between two layers, as its ends hardly strain."""
    name, choices = f"{list(BODIES).index(body)}_{spheres}", BODIES[body][0]
    if choices is None:
        runs.keep(f"{name}.data", [sys.executable, CHECKOUT / "tools" / "body.py", CHECKOUT / "lammps_inputs" / "dog_bone.stl",
                                   "--axis", "z", "--n", spheres, "--out", f"{name}.data"])
    else:
        runs.body(name, n=spheres, **choices)
    runs.run("in.quasistatic", f"{name}_pulled", specimen=f"{name}.data", contact="none", material=row, strain=STRAIN, increment=STRAIN / 2)
    strain = "strain_gauge" if body == BONE else "strain"
    return tangent(runs.curve(f"{name}_pulled", strain, "stress_virial"), strain, "stress_virial")


def page(found, row):
    """Values of the section, of {(body, spheres): Young's modulus}."""
    sizes = sorted({spheres for _, spheres in found})
    reference = found[next(iter(BODIES)), sizes[-1]]
    off = {case: value / reference - 1.0 for case, value in found.items()}
    judged = {case: abs(share) for case, share in off.items() if case[1] >= min(FEWEST, sizes[-1])}
    missed = [f"{body} with {spheres} spheres" for (body, spheres), share in judged.items() if share > BODIES[body][1]]
    rows = [[body, f"{100 * within:.0f} %", *(f"{found[body, n] / 1e9:.2f} ({100 * off[body, n]:+.1f} %)" for n in sizes)] for body, (_, within) in BODIES.items()]
    return {"row": row, "most": sizes[-1], "fewest": min(spheres for _, spheres in judged), "worst": f"{100 * max(judged.values()):.1f}",
            "verdict": f"beyond their limits: {', '.join(missed)}." if missed else "all are within their limits.",
            "table": (["body", "limit", *(f"N = {n}" for n in sizes)], rows)}


def main(words=None):
    with Study(__doc__, "any_body", "validation", row="potentials/gado2017.evp:table1_any", spheres=[500, 2000, 8000]).started(words) as study:
        file, _, name = study.row.rpartition(":")
        path = pathlib.Path(file) if pathlib.Path(file).exists() else CHECKOUT / file
        plan = [(body, spheres) for spheres in sorted(study.spheres) for body in BODIES]
        cases = study.each(plan, lambda case: f"{case[0]}, {case[1]} spheres", lambda case: case[1] ** (4.0 / 3.0))
        study.write(**page({case: young(study.runs, *case, f"{path.resolve()}:{name}") for case in cases}, study.row))


if __name__ == "__main__":
    main()
