# SPDX-License-Identifier: GPL-2.0-only
"""`plasticity isotropic` and `break` with every word wrong, bond files and restart files with histories that are damaged or go to a style that would
forget them: one clear error each, or a result that the pages promise."""

import pytest
from hostile import BONDS, PARTS, ROW, SECONDS, refused, scene

STYLE = "pair_style evp/lj contact repulsive "
FLOWS, BREAKS = STYLE + "plasticity isotropic", STYLE + "break 0.1"
NUMBER = "must be a finite decimal number, got"
PLASTICITY = "plasticity must be none"
BREAK = "break must be none or a positive strain of a bond, at which it breaks permanently"
NEEDS = "needs fix evp/bonds, which stores the history of the bonds"
STIFFER = "plasticity isotropic needs a second regime less stiff than the first"
FORGETS = "bonds have flowed or broken, which this pair_style would forget"

CASES = [
    ({"style": STYLE + "plasticity"}, "keyword plasticity needs a value"),
    ({"style": STYLE + "plasticity plastic"}, PLASTICITY),
    ({"style": STYLE + "plasticity ISOTROPIC"}, PLASTICITY),
    ({"style": STYLE + "plasticity 1"}, PLASTICITY),
    ({"style": STYLE + 'plasticity ""'}, PLASTICITY),
    ({"style": STYLE + "unload elastic"}, "plasticity isotropic"),
    ({"style": STYLE + "unload reversible"}, "plasticity"),
    ({"style": STYLE + "isotropic"}, "unknown keyword 'isotropic'"),
    ({"style": "pair_style evp/lj plasticity isotropic"}, "contact literal"),
    ({"style": FLOWS, "coeff": f"pair_coeff * * {ROW} saturation -0.1"}, "saturation must be"),
    ({"style": STYLE + "plasticity isotropic break"}, "keyword break needs a value"),
    ({"style": STYLE + "break 0"}, BREAK),
    ({"style": STYLE + "break -1"}, BREAK),
    ({"style": STYLE + "break -0.0"}, BREAK),
    ({"style": STYLE + "break nan"}, f"break {NUMBER} 'nan'"),
    ({"style": STYLE + "break inf"}, f"break {NUMBER} 'inf'"),
    ({"style": STYLE + "break 1e400"}, f"break {NUMBER} '1e400'"),
    ({"style": STYLE + "break yes"}, f"break {NUMBER} 'yes'"),
    ({"style": STYLE + "break None"}, f"break {NUMBER} 'None'"),
    ({"style": STYLE + "break 5%"}, f"break {NUMBER} '5%'"),
    ({"style": STYLE + "breaks 0.1"}, "unknown keyword 'breaks'"),
    ({"style": FLOWS, "fix": "", "thermo": ""}, "plasticity isotropic " + NEEDS),
    ({"style": BREAKS, "fix": "", "thermo": ""}, "break " + NEEDS),
    ({"style": FLOWS, "fix": "", "thermo": "", "run": "minimize 0 1e-9 10 10"}, "plasticity isotropic " + NEEDS),
    ({"style": FLOWS, "fix": "fix bonds all evp/bonds\nrun 0\nunfix bonds", "thermo": ""}, "plasticity isotropic " + NEEDS),
    ({"style": FLOWS, "coeff": "pair_coeff * * 80 8 4 80 8 4 0.005 0 1.5"}, STIFFER),
    ({"style": FLOWS, "after": "pair_coeff * * 80 8 4 200 8 4 0.005 0 1.5\nrun 1"}, STIFFER),
    ({"style": FLOWS, "then": "fix stiffer all adapt 1 pair evp/lj e2 * * v_stiff\nvariable stiff equal 3+100*step"}, STIFFER),
    ({"style": FLOWS, "step": "timestep 1e-7\nrun_style respa 2 2"}, "respa"),
    ({"style": BREAKS, "step": "timestep 1e-7\nrun_style respa 2 2"}, "respa"),
    ({"style": FLOWS, "fix": "fix even all balance 2 1.0 shift x 5 1.0\nfix bonds all evp/bonds"}, "must be defined before fix even balance"),
    ({"style": BREAKS, "fix": "fix even all balance 2 1.0 shift x 5 1.0\nfix bonds all evp/bonds"}, "must be defined before fix even balance"),
    ({"style": "pair_style hybrid/scaled 0.5 evp/lj contact repulsive plasticity isotropic", "coeff": "pair_coeff * * evp/lj " + ROW}, "does not work in pair_style hybrid/scaled"),
    ({"style": "pair_style hybrid/overlay evp/lj contact repulsive plasticity isotropic evp/lj break 0.1", "coeff": f"pair_coeff * * evp/lj 1 {ROW}\npair_coeff * * evp/lj 2 {ROW}"},
     "can be one sub-style of pair_style hybrid only"),
]


@pytest.mark.parametrize("parts, text", CASES, ids=[" ".join(text.split()[:5]) + f" {number}" for number, (_, text) in enumerate(CASES)])
def test_one_clear_error(lmp, parts, text):
    later = "after" in parts or "unfix" in parts.get("fix", "") or "adapt" in parts.get("then", "")
    refused(lmp(scene(**parts), seconds=SECONDS), text, stepped=later)


@pytest.mark.parametrize("style", [
    FLOWS, BREAKS, FLOWS + " break none", FLOWS + " break 1e-9", FLOWS + " break 1e9", STYLE + "plasticity isotropic plasticity none", STYLE + "break 0.1 break none",
    "pair_style evp/lj plasticity isotropic break 0.02 contact none", "pair_style evp/lj overlap 1 break 0.02 plasticity none contact repulsive"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_legal_words(lmp, style, ranks):
    """At rest nothing flows or breaks; words that come later count."""
    run = lmp(scene(style=style, thermo="thermo_style custom step pe press f_bonds f_bonds[1] f_bonds[5]"), ranks, seconds=SECONDS).ok()
    assert list(run.thermo()["f_bonds"]) == [BONDS] * 2 and list(run.thermo()["f_bonds[5]"]) == [0, 0]
    words = style.split()
    on = "isotropic" in words and words[words.index("isotropic") + 1 :].count("plasticity") == 0
    assert ("plasticity isotropic" in run.stdout.partition("evp/lj: damping")[2]) == on


# ---- bond files

HEADER = "# EVP bonds COUNT: {} UNITS: si\n"
FLOWED = "it has flowed: use pair_style evp/lj with 'plasticity isotropic', as when the file was written (bond file b.bonds)"
FORGOTTEN = "it has flowed or broken: use pair_style evp/lj with 'plasticity isotropic' or 'break', as when the file was written (bond file b.bonds)"
WHOLE = "1 2 0.0101 0 0 0 0"


def bonds(*lines):
    return HEADER.format(len(lines)) + "".join(f"{line}\n" for line in lines)


def line(number):
    return f"Fix bonds evp/bonds: bond file line {number}: "


FILES = {  # what the reader alone can see is in tests/unit/test_bond_file.cpp
    "six columns": ([WHOLE, "2 3 0.0101 0 0 0"], line(3) + "expected 3 or 7 values, got 6 (a bond is id_i id_j deq, or id_i id_j deq q k work broken)"),
    "q is nan": (["1 2 0.0101 nan 0 0 0"], line(2) + f"q {NUMBER} 'nan'"),
    "bond twice": ([WHOLE, "2 1 0.0101 0 0 0 0"], "bond 1 2 is given twice in file b.bonds"),
    "contact of an unknown atom": (["1 13 0.01 -1e-5 0 1 2"], "bond 1 13: there is no atom 13"),
}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("ranks", [1, 2])
def test_damaged_bond_file(lmp, tmp_path, name, ranks):
    lines, text = FILES[name]
    (tmp_path / "b.bonds").write_text(bonds(*lines))
    refused(lmp(scene(style=FLOWS + " break 0.1", fix="fix bonds all evp/bonds file b.bonds"), ranks, seconds=SECONDS), text)


@pytest.mark.parametrize("style, lines, text", [
    (PARTS["style"], "1 2 0.0101 1e-5 0 1 0", FLOWED), (PARTS["style"], "1 2 0.0101 0 0.1 1 0", FLOWED), (PARTS["style"], "1 2 0.01 -1e-5 0 1 2", FLOWED),
    (PARTS["style"], "1 2 0.0101 0 0 1 0", FORGOTTEN), (PARTS["style"], "1 2 0.0101 0 0 0 1", FORGOTTEN),
    (BREAKS, "1 2 0.0101 1e-5 0 1 0", FLOWED), (BREAKS, "1 2 0.01 -1e-5 0 1 2", FLOWED)])
def test_a_file_into_a_style_that_would_forget(lmp, tmp_path, style, lines, text):
    (tmp_path / "b.bonds").write_text(bonds(lines))
    refused(lmp(scene(style=style, fix="fix bonds all evp/bonds file b.bonds"), seconds=SECONDS), text)


@pytest.mark.parametrize("style, lines, counts", [
    (PARTS["style"], [WHOLE, "2 3 0.0101 0 0 0 0"], (2, 0)), (FLOWS, ["1 2 0.0101", "2 3 0.0101"], (2, 0)),
    (FLOWS, ["1 2 0.0101 -1e-5 0 0.5 0", "2 3 0.0101"], (2, 0)), (BREAKS, [WHOLE, "2 3 0.0101 0 0 0 1"], (2, 1)),
    (FLOWS, [WHOLE, "2 3 0.0101 0 0 0 1"], (2, 1)), (FLOWS, [WHOLE, "2 3 0.0101 0 0 1 1", "3 2 0.01 -1e-5 0 1 2"], (2, 1)), (FLOWS, ["1 2 0.01 -1e-5 0 1 2"], (0, 0))])
def test_legal_bond_files(lmp, tmp_path, style, lines, counts):
    (tmp_path / "b.bonds").write_text(bonds(*lines))
    thermo = "thermo_style custom step f_bonds f_bonds[5]"
    table = lmp(scene(style=style, fix="fix bonds all evp/bonds file b.bonds", thermo=thermo, step="timestep 1e-12"), seconds=SECONDS).ok().thermo()
    assert (table["f_bonds"][-1], table["f_bonds[5]"][-1]) == counts


# ---- restart files

PULL = "velocity all ramp vx 0 300 x 0 0.02 units box\n"
CONTINUE = """
read_restart {}
{}
fix bonds all evp/bonds
fix move all nve
timestep 1e-7
thermo_style custom step pe press f_bonds f_bonds[1]
run 3
"""


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """{style: bytes of a restart file of a body that has flowed, or broken}."""
    from lammps_run import run_lammps
    found = {}
    for name, style in (("flows", FLOWS), ("breaks", STYLE + "break 0.02"), ("plain", PARTS["style"])):
        folder = tmp_path_factory.mktemp(name)
        run_lammps(scene(style=style, then=PULL, run="run 100", after="write_restart s.restart"), cwd=folder).ok()
        found[name] = (folder / "s.restart").read_bytes()
    return found


@pytest.fixture
def resume(lmp, tmp_path):
    def run(content, lines="", ranks=1, text=CONTINUE):
        (tmp_path / "r.restart").write_bytes(content)
        return lmp(text.format("r.restart", lines), ranks=ranks, seconds=SECONDS)

    return run


COEFFS = "\npair_coeff * * " + ROW
PLASTIC = "pair_style evp/lj contact repulsive plasticity isotropic" + COEFFS
TEARING = "pair_style evp/lj contact repulsive break 0.02" + COEFFS
FORGETFUL = "pair_style evp/lj contact repulsive" + COEFFS


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("name, lines", [("flows", ""), ("flows", PLASTIC), ("flows", PLASTIC.replace("isotropic", "isotropic break 0.1")), ("breaks", ""),
                                         ("breaks", PLASTIC), ("plain", PLASTIC), ("plain", TEARING)])
def test_restarts_that_continue(saved, resume, name, lines, ranks):
    resume(saved[name], lines, ranks).ok()


@pytest.mark.parametrize("name, lines, text", [("flows", FORGETFUL, FORGETS), ("breaks", FORGETFUL, FORGETS), ("flows", TEARING, FORGETS)])
def test_restarts_into_a_style_that_would_forget(saved, resume, name, lines, text):
    refused(resume(saved[name], lines), text)


def test_restart_without_the_fix(saved, resume):
    refused(resume(saved["flows"], text=CONTINUE.replace("fix bonds all evp/bonds\n", "").replace(" f_bonds f_bonds[1]", "")),
            "Pair evp/lj: the bonds were recorded by fix bonds, whose records are not here")


# ---- fix evp/volume beside them


@pytest.mark.parametrize("fix, text", [
    ("fix v all evp/volume", "kv"), ("fix v all evp/volume -1", "-1"), ("fix v all evp/volume nan", f"{NUMBER} 'nan'"), ("fix v all evp/volume inf", f"{NUMBER} 'inf'"),
    ("fix v all evp/volume 1 2", "2"), ("fix v all evp/volume KV", f"{NUMBER} 'KV'")])
def test_volume_words(lmp, fix, text):
    run = lmp(scene(style=FLOWS, fix=PARTS["fix"] + "\n" + fix), seconds=SECONDS)
    refused(run)
    assert text.lower() in run.stdout.lower()
