# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of plasticity, of bonds that break and of the volume energy; see robust.py."""

import numpy as np
import pytest
from oracle import flow
from flowing import MOVE, SHAKE, assert_flowed, flowing_pair, largest_difference, read_pairs
from robust import DEQ, MOMENTUM, RADIUS, TABLE1, momenta_changed
from small_bodies import dump, head, lattice_body, mass_of, thermo, two_groups, velocities, words, write_body, write_two

FORCE = TABLE1.m1 * TABLE1.n1 * TABLE1.e1 * TABLE1.xi_s / DEQ  # at the threshold
ROUND_OFF = 1e-9
TOUCHING = 2.0 * RADIUS


def two(bench, style, way, gap=DEQ, fix="fix bonds all evp/bonds", steps=100):
    """Distances and forces of each step of two spheres, of which the second is led along x: F > 0 pushes them apart."""
    write_two(bench.folder / "body.data", gap)
    text = head(skin=0.002) + f"pair_style evp/lj {style}\npair_coeff * * {words(TABLE1)}\n{fix}\n" + two_groups(0.0, 0.0)
    text += f"timestep 1e-6\nrun 0\nfix lead two move {way}\nfix hold one move linear 0 0 0\n"
    text += "compute f two reduce sum fx\nvariable d equal x[2]-x[1]\nthermo 1\n" + thermo("v_d c_f") + f"run {steps}\n"
    table = bench.run(text).ok().thermo()
    return table["v_d"], table["c_f"]


def follow(step, distances, rest, force):
    """q at each of the distances by a return map, and the largest error of the forces over that at xi_s."""
    q, k, expected, flowed = 0.0, 0.0, [], []
    for d in distances:
        now = step(d, rest, TABLE1, q, k)
        q, k = float(now.q), float(now.k)
        expected.append(float(now.force))
        flowed.append(q)
    return flowed, np.abs(force - expected).max() / FORCE


def test_pair_cycled_far_beyond_xi_s(bench):
    """Each force is that of the return map, over five cycles between 4 % of tension and 4 % of compression. Control: the pair flows in tension
    and in compression."""
    d, force = two(bench, "contact none plasticity isotropic", f"wiggle {0.04 * DEQ} 0 0 1e-4", steps=500)
    flowed, off = follow(flow.step, d, DEQ, force)
    assert off < ROUND_OFF
    assert max(flowed) > 0.03 * DEQ and min(flowed) < -0.03 * DEQ
    bench.show(f"error of the force {off:.0e} of that at xi_s, q from {min(flowed) / DEQ:.3f} to {max(flowed) / DEQ:.3f} deq")


def test_contact_pushed_and_parted(bench):
    """A new contact only repels; its flow in compression stays until the spheres separate, and is what it was when they are pushed again before.
    Control: spheres that overlap and have flowed do not touch."""
    (bench.folder / "none.bonds").write_text("# EVP bonds COUNT: 0 UNITS: si\n")
    shown = []
    for gap in (0.96, 0.99):  # of the middle of a cycle of 0.03: the spheres separate in the second run only
        d, force = two(bench, "contact repulsive plasticity isotropic", f"wiggle {-0.03 * TOUCHING} 0 0 1e-4", gap * TOUCHING,
                       "fix bonds all evp/bonds file none.bonds", steps=300)
        flowed, off = follow(flow.contact_step, d, TOUCHING, force)
        assert off < ROUND_OFF
        assert min(flowed) < -0.02 * TOUCHING and flowed[-1] != 0.0 and np.all(force > -ROUND_OFF * FORCE)
        assert (d.max() > TOUCHING) == (gap == 0.99)
        kept = (d < TOUCHING) & (force == 0.0)
        assert kept.sum() > 10, "control: spheres that overlap and have flowed do not touch"
        shown.append(f"error of the force {off:.0e} of that at xi_s, {kept.sum()} steps without force in spite of overlap")
    bench.show("; ".join(shown))


@pytest.mark.parametrize("plasticity", ["none", "isotropic"])
def test_bond_torn_and_pushed_together(bench, plasticity):
    """A bond stretched beyond XI is broken for good: no force until the spheres touch, then the repulsion of a new contact. Control: stretched
    less it stays a bond."""
    way = f"wiggle {0.25 * DEQ} 0 0 2e-4"
    d, force = two(bench, f"contact repulsive plasticity {plasticity} break 0.1", way, steps=200)
    torn = int(np.argmax(d > 1.1 * DEQ))
    apart, touching = d[torn:] > TOUCHING, d[torn:] < TOUCHING
    assert np.all(force[torn:][apart] == 0.0) and apart.sum() > 50
    assert np.all(force[torn:][touching] > -ROUND_OFF * FORCE) and force[torn:][touching].max() > FORCE and touching.sum() > 30
    kept, again = two(bench, f"contact repulsive plasticity {plasticity} break 0.5", way, steps=200)
    assert np.any(again[torn:][kept[torn:] > TOUCHING] < -0.5 * FORCE)
    bench.show(f"no force over {apart.sum()} steps, {force[torn:].max() / FORCE:.1f} of the force at xi_s where they touch")


@pytest.mark.parametrize("breaks", ["none", "0.6"])
def test_bond_past_its_cutoff_in_one_step(bench, breaks):
    """Plastic work of the return map up to the cutoff and after the way back, and the same energy balance, for skins from 1e-9 to 2e-3 m, newton
    on and off. Control: it leaves the neighbor list with the smallest skin, and stays there with the largest."""
    deq, cut, speed = TOUCHING, TABLE1.alpha * TOUCHING, 103.0
    write_two(bench.folder / "body.data", deq)
    torn = flow.step(cut, deq, TABLE1, 0.0, 0.0)
    back = flow.step(deq, deq, TABLE1, torn.q, torn.k)
    work = [float(torn.dissipated), float(torn.dissipated + (back.dissipated if breaks == "none" else 0.0))]
    rows, listed = [], {}
    for skin in (1e-9, 6e-4, 2e-3):
        for newton in ("on", "off"):
            text = head(newton, skin=skin) + f"pair_style evp/lj contact none plasticity isotropic break {breaks}\npair_coeff * * {words(TABLE1)}\nfix bonds all evp/bonds\n"
            text += "fix move all nve/noforce\nfix energy all evp/energy\ntimestep 1e-6\ncompute each all evp/state/atom plastic_work\n"
            text += "compute kept all reduce sum c_each[5]\nthermo 60\n" + thermo("c_kept f_energy f_energy[*]")
            text += two_groups(0.0, speed) + "run 0\nrun 60\n" + f"velocity two set {-speed} 0 0\nrun 60\n"
            run = bench.run(text).ok()
            rows.append([[value[-1] for name, value in run.thermo(k).items() if name != "Step"] for k in (1, 2)])
            listed[skin] = int(run.stdout.split("Total # of neighbors = ")[2].split()[0])
    assert listed[1e-9] == 0 and listed[2e-3] > 0, listed
    rows = np.array(rows)
    off = np.abs(rows[:, :, 0] / work - 1.0).max()
    apart = np.abs(rows - rows[-1]).max() / work[0]
    assert off < 1e-7, "the margin of a cutoff, up to which a bond flows"
    assert np.allclose(rows[:, :, 0], rows[:, :, 10], rtol=1e-12, atol=0.0), "entry 9 of the energy balance"
    assert apart < ROUND_OFF
    bench.show(f"plastic work {rows[0, 0, 0]:.6f} and {rows[0, 1, 0]:.6f} J, error {off:.0e}, skins differ by {apart:.0e}")


def test_flow_in_a_body_whose_atoms_are_sorted(bench):
    """Q and broken bonds stay with their pairs when atoms are sorted and neighbor lists rebuilt at each step. Control: bonds have flowed in
    tension and in compression, and broken."""
    write_body(bench.folder / "body.data", lattice_body((6, 4, 4)))
    text = flowing_pair("none") + SHAKE + MOVE + "{}run 100\nwrite_evp_bonds {}.bonds\n"
    bench.run(head(sort="sort 0 0") + text.format("", "rare")).ok()
    bench.run(head(sort="sort 1 0.004") + text.format("neigh_modify every 1 delay 0 check no\n", "often")).ok()
    rare, often = (read_pairs(bench.folder / f"{name}.bonds") for name in ("rare", "often"))
    assert_flowed(rare, contacts=0)
    difference = largest_difference(often, rare)
    assert difference < 1e-10
    bench.show(f"q and work agree to {difference:.0e}, {len(rare.of(1))} bonds broken")


def test_minimization_that_stops_early(bench):
    """A minimization that stops at its maximum number of iterations leaves no flow. Control: one that converges does."""
    write_body(bench.folder / "body.data", lattice_body((4, 3, 3)))
    text = head() + flowing_pair("none", 0) + "fix move all nve\ntimestep 3e-7\n" + "run 0\nvariable px atom x+3e-4*sin(1.7*id)\nset group all x v_px\n"
    found = {}
    for name, search in (("stopped", "minimize 0 0 6 100"), ("rest", "minimize 0 1e4 1000 10000")):
        bench.run(text + f"min_style cg\nmin_modify dmax 1e-5\n{search}\nwrite_evp_bonds {name}.bonds\n").ok()
        found[name] = np.abs(list(read_pairs(bench.folder / f"{name}.bonds").offset.values())).max()
    assert found["stopped"] == 0.0 and found["rest"] > 1e-5
    bench.show(f"largest q {found['stopped']:.0e} m stopped, {found['rest']:.0e} m converged")


def test_volume_energy_of_a_free_body(bench):
    """Energy conserved to 2e-3 of the change of the volume energy, momentum and angular momentum to 1e-12, in vibrations of a soft network with
    a stiff volume energy. Control: the volume energy changes."""
    body = lattice_body((4, 4, 4))
    write_body(bench.folder / "body.data", body)
    text = head() + flowing_pair("none", 0, TABLE1._replace(xi_s=0.3), 3000.0, plasticity="none") + "fix move all nve\n"
    text += velocities(*(f"0.5*({axis}-0.02)/0.02" for axis in "xyz"))
    text += "compute dt all evp/dt\nthermo 5\n" + thermo("pe ke etotal f_volume c_dt") + "run 0\ntimestep $(0.05*c_dt)\n" + dump(every=600) + "run 600\n"
    run = bench.run(text).ok()
    table, mass = run.thermo(), mass_of(body.radius)
    energy, traded = table["TotEng"], np.ptp(table["f_volume"])
    open_by = np.ptp(energy) / traded
    assert traded > 0.1 * table["KinEng"][0] and open_by < 2e-3
    moved, turned, size = momenta_changed(run, mass)
    off = max(moved / size, turned / (0.04 * size))
    assert off < MOMENTUM
    bench.show(f"energy imbalance {open_by:.0e} of the change of the volume energy, error of the momentum {off:.0e}")
