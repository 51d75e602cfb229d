#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Takes the protection of each hard case out of the sources, builds the plugin, and demands that the case fails.

    tools/mutations.py [--only WORDS] [--keep DIR]

Works on a copy of the checkout, with the LAMMPS that build/ was configured for (tools/setup.sh). About ten seconds each.
Exit code 1 if a case passes without its protection, or a line to change is no more there.
"""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

import hard_cases as runner
from evp.run import format_seconds

CHECKOUT = pathlib.Path(__file__).resolve().parents[1]
HOST = re.compile(r"^(LAMMPS_\w+|MPI_CXX_COMPILER|CMAKE_CXX_COMPILER):\w+=(.+)$", re.M)


def configure(copy):
    """CMake of the copy for the LAMMPS of this checkout's build, without tests."""
    cache = CHECKOUT / "build" / "CMakeCache.txt"
    if not cache.exists():
        sys.exit("mutations.py: error: no build/CMakeCache.txt: run tools/setup.sh first")
    words = [f"-D{name}={value}" for name, value in HOST.findall(cache.read_text(encoding="utf-8"))]
    for part in ("src", "cmake", "CMakeLists.txt"):
        source = CHECKOUT / part
        (shutil.copytree if source.is_dir() else shutil.copy)(source, copy / part)
    command(["cmake", "-S", copy, "-B", copy / "build", "-DBUILD_TESTING=OFF", *words])


def command(words):
    run = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if run.returncode:
        sys.exit(f"mutations.py: error: '{words[0]} ...' failed:\n{run.stdout[-3000:]}")


def build(copy):
    command(["cmake", "--build", copy / "build", "-j", str(os.cpu_count() or 1)])


def survivors(scenes, mutation, ranks):
    """Names of the cases that pass, and what the others showed."""
    passed, shown = [], []
    for case in scenes.CASES:
        if not any(words in case.name for words in mutation.cases):
            continue
        text, right = runner.run_case(scenes, case, ranks)
        (passed if right else shown).append(case.name if right else f"{case.name}: {text[8:120]}")
    return passed, shown


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="mutations whose text holds these words")
    options = parser.parse_args(words)
    sys.path.insert(0, str(CHECKOUT / "tests" / "lammps"))
    sys.modules.pop("mutations", None)
    from mutations import MUTATIONS

    chosen = [mutation for mutation in MUTATIONS if options.only in mutation.what]
    if not chosen:
        parser.error(f"no mutation holds '{options.only}'")
    bad, begin = [], time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        copy = pathlib.Path(name)
        configure(copy)
        os.environ["EVP_LMP"] = str(copy / "build" / "lmp")  # read when the scenes are loaded
        scenes = runner.load_scenes()
        for number, mutation in enumerate(chosen):
            path = next((copy / "src").rglob(mutation.file))
            text = path.read_text(encoding="utf-8")
            if text.count(mutation.old) != mutation.times:
                bad.append(f"{mutation.file} holds '{mutation.old}' {text.count(mutation.old)} times, not {mutation.times}")
                continue
            path.write_text(text.replace(mutation.old, mutation.new), encoding="utf-8")
            build(copy)
            passed, shown = survivors(scenes, mutation, 1)
            path.write_text(text, encoding="utf-8")
            bad += [f"'{case}' passes although: {mutation.what}" for case in passed]
            left = (time.monotonic() - begin) / (number + 1) * (len(chosen) - number - 1)
            print(f"{number + 1}/{len(chosen)}, about {format_seconds(left)} left: {mutation.what}", *shown, sep="\n    failed, as it must: ", flush=True)
            if not passed and not shown:
                bad.append(f"no case for: {mutation.what}")
    for line in bad:
        print("NOT SEEN TO FAIL: " + line)
    print(f"{len(chosen)} mutations in {format_seconds(time.monotonic() - begin)}, {'all seen' if not bad else f'{len(bad)} NOT SEEN'}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
