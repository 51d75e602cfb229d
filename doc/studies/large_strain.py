#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Plastic flow at large strain: simple shear of a periodic packing of 2024-T351, with contact join and with the other rules of new pairs.

in.specimen packs the spheres in a periodic box, in.shear shears them at constant volume to a strain of 4, one of them to 10. About 15 minutes on one core.
"""

import re
from typing import NamedTuple

from study import CHECKOUT, Study, ratios, spread
import numpy as np
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
    """A run: rule of new pairs, spheres, seed of the packing, plasticity, strain at the end."""

    contact: str
    spheres: int
    seed: int = 1
    plasticity: str = "isotropic"
    end: float = END

    @property
    def label(self):
        return f"{self.contact}{', eq. 8' * (self.plasticity == 'none')}, N = {self.spheres}{', another packing' * (self.seed > 1)}"


FAR = Case("join 1.2", 1000, end=10.0)
PLAN = (FAR, Case("join 1.2", 1000, 2), Case("join 1.2", 2000), Case("join 1.0", 1000), Case("join 1.3", 1000), Case("repulsive", 1000), Case("none", 1000),
        Case("literal", 1000, plasticity="none"))


def sheared(runs, case, name, **more):
    """Runs in.shear; for eq. 8 the numbers of the row stand with damping, without flow."""
    body = runs.body(f"body_{case.spheres}_{case.seed}", shape="periodic", n=case.spheres, length=f"{VOLUME**(1 / 3):.12g}", seed=case.seed)
    material = {"material": f"{POTENTIALS}:{ROW}"}
    if case.plasticity == "none":
        words = re.search(f"^{ROW} (.*)", POTENTIALS.read_text(encoding="utf-8"), re.M)[1].split()
        material = {"coeff": " ".join([*words[:7], str(GAMMA), *words[8 : words.index("flow")], *words[words.index("density"):]])}
    runs.run("in.shear", name, specimen=body, **material, contact=case.contact, plasticity=case.plasticity, rate=RATE, dtfraction=0.7, row=0.01, **more)


def measure(case, runs):
    """The columns of a run, by COLUMNS."""
    (runs.folder / "energies.lmp").write_text(ALSO, encoding="utf-8")
    name = f"{case.contact}_{case.plasticity}_{case.spheres}_{case.seed}".replace(" ", "_")
    sheared(runs, case, name, strain=case.end, also="energies.lmp")
    return runs.curve(f"{name}_energies", *COLUMNS)


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
            "smallest d/(R_i + R_j)": f"{found['nearest'][1:].min():.2f}", "energies over work, less 1 [%]": f"{100.0 * (found['spent'][-1] / work - 1.0):+.2f}"}


def page(results):
    """Values of the page, of {case: columns}."""
    rows, far = {case: numbers(found, case) for case, found in results.items()}, numbers(results[FAR], FAR, FAR.end)
    late = {case.contact: row["{:g} to {:g}".format(*WINDOWS[-1])] for case, row in rows.items() if case.spheres == 1000 and case.seed == 1}
    largest = [abs(int(row["largest difference [%]"].split()[0])) for case, row in rows.items() if case.contact == FAR.contact]
    return {"table": (("contact", "N", "seed", *rows[FAR]), [(case.label.partition(", N")[0], case.spheres, case.seed, *row.values()) for case, row in rows.items()]),
            "largest": f"{min(largest)} to {max(largest)}", "packings": len(largest), "verdict": "is" if max(largest) <= LIMIT else "is not",
            "join": late[FAR.contact], "loose": late["join 1.0"], "tight": late["join 1.3"], "repulsive": late["repulsive"], "none": late["none"], "literal": late["literal"],
            "far": f"{FAR.end:g}", "beyond": ", ".join(f"{over_metal(results[FAR], at, at + 2):.2f} from {at:g} to {at + 2:g}" for at in np.arange(END, FAR.end, 2)),
            "nearest": far["smallest d/(R_i + R_j)"], "bonds": far["bonds per sphere"], "misfit": far["energies over work, less 1 [%]"]}


def main(words=None):
    with Study(__doc__, "large_strain").started(words) as study:
        results = {case: measure(case, study.runs) for case in study.each(PLAN, lambda case: case.label, lambda case: case.end * case.spheres**1.1)}
        strain = np.linspace(0.01, FAR.end, 500)
        study.draw({"metal": (strain, of_metal(strain) / MPA), **{case.label: (found["strain"], found["shear_stress"] / MPA) for case, found in results.items()}},
                   ("curve", "strain", "stress_MPa"), xlabel="shear strain", ylabel="shear stress [MPa]")
        study.write(volume=f"{VOLUME:.3g}", rate=RATE, row=ROW, gamma=GAMMA, limit=LIMIT, end=f"{END:g}", cost=spread(cost(study.runs)), **page(results))


if __name__ == "__main__":
    main()
