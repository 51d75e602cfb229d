# SPDX-License-Identifier: GPL-2.0-only
"""in.taylor: an elastic rod leaves the wall after a wave's way to its end and back, as fast as it came; a bar that flows does not."""

import itertools
import re

import numpy as np
import pytest
from lammps_run import DECKS, REFERENCE, read_csv, read_dump, run_lammps, write_data

DENSITY = 2700.0  # of the spheres that write_data writes [kg/m3]
SPACING = 0.001  # lattice constant [m]
AREA = (2.5 * SPACING) ** 2  # with a share of half a cell beyond the outer centres [m2]
LINE = re.compile(r"^final length (\S+) m, foot radius (\S+) m, rebound speed (\S+) m/s, contact time (\S+) s$", re.M)


def run(folder, ranks=1, **choices):
    """(length, foot radius, rebound speed, contact time) of the last line, rows, energy imbalance, what was printed."""
    found = run_lammps("in.taylor", ranks, {"out": "run", **choices}, folder).ok()
    imbalance = float(re.search(r"energy imbalance over impact energy: (\S+)", found.stdout)[1])
    return [float(word) for word in LINE.search(found.stdout).groups()], read_csv(folder / "run.csv"), imbalance, found


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
    (end, foot, rebound, contact), rows, imbalance, found = run(
        tmp_path, specimen="rod.data", coeff=row, contact="none", plasticity="none", speed=speed)
    assert contact == pytest.approx(2.0 * length / speed_of_sound, rel=0.02)
    assert rebound == pytest.approx(speed, rel=0.02) and rebound < speed
    assert end == pytest.approx(length, rel=1e-5) and foot == pytest.approx(disc, rel=1e-3)
    assert abs(imbalance) < 1e-4 and "WARNING" not in found.stdout
    step = rows["time"][1] - rows["time"][0]
    assert np.sum(rows["force"]) * step == pytest.approx(mass * (rebound + speed), rel=1e-3), "the wall's force is what turns the rod"
    plateau = rows["force"][(rows["time"] > 0.2 * contact) & (rows["time"] < 0.8 * contact)].mean()
    assert plateau == pytest.approx(stiffness * speed / speed_of_sound, rel=0.03), "impedance times speed"


def test_bar_that_flows(tmp_path):
    """It stays shorter, has a wider foot and comes back slower; nothing of that with the reversible law."""
    bar = {"specimen": REFERENCE, "coeff": "80 8 4 3 8 4 0.005 0 1.5", "speed": 130, "time": 2e-4}
    (length, foot, rebound, contact), rows, imbalance, _ = run(tmp_path, **bar, also=DECKS / "frames.lmp", frames=4)
    assert length < 0.0495 and 0.0 < rebound < 40.0 and abs(imbalance) < 1e-3
    assert contact < 1.9e-4 and rows["force"][-3:] == pytest.approx(0.0, abs=1e-9)
    frames = read_dump(tmp_path / "run_frames.dump")
    assert len(frames) == 5 and frames[0].step == 0 and frames[-1]["plastic_strain"].max() > 0.01
    assert {"bonds", "share_second", "share_lost", "new_pairs", "plastic_work", "volume_strain"} <= set(frames[-1].columns)
    (there, narrow, twin, _), _, balance, _ = run(tmp_path, **bar, plasticity="none")
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
    (_, _, rebound, _), rows, imbalance, _ = run(tmp_path, specimen="rough.data", speed=0.05, time=2e-4)
    assert abs(rebound) < 0.05 and abs(imbalance) < 1e-3
    assert rows["speed"][0] == pytest.approx(-0.05, rel=0.05)
