# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/rupture_work.py: works read off a known curve, and where its table goes."""

import numpy as np
import pytest
import rupture_work
from evp.run import RunError


def write_pull(folder, strain, stress):
    lines = ["strain,stress_grip,stress_virial", *(f"{a:.9g},{b:.9g},0" for a, b in zip(strain, stress))]
    (folder / "pull.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "pull.broken").write_text("12", encoding="utf-8")


def test_works_of_a_triangle(tmp_path):
    """Up to 200 MPa at 2 %, down to zero at 6 %: a tenth of the stress is left at 5.6 %."""
    strain = np.linspace(0.0, 0.08, 801)
    write_pull(tmp_path, strain, 200e6 * np.interp(strain, (0.0, 0.02, 0.06), (0.0, 1.0, 0.0)))
    found = rupture_work.read_pull(tmp_path, "pull")
    assert found.peak == pytest.approx(200.0) and found.broken == 12
    assert found.before == pytest.approx(0.5 * 200e6 * 0.02 * 0.04 / 1e3)
    assert found.after == pytest.approx(0.5 * (200e6 + 20e6) * 0.036 * 0.04 / 1e3, rel=1e-2)


def test_a_body_that_holds_has_no_work_of_rupture(tmp_path):
    strain = np.linspace(0.0, 0.08, 81)
    write_pull(tmp_path, strain, 200e6 * np.interp(strain, (0.0, 0.02, 0.08), (0.0, 1.0, 0.2)))
    with pytest.raises(RunError, match="has not parted at a strain of 0.08"):
        rupture_work.read_pull(tmp_path, "pull")


def test_scaled_keeps_xi_times_the_spacing():
    assert rupture_work.scaled(0.05, 500) == 0.05
    assert rupture_work.scaled(0.05, 4000) == pytest.approx(0.1)


def test_table_goes_between_the_marks(tmp_path, monkeypatch):
    page = tmp_path / "page.rst"
    page.write_text(f"before\n{rupture_work.START}old\n{rupture_work.END}after\n", encoding="utf-8")
    monkeypatch.setattr(rupture_work, "pull", lambda spheres, seed, xi, folder: rupture_work.Found(200.0 + seed, spheres, 100.0 * xi, seed))
    rupture_work.main(["--out", str(page), "--work", str(tmp_path / "work")])
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n") and text.endswith("after\n") and "old" not in text
    assert text.count("   * - ") == 1 + 4 + 3, "header, one XI, the other but for 500 spheres"
    assert "   * - 4000\n     - 0.1\n     - 202 +- 0\n     - 4000 +- 0\n     - 10 +- 0\n     - 4010 +- 0\n     - 2 +- 0\n" in text
