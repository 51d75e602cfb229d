# SPDX-License-Identifier: GPL-2.0-only
"""The warning at set-up of atoms whose density does not go with that of the solid in their row."""

import re

import pytest
from evp import law
from small_bodies import head, words, write_two

SOLID = 7830.0
ROW = f"{words(law.TABLE1)} density {SOLID}"
FOUND = re.compile(r"atoms of type (\d) have a mean density of ([0-9.e+-]+), but the density in their row is ([0-9.e+-]+)")


def found(run):
    return [(int(m[1]), float(m[2]), float(m[3])) for m in map(FOUND.search, run.warnings()) if m]


@pytest.fixture
def start(tmp_path):
    """Two spheres of a type each, up to their densities; the rows of type 1 and of the pair of types name a solid."""
    write_two(tmp_path / "body.data")
    path = tmp_path / "body.data"
    path.write_text(path.read_text().replace("1 atom types", "2 atom types"), encoding="utf-8")
    rows = f"pair_style evp/lj contact none\npair_coeff * * {words(law.TABLE1)}\npair_coeff 1 * {ROW}\n"
    return head(skin=0.002) + "set atom 2 type 2\nset atom 2 diameter 0.008\n" + rows + "fix bonds all evp/bonds\nfix move all nve\ntimestep 1e-8\n"


def test_what_goes_with_the_row_and_what_does_not(lmp_decks, start):
    """1.0 and 1/0.58 of the solid are the two ways that input scripts use; the row without a density counts for nothing."""
    ratios = {0.345: 1, 0.985: 1, 0.995: 0, 1.0: 0, 1 / 0.58: 0, 1 / 0.19: 0, 11.0: 1, 100.0: 1}
    decks = {ratio: start + f"set type 1 density {ratio * SOLID:.17g}\nset type 2 density 1\nrun 1\n" for ratio in ratios}
    for ratio, run in lmp_decks(decks).items():
        assert found(run) == [(1, pytest.approx(ratio * SOLID, rel=1e-5), SOLID)] * ratios[ratio]


def test_it_is_a_matter_of_runs_and_said_once(lmp, start):
    """With two ranks, one sphere each; again only where it is another density."""
    text = start + "run 0\nminimize 0 1e-9 2 5\nset type 1 density 2700\nrun 0\n" + "run 1\n" * 3 + "set type 1 density 2800\nrun 1\n"
    text += f"set type 1 density {SOLID}\nrun 1\nset type 1 density 2800\nrun 1\n"
    assert [density for _, density, _ in found(lmp(text, 2).ok())] == [2700.0, 2800.0, 2800.0]


def test_a_rerun_is_no_run(lmp, start):
    text = start + f"set type 1 density {SOLID}\ndump all all custom 1 all.dump id type x y z\nrun 2\nset type 1 density 2700\n"
    assert found(lmp(text + "rerun all.dump first 0 last 2 dump x y z\n").ok()) == []
