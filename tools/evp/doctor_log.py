# SPDX-License-Identifier: GPL-2.0-only
"""What a log.lammps, or the output of a run that was kept, says of how the plugin was loaded."""

import re
from dataclasses import dataclass

from . import doctor_plugin as plugins

OWN_STYLES = re.compile(r"Unrecognized \w+ style '([\w/]*evp[\w/]*)'|Unknown command: ((?:read|write)_evp_\w+)")


@dataclass(frozen=True)
class Log:
    """Of the last run in the file: LAMMPS appends none, but a job's output may hold several."""

    release: str  # '4 Feb 2025'; empty where it does not say
    loaded: bool  # any plugin was loaded
    failures: list  # [(file, what dlopen said)]
    refusal: str  # by the plugin itself
    unknown: str  # EVP's style that LAMMPS did not know
    package: tuple  # (style, package) that this LAMMPS lacks
    twice: bool  # LAMMPS ignored a second load
    error: str  # the first one

    def loads_of_deck(self):
        return [file for file, _ in self.failures]


def read(path):
    """Log of a file; OSError where it cannot be read, ValueError where it is none of LAMMPS."""
    with open(path, encoding="utf-8", errors="replace") as source:
        text = source.read()
    starts = [found.start() for found in re.finditer(r"^LAMMPS \(", text, re.M)]
    if not starts:
        raise ValueError(f"{path} is no log of LAMMPS: no line begins with 'LAMMPS ('")
    text = text[starts[-1]:]
    banner = re.match(r"LAMMPS \((\d+ [A-Z][a-z]{2} \d{4})", text)
    counts = [int(count) for count in re.findall(r"^Loaded (\d+) plugins from", text, re.M)]
    package = re.search(r"Unrecognized \w+ style '(\S+)' is part of the (\S+) package", text)
    unknown = OWN_STYLES.search(text)
    error = re.search(r"^ERROR\b.*", text, re.M)
    return Log(banner[1] if banner else "", any(counts) or bool(re.search(r"^Loading plugin: ", text, re.M)), plugins.open_failures(text),
               plugins.refusal(text), next((word for word in unknown.groups() if word), "") if unknown else "", package.groups() if package else (),
               "Ignoring load of pair style evp/lj" in text, error[0] if error else "")
