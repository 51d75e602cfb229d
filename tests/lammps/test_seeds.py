# SPDX-License-Identifier: GPL-2.0-only
"""Three specimens of our own are one material, the one that the project's notes on the model foresee."""

import numpy as np
import pytest
from lammps_run import line_at, read_csv, run_lammps, slope

SEEDS = (1, 2, 3)


@pytest.fixture(scope="module")
def curves(tmp_path_factory):
    """Per seed: the curve with literal contacts at 10/s to 1.1 %, and the counts with contact none to 0.5 %."""
    known = {}
    for seed in SEEDS:
        folder = tmp_path_factory.mktemp(f"seed{seed}")
        run_lammps("in.specimen", 1, {"n": 500, "seed": seed, "out": "specimen.data"}, folder).ok()
        for contact, strain in (("literal", 0.0112), ("none", 0.005)):
            variables = {"specimen": "specimen.data", "contact": contact, "strain": strain, "rate": 10, "out": contact,
                         "row": 0.0001 if contact == "literal" else 0.00002}
            run_lammps("in.traction", 1, variables, folder).ok()
        known[seed] = read_csv(folder / "literal.csv"), read_csv(folder / "none.csv")
    return known


def stiffness(curve):
    start = curve["strain"] <= 0.003
    return slope(curve["strain"][start], curve["stress_virial"][start])


def test_the_specimens_differ_and_their_stiffness_does_not(curves):
    """E between 19 and 25 GPa, within 3 % of each other. Control: the curves are not one and the same."""
    values = [stiffness(curves[seed][0]) for seed in SEEDS]
    assert all(19e9 < value < 25e9 for value in values)
    assert max(values) < 1.03 * min(values)
    assert len({float(curves[seed][0]["stress_virial"][-1]) for seed in SEEDS}) == len(SEEDS)


@pytest.mark.parametrize("seed", SEEDS)
def test_stress_at_one_percent(curves, seed):
    """0.0072 E +-4 %: the affine curve of both regimes gives 0.00721 (nominal) for any isotropic packing."""
    curve = curves[seed][0]
    stress = line_at(curve["strain"], curve["stress_virial"], 0.01, 0.0006)
    assert stress == pytest.approx(0.0072 * stiffness(curve), rel=0.04)


@pytest.mark.parametrize("seed", SEEDS)
def test_yield(curves, seed):
    """The tangent, by least squares over +-0.0004 of strain, is first below 90 % of E between 0.0040 and 0.0055."""
    curve = curves[seed][0]
    limit = 0.9 * stiffness(curve)
    for at in curve["strain"][curve["strain"] > 0.0005]:
        near = np.abs(curve["strain"] - at) <= 0.0004 * (1 + 1e-9)
        if slope(curve["strain"][near], curve["stress_virial"][near]) < limit:
            break
    assert 0.0040 <= at <= 0.0055


def test_first_bond_in_the_second_regime(curves):
    """With bonds only, no shock of a new contact comes first: strain 0.0040 +-15 % in the median, below xi_s = 0.005 since
    packings strain their bonds unevenly. It is an extreme: eight seeds scatter by 0.0002."""
    first = [counts["strain"][np.flatnonzero(counts["second_regime"] > 0)[0]] for _, counts in curves.values()]
    assert np.median(first) == pytest.approx(0.0040, rel=0.15) and max(first) < 0.005
