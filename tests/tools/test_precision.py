# SPDX-License-Identifier: GPL-2.0-only
"""tools/precision.py builds and runs its program, writes what that measured, and refuses what it cannot use."""

import os
import pathlib
import subprocess
import sys

import pytest

CHECKOUT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("EVP_LMP", CHECKOUT / "build" / "lmp")).parent
VARIANTS = {"double", "mixed, strain in double", "mixed", "mixed, float positions", "single"}
FLOAT_ROUNDING = 2.0**-24


def tool(*words):
    environment = {**os.environ, "PYTHONPATH": str(CHECKOUT / "tools")}
    return subprocess.run([sys.executable, str(CHECKOUT / "tools" / "precision.py"), *map(str, words)], env=environment,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=300)


def tables(text):
    """{title: rows of cells} of the page's sections; the rows of a section's tables one after the other."""
    found = {}
    for section in text.split("\n## ")[1:]:
        lines = [line for line in section.splitlines() if line.startswith("| ")]
        found[section.splitlines()[0]] = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    return found


def test_page_holds_what_was_measured(tmp_path):
    page = tmp_path / "precision.md"
    run = tool("--build", BUILD, "--repeats", 2, "--cells", 4, 5, "--steps", 200, "--out", page)
    assert run.returncode == 0, run.stderr[-2000:]
    text = page.read_text(encoding="utf-8")
    assert run.stdout == text and "{" not in text
    found = tables(text)

    times = [row for row in found["Times"] if row[0] != "variant"]
    assert [row[0] for row in times].count("force_loop.h") == 2 and {row[0] for row in times} == VARIANTS | {"force_loop.h"}
    assert all(float(row[1].split()[0]) > 0.0 for row in times), times
    assert [row[0] for row in times if row[-1]] == 2 * ["mixed, float positions", "single"], "variants that copy"

    errors = {(float(row[0]), row[1]): float(row[2]) for row in found["Errors of the forces"] if row[0] != "strain"}
    assert {name for _, name in errors} == VARIANTS and len(errors) == 4 * len(VARIANTS)
    reach = float(text.split("coordinates up to ")[1].split()[0])
    for strain in (1e-5, 1e-4, 1e-3):
        theory = FLOAT_ROUNDING * reach / strain
        assert theory / 10 < errors[strain, "mixed, float positions"] < theory * 10
        assert errors[strain, "double"] < 1e-14 / strain
    noise = 1e-4 * errors[1e-4, "mixed, float positions"]
    assert f"{noise:.1e}" in " ".join(text.split()), "the text and the table say the same"

    ringing = [row for row in found["A body that rings"] if row[0] != "strain"]
    assert len(ringing) == 2 * len(VARIANTS) and all(0.0 < float(row[2]) < 1.0 for row in ringing)


@pytest.mark.parametrize("words", [("--repeats", "0"), ("--cells", "101"), ("--steps", "0")])
def test_bad_words_are_refused(words):
    run = tool(*words)
    assert run.returncode == 2 and "must be 1 at least, --cells between 1 and 100" in run.stderr


def test_folder_without_a_build_is_refused(tmp_path):
    page = tmp_path / "precision.md"
    run = tool("--build", tmp_path, "--out", page)
    assert run.returncode == 1 and "holds no build" in run.stderr
    assert not page.exists()


@pytest.mark.parametrize("words", [(), ("times", "4"), ("errors", "0"), ("errors", "4x"), ("ringing", "4", "-1"), ("other", "4", "4")])
def test_program_refuses_bad_words(words):
    subprocess.run(["cmake", "--build", str(BUILD), "--target", "precision"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=True)
    run = subprocess.run([str(BUILD / "precision"), *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    assert run.returncode == 2 and not run.stdout and run.stderr.startswith("usage: precision times CELLS ROUNDS")
