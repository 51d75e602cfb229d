# SPDX-License-Identifier: GPL-2.0-only
"""in.impact: with plasticity the plate keeps a crater and the ball comes back slower than with the reversible law; friction slows it along the plate.
in.taylor: an elastic rod leaves the wall after a wave's way to its end and back, as fast as it came; a bar that flows does not."""

import itertools
import re

import numpy as np
import pytest
from evp.specimen import read_data
from lammps_run import DECKS, REFERENCE, packed, read_csv, read_dump, run_lammps, write_data

SPEED = 60.0  # where none is given
LINES = {"in.impact": r"^crater depth (\S+) m, rebound speed (\S+) m/s$",
         "in.taylor": r"^final length (\S+) m, foot radius (\S+) m, rebound speed (\S+) m/s, contact time (\S+) s$"}


def run(deck, folder, ranks=1, **choices):
    """The numbers of the deck's line, energy imbalance, the run."""
    found = run_lammps(deck, ranks, {"out": "run", "speed": SPEED, **choices}, folder).ok()
    imbalance = float(re.search(r"energy imbalance over impact energy: (\S+)", found.stdout)[1])
    return [float(word) for word in re.search(LINES[deck], found.stdout, re.M).groups()], imbalance, found


# ---- in.impact ----


plate = packed("plate.data", n=700, shape="block", length=0.006, width=0.016, height=0.016)


@pytest.fixture(scope="module")
def bodies(plate):
    """The plate, and a ball of 120 spheres of about the same size."""
    (plate.parent / "ball.region").write_text("region body sphere 0.004 0 0 0.004\n")
    run_lammps("in.specimen", 1, {"n": 120, "shape": "region", "region": "ball.region", "length": 0.008, "out": "ball.data"}, plate.parent).ok()
    return {"plate": plate, "ball": plate.parent / "ball.data"}


def test_crater_and_rebound(tmp_path, bodies):
    """Within 1e-3 of the impact energy; the wall's force is the change of the ball's momentum; the reversible law leaves no crater. Frames show the
    held spheres at rest and the others not."""
    (crater, rebound), imbalance, found = run("in.impact", tmp_path, **bodies, also=DECKS / "frames.lmp", frames=2)
    rows = read_csv(tmp_path / "run.csv")
    assert crater > 4e-5 and 0.0 < rebound < 0.6 * SPEED and abs(imbalance) < 1e-3
    assert "WARNING" not in found.stdout and len(found.stdout.splitlines()) <= 90
    energy = rows["kinetic_energy"][0]
    mass = 2.0 * energy / SPEED**2
    assert np.sum(rows["force"][1:] * np.diff(rows["time"])) == pytest.approx(mass * (rebound + SPEED), rel=2e-3)
    assert 0.3 * energy < rows["plastic_work"][-1] < energy and np.all(np.diff(rows["plastic_work"]) >= 0.0)
    state, start = read_dump(tmp_path / "run_state.dump")[-1], read_data(bodies["plate"])
    assert set(state["type"]) == {1, 2} and state["plastic_strain"].max() > 0.01
    near = np.flatnonzero(start.x[:, 0] > 0.006 - 0.75 * 2.0 * start.radius.mean())
    assert crater == pytest.approx((start.x[near, 0] - state["x"][near]).max(), rel=1e-3) and len(near) > 3, "the largest sink of the face"
    first, *_, last = read_dump(tmp_path / "run_frames.dump")
    rest = np.abs(last.x - first.x).max(axis=1) < 1e-12
    assert rest.sum() > 50 and not np.any(rest & (first["type"] == 2)) and first["x"][rest].max() < 0.5 * first["x"][first["type"] == 1].max()

    (none, twin), balance, _ = run("in.impact", tmp_path, **bodies, plasticity="none")
    assert abs(none) < 0.2 * crater and twin > 1.3 * rebound and abs(balance) < 5e-3


@pytest.mark.parametrize("choices, left", [({"speed": 10}, True), ({"time": 1e-5}, False)])
def test_the_run_ends_once_the_ball_has_left(tmp_path, bodies, choices, left):
    """However slow the ball is; a run that ends before by -var time says so."""
    metal = DECKS.parent / "potentials/metals.evp"
    metals = {"material": f"{metal}:aluminium_2024T351", "material_ball": f"{metal}:steel_4340"}
    (_, rebound), _, found = run("in.impact", tmp_path, **bodies, **metals, **choices)
    force = read_csv(tmp_path / "run.csv")["force"]
    assert (rebound > 0.0) == left == (abs(force[-1]) < 1e-6 * force.max())
    assert left != ("WARNING: the run ends before the ball has left the plate" in found.stdout) and f"coeff_ball {metal}:steel_4340" in found.stdout


@pytest.mark.parametrize("contact, sticks", [("join 1.2 all", True), ("join", False), ("literal", False)])
def test_a_ball_that_sticks_is_said_to(tmp_path, bodies, contact, sticks):
    """Where contact join joins bodies; it is pulled back, and no longer run would let it leave. Without, also where the run ends early, nothing pulls.
    The run ends at its time, also with a timestep that becomes shorter."""
    (tmp_path / "step.lmp").write_text("fix step all dt/evp 20 0.1\n", encoding="utf-8")
    choices = {"contact": contact, "speed": 300, **({} if contact == "join 1.2 all" else {"time": 2e-5, "also": "step.lmp"}), **({"plasticity": "none"} if contact == "literal" else {})}
    _, _, found = run("in.impact", tmp_path, **bodies, **choices)
    force = read_csv(tmp_path / "run.csv")["force"]
    said = re.search(r"NOTE: the ball sticks to the plate, or has not torn off yet: .* by up to (\S+) N;", found.stdout)
    assert bool(said) == sticks == (force.min() < -1e-3 * force.max()) != ("WARNING: the run ends before the ball has left the plate" in found.stdout)
    assert not sticks or float(said[1]) == pytest.approx(-force.min(), rel=1e-3)
    assert sticks or read_csv(tmp_path / "run.csv")["time"][-1] == pytest.approx(2e-5, rel=0.02)


def test_a_metal_flows_inside_and_not_where_it_touches(tmp_path, bodies):
    """With hardly any hardening ball and plate do not run into each other: the crater is that of a granular contact, which cannot flow."""
    metal = {"material": DECKS.parent / "potentials/metals.evp:aluminium_2024T351", "time": 6e-5}
    (crater, rebound), imbalance, found = run("in.impact", tmp_path, **bodies, **metal)
    lowest = float(re.search(r"lowest d/\(R_i \+ R_j\) (\S+);", found.stdout)[1])
    (granular, twin), _, _ = run("in.impact", tmp_path, **bodies, friction=0, **metal)
    assert abs(imbalance) < 1e-3 and lowest > 0.75 and "WARNING" not in found.stdout
    assert crater == pytest.approx(granular, rel=0.15) and crater > 1e-5
    assert rebound == pytest.approx(twin, rel=0.25), "what a contact of another style presses follows its surroundings"


def test_friction_of_the_ball(tmp_path, bodies):
    """A ball that flies obliquely loses more of its speed along the plate with friction, and the balance closes."""
    left = {}
    for friction in ("off", 0.4):
        _, imbalance, found = run("in.impact", tmp_path, 2, **bodies, speed=50, sideways=50, time=8e-5, friction=friction)
        left[friction] = float(re.search(r"^speed along the plate (\S+) m/s", found.stdout, re.M)[1])
        assert abs(imbalance) < 1e-3 or friction == "off", "above"
    assert left[0.4] < left["off"] - 3.0, left


# ---- in.taylor ----

DENSITY = 2700.0  # of the spheres that write_data writes [kg/m3]
SPACING = 0.001  # lattice constant [m]
AREA = (2.5 * SPACING) ** 2  # with a share of half a cell beyond the outer centres [m2]


def write_rod(folder, cells=120):
    """An FCC rod of 2 x 2 cells across: its mass, length, radius of a disc with its moment of inertia, and coefficients."""
    sites = [np.array(site) + shift for site in itertools.product(range(cells + 1), range(3), range(3))
             for shift in ((0, 0, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (0.5, 0.5, 0))]
    sites = np.array([site for site in sites if site[0] <= cells and site[1] <= 2 and site[2] <= 2])
    radius = np.full(len(sites), SPACING / np.sqrt(8.0))
    x = SPACING * (sites - [0.0, 1.0, 1.0]) + [radius[0], 0.0, 0.0]
    length = cells * SPACING + 2.0 * radius[0]
    write_data(folder / "rod.data", x, radius, np.array([[-0.01, length + 0.01], [-0.01, 0.01], [-0.01, 0.01]]))
    volume, solid = AREA * length, np.sum(4.0 / 3.0 * np.pi * radius**3)
    (folder / "rod.data.body").write_text(f"variable length index {length:.15g}\nvariable area index {AREA:.15g}\n"
                                          f"variable volume index {volume:.15g}\nvariable solid_fraction index {solid / volume:.15g}\n")
    as_typed = len(radius) / 500 * np.pi * 0.02**2 * 0.05 / volume  # in.taylor divides by it, as nine numbers are for the paper's body
    foot = x[:, 0] < 6.0 * radius[0]  # three diameters from its front, which is at 0
    disc = np.sqrt(2.0 * np.mean((x[:, 1]**2 + x[:, 2]**2 + 0.4 * radius**2)[foot]))
    return DENSITY * solid, length, disc, f"{0.5 * as_typed:.12g} 8 4 {0.02 * as_typed:.12g} 8 4 0.005 0 1.5"


def test_elastic_rod(tmp_path):
    """Contact time 2 L/c and rebound speed within 2 %, c from mass, length and the stiffness that in.quasistatic measures."""
    mass, length, disc, row = write_rod(tmp_path)
    run_lammps("in.quasistatic", 1, {"specimen": "rod.data", "coeff": row, "contact": "none", "strain": 2e-4, "increment": 1e-4, "out": "rest"}, tmp_path).ok()
    rest = read_csv(tmp_path / "rest.csv")
    stiffness = rest["stress_virial"][-1] * AREA / rest["strain_gauge"][-1]
    speed_of_sound = np.sqrt(stiffness * length / mass)
    speed = 0.05 * 0.005 * speed_of_sound
    choices = {"specimen": "rod.data", "coeff": row, "contact": "none", "plasticity": "none", "speed": speed}
    (end, foot, rebound, contact), imbalance, found = run("in.taylor", tmp_path, **choices)
    rows = read_csv(tmp_path / "run.csv")
    assert contact == pytest.approx(2.0 * length / speed_of_sound, rel=0.02)
    assert rebound == pytest.approx(speed, rel=0.02) and rebound < speed
    assert end == pytest.approx(length, rel=1e-5) and foot == pytest.approx(disc, rel=1e-3)
    assert abs(imbalance) < 1e-4 and "WARNING" not in found.stdout
    step = rows["time"][1] - rows["time"][0]
    assert np.sum(rows["force"]) * step == pytest.approx(mass * (rebound + speed), rel=1e-3), "the wall's force is what turns the rod"
    plateau = rows["force"][(rows["time"] > 0.2 * contact) & (rows["time"] < 0.8 * contact)].mean()
    assert plateau == pytest.approx(stiffness * speed / speed_of_sound, rel=0.03), "impedance times speed"


def test_bar_that_flows(tmp_path):
    """It stays shorter, has a wider foot and comes back slower; nothing of that with the reversible law. A limit that grows at every tenth step leaves an
    imbalance of first order in the timestep: half the default one here."""
    bar = {"specimen": REFERENCE, "coeff": "80 8 4 3 8 4 0.005 0 1.5", "speed": 130, "time": 2e-4, "dtfraction": 0.1}
    (length, foot, rebound, contact), imbalance, _ = run("in.taylor", tmp_path, **bar, also=DECKS / "frames.lmp", frames=4)
    assert length < 0.0495 and 0.0 < rebound < 40.0 and abs(imbalance) < 1e-3
    assert contact < 1.9e-4 and read_csv(tmp_path / "run.csv")["force"][-3:] == pytest.approx(0.0, abs=1e-9)
    frames = read_dump(tmp_path / "run_frames.dump")
    assert len(frames) == 5 and frames[0].step == 0 and frames[-1]["plastic_strain"].max() > 0.01
    assert {"bonds", "share_second", "share_lost", "new_pairs", "plastic_work", "volume_strain"} <= set(frames[-1].columns)
    (there, narrow, twin, _), balance, _ = run("in.taylor", tmp_path, **bar, plasticity="none")
    assert foot > narrow
    assert there > length + 5e-4 and twin > 1.5 * rebound and abs(balance) < 5e-3


def test_a_slow_bar_comes_back_no_faster_than_it_came(tmp_path):
    """Also where spheres stand out of its face, and would begin within the wall."""
    data = REFERENCE.read_text(encoding="utf-8").splitlines(keepends=True)
    first = next(k for k, line in enumerate(data) if line.startswith("Atoms")) + 2
    front = min(range(first, first + 500), key=lambda k: float(data[k].split()[4]) - 0.5 * float(data[k].split()[2]))
    words = data[front].split()
    words[4] = f"{float(words[4]) - 0.2 * float(words[2]):.9g}"  # atom-ID type diameter density x y z
    data[front] = " ".join(words) + "\n"
    (tmp_path / "rough.data").write_text("".join(data), encoding="utf-8")
    (tmp_path / "rough.data.body").write_bytes((REFERENCE.parent / f"{REFERENCE.name}.body").read_bytes())
    (_, _, rebound, _), imbalance, _ = run("in.taylor", tmp_path, specimen="rough.data", speed=0.05, time=2e-4)
    assert abs(rebound) < 0.05 and abs(imbalance) < 1e-3
    assert read_csv(tmp_path / "run.csv")["speed"][0] == pytest.approx(-0.05, rel=0.05)
