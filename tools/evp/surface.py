# SPDX-License-Identifier: GPL-2.0-only
"""A closed surface of triangles: is it one, what does it enclose, how far is a point from it, points spread over it.

The nearest place of the surface and its crossings are found by Open3D, which is imported where it is first needed.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .interpreter import require

OPEN3D = "apt-get install python3-open3d (Debian), or pip install open3d"
_MERGE = 1e-6  # of the longest extent: corners nearer than this are one
_AT_EDGE = 1e-4  # weight of a corner below which a place of a triangle is on the edge opposite to it
_BATCH = 200_000  # points that Open3D looks at in one call


class Surface:
    """corners (V,3) and triangles (T,3) of a checked, closed surface whose normals point outwards. Units are the caller's."""

    def __init__(self, corners, triangles):
        self.corners, self.triangles = corners, triangles
        self._scene = self._normals = self._corner_normals = self._edge_normals = None

    @property
    def soup(self):
        """Triangles as (T,3,3)."""
        return self.corners[self.triangles]

    @property
    def low(self):
        return self.corners.min(axis=0)

    @property
    def extents(self):
        """(3,) longest way along x, y and z."""
        return np.ptp(self.corners, axis=0)

    def volume(self):
        return signed_volume(self.soup)

    def areas(self):
        """(T,) of the triangles."""
        a, b, c = np.moveaxis(self.soup, 1, 0)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)

    def section_area(self, x):
        """Area of the cross-section with the plane at x, holes left out: Green's theorem over the segments in which triangles cut it."""
        soup = self.soup
        above = soup[:, :, 0] > x  # no corner counts as on the plane: it is moved by less than round-off
        area = 0.0
        for triangle, up in zip(soup[above.any(axis=1) & ~above.all(axis=1)], above[above.any(axis=1) & ~above.all(axis=1)]):
            lone = int(np.flatnonzero(up == (up.sum() == 1))[0])  # the corner that is alone on its side
            ends = []
            for other in ((lone + 1) % 3, (lone + 2) % 3):
                a, b = triangle[lone], triangle[other]
                ends.append(a[1:] + (b[1:] - a[1:]) * (x - a[0]) / (b[0] - a[0]))
            (y0, z0), (y1, z1) = ends if up[lone] else ends[::-1]
            area += 0.5 * (y0 * z1 - y1 * z0)
        return abs(area)

    def scene(self):
        """Open3D's scene of the surface, made once."""
        if self._scene is None:
            open3d = open3d_module()
            self._scene = open3d.t.geometry.RaycastingScene()
            self._scene.add_triangles(self.corners.astype(np.float32), self.triangles.astype(np.uint32))
        return self._scene

    def depth(self, points):
        """(P,) how deep points (P,3) lie within: distance to the surface, negative outside.

        The sign is that of the angle-weighted normal at the nearest place of the surface (Baerentzen and Aanaes 2005): Open3D's own takes
        rays, which hit nothing where Embree heeds ray masks, as in Debian.
        """
        return np.concatenate([self._depth(part) for part in np.array_split(points, len(points) // _BATCH + 1)])

    def _depth(self, points):
        found = self.scene().compute_closest_points(points.astype(np.float32))
        which, near = found["primitive_ids"].numpy(), found["points"].numpy().astype(float)
        u, v = found["primitive_uvs"].numpy().T.astype(float)
        weights = np.stack([1.0 - u - v, u, v], axis=1)  # of the corners
        there = weights > _AT_EDGE
        number = there.sum(axis=1)
        normal = self.face_normals()[which]
        corner = self.triangles[which, np.argmax(weights, axis=1)]
        normal[number == 1] = self.corner_normals()[corner[number == 1]]
        edge = number == 2  # the edge opposite to the corner that has no weight
        normal[edge] = self.edge_normals()[which[edge], np.argmin(weights, axis=1)[edge]]
        away = points - near
        return np.where(np.einsum("ij,ij->i", away, normal) > 0.0, -1.0, 1.0) * np.linalg.norm(away, axis=1)

    def face_normals(self):
        """(T,3) unit normals."""
        if self._normals is None:
            a, b, c = np.moveaxis(self.soup, 1, 0)
            normals = np.cross(b - a, c - a)
            self._normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        return self._normals

    def corner_normals(self):
        """(V,3) sums of the normals of the triangles at each corner, weighted by their angles there."""
        if self._corner_normals is None:
            total = np.zeros_like(self.corners)
            for k in range(3):
                a, b, c = (self.corners[self.triangles[:, (k + j) % 3]] for j in range(3))
                along, other = b - a, c - a
                angle = np.arctan2(np.linalg.norm(np.cross(along, other), axis=1), np.einsum("ij,ij->i", along, other))
                np.add.at(total, self.triangles[:, k], angle[:, None] * self.face_normals())
            self._corner_normals = total
        return self._corner_normals

    def edge_normals(self):
        """(T,3,3) sum of the normals of both triangles at the edge opposite to each corner of each triangle."""
        if self._edge_normals is None:
            edges = np.sort(self.triangles[:, [1, 2, 2, 0, 0, 1]].reshape(-1, 2), axis=1)
            _, which = np.unique(edges, axis=0, return_inverse=True)
            total = np.zeros((which.max() + 1, 3))
            np.add.at(total, which.ravel(), np.repeat(self.face_normals(), 3, axis=0))
            self._edge_normals = total[which.ravel()].reshape(-1, 3, 3)
        return self._edge_normals

    def thickness(self, random, count=400):
        """(count,) way through the body from random places of its surface, straight inwards (Moeller and Trumbore 1997)."""
        places, normals = self.scattered(count, random)
        a, b, c = np.moveaxis(self.soup, 1, 0)
        along, other, size, ways = b - a, c - a, self.extents.max(), np.empty(count)
        for k, (place, ray) in enumerate(zip(places, -normals)):
            p, start = np.cross(ray, other), place - a
            det = np.einsum("ij,ij->i", along, p)
            with np.errstate(divide="ignore", invalid="ignore"):
                u = np.einsum("ij,ij->i", start, p) / det
                q = np.cross(start, along)
                v, way = q @ ray / det, np.einsum("ij,ij->i", q, other) / det
                hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (way > 1e-6 * size)
            ways[k] = way[hit].min() if hit.any() else np.inf  # none only by round-off, at an edge
        return ways

    def scattered(self, count, random):
        """Random places (count,3), as dense everywhere, and their outward normals (count,3)."""
        areas = self.areas()
        which = random.choice(len(areas), size=count, p=areas / areas.sum())
        u, v = random.random((2, count))
        u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
        a, b, c = np.moveaxis(self.soup[which], 1, 0)
        normals = np.cross(b - a, c - a)
        return a + u[:, None] * (b - a) + v[:, None] * (c - a), normals / np.linalg.norm(normals, axis=1)[:, None]

    def spread_points(self, spacing, random):
        """Points (P,3) of the surface, no two nearer than spacing, and none of the surface much farther from one than that."""
        places, _ = self.scattered(int(5 * self.areas().sum() / spacing**2) + 100, random)
        places = np.vstack([self.corners, places])
        pairs = cKDTree(places).query_pairs(spacing, output_type="ndarray")
        kept, undecided = np.zeros(len(places), bool), np.ones(len(places), bool)
        while len(pairs):  # who comes before all undecided neighbors is kept, its neighbors go
            first = undecided.copy()
            first[pairs[:, 1]] = False  # query_pairs gives i < j
            kept |= first
            undecided &= ~first
            gone = np.zeros(len(places), bool)
            gone[pairs[first[pairs[:, 0]], 1]] = True
            undecided &= ~gone
            pairs = pairs[undecided[pairs[:, 0]] & undecided[pairs[:, 1]]]
        return places[kept | undecided]


def open3d_module():
    """Open3D; ends the program with one line where no Python here has it."""
    require("numpy", "scipy", "matplotlib", "open3d", remedy=OPEN3D)
    import open3d  # it takes seconds
    return open3d


def signed_volume(soup):
    """Volume within triangles (T,3,3): positive where their normals point outwards. From a corner of theirs, for the digits."""
    a, b, c = np.moveaxis(soup - soup[0, 0], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def closed_surface(soup, name):
    """The Surface of triangles (T,3,3). ValueError, which says what is wrong, where and what to do, if they are no closed one."""
    size = float(np.ptp(soup.reshape(-1, 3), axis=0).max())
    if not size > 0.0:
        raise ValueError(f"{name}: all triangles lie in one point: export the part again")
    corners, triangles = merged(soup, _MERGE * size)
    if len(triangles) == 0:
        raise ValueError(f"{name}: the triangles have no area: export the part again")
    check_edges(corners, triangles, name)
    shells, shell = connected_components(_links(triangles, len(corners)), directed=False)
    if shells > 1:
        raise ValueError(f"{name} has {shells} separate shells: export one part, without inner voids, as one shell (join them in the CAD program)")
    volume = signed_volume(corners[triangles])
    if abs(volume) < 1e-9 * size**3:
        raise ValueError(f"{name} encloses no volume: it is a sheet; give it a thickness in the CAD program")
    if volume < 0.0:
        raise ValueError(f"{name} is inside out: its normals point inwards; flip them in the CAD program and export it again")
    check_crossings(corners, triangles, name)
    return Surface(corners, triangles)


def merged(soup, distance):
    """Corners (V,3) and triangles (T,3) of (T,3,3): corners within the distance are one, triangles with fewer than three go."""
    places, index = np.unique(soup.reshape(-1, 3), axis=0, return_inverse=True)
    pairs = cKDTree(places).query_pairs(distance, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places),) * 2)
    _, group = connected_components(links, directed=False)
    _, first = np.unique(group, return_index=True)
    triangles = group[index.ravel()].reshape(-1, 3)
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    used, triangles = np.unique(triangles[whole], return_inverse=True)
    return places[first][used], triangles.reshape(-1, 3)


def _links(triangles, corners):
    """Sparse matrix that links the corners of each triangle; a corner of none is not there, see merged()."""
    i, j = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    return coo_matrix((np.ones(len(i)), (i, j)), shape=(corners, corners))


def check_edges(corners, triangles, name):
    """ValueError unless each edge belongs to two triangles, which run along it in opposite directions."""
    directed = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, which, count = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
    forward = np.bincount(which.ravel(), weights=directed[:, 0] < directed[:, 1])

    def at(bad):
        x, y, z = corners[edges[np.flatnonzero(bad)[0]]].mean(axis=0)
        return f"one at {x:.6g}, {y:.6g}, {z:.6g} of the file"

    if (count == 1).any():
        raise ValueError(f"{name} is open: {np.sum(count == 1)} edges belong to one triangle only, {at(count == 1)}; close the holes in the CAD "
                         f"program (Blender: 3D-Print Toolbox, Make Manifold) and export it again")
    if (count > 2).any():
        raise ValueError(f"{name}: {np.sum(count > 2)} edges belong to more than two triangles, {at(count > 2)}: surfaces meet there; "
                         f"join them to one solid in the CAD program and export it again")
    if (forward != 1).any():
        raise ValueError(f"{name}: neighboring triangles face opposite sides, {at(forward != 1)}; make the normals consistent in the CAD program "
                         f"and export it again")


def check_crossings(corners, triangles, name):
    """ValueError where the surface crosses itself."""
    open3d = open3d_module()
    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(corners), open3d.utility.Vector3iVector(triangles))
    if mesh.is_self_intersecting():
        i, j = np.asarray(mesh.get_self_intersecting_triangles())[0]
        x, y, z = corners[triangles[[i, j]]].mean(axis=(0, 1))
        raise ValueError(f"{name} crosses itself, near {x:.6g}, {y:.6g}, {z:.6g} of the file; unite its pieces to one solid in the CAD program "
                         f"and export it again")
