#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Why LAMMPS says 'Unrecognized pair style evp/lj', or does not open the plugin, and the command that mends it.

Asks lmp, ldd and mpirun with decks of a few lines; changes nothing. One line per check (ok, note, FAULT, not checked); at the end the cause and
one command. Exit status: 0 healthy, 1 a fault, 2 wrong use. Paste the output into an issue: beside versions it holds paths only.
"""

import argparse
import filecmp
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
OLDEST = 20250204  # as in cmake/EvpHost.cmake
MONTHS = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()
SECONDS = 60  # a run here takes less than one: only a hang gets there
KNOWN = "evp doctor: evp/lj is known"
NAME = "evpplugin.so"
REFUSED = re.compile(r"evpplugin\.so was built for another LAMMPS: (.+?)\. Rebuild", re.S)
UNOPENED = re.compile(r"^Open of file (.+?) failed: (.+)$", re.M)
FOLDER = re.compile(r"^Loaded \d+ plugins from (.+)$", re.M)
ALONE = {"LAMMPS_PLUGIN_PATH": "", "EVP_PLUGIN_DIR": "/dev/null"}  # without the plugins that lmp loads by itself
DECK = "atom_style sphere\natom_modify map yes\nregion box block 0 1 0 1 0 1\ncreate_box 1 box\n"
LAMMPS_FOLDERS = "-DLAMMPS_SOURCE_DIR=/path/to/lammps -DLAMMPS_BUILD_DIR=/path/to/lammps/build"
DAMAGED = "It is damaged, or built for another LAMMPS or MPI, or this lmp was built without -DBUILD_SHARED_LIBS=on."
HINT = (" In the command, /path/to/lammps stands for the source tree of this LAMMPS, and /path/to/lammps/build for the folder where it was built; "
        "the page 'Installation' has the options for an installed one.")


def export(name, value, in_front=False):
    """Command that sets a variable, or puts a folder in front of the list of folders in it."""
    return f"export {name}={shlex.quote(str(value))}" + ("${" + name + ":+:$" + name + "}" if in_front else "")


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
            left_out = f" Not checked: {', '.join(self.left_out)}." if self.left_out else ""
            return f"Healthy: lmp loads the plugin and knows pair_style evp/lj.{left_out}"
        (_, cause, command), *others = self.faults
        hint = HINT if "/path/to/lammps" in command else ""
        text = textwrap.fill(f"Cause: {cause}{hint}", 120, break_long_words=False, break_on_hyphens=False)
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


def release_number(text):
    """20250204 of '4 Feb 2025 - Update 1'; 0 where it is no date."""
    found = re.match(r"(\d+) ?([A-Z][a-z]{2})[a-z]* ?(\d{4})", text)
    return int(found[3]) * 10000 + (MONTHS.index(found[2]) + 1) * 100 + int(found[1]) if found and found[2] in MONTHS else 0


class Lammps(NamedTuple):
    """An lmp, and what its -h says."""

    path: pathlib.Path
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
        return f"LAMMPS {self.release}, {self.integers}, {self.mpi}, {self.compiler}"


def lammps_of(path, text):
    """Lammps by the output of `lmp -h`; None where it is not that of LAMMPS."""

    def found(pattern, default="unknown"):
        return (re.search(pattern, text, re.M) or ["", default])[1].strip()

    release = found(r"Massively Parallel Simulator - (.+)", "")
    compiler, mpi = found(r"^Compiler: *(.+?)(?: with .*)?$"), found(r"^MPI v[\d.]+: *([^,\n]+)")
    packages = tuple(found(r"^Installed packages:\s*\n((?:.*\S.*\n)*)", "").split())
    return Lammps(path, release, found(r"^-DLAMMPS_(\w+BIG)$").lower(), mpi, compiler, packages) if release else None


def run_deck(words, deck, alone=False):
    """(exit status, output) of a deck. alone: without the plugins of LAMMPS_PLUGIN_PATH."""
    with tempfile.TemporaryDirectory(prefix="evp_doctor_") as folder:
        pathlib.Path(folder, "in.doctor").write_text(deck, encoding="utf-8")
        return run([*words, "-log", "none", "-in", "in.doctor"], {**os.environ, **(ALONE if alone else {})}, folder)


def try_plugin(lmp, plugin="", alone=False):
    """The same of a deck with evp/lj. plugin: of a `plugin load` line."""
    load = f'plugin load "{plugin}"\n' if plugin else ""
    return run_deck([lmp], f'{load}{DECK}pair_style evp/lj\nprint "{KNOWN}"\n', alone)


def facts_of(path):
    """What a plugin file says of itself, src/lammps/host_guard.h: 'version 1.0.0, lammps 20250204, ...'; empty where it says nothing."""
    try:
        found = re.search(rb"EVP plugin facts: ([ -~]+)\0", path.read_bytes())
    except OSError:
        return ""
    return found[1].decode("ascii").replace("=", " ").replace(";", ", ").rstrip(", ") if found else ""


def entry_of(file, name):
    """Value of NAME=value in a text file; empty where there is none."""
    found = re.search(rf"^{name}=(.+)$", file.read_text(encoding="utf-8", errors="replace"), re.M) if file.is_file() else None
    return found[1] if found else ""


def source_tree():
    """That these tools are in, or were installed from."""
    source = pathlib.Path(entry_of(RECORD, "source") or ROOT)
    return source if (source / "cmake" / "EvpInstall.cmake").is_file() else pathlib.Path("/path/to/evp")


def own_files(name):
    """Files of this name in EVP's folders: those of the command evp, of the installation, of the builds in the source tree."""
    places = [os.environ.get("EVP_PLUGINS"), os.environ.get("EVP_BUILD"), ROOT / "../../lib/lammps/plugins", ROOT / "../../libexec/evp"]
    places += [entry_of(RECORD, "build"), *sorted(source_tree().glob("build*"))]
    places = dict.fromkeys(os.path.abspath(place) for place in places if place)
    return [pathlib.Path(place, name) for place in places if os.path.isfile(os.path.join(place, name))]


def another_lmp(wrong=None):
    """Command that takes EVP's own lmp, or builds one."""
    for path in own_files("lmp"):
        own = lammps_of(path, run([path, "-h"])[1]) if path != wrong else None
        if own and not own.lacks():
            return export("EVP_LMP", path) if os.environ.get("EVP_LMP") else export("PATH", path.parent, in_front=True)
    return shlex.quote(f"{source_tree()}/tools/setup.sh")


def mend(lammps, first):
    """Command that takes the first plugin, or one of EVP's own, that this lmp loads, or builds one in a new folder."""
    for plugin in dict.fromkeys([*([first] if first else []), *own_files(NAME)]):
        if KNOWN in try_plugin(lammps.path, plugin, alone=True)[1]:
            return export("LAMMPS_PLUGIN_PATH", plugin.parent)
    source, release = source_tree(), "".join(lammps.release.split()[:3])
    folder = source / f"build-{release}-{lammps.integers}"
    configure = f"cmake -S {shlex.quote(str(source))} -B {shlex.quote(str(folder))} -DBUILD_TESTING=off {LAMMPS_FOLDERS}"
    return f"{configure} && cmake --build {shlex.quote(str(folder))} --target evpplugin && {export('LAMMPS_PLUGIN_PATH', folder)}"


def find_lmp(given):
    """(path, how it was found); a path may be no program, and is None where there is none."""
    for word, found_by in ((given, "--lmp"), (os.environ.get("EVP_LMP"), "EVP_LMP"), (shutil.which("lmp"), "PATH")):
        if word:
            return pathlib.Path(os.path.abspath(shutil.which(word) or word)), found_by
    return next(((path, "EVP's own; there is none on PATH") for path in own_files("lmp")), (None, ""))


def library_of(exe, **changes):
    """The liblammps that the loader takes for a program; None without one."""
    found = re.search(r"liblammps\S* => (/.+?) \(0x", run(["ldd", exe], {**os.environ, **changes})[1])
    return pathlib.Path(found[1]) if found else None


def check_builds(report):
    """Is each build folder of the source tree where CMake made it? In a copy lmp, evp and the compiler take the files of the other one."""
    for cache in sorted(source_tree().glob("build*/CMakeCache.txt")):
        folder, made = cache.parent, entry_of(cache, "CMAKE_CACHEFILE_DIR:INTERNAL")
        if made and not (os.path.isdir(made) and os.path.samefile(made, folder)):
            cause = f"{folder} was made as {made}, and moved or copied since: it holds paths of there."
            setup = shlex.quote(f"{source_tree()}/tools/setup.sh")
            report.fault("build folder", f"{folder} is that of {made}", cause, f"rm -r {shlex.quote(str(folder))} && {setup}")


def check_lmp(report, given):
    """The Lammps; None where it does not start, or can take no plugin."""
    path, found_by = find_lmp(given)
    if path is None:
        return report.fault("lmp", "no lmp on PATH, EVP_LMP is not set, and EVP has no build", "there is no LAMMPS here.", another_lmp())
    status, text = run([path, "-h"])
    lammps = lammps_of(path, text)
    if lammps is None:
        said = (text.strip().splitlines() or ["no output"])[-1] + (f" (signal {-status})" if status and status < 0 else "")
        cause, library = f"{path} is no LAMMPS that starts on this machine: {said}.", re.search(r"(lib[^ :/]*): cannot open shared object", text)
        command = export("LD_LIBRARY_PATH", f"/path/to/the/folder/of/{library[1]}", in_front=True) if library else another_lmp(path)
        return report.fault("lmp", f"{path} ({found_by}) does not start: {said}", cause, command)
    report.line("ok", "lmp", f"{path} ({found_by})")
    right, loaded = library_of(path, LD_LIBRARY_PATH=""), library_of(path)
    if right and loaded and right.resolve() != loaded.resolve():
        cause = (f"{path} runs with the library of another LAMMPS: {loaded} ({lammps.release}) in place of {right}. "
                 "The libraries of all releases have one name, and LD_LIBRARY_PATH comes first.")
        return report.fault("LAMMPS", f"{loaded}, not {right}", cause, export("LD_LIBRARY_PATH", right.parent, in_front=True))
    if lammps.lacks():
        first = "the first lmp on PATH" if found_by == "PATH" else "this lmp"
        return report.fault("LAMMPS", lammps.words(), f"{first} is {path}, and that is the wrong one: {lammps.lacks()}.", another_lmp(path))
    report.line("ok", "LAMMPS", lammps.words())
    return lammps


def why_not(plugin, trial):
    """A sentence for a plugin that lmp does not load, by what both say; empty where it does."""
    status, text = trial
    refused, unopened, facts = REFUSED.search(text), UNOPENED.search(text), facts_of(plugin)
    shown = f"{plugin} ({facts})" if facts else str(plugin)
    if KNOWN in text:
        return ""
    if refused:
        return f"{plugin} was built for another LAMMPS: {refused[1]}."
    if unopened:
        return f"{shown} cannot be opened: {unopened[2]}. {DAMAGED}"
    if status is None or status < 0:
        return f"lmp ends at {shown}: {text if status is None else f'signal {-status}'}. {DAMAGED}"
    return f"lmp loads {shown}, but says: {(re.search('^ERROR.*', text, re.M) or (text.strip().splitlines() or ['nothing'])[-1:])[0]}."


def check_plugin(report, lammps, given):
    """Does lmp load it by itself, or else by `plugin load`?"""
    own_trial = try_plugin(lammps.path)
    named = [*FOLDER.findall(own_trial[1]), *os.environ.get("LAMMPS_PLUGIN_PATH", "").split(os.pathsep)]  # lmp may be a script that sets it
    folders = [pathlib.Path(folder) for folder in dict.fromkeys(named) if folder]
    path = os.pathsep.join(map(str, folders))
    found = next((folder / NAME for folder in folders if os.path.lexists(folder / NAME)), None)
    plugin = given or found or next(iter(own_files(NAME)), None)
    trial = own_trial if found and not given else try_plugin(lammps.path, plugin, alone=not found)
    why = why_not(plugin, trial) if plugin else f"there is no {NAME}."
    command = mend(lammps, plugin) if why else export("LAMMPS_PLUGIN_PATH", plugin.parent)
    if found:
        report.line("ok", "plugin path", f"LAMMPS_PLUGIN_PATH={path}")
    elif given:
        report.line("ok", "plugin path", f"without EVP's plugin: a deck must begin with: plugin load {plugin}")
    else:
        what = f"LAMMPS_PLUGIN_PATH={path} names no folder with {NAME}" if path else "LAMMPS_PLUGIN_PATH is not set"
        cause = f"{what}{f', and {why[:-1]}' if why else ''}: LAMMPS loads no EVP plugin by itself, and a deck without `plugin load` knows no evp/lj."
        report.fault("plugin path", what, cause, command)
    if why and plugin:
        report.fault("plugin", f"{plugin} is not loaded", why, command)
    elif found and given and not filecmp.cmp(found, given, shallow=False):
        cause = f"the plugin is loaded twice: lmp takes {found} from LAMMPS_PLUGIN_PATH, and ignores a later `plugin load {given}`."
        report.fault("plugin", f"lmp has loaded {found} first", cause, command)
    elif plugin:
        facts = facts_of(plugin) or "it does not say what it was built for"
        report.line("ok", "plugin", f"{plugin}, {'loaded by itself' if found else 'by `plugin load`'}: {facts}")


def check_mpirun(report, lammps):
    """Do two ranks start as one run?"""
    try:
        words = shlex.split(os.environ.get("EVP_MPIRUN") or "mpirun")
    except ValueError as error:
        return report.fault("mpirun", f"EVP_MPIRUN: {error}", f"EVP_MPIRUN is no command of a shell: {error}.", "unset EVP_MPIRUN")
    words = words[:-1] if words[-1] in ("-np", "-n") else words
    if "STUBS" in lammps.mpi:
        return report.line("not checked", "mpirun", "this lmp has no MPI: it runs on one rank, and mpirun would start copies of the same run")
    if not shutil.which(words[0]):
        return report.line("not checked", "mpirun", f"no {words[0]} on PATH: runs have one rank until there is one of {lammps.mpi}")
    own = run([words[0], "--version"])[1].partition("\n")[0].rstrip(":")
    name = f"{shutil.which(words[0])}: {own}"
    text = run_deck([*words, "-np", "2", lammps.path], DECK, alone=True)[1]
    if "attempt to run as root" in text:
        allow = "export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"  # the tools set both, but not for an mpirun of the user's
        if "EVP_MPIRUN" in os.environ:
            return report.fault("mpirun", f"{name} refuses to run as root", "mpirun of Open MPI does not run as root unless told to.", allow)
        return report.line("note", "mpirun", f"{name} refuses to run as root; before runs on several ranks: {allow}")
    if "not enough slots" in text:
        return report.fault("mpirun", f"{name}: fewer than two cores", "mpirun starts no more ranks than there are cores unless told to.",
                            "export OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe")
    said = next((line.strip("- ") for line in text.splitlines() if line.strip("- ")), "no output")
    cause = f"mpirun ({own}) does not start lmp ({lammps.mpi}): {said}."
    if "1 by 1 by 1 MPI processor grid" in text:
        cause = f"mpirun is of another MPI ({own}) than lmp ({lammps.mpi}): each rank would be a run of its own."
    elif "MPI processor grid" in text:
        return report.line("ok", "mpirun", f"{name}, two ranks")
    return report.fault("mpirun", f"{name} starts no run on two ranks", cause, f"export EVP_MPIRUN=/path/to/mpirun   # of {lammps.mpi}")


def main(argv=None):
    """Returns 0, or 1 where a fault is named."""
    command = "evp doctor" if os.environ.get("EVP_COMMAND") else "doctor.py"
    parser = argparse.ArgumentParser(prog=command, description=__doc__.replace("doctor.py", command), formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lmp", metavar="LMP", help="LAMMPS program (default: $EVP_LMP, else the first lmp on PATH, else that of EVP's build)")
    parser.add_argument("--plugin", type=pathlib.Path, metavar="FILE", help="plugin (default: of LAMMPS_PLUGIN_PATH, else that of EVP's build or installation)")
    args = parser.parse_args(argv)
    for option, path in (("--lmp", args.lmp), ("--plugin", args.plugin)):
        if path and not pathlib.Path(path).is_file():
            parser.error(f"{option} {path}: no such file")
    version = re.search(r'^__version__ = "(.+?)"', (ROOT / "tools" / "evp" / "__init__.py").read_text(encoding="utf-8"), re.M)[1]
    name = entry_of(pathlib.Path("/etc/os-release"), "PRETTY_NAME").strip('"') or platform.platform(terse=True)
    system = f"{platform.system()} {'.'.join(platform.release().split('.')[:2])}"
    print(f"evp doctor: EVP {version} on {name}, {platform.machine()}, {system}, Python {platform.python_version()}", flush=True)
    report = Report()
    check_builds(report)
    lammps = check_lmp(report, args.lmp)
    if lammps:
        check_plugin(report, lammps, args.plugin and args.plugin.absolute())
        check_mpirun(report, lammps)
    else:
        report.line("not checked", "plugin", "first mend the fault above")
    print("\n" + report.verdict())
    return 1 if report.faults else 0


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # of `| head`
    sys.exit(main())
