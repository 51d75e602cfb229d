# SPDX-License-Identifier: GPL-2.0-only
"""The warning of the pair style at set-up of a timestep above the largest stable one, where nothing else sets the timestep."""

import re

import numpy as np
import pytest
from lammps_run import REFERENCE
from evp import law
from small_bodies import head, lattice_body, mass_of, pair, thermo, words, write_body, write_two

LIMIT = re.compile(r"Pair evp/lj: the timestep ([0-9.e+-]+) is ([0-9.e+-]+) times the largest stable timestep ([0-9.e+-]+):")
ITERATED = 1e-3  # of the explicit limit with damping, as in test_dt.py
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
