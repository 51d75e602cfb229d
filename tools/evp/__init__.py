# SPDX-License-Identifier: GPL-2.0-only
"""What the project's tools share. Programs import this package before numpy: it takes them to a Python that has it.

A tool started by a Python that lacks a module goes on in the first of these that has all: $PYTHON, the
one that set-up found and keeps in build/CMakeCache.txt, /usr/bin/python3.
"""

import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys

__version__ = "1.0.0"  # the only place: CMake, the plugin and `evp --version` read it here
TOOLS = pathlib.Path(__file__).resolve().parents[1]
CACHE = TOOLS.parent / "build" / "CMakeCache.txt"
_PROBE = "import importlib.util as i, sys; sys.exit(any(i.find_spec(m) is None for m in sys.argv[1:]))"
_STARTED_AGAIN = "EVP_STARTED_AGAIN"  # in the environment: the process that has changed its Python


def candidates(environment, cache=CACHE):
    """Absolute paths of Pythons to try, the first one first."""
    words = [environment.get("PYTHON", "")]
    if cache.exists():
        words += re.findall(r"^Python_EXECUTABLE:\w+=(.+)$", cache.read_text(encoding="utf-8"), re.M)
    paths = [shutil.which(word) for word in [*words, "/usr/bin/python3"] if word]
    return list(dict.fromkeys(os.path.abspath(path) for path in paths if path))


def has_modules(python, modules):
    """Does that Python start and find all of them?"""
    try:
        probe = subprocess.run([python, "-c", _PROBE, *modules], stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False, timeout=60)
    except (OSError, subprocess.SubprocessError):
        return False
    return probe.returncode == 0


def require(*modules, remedy=""):
    """Returns where this Python has the modules; else goes on in one that has, or exits with one line."""
    lacking = [name for name in modules if importlib.util.find_spec(name) is None]
    if not lacking:
        return
    lack = f"error: {sys.executable} has no {', '.join(lacking)}"
    if not remedy and (TOOLS / "setup.sh").exists():  # which an installation has not
        remedy = "run tools/setup.sh, which finds or installs a Python that has"
    remedy = remedy or f"install {'them' if len(lacking) > 1 else 'it'} (Debian: apt-get install {' '.join('python3-' + name for name in lacking)})"
    python = next((path for path in candidates(os.environ) if has_modules(path, modules)), None)
    if python is None:
        sys.exit(f"{lack}: {remedy}, or give one: PYTHON=/path/to/python3")
    script = pathlib.Path(sys.argv[0]).resolve()
    if TOOLS.parent not in script.parents or not script.is_file() or os.environ.get(_STARTED_AGAIN) == str(os.getpid()):
        sys.exit(f"{lack}: use {python}")  # a program of the user's, or one that was started again already
    os.environ[_STARTED_AGAIN] = str(os.getpid())
    os.execv(python, [python, *sys.argv])


require("numpy", "scipy", "matplotlib")
