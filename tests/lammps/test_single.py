# SPDX-License-Identifier: GPL-2.0-only
"""single(): what compute pair/local shows adds up to the energies and forces of the run, from the same law."""

import numpy as np
import pytest
from common_bodies import scattered
from evp import law
from oracle import brute
from lammps_run import write_state
from small_bodies import ROUND_OFF, head, mass_of, pair

SHOW = """
fix hold all nve/noforce
run 0
read_dump state.dump 0 x y z vx vy vz box no replace yes

compute ids all property/local patom1 patom2
compute pairs all pair/local dist eng force p1 p2 p3
compute e all pe/atom
compute s all stress/atom NULL
compute sum_e all reduce sum c_e
compute sum_s all reduce sum c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] c_s[6]
compute press all pressure NULL virial
dump pairs all local 1 pairs.dump c_ids[1] c_ids[2] c_pairs[1] c_pairs[2] c_pairs[3] c_pairs[4] c_pairs[5] c_pairs[6]
dump_modify pairs format float %.17g
dump all all custom 1 atoms.dump id x y z vx vy vz fx fy fz
dump_modify all format float %.17g
thermo_style custom step pe c_sum_e vol c_press[*] c_sum_s[*]
thermo_modify norm no format float %.17g
run 0
"""


@pytest.mark.parametrize("ranks, newton, contact, gamma",
                         [(1, "on", "literal", 0), (1, "off", "repulsive", 0), (1, "on", "none", 0),
                          (2, "off", "literal", 1000), (4, "on", "literal", 1000)])
def test_pair_local_adds_up(lmp, tmp_path, pulled_body, ranks, newton, contact, gamma):
    body = pulled_body._replace(x=scattered(pulled_body.x, pulled_body.bonds, pulled_body.radius))
    write_state(tmp_path / "state.dump", body.x, body.v, body.box)
    row = law.TABLE1._replace(gamma=gamma)
    run = lmp(head(newton, start=f"read_data {body.data}") + pair(row, contact) + SHOW, ranks=ranks).ok()
    atoms, pairs = run.dump("atoms.dump")[-1], run.dump("pairs.dump")[-1]
    thermo = run.thermo()
    i, j = (pairs[f"c_ids[{k}]"].astype(int) - 1 for k in (1, 2))
    d, energy, force, deq, strain, regime = (pairs[f"c_pairs[{k}]"] for k in range(1, 7))
    x, v = atoms.vectors("x", "y", "z"), atoms.vectors("vx", "vy", "vz")

    key = np.minimum(i, j) * len(x) + np.maximum(i, j)
    assert len(np.unique(key)) == len(key), "each pair stands there once"
    truth = brute.brute_force(x, v, body.radius, body.types, row, body.bonds, contact)

    # energies and forces of the pairs add up to those of the run
    assert abs(energy.sum() - thermo["PotEng"][-1]) < ROUND_OFF * np.abs(energy).sum()
    on_i = force[:, None] * (x[i] - x[j]) / d[:, None]
    total, scale = np.zeros_like(x), np.zeros(len(x))
    for own, sign in ((i, 1.0), (j, -1.0)):
        np.add.at(total, own, sign * on_i)
        np.add.at(scale, own, np.abs(force))
    error = np.linalg.norm(total - atoms.vectors("fx", "fy", "fz"), axis=1)
    assert np.max(error / scale) < ROUND_OFF

    # p1 p2 p3: deq, signed strain, regime; regime 0 is a pair that does not act
    recorded = np.array([body.bonds.get((min(a, b), max(a, b)), 0.0) for a, b in zip(i + 1, j + 1)])
    expected = np.where(recorded > 0.0, recorded, body.radius[i] + body.radius[j])
    assert np.allclose(deq, expected, rtol=ROUND_OFF, atol=0.0)
    assert np.allclose(strain, (d - deq) / deq, rtol=0.0, atol=ROUND_OFF)
    assert set(np.unique(regime)) <= {0.0, 1.0, 2.0}
    assert np.all((energy == 0.0) & (force == 0.0) | (regime > 0.0))
    acting = regime > 0.0
    assert acting.sum() == len(truth["i"])
    assert np.sum((regime == 2.0) & (recorded > 0.0)) == truth["bonds_second"]
    assert np.sum(acting & (recorded == 0.0)) == truth["new_contacts"]
    assert (truth["new_contacts"] > 3) == (contact != "none"), "control: new pairs act"

    # per-atom energies and stresses add up as well
    assert abs(thermo["c_sum_e"][-1] - thermo["PotEng"][-1]) < ROUND_OFF * np.abs(energy).sum()
    reach = np.abs(body.box).max() + 3.0 * body.radius.max()  # the global virial is summed as x f
    kinetic = np.array([np.sum(mass_of(body.radius) * v[:, a] * v[:, b]) for a, b in
                        ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
    for k in range(6):
        virial = thermo[f"c_press[{k + 1}]"][-1] * thermo["Volume"][-1]
        per_atom = -thermo[f"c_sum_s[{k + 1}]"][-1] - kinetic[k]
        assert abs(virial - per_atom) < ROUND_OFF * (reach * scale.sum() + np.abs(kinetic).sum())
