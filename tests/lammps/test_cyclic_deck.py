# SPDX-License-Identifier: GPL-2.0-only
"""in.cyclic, the way back of in.quasistatic, and compression: which rows they write, and that eq. 8 retraces its curve."""

import functools
import re

import numpy as np
import pytest
from evp import curves
from lammps_run import REFERENCE, run_lammps

E = 20.65e9  # of the reference specimen, contact none [Pa]
DAMPED = {"coeff": "80 8 4 3 8 4 0.005 1000 1.5", "integrator": "implicit"}


def run(deck, folder, ranks=1, **choices):
    """A run of the reference specimen, its curve and what it printed."""
    found = run_lammps(deck, ranks, {"specimen": REFERENCE, "contact": "none", "out": "run", **choices}, folder)
    return curves.read_curve(folder / "run.csv"), found.ok()


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """run(), made once per module for the same choices; found.folder is not to be written in."""
    return functools.cache(lambda deck, **choices: run(deck, tmp_path_factory.mktemp("once"), **choices))


def test_by_default_one_sweep(tmp_path):
    """To 2 % and back: 200 rows each way, none twice, and the states at both ends. It retraces its curve."""
    curve, found = run("in.cyclic", tmp_path)
    assert len(curve.strain) == 1 + 2 * 200 + 2 and len(found.stdout.splitlines()) <= 100
    assert curve.strain.max() == pytest.approx(0.02, rel=1e-6) and abs(curve.strain[-1]) < 1e-7
    assert np.abs(np.diff(curve.strain)).max() <= 1e-4 * (1 + 1e-6)
    numbers = curves.cycle_numbers(curve)
    assert abs(numbers["residual_strain"]) < 2e-4 and numbers["turn_MPa"] == pytest.approx(179.0, rel=0.01)
    state = found.dump("run_state.dump")[-1]
    assert list(state.columns) == "id x y z radius bonds share_second share_lost new_pairs plastic_work plastic_strain volume_strain".split()


@pytest.mark.parametrize("choices", [
    {"strain": 0.004, "lower": -0.002, "cycles": 2}, {"strain": 0.004, "rate": -10, "lower": 0.002, "cycles": 2}, {"strain": 0.004, "lower": 0.0011, "cycles": 2}])
def test_turns(tmp_path, choices):
    """At strain and lower, by turns, on them also where rows do not divide the way; below the second regime on the one line."""
    curve, _ = run("in.cyclic", tmp_path, **choices)
    at = curve.strain[[*curves.turns(curve.strain), -1]]
    assert at == pytest.approx([np.sign(choices.get("rate", 1)) * choices["strain"], choices["lower"]] * 2, abs=1e-9)
    assert np.abs(np.diff(curve.strain)).max() <= 2e-5 * (1 + 1e-6)
    assert np.abs(curve.virial / E - curve.strain).max() < 1.5e-4


def test_lower_beyond_strain_goes_on(tmp_path):
    """Without a turn, at the same rate."""
    curve, _ = run("in.cyclic", tmp_path, strain=0.001, lower=0.002)
    assert curve.strain[-1] == pytest.approx(0.002, abs=1e-9) and curve.strain.max() < 0.002 + 1e-9


@pytest.mark.parametrize("choices", [{"strain": -0.01}, {"rate": -10, "strain": 0.01, "row": 0.0003}])
def test_compression(once, tmp_path, choices):
    """A negative strain or rate; with rows that do not divide the strain too. At rest the same stress."""
    curve, _ = run("in.traction", tmp_path, **choices)
    rest, _ = once("in.quasistatic", strain=-0.01)
    assert curve.strain.min() < -0.0098 and np.all(curve.strain <= 0.0)
    assert np.interp(0.0098, -curve.strain, -curve.virial) == pytest.approx(np.interp(0.0098, -rest.strain, -rest.virial), rel=5e-3)
    at_start = [np.polyfit(c.strain[c.strain > -0.002], c.virial[c.strain > -0.002], 1)[0] for c in (curve, rest)]
    assert at_start[0] == pytest.approx(at_start[1], rel=5e-3)
    assert E < at_start[1] < 1.04 * E, "pairs are stiffer in compression"


def test_release_of_eq_8_leaves_no_strain(tmp_path):
    """Up to the turn the rows are those of in.traction."""
    curve, found = run("in.cyclic", tmp_path, lower="release", rate=50)
    assert abs(curve.strain[-1]) < 2e-4 and "leg 2 ends at a strain of" in found.stdout and curve.virial.max() > 150e6
    pulled, _ = run("in.traction", tmp_path, strain=0.02, rate=50, dtfraction=0.24)
    assert curve.strain[:201] == pytest.approx(pulled.strain, abs=2e-6) and curve.virial[:201] == pytest.approx(pulled.virial, rel=0.02, abs=2e6)


def test_release_of_a_body_that_broke_ends(tmp_path):
    """It carries no stress at the turn: the run ends there, within a few rows."""
    curve, found = run("in.cyclic", tmp_path, plasticity="isotropic", lower="release", rate=100, strain=0.1, coeff="80 8 4 3 8 4 0.005 0 1.5 density 2700 damage 0.01 0 0 0 0 rupture 0")
    assert "leg 2 ends at a strain of" in found.stdout and curve.strain[-1] > 0.08 and abs(curve.virial[-1]) < 0.1 * curve.virial.max()


@pytest.mark.parametrize("choices", [{"rate": 50}, {**DAMPED, "strain": -0.015}])
def test_release_ends_at_zero_stress(once, choices):
    """Within a row, where the curve of a body that is pushed back to 0 crosses zero: strain - stress/E, less the flow back."""
    curve, found = once("in.cyclic", plasticity="isotropic", lower="release", **choices)
    row, most = abs(choices.get("strain", 0.02)) / 200, np.abs(curve.virial).max()
    end, top = curve.strain[-1], int(curves.turns(curve.strain)[0])
    said = re.search(r"leg 2 ends at a strain of (\S+) and a stress of (\S+) MPa$", found.stdout, re.M)
    assert float(said[1]) == pytest.approx(end, rel=1e-5) and float(said[2]) == pytest.approx(1e-6 * curve.virial[-1], rel=1e-2, abs=1e-3)
    assert len(curves.turns(curve.strain)) == 1 and np.abs(np.diff(curve.strain)).max() <= row * (1 + 1e-6)
    assert abs(curve.virial[-1]) < 0.006 * most + row * E
    back, _ = once("in.cyclic", plasticity="isotropic", lower=0, **choices)
    assert abs(end - curves.residual_strain(back.strain, back.virial)) < 1.5 * row and back.virial[-1] / back.virial[top] < -0.5, "control"
    first = np.abs(curve.strain[: top + 1]) <= 0.002
    modulus = np.polyfit(curve.strain[: top + 1][first], curve.virial[: top + 1][first], 1)[0]
    left = 1.0 - curve.virial[top] / modulus / curve.strain[top]
    assert left - 0.03 < end / curve.strain[top] < left + 0.02, "of the strain at the turn; a few pairs flow back, and a body that was pressed is stiffer"


def test_releases_in_cycles_on_two_ranks(tmp_path):
    """Each cycle goes up to the strain and ends at zero stress."""
    choices = {**DAMPED, "plasticity": "isotropic", "lower": "release", "cycles": 2, "strain": 0.01, "rate": 20}
    curve, found = run("in.cyclic", tmp_path, 2, **choices)
    ends = np.array([*curves.turns(curve.strain), len(curve.strain) - 1])
    assert len(ends) == 4 and curve.strain[ends[::2]] == pytest.approx([0.01] * 2, abs=1e-8)
    assert np.abs(curve.virial[ends[1::2]]).max() < 0.01 * curve.virial.max() and found.stdout.count(" ends at a strain of ") == 4


def test_at_rest_and_back(tmp_path):
    """Without a rate eq. 8 comes back to no stress; a run that ended goes on to other turns."""
    curve, _ = run("in.quasistatic", tmp_path, cycles=1, strain=0.01)
    assert len(curve.strain) == 41 and curve.strain.max() == pytest.approx(0.01, abs=1e-12)
    assert abs(curves.residual_strain(curve.strain, curve.virial)) < 1e-5
    assert abs(curve.virial[-1]) < 0.5e6 < 100e6 < curve.virial[-15]
    further, _ = run("in.quasistatic", tmp_path, resume="yes", cycles=2, strain=0.002, lower=-0.001)
    assert further.strain[[42, 48, 54]] == pytest.approx([-0.001, 0.002, -0.001], abs=1e-12) and len(further.strain) == 55


@pytest.mark.parametrize("plasticity, left, increment, cycles", [("isotropic", None, 0.001, 2), ("isotropic", None, 0.005, 0), ("none", 0.0, 0.005, 2)])
def test_release_at_rest(once, tmp_path, plasticity, left, increment, cycles):
    """in.quasistatic: at zero stress but for a thousandth, where the curve of a body that is pushed back crosses it; also without cycles."""
    choices = {"plasticity": plasticity, "increment": increment, "strain": 0.015, "cycles": cycles, "lower": "release"}
    curve, _ = run("in.quasistatic", tmp_path, **choices)
    assert np.abs(curve.virial[-1]) < 0.0012 * curve.virial.max() and curve.strain.max() == pytest.approx(0.015, abs=1e-9)
    zero = np.abs(curve.virial[1:]) < 0.0012 * curve.virial.max()
    assert zero.sum() == max(cycles, 1), "at the end of each cycle"
    if left is None:
        back, _ = once("in.quasistatic", plasticity=plasticity, increment=0.0005, strain=0.015, cycles=1)
        left = curves.residual_strain(back.strain, back.virial)
        assert left > 0.006 and back.virial[-1] < -100e6, "control"
    assert curve.strain[1:][zero] == pytest.approx([left] * zero.sum(), abs=2e-5 if left == 0.0 else 1e-4)
