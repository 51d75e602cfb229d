# SPDX-License-Identifier: GPL-2.0-only
"""A tool from a CAD program: its surface, closed or open, covered by one layer of spheres."""

import pathlib
import re
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from .surface import MERGE, Surface, mesh_of, place_of, thinned

SPACING = 0.4  # of the spheres, over their diameter
_DENSE = 10.0  # places per square of the spacing, of which the spheres are chosen
_SHARP = 2.0 * np.cos(np.radians(10.0))  # length of the sum of two normals, below which the edge between them is sharp: 20 degrees
_NEAR = 1e-3  # of a radius: as near as that to the surface is on it
_STEPS = 300  # in which a sphere is moved into a corner: of an angle of 10 degrees, 99.9 % of the way
_PROBES = 20_000  # places at which a layer is measured
_THIN = 0.2  # share of a surface below which there is less than a sphere, above which the tool is too thin: next to an edge it always is


class Shell(NamedTuple):
    """A connected piece of a surface: its Surface, the solid of each triangle (T,), whether it encloses a volume, how many triangles were turned."""

    surface: Surface
    solids: np.ndarray
    closed: bool
    turned: int


def solids_of(path, count):
    """(names of the solids of a text STL file, solid (count,) of each triangle); one without a name where the file tells no more."""
    raw = pathlib.Path(path).read_bytes()
    found = [(name.strip(), len(re.findall(r"^\s*facet\b", facets, re.M | re.I)))
             for name, facets in re.findall(r"^\s*solid\b([^\n]*)\n(.*?)(?=^\s*endsolid\b)", raw.decode("latin-1"), re.M | re.S | re.I)] if b"\0" not in raw else []
    names = list(dict.fromkeys(name for name, facets in found if facets))
    if len(names) < 2 or sum(facets for _, facets in found) != count:
        return [""], np.zeros(count, int)
    return names, np.repeat([names.index(name) if facets else 0 for name, facets in found], [facets for _, facets in found])


def shells_of(mesh, solids, name):
    """The Shells of Open3D's mesh, whose triangles have these solids (T,). Normals of closed ones point outwards. ValueError where one crosses itself."""
    size = float(np.ptp(np.asarray(mesh.vertices), axis=0).max())
    mesh = mesh.merge_close_vertices(MERGE * size or 1.0)
    corners, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    sides = np.diff(corners[triangles], axis=1)
    triangles, solids = (array[np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) > 0.0] for array in (triangles, solids))
    if not len(triangles):
        raise ValueError(f"{name}: the triangles have no area: export the tool again")
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    triangles, solids = triangles[np.sort(first)], solids[np.sort(first)]
    piece = np.asarray(mesh_of(corners, triangles).cluster_connected_triangles()[0])
    return [_shell(corners, triangles[piece == k], solids[piece == k], size, name) for k in range(piece.max() + 1)]


def _shell(corners, given, solids, size, name):
    used, given = np.unique(given, return_inverse=True)
    corners, given = corners[used], given.reshape(-1, 3)
    mesh = mesh_of(corners, given)
    if not mesh.is_edge_manifold(allow_boundary_edges=False) or not mesh.orient_triangles():
        return Shell(Surface(corners, given), solids, False, 0)
    surface = Surface(corners, np.asarray(mesh.triangles).copy())
    if abs(surface.volume()) < 1e-9 * size**3:
        return Shell(Surface(corners, given), solids, False, 0)
    if mesh.is_self_intersecting():
        raise ValueError(f"{name} crosses itself, near {place_of(corners[given[np.asarray(mesh.get_self_intersecting_triangles())[0]]])}; "
                         "unite its pieces to one solid in the CAD program and export it again")
    surface = surface if surface.volume() > 0.0 else Surface(corners, surface.triangles[:, ::-1])
    turned = int(np.sum(np.einsum("ij,ij->i", surface.normals, Surface(corners, given).normals) < 0.0))
    return Shell(surface, solids, True, turned)


def candidates(surface, spacing, random):
    """Places (P,3) on a surface and the triangle of each (P,): the corners, then evenly along sharp edges and rims, then scattered ones, dense."""
    triangles, ends = surface.triangles, surface.corners[surface.triangles]
    corner, first = np.unique(triangles, return_index=True)
    places, which = [surface.corners[corner]], [first // 3]
    for k in range(3):
        for t in np.nonzero(np.linalg.norm(surface.normals_at_edges()[:, k], axis=1) < _SHARP)[0]:
            a, b = ends[t, (k + 1) % 3], ends[t, (k + 2) % 3]
            share = np.linspace(0.0, 1.0, max(1, int(np.linalg.norm(b - a) / spacing)) + 1)[1:-1, None]
            places.append(a + share * (b - a))
            which.append(np.full(len(share), t))
    scattered = surface.scattered(int(_DENSE * surface.areas.sum() / spacing**2) + 100, random)
    return np.vstack([*places, scattered[0]]), np.concatenate([*which, scattered[1]])


def moved_inside(surface, places, distance):
    """Places (P,3) moved from a closed surface inwards until none is nearer to it than distance, and (P,) which of them could be."""
    near, places = np.arange(len(places)), places.copy()
    for _ in range(_STEPS):
        depth, inward = surface.depth_and_inward(places[near])
        short = depth < (1.0 - 0.5 * _NEAR) * distance
        if not short.any():
            break
        near = near[short]
        places[near] += (distance - depth[short])[:, None] * inward[short]
    return places, surface.depth(places) >= (1.0 - _NEAR) * distance


class Covering(NamedTuple):
    """centers (N,3) and solids (N,) of the spheres of a layer. sink (P,): how far one of their size sinks in between them, at places all over the layer;
    left (P,): how far places all over the surface are outside of them, at sharp edges; both over their diameter."""

    centers: np.ndarray
    solids: np.ndarray
    sink: np.ndarray
    left: np.ndarray


def covering(shell, diameter, random):
    """The Covering of a Shell by spheres of a diameter: within a closed one, with their centers on an open one. ValueError where it is too thin for them."""
    surface, radius = shell.surface, 0.5 * diameter
    thin = np.mean(surface.thickness(random) < diameter) if shell.closed else 0.0
    if thin > _THIN:
        raise ValueError(f"the tool is thinner than a sphere of {diameter:.3g} m, at {100 * thin:.0f} % of its surface: give a smaller --size, "
                         "or export its surface as an open one, whose spheres have their centers on it")

    def centers_at(places, which):
        """Of spheres that touch these places or are on them, and (P,) which of them have room."""
        if shell.closed:
            return moved_inside(surface, places - radius * surface.normals[which], radius)
        return places, np.ones(len(places), bool)

    places, which = candidates(surface, SPACING * diameter, random)
    places, fits = centers_at(places, which)
    places, which = places[fits], which[fits]
    chosen = thinned(places, 0.999 * SPACING * diameter)
    centers = places[chosen]
    tree, probes = cKDTree(centers), surface.scattered(_PROBES, random)
    left = tree.query(probes[0])[0] / diameter - (0.5 if shell.closed else 0.0)
    probes, fits = centers_at(*probes)
    gap = np.minimum(tree.query(probes[fits])[0] / diameter, 1.0)
    return Covering(centers, shell.solids[which[chosen]], 1.0 - np.sqrt(1.0 - gap**2), left)
