# SPDX-License-Identifier: GPL-2.0-only
"""tools/quickstart.py and evp.run: how runs are started, shared out over cores, and how they fail. Time left once it can be told."""

import re
import signal
import sys

import body
import numpy as np
import pytest
import quickstart
from evp import flow, run
from evp.report import write_csv
from inputs import call, program


@pytest.fixture
def lmp(tmp_path, monkeypatch):
    """Makes a stand-in for lmp from a Python body that sees argv, and points EVP_LMP at it."""

    def make(body):
        monkeypatch.setenv("EVP_LMP", str(program(tmp_path / "lmp", f"import sys, time\n{body}", f"#!{sys.executable}")))
        return tmp_path / "lmp"

    return make


def jobs(folder, count):
    return [run.Job(f"job{k}", "in.traction", {"rate": k}, folder) for k in range(count)]


def test_words_of_the_command(lmp, monkeypatch):
    path = str(lmp("pass"))
    assert run.lammps_command(1) == [path]
    for mpirun, words in (("env A=1", ["env", "A=1", "-np", "2", path]), ("env -n", ["env", "-n", "2", path])):
        monkeypatch.setenv("EVP_MPIRUN", mpirun)
        assert run.lammps_command(2) == words


def test_a_failed_run_ends_all_with_lammps_own_error(lmp, tmp_path, monkeypatch):
    lmp("print('print \"ERROR: not this echo\"\\nERROR: no such style (a.cpp:1)'); sys.exit(1)")
    failed = call(quickstart.main, "--out", tmp_path / "out", "--ranks", 1)
    message = failed.stderr
    assert failed.returncode == 1 and message.startswith("quickstart.py: error: "), message
    assert "ERROR: no such style (a.cpp:1)" in message and "not this echo" not in message
    assert re.search(r"in\.(two_spheres|specimen) failed \(exit 1\)(.|\n)*/(\1|periodic)\.log", message), "whichever ended first"
    monkeypatch.setenv("EVP_LMP", str(tmp_path / "nowhere"))
    message = call(quickstart.main, "--out", tmp_path / "none").stderr
    assert "nowhere" in message and "tools/setup.sh" in message, "a missing program is named"


def test_metal_is_drawn_beside_the_flow_curve_of_its_row(tmp_path, capsys):
    """Of a run that is 3 % above it: A + B p^n of the row, at the points of its table."""
    target = flow.of_row(quickstart.METALS, quickstart.METAL)
    assert target.stress == pytest.approx(265e6 + 426e6 * target.plastic**0.34, rel=1e-4)
    strain = np.array([0.0, 5e-4, *np.linspace(0.012, 0.2, 40)])
    stress = np.array([0.0, 365e5, *1.03 * target.true_stress(strain[2:], 73e9)])
    write_csv(tmp_path / "metal.csv", ("strain", "stress", "volume_change"), zip(strain, stress, 0 * strain))
    quickstart.draw_metal(tmp_path)
    assert f"{quickstart.METAL}: true stress +3.0 to +3.0 % off" in capsys.readouterr().out
    assert (tmp_path / "metal.png").stat().st_size > 1000 and "flow curve,20,50" in (tmp_path / "metal.png.csv").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="no row iron with flow and yield"):
        flow.of_row(quickstart.METALS, "iron")


def test_without_an_error_line_the_end_of_the_log_is_shown(lmp, tmp_path):
    lmp("print('last words'); sys.exit(3)")
    with pytest.raises(run.RunError, match=r"(?s)exit 3.*no ERROR line.*last words"):
        run.run_jobs(jobs(tmp_path, 1), 1)


def test_a_failure_stops_the_other_runs(lmp, tmp_path):
    lmp("time.sleep(0.3 if '0' in sys.argv else 60); sys.exit(1)")
    running = jobs(tmp_path, 2)
    with pytest.raises(run.RunError, match="job0"):
        run.run_jobs(running, 2)
    assert [job.process.poll() for job in running] == [1, -signal.SIGTERM]


def test_an_interrupt_while_a_run_starts_ends_it(lmp, tmp_path, monkeypatch):
    """It comes when the process is there and the tool does not have it yet."""

    class Interrupted(run.subprocess.Popen):
        def __init__(self, *words, **options):
            super().__init__(*words, **options)
            signal.raise_signal(signal.SIGINT)

    lmp("time.sleep(60)")
    monkeypatch.setattr(run.subprocess, "Popen", Interrupted)
    running = jobs(tmp_path, 1)
    with pytest.raises(KeyboardInterrupt):
        run.run_jobs(running, 1)
    assert running[0].process.returncode == -signal.SIGTERM


def test_a_second_interrupt_leaves_no_run_behind(lmp, tmp_path, monkeypatch):
    """It comes while the first run is waited for, which is slow to end."""
    lmp("import signal\nsignal.signal(signal.SIGTERM, lambda *_: (time.sleep(0.5), sys.exit(0)))\nprint('runs', flush=True)\ntime.sleep(60)")
    running = jobs(tmp_path, 2)

    class Waited(run.subprocess.Popen):
        def wait(self, timeout=None):
            if self is running[0].process:
                signal.raise_signal(signal.SIGINT)
            return super().wait(timeout)

    def interrupt(*_):
        if all("runs" in job.log.read_text() for job in running if job.process):
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(run.subprocess, "Popen", Waited)
    monkeypatch.setattr(run.Progress, "show", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run.run_jobs(running, 2)
    assert [job.process.returncode for job in running] == [0, 0]


MEETING = """import os, pathlib
here = pathlib.Path(__file__).parent
count = lambda what: len(list(here.glob(what + "_*")))
(here / f"begun_{os.getpid()}").touch()
print(count("begun") - count("ended"))
waits = iter(range(3000))
while count("begun") < 2:
    next(waits, None) is None and sys.exit("alone")
    time.sleep(0.01)
(here / f"ended_{os.getpid()}").touch()"""  # prints how many run; ends when another one has begun


def test_runs_share_the_cores(lmp, tmp_path):
    """Two cores: never more than two runs at once, and not fewer while some wait."""
    lmp(MEETING)
    four = jobs(tmp_path, 4)
    run.run_jobs(four, 2)
    assert max(int(job.log.read_text()) for job in four) <= 2


def test_the_strain_of_a_growing_curve(tmp_path):
    path = tmp_path / "a.csv"
    assert run.last_strain(path) == 0.0
    for rows, last in (("", 0.0), ("0.001,1,1\n0.002,2", 0.001)):
        path.write_text(f"strain,stress_grip,stress_virial\n{rows}", encoding="utf-8")
        assert run.last_strain(path) == last


def test_rates_must_be_positive(capsys):
    for word in ("0", "-1", "nan", "fast"):
        with pytest.raises(SystemExit):
            quickstart.main(["--rates", word])
    assert "--rates" in capsys.readouterr().err


@pytest.mark.parametrize("done, told", [(0.0, "0 %, 10 s so far: run"), (4.0, "4 %, 10 s so far: run"), (5.0, "5 %, about 3 min 10 s left: run"),
                                        (50.0, "50 %, about 10 s left: run")])
def test_time_left_is_told_from_five_percent_on(monkeypatch, capsys, done, told):
    clock = iter((100.0, 110.0))
    monkeypatch.setattr(run.time, "monotonic", lambda: next(clock))
    run.Progress("packing", 100.0).show(done, "run")
    assert capsys.readouterr().err.split(None, 1)[1].strip() == told


def test_share_of_a_packing_is_that_of_its_time(tmp_path):
    """Of two meshes with 300 and 2000 spheres: half of it after a third of the steps."""
    log = tmp_path / "log"
    assert body.share_done(log) == 0.0
    for text, share in (("LAMMPS\n", 0.0), ("Specimen of 9 spheres: 8 % done, about\n", 0.15), ("Specimen of 9 spheres: 8 % done\nSpecimen of 9 spheres: 33 % done, a\n", 0.55),
                        ("Specimen of 9 spheres: 100 % done, a\n", 1.0)):
        log.write_text(text, encoding="utf-8")
        assert body.share_done(log) == pytest.approx(share, abs=0.03)
