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

# The headers of Debian bookworm's liblammps-dev.
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


def refuses(folder, options, words):
    """CMake ends with one error, which has all of these words."""
    status, text = configure(folder, *options)
    assert status != 0 and text.count("CMake Error") == 1, text
    assert [one for one in words if one not in text] == [], text
    return text


def copied_build(lammps, folder, name, value):
    """The real build's cache with one entry changed."""
    folder.mkdir()
    lines = (lammps[1] / "CMakeCache.txt").read_text().splitlines()
    changed = [line.split("=", 1)[0] + "=" + value if line.startswith(name + ":") else line for line in lines]
    assert changed != lines
    (folder / "CMakeCache.txt").write_text("\n".join(changed) + "\n")
    return folder


@pytest.mark.parametrize("options, words", [
    (["-DCMAKE_DISABLE_FIND_PACKAGE_LAMMPS=ON", "-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF"],
     ["No LAMMPS given", "-DLAMMPS_SOURCE_DIR=/path/to/lammps", "tools/setup.sh"]),
    (["-DLAMMPS_SOURCE_DIR={tmp}/nowhere"], ["LAMMPS_SOURCE_DIR={tmp}/nowhere is not a LAMMPS source tree"]),
    (["-DLAMMPS_SOURCE_DIR={tree}", "-DLAMMPS_BUILD_DIR={tmp}"], ["LAMMPS_BUILD_DIR={tmp} holds no CMakeCache.txt"]),
    (["-DLAMMPS_SOURCE_DIR={tree}", "-DLAMMPS_BUILD_DIR={build}", "-DLAMMPS_SIZES={other}"], ["LAMMPS_SIZES={other} was asked for", "has {own} integers"])],
    ids=["no LAMMPS", "source", "build", "integers"])
def test_wrong_options(lammps, tmp_path, options, words):
    own = cache_entry(lammps[1], "LAMMPS_SIZES")
    names = {"tmp": tmp_path, "tree": lammps[0], "build": lammps[1], "own": own, "other": "bigbig" if own == "smallbig" else "smallbig"}
    refuses(tmp_path / "b", [word.format(**names) for word in options], [word.format(**names) for word in words])


NO_PLUGINS = "-DPKG_PLUGIN=on -DBUILD_SHARED_LIBS=on"


@pytest.mark.parametrize("entry, value, words", [("PKG_PLUGIN", "OFF", ["without the PLUGIN package", NO_PLUGINS]),
                                                 ("BUILD_SHARED_LIBS", "OFF", ["built as a static library", NO_PLUGINS]),
                                                 ("CMAKE_BUILD_TYPE", "Debug", ["is not finished: {build}/lmp is missing"])])
def test_unfit_build(lammps, tmp_path, entry, value, words):
    build = copied_build(lammps, tmp_path / "lammps", entry, value)
    refuses(tmp_path / "b", [f"-DLAMMPS_SOURCE_DIR={lammps[0]}", f"-DLAMMPS_BUILD_DIR={build}"], [word.format(build=build) for word in words])


def tree_of(folder, release):
    """Source folder of a LAMMPS of that release, as far as CMake looks at it."""
    (folder / "src").mkdir(parents=True)
    (folder / "src" / "lammps.h").touch()
    (folder / "src" / "version.h").write_text(f'#define LAMMPS_VERSION "{release}"\n')
    return folder


def test_source_and_build_of_two_releases(lammps, tmp_path):
    tree = tree_of(tmp_path / "tree", "1 Apr 2099")
    refuses(tmp_path / "b", [f"-DLAMMPS_SOURCE_DIR={tree}", f"-DLAMMPS_BUILD_DIR={lammps[1]}"], ["LAMMPS_SOURCE_DIR is LAMMPS 1 Apr 2099, but LAMMPS_BUILD_DIR="])


def test_release_that_is_too_old(lammps, tmp_path):
    tree = tree_of(tmp_path / "tree", "2 Aug 2023")
    old = "is too old: the oldest supported release is 4 Feb 2025."
    refuses(tmp_path / "b", [f"-DLAMMPS_SOURCE_DIR={tree}"], [f"LAMMPS 2 Aug 2023 in {tree}/src {old}"])

    package = tmp_path / "usr" / "lib" / "cmake" / "LAMMPS"
    package.mkdir(parents=True)
    (package / "LAMMPSConfig.cmake").write_text("set(LAMMPS_VERSION 20250203)\n")
    (tmp_path / "usr" / "include").mkdir()
    (tmp_path / "usr" / "include" / "lammps").symlink_to(lammps[0].resolve() / "src")
    refuses(tmp_path / "c", [f"-DCMAKE_PREFIX_PATH={tmp_path}/usr"], [f"LAMMPS 3 Feb 2025 in {package} {old}"])


def test_package_with_too_few_headers(lammps, tmp_path):
    include = tmp_path / "usr" / "include" / "lammps"
    include.mkdir(parents=True)
    for header in DEBIAN_HEADERS:
        shutil.copy(lammps[0] / "src" / (header + ".h"), include)
    text = refuses(tmp_path / "b", [f"-DCMAKE_PREFIX_PATH={tmp_path}/usr"], [
        f"The LAMMPS headers in {include} are too few to build a plugin: ", "Debian's liblammps-dev",
        "Add the unpacked source tree of the same release (lmp -h prints which): -DLAMMPS_SOURCE_DIR="])
    assert "fmt/format.h" in text.split("too few")[1].split(" missing")[0]


def installed(lammps, prefix, release=None, library=None):
    """What an installed LAMMPS is for CMake: package file with its version in the newer form, library, lmp."""
    if release is None:
        release = re.search(r'"(.*)"', (lammps[0] / "src" / "version.h").read_text()).group(1)
    date = datetime.datetime.strptime(release, "%d %b %Y")
    package = prefix / "lib" / "cmake" / "LAMMPS"
    package.mkdir(parents=True)
    (package / "LAMMPSConfig.cmake").write_text(f"""set(LAMMPS_VERSION {date.year}.{date.month}.{date.day}.0)
add_library(LAMMPS::lammps SHARED IMPORTED)
set_target_properties(LAMMPS::lammps PROPERTIES IMPORTED_LOCATION {library or lammps[1] / "liblammps.so"}
  INTERFACE_COMPILE_DEFINITIONS LAMMPS_{cache_entry(lammps[1], "LAMMPS_SIZES").upper()}
  INTERFACE_LINK_LIBRARIES MPI::MPI_CXX)
""")
    (prefix / "bin").mkdir()
    (prefix / "bin" / "lmp").symlink_to(lammps[1] / "lmp")
    return [f"-DCMAKE_PREFIX_PATH={prefix}", f"-DLAMMPS_SOURCE_DIR={lammps[0]}"]


def test_installed_lammps_with_the_headers_of_its_tree(lammps, tmp_path):
    status, text = configure(tmp_path / "b", *installed(lammps, tmp_path / "usr"))
    assert status == 0, text
    assert f"EVP: headers from {lammps[0].resolve()}/src" in text
    assert f"{cache_entry(lammps[1], 'LAMMPS_SIZES')}, MPI from" in text
    lmp = (tmp_path / "b" / "lmp").read_text()
    assert f"lmp='{lammps[1].resolve()}/lmp'" in lmp and f"libdir='{lammps[1]}'" in lmp


def test_installed_lammps_of_another_release(lammps, tmp_path):
    refuses(tmp_path / "b", installed(lammps, tmp_path / "usr", release="1 Apr 2099"), ["Give the source tree of LAMMPS 1 Apr 2099."])


def test_installed_lammps_without_plugins(lammps, tmp_path):
    library = tmp_path / "liblammps.so"
    library.write_text("a library without the package")
    refuses(tmp_path / "b", installed(lammps, tmp_path / "usr", library=library),
            [f"The installed LAMMPS {library} was built without the PLUGIN package", NO_PLUGINS])


@pytest.mark.parametrize("subfolder", ["", "src"])
def test_right_ways(lammps, tmp_path, subfolder):
    """The control: tree or tree/src, by option or by environment, with the release worked out."""
    source = lammps[0] / subfolder if subfolder else lammps[0]
    for number, (options, environment) in enumerate([
            ([f"-DLAMMPS_SOURCE_DIR={source}"], {}), ([], {"LAMMPS_SOURCE_DIR": str(source)})]):
        status, text = configure(tmp_path / str(number), f"-DLAMMPS_BUILD_DIR={lammps[1]}", *options,
                                 environment=environment)
        assert status == 0, text
        assert f"EVP: headers from {lammps[0].resolve()}/src" in text
        assert os.access(tmp_path / str(number) / "lmp", os.X_OK)


def test_source_alone_needs_no_build(lammps, tmp_path):
    status, text = configure(tmp_path / "b", f"-DLAMMPS_SOURCE_DIR={lammps[0]}")
    assert status == 0, text
    assert "only the unit tests are registered" in text
    assert not (tmp_path / "b" / "lmp").exists()
