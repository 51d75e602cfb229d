# SPDX-License-Identifier: GPL-2.0-only
"""Beside LAMMPS' other ways to run: minimisers, rerun, run 0, fix adapt, unloaded plugins, two LAMMPS in one process."""

import subprocess
import sys

import numpy as np
import pytest
from evp import law
from hostile import refused
from lammps_run import SECONDS
from small_bodies import (ANOTHER_ORDER, MOVE, ROUND_OFF, STIR, assert_eventful, assert_same_curve, check_forces, dump,
                          head, pair, record, thermo, write_body)

SHOW = thermo("pe fmax f_bonds f_bonds[2]")


STRETCH = "displace_atoms all ramp x 0 0.0012 x 0 0.06\n"


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (3, "off")])
@pytest.mark.parametrize("style", ["fire", "cg"])
def test_minimisation_of_a_body(lmp, bar, style, ranks, newton):
    """A stretched bar finds its way back towards the recorded places: energy falls at every output, forces vanish
    beside the yield force, and those left are the law's without damping. 500 iterations: 6 modes of a bar of 6 cells
    need some dozens."""
    row = law.TABLE1._replace(gamma=1000.0)
    run = lmp(head(newton) + pair(row, contact="none") + SHOW + "thermo 1\ntimestep 1e-7\n" + f"""
minimize 0 0 1 1
{STRETCH}
min_style {style}
min_modify dmax 1e-4
{dump(every=1)}
thermo 100
minimize 0 1e-3 500 2000
""", ranks=ranks).ok()
    table = run.thermo(-1)
    assert run.stdout.count("recorded") == 1, "by the first minimisation"
    assert table["f_bonds[2]"][0] > 50, "control: stretched into the second regime"
    assert np.all(np.diff(table["PotEng"]) <= 0.0)
    yield_force = 8 * 4 * 80 * 0.005 / 0.01
    assert table["Fmax"][0] > 0.5 * yield_force
    assert table["Fmax"][-1] < 0.01 * yield_force
    snapshots = run.dump("all.dump")
    still = np.zeros_like(snapshots[0]["x"])
    for snapshot in (snapshots[0], snapshots[len(snapshots) // 20]):
        snapshot.columns.update(vx=still, vy=still, vz=still)
        check_forces(snapshot, bar, contact="none")


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (3, "off")])
def test_rerun_with_bonds_from_a_file(lmp, bar, ranks, newton):
    """Energies and forces of a dump's snapshots are those of the run that wrote it. Control: a rerun that records its
    own bonds at the first snapshot, already deformed, has others."""
    lmp(head() + pair() + "fix move all nve\nrun 0\nwrite_evp_bonds all.bonds\n").ok()
    whole = lmp(head() + pair() + STIR + MOVE + dump(every=10) + "run 100\n", ranks=2).ok()
    again = """
dump all all custom 10 again.dump id x y z vx vy vz fx fy fz
dump_modify all format float %.17g
rerun all.dump first 20 dump x y z vx vy vz
"""
    kept = pair(fix="fix bonds all evp/bonds file all.bonds")
    run = lmp(head(newton) + kept + MOVE + again, ranks=ranks).ok()
    table = whole.thermo()
    later = {name: values[2:] for name, values in table.items() if name not in ("Step", "KinEng", "Pxx", "Pyz")}
    assert list(run.thermo()["Step"]) == list(range(20, 101, 10))
    assert_same_curve(run.thermo(), later, tolerance=10.0 * ROUND_OFF)
    for snapshot, old in zip(run.dump("again.dump"), whole.dump("all.dump")[2:]):
        check_forces(snapshot, bar)
        assert np.abs(snapshot["fx"] - old["fx"]).max() < ANOTHER_ORDER * np.abs(old["fx"]).max()
    assert_eventful(table)
    fresh = lmp(head(newton) + pair() + MOVE + again, ranks=ranks).ok().thermo()
    assert fresh["f_bonds[2]"][0] == 0.0 and abs(fresh["PotEng"][0] / later["PotEng"][0] - 1.0) > 1e-3


@pytest.mark.parametrize("ranks", [1, 3])
def test_run_0_changes_nothing(lmp, bar, ranks):
    """run 0 again and again: the same bits, one recording, in mid-deformation too."""
    text = head(sort="sort 0 0") + pair() + STIR + MOVE + "run 60\n"
    for number, run_0 in enumerate(("run 0", "run 0", "run 0 pre no post no", "run 0")):
        text += run_0 + f"\nwrite_dump all custom {number}.dump id x y z vx vy vz fx fy fz modify format float %.17g\n"
    run = lmp(text, ranks=ranks).ok()
    first, *others = (run.dump(f"{number}.dump")[0] for number in range(4))
    for snapshot in others:
        for name, values in first.columns.items():
            assert np.array_equal(snapshot[name], values), name
    assert run.stdout.count("recorded") == 1
    tables = [run.thermo(k) for k in range(1, 4)]
    assert all(table[name][-1] == tables[0][name][-1] for table in tables for name in table)
    check_forces(first, bar)


NEW = {"e1": 70.5, "m1": 9.0, "n1": 3.5, "e2": 5.0, "m2": 7.0, "n2": 3.0, "xi_s": 0.008, "gamma": 90.0, "alpha": 1.42}


@pytest.mark.parametrize("style", ["evp/lj", "hybrid/overlay zero 0.001 evp/lj"])
def test_fix_adapt_of_every_coefficient(lmp, bar, style):
    """After fix adapt the forces are those of the new row, and after `reset yes` those of the old one again."""
    base = law.TABLE1._replace(gamma=20.0)
    text, of_style = "", "evp/lj" if "hybrid" in style else ""
    for key, value in NEW.items():
        setup = pair(base).replace("pair_style evp/lj", f"pair_style {style}")
        if of_style:
            setup = setup.replace("pair_coeff * *", "pair_coeff * * zero\npair_coeff * * evp/lj")
        text += "clear\n" + head("off") + setup + "fix hold all nve/noforce\ntimestep 1e-30\nrun 0\n" + STRETCH + STIR + f"""
variable new equal {value}
fix change all adapt 1 pair evp/lj {key} * * v_new reset yes
{dump(key, every=1)}
run 2
unfix change
undump all
{dump(key + ".reset", every=1)}
run 0
"""
    run = lmp(text, ranks=2).ok()
    for key, value in NEW.items():
        row = base._replace(**{key: value})
        for snapshot in run.dump(key):
            found = check_forces(snapshot, bar, row)
        assert found["bonds_second"] > 50
        with pytest.raises(AssertionError):
            check_forces(snapshot, bar, base)
        check_forces(run.dump(key + ".reset")[-1], bar, base)


@pytest.mark.parametrize("style", ["evp/lj", "hybrid/overlay zero 0.001 evp/lj"])
def test_fix_adapt_cannot_widen_alpha(lmp, bar, style):
    """The neighbor list ends where it did at set-up: pairs beyond would be lost in silence. Down and up again is fine."""
    setup = pair().replace("pair_style evp/lj", f"pair_style {style}")
    if "hybrid" in style:
        setup = setup.replace("pair_coeff * *", "pair_coeff * * zero\npair_coeff * * evp/lj")
    text = head() + setup + MOVE + "variable a equal 1.5-0.1*{0}\nfix change all adapt 1 pair evp/lj alpha * * v_a\nrun 20\n"
    run = lmp(text.format("(step>5)*(step<15)"), ranks=2).ok()
    assert run.thermo()["Step"][-1] == 20
    run = lmp(text.format("(step>5)*(0-1)"))
    refused(run, "types 1 and 1: alpha must not grow during a run", "split the run there", stepped=True)


def test_fix_adapt_cannot_bring_exponents_together(lmp, bar):
    """The rule of pair_coeff holds for each value that fix adapt sets during a run."""
    text = head() + pair() + MOVE + "variable m equal 4+{0}\nfix change all adapt 1 pair evp/lj m2 * * v_m\nrun 10\n"
    assert lmp(text.format("1e-3*(11-step)"), ranks=2).ok().thermo()["Step"][-1] == 10
    run = lmp(text.format("10^(-step)"), ranks=2)
    refused(run, "Pair evp/lj, types 1 and 1: exponents too close: m2 - n2 = 0.0001, must be at least 0.00040001", stepped=True)


@pytest.mark.parametrize("contact", ["literal", "repulsive"])
@pytest.mark.parametrize("ranks, newton", [(1, "on"), (3, "off")])
def test_radii_that_change_during_a_run(lmp, tmp_path, bar, ranks, newton, contact):
    """fix adapt shrinks the spheres while the neighbor list stands: dlim, and deq of new pairs, follow at every step."""
    row = law.TABLE1
    text = head(newton, style="sphere 1") + pair(contact=contact, fix="fix bonds all evp/bonds zone 1.01") + """
fix hold all nve/noforce
variable size equal 0.0105-0.0002*step
fix shrink all adapt 1 atom diameter v_size
compute e all pair/local eng
compute sum all reduce sum c_e inputs local
dump all all custom 1 all.dump id x y z vx vy vz fx fy fz radius
dump_modify all format float %.17g
thermo 1
""" + thermo("pe c_sum f_bonds f_bonds[3]") + """
run 0 post no
run 5
"""
    small = bar._replace(radius=np.full(len(bar.x), 0.00525))
    write_body(tmp_path / "body.data", small)
    run = lmp(text, ranks=ranks).ok()
    snapshots = run.dump("all.dump")[-5:]
    bonds = record(bar.x, small.radius, 1.01, bar.cell)
    for snapshot in snapshots:
        check_forces(snapshot, small._replace(radius=snapshot["radius"], bonds=bonds), row, contact, at_rest=True)
    table = run.thermo()
    assert np.ptp([snapshot["radius"][0] for snapshot in snapshots]) > 3e-4
    assert "Neighbor list builds = 0" in run.stdout
    assert np.allclose(table["PotEng"], table["c_sum"], rtol=10.0 * ROUND_OFF, atol=0.0), "compute() = single()"
    assert np.ptp(table["PotEng"]) > 1e-3 * np.abs(table["PotEng"]).max(), "control: the radii matter"


def test_plugin_unload(lmp, bar):
    """What is unloaded is gone with what it made; what depends on it says so; nothing crashes."""
    text = head() + pair() + "fix move all nve\nrun 1\n"
    refused(lmp(text + "plugin unload pair evp/lj\nrun 1\n"), "Fix bonds evp/bonds needs pair style evp/lj", stepped=True)
    run = lmp(text + "plugin unload fix evp/bonds\npair_style none\nrun 1\nfix bonds all evp/bonds\n")
    refused(run, "Unrecognized fix style 'evp/bonds'", stepped=True)
    run = lmp(text + "plugin clear\nrun 1\npair_style evp/lj\n", ranks=2)
    refused(run, "Unrecognized pair style 'evp/lj'", stepped=True)
    assert run.stdout.count("Loop time") == 2, "a run of free atoms in between"


def test_clear_starts_afresh(lmp, bar):
    """After `clear` no bond is left: the same deck gives the same bits, and another body records its own."""
    text = head() + pair() + STIR + MOVE + "run 60\n"
    other = head() + pair(fix="fix other all evp/bonds zone 1.2") + STIR + MOVE.replace("f_bonds", "f_other") + "run 20\n"
    run = lmp("clear\n".join([text, other, text])).ok()
    first, middle, last = (run.thermo(k) for k in range(3))
    for name, values in first.items():
        assert np.array_equal(values, last[name]), name
    assert middle["f_other"][0] < first["f_bonds"][0]


TWO_INSTANCES = """
import ctypes, sys
library = ctypes.CDLL(sys.argv[1], mode=ctypes.RTLD_GLOBAL)
library.lammps_open_no_mpi.restype = ctypes.c_void_p
library.lammps_command.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
library.lammps_close.argtypes = [ctypes.c_void_p]
library.lammps_get_thermo.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
library.lammps_get_thermo.restype = ctypes.c_double
words = [b"lmp", b"-log", b"none", b"-screen", b"none"]
arguments = (ctypes.c_char_p * len(words))(*words)

def opened():
    return ctypes.c_void_p(library.lammps_open_no_mpi(len(words), arguments, None))

def run(lammps, lines):
    for line in lines:
        library.lammps_command(lammps, line.encode())
    print("energy", repr(library.lammps_get_thermo(lammps, b"pe")), flush=True)

decks = [open(name).read().splitlines() for name in sys.argv[2:4]]
first = opened()
run(first, decks[0] + ["run 20"])
second = opened()
library.lammps_close(second)
run(first, ["run 20"])
library.lammps_close(first)
third = opened()
run(third, decks[1] + ["run 20"])
library.lammps_close(third)
"""


def host_process(lmp):
    """LAMMPS' shared library and the environment in which the lmp of the tests runs, as it shows them itself."""
    shown = lmp("""
shell "grep -o '/.*liblammps[^ ]*$' /proc/$PPID/maps > maps.txt"
shell "cat /proc/$PPID/environ > environ.txt"
""").ok()
    libraries = (shown.folder / "maps.txt").read_text().split()
    assert libraries, "this LAMMPS has no shared library, which a second instance needs"
    lines = (shown.folder / "environ.txt").read_text().split("\0")
    return {"library": libraries[0], "environment": dict(line.split("=", 1) for line in lines if "=" in line)}


def test_instances_in_one_process(lmp, tmp_path, bar):
    """The plugin serves one LAMMPS after the other, each with its own bonds, and outlives one that comes and goes in
    between. (Two at a time is beyond LAMMPS' plugin list: the second knows no style of any plugin.)"""
    decks = [head() + pair() + STIR + MOVE, head("off") + pair(contact="none", fix="fix bonds all evp/bonds zone 1.3") + STIR + MOVE]
    alone = []
    for number, deck in enumerate(decks):
        (tmp_path / f"in.{number}").write_text(deck)
        alone.append([table["PotEng"][-1] for table in map(lmp(deck + 2 * "run 20\n").ok().thermo, range(2))])
    assert len({*alone[0], *alone[1]}) == 4, "control: all differ"
    host = host_process(lmp)
    (tmp_path / "two.py").write_text(TWO_INSTANCES)
    output = subprocess.run([sys.executable, "two.py", host["library"], "in.0", "in.1"], cwd=tmp_path, env=host["environment"],
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SECONDS).stdout
    assert [float(line.split()[1]) for line in output.splitlines() if line.startswith("energy")] == [*alone[0], alone[1][0]], output
