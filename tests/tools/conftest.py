# SPDX-License-Identifier: GPL-2.0-only
"""Makes the package tools/evp importable from the checkout that holds these tests."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
