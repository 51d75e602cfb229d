# SPDX-License-Identifier: GPL-2.0-only
"""tools/calibrate.py with lmp on a small body: killed and gone on with, failures on the way, the row in a deck, the walk of the Howto page."""

import json
import os
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import time

import pytest
from lammps_run import LMP, REPOSITORY, run_lammps

CALIBRATE = REPOSITORY / "tools" / "calibrate.py"
TARGETS = {"E": 70e9, "yield": 95e6, "stress at 0.04": 150e6, "nu": 0.33}
WORDS = ["--E", "70e9", "--yield", "95e6", "--stress", "150e6@0.04", "--nu", "0.33", "--density", "2700", "--name", "mine", "--spheres", "150", "--ranks", "1"]
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


def start(folder, environment=None, words=()):
    return subprocess.Popen([sys.executable, CALIBRATE, *WORDS, "--out", "my.evp", *words], cwd=folder, stdin=subprocess.DEVNULL,
                            env=environment or {**os.environ, "EVP_LMP": str(LMP)}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def calibrate(folder, environment=None, words=()):
    """(exit code, output) of a calibration to its end."""
    process = start(folder, environment, words)
    output, _ = process.communicate(timeout=SECONDS)
    return process.returncode, output


def row_of(folder):
    return [line for line in (folder / "my.evp").read_text(encoding="utf-8").splitlines() if line.startswith("mine ")][0]


def table_of(folder):
    return [json.loads(line) for line in (folder / "my.mine.jsonl").read_text(encoding="utf-8").splitlines()][1:]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A calibration that nothing disturbed."""
    folder = tmp_path_factory.mktemp("whole") / "in a folder:with spaces"
    folder.mkdir()
    code, output = calibrate(folder)
    assert code == 0, output
    return folder


def test_targets_are_met_and_told(whole):
    runs = table_of(whole)
    assert len(runs) <= 8 and all(run["state"] == "done" for run in runs)
    for name, value in TARGETS.items():
        assert runs[-1]["found"][name] == pytest.approx(value, rel=0.01), name
    text = (whole / "my.evp").read_text(encoding="utf-8")
    assert "E 7e+10 Pa (" in text and "DATE: 20" in text and "by: calibrate.py --E 70e9" in text
    assert sorted(path.name for path in whole.iterdir()) == ["my.evp", "my.mine.csv", "my.mine.jsonl", "my.mine.png"]
    assert (whole / "my.mine.png").stat().st_size > 10000


def test_a_name_is_taken_once(whole):
    before = (whole / "my.evp").read_bytes()
    code, output = calibrate(whole)
    assert code == 1 and "holds a row 'mine' already" in output
    assert (whole / "my.evp").read_bytes() == before


def test_stopped_in_a_run_and_gone_on_with(whole, tmp_path):
    """By Ctrl-C after a run, then killed after two; the same row comes, and only the runs that were not finished are made."""
    environment, table = stand_in(tmp_path), tmp_path / "my.mine.jsonl"
    for lines, end, code in ((2, signal.SIGINT, 130), (3, signal.SIGKILL, -9)):
        process, limit = start(tmp_path, environment), time.monotonic() + SECONDS
        while not (table.exists() and table.read_text(encoding="utf-8").count("\n") >= lines):
            assert process.poll() is None and time.monotonic() < limit
            time.sleep(0.01)
        process.send_signal(end)
        output = process.communicate(timeout=SECONDS)[0]
        assert process.returncode == code, output
        assert not (tmp_path / "my.evp").exists()
        time.sleep(1.0)  # what a killed calibration left running ends
    kept = len(table.read_text(encoding="utf-8").splitlines()) - 1
    (tmp_path / "calls").unlink()
    code, output = calibrate(tmp_path, environment)
    assert code == 0 and f"going on after {kept} runs" in output
    assert row_of(tmp_path) == row_of(whole)
    calls = (tmp_path / "calls").read_text(encoding="utf-8").split()
    assert calls.count("in.quasistatic") == 3 * (len(table_of(whole)) - kept) and "in.specimen" not in calls
    assert [run["found"] for run in table_of(tmp_path)] == [run["found"] for run in table_of(whole)]


def test_failures_are_told_and_tried_again_smaller(tmp_path):
    """The first run loses its curve to NaN, its second attempt ends badly, the third is done with a quarter of the increments."""
    spoil = """if calls == 3:
        text = open("pull.csv").read().splitlines()
        open("pull.csv", "w").write("\\n".join(text[:-1] + ["0.05,nan,nan,0.05"]) + "\\n")
    if calls == 4:
        code = 1"""
    code, output = calibrate(tmp_path, stand_in(tmp_path, spoil))
    assert code == 0, output
    runs = table_of(tmp_path)
    assert [(run["number"], run["state"], run["increments"]) for run in runs[:3]] == [(1, "failed", 1.0), (1, "failed", 0.5), (1, "done", 0.25)]
    assert "not finite" in runs[0]["reason"] and "in.quasistatic failed" in runs[1]["reason"]
    assert "again with 0.25 of the increments" in output
    for name, value in TARGETS.items():
        assert runs[-1]["found"][name] == pytest.approx(value, rel=0.01), name


def test_a_miss_is_told_and_the_nearest_row_written(tmp_path):
    """A metal that hardly hardens, which a random body cannot be. The strain has more digits than the nine that in.quasistatic gets."""
    words = [word for word in WORDS if word not in ("--stress", "150e6@0.04")]
    run = subprocess.run([sys.executable, CALIBRATE, *words, "--stress", "97e6@0.0312345678312", "--out", "my.evp"], cwd=tmp_path,
                         env={**os.environ, "EVP_LMP": str(LMP)}, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert run.returncode == 3 and "a target is missed by" in run.stderr and "the law gives it no sharper curve" in run.stderr, run.stdout + run.stderr
    row = row_of(tmp_path).split()
    assert float(row[4]) < 1e-3 * float(row[1]) and "stress at 0.0312346 " in (tmp_path / "my.evp").read_text(encoding="utf-8")


def test_over_stress(tmp_path):
    """gamma is in the row; the over-stress of the damped run over its twin is the one asked for."""
    tmp_path = tmp_path / "a b"
    tmp_path.mkdir()
    words = ["--rate", "10e6@200"]
    code, output = calibrate(tmp_path, None, words)
    assert code == 0, output
    assert float(row_of(tmp_path).split()[8]) > 0.0
    rates = {run["number"]: run["found"] for run in table_of(tmp_path) if run["kind"] == "rate"}
    assert rates[max(rates)] - rates[0] == pytest.approx(10e6, rel=0.01)


BAR_TARGETS = ["--E", "70e9", "--yield", "95e6", "--stress", "150e6@0.03", "--density", "2700", "--ranks", "1"]
CYLINDER_ROW = "cylinder 437.37 8 4 13.7257 8 4 0.000776765 0 1.5 spacing 0.00695059 coordination 11.5133 density 2700"  # by BAR_TARGETS, --spheres 300


def test_row_of_a_slender_body_meets_the_targets_in_it(tmp_path):
    """By -var material on that body, over its middle: what a row of the cylinder misses by more."""
    from evp import curves

    run_lammps("in.specimen", 1, {"n": 300, "length": 0.08, "radius": 0.01, "out": "bar.data"}, tmp_path).ok()
    run = subprocess.run([sys.executable, CALIBRATE, *BAR_TARGETS, "--name", "bar", "--body", "bar.data", "--out", "my.evp"], cwd=tmp_path,
                         env={**os.environ, "EVP_LMP": str(LMP)}, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    text = (tmp_path / "my.evp").read_text(encoding="utf-8")
    assert "body bar.data, 1 ranks" in text
    (tmp_path / "my.evp").write_text(f"{text}{CYLINDER_ROW}\n", encoding="utf-8")
    found = {}
    for name in ("cylinder", "bar"):
        run_lammps("in.quasistatic", 1, {"specimen": "bar.data", "material": f"my.evp:{name}", "strain": 0.006, "increment": 0.0001, "row": 0.0001,
                                         "extensometer": "yes", "restart": 0, "out": "pull"}, tmp_path).ok()
        curve = curves.read_curve(tmp_path / "pull.csv", "strain_gauge")
        found[name] = curves.modulus(curve.strain, curve.virial), curves.numbers(curve)["yield_MPa"]
    assert found["bar"][0] == pytest.approx(70e9, rel=0.01) and found["bar"][1] == pytest.approx(95.0, rel=0.015)
    assert abs(found["cylinder"][0] / 70e9 - 1.0) > 0.02, "control"


def test_walk_of_the_howto_page(tmp_path):
    """Its commands run as they stand, and the numbers that it prints come out."""
    page = (REPOSITORY / "doc" / "Howto_evp_metal.rst").read_text(encoding="utf-8")
    commands = [" ".join(line.strip().rstrip("\\") for line in block.strip().splitlines())
                for block in re.findall(r"\.\. code-block:: bash\n\n((?:   .*\n)+)", page)]
    assert len(commands) >= 3
    environment = {**os.environ, "EVP_LMP": str(LMP), "PATH": f"{pathlib.Path(LMP).parent}:{os.environ['PATH']}"}
    printed = ""
    for command in commands:
        words = shlex.split(command)
        words = [str(REPOSITORY / word) if (REPOSITORY / word).is_file() else word for word in words]
        if words[0].endswith(".py"):
            words = [sys.executable, *words]
        run = subprocess.run(words, cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS, check=False)
        assert run.returncode == 0, run.stdout[-800:] + run.stderr[-800:]
        printed += run.stdout
    row = re.search(r"^   (mymetal \S.*)$", page, re.M).group(1).split()
    found = re.search(r"^(mymetal \S.*)$", printed, re.M).group(1).split()
    assert [word for word in found if word.isalpha()] == [word for word in row if word.isalpha()]
    numbers = [[float(word) for word in words if not word.isalpha()] for words in (row[1:], found[1:])]
    assert numbers[1] == pytest.approx(numbers[0], rel=0.02)
    modulus, again = (float(re.search(r"^ *pull\.csv +([\d.]+)", text, re.M).group(1)) for text in (page, printed))
    assert again == pytest.approx(modulus, rel=0.01)
