# SPDX-License-Identifier: GPL-2.0-only
"""Writes snapshots for ParaView: VTK XML unstructured grids of points (.vtu), and a collection of them in time (.pvd)."""

import base64
import re
import sys
from xml.sax.saxutils import quoteattr

import numpy as np

_TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}
_VERTEX = 1  # VTK's number of the cell that is a point


def _array(name, values):
    """A DataArray: its bytes with their count in front, in base64."""
    values = np.ascontiguousarray(values)
    content = np.uint64(values.nbytes).tobytes() + values.tobytes()
    parts = f" NumberOfComponents=\"{values.shape[1]}\"" if values.ndim == 2 else ""
    return (f"<DataArray type=\"{_TYPES[str(values.dtype)]}\" Name={quoteattr(name)}{parts} format=\"binary\">"
            f"{base64.b64encode(content).decode('ascii')}</DataArray>\n")


def _vectors(columns):
    """Columns with those that are vectors, vx vy vz and fx fy fz, as one array each."""
    found = dict(columns)
    for name, parts in (("velocity", "vx vy vz".split()), ("force", "fx fy fz".split())):
        if all(part in columns for part in parts) and name not in columns:
            found[name] = np.column_stack([columns[part] for part in parts])
    return found


def write_points(path, x, columns):
    """A .vtu of the points x (N, 3) with all columns, (N,) each, as named arrays: 64 bits, so that no digit is lost."""
    n = len(x)
    whole = {name: name in ("id", "type", "mol") and np.all(values == np.round(values)) for name, values in columns.items()}
    arrays = {name: values.astype(np.int64) if whole[name] else values for name, values in columns.items()}
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    text = [
        f"<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\" header_type=\"UInt64\">\n",
        f"<UnstructuredGrid>\n<Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\">\n<PointData>\n",
        *(_array(name, values) for name, values in _vectors(arrays).items()),
        "</PointData>\n<Points>\n", _array("Points", np.asarray(x, dtype=float)), "</Points>\n<Cells>\n",
        _array("connectivity", np.arange(n, dtype=np.int64)), _array("offsets", np.arange(1, n + 1, dtype=np.int64)),
        _array("types", np.full(n, _VERTEX, dtype=np.uint8)), "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    ]
    with open(path, "w", encoding="utf-8") as target:
        target.writelines(text)


def write_series(path, files):
    """A .pvd; files: (time, name of a .vtu beside it)."""
    rows = "".join(f"<DataSet timestep=\"{time!r}\" file={quoteattr(name)}/>\n" for time, name in files)
    with open(path, "w", encoding="utf-8") as target:
        target.write(f"<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n{rows}</Collection>\n</VTKFile>\n")


def array_name(column):
    """A column's name as ParaView's filters take it: c_stress[1] is c_stress_1."""
    return re.sub(r"\[(\d+)\]", r"_\1", column)
