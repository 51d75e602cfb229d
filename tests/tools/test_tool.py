# SPDX-License-Identifier: GPL-2.0-only
"""Tools of spheres: an even layer without a hole within a closed surface, or on an open one, whatever its facets and normals; wrong units are refused."""

import importlib.util
import re

import numpy as np
import pytest
import tool
from evp import covering, specimen, surface
from evp.run import DECKS
from inputs import call, mesh_of, write_mesh
from scipy.spatial import cKDTree
from test_surface import BOX, FACES, ascii_stl, box, mesh

SIZE = 5e-4  # [m] of the spheres
WEDGE = DECKS / "wedge.stl"
pytestmark = pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="no open3d: " + surface.OPEN3D)


@pytest.fixture
def made(tmp_path, monkeypatch):
    """tool.py of a mesh or of a file in the test's own folder, in mm; returns centers [m], types and what it printed."""
    monkeypatch.chdir(tmp_path)

    def run(part, **options):
        if not hasattr(part, "triangles"):
            path = part
        else:
            path = tmp_path / "part.stl"
            write_mesh(path, part)
        words = [word for name, value in {"size": SIZE, "out": "tool.data", **options}.items() for word in (f"--{name}", value)]
        done = call(tool.main, path, *words)
        assert not done.returncode, done.stderr
        found = specimen.read_data(tmp_path / "tool.data")
        types = np.array([int(line.split()[1]) for line in (tmp_path / "tool.data").read_text().partition("# sphere\n\n")[2].splitlines()])
        assert found.radius == pytest.approx(0.5 * SIZE) and np.array_equal(found.ids, np.arange(1, len(types) + 1))
        return found.x, types, done.stdout

    return run


def wedge():
    return surface.read_mesh(WEDGE)


def assert_covers(centers, part):
    """A closed surface, whose lowest point is at z = 0 and whose middle is at x = y = 0: spheres touch it from within, none has a neighbor nearer than 0.4
    diameters, and no sphere of the same size sinks in between them by more than a seventh of it."""
    corners = 1e-3 * part.corners
    low, high = corners.min(axis=0), corners.max(axis=0)
    placed = surface.Surface(corners - [*0.5 * (low + high)[:2], low[2]], part.triangles)
    assert placed.depth(centers) == pytest.approx(0.5 * SIZE, rel=2e-3)
    tree = cKDTree(centers)
    assert tree.query(centers, 2)[0][:, 1].min() > 0.39 * SIZE
    places, which = placed.scattered(20000, np.random.default_rng(3))
    inside = places - 0.5 * SIZE * placed.normals[which]
    inside = inside[placed.depth(inside) > 0.499 * SIZE]
    assert len(inside) > 15000 and tree.query(inside)[0].max() < np.sqrt(1.0 - (6 / 7) ** 2) * SIZE
    assert 0.4 < len(centers) * (0.4 * SIZE) ** 2 / placed.areas.sum() < 0.7


def test_a_closed_surface_is_covered_from_within(made):
    """The row in the edge of the wedge touches both of its flanks. The same again is the same to the last digit."""
    centers, types, said = made(WEDGE)
    assert_covers(centers, surface.closed_surface(wedge(), "wedge"))
    row = centers[centers[:, 2] < 1.001 * 0.5 * SIZE * np.sqrt(2.0)]
    assert len(row) > 0.014 / (0.5 * SIZE) and row[:, 0] == pytest.approx(0.0, abs=1e-3 * SIZE) and np.diff(np.sort(row[:, 1])).max() < 0.8 * SIZE
    assert np.all(types == 1) and "NOTE" not in said and "1 piece" in said and re.search(r"behind those of the surface\nwritten: tool.data\n$", said)
    assert np.array_equal(made(WEDGE)[0], centers)


@pytest.mark.parametrize("facets", ["fine", "inverted", "mixed", "round"])
def test_facets_and_normals_make_no_difference(made, facets):
    """A thousand facets give as many spheres as eight; normals that point inwards are turned, and told."""
    part, coarse = wedge(), len(made(WEDGE)[0])
    if facets == "fine":
        part = part.subdivide_midpoint(4)
        assert len(part.triangles) == 2048
    elif facets == "round":
        part = surface.open3d_module().geometry.TriangleMesh.create_sphere(4.0, 20)
    else:
        corners, triangles = np.asarray(part.vertices), np.asarray(part.triangles).copy()
        turned = slice(None) if facets == "inverted" else slice(3)
        triangles[turned] = triangles[turned, ::-1]
        part = mesh_of(corners, triangles)
    centers, _, said = made(part)
    assert_covers(centers, surface.closed_surface(part, "part"))
    assert facets == "round" or len(centers) == pytest.approx(coarse, rel=0.02)
    told = {"inverted": "NOTE: normals of 8 triangles of piece 1 pointed inwards: they were turned", "mixed": "normals of 3 triangles"}.get(facets)
    assert told in said if told else "NOTE" not in said


def test_an_open_surface_has_the_centers_on_it(made):
    """The cube of 10 mm without its top, whose rim has spheres, too."""
    faces = np.array([face for face in FACES if not np.all(BOX[face][:, 2] == 1.0)])
    centers, _, said = made(mesh(10.0 * BOX[faces]))
    assert "NOTE: piece 1 is open: the centers of its spheres are on it, and the tool is 0.00025 m thicker on both sides" in said
    centers = centers - [0.0, 0.0, 0.5 * SIZE]  # its lowest point is that of the spheres
    beside = np.abs(np.abs(centers[:, :2]).max(axis=1) - 5e-3)
    assert np.minimum(beside, np.abs(centers[:, 2])).max() < 1e-8
    rim = centers[centers[:, 2] > 0.01 - 1e-8]
    assert len(rim) > 0.04 / (0.6 * SIZE)


def test_solids_are_types_and_pieces_may_be_several(made, tmp_path):
    """Punch and die in one text file; facets of one name go on after the other, and one solid alone has type 1."""
    punch, die = ascii_stl(4.0 * box()), ascii_stl(8.0 * box() + [0.0, 0.0, -20.0])
    (tmp_path / "both.stl").write_text(punch.replace("solid a", "solid the punch") + die.replace("solid a", "solid die"))
    centers, types, said = made("both.stl", axis="x")
    assert "24 triangles" in said and "2 pieces" in said and f"type 1: solid the punch, {np.sum(types == 1)} spheres\ntype 2: solid die, " in said
    assert centers[:, 0].min() == pytest.approx(0.5 * SIZE, rel=1e-3) and np.ptp(centers[types == 1], axis=0) == pytest.approx(4e-3 - SIZE, rel=1e-3)
    assert np.all(centers[types == 2, 2] < centers[types == 1, 2].min()) and "2 atom types" in (tmp_path / "tool.data").read_text()
    (tmp_path / "one.stl").write_text(punch)
    assert np.all(made("one.stl")[1] == 1)


@pytest.mark.parametrize("part, options, message", [
    (WEDGE, {"unit": "um"}, "1.4e-05 x 5e-06 m with --unit um, fewer than 4 spheres of 0.0005 m: give the --unit of the file, or a smaller --size, which is in m"),
    (WEDGE, {"unit": "m"}, r"with --unit m, which takes .* spheres of 0.0005 m, more than 200000: give the --unit of the file, or a larger --size, of 0.\d+ m at least"),
    (WEDGE, {"size": 0.3}, "fewer than 4 spheres of 0.3 m"), (WEDGE, {"size": 1e-6}, "spheres of 1e-06 m, more than"), ("no.stl", {}, "there is no file no.stl"),
    (WEDGE, {"size": 0}, "argument --size: give a positive number, got 0"), (WEDGE, {"axis": "w"}, "argument --axis: invalid choice: 'w'"),
    (10.0 * box() * [1.0, 1.0, 0.03], {}, "the tool is thinner than a sphere of 0.0005 m, at .* % of its surface: give a smaller --size, or export its surface as an open one"),
    (np.arange(4.0)[:, None, None] * np.ones((4, 3, 3)), {}, "the triangles have no area"), (b"solid a\nendsolid a\n", {}, "holds no triangles, or is damaged"),
    (np.concatenate([10.0 * BOX[np.delete(FACES, [2, 3], axis=0)], 10.0 * np.array([[BOX[a], BOX[b], [0.6, 0.3, -0.5]] for a, b in ((4, 5), (5, 6), (6, 7), (7, 4))])]), {},
     "crosses itself, near .* of the file; unite its pieces")])
def test_what_is_refused(tmp_path, monkeypatch, part, options, message):
    """And leaves no file. A file in mm that is read as m, and one in m that is read as mm."""
    monkeypatch.chdir(tmp_path)
    path = part
    if isinstance(part, bytes):
        path = tmp_path / "part.stl"
        path.write_bytes(part)
    elif isinstance(part, np.ndarray):
        path = tmp_path / "part.stl"
        write_mesh(path, mesh(part))
    done = call(tool.main, path, *(word for name, value in {"size": SIZE, "out": "tool.data", **options}.items() for word in (f"--{name}", value)))
    assert done.returncode and re.search(message, done.stderr) and done.stderr.count("error:") == 1, done.stderr
    assert not (tmp_path / "tool.data").exists()


def test_a_sphere_is_moved_into_an_acute_corner():
    """Of 20 degrees, along its flanks: the center is R/sin 10 from the edge."""
    corner = np.array([[0.0, -5.0, 0.0], [10.0 * np.tan(np.radians(10.0)), -5.0, 10.0], [-10.0 * np.tan(np.radians(10.0)), -5.0, 10.0]])
    corners = np.concatenate([corner, corner + [0.0, 10.0, 0.0]])
    part = surface.closed_surface(mesh_of(corners, np.array([[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]])), "corner")
    places, fits = covering.moved_inside(part, np.array([[0.02, 0.0, 0.1], [-0.1, 1.0, 0.3], [0.0, 2.0, 8.0]]), 0.25)
    assert fits.all() and places[2] == pytest.approx([0.0, 2.0, 8.0])
    assert places[:2, 2] == pytest.approx(0.25 / np.sin(np.radians(10.0)), rel=5e-3) and np.abs(places[:2, 0]).max() < 1e-2
