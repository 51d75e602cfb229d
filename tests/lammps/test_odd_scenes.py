# SPDX-License-Identifier: GPL-2.0-only
"""Scenes at the edge of what users set up: one giant among small spheres, sub-styles with weights of their own, radii
that are sent at every step, velocities that overflow the implicit solve."""

import itertools
import math
import re

import numpy as np
import pytest
from lammps_run import write_data
from test_lifetimes import HEAD, SOLVE, STYLE, error_of

UNDAMPED = STYLE.format(alpha=1.5).replace("1000", "0")
GIANT = 0.08  # radius [m], of a sphere that touches all around it
SMALL = 0.005


def giant_body(path):
    """Spheres of 5 mm on a square lattice within 30 mm of the surface of one of 80 mm; IDs as written."""
    grid = 2.0 * SMALL * np.array(list(itertools.product(range(-12, 13), repeat=3)), dtype=float)
    away = np.linalg.norm(grid, axis=1)
    small = grid[(away > GIANT) & (away < GIANT + 0.03)]
    x = np.concatenate([np.zeros((1, 3)), small])
    radius = np.r_[GIANT, np.full(len(small), SMALL)]
    write_data(path, x, radius, np.array([[-0.2, 0.2]] * 3))
    return x, radius


GIANT_DECK = """
units si
atom_style sphere
atom_modify map yes
boundary f f f
{start}
neighbor 0.001 bin
neigh_modify one 20000 page 400000
comm_modify cutoff 0.25
pair_style evp/lj contact none
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.3
fix bonds all evp/bonds zone 1.3
fix integrate all nve
timestep 1e-7
thermo_style custom step pe ke f_bonds
thermo_modify norm no format float %.17g
{run}
"""


@pytest.mark.parametrize("ranks", [1, 4])
def test_a_giant_costs_memory_of_its_own_only(lmp, tmp_path, ranks):
    """One atom with thousands of partners: the others keep room for theirs, restart and migration carry its own."""
    x, radius = giant_body(tmp_path / "giant.data")
    distance = np.linalg.norm(x[1:], axis=1)
    partners = int(np.sum(distance <= 1.3 * (GIANT + SMALL)))
    assert partners > 3000, "control: a row for every atom as long as the giant's would be counted in hundreds of MB"
    deck = GIANT_DECK.format(start="read_data giant.data", run="run 0\ninfo memory\nwrite_restart half.restart\nvelocity all set 0 300 0\nrun 20")
    run = lmp(deck, ranks=ranks).ok()
    memory = [float(words[2]) for words in re.findall(r"\(min/avg/max\) = (\S+) \| (\S+) \| (\S+) Mbytes", run.stdout)]
    rows = len(x) / ranks * partners * 16 / 2**20
    assert max(memory) < rows, f"{memory} MB in all, rows of one length would take {rows:.0f} MB"
    again = lmp(GIANT_DECK.format(start="read_restart half.restart", run="velocity all set 0 300 0\nrun 20"), ranks=ranks).ok()
    sorted_run = lmp(deck.replace("map yes", "map yes sort 1 0.02").replace("run 20", "run 400"), ranks=ranks).ok()
    memory = [float(words[2]) for words in re.findall(r"\(min/avg/max\) = (\S+) \| (\S+) \| (\S+) Mbytes", sorted_run.stdout)]
    assert max(memory) < rows, f"{memory} MB after sorting, where places that the giant held would keep its room"
    for column in ("PotEng", "f_bonds"):
        assert again.thermo()[column][-1] == pytest.approx(run.thermo()[column][-1], rel=1e-10), column


def test_weights_of_a_sub_style_are_seen(lmp):
    """pair_modify pair ... special changes special_bonds for one sub-style; what it sets is checked, not the global ones."""
    hybrid = HEAD + "pair_style hybrid/overlay evp/lj lj/cut 0.01\npair_coeff * * evp/lj 80 8 4 3 8 4 0.005 0 1.5\n"
    hybrid += "pair_coeff * * lj/cut 0 0.01\nfix bonds all evp/bonds\nfix integrate all nve\n"
    hybrid += "special_bonds lj 0 0.25 1\n"
    weights = "pair_modify pair evp/lj special lj 0.0 {} 1.0\nrun 1\n"
    assert "special_bonds weights 0 or 1 only, got 0.5" in error_of(lmp(hybrid + weights.format(0.5)))
    assert "special_bonds weights 0 or 1 only, got 0.25" in error_of(lmp(hybrid + "run 1\n"))
    lmp(hybrid + weights.format(1.0)).ok()


def test_scaled_hybrids_are_refused(lmp):
    deck = HEAD + "variable half equal 0.5\npair_style hybrid/scaled v_half evp/lj\n"
    deck += "pair_coeff * * evp/lj 80 8 4 3 8 4 0.005 0 1.5\nfix bonds all evp/bonds\nfix integrate all nve\nrun 1\n"
    assert "does not work in pair_style hybrid/scaled" in error_of(lmp(deck))


def test_radii_that_are_sent_at_every_step_cost_no_packing(lmp):
    """atom_style sphere 1 may change radii at any step; where none does the run is that of atom_style sphere, bit by
    bit, and where one does it counts at once."""
    body = "set group all diameter 0.0056\n" + UNDAMPED.replace("none", "literal") + "fix integrate all nve\n"
    run = "thermo 5\nrun 20\n"
    grow = "variable size equal 0.0056-1e-7*step\nfix shrink all adapt 1 atom diameter v_size\n"
    plain = lmp(HEAD + body + run).ok().thermo()["PotEng"]
    sent = lmp(HEAD.replace("atom_style sphere", "atom_style sphere 1") + body + run).ok().thermo()["PotEng"]
    assert list(plain) == list(sent)
    small = lmp(HEAD.replace("atom_style sphere", "atom_style sphere 1") + body + grow + run).ok().thermo()["PotEng"]
    steps = lmp(HEAD.replace("atom_style sphere", "atom_style sphere 1").replace("check yes", "check no") + body + grow + run).ok()
    assert small[-1] != pytest.approx(plain[-1], rel=1e-6), "control: the radii matter"
    assert small[-1] == pytest.approx(steps.thermo()["PotEng"][-1], rel=1e-12), "as with a list built at every step"


def test_an_overflow_in_the_implicit_solve_says_so(lmp):
    deck = HEAD + STYLE.format(alpha=1.5) + SOLVE + "set atom 7 vx 1e200\nset atom 9 vx -1e200\nrun 1\n"
    text = error_of(lmp(deck))
    assert "non-finite (NaN or Inf) velocities or forces at step 0 with timestep 1e-06" in text
    assert "did not converge" not in text


def test_dt_evp_under_rerun_leaves_energies_alone(lmp):
    """Rerun moves nothing, so a fix that sets the step may not change what the snapshots hold."""
    body = HEAD + UNDAMPED
    lmp(body + "fix bonds all evp/bonds\nfix integrate all nve\nrun 0\nwrite_evp_bonds all.bonds\n"
        "dump all all custom 10 all.dump id x y z vx vy vz\ndump_modify all format float %.17g\nrun 40\n").ok()
    again = "fix bonds all evp/bonds file all.bonds\n{}thermo 1\nrerun all.dump dump x y z vx vy vz\n"
    plain = lmp(body + again.format("")).ok().thermo()
    with_fix = lmp(body + again.format("fix step all dt/evp 1 0.4\n")).ok().thermo()
    assert len(plain["PotEng"]) == 5 and not any(map(math.isnan, plain["PotEng"]))
    for column in ("PotEng", "KinEng"):
        assert list(plain[column]) == list(with_fix[column]), column
