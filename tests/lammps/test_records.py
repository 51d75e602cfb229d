# SPDX-License-Identifier: GPL-2.0-only
"""What keeps recorded bonds: bond files, restart and data files, the header that says which atoms are one body; damaged ones are in test_bad_input.py.

A refused recording leaves fix evp/bonds as it was, so that a program may mend the cause and run again. On other ranks: test_matrix.py."""

import os
import struct
import subprocess

import lammps_run
import numpy as np
import pytest
from evp import law
from flowing import MOVE as MOVE_FLOWING
from flowing import SPHERE, failing_at, flowing_pair, read_pairs
from hostile import refused
from lammps_run import REFERENCE, write_data
from library import SHOWN, run_program
from oracle import brute
from small_bodies import MOVE, head, pair, thermo, velocities
from test_within import FIX, MOLECULES

# ---- bonds as text ----


def deck(source="", after="", newton="on", data=REFERENCE, row=law.TABLE1):
    return (head(newton, start=f"read_data {data}") + pair(row, fix=f"fix bonds all evp/bonds {source}") + "fix move all nve\n"
            + thermo("pe f_bonds f_bonds[1]") + f"run 0\n{after}\n")


def read_bonds(path):
    """Header and the set of lines of a bond file; each line occurs once."""
    header, *lines = path.read_text(encoding="utf-8").splitlines()
    assert header.replace(" ZONE: 1.3", "") == f"# EVP bonds COUNT: {len(lines)} UNITS: si"
    assert len(set(lines)) == len(lines)
    return set(lines)


def as_pairs(lines):
    return {(int(i), int(j)): float(deq) for i, j, deq in (line.split() for line in lines)}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The bonds of the reference specimen as one rank writes them."""
    folder = tmp_path_factory.mktemp("written")
    lammps_run.run_lammps(deck("zone 1.3", "write_evp_bonds all.bonds"), cwd=folder).ok()
    return folder / "all.bonds"


def test_the_file_holds_the_pairs_of_the_zone(written, reference):
    """Against distances in Python: one rounding of a sum of three squares and its root may differ."""
    found, truth = as_pairs(read_bonds(written)), brute.record_bonds(reference.x, reference.radius, 1.3)
    assert found.keys() == truth.keys()
    assert all(i < j for i, j in found)
    assert max(abs(found[pair] / deq - 1.0) for pair, deq in truth.items()) < 4 * np.finfo(float).eps


def test_bonds_of_a_deleted_atom_are_left_out(lmp, tmp_path, written):
    """A reader could not find the atom. IDs 1, in the middle and the highest; the data file that goes with the bonds reads back."""
    lmp(deck("zone 1.3", "group gone id 1 250 500\ndelete_atoms group gone compress no\nwrite_evp_bonds a.bonds\n"
             "write_data a.data nocoeff"), ranks=3).ok()
    kept = {pair: deq for pair, deq in as_pairs(read_bonds(written)).items() if not {1, 250, 500} & set(pair)}
    assert as_pairs(read_bonds(tmp_path / "a.bonds")) == kept
    run = lmp(deck("file a.bonds", data="a.data"), ranks=3).ok()
    assert run.thermo()["f_bonds"][-1] == len(kept) < len(read_bonds(written))
    assert run.thermo()["f_bonds[1]"][-1] == 0


def test_a_path_that_cannot_be_written(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    before = sorted(tmp_path.rglob("*"))
    paths = ["nowhere/a.bonds", "folder", "file/a.bonds", '""']
    said = run_program(f"tell({deck()!r})\n" + "".join(f"say(tell({f'write_evp_bonds {path}'!r}))\n" for path in paths), tmp_path).stdout.splitlines()
    for path, line in zip(paths, said, strict=True):
        assert f"write_evp_bonds: cannot write '{path.strip(chr(34))}': check the folder" in line
    assert [name for name in sorted(tmp_path.rglob("*")) if name.name != "program.py"] == before
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


def test_a_full_disk_leaves_the_old_file(lmp, tmp_path, monkeypatch):
    """A limit of 8 kB on files stands for the full disk; mpirun, which needs files of its own, is outside of it.
    Control: with room the old file is replaced."""
    limited = tmp_path / "limited"
    limited.write_text(f'#!/bin/bash\ntrap "" XFSZ\nulimit -f 8\nexec "{lammps_run.LMP}" "$@"\n', encoding="utf-8")
    limited.chmod(0o755)
    old = tmp_path / "a.bonds"
    old.write_text("mine", encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(lammps_run, "LMP", limited)
        run = lmp(deck(after="write_evp_bonds a.bonds"), ranks=2)
    assert run.returncode == 1 and "write_evp_bonds: cannot write 'a.bonds': check the folder and the free space" in run.stdout
    assert old.read_text(encoding="utf-8") == "mine"
    assert not list(tmp_path.glob("*.part"))
    lmp(deck(after="write_evp_bonds a.bonds"), ranks=2).ok()
    assert len(read_bonds(old)) > 2000


def test_a_star_is_the_step(lmp, tmp_path):
    """As in write_data: under run every each step has a file of its own."""
    text = deck(after='velocity all ramp vx -1 1 x 0 0.05\ntimestep 1e-7\nrun 21 every 7 "write_data d.*.data nocoeff" "write_evp_bonds d.*.bonds"')
    lmp(text + "write_evp_bonds end.*.*\n", ranks=2).ok()
    assert sorted(file.name for file in tmp_path.glob("d.*.bonds")) == [f"d.{step}.bonds" for step in (14, 21, 7)]
    assert sorted(file.name for file in tmp_path.glob("d.*.data")) == [f"d.{step}.data" for step in (14, 21, 7)]
    assert (tmp_path / "end.21.*").exists(), "the first star alone, as there"
    assert len({frozenset(read_bonds(file)) for file in tmp_path.glob("d.*.bonds")}) == 1


def test_file_written_before_the_first_set_up(lmp, tmp_path):
    """After read_restart the pair style has coefficients and no cut-offs yet."""
    lmp(deck(after="run 0\nwrite_evp_bonds live.bonds\nwrite_restart r.bin\n")).ok()
    lmp("read_restart r.bin\nfix bonds all evp/bonds\nwrite_evp_bonds again.bonds\n").ok()
    assert (tmp_path / "again.bonds").read_text(encoding="utf-8") == (tmp_path / "live.bonds").read_text(encoding="utf-8")


SHRUNK = {  # what shrinks after the recording at zone 1.48, and the row of the deck that reads
    "radii": ("set atom 1*200 diameter 0.004\n", 1.5),
    "alpha": ("pair_coeff * * 80 8 4 3 8 4 0.005 0 1.31\n", 1.31),
}


@pytest.mark.parametrize("what, ranks, other", [("radii", 4, 1), ("alpha", 1, 2)])
def test_bonds_beyond_a_dlim_that_shrank(lmp, what, ranks, other):
    """The live run and a restart go on with such bonds, so does what is written: the same numbers, also when some of them are pressed until they act."""
    change, alpha = SHRUNK[what]
    press = ("change_box all x scale 0.9 y scale 0.9 z scale 0.9 remap\n" + thermo("pe fmax f_bonds f_bonds[1] f_bonds[2] f_bonds[3]") + "run 0\n")
    live = lmp(deck("zone 1.48", change + "run 0\nwrite_data s.data nocoeff\nwrite_evp_bonds s.bonds\n" + press), ranks=ranks).ok()
    again = lmp(deck("file s.bonds", press, data="s.data", row=law.TABLE1._replace(alpha=alpha)), ranks=other).ok()
    for name, values in live.thermo().items():
        assert again.thermo()[name][0] == pytest.approx(values[0], rel=1e-9), name
    assert live.thermo(1)["f_bonds[1]"][0] > live.thermo(2)["f_bonds[1]"][0] + 100, "control: some act again"


def test_high_ids_cost_no_memory(tmp_path):
    """Peak of a process that records, writes and reads with IDs up to 2^31: a bit for each possible ID would be 268 MB."""
    peaks = []
    for high in (500, 2_147_483_000):
        text = REFERENCE.read_text(encoding="utf-8").replace("\n500 1 ", f"\n{high} 1 ")
        assert high == 500 or f"\n{high} 1 " in text
        (tmp_path / "s.data").write_text(text, encoding="utf-8")
        script = deck("zone 1.3", "write_evp_bonds s.bonds\nunfix bonds\nfix bonds all evp/bonds file s.bonds\nrun 0\n", data="s.data")
        (tmp_path / "in.lmp").write_text(script.replace("map yes", "map hash"), encoding="utf-8")
        process = subprocess.Popen([str(lammps_run.LMP), "-log", "none", "-in", "in.lmp"], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        assert status == 0 and output.count("recorded 2") == 2, output[-1000:]
        peaks.append(usage.ru_maxrss / 1024)
    assert peaks[1] < peaks[0] + 40, f"{peaks} MB"


def test_many_bonds_stream(lmp, tmp_path):
    """100 000 pairs of 1500 atoms, every third the other way round, read in messages of 10 000 and written back; nothing is lost or changed. The file decides:
    values of deq that no distance in the data file has."""
    n, count = 1500, 100_000
    i, j = (k[:count] + 1 for k in np.triu_indices(n, 1))
    lines = [(a, b, f"{0.01 + 1e-9 * k:.17g}") for k, (a, b) in enumerate(zip(i.tolist(), j.tolist()))]
    text = "".join(f"{b} {a} {deq}\n" if a % 3 == 0 else f"{a} {b} {deq}\n" for a, b, deq in lines)
    (tmp_path / "a.bonds").write_text(f"# EVP bonds COUNT: {count} UNITS: si\n{text}", encoding="utf-8")
    place = 0.02 * np.stack(np.unravel_index(np.arange(n), (15, 10, 10)), axis=1)
    write_data(tmp_path / "a.data", place, np.full(n, 0.005), [[-0.01, 0.3], [-0.01, 0.2], [-0.01, 0.2]])
    run = lmp(deck("file a.bonds", "write_evp_bonds b.bonds", data="a.data"), ranks=2).ok()
    assert f"recorded {count} pairs from file a.bonds" in run.stdout
    assert read_bonds(tmp_path / "b.bonds") == {f"{a} {b} {deq}" for a, b, deq in lines}


@pytest.mark.parametrize("ranks", [1, 3])
def test_many_spheres_stream(tmp_path, ranks):
    """300 000 lines of spheres, 26 MB as numbers: no MPI rank has them all at once. Their atoms are not there, which is found at the end."""
    text = [f"sphere {k} 0.1 0 0 5 5 0 0 0 0 0 1 0\n" for k in range(501, 300_501)]
    for name, lines in (("one", text[:1]), ("all", text)):
        (tmp_path / f"{name}.bonds").write_text(f"# EVP bonds COUNT: 0 SPHERES: {len(lines)} COLUMNS: {','.join(SPHERE)} UNITS: si\n{''.join(lines)}", encoding="utf-8")
    program = f"""
def peak():
    return next(int(line.split()[1]) / 1024 for line in open("/proc/self/status") if line.startswith("VmHWM"))
found = []
for name in ("one", "all"):
    tell("clear", LOAD)
    found += [tell({deck("file NAME.bonds")!r}.replace("NAME", name)), peak()]
os.write(1, f"\\nMB {{found[3] - found[1]}} {{found[0] == found[2].replace('all', 'one')}} {{found[0]}}\\n".encode())
"""
    lines = [line.split(maxsplit=3) for line in run_program(program, tmp_path, ranks).stdout.splitlines() if line.startswith("MB")]
    assert len(lines) == ranks
    for _, more, same, message in lines:
        assert float(more) < 10.0 and same == "True" and "names an atom that is not there, or twice" in message, lines


@pytest.mark.parametrize("ranks", [1, 2])
def test_values_of_spheres_by_name(lmp, tmp_path, ranks):
    """In any order. One of an effect that is not in force is ignored, and a missing one is that at recording."""
    text = "# EVP bonds COUNT: 1 SPHERES: 1 COLUMNS: recorded,torn,plastic_strain UNITS: si\n1 2 0.0101\nsphere 2 3 1 0.25\n"
    (tmp_path / "named.bonds").write_text(text, encoding="utf-8")
    write_data(tmp_path / "two.data", [[0, 0, 0], [0.0101, 0, 0]], [0.005] * 2, [[-0.01, 0.06]] * 3)
    flows = flowing_pair(fails=None, kv=0, fix="fix bonds all evp/bonds file named.bonds")
    lmp(head(start="read_data two.data") + flows + "run 0\nwrite_evp_bonds again.bonds\n", ranks).ok()
    again = read_pairs(tmp_path / "again.bonds")
    assert again.columns == tuple(SPHERE[:5]) and again.spheres == {2: (0.25, 0.0, 0.0, 1.0, 3.0)}


# ---- restart and data files ----


def test_coefficients_come_back_from_restart_and_data(lmp, tmp_path, reference):
    """Three rows with exponents that are no integers; energies before and after are the same. Rows and measures of a restart file: test_rows.py. A data
    file has no coefficients, but those of older versions are read."""
    write_data(tmp_path / "two.data", reference.x, reference.radius, reference.box, 1 + np.arange(500) % 2)
    rows = "\n".join(["pair_coeff 1 1 80.1 8 4 3 7.53 3.21 0.00512345678901 0 1.45",
                      "pair_coeff 1 2 70.7 8.5 4 3.3 8 4 0.006 12.5 1.5", "pair_coeff 2 2 60 6 3 3 8 4 0.005 0 1.4"])
    show = "\n" + thermo("pe") + "run 0\n"
    first = head(start="read_data two.data") + "pair_style evp/lj contact repulsive overlap 0.45\n" + rows + show
    starts = (first + "write_restart two.restart\nwrite_data all.data pair ij\n", head(start="read_restart two.restart") + show,
              head(start="pair_style evp/lj contact repulsive\nread_data older.data") + show, first.replace("70.7", "99.9"))
    runs = []
    for text in starts:
        runs.append(lmp(text).ok())
        data = (tmp_path / "all.data").read_text(encoding="utf-8")
        assert "Coeffs" not in data
        (tmp_path / "older.data").write_text(data.replace("\nAtoms", "\nPairIJ Coeffs # evp/lj\n\n" + rows.replace("pair_coeff ", "") + "\n\nAtoms"), encoding="utf-8")
    energy, restarted, read, other = (run.thermo()["PotEng"][0] for run in runs)
    assert abs(energy) > 0.1 and abs(other / energy - 1.0) > 1e-3, "control: the rows matter"
    assert restarted == energy and "contact repulsive" in runs[1].stdout and "overlap warning above 0.45" in runs[1].stdout
    assert read == pytest.approx(energy, rel=1e-14)  # positions of the data file


# ---- which atoms are one body goes through restart files and, in the header, through bond files; and is refused where it would change ----

BODIES = " within {} (bodies only repel each other, elastically)"


def test_another_within_after_a_restart(lmp, tmp_path, bar):
    """The fix keeps that of the file and says so. By a bond file bonds go on under another rule for contacts; all atoms are made one molecule."""
    lmp(head() + pair(fix=FIX + "type") + "run 0\nwrite_restart s.restart\n").ok()
    for given in ("", " within molecule"):
        run = lmp(head(start="read_restart s.restart") + MOLECULES + f"fix bonds all evp/bonds{given}\nfix move all nve\nrun 1\n").ok()
        assert "fix bonds" + BODIES.format("type") in run.stdout
        assert ("the bonds are those of the restart file, not of the 'zone', 'file' or 'within' given here" in run.stdout) == bool(given)
    refused(lmp(head(start="read_restart s.restart") + "fix springs all evp/bonds\nfix move all nve\nrun 1\n", 2),
            "Pair evp/lj: the bonds were recorded by fix bonds, whose records are not here", "define 'fix bonds all evp/bonds' right after read_restart")
    text = head(start="read_restart s.restart") + MOLECULES + "set group all mol 1\nfix bonds all evp/bonds\nwrite_evp_bonds s.bonds\nunfix bonds\n"
    run = lmp(text + "fix again all evp/bonds file s.bonds within molecule\nfix move all nve\nrun 1\nwrite_evp_bonds t.bonds\n").ok()
    assert "from file s.bonds and within molecule" in run.stdout and "fix again" + BODIES.format("molecule") in run.stdout
    s, t = ((tmp_path / f"{name}.bonds").read_text(encoding="utf-8").splitlines() for name in "st")
    assert "WITHIN: type" in s[0] and "WITHIN: molecule" in t[0] and sorted(s[1:]) == sorted(t[1:])


def test_a_restart_file_from_before_the_recording(lmp, bar):
    """The fix takes over what that file's fix was given, or what it is given itself."""
    lmp(head() + pair(fix=FIX + "type") + "write_restart s.restart\n").ok()
    start = head(start="read_restart s.restart") + MOLECULES + "set group all mol 1\n"
    for given, kept in (("fix bonds all evp/bonds", "type"), (FIX + "molecule", "molecule")):
        assert f"and within {kept}, at most" in lmp(start + given + "\nfix move all nve\nrun 0\n").ok().stdout


# ---- a recording that is refused leaves fix evp/bonds as it was ----

# six spheres in a row, 2 % apart
SCENE = head(start="region box block 0 0.1 0 0.05 0 0.05\ncreate_box 1 box\n" + "".join(f"create_atoms 1 single {0.01 + 0.0082 * k} 0.02 0.02\n" for k in range(6))
             + "set group all diameter 0.008 density 2700", skin=0.0006) + "pair_style evp/lj\npair_coeff * * 50 6 3 2 6 3 0.004 0 1.4\nfix move all nve\n"
PROGRAM = f"SCENE = {SCENE!r}\ntell(SCENE)" + """

def bond_file(*lines, count=None):
    write(FILE, "# EVP bonds COUNT: %d UNITS: si\\n" % (len(lines) if count is None else count) + "".join(line + "\\n" for line in lines))

def kept():
    tell("write_evp_bonds kept.bonds")
    return sorted(open("kept.bonds").read().splitlines()[1:])
"""

# each is refused after some of the lines were taken
FAULTS = {
    "no atom": ('bond_file("1 2 0.0081", "3 4 0.0083", "4 9 0.0082")', "bond 4 9: there is no atom 9"),
    "late line": ('bond_file("1 2 0.0081", "3 4 0.0083", "5 6 -0.0082")', "bond file line 4: deq must be positive, got -0.0082"),
    "twice": ('bond_file("1 2 0.0081", "3 4 0.0083", "2 1 0.0082")', "bond 1 2 is given twice"),
    "cut": ('bond_file("1 2 0.0081", "3 4 0.0083", count=7)', "the bond file holds 2 bonds, its header says 7"),
}


def test_a_bond_file_that_is_mended(tmp_path):
    """The cause stands before a long path: hosts show the start of a message."""
    folder = tmp_path / ("deep" * 30) / ("folder" * 20)
    folder.mkdir(parents=True)
    file = str(folder / "b.bonds")
    said = run_program(f"FILE = {file!r}\n{PROGRAM}" + "".join(f"""
tell("clear", LOAD, SCENE, "fix bonds all evp/bonds file " + FILE)
{write}
say(tell("run 0"))
bond_file("1 2 0.0082", "4 5 0.0083")
say([name for name in files_open() if name.endswith("b.bonds")], tell("run 0"), bonds(), kept())
""" for write, _ in FAULTS.values()), tmp_path, 2).stdout.splitlines()
    for refusal, mended, (_, cause) in zip(said[::2], said[1::2], FAULTS.values(), strict=True):
        assert cause in refusal[:SHOWN], refusal
        assert mended.startswith("[] ok 2.0 ['1 2 0.0082") and "'4 5 0.0083" in mended, mended


def test_two_spheres_that_coincided(tmp_path):
    """The rest of the body is moved apart, so that every record of the refused recording would be one too many."""
    said = run_program(PROGRAM + """
tell("create_atoms 1 single 0.051 0.02 0.02", "set atom 7 diameter 0.008 density 2700", "fix bonds all evp/bonds zone 1.3")
say("refused", tell("run 0"))
tell("set atom 1 y 0.005", "set atom 2 y 0.035", "set atom 3 z 0.04", "set atom 4 z 0.005", "set atom 5 x 0.09", "set atom 7 y 0.0283")
say("mended", tell("run 0"), bonds(), kept())
say("recorded", tell("run 0"), bonds())
""", tmp_path, 2).stdout
    assert "Fix bonds evp/bonds: atoms 6 and 7 coincide" in said.split("refused ")[1][:SHOWN], said
    assert "mended ok 1.0 ['6 7 0.008" in said, said
    assert "recorded ok 1.0" in said, said


def test_broken_bonds_count_when_their_atoms_have_gone(lmp, tmp_path):
    """Three spheres in a row: the first one tears off and is lost, then the second is deleted. One bond broke, one more does not act."""
    write_data(tmp_path / "body.data", np.array([[0.0, 0, 0], [0.01, 0, 0], [0.02, 0, 0]]), [0.005] * 3, [[-0.03, 0.1], [-0.1, 0.1], [-0.1, 0.1]])
    counts = thermo("atoms f_bonds f_bonds[1] f_bonds[5]") + "thermo_modify lost ignore\n"
    text = head(skin=0.002) + pair(contact="none break 0.01") + """fix move all nve
timestep 1e-6
group first id 1
velocity first set -100 0 0
""" + counts + """
thermo 200
run 400
group second id 2
delete_atoms group second compress no
run 0
write_restart gone.restart
"""
    again = head(start="read_restart gone.restart", skin=0.002) + "fix bonds all evp/bonds\n" + counts + "run 0\n"
    for ranks, later in ((1, 2), (2, 1)):
        run = lmp(text, ranks).ok()
        rows = [run.thermo(0), run.thermo(1), lmp(again, later).ok().thermo()]
        assert [(table["Atoms"][-1], table["f_bonds"][-1], table["f_bonds[1]"][-1], table["f_bonds[5]"][-1]) for table in rows] == [
            (2, 2, 0, 1), (1, 2, 1, 1), (1, 2, 1, 1)]


@pytest.mark.parametrize("style, more", [("literal", "fix energy all evp/energy\n"), ("literal", "fix volume all evp/volume 500\n"), ("none break 0.5", "")])
def test_records_of_deleted_partners_go(lmp, tmp_path, bar, style, more):
    """Else they would be looked for at each neighbor build. They count as before: as recorded, and as not acting, after a restart too."""
    gone = 90
    partners = sum(gone in pair for pair in bar.bonds)
    columns = thermo("f_bonds f_bonds[1]") + "thermo_modify lost ignore\n"
    deleted, lost = f"group gone id {gone}\ndelete_atoms group gone compress no\n", f"set atom {gone} vx -1e9\n"
    for ranks, newton, how in ((1, "on", deleted), (2, "off", lost), (3, "on", deleted)):
        text = head(newton) + pair(contact=style) + more + MOVE + columns + f"timestep 1e-9\nrun 0\nwrite_restart whole.restart\n{how}"
        run = lmp(text + "neigh_modify check no\nrun 3\nwrite_restart cut.restart\nwrite_evp_bonds cut.bonds\n", ranks).ok()
        again = lmp(head(newton, start="read_restart cut.restart") + "fix bonds all evp/bonds\n" + more + MOVE + columns + "run 1\n", ranks % 3 + 1).ok()
        assert [(table["f_bonds"][-1], table["f_bonds[1]"][-1]) for table in (run.thermo(), again.thermo())] == [(len(bar.bonds), partners)] * 2
        whole, cut = ((tmp_path / f"{name}.restart").read_bytes().count(struct.pack("<q", gone)) for name in ("whole", "cut"))
        assert whole > partners and cut == 0, "ID in the records of its partners"
        assert len(read_pairs(tmp_path / "cut.bonds").bonds) == len(bar.bonds) - partners, (ranks, how)


@pytest.mark.parametrize("style, fails", [("contact none break 0.05", None), ("contact repulsive plasticity isotropic", 0.05)])
def test_why_bonds_ended(lmp, tmp_path, bar, style, fails):
    """f_ID[7] failed and f_ID[8] passed dlim, together f_ID[5], as the events say: the same on all ranks, after a restart and with a bond file. With eq. 8
    short bonds break and long ones pass dlim first."""
    style, columns = f"pair_style evp/lj {style} overlap 0.7\npair_coeff * * 80 8 4 3 8 4 0.005 0 1.5{failing_at(fails)}\n", thermo("f_bonds[5] f_bonds[7] f_bonds[8]")
    go = "fix move all nve\ntimestep 3e-7\nrun {}\n"
    text = style + "fix bonds all evp/bonds events {}.events\n" + FLOWING_SWING + columns
    found = set()
    for ranks, newton in ((1, "on"), (2, "off"), (3, "on")):
        run = lmp(head(newton) + text.format("first") + go.format(300) + "write_restart half.restart\nwrite_data half.data nocoeff\nwrite_evp_bonds half.bonds\nrun 300\n", ranks).ok()
        found.add(tuple(run.thermo()[f"f_bonds[{k}]"][-1] for k in (5, 7, 8)))
        lines = (tmp_path / "first.events").read_text(encoding="utf-8")
        for start, fix in (("read_restart half.restart", "fix bonds all evp/bonds"), ("read_data half.data", "fix bonds all evp/bonds file half.bonds")):
            table = lmp(head(newton, start=start) + style + fix + "\n" + columns + go.format(300), ranks % 3 + 1).ok().thermo()
            assert 0 < table["f_bonds[7]"][0] < table["f_bonds[7]"][-1] and table["f_bonds[8]"][-1] > 0, "control"
            found.add(tuple(table[f"f_bonds[{k}]"][-1] for k in (5, 7, 8)))
        found.add((lines.count(" failed ") + lines.count(" dlim "), lines.count(" failed "), lines.count(" dlim ")))
    assert len(found) == 1, found


# ---- runs that go on from a restart file, of their middle or of the moment where they were killed, to the last bit ----

TOTAL, EVERY = 1200, 370  # steps of the run, and from one restart file to the next, for which LAMMPS builds its lists
# gentle enough for thousands of steps: an oscillation into the second regime and back, without a drift
SWING = "velocity all ramp vx -20 20 x 0 0.06\n"
# flows both ways and breaks bonds all the way
FLOWING_SWING = (velocities("30*sin(1.3*id)", "30*cos(2.7*id)", "30*sin(3.9*id)")
                 + "velocity all zero linear\nvelocity all ramp vx -60 60 x 0 0.06 sum yes\n")
BONDS, VOLUME = "fix bonds all evp/bonds\n", "fix volume all evp/volume 500\n"
# what is left of a bond of spheres that overlap repels from the next forces on, which after a restart are those of the set-up: no contacts
SCENES = {"eq. 8": (pair() + SWING, BONDS, MOVE), "flow": (flowing_pair("none", 0.05, fix=BONDS.strip() + " zone 1.4") + FLOWING_SWING, BONDS + VOLUME, MOVE_FLOWING)}


@pytest.mark.parametrize("name, ranks", [("eq. 8", 1), ("flow", 2)])
def test_runs_resume_to_the_last_bit(lmp, lmp_decks, tmp_path, bar, name, ranks):
    """Without sorting of atoms and on the same ranks the restart file holds every bit: thermo table, last state and bond file are the same."""
    start, fixes, move = SCENES[name]
    last = f"restart {EVERY} part.*\nrun {TOTAL} upto\nwrite_dump all custom end.dump id x y z vx vy vz fx fy fz modify format float %.17g\nwrite_evp_bonds end.bonds\n"
    whole = lmp(head(sort="sort 0 0") + start + move + last, ranks).ok()
    table, expected = whole.thermo(), whole.dump("end.dump")[-1]
    assert np.ptp(table["f_bonds[5]" if name == "flow" else "f_bonds[1]"]) > 0 and table["f_bonds[2]"].max() > 20, "control: bonds change"
    decks = {step: head(start=f"read_restart part.{step}", sort="sort 0 0") + fixes + move + last for step in range(EVERY, TOTAL, EVERY)}
    for step, run in lmp_decks(decks, ranks).items():
        assert "recorded" not in run.stdout
        again, end = run.thermo(), run.dump("end.dump")[-1]
        assert again["Step"][0] == step
        for column, values in again.items():
            assert np.array_equal(values, table[column][-len(values):]), (step, column)
        assert all(np.array_equal(end[column], values) for column, values in expected.columns.items()), step
        ours, theirs = ((folder / "end.bonds").read_text(encoding="utf-8").splitlines() for folder in (run.folder, tmp_path))
        assert sorted(ours) == sorted(theirs), step


EVENTS = "fix bonds all evp/bonds events all.events\n"


@pytest.mark.parametrize("style, fails", [("contact none break 0.05", None), ("contact repulsive plasticity isotropic", 0.1)])
def test_events_of_runs_that_go_on(lmp, tmp_path, bar, style, fails):
    """After a restart the file goes on where the restart file was written, though the run before went further; a run that starts begins it anew, from a bond file too."""
    file, style = tmp_path / "all.events", f"pair_style evp/lj {style} overlap 0.7\npair_coeff * * 80 8 4 3 8 4 0.005 0 1.5{failing_at(fails)}\n"
    move = "fix move all nve\ntimestep 3e-7\n"
    for ranks, newton in ((1, "on"), (2, "off")):
        start = head(newton, sort="sort 0 0") + style + EVENTS + FLOWING_SWING + move
        again = head(newton, start="read_restart half.restart", sort="sort 0 0") + EVENTS + move
        file.write_text("17 lines of another run\n", encoding="utf-8")
        lmp(start + "run 300\nwrite_restart half.restart\nwrite_data half.data nocoeff\nwrite_evp_bonds half.bonds\nrun 300\n", ranks).ok()
        whole = file.read_text(encoding="utf-8")
        steps = [int(line.split()[0]) for line in whole.splitlines()[1:]]
        assert whole.startswith("# step i j what x y z\n") and sum(step <= 300 for step in steps) > 10 < sum(step > 300 for step in steps), "control"
        file.write_text(whole[:-3], encoding="utf-8")  # killed as it wrote
        for more in ("run 100\nrun 50\n", "run 300\n"):
            lmp(again + more, ranks).ok()
        assert file.read_text(encoding="utf-8") == whole, (ranks, newton)
        file.unlink()
        lmp(again + "run 300\n", ranks).ok()
        assert file.read_text(encoding="utf-8").splitlines()[1:] == [line for line in whole.splitlines()[1:] if int(line.split()[0]) > 300]
        lmp(head(newton, start="read_data half.data") + style + EVENTS.replace(" events", " file half.bonds events") + move + "run 0\n", ranks).ok()
        assert file.read_text(encoding="utf-8") == "# step i j what x y z\n"


# ---- what is not recorded, and who says so ----


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (3, "off")])
def test_pairs_that_special_bonds_keep_out_are_counted(lmp, ranks, newton):
    """A body with the bonds of another package, along the edges of its lattice; the diagonals are left."""
    text = f"""
units si
atom_style hybrid sphere bond
newton {newton} {newton}
boundary p p p
lattice sc 0.01
region box block 0 4 0 4 0 4
create_box 1 box bond/types 1 extra/bond/per/atom 6 extra/special/per/atom 100
create_atoms 1 box
set group all diameter 0.01 density 2700
bond_style zero
bond_coeff *
special_bonds lj 0 1 1
neighbor 0.001 bin
comm_modify cutoff 0.02
pair_style evp/lj contact repulsive
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.5
create_bonds many all all 1 0.009 0.011
special_bonds lj WEIGHT
fix bonds all evp/bonds
fix move all nve
run 0
"""
    said = {weight: [line for line in lmp(text.replace("WEIGHT", weight), ranks).ok().stdout.splitlines() if "evp/bonds" in line and ("record" in line)]
            for weight in ("1 1 1", "0 1 1", "0 0 1")}
    edges, diagonals = 3 * 64, 6 * 64
    assert [f"recorded {edges + diagonals} pairs" in " ".join(said["1 1 1"]), "WARNING" in " ".join(said["1 1 1"])] == [True, False]
    for weight, left in (("0 1 1", edges), ("0 0 1", edges + diagonals)):
        text = " ".join(said[weight])
        assert f"{left} pairs within reach are not recorded" in text and "special_bonds lj 1 1 1" in text and f"recorded {edges + diagonals - left} pairs" in text


@pytest.mark.parametrize("ranks", [1, 3])
def test_atoms_that_come_later_are_said_once(lmp, bar, ranks):
    """Of the group of the fix only, and not before there are any."""
    text = head() + "group first id > 0\ngroup last empty\n" + pair(fix="fix bonds FIRST evp/bonds") + "fix move all nve\ntimestep 1e-9\nrun 1\n"
    text += "create_atoms 1 single -0.015 -0.015 -0.015\nset atom 1000* diameter 0.01\nLATER\nrun 1\ncreate_atoms 1 single -0.015 0.05 -0.015\nrun 1\n"
    said = {}
    for name, change, later in (("all", "all", ""), ("the first", "first", "")):
        run = lmp(text.replace("FIRST", change).replace("LATER", later).replace("set atom 1000* diameter 0.01\n", ""), ranks).ok()
        said[name] = [line for line in run.warnings() if "came after the bonds were recorded" in line]
    assert [len(lines) for lines in said.values()] == [1, 0] and "1 atoms of its group" in said["all"][0]
