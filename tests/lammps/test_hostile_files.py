# SPDX-License-Identifier: GPL-2.0-only
"""Parameter files that are damaged, foreign or no files at all: one clear error, or the documented right result.

What test_bad_input.py demands already is not repeated; the random damage is in tests/unit/test_fuzz_input.cpp."""

import random

import pytest
from hostile import ROW, SECONDS, refused, scene

HEAD = b"# DATE: 2026-01-01 UNITS: si CITATION: none\n"
GOOD = HEAD + b"# name e1 m1 n1 e2 m2 n2 xi_s gamma alpha\na " + ROW.encode() + b"\nb 50 6 3 5 8 4 0.01 0 1.4\n"
GARBAGE = random.Random(20170515).randbytes(4000)

DAMAGED = {
    "cut in a row": (GOOD[:GOOD.index(b"\nb ") - 10], "file p.evp line 3: expected 9 values", "got 7"),
    "cut after the header": (HEAD, "file p.evp has no row 'a'; its rows: none"),
    "NUL first": (b"\0" + GOOD, "file p.evp: the first line must be a comment with 'UNITS: si'"),
    "binary garbage": (GARBAGE, "file p.evp"),
    "garbage in a row": (HEAD + b"a \xff\xfe\x1b[31m 8 4 3 8 4 0.005 0 1.5\n", "line 2: e1 must be a finite decimal number, got '???[31m'"),
    "byte-order mark": (b"\xef\xbb\xbf" + GOOD, "file p.evp: the first line must be a comment with 'UNITS: si'"),
    "a million columns": (HEAD + b"a" + b" 1" * 500_000 + b"\n", "line 2: expected 9 values", "got 500000"),
    "units of another style": (GOOD.replace(b"si", b"metal", 1), "file p.evp: the first line must be a comment with 'UNITS: si', the units in force, got 'metal'"),
    "thousand other rows": (HEAD + b"".join(f"r{k} {ROW}\n".encode() for k in range(1000)), "no row 'a'; its rows: r0, r1,"),
    "row twice": (GOOD + GOOD.splitlines()[2] + b"\n", "file p.evp line 5: row 'a' is given twice"),
}


def use(name="p.evp a"):
    return scene(coeff=f"pair_coeff * * {name}")


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_parameter_file(lmp, tmp_path, name):
    content, *says = DAMAGED[name]
    (tmp_path / "p.evp").write_bytes(content)
    run = lmp(use(), seconds=SECONDS)
    refused(run, *says)
    assert len(run.stdout) < 20_000, "no file is poured over the terminal"
    assert (tmp_path / "p.evp").read_bytes() == content


@pytest.mark.parametrize("content", [GOOD, GOOD.replace(b"\n", b"\r\n"), GOOD[:-1], GOOD.replace(b"80", b"+8.0E+1"),
                                     b"# UNITS: si UNITS: metal\n\n\n\t a\t" + ROW.replace(" ", "\t ").encode() + b" # c\n"],
                         ids=["control", "CRLF", "no final newline", "other spelling", "white space"])
def test_legal_spellings_are_the_same_row(lmp, tmp_path, content):
    (tmp_path / "p.evp").write_bytes(content)
    run = lmp(use(), seconds=SECONDS).ok()
    assert run.thermo()["PotEng"][-1] == lmp(scene(), seconds=SECONDS).ok().thermo()["PotEng"][-1]


@pytest.mark.parametrize("file", ["folder", "nowhere/p.evp", "loop.evp", "/proc/self/mem", "p.evp/p.evp", '"no such file"', '""'])
def test_unreadable_parameter_file(lmp, tmp_path, file):
    """/proc/self/mem opens and cannot be read, whoever asks."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "p.evp").write_bytes(GOOD)
    (tmp_path / "loop.evp").symlink_to("loop.evp")
    refused(lmp(use(file + " a"), seconds=SECONDS), f"cannot read the potential file '{file.strip(chr(34))}': give its path")


@pytest.mark.parametrize("name, shown", [("{}", "{}"), ("%s%n", "%s%n"), ("x" * 300, "x" * 40 + "..."), ("\x1b[31m", "?[31m"), ('""', "")],
                         ids=["braces", "percent", "long", "escape", "empty"])
def test_row_names_that_are_none(lmp, tmp_path, name, shown):
    (tmp_path / "p.evp").write_bytes(GOOD)
    refused(lmp(use(f"p.evp {name}"), seconds=SECONDS), f"file p.evp has no row '{shown}'; its rows: a, b")


@pytest.mark.parametrize("name", ["a million columns"])
def test_all_ranks_stop_at_a_damaged_parameter_file(lmp, tmp_path, name):
    content, *says = DAMAGED[name]
    (tmp_path / "p.evp").write_bytes(content)
    refused(lmp(use(), ranks=2, seconds=SECONDS), *says)
