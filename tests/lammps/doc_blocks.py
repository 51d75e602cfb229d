# SPDX-License-Identifier: GPL-2.0-only
"""The blocks of commands of a page, and how one is run from the root of a checkout."""

import os
import re
import subprocess
from typing import NamedTuple

import lammps_run
from lammps_run import LMP, MPIRUN, REPOSITORY

SECONDS = 120  # far above what a block takes: only a hang gets there
BLOCK = re.compile(r"^(?:\.\. (?:parsed-literal|code-block|code)::[^\n]*\n(?:   :[^\n]*\n)*|(?!\.\. )[^\n]*::\n)\n((?:   [^\n]*\n|\n)+)", re.M)


class Block(NamedTuple):
    page: str  # path from the root
    text: str  # without its indent

    def commands(self):
        """One per line; a line that ends in a backslash goes on."""
        lines = self.text.replace("\\\n", " ").splitlines()
        return [line.strip() for line in lines if line.strip() and not line.startswith("#")]


def read(page):
    return (REPOSITORY / page).read_text(encoding="utf-8")


def blocks(page):
    """All indented or fenced blocks of a page, in its order."""
    text = read(page)
    if page.endswith(".rst"):
        found = [one[1].rstrip().splitlines() for one in BLOCK.finditer(text)]
        return [Block(page, "\n".join(line[3:] for line in lines) + "\n") for lines in found]
    fences = [one[1] for one in re.finditer(r"^```[^\n]*\n(.*?)^```", text, re.M | re.S)]
    indented = ["".join(line[4:] + "\n" for line in one.splitlines()) for one in re.findall(r"(?:^    .*\n)+", text, re.M)]
    return [Block(page, one) for one in (*indented, *fences)]


def shorter(command, choices):
    """The command with the -var of its deck in `choices` before its own: LAMMPS takes the first of two."""
    deck = re.search(r"in\.\w+", command)
    extra = choices.get(deck[0], "") if deck else ""
    return command.replace(deck[0], f"{deck[0]} {extra}", 1) if extra else command


def prepare(folder):
    """Links to what the commands name, as from the root of the checkout."""
    (folder / "build").mkdir()
    for name in ("lammps_inputs", "potentials", "tests", "tools"):
        (folder / name).symlink_to(REPOSITORY / name)
    (folder / "build" / "lmp").symlink_to(LMP)


def run(commands, folder):
    """What the commands printed, one after the other; an assertion error with its end where one failed."""
    head = ["set -e", f'mpirun() {{ command {" ".join(MPIRUN)} "$@"; }}']
    environment = {**os.environ, **lammps_run._ENVIRONMENT, "EVP_LMP": str(LMP), "PATH": f"{LMP.parent}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", "\n".join([*head, *commands])], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", timeout=SECONDS, check=False)
    assert done.returncode == 0, "\n".join(commands) + "\n" + done.stdout[-2500:]
    return done.stdout
