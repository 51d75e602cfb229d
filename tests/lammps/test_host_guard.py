# SPDX-License-Identifier: GPL-2.0-only
"""A plugin built for another LAMMPS ends the run with one message and status 1; the right one is let in.

The build makes the real plugin again under false flags: build/forged/{version,sizes,mpi}."""
import os
import pathlib
import re
import subprocess

import pytest

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
LMP = pathlib.Path(os.environ.get("EVP_LMP", REPOSITORY / "build" / "lmp"))
MPIRUN = os.environ.get("EVP_MPIRUN", "mpirun").split()
HEADLINE = "ERROR: evpplugin.so was built for another LAMMPS than the one that loads it:"
SECONDS = 60    # far above the second that a refusal takes: only a hang gets there


def run_lammps(tmp_path, ranks, plugin_folder=None, text="print 'still alive'\n"):
    (tmp_path / "in.lmp").write_text(text)
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMPI_MCA_rmaps_base_oversubscribe="1")
    if plugin_folder:
        environment["EVP_PLUGIN_DIR"] = str(plugin_folder)
    launcher = [*MPIRUN, "-np", str(ranks)] if ranks > 1 else []
    result = subprocess.run([*launcher, str(LMP), "-log", "none", "-in", "in.lmp"], cwd=tmp_path, env=environment,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SECONDS)
    return result.returncode, result.stdout


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("flag, words", [
    ("version", r"release: this LAMMPS has 20\d{6}, the plugin was built for 20990101"),
    ("sizes", r"size of tagint: this LAMMPS has (32|64) bits, the plugin was built for (64|32) bits"),
    ("mpi", r"MPI: this LAMMPS has .+, the plugin was built for Forged MPI")])
def test_wrong_host_is_refused(tmp_path, ranks, flag, words):
    folder = LMP.parent / "forged" / flag
    assert (folder / "evpplugin.so").is_file()
    status, output = run_lammps(tmp_path, ranks, folder)
    assert status == 1, output
    assert output.count(HEADLINE) == 1, output
    assert re.search(words, output), output
    assert "Rebuild the plugin for this LAMMPS: cmake -S . -B build" in output
    assert "still alive" not in output


def test_only_what_differs_is_named(tmp_path):
    _, output = run_lammps(tmp_path, 1, LMP.parent / "forged" / "version")
    assert "size of" not in output and "MPI:" not in output


def test_second_plugin_runs_its_own_check(tmp_path):
    """With the right plugin loaded, the check of a wrong one must not be taken from the right one."""
    wrong = LMP.parent / "forged" / "version" / "evpplugin.so"
    status, output = run_lammps(tmp_path, 1, text=f"plugin load {wrong}\nprint 'still alive'\n")
    assert status == 1, output
    assert output.count(HEADLINE) == 1, output


@pytest.mark.parametrize("ranks", [1, 2])
def test_right_host_is_let_in(tmp_path, ranks):
    status, output = run_lammps(tmp_path, ranks, text="plugin list\nprint 'still alive'\n")
    assert status == 0, output
    assert "ERROR" not in output
    assert "style plugin" in output
    assert "still alive" in output


def test_wrapper_keeps_the_exit_status(tmp_path):
    status, output = run_lammps(tmp_path, 1, text="no_such_command\n")
    assert status == 1, output
    assert "Unknown command" in output
