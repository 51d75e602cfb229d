#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs the robustness tests of tests/lammps and writes their results to doc/hard_cases.md.

    tools/hard_cases.py [--only WORDS] [--ranks 1 4] [--out doc/hard_cases.md]

Rows of tests that are not run keep their results. LAMMPS is the lmp of this checkout, or EVP_LMP and EVP_MPIRUN. Exit code 1 if a
test failed; its row says so.
"""

import pathlib
import re
import sys
import tempfile
import traceback

import evp  # noqa: F401  before the scenes, which need numpy
from evp.progress import watched
from evp.report import add_out, command_line, table
from evp.run import CHECKOUT

HEAD = """# Robustness tests

{answer}
Each test fails with the faults in its row: `tests/maintain/faults.py` builds the plugin with each fault of `src/core/fault.h` and checks that.

Written by `tools/hard_cases.py`, with `--ranks` and `--only`; the tests are in `tests/lammps/hard_cases*.py` and are part of the test suite.

- *Requirement*: what the test asserts.
- *Result*: what was measured, for each number of MPI ranks.
- *Fails with*: faults of a build. *Control*: what the test asserts in addition, so that it cannot pass without the effect.

"""
HEADER = ("test", "requirement", "result", "fails with")
FAILED = "FAILED: "
SHOWN = {"paper s": "paper's", "xi s": "xi_s", "off centre": "off-centre", "to 50 percent": "to 50 %"}  # in names, which are those of functions


def shown_name(case):
    """Name of a test as a person reads it."""
    name = case.name
    for words, better in SHOWN.items():
        name = name.replace(words, better)
    return name


def known_results(page):
    """{name: result} of the rows of a page; empty where there is none."""
    if not page.exists():
        return {}
    rows = [line.strip("|").split(" | ") for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    return {row[0].strip(): row[2] for row in rows if len(row) == len(HEADER)}


def answer(results):
    """The first sentence of the page. results: of all rows."""
    failed = sum(FAILED in text for text in results)
    ranks = sorted({int(n) for text in results for n in re.findall(r"(?:^|<br>)(\d+) ranks?: ", text)})
    on = f" on {', '.join(map(str, ranks))} MPI ranks" if ranks else ""
    return f"{len(results)} tests: " + (f"{failed} FAILED." if failed else f"all pass{on}.")


def load_scenes():
    """The module of the scenes, which has this file's name."""
    sys.path[:0] = [str(CHECKOUT / "tests" / "lammps"), str(CHECKOUT / "tests" / "maintain"), str(CHECKOUT / "tests"), str(CHECKOUT / "tools")]
    sys.modules.pop("hard_cases", None)
    import hard_cases
    import hard_cases_bodies  # noqa: F401  joins the list
    import hard_cases_box  # noqa: F401  joins the list
    import hard_cases_flow  # noqa: F401  joins the list
    import hard_cases_spin  # noqa: F401  joins the list
    import hard_cases_within  # noqa: F401  joins the list

    return hard_cases


def proof(case):
    """The faults that the case must fail with, and its own control."""
    from faults import cases_of, read_faults

    seen = [fault.what for name, fault in read_faults(CHECKOUT / "src").items() if cases_of(name, [case])]
    return "; ".join(seen) + (f". *Control*: {case.control}" if case.control else "")


def run_case(scenes, case, ranks):
    """What the case showed on so many ranks, and whether it is right."""
    from lammps_run import run_lammps

    with tempfile.TemporaryDirectory() as folder:
        bench = scenes.Bench(lambda text, n: run_lammps(text, n, None, folder, seconds=900), pathlib.Path(folder), ranks, whole=True)
        try:
            return case.check(bench), True
        except AssertionError as error:
            return FAILED + (str(error).splitlines()[0] if str(error) else traceback.extract_tb(error.__traceback__)[-1].line), False


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--only", default="", help="run only the tests whose name contains these words")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1], help="numbers of MPI ranks (default 1)")
    add_out(parser, "hard_cases.md")
    options = parser.parse_args(words)
    if min(options.ranks) < 1:
        parser.error("--ranks must be positive")

    scenes = load_scenes()
    chosen = [case for case in scenes.CASES if options.only in case.name]
    if not chosen:
        parser.error(f"no test has '{options.only}' in its name")
    results, failed = known_results(options.out), 0
    for case in watched("robustness tests", chosen, lambda case: case.name):
        shown = []
        for ranks in options.ranks:
            text, right = run_case(scenes, case, ranks)
            failed += not right
            shown.append(text if len(options.ranks) == 1 else f"{ranks} rank{'s' * (ranks > 1)}: {text}")
        results[shown_name(case)] = "<br>".join(shown).replace("|", "/")
    rows = [[shown_name(case), case.right, results[shown_name(case)], proof(case)] for case in scenes.CASES if shown_name(case) in results]
    text = HEAD.format(answer=answer([row[2] for row in rows])) + "\n".join(table(HEADER, rows)) + "\n"
    options.out.write_text(text, encoding="utf-8")
    print(f"{len(chosen)} tests, {f'{failed} runs FAILED' if failed else 'all passed'}: {options.out}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
