# SPDX-License-Identifier: GPL-2.0-only
"""The line of progress: time left once it can be told, the time so far before."""

import pytest
from evp import part, progress


@pytest.mark.parametrize("done, told", [(0.0, "0 %, 10 s so far: run"), (4.0, "4 %, 10 s so far: run"), (5.0, "5 %, about 3 min 10 s left: run"),
                                        (50.0, "50 %, about 10 s left: run")])
def test_time_left_is_told_from_five_percent_on(monkeypatch, capsys, done, told):
    clock = iter((100.0, 110.0))
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    progress.Progress("packing", 100.0).show(done, "run")
    assert capsys.readouterr().err.split(None, 1)[1].strip() == told


def test_share_of_a_packing_is_that_of_its_time(tmp_path):
    """The first of the lines comes after nearly half of the time."""
    log = tmp_path / "log"
    assert part.share_done(log) == 0.0
    for text, share in (("LAMMPS\n", 0.0), ("Specimen of 9 spheres: 0 % done, about\n", part.FIRST), ("Specimen of 9 spheres: 5 % done, a\n", 0.4775),
                        ("Specimen of 9 spheres: 5 % done\nSpecimen of 9 spheres: 100 % done, a\n", 1.0)):
        log.write_text(text, encoding="utf-8")
        assert part.share_done(log) == pytest.approx(share)
