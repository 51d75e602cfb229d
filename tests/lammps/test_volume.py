# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/volume: forces, energies and virial against tests/oracle/volume.py, which was written apart, and closed forms."""

import itertools
import re

import numpy as np
import pytest
from evp import law
from lammps_run import write_data
from oracle import brute, volume
from small_bodies import SPACING, dump, head, lattice_body, pair, thermo, words, write_body

BY_HAND = 1e-12  # a dozen roundings; the strains themselves are exact to 1e-16 of 1
KV = 1000.0
ROW = law.TABLE1
QUIET = "fix move all nve\n"
STRAIN = "f_volume f_volume[1] f_volume[2] f_volume[3] f_volume[4]"


def fix(kv=KV, group="all", more=""):
    return f"fix volume {group} evp/volume {kv} {more}\n"


def truth(x, body, kv, reach=ROW.alpha, among=None, cavitation=0.15):
    """volume.evaluate of an open body, IDs 1..N, or of two that touch, whose pairs fill the gap there at rest; among: atoms whose pairs count now, by default all."""
    i, j = np.array(list(body.bonds)).T - 1
    deq = np.array(list(body.bonds.values()))
    rest = volume.at_rest(i, j, deq, reach * (body.radius[i] + body.radius[j]), len(x), body.types)
    if is_two_bodies(body):
        near = brute.find_pairs(body.x, body.radius, reach)
        far = body.types[near.i] != body.types[near.j]
        t = 1.0 - near.d / (reach * (body.radius[near.i] + body.radius[near.j]))
        rest = rest._replace(gap=np.maximum(rest.gap, sum(np.bincount(ends[far], t[far] ** 2, len(x)) for ends in (near.i, near.j))))
    now = brute.find_pairs(x, body.radius, reach)
    counts = np.ones(len(now.i), dtype=bool) if among is None else among[now.i] & among[now.j]
    i, j = now.i[counts], now.j[counts]
    fresh = np.array([two not in body.bonds for two in zip((i + 1).tolist(), (j + 1).tolist())])
    across = is_two_bodies(body) & (body.types[i] != body.types[j])
    return volume.evaluate(x, i, j, reach * (body.radius[i] + body.radius[j]), kv, rest, cavitation, fresh, across=across)


def is_two_bodies(body):
    return all(body.types[a - 1] == body.types[b - 1] for a, b in body.bonds)


def two_bodies(size):
    """A lattice body that is cut in two, by its types."""
    body = lattice_body(size)
    body = body._replace(types=1 + (body.x[:, 0] > np.median(body.x[:, 0])).astype(int))
    return body._replace(bonds={two: deq for two, deq in body.bonds.items() if body.types[two[0] - 1] == body.types[two[1] - 1]})


def place(x):
    """Puts the atoms 1..N there."""
    return "".join(f"set atom {k} x {p[0]:.17g} y {p[1]:.17g} z {p[2]:.17g}\n" for k, p in enumerate(x, 1))


# ---- bodies


def stretched(body, seed=3):
    """Strained by some percent and shaken; a corner is pulled off, so that bonds are beyond dlim and strains beyond cavitation."""
    x = body.x @ (np.eye(3) + np.array([[0.05, 0.01, 0], [0, -0.08, 0.02], [0, 0, 0.03]]))
    x += np.random.default_rng(seed).uniform(-2e-4, 2e-4, x.shape)
    x[0] -= 0.004
    return x


def state_deck(x, kv_lines, newton="on", within=""):
    columns, strain = ("fx fy fz c_pe c_stress[1] f_volume", STRAIN) if kv_lines else ("fx fy fz c_pe c_stress[1]", "")
    text = head(newton) + pair(ROW, "none", f"fix bonds all evp/bonds {within}") + kv_lines + QUIET + "run 0\n" + place(x)
    text += "compute pe all pe/atom\ncompute stress all stress/atom NULL\n" + dump(every=1, columns=columns)
    return text + thermo(f"pe pxx pyy pxy vol {strain}") + "run 0\n"


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (4, "off")])
@pytest.mark.parametrize("case", ["one", "types", "group", "no end", "two bodies"])
def test_a_body_against_the_second_writing(lmp, tmp_path, ranks, newton, case):
    """What the fix adds to a run without it: forces, energy, virial, per atom too. kv of an atom's own type; none outside the group. Unbonded
    pairs count, though contact none gives them no force of their own. Those of two bodies, which are pressed into each other, only push."""
    body = two_bodies((6, 4, 4)) if case == "two bodies" else lattice_body((5, 4, 4))
    write_body(tmp_path / "body.data", body)
    x = stretched(body)
    if case == "two bodies":
        x -= np.outer(body.types == 2, [0.004, 0.0, 0.0])
    kv = {"types": np.where(body.types == 1, 300.0, 2000.0), "group": np.where(body.types == 1, KV, 0.0)}.get(case, np.full(len(x), KV))
    lines = {"one": fix(), "two bodies": fix(more="across yes"), "types": fix("300 2000"), "group": "group some type 1\n" + fix(group="some"), "no end": fix(more="cavitation none")}[case]
    expected = truth(x, body, kv, cavitation=np.inf if case == "no end" else 0.15)
    now = brute.find_pairs(x, body.radius, ROW.alpha)
    fresh = len(set(zip((now.i + 1).tolist(), (now.j + 1).tolist())) - set(body.bonds))
    assert fresh > 5 and len(now.i) - fresh < len(body.bonds) - 5, "control: new pairs, and bonds beyond dlim"

    def state(text):
        run = lmp(state_deck(x, text, newton, "within type" if case == "two bodies" else ""), ranks).ok()
        return run.dump("all.dump")[-1], run.thermo()

    (before, plain), (after, table) = state(""), state(lines)
    scale = np.zeros(len(x))
    for atoms in (now.i, now.j):
        np.add.at(scale, atoms, np.abs(expected.pair_force))
    own = np.linalg.norm(before.f, axis=1)
    added = after.f - before.f
    assert np.all(np.linalg.norm(added - expected.force, axis=1) <= BY_HAND * (scale + own))
    assert np.abs(after.f.sum(axis=0)).max() <= BY_HAND * scale.sum(), "momentum"
    assert np.abs(after["f_volume"] - expected.theta).max() <= BY_HAND
    # the energy of the network is that of dlim, thousands of times the strain energy
    assert after["c_pe"] - before["c_pe"] == pytest.approx(expected.energy, abs=BY_HAND * np.abs(before["c_pe"]).max())
    assert table["f_volume"][0] == pytest.approx(expected.energy.sum(), rel=BY_HAND)
    assert table["PotEng"][0] - plain["PotEng"][0] == pytest.approx(expected.energy.sum(), rel=1e-9)
    counted = expected.theta[kv > 0.0]
    assert [table[f"f_volume[{k}]"][0] for k in (1, 2, 3)] == pytest.approx([counted.mean(), counted.min(), counted.max()], abs=BY_HAND)
    assert table["f_volume[4]"][0] == np.count_nonzero(counted > 0.15) * (case != "no end") and np.any(counted > 0.15)
    for name, (a, b) in {"Pxx": (0, 0), "Pyy": (1, 1), "Pxy": (0, 1)}.items():
        got = (table[name] - plain[name])[0] * table["Volume"][0]
        assert got == pytest.approx(expected.virial[a, b], abs=1e-10 * np.abs(expected.virial).max()), name
    of_atoms = np.zeros(len(x))
    for atoms in (now.i, now.j):
        np.add.at(of_atoms, atoms, 0.5 * expected.pair_force * now.r[:, 0] ** 2 / now.d)
    assert before["c_stress[1]"] - after["c_stress[1]"] == pytest.approx(of_atoms, abs=1e-9 * np.abs(of_atoms).max())


# ---- whatever comes first, goes or changes

HYBRID = f"pair_style hybrid evp/lj contact none zero 0.01\npair_coeff 1 1 evp/lj {words(ROW)}\npair_coeff * 2 zero\nfix bonds all evp/bonds\n"


def moved(x, columns="f_volume"):
    """A set-up at rest, and one at these places."""
    return QUIET + "run 0\n" + place(x) + dump(every=1, columns=columns) + "run 0\n"


@pytest.mark.parametrize("order", ["before evp/bonds", "after the first run", "unfixed and defined again"])
def test_whenever_it_is_defined(lmp, small, order):
    """The density at rest is that of the bonds as recorded, not of what is near now."""
    x = stretched(small)
    bonds, move = "fix bonds all evp/bonds\n", place(x)
    lines = {"before evp/bonds": fix() + bonds + QUIET + "run 0\n" + move,
             "after the first run": bonds + QUIET + "run 0\n" + move + "run 0\n" + fix(),
             "unfixed and defined again": bonds + fix() + QUIET + "run 0\n" + move + "run 0\nunfix volume\nrun 0\n" + fix()}[order]
    run = lmp(head() + pair(fix="") + lines + thermo(STRAIN) + dump(every=1, columns="f_volume") + "run 0\n", ranks=2).ok()
    expected = truth(x, small, KV)
    assert np.abs(run.dump("all.dump")[-1]["f_volume"] - expected.theta).max() <= BY_HAND


def test_a_zone_is_that_of_the_density(lmp, small):
    """Recorded anew, from a restart file, from a bond file, and recorded anew beside a fix evp/volume that stays."""
    x = small.x * 1.002
    text = head() + pair() + fix() + QUIET + "run 0\nunfix bonds\nfix bonds all evp/bonds zone 1.2\n" + thermo("f_bonds")
    anew = lmp(text + "run 0\nwrite_evp_bonds z.bonds\nwrite_restart z.restart\nunfix move\nunfix volume\n" + fix() + moved(x), ranks=2).ok()
    fewer = small._replace(bonds=brute.record_bonds(small.x, small.radius, 1.2))
    assert anew.thermo()["f_bonds"][0] == len(fewer.bonds) < len(small.bonds)
    expected = truth(x, fewer, KV, 1.2).theta
    found = [anew.dump("all.dump")[-1]["f_volume"]]
    found.append(lmp(head(start="read_restart z.restart") + "fix bonds all evp/bonds\n" + fix() + moved(x)).ok().dump("all.dump")[-1]["f_volume"])
    found.append(lmp(head() + pair(fix="fix bonds all evp/bonds file z.bonds\n") + fix() + moved(x)).ok().dump("all.dump")[-1]["f_volume"])
    found.append(lmp(text + moved(x)).ok().dump("all.dump")[-1]["f_volume"])
    for theta in found:
        assert np.abs(theta - expected).max() <= BY_HAND


def without(body, gone):
    """The body after its atoms of this mask have gone, under its IDs."""
    return body._replace(bonds={two: deq for two, deq in body.bonds.items() if not (gone[two[0] - 1] or gone[two[1] - 1])})


GONE = {"two spheres": lambda x: np.isin(np.arange(len(x)), [0, 19]),
        "a drilled hole": lambda x: np.linalg.norm((x - x.mean(axis=0))[:, :2], axis=1) < 0.008,
        "vacancies": lambda x: np.arange(len(x)) % 7 == 3}
LOADED = [1.003, 0.999, 1.002]


@pytest.mark.parametrize("shape, ranks, newton", [*((shape, 1, "on") for shape in GONE), ("a drilled hole", 3, "off")])
@pytest.mark.parametrize("way", ["deleted at rest", "deleted under load", "evaporated under load", "another style", "deleted after a restart"])
def test_a_body_without_some_of_its_spheres(lmp, small, way, shape, ranks, newton):
    """It is free of stress at rest, and under load what a body is that never had them, also after a restart."""
    gone = GONE[shape](small.x)
    go = f"group gone id {' '.join(map(str, np.flatnonzero(gone) + 1))}\n"
    delete = "delete_atoms group gone compress no\n"
    rest, load = "run 0\n", QUIET + place(small.x * LOADED)
    styles = HYBRID if way == "another style" else pair()
    start = head(newton) + styles.replace("pair_coeff * 2 zero", "pair_coeff * 3 zero\npair_coeff * 2 evp/lj " + words(ROW)) + fix()
    if way == "another style":
        start = start.replace("read_data body.data", "read_data body.data extra/atom/types 1")
    text = start + go + "fix none all nve/noforce\n" + rest + "unfix none\n" + {
        "deleted at rest": delete + QUIET + rest + load.replace(QUIET, ""),
        "deleted under load": load + rest + delete,
        "evaporated under load": load + rest + f"region all block INF INF INF INF INF INF\nfix leave gone evaporate 1 {gone.sum()} all 4711\n"
                                               "reset_timestep 0\ntimestep 1e-15\nrun 1\nunfix leave\n",
        "another style": load + rest + "set group gone type 3\n",
        "deleted after a restart": load + rest + "write_restart now.restart\nclear\n" + head(newton, start="read_restart now.restart")
                                   + (styles if way == "another style" else "") + "fix bonds all evp/bonds\n" + fix() + QUIET + delete}[way]
    run = lmp(text + "group left subtract all gone\n" + dump(every=1, columns="f_volume fx fy fz").replace("dump all all", "dump all left")
              + "run 0\nwrite_restart later.restart\n", ranks).ok()
    expected = truth(small.x * LOADED, without(small, gone), KV, among=~gone)
    assert np.abs(expected.theta[~gone]).max() > 0.003 and gone.sum() > 1, "control"
    found = run.dump("all.dump")[-1]
    assert np.abs(found["f_volume"] - expected.theta[~gone]).max() <= 1e-10
    if way == "deleted at rest":
        assert run.dump("all.dump")[-1].f.shape[0] == (~gone).sum()
        again = lmp(head(newton, start="read_restart later.restart") + "fix bonds all evp/bonds\n" + fix() + QUIET
                    + dump(every=1, columns="f_volume") + "run 0\n", ranks=2).ok()
        assert np.abs(again.dump("all.dump")[-1]["f_volume"] - found["f_volume"]).max() <= BY_HAND
        late = lmp(head(newton, start="read_restart later.restart") + "fix bonds all evp/bonds\nrun 0\nfix other all evp/volume 1000\n" + QUIET
                   + dump(every=1, columns="f_other") + "run 0\n", ranks=2).ok()
        assert np.abs(late.dump("all.dump")[-1]["f_other"] - found["f_volume"]).max() <= BY_HAND, "defined after they were deleted"


# ---- pairs that break


XI = 0.05
CRACKS = {"a cut": lambda x, m: np.outer(x[:, 0] > m, [0.0025, 0, 0]),
          "a shear crack": lambda x, m: np.outer((x[:, 0] > m) & (x[:, 1] > 0.012), [0.0005, 0.002, 0.001]),
          "two cuts": lambda x, m: np.outer(x[:, 0] > m, [0.0018, 0, 0]) + np.outer(x[:, 2] > 0.02, [0, 0.0003, 0.0022])}


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (3, "off")])
@pytest.mark.parametrize("crack", CRACKS)
def test_surfaces_of_a_crack_push_and_never_pull(lmp, tmp_path, crack, ranks, newton):
    """Broken at x1, opened further, then closed and pressed, against the second writing; what the volume energy adds is the difference to runs
    without it. The same after a restart."""
    body = lattice_body((6, 4, 4))
    write_body(tmp_path / "body.data", body)
    middle = np.median(body.x[:, 0])
    x1 = body.x + CRACKS[crack](body.x, middle)
    i, j = np.array(list(itertools.combinations(range(len(body.x)), 2))).T
    near = np.linalg.norm(body.x[i] - body.x[j], axis=1) < 4 * SPACING
    i, j = i[near], j[near]
    dlim = ROW.alpha * (body.radius[i] + body.radius[j])
    deq = np.array([body.bonds.get((a + 1, b + 1), np.inf) for a, b in zip(i, j)])
    bonds = np.isfinite(deq)
    rest = volume.at_rest(i[bonds], j[bonds], deq[bonds], dlim[bonds], len(body.x), body.types)
    broken = bonds & (np.linalg.norm(x1[i] - x1[j], axis=1) > np.minimum(dlim, (1 + XI) * deq))
    before = volume.evaluate(x1, i, j, dlim, KV, rest, fresh=~bonds)
    rest = volume.torn(x1, i, j, dlim, rest, ~bonds, broken)
    fresh = ~bonds | broken
    after = volume.evaluate(x1, i, j, dlim, KV, rest, fresh=fresh)
    assert after.energy.sum() == pytest.approx(before.energy.sum(), rel=1e-12) and broken.sum() > 15, "control"
    stages = {"opened": x1 + CRACKS[crack](body.x, middle), "closed": body.x, "pressed": body.x * [0.93, 1.0, 0.99]}
    start = head(newton, skin=0.004) + pair(contact=f"repulsive break {XI}")
    still = "fix still all nve/noforce\ntimestep 1e-15\n"
    end = "".join(f"{place(x)}{thermo('f_volume')}run 0\nwrite_dump all custom NAME.{stage} id f_volume fx fy fz modify format float %.17g sort id\n"
                  for stage, x in stages.items())
    through = start + fix() + still + "run 0\n" + place(x1) + "run 1\nwrite_restart broken.restart\n" + end
    again = head(newton, start="read_restart broken.restart", skin=0.004) + "fix bonds all evp/bonds\n" + fix() + still + end
    runs = {"through": lmp(through.replace("NAME", "through"), ranks).ok(), "again": lmp(again.replace("NAME", "again"), ranks=2).ok()}
    alone = lmp((start + still + "run 0\n" + place(x1) + "run 1\n" + end).replace("f_volume", "").replace("NAME", "alone")).ok()
    for k, (stage, x) in enumerate(stages.items()):
        more = ~fresh & (np.linalg.norm(x[i] - x[j], axis=1) > np.minimum(dlim, (1 + XI) * deq))  # they would break at the end of a step
        now = volume.torn(x, i, j, dlim, rest, fresh, more)
        expected = volume.evaluate(x, i, j, dlim, KV, now, fresh=fresh | more)
        scale = np.abs(expected.pair_force).max()
        torn = rest.torn[i] & rest.torn[j] & fresh
        assert np.all(expected.pair_force[torn] >= 0.0) and np.any(expected.pair_force[torn] > 0.01 * scale) == (stage == "pressed")
        for name, run in runs.items():
            found, plain = run.dump(f"{name}.{stage}")[-1], alone.dump(f"alone.{stage}")[-1]
            assert np.abs(found["f_volume"] - expected.theta).max() <= 1e-11, (stage, name)
            assert np.abs(found.f - plain.f - expected.force).max() <= 1e-9 * (scale + np.abs(plain.f).max()), (stage, name)
            assert run.thermo(k - 3)["f_volume"][-1] == pytest.approx(expected.energy.sum(), rel=1e-10)


EXCLUDED = {"groups": ("neigh_modify exclude group left right\n", "neigh_modify exclude none\n"),
            "half of a plane": ("neigh_modify exclude group notch right\n", "neigh_modify exclude none\n"),
            "types": ("neigh_modify exclude type 1 2\n", "neigh_modify exclude none\n"),
            "one of two": ("neigh_modify exclude group left right exclude group notch notch\n",
                           "neigh_modify exclude none\nneigh_modify exclude group notch notch\n"),
            "a bond file without them": ("", "")}


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (3, "off")])
@pytest.mark.parametrize("way", EXCLUDED)
def test_a_crack_from_the_beginning(lmp, tmp_path, way, ranks, newton):
    """Pairs that were left out of the recording have no force at rest, nor where an exclusion is undone under load; pressed, they push."""
    body = lattice_body((6, 4, 4))
    body = body._replace(types=1 + (body.x[:, 0] > np.median(body.x[:, 0])).astype(int))
    write_body(tmp_path / "body.data", body)
    off, on = EXCLUDED[way]
    groups = "group left type 1\ngroup right type 2\nregion notch block INF INF INF 0.02 INF INF\ngroup notch region notch\ngroup notch intersect notch left\n"
    groups = groups.replace("group notch region notch\ngroup notch intersect notch left", "group low region notch\ngroup notch intersect low left")
    bonds = "fix bonds all evp/bonds\n"
    if way == "a bond file without them":
        lmp(head() + pair() + QUIET + "run 0\nwrite_evp_bonds all.bonds\n").ok()
        lines = (tmp_path / "all.bonds").read_text(encoding="utf-8").splitlines()
        kept = [line for line in lines if not line[:1].isdigit() or len({body.types[int(word) - 1] for word in line.split()[:2]}) == 1]
        count = sum(line[:1].isdigit() for line in kept)
        assert count < sum(line[:1].isdigit() for line in lines)
        total = str(len(body.bonds))
        text = "\n".join(line if line[:1].isdigit() else line.replace(total, str(count)) for line in kept) + "\n"
        (tmp_path / "cut.bonds").write_text(text, encoding="utf-8")
        bonds = "fix bonds all evp/bonds file cut.bonds\n"
    start = head(newton) + groups + pair(contact="none", fix=off + bonds) + fix() + QUIET + thermo("f_volume pe f_bonds[3]")
    lift = "compute force right group/group left\n" + thermo("f_volume pe c_force[1]")
    pressed = place(body.x * [0.9, 1.0, 1.0])
    run = lmp(start + "run 0\n" + on + lift + "run 0\n" + pressed + "run 0\n", ranks).ok()
    rest, press = run.thermo(-2), run.thermo(-1)
    assert abs(rest["f_volume"][0]) < 1e-20 and press["c_force[1]"][0] > 100.0
    if way in ("groups", "types", "a bond file without them"):
        assert abs(rest["c_force[1]"][0]) < 1e-6
    for load in ([1.004, 1.0, 1.0], [1.001, 1.002, 1.0]) if off else ():  # no other new pairs
        loaded = place(body.x * load)
        run = lmp(start + "run 0\n" + loaded + thermo("f_volume pe") + "run 0\nwrite_restart off.restart\n" + on + "run 0\n", ranks).ok()
        before, after = run.thermo(-2), run.thermo(-1)
        again = lmp(head(newton, start="read_restart off.restart") + groups.replace("group left", "group all union all\ngroup left") + bonds + fix() + QUIET
                    + thermo("f_volume pe") + (on if way == "one of two" else "") + "run 0\n").ok().thermo(-1)
        for name in ("f_volume", "PotEng"):
            assert after[name][0] == pytest.approx(before[name][0], rel=1e-10) and before["f_volume"][0] > 0.01
            assert again[name][0] == pytest.approx(before[name][0], rel=1e-10), "the exclusion is not in the restart file"


@pytest.mark.parametrize("ranks", [1, 2])
def test_strains_are_there_at_any_time(lmp, small, ranks):
    """0 before the first forces and of new atoms, also where they touch others; between runs each atom keeps its own."""
    write = "write_dump all custom {}.dump id f_volume modify format float %.17g\n"
    text = head() + pair() + fix() + QUIET + write.format("before") + "run 0\n" + place(stretched(small)) + "run 0\n" + write.format("after")
    text += "group gone id 1 5 20\ndelete_atoms group gone compress no\n"
    text += "".join(f"create_atoms 1 single 0.0{k}5 0.015 -0.006\n" for k in range(3)) + write.format("changed")
    text += "set atom 37*39 diameter 0.01 density 2700\nrun 0\nwrite_dump all custom touching.dump id f_volume fx\n"
    run = lmp(text, ranks).ok()
    before, after, changed = ({int(number): value for number, value in zip(snapshot["id"], snapshot["f_volume"])}
                              for snapshot in (run.dump(f"{name}.dump")[-1] for name in ("before", "after", "changed")))
    assert before == dict.fromkeys(range(1, len(small.x) + 1), 0.0)
    assert min(map(abs, after.values())) > 0.0, "control"
    assert changed == {**{number: after[number] for number in after if number not in (1, 5, 20)}, **dict.fromkeys(range(len(small.x) + 1, len(small.x) + 4), 0.0)}
    last = run.dump("touching.dump")[-1]
    assert list(last["id"][-3:]) == [37, 38, 39] and np.all(last["f_volume"][-3:] == 0.0) and np.any(last["fx"][-3:] != 0.0)


def test_beside_another_style_in_hybrid(lmp, small):
    """Atoms of type 2 interact by another style only: no bonds, no volume."""
    ones, x = small.types == 1, small.x * 1.002
    fewer = small._replace(bonds={two: d for two, d in small.bonds.items() if ones[two[0] - 1] and ones[two[1] - 1]})
    theta = lmp(head() + HYBRID + fix() + moved(x), ranks=2).ok().dump("all.dump")[-1]["f_volume"]
    assert len(fewer.bonds) > 10 and np.all(theta[~ones] == 0.0)
    assert np.abs(theta - truth(x, fewer, KV, among=ones).theta).max() <= BY_HAND


def test_pairs_of_two_bodies_do_not_count(lmp, tmp_path):
    """Two blocks pushed into each other, bodies by type: each atom has the density of its own body alone."""
    body = two_bodies((6, 3, 3))
    write_body(tmp_path / "body.data", body)
    x = body.x - np.outer(body.types == 2, [0.003, 0.0, 0.0])
    text = head(skin=0.008) + pair(contact="repulsive", fix="fix bonds all evp/bonds within type\n") + fix() + moved(x)
    theta = lmp(text, ranks=2).ok().dump("all.dump")[-1]["f_volume"]
    alone = [truth(x, body, KV, among=body.types == kind).theta for kind in (1, 2)]
    assert np.abs(theta - np.where(body.types == 1, *alone)).max() <= BY_HAND
    assert np.abs(theta).max() < 1e-12, "rigid bodies"


def test_two_bodies_that_touch(lmp, tmp_path):
    """With across, their pairs fill the gaps at their surfaces: no force at rest, nor as they move apart, with restarts of both."""
    body = two_bodies((6, 3, 3))
    write_body(tmp_path / "body.data", body)
    for way in (0.0, 0.001):
        x = body.x + np.outer(body.types == 2, [way, 0.0, 0.0])
        text = head(skin=0.008) + pair(contact="none", fix="fix bonds all evp/bonds within type\n") + fix(more="across yes") + moved(x, "f_volume fx fy fz")
        text += "write_restart now.restart\n"
        again = head(start="read_restart now.restart", skin=0.008) + "fix bonds all evp/bonds within type\n" + fix(more="across yes")
        again += dump(every=1, columns="f_volume fx fy fz") + "run 0\n"
        for frame in (lmp(one, ranks=2).ok().dump("all.dump")[-1] for one in (text, again)):
            assert np.abs(frame["f_volume"]).max() < 1e-12 and np.abs(frame.f).max() < 1e-8


@pytest.mark.parametrize("style, more, atoms", [(pair(contact="none", fix="fix bonds all evp/bonds within type\n"), fix(), "all"), (HYBRID, "", "some")])
def test_types_that_change_after_the_recording(lmp, tmp_path, style, more, atoms):
    """Bonds remain in a body at rest, whatever its types are; those of a pair that another style has now are left out. No atom feels it."""
    body = lattice_body((4, 3, 3))
    write_body(tmp_path / "body.data", body._replace(types=np.ones(len(body.x), dtype=int)))
    lines = head().replace("read_data body.data", "read_data body.data extra/atom/types 1")
    text = lines + style + more + QUIET + "run 0\nset atom 1*12 type 2\n" + ("" if more else fix())
    text += thermo(f"pe {STRAIN}") + dump(every=1, columns="fx fy fz") + "run 0\n"
    run = lmp(text, ranks=2).ok()
    table = run.thermo()
    assert abs(table["f_volume"][-1]) < 1e-20 and abs(table["f_volume[1]"][-1]) < 1e-14 and np.isfinite(table["PotEng"][-1])
    assert atoms == "some" or np.abs(run.dump("all.dump")[-1].f).max() < 1e-8


@pytest.mark.parametrize("across", ["no", "yes"])
@pytest.mark.parametrize("rule, way", [("plasticity isotropic", 0.0012), ("break 0.05", 0.0009)])
@pytest.mark.parametrize("neighbors", ["every 1 delay 0 check yes", "every 1000 delay 0 check no", "every 1 delay 0 check no"])
def test_a_bond_of_two_bodies_that_ends(lmp, rule, way, neighbors, across):
    """A bond whose atoms are of two bodies by now ends, past dlim or before: the pair has no force from then on, with across where it is farther than at rest, however
    seldom lists are built."""
    start = """region box block -0.05 0.05 -0.05 0.05 -0.05 0.05
create_box 2 box
create_atoms 1 single 0 0 0
create_atoms 1 single 0.014 0 0
set group all diameter 0.01 density 2700"""
    text = head(start=start, skin=0.004) + pair(contact="repulsive", fix="fix bonds all evp/bonds within type") + fix(50.0, more=f"across {across}")
    text = text.replace("contact repulsive", f"contact repulsive {rule}") + f"run 0\nset atom 2 type 2\nneigh_modify {neighbors}\ntimestep 1e-9\n"
    text += f"group second id 2\nfix sway second move wiggle {way} 0 0 4e-8\n" + dump(every=1, columns="x fx") + "run 40 post no\n"
    frames = lmp(text).ok().dump("all.dump")
    apart, forces = (np.array([frame[name][1] for frame in frames]) for name in ("x", "fx"))
    later = np.arange(len(frames)) > 10
    assert forces[:5].min() < 0.0 and apart[later].min() < 0.0135 and apart.max() == pytest.approx(0.014 + way, rel=1e-3)
    assert np.all(forces[later & (apart > 0.0140001)] == 0.0)
    near = forces[later & (apart < 0.0139999)]
    assert np.all(near > 0.0) if across == "yes" else np.all(near == 0.0)


def test_references_that_nobody_knows(lmp, small):
    """The fix is defined once bonds have flowed: it says of how many atoms it takes the distances of now for those at rest."""
    text = head() + pair(contact="repulsive", fix="fix bonds all evp/bonds").replace("contact repulsive", "contact repulsive plasticity isotropic")
    text += QUIET + "run 0\ndisplace_atoms all ramp x 0 0.002 x 0 0.05\nrun 2\n" + fix() + "run 0\n"
    said = [line for line in lmp(text).ok().warnings() if "densities at rest of" in line]
    assert len(said) == 1 and "define the fix before the first run, and right after read_restart" in said[0]


def test_pairs_of_special_bonds_with_weight_0(lmp, tmp_path):
    """They are neither recorded nor counted, whether or not they are in the neighbor list: f is the sum of the forces of pair/local."""
    x = np.array([[0, 0, 0], [0.01, 0, 0], [0.005, 0.0087, 0], [0.005, 0.003, 0.008]])
    made = "".join(f"create_atoms 1 single {a} {b} {c}\n" for a, b, c in x)
    start = f"""special_bonds lj 0 0 0 coul COUL COUL COUL
region box block -0.05 0.05 -0.05 0.05 -0.05 0.05
create_box 1 box bond/types 1 extra/bond/per/atom 4 extra/special/per/atom 10
{made}set group all diameter 0.01 density 2700
bond_style zero
bond_coeff *
create_bonds single/bond 1 1 2"""
    text = "clear\n" + head(boundary="p p p", start=start, style="hybrid sphere bond", skin=0.002) + pair(contact="none") + fix() + QUIET + "run 0\n"
    text += place(x * [1.04, 1.0, 1.0]) + "compute pairs all pair/local fx\ncompute ids all property/local patom1 patom2\n"
    text += dump(every=1, columns="fx") + "dump pairs all local 1 pairs.dump c_ids[*] c_pairs\ndump_modify pairs format float %.17g\n"
    text += thermo("pe f_bonds f_volume") + "run 0\n"
    run = lmp(text.replace("COUL", "0") + text.replace("COUL", "1")).ok()
    table, local = run.thermo(), run.dump("pairs.dump")[-1]
    total = np.zeros(4)
    for sign, name in ((1.0, "c_ids[1]"), (-1.0, "c_ids[2]")):
        np.add.at(total, local[name].astype(int) - 1, sign * local["c_pairs"])
    assert table["f_bonds"][-1] == 5 and table["f_volume"][-1] > 0.1
    assert run.dump("all.dump")[-1]["fx"] == pytest.approx(total, rel=1e-11, abs=1e-7)
    energies = re.findall(r"^ +0 +(\S+) +5 +\S+ *$", run.stdout, re.M)
    assert len(energies) == 2 and energies[0] == energies[1]


# ---- moduli


def packing(lmp, folder, count=300, fraction=0.62):
    """A dense random packing in a periodic cube, as packed.data; its side."""
    rng = np.random.default_rng(1)
    radius = rng.uniform(0.0045, 0.0055, count)
    side = (4.0 / 3.0 * np.pi * np.sum(radius**3) / fraction) ** (1.0 / 3.0)
    write_data(folder / "random.data", rng.uniform(0.0, side, (count, 3)), radius, [[0.0, side]] * 3)
    text = head(boundary="p p p", start="read_data random.data", skin=0.002) + "pair_style soft 0.01\npair_coeff * * 1000\n"
    text += "min_modify dmax 1e-3 line quadratic\nminimize 0 1e-6 2000 20000\npair_style none\n" + pair(contact="repulsive", fix="")
    lmp(text + "min_modify dmax 1e-4\nminimize 0 1e-3 5000 50000\nwrite_data packed.data nocoeff\n").ok()
    return side


def modulus(lmp, change, stress, kv, strain=1e-5):
    """Slope of a stress over strains of either sign, relaxed: the line search sees the energy of the fix, without it, it would stop far from rest."""
    values = []
    for sign in (-1, 1):
        text = head(boundary="p p p", start="read_data packed.data", skin=0.001) + "change_box all triclinic\n" + pair(contact="none") + (fix(kv) if kv else "")
        text += "run 0\nchange_box all " + change(sign * strain) + " remap units box\n" + thermo("press pxy fnorm")
        table = lmp(text + "min_modify line quadratic dmax 1e-5\nminimize 0 1e-6 3000 30000\n", ranks=2 if kv else 1).ok().thermo()
        assert table["Fnorm"][-1] < 1e-6 * table["Fnorm"][0]
        values.append(table[stress][-1])
    return (values[0] - values[1]) / (2.0 * strain)


def test_moduli_of_a_periodic_body(lmp, tmp_path):
    """K = E0/1.5 + kv N/V and G = 0.4 E0, with E0 that of the network alone; nu follows."""
    count, kv = 300, 1000.0
    side = packing(lmp, tmp_path, count)
    (k0, g0), (k, g) = ((modulus(lmp, lambda e: " ".join(f"{axis} scale {1.0 + e:.17g}" for axis in "xyz"), "Press", of) / 3.0,
                         modulus(lmp, lambda e: f"xy delta {e * side:.17g}", "Pxy", of)) for of in (0, kv))
    expected = volume.moduli(9.0 * k0 * g0 / (3.0 * k0 + g0), kv, count / side**3)
    assert k == pytest.approx(expected.bulk, rel=0.02)
    assert g == pytest.approx(expected.shear, rel=0.02)
    assert g == pytest.approx(g0, rel=0.01)
    assert (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g)) == pytest.approx(expected.poisson, abs=0.005)


def test_what_is_reported_is_of_the_forces(lmp, tmp_path):
    """compute evp/dt asks for the stiffness where a box that deforms has put the atoms since: f_volume stays."""
    write_body(tmp_path / "body.data", lattice_body((4, 4, 4), "xyz"))
    text = head(boundary="p p p") + pair(contact="none") + fix() + "fix box all deform 1 x erate 5 remap x\nfix move all nve\ntimestep 1e-6\ncompute dt all evp/dt\nthermo 10\n"
    plain, asked = (lmp(text + thermo(columns) + "run 50\n", ranks=2).ok().thermo() for columns in ("f_volume f_volume[1]", "c_dt f_volume f_volume[1]"))
    assert plain["f_volume"][-1] > 1e-3, "control"
    for name in ("f_volume", "f_volume[1]"):
        assert np.array_equal(plain[name], asked[name])
