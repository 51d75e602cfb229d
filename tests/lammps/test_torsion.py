# SPDX-License-Identifier: GPL-2.0-only
"""in.torsion: the torque in itself, over its way, on other ranks; the grips; what it refuses. Its stiffness: test_closed_form_loads.py."""

import re

import numpy as np
import pytest
from common_bodies import REFERENCE
from lammps_run import read_csv, read_dump, run_lammps
from small_bodies import lattice_body, write_body

SMALL = {"angle": 0.0004, "increment": 0.0002, "tolerance": 1e-6}  # a strain of 2e-4 at the surface: elastic


def twist(folder, ranks=1, **choices):
    """The curve of a run on the reference specimen."""
    choices = {"specimen": REFERENCE, "contact": "none", "out": "twisted", **choices}
    run_lammps("in.torsion", ranks, choices, folder).ok()
    return read_csv(folder / f"{choices['out']}.csv")


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return twist(tmp_path_factory.mktemp("small"), **SMALL)


@pytest.fixture(scope="module")
def there_and_back(tmp_path_factory):
    """Curves of one cycle to 0.04 rad, by plasticity."""
    folder = tmp_path_factory.mktemp("cycle")
    return {plasticity: twist(folder, plasticity=plasticity, cycles=1, increment=0.002) for plasticity in ("none", "isotropic")}


def test_rows(small):
    assert list(small) == ["angle", "shear_strain", "torque_grip", "torque_virial", "shear_stress_grip", "shear_stress_virial"]
    for name in ("grip", "virial"):
        assert small[f"shear_stress_{name}"] == pytest.approx(small[f"torque_{name}"] * 2 / (np.pi * 0.02**3), rel=1e-8)
    assert np.allclose(small["angle"], [0.0, 0.0002, 0.0004])
    assert np.allclose(small["shear_strain"], small["angle"] * 0.02 / 0.04)


def test_torque_of_the_grips_is_that_through_the_middle(small):
    assert small["torque_virial"][1:] == pytest.approx(small["torque_grip"][1:], rel=1e-4)
    assert small["torque_grip"][2] > 15.0, "control"


def test_other_ranks_and_the_other_way(small, tmp_path):
    """Two ranks find the same rest, and minus the angle has minus the torque."""
    assert twist(tmp_path, 2, **SMALL)["torque_grip"][1:] == pytest.approx(small["torque_grip"][1:], rel=1e-5)
    back = twist(tmp_path, **{**SMALL, "angle": -0.0004})
    assert back["angle"][-1] == pytest.approx(-0.0004)
    assert back["torque_grip"][1:] == pytest.approx(-small["torque_grip"][1:], rel=5e-3)


def test_volume_energy_leaves_torsion_alone(small, tmp_path):
    """A twist changes no volume: kv adds a hundredth to the torque, and a tenth to E (test_plastic_specimen.py has nu)."""
    stiff = twist(tmp_path, kv=1000, **SMALL)["torque_grip"][-1] / small["torque_grip"][-1]
    modulus = []
    for kv in (0, 1000):
        pull = {"specimen": REFERENCE, "contact": "none", "strain": 2e-4, "increment": 2e-4, "tolerance": 1e-5, "restart": 0, "kv": kv}
        run_lammps("in.quasistatic", 1, {**pull, "out": "pulled"}, tmp_path).ok()
        modulus.append(read_csv(tmp_path / "pulled.csv")["stress_grip"][-1])
    assert 1.0 < stiff < 1.01 and modulus[1] > 1.1 * modulus[0]


def test_reversible_law_comes_back_to_no_torque(there_and_back):
    curve = there_and_back["none"]
    assert len(curve["angle"]) == 41 and np.argmax(curve["angle"]) == 20 and curve["angle"][-1] == 0.0
    assert abs(curve["torque_grip"][-1]) < 1e-3 * curve["torque_grip"].max()
    assert np.allclose(curve["torque_grip"][20:], curve["torque_grip"][20::-1], atol=5e-3 * curve["torque_grip"].max())


def test_plasticity_leaves_an_angle(there_and_back):
    """It unloads with the first stiffness, so that an angle is left where the torque is gone. The core, where no pair has
    flowed, still resists: the way back is not quite a line."""
    curve = there_and_back["isotropic"]
    angle, torque = curve["angle"], curve["torque_grip"]
    assert (torque[20] - torque[22]) / (angle[20] - angle[22]) == pytest.approx(torque[1] / angle[1], rel=0.1)
    left = np.interp(0.0, torque[:19:-1], angle[:19:-1])
    assert left == pytest.approx(angle[20] - torque[20] / (torque[1] / angle[1]), rel=0.1) and 0.003 < left < 0.012


def test_cycles_go_on_between_their_ends(tmp_path):
    curve = twist(tmp_path, angle=0.002, lower=-0.001, increment=0.001, cycles=2)
    assert curve["angle"] * 1e3 == pytest.approx([0, 1, 2, 1, 0, -1, 0, 1, 2, 1, 0, -1])


def test_frames_have_words_and_rigid_grips(tmp_path):
    twist(tmp_path, angle=0.2, increment=0.02, plasticity="isotropic", frames=4)
    frames = read_dump(tmp_path / "twisted_frames.dump")
    assert len(frames) == 5 and {"bonds", "share_second", "share_lost", "new_pairs", "plastic_work", "volume_strain"} <= set(frames[0].columns)
    start, end = (frame.vectors("x", "y", "z") for frame in (frames[0], frames[-1]))
    for grip, angle in ((start[:, 0] < 0.005, -0.1), (start[:, 0] > 0.045, 0.1)):
        y, z = start[grip, 1], start[grip, 2]
        turned = np.stack([start[grip, 0], y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)], axis=1)
        assert np.allclose(end[grip], turned, atol=1e-9) and len(y) > 20
    assert [np.unique(frame["angle"]).tolist() for frame in frames] == [[0.0], [0.06], [0.1], [0.16], [0.2]]
    assert frames[-1]["share_second"].max() > 0.5 and frames[0]["share_second"].max() == 0.0
    state = read_dump(tmp_path / "twisted_state.dump")[-1]
    assert list(state.columns) == [name for name in frames[-1].columns if name != "angle"]
    assert all(np.array_equal(state[name], frames[-1][name]) for name in ("x", "share_second", "plastic_work"))


def test_bar_that_is_not_unloaded_is_told_and_the_remedy_unloads_it(tmp_path):
    choices = {"specimen": REFERENCE, "plasticity": "isotropic", "cycles": 1, "increment": 0.005, "out": "twisted"}
    told = r"^the body ends at a torque of (\S+) N m, not unloaded: -var lower (\S+) ends at zero torque$"
    said = re.search(told, run_lammps("in.torsion", 1, choices, tmp_path).ok().stdout, re.M)
    assert float(said[1]) == pytest.approx(read_csv(tmp_path / "twisted.csv")["torque_grip"][-1], rel=1e-3)
    found = run_lammps("in.torsion", 1, {**choices, "lower": said[2]}, tmp_path).ok()
    torque = read_csv(tmp_path / "twisted.csv")["torque_grip"]
    assert "not unloaded" not in found.stdout and abs(torque[-1]) < 0.02 * torque.max()


@pytest.mark.parametrize("choices, message", [
    ({"angle": 0}, "angle must not be 0"),
    ({"cycles": 1.5}, "cycles must be 0 or a positive integer, got 1.5"),
    ({"cycles": 1, "lower": 0.04}, "lower must differ from angle, got 0.04 for both"),
    ({"increment": 0}, "increment and tolerance must be positive, got 0 and "),
    ({"frames": -1}, "frames must be 0 or a positive integer, got -1"),
    ({"kv": -1}, "kv must be 0 or positive, got -1"),
    ({"scale": "maybe"}, "scale must be yes or no, got maybe"),
    ({"material": "a:b", "coeff": "1 2 3"}, "material and coeff are both given"),
    ({"specimen": "block.data"}, "block.data is not a cylinder"),
    ({"evaluations": 2.5}, "evaluations must be a positive integer, got 2.5"),
    ({"cycles": 1, "lower": "release"}, "lower must be a number: release is for in.cyclic and in.quasistatic"),
    ({"evaluations": 3, "increment": 0.02}, "increment 1 did not converge"),
])
def test_one_message_for_each_wrong_choice(tmp_path, choices, message):
    bar = lattice_body((12, 5, 5))
    write_body(tmp_path / "block.data", bar)
    x, r = bar.x, bar.radius.max()
    (tmp_path / "block.data.body").write_text(
        f"variable length index {np.ptp(x[:, 0]) + 2 * r}\nvariable area index {(np.ptp(x[:, 1]) + 2 * r) * (np.ptp(x[:, 2]) + 2 * r)}\n",
        encoding="utf-8")
    run = run_lammps("in.torsion", 1, {"specimen": REFERENCE, **choices}, tmp_path)
    lines = [line for line in run.stdout.splitlines() if line.startswith("ERROR")]
    assert run.returncode == 1 and len(lines) == 1 and message in lines[0], run.stdout[-600:]
