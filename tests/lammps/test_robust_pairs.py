# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: timestep limits, impacts, and single pairs along their whole law; two bodies, of `within` of fix evp/bonds, and a box that deforms with
`fix deform ... remap v`."""

import numpy as np
import pytest
from oracle import law
from hostile import refused
from lammps_run import write_data
from robust import CLOSED_FORM, DEQ, LEDGER_SHARE, MASS, MOMENTUM, RADIUS, SECOND_ORDER, TABLE1, TABLE2, collide, ledger, momenta_changed, on
from scipy.integrate import quad
from scipy.optimize import brentq
from small_bodies import dump, grips, head, lattice_body, mass_of, pair, thermo, two_groups, velocities, write_body, write_two
from test_robust_bodies import cuboctahedron

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
    text += ledger(2000, "fix step free dt/evp 20 0.4 displacement 0.1", "f_bonds[1]")
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


def test_small_spheres_beside_a_large_one(bench):
    """Two small spheres meet head on, within one neighbor list, from outside of all cutoffs but that of a large sphere of their type: they leave as fast as they came,
    to the last digit of a run without the large one."""
    ends = {}
    for large in (True, False):
        x = np.array([[-0.01, 0, 0], [0.01, 0, 0], [0, 0.2, 0]])[: 2 + large]
        write_data(bench.folder / "body.data", x, np.array([RADIUS, RADIUS, 4 * RADIUS])[: 2 + large], [[-0.3, 0.3]] * 3)
        text = head(skin=0.012) + pair(TABLE1, "repulsive") + two_groups(10.0, -10.0) + "fix move all nve\ntimestep 2e-7\nthermo 5000\n"
        run = bench.run(text + thermo("ke nbuild f_bonds") + dump(every=5000) + "run 5000\n").ok()
        table, ends[large] = run.thermo(), run.dump("all.dump")[-1].v[:2]
        assert table["f_bonds"][-1] == 0 and table["Nbuild"][-1] == 0, "control: they meet before a new list"
    assert ends[True][:, 0] == pytest.approx([-10.0, 10.0], rel=SECOND_ORDER) and np.array_equal(ends[True], ends[False])
    bench.show(f"speed after it over that before: 1 {ends[True][1, 0] / 10.0 - 1.0:+.1e}")


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


# ---- two bodies ----

FIX = "fix bonds all evp/bonds within type"
TOUCHING = 2.0 * RADIUS
ROUND_OFF = 1e-9
SPEED = 1.0  # [m/s] of the ball
BALANCE = 3e-5  # of the kinetic energy, at 0.05 of the largest stable timestep
RATE, EDGE = 500.0, 0.04  # of the box


@pytest.mark.parametrize("contact", ["literal", "repulsive"])
def test_two_bodies_brought_together(bench, contact):
    """The force is exactly zero before the spheres touch, then the repulsion of the first regime, far beyond xi_s, then zero again. Control: without
    *within* they are bonded, and the force in compression is that of eq. 8."""
    forces = []
    for fix in (FIX, "fix bonds all evp/bonds"):
        write_data(bench.folder / "body.data", np.array([[0.0, 0, 0], [1.1 * TOUCHING, 0, 0]]), [RADIUS] * 2, [[-0.2, 0.2]] * 3, [1, 2])
        text = head(skin=0.002) + pair(TABLE1, contact, fix) + two_groups(0.0, 0.0) + "fix hold one move linear 0 0 0\n"
        text += f"fix lead two move wiggle {-0.14 * TOUCHING} 0 0 2e-4\ntimestep 1e-6\ncompute f two reduce sum fx\nvariable d equal x[2]-x[1]\n"
        table = bench.run(text + "thermo 1\n" + thermo("v_d c_f pe") + "run 200\n").ok().thermo()
        forces.append(table["c_f"])
    d, (ours, glued) = table["v_d"], forces
    touch = d <= TOUCHING
    off = np.abs(ours - np.where(touch, law.force(d, TOUCHING, TABLE1._replace(xi_s=0.5)), 0.0)).max() / ours.max()
    assert not np.any(ours[~touch]), "a force before they touch"
    assert off < ROUND_OFF and 10 < np.sum(touch) < 60
    assert glued.min() < 0.0 and glued.max() < 0.5 * ours.max(), "control"
    bench.show(f"error of the force {off:.0e} of the largest over {np.sum(touch)} steps of contact, no force over {np.sum(~touch)} steps")


def ball_and_block():
    """A disordered block of type 1 and above it, 1.1 diameters away, a cuboctahedron of type 2."""
    block, ball = lattice_body((5, 5, 3), seed=8), cuboctahedron()
    place = ball.x - ball.x.mean(axis=0) + [*block.x[:, :2].mean(axis=0), 0.0]

    def closest(z):
        d = np.linalg.norm(place[:, None] + [0.0, 0.0, z] - block.x, axis=2)
        return np.min(d / (ball.radius[:, None] + block.radius))

    place[:, 2] += brentq(lambda z: closest(z) - 1.1, block.x[:, 2].max(), block.x[:, 2].max() + 0.1)
    return np.concatenate([block.x, place]), np.concatenate([block.radius, ball.radius]), np.repeat([1, 2], [len(block.x), len(place)])


def test_ball_hits_block(bench):
    """Momentum conserved to 1e-12; the energy imbalance decreases with the square of the timestep size; the bodies only repel each other.
    Control: the ball moves freely until contact, and rebounds."""
    x, radius, types = ball_and_block()
    write_data(bench.folder / "body.data", x, radius, [[-0.2, 0.3]] * 3, types)
    mass, shares, columns = mass_of(radius), [], "pe ke f_energy v_way v_parting c_push[3] f_bonds[1] f_bonds[2]"
    energy = 0.5 * mass[types == 2].sum() * SPEED**2
    for fraction, steps in ((0.1, 3000), (0.05, 6000)):
        text = head() + pair(TABLE1, "literal", FIX) + f"group ball type 2\ngroup block type 1\nvelocity ball set 0 0 {-SPEED}\nfix move all nve\n"
        text += "compute push ball group/group block\nvariable way equal vcm(ball,z)\nvariable parting equal vcm(ball,z)-vcm(block,z)\n" + ledger(steps // 150) + "run 0\n"
        text += f"timestep $({fraction}*c_dt:%.17g)\n" + thermo(columns) + dump(every=steps) + f"uncompute dt\nrun {steps}\n"
        run = bench.run(text).ok()
        table = run.thermo()
        change, _, size = momenta_changed(run, mass)
        shares.append(np.abs(table["f_energy"]).max() / energy)
        push = table["c_push[3]"]
        touched = np.flatnonzero(push)
        change /= size
        assert change < MOMENTUM
        assert touched[0] > 30 and touched[-1] < 140 and np.all(push >= 0.0) and push.max() > 100.0, "control"
        assert np.abs(table["v_way"][: touched[0]] / SPEED + 1.0).max() < 1e-12 and table["v_parting"][-1] > 0.2 * SPEED, "control"
    drift = np.ptp(table["PotEng"] + table["KinEng"]) / energy
    assert shares[1] < BALANCE and shares[1] < 0.35 * shares[0] and drift < 2.0 * BALANCE
    bench.show(f"energy imbalance {shares[0]:.1e} and {shares[1]:.1e} of the kinetic energy at 0.1 and 0.05 of the limit, error of the momentum {change:.0e}")


def test_sheared_box_with_implicit_damping(bench):
    """Energy imbalance below 1e-4 of the dissipated energy; momentum of the unwrapped body conserved to 1e-11; velocities within 2 % of those of
    explicit damping. Control: atoms are wrapped, and the box does work."""
    body = lattice_body((5, 4, 4), periodic="xyz", tilt=(1e-3, 0.0, 0.0))
    write_body(bench.folder / "body.data", body, (1e-3, 0.0, 0.0))
    text = head(boundary="p p p") + pair(TABLE1._replace(gamma=50.0), "none", "fix bonds all evp/bonds zone 1.4")
    text += velocities(f"{RATE}*y+200+5*sin(1.1*id)", "300+5*cos(2.3*id)")
    text += f"fix energy all evp/energy\nfix box all deform 1 xy erate {RATE} remap v\nfix move all {{}}\ntimestep 2e-7\nthermo 200\n"
    text += thermo("f_energy f_energy[*]") + dump(every=200).replace("fx fy fz", "iy").replace("pbc yes", "pbc no") + "run 200\n"
    found = {}
    for style in ("nve", "nve/evp tol 1e-10"):
        run = bench.run(text.format(style)).ok()
        found[style], table = run.dump("all.dump"), run.thermo()
    share = abs(table["f_energy"][-1]) / table["f_energy[6]"][-1]
    assert share < 1e-4
    assert abs(table["f_energy[13]"][-1]) > table["f_energy[6]"][-1] > 0.5
    unwrapped = []
    for snapshot in [*found["nve/evp tol 1e-10"], found["nve"][-1]]:
        v = snapshot.v
        v[:, 0] += RATE * EDGE * snapshot["iy"]
        unwrapped.append(v)
    wrapped = np.count_nonzero(found["nve"][-1]["iy"] - found["nve"][0]["iy"])
    assert wrapped > 10
    mass = mass_of(body.radius)
    off = np.abs(mass @ (unwrapped[1] - unwrapped[0])).max() / (mass.sum() * 400.0)
    assert off < 1e-11
    apart = np.abs(unwrapped[1] - unwrapped[2]).max() / (RATE * EDGE)
    assert apart < 0.02
    bench.show(f"energy imbalance {share:.1e}, error of the momentum {off:.0e}, {wrapped} atoms wrapped, velocities {apart:.1e} from explicit ones")
