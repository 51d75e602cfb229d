# SPDX-License-Identifier: GPL-2.0-only
"""Wrong words after `within`, atoms without molecules, bonds between bodies: one clear error each, before the first step."""

import pytest
from hostile import BONDS, SECONDS, refused, scene

FIX = "fix bonds all evp/bonds "
MOL = "fix molecules all property/atom mol ghost {}\n"
KNOWN = MOL.format("yes") + "set group all mol 1\n"

CASES = {
    "no value": (dict(fix=FIX + "zone 1.2 within"), "Fix bonds evp/bonds: keyword within needs a value"),
    "unknown value": (dict(fix=FIX + "within body"), "Fix bonds evp/bonds: within must be type or molecule (which atoms are one body), got 'body'"),
    "all": (dict(fix=FIX + "within all"), "within must be type or molecule (which atoms are one body), got 'all'"),
    "capitals": (dict(fix=FIX + "within TYPE"), "within must be type or molecule (which atoms are one body), got 'TYPE'"),
    "empty": (dict(fix=FIX + 'within ""'), "within must be type or molecule (which atoms are one body), got ''"),
    "plural": (dict(fix=FIX + "within types"), "got 'types'"),
    "capital keyword": (dict(fix=FIX + "WITHIN type"), "unknown keyword 'WITHIN'; it takes zone or file or within"),
    "two things": (dict(fix=FIX + "within type molecule"), "unknown keyword 'molecule'"),
    "no molecules": (dict(fix=FIX + "within molecule"), "Fix bonds evp/bonds: within molecule needs atoms with molecule IDs: define 'fix ID all "
                     "property/atom mol ghost yes' before it, also after read_restart, or use an atom style that has them"),
    "ghosts without": (dict(fix=MOL.format("no") + "set group all mol 1\n" + FIX + "within molecule"),
                       "Fix bonds evp/bonds: within molecule needs ghost atoms that know their molecule IDs: use 'fix ID all property/atom mol ghost yes'"),
    "all of molecule 0": (dict(fix=MOL.format("yes") + FIX + "within molecule"), "Fix bonds evp/bonds: within molecule records pairs of one molecule ID "
                          "above 0, but all atoms of the group have 0: give those of each body one, e.g. 'set group ID mol 1'"),
    "molecules that go": (dict(fix=KNOWN + FIX + "within molecule", run="run 0\nunfix molecules\nrun 1"), "within molecule needs atoms with molecule IDs"),
    "molecules that go, pre no": (dict(fix=KNOWN + FIX + "within molecule", neighbor="neighbor 0.001 bin\nneigh_modify every 1 check no",
                                       run="run 0\nunfix molecules\nrun 1 pre no"), "Pair evp/lj: fix evp/bonds within molecule needs atoms with molecule IDs"),
}


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("name", CASES)
def test_one_clear_error(lmp, name, ranks):
    parts, text = CASES[name]
    refused(lmp(scene(**parts), ranks=ranks, seconds=SECONDS), text)


def test_the_scene_itself_runs(lmp):
    """With the right words: all of one type, all of one molecule. A group may have atoms of no molecule, or be empty."""
    for fix, bonds in ((FIX + "within type", BONDS), (KNOWN + FIX + "within molecule zone 1.5", BONDS),
                       (KNOWN + "group nobody empty\n" + FIX.replace("all", "nobody") + "within molecule", 0)):
        assert f"recorded {bonds} pairs within" in lmp(scene(fix=fix), ranks=2, seconds=SECONDS).ok().stdout


HEADER = "# EVP bonds COUNT: 1{} UNITS: si\n"


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("word, in_header, line", [("within type", "", "1 2 0.0101"), ("", " WITHIN: type", "1 2 0.0101"), ("within molecule", "", "1 2 0.0101"),
                                                   ("within molecule", "", "3 4 0.0101"), ("", " WITHIN: molecule", "1 2 0.0101")])
def test_a_bond_between_two_bodies_is_refused(lmp, tmp_path, ranks, word, in_header, line):
    """Of the file, whether the fix says what is one body or the file; 3 and 4 are of molecule 0."""
    (tmp_path / "b.bonds").write_text(HEADER.format(in_header) + line + "\n", encoding="utf-8")
    box = scene().partition("boundary")[2].partition("neighbor")[0].replace("create_box 1", "create_box 2")
    fix = "set atom 2 type 2\n" + MOL.format("yes") + "set atom 1 mol 7\nset atom 2 mol 12\n" + FIX + f"file b.bonds {word}"
    of = "molecule" if "molecule" in word + in_header else "type"
    deck = scene(box="boundary" + box, fix=fix)
    refused(lmp(deck, ranks=ranks, seconds=SECONDS),
            f"Fix bonds evp/bonds: bond {line[:3]}: its atoms are not of one {of}, but 'within {of}' is in force: give them the {of}s that they had "
            f"when the file was written, or leave 'within' out here and WITHIN: in the header (bond file b.bonds)")
    assert lmp(deck.replace("set atom 2 type 2\n", "").replace("mol 12", "mol 7").replace("set atom 1", "set atom 3*4 mol 9\nset atom 1"),
               ranks=ranks, seconds=SECONDS).ok().stdout.count("recorded 1 pairs from file b.bonds") == 1, "control"


@pytest.mark.parametrize("word", ["body", "all", "types", "UNITS:"])
def test_a_header_with_another_word(lmp, tmp_path, word):
    (tmp_path / "b.bonds").write_text(HEADER.format(" WITHIN: " + word) + "1 2 0.0101\n", encoding="utf-8")
    refused(lmp(scene(fix=FIX + "file b.bonds"), seconds=SECONDS), f"Fix bonds evp/bonds: bond file line 1: within must be type or molecule (which atoms are one body), got '{word}'")


def test_a_broken_bond_between_two_bodies_is_none(lmp, tmp_path):
    """Two bodies that were glued, until the glue broke, may be told apart from then on."""
    (tmp_path / "b.bonds").write_text(HEADER.format("") + "1 2 0.0101 0 0 0 1\n", encoding="utf-8")
    box = scene().partition("boundary")[2].partition("neighbor")[0].replace("create_box 1", "create_box 2")
    run = lmp(scene(box="boundary" + box, style="pair_style evp/lj break 0.1", fix="set atom 2 type 2\n" + FIX + "file b.bonds within type"), seconds=SECONDS).ok()
    assert "recorded 1 pairs from file b.bonds and within type" in run.stdout


def test_a_header_that_needs_molecules(lmp, tmp_path):
    (tmp_path / "b.bonds").write_text(HEADER.format(" WITHIN: molecule") + "1 2 0.0101\n", encoding="utf-8")
    refused(lmp(scene(fix=FIX + "file b.bonds"), ranks=2, seconds=SECONDS), "Fix bonds evp/bonds: within molecule needs atoms with molecule IDs")
