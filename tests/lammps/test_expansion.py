# SPDX-License-Identifier: GPL-2.0-only
"""Row keyword expansion: lengths follow the temperatures of fix evp/heat. Free, held and layered bodies beside closed forms, and the balance of energies."""

import numpy as np
import pytest
from evp import law
from heated import LAYER, PROPERTIES, SOFTEN, plate, sheared, two_spheres
from hostile import refused
from lammps_run import REFERENCE, packed, run_decks, run_lammps
from oracle import law as oracle
from small_bodies import head, thermo

TREF, ALPHA = 293.0, 2e-5  # [K], [1/K]
ROW = law.Row(190.0, 8.0, 4.0, 30.0, 8.0, 4.0, 0.005, 0.0, 1.5)
WORDS = "190 8 4 30 8 4 0.005 0 1.5 density 2700 capacity 875 conductivity 120"
HOT = 100.0  # [K] above TREF
HEAT_IT, COOL_IT = (f"set group all temperature {kelvin}\n" for kelvin in (TREF + HOT, TREF))
MINIMIZE = "minimize 0 1e-6 20000 100000\n"


def growth(kelvin, alpha=ALPHA):
    """Of lengths."""
    return 1.0 + alpha * kelvin


def body(plasticity="none", newton="on", start=f"read_data {REFERENCE}", before="", temperature=COOL_IT,
         fix="fix bonds all evp/bonds", more=""):
    """The specimen, or what start reads, with volume energy; free."""
    return head(newton, "f f f", start, before, skin=4e-4) + f"""{"" if before else PROPERTIES}{temperature}
pair_style evp/lj contact repulsive plasticity {plasticity}
pair_coeff * * {WORDS} expansion {ALPHA} {TREF}
{fix}
fix volume all evp/volume 1000
fix energy all evp/energy
fix heat all evp/heat every 50
fix move all nve
timestep 2e-7
min_style cg
min_modify dmax 1e-6
compute rg all gyration
""" + thermo("pe c_rg f_volume f_energy f_energy[14]") + more


# ---- bodies that are free, or held ----


KEEP = "write_restart hot.restart\nwrite_data hot.data nocoeff\nwrite_evp_bonds hot.bonds\n"
FREE = f"run 0\n{HEAT_IT}{MINIMIZE}{KEEP}{COOL_IT}{MINIMIZE}"
SPLIT = [(1, "on"), (2, "off"), (4, "on")]


@pytest.fixture(scope="module", params=["none", "isotropic"])
def freed(request, tmp_path_factory):
    """Plasticity, the folder, and {(ranks, newton): run} of a body that was heated and cooled again."""
    folder = tmp_path_factory.mktemp("freed")
    runs = {}
    for ranks, newton in SPLIT:
        part = folder / f"{ranks}"
        part.mkdir()
        runs[ranks, newton] = run_lammps(body(request.param, newton, more=FREE), ranks, None, part).ok()
    return request.param, folder, runs


def test_a_free_body_grows_and_shrinks_back(freed):
    for run in freed[2].values():
        cold, hot, back = (run.thermo(block)["c_rg"][-1] for block in range(3))
        assert hot / cold == pytest.approx(growth(HOT), abs=1e-6 * ALPHA * HOT + 1e-9)
        assert back / cold == pytest.approx(1.0, abs=1e-9)


def test_a_hot_body_goes_on_from_files(freed):
    """On another number of ranks: from a restart file, and from a data file with a bond file, at the energy that it had; then it is cooled."""
    plasticity, folder, runs = freed
    files = {"restart": {"start": f"read_restart {folder}/2/hot.restart"},
             "data": {"before": PROPERTIES, "start": f"read_data {folder}/2/hot.data fix properties NULL properties",
                      "fix": f"fix bonds all evp/bonds file {folder}/2/hot.bonds"}}
    decks = {name: body(plasticity, temperature="", more="run 0\n" + COOL_IT + MINIMIZE, **choices) for name, choices in files.items()}
    cold, hot = (runs[2, "off"].thermo(block) for block in (0, 1))
    gained = hot["PotEng"][0] - cold["PotEng"][0]
    for name, run in run_decks(decks, 1, folder, plasticity).items():
        assert run.thermo(0)["c_rg"][-1] == pytest.approx(hot["c_rg"][-1], rel=1e-12), name
        assert run.thermo(0)["PotEng"][-1] == pytest.approx(hot["PotEng"][-1], rel=1e-9, abs=1e-9 * gained), name
        assert run.thermo(1)["c_rg"][-1] == pytest.approx(cold["c_rg"][-1], rel=1e-9), name


@pytest.mark.parametrize("plasticity", ["none", "isotropic"])
def test_a_held_bar(lmp, plasticity):
    """Ends that keep their x, and are free to widen: the force is that of a pull of the same bar by ALPHA dT, within the strain of its middle."""
    kelvin, strain, length = 50.0, 1e-3, 0.05
    dump = "dump now all custom 1 {}.dump id x c_u[1]\nrun 0\nundump now\n"
    run = lmp(body(plasticity, more="""region left block INF 0.005 INF INF INF INF
region right block 0.045 INF INF INF INF INF
group left region left
group right region right
fix lo left setforce 0 NULL NULL
fix hi right setforce 0 NULL NULL
compute u all displace/atom
""" + thermo("f_lo[1] f_hi[1]") + f"""run 0
set group all temperature {TREF + kelvin}
minimize 0 1e-4 20000 100000
{dump.format("hot")}{COOL_IT}minimize 0 1e-4 20000 100000
displace_atoms all ramp x 0 {-strain * length} x 0 {length}
minimize 0 1e-4 20000 100000
{dump.format("pressed")}""")).ok()

    def force_and_strain(name, block):
        end = run.dump(f"{name}.dump")[-1]
        x = end["x"] - end["c_u[1]"]
        middle = np.abs(x - 0.5 * length) < 0.25 * length
        table = run.thermo(block)
        return 0.5 * (table["f_lo[1]"][-1] - table["f_hi[1]"][-1]), np.polyfit(x[middle], end["c_u[1]"][middle], 1)[0]

    hot, strain_hot = force_and_strain("hot", 2)
    pressed, strain_pressed = force_and_strain("pressed", -1)
    assert hot / (ALPHA * kelvin - strain_hot) == pytest.approx(pressed / -strain_pressed, rel=0.01) and hot < 0.0
    assert hot / (ALPHA * kelvin) == pytest.approx(pressed / strain, rel=0.01)


LENGTH, HEIGHT = 0.04, 0.01
block = packed("block.data", n=1000, shape="block", length=LENGTH, width=0.006, height=HEIGHT)


def test_a_bimetal_strip_bends(lmp, block):
    """By Timoshenko's formula, which is 1.5 (difference of the strains)/height for two like layers; the rows of like types hold."""
    kelvin = 20.0
    layers = head(start=f"read_data {block} extra/atom/types 1", skin=1e-4) + f"""region upper block INF INF INF INF 0 INF
set region upper type 2
{PROPERTIES}set group all temperature {TREF}
pair_style evp/lj contact repulsive
pair_coeff 1 1 {WORDS} expansion 1e-5 {TREF}
pair_coeff 2 2 {WORDS} expansion 3e-5 {TREF}
pair_coeff 1 2 {WORDS}
fix bonds all evp/bonds
fix heat all evp/heat
compute u all displace/atom
min_modify dmax 1e-6
run 0
set group all temperature {TREF + kelvin}
minimize 0 1e-2 20000 100000
dump now all custom 1 bent.dump id x y z c_u[1] c_u[2] c_u[3] radius
run 0
"""
    end = lmp(layers, 2).ok().dump("bent.dump")[-1]
    u = end.vectors("c_u[1]", "c_u[2]", "c_u[3]")
    x, y, z = (end.x - u).T
    x = x - 0.5 * LENGTH
    middle = np.abs(x) < 0.3 * LENGTH
    shape = np.stack([np.ones_like(x), x, y, z, x * z, x * y], axis=1)[middle]
    found = np.linalg.lstsq(shape, u[middle, 0], rcond=None)[0]
    bears = HEIGHT - 0.4 * 2.0 * end["radius"].mean()  # surfaces do not: 0.2 diameters at each
    assert found[4] == pytest.approx(1.5 * 2e-5 * kelvin / bears, rel=0.05)
    assert found[1] == pytest.approx(2e-5 * kelvin, rel=0.01)  # the mean of the layers


# ---- energies ----


R = 0.005


def two(plasticity="none", apart=1.0, bonded=True, volume=False, others="", contact="repulsive", fix="", more="", newton="on"):
    """Two spheres that do not move, recorded at rest where they are bonded, or 2.6 R apart, and then this times 2 R apart."""
    start = 2.0 * R if bonded else 2.6 * R
    return two_spheres(newton, 2 if others else 1, start - R, TREF) + f"""pair_style evp/lj contact {contact} plasticity {plasticity}
pair_coeff * * {WORDS} expansion {ALPHA} {TREF}
{others}
fix bonds all evp/bonds {fix or ("" if bonded else "zone 1.1")}
{"fix volume all evp/volume 500" if volume else ""}
fix energy all evp/energy
fix heat all evp/heat every 10
group moved id 2
fix move all nve/noforce
timestep 1e-7
compute pair all pair/local dist p1 force
compute d all reduce max c_pair[1] inputs local
compute deq all reduce max c_pair[2] inputs local
compute force all reduce sum c_pair[3] inputs local
run 0 post no
displace_atoms moved move {2.0 * R * apart - start:.17g} 0 0 units box
""" + thermo("pe f_bonds[6] c_d c_deq c_force f_energy f_energy[2] f_energy[3] f_energy[5] f_energy[9] f_energy[11] f_energy[12] f_energy[14]") + more


def stored(plasticity, bonded, d, deq):
    """Of a pair by its law, relative to a state that does not depend on the temperature, with what it dissipates on its way."""
    r = d / deq
    if not bonded and r > 1.0:
        return 0.0
    if plasticity == "none":
        return oracle.energy(d, deq, ROW, deq)
    held = np.clip(r, 1.0 - ROW.xi_s, 1.0 + ROW.xi_s)
    rest = oracle.potential(1.0, 1.0, ROW.e1, ROW.m1, ROW.n1)
    force = law.potential_force(held, 1.0, ROW.e1, ROW.m1, ROW.n1)
    return oracle.potential(held, 1.0, ROW.e1, ROW.m1, ROW.n1) - rest + abs(force) * held * abs(np.log(r / held))


def of_volume(d, deq):
    """Volume energy of both spheres of a bond, whose reference has grown with it."""
    dlim = 1.5 * deq
    at_rest, now = 1.0 - deq / dlim, 1.0 - d / dlim
    theta = (at_rest**2 - now**2) / (2.0 * at_rest * deq / dlim / 3.0)
    return 500.0 * theta**2


PLACED = ((True, 1.003, False), (True, 1.03, False), (True, 0.997, True), (False, 0.998, False), (False, 1.001, False), (False, 0.98, False))
PAIRS = [(plasticity, *placed) for plasticity in ("none", "isotropic") for placed in PLACED]


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    """{case: run} of pairs that are heated at fixed distance."""
    more = f"run 0\nset group all temperature {TREF + HOT}\nrun 1\n"
    decks = {case: two(plasticity, apart, bonded, volume, more=more) for case in PAIRS for plasticity, bonded, apart, volume in [case]}
    return run_decks(decks, 1, tmp_path_factory.mktemp("pairs"))


@pytest.mark.parametrize("case", PAIRS, ids=str)
def test_what_a_pair_gains_at_fixed_distance(pairs, case):
    """Entry 14, in closed form; it is all that changes the energy, so that the balance closes."""
    plasticity, bonded, apart, volume = case
    run, d, deq, grown = pairs[case], 2.0 * R * apart, 2.0 * R, 2.0 * R * growth(HOT)
    expected = stored(plasticity, bonded, d, grown) - stored(plasticity, bonded, d, deq)
    if volume:
        expected += of_volume(d, grown) - of_volume(d, deq)
    now = run.thermo(-1)
    assert now["f_energy[14]"][-1] == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert now["f_energy"][-1] == pytest.approx(run.thermo(1)["f_energy"][-1], abs=1e-9 * abs(expected) + 1e-13)
    assert expected != 0.0 or (not bonded and apart > growth(HOT))


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off")])
def test_a_body_that_heats_itself(lmp_decks, ranks, newton):
    """By flow, in a box whose volume is given: the imbalance is small beside the plastic work, and proportional to the timestep."""
    def deck(share):
        text = sheared(heat=f"{SOFTEN} expansion 1e-4 {TREF}", every=50 * share, newton=newton, gamma=0.0, more=f"timestep {3e-7 / share}\n")
        return text.replace("f_heat f_heat[1]", "f_energy[14] f_heat f_heat[1]", 1) + f"thermo {400 * share}\nrun {400 * share}\n"

    runs = lmp_decks({share: deck(share) for share in (1, 2)}, ranks)
    off = [runs[share].thermo()["f_energy"][-1] / runs[share].thermo()["f_energy[9]"][-1] for share in (1, 2)]
    assert abs(off[0]) < 3e-4 and abs(off[1]) < 0.6 * abs(off[0])
    assert runs[1].thermo()["f_energy[14]"][-1] > 0.1


# ---- what comes, joins and ends hot ----


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (4, "on")])
@pytest.mark.parametrize("plasticity", ["none", "isotropic"])
def test_atoms_that_come_to_a_hot_body(lmp, plasticity, ranks, newton):
    """They have the temperature of those that they are bonded to, and no force, also where a restart file comes between; when all is cooled they shrink as the
    others."""
    text = plate(newton, temperature=COOL_IT, soften=f"expansion {ALPHA} {TREF}", more="""fix volume all evp/volume 300
fix move all nve
min_modify dmax 1e-6
""" + thermo("pe fnorm") + f"""run 0
set group all temperature {TREF + HOT}
minimize 0 1e-5 2000 10000
dump before all custom 1 before.dump id fx fy fz
run 0
undump before
{LAYER}write_restart new.restart
dump after all custom 1 after.dump id fx fy fz
run 1
write_restart hot.restart
undump after
set group all temperature {TREF}
minimize 0 1e-5 2000 10000
""")
    again = plate(newton, start="new.restart", soften=f"expansion {ALPHA} {TREF}", more="fix volume all evp/volume 300\ndump again all custom 1 again.dump id fx fy fz\nrun 0\n")
    if plasticity == "none":
        text, again = (one.replace("contact join 1.2 plasticity isotropic", "contact repulsive") for one in (text, again))
    run = lmp(text, ranks).ok()
    before, after = run.dump("before.dump")[-1], run.dump("after.dump")
    old = np.isin(after[0]["id"], before["id"])
    assert 0 < len(before["id"]) < len(old)
    scale = 190.0 / R * 1e-9
    assert np.abs(after[0].f[old] - before.f).max() < scale and np.abs(after[0].f[~old]).max() < scale
    assert np.abs(after[1].f[~old]).max() < 1e3 * scale  # nor does any in the step after
    assert np.abs(lmp(again, ranks).ok().dump("again.dump")[0].f[~old]).max() < scale


@pytest.mark.parametrize("newton, ranks", [("on", 1), ("off", 2)])
def test_what_joins_hot_and_cools(lmp, newton, ranks):
    """Two bodies join at BETA times the grown radii, without a force; the bond is shorter when it is cold. The balance closes."""
    others = f"pair_coeff 1 2 {WORDS}\npair_coeff 2 2 {WORDS} expansion {ALPHA} {TREF}"
    more = f"""set group all temperature {TREF + HOT}
run 1
velocity moved set -20 0 0
thermo 1
run 500
velocity moved set 0 0 0
run 1
set group all temperature {TREF}
run 10
"""
    run = lmp(two("isotropic", 1.3, False, others=others, contact="join 1.2 all", fix="within type", more=more, newton=newton), ranks).ok()
    meet, cold = run.thermo(2), run.thermo(-1)
    first = np.flatnonzero(meet["f_bonds[6]"])[0]
    within = 1.2 * 2.0 * R * growth(HOT)
    assert meet["c_d"][first] <= within < meet["c_d"][first - 1] and abs(meet["c_force"][first]) < 1e-6
    assert meet["c_deq"][first] == pytest.approx(meet["c_d"][first], rel=1e-12)
    assert cold["c_deq"][0] / cold["c_deq"][-1] == pytest.approx(growth(HOT), rel=1e-12)
    assert abs(cold["f_energy[14]"][-1]) > 1e-3 and cold["f_energy"][-1] == pytest.approx(cold["f_energy"][0], abs=1e-9)


def test_what_ends_hot(lmp):
    """At dlim times its growth, that of the rows of like types also where the row of the pair has none."""
    others = f"pair_coeff 1 2 {WORDS}"
    run = lmp(two(others=others, more=f"""set group all temperature {TREF + 1000.0}
run 1
displace_atoms moved move {2.0 * R * 0.515:.17g} 0 0 units box
run 0
displace_atoms moved move {2.0 * R * 0.02:.17g} 0 0 units box
run 0
""")).ok()
    assert run.thermo(-2)["c_force"][-1] < 0.0 and run.thermo(-1)["c_force"][-1] == 0.0
    assert run.thermo(-2)["c_deq"][-1] == pytest.approx(2.0 * R * growth(1000.0), rel=1e-12)


# ---- what is refused, or said ----


def test_too_much(lmp):
    refused(lmp(two(more="set group all temperature 5000\nrun 1\n")), "expansion would change the size of atoms by up to 0.09414 of it, first atom 1: more than 0.05",
            "check their temperatures, and ALPHA and TREF of their row")


def test_without_the_fix_it_is_said(lmp_decks):
    """And nothing grows."""
    text = two(more=f"set group all temperature {TREF + HOT}\nrun 1\n")
    text = text.replace("fix heat all", "#")
    runs = lmp_decks({kind: text.replace("plasticity none", f"plasticity {kind}") for kind in ("none", "isotropic")})
    for run in runs.values():
        assert "inactive without fix evp/heat: expansion" in run.stdout
        assert run.thermo()["c_deq"][-1] == 2.0 * R
