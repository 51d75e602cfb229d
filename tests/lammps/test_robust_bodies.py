# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of bodies, long ones among them; see robust.py."""

import numpy as np
import pytest
from evp import law
from oracle import network
from robust import LEDGER_SHARE, MOMENTUM, RADIUS, TABLE1, TABLE2, ledger, momenta, momenta_changed, on
from small_bodies import Small, dump, head, lattice_body, mass_of, pair, record, write_body, write_two

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
    assert np.abs(first.vectors("fx", "fy", "fz").sum(axis=0)).max() < 1e-9 * scale
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
    text += "variable vx atom 0.3*sin(1.1*id)+1\nvariable vy atom 0.3*cos(2.3*id)\nvelocity all set v_vx v_vy 0\nfix move all nve\n"
    text += ledger(20) + "run 0\ntimestep $(0.2*c_dt:%.17g)\nthermo_style custom step ke f_energy f_energy[*] c_dt\n"
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
    text = head(boundary="s s s") + pair(TABLE2, "none") + "variable vx atom 100-200*y\nvariable vy atom 50+200*x\nvelocity all set v_vx v_vy 0\n"
    text += f"fix move all {style}\n" + ledger(steps // 10) + dump(every=steps // 2) + f"timestep {step}\nrun {steps}\n"
    run = bench.run(text).ok()
    mass, kinetic, spin = mass_of(body.radius), [], []
    for snapshot in run.dump("all.dump"):
        x, v = (snapshot.vectors(*names) for names in (("x", "y", "z"), ("vx", "vy", "vz")))
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
    text += "thermo_style custom step ke pe etotal c_dt f_bonds[2]\nthermo_modify norm no format float %.17g\nrun 0\n"
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
        text = head() + pair(TABLE1, "none", "fix bonds all evp/bonds zone 1.4") + "variable vx atom 10*sin(1.1*id)\nvariable vy atom 10*cos(2.3*id)\n"
        text += "velocity all set v_vx v_vy 0\nvelocity all zero linear\nfix move all nve\n" + ledger(50)
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
