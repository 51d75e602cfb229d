#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Plastic flow at large strain: simple shear of a periodic packing, with plasticity and with eq. 8.

in.specimen packs the spheres in a periodic box, in.shear shears them at constant volume, to --strain (at least 2).
"""

from typing import NamedTuple

from study import Study, errors_in_one_line
import numpy as np
from evp import figures, specimen
from scipy.spatial import cKDTree

MPA = 1e6
RATE = 200  # of shear strain [1/s]
ROWS_PER_STRAIN = 100
VOLUME = np.pi * 0.02**2 * 0.05  # [m3] of the box, that of the paper's cylinder
EDGE = VOLUME ** (1.0 / 3.0)
COLUMNS = ("strain", "shear_stress", "pressure", "spent", "kinetic", "stored", "lost", "viscous", "plastic", "bonds_beyond_dlim", "new_pairs",
           "lowest_ratio")
# Taken in by in.shear: every row with its energies.
ALSO = f"""
fix             energy all evp/energy
print           "{','.join(COLUMNS)}" file ${{out}}_energies.csv screen no
variable        next_row equal (floor(step/v_every)+1)*v_every  # in.shear ends with a run of no step
fix             energies all print v_next_row "$(v_strain_now:%.9g),$(f_rows[2]:%.9g),$(f_rows[3]:%.9g),$(f_energy+f_energy[13]:%.9g),&
$(f_energy[1]:%.9g),$(f_energy[2]+f_energy[3]+f_energy[5]:%.9g),$(f_energy[4]+f_energy[11]:%.9g),$(f_energy[6]:%.9g),$(f_energy[9]:%.9g),&
$(f_bonds[1]),$(f_bonds[3]),$(f_bonds[4]:%.9g)" append ${{out}}_energies.csv screen no title 0,0,0,0,0,0,0,0,0,0,0,1
"""
HEADER = ("contact", "N", "plasticity", "largest stress [MPa]", "at strain", "mean stress [MPa], 1 to 2", "mean stress, last 1 [MPa]",
          "smallest stress, last 1 [MPa]", "pressure, last 1 [MPa]", "plastic [MPa]", "viscous [MPa]", "lost pairs [MPa]", "stored [MPa]",
          "bonds beyond dlim [%]", "new pairs per sphere", "smallest d/(Ri + Rj)", "energies over work, less 1 [%]")


class Case(NamedTuple):
    """A run: spheres, rule of new contacts, plasticity."""

    spheres: int
    contact: str
    plasticity: str = "isotropic"

    @property
    def label(self):
        return f"contact {self.contact}, N = {self.spheres}" + ("" if self.plasticity == "isotropic" else ", plasticity none")

    @property
    def name(self):
        return f"{self.contact}_{self.plasticity}_{self.spheres}"


PLAN = (Case(1000, "repulsive"), Case(2000, "repulsive"), Case(1000, "none"), Case(1000, "literal", "none"))


def packing(case):
    """Choices of in.specimen."""
    return {"shape": "periodic", "n": case.spheres, "length": f"{EDGE:.12g}"}


def shear(case, strain, folder):
    """Choices of in.shear; writes the commands that it takes in."""
    (folder / "energies.lmp").write_text(ALSO, encoding="utf-8")
    return {"specimen": f"body_{case.spheres}.data", "contact": case.contact, "plasticity": case.plasticity, "rate": RATE, "strain": strain,
            "row": 1.0 / ROWS_PER_STRAIN, "dtfraction": 0.7, "also": "energies.lmp"}


def measure(case, strain, runs):
    """The columns of a run, by COLUMNS."""
    runs.body(f"body_{case.spheres}", **packing(case))
    runs.run("in.shear", case.name, **shear(case, strain, runs.folder))
    return runs.curve(f"{case.name}_energies", *COLUMNS)


def bonds_at_start(path, alpha=1.5):
    """Number of pairs within alpha (R_i + R_j) of a periodic body."""
    body = specimen.read_data(path)
    edge = body.box[:, 1] - body.box[:, 0]
    i, j = cKDTree((body.x - body.box[:, 0]) % edge, boxsize=edge).query_pairs(2.0 * alpha * body.radius.max(), output_type="ndarray").T
    apart = body.x[i] - body.x[j]
    apart -= edge * np.round(apart / edge)
    return int(np.sum(np.linalg.norm(apart, axis=1) <= alpha * (body.radius[i] + body.radius[j])))


def rates(found, start, end, name):
    """Growth of an energy per strain and volume between two strains [MPa]."""
    first, last = (int(np.argmin(np.abs(found["strain"] - at))) for at in (start, end))
    return (found[name][last] - found[name][first]) / (found["strain"][last] - found["strain"][first]) / VOLUME / MPA


def mean(found, start, end, name="shear_stress"):
    """Of a stress between two strains [MPa]."""
    inside = (found["strain"] > start + 1e-9) & (found["strain"] < end + 1e-9)
    return float(np.mean(found[name][inside])) / MPA


def lowest(found, start, end):
    """Smallest mean stress over 0.1 of strain between two strains [MPa]."""
    return min(mean(found, at, at + 0.1) for at in np.arange(start, end - 0.099, 0.1))


def work_misfit(found):
    """What the energy balance counts over the work of the shear stress, less 1: both are the same work, counted apart."""
    return found["spent"][-1] / (np.sum(found["shear_stress"][1:] * np.diff(found["strain"])) * VOLUME) - 1.0


def last_unit(found):
    """Its first and last strain."""
    return found["strain"][-1] - 1.0, found["strain"][-1]


def row(case, found, bonds):
    """Of the table. bonds: that the body had at the start."""
    top, late = int(np.argmax(found["shear_stress"])), last_unit(found)
    stresses = (mean(found, 1.0, 2.0), mean(found, *late), lowest(found, *late), mean(found, *late, "pressure"))
    return [case.contact, case.spheres, case.plasticity, f"{found['shear_stress'][top] / MPA:.0f}", f"{found['strain'][top]:.2f}",
            *(f"{value:.0f}" for value in (*stresses, *(rates(found, *late, name) for name in ("plastic", "viscous", "lost", "stored")))),
            f"{100.0 * found['bonds_beyond_dlim'][-1] / bonds:.0f}", f"{found['new_pairs'][-1] / case.spheres:.1f}",
            f"{found['lowest_ratio'].min():.2f}", f"{round(100 * work_misfit(found), 1) + 0.0:+.1f}"]  # + 0.0: no -0.0


def draw(study, results):
    """Stress against strain of every case."""
    with figures.plt.rc_context(figures.LOOK):
        figure, axis = figures.plt.subplots(figsize=(7.2, 4.6))
        rows = []
        for k, (case, found) in enumerate(results.items()):
            axis.plot(found["strain"], found["shear_stress"] / MPA, label=case.label, **figures.line_style(k))
            rows += [(case.label, f"{a:.6g}", f"{b:.6g}") for a, b in zip(found["strain"], found["shear_stress"] / MPA)]
        axis.axhline(0, color="#333333", linewidth=0.8)
        axis.set(xlabel="shear strain", ylabel="shear stress [MPa]", xlim=(0, None))
        figures.legend_below(axis, 2, handlelength=3.0)
        study.save(figure, ("curve", "strain", "stress_MPa"), rows)


def answer(results):
    """Numbers of the first lines of the page."""
    end = next(iter(results.values()))["strain"][-1]
    repulsive, none, literal = ([found for case, found in results.items() if case.contact == contact] for contact in ("repulsive", "none", "literal"))

    def both(value, *name, where=last_unit):
        return " and ".join(f"{value(found, *where(found), *name):.0f}" for found in repulsive)

    late = last_unit(literal[0])

    return {"end": f"{end:.3g}", "stress": both(mean), "pressure": both(mean, "pressure"), "plastic": both(rates, "plastic"),
            "spheres": " and ".join(str(case.spheres) for case in results if case.contact == "repulsive"), "earlier": both(mean, where=lambda found: (1.0, 2.0)),
            "literal": f"{mean(literal[0], *late):.0f}", "spent": f"{rates(literal[0], *late, 'viscous') + rates(literal[0], *late, 'lost'):.0f}",
            "lowest": f"{lowest(none[0], *last_unit(none[0])):.0f}"}


def main(words=None):
    study = Study(__doc__, "large_strain", strain=3.0).parse(words)
    with errors_in_one_line("large_strain.py"):
        results = {case: measure(case, study.strain, study.runs) for case in study.each(PLAN, lambda case: case.label, lambda case: case.spheres**1.3)}
        draw(study, results)
        rows = [row(case, found, bonds_at_start(study.runs.folder / f"body_{case.spheres}.data")) for case, found in results.items()]
        study.write(table=(HEADER, rows), volume=f"{VOLUME:.3g}", rate=RATE, **answer(results))


if __name__ == "__main__":
    main()
