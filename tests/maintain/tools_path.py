# SPDX-License-Identifier: GPL-2.0-only
"""Imported first by the programs of this folder: makes the package evp of tools/ and the scenes of doc/studies importable."""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[1:1] = [str(ROOT / "tools"), str(ROOT / "doc" / "studies")]
