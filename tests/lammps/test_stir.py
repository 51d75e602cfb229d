# SPDX-License-Identifier: GPL-2.0-only
"""in.stir: what sticks to the pin follows it, the plate warms and softens, energies and heat close. in.seam: what a seam holds."""

import re

import numpy as np
import pytest
from lammps_run import DECKS, packed, read_csv, run_lammps

plate = packed("plate.data", n=3000, shape="block", length=0.026, width=0.022, height=0.005)
TMELT = 775.0


def stirred(folder, plate, **choices):
    run = run_lammps("in.stir", 1, {"specimen": plate, "dwell": 0.06, "turns": 0, "out": "stir", **choices}, folder).ok()
    last = next(line for line in run.stdout.splitlines() if line.startswith("in.stir: in the last row"))
    return run, read_csv(folder / "stir.csv"), last


def test_a_pin_that_sticks(tmp_path, plate):
    """The layer beside it follows, which takes twice the torque of a pin that holds as the plate does, and the plate warms; a shoulder rubs."""
    (tmp_path / "slips.lmp").write_text("pair_coeff 1 2 evp/lj ${plate_words}\n", encoding="utf-8")
    ends = {}
    for pin, choices in (("sticks", {}), ("slips", {"shoulder_radius": 0, "also": "slips.lmp"})):
        run, rows, last = stirred(tmp_path, plate, **choices)
        ends[pin] = {name: np.mean(values[-3:]) for name, values in rows.items()}
        plastic, heat = (float(last.split(f"{kind} imbalance ")[1].split()[0]) for kind in ("energy", "heat"))
        assert abs(plastic) < 1e-3 and abs(heat) < 1e-9
        assert TMELT * 1.001 > rows["temperature_highest"].max() > 350.0 and 5 < len(rows["turns"]) < 9
        assert rows["thermocouple_1"][-1] > rows["thermocouple_5"][-1] >= 298.0
    assert ends["sticks"]["follow_first"] > 0.75 and ends["slips"]["follow_first"] < 0.2
    assert -ends["sticks"]["torque_pin"] > 1.5 * -ends["slips"]["torque_pin"] > 30.0
    assert ends["sticks"]["torque_shoulder"] < 0.0 == ends["slips"]["torque_shoulder"]


def test_it_travels(tmp_path, plate):
    """Along x, by the advance of a turn; the tool keeps its shape. The rate from which metal hardens is as many times as fast as the pin; a plate
    above TMELT is told."""
    row = re.search(r'^variable coeff +index "([^"]+)"', (DECKS / "in.stir").read_text(encoding="utf-8"), re.M)[1].replace("&\n", "")
    start = f"print 'plate: ${{plate_words}}'\nwrite_dump all custom start.dump id type x y z modify sort id format float %.12g\ninclude {DECKS}/frames.lmp\n"
    (tmp_path / "start.lmp").write_text(start, encoding="utf-8")
    row = row.replace("soften 298 775 1 melt 397e3", "soften 298 300 1 0.99") + " rate 0.01 3"
    run, _, _ = stirred(tmp_path, plate, dwell=0, turns=0.02, feed=19000, also="start.lmp", frames=4, coeff=row, faster=20)
    assert any("above TMELT, 300 K" in line for line in run.warnings())
    assert " rate 0.01 60 " in re.search("^plate: .*", run.stdout, re.M)[0]
    assert [frame.step > 0 for frame in run.dump("stir_frames.dump")] == [False, True, True, True, True]
    start, end = run.dump("start.dump")[-1], run.dump("stir_state.dump")[-1]
    shoulder, turned = end["type"] == 3, 2.0 * np.pi * 0.02
    x, y = (start[name][start["type"] == 3] for name in "xy")
    axis = 0.3 * 0.026
    assert end["x"][shoulder] == pytest.approx(axis + 0.02 * 0.01 + (x - axis) * np.cos(turned) - y * np.sin(turned), abs=1e-7)
    assert np.ptp(end["z"][shoulder]) < 1e-9 and np.any(end["type"] == 2)
    wake = {key: float(value) for key, value in re.findall(r"^variable (path_\w+) string (\S+)", (tmp_path / "stir.wake").read_text(encoding="utf-8"), re.M)}
    diameter = 2.0 * np.mean(end["radius"][~shoulder])
    assert wake["path_end"] - wake["path_start"] == pytest.approx(0.02 * 0.01 - diameter, abs=1e-5)


def test_a_seam_that_was_never_stirred(tmp_path, plate):
    """Holds nothing beside the plate; one plate holds as before, also where it forgets a hardening that it does not have; without from and to there is no strip."""
    for seam, hardening, least, most in (("all exposure 0.4 pressure 1", "kept", 0.0, 0.02), ("no", "forgotten", 0.97, 1.03)):
        assert stirred(tmp_path, plate, dwell=0, seam=seam)[0].warnings() == []
        choices = {"stirred": "stir", "from": 0.014, "to": 0.019, "hardening": hardening, "strain": 0.05, "out": "seam", "also": DECKS / "frames.lmp", "frames": 2}
        run = run_lammps("in.seam", 1, choices, tmp_path).ok()
        strength, ratio, whole = re.search(r"in.seam: strength (\S+) MPa over .* (\S+) of that of the plate, (\S+) MPa", run.stdout).groups()
        assert len(run.dump("seam_frames.dump")) == 3 and run.warnings() == []
        for imbalance, work in re.findall(r"energy imbalance (\S+) J, plastic work (\S+) J", run.stdout):
            assert abs(float(imbalance)) < 1e-3 * max(float(work), 0.01)
        assert least < float(ratio) < most and float(whole) > 300.0
        for name, found in (("seam", strength), ("seam_uncut", whole)):
            stress, strain = (read_csv(tmp_path / f"{name}.csv")[title] for title in ("stress", "strain"))
            assert np.all(np.diff(strain) > 0.0), "no row of another piece"
            assert max(stress[max(1, k - 4):k + 1].mean() for k in range(1, len(stress))) == pytest.approx(1e6 * float(found), rel=1e-4)
    deep = run_lammps("in.stir", 1, {"specimen": plate, "depth": 0.0029}, tmp_path)
    assert deep.returncode == 1 and "depth must be at most 0.00" in deep.stdout
    wrong = run_lammps("in.stir", 1, {"specimen": plate, "seam": "yes"}, tmp_path)
    assert wrong.returncode == 1 and "seam must be no, all, or all exposure Y0 pressure S0" in wrong.stdout
    refused = run_lammps("in.seam", 1, {"stirred": "stir"}, tmp_path)
    assert refused.returncode == 1 and "it has not passed a strip" in refused.stdout
