# SPDX-License-Identifier: GPL-2.0-only
"""compute evp/dt: the step limits of the network, against matrices assembled by tools/evp, and by running across them."""

import itertools

import numpy as np
import pytest
from lammps_run import REFERENCE
from oracle import brute, law, network
from small_bodies import grips, head, mass_of, pair, thermo, write_two

# Lanczos stops at 1e-4 of an eigenvalue, which is 0.5e-4 of an elastic step and 1e-4 of a viscous one; the explicit
# step iterates to 1e-3 of its eigenvalue, hence to at most 1e-3 of itself.
SETTLED = 2e-4
ITERATED = 1e-3
SUMMED = 1e-10  # row sums and pair minima are no iterations
PUBLISHED = 5e-4  # four digits of the prototype's numbers


def deck(gamma, contact="none", newton="on", group="free"):
    return (head(newton, start=f"read_data {REFERENCE}") + pair(law.TABLE1._replace(gamma=gamma), contact) + grips(0.005, 0.045)
            + f"fix hold grips nve/noforce\nfix move free nve\ncompute dt {group} evp/dt\n" + thermo("ke pe c_dt c_dt[*]"))


def limits(body, x, gamma, contact, free):
    mass = mass_of(body.radius)
    bonds = brute.record_bonds(body.x, body.radius, 1.5)
    return network.step_limits(x, body.radius, mass, law.TABLE1._replace(gamma=gamma), bonds, contact, free)


def agree(table, expected):
    assert table["c_dt"][0] == table["c_dt[2]"][0], "the scalar is the explicit step, gamma included"
    for column, key, tolerance in (("c_dt[1]", "dt_elastic", SETTLED), ("c_dt[2]", "dt_explicit", ITERATED),
                                   ("c_dt[4]", "dt_eq7", SUMMED), ("c_dt[5]", "dt_rows", SUMMED)):
        assert table[column][0] == pytest.approx(expected[key], rel=tolerance), column


@pytest.mark.parametrize("gamma, published", [(0, {"dt_explicit": 9.025e-7, "dt_eq7": 1.321e-7, "dt_rows": 6.26e-7}),
                                              (1000, {"dt_explicit": 3.510e-8, "dt_eq7": 1.321e-7, "dt_rows": 1.62e-8})])
def test_reference_specimen(lmp, reference, gamma, published):
    free = (reference.x[:, 0] >= 0.005) & (reference.x[:, 0] <= 0.045)
    expected = limits(reference, reference.x, gamma, "none", free)
    for key, value in published.items():
        digits = PUBLISHED if key != "dt_rows" else 5e-3  # three digits
        assert expected[key] == pytest.approx(value, rel=digits), "control: the assembled matrices"
    for ranks, newton in ((1, "on"), (4, "off")):
        run = lmp(deck(gamma, newton=newton) + "run 0\n", ranks)
        agree(run.ok().thermo(), expected)


def test_atoms_outside_the_group_are_held(lmp_decks, reference):
    """Pairs between held atoms leave all limits. Control: the three groups have different limits."""
    sides = {"free": (reference.x[:, 0] >= 0.005) & (reference.x[:, 0] <= 0.045), "all": np.ones(500, dtype=bool), "left": reference.x[:, 0] <= 0.005}
    expected = {name: limits(reference, reference.x, 300.0, "literal", mask) for name, mask in sides.items()}
    assert len({round(1e12 * each["dt_elastic"]) for each in expected.values()}) == 3
    runs = lmp_decks({group: deck(300, "literal", group=group) + "run 0\n" for group in expected}, 2)
    for group, run in runs.items():
        agree(run.thermo(), expected[group])


STIFFENING = law.Row(12.0, 6.0, 3.0, 70.0, 8.0, 4.0, 0.003, 0.0, 1.5)  # m2 n2 e2 = 10.4 m1 n1 e1


def test_a_stiffer_second_regime_limits_the_step_before_it_is_reached(lmp_decks, tmp_path):
    """Two bodies in closed form, k = max(m2 n2 e2/deq^2, -dF/dd); eq. 7 knows the first regime only."""
    deq, decks = 0.011, {}
    write_two(tmp_path / "body.data", deq)
    for strain, gamma in itertools.product((0.0, -0.002, 0.002, 0.02, -0.02), (0.0, 300.0)):
        text = head(skin=0.002) + pair(STIFFENING._replace(gamma=gamma), "none") + "fix move all nve\ncompute dt all evp/dt\n"
        shift = 0.5 * strain * deq
        decks[strain, gamma] = (text + thermo("c_dt c_dt[*]") + f"run 0\ndisplace_atoms all ramp x {-shift:.17g} {shift:.17g} "
                                f"x {-0.5 * deq} {0.5 * deq} units box\nrun 0\n")
    for (strain, gamma), run in lmp_decks(decks).items():
        table, mass, row, d = run.thermo(), mass_of(0.005), STIFFENING._replace(gamma=gamma), deq * (1.0 + strain)
        k = max(row.m2 * row.n2 * row.e2 / deq**2, float(law.stiffness(d, deq, row)))
        tension = max(0.0, -float(law.force(d, deq, row)) / d)
        assert (k > 1.1 * row.m2 * row.n2 * row.e2 / deq**2) == (strain == -0.02), "control: it stiffens under compression"
        stiff, viscous, a = 2.0 * k / mass, 2.0 * gamma / mass, gamma / k
        assert table["c_dt[1]"][0] == pytest.approx(2.0 / np.sqrt(stiff), rel=SETTLED)
        assert table["c_dt[2]"][0] == pytest.approx(float(network.stable_step(stiff, viscous)), rel=ITERATED)
        if tension == 0.0:
            assert table["c_dt[3]"][0] == pytest.approx(a + np.sqrt(a * a + 4.0 / stiff), rel=SETTLED)
        assert table["c_dt[4]"][0] == pytest.approx(np.sqrt(mass / law.largest_stiffness(0.01, row)), rel=SUMMED)
        assert table["c_dt[5]"][0] <= table["c_dt[2]"][0] * (1.0 + ITERATED)


@pytest.mark.parametrize("ranks", [1, 2])
def test_nothing_that_interacts_sets_no_limit(lmp, tmp_path, reference, ranks):
    run = lmp(deck(1000).replace("fix bonds all evp/bonds", "") + "run 0\n", ranks=ranks).ok()
    assert all(run.thermo()[f"c_dt{k}"][0] == 1e20 for k in ("", "[1]", "[2]", "[3]", "[4]", "[5]"))
