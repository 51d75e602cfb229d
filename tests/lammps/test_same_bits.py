# SPDX-License-Identifier: GPL-2.0-only
"""Effects that are inactive in a scene may change its cost, never its numbers: bit by bit those of the general path."""

import numpy as np
import pytest
from small_bodies import SPACING, head, lattice_body, write_body

STIR = """
variable vx atom 2*sin(1.1*id)
variable vy atom 2*cos(2.3*id)
velocity body set v_vx v_vy 0
"""
DECK = head("{newton}", start="region box block -0.06 0.14 -0.06 0.1 -0.06 0.1\ncreate_box 3 box\nread_data body.data add append\n{atoms}", sort="sort 0 0") + """
group body type 1
neigh_modify {lists}
pair_style evp/lj contact {contact}
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.5
{rows}
fix bonds all evp/bonds
fix move all nve
{fixes}
timestep 1e-7
{stir}
dump body body custom 200 all.dump id x y z vx vy vz fx fy fz
dump_modify body format float %.17g sort id
thermo_style custom step {columns}
thermo {every}
run 200
"""
PLAIN = {"newton": "on", "atoms": "", "lists": "every 1 delay 0 check yes", "contact": "literal", "rows": "", "fixes": "", "stir": STIR,
         "columns": "", "every": 1000}
AWAY = """
create_atoms 2 single 0.12 0.08 0.08
create_atoms 2 single 0.1295 0.08 0.08
set type 2 diameter 0.01
set type 2 density 2700
set type 2 vx 1.0
"""
# every one of these makes the loop take a longer path, for the sake of something that is not the body's
LONGER = {
    "damping of another pair": {"atoms": AWAY, "rows": "pair_coeff 2 2 80 8 4 3 8 4 0.005 500 1.5"},
    "several laws, of types without atoms": {"rows": "pair_coeff 3 3 50 8 4 5 8 4 0.01 0 1.5\npair_coeff 2 3 40 8 4 5 8 4 0.01 0 1.5"},
    "energy and virial at every step": {"columns": "pe press", "every": 1},
    "values per atom at every step": {"fixes": "compute e all pe/atom\ncompute s all stress/atom NULL\ncompute es all reduce sum c_e c_s[1]\n",
                                      "columns": "c_es[1] c_es[2]", "every": 1},
    "the ledger": {"fixes": "fix ledger all evp/energy"},
    "a volume energy of no stiffness": {"fixes": "fix volume all evp/volume 0"},
    "stable steps at every tenth step": {"fixes": "compute dt all evp/dt", "columns": "c_dt", "every": 10},
    "a list that is built at every step": {"lists": "every 1 delay 0 check no"},
}


@pytest.fixture
def body(tmp_path):
    body = lattice_body((4, 3, 3))
    write_body(tmp_path / "body.data", body._replace(types=np.ones(len(body.x), dtype=int)))
    return body


def test_longer_paths_give_the_same_bits(lmp_decks, body):
    decks = {"plain": {}, **LONGER}
    runs = lmp_decks({name: DECK.format(**{**PLAIN, "newton": "off", **parts}) for name, parts in decks.items()}, 2)
    ends = {name: run.dump("all.dump")[-1].vectors("x", "y", "z", "vx", "vy", "vz", "fx", "fy", "fz") for name, run in runs.items()}
    assert np.abs(ends["plain"][:, 6]).max() > 100.0, "control: it is stirred"
    for name, end in ends.items():
        assert np.array_equal(ends["plain"], end), name


def test_a_held_list_keeps_bonds_that_leave_and_come_back(lmp, tmp_path):
    """With contact none a deck may never build its list anew: a bond that goes beyond dlim and skin and comes back has its
    deq, as with a list that is built at every step."""
    pair = lattice_body((2, 1, 1))
    x = np.array([[0.0, 0.0, 0.0], [SPACING, 0.0, 0.0]])
    write_body(tmp_path / "body.data", pair._replace(x=x, radius=np.full(2, 0.005), types=np.ones(2, dtype=int)))
    there_and_back = {"contact": "none", "fixes": "group right id 2\nfix way right move variable v_far NULL NULL v_rate NULL NULL\n"
                      "variable far equal 0.01*(1-cos(2*PI*step/200))\nvariable rate equal 0.0", "stir": "unfix move"}
    deck = DECK.replace("custom 200", "custom 20")
    runs = [lmp(deck.format(**{**PLAIN, **there_and_back, "lists": lists})).ok().dump("all.dump")
            for lists in ("every 1000000 delay 1000000 check no", "every 1 delay 0 check no")]
    gap = [snapshot["x"][1] - snapshot["x"][0] for snapshot in runs[0]]
    assert max(gap) > 0.016 + 0.0008, "control: beyond dlim and skin"
    for held, built in zip(*runs):
        assert np.array_equal(held.vectors("fx", "fy", "fz"), built.vectors("fx", "fy", "fz"))
    forces = [abs(snapshot["fx"][0]) for snapshot in runs[0]]
    assert forces[5] == 0.0 and forces[1] > 100.0 and forces[-2] > 100.0, "it acts, goes, and acts again"
