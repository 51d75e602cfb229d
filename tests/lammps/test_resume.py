# SPDX-License-Identifier: GPL-2.0-only
"""A run goes on from a restart file, of its middle or of the moment where it was killed, to the last bit. On other ranks: test_matrix.py; files that
are cut: test_bad_input.py."""

import numpy as np
import pytest
from flowing import MOVE as MOVE_FLOWING
from flowing import flowing_pair
from small_bodies import MOVE, head, pair

TOTAL, EVERY = 1200, 370  # steps of the run, and from one restart file to the next, for which LAMMPS builds its lists
# gentle enough for thousands of steps: an oscillation into the second regime and back, without a drift
SWING = "velocity all ramp vx -20 20 x 0 0.06\n"
# flows both ways and breaks bonds all the way
FLOWING_SWING = """
variable ax atom 30*sin(1.3*id)
variable ay atom 30*cos(2.7*id)
variable az atom 30*sin(3.9*id)
velocity all set v_ax v_ay v_az
velocity all zero linear
velocity all ramp vx -60 60 x 0 0.06 sum yes
"""
BONDS, VOLUME = "fix bonds all evp/bonds\n", "fix volume all evp/volume 500\n"
# what is left of a bond of spheres that overlap repels from the next forces on, which after a restart are those of the set-up: no contacts
SCENES = {"eq. 8": (pair() + SWING, BONDS, MOVE), "flow": (flowing_pair("none", 0.05, fix=BONDS.strip() + " zone 1.4") + FLOWING_SWING, BONDS + VOLUME, MOVE_FLOWING)}


@pytest.mark.parametrize("name, ranks", [("eq. 8", 1), ("flow", 2)])
def test_runs_resume_to_the_last_bit(lmp, lmp_decks, tmp_path, bar, name, ranks):
    """Without sorting of atoms and on the same ranks the restart file holds every bit: thermo table, last state and bond file are the same."""
    start, fixes, move = SCENES[name]
    last = f"restart {EVERY} part.*\nrun {TOTAL} upto\nwrite_dump all custom end.dump id x y z vx vy vz fx fy fz modify format float %.17g\nwrite_evp_bonds end.bonds\n"
    whole = lmp(head(sort="sort 0 0") + start + move + last, ranks).ok()
    table, expected = whole.thermo(), whole.dump("end.dump")[-1]
    assert np.ptp(table["f_bonds[5]" if name == "flow" else "f_bonds[1]"]) > 0 and table["f_bonds[2]"].max() > 20, "control: bonds change"
    decks = {step: head(start=f"read_restart part.{step}", sort="sort 0 0") + fixes + move + last for step in range(EVERY, TOTAL, EVERY)}
    for step, run in lmp_decks(decks, ranks).items():
        assert "recorded" not in run.stdout
        again, end = run.thermo(), run.dump("end.dump")[-1]
        assert again["Step"][0] == step
        for column, values in again.items():
            assert np.array_equal(values, table[column][-len(values):]), (step, column)
        assert all(np.array_equal(end[column], values) for column, values in expected.columns.items()), step
        ours, theirs = ((folder / "end.bonds").read_text(encoding="utf-8").splitlines() for folder in (run.folder, tmp_path))
        assert sorted(ours) == sorted(theirs), step
