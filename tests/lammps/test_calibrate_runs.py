# SPDX-License-Identifier: GPL-2.0-only
"""tools/calibrate.py with lmp on a small body: killed and gone on with, failures on the way, the row in a deck and in shear,
the walk of the Howto page."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import doc_blocks
import numpy as np
import pytest
from evp import calibration, flow
from lammps_run import LMP, REPOSITORY

CALIBRATE = REPOSITORY / "tools" / "calibrate.py"
TARGETS = {"E": 70e9, "nu": 0.33, "yield": 95e6}
CURVE = flow.through(70e9, 95e6, ((150e6, 0.04),))
UP_TO_YIELD = ["--E", "70e9", "--yield", "95e6", "--density", "2700", "--ranks", "1", "--name", "mine", "--spheres", "150"]
WORDS = ["--E", "70e9", "--yield", "95e6", "--stress", "150e6@0.04", "--density", "2700", "--ranks", "1", "--nu", "0.33", "--name", "mine", "--spheres", "150"]
SECONDS = 120

# Stands for lmp: counts its calls, spoils one of in.quasistatic on the way, and tells that it started.
STAND_IN = """#!{python}
import os, subprocess, sys
folder, deck = {folder!r}, sys.argv[sys.argv.index("-in") + 1]
with open(folder + "/calls", "a") as target:
    target.write(os.path.basename(deck) + "\\n")
calls = open(folder + "/calls").read().split().count("in.quasistatic")
code = subprocess.call([{lmp!r}, *sys.argv[1:]])
if deck.endswith("in.quasistatic"):
    {spoil}
sys.exit(code)
"""


def stand_in(folder, spoil="pass"):
    """An environment whose lmp is the stand-in."""
    path = folder / "lmp"
    path.write_text(STAND_IN.format(python=sys.executable, folder=str(folder), lmp=str(LMP), spoil=spoil), encoding="utf-8")
    path.chmod(0o755)
    return {**os.environ, "EVP_LMP": str(path)}


def start(folder, environment=None, words=WORDS):
    return subprocess.Popen([sys.executable, CALIBRATE, *words, "--out", "my.evp"], cwd=folder, stdin=subprocess.DEVNULL,
                            env=environment or {**os.environ, "EVP_LMP": str(LMP)}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def calibrate(folder, environment=None, words=WORDS, code=0):
    """Output of a calibration to its end, which is to have this exit code."""
    process = start(folder, environment, words)
    output, _ = process.communicate(timeout=SECONDS)
    assert process.returncode == code, output
    return output


def row_of(folder):
    return [line for line in (folder / "my.evp").read_text(encoding="utf-8").splitlines() if line.startswith("mine ")][0]


def table_of(folder, name="mine"):
    return [json.loads(line) for line in (folder / f"my.{name}.jsonl").read_text(encoding="utf-8").splitlines()][1:]


def met(runs, curve=CURVE, plastic=0.03, within=0.01):
    """The last row meets E and nu; both ways together the yield stress and the true stress at a plastic strain."""
    last = [next(run["found"] for run in reversed(runs) if run["kind"] == way) for way in ("tension", "compression")]
    assert (last[0]["modulus"], last[0]["nu"]) == pytest.approx((TARGETS["E"], TARGETS["nu"]), rel=within)
    true = []
    for found in last:
        strain, stress = np.array(found["strain"]), np.array(found["stress"])
        factor = 1.0 + found["sign"] * strain
        true.append(np.interp(plastic, np.abs(np.log(factor)) - stress * factor / TARGETS["E"], stress * factor))
    assert np.mean(true) == pytest.approx(curve.at(plastic), rel=2.0 * within)
    assert np.mean([found["offset_yield"] for found in last]) == pytest.approx(TARGETS["yield"], rel=5.0 * within)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A calibration that nothing disturbed."""
    folder = tmp_path_factory.mktemp("whole") / "in a folder:with spaces"
    folder.mkdir()
    calibrate(folder)
    return folder


def test_targets_are_met_and_told(whole):
    """A name is taken once."""
    runs = table_of(whole)
    assert len(runs) <= 8 and all(run["state"] == "done" for run in runs)
    met(runs)
    text = (whole / "my.evp").read_text(encoding="utf-8")
    assert "#   elastic: E +" in text.replace("E -", "E +") and "#   compression: 0.2 % yield" in text and "DATE: 20" in text and "by: calibrate.py --E 70e9" in text
    assert sorted(path.name for path in whole.iterdir()) == ["my.evp", "my.mine.jsonl", "my.mine.png", "my.mine.png.csv"]
    assert (whole / "my.mine.png").stat().st_size > 10000
    assert "holds a row 'mine' already" in calibrate(whole, code=1) and (whole / "my.evp").read_text(encoding="utf-8") == text


def test_stopped_in_a_run_and_gone_on_with(whole, tmp_path):
    """Of the table of another calibration but for its last three runs: by Ctrl-C after one of them, then killed after two; the same row comes, and only the
    runs that were not finished are made."""
    environment, table = stand_in(tmp_path), tmp_path / "my.mine.jsonl"
    whole_table = (whole / "my.mine.jsonl").read_text(encoding="utf-8").splitlines(True)
    table.write_text("".join(whole_table[:-3]), encoding="utf-8")
    for left, end, code in ((2, signal.SIGINT, 130), (1, signal.SIGKILL, -9)):
        process, limit = start(tmp_path, environment), time.monotonic() + SECONDS
        while table.read_text(encoding="utf-8").count("\n") < len(whole_table) - left:
            assert process.poll() is None and time.monotonic() < limit
            time.sleep(0.01)
        process.send_signal(end)
        output = process.communicate(timeout=SECONDS)[0]
        assert process.returncode == code, output
        assert not (tmp_path / "my.evp").exists()
        time.sleep(1.0)  # what a killed calibration left running ends
    kept = len(table.read_text(encoding="utf-8").splitlines()) - 1
    (tmp_path / "calls").unlink()
    assert f"going on after {kept} runs" in calibrate(tmp_path, environment)
    assert row_of(tmp_path) == row_of(whole)
    calls = (tmp_path / "calls").read_text(encoding="utf-8").split()
    assert 3 <= calls.count("in.quasistatic") / (len(table_of(whole)) - kept) <= 5, "legs of a way"
    assert [run["found"] for run in table_of(tmp_path)] == [run["found"] for run in table_of(whole)]


@pytest.fixture(scope="module")
def spoilt(tmp_path_factory):
    """(folder, output) of a calibration of a metal that hardly hardens. Its first run loses its curve to NaN, the second attempt ends badly, the third
    is done with a quarter of the increments."""
    folder = tmp_path_factory.mktemp("spoilt")
    spoil = """if calls == 3:
        text = open("load.csv").read().splitlines()
        open("load.csv", "w").write("\\n".join(text[:-1] + ["0.05,nan,nan,0.05"]) + "\\n")
    if calls == 4:
        code = 1"""
    return folder, calibrate(folder, stand_in(folder, spoil), [*UP_TO_YIELD, "--stress", "97e6@0.0112", "--nu", "0.33"])


def test_failures_are_told_and_tried_again_smaller(spoilt):
    folder, output = spoilt
    runs = table_of(folder)
    assert [(run["number"], run["state"], run["increments"]) for run in runs[:3]] == [(1, "failed", 1.0), (1, "failed", 0.5), (1, "done", 0.25)]
    assert "not finite" in runs[0]["reason"] and "in.quasistatic failed" in runs[1]["reason"]
    assert "again with 0.25 of the increments" in output
    met(runs, flow.through(70e9, 95e6, ((97e6, 0.0112),)), 0.008)


def test_a_miss_is_told_and_the_nearest_row_written(tmp_path):
    """Poisson's ratio of a body of few spheres is above 0.25 without a volume energy.

    The strain has more digits than the nine that in.quasistatic gets.
    """
    output = calibrate(tmp_path, words=[*UP_TO_YIELD, "--stress", "130e6@0.0212345678312", "--nu", "0.25", "--tension"], code=3)
    assert re.search(r"calibrate.py: missed: elastic nu \+\d.*The row is the nearest of [2-4]$", output, re.M)
    assert "kv" not in row_of(tmp_path) and "compression" not in output
    found = table_of(tmp_path)[-1]["found"]
    assert found["nu"] > 1.03 * 0.25 and (found["modulus"], found["offset_yield"]) == pytest.approx((70e9, 95e6), rel=0.04)


def test_a_metal_that_hardly_hardens(spoilt):
    """Its bonds hold less as they flow: in.quasistatic minimizes again where bonds had to flow at fixed distance."""
    row = row_of(spoilt[0]).split()
    assert min(map(float, row[row.index("flow") + 2 : row.index("density") : 2])) < 0.95


def test_walk_of_the_howto_page(tmp_path):
    """Its commands run as they stand, and the numbers that it prints come out. With an over-stress beside: gamma is in the row, and the over-stress of
    the damped run over its twin is the one asked for."""
    doc_blocks.prepare(tmp_path)
    blocks = [block.text for block in doc_blocks.blocks("doc/Howto_evp_metal.rst")][:6]
    text = "".join(blocks[k] for k in (0, 2, 3, 4))
    assert "--spheres 300" in text
    printed = doc_blocks.run(doc_blocks.Block("", text.replace("--spheres 300", "--spheres 300 --rate 10e6@200")).commands(), tmp_path)
    shown, found = (re.search(r"^(mymetal \S.*)$", output, re.M)[1].split() for output in (blocks[1], printed))
    assert [word for word in found if word.isalpha()] == [word for word in shown if word.isalpha()] and blocks[5].splitlines()[0] in printed
    ours, page = ([float(word) for k, word in enumerate(row) if k != 8 and not word.isalpha()] for row in (found, shown))  # but for gamma
    assert ours == pytest.approx(page, rel=0.02)
    again, modulus = (float(re.search(r"^ *pull\.csv +([\d.]+)", output, re.M)[1]) for output in (printed, blocks[5]))
    assert again == pytest.approx(modulus, rel=0.01)
    rates = {run["number"]: run["found"] for run in table_of(tmp_path, "mymetal") if run["kind"] == "rate"}
    assert float(found[8]) > 0.0 and rates[max(rates)] - rates[0] == pytest.approx(10e6, rel=0.01)


def test_shear_of_a_row(tmp_path, monkeypatch):
    """A small body with contact join; its stress, averaged over 0.2 of strain, is about that of the metal."""
    monkeypatch.setenv("EVP_LMP", str(LMP))
    monkeypatch.setattr(calibration, "SHEAR_SPHERES", 200)
    alloy = calibration.Targets(73e9, flow.johnson_cook(265e6, 426e6, 0.34), 2770.0)
    calibration.make_periodic(tmp_path, 1, alloy.density, SECONDS)
    material = {"material": f"{REPOSITORY / 'potentials' / 'metals.evp'}:aluminium_2024T351"}
    run = calibration.shear(material, alloy, 0.5, 1.0, 1, tmp_path, SECONDS, "shear")
    assert (run.strain[0], run.strain[-1]) == pytest.approx((0.1, 0.5), abs=0.012)
    assert run.stress_at(0.5) == pytest.approx(alloy.curve.at(0.5 / np.sqrt(3.0)) / np.sqrt(3.0), rel=0.2)
    assert "contact join within 1.2" in (tmp_path / "in.shear.log").read_text(encoding="utf-8")
