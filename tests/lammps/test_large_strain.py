# SPDX-License-Identifier: GPL-2.0-only
"""A periodic body of `plasticity isotropic` in simple shear: its box flips, and nothing of the body does. The decks are those of doc/studies/large_strain.py."""

import large_strain
import numpy as np
import pytest
from evp import figures
from lammps_run import DECKS, run_lammps

STRAIN = 0.6  # the tilt passes one half, where fix deform flips the box
CASE = large_strain.Case(216, "repulsive")
RUN = {"row": STRAIN / 30, "rate": 4000}
ALSO = """
compute         image all property/atom iy
variable        px atom mass*(vx+c_image*v_rate*ly)     # of the unwrapped body
compute         px all reduce sum v_px
compute         speeds all property/atom vy
compute         fastest all reduce max c_speeds
fix             end all print v_next_row "momentum $(c_px/mass(all):%.17g) $(vcm(all,y):%.17g) $(vcm(all,z):%.17g) of $(c_fastest:%.17g) tilt $(xy/lx:%.9g)"
"""


@pytest.fixture(scope="module")
def sheared(tmp_path_factory):
    """(columns of the CSV, pairs by write_evp_bonds, output) of the body with other choices; each is run once."""
    folder = tmp_path_factory.mktemp("sheared")
    run_lammps("in.specimen", 1, {**large_strain.packing(CASE), "out": f"body_{CASE.spheres}.data"}, folder).ok()
    known = {}

    def get(contact="repulsive", ranks=1, flip="yes"):
        key = contact, ranks, flip
        if key not in known:
            name = "_".join(map(str, key))
            deck = (DECKS / "in.shear").read_text(encoding="utf-8").replace("flip yes", f"flip {flip}") + f"write_evp_bonds {name}.bonds\n"
            choices = {**large_strain.shear(CASE._replace(contact=contact), STRAIN, folder), **RUN, "out": name}
            with open(folder / choices["also"], "a", encoding="utf-8") as also:
                also.write(ALSO)
            run = run_lammps(deck, ranks, choices, folder).ok()
            bonds = np.loadtxt(folder / f"{name}.bonds", comments="#")
            bonds = bonds[np.lexsort((bonds[:, 1], bonds[:, 0]))]
            known[key] = figures.read_columns(folder / f"{name}_energies.csv", large_strain.COLUMNS), bonds, run.stdout
        return known[key]

    return get


def tilt(output):
    return float(output.rpartition(" tilt ")[2].split()[0])


@pytest.mark.parametrize("contact, ranks", [("repulsive", 1), ("repulsive", 2), ("none", 1)])
def test_offsets_survive_the_flip(sheared, contact, ranks):
    """Stress and energies along the way, and the plastic part of each pair, are those of a box that never flips, on one rank."""
    curve, bonds, output = sheared(contact, ranks)
    expected, kept, unflipped = sheared(contact, flip="no")
    assert tilt(output) == pytest.approx(STRAIN - 1.0, abs=0.002) and tilt(unflipped) == pytest.approx(STRAIN, abs=0.002), "control"
    for name in ("shear_stress", "pressure", "stored", "lost", "plastic", "viscous"):
        assert np.abs(curve[name] - expected[name]).max() < 1e-8 * np.abs(expected[name]).max(), name
    assert np.array_equal(bonds[:, :2], kept[:, :2]) and len(bonds) > 1000
    assert np.abs(bonds[:, 3] - kept[:, 3]).max() < 1e-8 * np.abs(kept[:, 3]).max()
    assert np.mean(np.abs(kept[:, 3] / kept[:, 2]) > 0.01) > 0.2, "control: pairs have flowed"


def test_momentum_is_exact(sheared):
    """Forces are equal and opposite across the boundary, flipped or not: the momentum of the unwrapped body stays to round-off of its fastest sphere."""
    rows = [line.split() for line in sheared()[2].splitlines() if line.startswith("momentum ")]
    momentum, fastest = np.array([row[1:4] for row in rows], dtype=float), float(rows[-1][5])
    assert len(rows) == 30 and fastest > 0.1, "control: spheres move"
    assert np.abs(momentum - momentum[0]).max() < 1e-12 * fastest


def test_plastic_work_grows_in_each_row(sheared):
    curve = sheared()[0]
    assert np.all(np.diff(curve["plastic"])[1:] > 0.0)
    assert curve["plastic"][-1] > 0.2 * curve["spent"][-1]
