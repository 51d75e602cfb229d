#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Plastic flow at large strain: simple shear of a periodic packing of 2024-T351, with contact join and with the other rules of new pairs.

in.specimen packs the spheres in a periodic box, in.shear shears them at constant volume to a strain of 4, one of them to 10. About 20 minutes on one core.
"""

import re
from typing import NamedTuple

from study import CHECKOUT, Study, ratios, spread
import numpy as np
from evp import dump
from evp.calibration import MISES
from metals import METALS

MPA = 1e6
RATE = 200  # of shear strain [1/s]
VOLUME = np.pi * 0.02**2 * 0.05  # [m3] of the box, that of the paper's cylinder
POTENTIALS, ROW = CHECKOUT / "potentials" / "metals.evp", "aluminium_2024T351"
GAMMA = 100  # [N s/m] of eq. 8, which else dissipates nothing
END, LIMIT = 4.0, 15  # strain to which rules are compared; [%] within which the stress should be
WINDOWS = ((0.05, 0.5), (0.5, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, END))
SMOOTH = 10  # rows in the means of which the largest difference is told
TIMED, ROUNDS = 0.2, 5  # strain and rounds of the runs whose time is told
COLUMNS = ("strain", "shear_stress", "pressure", "spent", "plastic", "bonds", "joined", "ended", "nearest")
# Taken in by in.shear: every row with its energies and bonds.
ALSO = f"""
fix             energy all evp/energy
print           "{','.join(COLUMNS)}" file ${{out}}_energies.csv screen no
variable        next_row equal (floor(step/v_every)+1)*v_every  # in.shear ends with a run of no step
fix             energies all print v_next_row "$(v_strain_now:%.9g),$(f_rows[2]:%.9g),$(f_rows[3]:%.9g),$(f_energy+f_energy[13]:%.9g),$(f_energy[9]:%.9g),&
$(f_bonds-f_bonds[1]-f_bonds[5]+f_bonds[6]),$(f_bonds[6]),$(f_bonds[5]),$(f_bonds[4]:%.6g)" append ${{out}}_energies.csv screen no title {','.join('0' for _ in COLUMNS)}
"""


class Case(NamedTuple):
    """A run: rule of new pairs, spheres, seed of the packing, plasticity, strain at the end; whether the elastic limit goes on beyond the table of the row, as the flow curve does."""

    contact: str
    spheres: int
    seed: int = 1
    plasticity: str = "isotropic"
    end: float = END
    goes_on: bool = False

    @property
    def label(self):
        return f"{self.contact}{', eq. 8' * (self.plasticity == 'none')}{', flow to 6' * self.goes_on}, N = {self.spheres}{', another packing' * (self.seed > 1)}"


FAR = Case("join 1.2", 1000, end=10.0)
LONGER = FAR._replace(goes_on=True)
PLAN = (FAR, LONGER, Case("join 1.2", 1000, 2), Case("join 1.2", 2000), Case("join 1.0", 1000), Case("join 1.3", 1000), Case("repulsive", 1000), Case("none", 1000),
        Case("literal", 1000, plasticity="none"))


def sheared(runs, case, name, **more):
    """Runs in.shear with the row; for eq. 8 with its numbers and damping, without flow."""
    body = runs.body(f"body_{case.spheres}_{case.seed}", shape="periodic", n=case.spheres, length=f"{VOLUME**(1 / 3):.12g}", seed=case.seed)
    material = {"material": f"{POTENTIALS}:{ROW}"}
    if case.plasticity == "none" or case.goes_on:
        words, (a, b, n) = re.search(f"^{ROW} (.*)", POTENTIALS.read_text(encoding="utf-8"), re.M)[1].split(), METALS[ROW].law
        flow, after, density = map(words.index, ("flow", "yield", "density"))
        last, limit = map(float, words[after - 2 : after])
        end = [*words[flow:after], "6", f"{limit * (a + b * 6.0**n) / (a + b * last**n):.5g}", *words[after:density]] if case.goes_on else []
        material = {"coeff": " ".join([*words[:7], words[7] if case.goes_on else str(GAMMA), *words[8:flow], *end, *words[density:]])}
    runs.run("in.shear", name, specimen=body, **material, contact=case.contact, plasticity=case.plasticity, rate=RATE, dtfraction=0.7, row=0.01, **more)


def measure(case, runs):
    """The columns of a run, by COLUMNS, and the share of its plastic strain at the end in that tenth of the height that has most of it."""
    (runs.folder / "energies.lmp").write_text(ALSO, encoding="utf-8")
    name = f"{case.contact}_{case.plasticity}_{case.spheres}_{case.seed}{'_longer' * case.goes_on}".replace(" ", "_")
    sheared(runs, case, name, strain=case.end, also="energies.lmp")
    state = dump.index([runs.folder / f"{name}_state.dump"])[-1].read()
    layers = np.histogram(state["y"], 10, weights=state["plastic_strain"])[0]
    return runs.curve(f"{name}_energies", *COLUMNS), layers.max() / max(layers.sum(), 1e-9)


def cost(runs):
    """Processor time of a step, contact join over repulsive, round by round."""
    seconds = {"join_1.2": [], "repulsive": []}
    for turn in range(ROUNDS):
        for contact, found in seconds.items():
            sheared(runs, Case(contact.replace("_", " "), 2000), f"timed_{contact}_{turn}", strain=TIMED)
            found.append(runs.seconds(f"timed_{contact}_{turn}"))
    return ratios(*seconds.values())


def of_metal(strain):
    """Shear stress [Pa] by von Mises."""
    a, b, n = METALS[ROW].law
    return (a + b * (strain / MISES) ** n) / MISES


def over_metal(found, start, end):
    """Mean stress between two strains over that of the metal."""
    inside = (found["strain"] > start + 1e-9) & (found["strain"] < end + 1e-9)
    return float(np.mean(found["shear_stress"][inside]) / np.mean(of_metal(found["strain"][inside])))


def numbers(found, case, end=END):
    """{column of the table: text}, of a run as far as a strain."""
    found = {name: values[found["strain"] < end + 1e-9] for name, values in found.items()}
    strain, third = found["strain"], int(np.argmin(np.abs(found["strain"] - end + 1.0)))
    rates = [(found[name][-1] - found[name][third]) / (strain[-1] - strain[third]) / case.spheres for name in ("joined", "ended")]
    work = np.sum(found["shear_stress"][1:] * np.diff(strain)) * VOLUME  # that of the energies, counted apart
    at, own, metal = (np.convolve(values[strain > WINDOWS[0][0]], np.full(SMOOTH, 1.0 / SMOOTH), "valid") for values in (strain, found["shear_stress"], of_metal(strain)))
    off = 100.0 * (own / metal - 1.0)
    worst = int(np.argmax(np.abs(off)))
    return {**{f"{first:g} to {last:g}": f"{over_metal(found, first, last):.2f}" for first, last in WINDOWS}, "largest difference [%]": f"{off[worst]:+.0f} at {at[worst]:.2f}",
            "pressure [MPa]": f"{np.mean(found['pressure'][third + 1:]) / MPA:.0f}", "bonds per sphere": f"{2.0 * found['bonds'][-1] / case.spheres:.1f}",
            **{name: f"{rate:.2f}" for name, rate in zip(("joined", "ended"), rates)},
            "smallest d/(R_i + R_j)": f"{found['nearest'][1:].min():.2f}", "energies over work, less 1 [%]": f"{round(100.0 * (found['spent'][-1] / work - 1.0), 2) + 0.0:+.2f}"}


def page(results, layers):
    """Values of the page, of {case: columns} and {case: share of the plastic strain in a tenth of the height}."""
    rows = {case: numbers(found, case) for case, found in results.items() if not case.goes_on}
    late = {case.contact: row["{:g} to {:g}".format(*WINDOWS[-1])] for case, row in rows.items() if case.spheres == 1000 and case.seed == 1}
    joined = [case for case in rows if case.contact == FAR.contact]
    largest, at = ([abs(float(rows[case]["largest difference [%]"].split()[k])) for case in joined] for k in (0, 2))
    beyond = [(start, start + 2.0) for start in np.arange(END, FAR.end, 2.0)]
    kept = ("bonds per sphere", "smallest d/(R_i + R_j)", "energies over work, less 1 [%]")
    ends = {case: numbers(results[case], case, FAR.end) for case in (FAR, LONGER)}
    layer = "plastic strain in a tenth of the height [%]"
    shares = {case: f"{100 * layers[case]:.0f}" if layers[case] and case.end == END else "" for case in rows}
    return {"table": (("contact", "N", "seed", *rows[FAR], layer), [(case.label.partition(", N")[0], case.spheres, case.seed, *row.values(), shares[case]) for case, row in rows.items()]),
            "largest": f"{min(largest):g} to {max(largest):g}", "at": f"{min(at):g} to {max(at):g}", "packings": len(largest), "verdict": "is" if max(largest) <= LIMIT else "is not",
            "join": " to ".join(f"{of(float(rows[case]['3 to 4']) for case in joined):.2f}" for of in (min, max)),
            "loose": late["join 1.0"], "tight": late["join 1.3"], "repulsive": late["repulsive"], "none": late["none"], "literal": late["literal"],
            "beyond": (("flow", *(f"{start:g} to {end:g}" for start, end in beyond), *kept, layer),
                       [(name, *(f"{over_metal(results[case], *span):.2f}" for span in beyond), *(ends[case][what] for what in kept), f"{100 * layers[case]:.0f}")
                        for case, name in ((FAR, "of the row"), (LONGER, "continued to 6"))])}


def main(words=None):
    with Study(__doc__, "large_strain", "validation").started(words) as study:
        found = {case: measure(case, study.runs) for case in study.each(PLAN, lambda case: case.label, lambda case: case.end * case.spheres**1.1)}
        results, layers = ({case: one[k] for case, one in found.items()} for k in (0, 1))
        strain = np.linspace(0.01, FAR.end, 500)
        study.draw({"metal": (strain, of_metal(strain) / MPA), **{case.label: (found["strain"], found["shear_stress"] / MPA) for case, found in results.items()}},
                   ("curve", "strain", "stress_MPa"), xlabel="shear strain", ylabel="shear stress [MPa]")
        study.write(volume=f"{VOLUME:.3g}", rate=RATE, row=ROW, gamma=GAMMA, limit=LIMIT, end=f"{END:g}", far=f"{FAR.end:g}", timed=TIMED, cost=spread(cost(study.runs)), **page(results, layers))


if __name__ == "__main__":
    main()
