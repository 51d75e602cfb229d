#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Compares two builds of the plugin: bits of the results, and speed.

    tests/maintain/compare_builds.py --old DIR [--new DIR] [--only CASE ...] [bits | speed]

bits runs some decks and every effect of tests/lammps/test_matrix.py with both builds, on 1 and 2 ranks, and compares every CSV, dump, data, bond
and thermo table byte by byte; restart files are compared by runs that continue from them, also of the new build from a file of the old one.
speed runs scenes of doc/studies/bench.py with the old and the new build in turn, and compares the user time in LAMMPS' loop: median and quartiles of
the ratios new/old of the rounds. The result is uncertain where the limit, 1.03, lies between the quartiles: give more --rounds, or use an idle machine.
Exit status: 1 where a file differs, a median exceeds the limit or a run fails.
EVP_LMP is the lmp of both builds (default: build/lmp of this checkout), which has to take EVP_PLUGIN_DIR.
"""

import contextlib
import os
import pathlib
import re
import shutil
import statistics
import sys
import tempfile

import tools_path  # noqa: F401  before evp
from bench import ratios, run_scene
from bench_scenes import ALWAYS, ours
import quickstart
from evp.report import command_line, errors_in_one_line
from evp.run import CHECKOUT, RunError, lammps_command, watched
from lammps_run import run_lammps
from test_matrix import FEATURES, way, whole, write

TABLE2 = {"coeff": quickstart.TABLES["table2"][1], "rate": 100, "dtfraction": 0.8}
PULL = {"specimen": CHECKOUT / "tests" / "data" / "reference_500" / "specimen_500.data", "strain": 0.02, "also": "all_digits.lmp"}
DECKS = {
    "two_spheres": ("in.two_spheres", {}),
    "traction": ("in.traction", {**PULL, "rate": 10}),
    "explicit": ("in.traction", {**PULL, **TABLE2}),
    "pulled implicit": ("in.traction", {**PULL, **TABLE2, "integrator": "implicit"}),
    "quasistatic": ("in.quasistatic", PULL),
}
HALF = ("body.data", "half.restart", "half.data", "half.bonds")
ROUTES = ("restart", "data")
MEDIUM, LARGE = 13, 25  # cells of the lattice: 8788 and 62 500 spheres
SCENES = {  # of about a second on one core
    "pair": ours("pair loop, undamped", MEDIUM, 1500),
    "pair_large": ours("pair loop, undamped", LARGE, 200),
    "explicit": ours("damped, explicit", MEDIUM, 1500, gamma=0.1),
    "implicit": ours("damped, implicit (fix nve/evp)", MEDIUM, 300, gamma=0.1, move="nve/evp"),
    "energy": ours("fix evp/energy at each step", MEDIUM, 400, more="fix ledger all evp/energy"),
    "packing": ours("neighbor list and packing at each step", MEDIUM, 150, neigh=ALWAYS),
}
CASES = {"bits": [*DECKS, "matrix"], "speed": list(SCENES)}
LIMIT = 1.03


@contextlib.contextmanager
def plugin_of(build):
    os.environ["EVP_PLUGIN_DIR"] = str(build)
    try:
        yield
    finally:
        del os.environ["EVP_PLUGIN_DIR"]


# ---- bits


def run(folder, source, deck, variables, ranks, build):
    """A run in a folder, from the files of another one; its output goes to screen.log."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in HALF if source else ():
        shutil.copy(source / name, folder)
    (folder / "all_digits.lmp").write_text("thermo_modify format float %.17g\n", encoding="utf-8")
    with plugin_of(build):
        found = run_lammps(deck, ranks, variables, folder)
    (folder / "screen.log").write_text(found.stdout, encoding="utf-8")
    if found.returncode:
        raise RunError(f"{folder.name} failed with the plugin of {build}: see {folder / 'screen.log'}")


def run_all(old, new, folder, cases):
    """FOLDER/old, FOLDER/new, and FOLDER/crossed, where the new build continues what the old one wrote."""
    names = [case for case in cases if case in DECKS] + (list(FEATURES) if "matrix" in cases else [])
    for case, ranks in watched("bits,", [(case, ranks) for case in names for ranks in (1, 2)], name=lambda one: f"{one[0]} on {one[1]} ranks"):
        own = f"{case.replace(', ', '+').replace(' ', '_')}_{ranks}r"
        for place, build in (("old", old), ("new", new)):
            if case in DECKS:
                run(folder / place / own, None, *DECKS[case], ranks, build)
            else:
                (folder / place / own).mkdir(parents=True)
                write(folder / place / own, FEATURES[case])
                run(folder / place / own, None, whole(FEATURES[case]), {}, ranks, build)
        for route in ROUTES if case in FEATURES else ():
            for place, source, build in (("old", "old", old), ("new", "new", new), ("crossed", "old", new)):
                run(folder / place / f"{own}_{route}", folder / source / own, way(FEATURES[case], "on", "brick", route), {}, ranks, build)


def thermo_lines(text):
    """The lines of all thermo tables of LAMMPS' output, without the time left and without the warnings between them, whose words may change."""
    lines = []
    for table in re.findall(r"^ *Step .*?(?=^Loop time)", text, re.M | re.S):
        header, *rows = (line.split() for line in table.splitlines() if not line.startswith("WARNING"))
        lines += [" ".join(word for name, word in zip(header, row) if name != "CPULeft") for row in (header, *rows)]
    return lines


def first_difference(old, new):
    """None where the files at these paths are the same, else the first difference in words; of a log its thermo tables, of another file all."""
    if not (old.exists() and new.exists()):
        return f"only {old if old.exists() else new} exists"
    texts = (path.read_bytes().decode("utf-8", "replace") for path in (old, new))
    ours, theirs = (thermo_lines(text) if old.suffix == ".log" else text.splitlines(keepends=True) for text in texts)
    for number, (a, b) in enumerate(zip(ours, theirs), start=1):
        if a != b:
            where = len(os.path.commonprefix((a, b)))
            cut = slice(max(0, where - 40), where + 40)
            return f"line {number}, column {where + 1}: old {a[cut]!r}, new {b[cut]!r}"
    return None if len(ours) == len(theirs) else f"old has {len(ours)} lines, new has {len(theirs)}"


def wanted(path):
    """True for the files that are compared: not the decks, nor restart files, which are compared by what follows from them."""
    return path.is_file() and path.suffix not in (".restart", ".lmp") and not path.name.startswith("in_run.")


def compare_all(folder):
    """[(name, None or first difference)] of all files of the folders; thermo tables under the name of their log."""
    found = []
    for other, places in (("new", ("old", "new")), ("crossed", ("crossed",))):
        for name in sorted({path.relative_to(folder / place) for place in places for path in (folder / place).rglob("*") if wanted(path)}):
            label = str(name).replace(".log", " (thermo)") + (" (new continues old)" if other == "crossed" else "")
            found.append((label, first_difference(folder / "old" / name, folder / other / name)))
    return found


def same_bits(old, new, cases, kept):
    """Prints a line for each file; True where all are the same. kept: a new folder, or None for a temporary one, which stays where a file differs."""
    folder = kept.absolute() if kept else pathlib.Path(tempfile.mkdtemp(prefix="compare_builds."))
    run_all(old, new, folder, cases)
    found = compare_all(folder)
    differ = sum(difference is not None for _, difference in found)
    print(*(f"same     {name}" if difference is None else f"differs  {name}: {difference}" for name, difference in found), sep="\n")
    print(f"{len(found)} compared, {differ} differ")
    if differ or kept:
        print(f"files: {folder}")
    else:
        shutil.rmtree(folder)
    return not differ


# ---- speed


def user_time(scene, build, folder):
    """In LAMMPS' loop: what LAMMPS calls CPU use, without system time."""
    with plugin_of(build):
        timing = run_scene(scene, pathlib.Path(folder))
    return timing.loop * float(re.search(r"^(\S+)% CPU use with", timing.output, re.M)[1])


def as_fast(old, new, cases, rounds):
    """Prints the table; True where no median exceeds the limit."""
    builds, slower = {"old": old, "new": new}, False
    with tempfile.TemporaryDirectory() as folder:
        times = {(case, name): [] for case in cases for name in builds}
        for case, name in watched("speed,", rounds * list(times)):  # in turn, so that a slow moment of the machine meets all
            times[case, name].append(user_time(SCENES[case], builds[name], folder))
    print(f"{'case, new/old: median (quartiles)':<50} {'user time':<24} verdict (limit {LIMIT:g})")
    for case in cases:
        found = ratios(times[case, "new"], times[case, "old"])
        low, middle, high = statistics.quantiles(found, n=4, method="inclusive") if rounds > 1 else 3 * found
        name, numbers = f"{SCENES[case].name}, N = {SCENES[case].atoms}", f"{middle:.3f} ({low:.3f} to {high:.3f})"
        print(f"{name:<50} {numbers:<24} {'slower' if middle > LIMIT else 'ok'}{', uncertain' * (low <= LIMIT <= high)}")
        slower = slower or middle > LIMIT
    return not slower


def check_build(build):
    """RunError with the remedy where there is no plugin in the build folder, or this lmp does not load it."""
    if not (build / "evpplugin.so").is_file():
        raise RunError(f"no evpplugin.so in {build}: give a folder that CMake built in, or run `cmake --build {build}` first")
    with tempfile.TemporaryDirectory() as folder, plugin_of(build):
        text = run_lammps("pair_style evp/lj\n", 1, None, folder).stdout
    if re.findall("^Loaded .*", text, re.M) != [f"Loaded 1 plugins from {build}"]:
        raise RunError(f"{lammps_command()[0]} did not load {build}/evpplugin.so alone: set EVP_LMP to the wrapper build/lmp of a build, "
                       f"and unset LAMMPS_PLUGIN_PATH. Its output was\n{text}")


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("what", nargs="?", choices=CASES, help="default: both, one after the other")
    parser.add_argument("--old", type=pathlib.Path, required=True, metavar="DIR", help="build folder of the one, with evpplugin.so")
    parser.add_argument("--new", type=pathlib.Path, default=CHECKOUT / "build", metavar="DIR", help="of the other (default: build of this checkout)")
    parser.add_argument("--only", nargs="+", choices=sorted({*CASES["bits"], *CASES["speed"]}), metavar="CASE",
                        help="these alone, of " + "; ".join(f"{what}: {', '.join(names)}" for what, names in CASES.items()))
    parser.add_argument("--rounds", type=int, default=7, help="speed: runs of each build and case (default 7)")
    parser.add_argument("--folder", type=pathlib.Path, metavar="DIR", help="bits: keep what the runs write in this new folder")
    options = parser.parse_args(words)
    old, new = options.old.absolute(), options.new.absolute()
    chosen = {what: [name for name in names if not options.only or name in options.only] for what, names in CASES.items() if options.what in (None, what)}
    with errors_in_one_line("compare_builds.py"):
        for build in (old, new):
            check_build(build)
        if (old / "evpplugin.so").read_bytes() == (new / "evpplugin.so").read_bytes():
            print("note: the two builds hold the same evpplugin.so")
        same = not chosen.get("bits") or same_bits(old, new, chosen["bits"], options.folder)
        fast = not chosen.get("speed") or as_fast(old, new, chosen["speed"], options.rounds)
    return 0 if same and fast else 1


if __name__ == "__main__":
    sys.exit(main())
