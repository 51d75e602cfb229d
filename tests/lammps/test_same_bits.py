# SPDX-License-Identifier: GPL-2.0-only
"""The pair style sends what explicit damping reads of ghosts: the same bits as with `comm_modify vel yes`, in any box. Effects that are inactive in a
scene may change its cost, never its numbers: bit by bit those of the general path."""

import numpy as np
import pytest
from evp import law
from small_bodies import SPACING, STIR, dump, head, lattice_body, velocities, words, write_body

ROW = law.TABLE1._replace(gamma=50.0)
LISTS = "neigh_modify every 3 delay 0 check no\n"  # ghosts of two steps in three are those of a step before
SHOW = """
compute ids all property/local patom1 patom2
compute pairs all pair/local dist force
dump pairs all local 20 pairs.dump c_ids[1] c_ids[2] c_pairs[1] c_pairs[2]
dump_modify pairs format float %.17g
timestep 3e-7
""" + dump(every=20)
RUN = SHOW + "run 90\nrun 30\n"
MOVE = "fix move all nve\n"
BONDS = "fix bonds all evp/bonds\n"
OVERLAY = f"pair_style hybrid/overlay lj/cut 0.015 evp/lj\npair_coeff * * lj/cut 2 0.009\npair_coeff * * evp/lj {words(ROW)}\n"
TILT = (0.0245, 0.0, 0.0)  # a shear by 0.06 makes the box flip

# lines before the box, pair style, lines before the run, tilt
SCENES = {
    "periodic": ("", "", MOVE, None),
    "tiled": ("comm_style tiled\n", "", MOVE, None),
    "growing with remap v": ("", "", "fix grow all deform 1 x erate 2000 y erate -1000 remap v\n" + MOVE, None),
    "sheared with remap v": ("", "", "fix shear all deform 1 xy erate 2000 remap v\n" + MOVE, TILT),
    "hybrid/overlay": ("", OVERLAY, MOVE, None),
    "fix nve/evp on a part": ("", "", "group half id <= 40\ngroup rest subtract all half\nfix move half nve/evp\nfix way rest nve/noforce\n", None),
}


def start(vel="no", newton="on", before="", style="", row=ROW):
    """Up to the bonds."""
    style = style or f"pair_style evp/lj\npair_coeff * * {words(row)}\n"
    return head(newton, boundary="p p p", before=f"comm_modify vel {vel}\n" + before) + LISTS + style + BONDS


def wrote(run):
    """The dumps of a run, as text: 17 digits tell any two numbers apart."""
    return [(run.folder / name).read_text(encoding="utf-8") for name in ("all.dump", "pairs.dump")]


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (4, "on")])
def test_they_are_the_same_bits_as_those_that_lammps_sends(lmp_decks, tmp_path, ranks, newton):
    """Places, velocities and forces, and the force column of compute pair/local; neighbor lists on the way, and a new set-up. Control:
    without damping they are others."""
    decks = {}
    for number, (name, (before, style, move, tilt)) in enumerate(SCENES.items()):
        write_body(tmp_path / f"body.{number}", lattice_body((5, 4, 4), periodic="xyz", tilt=tilt or (0.0, 0.0, 0.0)), tilt)
        for vel in ("yes", "no"):
            deck = start(vel, newton=newton, before=before, style=style) + STIR + move + RUN
            decks[name, vel] = deck.replace("body.data", f"body.{number}")
    decks["control"] = (start(newton=newton, row=law.TABLE1) + STIR + MOVE + RUN).replace("body.data", "body.0")
    runs = lmp_decks(decks, ranks)
    assert wrote(runs["control"]) != wrote(runs["periodic", "no"]) and "evp/lj: damping off" in runs["control"].stdout
    for name in SCENES:
        own = runs[name, "no"]
        assert wrote(own) == wrote(runs[name, "yes"]), name
        assert own.dump("all.dump")[-1].step == 120 and len(own.dump("pairs.dump")[0]["c_ids[1]"]) > 300, name


# ---- inactive effects ----

STIR_BODY = velocities("2*sin(1.1*id)", "2*cos(2.3*id)", group="body")
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
PLAIN = {"newton": "on", "atoms": "", "lists": "every 1 delay 0 check yes", "contact": "literal", "rows": "", "fixes": "", "stir": STIR_BODY,
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
        assert np.array_equal(held.f, built.f)
    forces = [abs(snapshot["fx"][0]) for snapshot in runs[0]]
    assert forces[5] == 0.0 and forces[1] > 100.0 and forces[-2] > 100.0, "it acts, goes, and acts again"
