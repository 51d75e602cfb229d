# SPDX-License-Identifier: GPL-2.0-only
"""Groups, types and boxes without atoms at set-up: refused, or right once the atoms have come."""

import pytest
from test_lifetimes import error_of

BOX = """
units si
atom_style sphere
atom_modify map yes
boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 2 box
neighbor 0.0006 bin
neigh_modify every 1 delay 0 check no
timestep 1e-8
thermo 1
thermo_style custom step pe
"""
TWO = "create_atoms {0} single -0.005 0 0\ncreate_atoms {0} single 0.0045 0 0\nset group all diameter 0.01\nset group all density 2700\n"
ROW = "80 8 4 3 8 4 0.005 {gamma} 1.5\n"


def test_a_group_in_which_nothing_interacts_limits_no_step(lmp):
    """fix dt/evp of a lone atom has no bound to give, whatever others do; nor has a pair without stiffness."""
    lone = BOX + TWO.format(1) + "create_atoms 1 single 0.05 0 0\nset atom 3 diameter 0.01\nset atom 3 density 2700\ngroup lone id 3\n"
    lone += "pair_style evp/lj\npair_coeff * * " + ROW.format(gamma=0) + "fix move all nve\nfix step lone dt/evp 20 0.4\nrun 5\n"
    assert "no pair interacts or approaches another" in error_of(lmp(lone))
    soft = BOX + TWO.format(1) + "pair_style evp/lj\npair_coeff * * 0 8 4 0 8 4 0.005 0 1.5\nfix bonds all evp/bonds\nfix move all nve\nfix step all dt/evp 20 0.4\nrun 5\n"
    assert "no pair interacts or approaches another" in error_of(lmp(soft))


@pytest.mark.parametrize("ranks", [1, 2])
def test_radii_of_atoms_that_come_are_checked(lmp, ranks):
    """Cut-offs are set for the radii at set-up; a type without atoms then has a cut-off of zero, and says so when they come."""
    deck = BOX + TWO.format(2) + "pair_style hybrid/overlay evp/lj zero 0.0156\npair_coeff 1 1 evp/lj " + ROW.format(gamma=0)
    deck += "pair_coeff * * zero\nfix move all nve\nrun 2\nset group all type 1\n"
    assert "the cutoff was set for at most 0" in error_of(lmp(deck + "run 2 pre no\n", ranks=ranks))
    energy = lmp(deck + "run 2\n", ranks=ranks).ok().thermo(1)["PotEng"]
    assert energy[0] < -1.0, "with a set-up of its own the run sees them"


def test_rerun_into_an_empty_box_is_refused(lmp, tmp_path):
    """Rerun sets up before it adds atoms, so that their radii come too late."""
    atoms = "1 1 -0.0045 0 0\n2 1 0.005 0 0\n"
    (tmp_path / "two.dump").write_text("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n" + 3 * "-0.1 0.1\n"
                                       + "ITEM: ATOMS id type x y z\n" + atoms)
    deck = BOX + "pair_style evp/lj\npair_coeff * * " + ROW.format(gamma=0) + "rerun two.dump dump x y z add yes\n"
    assert "the cutoff was set for at most 0" in error_of(lmp(deck))


@pytest.mark.parametrize("ranks", [1, 2])
def test_atoms_of_another_style_beside_damped_ones(lmp, ranks):
    """All that evp/lj damps is in the group of fix nve/evp; atoms of lj/cut beside them are nobody's business."""
    deck = BOX + TWO.format(1) + "create_atoms 2 single 0.05 0.05 0\ncreate_atoms 2 single 0.06 0.05 0\nset type 2 diameter 0.01\nset type 2 density 2700\n"
    deck += "pair_style hybrid evp/lj lj/cut 0.015\npair_coeff 1 1 evp/lj " + ROW.format(gamma=1000) + "pair_coeff * 2 lj/cut 0.01 0.009\n"
    deck += "group ours type 1\ngroup theirs type 2\nfix 1 ours nve/evp\nfix 2 theirs nve\nrun 5\n"
    lmp(deck, ranks=ranks).ok()
    assert "evp/lj: damping on" in lmp(deck.replace("ours nve/evp", "ours nve"), ranks=ranks).ok().stdout
    crossed = deck.replace("pair_coeff * 2 lj/cut 0.01 0.009", "pair_coeff 1 2 evp/lj " + ROW.format(gamma=1000) + "pair_coeff 2 2 lj/cut 0.01 0.009")
    lmp(crossed.replace("theirs nve\n", "theirs nve/noforce\n"), ranks=ranks).ok()  # pairs across are damped by the fix of ours
    steps = deck.replace("run 5", "compute every all evp/dt\ncompute own ours evp/dt\nthermo_style custom step c_every c_own\nrun 5")
    table = lmp(steps, ranks=ranks).ok().thermo()
    assert table["c_every"][-1] == pytest.approx(table["c_own"][-1], rel=1e-3), "the implicit limit, as nobody else's atoms interact here"
