# SPDX-License-Identifier: GPL-2.0-only
"""What the project's tools share: the law written a second time, brute-force sums, curves.

The modules import one way: law <- brute <- network; specimen and curves stand alone.
"""

import importlib.util
import sys

_missing = [name for name in ("numpy", "scipy", "matplotlib") if importlib.util.find_spec(name) is None]
if _missing:
    sys.exit(f"error: {sys.executable} has no {', '.join(_missing)}: install it for this interpreter, or use another one (Debian's: /usr/bin/python3)")
