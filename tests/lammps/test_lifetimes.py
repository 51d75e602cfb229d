# SPDX-License-Identifier: GPL-2.0-only
"""Styles that come, go and change between runs: nothing may read what is no longer there.

Each case was once a stale pointer, a stale list or a check that never fired."""

import re

import pytest
from common_bodies import REFERENCE
from small_bodies import head, thermo

HEAD = head(boundary="s s s", start=f"read_data {REFERENCE}", skin=0.0003) + """
velocity all ramp vx -0.2 0.2 x 0 0.05
timestep 1e-6
""" + thermo("pe ke")
STYLE = """
pair_style evp/lj contact none
pair_coeff * * 80 8 4 3 8 4 0.005 1000 {alpha}
"""
SOLVE = """
fix bonds all evp/bonds zone 1.5
fix integrate all nve/evp tol 1e-12
"""


def error_of(run):
    """The text of LAMMPS' error, on one line; the run must have stopped by it, not by a signal."""
    assert run.returncode == 1, run.stdout[-2000:]
    return re.sub(r"\s+", " ", run.stdout[run.stdout.index("ERROR") :])


def test_a_new_pair_style_gets_a_new_warm_start(lmp):
    """fix nve/evp keeps damper forces by index in the pair's list: another pair object has another list, even where
    both were packed as often. Control: a run that never had the first pair style."""
    wide = STYLE.format(alpha=2.5)
    changed = HEAD + STYLE.format(alpha=1.5) + SOLVE + "run 0\npair_style none" + wide + "run 3\n"
    fresh = HEAD + wide + SOLVE + "run 0\nrun 3\n"
    ends = [lmp(deck).ok().thermo() for deck in (changed, fresh)]
    for column in ("PotEng", "KinEng"):
        assert ends[0][column][-1] == pytest.approx(ends[1][column][-1], rel=1e-9), column
    assert ends[0]["KinEng"][-1] != ends[0]["KinEng"][0], "control: the body moves"


def test_a_compute_of_the_pairs_does_not_outlive_the_pair_style(lmp):
    deck = HEAD + STYLE.format(alpha=1.5) + "fix bonds all evp/bonds\nfix integrate all nve\n"
    deck += "compute state all evp/state/atom\nthermo_style custom step pe\nrun 0\n"
    deck += "pair_style lj/cut 0.01\npair_coeff * * 1 1 0.01\n"
    run = lmp(deck + "write_dump all custom state.dump id c_state[1]\n")
    assert "Compute state evp/state/atom needs the pairs of the current positions" in error_of(run)


def test_forces_that_are_not_numbers_stop_the_run(lmp):
    """Velocities of 1e307 m/s make the damping infinite; the stop names step, timestep and restart file."""
    deck = HEAD + STYLE.format(alpha=1.5) + "fix bonds all evp/bonds\nfix integrate all nve\n"
    deck += "set atom 7 vx 1e307\nset atom 9 vx -1e307\nset atom 300 vx 1e307\nthermo_style custom step press\n"
    text = error_of(lmp(deck + "run 0\n"))
    assert "non-finite forces (NaN or Inf) at step 0" in text
    assert "last restart file: none" in text


def test_pair_modify_compute_no_is_refused(lmp):
    """Without compute() the pairs that fixes read are those of an earlier list."""
    deck = HEAD + STYLE.format(alpha=1.5) + SOLVE + "run 2\ngroup late id > 20\ndelete_atoms group late compress no\n"
    assert "has not seen the current neighbor list" in error_of(lmp(deck + "pair_modify compute no\nrun 2\n"))


def test_two_dimensions(lmp):
    """A 2-D box is one thin slab that is periodic along z without images there. Square lattice, both shells within
    1.5 d: 8 partners each."""
    run = lmp(
        """
units lj
dimension 2
atom_style sphere
atom_modify map yes
lattice sq 1.0
region box block 0 6 0 6 -0.5 0.5
create_box 1 box
create_atoms 1 box
set type 1 diameter 1.0
neighbor 0.2 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.5
fix bonds all evp/bonds
fix integrate all nve
fix plane all enforce2d
thermo_style custom step pe f_bonds
run 2
"""
    ).ok()
    assert run.thermo()["f_bonds"][-1] == 36 * 8 / 2
