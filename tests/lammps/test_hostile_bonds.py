# SPDX-License-Identifier: GPL-2.0-only
"""Bond files that are damaged, foreign or of another body: one clear error that names the line or the bond.

What the reader alone can see is told apart in tests/unit/test_bond_file.cpp; here it has to reach the user."""

import random

import pytest
from hostile import SECONDS, refused, scene

TOO_LONG = 10_000  # records; more than one message between the ranks holds
HEADER = "# EVP bonds COUNT: {} UNITS: si\n"


def bonds(*lines, count=None):
    return (HEADER.format(len(lines) if count is None else count) + "".join(f"{line}\n" for line in lines)).encode()


def line(number):
    return f"Fix bonds evp/bonds: bond file line {number}: "


DAMAGED = {
    "empty": (b"", "the bond file is empty or cannot be read (file 'b.bonds')"),
    "data file": (b"LAMMPS data file via write_data\n\n12 atoms\n", line(1) + "expected the header '# EVP bonds COUNT: 0 UNITS: si'"),
    "binary garbage": (random.Random(3).randbytes(4000), line(1)),
    "byte-order mark": (b"\xef\xbb\xbf" + bonds("1 2 0.0101"), line(1) + "expected the header"),
    "other units": (b"# EVP bonds COUNT: 1 UNITS: lj\n1 2 0.0101\n", line(1) + "the bonds are in UNITS: lj, but 'units si' is in force"),
    "count is huge": (bonds("1 2 0.0101", count=10**17), "the bond file holds 1 bonds, its header says 100000000000000000: it is incomplete"),
    "count too low": (bonds("1 2 0.0101", "2 3 0.0101", count=1), "the bond file holds 2 bonds, its header says 1"),
    "cut in a number": (bonds("1 2 0.0101", "2 3 0.0101234")[:-4], line(3) + "the last line has no line end: the file is incomplete"),
    "a million columns": (bonds("1 " * 1_000_000), line(2) + "expected 3 or 7 values, got 1000000"),
    "negative deq": (bonds("1 2 -0.0101"), line(2) + "deq must be positive, got -0.0101"),
    "inf deq": (bonds("1 2 inf"), line(2) + "deq must be a finite decimal number, got 'inf'"),
    "self bond": (bonds("2 2 0.0101"), "bond 2 2 is given twice in file b.bonds"),
    "unknown ID": (bonds("1 13 0.0101"), "bond 1 13: there is no atom 13: read the data file that was written with the bond file (bond file b.bonds)"),
    "ID beyond 32 bits": (bonds("1 4294967298 0.0101"), "there is no atom 4294967298:"),  # modulo 2^32 it is atom 2
    "reversed duplicate": (bonds("1 2 0.0101", "2 1 0.0102"), "bond 1 2 is given twice in file b.bonds"),
    "late duplicate": (bonds("1 2 0.0101", *["# 1 2 0.0101"] * TOO_LONG, "1 2 0.0101", count=2), "bond 1 2 is given twice in file b.bonds"),
}


def use(file="b.bonds", group="all", **parts):
    return scene(fix=f"group first id 1 2 3\nfix bonds {group} evp/bonds file {file}", **parts)


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_bond_file(lmp, tmp_path, name):
    content, *says = DAMAGED[name]
    (tmp_path / "b.bonds").write_bytes(content)
    refused(lmp(use(), seconds=SECONDS), *says)
    assert (tmp_path / "b.bonds").read_bytes() == content


@pytest.mark.parametrize("name", ["cut in a number", "unknown ID", "reversed duplicate"])
def test_all_ranks_stop_at_a_damaged_bond_file(lmp, tmp_path, name):
    content, *says = DAMAGED[name]
    (tmp_path / "b.bonds").write_bytes(content)
    refused(lmp(use(), ranks=2, seconds=SECONDS), *says)


@pytest.mark.parametrize("file", ["nowhere.bonds", "nowhere/b.bonds", "loop.bonds", '"a b"'])
def test_bond_file_that_is_not_there(lmp, tmp_path, file):
    (tmp_path / "loop.bonds").symlink_to("loop.bonds")
    refused(lmp(use(file), seconds=SECONDS), f"Fix bonds evp/bonds: cannot read the bond file '{file.strip(chr(34))}': give its path")


@pytest.mark.parametrize("file", [".", "/proc/self/mem"])
def test_bond_file_that_cannot_be_read(lmp, file):
    refused(lmp(use(file), seconds=SECONDS), f"Fix bonds evp/bonds: the bond file is empty or cannot be read (file '{file}')")


def test_bonds_outside_the_group(lmp, tmp_path):
    (tmp_path / "b.bonds").write_bytes(bonds("1 2 0.0101", "3 4 0.0101"))
    refused(lmp(use(group="first"), seconds=SECONDS), "bond 3 4: atom 4 is not in the fix's group (bond file b.bonds)")


def test_bond_file_in_a_minimisation(lmp, tmp_path):
    (tmp_path / "b.bonds").write_bytes(bonds("1 2 0.0101", "2 1 0.0101"))
    refused(lmp(use(run="minimize 0 1e-9 10 10"), seconds=SECONDS), "bond 1 2 is given twice in file b.bonds")


@pytest.mark.parametrize("content, count", [
    (bonds("1 2 0.0101", "2 3 0.0101"), 2), (bonds("2 1 1.01e-2", "003 2 +.0101"), 2), (bonds(), 0),
    (bonds("1 2 0.0101", "", "# none", "  2\t3 0.0101 # one").replace(b"COUNT: 4", b"COUNT: 2").replace(b"\n", b"\r\n"), 2),
    (bonds("1 12 0.0101"), 1)], ids=["control", "other spelling", "none", "CRLF and comments", "partners far apart"])
def test_legal_bond_files(lmp, tmp_path, content, count):
    (tmp_path / "b.bonds").write_bytes(content)
    run = lmp(use(), seconds=SECONDS).ok()
    assert f"recorded {count} pairs from file b.bonds" in run.stdout
    assert list(run.thermo()["f_bonds"]) == [count] * 2
