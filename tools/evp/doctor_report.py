# SPDX-License-Identifier: GPL-2.0-only
"""The doctor's lines, one per check, and its last paragraph."""

import textwrap
from dataclasses import dataclass, field

from .doctor_remedies import meaning

OK, NOTE, FAULT, NOT_CHECKED = "ok", "note", "FAULT", "not checked"
_WIDTH = 120


@dataclass(frozen=True)
class Line:
    name: str
    state: str
    text: str
    cause: str = ""  # of a FAULT, as a sentence
    command: str = ""  # that mends it


@dataclass
class Report:
    """Checks in their order: the first fault is the cause that is named, as later ones may follow from it."""

    lines: list = field(default_factory=list)

    def ok(self, name, text):
        self._add(Line(name, OK, text))

    def note(self, name, text):
        """What is no fault, but to be known."""
        self._add(Line(name, NOTE, text))

    def not_checked(self, name, text):
        self._add(Line(name, NOT_CHECKED, text))

    def fault(self, name, text, cause, command):
        self._add(Line(name, FAULT, text, cause, command))

    def _add(self, line):
        self.lines.append(line)
        print(f"{line.state:<11}  {line.name:<12}  {line.text}", flush=True)

    def faults(self):
        return [line for line in self.lines if line.state == FAULT]

    def verdict(self):
        """The last paragraph."""
        faults = self.faults()
        if not faults:
            open_checks = [line.name for line in self.lines if line.state == NOT_CHECKED]
            return "Healthy: lmp loads the plugin and knows pair_style evp/lj." + (f" Not checked: {', '.join(open_checks)}." if open_checks else "")
        others = [line.name for line in faults[1:]]
        text = textwrap.fill("Cause: " + faults[0].cause + meaning(faults[0].command), _WIDTH, break_long_words=False, break_on_hyphens=False)
        text += f"\nRun:   {faults[0].command}"
        return text + (f"\nThen run evp doctor again; it found more: {', '.join(others)}." if others else "")
