# SPDX-License-Identifier: GPL-2.0-only
"""From the snapshots of dumps to spheres that can be drawn: places, radii, the column that colors them, what is cut away; and to files for ParaView,
VTK XML unstructured grids of points (.vtu) and a collection of them in time (.pvd)."""

import base64
import re
import sys
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from . import dump

_PLACES = (("x", "y", "z"), ("xu", "yu", "zu"))
_CUT = re.compile(r"\s*([^<>=\s]+)\s*([<>])\s*(\S+)\s*")
_TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}
_VERTEX = 1  # VTK's number of the cell that is a point


def condition(text):
    """Function that gives the mask of a text such as 'y>0.01', in the units of the dump, for a table of columns; ValueError where it is none."""
    found = _CUT.fullmatch(text)
    try:
        name, above, limit = found[1], found[2] == ">", float(found[3])
    except (TypeError, ValueError) as error:
        raise ValueError(f"--cut '{text}' is no condition: give COLUMN>NUMBER or COLUMN<NUMBER, such as \"y>0\"") from error

    def holds(table, where):
        dump.need(table, [name], where)
        return table[name] > limit if above else table[name] < limit

    return holds


class Spheres(NamedTuple):
    """x (N, 3) and radius (N,) [length], values (N,) [unit of the dump] of the column that colors them or None."""

    x: np.ndarray
    radius: np.ndarray
    values: np.ndarray


def read_table(snapshot):
    """{name: (N,) array} of a snapshot, with a radius. ValueError where it has none or a place is not finite."""
    table = snapshot.read()
    if snapshot.count == 0:
        raise ValueError(f"{snapshot} has no atoms")
    if "diameter" in table:
        table.setdefault("radius", 0.5 * table["diameter"])
    if "radius" not in table:
        raise ValueError(f"{snapshot} has no column radius; it has {' '.join(table)}: add radius to the dump command")
    x = places(table, snapshot)
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(table["radius"]))):
        raise ValueError(f"{snapshot} has a position or radius that is not finite: the run was unstable")
    if np.any(table["radius"] <= 0.0):
        raise ValueError(f"{snapshot} has a radius that is not positive: {table['radius'].min():g}")
    return table


def places(table, where):
    """(N, 3) from x y z or xu yu zu."""
    names = next((names for names in _PLACES if all(name in table for name in names)), None)
    if names is None:
        dump.need(table, _PLACES[0], where)
    return np.stack([table[name] for name in names], axis=1)


def spheres_of(snapshot, color=None, cuts=()):
    """Spheres of a snapshot. cuts: groups of condition(); those for which all of a group hold are left out.

    ValueError where a column is missing or not finite, or nothing is left.
    """
    table = read_table(snapshot)
    if color:
        dump.need(table, [color], snapshot)
        if not np.all(np.isfinite(table[color])):
            raise ValueError(f"{snapshot}: column {color} has values that are not finite")
    kept = np.ones(snapshot.count, dtype=bool)
    for group in cuts:
        kept &= ~np.logical_and.reduce([one(table, snapshot) for one in group])
    if not kept.any():
        raise ValueError(f"{snapshot}: --cut leaves no sphere")
    return Spheres(places(table, snapshot)[kept], table["radius"][kept], table[color][kept] if color else None)


def evenly(items, count):
    """`count` of the items, evenly spaced, the first and the last among them; all where there are no more. One: the last."""
    if count >= len(items):
        return list(items)
    return [items[k] for k in np.unique(np.round(np.linspace(len(items) - 1, 0, count)).astype(int))]


def _array(name, values):
    """A DataArray: its bytes with their count in front, in base64."""
    values = np.ascontiguousarray(values)
    content = np.uint64(values.nbytes).tobytes() + values.tobytes()
    parts = f" NumberOfComponents=\"{values.shape[1]}\"" if values.ndim == 2 else ""
    return (f"<DataArray type=\"{_TYPES[str(values.dtype)]}\" Name={quoteattr(name)}{parts} format=\"binary\">"
            f"{base64.b64encode(content).decode('ascii')}</DataArray>\n")


def write_points(path, x, columns):
    """A .vtu of the points x (N, 3) with all columns, (N,) each, as arrays: 64 bits, so that no digit is lost; named as ParaView's filters take it,
    c_stress_1 of c_stress[1]."""
    n = len(x)
    whole = {name: name in ("id", "type", "mol") and np.all(values == np.round(values)) for name, values in columns.items()}
    arrays = {name: values.astype(np.int64) if whole[name] else values for name, values in columns.items()}
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    text = [
        f"<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{order}\" header_type=\"UInt64\">\n",
        f"<UnstructuredGrid>\n<Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{n}\">\n<PointData>\n",
        *(_array(re.sub(r"\[(\d+)\]", r"_\1", name), values) for name, values in arrays.items()),
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
