# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/flow.py: return map, stored energy and dissipation of `unload elastic` against closed forms."""

import numpy as np
import pytest
from evp import flow, law

DEQ = 0.01
ROWS = {
    "Table 1": law.TABLE1,
    "other exponents": law.Row(60.0, 7.5, 3.2, 4.0, 6.0, 3.0, 0.01, 0.0, 1.4),
    "no second regime": law.Row(90.0, 6.0, 3.0, 0.0, 2.0, 1.0, 0.004, 0.0, 1.6),
}
REVERSALS = (0.06, -0.04, 0.06, -0.03, 0.02, -0.04, 0.01, 0.055, -0.02)  # eight turns between -4 and 6 %


@pytest.fixture(params=ROWS.values(), ids=ROWS.keys())
def row(request):
    return request.param


def scale(row):
    """Force at the threshold."""
    return float(np.abs(law.potential_force((1 + row.xi_s) * DEQ, DEQ, row.e1, row.m1, row.n1)))


def path(turns, steps):
    """Strains from 0 over all turns, `steps` increments each."""
    ends = (0.0, *turns)
    return np.concatenate([[0.0], *(np.linspace(a, b, steps + 1)[1:] for a, b in zip(ends, ends[1:]))])


def run(strains, row):
    """d, q, force and dissipation of one pair along a path, one entry per state."""
    q, found = 0.0, []
    for d in (1 + strains) * DEQ:
        now = flow.step(d, DEQ, row, q)
        found.append((d, float(now.q), float(now.force), float(now.dissipated)))
        q = float(now.q)
    return np.array(found).T


def work_done(d, q, row):
    """Work on the pair, by Gauss points of the force on each increment's elastic part and flow; exact to round-off."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    total, before = 0.0, q[0]
    for a, b, after in zip(d, d[1:], q[1:]):
        begun = b if after == before else np.clip(before + (1 + np.sign(after - before) * row.xi_s) * DEQ, min(a, b), max(a, b))
        for start, end in ((a, begun), (begun, b)):
            at = 0.5 * (start + end) + 0.5 * (end - start) * nodes
            total -= 0.5 * (end - start) * np.sum(weights * flow.step(at, DEQ, row, before).force)
        before = after
    return total


def test_one_pair_through_eight_reversals(row):
    """Work = change of Psi + D, in steps of any size; no term may be left out."""
    for steps in (7, 400):
        d, q, _, heat = run(path(REVERSALS, steps), row)
        stored = flow.stored(d[-1], DEQ, row, q[-1])
        work = work_done(d, q, row)
        assert np.ptp(q) > 0.08 * DEQ, "control: it flows both ways"
        assert stored + heat.sum() == pytest.approx(work, rel=1e-8)
        assert np.all(heat >= -1e-15 * work)
        if row.e2 > 0:
            d, q = d[-5], q[-5]
            coupling = flow.elastic_force(d, DEQ, row, q) - law.potential_force(d - q, DEQ, row.e1, row.m1, row.n1)
            assert abs(coupling * (d - q - DEQ)) > 1e-6 * work, "control: the coupling term is seen"


def test_the_increment_makes_no_difference(row):
    coarse, fine = run(path(REVERSALS, 1), row), run(path(REVERSALS, 1000), row)
    assert coarse[1][-1] == pytest.approx(fine[1][-1], abs=1e-13 * DEQ)
    assert coarse[3].sum() == pytest.approx(fine[3].sum(), rel=1e-10)


def test_force_is_the_slope_of_the_stored_energy(row):
    random = np.random.default_rng(3)
    q = random.uniform(-0.05, 0.3, 400) * DEQ
    d = DEQ + q + random.uniform(-0.999, 0.999, 400) * row.xi_s * DEQ
    step = 1e-4 * row.xi_s * DEQ
    ends = np.abs(d - q - DEQ) < (row.xi_s * DEQ - 2 * step)
    d, q = d[ends], q[ends]
    slope = (flow.stored(d + step, DEQ, row, q) - flow.stored(d - step, DEQ, row, q)) / (2 * step)
    assert np.abs(slope + flow.elastic_force(d, DEQ, row, q)).max() < 2e-7 * scale(row)


def test_force_is_the_slope_of_the_work_since_rest(row):
    """What a line search needs: through the threshold too, with the offset of the last state of rest held."""
    step = 1e-6 * DEQ
    for q in (0.0, 0.02 * DEQ, -0.02 * DEQ):
        d = np.linspace(0.93, 1.09, 333) * DEQ
        edge = np.abs(np.abs(d - q - DEQ) - row.xi_s * DEQ) < 2 * step
        d = d[~edge]
        slope = (flow.work_since(d + step, DEQ, row, q) - flow.work_since(d - step, DEQ, row, q)) / (2 * step)
        assert np.abs(slope + flow.step(d, DEQ, row, q).force).max() < 1e-6 * scale(row)


def test_monotonic_loading_is_eq_8(row):
    for turn in (0.3, -0.2):
        d, q, force, heat = run(path((turn,), 500), row)
        assert np.abs(force - law.force(d, DEQ, row)).max() < 1e-12 * scale(row)
        first, second = law.stored(d[-1], DEQ, row)
        assert flow.stored(d[-1], DEQ, row, q[-1]) + heat.sum() == pytest.approx(first + second, rel=1e-11)


def test_it_unloads_with_the_first_stiffness(row):
    """From 3 % back by the width of the elastic range; Prager: reverse flow begins there, twice the threshold away."""
    d, q, force, _ = run(path((0.03,), 30), row)
    back = d[-1] - 2 * row.xi_s * DEQ
    slope = -(flow.step(d[-1] - 1e-7 * DEQ, DEQ, row, q[-1]).force - force[-1]) / (-1e-7 * DEQ)
    assert slope == pytest.approx(law.potential_stiffness((1 + row.xi_s) * DEQ, DEQ, row.e1, row.m1, row.n1), rel=1e-4)
    assert flow.return_map(back + 1e-9 * DEQ, DEQ, row, q[-1]) == q[-1]
    assert flow.return_map(back - 1e-6 * DEQ, DEQ, row, q[-1]) < q[-1]


def test_force_is_continuous_over_random_histories(row):
    """2000 histories that pass through compression, all at once; no jump above stiffness times increment."""
    random = np.random.default_rng(11)
    d, q = np.full(2000, DEQ), np.zeros(2000)
    force, stiffest = np.zeros(2000), row.m1 * row.n1 * row.e1 / DEQ**2 * 1.3
    lowest = np.full(2000, np.inf)
    for _ in range(60):
        goal = random.uniform(0.9, 1.1, 2000) * DEQ
        for share in np.linspace(0.0, 1.0, 41)[1:]:
            there = d + share * (goal - d)
            now = flow.step(there, DEQ, row, q)
            if share > 0.026:
                assert np.all(np.abs(now.force - force) <= stiffest * np.abs(goal - d) / 40 * (1 + 1e-9))
            assert np.all(now.dissipated >= 0.0)
            q, force = now.q, now.force
        lowest = np.minimum(lowest, goal)
        d = goal
    assert np.all(lowest < (1 - 2 * row.xi_s) * DEQ), "control"


def test_dissipation_ends_deep_in_compression():
    """Table 1: below q = -0.238 deq flow would give energy back; a stiffer second regime does at once."""
    limit = flow.dissipation_limit(law.TABLE1)
    assert limit == pytest.approx(-0.238, abs=5e-4)
    above, below = (flow.dissipated((limit + a) * DEQ, (limit + a - 1e-4) * DEQ, DEQ, law.TABLE1) for a in (0.01, -0.01))
    assert above > 0.0 > below
    assert flow.dissipation_limit(law.TABLE1._replace(e2=90.0)) == 0.0
    assert flow.dissipation_limit(law.TABLE1._replace(e2=0.0)) == -np.inf


def test_new_contacts_keep_compression_only(row):
    """First met at dlim they follow eq. 8 both ways; pushed in they keep that, and beyond the cut nothing."""
    cut = row.alpha * DEQ
    far, q = np.linspace(cut, 1.02 * DEQ, 50), 0.0
    for d in (*far, *far[::-1]):
        now = flow.contact_step(d, DEQ, row, q, cut)
        assert now.q == 0.0 and now.dissipated == 0.0
        assert now.force == pytest.approx(law.force(d, DEQ, row), rel=1e-12)
    pushed = flow.contact_step(0.96 * DEQ, DEQ, row, 0.0, cut)
    assert pushed.q == pytest.approx((-0.04 + row.xi_s) * DEQ, rel=1e-12) and pushed.dissipated > 0.0
    assert flow.contact_step(0.965 * DEQ, DEQ, row, pushed.q, cut).force < pushed.force
    assert flow.contact_step(cut * (1 + 1e-9), DEQ, row, pushed.q, cut) == (0.0, 0.0, 0.0)
    assert flow.contact_step(0.999 * DEQ, DEQ, row, pushed.q, cut).force < 0.0, "control: it would pull"
    assert flow.contact_step(0.999 * DEQ, DEQ, row, pushed.q, DEQ, repulsive=True).force == 0.0


def test_break_rule():
    d, deq, dlim = np.array([1.04, 1.06, 1.2, 0.5]) * DEQ, DEQ, np.array([1.5, 1.5, 1.1, 1.5]) * DEQ
    assert flow.breaks(d, deq, dlim, 0.05).tolist() == [False, True, True, False]
    assert flow.breaks(d, deq, dlim, 10.0).tolist() == [False, False, True, False]
    assert not flow.breaks(d, deq, dlim).any()
    left = {mode: flow.broken_force(np.array([0.98, 1.02]) * DEQ, DEQ, law.TABLE1, mode) for mode in law.CONTACT_MODES}
    assert left["literal"][0] == left["repulsive"][0] == law.force(0.98 * DEQ, DEQ, law.TABLE1)
    assert left["literal"][1] == 0.0 and not left["none"].any()
