# SPDX-License-Identifier: GPL-2.0-only
"""Robustness of a box that deforms with `fix deform ... remap v`; see robust.py."""

import numpy as np
from evp import law
from small_bodies import dump, head, lattice_body, mass_of, pair, thermo, write_body

RATE, EDGE = 500.0, 0.04


def test_sheared_box_with_implicit_damping(bench):
    """Energy imbalance below 1e-4 of the dissipated energy; momentum of the unwrapped body conserved to 1e-11; velocities within 2 % of those of
    explicit damping. Control: atoms are wrapped, and the box does work."""
    body = lattice_body((5, 4, 4), periodic="xyz", tilt=(1e-3, 0.0, 0.0))
    write_body(bench.folder / "body.data", body, (1e-3, 0.0, 0.0))
    text = head(boundary="p p p") + pair(law.TABLE1._replace(gamma=50.0), "none", "fix bonds all evp/bonds zone 1.4")
    text += f"variable vx atom {RATE}*y+200+5*sin(1.1*id)\nvariable vy atom 300+5*cos(2.3*id)\nvelocity all set v_vx v_vy 0\n"
    text += f"fix energy all evp/energy\nfix box all deform 1 xy erate {RATE} remap v\nfix move all {{}}\ntimestep 2e-7\nthermo 200\n"
    text += thermo("f_energy f_energy[*]") + dump(every=200).replace("fx fy fz", "iy").replace("pbc yes", "pbc no") + "run 200\n"
    found = {}
    for style in ("nve", "nve/evp tol 1e-10"):
        run = bench.run(text.format(style)).ok()
        found[style], table = run.dump("all.dump"), run.thermo()
    share = abs(table["f_energy"][-1]) / table["f_energy[6]"][-1]
    assert share < 1e-4
    assert abs(table["f_energy[13]"][-1]) > table["f_energy[6]"][-1] > 0.5
    unwrapped = []
    for snapshot in [*found["nve/evp tol 1e-10"], found["nve"][-1]]:
        v = snapshot.vectors("vx", "vy", "vz")
        v[:, 0] += RATE * EDGE * snapshot["iy"]
        unwrapped.append(v)
    wrapped = np.count_nonzero(found["nve"][-1]["iy"] - found["nve"][0]["iy"])
    assert wrapped > 10
    mass = mass_of(body.radius)
    off = np.abs(mass @ (unwrapped[1] - unwrapped[0])).max() / (mass.sum() * 400.0)
    assert off < 1e-11
    apart = np.abs(unwrapped[1] - unwrapped[2]).max() / (RATE * EDGE)
    assert apart < 0.02
    bench.show(f"energy imbalance {share:.1e}, error of the momentum {off:.0e}, {wrapped} atoms wrapped, velocities {apart:.1e} from explicit ones")
