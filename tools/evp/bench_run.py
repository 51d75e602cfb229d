# SPDX-License-Identifier: GPL-2.0-only
"""Runs the scenes of tools/bench.py in turn, several rounds, and reads LAMMPS' own times."""

import os
import pathlib
import re
import statistics
import subprocess
import sys
import time
from typing import NamedTuple

from .run import RunError, format_seconds, lammps_command

LOOP = re.compile(r"^Loop time of (\S+) on", re.M)
LINE = re.compile(r"^(Pair|Bond|Neigh|Comm|Modify) +\| +(\S+) +\| +(\S+)", re.M)  # smallest and mean over the ranks
MEMORY = re.compile(r"^Per MPI rank memory allocation \(min/avg/max\) = \S+ \| (\S+) \|", re.M)
ATOMS = re.compile(r"^Loop time of .* with (\d+) atoms", re.M)
GHOSTS = re.compile(r"^Nghost: +(\S+) ave", re.M)
BUILDS = re.compile(r"^Neighbor list builds = (\d+)", re.M)


class Timing(NamedTuple):
    """One run of a scene [s]; memory [MB], over all ranks, as LAMMPS counts it."""

    loop: float
    parts: dict
    atoms: int
    builds: int
    memory: float
    ghosts: float  # of a rank, in the mean
    output: str


def environment():
    """Of every run: ranks that spin while they wait suffer where cores are shared, and one rank is bound to no core either."""
    return {"OMPI_MCA_mpi_yield_when_idle": "1", "OMPI_MCA_hwloc_base_binding_policy": "none", **os.environ}


def run_scene(scene, folder):
    """The Timing of a scene's last run; RunError with the end of the output where it failed."""
    (folder / "scene.lmp").write_text(scene.deck, encoding="utf-8")
    command = [*lammps_command(scene.ranks), "-in", "scene.lmp", "-log", "none"]
    run = subprocess.run(command, cwd=folder, env=environment(), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                         encoding="utf-8", errors="replace", check=False)
    loops = LOOP.findall(run.stdout)
    if run.returncode or not loops:
        raise RunError(f"scene '{scene.name}' failed (exit {run.returncode}); its output ends with\n{run.stdout[-1500:]}")
    last = run.stdout[run.stdout.rindex("Per MPI rank memory"):]
    parts = {name: float(mean) for name, _, mean in LINE.findall(last)}
    builds = BUILDS.findall(last)
    return Timing(float(loops[-1]), parts, int(ATOMS.findall(last)[-1]), int(builds[-1]) if builds else 0,
                  float(MEMORY.findall(last)[-1]) * scene.ranks, float(GHOSTS.findall(last)[-1]), last)


def held_styles():
    """The words of `lmp -h`, the names of all styles among them."""
    run = subprocess.run([*lammps_command(), "-h"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                         encoding="utf-8", errors="replace", check=False)
    return set(run.stdout.split())


class Bench:
    """Rounds of scenes, with the time left on stderr."""

    def __init__(self, folder, repeats):
        self.folder, self.repeats = pathlib.Path(folder), repeats
        self.styles = held_styles()

    def rounds(self, scenes, title):
        """{name: [Timing of each round]} of the scenes whose style this LAMMPS has, all of them once per round."""
        held = [scene for scene in scenes if not scene.needs or scene.needs in self.styles]
        results, begin, whole = {scene.name: [] for scene in held}, time.monotonic(), self.repeats * len(held)
        for number in range(whole):
            scene = held[number % len(held)]
            results[scene.name].append(run_scene(scene, self.folder))
            left = (time.monotonic() - begin) / (number + 1) * (whole - number - 1)
            print(f"{title} {number + 1}/{whole}, about {format_seconds(left)} left: {scene.name}", file=sys.stderr, flush=True)
        return results


def median(values):
    return statistics.median(values)


def spread(values, form="%.2f"):
    """'median (smallest to largest)'."""
    return f"{form % median(values)} ({form % min(values)} to {form % max(values)})"


def ratios(own, other):
    """own over other, round by round."""
    return [a / b for a, b in zip(own, other)]
