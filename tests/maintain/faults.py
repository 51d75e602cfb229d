#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Builds the plugin with each fault of src/core/fault.h, and checks that the robustness tests fail.

    tests/maintain/faults.py [--only FAULT ...]

Works on a copy of the sources, with the LAMMPS that build/ was configured for (tools/setup.sh). Half a minute per fault on two cores.
Exit code 1 if a test passes in spite of its fault, or the first one fails without any.
"""

import os
import pathlib
import re
import shutil
import sys
import tempfile
from typing import NamedTuple

import tools_path  # noqa: F401  before evp
from evp.report import command_line, errors_in_one_line
from evp.run import CHECKOUT, RunError, output_of, watched
from robustness import collect, run

CASES = {  # robustness tests that must fail with a fault: words of their names
    "QUARTER_STIFFNESS": ["times critical damping: 0.0"],
    "NO_GAMMA_IN_DT": ["times critical damping: 1.0", "times critical damping: 3.6", "times critical damping: 30.0"],
    "ONE_MASS": ["ratio of"],
    "NO_DT_WARNING": ["table 2 at the paper s timestep"],
    "NO_DISPLACEMENT_LIMIT": ["table 1 pulled to rupture", "head on impact: 500"],
    "NO_OVERLAP_WARNING": ["overlap to one half"],
    "NO_COINCIDENCE_CHECK": ["coincident centres"],
    "HALF_CARRIED": ["pair swings across xi s", "pair passes dlim back and forth"],
    "HALF_THRESHOLD": ["threshold strain: 0.001", "threshold strain: 0.05", "threshold strain: 0.3"],
    "E2_SHORT": ["threshold strain: 1e-06"],
    "EXPONENTS_4_2": ["exponents: 2 1"],
    "FIRST_POWERS": ["exponents: 8 4", "exponents: 13.5", "exponents: 24"],
    "DLIM_LONG": ["range alpha"],
    "NONZERO_AT_DLIM": ["all pairs at dlim"],
    "GAMMA_LONG": ["free vibration"],
    "VX_OF_PARTNER_ONLY": ["fragment moving and spinning: explicit"],
    "NO_DAMPING_ALONG_Y": ["fragment moving and spinning: implicit"],
    "NO_ROTATION": ["spinning cube", "spinning top"],
    "ONE_PASS": ["spinning top"],
    "NO_IMPLICIT": ["hold at constant strain"],
    "NULL_IS_PRESCRIBED": ["null component"],
    "NO_IMAGE_VELOCITIES": ["sheared box"],
    "NO_WRAPPED_ENERGY": ["sheared box"],
    "NO_WORK_OF_BOX": ["sheared box"],
    "HALF_DISSIPATION": ["off centre impact"],
    "KINETIC_SHORT": ["shaken far beyond xi s"],
    "NO_NEW_CONTACTS": ["head on impact: 1", "head on impact: 30"],
    "NO_LOST_BONDS": ["table 2 pulled to 50 percent"],
    "NO_FLOW_IN_COMPRESSION": ["pair cycled far"],
    "CONTACTS_FLOW_IN_TENSION": ["contact pushed and parted"],
    "NO_BOND_BREAKS": ["bond torn and pushed"],
    "NO_FLOW_OF_MISSING": ["past its cutoff"],
    "HISTORY_AT_ONE_ATOM": ["flow in a body whose atoms are sorted"],
    "STOPPED_FLOWS": ["minimization that stops early"],
    "BODIES_BONDED": ["two bodies brought together", "ball hits block"],
    "BODIES_ATTRACT": ["two bodies brought together: literal", "ball hits block"],
    "CONTACTS_FLOW_BETWEEN_BODIES": ["two bodies brought together"],
    "HALF_VOLUME_FORCE": ["volume energy of a free body"],
}
LISTED = re.compile(r"^  (\w+),? +///< (.+)$", re.M)
ASKED = re.compile(r"\bfault\((?:EVP::)?([A-Z]\w+)\)")
SAME = re.compile(r"^(LAMMPS_\w+|CMAKE_BUILD_TYPE|MPI_CXX_COMPILER|CMAKE_CXX_COMPILER):\w+=(.+)$", re.M)


class Fault(NamedTuple):
    """What a build with it does wrong, and the files that ask for it."""

    what: str
    files: list


def read_faults(sources):
    """{name: Fault} of src/."""
    listed = dict(LISTED.findall((sources / "core" / "fault.h").read_text(encoding="utf-8")))
    asked = {path: ASKED.findall(path.read_text(encoding="utf-8")) for path in sorted(sources.rglob("*.*"))}
    return {name: Fault(what, [path for path, names in asked.items() if name in names]) for name, what in listed.items()}


def fault_names(test):
    """The faults that a test of this name must fail with."""
    return [name for name, cases in CASES.items() if any(words in test for words in cases)]


class Build:
    """The plugin of a copy of the checkout. The compiler reads the fault from a file, so that only what asks for it is built anew."""

    def __init__(self, folder):
        cache = CHECKOUT / "build" / "CMakeCache.txt"
        if not cache.exists():
            raise RunError(f"no {cache}: run tools/setup.sh first")
        for part in ("src", "cmake", "tools", "CMakeLists.txt"):
            source = CHECKOUT / part
            (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / part)
        self.folder, self.flags = folder / "build", folder / "flags"
        self.faults, self.built = read_faults(folder / "src"), []
        self.flags.touch()
        same = [f"-D{name}={value}" for name, value in SAME.findall(cache.read_text(encoding="utf-8"))]
        output_of(["cmake", "-S", str(folder), "-B", str(self.folder), "-DBUILD_TESTING=off", f"-DCMAKE_CXX_FLAGS=@{self.flags}", *same], folder, "CMake")

    def make(self, name="NO_FAULT"):
        """RunError with the compiler's words."""
        self.flags.write_text(f"-DEVP_FAULT={name}", encoding="utf-8")
        files = self.faults[name].files if name in self.faults else []
        for path in {*self.built, *files}:
            path.touch()
        self.built = files
        output_of(["cmake", "--build", str(self.folder), "-j", str(os.cpu_count() or 1), "--target", "evpplugin"], self.folder, f"the build with {name}")


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES), metavar="FAULT", help="names in src/core/fault.h")
    options = parser.parse_args(words)
    bad = []
    with errors_in_one_line("faults.py"), tempfile.TemporaryDirectory() as name:
        build = Build(pathlib.Path(name))
        lmp = str(build.folder / "lmp")
        tests = [test for test in collect() if test.ranks == 1]
        build.make()
        first = [test for test in tests if options.only[0] in fault_names(test.name)][:1]
        bad += [f"without a fault: {text}" for text, right in run([test.node for test in first], EVP_LMP=lmp).values() if not right]
        for fault in watched("faults", sorted(options.only, key=lambda fault: build.faults[fault].files)):
            build.make(fault)
            print(f"{fault}: {build.faults[fault].what}", flush=True)
            found = run([test.node for test in tests if fault in fault_names(test.name)], EVP_LMP=lmp)
            bad += [] if found else [f"{fault} has no test"]
            for (name, _), (text, right) in found.items():
                print(f"    {'PASSES' if right else 'fails, as expected'}: {name}: {text[:150]}", flush=True)
                bad += [f"'{name}' passes with {fault}"] if right else []
    for line in bad:
        print("NOT SEEN: " + line)
    print(f"{len(options.only)} faults, {f'{len(bad)} NOT seen' if bad else 'all seen'}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
