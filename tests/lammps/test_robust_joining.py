# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: two bodies that join by a criterion of exposure and pressure."""

import numpy as np
from robust import on
from small_bodies import head, write_body
from test_joining import MOVE, PUSH, joining_blocks, two_blocks


@on(1, 2)
def test_blocks_that_hit_each_other(bench):
    """At 60 m/s they flow, and join where they do: the energies close to 1.5e-3 of the plastic work. At 2 m/s they touch, and no pair joins. Control: more than 10
    pairs join, and the contact has pushed both blocks."""
    body = two_blocks()
    write_body(bench.folder / "body.data", body)
    fast = bench.run(head("off") + joining_blocks(body) + PUSH + MOVE + "run 300\n").ok().thermo()
    slow = bench.run(head("off") + joining_blocks(body) + PUSH.replace("-1500", "-50").replace("400", "0") + MOVE + "run 3000\n").ok().thermo()
    imbalance = np.abs(fast["f_energy"]).max() / fast["f_energy[9]"][-1]
    assert slow["f_bonds[6]"].max() == 0 and imbalance < 1.5e-3
    assert fast["f_bonds[6]"][-1] > 10 and np.ptp(slow["KinEng"]) > 0.2 * slow["KinEng"][0], "control"
    bench.show(f"imbalance {imbalance:.1e}, {fast['f_bonds[6]'][-1]:.0f} joints")
