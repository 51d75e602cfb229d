# SPDX-License-Identifier: GPL-2.0-only
"""The runs of a calibration on disk, so that a killed one goes on."""

import fcntl
import json
import os
import pathlib


class Table:
    """JSON lines on disk, the first with the inputs, each other one with a run that ended, well or not: a killed calibration goes on with them.

    inputs: a dict that decides everything else. A line that was cut off is no run; one process writes at a time.
    """

    def __init__(self, path, inputs):
        self.path = pathlib.Path(path)
        self.file = open(self.path, "a+", encoding="utf-8")
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"another calibration is writing {self.path}: wait for it") from None
        self.file.seek(0)
        text = self.file.read()
        whole = text[: text.rfind("\n") + 1]
        self.file.truncate(len(whole.encode("utf-8")))  # what a kill has cut off
        try:
            self.runs = [json.loads(line) for line in whole.splitlines()]
        except ValueError as error:
            raise ValueError(f"{self.path} is no run table: {error}; take it away") from None
        if not self.runs:
            self.add({"inputs": inputs})
        before, inputs = self.runs.pop(0).get("inputs") or {}, json.loads(json.dumps(inputs))
        other = [key for key in {**before, **inputs} if before.get(key) != inputs.get(key)]
        if other:
            raise ValueError(f"{self.path} holds the runs of a calibration with another {', '.join(sorted(other))}: "
                             "take it away, or give another --out")

    def find(self, **key):
        """The run with these values, or None."""
        return next((run for run in self.runs if all(run.get(name) == value for name, value in key.items())), None)

    def add(self, record):
        """Append a run that has ended; returns it as it is read again."""
        line = json.dumps(record)
        self.file.write(line + "\n")
        self.file.flush()
        os.fsync(self.file.fileno())
        self.runs.append(json.loads(line))
        return self.runs[-1]

    def close(self):
        """Let others write."""
        self.file.close()
