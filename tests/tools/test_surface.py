# SPDX-License-Identifier: GPL-2.0-only
"""Reading a part, checking its surface, what it encloses: against closed forms, and each fault by its own message."""

import importlib.util

import body
import numpy as np
import pytest
from evp import surface
from evp.run import CHECKOUT, DECKS
from inputs import mesh_of, write_mesh

PARTS = CHECKOUT / "tests" / "data" / "parts"
BOX = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]])
pytestmark = pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="no open3d: " + surface.OPEN3D)


def box(shift=0.0, size=1.0):
    """Triangles (T,3,3) of a cube."""
    return size * BOX[FACES] + shift


def cube_of(soup):
    return surface.closed_surface(mesh(soup), "cube")


def mesh(soup):
    return mesh_of(np.reshape(soup, (-1, 3)), np.arange(3 * len(soup)).reshape(-1, 3))


def ascii_stl(soup):
    facets = "".join("facet normal 0 0 0\n outer loop\n" + "".join("  vertex {} {} {}\n".format(*corner) for corner in corners) + " endloop\nendfacet\n" for corners in soup)
    return f"solid a\n{facets}endsolid a\n"


TEXT = ascii_stl(box())


@pytest.mark.parametrize("raw", [None, b"solid box", TEXT.encode(), TEXT.replace("\n", "\r\n").encode()])
def test_files_are_read(tmp_path, raw):
    """Binary, also where it begins as text; text, also with the lines of Windows."""
    path = tmp_path / "box.stl"
    write_mesh(path, mesh(box()))
    if raw:
        path.write_bytes(raw.ljust(80) + path.read_bytes()[80:] if raw == b"solid box" else raw)
    read = surface.closed_surface(surface.read_mesh(path), "box")
    assert read.volume() == pytest.approx(1.0, rel=1e-6) and len(read.triangles) == 12 and len(read.corners) == 8


@pytest.mark.parametrize("raw", [b"", b"\x00" * 84, b"solid a\nendsolid a\n", b"<html>not found</html>" * 10, TEXT.replace("vertex 1", "vertex nan", 1).encode(),
                                 b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 1 2 3\nvertex 4 5\n"])
def test_what_is_no_part(tmp_path, raw):
    (tmp_path / "a.stl").write_bytes(raw)
    with pytest.raises(ValueError, match="a.stl holds no triangles, or is damaged: export the part as binary STL again"):
        surface.read_mesh(tmp_path / "a.stl")


def test_part_far_from_the_origin(tmp_path):
    """A box of 1: kept to a thousandth, or refused."""
    write_mesh(tmp_path / "box.stl", mesh(box() + 1e4))
    assert np.ptp(np.asarray(surface.read_mesh(tmp_path / "box.stl").vertices), axis=0) == pytest.approx(1.0, rel=2e-3)
    write_mesh(tmp_path / "box.stl", mesh(box() + 1e5))
    with pytest.raises(ValueError, match="from the origin of the file, where 7 digits round coordinates .* move the part to the origin"):
        surface.read_mesh(tmp_path / "box.stl")


SPIKE = np.array([[BOX[a], BOX[b], [0.6, 0.3, -0.5]] for a, b in ((4, 5), (5, 6), (6, 7), (7, 4))])  # of the top, through the bottom


@pytest.mark.parametrize("soup, message", [
    (box()[1:], "is open: 3 edges belong to one triangle only, one at .*; close the holes"),
    (np.concatenate([box(), box(3.0)]), "has 2 separate shells: export one part"),
    (np.concatenate([box(), box() + [1.0, 1.0, 0.0]]), "1 edges belong to more than two triangles"),
    *((np.concatenate([box(), copy]), "has its surface twice: 24 triangles, of which 12 differ; delete the copy") for copy in (box(), box()[::-1, [1, 2, 0]])),
    (np.ones((4, 3, 3)), "the triangles have no area"), (np.concatenate([BOX[np.delete(FACES, [2, 3], axis=0)], SPIKE]), "crosses itself, near .*; unite its pieces"),
    (BOX[[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]], "encloses no volume|crosses itself")])
def test_faults_of_a_surface(soup, message):
    with pytest.raises(ValueError, match="^part.stl.*" + message):
        surface.closed_surface(mesh(soup), "part.stl")


def test_normals_are_made_to_point_outwards():
    for soup in (box(), box()[:, ::-1], np.concatenate([box()[:1, ::-1], box()[1:]])):
        cube = cube_of(soup)
        middle = cube.corners[cube.triangles].mean(axis=1) - 0.5
        assert cube.volume() == pytest.approx(1.0) and (np.einsum("ij,ij->i", cube.normals, middle) > 0.1).all()


def test_what_a_surface_encloses():
    """The parts: a polygon of 32 corners is turned, a hole of as many is cut. Control: the sections differ."""
    parts = {axis: surface.closed_surface(surface.read_mesh(path), path.stem).placed(axis, 1e-3)
             for axis, path in (("z", DECKS / "dog_bone.stl"), ("x", PARTS / "plate_with_hole.stl"))}
    bone, plate, polygon = parts["z"], parts["x"], 0.5 * 32 * np.sin(2 * np.pi / 32)
    assert bone.section_area(0.5 * bone.extents[0]) == pytest.approx(polygon * 0.004**2, rel=1e-6)
    assert bone.section_area(0.002) == pytest.approx(polygon * 0.006**2, rel=1e-6)
    middles = (np.arange(500) + 0.5) / 500 * bone.extents[0]
    assert bone.volume() == pytest.approx(np.mean([bone.section_area(x) for x in middles]) * bone.extents[0], rel=1e-3)
    assert plate.extents == pytest.approx([0.06, 0.024, 0.008], rel=1e-6)
    assert plate.section_area(0.03) == pytest.approx(8e-3 * (0.024 - 2 * 0.005), rel=0.01) and plate.section_area(0.01) == pytest.approx(1.92e-4, rel=1e-6)


@pytest.mark.parametrize("axis, order", [("x", (0, 1, 2)), ("y", (1, 2, 0)), ("z", (2, 0, 1))])
def test_axis_becomes_x_by_a_rotation(axis, order):
    placed = cube_of(box() * [1.0, 2.0, 3.0] + 5.0).placed(axis, 1e-3)
    assert placed.extents == pytest.approx(1e-3 * np.array([1.0, 2.0, 3.0])[list(order)]) and placed.volume() == pytest.approx(6e-9)
    assert placed.low[0] == 0.0 and placed.low[1:] == pytest.approx(-0.5 * placed.extents[1:])


def test_depth_within_a_cube_and_outside_and_points_on_it():
    """Signed distance in closed form, next to faces, edges and corners too; points are spread evenly."""
    random = np.random.default_rng(1)
    x = np.concatenate([random.random((4000, 3)) * 1.6 - 0.3, 1.0 + 0.2 * random.random((500, 3)), np.round(random.random((500, 3))) + 0.1 * random.standard_normal((500, 3))])
    outward = np.maximum(np.maximum(-x, x - 1.0), 0.0)
    expected = np.where((outward > 0.0).any(axis=1), -np.linalg.norm(outward, axis=1), np.min(np.minimum(x, 1.0 - x), axis=1))
    cube = cube_of(box())
    assert cube.depth(x) == pytest.approx(expected, abs=1e-6)
    assert cube.thickness(random) == pytest.approx(1.0, abs=0.05)
    plate = cube_of(box() * [1.0, 1.0, 0.2])
    assert body.check_thickness(plate, 2000, random) == pytest.approx(0.1 / body.guessed_radius(0.2, 2000), rel=0.05), "spheres across the wall"
    points = cube.spread_points(0.05, np.random.default_rng(2))
    tree = surface.cKDTree(points)
    assert tree.query(points, 2)[0][:, 1].min() >= 0.05 and tree.query(cube.scattered(20000, random)[0])[0].max() < 0.075
