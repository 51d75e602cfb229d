# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/accuracy_unloading.py: its plan, and the page from known rows."""

import numpy as np
import pytest
import accuracy_unloading as unloading
from evp import dump, specimen


def row(knob, choice, seed, residual):
    values = {"residual_strain": residual, "unloading_GPa": 20.0, "area_MJ_per_m3": 2.8, "volume_strain": 0.0072}
    return {"knob": knob, "choice": choice, "spheres": 500, "seed": seed, "seconds": "1", **{name: str(value) for name, value in values.items()}}


@pytest.mark.parametrize("quick", [True, False])
def test_each_reference_is_in_the_plan_once_per_body(quick):
    plan = unloading.all_cases(quick)
    assert len({(case.knob, case.choice, case.seed) for case in plan}) == len(plan)
    for name, knob in unloading.KNOBS.items():
        own = [case for case in plan if case.knob == name]
        seeds = [{case.seed for case in own if case.choice == choice} for choice in {case.choice for case in own}]
        if knob.reference:
            assert all(found == {case.seed for case in own if case.choice == knob.reference} for found in seeds), name


def test_page_compares_with_the_reference_on_the_same_body():
    rows = [row("increment", "0.001", 1, 0.0102), row("increment", "0.001", 2, 0.0198),
            row("increment", "0.0001", 1, 0.01), row("increment", "0.0001", 2, 0.02), row("particles", "500", 1, 0.01)]
    text = unloading.page(rows, "a.csv")
    line = next(line for line in text.splitlines() if line.startswith("| 0.001 |"))
    assert "+0.50 (-1.00 to +2.00)" in line and "+0.00 (+0.00 to +0.00)" in line
    reference = next(line for line in text.splitlines() if line.startswith("| 0.0001 |"))
    assert "0.015 +- 47.1 %" in reference and "| 20 +- 0.0 % |" in reference


def test_positions_are_sorted_by_id(tmp_path):
    head = "ITEM: TIMESTEP\n9\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ss ss ss\n0 9\n0 9\n0 9\n"
    (tmp_path / "state.dump").write_text(head + "ITEM: ATOMS id x y z radius\n2 4 5 6 1\n1 1 2 3 1\n", encoding="utf-8")
    assert dump.last_positions(tmp_path / "state.dump").tolist() == [[1, 2, 3], [4, 5, 6]]


def test_middle_strains_of_an_affine_body():
    """Those of the displacement's slopes, whatever happens beyond 0.3 and 0.7 of the length."""
    x = np.random.default_rng(1).uniform(-0.02, 0.02, (400, 3)) + [0.025, 0.0, 0.0]
    body = specimen.Specimen(np.arange(1, 401), np.ones(400), np.ones(400), np.ones(400), x, np.zeros((3, 2)))
    moved = x * [1.01, 0.997, 0.999]
    moved[x[:, 0] > 0.036] += 0.01
    assert specimen.middle_strains(body, moved) == pytest.approx((0.01, -0.002), rel=1e-10)
