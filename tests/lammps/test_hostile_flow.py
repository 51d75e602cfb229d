# SPDX-License-Identifier: GPL-2.0-only
"""`unload elastic` and `break` with every word wrong, bond files and restart files with histories that are damaged or go to a style that would
forget them: one clear error each, or a result that the pages promise."""

import struct

import pytest
from hostile import BONDS, PARTS, ROW, SECONDS, refused, scene

STYLE = "pair_style evp/lj contact literal "
FLOWS, BREAKS = STYLE + "unload elastic", STYLE + "break 0.1"
NUMBER = "must be a finite decimal number, got"
UNLOAD = "unload must be reversible (the paper's law) or elastic (permanent flow)"
BREAK = "break must be none or a positive strain of a bond, at which it breaks permanently"
NEEDS = "needs fix evp/bonds, which stores the history of the bonds"
STIFFER = "unload elastic needs a second regime less stiff than the first"
FORGETS = "bonds have flowed or broken, which pair_style evp/lj with 'unload reversible' and 'break none' would forget"

CASES = [
    ({"style": STYLE + "unload"}, "keyword unload needs a value"),
    ({"style": STYLE + "unload plastic"}, UNLOAD),
    ({"style": STYLE + "unload ELASTIC"}, UNLOAD),
    ({"style": STYLE + "unload 1"}, UNLOAD),
    ({"style": STYLE + 'unload ""'}, UNLOAD),
    ({"style": STYLE + "unloading elastic"}, "unknown keyword 'unloading'; it takes contact"),
    ({"style": STYLE + "elastic"}, "unknown keyword 'elastic'"),
    ({"style": STYLE + "unload elastic break"}, "keyword break needs a value"),
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
    ({"style": FLOWS, "fix": "", "thermo": ""}, "unload elastic " + NEEDS),
    ({"style": BREAKS, "fix": "", "thermo": ""}, "break " + NEEDS),
    ({"style": FLOWS, "fix": "", "thermo": "", "run": "minimize 0 1e-9 10 10"}, "unload elastic " + NEEDS),
    ({"style": FLOWS, "fix": "fix bonds all evp/bonds\nrun 0\nunfix bonds", "thermo": ""}, "unload elastic " + NEEDS),
    ({"style": FLOWS, "coeff": "pair_coeff * * 80 8 4 80 8 4 0.005 0 1.5"}, STIFFER),
    ({"style": FLOWS, "coeff": "pair_coeff * * 80 8 4 3 24 12 0.3 0 1.5"}, STIFFER),
    ({"style": FLOWS, "after": "pair_coeff * * 80 8 4 200 8 4 0.005 0 1.5\nrun 1"}, STIFFER),
    ({"style": FLOWS, "then": "fix stiffer all adapt 1 pair evp/lj e2 * * v_stiff\nvariable stiff equal 3+100*step"}, STIFFER),
    ({"style": FLOWS, "coeff": "pair_coeff * * 80 8 4 3 8 4 0.005 0 1.004"}, "with contact literal needs an alpha above 1 + xi_s, got alpha = 1.004 with xi_s = 0.005"),
    ({"style": FLOWS, "step": "timestep 1e-7\nrun_style respa 2 2"}, "respa"),
    ({"style": BREAKS, "step": "timestep 1e-7\nrun_style respa 2 2"}, "respa"),
    ({"style": FLOWS, "fix": "fix even all balance 2 1.0 shift x 5 1.0\nfix bonds all evp/bonds"}, "must be defined before fix even balance"),
    ({"style": BREAKS, "fix": "fix even all balance 2 1.0 shift x 5 1.0\nfix bonds all evp/bonds"}, "must be defined before fix even balance"),
    ({"style": "pair_style hybrid/scaled 0.5 evp/lj unload elastic", "coeff": "pair_coeff * * evp/lj " + ROW}, "does not work in pair_style hybrid/scaled"),
    ({"style": "pair_style hybrid/overlay evp/lj unload elastic evp/lj break 0.1", "coeff": f"pair_coeff * * evp/lj 1 {ROW}\npair_coeff * * evp/lj 2 {ROW}"},
     "can be one sub-style of pair_style hybrid only"),
]


@pytest.mark.parametrize("parts, text", CASES, ids=[" ".join(text.split()[:5]) + f" {number}" for number, (_, text) in enumerate(CASES)])
def test_one_clear_error(lmp, parts, text):
    later = "after" in parts or "unfix" in parts.get("fix", "") or "adapt" in parts.get("then", "")
    refused(lmp(scene(**parts), seconds=SECONDS), text, stepped=later)


@pytest.mark.parametrize("style", [
    FLOWS, BREAKS, FLOWS + " break none", FLOWS + " break 1e-9", FLOWS + " break 1e9", STYLE + "unload elastic unload reversible", STYLE + "break 0.1 break none",
    "pair_style evp/lj unload elastic break 0.02 contact none", "pair_style evp/lj overlap 1 break 0.02 unload reversible contact repulsive"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_legal_words(lmp, style, ranks):
    """At rest nothing flows or breaks; words that come later count."""
    run = lmp(scene(style=style, thermo="thermo_style custom step pe press f_bonds f_bonds[1] f_bonds[5]"), ranks, seconds=SECONDS).ok()
    assert list(run.thermo()["f_bonds"]) == [BONDS] * 2 and list(run.thermo()["f_bonds[5]"]) == [0, 0]
    words = style.split()
    on = "elastic" in words and words[::-1].index("elastic") < (words[::-1].index("reversible") if "reversible" in words else 99)
    assert ("unload elastic" in run.stdout.partition("evp/lj: damping")[2]) == on


# ---- bond files

HEADER = "# EVP bonds COUNT: {} UNITS: si\n"
COLUMNS = "(a bond is id_i id_j deq, or id_i id_j deq q work broken)"
FLAG = "broken must be 0 (a bond), 1 (a broken bond) or 2 (a new pair), got "
RANGE = "q must be above -deq and below 1000 deq, got "
NO_TENSION = "q must not be above 0 where there is no bond: new pairs flow in compression only"
FORGOTTEN = "it has flowed or broken, bond file b.bonds: use pair_style evp/lj with 'unload elastic' or 'break', as when the file was written"
WHOLE = "1 2 0.0101 0 0 0"


def bonds(*lines):
    return HEADER.format(len(lines)) + "".join(f"{line}\n" for line in lines)


def line(number):
    return f"Fix bonds evp/bonds: bond file line {number}: "


FILES = {
    "five columns": ([WHOLE, "2 3 0.0101 0 0"], line(3) + "expected 6 values, got 5 " + COLUMNS),
    "seven columns": ([WHOLE, "2 3 0.0101 0 0 0 0"], line(3) + "expected 6 values, got 7 " + COLUMNS),
    "four columns": (["1 2 0.0101 0"], line(2) + "expected 3 values, got 4 " + COLUMNS),
    "three after six": ([WHOLE, "2 3 0.0101"], line(3) + "expected 6 values, got 3"),
    "six after three": (["1 2 0.0101", "2 3 0.0101 0 0 0"], line(3) + "expected 3 values, got 6"),
    "flag 3": (["1 2 0.0101 0 0 3"], line(2) + FLAG + "3"),
    "flag -1": (["1 2 0.0101 0 0 -1"], line(2) + FLAG + "-1"),
    "flag is a number with a point": (["1 2 0.0101 0 0 1.0"], line(2) + FLAG + "1.0"),
    "flag is a word": (["1 2 0.0101 0 0 yes"], line(2) + FLAG + "yes"),
    "flag 01": (["1 2 0.0101 0 0 01"], line(2) + FLAG + "01"),
    "q is -deq": (["1 2 0.0101 -0.0101 0 0"], line(2) + RANGE + "-0.0101"),
    "q below -deq": (["1 2 0.0101 -3 0 0"], line(2) + RANGE + "-3"),
    "q is huge": (["1 2 0.0101 1e30 0 0"], line(2) + RANGE + "1e30"),
    "q is nan": (["1 2 0.0101 nan 0 0"], line(2) + f"q {NUMBER} 'nan'"),
    "q is -inf": (["1 2 0.0101 -inf 0 0"], line(2) + f"q {NUMBER} '-inf'"),
    "q is a word": (["1 2 0.0101 none 0 0"], line(2) + f"q {NUMBER} 'none'"),
    "work is nan": (["1 2 0.0101 1e-5 nan 0"], line(2) + f"work {NUMBER} 'nan'"),
    "work is inf": (["1 2 0.0101 1e-5 inf 0"], line(2) + f"work {NUMBER} 'inf'"),
    "broken, but stretched": (["1 2 0.0101 1e-5 0 1"], line(2) + NO_TENSION),
    "contact that is stretched": (["1 2 0.0101 1e-5 0 2"], line(2) + NO_TENSION),
    "bond twice": ([WHOLE, "2 1 0.0101 0 0 0"], "bond 1 2 is given twice in file b.bonds"),
    "bond and broken": ([WHOLE, "1 2 0.0101 0 0 1"], "bond 1 2 is given twice in file b.bonds"),
    "contact twice": (["1 2 0.01 -1e-5 1 2", "2 1 0.01 -1e-4 1 2"], "contact 1 2 is given twice in file b.bonds"),
    "bond and contact": ([WHOLE, "2 1 0.01 -1e-4 1 2"], "contact 1 2 is a bond too in file b.bonds"),
    "contact of an unknown atom": (["1 13 0.01 -1e-5 1 2"], "bond 1 13: there is no atom 13"),
    "contact of one atom": (["2 2 0.01 -1e-5 1 2"], line(2) + "atom 2 is bonded to itself"),
}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("ranks", [1, 2])
def test_damaged_bond_file(lmp, tmp_path, name, ranks):
    lines, text = FILES[name]
    (tmp_path / "b.bonds").write_text(bonds(*lines))
    refused(lmp(scene(style=FLOWS + " break 0.1", fix="fix bonds all evp/bonds file b.bonds"), ranks, seconds=SECONDS), text)


NEGATIVE = "WARNING: Fix evp/bonds: {} pairs have a negative plastic work, first {}, bond file b.bonds: they have flowed so far in compression"


@pytest.mark.parametrize("work, warned", [("-1e6", True), ("-1e-3", True), ("-1e-12", False), ("0", False), ("1e6", False)])
@pytest.mark.parametrize("ranks", [1, 2])
def test_negative_plastic_work_is_read_and_named(lmp, tmp_path, work, warned, ranks):
    """But for round-off: where flow creates energy, write_evp_bonds has such values."""
    (tmp_path / "b.bonds").write_text(bonds(WHOLE, f"2 3 0.0101 1e-5 {work} 0", f"5 6 0.0101 1e-5 {work} 0"))
    run = lmp(scene(style=FLOWS, fix="fix bonds all evp/bonds file b.bonds"), ranks, seconds=SECONDS).ok()
    said = " ".join(run.stdout.split())
    assert (NEGATIVE.format(2, f"2 3 with {float(work):.6g}") in said) == warned
    assert ("negative plastic work" in said) == warned


def test_the_program_reads_back_its_own_negative_plastic_work(lmp, tmp_path):
    """A pair pressed to 0.6 deq, where the second regime is the stiffer."""
    box = """boundary f f f
region box block -0.05 0.05 -0.05 0.05 -0.05 0.05
create_box 1 box
create_atoms 1 single 0 0 0
create_atoms 1 single 0.01 0 0
set group all diameter 0.01
set group all density 2700
group second id 2"""
    state = "compute state all evp/state/atom plastic_work\ncompute work all reduce sum c_state[5]"
    thermo = "thermo_style custom step c_work\nthermo_modify norm no format float %.17g\nthermo 400"
    lmp(scene(style=FLOWS, box=box, then=state, thermo=thermo, move="fix move second move linear -10 0 0", step="timestep 1e-6",
              run="run 400\nwrite_evp_bonds b.bonds\nwrite_data b.data nocoeff"), seconds=SECONDS).ok()
    value = float((tmp_path / "b.bonds").read_text().splitlines()[1].split()[4])
    assert value < -1.0
    run = lmp(scene(style=FLOWS, box="boundary f f f\nread_data b.data", then=state, thermo=thermo,
                    fix="fix bonds all evp/bonds file b.bonds", run="run 0"), seconds=SECONDS).ok()
    assert run.thermo()["c_work"][0] == value
    assert NEGATIVE.format(1, f"1 2 with {value:.6g}") in " ".join(run.stdout.split())


@pytest.mark.parametrize("style, lines, text", [
    (PARTS["style"], "1 2 0.0101 1e-5 1 0", FORGOTTEN), (PARTS["style"], "1 2 0.0101 0 1 0", FORGOTTEN), (PARTS["style"], "1 2 0.0101 0 0 1", FORGOTTEN),
    (PARTS["style"], "1 2 0.01 -1e-5 1 2", FORGOTTEN), (BREAKS, "1 2 0.0101 1e-5 1 0", "use pair_style evp/lj with 'unload elastic'"),
    (BREAKS, "1 2 0.01 -1e-5 1 2", "use pair_style evp/lj with 'unload elastic'")])
def test_a_file_into_a_style_that_would_forget(lmp, tmp_path, style, lines, text):
    (tmp_path / "b.bonds").write_text(bonds(lines))
    refused(lmp(scene(style=style, fix="fix bonds all evp/bonds file b.bonds"), seconds=SECONDS), text)


@pytest.mark.parametrize("style, lines, counts", [
    (PARTS["style"], [WHOLE, "2 3 0.0101 0 0 0"], (2, 0)), (FLOWS, ["1 2 0.0101", "2 3 0.0101"], (2, 0)),
    (FLOWS, ["1 2 0.0101 -1e-5 0.5 0", "2 3 0.0101 1e-5 1 0"], (2, 0)), (BREAKS, [WHOLE, "2 3 0.0101 0 0 1"], (2, 1)),
    (FLOWS, [WHOLE, "2 3 0.0101 0 0 1"], (2, 1)), (FLOWS, [WHOLE, "2 3 0.0101 0 1 1", "3 2 0.01 -1e-5 1 2"], (2, 1)), (FLOWS, ["1 2 0.01 -1e-5 1 2"], (0, 0))])
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
PLASTIC = "pair_style evp/lj contact literal unload elastic" + COEFFS
TEARING = "pair_style evp/lj contact literal break 0.02" + COEFFS
FORGETFUL = "pair_style evp/lj contact literal" + COEFFS


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("name, lines", [("flows", ""), ("flows", PLASTIC), ("flows", PLASTIC.replace("elastic", "elastic break 0.1")), ("breaks", ""),
                                         ("breaks", PLASTIC), ("plain", PLASTIC), ("plain", TEARING)])
def test_restarts_that_continue(saved, resume, name, lines, ranks):
    resume(saved[name], lines, ranks).ok()


@pytest.mark.parametrize("name, lines, text", [("flows", FORGETFUL, FORGETS), ("breaks", FORGETFUL, FORGETS), ("flows", TEARING, "bonds have flowed, which")])
def test_restarts_into_a_style_that_would_forget(saved, resume, name, lines, text):
    refused(resume(saved[name], lines), text)


def test_restart_without_the_fix(saved, resume):
    refused(resume(saved["flows"], text=CONTINUE.replace("fix bonds all evp/bonds\n", "").replace(" f_bonds f_bonds[1]", "")),
            "Pair evp/lj: the bonds were recorded by fix bonds, whose records are not here")


def after_name(content):
    return content.index(b"evp/bonds\0") + len(b"evp/bonds\0") + 4


def at_record(content):
    """Where atom 1's record starts: its ID as recorded, and how many bonds it has."""
    return min(k for k in (content.find(struct.pack("<qq", 1, count)) for count in range(5, 9)) if k >= 0)


FIX_DAMAGED = "Fix bonds evp/bonds: its section of the restart file is damaged"
ATOM_DAMAGED = "Fix bonds evp/bonds: the bonds of atom 1 in the restart file are damaged"


@pytest.mark.parametrize("where, offset, bit, text", [
    (after_name, 0, 3, FIX_DAMAGED), (after_name, 7, 6, FIX_DAMAGED), (after_name, 22, 3, FIX_DAMAGED),
    (at_record, -8, 0, ATOM_DAMAGED), (at_record, 8, 1, ATOM_DAMAGED), (at_record, 32, 0, ATOM_DAMAGED), (at_record, 38, 6, ATOM_DAMAGED),
    (at_record, 40, 0, ATOM_DAMAGED), (at_record, 47, 7, ATOM_DAMAGED), (at_record, 54, 4, ATOM_DAMAGED), (at_record, 55, 6, ATOM_DAMAGED)])
def test_a_changed_bit(saved, resume, where, offset, bit, text):
    """Of the format, of the number of bonds, and of offset, work and broken flag of a bond."""
    content = bytearray(saved["flows"])
    content[where(saved["flows"]) + offset] ^= 1 << bit
    refused(resume(bytes(content)), text)


@pytest.mark.parametrize("offset", range(0, 48, 5))
def test_a_changed_bit_in_the_settings(saved, resume, offset):
    """Format, contact, overlap, unload, break strain and the length of an ID."""
    content = bytearray(saved["flows"])
    content[saved["flows"].index(b"evp/lj\0") + len(b"evp/lj\0") + offset] ^= 8
    refused(resume(bytes(content)), "Pair evp/lj: the restart file is damaged in the settings")


# ---- fix evp/volume beside them


@pytest.mark.parametrize("fix, text", [
    ("fix v all evp/volume", "kv"), ("fix v all evp/volume -1", "-1"), ("fix v all evp/volume nan", f"{NUMBER} 'nan'"), ("fix v all evp/volume inf", f"{NUMBER} 'inf'"),
    ("fix v all evp/volume 1 2", "2"), ("fix v all evp/volume KV", f"{NUMBER} 'KV'")])
def test_volume_words(lmp, fix, text):
    run = lmp(scene(style=FLOWS, fix=PARTS["fix"] + "\n" + fix), seconds=SECONDS)
    refused(run)
    assert text.lower() in run.stdout.lower()
