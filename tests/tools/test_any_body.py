# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/any_body.py: which departures its page judges, and the page that is there."""

import any_body
from any_body import CYLINDER, KINDS
from evp.run import CHECKOUT


def text(off):
    """The page of bodies whose departure is off[N]; the cylinder has none."""
    found = {(kind, n): 2e10 * (1.0 + (0.0 if kind is CYLINDER else share)) for n, share in off.items() for kind in KINDS}
    return any_body.page(found, "some.evp:row", "the command")


def test_departures_within_what_is_allowed():
    page = text({2000: 0.02, 8000: -0.01})
    assert "from 2000 spheres on the largest\ndifference from the cylinder of 8000 spheres is 2.0 %; all are within" in page and "20.40 (+2.0 %)" in page


def test_a_departure_beyond_is_named_with_its_body():
    page = text({2000: 0.04, 8000: 0.0})
    assert "beyond their limits: cylinder 5 x 2 mm with 2000 spheres." in page


def test_few_spheres_show_the_trend_only():
    assert "difference from the cylinder of 2000 spheres is 1.0 %; all are within" in text({500: -0.2, 2000: 0.01})


def test_the_page_that_is_there_holds():
    page = (CHECKOUT / "doc" / "any_body.md").read_text(encoding="utf-8")
    assert "from 2000 spheres on" in page and "all are within their limits" in page
    assert all(kind.name in page for kind in KINDS)
