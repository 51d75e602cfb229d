#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Compares two builds of the plugin: bits of the results, and speed.

    tests/maintain/compare_builds.py --old DIR [--new DIR] [--only CASE,...] [bits | speed]

bits runs decks of this checkout and every effect of tests/lammps/test_matrix.py with both builds, and compares every CSV, dump, data, bond and
thermo table byte by byte; restart files are compared by runs that continue from them, also of the new build from a file of the old one.
speed starts both builds side by side in each round and lets them run a scene in turn, old, new, old, new ..., a tenth of a second
each. It compares the user time in LAMMPS' loop. The ratio new/old of a round is the median of its turns; the output has the median and
the quartiles over the rounds. The result is uncertain where the limit lies between the quartiles: give more --rounds, or use an idle machine.
Exit status: 1 where a file differs or a median exceeds --limit, 2 where a run fails.
EVP_LMP is the lmp of both builds (default: build/lmp of this checkout), which has to take EVP_PLUGIN_DIR.
"""

import argparse
import os
import pathlib
import pty
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
from typing import NamedTuple

import tools_path  # noqa: F401  before evp
import compare_bits
from bench_scenes import ALWAYS, Scene, ours
from evp.progress import Progress
from evp.run import CHECKOUT, RunError, lammps_command

LOOP = re.compile(r"^Loop time of (\S+) on .*?^(\S+)% CPU use with", re.M | re.S)
TURNS = 15  # of each build in a round
MEDIUM, LARGE = 13, 25  # cells of the lattice: 8788 and 62 500 spheres


def speed_scenes():
    """{case: scene}; a turn takes about a tenth of a second on one core."""
    return {
        "pair": ours("pair loop, undamped", MEDIUM, 150),
        "pair_large": ours("pair loop, undamped", LARGE, 20),
        "explicit": ours("damped, explicit", MEDIUM, 150, gamma=0.1),
        "implicit": ours("damped, implicit (fix nve/evp)", MEDIUM, 30, gamma=0.1, move="nve/evp"),
        "energy": ours("fix evp/energy at each step", MEDIUM, 40, more="fix ledger all evp/energy"),
        "packing": ours("neighbor list and packing at each step", MEDIUM, 15, neigh=ALWAYS),
    }


class Case(NamedTuple):
    """A scene, and median and quartiles of the ratios new/old of its rounds."""

    scene: Scene
    median: float
    low: float
    high: float

    def line(self, limit):
        """'ok' or 'slower', and whether that is uncertain."""
        name, ratios = f"{self.scene.name}, N = {self.scene.atoms}", f"{self.median:.3f} ({self.low:.3f} to {self.high:.3f})"
        return f"{name:<50} {ratios:<24} {'slower' if self.median > limit else 'ok'}{', uncertain' * (self.low <= limit <= self.high)}"


class Lammps:
    """An lmp on one rank, with the plugin of a build, that takes commands one after the other.

    RunError where it does not load the plugin, or ends before it should."""

    def __init__(self, build, folder):
        self.words, self.build = lammps_command(), build
        screen, theirs = pty.openpty()  # to a pipe LAMMPS would write nothing before its buffer is full
        self.screen = open(screen, encoding="utf-8", errors="replace")
        try:
            self.process = subprocess.Popen([*self.words, "-log", "none"], cwd=folder, env={**os.environ, "EVP_PLUGIN_DIR": str(build)},
                                            stdin=subprocess.PIPE, stdout=theirs, stderr=theirs, encoding="utf-8")
        finally:
            os.close(theirs)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.screen.close()

    def do(self, commands):
        """What the commands print."""
        text = []
        try:
            self.process.stdin.write(f"{commands}\nprint 'your turn'\n")
            self.process.stdin.flush()
            for line in self.screen:
                if line == "your turn\n":
                    return "".join(text)
                text.append(line)
        except OSError:
            pass  # it ended
        raise RunError(f"{self.words[0]} failed with the plugin of {self.build}. If it did not load it, set EVP_LMP to the wrapper build/lmp of "
                       f"the LAMMPS that both builds are made for. Its output ends with\n{''.join(text)[-1500:]}")

    def time(self, commands):
        """User time of a run, in percent of a second: what LAMMPS calls CPU use, without system time."""
        loop, share = LOOP.search(self.do(commands)).groups()
        return float(loop) * float(share)


def time_round(scene, folder, builds):
    """Ratio new/old of the times in a round."""
    times = {name: [] for name in builds}
    setup, _, _ = scene.deck.rpartition("run ")  # with the run that warms up
    with Lammps(builds["old"], folder) as old, Lammps(builds["new"], folder) as new:
        for lammps in (old, new):
            lammps.do(setup)
        for _ in range(TURNS):
            for name, lammps in (("old", old), ("new", new)):
                times[name].append(lammps.time(f"run {scene.steps}"))
    return statistics.median(b / a for a, b in zip(times["old"], times["new"]))


def run_speed(builds, folder, names, rounds):
    """A Case for each name."""
    scenes = {name: scene for name, scene in speed_scenes().items() if name in names}
    ratios = {name: [] for name in scenes}
    order = [(number, name) for number in range(rounds) for name in scenes]
    with Progress("speed,", len(order)) as bar:
        for number, (k, name) in enumerate(order):
            bar.show(number, f"{scenes[name].name}, N = {scenes[name].atoms}, round {k + 1} of {rounds}")
            ratios[name].append(time_round(scenes[name], folder, builds))
    cases = []
    for name, scene in scenes.items():
        low, middle, high = statistics.quantiles(ratios[name], n=4, method="inclusive") if rounds > 1 else 3 * ratios[name]
        cases.append(Case(scene, middle, low, high))
    return cases


def report_speed(cases, limit):
    """Prints the table; True where no median exceeds the limit."""
    print(f"{'case, new/old: median (quartiles)':<50} {'user time':<24} verdict (limit {limit:g})", *(case.line(limit) for case in cases), sep="\n")
    return all(case.median <= limit for case in cases)


def report_bits(found):
    """Prints a line for each file; True where all are the same."""
    for name, difference in found:
        print(f"same     {name}" if difference is None else f"differs  {name}: {difference}")
    print(f"{len(found)} compared, {sum(difference is not None for _, difference in found)} differ")
    return all(difference is None for _, difference in found)


def check_build(build):
    """RunError with the remedy where there is no plugin in the build folder, or this lmp does not load it."""
    if not (build / "evpplugin.so").is_file():
        raise RunError(f"no evpplugin.so in {build}: give a folder that CMake built in, or run `cmake --build {build}` first")
    with tempfile.TemporaryDirectory() as folder, Lammps(build, folder) as lammps:
        text = lammps.do("pair_style evp/lj")
    if re.findall("^Loaded .*", text, re.M) != [f"Loaded 1 plugins from {build}"]:
        raise RunError(f"{lammps.words[0]} did not load {build}/evpplugin.so alone: set EVP_LMP to the wrapper build/lmp of a build, "
                       f"and unset LAMMPS_PLUGIN_PATH. Its output was\n{text}")


def parse(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = {"bits": list(compare_bits.CASES), "speed": list(speed_scenes())}
    cases = "; ".join(f"{what}: {', '.join(names)}" for what, names in known.items())
    parser.add_argument("what", nargs="?", choices=("bits", "speed"), help="default: both, one after the other")
    parser.add_argument("--old", type=pathlib.Path, required=True, metavar="DIR", help="build folder of the one, with evpplugin.so")
    parser.add_argument("--new", type=pathlib.Path, default=CHECKOUT / "build", metavar="DIR", help="of the other (default: build of this checkout)")
    parser.add_argument("--only", metavar="CASE,...", help=f"these cases alone, of {cases}")
    parser.add_argument("--strain", type=float, default=0.02, help="bits: strain of the pulls (default 0.02, that of the quick start)")
    parser.add_argument("--rounds", type=int, default=7, help="speed: runs of each build and case (default 7)")
    parser.add_argument("--limit", type=float, default=1.03, help="speed: largest ratio new/old that passes (default 1.03)")
    parser.add_argument("--folder", type=pathlib.Path, metavar="DIR", help="bits: keep what the runs write in this new folder "
                        "(default: a temporary one, kept where a file differs or a run fails)")
    options = parser.parse_args(words)
    options.known = {what: names for what, names in known.items() if options.what in (None, what)}
    possible = [name for names in options.known.values() for name in names]
    options.only = options.only.split(",") if options.only else possible
    for name in options.only:
        if name not in possible:
            parser.error(f"unknown case '{name}' of --only; known: {', '.join(possible)}")
    if not 0.0001 <= options.strain <= 0.1 or options.rounds < 1 or not options.limit > 0.0:
        parser.error("--strain must lie between 0.0001 and 0.1, --rounds be 1 at least and --limit positive")
    if options.folder and options.folder.exists():
        parser.error(f"--folder {options.folder} exists already: name a new one")
    return options


def main(words=None):
    options = parse(words)
    old, new = options.old.absolute(), options.new.absolute()
    selected = {what: [name for name in names if name in options.only] for what, names in options.known.items()}
    same, fast = True, True
    try:
        for build in (old, new):
            check_build(build)
        if (old / "evpplugin.so").read_bytes() == (new / "evpplugin.so").read_bytes():
            print("note: the two builds hold the same evpplugin.so")
        if selected.get("bits"):
            folder = options.folder.absolute() if options.folder else pathlib.Path(tempfile.mkdtemp(prefix="compare_builds."))
            compare_bits.run_all(old, new, folder, selected["bits"], options.strain)
            same = report_bits(compare_bits.compare_all(folder))
            if same and not options.folder:
                shutil.rmtree(folder)
            else:
                print(f"files: {folder}")
        if selected.get("speed"):
            with tempfile.TemporaryDirectory() as scratch:
                fast = report_speed(run_speed({"old": old, "new": new}, scratch, selected["speed"], options.rounds), options.limit)
    except (RunError, OSError) as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 2
    return 0 if same and fast else 1


if __name__ == "__main__":
    sys.exit(main())
