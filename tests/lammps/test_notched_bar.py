# SPDX-License-Identifier: GPL-2.0-only
"""regions/notched.lmp, packed by in.specimen and pulled apart by in.traction: geometry, net section, where it breaks."""

import re

import notched_tension
import numpy as np
import pytest
from evp import curves, specimen
from lammps_run import read_dump, run_lammps

NET = 1e-4  # cross-section between the notches [m2]
VOLUME = 2e-4 * 0.05 - 2 * (0.002 * 0.004 + np.pi * 0.001**2 / 2) * 0.01  # without two slots with round ends [m3]


@pytest.fixture(scope="module")
def bar(tmp_path_factory):
    folder = tmp_path_factory.mktemp("notched")
    run_lammps("in.specimen", 1, {**notched_tension.BAR, "n": 2000, "out": "notched.data"}, folder).ok()
    return folder / "notched.data"


def test_measures_are_those_of_the_drawing(bar):
    lines = dict(re.findall(r"^variable (\w+) equal (\S+)", (bar.parent / "notched.data.body").read_text(encoding="utf-8"), re.M))
    assert float(lines["length"]) == 0.05 and float(lines["area"]) == pytest.approx(NET, rel=0.01)
    assert float(lines["volume"]) == pytest.approx(VOLUME, rel=0.003) == notched_tension.VOLUME
    assert float(lines["solid_fraction"]) == pytest.approx(0.60, abs=0.015)
    body = specimen.read_data(bar)
    assert not ((np.abs(body.x[:, 0] - 0.025) < 0.001) & (np.abs(body.x[:, 1]) > 0.0055)).any(), "in a slot"


def test_it_breaks_at_the_notches(bar, tmp_path):
    """It parts, and what has flowed most and the atoms that lost bonds are near mid-length; stress is that of the net section."""
    choices = {**notched_tension.PULL, "specimen": bar, "strain": 0.03, "break": 0.05, "out": "pull"}
    found = run_lammps("in.traction", 1, choices, tmp_path).ok()
    assert float(re.search(r"cross-section (\S+) m2", found.stdout)[1]) == pytest.approx(NET, rel=0.01)
    curve = curves.read_curve(tmp_path / "pull.csv")
    read = notched_tension.rupture_of(curve, int(curves.read_columns(tmp_path / "pull.csv", ("broken",))["broken"][-1]))
    assert 150.0 < read.peak < 230.0 and 0.005 < read.at < read.strain < 0.025 and 20.0 < read.work < 150.0
    state = read_dump(tmp_path / "pull_state.dump")[-1]
    before = specimen.read_data(bar).x[:, 0]
    lost = state["share_lost"] > 0.0
    assert lost.sum() > 50 and np.median(np.abs(before[lost] - 0.025)) < 0.003, "the body is 0.05 m long"
