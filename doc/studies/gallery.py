#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Writes doc/gallery.md: of each deck a picture, the commands that make it, and its numbers beside what they should be; and these
numbers into the table of lammps_inputs/README.md.

    doc/studies/gallery.py [--only traction rod] [--work FOLDER] [--out doc/gallery.md]

Runs the commands of doc/studies/gallery_scenes.py in --work, one after the other, and copies the pictures to gallery/ beside the page.
With --only neither is written: the numbers are printed, and the pictures stay in --work. EVP_LMP as for the tests.
"""

import os
import pathlib
import platform
import re
import resource
import shutil
import string
import subprocess
import sys

from study import CHECKOUT, DECKS, STUDIES, RunError, add_out, command_line, environment, errors_in_one_line, lammps_command, split_at_marks, table, watched
import gallery_scenes
from evp import spheres

HEADER = ("number", "measured", "to expect", "source")
MARKS = "<!-- table: doc/studies/gallery.py -->", "<!-- end of table -->"
NUMBERS = ("deck", "number", "measured", "to expect", "source, commands")
COLORS = 256  # of the stored PNG files, which are half as large for it

SCENE = """## {scene.title}

![{scene.title}](gallery/{scene.picture})

{scene.shows}

    {commands}

{time} of processor time, packing and picture included.

{table}
"""


def prepare(folder):
    """Links to what the commands of the page name, as from the root of the checkout."""
    (folder / "build").mkdir(parents=True, exist_ok=True)
    targets = {name: CHECKOUT / name for name in ("lammps_inputs", "potentials", "tests", "tools")}
    for name, target in {**targets, "build/lmp": pathlib.Path(lammps_command()[0])}.items():
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(target)


def run(commands, folder):
    """(what the commands printed, processor time [s]). RunError with the end of the output where one failed."""
    script = "\n".join(["set -e", *commands])
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(["bash", "-c", script], cwd=folder, env={**os.environ, **environment()}, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RunError(f"a command failed (exit {done.returncode}); its output ends with\n{done.stdout[-1500:]}")
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def with_unit(value, unit):
    return "-" if value is None else f"{value:.4g} {unit}".strip()


def rows(numbers):
    """Of the table of a scene."""
    return [(one.what, with_unit(one.value, one.unit), with_unit(one.expected, one.unit), one.source) for one in numbers]


def anchor(title):
    """Of a heading of the page."""
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def readme_rows(scene, numbers):
    """Of the table of lammps_inputs/README.md, whose links are from there."""
    link = f"[{scene.title}](../doc/gallery.md#{anchor(scene.title)})"
    found = []
    for one, cells in zip(numbers, rows(numbers)):
        source = re.sub(r"\]\((?!\.\./)", "](../doc/", one.source)
        found.append((f"`{one.deck or scene.deck}`", *cells[:3], f"{source}; {link}"))
    return found


def store(picture, folder):
    """Copies a picture, a PNG with fewer colors."""
    folder.mkdir(parents=True, exist_ok=True)
    if picture.suffix == ".png":
        from PIL import Image

        with Image.open(picture) as image:
            image.convert("RGB").quantize(COLORS, dither=Image.Dither.NONE).save(folder / picture.name, optimize=True)
    else:
        shutil.copyfile(picture, folder / picture.name)


def main(words=None):
    parser = command_line(__doc__)
    names = [scene.key for scene in gallery_scenes.SCENES]
    parser.add_argument("--only", nargs="+", choices=names, metavar="SCENE", help=f"of {', '.join(names)}")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "gallery", help="where the commands run (default: %(default)s)")
    add_out(parser, "gallery.md")
    options = parser.parse_args(words)
    chosen = [scene for scene in gallery_scenes.SCENES if scene.key in (options.only or names)]
    texts, lines, total, readme = [], [], 0.0, DECKS / "README.md"
    with errors_in_one_line("gallery.py"):
        head, _, tail = split_at_marks(readme, *MARKS)
        spheres.check()
        prepare(options.work)
        for scene in watched("gallery.py:", chosen, lambda scene: scene.key):
            text, seconds = run(scene.commands, options.work)
            numbers = scene.numbers(options.work, text)
            found = table(HEADER, rows(numbers))
            lines += readme_rows(scene, numbers)
            total += seconds
            texts.append(SCENE.format(scene=scene, commands="\n    ".join(scene.commands), time=f"{seconds:.1f} s", table="\n".join(found)))
            if options.only:
                print(scene.title, *found, f"{seconds:.1f} s", sep="\n")
            else:
                store(options.work / scene.picture, options.out.parent / "gallery")
        if not options.only:
            machine = f"{platform.machine()}, LAMMPS on 1 rank"
            page = string.Template((STUDIES / "gallery.md").read_text(encoding="utf-8"))
            options.out.write_text(page.substitute(total=f"{total:.0f}", machine=machine, scenes="\n".join(texts).rstrip("\n")), encoding="utf-8")
            readme.write_text("\n".join([head + MARKS[0], *table(NUMBERS, lines), MARKS[1] + tail]), encoding="utf-8")
            print(options.out, readme, sep="\n")


if __name__ == "__main__":
    sys.exit(main())
