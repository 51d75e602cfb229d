# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of two bodies, of `within` of fix evp/bonds; see robust.py."""

import numpy as np
import pytest
from evp import law
from robust import MOMENTUM, RADIUS, TABLE1, ledger, momenta
from test_robust_bodies import cuboctahedron
from lammps_run import write_data
from scipy.optimize import brentq
from small_bodies import dump, head, lattice_body, mass_of, pair, thermo, two_groups

FIX = "fix bonds all evp/bonds within type"
TOUCHING = 2.0 * RADIUS
ROUND_OFF = 1e-9
SPEED = 1.0  # [m/s] of the ball
BALANCE = 3e-5  # of the kinetic energy, at 0.05 of the largest stable timestep


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
        first, last = run.dump("all.dump")
        change = np.linalg.norm(momenta(last, mass)[0] - momenta(first, mass)[0]) / momenta(first, mass)[2]
        shares.append(np.abs(table["f_energy"]).max() / energy)
        push = table["c_push[3]"]
        touched = np.flatnonzero(push)
        assert change < MOMENTUM
        assert touched[0] > 30 and touched[-1] < 140 and np.all(push >= 0.0) and push.max() > 100.0, "control"
        assert np.abs(table["v_way"][: touched[0]] / SPEED + 1.0).max() < 1e-12 and table["v_parting"][-1] > 0.2 * SPEED, "control"
    drift = np.ptp(table["PotEng"] + table["KinEng"]) / energy
    assert shares[1] < BALANCE and shares[1] < 0.35 * shares[0] and drift < 2.0 * BALANCE
    bench.show(f"energy imbalance {shares[0]:.1e} and {shares[1]:.1e} of the kinetic energy at 0.1 and 0.05 of the limit, error of the momentum {change:.0e}")
