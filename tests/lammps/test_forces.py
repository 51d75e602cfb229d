# SPDX-License-Identifier: GPL-2.0-only
"""Forces, energies and virials of a body in mid-deformation equal the sum over all pairs of tests/oracle/law.py, and what compute pair/local shows adds up to them;
the brute force knows neither lists nor ranks."""

import numpy as np
import pytest
from lammps_run import write_data, write_state
from oracle import brute, law
from small_bodies import ROUND_OFF, Body, dump, head, pair, scattered, thermo, wavy_velocities, words

UNLIKE = {
    (1, 1): law.Row(80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 400.0, 1.5),
    (1, 2): law.Row(50.0, 6.0, 3.0, 5.0, 7.5, 3.2, 0.010, 0.0, 1.4),
    (2, 2): law.Row(30.0, 12.0, 6.0, 9.0, 4.0, 2.0, 0.008, 900.0, 1.6),
}

DECK = """
pair_style evp/lj contact {contact}
{coeffs}
fix bonds all evp/bonds {zone}
fix hold all nve/noforce
timestep 1e-7
run 0
read_dump state.dump 0 x y z vx vy vz box no replace yes

compute e all pe/atom pair
compute s all stress/atom NULL pair
compute p all pressure NULL virial
""" + dump("forces.dump", 1) + """dump tallies all custom 2 tallies.dump id c_e c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] c_s[6]
dump_modify tallies format float %.17g
thermo 2
""" + thermo("pe c_p[1] c_p[2] c_p[3] c_p[4] c_p[5] c_p[6] vol f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[4]") + "run 2\n"

VOIGT = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@pytest.fixture(scope="module")
def periodic_body(tmp_path_factory):
    """216 spheres of two types in a periodic box, moved so far that bonds broke and new pairs met."""
    path = tmp_path_factory.mktemp("periodic") / "periodic.data"
    rng = np.random.default_rng(20170515)
    cells = np.array(np.meshgrid(*3 * [np.arange(6)], indexing="ij")).reshape(3, -1).T
    box = np.array([[0.0, 0.06], [-0.03, 0.03], [0.01, 0.07]])
    start = box[:, 0] + 0.01 * (cells + 0.5) + rng.uniform(-0.0015, 0.0015, (216, 3))
    radius = rng.uniform(0.0045, 0.0055, 216)
    types = 1 + rng.integers(0, 2, 216)
    write_data(path, start, radius, box, types)
    bonds = brute.record_bonds(start, radius, 1.3, box=np.ptp(box, axis=1))
    x = scattered(start + rng.uniform(-0.0004, 0.0004, (216, 3)), bonds, radius)
    x = box[:, 0] + np.mod(x - box[:, 0], np.ptp(box, axis=1))
    return Body(path, radius, types, bonds, x, wavy_velocities(x, 1.0), box)


def tensor_sums(found, v, count):
    """Virial of each atom (half of each own pair's) and the sum of |r||F| it is made of."""
    pairs, deq, _, _, row = found
    unit = pairs.r / pairs.d[:, None]
    f = law.force(pairs.d, deq, row)[:, None] * unit + law.damping_force(unit, v[pairs.i], v[pairs.j], row)
    half = 0.5 * np.stack([pairs.r[:, a] * f[:, b] for a, b in VOIGT], axis=1)
    size = 0.5 * pairs.d * np.linalg.norm(f, axis=1)
    virial, scale = np.zeros((count, 6)), np.zeros(count)
    for atoms in (pairs.i, pairs.j):
        np.add.at(virial, atoms, half)
        np.add.at(scale, atoms, size)
    return virial, scale


def deck(body, rows, contact, newton, boundary="f f f", zone=""):
    by_types = rows if isinstance(rows, dict) else {(1, 1): rows}
    coeffs = "\n".join(f"pair_coeff {a} {b} {words(row)}" for (a, b), row in by_types.items())
    return head(newton, boundary, f"read_data {body.data}") + DECK.format(contact=contact, coeffs=coeffs, zone=zone)


def compare(run, body, rows, contact, periodic=None):
    """periodic: the lengths of a box that is."""
    table = run.thermo()
    steps = run.dump("forces.dump")
    tallied = {snapshot.step: snapshot for snapshot in run.dump("tallies.dump")}
    assert [snapshot.step for snapshot in steps] == [0, 1, 2] and sorted(tallied) == [0, 2]

    for snapshot in steps:
        x, v = snapshot.x, snapshot.v
        arguments = (body.radius, body.types, rows, body.bonds, contact)
        truth = brute.brute_force(x, v, *arguments, box=periodic)
        error = np.linalg.norm(snapshot.f - truth["force"], axis=1)
        assert np.max(error / (truth["abs_force"] + 1e-300)) < ROUND_OFF, f"forces of step {snapshot.step}"
        if snapshot.step not in tallied:
            continue

        row = list(table["Step"]).index(snapshot.step)
        assert abs(table["PotEng"][row] - truth["energy"]) < ROUND_OFF * np.abs(truth["pair_energy"]).sum()
        found = brute.interactions(x, body.radius, rows, body.bonds, contact, body.types, periodic)
        virial, size = tensor_sums(found, v, len(x))
        tally = tallied[snapshot.step]
        energies = np.zeros(len(x))
        for atoms in (truth["i"], truth["j"]):
            np.add.at(energies, atoms, np.abs(truth["pair_energy"]))
        assert np.all(np.abs(tally["c_e"] - truth["atom_energy"]) <= ROUND_OFF * energies)
        stress = tally.vectors(*(f"c_s[{k}]" for k in range(1, 7)))
        assert np.all(np.abs(-stress - virial) <= ROUND_OFF * size[:, None])
        pressure = np.array([table[f"c_p[{k}]"][row] for k in range(1, 7)])
        # the global virial is summed as x f over atoms and ghosts: its round-off scales with x, not r
        reach = np.abs(body.box).max() + 2.0 * 1.6 * body.radius.max()
        allowed = ROUND_OFF * reach * truth["abs_force"].sum()
        assert np.all(np.abs(pressure * table["Volume"][row] - virial.sum(axis=0)) < allowed)

        assert table["f_bonds"][row] == len(body.bonds)
        assert table["f_bonds[1]"][row] == truth["bonds_beyond"]
        assert table["f_bonds[2]"][row] == truth["bonds_second"]
        assert table["f_bonds[3]"][row] == truth["new_contacts"]
        assert table["f_bonds[4]"][row] == pytest.approx(truth["lowest"], rel=ROUND_OFF)
    return truth


def assert_rich(truth, contact):
    """The control: the state holds whatever the comparison is about."""
    assert truth["bonds_beyond"] >= 5
    assert truth["bonds_second"] > 100
    assert truth["bonds_second"] < len(truth["i"]) - 100
    assert (truth["new_contacts"] > 3) == (contact != "none")


@pytest.fixture
def state(tmp_path):
    """Writes the state of a body that the decks read."""
    return lambda body: write_state(tmp_path / "state.dump", body.x, body.v, body.box)


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (4, "off")])
def test_contact_modes(lmp_decks, state, pulled_body, ranks, newton):
    body = pulled_body._replace(x=scattered(pulled_body.x, pulled_body.bonds, pulled_body.radius))
    state(body)
    choices = [("literal", law.TABLE1), *((contact, law.TABLE2) for contact in ("literal", "repulsive", "none"))]
    runs = lmp_decks({(contact, row.gamma): deck(body, row, contact, newton) for contact, row in choices}, ranks)
    for (contact, row), run in zip(choices, runs.values()):
        assert_rich(compare(run, body, row, contact), contact)


@pytest.mark.parametrize("ranks, newton", [(1, "off"), (2, "off"), (4, "on")])
def test_two_types_in_a_periodic_box(lmp_decks, state, periodic_body, ranks, newton):
    state(periodic_body)
    runs = lmp_decks({contact: deck(periodic_body, UNLIKE, contact, newton, "p p p", "zone 1.3") for contact in ("literal", "repulsive")}, ranks)
    for contact, run in runs.items():
        truth = compare(run, periodic_body, UNLIKE, contact, np.ptp(periodic_body.box, axis=1))
        spans = np.abs(periodic_body.x[truth["i"]] - periodic_body.x[truth["j"]]).max(axis=1)
        assert np.sum(spans > 0.03) > 100, "control: bonds cross the boundary"
        assert_rich(truth, contact)


# ---- single() ----

SHOW = """
fix hold all nve/noforce
run 0
read_dump state.dump 0 x y z vx vy vz box no replace yes

compute ids all property/local patom1 patom2
compute pairs all pair/local dist eng force p3
dump pairs all local 1 pairs.dump c_ids[1] c_ids[2] c_pairs[*]
dump_modify pairs format float %.17g
""" + dump("atoms.dump", 1) + thermo("pe") + "run 0\n"


@pytest.mark.parametrize("ranks, newton, contact, gamma", [(1, "on", "none", 0), (2, "off", "repulsive", 1000), (4, "on", "literal", 1000)])
def test_pair_local_adds_up(lmp, tmp_path, pulled_body, ranks, newton, contact, gamma):
    """Each pair stands there once, energies and forces of the pairs add up to those of the run; deq, strain and regime: test_state_values.py."""
    body = pulled_body._replace(x=scattered(pulled_body.x, pulled_body.bonds, pulled_body.radius))
    write_state(tmp_path / "state.dump", body.x, body.v, body.box)
    row = law.TABLE1._replace(gamma=gamma)
    run = lmp(head(newton, start=f"read_data {body.data}") + pair(row, contact) + SHOW, ranks=ranks).ok()
    atoms, pairs = run.dump("atoms.dump")[-1], run.dump("pairs.dump")[-1]
    i, j = (pairs[f"c_ids[{k}]"].astype(int) - 1 for k in (1, 2))
    d, energy, force, regime = (pairs[f"c_pairs[{k}]"] for k in range(1, 5))
    x, v = atoms.x, atoms.v

    key = np.minimum(i, j) * len(x) + np.maximum(i, j)
    assert len(np.unique(key)) == len(key), "once"
    truth = brute.brute_force(x, v, body.radius, body.types, row, body.bonds, contact)
    assert abs(energy.sum() - run.thermo()["PotEng"][-1]) < ROUND_OFF * np.abs(energy).sum()
    on_i = force[:, None] * (x[i] - x[j]) / d[:, None]
    total, scale = np.zeros_like(x), np.zeros(len(x))
    for own, sign in ((i, 1.0), (j, -1.0)):
        np.add.at(total, own, sign * on_i)
        np.add.at(scale, own, np.abs(force))
    error = np.linalg.norm(total - atoms.f, axis=1)
    assert np.max(error / scale) < ROUND_OFF

    # regime 0 is a pair that does not act
    assert np.all((energy == 0.0) & (force == 0.0) | (regime > 0.0))
    assert np.sum(regime > 0.0) == len(truth["i"])
    assert (truth["new_contacts"] > 3) == (contact != "none"), "control: new pairs act"
