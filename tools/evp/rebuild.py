# SPDX-License-Identifier: GPL-2.0-only
"""Builds the plugin once more in another folder, for the LAMMPS of the checkout's own build."""

import os
import re

from .run import CHECKOUT, RunError, output_of

CACHE = CHECKOUT / "build" / "CMakeCache.txt"
_SAME = re.compile(r"^(LAMMPS_\w+|CMAKE_BUILD_TYPE|MPI_CXX_COMPILER|CMAKE_CXX_COMPILER):\w+=(.+)$", re.M)


def configure(source, folder, *options):
    """CMake of the sources in `source`, without tests; RunError without a build of the checkout, or where CMake fails."""
    if not CACHE.exists():
        raise RunError(f"no {CACHE}: run tools/setup.sh first")
    same = [f"-D{name}={value}" for name, value in _SAME.findall(CACHE.read_text(encoding="utf-8"))]
    output_of(["cmake", "-S", str(source), "-B", str(folder), "-DBUILD_TESTING=off", *same, *options], CHECKOUT, f"CMake in {folder}")


def build(folder):
    """Compiles the plugin; RunError with the compiler's words."""
    output_of(["cmake", "--build", str(folder), "-j", str(os.cpu_count() or 1), "--target", "evpplugin"], CHECKOUT, f"the build in {folder}")
