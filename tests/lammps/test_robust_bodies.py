# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of bodies, long ones and those that turn under strong implicit damping among them; see robust.py."""

import numpy as np
import pytest
from evp import law
from oracle import network
from robust import LEDGER_SHARE, MOMENTUM, RADIUS, TABLE1, TABLE2, collide, ledger, momenta, momenta_changed, on
from scipy.integrate import solve_ivp
from small_bodies import Small, dump, head, lattice_body, mass_of, pair, record, thermo, velocities, write_body, write_two

OPEN = np.zeros((3, 3))


def free_body(x, radius, reach=1.5):
    radius = np.asarray(radius, dtype=float)
    return Small(x, radius, np.ones(len(x), dtype=int), np.array([[-0.5, 0.5]] * 3), OPEN, record(x, radius, reach, OPEN))


@on(1, 4)
def test_all_pairs_at_dlim(bench):
    """Energy is zero and the forces cancel; momentum conserved to 1e-12 and energy imbalance below 0.02 of the energy of the contacts while the
    body contracts."""
    grid = 0.015 * np.array([[i, j, k] for i in range(3) for j in range(3) for k in range(3)], dtype=float)
    body = free_body(grid, [RADIUS] * 27)
    write_body(bench.folder / "body.data", body)
    text = head() + pair(TABLE1, fix="") + "fix move all nve\ntimestep 1e-7\n" + ledger(20, more="fmax") + dump(every=100) + "run 100\n"
    run = bench.run(text).ok()
    table, mass = run.thermo(), mass_of(body.radius)
    first, last = run.dump("all.dump")
    scale = abs(law.force(0.015, 0.01, TABLE1))
    assert abs(table["PotEng"][0]) < 1e-9
    assert np.abs(first.f.sum(axis=0)).max() < 1e-9 * scale
    change = np.linalg.norm(momenta(last, mass)[0]) / momenta(last, mass)[2]
    assert change < MOMENTUM
    share = np.abs(table["f_energy"]).max() / np.abs(table["f_energy[5]"]).max()
    # some pairs at dlim act from the first step on and some not, as the last bit has it; what then enters has its force at once
    assert share < 0.02
    bench.show(f"error of the momentum {change:.0e}, energy imbalance {share:.1e} of the energy of the contacts")


@pytest.mark.parametrize("what", ["10 in size", "1e4 in mass"])
@on(1, 4)
def test_ratio_of(bench, what):
    """Largest stable timestep = that of the assembled matrices; momentum conserved to 1e-12; energy imbalance below 1e-3. Control: with a mean
    mass the limit would be wrong by more than ten times."""
    rng = np.random.default_rng(5)
    if what == "10 in size":
        turn = np.pi * (3.0 - np.sqrt(5.0))
        z = np.linspace(-0.95, 0.95, 60)
        around = np.stack([np.sqrt(1 - z * z) * np.cos(turn * np.arange(60)), np.sqrt(1 - z * z) * np.sin(turn * np.arange(60)), z], axis=1)
        body = free_body(np.concatenate([[[0.0, 0, 0]], (1.1 * RADIUS) * around]), [RADIUS] + [0.1 * RADIUS] * 60)
        heavier = np.ones(61)
    else:
        body = lattice_body((3, 3, 3))
        body = body._replace(types=np.ones(27, dtype=int))
        heavier = np.where(rng.random(27) < 0.5, 1.0, 1e4)
    write_body(bench.folder / "body.data", body)
    mass = mass_of(body.radius) * heavier
    text = head() + pair(TABLE1, "none") + "".join(f"set atom {i + 1} density {2700.0 * h:.17g}\n" for i, h in enumerate(heavier) if h > 1.0)
    text += velocities("0.3*sin(1.1*id)+1", "0.3*cos(2.3*id)") + "fix move all nve\n" + ledger(20)
    text += "run 0\ntimestep $(0.2*c_dt:%.17g)\nthermo_style custom step ke f_energy f_energy[*] c_dt\n"
    text += dump(every=2000) + "run 2000\n"
    run = bench.run(text).ok()
    table = run.thermo()
    limit = network.step_limits(body.x, body.radius, mass, TABLE1, body.bonds, "none", np.ones(len(mass), dtype=bool))["dt_explicit"]
    assert abs(table["c_dt"][0] / limit - 1.0) < 1e-3
    moved, _, size = momenta_changed(run, mass)
    change, share = moved / size, np.abs(table["f_energy"]).max() / table["KinEng"][0]
    assert change < MOMENTUM and share < LEDGER_SHARE
    bench.show(f"limit {limit:.3g} s, energy imbalance {share:.1e} of the kinetic energy, error of the momentum {change:.0e}")


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
@on(1)
def test_fragment_moving_and_spinning(bench, scheme):
    """Momentum and angular momentum conserved to 1e-10, kinetic energy to 1e-4 once vibrations are damped, over 1e5 steps (implicit: 2e4)."""
    body = lattice_body((2, 2, 2))._replace(types=np.ones(8, dtype=int))
    body = body._replace(x=body.x - body.x.mean(axis=0))
    write_body(bench.folder / "body.data", body)
    style, step, steps = ("nve", 2e-8, 100000) if scheme == "explicit" else ("nve/evp", 2e-6, 20000)
    text = head(boundary="s s s") + pair(TABLE2, "none") + velocities("100-200*y", "50+200*x")
    text += f"fix move all {style}\n" + ledger(steps // 10) + dump(every=steps // 2) + f"timestep {step}\nrun {steps}\n"
    run = bench.run(text).ok()
    mass, kinetic, spin = mass_of(body.radius), [], []
    for snapshot in run.dump("all.dump"):
        x, v = snapshot.x, snapshot.v
        x, v = x - mass @ x / mass.sum(), v - mass @ v / mass.sum()
        kinetic.append(0.5 * np.sum(mass[:, None] * v * v))
        spin.append(np.cross(x, mass[:, None] * v).sum(axis=0))
    lost = np.linalg.norm(spin[2] - spin[0]) / np.linalg.norm(spin[0])
    settled = abs(kinetic[2] / kinetic[1] - 1.0)
    moved, _, size = momenta_changed(run, mass)
    moved /= size
    assert lost < 1e-10 and settled < 1e-4 and moved < 1e-10
    bench.show(f"error of the angular momentum {lost:.0e}, of the momentum {moved:.0e}, of the rotational energy {settled:.0e} in the second half")


HELD = """
group left id 1:4
group right id 13:16
group grips union left right
group free subtract all grips
velocity right set 4 0 0
velocity free ramp vx 0 4 x 0.005 0.035
fix hold grips nve/noforce
fix move free nve/evp
timestep 2e-6
run 75
velocity right set 0 0 0
compute pull right reduce sum fx
"""


def test_hold_at_constant_strain(bench):
    """The force is constant to 1e-9 over 1e5 steps, nothing moves. Control: the force is above 1000 N."""
    body = lattice_body((4, 2, 2))._replace(types=np.ones(16, dtype=int))
    order = np.argsort(body.x[:, 0])
    body = body._replace(x=body.x[order], radius=body.radius[order])
    write_body(bench.folder / "body.data", body)
    steps = 100000
    text = head() + pair(TABLE2._replace(gamma=300.0), "none") + HELD + ledger(steps // 10, more="c_pull") + f"run {steps}\n"
    table = bench.run(text).ok().thermo()
    force, half = table["c_pull"], len(table["c_pull"]) // 2
    drift = np.ptp(force[half:]) / abs(force[-1])
    assert abs(force[-1]) > 1000.0, "control: it is pulled"
    assert drift < 1e-9 and table["KinEng"][-1] < 1e-15
    bench.show(f"force constant to {drift:.0e} over {steps // 2} steps, kinetic energy {table['KinEng'][-1]:.0e} J")


def cuboctahedron():
    """Thirteen equal spheres, twelve around one: rigid."""
    around = [v for v in np.ndindex(3, 3, 3) if sum(c != 1 for c in v) == 2]
    x = (0.01 / np.sqrt(2.0)) * (np.array([(1, 1, 1), *around], dtype=float) - 1.0)
    return free_body(x, [RADIUS] * 13)


def test_free_vibration_for_a_million_steps(bench):
    """The mean energy drifts by less than 1e-6 of the vibration energy per 1e5 steps. Control: the body vibrates, in the first regime."""
    write_body(bench.folder / "body.data", cuboctahedron())
    steps = 1000000
    text = head() + pair(TABLE1, "none", "fix bonds all evp/bonds") + "variable vx atom 0.5*sin(1.1*id)\nvelocity all set v_vx 0 0\n"
    text += "velocity all zero linear\nvelocity all zero angular\nfix move all nve\ncompute dt all evp/dt\n"
    text += thermo("ke pe etotal c_dt f_bonds[2]") + "run 0\n"
    text += "timestep $(0.2*c_dt:%.17g)\nuncompute dt\nvariable e equal etotal\nfix mean all ave/time 1 1000 1000 v_e\n"
    text += f"thermo_style custom step ke pe f_mean f_bonds[2]\nthermo 1000\nrun {steps}\n"
    table = bench.run(text).ok().thermo()
    vibration = table["KinEng"][0]
    assert table["f_bonds[2]"].max() == 0 and np.ptp(table["PotEng"]) > 0.1 * vibration, "control: the body vibrates, in the first regime"
    # means of every step; a Hann window takes the ends of the vibration's beats away
    means = table["f_mean"][1:].reshape(10, -1)
    window = np.hanning(means.shape[1] + 2)[1:-1]
    at = steps * (np.arange(10) + 0.5) / 10
    drift = abs(np.polyfit(at, means @ window / window.sum(), 1)[0]) * 1e5 / vibration
    assert drift < 1e-6, drift
    bench.show(f"drift {drift:.1e} of the vibration energy per 1e5 steps")


SHAKEN = 0.1  # of the energy of the motion, at 0.2 of the limit over 5000 steps; at 0.8 it is many times that energy


def test_shaken_far_beyond_xi_s(bench):
    """Fix evp/energy shows the energy that velocity Verlet adds where pairs pass xi_s back and forth without damping; it decreases with the
    timestep size. Control: at 0.8 of the limit the same body gains more than ten times as much, although each mode is stable."""
    write_body(bench.folder / "body.data", cuboctahedron())
    gained = []
    for fraction in (0.8, 0.2):
        text = head() + pair(TABLE1, "none", "fix bonds all evp/bonds zone 1.4") + velocities("10*sin(1.1*id)", "10*cos(2.3*id)")
        text += "velocity all zero linear\nfix move all nve\n" + ledger(50)
        table = bench.run(text + f"run 0\ntimestep $({fraction}*c_dt:%.17g)\nrun {int(1000 / fraction)}\n").ok().thermo()
        gained.append(np.abs(table["f_energy"]).max() / table["KinEng"][0])
    assert gained[1] < SHAKEN and gained[0] > 10.0 * gained[1]
    bench.show(f"energy gain {gained[0]:.1e} at 0.8 of the limit, {gained[1]:.1e} at 0.2")


@on(1, 4)
def test_coincident_centres(bench):
    """One error names both atoms before the first step."""
    write_two(bench.folder / "body.data", 0.0)
    run = bench.run(head() + pair(TABLE1, fix="") + "fix move all nve\nrun 10\n")
    assert run.returncode != 0 and " coincide" in run.stdout and run.made_no_step()
    bench.show("refused")


# ---- bodies that turn ----

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


def spinning(bench, body, row, velocity, steps):
    """A free body under fix nve/evp with fix dt/evp; velocity: three formulas."""
    write_body(bench.folder / "body.data", body)
    text = head() + pair(row, "none") + velocities(*velocity) + "fix move all nve/evp\n"
    text += ledger(max(steps // 40, 1), "fix step all dt/evp 10 0.4", "f_bonds[2]")
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

    text = head() + pair(TABLE1, "none") + velocities(f"-{spin}*y", f"{spin}*x")
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
    off = np.abs(run.dump("all.dump")[-1].x - body.x @ turn.T).max() / np.abs(body.x).max()
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
