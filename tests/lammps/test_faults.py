# SPDX-License-Identifier: GPL-2.0-only
"""Each safeguard of src/core/fault.h has robustness tests that fail without it, and each robustness test has one; tests/maintain/faults.py builds them."""

from faults import CASES, fault_names, read_faults
from lammps_run import REPOSITORY
from robustness import collect, requirements


def test_every_test_notices_a_fault_and_every_fault_has_tests():
    faults, names = read_faults(REPOSITORY / "src"), {test.name for test in collect() if test.ranks == 1}
    assert list(faults) == list(CASES) and len(faults) > 30
    for name, fault in faults.items():
        assert len(fault.files) == 1, f"{name} stands in {fault.files}"
        assert any(name in fault_names(test) for test in names), name
    assert all(map(fault_names, names)) and len(names) > 50
    assert {name.partition(":")[0] for name in names} == set(requirements())
