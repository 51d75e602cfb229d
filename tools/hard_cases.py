#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs the robustness tests of tests/lammps and writes what each showed to doc/hard_cases.md.

    tools/hard_cases.py [--only WORDS] [--ranks 1 4] [--out doc/hard_cases.md]

EVP_LMP and EVP_MPIRUN as for the tests. Exit code 1 if a case failed; the table then says so.
"""

import pathlib
import sys
import tempfile

import evp  # noqa: F401  before the scenes, which need numpy
from evp.progress import watched
from evp.report import add_out, command_line, table
from evp.run import CHECKOUT

HEAD = """# Robustness tests

Written by `tools/hard_cases.py`; the scenes are in `tests/lammps/hard_cases*.py`, and are part of the test suite.
*Right* is what the case asserts. *Must fail with* are the safeguards that `tools/mutations.py` removes from the sources, one at a time, checking
that the case then fails; after them the control that the case itself holds.

"""
HEADER = ("case", "right", "showed", "must fail with; control")


def load_scenes():
    """The module of the scenes, which has this file's name."""
    sys.path[:0] = [str(CHECKOUT / "tests" / "lammps"), str(CHECKOUT / "tools")]
    sys.modules.pop("hard_cases", None)
    import hard_cases
    import hard_cases_bodies  # noqa: F401  joins the list
    import hard_cases_box  # noqa: F401  joins the list
    import hard_cases_flow  # noqa: F401  joins the list
    import hard_cases_spin  # noqa: F401  joins the list
    import hard_cases_within  # noqa: F401  joins the list

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
    parser = command_line(__doc__)
    parser.add_argument("--only", default="", help="cases whose name holds these words")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1], help="numbers of ranks (default 1)")
    add_out(parser, "hard_cases.md")
    options = parser.parse_args(words)
    if min(options.ranks) < 1:
        parser.error("--ranks must be positive")

    scenes = load_scenes()
    chosen = [case for case in scenes.CASES if options.only in case.name]
    if not chosen:
        parser.error(f"no case holds '{options.only}'")
    rows, failed = [], 0
    for case in watched("robustness tests", chosen, lambda case: case.name):
        shown = []
        for ranks in options.ranks:
            text, right = run_case(scenes, case, ranks)
            failed += not right
            shown.append(text if len(options.ranks) == 1 else f"{ranks} rank{'s' * (ranks > 1)}: {text}")
        rows.append([cell.replace("|", "/") for cell in (case.name, case.right, "<br>".join(shown), proof(case))])
    options.out.write_text(HEAD + "\n".join(table(HEADER, rows)) + "\n", encoding="utf-8")
    print(f"{len(chosen)} cases, {f'{failed} runs FAILED' if failed else 'all right'}: {options.out}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
