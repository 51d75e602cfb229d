# SPDX-License-Identifier: GPL-2.0-only
"""A plugin built for another LAMMPS stops with one message, as an error of LAMMPS does: the run ends with status 1, a program
that uses LAMMPS as a library goes on. The right plugin is let in.

The build makes the real plugin again under a false flag of release, integer sizes and MPI: build/forged."""
import os
import pathlib
import re
import subprocess

import pytest
from python_host import run_python

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
LMP = pathlib.Path(os.environ.get("EVP_LMP", REPOSITORY / "build" / "lmp"))
MPIRUN = os.environ.get("EVP_MPIRUN", "mpirun").split()
FORGED = LMP.parent / "forged" / "evpplugin.so"
HEADLINE = "ERROR: evpplugin.so was built for another LAMMPS: "
SECONDS = 60    # far above the second that a refusal takes: only a hang gets there


def run_lammps(tmp_path, ranks, plugin_folder=None, text="print 'still alive'\n", flags=()):
    (tmp_path / "in.lmp").write_text(text)
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMPI_MCA_rmaps_base_oversubscribe="1")
    if plugin_folder:
        environment["EVP_PLUGIN_DIR"] = str(plugin_folder)
    launcher = [*MPIRUN, "-np", str(ranks)] if ranks > 1 else []
    result = subprocess.run([*launcher, str(LMP), "-log", "none", *flags, "-in", "in.lmp"], cwd=tmp_path, env=environment,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SECONDS)
    return result.returncode, result.stdout


@pytest.mark.parametrize("ranks", [1, 2])
def test_wrong_host_is_refused(tmp_path, ranks):
    """One message names each difference and nothing else; the right plugin, loaded before, does not lend its check."""
    status, output = run_lammps(tmp_path, ranks, text=f"plugin load {FORGED}\nprint 'still alive'\n")
    assert status == 1 and output.count(HEADLINE) == 1 and "still alive" not in output, output
    assert re.search(re.escape(HEADLINE) + r"release 20990101, not 20\d{6}; tagint of (4, not 8|8, not 4) bytes; "
                     r"MPI_Comm of 3, not \d bytes \(MPICH: 4, Open MPI: 8, no MPI: 0\)\. Rebuild the plugin for this LAMMPS: cmake -S", output), output


def test_wrong_host_is_refused_at_the_start(tmp_path):
    status, output = run_lammps(tmp_path, 1, FORGED.parent)
    assert status == 1 and output.count(HEADLINE) == 1 and "still alive" not in output, output


GOES_ON = """
program = start()
tell(program, "units si\\natom_style sphere\\nregion box block 0 1 0 1 0 1\\ncreate_box 1 box")
wrong = os.path.join(os.path.dirname(plugin), "forged", "evpplugin.so")
for attempt in range(2):
    said = complaint(program.command, f"plugin load {wrong}")
    assert said.startswith("ERROR: evpplugin.so was built for another LAMMPS: release 20990101, not 20"), said
assert "Unrecognized pair style" in complaint(program.command, "pair_style evp/lj")
tell(program, f"plugin load {plugin}\\npair_style evp/lj")
print("goes on")
program.finalize()
"""


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_program_goes_on(tmp_path, ranks):
    """The first 99 characters of an error, all that Python shows, hold what differs; the instance takes the right plugin after it."""
    run = run_python(GOES_ON, ranks, tmp_path).ok()
    assert run.stdout.count("goes on") == ranks and run.stdout.count(HEADLINE) == 2


def test_a_program_goes_on_without_an_instance(tmp_path):
    """The plugin of LAMMPS_PLUGIN_PATH is loaded while the instance is being made."""
    run = run_python("print('no instance:', complaint(start))\nprint('goes on')\n", 1, tmp_path, LAMMPS_PLUGIN_PATH=str(FORGED.parent)).ok()
    assert HEADLINE in run.stdout and "no instance: Failed to initialize LAMMPS" in run.stdout and "goes on" in run.stdout


@pytest.mark.parametrize("loads", ["one", "two"])
def test_partitions_end_together(tmp_path, loads):
    """One of two partitions alone loads the plugin and says so: the other waits for none."""
    text = f"variable w world one two\nif '$w == {loads}' then 'plugin load {FORGED}' else 'shell sleep 50' 'shell touch waited'\n"
    status, output = run_lammps(tmp_path, 2, text=text, flags=["-partition", "2x1"])
    assert status == 1 and output.count(HEADLINE) == 1, output
    assert not (tmp_path / "waited").exists(), "the other one was waited for"


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
