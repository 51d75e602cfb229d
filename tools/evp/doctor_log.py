# SPDX-License-Identifier: GPL-2.0-only
"""What a log.lammps, or the output of a run that was kept, says of how the plugin was loaded."""

import pathlib
import re
from dataclasses import dataclass

from . import doctor_plugin as plugins

OWN_STYLES = re.compile(r"Unrecognized \w+ style '([\w/]*evp[\w/]*)'|Unknown command: ((?:read|write)_evp_\w+)")


@dataclass(frozen=True)
class Log:
    """Of the last run in the file: the kept output of a job may hold several."""

    folder: pathlib.Path  # of the file
    release: str  # '4 Feb 2025'; empty where it does not say
    loaded: bool  # any plugin was loaded
    empty: list  # lines that say 'Loaded 0 plugins from FOLDER'
    loads: list  # files of `plugin load` lines of the deck
    failures: list  # [(file, what dlopen said)]
    refusal: str  # by the plugin itself
    unknown: str  # EVP's style that LAMMPS did not know
    package: tuple  # (style, package) that this LAMMPS lacks
    twice: bool  # LAMMPS ignored a second load
    error: str  # the first one
    warning: str  # the last one that names the timestep
    ended: bool  # with an error, or as a run ends

    def plugin(self):
        """The first file of a `plugin load` line that is there, as seen from the folder of the log; None without."""
        return next((self.folder / file for file in self.loads if "/" in file and (self.folder / file).is_file()), None)


def _last_of_timestep(text):
    """The last WARNING that names the timestep, without its place in LAMMPS' sources; empty without one."""
    found = re.findall(r"^WARNING: (.*timestep.*)", text, re.M | re.I)
    return re.sub(r" \(src/\S+:\d+\)$| \(\S+\.(?:cpp|h):\d+\)$", "", found[-1]) if found else ""


def read(path):
    """Log of a file; OSError where it cannot be read, ValueError where it is none of LAMMPS."""
    with open(path, encoding="utf-8", errors="replace") as source:
        text = source.read()
    starts = [found.start() for found in re.finditer(r"^LAMMPS \(", text, re.M)]
    if not starts:
        raise ValueError(f"{path} is no log of LAMMPS: no line begins with 'LAMMPS ('")
    text = text[starts[-1]:]
    banner = re.match(r"LAMMPS \((\d+ [A-Z][a-z]{2} \d{4})", text)
    loaded = bool(re.search(r"^Loaded [1-9]\d* plugins from|^Loading plugin: ", text, re.M))
    package = re.search(r"Unrecognized \w+ style '(\S+)' is part of the (\S+) package", text)
    unknown = OWN_STYLES.search(text)
    unknown = unknown[1] or unknown[2] if unknown else ""
    error = re.search(r"^ERROR\b.*", text, re.M)
    loads = [word.strip("\"'") for line in re.findall(r"^plugin\s+load\s+(.+)$", text, re.M) for word in line.split()]
    return Log(pathlib.Path(path).absolute().parent, banner[1] if banner else "", loaded,
               re.findall(r"^Loaded 0 plugins from .*", text, re.M), loads, plugins.open_failures(text), plugins.refusal(text), unknown, package.groups() if package else (),
               "Ignoring load of pair style evp/lj" in text, error[0] if error else "", _last_of_timestep(text), bool(error) or "Total wall time" in text)
