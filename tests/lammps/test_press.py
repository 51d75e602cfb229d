# SPDX-License-Identifier: GPL-2.0-only
"""in.press: a wedge of spheres, made of an STL file, beside the same wedge as a LAMMPS region; balance of forces and energies, what is left when it is gone."""

import importlib.util
import re

import doc_blocks
import numpy as np
import pytest
import tool
from evp import surface
from inputs import call
from lammps_run import DECKS, packed, read_csv, read_dump, run_lammps

METAL = "160 8 4 1.4 8 4 0.0007 0 1.5 spacing 0.00374 coordination 13.05 kv 700 flow 0 1 0.02 1.4 0.3 2 2 3"  # E 193 GPa
TRAVEL = 0.0015
pytestmark = pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="no open3d: " + surface.OPEN3D)

block = packed("block.data", n=500, shape="block", length=0.02, width=0.012, height=0.008)


@pytest.fixture(scope="module")
def wedges(tmp_path_factory):
    """{axis: the data file of wedge.stl} of spheres of half the diameter of those of the block at most."""
    folder = tmp_path_factory.mktemp("tools")
    for axis in "yz":
        assert not call(tool.main, DECKS / "wedge.stl", "--size", 6e-4, "--axis", axis, "--out", folder / f"{axis}.data").returncode
    return {axis: folder / f"{axis}.data" for axis in "yz"}


@pytest.fixture
def press(tmp_path, block):
    """in.press on the block; returns the curve, the numbers of the last line, and the run."""
    def run(**choices):
        (tmp_path / "also.lmp").write_text('variable spheres_now equal count(all)\nfix told all print ${nsteps} "spheres ${spheres_now}"\n', encoding="utf-8")
        found = run_lammps("in.press", 1, {"specimen": block, "coeff": METAL, "travel": TRAVEL, "speed": 20, "also": "also.lmp", "out": "part", **choices}, tmp_path).ok()
        assert not found.warnings(), found.warnings()
        said = re.findall("^in.press: .*", found.stdout, re.M)[-1]
        return read_csv(tmp_path / "part.csv"), [float(word) for word in re.findall(r"-?\d+\.?\d*(?:e[-+]?\d+)?", said)], found

    return run


@pytest.mark.parametrize("base, friction", [("plane", 0.1), ("held", 0.3)])
def test_spheres_press_as_the_region_does(press, wedges, tmp_path, base, friction):
    """From a quarter of the travel on, where it is longer than a sphere is deep: the mean force, and that of the second half, within 5 %. The force of the base
    is that of the tool, but for inertia; forces along the edge and across it are small; energies balance, and nearly the whole imprint stays."""
    curves = {}
    for name, choices in (("region", {"region": DECKS / "regions" / "wedge.lmp"}), ("spheres", {"tool": wedges["z"]})):
        curve, (_, largest, imbalance, sank, left), found = press(base=base, friction=friction, **choices)
        late = curve["travel"] > 0.25 * TRAVEL
        assert len(late) == 201 and curve["travel"][-1] == pytest.approx(TRAVEL) and largest == pytest.approx(curve["force"].max(), rel=1e-4)
        assert np.array_equal(curve["force"], curve["force_z"]) and np.mean(curve["force_base"][late]) == pytest.approx(np.mean(curve["force"][late]), rel=0.03)
        assert max(np.abs(np.mean(curve[f"force_{axis}"][late])) for axis in "xy") < 0.1 * np.mean(curve["force"][late])
        assert abs(imbalance) < 1e-3 and 0.5 * TRAVEL < left < sank < TRAVEL
        assert (int(re.search(r"^spheres (\d+)", found.stdout, re.M)[1]) > 2000) == (name == "spheres"), "control: the tool is there"
        assert len(read_dump(tmp_path / "part_state.dump")[-1]["id"]) == 500, "the tool is taken away"
        curves[name] = curve["force"][late]
    for part in (slice(None), slice(len(curves["region"]) // 2, None)):
        assert np.mean(curves["spheres"][part]) == pytest.approx(np.mean(curves["region"][part]), rel=0.05)


def test_along_another_axis(press, wedges):
    """Its end, a triangle of 25 mm2, goes down along y: the force is along y, and grows at once to a few times the flow stress over that area, few spheres as it meets."""
    curve, *_ = press(axis="y", tool=wedges["y"], travel=0.0005)
    late = curve["travel"] > 0.0003
    assert np.array_equal(curve["force"], curve["force_y"])
    assert 1.0 < np.mean(curve["force"][late]) / (25e-6 * 193e9 * 0.0007 * 1.4) < 7.0


def test_commands_of_the_page(tmp_path):
    doc_blocks.prepare(tmp_path)
    block = next(one for one in doc_blocks.blocks("doc/Howto_evp_part.rst") if "tools/tool.py" in one.text)
    doc_blocks.run([doc_blocks.shorter(command, {"in.specimen": "-var n 200", "in.press": "-var travel 0.0005 -var speed 20"}) for command in block.commands()], tmp_path)
    assert read_csv(tmp_path / "press.csv")["force"].max() > 1e3


@pytest.mark.parametrize("choices, message", [
    ({"axis": "z", "tool": "y"}, r"was not made to move along z: its lowest point must be at 0 there; give evp tool --axis z"),
    ({"tool": "z", "travel": 1e-5, "speed": 10}, "the tool has not touched the body: give a longer -var travel")])
def test_what_is_refused(tmp_path, block, wedges, choices, message):
    found = run_lammps("in.press", 1, {"specimen": block, "coeff": METAL, "out": "part", **choices, "tool": wedges[choices["tool"]]}, tmp_path)
    assert found.returncode and re.search("ERROR: in.press: .*" + message, found.stdout)
