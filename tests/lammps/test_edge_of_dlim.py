# SPDX-License-Identifier: GPL-2.0-only
"""Shells of neighbors at d = dlim, or at the edge of the zone, but for the round-off of the places: the same pairs act, on
both of their atoms, wherever the body lies and whatever looks at it."""

import itertools

import numpy as np
import pytest
from lammps_run import write_data
from small_bodies import head, pair, thermo

DIAMETER = 0.0087
CELLS = 5  # of a simple cubic lattice, more than two cut-offs
SHELLS = {1.0: 6, 2.0: 12, 3.0: 8, 4.0: 6, 5.0: 24, 6.0: 24}  # squares of the distances in diameters: neighbors
N = CELLS**3

COUNTS = """
compute state all evp/state/atom
compute most all reduce max c_state[1]
compute least all reduce min c_state[1]
compute new all reduce max c_state[4]
"""
COLUMNS = "pe press f_bonds f_bonds[1] f_bonds[2] f_bonds[3] c_most c_least c_new"
SQUEEZE = "change_box all x scale 0.99999 y scale 0.99999 z scale 0.99999 remap\n"


def lattice(path, offset):
    """Touching spheres that fill a periodic box, every coordinate rounded where it lies."""
    places = DIAMETER * np.array(list(itertools.product(range(CELLS), repeat=3))) + np.array(offset)
    low = np.array(offset) - 0.5 * DIAMETER
    write_data(path, places, np.full(N, 0.5 * DIAMETER), np.stack([low, low + CELLS * DIAMETER], axis=1))


def deck(alpha, contact="literal", fix="", newton="on", skin=0.0005, then=""):
    style = f"pair_style evp/lj contact {contact}\npair_coeff * * 60 8 4 3 8 4 0.005 0 {alpha:.17g}\nfix bonds all evp/bonds {fix}\n"
    return head(newton, "p p p", skin=skin) + style + "fix move all nve\n" + COUNTS + thermo(COLUMNS) + "run 0\n" + then


def expect(table, bonds, new):
    """bonds, new: per atom."""
    found = {name: table[name][-1] for name in table}
    assert found["f_bonds"] == N * bonds / 2
    assert (found["f_bonds[1]"], found["f_bonds[2]"], found["f_bonds[3]"]) == (0, 0, N * new / 2)
    assert (found["c_most"], found["c_least"], found["c_new"]) == (bonds, bonds, new)


OFFSETS = [(0, 0, 0), (0.1, 0.1, 0.1), (0.0123, 0.37, -0.0456), (-11.3, 7.7, 3.1)]
SHELLS_OF = [(2.0, ""), (3**0.5, ""), (3**0.5, "zone 1.41421356237309505"), (2.0, "zone 2")]  # alpha, words of the fix


@pytest.mark.parametrize("ranks, newton", [(1, "off"), (4, "on")])
def test_a_lattice_has_whole_shells(lmp_decks, tmp_path, ranks, newton):
    """Recorded, squeezed by 1e-5, written and read back."""
    decks, write = {}, "run 0\nwrite_data s.data nocoeff\nwrite_evp_bonds s.bonds\nclear\n"
    for number, offset in enumerate(OFFSETS[2:]):
        lattice(tmp_path / f"body{number}.data", offset)
        for alpha, fix in SHELLS_OF:
            first = deck(alpha, "literal" if fix else "none", fix, newton, then=SQUEEZE + write).replace("body.data", f"body{number}.data")
            decks[offset, alpha, fix] = first + deck(alpha, "literal", "file s.bonds", newton).replace("body.data", "s.data")
    for (_, alpha, fix), run in lmp_decks(decks, ranks).items():
        zone = float(fix.split()[1]) if fix else alpha
        bonds, within = (sum(n for square, n in SHELLS.items() if square <= reach**2 + 1e-6) for reach in (zone, alpha))
        for block in range(3):
            expect(run.thermo(block), bonds, within - bonds)
        assert len((run.folder / "s.bonds").read_text(encoding="utf-8").splitlines()) == 1 + N * bonds // 2
        squeezed, again = (run.thermo(block)["Press"][0] for block in (1, 2))
        assert again == pytest.approx(squeezed, rel=1e-6)
        if within == bonds:  # of small strains: each bond has K deq^2 = m n e1
            assert squeezed == pytest.approx(N * bonds / 2 * 8 * 4 * 60 * 1e-5 / (3 * (CELLS * DIAMETER)**3), rel=1e-4)


def test_both_atoms_keep_the_same_bits(lmp, tmp_path):
    """A body of round-off only in a tilted periodic box on 4 ranks: written from the side of the lower ID, and from the other
    one after the IDs have changed sides; deq of both is the same to the last bit."""
    rng = np.random.default_rng(5)
    places = DIAMETER * (np.array(list(itertools.product(range(CELLS), repeat=3))) + 0.05 * rng.random((N, 3)))
    places += [0.0123, 0.37, -0.0456]
    low = places.min(axis=0) - 0.5 * DIAMETER
    order = rng.permutation(N)
    for name, ids in (("a", np.arange(N)), ("b", np.arange(N)[::-1])):
        moved = places[order[ids]]
        write_data(tmp_path / "body.data", moved, np.full(N, 0.5 * DIAMETER), np.stack([low, low + (CELLS + 0.1) * DIAMETER], axis=1))
        tilted = (tmp_path / "body.data").read_text(encoding="utf-8").replace("zlo zhi\n", "zlo zhi\n0.003 -0.002 0.001 xy xz yz\n")
        (tmp_path / "body.data").write_text(tilted, encoding="utf-8")
        lmp(head(boundary="p p p") + pair() + f"run 0\nwrite_evp_bonds {name}.bonds\n", ranks=4).ok()
    a, b = ({frozenset(int(word) for word in line.split()[:2]): line.split()[2] for line in (tmp_path / f"{name}.bonds").read_text().splitlines()[1:]}
            for name in "ab")
    assert len(a) > 900
    assert a == {frozenset(N + 1 - k for k in key): deq for key, deq in b.items()}


def test_spheres_that_touch_are_not_damped(lmp_decks, tmp_path):
    """With contact repulsive a new pair acts below R_i + R_j: none of these, though they part. Control: below, all of them."""
    text = deck(1.5, "repulsive", "zone 1.0000001").replace("0.005 0 1.5", "0.005 700 1.5").replace("fix bonds all", "group one id 1\nfix bonds one")
    decks = {}
    for number, offset in enumerate(OFFSETS):
        lattice(tmp_path / f"body{number}.data", offset)
        for squeeze in (1.0, 0.9999):
            motion = f"change_box all x scale {squeeze} y scale {squeeze} z scale {squeeze} remap\nvariable vx atom 3*sin(1.1*id)\nvelocity all set v_vx 0 0\n"
            decks[offset, squeeze] = text.replace("run 0", motion + "thermo_modify norm no\nrun 0").replace("body.data", f"body{number}.data")
    mass, speed = 2700.0 * np.pi / 6.0 * DIAMETER**3, 3.0 * np.sin(1.1 * np.arange(1, N + 1))
    gas = float(np.sum(mass * speed**2)) / (3.0 * (CELLS * DIAMETER) ** 3)  # of the motion alone: no pair adds to it
    for (offset, squeeze), run in lmp_decks(decks).items():
        new, pressure = (run.thermo()[name][0] for name in ("f_bonds[3]", "Press"))
        assert new == (0 if squeeze == 1.0 else N * SHELLS[1.0] / 2), offset
        assert squeeze < 1.0 or pressure == pytest.approx(gas, rel=1e-6), offset
