# SPDX-License-Identifier: GPL-2.0-only
"""Files that are written whole or not at all."""

import os
import pathlib
import tempfile


def write_whole(path, text):
    """Replaces a file, which keeps its permissions, or makes it: in one move, the text being on disk. Where that fails, nothing has changed."""
    path = pathlib.Path(path)
    mode = path.stat().st_mode & 0o777 if path.exists() else 0o644
    handle, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as target:
            target.write(text)
            target.flush()
            os.fsync(target.fileno())
        os.chmod(aside, mode)
        os.replace(aside, path)
    except BaseException:
        os.unlink(aside)
        raise
