# SPDX-License-Identifier: GPL-2.0-only
"""tools/curves.py: numbers of curves that are known in closed form, and its refusals."""

import re

import curves as tool
import numpy as np
import pytest
from evp import curves, figures
from in_process import call

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


@pytest.mark.parametrize(
    "text, rule",
    [
        ("", "no column strain"),
        ("strain,force\n0,0\n1,1\n", "no column stress_grip"),
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
    return call(tool.main, *words)


def test_a_byte_order_mark_is_no_part_of_the_first_column(tmp_path):
    path = write(tmp_path / "curve.csv", bilinear())
    plain = curves.read_curve(path)
    path.write_text(path.read_text(encoding="utf-8"), encoding="utf-8-sig")
    assert np.array_equal(curves.read_curve(path), plain)


def test_command_prints_the_numbers_and_draws(tmp_path):
    path = write(tmp_path / "a.csv", bilinear())
    shown = command("numbers", path)
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.splitlines()[1].split()[1] == "21"
    drawn = command("plot", path, "--labels", "10/s", "--out", tmp_path / "curves.png")
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
        "ITEM: TIMESTEP\n9\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ss ss ss\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z radius c_pairs[1] c_pairs[2]\n"
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


# ---- E of the elastic part ----


def rounded(modulus, limit, step=1e-4, end=0.008):
    """A curve that leaves its straight part as bodies do, a few per cent of the slope left: the stress
    limit + 0.03 E strain is approached by the fourth power."""
    strain = np.arange(0.0, end + 0.5 * step, step)
    bound = limit + 0.03 * modulus * strain
    stress = modulus * strain / (1.0 + (modulus * strain / bound) ** 4) ** 0.25
    return curves.Curve(strain, stress, stress)


@pytest.mark.parametrize("bend", [0.0006, 0.0011, 0.0019, 0.0028])
@pytest.mark.parametrize("step", [5e-5, 1e-4])
def test_the_modulus_is_that_of_the_elastic_part(bend, step):
    """Stiff metals bend far below 0.003: E within 2 % of that of the first rows, from a range that ends before the
    bend. Control: the slope to 0.003 is lower by far where the bend is early."""
    sharp = bilinear(step)
    sharp = sharp._replace(virial=np.where(sharp.strain <= bend, E * sharp.strain, E * bend + H * (sharp.strain - bend)))
    for curve in (sharp, rounded(E, E * bend / 0.8, step)):
        found = curves.numbers(curve)
        assert found["E_GPa"] == pytest.approx(1e-9 * E, rel=0.02)
        assert found["E_from"] == 0.0 and 0.5 * bend < found["E_to"] < 1.1 * bend
    if bend < 0.0015:
        whole = curves.numbers(sharp, fit=(0.0, curves.MODULUS_END))
        assert whole["E_GPa"] < 0.7e-9 * E, "control"


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
    assert found["E_to"] == curves.MODULUS_END
    assert found["E_GPa"] == pytest.approx(1e-9 * quiet, rel=0.02)


def test_range_given_by_the_user():
    strain, grip, virial = bilinear()
    assert curves.numbers(bilinear(), fit=(0.007, 0.012))["E_GPa"] == pytest.approx(1e-9 * H, rel=FITTED)
    found = curves.numbers(curves.Curve(strain, grip, virial), fit=(0.001, 0.002))
    assert (found["E_from"], found["E_to"]) == (0.001, 0.002)
    for low, high in ((0.002, 0.001), (-0.001, 0.002), (0.001, float("nan"))):
        with pytest.raises(curves.CurveError, match="range of E must be 0 <= low < high"):
            curves.numbers(bilinear(), fit=(low, high))


def test_rows_too_far_apart_for_the_elastic_part_are_refused():
    with pytest.raises(curves.CurveError, match="elastic part has fewer than three rows.*-var row.*--fit"):
        curves.numbers(rounded(E, 0.0004 * E, step=0.0005))


def test_a_line_that_does_not_begin_at_zero_is_told(tmp_path):
    """Rows that are all beyond the elastic part are straight too; a damped run's jump is no more than half."""
    beyond = write(tmp_path / "beyond.csv", rounded(E, 0.0003 * E, step=0.001))
    strain, grip, stress = bilinear()
    damped = write(tmp_path / "damped.csv", curves.Curve(strain, grip, np.where(strain > 0.0, stress + 30e6, 0.0)))
    shown = command("numbers", beyond, damped)
    notes = [line for line in shown.stdout.splitlines() if line.startswith("NOTE")]
    assert shown.returncode == 0 and len(notes) == 1, shown.stdout + shown.stderr
    assert "beyond.csv" in notes[0] and "MPa at strain 0" in notes[0]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_numbers_of_a_curve_that_turns_back_are_those_of_the_way_there(tmp_path, sign):
    """Also of compression, whose stresses are negative; where the way back is another one."""
    strain, grip, stress = bilinear()
    back = curves.Curve(*(sign * np.concatenate([row, other]) for row, other in
                          ((strain, strain[-2::-1]), (grip, 0.3 * grip[-2::-1]), (stress, 0.3 * stress[-2::-1]))))
    there, shown = (command("numbers", write(tmp_path / "a.csv", curve)) for curve in (bilinear(), back))
    notes = [line for line in shown.stdout.splitlines() if line.startswith("NOTE")]
    assert shown.returncode == 0 and len(notes) == 1, shown.stdout + shown.stderr
    assert f"a.csv turns back at strain {sign * strain[-1]:g}: the numbers above are those of the way there" in notes[0]
    numbers, expected = (run.stdout.splitlines()[1].split()[1:] for run in (shown, there))
    assert numbers[:2] == expected[:2] and numbers[-1] == expected[-1]
    assert [float(word) for word in numbers[2:-1]] == pytest.approx([sign * float(word) for word in expected[2:-1]])


# ---- curves of other loads ----

OTHERS = {
    "in.torsion": ("angle,shear_strain,torque_grip,torque_virial,shear_stress_grip,shear_stress_virial", lambda s, a, b: (2 * s, s, 1e-5 * a, 1e-5 * b, a, b)),
    "in.bending": ("strain,stress,deflection,force,reaction", lambda s, a, b: (s, b, 0.1 * s, b, b)),
    "in.shear": ("strain,shear_stress,pressure,share_second", lambda s, a, b: (s, b, 0.0, 0.5)),
}


def write_other(path, deck, curve):
    header, row = OTHERS[deck]
    path.write_text("\n".join([header, *(",".join(f"{value:.17g}" for value in row(*values)) for values in zip(*curve))]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("deck", OTHERS)
def test_curves_of_other_loads_have_the_same_numbers(tmp_path, deck):
    """numbers, table, cycle and plot, of a way and back; a line says what E, strain and stress are."""
    both = [bilinear(), curves.Curve(*(np.concatenate([row, row[-2::-1]]) for row in bilinear()))]
    for words, curve in ((("numbers",), both[0]), (("table",), both[0]), (("table",), both[1]), (("cycle",), both[1])):
        plain, other = command(*words, write(tmp_path / "a.csv", curve)), command(*words, write_other(tmp_path / "a.csv", deck, curve))
        assert other.returncode == 0, other.stderr
        modulus = "E" if deck == "in.bending" else "G"
        assert other.stdout.startswith(re.sub(r"\bE\b", modulus, plain.stdout)), words
        note = other.stdout[len(plain.stdout):]
        assert f"is of {deck}: " in note and f"its modulus is {modulus}\n" in note
    assert command("numbers", write_other(tmp_path / "a.csv", deck, both[0])).stdout.split()[:2] == [modulus, "[GPa]"]
    written = command("table", tmp_path / "a.csv", "--csv", tmp_path / "table.csv")
    assert written.returncode == 0 and (tmp_path / "table.csv").read_text().startswith(f"curve,{modulus}_GPa,{modulus}_from,{modulus}_to,yield_MPa")
    for kind in ("plot", "cycle"):
        drawn = command(kind, write_other(tmp_path / "b.csv", deck, both[1]), "--out", tmp_path / f"{kind}.png")
        assert drawn.returncode == 0 and (tmp_path / f"{kind}.png").is_file(), drawn.stderr


def test_curves_of_two_loads_are_not_drawn_into_one_picture(tmp_path):
    paths = write(tmp_path / "pulled.csv", bilinear()), write_other(tmp_path / "twisted.csv", "in.torsion", bilinear())
    shown = command("plot", *paths, "--out", tmp_path / "both.png")
    assert shown.returncode == 1 and "pulled.csv is of in.traction and" in shown.stderr and "twisted.csv of in.torsion" in shown.stderr
    assert command("table", *paths).stdout.split()[:4] == ["E", "or", "G", "[GPa]"]


@pytest.mark.parametrize("columns, remedy", [("time,force,speed,length", "curves.py columns --x time --y NAME, NAME one of force, speed, length"),
                                             ("angle,shear_strain,torque_grip,torque_virial", "of an older in.torsion: run the deck again"),
                                             ("a,b", "its first line must be strain,stress_virial")])
def test_files_that_hold_no_curve(tmp_path, columns, remedy):
    path = tmp_path / "other.csv"
    path.write_text(columns + "\n" + "0," * columns.count(",") + "0\n", encoding="utf-8")
    shown = command("numbers", path)
    assert shown.returncode == 1 and remedy in shown.stderr, shown.stderr


# ---- pictures of several curves ----


def test_curves_of_a_picture_are_told_apart(tmp_path, monkeypatch):
    """Six files of one name: labels with their folders, and as many different lines of one width."""
    from evp import figures

    drawn = []
    monkeypatch.setattr(figures, "save", lambda figure, *_: drawn.append(figure))
    paths = [tmp_path / f"way{k % 3}" / f"run{k // 3}" / "pull.csv" for k in range(6)] + [tmp_path / "way0" / "other.csv"]
    labels = figures.short_names(paths)
    assert labels[-1] == "other" and len(set(labels)) == 7 and labels[0] == "way0/run0/pull"
    for names in (labels, ["pull"] * 7):
        figures.stress_strain({"Traction": [(name, bilinear()) for name in names]}, tmp_path / "curves.png")
    for figure in drawn:
        lines = figure.axes[0].get_lines()
        assert len({(line.get_color(), line._unscaled_dash_pattern) for line in lines}) == 7
        assert len({line.get_linewidth() for line in lines}) == 1
    figures.stress_strain({"a": [("1/s", bilinear())], "b": [("10/s", bilinear()), ("1/s", bilinear())]}, tmp_path / "two.png")
    (first,), (_, again) = (axis.get_lines() for axis in drawn[-1].axes)
    assert first.get_color() == again.get_color(), "a label means one line in all panels"
    assert len({str(figures.line_style(k)) for k in range(40)}) == 40


@pytest.mark.parametrize("column", ["grip", "virial"])
def test_one_column_of_stress_is_enough(tmp_path, column):
    path = tmp_path / "one.csv"
    curve = bilinear()
    rows = zip(curve.strain, getattr(curve, column))
    path.write_text(f"strain,stress_{column}\n" + "".join(f"{a:.17g},{b:.17g}\n" for a, b in rows), encoding="utf-8")
    for words in (("plot", "--out", tmp_path / "picture.png"), ("numbers",)):
        shown = command(words[0], path, "--column", column, *words[1:])
        assert shown.returncode == 0, shown.stderr
    other = {"grip": "virial", "virial": "grip"}[column]
    refused = command("plot", path, "--column", other, "--out", tmp_path / "picture.png")
    assert refused.returncode == 1 and f"has no column stress_{other}; its first line must be strain,stress_{other}" in refused.stderr


def test_numbers_of_a_picture_do_not_overwrite_its_input(tmp_path):
    path = write(tmp_path / "pull.csv", bilinear())
    state = tmp_path / "state.csv"
    state.write_text("x,y,z,radius,share\n0,0,0,0.005,0.5\n", encoding="utf-8")
    measured = tmp_path / "law.csv"
    measured.write_text("strain,distance,force\n0,0.01,0\n0.01,0.0101,-9\n", encoding="utf-8")
    for words in (("plot", path), ("specimen", state), ("law", "--measured", measured)):
        before = words[-1].read_text()
        beside = words[-1].with_name(words[-1].stem + "_plot.csv")
        drawn = command(*words, "--out", words[-1].with_suffix(".png"))
        assert drawn.returncode == 0 and words[-1].read_text() == before, drawn.stderr
        assert f"NOTE: {words[-1]} is read: the numbers of the picture go to {beside}\n" in drawn.stdout
        assert command(*words, "--out", tmp_path / "free.png").returncode == 0 and (tmp_path / "free.csv").read_text() == beside.read_text()
    again = command("plot", path, tmp_path / "pull_plot.csv", "--out", tmp_path / "pull.png")
    assert again.returncode == 1 and "would be written over a file that is read" in again.stderr, "the other name is an input, too"
    over = command("plot", path, "--out", path)
    assert over.returncode == 1 and "would be written over a file that is read" in over.stderr and path.read_text().startswith("strain,stress_grip")


@pytest.mark.parametrize("name, values, label, factor", [
    ("time", [0.0, 8.5e-5], "time [\u00b5s]", 1e6), ("force", [-26.0, 3.0], "force [N]", 1.0), ("stress_grip", [1e3, 1.8e8], "stress grip [MPa]", 1e-6),
    ("length", [0.001], "length [mm]", 1e3), ("angle", [0.002], "angle [rad]", 1.0), ("time", [0.0], "time [s]", 1.0), ("spheres", [1e6], "spheres", 1.0)])
def test_units_of_an_axis_suit_its_numbers(name, values, label, factor):
    found = figures.axis_unit(name, np.array(values))
    assert found == (label, pytest.approx(factor, rel=1e-12))


def test_columns_of_any_file(tmp_path):
    """The picture's CSV holds the two columns; a column that is not there is named."""
    (tmp_path / "rod.csv").write_text("time,force,speed\n0,1,2\n1e-6,3,4\n", encoding="utf-8")
    done = call(tool.main, "columns", tmp_path / "rod.csv", "--x", "time", "--y", "speed", "--out", tmp_path / "wall.png")
    assert done.returncode == 0 and (tmp_path / "wall.png").stat().st_size > 5000
    assert (tmp_path / "wall.csv").read_text(encoding="utf-8").split() == ["curve,time,speed", "rod,0,2", "rod,1e-06,4"]
    done = call(tool.main, "columns", tmp_path / "rod.csv", "--x", "time", "--y", "length")
    assert done.returncode == 1 and "has no column length; wanted are time, length" in done.stderr
    done = call(tool.main, "columns", tmp_path / "rod.csv", "--x", "time", "--y", "speed", "--out", tmp_path / "rod.png")
    assert done.returncode == 0 and (tmp_path / "rod.csv").read_text(encoding="utf-8").startswith("time,force"), done.stderr
    assert (tmp_path / "rod_plot.csv").read_text(encoding="utf-8").split() == ["curve,time,speed", "rod,0,2", "rod,1e-06,4"]
