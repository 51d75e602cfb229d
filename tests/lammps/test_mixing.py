# SPDX-License-Identifier: GPL-2.0-only
"""Beside other styles, walls, and in whatever order atoms and boxes are changed: right, or one clear refusal."""

import numpy as np
import pytest
from evp import law
from hostile import refused
from small_bodies import (ANOTHER_ORDER, MOVE, ROUND_OFF, STIR, check_forces, dump, head, lattice_body, pair, record,
                          truth, words, write_body)

STEPS = "run 100\n"
# a step as good as none: the velocities of the dump are those that the damping saw
HOLD = "run 60\nunfix move\nfix move all nve/noforce\ntimestep 1e-30\nrun 50\n"
EPSILON, SIGMA, CUT = 2.0, 0.009, 0.018  # of lj/cut [J, m, m]
LJ = f"{EPSILON} {SIGMA}"


def lj_forces(x, acts):
    """Forces of lj/cut and the sum of |F| of each atom; acts (N, N) tells the pairs."""
    r = x[:, None, :] - x[None, :, :]
    d = np.linalg.norm(r, axis=-1) + np.eye(len(x))
    f = 24.0 * EPSILON * (2.0 * (SIGMA / d) ** 12 - (SIGMA / d) ** 6) / d
    f = np.where(acts & (d < CUT) & ~np.eye(len(x), dtype=bool), f, 0.0)
    return np.sum(f[:, :, None] * r / d[:, :, None], axis=1), np.abs(f).sum(axis=1)


def error_of(snapshot, expected, scale):
    return np.max(np.linalg.norm(snapshot.vectors("fx", "fy", "fz") - expected, axis=1) / scale)


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (3, "off"), (4, "on")])
@pytest.mark.parametrize("style", ["hybrid", "hybrid/overlay"])
def test_hybrid_with_lj_cut(lmp, bar, style, ranks, newton):
    """hybrid: type 1 is ours, all else lj/cut, and bonds are recorded in type 1 alone. hybrid/overlay: both act on all."""
    row = law.TABLE1._replace(gamma=50.0)
    overlay = style == "hybrid/overlay"
    pairs = "* *" if overlay else "1 1"
    coeffs = f"pair_style {style} lj/cut {CUT} evp/lj contact literal\npair_coeff {pairs} evp/lj {words(row)}\n"
    coeffs += "".join(f"pair_coeff {two} lj/cut {LJ}\n" for two in (["* *"] if overlay else ["1 2", "2 2"]))
    run = lmp(head(newton) + coeffs + "fix bonds all evp/bonds\n" + STIR + MOVE + dump() + HOLD, ranks=ranks).ok()
    ours = np.ones(len(bar.x), dtype=bool) if overlay else bar.types == 1
    among = {p: deq for p, deq in bar.bonds.items() if all(ours[k - 1] for k in p)}
    assert run.thermo()["f_bonds"][0] == len(among)
    for snapshot in run.dump("all.dump")[-1:]:
        x, v = snapshot.vectors("x", "y", "z"), snapshot.vectors("vx", "vy", "vz")
        found = truth(x[ours], v[ours], bar._replace(radius=bar.radius[ours], types=bar.types[ours], bonds=among), row,
                      ids=1 + np.flatnonzero(ours))
        expected, scale = lj_forces(x, np.ones(2 * (len(x),), dtype=bool) if overlay else ~(ours[:, None] & ours[None, :]))
        assert np.all(scale > 0.0), "control: lj/cut acts on every atom"
        expected[ours] += found["force"]
        scale[ours] += found["abs_force"]
        assert error_of(snapshot, expected, scale) < ROUND_OFF
    assert run.thermo()["f_bonds[2]"][-1] > 20, "control: the body is deformed"


@pytest.mark.parametrize("ranks", [1, 3])
def test_walls_and_indenters(lmp, bar, ranks):
    """A harmonic wall at x = 0.002 and a spherical indenter at the other end, by their formulas, beside our forces."""
    k_wall, reach, k_indent, centre, radius = 1e6, 0.006, 1e9, np.array([0.065, 0.02, 0.02]), 0.015
    run = lmp(head() + pair() + f"""
region floor plane 0.002 0 0 1 0 0
variable inner atom x>0.0021
group inner variable inner
fix wall inner wall/region floor harmonic {k_wall} 0 {reach}
fix dent all indent {k_indent} sphere {centre[0]} {centre[1]} {centre[2]} {radius} units box
""" + STIR.replace("300.0", "0") + MOVE + dump() + STEPS, ranks=ranks).ok()
    inner = bar.x[:, 0] > 0.0021
    for snapshot in run.dump("all.dump")[1:]:
        x = snapshot.vectors("x", "y", "z")
        above = x[:, 0] - 0.002
        added = np.zeros_like(x)
        added[:, 0] = np.where(inner & (above < reach), 2.0 * k_wall * (reach - above), 0.0)
        away = x - centre
        d = np.linalg.norm(away, axis=1)
        added += np.where(d < radius, k_indent * (d - radius) ** 2 / d, 0.0)[:, None] * away
        assert np.sum(added[:, 0] > 0.0) > 5 and np.sum(d < radius) > 2, "control: both touch the body"
        check_forces(snapshot, bar, added=added)
    assert run.thermo()["f_bonds[2]"][-1] > 20


@pytest.mark.parametrize("ranks, contact", [(1, "literal"), (3, "none")])
def test_bonds_in_a_group_only(lmp, bar, ranks, contact):
    """Pairs with an atom outside the group are new contacts to the law."""
    run = lmp(head("off") + "region low block INF 0.03 INF INF INF INF\ngroup low region low\n"
              + pair(contact=contact, fix="fix bonds low evp/bonds") + STIR + MOVE + dump() + STEPS, ranks=ranks).ok()
    low = {p: deq for p, deq in bar.bonds.items() if all(bar.x[k - 1, 0] < 0.03 for k in p)}
    assert 50 < len(low) < len(bar.bonds) - 50
    assert run.thermo()["f_bonds"][-1] == len(low)
    for snapshot in run.dump("all.dump")[1:]:
        check_forces(snapshot, bar._replace(bonds=low), contact=contact)


@pytest.mark.parametrize("contact", ["literal", "repulsive", "none"])
def test_bodies_that_meet(lmp, tmp_path, contact):
    """Two bodies, 17 mm between them, run into each other at 300 m/s: the pairs across are new, and with contact
    none they pass through one another."""
    one = lattice_body((3, 3, 3))
    two = one.x + [0.045, 0.004, 0.001]
    x, radius = np.concatenate([one.x, two]), np.tile(one.radius, 2)
    bodies = one._replace(x=x, radius=radius, types=np.ones(len(x), dtype=int), box=np.array([[-0.05, 0.15]] * 3),
                          bonds=record(x, radius, 1.5, one.cell))
    assert len(bodies.bonds) == 2 * len(one.bonds), "no bond across"
    write_body(tmp_path / "body.data", bodies)
    run = lmp(head() + pair(contact=contact) + """
group one id <= 27
group two subtract all one
velocity one set 150 0 0
velocity two set -150 0 0
""" + MOVE.replace("pxx pyz", "c_across[1]").replace("thermo_style", "compute across one group/group two\nthermo_style", 1)
              + dump() + "run 300\n", ranks=2).ok()
    for snapshot in run.dump("all.dump")[1:]:
        found = check_forces(snapshot, bodies, contact=contact, at_rest=True)
    across = np.sum((found["i"] < 27) != (found["j"] < 27))
    thermo = run.thermo()
    assert thermo["f_bonds[3]"][0] == 0.0 and thermo["c_across[1]"][0] == 0.0
    assert (thermo["f_bonds[3]"][-1] == found["new_contacts"]) and (across > 0) == (contact != "none")
    assert (thermo["c_across[1]"][-1] == 0.0) == (contact == "none")
    v = snapshot.vectors("vx", "vy", "vz")
    mass = radius**3
    assert np.linalg.norm(mass @ v) < ROUND_OFF * np.sum(mass[:, None] * np.abs(v)), "momentum, 0 at the start"
    if contact == "none":
        assert np.abs(np.abs(v[:, 0]) - 150.0).max() < ANOTHER_ORDER * 150.0


PULL = "displace_atoms all ramp x 0 0.003 x 0 0.06\ndisplace_atoms all ramp y 0 -0.001 x 0 0.06\n"


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (3, "off")])
def test_deleted_atoms(lmp, bar, ranks, newton):
    """compress no: what is left keeps its bonds. What would hand bonds to
    other atoms is refused: compress yes, and a new atom that takes a free ID."""
    text = head(newton) + pair() + "fix move all nve\nrun 0\n" + PULL + "group gone id 1:5 40 96\n"
    run = lmp(text + "delete_atoms group gone compress no\n" + dump() + "run 0\n", ranks=ranks).ok()
    last = run.dump("all.dump")[-1]
    left = last["id"].astype(int) - 1
    assert len(left) == len(bar.x) - 7
    check_forces(last, bar._replace(radius=bar.radius[left], types=bar.types[left]))

    run = lmp(text + "delete_atoms group gone\nrun 0\n", ranks=ranks)
    refused(run, "Fix bonds evp/bonds: atom ID", "is not the atom that was recorded under this ID", "delete_atoms ... compress no")

    text = text.replace("id 1:5 40 96", "id 90:96") + "delete_atoms group gone compress no\n"
    run = lmp(text + "create_atoms 1 single 0.03 0.02 0.05\nset atom 90 diameter 0.01\nrun 0\n", ranks=ranks)
    refused(run, "atom ID 90 is not the atom that was recorded under this ID", "'read_data ... add 96'")


LJ_UNITS = """
units lj
atom_style sphere
atom_modify map yes
boundary f f f
lattice sc 1.0
region box block -2 7 -2 6 -2 12
create_box 1 box
region body block 0 3.1 0 3.1 0 1.1
create_atoms 1 region body
set group all diameter 1
neighbor 0.2 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj contact {contact}
pair_coeff * * 80 8 4 3 8 4 0.005 0 1.3
fix bonds all evp/bonds
fix move all nve
timestep 0.0005
thermo_style custom step atoms f_bonds f_bonds[3]
{dump}
run 0
region above block 0 3 0 3 4 5
fix rain all deposit 3 1 100 99887 region above vz -20 -20 near 0.5
run 500
"""


@pytest.mark.parametrize("ranks", [1, 3])
def test_deposited_atoms_are_unbonded(lmp, ranks):
    """fix deposit drops three spheres on a plate: they are new contacts, the plate keeps its bonds."""
    run = lmp(LJ_UNITS.format(contact="repulsive", dump=dump()), ranks=ranks).ok()
    first, last = run.dump("all.dump")[0], run.dump("all.dump")[-1]
    x = first.vectors("x", "y", "z")
    cell = np.zeros((3, 3))
    body = lattice_body((1, 1, 1))._replace(bonds=record(x, np.full(len(x), 0.5), 1.3, cell), cell=cell)
    assert run.thermo()["Atoms"][-1] == len(x) + 3
    assert run.thermo()["f_bonds"][-1] == len(body.bonds)
    row = law.TABLE1._replace(alpha=1.3)
    met = 0
    for snapshot in run.dump("all.dump")[-6:]:
        n = len(snapshot["id"])
        now = body._replace(radius=np.full(n, 0.5), types=np.ones(n, dtype=int))
        found = check_forces(snapshot, now, row, "repulsive", at_rest=True)
        met += np.sum(np.maximum(found["i"], found["j"]) >= len(x))
    assert met > 0, "control: they do meet the plate"
    assert min(last["vz"][len(x):]) > -0.5 * 20.0, "and the plate stopped their fall"


@pytest.mark.parametrize("ranks", [1, 3])
def test_set_type_and_diameter(lmp, bar, ranks):
    """Bonds keep deq; the row of their law, dlim and what new pairs take for deq follow the present types and radii."""
    rows = {(1, 1): law.TABLE1, (1, 2): law.Row(50.0, 6.0, 3.0, 5.0, 7.5, 3.2, 0.010, 0.0, 1.4),
            (2, 2): law.Row(30.0, 12.0, 6.0, 9.0, 4.0, 2.0, 0.008, 0.0, 1.5)}
    coeffs = "".join(f"pair_coeff {a} {b} {words(row)}\n" for (a, b), row in rows.items())
    text = (head() + "pair_style evp/lj\n" + coeffs + "fix bonds all evp/bonds zone 1.4\nfix move all nve\nrun 0\n" + PULL
            + "set atom 1*30 type 2\nset atom 20*60 diameter 0.0092\nset atom 61*70 diameter 0.0118\n" + dump() + "run 0\n")
    types, radius = bar.types.copy(), bar.radius.copy()
    types[:30], radius[19:60], radius[60:70] = 2, 0.0046, 0.0059
    last = lmp(text, ranks=ranks).ok().dump("all.dump")[-1]
    changed = bar._replace(types=types, radius=radius, bonds=record(bar.x, bar.radius, 1.4, bar.cell))
    check_forces(last, changed, rows)
    for control in (changed._replace(types=bar.types), changed._replace(radius=bar.radius)):
        with pytest.raises(AssertionError):
            check_forces(last, control, rows)


def test_replicate_is_refused_after_the_fix(lmp, bar):
    """LAMMPS cannot copy what fixes keep per atom; before the fix it can."""
    refused(lmp(head() + pair() + "replicate 2 1 1\n"), "Cannot replicate")
    refused(lmp(head() + pair() + "fix move all nve\nrun 0\nreplicate 2 1 1\n"), "Cannot replicate", stepped=True)
    run = lmp(head(boundary="p f f").replace("neighbor", "replicate 2 1 1\nneighbor") + pair() + MOVE + "run 0\n").ok()
    assert run.thermo()["f_bonds"][0] == 2 * len(bar.bonds)


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (4, "off")])
def test_change_box(lmp, tmp_path, ranks, newton):
    """A box that is strained with its atoms, orthogonal and then sheared: deq stays, the body is under stress."""
    body = lattice_body((5, 4, 4), "xyz")
    write_body(tmp_path / "body.data", body)
    run = lmp(head(newton, boundary="p p p") + pair() + "fix move all nve\nrun 0\n" + dump(every=1) + """
change_box all x scale 1.01 y scale 0.995 remap units box
run 0
undump all
change_box all triclinic
""" + dump("sheared.dump") + """
change_box all xy final 0.001 yz final -0.0007 remap units box
run 0
""", ranks=ranks).ok()
    stretched, sheared = run.dump("all.dump")[0], run.dump("sheared.dump")[0]
    cell = body.cell * [1.01, 0.995, 1.0]
    check_forces(stretched, body._replace(cell=cell))
    cell[1, 0], cell[2, 1] = 0.001, -0.0007
    found = check_forces(sheared, body._replace(cell=cell))
    assert found["bonds_second"] > 20
    with pytest.raises(AssertionError):
        check_forces(sheared, body)
