# SPDX-License-Identifier: GPL-2.0-only
"""The command evp: the tools by their names, LAMMPS with the plugin loaded, and where the files are.

Run as build/evp, as PREFIX/bin/evp after an installation, or as `PYTHONPATH=tools python3 -m evp`. It needs the standard library
only: the modules are looked for by the tool that is started.
"""

import ast
import os
import pathlib
import re
import signal
import sys

TOOLS = pathlib.Path(__file__).resolve().parents[1]
ROOT = TOOLS.parent
# Those that are installed, in one line: CMake reads it.
FOR_USERS = "body calibrate curves doctor view".split()
FOLDERS = {
    "": ("all of these", ROOT),
    "decks": ("the input scripts", ROOT / "lammps_inputs"),
    "potentials": ("the potential files", ROOT / "potentials"),
    "tools": ("the tools", TOOLS),
    "doc": ("the pages of the manual", ROOT / "doc"),
    "plugin": ("evpplugin.so, for LAMMPS_PLUGIN_PATH", pathlib.Path(os.environ.get("EVP_PLUGINS") or ROOT / "build")),
}
USAGE = """usage: evp NAME [ARGUMENTS]     run a tool; evp NAME --help explains it
       evp lmp [ARGUMENTS]      run LAMMPS with the plugin loaded: mpirun -np 2 evp lmp -in FILE
       evp path [FOLDER]        print where a folder is
       evp --version | --help
"""


def version():
    """Of the package; from its text, since importing the package asks for numpy."""
    return re.search(r'^__version__ = "(.+?)"', (TOOLS / "evp" / "__init__.py").read_text(encoding="utf-8"), re.M)[1]


def tools():
    """{name: path} of the tools that are there."""
    return {path.stem: path for path in sorted(TOOLS.glob("*.py"))}


def summary(path):
    """First line of a program's help."""
    return (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n")[0]


def table(rows):
    """Lines of (name, text)."""
    return "".join(f"  {name:<18}{text}\n" for name, text in rows)


def usage():
    """The whole help."""
    there = tools()
    text = USAGE + "\nTools:\n" + table((name, summary(there[name])) for name in FOR_USERS if name in there)
    others = [name for name in there if name not in FOR_USERS]
    if others:
        text += "\nTools of the source tree, which write the pages of doc/ and check the sources:\n"
        text += table((name, summary(there[name])) for name in others)
    return text + "\nFolders of evp path:\n" + table((name or "(none)", text) for name, (text, _) in FOLDERS.items())


def refuse(text):
    """Ends the program as a wrong command line does."""
    print(f"evp: error: {text}; see evp --help", file=sys.stderr)
    return 2


def path(words):
    """evp path [FOLDER]."""
    name = words[0] if words else ""
    if len(words) > 1 or name not in FOLDERS:
        return refuse(f"path takes one of {', '.join(filter(None, FOLDERS))}, or nothing, but got '{' '.join(words)}'")
    print(FOLDERS[name][1].resolve())
    return 0


def lmp(words):
    """evp lmp: only where evp was started as a module; the script that CMake writes does it without Python."""
    program = os.environ.get("EVP_LMP") or str(ROOT / "build" / "lmp")
    try:
        return os.execvp(program, [program, *words])
    except OSError as error:
        return refuse(f"cannot start {program}: {error.strerror}; build the plugin, or set EVP_LMP")


def main(words):
    """Exit code; a tool takes the place of this process."""
    name, rest = (words[0], words[1:]) if words else ("--help", [])
    if name in ("-h", "--help", "help"):
        print(usage(), end="")
        return 0
    if name in ("-V", "--version"):
        print(f"EVP {version()}")
        return 0
    if name in ("path", "lmp"):
        return path(rest) if name == "path" else lmp(rest)
    tool = tools().get(name)
    if tool is None:
        others = "" if (ROOT / "CMakeLists.txt").exists() else " (those that write the pages of doc/ are in the source tree only)"
        return refuse(f"no tool '{name}'; the tools here are {', '.join(tools())}{others}")
    os.environ["EVP_COMMAND"] = "evp"
    sys.stdout.flush()
    return os.execv(sys.executable, [sys.executable, str(tool), *rest])


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # of `| head`
    sys.exit(main(sys.argv[1:]))
