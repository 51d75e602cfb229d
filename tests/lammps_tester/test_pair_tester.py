# SPDX-License-Identifier: GPL-2.0-only
"""LAMMPS' own pair tester on evp/lj, and its reference numbers against sums over all pairs.

The tester compares forces, energy and virial at a state and after four steps with those of the YAML
file: newton on and off, after a restart, with and without the short way to the virial, from a data
file; and asks extract() for every coefficient. The numbers came out of LAMMPS (README.md), so the second
half of this file computes them again from the body and the row, with tests/oracle/brute.py and Verlet steps in Python.
"""

import os
import pathlib
import re
import shutil
import subprocess
from typing import NamedTuple

import numpy as np
import pytest

import make_input
from oracle import brute, flow, law

FOLDER = pathlib.Path(__file__).resolve().parent
YAML = sorted(path.name for path in FOLDER.glob("pair-*.yaml"))
# `single` needs atom_style full, whose atoms have no radius (our own test_forces.py has it);
# the others test accelerated variants of a style, which evp/lj does not have.
TESTS = ("plain", "extract")
STEPS = 4  # of the tester
# A sum of up to 30 pair forces, each with xi = d/deq - 1 to 1e-16/0.005, over the largest of them.
ROUND_OFF = 1e-11


def test_every_yaml_file_is_here():
    assert YAML == ["pair-evp_lj-file.yaml", "pair-evp_lj-flow.yaml", "pair-evp_lj-zone.yaml"]


@pytest.mark.parametrize("name", YAML)
def test_lammps_own_tester(name, tmp_path):
    tester = os.environ["EVP_PAIR_TESTER"]
    plugin = pathlib.Path(os.environ["EVP_LMP"]).parent
    for file in (name, "in.evp_lj"):  # the tester leaves files where it runs
        shutil.copy(FOLDER / file, tmp_path)
    make_input.write(tmp_path)
    environment = {**os.environ, "LAMMPS_PLUGIN_PATH": str(plugin), "OMP_NUM_THREADS": "1"}
    environment["LD_LIBRARY_PATH"] = os.environ["EVP_LAMMPS_LIBRARY"]
    wanted = ":".join(f"PairStyle.{test}" for test in TESTS)
    run = subprocess.run([tester, name, "-d", str(tmp_path), "-s", f"--gtest_filter={wanted}"], cwd=tmp_path, env=environment,
                         capture_output=True, text=True, timeout=120, check=False)
    output = run.stdout + run.stderr
    assert run.returncode == 0, output[-4000:]
    assert f"[  PASSED  ] {len(TESTS)} tests." in output
    assert "SKIPPED" not in output and "FAILED" not in output
    for test in TESTS:
        assert f"[       OK ] PairStyle.{test}" in output
    for stage in ("init_forces (newton on)", "run_forces (newton on)", "init_forces (newton off)",
                  "run_forces (newton off)", "restart_forces", "nofdotr_forces", "data_forces"):
        assert f"{stage} stats" in output, stage


class Case(NamedTuple):
    """What a YAML file asks for, and the numbers it has."""

    rows: dict
    contact: str
    zone: float  # 0: bonds from the file
    dt: float
    flows: bool  # plasticity isotropic: the bond file has q and k
    numbers: dict  # init_vdwl, init_stress (6,), init_forces (N, 3), run_...


def read_case(name):
    text = (FOLDER / name).read_text(encoding="utf-8")
    blocks, key = {}, None
    for line in text.splitlines():
        start = re.match(r"(\w+): (?:! \|\d?-?|(.*))$", line)
        if start:
            key = start[1]
            blocks[key] = [start[2]] if start[2] is not None else []
        elif line.startswith("  ") and key:
            blocks[key].append(line.strip())
    rows = {}
    for line in blocks["pair_coeff"]:
        words = line.split()
        rows[int(words[0]), int(words[1])] = law.Row(*map(float, words[2:]))
    commands = {line.split()[0]: line.split() for line in blocks["post_commands"]}
    fix = commands["fix"]
    numbers = {}
    for when in ("init", "run"):
        numbers[f"{when}_vdwl"] = float(blocks[f"{when}_vdwl"][0])
        numbers[f"{when}_stress"] = np.array(" ".join(blocks[f"{when}_stress"]).split(), dtype=float)
        table = np.array([line.split() for line in blocks[f"{when}_forces"]], dtype=float)
        assert np.array_equal(table[:, 0], np.arange(1, len(table) + 1))
        numbers[f"{when}_forces"] = table[:, 1:]
    contact = re.search(r"contact (\w+)", blocks["pair_style"][0])[1]
    zone = float(fix[fix.index("zone") + 1]) if "zone" in fix else 0.0
    flows = "plasticity isotropic" in blocks["pair_style"][0]
    return Case(rows, contact, zone, float(commands["timestep"][1]), flows, numbers)


class Truth(NamedTuple):
    found: dict  # of brute.brute_force
    bonds: int


def with_flow(found, case, scene, flowed):
    """What brute_force found, with the forces of pairs that flow; "flowed" are the values that the pairs keep, {(id_i, id_j): (q, k)}."""
    x, v, radius, types, bonds, box = scene
    pairs, deq, _, bonded, row = brute.interactions(x, radius, case.rows, bonds, case.contact, types, box)
    i, j, r, d = pairs.i, pairs.j, pairs[2], pairs.d
    ids = [(min(a, b) + 1, max(a, b) + 1) for a, b in zip(i.tolist(), j.tolist())]
    q, k = np.array([flowed.get(pair, (0.0, 0.0)) for pair in ids]).T
    of_bonds, of_contacts = flow.step(d, deq, row, q, k), flow.contact_step(d, deq, row, q, k)
    now = flow.Step(*(np.where(bonded, *both) for both in zip(of_bonds, of_contacts)))
    unit = r / d[:, None]
    f = now.force[:, None] * unit + law.damping_force(unit, v[i], v[j], row)
    total = np.zeros_like(x)
    np.add.at(total, i, f)
    np.add.at(total, j, -f)
    energy = np.where(bonded, flow.stored(d, deq, row, now.q), flow.contact_stored(d, deq, row, now.q))
    return {**found, "force": total, "energy": float(energy.sum()), "virial": r.T @ f, "flowed": dict(zip(ids, zip(now.q, now.k))),
            "bonds_second": int(np.sum(bonded & (now.k > 0.0)))}


def computed(case, folder):
    """What the tester's two moments are by sums over all pairs: at the start, and after four Verlet steps."""
    _, x, v, radius, types, box = make_input.body()
    mass = (2700.0 * 4.0 / 3.0 * np.pi * radius**3)[:, None]
    if case.zone:
        bonds = brute.record_bonds(x, radius, case.zone, box)
    else:
        file = "evp_lj_flow.bonds" if case.flows else "evp_lj.bonds"
        make_input.write(folder)
        lines = [line.split() for line in (folder / file).read_text(encoding="utf-8").splitlines()[1:]]
        bonds = {(int(words[0]), int(words[1])): float(words[2]) for words in lines}
    flowed = {(int(words[0]), int(words[1])): (float(words[3]), float(words[4])) for words in lines} if case.flows else {}

    def forces(velocity):
        found = brute.brute_force(x, velocity, radius, types, case.rows, bonds, case.contact, box)
        return with_flow(found, case, (x, velocity, radius, types, bonds, box), flowed) if case.flows else found

    start = now = forces(v)
    for _ in range(STEPS):
        v = v + 0.5 * case.dt * now["force"] / mass
        x = x + case.dt * v
        now = forces(v)
        flowed.update(now.get("flowed", {}))
        v = v + 0.5 * case.dt * now["force"] / mass
    return {"init": Truth(start, len(bonds)), "run": Truth(now, len(bonds))}


@pytest.mark.parametrize("name", YAML)
def test_reference_numbers_are_those_of_the_brute_force(tmp_path, name):
    case = read_case(name)
    for when, truth in computed(case, tmp_path).items():
        found = truth.found
        scale = found["abs_force"].max()
        assert np.abs(case.numbers[f"{when}_forces"] - found["force"]).max() < ROUND_OFF * scale
        assert case.numbers[f"{when}_vdwl"] == pytest.approx(found["energy"], rel=ROUND_OFF * 1e2)
        virial = found["virial"]
        six = np.array([virial[a, b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
        assert np.abs(case.numbers[f"{when}_stress"] - six).max() < ROUND_OFF * np.abs(virial).max() * 1e2


@pytest.mark.parametrize("name", YAML)
def test_the_state_has_everything_in_it(tmp_path, name):
    """Bonds in both regimes at the end, new pairs and damping; from the file also bonds beyond dlim."""
    case = read_case(name)
    truth = computed(case, tmp_path)
    at_end = truth["run"]
    counts = at_end.found
    within = at_end.bonds - counts["bonds_beyond"]
    assert 20 < counts["bonds_second"] < within - 20
    assert counts["new_contacts"] > 5
    if not case.zone:
        assert truth["init"].found["bonds_second"] > 20
        assert counts["bonds_beyond"] > 5
    undamped = {types: row._replace(gamma=0.0) for types, row in case.rows.items()}
    difference = computed(case._replace(rows=undamped), tmp_path)["run"].found["force"] - counts["force"]
    assert np.abs(difference).max() > 1e-3 * np.abs(counts["force"]).max()
