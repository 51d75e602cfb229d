# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/any_body.py: which differences its page judges."""

import any_body
from any_body import BODIES

CYLINDER = next(iter(BODIES))


def page(off):
    """Values of the page of bodies whose difference is off[N]; the cylinder has none."""
    found = {(body, n): 2e10 * (1.0 + (0.0 if body == CYLINDER else share)) for n, share in off.items() for body in BODIES}
    return any_body.page(found, "some.evp:row")


def test_differences_within_what_is_allowed():
    values = page({2000: 0.02, 8000: -0.01})
    assert (values["fewest"], values["most"], values["worst"], values["verdict"]) == (2000, 8000, "2.0", "all are within their limits.")
    assert "20.40 (+2.0 %)" in values["table"][1][1]


def test_a_difference_beyond_is_named_with_its_body():
    assert page({2000: 0.04, 8000: 0.0})["verdict"] == "beyond their limits: cylinder 5 x 2 mm with 2000 spheres."


def test_few_spheres_show_the_trend_only():
    assert page({500: -0.2, 2000: 0.01})["worst"] == "1.0"
