# SPDX-License-Identifier: GPL-2.0-only
"""What the studies share: their command line, runs that are kept, and pages from templates.

Imported first: it makes the package evp of tools/ importable, and goes on in a Python that has numpy.
"""

import contextlib
import hashlib
import os
import pathlib
import re
import resource
import shutil
import statistics
import string
import subprocess
import sys
import tempfile

STUDIES = pathlib.Path(__file__).resolve().parent
sys.path.insert(1, str(STUDIES.parents[1] / "tools"))

from evp import curves, figures, spheres  # noqa: E402
import numpy as np  # noqa: E402
from evp.report import command_line, errors_in_one_line, write_csv  # noqa: E402, F401
from evp.run import CHECKOUT, DECKS, RunError, deck_command, ended, environment, lammps_command, watched  # noqa: E402, F401


def output_of(command, folder, what):
    """What a command printed; RunError with the end of it where it failed."""
    run = ended(command, folder)
    if run.returncode:
        raise RunError(f"{what} failed (exit {run.returncode}); its output ends with\n{run.stdout[-1500:]}")
    return run.stdout


def table(header, rows):
    """Lines of a Markdown table."""
    lines = ["| " + " | ".join(map(str, cells)) + " |" for cells in (header, *rows)]
    return [lines[0], "|" + "---|" * len(header), *lines[1:]]


def list_table(rows):
    """Text of a table of reStructuredText, of rows of cells, the first of them the header."""
    cells = ["".join(f"   {'*' if k == 0 else ' '} - {cell}\n" for k, cell in enumerate(row)) for row in rows]
    return "\n.. list-table::\n   :header-rows: 1\n\n" + "".join(cells) + "\n"


def check_drawing():
    """RunError where this LAMMPS draws no spheres: before runs whose pictures are wanted."""
    view = spheres.cameras([spheres.extents(np.zeros((1, 3)), np.ones(1), *spheres.VIEWS["iso"])], [spheres.VIEWS["iso"]], 100)
    spheres.draw(np.zeros((1, 3)), np.ones(1), np.zeros(1), np.full((spheres.SHADES, 3), 0.5), view)


def spread(values, form="{:.2f}".format):
    """'median (smallest to largest)', the median alone of one value."""
    values = list(values)
    return form(statistics.median(values)) + (f" ({form(min(values))} to {form(max(values))})" if len(values) > 1 else "")


def mean_of(values, form):
    """'mean +- largest departure of one', the mean alone of one value."""
    mean = statistics.mean(values)
    return f"{mean:{form}}" + (f" +- {max(abs(value - mean) for value in values):{form}}" if len(values) > 1 else "")


def ratios(own, other):
    """own over other, round by round."""
    return [a / b for a, b in zip(own, other)]


def split_at_marks(path, start, end):
    """Texts before, between and after two marks of a file; ValueError unless each is there once."""
    text = path.read_text(encoding="utf-8")
    if text.count(start) != 1 or text.count(end) != 1:
        raise ValueError(f"{path} must hold '{start}' and '{end}' once each")
    head, rest = text.split(start)
    return head, *rest.split(end)


def section_marks(name, program):
    """The marks around a section of a page that a program writes."""
    return f"<!-- {name}: {program} -->\n", f"<!-- end of {name} -->"


def write_between(path, start, end, text):
    """Replaces what stands between two marks of a file."""
    head, _, tail = split_at_marks(path, start, end)
    path.write_text("".join((head, start, text, end, tail)), encoding="utf-8")


def run_blocks(blocks, folder, home=None):
    """(printed text, processor time [s]) of each of the blocks of commands, in one shell that starts in a folder. RunError with the end of the output where one failed."""
    end = "---- end of a block ----"
    with tempfile.TemporaryDirectory(prefix="evp_blocks_") as name:
        times, errors = pathlib.Path(name) / "times", pathlib.Path(name) / "errors"
        script = "".join(f"{block}\necho '{end}'\ntimes >> {times}\n" for block in blocks)
        with open(errors, "w", encoding="utf-8") as target:
            done = subprocess.run(["bash", "-c", "set -eu\n" + script], cwd=folder, env={**os.environ, **environment(), "HOME": str(home or pathlib.Path.home())}, check=False,
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=target, encoding="utf-8", errors="replace")
        if done.returncode:
            raise RunError(f"a command failed (exit {done.returncode}); it ends with\n{done.stdout[-1500:]}{errors.read_text(encoding='utf-8')[-1500:]}")
        spent = [sum(60 * float(minutes) + float(seconds) for minutes, seconds in re.findall(r"(\d+)m([\d.]+)s", line))
                 for line in times.read_text(encoding="utf-8").splitlines()[1::2]]  # the first line of two is the shell's own
    return [(text, after - before) for text, before, after in zip(done.stdout.split(end + "\n"), [0.0, *spent], spent)]


def store_picture(path, folder, colors=256):
    """Copies a picture; a PNG gets so few colors that it is half as large."""
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".png":
        with Image.open(path) as image:
            image.convert("RGB").quantize(colors, dither=Image.Dither.NONE).save(folder / path.name, optimize=True)
    else:
        shutil.copyfile(path, folder / path.name)


class Runs:
    """Runs of decks in a folder: one of the same choices that is there is not made again."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder).resolve()
        self.folder.mkdir(parents=True, exist_ok=True)

    def keep(self, name, words):
        """What a command printed, from NAME.log where that is of the same command."""
        log, mark = self.folder / f"{name}.log", hashlib.sha256(repr(words).encode()).hexdigest()
        if not log.exists() or not log.read_text(encoding="utf-8").startswith(mark):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            text = output_of(list(map(str, words)), self.folder, name)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            log.write_text(f"{mark} {sum(after[:2]) - sum(before[:2]):.3f}\n{text}", encoding="utf-8")  # user and system time
        return log.read_text(encoding="utf-8").partition("\n")[2]

    def seconds(self, name):
        """Processor time that a kept run took [s]."""
        return float((self.folder / f"{name}.log").read_text(encoding="utf-8").partition("\n")[0].split()[1])

    def run(self, deck, out, ranks=1, **choices):
        """What a run of a deck with -var out OUT printed."""
        return self.keep(out, deck_command(DECKS / deck, {**choices, "out": out}, ranks))

    def body(self, name, **choices):
        """The data file of a body by in.specimen."""
        self.run("in.specimen", f"{name}.data", **choices)
        return f"{name}.data"

    def curve(self, name, *columns):
        """{column: array} of NAME.csv."""
        return curves.read_columns(self.folder / f"{name}.csv", columns)


class Study:
    """A program that writes doc/NAME.md from the template doc/studies/NAME.md; with a page, the section of that name of doc/PAGE.md.

    choices: options of the command line with their defaults, which give their types. After parse() or started() they are attributes, as are runs and out."""

    def __init__(self, text, name, page=None, **choices):
        self.name, self.choices, self.parser = name, choices, command_line(text)
        self.marks = section_marks(name, f"doc/studies/{name}.py") if page else None
        for option, default in choices.items():
            first = default[0] if isinstance(default, (list, tuple)) else default
            self.parser.add_argument(f"--{option}", type=type(first), default=default, nargs="+" if isinstance(default, (list, tuple)) else None,
                                     help=f"default {' '.join(map(str, default)) if isinstance(default, (list, tuple)) else default}")
        self.parser.add_argument("--work", type=pathlib.Path, default=CHECKOUT / "build" / name, help="where runs are kept (default: %(default)s)")
        self.parser.add_argument("--fresh", action="store_true", help="forget the runs that are kept")
        self.parser.add_argument("--out", type=pathlib.Path, default=CHECKOUT / "doc" / f"{page or name}.md", help="page to write (default: %(default)s)")

    def parse(self, words=None):
        """Takes the command line."""
        chosen = self.parser.parse_args(words)
        vars(self).update(vars(chosen))
        if self.marks:
            split_at_marks(self.out, *self.marks)  # before the runs, not after them
        if chosen.fresh:
            shutil.rmtree(chosen.work, ignore_errors=True)
        self.runs = Runs(chosen.work)
        given = [f"--{name} {' '.join(map(str, value)) if isinstance(value, (list, tuple)) else value}"
                 for name, default in self.choices.items() for value in [getattr(chosen, name)] if value != default]
        self.command = " ".join([f"doc/studies/{self.name}.py", *given])
        return self

    @contextlib.contextmanager
    def started(self, words=None):
        """Takes the command line; an error of what follows is one line."""
        with errors_in_one_line(f"{self.name}.py"):
            yield self.parse(words)

    def each(self, items, name=str, cost=lambda item: 1.0):
        """The items one after the other, with the time left."""
        return watched(f"{self.name}.py:", items, name, cost)

    def write(self, **values):
        """The page, or its section: $NAME of the template stands for a value, a table as (header, rows) among them; $command for the command line. ValueError where one is missing."""
        text = {name: "\n".join(table(*value)) if isinstance(value, tuple) else value for name, value in values.items()}
        try:
            page = string.Template((STUDIES / f"{self.name}.md").read_text(encoding="utf-8")).substitute(text, command=self.command)
        except KeyError as error:
            raise ValueError(f"doc/studies/{self.name}.md has ${error.args[0]}, which {self.name}.py does not give") from error
        if self.marks:
            write_between(self.out, *self.marks, page)
        else:
            self.out.write_text(page, encoding="utf-8")
        print(page, end="")

    def draw(self, curves, header, **look):
        """Saves a picture of curves {label: (x, y)}; look: of its axis."""
        with figures.plt.rc_context(figures.LOOK):
            figure, axis = figures.plt.subplots(figsize=(7.2, 4.6))
            for k, (label, values) in enumerate(curves.items()):
                axis.plot(*values, label=label, **figures.line_style(k))
            axis.axhline(0, color="#333333", linewidth=0.8)
            axis.set(xlim=(0, None), **look)
            figures.legend_below(axis, 2, handlelength=3.0)
            return self.save(figure, header, [(label, f"{a:.6g}", f"{b:.6g}") for label, values in curves.items() for a, b in zip(*values)])

    def save(self, figure, header, rows, more=""):
        """Writes figures/NAME.png beside the page, with more behind NAME, and its CSV."""
        return figures.save(figure, self.out.parent / "figures" / f"{self.name}{more}.png", header, rows)


def tangent(curve, x, y):
    """dy/dx at the start of a curve of three rows, the second at half the way."""
    first, second = curve[y][1:3] / curve[x][1:3]
    return 2.0 * first - second
