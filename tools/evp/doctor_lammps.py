# SPDX-License-Identifier: GPL-2.0-only
"""What an lmp is: by its own help, and by one run that says which files and folders it took."""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
from dataclasses import dataclass, field

OLDEST = 20250204  # as in cmake/EvpHost.cmake
_MONTHS = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()
_SECONDS = 60  # a run here takes less than one: only a hang gets there
KNOWN = "evp doctor: evp/lj is known"

# The shell that LAMMPS starts is its child: in every release it shows what the program behind a wrapper script has loaded.
_LOOK = 'shell """cat /proc/$PPID/maps >maps; cat /proc/$PPID/environ >environ; readlink /proc/$PPID/exe >exe"""\n'
_BOX = "units si\natom_style sphere\natom_modify map yes\nregion box block 0 1 0 1 0 1\ncreate_box 1 box\n"


def release_number(text):
    """20250204 of '4 Feb 2025'; 0 where it is no date."""
    found = re.match(r"(\d+) ?([A-Z][a-z]{2})[a-z]* ?(\d{4})", text)
    return int(found[3]) * 10000 + (_MONTHS.index(found[2]) + 1) * 100 + int(found[1]) if found and found[2] in _MONTHS else 0


def release_name(number):
    """'4 Feb 2025' of 20250204; the number where it is no date."""
    month = number // 100 % 100
    return f"{number % 100} {_MONTHS[month - 1]} {number // 10000}" if 1 <= month <= 12 else str(number)


def mpi_kind(text):
    """'Open MPI', 'MPICH' (and what is built on it), 'none', or 'unknown', of the text by which an MPI names itself."""
    for kind, mark in (("none", r"STUBS|^none"), ("Open MPI", r"Open ?MPI|OpenRTE|PRRTE"), ("MPICH", r"MPICH|HYDRA|Intel\(R\) MPI|MVAPICH")):
        if re.search(mark, text, re.I):
            return kind
    return "unknown"


@dataclass(frozen=True)
class Help:
    """What `lmp -h` says."""

    release: str  # as printed, with 'Update 2' or 'Development'
    number: int  # yyyymmdd
    integers: str
    mpi: str
    compiler: str
    packages: tuple

    def lacks(self):
        """Why it cannot take the plugin of any build; empty if it can."""
        if self.number < OLDEST:
            return f"it is LAMMPS {self.release}, and EVP needs {release_name(OLDEST)} or later"
        return "" if "PLUGIN" in self.packages else "it was built without the PLUGIN package"

    def words(self):
        return f"LAMMPS {self.release}, {self.integers}, {self.mpi if self.mpi != 'none' else 'no MPI'}, {self.compiler}"


def parse_help(text):
    """Help of the output of `lmp -h`; None where it is not that of LAMMPS."""
    banner = re.search(r"Massively Parallel Simulator - (.+)", text)
    if not banner:
        return None
    mpi = re.search(r"^MPI v[\d.]+: *(.+)", text, re.M)
    mpi = mpi[1] if mpi else "unknown"
    version = re.search(r"\d+(\.\d+)+", mpi)
    kind = mpi_kind(mpi)
    if kind != "none" and version:
        kind += " " + version[0]
    compiler = re.search(r"^Compiler: *(.+?)(?: with .*)?$", text, re.M)
    packages = re.search(r"^Installed packages:\s*\n((?:.*\S.*\n)*)", text, re.M)
    wide = re.search(r"LAMMPS_BIGBIG|sizeof\(tagint\): +64", text)
    return Help(banner[1].strip(), release_number(banner[1]), "bigbig" if wide else "smallbig", kind,
                compiler[1] if compiler else "compiler unknown", tuple(packages[1].split()) if packages else ())


@dataclass
class Output:
    """Of a process: its status (negative: signal; None: no end), stdout and stderr together."""

    status: object
    text: str


def run(words, environment=None, folder=None):
    """Output of a program that is given nothing to read."""
    try:
        # apart from our own processes: what a wrapper script or mpirun has started ends with it
        process = subprocess.Popen([str(word) for word in words], env=environment, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", start_new_session=True)
    except OSError as error:
        return Output(127, f"{words[0]}: {error.strerror}")
    with process:
        try:
            text = process.communicate(timeout=_SECONDS)[0]
        except subprocess.TimeoutExpired:
            text = None
        finally:
            if process.returncode is None:
                os.killpg(process.pid, signal.SIGKILL)
    return Output(None, f"no answer within {_SECONDS} s") if text is None else Output(process.returncode, text)


def ask_help(lmp):
    """(Help or None, Output) of an lmp."""
    output = run([lmp, "-h"])
    return parse_help(output.text), output


def programs(name):
    """All programs of this name on PATH, in its order."""
    folders = dict.fromkeys(os.environ.get("PATH", os.defpath).split(os.pathsep))
    found = [shutil.which(name, path=folder) for folder in folders if folder]
    return [pathlib.Path(path) for path in found if path]


@dataclass
class Trial:
    """A run of the deck that users' decks begin with, and the process that it was in, where /proc tells."""

    output: Output
    exe: pathlib.Path = None  # the program behind a wrapper script
    libraries: list = field(default_factory=list)  # files that are mapped
    environment: dict = field(default_factory=dict)  # of these names: LAMMPS_PLUGIN_PATH, LD_LIBRARY_PATH

    def knows(self):
        return KNOWN in self.output.text

    def plugins(self):
        """EVP's among the files that it has loaded."""
        return [path for path in self.libraries if path.name.endswith("plugin.so")]


def _looked_at(folder, trial):
    """The files that _LOOK wrote."""
    if not (folder / "exe").exists() or not (folder / "exe").stat().st_size:
        return
    trial.exe = pathlib.Path((folder / "exe").read_text(encoding="utf-8").rstrip("\n"))
    maps = (folder / "maps").read_text(encoding="utf-8", errors="replace")
    found = dict.fromkeys(re.findall(r"^\S+ \S+ \S+ \S+ \d+ +(/.+?)(?: \(deleted\))?$", maps, re.M))
    trial.libraries = [pathlib.Path(path) for path in found if ".so" in path]
    entries = (folder / "environ").read_text(encoding="utf-8", errors="replace").split("\0")
    pairs = dict(entry.split("=", 1) for entry in entries if "=" in entry)
    trial.environment = {name: pairs[name] for name in ("LAMMPS_PLUGIN_PATH", "LD_LIBRARY_PATH") if name in pairs}


def try_deck(lmp, load="", apart=False, launcher=()):
    """Trial of an lmp; load: file of a `plugin load` line; apart: without the plugins of LAMMPS_PLUGIN_PATH, also those of build/lmp;
    launcher: words of an mpirun, for a run that stops at the box."""
    with tempfile.TemporaryDirectory(prefix="evp_doctor_") as folder:
        folder = pathlib.Path(folder)
        look, style = (_LOOK, f'pair_style evp/lj\nprint "{KNOWN}"\n') if not launcher else ("", "")
        lines = f'{look}plugin load "{load}"\n' if load else ""
        (folder / "in.doctor").write_text(f'{lines}{look}{_BOX}{style}', encoding="utf-8")
        environment = dict(os.environ)
        if apart:
            environment.update(LAMMPS_PLUGIN_PATH="", EVP_PLUGIN_DIR="/dev/null")
        trial = Trial(run([*launcher, lmp, "-log", "none", "-in", "in.doctor"], environment, folder))
        _looked_at(folder, trial)
        return trial


def needed_library(exe, elf):
    """The liblammps that an lmp was linked to, where it is found beside it; None where it needs none or has none."""
    name = next((name for name in elf.needed if name.startswith("liblammps")), None)
    places = [pathlib.Path(folder) for folder in elf.folders]
    places += [exe.parent, *sorted(exe.parent.parent.glob("lib*")), *sorted(exe.parent.parent.glob("lib/*-linux-*"))]
    return next((place / name for place in places if name and (place / name).is_file()), None)
