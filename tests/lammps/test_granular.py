# SPDX-License-Identifier: GPL-2.0-only
"""Friction between bodies by LAMMPS' package GRANULAR in pair_style hybrid: evp/lj within a body, granular between two.

A block of spheres slides on a rigid plate, rails of spheres or the plane of fix wall/gran: it loses mu g of its speed per time and
stops after v^2/(2 mu g). Spheres do not turn: the torques on them that are dropped are what the angular momentum changes by."""

import re

import doc_blocks
import numpy as np
import pytest
from lammps_run import DECKS, read_csv, read_dump, run_lammps, slope, write_data
from small_bodies import head, thermo, words
from evp import law

RADIUS, STIFFNESS = 0.005, 2.5e7  # STIFFNESS [N/m] is about that of a bond
MU, GRAVITY, SPEED = 0.3, 1000.0, 1.0
SHAPE = (4, 3, 2)  # spheres of the block
DISTANCE, TIME = SPEED**2 / (2 * MU * GRAVITY), SPEED / (MU * GRAVITY)
HOOKE = f"hooke {STIFFNESS} 0.5 tangential linear_history {2 / 7 * STIFFNESS} 1 {MU} damping tsuji"
HERTZ = f"hertz/material 2.1e10 0.5 0.25 tangential mindlin NULL 1 {MU} damping tsuji"


def block(low=(0.0, 0.0, 0.0)):
    """Centers of touching spheres on a simple cubic lattice from `low`."""
    return np.stack(np.meshgrid(*(2 * RADIUS * np.arange(n) for n in SHAPE), indexing="ij"), axis=-1).reshape(-1, 3) + low


def write_scene(folder, gap=0.0):
    """A block, type 1, on rails along x, type 2: one below each of its rows, of spheres so close together that they are as good as flat."""
    rails = [[x, 2 * RADIUS * row, -2 * RADIUS - gap] for row in range(SHAPE[1]) for x in np.arange(-0.005, 0.042, 2.2e-4)]
    x = np.concatenate([block(), rails])
    write_data(folder / "body.data", x, [RADIUS] * len(x), [[-0.03, 0.08]] * 3, [1] * len(block()) + [2] * len(rails))


def write_blocks(folder, low):
    """Two of them, types 1 and 2, the second from `low`; their centers."""
    x = np.concatenate([block(), block(low)])
    write_data(folder / "body.data", x, [RADIUS] * len(x), [[-0.05, 0.1]] * 3, [1] * 24 + [2] * 24)
    return x


def style(contact=HOOKE, row=law.TABLE1, plasticity="isotropic"):
    return f"""comm_modify vel yes
pair_style hybrid evp/lj contact repulsive plasticity {plasticity} granular
pair_coeff 1 1 evp/lj {words(row)}
pair_coeff 2 2 none
pair_coeff 1 2 granular {contact}
neigh_modify exclude type 2 2
"""


def slide(plate="rails", contact=HOOKE, integrator="nve"):
    """After head() and style(): what moves the block, and what is written each 10 steps."""
    wall = f"fix wall block wall/gran granular {contact} zplane {-RADIUS} NULL\n" if plate == "wall" else ""
    return f"""group block type 1
fix bonds block evp/bonds
fix integrate block {integrator}
fix gravity block gravity {GRAVITY} vector 0 0 -1
{wall}fix energy all evp/energy
compute spin block property/atom omegax omegay omegaz tqy
compute omega block reduce sumsq c_spin[1] c_spin[2] c_spin[3]
compute turns block reduce sumabs c_spin[4]
variable v equal vcm(block,x)
variable x equal xcm(block,x)
timestep 1e-6
thermo 10
{thermo("time v_v v_x c_omega[*] c_turns ke f_energy f_energy[8] f_bonds[2]")}"""


START = f"velocity block set {SPEED} 0 0 units box\n"


def assert_slides(table, tolerance=0.02):
    """The speed falls by mu g per time, in the mean and in each half, and the block stops where it should."""
    moving = table["v_v"] > 0.05 * SPEED
    for part in (slice(None), slice(0, moving.sum() // 2), slice(moving.sum() // 2, None)):
        assert slope(table["Time"][moving][part], table["v_v"][moving][part]) == pytest.approx(-MU * GRAVITY, rel=tolerance)
    assert np.max(table["v_x"]) - table["v_x"][0] == pytest.approx(DISTANCE, rel=tolerance)
    assert np.all(np.abs(table["v_v"][table["Time"] > 1.05 * TIME]) < 0.02 * SPEED)


STEPS = int(1.2 * TIME / 1e-6)


@pytest.mark.parametrize("plate, ranks, newton", [("rails", 1, "on"), ("rails", 2, "off"), ("wall", 2, "on")])
def test_the_block_stops_where_it_should(lmp, tmp_path, plate, ranks, newton):
    """No sphere ever turns, though torques act; the balance holds what friction took."""
    write_scene(tmp_path, 0.0 if plate == "rails" else 0.01)
    table = lmp(head(newton) + style() + slide(plate) + START + f"run {STEPS}\n", ranks).ok().thermo()
    assert_slides(table)
    assert all(np.all(table[f"c_omega[{k}]"] == 0.0) for k in (1, 2, 3)) and np.median(table["c_turns"]) > 1e-3
    energy = 0.5 * SPEED**2 * 24 * 2700 * 4 / 3 * np.pi * RADIUS**3
    assert np.all(np.abs(table["f_energy"]) < 1e-3 * energy)
    assert table["f_energy[8]"][-1] == pytest.approx(-energy, rel=0.02)


def test_other_contacts_and_integrators(lmp_decks, tmp_path):
    """mindlin over hertz; fix nve/evp with gamma > 0; the law without flow; fix dt/evp, which tells granular of each new timestep. Under fix nve/sphere
    the block rolls on its spheres and keeps most of its speed, as doc/Howto_evp_friction.rst says."""
    write_scene(tmp_path)
    end = START + f"run {STEPS}\n"
    decks = {"hertz": style(HERTZ) + slide(contact=HERTZ) + end, "implicit": style(row=law.TABLE1._replace(gamma=100.0)) + slide(integrator="nve/evp") + end,
             "eq. 8": style(plasticity="none") + slide() + end, "dt/evp": style() + slide() + "fix dt block dt/evp 50 0.4 max 1.5e-6\n" + end,
             "roll": style() + slide(integrator="nve/sphere") + START + f"run {STEPS // 2}\n"}
    runs = lmp_decks({name: head() + text for name, text in decks.items()})
    table = runs.pop("roll").thermo()
    assert table["v_v"][-1] > 0.8 * SPEED and table["c_omega[2]"][-1] > 0.0
    for run in runs.values():
        assert_slides(run.thermo())


def test_what_the_torques_would_have_kept(lmp, tmp_path):
    """Two free blocks meet obliquely: dL/dt = sum over the contacts of (x_i - x_j) x F_t = -sum of LAMMPS' torques."""
    write_blocks(tmp_path, (0.4 * RADIUS, 0.6 * RADIUS, 2 * RADIUS * (SHAPE[2] - 1) + 1.87 * RADIUS))
    text = head() + style().replace("2 2 none", f"2 2 evp/lj {words(law.TABLE1)}").replace("neigh_modify exclude type 2 2\n", "") + f"""
fix bonds all evp/bonds within type
fix integrate all nve
group upper type 2
velocity upper set 3 1 -2 units box
compute torque all property/atom tqx tqy
compute sum all reduce sum c_torque[*]
variable lx equal angmom(all,x)
variable ly equal angmom(all,y)
timestep 1e-6
thermo 1
{thermo("v_lx v_ly c_sum[*]")}run 600
"""
    table = lmp(text, 2).ok().thermo()
    for name, torque in (("v_lx", table["c_sum[1]"]), ("v_ly", table["c_sum[2]"])):
        dropped = 1e-6 * np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]))])
        change, largest = table[name] - table[name][0], np.abs(table[name]).max()
        assert np.abs(change + dropped).max() < 1e-8 * largest and np.abs(change[-1]) > 1e-3 * largest


# ---- decks ----


def test_the_deck(tmp_path):
    """in.sliding stops within 2 %, and writes what friction and load were; frames.lmp leaves a compute of the user's, named as one of the decks, alone."""
    (tmp_path / "also.lmp").write_text(f"compute state all ke/atom\ninclude {DECKS}/frames.lmp\n", encoding="utf-8")
    run_lammps("in.specimen", 1, {"n": 150, "shape": "block", "length": 0.02, "width": 0.01, "height": 0.01, "out": "block.data"}, tmp_path).ok()
    choices = {"block": "block.data", "friction": 0.5, "speed": 2, "gravity": 4000, "also": "also.lmp", "frames": 2, "out": "slid"}
    found = run_lammps("in.sliding", 2, choices, tmp_path).ok()
    ratios = [float(word) for word in re.findall(r"ratio (\S+)", found.stdout)]
    assert len(ratios) == 2 and np.allclose(ratios, 1.0, atol=0.02), ratios
    rows = read_csv(tmp_path / "slid.csv")
    moving = rows["speed"] > 0.2
    assert np.sum(rows["friction"][moving]) == pytest.approx(0.5 * np.sum(rows["normal"][moving]), rel=0.02)
    assert np.abs(rows["imbalance"]).max() < 1e-4
    assert len(read_dump(tmp_path / "slid_frames.dump")) == 3


def test_the_script_of_the_page(lmp, tmp_path):
    """doc/Howto_evp_friction.rst: a block on another one, pushed down and sideways, drags it along and keeps no momentum for itself."""
    script = next(one.text for one in doc_blocks.blocks("doc/Howto_evp_friction.rst") if "hybrid evp/lj" in one.text)
    x = write_blocks(tmp_path, (0.0, 0.0, 2 * RADIUS * SHAPE[2]))
    motion = """group lower type 1
group upper type 2
velocity upper set 1 0 -0.5 units box
variable below equal vcm(lower,x)
variable above equal vcm(upper,x)
timestep 1e-6
thermo 50
"""
    table = lmp(head() + script + motion + thermo("v_below v_above f_bonds") + "run 300\n", 2).ok().thermo()
    pairs = sum(np.linalg.norm(a - b) < 1.5 * 2 * RADIUS for body in (x[:24], x[24:]) for k, a in enumerate(body) for b in body[:k])
    assert np.all(table["f_bonds"] == pairs), "none between the bodies"
    assert table["v_below"][-1] > 0.05
    assert table["v_below"] + table["v_above"] == pytest.approx(1.0, rel=1e-9), "of equal masses"


GRAINS = """units si
atom_style sphere
atom_modify map yes
newton {newton}
boundary f f f
region box block -0.02 0.08 -0.02 0.05 -0.02 0.08 units box
create_box 2 box
create_atoms 1 single 0 0 0 units box
create_atoms 1 single 0 0 -0.007 units box
create_atoms 2 single 0.0005 0 0.007 units box
create_atoms 2 single 0.0005 0 0.014 units box
{more}set group all diameter 0.00707
set group all density 2700
pair_style hybrid evp/lj contact repulsive plasticity isotropic granular
"""
RUB = """neighbor 0.0005 bin
comm_modify vel yes
pair_coeff 1 1 evp/lj 80 8 4 3 8 4 0.005 0 1.5
pair_coeff 2 2 evp/lj 80 8 4 3 8 4 0.005 0 1.5
pair_coeff 1 2 granular hooke 2.5e7 0.5 tangential linear_history 7e6 1 0.3 damping tsuji
fix bonds all evp/bonds within type
fix move all nve/noforce
timestep 2e-7
compute fx all reduce sum v_pull
thermo 25
"""
# a second pair of grains, side by side with the first one
FOUR = "create_atoms 1 single 0.04 0 0 units box\ncreate_atoms 1 single 0.04 0 -0.007 units box\ncreate_atoms 2 single 0.0405 0 0.007 units box\ncreate_atoms 2 single 0.0405 0 0.014 units box\n"
ROUTES = {"split": "run 150\nrun 50\n", "write_restart": "run 150\nwrite_restart now.restart\nrun 50\n",
          "twice": "run 75\nwrite_restart now.restart\nrun 75\nwrite_restart now.restart\nwrite_data now.data\nrun 50\n",
          "restart while it runs": "restart 150 now.restart\nrun 200\nrestart 0\n"}


@pytest.mark.parametrize("contacts, ranks, newton", [(1, 1, "on"), (1, 2, "off"), (2, 3, "on")])
def test_the_history_of_friction_survives_restart_files(lmp, contacts, ranks, newton):
    """A tangential spring of 7e6 N/m from the first step on: its force grows with the way, in the run that recorded the bonds, and after a restart."""
    pull = "variable pull atom fx*(type==2)\n" + RUB + thermo("c_fx")
    start = GRAINS.format(newton=newton, more=FOUR if contacts == 2 else "") + pull
    moving = "velocity all set 0 0 0 units box\ngroup two type 2\nvelocity two set 0.3 0 0 units box\n"
    ways = {name: lmp(start + moving + lines, ranks).ok() for name, lines in ROUTES.items()}
    ways["restarted"] = lmp("read_restart now.restart\n" + pull + "run 50\n", ranks).ok()
    plain = lmp(start.replace("hybrid evp/lj contact repulsive plasticity isotropic granular", "hybrid lj/cut 0.007 granular").replace("evp/lj 80 8 4 3 8 4 0.005 0 1.5", "lj/cut 0 0.005")
                .replace("fix bonds all evp/bonds within type\n", "") + moving + "run 200\n", ranks).ok().thermo()["c_fx"]
    assert plain[-1] == pytest.approx(contacts * 1.920261533, rel=1e-6), "control: of the spring alone"
    for name, run in ways.items():
        assert run.thermo()["c_fx"][-1] == pytest.approx(plain[-1], rel=1e-9), name
