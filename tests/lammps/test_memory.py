# SPDX-License-Identifier: GPL-2.0-only
"""memory_usage() tells what was allocated.

Two processes that differ in one style only: the difference of what LAMMPS reports ('Per MPI rank memory allocation'
adds up memory_usage() of all styles and lists) is compared with the difference of what the C library has handed out
(mallinfo, printed by `info memory`), and with what the arrays have to hold for the bonds that there are."""

import re

import numpy as np
import pytest
from lammps_run import run_lammps, write_data
from small_bodies import head

SIDE = 24  # 13824 atoms: arrays of MB, far above what comes and goes otherwise
SPACING = 0.01
EVP = "pair_style evp/lj\npair_coeff * * 80 8 4 3 8 4 0.005 0 1.5\n"
VARIANTS = {
    "no style of ours": "pair_style zero 0.0165\npair_coeff * *\n",
    "pair": EVP,
    "pair, bonds from a file": EVP + "fix bonds all evp/bonds file many.bonds\n",
    "pair, bonds from the zone": EVP + "fix bonds all evp/bonds\n",
}


def test_reported_memory_is_the_memory_that_was_handed_out(tmp_path):
    """Of each bond on both of its atoms, an ID and a double in 16 bytes, in rows of one length for all atoms."""
    rng = np.random.default_rng(5)
    grid = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = (grid + 0.5 + rng.uniform(-0.1, 0.1, grid.shape)) * SPACING
    write_data(tmp_path / "many.data", x, rng.uniform(0.0045, 0.0055, len(x)), np.array([[0.0, SIDE * SPACING]] * 3))
    found, bonds = {}, None
    for name in reversed(VARIANTS):  # the zone's comes first and writes the bond file
        after = "write_evp_bonds many.bonds" if "zone" in name else ""
        out = run_lammps(head(start="read_data many.data", skin=0.0006) + VARIANTS[name] + f"run 0\n{after}\ninfo memory\n", 1, None, tmp_path).ok().stdout
        reported = re.search(r"Per MPI rank memory allocation.* = ([0-9.]+) \|", out)
        handed_out = re.search(r"Current reserved memory pool size: ([0-9.e+]+) Mbyte", out)
        found[name] = np.array([float(match[1]) for match in (reported, handed_out)]) * 1048576.0
        written = re.search(r"write_evp_bonds: (\d+) bonds", out)
        bonds = int(written[1]) if written else bonds
    for name, than in (("pair", "no style of ours"), ("pair, bonds from a file", "pair"), ("pair, bonds from the zone", "pair")):
        reported, handed_out = found[name] - found[than]
        assert handed_out > 2 * 1048576.0  # far above the last digit of `info memory`
        assert reported == pytest.approx(handed_out, rel=0.1), name
    held = 2.0 * bonds * 16
    assert bonds > 7 * len(x) and held < (found["pair, bonds from a file"] - found["pair"])[0] < 3.0 * held
