# SPDX-License-Identifier: GPL-2.0-only
"""The run table of a calibration: JSON lines, the first with the inputs, each other one with a run that ended, well or not.

A line is written whole and forced to disk, so that a calibration which was killed goes on with the runs that it finished; a line
that was cut off is no run. One process writes at a time.
"""

import fcntl
import json
import os
import pathlib

from .calibration_targets import Refused


class Table:
    """inputs: a dict that decides everything else; the same inputs give the same runs. fresh: forget what is there."""

    def __init__(self, path, inputs, fresh=False):
        self.path, self.inputs = pathlib.Path(path), json.loads(json.dumps(inputs))
        self.file = open(self.path, "a+", encoding="utf-8")
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self.file.close()
            raise Refused(f"another calibration is writing {self.path}: wait for it, or give another --table") from None
        try:
            if fresh:
                self.file.truncate(0)
            self._read()
        except BaseException:
            self.file.close()
            raise

    def _read(self):
        self.file.seek(0)
        text = self.file.read()
        whole = text[: text.rfind("\n") + 1]
        if whole != text:  # a line cut off by a kill
            os.truncate(self.path, len(whole.encode("utf-8")))
        try:
            lines = [json.loads(line) for line in whole.splitlines()]
        except ValueError as error:
            raise Refused(f"{self.path} is no run table: {error}; take it away, or give another --table") from None
        if not lines:
            self._write({"inputs": self.inputs})
            lines = [{"inputs": self.inputs}]
        if lines[0].get("inputs") != self.inputs:
            before = lines[0].get("inputs") or {}
            other = [key for key in {**before, **self.inputs} if before.get(key) != self.inputs.get(key)]
            raise Refused(f"{self.path} holds the runs of a calibration with another {', '.join(sorted(other))}: "
                          "--fresh begins anew, --table names another file")
        self.runs = lines[1:]

    def _write(self, record):
        self.file.write(json.dumps(record) + "\n")
        self.file.flush()
        os.fsync(self.file.fileno())

    def find(self, **key):
        """The run with these values, or None."""
        return next((run for run in self.runs if all(run.get(name) == value for name, value in key.items())), None)

    def add(self, record):
        """Append a run that has ended."""
        record = json.loads(json.dumps(record))
        self._write(record)
        self.runs.append(record)
        return record

    def close(self):
        """Let others write."""
        self.file.close()
