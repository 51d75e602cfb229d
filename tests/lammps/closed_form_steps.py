# SPDX-License-Identifier: GPL-2.0-only
"""Errors of the time step of LAMMPS' velocity Verlet, on two spheres along x whose motion another integrator knows."""

from typing import NamedTuple

import numpy as np
import scipy.integrate
from closed_form_bodies import MASS, ROW, head, write_body
from evp import law


class Case(NamedTuple):
    """d: distance at the start over deq; speed: of leaving, in xi_s per time unit; time in sqrt(mass/K); contact mode."""

    d: float
    speed: float
    time: float
    gamma: float = 0.0
    contact: str = "none"


CASES = {
    "smooth": Case(1.0, 0.9, 5.0),  # swings to 0.64 xi_s and back, more than a period
    "kink": Case(1.0, 1.6, 5.0),
    "damped": Case(1.0, 0.9, 2.0, gamma=0.2),
    "jump": Case(1.5 + 0.04 * 0.618, -8.0, 2.0, contact="literal"),  # meets at 0.618: at no even part of the time
}
# Steps of a run; errors are averaged (rms) over each row, so that where a step meets the kink does not matter.
STEPS = np.array([[start + start * k // 8 for k in range(8)] for start in (40, 80, 160, 320)])

RUN = """
variable n index {numbers}
label next
reset_timestep 0
set atom 1 x 5
set atom 2 x {place:.17g}
velocity all set 0 0 0
velocity second set {speed:.17g} 0 0
timestep $({time:.17g}/v_n:%.17g)
run $n
print "END $n $(v_d:%.17g)"
next n
jump SELF next
"""


def relative_motion(case):
    """Distance at the end, by an eighth-order integrator that stops at each change of the force."""
    row, reduced = ROW._replace(gamma=case.gamma), 0.5 * MASS
    bonded = case.contact == "none"
    marks = [1.0 - row.xi_s, 1.0 + row.xi_s] if bonded else [row.alpha]

    def motion(_, y):
        acts = bonded or y[0] <= side_of_dlim[0]
        pull = float(law.force(y[0], 1.0, row)) - row.gamma * y[1] if acts else 0.0
        return [y[1], pull / reduced]

    events = []
    for mark in marks:
        def event(_, y, mark=mark):
            return y[0] - mark
        event.terminal = True
        events.append(event)
    now, y, side_of_dlim = 0.0, np.array([case.d, case.speed * row.xi_s]), [row.alpha]
    while now < case.time:
        found = scipy.integrate.solve_ivp(motion, (now, case.time), y, "DOP853", rtol=1e-12, atol=1e-15, events=events)
        now, y = found.t[-1], found.y[:, -1]
        if found.status == 1:  # a little past the event, so that it is not met again
            step = scipy.integrate.solve_ivp(motion, (now, min(now + 1e-7, case.time)), y, "DOP853", rtol=1e-12, atol=1e-15)
            now, y = step.t[-1], step.y[:, -1]
    return y[0]


def step_errors(lmp, folder, name):
    """Mean steps, and rms errors of the distance at the end over xi_s deq, of each row of STEPS."""
    case = CASES[name]
    write_body(folder, np.array([[5.0, 5.0, 5.0], [5.0 + case.d, 5.0, 5.0]]), np.array([[0.0, 20.0]] * 3))
    text = head(ROW._replace(gamma=case.gamma)).replace("contact none", f"contact {case.contact}")
    text += "variable d equal x[2]-x[1]\ngroup second id 2\nfix move all nve\nthermo 1000000\n"
    text += RUN.format(numbers=" ".join(map(str, STEPS.ravel())), place=5.0 + case.d, speed=case.speed * ROW.xi_s, time=case.time)
    ends = [line.split()[1:] for line in lmp(text).ok().stdout.splitlines() if line.startswith("END")]
    assert [int(steps) for steps, _ in ends] == list(STEPS.ravel())
    errors = np.array([float(d) for _, d in ends]).reshape(STEPS.shape) - relative_motion(case)
    return STEPS.mean(axis=1), np.sqrt(np.mean(errors**2, axis=1)) / ROW.xi_s


def order(steps, errors):
    """Slope of log error against log dt, dt ~ 1/steps."""
    return float(-np.polyfit(np.log(steps), np.log(errors), 1)[0])
