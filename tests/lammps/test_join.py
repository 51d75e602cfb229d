# SPDX-License-Identifier: GPL-2.0-only
"""contact join: pairs that meet become bonds. Simple shear beside an independent program; the same events whatever the ranks, newton, neighbor lists,
restarts and bond files; a pair that joins and leaves across a rank boundary; what keeps a pair from joining. Against the second writing of the law:
test_flow_pairs.py."""

import itertools
import json

import numpy as np
import pytest
from evp import law
from flowing import ROW as FLOWING
from flowing import SHAKE, SPHERE, failing_at, largest_difference, read_pairs
from lammps_run import REPOSITORY, run_lammps, thermo_blocks, write_data, write_state
from oracle import metal
from robust import LEDGER_SHARE
from small_bodies import dump, head, mass_of, pair, thermo

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


SHOWN = f"thermo {ROWS}\n" + thermo("f_rows f_bonds f_bonds[4] f_bonds[5] f_bonds[6] f_energy f_energy[9]")
WAY = 2 * ROWS  # to a strain of 0.4


@pytest.fixture(scope="module")
def all_the_way(tmp_path_factory):
    """With 1.3; on the way, at a strain of 0.24, the state as a restart file and as text."""
    state = "run 4000\nwrite_restart state.rst\nwrite_data state.data nocoeff\nwrite_evp_bonds state.bonds\n"
    return run_lammps(f"{deck(1.3)}{START}{SHOWN}{state}run {WAY - 4000}\n", 1, {}, tmp_path_factory.mktemp("sheared")).ok()


@pytest.mark.parametrize("beta", [1.2, 1.3])
def test_simple_shear(lmp, all_the_way, beta):
    """Stress, bonds and events to a strain of 0.4 as the independent program has them; the energies close."""
    rows = REFERENCE["cases"][f"join {beta}"][:2]
    run = all_the_way if beta == 1.3 else lmp(f"{deck(beta)}{START}{SHOWN}run {WAY}\n").ok()
    blocks = thermo_blocks(run.stdout)
    table = {name: np.concatenate([block[name][block["Step"] % ROWS == 0] for block in blocks]) for name in blocks[0]}
    assert table["Step"].tolist() == [0, ROWS, WAY]
    assert table["f_rows"][1:] / 1e6 == pytest.approx([row["tau_MPa"] for row in rows], rel=0.02)
    for name, key in (("f_bonds[6]", "joined"), ("f_bonds[5]", "left")):
        assert table[name][1:] == pytest.approx([row[key] for row in rows], rel=0.1, abs=6)
    assert table["f_bonds[4]"][1:] == pytest.approx([row["smallest"] for row in rows], abs=0.03)
    assert np.abs(table["f_energy"]).max() < 2e-4 * table["f_energy[9]"][-1]


def events(lmp, folder, ranks, text):
    lmp(text + "write_evp_bonds end.bonds\n", ranks).ok()
    return read_pairs(folder / "end.bonds")


@pytest.fixture(scope="module")
def sheared(all_the_way):
    """The bonds after 0.05 of strain from a state in which they meet often, in a folder that has that state."""
    folder = all_the_way.folder
    run_lammps(go_on(folder, "text") + "write_evp_bonds end.bonds\n", 1, {}, folder).ok()
    found = read_pairs(folder / "end.bonds")
    assert found.joined - read_pairs(folder / "state.bonds").joined > 15, "control"
    return folder, found


def go_on(folder, kind, newton="on", skin=4e-4, neighbors="every 1 delay 0 check yes"):
    if kind == "text":
        text = deck(1.3, newton, f"read_data {folder}/state.data", skin, f"fix bonds all evp/bonds file {folder}/state.bonds\n")
        text = text.replace("compute press", "reset_timestep 4000\ncompute press")
    else:
        text = deck(1.3, newton, f"read_restart {folder}/state.rst", skin)
    return text + f"neigh_modify {neighbors}\nrun 830\n"


@pytest.mark.parametrize("kind, ranks, newton, more", [
    ("restart", 1, "on", {}), ("text", 2, "off", {}), ("text", 4, "on", {"skin": 1.5e-3}), ("restart", 2, "on", {"neighbors": "every 1 delay 0 check no"})])
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
    table = lmp(text + "run 0\nrun 40\n").ok().thermo()
    assert (table["f_bonds"][-1], table["f_bonds[6]"][-1]) == ((1, 0) if joins is None else (0, int(joins)))


BODIES = TWO.replace("0.006", "0.0065").replace("set group all diameter", "set atom 2 type 2\nset group all diameter")  # they touch, at 1.05 (R_i + R_j)


@pytest.mark.parametrize("rule, amplitude, steps, joined", [("join 1.2", 0.003, 80, 0), ("join 1.2 all", 0.003, 80, 1), ("join all", -0.003, 40, 0), ("join all", -0.003, 120, 1)])
def test_two_bodies(lmp, rule, amplitude, steps, joined):
    """Swayed by 3 mm, first apart or first together: they repel, and with `all` join where they come near again."""
    text = head("on", "p p p", BODIES, skin=0.003) + pair(ROW, f"{rule} plasticity isotropic", "fix bonds all evp/bonds within type") + "group second id 2\n"
    text += f"fix sway second move wiggle {amplitude} 0 0 8e-7 units box\ntimestep 1e-8\nthermo {steps}\n" + thermo("f_bonds[6] f_bonds[5]")
    run = lmp(text + dump(every=10, columns="x") + f"run {steps}\n").ok()
    assert run.thermo()["f_bonds[6]"][-1] == joined and min(frame["x"][1] for frame in run.dump("all.dump")) < 0.005


def test_thousand_clusters(lmp, tmp_path):
    """Three spheres each, some bonded, thrown at one another: the same events as in the second writing, on all ranks and with rare and frequent neighbor lists."""
    rng = np.random.default_rng(5)
    centres = np.array(list(itertools.product(range(10), repeat=3)), dtype=float) * 0.05
    around = np.array([[0.0, 0.0, 0.0], [0.0117, 0.0, 0.0], [0.004, 0.0112, 0.0]])
    x = (centres[:, None] + around + rng.uniform(-0.0012, 0.0012, (1000, 3, 3))).reshape(-1, 3)
    v = rng.uniform(-60.0, 60.0, x.shape)
    weak = FLOWING._replace(e1=2.0, e2=0.075, gamma=0.5)
    radius = rng.uniform(0.0045, 0.0055, len(x))
    box = np.array([[-0.04, 0.51]] * 3)
    near = np.concatenate([np.array([[k, k + 1], [k, k + 2], [k + 1, k + 2]]) for k in range(0, len(x), 3)])
    gap = np.linalg.norm(x[near[:, 0]] - x[near[:, 1]], axis=1) / (radius[near[:, 0]] + radius[near[:, 1]])
    bonds = {(a + 1, b + 1): d * (radius[a] + radius[b]) for (a, b), d in zip(near.tolist(), gap.tolist()) if d <= 1.15}
    own = metal.Metal(x, v, radius, mass_of(radius), weak, bonds, 6e-7, None, None, "join", near, join=1.2,
                      condition=metal.Yield(0.0, 2700.0), fails=metal.Failure((0.4, 0.0, 0.0))).run(200)
    assert min(own.joined, own.ended) > 200 and len(own.inside_pairs()) > 30, "control"
    write_state(tmp_path / "start.dump", x, v, box, np.arange(1, len(x) + 1))
    write_data(tmp_path / "body.data", x, radius, box)
    for newton, ranks, skin in (("on", 1, 4e-4), ("off", 2, 4e-3), ("off", 4, 1e-3)):
        text = head(newton, skin=skin) + pair(weak, "join 1.2 plasticity isotropic", "fix bonds all evp/bonds zone 1.15", failing_at(0.4))
        text += "read_dump start.dump 0 x y z vx vy vz box no replace yes\nreset_timestep 0\nfix move all nve\ntimestep 6e-7\nrun 200\n"
        found = events(lmp, tmp_path, ranks, text)
        assert (found.joined, found.ended) == (own.joined, own.ended)
        assert found.bonds == pytest.approx(own.records(), rel=1e-9) and set(found.inside) == own.inside_pairs()


def read_events(path):
    """[(step, i, j, what)] of an events file, and the places (n,3)."""
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    return [(int(step), int(i), int(j), what) for step, i, j, what, *_ in lines], np.array([[float(word) for word in words[4:]] for words in lines])


def test_events(lmp, tmp_path, sheared):
    """Each end and beginning stands in the file once, with its step, whatever the ranks; the counts agree."""
    folder, _ = sheared
    kept = {}
    for newton, ranks in (("on", 1), ("off", 2), ("off", 4)):
        text = go_on(folder, "restart", newton).replace("fix bonds all evp/bonds", "fix bonds all evp/bonds events all.events")
        run = lmp(text.replace("run 830", thermo("f_bonds[5] f_bonds[6]") + "run 400"), ranks).ok()
        kept[ranks], places = read_events(tmp_path / "all.events")
        table = run.thermo()
        for column, names in (("f_bonds[5]", {"dlim", "failed"}), ("f_bonds[6]", {"joined"})):
            assert sum(what in names for *_, what in kept[ranks]) == table[column][-1] - table[column][0] > 5
        assert 4000 < kept[ranks][0][0] and kept[ranks][-1][0] <= 4400 and np.abs(places).max() < 0.1
    assert kept[1] == kept[2] == kept[4]


# 1 is at rest, 2 moves along x; the bond ends in this step, at this place. Far: 2 has left the neighbor list, or jumps past it
PLACES = {"in the list": ("f f f", (-0.005, 0.005), 3000.0, 5e-3, 17, 0.00255), "left the list": ("f f f", (-0.005, 0.005), 3000.0, 1e-5, 17, 0.00255),
          "jumps": ("f f f", (-0.005, 0.005), 3e5, 1e-3, 1, 0.015), "across the boundary": ("p f f", (0.0455, -0.0445), 3000.0, 5e-3, 17, -0.04695),
          "far across the boundary": ("p f f", (0.0455, -0.0445), 3000.0, 1e-5, 17, -0.04695),
          "jumps across the boundary": ("p p p", (0.0355, 0.0455), 1e5, 1e-3, 1, 0.0455), "jumps with its boundary": ("p p p", (0.0425, -0.0475), 1e5, 1e-3, 1, -0.0475)}


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (3, "on")])
def test_places_of_events(lmp_decks, ranks, newton):
    """Half way between both spheres, as nearest images."""
    decks = {}
    for name, (boundary, (one, two), speed, skin, step, _) in PLACES.items():
        body = TWO.replace("-0.004 0.001 0.002", f"{one} 0.001 0.002").replace("0.006 0.001 0.002", f"{two} 0.001 0.002")
        decks[name] = (head(newton, boundary, body, skin=skin) + "comm_modify cutoff 0.03\n" + pair(ROW, "join plasticity isotropic", "fix bonds all evp/bonds events all.events")
                       + f"group second id 2\nfix move second move linear {speed} 0 0\ntimestep 1e-7\nrun {step}\n")
    for name, run in lmp_decks(decks, ranks).items():
        lines, places = read_events(run.folder / "all.events")
        assert lines == [(PLACES[name][4], 1, 2, "dlim")], name
        assert places[0] == pytest.approx([PLACES[name][5], 0.001, 0.002], abs=1e-9), name


def test_a_jump_is_told(lmp):
    """A pair that comes from 1.36 to 1.08 (R_i + R_j) within a step joins there, and one warning says so; slowly it does not."""
    for steps, told in ((1, 1), (100, 0)):
        text = head("on", "p p p", TWO.replace("0.006", "0.0096"), skin=0.004) + pair(ROW, "join 1.2 plasticity isotropic", "fix bonds all evp/bonds zone 1.3") + "group second id 2\n"
        text += f"fix move second move linear {-0.0028 / (steps * 1e-8)} 0 0 units box\ntimestep 1e-8\n" + thermo("f_bonds[6] f_bonds[4]") + f"run {steps}\n"
        run = lmp(text, 2).ok()
        assert run.thermo()["f_bonds[6]"][-1] == 1 and run.thermo()["f_bonds[4]"][-1] == pytest.approx(1.08)
        assert sum("1 pairs that joined until step" in line and "nearer than 1.143" in line for line in run.warnings()) == told


NEW = """fix bonds all evp/bonds new yes {within}
fix volume all evp/volume 500
fix move all nve
timestep 3e-7
run 20
region corner block -0.01 -0.003 0 0.03 0 0.03
lattice sc 0.0105 origin 0.4 0.5 0.5
create_atoms 1 region corner
group late id > 36
set group late diameter 0.01 density 2700
""" + SHAKE


@pytest.mark.parametrize("within", ["", "within type"])
def test_new_atoms_are_bonded_where_they_come(lmp, tmp_path, small, within):
    """At the set-up that sees them first, to what is within the zone, deq the distance then; the same on all ranks and after a restart. They carry
    load and count in the volume energy; without `new yes` one warning says that they are loose."""
    style = pair(FLOWING, "repulsive plasticity isotropic", "")
    text = head() + style + NEW.format(within=within) + "run 0\nwrite_evp_bonds first.bonds\n" + "compute state all evp/state/atom volume_strain bonds_now\n"
    text += dump(every=20, columns="x y z c_state[5] c_state[6]")
    text += "run 20\nvariable n equal f_bonds\nprint \"pairs $n\"\nwrite_evp_bonds end.bonds\nwrite_restart end.restart\n"
    kept = []
    for ranks in (1, 2):
        run = lmp(text, ranks).ok()
        first, end = read_pairs(tmp_path / "first.bonds"), read_pairs(tmp_path / "end.bonds")
        kept.append(end)
    late = run.dump("all.dump")[0]
    x = dict(zip(late["id"].astype(int).tolist(), late.x))
    new = {key: deq for key, deq in first.bonds.items() if max(key) > 36}
    assert len(new) > 20 and all(deq == pytest.approx(np.linalg.norm(x[a] - x[b]), rel=1e-12) for (a, b), deq in new.items())
    assert {sum(k > 36 for k in key) for key in new} == {1, 2}
    last = run.dump("all.dump")[-1]
    assert np.abs(last["c_state[5]"][last["id"] > 36]).min() > 0.0 and last["c_state[6]"].sum() == 2 * len(end.bonds)
    assert largest_difference(*kept) < 1e-8 and f"pairs {len(first.bonds) + first.ended}" in run.stdout
    went_on = lmp(head(start="read_restart end.restart") + style + "fix bonds all evp/bonds new yes\nfix volume all evp/volume 500\nrun 0\nwrite_evp_bonds again.bonds\n", 2).ok()
    assert read_pairs(tmp_path / "again.bonds") == end and not any("bonds" in line for line in went_on.warnings())
    told = lmp(text.replace("new yes", "new no"), 1).ok().warnings()
    assert sum("atoms of its group came after the bonds were recorded" in line and "'new yes'" in line for line in told) == 1


def test_bodies_join_under_volume_energy(lmp, tmp_path, small):
    """Two bodies through each other, shaken: the volume energy does not jump as their pairs join, end and fail, and all ranks find the same."""
    found, imbalance = [], []
    for newton, ranks, steps in (("on", 1, 400), ("off", 2, 400), ("on", 4, 400), ("on", 1, 800)):
        text = head(newton, "s s s") + pair(FLOWING._replace(gamma=30.0), "join 1.2 all plasticity isotropic", "fix bonds all evp/bonds within type", failing_at(0.5))
        text += f"{SHAKE}fix volume all evp/volume 500\nfix energy all evp/energy\nfix move all nve\ntimestep {8e-5 / steps}\nthermo {steps}\n"
        text += thermo("f_energy f_energy[9] f_bonds[5] f_bonds[6]") + f"run {steps}\nwrite_evp_bonds end.bonds\n"
        table = lmp(text, ranks).ok().thermo()
        assert min(table["f_bonds[6]"][-1], table["f_bonds[5]"][-1]) > 2, "control"
        found.append(read_pairs(tmp_path / "end.bonds"))
        imbalance.append(abs(table["f_energy"][-1] / table["f_energy[9]"][-1]))
    assert largest_difference(found[1], found[0]) < 1e-6 and largest_difference(found[2], found[0]) < 1e-6
    assert max(imbalance) < LEDGER_SHARE


def test_ends_and_joins_between_two_neighbor_lists(lmp, tmp_path):
    """A pair that two rows hold, across ranks or a periodic boundary: counted once, with the deq that it has flowed to."""
    kept = []
    for newton, ranks, places in (("on", 1, (-0.004, 0.0095)), ("off", 1, (0.045, -0.0415)), ("off", 2, (-0.004, 0.0095))):
        start = TWO.replace("-0.004", f"{places[0]}").replace("0.006", f"{places[1]}")
        text = head(newton, "p p p", start, skin=0.006) + pair(ROW, "join plasticity isotropic", "fix bonds all evp/bonds") + "group second id 2\n"
        text += "fix sway second move wiggle 0.002 0 0 6e-7 units box\ntimestep 1e-8\nneigh_modify every 2000 check no\nthermo 290\n" + thermo("f_bonds[5] f_bonds[6]")
        table = lmp(text + "run 290\nwrite_evp_bonds end.bonds\n", ranks).ok().thermo()
        kept.append((table["f_bonds[5]"][-1], table["f_bonds[6]"][-1], list(read_pairs(tmp_path / "end.bonds").bonds.values())))
    assert kept[0][0] > 3 and len(kept[0][2]) == 1, "control"
    assert all(one[:2] == kept[0][:2] and one[2] == pytest.approx(kept[0][2], rel=1e-12) for one in kept)


def test_zone_of_the_volume_energy(lmp, tmp_path, small):
    """A pair that joins counts within the zone, as at the next neighbor list: skins do not matter and the energies close."""
    found = []
    for skin in (8e-4, 4e-3):
        text = head(boundary="s s s", skin=skin) + pair(FLOWING._replace(gamma=30.0), "join 1.2 plasticity isotropic", "fix bonds all evp/bonds zone 1.3") + SHAKE
        text += "fix volume all evp/volume 500\nfix energy all evp/energy\nfix move all nve\ntimestep 2e-7\nthermo 400\n" + thermo("f_energy f_energy[9] f_bonds[6]")
        table = lmp(text + "run 400\nwrite_evp_bonds end.bonds\n").ok().thermo()
        assert table["f_bonds[6]"][-1] > 2 and abs(table["f_energy"][-1]) < 5e-3 * table["f_energy[9]"][-1]
        found.append(read_pairs(tmp_path / "end.bonds"))
    assert largest_difference(*found) < 1e-6


INSIDE = pair(ROW, "join 1.2 plasticity isotropic", "fix bonds all evp/bonds zone 1.05 within type")
NEAR = TWO.replace("0.006", "0.0075")  # 1.15 (R_i + R_j)
REPELS = "pair_style evp/lj contact {} plasticity isotropic\npair_coeff * * " + " ".join(map(str, ROW)) + "\n"
PUT = "create_atoms 1 single -0.004 0.0085 0.002\nset group all diameter 0.01 density 2700\n"  # at 0.75 of the first


PUSH = """thermo_style one
create_atoms 2 single 0.03 -0.01 0.002
create_atoms 1 single 0.0392 -0.01 0.002
set group all diameter 0.01 density 2700
min_style fire
min_modify integrator verlet tmax 10 dmax 1e-4
timestep 1e-6
minimize 0 1e-3 10000 100000
timestep 1e-9
""" + thermo("f_bonds[6]")  # as two bodies that overlap part the neighbor list is built anew, and nothing reads the records on the way
MEET = """set atom 2 type 2
set atom 2 x 0.0095
velocity all set 0 0 0
group second id 2
velocity second set -100000 0 0
run 24
velocity all set 0 0 0
set atom 2 type 1
"""  # from 1.35 to 1.11 (R_i + R_j) as two bodies


@pytest.mark.parametrize("lines", [
    PUSH, "run 0\n" + REPELS.format("repulsive") + "run 5\n" + REPELS.format("join 1.2"), "run 0\n" + PUT, "run 0\nset atom 2 type 2\nrun 5\nset atom 2 type 1\n", MEET,
    "run 0\n" + PUT + "run 5\nset atom 3 type 2\nrun 5\nset atom 3 type 1\n"], ids=["minimized", "other rule", "new sphere", "divided", "met divided", "new and divided"])
def test_what_is_inside_stays_so(lmp, lines):
    """Pairs that are near without a bond do not join: a neighbor list that a minimization builds, another rule in between, a new sphere, two bodies that become one."""
    text = head("on", "p p p", NEAR, skin=5e-5) + INSIDE + "fix move all nve\ntimestep 1e-9\n" + thermo("f_bonds[6]") + f"{lines}run 5\n"
    assert lmp(text).ok().thermo(-1)["f_bonds[6]"][-1] == 0


def test_loose_spheres_are_counted_once(lmp, tmp_path):
    """A sphere that came later without `new yes` joins: one event, one bond, and its bond file is read again."""
    text = head("on", "p p p", TWO, skin=0.004) + pair(ROW, "join 1.2 plasticity isotropic", "fix bonds all evp/bonds zone 1.3") + "run 0\n"
    text += "create_atoms 1 single -0.004 0.016 0.002\nset group all diameter 0.01 density 2700\ngroup third id 3\ntimestep 1e-8\nfix fall third move linear 0 -40000 0 units box\n"
    table = lmp(text + thermo("f_bonds f_bonds[1] f_bonds[6]") + "run 10\nwrite_evp_bonds end.bonds\nwrite_data end.data nocoeff\n", 2).ok().thermo(-1)
    assert (table["f_bonds"][-1], table["f_bonds[1]"][-1], table["f_bonds[6]"][-1]) == (1.0, 0.0, 1.0)
    again = head("on", "p p p", "read_data end.data", skin=0.004) + pair(ROW, "join 1.2 plasticity isotropic", "fix bonds all evp/bonds file end.bonds") + thermo("f_bonds f_bonds[6]")
    table = lmp(again + "run 0\n").ok().thermo()
    assert (table["f_bonds"][-1], table["f_bonds[6]"][-1]) == (1.0, 1.0)


def test_new_atoms_of_a_group(lmp):
    """Those outside it stay loose, those inside are bonded, whatever the order of their IDs."""
    text = head("on", "p p p", TWO, skin=0.004) + "group body id 1 2 4\n" + pair(ROW, "join 1.2 plasticity isotropic", "fix bonds body evp/bonds new yes") + "fix move all nve\ntimestep 1e-9\nrun 0\n"
    text += "create_atoms 1 single -0.004 0.012 0.002\ncreate_atoms 1 single 0.006 0.011 0.002\nset group all diameter 0.01 density 2700\ngroup body id 4\n"
    table = lmp(text + thermo("f_bonds") + "run 5\nrun 5\n", 2).ok().thermo(-1)
    assert table["f_bonds"][-1] == 3.0


@pytest.mark.parametrize("torn", [0, 1])
@pytest.mark.parametrize("within, types", [("", [1] * 6), ("type", [1, 1, 1, 2, 2, 2])])
def test_pressed_bonds_that_fail(lmp, tmp_path, within, types, torn):
    """Two triangles of spheres that are held, pressed but for one bond between them; the bonds of a sphere that has parted end: the volume energy stays, in one
    body and between two."""
    x = np.array([[0, 0, 0], [0.011, 0, 0], [0.0055, 0.0095, 0]])
    x = np.concatenate([x, x + [0, 0, 0.0125]])
    deq = {(i, j): np.linalg.norm(x[i] - x[j]) * (1.03 if (i < 3) == (j < 3) else 0.995 if i == 0 else 1.02)
           for i, j in itertools.combinations(range(6), 2) if (i < 3) == (j < 3) or j == i + 3}
    shares = {pair: 1.0 - d / 0.015 for pair, d in deq.items()}
    density, slope = ([sum(f(t) for pair, t in shares.items() if i in pair) for i in range(6)] for f in (lambda t: t * t, lambda t: 2.0 / 3.0 * t * (1.0 - t)))
    spheres = [f"sphere {i + 1} 0.0999 0 0.01 3 3 {density[i]:.17g} {slope[i]:.17g} 0.001 {torn} 0 1 0 {int(i == 0)}\n" for i in range(6)]
    header = f"# EVP bonds COUNT: {len(deq)}{' WITHIN: type' * bool(within)} JOIN_ALL: 1.2 SPHERES: 6 COLUMNS: {','.join(SPHERE)},damage UNITS: si\n"
    (tmp_path / "held.bonds").write_text(header + "".join(f"{i + 1} {j + 1} {d:.17g}\n" for (i, j), d in deq.items()) + "".join(spheres), encoding="utf-8")
    write_data(tmp_path / "body.data", x, [0.005] * 6, [[-0.02, 0.04]] * 3, types)
    text = head() + pair(FLOWING._replace(gamma=0.0, xi_s=0.1), "join 1.2 all plasticity isotropic", "fix bonds all evp/bonds file held.bonds", failing_at(0.1))
    text += "fix volume all evp/volume 500\nfix hold all move linear 0 0 0\ntimestep 1e-8\nthermo 5\n" + thermo("f_bonds[5] f_volume") + "run 20\n"
    table = lmp(text).ok().thermo()
    assert table["f_bonds[5]"].tolist() == [0, 3, 3, 3, 3] and table["f_volume"][0] > 1.0, "control"
    assert table["f_volume"] == pytest.approx(table["f_volume"][:1].repeat(5), rel=1e-12)
