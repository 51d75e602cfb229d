# SPDX-License-Identifier: GPL-2.0-only
"""tools/curves.py: numbers of curves that are known in closed form, pictures, and its refusals."""

import re

import curves as tool
import inputs
import numpy as np
import pytest
from evp import curves, figures, measured, run, specimen

# A bilinear curve: slope E to the strain BEND, slope H beyond. The line offset by 0.2 % meets it
# where E BEND + H (s - BEND) = E (s - 0.002).
E, H, BEND = 21e9, 2.1e9, 0.005
YIELD_STRAIN = (0.002 * E + (E - H) * BEND) / (E - H)
YIELD = E * (YIELD_STRAIN - 0.002)
FITTED = 1e-9  # of straight lines through exact points


def bilinear(step=1e-4, end=0.02, bend=BEND):
    strain = np.arange(0.0, end + 0.5 * step, step)
    stress = np.where(strain <= bend, E * strain, E * bend + H * (strain - bend))
    return curves.Curve(strain, 1.01 * stress, stress)


def damped():
    """With the jump at the start of a damped run."""
    curve = bilinear()
    return curve._replace(virial=np.where(curve.strain > 0.0, curve.virial + 30e6, 0.0))


def command(*words):
    return inputs.call(tool.main, *words)


def notes(shown):
    assert shown.returncode == 0, shown.stderr
    return [line for line in shown.stdout.splitlines() if line.startswith("NOTE")]


def test_numbers_of_a_bilinear_curve():
    found = curves.numbers(bilinear())
    at_1pc, at_2pc = (E * BEND + H * (s - BEND) for s in (0.01, 0.0195))
    names = ("E_GPa", "yield_MPa", "stress_1pc_MPa", "stress_2pc_MPa")
    assert [found[name] for name in names] == pytest.approx([1e-9 * E, 1e-6 * YIELD, 1e-6 * at_1pc, 1e-6 * at_2pc], rel=FITTED)
    assert BEND - curves.TANGENT_WINDOW < found["departure_strain"] < BEND, "the window of +-0.0004 feels the bend from 0.0046 on"
    assert curves.numbers(damped())["E_GPa"] == pytest.approx(1e-9 * E, rel=FITTED), "the jump at the start is no part of it"
    found = curves.numbers(bilinear(), fit=(0.007, 0.012))
    assert found["E_GPa"] == pytest.approx(1e-9 * H, rel=FITTED) and (found["E_from"], found["E_to"]) == (0.007, 0.012)


@pytest.mark.parametrize("curve, missing", [(bilinear(bend=1.0), ("yield_MPa", "departure_strain")), (bilinear(end=0.0062), ("yield_MPa", "stress_1pc_MPa"))])
def test_a_straight_or_short_curve_gives_what_it_can(curve, missing):
    found = curves.numbers(curve)
    assert found["E_GPa"] == pytest.approx(1e-9 * E, rel=FITTED) and all(np.isnan(found[name]) for name in missing)


def rounded(limit, step=1e-4, end=0.008):
    """A curve that leaves its straight part as bodies do, a few per cent of the slope left: the stress
    limit + 0.03 E strain is approached by the fourth power."""
    strain = np.arange(0.0, end + 0.5 * step, step)
    stress = E * strain / (1.0 + (E * strain / (limit + 0.03 * E * strain)) ** 4) ** 0.25
    return curves.Curve(strain, stress, stress)


@pytest.mark.parametrize("bend", [0.0006, 0.0011, 0.0019, 0.0028])
@pytest.mark.parametrize("step", [5e-5, 1e-4])
def test_the_modulus_is_that_of_the_elastic_part(bend, step):
    """Stiff metals bend far below 0.003: E within 2 % of that of the first rows, from a range that ends before the
    bend. Control: the slope to 0.003 is lower by far where the bend is early."""
    for curve in (bilinear(step, bend=bend), rounded(E * bend / 0.8, step)):
        found = curves.numbers(curve)
        assert found["E_GPa"] == pytest.approx(1e-9 * E, rel=0.02) and found["E_from"] == 0.0 and 0.5 * bend < found["E_to"] < 1.1 * bend
    assert bend > 0.0015 or curves.numbers(bilinear(step, bend=bend), fit=(0.0, curves.MODULUS_END))["E_GPa"] < 0.7e-9 * E, "control"


@pytest.mark.parametrize("seed", range(4))
def test_vibration_is_no_bend(seed):
    """Rows that resolve a vibration fast or slow, in which short ranges bend; and noise of 0.3 MPa rms."""
    random = np.random.default_rng(seed)
    strain, grip, virial = bilinear(1e-5 if seed % 2 else 1e-4)
    virial = virial - 7.5 * E * strain**2 * (strain < 0.004)  # as the law's first regime is
    quiet = curves.modulus(strain, virial)
    period, phase = random.uniform(2e-4, 1e-3), random.uniform(0.0, 2.0 * np.pi)
    noise = 0.3e6 * random.standard_normal(len(strain)) + 0.5e6 * np.sin(2.0 * np.pi * strain / period + phase)
    found = curves.numbers(curves.Curve(strain, grip, virial + noise))
    assert found["E_to"] == curves.MODULUS_END and found["E_GPa"] == pytest.approx(1e-9 * quiet, rel=0.02)


def test_a_line_that_does_not_begin_at_zero_is_told(tmp_path):
    """Rows that are all beyond the elastic part are straight too; a damped run's jump is no more than half."""
    beyond = inputs.curve_file(tmp_path / "beyond.csv", rounded(0.0003 * E, step=0.001))
    (note,) = notes(command("numbers", beyond, inputs.curve_file(tmp_path / "damped.csv", damped())))
    assert "beyond.csv" in note and "MPa at strain 0" in note


def there_and_back(curve, sign=1.0, share=1.0):
    """The curve and the way back on this share of its stresses."""
    strain, *stresses = curve
    return curves.Curve(*(sign * np.concatenate([row, scale * row[-2::-1]]) for row, scale in zip((strain, *stresses), (1.0, share, share))))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_numbers_of_a_curve_that_turns_back_are_those_of_the_way_there(tmp_path, sign):
    """Also of compression, whose stresses are negative; where the way back is another one."""
    there, shown = (command("numbers", inputs.curve_file(tmp_path / "a.csv", curve)) for curve in (bilinear(), there_and_back(bilinear(), sign, 0.3)))
    (note,) = notes(shown)
    assert f"a.csv turns back at strain {sign * 0.02:g}: the numbers above are those of the way there" in note
    numbers, expected = (run.stdout.splitlines()[1].split()[1:] for run in (shown, there))
    assert numbers[:2] == expected[:2] and numbers[-1] == expected[-1]
    assert [float(word) for word in numbers[2:-1]] == pytest.approx([sign * float(word) for word in expected[2:-1]])


def test_a_curve_to_rupture_tells_its_largest_stress(tmp_path):
    curve = bilinear()
    fallen = curve._replace(virial=np.where(curve.strain > 0.0151, 0.0, curve.virial))
    shown = command("numbers", inputs.curve_file(tmp_path / "a.csv", fallen))
    assert f"a.csv: largest stress {1e-6 * (E * BEND + H * (0.0151 - BEND)):.5g} MPa at strain 0.0151, a tenth of it is left at strain {curve.strain[curve.strain > 0.0151][0]:.4g}" in shown.stdout
    softer = curve._replace(virial=np.where(curve.strain > 0.0151, 0.8, 1.0) * curve.virial)
    assert re.search(r"a.csv: largest stress .* MPa at strain 0.0151, \S+ MPa at the end", command("numbers", inputs.curve_file(tmp_path / "a.csv", softer)).stdout)
    assert "largest" not in command("numbers", inputs.curve_file(tmp_path / "b.csv", curve)).stdout


# ---- files ----

HEAD = "strain,stress_grip,stress_virial\n"


@pytest.mark.parametrize("text, message", [
    ("", "bad.csv has no column strain"),
    ("strain,force\n0,0\n1,1\n", "bad.csv has no column stress_virial; its first line must be strain,stress_virial"),
    (HEAD + "0,0,0\n", "bad.csv holds 1 rows: no curve"), (HEAD + "0,0,0\n1,1\n", "damaged line"),
    ("strain,stress_virial\n0,0,0,0\n0,1,1,5\n", "where the comma is the decimal sign"), (HEAD + "0,0,0\n1,1,one\n", "damaged line"),
    (HEAD + "0,0,0\n1,1,nan\n", "bad.csv holds a number that is not finite: the run was unstable"),
    (bilinear(end=0.001), "it ends at strain 0.001: pull farther or in smaller increments, or give the range (--fit)"),
    (rounded(0.0004 * E, step=0.0005), "elastic part has fewer than three rows"),
    ("time,force,speed,length\n0,0,0,0\n", "curves.py columns --x time --y NAME, NAME one of force, speed, length"),
    ("angle,shear_strain,torque_grip,torque_virial\n0,0,0,0\n", "has no column shear_stress_virial; its first line must be shear_strain,shear_stress_virial"),
    (None, "there is no file ")])
def test_files_that_hold_no_curve(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    if isinstance(text, curves.Curve):
        inputs.curve_file(path, text)
    elif text is not None:
        path.write_text(text, encoding="utf-8")
    failed = command("numbers", path)
    assert failed.returncode == 1 and failed.stderr.startswith("curves.py: error: ") and len(failed.stderr.splitlines()) == 1
    assert message in failed.stderr, failed.stderr


@pytest.mark.parametrize("rest", ["0.0055,109000000,10", "0.0055,109000000,10,0.0055", "0.00"])
def test_a_last_line_that_was_cut_off_is_left_out(tmp_path, rest):
    """Within a number, with all columns or not."""
    whole = inputs.curve_file(tmp_path / "run.csv", bilinear(end=0.004))
    shown, text = command("numbers", whole), whole.read_text(encoding="utf-8")
    assert not notes(shown)
    whole.write_text(text + ",".join(rest.split(",")[: text.splitlines()[0].count(",") + 1]), encoding="utf-8")
    cut = command("numbers", whole)
    (note,) = notes(cut)
    assert "run.csv: its last line has no line end and is left out" in note and shown.stdout in cut.stdout


@pytest.mark.parametrize("rest, message", [("0.02,1", "is taken as it stands, strain 0.02, stress 1: check"), ("0.02", "is left out"), ("0.02,", "is left out")])
def test_a_measured_file_may_lack_the_last_line_end(tmp_path, capsys, rest, message):
    (tmp_path / "test.csv").write_text("strain,stress\n0,0\n0.0125,115e6\n" + rest, encoding="utf-8")
    strain, _ = measured.read_points(tmp_path / "test.csv")
    assert message in capsys.readouterr().out and len(strain) == (3 if "taken" in message else 2)


def test_bodies_that_were_cut_off_are_refused(tmp_path):
    """Within their last number."""
    data = "title\n\n2 atoms\n\n0 1 xlo xhi\n\nAtoms # sphere\n\n1 1 0.1 2700 0.5 0.5 0.5\n2 1 0.1 2700 0.6 0.5 0.55"
    for text, good in ((data + "\n", True), (data, False), (data + "\n\nVelocities\n\n1 0 0 0 0 0 0", True)):
        (tmp_path / "body.data").write_text(text, encoding="utf-8")
        if good:
            assert specimen.read_data(tmp_path / "body.data").x[1, 2] == 0.55
        else:
            with pytest.raises(ValueError, match="the file was cut off"):
                specimen.read_data(tmp_path / "body.data")
    (tmp_path / "body.data.body").write_text("variable length equal 0.05\nvariable volume equal 6.28", encoding="utf-8")
    with pytest.raises(ValueError, match="no volume of the body"):
        specimen.read_body(tmp_path / "body.data")


def test_one_column_of_stress_is_enough(tmp_path):
    """But for the shares of a rate. A byte order mark is no part of the first."""
    curve = bilinear()
    path = inputs.curve_file(tmp_path / "one.csv", (curve.strain, curve.virial), ("strain", "stress_virial"))
    path.write_text(path.read_text(encoding="utf-8"), encoding="utf-8-sig")
    for words in (("plot", "--out", tmp_path / "picture.png"), ("numbers",)):
        shown = command(*words, path)
        assert shown.returncode == 0, shown.stderr
    refused = command("rate", path, "--twin", path)
    assert refused.returncode == 1 and "damped run: its file has no column stress_grip" in refused.stderr


# ---- curves of other loads ----

OTHERS = {
    "in.torsion": ("angle,shear_strain,torque_grip,torque_virial,shear_stress_grip,shear_stress_virial", lambda s, a, b: (2 * s, s, 1e-5 * a, 1e-5 * b, a, b)),
    "in.bending": ("strain,stress,deflection,force,reaction", lambda s, a, b: (s, b, 0.1 * s, b, b)),
    "in.shear": ("strain,shear_stress,pressure,share_second", lambda s, a, b: (s, b, 0.0 * s, 0.0 * s + 0.5)),
}


def other_file(path, deck, curve):
    columns, values = OTHERS[deck]
    return inputs.curve_file(path, values(*curve), columns.split(","))


@pytest.mark.parametrize("deck", OTHERS)
def test_curves_of_other_loads_have_the_same_numbers(tmp_path, deck):
    """numbers, table, cycle and plot, of a way and back; a line says what E, strain and stress are."""
    both = [bilinear(), there_and_back(bilinear())]
    modulus = "E" if deck == "in.bending" else "G"
    for words, curve in ((("numbers",), both[0]), (("table",), both[0]), (("table",), both[1]), (("cycle",), both[1])):
        plain, other = (command(*words, path) for path in (inputs.curve_file(tmp_path / "a.csv", curve), other_file(tmp_path / "b.csv", deck, curve)))
        assert other.returncode == 0, other.stderr
        expected = re.sub(r"\bE\b", modulus, plain.stdout).replace("a.csv", "b.csv").splitlines()
        lines = other.stdout.splitlines()
        if "area" in expected[0] and deck != "in.shear":  # stress and strain of the surface have no work
            (expected[1], _), (lines[1], area) = (line.rsplit(None, 1) for line in (expected[1], lines[1]))
            assert area == "-" and (words != ("cycle",) or "has no last loop area: the stress of the surface" in other.stdout)
        assert lines[:len(expected)] == expected, words
        assert f"is of {deck}: " in other.stdout and other.stdout.rstrip().endswith(f"its modulus is {modulus}")
    written = command("table", tmp_path / "b.csv", "--csv", tmp_path / "table.csv")
    assert written.returncode == 0 and (tmp_path / "table.csv").read_text().startswith(f"curve,{modulus}_GPa,{modulus}_from,{modulus}_to,yield_MPa")
    for kind in ("plot", "cycle"):
        drawn = command(kind, tmp_path / "b.csv", "--out", tmp_path / f"{kind}.png")
        assert drawn.returncode == 0 and (tmp_path / f"{kind}.png").is_file(), drawn.stderr


def test_curves_of_two_loads_are_not_drawn_into_one_picture(tmp_path):
    paths = inputs.curve_file(tmp_path / "pulled.csv", bilinear()), other_file(tmp_path / "twisted.csv", "in.torsion", bilinear())
    shown = command("plot", *paths, "--out", tmp_path / "both.png")
    assert shown.returncode == 1 and "pulled.csv is of in.traction and" in shown.stderr and "twisted.csv of in.torsion" in shown.stderr
    assert command("table", *paths).stdout.split()[:4] == ["E", "or", "G", "[GPa]"]


# ---- pictures ----


def test_curves_of_a_picture_are_told_apart(tmp_path, monkeypatch):
    """Six files of one name: labels with their folders, and as many different lines of one width."""
    drawn = []
    monkeypatch.setattr(figures, "save", lambda figure, *_: drawn.append(figure))
    paths = [tmp_path / f"way{k % 3}" / f"run{k // 3}" / "pull.csv" for k in range(6)] + [tmp_path / "way0" / "other.csv"]
    labels = figures.short_names(paths)
    assert labels[-1] == "other" and len(set(labels)) == 7 and labels[0] == "way0/run0/pull"
    figures.stress_strain({"a": [(name, bilinear()) for name in labels], "b": [(labels[0], bilinear())]}, tmp_path / "curves.png")
    lines, (again,) = (axis.get_lines() for axis in drawn[0].axes)
    assert len({(line.get_color(), line._unscaled_dash_pattern) for line in lines}) == 7 and len({line.get_linewidth() for line in lines}) == 1
    assert lines[0].get_color() == again.get_color(), "a label means one line in all panels"


def test_units_of_an_axis_suit_its_numbers(tmp_path, monkeypatch):
    """Those of the columns of the decks."""
    drawn = []
    monkeypatch.setattr(figures, "save", lambda figure, *_: drawn.append(figure.axes[0]))
    figures.two_columns({"rod": {"time": np.array([0.0, 8e-5]), "mine": np.array([0.0, 2.0])}}, "time", "mine", tmp_path / "rod.png")
    known, unknown = (axis.get_major_formatter() for axis in (drawn[0].xaxis, drawn[0].yaxis))
    assert known(4e-5) == "40 \u00b5s" and not isinstance(unknown, type(known))
    figures.two_columns({"rod": {"strain": np.array([0.0, 1.0]), "temperature": np.array([300.0, 1200.0])}}, "strain", "temperature", tmp_path / "rod.png")
    assert drawn[1].get_xlabel() == "strain" and drawn[1].get_ylabel() == "temperature [K]"


def test_each_column_of_the_decks_has_a_unit():
    """Or none, which is said, too."""
    written = set()
    for deck in [*run.DECKS.glob("in.*"), run.DECKS / "bond_counts.lmp"]:
        text = re.sub(r"\s*&\s*\n\s*", " ", deck.read_text(encoding="utf-8"))
        for names in re.findall(r'(?:\btitle |\bprint +"*|csv_columns string "?|bond_titles index )([a-z_]+(?:, ?[a-z_0-9]+)+)', text):
            written |= set(names.replace(" ", "").split(","))
    assert {"force_ram", "ended_at_dlim", "thermocouple_5", "heat_imbalance", "hardness", "anisotropy"} < written
    assert written == set(figures.UNITS)


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Files of each kind that is drawn; in their folder."""
    monkeypatch.chdir(tmp_path)
    inputs.curve_file(tmp_path / "pull.csv", bilinear())
    (tmp_path / "law.csv").write_text("strain,distance,force\n0,0.01,0\n0.01,0.0101,-9\n", encoding="utf-8")
    (tmp_path / "rod.csv").write_text("time,force,speed\n0,1,2\n1e-6,3,4\n", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("name, words, beside", [
    ("pull", ("plot", "pull.csv"), {0: "panel,curve,strain_percent,stress_MPa", 101: "Traction,pull,1,115.5"}),
    ("law", ("law", "--measured", "law.csv"), {0: "strain_percent,force_N,first_regime_N,source", -1: "1,-9,,LAMMPS"}),
    ("rod", ("columns", "rod.csv", "--x", "time", "--y", "speed"), {0: "curve,time,speed", 1: "rod,0,2", 2: "rod,1e-06,4"})])
def test_numbers_of_a_picture_are_beside_it(files, name, words, beside):
    """Not in the place of a run's output of its name."""
    before = (files / f"{name}.csv").read_text()
    drawn = command(*words, "--out", f"{name}.png")
    assert drawn.returncode == 0 and (files / f"{name}.png").read_bytes()[:4] == b"\x89PNG", drawn.stderr
    lines = (files / f"{name}.png.csv").read_text().splitlines()
    assert {k: lines[k] for k in beside} == beside
    assert (files / f"{name}.csv").read_text() == before


def test_a_law_without_runs_is_drawn(files):
    assert command("law", "--out", "alone.png").returncode == 0 and (files / "alone.png.csv").exists()


@pytest.mark.parametrize("words, message", [
    (("plot", "pull.csv", "--out", "pull.csv"), "--out pull.csv would be written over a file that is read"),
    (("plot", "pull.csv", "--out", "pull"), "--out pull.csv would be written over a file that is read"),
    (("plot", "pull.csv", "--out", "drawn"), "--out drawn: the name of a picture ends in .png"),
    (("columns", "rod.csv", "--x", "time", "--y", "force", "--out", "drawn.jpg"), "--out drawn.jpg: the name of a picture ends in .png"),
    (("law", "--out", "drawn.csv"), "--out drawn.csv: the name of a picture ends in .png"),
    (("columns", "rod.csv", "--x", "time", "--y", "length"), "has no column length; wanted are time, length")])
def test_pictures_that_are_refused(files, words, message):
    before = {path: path.read_bytes() for path in files.iterdir()}
    refused = command(*words)
    assert refused.returncode == 1 and message in refused.stderr
    assert {path: path.read_bytes() for path in files.iterdir()} == before
