# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/accuracy_cost.py: what it chooses of known runs; its page and picture are those of its CSV; settings are choices of the decks."""

import re

import accuracy_cost as accuracy
import cost
import pytest
from accuracy_cost import SCENES, Run
from evp.report import write_csv
from evp.run import CHECKOUT, DECKS
from study import Study

PAGE = CHECKOUT / "doc" / "accuracy_cost.md"
ROWS = accuracy.read(PAGE.with_suffix(".csv"))
COARSE, MIDDLE, FINE, RATE, REFERENCE = "increment 0.004", "increment 0.002", "increment 0.001", "rate 50", "increment 0.0001"
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


def test_front_and_errors_between_those_measured():
    """The front keeps what no other beats."""
    assert accuracy.front(dict(zip("abcdef", [(1, 5), (2, 6), (3, 1), (2, 3), (4, 1), (5, 0.5)]))) == ["a", "d", "c", "f"]
    rows = [{"value": "1", "error_percent": "4"}, {"value": "4", "error_percent": "1"}]
    assert [pytest.approx(cost.interpolated(rows, value)) for value in (0.5, 1, 2, 4, 9)] == [4, 4, 2, 1, 1]


def test_page_and_picture_are_of_the_csv(tmp_path, capsys):
    study = Study("text", "accuracy_cost").parse(["--work", str(tmp_path / "work"), "--out", str(tmp_path / PAGE.name)])
    accuracy.draw(study, ROWS)
    study.write(**accuracy.page(ROWS))
    assert capsys.readouterr().out == PAGE.read_text(encoding="utf-8")
    write_csv(tmp_path / "errors.csv", accuracy.FORECAST, accuracy.forecast(ROWS))
    assert (tmp_path / "errors.csv").read_text(encoding="utf-8") == cost.MEASURED.read_text(encoding="utf-8"), "what cost.py reads"
    assert (tmp_path / "figures" / "accuracy_cost.csv").read_text(encoding="utf-8") == (PAGE.parent / "figures" / "accuracy_cost.csv").read_text(encoding="utf-8")


def test_bounds_hold_on_the_unseen_body():
    for scene in SCENES:
        for bound, label in accuracy.chosen(ROWS, scene).items():
            assert label is None or accuracy.largest(accuracy.errors(ROWS, scene, label, (accuracy.UNSEEN,))) <= accuracy.BOUNDS[bound], scene


def test_settings_are_choices_of_their_decks():
    """LAMMPS passes over a misspelled -var."""
    for setting in (one for scene in SCENES.values() for one in scene.settings.values()):
        deck = (DECKS / setting.deck).read_text(encoding="utf-8")
        assert all(re.search(rf"^variable +{name} +index |is_defined\(variable,{name}\)", deck, re.M) for name in setting.choices), setting
