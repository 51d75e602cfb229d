# SPDX-License-Identifier: GPL-2.0-only
"""Timestep limits with fix evp/volume: against assembled matrices, and by running across them."""

import numpy as np
import pytest
from evp import law
from oracle import brute, network, volume
from lammps_run import write_state
from small_bodies import head, lattice_body, mass_of, pair, thermo, write_body

SETTLED = 2e-4  # Lanczos stops at 1e-4 of an eigenvalue
ITERATED = 1e-3  # the explicit step iterates to 1e-3 of its eigenvalue
LIMITS = "compute dt all evp/dt\n" + thermo("c_dt c_dt[*]") + "run 0\n"
CELLS = (4, 3, 3)


def matrices(x, body, row, kv):
    """Dense M^-1/2 A M^-1/2 of K, C and of the volume energy in K; K as compute evp/dt defines it."""
    free = np.ones(len(x), dtype=bool)
    half = np.repeat(1.0 / np.sqrt(mass_of(body.radius)), 3)
    scale = half[:, None] * half[None, :]
    pairs, deq, cut, bonded, rows = brute.interactions(x, body.radius, row, body.bonds, "none")
    assert np.all(bonded)
    i, j = np.array(list(body.bonds)).T - 1
    recorded = np.array(list(body.bonds.values()))
    dlim = row.alpha * (body.radius[i] + body.radius[j])
    w, total = volume.weights(i, j, recorded, dlim, len(x))
    found = volume.evaluate(x, i, j, recorded, dlim, kv)
    place = {pair: n for n, pair in enumerate(zip(i.tolist(), j.tolist()))}
    order = [place[pair] for pair in zip(pairs.i.tolist(), pairs.j.tolist())]
    axial, _ = network.pair_stiffness(pairs.d, deq, rows)
    tension = -(law.force(pairs.d, deq, rows) + found.pair_force[order]) / pairs.d
    stiff = network.assemble(pairs, axial, np.maximum(0.0, tension), free).toarray()

    b = np.zeros((len(x), 3 * len(x)))
    slope = (w[order] / deq)[:, None] * pairs.r / pairs.d[:, None]
    for p, (a, c) in enumerate(zip(pairs.i, pairs.j)):
        for centre in (a, c):
            b[centre, 3 * a:3 * a + 3] += slope[p]
            b[centre, 3 * c:3 * c + 3] -= slope[p]
    of_volume = b.T @ ((9.0 * kv / total**2)[:, None] * b)
    viscous = network.assemble(pairs, rows.gamma, np.zeros_like(axial), free).toarray()
    return (stiff + of_volume) * scale, viscous * scale, of_volume * scale


def state(tmp_path, stretch):
    body = lattice_body(CELLS)
    write_body(tmp_path / "body.data", body)
    x = body.x * [1.0 + stretch, 1.0 - 0.25 * stretch, 1.0 - 0.25 * stretch]
    write_state(tmp_path / "state.dump", x, 0.0 * x, body.box)
    return body, x


def limits(lmp, row, kv, style="nve", ranks=1, newton="on"):
    text = head(newton) + pair(row, "none") + (f"fix volume all evp/volume {kv}\n" if kv else "") + f"fix move all {style}\n"
    text += "run 0\nread_dump state.dump 0 x y z vx vy vz box no replace yes\n" + LIMITS
    return {name: values[-1] for name, values in lmp(text, ranks).ok().thermo().items()}


@pytest.mark.parametrize("stretch", [0.0, 0.04, -0.04])
@pytest.mark.parametrize("gamma", [0.0, 300.0])
def test_explicit_limits_are_those_of_the_matrices(lmp, tmp_path, stretch, gamma):
    """The largest eigenvalue with the many-body term whole; row sums never above. Control: the term matters."""
    row, kv = law.TABLE1._replace(gamma=gamma), 3000.0
    body, x = state(tmp_path, stretch)
    stiff, viscous, _ = matrices(x, body, row, kv)
    elastic = 2.0 / np.sqrt(np.linalg.eigvalsh(stiff)[-1])
    rows = network.stable_step(np.abs(stiff).sum(axis=1), np.abs(viscous).sum(axis=1)).min()
    plain = limits(lmp, row, 0)
    for ranks, newton in ((1, "on"), (2, "off"), (4, "on")):
        found = limits(lmp, row, kv, "nve", ranks, newton)
        assert found["c_dt[1]"] == pytest.approx(elastic, rel=SETTLED)
        assert found["c_dt"] == found["c_dt[2]"]
        step = found["c_dt[2]"]
        assert np.linalg.eigvalsh(step**2 * stiff + 2.0 * step * viscous)[-1] == pytest.approx(4.0, rel=2.0 * ITERATED)
        assert 0.2 * rows < found["c_dt[5]"] <= rows * (1.0 + 1e-9) <= step * (1.0 + ITERATED)
        assert found["c_dt[1]"] < 0.8 * plain["c_dt[1]"]


@pytest.mark.parametrize("stretch", [0.0, 0.04, -0.04])
@pytest.mark.parametrize("kv", [300.0, 3000.0, 30000.0])
@pytest.mark.parametrize("gamma", [0.0, 100.0, 1000.0, 30000.0])
def test_every_implicit_step_up_to_the_bound_is_stable(lmp, tmp_path, gamma, kv, stretch):
    """dt^2 K <= 4 M + 2 dt C in a dense eigensolver, below the bound as well: each bond damps its share of the volume."""
    row = law.TABLE1._replace(gamma=gamma)
    body, x = state(tmp_path, stretch)
    stiff, viscous, _ = matrices(x, body, row, kv)
    found = limits(lmp, row, kv, "nve/evp")
    bound = found["c_dt[3]"]
    assert found["c_dt"] == bound >= found["c_dt[1]"]
    for part in (0.05, 0.3, 0.7, 1.0):
        step = part * bound
        assert np.linalg.eigvalsh(step**2 * stiff - 2.0 * step * viscous)[-1] <= 4.0 * (1.0 + SETTLED), part
    if gamma == 30000.0:
        assert bound > 4.0 * found["c_dt[1]"], "control: damping helps"
    if gamma == 0.0:
        assert bound == pytest.approx(found["c_dt[1]"], rel=1e-9)


SWING = """
variable vx atom 1e-4*sin(1.1*id)
variable vy atom 1e-4*cos(2.3*id)
velocity all set v_vx v_vy 0
velocity all zero linear
fix move all {style}
compute dt all evp/dt
""" + thermo("ke pe c_dt") + """
run 0
variable dt equal {fraction}*$(c_dt:%.17g)
timestep $(v_dt:%.17g)
uncompute dt
thermo_style custom step ke pe
thermo 50
run {steps}
"""


def grows(lmp, gamma, fraction, style="nve", steps=2000):
    text = head() + pair(law.TABLE1._replace(gamma=gamma), "none", "fix bonds all evp/bonds zone 1.4")
    run = lmp(text + "fix volume all evp/volume 3000\n" + SWING.format(style=style, fraction=fraction, steps=steps))
    return run.returncode != 0 or run.thermo()["KinEng"].max() > 2.0 * run.thermo()["KinEng"][0]


@pytest.mark.parametrize("gamma", [0.0, 300.0])
def test_bisection_finds_the_explicit_limit(lmp, tmp_path, gamma):
    """The largest step at which nothing grows: never below that of compute evp/dt, nor above it by more than 2 %."""
    write_body(tmp_path / "body.data", lattice_body(CELLS))
    low, high = 0.9, 1.1
    assert not grows(lmp, gamma, low) and grows(lmp, gamma, high)
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(lmp, gamma, middle) else (middle, high)
    assert 0.99 < low <= high < 1.02


@pytest.mark.parametrize("gamma", [0.0, 100.0, 3000.0])
def test_the_implicit_bound_holds_in_runs(lmp, tmp_path, gamma):
    write_body(tmp_path / "body.data", lattice_body(CELLS))
    assert not grows(lmp, gamma, 0.98, "nve/evp tol 1e-6")


def test_fix_dt_evp_follows_the_volume_energy(lmp, tmp_path):
    write_body(tmp_path / "body.data", lattice_body(CELLS))
    text = head() + pair() + "fix volume all evp/volume {}\nfix move all nve\nfix step all dt/evp 10 0.4\ncompute dt all evp/dt\n"
    steps = [lmp(text.format(kv) + thermo("dt c_dt") + "run 10\n").ok().thermo() for kv in (0, 3000)]
    for table in steps:
        assert table["Dt"][0] == pytest.approx(0.4 * table["c_dt"][0], rel=1e-9)
    assert steps[1]["Dt"][0] < 0.8 * steps[0]["Dt"][0]
