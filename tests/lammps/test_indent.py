# SPDX-License-Identifier: GPL-2.0-only
"""in.indent: what a metal keeps and eq. 8 does not, a flat punch beside one on a half-space, what the held end feels. in.upset: stress beside
in.quasistatic, bulge by friction, balance of forces and energies, what springs back."""

import re

import numpy as np
import pytest
from hostile import refused
from lammps_run import DECKS, packed, read_csv, read_dump, run_lammps

METAL = "160 8 4 1.4 8 4 0.0007 0 1.5 spacing 0.00374 coordination 13.05 kv 700"  # about 304 steel, E 193 GPa
E, NU = 193e9, 0.29


block = packed("block.data", n=400, shape="block", length=0.02, width=0.04)


def indent(block, folder, **choices):
    """(curve, share of the depth that is left) of a metal. Says each increment of the way in and each tenth of the way back, and warns where spheres are few."""
    (folder / "also.lmp").write_text(f'print "held $(f_base[1]:%.9g) tool $(v_pressing:%.9g)"\ninclude {DECKS}/frames.lmp\n')
    given = {"specimen": block, "coeff": METAL, "plasticity": "isotropic", "depth": 0.001, "increments": 5, "also": "also.lmp", "out": "ball"}
    run = run_lammps("in.indent", 1, {**given, **choices}, folder, seconds=100).ok()
    held = np.array(re.findall(r"^held (\S+) tool (\S+)$", run.stdout, re.M), dtype=float)
    assert held[:, 1] == pytest.approx(-held[:, 0], rel=2e-3, abs=1e-3 * held.max()), "at rest the base holds what the tool pushes"
    curve, steps = read_csv(folder / "ball.csv"), {**given, **choices}["increments"]
    said = [int(number) for number in re.findall("^increment ([0-9]+): ", run.stdout, re.M)]
    released = curve["force"][-1] <= 1e-3 * curve["force"][steps]
    few = float(re.search(r"= (\S+) diameters of a sphere", run.stdout)[1]) < 5
    assert said == [k for k in range(len(curve["depth"]) - released) if k < steps + (not few) or k > steps and (k - steps) % 10 == 0]
    assert few == (len(run.warnings()) == 1) == any("below 5 the hardness is that of a few spheres" in line for line in run.warnings())
    return curve, float(re.search(r"an imprint of \S+ m, (\S+) % of the depth", run.stdout)[1]) / 100.0


def test_a_metal_keeps_its_imprint(block, tmp_path):
    """By a ball; at the turn about a hardness of a metal, and the circle that a ball cuts out of a plane."""
    curve, left = indent(block, tmp_path)
    top = int(np.argmax(curve["depth"]))
    assert 0.85 < left < 1.0 and curve["force"][-1] < 1.1e-3 * curve["force"][top]
    assert curve["contact_radius"][top] == pytest.approx(np.sqrt(2 * 0.01 * 0.001), rel=0.15)
    assert len(read_dump(tmp_path / "ball_frames.dump")) == len(curve["depth"]), "20 frames of about 10 increments: each of them"
    assert 1.5 < curve["hardness"][top] / 450e6 < 3.5


def test_eq_8_leaves_no_imprint(block, tmp_path):
    curve, left = indent(block, tmp_path, plasticity="none", contact="none", depth=0.0003, increments=3)
    assert left < 0.1 and curve["force"].max() > 0.0


def test_a_flat_punch(block, tmp_path):
    """Elastic: force over depth is 2 E a/(1 - nu^2) on a half-space, and larger on a layer of 2.2 radii that is held."""
    curve, left = indent(block, tmp_path, tool="flat", tool_radius=0.008, depth=4e-6, increments=1)
    stiffness = curve["force"][1] / curve["depth"][1]
    assert 0.9 < stiffness / (2.0 * E / (1.0 - NU**2) * 0.008) < 1.6 and left < 0.3
    assert curve["contact_radius"][1] == pytest.approx(0.008, rel=0.25)
    (tmp_path / "stop.lmp").write_text('if "${k} == 2" then quit\n')
    deep = {"specimen": block, "coeff": METAL, "tool": "flat", "tool_radius": 0.008, "depth": 2e-4, "increments": 1, "also": "stop.lmp"}
    run = run_lammps("in.indent", 1, deep, tmp_path).ok()
    assert any("the rim of the punch presses spheres beside it" in line for line in run.warnings())


def test_a_wide_contact_is_no_cause_for_a_warning(tmp_path):
    """A punch as wide as the body: more than 5 diameters of a sphere."""
    run_lammps("in.specimen", 1, {"n": 400, "shape": "block", "length": 0.015, "width": 0.045, "out": "wide.data"}, tmp_path).ok()
    indent("wide.data", tmp_path, tool="flat", tool_radius=0.05, depth=4e-6, increments=1)


def test_a_tool_that_touches_nothing_is_refused(block, tmp_path):
    """Deeper than the body is long."""
    refused(run_lammps("in.indent", 1, {"specimen": block, "tool_radius": 0.001, "depth": 0.06, "increments": 1}, tmp_path), "the tool touches nothing at the full depth")


# ---- in.upset ----


rod = packed("rod.data", n=500, length=0.03, radius=0.01, density=7900)


def upset(rod, folder, friction):
    """Curve, energy that is open over the work of the plates, share of the length that sprang back, at a strain of 0.2."""
    folder.mkdir()
    (folder / "also.lmp").write_text("variable open equal abs(f_energy/(f_energy[8]+1e-9))\nfix open all print 1000 'open ${open}'\n")
    run = run_lammps("in.upset", 1, {"specimen": rod, "coeff": METAL, "friction": friction, "strain": 0.2, "also": "also.lmp", "out": "rod"}, folder).ok()
    opened = [float(value) for value in re.findall(r"^open (\S+)$", run.stdout, re.M)]
    return read_csv(folder / "rod.csv"), max(opened[1:]), float(re.search(r"it sprang back by (\S+) %", run.stdout)[1]) / 100.0


def test_upsetting(rod, tmp_path):
    """Without friction the stress is that of in.quasistatic, whose grips hold the ends; friction makes it larger, and the middle wider than the ends."""
    smooth, opened, back = upset(rod, tmp_path / "smooth", 0.0)
    rough, opened_too, _ = upset(rod, tmp_path / "rough", 0.5)
    run_lammps("in.quasistatic", 1, {"specimen": rod, "coeff": METAL, "plasticity": "isotropic", "strain": -0.1, "increment": 0.005, "out": "rest"}, tmp_path).ok()
    rest = -read_csv(tmp_path / "rest.csv")["stress_virial"][-1]
    for curve in (smooth, rough):
        late = curve["strain"] > 0.02
        assert curve["force_lower"][late] == pytest.approx(curve["force_upper"][late], rel=0.1), "speed is far below that of waves"
    at_tenth = [float(np.interp(0.1, curve["strain"], curve["stress"])) for curve in (smooth, rough)]
    assert at_tenth[0] == pytest.approx(rest, rel=0.1) and at_tenth[1] > 1.02 * at_tenth[0]
    bulge = [curve["width_middle"][-1] - curve["width_plates"][-1] for curve in (smooth, rough)]
    assert bulge[1] > bulge[0] and bulge[1] > 2e-4
    assert max(opened, opened_too) < 1e-3 and 0.0 < back < 0.012


def test_nine_numbers_are_the_material_of_the_paper(rod, tmp_path):
    """In any body: those of Table 1 are the row that the deck has by default, but for the coordination of this body. A film has the start and the frames;
    plates as fast as this are warned of."""
    found = []
    for name, choices in (("plain", {"coeff": "80 8 4 3 8 4 0.005 0 1.5"}), ("row", {})):
        run = run_lammps("in.upset", 1, {"specimen": rod, "strain": 0.02, "speed": 30, "also": DECKS / "frames.lmp", "frames": 2, "out": name, **choices}, tmp_path).ok()
        assert any("the stress is that of waves, not of the material, up to a strain of " in line for line in run.warnings())
        assert [snapshot.step for snapshot in run.dump(f"{name}_frames.dump")][0] == 0 and len(run.dump(f"{name}_frames.dump")) == 3
        found.append(read_csv(tmp_path / f"{name}.csv")["stress"][-1])
    assert found[0] == pytest.approx(found[1], rel=0.1) and found[0] > 1e6
