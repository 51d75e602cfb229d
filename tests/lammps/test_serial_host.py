# SPDX-License-Identifier: GPL-2.0-only
"""A LAMMPS without MPI has stand-ins of its own for it, whose functions take other pointers: the sources compile there too."""

import os
import pathlib
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor

import pytest

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


def lammps_headers():
    """The src folder of the LAMMPS that the tests run with, from the build's own notes."""
    cache = pathlib.Path(os.environ.get("EVP_BUILD", REPOSITORY / "build")) / "CMakeCache.txt"
    found = re.search(r"^LAMMPS_SOURCE_DIR:PATH=(.+)$", cache.read_text(encoding="utf-8"), re.M) if cache.exists() else None
    source = pathlib.Path(found.group(1)) if found else None
    return source and (source / "src" if (source / "src").is_dir() else source)


def test_sources_compile_without_mpi():
    headers = lammps_headers()
    if headers is None or not (headers / "STUBS" / "mpi.h").exists():
        pytest.skip("this LAMMPS came without its sources")
    release = re.search(r'"(.+)"', (headers / "version.h").read_text(encoding="utf-8")).group(1)
    assert release, "control: the headers are those of a release"

    def compile_one(source):
        words = [os.environ.get("CXX", "g++"), "-std=c++17", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-DLAMMPS_SMALLBIG",
                 "-DEVP_LAMMPS_VERSION=1", '-DEVP_VERSION="1"',
                 f"-I{REPOSITORY / 'src'}", "-isystem", str(headers / "STUBS"), "-isystem", str(headers), str(source)]
        return subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)

    sources = sorted((REPOSITORY / "src").glob("*/*.cpp"))
    assert len(sources) > 10
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for source, run in zip(sources, pool.map(compile_one, sources)):
            assert run.returncode == 0, f"{source.name}\n{run.stdout[-2000:]}"
