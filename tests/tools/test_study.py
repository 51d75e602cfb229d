# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies: what the sections and pages of any_body, large_strain, metals and accuracy_cost say of known runs; shipped rows, commands and
targets belong together; the first look, and loads against integrals."""

import math
import re

import accuracy_cost as accuracy
import any_body
import cost
import first_look
import inputs
import large_strain
import limits
import loads
import matplotlib.image
import metals
import numpy as np
import pytest
import sections
import stir
import study
from accuracy_cost import SCENES, Run
from evp import calibration, run, specimen
from evp.report import write_csv
from evp.run import CHECKOUT, DECKS
from metals import METALS
from study import Study, section_marks, split_at_marks

# ---- stir: what is left behind the pin ----


def lattice_plate(gone=()):
    """Spheres of 1 mm on a cubic lattice as a plate that the pin has passed along its whole length; without some of them."""
    run = stir.Stirred.__new__(stir.Stirred)
    x, y, z = (values.ravel() for values in np.meshgrid(np.arange(0.5, 12), np.arange(-7.5, 8), np.arange(-2.0, 2.5), indexing="ij"))
    stays = ~np.isin(np.arange(len(x)), gone)
    run.state = {name: 1e-3 * values[stays] for name, values in (("x", x), ("y", y), ("z", z), ("radius", np.full(len(x), 0.5)))}
    run.state.update(type=np.ones(int(stays.sum())), temperature=np.full(int(stays.sum()), 500.0))
    run.wake = {"top": 2.5e-3, "path_start": 1e-3, "path_end": 11e-3}
    return run, 1e-3 * np.stack([x, y, z], axis=1)


def test_wake_of_a_lattice():
    """It is solid to pi/6 everywhere, without voids; a hole is a void and a column of its own, and spheres that lie on top are out."""
    whole, at = lattice_plate()
    void, solid, least, out = whole.wake_measures()
    assert (void, out) == (0.0, 0.0) and (solid, least) == (pytest.approx(np.pi / 6, rel=0.01), pytest.approx(np.pi / 6, rel=0.06))
    hole = np.flatnonzero((np.abs(at[:, 0] - 4e-3) < 1e-3) & (np.abs(at[:, 1] + 1.5e-3) < 1.1e-3) & (at[:, 2] > -0.5e-3))
    holed, _ = lattice_plate(hole)
    void_now, solid_now, least_now, _ = holed.wake_measures()
    assert 0.005 < void_now < 0.2 and solid_now < solid and least_now < 0.5 * least
    whole.state["z"][:10] += 6e-3
    assert whole.wake_measures()[3] == pytest.approx(10 / len(at))
    assert len(whole.near(3e-3)) > 10 and np.all(whole.near(3e-3) == 500.0)


# ---- any_body: which differences it judges ----


def page_of(off):
    """Values of the section of bodies whose difference is off[N]; the cylinder has none."""
    found = {(body, n): 2e10 * (1.0 + (0.0 if body == next(iter(any_body.BODIES)) else share)) for n, share in off.items() for body in any_body.BODIES}
    return any_body.page(found, "some.evp:row")


def test_which_differences_are_judged():
    """Those within what is allowed, those beyond by the name of the body; few spheres show the trend only."""
    values = page_of({2000: 0.02, 8000: -0.01})
    assert (values["fewest"], values["most"], values["worst"], values["verdict"]) == (2000, 8000, "2.0", "all are within their limits.")
    assert "20.40 (+2.0 %)" in values["table"][1][1]
    assert page_of({2000: 0.04, 8000: 0.0})["verdict"] == "beyond their limits: cylinder 5 x 2 mm with 2000 spheres."
    assert page_of({500: -0.2, 2000: 0.01})["worst"] == "1.0"


# ---- large_strain ----


def columns(case):
    """A run whose stress is 0.9 of the metal's, whose energies are a fifth more than the work, with two joins and one end per sphere and strain, and 6 bonds per sphere left."""
    strain = np.linspace(0.0, case.end, round(100 * case.end) + 1)
    stress, count = 0.9 * large_strain.of_metal(strain) * (strain > 0.0), case.spheres * strain
    return {"strain": strain, "shear_stress": stress, "pressure": np.full_like(strain, 2e8), "spent": 1.2 * 0.01 * np.cumsum(stress) * large_strain.VOLUME, "plastic": count,
            "bonds": np.full_like(strain, 3.0 * case.spheres), "joined": 2.0 * count, "ended": count, "nearest": 0.5 + 0.1 * (strain == 0.0)}


def test_numbers_of_a_known_run():
    values = large_strain.page({case: columns(case) for case in large_strain.PLAN}, dict.fromkeys(large_strain.PLAN, 0.25))
    header, rows = values["table"]
    assert rows[0] == ("join 1.2", 1000, 1, *["0.90"] * 5, rows[0][8], "200", "6.0", "2.00", "1.00", "0.50", "+20.00", "") and rows[0][8].startswith("-10 at ")
    assert len(header) == len(rows[0]) == len(rows[-1]) and rows[1][-1] == "25"
    assert (values["verdict"], values["largest"], values["packings"], values["loose"], values["literal"], values["join"]) == ("is", "10 to 10", 3, "0.90", "0.90", "0.90 to 0.90")
    assert values["beyond"][1] == [(name, "0.90", "0.90", "0.90", "6.0", "0.50", "+20.00", "25") for name in ("of the row", "continued to 6")]
    assert large_strain.of_metal(np.sqrt(3.0)) == pytest.approx(691e6 / np.sqrt(3.0))


def test_the_largest_difference_has_its_strain():
    """Of means over 0.1. What is before 0.05 does not count."""
    found = columns(large_strain.FAR)
    found["shear_stress"][300:310] *= 0.5
    assert large_strain.numbers(found, large_strain.FAR)["largest difference [%]"] == "-55 at 3.05"
    found["shear_stress"][300:310], found["shear_stress"][:6] = found["shear_stress"][310], 0.0
    assert large_strain.numbers(found, large_strain.FAR)["largest difference [%]"].startswith("-1")


# ---- limits ----


def test_what_updates_change_of_known_runs():
    """Those with update 10 and 40 are off by 1 and 4 % at the first of two strains, the bar is a tenth shorter with 40."""
    shear, bar = limits.CASES[1], limits.CASES[3]
    found = {(shear, update, 0.4): limits.Found((20.0 * factor, 30.0), 1e-4, 2e-4, 1.0, 100) for update, factor in ((1, 1.0), (10, 0.99), (40, 0.96))}
    found.update({(bar, update, 0.2): limits.Found((20.0 if update < 40 else 18.0,), 0.0, 1e-3, 1.0, 100) for update in limits.UPDATES})
    (header, rows), largest = limits.changes(found)
    assert len(header) == len(rows[0]) and rows == [
        (shear.name, "aluminium_1100O", "500", "0.4", "1.0e-03", "20.0 MPa at 0.01, 30.0 MPa at 0.1", "-1.00, +0.00", "-4.00, +0.00", "0.020, 0.020, 0.020"),
        (bar.name, "copper_taylor", "", "0.2", "", "20.00 mm long", "+0.00", "-10.00", "0.100, 0.100, 0.100")]
    assert largest == {10: ("1.0", "0.0"), 40: ("10.0", "4.0")}
    assert limits.within(found) == "0.0"  # 1e-3 in 10 steps is a tenth of the first strain, a hundredth of the second


def test_rows_of_the_updates_are_shipped():
    """Whole, and with what is added."""
    rows = [limits.coefficients(case.row, case.more) for case in limits.CASES]
    assert all(len(row.split()) > 20 and row.split()[1:3] == ["8", "4"] for row in rows) and rows[-1].endswith(" rate 0.014 1")


# ---- sections of finite elements, for what_to_believe ----


def test_section_of_an_upset_cylinder_has_its_volume_and_plastic_strain():
    """Both are what the table of the same run has; what is flat stays flat in rings, and the outline leaves the axis out."""
    cells = sections.read_cells(study.STUDIES / "fe" / "upset_steel_304_mu0.1_section.csv")
    a, b = cells.corners[:, 2] - cells.corners[:, 0], cells.corners[:, 3] - cells.corners[:, 1]
    volume = np.pi * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * cells.corners[:, :, 0].mean(axis=1)
    assert volume.sum() == pytest.approx(np.pi * 10.0**2 * 15.0, rel=4e-3), "it is pressed by 0.2 % of it"
    table = np.genfromtxt([line for line in (study.STUDIES / "fe" / "upset_steel_304_mu0.1.csv").read_text().splitlines() if line[0] != "#"], delimiter=",", names=True)
    assert np.average(cells.plastic, weights=volume) == pytest.approx(table["p_mean"][-1], rel=2e-3)
    assert sections.mean_in_rings(*cells.top(), [(1.0, 4.0), (5.0, 9.0)]) == pytest.approx([7.5, 7.5], abs=2e-3), "the plate is touched by 0.001 mm"
    edge = sections.outline(cells.mirrored((1, -1)))
    assert np.abs(edge[:, :, 0]).max() == pytest.approx(table["radius_middle"][-1], abs=1e-3) and np.abs(edge[:, :, 1]).max() == pytest.approx(7.5, abs=0.02)
    assert not np.any(np.all(np.abs(edge[:, :, 1]) < 1e-9, axis=1)), "the halves have no edge between them"


def test_means_in_rings_are_by_area():
    assert sections.mean_in_rings([0.0, 10.0], [0.0, 10.0], [(0.0, 3.0), (4.0, 6.0)]) == pytest.approx([2.0, (216 - 64) / 1.5 / (36 - 16)], rel=1e-3)


# ---- metals ----

def test_what_is_off_the_flow_curve_is_told():
    """6 % too strong in tension, 4 % too weak in compression, 7 % too weak in shear: bold and told where it is beyond 5, 5 and 6 %."""
    targets, runs = metals.targets_of(METALS["steel_4340"]), {}
    for way, factor, end in (("tension", 1.06, 0.22), ("compression", 0.96, 0.62)):
        strain = np.linspace(0.0, end, 4001)
        runs[way] = calibration.Run(strain, factor * targets.curve.true_stress(strain, targets.modulus))
    strain = np.linspace(0.1, 3.1, 400)
    runs["shear"] = calibration.Run(strain, 0.93 * targets.curve.at(strain / np.sqrt(3.0)) / np.sqrt(3.0))
    there = np.linspace(0.0, 0.02, 101)
    bulk = targets.modulus / (3.0 * (1.0 - 2.0 * targets.nu))
    squeezed = metals.Squeezed(np.concatenate([there, there[::-1]]), bulk * np.concatenate([0.9 * there, 1.2 * there[::-1] - 0.001]), np.full(202, 1e-3))
    values = metals.page({"steel_4340": {2: (calibration.Moduli(1.03 * targets.modulus, targets.nu, 0.0, 0.0), runs)}}, {"steel_4340": squeezed})
    header, rows = values["stresses"]
    assert header[3:] == ("0.2 % yield", "0.5 %", "1 %", "2 %", "5 %", "10 %", "20 %", "30 %", "40 %", "60 %")
    assert rows[0][2:] == ("tension", "+6.4", "**+6.0**", "**+6.0**", "**+6.0**", "**+6.0**", "**+6.0**", "**+6.0**", "", "", "")
    assert rows[1][4:] == ("-4.0",) * 9
    assert values["shear"][1] == [("steel_4340", 2, *("**-7.0**",) * 4)]
    assert values["elastic"][1] == [("steel_4340", 2, "**+3.0**", "+0.0")]
    assert values["pressed"][1][0][2:] == ("-10", "-10", "-10", "-10", "0.08", "1.0e-03")
    told = values["missed"].splitlines()
    assert len(told) == 1 + 6 + 4 and "- tension, at 5 %: 1 of 1 are off by more than 5 %, from +6.0 to +6.0 %." in told


@pytest.mark.parametrize("name", METALS)
def test_shipped_rows_are_of_these_targets(name):
    """The command in the comment of each row asks for the targets of the metal; the row has its density."""
    lines = (CHECKOUT / "potentials" / "metals.evp").read_text(encoding="utf-8").splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith(f"{name} "))
    words = lines[at].split()
    assert float(words[words.index("density") + 1]) == METALS[name].density
    assert " ".join(METALS[name].words) in lines[at - 1]
    assert lines[0].startswith("# UNITS: si ") and "/" not in lines[at - 1].split("by: ")[1]


def test_shipped_rows_that_fail():
    lines = (CHECKOUT / "potentials" / "metals.evp").read_text(encoding="utf-8").splitlines()
    failing = metals.failing_rows(lines)
    assert len(failing) == 4 * len(metals.FAILURE) and lines[-len(failing):] == failing


# ---- study: runs that are kept, pages and sections from templates ----

VALIDATION = CHECKOUT / "doc" / "validation.md"


def test_runs_are_kept_until_their_command_changes(tmp_path):
    runs = study.Runs(tmp_path)
    words = ["bash", "-c", "echo x >> count; wc -l < count"]
    assert [int(runs.keep("a", words)) for _ in range(3)] == [1, 1, 1]
    assert int(runs.keep("a", [*words, "other"])) == 2
    with pytest.raises(study.RunError, match="b failed .exit 3."):
        runs.keep("b", ["bash", "-c", "exit 3"])
    assert not (tmp_path / "b.log").exists()


def test_page_of_a_template(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(study, "STUDIES", tmp_path)
    (tmp_path / "any.md").write_text("# $title\n\n$rows\n\n`$command` costs 5 $$\n", encoding="utf-8")
    one = study.Study("text", "any", spheres=[1, 2], xi=0.5).parse(["--spheres", "3", "--work", str(tmp_path / "w"), "--out", str(tmp_path / "out.md")])
    assert (one.spheres, one.xi) == ([3], 0.5)
    one.write(title="A", rows=(("a", "b"), [(1, 2)]))
    assert one.out.read_text(encoding="utf-8") == "# A\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n`doc/studies/any.py --spheres 3` costs 5 $\n" == capsys.readouterr().out
    with pytest.raises(ValueError, match="any.md has .rows, which any.py does not give"):
        one.write(title="A")


def test_section_of_a_page(tmp_path, monkeypatch):
    """What is around it stays. A page without its marks is an error before any run."""
    monkeypatch.setattr(study, "STUDIES", tmp_path)
    (tmp_path / "any.md").write_text("## $title\n", encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text("# Page\n\n<!-- any: doc/studies/any.py -->\nold\n<!-- end of any -->\n\n## Other\n", encoding="utf-8")
    one = study.Study("text", "any", "page").parse(["--work", str(tmp_path / "w"), "--out", str(page)])
    one.write(title="A")
    assert page.read_text(encoding="utf-8") == "# Page\n\n<!-- any: doc/studies/any.py -->\n## A\n<!-- end of any -->\n\n## Other\n"
    page.write_text("# Page\n", encoding="utf-8")
    with pytest.raises(ValueError, match="page.md must hold '<!-- any: doc/studies/any.py -->"):
        one.parse(["--work", str(tmp_path / "w"), "--out", str(page)])


TEMPLATES = sorted(study.STUDIES.glob("*.md"))


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.stem)
def test_page_is_that_of_its_template(template):
    """But for the numbers, which another machine may not write again."""
    page = CHECKOUT / "doc" / template.name
    text = page.read_text(encoding="utf-8") if page.exists() else split_at_marks(VALIDATION, *section_marks(template.stem, f"doc/studies/{template.stem}.py"))[1]
    fixed = re.split(r"\$\w+", template.read_text(encoding="utf-8"))
    assert re.fullmatch(r"[\s\S]*?".join(map(re.escape, fixed)), text)


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.stem)
def test_each_name_of_a_template_is_given_by_its_study(template):
    names = set(re.findall(r"(?<!\$)\$(\w+)", template.read_text(encoding="utf-8"))) - {"command"}
    source = template.with_suffix(".py").read_text(encoding="utf-8")
    assert names and all(re.search(rf"\b{name}\b", source) for name in names), names


# ---- accuracy_cost: what it chooses of known runs; its page and picture are those of its CSV ----

PAGE = CHECKOUT / "doc" / "accuracy_cost.md"
ROWS = accuracy.read(PAGE.with_suffix(".csv"))
COARSE, MIDDLE, FINE, RATE = "pace 4, increment 0.002", "pace 1, increment 0.002", "pace 0.3, increment 0.0005", "rate 50"
REFERENCE = "pace 0.05, increment 0.0005"
SECONDS = {COARSE: 1.0, MIDDLE: 2.0, RATE: 3.0, FINE: 4.0, REFERENCE: 9.0}


@pytest.mark.parametrize("errors, chosen", [
    ({COARSE: 3.0, MIDDLE: 0.6, RATE: 0.5, FINE: 0.01}, [COARSE, MIDDLE, FINE]),
    ({COARSE: float("nan"), MIDDLE: 0.7, RATE: -0.05, FINE: 0.01}, [MIDDLE, RATE, RATE]),
    ({COARSE: 9.0, MIDDLE: 8.0}, [None, None, None]),
])
def test_the_fastest_setting_that_keeps_its_bound_on_every_body(monkeypatch, errors, chosen):
    """With the margin, and not the reference itself. errors: of settings on the second body [%]; they have none on the first."""
    settings = {label: setting for label, setting in SCENES["cycle"].settings.items() if label in {*errors, REFERENCE}}
    monkeypatch.setitem(SCENES, "cycle", SCENES["cycle"]._replace(settings=settings))
    rows = [Run("cycle", label, 500, seed, SECONDS[label], 100, {"residual strain [%]": 10.0 * seed * (1.0 + 0.01 * errors.get(label, 0.0) * (seed == 2))})
            for label in settings for seed in accuracy.SEEDS]
    assert list(accuracy.chosen(rows, "cycle").values()) == chosen


def test_front_and_errors_between_those_measured(tmp_path, monkeypatch):
    """The front keeps what no other beats. Errors between those measured, and beyond."""
    assert accuracy.front(dict(zip("abcdef", [(1, 5), (2, 6), (3, 1), (2, 3), (4, 1), (5, 0.5)]))) == ["a", "d", "c", "f"]
    monkeypatch.setattr(cost, "MEASURED", tmp_path / "errors.csv")
    cost.MEASURED.write_text("deck,load,choice,value,error_percent\nin.x,pull,rate,1,4\nin.x,pull,rate,4,1\n", encoding="utf-8")
    found = [next(cost.errors(CHECKOUT / "in.x", f"in.x: rate {value}", 100)).rpartition("rate ")[2] for value in ("0.5", "1", "-2", "4", "9")]
    assert found == ["0.5 below 4 %", "1 4 %", "-2 2 %", "4 1 %", "9 above 1 %"]


def test_page_and_picture_are_of_the_csv(tmp_path, capsys):
    study = Study("text", "accuracy_cost").parse(["--work", str(tmp_path / "work"), "--out", str(tmp_path / PAGE.name)])
    accuracy.draw(study, ROWS)
    study.write(**accuracy.page(ROWS))
    assert capsys.readouterr().out == PAGE.read_text(encoding="utf-8")
    write_csv(tmp_path / "errors.csv", accuracy.FORECAST, accuracy.forecast(ROWS))
    assert (tmp_path / "errors.csv").read_text(encoding="utf-8") == cost.MEASURED.read_text(encoding="utf-8"), "what cost.py reads"
    assert (tmp_path / "figures" / "accuracy_cost.png.csv").read_text(encoding="utf-8") == (PAGE.parent / "figures" / "accuracy_cost.png.csv").read_text(encoding="utf-8")


def test_bounds_hold_on_the_unseen_body():
    for scene in SCENES:
        for bound, label in accuracy.chosen(ROWS, scene).items():
            assert label is None or accuracy.largest(accuracy.errors(ROWS, scene, label, (accuracy.UNSEEN,))) <= accuracy.BOUNDS[bound], scene


def test_settings_are_choices_of_their_decks():
    """LAMMPS passes over a misspelled -var."""
    for setting in (one for scene in SCENES.values() for one in scene.settings.values()):
        deck = (DECKS / setting.deck).read_text(encoding="utf-8")
        assert all(re.search(rf"^variable +{name} +index |^evp_choices .* {name}\?", deck, re.M) for name in setting.choices), setting


# ---- first_look: its choices, its curves, what it draws ----

FIGURES = PAGE.parent / "figures"


def stored_curves():
    """{label: (true strain, true stress [MPa])} of the picture in the README."""
    rows = [line.rsplit(",", 2) for line in (FIGURES / "first_look.png.csv").read_text(encoding="utf-8").splitlines()[1:]]
    found = {}
    for label, strain, stress in rows:
        found.setdefault(label.strip('"'), []).append((float(strain) / 100, float(stress)))
    return {label: np.array(points).T for label, points in found.items()}


def test_choices_are_known():
    """Of each deck; LAMMPS passes over a misspelled -var."""
    for _, words in first_look.commands(300, 600):
        if "-in" in words:
            deck = open(words[words.index("-in") + 1], encoding="utf-8").read() + (run.DECKS / "frames.lmp").read_text(encoding="utf-8")
            names = [words[k + 1] for k, word in enumerate(words) if word == "-var"]
            assert len(names) > 3 and all(re.search(rf"^variable +{name} +index |^evp_choices .* {name}\?", deck, re.M) for name in names)


def test_picture_has_a_metal_on_its_flow_curve_in_all_ways():
    """From a strain of 0.02 on."""
    (label, metal), *ways = stored_curves().items()
    assert "flow curve" in label and [name for name, _ in ways] == ["tension", "compression", "shear"]
    for (name, (strain, stress)), (end, within) in zip(ways, ((0.15, 0.08), (0.45, 0.06), (2.2, 0.1))):
        assert strain[-1] > end
        far = strain > 0.02
        assert stress[far] == pytest.approx(np.interp(strain[far], *metal), rel=within), name


def test_it_draws_what_the_runs_left(tmp_path):
    """A picture as large as that of the README, and the curves beside it."""
    for name, end in first_look.ENDS.items():
        strain = np.linspace(0.0, end, 21)
        (tmp_path / f"{name}.csv").write_text("strain,stress\n" + "".join(f"{a:.6g},{1e9 * a:.6g}\n" for a in strain), encoding="utf-8")
    strain = np.linspace(0.0, 4.0, 101)
    (tmp_path / "shear.csv").write_text("strain,shear_stress\n" + "".join(f"{a:.6g},{1e8 * a:.6g}\n" for a in strain), encoding="utf-8")
    for name, columns in (("part_state", [(0.0, 0.01, 0.02)]), ("impact_frames", [(0.0, 0.0, 0.0), (0.0, 0.1, 0.2)])):
        text = [inputs.snapshot("id x y z radius plastic_strain", [(k, 0.002 * k, 0.001, 0.001 * step, 0.001, value) for k, value in enumerate(strains, 1)],
                                step, "ITEM: UNITS\nsi") for step, strains in enumerate(columns)]
        (tmp_path / f"{name}.dump").write_text("".join(text), encoding="utf-8")
    drawn = matplotlib.image.imread(first_look.compose(tmp_path, tmp_path / "out"))
    stored = matplotlib.image.imread(FIGURES / "first_look.png")
    assert drawn.shape == stored.shape and np.mean(np.abs(drawn - stored)) > 0.02, "another picture, of the same size"
    kept = (tmp_path / "out" / "first_look.png.csv").read_text(encoding="utf-8").splitlines()
    assert kept[-1] == f"shear,{100 * np.mean(strain[-first_look.SMOOTH:]) / 3**0.5:.6g},{100 * np.mean(strain[-first_look.SMOOTH:]) * 3**0.5:.6g}"
    assert (FIGURES / "first_look.png").stat().st_size < 250e3


# ---- loads: closed forms against integrals, shares of bonds whose places are known; strains of the middle of a body ----

RADIUS, HEIGHT = 0.02, 0.02


def test_torque_is_the_integral_of_the_shear_stress():
    r = (np.arange(2000) + 0.5) * RADIUS / 2000
    integral = np.sum(0.4 * 21e9 * r * 0.001 / 0.04 * r * 2.0 * math.pi * r) * RADIUS / 2000
    assert loads.torque(21e9, RADIUS, 0.04, 0.001) == pytest.approx(integral, rel=1e-6)


def test_deflection_is_the_integral_of_curvature_and_shear():
    beam = loads.Beam(21e9, 0.01, HEIGHT, 0.08)
    x = (np.arange(4000) + 0.5) * 0.04 / 4000  # half the span, force 1 N, unit-load theorem
    bending = 2.0 * np.sum((0.5 * x) ** 2) * 0.04 / 4000 / (21e9 * 0.01 * HEIGHT**3 / 12.0)
    shear = 2.0 * 0.5**2 * 0.04 / (loads.KAPPA * 0.4 * 21e9 * 0.01 * HEIGHT)
    assert beam.deflection(1.0) == pytest.approx(bending + shear, rel=1e-6)
    assert beam.deflection(3.0, 0.5) == pytest.approx(3.0 * (2.0 * bending + shear), rel=1e-6)
    assert loads.KAPPA == pytest.approx(0.847, abs=5e-4)


@pytest.mark.parametrize("filled", [1.0, 0.9])
def test_shares_of_isotropic_bonds_that_fill_the_section_up_to_below_the_surface(filled):
    rng = np.random.default_rng(1)
    n = rng.normal(size=(400000, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    angle, r = rng.uniform(0.0, 2.0 * math.pi, len(n)), filled * RADIUS * np.sqrt(rng.uniform(size=len(n)))
    round_bar = loads.Bonds(np.stack([0.0 * r, r * np.cos(angle), r * np.sin(angle)], axis=1), n)
    assert loads.torsion_share(round_bar, RADIUS) == pytest.approx(filled**2, rel=0.01)
    bar = loads.Bonds(rng.uniform(-0.5, 0.5, (len(n), 3)) * [0.1, 0.01, filled * HEIGHT], n)
    assert loads.bending_share(bar, HEIGHT) == pytest.approx(filled**2, rel=0.01)


def test_bonds_are_pairs_in_the_zone_with_their_middle_in_the_part():
    x = np.array([[0.0, 0.0, 0.0], [1.4, 0.0, 0.0], [3.0, 0.0, 0.0], [4.12, 0.0, 0.84]])
    body = specimen.Specimen(None, None, np.full(4, 0.5), None, x, None)
    found = loads.find_bonds(body, 1.5, 0.0, 5.0)
    assert found.middle == pytest.approx(np.array([[0.7, 0.0, 0.0], [3.56, 0.0, 0.42]]))
    assert found.direction == pytest.approx(np.array([[1.0, 0.0, 0.0], [0.8, 0.0, 0.6]]))
    assert len(loads.find_bonds(body, 1.5, 1.0, 5.0).middle) == 1


def test_middle_strains_of_an_affine_body():
    """Those of the displacement's slopes, whatever happens beyond 0.3 and 0.7 of the length."""
    x = np.random.default_rng(1).uniform(-0.02, 0.02, (400, 3)) + [0.025, 0.0, 0.0]
    body = specimen.Specimen(np.arange(1, 401), np.ones(400), np.ones(400), np.ones(400), x, np.zeros((3, 2)))
    moved = x * [1.01, 0.997, 0.999]
    moved[x[:, 0] > 0.036] += 0.01
    assert specimen.middle_strains(body, moved) == pytest.approx((0.01, -0.002), rel=1e-10)
