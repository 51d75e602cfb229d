# SPDX-License-Identifier: GPL-2.0-only
"""fix nve/evp solves for the damping over a timestep, which must be positive."""

import pytest
from hostile import SECONDS, refused, scene

POSITIVE = "Fix move nve/evp: with damping the timestep must be positive, got "
DAMPED = {"coeff": "pair_coeff * * 80 8 4 3 8 4 0.005 100 1.5", "move": "fix move all nve/evp\nvelocity all create 1 1"}


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("step", ["0", "-1e-07"])
def test_at_set_up(lmp, step, ranks):
    refused(lmp(scene(**DAMPED, step=f"timestep {step}"), ranks, seconds=SECONDS), POSITIVE + f"{step} at step 0")


@pytest.mark.parametrize("step", ["0", "-1e-07"])
def test_between_runs_without_set_up(lmp, step):
    refused(lmp(scene(**DAMPED, after=f"timestep {step}\nrun 1 pre no"), seconds=SECONDS), POSITIVE + step, stepped=True)


@pytest.mark.parametrize("step", ["0", "-1e-07"])
def test_without_damping_any_step_will_do(lmp, step):
    """As with fix nve."""
    parts = {"step": f"timestep {step}", "thermo": "thermo_style custom step pe ke\nthermo_modify format float %.17g"}
    one, other = (lmp(scene(move=f"fix move all {style}\nvelocity all create 1 1", **parts), seconds=SECONDS).ok().thermo()
                  for style in ("nve/evp", "nve"))
    assert all(list(one[name]) == list(other[name]) for name in ("PotEng", "KinEng"))
