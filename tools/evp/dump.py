# SPDX-License-Identifier: GPL-2.0-only
"""Reads text dumps of atoms (dump custom, write_dump), a snapshot at a time; and data files of atom_style sphere, as one snapshot.

index() goes through whole files before anything is taken from them, so that a damaged file is noticed before a tool writes. What columns are
called in pictures, and in which unit (SI), stands at the end.
"""

import mmap
import pathlib
import re
from typing import NamedTuple, Optional, Tuple

import numpy as np

from . import specimen

_ATOMS = re.compile(rb"^\s*\d+\s+atoms\b", re.M)  # in the head of a data file
_COLUMNS = re.compile(rb"^ITEM: ATOMS(.*)\n", re.M)  # last line of the header of a snapshot
_ITEM = re.compile(rb"^ITEM: (TIMESTEP|NUMBER OF ATOMS|TIME|UNITS)\s+(\S+)", re.M)


class Snapshot(NamedTuple):
    """Where a snapshot is, and what its header says; read() gets its columns."""

    path: pathlib.Path
    step: Optional[int]  # a data file has none
    time: Optional[float]  # where the dump has it (dump_modify time yes)
    units: Optional[str]  # likewise (dump_modify units yes)
    count: int
    names: Tuple[str, ...]
    start: int  # byte of the first row
    end: int

    def __str__(self):
        return str(self.path) if self.step is None else f"{self.path}, step {self.step}"

    def common(self, name):
        """The value of a column that is the same for all atoms, such as the strain of the body; None of any other."""
        values = self.read().get(name) if name in self.names else None
        return float(values[0]) if values is not None and len(values) and np.all(values == values[0]) else None

    def read(self):
        """{name: (N,) array} in the order of the IDs; columns of words are left out."""
        if self.step is None:
            body = specimen.read_data(self.path)
            return dict(zip(self.names, (body.ids, body.types, *body.x.T, body.radius)))
        with open(self.path, "rb") as source:
            source.seek(self.start)
            words = source.read(self.end - self.start).split()
        if len(words) != self.count * len(self.names):
            raise ValueError(f"{self}: a row has not {len(self.names)} words, as many as columns are named")
        table = np.array(words).reshape(self.count, len(self.names)).T
        columns = {}
        for name, column in zip(self.names, table):
            try:
                columns[name] = column.astype(float)
            except ValueError:
                pass
        if "id" in columns:
            order = np.argsort(columns["id"], kind="stable")
            columns = {name: column[order] for name, column in columns.items()}
        return columns


def _snapshots(path, content):
    """All snapshots of the bytes of a file, None last where it ends in the middle of one."""
    units, end = None, 0  # LAMMPS writes the units once
    while end < len(content):
        line = content[end : end + 40].partition(b"\n")[0]
        if not line.startswith(b"ITEM:"):
            raise ValueError(f"{path} is no dump of LAMMPS: '{line.decode(errors='replace').strip()}' is in the place of an ITEM: line")
        columns = _COLUMNS.search(content, end)
        if columns is None:
            yield None
            return
        header = dict(_ITEM.findall(content[end : columns.start()]))
        try:
            step, count = int(header[b"TIMESTEP"]), int(header[b"NUMBER OF ATOMS"])
            time = float(header[b"TIME"]) if b"TIME" in header else None
            units = header[b"UNITS"].decode() if b"UNITS" in header else units
        except (KeyError, ValueError) as error:
            raise ValueError(f"{path} is no dump of LAMMPS: the header of a snapshot lacks TIMESTEP, NUMBER OF ATOMS or their values") from error
        start, next_item = columns.end(), content.find(b"\nITEM:", columns.end() - 1) + 1
        rows = content[start : next_item or len(content)].splitlines(keepends=True)[:count]
        if len(rows) < count or (rows and not rows[-1].endswith(b"\n")):
            yield None
            return
        end = start + sum(map(len, rows))
        yield Snapshot(pathlib.Path(path), step, time, units, count, tuple(columns[1].decode(errors="replace").split()), start, end)


def index(paths, unfinished=False):
    """All snapshots of the files, in their order. unfinished: a file may end in the middle of a snapshot, which is left out.

    ValueError where a file is neither a dump of atoms nor a data file, is empty or damaged; OSError where one cannot be read.
    """
    found = []
    for path in paths:
        with open(path, "rb") as source:
            begin = source.read(4096)
            if not begin:
                raise ValueError(f"{path} is empty: no snapshot has been written")
            if b"\0" not in begin and _ATOMS.search(begin):
                count = len(specimen.read_data(path).ids)
                found.append(Snapshot(pathlib.Path(path), None, None, None, count, ("id", "type", "x", "y", "z", "radius"), 0, 0))
                continue
            if b"\0" in begin or not begin.startswith(b"ITEM:"):
                raise ValueError(f"{path} is no text dump of LAMMPS: its first line is not 'ITEM: ...'")
            if b"\nITEM: NUMBER OF ENTRIES" in begin:
                raise ValueError(f"{path} is a dump of pairs (dump local), not of atoms")
            with mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ) as content:
                own = list(_snapshots(path, content))
        if own[-1] is None:
            own.pop()
            if not own or not unfinished:
                where = f"in the middle of a snapshot, after that of step {own[-1].step}" if own else "before its first whole snapshot"
                remedy = "; --unfinished takes the whole snapshots before that" if own else ""
                raise ValueError(f"{path} ends {where}: the run was stopped or is not done{remedy}")
        found += own
    return found


def need(columns, wanted, where):
    """ValueError where a column is missing: it names those that there are, and how that one gets into a dump."""
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise ValueError(f"{where} has no column {missing[0]}; it has {' '.join(columns)}{how_to_write(missing[0])}")


def last_positions(path):
    """Positions (N,3) by ID of the last snapshot of a dump, as the decks write it at their end."""
    snapshot = index([path])[-1]
    columns = snapshot.read()
    need(columns, ("id", "x", "y", "z"), snapshot)
    return np.stack([columns[axis] for axis in "xyz"], axis=1)


class Column(NamedTuple):
    """text: as it stands in a picture; value of the column times factor is in unit."""

    text: str
    unit: str = ""
    factor: float = 1.0

    def label(self):
        return f"{self.text} [{self.unit}]" if self.unit else self.text


KNOWN = {
    "bonds": Column("bonds of each sphere"),
    "share_second": Column("bonds in the second regime", "% of each sphere's", 100.0),
    "share_lost": Column("bonds lost", "% of each sphere's", 100.0),
    "new_pairs": Column("new pairs of each sphere"),
    "plastic_work": Column("plastic work of each sphere", "J"),
    "plastic_strain": Column("equivalent plastic strain", "%", 100.0),
    "latent_heat": Column("latent heat of each sphere", "J"),
    "limit_factor": Column("factor of the elastic limit"),
    "strain_rate": Column("plastic strain rate", "1/s"),
    "thermal_growth": Column("thermal growth of lengths"),
    "volume_strain": Column("volume strain", "%", 100.0),
    "omega": Column("share of the strain at failure"),
    "damage": Column("damage"),
    "von_mises": Column("von Mises stress", "MPa", 1e-6),
    "triaxiality": Column("triaxiality"),
    "temperature": Column("temperature", "K"),
    "strain": Column("strain", "%", 100.0),
    "angle": Column("angle", "rad"),
    "radius": Column("radius", "mm", 1e3),
    "diameter": Column("diameter", "mm", 1e3),
    **{name: Column(name, "mm", 1e3) for name in ("x", "y", "z", "xu", "yu", "zu")},
    **{name: Column(name, "m/s") for name in ("vx", "vy", "vz")},
    **{name: Column(name, "N") for name in ("fx", "fy", "fz")},
}
LOADS = ("strain", "angle")  # of a whole body, in a dump the same for all its atoms
# Values of compute evp/state/atom where they are asked for; von_mises comes with fraction.
ON_REQUEST = {name: name for name in ("plastic_work", "plastic_strain", "latent_heat", "limit_factor", "strain_rate", "thermal_growth", "volume_strain", "triaxiality", "omega", "damage")}
ON_REQUEST["von_mises"] = "von_mises fraction PHI"
STATE = ("bonds", "share_second", "share_lost", "new_pairs")  # its first four


def how_to_write(name):
    """What an input script needs for a value of compute evp/state/atom in a dump, as a sentence; empty for any other name."""
    if name not in (*STATE, *ON_REQUEST):
        return ""
    value, place = ON_REQUEST.get(name, ""), STATE.index(name) + 1 if name in STATE else len(STATE) + 1
    compute = f"compute state all evp/state/atom {value}".rstrip()
    return (f"; to write it: '{compute}', c_state[{place}] among the columns of the dump command, and "
            f"'dump_modify ID colname c_state[{place}] {name}'" + (", with fix evp/volume" if name == "volume_strain" else ""))


def load_text(name, value):
    """A load as a title: strain 2 %."""
    column = KNOWN[name]
    return f"{column.text} {round(column.factor * value, 5) + 0.0:.3g} {column.unit}"


def described(name, units="si"):
    """Column of a word. In units other than SI all but shares and counts are as they stand, without a unit."""
    column = KNOWN.get(name, Column(name))
    return column if units == "si" or column.unit.startswith("%") else Column(column.text)
