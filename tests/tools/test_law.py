# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/law.py and tests/oracle, with which the LAMMPS tests compare.

Against 60-digit arithmetic, quadrature and energy balances; and which rows and flow tables tools refuse."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from evp import law as flow
from evp.run import CHECKOUT
from oracle import brute, law, metal

DATA = CHECKOUT / "tests" / "data"
REFERENCE = 1e-12  # see tests/unit/test_law.cpp: the same scale, the same reason


def read(name):
    """A 60-digit table as a dict of columns, and the row of each line."""
    columns = np.genfromtxt(DATA / name, delimiter=",", names=True)
    assert len(columns) > 1000
    return columns, law.Row(*(columns[name] for name in law.Row._fields[:7]), np.zeros(len(columns)), np.full(len(columns), 1.5))


def largest_error(found, true, least):
    return np.max(np.abs(found - true) / np.maximum(np.abs(true), least))


def test_force_energy_and_stiffness_hold_to_twelve_digits():
    """scale: the steeper stiffness at rest times deq^2 [energy], what round-off is measured with."""
    ref, row = read("law_reference.csv")
    d, deq, scale = ref["d"], ref["deq"], np.maximum(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2)
    assert largest_error(law.force(d, deq, row), ref["force"], scale * row.xi_s / deq) < REFERENCE
    energy = law.energy(d, deq, row, ref["dcut"])
    assert largest_error(energy, ref["energy"], scale * row.xi_s) < REFERENCE
    decided = ref["regime"] > 0
    assert np.array_equal(law.regime(d, deq, row)[decided], ref["regime"][decided])
    slope, true, least = (values[decided] for values in (law.stiffness(d, deq, row), ref["stiffness"], scale / deq**2))
    assert largest_error(slope, true, least) < REFERENCE


@pytest.mark.parametrize("words, rule", [
    ("80 4 8 3 8 4 0.005 0 1.5", "m > n > 0"), ("80 4.0003 4 3 8 4 0.005 0 1.5", "m must exceed n by at least"),
    ("80 8 4 3 0.0009 0.00085 0.005 0 1.5", "m must exceed n by at least"), ("-80 8 4 3 8 4 0.005 0 1.5", "zero or positive"),
    ("80 8 4 3 8 4 0 0 1.5", "xi_s"), ("80 8 4 3 8 4 0.005 0 1", "alpha"), ("80 8 4 3 8 4 nan 0 1.5", "finite"), ("80 8 4 3 8 4 0.005 0", "got 8")])
def test_bad_rows_are_refused_with_their_rule(words, rule):
    """Exponents may come as close as the rule says."""
    with pytest.raises(ValueError, match=rule):
        law.Row.parse(words)
    assert law.Row.parse("80 4.0005 4 3 0.0011 0.0009 0.005 0 1.5").m1 == 4.0005


def test_stored_energy_holds_at_any_strain():
    """Against 60 digits, down to strains of the last bit of d; the parts are those of src/core/law/law.h too."""
    ref, row = read("stored_reference.csv")
    first, second = law.stored(ref["d"], ref["deq"], row)
    total = ref["first"] + ref["second"]
    assert np.sum((np.abs(ref["d"] / ref["deq"] - 1) < 2e-10) & (total > 0)) > 100
    assert np.all(np.abs(first - ref["first"]) <= REFERENCE * ref["first"])
    # numpy has no fused multiply-add: near the threshold, xi - xi_s is rounded to the last bit of xi_s
    rounded = np.abs(law.force(ref["d"], ref["deq"], row)) * ref["deq"] * 3e-16 * row.xi_s
    assert np.all(np.abs(second - ref["second"]) <= REFERENCE * total + rounded)


# ---- plasticity: flow moves deq

ROWS = [law.TABLE1, law.TABLE1._replace(m1=12.0, n1=6.0, e2=0.0, xi_s=0.002),
        law.TABLE1._replace(m1=4.0005, n1=4.0, e1=1.0, e2=0.2), law.TABLE1._replace(e2=40.0),
        law.TABLE1._replace(m1=2.5, n1=0.7, xi_s=0.03, e2=1e-4)]
TABLES = [None, (0, 1, 0.01, 1.15, 0.05, 1.4, 2, 1.8), (0, 1, 0.2, 1.1, 5, 9), None, (0, 1, 0.02, 0.6, 4, 0.5)]
EACH = law.Row(*np.transpose(ROWS))
SCALE = EACH.m1 * EACH.n1 * EACH.e1 * EACH.xi_s  # |F d| near the first limit [energy]


def exact_limit(p, row, table):
    """y by the words of the law."""
    if table is None:
        ratio = row.m2 * row.n2 * row.e2 / (row.m1 * row.n1 * row.e1)
        return min(row.xi_s + 0.31 * p * ratio / (1 - ratio), (row.m1 / row.n1) ** (1 / (row.m1 - row.n1)) - 1)
    points = list(zip(table[0::2], table[1::2]))
    for (p0, y0), (p1, y1) in zip(points, points[1:]):
        if p < p1:
            return row.xi_s * (y0 + (y1 - y0) * (p - p0) / (p1 - p0))
    return row.xi_s * points[-1][1]


def exact_bond(d, deq, y, row):
    """(deq, F, Psi, D, |ln|) with 34 digits, of numbers."""
    d, deq, y, e, m, n = (Decimal(float(value)) for value in (d, deq, y, row.e1, row.m1, row.n1))
    r = min(max(d / deq, 1 - y), 1 + y)
    s = 1 / r
    moved = deq if r == d / deq else d / r
    force = m * n * e / (m - n) / moved * (s ** (m + 1) - s ** (n + 1))
    slip = abs((moved / deq).ln())
    return moved, force, e * (n * s**m - m * s**n) / (m - n) + e, abs(force) * moved * r * slip, slip


def test_2000_increments_of_any_size_by_a_scalar_map():
    """A bond of each row whose y follows its own |ln|: deq, p, force, Psi and the sum of D to 1e-12."""
    rng = np.random.default_rng(11)
    ways = np.exp(rng.uniform(-1.0, 1.0, (2000, len(ROWS))) * np.geomspace(1e-4, 1.0, 2000)[:, None])
    rng.shuffle(ways)
    deq, p, spent = np.ones(len(ROWS)), np.zeros(len(ROWS)), np.zeros(len(ROWS))
    exact = [[Decimal(1), Decimal(0), Decimal(0)] for _ in ROWS]
    with localcontext() as context:
        context.prec = 34
        for d in ways:
            y = np.array([flow.limit(p[k], row, table) for k, (row, table) in enumerate(zip(ROWS, TABLES))])
            now = flow.flow_bond(d, deq, EACH, y)
            deq, p, spent = now.deq, p + now.slip / 0.31, spent + now.dissipated
            assert np.all(now.dissipated >= 0.0) and np.array_equal(now.dissipated > 0.0, now.slip > 0.0)
            for k, (row, table) in enumerate(zip(ROWS, TABLES)):
                limit = exact_limit(float(exact[k][1]), row, table)
                assert y[k] == pytest.approx(limit, rel=1e-12)
                moved, force, stored, dissipated, slip = exact_bond(d[k], exact[k][0], limit, row)
                exact[k] = [moved, exact[k][1] + slip / Decimal(0.31), exact[k][2] + dissipated]
                assert now.deq[k] == pytest.approx(float(moved), rel=1e-12)
                assert now.force[k] == pytest.approx(float(force), rel=1e-12, abs=1e-12 * SCALE[k])
                assert now.stored[k] == pytest.approx(float(stored), rel=1e-12, abs=1e-12 * SCALE[k] * row.xi_s)
    assert spent == pytest.approx([float(values[2]) for values in exact], rel=1e-12)
    assert p == pytest.approx([float(values[1]) for values in exact], rel=1e-12) and np.all(p > 100.0), "control"


NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


def work_of(law_at, start, end, kinks):
    """Work against a force [energy] from d = start to end, by quadrature between the places where its slope jumps."""
    places = np.sort(np.clip([start, end, *kinks], min(start, end), max(start, end)))
    total = 0.0
    for low, high in zip(places, places[1:]):
        half = 0.5 * (high - low)
        total -= half * np.sum(WEIGHTS * law_at(low + half * (1.0 + NODES)))
    return total if end > start else -total


@pytest.mark.parametrize("row, table", zip(ROWS, TABLES))
def test_work_is_stored_or_dissipated(row, table):
    """A bond and a contact, 300 increments; where y falls Psi before - Psi after is dissipated at fixed d."""
    rng, touching = np.random.default_rng(5), 1.0
    for kind in ("bond", "contact"):
        def go(d, deq, y):
            if kind == "contact":
                return flow.flow_contact(d, deq, touching, row, y)
            return flow.flow_bond(d, deq, row, y)

        d, deq, p, work, spent, resets, total = 1.0, 1.0, 0.0, 0.0, 0.0, 0, 0.0
        y = flow.limit(p, row, table)
        for target in 1.0 + rng.uniform(-0.1, 0.1, 300):
            before, y = go(d, deq, y), flow.limit(p, row, table)
            after = go(d, deq, y)
            spent, deq = spent + before.stored - after.stored, after.deq
            assert before.slip < 1e-13 and after.stored <= before.stored * (1 + 1e-12)
            assert after.slip < 1e-13 or table == TABLES[4], "only a limit that falls moves deq"
            # a contact that parts passes its deq, R_i + R_j, where it forgets, and comes back to R_i + R_j
            done = work_of(lambda x: go(x, deq, y).force, d, target, [deq, (1 - y) * deq, (1 + y) * deq, touching])
            now = go(target, deq, y)
            work, total = work + done, total + abs(done)
            spent, p = spent + now.dissipated, p + now.slip / 0.31
            resets += kind == "contact" and now.deq == touching != deq
            d, deq = target, float(now.deq)
        assert work == pytest.approx(spent + now.stored, abs=1e-10 * total)
        assert spent > 0.005 * total and (resets > 0) == (kind == "contact"), "control"


def test_the_slope_of_the_incremental_potential_is_the_force():
    """Of bonds and contacts at held deq and y, within the limit and far beyond it; by differences of sixth order."""
    rng, far = np.random.default_rng(6), 3e-3
    y = EACH.xi_s * np.exp(rng.uniform(0.0, 1.0, (1000, len(ROWS))))
    r = 1.0 + y * rng.uniform(-8.0, 8.0, y.shape)
    clear = np.all([np.abs(r - kink) > 4.0 * far * y for kink in (1.0, 1.0 - y, 1.0 + y)], axis=0)
    deq = 0.013
    for contact in (False, True):
        slope = 0.0
        for k, weight in ((1, 3 / 4), (2, -3 / 20), (3, 1 / 60)):
            ends = [flow.potential(deq * (r + sign * k * far * y), deq, EACH, y, contact) for sign in (1, -1)]
            slope += weight * (ends[0] - ends[1]) / (far * y * deq)
        bond, pressed = flow.flow_bond(deq * r, deq, EACH, y), flow.flow_contact(deq * r, deq, 2.0 * deq, EACH, y)
        now = pressed if contact else bond
        off = np.abs(slope + now.force) * deq / (EACH.m1 * EACH.n1 * EACH.e1 * y)
        assert np.max(off[clear]) < 1e-9
        assert np.sum(clear) > 4000 and np.any(now.slip > 0.1), "control"


def test_within_the_limit_nothing_moves_and_a_flowed_pair_rests():
    """Cycles up to the limit leave deq to the last bit; a pair that is held where it flowed does not flow on."""
    y = EACH.xi_s[:, None]
    row = law.Row(*(values[:, None] for values in EACH))
    d = 0.011 * (1.0 + y * np.sin(np.linspace(0.0, 50.0, 2000)) * (1.0 - 1e-12))
    for now in (flow.flow_bond(d, 0.011, row, y), flow.flow_contact(d, 0.011, 0.011, row, y)):
        assert np.all(now.deq == 0.011) and not np.any(now.dissipated) and not np.any(now.slip)
    d = 0.011 * (1.0 + y * np.linspace(-9.0, 9.0, 99))
    for go in (flow.flow_bond, lambda d, deq, row, y: flow.flow_contact(d, deq, 0.03, row, y)):
        first = go(d, 0.011, row, y)
        held = first
        for _ in range(100):
            held = go(d, held.deq, row, y)
        assert np.allclose(held.deq, first.deq, rtol=1e-14, atol=0.0) and np.all(held.slip < 1e-14)
        assert np.any(first.slip > 0.1), "control"


def test_contacts_only_repel_and_forget_beyond_their_radii():
    """Nothing between deq and R_i + R_j, where deq stays; R_i + R_j again once d was beyond."""
    pressed = flow.flow_contact(0.9, 1.0, 1.0, law.TABLE1, 0.005)
    assert float(pressed.deq) == pytest.approx(0.9 / 0.995, rel=1e-15) and pressed.force > 0.0 and pressed.stored > 0.0
    between = flow.flow_contact(np.array([0.91, 1.0]), pressed.deq, 1.0, law.TABLE1, 0.005)
    assert np.all(between.deq == pressed.deq) and not np.any(between[1:])
    parted = flow.flow_contact(1.0 + 1e-15, pressed.deq, 1.0, law.TABLE1, 0.005)
    assert parted.deq == 1.0 and not np.any(parted[1:])
    energies = [flow.potential(0.95, pressed.deq, law.TABLE1, 0.005, contact) for contact in (True, False)]
    assert energies[0] == 0.0 < energies[1]


def test_the_limit_follows_its_table_or_the_linear_rule():
    row = law.TABLE1
    table = [0, 1, 0.01, 1.2, 0.03, 0.8]
    found = flow.limit([0.0, 0.005, 0.01, 0.02, 0.03, 7.0], row, table)
    assert found == pytest.approx(0.005 * np.array([1.0, 1.1, 1.2, 1.0, 0.8, 0.8]), rel=1e-15)
    ratio = 3.0 / 80.0
    top = 2.0**0.25 - 1.0  # the strain of the largest -F d
    linear = 0.005 + 0.031 * ratio / (1 - ratio)
    assert flow.limit([0.0, 0.1, 1e3], row) == pytest.approx([0.005, linear, top], rel=1e-14)
    d = 1.0 + top * np.array([0.999, 1.0, 1.001])
    below, most, above = -flow.flow_bond(d, 1.0, row, 0.9).force * d
    assert most > max(below, above)


def test_a_second_regime_that_is_not_softer_does_not_flow():
    """Without a table, which does not need it."""
    stiff = law.TABLE1._replace(e2=80.0)
    with pytest.raises(ValueError, match="softer"):
        flow.limit(0.1, stiff)
    assert flow.limit(0.1, stiff, [0, 1]) == 0.005
    assert law.force(1.5, 1.0, law.TABLE1) / law.force(1.005, 1.0, law.TABLE1) == pytest.approx(1.21, abs=0.01), "of the yield force: the pull of a new pair"


@pytest.mark.parametrize("table, rule", [
    ([0.01, 1], "begin with 0 1"), ([0, 1.1], "begin with 0 1"), ([0, 1, 0.1], "pairs"), ([], "pairs"),
    ([0, 1] * 33, "32 at most"), ([0, 1, 0.1, 2, 0.1, 3], "ascend"), ([0, 1, 0.1, 0], "positive"),
    ([0, 1, np.nan, 2], "finite"), ([0, 1, 0.1, 38], "must stay below")])
def test_bad_tables_are_refused_with_their_rule(table, rule):
    with pytest.raises(ValueError, match=rule):
        flow.limit(0.0, law.TABLE1, table)


# ---- tests/oracle/metal.py

CUBE = np.array(np.meshgrid(*[range(3)] * 3)).reshape(3, -1).T.astype(float)
PLACES = CUBE + np.random.default_rng(3).uniform(-0.05, 0.05, CUBE.shape)
RADII = 0.5 * (1.0 + np.random.default_rng(4).uniform(-0.1, 0.1, len(CUBE)))


def body(dt, speed=0.05, gamma=0.0, gripped=False, fails_at=None, **choices):
    """27 spheres of mass 1 in motion that pulls them apart along x; gripped: the two ends by constant velocities."""
    v = speed * ((PLACES - 1.0) * [1.0, -0.5, -0.5] + 0.5 * np.random.default_rng(5).standard_normal(PLACES.shape))
    ends = (CUBE[:, 0] != 1.0) & gripped
    v[ends] = speed * (CUBE[ends] - 1.0) * [1.0, 0.0, 0.0]
    row = law.Row(1.0, 8.0, 4.0, 0.03, 8.0, 4.0, 0.005, gamma, 1.5)
    bonds = brute.record_bonds(PLACES, RADII, 1.5)
    fails = {"condition": metal.Yield(0.0, 1.0), "fails": metal.Failure((fails_at, 0.0, 0.0))} if fails_at else {}
    return metal.Metal(PLACES, v, RADII, 1.0, row, bonds, dt, prescribed=ends, **fails, **choices)


def imbalance(dt, time, **choices):
    """(largest energy imbalance over the largest energies that pass, the run after it)."""
    run = body(dt, **choices)
    first, kinetic, worst = run.energy(), run.kinetic(), 0.0
    for _ in range(int(round(time / dt / 20))):
        worst = max(worst, abs(run.run(20).energy() - first))
    return worst / (kinetic + abs(run.work_done)), run


@pytest.mark.parametrize("order, most, choices", [
    (2, 1e-4, {"flows": [0, 1], "gamma": 0.3}), (2, 1e-4, {"flows": [0, 1], "gripped": True, "speed": 0.01}),
    (1, 2e-4, {"gripped": True, "gamma": 0.3}), (1, 2e-3, {"flows": [0, 1, 0.02, 0.6, 0.1, 0.5]}),
    (1, 1e-3, {"gamma": 0.2, "contact": "repulsive", "fails_at": 0.05, "speed": 0.1})])
def test_energies_of_a_small_body_close(order, most, choices):
    """In proportion to dt^2 with constant limits; to dt with limits that move and bonds that end."""
    (coarse, _), (fine, run) = (imbalance(dt, 2.0, **choices) for dt in (0.01, 0.0025))
    assert fine < most and fine < coarse * (0.15 if order == 2 else 0.6)
    assert run.dissipated > 0.2 * run.kinetic() and (order == 1 or run.ended < 2), "control"
    assert run.work.sum() == pytest.approx(run.by_flow, rel=1e-12)
    if not run.prescribed.any():
        assert np.allclose(run.mass @ run.v, body(0.01, **choices).v.sum(axis=0), atol=1e-12), "momentum"


def test_set_up_and_updates_of_a_reference_run():
    """An evaluation changes nothing; p moves at steps divisible by 10 alone, by the bonds of the update before."""
    run = body(0.01, speed=0.2, fails_at=0.03, contact="repulsive")
    for _ in range(60):
        before, p, waits, bonds = run.records(), run.p.copy(), run.slip.copy(), run.count.copy()
        run.evaluate()
        assert run.records() == before and run.energy() == run.energy()
        run.run(1)
        moved = waits / np.maximum(bonds, 1.0) / 0.31 if run.n_steps % 10 == 0 else 0.0
        assert np.array_equal(run.p, p + moved)
    assert run.ended > 5 and run.p.max() > 0.03 and run.records(False), "control"
    assert set(run.records()) | set(run.records(False)) <= set(brute.record_bonds(PLACES, RADII, 1.5))
