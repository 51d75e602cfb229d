# SPDX-License-Identifier: GPL-2.0-only
"""Several instances of LAMMPS in one Python process: each one that loads the plugin knows all its styles, whichever was
there first and whichever goes first. LAMMPS' list of plugins belongs to the process."""

import re

import pytest
from python_host import plugin_folder, run_python
from small_bodies import lattice_body, write_body

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


def values(run):
    """Lines of each instance in their order."""
    found = {name: re.findall(rf"^{name} (.*)$", run.stdout, re.M) for name in ("first", "second", "third")}
    assert all(len(lines) == 2 for lines in found.values()), run.stdout
    return found


@pytest.mark.parametrize("path", [False, True], ids=["plugin load", "LAMMPS_PLUGIN_PATH"])
def test_instances_side_by_side_are_those_one_after_the_other(tmp_path, path):
    write_body(tmp_path / "body.data", lattice_body((4, 3, 3)))
    folder = {"LAMMPS_PLUGIN_PATH": plugin_folder()} if path else {}
    alone, together = (values(run_python(script, 1, tmp_path, **folder).ok()) for script in (ALONE, TOGETHER))
    assert together == alone
    assert len({line for lines in alone.values() for line in lines}) == 6, "control"


def test_a_second_load_is_ignored_as_by_lammps(tmp_path):
    """And LAMMPS says so."""
    script = 'program = start()\nfor k in range(2):\n    program.command(f"plugin load {plugin}")\nprogram.close()\n'
    run = run_python(script, 1, tmp_path).ok()
    assert run.stdout.count("Ignoring load of pair style evp/lj") == 1 and run.stdout.count("Loading plugin: EVP two-regime") == 1
