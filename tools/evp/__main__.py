# SPDX-License-Identifier: GPL-2.0-only
"""The command evp: the tools by their names, LAMMPS with the plugin loaded, and where the files are.

Run as build/evp, or as PREFIX/bin/evp after an installation; both are scripts that CMake writes, and do `evp lmp` themselves. It needs the
standard library only: the modules are looked for by the tool that is started.
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
FOR_USERS = "body calibrate cost curves doctor quickstart tool view".split()
FOLDERS = {
    "": ("all of these", ROOT),
    "decks": ("the input scripts", ROOT / "lammps_inputs"),
    "potentials": ("the potential files", ROOT / "potentials"),
    "tools": ("the tools", TOOLS),
    "doc": ("the pages of the manual", ROOT / "doc"),
    "plugin": ("evpplugin.so, for LAMMPS_PLUGIN_PATH", pathlib.Path(os.environ.get("EVP_PLUGINS") or ROOT / "build")),
}
SCRIPTS = ("setup.sh", "quickstart.sh", "test.sh")  # of the source tree
USAGE = """usage: evp NAME [ARGUMENTS]     run a tool; evp NAME --help explains it
       evp lmp [ARGUMENTS]      run LAMMPS with the plugin loaded: mpirun -np 2 evp lmp -in FILE
       evp path [FOLDER]        print where a folder is
       evp --version | --help
"""


def version():
    """Of the package; from its text, since importing the package asks for numpy."""
    return re.search(r'^__version__ = "(.+?)"', (TOOLS / "evp" / "__init__.py").read_text(encoding="utf-8"), re.M)[1]


def summary(path):
    """First sentence of a program's help; of a script or a deck, that of the comment at its head."""
    if path.suffix == ".py":
        return (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n")[0]
    text = path.read_text(encoding="utf-8").split("SPDX-License-Identifier: GPL-2.0-only\n")[-1]
    comment = " ".join(line.lstrip("# ") for line in re.match(r"(?:#\s*\n)*((?:# .*\n)*)", text)[1].splitlines())
    return re.split(r"(?<=[.:])\s|\s\(", comment)[0].rstrip(".:")


def usage():
    """The whole help."""
    pages = [page.read_text(encoding="utf-8") for page in sorted(FOLDERS["doc"][1].glob("*.rst"))]
    commands = [name for page in pages for name in re.findall(r"^(.*) command\n=+$", page, re.M)]
    tools, scripts = ([path for path in (TOOLS / name for name in names) if path.exists()] for names in ([f"{name}.py" for name in FOR_USERS], SCRIPTS))
    parts = {"Tools": [(path.stem, summary(path)) for path in tools],
             "Scripts in the folder tools": [(path.name, summary(path)) for path in scripts],
             "Folders of evp path": [(name or "(none)", text) for name, (text, _) in FOLDERS.items()],
             "Input scripts, in the folder decks": [(path.name, summary(path)) for path in sorted(FOLDERS["decks"][1].glob("in.*"))],
             "Commands for LAMMPS, described in the folder doc": [(name, "") for name in commands]}
    return USAGE + "".join(f"\n{title}:\n" + "".join(f"  {name:<18}{text}".rstrip() + "\n" for name, text in rows) for title, rows in parts.items() if rows)


def refuse(text):
    """Ends the program as a wrong command line does."""
    print(f"evp: error: {text}; see evp --help", file=sys.stderr)
    return 2


def main(words):
    """Exit code; a tool takes the place of this process."""
    name, rest = (words[0], words[1:]) if words else ("--help", [])
    if name in ("-h", "--help", "help"):
        print(usage(), end="")
        return 0
    if name in ("-V", "--version"):
        print(f"EVP {version()}")
        return 0
    if name == "path":
        folder = "".join(rest[:1])
        if len(rest) > 1 or folder not in FOLDERS:
            return refuse(f"path takes one of {', '.join(filter(None, FOLDERS))}, or nothing, but got '{' '.join(rest)}'")
        print(FOLDERS[folder][1].resolve())
        return 0
    if name not in FOR_USERS:
        return refuse(f"no tool '{name}'; the tools here are {', '.join(FOR_USERS)}")
    os.environ["EVP_COMMAND"] = "evp"
    return os.execv(sys.executable, [sys.executable, str(TOOLS / f"{name}.py"), *rest])


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # of `| head`
    sys.exit(main(sys.argv[1:]))
