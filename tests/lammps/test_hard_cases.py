# SPDX-License-Identifier: GPL-2.0-only
"""The robustness tests on 1 and 2 ranks, short ones on 4; what each states is said at the scene, in hard_cases*.py, and with which fault it fails in tests/maintain/faults.py."""

import pathlib

import hard_cases_bodies  # noqa: F401  joins the list
import hard_cases_box  # noqa: F401  joins the list
import hard_cases_flow  # noqa: F401  joins the list
import hard_cases_spin  # noqa: F401  joins the list
import hard_cases_within  # noqa: F401  joins the list
import pytest
from faults import CASES as NOTICED
from faults import cases_of, read_faults
from hard_cases import CASES, Bench

MORE_RANKS_TOO_SLOW = ("times critical", "table 1 pulled", "threshold", "range", "exponents", "fragment", "head on impact: 1")  # steps without atoms to share
# Of a few steps. On two cores four ranks take turns at every message, which makes thousands of steps ten times as long as on two ranks.
SHORT = ("table 2 at the paper", "overlap", "all pairs at dlim", "ratio of", "coincident", "null component")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_hard_case(lmp, tmp_path, case):
    print(case.check(Bench(lmp, tmp_path, 1)))


@pytest.mark.parametrize("case", [case for case in CASES if not case.name.startswith(MORE_RANKS_TOO_SLOW)], ids=lambda case: case.name)
def test_hard_case_on_more_ranks(lmp, tmp_path, case):
    print(case.check(Bench(lmp, tmp_path, 4 if case.name.startswith(SHORT) else 2)))


def test_the_list_is_complete():
    names = " ".join(case.name for case in CASES)
    for word in ("critical", "paper", "50 percent", "rupture: literal", "rupture: repulsive", "rupture: none", "impact: 1", "impact: 500", "overlap",
                 "all pairs at dlim", "xi s", "dlim back and forth", "threshold strain: 1e-06", "threshold strain: 0.3", "10 in size", "1e4 in mass",
                 "spinning: implicit", "spinning cube", "spinning top", "off centre impact", "hold", "million", "coincident", "component of fix move: after", "cycled far",
                 "pushed and parted", "torn and pushed together: isotropic", "sorted", "past its cutoff in one step: none", "stops early", "volume energy",
                 "sheared box", "brought together: literal", "ball hits block", "alpha: 1.05", "alpha: 3", "exponents: 2 1", "exponents: 24 12"):
        assert word in names, word


def test_every_case_notices_a_fault_and_every_fault_has_cases():
    """tests/maintain/faults.py builds them."""
    faults = read_faults(pathlib.Path(__file__).resolve().parents[2] / "src")
    assert list(faults) == list(NOTICED) and len(faults) > 30
    for name, fault in faults.items():
        assert len(fault.files) == 1, f"{name} stands in {fault.files}"
        assert cases_of(name, CASES), name
    assert {case.name for name in faults for case in cases_of(name, CASES)} == {case.name for case in CASES}
