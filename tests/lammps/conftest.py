# SPDX-License-Identifier: GPL-2.0-only
"""Fixtures of the tests that run LAMMPS: the runner, and the bodies that several tests look at. A missing lmp fails the tests: nothing here skips."""

import os
import re

import numpy as np
import pytest
from evp import law, specimen
from lammps_run import DECKS, LMP, REFERENCE, SECONDS, WITHOUT, named, read_dump, run_decks, run_lammps
from oracle import brute
from robust import Bench
from small_bodies import Body, lattice_body, wavy_velocities, write_body

ALL_RANKS = "EVP_ALL_RANKS" in os.environ  # tests/maintain/robustness.py: robustness tests on all numbers of ranks that they name, else on one


@pytest.fixture(scope="session", autouse=True)
def lmp_is_there():
    assert LMP.is_file(), f"no LAMMPS at {LMP}: run tools/setup.sh, or set EVP_LMP"


@pytest.fixture
def lmp(tmp_path):
    """Runs LAMMPS in the test's own folder unless told otherwise."""
    return lambda deck, ranks=1, variables=None, cwd=tmp_path, **options: run_lammps(deck, ranks, variables, cwd, **options)


@pytest.fixture
def lmp_decks(tmp_path):
    """Runs {name: text of a deck} in one process, from the files of the test's own folder; {name: Run}."""
    return lambda decks, ranks=1: run_decks(decks, ranks, tmp_path)


def pytest_configure(config):
    config.addinivalue_line("markers", "ranks(*numbers): of MPI ranks that a robustness test runs on")


def decks_of(source):
    """The text of the decks that this text names, as tools run them, and of what they include."""
    left, known = {name for name in re.findall(r"\bin\.\w+", source) if (DECKS / name).exists()}, {}
    while left:
        name = left.pop()
        known[name] = (DECKS / name).read_text(encoding="utf-8")
        left |= {other for other in re.findall(r"\b\w+\.lmp\b", known[name]) if (DECKS / other).exists()} - set(known)
    return "".join(known.values())


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item):
    """Without an effect tests that fail are left out if they named it: tests/maintain/without.py."""
    report = (yield).get_result()
    if not WITHOUT or not report.failed:
        return
    if named or any(word in report.longreprtext + decks_of(item.path.read_text(encoding="utf-8")) for word in WITHOUT):
        report.outcome, report.longrepr = "skipped", (str(item.path), item.location[1], "names the effect")
        with open(os.environ["EVP_LEFT_OUT"], "a", encoding="utf-8") as out:
            out.write(f"{item.nodeid}\n")


@pytest.fixture(autouse=True)
def names_of_this_test():
    named.clear()


def pytest_generate_tests(metafunc):
    if "bench" in metafunc.fixturenames:
        mark = metafunc.definition.get_closest_marker("ranks")
        ranks = mark.args if mark else (1, 2)
        metafunc.parametrize("bench", ranks if ALL_RANKS else ranks[:1], indirect=True, ids="{}ranks".format)


@pytest.fixture
def bench(lmp, tmp_path, request, record_property):
    """Where a robustness test runs, robust.Bench."""
    seconds = 900 if ALL_RANKS else SECONDS
    return Bench(lambda text, ranks: lmp(text, ranks, seconds=seconds), tmp_path, request.param, lambda text: record_property("shown", text))


def written(name, cells):
    """A fixture of this name: a block of two types, written as body.data."""
    @pytest.fixture(name=name)
    def body(tmp_path):
        body = lattice_body(cells)
        write_body(tmp_path / "body.data", body)
        return body

    return body


body, bar, small = written("body", (8, 4, 4)), written("bar", (6, 4, 4)), written("small", (4, 3, 3))


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
    x = read_dump(folder / "pulled_state.dump")[-1].x
    bonds = brute.record_bonds(reference.x, reference.radius, law.TABLE1.alpha)
    types = np.ones(len(x), dtype=int)
    return Body(REFERENCE, reference.radius, types, bonds, x, wavy_velocities(x, 1.0), reference.box)
