# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: heat that softens what makes it, and heat of friction."""

import numpy as np
from heated import ACCOUNT, LAST, LAYER, SOFTEN, TMELT, hot_on_cold, last, lost_and_heat, plate, rubbing, sheared, stretched
from robust import LEDGER_SHARE, on
from small_bodies import dump


@on(1, 2, 4, 8)
def test_a_band_that_heats_itself_to_melting(bench):
    """Simple shear of a body with a twentieth of the heat capacity of aluminium to a strain of 0.18: energy imbalance below 1e-3 of the plastic work, that of the
    account of heat below 1e-10; no sphere above 1.001 of the melting temperature with latent heat, 1.15 without. Control: it reaches the melting temperature."""
    shown = []
    for melt, most in (("melt 4e5", 1.001), ("", 1.15)):
        run = bench.run(sheared(f"{SOFTEN} {melt}", every=100, capacity=40.0, conductivity=5.0, gamma=0.0) + "thermo 100\nrun 3000\n" + LAST).ok()
        table = run.thermo()
        share = abs(table["f_energy"]).max() / table["f_energy[9]"][-1]
        highest = table["f_heat[6]"].max() / TMELT
        assert highest >= 1.0, "control"
        assert share < LEDGER_SHARE and highest < most and abs(last(run)[0]) < ACCOUNT * last(run)[1]
        shown.append(f"{melt or 'no latent heat'}: {highest:.4f} of the melting temperature, energy imbalance {share:.1e}, of the heat {abs(last(run)[0] / last(run)[1]):.0e}")
    bench.show("; ".join(shown))


@on(1, 2, 3, 4)
def test_spheres_that_rub_across_a_boundary(bench):
    """Two spheres that meet obliquely, two that turn too and two that nearly roll on each other, by pair granular, where MPI ranks meet: the heat of friction is the kinetic energy that
    is lost, within 1e-3, and the fix does not change a bit of the motion. Control: they rub."""
    shown = []
    for name, choices in (("oblique", {}), ("turning", {"spin": 300.0}), ("nearly rolling", {"speed": 0.25, "across": 3.9, "apart": 0.0005, "gap": 1e-5, "spin": 700.0, "dt": 2.5e-7, "steps": 1200})):
        text = rubbing(place=0.005, **choices) + dump("end.dump", 1, "x y z vx vy vz omegax omegay omegaz") + "run 0\n"
        run = bench.run(text).ok()
        lost, heat = lost_and_heat(run)
        motion = (bench.folder / "end.dump").read_text(encoding="utf-8")
        bench.run(text.replace("fix heat all evp/heat every 10\n", "").replace("f_heat[1]", "")).ok()
        assert motion == (bench.folder / "end.dump").read_text(encoding="utf-8")
        assert lost > 1e-6, "control"
        assert abs(heat / lost - 1.0) < 1e-3
        shown.append(f"{name}: heat over the energy lost 1 {heat / lost - 1.0:+.1e}")
    bench.show("; ".join(shown))


@on(1, 2, 3)
def test_a_fast_bond_that_comes_to_rest(bench):
    """A bond is stretched at 600/s and at 2000/s, with a rate that would make it hold beyond its strongest strain: it does not. A minimization finds the force of rest,
    within 1e-6, and a run behind it leaves it. Control: the fast bond holds more."""
    shown = []
    for row, speed, strain in (("0.005 0 1.5 flow 0 1 1 1 rate 0.1 1", 2.0, 0.005), ("0.15 0 1.5 flow 0 1 1 1 rate 0.1 1", 20.0, 0.15)):
        steps = 500 if speed == 2.0 else 2000
        rest = "fix hold all setforce 0 0 0\nminimize 0 1e-9 100 100\nunfix hold\nrun 0\nrun 500\n"
        run = bench.run(stretched(row, speed=speed, steps=steps, dt=1e-3 / speed / steps * (1.0 if speed == 2.0 else 4.0), more=rest)).ok()
        fast = run.thermo(0)["c_stretch"].max()
        in_it, at_rest, behind = (run.thermo(block)["c_pull"][-1] for block in (1, 2, 3))
        assert fast > 1.1 * strain, "control"
        assert fast < (2.0**0.25 - 1.0) * (1.0 + 1e-9)
        r, d = 1.0 + strain, 0.011 if speed == 2.0 else 0.014
        right = -640.0 * (r**-4 - r**-8) / d
        assert all(abs(force / right - 1.0) < 1e-6 for force in (in_it, at_rest, behind))
        shown.append(f"xi_s {strain}: up to {fast:.4f}, at rest {at_rest / right - 1.0:+.0e}")
    bench.show("; ".join(shown))


@on(1, 2, 3, 4)
def test_atoms_that_come_to_a_hot_plate(bench):
    """Onto a plate whose halves are at 300 and 600 K, after some spheres were deleted: new layers have temperatures of their neighbors, with the mean of the plate within 1 K, and two
    spheres away from the middle those of their half. One without bonds is an error."""
    delete = "run 0\ngroup gone id 1 2\ndelete_atoms group gone compress no\nwrite_restart more.rst\n"
    run = bench.run(plate(more=delete + LAYER + "run 0\nwrite_dump all custom end.dump id x c_T modify format float %.9g\n")).ok()
    end = run.dump("end.dump")[-1]
    new = end["id"] > 72
    inside = np.abs(np.mod(end["x"] + 0.0025, 0.03) - 0.015) < 0.0075
    right = np.where(np.mod(end["x"] + 0.0025, 0.06) > 0.03, 600.0, 300.0)
    assert np.sum(new & inside) > 20 and np.all(end["c_T"][new & inside] == right[new & inside])
    assert abs(end["c_T"][new].mean() - 450.0) < 1.0
    lost = bench.run(plate(new="new no", more="run 0\n" + LAYER + "run 0\n"))
    assert lost.returncode == 1 and "came without a temperature" in " ".join(lost.stdout.split())
    bench.show(f"{np.sum(new)} new spheres from {end['c_T'][new].min():.4g} to {end['c_T'][new].max():.4g} K, mean {end['c_T'][new].mean():.4g} K")


@on(1, 2, 3)
def test_two_plates_that_heat_each_other(bench):
    """A hot plate on a cold one, by pair granular, where nobody sends ghosts their temperatures: what one loses the other takes, newton off."""
    run = bench.run(hot_on_cold("", "off", more="run 120\n")).ok()
    table = run.thermo(0)
    assert table["c_below"][-1] - 293.0 > 0.05, "control"
    assert abs(table["f_heat[2]"][-1]) < 1e-9
    bench.show(f"the cold plate {table['c_below'][-1] - 293.0:+.4g} K, made of nothing {table['f_heat[2]'][-1]:.0e} J")
