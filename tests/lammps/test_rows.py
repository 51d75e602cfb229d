# SPDX-License-Identifier: GPL-2.0-only
"""Rows that name the bodies they hold for: the same as numbers multiplied by hand, with numpy's own measure of the bonds."""

import math
import struct

import numpy as np
import pytest
from evp import law
from hostile import refused
from small_bodies import (ANOTHER_ORDER, MOVE, ROUND_OFF, SPACING, STIR, assert_same_curve, dump, head, lattice_body, record, thermo, words, write_body)

ONE = law.TABLE1._replace(gamma=50.0)
TWO = law.TABLE1._replace(e1=60.0, e2=5.0, gamma=20.0)
MIXED = law.TABLE1._replace(e1=70.0, gamma=35.0)
METAL = {"spacing": 0.009, "coordination": 12.0, "kv": 700.0}
OTHER = {"spacing": 0.02, "coordination": 9.0}
BONDS = "fix bonds all evp/bonds\n"
STEPS = "run 100\n"
LATER = "read_data body.data extra/atom/types 1"


def said(row, more):
    """A row with its keywords, as pair_coeff takes it."""
    return words(row) + "".join(f" {key} {value:.17g}" for key, value in more.items())


def measure(body):
    """{(type, type): (mean deq, bonds per particle)} of a body's bonds, and {type: number of particles with bonds}."""
    count, sums, deq = np.zeros(len(body.x) + 1, dtype=int), {}, {}
    for (i, j), distance in body.bonds.items():
        count[[i, j]] += 1
        types = tuple(sorted((body.types[i - 1], body.types[j - 1])))
        deq.setdefault(types, []).append(distance)
    for types in deq:
        of_types = count[1:][np.isin(body.types, types)]
        sums[types] = (math.fsum(deq[types]) / len(deq[types]), np.mean(of_types[of_types > 0]))
    return sums


def factors(measured, more):
    """Of e1 and e2, of gamma, of kv."""
    s, z = measured
    stretch, share = s / more["spacing"], more["coordination"] / z
    return stretch**3 * share, stretch * share, stretch**3


def scaled(row, measured, more):
    energies, gamma, _ = factors(measured, more)
    return row._replace(e1=row.e1 * energies, e2=row.e2 * energies, gamma=row.gamma * gamma)


def coeffs(rows, style="pair_style evp/lj\n", sub=""):
    """rows: {"I J": words of a row}."""
    return style + "".join(f"pair_coeff {types} {sub}{row}\n" for types, row in rows.items())


def same_forces(run, other, tolerance=ROUND_OFF):
    """All snapshots of all.dump; the forces themselves are of the size of their parts here."""
    snapshots = list(zip(run.dump("all.dump"), other.dump("all.dump")))
    for one, two in snapshots:
        assert np.abs(one.f - two.f).max() <= tolerance * np.abs(two.f).max(), f"step {two.step}"
    assert np.abs(snapshots[-1][1].f).max() > 100.0, "control: there are forces"


def scaling_lines(run):
    return [line for line in run.stdout.splitlines() if line.startswith("pair evp/lj: types")]


@pytest.fixture
def two_types(bar):
    """Rows as given, and the same multiplied by hand, of a body of two types."""
    measured = measure(bar)
    given = {"1 1": (ONE, METAL), "2 2": (TWO, OTHER), "1 2": (MIXED, METAL)}
    keys = {types: tuple(map(int, types.split())) for types in given}
    assert len(measured) == 3
    by_hand = {types: words(scaled(row, measured[keys[types]], more)) for types, (row, more) in given.items()}
    assert all(not 0.9 < factors(measured[keys[types]], more)[0] < 1.1 for types, (_, more) in given.items())
    return {types: said(*both) for types, both in given.items()}, by_hand


# ---- forces


def test_what_it_prints(lmp, bar, two_types):
    """Once, with six digits of what numpy measures. Types without bonds between them take the factors of the like types, or none (tests/unit)."""
    rows = {**two_types[0], "1 3": said(MIXED, METAL), "3 3": said(ONE, METAL), "2 3": words(ONE)}
    run = lmp(head(start=LATER) + coeffs(rows) + BONDS + "fix move all nve\nrun 1\nrun 1\n", ranks=2).ok()
    measured, expected = measure(bar), []
    for types, more in (((1, 1), METAL), ((1, 2), METAL), ((1, 3), None), ((2, 2), OTHER)):
        s, z = measured[types if more else (1, 1)]
        energies, gamma, _ = factors((s, z), more or METAL)
        shown = f"spacing {s:.6g} (row {more['spacing']:.6g}), bonds per particle {z:.4g} (row {more['coordination']:.4g})" if more else "no bonds between them"
        expected.append(f"pair evp/lj: types {types[0]} {types[1]}: {shown}: e1 e2 x {energies:.6g}, gamma x {gamma:.6g}" + ("" if more else ", as of the like types"))
    assert scaling_lines(run) == [*expected, "pair evp/lj: types 3 3: no bonds between them: coefficients as given"]


def test_all_that_read_the_law(lmp_decks, bar, two_types):
    """Forces, stable timestep, pair/local, rerun, minimization, fix nve/evp, energies, in a run beside numbers multiplied by hand."""
    given, by_hand = two_types
    rest = BONDS + STIR + """
fix move all nve/evp tol 1e-12
fix energy all evp/energy
compute dt all evp/dt
compute pairs all pair/local dist force eng
timestep 3e-7
fix dt all dt/evp 10 0.5 displacement 0.1
variable s equal dt
thermo 10
""" + thermo("v_s pe ke pxx f_bonds[2] f_energy c_dt c_dt[1] c_dt[2] c_dt[3]") + dump(every=30) + """
dump pairs all local 30 pairs.dump c_pairs[1] c_pairs[2] c_pairs[3]
dump_modify pairs format float %.17g
run 60
unfix dt
unfix energy
unfix move
undump all
undump pairs
""" + thermo("pe ke pxx f_bonds[2] c_dt") + """
rerun all.dump first 30 dump x y z vx vy vz
min_style cg
min_modify dmax 1e-5
minimize 1e-8 0 20 100
"""
    runs = lmp_decks({name: head("off") + coeffs(rows) + rest for name, rows in {"given": given, "by hand": by_hand}.items()}, ranks=2)
    same_forces(runs["given"], runs["by hand"], ANOTHER_ORDER)
    first = [runs[name].dump("all.dump")[0].f for name in ("given", "by hand")]
    assert np.abs(first[0] - first[1]).max() <= ROUND_OFF * np.abs(first[1]).max()
    assert not scaling_lines(runs["by hand"])
    blocks = [runs["given"].thermo(k) for k in range(3)]  # run, rerun, minimization
    for block in range(3):
        assert_same_curve(runs["given"].thermo(block), runs["by hand"].thermo(block), 1e-8)  # that of the Lanczos numbers
    assert blocks[0]["c_dt"][0] > 0.0
    for one, two in zip(runs["given"].dump("pairs.dump"), runs["by hand"].dump("pairs.dump")):
        for column in ("c_pairs[2]", "c_pairs[3]"):
            assert np.abs(np.sort(one[column]) - np.sort(two[column])).max() <= ANOTHER_ORDER * np.abs(two[column]).max()


def test_fix_adapt_writes_numbers_as_typed(lmp_decks, bar, two_types):
    """e1 of 40 is 40 in the row: the law is made of it times the factor."""
    measured = measure(bar)
    rest = BONDS + "variable e equal {e1:.17g}\nfix adapt all adapt 1 pair evp/lj e1 1 1 v_e\n" + STIR + MOVE + dump() + STEPS
    e1 = {"given": 40.0, "by hand": 40.0 * factors(measured[1, 1], METAL)[0]}
    rows = {"given": two_types[0], "by hand": two_types[1]}
    runs = lmp_decks({**{name: head() + coeffs(rows[name]) + rest.format(e1=e1[name]) for name in rows},
                      "plain": head() + coeffs(two_types[0]) + BONDS + STIR + MOVE + dump() + STEPS})
    same_forces(runs["given"], runs["by hand"], ANOTHER_ORDER)
    change = runs["given"].dump("all.dump")[-1].f - runs["plain"].dump("all.dump")[-1].f
    assert np.abs(change).max() > 100.0, "control: fix adapt acts"


# ---- where the measures are kept


def section(path, ntypes):
    """Of fix evp/bonds in a restart file: words of the measures; None where there are none."""
    data = path.read_bytes()
    name = b"evp/bonds\0"
    start = data.index(name) + len(name) + 4 + 16 * 8
    count = ntypes * (ntypes + 1)
    known, *words = struct.unpack_from(f"<{1 + count}d", data, start)
    return tuple(words) if known else None


def test_restart(lmp, bar, tmp_path, two_types):
    """Measures are those of the recording, to the last bit, though atoms are gone and types have changed since; a new pair style takes them, too."""
    begin = head() + coeffs(two_types[0]) + BONDS + STIR + MOVE + dump() + "run 50\n"
    begin += "group gone id 1:5\ndelete_atoms group gone compress no\nset atom 30*40 type 1\nrun 0\nwrite_restart half.restart\n"
    whole = lmp(begin + "run 50\n" + coeffs(two_types[0]) + "run 0\nwrite_restart typed.restart\n").ok()
    start = head(start="read_restart half.restart") + BONDS + MOVE + dump()
    again = lmp(start + "run 50\nwrite_restart later.restart\n", ranks=2).ok()
    assert section(tmp_path / "half.restart", 2) == section(tmp_path / "later.restart", 2) == section(tmp_path / "typed.restart", 2) is not None
    assert scaling_lines(again) == scaling_lines(whole)
    last = [run.dump("all.dump")[-1] for run in (whole, again)]
    assert np.abs(last[0].f - last[1].f).max() <= ANOTHER_ORDER * np.abs(last[0].f).max()
    # control: measured anew it would be another
    anew = lmp(head(start="read_restart half.restart") + "pair_style none\n" + coeffs(two_types[0]) + "fix other all evp/bonds\nfix move all nve\nrun 0\n").ok()
    assert scaling_lines(anew) != scaling_lines(whole)


def test_a_new_fix_measures_again(lmp, bar):
    """The body was stretched by 1 % in between; without bonds the numbers are those of the row."""
    grow = "change_box all x scale 1.01 y scale 1.01 z scale 1.01 remap\n"
    text = head() + coeffs({"* *": said(ONE, METAL)}) + BONDS + "fix move all nve\nrun 0\n" + grow
    run = lmp(text + "unfix bonds\nrun 0\nfix bonds all evp/bonds\nrun 0\n").ok()
    first, last = (float(line.split("spacing ")[1].split()[0]) for line in (scaling_lines(run)[0], scaling_lines(run)[-1]))
    before = measure(bar._replace(types=np.ones(len(bar.x), dtype=int)))[1, 1][0]
    assert abs(first / measure(bar)[1, 1][0] - 1.0) < 1e-5 and abs(before / SPACING - 1.0) < 0.3
    bonds = record(1.01 * bar.x, bar.radius, 1.5, bar.cell)
    assert last == pytest.approx(measure(bar._replace(bonds=bonds))[2, 2][0], rel=1e-5)
    assert sum("there are no bonds to compare with" in line for line in run.warnings()) == 1


# ---- fix evp/volume row


@pytest.mark.parametrize("newton", ("on", "off"))
def test_a_bond_file_keeps_the_measures(lmp, bar, newton):
    """A body that has flowed is read back with the factors of its recording, also into a box with one type more. Control: its bonds are of another spacing by then."""
    rows = coeffs({"* *": said(ONE, {**METAL, "kv": 0}) + " flow 0 1 1 2"}, "pair_style evp/lj contact none plasticity isotropic\n")
    state = thermo("pe pxx")
    flows = head(newton) + rows + BONDS + "velocity all ramp vx 0 60 x 0 0.04 units box\nfix move all nve\ntimestep 3e-7\n" + state
    first = lmp(flows + "run 300\nrun 0\nwrite_data flowed.data\nwrite_evp_bonds flowed.bonds\n").ok()
    again = "{}" + rows + "fix bonds all evp/bonds{}\n" + state + "run 0\n"
    whole, wider = (head(newton, start=f"read_data flowed.data{words}") for words in ("", " extra/atom/types 1"))
    kept, more, anew = (lmp(again.format(*parts), 2).ok() for parts in ((whole, " file flowed.bonds"), (wider, " file flowed.bonds"), (whole, "")))
    assert scaling_lines(kept) == scaling_lines(first) != scaling_lines(anew)
    assert set(scaling_lines(first)) < set(scaling_lines(more)), "those with the third type are added"
    for name in ("PotEng", "Pxx"):
        for run in (kept, more):
            assert run.thermo()[name][0] == pytest.approx(first.thermo()[name][-1], rel=1e-9), name


def test_volume_by_rows(lmp_decks, bar):
    """The KV of each type is that of its row times spacing cubed; compute evp/dt and fix evp/energy know it."""
    more = {1: METAL, 2: {**OTHER, "kv": 300.0}}
    measured = measure(bar)
    rows = {"1 1": said(ONE, more[1]), "2 2": said(TWO, more[2]), "1 2": words(MIXED)}
    kv = [f"{more[k]['kv'] * factors(measured[k, k], more[k])[2]:.17g}" for k in (1, 2)]
    rest = STIR + MOVE.replace("f_bonds[4]", "f_bonds[4] f_volume f_volume[1] f_energy c_dt")
    rest = BONDS + "fix energy all evp/energy\ncompute dt all evp/dt\n{volume}" + rest + dump() + STEPS
    runs = lmp_decks({name: head() + coeffs(rows) + rest.format(volume=f"fix volume all evp/volume {kind}\n")
                      for name, kind in {"row": "row", "typed": " ".join(kv), "zero": "0"}.items()}, ranks=2)
    same_forces(runs["row"], runs["typed"], ANOTHER_ORDER)
    assert_same_curve(runs["row"].thermo(), runs["typed"].thermo(), 1e-8)
    assert runs["row"].thermo()["c_dt"][0] < 0.99 * runs["zero"].thermo()["c_dt"][0], "control: kv counts in dt"
    for name, shown in (("row", True), ("typed", False)):
        assert [", kv x" in line for line in scaling_lines(runs[name])] == [shown, shown]
    assert f", kv x {factors(measured[1, 1], METAL)[2]:.6g}\n" in runs["row"].stdout


def test_kv_without_fix_volume_is_warned_of_once(lmp_decks, bar):
    """With the line to add; also in a minimization, after a restart and when a later row has it. Any fix evp/volume decides on KV; without bonds
    there is nothing to add."""
    add, rows = "add: fix ID all evp/volume row", {"1 1": said(ONE, OTHER), "2 2": said(TWO, METAL), "1 2": words(MIXED)}
    start, rest = head() + coeffs(rows), "fix move all nve\ntimestep 1e-8\n{}run 1\nrun 1\n"
    later = "".join(f"pair_coeff 2 2 {said(TWO, more)}\nrun 1\n" for more in (OTHER, METAL))
    decks = {"run": (1, start + BONDS + rest.format("") + "write_restart ../end.restart\n"),
             "restart": (2, head(start="read_restart ../end.restart") + BONDS + rest.format("") + later),
             "minimize": (1, start + BONDS + rest.format("minimize 0 1e-9 2 5\n")),
             "row": (0, start + BONDS + rest.format("fix v all evp/volume row\n")),
             "number": (0, start + BONDS + rest.format("fix v all evp/volume 0\n")),
             "no bonds": (0, start + rest.format(""))}
    runs = lmp_decks({name: text for name, (_, text) in decks.items()}, 2)
    assert {name: sum(add in line for line in run.ok().warnings()) for name, run in runs.items()} == {name: count for name, (count, _) in decks.items()}
    assert "the row of type 2 has kv 700, but without fix evp/volume" in runs["run"].stdout and "kv x" not in runs["run"].stdout


def test_volume_by_rows_without_kv_is_off(lmp_decks, bar):
    """Nothing is asked for, not even bonds; also after rows that had one."""
    rows = coeffs({"* *": words(ONE)})
    fix = "fix volume all evp/volume row\n"
    runs = lmp_decks({"off": head() + rows + fix + "fix move all nve\nrun 10\n",
                      "was on": head() + coeffs({"* *": said(ONE, {"kv": 1000.0})}) + fix + BONDS + STIR + MOVE + "run 50\n"
                      + coeffs({"* *": words(ONE)}, "") + "compute pe all pe/atom\n"
                      + "thermo_style custom step f_volume f_volume[1] f_volume[3]\ndump pe all custom 1 pe.dump id c_pe f_volume\n"
                      + "run 1\n"})
    assert ["volume energy from fix" in run.stdout for run in runs.values()] == [False, True]
    assert all(np.all(values == 0.0) for name, values in runs["was on"].thermo().items() if name != "Step")
    assert np.all(runs["was on"].dump("pe.dump")[-1]["f_volume"] == 0.0)


def test_a_row_of_a_file(lmp, bar, tmp_path):
    """pair_coeff takes the word that read_evp_row takes (test_commands.py)."""
    (tmp_path / "p.evp").write_text(f"# UNITS: si\nmetal {said(ONE, METAL)} density 2700\n".replace("80 8", "79.999999999999986 8"), encoding="utf-8")
    run = lmp(head() + coeffs({"* *": "p.evp:metal"}) + BONDS + "fix move all nve\nrun 0\n", ranks=2).ok()
    assert len(scaling_lines(run)) == 3


@pytest.mark.parametrize("style, sub, options", [("evp/lj", "", ""), ("evp/lj", "", "pair ij"), ("hybrid/overlay evp/lj zero 0.001 nocoeff", "evp/lj ", "pair ij")])
def test_read_data_reads_what_write_data_writes(lmp, bar, style, sub, options):
    """Of a row that is longer than the 254 characters that read_data takes: its data file has no coefficients."""
    row = f"{words(ONE)} spacing 0.009 coordination 12 flow 0 1 " + " ".join(f"{p / 31.0:.17g} {1.0 + p / 41.0:.17g}" for p in range(1, 12))
    assert len(row) > 254
    pairs = f"pair_style {style}\npair_coeff * * {sub}{row}\n" + ("pair_coeff * * zero\n" if sub else "") + BONDS + "fix move all nve\n" + thermo("pe") + "run 0\n"
    run = lmp(head() + STIR + pairs + f"write_data long.data {options}\nclear\npair_style {style}\n" + head(start="read_data long.data") + pairs, ranks=2).ok()
    assert run.thermo(0)["PotEng"][0] == run.thermo(1)["PotEng"][0] and not run.warnings()


# ---- types without bonds of their own: atoms among those of another type, types that are set later

SCALED = coeffs({"* *": said(ONE, {"spacing": 0.02, "coordination": 12, "kv": 700})})
VOLUME = "fix volume all evp/volume row\n"


def one_type(folder, marked=()):
    body = lattice_body((5, 4, 4))
    types = np.ones(len(body.x), dtype=int)
    types[list(marked)] = 2
    body = body._replace(types=types)
    write_body(folder / "body.data", body)
    return body


def test_a_type_among_another_has_the_kv_of_its_bonds(lmp_decks, tmp_path):
    """Two atoms of type 2, far from each other: e1 and gamma of all their bonds are those of types 1 2, kv is scaled by all of these."""
    body = one_type(tmp_path, (0, 45))
    between = [deq for (i, j), deq in body.bonds.items() if body.types[i - 1] != body.types[j - 1]]
    spacing = math.fsum(between) / len(between)
    assert not any(body.types[i - 1] == body.types[j - 1] == 2 for i, j in body.bonds)
    like = math.fsum(deq for (i, j), deq in body.bonds.items() if body.types[i - 1] == body.types[j - 1] == 1)
    like /= len(body.bonds) - len(between)
    kv = [700.0 * (s / 0.02) ** 3 for s in (like, spacing)]
    rest = STIR + MOVE.replace("f_bonds[4]", "f_bonds[4] f_volume f_volume[1]") + dump(every=20) + "run 40\n"
    runs = lmp_decks({"row": head() + SCALED + BONDS + VOLUME + rest,
                      "typed": head() + SCALED + BONDS + VOLUME.replace("row", f"{kv[0]:.17g} {kv[1]:.17g}") + rest,
                      "as given": head() + SCALED + BONDS + VOLUME.replace("row", f"{kv[0]:.17g} 700") + rest})
    assert_same_curve(runs["row"].thermo(), runs["typed"].thermo())
    volume = {name: run.thermo()["f_volume"] for name, run in runs.items()}
    assert np.abs(volume["as given"] - volume["typed"]).max() > 1e-3 * volume["typed"].max(), "control"
    line = [line for line in runs["row"].stdout.splitlines() if line.startswith("pair evp/lj: types 2 2")]
    assert f"spacing {spacing:.6g} (row 0.02), bonds per particle {len(between) / 2:.4g} (row 12)" in line[0]


@pytest.mark.parametrize("atoms, kv", [("1:40", 0), ("3", 700)])
def test_a_type_set_after_the_recording_is_refused(lmp, tmp_path, atoms, kv):
    """Nothing measured says by how much its bonds, or the kv of a single atom, are to be scaled."""
    one_type(tmp_path)
    row = SCALED.replace("kv 700", f"kv {kv}")
    text = head(start=LATER) + row + BONDS + VOLUME + MOVE + f"run 0\ngroup marked id {atoms}\nset group marked type 2\nrun 1\n"
    refused(lmp(text, 2), "the row of type 2 cannot be scaled", "set types before the bonds are recorded")


def test_a_type_set_later_that_has_its_measure(lmp_decks, tmp_path):
    """A single atom whose bonds are of types 1 2: the factor of type 1, the bits of before; likewise a row that does not scale. No kv is used."""
    one_type(tmp_path)
    free = SCALED.replace(" kv 700", "")
    later = "group marked id 3\nset group marked type 2\n"
    rest = STIR + MOVE + "run 20\n"
    plain = f"pair_coeff 2 2 {words(ONE)}\n"
    runs = lmp_decks({name: head(start=LATER) + text + BONDS + "fix hold all nve/noforce\nrun 0\nunfix hold\n" + more + rest for name, text, more in
                      (("before", free, ""), ("later", free, later), ("kv without fix evp/volume", SCALED, later), ("plain", free + plain, later))})
    for name in ("later", "kv without fix evp/volume", "plain"):
        assert_same_curve(runs["before"].thermo(), runs[name].thermo(), 0.0)
