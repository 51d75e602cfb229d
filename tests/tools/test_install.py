# SPDX-License-Identifier: GPL-2.0-only
"""What `cmake --install` makes runs from any folder, also when moved; uninstall leaves only what was there before. packaging/: the check of an
installed plugin, conda's build script and its test, one version everywhere.

The plugin is that of the build under test: nothing is compiled here."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest
from evp import __main__ as command
from evp import __version__, require
from evp.run import CHECKOUT as REPOSITORY
from inputs import BUILD, cache_entry, program, snapshot

LAMMPS = pathlib.Path(cache_entry("LAMMPS_BUILD_DIR"))
PREFIX = "/opt/evp of mine"
PLUGINS = "lib/lammps/plugins"
LEFT_OUT = ("EVP_", "LAMMPS_", "DESTDIR", "PYTHON")  # of the environment: what would change where things are found
KEPT = {name: value for name, value in os.environ.items() if not name.startswith(LEFT_OUT)}


def start(*words, folder=None, status=0, **environment):
    """All that a command printed; it must end with this status."""
    words = [str(word) for word in words]
    done = subprocess.run(words, cwd=folder, env={**KEPT, **{name: str(value) for name, value in environment.items()}}, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", timeout=120, check=False)
    assert done.returncode == status, f"{words}: exit {done.returncode}\n{done.stdout}"
    return done.stdout


def everything(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """An installation that was staged by DESTDIR, then moved."""
    folder = tmp_path_factory.mktemp("install")
    text = start("cmake", "--install", BUILD, "--prefix", PREFIX, DESTDIR=folder / "stage", EVP_RECORD=folder / "record")
    assert f"cmake --build {BUILD} --target uninstall" in text
    assert os.listdir(folder / "stage") == ["opt"]
    return shutil.move(str(folder / "stage") + PREFIX, folder / "moved")


@pytest.fixture(scope="module")
def evp(prefix):
    link = prefix.parent / "link"
    link.symlink_to(prefix / "bin" / "evp")
    return link


def test_what_is_installed(prefix):
    assert sorted(os.listdir(prefix)) == ["bin", "lib", "libexec", "share"]
    assert everything(prefix / "lib") == ["lammps", "lammps/plugins", "lammps/plugins/evpplugin.so"]
    share = prefix / "share" / "evp"
    assert {"LICENSE", "README.md", "doc", "lammps_inputs", "potentials", "tools"} <= set(os.listdir(share))
    assert (share / "tools" / "curves.py").read_bytes() == (REPOSITORY / "tools" / "curves.py").read_bytes()
    for kind, suffix in (("lammps_inputs", ""), ("potentials", ""), ("doc", ".rst"), ("doc", ".md"), ("tools/evp", ".py")):
        there = {path.name for path in (REPOSITORY / kind).iterdir() if path.is_file() and path.name.endswith(suffix) and not path.name.startswith((".", "log."))}
        assert there - set(os.listdir(share / kind)) == set(), kind
    source, build = (share / "installed_from.txt").read_text(encoding="utf-8").splitlines()
    assert (source, build) == (f"source={cache_entry('CMAKE_HOME_DIRECTORY')}", f"build={cache_entry('CMAKE_CACHEFILE_DIR')}"), "for the doctor"
    tools = {path.stem for path in (share / "tools").glob("*.py")}
    assert tools == {name for name in command.FOR_USERS if (REPOSITORY / "tools" / f"{name}.py").exists()} and "curves" in tools


def test_doctor_knows_the_build_of_an_installation(prefix, tmp_path):
    """Its plugin is taken where the installed one is gone (damaged ones: test_doctor.py)."""
    place = tmp_path / "my evp"
    shutil.copytree(prefix, place)
    plugin, lmp = place / PLUGINS / "evpplugin.so", LAMMPS / "lmp"
    plugin.unlink()
    shell = {"EVP_MPIRUN": "no_mpirun_here", "EVP_RECORD": tmp_path / "record", "LAMMPS_PLUGIN_PATH": plugin.parent}
    said = start(place / "bin" / "evp", "doctor", "--lmp", lmp, status=1, **shell)
    assert said.endswith(f"\nRun:   export LAMMPS_PLUGIN_PATH={BUILD}\n"), said
    start("bash", "-c", f'{said.split("Run:   ")[1].strip()} && exec "$@"', "bash", place / "bin" / "evp", "doctor", "--lmp", lmp, **shell)


def test_a_build_whose_files_were_moved_or_copied(tmp_path):
    """The sources are gone; or the build folder is a copy, whose evp and lmp would run what is in the other one. A copy or link of a script alone is none."""
    said = f" error: its build folder was made as {BUILD}, of the sources in {cache_entry('CMAKE_HOME_DIRECTORY')}; one of them was moved or copied, "
    gone = program(tmp_path / "evp", re.sub("^share=.+$", "share='/no/such/tree'", (BUILD / "evp").read_text(encoding="utf-8"), flags=re.M))
    assert start(gone, "--help", status=1).startswith("evp:" + said)
    copy, alone = tmp_path / "a copy" / "build", tmp_path / "alone"
    copy.mkdir(parents=True)
    alone.mkdir()
    for name in ("evp", "lmp", "CMakeCache.txt"):
        shutil.copy(BUILD / name, copy)
    for words in (("evp", "--version"), ("evp", "lmp", "-h"), ("lmp", "-h")):
        told = start(copy / words[0], *words[1:], status=1)
        assert told.startswith(words[0] + ":" + said) and told.endswith("remove the build folder and make it again, by tools/setup.sh or cmake\n")
    for name in ("evp", "lmp"):
        shutil.copy(BUILD / name, alone)
        (tmp_path / f"{name}_link").symlink_to(BUILD / name)
    for word in (alone / "evp", tmp_path / "evp_link"):
        assert start(word, "--version") == f"EVP {__version__}\n"
    for word in (alone / "lmp", tmp_path / "lmp_link"):
        assert "Massively Parallel Simulator" in start(word, "-h")
    (tmp_path / "linked").symlink_to(BUILD)
    assert "Massively Parallel Simulator" in start("bash", "-c", "cd linked && ./lmp -h && cd / && \"$OLDPWD\"/evp path", folder=tmp_path)


def test_only_one_symbol_is_seen_by_lammps():
    lines = start("nm", "-D", "--defined-only", BUILD / "evpplugin.so").splitlines()
    assert [line.split()[-1] for line in lines] == ["lammpsplugin_init"]


def test_decks(prefix, evp, tmp_path):
    """Without plugin load: by LAMMPS_PLUGIN_PATH and the host's own lmp, from a folder elsewhere, and by the command."""
    decks, plugins = (start(evp, "path", name).strip() for name in ("decks", "plugin"))
    assert plugins == str(prefix / PLUGINS)
    start(LAMMPS / "lmp", "-in", f"{decks}/in.two_spheres", folder=tmp_path, LAMMPS_PLUGIN_PATH=plugins, LD_LIBRARY_PATH=LAMMPS)
    log = (tmp_path / "log.lammps").read_text(encoding="utf-8")
    assert log.count(f"EVP {__version__} for LAMMPS ") == 1 and f"Loaded 1 plugins from {plugins}\n" in log and list(tmp_path.glob("*.csv"))
    (tmp_path / "in.lmp").write_text("pair_style evp/lj\n", encoding="utf-8")
    for own in ({}, {"EVP_LMP": LAMMPS / "lmp", "LD_LIBRARY_PATH": LAMMPS}):
        assert f"EVP {__version__} for LAMMPS " in start(evp, "lmp", "-in", "in.lmp", "-log", "none", folder=tmp_path, **own)


def test_the_command(prefix, evp, tmp_path):
    assert start(evp, "--version") == f"EVP {__version__}\n"
    assert start(sys.executable, "-m", "evp", "--version", PYTHONPATH=REPOSITORY / "tools") == f"EVP {__version__}\n"
    assert start(evp, "path").strip() == str(prefix / "share" / "evp")
    assert start(BUILD / "evp", "path", "plugin").strip() == str(BUILD)
    assert "evp: error: no tool 'bench'; the tools here are " in start(evp, "bench", status=2)
    assert "path takes one of decks, potentials" in start(evp, "path", "nowhere", status=2)


def listed(text, title):
    """Names of a list of the help."""
    part = re.search(rf"^{title}.*:\n((?:  .+\n)+)", text, re.M)
    return re.findall(r"^  (\S+(?: evp/\S+| \S+/evp)?)", part[1], re.M) if part else []


def test_the_help_lists_what_users_type(evp):
    """Of an installation all but the scripts, which are in the source tree; each tool explains itself."""
    source = REPOSITORY / "src" / "lammps"
    registered = set(re.findall(r'add\("\w+", "(\S+?)"', (source / "evpplugin.cpp").read_text(encoding="utf-8")))
    for command_of, scripts in ((evp, []), (BUILD / "evp", ["setup.sh", "quickstart.sh", "test.sh"])):
        text = start(command_of, "--help")
        assert listed(text, "Tools") == ["body", "calibrate", "cost", "curves", "doctor", "quickstart", "tool", "view"]
        assert listed(text, "Scripts") == scripts and listed(text, "Folders") == ["(none)", "decks", "potentials", "tools", "doc", "plugin"]
        assert listed(text, "Input scripts") == sorted(path.name for path in (REPOSITORY / "lammps_inputs").glob("in.*"))
        assert registered and {name.split()[-1] for name in listed(text, "Commands for LAMMPS")} == registered
    assert start(evp, "quickstart", "--help").startswith("usage: evp quickstart [-h]")


def test_a_tool_is_the_same_by_both_names(evp, tmp_path):
    """With its arguments, its exit code and, where the first python3 has no numpy, another Python."""
    rows = "".join(f"{1e-4 * k:g},{2e6 * k:g},{2e6 * k:g}\n" for k in range(60))
    (tmp_path / "a b.csv").write_text("strain,stress_grip,stress_virial\n" + rows, encoding="utf-8")
    bare = program(tmp_path / "bin" / "python3", f'exec {sys.executable} -S "$@"')
    shown = start(evp, "curves", "numbers", "a b.csv", folder=tmp_path, PYTHON=bare)
    assert shown == start(REPOSITORY / "tools" / "curves.py", "numbers", "a b.csv", folder=tmp_path) and "a b.csv       20" in shown
    assert "usage: evp curves " in start(evp, "curves", "--help") and "usage: curves.py " in start(REPOSITORY / "tools" / "curves.py", "--help")
    start(evp, "curves", "numbers", "absent.csv", folder=tmp_path, status=1)


def test_a_tool_finds_lammps(evp, tmp_path):
    """view.py draws with it."""
    (tmp_path / "a.dump").write_text(snapshot("id x y z radius", [(1, 0, 0, 0, 0.5)]), encoding="utf-8")
    start(evp, "view", "a.dump", "--pixels", 100, "--out", "a.png", folder=tmp_path)
    assert (tmp_path / "a.png").stat().st_size > 0


def test_missing_modules_are_named_with_their_packages(prefix, monkeypatch):
    monkeypatch.setattr("evp.TOOLS", prefix / "share" / "evp" / "tools")
    monkeypatch.setattr("evp.candidates", lambda environment: [])
    packages = "Debian: apt-get install python3-no_such python3-nor_this"
    with pytest.raises(SystemExit, match=rf"has no no_such, nor_this: install them \({packages}\), or give one: PYTHON="):
        require("numpy", "no_such", "nor_this")


@pytest.mark.parametrize("release, packages, words", [
    ("2 Aug 2023", "BPM PLUGIN", "is LAMMPS 2 Aug 2023, but the plugin was built for LAMMPS {release}. Put the folder of a LAMMPS {release} with the PLUGIN"),
    ("{release}", "BPM", "was built without the PLUGIN package"), ("{release}", "BPM PLUGIN", "runs"),
    (None, "", "no lmp found: the plugin was built for LAMMPS {release}")], ids=["release", "packages", "right", "none"])
def test_lmp_of_the_path(prefix, tmp_path, release, packages, words):
    """Where the LAMMPS that the plugin was built for is gone."""
    text = (prefix / "libexec" / "evp" / "lmp").read_text(encoding="utf-8")
    own = re.search(r"^release='(.+)'$", text, re.M)[1]
    wrapper = program(prefix / "libexec" / "evp" / f"lmp_of_{tmp_path.name}", re.sub("^lmp='.+'$", "lmp=''", text, flags=re.M))
    if release:
        program(tmp_path / "bin" / "lmp", f"""if [ "$*" = -h ]; then
printf '\\nLarge-scale Atomic/Molecular Massively Parallel Simulator - {release.format(release=own)}\\n\\nUsage\\nInstalled packages:\\n\\n{packages} \\n'
else echo "runs with $LAMMPS_PLUGIN_PATH, $*"; fi""")
    (tmp_path / "few").mkdir()
    for name in ("sh", "dirname", "readlink", "env", "tr"):  # what the script calls, and no lmp
        (tmp_path / "few" / name).symlink_to(shutil.which(name))
    runs = words == "runs"
    said = start(wrapper, "-in", "a b", status=0 if runs else 1, PATH=f"{tmp_path}/bin:{tmp_path}/few")
    assert said.startswith(f"runs with {prefix / PLUGINS}, -in a b" if runs else "ERROR: ") and words.format(release=own) in said


def test_uninstall_leaves_what_was_there(tmp_path):
    place, record = tmp_path / "a prefix", tmp_path / "record"
    program(place / "bin" / "other", "")
    (place / "share").mkdir()
    before = everything(place)
    for _ in range(2):  # an update knows what the first installation made
        start("cmake", "--install", BUILD, "--prefix", place, EVP_RECORD=record)
    start("cmake", "--install", BUILD, "--prefix", "/usr", EVP_RECORD=record, DESTDIR=tmp_path / "stage")
    start(place / "bin" / "evp", "curves", "--help")
    assert list((place / "share" / "evp" / "tools" / "evp").glob("__pycache__/*")) and (tmp_path / "stage" / "usr" / "bin" / "evp").exists(), "control"
    (place / "share" / "evp" / "potentials" / ".mine").write_text("", encoding="utf-8")
    said = start("cmake", "--build", BUILD, "--target", "uninstall", EVP_RECORD=record)
    assert f"left in place, since it has other files: {place}/share/evp/potentials" in said
    assert everything(place) == sorted([*before, "share/evp", "share/evp/potentials", "share/evp/potentials/.mine"])
    assert sorted(os.listdir(tmp_path)) == ["a prefix"], "neither the stage nor the record stays"
    assert "nothing is installed from this build folder" in start("cmake", "--build", BUILD, "--target", "uninstall", EVP_RECORD=record)


def test_a_relative_prefix_is_below_the_folder_of_the_command(tmp_path):
    """It once asked for memory without end. An installation that was moved is not claimed to be removed."""
    record = tmp_path / "record"
    start("cmake", "--install", BUILD, "--prefix", "mine/../here", folder=tmp_path, EVP_RECORD=record, PWD="/")
    assert start("here/bin/evp", "path", "tools", folder=tmp_path).strip() == str(tmp_path / "here" / "share" / "evp" / "tools")
    shutil.move(tmp_path / "here", tmp_path / "there")
    said = start("cmake", "--build", BUILD, "--target", "uninstall", EVP_RECORD=record)
    assert f"nothing to remove: {tmp_path}/here is not there any more" in said and (tmp_path / "there" / "bin" / "evp").exists()
    assert not record.exists()


# ---- packaging/ ----

PACKAGING, LMP = REPOSITORY / "packaging", BUILD / "lmp"


def host(entry):
    """What build/lmp, a script that CMake wrote, knows of LAMMPS."""
    return re.search(f"^{entry}='(.*)'$", LMP.read_text(), re.MULTILINE).group(1)


def test_check_of_an_installation(tmp_path):
    assert start(PACKAGING / "check_install.sh", LMP).startswith("check_install.sh: 13 styles loaded, 200 steps as expected: 450 ")
    text = start(PACKAGING / "check_install.sh", host("lmp"), status=1, LD_LIBRARY_PATH=host("libdir"), LAMMPS_PLUGIN_PATH=tmp_path)
    assert f"error: LAMMPS has not loaded pair evp/lj: is the folder of evpplugin.so in LAMMPS_PLUGIN_PATH ('{tmp_path}')?" in text


def test_build_script_and_test_of_conda(tmp_path):
    """All but conda itself, and but the compiler: `cmake --build` takes the plugin that is built already. Git, which fails, is not asked."""
    source = tmp_path / "source"
    source.mkdir()
    for path in REPOSITORY.iterdir():
        if not path.name.startswith((".", "build", "results")):
            (source / path.name).symlink_to(path)
    (source / "lammps").symlink_to(cache_entry("LAMMPS_SOURCE_DIR"))
    fakes, prefix = tmp_path / "bin", tmp_path / "prefix"
    program(fakes / "cmake", f"""[ "$1" != --build ] || exec cp '{BUILD}/evpplugin.so' "$2"\nexec '{shutil.which("cmake")}' "$@\"""")
    program(fakes / "git", f"touch '{tmp_path}/asked'\nexit 1")
    start(PACKAGING / "conda" / "build.sh", SRC_DIR=source, PREFIX=prefix, CMAKE_ARGS="", PATH=f"{fakes}:{os.environ['PATH']}")
    assert not (tmp_path / "asked").exists()
    active = f"""set -eu
before=${{LAMMPS_PLUGIN_PATH:-}}
. {prefix}/etc/conda/activate.d/evp.sh
{PACKAGING}/check_install.sh {host("lmp")}
. {prefix}/etc/conda/deactivate.d/evp.sh
[ "${{LAMMPS_PLUGIN_PATH:-}}" = "$before" ]
"""
    for before in ("", "/nowhere"):
        assert "13 styles loaded" in start("bash", "-c", active, CONDA_PREFIX=prefix, LD_LIBRARY_PATH=host("libdir"), LAMMPS_PLUGIN_PATH=before)


def test_one_version():
    """That of the package is in the recipes, to be cited, and the newest in the list of changes."""
    recipe = (PACKAGING / "conda" / "meta.yaml").read_text()
    here = re.search(re.search("regex_pattern='(.*)'", recipe).group(1), (REPOSITORY / "tools" / "evp" / "__init__.py").read_text()).group(1)
    assert re.fullmatch(r"\d+\.\d+\.\d+", here)
    spack = (PACKAGING / "spack" / "packages" / "evp" / "package.py").read_text()
    assert set(re.findall(r'evp-(\d+\.\d+\.\d+)|version\("(.*)"\)', spack)) == {(here, ""), ("", here)}
    for name, form in {"CITATION.cff": r'^version: "?([^"\s]+)"?$', "CHANGELOG.md": r"^## \[?v?(\d+\.\d+\.\d+)"}.items():
        assert re.findall(form, (REPOSITORY / name).read_text(), re.M)[:1] == [here], name
