# SPDX-License-Identifier: GPL-2.0-only
"""tools/setup.sh: bad options, the second call, the lock, a machine without network, apt's formats."""
import os
import pathlib
import re
import shutil
import subprocess
import time

import pytest
from evp.run import CHECKOUT as REPOSITORY
from inputs import cache_entry, program

BUILD = REPOSITORY / "build"
SETUP = REPOSITORY / "tools" / "setup.sh"


def run_setup(*options, **environment):
    result = subprocess.run([str(SETUP), *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            env={**os.environ, **environment}, timeout=300)
    return result.returncode, result.stdout


def own_lammps():
    """The options for the LAMMPS that build/ is configured for."""
    return ["--lammps-source", cache_entry("LAMMPS_SOURCE_DIR", BUILD), "--lammps-build", cache_entry("LAMMPS_BUILD_DIR", BUILD)]


@pytest.mark.parametrize("options, message", [
    (["--fast"], "unknown option '--fast'; see tools/setup.sh --help"),
    (["--lammps-source"], "option --lammps-source needs a value"),
    (["--lammps-source", ""], "option --lammps-source needs a value"),
    (["--lammps-source", "/no/such/folder"], "--lammps-source /no/such/folder: no such folder"),
    (["--lammps-source", "/"], "--lammps-source / is not a LAMMPS source tree: src/lammps.h is missing"),
    (["--lammps-source", "OLD"], "LAMMPS 2 Aug 2023 in OLD is too old: the oldest supported release is 4 Feb 2025"),
    (["--lammps-build", "/"], "--lammps-build needs --lammps-source"),
    (["--lammps-source", "OWN", "--lammps-build", "/"], "is not a CMake build folder: CMakeCache.txt is missing"),
    (["--lammps-release", "2Aug2023"], "must be 4Feb2025 or newest, got '2Aug2023'")])
def test_bad_options(tmp_path, options, message):
    """Told before LAMMPS is built."""
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "lammps.h").touch()
    (tmp_path / "src" / "version.h").write_text('#define LAMMPS_VERSION "2 Aug 2023"\n')
    places = {"OLD": str(tmp_path), "OWN": own_lammps()[1]}
    status, text = run_setup(*(places.get(word, word) for word in options))
    assert status == 1 and "setup.sh: error: " in text and message.replace("OLD", str(tmp_path)) in text
    assert "==" not in text, "no phase may have begun"


@pytest.mark.parametrize("script", ["setup.sh", "quickstart.sh"])
def test_a_build_folder_that_came_from_elsewhere(tmp_path, script):
    """With its checkout, which was copied, or moved so that the place is gone; told before anything is looked for, and nothing is written."""
    shutil.copytree(REPOSITORY / "tools", tmp_path / "tools")
    (tmp_path / "build").mkdir()
    for made in (str(REPOSITORY / "build"), "/no/such place/build"):
        (tmp_path / "build" / "CMakeCache.txt").write_text(f"# a cache\nCMAKE_CACHEFILE_DIR:INTERNAL={made}\n", encoding="utf-8")
        done = subprocess.run([tmp_path / "tools" / script], capture_output=True, text=True, check=False, timeout=60)
        build = tmp_path / "build"
        assert done.returncode == 1 and done.stderr == (f"setup.sh: error: {build} was made as {made}, and moved or copied since: it holds paths of there. "
                                                        f"Remove it, and call again: rm -r {build}\n")
        assert "==" not in done.stdout and [path.name for path in build.iterdir()] == ["CMakeCache.txt"]


def test_second_call_makes_nothing_and_the_first_waits_for_another(tmp_path):
    """What build/ remembers of the last set-up is put back."""
    options = BUILD / "setup.options"
    before = options.read_text() if options.exists() else None
    with subprocess.Popen(["flock", str(tmp_path / "lock-4Feb2025"), "sleep", "3"]) as holder:
        while not (tmp_path / "lock-4Feb2025").exists():
            time.sleep(0.01)
        time.sleep(0.2)
        status, text = run_setup(*own_lammps(), EVP_CACHE=str(tmp_path))
        assert holder.poll() is not None, "went on while the lock was held"
    assert status == 0 and "another set-up of LAMMPS 4Feb2025 is at work" in text, text
    library = (BUILD / "evpplugin.so").stat().st_mtime_ns
    status, text = run_setup(*own_lammps(), EVP_CACHE=str(tmp_path))
    assert status == 0 and "nothing is missing" in text and f"{BUILD}/lmp -in FILE" in text, text
    assert (BUILD / "evpplugin.so").stat().st_mtime_ns == library, "nothing had to be compiled"
    options.unlink(missing_ok=True)
    if before is not None:
        options.write_text(before)


@pytest.mark.parametrize("release", ["4Feb2025", "newest"])
def test_no_network_and_nothing_cached(tmp_path, release):
    """A proxy that nobody listens on: apt's downloads really fail."""
    dead = "http://127.0.0.1:9"
    status, text = run_setup("--lammps-release", release, EVP_CACHE=str(tmp_path), http_proxy=dead, https_proxy=dead)
    assert status == 1 and text.count("setup.sh: error: ") == 1
    assert "No LAMMPS source can be had here. Give one: tools/setup.sh --lammps-source /path/to/lammps" in text
    assert not list(tmp_path.glob("lammps-*/source")), "no half tree is left"


APT = {  # files below /etc/apt, in both formats
    "sources.list.d/debian.sources": """Types: deb
URIs: http://other.example/tools
Suites: {release}
Components: contrib

Types: deb
URIs: http://mirror.example/debian
Suites: {release} {release}-updates
Components: main contrib
""",
    "sources.list": """# deb http://cdrom.example/ {release} main
deb http://security.example/debian-security {release}-security main
deb [arch=amd64 trusted=yes] http://mirror.example/debian {release} contrib main
"""}


@pytest.mark.parametrize("name", [*APT, None])
def test_private_entry_is_derived_from_the_machine(tmp_path, name):
    """None: without an entry of Debian there is none."""
    release = re.search("^VERSION_CODENAME=(.+)$", pathlib.Path("/etc/os-release").read_text(), re.M)[1]
    (tmp_path / "sources.list.d").mkdir()
    if name:
        (tmp_path / name).write_text(APT[name].format(release=release))
    (tmp_path / "apt.conf").write_text(f'Dir::Etc::sourcelist "{tmp_path}/sources.list"; Dir::Etc::sourceparts "{tmp_path}/sources.list.d";\n')
    found = subprocess.run(["bash", "-uc", f"log=/dev/null; source {REPOSITORY}/tools/setup_steps.sh; debian_source_entry trixie"],
                           env={**os.environ, "APT_CONFIG": str(tmp_path / "apt.conf")}, stdout=subprocess.PIPE, text=True, check=False)
    assert found.returncode == (0 if name else 1)
    entry = "Types: deb-src\nURIs: http://mirror.example/debian\nSuites: trixie\nComponents: main\n"
    assert re.fullmatch(f"{entry}(Signed-By: .*debian-archive-keyring.gpg\n)?" if name else "", found.stdout)


def test_optional_modules_that_are_missing_are_told(tmp_path):
    """A Python without two of them, that no apt can mend: what will not work, and how to get it; no other line."""
    python = program(tmp_path / "python3", """shift
for module in $1; do case $module in sphinx|open3d) echo -n "$module " ;; esac; done""", "#!/bin/bash")
    script = (f"source {REPOSITORY}/tools/env.sh; log={tmp_path}/log; source {REPOSITORY}/tools/setup_steps.sh; install_optional_modules")
    text = subprocess.run(["bash", "-euc", script], stdout=subprocess.PIPE, text=True, check=True,
                          env={**os.environ, "PYTHON": str(python)}).stdout
    assert text.splitlines() == [
        f"    tools/body.py and tools/tool.py (parts and tools as STL) will not work: {python} has no open3d; pip install open3d",
        f"    the site of the documentation cannot be built, nor its tests run: {python} has no sphinx; pip install sphinx"]
