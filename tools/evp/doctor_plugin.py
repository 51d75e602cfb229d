# SPDX-License-Identifier: GPL-2.0-only
"""The plugin as a file: where it may be, what it was built for, why it did not open."""

import os
import pathlib
import re
import stat
from dataclasses import dataclass

from .doctor_lammps import mpi_kind, release_name

TOOLS = pathlib.Path(__file__).resolve().parents[1]
_FACTS = re.compile(rb"EVP plugin facts: ([ -~]+)\0")
_NAME = "evpplugin.so"
RECORD = "installed_from.txt"  # written by cmake/EvpInstall.cmake
_LARGEST = 1 << 30  # bytes


@dataclass(frozen=True)
class Facts:
    """What src/lammps/plugin_facts.h left in the file."""

    version: str
    lammps: int  # yyyymmdd
    integers: str
    mpi: str
    compiler: str

    def words(self):
        mpi = self.mpi if self.mpi != "none" else "no MPI"
        return f"EVP {self.version} for LAMMPS {release_name(self.lammps)}, {self.integers}, {mpi}, compiled by {self.compiler}"

    def differences(self, host):
        """Texts where it was not built for the LAMMPS of this Help: 'another MPI (MPICH 4.0.2, and this lmp has Open MPI 4.1.4)'."""
        found = []
        if self.lammps != host.number:
            found.append(f"another release of LAMMPS ({release_name(self.lammps)}, and this lmp is {release_name(host.number)})")
        kinds = mpi_kind(self.mpi), mpi_kind(host.mpi)
        if "unknown" not in kinds and kinds[0] != kinds[1]:
            found.append("another MPI ({}, and this lmp has {})".format(*("no MPI" if text == "none" else text for text in (self.mpi, host.mpi))))
        if self.integers != host.integers:
            found.append(f"another integer size ({self.integers}, and this lmp has {host.integers})")
        return found


def content(path):
    """Bytes of a plugin file; none of what is larger than any plugin, or no file: a folder, a pipe, a link that leads nowhere, or not yours."""
    try:
        state = path.stat()
        return path.read_bytes() if stat.S_ISREG(state.st_mode) and state.st_size < _LARGEST else b""
    except OSError:
        return b""


def read_facts(path):
    """Facts of a plugin file; None where it has none (an EVP older than the doctor, or another plugin)."""
    found = _FACTS.search(content(path))
    if not found:
        return None
    values = dict(entry.split("=", 1) for entry in found[1].decode("ascii").split(";") if "=" in entry)
    return Facts(values.get("version", "?"), int(values.get("lammps", 0)), values.get("integers", "?"), values.get("mpi", "unknown"),
                 values.get("compiler", "?"))


def path_entries(text):
    """Folders of a LAMMPS_PLUGIN_PATH."""
    return [pathlib.Path(entry) for entry in text.split(os.pathsep) if entry]


def is_evp(path):
    """Is that file EVP's plugin, by name or by what is in it?"""
    return path.name == _NAME or read_facts(path) is not None


def plugins_in(folder):
    """EVP's plugins among the files that LAMMPS would load from a folder of LAMMPS_PLUGIN_PATH."""
    return [path for path in sorted(folder.glob("*plugin.so")) if is_evp(path)] if folder.is_dir() else []


def fault_of_entry(folder):
    """What is wrong with a folder of LAMMPS_PLUGIN_PATH; empty where LAMMPS finds EVP's plugin there."""
    if folder.is_file():
        return f"{folder} is a file, and must be the folder that holds it"
    if not folder.exists():
        return f"{folder} does not exist"
    if not any(folder.glob("*plugin.so")):
        return f"{folder} holds no file that ends in plugin.so"
    return "" if plugins_in(folder) else f"{folder} holds other plugins only"


def installed_prefix():
    """Of the installation that these tools are part of; None in a source tree."""
    root = TOOLS.parent
    return root.parent.parent if root.parent.name == "share" and not (root / "CMakeLists.txt").exists() else None


def came_from():
    """(source tree, build folder) of these tools; None for what does not exist, or no longer belongs to the other."""
    root = TOOLS.parent
    if (root / "CMakeLists.txt").exists():
        return root, None
    try:
        lines = (root / RECORD).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return None, None
    paths = dict(line.split("=", 1) for line in lines if "=" in line)
    source, build = pathlib.Path(paths.get("source", "")), pathlib.Path(paths.get("build", ""))
    if not (source.is_absolute() and (source / "cmake" / "EvpInstall.cmake").is_file()):
        return None, None
    return source, build if build.is_absolute() and (build / "cmake_install.cmake").is_file() else None


def own_folders():
    """Where the plugin of these tools may be: of the command evp, of the installation that they are part of, of their source tree's builds."""
    places = [pathlib.Path(os.path.abspath(os.environ[name])) for name in ("EVP_PLUGINS", "EVP_BUILD") if os.environ.get(name)]
    prefix, (source, build) = installed_prefix(), came_from()
    if prefix:
        places += [folder / "lammps" / "plugins" for folder in (prefix / "lib", prefix / "lib64", *sorted(prefix.glob("lib/*-linux-*")))]
    if build:
        places.append(build)
    if source:
        places += [source / "build", *sorted(path.parent for path in source.glob(f"*/{_NAME}"))]
    return list(dict.fromkeys(places))


def own_plugins():
    """EVP's plugins that belong to these tools."""
    return [place / _NAME for place in own_folders() if (place / _NAME).is_file()]


def own_lmps():
    """EVP's scripts that start LAMMPS with the plugin loaded."""
    prefix = installed_prefix()
    places = [*([prefix / "libexec" / "evp"] if prefix else []), *own_folders()]
    return [place / "lmp" for place in places if os.access(place / "lmp", os.X_OK)]


def as_the_shell_has_it(environment):
    """Takes out what the command evp has put there: its own lmp and plugin would hide those that the user's shell takes."""
    if not environment.get("EVP_COMMAND"):
        return
    lmp, own = environment.get("EVP_LMP", ""), environment.get("EVP_PLUGINS", "")
    if lmp and any(os.path.exists(lmp) and path.samefile(lmp) for path in own_lmps()):
        del environment["EVP_LMP"]
        return
    entries = environment.get("LAMMPS_PLUGIN_PATH", "").split(os.pathsep)
    if own and entries[-1] == own:
        environment["LAMMPS_PLUGIN_PATH"] = os.pathsep.join(entries[:-1])


# What dlopen says, and what it means: (pattern, kind).
_REASONS = (
    (r"file too short|cannot read file data|is not whole", "damaged"),
    (r"invalid ELF header|file format not recognized|not a mach-o", "no library"),
    (r"wrong ELF class|incompatible architecture|cannot open shared object file: Exec format", "machine"),
    (r"version `(?:GLIBCXX|GLIBC|CXXABI)[^']*' not found", "runtime"),
    (r"undefined symbol: (?:P?MPI_|ompi_|_ZN3MPI)", "MPI symbol"),
    (r"undefined symbol", "symbol"),
    (r"Permission denied", "permission"),
    (r"No such file or directory", "absent"),
)


def kind_of_failure(text):
    """What kind of failure the text of dlopen tells; 'other' where none is known."""
    return next((kind for pattern, kind in _REASONS if re.search(pattern, text)), "other")


def open_failures(text):
    """[(file, what dlopen said)] of LAMMPS' output or log."""
    return re.findall(r"^Open of file (.+?) failed: (.+)$", text, re.M)


def refusal(text):
    """What the plugin itself said of a LAMMPS that it was not built for; empty where it did not."""
    found = re.search(r"evpplugin\.so was built for another LAMMPS: (.+?)\. Rebuild", text, re.S)
    return found[1] if found else ""
