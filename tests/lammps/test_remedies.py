# SPDX-License-Identifier: GPL-2.0-only
"""What the messages about recorded bonds tell users to do, done in the program that got the message: each remedy works, and its error is there without it."""

import pytest
from hostile import refused
from library import SHOWN, run_program

# seven spheres in a row, 2 % apart; bonds with two neighbors on each side
ROW = """units lj
atom_style sphere
{map}
boundary f {y} f
region box block 0 15 0 {height} 0 6
create_box 1 box
""" + "\n".join(f"create_atoms 1 single {1.5 + 1.02 * k:.2f} 0.9 2.5" for k in range(7)) + """
set group all diameter 1
set group all density 1
neighbor 0.06 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj contact literal
pair_coeff * * 50 6 3 2 6 3 0.004 0 2.2
"""
FIX, AGAIN, SAME = "fix bonds all evp/bonds\n", "fix again all evp/bonds\n", "pair_coeff * * 50 6 3 2 6 3 0.004 0 2.1"
END = "fix move all nve\ntimestep 1e-5\nthermo_style custom step atoms pe fmax f_bonds f_bonds[1] f_bonds[3]\n"
PULL = "displace_atoms all ramp x 0 0.02 x 1.5 7.62 units box\n"
BONDS = 6 + 5

SAY = """
lammps.lammps_get_natoms.restype = ctypes.c_double

def value(k):
    return lammps.lammps_extract_fix(handle, b"bonds", 0, 1, k - 1, 0)[0]

def start(*commands):
    said = tell("clear", LOAD, *commands)
    assert said == "ok", said
"""


def row(y="f", height=6, map_style="atom_modify map yes"):
    return ROW.format(y=y, height=height, map=map_style)


ADDED = "read_data more.data add {} group more\n"
MORE = "more\n\n1 atoms\n1 atom types\n\n0 15 xlo xhi\n0 6 ylo yhi\n0 6 zlo zhi\n\nAtoms # sphere\n\n1 1 1 1 12 4 4\n"
DEPOSIT = "region above block 12 12.01 4 4.01 4 4.01\ngroup more empty\nfix rain more deposit 1 1 1 4711 region above id {}\n"
CREATE = "create_atoms 1 single 12 4 4\nset atom {} diameter 1 density 1\n"
DELETE = "group gone id {}\ndelete_atoms group gone compress no\n"
HIGHEST = DELETE.format(7)
RECORDED = row() + FIX + END + "run 0\n"
RESTARTED = RECORDED + "write_restart r.bin\nclear\nPLUGIN\nread_restart r.bin\nneighbor 0.06 bin\n"
NOT_RECORDED = "is not the atom that was recorded under this ID"
CASES = {  # lines before, what is wrong and what is said of it, the remedy and what it leaves: atoms, bonds, those beyond dlim, new pairs
    "create_atoms": (RECORDED, HIGHEST + CREATE.format(7), (f"atom ID 7 {NOT_RECORDED}", "read_data ... add 7"), CREATE.format(8) + HIGHEST, (7, BONDS, 2, 0)),
    "read_data": (RECORDED, HIGHEST + ADDED.format("append"), (f"atom ID 7 {NOT_RECORDED}",), HIGHEST + ADDED.format(7), (7, BONDS, 2, 0)),
    "deposit": (RECORDED, DEPOSIT.format("max") + HIGHEST + "run 3\n", (f"atom ID 7 {NOT_RECORDED}",), DEPOSIT.format("next") + HIGHEST + "run 3\n", (7, BONDS, 2, 0)),
    "IDs that changed": (RECORDED, "group gone id 3\ndelete_atoms group gone\n", (NOT_RECORDED, "use 'delete_atoms ... compress no', no reset_atoms id"),
                         DELETE.format(3), (6, BONDS, 4, 0)),
    "IDs that changed, recorded anew": (RECORDED, "group gone id 3\ndelete_atoms group gone\n", (NOT_RECORDED,),
                                        "group gone id 3\ndelete_atoms group gone\nunfix bonds\n" + FIX, (6, BONDS - 4, 0, 0)),
    "deleted before the fix is there": (RESTARTED, DELETE.format(2) + FIX + END, (NOT_RECORDED, "define the fix right after read_restart"),
                                        FIX + DELETE.format(2) + END, (6, BONDS, 3, 0)),
}


def test_atoms_that_come_and_go(tmp_path):
    (tmp_path / "more.data").write_text(MORE, encoding="utf-8")
    program = SAY + "".join(f"""
start({before!r}.replace("PLUGIN", LOAD))
say(tell({wrong!r}, "run 0"))
start({before!r}.replace("PLUGIN", LOAD))
say(tell({right!r}, "run 0"), lammps.lammps_get_natoms(handle), bonds(), value(1), value(3))
""" for before, wrong, _, right, _ in CASES.values())
    said = run_program(program, tmp_path).stdout.splitlines()
    for name, refusal, mended in zip(CASES, said[::2], said[1::2], strict=True):
        _, _, messages, _, left = CASES[name]
        assert all(text in refusal for text in messages), (name, refusal)
        assert mended == "ok " + " ".join(f"{number:.1f}" for number in left), name


LOW = (4.3, "the periodic box is 4.3 high along y, less than two cutoffs")
FLAT = (1, "it meets atoms 1 and 1 in two periodic images: the box must be longer than two cutoffs")  # for any alpha


@pytest.mark.parametrize("box, remedy, ranks, bonds", [(LOW, SAME, 1, BONDS), (LOW, "", 2, 6 * BONDS), (FLAT, "", 1, 0)], ids=["alpha", "replicate", "flat"])
def test_a_box_that_is_too_small(tmp_path, box, remedy, ranks, bonds):
    """By what the message says: with a smaller alpha, or in a larger box."""
    height, message = box
    commands = [remedy, "run 0"] if remedy else ["unfix bonds", "replicate 1 6 1", FIX, "run 0"]
    said = run_program(SAY + f"""
start({row('p', height) + FIX + END.replace("fix move all nve", "")!r})
say(tell("run 0"))
say(tell(*{commands!r}), bonds())
""", tmp_path, ranks).stdout
    refusal, mended = said.splitlines()
    assert message.partition(":")[0] in refusal[:SHOWN], said
    assert message in refusal and "reduce alpha, or enlarge the box: 'unfix bonds', replicate, and define the fix again" in refusal, said
    assert mended.startswith(f"ok {bonds:.1f}" if bonds else "ok "), said  # of the flat one the rows are bonded too


def test_no_atom_map_is_needed(lmp_decks):
    """Records, bond file, restart and deletions, without an atom map; the same numbers as with one."""
    decks = {}
    for source, map_style in ((source, map_style) for source in ("file", "restart") for map_style in ("", "atom_modify map yes")):
        text = row(map_style=map_style) + FIX + END + "run 0\n" + PULL + DELETE.format(2) + "run 0\n"
        if source == "file":
            forces = "neighbor 0.06" + row().partition("neighbor 0.06")[2]
            text += "write_data s.data nocoeff\nwrite_evp_bonds s.bonds\nclear\n"
            text += f"units lj\natom_style sphere\n{map_style}\nboundary f f f\nread_data s.data\n{forces}fix bonds all evp/bonds file s.bonds\n"
        else:
            text += "write_restart s.bin\nclear\nread_restart s.bin\nneighbor 0.06 bin\n" + FIX
        decks[source, map_style] = text + END + "run 0\n"
    file, file_mapped, restart, mapped = (run.thermo() for run in lmp_decks(decks, 2).values())
    assert file["f_bonds"][-1] == BONDS - 3 and file["PotEng"][-1] == file_mapped["PotEng"][-1] != 0.0
    assert restart["f_bonds"][-1] == BONDS and restart["PotEng"][-1] == mapped["PotEng"][-1] != 0.0


def test_a_second_recording_warns(lmp_decks):
    """The body was pulled since the first one: what was stress is gone. A bond file keeps it."""
    text = row() + FIX + END + "run 0\nwrite_evp_bonds s.bonds\n" + PULL + "run 0\n"
    show = "thermo_style custom step fmax\nrun 0\n"
    runs = lmp_decks({"unfix": text + "unfix bonds\n" + AGAIN + show, "in place": text + FIX.strip() + " zone 2.15\n" + show,
                      "kept": text + "unfix bonds\n" + AGAIN.strip() + " file s.bonds\n" + show,
                      "nothing was recorded before": text.replace("run 0\nwrite_evp_bonds s.bonds", "unfix bonds\n" + FIX)})
    before = runs["kept"].thermo(1)["Fmax"][0]
    warning = "takes the current shape of the body as undeformed and free of stress, though bonds may have been recorded before"
    assert [sum(warning in line for line in run.warnings()) for run in runs.values()] == [1, 1, 0, 0]
    assert before > 1.0 and runs["unfix"].thermo()["Fmax"][0] < 1e-9 and runs["in place"].thermo()["Fmax"][0] < 1e-9
    assert runs["kept"].thermo()["Fmax"][0] == pytest.approx(before, rel=1e-7)


def test_bonds_of_a_restart_file_are_dropped_before_any_run(lmp, lmp_decks):
    """unfix drops them as it does after a run: the body goes on without bonds, is recorded anew with a warning, or restored."""
    start = RESTARTED.replace("PLUGIN\n", "")
    anew = "though bonds may have been recorded before"
    runs = lmp_decks({again: start + FIX + "unfix bonds\n" + again + "fix move all nve\nrun 0\n" for again in ("", FIX, AGAIN)})
    without, same, other = runs.values()
    assert [any(anew in line for line in one.warnings()) for one in runs.values()] == [False, False, True]
    assert "no fix evp/bonds: every pair has deq = R_i + R_j" in without.stdout
    assert "deq of bonds from fix bonds" in same.stdout.rpartition("read_restart")[2] and "fix evp/bonds again: recorded" in other.stdout
    refused(lmp(start + "fix move all nve\nrun 0\n"), "the bonds were recorded by fix bonds, whose records are not here")
