# SPDX-License-Identifier: GPL-2.0-only
"""A small scene with named parts for hostile cases to replace, and what a refusal has to look like."""

ROW = "80 8 4 3 8 4 0.005 0 1.5"

# 3 x 2 x 2 spheres, 1 % apart
PARTS = {
    "units": "units si",
    "atoms": "atom_style sphere",
    "map": "atom_modify map yes",
    "box": """boundary f f f
lattice sc 0.0101
region box block 0 3 0 2 0 2
create_box 1 box
create_atoms 1 box
set group all diameter 0.01
set group all density 2700""",
    "neighbor": "neighbor 0.001 bin",
    "style": "pair_style evp/lj contact literal",
    "coeff": f"pair_coeff * * {ROW}",
    "fix": "fix bonds all evp/bonds",
    "move": "fix move all nve",
    "step": "timestep 1e-7",
    "then": "",
    "thermo": "thermo_style custom step pe press f_bonds f_bonds[1]",
    "run": "run 3",
    "after": "",
}
PLANE = """dimension 2
boundary p p p
lattice sq 0.0102
region box block 0 4 0 3 -0.5 0.5
create_box 1 box
create_atoms 1 box
set group all diameter 0.01
set group all density 2700"""
BONDS = 42  # 20 edges and 22 diagonals of faces, 1.01 and 1.43 diameters long; those of the cubes, 1.75, are beyond alpha


def scene(**parts):
    """The deck with some parts replaced."""
    unknown = set(parts) - set(PARTS)
    assert not unknown, f"the scene has no part {unknown}"
    return "\n".join({**PARTS, **parts}.values()) + "\n"


def refused(run, *texts, stepped=False):
    """One clear error: exit code 1 (a signal would give another), the texts, and no step unless the run is to be under way."""
    assert run.returncode == 1, f"exit {run.returncode}\n{run.stdout[-3000:]}"
    said = " ".join(run.stdout.split())
    assert "ERROR" in said, run.stdout
    for text in texts:
        assert text in said, f"lacks: {text}\n{run.stdout[-3000:]}"
    assert stepped or run.made_no_step(), run.stdout
