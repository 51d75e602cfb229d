# SPDX-License-Identifier: GPL-2.0-only
"""tests/oracle/flow.py: return map, stored and dissipated energy of `plasticity isotropic` against closed forms."""

import numpy as np
import pytest
from oracle import flow, law

DEQ = 0.01
LAWS = {  # row and saturation
    "Table 1": (law.TABLE1, 0.0),
    "Table 1, saturation": (law.TABLE1._replace(e2=9.0), 0.02),
    "other exponents": (law.Row(60.0, 7.5, 3.2, 4.0, 6.0, 3.0, 0.01, 0.0, 1.4), 0.0),
    "no second regime": (law.Row(90.0, 6.0, 3.0, 0.0, 2.0, 1.0, 0.004, 0.0, 1.6), 0.0),
}


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def of_pair(request):
    return request.param


def follow(strains, of_pair):
    """d, q, k, force and dissipation of one pair along a path of strains, one entry per state."""
    row, saturation = of_pair
    q = k = 0.0
    found = []
    for d in (1 + np.asarray(strains)) * DEQ:
        now = flow.step(d, DEQ, row, q, k, saturation)
        q, k = float(now.q), float(now.k)
        found.append((d, q, k, float(now.force), float(now.dissipated)))
    return np.array(found).T


def yield_force(row):
    return float(np.abs(law.potential_force((1 + row.xi_s) * DEQ, DEQ, row.e1, row.m1, row.n1)))


def work_done(d, q, k, of_pair):
    """Work on the pair along its states, by Gauss points on the elastic part and on the flow of each increment."""
    row, saturation = of_pair
    nodes, weights = np.polynomial.legendre.leggauss(24)
    total = 0.0
    for a, b, q0, q1, k0 in zip(d, d[1:], q, q[1:], k):
        begun = b if q1 == q0 else q0 + (1 + np.sign(q1 - q0) * flow.limit(k0, row, saturation)[0]) * DEQ
        for start, end in ((a, begun), (begun, b)):
            at = 0.5 * (start + end) + 0.5 * (end - start) * nodes
            total -= 0.5 * (end - start) * np.sum(weights * flow.step(at, DEQ, row, q0, k0, saturation).force)
    return total


def test_work_is_stored_and_dissipated_through_random_reversals(of_pair):
    strains = np.concatenate([[0.0], np.random.default_rng(5).uniform(-0.03, 0.03, 2000)])
    d, q, k, _, heat = follow(strains, of_pair)
    work = work_done(d, q, k, of_pair)
    assert work == pytest.approx(flow.stored(d[-1], DEQ, of_pair[0], q[-1]) + heat.sum(), rel=1e-10)
    assert np.all(heat >= 0.0) and np.all(np.diff(k) >= 0.0)
    assert k[1:] == pytest.approx(np.cumsum(np.abs(np.diff(q))) / DEQ, rel=1e-12)
    assert np.ptp(q) > 0.002 * DEQ, "control: it flows both ways"


def test_force_is_the_slope_of_the_incremental_energy(of_pair):
    """-dE/dd = F with q and k of the last state of rest held, inside and beyond the limit; by a difference of sixth order."""
    row, saturation = of_pair
    random = np.random.default_rng(3)
    q, k = random.uniform(-0.05, 0.05, 400) * DEQ, random.uniform(0.0, 0.1, 400)
    strain, y = random.uniform(-0.1, 0.1, 400), flow.limit(k, row, saturation)[0]
    d, step = DEQ + q + strain * DEQ, 1e-3 * row.xi_s * DEQ
    d, q, k = (value[np.abs(np.abs(strain) - y) > 4 * step / DEQ] for value in (d, q, k))

    def energy(n):
        return flow.work_since(d + n * step, DEQ, row, q, k, saturation)

    slope = (45 * (energy(1) - energy(-1)) - 9 * (energy(2) - energy(-2)) + energy(3) - energy(-3)) / (60 * step)
    force = flow.step(d, DEQ, row, q, k, saturation).force
    assert np.abs(slope + force).max() < 1e-9 * np.abs(force).max()
    assert np.mean(flow.return_map(d, DEQ, row, q, k, saturation)[1] > k) > 0.3, "control: they flow"


@pytest.mark.parametrize("turn", (0.3, -0.2))
def test_the_increment_makes_no_difference(of_pair, turn):
    once, often = follow([turn], of_pair), follow(np.linspace(0.0, turn, 1000), of_pair)
    for value in (1, 2, 3):
        assert once[value][-1] == pytest.approx(often[value][-1], rel=1e-12), value
    assert once[4].sum() == pytest.approx(often[4].sum(), rel=1e-10)


def test_dissipation_in_closed_form():
    """Linear hardening: the difference of Phi_I at the limit over h. None: the force at the limit, as it is."""
    row, k, grown = law.TABLE1, 0.01, 0.3
    for side in (1, -1):
        def at_limit(k):
            return law.potential((1 + side * flow.limit(k, row)[0]) * DEQ, DEQ, row.e1, row.m1, row.n1)

        closed = (at_limit(k + grown) - at_limit(k)) / flow.hardening(row)
        assert flow.dissipated(0.0, side * grown * DEQ, DEQ, row, k) == pytest.approx(closed, rel=1e-12)
    ideal = row._replace(e2=0.0)
    assert flow.dissipated(0.0, grown * DEQ, DEQ, ideal, k) == pytest.approx(yield_force(row) * grown * DEQ, rel=1e-13)


def test_elastic_cycles_leave_nothing(of_pair):
    """Before any flow, and after one: no q, no k, no work, and the force of the first regime."""
    row = of_pair[0]
    for mean in (0.0, 0.05, -0.05):
        d, q, k, _, _ = follow([mean], of_pair)
        y = flow.limit(k[-1], *of_pair)[0]
        around = np.tile([0.999, -0.999], 50) * y + q[-1] / DEQ
        again = follow([mean, *around], of_pair)
        assert np.all(again[1] == q[-1]) and np.all(again[2] == k[-1]) and again[4][1:].sum() == 0.0
        assert again[3][1:] == pytest.approx(law.potential_force(again[0][1:] - q[-1], DEQ, row.e1, row.m1, row.n1), rel=1e-13)


@pytest.mark.parametrize("side", (1, -1))
def test_the_second_regime_begins_with_the_slope_of_eq_8(side):
    """m2 n2 e2/deq^2, as a share of the first stiffness there."""
    row = law.TABLE1
    step = 1e-6 * DEQ
    start = (1 + side * row.xi_s) * DEQ
    slope = -side * (flow.step(start + side * step, DEQ, row, 0.0, 0.0).force - flow.elastic_force(start, DEQ, row, 0.0)) / step
    assert slope / law.potential_stiffness(start, DEQ, row.e1, row.m1, row.n1) == pytest.approx(3.0 / 80.0, rel=1e-4)


def test_saturation_ends_the_hardening():
    y, slope = flow.limit(np.array([0.0, 1e-9, 1.0]), law.TABLE1, 0.02)
    h = flow.hardening(law.TABLE1)
    assert h == pytest.approx(3.0 / 77.0, rel=1e-14)
    assert y == pytest.approx([0.005, 0.005 + 1e-9 * h, 0.005 + 0.02 * h], rel=1e-9)
    assert slope == pytest.approx([h, h, 0.0], rel=1e-6, abs=1e-15)


def test_a_stiffer_second_regime_is_refused():
    with pytest.raises(ValueError, match="softer"):
        flow.hardening(law.TABLE1._replace(e2=80.0))


def test_new_contacts_flow_in_compression_only():
    row = law.TABLE1
    pushed = flow.contact_step(0.96 * DEQ, DEQ, row, 0.0, 0.0)
    bond = flow.step(0.96 * DEQ, DEQ, row, 0.0, 0.0)
    assert pushed == bond and pushed.q < 0.0 < pushed.dissipated
    opened = flow.contact_step(0.999 * DEQ, DEQ, row, pushed.q, pushed.k)
    assert opened == (pushed.q, pushed.k, 0.0, 0.0) and flow.contact_stored(0.999 * DEQ, DEQ, row, pushed.q) == 0.0
    assert flow.step(0.999 * DEQ, DEQ, row, pushed.q, pushed.k).force < 0.0, "control: a bond pulls"
    assert flow.contact_step(1.001 * DEQ, DEQ, row, pushed.q, pushed.k) == (0.0, 0.0, 0.0, 0.0)
    assert flow.contact_stored(0.96 * DEQ, DEQ, row, pushed.q) == flow.stored(0.96 * DEQ, DEQ, row, pushed.q) > 0.0
