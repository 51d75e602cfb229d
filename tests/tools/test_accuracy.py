# SPDX-License-Identifier: GPL-2.0-only
"""What doc/studies/accuracy_cost.py makes of its results: measures, front, choice, extrapolation, budget; its page agrees with its CSV."""

import csv
import pathlib

import accuracy_cost
import numpy as np
import pytest
import accuracy_cases as cases
import accuracy_report as report
import accuracy_run as runs
from evp.curves import Curve
from in_process import call

CHECKOUT = pathlib.Path(__file__).resolve().parents[2]
DOC = CHECKOUT / "doc" / "accuracy_cost.md"


def tool(*words):
    return call(accuracy_cost.main, *words)


def bent(strain):
    """A curve that yields about 0.5 %: its second derivative would spoil a straight line's value."""
    return 20e9 * 0.005 * np.tanh(strain / 0.005)


@pytest.mark.parametrize("row, tolerance", [(1e-4, 2e-4), (5e-4, 1e-9), (1e-3, 1e-9)])
def test_stresses_have_no_bias_by_curvature(row, tolerance):
    """Dense rows: the fourth-order rest of a parabola; rows on the strain itself: the row. Too coarse ones are seen at 0.77 %."""
    strain = np.arange(0, round(0.02 / row) + 1) * row
    found = runs.measures(Curve(strain, bent(strain), bent(strain)))
    for name, at in (("stress_0.5pc_MPa", 0.005), ("stress_1pc_MPa", 0.01)):
        assert found[name] == pytest.approx(1e-6 * bent(at), rel=tolerance), name
    between = abs(found["stress_0.77pc_MPa"] / (1e-6 * bent(0.0077)) - 1.0)
    assert between < (2e-4 if row < 1e-3 else 1e-2)
    line = 20e9 * strain
    assert runs.measures(Curve(strain, line, line))["E_GPa"] == pytest.approx(20.0)


def test_rows_too_coarse_for_a_tangent():
    strain = np.arange(5) * 0.005
    found = runs.measures(Curve(strain, bent(strain), bent(strain)))
    assert np.isnan(found["first_yield_strain"]) and np.isfinite(found["E_GPa"])
    assert abs(found["stress_0.77pc_MPa"] / (1e-6 * bent(0.0077)) - 1.0) > 0.01, "their error between the rows is seen"


def row(knob, choice, stress, seconds, seed=1, spheres=500, baseline=2.0):
    numbers = {**{name: "1" for name in report.NUMBERS}, **{name: str(stress) for name in report.STRESSES}}
    return {"knob": knob, "choice": choice, "spheres": str(spheres), "seed": str(seed), "kind": "timed", "ranks": "1", "seconds": str(seconds),
            "baseline_seconds": str(baseline), "start_seconds": "1", "energy_open": "", "lammps": "1 Jan 2030", "processor": "fast", **numbers}


def sweep():
    """Two bodies: the target, a good way, a fast way that is wrong on one body, a fast one that changes the model, a slow good one."""
    rows = []
    for seed, wrong in ((1, 1.0), (2, 1.02)):
        rows += [row(*report.TARGET, 100.0 * seed, 200, seed), row(*report.RECIPE, 100.0 * seed, 100, seed),
                 row("implicit", "1e-5 s", 100.03 * seed, 4, seed), row("rate", "10/s", 100.0 * seed * wrong, 1, seed),
                 row("contact", "none", 100.0 * seed, 0.5, seed), row("implicit", "1e-6 s", 100.0 * seed, 8, seed)]
    return rows


def test_the_cheapest_choice_that_keeps_its_promise_on_every_body():
    results = report.Results(sweep())
    chosen = {promise: (choice.knob, choice.name) for promise, choice in results.recommended().items()}
    assert chosen == {1.0: ("implicit", "1e-5 s"), 0.5: ("implicit", "1e-5 s"), 0.1: ("implicit", "1e-5 s")}
    assert results.cheaper(results.recommended()[1.0]) == pytest.approx((25.0, 101.0 / 5.0))


def test_the_target_is_no_choice():
    """It has no error against itself, so that it would keep every promise."""
    rows = [entry for entry in sweep() if (entry["knob"], entry["choice"]) in (report.TARGET, ("rate", "10/s"))]
    assert set(report.Results(rows).recommended().values()) == {None}


def test_choice_that_was_not_run_on_every_body_is_not_recommended():
    rows = [entry for entry in sweep() if not (entry["choice"] == "1e-5 s" and entry["seed"] == "2")]
    assert report.Results(rows).recommended()[1.0].name == "1e-6 s"


def test_unseen_body_that_breaks_a_promise_is_shown():
    seed = cases.CHECK_SEED
    kept = sweep() + [row(*report.TARGET, 50.0, 200, seed), row("implicit", "1e-5 s", 50.02, 4, seed)]
    broken = kept[:-1] + [row("implicit", "1e-5 s", 51.0, 4, seed)]
    assert "| met |" in report.page(report.Results(kept), "x.csv", "x.png") and "NOT met" not in report.page(report.Results(kept), "x.csv", "x.png")
    assert "NOT met" in report.page(report.Results(broken), "x.csv", "x.png")
    assert report.Results(kept).target.by_seed.keys() == {1, 2}, "the unseen body takes no part in the choice"


def test_front_keeps_what_no_other_beats():
    assert report.front([(1, 5), (2, 6), (3, 1), (2, 3), (4, 1), (5, 0.5)]) == [(1, 5), (2, 3), (3, 1), (5, 0.5)]


def test_extrapolation_finds_the_limit_of_a_surface_law():
    """Sure of it by leaving one out, unsure by the other powers: the bound holds for data of either power."""
    for power in report.POWERS:
        rows = [row("particles", str(n), 170.0 * (1 - 2.0 * n**power), 1, seed, n) for n in (500, 2000, 4000, 8000, 32000) for seed in (1, 2)]
        limit, unsure = report.extrapolate(report.Results(rows).sizes, report.STRESS)
        assert abs(limit - 170.0) <= 1.001 * unsure + 1e-9, power
        if power == -1 / 3:
            assert limit == pytest.approx(170.0)
    assert report.extrapolate(report.Results(rows[:6]).sizes, report.STRESS) is None


def test_budget_drops_the_least_important_first():
    plan = cases.all_cases()
    whole = sum(runs.expected_seconds(case, 0.3) for case in plan)
    every, spent = runs.within_budget(plan, {}, whole + 1.0, 0.3)
    assert every == plan and spent == pytest.approx(whole)
    some, spent = runs.within_budget(plan, {}, 0.6 * whole, 0.3)
    left_out = [case for case in plan if case not in some]
    assert left_out and all(case.priority > 1 for case in left_out)
    cheapest = min(runs.expected_seconds(case, 0.3) for case in left_out if case.priority == min(case.priority for case in left_out))
    assert spent + cheapest > 0.6 * whole, "nothing that fits is left out before what is less important"
    assert [case for case in plan if case in some] == some, "in the order of the plan"
    known = {case.key: {} for case in plan}
    assert runs.within_budget(plan, known, 1.0, 0.3) == (plan, 0.0), "what is there costs nothing"


def test_results_cut_short_are_read_up_to_the_last_whole_line(tmp_path):
    path = tmp_path / "results.csv"
    rows = [{name: entry.get(name, "1") for name in runs.COLUMNS} for entry in sweep()]
    runs.write_csv(path, runs.COLUMNS, rows)
    whole = runs.read_results(path)
    assert len(whole) == len(rows)
    path.write_text(path.read_text()[:-3])
    assert runs.read_results(path) == dict(list(whole.items())[:-1])


def test_pull_that_ended_early_is_no_curve():
    strain = np.arange(100) * 1e-4
    with pytest.raises(runs.RunError, match="ended at a strain of 0.0099"):
        runs.measures(Curve(strain, bent(strain), bent(strain)))


def test_only_a_folder_of_its_own_is_emptied(tmp_path):
    """--fresh takes away what the tool wrote and nothing else; a folder of somebody else is refused."""
    (tmp_path / "thesis.tex").write_text("mine")
    laboratory = object.__new__(runs.Laboratory)
    laboratory.folder = tmp_path
    with pytest.raises(runs.RunError, match="files of others"):
        laboratory.own_or_refuse(fresh=True)
    for name in ("stamp", "results.csv", "specimen_500_1.data"):
        (tmp_path / name).write_text("ours")
    (tmp_path / "run").mkdir()
    laboratory.own_or_refuse(fresh=True)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_every_case_has_a_key_of_its_own_and_every_knob_its_reference():
    plan = cases.all_cases()
    assert len({case.key for case in plan}) == len(plan)
    for name, knob in cases.KNOBS.items():
        names = {case.choice for case in plan if case.knob == name}
        assert names and (not knob.reference or knob.reference in names), name
    assert {cases.TARGET, cases.RECIPE} <= {(case.knob, case.choice) for case in plan}


def test_page_in_the_docs_is_that_of_its_csv(tmp_path):
    page = tmp_path / "accuracy_cost.md"
    run = tool("--table", DOC.with_suffix(".csv"), "--out", page)
    assert run.returncode == 0, run.stderr
    assert page.read_text(encoding="utf-8") == DOC.read_text(encoding="utf-8")
    drawn = (tmp_path / "figures" / "accuracy_cost.csv").read_text(encoding="utf-8")
    assert drawn == (DOC.parent / "figures" / "accuracy_cost.csv").read_text(encoding="utf-8")


def test_promises_of_the_page_were_kept_on_the_unseen_body():
    with open(DOC.with_suffix(".csv"), newline="", encoding="utf-8") as source:
        results = report.Results(csv.DictReader(source))
    target = results.checks[report.TARGET]
    for promise, choice in results.recommended().items():
        assert choice is not None, promise
        assert report.worst_stress(results.checks[choice.knob, choice.name], target) <= promise, promise
    assert results.cheaper(results.recommended()[0.5])[0] >= 20.0


@pytest.mark.parametrize("words, message", [
    (("--budget", "0"), "--budget must be positive"),
    (("--quick",), "need --out"),
    (("--table", "some.csv"), "need --out"),
    (("--quick", "--out", "page.csv"), "must be a .md file"),
    (("--quick", "--out", "absent/page.md"), "must be a .md file in an existing folder"),
    (("--table", "absent.csv", "--out", "page.md"), "absent.csv"),
    (("--table", __file__, "--out", "page.md"), "not a table of results"),
])
def test_misuse(words, message):
    run = tool(*words)
    assert run.returncode != 0 and message in run.stderr and "Traceback" not in run.stderr
