# SPDX-License-Identifier: GPL-2.0-only
"""The scenes of doc/studies/bench.py: pair style evp/lj and its peers on the same lattice, and on the same random specimen.

Reduced units: the spheres of the lattice have diameter 1 and touch. Each has 9 half pairs within 1.5 diameters, 6 of them
in contact. Positions are stirred a little, so that no pair is at a special place.
"""

from typing import NamedTuple

HALF_PAIRS = 9  # of a sphere of the lattice, within 1.5 diameters
CONTACTS = 6  # of these, of touching spheres
ROW = "80 8 4 3 8 4 0.005"  # e1 m1 n1 e2 m2 n2 xi_s
REACH, SKIN = 1.5, 0.06  # diameters: of pairs, and beyond it of the neighbor lists
NEVER = "neigh_modify every 1000000 delay 1000000 check no"
ALWAYS = "neigh_modify every 1 delay 0 check no"
WATCHED = "neigh_modify every 1 delay 0 check yes"


class Scene(NamedTuple):
    """A deck, whose last run is timed.

    counted: the line of LAMMPS' breakdown that holds the time of the interactions, Pair or Bond."""

    name: str
    needs: str  # style that the LAMMPS build must hold
    deck: str
    steps: int
    atoms: int
    interactions: float  # per atom
    counted: str = "Pair"
    ranks: int = 1


def lattice(cells, atom_style="sphere", density="1.4142135623730951", box="", head="", long=None, types=1, velocities=True):
    """FCC, 4 cells^2 long spheres (long: cells by default), periodic. velocities: of ghosts too."""
    return f"""
units lj
{head}
atom_style {atom_style}
atom_modify map array
{"comm_modify vel yes" if velocities else ""}
lattice fcc {density}
region box block 0 {long or cells} 0 {cells} 0 {cells}
create_box {types} box {box}
create_atoms 1 box
set group all diameter 1 density 1
neighbor {SKIN} bin
{NEVER}
"""


def stirred(move, steps, speed=0.02, output="step", every=1000000):
    """Velocities by ID, so that every number of ranks and every style has the same; a first run warms up."""
    return f"""
variable vx atom {speed}*sin(1.1*id)
variable vy atom {speed}*cos(2.3*id)
variable vz atom {speed}*sin(3.7*id+1)
velocity all set v_vx v_vy v_vz
fix move all {move}
timestep 1e-3
thermo_style custom {output}
thermo {every}
run 5
run {steps}
"""


def ours(name, cells, steps, gamma=0.0, contact="literal", row=ROW, ranks=1, neigh="", move="nve", long=None, types=1, rules="", more="", velocities=False, **stir):
    """Pair style evp/lj on the lattice, all pairs within 1.5 diameters recorded. types: 2 have laws of their own; rules: more words
    of the pair style; more: commands."""
    deck = lattice(cells, long=long, types=types, velocities=velocities) + f"""
pair_style evp/lj contact {contact} {rules}
pair_coeff * * {row} {gamma} {REACH}
{"set group all type/fraction 2 0.5 1234" if types == 2 else ""}
{f"pair_coeff 2 2 {row.replace('80', '90', 1)} {gamma} {REACH}" if types == 2 else ""}
fix bonds all evp/bonds
{neigh}
{more}
""" + stirred(move, steps, **stir)
    return Scene(name, "", deck, steps, 4 * cells**2 * (long or cells), HALF_PAIRS, "Pair", ranks)


def pair_peer(style, cells, steps, coefficients, name=None, head=""):
    """Another pair style of the same reach on the same lattice."""
    deck = lattice(cells, head=head, velocities=False) + f"""
pair_style {style} {REACH}
pair_coeff * * {coefficients}
""" + stirred("nve", steps)
    return Scene(name or style, style, deck, steps, 4 * cells**3, HALF_PAIRS)


def contact_peer(style, cells, steps):
    """Hertzian contacts: only touching spheres interact, so the lattice is pressed together by 1 %."""
    deck = lattice(cells, density="1.45") + f"""
pair_style {style} 1000 NULL 0 NULL 0 0
pair_coeff * *
""" + stirred("nve/sphere", steps)
    return Scene(style, style, deck, steps, 4 * cells**3, CONTACTS)


def bond_peer(style, cells, steps, coefficients):
    """Bonds between the same pairs of the lattice; the pair style beside them does nothing."""
    deck = lattice(cells, "bpm/sphere", box="bond/types 1 extra/bond/per/atom 18 extra/special/per/atom 80",
                   head="newton on off\nspecial_bonds lj 0 1 1 coul 0 1 1")
    deck += f"""
comm_modify cutoff 2.0
pair_style zero {REACH}
pair_coeff * *
bond_style zero
bond_coeff *
create_bonds many all all 1 0.9 1.45
special_bonds lj 0 1 1 coul 1 1 1
bond_style {style} smooth no
bond_coeff 1 {coefficients}
""" + stirred("nve/bpm/sphere", steps)
    return Scene("bond " + style, style, deck, steps, 4 * cells**3, HALF_PAIRS, "Bond")


CROSSING = "80 8 4 3 8 4 0.0005"  # the stirring stretches pairs by more
PLASTIC = "plasticity isotropic"
VOLUME = "fix volume all evp/volume 1000"  # [energy] 12 times e1, as 1000 J are with Table 1
HEAT = f"""fix properties all property/atom temperature heatflow ghost yes
set group all temperature 300
pair_coeff * * {CROSSING} 0 {REACH} density 1 conductivity 1e-4 capacity 1 soften 300 1e6 1
fix heat all evp/heat every 100"""
PUSH = "fix push all addforce 1e-6 0 0"
LENNARD_JONES = "1 0.8908987181403393"  # minimum at one diameter


def peers(cells, steps):
    """All that a LAMMPS build may hold of what users might take instead."""
    return [
        pair_peer("lj/cut", cells, steps, LENNARD_JONES),
        pair_peer("lj/cut/opt", cells, steps, LENNARD_JONES),
        pair_peer("lj/cut/intel", cells, steps, LENNARD_JONES, head="package intel 0 mode double"),
        pair_peer("morse", cells, steps, "80 3 1"),
        pair_peer("nm/cut", cells, steps, "80 1 8 4"),
        contact_peer("gran/hertz/history", cells, steps),
        *bonded(cells, steps)[2:],
    ]


def bonded(cells, steps):
    """Pair style evp/lj, and LAMMPS' bonds between the same pairs."""
    plain, _, isotropic, *_ = variants(cells, steps)
    return [plain, isotropic, bond_peer("bpm/spring", cells, steps, "2560 1e9 0"),
            bond_peer("bpm/spring/plastic", cells, steps, "2560 1e9 0 0.005")]


def variants(cells, steps):
    """Pair style evp/lj, and what changes its loop."""
    return [
        ours("evp/lj", cells, steps),
        ours("evp/lj, gamma > 0", cells, steps, gamma=0.1),
        ours("evp/lj, plasticity isotropic", cells, steps, contact="repulsive", rules=PLASTIC),
        ours("evp/lj, pairs crossing xi_s", cells, steps, row=CROSSING, speed=0.1, output="step f_bonds[2]"),
        ours("evp/lj, exponents 8.5 4.5", cells, steps, row="80 8.5 4.5 3 8.5 4.5 0.005"),
    ]


def effects(cells, steps, data):
    """[(effect, scene with it, scene without it)]."""
    plain = ours("plain", cells, steps)
    damped, solved = ours("damped", cells, steps, gamma=0.1), ours("implicit", cells, steps, gamma=0.1, move="nve/evp")
    return [
        ("explicit damping (gamma > 0, fix nve)", damped, plain),
        ("comm_modify vel yes, with explicit damping", ours("all velocities", cells, steps, gamma=0.1, velocities=True), damped),
        ("implicit damping (gamma > 0, fix nve/evp)", solved, ours("nve/evp, gamma = 0", cells, steps, move="nve/evp")),
        ("energy and virial at each step", ours("energy", cells, steps, output="step pe press", every=1), plain),
        ("pairs that cross xi_s", ours("crossing", cells, steps, row=CROSSING, speed=0.1), ours("not crossing", cells, steps, speed=0.1)),
        ("different coefficients for two types", ours("two types", cells, steps, types=2), plain),
        ("check of the neighbor list at each step", ours("watched", cells, steps, neigh=WATCHED), plain),
        ("fix evp/energy at each step", ours("ledger", cells, steps, more="fix ledger all evp/energy"), plain),
        ("fix evp/energy at each step, with explicit damping and fix addforce", ours("damped, pushed, ledger", cells, steps, gamma=0.1, more=f"{PUSH}\nfix ledger all evp/energy"),
         ours("damped, pushed", cells, steps, gamma=0.1, more=PUSH)),
        ("fix dt/evp, every 100 steps", ours("dt/evp", cells, steps, more="fix step all dt/evp 100 0.4 max 1e-3"), plain),
        ("plasticity isotropic, no pair flows", ours("isotropic", cells, steps, contact="repulsive", rules=PLASTIC), ours("repulsive", cells, steps, contact="repulsive")),
        ("plasticity isotropic, pairs flow at each step", ours("flowing", cells, steps, row=CROSSING, speed=0.1, contact="repulsive", rules=PLASTIC),
         ours("crossing", cells, steps, row=CROSSING, speed=0.1, contact="repulsive")),
        ("fix evp/heat, every 100 steps, with plasticity isotropic, pairs flow at each step",
         ours("heat", cells, steps, row=CROSSING, speed=0.1, contact="repulsive", rules=PLASTIC, more=HEAT),
         ours("flowing", cells, steps, row=CROSSING, speed=0.1, contact="repulsive", rules=PLASTIC)),
        ("break 0.4", ours("breaking", cells, steps, rules="break 0.4"), plain),
        ("fix evp/volume", ours("volume", cells, steps, more=VOLUME), plain),
        ("fix evp/energy at each step, with plasticity isotropic and fix evp/volume",
         ours("all with ledger", cells, steps, contact="repulsive", rules=PLASTIC, more=VOLUME + "\nfix ledger all evp/energy"),
         ours("all", cells, steps, contact="repulsive", rules=PLASTIC, more=VOLUME)),
        ("all of a forming scene: plasticity isotropic, fix evp/volume, fix evp/energy at each step, fix dt/evp every 100 steps",
         ours("forming", cells, steps, contact="repulsive", rules=PLASTIC, more=VOLUME + "\nfix ledger all evp/energy\nfix step all dt/evp 100 0.4 max 1e-3"), plain),
        ("implicit damping of Table 2 at a timestep of 1e-5 s (random specimen; scaled from 500 spheres)",
         random_body("Table 2", "evp/lj", data, steps // 4, neigh=NEVER, gamma=1000, move="nve/evp", timestep="1e-5"), random_body("Table 1", "evp/lj", data, steps // 4, neigh=NEVER)),
        ("new contacts: contact literal over none (random specimen)",
         random_body("literal", "evp/lj", data, steps, neigh=NEVER), random_body("none", "evp/lj", data, steps, neigh=NEVER, contact="none")),
    ]


def random_body(name, style, data, steps, ranks=1, neigh=WATCHED, contact="literal", gamma=0, move="nve", timestep="1e-7"):
    """A specimen of in.specimen, pulled slowly, evp/lj or lj/cut with the same reach in the mean. gamma, timestep: those of 500 spheres."""
    deck = f"""
units si
atom_style sphere
atom_modify map array
boundary s s s
read_data {data}
variable n equal count(all)
variable d equal 2*(0.6*PI*0.02^2*0.05/(v_n*4/3*PI))^(1/3)
neighbor $(0.066*v_d) bin
{neigh}
"""
    if style == "evp/lj":
        deck += f"pair_style evp/lj contact {contact}\n" + f"pair_coeff * * $(80*500/v_n) 8 4 $(3*500/v_n) 8 4 0.005 $({gamma}*(500/v_n)^(2/3)) 1.5\nfix bonds all evp/bonds\n"
    else:
        # too weak to move anything: spheres of unequal size would fly apart, and their lists be built anew
        deck += f"pair_style {style} $(1.5*v_d)\npair_coeff * * 1e-12 $(v_d/2^(1/6))\n"
    deck += f"""
velocity all ramp vx -0.2 0.2 x 0 0.05
fix move all {move}
timestep $({timestep}*(500/v_n)^(1/3))
thermo_style custom step
thermo 1000000
run 5
run {steps}
"""
    return Scene(name, "" if style == "evp/lj" else style, deck, steps, 0, 0.0, "whole step", ranks)
