# SPDX-License-Identifier: GPL-2.0-only
"""Flow, broken bonds and volume strains are the same whatever the ranks, newton, the decomposition, the box and the way the state came.

As in test_matrix.py every body drifts at 300 m/s; it is shaken so that bonds flow both ways and break, and new contacts flow."""

import itertools

import numpy as np
import pytest
from boxes import BOXES, open_box
from flowing import MOVE, SHAKE, assert_flowed, flowing_pair, largest_difference, read_pairs
from small_bodies import ANOTHER_ORDER, SPACING, assert_same_curve, dump, head, lattice_body, write_body

HALF, STEPS = 60, 120
ROUTES = ("straight", "written in the run", "restart", "data", "restart, then data")
WAYS = list(itertools.product(("on", "off"), ("brick", "tiled"), ROUTES))

LAST_RUN = f"run {STEPS - HALF}\n"
DECOMPOSITION = {"brick": "comm_style brick\n", "tiled": "comm_style tiled\nbalance 1.0 rcb\n"}
FIXES = "fix bonds all evp/bonds\nfix volume all evp/volume 500\n"


def way(newton, comm, route, contact, name):
    """A deck from step 60 to step 120 (the straight one from step 0), to follow a `clear`."""
    rest = DECOMPOSITION[comm] + MOVE + dump(f"{name}.dump", HALF) + LAST_RUN + f"write_evp_bonds {name}.bonds\n"
    if route == "straight":
        return head(newton) + flowing_pair(contact) + SHAKE + DECOMPOSITION[comm] + MOVE + f"run {HALF}\n" + rest.replace(MOVE, "")
    file = "in_run" if route == "written in the run" else "half"
    restarted = head(newton, start=f"read_restart {file}.restart") + FIXES
    if "restart" in route or file == "in_run":
        if "data" not in route:
            return restarted + rest
        file = f"again.{newton}.{comm}"
        first = restarted + DECOMPOSITION[comm] + f"run 0\nwrite_data {file}.data\nwrite_evp_bonds {file}.bonds\nclear\n"
    else:
        first = ""
    start = f"read_data {file}.data nocoeff\nreset_timestep {HALF}"
    return first + head(newton, start=start) + flowing_pair(contact, fix=f"fix bonds all evp/bonds file {file}.bonds") + rest


def whole_deck(contact):
    return (head() + flowing_pair(contact) + SHAKE + MOVE + f"restart {HALF} tmp.*.restart\nrun {HALF}\nshell mv tmp.{HALF}.restart in_run.restart\n"
            "restart 0\nwrite_restart half.restart\nwrite_data half.data\nwrite_evp_bonds half.bonds\n"
            + dump("whole.dump", HALF) + LAST_RUN + "write_evp_bonds whole.bonds\n")


def compare(run, name, whole, choice):
    end, expected = run.dump(f"{name}.dump")[-1], whole.dump("whole.dump")[-1]
    assert end.step == expected.step == STEPS
    for column in ("x", "vx", "fy"):
        assert np.abs(end[column] - expected[column]).max() <= ANOTHER_ORDER * np.abs(expected[column]).max(), (choice, column)
    difference = largest_difference(read_pairs(run.folder / f"{name}.bonds"), read_pairs(whole.folder / "whole.bonds"))
    assert difference <= ANOTHER_ORDER, choice


@pytest.mark.parametrize("ranks, contact", [(1, "repulsive"), (1, "none"), (2, "repulsive"), (4, "none"), (8, "repulsive")])
def test_matrix(lmp, tmp_path, ranks, contact):
    """newton x comm_style x how the state came; restart, data and bond file were written on another number of ranks, with newton on."""
    write_body(tmp_path / "body.data", lattice_body())
    whole = lmp(whole_deck(contact), ranks=3 - ranks if ranks < 3 else 2).ok()
    curve = whole.thermo(-1)
    for file in ("half", "whole"):
        assert_flowed(read_pairs(tmp_path / f"{file}.bonds"), contacts=int(contact == "repulsive"))
    assert curve["f_bonds[5]"][-1] > curve["f_bonds[5]"][0], "control: bonds break after the restart, too"

    run = lmp("clear\n".join(way(*choice, contact, str(number)) for number, choice in enumerate(WAYS)), ranks=ranks, seconds=140).ok()
    tables = [table for table in map(run.thermo, range(run.stdout.count("Loop time"))) if table["Step"][-1] == STEPS]
    assert len(tables) == len(WAYS)
    for number, (choice, table) in enumerate(zip(WAYS, tables)):
        compare(run, str(number), whole, choice)
        assert_same_curve(table, curve)


FLOW_BOXES = {
    **{name: case for name, case in BOXES.items() if name not in ("all pairs tried", "periodic z")},
    "fix balance, newton off": open_box("fix even all balance 7 1.0 shift xy 10 1.01\n", newton="off"),
    "never sorted": open_box(sort="sort 0 0", newton="off"),
}


@pytest.mark.parametrize("name", FLOW_BOXES)
def test_boxes(lmp, tmp_path, name):
    case = FLOW_BOXES[name]
    body = lattice_body(**case["body"])
    write_body(tmp_path / "body.data", body, case.get("tilt"))
    text = flowing_pair() + SHAKE + "{}" + MOVE + dump("{}.dump", STEPS) + f"run {STEPS}\nwrite_evp_bonds {{}}.bonds\n"
    plain = {key: value for key, value in case["options"].items() if key == "boundary"}
    one = lmp(head(**plain) + text.format("", "whole", "whole")).ok()
    # the fix that moves atoms stands after fix evp/bonds
    many = lmp(head(**case["options"]) + text.format(case["lines"], "many", "many"), ranks=4 if "thinner" not in name else 8).ok()
    assert_same_curve(many.thermo(), one.thermo())
    compare(many, "many", one, name)
    pairs = read_pairs(tmp_path / "many.bonds")
    assert_flowed(pairs)
    x = many.dump("many.dump")[-1].vectors("x", "y", "z")
    for axis in range(3):
        if not np.any(body.cell[axis]):
            continue
        spanning = [key for key in pairs.of(0) if abs(x[key[0] - 1, axis] - x[key[1] - 1, axis]) > 2.0 * SPACING]
        flowed = [key for key in spanning if abs(pairs.offset[key]) > 0.003 * pairs.deq[key]]
        assert len(flowed) > 3, "control: bonds that have flowed cross this boundary"


@pytest.mark.parametrize("newton", ["on", "off"])
def test_both_copies_are_equal(lmp, tmp_path, newton):
    """The bond file has what the atom of the lower ID keeps; the restart file has what both do."""
    body = lattice_body((6, 4, 4))
    write_body(tmp_path / "body.data", body)
    lmp(head(newton) + flowing_pair() + SHAKE + MOVE + f"run {HALF}\nwrite_restart half.restart\nwrite_evp_bonds low.bonds\n", ranks=2).ok()
    low = read_pairs(tmp_path / "low.bonds")
    assert_flowed(low)
    high = both_sides(tmp_path / "half.restart", len(body.x))
    for (i, j, is_contact), q in low.offset.items():
        key = i, j, is_contact
        one, two = (high[own]["contacts" if is_contact else "bonds"][other] for own, other in ((i, j), (j, i)))
        assert one == two
        q_strain, k, work, broken = one[-4:]
        assert is_contact or one[0] == low.deq[key]
        assert q_strain == pytest.approx(q / low.deq[key], rel=1e-15) and (k, work) == (low.k[key], low.work[key])
        assert is_contact or broken == low.broken[key]
    assert sum(len(kept) for own in high.values() for kept in own.values()) == 2 * len(low.deq)


def both_sides(path, natoms):
    """What each atom keeps, {ID: {"bonds": {partner: (deq, q, k, work, broken)}, "contacts": {partner: (q, k, work, broken)}}}: the words of the
    records in a restart file, found by their numbers: size, ID, bonds and contacts must agree. q is a strain."""
    raw, found = path.read_bytes(), {}
    for shift in range(8):
        values = np.frombuffer(raw[shift:len(raw) - (len(raw) - shift) % 8], dtype="<f8")
        integers = values.view("<i8")
        for k in np.flatnonzero((integers[1:] > 0) & (integers[1:] <= natoms) & (values[:-1] >= 4) & (values[:-1] < 1000)):
            at = k + 1
            own, n = int(integers[at]), int(integers[at + 1])
            if not 0 <= n < 40 or at + 2 + 6 * n >= len(values):
                continue
            m = int(integers[at + 2 + 6 * n])
            if not 0 <= m < 40 or values[k] != 4 + 6 * n + 5 * m:
                continue
            bonds, contacts, at = {}, {}, at + 2
            for _ in range(n):
                bonds[int(integers[at])] = tuple(values[at + 1:at + 6])
                at += 6
            at += 1
            for _ in range(m):
                contacts[int(integers[at])] = tuple(values[at + 1:at + 5])
                at += 5
            assert own not in found
            found[own] = {"bonds": bonds, "contacts": contacts}
    assert len(found) == natoms
    return found


@pytest.mark.parametrize("style, lines", [("balance", "fix even all balance 10 1.0 shift x 10 1.01\n")])
def test_fixes_that_move_atoms_stand_after(lmp, tmp_path, style, lines):
    """fix evp/bonds writes the histories to the atoms before they move: a fix that moves them first is refused."""
    write_body(tmp_path / "body.data", lattice_body((6, 4, 4)))
    run = lmp(head() + lines + flowing_pair() + SHAKE + MOVE + "run 10\n")
    assert run.returncode == 1 and run.made_no_step()
    assert f"Fix bonds evp/bonds must be defined before fix even {style}" in " ".join(run.stdout.split())
    text = lines + flowing_pair(plasticity="none", broken=0) + SHAKE + MOVE.replace("f_bonds[5]", "")
    lmp(head() + text + "run 10\n").ok()
