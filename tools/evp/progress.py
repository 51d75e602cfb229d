# SPDX-License-Identifier: GPL-2.0-only
"""Progress of runs that come one after the other, with the time left by what each was expected to cost."""

import sys
import time

from .run import format_seconds


class Progress:
    """A bar on a terminal, plain lines elsewhere. with Progress([seconds of each run]) as bar: bar.before(number, name) ..."""

    def __init__(self, expected):
        self.expected, self.begin, self.terminal = expected, time.monotonic(), sys.stderr.isatty()

    def __enter__(self):
        return self

    def before(self, number, name):
        """Says that run number (from 0) begins."""
        done, whole = sum(self.expected[:number]), sum(self.expected)
        spent = time.monotonic() - self.begin
        left = whole - done if done < 5.0 else spent * (whole - done) / done
        bar = f"[{'#' * int(20 * done / whole):<20}] " if self.terminal else ""
        text = f"{bar}{number + 1}/{len(self.expected)}, about {format_seconds(left)} left: {name}"
        print(f"\r\x1b[K{text}" if self.terminal else text, end="" if self.terminal else "\n", file=sys.stderr, flush=True)

    def __exit__(self, kind, *_):
        if self.terminal:
            print("\r\x1b[K", end="", file=sys.stderr)
        if kind is None:
            print(f"{len(self.expected)} runs in {format_seconds(time.monotonic() - self.begin)}", file=sys.stderr, flush=True)
