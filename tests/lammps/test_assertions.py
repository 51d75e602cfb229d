# SPDX-License-Identifier: GPL-2.0-only
"""The plugin with the assertions of the C++ library: an index or an iterator beyond its container ends the run, even where the
memory behind it is ours. Every style, on ranks that send nothing, have no ghosts or no atoms at all."""

import os
import subprocess

import pytest
from common_bodies import REFERENCE
from lammps_run import LMP, REPOSITORY
from small_bodies import head, lattice_body, write_body, write_two

BUILD_SECONDS = 600  # half a minute on two free cores; only a hang gets there

# explicit, then implicit, with all that reads or sends; then a restart, the file of bonds, and a minimization
STYLES = """
group one id 1
group rest subtract all one
compute dt all evp/dt
compute state all evp/state/atom
compute stress all stress/atom NULL
compute sum all reduce sum c_state[1] c_state[2] c_state[4] c_stress[1]
thermo_style custom step pe press c_dt c_dt[5] c_sum[*] f_bonds f_bonds[1] f_bonds[4]
thermo 4
timestep 1e-7
fix move all nve
fix ledger all evp/energy
run 4
unfix ledger
unfix move
fix hold one nve/noforce
fix move rest nve/evp
fix ledger all evp/energy
fix step all dt/evp 2 0.3
run 4
print "between runs $(f_bonds[1]) $(f_ledger)"
write_evp_bonds all.bonds
write_restart all.restart
unfix bonds
fix bonds all evp/bonds file all.bonds
run 2
minimize 0 1e-6 5 10
clear
atom_modify map yes
read_restart all.restart
neighbor 0.0008 bin
fix bonds all evp/bonds
fix volume all evp/volume 300
fix move all nve
run 2
"""
DAMPED = "pair_style evp/lj\npair_coeff * * 80 8 4 3 8 4 0.005 1000 1.5\nfix bonds all evp/bonds\nfix volume all evp/volume 300\n"


@pytest.fixture(scope="module")
def checked():
    """Folder of that plugin."""
    build = subprocess.run(["cmake", "--build", str(LMP.parent), "--target", "checked", "-j", str(os.cpu_count())],
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=BUILD_SECONDS, check=False)
    plugin = LMP.parent / "checked" / "evpplugin.so"
    assert build.returncode == 0, build.stdout[-3000:]
    assert b"glibcxx_assert_fail" in plugin.read_bytes() or b"replacement_assert" in plugin.read_bytes(), "control: the assertions are in"
    return plugin.parent


@pytest.mark.parametrize("scene, ranks, newton", [("two spheres", 1, "on"), ("two spheres", 4, "on"), ("two spheres", 4, "off"), ("open", 2, "on"),
                                                  ("open", 2, "off"), ("periodic", 2, "off"), ("periodic", 4, "on")])
def test_every_style_keeps_within_its_containers(lmp, tmp_path, monkeypatch, checked, scene, ranks, newton):
    monkeypatch.setenv("EVP_PLUGIN_DIR", str(checked))
    boundary = "p p p" if scene == "periodic" else "f f f"
    if scene == "two spheres":
        write_two(tmp_path / "body.data")
    else:
        write_body(tmp_path / "body.data", lattice_body((5, 4, 4), "xyz" if scene == "periodic" else ""))
    run = lmp(head(newton, boundary) + DAMPED + STYLES, ranks=ranks).ok()
    assert run.stdout.count("Loop time") == 5, "control: four runs and a minimization"


def test_the_specimen_keeps_within_its_containers(lmp, monkeypatch, checked):
    monkeypatch.setenv("EVP_PLUGIN_DIR", str(checked))
    lmp(REPOSITORY / "tests" / "memory" / "in.memory", ranks=2, variables={"specimen": REFERENCE, "row": f"{REPOSITORY / 'potentials' / 'metals.evp'}:copper_OFHC"}).ok()
