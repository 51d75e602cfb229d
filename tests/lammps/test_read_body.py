# SPDX-License-Identifier: GPL-2.0-only
"""read_evp_body and read_evp_row as commands, and what the load decks make of them: which measures count, the same on any ranks;
one clear error for each that cannot be; rows typed or from a file. The file alone is in tests/unit/test_body_measures.cpp."""

import math
import re
import shutil

import numpy as np
import pytest
from common_bodies import REFERENCE
from evp import specimen
from lammps_run import REPOSITORY, read_csv, write_data

TABLE1 = "80 8 4 3 8 4 0.005 0 1.5"
MEASURES = "length radius area volume solid_fraction density diameter".split()
NUMBERS = "e1 m1 n1 e2 m2 n2 xi_s gamma alpha spacing coordination kv density saturation".split()
HEAD = "units si\natom_style sphere\natom_modify map yes\nboundary s s s\n"
SIDE = 0.004  # of the cells of the bar
BAR = (15, 5, 4)  # its cells, one sphere in each
BAR_LENGTH, BAR_AREA = BAR[0] * SIDE, BAR[1] * BAR[2] * SIDE**2
BALL = math.pi / 6 * SIDE**3


def described(**values):
    """The text of a FILE.body."""
    return "# measures\n" + "".join(f"variable {name} index {value} # SI\n" for name, value in values.items())


WHOLE = {"length": BAR_LENGTH, "area": BAR_AREA, "volume": BAR_LENGTH * BAR_AREA, "solid_fraction": BALL / SIDE**3, "density": 5000}


@pytest.fixture
def bar_file(tmp_path):
    """bar.data: touching spheres in a bar along x from x = 0, which is no cylinder of the paper's."""
    place = (np.indices(BAR).reshape(3, -1).T + 0.5) * SIDE - [0, 0.5 * BAR[1] * SIDE, 0.5 * BAR[2] * SIDE]
    write_data(tmp_path / "bar.data", place, np.full(len(place), 0.5 * SIDE), [[-0.01, 0.1], [-0.03, 0.03], [-0.03, 0.03]])
    return tmp_path / "bar.data"


def reading(command, names, prefix="b", data="bar.data"):
    """A deck that calls a command and prints its variables."""
    text = "".join(f'print "{prefix}_{name} = ${{{prefix}_{name}}}"\n' for name in names)
    return f"{HEAD}read_data {data}\n{command}\n{text}"


def values(run, prefix="b"):
    """{name: number} of what reading() prints."""
    return {name: float(word) for name, word in re.findall(rf"^{prefix}_(\w+) = (\S+)$", run.ok().stdout, re.M)}


@pytest.mark.parametrize("ranks", [1, 3])
def test_the_papers_cylinder_where_nothing_is_known(lmp, tmp_path, ranks):
    """Its volume and solid fraction are known too; 15 digits, as the formulas of a deck have."""
    shutil.copy(REFERENCE, tmp_path / "bar.data")
    found = values(lmp(reading("read_evp_body bar.data b", MEASURES), ranks))
    body = specimen.read_data(REFERENCE)
    assert found["length"] == 0.05 and found["radius"] == 0.02 and found["density"] == 0.0
    assert found["area"] == float(f"{math.pi * 0.02**2:.15g}")
    assert found["volume"] == pytest.approx(math.pi * 0.02**2 * 0.05, rel=1e-14)
    assert found["solid_fraction"] == pytest.approx(4 / 3 * math.pi * (body.radius**3).sum() / found["volume"], rel=1e-12)
    solid = float(f"{0.6 * math.pi * 0.02**2 * 0.05:.15g}")
    assert found["diameter"] == pytest.approx(2 * (solid / (500 * 4 / 3 * math.pi)) ** (1 / 3), rel=1e-14)


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_is_given_counts_before_the_file(lmp, bar_file, ranks):
    bar_file.with_suffix(".data.body").write_text(described(**WHOLE))
    found = values(lmp(reading("read_evp_body bar.data b", MEASURES), ranks))
    assert {name: found[name] for name in WHOLE} == pytest.approx(WHOLE, rel=1e-15) and found["radius"] == 0.0
    wider = values(lmp(reading(f"read_evp_body bar.data b length 0 area {1.05 * BAR_AREA} radius 0", MEASURES), ranks))
    assert wider == {**found, "area": 1.05 * BAR_AREA}
    round_bar = values(lmp(reading("read_evp_body bar.data b radius 0.0125", MEASURES), ranks))
    assert round_bar["radius"] == 0.0125 and round_bar["area"] == pytest.approx(math.pi * 0.0125**2, rel=1e-14)


def test_file_of_length_and_area_alone(lmp, bar_file):
    """The volume of a body that is no cylinder stays unknown."""
    bar_file.with_suffix(".data.body").write_text(described(length=BAR_LENGTH, area=BAR_AREA).replace("\n", "\r\n"))
    found = values(lmp(reading("read_evp_body bar.data b", MEASURES)))
    assert found["area"] == pytest.approx(BAR_AREA) and found["volume"] == found["solid_fraction"] == found["density"] == 0.0


GIVEN = "there is no bar.data.body: give length, and radius or area"


@pytest.mark.parametrize("body, command, text", [
    (None, "read_evp_body bar.data b", f"the centers lie from 0.002 to 0.058 m along x, not from 0 to length = 0.05 m; {GIVEN}"),
    (None, "read_evp_body bar.data b length 0.06", "is no cylinder of radius 0.02 m about the x axis; correct the given length, radius or area"),
    (None, "read_evp_body bar.data b length 0.06 area 0.0005", "too little for area = 0.0005 m2; correct the given"),
    (None, "read_evp_body bar.data b length 0.06 area 0.0001", "the spheres fill 1.68 of area = 0.0001 m2 times length; correct the given"),
    ({**WHOLE, "length": 0.08}, "read_evp_body bar.data b", "not from 0 to length = 0.08 m; make bar.data and bar.data.body again"),
    ({**WHOLE, "volume": 3e-5}, "read_evp_body bar.data b", "bar.data.body is of another body: the spheres have 1.005e-05 m3, it says 1.571e-05 m3"),
    ({**WHOLE, "lenght": 1}, "read_evp_body bar.data b", "file bar.data.body line 7: unknown dimension 'lenght'"),
    ({**WHOLE, "density": -1}, "read_evp_body bar.data b", "file bar.data.body line 6: density must be positive, got -1"),
    ({"length": 0.06}, "read_evp_body bar.data b", "file bar.data.body has no radius (of a cylinder) and no area"),
    ({"area": 0.0003}, "read_evp_body bar.data b", "file bar.data.body has no length"),
    (WHOLE, "read_evp_body bar.data b area -1", "area must be positive, or 0 where it is not given, got -1"),
    (WHOLE, "read_evp_body bar.data b area 1 radius 1", "radius and area are both given"),
    (WHOLE, "read_evp_body bar.data b area wide", "area must be a finite decimal number, got 'wide'"),
    (WHOLE, "read_evp_body bar.data b volume 1", "unknown keyword 'volume'; it takes length, radius, area"),
    (WHOLE, "read_evp_body bar.data b area", "keyword area needs a value"),
    (WHOLE, "read_evp_body bar.data", "expected a data file and the prefix of the variables, got 1 argument "),
    (WHOLE, "read_evp_body bar.data v-1", "the prefix must consist of letters, digits and underscores"),
    (WHOLE, "variable b_area equal 1\nread_evp_body bar.data b", "there is a variable b_area of another style"),
    (WHOLE, "delete_atoms group all\nread_evp_body bar.data b", "there are no atoms"),
], ids=lambda value: value[:50] if isinstance(value, str) else "")
def test_one_clear_error(lmp, bar_file, body, command, text):
    if body:
        bar_file.with_suffix(".data.body").write_text(described(**body))
    run = lmp(reading(command, MEASURES), seconds=30)
    assert run.returncode != 0 and run.stdout.count("ERROR") == 1, run.stdout
    assert "ERROR: read_evp_body: " in run.stdout and text in run.stdout, run.stdout
    assert "b_length =" not in run.stdout


@pytest.mark.parametrize("make, text", [
    (lambda path: path.write_bytes(described(**WHOLE).encode() + b"\0\n"), "is not a text file (it holds a NUL byte)"),
    (lambda path: path.write_text("#" * (1 << 17)), "is larger than 64 KiB"),
    (lambda path: path.mkdir(), "cannot read bar.data.body"),
    (lambda path: path.write_text(described(**WHOLE)[:-1]), "line 6: the last line has no line end"),
    (lambda path: path.write_text("shell touch here\n"), "line 1: expected 'variable NAME index VALUE', got 'shell touch here'")])
def test_damaged_file(lmp, bar_file, tmp_path, make, text):
    """All ranks stop together."""
    make(bar_file.with_suffix(".data.body"))
    run = lmp(reading("read_evp_body bar.data b", MEASURES), 2, seconds=30)
    assert run.returncode != 0 and text in run.stdout, run.stdout
    assert not (tmp_path / "here").exists(), "a file of measures is no script"


@pytest.mark.parametrize("old, new, text", [
    ("units si", "units lj", "dimensions of bodies are in SI units, but 'units lj' is in force"),
    ("read_data bar.data", "", "use the command after read_data"),
    ("atom_style sphere", "atom_style atomic", "needs particles with a radius: use 'atom_style sphere'")])
def test_scenes_that_it_cannot_take(lmp, bar_file, old, new, text):
    deck = reading("read_evp_body bar.data b", MEASURES).replace(old, new)
    if "atomic" in new:
        deck = deck.replace("read_data bar.data", "region all block 0 1 0 1 0 1\ncreate_box 1 all\ncreate_atoms 1 single 0.5 0.5 0.5")
    run = lmp(deck, seconds=30)
    assert run.returncode != 0 and text in run.stdout, run.stdout


def row_deck(words):
    return "units si\n" + f"read_evp_row {words} r\n" + "".join(f'print "r_{name} = ${{r_{name}}}"\n' for name in NUMBERS)


@pytest.mark.parametrize("ranks", [1, 2])
def test_rows_from_a_file_and_typed_are_one(lmp, tmp_path, ranks):
    row = "80.1 8 4 3 8 4 0.005 1000 1.5 kv 0.30000000000000004 spacing 0.0102 coordination 11.9 density 2700"
    (tmp_path / "good.evp").write_text(f"# UNITS: si\na {row}\n")
    found = [values(lmp(row_deck(words), ranks), "r") for words in ("good.evp:a", "./good.evp:a", "good.evp a", row, f'"{row}"', f"'{row}'")]
    assert found == [found[0]] * 6 and list(found[0]) == NUMBERS
    assert found[0]["e1"] == 80.1 and found[0]["kv"] == 0.30000000000000004 and found[0]["density"] == 2700
    plain = values(lmp(row_deck(TABLE1), ranks), "r")
    assert plain["alpha"] == 1.5 and plain["spacing"] == plain["coordination"] == plain["kv"] == plain["density"] == 0


@pytest.mark.parametrize("words, text", [
    ('"80 8 4 3 8 4 0.005 0"', "read_evp_row: expected 9 values, got 8"),
    (f"{TABLE1} 0", "read_evp_row: expected 9 values, got 10"),
    (f"{TABLE1} colour 1", "read_evp_row: unknown keyword 'colour' of a row"),
    (f'"{TABLE1.replace("0.005", "5")}"', "read_evp_row: xi_s must lie between 0 and 1"),
    ("80", "read_evp_row: expected 9 values, got 1"),
    ("80 8", "read_evp_row: expected 9 values, got 2"),
    ("good.evp:a kv 300", "FILE ROW or FILE:ROW without further arguments, got 3 words, the first 'good.evp:a'"),
    ("good.evp", "read_evp_row: expected FILE:ROW, a potential file and the name of a row, got 'good.evp'"),
    ('""', "read_evp_row: expected 9 values, got 0"),
    ("", "read_evp_row: expected at least two arguments, a row (FILE:ROW or its numbers) and the prefix of the variables, got 1"),
    ("absent.evp:a", "read_evp_row: cannot read the potential file 'absent.evp'")])
def test_bad_rows(lmp, words, text):
    run = lmp(row_deck(words), seconds=30)
    assert run.returncode != 0 and text in run.stdout and run.stdout.count("ERROR") == 1, run.stdout


@pytest.mark.parametrize("deck, choices", [
    ("in.traction", {"strain": 0.0004}), ("in.cyclic", {"strain": 0.0003}), ("in.quasistatic", {"strain": 0.0005})])
def test_decks_take_a_row_from_a_file(lmp, tmp_path, deck, choices):
    """Without spacing it is taken as it is, which for 500 spheres is what -var coeff gives; its density makes the mass that of the
    solid. Control: another row gives other stresses."""
    (tmp_path / "rows.evp").write_text(f"# UNITS: si\nsoft 40 {TABLE1[3:]}\nheavy {TABLE1} density 7800\n")
    (tmp_path / "mass.lmp").write_text('print "the mass is $(mass(all)) kg"\n')
    common = {"specimen": REFERENCE, "contact": "none", **choices}
    if deck != "in.quasistatic":
        common["also"] = "mass.lmp"
    curves, printed = {}, {}
    for name, material in (("typed", {"coeff": TABLE1}), ("heavy", {"material": "rows.evp:heavy"}), ("soft", {"material": "rows.evp:soft"})):
        printed[name] = lmp(deck, variables={**common, **material, "out": name}).ok().stdout
        curves[name] = read_csv(tmp_path / f"{name}.csv")["stress_virial"]
    if deck == "in.quasistatic":
        assert np.array_equal(curves["heavy"], curves["typed"]), "no mass in statics"
    else:
        mass = float(re.search(r"^the mass is (\S+) kg", printed["heavy"], re.M).group(1))
        assert mass == pytest.approx(7800 * math.pi * 0.02**2 * 0.05, rel=1e-12)
    assert curves["soft"].max() == pytest.approx(0.5 * curves["typed"].max(), rel=0.1)
    run = lmp(deck, variables={**common, "material": "rows.evp:soft", "coeff": TABLE1})
    assert run.returncode != 0 and "\nERROR: material and coeff are both given: give one of them\n" in run.stdout


@pytest.mark.parametrize("deck", ["in.traction", "in.cyclic", "in.quasistatic"])
def test_decks_take_the_measures_of_the_file(lmp, bar_file, tmp_path, deck):
    """-var wins: three quarters of the area, four thirds of the stress. A density needs to know what the spheres fill of the body."""
    bar_file.with_suffix(".data.body").write_text(described(length=BAR_LENGTH, area=BAR_AREA))
    common = {"specimen": "bar.data", "strain": 0.0005, "contact": "none"}
    lmp(deck, variables={**common, "out": "file"}).ok()
    lmp(deck, variables={**common, "out": "given", "area": 0.75 * BAR_AREA}).ok()
    file, given = (read_csv(tmp_path / f"{name}.csv")["stress_grip"] for name in ("file", "given"))
    assert file.max() > 1e6 and given == pytest.approx(file / 0.75, rel=1e-5)
    (tmp_path / "rows.evp").write_text(f"# UNITS: si\nheavy {TABLE1} density 7800\n")
    run = lmp(deck, variables={**common, "material": "rows.evp:heavy"})
    assert run.returncode != 0 and "ERROR: rows.evp:heavy gives the density of the solid, but bar.data.body has no volume" in run.stdout
    with open(bar_file.with_suffix(".data.body"), "a", encoding="utf-8") as out:
        out.write(f"variable volume index {BAR_LENGTH * BAR_AREA}\n")
    lmp(deck, variables={**common, "material": "rows.evp:heavy"}).ok()


def test_example_of_the_page(lmp, tmp_path):
    """The complete input of doc/read_evp_body.rst, as it stands."""
    page = (REPOSITORY / "doc" / "read_evp_body.rst").read_text(encoding="utf-8")
    block = page.partition("This complete input")[2].partition(".. code-block:: LAMMPS\n\n")[2]
    lines = re.match(r"(?:   .*\n|\n)+", block).group(0)
    run = lmp("".join(line[3:] or "\n" for line in lines.splitlines(keepends=True))).ok()
    shown = re.search(r"::\n\n   (read_evp_body: .*)\n   (E = .* GPa)\n", page)
    assert shown and shown.group(1) in run.stdout and shown.group(2) in run.stdout, run.stdout
