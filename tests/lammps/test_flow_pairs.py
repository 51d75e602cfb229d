# SPDX-License-Identifier: GPL-2.0-only
"""`plasticity isotropic` of single pairs and of the pairs of a body that was pulled and pushed: q, k, force, energy and plastic work of each,
against tests/oracle/flow.py, which was written apart."""

import numpy as np
import pytest
from evp import law
from oracle import brute, flow
from flowing import read_pairs
from lammps_run import REFERENCE, edited_deck, read_csv, read_dump, run_lammps
from small_bodies import head, words, write_two

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
