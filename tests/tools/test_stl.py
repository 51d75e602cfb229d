# SPDX-License-Identifier: GPL-2.0-only
"""Reading STL, checking a surface, what it encloses: against closed forms, and each fault by its own message."""

import pathlib

import numpy as np
import pytest
from evp import interpreter, part, stl, surface

PARTS = pathlib.Path(__file__).resolve().parents[1] / "data" / "parts"
BOX = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]])
HAS_OPEN3D = interpreter.importlib.util.find_spec("open3d") is not None
needs_open3d = pytest.mark.skipif(not HAS_OPEN3D, reason="no open3d: " + surface.OPEN3D)


def box(shift=0.0, size=1.0):
    """Triangles of a cube."""
    return size * BOX[FACES] + shift


@pytest.fixture
def no_crossings(monkeypatch):
    """Open3D does not look; what is tested needs no distance."""
    monkeypatch.setattr(surface, "check_crossings", lambda *_: None)


@pytest.mark.parametrize("write", [stl.write_stl, stl.write_ascii_stl])
def test_files_are_read_back(tmp_path, write):
    write(tmp_path / "box.stl", box(0.25))
    assert stl.read_stl(tmp_path / "box.stl") == pytest.approx(box(0.25), abs=1e-7)


def test_binary_that_begins_as_text(tmp_path):
    stl.write_stl(tmp_path / "box.stl", box())
    raw = (tmp_path / "box.stl").read_bytes()
    (tmp_path / "box.stl").write_bytes(b"solid box".ljust(80) + raw[80:])
    assert len(stl.read_stl(tmp_path / "box.stl")) == 12


@pytest.mark.parametrize("raw, message", [
    (b"", "is no STL file"), (b"\x00" * 84, "holds no triangle"), (b"solid a\nendsolid a\n", "holds no triangle"),
    (b"<html>not found</html>" * 10, "is no STL file"), (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 2 3\nvertex 4 5\n", "is cut short or damaged"),
    (b"solid a\nvertex 1 2 nan\nvertex 1 2 3\nvertex 3 4 5\n", "no finite number")])
def test_what_is_no_stl(tmp_path, raw, message):
    (tmp_path / "a.stl").write_bytes(raw)
    with pytest.raises(ValueError, match=message):
        stl.read_stl(tmp_path / "a.stl")


@pytest.mark.parametrize("away, kept", [(1e3, True), (1e4, True), (1e5, False), (1e8, False)])
def test_binary_file_of_a_part_far_from_the_origin(tmp_path, away, kept):
    """A box of 1: kept to a thousandth, or refused; as text it keeps its digits."""
    shifted = box() + away
    stl.write_stl(tmp_path / "box.stl", shifted)
    if kept:
        assert np.ptp(stl.read_stl(tmp_path / "box.stl"), axis=(0, 1)) == pytest.approx(np.ptp(box(), axis=(0, 1)), rel=2e-3)
    else:
        with pytest.raises(ValueError, match="from the origin of the file, where the 7 digits of binary STL round coordinates"):
            stl.read_stl(tmp_path / "box.stl")


def test_cut_binary_file(tmp_path):
    stl.write_stl(tmp_path / "box.stl", box())
    (tmp_path / "box.stl").write_bytes((tmp_path / "box.stl").read_bytes()[:-7])
    with pytest.raises(ValueError, match="one in binary with 12 triangles has 684 bytes, not 677"):
        stl.read_stl(tmp_path / "box.stl")


@pytest.mark.parametrize("soup, message", [
    (box()[1:], "is open: 3 edges belong to one triangle only, one at .*; close the holes"),
    (np.concatenate([box(), box(3.0)]), "has 2 separate shells: export one part"),
    (np.concatenate([box(), box(0.25, 0.5)[:, ::-1]]), "has 2 separate shells"),
    (box()[:, ::-1], "is inside out: its normals point inwards; flip them"),
    (np.concatenate([box()[:1, ::-1], box()[1:]]), "neighboring triangles face opposite sides"),
    (np.concatenate([box(), box() + [1.0, 1.0, 0.0]]), "1 edges belong to more than two triangles"),
    (np.ones((4, 3, 3)), "all triangles lie in one point"),
    (np.concatenate([BOX[FACES[:2]], BOX[FACES[:2]][:, ::-1]]), "encloses no volume|more than two")])
def test_faults_of_a_surface(no_crossings, soup, message):
    with pytest.raises(ValueError, match="^part.stl.*" + message):
        surface.closed_surface(soup, "part.stl")


@needs_open3d
def test_surface_that_crosses_itself():
    """A spike of the cube's top pushed through its bottom: closed, one shell, positive volume."""
    top = FACES[2:4]
    spike = np.array([0.6, 0.3, -0.5])
    cap = [[BOX[a], BOX[b], spike] for a, b in ((4, 5), (5, 6), (6, 7), (7, 4))]
    soup = np.concatenate([BOX[np.delete(FACES, [2, 3], axis=0)], np.array(cap)])
    assert len(top) == 2 and surface.signed_volume(soup) > 0.1, "control"
    with pytest.raises(ValueError, match="crosses itself, near .*; unite its pieces"):
        surface.closed_surface(soup, "part.stl")


def test_what_a_surface_encloses(no_crossings):
    """The parts: a polygon of 32 corners is turned, a hole of as many is cut. Control: the sections differ."""
    bone = surface.closed_surface(part.placed(stl.read_stl(PARTS / "dog_bone.stl"), "z", 1e-3), "bone")
    polygon = 0.5 * 32 * np.sin(2 * np.pi / 32)
    assert bone.section_area(0.5 * bone.extents[0]) == pytest.approx(polygon * 0.004**2, rel=1e-6)
    assert bone.section_area(0.002) == pytest.approx(polygon * 0.006**2, rel=1e-6)
    middles = (np.arange(4000) + 0.5) / 4000 * bone.extents[0]
    assert bone.volume() == pytest.approx(np.mean([bone.section_area(x) for x in middles[::8]]) * bone.extents[0], rel=1e-3)
    plate = surface.closed_surface(part.placed(stl.read_stl(PARTS / "plate_with_hole.stl"), "x", 1e-3), "plate")
    assert plate.extents == pytest.approx([0.06, 0.024, 0.008], rel=1e-6)
    assert plate.section_area(0.03) == pytest.approx(8e-3 * (0.024 - 2 * 0.005), rel=0.01) and plate.section_area(0.01) == pytest.approx(1.92e-4, rel=1e-6)


@pytest.mark.parametrize("axis, order", [("x", (0, 1, 2)), ("y", (1, 2, 0)), ("z", (2, 0, 1))])
def test_axis_becomes_x_by_a_rotation(axis, order):
    soup = part.placed(box() * [1.0, 2.0, 3.0] + 5.0, axis, 1e-3)
    assert np.ptp(soup.reshape(-1, 3), axis=0) == pytest.approx(1e-3 * np.array([1.0, 2.0, 3.0])[list(order)])
    assert surface.signed_volume(soup) == pytest.approx(6e-9) and soup[..., 0].min() == 0.0 and soup[..., 1].min() == pytest.approx(-soup[..., 1].max())


@needs_open3d
def test_depth_within_a_cube_and_outside():
    """Signed distance in closed form, next to faces, edges and corners too."""
    random = np.random.default_rng(1)
    x = np.concatenate([random.random((4000, 3)) * 1.6 - 0.3, 1.0 + 0.2 * random.random((500, 3)), np.round(random.random((500, 3))) + 0.1 * random.standard_normal((500, 3))])
    outward = np.maximum(np.maximum(-x, x - 1.0), 0.0)
    expected = np.where((outward > 0.0).any(axis=1), -np.linalg.norm(outward, axis=1), np.min(np.minimum(x, 1.0 - x), axis=1))
    cube = surface.closed_surface(box(), "cube")
    assert cube.depth(x) == pytest.approx(expected, abs=1e-6)
    assert cube.thickness(random) == pytest.approx(1.0, abs=1e-6)


def test_points_are_spread_evenly(no_crossings):
    random = np.random.default_rng(2)
    cube = surface.closed_surface(box(), "cube")
    points = cube.spread_points(0.05, random)
    tree = surface.cKDTree(points)
    assert tree.query(points, 2)[0][:, 1].min() >= 0.05
    assert tree.query(cube.scattered(20000, random)[0])[0].max() < 0.075


def test_who_has_no_open3d_is_told_how_to_get_it(monkeypatch):
    monkeypatch.setattr(interpreter, "candidates", lambda *_: [])
    monkeypatch.setattr(interpreter.importlib.util, "find_spec", lambda name: None if name == "open3d" else object())
    with pytest.raises(SystemExit, match=r"has no open3d: apt-get install python3-open3d \(Debian\), or pip install open3d, or give one: PYTHON="):
        surface.open3d_module()
