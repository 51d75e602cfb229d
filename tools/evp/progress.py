# SPDX-License-Identifier: GPL-2.0-only
"""Progress on stderr, with the time left, of runs side by side or one after the other."""

import sys
import time

INTERVAL = 5.0  # [s] between two lines where the output is no terminal and runs are long
KNOWN = 0.05  # share done from which the time left is told: before, it is off by a factor of ten


def format_seconds(seconds):
    """'8 s' or '2 min 05 s'."""
    whole = int(round(seconds))
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s"


class Progress:
    """One line: rewritten on a terminal, elsewhere a new one, at intervals [s]. whole: what all runs cost, in any unit."""

    def __init__(self, title, whole, interval=0.0):
        self.title, self.whole, self.terminal = title, whole, sys.stderr.isatty()
        self.begin = self.shown = time.monotonic()
        self.interval = min(interval, 0.3) if self.terminal else interval

    def __enter__(self):
        return self

    def show(self, done, name):
        """Says that so much of the whole is done, and what runs now."""
        now = time.monotonic()
        if now - self.shown < self.interval:
            return
        self.shown, share, spent = now, done / self.whole, now - self.begin
        left = f"about {format_seconds(spent * (1 - share) / share)} left" if share >= KNOWN else f"{format_seconds(spent)} so far"
        text = f"{self.title} {100 * share:3.0f} %, {left}: {name}"
        print(f"\r\x1b[K{text}" if self.terminal else text, end="" if self.terminal else "\n", file=sys.stderr, flush=True)

    def __exit__(self, kind, *_):
        if self.terminal:
            print("\r\x1b[K", end="", file=sys.stderr)
        if kind is None:
            print(f"{self.title} done in {format_seconds(time.monotonic() - self.begin)}", file=sys.stderr, flush=True)


def watched(title, items, name=str, cost=lambda item: 1.0, interval=0.0):
    """Gives the items one after the other, and shows progress before each."""
    costs = [cost(item) for item in items]
    with Progress(title, sum(costs), interval) as progress:
        for number, item in enumerate(items):
            progress.show(sum(costs[:number]), name(item))
            yield item
