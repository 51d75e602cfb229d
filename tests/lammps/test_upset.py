# SPDX-License-Identifier: GPL-2.0-only
"""in.upset: stress beside in.quasistatic, bulge by friction, balance of forces and energies, what springs back."""

import re

import numpy as np
import pytest
from lammps_run import DECKS, read_csv, run_lammps

METAL = "160 8 4 1.4 8 4 0.0007 0 1.5 spacing 0.00374 coordination 13.05 kv 700"  # about 304 steel, E 193 GPa


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rod")
    run_lammps("in.specimen", 1, {"n": 500, "length": 0.03, "radius": 0.01, "density": 7900, "out": "rod.data"}, folder).ok()
    return folder / "rod.data"


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
