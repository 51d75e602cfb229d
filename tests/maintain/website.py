#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Builds the site of the manual from doc/, README.md, lammps_inputs/README.md and the tools' own help.

    tests/maintain/website.py                    into build/site; open build/site/index.html in any browser
    tests/maintain/website.py --out FOLDER

The folder can be copied to any static host: links are relative, and nothing is loaded from other hosts. Warnings of Sphinx are
errors: a dead link or anchor, a missing picture, a page in no table of contents.
"""

import contextlib
import pathlib
import subprocess
import sys
import tempfile

import tools_path  # noqa: F401  before evp
from evp.interpreter import require

require("sphinx", "sphinx_rtd_theme", "myst_parser", remedy="call apt-get install python3-sphinx python3-sphinx-rtd-theme "
        "python3-myst-parser python3-sphinx-copybutton (other systems: pip install sphinx sphinx-rtd-theme myst-parser sphinx-copybutton)")

from evp.report import command_line, errors_in_one_line  # noqa: E402
from evp.run import CHECKOUT  # noqa: E402
from site_check import faults  # noqa: E402
from site_pages import put_together  # noqa: E402

SITE = CHECKOUT / "build" / "site"
WORK = CHECKOUT / "build" / "site-work"  # kept, so that only pages that have changed are written
REMEDIES = {"isn't included in any toctree": "name the page in a toctree of doc/index.rst",
            "contains reference to nonexisting document": "write the page, or take its line out of the toctree of doc/index.rst",
            "formula that docutils cannot convert": "write it with commands that docutils' latex2mathml knows, e.g. cases for an array with one brace"}


def messages(text, sources):
    """Lines of Sphinx with the paths of the repository, each with a remedy where there is a known one."""
    for file, path in sources.items():
        text = text.replace(str(file), path)
    for line in text.splitlines():
        yield line + "".join(f"\n    remedy: {remedy}" for sign, remedy in REMEDIES.items() if sign in line)


def build(out, work):
    """Writes the site, with its pages as Sphinx reads them in work; True if nothing is wrong with it."""
    sources = put_together(CHECKOUT, work / "pages")
    words = [sys.executable, "-m", "sphinx", *"-W --keep-going -n -q -b html -c".split(), CHECKOUT / "doc", "-d", work / "doctrees", work / "pages", out]
    done = subprocess.run(words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    dead = [f"{out.name}/{fault}" for fault in faults(out)]
    print(*messages(done.stderr, sources), *dead, sep="\n", end="\n" if done.stderr or dead else "", file=sys.stderr)
    return done.returncode == 0 and not dead


def main(argv=None):
    parser = command_line(__doc__)
    parser.add_argument("--out", type=pathlib.Path, default=SITE, help="the folder to write (default: build/site)")
    chosen = parser.parse_args(argv)
    out = chosen.out.resolve()
    with errors_in_one_line("website.py"), contextlib.ExitStack() as kept:
        if not (CHECKOUT / "doc" / "conf.py").exists():
            raise ValueError(f"{CHECKOUT} has no pages: call it in the source tree")
        if out.exists() and any(out.iterdir()) and not (out / "objects.inv").exists():
            raise ValueError(f"{out} is not empty and holds no site: give another folder by --out")
        work = WORK if out == SITE else pathlib.Path(kept.enter_context(tempfile.TemporaryDirectory()))
        if not build(out, work):
            raise ValueError("the site is not as it should be: mend what is named above and call again")
    print(out / "index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
