# SPDX-License-Identifier: GPL-2.0-only
"""Beside other styles and LAMMPS' other ways to run, and in whatever order atoms and boxes are changed: right, or one clear refusal."""

import numpy as np
import pytest
from evp import law
from flowing import BONDS, SHAKE, failing_at
from hostile import refused
from lammps_run import write_data
from small_bodies import (ANOTHER_ORDER, MOVE, ROUND_OFF, STIR, assert_same_curve, check_forces, dump, head, pair, record, thermo, truth, words, write_body)

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


@pytest.mark.parametrize("style", ["hybrid", "hybrid/overlay"])
def test_hybrid_with_lj_cut(lmp, bar, style):
    """hybrid: type 1 is ours, all else lj/cut, and bonds are recorded in type 1 alone. hybrid/overlay: both act on all."""
    row = law.TABLE1._replace(gamma=50.0)
    overlay = style == "hybrid/overlay"
    pairs = "* *" if overlay else "1 1"
    coeffs = f"pair_style {style} lj/cut {CUT} evp/lj contact literal\npair_coeff {pairs} evp/lj {words(row)}\n"
    coeffs += "".join(f"pair_coeff {two} lj/cut {LJ}\n" for two in (["* *"] if overlay else ["1 2", "2 2"]))
    run = lmp(head("off") + coeffs + "fix bonds all evp/bonds\n" + STIR + MOVE + dump() + HOLD, ranks=3).ok()
    ours = np.ones(len(bar.x), dtype=bool) if overlay else bar.types == 1
    among = {p: deq for p, deq in bar.bonds.items() if all(ours[k - 1] for k in p)}
    assert run.thermo()["f_bonds"][0] == len(among)
    last = run.dump("all.dump")[-1]
    x = last.x
    found = truth(x[ours], last.v[ours], bar._replace(radius=bar.radius[ours], types=bar.types[ours], bonds=among), row, ids=1 + np.flatnonzero(ours))
    expected, scale = lj_forces(x, np.ones(2 * (len(x),), dtype=bool) if overlay else ~(ours[:, None] & ours[None, :]))
    assert np.all(scale > 0.0), "control: lj/cut acts on every atom"
    expected[ours] += found["force"]
    scale[ours] += found["abs_force"]
    assert np.max(np.linalg.norm(last.f - expected, axis=1) / scale) < ROUND_OFF
    assert run.thermo()["f_bonds[2]"][-1] > 20, "control: the body is deformed"


PULL = "displace_atoms all ramp x 0 0.003 x 0 0.06\ndisplace_atoms all ramp y 0 -0.001 x 0 0.06\n"


def test_deleted_atoms(lmp, bar):
    """compress no: what is left keeps its bonds. What would hand bonds to other atoms is refused: test_remedies.py."""
    text = head("off") + pair() + "fix move all nve\nrun 0\n" + PULL + "group gone id 1:5 40 96\ndelete_atoms group gone compress no\n"
    last = lmp(text + dump() + "run 0\n", ranks=3).ok().dump("all.dump")[-1]
    left = last["id"].astype(int) - 1
    assert len(left) == len(bar.x) - 7
    check_forces(last, bar._replace(radius=bar.radius[left], types=bar.types[left]))


def test_set_type_and_diameter(lmp, bar):
    """Bonds keep deq; the row of their law, dlim and what new pairs take for deq follow the present types and radii."""
    rows = {(1, 1): law.TABLE1, (1, 2): law.Row(50.0, 6.0, 3.0, 5.0, 7.5, 3.2, 0.010, 0.0, 1.4), (2, 2): law.Row(30.0, 12.0, 6.0, 9.0, 4.0, 2.0, 0.008, 0.0, 1.5)}
    coeffs = "".join(f"pair_coeff {a} {b} {words(row)}\n" for (a, b), row in rows.items())
    text = (head() + "pair_style evp/lj\n" + coeffs + "fix bonds all evp/bonds zone 1.4\nfix move all nve\nrun 0\n" + PULL
            + "set atom 1*30 type 2\nset atom 20*60 diameter 0.0092\nset atom 61*70 diameter 0.0118\n" + dump() + "run 0\n")
    types, radius = bar.types.copy(), bar.radius.copy()
    types[:30], radius[19:60], radius[60:70] = 2, 0.0046, 0.0059
    last = lmp(text, ranks=3).ok().dump("all.dump")[-1]
    changed = bar._replace(types=types, radius=radius, bonds=record(bar.x, bar.radius, 1.4, bar.cell))
    check_forces(last, changed, rows)
    for control in (changed._replace(types=bar.types), changed._replace(radius=bar.radius)):
        with pytest.raises(AssertionError):
            check_forces(last, control, rows)


# ---- beside lammps' other ways to run ----

STRETCH = "displace_atoms all ramp x 0 0.0012 x 0 0.06\n"


def test_rerun_with_bonds_from_a_file(lmp, bar):
    """Energies and forces of a dump's snapshots are those of the run that wrote it; of a rerun that records its own bonds, at the first snapshot, they are others."""
    lmp(head() + pair() + "fix move all nve\nrun 0\nwrite_evp_bonds all.bonds\n").ok()
    whole = lmp(head() + pair() + STIR + MOVE + dump(every=10) + "run 100\n", ranks=2).ok()
    again = dump("again.dump", 10) + "rerun all.dump first 20 dump x y z vx vy vz\n"
    kept = pair(fix="fix bonds all evp/bonds file all.bonds")
    run = lmp(head("off") + kept + MOVE + again, ranks=3).ok()
    table = whole.thermo()
    later = {name: values[2:] for name, values in table.items() if name not in ("Step", "KinEng", "Pxx", "Pyz")}
    assert list(run.thermo()["Step"]) == list(range(20, 101, 10))
    assert_same_curve(run.thermo(), later, tolerance=10.0 * ROUND_OFF)
    for snapshot, old in zip(run.dump("again.dump"), whole.dump("all.dump")[2:]):
        check_forces(snapshot, bar)
        assert np.abs(snapshot["fx"] - old["fx"]).max() < ANOTHER_ORDER * np.abs(old["fx"]).max()
    bonds, beyond, second, new = (table[name][-1] for name in ("f_bonds", "f_bonds[1]", "f_bonds[2]", "f_bonds[3]"))
    assert 20 < second < bonds - beyond - 20 and beyond > 0 and new > 0, "control: bonds in both regimes, bonds lost and new pairs"
    fresh = lmp(head("off") + pair() + MOVE + again, ranks=3).ok().thermo()
    assert fresh["f_bonds[2]"][0] == 0.0 and abs(fresh["PotEng"][0] / later["PotEng"][0] - 1.0) > 1e-3


NEW = {"e1": 70.5, "m1": 9.0, "n1": 3.5, "e2": 5.0, "m2": 7.0, "n2": 3.0, "xi_s": 0.008, "gamma": 90.0}


def test_fix_adapt_of_every_coefficient(lmp_decks, bar):
    """After fix adapt the forces are those of the new row, and after `reset yes` those of the old one again; in a hybrid, too."""
    base = law.TABLE1._replace(gamma=20.0)
    alone = pair(base)
    hybrid = alone.replace("pair_style", "pair_style hybrid/overlay zero 0.001").replace("pair_coeff * *", "pair_coeff * * zero\npair_coeff * * evp/lj")
    decks = {(key, setup): head("off") + setup + "fix hold all nve/noforce\ntimestep 1e-30\nrun 0\n" + STRETCH + STIR + f"""
variable new equal {value}
fix change all adapt 1 pair evp/lj {key} * * v_new reset yes
{dump("new.dump", every=1)}
run 2
unfix change
undump all
{dump("reset.dump", every=1)}
run 0
""" for key, value in NEW.items() for setup in (alone, hybrid)}
    for (key, _), run in lmp_decks(decks, 2).items():
        row = base._replace(**{key: NEW[key]})
        for snapshot in run.dump("new.dump"):
            found = check_forces(snapshot, bar, row)
        assert found["bonds_second"] > 50
        with pytest.raises(AssertionError):
            check_forces(snapshot, bar, base)
        check_forces(run.dump("reset.dump")[-1], bar, base)


@pytest.mark.parametrize("contact", ["literal", "repulsive"])
def test_radii_that_change_during_a_run(lmp, tmp_path, bar, contact):
    """fix adapt shrinks the spheres while the neighbor list stands: dlim, and deq of new pairs, follow at every step."""
    row = law.TABLE1
    text = head("off", style="sphere 1") + pair(contact=contact, fix="fix bonds all evp/bonds zone 1.01") + """
fix hold all nve/noforce
variable size equal 0.0105-0.0002*step
fix shrink all adapt 1 atom diameter v_size
compute e all pair/local eng
compute sum all reduce sum c_e inputs local
thermo 1
""" + dump(every=1, columns="x y z vx vy vz fx fy fz radius") + thermo("pe c_sum f_bonds f_bonds[3]") + "run 0 post no\nrun 5\n"
    small = bar._replace(radius=np.full(len(bar.x), 0.00525))
    write_body(tmp_path / "body.data", small)
    run = lmp(text, ranks=3).ok()
    snapshots = run.dump("all.dump")[-5:]
    bonds = record(bar.x, small.radius, 1.01, bar.cell)
    for snapshot in snapshots:
        check_forces(snapshot, small._replace(radius=snapshot["radius"], bonds=bonds), row, contact, at_rest=True)
    table = run.thermo()
    assert np.ptp([snapshot["radius"][0] for snapshot in snapshots]) > 3e-4
    assert "Neighbor list builds = 0" in run.stdout
    assert np.allclose(table["PotEng"], table["c_sum"], rtol=10.0 * ROUND_OFF, atol=0.0), "compute() = single()"
    assert np.ptp(table["PotEng"]) > 1e-3 * np.abs(table["PotEng"]).max(), "control: the radii matter"


def beside_large_ones(types):
    """Spheres of 10 mm on a disordered lattice with two of 40 mm in it."""
    rng, grid = np.random.default_rng(3), np.stack(np.meshgrid(*[np.arange(n) for n in (12, 6, 6)], indexing="ij"), axis=-1).reshape(-1, 3)
    corners = np.array([[1, 1, 1], [7, 1, 1]])
    small = grid[~np.any([np.all((grid >= corner) & (grid < corner + 4), axis=1) for corner in corners], axis=0)]
    x = 0.01 * np.concatenate([small + 0.5 + rng.uniform(-0.08, 0.08, small.shape), corners + 2.0])
    radius = np.repeat([0.005, 0.02], [len(small), 2])
    return x, radius, [[-0.05, 0.17], [-0.05, 0.11], [-0.05, 0.11]], np.where(radius > 0.01, types, 1)


@pytest.mark.parametrize("ranks, newton, style, fails", [(1, "on", "join plasticity isotropic", None), (2, "off", "repulsive plasticity isotropic", 0.2), (3, "on", "literal", None)])
def test_radii_of_one_type_that_differ_by_four(lmp, tmp_path, ranks, newton, style, fails):
    """LAMMPS has one cutoff for two types, by the largest radii: the body moves as one whose large spheres are a type of their own, in as much memory."""
    found, megabytes = {}, {}
    for types in (2, 1):
        x, radius, box, type_of = beside_large_ones(types)
        write_data(tmp_path / "body.data", x, radius, box, type_of)
        text = head(newton, start="read_data body.data" + (" extra/atom/types 1" if types == 1 else ""), skin=0.0007) + pair(law.TABLE1, style, BONDS, failing_at(fails))
        text += SHAKE + "fix move all nve\ntimestep 3e-7\nthermo 50\n" + thermo("pe ke nbuild f_bonds[3] f_bonds[4] f_bonds[5]") + dump(every=150) + "run 150\n"
        run = lmp(text, ranks).ok()
        found[types] = run.thermo(), run.dump("all.dump")[-1]
        megabytes[types] = float(run.stdout.split("memory allocation (min/avg/max) = ")[1].split("|")[2].split()[0])
    (table, end), (other, other_end) = found[2], found[1]
    assert table["Nbuild"][-1] > 3 and table["f_bonds[3]"].max() > 5, "control: contacts come and go"
    assert_same_curve(table, {name: values for name, values in other.items() if name != "Nbuild"})
    assert np.abs(end.v - other_end.v).max() < ANOTHER_ORDER * np.abs(end.v).max()
    assert megabytes[1] < 1.05 * megabytes[2]


def test_plugin_unload(lmp, bar):
    """What is unloaded is gone with what it made; what depends on it says so; nothing crashes."""
    text = head() + pair() + "fix move all nve\nrun 1\n"
    refused(lmp(text + "plugin unload pair evp/lj\nrun 1\n"), "Fix bonds evp/bonds needs pair style evp/lj", stepped=True)
    run = lmp(text + "plugin unload fix evp/bonds\npair_style none\nrun 1\nfix bonds all evp/bonds\n")
    refused(run, "Unrecognized fix style 'evp/bonds'", stepped=True)
    run = lmp(text + "plugin clear\nrun 1\npair_style evp/lj\n", ranks=2)
    refused(run, "Unrecognized pair style 'evp/lj'", stepped=True)
    assert run.stdout.count("Loop time") == 2, "a run of free atoms in between"
