# SPDX-License-Identifier: GPL-2.0-only
"""The runs of `compare_builds.py bits`, and the comparison of what they wrote.

Every run is made with both builds, each in a folder of its own: FOLDER/old and FOLDER/new. FOLDER/crossed holds the runs of
the new build that continue what the old one wrote.
"""

import dataclasses
import os
import re

from evp import quickstart
from evp.run import CHECKOUT, run_jobs

SPECIMEN = CHECKOUT / "tests" / "data" / "reference_500" / "specimen_500.data"
CASES = {
    "two_spheres": "in.two_spheres",
    "traction": "in.specimen and in.traction as the quick start calls them",
    "damped": "in.traction with damping, explicit and implicit, to a quarter of the strain",
    "quasistatic": "in.quasistatic",
    "restart": "half a pull, continued from its restart file, and from its data file and bond file",
}
ALL_DIGITS = "all_digits.lmp"
HEAD = """
units si
atom_style sphere
atom_modify map yes
{start}
neighbor 0.0008 bin
neigh_modify every 1 delay 0 check yes
"""
PAIR = """
pair_style evp/lj contact literal
pair_coeff * * 80 8 4 3 8 4 0.005 {gamma} 1.5
fix bonds all evp/bonds {source}
"""
FIRST = """
region left block INF 0.005 INF INF INF INF
region right block 0.045 INF INF INF INF INF
set region left type 2
set region right type 3
velocity all ramp vx -20 20 x 0.005 0.045
velocity all set NULL 0 0
"""
# Groups by type, since a data file holds no groups.
MOTION = """
group left type 2
group right type 3
group grips type 2 3
group free type 1
velocity left set -20 0 0
velocity right set 20 0 0
fix pull grips nve/noforce
fix move free {integrator}
fix ledger all evp/energy
compute dt free evp/dt
compute pairs all evp/state/atom
timestep 3e-7
thermo 20
thermo_style custom step pe ke press f_bonds f_bonds[1] f_bonds[2] f_bonds[3] f_bonds[4] c_dt c_dt[*]
thermo_modify format float %.17g
dump all all custom 50 {name}.dump id type x y z vx vy vz fx fy fz c_pairs[*]
dump_modify all format float %.17g
run 100
"""
WRITE = """
write_restart {name}.restart
write_data {name}.data
write_evp_bonds {name}.bonds
run 100
"""
END = """
compute ids all property/local patom1 patom2
compute local all pair/local dist eng force p1 p2 p3
run 0
write_dump all local {name}_pairs.dump index c_ids[*] c_local[*] modify format float %.17g
"""
MOTIONS = {"explicit": ("nve", "0"), "implicit": ("nve/evp", "1000")}


def with_plugin(job, build):
    """The job, which starts with the plugin of a build."""
    start = job.start

    def begin():
        before = dict(os.environ)
        os.environ["EVP_PLUGIN_DIR"] = str(build)
        try:
            start()
        finally:
            os.environ.clear()
            os.environ.update(before)

    job.start = begin
    return job


def on_ranks(job, ranks):
    """The job on so many ranks, under a name of its own."""
    name, out = f"{job.name}_{ranks}r", f"{job.name}_{ranks}r" + ".data" * (job.deck == "in.specimen")
    return dataclasses.replace(job, name=name, ranks=ranks, variables={**job.variables, "out": out})


def pull_job(name, deck, folder, ranks, cost, **variables):
    """A pull of the reference specimen."""
    return quickstart.run.Job(name, deck, {"specimen": SPECIMEN, "out": name, **variables}, folder, ranks, cost)


def text_job(name, text, folder, ranks):
    """A run of a deck given as text."""
    path = folder / f"{name}.lmp"
    path.write_text(text, encoding="utf-8")
    return quickstart.run.Job(name, path, {}, folder, ranks, cost=0.3)


def first_jobs(cases, folder):
    """What depends on no other run."""
    two, specimen = quickstart.prepare_jobs(folder)
    if "two_spheres" in cases:
        yield from (on_ranks(two, ranks) for ranks in (1, 2))
    if "traction" in cases:
        specimen.cost = 3.0
        yield from (on_ranks(specimen, ranks) for ranks in (1, 2))
    if "restart" in cases:
        start = HEAD.format(start=f"boundary f f f\nread_data {SPECIMEN} extra/atom/types 2")
        for motion, (integrator, gamma) in MOTIONS.items():
            for ranks in (1, 2):
                name = f"whole_{motion}_{ranks}r"
                text = start + PAIR.format(gamma=gamma, source="zone 1.48") + FIRST + MOTION.format(integrator=integrator, name=name)
                yield text_job(name, text + (WRITE + END).format(name=name), folder, ranks)


def second_jobs(cases, folder, first, strain):
    """All others; first: folder of the first jobs whose specimen is pulled, so that a difference is not met twice."""
    if "traction" in cases:
        for table, (_, _, rates) in quickstart.TABLES.items():
            for rate in rates:
                job = quickstart.traction_job(folder, table, rate, 2)
                job.cost *= 5e-5 * strain / quickstart.STRAIN  # [s] of a step
                job.variables.update(strain=strain, specimen=first / "specimen_1r.data", also=ALL_DIGITS)
                yield on_ranks(job, 2)
                if rate == max(rates):
                    yield on_ranks(job, 1)
    for ranks in (1, 2):
        if "damped" in cases:
            for integrator in ("explicit", "implicit"):
                yield pull_job(f"damped_{integrator}_{ranks}r", "in.traction", folder, ranks, 3.0, coeff=quickstart.TABLES["table2"][1], rate=100,
                               strain=strain / 4, row=min(1e-4, strain / 4), dtfraction=0.8, integrator=integrator, also=ALL_DIGITS)
        if "quasistatic" in cases:
            yield pull_job(f"quasistatic_{ranks}r", "in.quasistatic", folder, ranks, 3.0, strain=strain, increment=min(5e-4, strain))


def resumed_jobs(folder, source):
    """Second halves of what folder source holds: restart files on as many ranks, data and bond files on other ones."""
    for motion, (integrator, gamma) in MOTIONS.items():
        for ranks in (1, 2):
            half, name = source / f"whole_{motion}_{ranks}r", f"restarted_{motion}_{ranks}r"
            text = HEAD.format(start=f"read_restart {half}.restart") + "fix bonds all evp/bonds\n"
            yield text_job(name, text + (MOTION + END).format(integrator=integrator, name=name), folder, ranks)
            name = f"read_{motion}_{3 - ranks}r"
            text = HEAD.format(start=f"boundary f f f\nread_data {half}.data nocoeff") + PAIR.format(gamma=gamma, source=f"file {half}.bonds")
            yield text_job(name, text + (MOTION + END).format(integrator=integrator, name=name), folder, 3 - ranks)


def run_all(old, new, folder, cases, strain):
    """Runs the cases with both builds. RunError where a run fails."""
    builds = {"old": old, "new": new, "crossed": new}
    for name in builds:
        (folder / name).mkdir(parents=True)
        (folder / name / ALL_DIGITS).write_text("thermo_modify format float %.17g\n", encoding="utf-8")
    jobs = [with_plugin(job, builds[name]) for name in ("old", "new") for job in first_jobs(cases, folder / name)]
    run_jobs(jobs, title="bits, part 1 of 2:")
    jobs = [with_plugin(job, builds[name]) for name in ("old", "new") for job in second_jobs(cases, folder / name, folder / "old", strain)]
    if "restart" in cases:
        for name, source in (("old", "old"), ("new", "new"), ("crossed", "old")):
            jobs += [with_plugin(job, builds[name]) for job in resumed_jobs(folder / name, folder / source)]
    run_jobs(sorted(jobs, key=lambda job: -job.cost), title="bits, part 2 of 2:")


def thermo_lines(text):
    """The lines of all thermo tables of LAMMPS' output, without the time left and without the warnings between them, whose words may change."""
    lines = []
    for table in re.findall(r"^ *Step .*?(?=^Loop time)", text, re.M | re.S):
        header, *rows = (line.split() for line in table.splitlines() if not line.startswith("WARNING"))
        lines += [" ".join(word for name, word in zip(header, row) if name != "CPULeft") for row in (header, *rows)]
    return lines


def read_lines(path):
    """Lines to compare: of a log its thermo tables, of another file all, line ends and all."""
    text = path.read_bytes().decode("utf-8", "replace")
    return thermo_lines(text) if path.suffix == ".log" else text.splitlines(keepends=True)


def first_difference(old, new):
    """None where the files at these paths are the same, else the first difference in words."""
    if not (old.exists() and new.exists()):
        return f"only {old if old.exists() else new} exists"
    if old.suffix != ".log" and old.read_bytes() == new.read_bytes():
        return None
    ours, theirs = read_lines(old), read_lines(new)
    for number, (a, b) in enumerate(zip(ours, theirs), start=1):
        if a != b:
            where = next((k for k, (p, q) in enumerate(zip(a, b)) if p != q), min(len(a), len(b)))
            cut = slice(max(0, where - 40), where + 40)
            return f"line {number}, column {where + 1}: old {a[cut]!r}, new {b[cut]!r}"
    return None if len(ours) == len(theirs) else f"old has {len(ours)} lines, new has {len(theirs)}"


def wanted(path):
    """True for the files that are compared: not the decks, nor restart files, which are compared by what follows from them."""
    return path.suffix not in (".restart", ".lmp") or path.name.endswith("_choices.lmp")


def compare_all(folder):
    """[(name, None or first difference)] of all files of the three folders; thermo tables under the name of their log."""
    found = []
    for other in ("new", "crossed"):
        names = {path.name for path in (folder / other).iterdir() if wanted(path)}
        if other == "new":
            names |= {path.name for path in (folder / "old").iterdir() if wanted(path)}
        for name in sorted(names):
            label = name.replace(".log", " (thermo)") + (" (new continues old)" if other == "crossed" else "")
            found.append((label, first_difference(folder / "old" / name, folder / other / name)))
    return found
