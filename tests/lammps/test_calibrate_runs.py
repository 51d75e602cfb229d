# SPDX-License-Identifier: GPL-2.0-only
"""tools/calibrate.py with lmp on a small body: the row, stopped on the way, the row in decks, the walk of the Howto page."""

import os
import re
import signal
import subprocess
import sys

import doc_blocks
import pytest
from evp import calibration, flow
from lammps_run import LMP, REPOSITORY

CALIBRATE = REPOSITORY / "tools" / "calibrate.py"
WORDS = ["--E", "70e9", "--nu", "0.33", "--yield", "95e6", "--stress", "150e6@0.04", "--density", "2700", "--name", "mine", "--spheres", "300", "--ranks", "1",
         "--heat", "soften 298 775 1", "--check", "500K"]
CURVE = flow.through(70e9, 95e6, ((150e6, 0.04),))
SECONDS = 120


def start(folder, words):
    return subprocess.Popen([sys.executable, CALIBRATE, *words, "--out", "my.evp"], cwd=folder, stdin=subprocess.DEVNULL,
                            env={**os.environ, "EVP_LMP": str(LMP)}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def calibrate(folder, words=WORDS, codes=(0, 3)):
    """Output of a calibration to its end; a body of few spheres may miss a target."""
    process = start(folder, words)
    output, _ = process.communicate(timeout=SECONDS)
    assert process.returncode in codes, output
    return output


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(folder, output) of a calibration that nothing disturbed."""
    folder = tmp_path_factory.mktemp("whole") / "in a folder:with spaces"
    folder.mkdir()
    return folder, calibrate(folder)


def residuals(output, way):
    """{strain [%]: residual [%]} that a calibration has told of a way."""
    line = re.search(rf"^{way}: (.*)$", output, re.M)[1]
    return {float(strain): float(off) for strain, off in re.findall(r"at ([\d.]+) % ([-+][\d.]+) %", line)}


def test_a_row_is_made_and_told(whole):
    """E and nu are met, and the flow curve by a body of 300 spheres within 8 %, though nothing is fitted to it. A name is taken once."""
    folder, output = whole
    text = (folder / "my.evp").read_text(encoding="utf-8")
    elastic = [float(off) for off in re.search(r"#   elastic: E ([-+][\d.]+) %, nu ([-+][\d.]+) %", text).groups()]
    assert max(map(abs, elastic)) <= 0.2 and "DATE: 20" in text and "by: calibrate.py --E 70e9" in text
    for way in ("tension", "compression", "tension at 500 K"):
        found = residuals(output, way)
        assert list(found) == [0.5, 1.0, 2.0] and max(map(abs, found.values())) < 8.0, (way, found)
    assert "#   tension at 500 K: 0.2 % yield" in text and "not in the row: conductivity capacity melt rate expansion: doc/Howto_evp_heat.rst; damage" in output
    assert "#   compression: 0.2 % yield" in text and "#   shear" not in text
    assert sorted(path.name for path in folder.iterdir()) == ["my.evp", "my.mine.png", "my.mine.png.csv"]
    assert (folder / "my.mine.png").stat().st_size > 10000
    assert "holds a row 'mine' already" in calibrate(folder, codes=(1,)) and (folder / "my.evp").read_text(encoding="utf-8") == text


def test_stopped_on_the_way(tmp_path):
    """By Ctrl-C: no file is left behind, and no run goes on."""
    process = start(tmp_path, [*WORDS, "--spheres", "1500", "--ranks", "2"])
    assert any(line.startswith("pass 1, elastic") for line in process.stdout)  # its longest runs begin
    process.send_signal(signal.SIGINT)
    output = process.communicate(timeout=SECONDS)[0]
    assert process.returncode == 130 and "interrupted" in output and not list(tmp_path.iterdir())


def test_walk_of_the_howto_page(tmp_path):
    """Its commands run as they stand, and the numbers that it prints come out. With an over-stress beside: gamma is in the row, and the over-stress of
    the damped run over its twin is the one asked for."""
    doc_blocks.prepare(tmp_path)
    blocks = [block.text for block in doc_blocks.blocks("doc/Howto_evp_metal.rst")][:6]
    text = "".join(blocks[k] for k in (0, 2, 3, 4))
    assert "--spheres 300" in text
    printed = doc_blocks.run(doc_blocks.Block("", text.replace("--spheres 300", "--spheres 300 --rate 10e6@200")).commands(), tmp_path)
    shown, found = (re.search(r"^(mymetal \S.*)$", output, re.M)[1].split() for output in (blocks[1], printed))
    assert [word for word in found if word.isalpha()] == [word for word in shown if word.isalpha()] and blocks[5].splitlines()[0] in printed
    ours, page = ([float(word) for k, word in enumerate(row) if k != 8 and not word.isalpha()] for row in (found, shown))  # but for gamma
    assert ours == pytest.approx(page, rel=0.02)
    again, modulus = (float(re.search(r"^ *pull\.csv +([\d.]+)", output, re.M)[1]) for output in (printed, blocks[5]))
    assert again == pytest.approx(modulus, rel=0.01)
    over = [float(off) for off in re.findall(r"^rate run \d+: .*, ([-+][\d.]+) %$", printed, re.M)]
    assert float(found[8]) > 0.0 and abs(over[-1]) <= 100.0 * calibration.WITHIN
