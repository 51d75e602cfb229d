# SPDX-License-Identifier: GPL-2.0-only
"""A box that moves its atoms after the forces of a step: what is counted then is that of the atoms and ghosts as they are, on any
number of MPI ranks."""

import numpy as np
import pytest
from small_bodies import thermo

REGIONS = {"deform": "prism 0 5 0 5 0 5 0 0 0", "press/berendsen": "block 0 5 0 5 0 5"}
BOXES = ["deform 1 xz erate 1500 yz erate 1000 x erate 100 flip no remap x", "press/berendsen iso 0 -3e9 1e-4 modulus 1e10"]


def deck(box, style, more, columns, then=""):
    return f"""
units si
atom_style sphere
atom_modify map yes
boundary p p p
lattice fcc 0.01
region cube {REGIONS[box.split()[0]]}
create_box 1 cube
create_atoms 1 box
displace_atoms all random 2e-4 2e-4 2e-4 77
set group all diameter 0.00707
set group all density 2700
neighbor 0.0005 bin
pair_style evp/lj {style}
pair_coeff * * 80 8 4 3 8 4 0.005 100 1.5
fix bonds all evp/bonds zone 1.2
fix box all {box}
fix move all nve/evp
timestep 1e-6
{more}
thermo 40
{thermo(columns)}run 80
{then}
"""


@pytest.mark.parametrize("box", BOXES)
def test_counts_are_those_of_the_atoms_as_they_are(lmp, box):
    """As a run of no steps finds them, which places all ghosts anew."""
    text = deck(box, "contact repulsive plasticity isotropic break 0.05",
                "compute state all evp/state/atom\ncompute second all reduce ave c_state[2]",
                "f_bonds[1] f_bonds[2] f_bonds[4] c_second", "unfix box\nrun 0")
    one, two = lmp(text).ok(), lmp(text, ranks=2).ok()
    assert len(set(one.thermo(0)["f_bonds[4]"])) == 3
    for name in ("f_bonds[1]", "f_bonds[2]", "f_bonds[4]", "c_second"):
        assert one.thermo(0)[name][-1] == pytest.approx(one.thermo(1)[name][0], rel=1e-12)
        np.testing.assert_allclose(two.thermo(0)[name], one.thermo(0)[name], rtol=1e-12)


def test_the_energy_of_lost_bonds_does_not_depend_on_the_ranks(lmp):
    """Where fix deform comes first: the volume energy jumps as bonds pass their cutoffs."""
    text = deck("deform 1 x erate 3000 y erate 1000 flip no remap x", "contact none plasticity isotropic break 0.1",
                "fix volume all evp/volume 300\nfix energy all evp/energy", "f_energy[4] f_energy[11]")
    one, two = lmp(text).ok().thermo(), lmp(text, ranks=2).ok().thermo()
    assert one["f_energy[4]"][-1] > 1e3
    for name in ("f_energy[4]", "f_energy[11]"):
        np.testing.assert_allclose(two[name], one[name], rtol=1e-9)
