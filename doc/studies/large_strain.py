#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Plastic flow at large strain: simple shear of a periodic packing, with plasticity and with eq. 8.

in.specimen packs the spheres in a periodic box, in.shear shears them at constant volume, to --strain (at least 2).
"""

from typing import NamedTuple

from study import Study
import numpy as np

MPA = 1e6
RATE = 200  # of shear strain [1/s]
VOLUME = np.pi * 0.02**2 * 0.05  # [m3] of the box, that of the paper's cylinder
COLUMNS = ("strain", "shear_stress", "pressure", "spent", "stored", "lost", "viscous", "plastic")
# Taken in by in.shear: every row with its energies.
ALSO = f"""
fix             energy all evp/energy
print           "{','.join(COLUMNS)}" file ${{out}}_energies.csv screen no
variable        next_row equal (floor(step/v_every)+1)*v_every  # in.shear ends with a run of no step
fix             energies all print v_next_row "$(v_strain_now:%.9g),$(f_rows[2]:%.9g),$(f_rows[3]:%.9g),$(f_energy+f_energy[13]:%.9g),&
$(f_energy[2]+f_energy[3]+f_energy[5]:%.9g),$(f_energy[4]+f_energy[11]:%.9g),$(f_energy[6]:%.9g),$(f_energy[9]:%.9g)" &
append ${{out}}_energies.csv screen no title 0,0,0,0,0,0,0,0
"""
HEADER = ("contact", "N", "plasticity", "largest stress [MPa]", "mean stress [MPa], 1 to 2", "mean stress, last 1 [MPa]", "smallest stress, last 1 [MPa]",
          "pressure, last 1 [MPa]", "plastic [MPa]", "viscous [MPa]", "lost pairs [MPa]", "stored [MPa]", "energies over work, less 1 [%]")


class Case(NamedTuple):
    """A run: spheres, rule of new contacts, plasticity."""

    spheres: int
    contact: str
    plasticity: str = "isotropic"

    @property
    def label(self):
        return f"contact {self.contact}, N = {self.spheres}" + ("" if self.plasticity == "isotropic" else ", plasticity none")


PLAN = (Case(1000, "repulsive"), Case(2000, "repulsive"), Case(1000, "none"), Case(1000, "literal", "none"))


def measure(case, strain, runs):
    """The columns of a run, by COLUMNS."""
    (runs.folder / "energies.lmp").write_text(ALSO, encoding="utf-8")
    body, name = runs.body(f"body_{case.spheres}", shape="periodic", n=case.spheres, length=f"{VOLUME**(1 / 3):.12g}"), f"{case.contact}_{case.plasticity}_{case.spheres}"
    runs.run("in.shear", name, specimen=body, contact=case.contact, plasticity=case.plasticity, rate=RATE, strain=strain, row=0.01, dtfraction=0.7, also="energies.lmp")
    return runs.curve(f"{name}_energies", *COLUMNS)


def mean(found, start, end, name="shear_stress"):
    """Of a stress between two strains [MPa]."""
    inside = (found["strain"] > start + 1e-9) & (found["strain"] < end + 1e-9)
    return float(np.mean(found[name][inside])) / MPA


def numbers(found):
    """Of the table, from the largest stress on."""
    end = found["strain"][-1]
    late = (end - 1.0, end)
    first, last = (int(np.argmin(np.abs(found["strain"] - at))) for at in late)
    # growth of energies per strain and volume
    grown = [(found[name][last] - found[name][first]) / (found["strain"][last] - found["strain"][first]) / VOLUME / MPA for name in ("plastic", "viscous", "lost", "stored")]
    # both are the same work, counted apart
    misfit = found["spent"][-1] / (np.sum(found["shear_stress"][1:] * np.diff(found["strain"])) * VOLUME) - 1.0
    return [found["shear_stress"].max() / MPA, mean(found, 1.0, 2.0), mean(found, *late), min(mean(found, at, at + 0.1) for at in np.arange(late[0], end - 0.099, 0.1)),
            mean(found, *late, "pressure"), *grown, 100.0 * misfit]


def page(results):
    """Values of the page, of {case: columns}."""
    rows = {case: dict(zip(HEADER[3:], numbers(found))) for case, found in results.items()}

    def shown(name, contact):
        return " and ".join(f"{row[name]:.0f}" for case, row in rows.items() if case.contact == contact)

    literal = next(row for case, row in rows.items() if case.contact == "literal")
    return {"table": (HEADER, [(case.contact, case.spheres, case.plasticity, *(f"{value:.0f}" for value in list(row.values())[:-1]), f"{round(row[HEADER[-1]], 1) + 0.0:+.1f}")
                               for case, row in rows.items()]),
            "spheres": " and ".join(str(case.spheres) for case in rows if case.contact == "repulsive"), "stress": shown(HEADER[5], "repulsive"),
            "pressure": shown(HEADER[7], "repulsive"), "plastic": shown(HEADER[8], "repulsive"), "earlier": shown(HEADER[4], "repulsive"), "literal": shown(HEADER[5], "literal"),
            "spent": f"{literal[HEADER[9]] + literal[HEADER[10]]:.0f}", "lowest": shown(HEADER[6], "none")}


def main(words=None):
    with Study(__doc__, "large_strain", strain=3.0).started(words) as study:
        results = {case: measure(case, study.strain, study.runs) for case in study.each(PLAN, lambda case: case.label, lambda case: case.spheres**1.3)}
        study.draw({case.label: (found["strain"], found["shear_stress"] / MPA) for case, found in results.items()},
                   ("curve", "strain", "stress_MPa"), xlabel="shear strain", ylabel="shear stress [MPa]")
        study.write(volume=f"{VOLUME:.3g}", rate=RATE, end=f"{study.strain:g}", **page(results))


if __name__ == "__main__":
    main()
