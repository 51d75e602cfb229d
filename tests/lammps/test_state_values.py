# SPDX-License-Identifier: GPL-2.0-only
"""compute evp/state/atom and LAMMPS' compute pair/local against the sum over all pairs. Of the further columns: plastic work and strain by
tools/evp/law.py, which was written apart, stresses from the forces of all pairs."""

import numpy as np
import pytest
from evp.law import flow_bond
from flowing import BONDS, read_pairs
from oracle import brute, law
from small_bodies import ANOTHER_ORDER, MOVE, ROUND_OFF, STIR, dump, head, lattice_body, pair, thermo, truth, with_images, words, write_body

ROW = law.TABLE1
NAMES = ("plastic_work", "plastic_strain", "von_mises", "triaxiality")
FRACTION = 0.55
STATE = f"compute state all evp/state/atom {' '.join(NAMES)} fraction {FRACTION}\n"
TITLES = "dump_modify all ${state_titles}\n"
STRETCH = np.array([1.03, 0.99, 1.0])


@pytest.fixture
def periodic(tmp_path):
    body = lattice_body((5, 4, 4), periodic="xyz")
    write_body(tmp_path / "body.data", body)
    return body


def bonds_of(body, x, cell):
    """i, j, deq and the vector from j to i of all bonds at positions x, each once."""
    places, owner = with_images(x, 4.0 * body.radius.max(), cell)
    near = brute.find_pairs(places, body.radius[owner], 1.7)
    low, high = np.minimum(owner[near.i], owner[near.j]), np.maximum(owner[near.i], owner[near.j])
    wanted = ((near.i < len(x)) | (near.j < len(x))) & np.array([(a + 1, b + 1) in body.bonds for a, b in zip(low, high)])
    _, first = np.unique(low[wanted] * len(x) + high[wanted], return_index=True)
    i, j = owner[near.i][wanted][first], owner[near.j][wanted][first]
    deq = np.array([body.bonds[min(a, b) + 1, max(a, b) + 1] for a, b in zip(i, j)])
    assert len(i) == len(body.bonds)
    return i, j, deq, near.r[wanted][first]


def sums(i, j, values, n, to_j=None):
    """Of each atom, over its bonds; to_j: what j gets, default the same."""
    total = np.zeros((n, *values.shape[1:]))
    np.add.at(total, i, values)
    np.add.at(total, j, values if to_j is None else to_j)
    return total


def test_a_body_that_was_stretched_and_flowed(lmp, periodic):
    """All bonds flow once, as flow is exact for any increment, and p follows at step 10. Zero outside the group."""
    n = len(periodic.x)
    scale = " ".join(f"{axis} scale {factor}" for axis, factor in zip("xyz", STRETCH))
    run = lmp(head("off", "p p p") + pair(ROW, "none plasticity isotropic") + f"run 0\nchange_box all {scale} remap\nfix hold all nve/noforce\ntimestep 1e-30\n"
              + STATE + "group few id <= 20\ncompute few few evp/state/atom plastic_strain\n"
              + dump(every=10, columns="x y z c_few[*] c_state[*]") + TITLES + "run 10\n", ranks=2).ok()
    snapshot = run.dump("all.dump")[-1]
    i, j, deq, r = bonds_of(periodic, snapshot.x, periodic.cell * STRETCH[:, None])
    d = np.linalg.norm(r, axis=1)
    dlim = ROW.alpha * (periodic.radius[i] + periodic.radius[j])
    unit, acts = r / d[:, None], d <= dlim
    flowed = flow_bond(np.minimum(d, dlim), deq, ROW, ROW.xi_s)
    found = {name: snapshot[name] for name in NAMES}

    work, p = 0.5 * sums(i, j, flowed.dissipated, n), sums(i, j, flowed.slip, n) / sums(i, j, np.ones(len(i)), n) / 0.31
    whole = sums(i, j, ~acts, n) == 0.0  # else a bond flowed up to its cut-off, which has a margin of 2e-9
    assert 10 < whole.sum() < n and work.min() > 0.0 and p.min() > 0.005, "control"
    for name, values in (("plastic_work", work), ("plastic_strain", p)):
        assert np.allclose(found[name][whole], values[whole], rtol=1e-10) and np.allclose(found[name], values, rtol=1e-7), name
    assert np.array_equal(snapshot["c_few[5]"], np.where(np.arange(n) < 20, found["plastic_strain"], 0.0))

    i, j, r, unit = (values[acts] for values in (i, j, r, unit))
    stress = -0.5 * sums(i, j, flowed.force[acts, None, None] * r[:, :, None] * unit[:, None, :], n)  # times volume, positive in tension
    stress = stress + sums(i, j, stress[j], n, stress[i])  # over the atom and those that it is bonded to
    mean = np.trace(stress, axis1=1, axis2=2) / 3.0
    mises = np.sqrt(1.5 * np.sum((stress - mean[:, None, None] * np.eye(3))**2, axis=(1, 2)))
    volume = 4.0 / 3.0 * np.pi * periodic.radius**3 / FRACTION
    share = volume + sums(i, j, volume[j], n, volume[i])
    assert np.allclose(found["von_mises"], mises / share, rtol=1e-10)
    assert np.allclose(found["triaxiality"], mean / mises, rtol=1e-9, atol=1e-9)
    assert mean.mean() > 0.0, "control: a body that is pulled"


@pytest.mark.parametrize("factor, kv", [(0.99, 500), (1.02, 0)])
def test_a_body_that_swells(lmp, periodic, factor, kv):
    """volume_strain is that of fix evp/volume, by the densities: 3 (factor - 1) of each atom to first order, also where it only measures."""
    scale = " ".join(f"{axis} scale {factor}" for axis in "xyz")
    run = lmp(head(boundary="p p p") + pair() + f"fix volume all evp/volume {kv}\nrun 0\nchange_box all {scale} remap\n"
              "fix hold all nve/noforce\ncompute state all evp/state/atom volume_strain\n"
              + dump(every=1, columns="f_volume c_state[*]") + TITLES + "run 0\n").ok()
    snapshot = run.dump("all.dump")[-1]
    assert np.allclose(snapshot["volume_strain"], 3.0 * (factor - 1.0), rtol=5.0 * abs(factor - 1.0))
    assert np.array_equal(snapshot["f_volume"], snapshot["volume_strain"])


def test_work_of_bonds_that_end_and_contacts(lmp, bar):
    """In a run with flow, bonds that end and new contacts: plastic strain and work of all atoms are what the bond file says, and entry 9 of the energy balance."""
    writes = "".join(f"run 100\nwrite_evp_bonds {step}.bonds\n" for step in (100, 200))
    text = head("off") + pair(ROW, "repulsive plasticity isotropic", BONDS + "\n") + STIR.replace("15*", "40*").replace("500*", "5000*") + MOVE + STATE
    text += "fix energy all evp/energy\n" + thermo("f_energy[9] f_energy[11]")
    run = lmp(text + dump(every=100, columns="c_state[*]") + TITLES + writes, ranks=2).ok()
    snapshots = {snapshot.step: snapshot for snapshot in run.dump("all.dump")}
    for step, block in ((100, 0), (200, 1)):
        pairs, table = read_pairs(run.folder / f"{step}.bonds"), run.thermo(block)
        for name in ("plastic_work", "plastic_strain"):
            found, expected = snapshots[step][name], np.zeros(len(bar.x))
            for sphere, value in pairs.column(name).items():
                expected[sphere - 1] = value
            assert np.allclose(found, expected, rtol=ANOTHER_ORDER, atol=0.0) and expected.max() > 0.0, name
        assert snapshots[step]["plastic_work"].sum() == pytest.approx(table["f_energy[9]"][-1], rel=ANOTHER_ORDER)
    assert table["f_energy[11]"][-1] > 0.0 and pairs.ended > 3 and len(pairs.contacts) > 0, "control: bonds, broken ones and contacts"


# ---- counts, and values of pairs ----


def test_state_of_each_atom(lmp_decks, bar):
    """compute evp/state/atom: pairs recorded, share in the second regime, share beyond dlim, new pairs; the same
    counts from the sum over all pairs, exactly. A group's compute gives the same to its atoms and zero to others.
    On other ranks: test_matrix.py."""
    bar = bar._replace(bonds={pair: deq for pair, deq in bar.bonds.items() if max(pair) <= 80})
    decks = {contact: head("off") + "group bonded id <= 80\n" + pair(contact=contact, fix="fix bonds bonded evp/bonds") + STIR + MOVE + """
group low id <= 40
compute all all evp/state/atom
compute low low evp/state/atom
""" + dump(columns="x y z vx vy vz c_all[*] c_low[*]") + "run 100\n" for contact in ("literal", "repulsive", "none")}
    recorded = np.bincount(np.array(list(bar.bonds)).ravel() - 1, minlength=len(bar.x))
    for contact, snapshot in ((contact, snapshot) for contact, run in lmp_decks(decks, 2).items() for snapshot in run.dump("all.dump")):
        found = truth(snapshot.x, snapshot.v, bar, contact=contact)
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


@pytest.mark.parametrize("style", ["hybrid", "hybrid/omp"])
def test_pair_local_in_hybrid(lmp, bar, style):
    """LAMMPS before 2026 copies p1 ... of a sub-style without end: an error, no crash, by whatever name the style goes."""
    coeffs = f"pair_style {style} evp/lj\npair_coeff * * evp/lj {words(law.TABLE1)}\n"
    run = lmp(head("off") + coeffs + "fix bonds all evp/bonds\n" + MOVE + "compute pairs all pair/local p1\ndump 1 all local 1 pairs.dump c_pairs\nrun 1\n")
    assert run.returncode != 0 and "ERROR: Pair style does not have extra field" in run.stdout


def test_pair_local_beside_another_style(lmp, bar):
    """In hybrid/overlay p1 p2 p3 are ours when our pair_coeff line is the last of the pair (LAMMPS shows zeros otherwise),
    for distances within our largest dlim (beyond it LAMMPS shows the pair before); dist, energy and force are those of both styles together."""
    coeffs = f"pair_style hybrid/overlay evp/lj lj/cut 0.015\npair_coeff * * lj/cut 2 0.009\npair_coeff * * evp/lj {words(law.TABLE1)}\n"
    run = lmp(head("off") + coeffs + "fix bonds all evp/bonds\n" + STIR + MOVE + """
compute ids all property/local patom1 patom2
compute pairs all pair/local p3 dist p1 eng p2 force
""" + dump(every=100) + """dump pairs all local 100 pairs.dump c_ids[1] c_ids[2] c_pairs[*]
dump_modify pairs format float %.17g
run 100
""", ranks=3).ok()
    x = run.dump("all.dump")[-1].x
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
