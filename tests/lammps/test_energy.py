# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/energy: every entry against a closed form or a sum over all pairs, and that the ledger closes."""

import itertools
import re

import numpy as np
import pytest
from lammps_run import thermo_blocks
from oracle import brute, law
from small_bodies import ENTRIES, dump, energies, head, mass_of, pair, thermo, two_groups, write_two

# Sums over some hundred atoms and steps of terms that are rounded to 1e-16 and cancel.
CLOSED = 1e-11


def ledger(every, more=""):
    return f"fix energy all evp/energy\nthermo {every}\n" + thermo(f"time dt f_energy f_energy[*] {more}")


# ---- closed forms ----

MASS = mass_of(0.005)
DEQ = 0.011


def two_bodies(lmp, tmp_path, row, left, right, motion, step, steps, every):
    write_two(tmp_path / "body.data", DEQ)
    text = head(skin=0.002) + pair(row) + two_groups(left, right) + motion + ledger(every)
    return lmp(text + f"timestep {step:.17g}\nrun {steps}\n").ok().thermo()


@pytest.mark.parametrize("style, share", [("nve", 1e-4), ("nve/evp tol 1e-12", 1.0)])
def test_damping_takes_the_kinetic_energy(lmp, tmp_path, style, share):
    """e = 0: what two bodies lose is what gamma takes, exactly, at any step; explicitly and at small h it is that of
    exp(-gamma t/mu), and implicitly that of (1 + h)^-n, the two half steps taken apart."""
    gamma, speed, mu = 10.0, 1e-3, 0.5 * MASS
    h, n = (share, 8000) if style == "nve" else (share, 8)
    row = law.TABLE1._replace(e1=0.0, e2=0.0, gamma=gamma)
    table = two_bodies(lmp, tmp_path, row, -speed, speed, f"fix move all {style}\n", h * mu / gamma, n, n)
    found, start = energies(table), 0.5 * mu * (2.0 * speed) ** 2
    assert abs(found["open"]) < CLOSED * start
    assert found["dissipated"] == pytest.approx(-found["kinetic"], rel=CLOSED)
    if style == "nve":
        left = np.exp(-2.0 * gamma * table["Time"][-1] / mu)
        assert found["dissipated"] / start == pytest.approx(1.0 - left, abs=4.0 * h)
    else:
        # v+ = v0 (1 + h)^-n/(1 + h/2) from v- = (1 + h) v+: atoms hold v0 (1 + h)^-n between steps
        assert found["kinetic"] / start == pytest.approx((1.0 + h) ** (-2.0 * n) - 1.0, rel=1e-9)


def test_stored_has_its_digits_at_tiny_strains(lmp, body):
    """Strains near 1e-10: what bonds store, to 1e-9 of it, at the strains d * (1/deq) - 1 of which forces are made. Then the
    body flies on, through neighbor builds and over ranks: no bond is lost, and 5 kJ of depth in another order are no noise."""
    run = lmp(head("off", "p s s") + pair(law.TABLE1, "none", "fix bonds all evp/bonds zone 1.48") + """
fix move all nve
timestep 2e-7
variable vx atom 5e-7*sin(1.1*id)
variable vy atom 5e-7*cos(2.3*id)
velocity all set v_vx v_vy 0
compute pairs all pair/local dist p1 p3
dump pairs all local 40 pairs.dump c_pairs[1] c_pairs[2] c_pairs[3]
dump_modify pairs format float %.17g
""" + ledger(40, "f_bonds") + "run 20\nrun 20\nvelocity all set 300 0 0 sum yes\nrun 400\n", 2).ok()
    snapshot = next(each for each in run.dump("pairs.dump") if each.step == 40)
    d, deq, regime = (snapshot[f"c_pairs[{k}]"] for k in (1, 2, 3))
    d, deq = d[regime > 0.0], deq[regime > 0.0]
    assert len(d) == run.thermo(1)["f_bonds"][-1], "each bond once"
    assert 1e-11 < np.abs(d / deq - 1.0).max() < 1e-9, "control"
    found, moved = energies(run.thermo(1)), energies(run.thermo(2))
    assert found["first"] == pytest.approx(np.sum(law.stored(d * (1.0 / deq), 1.0, law.TABLE1)[0]), rel=1e-9, abs=0.0)
    assert found["second"] == found["lost"] == 0.0
    assert abs(moved["lost"]) < 1e-20


@pytest.mark.parametrize("style", ["nve", "nve/evp"])
def test_gravity_is_work_of_others(lmp, tmp_path, style):
    """A body that falls without deforming: m g h, all of it kinetic."""
    motion = f"fix move all {style}\nfix fall all addforce {-9.81 * MASS:.17g} 0 0\n"
    found = energies(two_bodies(lmp, tmp_path, law.TABLE1, 0.0, 0.0, motion, 1e-6, 1000, 1000))
    work = 2.0 * MASS * 9.81 * 0.5 * 9.81 * 1e-6
    assert found["others"] == pytest.approx(work, rel=1e-9)
    assert found["kinetic"] == pytest.approx(work, rel=1e-9)
    assert abs(found["open"]) < 1e-9 * work


# ---- sums over all pairs, ranks, order of the step ----

STIR = ("variable vx atom 2+8000*(x-0.04)+5*sin(1.1*id)\nvariable vy atom 5*cos(2.3*id)\nvariable vz atom 5*sin(3.7*id+1)\n"
        "velocity all set v_vx v_vy v_vz\n")


def stirred(style, gamma, step, steps, newton, force="0 0 0"):
    row = law.TABLE1._replace(gamma=gamma)
    return (head(newton, "s s s") + pair(row, "literal", "fix bonds all evp/bonds zone 1.48") + STIR
            + f"fix move all {style}\nfix push all addforce {force}\n" + ledger(steps, "f_bonds[1] f_bonds[2] f_bonds[3]")
            + dump(every=steps) + f"timestep {step}\nrun {steps}\n")


@pytest.mark.parametrize("style, gamma, step", [("nve", 100.0, 1e-7), ("nve/evp tol 1e-12", 1000.0, 2e-7)])
def test_entries_are_sums_over_all_pairs(lmp, body, style, gamma, step):
    """Control: bonds in both regimes, bonds lost and new pairs."""
    run = lmp(stirred(style, gamma, step, 100, "off", "30 0 0"), 2).ok()
    found, last = energies(run.thermo()), run.dump("all.dump")[-1]
    scale = max(abs(value) for value in found.values())
    row, x, bonds = law.TABLE1, last.vectors("x", "y", "z"), brute.record_bonds(body.x, body.radius, 1.48)
    zero = 0.0 * x
    now = brute.brute_force(x, zero, body.radius, body.types, row, bonds, "literal")
    is_bond = np.array([(a + 1, b + 1) in bonds for a, b in zip(now["i"], now["j"])])
    d, deq = now["d"][is_bond], now["deq"][is_bond]
    first = law.energy(np.clip(d, 0.995 * deq, 1.005 * deq), deq, row, deq)
    # the trade of a lost bond is its depth
    dlim = {(i, j): 1.5 * (body.radius[i - 1] + body.radius[j - 1]) for i, j in bonds}
    depths = sum(law.energy(dlim[key], value, row, value) for key, value in bonds.items())
    there = sum(law.energy(dlim[i + 1, j + 1], value, row, value) for i, j, value in zip(now["i"][is_bond], now["j"][is_bond], deq))
    start = brute.brute_force(body.x, zero, body.radius, body.types, row, bonds, "literal")
    was_bond = np.array([(a + 1, b + 1) in bonds for a, b in zip(start["i"], start["j"])])
    expected = {"first": first.sum(), "second": (law.energy(d, deq, row, deq) - first).sum(), "lost": depths - there,
                "contacts": now["pair_energy"][~is_bond].sum() - start["pair_energy"][~was_bond].sum()}
    assert (~is_bond).sum() > 0 and depths > there and now["bonds_second"] > 20
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, abs=1e-8 * scale), name


@pytest.mark.parametrize("style, gamma, ranks, newton", [("nve", 100.0, 2, "off"), ("nve/evp tol 1e-12", 1000.0, 1, "on")])
def test_forces_kept_apart_or_not(lmp_decks, body, style, gamma, ranks, newton):
    """A fix that may add forces has those of the pairs kept apart; one that adds none changes no entry."""
    text = stirred(style, gamma, 1e-7, 60, newton)
    text = text.replace("fix move all", "group held id 1:20\ngroup free subtract all held\nfix hold held nve/noforce\nfix move free")
    runs = lmp_decks({"apart": text, "together": re.sub(r"fix push.*\n", "", text)}, ranks)
    apart, together = (energies(run.thermo()) for run in runs.values())
    scale = max(abs(value) for value in apart.values())
    assert abs(apart["movers"]) > 1e-3 * scale and apart["dissipated"] > 1e-3 * scale, "control"
    assert abs(apart["others"]) < CLOSED * scale and together["others"] == 0.0
    assert all(abs(apart[name] - together[name]) < CLOSED * scale for name in ENTRIES)


# ---- any order of fixes, set-ups, timestep sizes ----

SHAKE = "variable vx atom 3*sin(1.1*id)\nvariable vy atom 2*cos(2.3*id)\nvelocity all set v_vx v_vy 0\nvariable start equal $(ke(all):%.17g)\n"
FIXES = {"move": "fix move all {style}", "dt": "fix dt all dt/evp 7 0.35", "energy": "fix energy all evp/energy"}
SHARE = 1e-3  # of the kinetic energy: the demand


@pytest.mark.parametrize("style", ["nve", "nve/evp tol 1e-12"])
@pytest.mark.parametrize("before", ["", "run 0\n", "timestep 3e-7\nrun 0\n"])
def test_order_of_fixes_and_set_ups_change_nothing(lmp, body, style, before):
    """Damping takes all the energy that the velocities had: no more, though a kick of the first half step is undone at once. With the
    ledger between or before the others it was off by up to 3000 times that energy."""
    decks = []
    for order in itertools.permutations(FIXES):
        text = head(boundary="s s s") + pair(law.TABLE2, "repulsive") + SHAKE + "".join(FIXES[name].format(style=style) + "\n" for name in order)
        text += "thermo 20\n" + thermo("time dt ke f_energy f_energy[*] v_start") + before
        decks.append(text + f"run 60\ntimestep 4e-8\nrun 40\nunfix dt\ntimestep {'2e-8' if style == 'nve' else '9e-6'}\nrun 20\n")
    tables, ends = thermo_blocks(lmp("clear\n".join(decks)).ok().stdout), []
    for order, *own in zip(itertools.permutations(FIXES), *(tables[k::len(tables) // len(decks)] for k in range(len(tables) // len(decks)))):
        start = own[-1]["v_start"][0]
        for table in own[-3:]:
            assert np.abs(table["f_energy"]).max() < SHARE * start, order
            assert table["f_energy[1]"] == pytest.approx(table["KinEng"] - start, abs=CLOSED * start), "of the atoms' velocities"
            assert np.all(np.diff(table["f_energy[6]"]) >= 0.0)
        ends.append(energies(own[-1]))
        assert ends[-1]["dissipated"] < start * (1.0 + SHARE)
    assert len(ends) == 6 and ends[0]["dissipated"] > 0.5 * start, "control"
    for other in ends[1:]:
        assert all(abs(other[name] - ends[0][name]) < 1e-6 * start for name in ENTRIES)
