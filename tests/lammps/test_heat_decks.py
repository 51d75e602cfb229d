# SPDX-License-Identifier: GPL-2.0-only
"""in.slab beside Fourier's law and the Fourier series; in.adiabatic beside the temperature by hand, with its energies and its account of heat."""

import re

import numpy as np
import pytest
from lammps_run import DECKS, REFERENCE, packed, read_csv, read_dump, run_lammps

ROW = "80 8 4 3 8 4 0.005 0 1.5 density 2700 capacity 875 conductivity"
FRAMES = DECKS / "frames.lmp"

periodic = packed("periodic.data", n=300, shape="periodic", length=0.04)


def slab(folder, ranks, **choices):
    """(columns of PREFIX.csv, flux over that of Fourier's law at both ends, temperature in the middle, by the law)."""
    run = run_lammps("in.slab", ranks, {"specimen": REFERENCE, "coeff": f"{ROW} 120", **choices}, folder).ok()
    assert not run.warnings()
    found = re.search(r"^in.slab: flux (\S+) at the left and (\S+) at the right end of that of Fourier, \S+ W; in the middle (\S+) K, by Fourier (\S+) K", run.stdout, re.M)
    return read_csv(folder / "slab.csv"), *map(float, found.groups())


@pytest.mark.parametrize("ranks", [1, 2])
def test_heat_through_a_body(tmp_path, ranks):
    """As much as by the law, and the transient on the way; the heat that the ends gave is in the body or has left it."""
    curve, left, right, middle, by_law = slab(tmp_path, ranks, also=FRAMES, frames=2)
    assert [left, right] == pytest.approx([1.0, 1.0], abs=0.03) and by_law == 350.0
    assert middle == pytest.approx(by_law, abs=1.0)
    late = curve["fourier"] > 0.099
    assert len(curve["rms"]) == 101 and curve["rms"][late].max() < 0.04 and curve["rms"][late][0] > curve["rms"][-1]
    end = read_dump(tmp_path / "slab_state.dump")[-1]["temperature"]
    assert end == pytest.approx(read_dump(tmp_path / "slab_frames.dump")[-1]["temperature"], rel=1e-8) and (end.min(), end.max()) == (300.0, 400.0)
    taken = np.sum(np.diff(curve["time"]) * (curve["flux_left"] - curve["flux_right"])[1:])
    free = (end > 300.0) & (end < 400.0)
    capacity = 2700 * 875 * 6.283185307e-05 / 500  # of a mean sphere
    assert taken == pytest.approx(capacity * np.sum(end[free] - 300.0), rel=0.03)


@pytest.mark.parametrize("ranks, conductivity", [(1, 30), (2, 12)])
def test_two_materials(tmp_path, ranks, conductivity):
    """Resistances in series."""
    curve, left, right, middle, by_law = slab(tmp_path, ranks, coeff_right=f"{ROW} {conductivity}", rows=20)
    assert [left, right] == pytest.approx([1.0, 1.0], abs=0.03)
    assert by_law == pytest.approx(400.0 - 100.0 / (1.0 + 120.0 / conductivity), rel=1e-5)
    assert middle == pytest.approx(by_law, abs=1.0) and np.all(curve["rms"] <= 0.0)


def test_a_row_without_thermal_values(tmp_path):
    run = run_lammps("in.slab", 1, {"specimen": REFERENCE, "coeff": "80 8 4 3 8 4 0.005 0 1.5 density 2700"}, tmp_path)
    assert run.returncode == 1 and "ERROR: in.slab: the coefficients lack thermal values" in run.stdout


@pytest.mark.parametrize("ranks, strain, stored", [(1, 1.0, 0.03), (2, 0.3, 0.05)])
def test_a_body_that_heats_itself(periodic, tmp_path, ranks, strain, stored):
    """As by hand, but for the share of the work that bonds and volume energy store."""
    run = run_lammps("in.adiabatic", ranks, {"specimen": periodic, "strain": strain, "also": FRAMES, "frames": 2}, tmp_path).ok()
    assert not run.warnings()
    curve = read_csv(tmp_path / "adiabatic.csv")
    end = {name: column[-1] for name, column in curve.items()}
    rise, by_hand = end["temperature"] - 298.0, end["temperature_by_hand"] - 298.0
    assert rise == pytest.approx((1.0 - stored) * by_hand, rel=0.015) and rise > 20.0
    assert by_hand == pytest.approx(0.9 * 0.005 * np.sum(curve["shear_stress"][1:]) / (2770 * 875), rel=2e-3)
    assert abs(end["energy_imbalance"]) <= 1e-3 * end["plastic_work"] < 1e-3 / 0.9 * end["heat"]
    assert abs(end["heat_imbalance"]) <= 1e-10 * end["heat"]
    frames = read_dump(tmp_path / "adiabatic_frames.dump")
    assert len(frames) == 3 and frames[-1]["temperature"].max() == pytest.approx(end["temperature_highest"], rel=1e-6)


# ---- a body at one temperature ----

SOFT = "112.684 8 4 4.22565 8 4 0.00250348 0 1.5 spacing 0.00485024 coordination 15.03 kv 1680.64 flow 0 1 0.001 1.15352 0.02 1.42511 0.2 1.93004 yield 2.65e+08 density 2770 soften 298 775 1"
bar = packed("bar.data", n=200)


@pytest.mark.parametrize("deck, ranks, choices", [("in.traction", 1, {"rate": 50}), ("in.traction", 2, {"rate": 50}), ("in.quasistatic", 1, {"increment": 0.001})])
def test_a_test_at_a_temperature(bar, tmp_path, deck, ranks, choices):
    """At the one of the flow curve the same curve as without; at 500 K softer by 1 - (500 - 298)/(775 - 298), though the row expands: nothing grows."""
    def stress(**more):
        run_lammps(deck, ranks, {"specimen": bar, "coeff": SOFT, "plasticity": "isotropic", "strain": 0.012, "out": "part", **choices, **more}, tmp_path).ok()
        curve = read_csv(tmp_path / "part.csv")
        return curve["stress_grip"][curve["strain"] > 0.008]

    cold, hot = stress(), stress(temperature=500)
    assert np.array_equal(stress(temperature=298), cold) and len(cold) > 3
    assert np.array_equal(stress(temperature=500, coeff=f"{SOFT} expansion 2.3e-5 298"), hot)
    assert hot == pytest.approx((1.0 - 202.0 / 477.0) * cold, rel=0.06)


def test_a_hot_run_that_stopped_goes_on(bar, tmp_path):
    """To the same rows; not at another temperature."""
    choices = {"specimen": bar, "coeff": SOFT, "plasticity": "isotropic", "strain": 0.006, "increment": 0.001, "temperature": 500}
    run_lammps("in.quasistatic", 1, {**choices, "out": "whole"}, tmp_path).ok()
    (tmp_path / "stop.lmp").write_text('if "${k} == 3" then quit\n')
    run_lammps("in.quasistatic", 1, {**choices, "out": "part", "also": "stop.lmp"}, tmp_path)
    assert len(read_csv(tmp_path / "part.csv")["strain"]) < 6, "control: it stopped"
    for other in ({"temperature": 0}, {"temperature": 400}):
        refused = run_lammps("in.quasistatic", 1, {**choices, **other, "out": "part", "resume": "yes"}, tmp_path)
        assert refused.returncode != 0 and "ERROR: in.quasistatic: part.resume is of a run with another 'temperature'" in refused.stdout
    run_lammps("in.quasistatic", 1, {**choices, "out": "part", "resume": "yes"}, tmp_path).ok()
    assert (tmp_path / "part.csv").read_text() == (tmp_path / "whole.csv").read_text()


def test_a_row_without_softening(bar, tmp_path):
    run = run_lammps("in.traction", 1, {"specimen": bar, "temperature": 500}, tmp_path)
    assert run.returncode == 1 and "ERROR: -var temperature: the coefficients have no softening by temperature: add soften TREF TMELT M" in run.stdout
