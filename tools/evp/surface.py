# SPDX-License-Identifier: GPL-2.0-only
"""A part from a CAD program: Open3D reads its file, checks that it is one closed surface, and measures it."""

import numpy as np
from scipy.spatial import cKDTree

from . import require
from .run import interrupted_later

OPEN3D = "apt-get install python3-open3d (Debian), or pip install open3d"
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
AXES = {"x": (0, 1, 2), "y": (1, 2, 0), "z": (2, 0, 1)}  # of the file, that become x, y and z; all are rotations
_DIGITS = 2.0**-24  # relative rounding of the coordinates of a file
_ROUNDED = 1e-3  # over the least extent of a part: coarser coordinates are no shape
MERGE = 1e-6  # of the longest extent: corners nearer than this are one
_ON = 1e-5  # of the longest extent: so near to the surface its normal tells the direction
_AT_EDGE = 1e-4  # weight of a corner below which a place of a triangle is on the edge opposite to it
_BATCH = 200_000  # points that Open3D looks at in one call


def open3d_module():
    """Open3D; ends the program with one line where no Python here has it."""
    require("numpy", "scipy", "matplotlib", "open3d", remedy=OPEN3D)
    with interrupted_later():  # Open3D would make another error of it
        import open3d  # it takes seconds
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    return open3d


def mesh_of(corners, triangles):
    """Open3D's mesh of corners (V,3) and triangles (T,3)."""
    o3d = open3d_module()
    return o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(corners), o3d.utility.Vector3iVector(triangles))


def read_mesh(path):
    """Open3D's mesh of a file. OSError, or ValueError where it holds no triangles, or is too far from the origin for its digits."""
    with open(path, "rb"):  # Open3D does not say why it cannot read a file
        mesh = open3d_module().io.read_triangle_mesh(str(path))
    corners = np.asarray(mesh.vertices)
    if not mesh.has_triangles() or not np.isfinite(corners).all():
        raise ValueError(f"{path} holds no triangles, or is damaged: export the part as binary STL again")
    extents, far = np.ptp(corners, axis=0), float(np.abs(corners).max())
    least = float(extents.min() or extents.max())  # a sheet is refused elsewhere
    if _DIGITS * far > _ROUNDED * least:
        raise ValueError(f"{path}: the part is {least:.3g} thin and {far:.3g} from the origin of the file, where 7 digits round coordinates "
                         f"to {2 * _DIGITS * far:.2g}: move the part to the origin in the CAD program and export it again")
    return mesh


def place_of(corners):
    """In words, the middle of corners (...,3)."""
    return "{:.6g}, {:.6g}, {:.6g} of the file".format(*corners.reshape(-1, 3).mean(axis=0))


def closed_surface(mesh, name):
    """The Surface of a mesh. ValueError, which says what is wrong, where and what to do, if it is not one closed surface."""
    size = float(np.ptp(np.asarray(mesh.vertices), axis=0).max())
    mesh = mesh.merge_close_vertices(MERGE * size or 1.0).remove_degenerate_triangles()
    given = len(mesh.triangles)
    mesh = mesh.remove_duplicated_triangles().remove_unreferenced_vertices()
    if not mesh.has_triangles():
        raise ValueError(f"{name}: the triangles have no area: export the part again")
    if given >= 2 * len(mesh.triangles):
        raise ValueError(f"{name} has its surface twice: {given} triangles, of which {len(mesh.triangles)} differ; delete the copy in the CAD program and export it again")
    corners, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)

    def at(which):
        return place_of(corners[which])

    crowded = np.asarray(mesh.get_non_manifold_edges(True))
    if len(crowded):
        raise ValueError(f"{name}: {len(crowded)} edges belong to more than two triangles, one at {at(crowded[0])}: surfaces meet there; "
                         "join them to one solid in the CAD program and export it again")
    rim = np.asarray(mesh.get_non_manifold_edges(False))
    if len(rim):
        raise ValueError(f"{name} is open: {len(rim)} edges belong to one triangle only, one at {at(rim[0])}; close the holes in the CAD "
                         "program (Blender: 3D-Print Toolbox, Make Manifold) and export it again")
    shells = len(mesh.cluster_connected_triangles()[1])
    if shells > 1:
        raise ValueError(f"{name} has {shells} separate shells: export one part, without inner voids, as one shell (join them in the CAD program)")
    if mesh.is_self_intersecting():
        sides = np.diff(corners[triangles], axis=1)
        flat = np.nonzero(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) <= 1e-6 * np.max(np.sum(sides**2, axis=2), axis=1))[0]
        if len(flat):
            raise ValueError(f"{name}: {len(flat)} triangles have no area, one near {at(triangles[flat[0]])}: remove them in the CAD program "
                             "(Blender: Degenerate Dissolve) and export it again")
        pair = np.asarray(mesh.get_self_intersecting_triangles())[0]
        raise ValueError(f"{name} crosses itself, near {at(triangles[pair])}; unite its pieces to one solid in the CAD program and export it again")
    if not mesh.orient_triangles() or mesh.get_volume() < 1e-9 * size**3:
        raise ValueError(f"{name} encloses no volume: it is a sheet; give it a thickness in the CAD program")
    found = Surface(corners, np.asarray(mesh.triangles))
    return found if found.volume() > 0.0 else Surface(corners, found.triangles[:, ::-1])


def thinned(places, spacing):
    """(P,) which of the places (P,3) are kept so that no two are nearer than spacing, and none left out is farther from one than that: the first ones."""
    pairs = cKDTree(places).query_pairs(spacing, output_type="ndarray")
    kept, undecided = np.zeros(len(places), bool), np.ones(len(places), bool)
    while len(pairs):  # who comes before all undecided neighbors is kept, its neighbors go
        first = undecided.copy()
        first[pairs[:, 1]] = False  # query_pairs gives i < j
        kept |= first
        undecided &= ~first
        undecided[pairs[first[pairs[:, 0]], 1]] = False
        pairs = pairs[undecided[pairs[:, 0]] & undecided[pairs[:, 1]]]
    return kept | undecided


class Surface:
    """corners (V,3) and triangles (T,3) of a closed surface whose normals point outwards. Units are the caller's.

    low (3,): the least x, y and z; extents (3,): the longest way along each.
    """

    def __init__(self, corners, triangles):
        self.corners, self.triangles = corners, triangles
        self.low, self.extents = corners.min(axis=0), np.ptp(corners, axis=0)
        normals = np.cross(self._edge(0), self._edge(1))
        self.areas = 0.5 * np.linalg.norm(normals, axis=1)
        self.normals = normals / np.maximum(2.0 * self.areas, 1e-300)[:, None]
        self._scene = self._at_corners = self._at_edges = None

    def _edge(self, k):
        """(T,3) from corner k to the next one of each triangle."""
        return self.corners[self.triangles[:, (k + 1) % 3]] - self.corners[self.triangles[:, k]]

    def placed(self, axis, metre):
        """The Surface in metres, with this axis of the file along x from x = 0, and the middle of its box on the x axis."""
        corners = self.corners[:, AXES[axis]] * metre
        low, high = corners.min(axis=0), corners.max(axis=0)
        return Surface(corners - [low[0], 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])], self.triangles)

    def volume(self):
        """Positive where the normals point outwards. From a corner of its own, for the digits."""
        a, b, c = np.moveaxis((self.corners - self.corners[0])[self.triangles], 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    def section_area(self, x):
        """Area of the cross-section with the plane at x, holes left out: Green's theorem over the segments in which triangles cut it."""
        soup = self.corners[self.triangles]
        above = soup[:, :, 0] > x  # no corner counts as on the plane: it is moved by less than round-off
        cut = above.any(axis=1) & ~above.all(axis=1)
        soup, above = soup[cut], above[cut]
        lone = np.argmax(above == (above.sum(axis=1) == 1)[:, None], axis=1)  # the corner that is alone on its side
        a, b, c = (soup[np.arange(len(soup)), (lone + k) % 3] for k in range(3))
        (y0, z0), (y1, z1) = ((a + (end - a) * ((x - a[:, :1]) / (end - a)[:, :1])).T[1:] for end in (b, c))
        return abs(0.5 * float(np.sum(np.where(a[:, 0] > x, 1.0, -1.0) * (y0 * z1 - y1 * z0))))

    def depth(self, points):
        """(P,) how deep points (P,3) lie within: distance to the surface, negative outside.

        The sign is that of the angle-weighted normal at the nearest place of the surface (Baerentzen and Aanaes 2005): Open3D's own takes
        rays, which hit nothing where Embree heeds ray masks, as in Debian.
        """
        return self.depth_and_inward(points)[0]

    def depth_and_inward(self, points):
        """depth() of points (P,3), and the directions (P,3) in which it grows: unit vectors."""
        if self._scene is None:
            self._scene = open3d_module().t.geometry.RaycastingScene()
            self._scene.add_triangles(self.corners.astype(np.float32), self.triangles.astype(np.uint32))
            self._sum_normals()
        parts = [self._depth_and_inward(part) for part in np.array_split(points, len(points) // _BATCH + 1)]
        return tuple(np.concatenate(found) for found in zip(*parts))

    def _depth_and_inward(self, points):
        found = self._scene.compute_closest_points(points.astype(np.float32))
        which, near = found["primitive_ids"].numpy(), found["points"].numpy().astype(float)
        u, v = found["primitive_uvs"].numpy().T.astype(float)
        weights = np.stack([1.0 - u - v, u, v], axis=1)  # of the corners
        number = (weights > _AT_EDGE).sum(axis=1)[:, None]
        at_corner = self._at_corners[self.triangles[which, np.argmax(weights, axis=1)]]
        at_edge = self._at_edges[which, np.argmin(weights, axis=1)]  # opposite to the corner that has no weight
        normal = np.where(number == 1, at_corner, np.where(number == 2, at_edge, self.normals[which]))
        away = points - near
        depth = np.where(np.einsum("ij,ij->i", away, normal) > 0.0, -1.0, 1.0) * np.linalg.norm(away, axis=1)
        on = np.abs(depth) < _ON * self.extents.max()
        inward = np.where(on[:, None], -normal, away)
        return depth, inward / np.where(on, np.linalg.norm(normal, axis=1), depth)[:, None]

    def normals_at_edges(self):
        """(T,3,3) sum of the normals of the triangles at the edge opposite to each corner."""
        if self._at_edges is None:
            self._sum_normals()
        return self._at_edges

    def _sum_normals(self):
        """Of the triangles at each corner, by their angles there (V,3), and of the two at the edge opposite to each corner (T,3,3)."""
        self._at_corners = np.zeros_like(self.corners)
        for k in range(3):
            along, back = self._edge(k), -self._edge((k + 2) % 3)
            angle = np.arctan2(np.linalg.norm(np.cross(along, back), axis=1), np.einsum("ij,ij->i", along, back))
            np.add.at(self._at_corners, self.triangles[:, k], angle[:, None] * self.normals)
        edges = np.sort(self.triangles[:, [1, 2, 2, 0, 0, 1]].reshape(-1, 2), axis=1)
        _, which = np.unique(edges, axis=0, return_inverse=True)
        total = np.zeros((which.max() + 1, 3))
        np.add.at(total, which.ravel(), np.repeat(self.normals, 3, axis=0))
        self._at_edges = total[which.ravel()].reshape(-1, 3, 3)

    def scattered(self, count, random):
        """Random places (count,3), as dense everywhere, and the triangle of each (count,)."""
        which = random.choice(len(self.areas), size=count, p=self.areas / self.areas.sum())
        u, v = np.sort(random.random((2, count)), axis=0)
        a, b, c = np.moveaxis(self.corners[self.triangles[which]], 1, 0)
        return u[:, None] * a + (v - u)[:, None] * b + (1.0 - v)[:, None] * c, which

    def thickness(self, random, count=400):
        """(count,) way through the body from random places of its surface, straight inwards; to some percent."""
        places, which = self.scattered(count, random)
        normals = self.normals[which]
        ways = self.extents.max() * np.geomspace(1e-4, 2.0, 200)
        depth = self.depth((places[:, None] - ways[:, None] * normals[:, None]).reshape(-1, 3)).reshape(count, -1)
        outside = np.argmax(depth < 0.0, axis=1)
        last, first = np.take_along_axis(depth, np.stack([outside - 1, outside], axis=1), axis=1).T
        return ways[outside - 1] + (ways[outside] - ways[outside - 1]) * last / (last - first)

    def spread_points(self, spacing, random):
        """Points (P,3) of the surface, no two nearer than spacing, and none of the surface much farther from one than that."""
        places, _ = self.scattered(int(5 * self.areas.sum() / spacing**2) + 100, random)
        places = np.vstack([self.corners, places])
        return places[thinned(places, spacing)]
