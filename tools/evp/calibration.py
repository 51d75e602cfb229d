# SPDX-License-Identifier: GPL-2.0-only
"""Calibration: the row that gives E, the 0.2 % yield stress, stresses at strains, Poisson's ratio and where asked for an over-stress.

A closed form gives the first row: the curve of a body whose bonds all share one strain. Bonds of every direction, free sideways
(model of fix evp/volume included): a bond at the angle t to the axis is stretched by sqrt((1+a)^2 cos^2 t + (1+b)^2 sin^2 t) and has
flowed (`plasticity isotropic`); b minimises the work

    W/E0 = 6/(m1 n1) <(Psi + D)/e1> + x/2 theta^2,   theta = 3 <stretch - 1>,   x = kv N/(V E0),   E0 = m1 n1 e1 Nb/(6 V)

<> is the mean over directions, Nb/V bonds and N/V particles per volume. Nominal stress/E0 = dW/da. Real bodies differ from it by
some per cent, and by more far beyond yield, where bonds leave: it is where calibration starts.

Then quasi-static runs, whose results a table keeps: scipy looks for the least squares of the logarithms of measured over target, with
the slopes of the closed form. Rows are rounded before they run: the row written is one that ran. The over-stress is linear in gamma: a run
with gamma and its twin without.
"""

import contextlib
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
import scipy.optimize
from scipy.integrate import trapezoid

from . import curves, dump, figures, law, specimen
from .curves import YIELD_OFFSET, CurveError
from .report import all_or_nothing
from .run import Failed, Job, last_strain, run_jobs

EXPONENTS = (8.0, 4.0)  # of both regimes, as in Table 1
ALPHA = 1.5
LEAST_NU, LARGEST_NU = 0.25, 0.42  # of central forces alone; where lateral stiffness leaves the closed form (doc/fix_evp_volume.rst)
XI_RANGE = (2e-5, 0.05)  # of xi_s: below, round-off of positions shows; above, the first regime itself is bent
SOFTENING_RANGE = (1e-6, 0.98)  # of e2/e1: no hardening; the second regime must stay softer than the first
LEAST_GUESS = 1e-3  # e2/e1 of the first row, at least: real bodies harden less than the closed form, where bonds cannot rearrange
BEND_RANGE = (0.01, 100.0)  # of 1/k_s: linear below; hardening ends at a bond strain of a few per cent
BULK, SHEAR = 1.0 / 1.5, 0.4  # K/E0 without the volume energy, which adds x; G/E0
LARGEST_STRAIN = 0.4  # of a target: not measured beyond
DENSITIES = (100.0, 3e4)  # [kg/m3] between which the unit is no doubt
SOFTEST = 1e6  # [Pa] Young's modulus below which the unit is in doubt
LINEAR = 0.01  # over-stresses are linear in the rate within this
NAME = re.compile(r"[A-Za-z0-9_.+-]+")
MOST_RUNS, RATE_RUNS = 8, 3
OWN = 4.0  # weight of the residuals of E and nu, which have coefficients of their own: what the curve misses must not spoil them
WITHIN = 0.005  # of every target: the search ends
MISS = 0.03  # of a target: more is told, and is the exit status
CURVE_POINTS = 4  # of a measured curve
SMALLER = (1.0, 0.5, 0.25)  # increments of the attempts at a run
LENGTH, RADIUS = 0.05, 0.02  # of the cylinder [m]
RULES = {"plasticity": "isotropic", "contact": "repulsive"}
ELASTIC = 0.4  # of xi_s: strain of the first leg, whose end gives Poisson's ratio
OVERSHOOT = 1.1  # grip strain at the end, over the one at which the middle would reach the target in proportion
YIELDED = 1.3  # of the strain at the offset yield stress: end of the second leg
_COS, _WEIGHTS = (lambda nodes: (0.5 * (nodes[0] + 1.0), 0.5 * nodes[1]))(np.polynomial.legendre.leggauss(100))  # on (0, 1)
HEAD = """# UNITS: si CONTRIBUTOR: tools/calibrate.py, which appends the rows
# NAME e1 m1 n1 e2 m2 n2 xi_s gamma alpha, then spacing [m] and coordination of the body that it was found on, kv [J], density of the solid [kg/m3]
"""


class Targets(NamedTuple):
    """SI. points: (stress, strain); strains are signed: negative means that all targets are those of a compression; stresses are positive."""

    modulus: float
    yield_stress: float
    points: Tuple[Tuple[float, float], ...]
    density: float
    nu: Optional[float] = None
    rates: Tuple[Tuple[float, float], ...] = ()  # (over-stress, rate)

    @property
    def aims(self):
        """{name: (value, unit)} of what a quasi-static run is to give, in the order of Search's results."""
        aims = {"E": (self.modulus, "Pa"), "yield": (self.yield_stress, "Pa"), **{at(strain): (stress, "Pa") for stress, strain in self.points}}
        return aims if self.nu is None else {**aims, "nu": (self.nu, "")}

    def off(self, found):
        """found/target - 1 by name."""
        return {name: found[name] / value - 1.0 for name, (value, _) in self.aims.items()}

    @property
    def yield_strain(self):
        """Yield stress/E."""
        return self.yield_stress / self.modulus

    @property
    def strain(self):
        """The largest strain, with its sign."""
        return max((strain for _, strain in self.points), key=abs)


def at(strain):
    """Name of a stress at a strain."""
    return f"stress at {strain:g}"


def check(targets):
    """ValueError where a target has no meaning, or is in another unit."""
    modulus, at_first, nu = targets.modulus, targets.yield_stress, targets.nu
    if not DENSITIES[0] <= targets.density <= DENSITIES[1]:
        raise ValueError(f"--density: {targets.density:g} kg/m3 is no solid's: give kg/m3, such as 2700")
    if modulus < SOFTEST:
        raise ValueError(f"--E: {modulus:g} Pa is softer than any metal: give all moduli and stresses in Pa, such as 70e9 for 70 GPa")
    if not XI_RANGE[0] <= targets.yield_strain <= XI_RANGE[1]:
        raise ValueError(f"--yield: {at_first:.6g} Pa is {targets.yield_strain:.3g} of E, no metal's share: give all moduli and stresses in Pa")
    if nu is not None and not LEAST_NU <= nu <= LARGEST_NU:
        raise ValueError(f"--nu: {nu:g} cannot be had: central forces give {LEAST_NU:g} (--nu none), the volume energy raises it, and from {LARGEST_NU:g} on is "
                         "so stiff that the timestep falls")
    at_yield = targets.yield_strain + YIELD_OFFSET
    before, sign = at_first, math.copysign(1.0, targets.strain)
    for stress, strain in sorted(targets.points, key=lambda point: abs(point[1])):
        if not abs(strain) > at_yield:
            raise ValueError(f"--stress: its strain {strain:g} is not beyond the yield strain, yield/E + 0.002 = {at_yield:.4g}: "
                             f"give the stress at a strain from {1.5 * at_yield:.2g} on")
        if abs(strain) > LARGEST_STRAIN:
            raise ValueError(f"--stress: the strain {strain:g} is beyond {LARGEST_STRAIN:g}, to which rows were measured")
        if strain * sign < 0.0:
            raise ValueError("--stress: strains of both signs; one row is fitted in tension or in compression")
        if stress <= before:
            raise ValueError(f"--stress: {stress:.6g} Pa at {strain:g} is not above the stress before, {before:.6g} Pa. The law hardens: end at the largest force "
                             "(nominal stresses of a compression grow with the cross-section: give negative strains if those are meant)")
        before = stress
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


NEAR_YIELD = 0.7  # of the 0.2 % yield stress: at least so much has the last row of a measured curve before it
AT_REST = 0.15  # of the yield stress: so far from the line of E is the first row, at most
SLOPE = 0.45  # of E: its slope up to half the yield stress


def read_measured(path, modulus, is_true):
    """(0.2 % yield stress [Pa], points) of a measured curve as of curves.read_points(), nominal unless is_true, from rest on; strains are
    negative in compression. Points are even in the strain, from twice that of the yield stress to the largest nominal stress."""
    strain, stress = curves.read_points(path, is_true)
    if is_true:
        strain, stress = np.expm1(strain), stress * np.exp(-strain)
    sign = math.copysign(1.0, strain[-1])
    sizes, scatter = np.abs(stress), curves.noise_of(stress)
    end = (np.nonzero(sizes >= sizes.max() - 4.0 * scatter)[0][-1] if scatter > 0.0 else np.argmax(sizes)) + 1
    if end < 3:
        raise ValueError(f"--curve: {path}: fewer than three points up to the largest stress: give one loading, from rest on")
    strain, stress = curves.levelled(path, *curves.one_loading(path, sign * strain[:end], math.copysign(1.0, stress[end - 1]) * stress[:end]))
    first = curves.yield_stress(strain, stress, modulus)
    if strain[-1] > 1.5:
        raise ValueError(f"--curve: {path} ends at a strain of {strain[-1]:g}: strains are shares, not per cent")
    if math.isfinite(first):
        if abs(stress[0] - modulus * strain[0]) > AT_REST * first and strain[0] < first / modulus + YIELD_OFFSET:
            raise ValueError(f"--curve: {path} does not begin at rest: {1e-6 * stress[0]:.4g} MPa at strain {strain[0]:.4g} in its first row, where E gives "
                             f"{1e-6 * modulus * strain[0]:.4g} MPa: shift the strains so that the straight part goes through zero")
        known = stress[strain <= first / modulus + YIELD_OFFSET]
        if known[-1] < NEAR_YIELD * first:
            raise ValueError(f"--curve: {path} has no row near the yield stress: the last one before it has {1e-6 * known[-1]:.4g} MPa, the straight line behind it meets "
                             f"the 0.2 % offset at {1e-6 * first:.4g} MPa: give rows there, or --yield and --stress")
        half = int(np.argmax(stress >= 0.5 * first))
        slope = (stress[half] - stress[0]) / (strain[half] - strain[0])
        if slope < SLOPE * modulus:
            raise ValueError(f"--curve: {path} begins with a slope of {1e-9 * slope:.4g} GPa, and E is {1e-9 * modulus:.4g} GPa, so that its yield stress would come out low: "
                             "take the compliance of the machine out of the strains, or give --yield and --stress")
    begin, end = 2.0 * (first / modulus + YIELD_OFFSET), min(strain[-1], LARGEST_STRAIN)
    if not (math.isfinite(first) and begin < end):
        raise ValueError(f"--curve: {path} does not reach twice the strain of its 0.2 % yield stress with E = {modulus:g} Pa; is the strain a share, not per cent?")
    places = [float(f"{place:.3g}") for place in np.linspace(begin, end, CURVE_POINTS + 1)[1:]]
    return first, tuple((float(np.interp(place, strain, stress)), sign * place) for place in places)


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


class Shape(NamedTuple):
    """What the curve over E0 depends on."""

    softening: float  # e2/e1
    xi_s: float
    volume: float  # x above
    bend: float = 0.0  # 1/k_s; 0: linear hardening


def volume_ratio(nu):
    """x that gives Poisson's ratio nu."""
    return 2.0 * SHEAR * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)) - BULK


def moduli(volume):
    """(E/E0, Poisson's ratio) with the volume energy, the latter the inverse of volume_ratio()."""
    bulk = BULK + volume
    return 9.0 * bulk * SHEAR / (3.0 * bulk + SHEAR), (3.0 * bulk - 2.0 * SHEAR) / (2.0 * (3.0 * bulk + SHEAR))


def affine_stress(strains, shape):
    """Nominal stress/E0 at nominal strains (S,) other than 0, free sideways."""
    m, n = EXPONENTS
    row = law.Row(1.0, m, n, shape.softening, m, n, shape.xi_s, 0.0, ALPHA)
    found, saturation = [], 1.0 / shape.bend if shape.bend > 0.0 else 0.0
    c2, s2 = _COS**2, 1.0 - _COS**2

    def pull(a, b):
        """(axial, lateral) dW of a, b."""
        stretch = np.sqrt((1.0 + a) ** 2 * c2 + (1.0 + b) ** 2 * s2)
        tension = -law.elastic_force(stretch, 1.0, row, law.return_map(stretch, 1.0, row, 0.0, 0.0, saturation)[0])
        theta = 3.0 * np.sum(_WEIGHTS * (stretch - 1.0))
        along = _WEIGHTS * (6.0 / (m * n) * tension + 3.0 * shape.volume * theta) / stretch
        return np.sum(along * c2) * (1.0 + a), np.sum(along * s2) * (1.0 + b)

    for a in strains:
        b = scipy.optimize.brentq(lambda lateral: pull(a, lateral)[1], -0.8 * a, 0.1 * a, xtol=1e-14, rtol=1e-12)
        found.append(pull(a, b)[0])
    return np.array(found)


def affine_offset(shape):
    """0.2 % offset yield stress/E0, of a curve whose straight part has the slope E."""
    slope, _ = moduli(shape.volume)
    strain = scipy.optimize.brentq(lambda a: affine_stress([a], shape)[0] - slope * (a - YIELD_OFFSET), YIELD_OFFSET * (1.0 + 1e-9), 0.5, xtol=1e-12)
    return slope * (strain - YIELD_OFFSET)


class Body(NamedTuple):
    """A packing, by default in the default cylinder, and what its bonds are."""

    path: pathlib.Path
    count: int
    bonds: int
    spacing: float  # mean deq [m]
    square: float  # mean deq^2 [m2]
    volume: float = math.pi * RADIUS**2 * LENGTH  # [m3]
    length: float = LENGTH  # along x [m]

    @property
    def coordination(self):
        return 2.0 * self.bonds / self.count


def measure(path):
    """The Body of a data file with its FILE.body. OSError or ValueError where one is missing or is none."""
    read, size = specimen.read_data(path), specimen.read_body(path)
    deq = specimen.bond_lengths(read, ALPHA)
    return Body(pathlib.Path(path), len(read.ids), len(deq), float(deq.mean()), float(np.mean(deq**2)), size["volume"], size["length"])


def make_body(folder, count, seed, density, timeout):
    """The Body of in.specimen, body.data in the folder; made on one rank, as another number of ranks gives another packing. density: of the solid."""
    call("in.specimen", {"n": count, "seed": seed, "density": f"{density:.9g}", "out": "body.data"}, 1, folder, timeout, f"packing of {count} spheres")
    return measure(folder / "body.data")


def given_body(path, folder):
    """The Body of a data file of the user's with its FILE.body, copied into the folder. Errors as of measure()."""
    for end in ("", ".body"):
        shutil.copy(f"{path}{end}", folder / f"body.data{end}")
    return measure(folder / "body.data")


def call(deck, variables, ranks, folder, timeout, title, share=lambda: 0.0):
    """Run a deck in the folder; Failed where it ends badly or lasts beyond `timeout` seconds, RunError where it does not even start.

    share: a function that gives what is done of it, 0 to 1, while it runs.
    """
    try:
        run_jobs([Job(deck, deck, variables, folder, ranks, done=share)], ranks, title, timeout)
    except Failed as failure:
        raise Failed(str(failure).partition("\n  whole output:")[0]) from failure


def legs(xi_s, targets, finer):
    """[(strain at the end, strain per increment)] of a pull; finer: 1, or less for shorter increments."""
    sign = math.copysign(1.0, targets.strain)
    elastic = ELASTIC * xi_s
    yielded = YIELDED * (targets.yield_strain + YIELD_OFFSET)
    last = max(abs(targets.strain), yielded)
    fine, coarse = min(xi_s / 6.0, 3e-4), min(max(4e-3, abs(targets.strain) / 50.0), abs(targets.strain) / 12.0)
    ends = [(elastic, elastic / 4.0), (yielded, fine)] + ([(last, coarse)] if last > yielded * 1.0001 else [])
    return [(sign * end, finer * size) for end, size in ends]


class Material(NamedTuple):
    """A row; kv [J] and saturation: 0 without."""

    row: law.Row
    kv: float = 0.0
    saturation: float = 0.0

    def words(self, spacing, coordination):
        """As a potential file has it after the name; the measures of the body are texts."""
        further = {"kv": self.kv, "saturation": self.saturation}
        return " ".join([f"{value:.6g}" for value in self.row] + [f"spacing {spacing} coordination {coordination}"]
                        + [f"{name} {value:.6g}" for name, value in further.items() if value > 0.0])


def typed(body, material):
    """What a load deck is told of a Material that holds for a Body as it is."""
    return {"coeff": material.words(f"{body.spacing:.15g}", f"{body.coordination:.15g}")}


def pull(body, material, *others):
    """(found, curve) of a quasi-static run of a Material on its body, as of pull_material."""
    return pull_material(body, typed(body, material), material.row.xi_s, *others)


def pull_material(body, material, xi_s, targets, finer, ranks, folder, timeout, title):
    """(found, curve) of a quasi-static run: by the names of Targets.aims, nu always; strain and stress [Pa] as sizes. Failed or CurveError, with the reason.

    material: the deck's variables that choose it; folder: that of the body.
    """
    ends = legs(xi_s, targets, finer)
    ends[0] = tuple(0.5 * value for value in ends[0])  # the middle may be stretched twice as far as the grips say
    begin = time.monotonic()
    (folder / "pull.csv").unlink(missing_ok=True)  # of the run before, which would be taken for progress
    for number, (end, increment) in enumerate(ends):
        variables = {"specimen": body.path.name, **material, **RULES, "strain": f"{end:.9g}", "increment": f"{increment:.9g}",
                     "resume": "yes" if number else "no", "out": "pull"}
        left = timeout - (time.monotonic() - begin)
        call("in.quasistatic", variables, ranks, folder, left, title, lambda: last_strain(folder / "pull.csv") / ends[-1][0])
        if number == 0:
            state = dump.last_positions(folder / "pull_state.dump")
            share = last_strain(folder / "pull.csv") / math.copysign(read_curve(folder / "pull.csv")[0][-1], end)
            ends[1:] = [(OVERSHOOT * share * end, share * size) for end, size in ends[1:]]
    strain, stress = read_curve(folder / "pull.csv")
    if strain[-1] < abs(targets.strain):
        raise Failed(f"the middle of the body was stretched to {strain[-1]:.4g} only: it is no thinner than the ends")
    modulus = curves.modulus(strain, stress)
    offset = curves.yield_stress(strain, stress, modulus)
    if not math.isfinite(offset):
        raise Failed("the curve does not meet the line of the 0.2 % offset")
    axial, lateral = specimen.middle_strains(specimen.read_data(body.path), state, body.length)
    stresses = {at(place): float(np.interp(abs(place), strain, stress)) for _, place in targets.points}
    return {"E": modulus, "yield": offset, **stresses, "nu": float(-lateral / axial)}, (strain, stress)


def read_curve(path, strain="strain_gauge"):
    """(strain of this column, stress through the cross-sections [Pa]) of a pull or push, both as sizes; CurveError where a number is not finite."""
    curve = curves.read_curve(path, strain)
    return curves.first_way(curve.strain, curve.virial, ())[:2]


def flow_stress(body, material, targets, rate, ranks, folder, timeout, title):
    """Mean stress [Pa] over the second half of a run of in.traction at a rate. Failed or CurveError, with the reason."""
    end = math.copysign(max(0.012, 2.5 * (targets.yield_strain + YIELD_OFFSET)), targets.strain)
    variables = {"specimen": body.path.name, **typed(body, material), **RULES, "strain": f"{abs(end):.9g}",
                 "rate": f"{math.copysign(rate, end):.9g}", "integrator": "implicit" if material.row.gamma > 0.0 else "explicit", "out": "rate"}
    (folder / "rate.csv").unlink(missing_ok=True)
    call("in.traction", variables, ranks, folder, timeout, title, lambda: last_strain(folder / "rate.csv") / end)
    strain, stress = read_curve(folder / "rate.csv", "strain")
    late = strain > 0.5 * strain[-1]
    strain, stress = strain[late], stress[late]
    return float(trapezoid(stress, strain) / (strain[-1] - strain[0]))


class Table:
    """JSON lines on disk, the first with the inputs, each other one with a run that ended, well or not: a killed calibration goes on with them.

    inputs: a dict that decides everything else. A line that was cut off is no run; one process writes at a time.
    """

    def __init__(self, path, inputs):
        self.path = pathlib.Path(path)
        self.file = open(self.path, "a+", encoding="utf-8")
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"another calibration is writing {self.path}: wait for it") from None
        self.file.seek(0)
        text = self.file.read()
        whole = text[: text.rfind("\n") + 1]
        self.file.truncate(len(whole.encode("utf-8")))  # what a kill has cut off
        try:
            self.runs = [json.loads(line) for line in whole.splitlines()]
        except ValueError as error:
            raise ValueError(f"{self.path} is no run table: {error}; take it away") from None
        if not self.runs:
            self.add({"inputs": inputs})
        before, inputs = self.runs.pop(0).get("inputs") or {}, json.loads(json.dumps(inputs))
        other = [key for key in {**before, **inputs} if before.get(key) != inputs.get(key)]
        if other:
            raise ValueError(f"{self.path} holds the runs of a calibration with another {', '.join(sorted(other))}: "
                             "take it away, or give another --out")

    def find(self, **key):
        """The run with these values, or None."""
        return next((run for run in self.runs if all(run.get(name) == value for name, value in key.items())), None)

    def add(self, record):
        """Append a run that has ended; returns it as it is read again."""
        line = json.dumps(record)
        self.file.write(line + "\n")
        self.file.flush()
        os.fsync(self.file.fileno())
        self.runs.append(json.loads(line))
        return self.runs[-1]

    def close(self):
        """Let others write."""
        self.file.close()


class Result(NamedTuple):
    """found: what the run of the material measured; residuals: found/target - 1 by name; curve: strain, stress [Pa]; runs: its number."""

    material: Material
    found: dict
    residuals: dict
    curve: tuple
    runs: int

    @property
    def worst(self):
        return max(map(abs, self.residuals.values()))


class Ended(Exception):
    """Leaves the search: a run has met the targets, or was the last."""


class ClosedForm:
    """The closed form of a body with these targets. Unknowns: log E0 [Pa], log xi_s, e2/e1, with nu x, with several points 1/k_s."""

    def __init__(self, targets, body):
        self.targets, self.body = targets, body
        self.with_nu, self.bends = targets.nu is not None, len(targets.points) > 1
        limits = [(-np.inf, np.inf), np.log(XI_RANGE), SOFTENING_RANGE] + [(0.0, np.inf)] * self.with_nu + [(0.0, BEND_RANGE[1])] * self.bends
        self.bounds = tuple(np.array(limits).T)
        self.weights = np.array([OWN, 1.0] + [1.0] * len(targets.points) + [OWN] * self.with_nu)

    def shape(self, unknowns):
        volume = unknowns[3] if self.with_nu else 0.0
        return Shape(unknowns[2], math.exp(unknowns[1]), volume, unknowns[-1] if self.bends else 0.0)

    def material(self, unknowns):
        """The Material, as it is printed."""
        network, shape, body, (m, n) = math.exp(unknowns[0]), self.shape(unknowns), self.body, EXPONENTS
        e1 = rounded(6.0 * network * body.volume / (m * n * body.bonds))
        row = law.Row(e1, m, n, rounded(shape.softening * e1), m, n, rounded(shape.xi_s), 0.0, ALPHA)
        return Material(row, rounded(shape.volume * network * body.volume / body.count), rounded(1.0 / shape.bend) if shape.bend > BEND_RANGE[0] else 0.0)

    def misfit(self, unknowns):
        """log of each result over its target, in their order, times its weight."""
        shape, network = self.shape(unknowns), math.exp(unknowns[0])
        stiffening, nu = moduli(shape.volume)
        stresses = affine_stress([strain for _, strain in self.targets.points], shape)
        found = network * np.array([stiffening, affine_offset(shape), *np.abs(stresses)])
        return self.weights * np.log(np.append(found, nu if self.with_nu else []) / [value for value, _ in self.targets.aims.values()])

    def slopes(self, unknowns):
        """(results, unknowns) of the misfit."""
        steps = 0.02 * np.maximum(np.abs(unknowns), np.array([1.0, 1.0, LEAST_GUESS] + [0.1] * self.with_nu + [1.0] * self.bends))
        return scipy.optimize.approx_fprime(unknowns, self.misfit, np.where(unknowns + steps > self.bounds[1], -steps, steps))

    def start(self):
        """Unknowns of the first run."""
        volume = volume_ratio(self.targets.nu) if self.with_nu else 0.0
        first = [math.log(self.targets.modulus / moduli(volume)[0]), math.log(0.5 * self.targets.yield_strain), 0.03]
        first += [max(volume, 0.01)] * self.with_nu + [5.0] * self.bends
        first[1] = float(np.clip(first[1], *np.log(XI_RANGE) + [0.1, -0.1]))
        found = scipy.optimize.least_squares(self.misfit, first, self.slopes, self.bounds, x_scale="jac", xtol=1e-3, ftol=1e-3, max_nfev=30).x
        found[2] = max(found[2], LEAST_GUESS)
        return found


class Search:
    """Everything that a calibration needs: targets, body, table; ranks, folder and timeout [s] of the runs; say(text)."""

    def __init__(self, targets, body, table, ranks, folder, timeout, say):
        self.targets, self.body, self.table = targets, body, table
        self.ranks, self.folder, self.timeout, self.say = ranks, folder, timeout, say
        self.closed_form, self.results = ClosedForm(targets, body), {}  # by material, in the order of the runs

    def run(self, number, material):
        """Record of the run: from the table, or made; that of the last attempt where every one failed."""
        for attempt, finer in enumerate(SMALLER):
            def make():
                found, curve = pull(self.body, material, self.targets, finer, self.ranks, self.folder, self.timeout, f"run {number} of at most {MOST_RUNS}")
                return {"found": found, "strain": list(curve[0]), "stress": list(curve[1])}

            record = self.kept({"kind": "pull", "number": number, "attempt": attempt, "material": material}, {"increments": finer}, make)
            if record["state"] == "done":
                break
            more = SMALLER[attempt + 1 :]
            self.say(f"run {number} failed: {record['reason']}" + (f"; again with {more[0]:g} of the increments" if more else ""))
        return record

    def kept(self, key, others, make):
        """The record with this key, from the table or of make(), a dict; a run that Failed, or gave no curve, has one, too."""
        key = json.loads(json.dumps(key))
        record = self.table.find(**key) if key["kind"] == "pull" else self.table.find(**key, state="done")
        if record is None:
            begin = time.monotonic()
            try:
                ended = {"state": "done", **make()}
            except (Failed, CurveError) as failure:
                ended = {"state": "failed", "reason": str(failure)}
            record = self.table.add({**key, **others, "seconds": round(time.monotonic() - begin, 2), **ended})
        return record

    def misfit(self, unknowns):
        """log of each result of a run over its target, times its weight; Ended after the last run."""
        material = self.closed_form.material(unknowns)
        result = self.results.get(material)
        if result is None:
            number = len(self.results) + 1
            record = self.run(number, material)
            if record["state"] != "done":
                if not self.results:
                    raise ValueError(f"run {number} failed {len(SMALLER)} times, last: {record['reason']}; the run table is {self.table.path}")
                raise Ended
            residuals = self.targets.off(record["found"])
            result = Result(material, record["found"], residuals, (np.array(record["strain"]), np.array(record["stress"])), number)
            self.results[material] = result
            shown = ", ".join(f"{name} {100 * value:+.2f} %" for name, value in residuals.items())
            self.say(f"run {number}: {shown} ({record['seconds']:.0f} s)")
            if result.worst <= WITHIN or number == MOST_RUNS:
                raise Ended
        return self.weighed(result)

    def pull(self):
        """The Result nearest to the quasi-static targets, by the squares that the search minimizes."""
        with contextlib.suppress(Ended):
            scipy.optimize.least_squares(self.misfit, self.closed_form.start(), self.closed_form.slopes, self.closed_form.bounds, x_scale="jac",
                                         ftol=1e-2, xtol=1e-4)
        return min(self.results.values(), key=lambda result: np.linalg.norm(self.weighed(result)))._replace(runs=len(self.results))

    def weighed(self, result):
        """log of each value over its target, times its weight."""
        return self.closed_form.weights * np.log1p(list(result.residuals.values()))

    def why_missed(self, result):
        """Why no row is nearer, as far as the run shows."""
        row, found = result.material.row, result.found
        above = [strain for _, strain in self.targets.points if result.residuals[at(strain)] > WITHIN]
        if row.e2 > LEAST_GUESS * row.e1 or not above:
            return ""
        return (f"The bonds of this row hardly harden, and the body still hardens to {found[at(above[0])] / found['yield']:.3g} of its yield stress at "
                f"{above[0]:g}, as they yield one after another: the law gives it no sharper curve. ")

    def gamma(self, result):
        """(gamma, over-stress/rate found [Pa s]); where several rates are asked for, of the geometric mean of their points."""
        rates = self.targets.rates
        over, rate = (math.exp(sum(math.log(pair[k]) for pair in rates) / len(rates)) for k in (0, 1))
        m, n = EXPONENTS
        gamma = rounded(0.5 * over / (result.found["E"] * rate) * m * n * result.material.row.e1 / self.body.square)  # in flow twice E tau rate
        material = result.material
        twin = self.rate_run(0, material, rate)
        for number in range(1, RATE_RUNS + 1):
            found = self.rate_run(number, material._replace(row=material.row._replace(gamma=gamma)), rate) - twin
            self.say(f"rate run {number}: over-stress {found / 1e6:.4g} MPa at {rate:g}/s, {100 * (found / over - 1.0):+.2f} %")
            if abs(found / over - 1.0) <= WITHIN:
                return gamma, found / rate
            if found <= 0.0:
                raise ValueError(f"--rate: the damped run at {rate:g}/s shows no over-stress: {found:.3g} Pa")
            gamma = rounded(gamma * over / found)
        raise ValueError(f"--rate: the over-stress was not met within {100 * WITHIN:g} % in {RATE_RUNS} runs; the last had {found:.4g} Pa at {rate:g}/s")

    def rate_run(self, number, material, rate):
        """Mean flow stress [Pa], from the table or a run."""
        title = f"rate run {number}" if number else "twin without damping"
        record = self.kept({"kind": "rate", "number": number, "material": material, "rate": rate}, {}, lambda: {"found": flow_stress(
            self.body, material, self.targets, rate, self.ranks, self.folder, self.timeout, title)})
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
    """Writes path (a .png), fit and residuals, and the CSV beside it."""
    strain, stress = 100.0 * result.curve[0], result.curve[1] / 1e6
    offset = 100.0 * (targets.yield_strain + YIELD_OFFSET)
    points = [(offset, targets.yield_stress / 1e6, "0.2 % yield stress")]
    points += [(100.0 * abs(place), value / 1e6, at(place)) for value, place in targets.points]
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(1, 3, figsize=(13.0, 4.2))
        for axis, (end, title) in zip(axes, ((2.0 * offset, "around yield"), (strain[-1] * 1.04, "all of it"))):
            axis.plot(strain, stress, label=f"row {name}", **{**figures.line_style(1), "linestyle": "-"})
            line = np.array([0.2, offset])
            axis.plot(line, targets.modulus / 1e6 * 0.01 * (line - 0.2), color="#888888", linewidth=1.2, linestyle=(0, (2, 2)), label="E (strain - 0.2 %)")
            axis.plot(*zip(*[(x, y) for x, y, _ in points if x <= end]), "o", color="#CC3311", markersize=7, label="targets", zorder=5)
            axis.set(xlim=(0, end), ylim=(0, 1.15 * max(stress[strain <= end].max(), points[0][1])), xlabel="nominal strain [%]", title=title)
        axes[0].set_ylabel("nominal stress [MPa]" + (" in compression" if targets.strain < 0.0 else ""))
        axes[0].legend(loc="lower right")
        axes[2].barh(list(result.residuals), [100.0 * value for value in result.residuals.values()], color="#4477AA")
        axes[2].axvline(0.0, color="#555555", linewidth=1.0)
        axes[2].invert_yaxis()
        axes[2].set(xlabel="fit over target - 1 [%]", title="residuals")
        figure.tight_layout()
        rows = [("curve", f"{a:.6g}", f"{b:.6g}") for a, b in zip(strain, stress)] + [(label, f"{x:.6g}", f"{y:.6g}") for x, y, label in points]
        return figures.save(figure, path, ("what", "strain_percent", "stress_MPa"), rows)
