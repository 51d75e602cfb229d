# SPDX-License-Identifier: GPL-2.0-only
"""packaging/: the check of an installed plugin, conda's build script and its test, one version everywhere."""
import os
import pathlib
import re
import shutil
import subprocess

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PACKAGING = REPOSITORY / "packaging"
LMP = pathlib.Path(os.environ.get("EVP_LMP", REPOSITORY / "build" / "lmp"))
BUILD = LMP.parent


def host(entry):
    """What build/lmp, a script that CMake wrote, knows of LAMMPS."""
    return re.search(f"^{entry}='(.*)'$", LMP.read_text(), re.MULTILINE).group(1)


def run(*command, **environment):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120,
                            env={**os.environ, **{name: str(value) for name, value in environment.items()}})
    return result.returncode, result.stdout


def test_check_passes_with_the_plugin():
    status, text = run(PACKAGING / "check_install.sh", LMP)
    assert status == 0, text
    assert text.startswith("check_install.sh: 12 styles loaded, 200 steps as expected: 450 ")


def test_check_fails_without_the_plugin(tmp_path):
    status, text = run(PACKAGING / "check_install.sh", host("lmp"), LD_LIBRARY_PATH=host("libdir"), LAMMPS_PLUGIN_PATH=tmp_path)
    assert status == 1
    assert f"error: LAMMPS has not loaded pair evp/lj: is the folder of evpplugin.so in LAMMPS_PLUGIN_PATH ('{tmp_path}')?" in text


def test_build_script_and_test_of_conda(tmp_path):
    """All but conda itself, and but the compiler: `cmake --build` takes the plugin that is built already."""
    source = tmp_path / "source"
    source.mkdir()
    for path in REPOSITORY.iterdir():
        if not path.name.startswith((".", "build", "results")):
            (source / path.name).symlink_to(path)
    tree = re.search("^LAMMPS_SOURCE_DIR:PATH=(.*)$", (BUILD / "CMakeCache.txt").read_text(), re.MULTILINE).group(1)
    (source / "lammps").symlink_to(tree)
    fake = tmp_path / "bin" / "cmake"
    fake.parent.mkdir()
    fake.write_text(f"""#!/bin/bash
[ "$1" != --build ] || exec cp '{BUILD}/evpplugin.so' "$2"
exec '{shutil.which("cmake")}' "$@"
""")
    fake.chmod(0o755)
    prefix = tmp_path / "prefix"
    status, text = run(PACKAGING / "conda" / "build.sh", SRC_DIR=source, PREFIX=prefix, CMAKE_ARGS="",
                       PATH=f"{fake.parent}:{os.environ['PATH']}")
    assert status == 0, text
    active = f"""set -eu
before=${{LAMMPS_PLUGIN_PATH:-}}
. {prefix}/etc/conda/activate.d/evp.sh
{PACKAGING}/check_install.sh {host("lmp")}
. {prefix}/etc/conda/deactivate.d/evp.sh
[ "${{LAMMPS_PLUGIN_PATH:-}}" = "$before" ]
"""
    for before in ("", "/nowhere"):
        status, text = run("bash", "-c", active, CONDA_PREFIX=prefix, LD_LIBRARY_PATH=host("libdir"), LAMMPS_PLUGIN_PATH=before)
        assert status == 0, text
        assert "12 styles loaded" in text


def test_one_version():
    """That of the package is in the recipes, to be cited, and the newest in the list of changes."""
    recipe = (PACKAGING / "conda" / "meta.yaml").read_text()
    here = re.search(re.search("regex_pattern='(.*)'", recipe).group(1), (REPOSITORY / "tools" / "evp" / "__init__.py").read_text()).group(1)
    assert re.fullmatch(r"\d+\.\d+\.\d+", here)
    spack = (PACKAGING / "spack" / "packages" / "evp" / "package.py").read_text()
    assert set(re.findall(r'evp-(\d+\.\d+\.\d+)|version\("(.*)"\)', spack)) == {(here, ""), ("", here)}
    for name, form in {"CITATION.cff": r'^version: "?([^"\s]+)"?$', "CHANGELOG.md": r"^## \[?v?(\d+\.\d+\.\d+)"}.items():
        assert re.findall(form, (REPOSITORY / name).read_text(), re.M)[:1] == [here], name
