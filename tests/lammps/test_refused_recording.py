# SPDX-License-Identifier: GPL-2.0-only
"""A recording that is refused leaves fix evp/bonds as it was: a program may catch the error, mend the cause and run again."""

import pytest
from library import SHOWN, run_program

# six spheres in a row, 2 % apart
SCENE = """
SCENE = '''units si
atom_style sphere
atom_modify map yes
boundary f f f
region box block 0 0.1 0 0.05 0 0.05
create_box 1 box
''' + "".join(f"create_atoms 1 single {0.01 + 0.0082 * k} 0.02 0.02\\n" for k in range(6)) + '''set group all diameter 0.008
set group all density 2700
neighbor 0.0006 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj contact literal
pair_coeff * * 50 6 3 2 6 3 0.004 0 1.4
fix move all nve'''
tell(SCENE)

def bond_file(*lines, count=None, units="si"):
    write(FILE, "# EVP bonds COUNT: %d UNITS: %s\\n" % (len(lines) if count is None else count, units) + "".join(line + "\\n" for line in lines))

def kept():
    tell("write_evp_bonds kept.bonds")
    return sorted(open("kept.bonds").read().splitlines()[1:])
"""

MENDED = """
bond_file("1 2 0.0082", "4 5 0.0083")
"""

# each is refused after some of the lines were taken
FAULTS = {
    "no atom": ('bond_file("1 2 0.0081", "3 4 0.0083", "4 9 0.0082")', "bond 4 9: there is no atom 9"),
    "late line": ('bond_file("1 2 0.0081", "3 4 0.0083", "5 6 -0.0082")', "bond file line 4: deq must be positive, got -0.0082"),
    "twice": ('bond_file("1 2 0.0081", "3 4 0.0083", "2 1 0.0082")', "bond 1 2 is given twice"),
    "cut": ('bond_file("1 2 0.0081", "3 4 0.0083", count=7)', "the bond file holds 2 bonds, its header says 7"),
    "units": ('bond_file("1 2 0.0081", units="cgs")', "bond file line 1: the bonds are in UNITS: cgs"),
    "a million lines later": ('bond_file(*["1 2 0.0081", "3 4 0.0083"], *["# nothing"] * 30000, "3 3 0.0082", count=3)',
                              "bond 3 3 is given twice"),
}


@pytest.mark.parametrize("fault, ranks", [*((fault, 1) for fault in FAULTS), ("no atom", 2), ("twice", 2), ("late line", 2)])
def test_a_bond_file_that_is_mended(tmp_path, fault, ranks):
    write, cause = FAULTS[fault]
    said = run_program(f"""
FILE = "b.bonds"
{SCENE}
tell("fix bonds all evp/bonds file b.bonds")
{write}
say("refused", tell("run 0"))
say("open", [name for name in files_open() if name.endswith("b.bonds")])
{MENDED}
say("mended", tell("run 0"), bonds(), kept())
""", tmp_path, ranks).stdout
    assert f"Fix bonds evp/bonds: {cause}" in said.split("refused ")[1].splitlines()[0][:SHOWN], said
    assert "open []" in said, said
    assert "mended ok 2.0 ['1 2 0.0082" in said and "'4 5 0.0083" in said, said


@pytest.mark.parametrize("ranks", [1, 2])
def test_two_spheres_that_coincided(tmp_path, ranks):
    """The rest of the body is moved apart, so that every record of the refused recording would be one too many."""
    said = run_program(SCENE + """
tell("create_atoms 1 single 0.051 0.02 0.02", "set atom 7 diameter 0.008 density 2700", "fix bonds all evp/bonds zone 1.3")
say("refused", tell("run 0"))
tell("set atom 1 y 0.005", "set atom 2 y 0.035", "set atom 3 z 0.04", "set atom 4 z 0.005", "set atom 5 x 0.09", "set atom 7 y 0.0283")
say("mended", tell("run 0"), bonds(), kept())
say("recorded", tell("run 0"), bonds())
""", tmp_path, ranks).stdout
    assert "Fix bonds evp/bonds: atoms 6 and 7 coincide" in said.split("refused ")[1][:SHOWN], said
    assert "mended ok 1.0 ['6 7 0.008" in said, said
    assert "recorded ok 1.0" in said, said


def test_the_cause_stands_before_a_long_path(tmp_path):
    """Hosts show the start of a message, and a path may be longer than that."""
    folder = tmp_path / ("deep" * 30) / ("folder" * 20)
    folder.mkdir(parents=True)
    said = run_program(f"FILE = {str(folder / 'b.bonds')!r}\n" + SCENE + """
tell("fix bonds all evp/bonds file " + FILE)
""" + "".join(f"{write}\nsay(tell('run 0'))\n" for write, _ in FAULTS.values()), tmp_path).stdout.splitlines()
    for line, (_, cause) in zip(said, FAULTS.values(), strict=True):
        assert cause in line[:SHOWN], line
