# SPDX-License-Identifier: GPL-2.0-only
"""The README: its input script, run as it stands; its first screen; its links."""

import re
import shlex
import subprocess
import sys

import doc_blocks
import pytest
from lammps_run import REPOSITORY, run_lammps

README = doc_blocks.read("README.md")

# The free part of the body between two grips, stretched by 1e-4, within the first regime, and brought to rest.
AT_REST = """
region left block INF 0.005 INF INF INF INF
region right block 0.045 INF INF INF INF INF
group left region left
group right region right
run 0
displace_atoms all ramp x -2e-6 2e-6 x 0.005 0.045 units box
fix hold_left left setforce 0 0 0
fix hold_right right setforce 0 0 0
min_style cg
min_modify dmax 3e-6 norm max
minimize 0 0.2 4000 4000
print "modulus $((f_hold_left[1]-f_hold_right[1])/2/(PI*0.02^2)/0.0001)"
print "mean_density $(mass(all)/(PI*0.02^2*0.05))"
"""


def block_with(words):
    """The one block of the README that has these words."""
    found = [block.text for block in doc_blocks.blocks("README.md") if words in block.text]
    assert len(found) == 1
    return found[0]


SCRIPT = block_with("fix             bonds all evp/bonds")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the README's first command has written its specimen."""
    folder = tmp_path_factory.mktemp("readme")
    words = shlex.split(block_with("-var seed 7").splitlines()[0], comments=True)
    assert words[:3] == ["build/lmp", "-in", "lammps_inputs/in.specimen"]
    variables = dict(zip(words[4::3], words[5::3]))
    run_lammps("in.specimen", 1, variables, folder).ok()
    (folder / "potentials").symlink_to(REPOSITORY / "potentials")
    return folder


def test_input_script_runs_as_it_stands(folder):
    """Without a warning; what is stretched flows and springs back, the energy balance closes, and view.py colors the flow."""
    run = run_lammps(SCRIPT, 2, {}, folder).ok()
    assert not run.warnings()
    thermo = run.thermo()
    kinetic, plastic = thermo["KinEng"], thermo["f_energy[9]"]
    assert len(thermo["Step"]) > 5 and kinetic.min() < 0.6 * kinetic[0], "control: it springs"
    assert 0.3 * kinetic[0] < plastic[-1] < kinetic[0], "control: it flows"
    assert abs(thermo["f_energy"]).max() < 0.002 * kinetic[0]
    words = shlex.split(re.search(r"`(tools/view\.py my\.dump .+?)`", README)[1])
    subprocess.run([sys.executable, str(REPOSITORY / words[0]), *words[1:]], cwd=folder, check=True, timeout=60)
    assert (folder / words[-1]).read_bytes().startswith(b"\x89PNG")


def test_input_script_is_of_the_metal_of_its_row(folder):
    """E and density of the body are those of the comment above the row, and of the row."""
    name = re.search(r"pair_coeff .* potentials/metals\.evp (\w+)", SCRIPT)[1]
    modulus = float(re.search(rf"^# {name}: .*?E (\S+) Pa", doc_blocks.read("potentials/metals.evp"), re.M)[1])
    script = SCRIPT.partition("fix             integrate")[0]
    run = run_lammps(script + AT_REST, 1, {}, folder).ok()
    values = dict(re.findall(r"^(modulus|mean_density) (\S+)$", run.stdout, re.M))
    assert float(values["modulus"]) == pytest.approx(modulus, rel=0.05)
    assert float(values["mean_density"]) == pytest.approx(float(re.search(rf"^{name} .* density (\S+)$", doc_blocks.read("potentials/metals.evp"), re.M)[1]), rel=1e-3)


def test_first_screen():
    """One picture, which its command has written with the curves beside it; the two commands; short."""
    pictures = re.findall(r"!\[.+?\]\((.+?)\)", README)
    assert pictures == ["doc/figures/first_look.png"] and (REPOSITORY / pictures[0]).with_suffix(".csv").is_file()
    assert len(README.splitlines()) <= 110 and README.index(pictures[0]) < README.index("tools/quickstart.sh") < 2500


def test_every_link_leads_to_a_file():
    for page in ("README.md", "CONTRIBUTING.md", "doc/comparison.md", "CHANGELOG.md"):
        for link in re.findall(r"\]\(([^)#\s]+)\)", doc_blocks.read(page)):
            assert "://" in link or (REPOSITORY / page).parent.joinpath(link).exists(), f"{page}: {link}"
