# SPDX-License-Identifier: GPL-2.0-only
"""Each wrong way to configure ends in one clear CMake error; the right ways succeed."""
import datetime
import os
import pathlib
import re
import shutil
import subprocess

import pytest

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("EVP_LMP", REPOSITORY / "build" / "lmp")).parent

DEBIAN_HEADERS = """angle atom bond citeme comm compute dihedral domain error fix force group improper info
    input kspace lammps lattice library lmppython lmptype memory modify neigh_list neighbor output pair
    pointers region timer universe update utils variable""".split()


def cache_entry(folder, name):
    for line in (folder / "CMakeCache.txt").read_text().splitlines():
        if line.startswith(name + ":"):
            return line.split("=", 1)[1]
    raise AssertionError(f"{folder}/CMakeCache.txt has no {name}")


@pytest.fixture(scope="module")
def lammps():
    """(source tree, build folder) of the LAMMPS that the tests run with."""
    source = pathlib.Path(cache_entry(BUILD, "LAMMPS_SOURCE_DIR"))
    if source.name == "src":
        source = source.parent
    return source, pathlib.Path(cache_entry(BUILD, "LAMMPS_BUILD_DIR"))


def configure(folder, *options, environment=None):
    """CMake's status and all of its words, with its line breaks taken out."""
    variables = {k: v for k, v in os.environ.items() if not k.startswith(("LAMMPS_", "CMAKE_"))}
    variables.update(environment or {})
    result = subprocess.run(
        ["cmake", "-S", str(REPOSITORY), "-B", str(folder), "-G", cache_entry(BUILD, "CMAKE_GENERATOR"),
         "-DBUILD_TESTING=off", *options],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=variables, timeout=120)
    return result.returncode, " ".join(result.stdout.split())


def copied_build(lammps, folder, name, value):
    """The real build's cache with one entry changed."""
    folder.mkdir()
    lines = (lammps[1] / "CMakeCache.txt").read_text().splitlines()
    changed = [line.split("=", 1)[0] + "=" + value if line.startswith(name + ":") else line for line in lines]
    assert changed != lines
    (folder / "CMakeCache.txt").write_text("\n".join(changed) + "\n")
    return folder


NO_PLUGINS = "-DPKG_PLUGIN=on -DBUILD_SHARED_LIBS=on"
OLD = "is too old: the oldest supported release is 4 Feb 2025."
SOURCE, BOTH = ["-DLAMMPS_SOURCE_DIR={source}"], ["-DLAMMPS_SOURCE_DIR={source}", "-DLAMMPS_BUILD_DIR={build}"]
CHANGED = ["-DLAMMPS_SOURCE_DIR={source}", "-DLAMMPS_BUILD_DIR={tmp}/changed"]
INSTALLED = ["-DCMAKE_PREFIX_PATH={tmp}/usr", *SOURCE]


def no_more(lammps, tmp_path):
    """Nothing has to be made."""


def release(date):
    """Makes a source folder of a LAMMPS of that release, as far as CMake looks at it."""
    def make(lammps, tmp_path):
        (tmp_path / "tree" / "src").mkdir(parents=True)
        (tmp_path / "tree" / "src" / "lammps.h").touch()
        (tmp_path / "tree" / "src" / "version.h").write_text(f'#define LAMMPS_VERSION "{date}"\n')

    return make


def old_package(lammps, tmp_path):
    package = tmp_path / "usr" / "lib" / "cmake" / "LAMMPS"
    package.mkdir(parents=True)
    (package / "LAMMPSConfig.cmake").write_text("set(LAMMPS_VERSION 20250203)\n")
    (tmp_path / "usr" / "include").mkdir()
    (tmp_path / "usr" / "include" / "lammps").symlink_to(lammps[0].resolve() / "src")


def few_headers(lammps, tmp_path):
    """Those of Debian bookworm's liblammps-dev."""
    include = tmp_path / "usr" / "include" / "lammps"
    include.mkdir(parents=True)
    for header in DEBIAN_HEADERS:
        shutil.copy(lammps[0] / "src" / (header + ".h"), include)


def changed(name, value):
    """Makes the real build's cache with one entry changed."""
    return lambda lammps, tmp_path: copied_build(lammps, tmp_path / "changed", name, value)


def installed(date=None, library=None):
    """Makes what an installed LAMMPS is for CMake: package file with its version in the newer form, library, lmp."""
    def make(lammps, tmp_path):
        version = date or re.search(r'"(.*)"', (lammps[0] / "src" / "version.h").read_text()).group(1)
        day = datetime.datetime.strptime(version, "%d %b %Y")
        if library:
            (tmp_path / "liblammps.so").write_text(library)
        package = tmp_path / "usr" / "lib" / "cmake" / "LAMMPS"
        package.mkdir(parents=True)
        (package / "LAMMPSConfig.cmake").write_text(f"""set(LAMMPS_VERSION {day.year}.{day.month}.{day.day}.0)
add_library(LAMMPS::lammps SHARED IMPORTED)
set_target_properties(LAMMPS::lammps PROPERTIES IMPORTED_LOCATION {(tmp_path if library else lammps[1]) / "liblammps.so"}
  INTERFACE_COMPILE_DEFINITIONS LAMMPS_{cache_entry(lammps[1], "LAMMPS_SIZES").upper()}
  INTERFACE_LINK_LIBRARIES MPI::MPI_CXX)
""")
        (tmp_path / "usr" / "bin").mkdir()
        (tmp_path / "usr" / "bin" / "lmp").symlink_to(lammps[1] / "lmp")

    return make


@pytest.mark.parametrize("make, options, words", [
    (no_more, ["-DCMAKE_DISABLE_FIND_PACKAGE_LAMMPS=ON", "-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF"],
     ["No LAMMPS given", "-DLAMMPS_SOURCE_DIR=/path/to/lammps", "tools/setup.sh"]),
    (no_more, ["-DLAMMPS_SOURCE_DIR={tmp}/nowhere"], ["LAMMPS_SOURCE_DIR={tmp}/nowhere is not a LAMMPS source tree"]),
    (no_more, [*SOURCE, "-DLAMMPS_BUILD_DIR={tmp}"], ["LAMMPS_BUILD_DIR={tmp} holds no CMakeCache.txt"]),
    (no_more, [*BOTH, "-DLAMMPS_SIZES={other}"], ["LAMMPS_SIZES={other} was asked for", "has {own} integers"]),
    (changed("PKG_PLUGIN", "OFF"), CHANGED, ["without the PLUGIN package", NO_PLUGINS]),
    (changed("BUILD_SHARED_LIBS", "OFF"), CHANGED, ["built as a static library", NO_PLUGINS]),
    (changed("CMAKE_BUILD_TYPE", "Debug"), CHANGED, ["is not finished: {tmp}/changed/lmp is missing"]),
    (release("1 Apr 2099"), ["-DLAMMPS_SOURCE_DIR={tmp}/tree", BOTH[1]], ["LAMMPS_SOURCE_DIR is LAMMPS 1 Apr 2099, but LAMMPS_BUILD_DIR="]),
    (release("2 Aug 2023"), ["-DLAMMPS_SOURCE_DIR={tmp}/tree"], ["LAMMPS 2 Aug 2023 in {tmp}/tree/src " + OLD]),
    (old_package, ["-DCMAKE_PREFIX_PATH={tmp}/usr"], ["LAMMPS 3 Feb 2025 in {tmp}/usr/lib/cmake/LAMMPS " + OLD]),
    (few_headers, ["-DCMAKE_PREFIX_PATH={tmp}/usr"], [
        "The LAMMPS headers in {tmp}/usr/include/lammps are too few to build a plugin: ", "fmt/format.h", "Debian's liblammps-dev",
        "Add the unpacked source tree of the same release (lmp -h prints which): -DLAMMPS_SOURCE_DIR="]),
    (installed("1 Apr 2099"), INSTALLED, ["Give the source tree of LAMMPS 1 Apr 2099."]),
    (installed(library="a library without the package"), INSTALLED,
     ["The installed LAMMPS {tmp}/liblammps.so was built without the PLUGIN package", NO_PLUGINS])])
def test_wrong_ways(lammps, tmp_path, make, options, words):
    """CMake ends with one error, which has all of these words."""
    own = cache_entry(lammps[1], "LAMMPS_SIZES")
    names = {"tmp": tmp_path, "source": lammps[0], "build": lammps[1], "own": own, "other": "bigbig" if own == "smallbig" else "smallbig"}
    make(lammps, tmp_path)
    status, text = configure(tmp_path / "b", *(word.format(**names) for word in options))
    assert status != 0 and text.count("CMake Error") == 1, text
    assert [word for word in words if word.format(**names) not in text] == [], text


def test_installed_lammps_with_the_headers_of_its_tree(lammps, tmp_path):
    installed()(lammps, tmp_path)
    status, text = configure(tmp_path / "b", *(word.format(tmp=tmp_path, source=lammps[0]) for word in INSTALLED))
    assert status == 0, text
    assert f"EVP: headers from {lammps[0].resolve()}/src" in text
    assert f"{cache_entry(lammps[1], 'LAMMPS_SIZES')}, MPI from" in text
    lmp = (tmp_path / "b" / "lmp").read_text()
    assert f"lmp='{lammps[1].resolve()}/lmp'" in lmp and f"libdir='{lammps[1]}'" in lmp


@pytest.mark.parametrize("subfolder, by_option", [("", True), ("src", False)])
def test_tree_with_its_build(lammps, tmp_path, subfolder, by_option):
    """Tree or tree/src, by option or by environment."""
    name, source = "LAMMPS_SOURCE_DIR", str(lammps[0] / subfolder)
    status, text = configure(tmp_path / "b", f"-DLAMMPS_BUILD_DIR={lammps[1]}", *([f"-D{name}={source}"] if by_option else []),
                             environment={} if by_option else {name: source})
    assert status == 0 and f"EVP: headers from {lammps[0].resolve()}/src" in text, text
    assert os.access(tmp_path / "b" / "lmp", os.X_OK)


def test_source_alone_needs_no_build(lammps, tmp_path):
    status, text = configure(tmp_path / "b", f"-DLAMMPS_SOURCE_DIR={lammps[0]}")
    assert status == 0 and "only the unit tests are registered" in text, text
    assert not (tmp_path / "b" / "lmp").exists()
