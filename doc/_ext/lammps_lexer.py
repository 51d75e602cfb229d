# SPDX-License-Identifier: GPL-2.0-only
"""Colors of LAMMPS input, and the language of blocks that name none."""

import re

from docutils import nodes
from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import Comment, Keyword, Name, Number, Operator, String, Text, Whitespace
from sphinx.transforms import SphinxTransform

COMMANDS = (
    "angle_coeff", "angle_style", "atom_modify", "atom_style", "balance", "bond_coeff", "bond_style", "boundary", "box", "change_box", "clear",
    "comm_modify", "comm_style", "compute", "compute_modify", "create_atoms", "create_bonds", "create_box", "delete_atoms", "delete_bonds",
    "dimension", "displace_atoms", "dump", "dump_modify", "echo", "fix", "fix_modify", "group", "if", "include", "info", "jump", "kim", "label",
    "lattice", "log", "mass", "minimize", "min_modify", "min_style", "molecule", "neigh_modify", "neighbor", "newton", "next", "package",
    "pair_coeff", "pair_modify", "pair_style", "pair_write", "partition", "plugin", "print", "processors", "python", "quit", "read_data",
    "read_dump", "read_restart", "region", "replicate", "rerun", "reset_atoms", "reset_timestep", "restart", "run", "run_style", "set", "shell",
    "special_bonds", "suffix", "thermo", "thermo_modify", "thermo_style", "timer", "timestep", "uncompute", "undump", "unfix", "units", "variable",
    "velocity", "write_coeff", "write_data", "write_dump", "write_restart", "evp_choices", "evp_quietly", "read_evp_row", "write_evp_bonds")
_SHELL = re.compile(r"(\w+=\S* )*(\S*\blmp|mpirun|cmake|ctest|ninja|python3|evp|export|source|echo|cd|git|sudo|apt-get|conda|spack|pip|tar|"
                    r"(build|tools|packaging|doc/studies|tests/maintain)/\S+)( |$)")


class LammpsLexer(RegexLexer):
    """Input scripts: the first word of a line is the command; a word with a slash is a style or a file."""

    name = "LAMMPS input"
    aliases = ["lammps", "LAMMPS"]
    filenames = ["in.*", "*.lmp"]
    tokens = {
        "root": [
            (r"[ \t]+", Whitespace),
            (r"\n", Whitespace),
            (r"#.*", Comment.Single),
            (words(COMMANDS, suffix=r"(?![\w/])"), Keyword, "line"),
            (r"[\w/.]+", Name, "line"),
            (r"", Text, "line"),
        ],
        "line": [
            (r"[ \t]+", Whitespace),
            (r"(&)([ \t]*\n)", bygroups(Operator, Whitespace)),
            (r"\n", Whitespace, "#pop"),
            (r"#.*", Comment.Single),
            (r'""".*?"""|"[^"\n]*"|\'[^\'\n]*\'', String),
            (r"\$\{[^}\n]*\}|\$\([^\n]*?\)|\$\w|\b[vcf]_\w+", Name.Variable),
            (r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?(?![\w./])", Number),
            (r"[A-Za-z][\w-]*(/[A-Za-z][\w-]*)+(?![\w./])", Name.Class),
            (r"[\w./:-]+", Text),
            (r".", Text),
        ],
    }


def language_of(text):
    """'bash', 'LAMMPS' or 'text' by the first words of the lines; a line that goes on is one with those that follow."""
    lines = [line for line in re.sub(r"[&\\]\s*\n", " ", text).splitlines() if line.strip() and not line.lstrip().startswith("#")]
    shell = sum(bool(_SHELL.match(line.strip())) for line in lines)
    commands = sum(line.split()[0] in COMMANDS for line in lines)
    if lines and max(shell, commands) * 2 > len(lines):
        return "bash" if shell >= commands else "LAMMPS"
    return "text"


class LanguageOfBlocks(SphinxTransform):
    """Before Sphinx gives such blocks the default language; MyST has called theirs 'none' already."""

    default_priority = 390

    def apply(self, **_):
        for block in self.document.findall(nodes.literal_block):
            if block.get("language", "none") in ("default", "none") and block.rawsource == block.astext():
                block["language"] = language_of(block.astext())


def setup(app):
    app.add_lexer("LAMMPS", LammpsLexer)
    app.add_lexer("lammps", LammpsLexer)
    app.add_transform(LanguageOfBlocks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
