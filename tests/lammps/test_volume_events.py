# SPDX-License-Identifier: GPL-2.0-only
"""What each event changes in the volume energy, as the table of fix_evp_volume.rst has it: nothing jumps that it says does not."""

import numpy as np
import pytest
from evp import law
from flowing import failing_at, read_pairs
from small_bodies import dump, head, lattice_body, pair, thermo, velocities, write_body

FLOWS = law.TABLE1._replace(xi_s=0.004)
ANOTHER_ORDER = 1e-9  # of the largest value: sums in another order, over some dozen steps
VOLUME = "fix volume all evp/volume 500\n"
# to and fro, so that pairs come, join and part within some hundred steps
SHAKE = velocities("200*(x-0.04)+70*sin(5.1*id)", "70*cos(7.3*id)", "-200*(z-0.02)+70*sin(2.7*id)")
COLUMNS = thermo("pe f_volume f_volume[3] f_bonds[5] f_bonds[6]") + "thermo 1\n"
TWO = "join 1.2 all plasticity isotropic", "fix bonds all evp/bonds within type", None, ""
SCENES = {"two bodies that join": TWO, "two bodies that join, across": TWO,
          "surfaces of one that join": ("join 1.2 plasticity isotropic", "fix bonds all evp/bonds zone 1.1", None, ""),
          "a crack that joins": ("join 1.2 plasticity isotropic", "fix bonds all evp/bonds zone 1.1", 0.02, ""),
          "torn open": ("repulsive plasticity isotropic", "fix bonds all evp/bonds zone 1.1", None, "4000*(x-0.02)")}


@pytest.mark.parametrize("scene, ranks, newton", [*((scene, *ways) for scene in SCENES for ways in ((1, "on"), (2, "off"))), ("a crack that joins", 3, "on")])
def test_a_run_is_the_same_cut_in_two(lmp, tmp_path, scene, ranks, newton):
    """In a step in which bonds begin or end: the set-up after it finds the same forces, strains and energies as that step, and the run goes on to the same end,
    also from a restart file and from a bond file's. gamma is 0."""
    contact, bonds, fails, pull = SCENES[scene]
    volume = VOLUME.replace("500", "500 across yes" if "across" in scene else "500")
    body = lattice_body((4, 3, 3))
    write_body(tmp_path / "body.data", body)
    steps = 150
    style = pair(FLOWS, contact, bonds, failing_at(fails)) + volume
    move = "fix move all nve\ntimestep 4e-7\n" + COLUMNS
    start = head(newton, "s s s", skin=0.002) + style + SHAKE + (velocities(f"vx+{pull}", "vy", "vz") if pull else "")
    frames = dump("{}.dump", 1, "x y z fx fy fz f_volume")
    whole = lmp(start + move + frames.format("whole") + f"run {steps}\n", ranks).ok()
    table, all_frames = whole.thermo(), whole.dump("whole.dump")
    joins, beyond = np.flatnonzero(np.diff(table["f_bonds[6]"]) > 0) + 1, np.argmax(table["f_volume[3]"] > 0.15)
    opens = 10 * (beyond // 10 + 1)  # limits move on
    cuts = [opens - 1, opens, opens + 1] if scene == "torn open" else joins[[0, -1]]
    for cut in cuts:
        text = start + move + f"run {cut}\nwrite_restart cut.restart\n" + frames.format("after") + f"run {steps - cut}\n"
        going = lmp(text, ranks).ok()
        again = lmp(head(newton, start="read_restart cut.restart", skin=0.002) + bonds + "\n" + volume + move + frames.format("again")
                    + f"run {steps - cut}\n", ranks=3 - min(ranks, 2)).ok()
        for run, name in ((going, "after.dump"), (again, "again.dump")):
            others = run.dump(name)
            for mine, other in ((all_frames[cut], others[0]), (all_frames[-1], others[-1])):
                assert mine.step == other.step
                for columns in ("fx fy fz", "x y z", "f_volume"):
                    a, b = mine.vectors(*columns.split()), other.vectors(*columns.split())
                    assert np.abs(a - b).max() <= ANOTHER_ORDER * np.abs(a).max(), (cut, columns, mine.step)
            assert run.thermo()["PotEng"][0] == pytest.approx(table["PotEng"][cut], rel=1e-9)
    assert scene != "torn open" or 0 < beyond < opens < steps, "control: beyond cavitation"


@pytest.mark.parametrize("contact, fails", [("repulsive break 0.02", None), ("none break 0.02", None), ("repulsive plasticity isotropic", 0.02)])
def test_debris_that_is_read_back(lmp, tmp_path, contact, fails):
    """A sphere that has lost all its bonds is pressed into the body: a bond file and a restart file give the forces of the end of the run."""
    body = lattice_body((2, 2, 2))
    write_body(tmp_path / "body.data", body)
    style, move = pair(FLOWS, contact, more=failing_at(fails)) + VOLUME, "fix move all nve/noforce\ntimestep 1e-9\n"
    table = thermo("pe f_volume fmax")
    text = head(skin=0.004) + style + move + "run 0\nset atom 8 x 0.036\nrun 10\n" + f"set atom 8 x {body.x[7, 0] - 0.003:.17g}\nrun 10\n" + table
    text += "write_restart end.restart\nwrite_data end.data nocoeff\nwrite_evp_bonds end.bonds\nrun 0\n"
    whole = lmp(text).ok().thermo()
    by_restart = lmp(head(start="read_restart end.restart", skin=0.004) + "fix bonds all evp/bonds\n" + VOLUME + move + table + "run 0\n").ok().thermo()
    by_file = lmp(head(start="read_data end.data", skin=0.004) + style.replace("evp/bonds", "evp/bonds file end.bonds") + move + table + "run 0\n", ranks=2).ok().thermo()
    assert whole["f_volume"][0] > 0.1, "control"
    for other in (by_restart, by_file):
        for name in ("PotEng", "f_volume", "Fmax"):
            assert other[name][0] == pytest.approx(whole[name][0], rel=1e-9)


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off")])
def test_what_is_beyond_the_cavitation_of_now_opens(lmp, tmp_path, ranks, newton):
    """The fix that counts is that of the step in which limits move on, with references of then: none opens nothing, and set-ups at one place agree."""
    body = lattice_body((5, 3, 3))
    write_body(tmp_path / "body.data", body)
    start = head(newton, "f f f", skin=0.002) + pair(FLOWS, "repulsive plasticity isotropic") + "fix volume all evp/volume 500 cavitation {}\n"
    start += velocities("12000*(x-0.02)") + "fix move all nve\ntimestep 4e-7\n" + thermo("pe f_volume") + "run {}\n"
    again = "unfix volume\nfix volume all evp/volume 500 cavitation {}\nrun {}\n"
    lmp(start.format("none", 18) + again.format(0.02, 1) + again.format("none", 2) + "write_evp_bonds none.bonds\n", ranks).ok()
    lmp(start.format("none", 18) + again.format("none", 1) + again.format(0.02, 2) + "write_evp_bonds some.bonds\n", ranks).ok()
    is_open = [sum(value == 2.0 for value in read_pairs(tmp_path / f"{name}.bonds").column("torn").values()) for name in ("none", "some")]
    assert is_open[0] == 0 < is_open[1]
    row = " ".join(map(str, FLOWS._replace(alpha=1.4)))
    tables = lmp(start.format(0.02, 60) + f"pair_coeff * * {row}\nrun 0\nrun 0\n", ranks).ok()
    first, second = tables.thermo(-2), tables.thermo(-1)
    assert second["PotEng"][0] == pytest.approx(first["PotEng"][0], rel=1e-12) and second["f_volume"][0] == pytest.approx(first["f_volume"][0], rel=1e-12)


HEXAHEDRON = [(1, 0, 0, 0), (1, 1.1, 0, 0), (2, 0, 1.1, 0), (2, 1.1, 1.1, 0), (1, 0, 0, 1.1), (2, 0, 1.1, 1.1)]


def six_spheres(types=3):
    atoms = "".join(f"create_atoms {kind} single {x} {y} {z}\n" for kind, x, y, z in HEXAHEDRON)
    return f"region box block -1 5 -1 5 -1 5\ncreate_box {types} box\n{atoms}set group all diameter 1.0 density 1.0\n"


def quiet(bonds=""):
    return head("NEWTON", start=six_spheres(), skin=0.5) + bonds


ROW = "1 8 4 0.1 8 4 0.01 0"


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off")])
@pytest.mark.parametrize("alphas", [(1.6, 1.45, 1.5), (1.4, 1.6, 1.5), (1.45, 1.45, 1.6)])
def test_another_alpha_is_seen(lmp, alphas, ranks, newton):
    """References are those of the alphas of now, whatever their sum: a body at rest has no strain after pair_coeff, in the same run and after a restart."""
    style = "pair_style evp/lj contact repulsive\n"
    rows = "".join(f"pair_coeff {pair_of} {ROW} {{}}\n" for pair_of in ("1 1", "1 2", "2 2")) + f"pair_coeff * 3 {ROW} 1.5\n"
    rest = "fix bonds all evp/bonds zone 1.3\nfix volume all evp/volume 1.0\nfix move all nve\ntimestep 1e-6\n"
    columns = thermo("pe f_volume f_volume[2] f_volume[3] fmax")
    text = quiet().replace("NEWTON", newton) + style + rows.format(1.5, 1.5, 1.5) + rest.replace(" zone 1.3", "") + columns + "run 0\nwrite_restart then.restart\n"
    here = lmp(text + rows.format(*alphas) + "run 0\n", ranks).ok().thermo()
    there = lmp(head(newton, start="read_restart then.restart", skin=0.5) + rows.format(*alphas) + rest.replace(" zone 1.3", "") + columns + "run 0\n", ranks).ok().thermo()
    for table in (here, there):
        assert abs(table["f_volume"][0]) < 1e-25 and max(abs(table[f"f_volume[{k}]"][0]) for k in (2, 3)) < 1e-14


SWAPS = {"types": ("exclude type 1 2", "exclude none exclude type 1 3"), "groups": ("exclude group one two", "exclude none exclude group one three"),
         "type for group": ("exclude type 1 2", "exclude none exclude group three three"),
         "two for one": ("exclude type 1 2 exclude type 2 3", "exclude none exclude type 2 3 exclude type 3 3")}


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off")])
@pytest.mark.parametrize("swap", SWAPS)
def test_an_exclusion_that_goes_is_seen(lmp, swap, ranks, newton):
    """One rule of neigh_modify exclude in place of another, so that their number stays: pairs that come are surfaces, and a body at rest has no force."""
    first, then = SWAPS[swap]
    groups = "group one type 1\ngroup two type 2\ngroup three type 3\n"
    style = f"pair_style evp/lj contact none\npair_coeff * * {ROW} 1.5\n"
    rest = "fix bonds all evp/bonds\nfix volume all evp/volume 1.0\nfix move all nve\ntimestep 1e-6\n"
    columns = thermo("pe f_volume f_volume[3] fmax")
    text = quiet(groups).replace("NEWTON", newton) + style + f"neigh_modify {first}\n" + rest + columns + "run 0\nwrite_restart then.restart\n"
    here = lmp(text + f"neigh_modify {then}\nrun 0\n", ranks).ok().thermo()
    restarted = head(newton, start="read_restart then.restart", skin=0.5) + f"neigh_modify {then.replace('exclude none ', '')}\n"
    there = lmp(restarted + rest + columns + "run 0\n", ranks).ok().thermo()
    for table in (here, there):
        assert abs(table["f_volume"][0]) < 1e-25 and abs(table["Fmax"][0]) < 1e-12
