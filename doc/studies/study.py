# SPDX-License-Identifier: GPL-2.0-only
"""What the studies share. Imported first: it makes the package evp of tools/ importable."""

import pathlib
import sys

sys.path.insert(1, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
