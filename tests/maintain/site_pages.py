# SPDX-License-Identifier: GPL-2.0-only
"""The pages of the site: those of doc/, those that stay in other folders, and the tools' own help."""

import contextlib
import io
import os
import pathlib
import re
import runpy
import subprocess
import sys

# Pages that stay where a reader of the repository looks for them: path, name on the site.
ELSEWHERE = {"README.md": "readme", "lammps_inputs/README.md": "decks", "CHANGELOG.md": "changelog", "CONTRIBUTING.md": "contributing"}
_SUFFIXES = (".rst", ".md")


def pages(root):
    """Name on the site of each page, by its path in the repository; the names of files in doc/ are without their ending."""
    own = sorted(path for path in (root / "doc").iterdir() if path.suffix in _SUFFIXES)
    return {**{path.relative_to(root).as_posix(): path.stem for path in own},
            **{path: name for path, name in ELSEWHERE.items() if (root / path).exists()}}


def put_together(root, folder):
    """Writes all pages into a folder, files that have not changed excepted; returns {file there: path in the repository}."""
    folder.mkdir(parents=True, exist_ok=True)
    sources = {folder / (name + pathlib.Path(path).suffix): path for path, name in pages(root).items()}
    texts = {folder / "tools.rst": help_page(root), **{file: (root / path).read_text(encoding="utf-8") for file, path in sources.items()}}
    for file in folder.iterdir():
        if file not in texts:
            file.unlink()
    for file, text in texts.items():
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
    return sources


def help_page(root):
    """The page with what each tool says to --help, and its commands to theirs."""
    tools = sorted(path for path in (root / "tools").iterdir() if path.suffix == ".py" or
                   path.suffix == ".sh" and "-h|--help)" in path.read_text(encoding="utf-8"))  # quickstart.sh hands it on, after its set-up
    lines = ["Tools", "=====", "", "What each tool says to ``--help``.  Paths are those of the checkout, from its root; after an installation",
             "``evp NAME`` runs ``tools/NAME.py``.", ""]
    lines += ["evp", "---", "", *_literal(_run([sys.executable, "-m", "evp", "--help"], PYTHONPATH=str(root / "tools")))]
    for tool in tools:
        name = f"tools/{tool.name}"
        lines += [name, "-" * len(name), "", *_literal(help_of(tool, []))]
        has_commands = tool.suffix == ".py" and "add_subparsers" in tool.read_text(encoding="utf-8")
        for command in re.search(r"\{([\w,-]+)\}", help_of(tool, []))[1].split(",") if has_commands else []:
            title = f"{name} {command}"
            lines += [title, '"' * len(title), "", *_literal(help_of(tool, [command]))]
    return "\n".join(lines) + "\n"


def _literal(text):
    return [".. code-block:: text", "", *(f"   {line}".rstrip() for line in text.splitlines()), ""]


def _run(words, **environment):
    return subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True, env={**os.environ, **environment}).stdout


def help_of(tool, words):
    """Standard output of the tool's help, of a fixed width; Python tools run here, as a start of each takes a second."""
    if tool.suffix != ".py":
        return _run([str(tool), *words, "--help"])
    out, arguments, path, environment = io.StringIO(), sys.argv, list(sys.path), dict(os.environ)
    try:
        sys.argv = [str(tool), *words, "--help"]
        os.environ["COLUMNS"] = "110"
        os.environ.pop("EVP_COMMAND", None)  # by which a tool calls itself as it was called
        with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
            runpy.run_path(str(tool), run_name="__main__")
    finally:
        sys.argv, sys.path[:] = arguments, path
        os.environ.clear()
        os.environ.update(environment)
    if not out.getvalue().startswith("usage: "):
        raise RuntimeError(f"{tool} {' '.join(words)} --help prints no usage")
    return out.getvalue().replace(f"{tool.parents[1]}/", "")
