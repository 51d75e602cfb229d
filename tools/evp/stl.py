# SPDX-License-Identifier: GPL-2.0-only
"""STL files, ASCII and binary, as triangles (T,3,3) in the units of the file."""

import pathlib

import numpy as np

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_DIGITS = 2.0**-24  # relative rounding of the coordinates of a binary file
_ROUNDED = 1e-3  # over the least extent of a part: coarser coordinates are no shape
_HEAD = 84  # bytes before the triangles of a binary file: a title, and their number


def read_stl(path):
    """Triangles (T,3,3) of an STL file, float64. OSError, or ValueError where it is no STL file or holds no triangle.

    A binary file may begin with the word of an ASCII file: its size decides.
    """
    raw = pathlib.Path(path).read_bytes()
    count = int.from_bytes(raw[80:_HEAD], "little")
    is_binary = len(raw) >= _HEAD and len(raw) == _HEAD + count * _RECORD.itemsize
    if is_binary:
        triangles = np.frombuffer(raw, _RECORD, count, _HEAD)["corners"].astype(float)
    elif raw.lstrip()[:5].lower() == b"solid":
        triangles = _read_ascii(path, raw)
    else:
        raise ValueError(f"{path} is no STL file: an ASCII one begins with 'solid', and one in binary with {count} triangles has "
                         f"{_HEAD + count * _RECORD.itemsize} bytes, not {len(raw)}; export the part as STL again")
    if len(triangles) == 0:
        raise ValueError(f"{path} holds no triangle: export the part as STL again")
    if not np.isfinite(triangles).all():
        raise ValueError(f"{path} holds a coordinate that is no finite number: export the part as STL again")
    if is_binary:
        _check_digits(path, triangles)
    return triangles


def _check_digits(path, triangles):
    """ValueError where a part is so far from the origin that the digits of a binary file do not hold its shape."""
    corners = triangles.reshape(-1, 3)
    extents = np.ptp(corners, axis=0)
    far, least = float(np.abs(corners).max()), float(extents.min() or extents.max())  # a sheet is refused elsewhere
    if _DIGITS * far > _ROUNDED * least:
        raise ValueError(f"{path}: the part is {least:.3g} thin and {far:.3g} from the origin of the file, where the 7 digits of binary STL round "
                         f"coordinates to {2 * _DIGITS * far:.2g}: move the part to the origin in the CAD program and export it again")


def _read_ascii(path, raw):
    words = raw.decode("ascii", "replace").lower().split()  # some programs write all in capitals
    at = np.flatnonzero(np.array(words, dtype=object) == "vertex") if words else np.zeros(0, int)
    try:
        numbers = np.array([words[k + 1:k + 4] for k in at], dtype=float)
        return numbers.reshape(-1, 3, 3) if len(at) else np.zeros((0, 3, 3))
    except ValueError:
        raise ValueError(f"{path} is cut short or damaged: its 'vertex' lines are no triangles; export the part as STL again") from None


def write_stl(path, triangles):
    """Writes a binary STL file; normals are those of the corners' order."""
    records = np.zeros(len(triangles), _RECORD)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    records["normal"] = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    records["corners"] = triangles
    pathlib.Path(path).write_bytes(b"EVP".ljust(80) + len(triangles).to_bytes(4, "little") + records.tobytes())


def write_ascii_stl(path, triangles):
    """The same as text."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    with open(path, "w", encoding="ascii") as out:
        out.write("solid EVP\n")
        for normal, corners in zip(normals, triangles):
            out.write("facet normal {:.6g} {:.6g} {:.6g}\n outer loop\n".format(*normal))
            for corner in corners:
                out.write("  vertex {:.8g} {:.8g} {:.8g}\n".format(*corner))
            out.write(" endloop\nendfacet\n")
        out.write("endsolid EVP\n")
