# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/curves.py and curves.py cycle: numbers of curves that turn back, known in closed form."""

import re

import curves as tool
import numpy as np
import pytest
from evp import curves
from in_process import call

E, YIELD = 20e9, 100e6  # elastic and ideally plastic


def way(turns, step=1e-4):
    """Strains along 0 and all turns, rows `step` apart."""
    ends = (0.0, *turns)
    legs = [np.linspace(a, b, 1 + round(abs(b - a) / step))[1:] for a, b in zip(ends, ends[1:])]
    return np.concatenate([[0.0], *legs])


def plastic(strain):
    """Stress of the elastic, ideally plastic body along a way."""
    stress, flow = [], 0.0
    for value in strain:
        trial = E * (value - flow)
        flow += (trial - np.clip(trial, -YIELD, YIELD)) / E
        stress.append(np.clip(trial, -YIELD, YIELD))
    return np.array(stress)


def test_one_sweep():
    strain = way((0.02, 0.0))
    stress = plastic(strain)
    assert curves.turns(strain).tolist() == [200]
    assert curves.residual_strain(strain, stress) == pytest.approx(0.02 - YIELD / E, rel=1e-12)
    assert curves.unloading_modulus(strain, stress) == pytest.approx(E, rel=1e-9)
    dissipated = YIELD * ((0.02 - YIELD / E) + (0.02 - 2 * YIELD / E)) + 0.5 * YIELD**2 / E  # the last part is held at -YIELD
    assert curves.loop_areas(strain, stress)[0] == pytest.approx(dissipated, rel=1e-9)


@pytest.mark.parametrize("end", [0.0, 0.017])
def test_unloading_modulus_of_a_body_that_flows_back_early(end):
    """Back stress: the elastic part of the way back, 0.001, is a fourth of the range that the slope is otherwise taken over."""
    strain, early = way((0.02, end)), 10e6
    back = np.maximum(np.abs(strain - 0.02) - 2 * early / E, 0.0)
    stress = np.where(np.arange(len(strain)) <= 200, YIELD, YIELD - E * np.minimum(np.abs(strain - 0.02), 2 * early / E) - 0.1 * E * back)
    assert curves.unloading_modulus(strain, stress) == pytest.approx(E, rel=0.02)
    assert np.polyfit(strain[200:231], stress[200:231], 1)[0] < 0.5 * E, "control: it does flow back"


def test_unloading_modulus_of_a_way_back_that_ends_unloaded():
    """A release of a stiff metal is shorter than the range that the slope is otherwise taken over."""
    strain = way((0.02, 0.018))
    stress = np.where(np.arange(len(strain)) <= 200, YIELD, YIELD - 0.5 * YIELD * (0.02 - strain) / 0.001)
    assert curves.unloading_modulus(strain, stress) == pytest.approx(0.5 * YIELD / 0.001, rel=1e-9)
    with pytest.raises(curves.CurveError, match="too few rows"):
        curves.unloading_modulus(strain[:-2], stress[:-2])


@pytest.mark.parametrize("sign", [1, -1])
def test_loops(sign):
    """Three loops between -1 and 1 %: each 2 YIELD (range - 2 YIELD/E); pushed first, the same."""
    strain = sign * way((0.01, -0.01) * 3 + (0.01,))
    stress = plastic(strain)
    assert len(curves.turns(strain)) == 7
    assert curves.residual_strain(strain, stress) == pytest.approx(sign * 0.005, rel=1e-12)
    assert curves.loop_areas(strain, stress) == pytest.approx([2 * YIELD * (0.02 - 2 * YIELD / E)] * 3, rel=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("end, turns, loop", [((0.01,), 3, True), ((0.01, 0.0), 3, True), ((0.01, -0.01), 3, True), ((0.0099,), 3, True), ((0.0095,), 2, False)])
def test_a_loop_of_two_turns(sign, end, turns, loop):
    """It needs no third turn: it is closed where the strain is back, to within a row, with or without rows after it. A way that does not come
    back closes none: the area is that of the first loading and the way back."""
    strain = sign * way((0.01, -0.01, *end))
    closed, swept = 2 * YIELD * (0.02 - 2 * YIELD / E), 0.03 * YIELD - 2.5 * YIELD**2 / E
    assert curves.turns(strain)[:2].tolist() == [100, 300] and len(curves.turns(strain)) == turns
    area = closed - YIELD * abs(0.01 - end[0]) if loop else swept
    assert curves.loop_areas(strain, plastic(strain)) == pytest.approx([area], rel=1e-9)


def test_a_body_that_retraces_its_curve_leaves_nothing():
    strain = way((0.01, 0.0))
    stress = E * strain - 3e11 * strain**2
    assert abs(curves.residual_strain(strain, stress)) < 1e-15
    assert abs(curves.residual_strain(strain, stress + 1000.0)) < 1e-7, "the last row just misses zero"
    assert np.isnan(curves.residual_strain(strain, stress + 1e8))
    assert abs(curves.loop_areas(strain, stress)[0]) < 1e-9 * E


@pytest.mark.parametrize("seed", range(5))
def test_a_body_that_vibrates_at_the_end(seed):
    """The stress of a way back to zero stress vibrates by 1 MPa and never crosses zero: the line of its end does, where the curve without vibration does."""
    strain = way((0.02, 0.015))
    rows = np.arange(len(strain))
    stress = plastic(strain) + np.where(rows > 200, 1.2e6 + 1e6 * np.sin(2.4 * rows + seed), 0.0)
    stress[-1] = stress[-2] + 3e5
    assert np.all(stress[201:] > 0.0), "control"
    assert curves.residual_strain(strain, stress) == pytest.approx(0.015 - 1.2e6 / E, abs=2e6 / E)
    assert curves.residual_strain(-strain, -stress) == -curves.residual_strain(strain, stress)


def test_a_body_that_is_not_unloaded_has_no_residual_strain(tmp_path):
    strain = way((0.02, 0.017))
    stress = plastic(strain)
    stress[-1] = stress[-2]
    assert np.isnan(curves.residual_strain(strain, stress))
    lines = [",".join(curves.HEADER), *(f"{a:.17g},{b:.17g},{b:.17g}" for a, b in zip(strain, stress))]
    (tmp_path / "held.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    shown = call(tool.main, "cycle", tmp_path / "held.csv", "--out", tmp_path / "held.png")
    assert shown.returncode == 0 and re.search(r"^\S*/held.csv +0.02 +100 +- +- ", shown.stdout, re.M), shown.stdout
    assert "held.csv has no residual strain: the way back ends before zero stress; -var lower release" in shown.stdout and "nan" not in shown.stdout
    assert "held: no residual strain (not unloaded)," in (tmp_path / "held_plot.csv").read_text()


def test_rows_of_equal_strain_are_no_turns():
    strain = np.array([0.0, 0.001, 0.002, 0.002, 0.003, 0.003, 0.002, 0.001])
    assert curves.turns(strain).tolist() == [5]


def test_curves_that_do_not_turn_or_end_too_soon():
    strain = way((0.02,))
    for number in (curves.residual_strain, curves.loop_areas, curves.unloading_modulus):
        with pytest.raises(curves.CurveError, match="does not turn back"):
            number(strain, plastic(strain))
    short = way((0.02, 0.018))
    with pytest.raises(curves.CurveError, match="too few rows"):
        curves.unloading_modulus(short, plastic(short))


def test_command(tmp_path):
    strain = way((0.02, 0.0))
    for name, stress in (("flow", plastic(strain)), ("none", E * strain)):
        lines = [",".join(curves.HEADER), *(f"{a:.17g},{b:.17g},{b:.17g}" for a, b in zip(strain, stress))]
        (tmp_path / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    shown = call(tool.main, "cycle", tmp_path / "flow.csv", "--out", tmp_path / "picture.png")
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.splitlines()[1].split()[1:5] == ["0.02", "100", "0.015", "20"]
    assert (tmp_path / "picture.png").read_bytes()[:4] == b"\x89PNG"
    assert "residual strain 1.50 %" in (tmp_path / "picture.csv").read_text()
    both = call(tool.main, "cycle", tmp_path / "none.csv", tmp_path / "flow.csv", "--labels", "this", "that", "--out", tmp_path / "picture.png")
    assert both.returncode == 0 and "\nthat: residual strain 1.50 %," in (tmp_path / "picture.csv").read_text(), both.stderr
    for labels in (("this",), ("this", "this")):
        wrong = call(tool.main, "cycle", tmp_path / "none.csv", tmp_path / "flow.csv", "--labels", *labels, "--out", tmp_path / "wrong.png")
        assert wrong.returncode == 1 and "--labels must give 2 words, one per curve" in wrong.stderr and not (tmp_path / "wrong.png").exists()
    lines = ["strain,stress_grip,stress_virial,strain_gauge", *(f"{a:.17g},{b:.17g},{b:.17g},{2 * a:.17g}" for a, b in zip(strain, plastic(strain)))]
    (tmp_path / "gauge.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for command, place in (("cycle", 3), ("table", 7)):
        shown = call(tool.main, command, tmp_path / "gauge.csv", "--strain", "strain_gauge")
        assert shown.stdout.splitlines()[1].split()[place] == "0.03", "residual strain of the extensometer"
    shown = call(tool.main, "plot", tmp_path / "gauge.csv", "--strain", "strain_gauge", "--out", tmp_path / "drawn.png")
    assert shown.returncode == 0 and "\nTraction,gauge,4,100\n" in (tmp_path / "drawn.csv").read_text()
    drawn, before = tmp_path / "flow.png", (tmp_path / "flow.csv").read_text()
    shown = call(tool.main, "cycle", tmp_path / "flow.csv", "--out", drawn)
    assert shown.returncode == 0 and "flow_plot.csv" in shown.stdout and (tmp_path / "flow.csv").read_text() == before
    assert "residual strain 1.50 %" in (tmp_path / "flow_plot.csv").read_text()


def test_loads_of_an_extensometer_turn_where_the_grips_do(tmp_path):
    """Its strain jitters by more than it goes on between two rows: turns in it alone are many, and none of the body."""
    strain = way((0.02, 0.0))
    gauge = strain - 3e-4 * (np.arange(len(strain)) % 7 == 3)
    lines = ["strain,stress_grip,stress_virial,strain_gauge", *(f"{a:.17g},{b:.17g},{b:.17g},{c:.17g}" for a, b, c in zip(strain, plastic(strain), gauge))]
    (tmp_path / "gauge.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert len(curves.turns(gauge)) > 50, "control"
    shown = call(tool.main, "cycle", tmp_path / "gauge.csv", "--strain", "strain_gauge", "--out", tmp_path / "picture.png")
    assert shown.returncode == 0, shown.stderr
    turn, _, residual, unloading, area = map(float, shown.stdout.splitlines()[1].split()[1:])
    assert turn == pytest.approx(0.02, abs=4e-4) and residual == pytest.approx(0.015, abs=4e-4) and unloading == pytest.approx(20.0, rel=0.05)
    assert area == pytest.approx(2.75, rel=0.01) and re.search(r"residual strain 1\.[45]\d %", (tmp_path / "picture.csv").read_text())
    shown = call(tool.main, "table", tmp_path / "gauge.csv", "--strain", "strain_gauge")
    words = shown.stdout.splitlines()[1].split()
    assert len(words) == 10 and float(words[9]) == pytest.approx(area, rel=1e-3), "one loop"
    assert float(words[1]) == pytest.approx(20.0, rel=0.05) and float(words[7]) == pytest.approx(residual, rel=1e-3)
    shown = call(tool.main, "numbers", tmp_path / "gauge.csv", "--strain", "strain_gauge")
    assert shown.stdout.count("NOTE") == 1 and "turns back at strain 0.0" in shown.stdout, shown.stdout + shown.stderr
