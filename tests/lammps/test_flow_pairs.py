# SPDX-License-Identifier: GPL-2.0-only
"""The pairs of a body that was pulled, pushed and pulled again with `plasticity isotropic`: offset, force and plastic work of each, against
tools/evp/flow.py, which was written apart."""

import re

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import brute, flow, law
from lammps_run import read_dump

ROW = law.TABLE1
FORCE = ROW.m1 * ROW.n1 * ROW.e1 * ROW.xi_s / 0.01  # of a pair at its threshold [N]
NAMES = {"d": "c_own[1]", "force": "c_own[2]", "deq": "c_own[3]", "strain": "c_own[4]", "regime": "c_own[5]", "offset": "c_own[6]",
         "work": "c_own[7]",
         "energy": "c_own[8]", "i": "c_who[1]", "j": "c_who[2]"}


@pytest.fixture(scope="module")
def states(tmp_path_factory):
    """{(contact, strain of breaking): states in the order of the way}, each a dict of arrays by pair that acts, sorted by the IDs of its atoms."""
    from lammps_run import run_lammps
    known = {}

    def get(contact, broken="none"):
        if (contact, broken) not in known:
            folder = tmp_path_factory.mktemp("pairs")
            (folder / "pairs.lmp").write_text(
                "compute own all pair/local dist force p1 p2 p3 p4 p5 eng\ncompute who all property/local patom1 patom2 cutoff type\n"
                "dump own all local $(v_steps_per_row) pairs.dump c_own[*] c_who[*]\ndump_modify own format float %.17g\n")
            choices = {"specimen": REFERENCE, "contact": contact, "plasticity": "isotropic", "strain": 0.015, "lower": -0.01, "row": 0.001, "break": broken,
                       "rate": 20, "dtfraction": 0.8, "also": "pairs.lmp", "out": "run"}
            run_lammps("in.cyclic", 1, choices, folder).ok()
            known[contact, broken] = [sorted_pairs(snapshot) for snapshot in read_dump(folder / "pairs.dump")]
        return known[contact, broken]

    return get


def sorted_pairs(snapshot):
    """Columns by name, one row per pair, lower ID first."""
    found = {name: snapshot[column] for name, column in NAMES.items()}
    low, high = np.minimum(found["i"], found["j"]), np.maximum(found["i"], found["j"])
    order = np.lexsort((high, low))
    order = order[found["regime"][order] > 0]  # those that act
    return {**{name: values[order] for name, values in found.items()}, "key": 1e6 * low[order] + high[order]}


@pytest.mark.parametrize("contact", ["none", "literal"])
def test_force_of_each_pair(states, contact):
    """That of the return map from its offset; bonds have their elastic part within the first regime."""
    flowed, beyond = 0, 0
    for state in states(contact):
        q = state["offset"] * state["deq"]
        after = flow.return_map(state["d"], state["deq"], ROW, q)
        force = flow.elastic_force(state["d"], state["deq"], ROW, after)
        assert np.abs(state["force"] - force).max() < 1e-10 * FORCE
        moved = np.abs(after - q) > 1e-12 * state["deq"]
        flowed, beyond = flowed + np.sum(np.abs(q) > 1e-4 * state["deq"]), beyond + np.sum(moved)
        if contact == "none":
            assert not moved.any()
    assert flowed > 1000 and (contact == "none") == (beyond == 0), "control: new contacts that are stretched keep no offset"


@pytest.mark.parametrize("contact, broken", [("literal", "none"), ("repulsive", 0.012), ("none", 0.012)])
def test_force_of_contacts_and_of_broken_bonds(states, reference, contact, broken):
    """New contacts keep compression only, repulsive ones and what is left of broken bonds push only; the others are bonds within their strain
    of breaking."""
    bonds = {1e6 * i + j: deq for (i, j), deq in brute.record_bonds(reference.x, reference.radius, ROW.alpha).items()}
    contacts, left, torn = 0, 0, set()
    for state in states(contact, broken):
        deq = np.array([bonds.get(key, 0.0) for key in state["key"]])
        known, is_bond = deq > 0.0, np.abs(state["deq"] - deq) < 1e-15
        is_new, is_left = ~known, known & ~is_bond
        q = state["offset"] * state["deq"]
        of_bond = flow.step(state["d"], state["deq"], ROW, q).force
        pushing = flow.contact_step(state["d"], state["deq"], ROW, q, state["deq"], repulsive=True).force
        of_new = pushing if contact == "repulsive" else flow.contact_step(state["d"], state["deq"], ROW, q, ROW.alpha * state["deq"]).force
        force = np.where(is_bond, of_bond, np.where(is_new, of_new, pushing))
        assert np.abs(state["force"] - force).max() < 1e-10 * FORCE
        assert np.all(q[~is_bond] <= 0.0)
        if broken != "none":
            assert np.all(state["d"][is_bond] <= (1.0 + broken) * state["deq"][is_bond] * (1.0 + 1e-8))
            assert not torn & set(state["key"][is_bond]), "a broken bond is none again"
            torn |= set(bonds) - set(state["key"][is_bond])
        contacts, left = contacts + is_new.sum(), left + is_left.sum()
    assert contacts > 50 or contact != "literal"
    assert len(torn) > 20 or broken == "none"
    assert (left > 0) == (broken != "none" and contact != "none"), "control: what is left of broken bonds is pushed"


def test_plastic_work_is_the_dissipation_of_the_flow(states):
    """Of pairs that went one way between two rows; it never falls."""
    before, compared = None, 0
    for state in states("none"):
        if before is not None:
            _, old, new = np.intersect1d(before["key"], state["key"], return_indices=True)
            q0, q1, deq = before["offset"][old] * before["deq"][old], state["offset"][new] * state["deq"][new], state["deq"][new]
            done = state["work"][new] - before["work"][old]
            assert done.min() >= 0.0
            least = flow.dissipated(q0, q1, deq, ROW)
            scale = FORCE * 0.01 * ROW.xi_s
            assert np.all(done >= least - 1e-9 * scale), "what a vibration dissipated besides is never negative"
            same = np.abs(done - least) < 1e-7 * scale + 1e-6 * least
            assert same[q0 == q1].mean() > 0.9
            compared += np.sum(same & (q0 != q1))
        before = state
    assert compared > 1000


def test_energy_of_contacts(states, reference):
    """Above that at dlim, of a literal contact: compression that is kept dissipates no more, a stretched one follows eq. 8."""
    bonds = brute.record_bonds(reference.x, reference.radius, ROW.alpha)
    known = np.array([1e6 * i + j for i, j in bonds])
    pulled = 0
    for state in states("literal"):
        is_new = ~np.isin(state["key"], known)
        d, deq, q, energy = (state[name][is_new] for name in ("d", "deq", "offset", "energy"))
        q = q * deq
        dlim = ROW.alpha * deq
        after = flow.return_map(d, deq, ROW, q)
        there = flow.return_map(dlim, deq, ROW, after)
        kept = np.minimum(after, 0.0)
        held = flow.stored(d, deq, ROW, after) + flow.dissipated(kept, after, deq, ROW)
        lost = flow.stored(dlim, deq, ROW, there) + flow.dissipated(0.0, there, deq, ROW)
        assert np.abs(energy - (held - lost)).max(initial=0.0) < 1e-11 * ROW.e1 * ROW.m1 * ROW.n1
        never = (q == 0.0) & (after >= 0.0)
        assert np.abs(energy - law.energy(d, deq, ROW, dlim))[never].max(initial=0.0) < 1e-11 * ROW.e1 * ROW.m1 * ROW.n1
        pulled += np.sum(after > 0.0)
    assert pulled > 100, "control"


@pytest.mark.parametrize("newton, ranks", [("on", 1), ("off", 2)])
def test_minimization_with_a_stretched_contact(lmp, newton, ranks):
    """It ends where a spring holds the contact, by eq. 8, within the force tolerance."""
    spring, away = 3e7, 0.0026
    run = lmp(f"""
units si
atom_style sphere
atom_modify map yes
newton {newton}
boundary f f f
region box block -0.01 0.03 -0.01 0.01 -0.01 0.01
create_box 1 box
create_atoms 1 single 0 0 0
create_atoms 1 single 0.0029 0 0
set group all diameter 0.002 density 2700
neighbor 0.0001 bin
group one id 1
group two id 2
pair_style evp/lj contact literal plasticity isotropic
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.5
fix b all evp/bonds zone 1.05
fix hold one setforce 0 0 0
fix pull two spring tether {spring} {away} 0 0 0
fix_modify pull energy yes
min_modify dmax 0.0001
thermo_style custom step pe f_b
variable d equal x[2]-x[1]
minimize 0 1e-6 1000 10000
print "ends at $(v_d:%.15g) with $(f_b) bonds, $(pe:%.15g) J"
""", ranks).ok()
    assert "Stopping criterion = force tolerance" in run.stdout
    d, count, energy = (float(word) for word in re.search(r"ends at (\S+) with (\S+) bonds, (\S+) J", run.stdout).groups())
    assert count == 0
    low, high = 0.00201, away  # the law pulls the spheres together
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spring * (away - middle) + law.force(middle, 0.002, ROW) > 0.0 else (low, middle)
    assert d == pytest.approx(low, rel=1e-11)
    assert energy == pytest.approx(law.energy(low, 0.002, ROW, 0.003) + 0.5 * spring * (away - low) ** 2, rel=1e-10)
