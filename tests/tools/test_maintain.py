# SPDX-License-Identifier: GPL-2.0-only
"""tests/maintain: compare_builds.py finds a build equal to itself, and names the first difference of files; memory/reports.py finds reports with our
files in them, and no others; each fault of faults.py replaces what src/ has once, and has robustness tests; without.py takes an effect out. The site of the manual builds
without a warning, every link leads somewhere, and each fault of a page is named."""

import re
import shutil
import subprocess
import sys

import compare_builds
import pytest
import website
import without
from compare_builds import compare_all, first_difference
from evp.run import CHECKOUT
from faults import FAULTS, fault_names
from inputs import BUILD, call
from robustness import collect, requirements


def test_a_build_against_itself(tmp_path):
    """Then a row of one of its files is changed."""
    folder = tmp_path / "kept"
    done = call(compare_builds.main, "--old", BUILD, "--new", BUILD, "bits", "--only", "two_spheres", "--folder", folder)
    assert done.returncode == 0 and "4 compared, 0 differ" in done.stdout, done.stderr
    assert "same     two_spheres_1r/two_spheres.csv\n" in done.stdout and "same     two_spheres_2r/screen (thermo)\n" in done.stdout
    path = folder / "new" / "two_spheres_2r" / "two_spheres.csv"
    path.write_text(path.read_text(encoding="utf-8").replace("\n-0.0199", "\n-0.0198"), encoding="utf-8")
    differing = {name: words for name, words in compare_all(folder) if words}
    name = "two_spheres_2r/two_spheres.csv"
    assert list(differing) == [name] and differing[name].startswith("line 3, column 7: old '-0.0199")


THERMO = "words\n   Step  PotEng\n  0  1.5\n{}  10  2.5\nLoop time of 3 on 1 procs\n"


@pytest.mark.parametrize("name, old, new, words", [
    ("a.log", THERMO.format(""), THERMO.format("WARNING: hot\n").replace("words", "other words").replace("of 3", "of 4"), None),
    ("a.log", THERMO.format(""), THERMO.format("").replace("2.5", "2.6"), "line 3, column 6: old '10 2.5', new '10 2.6'"),
    ("a.log", "   Step  PotEng  CPULeft\n  0  1.5  9\nLoop time of 3\n", "   Step  PotEng  CPULeft\n  0  1.5  8\nLoop time of 4\n", None),
    ("a.csv", "a,b\n1,2\n", "a,b\n1,2\n3,4\n", "old has 2 lines, new has 3"),
    ("a.csv", "a,b\n1,2\n", "a,b\n1,2", r"line 2, column 4: old '1,2\n', new '1,2'"),
])
def test_first_difference(tmp_path, name, old, new, words):
    for folder, text in (("old", old), ("new", new)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text(text, encoding="utf-8")
    assert first_difference(tmp_path / "old" / name, tmp_path / "new" / name) == words
    assert "exists" in first_difference(tmp_path / "old" / name, tmp_path / "nowhere")


SCRIPT = CHECKOUT / "tests" / "maintain" / "memory" / "reports.py"

OURS = {
    "overflow": """==7==ERROR: AddressSanitizer: heap-buffer-overflow on address 0x60
READ of size 8 at 0x60 thread T0
    #0 0x7f in memcpy (/usr/lib/libasan.so.8+0x1)

0x60 is located 0 bytes to the right of 16-byte region
allocated by thread T0 here:
    #1 0x7f in LAMMPS_NS::FixEVPBonds::reserve(int) /somewhere/src/fix_evp_bonds.cpp:238
""",
    "undefined": "/somewhere/src/core/law/law.h:91:7: runtime error: division by zero\n    #0 0x7f in EVP::Law::force\n",
    "leak": """==7==ERROR: LeakSanitizer: detected memory leaks

Direct leak of 8 byte(s) in 1 object(s) allocated from:
    #1 0x7f in LAMMPS_NS::Memory::smalloc (/build/liblammps.so.0+0x1)
    #2 0x7f in LAMMPS_NS::FixEVPBonds::reserve(int) (/build/evpplugin.so+0x2)
""",
    "memcheck": """==9== Conditional jump or move depends on uninitialised value(s)
==9==    at 0x4: LAMMPS_NS::PairEVPLJ::pack() (pair_evp_lj.cpp:170)
==9==
""",
}
OTHERS = """==7==ERROR: LeakSanitizer: detected memory leaks

Direct leak of 8 byte(s) in 1 object(s) allocated from:
    #0 0x7f in malloc
    #1 0x7f in orte_init (/usr/lib/libopen-rte.so.40+0x2)

==9== Invalid read of size 8
==9==    at 0x4: LAMMPS_NS::PairLJCut::compute(int, int) (src/pair_lj_cut.cpp:70)
==9==    by 0x5: double* LAMMPS_NS::Memory::create<double>(double*&, int, char const*) (memory.h:60)
==9==
The plugin /build/evpplugin.so was loaded: law.h is no part of any report here.
"""


@pytest.mark.parametrize("name", OURS)
def test_a_report_of_ours_is_found_among_others(tmp_path, name):
    (tmp_path / "log").write_text(f"{OTHERS}\n{OURS[name]}", encoding="utf-8")
    result = subprocess.run([sys.executable, SCRIPT, tmp_path / "log"], capture_output=True, text=True, check=False)
    assert result.returncode == 1 and "1 reports with our files in them" in result.stdout
    assert OURS[name].splitlines()[-1].strip() in result.stdout or name == "memcheck"


def test_the_deck_of_the_memory_tools_uses_every_style():
    registered = re.findall(r'add\("(\w+)", "([^"]+)"', (CHECKOUT / "src/lammps/evpplugin.cpp").read_text(encoding="utf-8"))
    assert len(registered) > 5
    deck = (CHECKOUT / "tests/maintain/memory/in.memory").read_text(encoding="utf-8")
    # before the style: nothing (commands), 'pair_style', or 'fix ID group', 'compute ID group'
    before = {"command": "", "pair": r"pair_style +", "fix": r"fix +\S+ +\S+ +", "compute": r"compute +\S+ +\S+ +"}
    unused = [name for kind, name in registered if not re.search(rf"^{before[kind]}{name}\b", deck, re.MULTILINE)]
    assert not unused, unused


def test_every_test_notices_a_fault_and_every_fault_has_tests():
    names = {test.name for test in collect() if test.ranks == 1}
    for name, fault in FAULTS.items():
        assert (CHECKOUT / "src" / fault.file).read_text(encoding="utf-8").count(fault.right) == 1, name
        assert any(name in fault_names(test) for test in names), name
    assert all(map(fault_names, names)) and len(names) > 50 and len(FAULTS) > 30
    assert {name.partition(":")[0] for name in names} == set(requirements())


def test_an_effect_can_be_taken_out():
    """The energy balance; of one test the case that names it is left out, the others pass."""
    words = ["energy", "tests/lammps/test_records.py::test_records_of_deleted_partners_go"]
    done = subprocess.run([CHECKOUT / "tests/maintain/without.py", *words], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "compiles without src/core/energy, src/lammps/energy\n" in done.stdout and "left out, which name evp/energy: 1\n" in done.stdout and " passed, 1 skipped" in done.stdout


@pytest.mark.parametrize("name", without.WORDS)
def test_nothing_else_names_what_an_effect_has(name):
    """Its headers are included in its folders, and in the list of styles, or of what acts by rules of the pair style."""
    headers = [f'#include "{path.relative_to(CHECKOUT / "src")}"' for path in without.deleted_files(name) if path.suffix == ".h"]
    own = {path for path in (CHECKOUT / "src").rglob("*.*") if any(line in path.read_text(encoding="utf-8") for line in headers)}
    others = {str(path.relative_to(CHECKOUT / "src")) for path in own if path.parent.name != name}
    assert len(headers) > 1 and others == {"lammps/effects.cpp" if name in ("yield", "failure", "joining") else "lammps/evpplugin.cpp"}


# ---- website.py ----


def build(root, out, *words):
    return subprocess.run([str(root / "tests" / "maintain" / "website.py"), "--out", str(out), *words], stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, check=False, timeout=300)


def html(site, name):
    return (site / f"{name}.html").read_text(encoding="utf-8")


def test_site(tmp_path):
    """Every link, picture and anchor is there; links that a view of the repository follows lead to the page on the site, or a copy of a file that
    is no page; formulas are MathML; the page of the tools has the help of each."""
    site = tmp_path / "site"
    done = build(CHECKOUT, site)
    assert done.returncode == 0 and not done.stderr and done.stdout == f"{site / 'index.html'}\n", done.stderr[-5000:]
    assert website.faults(site) == [] and (site / ".nojekyll").exists()
    assert not [path for path in site.rglob("*.html") if str(CHECKOUT) in path.read_text(encoding="utf-8")], "a path of this machine"

    readme, gallery, decks, tools = (html(site, name) for name in ("readme", "gallery", "decks", "tools"))
    assert 'href="Howto_evp_paper.html"' in readme and 'href="pair_evp_lj.html"' in gallery and 'href="decks.html"' in gallery
    assert 'href="Howto_evp_part.html"' in decks and re.search(r'href="_downloads/\w+/metals\.evp"', decks)
    pages = {path.name: path.read_text(encoding="utf-8") for path in site.glob("*.html")}
    for name, page in pages.items():
        sources = [link for link in re.findall(r'href="([^"]+)"', page) if re.search(r"\.(rst|md)(#|$)", link) and "_downloads" not in link and "://" not in link]
        assert not sources, (name, sources)

    typed = sum(len(re.findall(r":math:`|^ *\.\. math::", path.read_text(encoding="utf-8"), re.M)) for path in (CHECKOUT / "doc").glob("*.rst"))
    assert typed > 100 and sum(page.count("<math ") for page in pages.values()) == typed and "<mfrac>" in html(site, "pair_evp_lj")
    assert (site / "_static" / "math" / "evp-math.woff2").stat().st_size > 10000
    usages = [*(f"{tool.name} " for tool in (CHECKOUT / "tools").glob("*.py")), "curves.py numbers ", "tools/setup.sh"]
    assert not [usage for usage in usages if f"usage: {usage}" not in tools]


FAULTY = {
    "README.md": "# Read\n\n[page](doc/a.rst) [anchor](doc/a.rst#no-such) [dead](doc/none.rst) [folder](doc)\n\n![none](doc/none.png)\n",
    "lammps_inputs/README.md": "# Decks\n\n[back](../README.md) [out](../../x.md) [file](in.x)\n",
    "lammps_inputs/in.x": "run 0\n",
    "doc/a.rst": "A\n=\n\n`dead <gone.rst>`__, `decks <../lammps_inputs/README.md>`__, :math:`\\nosuch{x}`\n",
    "doc/lonely.md": "# Lonely\n",
    "doc/index.rst": "I\n=\n\n.. toctree::\n\n   readme\n   decks\n   a\n   tools\n   unwritten\n"}


def test_each_fault_is_named(tmp_path):
    root = tmp_path / "repository"
    for name in ("tools/evp", "tests/maintain", "doc/_ext", "doc/_static"):
        shutil.copytree(CHECKOUT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy2(CHECKOUT / "doc" / "conf.py", root / "doc")
    (root / "lammps_inputs").mkdir()
    for path, text in FAULTY.items():
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
