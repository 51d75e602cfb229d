# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/accuracy_cost.py: runs of small bodies are read, and the share of the largest stable timestep is the one of the setting."""

import accuracy_cost
import pytest
from study import Runs


def test_share_of_the_timestep_of_an_impact(tmp_path):
    """A 2.5 times smaller timestep, as many more steps but for whole numbers in a row, and nearly the same crater; a run that is kept is not repeated."""
    runs = Runs(tmp_path)
    coarse, fine, again = (accuracy_cost.measure(runs, "impact", label, 400, 1) for label in ("timestep 0.05", "timestep 0.02", "timestep 0.05"))
    assert fine.steps == pytest.approx(2.5 * coarse.steps, rel=0.25) and coarse == again and coarse.seconds > 0.0
    assert fine.found == pytest.approx(coarse.found, rel=0.02) and fine.found != coarse.found


@pytest.mark.parametrize("scene, label", [("pull", "increment 0.005"), ("cycle", "increment 0.004")])
def test_numbers_are_read(tmp_path, scene, label):
    found = accuracy_cost.measure(Runs(tmp_path), scene, label, 200, 1)
    assert found.steps > 100 and all(value > 0.0 for name, value in found.found.items() if "unloading" not in name)
