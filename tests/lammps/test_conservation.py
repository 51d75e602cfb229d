# SPDX-License-Identifier: GPL-2.0-only
"""What every central pair force keeps, and two bodies whose motion is known in closed form."""

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import law
from lammps_run import write_state
from small_bodies import dump, head, mass_of, pair, thermo, two_groups, write_two

# Momentum: a sum of N terms, each changed 'steps' times by rounded forces that cancel in pairs. Roundings
# are random: sqrt(500 * 400) of 1e-16 of the largest term stay well below 1e-12 of the sum of sizes.
MOMENTUM = 1e-12
YIELD_FORCE = 8 * 4 * 80 * 0.005 / 0.0096  # m1 n1 e1 xi_s/deq [N] at the mean deq: the scale of 'no force'
NO_FORCE = 1e-9
REDUCED_MASS = 0.5 * mass_of(0.005)  # of the two bodies


def free_body(dt, steps, gamma=0.0, newton="on", contact="literal", zone=""):
    """The reference specimen from the places and velocities of state.dump."""
    record = f"fix bonds all evp/bonds {zone}"
    return (head(newton, start=f"read_data {REFERENCE}") + pair(law.TABLE1._replace(gamma=gamma), contact, record)
            + "fix move all nve\nrun 0\nread_dump state.dump 0 x y z vx vy vz box no replace yes\n"
            + dump(every=max(1, steps)) + "thermo 100\n" + thermo("pe ke etotal") + f"timestep {dt}\nrun {steps}\n")


def momenta(snapshot, mass):
    x, v = snapshot.vectors("x", "y", "z"), snapshot.vectors("vx", "vy", "vz")
    p = mass[:, None] * v
    return p.sum(axis=0), np.cross(x, p).sum(axis=0)


def start_velocities(x):
    """Translation, rotation and an internal motion that is neither."""
    centre = np.array([0.025, 0.0, 0.0])
    v = np.array([1.0, -0.5, 0.25]) + np.cross(np.array([40.0, 15.0, -30.0]), x - centre)
    n = np.arange(1, len(x) + 1)
    return v + 0.3 * np.stack([np.sin(1.1 * n), np.cos(2.3 * n), np.sin(3.7 * n)], axis=1)


@pytest.mark.parametrize("gamma, dt", [(0, 3e-7), (1000, 2e-8)])
@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off")])
def test_free_body_keeps_its_momenta(lmp, tmp_path, reference, ranks, newton, gamma, dt):
    write_state(tmp_path / "state.dump", reference.x, start_velocities(reference.x), reference.box)
    run = lmp(free_body(dt, 400, gamma, newton), ranks=ranks).ok()
    first, last = run.dump("all.dump")[0], run.dump("all.dump")[-1]
    mass = mass_of(reference.radius)
    (p0, l0), (p1, l1) = momenta(first, mass), momenta(last, mass)
    speed = np.linalg.norm(first.vectors("vx", "vy", "vz"), axis=1)
    arm = np.linalg.norm(first.vectors("x", "y", "z"), axis=1)
    assert np.linalg.norm(p1 - p0) < MOMENTUM * np.sum(mass * speed)
    assert np.linalg.norm(l1 - l0) < MOMENTUM * np.sum(mass * speed * arm)

    energy = run.thermo()["TotEng"]
    moved = np.abs(last.vectors("vx", "vy", "vz") - first.vectors("vx", "vy", "vz")).max()
    assert moved > 0.1, "control: the atoms exchanged momentum"
    if gamma > 0:
        # the internal motion, 0.5 m 0.135 per atom, is what damping may take: most of it within 8e-6 s = 3 m/gamma
        internal = 0.5 * np.sum(mass) * 1.5 * 0.3**2
        assert np.all(np.diff(energy) < 0.0)
        assert 0.5 * internal < energy[0] - energy[-1] < 1.1 * internal


@pytest.mark.parametrize("gamma", [0, 1000])
def test_rigid_motion_gives_no_force(lmp, tmp_path, reference, gamma):
    """A translation and a finite rotation of positions, with the velocities of a rigid rotation: no force.
    Control: 0.1 % of stretch gives a fifth of the yield force."""
    angle, axis = 0.7, np.array([1.0, 2.0, -2.0]) / 3.0
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    centre = np.array([0.025, 0.0, 0.0])
    x = (reference.x - centre) @ turn.T
    forces = []
    for stretch in (1.0, 1.001):
        now = centre + stretch * x + np.array([0.0005, -0.0004, 0.0003])
        v = np.array([1.0, -0.5, 0.25]) + np.cross(np.array([40.0, 15.0, -30.0]), now)
        write_state(tmp_path / "state.dump", now, v, reference.box)
        snapshot = lmp(free_body(1e-9, 0, gamma)).ok().dump("all.dump")[-1]
        forces.append(np.linalg.norm(snapshot.vectors("fx", "fy", "fz"), axis=1).max())
    assert forces[0] < NO_FORCE * YIELD_FORCE
    assert forces[1] > 0.1 * YIELD_FORCE


def test_free_vibration_keeps_its_energy(lmp, tmp_path, reference):
    """gamma = 0, no grips: a mode of velocity Verlet keeps its energy less (w dt)^2/4 of its potential part, so the
    energy swings by less than that and does not drift. Bonds to 1.45 and contact none: a pair that crosses dlim
    meets a jump of force, and each such step errs by F v dt. Control: the potential energy takes its part."""
    n = np.arange(1, 501)
    v = 0.3 * np.stack([np.sin(1.1 * n), np.cos(2.3 * n), np.sin(3.7 * n)], axis=1)
    write_state(tmp_path / "state.dump", reference.x, v, reference.box)
    w_max, spread = 2.0 / 9.0e-7, []
    for dt, steps in ((4e-8, 2000), (2e-8, 4000)):
        table = lmp(free_body(dt, steps, contact="none", zone="zone 1.45")).ok().thermo()
        swing = np.ptp(table["PotEng"])
        spread.append(np.ptp(table["TotEng"]) / swing)
        assert swing > 0.2 * table["KinEng"][0]
        assert spread[-1] < (w_max * dt) ** 2 / 4.0
    assert spread[1] < 0.4 * spread[0], "second order in the step"


def two_bodies(lmp, tmp_path, row, speed, dt, steps, every):
    """Two equal spheres, deq 0.011 m, leaving each other at 2 speed; times, distances, relative velocities."""
    write_two(tmp_path / "body.data")
    deck = head(skin=0.002) + pair(row) + two_groups(-speed, speed) + f"""
fix move all nve
dump all all custom {every} two.dump id x vx
dump_modify all format float %.17g
timestep {dt}
run {steps}
"""
    snapshots = lmp(deck).ok().dump("two.dump")
    time = np.array([snapshot.step * dt for snapshot in snapshots])
    return (time, np.array([snapshot["x"][1] - snapshot["x"][0] for snapshot in snapshots]),
            np.array([snapshot["vx"][1] - snapshot["vx"][0] for snapshot in snapshots]))


def test_two_bodies_swing_with_the_period_of_the_law(lmp, tmp_path):
    """Period 2 pi sqrt(mu deq^2/(m1 n1 e1)); amplitude 1e-4 of deq: the cubic term shifts it by about 1e-7."""
    deq = 0.011
    stiffness = 8 * 4 * 80 / deq**2
    period = 2.0 * np.pi * np.sqrt(REDUCED_MASS / stiffness)
    speed = 0.5 * 1e-4 * deq * np.sqrt(stiffness / REDUCED_MASS)
    dt = period / 4000.0
    time, d, _ = two_bodies(lmp, tmp_path, law.TABLE1, speed, dt, 40400, 10)
    x = d - deq
    up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    zeros = time[up] - x[up] * (time[up + 1] - time[up]) / (x[up + 1] - x[up])
    measured = (zeros[-1] - zeros[0]) / (len(zeros) - 1)
    assert len(zeros) >= 9
    assert measured == pytest.approx(period, rel=1e-5)


def test_damping_alone_decays_exponentially(lmp, tmp_path):
    """e1 = e2 = 0: relative speed = exp(-gamma t/mu). At gamma dt/mu = h = 1e-4, velocity Verlet with lagged
    damping errs by h/2 of the exponent: 1e-4 after two time constants."""
    gamma, h = 10.0, 1e-4
    dt = h * REDUCED_MASS / gamma
    time, _, v = two_bodies(lmp, tmp_path, law.TABLE1._replace(e1=0.0, e2=0.0, gamma=gamma), 1e-3, dt, 20000, 1000)
    assert v[-1] < 0.2 * v[0]
    assert np.allclose(v, 2e-3 * np.exp(-gamma * time / REDUCED_MASS), rtol=2.0 * h, atol=0.0)
