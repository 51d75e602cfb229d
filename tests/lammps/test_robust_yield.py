# SPDX-License-Identifier: GPL-2.0-only
"""Robustness: rows with `yield`, whose spheres flow at the flow stress of the row, and do not yield under pressure."""

import numpy as np
import pytest
from flowing import read_pairs
from robust import on
from small_bodies import SPACING, head, lattice_body, thermo, write_body
from test_yield import DT, FLOW, KV, ROW, STRESS, style

ALONG = {"one edge": (1.0, -0.5, -0.5), "one edge back": (-1.0, 0.5, 0.5), "two edges": (1.0, -1.0, 0.0)}  # rates of the edges, to be scaled
RATE, STRAIN = 100.0, 0.05


def periodic_run(bench, rates, steps, condition=True):
    """A run in which the edges of a periodic lattice body change at these true rates [1/s]; stresses c_press[1..3] [Pa] without those of the motion."""
    body = lattice_body((5, 5, 5), "xyz")
    write_body(bench.folder / "body.data", body._replace(types=np.ones_like(body.types)))
    material = style(body, "none", KV)
    if not condition:
        material = material.replace(f" yield {STRESS}", "")
    load = "fix load all deform 1 " + " ".join(f"{axis} trate {rate:.17g}" for axis, rate in zip("xyz", rates)) + " remap x\n"
    text = head(boundary="p p p") + material + f"fix move all nve\ntimestep {DT}\nthermo {steps // 50}\n" + load + "compute press all pressure NULL pair fix\n"
    return bench.run(text + thermo("time lx ly lz c_press c_press[1] c_press[2] c_press[3]") + f"run {steps}\nwrite_evp_bonds end.bonds\n").ok()


def equivalent(along):
    """Of von Mises, of what has these components along the edges."""
    return np.sqrt(0.5 * sum((along[k] - along[k - 1]) ** 2 for k in range(3)))


@on(1, 2)
@pytest.mark.parametrize("way", ALONG)
def test_metal_that_flows_along(bench, way):
    """A body on a lattice, stretched at constant volume: stress within 5 % of the flow curve from a strain of 1 % on.
    Control: without yield it is more than 20 % off."""
    rates = RATE * np.array(ALONG[way]) / (2.0 / 3.0 * equivalent(ALONG[way]))
    off = []
    for condition in (True, False):
        table = periodic_run(bench, rates, round(STRAIN / RATE / DT), condition).thermo()
        strain = RATE * table["Time"]
        ratio = equivalent([table[f"c_press[{k}]"] for k in (1, 2, 3)]) / (STRESS * np.interp(strain, FLOW[::2], FLOW[1::2]))
        off.append(np.abs(ratio[strain > 0.01] - 1.0))
    assert off[0].max() < 0.05 and off[1].min() > 0.2
    bench.show(f"off by at most {100 * off[0].max():.1f} %, without yield by {100 * off[1].min():.0f} % and more")


@on(1, 2)
def test_pressure_alone_hardens_nothing(bench):
    """A body that is pressed alike on all sides to several times its flow stress: the pressure is that of the elastic body within 20 %, and of the plastic strain
    that its plastic work is in shear there is hardly any, 10 %. Control: a pressure of more than four times the flow stress."""
    run = periodic_run(bench, [-40.0] * 3, 700)
    table = run.thermo()
    strain, pressure = 1.0 - table["Lx"] * table["Ly"] * table["Lz"] / (table["Lx"] * table["Ly"] * table["Lz"])[0], table["c_press"]
    assert strain[3] < ROW.xi_s, "control"
    off = np.abs(pressure[3:] / (pressure[3] / strain[3] * strain[3:]) - 1.0).max()
    spheres = read_pairs(bench.folder / "end.bonds")
    p, work = (np.array(list(spheres.column(name).values())) for name in ("plastic_strain", "plastic_work"))
    hardened = np.mean(p) / (np.mean(work) / (STRESS * SPACING**3))
    assert off < 0.2 and hardened < 0.1
    assert pressure[-1] > 4.0 * STRESS, "control"
    bench.show(f"pressure {pressure[-1] / STRESS:.1f} times the flow stress, off by at most {100 * off:.1f} %; {100 * hardened:.1f} % of the plastic strain")
