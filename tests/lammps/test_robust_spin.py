# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of bodies that turn under strong implicit damping; see robust.py."""

import numpy as np
import pytest
from robust import LEDGER_SHARE, MOMENTUM, RADIUS, TABLE1, TABLE2, collide, ledger, momenta, momenta_changed, on
from test_robust_bodies import free_body
from scipy.integrate import solve_ivp
from small_bodies import dump, head, lattice_body, mass_of, pair, write_body

TURN_PER_STEP = 0.1  # [rad] that fix dt/evp allows
# A leapfrog whose velocities are those of the full steps advances by asin(a) for a, a share a^2/6 of it.
TUMBLE = 150  # steps
PHASE = TURN_PER_STEP**2 / 6.0
RINGS = 1.5  # mean over the end of the strain energy of a ringing body: that of (1 - cos)^2
RINGING = 0.05  # of that mean: 0.8 ms hold some tens of periods of the slowest mode, and no whole number of them


def fcc_cube(cells=3, spacing=0.009):
    corner = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]])
    x = np.concatenate([corner + cell for cell in np.ndindex(cells, cells, cells)]) * spacing * np.sqrt(2.0)
    return free_body(x - x.mean(axis=0), [RADIUS] * len(x))


def spinning(bench, body, row, velocity, steps, more=""):
    """A free body under fix nve/evp with fix dt/evp; velocity: three formulas."""
    write_body(bench.folder / "body.data", body)
    text = head() + pair(row, "none")
    text += "".join(f"variable v{axis} atom {formula}\n" for axis, formula in zip("xyz", velocity)) + "velocity all set v_vx v_vy v_vz\n"
    text += "fix move all nve/evp\n" + ledger(max(steps // 40, 1), "fix step all dt/evp 10 0.4", f"f_bonds[2] {more}").replace("compute dt all evp/dt\n", "")
    run = bench.run(text + dump(every=steps) + f"run {steps}\n").ok()
    table = run.thermo()
    mass = mass_of(body.radius)
    turned = momenta_changed(run, mass)[1] / np.linalg.norm(momenta(run.dump("all.dump")[0], mass)[1])
    share = np.abs(table["f_energy"]).max() / table["KinEng"][0]
    assert turned < MOMENTUM
    assert share < LEDGER_SHARE, share
    assert np.all(np.diff(table["f_energy[6]"]) >= 0.0) and table["f_energy[6]"][-1] < LEDGER_SHARE * table["KinEng"][0], "damping takes hardly anything"
    return run, table, f"energy imbalance {share:.1e} of the kinetic energy, error of the angular momentum {turned:.0e}"


@pytest.mark.parametrize("gamma", [1000.0, 30000.0, 100000.0])
@on(1)
def test_spinning_cube(bench, gamma):
    """The strain energy of the rotating cube does not depend on gamma; no bond passes xi_s; energy imbalance below 1e-3, angular momentum
    conserved to 1e-12. Control: without damping, by explicit time integration, the cube stores the same energy in the mean."""
    spin, body = 170.0, fcc_cube()
    run, table, shown = spinning(bench, body, TABLE2._replace(gamma=gamma), (f"-{spin}*y", f"{spin}*x", "0"), 400)
    assert table["f_bonds[2]"].max() == 0
    stored = table["f_energy[2]"][-1] / table["KinEng"][0]

    text = head() + pair(TABLE1, "none") + f"variable vx atom -{spin}*y\nvariable vy atom {spin}*x\nvelocity all set v_vx v_vy 0\n"
    text += "fix move all nve\n" + ledger(1, "timestep 2e-7") + "run 4000\n"
    control = bench.run(text).ok().thermo()
    mean = control["f_energy[2]"].mean() / control["KinEng"][0]
    # set spinning at once, it rings about its strain for ever
    assert abs(RINGS * stored / mean - 1.0) < RINGING, (stored, mean)
    bench.show(f"stored {stored:.4g} of the kinetic energy at dt = {table['Dt'][-1]:.2g} s, {shown}")


def test_spinning_top(bench):
    """A tumbling body follows Euler's equations of a rigid body; energy imbalance below 1e-3, angular momentum conserved to 1e-12. Control: its
    axis turns by more than a right angle."""
    body = lattice_body((5, 3, 2))._replace(types=np.ones(30, dtype=int))
    mass = mass_of(body.radius)
    x = body.x - mass @ body.x / mass.sum()
    inertia = np.einsum("i,ijk->jk", mass, np.sum(x * x, axis=1)[:, None, None] * np.eye(3) - x[:, :, None] * x[:, None, :])
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.linalg.det(axes)
    body = body._replace(x=x @ axes, box=np.array([[-0.5, 0.5]] * 3))  # principal axes along x, y, z
    spin = np.array([40.0, 150.0, 60.0])  # near the middle axis, where a rigid body tumbles
    velocity = (f"{spin[1]}*z-{spin[2]}*y", f"{spin[2]}*x-{spin[0]}*z", f"{spin[0]}*y-{spin[1]}*x")
    run, table, shown = spinning(bench, body, TABLE2._replace(gamma=3e4), velocity, TUMBLE)

    def euler(_, state):
        turn, w = state[:9].reshape(3, 3), state[9:]
        return np.append(np.cross(turn, w), np.cross(moments * w, w) / moments)  # rows of the turn: r' = r x w in the body's frame

    time = table["Time"][-1]
    end = solve_ivp(euler, (0.0, time), np.append(np.eye(3).ravel(), spin), rtol=1e-10, atol=1e-12).y[:, -1]
    turn, angle = end[:9].reshape(3, 3), np.linalg.norm(spin) * time
    off = np.abs(run.dump("all.dump")[-1].vectors("x", "y", "z") - body.x @ turn.T).max() / np.abs(body.x).max()
    axis = np.degrees(np.arccos(turn[1, 1]))
    assert axis > 90.0, "control"
    assert off < 2.0 * PHASE * angle, off
    bench.show(f"error of the positions {off:.1e} of its size after {angle:.0f} rad, axis turned by {axis:.0f} degrees, {shown}")


@pytest.mark.parametrize("gamma", [1000.0, 10000.0, 100000.0])
def test_off_centre_impact_with_large_gamma(bench, gamma):
    """Energy imbalance below 1e-3 of the kinetic energy, momentum and angular momentum conserved to 1e-12, damping never adds energy. Control:
    more than half of it is converted."""
    run, mass, energy = collide(bench, TABLE1._replace(gamma=gamma), [0.0395, 0.012, 0.004], 30.0, "nve/evp", "1 0.4 max 2e-6", 20, 2000)
    table = run.thermo()
    (moved, turned, size), share = momenta_changed(run, mass), np.abs(table["f_energy"]).max() / energy
    off = max(moved / size, turned / (0.03 * size))
    assert off < MOMENTUM
    assert share < LEDGER_SHARE, share
    assert np.all(np.diff(table["f_energy[6]"]) >= 0.0)
    assert table["KinEng"][-1] < 0.5 * energy, "control: they met"
    bench.show(f"{100 * table['f_energy[6]'][-1] / energy:.0f} % dissipated, energy imbalance {share:.1e}, error of the momenta {off:.0e}")
