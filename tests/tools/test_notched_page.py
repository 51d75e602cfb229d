# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/notched_tension.py: numbers read off a known curve, the exponent of a known law, and the page."""

import notched_tension
import numpy as np
import pytest

FEW, MORE, MOST = 4000, 16000, 64000


def write_pull(folder, name="pull"):
    """Up to 200 MPa at 1 %, down to zero at 2 %."""
    strain = np.linspace(0.0, 0.03, 301)
    stress = 200e6 * np.interp(strain, (0.0, 0.01, 0.02), (0.0, 1.0, 0.0))
    lines = ["strain,stress_grip,stress_virial", *(f"{a:.9g},{b:.9g},0" for a, b in zip(strain, stress))]
    (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / f"{name}.broken").write_text("12", encoding="utf-8")


def known(spheres, seed, xi, folder):
    """Work as spacing^0.5 XI^1.5, which XI ~ spacing^-(1/3) keeps."""
    write_pull(folder, notched_tension.names(spheres, seed, xi)[1])
    work = 1000.0 * notched_tension.spacing(spheres) ** 0.5 * xi**1.5
    return notched_tension.Found(200.0, 0.01, 0.02, work * (1.0 + 0.01 * (seed - 1.5)), 12)


def test_rupture_of_a_triangle(tmp_path):
    write_pull(tmp_path)
    found = notched_tension.read_rupture(tmp_path, "pull")
    assert (found.peak, found.at, found.broken) == (pytest.approx(200.0), pytest.approx(0.01), 12)
    assert found.rupture == pytest.approx(0.0191) and found.work == pytest.approx(200e6 * 0.01 * 0.04 / 1e3, rel=0.01)


def test_spacing():
    assert notched_tension.spacing(FEW) == pytest.approx(1.349, abs=1e-3)
    assert notched_tension.spacing(FEW) / notched_tension.spacing(8 * FEW) == pytest.approx(2.0)


def test_page_of_known_runs(tmp_path, monkeypatch, capsys):
    """The exponent is found, the work is kept at each size, and the table has a row for each case."""
    monkeypatch.setattr(notched_tension, "pull", known)
    page = tmp_path / "page.md"
    notched_tension.main(["--out", str(page), "--work", str(tmp_path / "work"), "--spheres", str(FEW), str(MORE), str(MOST), "--seeds", "2", "2", "1"])
    capsys.readouterr()
    text = page.read_text(encoding="utf-8")
    assert "XI ~ spacing^-0.33, which gives" in text
    kept = [float(word) for word in text.partition("\nXI = ")[2].partition(" keep the work")[0].split(", ")]
    assert kept == pytest.approx([0.05 * (notched_tension.spacing(FEW) / notched_tension.spacing(n)) ** (1 / 3) for n in (FEW, MORE, MOST)], rel=0.01)
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| ")][1:]
    assert [row[0].strip("| ") + " " + row[1] + " " + row[4] for row in rows] == [
        f"{FEW} 2 constant XI", f"{MORE} 2 constant XI", f"{MOST} 1 constant XI", f"{MORE} 2 XI ~ 1/spacing", f"{MORE} 2 power of the spacing", f"{MOST} 1 power of the spacing"]
    works = [float(row[8].split()[0]) for row in rows]
    assert works[4] == pytest.approx(works[0], rel=0.01) and works[5] == pytest.approx(works[0], rel=0.01) and works[3] > works[0] > works[1] > works[2]
    assert (tmp_path / "figures" / "page.png").stat().st_size > 10000


@pytest.mark.parametrize("words", [["--spheres", "4000"], ["--spheres", "16000", "4000"], ["--seeds", "1", "2", "3"], ["--xi", "0"], ["--seeds", "0"]])
def test_bad_choices(words, capsys):
    with pytest.raises(SystemExit):
        notched_tension.main(words)
    assert "error: --" in capsys.readouterr().err
