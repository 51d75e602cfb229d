# SPDX-License-Identifier: GPL-2.0-only
"""Runs the scenes of doc/studies/bench.py in turn, several rounds, and reads LAMMPS' own times."""

import functools
import pathlib
import re
from typing import NamedTuple
from study import RunError, deck_command, in_turn, lammps_command, output_of


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


def run_scene(scene, folder):
    """The Timing of a scene's last run; RunError with the end of the output where it failed."""
    (folder / "scene.lmp").write_text(scene.deck, encoding="utf-8")
    output = output_of(deck_command("scene.lmp", {}, scene.ranks), folder, f"scene '{scene.name}'")
    if not LOOP.search(output):
        raise RunError(f"scene '{scene.name}' ran no timestep")
    last = output[output.rindex("Per MPI rank memory"):]
    builds = BUILDS.findall(last)
    return Timing(float(LOOP.findall(last)[-1]), {name: float(mean) for name, _, mean in LINE.findall(last)}, int(ATOMS.findall(last)[-1]),
                  int(builds[-1]) if builds else 0, float(MEMORY.findall(last)[-1]) * scene.ranks, float(GHOSTS.findall(last)[-1]), last)


class Bench:
    """Rounds of scenes, with the time left on stderr."""

    def __init__(self, folder, repeats):
        self.folder, self.repeats = pathlib.Path(folder), repeats
        self.words = set(output_of([*lammps_command(), "-h"], folder, "lmp -h").split())  # the names of all styles among them

    def rounds(self, scenes, title):
        """{name: [Timing of each round]} of the scenes whose style this LAMMPS has."""
        held = [scene for scene in scenes if not scene.needs or scene.needs in self.words]
        return in_turn({scene.name: functools.partial(run_scene, scene, self.folder) for scene in held}, self.repeats, title)
