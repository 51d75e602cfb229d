# SPDX-License-Identifier: GPL-2.0-only
"""in.cyclic, the way back of in.quasistatic, and compression: which rows they write, and that eq. 8 retraces its curve."""

import re

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import curves, cycles
from lammps_run import DECKS, read_csv, read_dump, run_lammps

E = 20.65e9  # of the reference specimen, contact none [Pa]
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"


def run(deck, folder, ranks=1, **choices):
    """A run of the reference specimen, its curve and what it printed."""
    found = run_lammps(deck, ranks, {"specimen": REFERENCE, "contact": "none", "out": "run", **choices}, folder)
    return curves.read_curve(folder / "run.csv"), found.ok()


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """run() of in.cyclic with plasticity isotropic, made once per module for the same choices; found.folder is not to be written in."""
    known = {}

    def cyclic(**choices):
        key = tuple(sorted(choices.items()))
        if key not in known:
            known[key] = run("in.cyclic", tmp_path_factory.mktemp("once"), plasticity="isotropic", **choices)
        return known[key]

    return cyclic


def test_by_default_one_sweep(tmp_path):
    """To 2 % and back: 200 rows each way, none twice, and the states at both ends. It retraces its curve."""
    curve, _ = run("in.cyclic", tmp_path)
    counts = read_csv(tmp_path / "run_bonds.csv")
    assert len(curve.strain) == 1 + 2 * 200 + 2 and len(counts["strain"]) == 1 + 2 * 200
    assert curve.strain.max() == pytest.approx(0.02, rel=1e-9) and abs(curve.strain[-1]) < 1e-9
    assert np.abs(np.diff(curve.strain)).max() <= 1e-4 * (1 + 1e-6) and np.abs(np.diff(counts["strain"])).max() <= 1e-4 * (1 + 1e-6)
    found = cycles.numbers(curve)
    assert abs(found["residual_strain"]) < 2e-4 and found["turn_MPa"] == pytest.approx(179.0, rel=0.01)
    assert (tmp_path / "run_state.dump").is_file()


def test_first_way_is_in_traction(tmp_path):
    """Up to the first turn the same bits."""
    there, _ = run("in.cyclic", tmp_path, strain=0.006)
    pulled, _ = run("in.traction", tmp_path, strain=0.006)
    assert np.array_equal(there.strain[:61], pulled.strain) and np.array_equal(there.virial[:61], pulled.virial)


@pytest.mark.parametrize("ranks, choices", [
    (1, {"strain": 0.004, "lower": -0.002, "cycles": 2}), (2, {"strain": -0.004, "lower": 0.002, "cycles": 2, "row": 0.0005}),
    (1, {"strain": 0.004, "lower": 0.0011, "cycles": 2, "row": 0.0007})])
def test_turns(tmp_path, ranks, choices):
    """At strain and lower, by turns, on them also where rows do not divide the way; below the second regime on the one line."""
    curve, _ = run("in.cyclic", tmp_path, ranks, **choices)
    at = curve.strain[[*cycles.turns(curve.strain), -1]]
    assert at == pytest.approx([choices["strain"], choices["lower"]] * 2, abs=1e-9)
    assert np.abs(np.diff(curve.strain)).max() <= choices.get("row", 1e-4) * (1 + 1e-6)
    assert np.abs(curve.virial / E - curve.strain).max() < 1.5e-4


def test_timestep_of_the_user_turns_less_than_a_row_beyond(tmp_path):
    curve, found = run("in.cyclic", tmp_path, coeff=TABLE2, integrator="implicit", timestep=3e-6, strain=0.005, row=0.0007)
    at = curve.strain[[*cycles.turns(curve.strain), -1]]
    assert 0.005 <= at[0] < 0.005 + 0.0007 and -0.0007 < at[1] <= 1e-9
    assert "fix dt/evp" not in found.stdout


@pytest.mark.parametrize("choices", [{"strain": -0.01}, {"rate": -10, "strain": 0.01}, {"rate": -10, "strain": -0.01, "row": 0.0003}])
def test_compression(tmp_path, choices):
    """A negative rate, strain or both; with rows that do not divide the strain too. At rest the same stress."""
    curve, _ = run("in.traction", tmp_path, **choices)
    rest, _ = run("in.quasistatic", tmp_path, strain=-0.01)
    assert curve.strain.min() < -0.0099 and np.all(curve.strain <= 0.0)
    assert np.interp(0.0098, -curve.strain, -curve.virial) == pytest.approx(np.interp(0.0098, -rest.strain, -rest.virial), rel=5e-3)
    at_start = [np.polyfit(c.strain[c.strain > -0.002], c.virial[c.strain > -0.002], 1)[0] for c in (curve, rest)]
    assert at_start[0] == pytest.approx(at_start[1], rel=5e-3)
    assert E < at_start[1] < 1.04 * E, "pairs are stiffer in compression"


def test_at_rest_and_back(tmp_path):
    """Without a rate eq. 8 comes back to no stress, and an interrupted run goes on in the middle of the way."""
    curve, _ = run("in.quasistatic", tmp_path, cycles=1, strain=0.01, restart=5)
    assert len(curve.strain) == 41 and curve.strain.max() == pytest.approx(0.01, abs=1e-12)
    assert abs(cycles.residual_strain(curve.strain, curve.virial)) < 1e-5
    assert abs(curve.virial[-1]) < 0.5e6 < 100e6 < curve.virial[-15]
    for start in (10, 20, 25):
        again, _ = run("in.quasistatic", tmp_path, resume=start, cycles=1, strain=0.01)
        assert np.allclose(again.virial, curve.virial, rtol=1e-8, atol=1.0) and np.allclose(again.strain, curve.strain, atol=1e-12)
    further, _ = run("in.quasistatic", tmp_path, resume=40, cycles=2, strain=0.002, lower=-0.001)
    assert further.strain[[42, 48, 54]] == pytest.approx([-0.001, 0.002, -0.001], abs=1e-12) and len(further.strain) == 55


@pytest.mark.parametrize("deck, choices", [("in.cyclic", {"rate": 50, "row": 0.0005}), ("in.quasistatic", {"cycles": 1, "increment": 0.001})])
def test_body_that_is_not_unloaded_is_told_and_the_remedy_unloads_it(tmp_path, deck, choices):
    """By default a body that has flowed is pushed back; lower as printed ends at no stress, without a word."""
    choices = {"plasticity": "isotropic", "strain": 0.015, **choices}
    pushed, found = run(deck, tmp_path, **choices)
    said = re.search(r"^the body ends at (\S+) MPa, not unloaded: -var lower (\S+) ends at zero stress$", found.stdout, re.M)
    assert said and float(said[1]) == pytest.approx(pushed.virial[-1] / 1e6, rel=0.02) and pushed.virial[-1] < -100e6
    assert float(said[2]) == pytest.approx(cycles.residual_strain(pushed.strain, pushed.virial), abs=1e-4)  # a fifth of a row: it vibrates
    half, found = run(deck, tmp_path, **choices, lower=0.5 * (0.015 + float(said[2])))
    again = re.search(r"^the body ends at (\S+) MPa, not unloaded: -var lower (\S+) ends near zero stress$", found.stdout, re.M)
    assert again and half.virial[-1] > 50e6 and float(again[2]) == pytest.approx(float(said[2]), rel=0.1)
    unloaded, found = run(deck, tmp_path, **choices, lower=said[2])
    assert "not unloaded" not in found.stdout and abs(unloaded.virial[-1]) < 0.02 * unloaded.virial.max()


DAMPED = {"coeff": TABLE2, "integrator": "implicit", "row": 0.0005}


@pytest.mark.parametrize("choices", [{"rate": 50}, DAMPED, {**DAMPED, "strain": -0.015, "extensometer": "yes"}, {**DAMPED, "timestep": 3e-6}])
def test_release_ends_at_zero_stress(once, choices):
    """At the strain where the curve of a body that is pushed back to 0 crosses zero: strain - stress/E, less the flow back."""
    curve, found = once(lower="release", **choices)
    row, most = choices.get("row", 1e-4), np.abs(curve.virial).max()
    end, top = curve.strain[-1], int(cycles.turns(curve.strain)[0])
    said = re.search(r"^released: strain (\S+), stress (\S+) MPa(?:, strain_gauge (\S+))?$", found.stdout, re.M)
    assert float(said[1]) == pytest.approx(end, rel=1e-5) and float(said[2]) == pytest.approx(1e-6 * curve.virial[-1], rel=1e-2, abs=1e-3)
    assert said[3] is None or float(said[3]) == pytest.approx(read_csv(found.folder / "run.csv")["strain_gauge"][-1], rel=1e-5)
    assert (said[3] is None) == ("extensometer" not in choices)
    assert len(cycles.turns(curve.strain)) == 1 and np.abs(np.diff(curve.strain)).max() <= row * (1 + 1e-6)
    whole = 0.5 * row * E if "timestep" in choices else 0.0  # rows of a timestep size of the user's are not divided
    assert abs(curve.virial[-1]) < 0.006 * most + whole, "0.1 MPa or so of 180 where nothing vibrates"
    back, _ = once(lower=0, **choices)
    assert abs(end - cycles.residual_strain(back.strain, back.virial)) < 0.5 * row and back.virial[-1] / back.virial[top] < -0.5, "control"
    first = np.abs(curve.strain[: top + 1]) <= 0.002
    modulus = np.polyfit(curve.strain[: top + 1][first], curve.virial[: top + 1][first], 1)[0]
    left = 1.0 - curve.virial[top] / modulus / curve.strain[top]
    assert left - 0.03 < end / curve.strain[top] < left + 0.01, "of the strain at the turn; a few pairs flow back"


def test_release_of_eq_8_leaves_no_strain(tmp_path):
    curve, found = run("in.cyclic", tmp_path, lower="release", rate=50)
    assert abs(curve.strain[-1]) < 1e-4 and "released: strain" in found.stdout and curve.virial.max() > 150e6


def test_releases_in_cycles_on_any_ranks(tmp_path):
    """Each cycle goes up to the strain and ends at zero stress; the timestep size of a way's last rows does not stay."""
    choices = {**DAMPED, "plasticity": "isotropic", "lower": "release", "cycles": 3, "strain": 0.01}
    curve, found = run("in.cyclic", tmp_path, **choices)
    ends = np.array([*cycles.turns(curve.strain), len(curve.strain) - 1])
    assert len(ends) == 6 and curve.strain[ends[::2]] == pytest.approx([0.01] * 3, abs=1e-9)
    assert np.abs(curve.virial[ends[1::2]]).max() < 0.01 * curve.virial.max() and found.stdout.count("released: strain") == 3
    steps = [int(count) for count in re.findall(r"^half cycle [35] of 6: to a strain of 0.01, (\d+) rows of 10 steps$", found.stdout, re.M)]
    assert len(steps) == 2 and max(steps) <= np.ceil((0.01 - curve.strain[ends[1::2]].min()) / 0.0005) + 1
    two, _ = run("in.cyclic", tmp_path, 2, **choices)
    assert two.strain == pytest.approx(curve.strain, abs=1e-9) and two.virial == pytest.approx(curve.virial, abs=2e-6 * curve.virial.max())


def test_release_of_a_body_that_broke_ends(tmp_path):
    """It carries no stress at the turn: the run ends there, within a few rows."""
    curve, found = run("in.cyclic", tmp_path, plasticity="isotropic", lower="release", rate=100, strain=0.1, row=0.001, **{"break": 0.01})
    assert "released: strain" in found.stdout and curve.strain[-1] > 0.08 and abs(curve.virial[-1]) < 0.1 * curve.virial.max()


@pytest.mark.parametrize("plasticity, left", [("isotropic", None), ("none", 0.0)])
def test_release_at_rest(tmp_path, plasticity, left):
    """in.quasistatic: at zero stress but for a thousandth, where the curve of a body that is pushed back crosses it; the same when resumed."""
    choices = {"plasticity": plasticity, "increment": 0.001, "strain": 0.015, "cycles": 2, "lower": "release", "extensometer": "yes"}
    curve, found = run("in.quasistatic", tmp_path, **choices)
    ends = np.array([*cycles.turns(curve.strain), len(curve.strain) - 1])
    assert len(ends) == 4 and found.stdout.count("released: strain") == 2 and np.abs(curve.virial[ends[1::2]]).max() < 0.0012 * curve.virial.max()
    gauge = read_csv(tmp_path / "run.csv")["strain_gauge"]
    said = [float(word) for word in re.findall(r"^released: .* MPa, strain_gauge (\S+)$", found.stdout, re.M)]
    assert said == pytest.approx(list(gauge[ends[1::2]]), rel=1e-5, abs=1e-8)
    if left is None:
        (tmp_path / "back").mkdir()
        back, _ = run("in.quasistatic", tmp_path / "back", plasticity=plasticity, increment=0.0005, strain=0.015, cycles=1)
        left = cycles.residual_strain(back.strain, back.virial)
        assert left > 0.006 and back.virial[-1] < -100e6, "control"
    assert curve.strain[ends[1::2]] == pytest.approx([left, left], abs=2e-5 if left == 0.0 else 1e-4)
    for start in (20, int(ends[1])):
        again, _ = run("in.quasistatic", tmp_path, resume=start, **choices)
        assert np.allclose(again.strain, curve.strain, atol=1e-9) and np.allclose(again.virial, curve.virial, rtol=1e-8, atol=1.0)


@pytest.mark.parametrize("deck, choices", [
    ("in.cyclic", {"coeff": "80 8 4 3 8 4 0.001 0 1.5", "row": 0.002, "rate": 50}),
    ("in.cyclic", {"coeff": "80 8 4 3 8 4 0.005 30000 1.5", "rate": 50, "integrator": "implicit"}),
    ("in.quasistatic", {"coeff": "80 8 4 3 8 4 0.001 0 1.5", "increment": 0.005, "cycles": 1})], ids=["coarse rows", "strong damping", "coarse increments"])
def test_release_that_misses_zero_stress_is_told(tmp_path, deck, choices):
    """Not called released: the elastic strain is shorter than a row, or the viscous stress turns with the grips."""
    curve, found = run(deck, tmp_path, plasticity="isotropic", lower="release", strain=0.02, **choices)
    ends = re.search(r"WARNING: the release to zero stress ends at (\S+) MPa, at a strain of (\S+): give a smaller -var (row|increment)", found.stdout)
    assert float(ends[1]) == pytest.approx(1e-6 * curve.grip[-1], rel=0.1) and float(ends[2]) == pytest.approx(curve.strain[-1], rel=1e-4)
    assert abs(curve.grip[-1]) > 0.05 * curve.grip.max()
    assert "released:" not in found.stdout and "not unloaded" not in found.stdout


def test_frames_of_a_release_end_with_the_last_state(tmp_path):
    """As many as asked for, and the unloaded body as the last one; once only where a snapshot is due in the last step anyway."""
    choices = {"plasticity": "isotropic", "lower": "release", "rate": 50, "also": DECKS / "frames.lmp", "frames": 4}
    curve, _ = run("in.cyclic", tmp_path, **choices)
    frames, state = read_dump(tmp_path / "run_frames.dump"), read_dump(tmp_path / "run_state.dump")[-1]
    assert len(frames) == 5 and frames[-1].step == state.step and frames[-1]["strain"][0] == pytest.approx(curve.strain[-1], rel=1e-8)
    assert all(np.array_equal(frames[-1][name], state[name]) for name in state.columns)
    assert all(list(frame.columns) == list(frames[0].columns) for frame in frames) and {*state.columns, "type", "strain"} == set(frames[0].columns)
    ends = re.findall(r"^ITEM: TIME\n(\S+)$", (tmp_path / "run_frames.dump").read_text(encoding="utf-8"), re.M)
    assert len(ends) == 5
    run("in.cyclic", tmp_path, **choices, duration=ends[-1])
    assert [frame.step for frame in read_dump(tmp_path / "run_frames.dump")][-2:] == [pytest.approx(0.75 * state.step, rel=0.01), state.step]
    run("in.quasistatic", tmp_path, **{"plasticity": "isotropic", "lower": "release", "cycles": 1, "frames": 4, "increment": 0.001, "restart": 0})
    rest = read_dump(tmp_path / "run_frames.dump")
    assert len(rest) == 5 and rest[-1]["strain"][0] == pytest.approx(frames[-1]["strain"][0], abs=2e-4)


def test_frames_at_rest(tmp_path):
    """At equal parts of the way, there and back; a resumed run writes those that are left."""
    choices = {"increment": 0.001, "strain": 0.004, "cycles": 1, "lower": -0.004, "frames": 3, "restart": 1, "plasticity": "isotropic"}
    run("in.quasistatic", tmp_path, **choices)
    frames = read_dump(tmp_path / "run_frames.dump")
    assert [frame["strain"][0] for frame in frames] == pytest.approx([0.0, 0.004, 0.0, -0.004], abs=1e-9)
    assert {"bonds", "share_second", "share_lost", "new_pairs", "plastic_work"} <= set(frames[-1].columns)
    state = read_dump(tmp_path / "run_state.dump")[-1]
    assert np.array_equal(frames[-1]["x"], state["x"]) and np.ptp(state["x"]) > 0.04
    run("in.quasistatic", tmp_path, **choices, resume=4)
    assert [frame["strain"][0] for frame in read_dump(tmp_path / "run_frames_4.dump")] == pytest.approx([0.0, -0.004], abs=1e-9)


@pytest.mark.parametrize("choices, message", [
    ({"lower": "release", "row": 0.003}, "row = 0.003 is more than a tenth of strain, too much to find zero stress: give -var row 0.002 or less"),
    ({"rate": -10}, "rate and row must be positive, got -10 and 0.0001; for compression give a negative strain"),
    ({"strain": 0}, "strain must not be 0"),
    ({"lower": 0.02}, "lower must differ from strain, got 0.02 for both"),
    ({"cycles": 0}, "cycles must be a positive integer, got 0"),
    ({"samples": 0.5}, "samples must be a positive integer, got 0.5"),
    ({"cycles": 1.5}, "cycles must be a positive integer, got 1.5"),
    ({"plasticity": "plastic"}, "Pair style evp/lj: plasticity must be none"),
    ({"kv": -1}, "kv must be 0 or positive, got -1"),
    ({"row": 0.01, "lower": 0.015}, "row = 0.01 is more than strain - lower = 0.005: give -var row 0.005 or less")])
def test_bad_choices_are_named(tmp_path, choices, message):
    found = run_lammps("in.cyclic", 1, {"specimen": REFERENCE, "out": "run", **choices}, tmp_path)
    assert found.returncode != 0 and re.search(rf"^ERROR: {re.escape(message)}( \(|$)", found.stdout, re.M), found.stdout[-1000:]
    assert not (tmp_path / "run.csv").exists()


def test_clock_that_stops_a_run_is_told(tmp_path):
    (tmp_path / "clock.lmp").write_text("timer timeout 0:00:01\n")
    _, found = run("in.cyclic", tmp_path, rate=0.1, row=1e-6, samples=1, also="clock.lmp")
    assert "WARNING: the run ended at a strain of" in found.stdout and "half cycle 2 of 2" not in found.stdout


def test_release_that_is_stopped_in_its_last_rows_is_told_as_such(once, tmp_path):
    _, whole = once(lower="release", rate=50)
    last = read_dump(whole.folder / "run_state.dump")[-1].step
    (tmp_path / "early.lmp").write_text(f"variable early equal step>={last - 3}\nfix early all halt 1 v_early > 0 error continue\n", encoding="utf-8")
    _, found = run("in.cyclic", tmp_path, plasticity="isotropic", lower="release", rate=50, also="early.lmp")
    assert read_dump(tmp_path / "run_state.dump")[-1].step == last - 3
    assert len(re.findall("^WARNING: the run ended at a strain of", found.stdout, re.M)) == 1 and "released: strain" not in found.stdout


@pytest.mark.parametrize("deck", ["in.cyclic", "in.traction", "in.quasistatic"])
@pytest.mark.parametrize("choices", [{}, {"plasticity": "isotropic"}, {"break": 0.05}, {"kv": 300}])
def test_columns_of_the_state(tmp_path, deck, choices):
    """Named where flow, breaking or a volume energy is on; else the four columns as they were."""
    run(deck, tmp_path, strain=0.008, **({} if deck == "in.quasistatic" else {"row": 0.004, "rate": 50}), **choices)
    state = read_dump(tmp_path / "run_state.dump")[-1]
    first = ["id", "x", "y", "z", "radius"]
    names = ["bonds", "share_second", "share_lost", "new_pairs", "plastic_work", "plastic_strain", "volume_strain", "plastic_strain_sum"]
    assert list(state.columns) == first + (names if choices else [f"c_pairs[{k}]" for k in range(1, 5)])
    if choices:
        assert np.abs(state["volume_strain"]).max() > 0.0 and state["bonds"].sum() == 2 * 2975
        assert ("plasticity" in choices) == (state["plastic_work"].max() > 0.0) == (state["plastic_strain"].max() > 0.0)
