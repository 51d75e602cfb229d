# SPDX-License-Identifier: GPL-2.0-only
"""A periodic body of `unload elastic` in simple shear: its box flips, and nothing of the body does. The decks are those of tools/large_strain.py."""

import large_strain
import numpy as np
import pytest
from evp import figures
from lammps_run import run_lammps

STRAIN = 0.6  # the tilt passes one half, where fix deform flips the box
RUN = {"strain": STRAIN, "rows": 30, "rate": 4000, "samples": 5}
ALSO = f"""
variable        px equal vcm(all,x)
variable        py equal vcm(all,y)
variable        pz equal vcm(all,z)
compute         speeds all property/atom vx
compute         fastest all reduce max c_speeds
fix             end all print $({RUN["rows"]}*v_row) "momentum $(v_px:%.17g) $(v_py:%.17g) $(v_pz:%.17g) of $(c_fastest:%.17g) tilt $(xy/lx:%.9g)"
"""


@pytest.fixture(scope="module")
def sheared(tmp_path_factory):
    """(columns of the CSV, pairs by write_evp_bonds, output) of the body with other choices; each is run once."""
    folder = tmp_path_factory.mktemp("sheared")
    run_lammps(large_strain.PACK.format(n=216, seed=1, data="body.data"), 1, None, folder).ok()
    known = {}

    def get(contact="literal", ranks=1, flip="yes"):
        key = contact, ranks, flip
        if key not in known:
            name = "_".join(map(str, key))
            text = large_strain.shear_deck("body.data", name, contact=contact, flip=flip, also=ALSO, **RUN)
            run = run_lammps(text + f"write_evp_bonds {name}.bonds\n", ranks, None, folder).ok()
            bonds = np.loadtxt(folder / f"{name}.bonds", comments="#")
            bonds = bonds[np.lexsort((bonds[:, 1], bonds[:, 0]))]
            known[key] = figures.read_columns(folder / f"{name}.csv", large_strain.COLUMNS), bonds, run.stdout
        return known[key]

    return get


def tilt(output):
    return float(output.rpartition(" tilt ")[2].split()[0])


@pytest.mark.parametrize("contact, ranks", [("literal", 1), ("literal", 2), ("none", 1)])
def test_offsets_survive_the_flip(sheared, contact, ranks):
    """Stress and energies along the way, and offset and plastic work of each pair, are those of a box that never flips, on one rank."""
    curve, bonds, output = sheared(contact, ranks)
    expected, kept, unflipped = sheared(contact, flip="no")
    assert tilt(output) == pytest.approx(STRAIN - 1.0, abs=1e-6) and tilt(unflipped) == pytest.approx(STRAIN, abs=1e-6)
    for name in ("shear_stress", "pressure", "stored", "lost", "plastic", "viscous"):
        assert np.abs(curve[name] - expected[name]).max() < 1e-8 * np.abs(expected[name]).max(), name
    assert np.array_equal(bonds[:, :2], kept[:, :2]) and len(bonds) > 1000
    assert np.abs(bonds[:, 3] - kept[:, 3]).max() < 1e-8 * np.abs(kept[:, 3]).max()
    assert np.mean(np.abs(kept[:, 3] / kept[:, 2]) > 0.01) > 0.2, "control: pairs have flowed"


def test_momentum_is_exact(sheared):
    """Forces are equal and opposite across the boundary, flipped or not: the body stays at rest to round-off of its fastest sphere."""
    output = sheared()[2]
    words = output.rpartition("momentum ")[2].split()
    momentum, fastest = np.array(words[:3], dtype=float), float(words[4])
    assert fastest > 0.1, "control: spheres move"
    assert np.abs(momentum).max() < 1e-13 * fastest


def test_plastic_work_grows_in_each_row(sheared):
    curve = sheared()[0]
    assert np.all(np.diff(curve["plastic"])[1:] > 0.0)
    assert curve["plastic"][-1] > 0.2 * curve["spent"][-1]
