# SPDX-License-Identifier: GPL-2.0-only
"""Small bodies in any box, the lines of decks that set them up and stir them, and their forces by a sum over all pairs and images."""

import itertools
import pathlib
from typing import NamedTuple

import numpy as np
from evp import law
from oracle import brute
from lammps_run import write_data
from scipy.spatial import cKDTree

# Of the sum of |F| over each atom's own pairs (and the like for energy and virial): a few hundred roundings of 1e-16,
# each up to ten times larger since xi = d/deq - 1 subtracts nearly equal numbers.
ROUND_OFF = 1e-12
# Sums in another order (other ranks, other newton): roundings of 1e-16 carried over a hundred steps of some hundred atoms.
ANOTHER_ORDER = 1e-10

SPACING = 0.01  # of the lattice [m]; the largest dlim is 1.5 * 0.011 m
MARGIN = 0.02  # between an open body and its box
DRIFT = 300.0  # [m/s] of the whole body: its atoms change ranks, and boundaries are crossed


class Body(NamedTuple):
    """A body that has been deformed since its bonds were recorded."""

    data: pathlib.Path  # LAMMPS data file of the state at recording
    radius: np.ndarray
    types: np.ndarray
    bonds: dict  # {(id_i, id_j): deq}
    x: np.ndarray  # now
    v: np.ndarray
    box: np.ndarray


def wavy_velocities(x, speed):
    """Velocities by formula, different for neighbors, of about this speed."""
    n = np.arange(1, len(x) + 1)
    return speed * np.stack([np.sin(1.1 * n), np.cos(2.3 * n), np.sin(3.7 * n + 1.0)], axis=1)


def scattered(x, bonds, radius):
    """Some atoms moved next to one that they have no bond with, so that such pairs overlap."""
    moved = x.copy()
    for i in range(10, len(x), 40):
        distance = np.linalg.norm(x - x[i], axis=1) / (radius + radius[i])
        partners = [a + b - i - 2 for a, b in bonds if i + 1 in (a, b)]
        distance[[i, *partners]] = np.inf
        j = int(np.argmin(distance))
        moved[i] = x[j] + 0.95 * (radius[i] + radius[j]) * (x[i] - x[j]) / np.linalg.norm(x[i] - x[j])
    return moved


class Small(NamedTuple):
    """Spheres with IDs 1..N at the recording; cell: rows are the periodic vectors, zero where the box is open."""

    x: np.ndarray
    radius: np.ndarray
    types: np.ndarray
    box: np.ndarray  # (3, 2)
    cell: np.ndarray  # (3, 3)
    bonds: dict


def lattice_body(cells=(8, 4, 4), periodic="", tilt=(0.0, 0.0, 0.0), zone=1.5, seed=2017):
    """A disordered lattice: uniform radii of 4.5 to 5.5 mm, places off by up to 1.2 mm, two types at random."""
    rng = np.random.default_rng(seed)
    grid = np.array(list(itertools.product(*map(range, cells))), dtype=float)
    fractions = (grid + 0.5 + rng.uniform(-0.12, 0.12, grid.shape)) / cells
    length = SPACING * np.array(cells)
    vectors = np.diag(length)
    vectors[1, 0], vectors[2, 0], vectors[2, 1] = tilt
    x = fractions @ vectors
    radius = rng.uniform(0.0045, 0.0055, len(x))
    types = rng.integers(1, 3, len(x))
    is_open = np.array([axis not in periodic for axis in "xyz"])
    box = np.stack([np.where(is_open, -MARGIN, 0.0), length + np.where(is_open, MARGIN, 0.0)], axis=1)
    cell = np.where(is_open[:, None], 0.0, vectors)
    return Small(x, radius, types, box, cell, record(x, radius, zone, cell))


def with_images(x, reach, cell):
    """Places and 0-based owners: the atoms first, then the images that come within reach of one."""
    places, owners = [x], [np.arange(len(x))]
    tree = cKDTree(x)
    steps = [(-1, 0, 1) if np.any(vector) else (0,) for vector in cell]
    for step in itertools.product(*steps):
        if any(step):
            image = x + np.array(step, dtype=float) @ cell
            near = tree.query(image)[0] <= reach
            places.append(image[near])
            owners.append(np.flatnonzero(near))
    return np.concatenate(places), np.concatenate(owners)


def record(x, radius, zone, cell):
    """{(id_i, id_j): deq} of the pairs within the zone, images included."""
    places, owner = with_images(x, 2.0 * zone * radius.max(), cell)
    pairs = brute.find_pairs(places, radius[owner], zone)
    own = (pairs.i < len(x)) | (pairs.j < len(x))
    low, high = np.minimum(owner[pairs.i], owner[pairs.j]) + 1, np.maximum(owner[pairs.i], owner[pairs.j]) + 1
    return dict(zip(zip(low[own].tolist(), high[own].tolist()), pairs.d[own].tolist()))


def truth(x, v, body, rows=law.TABLE1, contact="literal", ids=None, step=0.0, bodies=None):
    """brute.brute_force of a body in its box; "force" and "abs_force" are those of the atoms themselves."""
    widest = max(row.alpha for row in ([rows] if isinstance(rows, law.Row) else rows.values()))
    places, owner = with_images(x, 2.0 * widest * body.radius.max(), body.cell)
    ids = np.arange(1, len(x) + 1) if ids is None else np.asarray(ids)
    found = brute.brute_force(places, v[owner], body.radius[owner], body.types[owner], rows, body.bonds, contact, ids=ids[owner], step=step,
                              bodies=None if bodies is None else bodies[owner])
    return {**found, "force": found["force"][: len(x)], "abs_force": found["abs_force"][: len(x)]}


def check_forces(snapshot, body, rows=law.TABLE1, contact="literal", at_rest=False, bodies=None):
    """The forces of a dump are those of the sum over all pairs; returns that sum.

    at_rest: pairs at d = deq have no force to measure round-off by, so each counts with its yield force at least."""
    ids = snapshot["id"].astype(int)
    found = truth(snapshot.x, snapshot.v, body, rows, contact, ids, bodies=bodies)
    error = np.linalg.norm(snapshot.f - found["force"], axis=1)
    scale = found["abs_force"].copy()
    if at_rest:
        for atoms in (found["i"], found["j"]):
            own = atoms < len(ids)
            np.add.at(scale, atoms[own], (rows.m1 * rows.n1 * rows.e1 * rows.xi_s / found["deq"])[own])
    worst = np.argmax(error / (scale + 1e-300))
    where = f"atom {ids[worst]} at step {snapshot.step}: off by {error[worst]:.3g} of {scale[worst]:.3g}"
    assert error[worst] <= ROUND_OFF * scale[worst], where
    return found


def write_body(path, body, tilt=None):
    write_data(path, body.x, body.radius, body.box, body.types)
    if tilt:
        text = path.read_text(encoding="utf-8")
        words = " ".join(f"{value:.17g}" for value in tilt)
        path.write_text(text.replace("zlo zhi\n", f"zlo zhi\n{words} xy xz yz\n"), encoding="utf-8")


def write_two(path, gap=0.011, radii=(0.005, 0.005)):
    """Spheres 1 and 2 along x, the origin in the middle."""
    write_data(path, np.array([[-0.5 * gap, 0, 0], [0.5 * gap, 0, 0]]), radii, [[-0.2, 0.2]] * 3)


def mass_of(radius):
    """Of spheres as the data files have them."""
    return 2700.0 * 4.0 / 3.0 * np.pi * radius**3


def head(newton="on", boundary="f f f", start="read_data body.data", before="", sort="", style="sphere", skin=0.0008):
    """Up to the atoms."""
    return f"""
units si
atom_style {style}
atom_modify map yes {sort}
newton {newton}
{"" if start.startswith("read_restart") else "boundary " + boundary}
{before}
{start}
neighbor {skin} bin
neigh_modify every 1 delay 0 check yes
"""


def pair(row=law.TABLE1, contact="literal", fix="fix bonds all evp/bonds", more=""):
    """more: behind the row."""
    return f"pair_style evp/lj contact {contact}\npair_coeff * * {words(row)}{more}\n{fix}\n"


def words(row):
    """A row as pair_coeff takes it, to the last bit."""
    return " ".join(f"{value:.17g}" for value in row)


def grips(left, right):
    """Groups left and right of what starts beyond these planes along x, grips of both, and free."""
    return f"""
region left block INF {left} INF INF INF INF
region right block {right} INF INF INF INF INF
group left region left
group right region right
group grips union left right
group free subtract all grips
"""


ENTRIES = ("open", "kinetic", "first", "second", "lost", "contacts", "dissipated", "movers", "others", "plastic", "unused", "ended", "volume", "box")


def energies(table, row=-1):
    """f_energy and its entries by name, of one row of a thermo table; of all rows with None."""
    names = ["f_energy", *(f"f_energy[{k}]" for k in range(1, len(ENTRIES)))]
    return {entry: table[name] if row is None else table[name][row] for entry, name in zip(ENTRIES, names)}


def turn_about(angle):
    """Matrix of a rotation about (1, 2, -2)."""
    cross = np.cross(np.eye(3), [-1.0 / 3.0, -2.0 / 3.0, 2.0 / 3.0])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def two_groups(one, two):
    """Groups one and two of spheres 1 and 2, with these velocities along x."""
    return f"group one id 1\ngroup two id 2\nvelocity one set {one:.17g} 0 0\nvelocity two set {two:.17g} 0 0\n"


def thermo(columns):
    """The thermo table of these, to the last bit."""
    return f"thermo_style custom step {columns}\nthermo_modify norm no format float %.17g\n"


def velocities(x, y="0", z="0", group="all"):
    """Sets the velocities of a group by formulas."""
    return "".join(f"variable v{axis} atom {formula}\n" for axis, formula in zip("xyz", (x, y, z))) + f"velocity {group} set v_vx v_vy v_vz\n"


# a stretch along x, a wave by ID, and a drift that no force knows of
STIR = velocities(f"{DRIFT}+500*(x-0.04)+15*sin(1.1*id)", f"{DRIFT}/2+15*cos(2.3*id)", f"{DRIFT}/3+15*sin(3.7*id+1)")
MOVE = "fix move all nve\ntimestep 3e-7\nthermo 10\n" + thermo("pe ke pxx pyz f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[4]")


def dump(name="all.dump", every=50, columns="x y z vx vy vz fx fy fz"):
    return f"dump all all custom {every} {name} id {columns}\ndump_modify all format float %.17g pbc yes\n"


def assert_same_curve(rows, others, tolerance=ANOTHER_ORDER):
    """Two thermo tables; others may start earlier."""
    for name, values in others.items():
        allowed = tolerance * np.abs(values).max()
        assert np.all(np.abs(rows[name] - values[-len(rows[name]):]) <= allowed), name
