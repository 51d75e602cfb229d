# SPDX-License-Identifier: GPL-2.0-only
"""What the robustness tests share, test_robust_*.py: scenes that other schemes lose.

The docstring of a test states what it demands, bench.show() records what it found: tests/maintain/robustness.py makes a page of both.
The faults that each test must fail with are in tests/maintain/faults.py."""

from typing import Callable, NamedTuple

import numpy as np
import pytest
from evp import law
from small_bodies import dump, head, lattice_body, mass_of, pair, thermo, write_body

on = pytest.mark.ranks  # numbers of MPI ranks that a test runs on, 1 and 2 without; the suite takes the first


TABLE1, TABLE2 = law.TABLE1, law.TABLE2
RADIUS, DEQ = 0.005, 0.011
MASS = mass_of(RADIUS)
MOMENTUM = 1e-12
LEDGER_SHARE = 1e-3  # of the work, or of the energy that is traded: the demand of the issue
CLOSED_FORM = 1e-4  # of trapezoids over a thousand parts and more
SECOND_ORDER = 1e-3  # (w dt)^2 at the steps used where a closed form is one of motion


def ledger(every, step="compute dt all evp/dt", more=""):
    """Energy balance and its table; step: what measures or sets the timestep."""
    return f"fix energy all evp/energy\n{step}\nthermo {every}\n" + thermo(f"time dt ke pe f_energy f_energy[*] {more}")


def momenta(snapshot, mass):
    x, v = snapshot.x, snapshot.v
    return mass @ v, np.cross(x, mass[:, None] * v).sum(axis=0), np.sum(mass * np.linalg.norm(v, axis=1))


def momenta_changed(run, mass):
    """Changes of momentum and angular momentum from the first to the last snapshot of all.dump, and the sum of |p|."""
    (p0, l0, size), (p1, l1, _) = (momenta(run.dump("all.dump")[k], mass) for k in (0, -1))
    return np.linalg.norm(p1 - p0), np.linalg.norm(l1 - l0), size


class Bench(NamedTuple):
    """Where a test runs: lmp(text, ranks) -> lammps_run.Run, the folder, ranks."""

    lmp: Callable
    folder: object
    ranks: int
    show: Callable

    def run(self, text):
        return self.lmp(text, self.ranks)


def collide(bench, row, shift, speed, style, limits, every, steps, contact="repulsive", more=""):
    """Two bodies of 27 spheres with no bond between them meet at this speed along x, one shifted by `shift` from the other; run, mass, energy of the motion.
    more: columns of the thermo table."""
    one, two = lattice_body((3, 3, 3), seed=1), lattice_body((3, 3, 3), seed=2)
    body = one._replace(x=np.concatenate([one.x, two.x + shift]), radius=np.concatenate([one.radius, two.radius]), types=np.ones(54, dtype=int),
                        box=np.array([[-0.5, 0.5]] * 3))
    write_body(bench.folder / "body.data", body)
    text = head() + pair(row, contact) + f"group one id 1:27\ngroup two id 28:54\nvelocity one set {speed / 2} 0 0\nvelocity two set {-speed / 2} 0 0\n"
    text += f"fix move all {style}\n" + ledger(every, f"fix step all dt/evp {limits} displacement 0.1", more)
    mass = mass_of(body.radius)
    return bench.run(text + dump(every=steps) + f"run {steps}\n").ok(), mass, 0.5 * mass.sum() * (speed / 2) ** 2
