# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/law.py, tests/oracle/law.py, brute.py and network.py: the truth that the LAMMPS tests compare with."""

import itertools
import pathlib

import numpy as np
import pytest
from evp import specimen
from oracle import brute, law, network

DATA = pathlib.Path(__file__).resolve().parents[1] / "data"
REFERENCE = 1e-12  # see tests/unit/test_law.cpp: the same scale, the same reason
ROUND_OFF = 1e-13  # of sums of a few dozen terms, of the sum of their sizes


@pytest.fixture(scope="module")
def table():
    """The 60-digit table as a dict of columns, and the row of each line."""
    columns = np.genfromtxt(DATA / "law_reference.csv", delimiter=",", names=True)
    assert len(columns) > 1000
    nothing = np.zeros(len(columns))
    row = law.Row(*(columns[name] for name in law.Row._fields[:7]), nothing, nothing + 1.5)
    return columns, row


def scale_of(row):
    """Steeper stiffness at rest times deq^2 [energy]: what round-off is measured with."""
    return np.maximum(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2)


def largest_error(found, true, least):
    return np.max(np.abs(found - true) / np.maximum(np.abs(true), least))


def test_force_energy_and_stiffness_hold_to_twelve_digits(table):
    ref, row = table
    d, deq = ref["d"], ref["deq"]
    scale = scale_of(row)
    assert largest_error(law.force(d, deq, row), ref["force"], scale * row.xi_s / deq) < REFERENCE
    energy = law.energy(d, deq, row, ref["dcut"])
    assert largest_error(energy, ref["energy"], scale * row.xi_s) < REFERENCE
    decided = ref["regime"] > 0
    assert np.array_equal(law.regime(d, deq, row)[decided], ref["regime"][decided])
    slope, true, least = (
        values[decided] for values in (law.stiffness(d, deq, row), ref["stiffness"], scale / deq**2)
    )
    assert largest_error(slope, true, least) < REFERENCE


@pytest.mark.parametrize(
    "words, rule",
    [
        ("80 4 8 3 8 4 0.005 0 1.5", "m > n > 0"),
        ("80 4.0003 4 3 8 4 0.005 0 1.5", "m must exceed n by at least"),
        ("80 8 4 3 0.0009 0.00085 0.005 0 1.5", "m must exceed n by at least"),
        ("-80 8 4 3 8 4 0.005 0 1.5", "zero or positive"),
        ("80 8 4 3 8 4 0 0 1.5", "xi_s"),
        ("80 8 4 3 8 4 0.005 0 1", "alpha"),
        ("80 8 4 3 8 4 nan 0 1.5", "finite"),
        ("80 8 4 3 8 4 0.005 0", "got 8"),
    ],
)
def test_bad_rows_are_refused_with_their_rule(words, rule):
    with pytest.raises(ValueError, match=rule):
        law.Row.parse(words)


def test_stored_energy_holds_at_any_strain():
    """Against 60 digits, down to strains of the last bit of d; the parts are those of src/core/law.h too."""
    ref = np.genfromtxt(DATA / "stored_reference.csv", delimiter=",", names=True)
    nothing = np.zeros(len(ref))
    row = law.Row(*(ref[name] for name in law.Row._fields[:7]), nothing, nothing + 1.5)
    first, second = law.stored(ref["d"], ref["deq"], row)
    total = ref["first"] + ref["second"]
    assert np.sum((np.abs(ref["d"] / ref["deq"] - 1) < 2e-10) & (total > 0)) > 100
    assert np.all(np.abs(first - ref["first"]) <= REFERENCE * ref["first"])
    # numpy has no fused multiply-add: near the threshold, xi - xi_s is rounded to the last bit of xi_s
    rounded = np.abs(law.force(ref["d"], ref["deq"], row)) * ref["deq"] * 3e-16 * row.xi_s
    assert np.all(np.abs(second - ref["second"]) <= REFERENCE * total + rounded)


def test_exponents_may_come_as_close_as_the_rule_says():
    assert law.Row.parse("80 4.0005 4 3 0.0011 0.0009 0.005 0 1.5").m1 == 4.0005


# A cloud of spheres in mid-deformation: bonds in both regimes and beyond dlim, new contacts.

MIXED = {
    (1, 1): law.TABLE2,
    (1, 2): law.Row(60.0, 7.5, 3.2, 4.0, 6.0, 3.0, 0.01, 300.0, 1.4),
    (2, 2): law.Row(90.0, 6.0, 3.0, 0.0, 2.0, 1.0, 0.004, 0.0, 1.6),
}


def cloud(seed=5, count=60, size=0.045):
    """x, v, radius, types and bonds of spheres at random, moved after their bonds were recorded."""
    random = np.random.default_rng(seed)
    x = random.uniform(0.0, size, (count, 3))
    radius = random.uniform(0.0045, 0.0055, count)
    bonds = brute.record_bonds(x, radius, 1.5)
    bonds = dict(itertools.islice(bonds.items(), 0, None, 2))  # every second: the rest is new
    x += random.normal(0.0, 3e-4, x.shape)
    return x, random.normal(0.0, 1.0, x.shape), radius, random.integers(1, 3, count), bonds


@pytest.mark.parametrize("contact", law.CONTACT_MODES)
def test_forces_are_minus_the_energy_gradient(contact):
    x, v, radius, types, bonds = cloud()

    def energy(moved):
        return brute.brute_force(moved, v, radius, types, MIXED, bonds, contact)["energy"]

    now = brute.brute_force(x, 0 * v, radius, types, MIXED, bonds, contact)
    assert now["bonds_second"] > 20 and (contact == "none") == (now["new_contacts"] == 0)
    step = 1e-8  # [m]: rounding of the energy and jumps of the slope at ds both stay below 1e-5
    for atom, axis in ((0, 0), (7, 1), (31, 2), (59, 0)):
        shift = np.zeros_like(x)
        shift[atom, axis] = step
        slope = (energy(x + shift) - energy(x - shift)) / (2 * step)
        assert abs(slope + now["force"][atom, axis]) < 1e-5 * now["abs_force"][atom]


@pytest.mark.parametrize("contact", law.CONTACT_MODES)
def test_pairs_act_equally_and_centrally(contact):
    x, v, radius, types, bonds = cloud()
    found = brute.brute_force(x, v, radius, types, MIXED, bonds, contact)
    scale = np.sum(found["abs_force"])
    assert np.all(np.abs(np.sum(found["force"], axis=0)) < ROUND_OFF * scale)
    torque = np.sum(np.cross(x, found["force"]), axis=0)
    assert np.all(np.abs(torque) < ROUND_OFF * scale * np.abs(x).max())
    # The virial of a free body is sum x_a F_b, whichever origin: an independent way to it.
    virial = x.T @ found["force"]
    assert np.all(np.abs(virial - found["virial"]) < ROUND_OFF * scale * np.abs(x).max())
    assert np.sum(found["atom_energy"]) == pytest.approx(found["energy"], rel=1e-12)


def test_damping_takes_energy_and_leaves_rigid_motion_alone():
    x, v, radius, types, bonds = cloud()
    still = brute.brute_force(x, 0 * v, radius, types, MIXED, bonds, "literal")
    damped = brute.brute_force(x, v, radius, types, MIXED, bonds, "literal")
    assert np.sum(damped["force"] * v) - np.sum(still["force"] * v) < 0.0
    rigid = np.array([1.0, 2.0, 3.0]) + np.cross([40.0, -20.0, 10.0], x)
    turned = brute.brute_force(x, rigid, radius, types, MIXED, bonds, "literal")
    scale = still["abs_force"][:, None] + 1e3 * np.abs(rigid).max()
    assert np.all(np.abs(turned["force"] - still["force"]) < 1e-11 * scale)


def test_a_body_at_its_recorded_distances_is_force_free():
    x, v, radius, _, _ = cloud()
    bonds = brute.record_bonds(x, radius, 1.5)
    found = brute.brute_force(x, 0 * v, radius, None, law.TABLE1, bonds, "literal")
    assert np.all(found["force"] == 0.0) and len(found["d"]) == len(bonds)
    # Control: with a smaller zone the pairs between zone and dlim pull with 121 % of yield.
    fewer = brute.record_bonds(x, radius, 1.3)
    pulled = brute.brute_force(x, 0 * v, radius, None, law.TABLE1, fewer, "literal")
    assert pulled["new_contacts"] == len(bonds) - len(fewer) > 0
    assert np.abs(pulled["force"]).max() > 1e3


def test_counts_of_two_spheres():
    """One pair moved by hand through every state that the fix counts."""
    radius, at_rest = np.array([0.005, 0.005]), {(1, 2): 0.01}

    def counts(d, bonds, contact="literal"):
        x = np.array([[0.0, 0.0, 0.0], [d, 0.0, 0.0]])
        got = brute.brute_force(x, 0 * x, radius, None, law.TABLE1, bonds, contact)
        names = ("bonds_beyond", "bonds_second", "new_contacts", "lowest")
        return tuple(got[name] for name in names)

    assert counts(0.01004, at_rest) == (0, 0, 0, pytest.approx(1.004))
    assert counts(0.01006, at_rest) == (0, 1, 0, pytest.approx(1.006))
    assert counts(0.00994, at_rest) == (0, 1, 0, pytest.approx(0.994))
    assert counts(0.01501, at_rest) == (1, 0, 0, np.inf)
    assert counts(0.0149, {}) == (0, 0, 1, pytest.approx(1.49))
    assert counts(0.0149, {}, "repulsive") == (0, 0, 0, np.inf)
    assert counts(0.0099, {}, "repulsive") == (0, 0, 1, pytest.approx(0.99))
    assert counts(0.0099, {}, "none") == (0, 0, 0, np.inf)


def test_a_new_pair_pulls_at_once_with_121_percent_of_the_yield_force():
    pull = law.force(1.5, 1.0, law.TABLE1) / law.force(1.005, 1.0, law.TABLE1)
    assert pull == pytest.approx(1.21, abs=0.01)


def test_periodic_images_change_nothing():
    x, v, radius, types, bonds = cloud()
    box = (0.05, None, 0.055)
    moved = x.copy()
    moved[:, 0] = np.mod(x[:, 0] + 0.033, box[0])
    moved[:, 2] = np.mod(x[:, 2] + 0.05, box[2])
    recorded, again = (brute.record_bonds(place, radius, 1.5, box) for place in (x, moved))
    assert recorded.keys() == again.keys()
    assert len(recorded) > len(brute.record_bonds(x, radius, 1.5)), "pairs must cross the boundary"
    here = brute.brute_force(x, v, radius, types, MIXED, bonds, "literal", box)
    there = brute.brute_force(moved, v, radius, types, MIXED, bonds, "literal", box)
    # 1e-17 m of rounding in x times the stiffness at rest, against forces near 1e4 N.
    scale = here["abs_force"][:, None]
    assert np.all(np.abs(here["force"] - there["force"]) < 1e-11 * scale)


def test_impossible_configurations_are_refused():
    x, v, radius, types, bonds = cloud()
    with pytest.raises(ValueError, match="contact must be one of"):
        brute.brute_force(x, v, radius, types, MIXED, bonds, "glued")
    with pytest.raises(ValueError, match="shorter than twice"):
        brute.brute_force(x, v, radius, types, MIXED, bonds, "none", (0.03, None, None))
    with pytest.raises(KeyError, match="types 1 and 2"):
        brute.brute_force(x, v, radius, types, {(1, 1): law.TABLE1}, bonds, "none")
    x[3] = x[9]
    with pytest.raises(ValueError, match="atoms 4 and 10 are at the same place"):
        brute.brute_force(x, v, radius, types, MIXED, bonds, "none")


@pytest.fixture(scope="module")
def body():
    """The reference specimen, its bonds and which atoms are between the grips."""
    read = specimen.read_data(DATA / "reference_500" / "specimen_500.data")
    free = (read.x[:, 0] >= 0.005) & (read.x[:, 0] <= 0.045)
    return read, brute.record_bonds(read.x, read.radius, 1.5), free


def test_step_limits_are_those_of_the_independent_prototype(body):
    """Figures of tests/data/reference_500/ORIGIN.md, given there to two to four digits."""
    read, bonds, free = body
    with_free_end = sum(bool(free[i - 1] or free[j - 1]) for i, j in bonds)
    assert (len(bonds), with_free_end, np.sum(~free)) == (2975, 2751, 90)
    common = (read.x, read.radius, read.mass)
    elastic = network.step_limits(*common, law.TABLE1, bonds, "literal", free)
    damped = network.step_limits(*common, law.TABLE2, bonds, "literal", free)
    assert damped["lamK"] == pytest.approx(4.911e12, rel=1e-3)
    assert damped["lamC"] == pytest.approx(5.689e7, rel=1e-3)
    assert elastic["dt_explicit"] == elastic["dt_elastic"] == pytest.approx(9.025e-7, rel=1e-3)
    assert damped["dt_explicit"] == pytest.approx(3.510e-8, rel=1e-3)
    assert damped["dt_eq7"] == pytest.approx(1.321e-7, rel=1e-3)
    assert elastic["dt_rows"] == pytest.approx(6.26e-7, rel=5e-3)
    assert damped["dt_rows"] == pytest.approx(1.62e-8, rel=5e-3)
    # Always safe: Gershgorin's discs hold every eigenvalue.
    assert elastic["dt_rows"] < elastic["dt_explicit"]
    assert damped["dt_rows"] < damped["dt_explicit"]


def test_step_limit_of_one_oscillator():
    """Mass on spring and dashpot to a wall: dt = (2/w)(sqrt(1 + z^2) - z), z the damping ratio."""
    x, radius = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]), np.array([0.005, 0.005])
    mass = np.array([0.0014, 0.0014])
    row = law.TABLE1._replace(gamma=2000.0)
    got = network.step_limits(x, radius, mass, row, {(1, 2): 0.01}, "none", [False, True])
    omega = np.sqrt(80 * 8 * 4 / 0.01**2 / mass[1])
    ratio = row.gamma / mass[1] / (2 * omega)
    assert got["dt_elastic"] == pytest.approx(2 / omega, rel=1e-10)
    assert got["dt_explicit"] == pytest.approx(2 / omega * (np.hypot(1, ratio) - ratio), rel=1e-8)


def test_stretched_pairs_keep_their_stiffness_at_rest_and_get_a_transverse_one():
    row = law.TABLE1
    for d in (1.02, 1.3):
        axial, transverse = network.pair_stiffness(d, 1.0, row)
        assert axial == row.m1 * row.n1 * row.e1
        assert transverse == pytest.approx(-law.force(d, 1.0, row) / d) and transverse > 0
    axial, transverse = network.pair_stiffness(0.997, 1.0, row)
    assert axial > row.m1 * row.n1 * row.e1 and transverse == 0.0


def test_a_stiffer_second_potential_counts_before_it_is_reached():
    row = law.TABLE1._replace(e2=200.0)
    for d in (0.997, 1.0, 1.003, 1.2):
        assert network.pair_stiffness(d, 1.0, row)[0] == pytest.approx(200 * 8 * 4, rel=1e-12)
    assert network.pair_stiffness(0.9, 1.0, row)[0] > 1.5 * 200 * 8 * 4


def test_a_body_without_free_atoms_has_no_limit(body):
    read, bonds, free = body
    got = network.step_limits(
        read.x, read.radius, read.mass, law.TABLE2, bonds, "literal", np.zeros_like(free)
    )
    assert all(got[name] == np.inf for name in got if name.startswith("dt_"))
