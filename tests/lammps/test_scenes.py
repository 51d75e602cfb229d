# SPDX-License-Identifier: GPL-2.0-only
"""Scenes that once went wrong without a word, or that stand at the edge of what users set up: pairs lost, stale pointers and lists, forces that depend
on the number of ranks, boxes without atoms, a giant among small spheres."""

import itertools
import re

import numpy as np
import pytest
from oracle import law
from hostile import PLANE, refused, scene
from lammps_run import REFERENCE, write_data
from small_bodies import head, pair, thermo, write_two

HEAD = head(boundary="s s s", start=f"read_data {REFERENCE}", skin=0.0003) + """
velocity all ramp vx -0.2 0.2 x 0 0.05
timestep 1e-6
""" + thermo("pe ke")
STYLE = "\npair_style evp/lj contact none\npair_coeff * * 80 8 4 3 8 4 0.005 1000 {alpha}\n"
SOLVE = "fix bonds all evp/bonds zone 1.5\nfix integrate all nve/evp tol 1e-12\n"


def test_a_new_pair_style_gets_a_new_warm_start(lmp):
    """fix nve/evp keeps damper forces by index in the pair's list: another pair object has another list, even where both were packed as often."""
    wide = STYLE.format(alpha=2.5)
    changed = HEAD + STYLE.format(alpha=1.5) + SOLVE + "run 0\npair_style none" + wide + "run 3\n"
    fresh = HEAD + wide + SOLVE + "run 0\nrun 3\n"
    ends = [lmp(deck).ok().thermo() for deck in (changed, fresh)]
    for column in ("PotEng", "KinEng"):
        assert ends[0][column][-1] == pytest.approx(ends[1][column][-1], rel=1e-9), column
    assert ends[0]["KinEng"][-1] != ends[0]["KinEng"][0], "control: the body moves"


BOX, SKIN = "0 0.08 0 0.04 0 0.04", "neighbor 0.0006 bin\n"
ROW, DAMPED = "80 8 4 3 8 4 0.005 0 1.5\n", "80 8 4 3 8 4 0.005 1000 1.5\n"
SHOW = "thermo 1\nthermo_style custom step {}\nthermo_modify norm no format float %.15g\n"


def spheres(*rows, sent="", boundary="f f f", box=BOX):
    """Of 10 mm in diameter in a box of two types; rows: type, x [m], y, z."""
    text = f"units si\natom_style sphere {sent}\natom_modify map yes\nboundary {boundary}\nregion box block {box}\ncreate_box 2 box\n"
    text += "".join("create_atoms {} single {} {} {}\n".format(*row) for row in rows)
    text += "set group all diameter 0.01\nset group all density 2700\n" if rows else ""
    return text + SKIN + "neigh_modify every 1 delay 0 check yes\n"


def in_a_line(*places):
    """The first two of type 1, the others of type 2."""
    return [(1 + (k > 1), x, 0.01, 0.01) for k, x in enumerate(places)]


def two_pairs(places=(0.01, 0.0199, 0.06, 0.0699), sent="", style="pair_style evp/lj\npair_coeff * * " + ROW, fix="fix bonds all evp/bonds\n", move="fix move all nve\n"):
    return spheres(*in_a_line(*places), sent=sent) + style + fix + move + "timestep 1e-9\n" + SHOW.format("pe")


def test_radii_that_change_on_one_rank_only(lmp):
    """Only the rank whose radii changed packs its pairs again, so that packing may not wait for the others."""
    text = two_pairs(sent=1, fix="") + "variable d equal 0.01-1e-7*step\ngroup A type 1\nfix shrink A adapt 1 atom diameter v_d\nrun 5\n"
    one, two = (lmp(text if ranks == 1 else "processors 2 1 1\n" + text, ranks).ok().thermo()["PotEng"] for ranks in (1, 2))
    assert len(set(one)) == 6, "control: every step has other radii"
    assert two == pytest.approx(one, rel=1e-12)


def test_atoms_that_come_beside_the_implicit_group_are_damped(lmp):
    """At set-up all atoms are in the group of fix nve/evp; those that come later are not, and are damped explicitly."""
    deck = head(start="region box block 0 20 0 10 0 10\ncreate_box 1 box\ncreate_atoms 1 single 2 2 2\ncreate_atoms 1 single 3 2 2\n"
                "set group all diameter 1\nset group all density 1", before="comm_modify vel {vel}", skin=0.3).replace("units si", "units lj") + """
pair_style evp/lj contact literal
pair_coeff * * 1 8 4 0.1 8 4 0.005 50 1.5
fix bonds all evp/bonds
group body union all
group new empty
fix 1 body nve/evp
fix 2 new nve
region ra block 9.5 9.5001 5 5.0001 5 5.0001
region rb block 10.5 10.5001 5 5.0001 5 5.0001
fix da new deposit 1 1 2 1234 region ra vx 2 2 near 0.1
fix db new deposit 1 1 2 1235 region rb vx -2 -2 near 0.1
timestep 1e-4
thermo 1
compute most all reduce max fx
thermo_style custom step atoms c_most
thermo_modify norm no format float %.15g
run 5
"""
    one = lmp(deck.format(vel="no")).ok().thermo()["c_most"][-1]
    run, sent = (lmp("processors 2 1 1\n" + deck.format(vel=vel), ranks=2).ok().thermo() for vel in ("no", "yes"))
    assert list(run["c_most"]) == list(sent["c_most"])
    assert run["Atoms"][-1] == 4
    assert run["c_most"][-1] == pytest.approx(one, rel=1e-9)
    assert run["c_most"][-1] > 50.0, "control: the damping of the pair that met"


LJ = "pair_coeff 1 2 lj/cut 1e-5 0.005\n"
HYBRID = "pair_style hybrid evp/lj lj/cut 0.01\n"
NAMED = f"pair_coeff 1 1 evp/lj {ROW}pair_coeff 2 2 evp/lj {ROW}{LJ}"


def test_bonds_that_a_hybrid_forgot(lmp):
    """pair_style hybrid, given again after read_restart, drops what its sub-style had read; the fix tells."""
    lmp(two_pairs(style=HYBRID + NAMED) + "run 0\nset atom 2 x 0.02\nrun 0\nwrite_restart half.restart\n").ok()
    again = "read_restart half.restart\n" + SKIN + "{style}" + NAMED + "fix {id} all evp/bonds\nfix move all nve\nvariable f equal fx[1]\nthermo_style custom step v_f\nrun 0\n"
    right = lmp(again.format(style="", id="bonds")).ok()
    assert "takes the current shape of the body as undeformed" not in right.stdout and right.thermo()["v_f"][0] != 0.0
    refused(lmp(again.format(style="", id="other")), "the bonds were recorded by fix bonds")
    anew = lmp(again.format(style=HYBRID, id="other")).ok()
    assert "takes the current shape of the body as undeformed" in anew.stdout and anew.thermo()["v_f"][0] == 0.0


def test_single_has_no_damping_after_a_minimisation(lmp):
    """After a minimisation nobody sent any: the pair's force is then without damping, also across the boundary of two ranks."""
    text = "processors 2 1 1\n" + two_pairs((0.036, 0.0459, 0.06, 0.0699), style="pair_style evp/lj\npair_coeff * * " + DAMPED, move="")
    text += "set atom 2 vx 5\ncompute own all pair/local dist force\nminimize 0 0 1 1\nwrite_dump all local own.dump c_own[1] c_own[2]\n"
    own = lmp(text, ranks=2).ok().dump("own.dump")[0]
    near = own["c_own[1]"] < 0.011
    assert near.sum() > 0 and np.abs(own["c_own[2]"][near]).max() < 1e-3


# LAMMPS' line search of cg gives up at energy changes of 1e-8 [J], here 3e-8 m from deq at 2e7 N/m
@pytest.mark.parametrize("style, precision", [("fire", 1e-10), ("cg", 3e-8)])
def test_minimisation_knows_no_damping(lmp_decks, tmp_path, style, precision):
    """gamma > 0 changes no bit of a minimisation. Two spheres with deq = 0.011, pulled to 0.01105, return to deq; so the minimiser does work with this style."""
    write_two(tmp_path / "two.data")
    decks = {gamma: head(start="read_data two.data", skin=0.002) + pair(law.TABLE1._replace(gamma=gamma), "none") + f"""
timestep 1e-6
min_style {style}
min_modify dmax 1e-4
minimize 0 0 1 1
displace_atoms all ramp x 0 0.00005 x -0.0055 0.0055
print "apart $(x[2]-x[1]:%.17g)"
minimize 0 1e-8 1000 10000
print "apart $(x[2]-x[1]:%.17g)"
""" for gamma in (0, 1000)}
    runs = lmp_decks(decks, ranks=2).values()
    assert all("recorded 1 pairs" in run.stdout for run in runs), "recorded by the minimisation's own set-up"
    ends = [[float(word) for word in re.findall(r"^apart (\S+)", run.stdout, re.M)] for run in runs]
    assert ends[0] == [pytest.approx(0.01105, abs=1e-12), pytest.approx(0.011, abs=precision)] and ends[1] == ends[0]


def test_pairs_of_types_that_a_hybrid_takes_away(lmp, lmp_decks):
    """pair_coeff * * evp/lj and then 1 2 lj/cut is the deck that names 1 1 and 2 2: nothing of types 1 and 2 is recorded. What evp/lj does not serve it does
    not judge: a point without radius, a box that is short for lj/cut's types only."""
    row, point = in_a_line(0.01, 0.0199, 0.0299, 0.0398), "set type 2 diameter 0\nset type 2 mass 1\n"
    every, first = f"pair_coeff * * evp/lj {ROW}{LJ}", f"pair_coeff * * evp/lj {ROW}pair_coeff * 2 lj/cut 1e-5 0.005\n"
    rest = "fix bonds all evp/bonds\nfix move all nve\ntimestep 1e-9\n" + SHOW.format("pe f_bonds f_bonds[1]") + "run 1\n"
    decks = {"named": spheres(*row) + HYBRID + NAMED, "taken": spheres(*row) + HYBRID + every, "point": spheres(*row) + point + HYBRID + first,
             "short": spheres(*row, boundary="p f f") + "set type 2 diameter 0.05\n" + HYBRID + first}
    named, taken, *_ = (run.thermo() for run in lmp_decks({name: deck + rest for name, deck in decks.items()}).values())
    assert named["f_bonds"][-1] == 2 and named["f_bonds[1]"][-1] == 0
    for column in ("f_bonds", "f_bonds[1]", "PotEng"):
        assert list(taken[column]) == list(named[column]), column
    refused(lmp(spheres(*row) + point + HYBRID + every + rest), "needs particles with a radius above zero, and finite, found 0")


def test_step_without_bound_waits_for_pairs_that_approach(lmp_decks):
    """A pair that crosses the skin is on its way, though it cannot meet before the next check."""
    text = two_pairs((0.01, 0.0253, 0.06, 0.0753)) + "set atom 1 vx 10\nset atom 3 vx 10\nfix step all dt/evp 1 0.4 {}\nthermo_style custom step dt pe\nrun {}\n"
    for run in lmp_decks({"free": text.format("", 30), "limited": text.format("displacement 0.1", 2000)}).values():
        assert min(run.thermo()["PotEng"]) < -1.0, "they met"


def test_a_giant_costs_memory_of_its_own_only(lmp, tmp_path):
    """One atom with thousands of partners, spheres of 5 mm on a square lattice within 30 mm of the surface of one of 80 mm: the others keep room for theirs,
    restart and migration carry its own."""
    grid = 0.01 * np.array(list(itertools.product(range(-12, 13), repeat=3)), dtype=float)
    away = np.linalg.norm(grid, axis=1)
    x = np.concatenate([np.zeros((1, 3)), grid[(away > 0.08) & (away < 0.11)]])
    write_data(tmp_path / "giant.data", x, np.r_[0.08, np.full(len(x) - 1, 0.005)], np.array([[-0.2, 0.2]] * 3))
    partners = int(np.sum(np.linalg.norm(x[1:], axis=1) <= 1.3 * 0.085))
    assert partners > 3000, "control: a row for every atom as long as the giant's would be counted in hundreds of MB"
    rest = ("neigh_modify one 20000 page 400000\ncomm_modify cutoff 0.25\n" + pair(law.TABLE1._replace(alpha=1.3), "none", "fix bonds all evp/bonds zone 1.3")
            + "fix integrate all nve\ntimestep 1e-7\n" + thermo("pe ke f_bonds"))
    deck = head(start="read_data giant.data", skin=0.001) + rest + "run 0\ninfo memory\nwrite_restart half.restart\nvelocity all set 0 300 0\nrun 20\n"
    run = lmp(deck, ranks=2).ok()
    memory = [float(words[2]) for words in re.findall(r"\(min/avg/max\) = (\S+) \| (\S+) \| (\S+) Mbytes", run.stdout)]
    rows = len(x) / 2 * partners * 16 / 2**20
    assert max(memory) < rows, f"{memory} MB in all, rows of one length would take {rows:.0f} MB"
    again = lmp(head(start="read_restart half.restart", skin=0.001) + rest.replace(" zone 1.3", "") + "velocity all set 0 300 0\nrun 20\n", ranks=2).ok()
    sorted_run = lmp(deck.replace("map yes ", "map yes sort 1 0.02").replace("run 20", "run 400"), ranks=2).ok()
    memory = [float(words[2]) for words in re.findall(r"\(min/avg/max\) = (\S+) \| (\S+) \| (\S+) Mbytes", sorted_run.stdout)]
    assert max(memory) < rows, f"{memory} MB after sorting, where places that the giant held would keep its room"
    for column in ("PotEng", "f_bonds"):
        assert again.thermo()[column][-1] == pytest.approx(run.thermo()[column][-1], rel=1e-10), column


WIDE = "-0.1 0.1 -0.1 0.1 -0.1 0.1"


def two(kind):
    return [(kind, -0.005, 0, 0), (kind, 0.0045, 0, 0)]


def test_a_group_in_which_nothing_interacts_limits_no_step(lmp):
    """fix dt/evp of a lone atom has no bound to give, whatever others do."""
    lone = spheres(*two(1), (1, 0.05, 0, 0), box=WIDE) + "group lone id 3\npair_style evp/lj\npair_coeff * * " + ROW
    refused(lmp(lone + "fix move all nve\nfix step lone dt/evp 20 0.4\nrun 5\n"), "no pair interacts or approaches another")


def test_radii_of_atoms_that_come_are_checked(lmp, tmp_path):
    """Cut-offs are set for the radii at set-up; a type without atoms then has a cut-off of zero, and says so when they come. Rerun sets up before it
    adds atoms, so that their radii come too late."""
    deck = spheres(*two(2), box=WIDE) + "pair_style hybrid/overlay evp/lj zero 0.0156\npair_coeff 1 1 evp/lj " + ROW
    deck += "pair_coeff * * zero\nfix move all nve\ntimestep 1e-8\nneigh_modify check no\n" + SHOW.format("pe") + "run 2\nset group all type 1\n"
    refused(lmp(deck + "run 2 pre no\n", ranks=2), "the cutoff was set for at most 0", stepped=True)
    energy = lmp(deck + "run 2\n", ranks=2).ok().thermo(1)["PotEng"]
    assert energy[0] < -1.0, "with a set-up of its own the run sees them"
    (tmp_path / "two.dump").write_text("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n" + 3 * "-0.1 0.1\n"
                                       + "ITEM: ATOMS id type x y z\n1 1 -0.0045 0 0\n2 1 0.005 0 0\n")
    deck = spheres(box=WIDE) + "pair_style evp/lj\npair_coeff * * " + ROW + "rerun two.dump dump x y z add yes\n"
    refused(lmp(deck), "the cutoff was set for at most 0")


def test_atoms_of_another_style_beside_damped_ones(lmp_decks):
    """All that evp/lj damps is in the group of fix nve/evp; atoms of lj/cut beside them are nobody's business."""
    deck = spheres(*two(1), (2, 0.05, 0.05, 0), (2, 0.06, 0.05, 0), box=WIDE) + "pair_style hybrid evp/lj lj/cut 0.015\npair_coeff 1 1 evp/lj " + DAMPED
    deck += "pair_coeff * 2 lj/cut 0.01 0.009\ngroup ours type 1\ngroup theirs type 2\nfix 1 ours nve/evp\nfix 2 theirs nve\ntimestep 1e-8\nrun 5\n"
    crossed = deck.replace("pair_coeff * 2 lj/cut 0.01 0.009\n", "pair_coeff 1 2 evp/lj " + DAMPED + "pair_coeff 2 2 lj/cut 0.01 0.009\n")
    runs = lmp_decks({"explicit": deck.replace("ours nve/evp", "ours nve"),
                      "across, damped by the fix of ours": crossed.replace("theirs nve\n", "theirs nve/noforce\n"),
                      "steps": deck.replace("run 5", "compute every all evp/dt\ncompute own ours evp/dt\nthermo_style custom step c_every c_own\nrun 5")}, 2)
    assert "evp/lj: damping on" in runs["explicit"].stdout
    table = runs["steps"].thermo()
    assert table["c_every"][-1] == pytest.approx(table["c_own"][-1], rel=1e-3), "the implicit limit, as nobody else's atoms interact here"


# ---- a box that moves its atoms after the forces of a step ----

REGIONS = {"deform": "prism 0 5 0 5 0 5 0 0 0", "press/berendsen": "block 0 5 0 5 0 5"}
BOXES = ["deform 1 xz erate 1500 yz erate 1000 x erate 100 flip no remap x", "press/berendsen iso 0 -3e9 1e-4 modulus 1e10"]


@pytest.mark.parametrize("box", BOXES)
def test_counts_are_those_of_the_atoms_as_they_are(lmp, box):
    """As a run of no steps finds them, which places all ghosts anew."""
    text = head(boundary="p p p", skin=0.0005, start=f"lattice fcc 0.01\nregion cube {REGIONS[box.split()[0]]}\ncreate_box 1 cube\ncreate_atoms 1 box\n"
                "displace_atoms all random 2e-4 2e-4 2e-4 77\nset group all diameter 0.00707\nset group all density 2700") + f"""
pair_style evp/lj contact repulsive plasticity isotropic
pair_coeff * * 80 8 4 3 8 4 0.005 100 1.5 density 2700 damage 0.05 0 0 0 0 rupture 0
fix bonds all evp/bonds zone 1.2
fix box all {box}
fix move all nve/evp
timestep 1e-6
compute state all evp/state/atom
compute second all reduce ave c_state[2]
thermo 40
{thermo("f_bonds[1] f_bonds[2] f_bonds[4] c_second")}run 80
unfix box
run 0
"""
    run = lmp(text, ranks=2).ok()
    assert len(set(run.thermo(0)["f_bonds[4]"])) == 3
    for name in ("f_bonds[1]", "f_bonds[2]", "f_bonds[4]", "c_second"):
        assert run.thermo(0)[name][-1] == pytest.approx(run.thermo(1)[name][0], rel=1e-12)


# ---- the law of a pair is the same in 'dimension 2'; what counts on a solid of three dimensions is refused there ----

def sheet(**parts):
    return scene(**{"box": PLANE, "move": "fix flat all enforce2d\nfix move all nve", "coeff": "pair_coeff * * 80 8 4 3 8 4 0.005 0 1.2", **parts})


def test_forces_of_the_pair_style_and_plastic_work(lmp):
    """A square lattice recorded at rest and stretched by 1 %: two bonds of an atom."""
    run = lmp(sheet(then="run 0\nchange_box all x scale 1.01 y scale 1.01 remap\ncompute work all evp/state/atom plastic_work\n"
                    "compute sum all reduce sum c_work[*]\nthermo_modify norm no",
                    thermo="thermo_style custom step pe f_bonds c_sum[1] c_sum[5]\nthermo_modify norm no format float %.17g", run="run 0")).ok()
    table = run.thermo()
    assert table["f_bonds"][0] == 24 and table["c_sum[1]"][0] == 48 and table["c_sum[5]"][0] == 0
    assert table["PotEng"][0] == pytest.approx(24 * law.energy(0.0102 * 1.01, 0.0102, law.TABLE1, 0.012), rel=1e-9)


def test_density_of_discs_is_not_compared_with_that_of_a_solid(lmp):
    """LAMMPS takes the volume of a disc for their mass."""
    row = "pair_coeff * * 80 8 4 3 8 4 0.005 0 1.2 density 2700"
    discs = PLANE.replace("set group all density", "set group all density/disc")
    run = lmp(sheet(box=discs, coeff=row, move="fix flat all enforce2d\nfix move all nve/sphere disc", then="run 1")).ok()
    assert not [text for text in run.warnings() if "density" in text]
