# SPDX-License-Identifier: GPL-2.0-only
"""contact join: pairs that meet become bonds. Simple shear beside an independent program; the same events whatever the ranks, newton, neighbor lists,
restarts and bond files; a pair that joins and leaves across a rank boundary; what keeps a pair from joining. Against the second writing of the law:
test_flow_pairs.py."""

import json

import numpy as np
import pytest
from evp import law
from flowing import largest_difference, read_pairs
from lammps_run import REPOSITORY, run_lammps
from small_bodies import dump, head, pair, thermo

DATA = REPOSITORY / "tests" / "data" / "join"
REFERENCE = json.loads((DATA / "join_reference.json").read_text(encoding="utf-8"))
RATE, DT, ROWS = 200.0, 3e-7, 3330  # [1/s], [s], steps of a row: 0.2 of strain


def style(beta):
    flow = " ".join(f"{p:.9g} {y:.9g}" for p, y in REFERENCE["row"]["flow"])
    return (f"pair_style evp/lj contact join {beta} plasticity isotropic overlap 0.7\n"
            f"pair_coeff * * 190 8 4 3 8 4 {REFERENCE['row']['xi_s']:.10g} 100 1.5 flow {flow}\n")


SHEAR = f"""fix volume all evp/volume 2000
fix energy all evp/energy
comm_modify vel yes
fix move all nve
timestep {DT}
compute press all pressure NULL pair fix
variable tau equal -c_press[4]
fix rows all ave/time 5 {ROWS // 5} {ROWS} v_tau
fix shear all deform 1 xy erate {RATE} remap v flip yes
"""
START = f"variable flow atom {RATE}*y\nvelocity all set v_flow 0 0\n"


def deck(beta, newton="on", start=f"read_data {DATA}/join_start_1000.data", skin=4e-4, fix="fix bonds all evp/bonds\n"):
    return head(newton, "p p p", start, skin=skin) + style(beta) + fix + SHEAR


@pytest.mark.parametrize("beta", [1.2, 1.3])
def test_simple_shear(lmp, beta):
    """Stress, bonds and events to a strain of 0.6 as the independent program has them; the energies close."""
    rows = REFERENCE["cases"][f"join {beta}"][:3]
    text = deck(beta) + START + f"thermo {ROWS}\n" + thermo("f_rows f_bonds f_bonds[4] f_bonds[5] f_bonds[6] f_energy f_energy[9]") + f"run {3 * ROWS}\n"
    table = lmp(text, 2).ok().thermo()
    assert table["f_rows"][1:] / 1e6 == pytest.approx([row["tau_MPa"] for row in rows], rel=0.02)
    for name, key in (("f_bonds[6]", "joined"), ("f_bonds[5]", "left")):
        assert table[name][1:] == pytest.approx([row[key] for row in rows], rel=0.1, abs=6)
    assert table["f_bonds[4]"][1:] == pytest.approx([row["smallest"] for row in rows], abs=0.03)
    assert np.abs(table["f_energy"]).max() < 2e-4 * table["f_energy[9]"][-1]


def events(lmp, folder, ranks, text):
    lmp(text + "write_evp_bonds end.bonds\n", ranks).ok()
    return read_pairs(folder / "end.bonds")


@pytest.fixture(scope="module")
def sheared(tmp_path_factory):
    """The bonds after 0.1 of strain from a state in which they meet often, and that state, as a restart file and as text."""
    folder = tmp_path_factory.mktemp("sheared")
    state = "run 4000\nwrite_restart state.rst\nwrite_data state.data nocoeff\nwrite_evp_bonds state.bonds\n"
    run_lammps(deck(1.3) + START + state, 2, {}, folder).ok()
    run_lammps(go_on(folder, "text") + "write_evp_bonds end.bonds\n", 1, {}, folder).ok()
    found = read_pairs(folder / "end.bonds")
    assert found.joined - read_pairs(folder / "state.bonds").joined > 30, "control"
    return folder, found


def go_on(folder, kind, newton="on", skin=4e-4, neighbors="every 1 delay 0 check yes"):
    if kind == "text":
        text = deck(1.3, newton, f"read_data {folder}/state.data", skin, f"fix bonds all evp/bonds file {folder}/state.bonds\n")
        text = text.replace("compute press", "reset_timestep 4000\ncompute press")
    else:
        text = deck(1.3, newton, f"read_restart {folder}/state.rst", skin)
    return text + f"neigh_modify {neighbors}\nrun 1660\n"


@pytest.mark.parametrize("kind, ranks, newton, more", [
    ("restart", 1, "on", {}), ("text", 2, "off", {}), ("restart", 4, "off", {}), ("text", 4, "on", {"skin": 1.5e-3}), ("restart", 2, "on", {"neighbors": "every 1 delay 0 check no"})])
def test_same_events(lmp, tmp_path, sheared, kind, ranks, newton, more):
    folder, expected = sheared
    found = events(lmp, tmp_path, ranks, go_on(folder, kind, newton, **more))
    assert set(found.bonds) == set(expected.bonds) and set(found.inside) == set(expected.inside)
    assert largest_difference(found, expected) < 1e-6


TWO = """region box block -0.05 0.05 -0.02 0.02 -0.02 0.02
create_box 2 box
create_atoms 1 single -0.004 0.001 0.002
create_atoms 1 single 0.006 0.001 0.002
set group all diameter 0.01 density 2700"""
ROW = law.TABLE1._replace(xi_s=0.01)


@pytest.mark.parametrize("newton, ranks", [("on", 1), ("off", 2), ("on", 2)])
def test_a_pair_that_joins_and_leaves(lmp, tmp_path, newton, ranks):
    """A hundred times, across the boundary of two ranks: at 1.2 (R_i + R_j), which needs no number, from outside, within what a step moves; at dlim it ends."""
    cycles, steps, low, high = 100, 60, 0.0115, 0.0155
    text = head(newton, "p p p", TWO, skin=0.001) + pair(ROW, "join plasticity isotropic") + "group second id 2\n"
    text += f"fix sway second move wiggle {0.5 * (high - low)} 0 0 {steps * 1e-8} units box\n"
    text = text.replace("single 0.006", f"single {0.5 * (low + high) - 0.004}") + f"timestep 1e-8\nthermo {cycles * steps}\n"
    text += thermo("f_bonds f_bonds[5] f_bonds[6]") + f"run {cycles * steps}\nwrite_evp_bonds end.bonds\n"
    table = lmp(text, ranks).ok().thermo()
    assert table["f_bonds"][-1] == 1 and table["f_bonds[6]"][-1] == cycles and table["f_bonds[5]"][-1] == cycles
    assert len(read_pairs(tmp_path / "end.bonds").bonds) == 1


@pytest.mark.parametrize("zone, apart, joins", [(1.05, 0.0122, False), (1.05, 0.0127, True), (1.3, 0.0122, None)])
def test_what_is_inside_without_a_bond_joins_once_it_has_been_apart(lmp, zone, apart, joins):
    """Not recorded at 1.15 (R_i + R_j), or a bond from the beginning; led to `apart` and back."""
    text = head("on", "p p p", TWO.replace("0.006", "0.0075"), skin=0.003) + pair(ROW, "join 1.2 plasticity isotropic", f"fix bonds all evp/bonds zone {zone}")
    text += f"group second id 2\nfix sway second move wiggle {apart - 0.0115} 0 0 4e-7 units box\ntimestep 1e-8\nthermo 40\n" + thermo("f_bonds f_bonds[5] f_bonds[6]")
    table = lmp(text + "run 40\n").ok().thermo()
    assert (table["f_bonds"][-1], table["f_bonds[6]"][-1]) == ((1, 0) if joins is None else (0, int(joins)))


def test_two_bodies_do_not_join(lmp):
    text = head("on", "p p p", TWO.replace("0.006", "0.0095"), skin=0.003).replace("set group all diameter", "set atom 2 type 2\nset group all diameter")
    text += pair(ROW, "join 1.2 plasticity isotropic", "fix bonds all evp/bonds within type") + "group second id 2\nfix sway second move wiggle -0.003 0 0 4e-7 units box\n"
    table = lmp(text + "timestep 1e-8\nthermo 40\n" + thermo("f_bonds[6]") + dump(every=10, columns="x") + "run 40\n").ok()
    assert table.thermo()["f_bonds[6]"][-1] == 0 and min(frame["x"][1] for frame in table.dump("all.dump")) < 0.007
