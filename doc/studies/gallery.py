#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs the commands of doc/gallery.md and writes its numbers beside what they should be.

    doc/studies/gallery.py [--only traction.png dog_bone.png] [--work FOLDER]

The commands run in --work, one scene after the other; the pictures are copied to doc/gallery. With --only nothing is written: the numbers are
printed, and the pictures stay in --work. EVP_LMP as for the tests.
"""

import pathlib
import re
import sys
from typing import NamedTuple

from study import CHECKOUT, check_drawing, command_line, errors_in_one_line, lammps_command, run_blocks, store_picture, table, watched
from gallery_scenes import SCENES

PAGE = CHECKOUT / "doc" / "gallery.md"
HEADER = ("number", "measured", "to expect", "source")
NUMBERS = "<!-- numbers: doc/studies/gallery.py -->\n", "<!-- end of numbers -->"


class Part(NamedTuple):
    """A section of the page: title, picture, its commands, and what gallery.py wrote."""

    title: str
    picture: str
    commands: list
    written: str


def parts():
    """Sections of the page."""
    found = []
    for text in PAGE.read_text(encoding="utf-8").split("\n## ")[1:]:
        commands = [line[4:] for line in text.splitlines() if line.startswith("    ")]
        found.append(Part(text.partition("\n")[0], re.search(r"\]\(gallery/(\S+)\)", text)[1], commands, text.partition(NUMBERS[0])[2].partition(NUMBERS[1])[0]))
    return found


def prepare(folder):
    """Links to what the commands of the page name, as from the root of the checkout."""
    (folder / "build").mkdir(parents=True, exist_ok=True)
    targets = {name: CHECKOUT / name for name in ("lammps_inputs", "potentials", "tests", "tools")}
    for name, target in {**targets, "build/lmp": pathlib.Path(lammps_command()[0])}.items():
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(target)


def measure(part, folder):
    """(numbers, processor time [s]) of the commands of a section."""
    [(text, seconds)] = run_blocks(["\n".join(part.commands)], folder)
    return SCENES[part.picture](folder, text), seconds


def with_unit(value, unit):
    return "-" if value is None else f"{value:.4g} {unit}".strip()


def rows(part, numbers):
    """Of the table of a section: what and source as they stand there, the numbers new. ValueError where there are not as many."""
    cells = [line.strip("| ").split(" | ") for line in part.written.splitlines() if line.startswith("| ")][1:]
    if len(cells) != len(numbers):
        raise ValueError(f"{PAGE}, '{part.title}' has {len(cells)} rows, gallery_scenes.py {len(numbers)} numbers")
    return [(what, with_unit(one.value, one.unit), with_unit(one.expected, one.unit), source) for (what, _, _, source), one in zip(cells, numbers)]


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--only", nargs="+", choices=SCENES, metavar="PICTURE", help=f"of {', '.join(SCENES)}")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "gallery", help="where the commands run (default: %(default)s)")
    options = parser.parse_args(words)
    page = PAGE.read_text(encoding="utf-8")
    with errors_in_one_line("gallery.py"):
        check_drawing()
        prepare(options.work)
        for part in watched("gallery.py:", [part for part in parts() if part.picture in (options.only or SCENES)], lambda part: part.title):
            numbers, seconds = measure(part, options.work)
            text = "\n".join([f"{seconds:.1f} s of processor time, packing and picture included.\n", *table(HEADER, rows(part, numbers)), ""])
            print(part.title, text, sep="\n")
            page = page.replace(part.written, text)
            if not options.only:
                store_picture(options.work / part.picture, PAGE.parent / "gallery")
        if not options.only:
            PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
