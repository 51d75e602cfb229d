# SPDX-License-Identifier: GPL-2.0-only
"""memory_usage() tells what was allocated; neither steps nor neighbor builds allocate memory once the arrays have their size; quiet steps ask no other rank."""

import re

import numpy as np
import pytest
from lammps_run import LMP, run_lammps, write_data
from small_bodies import head

SIDE = 24  # 13824 atoms: arrays of MB, far above what comes and goes otherwise
SPACING = 0.01
EVP = "pair_style evp/lj\npair_coeff * * 80 8 4 3 8 4 0.005 0 1.5\n"
VARIANTS = {
    "no style of ours": "pair_style zero 0.0165\npair_coeff * *\n",
    "pair": EVP,
    "pair, bonds from a file": EVP + "fix bonds all evp/bonds file many.bonds\n",
    "pair, bonds from the zone": EVP + "fix bonds all evp/bonds\n",
}


def test_reported_memory_is_the_memory_that_was_handed_out(tmp_path):
    """Of each bond on both of its atoms, an ID and a double in 16 bytes, in rows of one length for all atoms."""
    rng = np.random.default_rng(5)
    grid = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = (grid + 0.5 + rng.uniform(-0.1, 0.1, grid.shape)) * SPACING
    write_data(tmp_path / "many.data", x, rng.uniform(0.0045, 0.0055, len(x)), np.array([[0.0, SIDE * SPACING]] * 3))
    found, bonds = {}, None
    for name in reversed(VARIANTS):  # the zone's comes first and writes the bond file
        after = "write_evp_bonds many.bonds" if "zone" in name else ""
        out = run_lammps(head(start="read_data many.data", skin=0.0006) + VARIANTS[name] + f"run 0\n{after}\ninfo memory\n", 1, None, tmp_path).ok().stdout
        reported = re.search(r"Per MPI rank memory allocation.* = ([0-9.]+) \|", out)
        handed_out = re.search(r"Current reserved memory pool size: ([0-9.e+]+) Mbyte", out)
        found[name] = np.array([float(match[1]) for match in (reported, handed_out)]) * 1048576.0
        written = re.search(r"write_evp_bonds: (\d+) bonds", out)
        bonds = int(written[1]) if written else bonds
    for name, than in (("pair", "no style of ours"), ("pair, bonds from a file", "pair"), ("pair, bonds from the zone", "pair")):
        reported, handed_out = found[name] - found[than]
        assert handed_out > 2 * 1048576.0  # far above the last digit of `info memory`
        assert reported == pytest.approx(handed_out, rel=0.1), name
    held = 2.0 * bonds * 16
    assert bonds > 7 * len(x) and held < (found["pair, bonds from a file"] - found["pair"])[0] < 3.0 * held


COUNTERS = LMP.parent / "unit"  # tests/lammps/count_*.cpp
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
def counted(tmp_path, monkeypatch):
    """Runs a deck on one rank and returns the number of allocations or collectives of the whole run."""

    def count(what, deck):
        counter = COUNTERS / f"count_{what}.so"
        assert counter.is_file(), f"no {counter}: build the tests"
        # the launcher in between is a program of its own, whose number LAMMPS' replaces
        with monkeypatch.context() as preloaded:
            preloaded.setenv("LD_PRELOAD", str(counter))
            preloaded.setenv(f"EVP_COUNT_{what.upper()}", str(tmp_path / "count.txt"))
            run_lammps(deck, 1, {}, tmp_path).ok()
        return int((tmp_path / "count.txt").read_text().split()[0])

    return count


@pytest.fixture()
def allocations(counted):
    """Counts those of a whole run."""
    return lambda styles, steps, every=1, move="nve": counted(
        "allocations", DECK.format(styles=styles, steps=steps, every=every, move=move, drift=2 if every == 1 else 0))


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


QUIET_STEPS = """units si
atom_style sphere
atom_modify map yes
lattice fcc 0.01
region box block 0 4 0 4 0 4
create_box 1 box
create_atoms 1 box
set group all diameter 0.00707 density 2700
neighbor 0.0005 bin
neigh_modify every 1000000 delay 0 check no
pair_style evp/lj contact join plasticity isotropic
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.5 flow 0 1 1 1.5 density 2700 damage 0.3 0 0 0 0 rupture 0
fix bonds all evp/bonds
fix volume all evp/volume 1000
fix energy all evp/energy
group few id 1:4
fix_modify bonds plastic_strain few 0.4
{more}
velocity all ramp vx -1 1 x 0 0.04
fix move all nve
timestep 2e-7
thermo 1000000
run {steps}
"""


def test_a_quiet_step_asks_no_other_rank(counted):
    """No reduction over the ranks in 200 more steps in which no bond ends or begins, though spheres have failed: bonds end, join, volume, energy balance, limits.
    Control: one in each step of a fix that asks."""
    def more(lines):
        few, many = (counted("collectives", QUIET_STEPS.format(more=lines, steps=steps)) for steps in (100, 300))
        return many - few

    assert more("") == 0
    assert more("fix ask all ave/time 1 1 1 f_energy") == 200, "control"
