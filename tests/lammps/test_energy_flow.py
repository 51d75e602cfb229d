# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/energy where flow stays, bonds break and atoms have a volume energy: each entry by hand, and that the balance closes."""

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import curves, cycles, flow, law
from hostile import refused
from lammps_run import read_csv, run_lammps
from small_bodies import STIR, head, pair, thermo, two_groups, write_body, write_two

ENTRIES = ("open", "kinetic", "first", "second", "lost", "contacts", "dissipated", "movers", "others", "plastic", "hardening", "broken", "volume")
ROW = law.TABLE1
DEQ, SUM_RADII, DLIM = 0.011, 0.01, 0.015
RELATIVE = {"movers": 1e-4, "plastic": 1e-7}  # of the trapezoid; of the margin of a cut-off, up to which a bond flows
CLOSED = 1e-11  # sums over some hundred atoms and steps of terms that are rounded to 1e-16 and cancel


def entries(table, row=-1):
    """By name, of one row of the table; of all rows without."""
    row = slice(None) if row is None else row
    return dict(zip(ENTRIES, (table[name][row] for name in ("f_energy", *(f"f_energy[{k}]" for k in range(1, 13))))))


def style(row, contact, plasticity="isotropic", breaks="none", fix="fix bonds all evp/bonds"):
    return pair(row, contact, fix).replace(f"contact {contact}", f"contact {contact} unload {unload} break {breaks}")


def ledger(every):
    counts = "f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[5]"
    return f"fix energy all evp/energy\nthermo {every}\n" + thermo(f"time f_energy f_energy[*] {counts}")


# ---- two bodies that are moved: by hand ----

def moved(lmp, tmp_path, pairs, ways, steps, ranks=1, gap=DEQ):
    """Over these changes of the distance, in so many steps each; a row for each hundredth of a way."""
    write_two(tmp_path / "body.data", gap)
    across = f"processors {ranks} 1 1" if ranks > 1 else ""
    text = head(skin=0.008, before=across) + pairs + two_groups(0, 0) + "fix move all nve/noforce\n" + ledger(steps // 100) + "timestep 1e-7\n"
    for way in ways:
        speed = 0.5 * way / (steps * 1e-7)
        text += f"velocity one set {-speed:.17g} 0 0\nvelocity two set {speed:.17g} 0 0\nrun {steps}\n"
    run = lmp(text, ranks).ok()
    return [run.thermo(k) for k in range(len(ways))]


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("breaks", ["none", "0.1"])
def test_a_flowed_bond_that_leaves(lmp, tmp_path, breaks, ranks):
    """Along the way out: stored, by hardening and dissipated; beyond the cut-off what it held there is lost, or released
    where it breaks for good. Back within dlim a broken one is gone: only the sum of the radii is left to repel."""
    cut = DLIM if breaks == "none" else 1.1 * DEQ
    out, back = moved(lmp, tmp_path, style(ROW, "repulsive", breaks=breaks), (1.2 * (DLIM - DEQ), 1.2 * (DEQ - DLIM) - 0.0013), 20000, ranks)
    depth = flow.stored(cut, DEQ, ROW, cut - 1.005 * DEQ)
    for k in (5, 20, 40, 60, 82, 84, 100):
        found, d = entries(out, k), DEQ + 1.2 * (DLIM - DEQ) * k / 100
        q = max(0.0, min(d, cut) - 1.005 * DEQ)
        spent = flow.dissipated(0.0, q, DEQ, ROW)
        held = flow.stored(d, DEQ, ROW, q) if d < cut else 0.0
        gone = "lost" if breaks == "none" else "broken"
        expected = {"first": held - (found["hardening"]), "plastic": spent, gone: 0.0 if d < cut else depth, "movers": spent + (held or depth)}
        for name, value in expected.items():
            assert found[name] == pytest.approx(value, rel=RELATIVE.get(name, 1e-9), abs=CLOSED * depth), (k, name)
        rest = {"broken", "lost"} - {gone} | {"second", "contacts", "kinetic", "volume"}
        assert all(found[name] == 0.0 for name in rest), k
    d, found = DEQ - 0.0013, entries(back)
    assert found["plastic"] >= entries(out)["plastic"]
    if breaks == "none":
        assert abs(found["lost"]) < CLOSED * depth and found["contacts"] == 0.0, "it is back, with its offset"
    else:
        q = d - 0.995 * SUM_RADII
        assert found["contacts"] == pytest.approx(flow.stored(d, SUM_RADII, ROW, q), rel=1e-9)
        assert found["plastic"] - entries(out)["plastic"] == pytest.approx(flow.dissipated(0.0, q, SUM_RADII, ROW), rel=1e-9)
        assert found["broken"] == pytest.approx(depth, rel=CLOSED)
    assert abs(found["open"]) < 2e-4 * found["movers"]


@pytest.mark.parametrize("breaks", ["none", "0.1"])
@pytest.mark.parametrize("builds", ["yes", "no"])
def test_a_bond_recorded_next_to_its_cut_off(lmp, tmp_path, breaks, builds):
    """Pressed until it flows, and pulled out: it is not at its threshold there, so that what is lost depends on its offset. It comes
    back with that. builds: only where they are due, or at each step."""
    deq, low = 0.01499, 0.0145
    pairs = style(ROW, "none", breaks=breaks) + f"neigh_modify every 1 delay 0 check {builds}\n"
    pressed, out, back = moved(lmp, tmp_path, pairs, (low - deq, 0.0151 - low, -0.0002), 20000, gap=deq)
    q = low - 0.995 * deq
    depth = flow.stored(DLIM, deq, ROW, flow.return_map(DLIM, deq, ROW, q))
    gone = "lost" if breaks == "none" else "broken"
    assert depth > 2.0 * law.energy(DLIM, deq, ROW, deq), "control"
    assert entries(out)[gone] == pytest.approx(depth, rel=1e-6)
    assert entries(back)[gone] == pytest.approx(0.0 if breaks == "none" else depth, rel=1e-6, abs=1e-6 * depth)
    for table in (pressed, out, back):
        assert np.abs(table["f_energy"]).max() < 1e-3 * entries(out)["movers"]


@pytest.mark.parametrize("unload", ["elastic", "reversible"])
def test_a_bond_that_breaks_where_its_particles_overlap(lmp, tmp_path, unload):
    """What is left rests where the bond broke, not at the larger sum of the radii: it has no force and no energy there, so that all
    that the bond stored is released."""
    deq, cut = 0.0095, 1.03 * 0.0095
    out, back = moved(lmp, tmp_path, style(ROW, "repulsive", unload, "0.03"), (0.0007, -0.0006), 20000, gap=deq)
    q = cut - 1.005 * deq if unload == "elastic" else 0.0
    depth = flow.stored(cut, deq, ROW, q) if q else law.energy(cut, deq, ROW, deq)
    assert law.energy(cut, SUM_RADII, ROW, SUM_RADII) > 0.1 * depth, "control: at the sum of the radii it would have energy"
    found = entries(out)
    assert found["broken"] == pytest.approx(depth, rel=1e-6)
    assert found["contacts"] == pytest.approx(0.0, abs=CLOSED) and found["lost"] == 0.0
    pushed = entries(back)
    assert pushed["contacts"] > 0.01 * depth, "control: it repels"
    for table in (out, back):
        assert np.abs(table["f_energy"]).max() < 1e-3 * (depth + entries(out)["plastic"])


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("breaks, gone", [("none", 0.0), ("0.1", 1.0)])
def test_volume_energy_that_is_lost(lmp, tmp_path, breaks, gone, ranks):
    """Two atoms with one bond: theta is 3 (d/deq - 1) of both. Beyond the cut-off it is lost, and comes back with the bond."""
    kv, cut = 50.0, DLIM if breaks == "none" else 1.1 * DEQ
    fix = f"fix bonds all evp/bonds\nfix volume all evp/volume {kv}"
    out, back = moved(lmp, tmp_path, style(ROW, "none", "reversible", breaks, fix), (1.2 * (DLIM - DEQ), -1.1 * (DLIM - DEQ)), 20000, ranks)
    at_cut = kv * (3.0 * (cut / DEQ - 1.0))**2
    depth = law.energy(cut, DEQ, ROW, DEQ)
    for k in (10, 40, 82, 84, 100):
        found, d = entries(out, k), DEQ + 1.2 * (DLIM - DEQ) * k / 100
        inside = d < cut
        volume = kv * (3.0 * (d / DEQ - 1.0))**2 if inside else 0.0
        assert found["volume"] == pytest.approx(volume, rel=1e-9), k
        lost = 0.0 if inside else at_cut + (depth if breaks == "none" else 0.0)
        assert found["lost"] == pytest.approx(lost, rel=1e-9, abs=CLOSED * at_cut), k
        assert abs(found["open"]) < 1e-3 * at_cut
    found = entries(back)
    # the strain of one that comes back is that at the end of the step, its share of it that at the cut-off
    assert found["lost"] == pytest.approx(gone * at_cut, rel=1e-9, abs=2e-4 * at_cut)
    assert (found["volume"] > 0.0) == (gone == 0.0)
    assert abs(found["open"]) < 1e-3 * at_cut


def test_a_contact_that_only_repels_keeps_what_it_hardened(lmp, tmp_path):
    """Two bodies meet: pressed and let go, no force pulls them; what is left in the contact is lost as it ends."""
    write_two(tmp_path / "body.data", 0.0101)
    shares, opened = [], []
    for part in (1, 2, 4, 8):
        text = head(skin=0.002) + style(ROW, "repulsive", fix="fix bonds all evp/bonds zone 1.000001") + two_groups(20, -20)
        table = lmp(text + "fix move all nve\n" + ledger(part) + f"timestep {2e-7 / part}\nrun {1000 * part}\n").ok().thermo()
        found, all_rows = entries(table), entries(table, None)
        assert np.all(np.diff(all_rows["plastic"]) >= 0.0)
        assert np.all(all_rows["contacts"] >= 0.0) and all_rows["contacts"].max() > 0.1 * found["plastic"]
        assert np.count_nonzero(np.diff(all_rows["lost"])) == 1, "when it ends"
        assert found["contacts"] == 0.0
        assert -found["kinetic"] == pytest.approx(found["plastic"] + found["lost"], rel=2e-3)
        shares.append(found["lost"] / found["plastic"])
        opened.append(np.abs(table["f_energy"]).max() / found["plastic"])
    assert shares == pytest.approx([shares[-1]] * 4, rel=1e-3) and shares[0] > 0.1
    assert opened[-1] < opened[0] / 16.0 and opened[0] < 1e-3


@pytest.mark.parametrize("contact", ["none", "literal"])
def test_flow_that_is_due_at_set_up(lmp, tmp_path, contact):
    """Atoms that were displaced beyond the threshold flow in the first step: until then the pair holds what that dissipates."""
    write_two(tmp_path / "body.data")
    text = head(skin=0.008) + style(ROW, contact) + "fix move all nve/noforce\nrun 0\n"
    text += f"set atom 2 x {0.5 * DEQ + 0.0004}\n" + ledger(1) + "run 0\nrun 2\n"
    text += f"set atom 2 x {0.5 * DEQ - 0.0002}\nrun 0\nrun 2\n"
    run = lmp(text).ok()
    waiting, flowed, back, again = (entries(run.thermo(k), None) for k in range(1, 5))
    q = 0.0004 - 0.005 * DEQ
    spent = flow.dissipated(0.0, q, DEQ, ROW)
    assert [waiting[name][0] for name in ENTRIES] == [0.0] * len(ENTRIES)
    assert flowed["plastic"] == pytest.approx([0.0, spent, spent], rel=1e-9)
    assert flowed["first"] == pytest.approx([0.0, -spent, -spent], rel=1e-9)
    assert np.abs(flowed["open"]).max() <= CLOSED * spent
    more = flow.dissipated(q, -0.0002 + 0.005 * DEQ, DEQ, ROW)
    assert np.diff(again["plastic"]) == pytest.approx([more, 0.0], rel=1e-9, abs=CLOSED * spent)
    assert again["open"] == pytest.approx([back["open"][0]] * 3, abs=CLOSED * spent), "the displacement is no work"
    assert abs(back["open"][0]) > 0.01 * spent, "control"


# ---- fixes that change atoms before the balance sees them ----

EARLY = {"evaporate": "region all block INF INF INF INF INF INF\nfix early all evaporate 7 3 all 49892\n",
         "balance": "fix early all balance 10 1.0 shift x 10 1.01\n"}


@pytest.mark.parametrize("early, breaks, unload, kv", [("evaporate", "none", "elastic", 0), ("balance", "none", "elastic", 0),
                                                       ("evaporate", "0.1", "reversible", 0), ("evaporate", "none", "reversible", 100)])
def test_a_fix_that_changes_atoms_early_comes_after_it(lmp, tmp_path, body, early, breaks, unload, kv):
    write_body(tmp_path / "body.data", body)
    fix = "fix bonds all evp/bonds zone 1.1" + (f"\nfix volume all evp/volume {kv}" if kv else "")
    start = head() + style(ROW, "literal", unload, breaks, fix) + STIR + "fix move all nve\n"
    rest = "timestep 1e-7\nrun 60\n"
    refused(lmp(start + EARLY[early] + ledger(30) + rest, ranks=2), f"Fix energy evp/energy must be defined before fix early {early}", "add, delete or move atoms")
    table = lmp(start + ledger(30) + EARLY[early] + rest, ranks=2).ok().thermo()
    assert np.all(np.isfinite(table["f_energy"]))


def test_any_order_where_nothing_flows(lmp, tmp_path, body):
    write_body(tmp_path / "body.data", body)
    text = head() + pair(ROW) + STIR + "fix move all nve\n" + EARLY["evaporate"] + ledger(30)
    lmp(text + "timestep 1e-7\nrun 60\n", ranks=2).ok()


# ---- bodies that fly apart ----

def flung(contact, breaks, kv, gamma, style_name, step, steps, newton="on", every=None, drift=0):
    """A bar that is stretched and stirred at up to 120 m/s: bonds flow, leave or break within 80 us."""
    fix = "fix bonds all evp/bonds zone 1.48" + (f"\nfix volume all evp/volume {kv}" if kv else "")
    stir = f"variable vx atom {drift}+3000*(x-0.04)+5*sin(1.1*id)\nvariable vy atom 5*cos(2.3*id)\nvariable vz atom 5*sin(3.7*id+1)\n"
    text = head(newton, "s s s") + style(ROW._replace(gamma=float(gamma)), contact, breaks=breaks, fix=fix)
    return text + stir + f"velocity all set v_vx v_vy v_vz\nfix move all {style_name}\n" + ledger(every or steps) + f"timestep {step}\nrun {steps}\n"


@pytest.mark.parametrize("contact, breaks, kv, gamma, style_name", [
    ("none", "none", 0, 0, "nve"), ("literal", "none", 0, 0, "nve"), ("none", "none", 1000, 0, "nve"), ("repulsive", "0.05", 1000, 0, "nve"),
    ("literal", "0.05", 1000, 0, "nve"), ("literal", "0.05", 1000, 50, "nve"), ("repulsive", "0.05", 1000, 50, "nve/evp tol 1e-12")])
def test_closes_through_flow_and_loss(lmp, tmp_path, body, contact, breaks, kv, gamma, style_name):
    """What is left open falls with the timestep, as the jump of the force where a pair leaves has it: F v dt each. Controls: each
    entry that is asked for has its share, far above what is open."""
    write_body(tmp_path / "body.data", body)
    opened = []
    for part in (1, 8):
        table = lmp(flung(contact, breaks, kv, gamma, style_name, 1e-7 / part, 800 * part)).ok().thermo()
        found = entries(table)
        opened.append(abs(found["open"]) / abs(found["kinetic"]))
    assert opened[0] < 1.5e-3 and opened[1] < max(0.25 * opened[0], 1e-5), opened
    expected = {"plastic": True, "hardening": True, "lost": breaks == "none" or kv > 0, "broken": breaks != "none", "volume": kv > 0,
                "dissipated": gamma > 0, "contacts": contact == "literal"}
    if contact == "repulsive":
        del expected["contacts"]  # of broken bonds whose particles overlap
    for name, there in expected.items():
        assert (abs(found[name]) > 20.0 * opened[1] * abs(found["kinetic"])) == there, (name, found)
        assert there or abs(found[name]) <= CLOSED * abs(found["kinetic"]), name


@pytest.mark.parametrize("contact, gamma, style_name", [("literal", 100, "nve"), ("repulsive", 100, "nve/evp tol 1e-12")])
def test_entries_are_the_same_on_any_ranks(lmp, tmp_path, body, contact, gamma, style_name):
    write_body(tmp_path / "body.data", body)
    tables = []
    for ranks, newton in ((1, "on"), (2, "on"), (2, "off"), (4, "on"), (4, "off")):
        table = lmp(flung(contact, "0.05", 1000, gamma, style_name, 1e-7, 700, newton, 100, 300), ranks).ok().thermo()
        tables.append(entries(table, None))
        assert table["f_bonds[5]"][-1] > 10
    for name in ENTRIES:
        for other in tables[1:]:
            assert np.abs(other[name] - tables[0][name]).max() < 1e-10 * np.abs(tables[0]["kinetic"]).max(), name
    assert all(np.abs(tables[0][name]).max() > 0.01 for name in ("lost", "broken", "plastic", "volume", "hardening", "dissipated"))


@pytest.mark.parametrize("gamma, style_name", [(0, "nve"), (1000, "nve/evp")])
def test_plastic_never_falls_in_any_step(lmp, tmp_path, body, gamma, style_name):
    write_body(tmp_path / "body.data", body)
    text = flung("literal", "0.05", 1000, gamma, style_name, 2e-7, 400, every=1).replace("3000*(x-0.04)", "8000*(0.04-x)*sin(0.01*id)")
    plastic = lmp(text).ok().thermo()["f_energy[9]"]
    assert np.all(np.diff(plastic) >= 0.0) and plastic[-1] > 10.0
    assert np.count_nonzero(np.diff(plastic)) > 200


# ---- loops of a specimen ----

@pytest.mark.parametrize("choices", [{"rate": 10, "dtfraction": 0.8}, {"rate": 1, "coeff": "80 8 4 3 8 4 0.005 1000 1.5", "integrator": "implicit", "timestep": 1e-5}],
                         ids=["gamma_0", "gamma_1000"])
def test_loop_area_is_what_is_dissipated(tmp_path, choices):
    """Three loops between -1 and 1 %: the work of the grips is the plastic entry, and what gamma takes, within 0.5 %."""
    (tmp_path / "work.lmp").write_text(
        "fix energy all evp/energy\nvariable plastic equal f_energy[9]\nvariable viscous equal f_energy[6]\n"
        "variable open equal f_energy\n"
        'fix work all print $(v_steps_per_row) "${now},$(v_plastic:%.12g),$(v_viscous:%.12g),$(v_open:%.12g)" '
        "file work.csv screen no title strain,plastic,viscous,open\n")
    more = {"specimen": REFERENCE, "contact": "none", "plasticity": "isotropic", "strain": 0.01, "lower": -0.01, "cycles": 4, "row": 0.0002}
    run_lammps("in.cyclic", 1, {**more, **choices, "out": "run", "also": "work.lmp"}, tmp_path).ok()
    curve, work = curves.read_curve(tmp_path / "run.csv"), read_csv(tmp_path / "work.csv")
    once = np.append(True, np.diff(work["strain"]) != 0.0)  # fix print writes a turn twice
    turns = cycles.turns(work["strain"][once])[::2]
    plastic, viscous = (np.diff(work[name][once][turns]) for name in ("plastic", "viscous"))
    areas = np.array(cycles.loop_areas(curve.strain, curve.grip)) * np.pi * 0.02**2 * 0.04
    assert len(areas) == len(plastic) == 3
    assert areas == pytest.approx(plastic + viscous, rel=5e-3)
    assert np.all(viscous < 0.05 * plastic) and np.all(np.diff(work["plastic"]) >= 0.0)
    assert np.abs(work["open"]).max() < 1e-3 * work["plastic"][-1]
