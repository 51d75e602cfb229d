#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Plastic flow at large strain: simple shear of a periodic packing, with plasticity and with eq. 8.

    doc/studies/large_strain.py [--strain 3] [--work FOLDER] [--fresh] [--out doc/large_strain.md]

in.specimen packs the spheres in a periodic box, in.shear shears them at constant volume. Writes the page,
a CSV of the same name and figures/NAME.png. Runs that --work has already are not repeated. Uses the lmp of this checkout, or EVP_LMP.
"""

import pathlib
import sys
from typing import NamedTuple

from study import CHECKOUT, DECKS, add_out, command_line, deck_command, errors_in_one_line, output_of, table, watched, write_csv
import numpy as np
from evp import figures, specimen
from scipy.spatial import cKDTree

MPA = 1e6
RATE = 200  # of shear strain [1/s]
ROWS_PER_STRAIN = 100
VOLUME = np.pi * 0.02**2 * 0.05  # [m3] of the box, that of the paper's cylinder
EDGE = VOLUME ** (1.0 / 3.0)

# Taken in by in.shear: every row with its energies.
ALSO = """
fix             energy all evp/energy
print           "{columns}" file ${{out}}_energies.csv screen no
fix             energies all print v_next_row "$(v_strain_now:%.9g),$(f_rows[2]:%.9g),$(f_rows[3]:%.9g),$(f_energy+f_energy[13]:%.9g),&
$(f_energy[1]:%.9g),$(f_energy[2]+f_energy[3]+f_energy[5]:%.9g),$(f_energy[4]+f_energy[11]:%.9g),$(f_energy[6]:%.9g),$(f_energy[9]:%.9g),&
$(f_bonds[1]),$(f_bonds[3]),$(f_bonds[4]:%.9g)" append ${{out}}_energies.csv screen no title 0,0,0,0,0,0,0,0,0,0,0,1
"""
COLUMNS = ("strain", "shear_stress", "pressure", "spent", "kinetic", "stored", "lost", "viscous", "plastic", "bonds_beyond_dlim", "new_pairs",
           "lowest_ratio")


class Case(NamedTuple):
    """A run: spheres, rule of new contacts, plasticity, seed of the packing."""

    spheres: int
    contact: str
    plasticity: str = "isotropic"
    seed: int = 1

    @property
    def label(self):
        return f"contact {self.contact}, N = {self.spheres}" + ("" if self.plasticity == "isotropic" else ", plasticity none")

    @property
    def data(self):
        return f"body_{self.spheres}_{self.seed}.data"

    @property
    def name(self):
        return f"{self.contact}_{self.plasticity}_{self.spheres}_{self.seed}"


PLAN = (Case(1000, "repulsive"), Case(2000, "repulsive"), Case(1000, "none"), Case(1000, "literal", "none"))


def packing(case):
    """Choices of in.specimen."""
    return {"shape": "periodic", "n": case.spheres, "seed": case.seed, "length": f"{EDGE:.12g}", "out": case.data}


def shear(case, strain, folder):
    """Choices of in.shear; writes the commands that it takes in."""
    (folder / "energies.lmp").write_text(ALSO.format(columns=",".join(COLUMNS)), encoding="utf-8")
    return {"specimen": case.data, "contact": case.contact, "plasticity": case.plasticity, "rate": RATE, "strain": strain, "row": 1.0 / ROWS_PER_STRAIN,
            "samples": 50, "dtfraction": 0.7, "also": "energies.lmp", "out": case.name}


def measure(case, strain, folder):
    """The columns of a run, by COLUMNS; it is made where the folder holds none of that strain."""
    path = folder / f"{case.name}_energies.csv"
    if path.exists():
        found = figures.read_columns(path, COLUMNS)
        if abs(found["strain"][-1] - strain) < 0.1 / ROWS_PER_STRAIN:
            return found
    if not (folder / f"{case.data}.body").exists():
        output_of(deck_command(DECKS / "in.specimen", packing(case)), folder, f"packing of {case.spheres}")
    output_of(deck_command(DECKS / "in.shear", shear(case, strain, folder)), folder, case.label)
    return figures.read_columns(path, COLUMNS)


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


def mean(found, start, end, name):
    """Of a column between two strains."""
    inside = (found["strain"] > start + 1e-9) & (found["strain"] < end + 1e-9)
    return float(np.mean(found[name][inside]))


def work_misfit(found):
    """What the energy balance counts over the work of the shear stress, less 1: both are the same work, counted apart."""
    return found["spent"][-1] / (np.sum(found["shear_stress"][1:] * np.diff(found["strain"])) * VOLUME) - 1.0


def draw(results, path):
    """Stress and plastic dissipation per strain, against strain, of every case."""
    with figures.plt.rc_context(figures.LOOK):
        figure, axes = figures.plt.subplots(1, 2, sharey=True, figsize=(10.4, 4.4))
        rows = []
        for k, (case, found) in enumerate(results.items()):
            strain = found["strain"]
            ends = np.arange(0, len(strain), max(1, len(strain) // 20))  # plastic work is a sum: its slope is taken over a twentieth of the way
            grown = np.diff(found["plastic"][ends]) / np.diff(strain[ends]) / VOLUME / MPA
            middle = 0.5 * (strain[ends][1:] + strain[ends][:-1])
            axes[0].plot(strain, found["shear_stress"] / MPA, label=case.label, **figures.line_style(k))
            axes[1].plot(middle, grown, label=case.label, **figures.line_style(k))
            rows += [("shear_stress_MPa", case.label, f"{a:.6g}", f"{b:.6g}") for a, b in zip(strain, found["shear_stress"] / MPA)]
            rows += [("plastic_dissipation_MPa", case.label, f"{a:.6g}", f"{b:.6g}") for a, b in zip(middle, grown)]
        axes[0].set(xlabel="shear strain", ylabel="shear stress [MPa]", title="shear stress")
        axes[1].set(xlabel="shear strain", ylabel="dissipation per volume and strain [MPa]", title="plastic dissipation")
        axes[1].tick_params(labelleft=True)
        for axis in axes:
            axis.set_xlim(left=0)
            axis.axhline(0, color="#333333", linewidth=0.8)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=2, handlelength=3.0)
        return figures.save(figure, path, ("panel", "curve", "strain", "value"), rows)


HEAD = """# Plastic flow at large strain

{answer}

![shear stress and plastic dissipation](figures/{stem}.png)

Written by `doc/studies/large_strain.py`: a random packing in a periodic box of {volume:.3g} m3 (in.specimen), Table 1 with gamma 100,
e and gamma scaled with N, simple shear at {rate}/s and constant volume (in.shear: fix deform with *remap v*), explicit damping. The box flips
whenever its tilt exceeds one half. Stresses are those of the pairs, energies those of fix evp/energy.

"""
SPANS = ((0.5, 1.0), (1.0, 2.0))  # of strain, before the last unit of it
HEADER = ("contact", "N", "plasticity", "largest stress [MPa]", "at strain", *(f"mean stress [MPa], {a:g} to {b:g}" for a, b in SPANS),
          "mean stress, last 1 [MPa]", "smallest stress, last 1 [MPa]", "pressure, last 1 [MPa]", "plastic [MPa]", "viscous [MPa]", "lost pairs [MPa]", "stored [MPa]",
          "bonds beyond dlim [%]", "new pairs per sphere", "smallest d/(Ri + Rj)", "energies over work, less 1 [%]")
NOTES = """
- *last 1*: over the last unit of strain.
- *smallest stress*: smallest mean over 0.1 of strain.
- *plastic*, *viscous*, *lost pairs*, *stored*: increase of these energies per volume and strain over the last unit of strain. Their sum is the
  work of the shear stress. *stored* is the energy of bonds and of new pairs, negative where new pairs attract.
- *bonds beyond dlim*: share at the end of the run.
- *energies over work*: sum of all energies over the work of the shear stress. The energies include the work of the box by the forces of each
  timestep; the work of the shear stress is that of its mean values in the rows.
"""


def lowest(found, start, end):
    """Smallest mean stress over 0.1 of strain between two strains [MPa]."""
    starts = np.arange(start, end - 0.099, 0.1)
    return min(mean(found, at, at + 0.1, "shear_stress") for at in starts) / MPA


def row(case, found, bonds):
    """Of the table. bonds: that the body had at the start."""
    top, end = int(np.argmax(found["shear_stress"])), found["strain"][-1]
    late = (end - 1.0, end)
    return [case.contact, case.spheres, case.plasticity, f"{found['shear_stress'][top] / MPA:.0f}", f"{found['strain'][top]:.2f}",
            *(f"{mean(found, *span, 'shear_stress') / MPA:.0f}" for span in (*SPANS, late)), f"{lowest(found, *late):.0f}",
            f"{mean(found, *late, 'pressure') / MPA:.0f}",
            *(f"{rates(found, *late, name):.0f}" for name in ("plastic", "viscous", "lost", "stored")),
            f"{100.0 * found['bonds_beyond_dlim'][-1] / bonds:.0f}", f"{found['new_pairs'][-1] / case.spheres:.1f}",
            f"{found['lowest_ratio'].min():.2f}", f"{round(100 * work_misfit(found), 1) + 0.0:+.1f}"]  # + 0.0: no -0.0


def answer(results):
    """The first lines of the page."""
    def late(case, name="shear_stress"):
        end = results[case]["strain"][-1]
        if name == "shear_stress":
            return mean(results[case], end - 1.0, end, name) / MPA
        return rates(results[case], end - 1.0, end, name)

    def both(found):
        return " and ".join(f"{value:.0f}" for value in found)

    literal, none = (next(case for case in results if case.contact == contact) for contact in ("literal", "none"))
    repulsive = [case for case in results if case.contact == "repulsive"]
    end = results[none]["strain"][-1]
    pressures = [mean(results[case], end - 1.0, end, "pressure") / MPA for case in repulsive]
    spent = late(literal, "viscous") + late(literal, "lost")
    return "\n".join((
        f"With *plasticity isotropic* and *contact repulsive* the mean stress over the last unit of a shear strain of {end:.3g} is {both(map(late, repulsive))} MPa,"
        f" under a pressure of {both(pressures)} MPa at this",
        f"constant volume, and the plastic dissipation per strain {both(late(case, 'plastic') for case in repulsive)} MPa, for"
        f" {both(case.spheres for case in repulsive)} spheres. With eq. 8 and *contact literal* the stress is {late(literal):.0f} MPa.",
        "",
        "Limits:",
        "",
        f"- The stress is not steady: its mean from a strain of 1 to 2 is {both(mean(results[case], 1.0, 2.0, 'shear_stress') / MPA for case in repulsive)} MPa."
        " There is one packing of each size, so that a dependence on N cannot be separated from scatter.",
        "- With eq. 8 and *contact literal* more energy is dissipated than the shear stress supplies, as new pairs attract each other from the distance at"
        " which they form: the viscous and lost",
        f"  energies increase by {spent:.0f} MPa, the work by {late(literal):.0f} MPa. A temperature computed from the dissipation would be too high.",
        "- With *contact none* there is no steady flow: the body separates in a shear band, and its stress falls to"
        f" {lowest(results[none], end - 1.0, end):.0f} MPa. The later peaks are those of",
        "  initial bonds whose partners return through the periodic boundary after each unit of strain.",
        "- With all three rules the initial bonds act again when their partners return, as in the paper. The keyword *break* prevents this.",
    ))


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--strain", type=float, default=3.0, help="final shear strain (default 3, at least 2)")
    parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / "large_strain", help="packings and runs (default: %(default)s)")
    parser.add_argument("--fresh", action="store_true", help="repeat the runs that --work has already")
    add_out(parser, "large_strain.md")
    options = parser.parse_args(words)
    if options.strain < 2.0:
        parser.error("--strain must be at least 2")
    options.work.mkdir(parents=True, exist_ok=True)
    if options.fresh:
        for old in options.work.glob("*.csv"):
            old.unlink()
    results = {}
    with errors_in_one_line("large_strain.py"):
        for case in watched("large_strain.py:", PLAN, lambda case: case.label, lambda case: case.spheres**1.3):
            results[case] = measure(case, options.strain, options.work)
        stem = options.out.stem
        write_csv(options.out.with_suffix(".csv"), ("run", *COLUMNS),
                  [(case.name, *(f"{found[name][k]:.6g}" for name in COLUMNS))
                   for case, found in results.items() for k in range(len(found["strain"]))])
        picture = draw(results, options.out.parent / "figures" / f"{stem}.png")
        bonds = {case.spheres: bonds_at_start(options.work / case.data) for case in results}
        lines = table(HEADER, [row(case, found, bonds[case.spheres]) for case, found in results.items()])
        text = HEAD.format(answer=answer(results), volume=VOLUME, rate=RATE, stem=stem) + "\n".join(lines) + "\n" + NOTES
        options.out.write_text(text, encoding="utf-8")
    print(text)
    print(picture)


if __name__ == "__main__":
    sys.exit(main())
