# SPDX-License-Identifier: GPL-2.0-only
"""Small bodies with plasticity, whose bonds break and whose volume is kept: decks, and what a bond file says of them."""

from typing import NamedTuple

import numpy as np
from evp import law
from small_bodies import STIR, pair, thermo, velocities

ROW = law.TABLE1._replace(xi_s=0.004)
KV = 500.0
BREAK = 0.1
BONDS = "fix bonds all evp/bonds zone 1.1"  # the next neighbors are contacts, and some of them are pushed


class Pairs(NamedTuple):
    """A bond file, {(id_i, id_j, is contact): value}: what is left of a broken bond may have flowed as a contact does, in a line of
    its own. broken: 0 of a bond, 1 of one that broke, 2 of a contact."""

    deq: dict
    offset: dict = {}  # q [length]
    k: dict = {}
    work: dict = {}
    broken: dict = {}
    spheres: dict = {}  # {(id, column): value} where bonds have broken beside fix evp/volume

    def of(self, kind):
        return [key for key, broken in self.broken.items() if broken == kind]


def flowing_pair(contact="repulsive", broken=BREAK, row=ROW, kv=KV, fix=BONDS, plasticity="isotropic"):
    """Pair style, bonds and volume energy."""
    return pair(row, f"{contact} plasticity {plasticity} break {broken or 'none'}", fix) + (f"fix volume all evp/volume {kv}\n" if kv else "")


# to and fro: far beyond yield both ways within some hundred steps
SHAKE = STIR + velocities("vx+200*(x-0.04)+70*sin(5.1*id)", "vy+70*cos(7.3*id)", "vz-200*(z-0.02)+70*sin(2.7*id)")

COLUMNS = "pe ke pxx pyz f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[5] f_volume f_volume[1] c_flow[1] c_flow[2]"
SUMS = "compute pairs all pair/local p4 p5\ncompute flow all reduce sum c_pairs[1] c_pairs[2] inputs local\n"
MOVE = "fix move all nve\ntimestep 3e-7\nthermo 10\n" + SUMS + thermo(COLUMNS)


def read_pairs(path):
    """Also of a file without history, whose columns but deq are empty."""
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    spheres = {(int(words[1]), k): float(words[k]) for words in lines if words[0] == "sphere" for k in (2, 3)}
    lines = [words for words in lines if words[0] != "sphere"]
    keys = [(int(i), int(j), values[-1] == "2") for i, j, *values in lines]
    columns = np.array([words[2:] for words in lines], dtype=float).T
    found = Pairs(*(dict(zip(keys, column)) for column in columns), spheres=spheres)
    assert len(found.deq) == len(lines), "a pair is there twice"
    return found


def largest_difference(one, other):
    """Of two bond files, in units of the largest value of each column."""
    assert set(one.deq) == set(other.deq) and set(one.spheres) == set(other.spheres)
    worst = 0.0
    for own, others in zip(one, other):
        if not others:
            continue
        a, b = np.array([own[key] for key in others]), np.array(list(others.values()))
        worst = max(worst, np.abs(a - b).max() / max(np.abs(b).max(), 1e-300))
    return worst


def assert_flowed(pairs, broken=True, contacts=1):
    """The control of a comparison: bonds have flowed both ways and broken, so many contacts have flowed."""
    bonds = [pairs.offset[key] / pairs.deq[key] for key in pairs.of(0)]
    assert np.sum(np.array(bonds) > 0.003) > 20
    assert np.sum(np.array(bonds) < -0.003) > 20
    assert not broken or len(pairs.of(1)) > 3
    assert len(pairs.of(2)) >= contacts
