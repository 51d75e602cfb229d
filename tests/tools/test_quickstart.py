# SPDX-License-Identifier: GPL-2.0-only
"""evp.quickstart and evp.run: how runs are started, shared out over cores, and how they fail."""

import sys
import signal

import pytest
from evp import quickstart, run


@pytest.fixture
def lmp(tmp_path, monkeypatch):
    """Makes a stand-in for lmp from a Python body that sees argv, and points EVP_LMP at it."""

    def make(body):
        path = tmp_path / "lmp"
        path.write_text(f"#!{sys.executable}\nimport sys, time\n{body}\n", encoding="utf-8")
        path.chmod(0o755)
        monkeypatch.setenv("EVP_LMP", str(path))
        return path

    return make


def jobs(folder, count):
    return [run.Job(f"job{k}", "in.traction", {"rate": k}, folder) for k in range(count)]


def test_words_of_the_command(lmp, monkeypatch):
    path = str(lmp("pass"))
    assert run.lammps_command(1) == [path]
    monkeypatch.setenv("EVP_MPIRUN", "env A=1")
    assert run.lammps_command(2) == ["env", "A=1", "-np", "2", path]
    monkeypatch.setenv("EVP_MPIRUN", "env -n")
    assert run.lammps_command(2) == ["env", "-n", "2", path]


def test_a_failed_run_ends_all_with_lammps_own_error(lmp, tmp_path, capsys):
    lmp("print('print \"ERROR: not this echo\"\\nERROR: no such style (a.cpp:1)'); sys.exit(1)")
    assert quickstart.main(["--out", str(tmp_path / "out"), "--ranks", "1"]) == 1
    message = capsys.readouterr().err
    assert "ERROR: no such style (a.cpp:1)" in message and "not this echo" not in message
    assert "in.two_spheres failed (exit 1)" in message and "two_spheres.log" in message


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


def test_a_missing_program_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("EVP_LMP", str(tmp_path / "nowhere"))
    assert quickstart.main(["--out", str(tmp_path / "out")]) == 1
    message = capsys.readouterr().err
    assert "nowhere" in message and "tools/setup.sh" in message


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
    path.write_text("strain,stress_grip,stress_virial\n", encoding="utf-8")
    assert run.last_strain(path) == 0.0
    path.write_text("strain,stress_grip,stress_virial\n0.001,1,1\n0.002,2", encoding="utf-8")
    assert run.last_strain(path) == 0.001


def test_rates_must_be_positive(capsys):
    for word in ("0", "-1", "nan", "fast"):
        with pytest.raises(SystemExit):
            quickstart.main(["--rates", word])
    assert "--rates" in capsys.readouterr().err
