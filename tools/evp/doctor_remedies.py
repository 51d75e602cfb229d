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

PLACEHOLDER = "/path/to/lammps"  # of the source tree of an installed LAMMPS


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
    return plugins.came_from()[0] or pathlib.Path("/path/to/evp")


def lammps_options(exe):
    """What EVP's CMake needs to know of the LAMMPS of this program: its build, its installation, or placeholders."""
    home = cache_entry(exe.parent, "CMAKE_HOME_DIRECTORY") if exe else ""
    if home:
        return [f"-DLAMMPS_SOURCE_DIR={pathlib.Path(home).parent}", f"-DLAMMPS_BUILD_DIR={exe.parent}"]
    prefix = exe.parent.parent if exe else pathlib.Path("/path/to/lammps")
    if any(prefix.glob("lib*/cmake/LAMMPS/LAMMPSConfig.cmake")) or any(prefix.glob("lib/*/cmake/LAMMPS/LAMMPSConfig.cmake")):
        return [f"-DCMAKE_PREFIX_PATH={prefix}", f"-DLAMMPS_SOURCE_DIR={PLACEHOLDER}"]
    return ["-DLAMMPS_SOURCE_DIR=/path/to/its/source", "-DLAMMPS_BUILD_DIR=/path/to/its/build"]


def rebuild(plugin, exe, host):
    """Builds the plugin for that LAMMPS: in its own folder where that was made for it, else in a new one."""
    options, source = lammps_options(exe), own_source()
    installed_from = plugins.came_from()[1]
    for folder in (plugin.parent if plugin else source / "build", installed_from):
        if folder and cache_entry(folder, "CMAKE_HOME_DIRECTORY") == str(source) and f"-DLAMMPS_BUILD_DIR={cache_entry(folder, 'LAMMPS_BUILD_DIR')}" in options:
            command = f"cmake -S {quoted(source)} -B {quoted(folder)} && cmake --build {quoted(folder)} --clean-first --target evpplugin"
            return f"{command} && {take_plugin(folder)}" if folder == installed_from else command
    kind = lammps.mpi_kind(host.mpi).replace(" ", "").lower().replace("none", "serial")
    folder = source / f"build-{lammps.release_name(host.number).replace(' ', '')}-{host.integers}-{kind}"
    generator = "-G Ninja " if shutil.which("ninja") and not shutil.which("make") else ""
    return (f"cmake -S {quoted(source)} -B {quoted(folder)} {generator}-DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=off {quoted(*options)} && "
            f"cmake --build {quoted(folder)} --target evpplugin && export LAMMPS_PLUGIN_PATH={quoted(folder)}")


def with_option(exe, option):
    """Builds the LAMMPS of this program again with an option of its CMake switched on."""
    build = exe.parent if exe and cache_entry(exe.parent, "CMAKE_HOME_DIRECTORY") else "/path/to/the/build/of/LAMMPS"
    return f"cmake -D{option}=on {quoted(build)} && cmake --build {quoted(build)}"


def fault_for(plugin, host):
    """Why LAMMPS of this Help cannot take that file, as far as the file says; empty where it is whole and built for it."""
    if not plugin:
        return "there is no evpplugin.so"
    try:
        machine = elf.read(plugin).machine
    except (OSError, ValueError) as error:
        return f"{plugin} {error.strerror if isinstance(error, OSError) else error}"
    if machine != elf.own_machine():
        return f"{plugin} was built for {machine}"
    facts = plugins.read_facts(plugin)
    if facts is None:
        return f"{plugin} does not say what it was built for"
    differences = facts.differences(host)
    return f"{plugin} was built for {' and '.join(differences)}" if differences else ""


def fits(plugin, host):
    """Is that file whole, and built for the LAMMPS of this Help?"""
    return not fault_for(plugin, host)


def _same(first, second):
    """Is it one file? Also where a link leads to itself, which has no Path.resolve()."""
    return os.path.realpath(first) == os.path.realpath(second)


def another_plugin(wrong, host, exe):
    """Folder of an EVP plugin that this LAMMPS loads, or None."""
    for plugin in plugins.own_plugins():
        if (not wrong or not _same(plugin, wrong)) and fits(plugin, host) and lammps.try_deck(exe, plugin, apart=True).knows():
            return plugin.parent
    return None


def take_plugin(folder):
    """Command by which LAMMPS loads the plugin of that folder: installs it first, where it is that of the build that these tools came from."""
    source, build = plugins.came_from()
    prefix = plugins.installed_prefix()
    if not prefix or folder != build or cache_entry(build, "CMAKE_HOME_DIRECTORY") != str(source):
        return f"export LAMMPS_PLUGIN_PATH={quoted(folder)}"
    target = prefix / (cache_entry(build, "EVP_PLUGIN_FOLDER") or "lib/lammps/plugins")
    named = os.environ.get("LAMMPS_PLUGIN_PATH", "")
    command = f"cmake --install {quoted(build)} --prefix {quoted(prefix)}"
    return command if named and _same(named, target) else f"{command} && export LAMMPS_PLUGIN_PATH={quoted(target)}"


def take_lmp(path, found_by):
    """Command by which that lmp is the one that was found before in this way."""
    return f"export EVP_LMP={quoted(path)}" if found_by == "EVP_LMP" else in_front("PATH", path.parent)


def lmp_of(plugin, wrong):
    """The lmp of this machine that this plugin was built for, or None."""
    for path in [*lammps.programs("lmp"), *plugins.own_lmps()]:
        found = None if _same(path, wrong) else lammps.ask_help(path)[0]
        if found and not found.lacks() and fits(plugin, found) and lammps.try_deck(path, plugin).knows():
            return path
    return None


def mend_plugin(wrong, host):
    """The cheapest first: another plugin that fits, the lmp that this one was built for (unless the user named an lmp), a new build."""
    folder = another_plugin(wrong, host.help, host.exe) if host.exe else None
    if folder:
        return take_plugin(folder)
    path = lmp_of(wrong, host.path) if wrong and host.found_by in ("PATH", "EVP_LMP") and not fits(wrong, host.help) else None
    return take_lmp(path, host.found_by) if path else rebuild(wrong, host.exe, host.help)


def meaning(command):
    """A sentence for what a command leaves to the user; empty where it leaves nothing."""
    if f"={PLACEHOLDER}" not in command:
        return ""
    return (f" {PLACEHOLDER} stands for the unpacked source tree of the same LAMMPS release, which need not be built: an installed LAMMPS has too few "
            "headers to build a plugin.")


def get_lammps():
    """Where no LAMMPS here will do."""
    source = plugins.came_from()[0]
    return quoted(source / "tools" / "setup.sh") if source and (source / "tools" / "setup.sh").exists() else "tools/setup.sh   # in EVP's source folder"


def another_lmp(wrong, found_by):
    """Command that takes another lmp of this machine that can load plugins, that of EVP's own plugin first, or builds one."""
    able = []
    for path in [*lammps.programs("lmp"), *plugins.own_lmps()]:
        found = None if _same(path, wrong) else lammps.ask_help(path)[0]
        if found and not found.lacks():
            able.append((path, found))
    own = plugins.own_plugins()
    able.sort(key=lambda entry: not any(fits(plugin, entry[1]) for plugin in own))
    return take_lmp(able[0][0], found_by) if able else get_lammps()


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
