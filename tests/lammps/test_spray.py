# SPDX-License-Identifier: GPL-2.0-only
"""in.spray: a particle that is slow bounces off, one that is fast sticks, and what it says of them."""

import re

import numpy as np
import pytest
from lammps_run import read_csv, run_lammps

SIZE = 25e-6  # [m]


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    """A particle four spheres wide, and a plate."""
    folder = tmp_path_factory.mktemp("spray")
    (folder / "ball.region").write_text(f"region body sphere {SIZE / 2} 0 0 {SIZE / 2}\n")
    run_lammps("in.specimen", 1, {"n": 70, "shape": "region", "region": "ball.region", "length": SIZE, "out": "particle.data"}, folder).ok()
    run_lammps("in.specimen", 1, {"n": 250, "shape": "block", "length": 0.8 * SIZE, "width": 2 * SIZE, "height": 2 * SIZE, "out": "plate.data"}, folder).ok()
    return {"plate": folder / "plate.data", "particle": folder / "particle.data"}


@pytest.mark.parametrize("ranks, speed, sticks", [(1, 100, False), (2, 700, True)])
def test_slow_bounces_off_fast_sticks(tmp_path, bodies, ranks, speed, sticks):
    """The energies close to 1 % of the impact energy; momentum says how fast it bounces off; a hot particle is hotter in the end."""
    run = run_lammps("in.spray", ranks, {**bodies, "speed": speed, "temperature_particle": 400, "out": "run"}, tmp_path).ok()
    rows = read_csv(tmp_path / "run.csv")
    assert "give its data file more" not in run.stdout
    verdict = re.search(r"^in.spray: at \S+ m/s the particle (.*)$", run.stdout, re.M)[1]
    mass = 8960.0 * np.pi / 6.0 * SIZE**3
    assert verdict.startswith("sticks" if sticks else "rebounds") and (rows["joints"][-1] > 0) == sticks
    assert np.abs(rows["imbalance"]).max() < 0.01 * 0.5 * mass * speed**2 and rows["temperature_highest"][0] == 400.0
    assert (rows["speed"][-1] > 0.02 * speed) == (not sticks) and rows["height"][-1] < (0.8 if sticks else 1.0)


def test_a_row_of_particles(tmp_path, bodies):
    """Each is a body of its own: they hit one after the other."""
    run = run_lammps("in.spray", 2, {**bodies, "speed": 600, "count": 2, "pitch": 0.6 * SIZE, "out": "row"}, tmp_path).ok()
    rows = read_csv(tmp_path / "row.csv")
    assert re.search(r"the particle sticks", run.stdout) and np.sum(np.abs(rows["speed"] + 300.0) < 60.0) > 5 and rows["joints"][-1] > 0


def test_few_spheres_are_warned_of(tmp_path, bodies):
    (tmp_path / "ball.region").write_text(f"region body sphere {SIZE / 2} 0 0 {SIZE / 2}\n")
    run_lammps("in.specimen", 1, {"n": 28, "shape": "region", "region": "ball.region", "length": SIZE, "out": "few.data"}, tmp_path).ok()
    run = run_lammps("in.spray", 1, {**bodies, "particle": "few.data", "time": 1e-9, "out": "few"}, tmp_path)
    assert "WARNING: a particle is 3." in run.stdout and "give its data file more" in run.stdout
