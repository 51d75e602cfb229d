# SPDX-License-Identifier: GPL-2.0-only
"""`plasticity isotropic` and fix evp/volume on the reference specimen, contact none, against an independent prototype.

Numbers, what they mean and tolerances: tests/data/reference_500; 3 % at 10/s."""

import json
import shutil

import numpy as np
import pytest
from evp import curves, specimen
from lammps_run import REFERENCE, read_csv, read_dump, run_lammps, slope

PUBLISHED = json.loads(REFERENCE.with_name("specimen_500_plastic.json").read_text())
TO_2PC = PUBLISHED["table1_tension_2pc"]
MPA, GPA = 1e6, 1e9


def run(deck, folder, **choices):
    """The curve of a deck on the specimen."""
    run_lammps(deck, 1, {"specimen": REFERENCE, "out": "run", "plasticity": "isotropic", "contact": "none", **choices}, folder).ok()
    return curves.read_curve(folder / "run.csv")


def test_a_pull_without_choices(tmp_path):
    """in.metal: the stress of its head, all of it on less than two screens."""
    for end in ("", ".body"):
        shutil.copy(f"{REFERENCE}{end}", tmp_path / f"specimen.data{end}")
    found = run_lammps("in.metal", 1, {}, tmp_path).ok()
    curve = read_csv(tmp_path / "metal.csv")
    assert len(found.stdout.splitlines()) <= 100 and curve["stress"].max() / MPA == pytest.approx(389, rel=0.05) and abs(curve["stress"][-1]) / MPA < 20


@pytest.mark.parametrize("key", ["table1_tension_2pc", "table1_compression_10pc", "soft_compression_10pc", "table1_saturation_tension_5pc"])
def test_loading_and_release_without_a_rate(tmp_path, key):
    published = PUBLISHED[key]
    top = max(map(float, published["stress_MPa"]), key=abs)
    coeff = f"{published['e1']} 8 4 {published['e2']} 8 4 {published['xi_s']} 0 1.5 saturation {published['saturation']}"
    curve = run("in.quasistatic", tmp_path, coeff=coeff, strain=top, increment=published["increment"], cycles=1, lower="release")
    turn = int(curves.turns(curve.strain)[0])
    for strain, stress in published["stress_MPa"].items():
        row = int(np.argmin(np.abs(curve.strain[: turn + 1] - float(strain))))
        assert curve.strain[row] == pytest.approx(float(strain), rel=1e-6)
        assert curve.virial[row] / MPA == pytest.approx(stress, rel=0.01), strain
    assert curves.residual_strain(curve.strain, curve.virial) == pytest.approx(published["residual_strain"], abs=0.02 * abs(top))
    first = slice(turn, turn + 3)
    assert np.polyfit(curve.strain[first], curve.virial[first], 1)[0] / GPA == pytest.approx(published["unload_modulus_GPa"], rel=0.04)


def test_release_at_a_rate(tmp_path):
    curve = run("in.cyclic", tmp_path, rate=10)
    assert curves.residual_strain(curve.strain, curve.virial) == pytest.approx(TO_2PC["residual_strain"], rel=0.03)
    assert curves.unloading_modulus(curve.strain, curve.virial) / GPA == pytest.approx(TO_2PC["unload_modulus_GPa"], rel=0.04)


def pull(folder, reference, kv, plasticity="isotropic"):
    """Columns of a pull to 5 %, and (axial, lateral) strain of the middle at each stop, where the deck writes the atoms and is resumed."""
    middle, choices = [], {"specimen": REFERENCE, "contact": "none", "coeff": f"80 8 4 3 8 4 0.005 0 1.5 kv {kv}", "plasticity": plasticity}
    for stop in (0.003, 0.05):
        run_lammps("in.quasistatic", 1, {**choices, "strain": stop, "out": "rest"}, folder).ok()
        middle.append(specimen.middle_strains(reference, read_dump(folder / "rest_state.dump")[-1].vectors("x", "y", "z")))
        choices["resume"] = "yes"
    return read_csv(folder / "rest.csv"), *middle


@pytest.mark.parametrize("kv", [300, 3000])
def test_the_prototype(tmp_path, reference, kv):
    published = PUBLISHED[f"table1_density_kv{kv}_tension_5pc"]
    curve, start, end = pull(tmp_path, reference, kv)
    for strain, stress in published["stress_MPa"].items():
        row = int(np.argmin(np.abs(curve["strain"] - float(strain))))
        assert curve["strain"][row] == pytest.approx(float(strain), rel=1e-6)
        assert curve["stress_virial"][row] / MPA == pytest.approx(stress, rel=0.01), strain
    first = curve["strain"] <= 0.00301
    assert slope(curve["strain"][first], curve["stress_virial"][first]) / 1e9 == pytest.approx(published["E0_GPa"], rel=0.01)
    assert -start[1] / start[0] == pytest.approx(published["nu0"], abs=0.005)
    axial, lateral = end
    assert (1 + axial) * (1 + lateral) ** 2 - 1 == pytest.approx(published["volume_ratio_mid"], rel=0.03, abs=1e-4)


def test_without_it_the_body_swells_and_poissons_ratio_is_a_quarter(tmp_path, reference):
    """Control: the paper's law on the same body."""
    _, start, end = pull(tmp_path, reference, 0, "none")
    assert 0.25 < -start[1] / start[0] < 0.28
    assert end[0] + 2 * end[1] > 0.02
