# SPDX-License-Identifier: GPL-2.0-only
"""Sums over all pairs without any neighbor list: slow, plain, and the truth for the tests."""

from typing import NamedTuple

import numpy as np

from . import law

_BLOCK = 2_000_000  # pairs looked at together, so that memory stays small


class Pairs(NamedTuple):
    """Pairs i < j (0-based indices), their vector from j to i, distance and R_i + R_j."""

    i: np.ndarray
    j: np.ndarray
    r: np.ndarray  # (P, 3)
    d: np.ndarray
    contact_distance: np.ndarray


class Interactions(NamedTuple):
    """The pairs that act on each other: geometry, own deq and cut, row fields per pair."""

    pairs: Pairs
    deq: np.ndarray
    cut: np.ndarray
    bonded: np.ndarray
    row: law.Row


def find_pairs(x, radius, reach, box=None):
    """All pairs with d <= reach (R_i + R_j), of x (N,3) and radius (N,) [length]; box: 3 periodic lengths, None or 0 for an open direction.

    ValueError if two centres coincide or a periodic length is below twice the largest reach, where a pair would meet two images."""
    x, radius = np.asarray(x, dtype=float), np.asarray(radius, dtype=float)
    widest = 2 * reach * radius.max() if len(radius) else 0.0
    if box is not None and any(length and length < 2 * widest for length in box):
        raise ValueError(f"periodic box {box} is shorter than twice the reach {widest}")
    parts, rows = [], max(1, _BLOCK // max(1, len(x)))
    for start in range(0, len(x), rows):
        block = slice(start, start + rows)
        r = x[block, None, :] - x[None, :, :]
        for axis, length in enumerate([] if box is None else box):
            if length:
                r[..., axis] -= length * np.rint(r[..., axis] / length)
        d = np.sqrt(np.sum(r * r, axis=-1))
        sums = radius[block, None] + radius[None, :]
        index = np.arange(start, start + d.shape[0])
        near = (d <= reach * sums) & (index[:, None] < np.arange(len(x))[None, :])
        i, j = np.nonzero(near)
        parts.append((i + start, j, r[i, j], d[i, j], sums[i, j]))
    pairs = Pairs(*(np.concatenate(column) for column in zip(*parts)))
    if np.any(pairs.d == 0.0):
        k = int(np.argmin(pairs.d))
        raise ValueError(f"atoms {pairs.i[k] + 1} and {pairs.j[k] + 1} are at the same place")
    return pairs


def record_bonds(x, radius, zone, box=None):
    """Pairs with d <= zone (R_i + R_j) as {(id_i, id_j): d}, id_i < id_j (paper 2.2), of IDs 1..N."""
    pairs = find_pairs(x, radius, zone, box)
    return dict(zip(zip((pairs.i + 1).tolist(), (pairs.j + 1).tolist()), pairs.d.tolist()))


def sums(atoms, values, count):
    """Sums (count, ...) of values (P, ...) over the pairs of each atom (P,); np.add.at takes ten times as long."""
    rest = np.shape(values)[1:]
    flat = np.reshape(np.asarray(values, dtype=float), (len(atoms), np.prod(rest, dtype=int)))
    return np.stack([np.bincount(atoms, column, count) for column in flat.T], axis=-1).reshape(count, *rest)


def rows_of_pairs(rows, type_i, type_j):
    """Row whose fields are arrays (P,), from one Row or a dict {(type_i, type_j): Row}."""
    if isinstance(rows, law.Row):
        rows = {(a, b): rows for a in np.unique(type_i) for b in np.unique(type_j)}
    table = np.zeros((len(type_i), len(law.Row._fields)))
    low, high = np.minimum(type_i, type_j), np.maximum(type_i, type_j)
    for a, b in set(zip(low.tolist(), high.tolist())):
        table[(low == a) & (high == b)] = rows[a, b] if (a, b) in rows else rows[b, a]
    return law.Row(*table.T)


def interactions(x, radius, rows, bonds, contact, types=None, box=None, ids=None, bodies=None):
    """The interacting pairs now, as Interactions; arguments as in brute_force."""
    count = len(radius)
    types = np.ones(count, dtype=int) if types is None else np.asarray(types)
    ids = np.arange(1, count + 1) if ids is None else np.asarray(ids)
    every_row = [rows] if isinstance(rows, law.Row) else list(rows.values())
    pairs = find_pairs(x, radius, max(r.alpha for r in every_row), box)
    row = rows_of_pairs(rows, types[pairs.i], types[pairs.j])
    keys = zip(ids[pairs.i].tolist(), ids[pairs.j].tolist())
    deq = np.array([bonds.get((a, b), bonds.get((b, a), np.nan)) for a, b in keys], dtype=float)
    bonded = ~np.isnan(deq)
    deq = np.where(bonded, deq, pairs.contact_distance)
    cut = law.pair_cut(pairs.contact_distance, bonded, row, contact)
    if bodies is not None:
        bodies = np.asarray(bodies)
        apart = ~bonded & (bodies[pairs.i] != bodies[pairs.j])
        cut = np.where(apart, np.minimum(cut, pairs.contact_distance), cut)
        row = row._replace(xi_s=np.where(apart, np.maximum(row.xi_s, 0.5), row.xi_s))
    acts = pairs.d <= cut
    kept = Pairs(*(column[acts] for column in pairs))
    return Interactions(kept, deq[acts], cut[acts], bonded[acts], law.Row(*(f[acts] for f in row)))


def brute_force(x, v, radius, types, rows, bonds, contact, box=None, ids=None, step=0.0, bodies=None):
    """Forces, energies and counts of one configuration, by a sum over all pairs.

    x, v (N,3) positions [length] and velocities; radius (N,); types (N,) int, or None for one type; rows: one Row, or {(type_i, type_j): Row};
    bonds: {(id_i, id_j): deq}, either order; contact: of pairs outside bonds (deq = R_i + R_j); box: as in find_pairs; ids (N,), default 1..N;
    bodies (N,): pairs of two bodies outside bonds only repel, by F_I (within of fix evp/bonds), None: all are one body;
    step: above 0, dampers see the mean opening rate over a step of that size with these velocities, as under fix nve/evp.

    Returns a dict:
      force (N,3)            eq. 8 plus eq. 4 on each atom
      abs_force (N,)         sum of |F| over each atom's own pairs, the scale of round-off
      i, j, d, deq           the interacting pairs (0-based), distance and equilibrium distance
      pair_force, pair_energy  eq. 8 alone [positive repels], and E(d) - E(cut); energy is the sum, atom_energy (N,) half of each own pair's
      virial (3,3)           sum over pairs of r_a F_b, damping included
      bonds_beyond           bonds now farther than dlim; bonds_second: within dlim and in the second regime
      new_contacts           unbonded pairs that interact
      lowest                 least d/(R_i + R_j) over interacting pairs (inf without any)
    """
    v = np.asarray(v, dtype=float)
    pairs, deq, cut, bonded, row = interactions(x, radius, rows, bonds, contact, types, box, ids, bodies)
    i, j, r, d, sums = pairs
    unit = r / d[:, None]
    pair_force = law.force(d, deq, row)
    damping = law.damping_force(unit, v[i], v[j], row)
    if step > 0.0:
        opening = (np.linalg.norm(r + step * (v[i] - v[j]), axis=1) - d) / step
        damping = -(row.gamma * opening)[:, None] * unit
    f = pair_force[:, None] * unit + damping
    pair_energy = law.energy(d, deq, row, cut)

    count = len(radius)
    total, atom_energy, scale = np.zeros((count, 3)), np.zeros(count), np.zeros(count)
    size = np.sqrt(np.sum(f * f, axis=1))
    for atoms, sign in ((i, 1.0), (j, -1.0)):
        np.add.at(total, atoms, sign * f)
        np.add.at(atom_energy, atoms, 0.5 * pair_energy)
        np.add.at(scale, atoms, size)
    second = bonded & (law.regime(d, deq, row) == 2)
    return {
        "force": total, "abs_force": scale, "i": i, "j": j, "d": d, "deq": deq, "pair_force": pair_force, "pair_energy": pair_energy,
        "energy": float(np.sum(pair_energy)), "atom_energy": atom_energy, "virial": r.T @ f,
        "bonds_beyond": len(bonds) - int(np.sum(bonded)), "bonds_second": int(np.sum(second)), "new_contacts": int(np.sum(~bonded)),
        "lowest": float(np.min(d / sums)) if len(d) else np.inf,
    }
