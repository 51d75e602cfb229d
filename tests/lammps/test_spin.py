# SPDX-License-Identifier: GPL-2.0-only
"""Bodies that turn under fix nve/evp: dampers see the opening rate of the step, so that turning alone strains nothing.

Bodies of many atoms are in test_robust_bodies.py, the force itself in test_implicit.py."""

import numpy as np
import pytest
from evp import law
from lammps_run import write_data
from small_bodies import head, mass_of, pair, thermo, write_two

GAP, RADIUS = 0.0085, 0.0045
MASS = mass_of(RADIUS)
ROW = law.Row(e1=50.0, m1=6.0, n1=3.0, e2=2.0, m2=6.0, n2=3.0, xi_s=0.006, gamma=0.0, alpha=1.6)
STIFFNESS = ROW.m1 * ROW.n1 * ROW.e1 / GAP**2
WITHIN = 0.01  # of the centrifugal strain: the demand; (w dt)^2/6 of it, which is a leapfrog's, and the strain itself
LEDGER = 1e-3  # of the kinetic energy

SPIN = """
variable vx atom -{spin}*y
variable vy atom {spin}*x
velocity all set v_vx v_vy 0
fix move all {style}
fix energy all evp/energy
variable d equal sqrt((x[1]-x[2])^2+(y[1]-y[2])^2+(z[1]-z[2])^2)
variable w equal omega(all,z)
variable l equal angmom(all,z)
thermo {every}
""" + thermo("time dt v_d v_w v_l ke f_energy f_energy[6] f_bonds[2]")


def spin_deck(gamma, spin, angle, time, style="nve/evp", newton="on", boundary="f f f", more=""):
    """A pair that spins about z, 20 rows; angle: w dt."""
    steps = 20 * int(np.ceil(time * spin / angle / 20))
    text = head(newton, boundary, skin=0.001) + pair(ROW._replace(gamma=gamma), "none")
    return text + SPIN.format(spin=spin, style=style, every=steps // 20) + f"timestep {angle / spin:.17g}\n{more}\nrun {steps}\n"


def spin_pair(lmp, folder, *choices, ranks=1, **more):
    write_two(folder / "body.data", GAP, (RADIUS, RADIUS))
    return lmp(spin_deck(*choices, **more), ranks).ok()


def strain_over_centrifugal(table):
    """m w^2/(2K) is what the spring needs to hold half of d at w."""
    strain = table["v_d"] / GAP - 1.0
    return strain[1:] / (0.5 * MASS * table["v_w"][1:] ** 2 / STIFFNESS)


def test_pair_that_spins_has_its_centrifugal_strain(lmp_decks, tmp_path):
    """After eight times the time gamma/K in which it settles. (With the velocity along the old direction it is gamma w^2 dt/2K,
    100 to 1e6 times too large.)"""
    write_two(tmp_path / "body.data", GAP, (RADIUS, RADIUS))
    choices = [(600.0, 2500.0, 0.15), (600.0, 4000.0, 0.06), (4e4, 900.0, 0.15), (4e4, 2500.0, 0.03), (2e6, 900.0, 0.1)]
    decks = {(gamma, spin, angle): spin_deck(gamma, spin, angle, 8.0 * gamma / STIFFNESS) for gamma, spin, angle in choices}
    for choice, run in lmp_decks(decks).items():
        table = run.thermo()
        assert strain_over_centrifugal(table)[-1] == pytest.approx(1.0, abs=WITHIN), choice
        assert table["f_bonds[2]"].max() == 0
        assert np.abs(table["v_l"] / table["v_l"][0] - 1.0).max() < 1e-10, choice
        assert np.abs(table["f_energy"]).max() < LEDGER * table["KinEng"][0], choice
        assert table["f_energy[6]"].min() >= 0.0 and np.all(np.diff(table["f_energy[6]"]) >= 0.0), choice
        # what it takes to stretch a spring by a damper: as much as is stored
        stored = 0.5 * STIFFNESS * (table["v_d"][-1] - GAP) ** 2
        assert table["f_energy[6]"][-1] == pytest.approx(stored, rel=0.6), "control: damping acts"


def test_explicit_damping_pulls_a_spinning_pair_together(lmp, tmp_path):
    """By gamma w^2 d dt/2, as its page says: a share gamma dt/m of the strain."""
    gamma, spin, step = 600.0, 3000.0, 4e-8
    table = spin_pair(lmp, tmp_path, gamma, spin, spin * step, 8.0 * gamma / STIFFNESS, "nve").thermo()
    assert strain_over_centrifugal(table)[-1] - 1.0 == pytest.approx(-gamma * step / MASS, abs=2e-3 + 4e-4)  # what settles, the strain itself


def test_timestep_follows_the_turning(lmp, tmp_path):
    """fix dt/evp allows 0.1 rad per step to a pair that fix nve/evp damps, and says that it is the turning. Control: without
    damping turning does not count."""
    spin = 300.0
    run = spin_pair(lmp, tmp_path, 1e6, spin, 0.05, 0.02, more="fix dt all dt/evp 1 0.4\nthermo_style custom step dt f_dt[2] f_dt[3] v_w")
    table = run.thermo()
    assert table["f_dt[3]"][-1] == 5
    assert table["Dt"][-1] * table["v_w"][-1] == pytest.approx(0.1, rel=0.01)
    assert sum("the rotation of pairs limits the timestep" in line for line in run.warnings()) == 1
    plain = spin_pair(lmp, tmp_path, 0.0, spin, 0.001, 0.001, "nve", more="fix dt all dt/evp 1 0.4\nthermo_style custom step dt f_dt[3]").thermo()
    assert plain["f_dt[3]"][-1] != 5


def test_turning_too_far_in_a_step_is_warned_of(lmp, tmp_path):
    for angle, warned in ((0.14, 0), (0.2, 1)):
        run = spin_pair(lmp, tmp_path, 1e5, 400.0, angle, 0.02)
        assert sum("rotated by more than 0.15 rad per step" in line for line in run.warnings()) == warned


TURNTABLE = """
group grip id 1
group free id 2
variable vy atom {spin}*x
velocity all set 0 v_vy 0
{fixes}
variable d equal sqrt((x[1]-x[2])^2+(y[1]-y[2])^2)
timestep {step:.17g}
thermo {every}
""" + thermo("v_d ke f_energy f_energy[6]")


@pytest.mark.parametrize("gamma, angle, ranks, newton", [(1e3, 0.01, 1, "on"), (2e4, 0.008, 2, "off"), (5e5, 0.002, 1, "on")])
def test_atom_that_turns_with_a_moved_one(lmp_decks, tmp_path, gamma, angle, ranks, newton):
    """A turntable: sphere 1 is moved along a circle by fix move rotate, sphere 2 outside it is free. The moved one enters with its velocity
    over the step, not with that at its place: the strain is m w^2 r d/(K d^2). (It was too large by gamma dt/2m.)"""
    spin, inner = 400.0, 0.018
    x = np.array([[inner, 0.0, 0.0], [inner + GAP, 0.0, 0.0]])
    write_data(tmp_path / "body.data", x, (RADIUS, RADIUS), [[-0.2, 0.2]] * 3)
    fixes = [f"fix turn grip move rotate 0 0 0 0 0 1 {2.0 * np.pi / spin:.17g}", "fix integrate free nve/evp"]
    steps = int(np.ceil(8.0 * gamma / STIFFNESS * spin / angle / 20)) * 20
    text = head(newton, skin=0.001) + pair(ROW._replace(gamma=gamma), "none")
    decks = {}
    for first, second in (fixes, fixes[::-1]):
        lines = f"{first}\n{second}\nfix energy all evp/energy"
        decks[first] = text + TURNTABLE.format(spin=spin, fixes=lines, step=angle / spin, every=steps // 20) + f"run {steps}\n"
    for first, run in lmp_decks(decks, ranks).items():
        table = run.thermo()
        strain = table["v_d"] / GAP - 1.0
        assert strain[-1] == pytest.approx(MASS * spin**2 * (inner + GAP) / (STIFFNESS * GAP), rel=WITHIN), first
        assert np.abs(table["f_energy"]).max() < LEDGER * table["KinEng"][0], first
