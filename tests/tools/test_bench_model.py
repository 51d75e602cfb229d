# SPDX-License-Identifier: GPL-2.0-only
"""The surface of a rank's cube of particles, on which doc/studies/bench.py builds its model of many ranks."""

import itertools
import statistics

import pytest
import bench_scenes as scenes
import bench_sections as sections
from bench_run import Timing


def count_ghosts(cells, offset):
    """Sites of the lattice outside a cube of cells, within cut-off and skin of its faces; offset: of the sites, in layers."""
    half, reach = 0.5**0.5, scenes.REACH + scenes.SKIN
    layers = {True: [0, 0], False: [0, 0]}  # by parity: all that are near, those inside
    for k in range(-10, 2 * cells + 10):
        place = (k + offset) * half
        layers[k % 2 == 0][0] += -reach <= place <= 2 * cells * half + reach
        layers[k % 2 == 0][1] += 0 <= k < 2 * cells

    def sites(which):  # there is one where the three indices have an even sum
        return sum(layers[a][which] * layers[b][which] * layers[c][which] for a, b, c in itertools.product((True, False), repeat=3)
                   if (not a) + (not b) + (not c) in (0, 2))

    assert sites(1) == 4 * cells**3, "control: those of the cube"
    return sites(0) - sites(1)


@pytest.mark.parametrize("cells", [5, 10, 20])
def test_ghosts_about_a_cube_of_the_lattice(cells):
    """The formula is the mean over all places of the layers."""
    counted = statistics.mean(count_ghosts(cells, (k + 0.5) / 100) for k in range(100))
    assert sections.ghosts_of(4 * cells**3) == pytest.approx(counted, rel=0.02)


def test_model_of_a_rank_that_only_works():
    """Without ghosts' copies the work is Pair and Modify, and many particles are efficient."""
    scene = scenes.ours("lattice", 20, 100)
    timing = Timing(1.0, {"Pair": 0.8, "Modify": 0.16, "Comm": 0.0}, 32000, 0, 1.0, 11000.0, "")
    lines = sections.many_ranks(scene, [timing])
    assert any("300 ns of forces and time integration per particle" in line for line in lines)
    efficiency = [float(line.split("|")[-2]) for line in lines if line.startswith("| ") and line[2].isdigit()]
    assert efficiency == sorted(efficiency, reverse=True) and 0.8 < efficiency[0] < 1.0
