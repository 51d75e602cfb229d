# SPDX-License-Identifier: GPL-2.0-only
"""in.stir: what sticks to the pin follows it, the plate warms and softens, energies and heat close."""

import numpy as np
import pytest
from lammps_run import packed, read_csv, run_lammps

plate = packed("plate.data", n=3000, shape="block", length=0.026, width=0.022, height=0.005)
TMELT = 775.0


def stirred(folder, plate, **choices):
    run = run_lammps("in.stir", 2, {"specimen": plate, "dwell": 0.06, "turns": 0, "out": "stir", **choices}, folder).ok()
    last = next(line for line in run.stdout.splitlines() if line.startswith("in.stir: torque"))
    return run, read_csv(folder / "stir.csv"), last


def test_a_pin_that_sticks(tmp_path, plate):
    """The layer beside it follows, which takes twice the torque of a pin that holds as the plate does, and the plate warms; a shoulder rubs."""
    ends = {}
    for stick, shoulder in ((10, 2.8), (0, 0)):
        run, rows, last = stirred(tmp_path, plate, stick=stick, shoulder=shoulder)
        ends[stick] = {name: np.mean(values[-3:]) for name, values in rows.items()}
        plastic, heat = (float(last.split(f"{kind} imbalance ")[1].split()[0]) for kind in ("energy", "heat"))
        assert abs(plastic) < 1e-3 and abs(heat) < 1e-9
        assert TMELT * 1.001 > rows["temperature_highest"].max() > 350.0 and len(rows["turns"]) == 7
    assert ends[10]["follow_first"] > 0.75 and ends[0]["follow_first"] < 0.2
    assert -ends[10]["torque_pin"] > 1.5 * -ends[0]["torque_pin"] > 30.0
    assert ends[10]["torque_shoulder"] < 0.0 == ends[0]["torque_shoulder"]


def test_it_travels(tmp_path, plate):
    """Along x, by the advance of a turn; the tool keeps its shape."""
    (tmp_path / "start.lmp").write_text("write_dump all custom start.dump id type x y z modify sort id format float %.12g\n", encoding="utf-8")
    run, _, _ = stirred(tmp_path, plate, dwell=0, turns=0.02, advance=0.01, also="start.lmp")
    start, end = run.dump("start.dump")[-1], run.dump("stir_state.dump")[-1]
    shoulder, turned = end["type"] == 3, 2.0 * np.pi * 0.02
    x, y = (start[name][start["type"] == 3] for name in "xy")
    axis = 0.3 * 0.026
    assert end["x"][shoulder] == pytest.approx(axis + 0.02 * 0.01 + (x - axis) * np.cos(turned) - y * np.sin(turned), abs=1e-7)
    assert np.ptp(end["z"][shoulder]) < 1e-9 and np.any(end["type"] == 2)
