# SPDX-License-Identifier: GPL-2.0-only
"""in.torsion: the torque, its way, the grips, a tube. Its stiffness: test_doc_studies.py."""

import numpy as np
import pytest
from hostile import refused
from lammps_run import DECKS, REFERENCE, edited_deck, read_csv, read_dump, run_lammps

SMALL = {"angle": 0.0004, "increment": 0.0002}  # a strain of 2e-4 at the surface: elastic


def twist(folder, ranks=1, **choices):
    """The curve of a run on the reference specimen, with forces that are 300 times smaller than by default left at rest."""
    choices = {"specimen": REFERENCE, "contact": "none", "out": "twisted", **choices}
    run_lammps(edited_deck("in.torsion", folder, "3e-4*", "1e-6*" if choices.get("increment") == 0.0002 else "3e-4*"), ranks, choices, folder).ok()
    return read_csv(folder / f"{choices['out']}.csv")


def test_rows(tmp_path):
    """The torque of the grips is that through the middle; minus the angle has minus the torque, on two ranks."""
    curve = twist(tmp_path, **SMALL)
    assert list(curve) == ["angle", "shear_strain", "torque_grip", "torque_virial", "shear_stress_grip", "shear_stress_virial"]
    for name in ("grip", "virial"):
        assert curve[f"shear_stress_{name}"] == pytest.approx(curve[f"torque_{name}"] * 2 / (np.pi * 0.02**3), rel=1e-8)
    assert np.allclose(curve["angle"], [0.0, 0.0002, 0.0004])
    assert np.allclose(curve["shear_strain"], curve["angle"] * 0.02 / 0.04)
    assert curve["torque_virial"][1:] == pytest.approx(curve["torque_grip"][1:], rel=1e-4) and curve["torque_grip"][2] > 15.0
    back = twist(tmp_path, 2, **{**SMALL, "angle": -0.0004})
    assert back["angle"][-1] == pytest.approx(-0.0004)
    assert back["torque_grip"][1:] == pytest.approx(-curve["torque_grip"][1:], rel=5e-3)


def test_bodies_that_are_refused(tmp_path):
    """A square, a bore beside the axis, a radius that is another one."""
    (tmp_path / "bore.region").write_text("region whole cylinder x 0 0 0.012 0 0.04\nregion bore cylinder x 0.003 0 0.005 0 0.04 side out\n"
                                          "region body intersect 2 whole bore\n", encoding="utf-8")
    for body, choices in (("square.data", {"n": 200, "shape": "block", "length": 0.03, "width": 0.012, "height": 0.012}),
                          ("bore.data", {"n": 300, "shape": "region", "region": "bore.region", "length": 0.04, "width": 0.024, "height": 0.024})):
        run_lammps("in.specimen", 1, {**choices, "out": body}, tmp_path).ok()
        refused(run_lammps("in.torsion", 1, {"specimen": body, **SMALL}, tmp_path), "in.torsion: the body is no round bar or tube of this outer radius about the x axis")
    (tmp_path / "thin.data").write_bytes(REFERENCE.read_bytes())
    text = (REFERENCE.parent / f"{REFERENCE.name}.body").read_text(encoding="utf-8")
    (tmp_path / "thin.data.body").write_text(text + "variable radius delete\nvariable radius equal 0.0185\n", encoding="utf-8")
    refused(run_lammps("in.torsion", 1, {"specimen": "thin.data", **SMALL}, tmp_path), "in.torsion: the radius of the body is given as 0.0185 m, but its outermost sphere reaches to 0.0")


def test_grips_without_spheres_are_refused(tmp_path):
    """Of a body of spheres thicker than a tenth of its length."""
    run_lammps("in.specimen", 1, {"n": 300, "shape": "block", "length": 0.01, "width": 0.02, "height": 0.02, "out": "flat.data"}, tmp_path).ok()
    for deck, group in (("torsion", "left"), ("traction", "left"), ("cyclic", "left"), ("quasistatic", "left"), ("indent", "base"), ("upset", "bottom")):
        refused(run_lammps(f"in.{deck}", 1, {"specimen": "flat.data", "material": DECKS.parent / "potentials/metals.evp:copper_OFHC"}, tmp_path),
                f"in.{deck}: the number of atoms of group {group} must be a number >= 3, got 0: give the body more spheres, or another size")


def test_increments_after_fire_are_whole(tmp_path):
    """fire takes a smaller timestep, slow motion afterwards not: elastic torque grows with the angle."""
    deck = edited_deck("in.torsion", tmp_path, 'if "$(fmax) > ${force}" then', 'if "$(fmax) >= 0" then')
    run_lammps(deck, 1, {"specimen": REFERENCE, "contact": "none", "plasticity": "isotropic", "angle": 0.0004, "increment": 0.0001, "out": "twisted"}, tmp_path).ok()
    curve = read_csv(tmp_path / "twisted.csv")
    assert curve["torque_grip"][1:] / curve["angle"][1:] == pytest.approx(curve["torque_grip"][1] / curve["angle"][1], rel=0.01)


def test_there_and_back(tmp_path):
    """Cycles go on between their ends. The reversible law comes back to no torque. With plasticity the body unloads with the first stiffness, so that an angle is left where the torque is
    gone; the core, where no pair has flowed, still resists: the way back is not quite a line."""
    curve = twist(tmp_path, angle=0.002, lower=-0.001, increment=0.001, cycles=2)
    assert curve["angle"] * 1e3 == pytest.approx([0, 1, 2, 1, 0, -1, 0, 1, 2, 1, 0, -1])
    curve = twist(tmp_path, plasticity="none", cycles=1, increment=0.002)
    assert len(curve["angle"]) == 41 and np.argmax(curve["angle"]) == 20 and curve["angle"][-1] == 0.0
    assert abs(curve["torque_grip"][-1]) < 1e-3 * curve["torque_grip"].max()
    assert np.allclose(curve["torque_grip"][20:], curve["torque_grip"][20::-1], atol=5e-3 * curve["torque_grip"].max())
    curve = twist(tmp_path, plasticity="isotropic", cycles=1, increment=0.002)
    angle, torque = curve["angle"], curve["torque_grip"]
    assert (torque[20] - torque[22]) / (angle[20] - angle[22]) == pytest.approx(torque[1] / angle[1], rel=0.1)
    left = np.interp(0.0, torque[:19:-1], angle[:19:-1])
    assert left == pytest.approx(angle[20] - torque[20] / (torque[1] / angle[1]), rel=0.1) and 0.003 < left < 0.012


def test_frames_have_words_and_rigid_grips(tmp_path):
    twist(tmp_path, angle=0.2, increment=0.02, plasticity="isotropic", also=DECKS / "frames.lmp", frames=4)
    frames = read_dump(tmp_path / "twisted_frames.dump")
    assert len(frames) == 5 and {"bonds", "share_second", "share_lost", "new_pairs", "plastic_work", "volume_strain"} <= set(frames[0].columns)
    start, end = (frame.x for frame in (frames[0], frames[-1]))
    for grip, angle in ((start[:, 0] < 0.005, -0.1), (start[:, 0] > 0.045, 0.1)):
        y, z = start[grip, 1], start[grip, 2]
        turned = np.stack([start[grip, 0], y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)], axis=1)
        assert np.allclose(end[grip], turned, atol=1e-9) and len(y) > 20
    assert [np.unique(frame["angle"]).tolist() for frame in frames] == [[0.0], [0.06], [0.12], [0.18], [0.2]]
    assert frames[-1]["share_second"].max() > 0.5 and frames[0]["share_second"].max() == 0.0
    state = read_dump(tmp_path / "twisted_state.dump")[-1]
    assert list(state.columns) == [name for name in frames[-1].columns if name not in ("angle", "type", "vx")]


def test_a_tube(tmp_path):
    """The stress and with it G of a tube by the polar moment of its ring, whose outer radius is that of the spheres: G is that of a solid bar, but for the walls of the packing."""
    (tmp_path / "tube.region").write_text("region outer cylinder x 0 0 0.01 0 0.05\nregion bore cylinder x 0 0 0.005 INF INF side out\nregion body intersect 2 outer bore\n")
    run_lammps("in.specimen", 1, {"n": 1000, "shape": "region", "region": "tube.region", "out": "tube.data"}, tmp_path).ok()
    run_lammps("in.specimen", 1, {"n": 1000, "radius": 0.01, "out": "bar.data"}, tmp_path).ok()
    moduli = {}
    for body in ("bar", "tube"):
        curve = twist(tmp_path, specimen=f"{body}.data", angle=0.0008, increment=0.0004)
        moduli[body] = curve["shear_stress_virial"][-1] / curve["shear_strain"][-1]
        stress = curve["torque_virial"][-1] * 0.01 / (np.pi / 2 * (0.01**4 - (0.005**4 if body == "tube" else 0.0)))
        assert curve["shear_stress_virial"][-1] == pytest.approx(stress, rel=2e-3)
    assert moduli["tube"] == pytest.approx(moduli["bar"], rel=0.1)
