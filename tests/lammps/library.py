# SPDX-License-Identifier: GPL-2.0-only
"""LAMMPS as a library: a program that catches errors, mends what was wrong and goes on, in a process of its own."""

import os
import re
import subprocess
import sys

from lammps_run import _ENVIRONMENT, LMP, MPIRUN, SECONDS, Run

SHOWN = 99  # characters of a message that LAMMPS' Python module hands on

PRELUDE = """
import ctypes, os
lammps = ctypes.CDLL({library!r}, mode=ctypes.RTLD_GLOBAL)
lammps.lammps_open_no_mpi.restype = ctypes.c_void_p
lammps.lammps_close.restype = None
lammps.lammps_extract_fix.restype = ctypes.POINTER(ctypes.c_double)
words = [b"lammps", b"-log", b"none", b"-screen", b"none"]
handle = ctypes.c_void_p(lammps.lammps_open_no_mpi(len(words), (ctypes.c_char_p * len(words))(*words), None))
first_rank = lammps.lammps_extract_setting(handle, b"world_rank") == 0

def say(*values):
    if first_rank:
        print(*values, flush=True)

def tell(*commands):
    '''The message of the first of these commands (or lines of them) that fails, "ok" without.'''
    for command in "\\n".join(commands).splitlines():
        lammps.lammps_command(handle, command.encode())
        if lammps.lammps_has_error(handle):
            text = ctypes.create_string_buffer(3000)
            lammps.lammps_get_last_error_message(handle, text, len(text))
            return " ".join(text.value.decode().split())
    return "ok"

def bonds():
    '''f_bonds'''
    return lammps.lammps_extract_fix(handle, b"bonds", 0, 0, 0, 0)[0]

def write(name, text):
    '''A file of the first rank.'''
    if first_rank:
        with open(name, "w", encoding="utf-8") as out:
            out.write(text)

def files_open():
    return [os.readlink("/proc/self/fd/" + fd) for fd in os.listdir("/proc/self/fd") if os.path.exists("/proc/self/fd/" + fd)]

tell("plugin load {plugin}")
"""

END = """
lammps.lammps_close(handle)
lammps.lammps_mpi_finalize()
"""


def of_the_wrapper(name):
    """A folder that build/lmp names."""
    return re.search(rf"{name}=\S*?'(.*)'", LMP.read_text(encoding="utf-8")).group(1)


def run_program(program, folder, ranks=1):
    """What a Python program says that has tell(), bonds(), write() and say() at hand; ranks > 1: by mpirun."""
    libraries = of_the_wrapper("libdir")
    plugins = os.environ.get("EVP_PLUGIN_DIR", of_the_wrapper("plugins"))
    prelude = PRELUDE.format(library=f"{libraries}/liblammps.so.0", plugin=f"{plugins}/evpplugin.so")
    (folder / "program.py").write_text(prelude + program + END, encoding="utf-8")
    environment = {**os.environ, **_ENVIRONMENT, "LD_LIBRARY_PATH": libraries + ":" + os.environ.get("LD_LIBRARY_PATH", "")}
    command = [*MPIRUN, "-np", str(ranks)] if ranks > 1 else []
    done = subprocess.run([*command, sys.executable, "program.py"], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SECONDS, check=False)
    return Run(done.returncode, done.stdout, folder).ok()
