# SPDX-License-Identifier: GPL-2.0-only
"""What is asked between runs is of the present positions, or an error that says 'run 0': own atoms may have been moved since
ghosts and neighbor list were made."""

import numpy as np
import pytest
from hostile import refused
from library import run_python
from small_bodies import head, lattice_body, pair, write_body

SKIN = 0.0007
COUNTS = "$(f_bonds[1]) $(f_bonds[2]) $(f_bonds[3]) $(f_bonds[4]:%.15g)"
# each atom by at most 0.98 of half the skin, 1.4 of it together: pairs get into the second regime, out of dlim and into it
NUDGE = """
variable nx atom x+0.98*0.25*{skin}*sin(1.7*id)
variable ny atom y+0.98*0.25*{skin}*cos(2.9*id)
variable nz atom z+0.98*0.25*{skin}*sin(4.1*id+1)
set group all x v_nx y v_ny z v_nz
""".replace("{skin}", str(SKIN))
FAR = f"variable far atom y+{1.1 * 0.5 * SKIN}\nset {{}} y v_far\n"
RUN0 = "thermo_style custom step pe\nrun 0\n"
BOXES = {"open": ("f f f", "", (0, 0, 0)), "periodic": ("p p p", "xyz", (0, 0, 0)), "tilted": ("p p f", "xy", (0.013, 0, 0))}


def deck(box="open", newton="on", before="", more="", start=RUN0):
    return head(newton, BOXES[box][0], skin=SKIN, before=before) + more + pair() + "fix move all nve\n" + start


def write(folder, box, cells=(6, 4, 4)):
    body = lattice_body(cells, BOXES[box][1], BOXES[box][2])
    write_body(folder / "body.data", body, BOXES[box][2] if box == "tilted" else None)
    return body


def shown(run, word):
    return np.array(next(line.split()[1:] for line in run.stdout.splitlines() if line.split()[:1] == [word]), dtype=float)


@pytest.mark.parametrize("box, ranks, newton, more", [
    ("open", 1, "on", ""), ("periodic", 4, "on", "comm_modify vel no\n"), ("tilted", 2, "on", "neigh_modify check no\n"), ("periodic", 2, "off", "comm_style tiled\n")])
def test_what_is_asked_is_of_the_present_positions(lmp, tmp_path, box, ranks, newton, more):
    """Moved by set, within half the skin: counts, state and timesteps, with a volume energy too; truth: the same after a run 0."""
    write(tmp_path, box)
    ask = f"print '{{0}} {COUNTS} $(c_dt:%.15g) $(c_dt[1]:%.15g) $(c_dt[5]:%.15g)'\nwrite_dump all custom {{0}}.dump id c_state[*] modify sort id format float %.17g\n"
    text = deck(box, newton, more=more, start="fix volume all evp/volume 500\ncompute state all evp/state/atom\ncompute dt all evp/dt\n" + RUN0)
    run = lmp(text + f"print 'BEFORE {COUNTS}'\n" + NUDGE + ask.format("MOVED") + "run 0\n" + ask.format("TRUTH"), ranks=ranks).ok()
    before, moved, truth = (shown(run, word) for word in ("BEFORE", "MOVED", "TRUTH"))
    assert np.all(moved[:3] == truth[:3]) and moved[3:] == pytest.approx(truth[3:], rel=1e-12, abs=0.0)
    assert np.all(moved[:3] > before[:3]), "control: bonds are lost, others yield, and there are new pairs"
    moved, truth = (run.dump(f"{name}.dump")[0] for name in ("MOVED", "TRUTH"))
    assert all(np.all(moved[f"c_state[{k}]"] == truth[f"c_state[{k}]"]) for k in range(1, 5))
    assert moved["c_state[2]"].max() > 0.1 and moved["c_state[4]"].max() > 0, "control: they are not those of rest"


UNKNOWN = """
import numpy
program = start("-screen", "none")
scene = open("in.scene").read()

def refused(k, *change):
    said = complaint(program.extract_fix, "bonds", 0, 1, k)
    assert f"f_bonds[{k + 1}] needs the pairs of the current atoms: use 'run 0'" in said, (change, said)
    program.command("run 0")
    program.extract_fix("bonds", 0, 1, k)
    print("an error:", *change)

for change in CHANGES:
    tell(program, f"clear\\nplugin load {plugin}\\n" + scene + change)
    refused(2, change)

def counts():
    return [program.extract_fix("bonds", 0, 1, k) for k in range(4)]

def scatter(by):
    places = program.gather_atoms("x", 1, 3)
    numbers = numpy.ctypeslib.as_array(places)
    numbers += by * numpy.sin(1.7 * numpy.arange(len(numbers)))
    program.scatter_atoms("x", 1, 3, places)

tell(program, f"clear\\nplugin load {plugin}\\n" + scene + "run 0")
before = counts()
scatter(STEP)
after = counts()
program.command("run 0")
assert after == counts() != before
scatter(20 * STEP)
refused(0, "scattered")
program.finalize()
"""
CHANGES = ["", FAR.format("group all"), "set atom 7 z 0.0301\n", "displace_atoms all move 0.0005 0 0\n", "change_box all z delta 0 0.0002\n",
           "set atom 5 diameter 0.0097\n", "set atom 5 type 2\n", "pair_coeff * * 80 8 4 3 8 4 0.02 0 1.5\n", "pair_style evp/lj contact none\n",
           "neighbor 0.0009 bin\n", "comm_style tiled\n", "group last id 96\ndelete_atoms group last compress no\n", "write_data other.data\n",
           "unfix bonds\nfix bonds all evp/bonds\n"]


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_is_not_known_is_an_error(tmp_path, ranks):
    """Before the first run, and where the lists are those of other positions, atoms, radii, types or laws; a run 0 mends each. scatter_atoms writes own
    atoms and one copy of each: near enough, counts are those of the new places. Python shows the first 99 characters of an error, which name the remedy."""
    write(tmp_path, "periodic")
    (tmp_path / "in.scene").write_text(deck("periodic", start="set atom 5 type 1\n"), encoding="utf-8")
    changes = [text and RUN0 + text for text in CHANGES]
    run = run_python(UNKNOWN.replace("CHANGES", repr(changes)).replace("STEP", str(0.28 * SKIN)), ranks, tmp_path).ok()
    assert run.stdout.count("an error:") == ranks * (1 + len(CHANGES))


@pytest.mark.parametrize("ranks, check", [(1, "yes"), (2, "no")])
def test_a_single_atom_that_moved_too_far_is_found(lmp, tmp_path, ranks, check):
    """In an open box of one rank there are no ghosts that could tell; the atom is on one rank of two."""
    write(tmp_path, "open")
    far, ask = FAR.format("atom 96"), 'print "lost $(f_bonds[1])"\n'
    near = far.replace("y+", "y+0.9*").replace("far", "near")
    run = lmp(deck(more=f"neigh_modify check {check}\n") + near + ask + far + ask, ranks=ranks)
    refused(run, "needs the pairs of the current atoms", stepped=True)
    assert run.stdout.count("\nlost ") == 1


BROKEN_OFF = """
program = start("-screen", "none")
tell(program, f"plugin load {plugin}")
tell(program, open("in.scene").read())
if BREAKS:
    program.command("variable now equal step")
    program.command("fix halt all halt 1 v_now >= 130 error hard")
    assert "halt" in complaint(program.command, "run 200")
    program.command("unfix halt")
    if BREAKS == "changed":
        program.command("set atom 1 diameter 0.0101")
        said = complaint(program.command, "run 0")
        assert "the flow since the last neighbor build of a run" in said, said
        program.finalize()
        raise SystemExit
    program.command("write_restart half.restart")
else:
    program.command("run 130")
program.command("run 70")
found = program.get_thermo("pe"), program.extract_compute("work", 0, 0)  # collective
if program.extract_setting("world_rank") == 0:
    print(*found)
program.finalize()
"""


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_run_that_an_error_broke_off_keeps_its_flow(tmp_path, ranks):
    """A program has caught it and goes on: the records had not been told of the flow since the last neighbor build."""
    write(tmp_path, "open")
    text = deck(start="").replace("contact literal", "contact none plasticity isotropic")
    text += "velocity all ramp vx -40 40 x 0 0.06\ntimestep 1e-7\nneigh_modify check no every 1000\ncompute each all evp/state/atom plastic_work\n"
    (tmp_path / "in.scene").write_text(text + "compute work all reduce sum c_each[5]\nthermo_style custom step pe c_work\n", encoding="utf-8")
    whole, broken = (run_python(BROKEN_OFF.replace("BREAKS", repr(breaks)), ranks, tmp_path).ok().stdout.split() for breaks in (None, "error"))
    assert float(whole[1]) > 1.0
    assert [float(word) for word in broken] == pytest.approx([float(word) for word in whole], rel=1e-9)
    run_python(BROKEN_OFF.replace("BREAKS", repr("changed")), ranks, tmp_path).ok()


@pytest.mark.parametrize("command", ["write_restart half.restart", "write_data half.data nocoeff"])
def test_a_run_does_not_go_on_without_a_list(lmp, tmp_path, command):
    """Such a command makes LAMMPS replace the lists where they are requested otherwise, and 'run pre no' does not build them. Else they stay."""
    write(tmp_path, "open")
    start = deck(start="timestep 1e-7\nthermo_style custom step pe\nthermo_modify norm no format float %.15g\nthermo 10\nrun 50\n")
    refused(lmp(start + "compute near all coord/atom cutoff 0.01\n" + command + "\nrun 50 pre no\n"), "a command has replaced the neighbor list since the last run: omit 'pre no'", stepped=True)
    run, plain = (lmp(start + f"{between}\nrun 50 pre no\n").ok() for between in (command, ""))
    assert list(run.thermo(1)["PotEng"]) == list(plain.thermo(1)["PotEng"])
