# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/heat: conduction beside an independent program, what is dissipated and where it goes, softening and melting, and what the fix refuses."""

import json

import numpy as np
import pytest
from evp import law
from flowing import SPHERE, largest_difference, read_pairs
from heated import ACCOUNT, ENTRIES, JOIN, LAST, LAYER, PROPERTIES, RATE, ROW, SOFTEN, TMELT, TREF, assert_closes, hot_on_cold, last, plate, sheared, stretched
from hostile import PARTS, refused, scene
from lammps_run import REFERENCE, run_lammps, write_data
from small_bodies import dump, head, thermo, words

CONDUCTION = json.loads(REFERENCE.with_name("specimen_500_heat.json").read_text(encoding="utf-8"))["conduction"]
HEAT = {"box": PARTS["box"] + f"\n{PROPERTIES}set group all temperature 300", "coeff": PARTS["coeff"] + " density 2700 conductivity 100 capacity 900",
        "fix": PARTS["fix"] + "\nfix heat all evp/heat"}
WIDE = HEAT["box"].replace("block 0 3 0 2 0 2", "block -1 4 -1 3 -1 3").replace("create_atoms 1 box", "region body block 0 2.1 0 1.1 0 1.1\ncreate_atoms 1 region body")  # has room around the spheres


# ---- conduction ----


def specimen(newton, group, temperatures, timestep, more=""):
    """The specimen at rest; group: of the fix."""
    text = head(newton, "s s s", f"read_data {REFERENCE}", skin=0.001) + PROPERTIES
    text += f"""set group all temperature 300
variable solid equal mass(all)/(PI*0.02^2*0.05)
pair_style evp/lj contact none
pair_coeff * * {words(law.TABLE1)} density ${{solid}} conductivity 120 capacity 875
fix bonds all evp/bonds
region hot block INF 0.005 INF INF INF INF
region cold block 0.045 INF INF INF INF INF
group hot region hot
group cold region cold
group between subtract all hot cold
{temperatures}
fix heat {group} evp/heat every 1
timestep {timestep}
compute hot hot reduce sum f_heat
compute T all property/atom temperature
compute low all reduce min c_T
compute high all reduce max c_T
{more}
""" + thermo(f"c_hot c_low c_high {ENTRIES}")
    return text


ENDS = "set group hot temperature 400"
WAVE = "variable start atom 300+10*sin(7*id)\nset group all temperature v_start"


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off")])
def test_flux_between_held_ends(lmp, ranks, newton):
    """Between layers at 400 and 300 K, once it is steady; the largest stable step."""
    table = lmp(specimen(newton, "between", ENDS, 0.05) + "thermo 400\nrun 4000\n", ranks).ok().thermo()
    flux = -np.diff(table["c_hot"])[-1] / (400 * 0.05)
    assert flux == pytest.approx(CONDUCTION["steady_hot_400_cold_300_flux_W"], rel=1e-6)
    assert table["f_heat[7]"][0] == pytest.approx(2.0 / CONDUCTION["lambda_max_ends_held_1_s"], rel=1e-6)
    assert table["f_heat[3]"][-1] == pytest.approx(-table["f_heat[5]"][-1], rel=ACCOUNT) and table["f_heat[5]"][-1] > 1000.0
    assert table["c_low"][-1] == 300.0 and table["c_high"][-1] == 400.0 and np.all(table["f_heat[1]"] == 0.0)


def test_largest_stable_step(lmp):
    """Of all spheres: 0.98 of it decays, 1.02 is refused with what does."""
    limit = CONDUCTION["thermal_step_limit_all_free_s"]
    table = lmp(specimen("on", "all", WAVE, 0.98 * limit) + "thermo 1000\nrun 2000\n").ok().thermo()
    assert table["f_heat[7]"] == pytest.approx(limit, rel=1e-6)
    assert np.ptp([table["c_low"][0], table["c_high"][0]]) > 19.0 and table["c_high"][-1] - table["c_low"][-1] < 0.01
    refused(lmp(specimen("on", "all", WAVE, 1.02 * limit) + "run 3\n"), "largest stable thermal step 0.080", "use a smaller timestep")
    refused(lmp(specimen("on", "all", WAVE, 0.204 * limit).replace("every 1", "every 5") + "run 30\n", 2), "use 'every 4' or less")


def test_a_pair_that_comes_nearer(lmp, tmp_path):
    """Two free spheres, whose bond conducts twice as much when they are near, beside a bond with a held one that conducts more from the beginning."""
    write_data(tmp_path / "body.data", np.array([[0.0, 0, 0], [0.01, 0, 0], [0.0, 0.04, 0], [0.0145, 0.04, 0]]), [0.005] * 4, [[-0.1, 0.1]] * 3)
    text = head(skin=0.002) + PROPERTIES + f"""set group all temperature 300
set atom 3 temperature 301
pair_style evp/lj contact none
pair_coeff * * {words(law.TABLE1)} density 2700 conductivity 100 capacity 900
fix bonds all evp/bonds
group moves id 4
group warms id 1 3 4
fix near moves move linear -0.04 0 0
fix heat warms evp/heat every 1
timestep 1e-4
""" + thermo(ENTRIES)
    limit = lmp(text + "run 0\n").ok().thermo()["f_heat[7]"][0]
    text = text.replace("linear -0.04", f"linear {-0.0045 / (200.0 * 0.95 * limit):.6g}").replace("timestep 1e-4", f"timestep {0.95 * limit:.9g}")
    refused(lmp(text + "thermo 50\nrun 200\n"), "above the largest stable thermal step", "use a smaller timestep", stepped=True)


def test_a_step_that_grows_too_long(lmp):
    """In the run, as the timestep grows."""
    text = specimen("on", "all", WAVE, 0.5 * CONDUCTION["thermal_step_limit_all_free_s"])
    run = lmp(text + "run 10 every 1 \"timestep $(0.04+0.01*step)\"\n")
    refused(run, "above the largest stable thermal step 0.080", "use a smaller timestep", stepped=True)


# ---- heat of work ----


END = dump("end.dump", 1500, "c_T f_heat x y z")


@pytest.fixture(scope="module")
def warmed(tmp_path_factory):
    """Of a body that softens, on one rank: the run, its temperatures at the end, a restart file between two hand-outs."""
    folder = tmp_path_factory.mktemp("warmed")
    run = run_lammps(sheared(more=END) + "thermo 500\nrun 725\nwrite_restart state.rst\nrun 775\n" + LAST, 1, {}, folder).ok()
    return run, folder, run.dump("end.dump")[-1]


def test_where_the_heat_comes_from(warmed):
    """0.9 of the plastic work, all of the damping, which is taken at the velocities of the forces, and what bonds that ended had held. The energy balance
    closes while limits fall; temperatures are those of the heat."""
    run, _, end = warmed
    table = run.thermo()
    assert_closes(run)
    of_work = 0.9 * table["f_energy[9]"][-1] + table["f_energy[6]"][-1] + table["f_energy[11]"][-1]
    assert last(run)[1] == pytest.approx(of_work, rel=3e-4) and table["f_energy[11]"][-1] > 1.0 and table["f_energy[6]"][-1] > 20.0
    assert np.abs(table["f_energy"]).max() < 2e-4 * table["f_energy[9]"][-1]
    mass = run_mass()
    assert 875.0 * mass @ (end["c_T"] - TREF) == pytest.approx(last(run)[3], rel=1e-9)


def run_mass():
    """Of the spheres of the periodic body, by ID."""
    lines = (JOIN / "join_start_1000.data").read_text(encoding="utf-8").splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("Atoms")) + 2
    atoms = np.array([list(map(float, line.split()[:4])) for line in lines[start : start + 1000]])
    atoms = atoms[np.argsort(atoms[:, 0])]
    return atoms[:, 3] * np.pi / 6.0 * atoms[:, 2] ** 3


@pytest.mark.parametrize("kind, ranks, newton", [("whole", 2, "off"), ("restart", 1, "off"), ("restart", 4, "on")])
def test_whatever_the_ranks_and_restarts(lmp, warmed, kind, ranks, newton):
    """The file was written between two hand-outs."""
    run, folder, end = warmed
    if kind == "whole":
        other = lmp(sheared(newton=newton, more=END) + "run 725\nrun 775\n" + LAST, ranks).ok()
    else:
        other = lmp(sheared(newton=newton, start=f"read_restart {folder}/state.rst", more=END) + "run 775\n" + LAST, ranks).ok()
    assert_closes(other)
    assert last(other)[1:] == pytest.approx(last(run)[1:], rel=1e-9)
    found = other.dump("end.dump")[-1]
    assert found["c_T"] - TREF == pytest.approx(end["c_T"] - TREF, rel=1e-6)


@pytest.mark.parametrize("every", [1, 1000])
def test_however_often_it_is_handed_out(lmp, warmed, every):
    """The same heat but for what lags in the softening."""
    run = lmp(sheared(every=every) + "thermo 1500\nrun 1500\n" + LAST).ok()
    assert_closes(run)
    assert last(run)[1] == pytest.approx(last(warmed[0])[1], rel=5e-3)
    table = run.thermo()
    assert np.abs(table["f_energy"]).max() < 3e-4 * table["f_energy[9]"][-1]


def test_of_the_implicit_damping(lmp):
    """As the energy balance has it, at a gamma that dissipates most of the work."""
    run = lmp(sheared(gamma=2e4, integrate="nve/evp") + "thermo 300\nrun 300\n" + LAST, 2).ok()
    table = run.thermo()
    assert_closes(run)
    of_work = 0.9 * table["f_energy[9]"][-1] + table["f_energy[6]"][-1] + table["f_energy[11]"][-1]
    assert last(run)[1] == pytest.approx(of_work, rel=2e-3) and table["f_energy[6]"][-1] > 0.5 * of_work


def test_of_implicit_damping_that_stops_motion_in_a_step(lmp):
    """What the spheres have lost, not the damping force at the end of the step squared."""
    run = lmp(scene(**{**HEAT, "box": WIDE, "coeff": HEAT["coeff"].replace("0.005 0 1.5", "0.005 1e5 1.5"), "fix": f"{HEAT['fix']} every 7",
                       "move": "fix energy all evp/energy\nfix move all nve/evp\nvelocity all create 1e22 4711",
                       "step": "timestep 1e-6", "thermo": thermo(f"ke f_energy f_energy[6] {ENTRIES}"), "run": "thermo 50\nrun 200\n" + LAST}), 2).ok()
    table = run.thermo()
    assert last(run)[1] == pytest.approx(table["f_energy[6]"][-1], rel=1e-3) and table["f_energy[6]"][-1] > 0.1 * table["KinEng"][0] > 0.0


# ---- softening and melting ----


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off")])
def test_a_hot_body_is_one_with_a_lower_limit(lmp, tmp_path, ranks, newton):
    """All at 500 K, held, beside a cold one whose xi_s is smaller by s."""
    s, ends = 1.0 - (500.0 - TREF) / (TMELT - TREF), {}
    for name, choices in (("hot", {"temperature": "set group all temperature 500"}), ("cold", {"xi_s": ROW["xi_s"] * s, "heat": ""})):
        run = lmp(sheared(group="nobody", newton=newton, **choices) + f"run 500\nwrite_evp_bonds {name}.bonds\n" + LAST, ranks).ok()
        ends[name] = read_pairs(tmp_path / f"{name}.bonds")
        assert last(run)[0] == pytest.approx(0.0, abs=ACCOUNT * last(run)[1]) and last(run)[3] == 0.0
    assert largest_difference(ends["hot"], ends["cold"], SPHERE) < 1e-9 and max(ends["hot"].column("plastic_strain").values()) > 0.01


def test_stress_is_that_of_the_softened_limit(lmp_decks):
    """Held at these temperatures, over 0.03 to 0.06 of strain: in proportion to s within 25 %, as the volume energy does not soften."""
    more = "compute press all pressure NULL pair fix\nvariable tau equal -c_press[4]\nfix tau all ave/time 5 100 500 v_tau"
    shares = (1.0, 0.5, 0.2, 0.1)
    decks = {s: sheared(group="nobody", temperature=f"set group all temperature {TREF + (1.0 - s) * (TMELT - TREF)}", more=more).replace("custom step", "custom step f_tau")
             + "thermo 1000\nrun 1000\n" for s in shares}
    tau = np.array([run.thermo()["f_tau"][-1] for run in lmp_decks(decks).values()])
    assert tau / tau[0] == pytest.approx(shares, rel=0.25) and np.all(np.diff(tau) < 0.0)


def test_stress_grows_with_the_rate(lmp):
    """By 1 + C ln(rate/RATE0) of the plastic strain rate, here the shear strain rate over sqrt(3), within 3 %; the energies close, and so does a restart."""
    more = "compute press all pressure NULL pair fix\nvariable tau equal -c_press[4]\nfix tau all ave/time 5 100 500 v_tau"

    def shear(rate, **choices):
        return sheared(rate, group="nobody", gamma=0.0, **choices).replace("custom step", "custom step f_tau") + "thermo 500\n"

    tau = {}
    for rate in ("", "rate 0.05 1"):
        run = lmp(shear(rate, more=more) + "run 755\nwrite_restart state.rst\nrun 745\n").ok()
        tau[rate] = run.thermo()["f_tau"][-1]
        assert np.abs(run.thermo()["f_energy"]).max() < 3e-4 * run.thermo()["f_energy[9]"][-1]
    assert tau["rate 0.05 1"] / tau[""] == pytest.approx(1.0 + 0.05 * np.log(RATE / np.sqrt(3.0)), rel=0.03)
    again = lmp(shear("rate 0.05 1", more=more, start="read_restart state.rst") + "run 745\n", 2).ok().thermo()
    assert again["f_tau"][-1] == pytest.approx(tau["rate 0.05 1"], rel=1e-6)


REST = {"run": "run 3000 post no\nrun 0\n", "min": "fix hold all setforce 0 0 0\nminimize 0 1e-9 100 100\nunfix hold\nrun 0\n"}
REST["minrun"] = REST["min"] + REST["run"]
CHANGES = {  # what makes limits fall at rest: row, lines, how far bonds hold then
    "rate": ("0.005 0 1.5 flow 0 1 1 1 rate 0.1 1", "", 0.005),
    "temperature": ("0.005 0 1.5 flow 0 1 1 1 soften 293 775 1", "set group all temperature 534\n", 0.0025),
    "plastic strain": ("0.005 0 1.5 flow 0 1 1 0.6 2 0.6", "fix_modify bonds plastic_strain all 1\n", 0.003),
}


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (3, "on")])
@pytest.mark.parametrize("change", CHANGES)
def test_a_minimization_has_the_limits_of_rest(lmp_decks, change, ranks, newton):
    """As a run of the body that is held has in the end, and a run behind it changes nothing: no strain rate, the temperatures and plastic strains of now; the same heat of
    the energy that bonds give up."""
    row, lines, strain = CHANGES[change]
    runs = {way: run.ok() for way, run in lmp_decks({way: stretched(row, newton, lines + rest) for way, rest in REST.items()}, ranks).items()}
    force, heat = ({way: run.thermo()[name][-1] for way, run in runs.items()} for name in ("c_pull", "f_heat[1]"))
    wanted = 80.0 * 8.0 * ((1.0 + strain) ** -4 - (1.0 + strain) ** -8) / 0.011  # of the first regime, at d = 0.011
    assert force["run"] == pytest.approx(-wanted, rel=1e-3) and runs["run"].thermo(0)["c_pull"][-1] < -1.3 * wanted
    force["in it"] = runs["min"].thermo(1)["c_pull"][-1]
    assert force["min"] == pytest.approx(force["run"], rel=1e-4), "but for what the heat softens"
    assert [force["in it"], force["minrun"]] == pytest.approx([force["min"]] * 2, rel=1e-4 if change == "temperature" else 1e-9)
    assert heat["min"] == pytest.approx(heat["run"], rel=1e-4) and heat["minrun"] == pytest.approx(heat["min"], rel=1e-4)
    assert heat["min"] > 1.001 * runs["min"].thermo(0)["f_heat[1]"][-1] > 0.0


def test_a_limit_stays_below_the_strongest_strain(lmp_decks):
    """Whatever the rate: beyond it a bond that is stretched further holds with less and gives back what flow should take."""
    strongest = 2.0**0.25 - 1.0
    rows = {"far above": "0.15 0 1.5 flow 0 1 1 1 rate 0.1 1", "just above": "0.15 0 1.5 rate 0.05 1", "below": "0.15 0 1.5 flow 0 1 1 1 rate 0.001 1"}
    runs = lmp_decks({name: stretched(row, speed=20.0, steps=2000, dt=1e-7) for name, row in rows.items()}, 2)
    found = {name: run.ok().thermo(0)["c_stretch"][-1] for name, run in runs.items()}
    assert found["far above"] == pytest.approx(strongest, rel=1e-9) and found["just above"] == pytest.approx(strongest, rel=1e-9)
    assert 0.15 < found["below"] < 0.153


def test_a_temperature_that_is_set_between_runs(lmp):
    """Bonds beyond their limits of now are returned: the energies close, and stress falls with the limit."""
    text = sheared(more="compute press all pressure NULL pair fix\nfix tau all ave/time 5 60 300 c_press[4]")
    text = text.replace("custom step", "custom step f_tau")
    run = lmp(text + "thermo 300\nrun 600\nset group all temperature 534\nrun 300\n", 2).ok()
    before, after = run.thermo(0), run.thermo(1)
    assert np.abs(after["f_energy"]).max() < 3e-4 * after["f_energy[9]"][-1]
    assert after["f_tau"][-1] / before["f_tau"][-1] == pytest.approx(0.5, abs=0.1)


def test_it_warms_less_as_it_softens(lmp):
    """Conducted so fast that all are nearly as warm, (T - TREF)/(TMELT - TREF) = 1 - exp(-Q/(rho CP (TMELT - TREF))), Q the heat of the same shear without softening. A body
    that holds less stores less before it flows: 3 % more heat than in proportion."""
    theta = {}
    for heat in (SOFTEN, ""):
        table = lmp(sheared(heat, every=3, capacity=60.0, conductivity=1e6, gamma=0.0) + "thermo 1500\nrun 1500\n").ok().thermo()
        assert table["c_high"][-1] - table["c_mean"][-1] < 0.05 * (table["c_mean"][-1] - TREF)
        theta[heat] = (table["c_mean"][-1] - TREF) / (TMELT - TREF)
    assert theta[SOFTEN] == pytest.approx(1.0 - np.exp(-theta[""]), rel=0.035) and theta[""] > 0.15


def test_latent_heat(lmp):
    """No sphere is hotter than TMELT before its latent heat is used up; without it they are."""
    highest = {}
    for melt in ("melt 4e5", ""):
        run = lmp(sheared(f"{SOFTEN} {melt}", capacity=8.0, conductivity=1.0, every=10) + "thermo 100\nrun 1000\n" + LAST).ok()
        assert_closes(run)
        highest[melt] = run.thermo()["f_heat[6]"].max() / TMELT
    assert highest["melt 4e5"] <= 1.001 < highest[""]


# ---- others ----


def test_heat_flow_of_others(lmp):
    """A hot granular wall under a sphere that rests on it; the account has what it gave."""
    run = lmp(scene(box=PARTS["box"] + f"\n{PROPERTIES}set group all temperature 300", coeff=f"pair_coeff * * {words(law.TABLE1)} density 2700 capacity 900",
                    move="""fix heat all evp/heat every 7
fix wall all wall/gran granular hooke 1e5 0 tangential linear_nohistory 0 0 heat radius 20 zplane 0.0005 NULL temperature 600
compute T all property/atom temperature
compute high all reduce max c_T
compute flow all property/atom heatflow
compute sum all reduce sum c_flow""", step="timestep 1e-5", thermo=thermo(f"c_high c_sum {ENTRIES}"), run="thermo 1\nrun 70"), 2).ok()
    table = run.thermo()
    assert table["f_heat[2]"][-1] == pytest.approx(1e-5 * np.sum(table["c_sum"][1:]), rel=1e-9) and table["f_heat[2]"][-1] > 0.0
    assert np.abs(table["f_heat"]).max() <= 1e-9 * table["f_heat[2]"][-1] and table["c_high"][-1] > 300.0


@pytest.mark.parametrize("ranks, newton", [(1, "off"), (2, "off"), (3, "on")])
def test_ghosts_have_the_temperatures_of_their_atoms(lmp, lmp_decks, ranks, newton):
    """As pair granular reads them, whether fix property/atom sends them or not, also of temperatures that are set between runs."""
    way = "run 120\nset type 1 temperature 400\nrun 120\n"
    right = lmp(hot_on_cold("ghost yes", "on", more=way)).ok()
    decks = {(ghost, first): hot_on_cold(ghost, newton, first, way) for ghost in ("", "ghost yes") for first in ("evp/lj", "granular")}
    for name, run in lmp_decks(decks, ranks).items():
        for block in (0, 1):
            table, wanted = run.ok().thermo(block), right.thermo(block)
            assert abs(table["f_heat[2]"][-1]) < 1e-9, "what one plate loses the other takes"
            for column in ("c_below", "c_above"):
                assert table[column][-1] == pytest.approx(wanted[column][-1], abs=1e-6 if name[1] == "evp/lj" else 1e-2), (name, block, column)
    assert right.thermo(0)["c_below"][-1] > 293.05


@pytest.mark.parametrize("parts, texts", [
    ({"coeff": PARTS["coeff"] + " conductivity -1"}, ["conductivity must be positive, got -1"]),
    ({"coeff": PARTS["coeff"] + " capacity 0"}, ["capacity must be positive, got 0"]),
    ({"coeff": PARTS["coeff"] + " soften 293 293 1"}, ["soften_tmelt must lie above TREF = 293"]),
    ({"coeff": PARTS["coeff"] + " conductivity 100 density 2700"}, ["the row of the type of atom 1 lacks", "capacity CP"]),
    ({"coeff": PARTS["coeff"] + " conductivity 100 capacity 900"}, ["the row of the type of atom 1 lacks", "density RHO"]),
    ({"box": PARTS["box"]}, ["needs atoms with a temperature and a heat flow", "property/atom temperature heatflow"]),
    ({"box": HEAT["box"] + "\nvariable odd atom 300*exp(1000*(id==3))\nset group all temperature v_odd"}, ["the temperature of atom 3 is not set (zero), negative or not finite"]),
    ({"fix": "fix heat all evp/heat", "thermo": ""}, ["needs fix evp/bonds"]),
    ({"fix": HEAT["fix"] + "\nfix more all evp/heat"}, ["fix heat is of this style too"]),
    ({"fix": HEAT["fix"] + "\nfix flow all heat/flow constant 900"}, ["atom 1 is of a fix heat/flow too"]),
    ({"fix": PARTS["fix"] + "\nfix heat nobody evp/heat"}, ["Could not find fix group ID nobody"]),
    ({"fix": "region corner block INF 0.001 INF INF INF INF units box\nfix few all evaporate 1 1 corner 7\n" + HEAT["fix"]}, ["must be defined before fix few evaporate", "what heats them"]),
    ({"fix": HEAT["fix"] + " every 0"}, ["every must be an integer from 1 to 1e9", "got 0"]),
    ({"fix": HEAT["fix"] + " taylor 1.1"}, ["taylor must lie between 0 and 1", "got 1.1"]),
    ({"fix": HEAT["fix"] + " often 3"}, ["unknown keyword 'often'; it takes every and taylor"]),
    ({"step": "timestep 1", "fix": HEAT["fix"] + " every 1"}, ["above the largest stable thermal step", "use a smaller timestep"]),
    ({"style": "pair_style lj/cut 0.02", "coeff": "pair_coeff * * 1 0.01", "fix": "fix heat all evp/heat", "thermo": ""}, ["needs pair style evp/lj"]),
])
def test_what_it_refuses(lmp, parts, texts):
    refused(lmp(scene(**{**HEAT, **parts})), *texts)


def test_atoms_without_bonds(lmp):
    """They conduct nothing, and keep their temperature."""
    run = lmp(scene(**{**HEAT, "box": HEAT["box"].replace("lattice sc 0.0101", "lattice sc 0.02"), "move": "fix move all nve\n", "thermo": thermo(ENTRIES)})).ok()
    table = run.thermo()
    assert np.all(table["f_heat[6]"] == 300.0) and np.all(np.isinf(table["f_heat[7]"]))


def test_temperatures_that_are_set_are_not_in_the_account(lmp):
    """Nor is the latent heat that belongs to them: above TMELT, and back."""
    coeff = f"{HEAT['coeff']} soften 293 775 1 melt 4e5"
    run = lmp(scene(**{**HEAT, "coeff": coeff, "fix": f"{HEAT['fix']} every 7", "thermo": thermo(ENTRIES),
                       "run": "thermo 7\nset atom 1 temperature 900\nrun 14\nset atom 1 temperature 300\nrun 14"})).ok()
    for block in (0, 1):
        table = run.thermo(block)
        assert np.abs(table["f_heat"]).max() < 1e-9 and np.abs(table["f_heat[5]"]).max() < 1e-9
    assert run.thermo(0)["f_heat[6]"][-1] > 899.0


# ---- atoms that come later ----


STATE = "write_evp_bonds end.bonds\nwrite_dump all custom end.dump id c_T x y z modify sort id format float %.17g\n"


def means_of_neighbors(x, old, length):
    """Temperatures of two layers of new spheres, by the distances alone: the lower one first, of the plate, then the upper one, of the lower."""
    known = np.append(old, np.full(len(x) - len(old), np.nan))
    while np.any(np.isnan(known)):
        had = known.copy()
        for i in np.flatnonzero(np.isnan(had)):
            r = x - x[i]
            r[:, :2] -= length * np.round(r[:, :2] / length)
            near = (np.linalg.norm(r, axis=1) < 1.5 * 0.00707) & ~np.isnan(had)
            if np.any(near):
                known[i] = np.mean(had[near])
    return known


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (3, "on")])
def test_new_atoms_have_the_temperature_of_what_they_are_bonded_to(lmp, ranks, newton):
    """Layer by layer, also where a restart file lies between, and after others were deleted, whose places in the arrays they take; a limit that has softened. One
    that is given stays, by set and by a data file."""
    come = "run 0\n" + LAYER
    more = {"plain": come + "run 0\n" + STATE,
            "deleted": "run 0\ngroup gone id 1\ndelete_atoms group gone compress no\nwrite_restart more.rst\n" + LAYER + "run 0\n" + STATE,
            "given": come + "set region layer temperature 450\nrun 0\n" + STATE,
            "restart": come + "write_restart state.rst\n"}
    found = {}
    for name, text in more.items():
        run = lmp(plate(newton, more=text), ranks).ok()
        if name == "restart":
            run = lmp(plate(newton, start="state.rst", more="run 0\n" + STATE), 1 + ranks % 3).ok()
        found[name] = run.dump("end.dump")[-1]
    end = found["plain"]
    n = int(np.sum(end["z"] < 0.0055))
    assert set(end["c_T"][:n]) == {300.0, 600.0} and len(end["id"]) > n + 20
    assert end["c_T"] == pytest.approx(means_of_neighbors(end.x, end["c_T"][:n], np.array([0.06, 0.03])), rel=1e-12)
    assert found["restart"]["c_T"] == pytest.approx(end["c_T"], rel=1e-12)
    assert np.all(found["given"]["c_T"][n:] == 450.0) and np.all(found["given"]["c_T"][:n] == end["c_T"][:n])
    assert set(found["deleted"]["c_T"][: n - 1]) == {300.0, 600.0} and found["deleted"]["c_T"].min() == 300.0


def test_a_data_file_gives_temperatures_to_new_atoms(lmp):
    """Its section of fix property/atom, which LAMMPS reads before it tells fixes of the atoms."""
    lmp(plate(more="run 0\nset group all temperature 450\nwrite_data plate.data nocoeff\n")).ok()
    add = "read_data plate.data add append shift 0 0 0.012 fix temperature NULL temperature\n"
    end = lmp(plate(more="run 0\n" + add + "run 0\n" + STATE), 2).ok().dump("end.dump")[-1]
    old = len(end["id"]) // 2
    assert np.all(end["c_T"][old:] == 450.0) and set(end["c_T"][:old]) == {300.0, 600.0}


@pytest.mark.parametrize("ranks", [1, 3])
def test_atoms_that_come_during_a_run(lmp, tmp_path, ranks):
    """By fix deposit, onto the hot half; the account of heat has nothing of it."""
    (tmp_path / "ball.mol").write_text("# one\n\n1 atoms\n\nCoords\n\n1 0 0 0\n\nTypes\n\n1 1\n\nDiameters\n\n1 0.00707\n\nMasses\n\n1 6.754e-4\n", encoding="utf-8")
    deposit = """molecule ball ball.mol
region drop block 0.0400001 0.0400002 0.0150001 0.0150002 0.0118 0.0119 units box
fix drops all deposit 1 0 20 4711 region drop mol ball id next
fix move all nve/noforce
thermo 10
"""
    run = lmp(plate(more=deposit + thermo("atoms f_bonds f_heat f_heat[4]") + "run 40\n" + STATE), ranks).ok()
    end = run.dump("end.dump")[-1]
    assert end["c_T"][-1] == pytest.approx(600.0, abs=0.1) and end["id"][-1] == len(end["id"]) == run.thermo()["Atoms"][-1]
    assert run.thermo()["f_bonds"][-1] > run.thermo()["f_bonds"][0] and abs(run.thermo()["f_heat"][-1]) < 1e-9


@pytest.mark.parametrize("ranks", [1, 3])
@pytest.mark.parametrize("choices, text, said", [
    ({"temperature": ""}, "run 0\n", ["the temperature of atom 1 is not set (zero)", "use 'set ... temperature T'", "after read_restart"]),
    ({"temperature": "set region hot temperature 600"}, "minimize 0 1e-9 5 5\n", ["the temperature of atom 1 is not set (zero)"]),
    ({"new": "new no"}, "run 0\n" + LAYER + "run 0\n", ["came without a temperature", "use 'set ... temperature T' after it was created", "'new yes'"]),
    ({}, "run 0\n" + LAYER + "group new region layer\ndisplace_atoms new move 0 0 0.015 units box\nminimize 0 1e-9 5 5\n",
     ["came without a temperature", "no bond to an atom that has one"]),
], ids=["none", "some", "new no", "too far"])
def test_temperatures_that_nobody_gave(lmp, ranks, choices, text, said):
    run = lmp(plate(**choices, more=text), ranks)
    assert run.returncode == 1 and all(one in " ".join(run.stdout.split()) for one in said), run.stdout[-2000:]


def test_temperatures_that_a_restart_lost(lmp):
    """Fix property/atom with another ID knows nothing of them."""
    lmp(plate(more="run 0\nwrite_restart state.rst\n"), 2).ok()
    lost = plate(start="state.rst", more="run 0\n").replace("fix temperature all", "fix other all")
    refused(lmp(lost, 2), "the temperature of atom 1 is not set (zero)", "after read_restart define fix property/atom first, with the ID that it had")


def test_what_is_kept_is_shown_and_in_bond_files(lmp, tmp_path):
    """What each sphere of a body has of which half is hot, with rates."""
    state = "compute state all evp/state/atom limit_factor strain_rate latent_heat\ndump state all custom 300 state.dump id c_state[5] c_state[6] c_state[7]\n"
    two = "set group all temperature 300\ngroup odd id 1:99999:2\nset group odd temperature 500"
    run = lmp(sheared(group="nobody", temperature=two) + state + "run 300\nwrite_evp_bonds half.bonds\n", 2).ok()
    end, kept = run.dump("state.dump")[-1], read_pairs(tmp_path / "half.bonds")
    expected = np.where(end["id"] % 2 == 1, 1.0 - (500.0 - TREF) / (TMELT - TREF), 1.0 - (300.0 - TREF) / (TMELT - TREF))
    assert end["c_state[5]"] == pytest.approx(expected, rel=1e-4)
    for name, column in (("limit_factor", 5), ("strain_rate", 6), ("latent_heat", 7)):
        own = kept.column(name)
        assert [own[k] for k in end["id"]] == pytest.approx(end[f"c_state[{column}]"], rel=1e-4), name
    assert max(kept.column("strain_rate").values()) > 0.0, "control"


# ---- what goes, comes late, or is not a run ----


def test_defined_on_a_hot_body(lmp):
    """That has flowed: what bonds hold beyond their limits is plastic work, also where the fix goes and comes again."""
    text = sheared().replace("fix heat all evp/heat every 50\n", "").replace(ENTRIES, "")
    run = lmp(text + """thermo 100
run 600
set group all temperature 534
fix heat all evp/heat every 50
run 100
unfix heat
run 100
fix heat all evp/heat every 50
run 100
""", 2).ok()
    for block in (1, 2, 3):
        table = run.thermo(block)
        assert np.abs(table["f_energy"]).max() < 3e-4 * table["f_energy[9]"][-1]


@pytest.mark.parametrize("then", ['print "$(f_bonds[5])"', "run 20 pre no"])
def test_gone_between_runs(lmp, then):
    """Nobody calls it after that."""
    text = sheared(gamma=2e4, integrate="nve/evp").replace(ENTRIES, "")
    lmp(f"{text}run 20\nunfix heat\n{then}\n").ok()


@pytest.mark.parametrize("order", ["bonds first", "heat first"])
def test_another_fix_does_not_take_over_what_waits(lmp, order):
    """A fix of another ID after a restart, and one after unfix, whose accounts begin with nothing; in whatever order the two fixes are defined."""
    bonds, heat = "fix bonds all evp/bonds\n", "fix heat all evp/heat every 50\n"
    text = sheared() + "run 575\n"
    again = sheared(start="read_restart state.rst").replace(heat, "")
    if order == "heat first":
        text, again = (one.replace(heat, "").replace(bonds, heat + bonds) for one in (text, again.replace(bonds, bonds + heat)))
    else:
        again = again.replace(bonds, bonds + heat)
    lmp(text + "write_restart state.rst\n", 2).ok()
    waits = lmp(again + "run 0\n", 2).ok().thermo()
    assert waits["f_heat[4]"][0] > 0.0 and abs(waits["f_heat"][0]) < ACCOUNT * waits["f_heat[1]"][0]
    other = lmp(again.replace("fix heat", "fix warm").replace("f_heat", "f_warm") + "run 60\n", 2).ok().thermo()
    assert [other[f"f_warm[{k}]"][0] for k in (1, 2, 3, 4, 5)] == [0.0] * 5 and other["f_warm[1]"][-1] > 0.0
    assert abs(other["f_warm"][-1]) < ACCOUNT * other["f_warm[1]"][-1]
    undone = lmp(again + "run 10\nunfix heat\n" + heat + "run 60\n", 1).ok().thermo(-1)
    assert undone["f_heat[1]"][0] == undone["f_heat[4]"][0] == 0.0 and abs(undone["f_heat"][-1]) < ACCOUNT * undone["f_heat[1]"][-1]


def test_ghosts_that_are_others_between_runs(lmp):
    """More of them, for the restart file: nothing is brought home from these."""
    run = lmp(sheared() + f"run 60\n{LAST}comm_modify vel yes cutoff 0.022\nwrite_restart state.rst\n" + LAST).ok()
    ended = [line for line in run.stdout.splitlines() if line.startswith("ended:")]
    assert len(ended) == 2 and ended[0] == ended[1]


def test_values_of_atoms_follow_their_atoms(lmp, tmp_path):
    """Of atoms that hold their temperature, when others are deleted."""
    text = sheared(every=10, more="compute out cold reduce sum f_heat\ndump 1 all custom 50 out.dump id f_heat")
    text = text.replace("group nobody empty", "region cold block INF 0.012 INF INF INF INF\ngroup cold region cold\ngroup rest subtract all cold").replace("fix heat all", "fix heat rest")
    run = lmp(text + 'run 50\ngroup gone id 1:1000:7\ndelete_atoms group gone compress no\nprint "left: $(c_out:%.17g)"\n', 2).ok()
    end = run.dump("out.dump")[-1]
    left = float(next(line for line in run.stdout.splitlines() if line.startswith("left:")).split()[1])
    assert left == pytest.approx(end["f_heat"][end["id"] % 7 != 1].sum(), rel=1e-6) and abs(left) > 0.1


def test_rerun_has_no_time(lmp):
    """The heat flow of others is taken in runs only."""
    run = lmp(scene(**{**HEAT, "box": WIDE, "thermo": thermo(ENTRIES), "move": """fix move all nve
fix wall all wall/gran granular hooke 1e5 0 tangential linear_nohistory 0 0 heat radius 20 zplane -0.003 NULL temperature 600
dump 1 all custom 1 path.dump id x y z vx vy vz""", "run": "run 5\nrerun path.dump dump x y z vx vy vz"})).ok()
    given = run.thermo(0)["f_heat[2]"][-1]
    assert given > 0.0 and np.all(run.thermo(1)["f_heat[2]"] == given)


def test_rows_of_unlike_types(lmp):
    """Their heat keywords are not used, which is said where they differ."""
    two = HEAT["box"].replace("create_box 1", "create_box 2") + "\nset atom 1*6 type 2"
    said = "of the rows of types 1 2 are not used"
    run = lmp(scene(**{**HEAT, "box": two, "coeff": HEAT["coeff"]})).ok()
    assert said not in run.stdout
    run = lmp(scene(**{**HEAT, "box": two, "coeff": HEAT["coeff"] + f"\npair_coeff 1 2 {words(law.TABLE1)} conductivity 500"})).ok()
    assert run.stdout.count(said) == 1


def test_conduction_in_a_plane(lmp):
    """Fourier's law there too, between the second row of spheres from each end."""
    table = lmp(f"""units si
atom_style sphere
atom_modify map yes
dimension 2
boundary s p p
lattice sq 0.01
region bar block 0 12.1 0 6 -0.5 0.5
create_box 1 bar
create_atoms 1 region bar
set group all diameter 0.00999
set group all density $(2700*0.01^3/(PI/6*0.00999^3))
neighbor 0.0005 bin
region left block INF 0.011 INF INF INF INF units box
region right block 0.109 INF INF INF INF INF units box
group left region left
group right region right
group free subtract all left right
{PROPERTIES}set group all temperature 293
set group right temperature 393
pair_style evp/lj
pair_coeff * * {words(law.TABLE1)} density 2700 conductivity 237 capacity 900
fix bonds all evp/bonds
fix heat free evp/heat every 1
compute out left reduce sum f_heat
timestep 0.04
""" + thermo("c_out") + "thermo 400\nrun 4000\n").ok().thermo()
    flux = np.diff(table["c_out"])[-1] / (400 * 0.04)
    assert flux == pytest.approx(237 * 0.06 * 0.01 * 100 / 0.1, rel=1e-5)


def test_values_of_all_effects_reach_the_ghosts(lmp_decks):
    """Limit, plastic strain, openness and expansion are more than one exchange holds. Fixes may stand in any order."""
    deck = sheared(heat=f"{SOFTEN} expansion 2.4e-5 {TREF}", every=10, temperature=f"set group all temperature {TREF + 100.0}")
    volume = "fix volume all evp/volume 2000\n"
    assert deck.count(volume) == 1 and deck.count("fix move all nve\n") == 1
    later = deck.replace(volume, "").replace("fix move all nve\n", f"{volume}fix move all nve\n")
    runs = lmp_decks({"before heat": deck + "run 60\n", "after heat": later + "run 60\n"}, 2)
    one, other = (runs[name].thermo() for name in ("before heat", "after heat"))
    assert one["f_energy[9]"][-1] > 0.0, "control: it flows"
    for name, values in one.items():
        assert other[name] == pytest.approx(values, rel=1e-9, abs=1e-9 * np.abs(values).max()), name
