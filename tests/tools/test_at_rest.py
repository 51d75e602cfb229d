# SPDX-License-Identifier: GPL-2.0-only
"""tests/oracle/at_rest.py: loading and release of the reference specimen with `plasticity isotropic`, against an independent prototype.

Numbers and what they mean: tests/data/reference_500, which states the tolerances."""

import json
import pathlib

import numpy as np
import pytest
from evp import curves, law, specimen
from oracle import at_rest

DATA = pathlib.Path(__file__).resolve().parents[1] / "data" / "reference_500"
PUBLISHED = json.loads((DATA / "specimen_500_plastic.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("key, coarser", (("table1_tension_2pc", 1), ("soft_compression_10pc", 2), ("table1_saturation_tension_5pc", 2),
                                          ("soft_density_kv1000_compression_10pc", 2)))
def test_loading_and_release_of_the_prototype(key, coarser):
    """coarser: increments in those of the prototype, of which results depend little."""
    published = PUBLISHED[key]
    body = specimen.read_data(DATA / "specimen_500.data")
    row = law.TABLE1._replace(**{name: float(published[name]) for name in ("e1", "e2", "xi_s") if name in published})
    pulled = at_rest.Specimen(body, row, published.get("saturation", 0.0), published["kv"])
    pulled.rest = pulled.rest._replace(gap=0.0 * pulled.rest.gap)  # the prototype has no rule for surfaces that close
    stress = {float(strain): value for strain, value in published["stress_MPa"].items()}
    top = max(stress, key=abs)
    even = np.linspace(0.0, top, round(abs(top) / published.get("increment", 0.001) / coarser) + 1).round(9)
    strains = sorted({*even, *stress}, key=abs)
    found = [0.0, *(1e-6 * pulled.move_to(strain) for strain in strains[1:])]
    for strain, value in stress.items():
        assert found[strains.index(strain)] == pytest.approx(value, rel=0.01), strain
    axial, lateral = specimen.middle_strains(body, pulled.x)
    if "volume_ratio_mid" in published:
        assert (1 + axial) * (1 + lateral)**2 - 1 == pytest.approx(published["volume_ratio_mid"], rel=0.03, abs=1e-4)
    else:
        assert axial + 2 * lateral == pytest.approx(published["vol_strain_mid"], rel=0.03, abs=1e-4)
    back = list(strains)
    for strain in strains[-2::-1]:
        back.append(strain)
        found.append(1e-6 * pulled.move_to(strain))
        if found[-1] * top <= 0.0:
            break
    assert curves.residual_strain(np.array(back), np.array(found)) == pytest.approx(published["residual_strain"], abs=0.02 * abs(top))
    if "mean_k" in published:
        assert pulled.k.mean() == pytest.approx(published["mean_k"], rel=0.02)
    if "unload_modulus_GPa" in published:
        n = len(strains) - 1
        assert 1e-3 * (found[n + 2] - found[n]) / (back[n + 2] - back[n]) == pytest.approx(published["unload_modulus_GPa"], rel=0.04)
