# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: heat that softens what makes it."""

from heated import ACCOUNT, LAST, SOFTEN, TMELT, last, sheared
from robust import LEDGER_SHARE, on


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
