# SPDX-License-Identifier: GPL-2.0-only
"""in.vbend, in.extrude and in.blank beside closed forms: plastic hinge, ideal work, flow stress in shear; balance of forces and energies, what springs back, what has
flowed, where a sheet parts."""

import re

import doc_blocks
import numpy as np
import pytest
from lammps_run import DECKS, packed, read_csv, run_lammps

METAL = "160 8 4 1.4 8 4 0.0007 0 1.5 spacing 0.00374 coordination 13.05 kv 700 flow 0 1 0.02 1.4 0.3 2 2 3"  # E 193 GPa

sheet = packed("sheet.data", n=900, shape="block", length=0.06, width=0.015, height=0.009)
thick = packed("thick.data", n=300, shape="block", length=0.02, width=0.02, height=0.04)
strip = packed("strip.data", n=900, shape="sheet", length=0.01, width=0.002, height=0.0012)
billet = packed("billet.data", n=500, length=0.05, radius=0.012)


def formed(deck, folder, **choices):
    """(curve, what its last line says, error of the energy balance over the work of the tools at the end)."""
    (folder / "also.lmp").write_text('fix balance all print ${nsteps} "balance $(f_energy/(f_energy[8]+1e-9))"\n', encoding="utf-8")
    run = run_lammps(deck, 1, {"coeff": METAL, "also": "also.lmp", "out": "part", **choices}, folder).ok()
    assert not run.warnings()
    return read_csv(folder / "part.csv"), re.findall(rf"^{re.escape(deck)}: .*", run.stdout, re.M)[-1], float(re.findall("^balance (.*)", run.stdout, re.M)[-1])


def numbers(text):
    return [float(word) for word in re.findall(r"-?\d+\.?\d*(?:e[-+]?\d+)?", text.partition(": ")[2])]


def test_a_sheet_is_bent(sheet, tmp_path):
    curve, said, imbalance = formed("in.vbend", tmp_path, specimen=sheet, travel=0.006, speed=20)
    force, bent, left, hinge = (numbers(said)[k] for k in range(4))
    late = curve["travel"] > 0.003
    assert np.mean(curve["force_punch"][late]) == pytest.approx(np.mean((curve["force_left"] + curve["force_right"])[late]), rel=0.03)
    assert 0.6 < force / hinge / 380.0 < 1.4 and 15.0 < bent < 60.0 and 0.75 * bent < left < bent
    assert abs(imbalance) < 3e-3


def test_a_billet_is_extruded(billet, tmp_path):
    """Ideal work: ln ratio of plastic strain, and a pressure of at least the flow stress times it; twice that with redundant work and friction."""
    curve, said, imbalance = formed("in.extrude", tmp_path, specimen=billet, travel=0.5, speed=40)
    pressure, _, behind, strain, ideal = numbers(said)[:5]
    late = curve["travel"] > 0.015
    tools = sum(curve[f"force_{name}"] for name in ("container", "cone", "bearing"))
    assert np.mean(curve["force_ram"][late]) == pytest.approx(-np.mean(tools[late]), rel=0.05)
    assert ideal == pytest.approx(np.log(1.8), rel=1e-3) and behind > 100 and 0.8 * ideal < strain < 2.0 * ideal
    assert 1.0 < pressure / (450.0 * ideal) < 3.5
    assert abs(imbalance) < 3e-3


def test_a_sheet_is_blanked(strip, tmp_path):
    """The default row: its flow stress at a plastic strain of 0.26, where it fails in shear, over sqrt 3 is 302 MPa; coarse spheres at the faces bear more. Then it
    parts, and nothing bears any more."""
    run = run_lammps("in.blank", 1, {"specimen": strip, "travel": 0.6, "speed": 20, "out": "part"}, tmp_path).ok()
    peak, at, parted, count, imbalance = numbers(re.findall(r"^in.blank: largest.*", run.stdout, re.M)[-1])[:5]
    curve = read_csv(tmp_path / "part.csv")
    assert 302.0 < peak < 1.4 * 302.0 and 5.0 < at < parted < 50.0
    assert abs(imbalance) < 1e-3 and curve["parted"][-1] == count > 20 and curve["shear_stress"][-1] < 0.2e6 * peak


def test_the_tool_of_the_howto_page(thick, tmp_path):
    """A cone comes down on a block, as the page has it, and pushes it away."""
    tool = next(block.text for block in doc_blocks.blocks("doc/Howto_evp_friction.rst") if "region          punch cone" in block.text)
    text = f'variable specimen index {thick}\nvariable coeff index "{METAL}"\nvariable plasticity index isotropic\ninclude {DECKS}/body.lmp\nfix move all nve\n'
    text += tool.replace("lammps_inputs/", f"{DECKS}/")
    text += "compute force all reduce sum f_punch[2] f_punch[3] f_punch[4]\nthermo_style custom step c_force[3]\nthermo 1000\nrun 4000\n"
    force = run_lammps(text, 1, {}, tmp_path).ok().thermo()["c_force[3]"]
    assert force.min() < -1000.0 and force.max() <= 0.0


bar = packed("bar.data", n=200)


def test_a_seam_holds_what_was_pressed(bar, tmp_path):
    """Of a cut body: nothing where it was only pulled, or where parts do not join; pressed by a fifth it holds some of what the solid does with the same history."""
    def strength(ranks=1, **choices):
        run = run_lammps("in.weld", ranks, {"specimen": bar, "coeff": METAL, "pull": 0.08, "rate": 100, **choices}, tmp_path).ok()
        strength, joined, _ = numbers(re.findall(r"^in.weld: .*", run.stdout, re.M)[-1])
        return strength, joined

    solid, _ = strength(cut="no")
    pressed, joined = strength(2)
    assert joined > 20 and 0.15 < pressed / solid < 0.6
    for choices in ({"contact": "repulsive"}, {"press": 0, "rate": 20, "pull": 0.02}):
        held, joined = strength(**choices)
        assert joined == 0 and held < 0.01 * solid, choices
