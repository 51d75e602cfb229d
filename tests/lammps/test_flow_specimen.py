# SPDX-License-Identifier: GPL-2.0-only
"""`plasticity isotropic` on the reference specimen, Table 1, contact none: springback of an independent prototype.

Numbers and what they mean: tests/data/reference_500; tolerances: 1 % without a rate, 3 % at 10/s."""

import json

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import at_rest, curves, cycles, law
from lammps_run import read_csv, run_lammps

PUBLISHED = json.loads(REFERENCE.with_name("specimen_500_metal.json").read_text())
FROM_2PC, TO_5PC = PUBLISHED["from_2pc"], PUBLISHED["kv_0_J"]
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


def test_springback_without_a_rate(done):
    """To 2 % and back to zero stress and to zero strain."""
    curve, _ = done("in.quasistatic", cycles=1, **FLOW)
    assert cycles.residual_strain(curve.strain, curve.virial) == pytest.approx(FROM_2PC["residual_strain"], rel=0.01)
    assert cycles.unloading_modulus(curve.strain, curve.virial) / GPA == pytest.approx(FROM_2PC["unload_modulus_GPa"], rel=0.01)


def test_springback_is_that_of_the_second_writing(done, reference):
    """The whole way in numpy, tools/evp/at_rest.py, on the same increments: each stress, in the reverse flow too; -129.7 MPa at its end."""
    curve, _ = done("in.quasistatic", cycles=1, increment=0.001, **FLOW)
    strain, stress = at_rest.drive(reference, law.TABLE1, curve.strain[1:])
    assert curve.virial / MPA == pytest.approx(stress / MPA, rel=2e-3, abs=0.05)
    back = cycles.stress_back_at(strain, stress) / MPA
    assert cycles.stress_back_at(curve.strain, curve.virial) / MPA == pytest.approx(back, rel=1e-3)
    assert back < -100.0, "control: it flowed back"


def test_stress_back_at_zero_strain_of_the_prototype(done, reference):
    """The one figure that differs: -133.52 MPa, here -129.7. In the prototype q goes on flowing beyond dlim, so that a pair that comes back
    repels at once. Here q is frozen beyond dlim, and a pair comes back as it left. With the former rule tools/evp/at_rest.py gives the
    published figure, with the latter that of the test above."""
    curve, _ = done("in.quasistatic", cycles=1, increment=0.001, **FLOW)
    published = FROM_2PC["stress_back_at_zero_strain_MPa"]
    strains = 0.002 * np.array([*range(1, 11), *range(9, -1, -1)])
    flowing = cycles.stress_back_at(*at_rest.drive(reference, law.TABLE1, strains, left=3.0, outside="flowing")) / MPA
    assert flowing == pytest.approx(published, rel=0.01)
    assert cycles.stress_back_at(curve.strain, curve.virial) / MPA > published + 3.0, "control: the rules differ"


def test_springback_from_5_percent(done):
    curve, _ = done("in.quasistatic", cycles=1, strain=0.05, lower=0.038, **FLOW)
    assert cycles.residual_strain(curve.strain, curve.virial) == pytest.approx(TO_5PC["residual_from_5pc"], rel=0.01)
    assert cycles.unloading_modulus(curve.strain, curve.virial) / GPA == pytest.approx(TO_5PC["unload_modulus_GPa"], rel=0.01)


def test_springback_at_a_rate(done):
    curve, _ = done("in.cyclic", rate=10, **FLOW)
    assert cycles.residual_strain(curve.strain, curve.virial) == pytest.approx(FROM_2PC["residual_strain"], rel=0.03)
    assert cycles.unloading_modulus(curve.strain, curve.virial) / GPA == pytest.approx(FROM_2PC["unload_modulus_GPa"], rel=0.03)
    back = cycles.stress_back_at(curve.strain, curve.virial) / MPA
    assert back == pytest.approx(FROM_2PC["stress_back_at_zero_strain_MPa"], rel=0.03)


@pytest.mark.parametrize("deck, choices", [("in.quasistatic", {"cycles": 1}), ("in.cyclic", {"rate": 10})])
def test_reversible_leaves_nothing(done, deck, choices):
    curve, run = done(deck, contact="none", **choices)
    assert abs(cycles.residual_strain(curve.strain, curve.virial)) < 2e-4
    assert "plasticity isotropic" not in run.stdout


def test_the_way_up_is_that_of_eq_8(done):
    """A pair that only stretches follows eq. 8, and few others turn: to 2 % the stress is the prototype's and the paper's."""
    flowed, eq8 = (done("in.quasistatic", cycles=1, **more)[0] for more in (FLOW, {"contact": "none"}))
    up = slice(0, 41)
    assert flowed.strain[up] == pytest.approx(eq8.strain[up], abs=1e-12)
    for strain, stress in TO_5PC["stress_MPa"].items():
        if float(strain) <= 0.02:
            row = int(np.argmin(np.abs(flowed.strain[up] - float(strain))))
            assert flowed.virial[row] / MPA == pytest.approx(stress, rel=0.01), strain
    assert np.abs(flowed.virial[up] / np.maximum(eq8.virial[up], MPA) - 1.0)[1:].max() < 0.01


def test_increment_makes_little_difference(done):
    """The return map is exact for any increment of a pair; the body, which finds its rest differently, moves by less than 1 %."""
    curve, _ = done("in.quasistatic", cycles=1, increment=0.001, **FLOW)
    assert cycles.residual_strain(curve.strain, curve.virial) == pytest.approx(FROM_2PC["residual_strain"], rel=0.01)


def test_loop_area_is_the_plastic_work(tmp_path):
    """Three loops between -1 and 1 % at 10/s: the work of the grips is what the pairs dissipated, within 0.5 %; the loops are steady."""
    (tmp_path / "work.lmp").write_text(
        "compute of_pairs all pair/local p5\ncompute plastic all reduce sum c_of_pairs inputs local\n"
        'fix plastic all print $(v_steps_per_row) "${now},$(c_plastic)" file plastic.csv screen no title strain,work\n')
    choices = {"specimen": REFERENCE, "out": "run", "also": "work.lmp", "strain": 0.01, "lower": -0.01, "cycles": 4, "row": 0.0002, "dtfraction": 0.8}
    run_lammps("in.cyclic", 1, {**choices, **FLOW}, tmp_path).ok()
    curve, plastic = curves.read_curve(tmp_path / "run.csv"), read_csv(tmp_path / "plastic.csv")
    once = np.append(True, np.diff(plastic["strain"]) != 0.0)  # fix print writes a turn twice, at the end of a run and at the set-up of the next
    work = plastic["work"][once]
    dissipated = np.diff(work[cycles.turns(plastic["strain"][once])][::2])
    volume = np.pi * 0.02**2 * 0.04  # between the grips
    areas = np.array(cycles.loop_areas(curve.strain, curve.grip))
    assert len(areas) == len(dissipated) == 3
    assert areas * volume == pytest.approx(dissipated, rel=5e-3)
    assert areas == pytest.approx(areas.mean(), rel=0.02)
    lost = np.diff(read_csv(tmp_path / "run_bonds.csv")["beyond_dlim"]) > 0
    assert np.all((np.diff(work) >= 0.0) | lost), "it only grows, but where pairs leave what pair/local lists"
    assert lost.mean() < 0.1, "control"


def test_resumed_on_the_way_back_with_its_flow(tmp_path):
    """A restart file holds the offsets: the way back goes on from it, on other ranks too, to 1 Pa."""
    choices = {"specimen": REFERENCE, "out": "run", "cycles": 1, "strain": 0.01, "restart": 5, **FLOW}
    run_lammps("in.quasistatic", 1, choices, tmp_path).ok()
    whole = read_csv(tmp_path / "run.csv")
    assert whole["stress_grip"][-1] < -50 * MPA, "control: it flowed"
    for start in (15, 25):
        run_lammps("in.quasistatic", 1, {"out": "run", "resume": start, "cycles": 1, "strain": 0.01}, tmp_path).ok()
        again = read_csv(tmp_path / "run.csv")
        for name in ("stress_grip", "stress_virial"):
            assert np.allclose(again[name], whole[name], rtol=1e-8, atol=1.0), (start, name)


@pytest.mark.parametrize("deck, choices", [("in.quasistatic", {}), ("in.traction", {"rate": 10})])
def test_decks_take_break(done, deck, choices):
    """Pairs that break at 3 % make the body weaker; before the first one does, both curves are the same."""
    weak, run = done(deck, contact="none", strain=0.02, **{"break": 0.03}, **choices)
    broken = int(run.stdout.rpartition("bonds broken: ")[2].split()[0])
    plain, _ = done(deck, contact="none", strain=0.02, **choices)
    assert broken > 20 and weak.virial[-1] < 0.98 * plain.virial[-1]
    start = int(np.sum(plain.strain < 0.004))
    assert weak.virial[:start] == pytest.approx(plain.virial[:start], rel=1e-5, abs=1.0)


@pytest.mark.parametrize("deck", ["in.quasistatic", "in.traction", "in.cyclic"])
def test_bad_break(tmp_path, deck):
    for word in ("-0.1", "0", "much"):
        found = run_lammps(deck, 1, {"specimen": REFERENCE, "out": "run", "break": word}, tmp_path)
        assert found.returncode != 0 and "break" in found.stdout.partition("ERROR")[2], found.stdout[-500:]
        assert not (tmp_path / "run.csv").exists()
