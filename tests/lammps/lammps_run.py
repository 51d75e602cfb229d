# SPDX-License-Identifier: GPL-2.0-only
"""Starts LAMMPS for the tests, and reads what it wrote."""

import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
from typing import NamedTuple

import numpy as np
import pytest
from evp.run import ended_well

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
DECKS = REPOSITORY / "lammps_inputs"
REFERENCE = REPOSITORY / "tests" / "data" / "reference_500" / "specimen_500.data"  # the paper's specimen
LMP = pathlib.Path(os.environ.get("EVP_LMP", REPOSITORY / "build" / "lmp")).absolute()
MPIRUN = shlex.split(os.environ.get("EVP_MPIRUN", "mpirun --oversubscribe --bind-to none"))
WITHOUT = os.environ.get("EVP_WITHOUT", "").split()  # words of an effect that the plugin lacks: tests/maintain/without.py
named = []  # scripts of this test that have one of them
SECONDS = 150  # far above what any run here takes: only a hang gets there

_ENVIRONMENT = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
    "OMPI_MCA_pml": "ob1",  # ranks of one machine: a start looks for no network
    "OMPI_MCA_ess_singleton_isolated": "1",  # without mpirun: no daemon, which takes longer to start than LAMMPS
    "OMPI_MCA_mpi_yield_when_idle": "1",  # more ranks than cores: who waits makes room
    "OMP_NUM_THREADS": "1",
}


def edited_deck(name, folder, old, new):
    """The path of a copy of a deck, with the files that decks include, in a folder, each `old` replaced; there must be one."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in (DECKS / name, *DECKS.glob("*.lmp"))}
    assert any(old in text for text in texts.values()), f"{name} holds no {old}"
    for file, text in texts.items():
        (folder / file).write_text(text.replace(old, new), encoding="utf-8")
    return folder / name


class Snapshot(NamedTuple):
    """One step of a dump: columns by name, sorted by ID (by row where there is no ID)."""

    step: int
    box: np.ndarray  # (3, 2) bounds
    columns: dict

    def __getitem__(self, name):
        return self.columns[name]

    def vectors(self, *names):
        """(N, k) array of the named columns."""
        return np.stack([self.columns[name] for name in names], axis=1)

    x = property(lambda self: self.vectors("x", "y", "z"))
    v = property(lambda self: self.vectors("vx", "vy", "vz"))
    f = property(lambda self: self.vectors("fx", "fy", "fz"))


class Run(NamedTuple):
    """What a LAMMPS process left: stdout holds stderr too."""

    returncode: int
    stdout: str
    folder: pathlib.Path

    def ok(self):
        """Self, or an assertion error with the end of the output where LAMMPS failed."""
        assert self.returncode == 0, f"exit {self.returncode}\n" + "\n".join(self.stdout.splitlines()[-25:])
        return self

    def thermo(self, block=-1):
        """The thermo table of one run as {column: array}; block counts the runs."""
        return thermo_blocks(self.stdout)[block]

    def dump(self, name):
        """All snapshots of a dump file in the run's folder."""
        return read_dump(self.folder / name)

    def made_no_step(self):
        """True where no thermo table has a line after step 0."""
        in_table, steps = False, [0]
        for line in self.stdout.splitlines():
            words = line.split()
            if words[:1] == ["Step"] or line.startswith("Loop time"):
                in_table = words[0] == "Step"
            elif in_table and words and words[0].isdigit():
                steps.append(int(words[0]))
        return max(steps) == 0

    def warnings(self):
        """But those of newer LAMMPS about plugins that it loads again after `clear`."""
        return [line for line in self.stdout.splitlines() if re.match(r"WARNING(?!: Overriding built-in \w+ style \S+ from plugin)", line)]


def note_names(script, output):
    """Keeps a script with a word of the effect that the plugin lacks, or whose run asked for it."""
    if any(word in script or f"style '{word}'" in output for word in WITHOUT):
        named.append(script)


def start_lammps(path, ranks=1, variables=None, cwd=None, flags=(), stdout=subprocess.DEVNULL):
    """The process of a deck (path, or name in lammps_inputs), in folder cwd, in a process group of its own."""
    path = DECKS / path
    command = [*MPIRUN, "-np", str(ranks)] if ranks > 1 else []
    command += [str(LMP), "-log", "none", *flags, "-in", str(path)]
    for key, value in (variables or {}).items():
        command += ["-var", key, *(map(str, value) if isinstance(value, (list, tuple)) else [str(value)])]
    return subprocess.Popen(
        command, cwd=cwd, env={**os.environ, **_ENVIRONMENT}, stdin=subprocess.DEVNULL,
        stdout=stdout, stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True)


def run_lammps(deck, ranks=1, variables=None, cwd=None, seconds=SECONDS, flags=()):
    """Run a deck (path, or name in lammps_inputs) or the text of one (more than one line), in folder cwd."""
    cwd = pathlib.Path(cwd)
    path = deck
    if "\n" in str(deck):
        path = cwd / "in.lmp"
        path.write_text(str(deck), encoding="utf-8")
    process = start_lammps(path, ranks, variables, cwd, flags, subprocess.PIPE)
    try:
        output, _ = process.communicate(timeout=seconds)
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        raise
    note_names(str(deck), output)
    return Run(0 if ended_well(process.returncode, output) else process.returncode, output, cwd)


def packed(file, **choices):
    """A fixture: the file of a body of in.specimen, made once per module."""
    @pytest.fixture(scope="module")
    def body(tmp_path_factory):
        folder = tmp_path_factory.mktemp("packed")
        run_lammps("in.specimen", 1, {**choices, "out": file}, folder).ok()
        return folder / file

    return body


def run_decks(decks, ranks=1, cwd=None, prefix="deck"):
    """{name: Run} of {name: text of a deck}, one after the other in one process, which must end well. Each runs in a folder
    of its own, named by prefix and number, which holds the files that are in cwd now. Starts of LAMMPS take longer than most runs here."""
    cwd, mark = pathlib.Path(cwd), "---- next deck"
    files, folders, text = [path for path in cwd.iterdir() if path.is_file()], {}, ""
    for number, (name, deck) in enumerate(decks.items()):
        folders[name] = cwd / f"{prefix}{number}"
        folders[name].mkdir(exist_ok=True)
        for path in files:
            shutil.copy(path, folders[name])
        text += f'print "{mark}"\nshell cd {folders[name]}\n{deck}\nclear\n'
    parts = run_lammps(text, ranks, None, cwd).ok().stdout.split(f"{mark}\n")[1:]
    assert len(parts) == len(decks)
    return {name: Run(0, part, folders[name]) for name, part in zip(decks, parts)}


def thermo_blocks(text):
    """The thermo tables of all runs in LAMMPS' output, as {column: array}."""
    blocks, names, rows = [], None, []
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["Step"]:
            names, rows = words, []
        elif line.startswith("Loop time") and names:
            blocks.append(dict(zip(names, np.array(rows, dtype=float).T)))
            names = None
        elif names and len(words) == len(names):
            try:
                rows.append([float(word) for word in words])
            except ValueError:
                pass  # a warning between the rows
    return blocks


def read_dump(path):
    """Snapshots of a text dump (custom or local)."""
    lines = iter(pathlib.Path(path).read_text(encoding="utf-8").splitlines())
    snapshots, step, count, box = [], 0, 0, None
    for line in lines:
        if line == "ITEM: TIMESTEP":
            step = int(next(lines))
        elif line.startswith("ITEM: NUMBER OF"):
            count = int(next(lines))
        elif line.startswith("ITEM: BOX BOUNDS"):
            box = np.array([next(lines).split()[:2] for _ in range(3)], dtype=float)
        elif line.startswith(("ITEM: ATOMS", "ITEM: ENTRIES")):
            names = line.split()[2:]
            table = np.array([next(lines).split() for _ in range(count)], dtype=float).reshape(count, len(names))
            if "id" in names:
                table = table[np.argsort(table[:, names.index("id")], kind="stable")]
            snapshots.append(Snapshot(step, box, dict(zip(names, table.T))))
    return snapshots


def write_state(path, x, v, box, ids=None):
    """Positions and velocities as a dump that read_dump takes without loss of a digit."""
    ids = np.arange(1, len(x) + 1) if ids is None else ids
    lines = ["ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS", str(len(x)), "ITEM: BOX BOUNDS ff ff ff", *(f"{low:.17g} {high:.17g}" for low, high in box),
             "ITEM: ATOMS id x y z vx vy vz", *(" ".join([str(i), *(f"{value:.17g}" for value in (*a, *b))]) for i, a, b in zip(ids, x, v))]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_data(path, x, radius, box, types=None, density=2700.0):
    """A data file of atom_style sphere, SI, IDs 1..N."""
    types = np.ones(len(x), dtype=int) if types is None else types
    lines = [f"# spheres\n\n{len(x)} atoms\n{max(types)} atom types\n", *(f"{low:.17g} {high:.17g} {axis}lo {axis}hi" for axis, (low, high) in zip("xyz", box)),
             "\nAtoms # sphere\n", *(" ".join([f"{i} {kind}", *(f"{value:.17g}" for value in (2.0 * r, density, *place))])
                                     for i, (kind, r, place) in enumerate(zip(types, radius, x), start=1))]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_csv(path):
    """A CSV file with one header line as {column: array}."""
    lines = pathlib.Path(path).read_text(encoding="utf-8").splitlines()
    table = np.array([line.split(",") for line in lines[1:]], dtype=float)
    return dict(zip(lines[0].lstrip("# ").split(","), table.T))


def slope(x, y):
    """Slope of the least-squares line through the points."""
    return float(np.polyfit(x, y, 1)[0])


def line_at(x, y, at, half_width):
    """Value at `at` of the least-squares line through the points within half_width of it."""
    near = np.abs(x - at) <= half_width * (1.0 + 1e-9)
    return float(np.polyval(np.polyfit(x[near] - at, y[near], 1), 0.0))
