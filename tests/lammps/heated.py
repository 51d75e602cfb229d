# SPDX-License-Identifier: GPL-2.0-only
"""A body in simple shear that heats itself, and what fix evp/heat says of it."""

import json

import numpy as np
import pytest
from lammps_run import REPOSITORY
from small_bodies import head, thermo

JOIN = REPOSITORY / "tests" / "data" / "join"
ROW = json.loads((JOIN / "join_reference.json").read_text(encoding="utf-8"))["row"]
PROPERTIES = "fix properties all property/atom temperature heatflow ghost yes\n"
TREF, TMELT = 293.0, 775.0
SOFTEN = f"soften {TREF} {TMELT} 1"
ACCOUNT = 1e-10  # of the heat: sums of 1000 spheres over some hundred steps
RATE, DT = 200.0, 3e-7  # [1/s], [s]
ENTRIES = "f_heat f_heat[1] f_heat[2] f_heat[3] f_heat[4] f_heat[5] f_heat[6] f_heat[7]"


def sheared(heat=SOFTEN, every=50, newton="on", start=f"read_data {JOIN}/join_start_1000.data", temperature=f"set group all temperature {TREF}", group="all",
            xi_s=ROW["xi_s"], capacity=875.0, conductivity=120.0, gamma=100.0, integrate="nve", more=""):
    """A periodic body in simple shear at 200/s, with bonds that form and volume energy; group: of fix evp/heat."""
    flow = " ".join(f"{p:.9g} {y:.9g}" for p, y in ROW["flow"])
    begins = start.startswith("read_data")
    return head(newton, "p p p", start, skin=4e-4) + f"""comm_modify vel yes
{PROPERTIES}{temperature if begins else ""}
variable solid equal mass(all)/vol
pair_style evp/lj contact join 1.2 plasticity isotropic overlap 0.7
pair_coeff * * 190 8 4 3 8 4 {xi_s:.17g} {gamma} 1.5 density ${{solid}} flow {flow} capacity {capacity} conductivity {conductivity} {heat}
fix bonds all evp/bonds
fix volume all evp/volume 2000
fix energy all evp/energy
group nobody empty
fix heat {group} evp/heat every {every}
fix move all {integrate}
timestep {DT}
compute T all property/atom temperature
compute mean all reduce ave c_T
compute high all reduce max c_T
fix shear all deform 1 xy erate {RATE} remap v flip yes
variable flow atom {RATE}*y
{f"velocity all set v_flow 0 0" if begins else ""}
{more}
""" + thermo(f"c_mean c_high f_energy f_energy[6] f_energy[9] f_energy[11] {ENTRIES}")


LAST = 'print "ended: $(f_heat:%.17g) $(f_heat[1]:%.17g) $(f_heat[4]:%.17g) $(f_heat[5]:%.17g)"\n'  # at the end all that was dissipated is home


def last(run):
    return np.array([float(word) for word in next(line for line in run.stdout.splitlines()[::-1] if line.startswith("ended:")).split()[1:]])


def assert_closes(run):
    imbalance, of_work, waiting, stored = last(run)
    assert abs(imbalance) <= ACCOUNT * of_work and of_work > 100.0
    assert of_work == pytest.approx(waiting + stored, rel=ACCOUNT)


GRANULAR = {  # pair style, row
    "granular": ("granular", "granular hooke 1e6 0 tangential linear_history 3e5 0 0.3 damping velocity"),
    "gran/hooke": ("gran/hooke 1e6 3e5 0 1e4 0.3 1", "gran/hooke"),
    "gran/hooke/history": ("gran/hooke/history 1e6 3e5 0 0 0.3 1", "gran/hooke/history"),
    "gran/hertz/history": ("gran/hertz/history 1e9 3e8 0 0 0.3 1", "gran/hertz/history"),
    "jkr, rolling": ("granular", "granular jkr 1e9 0.3 0.3 10 tangential mindlin_rescale 3e8 0.5 0.3 rolling sds 3e5 10 0.2 twisting marshall damping velocity"),
    "force": ("granular", "granular hertz 1e9 0.3 tangential mindlin/force 3e8 0.5 0.3 rolling sds 3e5 10 0.2 twisting sds 10 1 0.2 damping viscoelastic"),
}


def rubbing(style="granular", speed=2.0, across=0.0, apart=0.004, gap=0.001, spin=0.0, place=0.0, newton="on", dt=1e-6, steps=1000):
    """Two spheres that meet at twice `speed` along x, pass each other at twice `across` and both turn; no normal damping."""
    name, row = GRANULAR[style]
    return f"""units si
atom_style sphere
atom_modify map yes
newton {newton}
boundary p p p
processors * 1 1
comm_modify vel yes
region box block -0.05 0.05 -0.05 0.05 -0.05 0.05
create_box 2 box
create_atoms 1 single 0.0005 0 0
create_atoms 2 single {-0.0095 - gap} {apart} 0
set group all diameter 0.01
set group all density 2700
set group all omega 0 0 {spin}
displace_atoms all move {place} 0 0 units box
neighbor 0.0005 bin
{PROPERTIES}set group all temperature 293
pair_style hybrid evp/lj contact repulsive plasticity isotropic {name}
pair_coeff * * evp/lj 365 8 4 30 8 4 0.002 0 1.5 density 2700 capacity 900
pair_coeff 1 2 {row}
fix bonds all evp/bonds within type
fix heat all evp/heat every 10
group one type 1
group two type 2
velocity one set {-speed} {across} 0
velocity two set {speed} {-across} 0
fix move all {"nve/sphere" if spin else "nve"}
timestep {dt}
compute turning all erotate/sphere
""" + thermo("ke c_turning f_heat[1]") + f"thermo {steps}\nrun {steps}\nrun 0\n"


def lost_and_heat(run):
    """Of rubbing(), over all runs: what the motion has lost, and the heat of work."""
    before, after = ({name: run.thermo(block)[name][row] for name in ("KinEng", "c_turning", "f_heat[1]")} for block, row in ((0, 0), (-1, -1)))
    return before["KinEng"] + before["c_turning"] - after["KinEng"] - after["c_turning"], after["f_heat[1]"]


def two_spheres(newton="on", types=1, right=0.005, temperature=293):
    """Of a radius of 5 mm, the first one 5 mm left of the middle, the second one of the last type; between MPI ranks where there are two."""
    return f"""units si
atom_style sphere
atom_modify map yes
newton {newton}
boundary f f f
processors * 1 1
region box block -0.05 0.05 -0.05 0.05 -0.05 0.05
create_box 2 box
create_atoms 1 single -0.005 0 0
create_atoms {types} single {right:.17g} 0 0
set group all diameter 0.01
set group all density 2700
neighbor 0.0006 bin
{PROPERTIES}set group all temperature {temperature}
"""


def stretched(row, newton="on", more="", speed=2.0, steps=500, dt=1e-6):
    """A bond, between MPI ranks where there are two, that is stretched fast and then stopped."""
    return two_spheres(newton) + f"""pair_style evp/lj contact repulsive plasticity isotropic
pair_coeff * * 80 8 4 3 8 4 {row} density 2700 capacity 900
fix bonds all evp/bonds
fix heat all evp/heat every 10
group moved id 2
fix move all nve/noforce
timestep {dt}
velocity moved set {speed} 0 0
compute pair all pair/local p2 force
compute stretch all reduce max c_pair[1] inputs local
compute pull all reduce sum c_pair[2] inputs local
""" + thermo("c_pull c_stretch f_heat f_heat[1] f_heat[4]") + f"thermo {steps}\nrun {steps}\nvelocity all set 0 0 0\n{more}"


def plate(newton="on", temperature="set group all temperature 300\nset region hot temperature 600", new="new yes", soften="soften 293 900 1", start="", more=""):
    """Two layers of a periodic plate, one half at 300 K and one at 600 K; start: a restart file in place of it."""
    made = """lattice fcc 0.01
region box block 0 6 0 3 -1 4
create_box 1 box
region bar block 0 5.99 0 2.99 0 0.6
create_atoms 1 region bar
set group all diameter 0.00707
set group all density 3650
region hot block 3 6 0 3 0 1.1
"""
    return f"""units si
atom_style sphere
atom_modify map yes
newton {newton}
{"" if start else "boundary p p f"}
{f"read_restart {start}" if start else made}
neighbor 0.0005 bin
fix temperature all property/atom temperature heatflow ghost yes
{"" if start else temperature}
pair_style evp/lj contact join 1.2 plasticity isotropic
pair_coeff * * 365 8 4 30 8 4 0.002 0 1.5 density 2700 conductivity 237 capacity 900 {soften}
fix bonds all evp/bonds {new}
fix heat all evp/heat every 10
compute T all property/atom temperature
timestep 1e-6
""" + more


LAYER = """lattice fcc 0.01
region layer block 0 5.99 0 2.99 0.9 1.6
create_atoms 1 region layer
set group all diameter 0.00707
set group all density 3650
"""


def hot_on_cold(ghost, newton, first="evp/lj", more=""):
    """A plate at 593 K slides on one at 293 K, and heats it by pair granular; first: sub-style of the two."""
    styles = ["evp/lj contact repulsive plasticity isotropic", "granular"]
    return f"""units si
atom_style sphere
atom_modify map yes
newton {newton}
boundary p p f
lattice fcc 0.01
region box block 0 4 0 4 -1 4
create_box 2 box
region lower block 0 3.99 0 3.99 0 0.6
create_atoms 1 region lower
region upper block 0 3.99 0 3.99 1.1 1.8
create_atoms 2 region upper
set group all diameter 0.00707
set group all density 3650
group lower type 1
group upper type 2
displace_atoms upper move 0 0 -0.0035 units box
neighbor 0.0005 bin
comm_modify vel yes
fix temperature all property/atom temperature heatflow {ghost}
set type 1 temperature 293
set type 2 temperature 593
pair_style hybrid {" ".join(styles if first == "evp/lj" else styles[::-1])}
pair_coeff * * evp/lj 365 8 4 30 8 4 0.002 0 1.5 density 2700 conductivity 237 capacity 900
pair_coeff 1 2 granular hertz/material 1e9 0 0.3 tangential linear_nohistory 0 0 damping velocity heat area 2000
fix bonds all evp/bonds within type
fix heat all evp/heat every 50
compute t all property/atom temperature
compute below lower reduce ave c_t
compute above upper reduce ave c_t
velocity upper set 0.03 0.013 0 units box
fix slide upper nve/noforce
timestep 0.002
thermo 120
""" + thermo("c_below c_above f_heat f_heat[2]") + more
