# SPDX-License-Identifier: GPL-2.0-only
"""Files that the tools read, as the decks write them, with contents of the tests' own; stand-ins for programs; what a build was
configured for; tools called in the process of the tests."""

import contextlib
import io
import os
import pathlib
import re
from subprocess import CompletedProcess

from evp import curves, run, surface

BUILD = pathlib.Path(os.environ.get("EVP_LMP") or run.CHECKOUT / "build" / "lmp").absolute().parent


def cache_entry(name, folder=BUILD):
    return re.search(rf"^{name}:\w+=(.*)$", (pathlib.Path(folder) / "CMakeCache.txt").read_text(encoding="utf-8"), re.M)[1]


def program(path, text, shell="#!/bin/sh"):
    """An executable script."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{shell}\n{text}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


mesh_of = surface.mesh_of


def write_mesh(path, mesh):
    surface.open3d_module().io.write_triangle_mesh(str(path), mesh.compute_triangle_normals())


def curve_file(path, curve, columns=curves.HEADER, **more):
    """A CSV of a curves.Curve, or of other columns in the order of their names; more: columns after them."""
    rows = zip(*curve, *more.values())
    lines = [",".join((*columns, *more)), *(",".join(f"{value:.17g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def snapshot(names, rows, step=0, head=""):
    """Text of a snapshot of a dump."""
    lines = [*head.splitlines(), "ITEM: TIMESTEP", str(step), "ITEM: NUMBER OF ATOMS", str(len(rows)), "ITEM: BOX BOUNDS ss ss ss", *3 * ["-1 1"],
             f"ITEM: ATOMS {names}", *(" ".join(f"{value:.9g}" for value in row) for row in rows)]
    return "\n".join(lines) + "\n"


def call(main, *words):
    """What a process with this main() would leave: a start takes a second, and test_interpreter.py starts each by its name."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main([str(word) for word in words])
        except SystemExit as stop:
            code = stop.code
    if isinstance(code, str):
        code = err.write(code + "\n") and 1
    return CompletedProcess(words, code or 0, out.getvalue(), err.getvalue())
