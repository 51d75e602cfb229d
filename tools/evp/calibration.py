# SPDX-License-Identifier: GPL-2.0-only
"""Calibration: the row of a metal by its E, Poisson's ratio and flow curve.

Spheres of the row flow at its flow curve (the keyword `yield`, doc/pair_evp_lj.rst), so that runs find e1 and kv alone. A closed form gives
the first row: in a body with Nb/V bonds and N/V particles per volume, the network of bonds has the moduli E0 = m1 n1 e1 Nb/(6 V), K = E0/1.5
and G = 0.4 E0, and fix evp/volume adds kv N/V to K. in.moduli measures the moduli of a periodic body; then E and Poisson's ratio are multiplied by target/measured.
Rows are rounded before they run: the row written is one that ran.

The row is then pulled, pressed and sheared, by in.uniaxial and in.shear on the same body: what it misses is told. The over-stress of damping grows nearly as
gamma: runs with gamma and a twin without.
"""

import csv
import fcntl
import math
import os
import pathlib
import re
import shutil
from typing import NamedTuple, Optional, Tuple

import numpy as np
from scipy.integrate import trapezoid

from . import curves, figures, flow, law, specimen
from .curves import YIELD_OFFSET
from .report import all_or_nothing
from .run import DECKS, Failed, Job, last_strain, run_jobs

EXPONENTS = (8.0, 4.0)  # of both regimes, as in Table 1
ALPHA = 1.5
LEAST_NU, LARGEST_NU = 0.25, 0.42  # of central forces alone; where lateral stiffness leaves the closed form (doc/fix_evp_volume.rst)
NU_LIMIT = 0.48  # of the closed form
XI_RANGE = (2e-5, 0.05)  # of y: below, round-off of positions shows; above, the first regime itself is bent
SOFTENING = 3.0 / 80.0  # e2/e1 as in Table 1: with a table flow only eq. 8, plasticity none, has a second regime
REACH = 1.5  # flow stress over E0 xi_s, at first yield; what is off is the factor of the yield condition
BULK, SHEAR = 1.0 / 1.5, 0.4  # K/E0 without the volume energy, which adds x; G/E0
DENSITIES = (100.0, 3e4)  # [kg/m3] between which the unit is no doubt
SOFTEST = 1e6  # [Pa] Young's modulus below which the unit is in doubt
LINEAR = 0.01  # over-stresses are linear in the rate within this
NAME = re.compile(r"[A-Za-z0-9_.+-]+")
MOST_PASSES, RATE_RUNS = 6, 4
SETTLED = 0.002  # of E and nu: a row that is off by less is the one
WITHIN = 0.005  # of an over-stress
PLASTIC = (0.0, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0, 1.5, flow.FAR)  # plastic strains of a table
FEW = 12  # points of a flow curve, which has bends there
LEAST_START = 0.7  # of the stress at the next plastic strain: at 0
MISES = math.sqrt(3.0)  # shear strain over the plastic strain, and true stress over the shear stress
SHEARED = "shear"
WAYS = {"tension": 0.22, "compression": -0.62}  # true strain at the end
SHEAR_END = 3.0  # shear strain
STRAINS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6)  # true, at which residuals are told
SHEAR_STRAINS = (0.5, 1.0, 2.0, 3.0)  # likewise
YIELD = "0.2 % yield"
MISSES = {"E": 0.02, "nu": 0.03, YIELD: 0.08}  # residuals beyond which a target is missed
STRESS_MISS = {"shear": 0.06}  # likewise of stresses, else:
MISS = 0.05
ROW = 0.001  # true strain between the rows of a way
SMOOTHED, SMOOTHED_ROWS = 0.2, 20  # shear strain over which the shear stress is averaged; its rows
INERTIA = 0.001  # strain rate times spacing over sqrt(stress/density): half of it gives the same stress within 1 %
DTFRACTION = 0.6
CHECKED = 0.052  # true strain to which a row is pulled at a temperature
CHECK_SPEED = 0.2  # over rate_of(): a body that softens yields earlier, where inertia shows first
SPHERES = 1000
EDGE = 0.04  # of the periodic body [m]
LENGTH, RADIUS = 0.05, 0.0125  # of the cylinder [m] on which pages show rows
HEAD = """# UNITS: si CONTRIBUTOR: tools/calibrate.py, which appends the rows
# NAME e1 m1 n1 e2 m2 n2 xi_s gamma alpha, then spacing [m] and coordination of the body that it was found on, kv [J], density of the solid [kg/m3]
"""


class Targets(NamedTuple):
    """SI. curve: a FlowCurve; nu: None for that of the network; rates: (over-stress, rate)."""

    modulus: float
    curve: flow.FlowCurve
    density: float
    nu: Optional[float] = None
    rates: Tuple[Tuple[float, float], ...] = ()

    @property
    def places(self):
        """Plastic strains of the table: PLASTIC, and in place of those near them the points of a curve that has few, and where it is known no farther."""
        own = self.curve.plastic[1:] if len(self.curve.plastic) <= FEW else []
        given = {self.curve.end, *(float(point) for point in own if point < flow.FAR)}
        return np.array(sorted(given | {place for place in PLASTIC if not any(0.8 * point < place < 1.25 * point for point in given)}))

    @property
    def stresses(self):
        """Flow stresses [Pa] of the table, at places."""
        found = self.curve.at(self.places)
        found[0] = max(found[0], LEAST_START * found[1])  # power laws begin at 0
        return found

    def end(self, way):
        """Strain at which a way ends: true, or of SHEARED the shear strain; where the curve is known no farther, it ends there."""
        if way == SHEARED:
            return min(SHEAR_END, MISES * self.curve.end)
        known = self.curve.end + float(self.curve.at(self.curve.end)) / self.modulus
        return math.copysign(min(abs(WAYS[way]), known), WAYS[way])

    def residuals(self, moduli, runs):
        """{way: {what: found/target - 1}} of Moduli and {way: Run}: under "elastic" E and nu, of each way its true 0.2 % yield stress and the true
        stresses at STRAINS, of SHEARED the stresses at SHEAR_STRAINS."""
        off = {"elastic": {"E": moduli.young / self.modulus - 1.0}}
        if self.nu is not None:
            off["elastic"]["nu"] = moduli.nu / self.nu - 1.0
        for way, run in runs.items():
            if way == SHEARED:
                off[way] = {at: run.at(at) / (float(self.curve.at(at / MISES)) / MISES) - 1.0 for at in SHEAR_STRAINS if at <= self.end(way) * (1.0 + 1e-9)}
                continue
            off[way] = {YIELD: run.offset_yield(self.modulus) / self.true_yield() - 1.0}
            for at in STRAINS:
                if at <= abs(self.end(way)) * (1.0 + 1e-9) and at * self.modulus > 1.1 * self.stresses[0]:
                    off[way][at] = run.at(at) / self.curve.true_stress(at, self.modulus)[0] - 1.0
        return off

    def true_yield(self):
        """True stress [Pa] of the curve at a plastic strain of 0.2 %."""
        return float(self.curve.at(YIELD_OFFSET))


def told(off):
    """'0.2 % yield +1.2 %, at 1 % -0.3 %' of {what: residual}."""
    return ", ".join(f"{name_of(what)} {100.0 * value:+.1f} %" for what, value in off.items())


def name_of(what):
    """What a residual is of, in words."""
    return what if isinstance(what, str) else f"at {100.0 * what:g} %"


def limit_of(way, what):
    """Beyond which a residual is told as a miss."""
    return MISSES[what] if isinstance(what, str) else STRESS_MISS.get(way, MISS)


class Moduli(NamedTuple):
    """Of an isotropic body: Young's [Pa], Poisson's ratio, bulk and shear [Pa]."""

    young: float
    nu: float
    bulk: float
    shear: float


class Run(NamedTuple):
    """What one way measured, as sizes: strain and stress [Pa], true; of SHEARED shear strain and shear stress."""

    strain: np.ndarray
    stress: np.ndarray

    def at(self, strain):
        """Stress [Pa]; nan beyond the last strain."""
        return float(np.interp(strain, self.strain, self.stress, right=math.nan))

    def offset_yield(self, modulus):
        """Stress [Pa] where the curve meets modulus (strain - 0.2 %)."""
        above = self.stress - modulus * (self.strain - YIELD_OFFSET)
        below = np.flatnonzero(above <= 0.0)
        if not len(below) or below[0] == 0:
            return math.nan
        k = int(below[0])
        share = above[k - 1] / (above[k - 1] - above[k])
        return float(self.stress[k - 1] + share * (self.stress[k] - self.stress[k - 1]))


def check(targets):
    """ValueError where a target has no meaning, or is in another unit."""
    modulus, nu, curve = targets.modulus, targets.nu, targets.curve
    if not DENSITIES[0] <= targets.density <= DENSITIES[1]:
        raise ValueError(f"--density: {targets.density:g} kg/m3 is no solid's: give kg/m3, such as 2700")
    if modulus < SOFTEST:
        raise ValueError(f"--E: {modulus:g} Pa is softer than any metal: give all moduli and stresses in Pa, such as 70e9 for 70 GPa")
    if nu is not None and not LEAST_NU <= nu <= LARGEST_NU:
        raise ValueError(f"--nu: {nu:g} cannot be had: central forces give {LEAST_NU:g} (--nu none), the volume energy raises it, and from {LARGEST_NU:g} on is "
                         "so stiff that the timestep falls")
    lowest, highest = curve.at(PLASTIC[1]), curve.at(PLASTIC[-1])
    if not (XI_RANGE[0] <= lowest / modulus and highest / (REACH * modulus) <= XI_RANGE[1]):
        raise ValueError(f"the flow stress is {lowest:.6g} to {highest:.6g} Pa, {lowest / modulus:.3g} to {highest / modulus:.3g} of E, no metal's share: "
                         "give all moduli and stresses in Pa")
    if np.any(np.diff(curve.plastic) <= 0.0):
        raise ValueError("plastic strains must grow from stress to stress: one is at a strain that is not beyond the 0.2 % yield stress, or the curve rises steeper than E")
    if np.any(np.diff(curve.stress) < 0.0):
        raise ValueError("true stresses fall as the plastic strain grows: where a test shows this its bar has a neck. End at the largest force "
                         "(nominal stresses of a compression grow with the cross-section: give negative strains if those are meant)")
    if targets.rates:
        ordered = sorted(targets.rates, key=lambda pair: pair[1])
        (over0, rate0), (over1, rate1) = ordered[0], ordered[-1]
        if not 0.0 < rate0 <= rate1 < math.inf:
            raise ValueError("--rate: give positive rates")
        slopes = [over / rate for over, rate in ordered]
        if rate1 > 10.0 * rate0 * (1.0 + 1e-9) and max(slopes) > (1.0 + LINEAR) * min(slopes):
            raise ValueError(f"--rate: the over-stresses {over0:g} Pa at {rate0:g}/s and {over1:g} Pa at {rate1:g}/s are not linear in the rate over more than "
                             f"a decade. Damping is linear: it follows a logarithmic law over about one decade only; the nearest with {over1:g} Pa at "
                             f"{rate1:g}/s has {over1 * rate0 / rate1:.4g} Pa at {rate0:g}/s. Give one of them")


def check_file(path, name):
    """ValueError where a row of this name cannot be appended to the potential file. Writes nothing."""
    if not NAME.fullmatch(name):
        raise ValueError(f"--name: '{name}' cannot be the name of a row: letters, digits and _ . + - only")
    path = pathlib.Path(path)
    if not path.exists():
        return
    lines = path.read_text(encoding="utf-8").splitlines()
    if not lines or not re.match(r"#.*\bUNITS:\s*si(\s|$)", lines[0]):
        raise ValueError(f"--out: {path} is no potential file in SI units: its first line must be a comment with 'UNITS: si'")
    if any(line.split()[:1] == [name] for line in lines):
        raise ValueError(f"--name: {path} holds a row '{name}' already: give another name, or take that row out")


def volume_ratio(nu):
    """kv N/(V E0) that gives Poisson's ratio nu."""
    return 2.0 * SHEAR * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)) - BULK


def moduli(volume):
    """(E/E0, Poisson's ratio) with the volume energy, the latter the inverse of volume_ratio()."""
    bulk = BULK + volume
    return 9.0 * bulk * SHEAR / (3.0 * bulk + SHEAR), (3.0 * bulk - 2.0 * SHEAR) / (2.0 * (3.0 * bulk + SHEAR))


class Body(NamedTuple):
    """A periodic packing, and what its bonds are."""

    path: pathlib.Path
    count: int
    bonds: int
    spacing: float  # mean deq [m]
    square: float  # mean deq^2 [m2]
    volume: float = EDGE**3  # [m3]

    @property
    def coordination(self):
        return 2.0 * self.bonds / self.count


def make_body(folder, count, seed, density):
    """The Body of in.specimen, periodic.data in the folder; made on one rank, as another number of ranks gives another packing. density: of the solid."""
    variables = {"n": count, "shape": "periodic", "length": EDGE, "seed": seed, "density": f"{density:.9g}", "out": "periodic.data"}
    call("in.specimen", variables, 1, folder, f"packing of {count} spheres without a surface")
    read = specimen.read_data(folder / "periodic.data")
    deq = specimen.bond_lengths(read, ALPHA, periodic=True)
    return Body(folder / "periodic.data", len(read.ids), len(deq), float(deq.mean()), float(np.mean(deq**2)))


def call(deck, variables, ranks, folder, title, share=lambda: 0.0):
    """Run a deck in the folder; Failed where it ends badly, RunError where it does not even start. share: a function that gives what is done of it, 0 to 1."""
    try:
        run_jobs([Job(pathlib.PurePath(deck).name, deck, variables, folder, ranks, done=share)], ranks, title)
    except Failed as failure:
        raise Failed(str(failure).partition("\n  whole output:")[0]) from failure


class Material(NamedTuple):
    """A row; kv [J]: 0 without; flow: p0 Y0 p1 Y1 ...; stress: flow stress at Y = 1 [Pa]; density of the solid [kg/m3]."""

    row: law.Row
    kv: float
    flow: Tuple[float, ...]
    stress: float
    density: float

    def words(self, spacing, coordination):
        """As a potential file has it after the name; the measures of the body are texts."""
        numbers = {"": self.row, f"spacing {spacing} coordination {coordination}": (), "kv": (self.kv,) if self.kv else None, "flow": self.flow,
                   "yield": (self.stress,), "density": (self.density,)}
        return " ".join(" ".join([name, *(f"{value:.6g}" for value in values)]).strip()
                        for name, values in numbers.items() if values is not None)


def typed(body, material):
    """What a load deck is told of a Material that holds for a Body as it is."""
    return {"specimen": body.path.name, "coeff": material.words(f"{body.spacing:.15g}", f"{body.coordination:.15g}"), "plasticity": "isotropic", "contact": "join"}


def moduli_of(material, folder, title):
    """Moduli of a material, the deck's variables that choose it and its periodic body."""
    call("in.moduli", {**material, "out": "moduli"}, 1, folder, title)
    with open(folder / "moduli.csv", encoding="utf-8") as table:
        found = {name: float(value) for name, value in next(csv.DictReader(table)).items()}
    return Moduli(found["young"], found["poisson"], found["bulk"], found["shear"])


def rate_of(targets, body, plastic):
    """A strain rate [1/s] at which inertia does not show in the stress at a plastic strain."""
    return INERTIA * math.sqrt(float(targets.curve.at(plastic)) / targets.density) * body.count ** (1.0 / 3.0) / body.volume ** (1.0 / 3.0)


def jobs_of(material, targets, body, folder, speed=1.0):
    """{way: Job} that load a material, the deck's variables that choose it and its body, one rank each. speed: over that of rate_of()."""
    jobs = {}
    for way in WAYS:
        end = targets.end(way)
        variables = {**material, "strain": f"{end:.9g}", "rows": max(100, math.ceil(abs(end) / ROW)), "rate": f"{speed * rate_of(targets, body, 0.02):.6g}",
                     "dtfraction": DTFRACTION, "out": way}
        jobs[way] = Job(way, "in.uniaxial", variables, folder, 1, abs(end), lambda way=way, end=end: last_strain(folder / f"{way}.csv") / end)
    end = targets.end(SHEARED)
    if end > 0.55:
        end += 0.51 * SMOOTHED
        variables = {**material, "strain": f"{end:.9g}", "row": SMOOTHED / SMOOTHED_ROWS, "rate": f"{speed * 2.5 * rate_of(targets, body, 1.0):.6g}",
                     "dtfraction": DTFRACTION, "out": SHEARED}
        jobs[SHEARED] = Job(SHEARED, "in.shear", variables, folder, 1, 0.4 * end, lambda: last_strain(folder / f"{SHEARED}.csv") / end)
    for way in jobs:
        (folder / f"{way}.csv").unlink(missing_ok=True)  # of the run before, which would be taken for progress
    return jobs


def loads(material, targets, body, folder, ranks, title, speed=1.0):
    """{way: Run} of a material, as many runs at once as there are ranks."""
    jobs = jobs_of(material, targets, body, folder, speed)
    run_jobs(list(jobs.values()), ranks, title)
    runs = {}
    for way in jobs:
        if way == SHEARED:
            curve, window = curves.read_curve(folder / f"{way}.csv"), np.full(SMOOTHED_ROWS, 1.0 / SMOOTHED_ROWS)
            runs[way] = Run(*(np.convolve(values, window, "valid") for values in (curve.strain, curve.virial)))
        else:
            runs[way] = read_run(folder / f"{way}.csv")
    return runs


def flow_stress(material, targets, body, rate, folder, title):
    """Mean true stress [Pa], by von Mises, over the second half of a shear at a plastic strain rate."""
    end = MISES * max(0.03, 5.0 * (targets.stresses[0] / targets.modulus + YIELD_OFFSET))
    variables = {**typed(body, material), "strain": f"{end:.9g}", "rate": f"{MISES * rate:.9g}", "row": f"{end / 100.0:.6g}", "out": "rate",
                 "integrator": "implicit" if material.row.gamma > 0.0 else "explicit"}
    (folder / "rate.csv").unlink(missing_ok=True)
    call("in.shear", variables, 1, folder, title, lambda: last_strain(folder / "rate.csv") / end)
    curve = curves.read_curve(folder / "rate.csv")
    late = curve.strain > 0.5 * curve.strain[-1]
    return MISES * float(trapezoid(curve.virial[late], curve.strain[late]) / (curve.strain[late][-1] - curve.strain[late][0]))


def at_temperature(words, heat, targets, temperature, body, folder):
    """(Targets with the flow curve at a temperature [K], Run of a row that is pulled there). words: of the row, with heat: {keyword: numbers}, soften among
    them. With the keyword rate the flow curve is that at the rate of the run, as in doc/fix_evp_heat.rst."""
    tref, tmelt, m, floor = (*heat["soften"], 0.02)[:4]
    factor = max(floor, 1.0 - ((temperature - tref) / (tmelt - tref)) ** m)
    rate = CHECK_SPEED * rate_of(targets, body, 0.02) * math.sqrt(factor)
    constant, reference = heat.get("rate", (0.0, rate))
    factor *= 1.0 + constant * max(0.0, math.log(rate / reference))
    hot = targets._replace(curve=targets.curve._replace(stress=factor * targets.curve.stress))
    end = min(CHECKED, hot.end("tension"))
    shutil.copy(DECKS / "isothermal.lmp", folder)
    variables = {"specimen": body.path.name, "coeff": words, "plasticity": "isotropic", "contact": "join", "strain": f"{end:.9g}", "rows": 200, "rate": f"{rate:.6g}",
                 "dtfraction": DTFRACTION, "also": "isothermal.lmp", "temperature": f"{temperature:g}", "out": "hot"}
    (folder / "hot.csv").unlink(missing_ok=True)
    call("in.uniaxial", variables, 1, folder, f"tension at {temperature:g} K", lambda: last_strain(folder / "hot.csv") / end)
    return hot, read_run(folder / "hot.csv")


def read_run(path):
    """The Run of a CSV of in.uniaxial."""
    found = curves.read_columns(path, ("strain", "stress"))
    return Run(*(np.concatenate([[0.0], np.abs(found[name])]) for name in ("strain", "stress")))


class Result(NamedTuple):
    """moduli and runs: {way: Run} of the material; residuals: as of Targets.residuals(); passes: how many rows were run for the moduli."""

    material: Material
    moduli: Moduli
    runs: dict
    residuals: dict
    passes: int = 0

    def misses(self):
        """{way: {what: residual}} of those that are misses."""
        missed = {way: {what: value for what, value in off.items() if not abs(value) <= limit_of(way, what)}
                  for way, off in self.residuals.items()}
        return {way: off for way, off in missed.items() if off}


def closed_form(modulus, nu):
    """(E0 [Pa], kv N/(V E0)) of the E [Pa] and nu, or None, of a body: what its network has alone, and its volume energy beside it."""
    volume = 0.0 if nu is None else max(0.0, volume_ratio(min(nu, NU_LIMIT)))
    return modulus / moduli(volume)[0], volume


def material_of(modulus, nu, targets, body):
    """The Material, as it is printed, that by the closed form has this E [Pa] and nu, or None, in a Body, and the flow curve of the Targets."""
    (m, n), (network, volume) = EXPONENTS, closed_form(modulus, nu)
    return made(6.0 * network * body.volume / (m * n * body.bonds), volume * network * body.volume / body.count, network, targets)


def made(e1, kv, network, targets):
    """The Material, as it is printed, of an e1 and kv [J], whose network alone has this E [Pa], with the flow curve of the Targets."""
    (m, n), stresses, e1 = EXPONENTS, targets.stresses, rounded(e1)
    limits = np.clip(stresses / (REACH * network), *XI_RANGE)
    table = [(place, rounded(stress / stresses[0])) for place, stress in zip(targets.places, stresses)]
    row = law.Row(e1, m, n, rounded(SOFTENING * e1), m, n, rounded(limits[0]), 0.0, ALPHA)
    return Material(row, rounded(kv), tuple(value for point in table for value in point), rounded(stresses[0]), rounded(targets.density))


def scaled(row, more, modulus, nu, targets):
    """The Material of the Targets from the row of another metal with this E [Pa] and nu, without a run: e1 and kv [J] in the ratios of the closed form, the
    flow curve as it is. row: law.Row; more: its keywords, of which it needs yield, and kv where the Targets have a nu (ValueError)."""
    if "yield" not in more or (targets.nu is not None and "kv" not in more):
        raise ValueError("--like: the row has no 'yield' or no 'kv': take one of metals.evp, or of calibrate.py with a Poisson's ratio")
    (own, volume), (network, of_row) = closed_form(targets.modulus, targets.nu), closed_form(modulus, nu)
    kv = 0.0 if targets.nu is None else more["kv"] * volume * own / (of_row * network)
    return made(row.e1 * own / network, kv, more["yield"] / (REACH * row.xi_s) * own / network, targets)


def elastic_of(text, name):
    """(E [Pa], nu or None) of a row of calibrate.py by the comment above it; ValueError where there is none. text: of the potential file."""
    above = re.split(rf"^{re.escape(name)}\s", text, maxsplit=1, flags=re.M)[0].rstrip("\n").rsplit("\n\n", 1)[-1]
    modulus, nu = (re.search(rf"#   by: calibrate\.py .*--{key}[= ](\S+)", above) for key in ("E", "nu"))
    if not modulus:
        raise ValueError(f"--like: no comment above the row {name} says 'by: calibrate.py --E ...': take a row of metals.evp or of calibrate.py")
    return float(modulus[1]), 0.3 if nu is None else None if nu[1] == "none" else float(nu[1])


class Search:
    """Everything that a calibration needs: targets, body; ranks and folder of the runs; say(text)."""

    def __init__(self, targets, body, ranks, folder, say):
        self.targets, self.body, self.ranks, self.folder, self.say = targets, body, ranks, folder, say

    def result(self):
        """The Result: of at most MOST_PASSES rows the one whose moduli are nearest, loaded in all ways."""
        targets, found = self.targets, []
        modulus, nu = targets.modulus, targets.nu
        while len(found) < MOST_PASSES:
            material, number = material_of(modulus, nu, targets, self.body), len(found) + 1
            measured = moduli_of(typed(self.body, material), self.folder, f"pass {number}, moduli")
            off = targets.residuals(measured, {})["elastic"]
            found.append((max(map(abs, off.values())), material, measured))
            self.say(f"pass {number}, elastic: {told(off)}")
            if found[-1][0] < SETTLED:
                break
            modulus /= 1.0 + off["E"]
            nu = nu and nu / (1.0 + off["nu"])
        _, material, measured = min(found, key=lambda one: one[0])
        runs = loads(typed(self.body, material), targets, self.body, self.folder, self.ranks, "tension, compression and shear")
        off = targets.residuals(measured, runs)
        self.say("\n".join(f"{way}: {told(own)}" for way, own in off.items() if way != "elastic"))
        return Result(material, measured, runs, off, len(found))

    def gamma(self, result):
        """(gamma, over-stress/rate found [Pa s]); where several rates are asked for, of the geometric mean of their points."""
        rates = self.targets.rates
        over, rate = (math.exp(sum(math.log(pair[k]) for pair in rates) / len(rates)) for k in (0, 1))
        m, n = EXPONENTS
        material = result.material
        gamma = rounded(0.5 * over / (result.moduli.young * rate) * m * n * material.row.e1 / self.body.square)  # in flow twice E tau rate
        twin = self.rate_run(0, material, rate)
        power, before = 1.0, None  # over-stress goes with this power of gamma
        for number in range(1, RATE_RUNS + 1):
            found = self.rate_run(number, material._replace(row=material.row._replace(gamma=gamma)), rate) - twin
            self.say(f"rate run {number}: over-stress {found / 1e6:.4g} MPa at {rate:g}/s, {100 * (found / over - 1.0):+.2f} %")
            if abs(found / over - 1.0) <= WITHIN:
                return gamma, found / rate
            if found <= 0.0:
                raise ValueError(f"--rate: the damped run at {rate:g}/s shows no over-stress: {found:.3g} Pa")
            if before:
                power = max(0.5, math.log(found / before[1]) / math.log(gamma / before[0]))
            before = gamma, found
            gamma = rounded(gamma * (over / found) ** (1.0 / power))
        raise ValueError(f"--rate: the over-stress was not met within {100 * WITHIN:g} % in {RATE_RUNS} runs; the last had {found:.4g} Pa at {rate:g}/s")

    def rate_run(self, number, material, rate):
        """Mean flow stress [Pa] of a run."""
        return flow_stress(material, self.targets, self.body, rate, self.folder, f"rate run {number}" if number else "twin without damping")


def rounded(value):
    """The value as the row holds it: six digits."""
    return float(f"{value:.6g}")


def append(path, lines):
    """Append lines to a potential file, which is made where there is none. The file is replaced in one move; others who append wait."""
    path = pathlib.Path(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        text = path.read_text(encoding="utf-8") if path.exists() else HEAD
        with all_or_nothing(path.parent) as place:
            (place / path.name).write_text(text + ("" if text.endswith("\n") else "\n") + "\n".join(lines) + "\n", encoding="utf-8")
    finally:
        os.close(folder)


def draw(name, targets, result, path):
    """Writes path (a .png), the flow curve and the ways of the row, and the CSV beside it; shear as of von Mises."""
    ways = {way: (run.strain / MISES, run.stress * MISES) if way == SHEARED else run for way, run in result.runs.items()}
    rows, end = [], max(float(strain[-1]) for strain, _ in ways.values())
    near = 3.0 * (targets.true_yield() / targets.modulus + YIELD_OFFSET)
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(1, 3, figsize=(13.0, 4.2))
        true = targets.curve.bends(end, targets.modulus)
        curve = targets.curve.true_stress(true, targets.modulus) / 1e6
        rows += [("flow curve", f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(true, curve)]
        for axis, (last, title) in zip(axes, ((near, "around yield"), (true[-1], "all of it"))):
            axis.plot(100.0 * true, curve, color="black", linewidth=1.2, label="flow curve")
            for k, (way, (strain, stress)) in enumerate(ways.items(), start=1):
                axis.plot(100.0 * strain, stress / 1e6, label=f"row {name}, {way}", **figures.line_style(k))
            axis.set(xlim=(0, 100.0 * last), ylim=(0, 1.15 * float(np.interp(last, true, curve))), xlabel="true strain [%]", title=title)
        axes[0].set_ylabel("true stress [MPa]")
        axes[0].legend(loc="lower right")
        for k, (way, (strain, stress)) in enumerate(ways.items(), start=1):
            beyond = strain > targets.stresses[0] / targets.modulus
            off = stress[beyond] / targets.curve.true_stress(strain[beyond], targets.modulus) - 1.0
            axes[2].plot(100.0 * strain[beyond], 100.0 * off, **figures.line_style(k))
            rows += [(way, f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress / 1e6)]
        axes[2].axhline(0.0, color="#555555", linewidth=1.0)
        axes[2].set(xlim=(0, 100.0 * true[-1]), ylim=(-20, 20), xlabel="true strain [%]", title="row over flow curve - 1 [%]")
        figure.tight_layout()
        return figures.save(figure, path, ("what", "true_strain_percent", "true_stress_MPa"), rows)
