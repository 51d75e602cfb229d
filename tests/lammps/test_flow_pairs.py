# SPDX-License-Identifier: GPL-2.0-only
"""`plasticity isotropic` of single pairs and of the pairs of a body that was pulled and pushed: q, k, force, energy and plastic work of each,
against tests/oracle/flow.py, which was written apart. Where q of pairs may move, cycles below yield, and that flow keeps to its frame."""

import numpy as np
import pytest
from evp import law
from oracle import brute, flow
from flowing import BONDS, MOVE, SHAKE, assert_flowed, flowing_pair, largest_difference, read_pairs
from flowing import ROW as FLOWING
from lammps_run import REFERENCE, edited_deck, read_csv, read_dump, run_lammps, write_state
from small_bodies import dump, grips, head, pair, thermo, turn_about, words, write_body, write_two

ROW = law.TABLE1
FORCE = ROW.m1 * ROW.n1 * ROW.e1 * ROW.xi_s / 0.01  # of a pair at its threshold [N]
NAMES = {"d": "c_own[1]", "force": "c_own[2]", "deq": "c_own[3]", "strain": "c_own[4]", "regime": "c_own[5]", "q": "c_own[6]",
         "work": "c_own[7]", "energy": "c_own[8]", "i": "c_who[1]", "j": "c_who[2]"}


# ---- one pair, led to random distances

DEQ = 0.011
LED = """
fix hold all nve/noforce
timestep 1e-12
run 0
variable target file targets.txt
compute own all pair/local dist force eng p3 p4 p5
compute sums all reduce sum c_own[1] c_own[2] c_own[3] c_own[4] c_own[5] c_own[6] inputs local
thermo_style custom step c_sums[*]
print "d,force,energy,regime,q,work" file way.csv screen no
label again
variable place equal ${target}
set atom 2 x $(v_place:%.17g)
run 1 post no
print "$(c_sums[1]:%.17g),$(c_sums[2]:%.17g),$(c_sums[3]:%.17g),$(c_sums[4]),$(c_sums[5]:%.17g),$(c_sums[6]:%.17g)" append way.csv screen no
next target
jump SELF again
write_evp_bonds end.bonds
"""


@pytest.mark.parametrize("e2, saturation, same_work", [(3.0, 0.0, 1e-10), (9.0, 0.02, 1e-6)])
def test_a_pair_through_random_reversals(lmp, tmp_path, e2, saturation, same_work):
    """300 of them (2000: tests/unit), each in one timestep; the scalar map to 1e-12. same_work: the integral of the dissipation has few points with saturation."""
    row = ROW._replace(e2=e2)
    targets = np.random.default_rng(7).uniform(-0.03, 0.03, 300) * DEQ
    write_two(tmp_path / "body.data", DEQ)
    (tmp_path / "targets.txt").write_text("".join(f"{0.5 * DEQ + target:.17g}\n" for target in targets))
    style = f"pair_style evp/lj contact none plasticity isotropic\npair_coeff * * {words(row)} saturation {saturation}\nfix bonds all evp/bonds\n"
    lmp(head("off", skin=0.002) + style + LED, 2).ok()
    found, q, k, work = read_csv(tmp_path / "way.csv"), 0.0, 0.0, 0.0
    expected = []
    for d in found["d"]:
        now = flow.step(d, DEQ, row, q, k, saturation)
        q, k, work = float(now.q), float(now.k), work + float(now.dissipated)
        expected.append((q / DEQ, float(now.force), float(flow.stored(d, DEQ, row, q)), work))
    q_strain, force, stored, works = np.array(expected).T
    assert len(found["d"]) == 300 and np.ptp(q_strain) > 0.005, "control"
    assert np.abs(found["q"] - q_strain).max() < 1e-12
    assert np.abs(found["force"] - force).max() < 1e-9 * FORCE
    assert np.abs(found["energy"] - stored).max() < 1e-11 * row.e1 * row.m1 * row.n1 * row.xi_s
    assert found["work"] == pytest.approx(works, rel=same_work) and np.all(np.diff(found["work"]) >= 0.0)
    assert np.all(found["regime"] == 1 + (works > 0.0))
    assert list(read_pairs(tmp_path / "end.bonds").k.values()) == pytest.approx([k], rel=1e-12)


# ---- the pairs of a body


def states(folder, contact, broken):
    """In the order of the way: each a dict of arrays by pair that acts, sorted by the IDs of its atoms; q is a length."""
    dumped = ("compute own all pair/local dist force p1 p2 p3 p4 p5 eng\ncompute who all property/local patom1 patom2 cutoff type\n"
              "dump own all local $(10*v_every) pairs.dump c_own[*] c_who[*]\ndump_modify own format float %.17g\n")
    choices = {"specimen": REFERENCE, "contact": contact, "plasticity": "isotropic", "strain": 0.015, "lower": -0.01, "break": broken,
               "rate": 20, "dtfraction": 0.8, "out": "run"}
    run_lammps(edited_deck("in.cyclic", folder, "label           leg\n", dumped + "label leg\n"), 1, choices, folder).ok()
    for snapshot in read_dump(folder / "pairs.dump"):
        found = {name: snapshot[column] for name, column in NAMES.items()}
        found["q"] = found["q"] * found["deq"]
        key = 1e6 * np.minimum(found["i"], found["j"]) + np.maximum(found["i"], found["j"])
        order = np.argsort(key)
        order = order[found["regime"][order] > 0]  # those that act
        yield {**{name: values[order] for name, values in found.items()}, "key": key[order]}


@pytest.mark.parametrize("contact, broken", [("none", "none"), ("repulsive", 0.012)])
def test_force_and_energy_of_each_pair(tmp_path, reference, contact, broken):
    """Bonds: F_I(d - q) and Psi. New contacts and what is left of broken bonds repel only; the others are bonds within their strain of breaking."""
    bonds = {1e6 * i + j: deq for (i, j), deq in brute.record_bonds(reference.x, reference.radius, ROW.alpha).items()}
    flowed, others, torn = 0, 0, set()
    for state in states(tmp_path, contact, broken):
        d, deq, q = state["d"], state["deq"], state["q"]
        is_bond = np.abs(deq - np.array([bonds.get(key, 0.0) for key in state["key"]])) < 1e-15
        force = flow.elastic_force(d, deq, ROW, q)
        force = np.where(is_bond, force, np.maximum(force, 0.0))
        energy = np.where(is_bond, flow.stored(d, deq, ROW, q), flow.contact_stored(d, deq, ROW, q))
        assert np.abs(state["force"] - force).max() < 1e-10 * FORCE
        assert np.abs(state["energy"] - energy).max() < 1e-11 * ROW.e1 * ROW.m1 * ROW.n1
        assert np.all(q[~is_bond] <= 0.0)
        assert np.array_equal(state["regime"] == 2, state["work"] > 0.0)
        if broken != "none":
            assert np.all(d[is_bond] <= (1.0 + broken) * deq[is_bond] * (1.0 + 1e-8))
            assert not torn & set(state["key"][is_bond]), "a broken bond is none again"
            torn |= set(bonds) - set(state["key"][is_bond])
        flowed, others = flowed + np.sum(np.abs(q) > 1e-4 * deq), others + np.sum(~is_bond)
    assert flowed > 1000 and (others > 0) == (contact != "none") and (len(torn) > 20) == (broken != "none"), "control"


# ---- where q may move

START = head() + flowing_pair() + SHAKE + MOVE + "run 60\nwrite_evp_bonds before.bonds\n"
AFTER = "write_evp_bonds after.bonds\n"
# the next forces of many pairs are beyond their threshold
PUSH = """
variable px atom x+2e-4*sin(1.7*id)
variable py atom y+2e-4*cos(2.9*id)
set group all x v_px y v_py
"""
NOTHING = "velocity all set 0 0 0\n"
EVALUATE = """compute dt all evp/dt
compute own all pair/local dist force eng p1 p2 p3 p4 p5
compute biggest all reduce max c_own[2] inputs local
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


def test_offsets_move_in_steps_only(lmp_decks, bar):
    """Atoms are moved so that pairs are beyond their thresholds: forces are those of the return map, but bond files are the same text. What a minimization
    that stops leaves undone is said once."""
    runs = lmp_decks({name: START + PUSH + lines + AFTER for name, lines in {**QUIET, **MOVING}.items()}, 2)
    for name, run in runs.items():
        before, after = before_and_after(run)
        assert_flowed(before)
        assert sum("by 'max " in line and "not at rest" in line for line in run.warnings()) == ("minimize" in QUIET.get(name, "")), name
        if name in QUIET:
            assert before == after, name
        else:
            moved = [abs(after.offset[key] - before.offset[key]) > 1e-5 * before.deq[key] for key in before.of(0)]
            assert sum(moved) > 20, f"control: {name}"


@pytest.mark.parametrize("contact", ["none", "repulsive"])
def test_a_run_in_parts_is_the_same(lmp, tmp_path, bar, contact):
    """Set-up finds the forces of the step before, also where bonds have just broken while their particles overlap."""
    start = f"{head()}{flowing_pair(contact, broken=0.04)}{SHAKE}fix move all nve\ntimestep 3e-7\n"
    ends = thermo("pe ke f_bonds[5]") + "thermo 1\n"
    whole = lmp(start + ends + "run 90\nwrite_evp_bonds whole.bonds\n", 1).ok().thermo()
    parts = lmp(start + ends + 15 * "run 6\n" + "write_evp_bonds parts.bonds\n", 1).ok()
    broke = np.diff(whole["f_bonds[5]"])
    assert np.count_nonzero(broke[5::6]) > 3, "control: bonds break at steps where a part ends"
    # each part builds neighbor lists, in which the pairs of an atom stand in another order
    assert largest_difference(*(read_pairs(tmp_path / f"{name}.bonds") for name in ("parts", "whole"))) < 1e-10
    assert parts.thermo()["KinEng"][-1] == pytest.approx(whole["KinEng"][-1], rel=1e-11)


# ---- below yield


def cycles(amplitude, fraction, count, steps=100):
    """The right end wiggles along x; timestep from compute evp/dt."""
    return (head() + flowing_pair("none", 0, FLOWING._replace(gamma=300.0), fix="fix bonds all evp/bonds") + grips(0.01, 0.05) + "fix move free nve\n"
            f"compute dt all evp/dt\nthermo_style custom step c_dt\nrun 0\ntimestep $({fraction}*c_dt)\nfix left left move linear 0 0 0\n"
            f"fix right right move wiggle {amplitude} 0 0 $({steps}*dt)\nwrite_evp_bonds before.bonds\nthermo_style custom step pe\nthermo 1000\n"
            f"run {count * steps}\nwrite_evp_bonds after.bonds\ncompute own all pair/local p2 p4\n"
            "compute most all reduce maxabs c_own[1] c_own[2] inputs local\nthermo_style custom step pe c_most[2]\nrun 0\n")


def test_a_hundred_cycles_below_yield_leave_nothing(lmp_decks, bar):
    decks = {fraction: cycles(3e-6, fraction, 100) for fraction in (0.1, 0.4, 0.9)}
    runs = lmp_decks({**decks, "control": cycles(3e-4, 0.4, 3)})
    for fraction in decks:
        before, after = before_and_after(runs[fraction])
        assert before == after and set(after.offset.values()) == {0.0} and set(after.work.values()) == {0.0}, fraction
        assert runs[fraction].thermo()["c_most[2]"][-1] == 0.0, fraction
    _, after = before_and_after(runs["control"])
    assert max(map(abs, after.offset.values())) > 1e-5, "control: a hundred times as far it yields"


# ---- frames and momenta


CALM = SHAKE + "velocity all zero linear\n"


def test_turned_and_moving_frames(lmp, lmp_decks, tmp_path, bar):
    """The state after flow turned by up to 2 pi, or given a velocity, goes on as before, turned or moved: flow, breaks, energies."""
    write_body(tmp_path / "body.data", bar._replace(box=np.array([[-0.2, 0.3]] * 3)))
    move = MOVE.replace("pxx pyz", "")
    first = lmp(head() + flowing_pair() + CALM + move + dump("all.dump", 60) + "run 60\nwrite_restart half.restart\nrun 60\nwrite_evp_bonds whole.bonds\n").ok()
    half, end = (snapshot for snapshot in first.dump("all.dump") if snapshot.step > 0)
    table = first.thermo()
    assert_flowed(read_pairs(tmp_path / "whole.bonds"), contacts=0)
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
