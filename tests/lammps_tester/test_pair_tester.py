# SPDX-License-Identifier: GPL-2.0-only
"""LAMMPS' own pair tester on evp/lj, and its reference numbers against sums over all pairs.

test_pair_style of LAMMPS (unittest/force-styles in its source tree) is compiled from the tree that the plugin is built for. It makes the
numbers of its YAML file itself, with newton on, and then compares with them forces, energy and virial at a state and after four steps: newton on and
off, after a restart, with and without the short way to the virial, from a data file; it asks extract() for every coefficient but alpha. The numbers are those
of tests/oracle/brute.py and Verlet steps in Python.

Left out: `single` needs atom_style full, whose atoms have no radius (test_forces.py has it); others are of accelerated variants, which evp/lj does not have.
"""

import os
import pathlib
import shutil
import subprocess
from typing import NamedTuple

import numpy as np
import pytest
from oracle import brute, law
from small_bodies import Small, lattice_body, mass_of, words, write_body

FOLDER = pathlib.Path(__file__).resolve().parent
TESTS = ("plain", "extract")
STEPS = 4  # of the tester
# A sum of up to 30 pair forces, each with xi = d/deq - 1 to 1e-16/0.005, over the largest of them.
ROUND_OFF = 1e-11
STRETCH = np.array([1.045, 1.0, 0.98])
ROWS = {
    (1, 1): law.Row(80.0, 8.0, 4.0, 3.0, 8.0, 4.0, 0.005, 1000.0, 1.5),
    (1, 2): law.Row(60.0, 9.0, 4.0, 3.0, 7.0, 4.0, 0.008, 500.0, 1.45),
    (2, 2): law.Row(50.0, 8.0, 4.0, 2.0, 8.0, 3.0, 0.006, 0.0, 1.5),
}


class Case(NamedTuple):
    """zone: 0 for bonds from a file."""

    style: str
    contact: str
    dt: float
    zone: float = 0.0
    flows: bool = False  # plasticity isotropic: the bond file has spheres that have flowed


CASES = {
    "both regimes, bonds beyond dlim": Case("contact literal", "literal", 1e-7),
    "recorded at set-up": Case("contact literal overlap 0.4", "literal", 4e-7, zone=1.3),  # fast: four steps bring bonds into the second regime
    "flow both ways": Case("contact repulsive plasticity isotropic", "repulsive", 1e-7, flows=True),
}
YAML = """---
lammps_version: 4 Feb 2025
tags: evp
date_generated: Sat Nov 21 12:00:00 2026
epsilon: 1e-11
skip_tests: single
prerequisites: ! |
  atom sphere
  pair evp/lj
  fix evp/bonds
pre_commands: ! ""
post_commands: ! |
  neighbor 0.0006 bin
  timestep {dt}
  fix bonds all evp/bonds {record}
input_file: in.evp_lj
pair_style: evp/lj {style}
pair_coeff: ! |
{coeffs}
extract: ! |
{extract}
"""


class Scene(NamedTuple):
    """A stretched and shaken body in a periodic box, and its bonds before that: some of them in either regime, some beyond dlim, other pairs have met."""

    body: Small
    v: np.ndarray
    bonds: dict  # {(id_i, id_j): deq}
    spheres: list  # lines of the bond file


def scene_of(case):
    rest, rng = lattice_body((4, 4, 4), "xyz", zone=1.44), np.random.default_rng(2017)
    x = rest.x * STRETCH + rng.uniform(-2e-4, 2e-4, rest.x.shape)
    body = rest._replace(x=x, box=rest.box * STRETCH[:, None], cell=rest.cell * STRETCH)
    bonds, spheres = rest.bonds, []
    if case.zone:
        bonds = brute.record_bonds(x, body.radius, case.zone, np.diag(body.cell))
    if case.flows:  # flow both ways by formula, every third not at all; bonds left out are new pairs, which repel where they overlap
        bonds = {pair: deq for pair, deq in bonds.items() if sum(pair) % 7}
        bonds = {(i, j): deq * (1.0 if (i + j) % 3 == 0 else 1.0 + 0.015 * np.sin(1.7 * i + 2.9 * j)) for (i, j), deq in bonds.items()}
        counts = np.bincount(np.array(list(bonds)).ravel(), minlength=len(x) + 1)
        spheres = [f"sphere {k} {0.02 * (k % 4)} 0.25 1e-4 {counts[k]} {counts[k]}\n" for k in range(1, len(x) + 1)]
    return Scene(body, rng.uniform(-100.0, 100.0, x.shape), bonds, spheres)


def write(folder, case, scene):
    """Data file, bond file, input script and a YAML file without numbers."""
    shutil.copy(FOLDER / "in.evp_lj", folder)  # the tester leaves files where it runs
    write_body(folder / "data.evp_lj", scene.body)
    with open(folder / "data.evp_lj", "a", encoding="utf-8") as out:
        out.write("\nVelocities\n\n")
        out.writelines(f"{k} {' '.join(f'{value:.17g}' for value in v)} 0 0 0\n" for k, v in enumerate(scene.v, start=1))
    lines = [f"{i} {j} {deq:.17g}\n" for (i, j), deq in scene.bonds.items()] + scene.spheres
    more = f"SPHERES: {len(scene.spheres)} COLUMNS: plastic_strain,plastic_work,slip,bonds,recorded " if scene.spheres else ""
    (folder / "evp_lj.bonds").write_text(f"# EVP bonds COUNT: {len(scene.bonds)} {more}UNITS: si\n{''.join(lines)}", encoding="utf-8")
    record = f"zone {case.zone}" if case.zone else "file ${input_dir}/evp_lj.bonds"
    coeffs = "\n".join(f"  {a} {b} {words(row)}" for (a, b), row in ROWS.items())
    extract = "\n".join(f"  {name} 2" for name in law.Row._fields if name != "alpha")
    (folder / "pair.yaml").write_text(YAML.format(dt=case.dt, record=record, style=case.style, coeffs=coeffs, extract=extract), encoding="utf-8")


def run_tester(folder, *options):
    """What the tester says of pair.yaml."""
    environment = {**os.environ, "LAMMPS_PLUGIN_PATH": str(pathlib.Path(os.environ["EVP_LMP"]).parent), "OMP_NUM_THREADS": "1",
                   "LD_LIBRARY_PATH": os.environ["EVP_LAMMPS_LIBRARY"]}
    run = subprocess.run([os.environ["EVP_PAIR_TESTER"], "pair.yaml", "-d", str(folder), *options], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stdout[-4000:]
    return run.stdout


def numbers_of(path):
    """{name: array} of the blocks of numbers of a YAML file."""
    blocks, key = {}, None
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith(" "):
            key, _, rest = line.partition(":")
            blocks[key] = rest.split() if key.endswith("_vdwl") else []
        else:
            blocks[key] += line.split()
    return {name: np.array(values, dtype=float) for name, values in blocks.items() if name.startswith(("init_", "run_"))}


def computed(case, scene, rows=ROWS):
    """What the tester's two moments are by sums over all pairs, without flow: at the start, and after four Verlet steps."""
    body, mass = scene.body, mass_of(scene.body.radius)[:, None]
    x, v = body.x, scene.v

    def forces(velocity):
        return brute.brute_force(x, velocity, body.radius, body.types, rows, scene.bonds, case.contact, np.diag(body.cell))

    start = now = forces(v)
    for _ in range(STEPS):
        v = v + 0.5 * case.dt * now["force"] / mass
        x = x + case.dt * v
        now = forces(v)
        v = v + 0.5 * case.dt * now["force"] / mass
    return {"init": start, "run": now}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_lammps_own_tester(tmp_path, case):
    """The numbers are those of the sums, and the same on all of the tester's ways. Control: bonds in both regimes at the end, new pairs and damping; from the
    file also bonds beyond dlim; with flow the forces are others."""
    scene = scene_of(case)
    write(tmp_path, case, scene)
    run_tester(tmp_path, "-u")
    numbers, truth = numbers_of(tmp_path / "pair.yaml"), computed(case, scene)
    for when, found in truth.items():
        virial, off = found["virial"], np.abs(numbers[f"{when}_forces"].reshape(-1, 4)[:, 1:] - found["force"]).max() / found["abs_force"].max()
        if case.flows:  # its forces: tests/lammps/test_flow_pairs.py
            assert off > 0.01
            continue
        assert off < ROUND_OFF
        assert numbers[f"{when}_vdwl"] == pytest.approx(found["energy"], rel=ROUND_OFF * 1e2)
        six = np.array([virial[a, b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
        assert np.abs(numbers[f"{when}_stress"] - six).max() < ROUND_OFF * np.abs(virial).max() * 1e2

    output = run_tester(tmp_path, "-s", "--gtest_filter=" + ":".join(f"PairStyle.{test}" for test in TESTS))
    assert f"[  PASSED  ] {len(TESTS)} tests." in output and "SKIPPED" not in output and "FAILED" not in output
    for stage in ("init_forces (newton on)", "run_forces (newton on)", "init_forces (newton off)", "run_forces (newton off)", "restart_forces",
                  "nofdotr_forces", "data_forces"):
        assert f"{stage} stats" in output, stage

    end = truth["run"]
    assert 20 < end["bonds_second"] < len(scene.bonds) - end["bonds_beyond"] - 20 and end["new_contacts"] > 5
    assert case.zone or (truth["init"]["bonds_second"] > 20 and end["bonds_beyond"] > 5)
    undamped = computed(case, scene, {types: row._replace(gamma=0.0) for types, row in ROWS.items()})["run"]["force"]
    assert np.abs(undamped - end["force"]).max() > 1e-3 * np.abs(end["force"]).max()
