# SPDX-License-Identifier: GPL-2.0-only
"""The commands of 'Look at a result' in doc/Howto_evp.rst, run as they stand, and the picture beside them."""

import os
import pathlib
import re
import subprocess

import matplotlib.image
import numpy as np
from evp import dump, run

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
SECTION = (REPOSITORY / "doc" / "Howto_evp.rst").read_text(encoding="utf-8").partition("**Look at a result**")[2].partition("References\n")[0]
COMMANDS = re.search(r"code-block:: bash\n\n((?:   .*\n)+)", SECTION)[1].replace("\n   ", "\n").strip().splitlines()
WRITTEN = ("torn.png", "torn_end.png", "torn.gif", "torn.pvd", "torn_table.csv")


def test_commands_of_the_page(tmp_path):
    """From the checkout's root: each file is written, the body is torn, and the picture of the page is that of its command."""
    assert [words.split()[0] for words in COMMANDS] == ["lmp"] + 4 * ["tools/view.py"] + ["tools/curves.py"]
    for name in ("lammps_inputs", "tests", "tools"):
        (tmp_path / name).symlink_to(REPOSITORY / name)
    script = "\n".join(["set -e", f"lmp() {{ {run.lammps_command()[0]} \"$@\"; }}", *COMMANDS])
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, env={**os.environ, **run.environment()}, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert all((tmp_path / name).stat().st_size > 100 for name in WRITTEN)
    series = dump.index([tmp_path / "torn_frames.dump"])
    assert len(series) == 11 and series[-1].read()["share_lost"].max() > 0.5 and series[0].read()["share_lost"].max() == 0.0
    drawn, shown = (matplotlib.image.imread(folder / "torn.png") for folder in (tmp_path, REPOSITORY / "doc" / "figures"))
    assert drawn.shape == shown.shape and np.mean(np.abs(drawn - shown)) < 0.02, "make it again by the command of the page"
