# SPDX-License-Identifier: GPL-2.0-only
"""`plasticity isotropic` of single pairs and of a body whose bonds flow and end: deq, p, force, energy and plastic work against tools/evp/law.py and
tests/oracle/metal.py, which were written apart. Where deq of pairs may move, cycles below yield, and that flow is the same in every frame."""

import numpy as np
import pytest
from evp import law
from oracle import metal
from flowing import failing_at, flow_words, BONDS, KV, MOVE, SHAKE, assert_flowed, flowing_pair, largest_difference, lead, read_pairs
from flowing import ROW as FLOWING
from lammps_run import read_csv, write_state
from small_bodies import dump, energies, grips, head, mass_of, pair, thermo, turn_about, words, write_body, write_two

ROW = law.TABLE1
FORCE = ROW.m1 * ROW.n1 * ROW.e1 * ROW.xi_s / 0.01  # of a pair at its threshold [N]
FALLING = (0, 1, 2, 3, 10, 0.5)  # Y rises and falls


# ---- one pair, led to random distances

DEQ = 0.011
LED = """
fix hold all nve/noforce
timestep 1e-12
run 0
variable target file targets.txt
compute own all pair/local dist force eng p1 p3
compute sums all reduce sum c_own[1] c_own[2] c_own[3] c_own[4] c_own[5] inputs local
compute each all evp/state/atom plastic_work plastic_strain
compute both all reduce sum c_each[5] c_each[6]
thermo_style custom step c_sums[*] c_both[*]
print "d,force,energy,deq,regime,work,p" file way.csv screen no
label again
variable place equal ${target}
set atom 2 x $(v_place:%.17g)
run 1 post no
print "$(c_sums[1]:%.17g),$(c_sums[2]:%.17g),$(c_sums[3]:%.17g),$(c_sums[4]:%.17g),$(c_sums[5]),$(c_both[1]:%.17g),$(c_both[2]/2:%.17g)" append way.csv screen no
next target
jump SELF again
write_evp_bonds end.bonds
"""


@pytest.mark.parametrize("e2, table, update", [(0.3, None, 10), (3.0, FALLING, 10), (3.0, "own", 10), (0.3, None, 1), (3.0, FALLING, 7)])
def test_a_pair_through_random_reversals(lmp, tmp_path, e2, table, update):
    """300 of them (2000: tests/unit), each in one timestep, some without a change of the distance, some by a fifth of it, with limits that grow, that fall,
    and of a pair of two types that holds by its own."""
    row = ROW._replace(e2=e2)
    rng = np.random.default_rng(7)
    targets = rng.uniform(-0.03, 0.03, 300) * DEQ
    targets[4::25] *= 7.0
    targets[3::8] = targets[2::8]
    write_two(tmp_path / "body.data", DEQ)
    (tmp_path / "targets.txt").write_text("".join(f"{0.5 * DEQ + target:.17g}\n" for target in targets))
    start, coeffs = "read_data body.data", f"pair_coeff * * {words(row)}{flow_words(table)}\n"
    if table == "own":
        start += " extra/atom/types 1\nset atom 2 type 2"
        coeffs, table = f"pair_coeff * * {words(row._replace(xi_s=0.002))}{flow_words(FALLING)}\npair_coeff 1 2 {words(row)} limit own\n", (0, 1)
    style = f"pair_style evp/lj contact none plasticity isotropic{f' update {update}' if update != 10 else ''}\n{coeffs}fix bonds all evp/bonds\n"
    lmp(head("off", start=start, skin=0.006) + style + LED, 2 if table == FALLING and update == 7 else 1).ok()
    found = read_csv(tmp_path / "way.csv")
    led = lead(found["d"], DEQ, row, table, every=update)
    fell = np.any(np.diff(led.limit) < 0.0)
    assert len(found["d"]) == 300 and np.ptp(led.deq) > 0.02 * DEQ and (table == (0, 1) or np.ptp(led.limit) > ROW.xi_s) and fell == (table == FALLING), "control"
    assert np.abs(found["deq"] / led.deq - 1.0).max() < 1e-12
    assert np.abs(found["force"] - led.force).max() < 1e-9 * FORCE
    assert np.abs(found["energy"] - led.stored).max() < 1e-11 * row.e1 * row.m1 * row.n1 * row.xi_s
    assert found["work"] == pytest.approx(led.work, rel=1e-10) and np.all(np.diff(found["work"]) >= 0.0)
    assert found["p"] == pytest.approx(led.p, rel=1e-10)
    assert np.array_equal(found["regime"] == 2, np.abs(found["d"] / led.deq - 1.0) >= 0.99 * led.limit)
    assert list(read_pairs(tmp_path / "end.bonds").bonds.values()) == pytest.approx(led.deq[-1:], rel=1e-12)


# ---- a body


SOFT, WEAK = FLOWING._replace(e1=60.0, gamma=30.0), ROW._replace(m1=6.0, n1=3.0, xi_s=0.002)
ROWS = {(1, 1): FLOWING, (2, 2): WEAK, (1, 2): SOFT, (2, 1): SOFT}
SOFTENS = (0, 1, 0.1, 2, 0.3, 0.5)
TABLES = {1: None, 2: SOFTENS}


@pytest.mark.parametrize("contact, fails, newton, ranks, update", [
    ("none", None, "off", 2, 10), ("repulsive", 0.3, "on", 1, 10), ("join 1.2", 0.3, "off", 2, 10), ("join 1.35", None, "on", 1, 10),
    ("repulsive", 0.3, "on", 3, 40), ("join 1.2", 0.3, "off", 1, 4)])
def test_a_body_of_two_types(lmp, tmp_path, small, contact, fails, newton, ranks, update):
    """Its motion, deq and energies, and p and work of its spheres, as tests/oracle/metal.py has them after 200 steps: with limits by the types of the
    spheres, one that hardens and one that softens, and bonds that end."""
    coeffs = f"pair_coeff 1 1 {words(FLOWING)}{failing_at(fails)}\npair_coeff 2 2 {words(WEAK)}{flow_words(SOFTENS)}{failing_at(fails)}\npair_coeff 1 2 {words(SOFT)}\n"
    style = f"pair_style evp/lj contact {contact} plasticity isotropic{f' update {update}' if update != 10 else ''}\n{coeffs}{BONDS}\n"
    text = head(newton) + style + SHAKE + "fix energy all evp/energy\nfix move all nve\ntimestep 3e-7\nthermo 200\n" + thermo("ke f_energy f_energy[*]")
    text += dump(every=200) + "run 200\nwrite_evp_bonds end.bonds\n"
    run = lmp(text, ranks).ok()
    first, last = run.dump("all.dump")
    bonds = {key: deq for key, deq in small.bonds.items() if deq <= 1.1 * sum(small.radius[k - 1] for k in key)}
    body = metal.Metal(first.x, first.v, small.radius, mass_of(small.radius), ROWS, bonds, 3e-7, TABLES, small.types, contact.split()[0],
                       every=update, join=float((contact + " 1.2").split()[1]), condition=metal.Yield(0.0, 2700.0), fails=fails and metal.Failure((fails, 0.0, 0.0))).run(200)
    found, pairs = energies(run.thermo()), read_pairs(tmp_path / "end.bonds")
    assert np.abs(last.x - body.x).max() < 1e-10 and np.abs(last.v - body.v).max() < 1e-8 * np.abs(body.v).max()
    for own, wanted in ((pairs.bonds, body.records()), (pairs.contacts, body.records(bonds=False))):
        assert own == pytest.approx(wanted, rel=1e-8)
    assert list(pairs.column("plastic_strain").values()) and (pairs.ended, pairs.joined) == (body.ended, body.joined)
    assert set(pairs.inside) == body.inside_pairs() and (body.joined > 3) == contact.startswith("join")
    for name, values in (("plastic_strain", body.p), ("plastic_work", body.work), ("slip", body.slip), ("bonds", body.count)):
        own = pairs.column(name)
        assert np.array([own[k] for k in sorted(own)]) == pytest.approx(values, rel=1e-7, abs=1e-9 * values.max()), name
    for entry, value, relative in (("plastic", body.dissipated, 1e-7), ("ended", body.lost, 1e-7), ("dissipated", body.viscous, 1e-3)):
        assert found[entry] == pytest.approx(value, rel=relative, abs=1e-9), entry  # viscous: the oracle takes the mean velocity of a whole step
    assert run.thermo()["KinEng"][-1] == pytest.approx(body.kinetic(), rel=1e-9)
    assert len(pairs.bonds) == len(bonds) + pairs.joined - pairs.ended and (pairs.ended > 3) == bool(fails), "control"
    limits = body.y[small.types == 2] / WEAK.xi_s
    assert np.median(body.work) > 0.0 and limits.max() > 1.2 and limits.min() < 0.9, "control"


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (4, "off")])
def test_a_plastic_strain_that_is_given(lmp, tmp_path, small, ranks, newton):
    """By fix_modify, to half of the spheres of a body that has flowed, at the first step: bonds beyond the lower limits are returned at fixed distance, what
    they stored is plastic work, and no plastic strain; the others stay as they are."""
    text = head(newton) + flowing_pair(fails=None, kv=0).replace(words(FLOWING), words(FLOWING) + flow_words((0, 1, 0.05, 3))) + SHAKE
    text += "fix energy all evp/energy\n" + MOVE.replace("pe ke pxx pyz", "f_energy f_energy[9]").replace(" f_volume f_volume[1]", "")
    text += "run 200\nunfix move\nfix hold all nve/noforce\nvelocity all set 0 0 0\nrun 1\nwrite_evp_bonds before.bonds\n" + dump(every=1)
    text += "group odd id 1:1999:2\nfix_modify bonds plastic_strain odd 0\nwrite_evp_bonds waits.bonds\nrun 1\nwrite_evp_bonds after.bonds\n"
    text += "run 20\nwrite_evp_bonds later.bonds\n"
    run = lmp(text, ranks).ok()
    x, y0 = run.dump("all.dump")[-1].x, FLOWING.xi_s
    before, waits, after = (read_pairs(tmp_path / f"{name}.bonds") for name in ("before", "waits", "after"))
    assert all(value == (0.0 if k % 2 else -1.0) for k, value in waits.column("given_strain").items()), "what waits is in the file"
    p, p_before = after.column("plastic_strain"), before.column("plastic_strain")
    assert all(p[k] == (0.0 if k % 2 else pytest.approx(p_before[k], abs=0.01)) for k in p) and max(p_before.values()) > 0.05
    assert read_pairs(tmp_path / "later.bonds").column("plastic_strain") == pytest.approx(p, abs=1e-12)
    returned = 0
    for (i, j), deq in before.bonds.items():
        r = np.linalg.norm(x[i - 1] - x[j - 1]) / deq
        wanted = deq * r / np.clip(r, 1.0 - y0, 1.0 + y0) if i % 2 or j % 2 else deq
        assert after.bonds[i, j] == pytest.approx(wanted, rel=1e-12)
        returned += wanted != deq
    imbalance, plastic = (run.thermo(-2)[name] for name in ("f_energy", "f_energy[9]"))
    assert returned > 10 and plastic[-1] > 1.001 * plastic[0] and abs(np.diff(imbalance)[-1]) < 1e-12 * plastic[-1]


GIVEN = """group a id 1:10
group b id 6:15
fix_modify bonds plastic_strain a 0.1
fix_modify bonds plastic_strain b 0.2
group a delete
group b delete
group other id 20:30
group a id 31:35
"""
WAITING = {"straight": "displace_atoms all move 0.015 0 0 units box\n", "restart": "write_restart wait.restart\nclear\n", "text": "write_data wait.data\nwrite_evp_bonds wait.bonds\nclear\n",
           "before the recording": "", "twice": "fix_modify bonds plastic_strain other 0.3\nfix_modify bonds plastic_strain other 0\n"}


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (3, "on")])
def test_a_plastic_strain_that_waits(lmp, tmp_path, small, ranks, newton):
    """It is of the atoms that were in the group when it was given, wherever they go until the next run; of two the later one is in force."""
    style = flowing_pair(kv=0, fix="")
    hold = "fix hold all nve/noforce\nvelocity all set 0 0 0\ntimestep 1e-9\n"
    start = head(newton) + style + "fix bonds all evp/bonds\n" + hold + "run 0\n"
    for name, then in WAITING.items():
        text = (start.replace("run 0\n", "") if name == "before the recording" else start) + GIVEN + then
        if name == "restart":
            text += head(newton, start="read_restart wait.restart") + "fix bonds all evp/bonds\n" + hold
        elif name == "text":
            text += head(newton, start="read_data wait.data") + style + "fix bonds all evp/bonds file wait.bonds\n" + hold
        if name == "restart":  # on other ranks
            first, text = text.split("clear\n")
            lmp(first, ranks % 3 + 1).ok()
        lmp(text + "run 0\nrun 1\nwrite_evp_bonds end.bonds\n", ranks).ok()
        found = read_pairs(tmp_path / "end.bonds").column("plastic_strain")
        assert {k: p for k, p in found.items() if p} == {k: 0.1 if k < 6 else 0.2 for k in range(1, 16)}, name


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (3, "on")])
def test_a_plastic_strain_that_is_given_before_a_minimization(lmp, tmp_path, small, ranks, newton):
    """In force from its start: bonds that hold three times as far do not flow. Without it they do."""
    row = words(FLOWING) + flow_words((0, 1, 0.05, 3))
    text = head(newton) + flowing_pair(fails=None, kv=0, fix="fix bonds all evp/bonds zone 1.4").replace(words(FLOWING), row) + "fix move all nve\nrun 0\nwrite_evp_bonds before.bonds\n"
    text += "region middle block 0.009 0.031 INF INF INF INF units box\ngroup middle region middle\ngroup ends subtract all middle\nfix hold ends setforce 0 0 0\n"
    text += "displace_atoms all ramp x 0 0.0002 x 0 0.04 units box\n{}min_style cg\nmin_modify dmax 1e-4\nminimize 0 1.0 10000 100000\nwrite_evp_bonds after.bonds\n"
    flowed = []
    for given in ("fix_modify bonds plastic_strain all 0.05\n", ""):
        run = lmp(text.format(given), ranks).ok()
        assert "Stopping criterion = force tolerance" in run.stdout
        before, after = (read_pairs(tmp_path / f"{name}.bonds") for name in ("before", "after"))
        flowed.append(sum(after.bonds[key] != deq for key, deq in before.bonds.items()))
        assert not given or set(after.column("plastic_strain").values()) == {0.05}
    assert flowed[0] == 0 < 5 < flowed[1]


# ---- where deq may move

START = head() + flowing_pair(fails=0.15) + SHAKE + MOVE + "run 60\nwrite_evp_bonds before.bonds\n"
AFTER = "write_evp_bonds after.bonds\n"
# the next forces of many pairs are beyond their threshold
PUSH = """
variable px atom x+2e-4*sin(1.7*id)
variable py atom y+2e-4*cos(2.9*id)
set group all x v_px y v_py
"""
NOTHING = "velocity all set 0 0 0\n"
EVALUATE = """compute dt all evp/dt
compute values all pair/local dist force eng p1 p2 p3
compute biggest all reduce max c_values[2] inputs local
thermo_style custom step pe c_dt c_biggest f_bonds[2] f_bonds[5]
run 0
"""

QUIET = {
    "run 0": "run 0\n",
    "run 0 twice, pre no": "run 0\nrun 0 pre no\n",
    "compute evp/dt, pair/local, counts": EVALUATE,
    "write_data": "run 0\nwrite_data some.data\nwrite_restart some.restart\n",
    "minimization stopped by its count": "min_style cg\nmin_modify dmax 1e-5\n" + 2 * "minimize 0 0 4 100\n",
    "minimization stopped by its evaluations": "min_style cg\nmin_modify dmax 1e-5\nminimize 0 0 100 3\n",
    "fire stopped by its count": "min_style fire\nminimize 0 0 5 1000\n",
    "sd of no step": "min_style sd\nminimize 0 0 0 0\n",
    "set-up of a run that does not start": "thermo_style custom step pe\nrun 0\nreset_timestep 0\nrun 0 post no\n",
    "no forces": "neighbor 0.001 bin\nrun 0\n",
}
MOVING = {"a step": NOTHING + "run 1\n", "minimization to its tolerance": "min_style cg\nmin_modify dmax 1e-4\nminimize 0 1e6 1000 10000\n"}


def before_and_after(run):
    return (read_pairs(run.folder / f"{when}.bonds") for when in ("before", "after"))


def test_deq_moves_in_steps_only(lmp_decks, bar):
    """Atoms are moved so that pairs are beyond their thresholds: forces are those of flow, but bond files are the same text. What a minimization
    that stops leaves undone is said once."""
    runs = lmp_decks({name: START + PUSH + lines + AFTER for name, lines in {**QUIET, **MOVING}.items()}, 2)
    for name, run in runs.items():
        before, after = before_and_after(run)
        assert_flowed(before, bar.bonds)
        assert sum("by 'max " in line and "not at rest" in line for line in run.warnings()) == ("minimize" in QUIET.get(name, "")), name
        if name in QUIET:
            assert before == after, name
        else:
            moved = [abs(after.bonds[key] / deq - 1.0) > 1e-5 for key, deq in before.bonds.items() if key in after.bonds]
            assert sum(moved) > 20, f"control: {name}"


@pytest.mark.parametrize("contact", ["none", "repulsive"])
def test_a_run_in_parts_is_the_same(lmp, tmp_path, bar, contact):
    """Set-up finds the forces of the step before, also where bonds have just broken while their particles overlap."""
    start = f"{head()}{flowing_pair(contact, fails=0.15)}{SHAKE}fix move all nve\ntimestep 3e-7\n"
    ends = thermo("pe ke f_bonds[5]") + "thermo 1\n"
    whole = lmp(start + ends + "run 90\nwrite_evp_bonds whole.bonds\n", 1).ok().thermo()
    parts = lmp(start + ends + 18 * "run 5\n" + "write_evp_bonds parts.bonds\n", 1).ok()
    broke = np.diff(whole["f_bonds[5]"])
    assert np.count_nonzero(broke[4::5]) > 3, "control: bonds break at steps where a part ends"
    # each part builds neighbor lists, in which the pairs of an atom stand in another order
    assert largest_difference(*(read_pairs(tmp_path / f"{name}.bonds") for name in ("parts", "whole"))) < 1e-10
    assert parts.thermo()["KinEng"][-1] == pytest.approx(whole["KinEng"][-1], rel=1e-11)


@pytest.mark.parametrize("style, gamma, default, others", [("nve", 0.0, 10, (1, 40)), ("nve/evp", 30.0, 1, (10,))])
def test_steps_between_two_updates(lmp, lmp_decks, tmp_path, small, style, gamma, default, others):
    """As many as ever unless they are given, to the last bit. With other numbers the body moves otherwise, in the same way on any number of MPI ranks and after a
    restart between two updates, which keeps the number."""
    move = MOVE.replace("all nve", f"all {style}")

    def deck(update, newton="on"):
        words_of_style = flowing_pair(row=FLOWING._replace(gamma=gamma)).replace("isotropic", f"isotropic{update}", 1)
        return head(newton) + words_of_style + SHAKE + move + "run 95\nwrite_restart half.restart\nrun 105\nwrite_evp_bonds end.bonds\n"

    runs = lmp_decks({given: deck(f" update {given}" if given else "") for given in (0, default, *others)})
    table = {given: run.thermo() for given, run in runs.items()}
    assert all(np.array_equal(values, table[default][column]) for column, values in table[0].items())
    assert "updated" not in runs[0].stdout and f"plasticity isotropic, limits updated every {default} steps, spheres fail by the damage" in runs[default].stdout
    for given in others:
        assert abs(table[given]["c_flow[1]"][-1] / table[default]["c_flow[1]"][-1] - 1.0) > 1e-5, given
        end = read_pairs(runs[given].folder / "end.bonds")
        assert end.ended > 3 and sum(value > 0.0 for value in end.column("torn").values()) > 3, "control"
        for ranks, newton in ((2, "off"), (3, "on")):
            lmp(deck(f" update {given}", newton), ranks).ok()
            assert largest_difference(read_pairs(tmp_path / "end.bonds"), end) < 1e-8, (given, ranks)
            again = head(newton, start="read_restart half.restart") + f"{BONDS}\nfix volume all evp/volume {KV}\n" + move + "run 105\nwrite_evp_bonds again.bonds\n"
            assert f"limits updated every {given} steps" in lmp(again, ranks - 1).ok().stdout
            assert largest_difference(read_pairs(tmp_path / "again.bonds"), end) < 1e-7, (given, ranks)


# ---- below yield


def cycles(amplitude, fraction, count, steps=100):
    """The right end wiggles along x; timestep from compute evp/dt."""
    return (head() + flowing_pair("none", 0, FLOWING._replace(gamma=300.0), fix="fix bonds all evp/bonds") + grips(0.01, 0.05) + "fix move free nve\n"
            f"compute dt all evp/dt\nthermo_style custom step c_dt\nrun 0\ntimestep $({fraction}*c_dt)\nfix left left move linear 0 0 0\n"
            f"fix right right move wiggle {amplitude} 0 0 $({steps}*dt)\nwrite_evp_bonds before.bonds\nthermo_style custom step pe\nthermo 1000\n"
            f"run {count * steps}\nwrite_evp_bonds after.bonds\n")


def test_a_hundred_cycles_below_yield_leave_nothing(lmp_decks, bar):
    decks = {fraction: cycles(3e-6, fraction, 100) for fraction in (0.1, 0.4, 0.9)}
    runs = lmp_decks({**decks, "control": cycles(3e-4, 0.4, 3)})
    for fraction in decks:
        before, after = before_and_after(runs[fraction])
        assert before == after and set(after.column("plastic_work").values()) <= {0.0}, fraction
    before, after = before_and_after(runs["control"])
    assert max(abs(after.bonds[key] / deq - 1.0) for key, deq in before.bonds.items() if key in after.bonds) > 1e-3, "control: a hundred times as far it yields"


# ---- frames and momenta


CALM = SHAKE + "velocity all zero linear\n"


def test_turned_and_moving_frames(lmp, lmp_decks, tmp_path, bar):
    """The state after flow turned by up to 2 pi, or given a velocity, goes on as before, turned or moved: flow, breaks, energies."""
    write_body(tmp_path / "body.data", bar._replace(box=np.array([[-0.2, 0.3]] * 3)))
    move = MOVE.replace("pxx pyz", "")
    first = lmp(head() + flowing_pair() + CALM + move + dump("all.dump", 60) + "run 60\nwrite_restart half.restart\nrun 60\nwrite_evp_bonds whole.bonds\n").ok()
    half, end = (snapshot for snapshot in first.dump("all.dump") if snapshot.step > 0)
    table = first.thermo()
    assert_flowed(read_pairs(tmp_path / "whole.bonds"), bar.bonds, contacts=0)
    x, v = half.x, half.v
    centre = np.array([0.03, 0.02, 0.02])
    decks = {}
    for angle, speed in ((0.0, 0.0), (0.7, 0.0), (np.pi, 0.0), (5.0, 0.0), (2.0 * np.pi, 0.0), (0.0, 300.0), (1.3, 300.0)):
        turn, state = turn_about(angle), f"state{len(decks)}.dump"
        write_state(tmp_path / state, centre + (x - centre) @ turn.T, v @ turn.T + [speed, -0.5 * speed, 0.0], half.box, half["id"].astype(int))
        decks[angle, speed] = (head(start="read_restart half.restart") + BONDS + "\nfix volume all evp/volume 500\n"
                               f"read_dump {state} 0 x y z vx vy vz box no replace yes\nreset_timestep 60\n" + move + dump("turned.dump", 60)
                               + "run 60\nwrite_evp_bonds turned.bonds\n")
    for (angle, speed), run in lmp_decks(decks).items():
        turn = turn_about(angle)
        last = run.dump("turned.dump")[-1]
        drift = 60 * 3e-7 * np.array([speed, -0.5 * speed, 0.0])
        expected = centre + (end.x - centre) @ turn.T + drift
        assert np.abs(last.x - expected).max() < 1e-10 * 0.08, (angle, speed)
        force = end.f @ turn.T
        assert np.abs(last.f - force).max() < 1e-8 * np.abs(force).max(), (angle, speed)
        assert largest_difference(read_pairs(run.folder / "turned.bonds"), read_pairs(tmp_path / "whole.bonds")) < 1e-8, (angle, speed)
        for name in ("PotEng", "f_volume", "c_flow[2]"):
            assert np.abs(run.thermo()[name] - table[name]).max() <= 1e-8 * np.abs(table[name]).max(), (angle, speed, name)


@pytest.mark.parametrize("style", ["cg", "fire"])
def test_a_pair_without_force_is_at_rest(lmp, tmp_path, style):
    """A bond is stretched past its break strain, where nothing acts, and comes back broken, whichever criterion stopped the minimizer."""
    write_two(tmp_path / "body.data", 0.01)
    run = lmp(head(skin=0.0002) + pair(contact="repulsive break 0.01") + f"""group first id 1
min_style {style}
timestep 1e-6
thermo_style custom step pe f_bonds[1] f_bonds[5]
run 0
displace_atoms first move -0.0002 0 0
minimize 0 1e-3 100 1000
displace_atoms first move 0.00015 0 0
run 0
""", 2).ok()
    table = run.thermo()
    assert (table["PotEng"][-1], table["f_bonds[1]"][-1], table["f_bonds[5]"][-1]) == (0.0, 0.0, 1.0)
