# SPDX-License-Identifier: GPL-2.0-only
"""The explicit limit of compute evp/dt by bisection: a 500-body at rest, without to thirty times critical damping.

'Finite' is not 'stable': a step is judged by the energy that the body has left after a fixed time, against a run at a
quarter of the limit. Pairs to 1.4 and contact none keep the network what it was linearised at."""

import pytest
from common_bodies import REFERENCE
from evp import law
from small_bodies import head, pair, thermo

STEPS = 20000  # the demand of the issue
SPEED = 1e-4  # [m/s] strains of 1e-7: linear to seven digits
BELOW, ABOVE = 0.98, 1.02  # the demand of the issue
# Verlet's velocities at full steps hold the mean kinetic energy of each undamped mode at any stable step; the time mean
# over a thousand beats of 1500 modes scatters by one in the square root of the modes. Damped, the modes that are
# left after the run are slow, and resolved by both steps.
SAME = 0.05

SWING = """
variable vx atom {speed}*sin(1.1*id)
variable vy atom {speed}*cos(2.3*id)
velocity all set v_vx v_vy 0
velocity all zero linear
fix move all nve
compute dt all evp/dt
""" + thermo("ke pe c_dt") + """
run 0
variable dt equal {fraction}*$(c_dt:%.17g)
timestep $(v_dt:%.17g)
thermo_style custom step ke pe
thermo {every}
run {steps}
"""


def swing(lmp, gamma, fraction, steps):
    body = head(start=f"read_data {REFERENCE}") + pair(law.TABLE1._replace(gamma=gamma), "none", "fix bonds all evp/bonds zone 1.4")
    run = lmp(body + SWING.format(speed=SPEED, fraction=fraction, every=max(1, steps // 200), steps=steps))
    grown = run.returncode != 0  # a force that is not a number is an error
    table = run.thermo() if not grown else None
    return grown, table


@pytest.mark.parametrize("gamma", [0, 100, 1000, 10000])
def test_stable_below_and_not_above(lmp, gamma):
    """At 1.02 of its limit the first mode grows by 1.04 per step where it is viscous, 1.5 where elastic: 600 steps are plenty."""
    grown, below = swing(lmp, gamma, BELOW, STEPS)
    assert not grown
    start = below["KinEng"][0]
    assert below["KinEng"].max() <= start * (1.0 + 1e-6), "nothing grew at any time"
    grown, above = swing(lmp, gamma, ABOVE, 600)
    assert grown or above["KinEng"].max() > 1e3 * start
    parts = int(round(STEPS / 20 * BELOW / 0.25))
    _, small = swing(lmp, gamma, 0.25, parts)
    _, same = swing(lmp, gamma, BELOW, STEPS // 20)
    if gamma == 0:
        means = [table["KinEng"][1:].mean() for table in (small, below)]
        assert means[0] == pytest.approx(0.5 * start, rel=SAME), "control: half of it is potential energy"
    else:
        means = [table["KinEng"][-1] for table in (small, same)]
        assert means[0] < 0.5 * start, "control: damping acts"
    assert means[1] == pytest.approx(means[0], rel=SAME)


@pytest.mark.parametrize("gamma", [0, 1000])
def test_bisection_finds_the_limit(lmp, gamma):
    """The largest step at which nothing grows in 2000 steps, to 0.5 %: within the 1 % that the issue allows."""
    low, high = 0.9, 1.1
    while high - low > 0.005:
        middle = 0.5 * (low + high)
        grown, table = swing(lmp, gamma, middle, 2000)
        grown = grown or table["KinEng"].max() > 2.0 * table["KinEng"][0]
        low, high = (low, middle) if grown else (middle, high)
    assert 0.99 < low <= high < 1.01
