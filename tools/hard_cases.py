#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs the hard cases of tests/lammps and writes what each showed to doc/hard_cases.md.

    tools/hard_cases.py [--only WORDS] [--ranks 1 4] [--out doc/hard_cases.md]

EVP_LMP and EVP_MPIRUN as for the tests. Exit code 1 if a case failed; the table then says so.
"""

import argparse
import pathlib
import sys
import tempfile
import time

import evp  # noqa: F401  before the scenes, which need numpy

CHECKOUT = pathlib.Path(__file__).resolve().parents[1]

HEAD = """# Hard cases

Written by `tools/hard_cases.py`; the scenes are in `tests/lammps/hard_cases.py` and `tests/lammps/hard_cases_bodies.py`, and are tests too.
*Right* is what the case asserts. *Must fail with* is what `tools/mutations.py` does to the sources, one at a time, demanding that the case then
fails; after it the control that the case itself holds.

| case | right | showed | must fail with; control |
|---|---|---|---|
"""


def progress(done, whole, begin, name):
    """One line: rewritten on a terminal, else one per case."""
    spent = time.monotonic() - begin
    left = f", about {spent * (whole - done) / done:.0f} s left" if done else ""
    text = f"hard cases {done}/{whole}{left}: {name}"
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
    else:
        print(text, file=sys.stderr, flush=True)


def load_scenes():
    """The module of the scenes, which has this file's name."""
    sys.path[:0] = [str(CHECKOUT / "tests" / "lammps"), str(CHECKOUT / "tools")]
    sys.modules.pop("hard_cases", None)
    import hard_cases
    import hard_cases_bodies  # noqa: F401  joins the list

    return hard_cases


def proof(case):
    """The mutations that the case must fail with, and its own control."""
    from mutations import MUTATIONS

    seen = [mutation.what for mutation in MUTATIONS if any(words in case.name for words in mutation.cases)]
    return "; ".join(seen) + (f". Control: {case.control}" if case.control else "")


def run_case(scenes, case, ranks):
    """What the case showed on so many ranks, and whether it is right."""
    from lammps_run import run_lammps

    with tempfile.TemporaryDirectory() as folder:
        bench = scenes.Bench(lambda text, n: run_lammps(text, n, None, folder, seconds=900), pathlib.Path(folder), ranks, whole=True)
        try:
            return case.check(bench), True
        except AssertionError as error:
            return f"FAILED: {str(error).splitlines()[0] if str(error) else 'its assertion'}", False


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="cases whose name holds these words")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1], help="numbers of ranks (default 1)")
    parser.add_argument("--out", type=pathlib.Path, default=CHECKOUT / "doc" / "hard_cases.md", help="the file to write")
    options = parser.parse_args(words)
    if min(options.ranks) < 1:
        parser.error("--ranks must be positive")

    scenes = load_scenes()
    chosen = [case for case in scenes.CASES if options.only in case.name]
    if not chosen:
        parser.error(f"no case holds '{options.only}'")
    lines, all_right, begin = [], True, time.monotonic()
    for number, case in enumerate(chosen):
        progress(number, len(chosen), begin, case.name)
        shown = []
        for ranks in options.ranks:
            text, right = run_case(scenes, case, ranks)
            all_right = all_right and right
            shown.append(text if len(options.ranks) == 1 else f"{ranks} rank{'s' * (ranks > 1)}: {text}")
        lines.append("| " + " | ".join(cell.replace("|", "/") for cell in (case.name, case.right, "<br>".join(shown), proof(case))) + " |\n")
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr)
    options.out.write_text(HEAD + "".join(lines), encoding="utf-8")
    print(f"{len(chosen)} cases in {time.monotonic() - begin:.0f} s, {'all right' if all_right else 'NOT ALL RIGHT'}: {options.out}")
    return 0 if all_right else 1


if __name__ == "__main__":
    sys.exit(main())
