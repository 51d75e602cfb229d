# SPDX-License-Identifier: GPL-2.0-only
"""Rows with `damage` and `rupture`: spheres that fail by their plastic strain and their stress, soften, and part."""

import numpy as np
import pytest
from flowing import flow_words, read_pairs
from oracle import metal, volume
from small_bodies import dump, grips, head, mass_of, thermo, two_groups, velocities, words, write_body, write_two
from test_yield import DENSITY, DT, ENERGY, FLOW, KV, MOVE, PULL, ROW, STRESS, body_of, measures, style

STEPS = 400
DAMAGE = (0.004, 0.004, -1.5)
UF, GF = 6e-5, 400.0


def failing(damage=DAMAGE, rupture=f"{UF}"):
    """Words of a row."""
    return f" damage {' '.join(map(str, damage))} 0 0 rupture {rupture}"


VALUES = {"plastic_strain": "p", "omega": "omega", "damage": "damage", "opening": "opening", "stress_at_initiation": "stress_at",
          "triaxiality_at_update": "triaxiality"}


@pytest.mark.parametrize("contact, rupture, kv, ranks, newton", [
    ("none", f"{UF}", 0.0, 1, "on"), ("repulsive", f"energy {GF}", 0.0, 2, "off"), ("join 1.4", "0", 0.0, 4, "on"), ("none", "0.01", KV, 2, "on")])
def test_a_body_against_the_second_writing(lmp, tmp_path, contact, rupture, kv, ranks, newton):
    """Motion, omega, damage and the bonds that end of a body that is pulled apart, as tests/oracle has them. At initiation omega is 1: the sum over the
    updates of the growth of plastic strain around a sphere over the strain at failure at its triaxiality."""
    body, steps = body_of(), 200 if kv else STEPS  # with the volume energy no bond may end, nor a sphere be torn open
    write_body(tmp_path / "body.data", body)
    text = head(newton) + style(body, contact, kv, failing(rupture=rupture)) + PULL + f"fix move all nve\ntimestep {DT}\nthermo {steps}\n" + dump(every=steps)
    run = lmp(text + f"run {steps}\nwrite_evp_bonds end.bonds\n", ranks).ok()
    first, last = run.dump("all.dump")
    energy = None
    if kv:
        i, j = np.array(list(body.bonds)).T - 1
        rest = volume.at_rest(i, j, np.array(list(body.bonds.values())), ROW.alpha * (body.radius[i] + body.radius[j]), len(body.x))
        energy = metal.Volume(kv, rest, (ROW.m1 * ROW.n1 * ROW.e1 * measures(body)[1] / 18.0, 2.0 * ROW.xi_s))
    key, *number = rupture.split()
    fails = metal.Failure(DAMAGE, energy=float(number[0])) if number else metal.Failure(DAMAGE, float(key))
    own = metal.Metal(first.x, first.v, body.radius, mass_of(body.radius), ROW, body.bonds, DT, FLOW, contact=contact.split()[0], join=float((contact + " 1.2").split()[1]),
                      near=np.stack(np.triu_indices(len(body.x), 1), axis=1) if kv else None, condition=metal.Yield(STRESS, DENSITY), volume_energy=energy, fails=fails).run(steps)
    assert np.abs(last.x - own.x).max() < 1e-10 and np.abs(last.v - own.v).max() < 1e-7 * np.abs(own.v).max()
    pairs = read_pairs(tmp_path / "end.bonds")
    for name, attribute in VALUES.items():
        values, found = getattr(own, attribute), pairs.column(name)
        assert np.array([found[k] for k in sorted(found)]) == pytest.approx(values, rel=1e-6, abs=1e-8 * np.abs(values).max()), name
    assert (pairs.joined, pairs.ended) == (own.joined, own.ended)
    assert np.sum(own.omega >= 1.0) > 5 and (own.damage.max() > 0.2 if kv else np.sum(own.damage >= 1.0) > 5), "control"


MORE = failing(rupture="1e-3")


@pytest.mark.parametrize("ranks, newton, again", [(1, "on", "restart"), (2, "off", "file"), (4, "on", "restart"), (4, "off", "")])
def test_whatever_the_ranks_and_restarts(lmp, tmp_path, ranks, newton, again):
    """With joining and the volume energy: the same events on any number of ranks, with newton on and off, from a restart file of any step, and from text files."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    material = style(body, "join 1.4", KV, MORE)

    def ended(text, n, name):
        run = lmp(text, n).ok()
        return run.thermo(), read_pairs(tmp_path / name)

    table, pairs = ended(head("on") + material + PULL + ENERGY + MOVE + "run 295\nwrite_evp_bonds whole.bonds\n", 1, "whole.bonds")
    first = head(newton) + material + PULL + ENERGY + MOVE
    if not again:
        found, other = ended(first + "run 295\nwrite_evp_bonds other.bonds\n", ranks, "other.bonds")
    else:
        save = "write_restart half.restart\n" if again == "restart" else "write_data half.data nocoeff\nwrite_evp_bonds half.bonds\n"
        lmp(first + "run 83\n" + save, ranks).ok()
        start = "read_restart half.restart" if again == "restart" else "read_data half.data\nreset_timestep 83"
        bonds = material if again == "restart" else material.replace("evp/bonds", "evp/bonds file half.bonds")
        found, other = ended(head(newton, start=start) + bonds + ENERGY + MOVE + "run 212\nwrite_evp_bonds other.bonds\n", ranks, "other.bonds")
    for name in ("PotEng", "KinEng", "Pxx", "Pyz"):
        assert found[name][-1] == pytest.approx(table[name][-1], rel=1e-7, abs=1e-7 * np.abs(table[name]).max()), name
    assert other.bonds == pytest.approx(pairs.bonds, rel=1e-9) and (other.joined, other.ended, other.failed) == (pairs.joined, pairs.ended, pairs.failed)
    for name in VALUES:
        values = np.array(list(pairs.column(name).values()))
        assert other.column(name) == pytest.approx(pairs.column(name), rel=1e-6, abs=1e-9 * np.abs(values).max()), name
    assert pairs.joined > 0 and pairs.failed > 20 and 0.0 < np.mean(list(pairs.column("damage").values())) < 0.9, "control"


def test_rate_and_temperature(lmp, tmp_path):
    """D4 and D5 with fix evp/heat: omega of each sphere is the sum over the updates of the growth of plastic strain around it over the strain at failure at its
    triaxiality, rate and temperature of that update, to 1e-3; it is 1 where that has come to 1."""
    body, updates = body_of(), 16
    write_body(tmp_path / "body.data", body)
    d1, d2, d3, d4, d5, rate0, tref, tmelt = 0.005, 0.004, -1.5, 0.05, 0.8, 10.0, 293.0, 775.0
    heat = f" capacity 900 conductivity 100 soften {tref} {tmelt} 1 rate 0.01 {rate0} damage {d1} {d2} {d3} {d4} {d5} rupture 1"
    text = head("on") + "fix T all property/atom temperature heatflow ghost yes\nvariable warm atom 293+6000*x\nset group all temperature v_warm\n"
    text += style(body, more=heat) + "fix heat all evp/heat every 10\ncompute T all property/atom temperature\n" + PULL + f"fix move all nve\ntimestep {DT}\n"
    text += dump(every=10, columns="c_T") + "".join(f"run 10\nwrite_evp_bonds bonds.{k}\n" for k in range(updates))
    run = lmp(text, 2).ok()
    temperatures = {snapshot.step: snapshot["c_T"] for snapshot in run.dump("all.dump")}
    omega, before = np.zeros(len(body.x)), np.zeros(len(body.x))
    for k in range(updates):
        pairs = read_pairs(tmp_path / f"bonds.{k}")
        p, rate, triaxiality, found = (np.array([column[n] for n in sorted(column)]) for column in map(
            pairs.column, ("plastic_strain", "strain_rate", "triaxiality_at_update", "omega")))
        first, second = np.array(list(pairs.bonds)).T - 1
        around, count = p - before, np.ones_like(p)
        np.add.at(around, first, (p - before)[second]), np.add.at(around, second, (p - before)[first])
        np.add.at(count, first, 1), np.add.at(count, second, 1)
        warm = np.clip((temperatures[10 * k + 10] - tref) / (tmelt - tref), 0.0, 1.0)
        strain = (d1 + d2 * np.exp(d3 * np.minimum(triaxiality, 3.0))) * (1.0 + d4 * np.log(np.maximum(1.0, rate / rate0))) * (1.0 + d5 * warm)
        omega = np.minimum(1.0, omega + np.where(triaxiality > -1.0 / 3.0, around / count / strain, 0.0))
        before = p
    assert found == pytest.approx(omega, rel=1e-3, abs=1e-6)
    assert 5 < np.sum(omega == 1.0) < 75 and np.ptp(warm) > 0.4 and np.median(rate) > 3.0 * rate0, "control"


def test_far_from_failure_nothing_is_another_bit(lmp, tmp_path):
    body = body_of()
    write_body(tmp_path / "body.data", body)
    dumps = []
    for more in ("", failing((1e9, 0.0, 0.0))):
        text = head("on") + style(body, "join 1.4", KV, more) + PULL + f"fix move all nve\ntimestep {DT}\n" + dump(every=300)
        dumps.append(lmp(text + "run 300\n", 2).ok().dump("all.dump")[-1])
    assert np.array_equal(dumps[0].x, dumps[1].x) and np.array_equal(dumps[0].f, dumps[1].f)


GIVEN = "fix_modify bonds plastic_strain all 1\n"  # beyond the strain at failure in tension


@pytest.mark.parametrize("opening", ["0", "1e-6"])
def test_nothing_heals(lmp, tmp_path, opening):
    """A given strain far beyond that at failure parts spheres, by its opening too; neither another one nor another row brings them back, and a row without
    damage is an error."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    text = head("on") + style(body, "join 1.2", KV, failing(rupture=opening)) + GIVEN + ENERGY + MOVE + "run 20\n"
    later = style(body, "join 1.2", KV, failing((5.0, 0.0, 0.0), "1")).splitlines()[1]
    lmp(text + f"fix_modify bonds plastic_strain all 0\n{later}\nrun 20\nwrite_evp_bonds end.bonds\n", 2).ok()
    assert set(read_pairs(tmp_path / "end.bonds").column("damage").values()) == {1.0}
    run = lmp(text + later.partition(" damage")[0] + "\nrun 20\n", 2)
    assert run.returncode != 0 and "spheres have failed, which rows without damage would forget" in run.stdout


def test_a_failure_that_overflows(lmp, tmp_path):
    """D3 for which exp(D3 sigma*) is no number: nothing fails in compression."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    press = velocities("-600*(x-0.025)", "260*(y-0.02)", "260*(z-0.02)")
    text = head("on") + style(body, "none", KV, failing((0.1, 0.0, -1e4), "0")) + press + ENERGY + MOVE + f"run {STEPS}\nwrite_evp_bonds end.bonds\n"
    lmp(text, 2).ok()
    pairs = read_pairs(tmp_path / "end.bonds")
    assert max(pairs.column("damage").values()) == 0.0 and max(pairs.column("plastic_strain").values()) > 0.003


@pytest.mark.parametrize("given", [GIVEN, ""])
def test_contacts_hold_under_pressure_as_before(lmp, tmp_path, given):
    """Two spheres that have parted: their contact has the force of two that were never bonded, with its limit, and flows as theirs."""
    write_two(tmp_path / "body.data", 0.0101)
    row = f"{words(ROW)} density {DENSITY}{flow_words(FLOW)}{failing(rupture='0')}"
    forces = []
    for zone in ("", " zone 1.000001"):
        text = head(skin=0.002) + f"pair_style evp/lj contact repulsive plasticity isotropic\npair_coeff * * {row}\nfix bonds all evp/bonds{zone}\n"
        text += (given if not zone else GIVEN) + two_groups(10, -10) + "fix move all nve/noforce\ntimestep 1e-7\nthermo 10\nvariable f equal fx[2]\n" + thermo("v_f")
        forces.append(lmp(text + "run 500\n").ok().thermo()["v_f"])
    assert forces[1][-1] > 0.0 and np.ptp(forces[1][-10:]) < 0.2 * forces[1][-1], "control: it has flowed"
    assert (np.abs(forces[0][5:] - forces[1][5:]).max() < 1e-3 * forces[1][-1]) == (given != "")


def test_a_minimization_tells_that_damage_waits(lmp, tmp_path):
    body = body_of()
    write_body(tmp_path / "body.data", body)
    pull = grips(0.011, 0.039) + "fix hold grips setforce 0 0 0\nmin_modify dmax 1e-5\n"
    step = "displace_atoms all ramp x -0.0005 0.0005 x 0 0.05 units box\nminimize 0 1e-3 3000 3000\n"
    run = lmp(head("on") + style(body, "none", 0.0, failing(rupture="0")) + pull + 6 * step + "write_evp_bonds end.bonds\n").ok()
    told = [line for line in run.warnings() if "spheres begin to fail in a minimization, in which damage does not move on: use a run in time" in line]
    pairs = read_pairs(tmp_path / "end.bonds")
    assert len(told) == 1 and max(pairs.column("omega").values()) == 1.0 and set(pairs.column("damage").values()) == {0.0} and pairs.failed == 0


def test_what_acts_is_told(lmp, tmp_path):
    body = body_of()
    write_body(tmp_path / "body.data", body)

    def told(text):
        return next(line for line in lmp(head("on") + text + "run 0\n").ok().stdout.splitlines() if line.startswith("evp/lj:"))

    assert "spheres fail by the damage of their row" in told(style(body, more=failing()))
    assert "inactive without fix evp/heat: rate, D4 of damage" in told(style(body, more=" rate 0.01 1" + failing().replace(" 0 0 rupture", " 0.1 0 rupture")))
    assert "fail by" not in told(style(body)) and "inactive without plasticity isotropic: yield, damage" in told(style(body, more=failing()).replace("isotropic", "none"))
