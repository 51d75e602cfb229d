# SPDX-License-Identifier: GPL-2.0-only
"""What a scene does not call for costs nothing, and one line at set-up says so; what looks like a mistake is warned of."""

import numpy as np
import pytest
from lammps_run import write_data

DECK = """
units si
atom_style sphere
atom_modify map yes
boundary f f f
read_data row.data
neighbor 0.002 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj {style}
pair_coeff * * {coeff}
{fix}
fix move all nve
timestep 1e-9
thermo_style custom step pe fmax
thermo_modify format float %.17g
run 2
"""
TABLE1 = "80 8 4 3 8 4 0.005 0 1.5"
TABLE2 = "80 8 4 3 8 4 0.005 1000 1.5"
FIX = "fix bonds all evp/bonds"
NO_FIX = "no fix evp/bonds: every pair has deq = R_i + R_j"


@pytest.fixture
def run(lmp, tmp_path):
    place = np.array([[0.0104 * k, 0.0, 0.0] for k in range(6)])
    write_data(tmp_path / "row.data", place, np.full(6, 0.005), [[-0.05, 0.1], [-0.05, 0.05], [-0.05, 0.05]])

    def start(style="", coeff=TABLE1, fix=FIX, before="", after="", ranks=1):
        return lmp(before + DECK.format(style=style, coeff=coeff, fix=fix) + after, ranks=ranks)

    return start


def lines(result):
    return [line for line in result.ok().stdout.splitlines() if line.startswith("evp/lj: ")]


@pytest.mark.parametrize("style, contact", [("", "literal"), ("contact literal", "literal"), ("contact repulsive", "repulsive"),
                                            ("contact none", "none")])
@pytest.mark.parametrize("fix", [FIX, ""])
@pytest.mark.parametrize("coeff, damping", [(TABLE1, "damping off"), (TABLE2, "damping on")])
def test_one_line_says_what_is_on(run, style, contact, fix, coeff, damping):
    found = lines(run(style, coeff, fix, after="run 1\n", ranks=2))
    assert len(found) == 1, "once, though there are two runs"
    for part in (damping, f"new contacts {contact}", "deq of bonds from fix bonds" if fix else NO_FIX,
                 "overlap warned of beyond 0.3 (R_i + R_j)"):
        assert part in found[0]


def test_a_change_is_said_again(run):
    found = lines(run(after=f"pair_coeff * * {TABLE2}\nrun 1\nunfix bonds\nrun 1\n"))
    assert ["damping on" in line for line in found] == [False, True, True]
    assert [NO_FIX in line for line in found] == [False, False, True]


def test_no_fix_is_no_error_and_means_the_sum_of_radii(run):
    """A row of gaps 4 % wide: with the fix it is at rest; without it the first and the last are pulled with more than
    the yield force m1 n1 e1 xi_s/deq, their neighbors on both sides in balance."""
    yield_force = 8 * 4 * 80 * 0.005 / 0.01
    assert run().thermo()["Fmax"][0] < 1e-9 * yield_force
    assert run(fix="").thermo()["Fmax"][0] > 0.9 * yield_force
    assert NO_FIX in lines(run(fix=""))[0]


def test_contact_none_without_the_fix_warns_that_nothing_acts(run):
    text = "nothing acts at all"
    assert any(text in w for w in run("contact none", fix="").ok().warnings())
    assert not any(text in w for w in run("contact none").ok().warnings())
    assert not any(text in w for w in run("contact repulsive", fix="").ok().warnings())


def test_small_alpha_with_literal_contacts_is_warned_of(run):
    for style, alpha, expected in (("", 1.1, 1), ("", 1.39, 1), ("", 1.4, 0), ("contact none", 1.1, 0)):
        warned = [w for w in run(style, TABLE1.replace("1.5", str(alpha))).warnings() if "is below 1.4" in w]
        assert len(warned) == expected, (style, alpha)
        assert not expected or f"alpha = {alpha} is below 1.4" in warned[0]


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("overlap, expected", [("", 2), ("overlap 0.05", 3), ("overlap 0.6", 0)])
def test_overlap_is_counted_and_warned_of_once(lmp, tmp_path, run, overlap, expected, ranks):
    """Pairs at 0.5, 0.6 and 0.9 of R_i + R_j, far from each other."""
    place = [[0.00, 0, 0], [0.005, 0, 0], [0.04, 0, 0], [0.046, 0, 0], [0.08, 0, 0], [0.089, 0, 0]]
    write_data(tmp_path / "row.data", np.array(place), np.full(6, 0.005), [[-0.05, 0.1], [-0.05, 0.05], [-0.05, 0.05]])
    warned = [w for w in run(overlap, after="run 3\n", ranks=ranks).ok().warnings() if "overlap by more than" in w]
    assert len(warned) == (2 if expected else 0), "once per run, by one rank"
    if expected:
        assert f"{expected} pairs overlap by more than {overlap.split()[-1] if overlap else 0.3} (R_i + R_j)" in warned[0]
