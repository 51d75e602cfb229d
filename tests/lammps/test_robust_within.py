# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of two bodies, of `within` of fix evp/bonds, and of a box that deforms with `fix deform ... remap v`; see robust.py."""

import numpy as np
import pytest
from evp import law
from robust import MOMENTUM, RADIUS, TABLE1, ledger, momenta_changed
from test_robust_bodies import cuboctahedron
from lammps_run import write_data
from scipy.optimize import brentq
from small_bodies import dump, head, lattice_body, mass_of, pair, thermo, two_groups, write_body

FIX = "fix bonds all evp/bonds within type"
TOUCHING = 2.0 * RADIUS
ROUND_OFF = 1e-9
SPEED = 1.0  # [m/s] of the ball
BALANCE = 3e-5  # of the kinetic energy, at 0.05 of the largest stable timestep
RATE, EDGE = 500.0, 0.04  # of the box


@pytest.mark.parametrize("contact", ["literal", "repulsive"])
def test_two_bodies_brought_together(bench, contact):
    """The force is exactly zero before the spheres touch, then the repulsion of the first regime, far beyond xi_s, then zero again. Control: without
    *within* they are bonded, and the force in compression is that of eq. 8."""
    forces = []
    for fix in (FIX, "fix bonds all evp/bonds"):
        write_data(bench.folder / "body.data", np.array([[0.0, 0, 0], [1.1 * TOUCHING, 0, 0]]), [RADIUS] * 2, [[-0.2, 0.2]] * 3, [1, 2])
        text = head(skin=0.002) + pair(TABLE1, contact, fix) + two_groups(0.0, 0.0) + "fix hold one move linear 0 0 0\n"
        text += f"fix lead two move wiggle {-0.14 * TOUCHING} 0 0 2e-4\ntimestep 1e-6\ncompute f two reduce sum fx\nvariable d equal x[2]-x[1]\n"
        table = bench.run(text + "thermo 1\n" + thermo("v_d c_f pe") + "run 200\n").ok().thermo()
        forces.append(table["c_f"])
    d, (ours, glued) = table["v_d"], forces
    touch = d <= TOUCHING
    off = np.abs(ours - np.where(touch, law.force(d, TOUCHING, TABLE1._replace(xi_s=0.5)), 0.0)).max() / ours.max()
    assert not np.any(ours[~touch]), "a force before they touch"
    assert off < ROUND_OFF and 10 < np.sum(touch) < 60
    assert glued.min() < 0.0 and glued.max() < 0.5 * ours.max(), "control"
    bench.show(f"error of the force {off:.0e} of the largest over {np.sum(touch)} steps of contact, no force over {np.sum(~touch)} steps")


def ball_and_block():
    """A disordered block of type 1 and above it, 1.1 diameters away, a cuboctahedron of type 2."""
    block, ball = lattice_body((5, 5, 3), seed=8), cuboctahedron()
    place = ball.x - ball.x.mean(axis=0) + [*block.x[:, :2].mean(axis=0), 0.0]

    def closest(z):
        d = np.linalg.norm(place[:, None] + [0.0, 0.0, z] - block.x, axis=2)
        return np.min(d / (ball.radius[:, None] + block.radius))

    place[:, 2] += brentq(lambda z: closest(z) - 1.1, block.x[:, 2].max(), block.x[:, 2].max() + 0.1)
    return np.concatenate([block.x, place]), np.concatenate([block.radius, ball.radius]), np.repeat([1, 2], [len(block.x), len(place)])


def test_ball_hits_block(bench):
    """Momentum conserved to 1e-12; the energy imbalance decreases with the square of the timestep size; the bodies only repel each other.
    Control: the ball moves freely until contact, and rebounds."""
    x, radius, types = ball_and_block()
    write_data(bench.folder / "body.data", x, radius, [[-0.2, 0.3]] * 3, types)
    mass, shares, columns = mass_of(radius), [], "pe ke f_energy v_way v_parting c_push[3] f_bonds[1] f_bonds[2]"
    energy = 0.5 * mass[types == 2].sum() * SPEED**2
    for fraction, steps in ((0.1, 3000), (0.05, 6000)):
        text = head() + pair(TABLE1, "literal", FIX) + f"group ball type 2\ngroup block type 1\nvelocity ball set 0 0 {-SPEED}\nfix move all nve\n"
        text += "compute push ball group/group block\nvariable way equal vcm(ball,z)\nvariable parting equal vcm(ball,z)-vcm(block,z)\n" + ledger(steps // 150) + "run 0\n"
        text += f"timestep $({fraction}*c_dt:%.17g)\n" + thermo(columns) + dump(every=steps) + f"uncompute dt\nrun {steps}\n"
        run = bench.run(text).ok()
        table = run.thermo()
        change, _, size = momenta_changed(run, mass)
        shares.append(np.abs(table["f_energy"]).max() / energy)
        push = table["c_push[3]"]
        touched = np.flatnonzero(push)
        change /= size
        assert change < MOMENTUM
        assert touched[0] > 30 and touched[-1] < 140 and np.all(push >= 0.0) and push.max() > 100.0, "control"
        assert np.abs(table["v_way"][: touched[0]] / SPEED + 1.0).max() < 1e-12 and table["v_parting"][-1] > 0.2 * SPEED, "control"
    drift = np.ptp(table["PotEng"] + table["KinEng"]) / energy
    assert shares[1] < BALANCE and shares[1] < 0.35 * shares[0] and drift < 2.0 * BALANCE
    bench.show(f"energy imbalance {shares[0]:.1e} and {shares[1]:.1e} of the kinetic energy at 0.1 and 0.05 of the limit, error of the momentum {change:.0e}")


def test_sheared_box_with_implicit_damping(bench):
    """Energy imbalance below 1e-4 of the dissipated energy; momentum of the unwrapped body conserved to 1e-11; velocities within 2 % of those of
    explicit damping. Control: atoms are wrapped, and the box does work."""
    body = lattice_body((5, 4, 4), periodic="xyz", tilt=(1e-3, 0.0, 0.0))
    write_body(bench.folder / "body.data", body, (1e-3, 0.0, 0.0))
    text = head(boundary="p p p") + pair(law.TABLE1._replace(gamma=50.0), "none", "fix bonds all evp/bonds zone 1.4")
    text += f"variable vx atom {RATE}*y+200+5*sin(1.1*id)\nvariable vy atom 300+5*cos(2.3*id)\nvelocity all set v_vx v_vy 0\n"
    text += f"fix energy all evp/energy\nfix box all deform 1 xy erate {RATE} remap v\nfix move all {{}}\ntimestep 2e-7\nthermo 200\n"
    text += thermo("f_energy f_energy[*]") + dump(every=200).replace("fx fy fz", "iy").replace("pbc yes", "pbc no") + "run 200\n"
    found = {}
    for style in ("nve", "nve/evp tol 1e-10"):
        run = bench.run(text.format(style)).ok()
        found[style], table = run.dump("all.dump"), run.thermo()
    share = abs(table["f_energy"][-1]) / table["f_energy[6]"][-1]
    assert share < 1e-4
    assert abs(table["f_energy[13]"][-1]) > table["f_energy[6]"][-1] > 0.5
    unwrapped = []
    for snapshot in [*found["nve/evp tol 1e-10"], found["nve"][-1]]:
        v = snapshot.vectors("vx", "vy", "vz")
        v[:, 0] += RATE * EDGE * snapshot["iy"]
        unwrapped.append(v)
    wrapped = np.count_nonzero(found["nve"][-1]["iy"] - found["nve"][0]["iy"])
    assert wrapped > 10
    mass = mass_of(body.radius)
    off = np.abs(mass @ (unwrapped[1] - unwrapped[0])).max() / (mass.sum() * 400.0)
    assert off < 1e-11
    apart = np.abs(unwrapped[1] - unwrapped[2]).max() / (RATE * EDGE)
    assert apart < 0.02
    bench.show(f"energy imbalance {share:.1e}, error of the momentum {off:.0e}, {wrapped} atoms wrapped, velocities {apart:.1e} from explicit ones")
