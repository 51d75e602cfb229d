# SPDX-License-Identifier: GPL-2.0-only
"""Restart files cut and changed, atoms that share IDs, are no numbers, are lost or were deleted."""

import struct

import pytest
from hostile import BONDS, SECONDS, refused, scene

CONTINUE = """
read_restart {}
fix bonds all evp/bonds
fix move all nve
timestep 1e-7
thermo_style custom step pe press f_bonds f_bonds[1]
run 3
"""
END_MARK = b"LammpS RestartT\0"  # the last that LAMMPS writes into a restart file
CUT = "Incomplete or corrupted LAMMPS restart file"
NAN = "variable nan atom 1e308*10-1e308*10\nset atom 1 "


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """The scene after its run: data file, bond file and the bytes of its restart file."""
    from lammps_run import run_lammps
    folder = tmp_path_factory.mktemp("saved")
    run_lammps(scene(after="write_data s.data nocoeff\nwrite_evp_bonds s.bonds\nwrite_restart s.restart"), cwd=folder).ok()
    return folder


@pytest.fixture
def resume(lmp, tmp_path):
    """Continues from these bytes of a restart file."""

    def run(content, ranks=1):
        (tmp_path / "r.restart").write_bytes(content)
        return lmp(CONTINUE.format("r.restart"), ranks=ranks, seconds=SECONDS)

    return run


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_restart_itself_continues(saved, resume, ranks):
    run = resume((saved / "s.restart").read_bytes(), ranks).ok()
    assert list(run.thermo()["f_bonds"]) == [BONDS] * 2
    assert abs(run.thermo()["Press"][-1]) < 1.0  # at rest still, in Pa


@pytest.mark.parametrize("length, text", [
    (0, "Invalid LAMMPS restart file"), (10, "Invalid LAMMPS restart file"), (100, CUT), (0.3, CUT), (0.6, CUT), (0.9, CUT), (-len(END_MARK) - 1, CUT)])
def test_truncated_restart(saved, resume, length, text):
    whole = (saved / "s.restart").read_bytes()
    size = int(length * len(whole)) if isinstance(length, float) else length
    refused(resume(whole[:size]), text)


def test_restart_cut_in_its_end_mark(saved, resume):
    whole = (saved / "s.restart").read_bytes()
    assert whole.endswith(END_MARK)
    refused(resume(whole[:-1]), CUT)


def test_truncated_restart_on_two_ranks(saved, resume):
    whole = (saved / "s.restart").read_bytes()
    refused(resume(whole[:len(whole) // 2], ranks=2), CUT)


def test_a_restart_file_of_something_else(resume):
    refused(resume(b"# EVP bonds COUNT: 0 UNITS: si\n" * 10), "Invalid LAMMPS restart file")


def after_name(content):
    """Where the state of the fix starts: behind its style's name and the length of the state."""
    return content.index(b"evp/bonds\0") + len(b"evp/bonds\0") + 4


def at_record(content):
    """Where atom 1's record starts: its ID as recorded, and how many bonds it has."""
    found = [content.find(struct.pack("<qq", 1, count)) for count in range(5, 9)]
    return min(k for k in found if k >= 0)


FIX_DAMAGED = "Fix bonds evp/bonds: its section of the restart file is damaged"
ATOM_DAMAGED = "Fix bonds evp/bonds: the bonds of atom 1 in the restart file are damaged"
SETTINGS_DAMAGED = "Pair evp/lj: the restart file is damaged in the settings"


@pytest.mark.parametrize("where, offset, bit, text", [
    (after_name, 0, 5, FIX_DAMAGED), (after_name, 62, 6, FIX_DAMAGED),
    (at_record, -2, 3, ATOM_DAMAGED), (at_record, 8, 1, ATOM_DAMAGED), (at_record, 13, 7, ATOM_DAMAGED)])
def test_a_changed_size_or_flag_in_our_sections(saved, resume, where, offset, bit, text):
    """Flag and number of types of the fix's section; number of words and of bonds of an atom."""
    content = bytearray((saved / "s.restart").read_bytes())
    content[where(bytes(content)) + offset] ^= 1 << bit
    refused(resume(bytes(content)), text)


@pytest.mark.parametrize("word", [0, 1, 2, 6])
def test_a_changed_size_or_flag_in_the_settings(saved, resume, word):
    """Flag, coefficients of a row, contact and length of an ID stand right behind the name of the pair style."""
    content = bytearray((saved / "s.restart").read_bytes())
    content[bytes(content).index(b"evp/lj\0") + len(b"evp/lj\0") + 8 * word + 7] = 0x7f
    refused(resume(bytes(content)), SETTINGS_DAMAGED + ", or from a version of this package that wrote another format")


def test_a_changed_size_stops_all_ranks(saved, resume):
    content = bytearray((saved / "s.restart").read_bytes())
    content[at_record(bytes(content)) + 8] ^= 1
    refused(resume(bytes(content), ranks=2), ATOM_DAMAGED)


DATA = """spheres

3 atoms
1 atom types

-0.01 0.06 xlo xhi
-0.01 0.01 ylo yhi
-0.01 0.01 zlo zhi

Atoms # sphere

"""
ATOMS = ["1 1 0.01 2700 0.0 0 0", "2 1 0.01 2700 0.0101 0 0", "3 1 0.01 2700 0.0202 0 0"]


@pytest.fixture
def spheres(lmp, tmp_path):
    """Runs the scene on a data file of these lines."""

    def run(lines, ranks=1, **parts):
        (tmp_path / "s.data").write_text(DATA + "\n".join(lines) + "\n", encoding="utf-8")
        return lmp(scene(box="boundary f f f\nread_data s.data", **parts), ranks=ranks, seconds=SECONDS)

    return run


def test_the_spheres_themselves_run(spheres):
    assert "recorded 2 pairs" in spheres(ATOMS).ok().stdout


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("fix", ["", " file none.bonds"], ids=["zone", "file"])
def test_an_id_given_twice(spheres, fix, ranks):
    """LAMMPS takes such a data file; no record could tell the two apart, near to each other or not."""
    refused(spheres(["2" + ATOMS[0][1:], *ATOMS[1:]], ranks, fix="fix bonds all evp/bonds" + fix),
            "Fix bonds evp/bonds: atom ID 2 is given twice: use 'reset_atoms id'")


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_deleted_partner_of_far_id_and_a_restart(lmp, spheres, ranks):
    """After the restart LAMMPS' map of IDs ends far below the ID that the records still name."""
    run = spheres([*ATOMS[:2], ATOMS[2].replace("3", "90000000", 1)], ranks, map="atom_modify map array",
                  after="group far id 90000000\ndelete_atoms group far compress no\nwrite_restart s.restart\n"
                  + "clear\n" + CONTINUE.format("s.restart")).ok()
    assert [*run.thermo(0)["f_bonds"], *run.thermo(1)["f_bonds"]] == [2] * 4
    assert list(run.thermo(1)["f_bonds[1]"]) == [1, 1]  # the bond of the deleted atom acts no more
    assert run.thermo(1)["PotEng"][0] == pytest.approx(0.5 * run.thermo(0)["PotEng"][0], rel=1e-5)  # printed digits


SECTION = "Atoms section of data file"


@pytest.mark.parametrize("word, value, text", [
    (0, "0", f"Invalid atom ID 0 in line 1 of {SECTION}"),
    (0, "-1", f"Invalid atom ID -1 in line 1 of {SECTION}"),
    (1, "2", f"Invalid atom type 2 in {SECTION}"),
    (2, "nan", "instead of 'nan'"), (2, "-0.01", "Pair evp/lj needs particles with a radius above zero"), (2, "1e300", "box size << cutoff"),
    (3, "0", "Invalid density"), (3, "nan", "instead of 'nan'"), (4, "nan", "instead of 'nan'"), (4, "1e300", "Did not assign all atoms correctly"),
    (4, "0.0101", "Fix bonds evp/bonds: atoms 1 and 2 coincide")])
def test_atoms_of_a_data_file(spheres, word, value, text):
    words = ATOMS[0].split()
    words[word] = value
    refused(spheres([" ".join(words), *ATOMS[1:]]), text)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("then", ["", "run 0\n"], ids=["at the start", "between runs"])
def test_coordinates_that_are_no_numbers(lmp, then, ranks):
    run = lmp(scene(then=then + NAN + "x v_nan"), ranks=ranks, seconds=SECONDS)
    refused(run, "Non-numeric atom coords", stepped=bool(then))
    assert run.stdout.count("Loop time") == then.count("run")


def test_radii_that_are_no_numbers(lmp):
    refused(lmp(scene(then=NAN + "diameter v_nan"), seconds=SECONDS), "Pair evp/lj needs particles with a radius above zero")


@pytest.mark.parametrize("ranks", [1, 2])
def test_lost_atoms(lmp, ranks):
    """At 1e6 m/s every atom is out of the box within a step."""
    refused(lmp(scene(then="velocity all set 1e6 0 0", run="neigh_modify every 1 delay 0 check no\nrun 30"), ranks=ranks, seconds=SECONDS),
            "Lost atoms: original 12 current 0", stepped=True)


def test_a_step_far_too_long(lmp):
    """Hundreds of times the stable step: the body flies apart, and LAMMPS says so."""
    refused(lmp(scene(step="timestep 1e-2", then="velocity all ramp vx -1 1 x 0 0.02", run="run 100"), seconds=SECONDS),
            "Lost atoms: original 12", stepped=True)
