# SPDX-License-Identifier: GPL-2.0-only
"""Which atoms are one body goes through restart files and, in the header, through bond files; and is refused where it would change."""

import pytest
from flowing import BREAK, SHAKE, flowing_pair, largest_difference, read_pairs
from hostile import refused
from small_bodies import (MOVE, STIR, assert_same_curve, check_forces, dump, head, lattice_body, pair, write_body)
from test_within import FIX, MOLECULES, bodies_of, divided, setup

HALF = 40
BODIES = " within {} (bodies only repel each other)"
FROM_DATA = "{before}read_data half.data nocoeff{sections}\nreset_timestep 40"


@pytest.fixture
def bar(tmp_path):
    body = lattice_body(zone=1.4)
    write_body(tmp_path / "body.data", body)
    return body


def curve(name, steps=HALF):
    return MOVE + "thermo 20\n" + dump(name, 20) + f"run {steps}\n"


def first_half(word, newton="on"):
    text = head(newton) + setup(word) + pair(fix=f"fix bonds all evp/bonds zone 1.4 within {word}") + STIR + MOVE + f"thermo 20\nrun {HALF}\n"
    return text + "write_restart half.restart\nwrite_data half.data\nwrite_evp_bonds half.bonds\n" + dump("whole.dump", 20) + f"run {HALF}\n"


def second_half(word, way, keyword, newton="on"):
    """way: restart or file; keyword: what the fix is given. Molecule IDs are those of the files."""
    molecules = MOLECULES if word == "molecule" else ""
    if way == "restart":
        return head(newton, start="read_restart half.restart") + molecules + f"fix bonds all evp/bonds {keyword}\n" + curve("rest.dump")
    sections = " fix molecules NULL Molecules" if molecules else ""
    start = FROM_DATA.format(before=molecules, sections=sections)
    return head(newton, start=start) + pair(fix=f"fix bonds all evp/bonds file half.bonds {keyword}") + curve("rest.dump")


@pytest.mark.parametrize("word, ranks, other", [("type", 1, 2), ("type", 4, 1), ("molecule", 2, 1), ("molecule", 1, 4)])
@pytest.mark.parametrize("way", ["restart", "file"])
@pytest.mark.parametrize("given", [True, False])
def test_the_rest_of_a_run(lmp, bar, word, ranks, other, way, given):
    """On another number of ranks, with the keyword or without, in which case the file says it: the same numbers, and forces
    that are those of the sum over all pairs."""
    whole = lmp(first_half(word), ranks).ok()
    rest = lmp(second_half(word, way, f"within {word}" if given else "", "off" if ranks == 4 else "on"), other).ok()
    assert BODIES.format(word) in rest.stdout
    if way == "restart":
        assert (f"fix evp/bonds bonds: within {word}, as in the restart file" in rest.stdout) == (not given)
    else:
        assert f"from file half.bonds and within {word}" in rest.stdout
    assert_same_curve(rest.thermo(), whole.thermo())
    end = rest.dump("rest.dump")[-1]
    found = check_forces(end, divided(bar, word), bodies=bodies_of(bar, word))
    i, j = found["i"], found["j"]
    bodies = bodies_of(bar, word)
    assert (bodies[i] != bodies[j]).sum() > 20, "control"


@pytest.mark.parametrize("way", ["restart", "file"])
def test_with_flow_and_broken_bonds(lmp, tmp_path, bar, way):
    """The record of a restart file that has both a history and bodies."""
    fix = "fix bonds all evp/bonds zone 1.4 within type"
    move = "fix move all nve\ntimestep 3e-7\n"
    write = "write_restart half.restart\nwrite_data half.data nocoeff\nwrite_evp_bonds half.bonds\n"
    lmp(head() + flowing_pair(kv=0, fix=fix) + SHAKE + move + f"run 40\n{write}run 20\nwrite_evp_bonds whole.bonds\n").ok()
    if way == "restart":
        text = head(start="read_restart half.restart") + "fix bonds all evp/bonds\n"
    else:
        text = head(start="read_data half.data") + flowing_pair(kv=0, fix="fix bonds all evp/bonds file half.bonds")
    run = lmp(text + move + "run 20\nwrite_evp_bonds rest.bonds\n", 2).ok()
    assert BODIES.format("type") in run.stdout
    whole, rest = (read_pairs(tmp_path / f"{name}.bonds") for name in ("whole", "rest"))
    assert largest_difference(rest, whole) < 1e-9
    assert len(whole.of(1)) > 3 and len(whole.of(2)) > 10 and BREAK, "control"


def test_files_without_it_are_as_they_were(lmp, tmp_path, bar):
    """No word more in the header of a bond file."""
    for word in ("", " within type"):
        lmp(head() + pair(fix="fix bonds all evp/bonds" + word) + "run 0\nwrite_evp_bonds s.bonds\n").ok()
        header = (tmp_path / "s.bonds").read_text(encoding="utf-8").splitlines()[0]
        count = len((tmp_path / "s.bonds").read_text(encoding="utf-8").splitlines()) - 1
        assert header == f"# EVP bonds COUNT: {count}{' WITHIN: type' if word else ''} UNITS: si"


@pytest.mark.parametrize("first, then", [("within type", "within molecule"), ("", "within type")])
def test_another_word_after_a_restart_is_refused(lmp, bar, first, then):
    lmp(head() + pair(fix="fix bonds all evp/bonds " + first) + "run 0\nwrite_restart s.restart\nwrite_data s.data nocoeff\nwrite_evp_bonds s.bonds\n").ok()
    run = lmp(head(start="read_restart s.restart") + MOLECULES + f"fix bonds all evp/bonds {then}\nfix move all nve\nrun 1\n", 2)
    refused(run, f"Fix bonds evp/bonds: the bonds of the restart file were recorded with another 'within' than {then.split()[1]}: leave it out")


def test_the_remedy_of_that_error(lmp, tmp_path, bar):
    """Bonds go on as they are, under another rule for contacts; all atoms are made one molecule."""
    lmp(head() + pair(fix=FIX + "type") + "run 0\nwrite_restart s.restart\n").ok()
    text = head(start="read_restart s.restart") + MOLECULES + "set group all mol 1\nfix bonds all evp/bonds\nwrite_evp_bonds s.bonds\nunfix bonds\n"
    run = lmp(text + "fix again all evp/bonds file s.bonds within molecule\nfix move all nve\nrun 1\nwrite_evp_bonds t.bonds\n").ok()
    assert "from file s.bonds and within molecule" in run.stdout and "fix again" + BODIES.format("molecule") in run.stdout
    s, t = ((tmp_path / f"{name}.bonds").read_text(encoding="utf-8").splitlines() for name in "st")
    assert "WITHIN: type" in s[0] and "WITHIN: molecule" in t[0] and sorted(s[1:]) == sorted(t[1:])


def test_a_restart_file_from_before_the_recording(lmp, bar):
    """The fix takes over what that file's fix was given, or what it is given itself."""
    lmp(head() + pair(fix=FIX + "type") + "write_restart s.restart\n").ok()
    start = head(start="read_restart s.restart") + MOLECULES + "set group all mol 1\n"
    run = lmp(start + "fix bonds all evp/bonds\nfix move all nve\nrun 0\n").ok()
    assert "and within type, at most" in run.stdout
    run = lmp(start + FIX + "molecule\nfix move all nve\nrun 0\n").ok()
    assert "and within molecule, at most" in run.stdout


def test_unfix_ends_it(lmp, bar):
    """Without the fix there are no bodies any more, as there are no bonds."""
    run = lmp(head() + pair(fix=FIX + "type") + "fix move all nve\nrun 0\nunfix bonds\nrun 0\n").ok()
    first, last = (line for line in run.stdout.splitlines() if line.startswith("evp/lj: "))
    assert "within type" in first and "within" not in last and "no fix evp/bonds" in last
