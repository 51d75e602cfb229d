# SPDX-License-Identifier: GPL-2.0-only
"""Calibration: the row that gives E, the 0.2 % yield stress, stresses at strains, Poisson's ratio and where asked for an over-stress.

A closed form gives the first row: in a body with Nb/V bonds and N/V particles per volume, the network of bonds has
the moduli E0 = m1 n1 e1 Nb/(6 V), K = E0/1.5, G = 0.4 E0, and fix evp/volume adds kv N/V to K. Where the body flows its
true stress is REACH E y, y the limit of its bonds at the plastic strain of the time: the table `flow` has a point at the
plastic strain of each target.

Quasi-static runs follow, whose results a table keeps: each value that the closed form is given is multiplied by
target/measured. Rows are rounded before they run: the row written is one that ran. The over-stress is linear in gamma: a
run with gamma and its twin without.
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

from . import curves, dump, figures, law, specimen
from .curves import YIELD_OFFSET, CurveError
from .report import all_or_nothing
from .run import Failed, Job, last_strain, run_jobs

EXPONENTS = (8.0, 4.0)  # of both regimes, as in Table 1
ALPHA = 1.5
LEAST_NU, LARGEST_NU = 0.25, 0.42  # of central forces alone; where lateral stiffness leaves the closed form (doc/fix_evp_volume.rst)
NU_LIMIT = 0.48  # of the closed form
XI_RANGE = (2e-5, 0.05)  # of y: below, round-off of positions shows; above, the first regime itself is bent
SOFTENING = 3.0 / 80.0  # e2/e1 as in Table 1: with a table flow only eq. 8, plasticity none, has a second regime
REACH = 1.9  # true stress of a body that flows, over E y
TAIL = 2.0  # times the last plastic strain: end of a table that rises there, or the weakest section would flow alone
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
FURTHER = 3  # legs at most, where that was not enough
YIELDED = 1.3  # of the strain at the offset yield stress: end of the second leg
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
    def plastic(self):
        """Plastic strains of the points, from the least strain on: true strain less true stress/E, as sizes."""
        ordered = sorted(self.points, key=lambda point: abs(point[1]))
        return [abs(math.log1p(strain)) - stress * (1.0 + strain) / self.modulus for stress, strain in ordered]

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
    if np.any(np.diff([YIELD_OFFSET, *map(rounded, targets.plastic)]) <= 0.0):
        raise ValueError("--stress: between two stresses the curve rises steeper than E: "
                         "is one of them at the strain of another?")
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


def volume_ratio(nu):
    """kv N/(V E0) that gives Poisson's ratio nu."""
    return 2.0 * SHEAR * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)) - BULK


def moduli(volume):
    """(E/E0, Poisson's ratio) with the volume energy, the latter the inverse of volume_ratio()."""
    bulk = BULK + volume
    return 9.0 * bulk * SHEAR / (3.0 * bulk + SHEAR), (3.0 * bulk - 2.0 * SHEAR) / (2.0 * (3.0 * bulk + SHEAR))


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
    """A row; kv [J]: 0 without; flow: p0 Y0 p1 Y1 ..., or nothing."""

    row: law.Row
    kv: float = 0.0
    flow: Tuple[float, ...] = ()

    def words(self, spacing, coordination):
        """As a potential file has it after the name; the measures of the body are texts."""
        numbers = {"": self.row, f"spacing {spacing} coordination {coordination}": (), "kv": (self.kv,) if self.kv else None,
                   "flow": self.flow or None}
        return " ".join(" ".join([name, *(f"{value:.6g}" for value in values)]).strip()
                        for name, values in numbers.items() if values is not None)


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

    def go(end, increment, resume="yes"):
        variables = {"specimen": body.path.name, **material, **RULES, "strain": f"{end:.9g}", "increment": f"{increment:.9g}",
                     "resume": resume, "out": "pull"}
        left = timeout - (time.monotonic() - begin)
        call("in.quasistatic", variables, ranks, folder, left, title, lambda: last_strain(folder / "pull.csv") / ends[-1][0])
        return read_curve(folder / "pull.csv")

    strain, stress = go(*ends[0], resume="no")
    state = dump.last_positions(folder / "pull_state.dump")
    share = last_strain(folder / "pull.csv") / math.copysign(strain[-1], targets.strain)
    ends[1:] = [(OVERSHOOT * share * end, share * size) for end, size in ends[1:]]
    for end, increment in ends[1:]:
        strain, stress = go(end, increment)
    for _ in range(FURTHER):
        if strain[-1] < abs(targets.strain):
            ends[-1] = (ends[-1][0] * OVERSHOOT * abs(targets.strain) / strain[-1], ends[-1][1])
            strain, stress = go(*ends[-1])
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


def material_of(aims, targets, body):
    """The Material, as it is printed, that by the closed form gives these aims, {name: value} as of Targets.aims."""
    (m, n), volume = EXPONENTS, max(0.0, volume_ratio(min(aims["nu"], NU_LIMIT))) if "nu" in aims else 0.0
    network = aims["E"] / moduli(volume)[0]
    e1 = rounded(6.0 * network * body.volume / (m * n * body.bonds))
    places = sorted((strain for _, strain in targets.points), key=abs)
    stresses = [aims["yield"], *(aims[at(strain)] * (1.0 + strain) for strain in places)]
    plastic, limits = [0.0, *targets.plastic], list(np.array(stresses) / (REACH * aims["E"]))
    slope = (limits[-1] - limits[-2]) / (plastic[-1] - plastic[-2])
    if slope > 0.0:
        limits.append(limits[-1] + slope * (TAIL - 1.0) * plastic[-1])
        plastic.append(TAIL * plastic[-1])
    limits = np.clip(limits, *XI_RANGE)
    flow = [(rounded(place), rounded(limit / limits[0])) for place, limit in zip(plastic, limits)]
    row = law.Row(e1, m, n, rounded(SOFTENING * e1), m, n, rounded(limits[0]), 0.0, ALPHA)
    kv = rounded(volume * network * body.volume / body.count)
    return Material(row, kv, tuple(value for point in flow for value in point))


class Search:
    """Everything that a calibration needs: targets, body, table; ranks, folder and timeout [s] of the runs; say(text)."""

    def __init__(self, targets, body, table, ranks, folder, timeout, say):
        self.targets, self.body, self.table = targets, body, table
        self.ranks, self.folder, self.timeout, self.say = ranks, folder, timeout, say
        self.results = {}  # by material, in the order of the runs

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

    def result(self, material):
        """Result of a run; None where it failed and is not the first."""
        number = len(self.results) + 1
        record = self.run(number, material)
        if record["state"] != "done":
            if not self.results:
                raise ValueError(f"run {number} failed {len(SMALLER)} times, last: {record['reason']}; "
                                 f"the run table is {self.table.path}")
            return None
        residuals = self.targets.off(record["found"])
        shown = ", ".join(f"{name} {100 * value:+.2f} %" for name, value in residuals.items())
        self.say(f"run {number}: {shown} ({record['seconds']:.0f} s)")
        curve = np.array(record["strain"]), np.array(record["stress"])
        return Result(material, record["found"], residuals, curve, number)

    def pull(self):
        """The Result nearest to the quasi-static targets, by the squares."""
        aims, result = {name: value for name, (value, _) in self.targets.aims.items()}, None
        while len(self.results) < MOST_RUNS and not (result and result.worst <= WITHIN):
            material = material_of(aims, self.targets, self.body)
            result = None if material in self.results else self.result(material)
            if not result:
                break
            self.results[material] = result
            aims = {name: aims[name] / (1.0 + off) for name, off in result.residuals.items()}
        return min(self.results.values(), key=self.squares)._replace(runs=len(self.results))

    @staticmethod
    def squares(result):
        """Of the logarithms of each value over its target; those of E and nu weigh more."""
        weights = {"E": OWN, "nu": OWN}
        return sum((weights.get(name, 1.0) * math.log1p(off)) ** 2 for name, off in result.residuals.items())

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
