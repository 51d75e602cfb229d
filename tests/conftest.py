# SPDX-License-Identifier: GPL-2.0-only
"""What every process that runs tests sets up first, of tests/tools and of tests/lammps."""

import os
import pathlib
import shutil
import signal
import sys
import tempfile

TESTS = pathlib.Path(__file__).resolve().parent
# evp, what it is compared with, the maintainers' programs and the studies, of the checkout that holds these tests
sys.path[:0] = [str(TESTS.parent / "tools"), str(TESTS), str(TESTS / "maintain"), str(TESTS / "tools"), str(TESTS / "lammps"), str(TESTS.parent / "doc" / "studies")]

# A shell that starts the tests in the background has them ignore SIGINT, and what they start, too: tests send it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config):
    """Of tests side by side: Open MPI's programs of one user share a folder, which the last that ends removes while another one starts.

    Before the tests are imported, as some keep the environment.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        config.folder_of_mpi = os.environ["OMPI_MCA_orte_tmpdir_base"] = tempfile.mkdtemp(prefix="evp-mpi-")


def pytest_unconfigure(config):
    if hasattr(config, "folder_of_mpi"):
        shutil.rmtree(config.folder_of_mpi, ignore_errors=True)
