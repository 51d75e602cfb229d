# SPDX-License-Identifier: GPL-2.0-only
"""tools/body.py: a part as STL becomes a body; its faults are named and leave no file. The walk of doc/Howto_evp_part.rst, as it stands."""

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys

import numpy as np
import pytest
from evp import specimen, surface
from lammps_run import LMP, REPOSITORY, read_csv, run_lammps
from test_shapes import read_body

PARTS = REPOSITORY / "tests" / "data" / "parts"
PAGE = (REPOSITORY / "doc" / "Howto_evp_part.rst").read_text(encoding="utf-8")
pytestmark = pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="no open3d: " + surface.OPEN3D)


def tool(folder, *words, name="body.py"):
    """A tool, from a folder; what it printed is in stdout."""
    return subprocess.run([sys.executable, str(REPOSITORY / "tools" / name), *map(str, words)], cwd=folder, stdout=subprocess.PIPE, timeout=300,
                          stderr=subprocess.STDOUT, text=True, env={**os.environ, "EVP_LMP": str(LMP)}, check=False)


def blocks(kind):
    """Code blocks or printed blocks of the section of the walk."""
    section = PAGE.partition("**Example**")[2].partition("\n----------")[0]
    found = re.findall(rf"^\.\. {kind}\n\n((?:   .*\n|\n)+)", section, re.M)
    return ["\n".join(line[3:] for line in text.splitlines()).strip() for text in found]


NUMBER = r"(?<![\w.])-?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])"


def numbers(text):
    return [float(word) for word in re.findall(NUMBER, text)]


def words_of(text):
    """A line without its numbers."""
    return re.sub(NUMBER, "", text).split()


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """The folder in which the commands of the page ran, and what each printed."""
    folder = tmp_path_factory.mktemp("walk")
    for name in ("tools", "tests", "lammps_inputs", "potentials"):
        (folder / name).symlink_to(REPOSITORY / name)
    printed = []
    for command in blocks("code-block:: bash"):
        words = shlex.split(command.replace("\\\n", " "))
        if words[0] == "lmp":
            run = run_lammps(words[2].rpartition("/")[2], 1, dict(zip(words[4::3], words[5::3])), folder).ok()
            printed.append(run.stdout)
        else:
            run = tool(folder, *words[1:], name=words[0].rpartition("/")[2])
            assert run.returncode == 0, run.stdout
            printed.append(run.stdout)
    return folder, printed


def test_walk_prints_what_the_page_says(walk):
    """Measures of the part to the last digit, those of the packing and E within what another compiler changes."""
    printed, page = walk[1], blocks("parsed-literal::")
    assert len(printed) == 3 and len(page) == 2
    for expected, found in ((page[0].splitlines(), printed[0]), (page[1].splitlines(), printed[2])):
        for line in expected:
            same = next((text for text in found.splitlines() if words_of(text) == words_of(line)), None)
            assert same is not None, (line, found)
            for a, b in zip(numbers(line), numbers(same)):
                exact = line.startswith(("tests/data", "800 "))
                off = 0.0 if exact else 25.0 if a > 100 else 0.02 if 0 < a < 1 else 1.0  # spheres; a share; percent, GPa
                assert b == pytest.approx(a, rel=1e-4 if exact else 0.03, abs=off), line
    assert numbers(page[1].splitlines()[1])[0] == pytest.approx(20.9, rel=0.02), "control: E of the material"


def test_progress_with_the_time_left(walk):
    assert re.search(r"packing 800 spheres +\d+ %, about .* left", walk[1][0]) and "done in" in walk[1][0]


def test_body_of_the_part(walk):
    """Volume and section of the surface, whole spheres within it, jammed, and one atom type."""
    folder = walk[0]
    packing, body = specimen.read_data(folder / "bone.data"), read_body(folder / "bone.data.body")
    bone = surface.closed_surface(surface.read_mesh(PARTS / "dog_bone.stl"), "bone").placed("z", 1e-3)
    assert body["volume"] == pytest.approx(bone.volume(), rel=1e-6) and body["length"] == pytest.approx(bone.extents[0], rel=1e-6)
    assert body["area"] == pytest.approx(0.5 * 32 * np.sin(2 * np.pi / 32) * 0.004**2, rel=1e-5)
    assert body["solid_fraction"] == pytest.approx(np.sum(4 / 3 * np.pi * packing.radius**3) / body["volume"], rel=1e-6)
    assert "1 atom types" in (folder / "bone.data").read_text() and np.array_equal(packing.ids, np.arange(1, 801))
    beyond = (packing.radius - bone.depth(packing.x)) / packing.radius.mean()
    assert beyond.max() < 0.07 and np.sum(np.abs(beyond) < 0.05) > 400
    near = beyond[np.abs(beyond) < 0.02]
    assert np.sqrt(np.mean(near**2)) < 0.015
    pairs, ratio = specimen.pairs_within(packing, 1.5)
    assert 2 * np.sum(ratio < specimen.TOUCHING) / 800 == pytest.approx(4.5, abs=0.5) and ratio.min() > 0.99


def test_grips_stretch_less_than_the_gauge(walk):
    """Elastic: twice the section strains half as much."""
    curve = read_csv(walk[0] / "bone.csv")
    assert curve["strain_gauge"][4] / curve["strain"][4] == pytest.approx(1.2, abs=0.06)


def soup_of(path):
    """Triangles (T,3,3) of a file."""
    mesh = surface.read_mesh(path)
    return np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]


def test_parts_are_what_their_script_writes(tmp_path):
    subprocess.run([sys.executable, str(PARTS / "make_parts.py"), str(tmp_path)], check=True, env={**os.environ, "PYTHONPATH": str(REPOSITORY / "tools")})
    for name in ("dog_bone.stl", "plate_with_hole.stl"):
        assert soup_of(tmp_path / name) == pytest.approx(soup_of(PARTS / name), abs=1e-5)


def test_example_is_the_bar_of_the_tests(tmp_path):
    made = tool(tmp_path, "--example", "bar.stl")
    assert made.returncode == 0 and made.stdout == "written: bar.stl, a tension bar along z in mm\n"
    assert (tmp_path / "bar.stl").read_bytes() == (PARTS / "dog_bone.stl").read_bytes()
    for name, words in (("bar.stl", "there is such a file: give another name"), ("no/bar.stl", "No such file or directory")):
        refused = tool(tmp_path, "--example", name)
        assert refused.returncode == 2 and f"--example {name}: {words}" in refused.stdout


@pytest.mark.parametrize("change, options, message", [
    (None, {"--n": 100}, "--n 100 is too small: the thinnest section is 0.0079. m, and 100 spheres have a diameter of 0.00377 m; 3 must fit side by side: give --n "),
    (lambda soup: soup[5:] + [0.0, 0.0, 1000.0], {}, r"part.stl is open: .* 10\d\d\S* of the file;"),
    (lambda soup: np.concatenate([soup, soup + 100.0]), {}, "part.stl has 2 separate shells"),
    (lambda soup: np.concatenate([soup, soup + [0.0, 7.0, 9.0]]), {}, "part.stl has 2 separate shells"),
    (None, {"--n": 20}, "--n must be at least 50, got 20"), (None, {"--seed": 0}, "--seed must be a positive integer, got 0"),
    (None, {"--density": 0}, "--density must be positive, got 0"), (None, {"--out": "no/folder/part.data"}, "--out no/folder/part.data: there is no folder"),
    (None, {"--unit": "km"}, "argument --unit: invalid choice: 'km'")])
def test_faults_are_named_and_leave_no_file(tmp_path, change, options, message):
    soup = soup_of(PARTS / "dog_bone.stl") if change is None else change(soup_of(PARTS / "dog_bone.stl"))
    surface.write_mesh(tmp_path / "part.stl", surface.mesh_of(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3)))
    options = {"--n": 800, "--out": "part.data", "--axis": "z", **options}
    run = tool(tmp_path, "part.stl", *(word for item in options.items() for word in item))
    assert run.returncode not in (0, None) and re.search(message, run.stdout), run.stdout
    assert run.stdout.count("error:") == 1 and "Traceback" not in run.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["part.stl"]


def test_remedy_for_a_thin_section_works(tmp_path):
    """As many spheres as the message asks for."""
    shutil.copy(PARTS / "dog_bone.stl", tmp_path / "part.stl")
    needed = int(re.search(r"give --n (\d+)", tool(tmp_path, "part.stl", "--axis", "z", "--n", 60, "--out", "part.data").stdout)[1])
    run = tool(tmp_path, "part.stl", "--axis", "z", "--n", needed, "--out", "part.data")
    assert run.returncode == 0 and (tmp_path / "part.data.body").exists(), run.stdout


@pytest.mark.parametrize("unit, warned", [("um", True), ("m", True), ("mm", False)])
def test_odd_unit_is_asked_about(tmp_path, unit, warned):
    run = tool(tmp_path, PARTS / "dog_bone.stl", "--axis", "z", "--n", 60, "--unit", unit, "--out", "part.data")
    assert (f"WARNING: with --unit {unit} the part is" in run.stdout) == warned and "is too small" in run.stdout


def test_failed_run_leaves_the_files_there_before(tmp_path):
    """LAMMPS cannot be started."""
    (tmp_path / "part.data").write_text("mine")
    run = subprocess.run([sys.executable, str(REPOSITORY / "tools" / "body.py"), str(PARTS / "dog_bone.stl"), "--axis", "z", "--n", "800", "--out", "part.data"],
                         cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**os.environ, "EVP_LMP": "/no/lmp"}, check=False)
    assert run.returncode != 0 and "no program /no/lmp" in run.stdout
    assert (tmp_path / "part.data").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1
