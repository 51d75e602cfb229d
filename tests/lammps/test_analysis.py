# SPDX-License-Identifier: GPL-2.0-only
"""What users look at with LAMMPS' own computes and dumps, against the sum over all pairs."""

import numpy as np
from oracle import law
from small_bodies import MOVE, ROUND_OFF, STIR, head, pair, truth, words


def test_state_of_each_atom(lmp_decks, bar):
    """compute evp/state/atom: pairs recorded, share in the second regime, share beyond dlim, new pairs; the same
    counts from the sum over all pairs, exactly. A group's compute gives the same to its atoms and zero to others.
    On other ranks: test_matrix.py."""
    bar = bar._replace(bonds={pair: deq for pair, deq in bar.bonds.items() if max(pair) <= 80})
    decks = {contact: head("off") + "group bonded id <= 80\n" + pair(contact=contact, fix="fix bonds bonded evp/bonds") + STIR + MOVE + """
group low id <= 40
compute all all evp/state/atom
compute low low evp/state/atom
dump all all custom 50 all.dump id x y z vx vy vz fx fy fz c_all[*] c_low[*]
dump_modify all format float %.17g
run 100
""" for contact in ("literal", "repulsive", "none")}
    recorded = np.bincount(np.array(list(bar.bonds)).ravel() - 1, minlength=len(bar.x))
    for contact, snapshot in ((contact, snapshot) for contact, run in lmp_decks(decks, 2).items() for snapshot in run.dump("all.dump")):
        found = truth(snapshot.vectors("x", "y", "z"), snapshot.vectors("vx", "vy", "vz"), bar, contact=contact)
        bonded = np.array([(i + 1, j + 1) in bar.bonds for i, j in zip(found["i"], found["j"])])
        second = bonded & (np.abs(found["d"] / found["deq"] - 1.0) > law.TABLE1.xi_s)
        count = {name: np.bincount(np.concatenate([found["i"][chosen], found["j"][chosen]]), minlength=len(bar.x))
                 for name, chosen in (("within", bonded), ("second", second), ("new", ~bonded))}
        state = snapshot.vectors(*(f"c_all[{k}]" for k in range(1, 5)))
        assert np.array_equal(state[:, 0], recorded)
        assert 0 < np.sum(recorded == 0.0) < len(bar.x)
        assert np.array_equal(np.rint(state[:, 1] * recorded), count["second"])
        assert np.array_equal(np.rint((1.0 - state[:, 2]) * recorded), count["within"])
        assert np.allclose(state[:, 1:3] * recorded[:, None], np.rint(state[:, 1:3] * recorded[:, None]), rtol=0.0, atol=ROUND_OFF)
        assert np.array_equal(state[:, 3], count["new"])
        low = snapshot.vectors(*(f"c_low[{k}]" for k in range(1, 5)))
        assert np.array_equal(low[:40], state[:40]) and not np.any(low[40:])
        if snapshot.step == 100:
            assert 20 < second.sum() < bonded.sum() - 20 and count["within"].sum() < recorded.sum(), "control: there is something to see"
            assert (count["new"].sum() > 0) == (contact != "none")


def test_pair_local_beside_another_style(lmp, bar):
    """In hybrid/overlay p1 p2 p3 are ours when our pair_coeff line is the last of the pair (LAMMPS shows zeros otherwise),
    for distances within our largest dlim (beyond it LAMMPS shows the pair before); dist, energy and force are those of both styles together."""
    coeffs = f"pair_style hybrid/overlay evp/lj lj/cut 0.015\npair_coeff * * lj/cut 2 0.009\npair_coeff * * evp/lj {words(law.TABLE1)}\n"
    run = lmp(head("off") + coeffs + "fix bonds all evp/bonds\n" + STIR + MOVE + """
compute ids all property/local patom1 patom2
compute pairs all pair/local p3 dist p1 eng p2 force
dump all all custom 100 all.dump id x y z
dump_modify all format float %.17g
dump pairs all local 100 pairs.dump c_ids[1] c_ids[2] c_pairs[*]
dump_modify pairs format float %.17g
run 100
""", ranks=3).ok()
    x = run.dump("all.dump")[-1].vectors("x", "y", "z")
    table = run.dump("pairs.dump")[-1]
    i, j = (table[f"c_ids[{k}]"].astype(int) - 1 for k in (1, 2))
    regime, d, deq, energy, strain, force = (table[f"c_pairs[{k}]"] for k in range(1, 7))
    assert np.allclose(d, np.linalg.norm(x[i] - x[j], axis=1), rtol=ROUND_OFF, atol=0.0)
    sums = bar.radius[i] + bar.radius[j]
    assert np.allclose(deq, [bar.bonds.get((min(a, b) + 1, max(a, b) + 1), s) for a, b, s in zip(i, j, sums)], rtol=ROUND_OFF, atol=0.0)
    assert np.allclose(strain, (d - deq) / deq, rtol=0.0, atol=ROUND_OFF)
    acts = d <= 1.5 * sums
    assert np.array_equal(regime, np.where(acts, law.regime(d, deq, law.TABLE1), 0))
    s = 0.009 / d
    ours = np.where(acts, law.force(d, deq, law.TABLE1), 0.0), np.where(acts, law.energy(d, deq, law.TABLE1, 1.5 * sums), 0.0)
    theirs = 48.0 / d * (2.0 * s**12 - s**6) * (d < 0.015), 8.0 * (s**12 - s**6) * (d < 0.015)
    scale = 8 * 4 * 80 * 0.005 / 0.01  # the yield force: what round-off is measured by where a pair has no force
    assert np.all(np.abs(force - ours[0] - theirs[0]) <= ROUND_OFF * (scale + np.abs(ours[0]) + np.abs(theirs[0])))
    assert np.all(np.abs(energy - ours[1] - theirs[1]) <= ROUND_OFF * (np.abs(ours[1]) + np.abs(theirs[1]) + 80.0))
    assert set(regime) == {0.0, 1.0, 2.0}, "control"
