# SPDX-License-Identifier: GPL-2.0-only
"""tests/maintain: compare_builds.py finds a build equal to itself, and names the first difference of files; memory/reports.py finds reports with our
files in them, and no others; each safeguard of src/core/fault.h has robustness tests, which faults.py builds it for."""

import re
import subprocess
import sys

import compare_builds
import pytest
from compare_builds import compare_all, first_difference
from evp.run import CHECKOUT
from faults import CASES, fault_names, read_faults
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
    "undefined": "/somewhere/src/core/law.h:91:7: runtime error: division by zero\n    #0 0x7f in EVP::Law::force\n",
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
    faults, names = read_faults(CHECKOUT / "src"), {test.name for test in collect() if test.ranks == 1}
    assert list(faults) == list(CASES) and len(faults) > 30
    for name, fault in faults.items():
        assert len(fault.files) == 1, f"{name} stands in {fault.files}"
        assert any(name in fault_names(test) for test in names), name
    assert all(map(fault_names, names)) and len(names) > 50
    assert {name.partition(":")[0] for name in names} == set(requirements())
