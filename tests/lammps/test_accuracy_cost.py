# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/accuracy_cost.py --quick: its runs show the orders and the monotonicity that theory asks for; a second call runs nothing."""

import csv
import math
import os
import pathlib
import subprocess
import sys

import pytest
import accuracy_cases as cases

CHECKOUT = pathlib.Path(__file__).resolve().parents[2]
STRESS = "stress_1pc_MPa"


def quick(folder):
    environment = {**os.environ, "PYTHONPATH": str(CHECKOUT / "tools")}
    words = ["--quick", "--work", str(folder / "work"), "--out", str(folder / "page.md")]
    return subprocess.run([sys.executable, str(CHECKOUT / "doc" / "studies" / "accuracy_cost.py"), *words], env=environment, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=240)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("accuracy")
    run = quick(folder)
    assert run.returncode == 0, run.stderr[-2000:]
    assert "about" in run.stderr and "left" in run.stderr, "progress with the time left"
    return folder


@pytest.fixture(scope="module")
def rows(folder):
    """{(knob, choice, spheres, kind): row} of the CSV beside the page."""
    with open(folder / "page.csv", newline="", encoding="utf-8") as source:
        return {(row["knob"], row["choice"], row["spheres"], row["kind"]): row for row in csv.DictReader(source)}


def stress(rows, knob, choice):
    return float(rows[knob, choice, "500", "timed"][STRESS])


def test_energy_balance_is_of_second_order_in_the_step(rows):
    """Velocity Verlet's, at least; the kink of eq. 8 and pairs that break leave the exponent a half of room over two halvings."""
    opened = [float(rows["step", f"{share} of the limit", "500", "ledger"]["energy_open"]) for share in (0.8, 0.4, 0.2)]
    assert opened[0] > opened[1] > opened[2] > 0.0
    assert math.log(opened[0] / opened[2]) / math.log(4.0) > 1.5


def test_viscous_stress_is_proportional_to_the_rate(rows):
    """The damped curves at 1, 5 and 10/s: E tau rate, so 9/4; paths over pairs that break differ by a few percent of it."""
    slow = stress(rows, "implicit", "1e-5 s")
    ratio = (stress(rows, "damped rate", "10/s") - slow) / (stress(rows, "damped rate", "5/s") - slow)
    assert ratio == pytest.approx(9.0 / 4.0, rel=0.1)


def test_general_exponents_are_the_same_law(rows):
    """Exponents 1e-7 higher change energies and forces by some 1e-7; the path of 500 spheres multiplies that."""
    assert stress(rows, "exponents", "8 4 by pow()") == pytest.approx(stress(rows, "exponents", "8 4"), rel=1e-5)


def test_increments_at_rest_agree(rows):
    """The state at rest is unique but for bonds at the edge of dlim: 0.3 % of the stress."""
    assert stress(rows, "increment", "0.001") == pytest.approx(stress(rows, "increment", "0.0005"), rel=3e-3)


def test_page_and_picture(folder):
    text = (folder / "page.md").read_text(encoding="utf-8")
    for word in ("Recommended settings", "Number of spheres", "Every setting by itself", "figures/page.png"):
        assert word in text, word
    assert (folder / "figures" / "page.png").stat().st_size > 20000


def test_results_that_are_there_are_not_run_again(folder):
    before = (folder / "page.csv").read_text(encoding="utf-8")
    run = quick(folder)
    assert run.returncode == 0 and "runs are already done" in run.stderr
    assert (folder / "page.csv").read_text(encoding="utf-8") == before


def test_results_of_another_program_are_refused(folder):
    (folder / "work" / "stamp").write_text("another", encoding="utf-8")
    run = quick(folder)
    assert run.returncode != 0 and "--fresh" in run.stderr and "Traceback" not in run.stderr


def test_energy_and_virial_are_asked_for_at_every_step():
    """Of the hook: Nevery 1, and as many repeats as steps between two outputs."""
    words = next(line for line in cases.EVERY_STEP.splitlines() if "ave/time" in line).split()
    assert words[4] == "1" and words[5] == words[6]
