#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Takes an effect out of a copy of the sources, and runs the tests that do not name it.

    tests/maintain/without.py volume|heat|damping|energy|yield|failure|joining [TEST ...]

The folders src/core/NAME and src/lammps/NAME are deleted, and the lines of src/lammps/evpplugin.cpp and effects.cpp that name what was in them. The rest must compile,
and pass the tests (default: tests/lammps). A test is left out if it fails and a script that it ran, or its message, has a word of the effect; those
are printed. Objects of build/ that depend on no deleted file are taken as they are, where ninja tells what they depend on.
Exit status: 1 where it does not compile, or a test fails that does not name the effect.
"""

import argparse
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

import tools_path  # noqa: F401  before evp
from study import CHECKOUT, RunError, command_line, errors_in_one_line, output_of
from faults import Build

WORDS = {"volume": ("evp/volume", "volume_strain", "rho0", "torn"), "heat": ("evp/heat",), "damping": ("nve/evp",), "energy": ("evp/energy",),
         "yield": ("yield",), "failure": (" damage ", "damage_", "omega"), "joining": ("exposure",)}
LISTS = ("src/lammps/evpplugin.cpp", "src/lammps/effects.cpp")


def deleted_files(name):
    folders = [CHECKOUT / "src" / layer / name for layer in ("core", "lammps")]
    return [path for folder in folders if folder.is_dir() for path in sorted(folder.iterdir())]


def list_without(path, name):
    """The text of one of LISTS without the lines that name what is in the folders of an effect."""
    headers = [path for path in deleted_files(name) if path.suffix == ".h"]
    classes = {word for path in headers for word in re.findall(r"^(?:class|struct) (\w+)", path.read_text(encoding="utf-8"), re.M)}
    text = (CHECKOUT / path).read_text(encoding="utf-8")
    text = re.sub(rf'^#include "\w+/{name}/.*\n', "", text, flags=re.M)
    return re.sub(rf"^ +(?:add\([^;]*create|made\.push_back\(std::make_shared)<(?:{'|'.join(classes)})\b[^;]*;\n", "", text, flags=re.M)


def from_objects(name, folder):
    """Links the plugin in a folder, with objects of build/ that depend on none of the deleted files; False where nothing tells which do."""
    build, deleted = CHECKOUT / "build", set(map(str, deleted_files(name)))
    if not (build / "build.ninja").exists():
        return False
    output_of(["cmake", "--build", str(build), "--target", "evpplugin"], build, "the build")
    told = output_of(["ninja", "-t", "deps"], build, "ninja")
    depends = {block.partition(":")[0]: set(block.split()) for block in told.split("\n\n") if block}
    commands = output_of(["ninja", "-t", "commands", "evpplugin.so"], build, "ninja").splitlines()
    link = shlex.split(commands[-1].replace(": &&", "").replace("&& :", ""))
    objects = [word for word in link if word.endswith(".o")]
    own = {found: CHECKOUT / "src" / found.partition("/src/")[2][:-2] for found in objects}
    for found, source in own.items():
        here = f"{folder}/{len(found)}_{source.name}.o"
        if str(source) in deleted:
            link.remove(found)
        elif (listed := str(source.relative_to(CHECKOUT))) in LISTS:
            (folder / source.name).write_text(list_without(listed, name), encoding="utf-8")
            compile_alone(commands, found, str(folder / source.name), here, build)
            link[link.index(found)] = here
        elif depends[found] & deleted:
            raise RunError(f"{source.relative_to(CHECKOUT)} needs {', '.join(sorted(depends[found] & deleted))}")
    link[link.index("-o") + 1] = str(folder / "evpplugin.so")
    output_of(link, build, "linking")
    (folder / "forged").symlink_to(build / "forged")  # of the tests of the host
    return True


def compile_alone(commands, found, source, here, build):
    line = next(line for line in commands if f"-o {found} " in line)
    words = shlex.split(line)
    words[words.index("-o") + 1], words[words.index("-c") + 1] = here, source
    output_of(words, build, "compiling")


def build_without(name, folder):
    """The folder of a plugin."""
    if from_objects(name, folder):
        return folder
    build = Build(folder / "copy")
    for layer in ("core", "lammps"):
        shutil.rmtree(folder / "copy" / "src" / layer / name, ignore_errors=True)
    for listed in LISTS:
        (folder / "copy" / listed).write_text(list_without(listed, name), encoding="utf-8")
    build.make()
    return build.folder


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("effect", choices=WORDS, metavar="|".join(WORDS))
    parser.add_argument("tests", nargs=argparse.REMAINDER, metavar="TEST", help="and options, as pytest takes them (default: tests/lammps)")
    options = parser.parse_args(words)
    with errors_in_one_line("without.py"), tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        plugin = build_without(options.effect, folder)
        print(f"compiles without {', '.join(sorted({str(path.parent.relative_to(CHECKOUT)) for path in deleted_files(options.effect)}))}", flush=True)
        told = folder / "left_out"
        done = subprocess.run([sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", *(options.tests or ["tests/lammps"])], cwd=CHECKOUT, check=False,
                              env={**os.environ, "EVP_PLUGIN_DIR": str(plugin), "EVP_WITHOUT": " ".join(WORDS[options.effect]), "EVP_LEFT_OUT": str(told)})
        left_out = sorted(told.read_text(encoding="utf-8").splitlines()) if told.exists() else []
    print(f"left out, which name {' or '.join(WORDS[options.effect])}: {len(left_out)}", *left_out, sep="\n    ")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
