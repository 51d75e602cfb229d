# SPDX-License-Identifier: GPL-2.0-only
"""in.bending: the force in itself and over its way; what the sections do; what it refuses. Its stiffness: test_doc_studies.py."""

import numpy as np
import pytest
from hostile import refused
from lammps_run import DECKS, edited_deck, packed, read_csv, read_dump, run_lammps

LENGTH, WIDTH, HEIGHT, SPAN = 0.1, 0.01, 0.02, 0.08  # [m]
SMALL = {"strain": 2e-4, "increment": 1e-4}  # of the outer fibre: elastic


bar = packed("bar.data", n=700, shape="block", length=LENGTH, width=WIDTH, height=HEIGHT)


def bend(bar, folder, ranks=1, **choices):
    """The curve of a run."""
    exact = "1e-7*v_stiff" if choices["increment"] == 1e-4 else "3e-5*v_stiff"  # forces left at rest
    run_lammps(edited_deck("in.bending", folder, "3e-5*v_stiff", exact), ranks, {"specimen": bar, "contact": "none", "out": "bent", **choices}, folder).ok()
    return read_csv(folder / "bent.csv")


def test_a_beam(bar, tmp_path):
    """Columns are those of beams; the springs yield two thousandths of the deflection at most. Bent up on two ranks the bar has minus the force. Sections
    at the supports turn by the slope of a beam, most of it 3 deflection/span; the height at the load stays; no roll."""
    curve = bend(bar, tmp_path, **SMALL, also=DECKS / "frames.lmp", frames=1)
    assert list(curve) == ["strain", "stress", "deflection", "force", "reaction"]
    assert curve["strain"] == pytest.approx([0.0, 1e-4, 2e-4], rel=2e-3)
    assert curve["deflection"] == pytest.approx(curve["strain"] * SPAN**2 / (6.0 * HEIGHT), rel=0.01)  # the span is that of whole spheres
    assert curve["stress"] == pytest.approx(1.5 * curve["force"] * SPAN / (WIDTH * HEIGHT**2), rel=0.01)
    assert curve["reaction"][1:] == pytest.approx(curve["force"][1:], rel=1e-4) and curve["force"][2] > 100.0
    frames = read_dump(tmp_path / "bent_frames.dump")
    assert [frame["strain"][0] for frame in frames] == pytest.approx([0.0, 2e-4], abs=1e-9)
    start, end = (frame.x for frame in frames)
    moved, deflection = end - start, curve["deflection"][-1]
    for at, sign in ((0.5 * (LENGTH - SPAN), 1.0), (0.5 * (LENGTH + SPAN), -1.0)):
        near = np.abs(start[:, 0] - at) < 0.004
        assert 0.75 < sign * np.polyfit(start[near, 2], moved[near, 0], 1)[0] / (3.0 * deflection / SPAN) < 1.0
    middle = np.abs(start[:, 0] - 0.5 * LENGTH) < 0.004
    assert abs(np.polyfit(start[middle, 2], moved[middle, 2], 1)[0]) * HEIGHT < 0.03 * deflection
    assert abs(np.polyfit(start[:, 1], moved[:, 2], 1)[0]) * HEIGHT < 0.03 * deflection
    assert np.mean(moved[middle, 2]) < -0.8 * deflection, "control"
    assert bend(bar, tmp_path, 2, **{**SMALL, "strain": -2e-4})["force"][1:] == pytest.approx(-curve["force"][1:], rel=5e-3)


def test_there_and_back(bar, tmp_path):
    """The reversible law comes back to no force. With plasticity the bar unloads with the first stiffness, and a deflection is left where the force is gone."""
    way = {"strain": 0.02, "increment": 0.001, "cycles": 1}
    curve = bend(bar, tmp_path, **way)
    assert len(curve["strain"]) == 41 and np.argmax(curve["strain"]) == 20
    assert abs(curve["force"][-1]) < 2e-3 * curve["force"].max()
    assert curve["stress"][20] < 0.8 * 20 * curve["stress"][1], "control: it has yielded"
    curve = bend(bar, tmp_path, **way, plasticity="isotropic")
    strain, stress = curve["strain"], curve["stress"]
    first = stress[1] / strain[1]
    assert (stress[20] - stress[22]) / (strain[20] - strain[22]) == pytest.approx(first, rel=0.1)
    left = np.interp(0.0, stress[:19:-1], strain[:19:-1])
    assert left == pytest.approx(strain[20] - stress[20] / first, rel=0.1) and 0.004 < left < 0.01
    assert read_dump(tmp_path / "bent_state.dump")[-1]["plastic_work"].max() > 0.0


def test_a_round_bar(tmp_path):
    """Its stress is force span / 4 over PI radius^3 / 4; the slender bar bends as E of tension says, but for its surface."""
    run_lammps("in.specimen", 1, {"n": 1000, "length": 0.2, "radius": 0.012, "out": "round.data"}, tmp_path).ok()
    choices = {"specimen": "round.data", "contact": "none"}
    run_lammps(edited_deck("in.bending", tmp_path, "3e-5*v_stiff", "1e-6*v_stiff"), 1, {**choices, "strain": 2e-4, "increment": 1e-4, "out": "bent"}, tmp_path).ok()
    curve = read_csv(tmp_path / "bent.csv")
    assert curve["stress"][2] == pytest.approx(curve["force"][2] * 0.16 / 4.0 / (np.pi * 0.012**3 / 4.0), rel=0.01)
    run_lammps("in.quasistatic", 1, {**choices, "strain": 2e-4, "increment": 1e-4, "out": "pulled"}, tmp_path).ok()
    tension = read_csv(tmp_path / "pulled.csv")["stress_grip"][2] / 2e-4
    shear = 12.0 * 2.5 * (np.pi * 0.012**4 / 4.0) / (0.882 * np.pi * 0.012**2 * 0.16**2)  # of the deflection, over that by bending
    assert 0.75 < curve["stress"][2] / 2e-4 / (tension / (1.0 + shear)) < 0.95
    body = tmp_path / "round.data.body"
    body.write_text(body.read_text().replace("variable radius ", "# "))
    refused(run_lammps("in.bending", 1, choices, tmp_path), "the cross-section is no rectangle, and its radius is not known: give -var radius")
    refused(run_lammps("in.bending", 1, {**choices, "radius": 0.006}, tmp_path), "the radius of the body is given as 0.006 m, but its outermost sphere reaches to 0.01")
    given = run_lammps("in.bending", 1, {**choices, "radius": 0.012, "strain": 1e-4, "increment": 1e-4, "out": "given"}, tmp_path).ok()
    assert read_csv(tmp_path / "given.csv")["stress"][1] == pytest.approx(curve["stress"][1], rel=1e-3) and not given.warnings()
