# SPDX-License-Identifier: GPL-2.0-only
"""tools/calibrate.py without LAMMPS: closed forms, refusals, run table, row, search on a body that is the closed form itself."""

import concurrent.futures
import json
import math

import calibrate
import numpy as np
import pytest
from evp import calibration, law
from evp.calibration import Refused, Table, Targets, check
from johnson_cook import JohnsonCook, from_handbook

GOOD = {"--E": "70e9", "--yield": "95e6", "--stress2": "150e6@0.05", "--density": "2700", "--name": "mine"}


@pytest.mark.parametrize("strain, nominal", [(0.005, 0.00489), (0.006, 0.00568), (0.008, 0.00663), (0.01, 0.00721), (0.02, 0.00863)])
def test_affine_curve_of_table1(strain, nominal):
    """That of eq. 8, from which plasticity departs by 0.3 % up to 2 %."""
    assert calibration.affine_stress([strain], calibration.Shape(3 / 80, 0.005, 0.0))[0] == pytest.approx(nominal, rel=3e-3)


def test_affine_moduli_with_volume_energy():
    """Slope at rest and Poisson's ratio are those of fix evp/volume's closed form."""
    volume = calibration.volume_ratio(0.33)
    assert calibration.volume_ratio(0.25) == pytest.approx(0.0, abs=1e-12)
    slope = calibration.affine_stress([1e-6], calibration.Shape(0.0375, 0.005, volume))[0] / 1e-6
    assert slope == pytest.approx(calibration.stiffening(volume), rel=1e-4)


def test_first_guess_gives_the_targets():
    shape = calibration.first_guess(0.0014, 1.6, 0.3, 0.05)
    slope = calibration.stiffening(0.3)
    assert calibration.affine_offset(shape) / slope == pytest.approx(0.0014, rel=1e-4)
    assert calibration.affine_stress([0.05], shape)[0] / slope == pytest.approx(1.6 * 0.0014, rel=1e-4)


def test_johnson_cook_values():
    """4340: true stress 792 + 510 ep^0.26 at ep = 0.04, its nominal stress at the nominal strain of that point; both signs."""
    steel = JohnsonCook(205e9, 792e6, 510e6, 0.26)
    true = 792e6 + 510e6 * 0.04**0.26
    strain = true / 205e9 + 0.04
    assert steel.nominal(math.expm1(strain))[0] == pytest.approx(true * math.exp(-strain), rel=1e-9)
    assert steel.nominal(math.expm1(-strain))[0] == pytest.approx(true * math.exp(strain), rel=1e-9)
    assert steel.nominal(0.001)[0] == pytest.approx(205e9 * math.log1p(0.001) / 1.001, rel=1e-12)
    at = steel.offset_yield() / 205e9 + 0.002
    assert steel.nominal(at)[0] == pytest.approx(steel.offset_yield(), rel=1e-9)


def test_power_law_of_handbook_values():
    """0.2 % yield and ultimate stress come back: the largest nominal stress of the curve is the ultimate one."""
    soft = from_handbook(69e9, 34e6, 90e6)
    assert soft.true_stress(0.002) == pytest.approx(34e6, rel=1e-9)
    plastic = np.linspace(0.05, 0.6, 2000)
    assert np.max(soft.true_stress(plastic) * np.exp(-plastic)) == pytest.approx(90e6, rel=1e-5)


@pytest.mark.parametrize("change, reason, nearest", [
    ({"--nu": "0.2"}, "central forces give 1/4", "nearest is 0.25"),
    ({"--nu": "0.45"}, "volume energy is so stiff", "nearest is 0.42"),
    ({"--nu": "nan"}, "cannot be had", "nearest is 0.25"),
    ({"--stress2": "90e6@0.05"}, "not above the yield stress", "nearest is a stress a few per cent above 9.5e+07"),
    ({"--stress2": "9e9@0.05"}, "Too steep", "nearest is"),
    ({"--stress2": "150e6@0.003"}, "not beyond the yield strain", "0.003357"),
    ({"--stress2": "150e6@0.3"}, "largest force", "up to 0.15"),
    ({"--stress2": "150e6"}, "VALUE@PLACE", ""),
    ({"--stress2": "150e6@0"}, "above 0", ""),
    ({"--E": "0"}, "--E must be a finite number above 0", ""),
    ({"--E": "70", "--yield": "95", "--stress2": "150@0.05"}, "70 Pa is softer than any metal", "70e9 for 70 GPa"),
    ({"--E": "70000", "--yield": "95", "--stress2": "150@0.05"}, "70000 Pa is softer than any metal", "in Pa"),
    ({"--E": "nan"}, "--E must be a finite number above 0", ""),
    ({"--yield": "-95e6"}, "--yield must be", ""),
    ({"--yield": "10e9", "--stress2": "15e9@0.15"}, "xi_s outside", "nearest is"),
    ({"--yield": "1000", "--stress2": "1500@0.05"}, "xi_s outside", "nearest is"),
    ({"--density": "0"}, "--density must be", ""),
    ({"--name": "two words"}, "cannot be the name of a row", ""),
    ({"--name": "two\n"}, "cannot be the name of a row", ""),
    ({"--name": "taken"}, "holds a row 'taken' already", ""),
    ({"--spheres": "10"}, "--spheres", "100"),
    ({"--within": "0.1"}, "--within", "0.01"),
    ({"--body": "bar.data", "--seed": "2"}, "--seed is that of the cylinder", "leave it out with --body"),
    ({"--body": "bar.data", "--rate": ["5e6@100"]}, "--rate: not with --body", "calibration without --body"),
    ({"--rate": ["5e6@100", "6e6@10000"]}, "not linear in the rate", "5e+06 Pa at 100/s and 6e+06 Pa at 10000/s"),
    ({"--rate": ["-5e6@100"]}, "--rate must be", ""),
])
def test_refusals(tmp_path, monkeypatch, capsys, change, reason, nearest):
    """Each is told with its reason; nothing was started, and no file is left behind."""
    monkeypatch.setenv("EVP_LMP", str(tmp_path / "nowhere"))
    out = tmp_path / "out.evp"
    before = "# UNITS: si\ntaken 80 8 4 3 8 4 0.005 0 1.5\n"
    out.write_text(before, encoding="utf-8")
    words = []
    for key, value in {**GOOD, **change}.items():
        words += [word for one in (value if isinstance(value, list) else [value]) for word in (f"{key}={one}",)]
    assert calibrate.main([*words, "--out", str(out)]) == 1
    message = capsys.readouterr().err
    assert reason in message and nearest in message
    assert [path.name for path in tmp_path.iterdir()] == ["out.evp"] and out.read_text(encoding="utf-8") == before


def test_body_and_spheres_exclude_each_other(capsys):
    """Also where --spheres is the default in words."""
    for spheres in ("500", "2000"):
        with pytest.raises(SystemExit) as end:
            calibrate.main([f"{key}={value}" for key, value in {**GOOD, "--body": "bar.data", "--spheres": spheres, "--out": "out.evp"}.items()])
        assert end.value.code == 2 and "argument --spheres: not allowed with argument --body" in capsys.readouterr().err


@pytest.mark.parametrize("body, measures, reason", [
    (None, None, "there is no file bar.data; give the data file of a body"),
    ("any", None, "there is no file bar.data.body; make the body by in.specimen or tools/body.py, which write both"),
    ("any", "variable length index 0.05\n", "bar.data.body gives no length or no volume of the body"),
    ("any", "variable length index 0.05\nvariable volume index 6e-5 # [m3]\n", "bar.data is no data file of atom_style sphere")])
def test_bodies_that_are_refused(tmp_path, monkeypatch, body, measures, reason):
    monkeypatch.chdir(tmp_path)
    for name, text in (("bar.data", body), ("bar.data.body", measures)):
        if text:
            (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "work").mkdir()
    with pytest.raises(Refused) as refused:
        calibration.given_body("bar.data", "work")
    assert reason in str(refused.value)


@pytest.mark.parametrize("text, reason", [("x", "'UNITS: si'"), ("# UNITS: lj\n", "'UNITS: si'"), (None, "is a folder")])
def test_files_that_cannot_take_a_row(tmp_path, capsys, text, reason):
    out = tmp_path / "out.evp"
    out.mkdir() if text is None else out.write_text(text, encoding="utf-8")
    assert calibrate.main([f"{key}={value}" for key, value in GOOD.items()] + ["--out", str(out)]) == 1
    assert reason in capsys.readouterr().err


def test_linear_rates_over_decades_are_accepted():
    check(Targets(70e9, 95e6, 150e6, 0.05, 2700.0, None, ((1e6, 10.0), (1e8, 1000.0))))


def test_row_is_appended_whole(tmp_path):
    """What was there stays; the line holds the numbers of the row and its body."""
    out = tmp_path / "a.evp"
    line = calibration.row_line("x", law.TABLE1, 0.004, 12.5, 0.0, 2700.0)
    calibration.append(out, ["# a", line])
    calibration.append(out, [calibration.row_line("y", law.TABLE2, 0.004, 12.5, 300.0, 2700.0)])
    text = out.read_text(encoding="utf-8").splitlines()
    assert text[0].startswith("# UNITS: si")
    assert text[-2:] == ["x 80 8 4 3 8 4 0.005 0 1.5 spacing 0.004 coordination 12.5 density 2700",
                         "y 80 8 4 3 8 4 0.005 1000 1.5 spacing 0.004 coordination 12.5 kv 300 density 2700"]
    assert [path.name for path in tmp_path.iterdir()] == ["a.evp"]


def test_table_drops_a_line_that_was_cut_off(tmp_path):
    path = tmp_path / "t.jsonl"
    table = Table(path, {"a": 1})
    table.add({"kind": "pull", "number": 1, "state": "done"})
    table.close()
    with open(path, "a", encoding="utf-8") as target:
        target.write('{"kind": "pull", "num')
    table = Table(path, {"a": 1})
    assert len(table.runs) == 1 and table.find(number=1)["state"] == "done"
    table.add({"kind": "pull", "number": 2})
    table.close()
    assert [json.loads(line).get("number") for line in path.read_text(encoding="utf-8").splitlines()] == [None, 1, 2]
    with pytest.raises(Refused, match="another a"):
        Table(path, {"a": 2})


def test_one_writer_at_a_time(tmp_path):
    table = Table(tmp_path / "t.jsonl", {})
    with pytest.raises(Refused, match="another calibration"):
        Table(tmp_path / "t.jsonl", {})
    table.close()


def test_a_fresh_calibration_leaves_one_that_is_running(tmp_path, monkeypatch):
    """Neither its runs nor its folder; alone it forgets both."""
    monkeypatch.setenv("EVP_LMP", "/bin/true")
    table, body = Table(tmp_path / "t.jsonl", {}), tmp_path / "t.work" / "body.data"
    table.add({"number": 1})
    body.parent.mkdir()
    body.touch()
    words = [word for pair in GOOD.items() for word in pair] + ["--out", str(tmp_path / "m.evp"), "--table", str(table.path), "--ranks", "1", "--fresh"]
    options = calibrate.parser().parse_args(words)
    with pytest.raises(Refused, match="another calibration"):
        calibrate.calibrate(options, words)
    assert body.exists() and len(table.path.read_text(encoding="utf-8").splitlines()) == 2
    table.close()
    monkeypatch.setattr(calibration, "make_body", lambda folder, *_: (_ for _ in ()).throw(calibration.Failed(str(list(folder.iterdir())))))
    with pytest.raises(calibration.Failed, match=r"^\[\]$"):
        calibrate.calibrate(options, words)
    assert len(table.path.read_text(encoding="utf-8").splitlines()) == 1


def test_rows_appended_at_once_are_all_there(tmp_path):
    path, count = tmp_path / "m.evp", 12
    with concurrent.futures.ThreadPoolExecutor(count) as pool:
        list(pool.map(lambda number: calibration.append(path, [f"row{number} 1"]), range(count)))
    lines = path.read_text(encoding="utf-8").splitlines()
    assert sorted(line for line in lines if line.startswith("row")) == sorted(f"row{number} 1" for number in range(count))


BODY = calibration.Body(None, 4000, 26000, 0.003, 1e-5)


def closed_form_pull(stiff=0.9, made=None):
    """A stand-in for the run: the closed form with a modulus that is off, and less hardening."""
    def pull(body, row, kv, targets, finer, *_):
        if made is not None:
            made.append((row, kv, finer))
        network = stiff * 32.0 * row.e1 * body.bonds / body.volume / 6.0
        shape = calibration.Shape(row.e2 / row.e1, row.xi_s, kv * body.count / body.volume / network)
        bulk, shear = 1.0 / 1.5 + shape.volume, 0.4
        return {"E": network * calibration.stiffening(shape.volume), "yield": 0.95 * network * calibration.affine_offset(shape),
                "stress2": 0.85 * network * calibration.affine_stress([abs(targets.strain)], shape)[0],
                "nu": 0.01 + (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear))}, (np.zeros(2), np.zeros(2))
    return pull


def searched(tmp_path, monkeypatch, targets, pull):
    monkeypatch.setattr(calibration, "pull", pull)
    table = Table(tmp_path / "t.jsonl", {})
    told = []
    try:
        return calibration.Search(targets, BODY, table, 1, tmp_path, 10.0, 0.005, told.append).pull(), table, told
    finally:
        table.close()


@pytest.mark.parametrize("targets", [
    Targets(70e9, 95e6, 150e6, 0.05, 2700.0, 0.33), Targets(124e9, 132e6, 194e6, 0.05, 8960.0), Targets(205e9, 890e6, 1250e6, -0.1, 7830.0),
    Targets(69e9, 34e6, 72e6, 0.05, 2700.0, 0.33)])
def test_search_meets_the_targets(tmp_path, monkeypatch, targets):
    result = searched(tmp_path, monkeypatch, targets, closed_form_pull())[0]
    assert result.runs <= 6 and max(map(abs, result.residuals.values())) <= 0.005
    assert (result.kv > 0.0) == (targets.nu is not None)


def test_failed_run_is_retried_smaller(tmp_path, monkeypatch):
    """One run not finite, the next timed out, then done with a quarter of the increments; all are in the table."""
    made, good = [], closed_form_pull()

    def pull(*arguments):
        made.append(arguments[4])
        if len(made) in (2, 3):
            raise calibration.Failed(("not finite", "timed out after 10 s")[len(made) - 2])
        return good(*arguments)

    result, table, told = searched(tmp_path, monkeypatch, Targets(70e9, 95e6, 150e6, 0.05, 2700.0, 0.33), pull)
    assert made[:4] == [1.0, 1.0, 0.5, 0.25]
    assert [(run["number"], run["state"], run["increments"]) for run in table.runs][:4] == [
        (1, "done", 1.0), (2, "failed", 1.0), (2, "failed", 0.5), (2, "done", 0.25)]
    assert table.runs[2]["reason"] == "timed out after 10 s" and any("again with 0.25" in line for line in told)
    assert max(map(abs, result.residuals.values())) <= 0.005


def test_runs_of_the_table_are_not_repeated(tmp_path, monkeypatch):
    """Cut after any run, the search makes the others only and ends on the same row."""
    targets, made = Targets(70e9, 95e6, 150e6, 0.05, 2700.0, 0.33), []
    whole = searched(tmp_path, monkeypatch, targets, closed_form_pull(made=made))[0]
    lines = (tmp_path / "t.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    rows = list(made)
    for kept in range(1, len(lines)):
        (tmp_path / "t.jsonl").write_text("".join(lines[:kept]), encoding="utf-8")
        made.clear()
        again = searched(tmp_path, monkeypatch, targets, closed_form_pull(made=made))[0]
        assert made == rows[kept - 1:] and (again.row, again.kv) == (whole.row, whole.kv)


def test_less_hardening_than_the_law_has_is_refused_by_the_runs(tmp_path, monkeypatch):
    with pytest.raises(Refused, match=r"(?s)Too little.*Give a stress a few percent above"):
        searched(tmp_path, monkeypatch, Targets(205e9, 890e6, 900e6, 0.05, 7830.0), closed_form_pull())


def test_a_run_that_hangs_is_ended(tmp_path, monkeypatch):
    lmp = tmp_path / "lmp"
    lmp.write_text("#!/bin/sh\nexec sleep 60\n", encoding="utf-8")
    lmp.chmod(0o755)
    monkeypatch.setenv("EVP_LMP", str(lmp))
    with pytest.raises(calibration.Failed, match="timed out after 0"):
        calibration.call("in.quasistatic", {}, 1, tmp_path, 0.3, "x")


def test_a_curve_that_is_not_finite_has_failed(tmp_path):
    path = tmp_path / "pull.csv"
    path.write_text("strain,stress_grip,stress_virial\n0,0,0\n0.1,0,nan\n", encoding="utf-8")
    with pytest.raises(calibration.Failed, match="not finite"):
        calibration.read_curve(path)
