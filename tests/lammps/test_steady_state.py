# SPDX-License-Identifier: GPL-2.0-only
"""Neither steps nor neighbor builds allocate memory once the arrays have their size (atoms that change process may: their
records are made anew there)."""

import pytest
from lammps_run import LMP, run_lammps

COUNTER = LMP.parent / "unit" / "count_allocations.so"  # tests/lammps/count_allocations.cpp
DECK = """
units lj
atom_style sphere
atom_modify map array
lattice fcc 1.4142135623730951
region box block 0 5 0 5 0 5
create_box 1 box
create_atoms 1 box
set group all diameter 1 density 1
neighbor 0.06 bin
neigh_modify every {every} delay 0 check no
{styles}
velocity all create 1e-6 4321
velocity all set {drift} 0 0 sum yes
fix move all {move}
timestep 1e-3
thermo 1000000
run 100
run {steps}
"""
STARTING = 40  # starts of LAMMPS differ by some, those of MPI's own threads
OURS = "pair_style evp/lj contact {contact}\npair_coeff * * 80 8 4 3 8 4 0.005 {gamma} 1.5\nfix bonds all evp/bonds\n"
OTHERS = "pair_style lj/cut 1.5\npair_coeff * * 1 1\n"


@pytest.fixture()
def allocations(tmp_path, monkeypatch):
    """Counts those of a whole run."""
    assert COUNTER.is_file(), f"no {COUNTER}: build the tests"

    def count(styles, steps, every=1, move="nve"):
        # the launcher in between is a program of its own, whose number LAMMPS' replaces
        with monkeypatch.context() as preloaded:
            preloaded.setenv("LD_PRELOAD", str(COUNTER))
            preloaded.setenv("EVP_COUNT_ALLOCATIONS", str(tmp_path / "allocations.txt"))
            run_lammps(DECK.format(styles=styles, steps=steps, every=every, move=move, drift=2 if every == 1 else 0), 1, {}, tmp_path).ok()
        return int((tmp_path / "allocations.txt").read_text())

    return count


@pytest.mark.parametrize("every", [1, 1000000], ids=["with builds", "without"])
def test_steps_allocate_nothing(allocations, every):
    """400 more steps of a body that drifts through the box. With each build LAMMPS lists the fixes whose data
    may grow: one allocation of its own."""

    def of_400_steps(styles, move):
        few, many = (allocations(styles, steps, every, move) for steps in (200, 600))
        return many - few

    others = of_400_steps(OTHERS, "nve")
    for contact, gamma, move in (("none", 0, "nve"), ("literal", 0.1, "nve"), ("literal", 0.1, "nve/evp")):
        own = of_400_steps(OURS.format(contact=contact, gamma=gamma), move)
        assert own - others <= (400 if every == 1 else 0) + STARTING, (contact, move)


def test_the_counter_counts(allocations):
    """Control: a compute made and taken away at each of 100 more steps."""
    styles = OTHERS + 'run {n} every 1 "compute c all pe" "uncompute c"\n'
    few, many = (allocations(styles.format(n=n), 1) for n in (10, 110))
    assert many - few >= 100
