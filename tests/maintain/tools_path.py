# SPDX-License-Identifier: GPL-2.0-only
"""Imported first by the programs of this folder: makes the package evp of tools/, the scenes of doc/studies and the matrix of tests/lammps importable."""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[1:1] = [str(ROOT / path) for path in ("tools", "doc/studies", "tests", "tests/lammps")]
