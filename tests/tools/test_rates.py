# SPDX-License-Identifier: GPL-2.0-only
"""tools/evp/rates.py and `curves.py rate`: curves with known shares, closed forms, refusals; tests/lammps/test_rate_shares.py has those of runs."""

import itertools
import re

import curves as tool
import numpy as np
import pytest
from evp import curves, law, rates, specimen
from inputs import call, curve_file

E, VISCOUS, INERTIAL, VIBRATION = 20e9, 3e6, 0.7e6, 0.2e6
EXACT = 1e-9  # straight lines through exact points


def pulled(jump=0.0, imbalance=0.0, end=0.0103):
    """A straight curve that starts with a jump; the grips' imbalance changes sign at each row."""
    strain = np.arange(0.0, end + 5e-5, 1e-4)
    virial = np.where(strain > 0.0, E * strain + jump, 0.0)
    return curves.Curve(strain, virial + imbalance * (-1.0) ** np.arange(len(strain)), virial)


@pytest.mark.parametrize("at", [0.002, 0.005, 0.01])
def test_shares_of_known_curves(at):
    found = rates.shares_at(pulled(VISCOUS, INERTIAL), pulled(0.0, VIBRATION), at)
    stress = E * at + VISCOUS
    assert found == pytest.approx(rates.Shares(at, stress, VISCOUS, INERTIAL, VIBRATION), rel=EXACT)


def test_imbalance_about_a_strain_and_strains_that_are_reached():
    strain, grip, virial = pulled()
    moving = curves.Curve(strain, np.where(strain > 0.006, grip + INERTIAL, grip), virial)
    assert rates.imbalance(moving, 0.005) == 0.0 and rates.imbalance(moving, 0.01) == pytest.approx(INERTIAL, rel=EXACT)
    for end, strains in ((0.0103, [0.002, 0.005, 0.01]), (0.0200, [0.002, 0.005, 0.01, 0.0195]), (0.001, [])):
        assert rates.reached(pulled(end=end)) == strains


def test_jump_at_the_start():
    jump, scatter = rates.starting_jump(pulled(VISCOUS))
    assert jump == pytest.approx(VISCOUS, rel=1e-6) and scatter < 1.0
    strain, grip, virial = pulled()
    bent = curves.Curve(strain, grip, virial - 7.5 * E * strain**2)  # as the law's first regime is
    assert abs(rates.starting_jump(bent)[0]) < 1.0


def test_a_vibrating_twin_is_no_damped_one():
    """Vibration leaves a small jump in the fit: beside a weak damper it is no sign of another."""
    strain, grip, virial = pulled()
    noise = VIBRATION * np.random.default_rng(5).standard_normal(len(strain))
    twins = [curves.Curve(strain, grip, virial + sign * noise) for sign in (1.0, -1.0)]
    assert max(rates.starting_jump(twin)[0] for twin in twins) > 0.1 * VIBRATION, "control"
    for twin, jump in itertools.product(twins, (0.0, 0.01 * VIBRATION, VISCOUS)):
        rates.check_twin(pulled(jump), twin)


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
    found = rates.expected(row_of_spheres(), law.TABLE2, 5e-3 / 1e-5, 10.0, E, length=0.04)
    tau, density = 1000.0 * 0.007**2 / 2560.0, 5e-3 / 1e-5
    assert found == pytest.approx((tau, E * tau * 10.0, density * np.sqrt(E / density) * 0.04 * 10.0), rel=1e-12)


@pytest.fixture
def files(tmp_path):
    """Damped runs, twins and a data file, by name."""
    atoms = [f"{i} 1 0.006 2700 {x:.17g} 0 0" for i, (x, _, _) in zip(row_of_spheres().ids, row_of_spheres().x)]
    data = tmp_path / "specimen.data"
    data.write_text("\n".join(["spheres", "", "5 atoms", "1 atom types", "", "Atoms # sphere", "", *atoms]) + "\n", encoding="utf-8")
    (tmp_path / "specimen.data.body").write_text("variable length equal 0.05 # [m]\nvariable volume equal 6.283185307179586e-05\n", encoding="utf-8")
    known = {"damped": pulled(VISCOUS, INERTIAL), "twin": pulled(), "half": pulled(0.5 * VISCOUS), "pushed": pulled(-1e9),
             "short": pulled(VISCOUS, end=0.0015), "shorter": pulled(end=0.0002), "short_twin": pulled(end=0.006)}
    return {"data": data, **{name: curve_file(tmp_path / f"{name}.csv", curve) for name, curve in known.items()}}


def command(files, *words):
    return call(tool.main, "rate", *(files.get(word, word) for word in words))


def test_command_prints_the_shares(files):
    shown, wanted = command(files, "damped", "--twin", "twin"), [f"viscous {300 / s:.2f} %, inertial {70 / s:.2f} %" for s in (43.0, 103.0, 203.0)]
    lines = shown.stdout.splitlines()
    assert len(lines) == 4 and all(want in line for want, line in zip(wanted, lines)), shown.stdout
    assert "beyond the elastic part" in lines[3]
    chosen = command(files, "damped", "--twin", "twin", "--strains", "0.004")
    assert chosen.stdout.startswith("strain 0.40 %: stress 83.00 MPa, viscous 3.61 %, inertial 0.84 %")
    assert len(chosen.stdout.splitlines()) == 1, "within the elastic part nothing is to be said"
    shown = command(files, "damped", "--twin", "twin", "--rate", "10", "--specimen", "data", "--coeff", "80 8 4 3 8 4 0.005 500 1.5")
    tau = 500.0 * 0.007**2 / 2560.0 * 100.0 ** (1 / 3) / 100.0  # five spheres instead of 500
    assert f"E tau rate {1e-6 * E * tau * 10.0:.3f} MPa" in shown.stdout.splitlines()[0], shown.stderr


ROW = "80 8 4 3 8 4 0.005 1000 1.5"


def test_a_row_with_a_spacing_is_scaled_as_the_pair_style_does(tmp_path):
    """gamma/e goes as (spacing/that of the body)^2, and the mass is that of the row's solid; numbers typed and in a file are one."""
    (tmp_path / "my.evp").write_text("# UNITS: si\nmine 80 8 4 3 8 4 0.005 500 1.5 spacing 0.0035 coordination 12 flow 0 1 0.1 1.5 density 2700 # of mine\n", encoding="utf-8")
    typed = rates.run_row("80 8 4 3 8 4 0.005 500 1.5 spacing 0.0035 coordination 12 flow 0 1 0.1 1.5 density 2700", row_of_spheres(), 1e-5)
    assert rates.run_row(f"{tmp_path}/my.evp:mine", row_of_spheres(), 1e-5) == typed
    assert rates.relaxation_time(np.full(4, 0.007), typed[0]) == pytest.approx(500.0 * 0.0035**2 / 2560.0) and typed[1] == 2700.0
    with pytest.raises(ValueError, match="no row 'yours'; its rows: mine"):
        rates.run_row(f"{tmp_path}/my.evp:yours", row_of_spheres(), 1e-5)
    (tmp_path / "two.evp").write_text("# UNITS: si\n" + 2 * f"mine {ROW}\n", encoding="utf-8")
    for twice, text in (("row 'mine' twice", f"{tmp_path}/two.evp:mine"), ("kv of a row is given twice", f"{ROW} kv 1 density 2 kv 1"),
                        ("flow of a row is given twice", f"{ROW} flow 0 1 flow 0 1 1 2"), ("limit of a row is given twice", f"{ROW} limit own limit own")):
        with pytest.raises(ValueError, match=twice):
            rates.run_row(text, row_of_spheres(), 1e-5)


EXPECT = ("damped", "--twin", "twin", "--specimen", "data")


@pytest.mark.parametrize("words, rule", [
    *((words, "run with gamma = 0") for words in (("damped", "--twin", "damped"), ("damped", "--twin", "half"), ("twin", "--twin", "damped"))),
    (("damped", "--twin", "shorter"), "twin: 2 rows"),
    (("damped", "--twin", "short_twin"), "twin: .* ends at strain 0.006.*both reach"),
    (("short", "--twin", "twin"), "short.csv ends at strain 0.0015: give --strains"),
    (("damped", "--twin", "twin", "--strains", "0.05"), "damped run: .* between strain 0.0494"),
    (("pushed", "--twin", "twin"), "no tension"),
    (("damped", "--twin", "missing.csv"), "missing.csv"),
    (("damped", "--twin", "twin", "--rate", "10"), "--rate, --specimen and --coeff are given together"),
    ((*EXPECT[:-1], "twin", "--rate", "10", "--coeff", ROW), "no 'Atoms # sphere' section"),
    ((*EXPECT, "--rate", "1", "--coeff", "80 8"), "9 numbers"),
    *(((*EXPECT, "--coeff", ROW, "--rate", rate), f"must be positive, got {rate}") for rate in ("0", "nan")),
    ((*EXPECT, "--rate", "1", "--coeff", "80 8 4 3 8 4 0.005 0 1.5"), "gamma > 0"),
    ((*EXPECT, "--rate", "1", "--coeff", "80 8 4 3 8 4 0.005 1000 1.01"), "no pairs within alpha = 1.01"),
])
def test_command_fails_with_one_line(files, words, rule):
    failed = command(files, *words)
    assert failed.returncode == 1 and failed.stdout == "" and failed.stderr.startswith("curves.py: error: ") and len(failed.stderr.splitlines()) == 1
    assert re.search(rule, failed.stderr), failed.stderr
