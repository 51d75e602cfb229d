#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""CalculiX for parts.py: meshes, cards of the input file, runs, and tables of the .dat file. Units: mm, N, MPa.

The metals are those of doc/studies/metals.py.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

sys.path.insert(1, str(pathlib.Path(__file__).resolve().parents[1]))

from metals import METALS, MPA  # noqa: E402
import numpy as np  # noqa: E402

PLASTIC = np.concatenate([[1e-5], np.geomspace(1e-4, 4.0, 70)])  # plastic strains of the table of the flow curve
WAIT = 60.0  # between lines of progress of a run [s]


class Failed(Exception):
    """A run that did not reach its end, or no CalculiX."""


# ---- materials and contact ----

def flow(metal, plastic):
    """True stress [MPa] of a metal at plastic strains."""
    a, b, n = METALS[metal].law
    return (a + b * np.asarray(plastic, float)**n) / MPA


def metal_line(metal):
    """The constants of a metal, for the header of a CSV."""
    a, b, n = METALS[metal].law
    return (f"E {METALS[metal].modulus / MPA:g} MPa, nu {METALS[metal].poisson:g}, true stress [MPa] {a / MPA:g} + "
            f"{b / MPA:g} p^{n:g} of plastic strain p, von Mises, isotropic; {len(PLASTIC)} points of p from "
            f"{PLASTIC[0]:g} to {PLASTIC[-1]:g} in the input")


def material(metal):
    """Lines of the materials METAL and TOOL. The table begins at p = 0 with the stress of PLASTIC[0]."""
    rows = [f"{s:.8g}, {p:.8g}" for s, p in zip(flow(metal, PLASTIC), [0.0, *PLASTIC[1:]])]
    return ["*MATERIAL, NAME=METAL", "*ELASTIC", f"{METALS[metal].modulus / MPA:.8g}, {METALS[metal].poisson:g}",
            "*PLASTIC", *rows, "*SOLID SECTION, ELSET=BODY, MATERIAL=METAL"]


def tool():
    """Lines of the material of tools whose nodes are all prescribed."""
    return ["*MATERIAL, NAME=TOOL", "*ELASTIC", "2e6, 0.3", "*SOLID SECTION, ELSET=TOOLS, MATERIAL=TOOL"]


def contact(pairs, stiffness, friction=0.0, slope=0.0):
    """Lines of the contact of (surface of the body, surface of a tool) pairs; stiffness and slope [MPa/mm]."""
    lines = ["*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{stiffness:g}"]
    lines += ["*FRICTION", f"{friction:g}, {slope:g}"] if friction else []
    for body, tools in pairs:
        lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", f"{body}, {tools}"]
    return lines


def step(increments, boundary, prints, every=1, first=1.0, without=()):
    """Lines of a static step of equal increments, the first one a share of the others.

    boundary: lines of *BOUNDARY; prints: (set, 'RF', 'U', 'PEEQ' or 'EVOL') pairs, of which RF is the sum;
    without: pairs of surfaces whose contact ends.
    """
    wanted = []
    for name, what in prints:
        if what in ("RF", "U"):
            wanted += [f"*NODE PRINT, NSET={name}{', TOTALS=ONLY' * (what == 'RF')}, FREQUENCY={every}", what]
        else:
            wanted += [f"*EL PRINT, ELSET={name}, FREQUENCY={every}", what]
    size = 1.0 / increments
    ends = [line for pair in without for line in ("*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE", ", ".join(pair))]
    return ["*STEP, NLGEOM, INC=4000", "*STATIC", f"{first * size:.9g}, 1, 1e-7, {size:.9g}",
            *ends, "*BOUNDARY", *boundary, *wanted, "*END STEP"]


# ---- meshes ----

def middles(x):
    """Numbers (n,) and their middles in order, (2 n - 1,)."""
    out = np.empty(2 * len(x) - 1)
    out[::2], out[1::2] = x, 0.5 * (np.asarray(x)[1:] + np.asarray(x)[:-1])
    return out


def graded(to, size, ratio, near=0.0):
    """Numbers from 0 to `to`: steps of size until near, then steps that grow by ratio."""
    even = np.linspace(0.0, near, round(near / size) + 1)
    steps = size * ratio ** np.arange(1, 1000)
    far = np.cumsum(steps)[:int(np.argmax(np.cumsum(steps) >= to - near)) + 1]
    return np.concatenate([even, near + far * (to - near) / far[-1]])


class Mesh:
    """Nodes and elements with sets, as lines of the input. Elements are quadratic: grids of points hold corners and
    middles of edges, and points elsewhere, which are left out."""

    def __init__(self):
        self.nodes, self.lines, self.elements = [], [], 0
        self.places = {}

    def _add(self, points, joined):
        """Numbers of the nodes of a grid of points (..., dimensions), 0 where there is none; joined: nodes of other
        joined grids are taken where there are any."""
        odd = sum(np.ix_(*(np.arange(k) % 2 for k in points.shape[:-1])))
        numbers = np.zeros(points.shape[:-1], int)
        for index in np.argwhere(odd <= 1):
            point = points[tuple(index)]
            key = tuple(np.round(point, 6)) if joined else len(self.nodes)
            if key not in self.places:
                self.nodes.append(point)
                self.places[key] = len(self.nodes)
            numbers[tuple(index)] = self.places[key]
        return numbers

    def _elements(self, name, kind, grid, places):
        """Numbers of elements, an array; places: of the nodes of an element on the grid."""
        shape = tuple((k - 1) // 2 for k in grid.shape)
        rows = np.stack([grid[tuple(slice(a, a + 2 * k - 1, 2) for a, k in zip(place, shape))] for place in places], -1)
        numbers = np.arange(self.elements + 1, self.elements + 1 + np.prod(shape))
        self.lines.append(f"*ELEMENT, TYPE={kind}, ELSET={name}")
        for number, row in zip(numbers, rows.reshape(len(numbers), -1)):
            words = [str(n) for n in (number, *row)]
            self.lines.append(",\n".join(", ".join(words[k:k + 10]) for k in range(0, len(words), 10)))
        self.elements += len(numbers)
        return numbers.reshape(shape)

    def quads(self, name, points):
        """CAX8R of points (2 nx + 1, 2 ny + 1, 2), from x to y counter-clockwise: nodes, elements (nx, ny).

        Faces: S1 y low, S2 x high, S3 y high, S4 x low."""
        grid = self._add(points, joined=False)
        places = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        return grid, self._elements(name, "CAX8R", grid, places)

    def bricks(self, name, points, joined=False):
        """C3D20R of points (2 nx + 1, 2 ny + 1, 2 nz + 1, 3): nodes, elements (nx, ny, nz).

        Faces: S1 z low, S2 z high, S3 y low, S4 x high, S5 y high, S6 x low."""
        grid = self._add(points, joined)
        flat = [(0, 0), (2, 0), (2, 2), (0, 2)]
        edges = [(1, 0), (2, 1), (1, 2), (0, 1)]
        places = [(*p, z) for among in (flat, edges) for z in (0, 2) for p in among] + [(*p, 1) for p in flat]
        return grid, self._elements(name, "C3D20R", grid, places)

    def nset(self, name, nodes):
        """A set of nodes, of an array of numbers with 0 where there is none; returns the numbers, sorted."""
        nodes = np.unique(nodes)[np.unique(nodes) > 0]
        self.lines.append(f"*NSET, NSET={name}")
        self.lines.extend(", ".join(map(str, nodes[k:k + 12])) for k in range(0, len(nodes), 12))
        return nodes

    def surface(self, name, *faces):
        """A surface, of (elements, 'S3') pairs."""
        self.lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
        self.lines.extend(f"{e}, {face}" for elements, face in faces for e in np.ravel(elements))

    def at(self, nodes):
        """Positions (n, dimensions) of nodes at the start."""
        return np.array([self.nodes[n - 1] for n in nodes])

    def cards(self):
        """All lines."""
        rows = ["*NODE, NSET=ALL"]
        rows += [f"{k}, " + ", ".join(f"{x:.9g}" for x in (*p, *[0.0] * (3 - len(p))))
                 for k, p in enumerate(self.nodes, 1)]
        return rows + self.lines


# ---- runs ----

def version():
    """'CalculiX 2.20', of the ccx that is installed."""
    if shutil.which("ccx") is None:
        raise Failed("there is no ccx, the solver of CalculiX: install it (Debian: apt-get install calculix-ccx), "
                     "or put the folder that has it into PATH")
    text = subprocess.run(["ccx", "-v"], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False).stdout
    found = re.search(r"Version (\S+)", text)
    return f"CalculiX {found[1] if found else 'of unknown version'}"


def time_reached(path):
    """Of all steps, each of which takes a time of 1, by a .sta file, which may not be there or end in half a line."""
    lines = path.read_text().splitlines()[2:] if path.exists() else []
    rows = [line.split() for line in lines]
    return max((float(row[4]) for row in rows if len(row) == 7), default=0.0)


def run(work, name, lines):
    """Runs ccx on the lines of an input in the folder work, and returns the tables of the .dat file.

    A run that work has already is not repeated. Failed where it does not reach its end."""
    text, deck, log = "\n".join([*lines, ""]), work / f"{name}.inp", work / f"{name}.out"
    if not (deck.exists() and deck.read_text() == text and log.exists() and "Job finished" in log.read_text()):
        deck.write_text(text)
        begun, wanted = time.monotonic(), sum(line.startswith("*STATIC") for line in text.splitlines())
        print(f"{name}: starts", flush=True)
        with open(log, "w", encoding="utf-8") as out:
            with subprocess.Popen(["ccx", "-i", name], cwd=work, stdin=subprocess.DEVNULL, stdout=out,
                                  stderr=subprocess.STDOUT, env={"OMP_NUM_THREADS": "1", **os.environ}) as child:
                while True:
                    try:
                        child.wait(WAIT)
                        break
                    except subprocess.TimeoutExpired:
                        print(f"{name}: {time_reached(work / f'{name}.sta'):.3f} of {wanted} steps, "
                              f"{time.monotonic() - begun:.0f} s", flush=True)
                    except BaseException:
                        child.kill()
                        raise
        if "Job finished" not in log.read_text():
            raise Failed(f"{name}: CalculiX stopped; {log} ends with\n{log.read_text()[-600:]}")
        print(f"{name}: finished in {time.monotonic() - begun:.0f} s", flush=True)
    return tables(work / f"{name}.dat")


def tables(path):
    """{(quantity, set): (times (n,), values (n, rows, columns))} of a .dat file. Times are of all steps together;
    rows are nodes or integration points, whose numbers are left out."""
    found, rows = {}, None
    names = {"displacements": "U", "total force": "RF", "equivalent plastic strain": "PEEQ", "volume": "EVOL"}
    for line in path.read_text().splitlines():
        head = re.match(r"\s*(.*?)\s*(?:\(.*)?for set (\S+) and time\s+(\S+)", line)
        if head:
            what = head[1].split("(")[0].strip()
            rows = []
            found.setdefault((names.get(what, what), head[2]), []).append((float(head[3]), rows))
        elif line.strip() and rows is not None:
            rows.append([float(word) for word in line.split()])
    left_out = {"U": 1, "PEEQ": 2, "EVOL": 1}
    return {key: (np.array([when for when, _ in each]),
                  np.array([rows for _, rows in each])[:, :, left_out.get(key[0], 0):]) for key, each in found.items()}
