# SPDX-License-Identifier: GPL-2.0-only
"""Calibration: the row of a metal by its E, Poisson's ratio and flow curve, in tension, compression and simple shear.

A closed form gives the first row: in a body with Nb/V bonds and N/V particles per volume, the network of bonds has
the moduli E0 = m1 n1 e1 <(R_i + R_j)/deq> Nb/(6 V), as its bonds thin, K = E0/1.5, G = 0.4 E0, and fix evp/volume adds kv N/V to K.
Where the body flows its true stress is reach() E y, y the limit of its bonds at the plastic strain of the time: the table `flow` has y over xi_s.

Quasi-static runs follow, a pull and a push with each row, and a simple shear of a periodic body, whose results a table on disk keeps.
Then E, Poisson's ratio and each y are multiplied by target/measured, those of y by the mean of tension, compression and shear.
Rows are rounded before they run: the row written is one that ran. The over-stress grows nearly as gamma: runs with gamma and a twin without.
"""

import fcntl
import json
import math
import os
import pathlib
import re
import shutil
import time
from typing import NamedTuple, Optional, Tuple

import numpy as np
from scipy.integrate import trapezoid

from . import curves, dump, figures, flow, law, specimen
from .curves import YIELD_OFFSET, CurveError
from .report import all_or_nothing
from .run import INTERVAL, Failed, Job, Progress, last_strain, run_jobs

EXPONENTS = (8.0, 4.0)  # of both regimes, as in Table 1
ALPHA = 1.5
LEAST_NU, LARGEST_NU = 0.25, 0.42  # of central forces alone; where lateral stiffness leaves the closed form (doc/fix_evp_volume.rst)
NU_LIMIT = 0.48  # of the closed form
XI_RANGE = (2e-5, 0.05)  # of y: below, round-off of positions shows; above, the first regime itself is bent
SOFTENING = 3.0 / 80.0  # e2/e1 as in Table 1: with a table flow only eq. 8, plasticity none, has a second regime
REACH = ((0.002, 1.36), (0.005, 1.68), (0.01, 1.8), (0.05, 1.86), (0.12, 1.75), (0.3, 1.41), (0.45, 1.25), (1.0, 1.3), (2.0, 1.3))  # of reach()
BULK, SHEAR = 1.0 / 1.5, 0.4  # K/E0 without the volume energy, which adds x; G/E0
DENSITIES = (100.0, 3e4)  # [kg/m3] between which the unit is no doubt
SOFTEST = 1e6  # [Pa] Young's modulus below which the unit is in doubt
LINEAR = 0.01  # over-stresses are linear in the rate within this
NAME = re.compile(r"[A-Za-z0-9_.+-]+")
MOST_PASSES, RATE_RUNS = 4, 3
OWN = 4.0  # weight of the residuals of E and nu, which have coefficients of their own: what the curve misses must not spoil them
SETTLED = 0.01  # of E, nu, and of y in the mean: a row that would change by less is not run
WITHIN = 0.005  # of an over-stress
PLASTIC = (0.0, 0.002, 0.005, 0.01, 0.02, 0.05, 0.08, 0.12, 0.2, 0.3, 0.45, 0.7, 1.0, 1.5, flow.FAR)  # plastic strains of a table
FEW = 16  # points of a flow curve, which has bends there
LEAST_START = 0.7  # of the stress at the next plastic strain: at 0
WAYS = {"tension": 0.15, "compression": -0.4}  # nominal strain at the end
SHEARED = "shear"  # a further way, whose strains are shear strains
SHEAR_FROM = 0.6  # plastic strain: a curve that is known no farther is not sheared, as compression reaches 0.5
MISES = math.sqrt(3.0)  # shear strain over the plastic strain, and true stress over the shear stress
SHEAR_STRAINS = (0.5, 1.0, 2.0, 3.0)  # at which residuals are told
SHEAR_SPHERES = 1000  # of the periodic body
SMOOTHED, SMOOTHED_ROWS = 0.2, 20  # shear strain over which the shear stress is averaged; its rows
INERTIA = 0.005  # shear rate times spacing over sqrt(stress/density); 0.001 to 0.01: the same stress within 1 % to a strain of 2, 2 % to 2.5
SHEAR_DTFRACTION = 0.8
STRAINS = (0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)  # nominal, at which residuals are told
YIELD = "0.2 % yield"
MISSES = {"E": 0.02, "nu": 0.03, YIELD: 0.06}  # residuals beyond which a target is missed
STRESS_MISSES = {0.1: 0.04, 0.3: 0.06, 0.4: 0.1, math.inf: 0.15}  # likewise of stresses, to these strains; beyond 0.4 is shear
SMALLER = (1.0, 0.5, 0.25)  # increments of the attempts at a run
LENGTH, RADIUS = 0.05, 0.0125  # of the cylinder [m], twice as long as wide: in a shorter one the grips raise the stress of the middle (doc/metals.md)
RULES = {"plasticity": "isotropic", "contact": "join"}
ELASTIC = 0.4  # of xi_s: strain of the first leg, whose end gives Poisson's ratio
OVERSHOOT = 1.1  # grip strain at the end, over the one at which the middle would reach the target in proportion
FURTHER = 3  # legs at most, where that was not enough
GRADED = ((0.015, 1e-3), (0.05, 3e-3))  # (strain at the end, increment): the stress lags by the hardening of an increment
YIELDED = 1.3  # of the strain at the offset yield stress: end of the second leg
HEAD = """# UNITS: si CONTRIBUTOR: tools/calibrate.py, which appends the rows
# NAME e1 m1 n1 e2 m2 n2 xi_s gamma alpha, then spacing [m] and coordination of the body that it was found on, kv [J], density of the solid [kg/m3]
"""


class Targets(NamedTuple):
    """SI. curve: a FlowCurve; nu: None for that of the network; ways: some of WAYS, then SHEARED or not; rates: (over-stress, rate)."""

    modulus: float
    curve: flow.FlowCurve
    density: float
    nu: Optional[float] = None
    ways: Tuple[str, ...] = tuple(WAYS)
    rates: Tuple[Tuple[float, float], ...] = ()

    @property
    def yield_strain(self):
        """Yield stress/E, in tension."""
        return self.curve.offset_yield(self.modulus) / self.modulus

    @property
    def places(self):
        """Plastic strains of the table: PLASTIC, and in place of those near them the points of a curve that has few, and where it is known no farther."""
        own = self.curve.plastic[1:] if len(self.curve.plastic) <= FEW else []
        given = {self.curve.end, *(float(point) for point in own if point < flow.FAR)}
        return np.array(sorted(given | {place for place in PLASTIC if not any(0.8 * point < place < 1.25 * point for point in given)}))

    def end(self, way):
        """Nominal strain to which a way goes, of SHEARED the shear strain: of WAYS, or where the curve is known no farther."""
        if way == SHEARED:
            return MISES * min(flow.FAR, self.curve.end)
        known = self.curve.nominal_strain(1.02 * self.curve.end + 0.001, self.modulus, math.copysign(1.0, WAYS[way]))  # so that the end is reached
        return math.copysign(min(abs(WAYS[way]), abs(known)), WAYS[way])

    def residuals(self, runs):
        """{way: {what: found/target - 1}} of runs, {way: Run}: under "elastic" E and nu, of each way its 0.2 % yield stress and the stresses
        at STRAINS, of SHEARED the stresses at SHEAR_STRAINS."""
        first = next(iter(runs.values()))
        off = {"elastic": {"E": first.modulus / self.modulus - 1.0}}
        if self.nu is not None:
            off["elastic"]["nu"] = first.nu / self.nu - 1.0
        for way, run in runs.items():
            if way == SHEARED:
                off[way] = {strain: float(run.true_at(strain / MISES) / self.curve.at(strain / MISES)) - 1.0
                            for strain in SHEAR_STRAINS if strain <= self.end(way)}
                continue
            sign = math.copysign(1.0, WAYS[way])
            off[way] = {YIELD: run.offset_yield / self.curve.offset_yield(self.modulus, sign) - 1.0}
            for strain in STRAINS:
                if 1.5 * (self.yield_strain + YIELD_OFFSET) < strain <= abs(self.end(way)) * (1.0 + 1e-9):
                    off[way][strain] = run.stress_at(strain) / self.curve.nominal(sign * strain, self.modulus)[0] - 1.0
        return off


def told(off):
    """'0.2 % yield +1.2 %, at 1 % -0.3 %' of {what: residual}."""
    return ", ".join(f"{name_of(what)} {100.0 * value:+.1f} %" for what, value in off.items())


def name_of(what):
    """What a residual is of, in words."""
    return what if isinstance(what, str) else f"at {100.0 * what:g} %"


def limit_of(what):
    """Beyond which a residual is told as a miss."""
    return MISSES[what] if isinstance(what, str) else next(most for end, most in STRESS_MISSES.items() if what <= end)


class Run(NamedTuple):
    """What one way measured: E [Pa], nu, nominal 0.2 % yield stress [Pa]; strain and stress [Pa], nominal, as sizes; sign: -1 in compression.

    Of shear: sign 0, shear strain and shear stress, without elastic part: E is inf, nu and yield stress are nan.
    """

    modulus: float
    nu: float
    offset_yield: float
    strain: np.ndarray
    stress: np.ndarray
    sign: float

    def stress_at(self, strain):
        """Nominal stress [Pa]; nan beyond the last strain."""
        return float(np.interp(strain, self.strain, self.stress, right=math.nan))

    def true_curve(self):
        """(true strain, true stress [Pa]), as sizes; of shear those of von Mises."""
        if self.sign == 0.0:
            return self.strain / MISES, self.stress * MISES
        factor = 1.0 + self.sign * self.strain
        return np.abs(np.log(factor)), self.stress * factor

    def true_at(self, plastic):
        """True stress [Pa] at plastic strains, nan outside."""
        strain, stress = self.true_curve()
        grows = np.maximum.accumulate(strain - stress / self.modulus)
        return np.interp(plastic, grows, stress, left=math.nan, right=math.nan)

    def as_json(self):
        """A dict that from_json() reads again."""
        return {name: np.asarray(value).tolist() for name, value in self._asdict().items()}

    @classmethod
    def from_json(cls, found):
        return cls(**{name: np.array(value) if isinstance(value, list) else value for name, value in found.items()})


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
    if not (XI_RANGE[0] <= lowest / modulus and highest / (reach(PLASTIC[-1]) * modulus) <= XI_RANGE[1]):
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


def reach(plastic):
    """True stress of a body that flows over E y, at plastic strains; of the first rows of several metals, within 10 %."""
    return np.interp(plastic, *zip(*REACH))


class Body(NamedTuple):
    """A packing, by default in the cylinder of make_body(), and what its bonds are."""

    path: pathlib.Path
    count: int
    bonds: int
    spacing: float  # mean deq [m]
    square: float  # mean deq^2 [m2]
    thickness: float  # mean (R_i + R_j)/deq, of the stiffness of bonds that thin
    volume: float = math.pi * RADIUS**2 * LENGTH  # [m3]
    length: float = LENGTH  # along x [m]

    @property
    def coordination(self):
        return 2.0 * self.bonds / self.count


def measure(path):
    """The Body of a data file with its FILE.body. OSError or ValueError where one is missing or is none."""
    read, size = specimen.read_data(path), specimen.read_body(path)
    deq = specimen.bond_lengths(read, ALPHA)
    return Body(pathlib.Path(path), len(read.ids), len(deq), float(deq.mean()), float(np.mean(deq**2)), specimen.thickness(read, ALPHA), size["volume"], size["length"])


def make_body(folder, count, seed, density, timeout, radius=RADIUS):
    """The Body of in.specimen, a cylinder, body.data in the folder; made on one rank, as another number of ranks gives another packing. density: of the solid."""
    variables = {"n": count, "length": LENGTH, "radius": radius, "seed": seed, "density": f"{density:.9g}", "out": "body.data"}
    call("in.specimen", variables, 1, folder, timeout, f"packing of {count} spheres")
    return measure(folder / "body.data")


def make_periodic(folder, seed, density, timeout):
    """Packs the periodic body of shear(), periodic.data in the folder. density: of the solid."""
    variables = {"n": SHEAR_SPHERES, "shape": "periodic", "length": LENGTH, "seed": seed, "density": f"{density:.9g}",
                 "out": "periodic.data"}
    call("in.specimen", variables, 1, folder, timeout, f"packing of {SHEAR_SPHERES} spheres without a surface")


def given_body(path, folder):
    """The Body of a data file of the user's with its FILE.body, copied into the folder. Errors as of measure()."""
    for end in ("", ".body"):
        shutil.copy(f"{path}{end}", folder / f"body.data{end}")
    return measure(folder / "body.data")


def call(deck, variables, ranks, folder, timeout, title, share=lambda: 0.0, progress=None):
    """Run a deck in the folder; Failed where it ends badly or lasts beyond `timeout` seconds, RunError where it does not even start.

    share: a function that gives what is done of it, 0 to 1, while it runs; with a Progress of the caller what is done of all.
    """
    try:
        run_jobs([Job(deck, deck, variables, folder, ranks, done=share)], ranks, title, timeout, progress)
    except Failed as failure:
        raise Failed(str(failure).partition("\n  whole output:")[0]) from failure


def legs(xi_s, yielded, end, finer):
    """[(strain at the end, strain per increment)] of a way to the nominal strain `end`; yielded: strain of the 0.2 % yield stress; finer: 1, or
    less for shorter increments."""
    sign, size = math.copysign(1.0, end), abs(end)
    elastic, yielded = 0.5 * ELASTIC * xi_s, YIELDED * yielded  # the middle may be stretched twice as far as the grips say
    fine, coarse = min(xi_s / 6.0, 3e-4), min(max(4e-3, size / 50.0), size / 12.0)
    ends = [(elastic, elastic / 4.0), (yielded, fine)]
    for place, increment in (*GRADED, (math.inf, coarse)):
        if ends[-1][0] * 1.0001 < min(place, size):
            ends.append((min(place, size), min(increment, coarse)))
    return [(sign * strain, finer * increment) for strain, increment in ends]


class Material(NamedTuple):
    """A row; kv [J]: 0 without; flow: p0 Y0 p1 Y1 ..., or nothing."""

    row: law.Row
    kv: float = 0.0
    flow: Tuple[float, ...] = ()

    def words(self, spacing, coordination):
        """As a potential file has it after the name; the measures of the body are texts."""
        numbers = {"": self.row, f"spacing {spacing} coordination {coordination}": (), "kv": (self.kv,) if self.kv else None,
                   "bonds thin flow": self.flow or None}
        return " ".join(" ".join([name, *(f"{value:.6g}" for value in values)]).strip()
                        for name, values in numbers.items() if values is not None)


def typed(body, material):
    """What a load deck is told of a Material that holds for a Body as it is."""
    return {"coeff": material.words(f"{body.spacing:.15g}", f"{body.coordination:.15g}")}


def load(body, material, xi_s, end, yielded, finer, ranks, folder, timeout, title):
    """The Run of a quasi-static pull or push of a body to the nominal strain `end` of its middle. Failed or CurveError, with the reason.

    material: the deck's variables that choose it; yielded: strain at the 0.2 % yield stress; finer: as of legs(); folder: that of the body.
    """
    ends, begin, sign = legs(xi_s, yielded, end, finer), time.monotonic(), math.copysign(1.0, end)
    (folder / "load.csv").unlink(missing_ok=True)  # of the run before, which would be taken for progress
    with Progress(title, 1.0, INTERVAL) as progress:

        def go(strain, increment, resume="yes"):
            variables = {"specimen": body.path.name, **material, **RULES, "strain": f"{strain:.9g}", "increment": f"{increment:.9g}", "resume": resume, "out": "load"}
            left = timeout - (time.monotonic() - begin)
            call("in.quasistatic", variables, ranks, folder, left, title, lambda: last_strain(folder / "load.csv") / ends[-1][0], progress)
            return read_curve(folder / "load.csv")

        strain, stress = go(*ends[0], resume="no")
        state = dump.last_positions(folder / "load_state.dump")
        axial, lateral = specimen.middle_strains(specimen.read_data(body.path), state, body.length)
        share = last_strain(folder / "load.csv") / (sign * strain[-1])
        for place, increment in ends[1:]:
            strain, stress = go(OVERSHOOT * share * place, share * increment)
        for _ in range(FURTHER):
            if strain[-1] < abs(end):
                strain, stress = go(last_strain(folder / "load.csv") * OVERSHOOT * abs(end) / strain[-1], share * ends[-1][1])
    if strain[-1] < abs(end):
        raise Failed(f"the middle of the body was stretched to {strain[-1]:.4g} only: it is no thinner than the ends")
    modulus = curves.modulus(strain, stress)
    offset = curves.yield_stress(strain, stress, modulus)
    if not math.isfinite(offset):
        raise Failed("the curve does not meet the line of the 0.2 % offset")
    return Run(modulus, float(-lateral / axial), offset, strain, stress, sign)


def shear(material, targets, end, finer, ranks, folder, timeout, title):
    """The Run of a simple shear of the body of make_periodic() to the shear strain `end`, averaged over
    SMOOTHED of strain. Failed or CurveError, with the reason.

    material: the deck's variables that choose it; finer: 1, or less for shorter timesteps.
    """
    end += 0.51 * SMOOTHED
    rate = INERTIA * math.sqrt(float(targets.curve.at(1.0)) / targets.density) / (LENGTH / SHEAR_SPHERES ** (1.0 / 3.0))
    (folder / "shear.csv").unlink(missing_ok=True)  # of the run before, which would be taken for progress
    variables = {"specimen": "periodic.data", **material, **RULES, "strain": f"{end:.9g}", "row": SMOOTHED / SMOOTHED_ROWS,
                 "rate": f"{rate:.6g}", "dtfraction": SHEAR_DTFRACTION * finer, "out": "shear"}
    call("in.shear", variables, ranks, folder, timeout, title, lambda: last_strain(folder / "shear.csv") / end)
    curve, window = curves.read_curve(folder / "shear.csv"), np.full(SMOOTHED_ROWS, 1.0 / SMOOTHED_ROWS)
    strain, stress = (np.convolve(values, window, "valid") for values in (curve.strain, curve.virial))
    return Run(math.inf, math.nan, math.nan, strain, stress, 0.0)


def read_curve(path, strain="strain_gauge"):
    """(strain of this column, stress through the cross-sections [Pa]) of a pull or push, both as sizes; CurveError where a number is not finite."""
    curve = curves.read_curve(path, strain)
    return curves.first_way(curve.strain, curve.virial, ())[:2]


def flow_stress(body, material, targets, rate, ranks, folder, timeout, title):
    """Mean stress [Pa] over the second half of a run of in.traction at a rate. Failed or CurveError, with the reason."""
    end = math.copysign(max(0.012, 2.5 * (targets.yield_strain + YIELD_OFFSET)), WAYS[targets.ways[0]])
    variables = {"specimen": body.path.name, **typed(body, material), **RULES, "strain": f"{abs(end):.9g}",
                 "rate": f"{math.copysign(rate, end):.9g}", "integrator": "implicit" if material.row.gamma > 0.0 else "explicit", "out": "rate"}
    (folder / "rate.csv").unlink(missing_ok=True)
    call("in.traction", variables, ranks, folder, timeout, title, lambda: last_strain(folder / "rate.csv") / end)
    strain, stress = read_curve(folder / "rate.csv", "strain")
    late = strain > 0.5 * strain[-1]
    strain, stress = strain[late], stress[late]
    return float(trapezoid(stress, strain) / (strain[-1] - strain[0]))


class Result(NamedTuple):
    """runs: {way: Run} of the material; residuals: as of Targets.residuals(); passes: how many rows were run."""

    material: Material
    runs: dict
    residuals: dict
    passes: int = 0

    def misses(self):
        """{way: {what: residual}} of those that are misses."""
        missed = {way: {what: value for what, value in off.items() if not abs(value) <= limit_of(what)}
                  for way, off in self.residuals.items()}
        return {way: off for way, off in missed.items() if off}

    def squares(self):
        """Of the logarithms of each value over its target; those of E and nu weigh more."""
        return sum(((OWN if way == "elastic" else 1.0) * math.log1p(value)) ** 2 for way, off in self.residuals.items() for value in off.values())


class Aims(NamedTuple):
    """What the closed form is given: E [Pa], nu or None, true stresses [Pa] at plastic strains."""

    modulus: float
    nu: Optional[float]
    places: np.ndarray
    stresses: np.ndarray


def material_of(aims, body):
    """The Material, as it is printed, that by the closed form gives these Aims in a Body."""
    (m, n), volume = EXPONENTS, 0.0 if aims.nu is None else max(0.0, volume_ratio(min(aims.nu, NU_LIMIT)))
    network = aims.modulus / moduli(volume)[0]
    e1 = rounded(6.0 * network * body.volume / (m * n * body.bonds * body.thickness))
    limits = np.clip(aims.stresses / (reach(aims.places) * aims.modulus), *XI_RANGE)
    table = [(place, rounded(limit / limits[0])) for place, limit in zip(aims.places, limits)]
    row = law.Row(e1, m, n, rounded(SOFTENING * e1), m, n, rounded(limits[0]), 0.0, ALPHA)
    kv = rounded(volume * network * body.volume / body.count)
    return Material(row, kv, tuple(value for point in table for value in point))


def corrected(aims, targets, runs):
    """(Aims of the next row, how much they change): by target/measured, of stresses the mean of all ways. From the plastic strain on where tension
    ends compression stands for both, beyond it shear is alone; how far a way is from the mean where another ends fades as 1/plastic strain.
    Before and beyond what they measured the factors are the first and last."""
    first = next(iter(runs.values()))
    modulus = targets.modulus / first.modulus
    nu = 1.0 if aims.nu is None else targets.nu / first.nu
    places = aims.places[1:]
    measured = {way: np.log(run.true_at(places) / targets.curve.at(places)) for way, run in runs.items()}
    sheared = measured.pop(SHEARED, None)

    def goes_on(off, values):
        last = int(np.flatnonzero(np.isfinite(off))[-1])
        return np.where(places > places[last], values - (values - off)[last] * places[last] / places, off)

    off = np.mean(list(measured.values()), axis=0)
    for values in measured.values():
        off = goes_on(off, values)
    if sheared is not None:
        both = np.isfinite(off) & np.isfinite(sheared)
        off = goes_on(np.where(both, (2.0 * off + sheared) / 3.0, off), sheared)
    known = np.isfinite(off)
    factors = np.exp(-np.interp(aims.places, places[known], off[known]))
    change = max(abs(math.log(modulus)), abs(math.log(nu)), float(np.sqrt(np.mean(np.log(factors) ** 2))))
    return Aims(aims.modulus * modulus, aims.nu and aims.nu * nu, aims.places, aims.stresses * factors), change


class Search:
    """Everything that a calibration needs: targets, body, table; ranks, folder and timeout [s] of the runs; say(text).

    The folder holds the body, and where the targets ask for shear that of make_periodic().
    """

    def __init__(self, targets, body, table, ranks, folder, timeout, say):
        self.targets, self.body, self.table = targets, body, table
        self.ranks, self.folder, self.timeout, self.say = ranks, folder, timeout, say

    def run(self, number, way, material):
        """The Run of a row one way: from the table, or made. ValueError where every attempt failed."""
        targets, title = self.targets, f"pass {number} of at most {MOST_PASSES}, {way}"
        for attempt, finer in enumerate(SMALLER):
            def make():
                if way == SHEARED:
                    return shear(typed(self.body, material), targets, targets.end(way), finer,
                                 self.ranks, self.folder, self.timeout, title).as_json()
                return load(self.body, typed(self.body, material), material.row.xi_s, targets.end(way), targets.yield_strain + YIELD_OFFSET, finer,
                            self.ranks, self.folder, self.timeout, title).as_json()

            record = self.kept({"kind": way, "number": number, "attempt": attempt, "material": material}, {"increments": finer}, make)
            if record["state"] == "done":
                return Run.from_json(record["found"])
            more = SMALLER[attempt + 1 :]
            self.say(f"pass {number}, {way}, failed: {record['reason']}" + (f"; again with {more[0]:g} of the increments" if more else ""))
        raise ValueError(f"pass {number}, {way}, failed {len(SMALLER)} times, last: {record['reason']}; the run table is {self.table.path}")

    def kept(self, key, others, make):
        """The record with this key, from the table or of make(), what was found; a run that Failed, or gave no curve, has one, too."""
        key = json.loads(json.dumps(key))
        record = self.table.find(**key, state="done") if key["kind"] == "rate" else self.table.find(**key)
        if record is None:
            begin = time.monotonic()
            try:
                ended = {"state": "done", "found": make()}
            except (Failed, CurveError) as failure:
                ended = {"state": "failed", "reason": str(failure)}
            record = self.table.add({**key, **others, "seconds": round(time.monotonic() - begin, 2), **ended})
        return record

    def result(self):
        """The Result nearest to the targets, by the squares, of at most MOST_PASSES rows."""
        targets, results = self.targets, []
        stresses = targets.curve.at(targets.places)
        stresses[0] = max(stresses[0], LEAST_START * stresses[1])  # power laws begin at 0
        aims = Aims(targets.modulus, targets.nu, targets.places, stresses)
        while len(results) < MOST_PASSES:
            material, number = material_of(aims, self.body), len(results) + 1
            runs = {way: self.run(number, way, material) for way in targets.ways}
            result = Result(material, runs, targets.residuals(runs), number)
            results.append(result)
            self.say("\n".join(f"pass {number}, {way}: {told(off)}" for way, off in result.residuals.items()))
            aims, change = corrected(aims, targets, runs)
            if change < SETTLED:
                break
        return min(results, key=Result.squares)._replace(passes=len(results))

    def gamma(self, result):
        """(gamma, over-stress/rate found [Pa s]); where several rates are asked for, of the geometric mean of their points."""
        rates = self.targets.rates
        over, rate = (math.exp(sum(math.log(pair[k]) for pair in rates) / len(rates)) for k in (0, 1))
        m, n = EXPONENTS
        gamma = rounded(0.5 * over / (result.runs[self.targets.ways[0]].modulus * rate) * m * n * result.material.row.e1 * self.body.thickness / self.body.square)  # in flow twice E tau rate
        material = result.material
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
        """Mean flow stress [Pa], from the table or a run."""
        title = f"rate run {number}" if number else "twin without damping"
        record = self.kept({"kind": "rate", "number": number, "material": material, "rate": rate}, {}, lambda: flow_stress(
            self.body, material, self.targets, rate, self.ranks, self.folder, self.timeout, title))
        if record["state"] == "failed":
            raise ValueError(f"--rate: the run at {rate:g}/s failed: {record['reason']}; the run table is {self.table.path}")
        return record["found"]


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
    rows, end = [], max(float(run.true_curve()[0][-1]) for run in result.runs.values())
    near = 3.0 * (targets.yield_strain + YIELD_OFFSET)
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(1, 3, figsize=(13.0, 4.2))
        true = targets.curve.bends(end, targets.modulus)
        curve = targets.curve.true_stress(true, targets.modulus) / 1e6
        rows += [("flow curve", f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(true, curve)]
        for axis, (last, title) in zip(axes, ((near, "around yield"), (true[-1], "all of it"))):
            axis.plot(100.0 * true, curve, color="black", linewidth=1.2, label="flow curve")
            for k, (way, run) in enumerate(result.runs.items(), start=1):
                strain, stress = run.true_curve()
                axis.plot(100.0 * strain, stress / 1e6, label=f"row {name}, {way}", **figures.line_style(k))
            axis.set(xlim=(0, 100.0 * last), ylim=(0, 1.15 * float(np.interp(last, true, curve))), xlabel="true strain [%]", title=title)
        axes[0].set_ylabel("true stress [MPa]")
        axes[0].legend(loc="lower right")
        for k, (way, run) in enumerate(result.runs.items(), start=1):
            strain, stress = run.true_curve()
            beyond = strain > targets.yield_strain
            off = stress[beyond] / targets.curve.true_stress(strain[beyond], targets.modulus) - 1.0
            axes[2].plot(100.0 * strain[beyond], 100.0 * off, **figures.line_style(k))
            rows += [(way, f"{100.0 * a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress / 1e6)]
        axes[2].axhline(0.0, color="#555555", linewidth=1.0)
        axes[2].set(xlim=(0, 100.0 * true[-1]), ylim=(-20, 20), xlabel="true strain [%]", title="row over flow curve - 1 [%]")
        figure.tight_layout()
        return figures.save(figure, path, ("what", "true_strain_percent", "true_stress_MPa"), rows)
