# SPDX-License-Identifier: GPL-2.0-only
"""fix nve/evp: the scheme that it promises, and what every scheme must keep. The bound of its step: test_limits.py; energy: test_energy.py."""

import numpy as np
import pytest
from evp import law
from lammps_run import write_data
from oracle import brute
from small_bodies import ANOTHER_ORDER, dump, grips, head, mass_of, pair, thermo, two_groups, velocities, write_two

GAMMA = 1000.0
TABLE2 = law.TABLE2
STEP = 5e-6  # [s] some 140 explicit limits of Table 2
TIGHT = "tol 1e-12"  # a solve at round-off: what is left of a comparison is the order of sums
DEFAULT_TOL = 1e-3

# Two solves of one step to TIGHT differ by 1e-12 of the damping before it is solved, which is dt lamC = 300 times the
# change of velocity at most; a hundred steps of them add to 3e-8 where all have one sign.
TIGHT_RUN = 3e-8
CLOSED_FORM = 1e-11  # twenty steps of one pair: roundings only

FLY = "fix integrate all nve/evp {options}\ntimestep {step}\nthermo 20\n" + thermo("pe ke")
# a stretch along x, a wave by ID, a rotation about z, a translation
STIR = velocities("{fast}+300*(x-0.04)-20*y+5*sin(1.1*id)", "20*(x-0.04)+5*cos(2.3*id)", "5*sin(3.7*id+1)")


def flight(options="", row=TABLE2, fast=0.0, newton="on", step=STEP, boundary="s s s", contact="none"):
    return (head(newton, boundary) + pair(row, contact) + STIR.format(fast=fast) + FLY.format(options=options, step=step))


def internal(snapshot, mass):
    """Positions and velocities about those of the centre of mass."""
    return [value - mass @ value / mass.sum() for value in (snapshot.x, snapshot.v)]


def assert_same_motion(last, other, mass, tolerance):
    """Both snapshots show one internal motion: velocities to the tolerance of the largest, places to what they make of it."""
    for name, a, b in zip(("places", "velocities"), internal(last, mass), internal(other, mass)):
        assert np.abs(a - b).max() <= tolerance * np.abs(a).max(), name


# ---- the scheme ----


def test_without_damping_it_is_fix_nve(lmp, body):
    """Masses are a power of two, so that 1/m is exact and both fixes round alike."""
    text = flight(row=law.TABLE1, step=3e-7, contact="literal")
    text = text.replace("fix integrate", "set group all mass 0.001953125\nfix integrate") + dump() + "run 200\n"
    ours, plain = (lmp(text.replace("nve/evp", style)).ok().dump("all.dump")[-1] for style in ("nve/evp", "nve"))
    for name in ("x", "y", "z", "vx", "vy", "vz", "fx", "fy", "fz"):
        scale = np.abs(plain[name]).max()
        assert np.abs(ours[name] - plain[name]).max() <= ANOTHER_ORDER * scale, name


PAIR_OF_TWO = head(skin=0.002) + pair(TABLE2._replace(e1=0.0, e2=0.0)) + two_groups(0.5, 2.0) + """
fix hold one nve/noforce
fix integrate two nve/evp tol 1e-13
timestep {step:.17g}
""" + dump("two.dump", 1, "vx fx")


@pytest.mark.parametrize("then", ["", "timestep {other:.17g}\nrun 10 pre no\n", "timestep {other:.17g}\nrun 10\n"])
def test_one_damped_atom_beside_a_prescribed_one(lmp, tmp_path, then):
    """(m + dt g) v+ = m v- + dt g V: v - V falls by 1/(1 + dt g/m) per step, exactly; a change of step in mid-run goes on from the velocity of the full step.
    The prescribed atom keeps V and reads the reaction."""
    write_two(tmp_path / "body.data")
    tau = mass_of(0.005) / GAMMA
    ratio, other = 0.5, 3.0
    deck = PAIR_OF_TWO.format(step=ratio * tau) + "run 10\n" + then.format(other=other * tau)
    found = {snapshot.step: snapshot for snapshot in lmp(deck).ok().dump("two.dump")}
    for step, snapshot in found.items():
        factor = (1.0 + ratio) ** -min(step, 10) * (1.0 + other) ** -max(step - 10, 0)
        assert snapshot["vx"][0] == 0.5
        assert snapshot["vx"][1] - 0.5 == pytest.approx(1.5 * factor, rel=CLOSED_FORM, abs=1e-14), step
        now = ratio if step < 10 or not then else other
        if step != 10:
            force = -GAMMA * 1.5 * factor / (1.0 + 0.5 * now)  # that of v+ = v/(1 + h/2)
            assert snapshot["fx"][1] == pytest.approx(force, rel=CLOSED_FORM, abs=1e-10), step
            assert snapshot["fx"][0] == pytest.approx(-force, rel=CLOSED_FORM, abs=1e-10), step
    assert max(found) == (20 if then else 10)


# ---- what every scheme must keep ----


def test_flight_changes_nothing_inside(lmp, body):
    """500 m/s, at the default tolerance: the residual is measured by the damping, which is Galilean invariant. (Mutation: a target of tol |M v*| leaves the
    flying body with no damping at all.)"""
    mass = mass_of(body.radius)
    still, flying = (lmp(flight(fast=fast) + dump(every=60) + "run 60\n").ok().dump("all.dump") for fast in (0.0, 500.0))
    assert_same_motion(still[-1], flying[-1], mass, DEFAULT_TOL)
    assert flying[-1]["x"].mean() - still[-1]["x"].mean() == pytest.approx(500.0 * 60 * STEP, rel=1e-9)
    speeds = [np.abs(internal(snapshot, mass)[1]).max() for snapshot in still]
    assert speeds[1] < 0.7 * speeds[0], "control: damping acts"


GRIPS = grips(0.01, 0.07) + "velocity left set -3 0 0\nvelocity right set 3 0 0\n{fixes}\ntimestep {step}\n"
FIXES = [f"fix integrate free nve/evp {TIGHT}", "fix hold grips nve/noforce", "fix push free addforce 40 -20 10"]


def test_order_of_fixes_changes_nothing(lmp, body):
    """Grips that move, a force of another fix (at set-up it is added after the solve where that fix comes later), and a step that
    changes between two solves: the damping is along the directions of the last force evaluation, whichever fix moves first."""
    ends = []
    for order in ((0, 1, 2), (1, 0, 2), (2, 1, 0)):
        deck = head(boundary="s s s") + pair(TABLE2, "none") + STIR.format(fast=0.0)
        deck += GRIPS.format(fixes="\n".join(FIXES[k] for k in order), step=STEP) + dump(every=1000)
        deck += f"run 20\ntimestep {2 * STEP}\nrun 20 pre no\ntimestep {STEP / 3}\nrun 20 pre no\ndump_modify all every 1\nrun 0 pre no\n"
        ends.append(lmp(deck).ok().dump("all.dump")[-1])
    assert ends[0].step == 60
    for other in ends[1:]:
        assert_same_motion(ends[0], other, mass_of(body.radius), TIGHT_RUN)


def test_virial_holds_the_damping_once(lmp, body):
    """Globally and summed over atoms, against a sum over all pairs with the opening rates of the step at v+ = v + dt f/2m, the velocity
    that the damping is solved for. Control: without damping it is another."""
    deck = flight(TIGHT, newton="off", boundary="f f f", contact="literal").replace("thermo_style custom step", """
compute virial all pressure NULL virial
compute each all stress/atom NULL virial
compute sum all reduce sum c_each[1] c_each[2] c_each[3] c_each[4] c_each[5] c_each[6]
thermo_style custom step vol c_virial[*] c_sum[*]""") + dump(every=10) + "run 10\nfix_modify integrate virial no\nrun 0\n"
    run = lmp(deck, 2).ok()
    last, mass = run.dump("all.dump")[-1], mass_of(body.radius)
    x, v, f = last.x, last.v, last.f
    found = {}
    for block, row in ((0, TABLE2), (1, law.TABLE1)):
        sum_over_pairs = brute.brute_force(x, v + 0.5 * STEP * f / mass[:, None], body.radius, body.types, row, body.bonds, "literal", step=STEP)
        virial = sum_over_pairs["virial"][[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        thermo = run.thermo(block)
        scale = np.abs(virial).max()
        ours = np.array([thermo[f"c_virial[{k}]"][-1] for k in range(1, 7)]) * thermo["Volume"][-1]
        atoms = -np.array([thermo[f"c_sum[{k}]"][-1] for k in range(1, 7)])
        assert np.allclose(ours, virial, rtol=0.0, atol=TIGHT_RUN * scale), row
        assert np.allclose(atoms, virial, rtol=0.0, atol=TIGHT_RUN * scale), row
        found[block] = virial
    assert np.abs(found[0] - found[1]).max() > 0.01 * np.abs(found[1]).max(), "control"


def test_no_virial_is_left_where_no_damping_acts(lmp_decks, body):
    """The same state under fix nve has the same pressure, global and summed over atoms, though atoms came since: in a minimization, and with gamma of zero.
    Control: the damping of the run before changed it."""
    read = """
compute virial all pressure NULL virial
compute each all stress/atom NULL virial
compute sum all reduce sum c_each[1] c_each[5]
""" + thermo("c_virial[1] c_virial[4] c_sum[1] c_sum[2]")
    deck = flight(boundary="f f f", contact="none").replace("thermo_style", "#") + read + "run 3\ncreate_atoms 1 single 0.09 0.05 0.05\n"
    deck += "set atom $(count(all)) diameter 0.01\nset atom $(count(all)) density 2700\n"
    other = "unfix integrate\nfix integrate all nve\n"
    for then in ("min_modify dmax 1e-9\nthermo 1\nminimize 0 0 2 9\n", "pair_coeff * * 80 8 4 3 8 4 0.005 0 1.5\nrun 0\n"):
        ours, plain = lmp_decks({"nve/evp": deck + then, "nve": deck + other + then}, 2).values()
        names = ("c_virial[1]", "c_virial[4]", "c_sum[1]", "c_sum[2]")
        left, expected = (np.array([run.thermo()[name] for name in names]) for run in (ours, plain))
        assert np.allclose(left, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max()), then
        assert abs(ours.thermo(0)["c_virial[1]"][-1] / expected[0][0] - 1.0) > 0.01, "control"


TORN = head("off", before="processors 1 1 *", skin=0.0005, start="""lattice fcc 0.01
region box block -0.03 0.09 -0.03 0.09 -0.05 0.12 units box
create_box 2 box
region slab block 0 4 0 4 -1 0.6
region ball block 1 3 1 3 1 3
create_atoms 1 region slab
create_atoms 2 region ball
set group all diameter 0.00707 density 2700
displace_atoms all random 0.0006 0.0006 0.0006 1 units box
group ball type 2""") + pair(law.TABLE1._replace(e2=9.0, gamma=500.0), "repulsive break 0.1", "fix bonds all evp/bonds within type") + """
displace_atoms ball move 0.0003 0.0007 0.0025 units box
velocity ball set 3 1 -60 units box
fix 1 all nve/evp
timestep 2e-7
variable px equal vcm(all,x)
variable pz equal vcm(all,z)
thermo 400
""" + thermo("v_px v_pz f_bonds[5]") + "run 400\n"


def test_momentum_is_kept_where_bonds_break_on_one_rank(lmp):
    """Without newton both ranks of a pair have its damper, and start the solve from the same force."""
    table = lmp(TORN, 3).ok().thermo()
    assert table["f_bonds[5]"][-1] > 0
    for column in ("v_px", "v_pz"):
        assert table[column][-1] == pytest.approx(table[column][0], rel=1e-12)


# ---- bodies that turn: dampers see the opening rate of the step, so that turning alone strains nothing; of many atoms: test_robust_bodies.py ----

GAP, RADIUS = 0.0085, 0.0045
MASS = mass_of(RADIUS)
ROW = law.Row(e1=50.0, m1=6.0, n1=3.0, e2=2.0, m2=6.0, n2=3.0, xi_s=0.006, gamma=0.0, alpha=1.6)
STIFFNESS = ROW.m1 * ROW.n1 * ROW.e1 / GAP**2
WITHIN = 0.01  # of the centrifugal strain: the demand; (w dt)^2/6 of it, which is a leapfrog's, and the strain itself
LEDGER = 1e-3  # of the kinetic energy

SPIN = velocities("-{spin}*y", "{spin}*x") + """fix move all {style}
fix energy all evp/energy
variable d equal sqrt((x[1]-x[2])^2+(y[1]-y[2])^2+(z[1]-z[2])^2)
variable w equal omega(all,z)
variable l equal angmom(all,z)
thermo {every}
""" + thermo("time dt v_d v_w v_l ke f_energy f_energy[6] f_bonds[2]")


def spin_deck(gamma, spin, angle, time, style="nve/evp", newton="on", boundary="f f f", more=""):
    """A pair that spins about z, 20 rows; angle: w dt."""
    steps = 20 * int(np.ceil(time * spin / angle / 20))
    text = head(newton, boundary, skin=0.001) + pair(ROW._replace(gamma=gamma), "none")
    return text + SPIN.format(spin=spin, style=style, every=steps // 20) + f"timestep {angle / spin:.17g}\n{more}\nrun {steps}\n"


def spin_pair(lmp, folder, *choices, ranks=1, **more):
    write_two(folder / "body.data", GAP, (RADIUS, RADIUS))
    return lmp(spin_deck(*choices, **more), ranks).ok()


def strain_over_centrifugal(table):
    """m w^2/(2K) is what the spring needs to hold half of d at w."""
    strain = table["v_d"] / GAP - 1.0
    return strain[1:] / (0.5 * MASS * table["v_w"][1:] ** 2 / STIFFNESS)


def test_pair_that_spins_has_its_centrifugal_strain(lmp_decks, tmp_path):
    """After eight times the time gamma/K in which it settles. (With the velocity along the old direction it is gamma w^2 dt/2K,
    100 to 1e6 times too large.)"""
    write_two(tmp_path / "body.data", GAP, (RADIUS, RADIUS))
    choices = [(600.0, 2500.0, 0.15), (600.0, 4000.0, 0.06), (4e4, 900.0, 0.15), (4e4, 2500.0, 0.03), (2e6, 900.0, 0.1)]
    decks = {(gamma, spin, angle): spin_deck(gamma, spin, angle, 8.0 * gamma / STIFFNESS) for gamma, spin, angle in choices}
    for choice, run in lmp_decks(decks).items():
        table = run.thermo()
        assert strain_over_centrifugal(table)[-1] == pytest.approx(1.0, abs=WITHIN), choice
        assert table["f_bonds[2]"].max() == 0
        assert np.abs(table["v_l"] / table["v_l"][0] - 1.0).max() < 1e-10, choice
        assert np.abs(table["f_energy"]).max() < LEDGER * table["KinEng"][0], choice
        assert table["f_energy[6]"].min() >= 0.0 and np.all(np.diff(table["f_energy[6]"]) >= 0.0), choice
        # what it takes to stretch a spring by a damper: as much as is stored
        stored = 0.5 * STIFFNESS * (table["v_d"][-1] - GAP) ** 2
        assert table["f_energy[6]"][-1] == pytest.approx(stored, rel=0.6), "control: damping acts"


def test_explicit_damping_pulls_a_spinning_pair_together(lmp, tmp_path):
    """By gamma w^2 d dt/2, as its page says: a share gamma dt/m of the strain."""
    gamma, spin, step = 600.0, 3000.0, 4e-8
    table = spin_pair(lmp, tmp_path, gamma, spin, spin * step, 8.0 * gamma / STIFFNESS, "nve").thermo()
    assert strain_over_centrifugal(table)[-1] - 1.0 == pytest.approx(-gamma * step / MASS, abs=2e-3 + 4e-4)  # what settles, the strain itself


def test_timestep_follows_the_turning(lmp, tmp_path):
    """fix dt/evp allows 0.1 rad per step to a pair that fix nve/evp damps, and says that it is the turning. Control: without
    damping turning does not count."""
    spin = 300.0
    run = spin_pair(lmp, tmp_path, 1e6, spin, 0.05, 0.02, more="fix dt all dt/evp 1 0.4\nthermo_style custom step dt f_dt[2] f_dt[3] v_w")
    table = run.thermo()
    assert table["f_dt[3]"][-1] == 5
    assert table["Dt"][-1] * table["v_w"][-1] == pytest.approx(0.1, rel=0.01)
    assert sum("the rotation of pairs limits the timestep" in line for line in run.warnings()) == 1
    plain = spin_pair(lmp, tmp_path, 0.0, spin, 0.001, 0.001, "nve", more="fix dt all dt/evp 1 0.4\nthermo_style custom step dt f_dt[3]").thermo()
    assert plain["f_dt[3]"][-1] != 5


def test_turning_too_far_in_a_step_is_warned_of(lmp, tmp_path):
    for angle, warned in ((0.14, 0), (0.2, 1)):
        run = spin_pair(lmp, tmp_path, 1e5, 400.0, angle, 0.02)
        assert sum("rotated by more than 0.15 rad per step" in line for line in run.warnings()) == warned


def test_turning_beyond_all_passes_is_warned_of(lmp, tmp_path):
    """Said once a run, with the remedy; not where round-off leaves little more than the tolerance, as in some steps at 0.14 rad."""
    for angle, warned in ((0.14, 0), (1.5, 1)):
        write_two(tmp_path / "body.data", GAP, (RADIUS, RADIUS))
        run = lmp(spin_deck(1e6, 400.0, angle, 3.0))
        found = [line for line in run.warnings() if "far above its tolerance after 20 passes" in line]
        assert len(found) == warned and all("reduce the timestep" in line for line in found)


TURNTABLE = """
group grip id 1
group free id 2
variable vy atom {spin}*x
velocity all set 0 v_vy 0
{fixes}
variable d equal sqrt((x[1]-x[2])^2+(y[1]-y[2])^2)
timestep {step:.17g}
thermo {every}
""" + thermo("v_d ke f_energy f_energy[6]")


@pytest.mark.parametrize("gamma, angle, ranks, newton", [(1e3, 0.01, 1, "on"), (2e4, 0.008, 2, "off"), (5e5, 0.002, 1, "on")])
def test_atom_that_turns_with_a_moved_one(lmp_decks, tmp_path, gamma, angle, ranks, newton):
    """A turntable: sphere 1 is moved along a circle by fix move rotate, sphere 2 outside it is free. The moved one enters with its velocity
    over the step, not with that at its place: the strain is m w^2 r d/(K d^2). (It was too large by gamma dt/2m.)"""
    spin, inner = 400.0, 0.018
    x = np.array([[inner, 0.0, 0.0], [inner + GAP, 0.0, 0.0]])
    write_data(tmp_path / "body.data", x, (RADIUS, RADIUS), [[-0.2, 0.2]] * 3)
    fixes = [f"fix turn grip move rotate 0 0 0 0 0 1 {2.0 * np.pi / spin:.17g}", "fix integrate free nve/evp"]
    steps = int(np.ceil(8.0 * gamma / STIFFNESS * spin / angle / 20)) * 20
    text = head(newton, skin=0.001) + pair(ROW._replace(gamma=gamma), "none")
    decks = {}
    for first, second in (fixes, fixes[::-1]):
        lines = f"{first}\n{second}\nfix energy all evp/energy"
        decks[first] = text + TURNTABLE.format(spin=spin, fixes=lines, step=angle / spin, every=steps // 20) + f"run {steps}\n"
    for first, run in lmp_decks(decks, ranks).items():
        table = run.thermo()
        strain = table["v_d"] / GAP - 1.0
        assert strain[-1] == pytest.approx(MASS * spin**2 * (inner + GAP) / (STIFFNESS * GAP), rel=WITHIN), first
        assert np.abs(table["f_energy"]).max() < LEDGER * table["KinEng"][0], first
