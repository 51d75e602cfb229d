# SPDX-License-Identifier: GPL-2.0-only
"""What the project's tools share. Programs import this package before numpy: it takes them to a Python that has it."""

from .interpreter import require

__version__ = "1.0.0"  # the only place: CMake, the plugin and `evp --version` read it here

require("numpy", "scipy", "matplotlib")
