# SPDX-License-Identifier: GPL-2.0-only
"""Scenes that once went wrong without a word: pairs lost, forces that depend on the number of ranks, steps without bound."""

import pytest
from test_lifetimes import error_of

TWO_PAIRS = """
units si
atom_style sphere {radii}
atom_modify map yes
boundary f f f
region box block 0 0.08 0 0.04 0 0.04
create_box 2 box
create_atoms 1 single 0.01 0.01 0.01
create_atoms 1 single 0.0199 0.01 0.01
create_atoms 2 single 0.06 0.01 0.01
create_atoms 2 single 0.0699 0.01 0.01
set group all diameter 0.01
set group all density 2700
neighbor 0.0006 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.5
group A type 1
group B type 2
fix bonds all evp/bonds
fix move all nve
timestep 1e-9
thermo 1
thermo_modify norm no format float %.15g
"""


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("lists", ["neighbor 0.1 multi\nneigh_modify collection/interval 2 1.0 2.0\ncomm_modify mode multi", "neighbor 0.1 multi"])
def test_lists_by_size_hold_all_pairs(lmp, ranks, lists):
    """LAMMPS sorts particles of very different size into lists of their own; the cut-offs are those of the types."""
    deck = """
units lj
atom_style sphere
atom_modify map yes
boundary p p p
lattice fcc 1.0
region box block 0 6 0 6 0 6
create_box 1 box
create_atoms 1 box
set group all diameter 0.9
neighbor 0.1 bin
{lists}
pair_style evp/lj contact none
pair_coeff * * 1 8 4 0.1 8 4 0.005 0 2.0
fix bonds all evp/bonds
fix move all nve
velocity all set 1 2 3
timestep 1e-3
thermo_style custom step pe f_bonds
thermo_modify norm no
run 10
"""
    plain, multi = (lmp(deck.format(lists=text), ranks=ranks) for text in ("", lists))
    plain, multi = plain.ok().thermo(), multi.ok().thermo()
    assert plain["f_bonds"][-1] > 1000
    assert multi["f_bonds"][-1] == plain["f_bonds"][-1]
    assert multi["PotEng"][-1] == pytest.approx(plain["PotEng"][-1], rel=1e-12)


def test_radii_that_change_on_one_rank_only(lmp):
    """Only the rank whose radii changed packs its pairs again, so that packing may not wait for the others."""
    text = TWO_PAIRS.format(radii=1) + "variable d equal 0.01-1e-7*step\nfix shrink A adapt 1 atom diameter v_d\nthermo_style custom step pe\nrun 5\n"
    one = lmp(text.replace("fix bonds all evp/bonds\n", "")).ok().thermo()["PotEng"]
    two = lmp("processors 2 1 1\n" + text.replace("fix bonds all evp/bonds\n", ""), ranks=2).ok().thermo()["PotEng"]
    assert len(set(one)) == 6, "control: every step has other radii"
    assert two == pytest.approx(one, rel=1e-12)


@pytest.mark.parametrize("ranks", [1, 2])
def test_atoms_that_come_beside_the_implicit_group_are_damped(lmp, ranks):
    """At set-up all atoms are in the group of fix nve/evp; those that come later are not, and are damped explicitly."""
    deck = """
units lj
atom_style sphere
atom_modify map yes
boundary f f f
comm_modify vel {vel}
region box block 0 20 0 10 0 10
create_box 1 box
create_atoms 1 single 2 2 2
create_atoms 1 single 3 2 2
set group all diameter 1
set group all density 1
neighbor 0.3 bin
neigh_modify every 1 delay 0 check yes
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
    deck = ("processors 2 1 1\n" if ranks > 1 else "") + deck
    run, sent = (lmp(deck.format(vel=vel), ranks=ranks).ok().thermo() for vel in ("no", "yes"))
    assert list(run["c_most"]) == list(sent["c_most"])
    assert run["Atoms"][-1] == 4
    assert run["c_most"][-1] == pytest.approx(lmp(deck.format(vel="no").replace("processors 2 1 1", "")).ok().thermo()["c_most"][-1], rel=1e-9)
    assert run["c_most"][-1] > 50.0, "control: the damping of the pair that met"


def test_step_without_bound_is_refused_in_flight_too(lmp):
    """Two spheres part; once nothing interacts the step may not grow for ever."""
    text = TWO_PAIRS.format(radii=0).replace("pair_style evp/lj", "pair_style evp/lj contact none").replace("boundary f f f", "boundary m m m")
    text += "velocity A set -1000 0 0\nvelocity B set 1000 0 0\ngroup inner id 2 3\nvelocity inner set 0 0 0\nfix step all dt/evp 1 0.4{max}\nrun 3000\n"
    assert "no pair interacts or approaches another" in error_of(lmp(text.format(max="")))
    lmp(text.format(max=" max 1e-7")).ok()


@pytest.mark.parametrize("other", ["fix b B dt/evp 10 0.4", "fix b all dt/reset 10 1e-9 1e-7 1e-5"])
def test_two_fixes_that_set_the_step(lmp, other):
    text = TWO_PAIRS.format(radii=0) + "fix a A dt/evp 10 0.4\n" + other + "\nrun 1\n"
    assert "sets the timestep too" in error_of(lmp(text))


def test_bonds_that_a_hybrid_forgot(lmp):
    """pair_style hybrid, given again after read_restart, drops what its sub-style had read; the fix tells."""
    style = "pair_style hybrid evp/lj lj/cut 0.01\n"
    coeff = "pair_coeff 1 1 evp/lj 80 8 4 3 8 4 0.005 0 1.5\npair_coeff 2 2 evp/lj 80 8 4 3 8 4 0.005 0 1.5\npair_coeff 1 2 lj/cut 1e-5 0.005\n"
    text = TWO_PAIRS.format(radii=0)
    text = text.replace("pair_style evp/lj\npair_coeff * * 80 8 4 3 8 4 0.005 0 1.5\n", style + coeff)
    lmp(text + "run 0\nset atom 2 x 0.02\nrun 0\nwrite_restart half.restart\n").ok()
    again = "read_restart half.restart\nneighbor 0.0006 bin\n{style}" + coeff + "fix {id} all evp/bonds\nfix move all nve\nvariable f equal fx[1]\nthermo_style custom step v_f\nrun 0\n"
    right = lmp(again.format(style="", id="bonds")).ok()
    assert "takes the current shape of the body as undeformed" not in right.stdout and right.thermo()["v_f"][0] != 0.0
    assert "the bonds were recorded by fix bonds" in error_of(lmp(again.format(style="", id="other")))
    anew = lmp(again.format(style=style, id="other")).ok()
    assert "takes the current shape of the body as undeformed" in anew.stdout and anew.thermo()["v_f"][0] == 0.0


@pytest.mark.parametrize("ranks", [1, 2])
def test_single_has_no_damping_after_a_minimisation(lmp, ranks):
    """After a minimisation nobody sent any: the pair's force is then without damping, on any number of ranks."""
    text = TWO_PAIRS.format(radii=0).replace("0.005 0 1.5", "0.005 1000 1.5").replace("fix move all nve\n", "")
    if ranks > 1:
        text = "processors 2 1 1\n" + text.replace("single 0.01 ", "single 0.036 ").replace("single 0.0199 ", "single 0.0459 ")
    text += "set atom 2 vx 5\ncompute own all pair/local dist force\nminimize 0 0 1 1\nwrite_dump all local own.dump c_own[1] c_own[2]\n"
    run = lmp(text, ranks=ranks).ok()
    rows = [line.split() for line in (run.folder / "own.dump").read_text().splitlines() if line[:1] == "0"]
    forces = [abs(float(row[1])) for row in rows if len(row) == 2 and float(row[0]) < 0.011 and float(row[0]) > 0.005]
    assert forces and max(forces) < 1e-3, forces


IN_A_ROW = """
units si
atom_style sphere
atom_modify map yes
boundary {boundary}
region box block 0 0.08 0 0.04 0 0.04
create_box 2 box
create_atoms 1 single 0.01 0.01 0.01
create_atoms 1 single 0.0199 0.01 0.01
create_atoms 2 single 0.0299 0.01 0.01
create_atoms 2 single 0.0398 0.01 0.01
set group all diameter 0.01
set group all density 2700
{more}
neighbor 0.0006 bin
pair_style hybrid evp/lj lj/cut 0.02
{coeff}
fix bonds all evp/bonds
fix move all nve
timestep 1e-9
thermo_style custom step pe f_bonds f_bonds[1]
thermo_modify norm no format float %.15g
run 1
"""


def test_pairs_of_types_that_a_hybrid_takes_away(lmp):
    """pair_coeff * * evp/lj and then 1 2 lj/cut is the deck that names 1 1 and 2 2: nothing of types 1 and 2 is recorded."""
    row = "evp/lj 80 8 4 3 8 4 0.005 0 1.5\n"
    named = lmp(IN_A_ROW.format(boundary="f f f", more="", coeff=f"pair_coeff 1 1 {row}pair_coeff 2 2 {row}pair_coeff 1 2 lj/cut 1e-5 0.005")).ok()
    taken = lmp(IN_A_ROW.format(boundary="f f f", more="", coeff=f"pair_coeff * * {row}pair_coeff 1 2 lj/cut 1e-5 0.005")).ok()
    assert named.thermo()["f_bonds"][-1] == 2 and named.thermo()["f_bonds[1]"][-1] == 0
    for column in ("f_bonds", "f_bonds[1]", "PotEng"):
        assert list(taken.thermo()[column]) == list(named.thermo()[column]), column


def test_types_that_a_hybrid_takes_away_need_no_radius_nor_box(lmp):
    """What evp/lj does not serve it does not judge: a point without radius, a box that is short for lj/cut's types only."""
    coeff = "pair_coeff * * evp/lj 80 8 4 3 8 4 0.005 0 1.5\npair_coeff * 2 lj/cut 1e-5 0.005"
    lmp(IN_A_ROW.format(boundary="f f f", more="set type 2 diameter 0\nset type 2 mass 1", coeff=coeff)).ok()
    lmp(IN_A_ROW.format(boundary="p f f", more="set type 2 diameter 0.05", coeff=coeff)).ok()
    served = coeff.replace("pair_coeff * 2 lj/cut 1e-5 0.005", "pair_coeff 1 2 lj/cut 1e-5 0.005")
    text = error_of(lmp(IN_A_ROW.format(boundary="f f f", more="set type 2 diameter 0\nset type 2 mass 1", coeff=served)))
    assert "needs particles with a radius above zero, and finite, found 0" in text


@pytest.mark.parametrize("more, steps", [("", 30), ("displacement 0.1", 2000)])
def test_step_without_bound_waits_for_pairs_that_approach(lmp, more, steps):
    """A pair that crosses the skin is on its way, though it cannot meet before the next check."""
    text = TWO_PAIRS.format(radii=0).replace("single 0.0699 ", "single 0.0753 ").replace("single 0.0199 ", "single 0.0253 ")
    text += "set atom 1 vx 10\nset atom 3 vx 10\nfix step all dt/evp 1 0.4 " + more + f"\nthermo_style custom step dt pe\nrun {steps}\n"
    assert min(lmp(text).ok().thermo()["PotEng"]) < -1.0, "they met"


def test_a_restart_without_records_needs_no_warning(lmp):
    """Written before anything was recorded, taken up under the same ID: that fix records now, as it would have."""
    text = TWO_PAIRS.format(radii=0)
    lmp(text + "write_restart before.restart\n").ok()
    after = lmp("read_restart before.restart\nneighbor 0.0006 bin\nfix bonds all evp/bonds\nfix move all nve\nrun 0\n").ok()
    assert "takes the current shape of the body as undeformed" not in after.stdout


def test_counts_between_runs_are_not_those_of_other_atoms(lmp):
    """One atom goes, another comes: as many as before, but the pairs of the last step are not theirs."""
    text = TWO_PAIRS.format(radii=0) + "thermo_style custom step f_bonds f_bonds[1] f_bonds[4]\nrun 0\nprint 'then $(f_bonds[1])'\n"
    text += "group last id 4\ndelete_atoms group last compress no\ncreate_atoms 2 single 0.0765 0.03 0.03\nprint 'now $(f_bonds[1]) $(f_bonds[4])'\n"
    run = lmp(text)
    assert "f_bonds[1] needs the pairs of the current atoms: use 'run 0' first" in error_of(run) and "then 0" in run.stdout
