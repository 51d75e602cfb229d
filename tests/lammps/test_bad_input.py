# SPDX-License-Identifier: GPL-2.0-only
"""Bad input gets one clear error that names style, key, value, rule and remedy, before the first step.

Each case takes the good deck below, which runs (the control), spoils one thing, and demands the text."""

import numpy as np
import pytest
from lammps_run import write_data

ROW = "80 8 4 3 8 4 0.005 0 1.5"
GOOD = f"""
units si
atom_style sphere
atom_modify map yes
boundary f f f
read_data row.data
neighbor 0.002 bin
neigh_modify every 1 delay 0 check yes
pair_style evp/lj contact literal
pair_coeff * * {ROW}
fix bonds all evp/bonds
fix move all nve
timestep 1e-7
thermo 1
run 3
"""
KEYS = "e1 m1 n1 e2 m2 n2 xi_s gamma alpha".split()


@pytest.fixture
def run(lmp, tmp_path):
    """Writes a row of touching spheres and the potential files, spoils the good deck, and runs it."""
    place = np.array([[0.01 * k, 0.0, 0.0] for k in range(6)])
    radius = np.full(6, 0.005)
    box = [[-0.05, 0.1], [-0.05, 0.05], [-0.05, 0.05]]
    write_data(tmp_path / "row.data", place, radius, box)
    write_data(tmp_path / "types.data", place, radius, box, types=[1, 2, 1, 2, 1, 2])
    write_data(tmp_path / "point.data", place[[0, 1, 2, 3, 4, 4]], radius, box)
    write_data(tmp_path / "zero.data", place, np.zeros(6), box)
    write_data(tmp_path / "near.data", place, radius, [[-0.05, 0.1], [-0.014, 0.014], [-0.05, 0.05]])
    write_data(tmp_path / "close.data", place, radius, [[-0.05, 0.1], [-0.006, 0.006], [-0.05, 0.05]])
    head = "# DATE: 2026-01-01 UNITS: si CITATION: none\n"
    for name, text in (("good", head + f"a {ROW}\n"), ("lj_units", head.replace("si", "lj") + f"a {ROW}\n"),
                       ("no_units", f"# nothing\na {ROW}\n"), ("no_comment", f"a {ROW}\n"), ("empty", ""),
                       ("nul", head + f"a {ROW}\0\n"), ("twice", head + f"a {ROW}\na {ROW}\n"),
                       ("short", head + "a 80 8 4\n"), ("damaged", head + f"a {ROW}\nb {ROW.replace('3', 'x')}\n"),
                       ("big", head + "#" * (1 << 20))):
        (tmp_path / f"{name}.evp").write_text(text)

    def spoil(old, new, ranks=1):
        assert GOOD.count(old) == 1 or not old
        return lmp(GOOD.replace(old, new) if old else new, ranks=ranks, seconds=30)

    return spoil


def refused(run, text):
    assert run.returncode != 0, run.stdout
    assert text in run.stdout, run.stdout
    assert run.made_no_step(), run.stdout


def test_the_good_deck_runs(run):
    result = run("run 3", "run 3").ok()
    assert not result.made_no_step()
    assert "recorded 5 pairs" in result.stdout
    assert not result.warnings()


NUMBER = "must be a finite decimal number, got"


WORDS = [("nan", "nan"), ("-inf", "-inf"), ("0x10", "0x10"), ("1e999", "1e999"), ('""', ""), ("8,5", "8,5"),
         ("1.5d0", "1.5d0"), ("--1", "--1")]


@pytest.mark.parametrize("key, word, shown", [(key, *WORDS[0]) for key in KEYS] + [("e2", *word) for word in WORDS[1:]])
def test_words_that_are_no_numbers(run, key, word, shown):
    words = ROW.split()
    words[KEYS.index(key)] = word
    refused(run(f"* * {ROW}", "* * " + " ".join(words)), f"Pair evp/lj: {key} {NUMBER} '{shown}'")


@pytest.mark.parametrize("key, word, rule", [
    ("e1", "-1", "e1 must be zero or positive, got -1"),
    ("e2", "-0.5", "e2 must be zero or positive, got -0.5"),
    ("gamma", "-1000", "gamma must be zero or positive, got -1000"),
    ("m1", "4", "exponents must satisfy m1 > n1 > 0, got m1 = 4 and n1 = 4"),
    ("n1", "9", "exponents must satisfy m1 > n1 > 0, got m1 = 8 and n1 = 9"),
    ("n1", "0", "exponents must satisfy m1 > n1 > 0, got m1 = 8 and n1 = 0"),
    ("m2", "3.5", "exponents must satisfy m2 > n2 > 0, got m2 = 3.5 and n2 = 4"),
    ("n2", "-2", "exponents must satisfy m2 > n2 > 0, got m2 = 8 and n2 = -2"),
    ("m1", "4.00000003", "exponents too close: m1 - n1 = 3e-08, must be at least 0.0004 (0.0001, and 0.0001 of m1)"),
    ("n2", "7.9995", "exponents too close: m2 - n2 = 0.0005, must be at least 0.0008"),
    ("m1", "201", "exponent m1 must not exceed 200, got 201"),
    ("xi_s", "0", "xi_s must lie between 0 and 1"),
    ("xi_s", "-0.005", "xi_s must lie between 0 and 1"),
    ("xi_s", "1", "xi_s must lie between 0 and 1"),
    ("alpha", "1", "alpha must be greater than 1"),
    ("alpha", "-1.5", "alpha must be greater than 1"),
    ("alpha", "101", "alpha must not exceed 100"),
    ("e1", "1e308", "these parameters overflow double precision")])
def test_numbers_that_break_a_rule(run, key, word, rule):
    words = ROW.split()
    words[KEYS.index(key)] = word
    refused(run(f"* * {ROW}", "* * " + " ".join(words)), f"Pair evp/lj: {rule}")


COINCIDE = "atoms 5 and 6 coincide"
IMAGES = "in two periodic images: the box must be longer than two"
GREW = "radii must not grow past the largest at the start of the run"

CASES = [
    # pair_style
    ("contact literal", "contact sticky", "contact must be literal, repulsive or none, got 'sticky'"),
    ("contact literal", "contact", "Pair style evp/lj: keyword contact needs a value"),
    ("contact literal", "colour red", "Pair style evp/lj: unknown keyword 'colour'; it takes contact and overlap"),
    ("contact literal", "plasticity plastic", "plasticity must be none"),
    ("contact literal", "overlap", "Pair style evp/lj: keyword overlap needs a value"),
    ("contact literal", "overlap nan", "Pair style evp/lj: overlap must be a finite decimal number, got 'nan'"),
    ("contact literal", "overlap 0", "overlap must lie in (0, 1]"),
    ("contact literal", "overlap 1.1", "overlap must lie in (0, 1]"),
    ("contact literal", "contact none overlap", "keyword overlap needs a value"),
    ("contact literal", "ghostvel own", "Pair style evp/lj: unknown keyword 'ghostvel'; it takes contact and overlap"),
    # pair_coeff
    (ROW, "", "Pair evp/lj: pair_coeff needs two atom types and a row"),
    (ROW, ROW + " 0", "expected 9 values, got 10 (a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)"),
    (ROW, "80 8 4 3 8 4 0.005 0", "expected 9 values, got 8 (a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)"),
    (ROW, "80", "Pair evp/lj: pair_coeff needs two atom types and a row"),
    (ROW, "80 8", "Pair evp/lj: expected 9 values, got 2 (a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)"),
    (ROW, "80 a", "Pair evp/lj: expected 9 values, got 2 (a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)"),
    (ROW, "8O 8", "cannot read the potential file '8O': give its path, or put its folder into LAMMPS_POTENTIALS; a row of numbers has e1 m1"),
    (f"* * {ROW}", ROW, "Pair evp/lj: expected 9 values, got 7 (a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)"),
    (ROW, "good.evp a density 2700", "Pair evp/lj: expected 9 values, got 4 (a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)"),
    (ROW, "evp/lj " + ROW, "Pair evp/lj: expected 9 values, got 10"),
    (f"pair_coeff * * {ROW}", "", "pair coeffs are not set"),
    ("* * " + ROW, "2 2 " + ROW, "Numeric index 2 is out of bounds"),
    # potential files
    (ROW, "missing.evp a", "cannot read the potential file 'missing.evp'"),
    (ROW, ". a", "cannot read the potential file '.'"),
    (ROW, "good.evp:a spacing", "cannot read the potential file 'good.evp:a'"),
    (ROW, "good.evp b", "file good.evp has no row 'b'; its rows: a"),
    (ROW, "good.evp A", "file good.evp has no row 'A'"),
    (ROW, "lj_units.evp a", "file lj_units.evp: the first line must be a comment with 'UNITS: si', the units in force, got 'lj'"),
    (ROW, "no_units.evp a", "the first line must be a comment with 'UNITS: si'"),
    (ROW, "no_comment.evp a", "the first line must be a comment with 'UNITS: si'"),
    (ROW, "empty.evp a", "cannot read the potential file 'empty.evp'"),
    (ROW, "nul.evp a", "file nul.evp"),
    (ROW, "twice.evp a", "file twice.evp line 3: row 'a' is given twice"),
    (ROW, "short.evp a", "file short.evp line 2: expected 9 values"),
    (ROW, "damaged.evp b", "file damaged.evp line 3: e2 must be a finite decimal number, got 'x'"),
    # fix evp/bonds
    ("evp/bonds", "evp/bonds zone 1", "Fix bonds evp/bonds: zone must be greater than 1"),
    ("evp/bonds", "evp/bonds zone -1.5", "Fix bonds evp/bonds: zone must be greater than 1"),
    ("evp/bonds", "evp/bonds zone nan", "Fix bonds evp/bonds: zone must be a finite decimal number, got 'nan'"),
    ("evp/bonds", "evp/bonds zone", "Fix bonds evp/bonds: keyword zone needs a value"),
    ("evp/bonds", "evp/bonds skin 1.2", "Fix bonds evp/bonds: unknown keyword 'skin'"),
    ("evp/bonds", "evp/bonds zone 1.6", "zone 1.6 reaches beyond what the neighbor list can see, alpha = 1.5"),
    ("evp/bonds", "evp/bonds\nfix more all evp/bonds", "Fix more evp/bonds: fix bonds records bonds already"),
    ("fix move", "pair_style zero 0.02\npair_coeff * *\nfix move", "evp/bonds needs pair style evp/lj, found 'zero'"),
    ("fix move", "pair_style none\nfix move", "Fix bonds evp/bonds needs pair style evp/lj, found 'none'"),
    ("fix move", "run 0\npair_style zero 0.02\npair_coeff * *\nfix move", "needs pair style evp/lj, found 'zero'"),
    ("fix move", "run_style respa 2 2\nfix move", "does not work with run_style respa"),
    # atoms
    ("row.data", "types.data\npair_style evp/lj\npair_coeff 1 1 " + ROW + "\npair_coeff 2 2 " + ROW
     + "\nfix move all nve\nrun 1\n", "does not mix unlike types: give 'pair_coeff 1 2' a row of its own"),
    ("row.data", "types.data\npair_style evp/lj\npair_coeff 2* 1 " + ROW, "2* 1 names no pair of types I <= J"),
    ("row.data", "zero.data", "needs particles with a radius above zero"),
    ("row.data", "point.data", "Fix bonds evp/bonds: " + COINCIDE),
    ("fix move", "special_bonds lj 0 0.5 1\nfix move", "takes special_bonds weights 0 or 1 only, got 0.5"),
    ("boundary f f f\nread_data row.data", "boundary f p f\nread_data close.data", IMAGES),
    ("boundary f f f\nread_data row.data", "boundary f p f\nread_data near.data", "less than two cutoffs of 0.015"),
    ("fix move", "run 0\ngroup gone id 2 4\ndelete_atoms group gone\nfix move", "Fix bonds evp/bonds: atom ID"),
    # computes
    ("fix move", "compute dt all evp/dt 3\nfix move", "Compute dt evp/dt: unexpected argument '3'"),
    ("fix move", "compute s all evp/state/atom x\nfix move", "Compute s evp/state/atom: unknown keyword 'x'"),
    ("fix bonds all evp/bonds", "pair_style zero 0.02\npair_coeff * *\ncompute dt all evp/dt",
     "Compute dt evp/dt needs pair style evp/lj, found 'zero'"),
    ("fix bonds all evp/bonds", "pair_style zero 0.02\npair_coeff * *\ncompute s all evp/state/atom",
     "Compute s evp/state/atom needs pair style evp/lj, found 'zero'"),
]


@pytest.mark.parametrize("old, new, text", CASES, ids=[text[:40] for _, _, text in CASES])
def test_one_clear_error(run, old, new, text):
    refused(run(old, new), text)


ATOMIC = GOOD.replace("sphere", "atomic").replace("read_data row.data", """
region box block 0 0.1 0 0.1 0 0.1
create_box 1 box
create_atoms 1 single 0.05 0.05 0.05
create_atoms 1 single 0.06 0.05 0.05
mass 1 0.001""")


def test_atoms_without_a_radius_or_without_ids(run):
    refused(run("", ATOMIC), "Pair evp/lj needs particles with a radius: use 'atom_style sphere'")
    nameless = ATOMIC.replace("atomic", "sphere").replace("map yes", "id no").replace("mass 1 0.001", "")
    refused(run("", nameless), "needs atom IDs: remove 'atom_modify id no'")


def test_pair_without_the_fix_sees_spheres_at_one_point(run):
    text = GOOD.replace("fix bonds all evp/bonds", "")
    refused(run("", text.replace("row.data", "point.data")), "Pair evp/lj: " + COINCIDE)


@pytest.mark.parametrize("old, new, text", [
    ("row.data", "point.data", COINCIDE),
    ("boundary f f f\nread_data row.data", "boundary f p f\nread_data close.data", IMAGES),
    (ROW, "missing.evp a", "cannot read the potential file"), (ROW, "nul.evp a", "file nul.evp")])
def test_all_ranks_stop(run, old, new, text):
    """Errors that one rank meets alone, or that arise while ranks share a file, end the whole run."""
    result = run(old, new, ranks=3)
    refused(result, text)


def test_radii_that_grow_in_a_run(run):
    """fix adapt on the diameter, with lists built at every step: stopped at the first list that could miss a pair.
    Control: shrinking radii are fine."""
    text = GOOD.replace("check yes", "check no").replace("style sphere", "style sphere 1").replace(
        "run 3", "variable d equal 0.01{}0.0001*step\nfix grow all adapt 1 atom diameter v_d\nrun 3")
    result = run("", text.format("+"))
    assert result.returncode != 0 and GREW in result.stdout
    run("", text.format("-")).ok()


@pytest.mark.parametrize("key, value, text", [
    ("integrator", "euler", "integrator must be explicit or implicit, got euler"),
    ("scale", "maybe", "scale must be yes or no, got maybe"),
    ("rate", "0", "rate and strain must not be 0"),
    ("row", "0", "row must be positive, got 0"), ("samples", "2.5", "samples must be a positive integer, got 2.5"),
    ("plasticity", "plastic", "plasticity must be none"),
    ("break", "far", "break must be a finite decimal number, got 'far'"),
    ("kv", "-1", "kv must be 0 or positive, got -1"),
    ("contact", "soft", "contact must be literal, repulsive or none, got 'soft'"),
    ("specimen", "missing.data", "missing.data"),
    ("coeff", "80 4 8 3 8 4 0.005 0 1.5", "m1 > n1 > 0, got m1 = 4 and n1 = 8"),
    ("length", "50", "not from 0 to length = 50 m; correct the given length, radius or area"),
    ("radius", "-1", "read_evp_body: radius must be positive, or 0 where it is not given, got -1"),
    ("coeff", "80 8 4 3 8 4 0.005 0", "read_evp_row: expected 9 values, got 8")])
def test_traction_deck(lmp, tmp_path, key, value, text):
    from common_bodies import REFERENCE
    result = lmp("in.traction", variables={"specimen": REFERENCE, key: value})
    assert result.returncode != 0 and text in result.stdout, result.stdout
    assert not (tmp_path / "traction.csv").exists()
