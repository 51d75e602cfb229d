# SPDX-License-Identifier: GPL-2.0-only
"""tools/body.py that is stopped: one line, and nothing is left."""

import os
import signal
import subprocess
import sys
import time

import pytest
from lammps_run import REPOSITORY

PART = REPOSITORY / "tests" / "data" / "parts" / "plate_with_hole.stl"
SECONDS = 60


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_stopped_while_it_packs(tmp_path, end):
    """Its lmp says in `work` that it runs, and then does nothing."""
    pytest.importorskip("open3d")
    work, out, lmp = (tmp_path / name for name in ("work", "part.data", "lmp"))
    work.mkdir()
    out.write_text("that of before", encoding="utf-8")
    lmp.write_text(f"#!/bin/sh\necho $$ > {work}/running\nexec sleep {SECONDS}\n", encoding="utf-8")
    lmp.chmod(0o755)
    process = subprocess.Popen([sys.executable, REPOSITORY / "tools" / "body.py", PART, "--n", "3000", "--out", out], stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**os.environ, "EVP_LMP": str(lmp), "TMPDIR": str(work)})
    limit = time.monotonic() + SECONDS
    while not (work / "running").exists() or not (work / "running").read_text(encoding="utf-8").strip():
        assert process.poll() is None and time.monotonic() < limit, process.communicate()[0]
        time.sleep(0.05)
    process.send_signal(end)
    said = process.communicate(timeout=SECONDS)[0]
    assert process.returncode == 130 and said.splitlines()[-1] == "body.py: interrupted; nothing was written" and "Traceback" not in said
    assert [path.name for path in work.iterdir()] == ["running"] and out.read_text(encoding="utf-8") == "that of before"
    with pytest.raises(ProcessLookupError):
        os.kill(int((work / "running").read_text(encoding="utf-8")), 0)
