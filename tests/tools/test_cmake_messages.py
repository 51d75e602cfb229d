# SPDX-License-Identifier: GPL-2.0-only
"""Each wrong way to configure ends in one clear CMake error; the right ways succeed."""
import datetime
import os
import pathlib
import re
import shutil
import subprocess

import pytest
from evp.run import CHECKOUT
from inputs import cache_entry

TREE = pathlib.Path(re.sub("/src$", "", cache_entry("LAMMPS_SOURCE_DIR"))).resolve()  # of the LAMMPS that the tests run with
BUILT = pathlib.Path(cache_entry("LAMMPS_BUILD_DIR"))
SIZES = cache_entry("LAMMPS_SIZES", BUILT)
DEBIAN_HEADERS = """angle atom bond citeme comm compute dihedral domain error fix force group improper info
    input kspace lammps lattice library lmppython lmptype memory modify neigh_list neighbor output pair
    pointers region timer universe update utils variable""".split()


def configure(folder, *options, **environment):
    """CMake's status and all of its words, with its line breaks taken out."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("LAMMPS_", "CMAKE_"))}
    done = subprocess.run(["cmake", "-S", CHECKOUT, "-B", folder / "b", "-G", cache_entry("CMAKE_GENERATOR"), "-DBUILD_TESTING=off", *options],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**kept, **environment}, timeout=120)
    return done.returncode, " ".join(done.stdout.split())


NO_PLUGINS = "-DPKG_PLUGIN=on -DBUILD_SHARED_LIBS=on"
OLD = "is too old: the oldest supported release is 4 Feb 2025."
SOURCE = [f"-DLAMMPS_SOURCE_DIR={TREE}"]
BOTH, CHANGED, PREFIX = [*SOURCE, f"-DLAMMPS_BUILD_DIR={BUILT}"], [*SOURCE, "-DLAMMPS_BUILD_DIR={tmp}/changed"], ["-DCMAKE_PREFIX_PATH={tmp}/usr"]
OTHER = "bigbig" if SIZES == "smallbig" else "smallbig"


def no_more(folder):
    """Nothing has to be made."""


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def package(folder, text):
    write(folder / "usr" / "lib" / "cmake" / "LAMMPS" / "LAMMPSConfig.cmake", text)


def release(date):
    """Makes a source folder of a LAMMPS of that release, as far as CMake looks at it."""
    def make(folder):
        write(folder / "tree" / "src" / "lammps.h", "")
        write(folder / "tree" / "src" / "version.h", f'#define LAMMPS_VERSION "{date}"\n')

    return make


def old_package(folder):
    package(folder, "set(LAMMPS_VERSION 20250203)\n")
    (folder / "usr" / "include").mkdir()
    (folder / "usr" / "include" / "lammps").symlink_to(TREE / "src")


def few_headers(folder):
    """Those of Debian bookworm's liblammps-dev."""
    (folder / "usr" / "include" / "lammps").mkdir(parents=True)
    for header in DEBIAN_HEADERS:
        shutil.copy(TREE / "src" / (header + ".h"), folder / "usr" / "include" / "lammps")


def changed(name, value):
    """Makes the real build's cache with one entry changed."""
    text, count = re.subn(f"^({name}:.*?=).*", rf"\g<1>{value}", (BUILT / "CMakeCache.txt").read_text(), flags=re.M)
    assert count == 1
    return lambda folder: write(folder / "changed" / "CMakeCache.txt", text)


def installed(date=None, library=None):
    """Makes what an installed LAMMPS is for CMake: package file with its version in the newer form, library, lmp."""
    def make(folder):
        version = date or re.search(r'"(.*)"', (TREE / "src" / "version.h").read_text()).group(1)
        day = datetime.datetime.strptime(version, "%d %b %Y")
        if library:
            (folder / "liblammps.so").write_text(library)
        package(folder, f"""set(LAMMPS_VERSION {day.year}.{day.month}.{day.day}.0)
add_library(LAMMPS::lammps SHARED IMPORTED)
set_target_properties(LAMMPS::lammps PROPERTIES IMPORTED_LOCATION {(folder if library else BUILT) / "liblammps.so"}
  INTERFACE_COMPILE_DEFINITIONS LAMMPS_{SIZES.upper()} INTERFACE_LINK_LIBRARIES MPI::MPI_CXX)
""")
        (folder / "usr" / "bin").mkdir()
        (folder / "usr" / "bin" / "lmp").symlink_to(BUILT / "lmp")

    return make


@pytest.mark.parametrize("make, options, words", [
    (no_more, ["-DCMAKE_DISABLE_FIND_PACKAGE_LAMMPS=ON", "-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF"],
     ["No LAMMPS given", "-DLAMMPS_SOURCE_DIR=/path/to/lammps", "tools/setup.sh"]),
    (no_more, ["-DLAMMPS_SOURCE_DIR={tmp}/nowhere"], ["LAMMPS_SOURCE_DIR={tmp}/nowhere is not a LAMMPS source tree"]),
    (no_more, [*SOURCE, "-DLAMMPS_BUILD_DIR={tmp}"], ["LAMMPS_BUILD_DIR={tmp} holds no CMakeCache.txt"]),
    (no_more, [*BOTH, f"-DLAMMPS_SIZES={OTHER}"], [f"LAMMPS_SIZES={OTHER} was asked for", f"has {SIZES} integers"]),
    (changed("PKG_PLUGIN", "OFF"), CHANGED, ["without the PLUGIN package", NO_PLUGINS]),
    (changed("BUILD_SHARED_LIBS", "OFF"), CHANGED, ["built as a static library", NO_PLUGINS]),
    (changed("CMAKE_BUILD_TYPE", "Debug"), CHANGED, ["is not finished: {tmp}/changed/lmp is missing"]),
    (release("1 Apr 2099"), ["-DLAMMPS_SOURCE_DIR={tmp}/tree", BOTH[1]], ["LAMMPS_SOURCE_DIR is LAMMPS 1 Apr 2099, but LAMMPS_BUILD_DIR="]),
    (release("2 Aug 2023"), ["-DLAMMPS_SOURCE_DIR={tmp}/tree"], ["LAMMPS 2 Aug 2023 in {tmp}/tree/src " + OLD]),
    (old_package, PREFIX, ["LAMMPS 3 Feb 2025 in {tmp}/usr/lib/cmake/LAMMPS " + OLD]),
    (few_headers, PREFIX, [
        "The LAMMPS headers in {tmp}/usr/include/lammps are too few to build a plugin: ", "fmt/format.h", "Debian's liblammps-dev",
        "Add the unpacked source tree of the same release (lmp -h prints which): -DLAMMPS_SOURCE_DIR="]),
    (installed("1 Apr 2099"), [*PREFIX, *SOURCE], ["Give the source tree of LAMMPS 1 Apr 2099."]),
    (installed(library="a library without the package"), [*PREFIX, *SOURCE],
     ["The installed LAMMPS {tmp}/liblammps.so was built without the PLUGIN package", NO_PLUGINS])])
def test_wrong_ways(tmp_path, make, options, words):
    """CMake ends with one error, which has all of these words."""
    make(tmp_path)
    status, text = configure(tmp_path, *(word.format(tmp=tmp_path) for word in options))
    assert status != 0 and text.count("CMake Error") == 1, text
    assert [word for word in words if word.format(tmp=tmp_path) not in text] == [], text


def test_installed_lammps_with_the_headers_of_its_tree(tmp_path):
    installed()(tmp_path)
    status, text = configure(tmp_path, *SOURCE, f"-DCMAKE_PREFIX_PATH={tmp_path}/usr")
    assert status == 0 and f"EVP: headers from {TREE}/src" in text and f"{SIZES}, MPI from" in text, text
    lmp = (tmp_path / "b" / "lmp").read_text()
    assert f"lmp='{BUILT.resolve()}/lmp'" in lmp and f"libdir='{BUILT}'" in lmp


def test_tree_with_its_build(tmp_path):
    """tree/src by the environment; what is not built cannot be installed. Without a build the source is enough for the unit tests."""
    status, text = configure(tmp_path, BOTH[1], LAMMPS_SOURCE_DIR=str(TREE / "src"))
    assert status == 0 and f"EVP: headers from {TREE}/src" in text and os.access(tmp_path / "b" / "lmp", os.X_OK), text
    early = subprocess.run(["cmake", "--install", tmp_path / "b", "--prefix", tmp_path / "prefix"], capture_output=True, text=True, check=False)
    assert early.returncode and f"The plugin is not built yet. Run first: cmake --build {tmp_path / 'b'}" in " ".join(early.stderr.split())
    assert not (tmp_path / "prefix").exists()
    status, text = configure(tmp_path / "alone", *SOURCE)
    assert status == 0 and "only the unit tests are registered" in text and not (tmp_path / "alone" / "b" / "lmp").exists(), text
