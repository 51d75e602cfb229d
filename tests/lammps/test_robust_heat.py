# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: heat that softens what makes it, and heat of friction."""

from heated import ACCOUNT, LAST, SOFTEN, TMELT, last, lost_and_heat, rubbing, sheared
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


@on(2, 1, 3, 4)
def test_spheres_that_rub_across_a_boundary(bench):
    """Two spheres that meet obliquely and two that nearly roll on each other, by pair granular, where MPI ranks meet: the heat of friction is the kinetic energy that
    is lost, within 1e-3, and the fix does not change a bit of the motion. Control: they rub."""
    shown = []
    for name, choices in (("oblique", {}), ("nearly rolling", {"speed": 0.25, "across": 3.9, "apart": 0.0005, "gap": 1e-5, "spin": 700.0, "dt": 2.5e-7, "steps": 1200})):
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
