# SPDX-License-Identifier: GPL-2.0-only
"""fix evp/bonds ... within type|molecule: no bonds between two bodies, which repel each other where they touch and do nothing before.

Words that are refused are in test_bad_input.py, what restart and bond files keep in test_records.py."""

import numpy as np
import pytest
from oracle import law
from lammps_run import write_data
from small_bodies import head, pair, thermo, two_groups

RADIUS, TOUCH = 0.005, 0.01
APART = 1.1 * TOUCH  # within alpha (R_i + R_j) = 1.5 TOUCH
MOLECULES = "fix molecules all property/atom mol ghost yes\n"
FIX = "fix bonds all evp/bonds within "


# ---- two spheres ----


def two(path, gap=APART):
    write_data(path / "body.data", np.array([[-0.5 * gap, 0, 0], [0.5 * gap, 0, 0]]), [RADIUS] * 2, [[-0.2, 0.2]] * 3, [1, 2])


BOUNCES = {
    "eq. 8": ("", 0.0, "nve"),
    "plastic": ("plasticity isotropic", 0.0, "nve"),
    "damped, plastic": ("plasticity isotropic", 20.0, "nve"),
    "damped by nve/evp": ("", 200.0, "nve/evp"),
}
SAME, ROUNDED = "v_d v_f c_dt[*] c_own[*] f_bonds[1] f_bonds[3] f_bonds[4] c_state[*]", "pe ke f_energy[*]"


@pytest.mark.parametrize("name", BOUNCES)
def test_two_bodies_are_those_of_contact_repulsive(lmp_decks, tmp_path, name):
    """Two spheres meet and part, with `within`, with `contact literal` where it goes, and with `contact repulsive`, no bonds and an xi_s that is not
    reached: the same bits of forces, stable timesteps, counts and pair values; energies but for the cut of a pair, which has another margin."""
    two(tmp_path)
    (tmp_path / "none.bonds").write_text("# EVP bonds COUNT: 0 UNITS: si\n", encoding="utf-8")
    style, gamma, move = BOUNCES[name]
    rest = two_groups(20.0, -20.0) + f"fix move all {move}\nfix energy all evp/energy\ntimestep 2e-7\ncompute dt all evp/dt\n"
    rest += "compute pairs all pair/local force p1 p2 p3\ncompute own all reduce sum " + " ".join(f"c_pairs[{k}]" for k in range(1, 5)) + " inputs local\n"
    rest += "compute atoms all evp/state/atom\ncompute state all reduce sum c_atoms[*]\n"
    rest += "variable d equal x[2]-x[1]\nvariable f equal fx[2]\nthermo 2\n" + thermo(f"{SAME} {ROUNDED}") + "run 600\n"
    decks = {}
    twins = (("repulsive" if "plasticity" in style else "literal", FIX + "type", law.TABLE1.xi_s), ("repulsive", "fix bonds all evp/bonds file none.bonds", 0.5))
    for contact, fix, xi_s in twins:
        own = style if xi_s < 0.5 else ""  # between two bodies nothing flows
        decks[fix] = head(skin=0.001) + pair(law.TABLE1._replace(gamma=gamma, xi_s=xi_s), f"{contact} {own}", fix) + rest
    tables = {fix: run.thermo() for fix, run in lmp_decks(decks).items()}
    ours, repulsive = tables.values()
    force = repulsive["v_f"]
    assert np.sum(force != 0.0) > 30 and force[0] == force[-1] == 0.0 and force.max() > 1000.0, "control: they meet and part"
    for column, values in repulsive.items():
        if column in ("PotEng", "KinEng") or column.startswith("f_energy"):
            assert np.abs(ours[column] - values).max() <= 1e-12 * law.TABLE1.e1, column
        else:
            assert np.array_equal(ours[column], values), column


# ---- many spheres ----


def test_atom_styles_with_molecules(lmp_decks):
    """The same numbers as with fix property/atom; special_bonds of a style that knows bonds has nothing to exclude."""
    rows = "\n".join(f"create_atoms 1 single {x} {y} 0\n" for x in (0, 0.0102, 0.0204) for y in (0, 0.0104))
    rest = f"""
{rows}
set group all diameter 0.01
set group all density 2700
{{molecules}}
set atom 1*4 mol 3
set atom 5*6 mol 8
neighbor 0.001 bin
{pair(fix=FIX + "molecule")}
run 0
displace_atoms all ramp y 0 0.0003 x 0 0.03 units box
displace_atoms all ramp x 0 -0.002 x 0.0102 0.0204 units box
{thermo("pe fmax f_bonds f_bonds[3]")}
run 0
"""
    start = "units si\natom_style {}\natom_modify map yes\nboundary f f f\nregion box block -0.1 0.1 -0.1 0.1 -0.1 0.1\ncreate_box 1 box\n"
    styles = ("hybrid sphere molecular", "hybrid sphere bond", "hybrid molecular sphere", "bpm/sphere")
    decks = {kind: start.format(kind) + rest.format(molecules="" if kind in styles else MOLECULES) for kind in (*styles, "sphere")}
    tables = {kind: run.thermo() for kind, run in lmp_decks(decks, 2).items()}
    sphere = tables.pop("sphere")
    assert sphere["f_bonds"][0] == 6 + 1 and sphere["f_bonds[3]"][0] == 2 and sphere["Fmax"][0] > 100.0
    for kind, ours in tables.items():
        assert ours == pytest.approx(sphere, rel=1e-12), kind


# ---- what is said ----


def test_bodies_that_overlap_at_the_start_are_warned_of(lmp_decks, tmp_path):
    text, runs = "1 pairs of two bodies overlap at the start, and repel each other from the first step on", {}
    for gap in (0.99 * TOUCH, TOUCH):
        two(tmp_path, gap)
        decks = {(contact, gap): head() + pair(contact=contact, fix=FIX + "type") + "run 0\n" for contact in ("literal", "repulsive", "none")}
        runs.update(lmp_decks(decks, 2))
    warned = {key for key, run in runs.items() if any(text in line for line in run.warnings())}
    assert warned == {("literal", 0.99 * TOUCH), ("repulsive", 0.99 * TOUCH)}
    two(tmp_path, 0.996 * TOUCH)
    slight = lmp_decks({"slight": head() + pair(contact="repulsive", fix=FIX + "type") + "run 0\n"}, 2)["slight"]
    assert not any("overlap" in line for line in slight.warnings()) and f"fix evp/bonds bonds: {text}, the deepest by 0.004 of R_i + R_j\n" in slight.stdout
