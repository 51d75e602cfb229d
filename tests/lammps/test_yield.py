# SPDX-License-Identifier: GPL-2.0-only
"""Rows with `yield`: spheres that flow at the flow stress of their row, and the volume energy that takes over what bonds no longer carry."""

import numpy as np
import pytest
from evp import law
from flowing import flow_words, read_pairs
from oracle import brute, metal, volume
from small_bodies import dump, head, lattice_body, mass_of, velocities, words, write_body

ROW = law.TABLE1._replace(xi_s=0.002)
FLOW = (0, 1, 0.02, 1.4, 0.2, 1.8)
STRESS, DENSITY, KV = 8e6, 2000.0, 500.0
DT, STEPS = 3e-7, 300
PULL = velocities("150*(x-0.025)+40*sin(5.1*id)", "-60*(y-0.02)+40*cos(7.3*id)", "-90*(z-0.02)+40*sin(2.7*id)")


def body_of():
    """One type, as spacing and coordination are measured by types."""
    body = lattice_body((5, 4, 4))
    return body._replace(types=np.ones_like(body.types))


def measures(body):
    """Spacing and coordination, of the body itself: nothing is scaled."""
    return float(np.mean(list(body.bonds.values()))), 2.0 * len(body.bonds) / len(body.x)


def row_words(body, more=""):
    spacing, coordination = measures(body)
    return f"{words(ROW)} spacing {spacing:.17g} coordination {coordination:.17g} density {DENSITY} yield {STRESS}{flow_words(FLOW)}{more}"


def style(body, contact="none", kv=0.0, more=""):
    text = f"pair_style evp/lj contact {contact} plasticity isotropic\npair_coeff * * {row_words(body)}{more}\nfix bonds all evp/bonds\n"
    return text + (f"fix volume all evp/volume {kv}\n" if kv else "")


VALUES = "plastic_strain yield_factor equivalent_stress equivalent_stress_around".split()


@pytest.mark.parametrize("contact, kv, ranks, newton", [("none", 0.0, 1, "on"), ("none", KV, 2, "off"), ("join 1.2", 0.0, 4, "on"), ("none", KV, 4, "on")])
def test_a_body_against_the_second_writing(lmp, tmp_path, contact, kv, ranks, newton):
    """Motion, plastic strains, factors and stresses of a body that is pulled, with the volume energy and what it takes over, as tests/oracle has them."""
    body = body_of()
    write_body(tmp_path / "body.data", body)
    text = head(newton) + style(body, contact, kv) + PULL + f"fix move all nve\ntimestep {DT}\nthermo {STEPS}\n" + dump(every=STEPS)
    run = lmp(text + f"run {STEPS}\nwrite_evp_bonds end.bonds\n", ranks).ok()
    first, last = run.dump("all.dump")
    condition = metal.Yield(STRESS, DENSITY)
    energy = None
    if kv:
        i, j = np.array(list(body.bonds)).T - 1
        rest = volume.at_rest(i, j, np.array(list(body.bonds.values())), ROW.alpha * (body.radius[i] + body.radius[j]), len(body.x))
        bulk = ROW.m1 * ROW.n1 * ROW.e1 * measures(body)[1] / 18.0
        energy = metal.Volume(kv, rest, (bulk, 2.0 * ROW.xi_s))
    own = metal.Metal(first.x, first.v, body.radius, mass_of(body.radius), ROW, body.bonds, DT, FLOW, contact=contact.split()[0],
                      near=np.stack(np.triu_indices(len(body.x), 1), axis=1) if kv else None, condition=condition, volume_energy=energy).run(STEPS)
    assert np.abs(last.x - own.x).max() < 1e-10 and np.abs(last.v - own.v).max() < 1e-7 * np.abs(own.v).max()
    pairs = read_pairs(tmp_path / "end.bonds")
    for name, values in zip(VALUES, (own.p, own.factor, own.along, own.mean_stress)):
        found = pairs.column(name)
        assert np.array([found[k] for k in sorted(found)]) == pytest.approx(values, rel=1e-6, abs=1e-8 * np.abs(values).max()), name
    assert pairs.joined == own.joined and pairs.ended == own.ended
    assert own.p.max() > 0.01 and np.ptp(own.factor) > 0.02, "control"
    assert not kv or abs(own.by_volume.theta).max() > 3.0 * 2.0 * ROW.xi_s, "control: bonds have yielded under pressure"
