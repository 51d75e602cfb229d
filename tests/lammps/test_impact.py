# SPDX-License-Identifier: GPL-2.0-only
"""in.impact: with plasticity the plate keeps a crater and the ball comes back slower than with the reversible law; friction slows it along the plate."""

import re

from evp.specimen import read_data
import numpy as np
import pytest
from lammps_run import DECKS, read_csv, read_dump, run_lammps

LINE = re.compile(r"^crater depth (\S+) m, rebound speed (\S+) m/s$", re.M)
SPEED = 60.0


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    """A plate of 700 spheres and a ball of 120, of about the same size."""
    folder = tmp_path_factory.mktemp("bodies")
    (folder / "ball.region").write_text("region body sphere 0.004 0 0 0.004\n")
    run_lammps("in.specimen", 1, {"n": 700, "shape": "block", "length": 0.006, "width": 0.016, "height": 0.016, "out": "plate.data"}, folder).ok()
    run_lammps("in.specimen", 1, {"n": 120, "shape": "region", "region": "ball.region", "length": 0.008, "out": "ball.data"}, folder).ok()
    return {"plate": folder / "plate.data", "ball": folder / "ball.data"}


def run(folder, bodies, ranks=1, **choices):
    """(crater, rebound speed), energy imbalance, what was printed."""
    found = run_lammps("in.impact", ranks, {**bodies, "out": "run", "speed": SPEED, **choices}, folder).ok()
    imbalance = float(re.search(r"energy imbalance over impact energy: (\S+)", found.stdout)[1])
    return [float(word) for word in LINE.search(found.stdout).groups()], imbalance, found


def test_crater_and_rebound(tmp_path, bodies):
    """Within 1e-3 of the impact energy; the wall's force is the change of the ball's momentum; the reversible law leaves no crater. Frames show the
    held spheres at rest and the others not."""
    (crater, rebound), imbalance, found = run(tmp_path, bodies, also=DECKS / "frames.lmp", frames=2)
    rows = read_csv(tmp_path / "run.csv")
    assert crater > 4e-5 and 0.0 < rebound < 0.6 * SPEED and abs(imbalance) < 1e-3
    assert "WARNING" not in found.stdout and len(found.stdout.splitlines()) <= 90
    energy = rows["kinetic_energy"][0]
    mass = 2.0 * energy / SPEED**2
    assert np.sum(rows["force"][1:] * np.diff(rows["time"])) == pytest.approx(mass * (rebound + SPEED), rel=2e-3)
    assert 0.3 * energy < rows["plastic_work"][-1] < energy and np.all(np.diff(rows["plastic_work"]) >= 0.0)
    state, start = read_dump(tmp_path / "run_state.dump")[-1], read_data(bodies["plate"])
    assert set(state["type"]) == {1, 2} and state["plastic_strain"].max() > 0.01
    near = np.flatnonzero(start.x[:, 0] > 0.006 - 0.75 * 2.0 * start.radius.mean())
    assert crater == pytest.approx((start.x[near, 0] - state["x"][near]).max(), rel=1e-3) and len(near) > 3, "the largest sink of the face"
    first, *_, last = read_dump(tmp_path / "run_frames.dump")
    rest = np.abs(last.vectors("x", "y", "z") - first.vectors("x", "y", "z")).max(axis=1) < 1e-12
    assert rest.sum() > 50 and not np.any(rest & (first["type"] == 2)) and first["x"][rest].max() < 0.5 * first["x"][first["type"] == 1].max()

    (none, twin), balance, _ = run(tmp_path, bodies, plasticity="none")
    assert abs(none) < 0.2 * crater and twin > 1.3 * rebound and abs(balance) < 5e-3


@pytest.mark.parametrize("choices, left", [({"speed": 10}, True), ({"time": 1e-5}, False)])
def test_the_run_ends_once_the_ball_has_left(tmp_path, bodies, choices, left):
    """However slow the ball is; a run that ends before by -var time says so."""
    metal = DECKS.parent / "potentials/metals.evp"
    (_, rebound), _, found = run(tmp_path, bodies, material=f"{metal}:aluminium_2024T351", material_ball=f"{metal}:steel_4340", **choices)
    force = read_csv(tmp_path / "run.csv")["force"]
    assert (rebound > 0.0) == left == (abs(force[-1]) < 1e-6 * force.max())
    assert left != ("WARNING: the run ends before the ball has left the plate" in found.stdout) and f"coeff_ball {metal}:steel_4340" in found.stdout


def test_a_metal_flows_inside_and_not_where_it_touches(tmp_path, bodies):
    """With hardly any hardening ball and plate do not run into each other: the crater is that of a granular contact, which cannot flow."""
    metal = {"material": DECKS.parent / "potentials/metals.evp:aluminium_2024T351", "time": 6e-5}
    (crater, rebound), imbalance, found = run(tmp_path, bodies, **metal)
    lowest = float(re.search(r"lowest d/\(R_i \+ R_j\) (\S+);", found.stdout)[1])
    (granular, twin), _, _ = run(tmp_path, bodies, friction=0, **metal)
    assert abs(imbalance) < 1e-3 and lowest > 0.75 and "WARNING" not in found.stdout
    assert crater == pytest.approx(granular, rel=0.15) and rebound == pytest.approx(twin, rel=0.1) and crater > 1e-5


def test_friction_of_the_ball(tmp_path, bodies):
    """A ball that flies obliquely loses more of its speed along the plate with friction, and the balance closes."""
    left = {}
    for friction in ("off", 0.4):
        _, imbalance, found = run(tmp_path, bodies, 2, speed=50, sideways=50, time=8e-5, friction=friction)
        left[friction] = float(re.search(r"^speed along the plate (\S+) m/s", found.stdout, re.M)[1])
        assert abs(imbalance) < 1e-3 or friction == "off", "above"
    assert left[0.4] < left["off"] - 3.0, left
