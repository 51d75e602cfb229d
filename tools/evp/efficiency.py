# SPDX-License-Identifier: GPL-2.0-only
"""Efficiency of MPI ranks: a fit to the runs of doc/performance.csv, for its page and for cost.py."""

import csv
import re
from typing import NamedTuple

import numpy as np


class Efficiency(NamedTuple):
    """Of R MPI ranks on N spheres, r of them on each host: 1 / (1 + host (r - 1) + surface (R/N)^(1/3)) with R > 1. The ranks of a host share its memory;
    what a rank sends goes with the surface of its part of the body. most: R of the fit; off: its largest relative error; nothing was measured between hosts."""

    host: float
    surface: float
    most: int
    off: float

    def of(self, spheres, ranks, hosts=1):
        """Speed-up over one rank, per rank."""
        return 1.0 / (1.0 + self.host * (ranks / hosts - 1.0) + self.surface * (ranks / spheres) ** (1.0 / 3.0)) if ranks > 1 else 1.0


def fitted(rows):
    """Efficiency by least squares of its relative error; rows: dicts of the CSV of bench.py, of which those of section ranks count, without other styles."""
    data = []
    for row in rows:
        if row["section"] == "ranks" and "lj/cut" not in row["name"]:
            ranks, spheres, number = int(row["x"]), int(re.search(r"\d+", row["name"])[0]), float(row["value"])
            data.append((ranks, spheres * ranks, number) if row["name"].startswith("weak") else (ranks, spheres, number / ranks))
    ranks, spheres, measured = np.array(data).T
    terms = np.array((ranks - 1.0, (ranks / spheres) ** (1.0 / 3.0))).T
    host, surface = np.linalg.lstsq(terms * measured[:, None], 1.0 - measured, rcond=None)[0]
    off = np.abs(1.0 / (1.0 + terms @ (host, surface)) / measured - 1.0).max()
    return Efficiency(float(host), float(surface), int(ranks.max()), float(off))


def read(path):
    """fitted() of a file."""
    with open(path, newline="", encoding="utf-8") as source:
        return fitted(csv.DictReader(source))
