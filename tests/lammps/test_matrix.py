# SPDX-License-Identifier: GPL-2.0-only
"""The same forces and the same curve whatever the ranks, newton, the decomposition, the box and the way the state came.

Every body drifts at 300 m/s, so that its atoms and their bonds change ranks and cross boundaries while it deforms."""

import itertools

import numpy as np
import pytest
from boxes import BOXES
from small_bodies import (ANOTHER_ORDER, MOVE, SPACING, STIR, assert_eventful, assert_same_curve, check_forces, dump,
                          head, lattice_body, pair, write_body)

HALF, STEPS = 50, 100
ROUTES = ("straight", "restart", "data", "restart, then data")
WAYS = list(itertools.product(("on", "off"), ("brick", "tiled"), ROUTES))

LAST_RUN = f"run {STEPS - HALF}\n"
DECOMPOSITION = {"brick": "comm_style brick\n", "tiled": "comm_style tiled\nbalance 1.0 rcb\n"}


def way(newton, comm, route, name):
    """A deck from step 50 to step 100 (the straight one from step 0), to follow a `clear`."""
    rest = DECOMPOSITION[comm] + MOVE + dump(name) + LAST_RUN
    restarted = head(newton, start="read_restart half.restart") + "fix bonds all evp/bonds\n"
    if route == "straight":
        return head(newton) + pair() + STIR + DECOMPOSITION[comm] + MOVE + f"run {HALF}\n" + dump(name) + LAST_RUN
    if route == "restart":
        return restarted + rest
    file = "half"
    first = ""
    if route == "restart, then data":
        file = f"again.{newton}.{comm}"
        first = restarted + DECOMPOSITION[comm] + f"run 0\nwrite_data {file}.data\nwrite_evp_bonds {file}.bonds\nclear\n"
    start = f"read_data {file}.data nocoeff\nreset_timestep {HALF}"
    return first + head(newton, start=start) + pair(fix=f"fix bonds all evp/bonds file {file}.bonds") + rest


@pytest.fixture(scope="module")
def bar():
    return lattice_body()


@pytest.mark.parametrize("ranks", [1, 2, 4, 8])
def test_matrix(lmp, tmp_path, bar, ranks):
    """newton x comm_style x how the state came, all in one process after `clear`; restart, data and bond file were
    written on another number of ranks. 8 ranks cut the bar into pieces shorter than dlim."""
    write_body(tmp_path / "body.data", bar)
    whole = lmp(head() + pair() + STIR + MOVE + f"run {HALF}\nwrite_restart half.restart\nwrite_data half.data\n"
                "write_evp_bonds half.bonds\n" + dump("whole.dump") + LAST_RUN, ranks=3 - ranks if ranks < 3 else 2).ok()
    curve = whole.thermo(-1)
    start, end = whole.dump("whole.dump")
    check_forces(end, bar)
    assert_eventful(curve)

    decks = [way(*choice, f"{number}.dump") for number, choice in enumerate(WAYS)]
    run = lmp("clear\n".join(decks), ranks=ranks, seconds=100).ok()
    tables = [table for table in map(run.thermo, range(run.stdout.count("Loop time"))) if table["Step"][-1] == STEPS]
    assert len(tables) == len(WAYS)
    for number, (choice, table) in enumerate(zip(WAYS, tables)):
        first, last = run.dump(f"{number}.dump")
        assert (first.step, last.step) == (HALF, STEPS), choice
        if choice[2] != "straight":
            assert np.array_equal(first.vectors("x", "vx", "vz"), start.vectors("x", "vx", "vz")), choice
        for snapshot in (first, last):
            check_forces(snapshot, bar)
        for name in ("x", "vx", "fy"):
            assert np.abs(last[name] - end[name]).max() <= ANOTHER_ORDER * np.abs(end[name]).max(), (choice, name)
        assert_same_curve(table, curve)


@pytest.mark.parametrize("name", BOXES)
def test_boxes(lmp, tmp_path, name):
    case = BOXES[name]
    body = lattice_body(**case["body"])
    write_body(tmp_path / "body.data", body, case.get("tilt"))
    text = pair() + STIR + MOVE + dump() + f"run {STEPS}\n"
    plain = {key: value for key, value in case["options"].items() if key == "boundary"}
    one = lmp(head(**plain) + text).ok()
    many = lmp(head(**case["options"]) + case["lines"] + text, ranks=4 if "thinner" not in name else 8).ok()
    for snapshot in many.dump("all.dump")[1:]:
        check_forces(snapshot, body)
    assert_eventful(one.thermo())
    assert_same_curve(many.thermo(), one.thermo())
    for axis in range(3):
        if not np.any(body.cell[axis]):
            continue
        x = snapshot.vectors("x", "y", "z")
        pairs = np.array(list(body.bonds)) - 1
        spans = np.abs(x[pairs[:, 0], axis] - x[pairs[:, 1], axis])
        assert np.sum(spans > 2.0 * SPACING) > 20, "control: bonds cross this boundary"


@pytest.mark.parametrize("newton", ["on", "off"])
def test_more_ranks_than_particles_in_a_slab(lmp, tmp_path, newton):
    """8 slabs: one that holds the corners of two layers, six that hold nothing and have no ghosts either."""
    body = lattice_body((2, 2, 2), zone=1.5)
    body = body._replace(box=np.array([[-0.2, 0.6], *body.box[1:]]))
    write_body(tmp_path / "body.data", body)
    text = pair() + STIR + MOVE + dump() + """
compute state all evp/state/atom
compute bonds all reduce sum c_state[1]
compute dt all evp/dt
thermo_style custom step pe ke f_bonds f_bonds[2] f_bonds[4] c_bonds c_dt
run 100
write_evp_bonds all.bonds
"""
    one = lmp(head(newton) + text).ok()
    many = lmp(head(newton, before="processors 8 1 1") + text, ranks=8).ok()
    check_forces(many.dump("all.dump")[-1], body)
    # compute evp/dt iterates to its own tolerance from a start that depends on nothing but the IDs
    assert_same_curve(many.thermo(), one.thermo())
    assert many.thermo()["c_bonds"][-1] == 2 * len(body.bonds)
    assert "Histogram: 6 0" in many.stdout or "Histogram: 7 0" in many.stdout, "control: ranks without atoms"
