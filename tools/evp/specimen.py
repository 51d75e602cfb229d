# SPDX-License-Identifier: GPL-2.0-only
"""Reads the data files of a specimen (LAMMPS atom_style sphere) and FILE.body, finds its pairs, measures the strain of its middle."""

import pathlib
import re

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree


class Specimen(NamedTuple):
    """Spheres sorted by ID: ids, types (N,) int; radius, mass (N,); x (N,3); box (3,2) bounds."""

    ids: np.ndarray
    types: np.ndarray
    radius: np.ndarray
    mass: np.ndarray
    x: np.ndarray
    box: np.ndarray


def read_data(path):
    """Specimen from a LAMMPS data file with columns id type diameter density x y z.

    Units are the file's. ValueError if the Atoms section is missing, is of another style, or does
    not hold as many lines as the header says.
    """
    text, box = pathlib.Path(path).read_text(encoding="utf-8").partition("\n")[2], np.zeros((3, 2))  # without the title
    count = re.search(r"^\s*(\d+)\s+atoms\s*(?:#.*)?$", text, re.M)
    atoms = re.search(r"^\s*Atoms[ \t]*(?:#[ \t]*(.*?)[ \t]*)?\n.*\n", text, re.M)
    if not count or not atoms or atoms[1] not in (None, "", "sphere"):
        raise ValueError(f"{path} has no 'Atoms # sphere' section")
    for low, high, axis in re.findall(r"^\s*([-+.\deE]+)\s+([-+.\deE]+)\s+([xyz])lo\s", text, re.M):
        box["xyz".index(axis)] = float(low), float(high)
    count = int(count[1])
    table = np.array([line.split()[:7] for line in text[atoms.end() :].splitlines()[:count]], dtype=float)
    if table.shape != (count, 7) or (not text.endswith("\n") and len(text[atoms.end() :].splitlines()) == count):  # cut within the last number
        raise ValueError(f"{path}: the Atoms section does not hold the {count} atoms of the header, the last line with its end: the file was cut off")
    table = table[np.argsort(table[:, 0])]
    radius = 0.5 * table[:, 2]
    mass = table[:, 3] * 4.0 / 3.0 * np.pi * radius**3
    ids, types = table[:, 0].astype(int), table[:, 1].astype(int)
    return Specimen(ids, types, radius, mass, table[:, 4:7], box)


def read_body(path):
    """{name: value} of FILE.body beside a data file, SI. ValueError where there is none, or it has no length or volume."""
    beside = pathlib.Path(f"{path}.body")
    remedy = "make the body by in.specimen or tools/body.py, which write both"
    if not beside.is_file():
        raise ValueError(f"there is no file {beside}; {remedy}")
    text = beside.read_text(encoding="utf-8")
    text = text[: text.rfind("\n") + 1]  # a line without an end was cut off
    found = {name: float(value) for name, value in re.findall(r"^variable\s+(\w+)\s+(?:index|equal)\s+([-+.\deE]+)", text, re.M)}
    if not min(found.get("length", 0.0), found.get("volume", 0.0)) > 0.0:
        raise ValueError(f"{beside} gives no length or no volume of the body: {remedy}")
    return found


def middle_strains(specimen, x, length=0.05):
    """Axial and mean lateral strain of the middle of a specimen that has gone to positions x (N,3), by ID.

    Displacements of the spheres that started between 0.3 and 0.7 of the length over their starting positions, by straight lines.
    """
    inside = (specimen.x[:, 0] > 0.3 * length) & (specimen.x[:, 0] < 0.7 * length)
    strains = [np.polyfit(specimen.x[inside, axis], (x - specimen.x)[inside, axis], 1)[0] for axis in range(3)]
    return strains[0], 0.5 * (strains[1] + strains[2])


def bond_lengths(specimen, alpha, periodic=False):
    """Distances (B,) of the pairs that a row with this alpha bonds; periodic: on all sides of the box."""
    pairs, ratio = pairs_within(specimen, alpha, periodic)
    return ratio * specimen.radius[pairs].sum(axis=1)


def pairs_within(specimen, reach, periodic=False):
    """Pairs (P,2) of 0-based indices with d <= reach (R_i + R_j), and their d/(R_i + R_j)."""
    size = np.ptp(specimen.box, axis=1) if periodic else None
    x = (specimen.x - specimen.box[:, 0]) % size if periodic else specimen.x
    pairs = cKDTree(x, boxsize=size).query_pairs(2.0 * reach * specimen.radius.max(), output_type="ndarray")
    i, j = pairs.T
    apart = x[i] - x[j]
    distance = np.linalg.norm(apart - size * np.round(apart / size) if periodic else apart, axis=1)
    ratio = distance / (specimen.radius[i] + specimen.radius[j])
    near = ratio <= reach
    return pairs[near], ratio[near]
