# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/rates.py and `curves.py rate`: curves with known shares, closed form 8, refusals."""

import itertools
import re

import curves as tool
import numpy as np
import pytest
from evp import curves, law, rates, specimen
from oracle import brute
from in_process import call

E, VISCOUS, INERTIAL, VIBRATION = 20e9, 3e6, 0.7e6, 0.2e6
EXACT = 1e-9  # straight lines through exact points


def pulled(jump=0.0, imbalance=0.0, end=0.0103):
    """A straight curve that starts with a jump; the grips' imbalance changes sign at each row."""
    strain = np.arange(0.0, end + 5e-5, 1e-4)
    virial = np.where(strain > 0.0, E * strain + jump, 0.0)
    return curves.Curve(strain, virial + imbalance * (-1.0) ** np.arange(len(strain)), virial)


def write(path, curve):
    lines = [",".join(curves.HEADER)] + [",".join(f"{v:.17g}" for v in row) for row in zip(*curve)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("at", [0.002, 0.005, 0.01])
def test_shares_of_known_curves(at):
    found = rates.shares_at(pulled(VISCOUS, INERTIAL), pulled(0.0, VIBRATION), at)
    stress = E * at + VISCOUS
    wanted = rates.Shares(at, stress, VISCOUS, INERTIAL, VIBRATION)
    assert found == pytest.approx(wanted, rel=EXACT)
    assert found.percent(found.viscous) == pytest.approx(100.0 * VISCOUS / stress, rel=EXACT)


def test_the_imbalance_is_that_of_the_rows_about_the_strain():
    strain, grip, virial = pulled()
    grip = np.where(strain > 0.006, grip + INERTIAL, grip)
    moving = curves.Curve(strain, grip, virial)
    assert rates.imbalance(moving, 0.005) == 0.0
    assert rates.imbalance(moving, 0.01) == pytest.approx(INERTIAL, rel=EXACT)


def test_strains_reported_are_those_that_the_curve_reaches():
    assert rates.reached(pulled()) == [0.002, 0.005, 0.01]
    assert rates.reached(pulled(end=0.0200)) == [0.002, 0.005, 0.01, 0.0195]
    assert rates.reached(pulled(end=0.001)) == []


def test_jump_at_the_start():
    jump, scatter = rates.starting_jump(pulled(VISCOUS))
    assert jump == pytest.approx(VISCOUS, rel=1e-6) and scatter < 1.0
    strain, grip, virial = pulled()
    bent = curves.Curve(strain, grip, virial - 7.5 * E * strain**2)  # as the law's first regime is
    assert abs(rates.starting_jump(bent)[0]) < 1.0


def test_a_damped_twin_is_refused():
    for twin in (pulled(VISCOUS), pulled(0.5 * VISCOUS)):
        with pytest.raises(curves.CurveError, match="run with gamma = 0"):
            rates.check_twin(pulled(VISCOUS), twin)
    with pytest.raises(curves.CurveError, match="run with gamma = 0"):
        rates.check_twin(pulled(), pulled(VISCOUS))  # exchanged
    with pytest.raises(curves.CurveError, match="twin: 2 rows"):
        rates.check_twin(pulled(VISCOUS), pulled(end=0.0002))


def test_a_vibrating_twin_is_no_damped_one():
    """Vibration leaves a small jump in the fit: beside a weak damper it is no sign of another."""
    strain, grip, virial = pulled()
    noise = VIBRATION * np.random.default_rng(5).standard_normal(len(strain))
    twins = [curves.Curve(strain, grip, virial + sign * noise) for sign in (1.0, -1.0)]
    assert max(rates.starting_jump(twin)[0] for twin in twins) > 0.1 * VIBRATION, "control"
    for twin, jump in itertools.product(twins, (0.0, 0.01 * VIBRATION, VISCOUS)):
        rates.check_twin(pulled(jump), twin)


def test_no_shares_where_a_run_has_no_rows_or_no_tension():
    with pytest.raises(curves.CurveError, match="twin: .* ends at strain 0.005"):
        rates.shares_at(pulled(VISCOUS), pulled(end=0.005), 0.01)
    with pytest.raises(curves.CurveError, match="damped run: .* ends at strain 0.005"):
        rates.shares_at(pulled(VISCOUS, end=0.005), pulled(), 0.01)
    with pytest.raises(curves.CurveError, match="no tension"):
        rates.shares_at(pulled(-1e9), pulled(), 0.01)


def test_relaxation_time_takes_the_mean_of_squares():
    row = law.TABLE2._replace(gamma=64.0)
    assert rates.relaxation_time(np.array([1.0, 3.0]), row) == pytest.approx(64.0 * 5.0 / 2560.0)


def test_relaxation_time_is_what_the_forces_give():
    """Bodies of two spheres, each length in each direction: the virial of a strain rate D over that
    of a small strain D s is tau/s, for any D. Forces are those of eqs. 4 and 8, summed over pairs."""
    directions = np.random.default_rng(3).standard_normal((12, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    lengths = np.array([0.0056, 0.0063, 0.0080])
    x, bonds = [], {}
    for k, (u, length) in enumerate(itertools.product(directions, lengths)):
        x += [[0.1 * k, 0.0, 0.0], [0.1 * k + length * u[0], length * u[1], length * u[2]]]
        bonds[2 * k + 1, 2 * k + 2] = length
    x, radius = np.array(x), np.full(len(x), 0.0028)
    rate = np.array([[1.0, 0.3, 0.0], [0.3, -0.4, 0.2], [0.0, 0.2, 0.1]])
    small = 1e-5

    def virial(step, speed):
        turned = x.copy()
        turned[1::2] += step * (x[1::2] - x[::2]) @ rate  # about each body's first sphere
        v = speed * x @ rate
        return brute.brute_force(turned, v, radius, None, law.TABLE2, bonds, "none")["virial"]

    tau = rates.relaxation_time(lengths, law.TABLE2)
    elastic = (virial(small, 0.0) - virial(-small, 0.0)) / (2.0 * small)
    assert np.abs(elastic).min() > 0.0, "control"
    assert virial(0.0, 1.0) == pytest.approx(tau * elastic, rel=1e-6)


def test_a_finer_specimen_of_the_same_material_has_the_same_time():
    """Eight times the spheres in the same volume, or as many in an eighth of it."""
    row, lengths = law.TABLE2, np.array([0.0056, 0.0063, 0.0084])
    for fine in (rates.scaled_row(row, 4000), rates.scaled_row(row, 500, rates.REFERENCE_VOLUME / 8)):
        assert (fine.e1, fine.e2, fine.gamma) == pytest.approx((10.0, 0.375, 500.0))
        assert fine._replace(e1=80.0, e2=3.0, gamma=1000.0) == row, "nothing else changes"
        assert rates.relaxation_time(0.5 * lengths, fine) == pytest.approx(rates.relaxation_time(lengths, row))


def row_of_spheres():
    """Five spheres of radius 3 mm and 1 g, 7 mm apart: four bonds within alpha = 1.5, none of 14 mm."""
    x = np.stack([0.007 * np.arange(5), np.zeros(5), np.zeros(5)], axis=1)
    ids = np.arange(1, 6)
    return specimen.Specimen(ids, ids * 0 + 1, np.full(5, 0.003), np.full(5, 1e-3), x, np.zeros((3, 2)))


def test_expected_of_a_row_of_spheres():
    found = rates.expected(row_of_spheres(), law.TABLE2, 10.0, E, length=0.04, volume=1e-5)
    tau = 1000.0 * 0.007**2 / 2560.0
    density = 5e-3 / 1e-5
    speed = np.sqrt(E / density)
    wanted = rates.Expected(tau, E * tau * 10.0, density * speed * 0.04 * 10.0)
    assert found == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    "change, rule",
    [
        ({"rate": 0.0}, "must be positive, got 0"),
        ({"rate": float("nan")}, "must be positive, got nan"),
        ({"row": law.TABLE1}, "gamma > 0"),
        ({"row": law.TABLE2._replace(alpha=1.01)}, "no pairs within alpha = 1.01"),
    ],
)
def test_nothing_is_expected_of_bad_input(change, rule):
    arguments = {"specimen": row_of_spheres(), "row": law.TABLE2, "rate": 10.0, "modulus": E, **change}
    with pytest.raises(ValueError, match=rule):
        rates.expected(**arguments)


def command(*words):
    return call(tool.main, "rate", *words)


@pytest.fixture
def files(tmp_path):
    """A damped run, its twin and a data file, by name."""
    body = row_of_spheres()
    atoms = [f"{i} 1 0.006 2700 {x:.17g} 0 0" for i, (x, _, _) in zip(body.ids, body.x)]
    data = tmp_path / "specimen.data"
    header = ["spheres", "", "5 atoms", "1 atom types", "", "Atoms # sphere", ""]
    data.write_text("\n".join(header + atoms) + "\n", encoding="utf-8")
    (tmp_path / "specimen.data.body").write_text("variable length equal 0.05 # [m]\nvariable volume equal 6.283185307179586e-05\n", encoding="utf-8")
    damped = write(tmp_path / "damped.csv", pulled(VISCOUS, INERTIAL))
    return {"damped": damped, "twin": write(tmp_path / "twin.csv", pulled()), "data": data}


def test_command_prints_the_shares(files):
    shown = command(files["damped"], "--twin", files["twin"])
    assert shown.returncode == 0, shown.stderr
    wanted = [f"viscous {300 / s:.2f} %, inertial {70 / s:.2f} %" for s in (43.0, 103.0, 203.0)]
    lines = shown.stdout.splitlines()
    assert len(lines) == 4 and all(want in line for want, line in zip(wanted, lines)), shown.stdout
    assert "beyond the elastic part" in lines[3]
    chosen = command(files["damped"], "--twin", files["twin"], "--strains", "0.004")
    assert chosen.stdout.startswith("strain 0.40 %: stress 83.00 MPa, viscous 3.61 %, inertial 0.84 %")
    assert len(chosen.stdout.splitlines()) == 1, "within the elastic part nothing is to be said"


def test_command_prints_what_is_expected(files):
    shown = command(files["damped"], "--twin", files["twin"], "--rate", "10", "--specimen", files["data"],
                    "--coeff", "80 8 4 3 8 4 0.005 500 1.5")
    assert shown.returncode == 0, shown.stderr
    tau = 500.0 * 0.007**2 / 2560.0 * 100.0 ** (1 / 3) / 100.0  # five spheres instead of 500
    assert f"E tau rate {1e-6 * E * tau * 10.0:.3f} MPa" in shown.stdout.splitlines()[0]


@pytest.mark.parametrize(
    "words, rule",
    [
        (("twin", "--twin", "damped"), "run with gamma = 0"),
        (("damped", "--twin", "missing.csv"), "missing.csv"),
        (("damped", "--twin", "twin", "--strains", "0.05"), "damped run: .* between strain 0.0494"),
        (("damped", "--twin", "twin", "--rate", "10"), "--rate and --specimen are given together"),
        (("damped", "--twin", "twin", "--specimen", "data"), "--rate and --specimen are given together"),
        (("damped", "--twin", "twin", "--rate", "10", "--specimen", "twin"), "no 'Atoms # sphere' section"),
        (("damped", "--twin", "twin", "--rate", "1", "--specimen", "data", "--coeff", "80 8"), "9 numbers"),
    ],
)
def test_command_fails_with_one_line(files, words, rule):
    failed = command(*(files.get(word, word) for word in words))
    assert failed.returncode == 1 and failed.stdout == ""
    assert failed.stderr.startswith("ERROR: ") and len(failed.stderr.splitlines()) == 1
    assert re.search(rule, failed.stderr), failed.stderr


def test_command_names_a_run_that_is_too_short(files, tmp_path):
    short = write(tmp_path / "short.csv", pulled(VISCOUS, end=0.0015))
    failed = command(short, "--twin", files["twin"])
    assert failed.returncode == 1 and "short.csv ends at strain 0.0015" in failed.stderr
    twin = write(tmp_path / "short_twin.csv", pulled(end=0.006))
    failed = command(files["damped"], "--twin", twin)
    assert failed.returncode == 1 and "twin: " in failed.stderr and "both reach" in failed.stderr
