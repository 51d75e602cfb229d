#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Builds the site of the manual from doc/, README.md, lammps_inputs/README.md and the tools' own help.

    tests/maintain/website.py                    into build/site; open build/site/index.html in any browser
    tests/maintain/website.py --out FOLDER

The folder can be copied to any static host: links are relative, and nothing is loaded from other hosts. Warnings of Sphinx are
errors: a dead link or anchor, a missing picture, a page in no table of contents.
"""

import contextlib
import html.parser
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.parse

import tools_path  # noqa: F401  before evp
from evp import require

require("sphinx", "sphinx_rtd_theme", "myst_parser", remedy="call apt-get install python3-sphinx python3-sphinx-rtd-theme "
        "python3-myst-parser python3-sphinx-copybutton (other systems: pip install sphinx sphinx-rtd-theme myst-parser sphinx-copybutton)")

from evp.report import command_line, errors_in_one_line  # noqa: E402
from evp.run import CHECKOUT  # noqa: E402
from site_pages import put_together  # noqa: E402

SITE = CHECKOUT / "build" / "site"
WORK = CHECKOUT / "build" / "site-work"  # kept, so that only pages that have changed are written
REMEDIES = {"isn't included in any toctree": "name the page in a toctree of doc/index.rst",
            "contains reference to nonexisting document": "write the page, or take its line out of the toctree of doc/index.rst",
            "formula that docutils cannot convert": "write it with commands that docutils' latex2mathml knows, e.g. cases for an array with one brace"}


# ---- what Sphinx does not look at in a site that it has written: anchors, and what would be loaded from elsewhere

LOADED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src"), ("video", "src"), ("object", "data")}
CSS = re.compile(r"url\(\s*[\"']?([^\"')]+)")


class Page(html.parser.HTMLParser):
    """Names of anchors, and (address, is it loaded with the page) of links."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.links = {""}, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name == "id":
                self.anchors.add(value)
            elif (tag, name) in LOADED or (tag == "a" and name == "href"):
                self.links.append((value or "", (tag, name) in LOADED))


def faults(folder):
    """One line for each link, picture, script or font of the pages in a folder that does not lead to something in it."""
    folder = pathlib.Path(folder).resolve()
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))}
    found = [fault for path, page in pages.items() for link, loaded in page.links for fault in fault_of(folder, pages, path, link, loaded)]
    for path in sorted(folder.rglob("*.css")):
        for link in CSS.findall(path.read_text(encoding="utf-8")):
            found += fault_of(folder, {}, path, link, True)
    return found


def fault_of(folder, pages, path, link, loaded):
    address = urllib.parse.urlsplit(link)
    where = f"{path.relative_to(folder)}: '{link}'"
    if address.scheme == "data":
        return
    if address.scheme or address.netloc:
        if loaded:
            yield f"{where} is loaded from elsewhere"
        elif address.scheme not in ("https", "http", "mailto"):
            yield f"{where} is no link that works on a host"
        return
    if address.path.startswith("/"):
        yield f"{where} is no relative link"
        return
    target = (path.parent / urllib.parse.unquote(address.path)).resolve() if address.path else path
    if folder not in target.parents or not target.is_file():
        yield f"{where} leads to no file"
    elif target in pages and urllib.parse.unquote(address.fragment) not in pages[target].anchors:
        yield f"{where} names no anchor of that page"


# ---- the site

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
