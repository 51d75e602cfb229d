# SPDX-License-Identifier: GPL-2.0-only
"""The site of the manual: builds without a warning, every link leads somewhere, and each fault of a page is named."""

import re
import shutil
import subprocess

import website
from evp.run import CHECKOUT as REPOSITORY


def build(root, out, *words):
    return subprocess.run([str(root / "tests" / "maintain" / "website.py"), "--out", str(out), *words], stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, check=False, timeout=300)


def html(site, name):
    return (site / f"{name}.html").read_text(encoding="utf-8")


def test_site(tmp_path):
    """Every link, picture and anchor is there; links that a view of the repository follows lead to the page on the site, or a copy of a file that
    is no page; formulas are MathML; the page of the tools has the help of each."""
    site = tmp_path / "site"
    done = build(REPOSITORY, site)
    assert done.returncode == 0 and not done.stderr and done.stdout == f"{site / 'index.html'}\n", done.stderr[-5000:]
    assert website.faults(site) == [] and (site / ".nojekyll").exists()
    assert not [path for path in site.rglob("*.html") if str(REPOSITORY) in path.read_text(encoding="utf-8")], "a path of this machine"

    readme, gallery, decks, tools = (html(site, name) for name in ("readme", "gallery", "decks", "tools"))
    assert 'href="Howto_evp.html"' in readme and 'href="pair_evp_lj.html"' in gallery and 'href="decks.html"' in gallery
    assert 'href="Howto_evp_part.html"' in decks and re.search(r'href="_downloads/\w+/metals\.evp"', decks)
    pages = {path.name: path.read_text(encoding="utf-8") for path in site.glob("*.html")}
    for name, page in pages.items():
        sources = [link for link in re.findall(r'href="([^"]+)"', page) if re.search(r"\.(rst|md)(#|$)", link) and "_downloads" not in link and "://" not in link]
        assert not sources, (name, sources)

    typed = sum(len(re.findall(r":math:`|^ *\.\. math::", path.read_text(encoding="utf-8"), re.M)) for path in (REPOSITORY / "doc").glob("*.rst"))
    assert typed > 100 and sum(page.count("<math ") for page in pages.values()) == typed and "<mfrac>" in html(site, "pair_evp_lj")
    assert (site / "_static" / "math" / "evp-math.woff2").stat().st_size > 10000
    usages = [*(f"{tool.name} " for tool in (REPOSITORY / "tools").glob("*.py")), "curves.py numbers ", "tools/setup.sh"]
    assert not [usage for usage in usages if f"usage: {usage}" not in tools]


FAULTS = {
    "README.md": "# Read\n\n[page](doc/a.rst) [anchor](doc/a.rst#no-such) [dead](doc/none.rst) [folder](doc)\n\n![none](doc/none.png)\n",
    "lammps_inputs/README.md": "# Decks\n\n[back](../README.md) [out](../../x.md) [file](in.x)\n",
    "lammps_inputs/in.x": "run 0\n",
    "doc/a.rst": "A\n=\n\n`dead <gone.rst>`__, `decks <../lammps_inputs/README.md>`__, :math:`\\nosuch{x}`\n",
    "doc/lonely.md": "# Lonely\n",
    "doc/index.rst": "I\n=\n\n.. toctree::\n\n   readme\n   decks\n   a\n   tools\n   unwritten\n"}


def test_each_fault_is_named(tmp_path):
    root = tmp_path / "repository"
    for name in ("tools/evp", "tests/maintain", "doc/_ext", "doc/_static"):
        shutil.copytree(REPOSITORY / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy2(REPOSITORY / "doc" / "conf.py", root / "doc")
    (root / "lammps_inputs").mkdir()
    for path, text in FAULTS.items():
        (root / path).write_text(text, encoding="utf-8")
    done = build(root, tmp_path / "site")
    assert done.returncode == 1 and "mend what is named above" in done.stderr
    for message in ("README.md:3: WARNING: no file 'doc/none.rst' in the repository", "README.md:5: WARNING: no file 'doc/none.png'",
                    "lammps_inputs/README.md:3: WARNING: no file '../../x.md'", "doc/a.rst:4: WARNING: no file 'gone.rst'",
                    "doc/a.rst:4: WARNING: formula that docutils cannot convert to MathML: \\nosuch{x}",
                    "doc/lonely.md: WARNING: document isn't included in any toctree\n    remedy: name the page in a toctree of doc/index.rst",
                    "reference to nonexisting document 'unwritten'\n    remedy: write the page",
                    "site/readme.html: 'a.html#no-such' names no anchor of that page"):
        assert message in done.stderr, (message, done.stderr)
    assert len(re.findall("WARNING|names no|leads to", done.stderr)) == 8, done.stderr
    decks = html(tmp_path / "site", "decks")
    assert 'href="readme.html"' in decks and re.search(r'href="_downloads/\w+/in\.x"', decks)


def test_check_of_a_site_finds_each_kind_of_fault(tmp_path):
    (tmp_path / "s.css").write_text("a{background:url(f.woff2)}b{background:url('data:x')}", encoding="utf-8")
    (tmp_path / "a.html").write_text(
        '<p id="x"><a href="#x">1</a><a href="#y">2</a><a href="/a.html">3</a><a href="file:///a">4</a><a href="../b">5</a>'
        '<img src="c.png"><script src="https://x.org/m.js"></script><a href="https://x.org">6</a><a href="a.html#x">7</a>', encoding="utf-8")
    assert [re.search(r"'(.*)' (.*)", fault).groups() for fault in website.faults(tmp_path)] == [
        ("#y", "names no anchor of that page"), ("/a.html", "is no relative link"), ("file:///a", "is no link that works on a host"),
        ("../b", "leads to no file"), ("c.png", "leads to no file"), ("https://x.org/m.js", "is loaded from elsewhere"),
        ("f.woff2", "leads to no file")]
