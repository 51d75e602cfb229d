# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of plasticity, of bonds that fail and of the volume energy; see robust.py."""

import numpy as np
import pytest
from flowing import MOVE, SHAKE, assert_flowed, failing_at, flowing_pair, largest_difference, lead, read_pairs
from robust import DEQ, LEDGER_SHARE, MOMENTUM, RADIUS, TABLE1, momenta_changed
from small_bodies import dump, head, lattice_body, mass_of, thermo, two_groups, velocities, words, write_body, write_two

FORCE = TABLE1.m1 * TABLE1.n1 * TABLE1.e1 * TABLE1.xi_s / DEQ  # at the threshold
ROUND_OFF = 1e-9
TOUCHING = 2.0 * RADIUS


def two(bench, style, way, gap=DEQ, fix="fix bonds all evp/bonds", steps=100, more="", row=""):
    """Distances, forces and more columns of each step of two spheres, of which the second is led along x: F > 0 pushes them apart."""
    write_two(bench.folder / "body.data", gap)
    text = head(skin=0.002) + f"pair_style evp/lj {style}\npair_coeff * * {words(TABLE1)}{row}\n{fix}\n" + two_groups(0.0, 0.0)
    text += f"timestep 1e-6\nrun 0\nfix lead two move {way}\nfix hold one move linear 0 0 0\n"
    text += "compute f two reduce sum fx\nvariable d equal x[2]-x[1]\nthermo 1\n" + thermo(f"v_d c_f {more}") + f"run {steps}\n"
    table = bench.run(text).ok().thermo()
    return [table[name] for name in ("v_d", "c_f", *more.split())]


def off_by(led, force):
    """The largest error of the forces over that at xi_s."""
    return np.abs(force - led.force).max() / FORCE


def test_pair_cycled_far_beyond_xi_s(bench):
    """Each force is that of flow and hardening, over five cycles between 4 % of tension and 4 % of compression. Control: deq grows and shrinks."""
    d, force = two(bench, "contact none plasticity isotropic", f"wiggle {0.04 * DEQ} 0 0 1e-4", steps=500)
    led = lead(d, DEQ, TABLE1, first=0)
    off = off_by(led, force)
    assert off < ROUND_OFF
    assert led.deq.max() > 1.02 * DEQ and led.deq.min() < 0.98 * DEQ
    bench.show(f"error of the force {off:.0e} of that at xi_s, deq from {led.deq.min() / DEQ:.3f} to {led.deq.max() / DEQ:.3f} of the first one")


def test_contact_pushed_and_parted(bench):
    """A new contact only repels; its flow in compression stays until the spheres separate, and is what it was when they are pushed again before. The energy
    balance closes. Control: spheres that overlap and have flowed do not touch."""
    (bench.folder / "none.bonds").write_text("# EVP bonds COUNT: 0 UNITS: si\n")
    shown = []
    for gap in (0.96, 0.99):  # of the middle of a cycle of 0.03: the spheres separate in the second run only
        d, force, balance, work = two(bench, "contact repulsive plasticity isotropic", f"wiggle {-0.03 * TOUCHING} 0 0 1e-3", gap * TOUCHING,
                                      "fix bonds all evp/bonds file none.bonds\nfix e all evp/energy", steps=3000, more="f_e f_e[9]")
        led = lead(d, TOUCHING, TABLE1, touching=TOUCHING, first=0)
        off, open_by = off_by(led, force), np.abs(balance).max() / led.work[-1]
        assert off < ROUND_OFF and open_by < LEDGER_SHARE
        assert work[-1] == pytest.approx(led.work[-1], rel=1e-9)
        assert led.deq.min() < 0.98 * TOUCHING and led.deq[-1] < TOUCHING and np.all(force > -ROUND_OFF * FORCE)
        assert (d.max() > TOUCHING) == (gap == 0.99)
        kept = (d < TOUCHING) & (force == 0.0)
        assert kept.sum() > 100, "control: spheres that overlap and have flowed do not touch"
        shown.append(f"error of the force {off:.0e} of that at xi_s, energy imbalance {open_by:.0e}, {kept.sum()} steps without force in spite of overlap")
    bench.show("; ".join(shown))


@pytest.mark.parametrize("plasticity, at, never", [("none", 0.1, 0.5), ("isotropic", 0.3, 3.0)])
def test_bond_torn_and_pushed_together(bench, plasticity, at, never):
    """A bond stretched beyond XI, or with plasticity an update after p has reached that of damage, is broken for good: no force until the spheres touch, then the
    repulsion of a new contact. Control: with a larger XI it stays a bond."""
    def swung(strain):
        rule, row = (f"break {strain}", "") if plasticity == "none" else ("", failing_at(strain))
        return two(bench, f"contact repulsive plasticity {plasticity} {rule}", f"wiggle {0.25 * DEQ} 0 0 2e-4", steps=200, row=row)

    d, force = swung(at)
    torn = int(np.argmax(d > 1.1 * DEQ) if plasticity == "none" else np.argmax(lead(d, DEQ, TABLE1, first=0).p >= at) + 10)
    assert 10 < torn < 50 and force[torn - 1] < 0.0
    apart, touching = d[torn:] > TOUCHING, d[torn:] < TOUCHING
    assert np.all(force[torn:][apart] == 0.0) and apart.sum() > 50
    assert np.all(force[torn:][touching] > -ROUND_OFF * FORCE) and force[torn:][touching].max() > 0.9 * FORCE and touching.sum() > 30
    kept, again = swung(never)
    assert np.any(again[torn:][kept[torn:] > TOUCHING] < -0.5 * FORCE)
    bench.show(f"no force over {apart.sum()} steps, {force[torn:].max() / FORCE:.1f} of the force at xi_s where they touch")


@pytest.mark.parametrize("steps", [60, 1])
def test_bond_past_its_cutoff(bench, steps):
    """In 60 steps and in one: plastic work and p of flow up to the cutoff, nothing on the way back, and the same energy balance, for skins from 1e-9 to
    2e-3 m, newton on and off. Control: it leaves the neighbor list with the smallest skin, and stays there with the largest."""
    deq, cut, way = TOUCHING, TABLE1.alpha * TOUCHING, 6.18e-3
    write_two(bench.folder / "body.data", deq)
    led = lead([min(deq + way * k / steps, cut) for k in range(1, steps + 1)], deq, TABLE1)
    expected = np.array([led.work[-1], led.slip[-1] / 0.31, led.stored[-1]])
    rows, listed, speed = [], {}, way / (steps * 1e-6)
    for skin in (1e-9, 6e-4, 2e-3):
        for newton in ("on", "off"):
            text = head(newton, skin=skin) + f"pair_style evp/lj contact none plasticity isotropic\npair_coeff * * {words(TABLE1)}\nfix bonds all evp/bonds\n"
            text += "fix move all nve/noforce\nfix energy all evp/energy\ntimestep 1e-6\ncompute each all evp/state/atom plastic_work plastic_strain\n"
            text += "compute kept all reduce sum c_each[5] c_each[6]\nthermo 100\n" + thermo("c_kept[*] f_energy f_energy[*]")
            text += "".join(f"{two_groups(0.0, own)}run 0\nrun {steps}\n{two_groups(0.0, 0.0)}run {70 - steps}\n" for own in (speed, -speed))
            run = bench.run(text).ok()
            rows.append([[value[-1] for name, value in run.thermo(k).items() if name != "Step"] for k in (2, 5)])
            listed[skin] = int(run.stdout.split("Total # of neighbors = ")[3].split()[0])
    assert listed[1e-9] == 0 and listed[2e-3] > 0, listed
    rows = np.array(rows)
    found = rows[:, :, (0, 1, 13)] / [1.0, 2.0, 1.0]
    off = np.abs(found / expected - 1.0).max()
    apart = np.abs(rows - rows[-1]).max() / expected[0]
    assert off < 1e-7, "the margin of a cutoff, up to which a bond flows"
    assert np.allclose(rows[:, :, 0], rows[:, :, 11], rtol=1e-12, atol=0.0), "entry 9 of the energy balance"
    assert apart < ROUND_OFF
    bench.show(f"plastic work {rows[0, 0, 0]:.6f} J, error {off:.0e}, skins differ by {apart:.0e}")


def test_bond_that_ended_is_in_the_volume_energy_at_once(bench):
    """Past dlim and back within the skin: the pair has the volume energy of one without a bond, whether the neighbor list is built anew at each step or not at all.
    Control: there is such a force on the way back."""
    found = []
    for neigh in ("every 1 delay 0 check no", "every 1000 delay 1000 check no"):
        fix = f"neigh_modify {neigh}\nfix bonds all evp/bonds\nfix volume all evp/volume 50"
        found.append(two(bench, "contact none plasticity isotropic", "wiggle 9e-4 0 0 1e-4", TABLE1.alpha * TOUCHING - 4e-4, fix))
    (d, force), (_, other) = found
    back = (d < TABLE1.alpha * TOUCHING) & (np.arange(len(d)) > 25)
    assert d.max() > TABLE1.alpha * TOUCHING and np.abs(force[back]).max() > 1e-6 * FORCE
    apart = np.abs(other - force).max() / FORCE
    assert apart < ROUND_OFF
    bench.show(f"force on the way back {np.abs(force[back]).max() / FORCE:.2g} of that at xi_s, lists differ by {apart:.0e}")


def test_flow_in_a_body_whose_atoms_are_sorted(bench):
    """Deq and broken bonds stay with their pairs when atoms are sorted and neighbor lists rebuilt at each step, and with a wide skin. Control: bonds have flowed in
    tension and in compression, and broken."""
    body = lattice_body((6, 4, 4))
    write_body(bench.folder / "body.data", body)
    text = flowing_pair("none") + SHAKE + MOVE + "{}run 100\nwrite_evp_bonds {}.bonds\n"
    bench.run(head(sort="sort 0 0") + text.format("", "rare")).ok()
    bench.run(head(sort="sort 1 0.004") + text.format("neigh_modify every 1 delay 0 check no\n", "often")).ok()
    bench.run(head(sort="sort 0 0", skin=0.004) + text.format("", "wide")).ok()
    rare, often, wide = (read_pairs(bench.folder / f"{name}.bonds") for name in ("rare", "often", "wide"))
    assert_flowed(rare, body.bonds, contacts=0)
    difference = max(largest_difference(often, rare), largest_difference(wide, rare))
    assert difference < 1e-10
    bench.show(f"deq, p and work agree to {difference:.0e}, {rare.ended} bonds broken")


def test_flow_across_the_boundary_of_a_box(bench):
    """A periodic body of two types, one of which holds twice as far, is the same whatever place in the box it has: other pairs meet across the boundary, and
    others stand first. Control: both types have flowed, one of them more."""
    body = lattice_body((4, 4, 4), "xyz")
    write_body(bench.folder / "body.data", body)
    kept = []
    for shift in (0.0, 0.37):
        text = head(boundary="p p p") + f"displace_atoms all move {shift * 0.04} {shift * 0.04} 0 units box\n"
        text += f"pair_style evp/lj contact none plasticity isotropic\npair_coeff * * {words(TABLE1)}\n"
        text += f"pair_coeff 2 2 {words(TABLE1._replace(xi_s=2.0 * TABLE1.xi_s))}\nfix bonds all evp/bonds\nfix move all nve\ntimestep 3e-7\n"
        text += f"fix pull all deform 1 x erate 400\nrun 200\nwrite_evp_bonds {shift}.bonds\n"
        bench.run(text).ok()
        kept.append(read_pairs(bench.folder / f"{shift}.bonds"))
    difference, p = largest_difference(*kept), kept[0].column("plastic_strain")
    means = [np.mean([p.get(k + 1, 0.0) for k in np.flatnonzero(body.types == own)]) for own in (1, 2)]
    assert difference < 1e-9 and means[0] > 1.1 * means[1] > 1e-3, (difference, means)
    bench.show(f"deq, p and work agree to {difference:.0e}, mean p {means[0]:.4f} and {means[1]:.4f}")


def test_minimization_that_stops_early(bench):
    """A minimization that stops at its maximum number of iterations leaves no flow. Control: one that converges does."""
    body = lattice_body((4, 3, 3))
    write_body(bench.folder / "body.data", body)
    text = head() + flowing_pair("none", 0) + "fix move all nve\ntimestep 3e-7\n" + "run 0\nvariable px atom x+3e-4*sin(1.7*id)\nset group all x v_px\n"
    found = {}
    for name, search in (("stopped", "minimize 0 0 6 100"), ("rest", "minimize 0 1e4 1000 10000")):
        bench.run(text + f"min_style cg\nmin_modify dmax 1e-5\n{search}\nwrite_evp_bonds {name}.bonds\n").ok()
        found[name] = max(abs(deq / body.bonds[key] - 1.0) for key, deq in read_pairs(bench.folder / f"{name}.bonds").bonds.items())
    assert found["stopped"] < 1e-15 and found["rest"] > 1e-3
    bench.show(f"largest change of deq {found['stopped']:.0e} stopped, {found['rest']:.0e} converged")


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
