# SPDX-License-Identifier: GPL-2.0-only
"""Commands with every word wrong: one clear error each, or a result that the manual promises.

What test_bad_input.py demands already is not repeated. Files are in test_hostile_files.py and
test_hostile_bonds.py, restarts and atoms in test_hostile_state.py."""

import pytest
from hostile import BONDS, ROW, SECONDS, Words, refused, scene

NUMBER = "must be a finite decimal number, got"
COEFF, FIX = "pair_coeff * * ", "fix bonds all evp/bonds "
NO_GROUP = "Could not find compute group ID"


def row(**values):
    """The row with some of its numbers replaced."""
    keys = "e1 m1 n1 e2 m2 n2 xi_s gamma alpha".split()
    return COEFF + " ".join({**dict(zip(keys, ROW.split())), **values}.values())


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_scene_itself_runs(lmp, ranks):
    run = lmp(scene(), ranks=ranks, seconds=SECONDS).ok()
    assert f"recorded {BONDS} pairs within alpha" in run.stdout
    assert not run.made_no_step()


CASES = [
    # pair_style
    ("style", "pair_style evp/lj contact 0", "contact must be literal, repulsive or none, got '0'"),
    ("style", "pair_style evp/lj CONTACT none", "unknown keyword 'CONTACT'; it takes contact and overlap"),
    ("style", "pair_style evp/lj none", "unknown keyword 'none'; it takes contact and overlap"),
    ("style", "pair_style evp/lj contact none contact", "keyword contact needs a value"),
    ("style", "pair_style evp/lj overlap 0.3 0.4", "unknown keyword '0.4'"),
    ("style", "pair_style evp/lj overlap -0.3", "overlap must lie in (0, 1]"),
    ("style", "pair_style evp/lj overlap inf", f"overlap {NUMBER} 'inf'"),
    ("style", "pair_style evp/lj overlap 1e400", f"overlap {NUMBER} '1e400'"),
    ("style", 'pair_style evp/lj overlap ""', f"overlap {NUMBER} ''"),
    ("style", "pair_style evp/lj contact {}", "contact must be literal, repulsive or none, got '{}'"),
    ("style", "pair_style evp", "Unrecognized pair style 'evp'"),
    ("style", "pair_style hybrid/overlay evp/lj evp/lj\npair_coeff * * evp/lj 1 " + ROW,
     "Pair evp/lj can be one sub-style of pair_style hybrid only", {"coeff": "pair_coeff * * evp/lj 2 " + ROW}),
    # pair_coeff
    ("units", "units si\n" + COEFF + ROW, "simulation box is defined"),
    ("coeff", "pair_coeff 0 1 " + ROW, "Invalid range string: 0"),
    ("coeff", "pair_coeff 1 one " + ROW, "Invalid range string: one"),
    ("coeff", "pair_coeff 1 -1 " + ROW, "Invalid range string: -1"),
    ("coeff", "pair_coeff 1", "pair_coeff"),
    ("coeff", COEFF + "80 8", "expected 9 values, got 2 (a row has e1"),
    ("coeff", COEFF + "gado2017.evp", "9 numbers e1 m1 n1 e2 m2 n2 xi_s gamma alpha"),
    ("coeff", COEFF + "gado2017.evp table1 table2", "FILE ROW or FILE:ROW without further arguments, got 3 words, the first 'gado2017.evp'"),
    ("coeff", row(gamma="inf"), f"gamma {NUMBER} 'inf'"),
    ("coeff", row(alpha="inf"), f"alpha {NUMBER} 'inf'"),
    ("coeff", row(m1="8..0"), f"m1 {NUMBER} '8..0'"),
    ("coeff", row(n1="%s%n"), f"n1 {NUMBER} '%s%n'"),
    ("coeff", row(e1="{}"), f"e1 {NUMBER} '{{}}'"),
    ("coeff", row(xi_s="0.5%"), f"xi_s {NUMBER} '0.5%'"),
    ("coeff", row(e2="9" * 5000), f"e2 {NUMBER} '{'9' * 40}...'"),
    ("coeff", row(alpha="1e30"), "alpha must not exceed 100"),
    ("coeff", row(xi_s="1e-400"), "xi_s must lie between 0 and 1"),
    ("coeff", row(e2="1e250"), "these parameters overflow double precision: check e1, e2, gamma and the exponents"),
    ("coeff", row(gamma="1e250"), "these parameters overflow double precision"),
    ("coeff", row(m1="200", xi_s="0.999"), "these parameters overflow double precision"),
    # fix evp/bonds
    ("units", "units si\nfix bonds all evp/bonds", "before simulation box is defined"),
    ("fix", "fix bonds nobody evp/bonds", "Could not find fix group ID nobody"),
    ("fix", FIX + "1.2", "unknown keyword '1.2'; it takes zone or file"),
    ("fix", FIX + "zone 1.2 1.3", "unknown keyword '1.3'"),
    ("fix", FIX + "zone 1.2 zone", "keyword zone needs a value"),
    ("fix", FIX + "zone inf", f"zone {NUMBER} 'inf'"),
    ("fix", FIX + "zone 1e400", f"zone {NUMBER} '1e400'"),
    ("fix", FIX + 'zone ""', f"zone {NUMBER} ''"),
    ("fix", FIX + "zone 1,2", f"zone {NUMBER} '1,2'"),
    ("fix", FIX + "zone 1e30", "reaches beyond what the neighbor list can see, alpha = 1.5"),
    ("fix", FIX + "file", "keyword file needs a value"),
    ("fix", FIX + 'file ""', "Fix bonds evp/bonds: the name of the bond file is empty"),
    ("fix", FIX + "zone 1.2 file some.bonds", "the bonds come from the zone or from a file, give one of the two"),
    ("then", "group half id <= 6\nfix two half evp/bonds", "Fix two evp/bonds: fix bonds records bonds already"),
    # computes, and what is read of the fix
    ("then", "compute dt nobody evp/dt",
     Words(NO_GROUP, in_2026="Group ID nobody requested by compute evp/dt does not exist")),
    ("then", "compute s nobody evp/state/atom",
     Words(NO_GROUP, in_2026="Group ID nobody requested by compute evp/state/atom does not exist")),
    ("then", "compute dt all evp/dt\nprint $(c_dt)",
     "Variable formula compute cannot be invoked before initialization by a run"),
    ("then", "compute s all evp/state/atom\nwrite_dump all custom s.dump id c_s[1]",
     "Dump compute ID s cannot be invoked before initialization by a run"),
    ("thermo", "compute dt all evp/dt\nthermo_style custom step c_dt[6]", "out-of-range"),
    ("thermo", "compute s all evp/state/atom\nthermo_style custom step c_s",
     Words("Thermo compute does not compute scalar", in_2026="Thermo custom compute s does not compute a scalar")),
    ("thermo", "compute s all evp/state/atom\ndump s all custom 1 s.dump id c_s[5]", "out-of-range"),
    ("thermo", "compute s all evp/state/atom\ndump s all custom 1 s.dump id c_s", "compute s does not calculate"),
    ("thermo", "thermo_style custom step f_bonds[6]", "out-of-range"),
    # write_evp_bonds
    ("units", "units si\nwrite_evp_bonds b.bonds", "there is no fix evp/bonds, hence no bonds to write"),
    ("then", "write_evp_bonds", "write_evp_bonds: expected one argument, the file to write"),
    ("then", "write_evp_bonds a.bonds b.bonds", "write_evp_bonds: expected one argument, the file to write"),
    ("then", "write_evp_bonds a.bonds", "fix bonds has not recorded yet", "use 'run 0' before"),
    ("then", "unfix bonds\nwrite_evp_bonds a.bonds", "there is no fix evp/bonds"),
]


@pytest.mark.parametrize("part, text, says, more", [(*case, None)[:4] for case in CASES], ids=range(len(CASES)))
def test_wrong_words(lmp, part, text, says, more):
    """more: another part to replace, or another text to demand."""
    parts = more if isinstance(more, dict) else {}
    refused(lmp(scene(**{part: text}, **parts), seconds=SECONDS), says, *([more] if isinstance(more, str) else []))


def test_keywords_given_twice_take_the_last(lmp):
    """As LAMMPS' own styles do."""
    text = scene(style="pair_style evp/lj contact none overlap 0.2 contact repulsive overlap 0.4", fix=FIX + "zone 1.4 zone 1.2",
                 coeff=row(gamma="1"))
    run = lmp(text, seconds=SECONDS).ok()
    assert "damping on, contact repulsive" in run.stdout
    assert "overlap warning above 0.4" in run.stdout
    assert "recorded 20 pairs within 1.2" in run.stdout  # the edges alone


def test_the_fix_defined_again_records_anew(lmp):
    run = lmp(scene(then="run 0\nfix bonds all evp/bonds zone 1.2"), seconds=SECONDS).ok()
    assert "recorded 42 pairs" in run.stdout and "recorded 20 pairs" in run.stdout


def test_an_empty_group_records_nothing(lmp):
    run = lmp(scene(fix="group nobody empty\nfix bonds nobody evp/bonds"), seconds=SECONDS).ok()
    assert "recorded 0 pairs within alpha" in run.stdout


def test_a_box_without_atoms_is_refused_or_runs(lmp):
    """More ranks than atoms, and one atom alone: nothing interacts, nothing stops."""
    run = lmp(scene(then="delete_atoms group all compress no\ncreate_atoms 1 single 0 0 0\nset group all diameter 0.01"),
              ranks=2, seconds=SECONDS).ok()
    assert "recorded 0 pairs" in run.stdout
