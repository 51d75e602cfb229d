# SPDX-License-Identifier: GPL-2.0-only
"""Pictures of shaded spheres by LAMMPS' own dump image: no display and no library is needed.

The projection is parallel, so that one scale bar holds for the whole picture. LAMMPS draws into a cube whose size is known, which
fixes the scale; what is drawn is cut to the spheres of all snapshots of a view.
"""

import pathlib
import tempfile
from typing import NamedTuple

import numpy as np
from PIL import Image

from . import run

# Directions to the camera as dump image takes them [degrees]: theta from z, phi from x in the plane of x and y.
VIEWS = {
    "iso": (65.0, -60.0), "front": (90.0, -90.0), "back": (90.0, 90.0), "right": (90.0, 0.0), "left": (90.0, 180.0),
    "top": (0.0, -90.0), "bottom": (180.0, -90.0),
}
SHADES = 65  # colors that a map is sampled to; LAMMPS interpolates between them
_TILT = 1e-3  # [rad] between a camera and z, where LAMMPS puts one that looks along z (image.cpp, EPSILON)
_DEEP = 1.6  # depth of what is drawn over the side of LAMMPS' picture: beyond this its camera stands inside
_MARGIN = 6  # [pixels] around the spheres


class Camera(NamedTuple):
    """One view of all snapshots: width and height [pixels] of the picture and its middle [length] in the plane of the picture."""

    theta: float
    phi: float
    per_pixel: float  # [length]
    middle: np.ndarray  # (2,)
    width: int
    height: int


def axes(theta, phi):
    """(3, 3): unit vectors to the right, up, and to the camera, for the angles [degrees]; up is z as far as it can be."""
    a, b = np.radians(theta), np.radians(phi)
    if np.sin(a) < _TILT:
        a = _TILT if theta < 90.0 else np.pi - _TILT
    to_camera = np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])
    right = np.cross([0.0, 0.0, 1.0], to_camera)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(to_camera, right), to_camera])


def extents(x, radius, theta, phi):
    """(2, 2): lower and upper ends of the spheres to the right and up, in a view [length]."""
    flat = x @ axes(theta, phi)[:2].T
    return np.array([(flat - radius[:, None]).min(axis=0), (flat + radius[:, None]).max(axis=0)])


def cameras(ends, views, pixels):
    """A Camera for each (theta, phi) of views, all of one scale, the longest side of the largest being `pixels`.

    ends: for each view, extents() of one snapshot or of several.
    """
    ends = [np.reshape(own, (-1, 2, 2)) for own in ends]
    ends = [(own[:, 0].min(axis=0), own[:, 1].max(axis=0)) for own in ends]
    per_pixel = max(float((high - low).max()) for low, high in ends) / (pixels - 2 * _MARGIN)
    found = []
    for (theta, phi), (low, high) in zip(views, ends):
        width, height = (int(n) for n in np.ceil((high - low) / per_pixel) + 2 * _MARGIN)
        found.append(Camera(theta, phi, per_pixel, 0.5 * (low + high), width, height))
    return found


def _script(camera, colors, center, edge, canvas):
    """write_dump of a view into view.ppm, a picture of canvas x canvas pixels around center."""
    zoom = 2.0 * edge / (camera.per_pixel * canvas)
    names = [f"shade{k}" for k in range(len(colors))]
    steps = [f"{k / (len(names) - 1):.9g} {name}" for k, name in enumerate(names)]
    steps[0], steps[-1] = f"min {names[0]}", f"max {names[-1]}"
    define = " ".join(f"color {name} {r:.4f} {g:.4f} {b:.4f}" for name, (r, g, b) in zip(names, colors))
    where = " ".join(f"{value:.15g}" for value in center / edge + 0.5)
    return (f"write_dump all image view.ppm vx diameter size {canvas} {canvas} view {camera.theta:.9g} {camera.phi:.9g} zoom {zoom:.15g} "
            f"center s {where} box no 0 shiny 0 ssao no 1 0.5 fsaa yes modify backcolor white {define} "
            f"amap 0 1 ca 0.0 {len(names)} {' '.join(steps)}\n")


def _data(x, radius, value, edge):
    """A data file of spheres in a cube around the origin; the value that colors them is their vx."""
    rows = np.column_stack([2.0 * radius, x])
    half = 0.5 * edge
    head = f"spheres to draw\n\n{len(x)} atoms\n1 atom types\n\n" + "".join(f"{-half:.15g} {half:.15g} {a}lo {a}hi\n" for a in "xyz")
    atoms = "".join(f"{k} 1 {d:.9g} 1 {a:.12g} {b:.12g} {c:.12g}\n" for k, (d, a, b, c) in enumerate(rows.tolist(), 1))
    speeds = "".join(f"{k} {v:.9g} 0 0 0 0 0\n" for k, v in enumerate(value.tolist(), 1))
    return f"{head}\nAtoms # sphere\n\n{atoms}\nVelocities\n\n{speeds}"


def _reason(error, lmp):
    """What LAMMPS says, with the remedy where it was built without the package of dump image."""
    if "part of the GRAPHICS package" not in error:
        return error
    return (f"{lmp} was built without the package GRAPHICS, to which dump image belongs since LAMMPS 11 Feb 2026. Run cmake "
            f"-DPKG_GRAPHICS=on on the build folder of LAMMPS and build it again, or set EVP_LMP to an lmp that has it. LAMMPS says: {error}")


def _draw(x, radius, value, colors, camera):
    """The picture of spheres that are all in front of LAMMPS' camera."""
    corner = np.array([(x - radius[:, None]).min(axis=0), (x + radius[:, None]).max(axis=0)])
    origin, unit = corner.mean(axis=0), float((corner[1] - corner[0]).max())
    edge = 1.01  # of the cube, in which the longest side of the body is 1
    right, up, _ = axes(camera.theta, camera.phi)
    flat = camera.middle - np.array([right @ origin, up @ origin])
    canvas = max(camera.width, camera.height)
    canvas += canvas % 2
    view = _script(camera._replace(per_pixel=camera.per_pixel / unit), colors, (flat[0] * right + flat[1] * up) / unit, edge, canvas)
    with tempfile.TemporaryDirectory(prefix="evp_view_") as folder:
        folder = pathlib.Path(folder)
        (folder / "spheres.data").write_text(_data((x - origin) / unit, radius / unit, value, edge), encoding="ascii")
        (folder / "in.view").write_text(f"units lj\natom_style sphere\nboundary f f f\nread_data spheres.data\n{view}", encoding="ascii")
        command = [*run.lammps_command(), "-log", "none", "-nocite", "-in", "in.view"]
        drawing = run.ended(command, folder)
        if drawing.returncode:
            raise run.RunError(f"LAMMPS could not draw the spheres: {_reason(run.lammps_error(drawing.stdout), command[0])}")
        picture = np.asarray(Image.open(folder / "view.ppm"))
    top, left = (canvas - camera.height) // 2, (canvas - camera.width) // 2
    return picture[top : top + camera.height, left : left + camera.width]


def _slabs(x, radius, camera):
    """Masks of the spheres, the farthest first, of no more depth each than LAMMPS' camera has in front of it."""
    depth = x @ axes(camera.theta, camera.phi)[2]
    room = _DEEP * camera.per_pixel * max(camera.width, camera.height) - 2.0 * radius.max()
    number = np.floor((depth - depth.min()) / room)
    return [number == k for k in np.unique(number)]


def draw(x, radius, value, colors, views):
    """Pictures of the spheres, (height, width, 3) bytes for each Camera of views.

    x (N, 3), radius (N,) [length]; value (N,) from 0 to 1 takes its color from colors (SHADES, 3), 0 to 1 each.
    RunError where LAMMPS does not start or fails.
    """
    found = []
    for camera in views:
        picture, *layers = (_draw(x[part], radius[part], value[part], colors, camera) for part in _slabs(x, radius, camera))
        for layer in layers:
            picture = np.where(layer.min(axis=2, keepdims=True) < 255, layer, picture)  # the background is white
        found.append(picture)
    return found
