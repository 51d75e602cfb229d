# SPDX-License-Identifier: GPL-2.0-only
"""Tools called in the process of the tests: a start takes a second, and test_interpreter.py starts each by its name."""

import contextlib
import io
from subprocess import CompletedProcess


def call(main, *words):
    """What a process with this main() would leave."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main([str(word) for word in words])
        except SystemExit as stop:
            code = stop.code
    if isinstance(code, str):
        code = err.write(code + "\n") and 1
    return CompletedProcess(words, code or 0, out.getvalue(), err.getvalue())
