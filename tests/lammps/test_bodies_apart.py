# SPDX-License-Identifier: GPL-2.0-only
"""fix nve/evp solves each connected body by itself: what one does changes nothing in another, on any number of MPI ranks."""

import numpy as np
import pytest
from evp import law
from lammps_run import write_data
from small_bodies import ANOTHER_ORDER, SPACING, Small, dump, head, lattice_body, mass_of, pair, record, thermo, truth, velocities, words, write_body

DEFAULT_TOL = 1e-3
STEP = 4e-6  # [s]
layouts = pytest.mark.parametrize("ranks, newton, processors", [(1, "on", "* * *"), (2, "off", "1 2 1"), (4, "on", "4 1 1")])

FLY = f"fix integrate all nve/evp\ntimestep {STEP}\n" + thermo("pe ke f_integrate f_integrate[1] f_integrate[2]")


def shown(every):
    return dump(every=every) + f"thermo {every}\n"


# ---- two bodies far apart ----

VIOLENT, STILL = 120.0, 3e-5  # [m/s] speeds inside body 1 and body 2
GAP = 0.09  # [m] at two and four ranks along x some have no body at all


def flight_of_two(processors, newton, without):
    """40 steps; `without`: the type that is not there. Damping in body 2 is 200 times that of body 1."""
    deck = head(newton, before=f"processors {processors}")
    if without != "none":
        deck += f"group without type {without}\ndelete_atoms group without compress no\n"
    deck += "pair_style evp/lj contact none\n"
    for i, j in ((1, 1), (2, 2), (1, 2)):
        deck += f"pair_coeff {i} {j} {words(law.TABLE1._replace(gamma=25.0 if max(i, j) == 1 else 5000.0))}\n"
    deck += f"fix bonds all evp/bonds\nvariable speed atom (type==1)*{VIOLENT}+(type==2)*{STILL}\n"
    deck += velocities("v_speed*sin(1.7*id)", "v_speed*cos(2.9*id)", "v_speed*sin(0.6*id+1)")
    return deck + FLY + shown(2) + "run 20\nrun 20\n"


@layouts
def test_a_still_body_does_not_notice_a_violent_one(lmp_decks, tmp_path, ranks, newton, processors):
    """A copy of the first of another type: its motion is that without the other, to the tolerance at every dump. (With one tolerance over both its velocities
    were several times too large.)"""
    one, n = lattice_body((3, 3, 3), seed=5), 27
    box = np.array([[-0.02, 0.03 + GAP + 0.05], [-0.02, 0.05], [-0.02, 0.05]])
    write_data(tmp_path / "body.data", np.concatenate([one.x, one.x + [0.03 + GAP, 0.0, 0.0]]), np.tile(one.radius, 2), box, np.repeat([1, 2], n))
    runs = lmp_decks({without: flight_of_two(processors, newton, without) for without in ("none", "1")}, ranks)
    both, alone = (run.dump("all.dump") for run in runs.values())
    assert len(both) == len(alone) > 15
    largest = [np.abs(snapshot.v).max() for snapshot in alone]
    for snapshot, same, scale in zip(both, alone, largest):
        second = snapshot.v[n:]
        assert np.abs(second - same.v).max() <= DEFAULT_TOL * scale, snapshot.step
    assert largest[-1] < 0.6 * largest[0], "control: damping acts"


# ---- many bodies ----


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (4, "off")])
def test_two_thousand_pairs_are_two_thousand_bodies(lmp, tmp_path, ranks, newton):
    """Pairs of spheres along x, with nothing but damping. One dashpot is solved in one iteration, so all are, whatever their masses and speeds: openings
    fall by 1 + h per step, exactly, from 1 to 1e-170 in an order that has nothing to do with IDs. Each pair flies too, and its speed has roundings; openings
    below 1e-138 are rest, as their squares underflow."""
    n, gamma, decades = 2000, 700.0, 170
    radius = np.random.default_rng(11).uniform(0.004, 0.005, (n, 2))
    x = np.zeros((n, 2, 3))
    x[:, :, 0] = 0.03 * (np.arange(n)[:, None] + 0.5) + 0.5 * radius.sum(axis=1)[:, None] * [-1.0, 1.0]
    write_data(tmp_path / "body.data", x.reshape(-1, 3), radius.ravel(), [[-0.01, 0.03 * n + 0.01], [-0.02, 0.02], [-0.02, 0.02]])
    rate, start = (1.0 / mass_of(radius)).sum(axis=1), 10.0 ** -(decades * np.abs(np.sin(1.7 * np.arange(n))))
    deck = head(newton, before=f"processors {ranks} 1 1") + pair(law.TABLE2._replace(e1=0.0, e2=0.0, gamma=gamma), "none")
    deck += "variable k atom floor((id-1)/2)\n" + velocities(f"exp(-{decades}*ln(10)*abs(sin(1.7*v_k)))*(2*(id-1-2*v_k)-1)")
    run = lmp(deck + FLY + shown(5) + "run 10\n", ranks).ok()
    for snapshot in run.dump("all.dump"):
        v = snapshot["vx"].reshape(-1, 2)
        expected = 2.0 * start * (1.0 + STEP * gamma * rate) ** -snapshot.step
        assert np.all(np.abs(v[:, 1] - v[:, 0] - expected) <= 1e-12 * start + 1e-138), snapshot.step
        assert snapshot.step == 0 or np.all(expected < 0.9 * start), "control"
    assert run.thermo()["f_integrate[2]"][-1] == 1


# ---- one body ----


@pytest.mark.parametrize("newton", ["on", "off"])
def test_a_chain_that_crosses_ranks_many_times_is_one_body(lmp, tmp_path, newton):
    """It winds to and fro across the plane between two ranks, its IDs at random: one and the same solve, to roundings."""
    rows, across = 12, np.arange(-2.5, 3.0)
    x = []
    for row in range(rows):
        x += [(s, 3.0 * row, 0.0) for s in (across if row % 2 == 0 else across[::-1])]
        x += [(x[-1][0], 3.0 * row + up, 0.0) for up in (1.0, 2.0)]
    x = SPACING * np.random.default_rng(7).permutation(x)
    write_data(tmp_path / "body.data", x, np.full(len(x), 0.005), [[-0.05, 0.05], [-0.02, 0.03 * rows + 0.02], [-0.02, 0.02]])
    stir = velocities("sin(1.1*id*id)", "cos(2.3*id)")
    ends = []
    for ranks, processors in ((1, "* * *"), (2, "2 1 1"), (4, "2 2 1")):
        deck = head(newton, before=f"processors {processors}") + pair(law.TABLE2._replace(gamma=20000.0), "none") + stir
        run = lmp(deck + FLY + shown(10) + "run 30\n", ranks).ok()
        ends.append((run.dump("all.dump")[-1].v, run.thermo()["f_integrate"]))
    for v, iterations in ends[1:]:
        assert np.abs(v - ends[0][0]).max() <= ANOTHER_ORDER * np.abs(v).max()
        assert np.array_equal(iterations, ends[0][1])
    assert iterations.min() > 10, "control"


@layouts
def test_bodies_that_meet_become_one(lmp, tmp_path, ranks, newton, processors):
    """Two lumps fly at each other and touch. At every dump the force on each atom is that of the law with the velocity that
    the damping was solved for, v+ = v + dt f/2m, so that the solve knew of the dampers between the lumps."""
    lump, gap, row = lattice_body((2, 2, 2), seed=3), 0.0006, law.TABLE2._replace(gamma=300.0)
    wide = np.ptp(lump.x[:, 0]) + 2.0 * lump.radius.max() + gap
    x = np.concatenate([lump.x, lump.x + [wide, 0.0, 0.0]])
    radius, types = np.tile(lump.radius, 2), np.ones(2 * len(lump.x), dtype=int)
    box = np.array([[-0.02, 0.07], [-0.02, 0.04], [-0.02, 0.04]])
    zone = 1.5
    bonds = {ids: d for ids, d in record(x, radius, zone, np.zeros((3, 3))).items() if max(ids) <= 8 or min(ids) > 8}
    body = Small(x, radius, types, box, np.zeros((3, 3)), bonds)
    write_body(tmp_path / "body.data", body)
    with open(tmp_path / "lumps.bonds", "w", encoding="utf-8") as out:
        out.write(f"# EVP bonds COUNT: {len(bonds)} UNITS: si\n")
        out.writelines(f"{i} {j} {deq:.17g}\n" for (i, j), deq in bonds.items())
    deck = head(newton, before=f"processors {processors}", skin=0.0003)
    deck += pair(row, "repulsive", "fix bonds all evp/bonds file lumps.bonds")
    deck += velocities("20-40*(id>8)+sin(1.3*id)")
    run = lmp(deck + FLY + shown(5) + "run 60\n", ranks).ok()
    mass, touched = mass_of(radius), 0
    for snapshot in run.dump("all.dump")[1:]:
        v, f = snapshot.v, snapshot.f
        after = v + 0.5 * STEP * f / mass[:, None]
        found = truth(snapshot.x, after, body, row, "repulsive", step=STEP)
        assert np.abs(f - found["force"]).max() <= 0.02 * np.abs(found["force"]).max(), snapshot.step
        touched += any(min(i, j) < 8 <= max(i, j) for i, j in zip(found["i"], found["j"]))
    assert 0 < touched < 11, "control"
