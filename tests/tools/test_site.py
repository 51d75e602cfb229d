# SPDX-License-Identifier: GPL-2.0-only
"""The site of the manual: builds without a warning, every link leads somewhere, and each fault of a page is named."""

import pathlib
import re
import shutil
import subprocess

import pytest
import site_check

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


def build(root, out, *words):
    return subprocess.run([str(root / "tests" / "maintain" / "website.py"), "--out", str(out), *words], stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, check=False, timeout=300)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    out = tmp_path_factory.mktemp("built") / "site"
    done = build(REPOSITORY, out)
    assert done.returncode == 0 and not done.stderr, done.stderr[-5000:]
    assert done.stdout == f"{out / 'index.html'}\n"
    return out


def html(site, name):
    return (site / f"{name}.html").read_text(encoding="utf-8")


def test_every_link_picture_and_anchor_is_there(site):
    assert site_check.faults(site) == []
    assert (site / ".nojekyll").exists()
    assert not [path for path in site.rglob("*.html") if str(REPOSITORY) in path.read_text(encoding="utf-8")], "a path of this machine"


def test_pages_link_each_other_and_not_their_sources(site):
    """Links that a view of the repository follows: to the page on the site, a copy of a file that is no page."""
    readme, gallery, decks = (html(site, name) for name in ("readme", "gallery", "decks"))
    assert 'href="Howto_evp.html"' in readme and 'href="pair_evp_lj.html"' in gallery and 'href="decks.html"' in gallery
    assert 'href="Howto_evp_part.html"' in decks and re.search(r'href="_downloads/\w+/metals\.evp"', decks)
    for path in site.glob("*.html"):
        sources = [link for link in re.findall(r'href="([^"]+)"', path.read_text(encoding="utf-8"))
                   if re.search(r"\.(rst|md)(#|$)", link) and "_downloads" not in link and "://" not in link]
        assert not sources, (path.name, sources)


def test_every_formula_is_mathml(site):
    sources = [path.read_text(encoding="utf-8") for path in (REPOSITORY / "doc").glob("*.rst")]
    typed = sum(len(re.findall(r":math:`|^ *\.\. math::", text, re.M)) for text in sources)
    shown = sum(path.read_text(encoding="utf-8").count("<math ") for path in site.glob("*.html"))
    assert typed > 100 and shown == typed
    assert "<mfrac>" in html(site, "pair_evp_lj")
    assert (site / "_static" / "math" / "evp-math.woff2").stat().st_size > 10000


def test_help_of_each_tool_is_on_the_page(site):
    page = html(site, "tools")
    for tool in (REPOSITORY / "tools").glob("*.py"):
        assert f"usage: {tool.name} " in page, tool.name
    assert "usage: curves.py numbers " in page, "commands of a tool, too"
    assert "usage: tools/setup.sh" in page


FAULTS = {
    "README.md": "# Read\n\n[page](doc/a.rst) [anchor](doc/a.rst#no-such) [dead](doc/none.rst) [folder](doc)\n\n![none](doc/none.png)\n",
    "lammps_inputs/README.md": "# Decks\n\n[back](../README.md) [out](../../x.md) [file](in.x)\n",
    "lammps_inputs/in.x": "run 0\n",
    "doc/a.rst": "A\n=\n\n`dead <gone.rst>`__, `decks <../lammps_inputs/README.md>`__, :math:`\\nosuch{x}`\n",
    "doc/lonely.md": "# Lonely\n",
    "doc/index.rst": "I\n=\n\n.. toctree::\n\n   readme\n   decks\n   a\n   tools\n   unwritten\n"}


def test_each_fault_is_named(tmp_path):
    root = tmp_path / "repository"
    shutil.copytree(REPOSITORY / "tools" / "evp", root / "tools" / "evp", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(REPOSITORY / "tests" / "maintain", root / "tests" / "maintain", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("_ext", "_static"):
        shutil.copytree(REPOSITORY / "doc" / name, root / "doc" / name)
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
    assert [re.search(r"'(.*)' (.*)", fault).groups() for fault in site_check.faults(tmp_path)] == [
        ("#y", "names no anchor of that page"), ("/a.html", "is no relative link"), ("file:///a", "is no link that works on a host"),
        ("../b", "leads to no file"), ("c.png", "leads to no file"), ("https://x.org/m.js", "is loaded from elsewhere"),
        ("f.woff2", "leads to no file")]
