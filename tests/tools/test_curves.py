# SPDX-License-Identifier: GPL-2.0-only
"""tools/curves.py: numbers of curves that are known in closed form, and its refusals."""

import pathlib
import subprocess
import sys

import numpy as np
import pytest
from evp import curves

COMMAND = pathlib.Path(__file__).resolve().parents[2] / "tools" / "curves.py"

# A bilinear curve: slope E to the strain BEND, slope H beyond. The line offset by 0.2 % meets it
# where E BEND + H (s - BEND) = E (s - 0.002).
E, H, BEND = 21e9, 2.1e9, 0.005
YIELD_STRAIN = (0.002 * E + (E - H) * BEND) / (E - H)
YIELD = E * (YIELD_STRAIN - 0.002)
FITTED = 1e-9  # of straight lines through exact points


def bilinear(step=1e-4, end=0.02):
    strain = np.arange(0.0, end + 0.5 * step, step)
    stress = np.where(strain <= BEND, E * strain, E * BEND + H * (strain - BEND))
    return curves.Curve(strain, 1.01 * stress, stress)


def write(path, curve):
    lines = [",".join(curves.HEADER)]
    lines += [",".join(f"{v:.17g}" for v in row) for row in zip(*curve)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_numbers_of_a_bilinear_curve():
    found = curves.numbers(bilinear())
    assert found["E_GPa"] == pytest.approx(1e-9 * E, rel=FITTED)
    assert found["yield_MPa"] == pytest.approx(1e-6 * YIELD, rel=FITTED)
    at_1pc, at_2pc = (1e-6 * (E * BEND + H * (s - BEND)) for s in (0.01, 0.0195))
    assert found["stress_1pc_MPa"] == pytest.approx(at_1pc, rel=FITTED)
    assert found["stress_2pc_MPa"] == pytest.approx(at_2pc, rel=FITTED)
    # The window of +-0.0004 feels the bend from 0.0046 on.
    assert BEND - curves.TANGENT_WINDOW < found["departure_strain"] < BEND


def test_the_jump_at_the_start_of_a_damped_run_is_no_part_of_the_modulus():
    strain, grip, stress = bilinear()
    damped = curves.Curve(strain, grip, np.where(strain > 0.0, stress + 30e6, 0.0))
    assert curves.numbers(damped)["E_GPa"] == pytest.approx(1e-9 * E, rel=FITTED)


def test_grip_stress_is_the_other_column():
    grip, virial = (curves.numbers(bilinear(), column) for column in ("grip", "virial"))
    assert grip["E_GPa"] == pytest.approx(1.01 * virial["E_GPa"], rel=FITTED)


def test_tangent_on_both_sides_of_the_bend():
    strain, _, stress = bilinear()
    assert curves.tangent(strain, stress, 0.002) == pytest.approx(E, rel=FITTED)
    assert curves.tangent(strain, stress, 0.012) == pytest.approx(H, rel=FITTED)


def test_vibration_is_averaged_out():
    """0.3 MPa rms, the noise at gamma = 0, moves E by 0.1 % and the stresses by 0.1 MPa."""
    noise = 0.3e6 * np.random.default_rng(2).standard_normal(201)
    strain, grip, virial = bilinear()
    quiet = curves.numbers(bilinear())
    found = curves.numbers(curves.Curve(strain, grip, virial + noise))
    assert found["E_GPa"] == pytest.approx(quiet["E_GPa"], rel=5e-3)
    assert found["stress_1pc_MPa"] == pytest.approx(quiet["stress_1pc_MPa"], abs=0.3)
    assert found["departure_strain"] == pytest.approx(quiet["departure_strain"], abs=5e-4)


def test_a_straight_curve_has_no_yield_and_no_departure():
    strain = np.linspace(0.0, 0.02, 201)
    found = curves.numbers(curves.Curve(strain, E * strain, E * strain))
    assert np.isnan(found["yield_MPa"]) and np.isnan(found["departure_strain"])


def test_a_short_curve_gives_what_it_can():
    found = curves.numbers(bilinear(end=0.0062))
    assert found["E_GPa"] == pytest.approx(1e-9 * E, rel=FITTED)
    assert np.isnan(found["yield_MPa"]) and np.isnan(found["stress_1pc_MPa"])
    with pytest.raises(curves.CurveError, match="it ends at strain 0.001"):
        curves.numbers(bilinear(end=0.001))


def test_curves_are_read_back_exactly(tmp_path):
    read = curves.read_curve(write(tmp_path / "a.csv", bilinear()))
    assert all(np.array_equal(a, b) for a, b in zip(read, bilinear()))


@pytest.mark.parametrize(
    "text, rule",
    [
        ("", "no column strain"),
        ("strain,stress\n0,0\n1,1\n", "no column stress_grip"),
        ("strain,stress_grip,stress_virial\n0,0,0\n", "1 rows: no curve"),
        ("strain,stress_grip,stress_virial\n0,0,0\n1,1\n", "damaged line"),
        ("strain,stress_grip,stress_virial\n0,0,0\n1,one,1\n", "damaged line"),
        ("strain,stress_grip,stress_virial\n0,0,0\n1,nan,1\n", "unstable"),
    ],
)
def test_bad_files_are_refused_by_name(tmp_path, text, rule):
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(curves.CurveError, match=rule) as caught:
        curves.read_curve(path)
    assert "bad.csv" in str(caught.value)


def command(*words):
    words = [sys.executable, COMMAND, *words]
    return subprocess.run(words, capture_output=True, text=True, check=False)


def test_command_prints_the_numbers_and_draws(tmp_path):
    path = write(tmp_path / "a.csv", bilinear())
    shown = command("numbers", path)
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.splitlines()[1].split()[1] == "21"
    drawn = command("plot", path, "--labels", "10 /s", "--out", tmp_path / "curves.png")
    assert drawn.returncode == 0, drawn.stderr
    assert (tmp_path / "curves.png").read_bytes()[:4] == b"\x89PNG"
    beside = (tmp_path / "curves.csv").read_text().splitlines()
    assert beside[0] == "panel,curve,strain_percent,stress_MPa" and len(beside) == 202
    law = command("law", "--out", tmp_path / "law.png")
    assert law.returncode == 0 and (tmp_path / "law.csv").exists(), law.stderr
    state = tmp_path / "state.csv"
    state.write_text("x,y,z,radius,share\n0,0,0,0.005,0.5\n0.01,0,0,0.005,0\n", encoding="utf-8")
    drawn = command("specimen", state, "--out", tmp_path / "body.png")
    assert drawn.returncode == 0, drawn.stderr
    dump = tmp_path / "state.dump"
    dump.write_text(
        "ITEM: TIMESTEP\n9\nITEM: ATOMS id x y z radius c_pairs[1] c_pairs[2]\n"
        "1 0 0 0 0.005 2 0.5\n2 0.01 0 0 0.005 1 0\n",
        encoding="utf-8",
    )
    same = command("specimen", dump, "--out", tmp_path / "same.png")
    assert same.returncode == 0, same.stderr
    assert (tmp_path / "same.csv").read_text() == (tmp_path / "body.csv").read_text()


def test_command_fails_with_one_line(tmp_path):
    failed = command("numbers", tmp_path / "missing.csv")
    assert failed.returncode == 1 and failed.stderr.startswith("ERROR: ")
    assert "missing.csv" in failed.stderr and len(failed.stderr.splitlines()) == 1
    assert command("--help").returncode == 0
