#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Forecasts what a run will cost: its steps, the time left, the share of each effect, and the error to expect.

    tools/cost.py lammps_inputs/in.traction -var specimen my.data -var rate 10
    tools/cost.py --ranks 2 --seconds 20 my_deck.in

Options of cost.py stand before the input script, those of LAMMPS behind it. The script runs for --seconds; then each fix of this package
is timed by steps with and without it. What the script writes goes to a temporary folder: it runs in a copy of the present folder, but where
it takes -var out, as those of lammps_inputs do. A script of minimizations is timed by its line `include ${also}`, and tells the time left itself. The error is that which
doc/studies/accuracy_cost.py measured for the same script. LAMMPS is the lmp of this checkout, or EVP_LMP and EVP_MPIRUN.
"""

import argparse
import collections
import csv
import pathlib
import re
import shutil
import signal
import sys
import tempfile

import evp  # noqa: F401  before numpy
import numpy as np
from evp.report import command_line, errors_in_one_line, whole
from evp.run import CHECKOUT, RunError, ended, format_seconds, lammps_command, lammps_error

MEASURED = CHECKOUT / "doc" / "accuracy_errors.csv"
MARK = "cost.py:"  # begins the lines that part the output
EFFECTS = "evp/energy", "evp/volume", "evp/heat", "dt/evp"  # fixes that a run does without
OUTPUT = re.compile(r"ave/\w+|print|halt|vector")  # fixes that may refer to them
LOOP = re.compile(r"^Loop time of (\S+) on \d+ procs for (\d+) steps with (\d+) atoms", re.M)
LOAD = re.compile(r"^([\d.]+)% CPU use", re.M)  # of the processor in a loop: less than 100 beside other programs
MINIMIZED = "Minimization stats:"  # stands behind the loop time of a minimization
LARGEST = 1e9  # [bytes] of a folder that is copied
PARTS = "Pair", "Neigh", "Comm", "Output", "Modify"  # of LAMMPS' breakdown

Timed = collections.namedtuple("Timed", "seconds steps atoms")


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
            lines += [f"print '{MARK} without {name} {style}'", f'if "$(is_defined(fix,{name}))" then "unfix {name}"', *window]
    return "\n".join([*lines, f"print '{MARK} end'", ""])


def with_includes(path):
    """Text of a script behind those of the files beside it that it includes, and of theirs."""
    text = path.read_text(encoding="utf-8")
    return "".join(with_includes(path.parent / name) for name in re.findall(r"\$\{here\}/([\w.]+)", text)) + text


def script(deck, folder, seconds):
    """Writes in.cost, which runs the other script for a while; its -var options. Files go to the folder."""
    text = deck.read_text(encoding="utf-8")
    (folder / "timings.lmp").write_text(timings(with_includes(deck), max(1.0, 0.2 * seconds)), encoding="utf-8")
    choices = ["-var", "out", str(folder / "out")] if re.search(r"^variable\s+out\s", text, re.M) else []
    last = f"print '{MARK} deck ended'"
    begin = f"timer timeout {seconds} every 10"
    if "${also}" in text and not re.search(r"^run\s", text, re.M):  # minimizations, which a timeout would leave half done
        begin = "variable cost_begun timer"
        (folder / "also.lmp").write_text(f'variable cost_now timer\nif "$((v_k>=3)*(v_cost_now-v_cost_begun>{seconds}))" then '
                                         f'"print \'{MARK} cut short\'" "include {folder}/timings.lmp" "quit 0"\n', encoding="utf-8")
        choices += ["-var", "also", str(folder / "also.lmp")]
    (folder / "in.cost").write_text(f"{begin}\ninclude {deck}\n{last}\ntimer timeout off\ninclude {folder}/timings.lmp\n", encoding="utf-8")
    return choices


def copied(folder):
    """A copy of the present folder in another."""
    size = sum(path.stat().st_size for path in pathlib.Path.cwd().rglob("*") if path.is_file() and not path.is_symlink())
    if size > LARGEST:
        raise RunError(f"the script writes to the present folder, which has {1e-9 * size:.1f} GB, too much to copy it: run cost.py in a folder with the input of the script alone")
    return shutil.copytree(pathlib.Path.cwd(), folder / "copy", symlinks=True)


def run(options, folder):
    """Output of the run, and the log of the script itself, as texts."""
    deck = options.deck.resolve()
    choices = script(deck, folder, options.seconds)
    command = [*lammps_command(options.ranks), "-in", str(folder / "in.cost"), "-log", str(folder / "log"), *choices, *options.arguments]
    place = pathlib.Path.cwd() if "out" in choices else copied(folder)
    print(f"cost.py: runs {options.deck.name} for about {format_seconds(2 * options.seconds)}", file=sys.stderr, flush=True)
    done = ended(command, place)
    if f"{MARK} end" not in done.stdout:
        failed = lammps_error(done.stdout)
        if not loops(done.stdout):
            raise RunError(f"{options.deck.name} failed (exit {done.returncode}): {failed}")
        print(f"cost.py: no shares, as the script cannot go on after its run is cut short: {failed}", file=sys.stderr, flush=True)
    log = (folder / "log").read_text(encoding="utf-8", errors="replace")
    return done.stdout, log.partition(f"\n{MARK} deck ended")[0]


def loops(text, minimized=False):
    """[Timed] of the runs in a part of the output, or of its minimizations."""
    found = list(LOOP.finditer(text))
    ends = [one.start() for one in found[1:]] + [len(text)]
    return [Timed(float(one[1]), int(one[2]), int(one[3])) for one, end in zip(found, ends) if (MINIMIZED in text[one.end():end]) == minimized]


def steps_asked(deck, log, done):
    """Steps by the lines `run N` and `run N upto` of a log, and words. In a script that loops only up to the run that was cut short: those
    after it begin where it was cut, so that they are not as long as they would be."""
    runs = re.findall(r"^run +([1-9]\d*)\b(.*)$", log, re.M)
    cut = next((k for k, (one, (steps, _)) in enumerate(zip(done, runs), start=1) if one.steps < int(steps)), len(runs))
    whole = cut == len(runs) or not re.search(r"^(next|jump)\s", deck.read_text(encoding="utf-8"), re.M)
    asked = 0
    for steps, words in runs if whole else runs[:cut]:
        asked = max(asked, int(steps)) if " upto" in words else asked + int(steps)
    return asked, "" if whole else f" for the first {cut} of {len(runs)} runs, and the others on top"


def to_come(deck, screen, log, is_cut):
    """What is left, in words, of the part of the output that the deck wrote. is_cut: a script of minimizations was cut short."""
    told = re.findall(r"about (\d+) s left", screen)
    if told and is_cut:
        return f"about {format_seconds(float(told[-1]))} to go, as its last line says"
    if told:
        every = loops(log, True)
        return f"it ended within this time, after {sum(one.steps for one in every)} iterations in {format_seconds(sum(one.seconds for one in every))}"
    done, minimized = loops(screen), sum(one.seconds for one in loops(screen, True))
    steps, (asked, part) = sum(one.steps for one in done), steps_asked(deck, log, [one for one in done if one.steps])
    if not steps:
        raise RunError(f"{deck.name} made no step in this time: give more --seconds")
    each = sum(one.seconds for one in done) / steps
    most = "at most " if re.search(r"^fix\s+\S+\s+\S+\s+halt\s", log, re.M) else ""
    more = f", and {format_seconds(minimized)} of minimization so far" if minimized else ""
    return f"{most}{asked} steps of {1e3 * each:.3g} ms: {most}{format_seconds(asked * each)}{part}{more}"


def shares(parts):
    """Lines: the parts of a step as it is, and what each effect adds. parts: {title: output}."""
    whole = parts["as it is"]
    breakdown = {name: float(share) for name, share in re.findall(r"^(\w+) +\|[^|]+\|[^|]+\|[^|]+\|[^|]+\| *([\d.]+)$", whole, re.M)}
    yield "a step: " + ", ".join(f"{name} {breakdown[name]:.0f} %" for name in PARTS if breakdown.get(name, 0) >= 0.5)
    each = {title: float(LOAD.search(text)[1]) * loops(text)[-1].seconds / loops(text)[-1].steps for title, text in parts.items()}
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


def main(arguments=None):
    parser = command_line(__doc__)
    parser.add_argument("--ranks", type=whole(1), default=1, metavar="N", help="MPI ranks (default: %(default)s)")
    parser.add_argument("--seconds", type=whole(1), default=10, metavar="S",
                        help="for which the script runs, its set-up included (default: %(default)s)")
    parser.add_argument("deck", type=pathlib.Path, metavar="SCRIPT", help="input script of LAMMPS")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, metavar="...", help="options of LAMMPS, such as -var NAME VALUE")
    options = parser.parse_args(arguments)
    with errors_in_one_line("cost.py"), tempfile.TemporaryDirectory(prefix="evp_cost_") as folder:
        screen, log = run(options, pathlib.Path(folder))
        parts = re.split(rf"^{MARK} (.*)\n", screen, flags=re.M)
        parts = {"deck": parts[0], **dict(zip(parts[1::2], parts[2::2]))}
        effects = {title: text for title, text in parts.items() if title == "as it is" or title.startswith("without ")}
        atoms = LOOP.search(screen)[3]
        print(f"{options.deck.name}, {atoms} spheres, {options.ranks} MPI rank{'s' * (options.ranks > 1)}: {to_come(options.deck, parts['deck'], log, 'cut short' in parts)}")
        uncut = parts["deck"].partition("WARNING: Wall time limit")[0]  # what comes after it is of a run that was cut short
        warnings = dict.fromkeys(re.findall("^WARNING: .*", uncut, re.M))
        for line in (*warnings, *(shares(effects) if f"{MARK} end" in screen else ()), *errors(options.deck, screen, int(atoms))):
            print(f"  {line}")


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # of `| head`
    sys.exit(main())
