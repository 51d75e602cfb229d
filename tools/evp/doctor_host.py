# SPDX-License-Identifier: GPL-2.0-only
"""Checks of what is there before any plugin: Python, lmp, the library that it loads, mpirun."""

import importlib.util
import os
import pathlib
import platform
import re
import shlex
import shutil
import sys
from dataclasses import dataclass

from . import doctor_elf as elf
from . import doctor_lammps as lammps
from . import doctor_plugin as plugins
from . import doctor_remedies as remedies
from . import interpreter

MODULES = ("numpy", "scipy", "matplotlib")


@dataclass
class Host:
    """An lmp, how it was chosen, and what it says."""

    path: pathlib.Path
    found_by: str
    help: lammps.Help = None
    trial: lammps.Trial = None  # as users start it
    exe: pathlib.Path = None  # the program behind a wrapper script
    libraries: tuple = ()
    sound: bool = False  # it starts, and can load a plugin


def system_words():
    """'Debian GNU/Linux 12 (bookworm), x86_64, Linux 6.1'."""
    try:
        text = pathlib.Path("/etc/os-release").read_text(encoding="utf-8")
        name = re.search(r'^PRETTY_NAME="?(.*?)"?$', text, re.M)[1]
    except (OSError, TypeError):
        name = platform.platform(terse=True)
    return f"{name}, {platform.machine()}, {platform.system()} {'.'.join(platform.release().split('.')[:2])}"


def check_python(report):
    """Is there a Python with the modules of the tools?"""
    own, version = sys.executable, platform.python_version()
    if all(importlib.util.find_spec(name) for name in MODULES):
        report.ok("Python", f"{version} ({own}) with {', '.join(MODULES)}")
        return
    lacking = [name for name in MODULES if importlib.util.find_spec(name) is None]
    other = next((path for path in interpreter.candidates(os.environ) if interpreter.has_modules(path, MODULES)), None)
    if other:
        report.ok("Python", f"{version} ({own}) lacks {', '.join(lacking)}; the tools go on in {other}, which has them")
        return
    words = remedies.quoted(own, "-m", "pip", "install", *lacking)
    if shutil.which("apt-get") and os.path.exists("/usr/bin/python3"):
        words = remedies.apt(*(f"python3-{name}" for name in lacking))
    report.fault("Python", f"{version} ({own}) lacks {', '.join(lacking)}",
                 f"no Python here has the modules {', '.join(lacking)}, which the tools need. LAMMPS and the plugin do without.", words)


def find_lmp(given):
    """Host of --lmp, of EVP_LMP, of PATH, or of EVP's own build; None where there is none."""
    words = [(given, "--lmp")] if given else [(os.environ.get("EVP_LMP"), "EVP_LMP"), ("lmp", "PATH")]
    for word, found_by in words:
        if word and shutil.which(word):
            return Host(pathlib.Path(os.path.abspath(shutil.which(word))), found_by)
        if word and found_by != "PATH":
            return Host(pathlib.Path(word), found_by)
    return next((Host(path, "EVP's own; there is none on PATH") for path in plugins.own_lmps()), None)


def check_lmp(report, host):
    """Does it start, and as which LAMMPS? Fills the host."""
    if host is None:
        report.fault("lmp", "no lmp on PATH, EVP_LMP is not set, and EVP has no build", "there is no LAMMPS here.", remedies.get_lammps())
        return
    where = f"{host.path} ({host.found_by})"
    if not shutil.which(str(host.path)):
        report.fault("lmp", f"{where}: no such program", f"{host.found_by} names {host.path}, which is no program.", _other(host))
        return
    host.help, output = lammps.ask_help(host.path)
    if host.help is None:
        _does_not_start(report, host, output)
        return
    host.trial = lammps.try_deck(host.path)
    seen = host.trial if host.trial.exe else lammps.try_deck(host.path, apart=True)
    host.exe, host.libraries = seen.exe, tuple(seen.libraries)
    behind = f", which starts {host.exe}" if host.exe and host.exe.resolve() != host.path.resolve() else ""
    report.ok("lmp", where + behind)
    if check_library(report, host):
        return
    lacks = host.help.lacks()
    if lacks:
        first = f"the first lmp on PATH is {host.path}" if host.found_by == "PATH" else f"this lmp is {host.path}"
        report.fault("LAMMPS", host.help.words(), f"{first}, and that is the wrong one: {lacks}.", _other(host))
        return
    report.ok("LAMMPS", host.help.words())
    host.sound = True


def _other(host):
    return remedies.another_lmp(host.path, host.found_by)


def _does_not_start(report, host, output):
    """The lines of an lmp that shows no help."""
    text = (output.text.strip().splitlines() or ["no output"])[-1]
    if output.status is not None and output.status < 0:
        text += f" (signal {-output.status})"
    missing = re.search(r"error while loading shared libraries: (\S+):|Library not loaded: (\S+)|symbol lookup error", output.text)
    if missing:
        try:
            right = lammps.needed_library(host.path, elf.read(host.path))
        except (OSError, ValueError):
            right = None
        if right and "liblammps" in (missing[1] or missing[2] or "liblammps"):
            report.fault("lmp", f"{host.path} does not start: {text}",
                         f"{host.path} does not find its own library {right.name}, or finds that of another LAMMPS; its own is {right}.",
                         remedies.in_front("LD_LIBRARY_PATH", right.parent))
            return
    report.fault("lmp", f"{host.path} ({host.found_by}) does not start: {text}", f"{host.path} is no LAMMPS that starts on this machine: {text}.", _other(host))


def check_library(report, host):
    """Is the liblammps that runs the one that lmp was linked to? All releases have one name for it. True where it is not."""
    loaded = next((path for path in host.libraries if path.name.startswith("liblammps")), None)
    if loaded is None:
        report.not_checked("liblammps", "lmp loads none: LAMMPS is linked into it" if host.libraries else "no /proc that shows what lmp loads")
        return False
    try:
        right = lammps.needed_library(host.exe, elf.read(host.exe))
    except (OSError, ValueError):
        right = None
    if right is None or right.resolve() == loaded.resolve():
        report.ok("liblammps", str(loaded))
        return False
    report.fault("liblammps", f"{loaded}, not {right}",
                 f"{host.exe} runs with the library of another LAMMPS: {loaded} ({host.help.release}) in place of {right}. The libraries of all "
                 "releases have one name, and LD_LIBRARY_PATH or the system's folders come first.", remedies.in_front("LD_LIBRARY_PATH", right.parent))
    return True


def check_mpirun(report, host):
    """Do two ranks start as one run?"""
    if not host or not host.sound:
        report.not_checked("mpirun", "first mend the fault above")
        return
    kind = lammps.mpi_kind(host.help.mpi)
    if kind == "none":
        report.not_checked("mpirun", "this lmp has no MPI: it runs on one rank, and mpirun would start copies of the same run")
        return
    chosen = os.environ.get("EVP_MPIRUN", "")
    try:
        words = shlex.split(chosen) or ["mpirun"]
    except ValueError as error:
        report.fault("mpirun", f"EVP_MPIRUN={chosen}: {error}", f"EVP_MPIRUN is no command of a shell: {error}.", "unset EVP_MPIRUN")
        return
    words = words[:-1] if len(words) > 1 and words[-1] in ("-np", "-n") else words
    if not shutil.which(words[0]):
        report.not_checked("mpirun", f"no {words[0]} on PATH: runs have one rank until you run: {remedies.another_mpirun(kind)}")
        return
    asked = lammps.run([words[0], "--version"])
    version = "" if asked.status else asked.text
    own = lammps.mpi_kind(version)
    number = re.search(r"\d+(\.\d+)+", version)
    name = f"{shutil.which(words[0])}: {own if version else 'it'}" + (f" {number[0]}" if number else "")
    output = lammps.try_deck(host.path, apart=True, launcher=[*words, "-np", "2"]).output
    grids = re.findall(r"(\d+) by (\d+) by (\d+) MPI processor grid", output.text)
    ranks = [int(a) * int(b) * int(c) for a, b, c in grids]
    if ranks == [2]:
        report.ok("mpirun", f"{name}, two ranks")
    elif ranks == [1, 1] or (not ranks and own != kind and "unknown" not in (own, kind)):
        report.fault("mpirun", f"{name}; lmp has {host.help.mpi}",
                     f"mpirun is of another MPI ({own}) than lmp ({host.help.mpi}): each rank would be a run of its own.", remedies.another_mpirun(kind))
    elif "attempt to run as root" in output.text:
        text, command = f"{name} refuses to run as root", "export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"
        if chosen:
            report.fault("mpirun", text, "mpirun of Open MPI does not run as root unless told to.", command)
        else:  # runs on one rank do without, and the tools set both
            report.note("mpirun", f"{text}; before runs on several ranks: {command}")
    elif "not enough slots" in output.text:
        report.fault("mpirun", f"{name}: fewer than two cores", "mpirun starts no more ranks than there are cores unless told to.",
                     "export OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe")
    elif output.status is None:
        report.not_checked("mpirun", f"{name}: {output.text}")
    else:
        first = next((line.strip("- ") for line in output.text.splitlines() if line.strip("- ")), f"no output, exit status {output.status}")
        report.fault("mpirun", f"{name} does not start two ranks: {first}", f"mpirun does not start: {first}.",
                     remedies.quoted(*words, "-np", "2", host.path, "-h") if version else remedies.another_mpirun(kind))
