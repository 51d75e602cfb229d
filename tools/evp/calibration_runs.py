# SPDX-License-Identifier: GPL-2.0-only
"""The body and the runs of a calibration: in.specimen, in.quasistatic in three legs, in.traction for the over-stress.

Each attempt works in a folder of its own, so that a process left behind by a killed calibration writes into nothing that is used.
"""

import math
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
from typing import NamedTuple

import numpy as np

from . import calibration_affine as affine
from . import curves, cycles, dump, specimen
from .calibration_targets import Refused
from .progress import Progress
from .run import DECKS, RunError, check_start, deck_command, environment, lammps_error, last_strain

LENGTH, RADIUS = 0.05, 0.02  # of the cylinder [m]
RULES = {"plasticity": "isotropic", "contact": "repulsive"}
ELASTIC = 0.4  # of xi_s: strain of the first leg, whose end gives Poisson's ratio
OVERSHOOT = 1.1  # grip strain at the end, over the one at which the middle would reach the target in proportion
YIELDED = 1.3  # of the strain at the offset yield stress: end of the second leg
POLL = 0.05  # [s]


class Body(NamedTuple):
    """A packing, by default in the default cylinder, and what its bonds are."""

    path: pathlib.Path
    count: int
    bonds: int
    spacing: float  # mean deq [m]
    square: float  # mean deq^2 [m2]
    volume: float = math.pi * RADIUS**2 * LENGTH  # [m3]
    length: float = LENGTH  # along x [m]
    strain: str = "strain"  # column of the strain: that of the grips, or of an extensometer over the middle

    @property
    def coordination(self):
        return 2.0 * self.bonds / self.count


class Failed(RuntimeError):
    """A run that gave no curve; the text says why."""


def measure(path):
    """The Body of a data file."""
    read = specimen.read_data(path)
    pairs, _ = specimen.pairs_within(read, affine.ALPHA)
    lengths = np.linalg.norm(read.x[pairs[:, 0]] - read.x[pairs[:, 1]], axis=1)
    return Body(pathlib.Path(path).absolute(), len(read.ids), len(pairs), float(lengths.mean()), float(np.mean(lengths**2)))


def make_body(folder, count, seed, density, timeout):
    """The Body of in.specimen, kept in the folder; made on one rank, as another number of ranks gives another packing. density: of the solid."""
    path = pathlib.Path(folder) / f"body_{count}_{seed}.data"
    for attempt in range(2):
        if path.exists():
            break
        with attempt_folder(folder, "body") as work:
            try:
                call("in.specimen", {"n": count, "seed": seed, "density": f"{density:.9g}", "out": "body.data"}, 1, work, timeout,
                     f"packing of {count} spheres")
            except Failed:
                if attempt == 0:
                    continue
                raise
            measures = work / "body.data.body"
            if measures.exists():
                os.replace(measures, path.with_name(path.name + ".body"))
            os.replace(work / "body.data", path)
    return measure(path)


def given_body(path, folder):
    """The Body of a data file of the user's with its FILE.body, copied into the folder; its strain is that between 0.3 and 0.7 of the length.

    Refused where a file is missing or is none.
    """
    path, beside = pathlib.Path(path), pathlib.Path(f"{path}.body")
    for file in (path, beside):
        if not file.is_file():
            made = "make the body by in.specimen or tools/body.py, which write both" if file == beside else "give the data file of a body"
            raise Refused(f"--body: there is no file {file}; {made}")
    found = {name: float(value) for name, value in re.findall(r"^variable\s+(\w+)\s+index\s+([-+.\deE]+)", beside.read_text(encoding="utf-8"), flags=re.M)}
    if not min(found.get("length", 0.0), found.get("volume", 0.0)) > 0.0:
        raise Refused(f"--body: {beside} gives no length or no volume of the body: make the body by in.specimen or tools/body.py")
    kept = pathlib.Path(folder) / "given.data"
    shutil.copy(path, kept)
    shutil.copy(beside, f"{kept}.body")
    try:
        body = measure(kept)
    except ValueError as error:
        raise Refused(f"--body: {path} is no data file of atom_style sphere: {error}") from error
    return body._replace(volume=found["volume"], length=found["length"], strain="strain_gauge")


class attempt_folder:
    """A folder of its own for one attempt, gone afterwards."""

    def __init__(self, folder, name):
        self.path = pathlib.Path(tempfile.mkdtemp(dir=folder, prefix=f"{name}_"))

    def __enter__(self):
        return self.path

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)


def relative(path, folder):
    """A file as a deck run in the folder is told of it: folders above both may have spaces, which read_data takes for the end of a name."""
    return os.path.relpath(pathlib.Path(path).resolve(), pathlib.Path(folder).resolve())


def call(deck, variables, ranks, folder, deadline, title, share=None):
    """Run a deck in a folder; Failed where it ends badly or lasts beyond `deadline` seconds from now,
    RunError where it does not even start.

    share: a function that gives 0..1 while it runs.
    """
    log = pathlib.Path(folder) / "log"
    begin = time.monotonic()
    with open(log, "w", encoding="utf-8") as output:
        try:
            process = subprocess.Popen(deck_command(DECKS / deck, variables, ranks), cwd=folder, env=environment(), stdin=subprocess.DEVNULL,
                                       stdout=output, stderr=subprocess.STDOUT)
        except OSError as error:
            raise RunError(f"cannot start {deck}: {error}") from error
    try:
        with Quiet(title) as progress:
            while process.poll() is None:
                if time.monotonic() - begin > deadline:
                    raise Failed(f"timed out after {deadline:.0f} s")
                if share is not None:
                    progress.show(share(), title)
                time.sleep(POLL)
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
    if process.returncode:
        check_start(deck, log, process.returncode, ranks)
        raise Failed(f"{deck} failed: {lammps_error(log)[:300]}")


class Quiet(Progress):
    """Progress whose end is not told: the line of the run's results follows."""

    def __init__(self, title):
        super().__init__("", 1.0, interval=5.0)

    def __exit__(self, kind, value, trace):
        super().__exit__(KeyboardInterrupt, value, trace)


def legs(xi_s, targets, finer):
    """[(strain at the end, strain per increment)] of a pull; finer: 1, or less for shorter increments."""
    sign = math.copysign(1.0, targets.strain)
    elastic = ELASTIC * xi_s
    yielded = YIELDED * (targets.yield_strain + affine.YIELD_OFFSET)
    last = max(abs(targets.strain), yielded)
    fine, coarse = min(xi_s / 6.0, 3e-4), min(2e-3, abs(targets.strain) / 20.0)
    ends = [(elastic, elastic / 4.0), (yielded, fine)] + ([(last, coarse)] if last > yielded * 1.0001 else [])
    return [(sign * end, finer * size) for end, size in ends]


def coefficients(row):
    """A row as -var coeff takes it."""
    return " ".join(f"{value:.9g}" for value in row)


def typed(row, kv):
    """What in.quasistatic is told of a row that holds for the body as it is."""
    return {"coeff": coefficients(row), "scale": "no", "kv": f"{kv:.9g}"}


def pull(body, row, kv, targets, finer, ranks, folder, timeout, title):
    """(found, curve) of a quasi-static run of a row on its body, as of pull_material."""
    return pull_material(body, typed(row, kv), row.xi_s, targets, finer, ranks, folder, timeout, title)


def pull_material(body, material, xi_s, targets, finer, ranks, folder, timeout, title):
    """(found, curve) of a quasi-static run: E, yield, stress2 [Pa], nu; strain and stress [Pa] as sizes. Failed, with the reason.

    material: the deck's variables that choose it.
    """
    gauged = body.strain != "strain"
    ends = legs(xi_s, targets, finer)
    if gauged:  # the middle may be stretched twice as far as the grips say
        ends[0] = tuple(0.5 * value for value in ends[0])
    done, begin = 0, time.monotonic()
    with attempt_folder(folder, "pull") as work:
        for number, (end, increment) in enumerate(ends):
            variables = {"specimen": relative(body.path, work), **material, **RULES, "strain": f"{end:.9g}", "increment": f"{increment:.9g}",
                         "restart": 1000000, "resume": done, "out": "pull", "extensometer": "yes" if gauged else "no"}
            left = timeout - (time.monotonic() - begin)
            call("in.quasistatic", variables, ranks, work, left, title, lambda: last_share(work / "pull.csv", ends[-1][0]))
            done = max(int(path.name.split(".")[1]) for path in work.glob("pull.*.restart"))
            if number == 0:
                state = read_positions(work / "pull_state.dump")
                if gauged:
                    share = read_curve(work / "pull.csv")[0][-1] / read_curve(work / "pull.csv", body.strain)[0][-1]
                    ends[1:] = [(OVERSHOOT * share * end, share * size) for end, size in ends[1:]]
        strain, stress = read_curve(work / "pull.csv", body.strain)
    if gauged and strain[-1] < abs(targets.strain):  # the strain of the grips ends on the target, but for its nine digits
        raise Failed(f"the middle of the body was stretched to {strain[-1]:.4g} only: it is no thinner than the ends")
    try:
        modulus = curves.modulus(strain, stress)
        offset = curves.yield_stress(strain, stress, modulus)
    except curves.CurveError as error:
        raise Failed(str(error)) from error
    if not math.isfinite(offset):
        raise Failed("the curve does not meet the line of the 0.2 % offset")
    axial, lateral = specimen.middle_strains(specimen.read_data(body.path), state, body.length)
    found = {"E": modulus, "yield": offset, "stress2": float(np.interp(abs(targets.strain), strain, stress)), "nu": float(-lateral / axial)}
    return found, (strain, stress)


def last_share(path, end):
    """Share of a pull done, from its growing CSV."""
    return min(1.0, abs(last_strain(path) / end))


def read_curve(path, strain="strain"):
    """(strain of this column, stress through the cross-sections [Pa]) of a pull or push, both as sizes; Failed where a number is not finite."""
    try:
        curve = curves.read_curve(path, "virial", strain)
    except (curves.CurveError, OSError) as error:
        raise Failed(str(error)) from error
    sign = math.copysign(1.0, curve.strain[-1])
    return sign * curve.strain, sign * curve.virial


def read_positions(path):
    """Positions (N,3) by ID of the last snapshot of a dump; Failed where one is not finite."""
    x = dump.last_positions(path)
    if not np.all(np.isfinite(x)):
        raise Failed("a position is not finite")
    return x


def rate_strain(targets):
    """Strain at the end of a run at a rate: the over-stress is the mean over its second half."""
    return max(0.012, 2.5 * (targets.yield_strain + affine.YIELD_OFFSET))


def flow_stress(body, row, kv, targets, rate, ranks, folder, timeout, title):
    """Mean stress [Pa] over the second half of a run of in.traction at a rate. Failed, with the reason."""
    end = math.copysign(rate_strain(targets), targets.strain)
    variables = {"coeff": coefficients(row), "scale": "no", **RULES, "kv": f"{kv:.9g}", "strain": f"{abs(end):.9g}",
                 "rate": f"{math.copysign(rate, end):.9g}", "integrator": "implicit" if row.gamma > 0.0 else "explicit", "out": "rate"}
    with attempt_folder(folder, "rate") as work:
        call("in.traction", {"specimen": relative(body.path, work), **variables}, ranks, work, timeout, title, lambda: last_share(work / "rate.csv", end))
        strain, stress = read_curve(work / "rate.csv")
    late = strain > 0.5 * strain[-1]
    strain, stress = strain[late], stress[late]
    return cycles.work(strain, stress) / float(strain[-1] - strain[0])
