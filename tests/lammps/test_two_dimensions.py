# SPDX-License-Identifier: GPL-2.0-only
"""The law of a pair is the same in 'dimension 2'; what counts on a solid of three dimensions is refused there."""

import pytest
from evp import law
from hostile import ROW, SECONDS, refused, scene

BOX = """dimension 2
boundary p p p
lattice sq 0.0102
region box block 0 4 0 3 -0.5 0.5
create_box 1 box
create_atoms 1 box
set group all diameter 0.01
set group all density 2700"""


def sheet(**parts):
    return scene(**{"box": BOX, "move": "fix flat all enforce2d\nfix move all nve", "coeff": "pair_coeff * * 80 8 4 3 8 4 0.005 0 1.2", **parts})


def test_forces_of_the_pair_style_and_plastic_work(lmp):
    """A square lattice recorded at rest and stretched by 1 %: two bonds of an atom."""
    run = lmp(sheet(then="run 0\nchange_box all x scale 1.01 y scale 1.01 remap\ncompute work all evp/state/atom plastic_work\n"
                    "compute sum all reduce sum c_work[*]\nthermo_modify norm no",
                    thermo="thermo_style custom step pe f_bonds c_sum[1] c_sum[5]\nthermo_modify norm no format float %.17g", run="run 0"), seconds=SECONDS).ok()
    table = run.thermo()
    assert table["f_bonds"][0] == 24 and table["c_sum[1]"][0] == 48 and table["c_sum[5]"][0] == 0
    assert table["PotEng"][0] == pytest.approx(24 * law.energy(0.0102 * 1.01, 0.0102, law.TABLE1, 0.012), rel=1e-9)


FORCE = "'dimension 2' is in force: use 'dimension 3', or "
REFUSED = {
    "volume energy": ({"then": "fix volume all evp/volume 300"}, "Fix volume evp/volume: the volume strain holds for three-dimensional bodies, but " + FORCE + "leave the fix out"),
    "scaled row": ({"coeff": f"pair_coeff * * {ROW} spacing 0.0102 coordination 4"},
                   "Pair evp/lj: the scaling of a row by 'spacing' and 'coordination' holds for three-dimensional bodies, but " + FORCE + "give the 9 numbers"),
    **{value: ({"then": f"compute state all evp/state/atom plastic_work {value} fraction 0.6"},
               f"evp/state/atom: {value} holds for three-dimensional bodies, but " + FORCE + "leave the value out")
       for value in ("plastic_strain", "volume_strain", "von_mises", "triaxiality")},
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_counts_on_three_dimensions(lmp, name):
    parts, text = REFUSED[name]
    refused(lmp(sheet(**parts), seconds=SECONDS), text)


def test_density_of_discs_is_not_compared_with_that_of_a_solid(lmp):
    """LAMMPS takes the volume of a disc for their mass."""
    row = "pair_coeff * * 80 8 4 3 8 4 0.005 0 1.2 density 2700"
    discs = BOX.replace("set group all density", "set group all density/disc")
    run = lmp(sheet(box=discs, coeff=row, move="fix flat all enforce2d\nfix move all nve/sphere disc", then="run 1"), seconds=SECONDS).ok()
    assert not [text for text in run.warnings() if "density" in text]
