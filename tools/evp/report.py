# SPDX-License-Identifier: GPL-2.0-only
"""What the tools share: their command line, their errors, tables and CSV files."""

import argparse
import contextlib
import csv
import math
import os
import pathlib
import re
import shutil
import signal
import sys
import tempfile

from .run import RunError


def typed(program):
    """The name of a tool as the user typed it: curves.py, or evp curves."""
    return "evp " + program[:-len(".py")] if os.environ.get("EVP_COMMAND") and program.endswith(".py") else program


def command_line(text):
    """The parser of a tool, its help as it was written, but for the name that the user typed."""
    program = os.path.basename(sys.argv[0])
    name = typed(program)
    if name != program:
        text = re.sub(r"(?<![\w/])(tools/)?" + re.escape(program), name, text)
    return argparse.ArgumentParser(prog=name, description=text, formatter_class=argparse.RawDescriptionHelpFormatter)


def words_of(error):
    """An error as a sentence: of a file that cannot be opened, its name and why."""
    if isinstance(error, FileNotFoundError) and error.filename:
        return f"there is no file {error.filename}"
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"cannot use {error.filename}: {error.strerror}"
    return str(error)


def note(text):
    """Says what a user should know of the input."""
    print(f"NOTE: {text}", flush=True)


@contextlib.contextmanager
def errors_in_one_line(tool, interrupted=""):
    """Ends the program with one message where a run failed, a file or its content cannot be used, or the user stops it."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    except (RunError, OSError, ValueError) as error:
        sys.exit(f"{typed(tool)}: error: {words_of(error)}")
    except KeyboardInterrupt:
        print(f"{typed(tool)}: interrupted{interrupted}", file=sys.stderr)
        sys.exit(130)
    finally:
        signal.signal(signal.SIGTERM, before)


def positive(word):
    """Type of an option: a finite number above 0."""
    value = float(word)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"give a positive number, got {word}")
    return value


def whole(least, most=math.inf):
    """Type of an option: a whole number from least to most."""
    limits = f"from {least} to {most}" if most < math.inf else f"of {least} or more"

    def number(word):
        value = int(word)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"give a whole number {limits}, got {word}")
        return value

    number.__name__ = "whole number"  # in the message of argparse
    return number


def target_file(word):
    """Type of an option: the path of a file that can be written."""
    path = pathlib.Path(word)
    folder = path.absolute().parent
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{path} is a folder: give the name of a file in it")
    if not os.access(folder, os.W_OK):
        why = "no file can be written in this folder" if folder.is_dir() else f"there is no folder {folder}"
        raise argparse.ArgumentTypeError(f"{path}: {why}")
    return path


def print_table(titles, rows, digits=5):
    """Lines with columns as wide as they must be, the first to the left; numbers that are nan as '-'."""
    texts = [[value if isinstance(value, str) else "-" if value != value else f"{value:.{digits}g}" for value in line] for line in (titles, *rows)]
    widths = [max(map(len, column)) for column in zip(*texts)]
    for first, *others in texts:
        print(first.ljust(widths[0]), *(text.rjust(width) for text, width in zip(others, widths[1:])), sep="  ")


def write_csv(path, header, rows):
    """A CSV file; rows: sequences, or dicts by the header, whose missing values stay empty."""
    with open(path, "w", newline="", encoding="utf-8") as target:
        writer = csv.writer(target, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([row.get(name, "") for name in header] if isinstance(row, dict) else row for row in rows)


@contextlib.contextmanager
def all_or_nothing(folder):
    """A folder of its own in `folder`, whose files move there at the end, with the permissions of those that they replace: none where something failed."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".evp_", dir=folder) as place:
        place = pathlib.Path(place)
        yield place
        for path in sorted(place.iterdir(), key=lambda path: path.suffix != ".vtu"):  # a .pvd after its .vtu
            if (folder / path.name).exists():
                shutil.copymode(folder / path.name, path)
            os.replace(path, folder / path.name)
