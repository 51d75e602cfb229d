# SPDX-License-Identifier: GPL-2.0-only
"""Calibration: the row that gives E, the 0.2 % yield stress, the stress at a second strain, and where asked for nu and an over-stress.

The closed form (calibration_affine.py) gives the first row. Then quasi-static runs: a secant method (Broyden) on the logarithms of
measured over target, with the slopes of the closed form at the start. Stress is proportional to e1 at fixed shape (e2/e1, kv/e1, xi_s),
which is exact, so that only the slopes by the shape are learnt from the runs. Rows are rounded before they run: the row written is one
that ran. The over-stress is linear in gamma: a run with gamma and its twin without.
"""

import math
import time
from typing import NamedTuple

import numpy as np

from . import calibration_affine as affine
from . import calibration_runs as runs
from . import law
from .calibration_row import rounded
from .calibration_targets import Refused

MOST_RUNS = 8
WITHIN = 0.01  # of every target
SMALLER = (1.0, 0.5, 0.25)  # increments of the attempts at a run
LEAST_SOFTENING = 1e-6  # e2/e1: no force in the second regime
RATE_RUNS = 3


class Result(NamedTuple):
    """row: law.Row; kv [J]; found: what the last run measured; residuals: found/target - 1 by name; curve: strain, stress [Pa]."""

    row: law.Row
    kv: float
    found: dict
    residuals: dict
    curve: tuple
    runs: int


class Search:
    """Everything that a calibration needs: targets, body, table; ranks, folder and timeout [s] of the runs; say(text)."""

    def __init__(self, targets, body, table, ranks, folder, timeout, within, say):
        self.targets, self.body, self.table = targets, body, table
        self.ranks, self.folder, self.timeout, self.within, self.say = ranks, folder, timeout, within, say

    # Unknowns: log e1, log xi_s, e2/e1 and kv/e1 over their first values. Results: logarithms of E, yield, stress2 over target, nu/target - 1.

    def row(self, unknowns):
        """(law.Row, kv), as they are printed."""
        e1, xi_s = math.exp(unknowns[0]), math.exp(unknowns[1])
        m, n = affine.EXPONENTS
        softening = max(unknowns[2] * self.unit[0], LEAST_SOFTENING)
        kv = max(unknowns[3], 0.0) * self.unit[1] * e1 if len(unknowns) > 3 else 0.0
        return law.Row(rounded(e1), m, n, rounded(softening * e1), m, n, rounded(xi_s), 0.0, affine.ALPHA), rounded(kv)

    def residuals(self, found):
        """found/target - 1 by name."""
        wanted = {"E": self.targets.modulus, "yield": self.targets.yield_stress, "stress2": self.targets.stress2, "nu": self.targets.nu}
        return {name: found[name] / value - 1.0 for name, value in wanted.items() if value is not None}

    def closed_form(self, unknowns):
        """The results, as the closed form gives them, less those of E alone: for slopes."""
        volume = 0.0 if len(unknowns) < 4 else unknowns[3] * self.first.volume
        shape = affine.Shape(max(unknowns[2] * self.unit[0], LEAST_SOFTENING), math.exp(unknowns[1]), volume)
        slope = affine.stiffening(volume)
        values = [slope, affine.offset_stress(shape), affine.stress([abs(self.targets.strain)], shape)[0]]
        found = [unknowns[0] + math.log(value) for value in values]
        if len(unknowns) > 3:
            found.append(affine.poisson(volume) / self.targets.nu)
        return np.array(found)

    def start(self):
        """First unknowns and slopes (results, unknowns)."""
        aims = self.targets
        self.first = affine.first_guess(aims.yield_strain, aims.stress2 / aims.yield_stress, aims.volume, abs(aims.strain))
        body, (m, n) = self.body, affine.EXPONENTS
        network = self.targets.modulus / affine.stiffening(self.first.volume)
        e1 = 6.0 * network * body.volume / (m * n * body.bonds)
        self.unit = (self.first.softening, self.first.volume * network * body.volume / body.count / e1)
        unknowns = np.array([math.log(e1), math.log(self.first.xi_s), 1.0] + ([1.0] if self.targets.nu is not None and self.first.volume > 0.0 else []))
        base, columns = self.closed_form(unknowns), []
        for k in range(len(unknowns)):
            moved = unknowns.copy()
            moved[k] += 0.02
            columns.append((self.closed_form(moved) - base) / 0.02)
        return unknowns, np.array(columns).T

    def run(self, number, unknowns):
        """(record of the run, row, kv): from the table, or made; Refused where every attempt failed."""
        row, kv = self.row(unknowns)
        for attempt, finer in enumerate(SMALLER):
            key = {"kind": "pull", "number": number, "attempt": attempt, "row": list(row), "kv": kv}
            record = self.table.find(**key)
            if record is None:
                begin = time.monotonic()
                try:
                    found, curve = runs.pull(self.body, row, kv, self.targets, finer, self.ranks, self.folder, self.timeout,
                                             f"run {number} of at most {MOST_RUNS}")
                    ended = {"state": "done", "found": found, "strain": list(curve[0]), "stress": list(curve[1])}
                except runs.Failed as failure:
                    ended = {"state": "failed", "reason": str(failure)}
                record = self.table.add({**key, "increments": finer, "seconds": round(time.monotonic() - begin, 2), **ended})
                if record["state"] == "failed":
                    last = attempt == len(SMALLER) - 1
                    self.say(f"run {number} failed: {record['reason']}" + ("" if last else f"; again with {SMALLER[attempt + 1]:g} of the increments"))
            if record["state"] == "done":
                return record, row, kv
        raise Refused(f"run {number} failed {len(SMALLER)} times, last: {record['reason']}; the run table is {self.table.path}")

    def pull(self):
        """The Result of the quasi-static targets; Refused where the runs show that they cannot be had."""
        unknowns, slopes = self.start()
        before, floored, best = None, 0, None
        for number in range(1, MOST_RUNS + 1):
            record, row, kv = self.run(number, unknowns)
            residuals = self.residuals(record["found"])
            result = Result(row, kv, record["found"], residuals, (np.array(record["strain"]), np.array(record["stress"])), number)
            self.tell(number, record, residuals)
            worst = max(map(abs, residuals.values()))
            best = min((best, result), key=lambda one: max(map(abs, one.residuals.values()))) if best else result
            if worst <= self.within:
                return result
            at_floor = unknowns[2] * self.unit[0] <= LEAST_SOFTENING * 1.001 and residuals["stress2"] > self.within
            no_volume = len(unknowns) > 3 and unknowns[3] <= 0.0 and residuals.get("nu", 0.0) > self.within
            floored = floored + 1 if at_floor or no_volume else 0
            if floored == 2:
                self.refuse_floor(result, at_floor)
            unknowns, slopes, before = self.step(unknowns, slopes, before, residuals)
        if max(map(abs, best.residuals.values())) <= WITHIN:
            return best
        left = ", ".join(f"{name} {100 * value:+.2f} %" for name, value in best.residuals.items())
        raise Refused(f"the targets were not met within {100 * WITHIN:g} % in {MOST_RUNS} runs; the nearest row has {left}")

    def refuse_floor(self, result, at_floor):
        """Refused with what the runs showed to be the nearest."""
        found = result.found
        if at_floor:
            ratio = found["stress2"] / found["yield"]
            because = ", as the volume energy for nu hardens it, too" if result.kv > 0.0 else ""
            others = ", leave --nu out" if result.kv > 0.0 else ""
            if self.targets.strain > 0.0:
                others += ", or give the values of a compression (negative strain)"
            raise Refused(f"--stress2: {self.targets.stress2:.6g} Pa is {self.targets.stress2 / self.targets.yield_stress:.4g} of the yield stress. Too "
                          f"little: without any force in its second regime the body still hardens to {ratio:.4g} of it at {self.targets.strain:g}"
                          f"{because}. Give a stress a few percent above {ratio * self.targets.yield_stress:.4g} Pa{others}")
        raise Refused(f"--nu: {self.targets.nu:g} cannot be had: the body has {found['nu']:.4g} without any volume energy, the nearest")

    def step(self, unknowns, slopes, before, residuals):
        """Next unknowns; slopes and (unknowns, results) to go on from."""
        results = np.array([math.log1p(value) if name != "nu" else value for name, value in residuals.items()])[: len(slopes)]
        if before is not None:
            moved, changed = unknowns - before[0], results - before[1]
            shape = moved[1:]
            if shape @ shape > 1e-16:
                expected = slopes @ moved
                slopes = slopes.copy()
                slopes[:, 1:] += np.outer(changed - expected, shape) / (shape @ shape)
        change = -np.linalg.lstsq(slopes, results, rcond=None)[0]
        change[1] = np.clip(change[1], -0.6, 0.6)
        after = unknowns + change
        least = LEAST_SOFTENING / self.unit[0]
        if unknowns[2] * self.unit[0] > affine.LEAST_GUESS:
            least = 0.2 * unknowns[2]  # not to the floor at once
        after[2] = np.clip(after[2], least, min(5.0 * unknowns[2] + 1.0, affine.STIFFEST / self.unit[0]))
        if len(after) > 3:
            after[3] = np.clip(after[3], 0.0, 3.0 * unknowns[3] + 0.5)
        after[1] = np.clip(after[1], *np.log(affine.XI_RANGE))
        return after, slopes, (unknowns, results)

    def tell(self, number, record, residuals):
        """One line for a run."""
        off = ", ".join(f"{name} {100 * value:+.2f} %" for name, value in residuals.items())
        self.say(f"run {number}: {off} ({record['seconds']:.0f} s)")

    def gamma(self, result):
        """(gamma, over-stress/rate found [Pa s]); where several rates are asked for, of the geometric mean of their points."""
        rates = self.targets.rates
        over, rate = (math.exp(sum(math.log(pair[k]) for pair in rates) / len(rates)) for k in (0, 1))
        m, n = affine.EXPONENTS
        gamma = rounded(0.5 * over / (result.found["E"] * rate) * m * n * result.row.e1 / self.body.square)  # in flow twice E tau rate
        for number in range(1, RATE_RUNS + 1):
            found = self.over_stress(number, result, gamma, rate)
            self.say(f"rate run {number}: over-stress {found / 1e6:.4g} MPa at {rate:g}/s, {100 * (found / over - 1.0):+.2f} %")
            if abs(found / over - 1.0) <= self.within:
                return gamma, found / rate
            if found <= 0.0:
                raise Refused(f"--rate: the damped run at {rate:g}/s shows no over-stress: {found:.3g} Pa")
            gamma = rounded(gamma * over / found)
        raise Refused(f"--rate: the over-stress was not met within {100 * self.within:g} % in {RATE_RUNS} runs; the last had {found:.4g} Pa at {rate:g}/s")

    def over_stress(self, number, result, gamma, rate):
        """[Pa] of a run with gamma over its twin."""
        means = [self.rate_run(number if value else 0, result.row._replace(gamma=value), result.kv, rate) for value in (0.0, gamma)]
        return means[1] - means[0]

    def rate_run(self, number, row, kv, rate):
        """Mean flow stress [Pa], from the table or a run."""
        key = {"kind": "rate", "number": number, "row": list(row), "kv": kv, "rate": rate}
        record = self.table.find(**key, state="done")
        if record is None:
            begin = time.monotonic()
            try:
                ended = {"state": "done", "found": runs.flow_stress(self.body, row, kv, self.targets, rate, self.ranks, self.folder, self.timeout,
                                                                    f"rate run {number}" if number else "twin without damping")}
            except runs.Failed as failure:
                ended = {"state": "failed", "reason": str(failure)}
            record = self.table.add({**key, "seconds": round(time.monotonic() - begin, 2), **ended})
            if record["state"] == "failed":
                raise Refused(f"--rate: the run at {rate:g}/s failed: {record['reason']}; the run table is {self.table.path}")
        return record["found"]
