# SPDX-License-Identifier: GPL-2.0-only
"""Limits of the timestep, c_ID[1] to c_ID[5] of compute evp/dt, with damping and with fix evp/volume: against matrices in a dense eigensolver, and by
running across them. A run is judged by its energy: 'finite' is not 'stable'."""

import re

import numpy as np
import pytest
from evp import law
from lammps_run import REFERENCE, write_state
from oracle import brute, network, volume
from small_bodies import head, lattice_body, mass_of, pair, thermo, velocities, words, write_body, write_two

SETTLED = 2e-4  # Lanczos stops at 1e-4 of an eigenvalue, which it takes from below: half of it in the step
ITERATED = 1e-3  # the explicit step iterates to 1e-3 of its eigenvalue
LIMITS = "compute dt all evp/dt\n" + thermo("c_dt c_dt[*]") + "run 0\n"


def matrices(x, body, row, contact="none", kv=0.0):
    """Dense M^-1/2 A M^-1/2 of K and C of all atoms as compute evp/dt defines them: stiffness never below that at rest, tension across, and the
    volume energy whole (with contact none): kv/G^2 b b^T of each atom, b by the density, and the curvature of t^2 where it is compressed.
    Where an atom with a gap is compressed: by the density of the bonds until it is full, and by all of it from there on."""
    free, n = np.ones(len(x), dtype=bool), len(x)
    half = np.repeat(1.0 / np.sqrt(mass_of(body.radius)), 3)
    pairs, deq, _, _, rows = brute.interactions(x, body.radius, row, body.bonds, contact, body.types)
    axial, across = network.pair_stiffness(pairs.d, deq, rows)
    of_volume = np.zeros((3 * n, 3 * n))
    if kv:
        i, j = np.array(list(body.bonds)).T - 1
        rest = volume.at_rest(i, j, np.array(list(body.bonds.values())), row.alpha * (body.radius[i] + body.radius[j]), n, body.types)
        near = brute.find_pairs(x, body.radius, row.alpha)
        dlim = row.alpha * near.contact_distance
        fresh = np.array([two not in body.bonds for two in zip((near.i + 1).tolist(), (near.j + 1).tolist())])
        pull = -volume.evaluate(x, near.i, near.j, dlim, kv, rest, fresh=fresh).pair_force
        order = [{two: k for k, two in enumerate(zip(near.i.tolist(), near.j.tolist()))}[two] for two in zip(pairs.i.tolist(), pairs.j.tolist())]
        opening, own = 2.0 * (1.0 - near.d / dlim) / dlim, np.zeros((2, len(near.i)))
        own[0, order], own[1, order] = axial, -law.force(pairs.d, deq, rows)
        curved = np.divide(-pull, opening, out=np.zeros(len(pull)), where=opening > 0.0) * 2.0 / dlim**2
        near_axial, near_across = own[0] + np.maximum(0.0, curved), np.maximum(0.0, (own[1] + pull) / near.d)
        slope, b = opening[:, None] * near.r / near.d[:, None], np.zeros((2, n, 3 * n))
        for p, (a, c) in enumerate(zip(near.i, near.j)):
            for centre, of in ((a, 0), (c, 0), (a, 1), (c, 1))[: 2 if fresh[p] else 4]:
                b[of, centre, 3 * a:3 * a + 3] += slope[p]
                b[of, centre, 3 * c:3 * c + 3] -= slope[p]
        squares = (1.0 - near.d / dlim)**2
        rho, bonded = (sum(np.bincount(atoms, of_pair, n) for atoms in (near.i, near.j)) for of_pair in (squares, np.where(fresh, 0.0, squares)))
        closing = (rho > rest.rho) & (rest.gap > 0.0)
        whole, alone = ~closing | (rho > rest.rho + rest.gap), closing & (bonded <= rest.rho + rest.gap)
        of_volume = sum(one.T @ ((kv * acts / rest.slope**2)[:, None] * one) for one, acts in zip(b, (whole, alone)))
    scale = half[:, None] * half[None, :]
    stiff = network.assemble(near if kv else pairs, near_axial if kv else axial, near_across if kv else across, free).toarray() + of_volume
    return stiff * scale, network.assemble(pairs, rows.gamma, np.zeros_like(axial), free).toarray() * scale


def largest(matrix):
    return np.linalg.eigvalsh(matrix)[-1]


def stretched(folder, stretch):
    body = lattice_body((4, 3, 3))
    write_body(folder / "body.data", body)
    x = body.x * [1.0 + stretch, 1.0 - 0.25 * stretch, 1.0 - 0.25 * stretch]
    write_state(folder / "state.dump", x, 0.0 * x, body.box)
    return body, x


def limits_deck(rows, contact="none", kv=0.0, style="nve", newton="on"):
    """Rows: one for all, or by types."""
    by_types = rows if isinstance(rows, dict) else {(1, 1): rows, (1, 2): rows, (2, 2): rows}
    text = head(newton) + pair(law.TABLE1, contact) + "".join(f"pair_coeff {a} {b} {words(row)}\n" for (a, b), row in by_types.items())
    text += (f"fix volume all evp/volume {kv}\n" if kv else "") + f"fix move all {style}\n"
    return text + "run 0\nread_dump state.dump 0 x y z vx vy vz box no replace yes\n" + LIMITS


def last(run):
    return {name: values[-1] for name, values in run.thermo().items()}


@pytest.mark.parametrize("stretch", [0.0, 0.04, -0.04])
def test_explicit_limits_are_those_of_the_matrices(lmp_decks, tmp_path, stretch):
    """With fix evp/volume: the largest eigenvalue with the many-body term whole; row sums never above. Control: the term matters."""
    kv, rows = 3000.0, {gamma: law.TABLE1._replace(gamma=gamma) for gamma in (0.0, 300.0)}
    body, x = stretched(tmp_path, stretch)
    plain = last(lmp_decks({"": limits_deck(rows[0.0])})[""])
    for gamma, run in lmp_decks({gamma: limits_deck(row, kv=kv, newton="off") for gamma, row in rows.items()}, 4).items():
        found, (stiff, viscous) = last(run), matrices(x, body, rows[gamma], kv=kv)
        step, sums = found["c_dt[2]"], network.stable_step(np.abs(stiff).sum(axis=1), np.abs(viscous).sum(axis=1)).min()
        assert found["c_dt[1]"] == pytest.approx(2.0 / np.sqrt(largest(stiff)), rel=SETTLED) and found["c_dt"] == step
        assert largest(step**2 * stiff + 2.0 * step * viscous) == pytest.approx(4.0, rel=2.0 * ITERATED)
        assert 0.2 * sums < found["c_dt[5]"] <= sums * (1.0 + 1e-9) <= step * (1.0 + ITERATED)
        assert found["c_dt[1]"] < 0.8 * plain["c_dt[1]"]


MIXED = {(1, 1): law.TABLE2, (1, 2): law.TABLE2._replace(gamma=200.0), (2, 2): law.TABLE2._replace(gamma=3000.0)}
ROWS = {"mixed": MIXED, "one pair undamped": {**MIXED, (1, 2): law.TABLE2._replace(gamma=0.0)},
        **{gamma: law.TABLE2._replace(gamma=gamma) for gamma in (0.0, 100.0, 1e3, 3e4, 1e5)}}


@pytest.mark.parametrize("stretch", [0.0, 0.05, -0.05])
def test_every_implicit_step_up_to_the_bound_is_stable(lmp_decks, tmp_path, stretch):
    """dt^2 K <= 4 M + 2 dt C, at the bound of fix nve/evp and below it, at rest and under 5 % either way, where bonds are in the second
    regime; with fix evp/volume each bond damps its share of the volume. (Without the stiffness across, the strongly damped body under
    tension is unstable.)"""
    body, x = stretched(tmp_path, stretch)
    choices = {(name, 0.0, "literal"): rows for name, rows in ROWS.items()}
    choices.update({(gamma, kv, "none"): ROWS[gamma] for gamma in (0.0, 100.0, 1e3, 3e4) for kv in (300.0, 3000.0, 30000.0)})
    runs = lmp_decks({(name, kv, contact): limits_deck(rows, contact, kv, "nve/evp") for (name, kv, contact), rows in choices.items()})
    for (name, kv, contact), run in runs.items():
        found, (stiff, viscous) = last(run), matrices(x, body, choices[name, kv, contact], contact, kv)
        bound, elastic = found["c_dt[3]"], found["c_dt[1]"]
        assert found["c_dt"] == bound and (not kv or bound >= elastic), (name, kv)
        for step in bound * np.array([0.01, 0.1, 0.3, 0.6, 0.9, 1.0]):
            assert largest(step**2 * stiff - 2.0 * step * viscous) <= 4.0 * (1.0 + SETTLED), (name, kv, step / bound)
        assert name != "one pair undamped" or bound > 1.05 * elastic, "credit where some pairs have no damper"
        if name == 0.0:
            assert bound == pytest.approx(elastic, rel=1e-3 if stretch == 0.0 else 0.05), "no credit where none has one"
        # under compression pairs without a bond, hence without a damper, come within dlim
        assert kv == 0.0 or name != 3e4 or bound > (3.0 if stretch < 0.0 else 4.0) * elastic, "control: damping helps"


SWING = velocities("1e-4*sin(1.1*id)", "1e-4*cos(2.3*id)") + """velocity all zero linear
fix move all nve/evp tol 1e-6
compute dt all evp/dt
""" + thermo("ke pe c_dt") + """
run 0
timestep $({fraction}*c_dt:%.17g)
uncompute dt
thermo_style custom step ke pe
thermo 10
run 400
"""


@pytest.mark.parametrize("gamma, kv", [(100, 0), (10000, 0), (100, 3000)])
def test_the_implicit_bound_holds_in_runs(lmp, small, gamma, kv):
    """Without volume energy it is sharp to a fifth: above it some mode alternates; its growth is slow just beyond, so the upper end is judged
    at 1.2 itself."""
    body = head() + pair(law.TABLE1._replace(gamma=gamma), "none", "fix bonds all evp/bonds zone 1.4") + (f"fix volume all evp/volume {kv}\n" if kv else "")
    for fraction, stable in ((0.98, True), (1.0, True), (1.2, False))[: 2 if kv else 3]:
        run = lmp(body + SWING.format(fraction=fraction))
        grew = run.returncode != 0 or run.thermo()["KinEng"].max() > run.thermo()["KinEng"][0] * (1.0 + 1e-6 if not kv else 2.0)
        assert grew != stable, fraction


# ---- the warning of the pair style at set-up of a timestep above the largest stable one, where nothing else sets the timestep ----

LIMIT = re.compile(r"Pair evp/lj: the timestep ([0-9.e+-]+) is ([0-9.e+-]+) times the largest stable timestep ([0-9.e+-]+):")
GAMMAS = (0, 100, 1000, 10000)


def found(run):
    """Limits of which a run warned."""
    lines = [LIMIT.search(line) for line in run.warnings()]
    for line in filter(None, lines):
        assert float(line[2]) == pytest.approx(float(line[1]) / float(line[3]), rel=1e-3)
    return [float(line[3]) for line in lines if line]


def at_fractions(start, fractions, style="nve"):
    """A step at each fraction of the limit of compute evp/dt, which is gone by then."""
    text = start + f"fix move all {style}\ncompute dt all evp/dt\n" + thermo("c_dt") + "run 0\nvariable limit equal $(c_dt:%.17g)\nuncompute dt\n"
    text += "thermo_style custom step\nthermo_modify warn reset\n"  # LAMMPS shows a hundred in a process
    return text + "".join(f"timestep $({fraction}*v_limit:%.17g)\nrun 1\n" for fraction in fractions)


def starts(tmp_path):
    write_two(tmp_path / "two.data")
    write_body(tmp_path / "lattice.data", lattice_body((6, 4, 4)))
    write_body(tmp_path / "periodic.data", lattice_body((6, 4, 4), "xyz"))
    return {"reference": head(start=f"read_data {REFERENCE}"), "two": head(skin=0.002, start="read_data two.data"),
            "lattice": head(start="read_data lattice.data"), "periodic": head(start="read_data periodic.data", boundary="p p p")}


def test_fires_just_above_the_limit_and_not_below(lmp_decks, tmp_path):
    """Every body, without to thirty times critical damping, explicit and implicit: no
    warning at 0.98 times the limit of compute evp/dt, and one at 1.02 times, of that limit."""
    decks = {(name, gamma, style): at_fractions(start + pair(law.TABLE1._replace(gamma=gamma), "none"), (0.98, 1.02), style)
             for name, start in starts(tmp_path).items() for gamma in GAMMAS for style in ("nve", "nve/evp")}
    for (name, gamma, style), run in lmp_decks(decks).items():
        limit = run.thermo(0)["c_dt"][0]
        assert found(run) == [pytest.approx(limit, rel=ITERATED)], (name, gamma, style)


def test_every_integrator_is_checked(lmp_decks, tmp_path):
    """Thermostats, barostats and limits change nothing in what is stable."""
    write_two(tmp_path / "body.data")
    start = head(skin=0.002) + "comm_modify cutoff 0.05\n" + pair(law.TABLE1, "none") + "timestep 1e-4\nvelocity all set 1e-6 0 0\n"
    styles = ("nve", "nve/sphere", "nve/limit 1e-6", "nvt temp 1e10 1e10 1", "nvt/sphere temp 1e10 1e10 1", "nve/noforce", "move linear 0 0 0")
    runs = lmp_decks({style: start + f"fix move all {style}\nrun 1\n" for style in styles})
    assert {style: len(found(run)) for style, run in runs.items()} == {**dict.fromkeys(styles, 1), "nve/noforce": 0, "move linear 0 0 0": 0}


@pytest.mark.parametrize("style", ["nve", "nve/evp"])
def test_volume_energy_of_the_present_positions(lmp_decks, bar, style):
    """The tension that it adds to the pairs, found before the forces of the run are. Control: at rest there is none."""
    start = head() + pair(law.TABLE1._replace(gamma=10.0), "none") + f"fix volume all evp/volume 3000\nfix move all {style}\nrun 0\n"
    pull = "displace_atoms all ramp x -0.002 0.002 x 0 0.06 units box\n"
    shown = "compute dt all evp/dt\n" + thermo("c_dt") + "run 0\n"
    runs = lmp_decks({"limit": start + pull + shown, "at rest": start + shown, **{str(dt): start + pull + f"timestep {dt}\nrun 1\n" for dt in (1e-6, 2e-5)}})
    limit, at_rest = (runs[name].thermo(-1)["c_dt"][0] for name in ("limit", "at rest"))
    assert abs(limit / at_rest - 1.0) > 2 * ITERATED
    assert found(runs["2e-05"]) == [pytest.approx(limit, rel=ITERATED)]
    assert found(runs["1e-06"]) == []


def test_a_deck_without_a_word_on_the_timestep(lmp_decks):
    """The paper's timestep for its Table 2 is 3.8 times the limit. One warning for each run."""
    table2 = head(start=f"read_data {REFERENCE}") + pair(law.TABLE1._replace(gamma=1000))
    table1 = head(start=f"read_data {REFERENCE}") + pair()
    stiff, soft = (f"pair_coeff * * {words(law.TABLE1._replace(e1=law.TABLE1.e1 * factor))}\n" for factor in (4, 1))
    again = {"rows": stiff, "masses": "set group all density 1000\n", "records": "unfix bonds\nfix bonds all evp/bonds\n",
             "integrator": "unfix move\nfix move all nve/evp\n"}
    decks = {"paper": table2 + "fix move all nve\ntimestep 1.321e-7\nrun 1\n",
             "twice": at_fractions(table1, (1.5, 0.9, 1.5)),
             "loop": at_fractions(table1, (1.05,)) + 4 * "run 1\n",
             "between": at_fractions(table1, (1.05,)) + "run 0\ncompute dt all evp/dt\nrun 1\nuncompute dt\nrun 1\n",
             "one sphere": table1 + "timestep 1e-3\ngroup one id 1\nfix move one nve\nrun 1\n",
             "stiffer": at_fractions(table1, (0.9,)) + stiff + "run 1\n" + soft + "run 1\n",
             **{name: at_fractions(table1, (1.5,)) + change + "run 1\n" for name, change in again.items()}}
    runs = lmp_decks(decks)
    assert {name: len(found(run)) for name, run in runs.items()} == {
        "paper": 1, "twice": 2, "loop": 5, "between": 3, "one sphere": 1, "stiffer": 1, **dict.fromkeys(again, 2)}
    assert found(runs["paper"]) == [pytest.approx(3.51e-8, rel=0.02)], "3.8 times the limit"
    assert found(runs["rows"])[1] < 0.75 * found(runs["rows"])[0]


SILENT = {"nothing moves": "", "held": "fix move all nve\nfix hold all setforce 0 0 0\n", "prescribed": "fix move all nve/noforce\n",
          "fix dt/evp": "fix move all nve\nfix dt all dt/evp 10 0.4\n",
          "minimization": "fix move all nve\nmin_modify dmax 1e-5\n",
          "run 0": "fix move all nve\n", "rerun": "fix move all nve\n", "respa": "fix move all nve\nunfix bonds\nrun_style respa 2 10 pair 1\n"}


def test_silent_where_it_does_not_apply(lmp_decks, tmp_path):
    """Control: the same body with fix nve alone is warned of."""
    write_two(tmp_path / "body.data")
    start = head(skin=0.002) + "comm_modify cutoff 0.05\n" + pair(law.TABLE1, "none") + "timestep 1\n"
    last = {"minimization": "minimize 0 1e-9 3 10\n", "run 0": "run 0\n",
            "rerun": "dump all all custom 1 all.dump id type x y z\ntimestep 1e-9\nrun 1\ntimestep 1\nrerun all.dump first 0 last 1 dump x y z\n"}
    decks = {name: start + fixes + last.get(name, "run 1\n") for name, fixes in {"control": "fix move all nve\n", **SILENT}.items()}
    runs = lmp_decks(decks)
    assert {name for name, run in runs.items() if found(run)} == {"control"}
    assert found(runs["control"]) == [pytest.approx(np.sqrt(2.0 * mass_of(0.005) * 0.011**2 / (80 * 32)), rel=1e-4)], "of two spheres that move freely"


def test_flowing_pairs(lmp_decks, tmp_path):
    """A pair that flows, and one that was unloaded, may be elastic in the next step: the limit is that of the first regime."""
    row, deq = law.TABLE1, 0.011
    write_two(tmp_path / "body.data", deq)
    pull = "displace_atoms all ramp x {0:.17g} {1:.17g} x -0.006 0.006 units box\n"
    start = head(skin=0.002) + pair(row, "none").replace("contact none", "contact none plasticity isotropic")
    start += "fix move all nve\ntimestep 1e-9\nrun 0\n"
    flowed = start + pull.format(-0.01 * deq, 0.01 * deq) + "velocity all set 0 0 0\nrun 1\n"
    back = flowed + pull.format(0.001 * deq, -0.001 * deq) + "velocity all set 0 0 0\n"
    limit = np.sqrt(2.0 * mass_of(0.005) * deq**2 / (row.m1 * row.n1 * row.e1))
    runs = lmp_decks({(name, factor): deck + f"timestep {factor * limit:.17g}\nrun 1\n"
                      for name, deck in (("rest", start), ("flowed", flowed), ("back", back)) for factor in (0.98, 1.1)})
    for (name, factor), run in runs.items():
        assert found(run) == ([pytest.approx(limit, rel=0.05)] if factor > 1.0 else []), name
