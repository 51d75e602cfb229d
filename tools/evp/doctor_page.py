# SPDX-License-Identifier: GPL-2.0-only
"""Writes the doctor's answers on its page: a shell without LAMMPS_PLUGIN_PATH, before and after the command that mends it.

    PYTHONPATH=tools python3 -m evp.doctor_page

Runs tools/doctor.py with the LAMMPS that build/lmp starts. Paths are shown as from a checkout in ~/evp.
"""

import os
import pathlib
import re
import subprocess
import sys
import textwrap

from .doctor_remedies import cache_entry, in_front
from .report import command_line, errors_in_one_line, split_at_marks
from .run import CHECKOUT

PAGE = CHECKOUT / "doc" / "Howto_evp_doctor.rst"
_LEFT_OUT = ("EVP_LMP", "EVP_COMMAND", "EVP_PLUGINS", "EVP_BUILD", "LAMMPS_PLUGIN_PATH")


def marks(name):
    return f".. {name}: written by evp.doctor_page\n", f".. end of {name}\n"


def answer(first):
    """What the doctor prints in a shell where this command ran before."""
    build = cache_entry(CHECKOUT / "build", "LAMMPS_BUILD_DIR")
    if not build:
        raise ValueError(f"no build in {CHECKOUT / 'build'}: run tools/setup.sh first")
    environment = {name: value for name, value in os.environ.items() if name not in _LEFT_OUT}
    words = f"{in_front('PATH', build)} && {first} && exec {sys.executable} {CHECKOUT / 'tools' / 'doctor.py'}"
    text = subprocess.run(["bash", "-c", words], env=environment, stdout=subprocess.PIPE, text=True, check=False).stdout
    return text.replace(str(CHECKOUT), "~/evp").replace(str(pathlib.Path.home()), "~")


def main(argv=None):
    """Rewrites the two blocks of the page."""
    command_line(__doc__).parse_args(argv)
    with errors_in_one_line("evp.doctor_page"):
        fault = answer("true")
        command = re.search(r"^Run:   (.+)$", fault, re.M)
        if not command:
            raise ValueError(f"the doctor names no fault:\n{fault}")
        healthy = answer(command[1].replace("~/evp", str(CHECKOUT)))
        for name, text in (("fault", fault), ("healthy", healthy)):
            head, _, tail = split_at_marks(PAGE, *marks(name))
            start, end = marks(name)
            block = ".. code-block:: text\n\n" + textwrap.indent(text, "   ")
            PAGE.write_text(f"{head}{start}\n{block}\n{end}{tail}", encoding="utf-8")
    print(f"updated {PAGE}")


if __name__ == "__main__":
    main()
