# SPDX-License-Identifier: GPL-2.0-only
"""Restart and data files: a run that was interrupted continues to the same numbers, or is refused.

The box is fixed: LAMMPS draws a shrink-wrapped one anew, a little smaller, when it reads a restart file, and with
its bins the order of sums changes."""

import numpy as np
import pytest
from common_bodies import REFERENCE
from lammps_run import write_data
from small_bodies import ANOTHER_ORDER, grips, head, pair, thermo

BONDS = pair(fix="fix bonds all evp/bonds zone 1.48")
PULL = grips(0.005, 0.045) + """
velocity all ramp vx -20 20 x 0.005 0.045
velocity left set -20 0 0
velocity right set 20 0 0
"""

MOTION = """
fix pull grips nve/noforce
fix move free nve
timestep 3e-7
thermo 20
""" + thermo("pe ke press f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[4]") + """
dump all all custom 50 {name}.dump id x y z vx vy vz fx fy fz
dump_modify all format float %.17g
"""


def start(newton="on", sort=""):
    """The reference specimen, recorded and about to be pulled."""
    return head(newton, start=f"read_data {REFERENCE}", sort=sort) + BONDS + PULL


def first_half(newton="on"):
    return start(newton) + MOTION.format(name="whole") + "run 100\nwrite_restart half.restart\nrun 100\n"


def second_half(newton="on", sort="", file="half.restart", name="rest", fix="fix bonds all evp/bonds"):
    return head(newton, start=f"read_restart {file}", sort=sort) + fix + "\n" + MOTION.format(name=name) + "run 100\n"


def compare(run, whole, name, exact):
    last, other = run.dump(f"{name}.dump")[-1], run.dump("whole.dump")[-1]
    assert last.step == other.step == 200
    for column in ("x", "y", "z", "vx", "vy", "vz", "fx", "fy", "fz"):
        scale = 0.0 if exact else ANOTHER_ORDER * np.abs(other[column]).max()
        assert np.all(np.abs(last[column] - other[column]) <= scale), column
    first, second = whole.thermo(-1), run.thermo(-1)
    for column, values in first.items():
        scale = 0.0 if exact else ANOTHER_ORDER * np.abs(values).max()
        assert np.all(np.abs(second[column] - values) <= scale), column
    assert first["f_bonds"][-1] > 2000
    assert first["f_bonds[3]"].max() > 0 and first["f_bonds[1]"].max() > 0 and first["f_bonds[2]"].max() > 0


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "on"), (4, "off")])
def test_same_ranks_continue_to_the_last_bit(lmp, ranks, newton):
    whole = lmp(first_half(newton), ranks=ranks).ok()
    rest = lmp(second_half(newton), ranks=ranks).ok()
    assert "recorded" not in rest.stdout, "the bonds come from the file"
    compare(rest, whole, "rest", exact=True)


@pytest.mark.parametrize("ranks, other", [(1, 4), (4, 1), (2, 4)])
def test_other_ranks_continue_to_the_same_numbers(lmp, ranks, other):
    whole = lmp(first_half(), ranks=ranks).ok()
    compare(lmp(second_half(), ranks=other).ok(), whole, "rest", exact=False)


@pytest.mark.parametrize("ranks", [1, 2])
def test_restart_files_of_a_run_do_not_disturb_it(lmp, ranks):
    """`restart N` in mid-run: the neighbor list is built at that step in both, so the numbers are the same bits once
    atoms are not sorted on the way."""
    text = start(sort="sort 0 0") + MOTION.format(name="whole") + "restart 100 auto.*\nrun 200\n"
    whole = lmp(text, ranks=ranks).ok()
    rest = lmp(second_half(sort="sort 0 0", file="auto.100").replace("run 100", "restart 100 auto.*\nrun 100"), ranks=ranks).ok()
    last, other = rest.dump("rest.dump")[-1], rest.dump("whole.dump")[-1]
    for column in ("x", "vx", "fx", "fy"):
        assert list(last[column]) == list(other[column]), column
    assert rest.thermo()["PotEng"][-1] == whole.thermo()["PotEng"][-1]


def test_coefficients_come_back_from_restart_and_data(lmp, tmp_path, reference):
    """Two types, three rows with exponents that are no integers; energies before and after are the same."""
    types = 1 + np.arange(500) % 2
    write_data(tmp_path / "two.data", reference.x, reference.radius, reference.box, types)
    rows = "\n".join(["pair_coeff 1 1 80.1 8 4 3 7.53 3.21 0.00512345678901 0 1.45",
                      "pair_coeff 1 2 70.7 8.5 4 3.3 8 4 0.006 12.5 1.5", "pair_coeff 2 2 60 6 3 3 8 4 0.005 0 1.4"])
    setup = head(start="read_data two.data") + "pair_style evp/lj contact repulsive overlap 0.45\n" + rows
    show = "\n" + thermo("pe") + "run 0\n"
    first = lmp(setup + "\n" + show + "write_restart two.restart\nwrite_data all.data pair ij\n").ok()
    energy = first.thermo()["PotEng"][0]
    assert abs(energy) > 0.1

    again = lmp(head(start="read_restart two.restart") + show).ok()
    assert again.thermo()["PotEng"][0] == energy
    assert "contact repulsive" in again.stdout and "overlap warning above 0.45" in again.stdout

    again = lmp(head(start="pair_style evp/lj contact repulsive\nread_data all.data") + show).ok()
    assert again.thermo()["PotEng"][0] == pytest.approx(energy, rel=1e-14)  # %.15g of the coefficients

    other = lmp(setup.replace("pair_coeff 1 2 70.7 8.5", "pair_coeff 1 2 99.9 8.5") + show).ok().thermo()["PotEng"][0]
    assert abs(other / energy - 1.0) > 1e-3, "control: the rows matter"


WITHOUT_RECORDS = "Pair evp/lj: the bonds were recorded by fix bonds, whose records are not here"


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("fix", ["", "fix springs all evp/bonds"])
def test_restart_without_the_records_is_refused(lmp, fix, ranks):
    lmp(start() + "run 0\nwrite_restart half.restart\n").ok()
    run = lmp(second_half(fix=fix).replace("f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[4]", ""), ranks=ranks)
    assert run.returncode != 0
    assert WITHOUT_RECORDS in run.stdout
    assert "define 'fix bonds all evp/bonds' right after read_restart" in run.stdout
    assert run.made_no_step()


def test_restart_before_the_recording_records_later(lmp):
    """Nothing was recorded yet, so the fix of the restarted run records at its first set-up, of any name."""
    lmp(start() + "write_restart early.restart\n").ok()
    run = lmp(second_half(file="early.restart", fix="fix other all evp/bonds").replace("f_bonds", "f_other")).ok()
    assert "fix evp/bonds other: recorded 2975 pairs" in run.stdout
