# SPDX-License-Identifier: GPL-2.0-only
"""Round bars with a waist that are pulled until they part: the plastic strain of the section beside that of Johnson and Cook's formula."""

import math
import re
from typing import NamedTuple

import numpy as np

from . import curves, specimen
from .run import Job, last_strain, run_jobs

NECK, DEPTH, LENGTH = 5e-3, 2.5e-3, 0.04  # [m]: radius of the smallest section, how much larger that of the ends is, length
SLICE = 3e-3  # [m] thickness of what is looked at in the waist; its core has a fifth of the radius
WAISTS = {0.08: 0.16, 0.012: 0.1, 0.003: 0.1}  # {radius of the waist [m]: strain of the grips by which a bar has parted}
RATE = 100  # [1/s] of the bars
# Taken in by in.traction: of the slice and the spheres at its axis, each row
ALSO = f"""
region          slice block $(0.5*v_length-{0.5 * SLICE:g}) $(0.5*v_length+{0.5 * SLICE:g}) INF INF INF INF
group           slice region slice
region          axis cylinder x 0 0 {0.2 * NECK:g} $(0.5*v_length-{0.5 * SLICE:g}) $(0.5*v_length+{0.5 * SLICE:g})
group           axis region axis
compute         own all evp/state/atom plastic_strain triaxiality damage
compute         slice slice reduce ave c_own[5]
compute         most slice reduce max c_own[7]
compute         axis axis reduce ave c_own[6]
fix             slice all print ${{every}} "$(v_strain_now:%.9g),$(c_slice:%.9g),$(c_most:%.9g),$(c_axis:%.9g)" &
                file ${{out}}_slice.csv screen no title strain,plastic_strain,damage,triaxiality
"""


class Parted(NamedTuple):
    """strain: mean plastic strain of the slice when its first sphere has parted; triaxiality: at the axis, at first and mean over the plastic strain until then."""

    strain: float
    at_first: float
    triaxiality: float


def strain_at_failure(damage, triaxiality):
    """Plastic strain, of D1 D2 D3 (Johnson and Cook), at the reference rate and temperature."""
    return damage[0] + damage[1] * math.exp(damage[2] * triaxiality)


def bridgman(waist):
    """Triaxiality at the axis of a bar with a waist of this radius [m]."""
    return 1.0 / 3.0 + math.log(1.0 + NECK / (2.0 * waist))


def turn(rod, waist, bar):
    """Turns a bar from a cylinder of LENGTH and radius NECK + DEPTH, data files with their FILE.body: it is without the spheres that reach out of it."""
    whole = specimen.read_data(rod)
    from_middle = np.minimum(np.abs(whole.x[:, 0] - 0.5 * LENGTH), waist)
    deep = np.minimum(DEPTH, waist - np.sqrt(waist**2 - from_middle**2))
    kept = np.hypot(whole.x[:, 1], whole.x[:, 2]) + whole.radius <= NECK + deep
    box = "".join(f"{low:.9g} {high:.9g} {axis}lo {axis}hi\n" for axis, (low, high) in zip("xyz", whole.box))
    atoms = "".join(f"{k} 1 {2.0 * r:.17g} 1 {x[0]:.17g} {x[1]:.17g} {x[2]:.17g}\n" for k, (r, x) in enumerate(zip(whole.radius[kept], whole.x[kept]), 1))
    bar.write_text(f"{bar.stem}\n\n{kept.sum()} atoms\n1 atom types\n\n{box}\nAtoms # sphere\n\n{atoms}", encoding="utf-8")
    text = rod.with_name(f"{rod.name}.body").read_text(encoding="utf-8").partition("variable radius")[0]
    text = re.sub(r"(variable volume equal )(\S+)", lambda found: f"{found[1]}{float(found[2]) * kept.mean():.9g}", text)
    text = re.sub(r"(variable area equal )\S+", rf"\g<1>{math.pi * NECK**2:.9g}", text)
    bar.with_name(f"{bar.name}.body").write_text(text, encoding="utf-8")


def read(path):
    """The Parted of a PREFIX_slice.csv; CurveError where no sphere of the slice has parted."""
    found = curves.read_columns(path, ("strain", "plastic_strain", "damage", "triaxiality"))
    parted = np.flatnonzero(found["damage"] >= 1.0)
    if len(parted) == 0:
        raise curves.CurveError(f"{path}: no sphere of the waist has parted at a strain of {found['strain'][-1]:g}")
    first = int(parted[0])
    before = np.arange(max(first, 1))
    flows = before[found["plastic_strain"][before] > min(0.01, 0.1 * found["plastic_strain"][first])]
    flows = flows if len(flows) else before[-1:]
    triaxiality, growth = found["triaxiality"][flows], np.gradient(found["plastic_strain"])[flows]
    mean = np.average(triaxiality, weights=growth) if growth.sum() > 0.0 else triaxiality.mean()
    return Parted(float(found["plastic_strain"][first]), float(triaxiality[0]), float(mean))


def pull_bars(coeff, folder, ranks, spheres):
    """{waist: Parted} of bars with a row, the words of -var coeff, which has damage and rupture; None of a bar that has not parted. As many runs at once as there are ranks."""
    run_jobs([Job("rod", "in.specimen", {"n": spheres, "length": LENGTH, "radius": NECK + DEPTH, "out": "rod.data"}, folder)], ranks, "packing of a round bar")
    (folder / "slice.lmp").write_text(ALSO, encoding="utf-8")
    jobs = {}
    for k, (waist, end) in enumerate(WAISTS.items()):
        turn(folder / "rod.data", waist, folder / f"bar{k}.data")
        variables = {"specimen": f"bar{k}.data", "coeff": coeff, "plasticity": "isotropic", "contact": "join", "rate": RATE, "strain": end, "row": end / 400, "also": "slice.lmp", "out": f"bar{k}"}
        jobs[waist] = Job(f"waist of {1e3 * waist:g} mm", "in.traction", variables, folder, 1, end, lambda k=k, end=end: last_strain(folder / f"bar{k}.csv") / end)
    run_jobs(list(jobs.values()), ranks, "round bars, to rupture")
    found = {}
    for k, waist in enumerate(WAISTS):
        try:
            found[waist] = read(folder / f"bar{k}_slice.csv")
        except curves.CurveError:
            found[waist] = None
    return found
