# SPDX-License-Identifier: GPL-2.0-only
"""The README's commands for a specimen of one's own and the input script below them, run as they stand."""

import re
import shlex

import pytest
from lammps_run import REPOSITORY, run_lammps

README = (REPOSITORY / "README.md").read_text(encoding="utf-8")
SECTION = README.partition("## Your own specimen, your own deck")[2].partition("\n## ")[0]
E_OF_2000 = 23.2e9  # [Pa], on packings of 2000 spheres, by the prototype of doc/Howto_evp.rst

# The free part of the body between two grips, stretched by 0.001 and brought to rest.
AT_REST = """
region left block INF 0.005 INF INF INF INF
region right block 0.045 INF INF INF INF INF
group left region left
group right region right
run 0
displace_atoms all ramp x -2e-5 2e-5 x 0.005 0.045 units box
fix hold_left left setforce 0 0 0
fix hold_right right setforce 0 0 0
min_style cg
min_modify dmax 3e-6 norm max
minimize 0 0.2 4000 4000
print "modulus $((f_hold_left[1]-f_hold_right[1])/2/(PI*0.02^2)/0.001)"
"""


def blocks():
    """Indented blocks of the section: the commands, and the input script."""
    return ["\n".join(line[4:] for line in block.splitlines()) + "\n" for block in re.findall(r"(?:^    .*\n)+", SECTION, re.M)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the README's first command has written its specimen."""
    folder = tmp_path_factory.mktemp("readme")
    words = shlex.split(blocks()[0].splitlines()[0], comments=True)
    assert words[:3] == ["build/lmp", "-in", "lammps_inputs/in.specimen"]
    variables = dict(zip(words[4::3], words[5::3]))
    run_lammps("in.specimen", 1, variables, folder).ok()
    return folder


@pytest.mark.parametrize("ranks", [1, 2])
def test_input_script_runs_as_it_stands(folder, ranks):
    """Without a warning; what is stretched springs back, and the energy stays."""
    run = run_lammps(blocks()[1], ranks, {}, folder).ok()
    assert not run.warnings()
    thermo = run.thermo()
    assert len(thermo["Step"]) > 5 and thermo["KinEng"].min() < 0.6 * thermo["KinEng"][0], "control: it springs"
    assert abs(thermo["TotEng"] - thermo["TotEng"][0]).max() < 0.01 * thermo["KinEng"][0]


def test_input_script_is_of_the_material_of_the_tables(folder):
    """E of that many spheres, as of any number: the row of the tables taken for 2000 spheres would be four times as stiff."""
    script = blocks()[1].partition("fix             integrate")[0]
    run = run_lammps(script + AT_REST, 1, {}, folder).ok()
    assert float(run.stdout.rpartition("\nmodulus ")[2].split()[0]) == pytest.approx(E_OF_2000, rel=0.05)


def test_second_sentence_says_that_the_law_is_reversible():
    paragraph = README.split("\n\n")[1].replace("\n", " ")
    second = re.split(r"(?<=\.) (?=[A-Z])", paragraph)[1]
    assert "reversible" in second and "permanent strain" in second and "non-linear elastic" in second
