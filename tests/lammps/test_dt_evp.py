# SPDX-License-Identifier: GPL-2.0-only
"""fix dt/evp: the step that it sets against sums over all pairs, how it changes it, and every misuse."""

import re

import numpy as np
import pytest
from evp import law
from oracle import brute
from lammps_run import write_data
from small_bodies import dump, head, mass_of, pair, thermo, velocities, write_two

STABILITY, DISPLACEMENT, MAXIMUM, GROWTH = 1, 2, 3, 4  # f_ID[3]
SHARE = 0.1  # of xi_s deq per step, which the decks ask for
GROWTH_PER_CHECK = 1.25
RADIUS = 0.005
ROUNDED = 1e-9  # a minimum over pairs, from printed places and velocities
EVERY = 5

FLY = "fix move {group} {style}\n{also}\nfix dt {group} dt/evp {every} 0.4 {more}\nthermo {every}\n" + thermo("time dt f_dt f_dt[*]")


def stir(speed, spin=0.0, flight=0.0):
    """A wave by ID, a rotation about z, a translation."""
    waves = (f"{speed}*sin(1.1*id)", f"{speed}*cos(2.3*id)", f"{speed}*sin(3.7*id+1)")
    return velocities(f"{flight}-{spin}*y+{waves[0]}", f"{flight}/2+{spin}*x+{waves[1]}", f"{flight}/3+{waves[2]}")


def deck(motion, row=law.TABLE1, style="nve", newton="on", contact="literal", more=f"displacement {SHARE}", group="all", every=EVERY, also=""):
    return head(newton, "s s s") + pair(row, contact) + motion + FLY.format(style=style, more=more, group=group, every=every, also=also)


def slowest(snapshot, body, contact="literal", free=None):
    """The timestep that speed allows over the interacting pairs, and its pair of IDs."""
    x, v = snapshot.x, snapshot.v
    pairs, deq, *_ = brute.interactions(x, body.radius, law.TABLE1, body.bonds, contact)
    opening = np.sum(pairs.r / pairs.d[:, None] * (v[pairs.i] - v[pairs.j]), axis=1)
    allowed = SHARE * law.TABLE1.xi_s * deq / np.abs(opening)
    if free is not None:
        allowed[~(free[pairs.i] | free[pairs.j])] = np.inf
    k = int(np.argmin(allowed))
    return allowed[k], {pairs.i[k] + 1, pairs.j[k] + 1}


# ---- what limits dt ----


@pytest.mark.parametrize("ranks, motion", [(1, stir(0.0)), (2, stir(0.0, spin=200.0, flight=500.0))], ids=["rest", "flight"])
def test_stability_is_that_of_the_integrator(lmp, body, ranks, motion):
    """The implicit bound where fix nve/evp integrates all atoms of the group, the explicit limit where it does not; flight and spin change nothing."""
    for style, column in (("nve/evp", "c_dt[3]"), ("nve", "c_dt[2]")):
        text = deck(motion, law.TABLE2, style, also="compute dt all evp/dt").replace("f_dt[*]", "f_dt[*] c_dt[*]")
        table = lmp(text + "run 0\n", ranks).ok().thermo()
        assert table["f_dt[3]"][0] == STABILITY
        assert table["f_dt[1]"][0] == pytest.approx(table[column][0], rel=1e-12)
        assert table["f_dt"][0] == table["Dt"][0] == pytest.approx(0.4 * table["f_dt[1]"][0], rel=1e-12)


@pytest.mark.parametrize("style, gamma", [("nve", 0.0), ("nve", 1000.0), ("nve/evp", 1000.0)])
def test_between_eigenvalues_the_step_is_proven_by_row_sums(lmp, body, style, gamma):
    """A stirred body: the largest stable timestep within the change of its bound, and what is set below both. Control: 0.9 of it is not
    proven with fix nve, and is that of the eigenvalues at each check."""
    text = deck(stir(100.0), law.TABLE1._replace(gamma=gamma), style, contact="repulsive", more="", also="compute dt all evp/dt").replace("f_dt[*]", "f_dt[*] c_dt c_dt[5]")
    table = lmp(text + f"run {20 * EVERY}\n", 2).ok().thermo()
    off = table["f_dt[1]"] / table["c_dt"] - 1.0
    assert abs(off[0]) < 1e-12 and 1e-6 < np.abs(off[1:]).max() < 0.05
    assert np.all(table["f_dt"] < table["c_dt"]) and (style == "nve/evp" or np.all(table["f_dt"] <= table["c_dt[5]"]))
    table = lmp(text.replace(" 0.4 ", " 0.9 ") + f"run {10 * EVERY}\n", 2).ok().thermo()
    assert np.allclose(table["f_dt[1]"], table["c_dt"], rtol=1e-12) == (style == "nve")


@pytest.mark.parametrize("contact, ranks, newton", [("literal", 2, "off"), ("repulsive", 1, "on")])
def test_displacement_along_the_pair_limits_a_stirred_body(lmp, body, ranks, newton, contact):
    """At set-up and at a check in the run; flight and spin beside do not count; one warning names the pair."""
    text = deck(stir(20.0, spin=300.0, flight=100.0), newton=newton, contact=contact) + dump(every=EVERY) + f"run {EVERY}\n"
    run = lmp(text, ranks).ok()
    table = run.thermo()
    for row, snapshot in enumerate(run.dump("all.dump")):
        step, ids = slowest(snapshot, body, contact)
        assert table["f_dt[3]"][row] == DISPLACEMENT
        assert table["f_dt[2]"][row] == pytest.approx(step, rel=ROUNDED)
        assert table["Dt"][row] == table["f_dt[2]"][row] < 0.4 * table["f_dt[1]"][row]
        assert {table["f_dt[4]"][row], table["f_dt[5]"][row]} == ids
        if row == 0:
            first = ids
    (warned,) = [line for line in run.warnings() if "the displacement of pairs limits the timestep" in line and "omit 'displacement'" in line]
    assert {int(word) for word in re.search(r"for atoms (\d+) and (\d+)", warned).groups()} == first


def test_without_displacement_only_stability_limits_a_stirred_body(lmp, body):
    """One warning names the pair, what it does in a step, and the choice, where that is more than the threshold strain; in both runs f_dt[2] is
    the timestep of one threshold strain."""
    for speed, expected in ((20.0, 1), (1.0, 0)):
        run = lmp(deck(stir(speed, spin=300.0, flight=100.0), newton="off", more="") + dump(every=EVERY) + f"run {EVERY}\n", 2).ok()
        table, warned = run.thermo(), [re.search(r"atoms (\d+) and (\d+) changes by (\S+) times.* add 'displacement 0.1' there", line) for line in run.warnings()]
        warned = [found for found in warned if found]
        assert list(table["f_dt[3]"]) == [STABILITY] * 2 and table["Dt"] == pytest.approx(0.4 * table["f_dt[1]"], rel=1e-12)
        assert len(warned) == expected
        for row, snapshot in enumerate(run.dump("all.dump")):
            step, ids = slowest(snapshot, body)
            assert table["f_dt[2]"][row] == pytest.approx(step / SHARE, rel=ROUNDED)
            if row == 0 and warned:
                assert {int(word) for word in warned[0].groups()[:2]} == ids
                assert float(warned[0][3]) == pytest.approx(table["Dt"][0] / table["f_dt[2]"][0], rel=5e-3)


def test_pairs_of_prescribed_atoms_do_not_rule(lmp, body):
    motion = stir(20.0) + "region right block 0.04 INF INF INF INF INF\ngroup free region right\n"
    motion += "group held subtract all free\nvariable wx atom 90*sin(1.1*id)\nvelocity held set v_wx NULL NULL\n"
    run = lmp(deck(motion, group="free", also="fix hold held nve/noforce") + dump(every=EVERY) + "run 0\n").ok()
    snapshot = run.dump("all.dump")[0]
    step, ids = slowest(snapshot, body, free=snapshot["x"] > 0.04)
    assert step > 1.001 * slowest(snapshot, body)[0], "control: the ruling pair of all is between held atoms"
    assert run.thermo()["f_dt[2]"][0] == pytest.approx(step, rel=ROUNDED)
    assert {run.thermo()["f_dt[4]"][0], run.thermo()["f_dt[5]"][0]} == ids


GAP = 2e-4  # beyond where the pair acts or joins, within the list


@pytest.mark.parametrize("contact, acts_from", [("literal", 0.015), ("join 1.2 plasticity isotropic", 0.012)])
@pytest.mark.parametrize("approach, limit", [(0.9, MAXIMUM), (1.1, DISPLACEMENT), (-1.1, MAXIMUM)])
def test_a_listed_pair_limits_dt_where_it_can_reach_the_cut_before_the_next_check(lmp, tmp_path, contact, acts_from, approach, limit):
    """Two free spheres: nothing interacts, so 'max' is the step; speeds are such that the gap closes in 1/approach of a check."""
    write_two(tmp_path / "body.data", acts_from + GAP)
    longest = 1e-6
    speed = approach * GAP / (EVERY * longest)
    text = deck(f"group one id 1\nvelocity one set {speed} 0 0\n", contact=contact, more=f"max {longest} displacement {SHARE}").replace("s s s", "f f f")
    table = lmp(text.replace("all evp/bonds", "all evp/bonds zone 1.01") + "run 0\n").ok().thermo()
    assert table["f_dt[3]"][0] == limit
    expected = min(longest, SHARE * law.TABLE1.xi_s * 0.01 / speed) if limit == DISPLACEMENT else longest
    assert table["Dt"][0] == pytest.approx(expected, rel=ROUNDED)


def test_a_contact_of_two_bodies_is_resolved_as_any(lmp, tmp_path):
    """By the xi_s of its row, though its law stays elastic; an impact keeps its energy, as with a tenth of that timestep."""
    write_data(tmp_path / "body.data", np.array([[-0.999999 * RADIUS, 0, 0], [0.999999 * RADIUS, 0, 0]]), [RADIUS] * 2, [[-0.2, 0.2]] * 3, [1, 2])
    parted, starts = {}, "velocity all set 0 0 0\ngroup one id 1\nvelocity one set 20 0 0\n"
    for step in ("displacement 0.1", "displacement 0.01"):
        text = deck(starts, more=step + " max 1e-6", every=1, also="fix energy all evp/energy").replace("f_dt[*]", "f_dt[*] f_energy v_v").replace("s s s", "f f f")
        text = text.replace("fix bonds all evp/bonds", "fix bonds all evp/bonds within type")
        table = lmp("variable v equal vx[2]\n" + text + f"run {150 if step.endswith('.1') else 1500}\n").ok().thermo()
        assert table["f_dt[3]"][0] == DISPLACEMENT
        assert table["Dt"][0] == pytest.approx(float(step.split()[1]) * law.TABLE1.xi_s * 2.0 * RADIUS / 20.0, rel=ROUNDED)
        parted[step] = table["v_v"][-1]
        assert np.abs(table["f_energy"]).max() < 1e-3 * 0.5 * mass_of(RADIUS) * 20.0**2
    assert parted["displacement 0.1"] == pytest.approx(20.0, rel=1e-3) and parted["displacement 0.01"] == pytest.approx(20.0, rel=1e-4)


# ---- how it changes ----


def test_step_grows_by_a_quarter_per_check_and_jumps_at_set_up(lmp, body):
    """Damping takes a wave away within some checks: dt falls behind what the limits allow. A new run may take it at once."""
    run = lmp(deck(stir(100.0), law.TABLE2, "nve/evp", contact="none") + f"run {30 * EVERY}\n").ok()
    table = run.thermo()
    growth, held = table["Dt"][1:] / table["Dt"][:-1], table["f_dt[3]"][1:] == GROWTH
    assert np.max(growth) <= GROWTH_PER_CHECK * (1.0 + 1e-12) and held.sum() > 3
    assert np.allclose(growth[held], GROWTH_PER_CHECK, rtol=1e-12)
    assert table["Dt"][-1] > 3.0 * table["Dt"][0]
    allowed = np.minimum(0.4 * table["f_dt[1]"], table["f_dt[2]"])
    assert np.all(table["Dt"] <= allowed * (1.0 + 1e-12))
    last = int(np.flatnonzero(held)[0]) + 1  # a check where growth ruled
    split = lmp(deck(stir(100.0), law.TABLE2, "nve/evp", contact="none") + f"run {last * EVERY}\nrun 0\n").ok()
    before, after = split.thermo(0), split.thermo(1)
    assert before["f_dt[3]"][-1] == GROWTH
    assert after["Dt"][-1] == pytest.approx(min(0.4 * after["f_dt[1]"][-1], after["f_dt[2]"][-1]), rel=1e-12)
    assert after["Dt"][-1] > before["Dt"][-1]


@pytest.mark.parametrize("style", ["nve", "nve/evp"])
def test_time_and_integrators_follow_the_step(lmp, body, style):
    """The time of each step is that which it was made with, and a body in flight has gone speed * time."""
    text = deck(stir(20.0, flight=500.0), law.TABLE1, style, contact="none", every=2).replace("thermo 2", "thermo 1")
    table = lmp("variable cx equal xcm(all,x)\nvariable cv equal vcm(all,x)\n" + text.replace("f_dt[*]", "f_dt[*] v_cx v_cv") + "run 60\n").ok().thermo()
    steps = np.diff(table["Time"])
    assert np.allclose(steps, table["Dt"][:-1], rtol=1e-10)
    assert np.ptp(steps) > 0.2 * steps[0], "control: the step changes"
    flown = table["v_cx"] - table["v_cx"][0]
    assert np.allclose(flown, table["v_cv"][0] * table["Time"], rtol=1e-10, atol=1e-14)


def test_nve_evp_in_front_of_it_is_set_up_by_its_timestep(lmp, body):
    """By LAMMPS' default of 'units real', or of a timestep that was never meant, the damping would not converge."""
    start = head() + pair(law.TABLE1._replace(gamma=1e5)) + stir(10.0) + "timestep {}\nfix move all nve/evp maxiter 200\nfix dt all dt/evp 10 0.4\nthermo 20\n" + thermo("ke dt")
    ends = [lmp(start.format(step) + "run 20\n", ranks=2).ok().thermo()["KinEng"][-1] for step in (1e-7, 10.0)]
    assert ends[1] == pytest.approx(ends[0], rel=1e-6)
