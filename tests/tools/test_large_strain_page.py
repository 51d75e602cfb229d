# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/large_strain.py: numbers of known runs."""

import large_strain
import numpy as np
import pytest

MPA = large_strain.MPA


def columns(stress, plastic):
    """A run to a strain of 3 of constant stress [MPa], and dissipation per volume and strain [MPa]."""
    strain = np.linspace(0.0, 3.0, 301)
    found = {name: np.zeros(301) for name in large_strain.COLUMNS}
    found.update(strain=strain, shear_stress=stress * MPA * (strain > 0.0), plastic=plastic * MPA * large_strain.VOLUME * strain)
    found.update(spent=found["plastic"].copy(), lowest_ratio=np.full(301, 0.8))
    return found


def test_rates_and_balance():
    found = columns(50.0, 60.0)
    assert large_strain.mean(found, 1.0, 2.0) == pytest.approx(50.0)
    assert large_strain.rates(found, 2.0, 3.0, "plastic") == pytest.approx(60.0)
    assert large_strain.work_misfit(found) == pytest.approx(0.2)
    found["shear_stress"][250:261] = 0.0
    assert large_strain.lowest(found, 2.0, 3.0) == pytest.approx(0.0, abs=1e-9)


def test_first_lines_and_rows_of_known_runs():
    results = {case: columns(40.0 + case.spheres / 100, 60.0) for case in large_strain.PLAN}
    values = large_strain.answer(results)
    assert (values["stress"], values["plastic"], values["literal"], values["spheres"], values["end"]) == ("50 and 60", "60 and 60", "50", "1000 and 2000", "3")
    row = large_strain.row(large_strain.PLAN[0], results[large_strain.PLAN[0]], 6000)
    assert len(row) == len(large_strain.HEADER) and row[:4] == ["repulsive", 1000, "isotropic", "50"] and row[-2:] == ["0.80", "+20.0"]


def test_bonds_across_the_boundary_count(tmp_path):
    """Three spheres of radius 1 in a box of 10: two meet through the boundary, within 1.5 (R_i + R_j)."""
    (tmp_path / "body.data").write_text(
        "x\n\n3 atoms\n1 atom types\n\n0 10 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n\nAtoms # sphere\n\n"
        "1 1 2 1 0.5 5 5\n2 1 2 1 9.0 5 5\n3 1 2 1 5.0 5 5\n", encoding="utf-8")
    assert large_strain.bonds_at_start(tmp_path / "body.data") == 1
