# SPDX-License-Identifier: GPL-2.0-only
"""tests/maintain/memory/reports.py finds reports with our files in them, and no others; its deck uses every style."""

import re
import subprocess
import sys

import pytest
from evp.run import CHECKOUT

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
