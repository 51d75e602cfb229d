#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Writes the doctor's answers on its page: a shell without LAMMPS_PLUGIN_PATH, before and after the command that mends it.

Runs tools/doctor.py with the LAMMPS that build/lmp starts. Paths are shown as from a checkout in ~/evp.
"""

import os
import pathlib
import re
import subprocess
import sys
import textwrap

from study import CHECKOUT, command_line, errors_in_one_line, write_between

PAGE = CHECKOUT / "doc" / "install.rst"
LEFT_OUT = ("EVP_LMP", "EVP_COMMAND", "EVP_PLUGINS", "EVP_BUILD", "LAMMPS_PLUGIN_PATH")


def answer(first):
    """What the doctor prints in a shell where this command ran before."""
    found = re.search(r"^LAMMPS_BUILD_DIR:\w+=(.+)$", (CHECKOUT / "build" / "CMakeCache.txt").read_text(encoding="utf-8"), re.M)
    environment = {name: value for name, value in os.environ.items() if name not in LEFT_OUT}
    words = f"export PATH={found[1]}:$PATH && {first} && exec {sys.executable} {CHECKOUT / 'tools' / 'doctor.py'}"
    text = subprocess.run(["bash", "-c", words], env=environment, stdout=subprocess.PIPE, text=True, check=False).stdout
    return text.replace(str(CHECKOUT), "~/evp").replace(str(pathlib.Path.home()), "~")


def main(argv=None):
    command_line(__doc__).parse_args(argv)
    with errors_in_one_line("doctor_page.py"):
        fault = answer("true")
        command = re.search(r"^Run:   (.+)$", fault, re.M)
        if not command:
            raise ValueError(f"the doctor names no fault:\n{fault}")
        for name, text in (("fault", fault), ("healthy", answer(command[1].replace("~/evp", str(CHECKOUT))))):
            start, end = f".. {name}: written by doc/studies/doctor_page.py\n", f".. end of {name}\n"
            write_between(PAGE, start, end, f"\n.. code-block:: text\n\n{textwrap.indent(text, '   ')}\n")
    print(f"updated {PAGE}")


if __name__ == "__main__":
    main()
