# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/heat: the heat of granular friction beside closed forms and the energy that is lost; the motion stays the same."""

import numpy as np
import pytest
from evp import law
from heated import ENTRIES, GRANULAR, PROPERTIES, lost_and_heat, rubbing
from lammps_run import write_data
from small_bodies import dump, head, thermo, words

SLIDING = """fix properties all property/atom temperature heatflow ghost yes
set group all temperature 300
pair_style hybrid evp/lj gran/hooke{history} 1e6 NULL 0 1e{damping} 0.4 1
pair_coeff * * evp/lj {words} density 2700 conductivity 100 capacity 900
pair_coeff 1 2 gran/hooke{history}
fix bonds all evp/bonds
group slides id 2
group rests id 1
fix slides slides move linear 2.0 0 0
fix rests rests move rotate -1e-4 0 0 0 1 0 {period}
fix heat all evp/heat every 10
timestep 1e-7
thermo 100
"""


@pytest.mark.parametrize("history", ["", "/history"])
@pytest.mark.parametrize("newton, ranks", [("on", 1), ("on", 2), ("off", 2)])
def test_heat_of_friction(lmp, tmp_path, history, newton, ranks):
    """A sphere slides on another one that turns below it, by a stock granular style: the heat is mu N times the way at the contact, half to each."""
    write_data(tmp_path / "body.data", np.array([[-1e-4, 0.0, 0.0], [0.0, 0.0, 0.00999]]), [0.005] * 2, [[-0.05, 0.05]] * 3, [1, 2])
    turns = 300.0  # [rad/s]
    text = head(newton, "p p p", skin=0.001, before="comm_modify vel yes") + SLIDING.format(words=words(law.TABLE1), history=history, period=2.0 * np.pi / turns, damping=7)
    text = text.replace("read_data body.data", "read_data body.data\nset atom 1 omega 0 300 0")
    run = lmp(text + thermo(ENTRIES) + "compute T all property/atom temperature\n" + dump("end.dump", 1000, "c_T") + "run 1000\nrun 0\n", ranks).ok()
    t = np.linspace(0.0, 1e-4, 2001)
    x = 1e-4 + 2.0 * t
    d = np.hypot(x, 0.00999)
    slips = 2.0 * 0.00999 / d - 300.0 * 0.005  # of the points of contact, along the tangent
    power = 0.4 * 1e6 * (0.01 - d) * np.abs(slips)
    heat = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(t))
    table = run.thermo(0)
    assert table["f_heat[1]"][-1] == pytest.approx(heat, rel=0.02) and heat > 1e-5
    end = run.dump("end.dump")[-1]["c_T"] - 300.0
    assert end[0] == pytest.approx(end[1], rel=1e-6) and end[0] > 0.0


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (3, "on")])
def test_friction_is_the_kinetic_energy_that_is_lost(lmp_decks, ranks, newton):
    """Of two spheres that meet obliquely, of such that nearly roll on each other, and by each style: the same heat in the middle, across a periodic boundary and
    across MPI ranks. What is not heat is the error of the normal springs, of second order in dt."""
    meet, roll = {"newton": newton}, {"speed": 0.25, "across": 3.9, "apart": 0.0005, "gap": 1e-5, "spin": 700.0, "newton": newton, "dt": 2.5e-7, "steps": 1200}
    places = {"middle": 0.0, "boundary": 0.055, "ranks": 0.005, "three ranks": 0.0217}
    decks = {("meet", name): rubbing(place=place, **meet) for name, place in places.items()}
    decks.update({("roll", name): rubbing(place=place, **roll) for name, place in places.items()})
    decks["meet", "in pieces"] = rubbing(place=0.005, **meet).replace("run 1000\n", "run 430\nrun 20 pre no\ntimestep 4e-7\nrun 1375\n")
    decks["meet", "short"] = rubbing(dt=2.5e-7, steps=4000, **meet)
    decks.update({("slide", style): rubbing(style, across=3.9, spin=100.0, place=0.005, **meet) for style in ("gran/hooke", "gran/hooke/history", "gran/hertz/history")})
    found = {name: lost_and_heat(run.ok()) for name, run in lmp_decks(decks, ranks).items()}
    for (kind, place), (lost, heat) in found.items():
        assert heat == pytest.approx(lost, rel=1e-3) and lost > 1e-6, (kind, place)
        if (kind, "middle") in found and place not in ("short", "in pieces"):
            assert heat == pytest.approx(found[kind, "middle"][1], rel=1e-9), (kind, place)
    lost, heat = found["meet", "short"]
    assert heat == pytest.approx(lost, rel=5e-5)


def two_bodies_that_rub(style, heat):
    """They meet obliquely and turn, pairs of both by a granular style; heat: line of the fix, or none."""
    name, row = GRANULAR[style]
    return head("on", boundary="s s s", skin=0.0008, before="comm_modify vel yes") + f"""{PROPERTIES}set group all temperature 300
pair_style hybrid evp/lj contact repulsive plasticity isotropic {name}
pair_coeff * * evp/lj {words(law.TABLE1)} density 2700 conductivity 100 capacity 900
pair_coeff 1 2 {row}
fix bonds all evp/bonds within type
group two type 2
velocity two set -20 15 5
set type 2 omega 300 -200 100
fix move all nve/sphere
timestep 3e-7
{heat}
{dump(every=150, columns="x y z vx vy vz fx fy fz omegax omegay omegaz tqx tqy tqz")}run 300
run 150
"""


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_fix_does_not_change_the_motion(lmp_decks, tmp_path, ranks):
    """By any granular style, though pairs slip and single() of pair granular moves what these remember: bit by bit."""
    rng = np.random.default_rng(3)
    one = 0.0102 * np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + rng.uniform(-2e-4, 2e-4, (27, 3))
    write_data(tmp_path / "body.data", np.concatenate([one, one + [0.0302, 0.003, 0.002]]), [0.005] * 54, [[-0.02, 0.07]] * 3, [1] * 27 + [2] * 27)
    decks = {(style, heat): two_bodies_that_rub(style, heat) for style in GRANULAR for heat in ("", "fix heat all evp/heat every 10\nthermo_style custom step f_heat[1]")}
    wrote = {}
    for (style, heat), run in lmp_decks(decks, ranks).items():
        wrote[style, heat != ""] = (run.ok().folder / "all.dump").read_text(encoding="utf-8")
        assert not heat or run.thermo()["f_heat[1]"][-1] > 1e-4, f"control: it rubs, {style}"
    for style in GRANULAR:
        assert wrote[style, True] == wrote[style, False], style
