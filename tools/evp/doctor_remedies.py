# SPDX-License-Identifier: GPL-2.0-only
"""The command that mends a fault, with the paths of this machine."""

import os
import pathlib
import re
import shlex
import shutil

from . import doctor_elf as elf
from . import doctor_lammps as lammps
from . import doctor_plugin as plugins

SOURCE = plugins.TOOLS.parent  # of EVP, where this is a checkout


def quoted(*words):
    return " ".join(shlex.quote(str(word)) for word in words)


def in_front(name, folder):
    """export of a list of folders with another in front."""
    return f"export {name}={quoted(folder)}" + "${" + name + ":+:$" + name + "}"


def cache_entry(folder, name):
    """Entry of the CMakeCache.txt of a folder; empty where there is none."""
    try:
        text = (pathlib.Path(folder) / "CMakeCache.txt").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    found = re.search(rf"^{name}:\w+=(.+)$", text, re.M)
    return found[1] if found else ""


def own_source():
    return SOURCE if (SOURCE / "CMakeLists.txt").exists() else pathlib.Path("/path/to/evp")


def lammps_options(exe):
    """What EVP's CMake needs to know of the LAMMPS of this program: its build, its installation, or placeholders."""
    home = cache_entry(exe.parent, "CMAKE_HOME_DIRECTORY") if exe else ""
    if home:
        return [f"-DLAMMPS_SOURCE_DIR={pathlib.Path(home).parent}", f"-DLAMMPS_BUILD_DIR={exe.parent}"]
    prefix = exe.parent.parent if exe else pathlib.Path("/path/to/lammps")
    if any(prefix.glob("lib*/cmake/LAMMPS/LAMMPSConfig.cmake")) or any(prefix.glob("lib/*/cmake/LAMMPS/LAMMPSConfig.cmake")):
        return [f"-DCMAKE_PREFIX_PATH={prefix}"]
    return ["-DLAMMPS_SOURCE_DIR=/path/to/its/source", "-DLAMMPS_BUILD_DIR=/path/to/its/build"]


def rebuild(plugin, exe, host):
    """Builds the plugin for that LAMMPS: in its own folder where that was made for it, else in a new one."""
    options, source = lammps_options(exe), own_source()
    folder = plugin.parent if plugin else source / "build"
    if cache_entry(folder, "CMAKE_HOME_DIRECTORY") == str(source) and f"-DLAMMPS_BUILD_DIR={cache_entry(folder, 'LAMMPS_BUILD_DIR')}" in options:
        return f"cmake -S {quoted(source)} -B {quoted(folder)} && cmake --build {quoted(folder)} --clean-first --target evpplugin"
    kind = lammps.mpi_kind(host.mpi).replace(" ", "").lower().replace("none", "serial")
    folder = source / f"build-{lammps.release_name(host.number).replace(' ', '')}-{host.integers}-{kind}"
    return (f"cmake -S {quoted(source)} -B {quoted(folder)} -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=off {quoted(*options)} && "
            f"cmake --build {quoted(folder)} --target evpplugin && export LAMMPS_PLUGIN_PATH={quoted(folder)}")


def with_option(exe, option):
    """Builds the LAMMPS of this program again with an option of its CMake switched on."""
    build = exe.parent if exe and cache_entry(exe.parent, "CMAKE_HOME_DIRECTORY") else "/path/to/the/build/of/LAMMPS"
    return f"cmake -D{option}=on {quoted(build)} && cmake --build {quoted(build)}"


def fits(plugin, host):
    """Is that file whole, and built for the LAMMPS of this Help?"""
    try:
        facts = plugins.read_facts(plugin)
        return elf.read(plugin).machine == elf.own_machine() and facts is not None and not facts.differences(host)
    except (OSError, ValueError):
        return False


def _same(first, second):
    """Is it one file? Also where a link leads to itself, which has no Path.resolve()."""
    return os.path.realpath(first) == os.path.realpath(second)


def another_plugin(wrong, host, exe):
    """Folder of an EVP plugin that this LAMMPS loads, or None."""
    for plugin in plugins.own_plugins():
        if (not wrong or not _same(plugin, wrong)) and fits(plugin, host) and lammps.try_deck(exe, plugin, apart=True).knows():
            return plugin.parent
    return None


def mend_plugin(wrong, host, exe):
    """Another plugin that fits where there is one, else a new build."""
    folder = another_plugin(wrong, host, exe) if exe else None
    return f"export LAMMPS_PLUGIN_PATH={quoted(folder)}" if folder else rebuild(wrong, exe, host)


def get_lammps():
    """Where no LAMMPS here will do."""
    return quoted(SOURCE / "tools" / "setup.sh") if (SOURCE / "tools" / "setup.sh").exists() else "tools/setup.sh   # in EVP's source folder"


def another_lmp(wrong, found_by):
    """Command that takes another lmp of this machine that can load plugins, or builds one."""
    for path in [*lammps.programs("lmp"), *plugins.own_lmps()]:
        if not _same(path, wrong):
            found, _ = lammps.ask_help(path)
            if found and not found.lacks():
                return f"export EVP_LMP={quoted(path)}" if found_by == "EVP_LMP" else in_front("PATH", path.parent)
    return get_lammps()


def apt(*packages):
    """Installs packages of Debian."""
    return " ".join([*(["sudo"] if os.geteuid() else []), "apt-get install", *packages])


def another_mpirun(kind):
    """Command that takes the mpirun of that MPI."""
    chosen = os.environ.get("EVP_MPIRUN", "mpirun").split()[:1] != ["mpirun"]  # PATH does not count then
    names = ("mpirun", "mpirun.openmpi", "mpiexec.openmpi", "mpirun.mpich", "mpiexec.hydra", "mpiexec")
    for name in names:
        for path in lammps.programs(name):
            if lammps.mpi_kind(lammps.run([path, "--version"]).text) == kind:
                return in_front("PATH", path.parent) if name == "mpirun" and not chosen else f"export EVP_MPIRUN={quoted(path)}"
    package = {"Open MPI": "openmpi-bin", "MPICH": "mpich"}.get(kind)
    return apt(package) if package and shutil.which("apt-get") else f"export EVP_MPIRUN=/path/to/mpirun   # of {kind}"
