# SPDX-License-Identifier: GPL-2.0-only
"""The host: a plugin built for another LAMMPS stops with one message, as an error of LAMMPS does, and a program that uses LAMMPS as a library goes on; several
instances in one process know all styles, whichever was there first and whichever goes first (LAMMPS' list of plugins belongs to the process).

The build makes the real plugin again under a false flag of release, integer sizes and MPI: build/forged."""

import os
import pathlib
import re
import subprocess

import pytest
from inputs import cache_entry
from lammps_run import LMP, REPOSITORY
from library import plugin_folder, run_python

FORGED = LMP.parent / "forged" / "evpplugin.so"
HEADLINE = "ERROR: evpplugin.so was built for another LAMMPS: "
ALIVE = "\nprint 'still alive'\n"


def test_wrong_host_is_refused(lmp):
    """One message names each difference and nothing else; the right plugin, loaded before, does not lend its check."""
    run = lmp(f"plugin load {FORGED}{ALIVE}", 2)
    assert run.returncode == 1 and run.stdout.count(HEADLINE) == 1 and "still alive" not in run.stdout, run.stdout
    assert re.search(re.escape(HEADLINE) + r"release 20990101, not 20\d{6}; tagint of (4, not 8|8, not 4) bytes; "
                     r"MPI_Comm of 3, not \d bytes \(MPICH: 4, Open MPI: 8, no MPI: 0\)\. Rebuild the plugin for this LAMMPS: cmake -S", run.stdout), run.stdout


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


def test_a_program_goes_on(tmp_path):
    """The first 99 characters of an error, all that Python shows, hold what differs; the instance takes the right plugin after it."""
    run = run_python(GOES_ON, 2, tmp_path).ok()
    assert run.stdout.count("goes on") == 2 and run.stdout.count(HEADLINE) == 2


def test_a_program_goes_on_without_an_instance(tmp_path):
    """The plugin of LAMMPS_PLUGIN_PATH is loaded while the instance is being made."""
    run = run_python("print('no instance:', complaint(start))\nprint('goes on')\n", 1, tmp_path, LAMMPS_PLUGIN_PATH=str(FORGED.parent)).ok()
    assert HEADLINE in run.stdout and "no instance: Failed to initialize LAMMPS" in run.stdout and "goes on" in run.stdout


def test_partitions_end_together(lmp, tmp_path):
    """One of two partitions alone loads the plugin and says so: the other waits for none."""
    text = f"variable w world one two\nif '$w == two' then 'plugin load {FORGED}' else 'shell sleep 50' 'shell touch waited'\n"
    run = lmp(text, 2, flags=["-partition", "2x1"])
    assert run.returncode == 1 and run.stdout.count(HEADLINE) == 1, run.stdout
    assert not (tmp_path / "waited").exists(), "the other one was waited for"


# ---- several instances of lammps in one python process ----

PROGRAM = """
BODY = '''units si
atom_style sphere
atom_modify map yes
newton on
boundary s s s
read_data body.data
neighbor 0.0008 bin
pair_style evp/lj contact repulsive plasticity isotropic
pair_coeff * * 80 8 4 3 8 4 0.005 ${gamma} 1.5
fix bonds all evp/bonds
fix volume all evp/volume 100
fix move all nve/evp
fix step all dt/evp 5 0.4
fix energy all evp/energy
compute dt all evp/dt
compute state all evp/state/atom plastic_work
velocity all create 30 4928 loop all
read_evp_row "80 8 4 3 8 4 0.005 0 1.5" row
thermo_style custom step pe ke f_energy c_dt f_bonds
thermo_modify norm no
run 10'''

def make(gamma):
    program = start("-screen", "none")
    if not os.environ.get("LAMMPS_PLUGIN_PATH"):
        program.command(f"plugin load {plugin}")
    program.command(f"variable gamma index {gamma}")
    tell(program, BODY)
    return program

def go_on(name, program):
    program.command("run 10")
    print(name, *(f"{program.get_thermo(word):.15g}" for word in ("step", "pe", "ke")), flush=True)
"""

ALONE = PROGRAM + """
for name, gamma in (("first", 0), ("second", 100), ("third", 300)):
    program = make(gamma)
    go_on(name, program)
    go_on(name, program)
    program.close()
"""
TOGETHER = PROGRAM + """
first, second = make(0), make(100)
go_on("first", first)
go_on("second", second)
bystander = start("-screen", "none")    # LAMMPS 4Feb2025 forgets all plugins where any instance ends
bystander.close()
go_on("second", second)
go_on("first", first)
first.close()
third = make(300)
go_on("third", third)
second.close()
go_on("third", third)
third.close()
"""


def test_instances_side_by_side_are_those_one_after_the_other(tmp_path, small):
    """By plugin load, and by LAMMPS_PLUGIN_PATH."""
    runs = (run_python(ALONE, 1, tmp_path), run_python(TOGETHER, 1, tmp_path), run_python(TOGETHER, 1, tmp_path, LAMMPS_PLUGIN_PATH=plugin_folder()))
    alone, *others = (sorted(re.findall(r"^(?:first|second|third) .*$", run.ok().stdout, re.M)) for run in runs)  # by instance and step
    assert others == [alone, alone] and len(set(alone)) == 6


@pytest.fixture(scope="module")
def complaints_of():
    """What the compiler says of a text, with LAMMPS' stand-ins for MPI; empty where it compiles."""
    tree = pathlib.Path(cache_entry("LAMMPS_SOURCE_DIR"))
    headers = tree / "src" if (tree / "src").is_dir() else tree
    if not (headers / "STUBS" / "mpi.h").exists():
        pytest.skip("this LAMMPS came without its sources")
    words = [os.environ.get("CXX", "g++"), *"-std=c++17 -fsyntax-only -Wall -Wextra -Werror -DLAMMPS_SMALLBIG -DEVP_LAMMPS_VERSION=1".split(), '-DEVP_VERSION="1"',
             f"-I{REPOSITORY / 'src'}", "-isystem", str(headers / "STUBS"), "-isystem", str(headers), "-x", "c++", "-"]

    def complaints(text):
        done = subprocess.run(words, input=text, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        return done.stdout[-2000:] if done.returncode else ""

    return complaints


def test_records_that_have_no_table_are_not_found(complaints_of):
    """What a sphere keeps is found by its type: asked for as another one, it does not compile. Control: as it is kept, it does."""
    ask = '#include "core/bonds/bond_store.h"\nauto ask(EVP::BondStore &store) {{ return store.columns<{}>(); }}\n'
    assert not complaints_of(ask.format("EVP::Sphere"))
    assert "NAME" in complaints_of(ask.format("EVP::BondRecord"))


def test_sources_compile_without_mpi(complaints_of):
    """Those that name a function of MPI: a LAMMPS without it has stand-ins of its own, whose functions take other pointers."""
    sources = [path for path in sorted((REPOSITORY / "src").rglob("*.cpp")) if "MPI_" in path.read_text(encoding="utf-8")]
    assert len(sources) > 10
    text, known = "", {}
    for source in sources:  # one unit: each alone would read the headers anew, for seconds. What is static there must differ.
        names = set(re.findall(r"^static [^;={(\n]*?(\w+)(?: =|\()", source.read_text(encoding="utf-8"), re.M))
        again = [name for name in names if known.setdefault(name, source) != source]
        text += "".join(f"#define {name} {source.stem}_{name}\n" for name in again) + f'#include "{source}"\n' + "".join(f"#undef {name}\n" for name in again)
    assert not (said := complaints_of(text)), said
