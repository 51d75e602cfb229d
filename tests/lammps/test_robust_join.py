# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: bonds that begin."""

import numpy as np
from robust import LEDGER_SHARE, MOMENTUM, TABLE1, collide, ledger, momenta_changed, on
from small_bodies import grips, head, lattice_body, pair, thermo, write_body

WEAK = TABLE1._replace(xi_s=0.004, gamma=5.0)
JOIN = "join 1.2 plasticity isotropic"


@on(1, 2, 4, 8)
def test_torn_and_pressed_ten_times(bench):
    """Energy imbalance below 1e-3 of the plastic work, while pairs join and end in each cycle; the last peak of the force is above a third of the first.
    Control: the bar is torn each time."""
    body = lattice_body((6, 3, 3))
    write_body(bench.folder / "body.data", body._replace(box=np.array([[-0.06, 0.12]] * 3)))
    text = head(skin=0.003) + pair(WEAK, JOIN) + grips(0.01, 0.05) + "fix free free nve\nfix left left move linear 0 0 0\n"
    text += "variable way equal 0.02*(1-cos(2*PI*step*dt/8e-4))-0.004*sin(2*PI*step*dt/8e-4)\nvariable v equal 0\n"
    text += "variable v equal 0.02*2*PI/8e-4*sin(2*PI*step*dt/8e-4)-0.004*2*PI/8e-4*cos(2*PI*step*dt/8e-4)\n"
    text += "fix right right move variable v_way NULL NULL v_v NULL NULL\nvariable pull equal -fcm(right,x)\n" + ledger(100, more="v_pull f_bonds[5] f_bonds[6]")
    table = bench.run(text + "timestep 4e-7\nrun 20000\n").ok().thermo()
    ended, joined = (np.diff(table[f"f_bonds[{k}]"][::20]) for k in (5, 6))
    share = np.abs(table["f_energy"]).max() / table["f_energy[9]"][-1]
    first, last = table["v_pull"][:20].max(), table["v_pull"][-21:].max()
    assert ended.min() > 5 and joined.min() > 5, "control"
    assert share < LEDGER_SHARE and last > first / 3.0
    bench.show(f"energy imbalance {share:.1e} of the plastic work, {joined.sum():.0f} pairs joined, {ended.sum():.0f} ended, last peak {last / first:.2f} of the first")


@on(1, 2, 4, 8)
def test_head_on_with_join(bench):
    """Two cubes meet at 500 m/s and become one body: momentum conserved to 1e-12, energy imbalance below 1e-3 of the energy of the motion. Control: pairs join."""
    run, mass, energy = collide(bench, WEAK, [0.0395, 0.001, 0.002], 500.0, "nve", "1 0.4 max 5e-7", 40, 2500, JOIN, "f_bonds[6]")
    table = run.thermo()
    change, _, size = momenta_changed(run, mass)
    share = np.abs(table["f_energy"]).max() / energy
    assert table["f_bonds[6]"][-1] > 10, "control"
    assert change / size < MOMENTUM and share < LEDGER_SHARE
    bench.show(f"{table['f_bonds[6]'][-1]:.0f} pairs joined, energy imbalance {share:.1e}, error of the momentum {change / size:.0e}")


def test_nested_seam(bench):
    """A bar cut across holds less than 0.01 of the uncut one as it is pulled, in the mean, as its pairs begin inside the distance of joining. Control: the uncut one yields."""
    body, held = lattice_body((8, 4, 4)), []
    for types in (np.ones(len(body.x), dtype=int), 1 + (body.x[:, 0] > 0.04)):
        write_body(bench.folder / "body.data", body._replace(types=types, box=np.array([[-0.06, 0.14]] * 3)))
        text = head(skin=0.003) + pair(WEAK, "join 1.2 all plasticity isotropic", "fix bonds all evp/bonds within type")
        text += grips(0.01, 0.07) + "velocity all ramp vx -1 1 x 0.01 0.07\nfix free free nve\nfix left left move linear -1 0 0\nfix right right move linear 1 0 0\n"
        text += "variable pull equal -fcm(right,x)\nthermo 20\n" + thermo("v_pull f_bonds[2]") + "timestep 4e-7\nrun 0\nrun 6000\n"
        table = bench.run(text).ok().thermo(1)
        held.append(np.mean(table["v_pull"][len(table["v_pull"]) // 2:]))
    assert held[0] > 1e3, "control"
    assert abs(held[1]) < 0.01 * held[0]
    bench.show(f"{held[1] / held[0]:.1e} of the uncut bar")
