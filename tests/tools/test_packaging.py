# SPDX-License-Identifier: GPL-2.0-only
"""packaging/: the check of an installed plugin, conda's build script and its test, one version everywhere."""
import os
import re
import shutil
import subprocess

from evp.run import CHECKOUT as REPOSITORY
from inputs import BUILD, cache_entry, program

PACKAGING, LMP = REPOSITORY / "packaging", BUILD / "lmp"


def host(entry):
    """What build/lmp, a script that CMake wrote, knows of LAMMPS."""
    return re.search(f"^{entry}='(.*)'$", LMP.read_text(), re.MULTILINE).group(1)


def run(*command, **environment):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120,
                            env={**os.environ, **{name: str(value) for name, value in environment.items()}})
    return result.returncode, result.stdout


def test_check_of_an_installation(tmp_path):
    status, text = run(PACKAGING / "check_install.sh", LMP)
    assert status == 0 and text.startswith("check_install.sh: 12 styles loaded, 200 steps as expected: 450 "), text
    status, text = run(PACKAGING / "check_install.sh", host("lmp"), LD_LIBRARY_PATH=host("libdir"), LAMMPS_PLUGIN_PATH=tmp_path)
    assert status == 1
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
    status, text = run(PACKAGING / "conda" / "build.sh", SRC_DIR=source, PREFIX=prefix, CMAKE_ARGS="", PATH=f"{fakes}:{os.environ['PATH']}")
    assert status == 0 and not (tmp_path / "asked").exists(), text
    active = f"""set -eu
before=${{LAMMPS_PLUGIN_PATH:-}}
. {prefix}/etc/conda/activate.d/evp.sh
{PACKAGING}/check_install.sh {host("lmp")}
. {prefix}/etc/conda/deactivate.d/evp.sh
[ "${{LAMMPS_PLUGIN_PATH:-}}" = "$before" ]
"""
    for before in ("", "/nowhere"):
        status, text = run("bash", "-c", active, CONDA_PREFIX=prefix, LD_LIBRARY_PATH=host("libdir"), LAMMPS_PLUGIN_PATH=before)
        assert status == 0 and "12 styles loaded" in text, text


def test_one_version():
    """That of the package is in the recipes, to be cited, and the newest in the list of changes."""
    recipe = (PACKAGING / "conda" / "meta.yaml").read_text()
    here = re.search(re.search("regex_pattern='(.*)'", recipe).group(1), (REPOSITORY / "tools" / "evp" / "__init__.py").read_text()).group(1)
    assert re.fullmatch(r"\d+\.\d+\.\d+", here)
    spack = (PACKAGING / "spack" / "packages" / "evp" / "package.py").read_text()
    assert set(re.findall(r'evp-(\d+\.\d+\.\d+)|version\("(.*)"\)', spack)) == {(here, ""), ("", here)}
    for name, form in {"CITATION.cff": r'^version: "?([^"\s]+)"?$', "CHANGELOG.md": r"^## \[?v?(\d+\.\d+\.\d+)"}.items():
        assert re.findall(form, (REPOSITORY / name).read_text(), re.M)[:1] == [here], name
