# SPDX-License-Identifier: GPL-2.0-only
"""`plasticity isotropic` and fix evp/volume on the reference specimen, contact none, against an independent prototype.

Numbers, what they mean and tolerances: tests/data/reference_500; 3 % at 10/s."""

import json
from typing import NamedTuple

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import curves, cycles, law, specimen
from lammps_run import read_csv, read_dump, run_lammps, slope
from oracle import at_rest

# ---- `plasticity isotropic` on the reference specimen, contact none ----

PUBLISHED = json.loads(REFERENCE.with_name("specimen_500_plastic.json").read_text())
TO_2PC = PUBLISHED["table1_tension_2pc"]
MPA, GPA = 1e6, 1e9
FLOW = {"plasticity": "isotropic", "contact": "none"}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Runs of a deck on the specimen, each made once: the curve, and what was printed."""
    known = {}

    def get(deck, **choices):
        key = (deck, *choices.items())
        if key not in known:
            folder = tmp_path_factory.mktemp("run")
            run = run_lammps(deck, 1, {"specimen": REFERENCE, "out": "run", **choices}, folder).ok()
            known[key] = curves.read_curve(folder / "run.csv"), run
        return known[key]

    return get


@pytest.mark.parametrize("key", ["table1_tension_2pc", "table1_compression_10pc", "soft_compression_10pc", "table1_saturation_tension_5pc"])
def test_loading_and_release_without_a_rate(done, key):
    published = PUBLISHED[key]
    top = max(map(float, published["stress_MPa"]), key=abs)
    coeff = f"{published['e1']} 8 4 {published['e2']} 8 4 {published['xi_s']} 0 1.5 saturation {published['saturation']}"
    curve, _ = done("in.quasistatic", coeff=coeff, strain=top, increment=published["increment"], cycles=1, lower="release", **FLOW)
    turn = int(cycles.turns(curve.strain)[0])
    for strain, stress in published["stress_MPa"].items():
        row = int(np.argmin(np.abs(curve.strain[: turn + 1] - float(strain))))
        assert curve.strain[row] == pytest.approx(float(strain), rel=1e-6)
        assert curve.virial[row] / MPA == pytest.approx(stress, rel=0.01), strain
    assert cycles.residual_strain(curve.strain, curve.virial) == pytest.approx(published["residual_strain"], abs=0.02 * abs(top))
    first = slice(turn, turn + 3)
    assert np.polyfit(curve.strain[first], curve.virial[first], 1)[0] / GPA == pytest.approx(published["unload_modulus_GPa"], rel=0.04)


def test_loading_and_release_of_the_second_writing(done, reference):
    """The whole way in numpy, tests/oracle/at_rest.py, on the same increments: each stress, in the reverse flow too."""
    curve, _ = done("in.quasistatic", cycles=1, increment=0.001, **FLOW)
    _, stress = at_rest.drive(reference, law.TABLE1, curve.strain[1:])
    assert curve.virial / MPA == pytest.approx(stress / MPA, rel=2e-3, abs=0.05)
    assert stress[-1] < -100.0 * MPA, "control: it flowed back"


def test_release_at_a_rate(done):
    curve, _ = done("in.cyclic", rate=10, **FLOW)
    assert cycles.residual_strain(curve.strain, curve.virial) == pytest.approx(TO_2PC["residual_strain"], rel=0.03)
    assert cycles.unloading_modulus(curve.strain, curve.virial) / GPA == pytest.approx(TO_2PC["unload_modulus_GPa"], rel=0.04)


@pytest.mark.parametrize("deck, choices", [("in.quasistatic", {"cycles": 1}), ("in.cyclic", {"rate": 10})])
def test_reversible_leaves_nothing(done, deck, choices):
    curve, run = done(deck, contact="none", **choices)
    assert abs(cycles.residual_strain(curve.strain, curve.virial)) < 2e-4
    assert "plasticity isotropic" not in run.stdout


def test_the_way_up_is_that_of_eq_8(done):
    """To 2 % within 0.5 %: few pairs turn."""
    flowed, eq8 = (done("in.quasistatic", cycles=1, **more)[0] for more in (FLOW, {"contact": "none"}))
    up = slice(1, 41)
    assert flowed.strain[up] == pytest.approx(eq8.strain[up], abs=1e-12)
    assert flowed.virial[up] == pytest.approx(eq8.virial[up], rel=5e-3)


def test_resumed_on_the_way_back_with_its_flow(tmp_path):
    """A restart file holds q and k: the way back goes on from it, on other ranks too, to 1 Pa."""
    choices = {"specimen": REFERENCE, "out": "run", "strain": 0.01, **FLOW}
    (tmp_path / "whole").mkdir()
    run_lammps("in.quasistatic", 1, {**choices, "cycles": 2}, tmp_path / "whole").ok()
    whole = read_csv(tmp_path / "whole" / "run.csv")
    assert whole["stress_grip"][40] < -50 * MPA, "control: it flowed"
    run_lammps("in.quasistatic", 1, {**choices, "cycles": 1}, tmp_path).ok()
    run_lammps("in.quasistatic", 1, {**choices, "cycles": 2, "resume": "yes"}, tmp_path).ok()
    again = read_csv(tmp_path / "run.csv")
    for name in ("stress_grip", "stress_virial"):
        assert np.allclose(again[name], whole[name], rtol=1e-8, atol=1.0), name


@pytest.mark.parametrize("deck, choices", [("in.quasistatic", {}), ("in.traction", {"rate": 10})])
def test_decks_take_break(done, deck, choices):
    """Pairs that break at 3 % make the body weaker; before the first one does, both curves are the same."""
    weak, run = done(deck, contact="none", strain=0.02, **{"break": 0.03}, **choices)
    broken = read_csv(run.folder / "run.csv")["broken"][-1]
    plain, _ = done(deck, contact="none", strain=0.02, **choices)
    assert broken > 20 and weak.virial[-1] < 0.98 * plain.virial[-1]
    start = int(np.sum(plain.strain < 0.004))
    assert weak.virial[:start] == pytest.approx(plain.virial[:start], rel=1e-5, abs=1.0)


# ---- fix evp/volume on the reference specimen, quasi-static, table 1, contact none, `plasticity isotropic`, against an independent prototype ----

INCREMENT = 5e-4
TABLE1 = "80 8 4 3 8 4 0.005 0 1.5"
STOPS = (0.003, 0.05)  # the strains at which the middle is measured


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
            choices = {"specimen": REFERENCE, "contact": "none", "coeff": f"{TABLE1} kv {kv}", "plasticity": plasticity}
            for stop in STOPS:
                run_lammps("in.quasistatic", 1, {**choices, "strain": stop, "out": "rest"}, folder).ok()
                middle[stop] = specimen.middle_strains(reference, read_dump(folder / "rest_state.dump")[-1].vectors("x", "y", "z"))
                choices["resume"] = "yes"
            known[kv, plasticity] = Pull(read_csv(folder / "rest.csv"), middle)
        return known[kv, plasticity]

    return get


@pytest.mark.parametrize("kv", [300, 1000, 3000])
def test_the_prototype(pulled, kv):
    published, pull = PUBLISHED[f"table1_density_kv{kv}_tension_5pc"], pulled(kv)
    for strain, stress in published["stress_MPa"].items():
        row = int(np.argmin(np.abs(pull.curve["strain"] - float(strain))))
        assert pull.curve["strain"][row] == pytest.approx(float(strain), rel=1e-6)
        assert pull.curve["stress_virial"][row] / MPA == pytest.approx(stress, rel=0.01), strain
    start = pull.curve["strain"] <= 0.00301
    assert slope(pull.curve["strain"][start], pull.curve["stress_virial"][start]) / 1e9 == pytest.approx(published["E0_GPa"], rel=0.01)
    axial, lateral = pull.middle[0.003]
    assert -lateral / axial == pytest.approx(published["nu0"], abs=0.005)
    axial, lateral = pull.middle[0.05]
    assert (1 + axial) * (1 + lateral) ** 2 - 1 == pytest.approx(published["volume_ratio_mid"], rel=0.03, abs=1e-4)


def test_without_it_the_body_swells_and_poissons_ratio_is_a_quarter(pulled):
    """Control: the paper's law on the same body."""
    pull = pulled(0, "none")
    axial, lateral = pull.middle[0.003]
    assert 0.25 < -lateral / axial < 0.28
    axial, lateral = pull.middle[0.05]
    assert axial + 2 * lateral > 0.02


def test_kv_goes_with_e_where_the_material_is_kept(tmp_path):
    """As 1/N: 250 spheres have twice the kv and e of 500, as a row has with their spacing and coordination."""
    run_lammps("in.specimen", 1, {"n": 250, "out": "small.data"}, tmp_path).ok()
    choices = {"specimen": "small.data", "strain": 0.001, "contact": "none"}
    body = specimen.read_data(tmp_path / "small.data")
    i, j = specimen.pairs_within(body, 1.5)[0].T
    measures = f"spacing {np.linalg.norm(body.x[i] - body.x[j], axis=1).mean():.15g} coordination {2 * len(i) / 250:.15g}"
    curves = {}
    for name, coeff in {"kept": f"{TABLE1} kv 1000", "doubled": f"160 8 4 6 8 4 0.005 0 1.5 kv 2000 {measures}", "none": TABLE1}.items():
        run_lammps("in.quasistatic", 1, {**choices, "coeff": coeff, "out": name}, tmp_path).ok()
        curves[name] = read_csv(tmp_path / f"{name}.csv")["stress_virial"]
    assert curves["kept"][1:] == pytest.approx(curves["doubled"][1:], rel=1e-3)
    assert curves["kept"][-1] > 1.05 * curves["none"][-1], "control"
