# SPDX-License-Identifier: GPL-2.0-only
"""Small bodies with plasticity, whose bonds end and whose volume is kept: decks, and what a bond file says of them."""

from typing import NamedTuple

import numpy as np
from evp import law
from small_bodies import STIR, pair, thermo, velocities

ROW = law.TABLE1._replace(xi_s=0.004)
KV = 500.0
FAILS = 0.3  # plastic strain at failure
BONDS = "fix bonds all evp/bonds zone 1.1"  # the next neighbors are contacts, and some of them are pushed
SPHERE = "plastic_strain plastic_work slip bonds recorded rho0 G gap torn lost batch volume_strain".split()  # with fix evp/volume


class Pairs(NamedTuple):
    """A bond file: {(id_i, id_j): deq}, lower ID first; spheres {id: values in the order of columns}; ended, joined, failed: bonds."""

    bonds: dict
    contacts: dict
    apart: dict
    inside: dict
    spheres: dict
    ended: int
    joined: int = 0
    failed: int = 0  # of those that ended
    columns: tuple = ()  # names

    def column(self, name):
        """{id: value} of what spheres keep."""
        return {sphere: values[self.columns.index(name)] for sphere, values in self.spheres.items()}


def failing_at(strain):
    """Words of a row whose spheres part at this plastic strain, but not under pressure; none with None."""
    return f" density 2700 damage {strain} 0 0 0 0 rupture 0" if strain else ""


def flowing_pair(contact="repulsive", fails=FAILS, row=ROW, kv=KV, fix=BONDS, plasticity="isotropic"):
    """Pair style, bonds and volume energy."""
    return pair(row, f"{contact} plasticity {plasticity}", fix, failing_at(fails)) + (f"fix volume all evp/volume {kv}\n" if kv else "")


def flow_words(table):
    return f" flow {' '.join(map(str, table))}" if table else ""


# to and fro: far beyond yield both ways within some hundred steps
SHAKE = STIR + velocities("vx+200*(x-0.04)+70*sin(5.1*id)", "vy+70*cos(7.3*id)", "vz-200*(z-0.02)+70*sin(2.7*id)")

COLUMNS = "pe ke pxx pyz f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[5] f_volume f_volume[1] c_flow[1] c_flow[2]"
SUMS = "compute own all evp/state/atom plastic_strain plastic_work\ncompute flow all reduce sum c_own[5] c_own[6]\n"
MOVE = "fix move all nve\ntimestep 3e-7\nthermo 10\n" + SUMS + thermo(COLUMNS)


class Led(NamedTuple):
    """A pair after each of the distances that it was led to, arrays."""

    force: np.ndarray
    stored: np.ndarray  # Psi
    deq: np.ndarray
    work: np.ndarray  # D so far
    p: np.ndarray  # of both spheres
    limit: np.ndarray
    slip: np.ndarray  # |ln| so far


def lead(distances, deq, row, flow=None, touching=None, first=1, every=10):
    """A bond by tools/evp/law.py, or with touching = R_i + R_j a contact, at the distances of the steps first, first + 1, ...: p and the limit move on at
    steps divisible by `every`, before the forces; a bond that is beyond a limit that has fallen is returned at fixed distance."""
    def move(d, deq, y):
        return law.flow_bond(d, deq, row, y) if touching is None else law.flow_contact(d, deq, touching, row, y)

    work, p, slip, slips, y, rows = 0.0, 0.0, 0.0, 0.0, float(law.limit(0.0, row, flow)), []
    for step, d in enumerate(distances, start=first):
        if step % every == 0 and touching is None:
            p, slip, y_before = p + slip / law.SLIP_PER_STRAIN, 0.0, y
            y = float(law.limit(p, row, flow))
            held = move(d, deq, y_before)
            back = move(d, held.deq, y)
            if y < y_before and back.slip > 0.0:
                deq, work = float(back.deq), work + float(held.dissipated + held.stored - back.stored)
                slip, slips = float(held.slip + back.slip), slips + float(held.slip + back.slip)
        now = move(d, deq, y)
        deq, work, slip, slips = float(now.deq), work + float(now.dissipated), slip + float(now.slip), slips + float(now.slip)
        rows.append((float(now.force), float(now.stored), deq, work, p, y, slips))
    return Led(*np.array(rows).T)


def read_pairs(path):
    header, *lines = path.read_text(encoding="utf-8").splitlines()
    found, spheres = {"bond": {}, "contact": {}, "apart": {}, "inside": {}}, {}
    for words in map(str.split, lines):
        if words[0] == "sphere":
            spheres[int(words[1])] = tuple(map(float, words[2:]))
            continue
        kind = words.pop(0) if not words[0].isdigit() else "bond"
        kind = "bond" if kind == "joined" else kind
        key = tuple(sorted(map(int, words[:2])))
        assert len(words) == 3 and key not in found[kind], "a pair is there twice"
        found[kind][key] = float(words[2])
    words = header.split()
    counts = (int(words[words.index(key) + 1]) if key in words else 0 for key in ("ENDED:", "JOINED:", "FAILED:"))
    columns = tuple(words[words.index("COLUMNS:") + 1].split(",")) if "COLUMNS:" in words else ()
    return Pairs(*found.values(), spheres, *counts, columns)


def largest_difference(one, other, columns=None):
    """Of two bond files, in units of the largest value of each column; columns: of spheres, default all."""
    worst = 0.0
    assert (one.ended, one.joined, one.failed, one.columns) == (other.ended, other.joined, other.failed, other.columns)
    kept = [(one[k], other[k]) for k in range(4)] + [(one.column(name), other.column(name)) for name in columns or one.columns]
    for own, others in kept:
        assert set(own) == set(others)
        if not others:
            continue
        a, b = np.array([own[key] for key in others]), np.array(list(others.values()))
        worst = max(worst, np.abs(a - b).max() / max(np.abs(b).max(), 1e-300))
    return worst


def assert_flowed(pairs, recorded, broken=True, contacts=1):
    """The control of a comparison: bonds have flowed both ways and ended, so many contacts have flowed. recorded: {(id_i, id_j): deq}."""
    bonds = np.array([deq / recorded[key] - 1.0 for key, deq in pairs.bonds.items()])
    assert np.sum(bonds > 0.003) > 20
    assert np.sum(bonds < -0.003) > 20
    assert not broken or pairs.ended > 3
    assert len(pairs.contacts) >= contacts
