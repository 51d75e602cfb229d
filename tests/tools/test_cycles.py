# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/curves.py, `curves.py cycle` and `curves.py table`: numbers of curves that turn back, known in closed form, departures from a
target, refusals."""

import csv
import re

import curves as tool
import numpy as np
import pytest
from evp import curves, measured
from inputs import call, curve_file

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


def run(*words):
    """The words of the first line of numbers, and all that was printed, of curves.py."""
    shown = call(tool.main, *words)
    assert shown.returncode == 0, shown.stderr
    return shown.stdout.partition("\n")[2].partition("\n")[0].split()[1:], shown.stdout


@pytest.mark.parametrize("end, early", [(0.0, 10e6), (0.017, 10e6), (0.018, np.inf)])
def test_unloading_modulus_over_a_range_that_is_shorter_than_usual(end, early):
    """early: the elastic part of the way back, 0.001, is a fourth of that range, as the body flows back; inf: the release of a stiff metal ends before."""
    strain = way((0.02, end))
    slope, left = (E, 2 * early / E) if early < np.inf else (0.5 * YIELD / 0.001, 1.0)
    back = np.maximum(0.02 - strain, 0.0) * (np.arange(len(strain)) > 200)
    stress = YIELD - slope * np.minimum(back, left) - 0.1 * E * np.maximum(back - left, 0.0)
    assert curves.unloading_modulus(strain, stress) == pytest.approx(slope, rel=0.02 if early < np.inf else EXACT)
    if early < np.inf:
        assert np.polyfit(strain[200:231], stress[200:231], 1)[0] < 0.5 * E, "control: it does flow back"


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("end, turns, loop", [((0.01,), 3, True), ((0.01, 0.0), 3, True), ((0.01, -0.01), 3, True), ((0.0099,), 3, True), ((0.0095,), 2, False)])
def test_a_loop_of_two_turns(sign, end, turns, loop):
    """Between -1 and 1 %: 2 YIELD (range - 2 YIELD/E); pushed first, the same. It needs no third turn: it is closed where the strain is back, to
    within a row, with or without rows after it. A way that does not come back closes none: the area is that of the first loading and the way back."""
    strain = sign * way((0.01, -0.01, *end))
    closed, open_loop = 2 * YIELD * (0.02 - 2 * YIELD / E), 0.03 * YIELD - 2.5 * YIELD**2 / E
    assert curves.turns(strain)[:2].tolist() == [100, 300] and len(curves.turns(strain)) == turns
    area = closed - YIELD * abs(0.01 - end[0]) if loop else open_loop
    assert curves.loop_areas(strain, plastic(strain)) == pytest.approx([area], rel=1e-9)
    assert curves.residual_strain(strain, plastic(strain)) == pytest.approx(sign * 0.005, rel=1e-12)


def test_loops_one_by_one():
    """The second ends farther than it began: what is held on the way there is in its area."""
    found = curves.table_numbers(swept(way((0.01, -0.01, 0.01, -0.01, 0.012, -0.01, 0.012, 0.0))))
    areas = [2 * YIELD * (reach - 2 * YIELD / E) + more for reach, more in ((0.02, 0.0), (0.02, 0.002 * YIELD), (0.022, 0.0))]
    assert [found[f"area_{k}_MJ_per_m3"] for k in (1, 2, 3)] == pytest.approx([1e-6 * area for area in areas], rel=1e-6)


def test_a_body_that_retraces_its_curve_leaves_nothing():
    assert curves.turns(np.array([0.0, 0.001, 0.002, 0.002, 0.003, 0.003, 0.002, 0.001])).tolist() == [5], "rows of equal strain are no turns"
    strain = way((0.01, 0.0))
    stress = E * strain - 3e11 * strain**2
    assert abs(curves.residual_strain(strain, stress)) < 1e-15 and abs(curves.loop_areas(strain, stress)[0]) < 1e-9 * E
    assert abs(curves.residual_strain(strain, stress + 1000.0)) < 1e-7, "the last row just misses zero"
    assert np.isnan(curves.residual_strain(strain, stress + 1e8))


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


def test_rows_far_apart_are_interpolated():
    """In rows of 0.001 no window of +-0.0006 has three; vibration in dense rows is averaged out."""
    strain = way((0.02,), 1e-3)
    coarse = curves.Curve(strain, E * strain, E * strain)
    assert curves.table_numbers(coarse, strains=(0.0123,))["stress_at_0.0123_MPa"] == pytest.approx(246.0, rel=EXACT)
    strain = way((0.02,), 2e-5)
    shaken = E * strain + 2e6 * np.sin(2 * np.pi * strain / 1.2e-4)
    assert curves.stress_on(strain, shaken, 0.01) == pytest.approx(200e6, abs=0.2e6)
    assert np.abs(shaken - E * strain).max() > 1.7e6, "control"


# ---- the commands ----


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Curves in a folder of their own, the current one."""
    monkeypatch.chdir(tmp_path)
    there, back, held = way((0.02,)), way((0.02, 0.0)), swept(way((0.02, 0.017)))
    held.virial[-1] = held.virial[-2]
    few = np.array([0.0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.01])
    known = {"pull": swept(there), "sweep": swept(back), "push": swept(-back), "loops": swept(way((0.01, -0.01) * 3)), "held": held,
             "none": curves.Curve(back, E * back, E * back), "short": swept(way((0.0005,))),
             "bent": curves.Curve(few, *(1e6 * np.array([0.0, 40.0, 50.0, 55.0, 57.0, 58.0, 60.0]),) * 2)}
    for name, curve in known.items():
        curve_file(tmp_path / f"{name}.csv", curve)
    curve_file(tmp_path / "gauge.csv", swept(back), strain_gauge=2 * back)
    jitter = back - 3e-4 * (np.arange(len(back)) % 7 == 3)
    assert len(curves.turns(jitter)) > 50, "control"
    curve_file(tmp_path / "jitter.csv", swept(back), strain_gauge=jitter)
    (tmp_path / "target.csv").write_text("0.002,44e6\n0.01,90e6\n", encoding="utf-8")
    return tmp_path


def test_cycle_command(files):
    assert run("cycle", "sweep.csv", "--out", "picture.png")[0][:4] == ["0.02", "100", "0.015", "0.005"]
    assert (files / "picture.png").read_bytes()[:4] == b"\x89PNG" and "residual strain 1.50 %" in (files / "picture.png.csv").read_text()
    run("cycle", "none.csv", "sweep.csv", "--labels", "this", "that", "--out", "picture.png")
    assert "\nthat: residual strain 1.50 %," in (files / "picture.png.csv").read_text()
    numbers, shown = run("cycle", "held.csv", "--out", "left.png")
    assert numbers[:4] == ["0.02", "100", "-", "-"] and "nan" not in shown
    assert "held.csv has no residual strain: the way back ends before zero stress; -var lower release" in shown
    assert "held: no residual strain (not unloaded)," in (files / "left.png.csv").read_text()
    run("cycle", *(curve_file(files / f"{k}.csv", swept(way((0.02, 0.0)))) for k in range(9)), "--out", "nine.png")
    assert "\n8: residual strain 1.50 %," in (files / "nine.png.csv").read_text(), "more curves than colors"


def test_loads_of_an_extensometer_turn_where_the_grips_do(files):
    """Its strain may jitter by more than it goes on between two rows: turns in it alone are many, and none of the body."""
    for command, place in (("cycle", 2), ("table", 6)):
        assert run(command, "gauge.csv", "--strain", "strain_gauge")[0][place] == "0.03", "residual strain"
    run("plot", "gauge.csv", "--strain", "strain_gauge", "--out", "drawn.png")
    assert "\nTraction,gauge,4,100\n" in (files / "drawn.png.csv").read_text()
    numbers, _ = run("cycle", "jitter.csv", "--strain", "strain_gauge", "--out", "picture.png")
    turn, stress, residual, elastic, rest, unloading, area = map(float, numbers)
    assert elastic == pytest.approx(1e-3 * stress / unloading, rel=1e-3) and residual + elastic + rest == pytest.approx(turn, rel=1e-3)
    assert turn == pytest.approx(0.02, abs=4e-4) and residual == pytest.approx(0.015, abs=4e-4) and unloading == pytest.approx(20.0, rel=0.05)
    assert area == pytest.approx(2.75, rel=0.01) and re.search(r"residual strain 1\.[45]\d %", (files / "picture.png.csv").read_text())
    words, _ = run("table", "jitter.csv", "--strain", "strain_gauge")
    assert len(words) == 9 and float(words[8]) == pytest.approx(area, rel=1e-3), "one loop"
    assert float(words[0]) == pytest.approx(20.0, rel=0.05) and float(words[6]) == pytest.approx(residual, rel=1e-3)
    shown = run("numbers", "jitter.csv", "--strain", "strain_gauge")[1]
    assert shown.count("NOTE") == 1 and "turns back at strain 0.0" in shown


def test_table_prints_and_writes_all_curves(files):
    """A curve without a modulus does not end the others: '-' for E and yield, and a NOTE with the reason; their other numbers stay."""
    names = ["pull.csv", "sweep.csv", "loops.csv", "bent.csv"]
    shown = run("table", *names, "--at", "0.002,0.01", "0.05", "--target", "target.csv", "--csv", "all.csv")[1]
    lines = shown.splitlines()
    assert lines[1].split()[1:] == ["20", "0..0.003", "100", "40", "100", "-", "-", "-", "-", "-"]
    assert lines[2].split()[1:] == ["20", "0..0.003", "100", "40", "100", "-", "0.02", "0.015", "20", "2.75"]
    assert lines[3].split()[-2:] == ["2", "2"] and lines[4].split()[1:6] == ["-", "-", "-", "50", "60"]
    assert lines[6].startswith("departure from ") and lines[8].split()[1:] == ["10", "0.01", "7", "7.7778", "2", "of", "2"]
    assert "bent.csv has no E: the elastic part has fewer than three rows" in lines[-1]
    with open("all.csv", encoding="utf-8", newline="") as source:
        rows = list(csv.DictReader(source))
    assert [row["curve"] for row in rows] == names and [row["E_GPa"] for row in rows] == ["20", "20", "20", ""]
    assert rows[0]["residual_strain"] == rows[0]["area_1_MJ_per_m3"] == rows[0]["stress_at_0.05_MPa"] == rows[1]["area_2_MJ_per_m3"] == ""
    assert float(rows[1]["turn_MPa"]) == pytest.approx(100) and float(rows[3]["stress_at_0.01_MPa"]) == pytest.approx(60.0)
    assert [float(rows[2][f"area_{k}_MJ_per_m3"]) for k in (1, 2)] == pytest.approx([2.0, 2.0])
    assert [float(row["departure_mean_percent"]) for row in rows[:3]] == pytest.approx(3 * [700 / 90])
    numbers, shown = run("table", "short.csv")
    assert numbers == 9 * ["-"] and re.search(r"short.csv has no E: the curve has too few rows .*\(--fit\)", shown)
    numbers, shown = run("numbers", "pull.csv", "short.csv")
    assert numbers[0] == "20" and "short.csv has no E" in shown


@pytest.mark.parametrize("words, place, number", [(("push.csv",), slice(2, 5), ["-100", "-40", "-100"]), (("pull.csv", "--fit", 0.006, 0.012), 1, "0.006..0.012")])
def test_choices_of_the_table(files, words, place, number):
    assert run("table", *words)[0][place] == number


@pytest.mark.parametrize("text, sign, expected", [
    *((text, 1.0, [10.0, 0.01, 14 / 3, 1400 / 3 / 90, 3]) for text in (
        "0,0\n0.002,44e6\n0.01,90e6\n", "# a metal\nstrain,stress\n0,0\n0.002,44e6\n0.01,90e6\n",
        "strain_percent,stress_MPa,note\n0,0,a\n0.2,44,b\n1,90,c\n", "strain stress_Pa\n0.01 90e6\n0.002 44e6\n0 0\n")),
    ("-0.002,-44e6\n-0.01,-90e6\n-0.03,-95e6\n", -1.0, [-10.0, -0.01, 7.0, 700 / 90, 2])])
def test_departure_from_a_target(tmp_path, text, sign, expected):
    """40 against 44 MPa and 100 against 90 MPa: largest 10 MPa at 0.01, mean of 0, 4 and 10; a row beyond the end does not count."""
    (tmp_path / "target.csv").write_text(text, encoding="utf-8")
    found = curves.departure(swept(sign * way((0.02, 0.0))), measured.read_target(tmp_path / "target.csv"))
    assert list(found.values()) == pytest.approx(expected, rel=EXACT)


@pytest.mark.parametrize("text", [
    "strain_percent\tstress_MPa\n0,00\t0,0\n1,25\t115,13\n", "strain_percent stress_MPa\n0,0 0,0\n1,25 115,13\n", "strain [-],stress [Pa],time [s]\n0,0,0\n0.0125,115.13e6,7\n",
    "Strain (%);Stress / MPa;\r\n0;0,0;\r\n1,25;115,13;\r\n", '"Strain, %","Stress, MPa"\n"0,00","0,0"\n"1,25","115,13"\n',
    '"Time","Tensile strain","Tensile stress"\n"(s)","(mm/mm)","(MPa)"\n"0","0,00","0,0"\n"1","0,0125","115,13"\n',
    "Test 17\nDate;2020-01-01\nStrain rate [1/s];stress [N/mm\u00b2];strain [%]\n1;0;0\n1;115,13;1,25\n", "Strain / % Stress / GPa Time / s\n0 0 0\n1.25 0.11513 7\n",
    "strain [\u00b5m/m]\tstress in kPa\n0\t0\n12500\t115130\n", "strain_percent,stress_MPa\n0 0\n1.25 115.13\n", "stress,strain_percent\n0,0\n115.13e6,1.25",
    "# a metal\n# strain_percent stress_MPa\n0 0\n1.25 115.13\n"])
@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_files_of_testing_machines_and_spreadsheets(tmp_path, text, code):
    """Units, other columns, decimal commas; with line ends or not."""
    (tmp_path / "target.txt").write_bytes(text.encode(code))
    strain, stress = measured.read_points(tmp_path / "target.txt")
    assert strain == pytest.approx([0.0, 0.0125], rel=EXACT) and stress == pytest.approx([0.0, 115.13e6], rel=EXACT)


@pytest.mark.parametrize("every, sign", [(1, 1.0), (2, 1.0), (4, -1.0), (20, 1.0)])
def test_a_run_that_is_the_target_departs_by_nothing(every, sign):
    """Also where it bends, with all of its rows as a target or some."""
    strain = np.arange(0.0, 0.03, 0.00025)
    stress = np.minimum(20e9 * strain, 80e6 + 1e9 * strain) + (1e6 * np.sin(3e4 * strain) if every == 1 else 0.0)
    bend = int(np.argmax(strain > 80e6 / 19e9))
    strain[bend], stress[bend] = 80e6 / 19e9, 20e9 * 80e6 / 19e9
    rows = slice(bend % every, None, every)
    found = curves.departure(curves.Curve(sign * strain, sign * stress, sign * stress), (sign * strain[rows], sign * stress[rows]))
    assert abs(found["departure_largest_MPa"]) < 1e-6 and found["departure_rows"] == len(strain[rows])


BAD_TARGETS = {
    "\n": "bad.csv is empty: a target has rows strain,stress",
    "a,b\n1,2\n": "bad.csv: the first line must name a column of strain, such as strain [%]",
    "0,0\n0.1,x\n": "bad.csv holds a damaged line", "0,0\n0.1\n": "bad.csv holds a damaged line", "strain,stress\n": "bad.csv holds no row",
    "0,nan\n": "bad.csv holds no row, or a number that is not finite",
    "0,0\n0.1,1\n0.05,1\n": "bad.csv: strains that do not grow: row 3 of the numbers goes back to strain 0.05 from 0.1 in row 2",
    "strain_percent,stress_MPa\n0,00,0,0\n1,25,115,13\n": "has 4 values for 2 columns; where the comma is the decimal sign, put ';' or tabs",
    "0,00,0,0\n1,25,115,13\n": "bad.csv has 4 columns and no line that names them", "0 0 0\n1 2 3\n": "bad.csv has 3 columns and no line that names them",
    "strain\tstress_MPa\n0\t0\n0.01\t1,151.3\n": "bad.csv has numbers with commas and numbers with points",
    "strain;stress [Pa]\n0;0\n1;1,151\n": "bad.csv: '1,151' may have a decimal comma or one that groups thousands",
    "strain,stress [kgf/mm2]\n0,0\n": "column 'stress [kgf/mm2]': the unit 'kgf/mm2' is none of Pa", "strain,stress [mPa]\n0,0\n": "the unit 'mPa' is none of",
    "strain,stress_Nmm2\n0,0\n": "column 'stress_Nmm2': its unit cannot be told: call it stress, in Pa", "% strain,stress\n0,0\n": "its unit cannot be told",
    "PK\x03\x04\0\0": "bad.csv is no text file: save the curve as a CSV",
    "strain,force [N]\n0,0\n": "must name a column of stress, such as stress [MPa]", "true strain,true stress [MPa]\n0,0\n": "nominal values are asked for",
    "plastic strain,stress [MPa]\n0,0\n": "must name a column of strain", "strain,stress A,stress B\n0,0,0\n": "several columns of stress: stress A, stress B; leave one",
    "0.5,1\n": "pull.csv: the curve goes from strain 0 to 0.02 and reaches no row of the target",
}
BAD = {
    "--at 0.01,x": "argument --at: invalid strains value: '0.01,x'",
    "--at -0.01": "argument --at: give a positive number, got -0.01",
    "--at 0.01,nan": "argument --at: give a positive number, got nan",
    "--csv pull.csv": "--csv pull.csv would be written over a file that is read",
    "--target target.csv --csv target.csv": "--csv target.csv would be written over a file that is read",
    "--fit 0.002 0.001": "the range of E must be 0 <= low < high, got 0.002 0.001",
    "--fit -0.001 0.002": "the range of E must be 0 <= low < high",
}
CYCLE = ("cycle", "none.csv", "sweep.csv", "--out", "wrong.png", "--labels", "this")


@pytest.mark.parametrize("words, message", [
    *((("table", "pull.csv", "--target", text), message) for text, message in BAD_TARGETS.items()),
    *((("table", "pull.csv", *words.split()), message) for words, message in BAD.items()),
    *((words, "--labels must give 2 words, one per curve") for words in (CYCLE, (*CYCLE, "this"))),
    (("cycle", "pull.csv"), "pull.csv: the curve does not turn back; it ends at strain 0.02")])
def test_misuse_gets_one_line(files, words, message):
    if words[-1] in BAD_TARGETS:
        (files / "bad.csv").write_text(words[-1], encoding="utf-8")
        words = (*words[:-1], "bad.csv")
    before = {path.name: path.read_bytes() for path in files.iterdir()}
    failed = call(tool.main, *words)
    option = message.startswith("argument ")  # told by the parser of options, below its usage
    assert failed.returncode == 1 + option and (option or failed.stderr.startswith("curves.py: error: ") and len(failed.stderr.splitlines()) == 1), failed.stderr
    assert message in failed.stderr and failed.stdout == ""
    assert {path.name: path.read_bytes() for path in files.iterdir()} == before
