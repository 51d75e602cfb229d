#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Writes the outputs, pictures and times of doc/tutorial.rst, from a run of all commands of the page.

    doc/studies/tutorial_page.py [--work FOLDER]

All blocks of commands run in one shell that starts in the root of the checkout, with --work as home. Between the marks '.. output: PATTERN' and
'.. end of output' stand the lines of the last block before them that the pattern is found in. About four minutes on two cores.
"""

import pathlib
import re
import shutil
import textwrap
from typing import NamedTuple

from study import CHECKOUT, check_drawing, command_line, errors_in_one_line, list_table, run_blocks, store_picture, write_between

PAGE = CHECKOUT / "doc" / "tutorial.rst"
PICTURES = PAGE.parent / "tutorial"
COSTS = ".. costs: written by doc/studies/tutorial_page.py\n", ".. end of costs"
_STEP = re.compile(r"^\*\*(\d+\. .+)\*\*$", re.M)
_BLOCK = re.compile(r"^\.\. code-block:: bash\n\n((?:   .*\n|\n)+)", re.M)
_OUTPUT = re.compile(r"^(\.\. output: ([^\n]+)\n\n)(.*?)(?=^\.\. end of output$)", re.M | re.S)


class Step(NamedTuple):
    """A block of commands: its heading, the commands, the pattern of the lines to show or None, the lines that the page shows."""

    title: str
    commands: str
    pattern: str
    shown: str


def steps(text):
    """Steps of the page."""
    found, parts = [], _STEP.split(text)
    for title, part in zip(parts[1::2], parts[2::2]):
        block, output = _BLOCK.search(part), _OUTPUT.search(part)
        if len(_BLOCK.findall(part)) != 1 or not output or len(_OUTPUT.findall(part)) != 1 or output.start() < block.start():
            raise ValueError(f"{PAGE}, '{title}': a step has one block of commands, and after it '.. output: PATTERN' and '.. end of output'")
        found.append(Step(title, textwrap.dedent(block[1]).strip(), output[2], textwrap.dedent(output[3].partition("::")[2].partition("\n")[2]).strip("\n")))
    return found


def lines_shown(text, pattern):
    """What the page shows of an output; ValueError where it is nothing."""
    found = [line.rstrip() for line in text.splitlines() if re.search(pattern, line)]
    if not found:
        raise ValueError(f"no line of the output has '{pattern}':\n{text[-1500:]}")
    return "\n".join(found)


def main(argv=None):
    """Runs all, and rewrites the page."""
    parser = command_line(__doc__)
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "results" / "tutorial", metavar="FOLDER", help="where the commands run (default: %(default)s)")
    args = parser.parse_args(argv)
    with errors_in_one_line("tutorial_page.py"):
        check_drawing()
        text = PAGE.read_text(encoding="utf-8")
        found = steps(text)
        shutil.rmtree(args.work, ignore_errors=True)  # a calibration would go on from an earlier one
        args.work.mkdir(parents=True)
        results = run_blocks([step.commands for step in found], CHECKOUT, args.work.resolve())
        outputs = iter([lines_shown(printed, step.pattern) for step, (printed, _) in zip(found, results)])
        text = _OUTPUT.sub(lambda place: f"{place[1]}.. code-block:: text\n\n{textwrap.indent(next(outputs), '   ')}\n\n", text)
        PAGE.write_text(text.replace(str(CHECKOUT), "~/evp"), encoding="utf-8")
        times = [(step.title.partition(". ")[2], seconds) for step, (_, seconds) in zip(found, results)]
        rows = [("step", "time [s]"), *((title, f"{seconds:.0f}") for title, seconds in [*times, ("all", sum(seconds for _, seconds in times))])]
        write_between(PAGE, *COSTS, list_table(rows))
        for name in re.findall(r"^\.\. image:: tutorial/(\S+)", text, re.M):
            store_picture(args.work / "bar" / name, PICTURES, 128)
    print(f"updated {PAGE} and {PICTURES}")


if __name__ == "__main__":
    main()
