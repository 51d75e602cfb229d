#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Why LAMMPS says 'Unrecognized pair style evp/lj', or does not open the plugin, and the command that mends it.

  doctor.py                            the lmp of EVP_LMP or PATH, the plugin of LAMMPS_PLUGIN_PATH or of EVP's build
  doctor.py --lmp /path/to/lmp         another lmp
  doctor.py --plugin evpplugin.so      this plugin, as decks with `plugin load` take it
  doctor.py --log log.lammps           also reads the log of the run that failed

Asks lmp, ldd and mpirun with decks of a few lines; changes nothing. One line per check (ok, note, FAULT, not checked); at the end the cause and
one command. Exit status: 0 healthy, 1 a fault, 2 wrong use. Paste the output into an issue: beside versions it holds paths only.
"""

import argparse
import filecmp
import importlib.util
import os
import pathlib
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
from typing import NamedTuple

ROOT = pathlib.Path(__file__).resolve().parents[1]
RECORD = ROOT / "installed_from.txt"  # in an installation, by cmake/EvpInstall.cmake
sys.path.append(str(ROOT / "tools" / "evp"))  # not as a package, which asks for numpy: the doctor must speak where there is none

import interpreter  # noqa: E402

OLDEST = 20250204  # as in cmake/EvpHost.cmake
MODULES = ("numpy", "scipy", "matplotlib")
MONTHS = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()
SECONDS = 60  # a run here takes less than one: only a hang gets there
KNOWN = "evp doctor: evp/lj is known"
NAME = "evpplugin.so"
REFUSED = re.compile(r"evpplugin\.so was built for another LAMMPS: (.+?)\. Rebuild", re.S)
UNOPENED = re.compile(r"^Open of file (.+?) failed: (.+)$", re.M)
ALONE = {"LAMMPS_PLUGIN_PATH": "", "EVP_PLUGIN_DIR": "/dev/null"}  # without the plugins that lmp loads by itself
DECK = "atom_style sphere\natom_modify map yes\nregion box block 0 1 0 1 0 1\ncreate_box 1 box\n"
LOOK = 'shell """readlink /proc/$PPID/exe >exe; echo "$LAMMPS_PLUGIN_PATH" >path"""\n'
HEADERS = "-DLAMMPS_SOURCE_DIR=/path/to/lammps"
HINT = " /path/to/lammps stands for the unpacked source tree of the same LAMMPS release: an installed LAMMPS has too few headers to build a plugin."


def quoted(*words):
    return " ".join(shlex.quote(str(word)) for word in words)


def in_front(name, folder):
    """Command that puts a folder in front of a list of folders."""
    return f"export {name}={quoted(folder)}" + "${" + name + ":+:$" + name + "}"


class Report:
    """Prints a line for each check. The first fault is the cause that is named: later ones may follow from it."""

    def __init__(self):
        self.faults, self.left_out = [], []

    def line(self, state, name, text):
        print(f"{state:<11}  {name:<12}  {text}", flush=True)
        if state == "not checked":
            self.left_out.append(name)

    def fault(self, name, text, cause, command):
        self.faults.append((name, cause, command))
        self.line("FAULT", name, text)

    def verdict(self):
        """The last paragraph."""
        if not self.faults:
            return "Healthy: lmp loads the plugin and knows pair_style evp/lj." + (f" Not checked: {', '.join(self.left_out)}." if self.left_out else "")
        (_, cause, command), *others = self.faults
        text = textwrap.fill(f"Cause: {cause}{HINT if HEADERS in command else ''}", 120, break_long_words=False, break_on_hyphens=False)
        further = f"\nThen run evp doctor again; it found more: {', '.join(name for name, _, _ in others)}." if others else ""
        return f"{text}\nRun:   {command}{further}"


def run(words, environment=None, folder=None):
    """(exit status, output) of a program; the status is negative after a signal, None where it did not end."""
    try:
        # in a process group of its own: what a wrapper script or mpirun has started ends with it
        process = subprocess.Popen([str(word) for word in words], env=environment, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", start_new_session=True)
    except OSError as error:
        return 127, f"{words[0]}: {error.strerror}"
    with process:
        try:
            text = process.communicate(timeout=SECONDS)[0]
            return process.returncode, text
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return None, f"no answer within {SECONDS} s"


def programs(*names):
    """All programs of these names on PATH."""
    folders = [folder for folder in dict.fromkeys(os.environ.get("PATH", os.defpath).split(os.pathsep)) if folder]
    return [pathlib.Path(folder, name) for name in names for folder in folders if shutil.which(name, path=folder)]


def release_number(text):
    """20250204 of '4 Feb 2025 - Update 1'; 0 where it is no date."""
    found = re.match(r"(\d+) ?([A-Z][a-z]{2})[a-z]* ?(\d{4})", text)
    return int(found[3]) * 10000 + (MONTHS.index(found[2]) + 1) * 100 + int(found[1]) if found and found[2] in MONTHS else 0


def mpi_kind(text):
    """'Open MPI', 'MPICH' (and what is built on it), 'none' or 'unknown', from the text by which an MPI names itself."""
    kinds = (("none", r"STUBS|^none"), ("Open MPI", r"Open ?MPI|OpenRTE|PRRTE"), ("MPICH", r"MPICH|HYDRA|Intel\(R\) MPI|MVAPICH"))
    return next((kind for kind, mark in kinds if re.search(mark, text, re.I)), "unknown")


def number_in(text):
    return (re.search(r"\d+(\.\d+)+", text) or [""])[0]


class Help(NamedTuple):
    """What `lmp -h` says."""

    release: str
    integers: str
    mpi: str
    compiler: str
    packages: tuple

    def lacks(self):
        """Why it cannot take any plugin of EVP; empty if it can."""
        if release_number(self.release) < OLDEST:
            return f"it is LAMMPS {self.release}, and EVP needs 4 Feb 2025 or later"
        return "" if "PLUGIN" in self.packages else "it was built without the PLUGIN package"

    def words(self):
        return f"LAMMPS {self.release}, {self.integers}, {self.mpi if self.mpi != 'none' else 'no MPI'}, {self.compiler}"


def parse_help(text):
    """Help of the output of `lmp -h`; None where it is not that of LAMMPS."""

    def found(pattern, default="unknown"):
        return (re.search(pattern, text, re.M) or ["", default])[1].strip()

    release, mpi = found(r"Massively Parallel Simulator - (.+)", ""), found(r"^MPI v[\d.]+: *(.+)")
    integers = "bigbig" if re.search(r"LAMMPS_BIGBIG|sizeof\(tagint\): +64", text) else "smallbig"
    kind = mpi_kind(mpi)
    packages = found(r"^Installed packages:\s*\n((?:.*\S.*\n)*)", "").split()
    return Help(release, integers, kind if kind == "none" else f"{kind} {number_in(mpi)}".strip(), found(r"^Compiler: *(.+?)(?: with .*)?$"), tuple(packages)) if release else None


class Trial(NamedTuple):
    """A run of the deck that users' decks begin with. exe: the program behind a wrapper script; plugin_path: as it has it."""

    status: object
    text: str
    exe: object = None
    plugin_path: str = ""

    def knows(self):
        return KNOWN in self.text


def try_deck(lmp, plugin="", alone=False):
    """Trial of an lmp. plugin: of a `plugin load` line; alone: without the plugins of LAMMPS_PLUGIN_PATH."""
    load = f'plugin load "{plugin}"\n' if plugin else ""
    with tempfile.TemporaryDirectory(prefix="evp_doctor_") as name:
        folder = pathlib.Path(name)
        (folder / "in.doctor").write_text(f'{LOOK}{load}{DECK}pair_style evp/lj\nprint "{KNOWN}"\n', encoding="utf-8")
        status, text = run([lmp, "-log", "none", "-in", "in.doctor"], {**os.environ, **(ALONE if alone else {})}, folder)
        exe, path = ((folder / file).read_text(encoding="utf-8").strip() if (folder / file).exists() else "" for file in ("exe", "path"))
    return Trial(status, text, pathlib.Path(exe) if exe else None, path)


class Host(NamedTuple):
    """An lmp that can take plugins."""

    path: pathlib.Path
    found_by: str
    help: Help
    trial: Trial  # as the user's shell starts it
    exe: pathlib.Path


def facts_of(path):
    """What a plugin file says of itself, src/lammps/plugin_facts.h: 'version 1.0.0, lammps 20250204, ...'; empty where it says nothing."""
    try:
        found = re.search(rb"EVP plugin facts: ([ -~]+)\0", path.read_bytes())
    except OSError:
        return ""
    return found[1].decode("ascii").replace("=", " ").replace(";", ", ").rstrip(", ") if found else ""


def fault_of_entry(folder):
    """Why LAMMPS finds no plugin of EVP by this folder of LAMMPS_PLUGIN_PATH; empty where it does."""
    if folder.is_file():
        return f"{folder} is a file, and must be the folder that holds it"
    if not folder.exists():
        return f"{folder} does not exist"
    return "" if os.path.lexists(folder / NAME) else f"{folder} holds no {NAME}"


def entry_of(file, name):
    """Value of NAME=value or NAME:TYPE=value in a text file; empty where there is none."""
    found = re.search(rf"^{name}(?::\w+)?=(.+)$", file.read_text(encoding="utf-8", errors="replace"), re.M) if file.is_file() else None
    return found[1] if found else ""


def source_tree():
    """That these tools are in, or were installed from; None where it no longer exists."""
    source = pathlib.Path(entry_of(RECORD, "source") or ROOT)
    return source if (source / "cmake" / "EvpInstall.cmake").is_file() else None


def own_files(name):
    """Files of this name in EVP's folders: those of the command evp, of the installation, of the builds in the source tree."""
    places = [os.environ.get("EVP_PLUGINS"), os.environ.get("EVP_BUILD"), ROOT / "../../lib/lammps/plugins", ROOT / "../../libexec/evp", entry_of(RECORD, "build")]
    source = source_tree()
    places += [source / "build", *sorted(path.parent for path in source.glob(f"*/{NAME}"))] if source else []
    places = dict.fromkeys(os.path.abspath(place) for place in places if place)
    return [pathlib.Path(place, name) for place in places if os.path.isfile(os.path.join(place, name))]


def take_plugin(folder):
    return f"export LAMMPS_PLUGIN_PATH={quoted(folder)}"


def take_lmp(path, found_by):
    """Command by which that lmp is found."""
    return f"export EVP_LMP={quoted(path)}" if found_by == "EVP_LMP" else in_front("PATH", path.parent)


def other_lmps(wrong):
    """The other lmps of this machine that can take a plugin."""
    for path in [*programs("lmp"), *own_files("lmp")]:
        found = parse_help(run([path, "-h"])[1]) if os.path.realpath(path) != os.path.realpath(wrong) else None
        if found and not found.lacks():
            yield path


def get_lammps():
    return quoted(source_tree() / "tools" / "setup.sh") if source_tree() else "tools/setup.sh   # in EVP's source folder"


def another_lmp(wrong, found_by):
    """Command that takes another lmp, one that loads EVP's own plugin first; or that builds one."""
    found = sorted(other_lmps(wrong), key=lambda path: not any(try_deck(path, plugin, alone=True).knows() for plugin in own_files(NAME)[:1]))
    return take_lmp(found[0], found_by) if found else get_lammps()


def build_for(host):
    """Command that builds a plugin for this lmp in a new folder."""
    source, home = source_tree() or pathlib.Path("/path/to/evp"), entry_of(host.exe.parent / "CMakeCache.txt", "CMAKE_HOME_DIRECTORY")
    prefix, folder = host.exe.parent.parent, source / f"build-{''.join(host.help.release.split()[:3])}-{host.help.integers}-{host.help.mpi.split()[0].lower()}"
    options = [HEADERS, "-DLAMMPS_BUILD_DIR=/path/to/its/build"]
    if home:
        options = [f"-DLAMMPS_SOURCE_DIR={pathlib.Path(home).parent}", f"-DLAMMPS_BUILD_DIR={host.exe.parent}"]
    elif any(any(prefix.glob(f"{place}/cmake/LAMMPS/LAMMPSConfig.cmake")) for place in ("lib*", "lib/*")):
        options = [f"-DCMAKE_PREFIX_PATH={prefix}", HEADERS]
    return (f"cmake -S {quoted(source)} -B {quoted(folder)} -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=off {quoted(*options)} && "
            f"cmake --build {quoted(folder)} --target evpplugin && {take_plugin(folder)}")


def build_lammps(exe, option):
    """Command that builds this LAMMPS again with an option of its CMake switched on."""
    build = exe.parent if entry_of(exe.parent / "CMakeCache.txt", "CMAKE_HOME_DIRECTORY") else "/path/to/the/build/of/LAMMPS"
    return f"cmake -D{option}=on {quoted(build)} && cmake --build {quoted(build)}"


def mend(host, wrong):
    """The cheapest first: a plugin of EVP that this lmp loads, the lmp that the wrong one was built for (unless the user named an lmp), a new build."""
    for plugin in own_files(NAME):
        if plugin != wrong and try_deck(host.path, plugin, alone=True).knows():
            return take_plugin(plugin.parent)
    if wrong and wrong.is_file() and host.found_by in ("PATH", "EVP_LMP"):
        path = next((path for path in other_lmps(host.path) if try_deck(path, wrong, alone=True).knows()), None)
        if path:
            return take_lmp(path, host.found_by)
    return build_for(host)


def apt(*packages):
    return " ".join([*(["sudo"] if os.geteuid() else []), "apt-get install", *packages])


def check_python(report):
    own = f"{platform.python_version()} ({sys.executable})"
    lacking = [name for name in MODULES if not importlib.util.find_spec(name)]
    if not lacking:
        return report.line("ok", "Python", f"{own} with {', '.join(MODULES)}")
    lack = f"{own} lacks {', '.join(lacking)}"
    other = next((path for path in interpreter.candidates(os.environ) if interpreter.has_modules(path, MODULES)), None)
    if other:
        return report.line("ok", "Python", f"{lack}; the tools go on in {other}, which has them")
    debian = shutil.which("apt-get") and os.path.exists("/usr/bin/python3")
    return report.fault("Python", lack, f"no Python here has the modules {', '.join(lacking)}, which the tools need. LAMMPS and the plugin do without.",
                        apt(*(f"python3-{name}" for name in lacking)) if debian else quoted(sys.executable, "-m", "pip", "install", *lacking))


def find_lmp(given):
    """(path, how it was found); a path may be no program, and is None where there is none."""
    for word, found_by in ((given, "--lmp"), (os.environ.get("EVP_LMP"), "EVP_LMP")):
        if word:
            return pathlib.Path(os.path.abspath(shutil.which(word) or word)), found_by
    found = [(path, "PATH") for path in programs("lmp")] + [(path, "EVP's own; there is none on PATH") for path in own_files("lmp")]
    return found[0] if found else (None, "")


def library_of(exe, **changes):
    """The liblammps that the loader takes for a program; None without one."""
    found = re.search(r"liblammps\S* => (/.+?) \(0x", run(["ldd", exe], {**os.environ, **changes})[1])
    return pathlib.Path(found[1]) if found else None


def check_lmp(report, given):
    """The Host; None where it does not start, or can take no plugin."""
    path, found_by = find_lmp(given)
    if path is None:
        return report.fault("lmp", "no lmp on PATH, EVP_LMP is not set, and EVP has no build", "there is no LAMMPS here.", get_lammps())
    if not shutil.which(str(path)):
        return report.fault("lmp", f"{path} ({found_by}): no such program", f"{found_by} names {path}, which is no program.", another_lmp(path, found_by))
    status, text = run([path, "-h"])
    own = parse_help(text)
    if own is None:
        return does_not_start(report, path, found_by, status, text)
    trial = try_deck(path)
    exe = trial.exe or try_deck(path, alone=True).exe or path
    report.line("ok", "lmp", f"{path} ({found_by})" + (f", which starts {exe}" if os.path.realpath(exe) != os.path.realpath(path) else ""))
    right, loaded = library_of(path, LD_LIBRARY_PATH=""), library_of(path)
    if right and loaded and right.resolve() != loaded.resolve():
        return report.fault("LAMMPS", f"{loaded}, not {right}", f"{path} runs with the library of another LAMMPS: {loaded} ({own.release}) in place of {right}. "
                            "The libraries of all releases have one name, and LD_LIBRARY_PATH comes first.", in_front("LD_LIBRARY_PATH", right.parent))
    if own.lacks():
        first = f"the first lmp on PATH is {path}" if found_by == "PATH" else f"this lmp is {path}"
        return report.fault("LAMMPS", own.words(), f"{first}, and that is the wrong one: {own.lacks()}.", another_lmp(path, found_by))
    report.line("ok", "LAMMPS", own.words())
    return Host(path, found_by, own, trial, exe)


def does_not_start(report, path, found_by, status, text):
    """The line of an lmp that shows no help."""
    said = (text.strip().splitlines() or ["no output"])[-1] + (f" (signal {-status})" if status and status < 0 else "")
    library = re.search(r"(liblammps[^ :]*): cannot open shared object", text)
    places = [path.parent, *sorted(path.parent.parent.glob("lib*")), *sorted(path.parent.parent.glob("lib/*-linux-*"))] if library else []
    right = next((place for place in places if (place / library[1]).is_file()), None)
    if right:
        return report.fault("lmp", f"{path} does not start: {said}", f"{path} does not find its own library {library[1]}, which is in {right}.", in_front("LD_LIBRARY_PATH", right))
    return report.fault("lmp", f"{path} ({found_by}) does not start: {said}", f"{path} is no LAMMPS that starts on this machine: {said}.", another_lmp(path, found_by))


def why_not(plugin, trial):
    """A sentence for a plugin that lmp does not load, by what both say; empty where it does."""
    refused, unopened, facts = REFUSED.search(trial.text), UNOPENED.search(trial.text), facts_of(plugin)
    shown = f"{plugin} ({facts})" if facts else str(plugin)
    if trial.knows():
        return ""
    if refused:
        return f"{plugin} was built for another LAMMPS: {refused[1]}."
    if unopened:
        return f"{shown} cannot be opened: {unopened[2]}. It is damaged, or built for another LAMMPS or MPI."
    if trial.status is None or trial.status < 0:
        return f"lmp ends at {shown}: {trial.text if trial.status is None else f'signal {-trial.status}'}. It is damaged, or built for another LAMMPS or MPI."
    return f"lmp loads {shown}, but says: {(re.search('^ERROR.*', trial.text, re.M) or ['nothing of evp/lj'])[0]}."


def check_plugin(report, host, given):
    """Does lmp load it by itself, or else by `plugin load`? The plugin that was looked at; None without one."""
    text = host.trial.plugin_path or os.environ.get("LAMMPS_PLUGIN_PATH", "")
    entries = [pathlib.Path(entry) for entry in text.split(os.pathsep) if entry]
    found = [entry / NAME for entry in entries if not fault_of_entry(entry)]
    plugin = next(iter([*([given] if given else []), *found, *own_files(NAME)]), None)
    trial = host.trial if found and not given else try_deck(host.path, plugin, alone=not found) if plugin else None
    why = why_not(plugin, trial) if plugin else f"there is no {NAME}."
    if found or given:
        report.line("ok", "plugin path", f"LAMMPS_PLUGIN_PATH={text}" if found else f"without EVP's plugin: a deck must begin with: plugin load {plugin}")
    else:
        what = "; ".join(map(fault_of_entry, entries)) or "LAMMPS_PLUGIN_PATH is not set"
        report.fault("plugin path", what, f"{what}{f', and {why[:-1]}' if why else ''}: LAMMPS loads no EVP plugin by itself, and a deck without `plugin load` "
                     "knows no evp/lj.", mend(host, plugin) if why else take_plugin(plugin.parent))
    if why and plugin:
        static = "undefined symbol" in why and not library_of(host.exe)
        report.fault("plugin", f"{plugin} is not loaded", why + " LAMMPS is linked into its program: plugins need the shared library." * static,
                     build_lammps(host.exe, "BUILD_SHARED_LIBS") if static else mend(host, plugin))
    elif found and given and not filecmp.cmp(found[0], plugin, shallow=False):
        report.fault("plugin", f"lmp has loaded {found[0]} first", f"the plugin is loaded twice: lmp takes {found[0]} from LAMMPS_PLUGIN_PATH, and ignores a later "
                     f"`plugin load {plugin}`.", take_plugin(plugin.parent))
    elif plugin:
        report.line("ok", "plugin", f"{plugin}, {'loaded by itself' if found else 'by `plugin load`'}: {facts_of(plugin) or 'it does not say what it was built for'}")
    return plugin


def another_mpirun(kind, chosen):
    """Command that takes the mpirun of that MPI."""
    for path in programs("mpirun", "mpirun.openmpi", "mpirun.mpich", "mpiexec.hydra", "mpiexec"):
        if mpi_kind(run([path, "--version"])[1]) == kind:
            return in_front("PATH", path.parent) if path.name == "mpirun" and not chosen else f"export EVP_MPIRUN={quoted(path)}"
    package = {"Open MPI": "openmpi-bin", "MPICH": "mpich"}.get(kind)
    return apt(package) if package and shutil.which("apt-get") else f"export EVP_MPIRUN=/path/to/mpirun   # of {kind}"


def two_ranks(words, lmp):
    """(exit status, output, ranks of the run, or of each of the runs) of lmp on two ranks."""
    with tempfile.TemporaryDirectory(prefix="evp_doctor_") as folder:
        pathlib.Path(folder, "in.doctor").write_text(DECK, encoding="utf-8")
        status, text = run([*words, "-np", "2", lmp, "-log", "none", "-in", "in.doctor"], {**os.environ, **ALONE}, folder)
    return status, text, [int(a) * int(b) * int(c) for a, b, c in re.findall(r"(\d+) by (\d+) by (\d+) MPI processor grid", text)]


def check_mpirun(report, host):
    """Do two ranks start as one run?"""
    kind, command = mpi_kind(host.help.mpi), os.environ.get("EVP_MPIRUN", "mpirun")
    try:
        words = shlex.split(command)
    except ValueError as error:
        return report.fault("mpirun", f"EVP_MPIRUN={command}: {error}", f"EVP_MPIRUN is no command of a shell: {error}.", "unset EVP_MPIRUN")
    words, chosen = words[:-1] if words[-1:] in (["-np"], ["-n"]) else words, words[:1] != ["mpirun"]
    if kind == "none":
        return report.line("not checked", "mpirun", "this lmp has no MPI: it runs on one rank, and mpirun would start copies of the same run")
    if not words or not shutil.which(words[0]):
        return report.line("not checked", "mpirun", f"no {' '.join(words[:1])} on PATH: runs have one rank until you run: {another_mpirun(kind, chosen)}")
    version = run([words[0], "--version"])
    own = "unknown" if version[0] else mpi_kind(version[1])
    name = f"{shutil.which(words[0])}: {own} {number_in(version[1])}".strip()
    status, text, ranks = two_ranks(words, host.path)
    if ranks == [2]:
        return report.line("ok", "mpirun", f"{name}, two ranks")
    if ranks == [1, 1] or (not ranks and own != kind and "unknown" not in (own, kind)):
        return report.fault("mpirun", f"{name}; lmp has {host.help.mpi}",
                            f"mpirun is of another MPI ({own}) than lmp ({host.help.mpi}): each rank would be a run of its own.", another_mpirun(kind, chosen))
    if "attempt to run as root" in text:
        allow = "export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"  # the tools set both, but not for an mpirun of the user's
        if "EVP_MPIRUN" in os.environ:
            return report.fault("mpirun", f"{name} refuses to run as root", "mpirun of Open MPI does not run as root unless told to.", allow)
        return report.line("note", "mpirun", f"{name} refuses to run as root; before runs on several ranks: {allow}")
    if "not enough slots" in text:
        return report.fault("mpirun", f"{name}: fewer than two cores", "mpirun starts no more ranks than there are cores unless told to.",
                            "export OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe")
    first = next((line.strip("- ") for line in text.splitlines() if line.strip("- ")), f"no output, exit status {status}")
    return report.fault("mpirun", f"{name} does not start two ranks: {first}", f"mpirun does not start: {first}.", another_mpirun(kind, chosen))


def last_run(path):
    """The text of the last run in a log, or in the kept output of a job; ValueError where there is none."""
    _, start, text = path.read_text(encoding="utf-8", errors="replace").rpartition("\nLAMMPS (")
    if not start and not text.startswith("LAMMPS ("):
        raise ValueError(f"{path} is no log of LAMMPS: no line begins with 'LAMMPS ('")
    return start.lstrip() + text


def plugin_of(log, folder):
    """The first file of a `plugin load` line that is there, as seen from the folder of the log; None without."""
    words = [word.strip("\"'") for line in re.findall(r"^plugin\s+load\s+(.+)$", log, re.M) for word in line.split()]
    return next((folder / word for word in words if "/" in word and (folder / word).is_file()), None)


def check_log(report, host, plugin, log):
    """What does the log say of the run that failed?"""
    if not log:
        return report.line("not checked", "log", "give one by --log log.lammps")
    refused, unopened = REFUSED.search(log), UNOPENED.search(log)
    unknown = re.search(r"Unrecognized \w+ style '[\w/]*evp[\w/]*'|Unknown command: (read|write)_evp_\w+", log)
    package = re.search(r"Unrecognized \w+ style '(\S+)' is part of the (\S+) package", log)
    error = re.search(r"^ERROR\b.*", log, re.M)
    cause, command = "", take_plugin(plugin.parent) if plugin and not report.faults else mend(host, plugin) if host else get_lammps()
    if host and release_number(log.partition("(")[2]) != release_number(host.help.release):
        cause, command = f"it was by another lmp than {host.path}, {log.splitlines()[0]}", in_front("PATH", host.path.parent)
    elif refused:
        cause = f"the plugin was built for another LAMMPS: {refused[1]}"
    elif unopened:
        cause = f"the file of `plugin load` did not open: {unopened[2]}. Without that line LAMMPS takes the plugin of LAMMPS_PLUGIN_PATH"
    elif unknown and re.search(r"^Loaded [1-9]\d* plugins from|^Loading plugin: ", log, re.M):
        cause = f"{unknown[0]}: the plugin is older than the deck"
    elif unknown:
        empty = re.search(r"^Loaded 0 plugins from .*", log, re.M)
        cause = f"it loaded no plugin: {f'it says {empty[0]!r}' if empty else 'LAMMPS_PLUGIN_PATH was not set in its shell or job script'}, and the deck has no `plugin load`"
    elif package and host and package[2] not in host.help.packages:
        cause, command = f"its deck uses {package[1]} of LAMMPS' package {package[2]}, which this lmp was built without", build_lammps(host.exe, f"PKG_{package[2]}")
    if cause:
        return report.fault("log", cause, f"of the run of this log, {cause}.", command)
    if error or "\nTotal wall time" in log:
        return report.line("ok", "log", "no fault of the installation" + (f"; it ends with: {error[0]}" if error else ""))
    return report.line("not checked", "log", "it breaks off without an error: lmp crashed or was stopped. If that was at `plugin load FILE`, give --plugin FILE")


def system_words():
    """'EVP 1.0.0 on Debian GNU/Linux 12 (bookworm), x86_64, Linux 6.1'."""
    version = re.search(r'^__version__ = "(.+?)"', (ROOT / "tools" / "evp" / "__init__.py").read_text(encoding="utf-8"), re.M)[1]
    name = entry_of(pathlib.Path("/etc/os-release"), "PRETTY_NAME").strip('"') or platform.platform(terse=True)
    return f"EVP {version} on {name}, {platform.machine()}, {platform.system()} {'.'.join(platform.release().split('.')[:2])}"


def main(argv=None):
    """Returns 0, or 1 where a fault is named."""
    command = "evp doctor" if os.environ.get("EVP_COMMAND") else "doctor.py"
    parser = argparse.ArgumentParser(prog=command, description=__doc__.replace("doctor.py", command), formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lmp", metavar="LMP", help="LAMMPS program (default: $EVP_LMP, else the first lmp on PATH, else that of EVP's build)")
    parser.add_argument("--plugin", type=pathlib.Path, metavar="FILE", help="plugin (default: of LAMMPS_PLUGIN_PATH, else that of EVP's build or installation)")
    parser.add_argument("--log", type=pathlib.Path, metavar="FILE", help="log.lammps of a run that failed, or its kept output")
    args = parser.parse_args(argv)
    for option, path in (("--lmp", args.lmp), ("--plugin", args.plugin), ("--log", args.log)):
        if path and not pathlib.Path(path).is_file():
            parser.error(f"{option} {path}: no such file")
    try:
        log = last_run(args.log) if args.log else ""
    except (OSError, ValueError) as error:
        parser.error(f"--log: {error}")
    print(f"evp doctor: {system_words()}", flush=True)
    report, given = Report(), args.plugin.absolute() if args.plugin else plugin_of(log, args.log.absolute().parent) if log else None
    check_python(report)
    host = check_lmp(report, args.lmp)
    plugin = check_plugin(report, host, given) if host else report.line("not checked", "plugin", "first mend the fault above")
    if host:
        check_mpirun(report, host)
    check_log(report, host, plugin, log)
    print("\n" + report.verdict())
    return 1 if report.faults else 0


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # of `| head`
    sys.exit(main())
