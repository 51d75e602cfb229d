# SPDX-License-Identifier: GPL-2.0-only
"""Flow and breaking where the packed list does not see all: bonds that leave it, atoms that change first, words that change."""

import itertools

import numpy as np
import pytest
from evp import law
from flowing import failing_at, read_pairs
from hostile import refused
from small_bodies import head, lattice_body, pair, thermo, velocities, write_body

ways = pytest.mark.parametrize("newton, ranks", [("on", 1), ("off", 2)])


def spheres(newton, skin, rules, places=("0 0 0", "0.01 0 0"), box="-0.1 0.1 -0.1 0.1 -0.1 0.1", size=0.01, ghosts=0.1, coeff="3 8 4 0.005 0 1.5",
            create="create_box 2 box", style="sphere", sub="", fixes="fix bonds all evp/bonds\n"):
    """Up to the bonds of spheres 1, 2, ... in a box."""
    start = f"region box block {box}\n{create}\n" + "".join(f"create_atoms 1 single {at}\n" for at in places)
    return (head(newton, start=f"{start}set group all diameter {size} density 2700", skin=skin, style=style)
            + f"comm_modify cutoff {ghosts}\npair_style {'hybrid ' * bool(sub)}evp/lj {rules}\npair_coeff * * {sub} 80 8 4 {coeff}\n{fixes}")


# in one step, and in a minimization that rebuilds the lists on the way: the neighbor list is 0.0031 wide
WAYS = {
    "moved": "fix n all nve\nrun 1\ndisplace_atoms two move 0.006 0 0\nrun 2\n",
    "moved where there are no ghosts": "fix n all nve\nrun 1\ndisplace_atoms two move 0.02 0 0\nrun 2\n",
    "fast": "fix n all nve\nrun 1\nvelocity two set 6e5 0 0\nneigh_modify check no\nrun 3\nvelocity two set 0 0 0\n",
    "minimized": """fix hold one setforce 0 0 0
fix pull two spring tether 3e9 0.008 0 0 0
fix_modify pull energy yes
min_style cg
min_modify dmax 0.0002
minimize 0 1e-3 1000 10000
unfix pull
unfix hold
fix n all nve
""",
}


def two(newton, rules="contact repulsive break 0.02", ghosts=0.03, skin=0.0001, **more):
    text = spheres(newton, skin, rules, ("0 0 0", "0.002 0 0"), "-0.01 0.03 -0.01 0.01 -0.01 0.01", 0.002, ghosts, **more) + "timestep 1e-8\ngroup one id 1\ngroup two id 2\n"
    return text + "thermo_style custom step pe f_bonds[1] f_bonds[5]\nthermo_modify norm no\n"


@ways
@pytest.mark.parametrize("rules", ["none plasticity isotropic", "repulsive plasticity isotropic", "repulsive break 0.02"])
def test_a_bond_that_leaves_the_list_ends_at_its_cutoff(lmp_decks, newton, ranks, rules):
    """It has flowed up to there, and has ended for good: back at R_i + R_j nothing acts, and its work stays."""
    cut = 0.003 if "plasticity" in rules else 0.0
    runs = lmp_decks({name: two(newton, f"contact {rules}", 0.004 if "ghosts" in name else 0.03) + way + f"""
compute each all evp/state/atom {'plastic_work' if cut else ''}
compute kept all reduce sum c_each[{5 if cut else 1}]
variable work equal c_kept*{int(cut > 0.0)}
thermo_style custom step pe f_bonds[1] f_bonds[5] c_kept
run 0
print "away $(f_bonds[5]) $(f_bonds[1]) $(v_work:%.17g)"
variable back atom 0.002*(id==2)
set group all x v_back vx 0 vy 0 vz 0
timestep 1e-12
run 1
print "back $(f_bonds[5]) $(f_bonds[1]) $(v_work:%.17g) $(fx[2]:%.17g)"
""" for name, way in WAYS.items()}, ranks)
    torn = law.flow_bond(cut or 0.002, 0.002, law.TABLE1, law.TABLE1.xi_s)
    work = float(torn.dissipated)
    expected = [1, 0, work, 1, 0, work, 0.0]
    for name, run in runs.items():
        found = [float(word) for line in run.stdout.splitlines() if line.startswith(("away ", "back ")) for word in line.split()[1:]]
        assert found == pytest.approx(expected, rel=2e-7), (name, "the margin of a cutoff, up to which a bond flows")


LEFT_OUT = {
    "groups": "neigh_modify exclude group two one\n",
    "types": "neigh_modify exclude type 1 1\n",
    "molecules": "neigh_modify exclude molecule/intra all\n",
    "no group": "atom_modify first one\nneigh_modify include one\n",
    "special bonds": "create_bonds single/bond 1 1 2 special yes\nspecial_bonds lj 0 1 1\n",
}
MOLECULAR = "create_box 1 box bond/types 1 extra/bond/per/atom 2 extra/special/per/atom 4\nspecial_bonds lj 1 1 1\nbond_style zero nocoeff\nbond_coeff *"


@pytest.mark.parametrize("newton, ranks, rules", [("on", 1, "break 0.02"), ("off", 2, "plasticity none")])
def test_a_bond_that_is_left_out_is_an_error(lmp, newton, ranks, rules):
    """Before the first step of the next run; undone, the bond is what it was. A bond that is far away is not taken for one."""
    def start():
        text = two(newton, f"contact repulsive {rules}", 0.03, create=MOLECULAR, style="hybrid sphere molecular")
        return text.replace("set group all", "set group all mol 1\nset group all") + "fix n all nve/noforce\nfix e all evp/energy\nrun 0\n"
    away = "displace_atoms two move 0.02 0 0\nrun 0\ndisplace_atoms two move -0.02 0 0\nrun 0\n"
    lmp(start() + away, ranks).ok()
    for off in LEFT_OUT.values():
        refused(lmp(start() + off + "run 1\n", ranks), "Pair evp/lj: 1 bonds are kept out of the neighbor list", "neigh_modify exclude or include", "special_bonds weight of 0", "undo it")


@ways
def test_a_minimization_does_not_see_the_end_of_the_list(lmp_decks, newton, ranks):
    """A spring pulls the far particle back into its bond: the potential energy has no step where the bond comes into the list."""
    decks = {skin: two(newton, "contact none plasticity isotropic", skin=skin) + """
fix hold one setforce 0 0 0
fix n all nve
run 0
unfix n
variable far atom 0.02*(id==2)
set group all x v_far
fix pull two spring tether 1e6 0.0021 0 0 0
fix_modify pull energy yes
min_style cg
min_modify dmax 0.0003
minimize 0 0.2 1000 10000
print "end $(pe:%.17g) $(x[2]:%.17g)"
""" for skin in ("1e-5", "1e-3", "0.02")}
    runs = list(lmp_decks(decks, ranks).values())
    assert all("Stopping criterion = force tolerance" in run.ok().stdout for run in runs)
    ends = [[float(word) for word in next(line for line in run.stdout.splitlines() if line.startswith("end ")).split()[1:]] for run in runs]
    assert ends[0][1] < 0.0025 and ends[1] == pytest.approx(ends[0], rel=1e-9) and ends[2] == pytest.approx(ends[0], rel=1e-9)


FIXES = ("fix bonds all evp/bonds\n", "fix e all evp/energy\n")
ADAPT = "variable none equal 0\nfix again all adapt 7 pair evp/lj gamma * * v_none"  # changes nothing, but packs the list anew


@ways
@pytest.mark.parametrize("rules", ["none", "none plasticity isotropic", "none break 0.05"])
def test_the_energy_of_a_lost_bond_in_every_step(lmp_decks, newton, ranks, rules):
    """In the step in which it breaks, in either order of the fixes; past the end of the list, wherever that is, and packed anew."""
    decks = {}
    for skin, adapt, order in itertools.product((0.0002, 0.003), ("", ADAPT), (1, -1)):
        text = spheres(newton, skin, f"contact {rules}", ("-0.005 0 0", "0.005 0 0"), "-0.1 0.1 -0.05 0.05 -0.05 0.05", ghosts=0.05, coeff="8 8 4 0.005 0 1.5",
                       fixes="".join(FIXES[::order]))
        decks[skin, adapt, order] = text + f"""
fix move all nve/noforce
group left id 1
velocity left set -10 0 0
timestep 1e-6
{adapt}
thermo {1 if "break" in rules else 5}
{thermo("f_e f_e[4] f_e[9] f_e[11]")}run 800
"""
    found = {key: run.thermo() for key, run in lmp_decks(decks, ranks).items()}
    whole = found[0.003, "", -1]
    assert max(abs(whole["f_e[4]"]) + abs(whole["f_e[11]"])) > 0.05, "control: the bond holds something where it ends"
    for key, own in found.items():
        for name, values in own.items():
            assert values == pytest.approx(whole[name], abs=1e-9), (key, name)


LED = "fix e all evp/energy\nfix move all nve/noforce\ntimestep 1e-6\nthermo 1\n" + thermo("f_e f_e[4] f_e[9] f_e[11] f_bonds[1] f_bonds[5]")
TWO_PAIRS, SHORT = ("0 0 0", "0.01 0 0", "0 0.05 0", "0.01 0.05 0"), "3 8 4 0.005 0 1.2"


@ways
@pytest.mark.parametrize("rules", ["plasticity none", "plasticity isotropic", "break 0.1"])
def test_bonds_past_the_list_of_a_set_up(lmp_decks, newton, ranks, rules):
    """In the first step after it, whose positions are newer than the list: a bond at the list's end that moves out, in, or not."""
    def deck(apart, speed):
        return spheres(newton, 0.001, f"contact none {rules}", TWO_PAIRS, coeff=SHORT) + LED + f"""run 0
displace_atoms all move 0.02 0 0 units box
group second id 2
group fourth id 4
displace_atoms second move 0.02 0 0 units box
displace_atoms fourth move {apart} 0 0 units box
set atom 4 vx {speed}
run 3
"""
    runs = {name: run.thermo(1) for name, run in lmp_decks({"far": deck(0.01, 0.0), "out": deck(0.0029999, 0.2), "in": deck(0.0030001, -0.2)}, ranks).items()}
    for name in ("out", "in"):
        for column, values in runs["far"].items():
            assert runs[name][column] == pytest.approx(values, abs=1e-9), (name, column)
    assert max(abs(runs["far"][column][-1]) for column in ("f_e[4]", "f_e[11]")) > 0.05, "control"


@ways
def test_bonds_that_break_one_after_the_other(lmp, newton, ranks):
    """In successive steps, with a volume energy: the balance closes in each of them, but for the work in the half step in which the force ends,
    of a volume energy in proportion to kv and to the timestep."""
    text = spheres(newton, 0.006, "contact none break 0.02", ("0 0 0", "0.01 0 0", "0 0.01 0", "0 0 0.01"), coeff=SHORT, fixes=FIXES[0] + "fix v all evp/volume 50\n")
    run = lmp(text + LED + "set atom 2 vx 1.0\nset atom 3 vy 0.9935\nset atom 4 vz 0.989\nrun 208\n", ranks).ok().thermo()
    assert list(run["f_bonds[5]"][200:204]) == [0, 1, 2, 3], "control: one in each step"
    assert np.abs(run["f_e"]).max() < 3e-3 * run["f_e[11]"][-1]


@pytest.mark.parametrize("ranks", [1, 2])
def test_bonds_of_types_of_another_style_stay(lmp, ranks):
    """pair_style hybrid gives their types to another sub-style: they neither break nor hold energy, wherever their atoms go."""
    text = spheres("on", 0.001, "contact none break 0.1 zero 0.012", TWO_PAIRS, coeff=SHORT, sub="evp/lj", fixes="pair_coeff 1 2 zero\npair_coeff 2 2 zero\n" + FIXES[0])
    run = lmp(text + LED + "run 1\nset atom 4 type 2\ngroup fourth id 4\ndisplace_atoms fourth move 0.02 0 0 units box\nrun 2\n", ranks).ok().thermo()
    assert run["f_bonds[5]"][-1] == 0.0 and run["f_e[11]"][-1] == 0.0


def test_a_deleted_partner_breaks_no_bond(lmp):
    run = lmp(two("on") + "fix n all nve\nrun 1\ndelete_atoms group two compress no\nrun 2\nprint \"broken $(f_bonds[5])\"\n").ok()
    assert "broken 0\n" in run.stdout


@pytest.mark.parametrize("newton", ["on", "off"])
def test_a_packing_of_the_same_list_keeps_what_is_left_of_a_broken_bond(lmp_decks, newton):
    """fix adapt packs the pairs anew at each step, here with the coefficient that they have: the bond breaks, what is left of it flows."""
    deck = two(newton, "contact repulsive plasticity isotropic", 0.01, 0.003, coeff=f"3 8 4 0.005 0 1.5{failing_at(0.02)}") + """
fix hold one nve/noforce
fix swing two move wiggle 0.00024 0 0 2e-6
fix e all evp/energy
variable e1 equal 80+0*step
{}
thermo_style custom step f_e f_e[9] f_e[11]
thermo_modify format float %.17g
thermo 50
run 200
"""
    runs = lmp_decks({name: deck.format(line) for name, line in {"once": "", "anew": "fix again all adapt 1 pair evp/lj e1 * * v_e1"}.items()})
    once, anew = (runs[name].thermo() for name in ("once", "anew"))
    assert once["f_e[11]"][-1] > 0.0 and once["f_e[9]"][-1] > once["f_e[9]"][1], "control: it breaks, and flows afterwards"
    for name, values in once.items():
        assert anew[name] == pytest.approx(values, rel=1e-12, abs=1e-15), name


@pytest.mark.parametrize("rules", ["plasticity isotropic", "break 0.3"])
def test_set_up_with_an_energy_balance_moves_no_bond(lmp_decks, rules):
    """Atoms are displaced past the end of the list and back, with 'run 0' between: no state of the body, whether or not fix evp/energy is there."""
    runs = lmp_decks({line: two("on", f"contact repulsive {rules}", 0.01) + f"""
fix n all nve/noforce
{line}
compute pair all pair/local p2
compute strain all reduce sum c_pair inputs local
compute each all evp/state/atom plastic_work
compute work all reduce sum c_each[5]
thermo_style custom step pe f_bonds[5] c_strain c_work
run 0
displace_atoms two move 0.008 0 0
run 0
displace_atoms two move -0.008 0 0
run 1
""" for line in ("", "fix e all evp/energy")})
    for run in runs.values():
        assert run.thermo()["f_bonds[5]"][-1] == run.thermo()["c_work"][-1] == 0.0 and abs(run.thermo()["c_strain"][-1]) < 1e-12


@ways
def test_a_partner_in_two_images_flows_once(lmp_decks, newton, ranks):
    """A box three spheres wide, whose neighbor lists hold two images of a bonded partner where the skin is large: those past dlim are not the bond."""
    boxes, skins = ("block 0 0.03 0 0.03 0 0.03", "prism 0 0.03 0 0.03 0 0.03 0.006 0 0"), (0.0005, 0.009)
    decks = {}
    for box, skin in itertools.product(boxes, skins):
        atoms = f"region box {box}\ncreate_box 1 box\nlattice sc 0.01\ncreate_atoms 1 box\nset group all diameter 0.01 density 2700"
        decks[box, skin] = head(newton, "p p p", atoms, skin=skin) + """pair_style evp/lj contact none plasticity isotropic
pair_coeff * * 80 8 4 20 8 4 0.005 50 1.3
fix bonds all evp/bonds
velocity all create 1e24 7 loop geom mom yes
fix n all nve
fix e all evp/energy
timestep 1e-7
thermo 50
""" + thermo("f_e[2] f_e[9] f_bonds[2]") + "run 50\n"
    runs = lmp_decks(decks, ranks)
    for box in boxes:
        near, far_off = (runs[box, skin].thermo() for skin in skins)
        assert near["f_e[9]"][-1] > 0.0
        for name in ("f_e[2]", "f_e[9]", "f_bonds[2]"):
            assert far_off[name][-1] == pytest.approx(near[name][-1], rel=1e-9), (box, name)


def test_values_of_a_line_are_of_one_state(lmp, tmp_path):
    """Though a fix that is defined before fix evp/bonds has asked for one before the bonds of the step break."""
    body = lattice_body((4, 3, 3))
    write_body(tmp_path / "body.data", body)
    columns = " ".join(f"f_bonds[{k}]" for k in range(1, 6))
    tables = []
    for early in ("", 'variable early equal f_bonds[3]\nfix early all print 1 "${early}" screen no\n'):
        text = head() + early + pair(contact="repulsive break 0.01") + velocities("2000*x+20*sin(1.7*id)")
        tables.append(lmp(text + "fix move all nve\ntimestep 1e-7\nthermo 1\n" + thermo(columns) + "run 300\n").ok().thermo())
    assert tables[0]["f_bonds[5]"][-1] > 0, "control: bonds break"
    assert all(np.array_equal(tables[0][name], tables[1][name]) for name in tables[0])


def test_the_text_of_a_body_that_has_flowed_in_part(lmp, tmp_path):
    """Spheres that have not flowed have a line too, as a body that is deformed does not tell what its surface was at rest. Control: most have not."""
    body = lattice_body((8, 3, 3))
    write_body(tmp_path / "body.data", body)
    metal = pair(contact="none plasticity isotropic", fix="{}") + "fix volume all evp/volume 500\n" + thermo("pe f_volume f_volume[1]")
    text = head() + metal.format("fix bonds all evp/bonds") + "region end block INF 0.02 INF INF INF INF\ngroup end region end\n"
    text += "velocity end set 60 0 0\nfix move all nve\ntimestep 3e-7\nrun 30\nwrite_evp_bonds part.bonds\nwrite_data part.data nocoeff\n"
    whole = lmp(text).ok().thermo()
    again = lmp(head(start="read_data part.data") + metal.format("fix bonds all evp/bonds file part.bonds") + "run 0\n", 2).ok().thermo()
    spheres_of_file = [words.split() for words in (tmp_path / "part.bonds").read_text(encoding="utf-8").splitlines() if words.startswith("sphere")]
    assert len(spheres_of_file) == len(body.x) and 0 < sum(float(words[3]) > 0.0 for words in spheres_of_file) < 0.7 * len(body.x)
    for name in ("PotEng", "f_volume", "f_volume[1]"):
        assert again[name][0] == pytest.approx(whole[name][-1], rel=1e-9), name


def test_bonds_that_fail_as_a_minimization_comes_to_rest(lmp, tmp_path):
    """The volume energy is told of them: it stays, and the spheres are torn. Control: bonds have failed."""
    body = lattice_body((8, 3, 3))
    write_body(tmp_path / "body.data", body)
    text = head() + pair(contact="none break 0.005", fix="fix bonds all evp/bonds") + "fix volume all evp/volume 500\n"
    text += "region left block INF 0.01 INF INF INF INF\nregion right block 0.07 INF INF INF INF INF\ngroup left region left\ngroup right region right\n"
    text += "group ends union left right\nfix hold ends setforce 0 0 0\nmin_modify dmax 1e-4\n" + thermo("f_volume")
    runs = lmp(text + 8 * "displace_atoms right move 1e-4 0 0\nminimize 0 100 20000 200000\nrun 0\n" + "write_evp_bonds torn.bonds\n").ok()
    for k in range(8):
        assert runs.thermo(2 * k + 1)["f_volume"][0] == pytest.approx(runs.thermo(2 * k)["f_volume"][-1], rel=1e-9)
    kept = read_pairs(tmp_path / "torn.bonds")
    bonds = np.bincount(np.array(list(kept.bonds)).ravel(), minlength=len(body.x) + 1)
    lost = {own for own, count in kept.column("recorded").items() if bonds[own] < count}
    torn = {own for own, is_torn in kept.column("torn").items() if is_torn}
    assert len(torn) > 5 and torn <= lost, "those that end at dlim leave without a share"


def test_a_deleted_neighbor_is_no_bond_of_a_sphere(lmp, tmp_path):
    """A sphere whose neighbors but one are deleted has the plastic strain of the bond that is left, in one run and from its text. Control: it flows."""
    body = lattice_body((3, 3, 3))
    write_body(tmp_path / "body.data", body)
    own = 14
    neighbors = sorted({i + j - own for i, j in body.bonds if own in (i, j)})
    style, fix = "none plasticity isotropic", "fix bonds all evp/bonds"
    gone = f"group gone id {' '.join(map(str, neighbors[1:]))}\ndelete_atoms group gone compress no\n"
    pull = f"fix n all nve/noforce\nvelocity all set 0 0 0\ngroup own id {own}\nvelocity own set 20 30 40\ntimestep 3e-7\nrun 20\nwrite_evp_bonds {{}}.bonds\n"
    lmp(head() + pair(contact=style, fix=fix) + "run 0\n" + gone + "run 0\nwrite_data left.data nocoeff\nwrite_evp_bonds left.bonds\n" + pull.format("run")).ok()
    lmp(head(start="read_data left.data") + pair(contact=style, fix=fix + " file left.bonds") + pull.format("text")).ok()
    kept = []
    for name in ("run", "text"):
        lines = (tmp_path / f"{name}.bonds").read_text(encoding="utf-8").splitlines()
        kept += [list(map(float, words.split()[2:6])) for words in lines if words.startswith(f"sphere {own} ")]
    assert len(kept) == 2 and kept[0][0] > 0.01 and kept[0] == pytest.approx(kept[1], rel=1e-9)
