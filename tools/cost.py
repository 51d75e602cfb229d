#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Forecasts what a run will cost, as a whole: steps, core hours, time and memory, the share of each effect, and the error to expect.

    tools/cost.py lammps_inputs/in.traction -var specimen my.data -var rate 10
    tools/cost.py --ranks 1 2 32 --n 100000 lammps_inputs/in.stir -var specimen plate.data
    tools/cost.py --ranks 128 --hosts 4 --n 10000000 my_deck.in

Options of cost.py stand before the input script, those of LAMMPS behind it. A whole command, [mpirun ...] lmp -in SCRIPT ..., does as well, but for the
number of its MPI ranks: give --ranks. The script runs for --seconds, on one MPI rank or on those of --ranks for which this machine has cores; then
each fix of this package is timed by steps with and without it. The other rows of the table are scaled from these: time of a step and memory with
the number of spheres, steps with its cube root where the timestep follows the diameter, and ranks beyond the cores of this machine by the
efficiency that doc/performance.md fits. Measured is processor time; 'time' is that on cores that do nothing else.

How long a run is, a script says by a variable, as for frames.lmp: last, of its increments k; nsteps, of each of its nruns runs (default 1); or
duration [s]. Where it has none of them, its lines `run N` count. What it writes goes to a temporary folder: it runs in a copy of the present
folder, but where it takes -var out, as those of lammps_inputs do. The error is that which doc/studies/accuracy_cost.py measured for the same
script. LAMMPS is the lmp of this checkout, or EVP_LMP and EVP_MPIRUN.
"""

import argparse
import csv
import os
import pathlib
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
from typing import NamedTuple

import evp  # noqa: F401  before numpy
import numpy as np
from evp import efficiency
from evp.report import command_line, errors_in_one_line, print_table, whole
from evp.run import CHECKOUT, RunError, ended, format_seconds, lammps_command, lammps_error

MEASURED = CHECKOUT / "doc" / "accuracy_errors.csv"
PERFORMANCE = CHECKOUT / "doc" / "performance.csv"
MARK = "cost.py:"  # begins the lines that part the output
EFFECTS = "evp/energy", "evp/volume", "evp/heat", "dt/evp"  # fixes that a run does without
OUTPUT = re.compile(r"ave/\w+|print|halt|vector")  # fixes that may refer to them
LOOP = re.compile(r"^Loop time of (\S+) on \d+ procs for (\d+) steps with (\d+) atoms", re.M)
LOAD = re.compile(r"^([\d.]+)% CPU use", re.M)  # of the processor in a loop: less than 100 beside other programs
MINIMIZED = "Minimization stats:"  # stands behind the loop time of a minimization
AT = re.compile(rf"^{MARK} (\w+) (\S+) of (\S+), step (\d+) of (\S+) s, after (\S+) s: .*\) \S (.*)$", re.M)
PEAK = re.compile(r"^VmHWM:\s+(\d+) kB", re.M)
LARGE = 30000  # spheres, below which what LAMMPS takes for any body, and not for each sphere, is seen in the memory
FEWEST = 500  # spheres per MPI rank, of the runs of doc/performance.md: 32 000 on 16 ranks have 2000
LEAST = 2.0  # [s] of processor time, where a script is cut short
LARGEST = 1e9  # [bytes] of a folder that is copied
PARTS = "Pair", "Neigh", "Comm", "Output", "Modify"  # of LAMMPS' breakdown
# The memory of the first MPI rank, in a file of Linux.
MEMORY = """variable cost_status file /proc/self/status
label cost_status
print "${cost_status}"
next cost_status
jump SELF cost_status
"""
# How far the script is, and the processor time of the first MPI rank, in the first line of a file of Linux.
PROGRESS = f"""variable cost_now timer
variable cost_stat file /proc/self/stat
variable cost_way string 'lines 0 of 0'
variable nruns index 1
if "$(is_defined(variable,last)*is_defined(variable,k))" then "variable cost_way string 'last $(v_k) of $(v_last)'" &
elif "$(is_defined(variable,nsteps))" "variable cost_way string 'nsteps $(step) of $(v_nruns*v_nsteps)'" &
elif "$(is_defined(variable,duration))" "variable cost_way string 'duration $(time) of $(v_duration)'"
print "{MARK} ${{cost_way}}, step $(step) of $(dt) s, after $(v_cost_now) s: ${{cost_stat}}"
variable cost_stat delete
"""


class Progress(NamedTuple):
    """What PROGRESS printed, where the script includes ${also} and where it has ended. kind: the variable that says how long the script is, or lines; done and
    total: of it; dt [s]; wall, processor: time so far [s]."""

    kind: str
    done: float
    total: float
    step: int
    dt: float
    wall: float
    processor: float


class Cost(NamedTuple):
    """A row of the table. start: time before the first step [s]; each: time of a step; empty, memory: of LAMMPS before it has read anything, and at
    most, per MPI rank [MB]; source: where the row is from."""

    spheres: int
    ranks: int
    hosts: int
    steps: float
    start: float
    each: float
    empty: float
    memory: float
    source: str
    bound: str = ""  # before the memory

    def scaled(self, spheres, ranks, hosts, fit, grows):
        """The row of another body on other ranks. fit: Efficiency; grows: the number of steps does."""
        share = spheres / self.spheres
        longer = share * self.ranks * fit.of(self.spheres, self.ranks) / (ranks * fit.of(spheres, ranks, hosts))
        memory = self.empty + (self.memory - self.empty) * share * self.ranks / ranks
        return Cost(spheres, ranks, hosts, self.steps * (share ** (1.0 / 3.0) if grows else 1.0), self.start * longer, self.each * longer, self.empty, memory,
                    "scaled" if (ranks, hosts) == (self.ranks, 1) else "scaled, ranks by the model",
                    "< " if share > 1.0 and self.spheres < LARGE else "")

    def texts(self):
        """The cells."""
        seconds = self.start + self.steps * self.each
        hours, memory = self.ranks * seconds / 3600.0, self.ranks * self.memory / self.hosts
        return (str(self.spheres), str(self.ranks), str(self.hosts), f"{self.steps:.0f}", f"{1e3 * self.each:.3g} ms", short(hours), format_seconds(seconds),
                "-" if memory != memory else f"{self.bound}{memory:.0f} MB" if memory < 1e4 else f"{self.bound}{1e-3 * memory:.0f} GB", self.source)


def short(number):
    """Three digits, without an exponent."""
    return f"{number:.3g}" if number < 1000 else f"{number:.0f}"


def timings(deck, seconds):
    """Commands that time the body as it is, then without each effect, one after the other."""
    own = list(dict.fromkeys(re.findall(r"^fix\s+(\S+)\s+\S+\s+(\S+)", deck, re.M)))  # (ID, style) of those on lines of their own
    lines = ["thermo_style one"]
    lines += [f'if "$(is_defined(dump,{name}))" then "undump {name}"' for name in re.findall(r"^dump\s+(\S+)", deck, re.M)]
    lines += [f'if "$(is_defined(fix,{name}))" then "unfix {name}"' for name, style in reversed(own) if OUTPUT.fullmatch(style)]
    window = [f"timer timeout {seconds:.0f} every 20", "run 1000000000 post yes"]
    lines += [f"print '{MARK} as it is'", *window]
    for name, style in own:
        if style in EFFECTS and not re.search(rf"^compute\s.*\bf_{name}\b", deck, re.M):  # which would end the run without it
            commands = [f"print '{MARK} without {name} {style}'", f"unfix {name}", *window]
            lines.append(f'if "$(is_defined(fix,{name}))" then ' + " ".join(f'"{command}"' for command in commands))
    return "\n".join([*lines, f"print '{MARK} end'", ""])


def with_includes(path):
    """Text of a script behind those of the files beside it that it includes, and of theirs."""
    text = path.read_text(encoding="utf-8")
    return "".join(with_includes(path.parent / name) for name in re.findall(r"\$\{here\}/([\w.]+)", text)) + text


def script(options, text, folder, effects):
    """Writes in.cost, which runs the script of this text for a while and then, with effects, times them, and what it includes; the -var options of the script.
    Files go to the folder."""
    deck, seconds, words = options.deck.resolve(), options.seconds, options.arguments
    (folder / "memory.lmp").write_text(MEMORY, encoding="utf-8")
    (folder / "progress.lmp").write_text(PROGRESS, encoding="utf-8")
    (folder / "timings.lmp").write_text(timings(text, max(1.0, 0.1 * seconds)) if effects else f"print '{MARK} end'\n", encoding="utf-8")
    choices = ["-var", "out", str(folder / "out")] if re.search(r"^variable\s+out\s", text, re.M) else []
    end, begin = f"print '{MARK} deck ended'", f"timer timeout {seconds} every 10"
    memory = f"include {folder}/memory.lmp\n"
    probe = f"{memory}include {folder}/progress.lmp\n"
    if "${also}" in text:
        choices += ["-var", "also", str(folder / "also.lmp")]
        own = [f"include {value}\n" for flag, name, value in zip(words, words[1:], words[2:]) if (flag, name) == ("-var", "also")]
        cut = ""
        if re.search(r"^variable\s+last\s", text, re.M):  # a timeout would leave its minimization half done
            begin, cut = "", f'if "$((v_k>=3)*(v_cost_now>{seconds}))" then "print \'{MARK} cut short\'" "include {folder}/timings.lmp" "quit 0"\n'
        (folder / "also.lmp").write_text("".join((*own[:1], probe, cut)), encoding="utf-8")
    (folder / "in.cost").write_text(f"{memory}{begin}\ninclude {deck}\n{end}\n{probe}timer timeout off\ninclude {folder}/timings.lmp\n", encoding="utf-8")
    return choices


def copied(folder):
    """A copy of the present folder in another."""
    size = sum(path.stat().st_size for path in pathlib.Path.cwd().rglob("*") if path.is_file() and not path.is_symlink())
    if size > LARGEST:
        raise RunError(f"the script writes to the present folder, which has {1e-9 * size:.1f} GB, too much to copy it: run cost.py in a folder with the input of the script alone")
    return shutil.copytree(pathlib.Path.cwd(), folder / "copy", symlinks=True)


def own_cores():
    """Number of cores that this process may use. Two threads of a core count once, as mpirun counts them."""
    siblings = {cpu: pathlib.Path(f"/sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list") for cpu in os.sched_getaffinity(0)}
    return len({path.read_text(encoding="utf-8") if path.exists() else cpu for cpu, path in siblings.items()})


def children():
    """Processor time of the programs that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Run:
    """A run of the script for a while. parts: its output by title; atoms, cost; share: of the whole that was run, in used [s] of processor time; notes for the user."""

    def __init__(self, options, text, ranks, folder, effects):
        self.deck, self.ranks, self.notes = options.deck, ranks, []
        before, begun = children(), time.monotonic()
        choices = script(options, text, folder, effects)
        command = [*lammps_command(ranks), "-in", str(folder / "in.cost"), "-log", str(folder / "log"), *choices, *options.arguments]
        done = ended(command, pathlib.Path.cwd() if "out" in choices else copied(folder))
        wall, processor = time.monotonic() - begun, (children() - before) / ranks
        found = re.split(rf"^{MARK} (as it is|without .*|deck ended|cut short|end)\n", done.stdout, flags=re.M)
        self.parts = {"deck": found[0], **dict(zip(found[1::2], found[2::2]))}
        self.is_cut = "cut short" in self.parts or "WARNING: Wall time limit" in self.parts["deck"]
        if done.returncode:
            failed = lammps_error(done.stdout)
            if not self.is_cut and "deck ended" not in self.parts:
                raise RunError(f"{self.deck.name} failed (exit {done.returncode}): {failed}")
            self.notes.append(f"no shares, as the script cannot go on after its run is cut short: {failed}")
        log = (folder / "log").read_text(encoding="utf-8", errors="replace").partition(f"\n{MARK} deck ended")[0]
        marks = [Progress(words[0], float(words[1]), float(words[2]), int(words[3]), *map(float, words[4:6]), processor_time(words[6])) for words in AT.findall(done.stdout)]
        loops = timed_runs(log)
        steps = marks[-1].step - marks[0].step if marks and marks[0].kind == "last" else sum(number for _, number in loops)
        if "deck ended" in self.parts or "cut short" in self.parts:
            wall, processor = marks[-1].wall, marks[-1].processor
        start = marks[0].processor if marks and "also" in choices else processor * max(0.0, 1.0 - sum(seconds for seconds, _ in loops) / wall)
        self.used = processor - start
        if not marks or marks[-1].kind != "last":  # what is done once, as at the end, is not of the steps
            self.used = sum(seconds for seconds, _ in loops) * processor / wall
            start = processor - self.used
        if not steps:
            raise RunError(f"{self.deck.name} made no timestep in this time: give more --seconds")
        total = self.all_steps(steps, marks, [number for _, number in loops], log) if self.is_cut else steps
        self.share, self.atoms = steps / total, int(LOOP.search(log)[3])
        empty, *later = (1e-3 * float(size) for size in PEAK.findall(done.stdout))
        self.cost = Cost(self.atoms, ranks, 1, total, start, self.used / steps, empty, max(later, default=float("nan")), "measured")

    def all_steps(self, steps, marks, runs, log):
        """Steps of the whole script, which was cut short after so many. runs: steps of each run."""
        if re.search(r"^fix\s+\S+\s+\S+\s+halt\s", log, re.M):
            self.notes.append("at most: the script may end its run before")
        if not marks or marks[-1].kind == "lines":
            return self.steps_asked(log, runs)
        begin, end = marks[0], marks[-1]
        if end.kind == "last":
            self.notes.append("increments differ, elastic ones take least and those at yield most: the more of them are run, by --seconds, the better the forecast")
            return steps * (end.total - begin.done) / (end.done - begin.done)
        if end.kind == "nsteps":
            return end.total
        return (end.total - end.done) / end.dt + (steps if "deck ended" in self.parts else 0)  # by the timestep as it has become

    def steps_asked(self, log, done):
        """Steps by the lines `run N` and `run N upto` of a log. In a script that loops only up to the run that was cut short: those
        after it begin where it was cut, so that they are not as long as they would be."""
        runs = re.findall(r"^run +([1-9]\d*)\b(.*)$", log, re.M)
        cut = next((k for k, (one, (steps, _)) in enumerate(zip(done, runs), start=1) if one < int(steps)), len(runs))
        if cut < len(runs) and re.search(r"^(next|jump)\s", self.deck.read_text(encoding="utf-8"), re.M):
            self.notes.append(f"for the first {cut} of {len(runs)} runs, and the others on top: define a variable nsteps or duration, which says how long all are")
            runs = runs[:cut]
        asked = 0
        for steps, words in runs:
            asked = max(asked, int(steps)) if " upto" in words else asked + int(steps)
        return asked


def processor_time(stat):
    """Of a process [s], by what stands behind its state in /proc/PID/stat."""
    user, system = stat.split()[10:12]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def timed_runs(log):
    """[(seconds, steps)] of the runs in a log that made steps, without its minimizations."""
    loops = list(LOOP.finditer(log))
    ends = [one.start() for one in loops[1:]] + [len(log)]
    return [(float(one[1]), int(one[2])) for one, end in zip(loops, ends) if int(one[2]) and MINIMIZED not in log[one.end():end]]


def shares(parts):
    """Lines: the parts of a step as it is, and what each effect adds. parts: {title: output}."""
    whole = parts["as it is"]
    breakdown = {name: float(share) for name, share in re.findall(r"^(\w+) +\|[^|]+\|[^|]+\|[^|]+\|[^|]+\| *([\d.]+)$", whole, re.M)}
    yield "a step: " + ", ".join(f"{name} {breakdown[name]:.0f} %" for name in PARTS if breakdown.get(name, 0) >= 0.5)
    each = {title: float(LOAD.search(text)[1]) * float(LOOP.findall(text)[-1][0]) / int(LOOP.findall(text)[-1][1]) for title, text in parts.items()}
    first = before = each["as it is"]
    for title, now in each.items():
        if title != "as it is":
            yield f"{100 * max(0.0, before - now) / first:.0f} % of a step for fix {title.removeprefix('without ')}"
            before = now


def errors(deck, screen, atoms):
    """Lines: the errors that were measured for this script, at the choices that it printed: between values that were measured by straight lines over logarithms."""
    with open(MEASURED, newline="", encoding="utf-8") as source:
        own = [row for row in csv.DictReader(source) if row["deck"] == deck.name]
    told = re.search(rf"^{re.escape(deck.name)}: (.*)$", screen, re.M)
    choices = told[1].replace(",", " ").split() if told else []
    for load in dict.fromkeys(row["load"] for row in own):
        parts = []
        for choice in dict.fromkeys(row["choice"] for row in own if row["load"] == load):
            rows = [row for row in own if (row["load"], row["choice"]) == (load, choice)]
            given = choices[choices.index(choice) + 1] if choice in choices else rows[0]["value"]
            value = atoms if choice == "spheres" else abs(float(given))
            name = {"spheres": f"{atoms} spheres", "timestep": "timestep", "packing": f"packing of {rows[0]['value']}"}.get(choice, f"{choice} {given}")
            values, found = np.array(sorted((float(row["value"]), float(row["error_percent"])) for row in rows)).T
            finer = value > values[-1] if choice == "spheres" else value < values[0]
            beyond = "" if values[0] <= value <= values[-1] else "below " if finer else "above "
            parts.append(f"{name} {beyond}{np.exp(np.interp(np.log(value), np.log(values), np.log(found))):.2g} %")
        yield f"error to expect, as measured in '{load}': " + ", ".join(parts)
    if not own:
        yield "error to expect: not measured for this script; half the timestep, pace or increment, and twice the spheres, tell it"


def script_and_options(words):
    """SCRIPT and its options, of a command of LAMMPS too: [mpirun ...] lmp [...] -in SCRIPT ... Its program begins with lmp or lammps."""
    at = next((k for k, word in enumerate(words[:-1]) if word in ("-in", "-i")), None)
    if at is None:
        return words
    program = max((k for k in range(at) if pathlib.Path(words[k]).name.startswith(("lmp", "lammps"))), default=0)
    return [words[at + 1], *words[program + 1:at], *words[at + 2:]]


def main(words=None):
    words = sys.argv[1:] if words is None else words
    parser = command_line(__doc__)
    parser.add_argument("--n", type=whole(1), metavar="N", help="spheres of the rows that are asked for, those of tools among them (default: those of the script)")
    parser.add_argument("--ranks", type=whole(1), nargs="+", default=[1], metavar="R", help="MPI ranks, a row for each (default: 1)")
    parser.add_argument("--hosts", type=whole(1), default=1, metavar="H", help="computers that share the ranks (default: %(default)s)")
    parser.add_argument("--seconds", type=whole(1), default=20, metavar="S", help="for which the script runs (default: %(default)s)")
    parser.add_argument("deck", type=pathlib.Path, metavar="SCRIPT", help="input script of LAMMPS")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, metavar="...", help="options of LAMMPS, such as -var NAME VALUE")
    first = next((k for k, word in enumerate(words) if not re.match(r"-|\d+$", word)), len(words))  # the script ends the numbers of --ranks
    options = parser.parse_args([*words[:first], *(["--"] if first < len(words) else []), *script_and_options(words[first:])])
    resumed = [k for k in range(len(options.arguments)) if options.arguments[k:k + 3] == ["-var", "resume", "yes"]]
    for k in resumed:
        options.arguments[k + 2] = "no"
    if min(options.ranks) < options.hosts:
        parser.error(f"each host has an MPI rank: give --hosts of at most {min(options.ranks)}")
    cores = own_cores()
    counts = sorted({min(ranks, cores) for ranks in options.ranks})
    with errors_in_one_line("cost.py"):
        print(f"cost.py: runs {options.deck.name} for about {format_seconds((len(counts) + 0.5) * options.seconds)}", file=sys.stderr, flush=True)
        text, runs = with_includes(options.deck), {}
        for ranks in counts:
            with tempfile.TemporaryDirectory(prefix="evp_cost_") as folder:
                runs[ranks] = Run(options, text, ranks, pathlib.Path(folder), ranks == counts[-1])
        run = runs[counts[-1]]
        if resumed:
            run.notes.append("of the whole run, with what is done of it: as by -var resume no")
        farthest = max(runs.values(), key=lambda one: one.share)  # the number of steps does not depend on the ranks
        for one in runs.values():
            one.cost = one.cost._replace(steps=farthest.cost.steps)
        if run.share < 1.0 and run.used < LEAST:
            run.notes.append(f"WARNING: less than {LEAST:g} s of processor time were measured, too little for a forecast: give more --seconds")
        fit, spheres = efficiency.read(PERFORMANCE), options.n or run.atoms
        rows = [one.cost for one in runs.values()]
        for ranks in options.ranks:
            if (spheres, options.hosts) != (run.atoms, 1) or ranks not in runs:
                rows.append(runs[min(ranks, cores)].cost.scaled(spheres, ranks, options.hosts, fit, bool(re.search("evp/dt|dt/evp", text))))
        print_table(("spheres", "ranks", "hosts", "steps", "a step", "core hours", "time", "memory of a host", "row"), [row.texts() for row in rows])
        print(f"  measured: {100 * run.share:.{3 if run.share == 1 else 2}g} % of the steps of {options.deck.name}, {run.used:.2g} s of processor time on each rank")
        if any(row.spheres / row.ranks < FEWEST and "scaled" in row.source for row in rows):
            print(f"  WARNING: rows with fewer than {FEWEST} spheres on a rank were not measured: a rank then mostly waits")
        if any("model" in row.source for row in rows):
            print(f"  model: efficiency by doc/performance.md, {100 * fit.of(spheres, max(options.ranks), options.hosts):.0f} % on {max(options.ranks)} MPI ranks: fitted to "
                  f"runs on at most {fit.most} ranks of one host, which it meets within {100 * fit.off:.0f} %; it has no network between hosts")
        uncut = run.parts["deck"].partition("WARNING: Wall time limit")[0]  # what comes after it is of a run that was cut short
        effects = {title: part for title, part in run.parts.items() if title == "as it is" or title.startswith("without ")}
        warnings = dict.fromkeys(re.findall("^WARNING: .*", uncut, re.M))
        misspelt = [f"WARNING: there is no variable {name} in {options.deck.name}" for flag, name in zip(options.arguments, options.arguments[1:])
                    if flag == "-var" and "${also}" in text and not re.search(rf"\b{re.escape(name)}\b", text)]  # evp_choices is silent with a file also
        for line in (*run.notes, *misspelt, *warnings, *(shares(effects) if "end" in run.parts else ()), *errors(options.deck, run.parts["deck"], spheres)):
            print(f"  {line}")


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # of `| head`
    sys.exit(main())
