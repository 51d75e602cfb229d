# SPDX-License-Identifier: GPL-2.0-only
"""Runs the cases of evp.accuracy_cases one after the other, each beside a pull of the baseline, and keeps what they gave.

Times are processor times of the whole run, all ranks together, less what a start of LAMMPS takes. Results are appended to
results.csv of the work folder as they come, so that an interrupted sweep goes on where it was.
"""

import csv
import hashlib
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys
import time

import numpy as np

from . import accuracy_cases as cases
from . import curves, specimen
from .run import CHECKOUT, DECKS, RunError, format_seconds, lammps_command, lammps_error

COLUMNS = ("knob", "choice", "spheres", "seed", "kind", "ranks", "seconds", "baseline_seconds", "E_GPa", "stress_0.5pc_MPa",
           "stress_1pc_MPa", "stress_2pc_MPa", "first_yield_strain", "yield_MPa", "energy_open")
STRESSES = {"stress_0.5pc_MPa": 0.005, "stress_1pc_MPa": 0.01, "stress_2pc_MPa": 0.0195}
WINDOW = 0.0006  # +- of strain about which a parabola is laid
MODULUS_END = 0.003


def local(strain, stress, at, degree):
    """Value at a strain of a parabola (degree 2) or line through the rows about it, three rows at least: no bias by curvature."""
    reach = max(WINDOW, np.sort(np.abs(strain - at))[degree]) + 1e-9
    near = np.abs(strain - at) <= reach
    return np.polyval(np.polyfit(strain[near] - at, stress[near], degree), 0.0)


def measures(curve):
    """What is compared of a curve (rows of any distance): a dict with COLUMNS from E_GPa to yield_MPa.

    E is the slope to 0.3 %, or to the second row where rows are farther apart; first yield the strain where the tangent
    falls below 90 % of it; nan where the rows are too coarse for a tangent.
    """
    strain, stress = curve.strain, curve.virial
    found = {name: 1e-6 * local(strain, stress, at, 2) for name, at in STRESSES.items()}
    straight = (strain > 0.0) & (strain <= max(MODULUS_END, np.sort(strain)[1]) + 1e-9)
    if np.sum(straight) >= 3:
        modulus = np.polyfit(strain[straight], stress[straight], 1)[0]
    else:
        modulus = stress[straight][-1] / strain[straight][-1]
    found["E_GPa"] = 1e-9 * modulus
    found["yield_MPa"] = 1e-6 * curves.yield_stress(strain, stress, modulus)
    try:
        found["first_yield_strain"] = curves.departure_strain(strain, stress, modulus)
    except curves.CurveError:
        found["first_yield_strain"] = float("nan")
    return found


def processor_seconds(command, folder, log, environment):
    """Runs a command; its processor time [s], children included. RunError with LAMMPS' words where it failed."""
    with open(log, "wb") as output:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        process = subprocess.run(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if process.returncode:
        raise RunError(f"exit {process.returncode}: {lammps_error(log)}\n  command: {' '.join(map(str, command))}")
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


class Laboratory:
    """Where cases are run: a work folder with specimens, results and, where asked, native code."""

    def __init__(self, folder, fresh=False):
        self.folder = pathlib.Path(folder).absolute()
        if fresh and (self.folder / "results.csv").exists():
            shutil.rmtree(self.folder)
        (self.folder / "run").mkdir(parents=True, exist_ok=True)
        self.environment = dict(os.environ)
        self.environment.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
        self.results = self.folder / "results.csv"
        self.check_stamp()
        self.start = statistics.median(self.lammps(1, "empty.lmp", {}) for _ in range(3))
        self.baseline_seconds = self.baseline()

    def check_stamp(self):
        """Results of another program must not be mixed with this one's."""
        (self.folder / "run" / "empty.lmp").write_text("\n", encoding="utf-8")
        mark = hashlib.sha256(subprocess.run([*lammps_command(), "-h"], stdin=subprocess.DEVNULL, capture_output=True, check=False).stdout)
        for path in [*sorted(DECKS.glob("in.*")), *sorted((CHECKOUT / "src").iterdir()), pathlib.Path(cases.__file__)]:
            mark.update(path.read_bytes())
        stamp = self.folder / "stamp"
        if stamp.exists() and stamp.read_text(encoding="utf-8") != mark.hexdigest():
            raise RunError(f"{self.folder} holds results of another program, deck or plan: start anew with --fresh, or take another --work")
        stamp.write_text(mark.hexdigest(), encoding="utf-8")

    def lammps(self, ranks, deck, variables, native=False):
        """Processor seconds of one run of a deck in the run folder."""
        path = deck if (self.folder / "run" / deck).exists() else DECKS / deck
        words = [word for key, value in variables.items() for word in ("-var", key, str(value))]
        command = [*lammps_command(ranks), "-in", str(path), "-log", "none", *words]
        environment = dict(self.environment, EVP_PLUGIN_DIR=str(self.folder / "native")) if native else self.environment
        return processor_seconds(command, self.folder / "run", self.folder / "run.log", environment)

    def specimen(self, spheres, seed):
        """Data file of in.specimen, made once."""
        path = self.folder / f"specimen_{spheres}_{seed}.data"
        if not path.exists():
            self.lammps(2 if spheres >= 8000 else 1, "in.specimen", {"n": spheres, "seed": seed, "out": "new.data"})
            (self.folder / "run" / "new.data").replace(path)
        return path

    def baseline(self):
        """Processor seconds of the unit: one pull of 500 spheres to 2 %."""
        words = {"specimen": self.specimen(500, 1), "coeff": cases.TABLE1, "strain": cases.STRAIN, "out": "baseline", **cases.BASELINE}
        return max(self.lammps(1, "in.traction", words) - self.start, 1e-3)

    def has_own_build(self):
        """Is lmp that of tools/setup.sh, which can load a plugin from elsewhere and knows how it was made?"""
        return pathlib.Path(lammps_command()[0]) == CHECKOUT / "build" / "lmp" and (CHECKOUT / "build" / "CMakeCache.txt").exists()

    def build_native(self):
        """The plugin for this machine's processor, by the settings of the checkout's own build. Requires has_own_build()."""
        native, own = self.folder / "native", CHECKOUT / "build"
        if (native / "evpplugin.so").exists():
            return
        cache = dict(line.split("=", 1) for line in (own / "CMakeCache.txt").read_text(encoding="utf-8").splitlines() if "=" in line and line[0] not in "#/")
        given = [f"-D{key}={value}" for key, value in cache.items() if key.split(":")[0] in ("LAMMPS_SOURCE_DIR", "LAMMPS_BUILD_DIR", "CMAKE_BUILD_TYPE", "Python_EXECUTABLE")]
        for command in (["cmake", "-S", str(CHECKOUT), "-B", str(native), "-DCMAKE_CXX_FLAGS=-march=native", *given],
                        ["cmake", "--build", str(native), "-j", str(os.cpu_count()), "--target", "evpplugin"]):
            done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8", check=False)
            if done.returncode:
                raise RunError(f"{' '.join(command)} failed:\n{done.stdout[-1500:]}")

    def run(self, case):
        """One case; its row for results.csv."""
        data = self.specimen(case.spheres, case.seed)
        (self.folder / "run" / "also.lmp").write_text(case.hook or "\n", encoding="utf-8")
        words = {"specimen": data, "out": "case", **case.variables}
        if case.hook:
            words["also"] = "also.lmp"
        if case.keep_modulus:
            words["coeff"] = same_modulus(words["coeff"], data, words.get("zone"))
        if case.native:
            self.build_native()
        baseline = float("nan") if case.ledger else self.baseline()
        seconds = max(self.lammps(case.ranks, case.deck, words, case.native) - self.start, 1e-3)
        row = {"knob": case.knob, "choice": case.choice, "spheres": case.spheres, "seed": case.seed, "kind": case.key[-1], "ranks": case.ranks}
        if case.ledger:
            table = np.genfromtxt(self.folder / "run" / "balance.csv", delimiter=",", skip_header=1)
            row["energy_open"] = f"{np.max(np.abs(table[:, 1])) / table[-1, 2]:.5g}"
        else:
            row.update(seconds=f"{seconds:.5g}", baseline_seconds=f"{baseline:.5g}")
            row.update({name: f"{value:.9g}" for name, value in measures(curves.read_curve(self.folder / "run" / "case.csv")).items()})
        return row


def same_modulus(coeff, data, zone=None):
    """Row of coefficients with e1 and e2 changed so that the affine E, thus e times the number of bonds, is that of alpha 1.5.

    Bonds are the pairs within the zone, by default within the row's alpha."""
    words = coeff.split()
    body = specimen.read_data(data)
    bonds = [len(specimen.pairs_within(body, reach)[0]) for reach in (1.5, float(zone or words[8]))]
    for place in (0, 3):
        words[place] = f"{float(words[place]) * bonds[0] / bonds[1]:.12g}"
    return " ".join(words)


def read_results(path):
    """{key of a case: row of text} of a results file; RunError where it is not one."""
    with open(path, newline="", encoding="utf-8") as source:
        reader = csv.DictReader(source)
        if tuple(reader.fieldnames or ()) != COLUMNS:
            raise RunError(f"{path} is no table of results: its first line must be {','.join(COLUMNS)}")
        return {(row["knob"], row["choice"], row["spheres"], row["seed"], row["kind"]): row for row in reader if row["energy_open"] is not None}


def within_budget(plan, seconds, unit):
    """The cases that fit into so many seconds, by priority, in the order of the plan; those of priority 1 always do."""
    cost = {case.key: expected_seconds(case, unit) for case in plan}
    chosen, spent = set(), 0.0
    for case in sorted(plan, key=lambda case: case.priority):
        if case.priority == 1 or spent + cost[case.key] <= seconds:
            chosen.add(case.key)
            spent += cost[case.key]
    return [case for case in plan if case.key in chosen], spent


def expected_seconds(case, unit):
    """Wall time of a case with its baseline [s], unit: processor time of the baseline."""
    start = 0.6 if case.ledger else 1.2
    making = 30.0 * (case.spheres / 32000) ** 1.15 if case.spheres > 500 else 0.0
    return start + unit * (1.0 + case.guess / case.ranks) + making


def run_plan(laboratory, plan, show=None):
    """All cases that have no result yet; rows go to results.csv at once. Returns all rows by key."""
    known = read_results(laboratory.results) if laboratory.results.exists() else {}
    if not known:
        laboratory.results.write_text(",".join(COLUMNS) + "\n", encoding="utf-8")
    left = [case for case in plan if case.key not in known]
    if len(left) < len(plan):
        print(f"{len(plan) - len(left)} of {len(plan)} runs are there already", file=sys.stderr, flush=True)
    progress = show or Progress([expected_seconds(case, laboratory.baseline_seconds) for case in left])
    for number, case in enumerate(left):
        progress.before(number, f"{case.knob}: {case.choice}, {case.spheres} spheres, seed {case.seed}{', energy' * case.ledger}")
        try:
            row = laboratory.run(case)
        except RunError as error:
            raise RunError(f"{case.knob}, {case.choice}, seed {case.seed}: {error}") from error
        with open(laboratory.results, "a", newline="", encoding="utf-8") as target:
            csv.DictWriter(target, COLUMNS, restval="", lineterminator="\n").writerow(row)
        known[case.key] = {name: str(row.get(name, "")) for name in COLUMNS}
    progress.close()
    return known


class Progress:
    """A bar on a terminal, plain lines elsewhere, with the time left by what the runs were expected to cost."""

    def __init__(self, expected):
        self.expected, self.begin, self.terminal = expected, time.monotonic(), sys.stderr.isatty()

    def before(self, number, name):
        done, whole = sum(self.expected[:number]), sum(self.expected)
        spent = time.monotonic() - self.begin
        left = whole - done if done < 5.0 else spent * (whole - done) / done
        share = done / whole
        bar = f"[{'#' * int(20 * share):<20}] " if self.terminal else ""
        text = f"{bar}{number + 1}/{len(self.expected)}, about {format_seconds(left)} left: {name}"
        print(f"\r\x1b[K{text}" if self.terminal else text, end="" if self.terminal else "\n", file=sys.stderr, flush=True)

    def close(self):
        if self.terminal:
            print("\r\x1b[K", end="", file=sys.stderr)
        print(f"{len(self.expected)} runs in {format_seconds(time.monotonic() - self.begin)}", file=sys.stderr, flush=True)
