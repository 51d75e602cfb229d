# SPDX-License-Identifier: GPL-2.0-only
"""`contact join BETA all exposure Y0 [pressure S0]`: bodies that join where their surfaces are stretched and pressed."""

import numpy as np
import pytest
from evp import law
from flowing import read_pairs
from small_bodies import head, lattice_body, thermo, write_body
from test_yield import row_words

LENGTH, XI_S, SPEED, DT = 0.01, 0.002, 20.0, 1e-7
SLIP_PER_STRAIN = 0.31
DENSITY, STRESS = 2700.0, 1.2e7
ROW = f"80 8 4 3 8 4 {XI_S} 0 1.5 flow 0 1 1 1"
YIELDS = f" spacing {LENGTH} coordination 1 density {DENSITY} yield {STRESS}"
RULE = "exposure 0.2"


def start(newton, apart, boundary="f f f", along=(0.0, 0.0, 0.0)):
    """Two bodies of two bonded spheres each, side by side; apart: their distance over R_i + R_j."""
    at = [(0.0, 0.0), (LENGTH, 0.0), (0.0, apart * LENGTH), (LENGTH, apart * LENGTH)]
    made = "".join(f"create_atoms {1 + k // 2} single {x + along[0]:.17g} {y + along[1]:.17g} {along[2]:.17g} units box\n" for k, (x, y) in enumerate(at))
    return f"""units si
atom_style sphere
atom_modify map yes
newton {newton}
boundary {boundary}
region box block -0.05 0.05 -0.05 0.05 -0.05 0.05 units box
create_box 2 box
{made}set group all diameter {LENGTH}
set group all density {DENSITY}
"""


def material(rule=RULE, row=ROW, join="1.2", within=" within type"):
    """Behind the start, or behind a restart file."""
    return f"""neighbor 0.002 bin
pair_style evp/lj contact join {join} all {rule} plasticity isotropic
pair_coeff * * {row}
fix bonds all evp/bonds{within}
group ends id 2 4
group two type 2
fix move all nve/noforce
timestep {DT}
thermo 10
compute state all evp/state/atom exposure
compute most all reduce max c_state[*]
thermo_style custom step f_bonds f_bonds[6] c_most[5]
"""


STRETCH = f"velocity ends set {SPEED} 0 0\n"
STEPS = 400
PARALLEL = pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (4, "on")])


def exposure_at(step):
    """Of a sphere without hardening, by the slip of its only bond up to the update at this step."""
    stretched = np.log((1.0 + SPEED * DT * (np.asarray(step) - 1) / LENGTH) / (1.0 + XI_S))
    return 1.0 - np.exp(-np.maximum(0.0, stretched) / SLIP_PER_STRAIN)


@PARALLEL
@pytest.mark.parametrize("apart, stretched", [(1.1, True), (0.99, True), (1.1, False), (0.99, False)])
def test_pairs_join_once_they_are_stretched(lmp, ranks, newton, apart, stretched):
    """At the update at which the exposure of both spheres has come to Y0, in closed form, and on both sides at once; without, never, however hard they are pressed."""
    table = lmp(start(newton, apart) + material() + (STRETCH if stretched else "") + f"run {STEPS}\n", ranks).ok().thermo()
    if not stretched:
        assert not np.any(table["f_bonds[6]"])
        return
    when = np.argmax(table["f_bonds[6]"] > 0)
    assert table["c_most[5]"][: when + 1] == pytest.approx(exposure_at(table["Step"][: when + 1]), rel=1e-7)
    assert table["c_most[5]"][when - 1] < 0.2 <= table["c_most[5]"][when] and table["f_bonds[6]"][when] == table["f_bonds[6]"][-1] == 2


def test_what_is_stretched_before_they_touch_does_not_count(lmp):
    """And what is from then on does."""
    text = start("on", 1.4) + material() + STRETCH + f"run {STEPS}\nvelocity all set 0 0 0\nvelocity two set 0 -30 0\nrun 1200\nvelocity two set 0 0 0\n"
    run = lmp(text + STRETCH + f"run {STEPS}\n", 2).ok()
    assert np.all(run.thermo(1)["c_most[5]"] == 0.0) and run.thermo(2)["c_most[5]"][-1] > 0.1


@PARALLEL
@pytest.mark.parametrize("share, joins", [(0.98, 2), (1.02, 0)])
def test_pressure_over_the_flow_stress(lmp, ranks, newton, share, joins):
    """Stretched spheres that touch join under a pressure above S0 flow stresses, and not below: half of the force of the contact times its length over the volume of a
    sphere."""
    apart = 0.996
    force = law.force(apart * LENGTH, LENGTH, law.TABLE1._replace(e1=80.0, xi_s=0.5))
    pressure = 0.5 * force * apart * LENGTH / (np.pi / 6.0 * LENGTH**3) / STRESS
    text = start(newton, apart) + material(f"exposure 0.01 pressure {share * pressure:.9g}", ROW + YIELDS)
    table = lmp(text + f"run 100\n{STRETCH}run 100\n", ranks).ok()
    assert table.thermo(0)["f_bonds[6]"][-1] == 0 and table.thermo(1)["f_bonds[6]"][-1] == joins and pressure > 0.1


def test_a_pair_that_joins_goes_on_to_repel(lmp, tmp_path):
    """With the force of its contact, or with that of the elastic limit of the bond where it is less."""
    for apart in (0.999, 0.99):
        lmp(start("off", apart) + material() + STRETCH + f"run {STEPS}\nwrite_evp_bonds end.bonds\n", 2).ok()
        held = read_pairs(tmp_path / "end.bonds").bonds
        assert held[1, 3] == held[2, 4] == pytest.approx(apart * LENGTH / (1.0 - min(1.0 - apart, XI_S)), rel=1e-12)


def two_blocks():
    """A block of type 1 and one of type 2 beside it, apart from each other."""
    one = lattice_body((4, 4, 4), seed=1)
    bonds = {**one.bonds, **{(i + 64, j + 64): deq for (i, j), deq in one.bonds.items()}}
    x = np.concatenate([one.x, one.x + [0.002, 0.041, 0.0]])
    return one._replace(x=x, radius=np.tile(one.radius, 2), types=np.repeat([1, 2], 64), bonds=bonds, box=np.array([[-0.05, 0.1]] * 3))


PUSH = "velocity all set 0 0 0\nvariable v atom -1500*(y-0.04)\nvariable w atom 400*(x-0.02)\nvelocity all set v_w v_v NULL\n"
MOVE = "fix energy all evp/energy\nfix move all nve\ntimestep 5e-7\nthermo 10\n" + thermo("pe ke f_bonds[6] f_energy f_energy[9]")


def joining_blocks(body, rule="exposure 0.03 pressure 0.1", bonds=""):
    return f"pair_style evp/lj contact join 1.2 all {rule} plasticity isotropic\npair_coeff * * {row_words(body)}\nfix bonds all evp/bonds within type{bonds}\n"


@pytest.mark.parametrize("again, step", [("restart", 123), ("file", 123), ("restart", 110), ("file", 130)])
@pytest.mark.parametrize("ranks, newton", [(2, "on"), (4, "off")])
def test_whatever_the_ranks_and_restarts(lmp, tmp_path, again, step, ranks, newton):
    """Two blocks that hit each other, from a file of any step, those in which pairs join among them: the same joints and exposures."""
    body = two_blocks()
    write_body(tmp_path / "body.data", body)
    whole = lmp(head("on") + joining_blocks(body) + PUSH + MOVE + "run 300\nwrite_evp_bonds whole.bonds\n").ok().thermo()
    save = "write_restart half.restart\n" if again == "restart" else "write_data half.data nocoeff\nwrite_evp_bonds half.bonds\n"
    lmp(head(newton) + joining_blocks(body) + PUSH + MOVE + f"run {step}\n" + save, ranks).ok()
    start, bonds = ("read_restart half.restart", "") if again == "restart" else (f"read_data half.data\nreset_timestep {step}", " file half.bonds")
    table = lmp(head(newton, start=start) + joining_blocks(body, bonds=bonds) + MOVE + f"run {300 - step}\nwrite_evp_bonds end.bonds\n", ranks).ok().thermo()
    first, last = (read_pairs(tmp_path / name) for name in ("whole.bonds", "end.bonds"))
    for name in ("PotEng", "KinEng", "f_bonds[6]"):
        assert table[name][-1] == pytest.approx(whole[name][-1], rel=1e-8), name
    assert abs(whole["f_energy"]).max() < 1.5e-3 * whole["f_energy[9]"][-1]
    assert last.bonds == pytest.approx(first.bonds, rel=1e-6) and last.column("exposure") == pytest.approx(first.column("exposure"), rel=1e-6, abs=1e-9)
    assert 5 < whole["f_bonds[6]"][12] < whole["f_bonds[6]"][-1] - 5, "control"


@pytest.mark.parametrize("words, row, within, told", [
    ("exposure 0.2", ROW, "", "'exposure' of contact join is for contacts between two bodies"),
    ("exposure 0.2 pressure 1", ROW, " within type", "add 'yield', or leave 'pressure' out"),
    ("exposure 40", ROW, " within type", "exposure of contact join must be the share of two surfaces that is new when they bond, above 0 and below 1"),
    ("exposure 0.2 pressure 0", ROW, " within type", "pressure of contact join must be a positive number of flow stresses"),
    ("exposure", ROW, " within type", "exposure of contact join must be"),
    ("pressure 1", ROW, " within type", "'pressure' must stand in contact join [BETA] all exposure Y0 [pressure S0], once"),
    ("exposure 0.2 exposure 0.3", ROW, " within type", "'exposure' must stand in contact join")])
def test_misuse(lmp, words, row, within, told):
    run = lmp(start("on", 1.1) + material(words, row, within=within) + "run 0\n", 1)
    assert run.returncode != 0 and told in run.stdout
