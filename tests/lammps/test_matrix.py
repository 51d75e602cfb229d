# SPDX-License-Identifier: GPL-2.0-only
"""Every effect gives the same numbers on any number of MPI ranks, with newton on and off, for any decomposition and box, and when the run
is continued from a restart file or from a data file and a bond file.

Bodies drift at 300 m/s: atoms and their bonds change ranks and cross boundaries while the body deforms."""

from typing import NamedTuple

import numpy as np
import pytest
from evp import law
from flowing import SHAKE, failing_at, read_pairs
from lammps_run import run_decks, run_lammps
from small_bodies import SPACING, STIR, check_forces, dump, head, lattice_body, mass_of, record, thermo, words, write_body

HALF, STEPS = 57, 114  # the middle is between two updates of p
# Sums in another order: roundings of 1e-16 over a hundred steps. Of the largest value of a column; energies of the largest energy.
TOLERANCE = 1e-9
MOMENTUM = 1e-12
MOLECULES = "fix molecules all property/atom mol ghost yes\n"
DAMPED = law.TABLE1._replace(gamma=50.0)
SCALED = " spacing 0.009 coordination 12 kv 700"
FLOW = law.TABLE1._replace(xi_s=0.004)
FALLING = words(FLOW) + " flow 0 1 0.1 2 0.3 0.5"
SHEAR = dict(periodic="xyz", cells=(5, 4, 4), tilt=(0.0245, 0.0, 0.0))  # a shear of 0.02 makes the box flip


class Feature(NamedTuple):
    """A deck in parts. acts: thermo columns that must change during the run, as a control."""

    acts: str
    style: str = "contact literal"
    row: str = words(law.TABLE1)
    record: str = ""  # words of fix evp/bonds that records
    more: str = ""  # fixes and computes
    move: str = "fix move all nve\n"
    stir: str = STIR
    molecules: bool = False
    columns: str = ""
    body: dict = {}
    state: str = ""  # words of compute evp/state/atom


FEATURES = {
    "plain": Feature("f_bonds[1] f_bonds[2] f_bonds[3]"),
    "implicit": Feature("f_energy[6] f_bonds[1]", row=words(DAMPED), move="fix move all nve/evp tol 1e-13\n"),
    "own timestep": Feature("Dt f_bonds[2]", more="fix dt all dt/evp 10 0.4 max 3e-7 displacement 0.1\n", columns="dt"),
    "break": Feature("f_energy[11] f_bonds[5]", "contact literal break 0.1", stir=SHAKE),
    "flow, contacts, failure, volume": Feature(
        "f_energy[9] f_energy[11] f_energy[12] f_bonds[5] f_bonds[3]", "contact repulsive plasticity isotropic", FALLING + failing_at(0.3), "zone 1.1",
        "fix volume all evp/volume 500\n", stir=SHAKE, columns="f_volume f_volume[1]", state="plastic_work plastic_strain volume_strain omega damage"),
    "volume": Feature("f_energy[12] f_volume[3]", more="fix volume all evp/volume 2000 300\n", columns="f_volume f_volume[1] f_volume[2] f_volume[3]"),
    "bodies by molecule": Feature("f_bonds[2] f_bonds[3]", record="zone 1.4 within molecule", molecules=True),
    "bodies that flow": Feature("f_energy[9] f_bonds[3] f_volume", "contact repulsive plasticity isotropic", words(FLOW) + failing_at(0.3), "zone 1.4 within type",
                                "fix volume all evp/volume 500 across yes\n", stir=SHAKE, columns="f_volume f_volume[1]"),
    "scaled row": Feature("f_volume f_energy[6]", row=words(DAMPED) + SCALED, more="fix volume all evp/volume row\n", columns="f_volume"),
    "remap v": Feature("f_energy[13] f_energy[9] Xy", "contact repulsive plasticity isotropic", words(DAMPED),
                       "zone 1.4", "fix volume all evp/volume 500\nfix box all deform 1 xy erate 500 remap v\n", "fix move all nve/evp tol 1e-13\n",
                       columns="xy f_volume", body=SHEAR, stir=STIR.replace("500*(x-0.04)", "500*y")),
}
# How a run gets to its second half; files are written by two ranks.
ROUTES = {
    1: [("off", "brick", "straight"), ("on", "brick", "restart"), ("off", "brick", "data"), ("on", "brick", "restart, data")],
    2: [("on", "brick", "straight"), ("off", "tiled", "straight"), ("on", "tiled", "restart"), ("off", "brick", "restart of the run"), ("off", "brick", "data")],
    4: [("on", "tiled", "straight"), ("off", "brick", "straight"), ("off", "tiled", "restart"), ("on", "brick", "data"), ("on", "tiled", "restart, data")],
    8: [("on", "slabs", "straight"), ("off", "tiled", "straight"), ("on", "brick", "data")],
}
LAYOUT = {"brick": "", "slabs": "", "tiled": "comm_style tiled\nbalance 1.0 rcb\n"}
ENERGY = "f_energy f_energy[*]"
ENDING = dump("end.dump", HALF, "x y z vx vy vz fx fy fz c_state[*]") + f"run {STEPS - HALF}\nwrite_evp_bonds end.bonds\n"


def start(feature, newton="on", source="body.data", **options):
    """Up to the fixes of the pairs."""
    boundary = "p p p" if feature.body else "f f f"
    molecules = MOLECULES if feature.molecules else ""
    from_data = "" if source.endswith("restart") else source
    read = f"read_restart {source}\n{molecules}" if not from_data else f"read_data {source}"
    if from_data and source != "body.data":
        read = f"{molecules}{read} nocoeff" + (" fix molecules NULL Molecules" if molecules else "") + f"\nreset_timestep {HALF}"
    elif from_data and molecules:
        read += f"\n{molecules}variable m atom (7*id+id*id)%4\nset group all mol v_m"
    text = head(newton, start=read, **{"boundary": boundary, **options})
    record = {"body.data": feature.record}.get(source, f"file {source.replace('.data', '.bonds')}" if from_data else "")
    return text + (f"pair_style evp/lj {feature.style}\npair_coeff * * {feature.row}\n" if from_data else "") + f"fix bonds all evp/bonds {record}\n"


def motion(feature, layout="", stir=""):
    columns = f"pe ke pxx pyz f_bonds f_bonds[*] {ENERGY} c_dt {feature.columns}"
    # the layout moves atoms, which a fix must not miss after read_restart
    return ("fix energy all evp/energy\n" + feature.more + layout + stir + feature.move + "timestep 3e-7\nthermo 20\ncompute dt all evp/dt\n"
            + f"compute state all evp/state/atom {feature.state}\n" + thermo(columns))


def whole(feature, newton="on", layout="", **options):
    """From the start to the end, as two runs, with all files in the middle."""
    return (start(feature, newton, **options) + motion(feature, layout, feature.stir) + f"restart {HALF} in_run.*\nrun {HALF}\nrestart 0\n"
            "write_restart half.restart\nwrite_data half.data\nwrite_evp_bonds half.bonds\n" + ENDING)


def way(feature, newton, layout, route):
    if route == "straight":
        options = {"before": "processors * 1 1"} if layout == "slabs" else {}
        return whole(feature, newton, LAYOUT[layout], **options)
    rest = motion(feature, LAYOUT[layout]) + ENDING
    if route == "restart, data":
        first = start(feature, newton, "half.restart") + motion(feature) + "run 0\nwrite_data again.data\nwrite_evp_bonds again.bonds\nclear\n"
        return first + start(feature, newton, "again.data") + rest
    source = {"restart": "half.restart", "restart of the run": "in_run.restart", "data": "half.data"}[route]
    return start(feature, newton, source) + rest


def end_of(run):
    """All that is compared, {name: array}, energies as those since the middle; and which atoms are one body."""
    found = {f"thermo {name}": values for name, values in run.thermo().items() if name != "Step"}
    energies = [key for key in found if "f_energy" in key]
    table = np.array([found.pop(key) for key in energies])
    found["energies"] = table - table[:, :1]
    last = run.dump("end.dump")[-1]
    assert last.step == STEPS
    found.update({f"atoms {name}": values for name, values in last.columns.items()})
    pairs = read_pairs(run.folder / "end.bonds")
    found["ended"] = np.array([float(pairs.ended)])
    for kind in ("bonds", "contacts", "apart", "spheres"):
        own = getattr(pairs, kind)
        found[kind] = np.array(sorted(own), dtype=float)
        columns = np.array([np.atleast_1d(own[key]) for key in sorted(own)]).T if own else ()
        names = pairs.columns if kind == "spheres" else ("deq",)
        found.update({f"{kind} {name}": column for name, column in zip(names, columns)})
    return found, (run.folder / "end.bonds").read_text(encoding="utf-8").partition("\n")[0].partition("WITHIN")[2]


def assert_same(run, expected, choice):
    (found, header), (wanted, wanted_header) = end_of(run), expected
    assert header == wanted_header and found.keys() == wanted.keys(), choice
    for name, values in wanted.items():
        assert found[name].shape == values.shape, (choice, name)
        off, largest = np.abs(found[name] - values).max(initial=0.0), np.abs(values).max(initial=0.0)
        assert off <= TOLERANCE * largest, f"{choice}: {name} differs by {off:.3g} of {largest:.3g}"


def write(folder, feature):
    body = lattice_body(**feature.body)
    write_body(folder / "body.data", body, feature.body.get("tilt"))
    return body


def check_run(run, name, body):
    """Of the plain one: forces are those of a sum over all pairs, and no effect changes the momentum of a body in an open box."""
    snapshots, mass = run.dump("end.dump"), mass_of(body.radius)[:, None]
    if name == "plain":
        check_forces(snapshots[-1], body)
    if name == "bodies by molecule":
        ids = np.arange(1, len(body.x) + 1)
        molecules = (7 * ids + ids * ids) % 4  # as start() sets them; those without one are alone
        bodies = np.where(molecules == 0, -ids, molecules)
        kept = {key: deq for key, deq in record(body.x, body.radius, 1.4, body.cell).items() if len({bodies[k - 1] for k in key}) == 1}
        found = check_forces(snapshots[-1], body._replace(bonds=kept), bodies=bodies, at_rest=True)
        assert np.sum(bodies[found["i"]] != bodies[found["j"]]) > 10, "control: bodies touch"
    if not body.cell.any():
        first, last = (mass * snapshot.v for snapshot in snapshots)
        assert np.linalg.norm(last.sum(axis=0) - first.sum(axis=0)) < MOMENTUM * np.abs(first).sum(), "momentum"


@pytest.mark.parametrize("name", FEATURES)
def test_same_on_every_way(tmp_path, name):
    """As the plain run on one rank; the files are written by two ranks. 8 ranks cut the body into pieces shorter than dlim."""
    feature, folders = FEATURES[name], [tmp_path / "whole", tmp_path / "files"]
    for ranks, folder in enumerate(folders, start=1):
        folder.mkdir()
        body = write(folder, feature)
        run = run_lammps(whole(feature), ranks, cwd=folder).ok()
        if ranks == 1:
            check_run(run, name, body)
            table, first = run.thermo(1), run.thermo(0)
            for column in feature.acts.split():
                assert table[column][-1] != first[column][0], f"control: {column} changes"
            ends = end_of(run)
        else:
            assert_same(run, ends, "2 ranks")
    (folder / f"in_run.{HALF}").rename(folder / "in_run.restart")
    most = name == "flow, contacts, failure, volume"  # stores most values, and takes all ways; the others take every second one
    for ranks in ROUTES if most else (1, 4):
        decks = {choice: way(feature, *choice) for choice in (ROUTES[ranks] if most else ROUTES[ranks][::2])}
        for choice, run in run_decks(decks, ranks, folder, f"on{ranks}.").items():
            assert_same(run, ends, (ranks, *choice))


# lines after the fixes, periodic axes and tilt of the box; the rest is for head()
BOXES = {
    "slabs along z": dict(before="processors 1 1 *"),
    "balance": dict(lines="balance 1.0 shift xyz 10 1.01\n"),
    "fix balance": dict(lines="fix even all balance 10 1.0 shift x 10 1.01\n"),
    "fix balance rcb": dict(before="comm_style tiled", lines="fix even all balance 10 1.0 rcb\n"),
    "fix balance, newton off": dict(lines="fix even all balance 7 1.0 shift xy 10 1.01\n", newton="off"),
    "sorted often": dict(sort="sort 3 0.03"),
    "never sorted": dict(sort="sort 0 0", newton="off"),
    "shrink-wrapped": dict(boundary="s m s"),
    "all pairs tried": dict(lines="neighbor 0.0008 nsq\n"),
    "bins by type": dict(lines="neighbor 0.0008 multi\ncomm_modify mode multi\n"),
    "bins by size": dict(lines="neighbor 0.0008 multi\nneigh_modify collection/interval 2 0.005 0.02\ncomm_modify mode multi\n", newton="off"),
    "large skin": dict(lines="neighbor 0.003 bin\nneigh_modify every 5 delay 0 check yes one 4000\n"),
    "periodic x": dict(periodic="x"),
    "periodic y, newton off": dict(periodic="y", newton="off"),
    "periodic z": dict(periodic="z"),
    "periodic": dict(periodic="xyz", newton="off"),
    "periodic, tiled": dict(periodic="xyz", before="comm_style tiled"),
    "triclinic": dict(periodic="xyz", tilt=(0.012, -0.008, 0.015)),
    "triclinic, newton off": dict(periodic="xyz", tilt=(0.02, 0.005, -0.01), newton="off"),
}


@pytest.mark.parametrize("name", ["flow, contacts, failure, volume", "bodies by molecule"])
def test_same_in_every_box(tmp_path, name):
    """4 ranks against one; a fix that moves atoms stands after fix evp/bonds."""
    decks, bodies = {1: {}, 4: {}}, {}
    for number, (box, options) in enumerate(BOXES.items()):
        lines, axes, tilt = options.get("lines", ""), options.get("periodic", ""), options.get("tilt")
        bodies[box] = lattice_body(**(dict(cells=(5, 4, 4), periodic=axes, tilt=tilt or (0.0, 0.0, 0.0)) if axes else {}))
        write_body(tmp_path / f"body{number}.data", bodies[box], tilt)
        options = {"boundary": " ".join("p" if axis in axes else "f" for axis in "xyz"), **options}
        options = {key: value for key, value in options.items() if key not in ("lines", "periodic", "tilt")}
        for ranks, own, more in ((1, {"boundary": options["boundary"]}, ""), (4, options, lines)):
            text = start(FEATURES[name], **{"newton": "on", **own}) + motion(FEATURES[name], "", FEATURES[name].stir) + more
            decks[ranks][box] = text.replace("body.data", f"body{number}.data") + f"run {HALF}\n" + ENDING
    runs = {ranks: run_decks(texts, ranks, tmp_path, f"on{ranks}.") for ranks, texts in decks.items()}
    for box, run in runs[4].items():
        assert_same(run, end_of(runs[1][box]), box)
        x, bonds = run.dump("end.dump")[-1].x, np.array(list(bodies[box].bonds)) - 1
        for axis in np.flatnonzero(bodies[box].cell.any(axis=1)):
            spans = np.abs(x[bonds[:, 0], axis] - x[bonds[:, 1], axis])
            assert np.sum(spans > 2.0 * SPACING) > 20, f"control: bonds cross the boundary {axis} of {box}"
