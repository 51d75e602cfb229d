# SPDX-License-Identifier: GPL-2.0-only
"""Fixtures of the tests that run LAMMPS: the runner, and the bodies that several tests look at.

lmp(deck_or_text, ranks=1, variables={...}, cwd=tmp_path) runs a deck of lammps_inputs, a path, or the
text of a deck, and returns its .returncode, .stdout and more (lammps_run.Run). A missing lmp fails the
tests: nothing here skips.
"""

import pathlib
import sys
from typing import NamedTuple

import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))

from evp import brute, law, specimen  # noqa: E402
from lammps_run import LMP, REPOSITORY, read_dump, run_decks, run_lammps  # noqa: E402
from small_bodies import lattice_body, write_body  # noqa: E402

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


@pytest.fixture(scope="session", autouse=True)
def lmp_is_there():
    assert LMP.is_file(), f"no LAMMPS at {LMP}: run tools/setup.sh, or set EVP_LMP"


@pytest.fixture
def lmp(tmp_path):
    """Runs LAMMPS in the test's own folder unless told otherwise."""

    def run(deck, ranks=1, variables=None, cwd=tmp_path, **options):
        return run_lammps(deck, ranks, variables, cwd, **options)

    return run


@pytest.fixture
def lmp_decks(tmp_path):
    """Runs {name: text of a deck} in one process, from the files of the test's own folder; {name: Run}."""

    def run(decks, ranks=1):
        return run_decks(decks, ranks, tmp_path)

    return run


@pytest.fixture(scope="module")
def body():
    """A small bar of two types, to be written by the test."""
    return lattice_body()


@pytest.fixture
def bar(tmp_path):
    """A smaller one, written as body.data."""
    body = lattice_body((6, 4, 4))
    write_body(tmp_path / "body.data", body)
    return body


@pytest.fixture(scope="session")
def reference():
    """The reference specimen, as tools/evp reads it."""
    return specimen.read_data(REFERENCE)


@pytest.fixture(scope="session")
def pulled_body(reference, tmp_path_factory):
    """The reference specimen pulled to 5 % by the traction deck, Table 1; velocities by formula."""
    folder = tmp_path_factory.mktemp("pulled")
    variables = {"specimen": REFERENCE, "rate": 50, "strain": 0.05, "out": "pulled", "contact": "literal"}
    run_lammps("in.traction", 1, variables, folder).ok()
    x = read_dump(folder / "pulled_state.dump")[-1].vectors("x", "y", "z")
    bonds = brute.record_bonds(reference.x, reference.radius, law.TABLE1.alpha)
    types = np.ones(len(x), dtype=int)
    return Body(REFERENCE, reference.radius, types, bonds, x, wavy_velocities(x, 1.0), reference.box)
