# SPDX-License-Identifier: GPL-2.0-only
"""Rows that scale, where a type has no bonds of its own: atoms among those of another type, types that are set later."""

import math

import numpy as np
import pytest
from evp import law
from hostile import refused
from small_bodies import MOVE, STIR, assert_same_curve, dump, head, lattice_body, words, write_body

ROW = law.TABLE1._replace(gamma=50.0)
KEYWORDS = " spacing 0.02 coordination 12 kv 700"
SCALED = f"pair_style evp/lj\npair_coeff * * {words(ROW)}{KEYWORDS}\n"
BONDS, VOLUME = "fix bonds all evp/bonds\n", "fix volume all evp/volume row\n"
LATER = "read_data body.data extra/atom/types 1"


def one_type(folder, marked=()):
    body = lattice_body((5, 4, 4))
    types = np.ones(len(body.x), dtype=int)
    types[list(marked)] = 2
    body = body._replace(types=types)
    write_body(folder / "body.data", body)
    return body


def test_a_type_among_another_has_the_kv_of_its_bonds(lmp_decks, tmp_path):
    """Two atoms of type 2, far from each other: e1 and gamma of all their bonds are those of types 1 2, kv is scaled by all of these."""
    body = one_type(tmp_path, (0, 45))
    between = [deq for (i, j), deq in body.bonds.items() if body.types[i - 1] != body.types[j - 1]]
    spacing = math.fsum(between) / len(between)
    assert not any(body.types[i - 1] == body.types[j - 1] == 2 for i, j in body.bonds)
    like = math.fsum(deq for (i, j), deq in body.bonds.items() if body.types[i - 1] == body.types[j - 1] == 1)
    like /= len(body.bonds) - len(between)
    kv = [700.0 * (s / 0.02) ** 3 for s in (like, spacing)]
    rest = STIR + MOVE.replace("f_bonds[4]", "f_bonds[4] f_volume f_volume[1]") + dump(every=20) + "run 40\n"
    runs = lmp_decks({"row": head() + SCALED + BONDS + VOLUME + rest,
                      "typed": head() + SCALED + BONDS + VOLUME.replace("row", f"{kv[0]:.17g} {kv[1]:.17g}") + rest,
                      "as given": head() + SCALED + BONDS + VOLUME.replace("row", f"{kv[0]:.17g} 700") + rest})
    assert_same_curve(runs["row"].thermo(), runs["typed"].thermo())
    volume = {name: run.thermo()["f_volume"] for name, run in runs.items()}
    assert np.abs(volume["as given"] - volume["typed"]).max() > 1e-3 * volume["typed"].max(), "control"
    line = [line for line in runs["row"].stdout.splitlines() if line.startswith("pair evp/lj: types 2 2")]
    assert f"spacing {spacing:.6g} (row 0.02), bonds per particle {len(between) / 2:.4g} (row 12)" in line[0]


@pytest.mark.parametrize("atoms, kv", [("1:40", 0), ("3", 700)])
def test_a_type_set_after_the_recording_is_refused(lmp, tmp_path, atoms, kv):
    """Nothing measured says by how much its bonds, or the kv of a single atom, are to be scaled."""
    one_type(tmp_path)
    row = SCALED.replace("kv 700", f"kv {kv}")
    text = head(start=LATER) + row + BONDS + VOLUME + MOVE + f"run 0\ngroup marked id {atoms}\nset group marked type 2\nrun 1\n"
    refused(lmp(text, 2), "the row of type 2 cannot be scaled", "set types before the bonds are recorded")


def test_a_type_set_later_that_has_its_measure(lmp_decks, tmp_path):
    """A single atom whose bonds are of types 1 2: the factor of type 1, the bits of before; likewise a row that does not scale. No kv is used."""
    one_type(tmp_path)
    free = SCALED.replace(" kv 700", "")
    later = "group marked id 3\nset group marked type 2\n"
    rest = STIR + MOVE + "run 20\n"
    plain = f"pair_coeff 2 2 {words(ROW)}\n"
    runs = lmp_decks({name: head(start=LATER) + text + BONDS + "fix hold all nve/noforce\nrun 0\nunfix hold\n" + more + rest for name, text, more in
                      (("before", free, ""), ("later", free, later), ("kv without fix evp/volume", SCALED, later), ("plain", free + plain, later))})
    for name in ("later", "kv without fix evp/volume", "plain"):
        assert_same_curve(runs["before"].thermo(), runs[name].thermo(), 0.0)
