#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""A metal on its flow curve, then the paper's traction test, from random packings to curves and pictures.

Pulls a periodic body of 500 spheres of aluminium_2024T351 of metals.evp by in.uniaxial, and draws its true stress beside the flow curve of the row: metal.png,
after some ten seconds. Then the paper, whose law alone is reversible and no metal's: runs in.two_spheres (the force law, figure 2), in.specimen (500 spheres) and in.traction for Tables
1 and 2 (figures 3 and 4); writes CSV and PNG files and prints E, 0.2 % yield stress, stress at 1 %
and the strain of the first bond in the second regime. Table 2 is also pulled at 100/s, where its
damping can be seen. in.cyclic loads and unloads the body with eq. 8 and with `plasticity isotropic`: its
residual strain. All of it takes about a minute and a half on two cores.
"""

import pathlib

import evp  # noqa: F401  before numpy
from evp import curves, figures, flow, law, run
from evp.report import command_line, errors_in_one_line, positive, print_table, whole, write_csv

METALS, METAL = run.CHECKOUT / "potentials" / "metals.evp", "aluminium_2024T351"
METAL_STRAIN = 0.2  # true
TABLES = {
    "table1": ("Table 1, no damping", "80 8 4 3 8 4 0.005 0 1.5", (1.0, 10.0)),
    "table2": ("Table 2, damping 1000 N s/m", "80 8 4 3 8 4 0.005 1000 1.5", (1.0, 10.0, 100.0)),
}
UNLOADING = {"none": "eq. 8, the paper's law", "isotropic": "plasticity isotropic"}
UNLOADING_RATE = 10.0
STRAIN = 0.02
DT_FRACTION = 0.8
# Largest stable steps of such a specimen [s], only to share out the progress line.
_TYPICAL_STEP = {"table1": 9e-7, "table2": 3.5e-8}


def metal_job(out):
    """One pull of the metal to METAL_STRAIN."""
    variables = {"specimen": "periodic.data", "material": f"{METALS}:{METAL}", "strain": METAL_STRAIN, "out": "metal"}
    return run.Job("metal", "in.uniaxial", variables, out, done=lambda: run.last_strain(out / "metal.csv") / METAL_STRAIN)


def draw_metal(out):
    """metal.png, the metal beside its flow curve; prints how far it is off, and the path."""
    pulled, load = curves.read_curve(out / "metal.csv"), curves.load_of(out / "metal.csv")
    modulus = pulled.virial[1] / pulled.strain[1]  # of the first row, which is elastic
    target = flow.of_row(METALS, METAL)
    strain = target.bends(METAL_STRAIN, modulus)
    stress = target.true_stress(strain, modulus)
    far = pulled.strain > 0.01
    off = 100.0 * (pulled.virial[far] / target.true_stress(pulled.strain[far], modulus) - 1.0)
    path = figures.stress_strain({METAL: [("500 spheres", pulled), ("flow curve", curves.Curve(strain, stress, stress))]}, out / "metal.png", load)
    print(f"{METAL}: true stress {off.min():+.1f} to {off.max():+.1f} % off its flow curve from a true strain of 0.01 on: {path}", flush=True)


def traction_job(out, table, rate, ranks):
    """One pull to STRAIN at a rate [1/s]; its progress is read off the growing CSV."""
    name = f"{table}_rate{rate:g}"
    variables = {"specimen": "specimen.data", "coeff": TABLES[table][1], "contact": "literal", "rate": f"{rate:g}",
                 "strain": STRAIN, "dtfraction": DT_FRACTION, "out": name}
    return run.Job(name, "in.traction", variables, out, ranks, cost=STRAIN / rate / (DT_FRACTION * _TYPICAL_STEP[table]),
                   done=lambda: run.last_strain(out / f"{name}.csv") / STRAIN)


def unloading_job(out, plasticity, ranks):
    """One sweep to STRAIN and back to zero stress."""
    name = f"plasticity_{plasticity}"
    variables = {"specimen": "specimen.data", "coeff": TABLES["table1"][1], "plasticity": plasticity, "rate": f"{UNLOADING_RATE:g}", "strain": STRAIN, "lower": "release", "out": name}
    return run.Job(name, "in.cyclic", variables, out, ranks, cost=2 * STRAIN / UNLOADING_RATE / (0.4 * _TYPICAL_STEP["table1"]))


def draw(out, pulled):
    """All pictures; pulled: {(table, rate): curve}. Returns their paths."""
    panels = {}
    for (table, rate), curve in pulled.items():
        panels.setdefault(TABLES[table][0], []).append((f"{rate:g}/s", curve))
    measured = curves.read_columns(out / "two_spheres.csv", figures.MEASURED)
    sweeps = {label: curves.read_curve(out / f"plasticity_{plasticity}.csv") for plasticity, label in UNLOADING.items()}
    return [figures.force_law(law.TABLE1, out / "force_law.png", measured), figures.stress_strain(panels, out / "stress_strain.png"),
            figures.unloading(sweeps, out / "unloading.png")]


def report(out, pulled):
    """Print the table of numbers and write it to summary.csv."""
    rows, ranges = [], set()
    for (table, rate), curve in pulled.items():
        found = curves.numbers(curve)
        columns = curves.read_columns(out / f"{table}_rate{rate:g}.csv", ("strain", "second_regime"))
        reached = [f"{at:.4f}" for at in columns["strain"][columns["second_regime"] > 0]] or ["none"]
        rows.append((table, f"{rate:g}", *(f"{found[name]:.2f}" for name in ("E_GPa", "yield_MPa", "stress_1pc_MPa")), reached[0]))
        ranges.add(f"{found['E_from']:g} to {found['E_to']:.3g}")
    write_csv(out / "summary.csv", ("table", "rate_per_s", "E_GPa", "yield_MPa", "stress_1pc_MPa", "first_second_regime"), rows)
    print_table(("table", "rate [1/s]", "E [GPa]", "0.2 % yield [MPa]", "stress at 1 % [MPa]", "first second-regime bond at strain"), rows)
    for plasticity, label in UNLOADING.items():
        left = curves.cycle_numbers(curves.read_curve(out / f"plasticity_{plasticity}.csv"))
        print(f"{label}: back from {100 * STRAIN:g} %, {figures.residual_text(left['residual_strain'])}")
    print("E is the slope over strain " + ", or ".join(sorted(ranges)))


def main(argv=None):
    parser = command_line(__doc__)
    parser.add_argument("--rates", nargs="+", type=positive, metavar="R", help="strain rates [1/s] for both tables (default: Table 1 at 1 and 10, "
                        "Table 2 at 1, 10 and 100; the time goes as 1/rate)")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("results", "quickstart"), metavar="DIR",
                        help="folder for the results (default: results/quickstart)")
    parser.add_argument("--ranks", type=whole(1), default=2, metavar="N", help="MPI ranks of each traction run (default: 2)")
    args = parser.parse_args(argv)
    out = args.out.absolute()
    wanted = sorted({(table, rate) for table in TABLES for rate in (args.rates or TABLES[table][2])})
    jobs = [*(traction_job(out, *key, args.ranks) for key in wanted), *(unloading_job(out, plasticity, args.ranks) for plasticity in UNLOADING)]
    with errors_in_one_line("quickstart.py"):
        out.mkdir(parents=True, exist_ok=True)
        for name in ("two_spheres", "metal", *(job.name for job in jobs)):
            (out / f"{name}.csv").unlink(missing_ok=True)  # an old curve would be taken for progress of the new run
        packing = {"n": 500, "seed": 1}
        run.run_jobs([run.Job("periodic", "in.specimen", {**packing, "shape": "periodic", "length": 0.04, "out": "periodic.data"}, out),
                      run.Job("specimen", "in.specimen", {**packing, "out": "specimen.data"}, out), run.Job("two_spheres", "in.two_spheres", {"out": "two_spheres"}, out)],
                     title="packing and force law:")
        run.run_jobs([metal_job(out)], title="metal:")
        draw_metal(out)
        run.run_jobs(sorted(jobs, key=lambda job: -job.cost), title="the paper:")
        pulled = {key: curves.read_curve(out / f"{job.name}.csv") for key, job in zip(wanted, jobs)}
        paths = draw(out, pulled)
        report(out, pulled)
    print("pictures of the paper, each with its CSV:", *paths, sep="\n  ")


if __name__ == "__main__":
    main()
