# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/curves.py, `curves.py cycle` and `curves.py table`: numbers of curves that turn back, known in closed form, departures from a
target, refusals."""

import csv
import re

import curves as tool
import numpy as np
import pytest
from evp import curves
from in_process import call

E, YIELD = 20e9, 100e6  # elastic and ideally plastic
EXACT = 1e-9


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


def swept(strain):
    """Curve of that body; the grips' stress is 1 % larger."""
    stress = plastic(strain)
    return curves.Curve(strain, 1.01 * stress, stress)


def write(path, curve, **more):
    """A CSV of the curve and more columns."""
    lines = [",".join((*curves.HEADER, *more)), *(",".join(f"{value:.17g}" for value in row) for row in zip(*curve, *more.values()))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


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
    write(tmp_path / "held.csv", curves.Curve(strain, stress, stress))
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


def test_cycle_command(tmp_path):
    strain = way((0.02, 0.0))
    for name, stress in (("flow", plastic(strain)), ("none", E * strain)):
        write(tmp_path / f"{name}.csv", curves.Curve(strain, stress, stress))
    shown = call(tool.main, "cycle", tmp_path / "flow.csv", "--out", tmp_path / "picture.png")
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.splitlines()[1].split()[1:5] == ["0.02", "100", "0.015", "0.005"]
    assert (tmp_path / "picture.png").read_bytes()[:4] == b"\x89PNG"
    assert "residual strain 1.50 %" in (tmp_path / "picture.csv").read_text()
    both = call(tool.main, "cycle", tmp_path / "none.csv", tmp_path / "flow.csv", "--labels", "this", "that", "--out", tmp_path / "picture.png")
    assert both.returncode == 0 and "\nthat: residual strain 1.50 %," in (tmp_path / "picture.csv").read_text(), both.stderr
    for labels in (("this",), ("this", "this")):
        wrong = call(tool.main, "cycle", tmp_path / "none.csv", tmp_path / "flow.csv", "--labels", *labels, "--out", tmp_path / "wrong.png")
        assert wrong.returncode == 1 and "--labels must give 2 words, one per curve" in wrong.stderr and not (tmp_path / "wrong.png").exists()
    write(tmp_path / "gauge.csv", swept(strain), strain_gauge=2 * strain)
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
    write(tmp_path / "gauge.csv", swept(strain), strain_gauge=gauge)
    assert len(curves.turns(gauge)) > 50, "control"
    shown = call(tool.main, "cycle", tmp_path / "gauge.csv", "--strain", "strain_gauge", "--out", tmp_path / "picture.png")
    assert shown.returncode == 0, shown.stderr
    turn, stress, residual, elastic, rest, unloading, area = map(float, shown.stdout.splitlines()[1].split()[1:])
    assert elastic == pytest.approx(1e-3 * stress / unloading, rel=1e-3) and residual + elastic + rest == pytest.approx(turn, rel=1e-3)
    assert turn == pytest.approx(0.02, abs=4e-4) and residual == pytest.approx(0.015, abs=4e-4) and unloading == pytest.approx(20.0, rel=0.05)
    assert area == pytest.approx(2.75, rel=0.01) and re.search(r"residual strain 1\.[45]\d %", (tmp_path / "picture.csv").read_text())
    shown = call(tool.main, "table", tmp_path / "gauge.csv", "--strain", "strain_gauge")
    words = shown.stdout.splitlines()[1].split()
    assert len(words) == 10 and float(words[9]) == pytest.approx(area, rel=1e-3), "one loop"
    assert float(words[1]) == pytest.approx(20.0, rel=0.05) and float(words[7]) == pytest.approx(residual, rel=1e-3)
    shown = call(tool.main, "numbers", tmp_path / "gauge.csv", "--strain", "strain_gauge")
    assert shown.stdout.count("NOTE") == 1 and "turns back at strain 0.0" in shown.stdout, shown.stdout + shown.stderr


# ---- tables ----


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_way_there_and_back(sign):
    """E, yield, stresses, residual strain, unloading modulus and area of the sweep; compression gives the same with its signs."""
    found = curves.table_numbers(swept(sign * way((0.02, 0.0))), strains=(0.002, 0.01, 0.02, 0.05))
    assert found["E_GPa"] == pytest.approx(20.0, rel=EXACT) and found["unloading_GPa"] == pytest.approx(20.0, rel=EXACT)
    assert found["yield_MPa"] == pytest.approx(sign * 100.0, rel=EXACT)
    stresses = [found[f"stress_at_{at:g}_MPa"] for at in (0.002, 0.01, 0.02, 0.05)]
    assert stresses[:3] == pytest.approx([sign * 40.0, sign * 100.0, sign * 100.0], rel=EXACT) and np.isnan(stresses[3])
    assert found["turn_strain"] == pytest.approx(sign * 0.02) and found["turn_MPa"] == pytest.approx(sign * 100.0)
    assert found["residual_strain"] == pytest.approx(sign * (0.02 - YIELD / E), rel=EXACT)
    area = YIELD * ((0.02 - YIELD / E) + (0.02 - 2 * YIELD / E)) + 0.5 * YIELD**2 / E
    assert found["area_1_MJ_per_m3"] == pytest.approx(1e-6 * area, rel=EXACT) and "area_2_MJ_per_m3" not in found


def test_loops_one_by_one():
    found = curves.table_numbers(swept(way((0.01, -0.01, 0.012, -0.01, 0.012, 0.0))))
    areas = [found[f"area_{k}_MJ_per_m3"] for k in (1, 2)]
    # The first loop ends farther than it began: what is held on the way there is in its area.
    first = 2 * YIELD * (0.02 - 2 * YIELD / E) + YIELD * 0.002
    assert areas == pytest.approx([1e-6 * first, 1e-6 * 2 * YIELD * (0.022 - 2 * YIELD / E)], rel=1e-6)


def test_rows_far_apart_are_interpolated():
    """In rows of 0.001 no window of +-0.0006 has three; vibration in dense rows is averaged out."""
    strain = way((0.02,), 1e-3)
    coarse = curves.Curve(strain, E * strain, E * strain)
    assert curves.table_numbers(coarse, strains=(0.0123,))["stress_at_0.0123_MPa"] == pytest.approx(246.0, rel=EXACT)
    strain = way((0.02,), 2e-5)
    shaken = E * strain + 2e6 * np.sin(2 * np.pi * strain / 1.2e-4)
    assert curves.stress_on(strain, shaken, 0.01) == pytest.approx(200e6, abs=0.2e6)
    assert np.abs(shaken - E * strain).max() > 1.7e6, "control"


TARGETS = {
    "0,0\n0.002,44e6\n0.01,90e6\n": "Pa, no header",
    "# a metal\nstrain,stress\n0,0\n0.002,44e6\n0.01,90e6\n": "Pa",
    "strain_percent,stress_MPa,note\n0,0,a\n0.2,44,b\n1,90,c\n": "percent and MPa",
    "strain stress_Pa\n0.01 90e6\n0.002 44e6\n0 0\n": "blanks, downwards",
}


@pytest.mark.parametrize("text", TARGETS, ids=TARGETS.get)
def test_departure_from_a_target(tmp_path, text):
    """40 against 44 MPa and 100 against 90 MPa: largest 10 MPa at 0.01, mean of 0, 4 and 10."""
    (tmp_path / "target.csv").write_text(text, encoding="utf-8")
    found = curves.departure(swept(way((0.02, 0.0))), curves.read_target(tmp_path / "target.csv"))
    assert list(found.values()) == pytest.approx([10.0, 0.01, 14 / 3, 1400 / 3 / 90, 3], rel=EXACT)


def test_departure_in_compression_and_beyond_the_end():
    target = np.array([-0.002, -0.01, -0.03]), np.array([-44e6, -90e6, -95e6])
    found = curves.departure(swept(-way((0.02,))), target)
    assert found["departure_largest_MPa"] == pytest.approx(-10.0, rel=EXACT) and (found["departure_rows"], found["departure_at_strain"]) == (2, -0.01)
    with pytest.raises(curves.CurveError, match="goes from strain 0 to 0.02 and reaches no row of the target"):
        curves.departure(swept(way((0.02,))), target)


def table(*words):
    return call(tool.main, "table", *words)


def test_table_prints_and_writes_all_curves(tmp_path):
    paths = [write(tmp_path / f"{name}.csv", swept(sign * way(turns))) for name, sign, turns in
             (("pull", 1, (0.02,)), ("sweep", 1, (0.02, 0.0)), ("push", -1, (0.02, 0.0)), ("loops", 1, (0.01, -0.01) * 3))]
    (tmp_path / "target.csv").write_text("0.002,44e6\n0.01,90e6\n", encoding="utf-8")
    shown = table(*paths[:2], paths[3], "--at", "0.002,0.01", "0.05", "--target", tmp_path / "target.csv", "--csv", tmp_path / "all.csv")
    assert shown.returncode == 0, shown.stderr
    lines = shown.stdout.splitlines()
    assert lines[1].split()[1:] == ["20", "0..0.003", "100", "40", "100", "-", "-", "-", "-", "-"]
    assert lines[2].split()[1:] == ["20", "0..0.003", "100", "40", "100", "-", "0.02", "0.015", "20", "2.75"]
    assert lines[3].split()[-2:] == ["2", "2"] and lines[5].startswith("departure from ")
    assert lines[7].split()[1:] == ["10", "0.01", "7", "7.7778", "2", "of", "2"]
    with open(tmp_path / "all.csv", encoding="utf-8", newline="") as source:
        rows = list(csv.DictReader(source))
    assert [row["curve"] for row in rows] == [str(path) for path in (*paths[:2], paths[3])]
    assert rows[0]["residual_strain"] == rows[0]["area_1_MJ_per_m3"] == rows[0]["stress_at_0.05_MPa"] == ""
    assert float(rows[1]["turn_MPa"]) == pytest.approx(100)
    assert [float(rows[2][f"area_{k}_MJ_per_m3"]) for k in (1, 2)] == pytest.approx([2.0, 2.0]) and rows[1]["area_2_MJ_per_m3"] == ""
    assert [float(row["departure_mean_percent"]) for row in rows] == pytest.approx(3 * [700 / 90])
    pushed = table(paths[2])
    assert pushed.returncode == 0 and pushed.stdout.splitlines()[1].split()[3:6] == ["-100", "-40", "-100"], pushed.stderr


def test_the_other_column(tmp_path):
    path = write(tmp_path / "pull.csv", swept(way((0.02,))))
    assert table(path, "--column", "grip").stdout.splitlines()[1].split()[1] == "20.2"
    assert table(path, "--fit", 0.006, 0.012).stdout.splitlines()[1].split()[2] == "0.006..0.012"


def test_a_curve_without_a_modulus_does_not_end_the_others(tmp_path):
    """Three rows that bend at once, and a curve that ends early: '-' for E and yield, a NOTE with the reason; their other numbers stay."""
    bent = np.array([0.0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.01])
    bent = curves.Curve(bent, *(1e6 * np.array([0.0, 40.0, 50.0, 55.0, 57.0, 58.0, 60.0]),) * 2)
    paths = [write(tmp_path / f"{name}.csv", curve) for name, curve in
             (("pull", swept(way((0.02,)))), ("bent", bent), ("short", swept(way((0.0005,)))), ("sweep", swept(way((0.02, 0.0)))))]
    shown = table(*paths, "--csv", tmp_path / "all.csv")
    assert shown.returncode == 0, shown.stderr
    lines = shown.stdout.splitlines()
    assert lines[1].split()[1:4] == lines[4].split()[1:4] == ["20", "0..0.003", "100"]
    assert lines[2].split()[1:6] == ["-", "-", "-", "50", "60"] and lines[3].split()[1:] == 9 * ["-"]
    assert "bent.csv has no E: the elastic part has fewer than three rows" in lines[5] and re.search(r"short.csv has no E: the curve has too few rows .*\(--fit\)", lines[6])
    with open(tmp_path / "all.csv", encoding="utf-8", newline="") as source:
        rows = list(csv.DictReader(source))
    assert [row["E_GPa"] for row in rows] == ["20", "", "", "20"] and float(rows[1]["stress_at_0.01_MPa"]) == pytest.approx(60.0)
    assert call(tool.main, "numbers", *paths).stdout.splitlines()[2].split()[1:4] == ["-", "-", "-"]
    alone = call(tool.main, "numbers", paths[1])
    assert alone.returncode == 1 and "bent.csv: the elastic part has fewer than three rows" in alone.stderr


BAD = {
    ("--at", "0.01,x"): "--at: could not convert string to float: 'x'",
    ("--at", "-0.01"): "--at -0.01: give positive strains",
    ("--at", "0.01,nan"): "give positive strains",
    ("--target", "absent.csv"): "absent.csv",
    ("--target", "empty.csv"): "empty.csv is empty: a target has rows strain,stress",
    ("--target", "names.csv"): "names.csv: the first line must name a column of strain strain_percent and one of stress stress_Pa",
    ("--target", "word.csv"): "word.csv holds a damaged line",
    ("--target", "short.csv"): "short.csv holds a damaged line",
    ("--target", "head.csv"): "head.csv holds no row",
    ("--target", "nan.csv"): "nan.csv holds no row, or a number that is not finite",
    ("--target", "back.csv"): "back.csv: the strains of a target must go one way, each once",
    ("--target", "far.csv"): "pull.csv: the curve goes from strain 0 to 0.02 and reaches no row of the target",
    ("--csv", "pull.csv"): "--csv pull.csv would be written over a file that is read",
    ("--target", "good.csv", "--csv", "good.csv"): "--csv good.csv would be written over a file that is read",
    ("--fit", "0.002", "0.001"): "the range of E must be 0 <= low < high, got 0.002 0.001",
}
FILES = {"empty.csv": "\n", "names.csv": "a,b\n1,2\n", "word.csv": "0,0\n0.1,x\n", "short.csv": "0,0\n0.1\n", "head.csv": "strain,stress\n",
         "nan.csv": "0,nan\n", "back.csv": "0,0\n0.1,1\n0.05,1\n", "far.csv": "0.5,1\n", "good.csv": "0.01,1e8\n"}


@pytest.mark.parametrize("words", BAD, ids=" ".join)
def test_misuse_gets_one_line(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "pull.csv", swept(way((0.02,))))
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    failed = table("pull.csv", *words)
    assert failed.returncode == 1 and failed.stderr.startswith("ERROR: ") and len(failed.stderr.splitlines()) == 1, failed.stderr
    assert BAD[words] in failed.stderr and failed.stdout == ""
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
