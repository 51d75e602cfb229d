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
    found.update(spent=found["plastic"].copy())
    return found


def test_numbers_of_a_known_run():
    """A tenth of strain without stress in the last unit; the energies are a fifth more than the work."""
    found = columns(50.0, 60.0)
    top, early, late, lowest, _, plastic, *others, misfit = large_strain.numbers(found)
    assert (top, early, late, lowest, plastic, misfit) == pytest.approx((50.0, 50.0, 50.0, 50.0, 60.0, 20.0)) and not any(others)
    found["shear_stress"][251:261] = 0.0
    assert large_strain.numbers(found)[2:4] == pytest.approx([45.0, 0.0], abs=1e-9)


def test_first_lines_and_rows_of_known_runs():
    values = large_strain.page({case: columns(40.0 + case.spheres / 100, 60.0) for case in large_strain.PLAN})
    assert (values["stress"], values["plastic"], values["literal"], values["spheres"]) == ("50 and 60", "60 and 60", "50", "1000 and 2000")
    header, rows = values["table"]
    assert all(len(row) == len(header) for row in rows) and rows[0][:4] == ("repulsive", 1000, "isotropic", "50") and rows[0][-1] == "+20.0"
