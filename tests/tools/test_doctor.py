# SPDX-License-Identifier: GPL-2.0-only
"""evp doctor names the cause of each fault that is planted here, and its command mends it.

The faults are real files: LAMMPS of another release or without PLUGIN is a copy of the real one with other bytes in its library, the
plugins of other LAMMPS are compiled with the guard and the facts of the real one, and lmp refuses them."""

import os
import pathlib
import re
import shutil
import stat
import struct
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import doctor as tool
import in_process
import pytest

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
DOCTOR = REPOSITORY / "tools" / "doctor.py"
WRAPPER = pathlib.Path(os.environ.get("EVP_LMP", REPOSITORY / "build" / "lmp")).absolute()
BUILD = WRAPPER.parent
PLUGIN = BUILD / "evpplugin.so"
BUILT = tool.entry_of(BUILD / "CMakeCache.txt", "LAMMPS_BUILD_DIR")
LMP = pathlib.Path(BUILT) / "lmp"
NO_MPIRUN = "no_mpirun_here"  # where mpirun is not looked at: a start takes as long as all the rest
CHECK = r"^ *(?:ok|note|FAULT|not checked)  +(\S.*?)  "  # name of the check of a line
KEPT = {name: value for name, value in os.environ.items()
        if name not in ("EVP_LMP", "EVP_COMMAND", "EVP_PLUGINS", "EVP_PLUGIN_DIR", "LAMMPS_PLUGIN_PATH", "LD_LIBRARY_PATH")}


def surroundings(**changes):
    """Environment of a user's shell, PATH without any lmp."""
    folders = [folder for folder in KEPT["PATH"].split(":") if not os.path.exists(os.path.join(folder, "lmp"))]
    return {**KEPT, "PATH": ":".join(folders), "EVP_BUILD": str(BUILD), "EVP_MPIRUN": NO_MPIRUN, "OMPI_MCA_ess_singleton_isolated": "1",
            "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1",
            **{name: str(value) for name, value in changes.items()}}


class Answer:
    """What the doctor printed and its exit status."""

    def __init__(self, words, environment, first="true"):
        self.words, self.environment = [str(word) for word in words], environment
        done = subprocess.run(["bash", "-c", f'{first} && exec "$@"', "bash", sys.executable, str(DOCTOR), *self.words], env=environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, check=False)
        self.status, self.text, self.errors = done.returncode, done.stdout, done.stderr

    def faults(self):
        return re.findall(r"^FAULT +(\S.*?)  ", self.text, re.M)

    def checks(self):
        return re.findall(CHECK, self.text, re.M)

    def cause(self):
        return " ".join(re.search(r"^Cause: (.+?)\nRun:", self.text, re.S | re.M)[1].split())

    def command(self):
        return re.search(r"^Run:   (.+)$", self.text, re.M)[1]

    def names(self, fault, cause):
        """Self, whose first fault is the one of this line, with these words for the cause."""
        assert self.status == 1 and self.faults()[:1] == [fault], self.text + self.errors
        assert re.search(cause, self.cause()), self.text
        return self

    def is_mended(self):
        """The command runs in the same shell, and the doctor finds no fault then."""
        after = Answer(self.words, self.environment, self.command())
        assert after.status == 0 and "\nHealthy: " in after.text and not after.faults(), f"{self.text}\n{after.text}{after.errors}"


def doctor(*words, **changes):
    return Answer(words, surroundings(**changes))


def raw(*words, **changes):
    """With the lmp behind build/lmp, which loads a plugin of LAMMPS_PLUGIN_PATH only."""
    return doctor("--lmp", LMP, *words, **changes)


def replaced(source, target, *pairs):
    """A copy with other bytes of the same number; each must be there."""
    data = source.read_bytes()
    for old, new in pairs:
        assert len(old) == len(new) and old in data, f"{source} has no {old}"
        data = data.replace(old, new)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(data)
    target.chmod(0o755)
    return target


def copy_of_lmp(target, folder):
    """lmp, which looks for its library in a folder that is no longer to write than the real one."""
    return replaced(LMP, target, (BUILT.encode(), folder.encode() + b"/" * (len(BUILT) - len(folder))))


@pytest.fixture(scope="module")
def real():
    """Help of the LAMMPS of the build."""
    return tool.parse_help(tool.run([LMP, "-h"])[1])


def lammps_of_year(year, real, folder):
    """The folder, with the real LAMMPS in it whose release says this year."""
    name = " ".join(real.release.split()[:3])
    replaced(LMP.parent / "liblammps.so.0", folder / "liblammps.so.0", (name.encode(), (name[:-4] + year).encode()))
    copy_of_lmp(folder / "lmp", "$ORIGIN")
    return folder


@pytest.fixture(scope="module")
def older(real, tmp_path_factory):
    """Folder of a LAMMPS of another release."""
    return lammps_of_year("2021", real, tmp_path_factory.mktemp("older"))


@pytest.fixture(scope="module")
def newer(real, tmp_path_factory):
    """Folder of a LAMMPS of another release, without a function that the plugin needs: its symbol has no place in the library."""
    folder = lammps_of_year("2099", real, tmp_path_factory.mktemp("newer"))
    library = folder / "liblammps.so.0"
    listed = subprocess.run(["nm", "-DS", library], stdout=subprocess.PIPE, text=True, check=True).stdout
    place, size = re.search(f"^(\\w+) (\\w+) T {ABSENT}$", listed, re.M).groups()
    return replaced(library, library, (struct.pack("=QQ", int(place, 16), int(size, 16)), bytes(16))).parent


ABSENT = "_ZN9LAMMPS_NS6Output8reset_dtEv"
STRANGER = """
#include "host_guard.h"
{include}
extern "C" void lammpsplugin_init(void *lmp, void *, void *)
{{
  refuse_wrong_host(lmp);
}}
"""


@pytest.fixture(scope="module")
def strangers(real, tmp_path_factory):
    """{name: plugin} built for another release, MPI or integer size; `silent` is of another release and has no facts."""
    headers = pathlib.Path(tool.entry_of(LMP.parent / "CMakeCache.txt", "CMAKE_HOME_DIRECTORY")).parent / "src"
    wrapper = tool.entry_of(LMP.parent / "CMakeCache.txt", "MPI_CXX_COMPILER")
    shown = subprocess.run([wrapper, "-show"], stdout=subprocess.PIPE, text=True, check=True).stdout
    mpi = [word for word in shown.split() if word.startswith("-I")]
    release, other = f"-DEVP_LAMMPS_VERSION={tool.release_number(real.release)}", "-DEVP_LAMMPS_VERSION=20240829"
    same, others = ("-DLAMMPS_BIGBIG", "-DLAMMPS_SMALLBIG")[:: 1 if real.integers == "bigbig" else -1]
    flags = {
        "release": [*mpi, same, other],
        "silent": [*mpi, same, other, "-DNO_FACTS"],
        "serial": [f"-I{headers / 'STUBS'}", same, release],
        "mpich": [*mpi, same, release, '-DMPICH_VERSION="4.0.2"', "-DEVP_MPI_COMM_BYTES=4"],
        "integers": [*mpi, others, release],
    }

    def compile_one(name):
        folder = tmp_path_factory.mktemp(name)
        text = STRANGER.format(include="" if name == "silent" else '#include "plugin_facts.h"')
        (folder / "stranger.cpp").write_text(text, encoding="utf-8")
        subprocess.run([os.environ.get("CXX", "g++"), "-std=c++17", "-O0", "-shared", "-fPIC", "-DOMPI_SKIP_MPICXX", *flags[name],
                        f"-I{REPOSITORY / 'src' / 'lammps'}", f"-I{headers}", "stranger.cpp", "-o", "evpplugin.so"], cwd=folder, check=True)
        return folder / "evpplugin.so"

    with ThreadPoolExecutor(2) as pool:
        return dict(zip(flags, pool.map(compile_one, flags)))


def test_healthy_with_two_ranks():
    found = doctor(EVP_LMP=WRAPPER, EVP_MPIRUN="mpirun")
    assert found.status == 0 and not found.faults() and not found.errors, found.text + found.errors
    assert "\nHealthy: lmp loads the plugin and knows pair_style evp/lj. Not checked: log.\n" in found.text
    assert re.search(r"^ok +mpirun .*two ranks$", found.text, re.M) and str(LMP) in found.text


def test_healthy_by_plugin_load():
    found = raw("--plugin", PLUGIN)
    assert found.status == 0 and f"a deck must begin with: plugin load {PLUGIN}" in found.text and f"{PLUGIN}, by `plugin load`: version " in found.text, found.text


@pytest.mark.parametrize("place, cause", [
    ("", "LAMMPS_PLUGIN_PATH is not set: "), ("{0}/moreplugin.so", "is a file, and must be the folder"), ("{0}/absent", "does not exist"), ("{0}", "holds no evpplugin.so")])
def test_path(tmp_path, place, cause):
    """The first is the example of the page."""
    (tmp_path / "moreplugin.so").write_bytes(b"")
    found = raw(LAMMPS_PLUGIN_PATH=place.format(tmp_path)).names("plugin path", cause)
    assert found.command() == f"export LAMMPS_PLUGIN_PATH={BUILD}" and found.faults() == ["plugin path"]
    if place:
        return
    found.is_mended()
    page = (REPOSITORY / "doc" / "Howto_evp_doctor.rst").read_text(encoding="utf-8").split(".. fault:")[1].split(".. end of fault")[0]
    assert found.checks() == re.findall(CHECK, page, re.M) and len(found.checks()) == 7, "run doc/studies/doctor_page.py"
    assert "\n   Run:   export LAMMPS_PLUGIN_PATH=~/evp/build\n" in page


@pytest.mark.parametrize("name, cause", [
    ("release", "built for another LAMMPS: release 20240829, not "), ("serial", "built for another LAMMPS: |cannot be opened: .*undefined symbol"),
    ("mpich", "built for another LAMMPS: "), ("integers", "built for another LAMMPS: ")])
def test_plugin_for_another_lammps(strangers, name, cause):
    """The words are those of the plugin, or of the loader."""
    found = raw(LAMMPS_PLUGIN_PATH=strangers[name].parent).names("plugin", cause)
    assert not tool.try_deck(LMP, strangers[name], alone=True).knows(), "control"
    assert found.command() == f"export LAMMPS_PLUGIN_PATH={BUILD}"
    if name == "integers":
        found.is_mended()


def test_plugin_without_facts(strangers):
    """An EVP older than its facts: its guard says what differs, also where it ends lmp at the start."""
    raw(LAMMPS_PLUGIN_PATH=strangers["silent"].parent).names("plugin", r"was built for another LAMMPS: release 20240829, not 20\d{6}\.")
    assert not tool.facts_of(strangers["silent"]) and tool.facts_of(strangers["release"]).startswith("version unknown, lammps 20240829, integers ")


def test_missing_symbol(tmp_path):
    needed = subprocess.run(["nm", "-D", "--undefined-only", PLUGIN], stdout=subprocess.PIPE, text=True, check=True).stdout.split()
    symbol = min(name for name in needed if name.startswith("_ZN9LAMMPS_NS5Error"))
    new = symbol.replace("LAMMPS_NS", "LAMMPS_XX")
    replaced(PLUGIN, tmp_path / "evpplugin.so", (b"\0" + symbol.encode() + b"\0", b"\0" + new.encode() + b"\0"))
    raw(LAMMPS_PLUGIN_PATH=tmp_path).names("plugin", rf"cannot be opened: .*undefined symbol: {new}\. It is damaged").is_mended()


@pytest.mark.parametrize("damage, cause", [("half", "cannot be opened|lmp ends at .*signal"), ("text", "cannot be opened: .*(invalid ELF header|file too short)"),
                                           ("link", "cannot be opened: .*Too many levels"), ("folder", "cannot be opened: .*Is a directory")])
def test_broken_file(tmp_path, damage, cause):
    """Also a link that leads to itself."""
    path = tmp_path / "evpplugin.so"
    if damage == "link":
        path.symlink_to("evpplugin.so")
    elif damage == "folder":
        path.mkdir()
    else:
        path.write_bytes({"half": PLUGIN.read_bytes()[:PLUGIN.stat().st_size // 2], "text": b"no library"}[damage])
    raw(LAMMPS_PLUGIN_PATH=tmp_path).names("plugin", cause).is_mended()


def is_alive(state):
    """Of a process by its file in /proc."""
    return state.exists() and state.read_text(encoding="utf-8").split()[2] != "Z"


def test_a_program_that_hangs_ends_with_all_that_it_has_started(tmp_path, monkeypatch):
    (tmp_path / "lmp").write_text(f"#!/bin/sh\nsh -c 'echo $$ >{tmp_path}/child; exec sleep 50'\n", encoding="utf-8")
    (tmp_path / "lmp").chmod(0o755)
    monkeypatch.setattr(tool, "SECONDS", 1)
    assert tool.run([tmp_path / "lmp"]) == (None, "no answer within 1 s")
    state = pathlib.Path("/proc", (tmp_path / "child").read_text(encoding="utf-8").strip(), "stat")
    deadline = time.monotonic() + 20  # of a kill on a busy machine
    while is_alive(state) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not is_alive(state)


def test_a_reader_that_leaves():
    text = subprocess.run(["bash", "-c", f"{sys.executable} {DOCTOR} | head -1; echo ${{PIPESTATUS[0]}}"], env=surroundings(EVP_LMP=WRAPPER), text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=True).stdout
    assert re.fullmatch(r"evp doctor: EVP .*\n141\n", text), text


def test_wrong_lmp_first_on_path(older):
    found = doctor(PATH=f"{older}:{BUILD}:{surroundings()['PATH']}").names("LAMMPS", f"the first lmp on PATH is {older}/lmp, .* it is LAMMPS .* 2021")
    assert found.command().startswith(f"export PATH={BUILD}")
    found.is_mended()


OTHER_RELEASE = f"{PLUGIN} .*cannot be opened: .*undefined symbol: {ABSENT}"


def test_lmp_that_the_plugin_was_built_for(newer):
    """Is still there: it is taken before anything is built. Not where the user has named an lmp."""
    path = f"{newer}:{surroundings()['PATH']}"
    found = doctor(PATH=path, LAMMPS_PLUGIN_PATH=BUILD).names("plugin", OTHER_RELEASE)
    assert found.command().startswith(f"export PATH={BUILD}$")  # and no more folders
    found.is_mended()
    found = doctor("--lmp", newer / "lmp", LAMMPS_PLUGIN_PATH=BUILD).names("plugin", OTHER_RELEASE)
    assert re.search(r"^cmake -S .* -B \S+/build-\w+2099-\w+-.* && cmake --build ", found.command()), found.command()


def test_no_plugin_for_this_lmp_and_no_path(newer):
    """Two faults: the cause is the one that the command mends."""
    cause = f"^LAMMPS_PLUGIN_PATH is not set, and {OTHER_RELEASE}"
    found = doctor(PATH=f"{newer}:{surroundings()['PATH']}").names("plugin path", cause)
    assert found.faults() == ["plugin path", "plugin"] and found.command().startswith(f"export PATH={BUILD}$")
    found.is_mended()
    assert " && cmake --build " in doctor("--lmp", newer / "lmp").names("plugin path", cause).command()


def test_command_evp_does_not_hide_the_lmp_of_the_user(older):
    """Other tools get EVP's own lmp from it, the doctor what the user's shell has."""
    for words, status, text in ((["doctor"], 1, f"the first lmp on PATH is {older}/lmp"), (["path", "plugin"], 0, str(BUILD))):
        environment = surroundings(PATH=f"{older}:{surroundings()['PATH']}", PYTHON=sys.executable)
        done = subprocess.run([BUILD / "evp", *words], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=False)
        assert done.returncode == status and text in " ".join(done.stdout.split()), done.stdout


def test_lmp_without_plugin_package(tmp_path):
    replaced(LMP.parent / "liblammps.so.0", tmp_path / "liblammps.so.0", (b"\0PLUGIN\0", b"\0PLUMED\0"))
    copy_of_lmp(tmp_path / "lmp", "$ORIGIN")
    doctor(EVP_LMP=tmp_path / "lmp", PATH=f"{BUILD}:{surroundings()['PATH']}").names("LAMMPS", "built without the PLUGIN package").is_mended()


def test_library_of_another_release(older):
    """All releases have liblammps.so.0, and LD_LIBRARY_PATH comes before the folder that lmp was linked for."""
    found = raw("--plugin", PLUGIN, LD_LIBRARY_PATH=older).names("LAMMPS", f"library of another LAMMPS: {older}/liblammps.so.0 .* in place of {BUILT}")
    found.is_mended()


def test_library_is_not_found(tmp_path):
    """As in an installation outside of the system's folders."""
    (tmp_path / "lib").mkdir()
    os.symlink(LMP.parent / "liblammps.so.0", tmp_path / "lib" / "liblammps.so.0")
    lmp = copy_of_lmp(tmp_path / "bin" / "lmp", "/no")
    doctor("--lmp", lmp, "--plugin", PLUGIN).names("lmp", f"does not find its own library liblammps.so.0, which is in {tmp_path}/lib").is_mended()


def test_lmp_is_no_program(tmp_path):
    doctor(EVP_LMP=tmp_path / "lmp").names("lmp", "which is no program").is_mended()
    (tmp_path / "lmp").write_text("#!/bin/sh\nexit 3\n", encoding="utf-8")
    (tmp_path / "lmp").chmod(0o755)
    doctor(EVP_LMP=tmp_path / "lmp").names("lmp", "is no LAMMPS that starts")


def test_plugin_twice(tmp_path):
    other = tmp_path / "evpplugin.so"
    other.write_bytes(PLUGIN.read_bytes() + b"\n")
    raw("--plugin", other, LAMMPS_PLUGIN_PATH=BUILD).names("plugin", f"loaded twice: lmp takes {PLUGIN}").is_mended()


def test_lammps_without_shared_library(real, monkeypatch):
    """Linked into one program that shows no symbols: here one without any library of LAMMPS."""
    report = tool.Report()
    text = f"Open of file {PLUGIN} failed: {PLUGIN}: undefined symbol: x"
    monkeypatch.setattr(tool, "try_deck", lambda *_, **__: tool.Trial(1, text, LMP, ""))
    monkeypatch.setattr(tool, "library_of", lambda exe: None)
    tool.check_plugin(report, tool.Host(LMP, "PATH", real, tool.Trial(1, text, LMP, str(BUILD)), LMP), None)
    assert [name for name, _, _ in report.faults] == ["plugin"] and "plugins need the shared library" in report.faults[0][1]
    assert report.faults[0][2] == f"cmake -DBUILD_SHARED_LIBS=on {BUILT} && cmake --build {BUILT}"


FOREIGN = """#!/bin/sh
# What the mpirun of another MPI does, as MPICH's with an lmp of Open MPI: each rank runs alone.
[ "$1" = --version ] && { echo 'HYDRA build details:'; echo '    Version: 4.0.2'; exit; }
shift 2
"$@"; "$@"
"""


def test_mpirun_of_another_mpi(tmp_path):
    (tmp_path / "mpirun").write_text(FOREIGN, encoding="utf-8")
    (tmp_path / "mpirun").chmod(0o755)
    found = doctor(EVP_LMP=WRAPPER, EVP_MPIRUN="mpirun", PATH=f"{tmp_path}:{surroundings()['PATH']}")
    found.names("mpirun", r"mpirun is of another MPI .MPICH. than lmp .Open MPI").is_mended()
    found = doctor(EVP_LMP=WRAPPER, EVP_MPIRUN=tmp_path / "mpirun").names("mpirun", "is of another MPI")
    assert found.command() == f"export EVP_MPIRUN={shutil.which('mpirun')}"


@pytest.mark.parametrize("script, chosen, cause, command", [
    ("echo mpiexec.hydra: no libslurm >&2; exit 127", "{}", "mpirun does not start: mpiexec.hydra: no libslurm", None),
    ("exit 1", "{}", "mpirun does not start: no output, exit status 1", None),
    ("", "it's", "EVP_MPIRUN is no command of a shell: No closing quotation", "unset EVP_MPIRUN")])
def test_mpirun_that_does_not_start(tmp_path, script, chosen, cause, command):
    (tmp_path / "mpirun").write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    (tmp_path / "mpirun").chmod(0o755)
    found = doctor(EVP_LMP=WRAPPER, EVP_MPIRUN=chosen.format(tmp_path / "mpirun")).names("mpirun", cause)
    assert command in (None, found.command())
    if script:
        found.is_mended()


def test_mpirun_as_root():
    """Open MPI refuses root, and nobody else."""
    environment = {name: value for name, value in surroundings(EVP_LMP=WRAPPER, EVP_MPIRUN="mpirun").items() if not name.startswith("OMPI_ALLOW")}
    found = Answer([], environment)
    if os.geteuid():
        assert found.status == 0, found.text
    else:
        found.names("mpirun", "does not run as root").is_mended()
    del environment["EVP_MPIRUN"]
    found = Answer([], environment)
    assert found.status == 0 and not found.faults() and "\nHealthy: " in found.text, found.text
    if not os.geteuid():
        assert re.search(r"^note +mpirun .*export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1$", found.text, re.M), found.text


def run_of(tmp_path, deck, **changes):
    """log.lammps of the real lmp, without any plugin on its path."""
    (tmp_path / "in.lmp").write_text(deck, encoding="utf-8")
    subprocess.run([LMP, "-in", "in.lmp"], cwd=tmp_path, env=surroundings(**changes), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    return tmp_path / "log.lammps"


@pytest.mark.parametrize("deck, path, cause", [
    ("pair_style evp/lj\n", "", "it loaded no plugin: LAMMPS_PLUGIN_PATH was not set"),
    ("pair_style evp/lj\n", "/tmp", "it loaded no plugin: it says 'Loaded 0 plugins from /tmp/?', and the deck"),
    ("plugin load evpplugin.so\npair_style evp/lj\n", "", "the file of `plugin load` did not open: .*No such file"),
    ("plugin load /no/evpplugin.so\nfix 1 all evp/bonds\n", "", "the file of `plugin load` did not open: .*No such file"),
    ("no_such_command\n", "", None)])
def test_log(tmp_path, deck, path, cause):
    """The last one is no fault of the installation."""
    found = raw("--log", run_of(tmp_path, deck, **({"LAMMPS_PLUGIN_PATH": tmp_path} if path else {})), LAMMPS_PLUGIN_PATH=BUILD)
    if cause is None:
        assert found.status == 0 and "no fault of the installation; it ends with: ERROR: Unknown command" in found.text, found.text
        return
    found.names("log", cause.replace("/tmp", str(tmp_path)))
    assert found.faults() == ["log"] and found.command() == f"export LAMMPS_PLUGIN_PATH={BUILD}"


def test_log_names_the_plugin(tmp_path):
    """The doctor looks at the file of the deck. Where lmp crashes at it, LAMMPS leaves nothing of that in the log."""
    path = tmp_path / "my_plugin.so"
    path.write_bytes(b"no library, though longer than the head of one" * 9)
    found = raw("--log", run_of(tmp_path, f"plugin load {path}\npair_style evp/lj\n")).names("plugin", f"{path} cannot be opened: .*invalid ELF header")
    assert found.faults() == ["plugin", "log"], found.text
    path.write_bytes(PLUGIN.read_bytes()[:5000])
    log = run_of(tmp_path, f"plugin load {path}\n")
    log.write_text(re.sub("^(Open of|Total wall).*\n", "", log.read_text(encoding="utf-8"), flags=re.M), encoding="utf-8")
    assert "it breaks off without an error: lmp crashed or was stopped" in raw("--log", log, LAMMPS_PLUGIN_PATH=BUILD).text


def test_log_of_another_lmp(tmp_path, older):
    log = run_of(tmp_path, "pair_style evp/lj\n")
    text = log.read_text(encoding="utf-8")
    log.write_text(re.sub(r"^LAMMPS \(.*", "LAMMPS (29 Sep 2021 - Update 2)", text), encoding="utf-8")
    raw("--log", log, LAMMPS_PLUGIN_PATH=BUILD).names("log", r"by another lmp than \S+, LAMMPS .29 Sep 2021")


def test_package_that_a_deck_needs(real, tmp_path):
    """A style of a package that this build leaves out."""
    assert "PERI" not in real.packages, "control"
    found = raw("--log", run_of(tmp_path, "pair_style peri/pmb\n"), LAMMPS_PLUGIN_PATH=BUILD).names("log", "uses peri/pmb of LAMMPS' package PERI")
    assert found.faults() == ["log"] and found.command() == f"cmake -DPKG_PERI=on {BUILT} && cmake --build {BUILT}"


def test_python_modules(monkeypatch):
    """No Python of this machine has them: the doctor speaks all the same, and without numpy."""
    monkeypatch.setattr(tool, "MODULES", ("numpy", "no_such_module"))
    report = tool.Report()
    tool.check_python(report)
    assert [name for name, _, _ in report.faults] == ["Python"] and "no_such_module" in report.faults[0][2]
    bare = subprocess.run([sys.executable, "-S", DOCTOR, "--lmp", LMP, "--plugin", PLUGIN], env=surroundings(), stdout=subprocess.PIPE, text=True, check=False)
    assert bare.returncode == 0 and "lacks numpy, scipy, matplotlib; the tools go on in " in bare.stdout, bare.stdout


def host_of(exe, real):
    return tool.Host(exe, "PATH", real, tool.Trial(1, "", exe, ""), exe)


def test_build_for_this_lammps(real, tmp_path):
    """The command for a LAMMPS that no plugin here fits, as far as it is quick."""
    command = tool.build_for(host_of(LMP, real))
    configure, build, take = command.split(" && ")
    folder = re.search(r" -B (\S+)", configure)[1]
    assert build == f"cmake --build {folder} --target evpplugin" and take == f"export LAMMPS_PLUGIN_PATH={folder}" and "/path/to" not in command
    done = subprocess.run(configure.replace(folder, str(tmp_path / "build")), shell=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 0 and f"LAMMPS {' '.join(real.release.split()[:3])} (" in done.stdout, done.stdout


def test_build_for_an_installed_lammps(real, tmp_path):
    """Its headers are too few: the command asks for the source tree, and the cause says what that is."""
    config = tmp_path / "lib" / "cmake" / "LAMMPS" / "LAMMPSConfig.cmake"
    config.parent.mkdir(parents=True)
    config.touch()
    report = tool.Report()
    report.fault("plugin", "none", "there is none.", tool.build_for(host_of(tmp_path / "bin" / "lmp", real)))
    verdict = report.verdict()
    assert f" -DCMAKE_PREFIX_PATH={tmp_path} -DLAMMPS_SOURCE_DIR=/path/to/lammps && " in verdict
    assert "/path/to/lammps stands for the unpacked source tree of the same LAMMPS release" in " ".join(verdict.split("Run:")[0].split())


def test_plugins_of_the_source_tree(tmp_path, monkeypatch):
    """A build folder may have any name; those of an installation's source tree count where they still exist."""
    tree, root = tmp_path / "evp", tmp_path / "prefix" / "share" / "evp"
    for name in ("CMakeLists.txt", "cmake/EvpInstall.cmake", "build4feb/evpplugin.so", "docs/other.so"):
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / name).touch()
    for name in ("EVP_BUILD", "EVP_PLUGINS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(tool, "ROOT", tree)
    assert tool.own_files(tool.NAME) == [tree / "build4feb" / "evpplugin.so"] and tool.source_tree() == tree
    root.mkdir(parents=True)
    monkeypatch.setattr(tool, "ROOT", root)
    monkeypatch.setattr(tool, "RECORD", root / "installed_from.txt")
    assert tool.source_tree() is None
    tool.RECORD.write_text(f"source={tree}\nbuild={tmp_path / 'gone'}\n", encoding="utf-8")
    assert tool.source_tree() == tree and tool.own_files(tool.NAME) == [tree / "build4feb" / "evpplugin.so"]
    shutil.move(tree, tmp_path / "moved")
    assert tool.source_tree() is None and not tool.own_files(tool.NAME)


def test_wrong_use():
    for words in (["--lmp", "/no/lmp"], ["--plugin", "/no/evpplugin.so"], ["--log", "/no/log.lammps"], ["--log", DOCTOR], ["--no-such"]):
        found = in_process.call(tool.main, *words)
        assert found.returncode == 2 and not found.stdout and len(found.stderr.splitlines()) <= 3, found.stderr


def test_doctor_is_a_program():
    assert DOCTOR.stat().st_mode & stat.S_IXUSR


# The first lines of Debian's own lmp, and others that name their MPI in other ways.
DEBIAN = """
Large-scale Atomic/Molecular Massively Parallel Simulator - 29 Sep 2021 - Update 2

Compiler: GNU C++ 12.2.0 with OpenMP 4.5
MPI v3.1: Open MPI v4.1.4, package: Debian OpenMPI, ident: 4.1.4, repo rev: v4.1.4, May 26, 2022

-DLAMMPS_SMALLBIG
sizeof(tagint):   32-bit

Installed packages:

ASPHERE GRANULAR KIM
SHOCK SRD VORONOI

List of individual style options included in this LAMMPS executable
"""


def test_help_of_other_builds():
    found = tool.parse_help(DEBIAN)
    assert found.mpi == "Open MPI 4.1.4" and found.packages == ("ASPHERE", "GRANULAR", "KIM", "SHOCK", "SRD", "VORONOI")
    assert found.lacks() == "it is LAMMPS 29 Sep 2021 - Update 2, and EVP needs 4 Feb 2025 or later"
    serial = DEBIAN.replace("MPI v3.1: Open MPI v4.1.4, package: Debian OpenMPI", "MPI v1.0: LAMMPS MPI STUBS for LAMMPS version 4 Feb 2025")
    assert tool.parse_help(serial.replace("SMALLBIG", "BIGBIG")).words() == "LAMMPS 29 Sep 2021 - Update 2, bigbig, no MPI, GNU C++ 12.2.0"
    assert tool.mpi_kind("Intel(R) MPI Library 2021.9 for Linux* OS") == "MPICH" and tool.mpi_kind("a new one") == "unknown"
    assert tool.parse_help("lmp: not found") is None
