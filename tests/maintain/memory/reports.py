#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Tells our reports of AddressSanitizer, UBSan, LeakSanitizer and Memcheck from those of other libraries.

    reports.py FILE...

Prints every report with a frame in the plugin or its sources; exit status 1 if there is one. Others are counted."""

import pathlib
import re
import sys

SOURCES = pathlib.Path(__file__).resolve().parents[3] / "src"
# The plugin's file, and its sources by name: LAMMPS has files in a folder src too.
OURS = re.compile(r"evpplugin\.so|\b(?:" + "|".join(re.escape(path.name) for path in sorted(SOURCES.rglob("*.*"))) + r")\b")
START = re.compile(
    r"ERROR: AddressSanitizer|runtime error:|(?:Direct|Indirect) leak of|ERROR: LeakSanitizer: "
    r"|Invalid (?:read|write|free)|uninitialised|Mismatched free|Source and destination overlap"
    r"|are (?:definitely|indirectly|possibly) lost|fishy|Process terminating")


def split_reports(text):
    """The reports in a log, each a list of lines: from a line that starts one to an empty line or the next start; one of AddressSanitizer goes on over
    empty lines, as where the memory came from is told after one."""
    reports, current, whole = [], None, False
    for line in text.splitlines():
        bare = re.sub(r"^==\d+==\s?", "", line)
        if START.search(bare) and not (whole and "leak of" not in bare):
            current = [line]
            whole = "ERROR: AddressSanitizer" in bare
            reports.append(current)
        elif current is not None and (bare.strip() or whole):
            current.append(line)
        else:
            current = None
    return reports


def main(names):
    reports = [(name, report) for name in names for report in split_reports(pathlib.Path(name).read_text(encoding="utf-8", errors="replace"))]
    ours = [(name, report) for name, report in reports if any(map(OURS.search, report))]
    for name, report in ours[:20]:
        print(f"-- {name}", *report[:60], sep="\n")
    print(f"{len(names)} logs: {len(ours)} reports with our files in them, {len(reports) - len(ours)} of other libraries alone")
    return 1 if ours else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
