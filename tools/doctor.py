#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Why LAMMPS says 'Unrecognized pair style evp/lj', or does not open the plugin, and the command that mends it.

  doctor.py                            the lmp of EVP_LMP or PATH, the plugin of LAMMPS_PLUGIN_PATH or of EVP's build
  doctor.py --lmp /path/to/lmp         another lmp
  doctor.py --plugin evpplugin.so      this plugin, as decks with `plugin load` take it
  doctor.py --log log.lammps           also reads the log of the run that failed

Starts lmp and mpirun with decks of a few lines; changes nothing. One line per check (ok, note, FAULT, not checked); at the end the cause and
one command. Exit status: 0 healthy, 1 a fault, 2 wrong use. Paste the output into an issue: beside versions it holds paths only.
"""

import os
import pathlib
import re
import signal
import sys
import types

TOOLS = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(TOOLS))

# The package evp asks for numpy when it is imported. The doctor must speak where there is none.
if "evp" not in sys.modules:
    _package = types.ModuleType("evp")
    _package.__path__ = [str(TOOLS / "evp")]
    sys.modules["evp"] = _package

from evp import doctor_checks as checks  # noqa: E402
from evp import doctor_host as hosts  # noqa: E402
from evp import doctor_log, doctor_report  # noqa: E402
from evp import doctor_plugin as plugins  # noqa: E402
from evp.report import command_line  # noqa: E402


AFTER = "first mend the fault above"


def version():
    """Of EVP, as tools/evp says it."""
    found = re.search(r'^__version__ = "(.+)"', (TOOLS / "evp" / "__init__.py").read_text(encoding="utf-8"), re.M)
    return found[1] if found else "of unknown version"


def parser():
    """The command line."""
    top = command_line(__doc__)
    top.add_argument("--lmp", metavar="LMP", help="LAMMPS program (default: $EVP_LMP, else the first lmp on PATH, else that of EVP's build)")
    top.add_argument("--plugin", type=pathlib.Path, metavar="FILE", help="plugin (default: of LAMMPS_PLUGIN_PATH, else that of EVP's build or installation)")
    top.add_argument("--log", type=pathlib.Path, metavar="FILE", help="log.lammps of a run that failed, or its kept output")
    return top


def check_plugin(report, host, plugin, given):
    """All checks of a plugin that there is; those that would only repeat an earlier fault are left out."""
    found = checks.check_file(report, host, plugin)
    if found is None or not host or not host.sound:
        report.not_checked("load", AFTER)
    elif checks.check_facts(report, host, plugin) and checks.check_symbols(report, host, plugin, found):
        checks.check_load(report, host, plugin, given)
        checks.check_age(report, host, plugin)
    else:
        report.not_checked("load", AFTER)


def examine(args, log):
    """Report of all checks."""
    report = doctor_report.Report()
    hosts.check_python(report)
    host = hosts.find_lmp(args.lmp)
    hosts.check_lmp(report, host)
    given = args.plugin or (log and log.plugin())
    plugin = checks.find_plugin(host, given)
    if host and host.sound:
        checks.check_path(report, host, plugin, given)
    if plugin:
        check_plugin(report, host, plugin, given)
    else:
        report.fault("plugin file", "none found", "there is no evpplugin.so: it has not been built yet.", checks.remedies.get_lammps())
    if host and host.sound:
        checks.check_packages(report, host, log)
    hosts.check_mpirun(report, host)
    checks.check_log(report, host, plugin, log)
    return report


def main(argv=None):
    """Returns 0, or 1 where a fault is named."""
    top = parser()
    args = top.parse_args(argv)
    for option, path in (("--lmp", args.lmp), ("--plugin", args.plugin), ("--log", args.log)):
        if path and not pathlib.Path(path).is_file():
            top.error(f"{option} {path}: no such file")
    try:
        log = doctor_log.read(args.log) if args.log else None
    except (OSError, ValueError) as error:
        top.error(f"--log: {error}")
    plugins.as_the_shell_has_it(os.environ)
    print(f"evp doctor: EVP {version()} on {hosts.system_words()}", flush=True)
    report = examine(args, log)
    print("\n" + report.verdict())
    return 1 if report.faults() else 0


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # of `| head`
    sys.exit(main())
