# SPDX-License-Identifier: GPL-2.0-only
"""The runs of `compare_builds.py bits`, and the comparison of what they wrote.

Each run is made with both builds, in a folder of its own below FOLDER/old and FOLDER/new: some decks, and every effect of the matrix of
tests/lammps/test_matrix.py, which each build also continues from its own files. In FOLDER/crossed the new build continues what the old one wrote.
"""

import os
import re
import shutil

import tools_path  # noqa: F401  before the matrix
import quickstart
from evp.progress import watched
from evp.run import CHECKOUT, RunError
from lammps_run import run_lammps
from test_matrix import FEATURES, way, whole, write

SPECIMEN = CHECKOUT / "tests" / "data" / "reference_500" / "specimen_500.data"
ALL_DIGITS = "thermo_modify format float %.17g\n"  # what a deck takes by `also`
TABLE2 = {"coeff": quickstart.TABLES["table2"][1], "rate": 100}
DECKS = {
    "two_spheres": ("in.two_spheres", {}),
    "traction": ("in.traction", {"rate": 10}),
    "explicit": ("in.traction", {**TABLE2, "dtfraction": 0.8}),
    "pulled implicit": ("in.traction", {**TABLE2, "dtfraction": 0.8, "integrator": "implicit"}),
    "quasistatic": ("in.quasistatic", {}),
}
CASES = (*DECKS, "matrix")
HALF = ("body.data", "half.restart", "half.data", "half.bonds")
ROUTES = ("restart", "data")


def run(folder, deck, variables, ranks, build):
    """A run with the plugin of a build; RunError where it fails. Its output goes to screen.log."""
    os.environ["EVP_PLUGIN_DIR"] = str(build)
    try:
        found = run_lammps(deck, ranks, variables, folder)
    finally:
        del os.environ["EVP_PLUGIN_DIR"]
    (folder / "screen.log").write_text(found.stdout, encoding="utf-8")
    if found.returncode:
        raise RunError(f"{folder.name} failed with the plugin of {build}: see {folder / 'screen.log'}")


def run_case(folder, case, ranks, strain, build):
    """A deck, or the whole run of an effect."""
    folder.mkdir(parents=True)
    if case in DECKS:
        deck, variables = DECKS[case]
        (folder / "all_digits.lmp").write_text(ALL_DIGITS, encoding="utf-8")
        pull = {"specimen": SPECIMEN, "strain": strain, "also": "all_digits.lmp"} if case != "two_spheres" else {}
        run(folder, deck, {**variables, **pull}, ranks, build)
    else:
        write(folder, FEATURES[case])
        run(folder, whole(FEATURES[case]), {}, ranks, build)


def continue_case(folder, source, case, ranks, route, build):
    """The second half of an effect, from the files in another folder."""
    folder.mkdir(parents=True)
    for name in HALF:
        shutil.copy(source / name, folder)
    run(folder, way(FEATURES[case], "on", "brick", route), {}, ranks, build)


def run_all(old, new, folder, cases, strain):
    """Runs the cases with both builds. RunError where a run fails."""
    builds = {"old": old, "new": new, "crossed": new}
    names = [case for case in cases if case in DECKS] + (list(FEATURES) if "matrix" in cases else [])
    for case, ranks in watched("bits,", [(case, ranks) for case in names for ranks in (1, 2)], name=lambda one: f"{one[0]} on {one[1]} ranks"):
        own = f"{case.replace(', ', '+').replace(' ', '_')}_{ranks}r"
        for place in ("old", "new"):
            run_case(folder / place / own, case, ranks, strain, builds[place])
        for route in ROUTES if case in FEATURES else ():
            for place, build in builds.items():
                source = folder / ("old" if place == "crossed" else place) / own
                continue_case(folder / place / f"{own}_{route}", source, case, ranks, route, build)


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
    return path.is_file() and path.suffix not in (".restart", ".lmp") and not path.name.startswith("in_run.")


def compare_all(folder):
    """[(name, None or first difference)] of all files of the folders; thermo tables under the name of their log."""
    found = []
    for other in ("new", "crossed"):
        names = {path.relative_to(folder / place) for place in (("old", other) if other == "new" else (other,)) for path in (folder / place).rglob("*") if wanted(path)}
        for name in sorted(names):
            label = str(name).replace(".log", " (thermo)") + (" (new continues old)" if other == "crossed" else "")
            found.append((label, first_difference(folder / "old" / name, folder / other / name)))
    return found
