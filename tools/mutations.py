#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Removes the safeguard of each robustness test from the sources, builds the plugin, and checks that the test then fails.

    tools/mutations.py [--only WORDS]

Works on a copy of the checkout, with the LAMMPS that build/ was configured for (tools/setup.sh). About ten seconds per safeguard.
Exit code 1 if a test passes without its safeguard, or if a line to change is no longer in the sources.
"""

import os
import pathlib
import shutil
import sys
import tempfile

import hard_cases as runner
from evp import rebuild
from evp.progress import watched
from evp.report import command_line, errors_in_one_line
from evp.run import CHECKOUT


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
    parser = command_line(__doc__)
    parser.add_argument("--only", default="", help="remove only the safeguards whose description contains these words")
    options = parser.parse_args(words)
    sys.path.insert(0, str(CHECKOUT / "tests" / "lammps"))
    sys.modules.pop("mutations", None)
    from mutations import MUTATIONS

    chosen = [mutation for mutation in MUTATIONS if options.only in mutation.what]
    if not chosen:
        parser.error(f"no safeguard has '{options.only}' in its description")
    bad = []
    with errors_in_one_line("mutations.py"), tempfile.TemporaryDirectory() as name:
        copy = pathlib.Path(name)
        for part in ("src", "cmake", "tools", "CMakeLists.txt"):
            source = CHECKOUT / part
            (shutil.copytree if source.is_dir() else shutil.copy)(source, copy / part)
        rebuild.configure(copy, copy / "build")
        os.environ["EVP_LMP"] = str(copy / "build" / "lmp")  # read when the scenes are loaded
        scenes = runner.load_scenes()
        for mutation in watched("mutations", chosen, lambda mutation: mutation.what):
            path = next((copy / "src").rglob(mutation.file))
            text = path.read_text(encoding="utf-8")
            if text.count(mutation.old) != mutation.times:
                bad.append(f"{mutation.file} has '{mutation.old}' {text.count(mutation.old)} times, not {mutation.times}")
                continue
            path.write_text(text.replace(mutation.old, mutation.new), encoding="utf-8")
            rebuild.build(copy / "build")
            passed, shown = survivors(scenes, mutation, 1)
            path.write_text(text, encoding="utf-8")
            print(mutation.what, *shown, sep="\n    failed, as expected: ", flush=True)
            bad += [f"'{case}' passes without its safeguard: {mutation.what}" for case in passed]
            if not passed and not shown:
                bad.append(f"no test for: {mutation.what}")
    for line in bad:
        print("DID NOT FAIL: " + line)
    print(f"{len(chosen)} safeguards removed, {f'{len(bad)} times NO test failed' if bad else 'each time its tests failed'}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
