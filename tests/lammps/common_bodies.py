# SPDX-License-Identifier: GPL-2.0-only
"""Bodies that several tests look at: the paper's specimen of tests/data, and what a deformed body is."""

import pathlib
from typing import NamedTuple

import numpy as np
from lammps_run import REPOSITORY

REFERENCE = REPOSITORY / "tests" / "data" / "reference_500" / "specimen_500.data"


class Body(NamedTuple):
    """A body that has been deformed since its bonds were recorded."""

    data: pathlib.Path  # LAMMPS data file of the state at recording
    radius: np.ndarray
    types: np.ndarray
    bonds: dict  # {(id_i, id_j): deq}
    x: np.ndarray  # now
    v: np.ndarray
    box: np.ndarray


def wavy_velocities(x, speed):
    """Velocities by formula, different for neighbors, of about this speed."""
    n = np.arange(1, len(x) + 1)
    return speed * np.stack([np.sin(1.1 * n), np.cos(2.3 * n), np.sin(3.7 * n + 1.0)], axis=1)


def scattered(x, bonds, radius):
    """Some atoms moved next to one that they have no bond with, so that such pairs overlap."""
    moved = x.copy()
    for i in range(10, len(x), 40):
        distance = np.linalg.norm(x - x[i], axis=1) / (radius + radius[i])
        partners = [a + b - i - 2 for a, b in bonds if i + 1 in (a, b)]
        distance[[i, *partners]] = np.inf
        j = int(np.argmin(distance))
        moved[i] = x[j] + 0.95 * (radius[i] + radius[j]) * (x[i] - x[j]) / np.linalg.norm(x[i] - x[j])
    return moved
