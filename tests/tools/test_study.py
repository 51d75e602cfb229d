# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies: what the pages of any_body, large_strain, metals and notched_tension say of known runs; shipped rows, commands and targets belong together."""

import re

import any_body
import large_strain
import metals
import notched_tension
import numpy as np
import pytest
import study
from evp.curves import Curve
from evp.run import CHECKOUT, RunError
from metals import METALS
from notched_tension import CONSTANT, INVERSE, POWER

# ---- any_body: which differences it judges ----


def page_of(off):
    """Values of the page of bodies whose difference is off[N]; the cylinder has none."""
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


def columns(stress, plastic):
    """A run to a strain of 3 of constant stress [MPa], and dissipation per volume and strain [MPa]."""
    strain = np.linspace(0.0, 3.0, 301)
    found = {name: np.zeros(301) for name in large_strain.COLUMNS}
    found.update(strain=strain, shear_stress=stress * large_strain.MPA * (strain > 0.0), plastic=plastic * large_strain.MPA * large_strain.VOLUME * strain)
    found.update(spent=found["plastic"].copy())
    return found


def test_numbers_of_a_known_run():
    """A tenth of strain without stress in the last unit; the energies are a fifth more than the work."""
    found = columns(50.0, 60.0)
    top, early, late, lowest, _, plastic, *others, misfit = large_strain.numbers(found)
    assert (top, early, late, lowest, plastic, misfit) == pytest.approx((50.0, 50.0, 50.0, 50.0, 60.0, 20.0)) and not any(others)
    found["shear_stress"][251:261] = 0.0
    assert large_strain.numbers(found)[2:4] == pytest.approx([45.0, 0.0], abs=1e-9)
    values = large_strain.page({case: columns(40.0 + case.spheres / 100, 60.0) for case in large_strain.PLAN})
    assert (values["stress"], values["plastic"], values["literal"], values["spheres"]) == ("50 and 60", "60 and 60", "50", "1000 and 2000")
    header, rows = values["table"]
    assert all(len(row) == len(header) for row in rows) and rows[0][:4] == ("repulsive", 1000, "isotropic", "50") and rows[0][-1] == "+20.0"


# ---- metals ----

STEEL = METALS["steel_4340"]


def steel(factor, end):
    strain = np.linspace(0.0, abs(end), 401)
    return {"strain": strain, "stress": STEEL.law.nominal(np.sign(end) * strain) * factor(strain)}


@pytest.mark.parametrize("side", metals.SIDES)
def test_range_and_differences(side):
    """10 % too small up to 2 % but for 1 %, 2 % too large from there to 0.6 of the strains, 8 % beyond; what is below the yield strain does not count."""
    ends = metals.SIDES[side]
    last = 0.6 * abs(ends[-1])
    one = steel(lambda e: np.where(e < 0.02, np.where(np.abs(e - 0.01) < 1.1e-3, 1.0, 0.9), np.where(e < last, 1.02, 1.08)) * np.where(e < 0.004, 9.0, 1.0), ends[-1])
    (around, found), at = metals.far_cells(STEEL, one, side)[0].split(", "), list(metals.far_cells(STEEL, one, side)[1:])
    assert at == ["+2.0 %" if abs(end) <= last else "+8.0 %" for end in ends]
    assert all(abs(float(word) - 1.0) < 0.2 for word in around.split(" to "))
    begin, end = map(float, found.split(" to "))
    assert abs(begin - 2.0) < 0.15 and abs(end - 100.0 * last) < 0.15
    assert metals.far_cells(STEEL, steel(lambda e: 1.1, 0.1), "tension") == ("none", "+10.0 %", "+10.0 %", "at rest to 10.0 %"), "it ends early"


@pytest.mark.parametrize("name", METALS)
def test_shipped_rows_are_of_these_targets(name):
    """The command in the comment of each row asks for the targets of the metal; the row has its density."""
    lines = (CHECKOUT / "potentials" / "metals.evp").read_text(encoding="utf-8").splitlines()
    aims = metals.targets_of(METALS[name])
    at = next(k for k, line in enumerate(lines) if line.startswith(f"{name} "))
    words = lines[at].split()
    assert float(words[words.index("density") + 1]) == METALS[name].density
    assert " ".join(metals.words_of(aims)) in lines[at - 1]
    assert lines[0].startswith("# UNITS: si ") and "/" not in lines[at - 1].split("by: ")[1]


# ---- notched_tension ----

FEW, MORE = 4000, 16000


def curve(strain, stress):
    return Curve(strain, stress, stress)


def test_work_of_a_triangle():
    """Up to 200 MPa at 2 %, down to zero at 6 %: a tenth of the stress is left at 5.6 %."""
    strain = np.linspace(0.0, 0.08, 801)
    found = notched_tension.rupture_of(curve(strain, 200e6 * np.interp(strain, (0.0, 0.02, 0.06), (0.0, 1.0, 0.0))), 12)
    assert found.peak == pytest.approx(200.0) and found.at == pytest.approx(0.02) and found.strain == pytest.approx(0.056, abs=1.01e-4) and found.broken == 12
    assert found.work == pytest.approx((0.5 * 200e6 * 0.02 + 0.5 * (200e6 + 20e6) * 0.036) * 0.04 / 1e3, rel=5e-3)
    with pytest.raises(RunError, match="has not parted at a strain of 0.08"):
        notched_tension.rupture_of(curve(strain, 200e6 * np.interp(strain, (0.0, 0.02, 0.08), (0.0, 1.0, 0.2))), 12)


def test_exponent_of_a_known_law():
    """Work as spacing^0.5 XI^1.5, which XI ~ spacing^-(1/3) keeps; the table has a row for each case."""
    def bars(n, xi):
        return [(notched_tension.Rupture(200.0, 0.01, 0.02, scale * notched_tension.spacing(n) ** 0.5 * xi**1.5, 12), None) for scale in (995.0, 1005.0)]

    assert notched_tension.spacing(FEW) == pytest.approx(1.349, abs=1e-3)
    assert notched_tension.spacing(FEW) / notched_tension.spacing(8 * FEW) == pytest.approx(2.0)
    scaled = 0.05 * notched_tension.spacing(FEW) / notched_tension.spacing(MORE)
    results = {(n, xi, rule): bars(n, xi) for n, xi, rule in ((FEW, 0.05, CONSTANT), (MORE, 0.05, CONSTANT), (MORE, scaled, INVERSE))}
    p = notched_tension.exponent_of(results, FEW, MORE)
    assert p == pytest.approx(1.0 / 3.0, rel=1e-6)
    kept = 0.05 * (notched_tension.spacing(FEW) / notched_tension.spacing(MORE)) ** p
    values = notched_tension.page({**results, (MORE, kept, POWER): bars(MORE, kept)}, p, [FEW, MORE])
    assert [row[:2] + (row[4],) for row in values["table"][1]] == [(FEW, 2, CONSTANT), (MORE, 2, CONSTANT), (MORE, 2, INVERSE), (MORE, 2, POWER)]
    assert values["kept"] == values["works"].split(", ")[0] and values["p"] == "0.33"


# ---- study: runs that are kept, pages from templates ----


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


@pytest.mark.parametrize("template", sorted(study.STUDIES.glob("*.md")), ids=lambda path: path.stem)
def test_each_name_of_a_template_is_given_by_its_study(template):
    names = set(re.findall(r"(?<!\$)\$(\w+)", template.read_text(encoding="utf-8"))) - {"command"}
    source = template.with_suffix(".py").read_text(encoding="utf-8")
    assert names and all(re.search(rf"\b{name}\b", source) for name in names), names
