# SPDX-License-Identifier: GPL-2.0-only
"""The README: its input script, run as it stands; its first screen; its links."""

import re
import shlex
import subprocess
import sys

import doc_blocks
from lammps_run import REPOSITORY, run_lammps
from test_doc_commands import block_of


def test_input_script_runs_as_it_stands(tmp_path):
    """On the body of the first command, of fewer spheres, without a warning; what is stretched flows and springs back, the energy balance closes, and view.py colors the flow."""
    words = shlex.split(block_of("README.md", "-var seed 7").text.splitlines()[0], comments=True)
    assert words[:3] == ["build/lmp", "-in", "lammps_inputs/in.specimen"]
    run_lammps("in.specimen", 1, {**dict(zip(words[4::3], words[5::3])), "n": 1000}, tmp_path).ok()
    (tmp_path / "potentials").symlink_to(REPOSITORY / "potentials")
    run = run_lammps(block_of("README.md", "fix             bonds all evp/bonds").text, 2, {}, tmp_path).ok()
    assert not run.warnings()
    thermo = run.thermo()
    kinetic, plastic = thermo["KinEng"], thermo["f_energy[9]"]
    assert len(thermo["Step"]) > 5 and kinetic.min() < 0.6 * kinetic[0], "control: it springs"
    assert 0.3 * kinetic[0] < plastic[-1] < kinetic[0], "control: it flows"
    assert abs(thermo["f_energy"]).max() < 0.002 * kinetic[0]
    words = shlex.split(re.search(r"`(tools/view\.py my\.dump .+?)`", doc_blocks.read("README.md"))[1])
    subprocess.run([sys.executable, str(REPOSITORY / words[0]), *words[1:]], cwd=tmp_path, check=True, timeout=60)
    assert (tmp_path / words[-1]).read_bytes().startswith(b"\x89PNG")
