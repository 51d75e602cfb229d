# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/bonds: which pairs it records, what it keeps, and that the recorded body is free of force."""

import re

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import law
from oracle import brute
from lammps_run import write_state
from small_bodies import head, pair, thermo, write_two

ALPHA = 1.5
DEQ_DIGITS = 1e-14  # deq is one square root of the same positions: a few roundings apart
# Largest |f| of the body at its start, of the yield force at the mean deq: eq. 1 at d = deq up to its last bit.
FORCE_FREE = 1e-9

COMPUTES = """
compute ids all property/local patom1 patom2
compute pairs all pair/local dist p1 p3
"""

DUMP = """
dump pairs all local 1 pairs.dump c_ids[1] c_ids[2] c_pairs[1] c_pairs[2] c_pairs[3]
dump_modify pairs format float %.17g
"""

LOCAL = COMPUTES + DUMP


def deck(newton="on", data=REFERENCE, contact="none", gamma=0, group="all", zone="", **options):
    start = head(newton, start=f"read_data {data}", **options) + pair(law.TABLE1._replace(gamma=gamma), contact, f"fix bonds {group} evp/bonds {zone}")
    return start + thermo("pe f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[4]")


def recorded(snapshot):
    """With contact none, the pairs that act are the bonds (within dlim): {(id_i, id_j): deq}."""
    acting = snapshot["c_pairs[3]"] > 0
    i, j = (snapshot[f"c_ids[{k}]"][acting].astype(int) for k in (1, 2))
    return dict(zip(zip(np.minimum(i, j).tolist(), np.maximum(i, j).tolist()), snapshot["c_pairs[2]"][acting]))


@pytest.mark.parametrize("ranks, newton, zone, reach",
                         [(1, "on", "", ALPHA), (2, "off", "zone 1.2", 1.2), (4, "off", "zone 1.5", ALPHA), (4, "on", "zone 1.01", 1.01)])
def test_records_the_pairs_of_the_zone(lmp, reference, ranks, newton, zone, reach):
    run = lmp(deck(newton, zone=zone) + LOCAL + "run 0\n", ranks=ranks).ok()
    expected = brute.record_bonds(reference.x, reference.radius, reach)
    found = recorded(run.dump("pairs.dump")[-1])
    assert set(found) == set(expected)
    assert max(abs(found[pair] / expected[pair] - 1.0) for pair in expected) < DEQ_DIGITS
    assert run.thermo()["f_bonds"][0] == len(expected)
    most = np.bincount(np.array(list(expected)).ravel()).max()
    within = f"{reach:g}" if zone else "alpha"
    assert f"fix evp/bonds bonds: recorded {len(expected)} pairs within {within} (R_i + R_j), at most {most} per atom" in run.stdout


def test_recorded_body_is_free_of_force(lmp_decks, reference):
    """Control: with pairs beyond the zone on deq = R_i + R_j, the same body is pulled together."""
    show = "dump all all custom 1 f.dump id fx fy fz\ndump_modify all format float %.17g\nrun 0\n"
    decks = {contact: deck(contact=contact) + show for contact in ("literal", "repulsive", "none")}
    decks["control"] = decks["literal"].replace("evp/bonds", "evp/bonds zone 1.3")
    deq = list(brute.record_bonds(reference.x, reference.radius, ALPHA).values())
    yield_force = 8 * 4 * 80 * 0.005 / np.mean(deq)
    for name, run in lmp_decks(decks, 4).items():
        largest = np.linalg.norm(run.dump("f.dump")[-1].vectors("fx", "fy", "fz"), axis=1).max()
        assert largest > yield_force if name == "control" else largest < FORCE_FREE * yield_force, name


def test_pairs_keep_deq_when_they_leave_and_return(lmp, tmp_path, reference):
    """All atoms are spread to twice their distances, where no pair sees its partner, and put back."""
    still = np.zeros_like(reference.x)
    write_state(tmp_path / "far.dump", 2.0 * reference.x - [0.025, 0, 0], still, 2.0 * reference.box)
    write_state(tmp_path / "back.dump", reference.x, still, reference.box)
    text = deck("off", boundary="s s s") + LOCAL + "run 0\nundump pairs\n"
    for name in ("far", "back"):
        text += f"read_dump {name}.dump 0 x y z vx vy vz box no replace yes\n"
        text += DUMP.replace("pairs.dump", f"{name}_pairs.dump") + "run 0\nundump pairs\n"
    run = lmp(text, ranks=2).ok()
    start, far, back = (run.dump(f"{name}pairs.dump")[0] for name in ("", "far_", "back_"))
    assert recorded(far) == {}, "control: nothing interacts on the way"
    assert run.thermo(1)["f_bonds[1]"][0] == run.thermo(0)["f_bonds"][0]
    assert recorded(back) == recorded(start)


def test_later_atoms_have_no_bonds(lmp, reference):
    place = reference.x[0]
    text = deck() + f"""
run 0
create_atoms 1 single {place[0] + 0.0002} {place[1] + 0.0045} {place[2]}
set atom 501 diameter 0.01 density 2700
dump f all custom 1 f.dump id fx fy fz
""" + LOCAL + "run 0\n"
    run = lmp(text).ok()
    assert not any(501 in pair for pair in recorded(run.dump("pairs.dump")[-1]))
    assert run.thermo(0)["f_bonds"][0] == run.thermo(1)["f_bonds"][0]
    assert np.all(run.dump("f.dump")[-1].vectors("fx", "fy", "fz")[500] == 0.0)
    literal = lmp(text.replace("contact none", "contact literal")).ok()
    assert literal.thermo(1)["f_bonds[3]"][0] > literal.thermo(0)["f_bonds[3]"][0], "control: it does meet others"


# LAMMPS' line search of cg gives up at energy changes of 1e-8 [J], here 3e-8 m from deq at 2e7 N/m
@pytest.mark.parametrize("style, precision", [("fire", 1e-10), ("cg", 3e-8)])
def test_minimisation_knows_no_damping(lmp_decks, tmp_path, style, precision):
    """gamma > 0 changes no bit of a minimisation. Two spheres with
    deq = 0.011, pulled to 0.01105, return to deq; so the minimiser does work with this style."""
    write_two(tmp_path / "two.data")
    ends = []
    decks = {gamma: deck(data="two.data", gamma=gamma, skin=0.002) + f"""
timestep 1e-6
min_style {style}
min_modify dmax 1e-4
minimize 0 0 1 1
displace_atoms all ramp x 0 0.00005 x -0.0055 0.0055
write_dump all custom first.dump id x modify format float %.17g
minimize 0 1e-8 1000 10000
write_dump all custom last.dump id x modify format float %.17g
""" for gamma in (0, 1000)}
    for run in lmp_decks(decks, ranks=2).values():
        assert re.search(r"recorded 1 pairs", run.stdout), "recorded by the minimisation's own set-up"
        ends.append([np.diff(run.dump(f"{name}.dump")[0]["x"])[0] for name in ("first", "last")])
    assert ends[0][0] == pytest.approx(0.01105, abs=1e-12)
    assert ends[0][1] == pytest.approx(0.011, abs=precision)
    assert ends[1] == ends[0]


def test_broken_bonds_count_when_their_atoms_have_gone(lmp):
    """Three spheres in a row: the first one tears off and is lost, then the second is deleted. One bond broke, one more does not act."""
    start = head(boundary="f f f", skin=0.002, start="""region box block -0.03 0.1 -0.1 0.1 -0.1 0.1
create_box 1 box
create_atoms 1 single 0 0 0
create_atoms 1 single 0.01 0 0
create_atoms 1 single 0.02 0 0
set group all diameter 0.01 density 2700""")
    rules = "pair_style evp/lj contact none break 0.01\npair_coeff * * 80 8 4 3 8 4 0.005 0 1.5\n"
    counts = thermo("atoms f_bonds f_bonds[1] f_bonds[5]") + "thermo_modify lost ignore\n"
    text = start + rules + """
fix bonds all evp/bonds
fix move all nve
timestep 1e-6
group first id 1
velocity first set -100 0 0
""" + counts + """
thermo 200
run 400
group second id 2
delete_atoms group second compress no
run 0
write_restart gone.restart
"""
    again = head(start="read_restart gone.restart", skin=0.002) + "fix bonds all evp/bonds\n" + counts + "run 0\n"
    for ranks, later in ((1, 2), (2, 1)):
        run = lmp(text, ranks).ok()
        rows = [run.thermo(0), run.thermo(1), lmp(again, later).ok().thermo()]
        assert [(table["Atoms"][-1], table["f_bonds"][-1], table["f_bonds[1]"][-1], table["f_bonds[5]"][-1]) for table in rows] == [
            (2, 2, 0, 1), (1, 2, 1, 1), (1, 2, 1, 1)]
