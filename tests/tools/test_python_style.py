# SPDX-License-Identifier: GPL-2.0-only
"""flake8 by setup.cfg on all Python of the checkout."""

import pathlib
import shutil
import subprocess
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


def flake8(folder, *paths):
    return subprocess.run([sys.executable, "-m", "flake8", *paths], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)


def test_flake8_finds_nothing():
    found = flake8(REPOSITORY, "tools", "tests", "doc")
    assert "No module named" not in found.stderr, "flake8 is missing: apt-get install python3-flake8, or pip install flake8"
    assert found.returncode == 0 and not found.stdout, found.stdout


def test_it_would_be_found(tmp_path):
    shutil.copy2(REPOSITORY / "setup.cfg", tmp_path)
    (tmp_path / "a.py").write_text(f"import os\nx=1\nlong = {'a' * 200!r}\nb = long[x + 1 : 3]\n", encoding="utf-8")
    found = flake8(tmp_path)
    assert [line.split()[1] for line in found.stdout.splitlines()] == ["F401", "E225", "E501"], found.stdout
