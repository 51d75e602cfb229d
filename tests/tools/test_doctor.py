# SPDX-License-Identifier: GPL-2.0-only
"""evp doctor names the cause of each fault that is planted here, and its command mends it: copies of the real LAMMPS with other bytes in its library, and the
plugin that the build makes under a false flag."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import doctor as tool
import pytest
from inputs import BUILD, cache_entry, call, program

ROOT = pathlib.Path(tool.ROOT)
DOCTOR, WRAPPER, PLUGIN = ROOT / "tools" / "doctor.py", BUILD / "lmp", BUILD / "evpplugin.so"
FORGED = BUILD / "forged" / PLUGIN.name  # built for another release, integer size and MPI, see tests/CMakeLists.txt
BUILT = cache_entry("LAMMPS_BUILD_DIR")
LMP = pathlib.Path(BUILT) / "lmp"
TAKE_PLUGIN = f"export LAMMPS_PLUGIN_PATH={BUILD}"
NO_MPIRUN = "no_mpirun_here"  # where mpirun is not looked at: a start takes as long as all the rest
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
        self.faults, paragraph = re.findall(r"^FAULT +(\S.*?)  ", self.text, re.M), re.search(r"^Cause: (.+?)\nRun:   (.+)$", self.text, re.S | re.M)
        self.cause, self.command = (" ".join(paragraph[1].split()), paragraph[2].partition("\n")[0]) if paragraph else ("", "")

    def names(self, fault, cause):
        """Self, whose first fault is the one of this line, with these words for the cause."""
        assert self.status == 1 and self.faults[:1] == [fault] and re.search(cause, self.cause), self.text + self.errors
        return self

    def is_mended(self):
        """The command runs in the same shell, and the doctor finds no fault then."""
        after = Answer(self.words, self.environment, self.command)
        assert after.status == 0 and "\nHealthy: " in after.text and not after.faults, f"{self.text}\n{after.text}{after.errors}"


def doctor(*words, **changes):
    return Answer(words, surroundings(**changes))


def raw(*words, **changes):
    """With the lmp behind build/lmp, which loads a plugin of LAMMPS_PLUGIN_PATH only."""
    return doctor("--lmp", LMP, *words, **changes)


def replaced(source, target, old, new):
    """A copy with other bytes of the same number."""
    data = source.read_bytes()
    assert len(old) == len(new) and old in data, f"{source} has no {old}"
    target.write_bytes(data.replace(old, new))
    target.chmod(0o755)
    return target


def copy_of_lmp(target, folder):
    """lmp, which looks for its library in a folder that is no longer to write than the real one."""
    return replaced(LMP, target, BUILT.encode(), folder.encode() + b"/" * (len(BUILT) - len(folder)))


REAL = tool.lammps_of(LMP, tool.run([LMP, "-h"])[1])
DATE = " ".join(REAL.release.split()[:3])


def another_lammps(folder, old, new):
    """The folder, with lmp in it and a library with other bytes."""
    replaced(LMP.parent / "liblammps.so.0", folder / "liblammps.so.0", old, new)
    copy_of_lmp(folder / "lmp", "$ORIGIN")
    return folder


@pytest.fixture(scope="module")
def older(tmp_path_factory):
    """Folder of a LAMMPS that says that it is too old."""
    return another_lammps(tmp_path_factory.mktemp("older"), DATE.encode(), (DATE[:-4] + "2021").encode())


def test_healthy_with_two_ranks():
    found = doctor(EVP_LMP=WRAPPER, EVP_MPIRUN="mpirun")
    assert found.status == 0 and not found.faults and not found.errors, found.text + found.errors
    assert "\nHealthy: lmp loads the plugin and knows pair_style evp/lj.\n" in found.text
    assert re.search(r"^ok +mpirun .*two ranks$", found.text, re.M), found.text


@pytest.mark.parametrize("place, cause", [
    ("", "LAMMPS_PLUGIN_PATH is not set: "), ("{0}/moreplugin.so", "names no folder with"), ("{0}/absent", "names no folder with"),
    ("{0}", "names no folder with")])
def test_path(tmp_path, place, cause):
    """The first is the example of the page."""
    (tmp_path / "moreplugin.so").write_bytes(b"")
    found = raw(LAMMPS_PLUGIN_PATH=place.format(tmp_path)).names("plugin path", cause)
    assert found.command == TAKE_PLUGIN and found.faults == ["plugin path"]
    if place:
        return
    found.is_mended()
    page = (ROOT / "doc" / "install.rst").read_text(encoding="utf-8").split(".. fault:")[1].split(".. end of fault")[0]
    checks = [re.findall(r"^ *(?:ok|note|FAULT|not checked)  +(\S.*?)  ", text, re.M) for text in (found.text, page)]
    assert checks[0] == checks[1] and len(checks[0]) == 5, "run doc/studies/doctor_page.py"
    assert "\n   Run:   export LAMMPS_PLUGIN_PATH=~/evp/build\n" in page


def test_plugin_for_another_lammps():
    """The words are those of the plugin."""
    found = raw(LAMMPS_PLUGIN_PATH=FORGED.parent).names("plugin", "built for another LAMMPS: release 20990101, not ")
    assert found.command == TAKE_PLUGIN and re.match(r"version \S+, lammps 20990101, integers ", tool.facts_of(FORGED))


@pytest.mark.parametrize("content, cause", [
    (lambda: PLUGIN.read_bytes()[:PLUGIN.stat().st_size // 2], "cannot be opened|lmp ends at .*signal"),
    (lambda: b"no library", "cannot be opened: .*(invalid ELF header|file too short)"),
    (lambda: re.sub(rb"\0_ZN9LAMMPS_NS(5Error\w+\0)", rb"\0_ZN9LAMMPS_XX\1", PLUGIN.read_bytes()), r"version \d.* cannot be opened: .*undefined symbol: _ZN9LAMMPS_XX\w+\. It is damaged"),
    (None, "cannot be opened: .*Is a directory")], ids=["half", "text", "symbol", "folder"])
def test_damaged_plugin(tmp_path, content, cause):
    path = tmp_path / tool.NAME
    if content:
        path.write_bytes(content())
    else:
        path.mkdir()
    raw(LAMMPS_PLUGIN_PATH=tmp_path).names("plugin", cause).is_mended()


def test_a_program_that_hangs_ends_with_all_that_it_has_started(tmp_path, monkeypatch):
    monkeypatch.setattr(tool, "SECONDS", 1)
    assert tool.run([program(tmp_path / "lmp", f"sh -c 'echo $$ >{tmp_path}/child; exec sleep 50'")]) == (None, "no answer within 1 s")
    state = pathlib.Path("/proc", (tmp_path / "child").read_text(encoding="utf-8").strip(), "stat")
    deadline = time.monotonic() + 20  # of a kill on a busy machine
    while (alive := state.exists() and state.read_text(encoding="utf-8").split()[2] != "Z") and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive


def test_a_reader_that_leaves():
    text = subprocess.run(["bash", "-c", f"{DOCTOR} | head -1; echo ${{PIPESTATUS[0]}}"], env=surroundings(EVP_LMP=WRAPPER), text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=True).stdout
    assert re.fullmatch(r"evp doctor: EVP .*\n141\n", text), text


def test_lmp_that_is_too_old(older):
    """By the command evp, too: other tools get EVP's own lmp from it, the doctor what the user's shell has."""
    found = doctor(PATH=f"{older}:{surroundings()['PATH']}").names("LAMMPS", f"the first lmp on PATH is {older}/lmp, .* it is LAMMPS .* 2021")
    assert found.command.startswith(f"export PATH={BUILD}$")
    found.is_mended()
    for words, status, text in ((["doctor"], 1, f"the first lmp on PATH is {older}/lmp"), (["path", "plugin"], 0, str(BUILD))):
        environment = surroundings(PATH=f"{older}:{surroundings()['PATH']}", PYTHON=sys.executable)
        done = subprocess.run([BUILD / "evp", *words], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=False)
        assert done.returncode == status and text in " ".join(done.stdout.split()), done.stdout


def test_lmp_without_plugin_package(tmp_path):
    another_lammps(tmp_path, b"\0PLUGIN\0", b"\0PLUMED\0")
    doctor(EVP_LMP=tmp_path / "lmp").names("LAMMPS", "built without the PLUGIN package").is_mended()


def test_no_plugin_for_this_lmp(tmp_path):
    """It lacks a function that the plugin needs: the command builds one. So it does where LAMMPS_PLUGIN_PATH is not set, too."""
    another_lammps(tmp_path, b"\0_ZN9LAMMPS_NS6Output8reset_dtEv\0", b"\0_ZN9LAMMPS_XX6Output8reset_dtEv\0")
    why = f"{PLUGIN} .*cannot be opened: .*undefined symbol: _ZN9LAMMPS_NS6Output8reset_dtEv"
    for path, fault, cause in ((BUILD, "plugin", why), ("", "plugin path", f"^LAMMPS_PLUGIN_PATH is not set, and {why}")):
        found = doctor("--lmp", tmp_path / "lmp", LAMMPS_PLUGIN_PATH=path).names(fault, cause)
        assert re.search(r"^cmake -S .* -B \S+/build-\w+-\w+ .* && cmake --build ", found.command), found.command
        assert "/path/to/lammps stands for the source tree of this LAMMPS" in found.cause


def test_library_of_another_release(older):
    """All releases have liblammps.so.0, and LD_LIBRARY_PATH comes before the folder that lmp was linked for."""
    found = raw("--plugin", PLUGIN, LD_LIBRARY_PATH=older).names("LAMMPS", f"library of another LAMMPS: {older}/liblammps.so.0 .* in place of {BUILT}")
    found.is_mended()


def test_library_is_not_found(tmp_path):
    """As in an installation outside of the system's folders."""
    lmp = copy_of_lmp(tmp_path / "lmp", "/no")
    found = doctor("--lmp", lmp).names("lmp", r"is no LAMMPS that starts on this machine: .*liblammps\.so\.0")
    assert found.command.startswith("export LD_LIBRARY_PATH=/path/to/the/folder/of/liblammps.so.0$")


def test_lmp_is_no_program(tmp_path):
    for cause in ("No such file", "no output"):
        doctor(EVP_LMP=tmp_path / "lmp").names("lmp", f"{tmp_path}/lmp is no LAMMPS that starts on this machine: .*{cause}").is_mended()
        program(tmp_path / "lmp", "exit 3")


def test_plugin_twice(tmp_path):
    other = tmp_path / "evpplugin.so"
    other.write_bytes(PLUGIN.read_bytes() + b"\n")
    raw("--plugin", other, LAMMPS_PLUGIN_PATH=BUILD).names("plugin", f"loaded twice: lmp takes {PLUGIN}").is_mended()


FOREIGN = """# What the mpirun of another MPI does, as MPICH's with an lmp of Open MPI: each rank runs alone.
[ "$1" = --version ] && { echo 'HYDRA build details:'; echo '    Version: 4.0.2'; exit; }
shift 2
"$@"; "$@"
"""


@pytest.mark.parametrize("script, cause", [
    (FOREIGN, r"mpirun is of another MPI .HYDRA build details. than lmp .Open MPI v\d"),
    ("echo mpiexec.hydra: no libslurm >&2; exit 127", r"does not start lmp .*: mpiexec.hydra: no libslurm"),
    ("exit 1", r"does not start lmp .*: no output")], ids=["foreign", "broken", "silent"])
def test_mpirun(tmp_path, script, cause):
    found = doctor(EVP_LMP=WRAPPER, EVP_MPIRUN=f"{program(tmp_path / 'mpirun', script)} -np").names("mpirun", cause)
    assert found.command.startswith("export EVP_MPIRUN=/path/to/mpirun   # of Open MPI")


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
    assert found.status == 0 and not found.faults and "\nHealthy: " in found.text, found.text
    if not os.geteuid():
        assert re.search(r"^note +mpirun .*export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1$", found.text, re.M), found.text


def test_python_without_numpy():
    """The doctor speaks there, too: here of a plugin that is healthy by `plugin load`."""
    words = [sys.executable, "-S", DOCTOR, "--lmp", LMP, "--plugin", PLUGIN]
    bare = subprocess.run(words, env=surroundings(), stdout=subprocess.PIPE, text=True, check=False)
    assert bare.returncode == 0 and re.match(r"evp doctor: EVP .*, Python \d[.\d]+\n", bare.stdout), bare.stdout
    assert f"a deck must begin with: plugin load {PLUGIN}" in bare.stdout and f"{PLUGIN}, by `plugin load`: version " in bare.stdout


def test_plugins_of_the_source_tree(tmp_path, monkeypatch):
    """Those of an installation's source tree count where it still exists."""
    tree, plugin = tmp_path / "evp", tmp_path / "evp" / "build4feb" / tool.NAME
    for path in (tree / "cmake" / "EvpInstall.cmake", plugin):
        program(path, "")
    for name in ("EVP_BUILD", "EVP_PLUGINS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(tool, "ROOT", tmp_path / "prefix" / "share" / "evp")
    monkeypatch.setattr(tool, "RECORD", tmp_path / "record.txt")
    tool.RECORD.write_text(f"source={tree}\nbuild={tmp_path / 'gone'}\n", encoding="utf-8")
    assert tool.source_tree() == tree and tool.own_files(tool.NAME) == [plugin]
    shutil.move(tree, tmp_path / "moved")
    assert not tool.own_files(tool.NAME) and tool.another_lmp() == "/path/to/evp/tools/setup.sh"


def test_wrong_use():
    for words in (["--lmp", "/no/lmp"], ["--plugin", "/no/evpplugin.so"], ["--no-such"]):
        found = call(tool.main, *words)
        assert found.returncode == 2 and not found.stdout and len(found.stderr.splitlines()) <= 3, found.stderr


def test_a_build_folder_that_was_moved_or_copied_with_its_checkout(tmp_path):
    """Is a fault, though another lmp is healthy; the command removes it, and calls set-up. By a link it is the same folder."""
    for name in ("tools", "cmake"):
        shutil.copytree(ROOT / name, tmp_path / "evp" / name)
    cache, words = tmp_path / "evp" / "build" / "CMakeCache.txt", [sys.executable, str(tmp_path / "evp" / "tools" / "doctor.py"), "--lmp", str(WRAPPER)]
    cache.parent.mkdir()
    for made, fault in ((BUILD, True), (tmp_path / "gone", True), (tmp_path / "link", False), (cache.parent, False)):
        cache.write_text(f"CMAKE_CACHEFILE_DIR:INTERNAL={made}\n", encoding="utf-8")
        (tmp_path / "link").is_symlink() or (tmp_path / "link").symlink_to(cache.parent)
        done = subprocess.run(words, env=surroundings(), capture_output=True, text=True, check=False)
        assert done.returncode == fault and ("\nHealthy: " in done.stdout) != fault, done.stdout
        if fault:
            assert f"Cause: {cache.parent} was made as {made}, and moved or copied since" in " ".join(done.stdout.split())
            assert f"\nRun:   rm -r {cache.parent} && {tmp_path}/evp/tools/setup.sh\n" in done.stdout
