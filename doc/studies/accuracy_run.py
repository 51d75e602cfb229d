# SPDX-License-Identifier: GPL-2.0-only
"""Runs the cases of accuracy_cases.py one after the other, each beside a pull of the baseline, and keeps what they gave.

Times are processor times of the whole run, all ranks together, less what a start of LAMMPS takes. Results are appended to
results.csv of the work folder as they come, so that an interrupted sweep goes on where it was.
"""

import csv
import hashlib
import pathlib
import platform
import resource
import shutil
import statistics
import subprocess
import sys

from study import CHECKOUT, DECKS, RunError, deck_command, edited_deck, environment, format_seconds, lammps_command, lammps_error, output_of, watched, write_csv
import numpy as np

import accuracy_cases as cases
from evp import curves, specimen

STRESSES = {"stress_0.3pc_MPa": 0.003, "stress_0.5pc_MPa": 0.005, "stress_0.77pc_MPa": 0.0077, "stress_1pc_MPa": 0.01, "stress_2pc_MPa": 0.0195}
COLUMNS = ("knob", "choice", "spheres", "seed", "kind", "ranks", "seconds", "baseline_seconds", "start_seconds", *STRESSES, "E_GPa",
           "first_yield_strain", "yield_MPa", "energy_open", "lammps", "processor")
WHOLE = 0.999  # of the strain of a pull: what ended before was stopped
REPEATED = (0.5, 3)  # runs shorter than this [s of processor time] are timed so often, and the median taken
OWN_NAMES = ("results.csv", "stamp", "run.log", "specimen_*.data")  # in the work folder, beside run/


def stress_at(strain, stress, at):
    """Value at a strain of a parabola through the rows about it, three rows at least: no bias by curvature."""
    reach = max(curves.STRESS_WINDOW, np.sort(np.abs(strain - at))[2]) + 1e-9
    near = np.abs(strain - at) <= reach
    return np.polyval(np.polyfit(strain[near] - at, stress[near], 2), 0.0)


def measures(curve):
    """What is compared of a curve (rows of any distance): a dict with COLUMNS from the stresses to yield_MPa.

    E is the slope to 0.3 %, or to the second row where rows are farther apart; first yield the strain where the tangent
    falls below 90 % of it, nan where the rows are too coarse for a tangent. RunError where the pull ended early.
    """
    strain, stress = curve.strain, curve.virial
    if strain.max() < WHOLE * max(STRESSES.values()):
        raise RunError(f"the tension test ended at a strain of {strain.max():g}")
    found = {name: 1e-6 * stress_at(strain, stress, at) for name, at in STRESSES.items()}
    straight = (strain > 0.0) & (strain <= max(curves.MODULUS_END, np.sort(strain)[1]) + 1e-9)
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


def processor_seconds(command, folder, log):
    """Runs a command; its processor time [s], children included. RunError with LAMMPS' words where it failed."""
    with open(log, "wb") as output:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        process = subprocess.run(command, cwd=folder, env=environment(), stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if process.returncode:
        raise RunError(f"exit {process.returncode}: {lammps_error(log)}\n  command: {' '.join(map(str, command))}")
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def processor_name():
    """What the machine calls its processor."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as source:
            return next(line.split(":", 1)[1].strip() for line in source if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


class Laboratory:
    """Where cases are run: a work folder with specimens and results."""

    def __init__(self, folder, fresh=False, repeats=REPEATED[1]):
        lammps_command()  # a missing lmp is told before anything is forgotten
        self.folder, self.repeats = pathlib.Path(folder).absolute(), repeats
        self.results, self.inside = self.folder / "results.csv", self.folder / "run"
        self.own_or_refuse(fresh)
        self.inside.mkdir(parents=True, exist_ok=True)
        (self.inside / "empty.lmp").write_text("\n", encoding="utf-8")
        self.check_stamp()
        self.two_ranks = self.has_two_ranks()
        self.start = {n: statistics.median(self.lammps(n, self.inside / "empty.lmp", {}) for _ in range(5)) for n in ((1, 2) if self.two_ranks else (1,))}
        self.machine = {"lammps": self.release(), "processor": processor_name()}
        self.baselines = []
        for _ in range(3):
            self.baseline()

    def own_or_refuse(self, fresh):
        """Takes a folder that is new, empty or ours; forgets what is ours where asked. RunError for any other folder."""
        if self.folder.exists() and any(self.folder.iterdir()) and not (self.folder / "stamp").exists():
            raise RunError(f"{self.folder} holds files of others: give --work an empty folder")
        if fresh and self.folder.exists():
            for name in OWN_NAMES:
                for path in self.folder.glob(name):
                    path.unlink()
            shutil.rmtree(self.folder / "run", ignore_errors=True)

    def check_stamp(self):
        """Results of another program, deck, plan or measure must not be mixed with this one's."""
        mark = hashlib.sha256(output_of([*lammps_command(), "-h"], self.folder, "lmp -h").encode())
        here = pathlib.Path(__file__).parent
        sources = [*sorted(DECKS.glob("in.*")), *sorted((CHECKOUT / "src").glob("*/*.*")), CHECKOUT / "CMakeLists.txt",
                   here / "accuracy_cases.py", here / "accuracy_run.py", pathlib.Path(curves.__file__), pathlib.Path(specimen.__file__)]
        for path in sources:
            mark.update(path.read_bytes())
        stamp = self.folder / "stamp"
        if stamp.exists() and stamp.read_text(encoding="utf-8") != mark.hexdigest():
            raise RunError(f"{self.folder} holds results of another program, deck or plan: start over with --fresh, or give another --work")
        stamp.write_text(mark.hexdigest(), encoding="utf-8")

    def has_two_ranks(self):
        """Does mpirun start here?"""
        try:
            self.lammps(2, self.inside / "empty.lmp", {})
            return True
        except RunError as error:
            print(f"mpirun does not start here, all runs are on one MPI rank: {str(error).splitlines()[0]}", file=sys.stderr, flush=True)
            return False

    def release(self):
        """'4 Feb 2025', by the first line that LAMMPS prints."""
        first = (self.folder / "run.log").read_text(encoding="utf-8", errors="replace")
        return first.split("LAMMPS (", 1)[1].split(")")[0] if "LAMMPS (" in first else "unknown"

    def lammps(self, ranks, deck, variables):
        """Processor seconds of one run of a deck (a path) in the run folder."""
        return processor_seconds(deck_command(deck, variables, ranks), self.inside, self.folder / "run.log")

    def specimen(self, spheres, seed):
        """Name, seen from the run folder, of a data file of in.specimen, made once. LAMMPS takes no path with a space."""
        name = f"specimen_{spheres}_{seed}.data"
        if not (self.folder / name).exists():
            self.lammps(2 if spheres >= 8000 and self.two_ranks else 1, DECKS / "in.specimen", {"n": spheres, "seed": seed, "out": "new.data"})
            (self.inside / "new.data").replace(self.folder / name)
            (self.inside / "new.data.body").replace(self.folder / (name + ".body"))
        return f"../{name}"

    def baseline(self):
        """Processor seconds of the unit, one pull of 500 spheres to 2 %: the median of this one and the two before."""
        words = {"specimen": self.specimen(500, 1), "coeff": cases.TABLE1, "strain": cases.STRAIN, "out": "baseline", **cases.BASELINE}
        self.baselines.append(max(self.lammps(1, DECKS / "in.traction", words) - self.start[1], 1e-3))
        return statistics.median(self.baselines[-3:])

    def run(self, case):
        """One case; its row for results.csv. RunError or ValueError where it gave no whole curve."""
        ranks = case.ranks if self.two_ranks else 1
        words = {"specimen": self.specimen(case.spheres, case.seed), "out": "case", **case.variables}
        (self.inside / "also.lmp").write_text(case.hook or "\n", encoding="utf-8")
        if case.hook:
            words["also"] = "also.lmp"
        zone = words.get("zone")
        deck = changed_deck(case.deck, words, self.inside)
        if case.keep_modulus:
            words["coeff"] = same_modulus(words["coeff"], self.inside / words["specimen"], zone)
        for left_before in ("case.csv", "balance.csv"):
            (self.inside / left_before).unlink(missing_ok=True)
        row = {"knob": case.knob, "choice": case.choice, "spheres": case.spheres, "seed": case.seed, "kind": case.key[-1], "ranks": ranks, **self.machine}
        if case.ledger:
            self.lammps(ranks, deck, words)
            table = np.genfromtxt(self.inside / "balance.csv", delimiter=",", skip_header=1)
            row["energy_open"] = f"{np.max(np.abs(table[:, 1])) / table[-1, 2]:.5g}"
            return row
        times = []
        while not times or (times[0] < REPEATED[0] and len(times) < self.repeats):
            baseline = self.baseline()
            times.append(self.lammps(ranks, deck, words) - self.start[ranks])
        row.update(seconds=f"{max(statistics.median(times), 1e-3):.5g}", baseline_seconds=f"{baseline:.5g}", start_seconds=f"{self.start[ranks]:.5g}")
        row.update({name: f"{value:.9g}" for name, value in measures(curves.read_curve(self.inside / "case.csv")).items()})
        return row


def changed_deck(name, words, folder):
    """The path of a deck in a folder with the lines changed that hold `timestep`, `samples`, `tolerance` and `zone`; takes these from the words."""
    given = {word: words.pop(word) for word in ("timestep", "samples", "tolerance", "zone") if word in words}
    step = f"{given['timestep']:g}" if given.get("timestep") else "v_dtfraction*c_dt"
    steps = f"v_row/(abs(v_rate)*{step})"
    changes = []
    if "timestep" in given or "samples" in given:
        changes += [("variable        each equal", f"variable each equal $(ceil({steps}/{given.get('samples', 10)}))"),
                    ("variable        every equal", f"variable every equal $(v_each*ceil({steps}/v_each-1e-9))")]
    if "tolerance" in given:
        changes += [("variable        force index", f"variable force index $({given['tolerance']}*mass(all)/count(all)*v_row_xi_s*v_diameter/(3*c_dt[1]^2))")]
    if "zone" in given:
        changes += [("fix             bonds", f"fix bonds all evp/bonds zone {given['zone']}")]
    return edited_deck(name, folder, *changes)


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
    """{key of a case: row of text} of a results file, without a last line that was cut short; RunError where it is not one."""
    text = pathlib.Path(path).read_text(encoding="utf-8")
    whole = text[:text.rfind("\n") + 1].splitlines()
    reader = csv.DictReader(whole)
    if tuple(reader.fieldnames or ()) != COLUMNS:
        raise RunError(f"{path} is not a table of results: its first line must be {','.join(COLUMNS)}")
    return {(row["knob"], row["choice"], row["spheres"], row["seed"], row["kind"]): row for row in reader}


def within_budget(plan, known, seconds, unit):
    """(cases, their expected seconds): those that fit into so many seconds, by priority, in the order of the plan; those of
    priority 1 always do, and those that are known cost nothing."""
    cost = {case.key: 0.0 if case.key in known else expected_seconds(case, unit) for case in plan}
    chosen, spent = set(), 0.0
    for case in sorted(plan, key=lambda case: case.priority):
        if case.priority == 1 or spent + cost[case.key] <= seconds:
            chosen.add(case.key)
            spent += cost[case.key]
    return [case for case in plan if case.key in chosen], spent


def expected_seconds(case, unit):
    """Wall time of a case with its baselines [s], unit: processor time of the baseline."""
    start = 0.4
    if case.ledger:
        return start + unit * case.guess
    repeats = REPEATED[1] if unit * case.guess < REPEATED[0] else 1
    making = 30.0 * (case.spheres / 32000) ** 1.15 if case.spheres > 500 else 0.0
    return making + repeats * (2.0 * start + unit * (1.0 + case.guess / case.ranks))


def run_plan(laboratory, plan):
    """All cases that have no result yet; rows go to results.csv at once. Returns all rows by key.

    A failed case of priority 1 ends the sweep with RunError; another one is told and left out.
    """
    known = read_results(laboratory.results) if laboratory.results.exists() else {}
    write_csv(laboratory.results, COLUMNS, known.values())
    left = [case for case in plan if case.key not in known]
    if len(left) < len(plan):
        print(f"{len(plan) - len(left)} of {len(plan)} runs are already done", file=sys.stderr, flush=True)
    for case in watched("accuracy:", left, lambda case: f"{case.knob}: {case.choice}, {case.spheres} spheres, seed {case.seed}{', energy' * case.ledger}",
                        lambda case: expected_seconds(case, laboratory.baselines[-1])):
        try:
            row = laboratory.run(case)
        except (RunError, ValueError) as error:
            words = f"{case.knob}, {case.choice}, seed {case.seed}: {error}"
            if case.priority == 1:
                raise RunError(words) from error
            print(f"\nleft out because it failed: {words}", file=sys.stderr, flush=True)
            continue
        known[case.key] = {name: str(row.get(name, "")) for name in COLUMNS}
        with open(laboratory.results, "a", newline="", encoding="utf-8") as target:
            csv.DictWriter(target, COLUMNS, lineterminator="\n").writerow(known[case.key])
    return known


def describe(plan, every, seconds):
    """A line that says what is going to be done."""
    left_out = len(every) - len(plan)
    return f"{len(plan)} runs, about {format_seconds(seconds)}" + (f"; {left_out} left out to stay within the budget" if left_out else "")
