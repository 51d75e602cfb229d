# SPDX-License-Identifier: GPL-2.0-only
"""What the messages about recorded bonds tell users to do, done: each remedy works, and its error is there without it."""

import pytest
from hostile import refused
from library import SHOWN, run_program

# seven spheres in a row, 2 % apart; bonds with two neighbors on each side
ROW = """
units lj
atom_style sphere
{map}
boundary f {y} f
region box block 0 15 0 {height} 0 6
create_box 1 box
{atoms}
set group all diameter 1
set group all density 1
""".replace("{atoms}", "\n".join(f"create_atoms 1 single {1.5 + 1.02 * k:.2f} 0.9 2.5" for k in range(7)))
FORCES = """
neighbor 0.06 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj contact literal
pair_coeff * * 50 6 3 2 6 3 0.004 0 2.2
"""
FIX = "fix bonds all evp/bonds\n"
END = """
fix move all nve
timestep 1e-5
thermo_style custom step atoms pe fmax f_bonds f_bonds[1] f_bonds[3]
"""
PULL = "displace_atoms all ramp x 0 0.02 x 1.5 7.62 units box\n"
BONDS = 6 + 5


def row(y="f", height=6, map_style="atom_modify map yes"):
    return ROW.format(y=y, height=height, map=map_style) + FORCES


# new atoms: which way they come, after atom 7, that of the highest ID, was deleted
ADDED = "read_data more.data add {} group more\n"
MORE = """more

1 atoms
1 atom types

0 15 xlo xhi
0 6 ylo yhi
0 6 zlo zhi

Atoms # sphere

1 1 1 1 12 4 4
"""
DEPOSIT = """
region above block 12 12.01 4 4.01 4 4.01
group more empty
fix rain more deposit 1 1 1 4711 region above id {}
"""
CREATE = "create_atoms 1 single 12 4 4\nset atom {} diameter 1 density 1\n"
DELETE = "group gone id 7\ndelete_atoms group gone compress no\n"


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("wrong, right", [
    (DELETE + CREATE.format(7), CREATE.format(8) + DELETE), (DELETE + ADDED.format("append"), DELETE + ADDED.format(7)),
    (DEPOSIT.format("max") + DELETE + "run 3\n", DEPOSIT.format("next") + DELETE + "run 3\n")], ids=["create_atoms", "read_data", "deposit"])
def test_new_atoms_after_a_deletion(lmp, tmp_path, wrong, right, ranks):
    (tmp_path / "more.data").write_text(MORE, encoding="utf-8")
    start = row() + FIX + END + "run 0\n"
    run = lmp(start + wrong + "run 0\n", ranks=ranks)
    refused(run, "Fix bonds evp/bonds: atom ID 7 is not the atom that was recorded under this ID", "read_data ... add 7",
            stepped=True)
    run = lmp(start + right + "run 0\n", ranks=ranks).ok()
    last = {name: values[-1] for name, values in run.thermo().items()}
    assert (last["Atoms"], last["f_bonds"], last["f_bonds[1]"], last["f_bonds[3]"]) == (7, BONDS, 2, 0)


@pytest.mark.parametrize("ranks", [1, 2])
def test_atoms_deleted_after_a_restart(lmp, ranks):
    """Between read_restart and the fix, atoms go without their records; once the fix is there, with them."""
    written = row() + FIX + END + "run 0\nwrite_restart r.bin\nclear\nread_restart r.bin\nneighbor 0.06 bin\n"
    delete = "group gone id 2\ndelete_atoms group gone compress no\n"
    run = lmp(written + delete + FIX + END + "run 0\n", ranks=ranks)
    refused(run, "is not the atom that was recorded under this ID", "define the fix right after read_restart")
    run = lmp(written + FIX + delete + END + "run 0\n", ranks=ranks).ok()
    assert [run.thermo()[name][0] for name in ("Atoms", "f_bonds", "f_bonds[1]", "f_bonds[3]")] == [6, BONDS, 3, 0]


def test_ids_that_changed(lmp):
    start = row() + FIX + END + "run 0\ngroup gone id 3\n"
    run = lmp(start + "delete_atoms group gone\nrun 0\n")
    refused(run, "is not the atom that was recorded under this ID", "use 'delete_atoms ... compress no', no reset_atoms id")
    run = lmp(start + "delete_atoms group gone compress no\nrun 0\n").ok()
    assert run.thermo()["f_bonds"][0] == BONDS and run.thermo()["f_bonds[1]"][0] == 4
    run = lmp(start + "delete_atoms group gone\nunfix bonds\n" + FIX + "run 0\n").ok()
    assert run.thermo()["f_bonds"][0] == BONDS - 4


LOW = (4.3, "the periodic box is 4.3 high along y, less than two cutoffs")
FLAT = (1, "it meets atoms 1 and 1 in two periodic images: the box must be longer than two cutoffs")  # for any alpha


@pytest.mark.parametrize("box, remedy, ranks, bonds", [
    (LOW, "pair_coeff * * 50 6 3 2 6 3 0.004 0 2.1", 1, BONDS), (LOW, "", 2, 6 * BONDS), (FLAT, "", 1, 0)], ids=["alpha", "replicate", "flat"])
def test_a_box_that_is_too_small(tmp_path, box, remedy, ranks, bonds):
    """A program goes on after the error, by what the message says: with a smaller alpha, or in a larger box."""
    height, message = box
    commands = [remedy, "run 0"] if remedy else ["unfix bonds", "replicate 1 6 1", FIX, "run 0"]
    said = run_program(f"""
say("scene", tell({row('p', height)!r}, {FIX!r}, {END.replace('fix move all nve', '')!r}))
say("refused", tell("run 0"))
say("mended", tell(*{commands!r}), bonds())
""", tmp_path, ranks).stdout
    lines = dict(line.split(" ", 1) for line in said.splitlines())
    assert lines["scene"] == "ok"
    assert message.partition(":")[0] in lines["refused"][:SHOWN], said
    assert message in lines["refused"] and "reduce alpha, or enlarge the box: 'unfix bonds', replicate, and define the fix again" in lines["refused"], said
    assert lines["mended"].startswith(f"ok {bonds:.1f}" if bonds else "ok "), said  # of the flat one the rows are bonded too


@pytest.mark.parametrize("source, ranks", [("zone", 1), ("file", 2), ("file", 4), ("restart", 2)])
def test_no_atom_map_is_needed(lmp, source, ranks):
    """Records, bond file, restart and deletions, without an atom map; the same numbers as with one."""
    ends = []
    for map_style in ("", "atom_modify map yes"):
        text = row(map_style=map_style) + FIX + END + "run 0\n" + PULL + "group gone id 2\ndelete_atoms group gone compress no\nrun 0\n"
        if source == "file":
            text += "write_data s.data nocoeff\nwrite_evp_bonds s.bonds\nclear\n"
            text += f"units lj\natom_style sphere\n{map_style}\nboundary f f f\nread_data s.data\n" + FORCES + "fix bonds all evp/bonds file s.bonds\n"
        elif source == "restart":
            text += "write_restart s.bin\nclear\nread_restart s.bin\nneighbor 0.06 bin\n" + FIX
        ends.append(lmp(text + (END + "run 0\n" if source != "zone" else ""), ranks=ranks).ok().thermo())
    assert ends[0]["f_bonds"][-1] == BONDS - (3 if source == "file" else 0)
    assert ends[0]["PotEng"][-1] == ends[1]["PotEng"][-1] != 0.0


@pytest.mark.parametrize("again", ["unfix bonds\nfix again all evp/bonds\n", "fix bonds all evp/bonds zone 2.15\n"], ids=["unfix", "in place"])
def test_a_second_recording_warns(lmp, again):
    """The body was pulled since the first one: what was stress is gone. A bond file keeps it."""
    text = row() + FIX + END + "run 0\nwrite_evp_bonds s.bonds\n" + PULL + "run 0\n"
    before = lmp(text).ok().thermo()["Fmax"][0]
    assert before > 1.0
    warning = "takes the current shape of the body as undeformed and free of stress, though bonds may have been recorded before"
    thermo = "thermo_style custom step fmax\nrun 0\n"
    run = lmp(text + again + thermo).ok()
    assert [warning in line for line in run.warnings()] == [True]
    assert run.thermo()["Fmax"][0] < 1e-9
    kept = lmp(text + "unfix bonds\nfix again all evp/bonds file s.bonds\n" + thermo).ok()
    assert not kept.warnings() and kept.thermo()["Fmax"][0] == pytest.approx(before, rel=1e-7)
    assert not lmp(text.replace("run 0\nwrite_evp_bonds s.bonds", "unfix bonds\n" + FIX)).ok().warnings(), "nothing was recorded before"


def test_bonds_of_a_restart_file_are_dropped_before_any_run(lmp):
    """unfix drops them as it does after a run: the body goes on without bonds, is recorded anew with a warning, or restored."""
    start = row() + FIX + END + "run 0\nwrite_restart r.bin\nclear\nread_restart r.bin\nneighbor 0.06 bin\n"
    anew = "though bonds may have been recorded before"
    run = {again: lmp(start + FIX + "unfix bonds\n" + again + "fix move all nve\nrun 0\n").ok() for again in ("", FIX, FIX.replace("bonds", "again", 1))}
    without, same, other = run.values()
    assert [any(anew in line for line in one.warnings()) for one in run.values()] == [False, False, True]
    assert "no fix evp/bonds: every pair has deq = R_i + R_j" in without.stdout
    assert "deq of bonds from fix bonds" in same.stdout.rpartition("read_restart")[2] and "fix evp/bonds again: recorded" in other.stdout
    refused(lmp(start + "fix move all nve\nrun 0\n"), "the bonds were recorded by fix bonds, whose records are not here")


def test_ids_exchanged_without_a_new_neighbor_list(tmp_path):
    """New coefficients pack the pairs again, with the IDs that atoms have now."""
    said = run_program(f"""
tell({row()!r}, {FIX!r}, {END.replace('fix move all nve', '')!r}, "run 0")
lammps.lammps_extract_atom.restype = ctypes.POINTER(ctypes.c_int)
ids = lammps.lammps_extract_atom(handle, b"id")
ids[0], ids[1] = ids[1], ids[0]
say("exchanged", tell("pair_coeff * * 50 6 3 2 6 3 0.004 0 2.1", "run 1 pre no"))
ids[0], ids[1] = ids[1], ids[0]
say("mended", tell("run 0"), bonds())
""", tmp_path).stdout
    lines = dict(line.split(" ", 1) for line in said.splitlines())
    assert "IDs of atoms have changed since the last neighbor build" in lines["exchanged"], said
    assert lines["mended"] == f"ok {BONDS:.1f}", said
