#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Thermal expansion beside closed forms: a free cylinder, a bar between ends that keep their distance, and strips of two layers that bend.

in.specimen packs the bodies. They are heated at once, and come to rest by minimization.
"""

import zlib

from study import Study, deck_command
import numpy as np

TREF, ALPHA, KELVIN = 293.0, 2.0e-5, 20.0  # [K], [1/K], [K]
UNLIKE = 1.0e-5, 3.0e-5  # [1/K] of the layers
LENGTH, WIDTH, HEIGHT = 0.04, 0.006, 0.01  # [m] of the strips
ROW = "190 8 4 30 8 4 0.005 0 1.5 density 2700 capacity 875"
DECK = """
units           si
atom_style      sphere
atom_modify     map yes
boundary        f f f
read_data       {data} extra/atom/types 1
include         {data}.body
neighbor        {skin} bin
region          upper block INF INF INF INF 0 INF
set             region upper type 2
fix             temperature all property/atom temperature heatflow ghost yes
set             group all temperature {tref}
pair_style      evp/lj contact repulsive
pair_coeff      1 1 {row} expansion {lower} {tref}
pair_coeff      2 2 {row} expansion {upper} {tref}
pair_coeff      1 2 {row} expansion {lower} {tref}
fix             bonds all evp/bonds
{volume}
fix             heat all evp/heat
compute         u all displace/atom
region          left block INF $(0.1*v_length) INF INF INF INF
region          right block $(0.9*v_length) INF INF INF INF INF
group           left region left
group           right region right
thermo_style    custom step pe fnorm
min_modify      dmax 1e-6
run             0
{held}
set             group all temperature {hot}
minimize        0 {tolerance} 200000 1000000
write_dump      all custom {name}.dump x z c_u[1] radius modify format float %.17g
{pulled}
"""
HELD = "fix left left setforce 0 NULL NULL\nfix right right setforce 0 NULL NULL\nthermo_style custom step f_left[1] f_right[1]"
PULLED = """print           "force hot: $(0.5*(f_left[1]-f_right[1]):%.17g)"
set             group all temperature {tref}
displace_atoms  all ramp x 0 $(-{strain}*v_length) x 0 ${{length}} units box
minimize        0 {tolerance} 200000 1000000
print           "force pressed: $(0.5*(f_left[1]-f_right[1]):%.17g)"
"""


def heated(study, name, data, lower=ALPHA, upper=ALPHA, held=False, volume=False):
    """Positions before, displacements along x, mean diameter; and what the run printed."""
    skin, tolerance = (4e-4, 1e-6) if data.startswith("cylinder") else (1e-4, 1e-2)
    pulled = PULLED.format(tref=TREF, strain=ALPHA * KELVIN, tolerance=tolerance) if held else ""
    text = DECK.format(data=data, skin=skin, tref=TREF, hot=TREF + KELVIN, row=ROW, lower=lower, upper=upper, name=name, tolerance=tolerance,
                       held=HELD if held else "", pulled=pulled, volume="fix volume all evp/volume 1000" if volume else "")
    deck = study.runs.folder / f"in.{name}"
    deck.write_text(text, encoding="utf-8")
    printed = study.runs.keep(name, deck_command(deck, {"deck": zlib.crc32(text.encode())}))  # a run of another deck is not kept
    x, z, u, radius = np.loadtxt(study.runs.folder / f"{name}.dump", skiprows=9).T
    return x - u, z, u, 2.0 * radius.mean(), printed


def curvature(x, z, u):
    """Of the middle of a strip [1/m]."""
    x = x - 0.5 * LENGTH
    middle = np.abs(x) < 0.3 * LENGTH
    shape = np.stack([np.ones_like(x), x, z, x * z], axis=1)[middle]
    return np.linalg.lstsq(shape, u[middle], rcond=None)[0][3]


def forces(printed):
    """Hot, and pressed by as much [N]."""
    return [float(line.split(":")[1]) for line in printed.splitlines() if line.startswith("force ")]


def main(words=None):
    with Study(__doc__, "expansion", "validation", spheres=[1000, 4000, 16000]).started(words) as study:
        cylinder = study.runs.body("cylinder", n=500)
        x, _, u, _, _ = heated(study, "free", cylinder, volume=True)
        free = np.polyfit(x, u, 1)[0] / (ALPHA * KELVIN) - 1.0
        hot, pressed = forces(heated(study, "held", cylinder, held=True, volume=True)[-1])
        rows = []
        for n in study.each(sorted(study.spheres), lambda n: f"strip of {n} spheres", lambda n: n ** (4.0 / 3.0)):
            strip = study.runs.body(f"strip_{n}", shape="block", length=LENGTH, width=WIDTH, height=HEIGHT, n=n)
            x, z, u, diameter, _ = heated(study, f"bent_{n}", strip, *UNLIKE)
            closed = 1.5 * (UNLIKE[1] - UNLIKE[0]) * KELVIN / HEIGHT
            ratio = curvature(x, z, u) / closed
            rows.append((n, f"{HEIGHT / diameter:.1f}", f"{ratio:.3f}", f"{0.5 * (1.0 - 1.0 / ratio) * HEIGHT / diameter:.2f}"))
        study.write(kelvin=f"{KELVIN:g}", free=f"{abs(free):.0e}", held=f"{hot / pressed:.3f}", least=rows[0][2], most=rows[-1][2], fewest=rows[0][0], last=rows[-1][0],
                    layer=f"{np.mean([float(row[3]) for row in rows]):.2f}",
                    table=(("N", "diameters across", "curvature over the closed form", "layer that does not bear [diameters]"), rows))


if __name__ == "__main__":
    main()
