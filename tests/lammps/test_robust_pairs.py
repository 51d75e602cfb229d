# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: timestep limits, impacts, and single pairs along their whole law."""

import numpy as np
import pytest
from oracle import law
from hostile import refused
from robust import CLOSED_FORM, DEQ, LEDGER_SHARE, MASS, MOMENTUM, RADIUS, SECOND_ORDER, TABLE1, TABLE2, collide, ledger, momenta_changed, on
from scipy.integrate import quad
from scipy.optimize import brentq
from small_bodies import dump, grips, head, lattice_body, pair, thermo, two_groups, write_body, write_two

# ---- steps ----

CRITICAL = 2.0 * np.sqrt(8 * 4 * 80 / 0.01**2 * 0.5 * MASS)


@pytest.mark.parametrize("factor", [0.0, 1.0, 3.6, 30.0])
@on(1)
def test_times_critical_damping(bench, factor):
    """Stable at 0.98 of the limit of compute evp/dt, unstable at 1.02; the remaining energy agrees with that of a quarter of the timestep size."""
    write_body(bench.folder / "body.data", lattice_body((4, 3, 3)))
    left = {}
    for fraction, steps in ((0.98, 3000), (1.02, 800), (0.245, 12000)):
        text = head() + pair(TABLE1._replace(gamma=factor * CRITICAL), "none", "fix bonds all evp/bonds zone 1.4")
        text += "fix move all nve\nvariable vx atom 1e-4*sin(1.1*id)\nvelocity all set v_vx 0 0\nvelocity all zero linear\n"
        text += ledger(steps // 100) + f"run 0\ntimestep $({fraction}*c_dt:%.17g)\nrun {steps}\n"
        run = bench.run(text)
        energy = run.ok().thermo()["KinEng"] if fraction < 1.0 or run.returncode == 0 else np.array([1.0, np.inf])
        left[fraction] = energy
    start = left[0.98][0]
    assert left[0.98].max() <= start * (1.0 + 1e-6)
    assert left[1.02].max() > 1e3 * start
    if factor == 0.0:
        assert abs(left[0.98][1:].mean() / left[0.245][1:].mean() - 1.0) < 0.05
    else:
        assert left[0.98][-1] < start and left[0.245][-1] < start
    bench.show(f"largest kinetic energy over the initial one: 0.98: {left[0.98].max() / start:.3g}, 1.02: {left[1.02].max() / start:.3g}")


@on(1, 4)
def test_table_2_at_the_paper_s_timestep(bench):
    """A warning with the ratio before the first step; the run does not end normally: atoms leave the box. Control: at 0.98 of c_ID the first
    test conserves its energy."""
    write_body(bench.folder / "body.data", lattice_body((4, 3, 3)))
    text = head() + pair(TABLE2, "none") + "fix move all nve\nvariable vx atom 1e-3*sin(1.1*id)\nvelocity all set v_vx 0 0\n" + ledger(10)
    run = bench.run(text + "run 0\ntimestep $(c_dt[4]:%.17g)\nrun 100000\n")
    assert any("times the largest stable timestep" in line for line in run.warnings())
    assert run.returncode != 0
    said = " ".join(run.stdout.split())
    assert "Lost atoms" in said or "non-finite forces" in said, said[-400:]
    bench.show("warned, then stopped")


# ---- pulled apart ----

PULL = grips(0.01, 0.07) + """
velocity free ramp vx -1.5 1.5 x 0.01 0.07
velocity left set -1.5 0 0
velocity right set 1.5 0 0
fix hold grips nve/noforce
fix move free {style}
"""


def pull(bench, row, contact, style, strain):
    """At 50/s with fix dt/evp 20 0.4 displacement 0.1; the largest opening of the ledger over the work, and bonds lost."""
    write_body(bench.folder / "body.data", lattice_body((8, 3, 3)))
    text = head(boundary="s s s") + pair(row, contact) + PULL.format(style=style)
    text += ledger(2000, "fix step free dt/evp 20 0.4 displacement 0.1", "f_bonds[1]").replace("compute dt all evp/dt\n", "")
    text += f"variable now equal time\nfix stop all halt 20 v_now > {strain / 50.0} error continue message no\nrun 5000000\n"
    table = bench.run(text).ok().thermo()
    share = np.abs(table["f_energy"]).max() / np.abs(table["f_energy[7]"]).max()
    assert share < LEDGER_SHARE
    assert table["f_bonds[1]"][-1] > 20, "control: a section is torn"
    bench.show(f"energy imbalance {share:.1e} of the work, {table['f_bonds[1]'][-1]:.0f} bonds lost, {table['Step'][-1]:.0f} steps")


@pytest.mark.parametrize("contact", ["literal", "repulsive", "none"])
@on(1)
def test_table_1_pulled_to_rupture(bench, contact):
    """Energy imbalance below 1e-3 of the work of the grips."""
    pull(bench, TABLE1, contact, "nve", 0.2)


def test_table_2_pulled_to_50_percent(bench):
    """Energy imbalance below 1e-3 of the work of the grips. Control: bonds of a section are lost."""
    pull(bench, TABLE2, "repulsive", "nve/evp", 0.5)


@pytest.mark.parametrize("speed", [1, 30, 500])
@on(1, 2)
def test_head_on_impact(bench, speed):
    """Momentum conserved to 1e-12, energy imbalance below 1e-3 of the kinetic energy, bodies rebound or break and do not pass through each
    other. Control: kinetic energy is converted."""
    steps, check = {1: (24000, 10), 30: (6000, 5), 500: (2500, 1)}[speed]
    run, mass, energy = collide(bench, TABLE1, [0.0395, 0.001, 0.002], speed, "nve", f"{check} 0.4 max 5e-7", 40, steps)
    table = run.thermo()
    moved, _, size = momenta_changed(run, mass)
    share = np.abs(table["f_energy"]).max() / energy
    traded = -table["f_energy[1]"].min() / energy
    change = moved / size
    assert change < MOMENTUM and share < LEDGER_SHARE
    assert traded > 0.2, "control: they met"
    bench.show(f"{100 * traded:.0f} % of the kinetic energy converted, energy imbalance {share:.1e}, error of the momentum {change:.0e}")


# ---- one pair ----


def work_of_movers(bench, row, to, n=8000, deq=DEQ):
    """Both spheres moved from deq to `to`; the table of ten rows."""
    write_two(bench.folder / "body.data", deq)
    speed, time = 1.0, abs(to - deq) / 2.0
    sign = 1.0 if to > deq else -1.0
    text = head() + pair(row) + two_groups(-sign * speed, sign * speed)
    text += "fix move all nve/noforce\n" + ledger(n // 10, more="f_bonds[1] f_bonds[4]") + f"timestep {time / n:.17g}\nrun {n}\n"
    run = bench.run(text).ok()
    return run, run.thermo(), deq + (to - deq) * np.arange(11) / 10


def follows_the_energy(table, d, row, deq=DEQ):
    cut = row.alpha * 2.0 * RADIUS
    expected = law.energy(np.minimum(d, cut), deq, row, deq)
    off = np.abs(table["f_energy[7]"] - expected).max() / np.abs(expected).max()
    assert off < CLOSED_FORM
    return off


@on(1, 4)
def test_overlap_to_one_half(bench):
    """Work = energy of the law, down to d = 0.5 (R_i + R_j); one warning names the pair that overlaps by more than 0.3. Control: down to d =
    0.75 (R_i + R_j) there is no warning."""
    shown = []
    for to, warned in ((0.0075, 0), (0.005, 1)):
        run, table, d = work_of_movers(bench, TABLE1, to)
        named = [line for line in run.warnings() if "overlap by more than" in line and "atoms 1 and 2" in line.replace("atoms 2 and 1", "atoms 1 and 2")]
        assert len(named) == warned
        shown.append(follows_the_energy(table, d, TABLE1))
    bench.show(f"error of the work {max(shown):.1e}, one warning")


@pytest.mark.parametrize("xi_s", [1e-06, 0.001, 0.05, 0.3])
@on(1)
def test_threshold_strain(bench, xi_s):
    """Work to beyond dlim = depth of the law."""
    row = TABLE1._replace(xi_s=xi_s)
    _, table, d = work_of_movers(bench, row, 0.0155)
    bench.show(f"error of the work {follows_the_energy(table, d, row):.1e}")


@pytest.mark.parametrize("alpha", [1.05, 1.5, 3.0])
@on(1)
def test_range_alpha(bench, alpha):
    """Work to beyond dlim = depth of the law. Control: a bond is lost at the end."""
    row = TABLE1._replace(alpha=alpha)
    gap = 0.5 * (1.0 + alpha) * 2.0 * RADIUS  # between contact and dlim
    _, table, d = work_of_movers(bench, row, 1.03 * alpha * 2.0 * RADIUS, 16000, gap)
    assert table["f_bonds[1]"][-1] == 1
    bench.show(f"error of the work {follows_the_energy(table, d, row, gap):.1e}")


@pytest.mark.parametrize("chosen", ["2 1", "8 4", "13.5 1.5", "24 12"])
@on(1)
def test_exponents(bench, chosen):
    """Work to beyond dlim = depth of the law."""
    m, n = map(float, chosen.split())
    row = TABLE1._replace(m1=m, n1=n, m2=n + 1.0, n2=n)
    _, table, d = work_of_movers(bench, row, 0.0155)
    bench.show(f"error of the work {follows_the_energy(table, d, row):.1e}")


def test_pair_swings_across_xi_s(bench):
    """Period = integral of dd/v over the law of both regimes; energy conserved."""
    write_two(bench.folder / "body.data", DEQ)
    mu, energy = 0.5 * MASS, law.energy(1.015 * DEQ, DEQ, TABLE1, DEQ)
    speed = np.sqrt(2.0 * energy / mu)
    well = lambda d: law.energy(d, DEQ, TABLE1, DEQ)  # noqa: E731
    turns = [DEQ * brentq(lambda xi: well(DEQ * (1.0 + xi)) - energy, 0.0, end, xtol=1e-15) for end in (-0.03, 0.03)]
    # d = middle - half cos(angle) takes the square roots at the turns away
    middle, half = 0.5 * (turns[0] + turns[1]), 0.5 * (turns[1] - turns[0])
    slow = lambda t: half * np.sin(t) / np.sqrt(2.0 / mu * max(energy - well(DEQ + middle - half * np.cos(t)), 1e-300))  # noqa: E731
    period = 2.0 * quad(slow, 1e-6, np.pi - 1e-6, limit=400)[0]
    n = 2000
    text = head() + pair(TABLE1) + two_groups(-speed / 2, speed / 2)
    text += "fix move all nve\n" + ledger(10) + dump(every=5) + f"timestep {period / n:.17g}\nrun {10 * n + 100}\n"
    run = bench.run(text).ok()
    snapshots = run.dump("all.dump")
    stretch = np.array([s["x"][1] - s["x"][0] - DEQ for s in snapshots])
    at = np.array([s.step for s in snapshots]) / n
    up = np.flatnonzero((stretch[:-1] < 0.0) & (stretch[1:] >= 0.0))
    zeros = at[up] - stretch[up] * (at[up + 1] - at[up]) / (stretch[up + 1] - stretch[up])
    off = abs((zeros[-1] - zeros[0]) / (len(zeros) - 1) - 1.0)
    drift = np.abs(run.thermo()["f_energy"]).max() / energy
    assert len(zeros) >= 9 and off < SECOND_ORDER and drift < SECOND_ORDER
    bench.show(f"error of the period {off:.1e}, of the energy {drift:.1e}")


def test_pair_passes_dlim_back_and_forth(bench):
    """Leaves with the speed sqrt(v^2 - 2 depth/mu) and returns with v, at each of six passages. Control: one bond is lost on each way out, none
    on the way back."""
    write_two(bench.folder / "body.data", DEQ)
    depth = law.energy(0.015, DEQ, TABLE1, DEQ)
    mu = 0.5 * MASS
    speed = np.sqrt(2.0 * 1.3 * depth / mu)
    step, turn = 5e-8, 2500
    text = head() + pair(TABLE1) + two_groups(-speed / 2, speed / 2)
    text += "fix move all nve\nvariable back atom -vx\n" + ledger(turn, more="f_bonds[1]") + f"timestep {step}\n"
    run = bench.run(text + (f"run {turn}\nvelocity all set v_back 0 0\n" * 6)).ok()
    kinetic = [(run.thermo(k)["KinEng"][-1], run.thermo(k)["f_bonds[1]"][-1]) for k in range(6)]
    whole = 0.5 * mu * speed**2
    # each passage errs by the force there times what a step carries
    allowed = abs(law.force(0.015, DEQ, TABLE1)) * speed * step / whole
    worst = 0.0
    for k, (energy, lost) in enumerate(kinetic):
        expected = whole - depth if k % 2 == 0 else whole
        assert lost == (1 if k % 2 == 0 else 0)
        worst = max(worst, abs(energy - expected) / whole)
        assert worst <= (k + 1) * allowed
    bench.show(f"error of the kinetic energy {worst:.1e} of the whole after six passages")


@pytest.mark.parametrize("defined", ["before", "after"])
@on(1, 4)
def test_null_component_of_fix_move(bench, defined):
    """Fix nve/evp refuses an atom beside it of which fix move integrates a component by the forces; fix nve in its place conserves the momentum
    to 1e-12 and dissipates mu v^2/2. Control: with the component prescribed, or without damping, fix nve/evp runs."""
    write_two(bench.folder / "body.data", 2.0 * RADIUS)
    speed = 0.5

    def run(x, style, steps=1, gamma=200.0):
        fixes = [f"fix lead two move linear {x} 0 0\n", f"fix move one {style}\n"][:: 1 if defined == "before" else -1]
        text = head() + pair(TABLE1._replace(gamma=gamma), "none") + two_groups(speed, 0.0) + "".join(fixes) + "fix energy all evp/energy\n"
        text += "variable p equal mass(all)*vcm(all,x)\ntimestep 1e-7\n" + thermo("f_energy[6] v_p")
        return bench.run(text + f"run {steps}\n")

    refused(run("NULL", "nve/evp"), "fix lead of style move integrates its component x by the forces (NULL)", "or use fix nve for the group of fix move")
    run("0", "nve/evp").ok()
    run("NULL", "nve/evp", gamma=0.0).ok()
    table = run("NULL", "nve", 1000).ok().thermo()
    off = abs(table["v_p"][-1] / (MASS * speed) - 1.0)
    share = table["f_energy[6]"][-1] / (0.25 * MASS * speed**2)
    assert off < MOMENTUM
    assert abs(share - 1.0) < SECOND_ORDER
    bench.show(f"refused; with fix nve the error of the momentum is {off:.0e}, and {share:.5f} of mu v^2/2 is dissipated")
