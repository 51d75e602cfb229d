# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/volume on the reference specimen, quasi-static, Table 1, contact none, `plasticity isotropic`, against an independent prototype.

Numbers, what they mean and tolerances: tests/data/reference_500."""

import json
from typing import NamedTuple

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import specimen
from lammps_run import read_csv, read_dump, run_lammps, slope

PUBLISHED = json.loads(REFERENCE.with_name("specimen_500_plastic.json").read_text())
INCREMENT = 5e-4
STOPS = (0.003, 0.05)  # the strains at which the middle is measured
MPA = 1e6


class Pull(NamedTuple):
    curve: dict
    middle: dict  # {strain: (axial, lateral) strain of the middle}


@pytest.fixture(scope="module")
def pulled(reference, tmp_path_factory):
    """Pulls to 5 %, each made once: resumed at every stop, where the deck writes the atoms."""
    known = {}

    def get(kv, plasticity="isotropic"):
        if (kv, plasticity) not in known:
            folder, middle = tmp_path_factory.mktemp("pull"), {}
            choices = {"specimen": REFERENCE, "contact": "none", "kv": kv, "plasticity": plasticity}
            for stop in STOPS:
                run_lammps("in.quasistatic", 1, {**choices, "strain": stop, "out": "rest"}, folder).ok()
                middle[stop] = specimen.middle_strains(reference, read_dump(folder / "rest_state.dump")[-1].vectors("x", "y", "z"))
                choices = {"resume": round(stop / INCREMENT)}
            known[kv, plasticity] = Pull(read_csv(folder / "rest.csv"), middle)
        return known[kv, plasticity]

    return get


@pytest.mark.parametrize("kv", [300, 1000, 3000])
def test_the_prototype(pulled, kv):
    published, pull = PUBLISHED[f"table1_kv{kv}_tension_5pc"], pulled(kv)
    for strain, stress in published["stress_MPa"].items():
        row = int(np.argmin(np.abs(pull.curve["strain"] - float(strain))))
        assert pull.curve["strain"][row] == pytest.approx(float(strain), rel=1e-6)
        assert pull.curve["stress_virial"][row] / MPA == pytest.approx(stress, rel=0.01), strain
    start = pull.curve["strain"] <= 0.00301
    assert slope(pull.curve["strain"][start], pull.curve["stress_virial"][start]) / 1e9 == pytest.approx(published["E0_GPa"], rel=0.01)
    axial, lateral = pull.middle[0.003]
    assert -lateral / axial == pytest.approx(published["nu0"], abs=0.005)
    axial, lateral = pull.middle[0.05]
    assert axial + 2 * lateral == pytest.approx(published["vol_strain_mid"], rel=0.03, abs=1e-4)


def test_without_it_the_body_swells_and_poissons_ratio_is_a_quarter(pulled):
    """Control: the paper's law on the same body."""
    pull = pulled(0, "none")
    axial, lateral = pull.middle[0.003]
    assert 0.25 < -lateral / axial < 0.28
    axial, lateral = pull.middle[0.05]
    assert axial + 2 * lateral > 0.02


def test_kv_goes_with_e_where_the_material_is_kept(tmp_path):
    """As 1/N: 250 spheres have twice the kv and e of 500. kv 0 defines no fix."""
    run_lammps("in.specimen", 1, {"n": 250, "out": "small.data", "steps": 8, "iterations": 100}, tmp_path).ok()
    choices = {"specimen": "small.data", "strain": 0.001, "contact": "none"}
    doubled = {"scale": "no", "coeff": "160 8 4 6 8 4 0.005 0 1.5"}
    curves = {}
    for name, more in {"kept": {"kv": 1000}, "doubled": {"kv": 2000, "tolerance": 1.5e-4, **doubled}, "none": {"kv": 0}}.items():
        run = run_lammps("in.quasistatic", 1, {**choices, **more, "out": name}, tmp_path).ok()
        curves[name] = read_csv(tmp_path / f"{name}.csv")["stress_virial"]
    assert curves["kept"][1:] == pytest.approx(curves["doubled"][1:], rel=1e-3) and "evp/volume" not in run.stdout
    assert curves["kept"][-1] > 1.05 * curves["none"][-1], "control"
