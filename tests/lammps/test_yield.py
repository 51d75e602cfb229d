# SPDX-License-Identifier: GPL-2.0-only
"""Rows with `yield`: spheres that flow at the flow stress of their row, and the volume energy that takes over what bonds no longer carry."""

import numpy as np
import pytest
from evp import law
from flowing import flow_words, read_pairs
from lammps_run import REFERENCE
from oracle import metal, volume
from small_bodies import dump, head, lattice_body, mass_of, thermo, velocities, words, write_body

ROW = law.TABLE1._replace(xi_s=0.002)
FLOW = (0, 1, 0.02, 1.4, 0.2, 1.8)
STRESS, DENSITY, KV = 8e6, 1410.0, 500.0
DT, STEPS = 3e-7, 300
PULL = velocities("150*(x-0.025)+40*sin(5.1*id)", "-60*(y-0.02)+40*cos(7.3*id)", "-90*(z-0.02)+40*sin(2.7*id)")


def body_of():
    """One type, as spacing and coordination are measured by types."""
    body = lattice_body((5, 4, 4))
    return body._replace(types=np.ones_like(body.types))


def measures(body):
    """Spacing and coordination, of the body itself: nothing is scaled."""
    return float(np.mean(list(body.bonds.values()))), 2.0 * len(body.bonds) / len(body.x)


def row_words(body, more=""):
    spacing, coordination = measures(body)
    return f"{words(ROW)} spacing {spacing:.17g} coordination {coordination:.17g} density {DENSITY} yield {STRESS}{flow_words(FLOW)}{more}"


def style(body, contact="none", kv=0.0, more=""):
    text = f"pair_style evp/lj contact {contact} plasticity isotropic\npair_coeff * * {row_words(body)}{more}\nfix bonds all evp/bonds\n"
    return text + (f"fix volume all evp/volume {kv}\n" if kv else "")


VALUES = "plastic_strain yield_factor equivalent_stress equivalent_stress_around".split()


@pytest.mark.parametrize("contact, kv, ranks, newton", [("none", 0.0, 1, "on"), ("none", KV, 2, "off"), ("join 1.4", 0.0, 4, "on"), ("none", KV, 4, "on")])
def test_a_body_against_the_second_writing(lmp, tmp_path, contact, kv, ranks, newton):
    """Motion, plastic strains, factors and stresses of a body that is pulled, with the volume energy and what it takes over, as tests/oracle has them."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    text = head(newton) + style(body, contact, kv) + PULL + f"fix move all nve\ntimestep {DT}\nthermo {STEPS}\n" + dump(every=STEPS)
    run = lmp(text + f"run {STEPS}\nwrite_evp_bonds end.bonds\n", ranks).ok()
    first, last = run.dump("all.dump")
    condition = metal.Yield(STRESS, DENSITY)
    energy = None
    if kv:
        i, j = np.array(list(body.bonds)).T - 1
        rest = volume.at_rest(i, j, np.array(list(body.bonds.values())), ROW.alpha * (body.radius[i] + body.radius[j]), len(body.x))
        bulk = ROW.m1 * ROW.n1 * ROW.e1 * measures(body)[1] / 18.0
        energy = metal.Volume(kv, rest, (bulk, 2.0 * ROW.xi_s))
    own = metal.Metal(first.x, first.v, body.radius, mass_of(body.radius), ROW, body.bonds, DT, FLOW, contact=contact.split()[0], join=float((contact + " 1.2").split()[1]),
                      near=np.stack(np.triu_indices(len(body.x), 1), axis=1) if kv else None, condition=condition, volume_energy=energy).run(STEPS)
    assert np.abs(last.x - own.x).max() < 1e-10 and np.abs(last.v - own.v).max() < 1e-7 * np.abs(own.v).max()
    pairs = read_pairs(tmp_path / "end.bonds")
    for name, values in zip(VALUES, (own.p, own.factor, own.along, own.mean_stress)):
        found = pairs.column(name)
        assert np.array([found[k] for k in sorted(found)]) == pytest.approx(values, rel=1e-6, abs=1e-8 * np.abs(values).max()), name
    assert pairs.joined == own.joined and pairs.ended == own.ended
    assert own.p.max() > 0.01 and np.ptp(own.factor) > 0.02, "control"
    assert not kv or abs(own.by_volume.theta).max() > 3.0 * 2.0 * ROW.xi_s, "control: bonds have yielded under pressure"


MOVE = f"fix move all nve\ntimestep {DT}\nthermo 10\n" + thermo("pe ke pxx pyz f_bonds f_bonds[5] f_bonds[6] f_volume f_energy")
ENERGY = "fix energy all evp/energy\n"


@pytest.mark.parametrize("ranks, newton, again", [(1, "on", "restart"), (2, "off", "file"), (4, "on", "restart"), (4, "off", "")])
def test_whatever_the_ranks_and_restarts(lmp, tmp_path, ranks, newton, again):
    """With joining and the volume energy: the same on any number of ranks, with newton on and off, from a restart file of any step, and from text files."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    material = style(body, "join 1.4", KV)

    def ended(text, n, name):
        run = lmp(text, n).ok()
        return run.thermo(), read_pairs(tmp_path / name)

    whole = head("on") + material + PULL + ENERGY + MOVE + "run 295\nwrite_evp_bonds whole.bonds\n"
    table, pairs = ended(whole, 1, "whole.bonds")
    first = head(newton) + material + PULL + ENERGY + MOVE
    if not again:
        found, other = ended(first + "run 295\nwrite_evp_bonds other.bonds\n", ranks, "other.bonds")
    else:
        save = "write_restart half.restart\n" if again == "restart" else "write_data half.data nocoeff\nwrite_evp_bonds half.bonds\n"
        lmp(first + "run 157\n" + save, ranks).ok()
        start = "read_restart half.restart" if again == "restart" else "read_data half.data\nreset_timestep 157"
        bonds = material if again == "restart" else material.replace("evp/bonds", "evp/bonds file half.bonds")
        found, other = ended(head(newton, start=start) + bonds + ENERGY + MOVE + "run 138\nwrite_evp_bonds other.bonds\n", ranks, "other.bonds")
    for name in ("PotEng", "KinEng", "Pxx", "Pyz", "f_bonds[6]"):
        assert found[name][-1] == pytest.approx(table[name][-1], rel=1e-9, abs=1e-9 * np.abs(table[name]).max()), name
    assert other.bonds == pytest.approx(pairs.bonds, rel=1e-9)
    for name in VALUES:
        assert other.column(name) == pytest.approx(pairs.column(name), rel=1e-8, abs=1e-9 * STRESS), name
    assert pairs.joined > 3 and np.ptp(list(pairs.column("yield_factor").values())) > 0.02, "control"


@pytest.mark.parametrize("change, wanted", [
    (lambda text: text.replace(f" density {DENSITY}", ""), "yield needs density, which says what stress a force of spheres is"),
    (lambda text: text.replace(" spacing", " kv 5 flow 0 1 # spacing"), "yield needs density"),
    (lambda text: text.replace(f"yield {STRESS}", "yield -1"), "yield must be positive")])
def test_what_it_refuses(lmp, tmp_path, change, wanted):
    body = body_of()
    write_body(tmp_path / "body.data", body)
    words = row_words(body)
    changed = change(words) if "#" not in change(words) else f"{words.split(' spacing')[0]} density {DENSITY} yield {STRESS}"
    run = lmp(head("on") + style(body).replace(words, changed) + "run 0\n")
    assert run.returncode != 0 and wanted in run.stdout


def test_what_acts_is_told(lmp, tmp_path):
    body = body_of()
    write_body(tmp_path / "body.data", body)

    def told(text):
        return next(line for line in lmp(head("on") + text + "run 0\n").ok().stdout.splitlines() if line.startswith("evp/lj:"))

    assert "spheres flow at the flow stress of their row (under pressure their bonds flow too: no fix evp/volume row)" in told(style(body))
    with_volume = told(style(body, kv=KV))
    assert "spheres flow at the flow stress of their row," in with_volume and "takes over the pressure at which bonds yield" in with_volume
    assert "inactive without plasticity isotropic: yield" in told(style(body).replace("isotropic", "none"))


def test_outside_the_group_of_the_volume_energy_nothing_is_taken_over(lmp, tmp_path):
    """Spheres outside it have no volume energy, whatever the pressure."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    half = f"region half block INF 0.025 INF INF INF INF\ngroup half region half\nfix volume half evp/volume {KV}\ngroup rest subtract all half\n"
    press = velocities("-300*(x-0.025)", "-300*(y-0.02)", "-300*(z-0.02)")
    sums = "compute own all pe/atom fix\ncompute rest rest reduce sum c_own\ncompute half half reduce sum c_own\n"
    text = head("on") + style(body) + half + press + ENERGY + MOVE + sums + thermo("ke f_volume[2] f_energy c_rest c_half") + "run 300\n"
    table = lmp(text, 2).ok().thermo()
    assert np.abs(table["f_energy"]).max() < 1e-3 * table["KinEng"][0]
    assert np.all(table["c_rest"] == 0.0) and table["c_half"].max() > 0.0
    assert table["f_volume[2]"].min() < -2.0 * ROW.xi_s, "control: bonds have yielded under pressure"


@pytest.mark.parametrize("cavitation", [1.5 * ROW.xi_s, "none"])
def test_energy_where_cavities_open_below_the_yield_of_bonds(lmp, tmp_path, cavitation):
    body = body_of()
    write_body(tmp_path / "body.data", body)
    pull = velocities("700*(x-0.025)", "700*(y-0.02)", "700*(z-0.02)")
    volume = f"fix volume all evp/volume {KV} cavitation {cavitation}\n"
    table = lmp(head("on") + style(body) + volume + pull + ENERGY + MOVE + thermo("ke f_volume[3] f_energy") + "run 300\n").ok().thermo()
    assert np.abs(table["f_energy"]).max() < 1e-3 * table["KinEng"][0]
    assert table["f_volume[3]"].max() > 4.0 * ROW.xi_s, "control"


def test_spheres_of_a_type_without_a_row_gather_plastic_strain(lmp, tmp_path):
    """Bonds with them hold by the row of the other type."""
    body = lattice_body((5, 4, 4))
    write_body(tmp_path / "body.data", body)
    row = row_words(body_of())
    text = head("on") + "pair_style hybrid evp/lj contact none plasticity isotropic zero 0.01\n"
    text += f"pair_coeff 1 1 evp/lj {row}\npair_coeff 1 2 evp/lj {row}\npair_coeff 2 2 zero\nfix bonds all evp/bonds\n"
    text += PULL + f"fix move all nve\ntimestep {DT}\ncompute own all evp/state/atom plastic_strain\ngroup one type 1\ngroup two type 2\n"
    text += "".join(f"compute {name} {name} reduce ave c_own[5]\n" for name in ("one", "two")) + thermo("c_one c_two") + f"thermo {STEPS}\nrun {STEPS}\n"
    table = lmp(text).ok().thermo()
    assert table["c_two"][-1] > 0.5 * table["c_one"][-1] > 0.01


def test_the_quasistatic_deck_gives_the_mass_of_the_solid(lmp, tmp_path):
    """Stresses of spheres are forces over their share of the solid, which is a mass over a density, also where nothing moves."""
    (tmp_path / "also.lmp").write_text('print "solid: $(mass(all)/v_volume/v_row_density)"\n', encoding="utf-8")
    row = f"{words(ROW)} spacing 0.0055 coordination 12 density 7900 yield {STRESS}"
    run = lmp("in.quasistatic", variables={"specimen": REFERENCE, "coeff": row, "plasticity": "isotropic", "contact": "join", "strain": 0.0005, "also": "also.lmp"}).ok()
    assert [float(line.split()[1]) for line in run.stdout.splitlines() if line.startswith("solid:")] == pytest.approx([1.0, 1.0], rel=1e-6)


def test_a_restart_file_after_a_minimization(lmp, tmp_path):
    """At its end the limits move, and stresses are those of the forces after that, which only the next run computes."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    material, more = style(body, "join 1.4", KV), PULL + "run 143\nwrite_evp_bonds end.bonds\n"
    text = head("on") + material + PULL + ENERGY + MOVE + "run 157\nvelocity all set 0 0 0\nmin_modify dmax 1e-5\nminimize 0 1 20000 20000\nwrite_restart half.restart\n"
    whole = lmp(text + more, 2).ok().thermo()
    pairs = read_pairs(tmp_path / "end.bonds")
    found = lmp(head("off", start="read_restart half.restart") + material + ENERGY + MOVE + more).ok().thermo()
    for name in ("PotEng", "KinEng", "Pxx"):
        assert found[name][-1] == pytest.approx(whole[name][-1], rel=1e-9), name
    for name in VALUES:
        assert read_pairs(tmp_path / "end.bonds").column(name) == pytest.approx(pairs.column(name), rel=1e-8, abs=1e-9 * STRESS), name
