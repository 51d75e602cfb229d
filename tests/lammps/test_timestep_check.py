# SPDX-License-Identifier: GPL-2.0-only
"""The warning of the pair style at set-up of a timestep that is unstable for certain, where nothing else computes the limit."""

import re

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import brute, law, network
from lammps_run import write_state
from scipy.optimize import brentq
from small_bodies import head, lattice_body, mass_of, pair, thermo, write_body, write_two

PRINTED = 1e-5  # the message has six digits
LIMIT = re.compile(r"timestep ([0-9.e+-]+) is ([0-9.e+-]+) times ([0-9.e+-]+), an upper limit of the stable timestep")

# from body to body: how far the limit is below the upper limit
FRACTIONS = {"reference": (0.70, 0.81), "two": (0.5, 0.708), "lattice": (0.72, 0.89), "periodic": (0.70, 0.88)}
IMPLICIT = (0.6, 1.0)  # of the bound for fix nve/evp, which may itself be below the limit
GAMMAS = (0, 100, 1000, 10000)


def found(run):
    """Upper limits of which a run warned."""
    lines = [LIMIT.search(line) for line in run.warnings()]
    for line in filter(None, lines):
        assert float(line[2]) == pytest.approx(float(line[1]) / float(line[3]), rel=1e-3)
    return [float(line[3]) for line in lines if line]


def at_fractions(start, fractions, style="nve"):
    """A step at each fraction of the limit of compute evp/dt, which is gone by then."""
    text = start + f"fix move all {style}\ncompute dt all evp/dt\n" + thermo("c_dt") + "run 0\nvariable limit equal $(c_dt:%.17g)\nuncompute dt\n"
    text += "thermo_style custom step\n"
    return text + "".join(f"timestep $({fraction}*v_limit:%.17g)\nrun 1\n" for fraction in fractions)


def starts(tmp_path):
    write_two(tmp_path / "two.data")
    write_body(tmp_path / "lattice.data", lattice_body((6, 4, 4)))
    write_body(tmp_path / "periodic.data", lattice_body((6, 4, 4), "xyz"))
    return {"reference": head(start=f"read_data {REFERENCE}"), "two": head(skin=0.002, start="read_data two.data"),
            "lattice": head(start="read_data lattice.data"), "periodic": head(start="read_data periodic.data", boundary="p p p")}


def test_silent_below_the_limit_and_not_above_the_upper_one(lmp_decks, tmp_path):
    """Every body, without to thirty times critical damping, explicit and implicit: no warning at 0.9 and 0.999 times the
    limit of compute evp/dt, one at ten times, and the upper limit is above the limit by no more than is documented."""
    decks = {(name, gamma, style): at_fractions(start + pair(law.TABLE1._replace(gamma=gamma), "none"), (0.9, 0.999, 10.0), style)
             for name, start in starts(tmp_path).items() for gamma in GAMMAS for style in ("nve", "nve/evp")}
    for (name, gamma, style), run in lmp_decks(decks).items():
        limit, upper = run.thermo(0)["c_dt"][0], found(run)
        assert len(upper) == 1, (name, gamma, style)
        low, high = FRACTIONS[name] if style == "nve" else IMPLICIT
        assert low * upper[0] < limit * (1 + 1e-3) and limit < upper[0] * high, (name, gamma, style, limit / upper[0])


def upper_limit(x, radius, rows, bonds, free):
    """The second writing: blocks of the assembled matrices of the present stiffness, and the root of each by bisection."""
    pairs, deq, _, _, row = brute.interactions(x, radius, rows, bonds, "literal")
    everything = np.ones(len(x), dtype=bool)
    stiff = network.assemble(pairs, law.stiffness(pairs.d, deq, row), -law.force(pairs.d, deq, row) / pairs.d, everything).toarray()
    viscous = network.assemble(pairs, row.gamma, np.zeros(len(deq)), everything).toarray()
    lowest = np.inf
    for i in np.flatnonzero(free):
        block = np.s_[3 * i:3 * i + 3, 3 * i:3 * i + 3]
        k, c = stiff[block] / mass_of(radius[i]), viscous[block] / mass_of(radius[i])

        def excess(dt, k=k, c=c):
            return np.linalg.eigvalsh(dt * dt * k + 2.0 * dt * c)[-1] - 4.0

        if excess(lowest if np.isfinite(lowest) else 1.0) > 0.0:
            lowest = brentq(excess, 0.0, min(lowest, 1.0), rtol=1e-10)
    return lowest


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (1, "off"), (2, "on"), (2, "off"), (4, "on")])
def test_the_upper_limit_of_a_deformed_body(lmp, tmp_path, reference, pulled_body, ranks, newton):
    """Both regimes, tension and compression, against the assembled matrices: on any number of MPI ranks. Only a slice about
    the boundary of two ranks moves freely, so that pairs of both hold its atoms."""
    row = law.TABLE1._replace(gamma=30.0)
    write_state(tmp_path / "state.dump", pulled_body.x, 0 * pulled_body.v, pulled_body.box)
    text = head(newton, start=f"read_data {REFERENCE}") + pair(row)
    text += "region slice block 0.024 0.026 INF INF INF INF\ngroup free region slice\ngroup held subtract all free\nrun 0\n"
    text += "read_dump state.dump 0 x y z vx vy vz box no replace yes\nfix hold held nve/noforce\nfix move free nve\ntimestep 1e-5\nrun 1\n"
    free = abs(reference.x[:, 0] - 0.025) < 0.001
    expected = upper_limit(pulled_body.x, reference.radius, row, brute.record_bonds(reference.x, reference.radius, 1.5), free)
    assert found(lmp(text, ranks).ok()) == [pytest.approx(expected, rel=PRINTED)]


def test_a_deck_without_a_word_on_the_timestep(lmp_decks):
    """The paper's timestep for its Table 2 is 3.8 times the limit, and any at 1.5 times the limit is noticed, once per run."""
    table2 = head(start=f"read_data {REFERENCE}") + pair(law.TABLE1._replace(gamma=1000))
    table1 = head(start=f"read_data {REFERENCE}") + pair()
    runs = lmp_decks({"paper": table2 + "fix move all nve\ntimestep 1.321e-7\nrun 1\n",
                      "damped": at_fractions(table2, (1.5,)), "elastic": at_fractions(table1, (1.5,)),
                      "twice": at_fractions(table1, (1.5, 0.9, 1.5))})
    assert [len(found(run)) for run in runs.values()] == [1, 1, 1, 2]
    assert all("compute evp/dt gives the limit itself" in runs[name].stdout for name in runs)


SILENT = {"nothing moves": "", "held": "fix move all nve\nfix hold all setforce 0 0 0\n", "prescribed": "fix move all nve/noforce\n",
          "fix dt/evp": "fix move all nve\nfix dt all dt/evp 10 0.4\n",
          "compute evp/dt": "fix move all nve\ncompute dt all evp/dt\n", "minimization": "fix move all nve\nmin_modify dmax 1e-5\n",
          "run 0": "fix move all nve\n"}


def test_silent_where_it_does_not_apply(lmp_decks, tmp_path):
    """Control: the same body with fix nve alone is warned of."""
    write_two(tmp_path / "body.data")
    start = head(skin=0.002) + "comm_modify cutoff 0.05\n" + pair(law.TABLE1, "none") + "timestep 1\n"
    last = {"minimization": "minimize 0 1e-9 3 10\n", "run 0": "run 0\n"}
    decks = {name: start + fixes + last.get(name, "run 1\n") for name, fixes in {"control": "fix move all nve\n", **SILENT}.items()}
    runs = lmp_decks(decks)
    assert {name for name, run in runs.items() if found(run)} == {"control"}
    assert found(runs["control"]) == [pytest.approx(2.0 / np.sqrt(80 * 32 / 0.011**2 / mass_of(0.005)), rel=PRINTED)], "a sphere against a fixed one"


def test_flowing_pairs_count_with_the_softer_side(lmp_decks, tmp_path):
    """Of a pair that flows, that is the second regime; unloaded it is the first again."""
    row, deq = law.TABLE1, 0.011
    write_two(tmp_path / "body.data", deq)
    pull = "displace_atoms all ramp x {0:.17g} {1:.17g} x -0.006 0.006 units box\n"
    start = head(skin=0.002) + pair(row, "none").replace("contact none", "contact none unload elastic")
    start += "fix move all nve\ntimestep 1e-9\nrun 0\n"
    flowed = start + pull.format(-0.01 * deq, 0.01 * deq) + "velocity all set 0 0 0\nrun 1\n"
    back = flowed + pull.format(0.001 * deq, -0.001 * deq) + "velocity all set 0 0 0\n"
    runs = lmp_decks({name: deck + "timestep 1.2e-4\nrun 1\n" for name, deck in (("rest", start), ("flowed", flowed), ("back", back))})
    first, second = (np.sqrt(m * n * e / deq**2 / mass_of(0.005)) for m, n, e in ((row.m1, row.n1, row.e1), (row.m2, row.n2, row.e2)))
    assert found(runs["rest"]) == [pytest.approx(2.0 / first, rel=PRINTED)]
    assert found(runs["flowed"]) == [pytest.approx(2.0 / second, rel=0.2)]
    assert found(runs["back"]) == [pytest.approx(2.0 / first, rel=0.05)]
