# SPDX-License-Identifier: GPL-2.0-only
"""in.specimen in other shapes than the cylinder: blocks, regions with holes and notches; their FILE.body."""

import functools
import re

import numpy as np
import pytest
from evp import specimen as evp_specimen
from lammps_run import run_lammps

NOTCHED = """region bar block 0 0.05 -0.01 0.01 -0.005 0.005
region notch block 0.022 0.028 0.004 0.02 INF INF side out
region body intersect 2 bar notch
"""
TUBE = """region outer cylinder x 0 0 0.01 0 0.05
region bore cylinder x 0 0 0.004 INF INF side out
region body intersect 2 outer bore
"""
BEYOND_WALL = 0.01      # mean radii, as of the cylinder: jammed to 0.0005
MEASURED = 5e-4         # relative, of volumes and areas that are counted: Roberts' points reach 1e-4


def box_gaps(x, r, low, high):
    """(N,) how far each sphere sticks out of a box."""
    return np.max(np.maximum(np.asarray(low) - x, x - np.asarray(high)), axis=1) + r


def notch_gaps(x, r):
    """Into the notch: its two walls, its bottom and the two edges between."""
    beside = np.maximum(np.abs(x[:, 0] - 0.025) - 0.003, 0.0)
    below = np.maximum(0.004 - x[:, 1], 0.0)
    return np.maximum(box_gaps(x, r, (0, -0.01, -0.005), (0.05, 0.01, 0.005)), r - np.hypot(beside, below))


SHAPES = {  # variables, text of the region, what sticks out, volume, area at mid-length
    "block": ({"shape": "block", "width": 0.012, "height": 0.008}, None, lambda x, r: box_gaps(x, r, (0, -0.006, -0.004), (0.05, 0.006, 0.004)), 4.8e-6, 9.6e-5),
    "notched": ({"shape": "region"}, NOTCHED, notch_gaps, 1e-5 - 0.006 * 0.006 * 0.01, 0.014 * 0.01),
    "tube": ({"shape": "region"}, TUBE,
             lambda x, r: np.maximum(np.abs(np.hypot(x[:, 1], x[:, 2]) - 0.007) - 0.003 + r, box_gaps(x, r, (0, -1, -1), (0.05, 1, 1))),
             np.pi * (0.01**2 - 0.004**2) * 0.05, np.pi * (0.01**2 - 0.004**2)),
}


def read_body(path):
    """{name: value} of a FILE.body."""
    return {name: float(value) for name, value in re.findall(r"^variable (\w+) +equal +(\S+)", path.read_text(), re.M)}


def make(folder, ranks=1, region=None, **variables):
    """The deck's output and its packing."""
    if region is not None:
        (folder / "body.region").write_text(region)
        variables["region"] = "body.region"
    run = run_lammps("in.specimen", ranks, {"n": 700, "out": "body.data", **variables}, folder).ok()
    return run, evp_specimen.read_data(folder / "body.data")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Each shape, made once: output, packing, FILE.body, folder."""
    @functools.cache
    def get(shape):
        folder = tmp_path_factory.mktemp(shape)
        return *make(folder, region=SHAPES[shape][1], **SHAPES[shape][0]), read_body(folder / "body.data.body"), folder

    return get


@pytest.mark.parametrize("shape", SHAPES)
def test_a_shape_is_jammed_within_its_walls_and_measured(made, shape):
    """Spheres reach the walls and stay within; measures against closed forms. The density of the spheres gives the body the mass of its volume."""
    run, packing, body, _ = made(shape)
    beyond = SHAPES[shape][2](packing.x, packing.radius) / packing.radius.mean()
    assert len(packing.x) == 700 and not run.warnings()
    assert beyond.max() < BEYOND_WALL
    near = beyond[beyond > -0.01]  # the wall is smooth: who is near touches it
    assert len(near) > 150 and np.sqrt(np.mean(near**2)) < 0.004
    pairs, ratio = evp_specimen.pairs_within(packing, 1.5)
    assert 2 * np.sum(ratio < evp_specimen.TOUCHING) / 700 == pytest.approx(4.5, abs=0.5)
    assert ratio.min() > 0.99
    assert body["solid_fraction"] == pytest.approx(0.535 if shape == "tube" else 0.57, abs=0.015)  # a tube is all walls
    sizes = packing.radius / packing.radius.mean()
    assert (sizes.min(), sizes.max()) == pytest.approx((0.9, 1.1), abs=0.01)

    volume, area = SHAPES[shape][3:]
    assert body["volume"] == pytest.approx(volume, rel=MEASURED) and body["area"] == pytest.approx(area, rel=MEASURED)
    assert body["length"] == 0.05 and "radius" not in body
    spheres = np.sum(4 / 3 * np.pi * packing.radius**3)
    assert body["solid_fraction"] == pytest.approx(spheres / body["volume"], rel=1e-6)
    assert body["density"] * spheres == pytest.approx(2700 * body["volume"], rel=1e-6)


def test_measures_of_the_cylinder(tmp_path):
    _, packing = make(tmp_path, n=200, radius=0.015, length=0.06)
    body = read_body(tmp_path / "body.data.body")
    assert (body["length"], body["radius"]) == (0.06, 0.015) and body["area"] == pytest.approx(np.pi * 0.015**2, rel=1e-9)
    assert body["volume"] == pytest.approx(np.pi * 0.015**2 * 0.06, rel=1e-9)
    assert body["solid_fraction"] == pytest.approx(np.sum(4 / 3 * np.pi * packing.radius**3) / body["volume"], rel=1e-6)


@pytest.mark.parametrize("seed", [1, 2])
def test_no_sphere_leaves_a_region_while_the_points_part(tmp_path, seed):
    """LAMMPS stops a run in which a sphere's centre passes the wall of a region: few spheres, a thin wall, two ranks."""
    _, packing = make(tmp_path, ranks=1 + seed % 2, region=TUBE, shape="region", n=300, seed=seed)
    assert SHAPES["tube"][2](packing.x, packing.radius).max() < 0.2 * packing.radius.mean()


def test_union_of_regions_is_warned_of(tmp_path):
    """LAMMPS sees no inner edges of a union: spheres there hold nothing, and the body is not jammed."""
    bone = """region left cylinder x 0 0 0.01 0 0.015001
region gauge cylinder x 0 0 0.006 0 0.05
region cone1 cone x 0 0 0.01 0.006 0.015 0.02
region cone2 cone x 0 0 0.006 0.01 0.03 0.035
region right cylinder x 0 0 0.01 0.034999 0.05
region body union 5 left cone1 gauge cone2 right
"""
    (tmp_path / "body.region").write_text(bone)
    run = run_lammps("in.specimen", 1, {"shape": "region", "region": "body.region", "n": 700}, tmp_path)
    assert "Particle outside surface of region" in run.stdout or any("not see: make it by intersect" in line for line in run.warnings())


@pytest.mark.parametrize("count, bore, message", [(400, 0.0085, "ERROR: in.specimen: the spheres fill only"), (1000, 0.007, "% of the spheres touch a wall, which is one or two")])
def test_walls_of_one_or_two_spheres(tmp_path, count, bore, message):
    """A tube whose wall is thinner than a sphere, or less than two diameters. Control: the tube above prints no warning."""
    (tmp_path / "body.region").write_text(TUBE.replace("0.004 INF", f"{bore} INF"))
    run = run_lammps("in.specimen", 1, {"shape": "region", "region": "body.region", "n": count, "out": "body.data"}, tmp_path)
    assert message in run.stdout and (run.returncode != 0) == message.startswith("ERROR")


@pytest.mark.parametrize("region, message", [
    ("region body block 1 2 1 2 1 2\n", "No overlap of box and region"),
    ("region body block 0 0.04 -0.01 0.01 -0.01 0.01\n", "reaches from x = [0-9.e-]+ to 0.04 m, not from 0 to length = 0.05"),
    ("region other block 0 0.05 -0.01 0.01 -0.01 0.01\n", "body")])
def test_regions_that_are_no_body_stop(tmp_path, region, message):
    (tmp_path / "body.region").write_text(region)
    run = run_lammps("in.specimen", 1, {"shape": "region", "region": "body.region", "out": "body.data"}, tmp_path)
    assert run.returncode != 0 and re.search(r"^ERROR.*" + message, run.stdout, re.M), run.stdout[-1500:]
    assert not (tmp_path / "body.data").exists()
