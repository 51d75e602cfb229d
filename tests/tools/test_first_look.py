# SPDX-License-Identifier: GPL-2.0-only
"""evp.first_look: its runs take choices that the decks have, its curves are those that the picture tells of, it draws what it finds."""

import re

import first_look
import inputs
import matplotlib.image
import numpy as np
import pytest
from evp import curves, run

FIGURES = run.CHECKOUT / "doc" / "figures"


def stored_curves():
    """{label: (strain, stress [MPa])} of the picture in the README."""
    rows = [line.rsplit(",", 2) for line in (FIGURES / "first_look.csv").read_text(encoding="utf-8").splitlines()[1:]]
    return {label: np.array([(float(a) / 100, float(b)) for name, a, b in rows if name.strip('"') == label]).T for label in first_look.SWEEPS.values()}


def test_choices_are_known():
    """Of each deck; LAMMPS passes over a misspelled -var."""
    for _, words in first_look.commands(300, 600):
        if "-in" in words:
            deck = open(words[words.index("-in") + 1], encoding="utf-8").read() + (run.DECKS / "frames.lmp").read_text(encoding="utf-8")
            names = [words[k + 1] for k, word in enumerate(words) if word == "-var"]
            assert len(names) > 4 and all(re.search(rf"^variable +{name} +index |is_defined\(variable,{name}\)", deck, re.M) for name in names)


def test_picture_tells_that_eq_8_comes_back_and_plasticity_does_not():
    kept = stored_curves()
    (back, flowed) = (curves.residual_strain(*kept[first_look.SWEEPS[plasticity]]) for plasticity in ("none", "isotropic"))
    assert abs(back) < 1e-4 and flowed > 0.01
    loading = [curve[:, : np.argmax(curve[0])] for curve in kept.values()]
    assert np.interp(0.01, *loading[0]) == pytest.approx(np.interp(0.01, *loading[1]), rel=0.01)


def test_it_draws_what_the_runs_left(tmp_path):
    """A picture as large as that of the README, and the curves beside it."""
    strain = np.concatenate([np.linspace(0, 0.02, 21), np.linspace(0.02, 0, 21)])
    for plasticity, stress in (("none", 1e10 * strain), ("isotropic", 1e10 * (strain - 0.01 * (np.arange(42) > 20)))):
        rows = "".join(f"{a:.6g},{b:.6g},{b:.6g},{a:.6g}\n" for a, b in zip(strain, stress))
        (tmp_path / f"{plasticity}.csv").write_text("strain,stress_grip,stress_virial,strain_gauge\n" + rows, encoding="utf-8")
    for name, columns in (("isotropic_state", [(0.0, 0.01, 0.02)]), ("impact_frames", [(0.0, 0.0, 0.0), (0.0, 0.1, 0.2)])):
        text = [inputs.snapshot("id x y z radius plastic_strain", [(k, 0.002 * k, 0.001, 0.001 * step, 0.001, value) for k, value in enumerate(strains, 1)],
                                step, "ITEM: UNITS\nsi") for step, strains in enumerate(columns)]
        (tmp_path / f"{name}.dump").write_text("".join(text), encoding="utf-8")
    drawn = matplotlib.image.imread(first_look.compose(tmp_path, tmp_path / "out"))
    stored = matplotlib.image.imread(FIGURES / "first_look.png")
    assert drawn.shape == stored.shape and np.mean(np.abs(drawn - stored)) > 0.02, "another picture, of the same size"
    kept = (tmp_path / "out" / "first_look.csv").read_text(encoding="utf-8").splitlines()
    assert len(kept) == 1 + 2 * len(strain) and (FIGURES / "first_look.png").stat().st_size < 250e3
