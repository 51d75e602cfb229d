# SPDX-License-Identifier: GPL-2.0-only
"""What the project's tools share: the law written a second time, brute-force sums, curves.

The modules import one way: law <- brute <- network; specimen and curves stand alone. Programs import
this package before numpy: it takes them to a Python that has it.
"""

from .interpreter import require

__version__ = "1.0.0"  # the only place: CMake, the plugin and `evp --version` read it here

require("numpy", "scipy", "matplotlib")
