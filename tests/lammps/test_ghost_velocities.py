# SPDX-License-Identifier: GPL-2.0-only
"""The pair style sends what explicit damping reads of ghosts: the same bits as with `comm_modify vel yes`, in any box."""

import pytest
from evp import law
from small_bodies import STIR, dump, head, lattice_body, words, write_body

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
