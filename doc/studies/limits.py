# SPDX-License-Identifier: GPL-2.0-only
"""What the steps between two updates of plastic strains and limits change: keyword update of pair_style evp/lj, for the section of time_order.py.

Bodies of 500 spheres by the shipped input scripts, with 1, 10 and 40 steps and two timesteps: hardening, softening by the flow table and by heat, and a limit that
depends on the strain rate.
"""

from typing import NamedTuple

from study import CHECKOUT
import numpy as np

UPDATES = (1, 10, 40)
FRACTIONS = (0.4, 0.2)  # of the largest stable timestep
SHARE = 0.025  # strain in 10 steps over that at which a stress is wanted, below which 10 steps do
BODIES = {"cylinder": {"n": 500}, "periodic": {"n": 500, "shape": "periodic", "length": 0.04}, "bar": {"n": 500, "length": 0.0324, "radius": 0.0032}}
ENERGY = """fix energy all evp/energy
fix imbalance all print ${every} "$(f_rows[1]:%.9g),$(f_energy:%.9g),$(f_energy[9]:%.9g)" file ${out}_energy.csv screen no title strain,imbalance,work
"""
HEAT = """fix properties all property/atom temperature heatflow ghost yes
set group all temperature 298
fix heat all evp/heat every 200
"""


class Case(NamedTuple):
    """One load. at: strains whose stresses are compared, of the Taylor bar none: its length is."""

    name: str
    deck: str
    body: str
    row: str  # of potentials/metals.evp
    rate: float = 0.0  # [1/s]
    at: tuple = ()
    more: str = ""  # words of the row
    also: str = ""


CASES = (
    Case("hardening, tension", "in.traction", "cylinder", "aluminium_1100O", 10.0, (0.004, 0.02)),
    Case("hardening, shear", "in.shear", "periodic", "aluminium_1100O", 500.0, (0.01, 0.1)),
    Case("hardening, shear", "in.shear", "periodic", "aluminium_1100O", 5000.0, (0.05, 0.2)),
    Case("hardening, Taylor bar", "in.taylor", "bar", "copper_taylor"),
    Case("softening by flow, tension", "in.traction", "cylinder", "titanium_6Al4V", 10.0, (0.01, 0.02)),
    Case("softening by flow, shear", "in.shear", "periodic", "titanium_6Al4V", 500.0, (0.05, 0.1)),
    Case("softening by heat, shear", "in.shear", "periodic", "aluminium_2024T351", 500.0, (0.05, 0.2), "", HEAT),
    Case("rate, shear", "in.shear", "periodic", "steel_4340", 500.0, (0.05, 0.2), "rate 0.014 1", HEAT),
)
TIMED, ROUNDS = Case("", "in.shear", "periodic", "titanium_6Al4V", 500.0, (0.03, 0.13)), 3
HEADER = ("load", "row", "rate [1/s]", "dt", "strain in 10 steps", "with update 1", *(f"update {n} [%]" for n in UPDATES[1:]), "energy imbalance [%]")


class Found(NamedTuple):
    """Of one case, update and timestep."""

    values: tuple  # stresses [MPa], or the length of the bar [mm]
    step: float  # strain of a step, 0 of the bar
    imbalance: float
    seconds: float  # of the processor
    steps: int


def coefficients(row, more):
    """Of a row of metals.evp, with more words."""
    lines = (CHECKOUT / "potentials" / "metals.evp").read_text(encoding="utf-8").splitlines()
    return f"{next(line for line in lines if line.startswith(row + ' ')).split(maxsplit=1)[1]} {more}".strip()


def measure(case, update, fraction, runs, name=""):
    """Its Found. name: of what is not of CASES."""
    name = f"limits_{name or CASES.index(case)}_{update}_{fraction:g}"
    bar = case.deck == "in.taylor"
    also = runs.folder / f"{name}.also"
    also.write_text(case.also + ("" if bar else ENERGY), encoding="utf-8")
    choices = {"specimen": runs.body(f"limits_{case.body}", **BODIES[case.body]), "coeff": coefficients(case.row, case.more), "plasticity": "isotropic",
               "contact": f"{'repulsive' if bar else 'join'} update {update}", "dtfraction": fraction, "also": also}
    if not bar:
        choices.update(rate=case.rate, strain=max(case.at), row=0.001)
    text = runs.run(case.deck, name, **choices)
    steps = int(text.rpartition("Loop time of")[2].split(" for ")[1].split()[0])
    if bar:
        imbalance = float(text.rpartition("over impact energy: ")[2].split()[0])
        return Found((1e3 * runs.curve(name, "length")["length"][-1],), 0.0, imbalance, runs.seconds(name), steps)
    stress = "stress_virial" if case.deck == "in.traction" else "shear_stress"
    curve, energy = runs.curve(name, "strain", stress), runs.curve(f"{name}_energy", "imbalance", "work")
    values = tuple(float(np.interp(at, curve["strain"], curve[stress])) / 1e6 for at in case.at)
    return Found(values, max(case.at) / steps, abs(energy["imbalance"][-1]) / energy["work"][-1], runs.seconds(name), steps)


def differences(found, exact):
    """Of the values from those with the same timestep and update 1 [%]."""
    return [100.0 * (value / wanted - 1.0) for value, wanted in zip(found.values, exact.values)]


def costs(runs):
    """{update: processor time of a step over that with update 10}: the least of some rounds, without starts, of a body that flows at each step."""
    case, least = TIMED, {}
    for rnd in range(ROUNDS):
        for update in UPDATES:
            short, long = (measure(case._replace(at=(end,)), update, 0.1, runs, f"{rnd}_{end:g}") for end in case.at)
            least[update] = min(least.get(update, np.inf), (long.seconds - short.seconds) / (long.steps - short.steps))
    return {update: f"{seconds / least[10]:.2f}" for update, seconds in least.items()}


def within(found):
    """Largest difference of update 10 from update 1 [%] where the strain in 10 steps is at most SHARE of that at which the stress is read."""
    pairs = [(10 * one.step / at, abs(off)) for (case, update, fraction), one in found.items() if update == 10
             for at, off in zip(case.at, differences(one, found[case, 1, fraction]))]
    return f"{max(off for share, off in pairs if share <= SHARE):.1f}"


def changes(found):
    """Table of {(case, update, fraction): Found}; {update: difference from update 1, the largest and the median [%]}."""
    rows, largest = [], {update: [] for update in UPDATES[1:]}
    for case, fraction in dict.fromkeys((case, fraction) for case, _, fraction in found):
        exact = found[case, 1, fraction]
        off = {update: differences(found[case, update, fraction], exact) for update in largest}
        for update, values in off.items():
            largest[update] += map(abs, values)
        with_one = ", ".join(f"{value:.1f} MPa at {at:g}" for value, at in zip(exact.values, case.at)) or f"{exact.values[0]:.2f} mm long"
        rows.append((case.name, f"{case.row} {case.more}".strip(), f"{case.rate:g}" if case.at else "", f"{fraction:g}", f"{10 * exact.step:.1e}" if case.at else "", with_one,
                     *(", ".join(f"{value:+.2f}" for value in values) for values in off.values()),
                     ", ".join(f"{100 * found[case, update, fraction].imbalance:.3f}" for update in UPDATES)))
    return (HEADER, rows), {update: (f"{max(values):.1f}", f"{np.median(values):.1f}") for update, values in largest.items()}
