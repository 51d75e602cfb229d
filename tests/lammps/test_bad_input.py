# SPDX-License-Identifier: GPL-2.0-only
"""Bad input gets one clear error that names style, key, value, rule and remedy, before the first step, on all MPI ranks together.

A program that uses LAMMPS as a library tries all of the table, one after the other, and goes on: one process for each number of ranks. What the
readers of rows and bond files alone can see is told apart in tests/unit; here it has to reach the user."""

import json
import random
import struct

import numpy as np
import pytest
from hostile import BONDS, PARTS, PLANE, ROW, refused, scene
from lammps_run import DECKS, REFERENCE, run_lammps, write_data
from library import run_program

NUMBER = "must be a finite decimal number, got"
STYLE = "pair_style evp/lj contact repulsive "
FLOWS, BREAKS = STYLE + "plasticity isotropic", STYLE + "break 0.1"
COEFF = "pair_coeff * * "
FIX = PARTS["fix"] + " "
DAMPED = COEFF + "80 8 4 3 8 4 0.005 1000 1.5"
NO_STYLE = {"style": "pair_style none", "coeff": "", "fix": "", "thermo": ""}
ZERO = {"style": "pair_style zero 0.02", "coeff": "pair_coeff * *", "fix": "", "thermo": ""}
RESPA = "run_style respa 2 2"
NVE = "fix move all nve\n"
SECOND = "can be one sub-style of pair_style hybrid only"
NEEDS = "needs fix evp/bonds, which stores the history of the bonds"
STIFFER = "plasticity isotropic needs a 'flow' table, or a second regime less stiff than the first"

# ---- files that the scenes read

HEAD = b"# DATE: 2026-01-01 UNITS: si CITATION: none\n"
ROWS = HEAD + f"a {ROW}\nb 50 6 3 5 8 4 0.01 0 1.4 spacing 0.009 coordination 12\n".encode()
GARBAGE = random.Random(20170515).randbytes(4000)
WHOLE, SPHERE = "1 2 0.0101", "sphere {} 0.1 0.5 0 5 5"
COLUMNS = " COLUMNS: plastic_strain,plastic_work,slip,bonds,recorded"


def bonds(*lines, count=None, header=""):
    count = len(lines) if count is None else count
    return (f"# EVP bonds COUNT: {count}{header} UNITS: si\n" + "".join(f"{line}\n" for line in lines)).encode()


LATE = ["# 1 2 0.0101"] * 10_000  # lines; more than one message between the ranks holds
FILES = {
    "good.evp": ROWS, "lj.evp": ROWS.replace(b"si", b"lj", 1), "empty.evp": b"", "garbage.evp": GARBAGE, "big.evp": HEAD + b"#" * (1 << 20),
    "wide.evp": HEAD + b"a" + b" 1" * 500_000 + b"\n", "many.evp": HEAD + b"".join(f"r{k} {ROW}\n".encode() for k in range(1000)),
    "empty.bonds": b"", "garbage.bonds": GARBAGE, "wide.bonds": bonds("1 " * 1_000_000), "negative.bonds": bonds("1 2 -0.0101"),
    "self.bonds": bonds("2 2 0.0101"), "unknown.bonds": bonds("1 13 0.0101"), "wraps.bonds": bonds("1 4294967298 0.0101"),
    "turned.bonds": bonds("1 2 0.0101", "2 1 0.0102"), "late.bonds": bonds("1 2 0.0101", *LATE, "1 2 0.0101", count=2), "group.bonds": bonds("1 2 0.0101", "3 4 0.0101"),
    "contact.bonds": bonds("contact 1 13 0.01", count=0, header=" CONTACTS: 1"), "older.bonds": bonds("1 2 0.0101 0 0 0 0"),
    "flowed.bonds": bonds(WHOLE, SPHERE.format(1), count=1, header=" SPHERES: 1" + COLUMNS), "pushed.bonds": bonds("contact 1 2 0.0099", count=0, header=" CONTACTS: 1"),
    "sphere.bonds": bonds(SPHERE.format(13), count=0, header=" SPHERES: 1" + COLUMNS), "spheres.bonds": bonds(SPHERE.format(1), SPHERE.format(1), count=0, header=" SPHERES: 2" + COLUMNS),
    "broken.bonds": bonds("apart 1 2 0.01", count=0, header=" CONTACTS: 1 ENDED: 1"), "one.bonds": bonds("1 2 0.0101"), "three.bonds": bonds("3 4 0.0101"),
    "type.bonds": bonds("1 2 0.0101", header=" WITHIN: type"), "molecule.bonds": bonds("1 2 0.0101", header=" WITHIN: molecule"),
    "body.bonds": bonds("1 2 0.0101", header=" WITHIN: body"),
    **{f"measured{k}.bonds": bonds("1 2 0.0101", header=f" MEASURED: {words}") for k, words in enumerate(("1,0.01,0", "2,0.01,12", "1,0.01"))},
}

# ---- words after a command, and what is said

WORDS = {
    "pair_style evp/lj {}": ("style", [
        ("contact sticky", "contact must be literal, repulsive, none or join, got 'sticky'"), ("contact {}", "contact must be literal, repulsive, none or join, got '{}'"),
        ("contact join", "'contact join' needs 'plasticity isotropic'"), ("contact join 0.9 plasticity isotropic", "a distance over R_i + R_j of 1 or more, got 0.9"),
        ("contact join 1.2 every plasticity isotropic", "unknown keyword 'every'"), ("contact join all 1.2 plasticity isotropic", "unknown keyword '1.2'"),
        ("contact join 1.45 plasticity isotropic", "contact join 1.45 needs an alpha above 1.522"),
        ("contact", "Pair style evp/lj: keyword contact needs a value"), ("CONTACT none", "unknown keyword 'CONTACT'; it takes contact and overlap"),
        ("overlap nan", f"Pair style evp/lj: overlap {NUMBER} 'nan'"), ("overlap 0", "overlap must lie in (0, 1]"), ("overlap 1.1", "overlap must lie in (0, 1]"),
        ("overlap 0.3 0.4", "unknown keyword '0.4'"), ("plasticity", "keyword plasticity needs a value"),
        ("plasticity plastic", "plasticity must be none"), ("plasticity isotropic", "contact literal"), ("break", "keyword break needs a value"),
        *((f"break {word}", "break must be none or a positive strain, at which bonds break for good") for word in ("0", "-1", "-0.0")),
        ("break 5%", f"break {NUMBER} '5%'"), ("break None", f"break {NUMBER} 'None'"),
        *((f"plasticity isotropic update {word}", "Pair style evp/lj: update must be an integer from 1 to 1e9 (steps between two updates of plastic strains") for word in ("0", "-10", "2.5")),
        ("plasticity isotropic update ten", f"update {NUMBER} 'ten'"), ("update", "keyword update needs a value"),
        *((f"{words} 40", "'update 40' needs 'plasticity isotropic', without which there are no plastic strains") for words in ("update", "break 0.1 update"))]),
    "pair_coeff {}": ("coeff", [
        ("* *", "Pair evp/lj: expected 9 values, got 0 (a row has e1 m1"), ("* * 80", "Pair evp/lj: expected 9 values, got 1 (a row has e1 m1"),
        (ROW, "Pair evp/lj: expected 9 values, got 7 (a row has e1 m1 n1 e2 m2 n2 xi_s gamma alpha)"), ("0 1 " + ROW, "Invalid range string: 0"),
        ("1 one " + ROW, "Invalid range string: one"), ("2 2 " + ROW, "Numeric index 2 is out of bounds")]),
    COEFF + "{}": ("coeff", [
        ("nan" + ROW[2:], f"Pair evp/lj: e1 {NUMBER} 'nan'"), ("9" * 5000 + ROW[2:], f"e1 {NUMBER} '{'9' * 40}...'"),
        ("8O 8", "cannot read the potential file '8O': give its path, or put its folder into LAMMPS_POTENTIALS; a row of numbers has e1 m1"),
        ("good.evp", "expected FILE:ROW, a potential file and the name of a row, got"), ("evp/lj " + ROW, "Pair evp/lj: expected 9 values, got 10"),
        ("good.evp c", "file good.evp has no row 'c'; its rows: a, b"), ("good.evp:c", "file good.evp has no row 'c'; its rows: a, b"), ("good.evp:", "expected FILE:ROW"),
        *((f"good.evp {name}", f"has no row '{shown}'; its rows") for name, shown in (("%s%n", "%s%n"), ("x" * 300, "x" * 40 + "..."), ("\x1b[31m", "?[31m"), ('""', ""))),
        *((f"{file} a", f"cannot read the potential file '{file}'") for file in ("missing.evp", ".", "nowhere/p.evp", "loop.evp", "/proc/self/mem", "good.evp/p.evp", "empty.evp")),
        ("lj.evp a", "file lj.evp: the first line must be a comment with 'UNITS: si', the units in force, got 'lj'"), ("garbage.evp a", "file garbage.evp"),
        ("wide.evp a", "line 2: expected 9 values, got 500000"), ("many.evp a", "no row 'a'; its rows: r0, r1,"), ("big.evp a", "file big.evp")]),
    COEFF + ROW + " {}": ("coeff", [
        ("pitch 1", "unknown keyword 'pitch' of a row"), ("kv 1 density 2700 kv 1", "Pair evp/lj: keyword kv of a row is given twice: leave one out"),
        ("spacing 1", "spacing and coordination are given together"),
        ("damage 0.1 0.1 -1", "keyword damage needs a value more: damage_d4"), ("damage 0.1 0.1 -1 0 0", "damage and rupture are given together"),
        ("density 2700 rupture 1e-4", "damage and rupture are given together"), ("damage 0.1 0.1 -1 0 0 rupture 0", "damage needs density"),
        ("damage 0.1 0.1 1.5 0 0", "damage_d3 must be zero or negative, as a metal is less ductile under tension (tables that take compression as positive have the other sign), got 1.5"),
        ("damage 0.1 0.1 -1 0.01 0", "damage with D4 needs rate C RATE0 in front of it"), ("damage 0.1 0.1 -1 0 1", "damage with D5 needs soften TREF TMELT M in front of it"),
        *((f"rate 0.01 1 soften 298 775 1 damage {words}", f"{key} must be zero or positive, got -1") for words, key in (
            ("-1 0 0 0 0", "damage"), ("0 -1 0 0 0", "damage_d2"), ("0 1 0 0 -1", "damage_d5"))),
        ("rupture -1", "rupture must be zero or positive, got -1"), ("rupture energy 0", "rupture energy must be positive, got 0"), ("rupture energy", "keyword rupture energy needs a value"),
        ("rupture 1 rupture energy 1", "keyword rupture of a row is given twice: leave one out"), ("rupture work 1", f"rupture {NUMBER} 'work'"),
        *((f"flow {points}", f"flow needs 1 to 32 points of two numbers, plastic strain and limit over xi_s, got {count} numbers")
          for points, count in (("", 0), ("0 1 0.1", 3), ("0 1 0.1 x", 3), (66 * "1 ", 66))), ("flow 0 1 x", "unknown keyword 'x' of a row"),
        ("flow 0 2", "flow must begin with 0 1 (the limit xi_s at no plastic strain), got 0 2"), ("flow 0 1 0.1 1 0.1 2", "plastic strains of flow must ascend, got 0.1 after 0.1"),
        *((f"flow 0 1 0.1 {limit}", "limits of flow must be positive and below 37.8") for limit in ("0", "-1", "40")),
        ("spacing 1e-200 coordination 12", "for the spacing of the body e1 and e2 of the row are multiplied by inf")]),
    FIX + "{}": ("fix", [
        ("zone 1", "Fix bonds evp/bonds: zone must be greater than 1"), ("zone nan", f"Fix bonds evp/bonds: zone {NUMBER} 'nan'"), ("zone", "keyword zone needs a value"),
        ("zone 1.6", "zone 1.6 reaches beyond what the neighbor list can see, alpha = 1.5"), ("1.2", "unknown keyword '1.2'; it takes zone or file"),
        ("file", "keyword file needs a value"), ("zone 1.2 file one.bonds", "the bonds come from the zone or from a file"),
        ("within", "keyword within needs a value"), ("new", "keyword new needs a value"), ("new maybe", "new must be yes (atoms that come later get bonds where they come) or no, got maybe"),
        ("events nowhere/e.txt", "Fix bonds evp/bonds: cannot write the file of events 'nowhere/e.txt': check the folder"),
        ("events e.txt", "events are those of bonds that end or begin, which the pair_style in force does not have: give it 'plasticity isotropic' or 'break'"),
        ("within TYPE", "within must be type or molecule (which atoms are one body), got 'TYPE'"), ("WITHIN type", "unknown keyword 'WITHIN'; it takes zone or file or within"),
        ("within molecule", "Fix bonds evp/bonds: within molecule needs atoms with molecule IDs: define 'fix ID all property/atom mol ghost yes' before it")]),
    FIX + "file {}": ("fix", [
        *((name, f"Fix bonds evp/bonds: cannot read the bond file '{name}': give its path") for name in ("nowhere.bonds", "nowhere/b.bonds", "loop.bonds")),
        *((name, f"Fix bonds evp/bonds: the bond file is empty or cannot be read (file '{name}')") for name in (".", "/proc/self/mem", "empty.bonds")),
        ("garbage.bonds", "Fix bonds evp/bonds: bond file line 1: expected the header '# EVP bonds COUNT: 0 UNITS: si'"),
        ("wide.bonds", "line 2: expected 'id_i id_j deq', got 1000000 values"), ("negative.bonds", "line 2: deq must be positive, got -0.0101"),
        ("self.bonds", "bond 2 2 is given twice in file self.bonds"),
        ("unknown.bonds", "bond 1 13: there is no atom 13: read the data file that was written with the bond file"), ("wraps.bonds", "there is no atom 4294967298:"),
        ("turned.bonds", "bond 1 2 is given twice in file turned.bonds"), ("late.bonds", "bond 1 2 is given twice in file late.bonds"),
        ("contact.bonds", "there is no atom 13"),
        ("older.bonds", "line 2: expected 'id_i id_j deq', got 7 values; contact, apart, inside or joined may stand before them"),
        ("flowed.bonds", "sphere 1: it has flowed: use pair_style evp/lj with 'plasticity isotropic', as when the file was written"),
        ("pushed.bonds", "bond 1 2: it has flowed: use pair_style evp/lj with 'plasticity isotropic', as when the file was written"),
        ("broken.bonds", "bond 1 2: it has broken: use pair_style evp/lj with 'break' and 'plasticity none', as when the file was written"),
        ("body.bonds", "bond file line 1: within must be type or molecule (which atoms are one body), got 'body'"),
        ("molecule.bonds", "within molecule needs atoms with molecule IDs"),
        *((f"measured{k}.bonds", "bond file line 1: MEASURED must be 1 and for each pair of types spacing and coordination, both positive or both zero") for k in range(3))]),
    FIX + "\nfix volume all evp/volume {}": ("fix", [
        ("", "Fix volume evp/volume: expected one KV, or one for each of the 1 atom types, got 0"), ("1 2", "expected one KV, or one for each of the 1 atom types, got 2"),
        ("-1", "KV must lie between 0 and 1e100 (an energy per atom), got -1"), ("1e200", "KV must lie between 0 and 1e100"), ("rows", f"KV {NUMBER} 'rows'"),
        ("row 3", "or the word row"), ("10 cavitation 0", "cavitation must be a volume strain above 0, or none"), ("10 across maybe", "across must be yes or no"),
        ("10\nfix more all evp/volume 20", "Fix more evp/volume: fix volume is of this style too, but only one is allowed"),
        ("10\nfix e all evp/energy\nfix more all evp/energy", "Fix more evp/energy: fix e is of this style too, but only one is allowed")]),
    "fix_modify bonds {}": ("then", [
        ("plastic_strain all", "Fix bonds evp/bonds: fix_modify plastic_strain needs a group and a plastic strain"),
        ("plastic_strain none 0", "fix_modify plastic_strain: there is no group 'none'"), ("plastic_strain all -1", "plastic_strain must be zero or positive, got -1"),
        ("plastic_strain all 0", "fix_modify plastic_strain needs 'plasticity isotropic' of the pair style")]),
    "fix move all nve/evp {}": ("move", [
        ("tol 0", "tol must lie between 0 and 1"), ("tol 1", "tol must lie between 0 and 1"), ("tol small", "tol"), ("maxiter 2.5", "maxiter must be an integer"),
        ("steps 5", "unknown keyword 'steps'"), ("tol", "keyword tol needs a value")]),
    NVE + "fix step all dt/evp {}": ("move", [
        ("20", "expected N fraction [max DT] [displacement F], got 1 arguments"), ("20 0.4 most 1", "unknown keyword 'most'; it takes max and displacement"),
        ("0 0.4", "N must be a positive integer"), ("2.5 0.4", "N must be a positive integer"), ("20 0", "fraction must lie between 0 and 1"),
        ("20 1", "fraction must lie between 0 and 1"), ("20 0.4 max -1e-7", "max must be positive"), ("20 0.4 displacement 0", "displacement must be positive"),
        ("20 0.4 displacement", "keyword displacement needs a value")]),
    NVE + "fix energy {}": ("move", [("all evp/energy 5", "unexpected argument '5'"), ("one evp/energy", "needs group all")]),
    "compute s all evp/{}": ("then", [
        ("dt 3", "Compute s evp/dt: unexpected argument '3'"), ("state/atom x", "Compute s evp/state/atom: unknown keyword 'x'; it takes volume_strain, von_mises, triaxiality, bonds_now, "),
        ("state/atom von_mises", "von_mises needs 'fraction'"), ("state/atom von_mises fraction", "keyword fraction needs a value"),
        ("state/atom von_mises fraction 1.1", "fraction must be above 0 and at most 1")]),
    "read_evp_row {}": ("then", [
        (f"{ROW} m body nobody 1 0.5", "body: there is no group 'nobody'"), (f"{ROW} m body all 1 58.5", "body: the solid fraction must lie between 0 and 1, got 58.5"),
        (f"{ROW} m body all -1 0.5", "body: the volume must be positive, got -1"), (f"{ROW} m body all 1 0.5", "the spheres of group all have a volume of")]),
    "write_evp_bonds {}": ("then", [
        ("", "write_evp_bonds: expected one argument, the file to write"), ("a.bonds b.bonds", "expected one argument, the file to write"),
        ("a.bonds", "fix bonds has not recorded yet")]),
    "units si\nread_evp_row {}": ("units", [
        ("good.evp:a", "read_evp_row: expected at least two arguments"), ("good.evp m", "read_evp_row: expected FILE:ROW"),
        ("good.evp:a m-1", "must have only letters, numbers, or underscores"), ("lj.evp:a m", "'UNITS: si', the units in force, got 'lj'"),
        ('"" m', "read_evp_row: expected 9 values, got 0"), ("good.evp:a kv 300 m", "read_evp_row: expected 9 values, got 3"),
        (f"{ROW} m body all 1 0.5", "read_evp_row: body: there are no spheres yet"),
        ("absent.evp:a m", "read_evp_row: cannot read the potential file 'absent.evp'")]),
    "units lj\nread_evp_row {}": ("units", [(f"{ROW} m body all 1 0.5", "body is about that of the paper, in units si")]),
    "variable s index -1.5\nevp_choices {}": ("units", [
        ("in.x", "evp_choices: expected at least two arguments, the name of the input script and its choices, got 1"), ("in.x t", "in.x: there is no variable 't'"),
        ("in.x s=a|b", "in.x: -var s must be a or b, got '-1.5'"), ("in.x s=a,integer,>-2", "in.x: -var s must be a or an integer > -2, got '-1.5'"),
        *((f"in.x s{rule}", f"in.x: -var s must be a number {said}, got '-1.5'") for rule, said in (
            (">=0,!=2", ">= 0 and != 2"), ("<-1.5,number", "< -1.5"), ("<=-2", "<= -2"), ("!=-1.5", "!= -1.5"))),
        ("in.x t? t=a", "in.x: there is no variable 't'"), ("in.x implied s", "evp_choices: implied takes coeff, plasticity, contact, not 's'"),
        *((f"in.x s{rule}", f"in.x: choice s: unknown rule '{rule.lstrip(',')}'") for rule in (">a", "<>1", "=", ",odd"))]),
}

# ---- other scenes

KNOWN = "fix molecules all property/atom mol ghost yes\n"
TWO_TYPES = PARTS["box"].replace("create_box 1", "create_box 2")
MARKED = f"set atom 2 type 2\n{KNOWN}set atom 1 mol 7\nset atom 2 mol 12\n{FIX}file "
OF_TWO = "its atoms are not of one {0}, but 'within {0}' is in force: give them the {0}s that they had"
FLAT = {"box": PLANE, "move": "fix flat all enforce2d\nfix move all nve", "coeff": COEFF + "80 8 4 3 8 4 0.005 0 1.2"}
SOLID = "holds for three-dimensional bodies, but 'dimension 2' is in force: use 'dimension 3', or "
EARLY = "fix even all balance 2 1.0 shift x 5 1.0\n" + FIX
TILTED = PARTS["box"].replace("f f f", "p p p").replace("region box block 0 3 0 2 0 2", "region box prism 0 5 0 5 0 5 0 0 0")
HERE = {"box": TILTED, "coeff": DAMPED}
SEEN = {"stepped": True}  # there was a run before
ALONE = {"alone": True}  # on several ranks the message ends the program, as one rank meets it alone
NAN = "variable nan atom 1e308*10-1e308*10\nset atom 1 "

OTHERS = [
    # the pair style
    ({"style": "pair_style hybrid/overlay evp/lj evp/lj", "coeff": f"pair_coeff * * evp/lj 1 {ROW}\npair_coeff * * evp/lj 2 {ROW}"}, SECOND),
    *(({"style": f"pair_style hybrid/scaled {scale} {styles}", "coeff": f"pair_coeff * * evp/lj {ROW}\npair_coeff * * zero"},
       "Pair evp/lj does not work in pair_style hybrid/scaled, which multiplies forces but not energies, damping, flow and the stable timestep: use hybrid/overlay")
      for scale, styles in (("0.5", "evp/lj contact repulsive 0.5 zero 1.0 nocoeff"), ("1.0", "evp/lj contact repulsive plasticity isotropic 1.0 zero 1.0 nocoeff"),
                            ("1.0", "zero 1.0 nocoeff 2.0 evp/lj"))),
    ({"coeff": ""}, "pair coeffs are not set"), ({"units": "units si\npair_coeff * * " + ROW}, "simulation box is defined"),
    ({"box": TWO_TYPES, "coeff": f"pair_coeff 1 1 {ROW}\npair_coeff 2 2 {ROW}"}, "does not mix unlike types: give 'pair_coeff 1 2' a row of its own"),
    ({"box": TWO_TYPES, "coeff": f"pair_coeff 2* 1 {ROW}"}, "2* 1 names no pair of types I <= J"),
    ({"coeff": DAMPED, "move": "fix move all nve/evp", "after": "delete_atoms group one compress no\npair_modify compute no\nrun 2", **SEEN},
     "has not seen the current neighbor list"),
    *(({"then": "compute whole all group/group all", "after": f"run 0\n{ask}\nprint $(c_whole)", **SEEN}, "has not seen the current neighbor list yet: use 'run 0'")
      for ask in ("pair_write 1 1 20 r 0.005 0.015 table.txt EVP", "write_restart r.restart", "balance 1.0 shift x 5 1.1")),
    ({"style": FLOWS, "fix": "", "thermo": ""}, "plasticity isotropic " + NEEDS), ({"style": BREAKS, "fix": "", "thermo": ""}, "break " + NEEDS),
    ({"style": FLOWS, "fix": "", "thermo": "", "run": "minimize 0 1e-9 10 10"}, "plasticity isotropic " + NEEDS),
    *(({"style": style, **parts}, "'break 0.1' is for 'plasticity none'; with 'plasticity isotropic' leave it out, and add 'damage 0.1 0 0 0 0 rupture 0' to the row (pair_coeff), with 'density'")
      for style, parts in ((FLOWS + " break 0.1", {}), (BREAKS + " plasticity isotropic", {"fix": "", "thermo": ""}))),
    ({"style": FLOWS, "fix": FIX + "\nrun 0\nunfix bonds", "thermo": ""}, "plasticity isotropic " + NEEDS),
    ({"style": FLOWS, "coeff": COEFF + "80 8 4 80 8 4 0.005 0 1.5"}, STIFFER), ({"style": FLOWS, "after": COEFF + "80 8 4 200 8 4 0.005 0 1.5\nrun 1", **SEEN}, STIFFER),
    ({"style": FLOWS, "then": "variable stiff equal 3+100*step\nfix stiffer all adapt 1 pair evp/lj e2 * * v_stiff", **SEEN}, STIFFER),
    ({"coeff": "pair_coeff * * 1e150 8 4 3 8 4 0.005 0 1.5 spacing 1e-60 coordination 12"}, "for the spacing of the body e1 and e2 of the row are multiplied by"),
    ({"coeff": f"{COEFF}{ROW} kv 1e99 spacing 1e-5 coordination 12", "then": "fix v all evp/volume row"}, "kv must not exceed 1e100 in the body"),
    *(({"style": style, "then": "dump all all custom 1 all.dump id x y z vx vy vz", "after": "rerun all.dump dump x y z vx vy vz", **SEEN},
       "rerun does not know how bonds have flowed or ended") for style in (FLOWS, BREAKS)),
    ({"then": "variable a equal 1.5+0.1*step\nfix change all adapt 1 pair evp/lj alpha * * v_a", **SEEN}, "alpha"),
    ({"then": "variable m equal 4+10^(-step-1)\nfix change all adapt 1 pair evp/lj m2 * * v_m", **SEEN},
     "Pair evp/lj, types 1 and 1: exponents too close: m2 - n2 = 0.0001, must be at least 0.00040001"),
    # run styles
    *(({"then": RESPA, **parts}, "run_style respa") for parts in ({}, {"style": FLOWS}, {"fix": FIX + "\nfix v all evp/volume 1"})),
    *(({"move": f"{move}\n{RESPA}"}, "respa") for move in ("fix move all nve/evp", NVE + "fix step all dt/evp 20 0.4", NVE + "fix energy all evp/energy")),
    # fix evp/bonds
    ({"units": "units si\nfix bonds all evp/bonds"}, "before simulation box is defined"), ({"fix": "fix bonds nobody evp/bonds"}, "Could not find fix group ID nobody"),
    ({"then": "fix more all evp/bonds"}, "Fix more evp/bonds: fix bonds is of this style too, but only one is allowed"),
    ({**ZERO, "fix": FIX}, "Fix bonds evp/bonds needs pair style evp/lj, found 'zero'"), ({**NO_STYLE, "fix": FIX}, "needs pair style evp/lj, found 'none'"),
    ({"after": "pair_style zero 0.02\npair_coeff * *\nrun 1", **SEEN}, "needs pair style evp/lj, found 'zero'"),
    ({"fix": "group first id 1 2 3\nfix bonds first evp/bonds file group.bonds"}, "bond 3 4: atom 4 is not in the fix's group: use a group with all bonded atoms (bond file group.bonds)"),
    ({"fix": FIX + "file turned.bonds", "run": "minimize 0 1e-9 10 10"}, "bond 1 2 is given twice in file turned.bonds"),
    *(({"style": BREAKS, "fix": FIX + f"file {name}.bonds"}, "it has flowed: use pair_style evp/lj with 'plasticity isotropic'") for name in ("flowed", "pushed")),
    ({"style": FLOWS, "fix": FIX + "file broken.bonds"}, "it has broken: use pair_style evp/lj with 'break' and 'plasticity none'"),
    *(({"style": FLOWS, "fix": FIX + f"file {name}.bonds"}, "a line 'sphere ...' names an atom that is not there, or twice") for name in ("sphere", "spheres")),
    ({"then": "compute state all evp/state/atom volume_strain"}, "volume_strain is that of fix evp/volume: define it"),
    ({"after": "group gone id 2 4\ndelete_atoms group gone\nrun 1", **SEEN}, "Fix bonds evp/bonds: atom ID"),
    *(({"style": style, "fix": EARLY}, "must be defined before fix even balance") for style in (FLOWS, BREAKS)),
    *(({"style": BREAKS, "box": TILTED, "fix": f"region all block 0.01 0.02 0 0.01 0 0.01 units box\nfix early all {fix}\n{FIX}"}, "must be defined before fix early")
      for fix in ("evaporate 10 1 all 1", "deposit 1 1 10 1 region all", "deform 10 xy erate 1")),
    ({"then": "unfix bonds\nwrite_evp_bonds a.bonds", "thermo": ""}, "there is no fix evp/bonds"),
    ({"units": "units si\nwrite_evp_bonds b.bonds"}, "there is no fix evp/bonds, hence no bonds to write"),
    ({"then": "run 0\nreplicate 2 1 1"}, "Cannot replicate"),
    # bodies
    ({"fix": f"{KNOWN.replace('yes', 'no')}set group all mol 1\n{FIX}within molecule"}, "within molecule needs ghost atoms that know their molecule IDs"),
    ({"fix": f"{KNOWN}set group all mol 1\n{FIX}within molecule", "run": "run 0\nunfix molecules\nrun 1"}, "within molecule needs atoms with molecule IDs"),
    *(({"box": TWO_TYPES, "fix": MARKED + f"{file}.bonds {word}"}, "Fix bonds evp/bonds: bond", OF_TWO.format("molecule" if "molecule" in word + file else "type"))
      for file, word in (("one", "within type"), ("type", ""), ("one", "within molecule"), ("three", "within molecule"), ("molecule", ""))),
    # atoms
    ({"atoms": "atom_style atomic", "box": PARTS["box"].partition("set")[0] + "mass 1 0.001"}, "Pair evp/lj needs particles with a radius: use 'atom_style sphere'"),
    ({"map": "atom_modify id no", "one": ""}, "needs atom IDs: remove 'atom_modify id no'"), ({"then": "set atom 3 diameter 0"}, "needs particles with a radius above zero"),
    ({"then": "set atom 1 x 0.0101"}, "Fix bonds evp/bonds: atoms 1 and 2 coincide"),
    ({"fix": "", "then": "set atom 1 x 0.0101", "thermo": "", **ALONE}, "Pair evp/lj: atoms 1 and 2 coincide"),
    ({"box": PARTS["box"].replace("f f f", "f p f")}, "in two periodic images: the box must be longer than two"),
    ({"box": PARTS["box"].replace("f f f", "f p f").replace("0 3 0 2 0 2", "0 3 0 2.8 0 2")}, "less than two cutoffs of 0.015"),
    ({"atoms": "atom_style sphere 1", "neighbor": "neighbor 0.001 bin\nneigh_modify every 1 delay 0 check no",
      "then": "variable d equal 0.01+0.0001*step\nfix grow all adapt 1 atom diameter v_d", **SEEN}, "radii must not grow past the largest at the start of the run"),
    ({"then": NAN + "x v_nan", **ALONE}, "Non-numeric atom coords"), ({"then": NAN + "diameter v_nan"}, "Pair evp/lj needs particles with a radius above zero"),
    ({"then": "velocity all set 1e6 0 0", "run": "neigh_modify every 1 delay 0 check no\nrun 30", **SEEN}, "Lost atoms: original 12 current 0"),
    ({"step": "timestep 1e-2", "then": "velocity all ramp vx -1 1 x 0 0.02", "run": "run 100", **SEEN}, "Lost atoms: original 12"),
    ({"coeff": DAMPED, "then": "set atom 1 vx 1e307\nset atom 2 vx -1e307", "thermo": "thermo_style custom step press", **ALONE},
     "non-finite forces (NaN or Inf) at step 0", "last restart file: none"),
    ({"coeff": DAMPED, "move": "fix move all nve/evp tol 1e-12\nset atom 1 vx 1e200\nset atom 2 vx -1e200"}, "non-finite (NaN or Inf) velocities or forces at step 0 with timestep 1e-07"),
    # fix nve/evp
    ({**NO_STYLE, "move": "fix move all nve/evp"}, "needs pair style evp/lj"),
    ({"coeff": DAMPED, "move": "fix move all nve/evp", "step": "timestep 0"}, "nve/evp needs a timestep above 0, got 0"),
    ({"coeff": DAMPED, "move": "fix move all nve/evp\nfix too one nve/evp"}, "fix too is of this style too, but only one is allowed"),
    ({"coeff": DAMPED, "move": "fix move all nve/evp\nfix too one nve"}, "act on the same atoms"),
    ({"coeff": DAMPED, "move": "group rest subtract all one\nfix too one nve\nfix move rest nve/evp", **ALONE}, "is integrated by another fix"),
    ({"coeff": DAMPED, "move": "velocity all create 300 1 loop all\nvelocity all scale 1e21\nfix move all nve/evp maxiter 1", "step": "timestep 1e-5"},
     "did not converge in 1 iterations at step"),
    # fix dt/evp, fix evp/energy
    ({**NO_STYLE, "move": NVE + "fix step all dt/evp 20 0.4"}, "needs pair style evp/lj"),
    ({"move": "fix move all move linear 1 0 0\nfix step all dt/evp 20 0.4"}, "sets the timestep too, or cannot follow a changing one"),
    ({"style": "pair_style evp/lj contact none", "fix": "", "move": NVE + "fix step all dt/evp 20 0.4", "thermo": "thermo_style custom step"}, "give 'max DT'"),
    *(({"move": f"{NVE}fix a all dt/evp 10 0.4\nfix b one {other}"}, "sets the timestep too") for other in ("dt/evp 10 0.4", "dt/reset 10 1e-9 1e-7 1e-5")),
    ({**NO_STYLE, "move": NVE + "fix energy all evp/energy"}, "needs pair style evp/lj"),
    # a box that deforms
    ({**HERE, "move": "fix box all deform 1 xy erate 1 remap v\nfix move all nve/evp\nfix dt all dt/evp 10 0.4"}, "sets the timestep too, or cannot follow a changing one"),
    # computes, values
    *(({**ZERO, "then": f"compute s all evp/{style}"}, f"Compute s evp/{style} needs pair style evp/lj, found 'zero'") for style in ("dt", "state/atom")),
    ({**ZERO, "then": "fix volume all evp/volume 10"}, "Fix volume evp/volume needs pair style evp/lj, found 'zero'"),
    *(({"fix": fix, "thermo": ""}, "Fix v evp/volume needs fix evp/bonds") for fix in ("fix v all evp/volume 10", FIX + "\nfix v all evp/volume 10\nunfix bonds")),
    ({"coeff": f"{COEFF}{ROW} kv 1", "fix": "fix v all evp/volume row", "thermo": ""}, "needs fix evp/bonds"),
    ({"then": "compute dt all evp/dt\nprint $(c_dt)"}, "cannot be invoked before initialization by a run"),
    ({"then": "compute state all evp/state/atom", "after": "pair_style lj/cut 0.01\npair_coeff * * 1 1 0.01\nwrite_dump all custom s.dump id c_state[1]", **SEEN},
     "Compute state evp/state/atom needs the pairs of the current atoms"),
    ({"thermo": "compute dt all evp/dt\nthermo_style custom step c_dt[6]"}, "out-of-range"), ({"thermo": "thermo_style custom step f_bonds[9]"}, "out-of-range"),
    ({"units": "units si\nvariable m_kv index 3\nread_evp_row good.evp:a m"}, "there is a variable 'm_kv' already, which would be overwritten"),
    # two dimensions
    ({**FLAT, "then": "fix volume all evp/volume 300"}, f"Fix volume evp/volume: the volume strain {SOLID}leave the fix out"),
    ({**FLAT, "coeff": f"{COEFF}{ROW} spacing 0.0102 coordination 4"}, f"Pair evp/lj: the scaling of a row by 'spacing' and 'coordination' {SOLID}give the 9 numbers"),
    *(({**FLAT, "then": f"compute state all evp/state/atom plastic_work {value} fraction 0.6"}, f"evp/state/atom: {value} {SOLID}leave the value out")
      for value in ("von_mises", "triaxiality")),
]

CASES = [({part: command.format(word)}, text) for command, (part, cases) in WORDS.items() for word, text in cases] + OTHERS


def deck_of(parts):
    parts = {"one": "group one id 1\n", "move": PARTS["move"], **parts}
    parts["move"] = parts.pop("one") + parts["move"]
    return scene(**{name: text for name, text in parts.items() if name not in ("stepped", "alone")})


TRY_ALL = """
import json
found = []
for deck in json.load(open("decks.json")):
    tell("clear", LOAD)
    found.append((tell(deck), step()) if deck else None)
if first_rank:
    json.dump(found, open("found.json", "w"))
"""


def write_files(folder):
    for name, content in FILES.items():
        (folder / name).write_bytes(content)
    for name in ("loop.evp", "loop.bonds"):
        (folder / name).symlink_to(name)


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """Of a number of ranks: message and step of each case."""
    known = {}

    def get(ranks):
        if ranks not in known:
            folder = tmp_path_factory.mktemp("bad")
            write_files(folder)
            decks = ["" if ranks > 1 and "alone" in parts else deck_of(parts) for parts, *_ in CASES]
            (folder / "decks.json").write_text(json.dumps(decks), encoding="utf-8")
            run_program(TRY_ALL, folder, ranks)
            known[ranks] = json.loads((folder / "found.json").read_text(encoding="utf-8"))
            assert all((folder / name).read_bytes() == content for name, content in FILES.items()), "files are as they were"
        return known[ranks]

    return get


@pytest.mark.parametrize("ranks", [1, 2])
def test_one_clear_error_each(said, ranks):
    wrong = []
    for (parts, *texts), found in zip(CASES, said(ranks)):
        message, step = found or (" ".join(texts), 0)
        wrong += [f"{parts} lacks: {text}\n{message[:1000]}" for text in texts if text not in message]
        wrong += [f"{parts}: step {step}"] if step and "stepped" not in parts else []
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("number", [number for number, (parts, *_) in enumerate(CASES) if "alone" in parts])
def test_an_error_of_one_rank_ends_the_program(lmp, number):
    refused(lmp(deck_of(CASES[number][0]), ranks=2), *CASES[number][1:])


def test_the_program_lmp_ends_with_status_1(lmp, tmp_path):
    """On three ranks, and no file is poured over the terminal."""
    write_files(tmp_path)
    run = lmp(deck_of({"coeff": COEFF + "garbage.evp a"}), ranks=3)
    refused(run, "file garbage.evp")
    assert len(run.stdout) < 20_000


ABOVE = "must be a number "
WAYS = "must be explicit or implicit"
OF_DECKS = {
    "in.traction": [("temperature", -1, ABOVE + ">= 0"), ("dtfraction", 3, ABOVE + "> 0 and <= 1"), ("strain", "2%", ABOVE + "!= 0 and > -1"), ("rate", 0, ABOVE + "!= 0"),
                    ("integrator", "implizit", WAYS)],
    "in.cyclic": [("cycles", 1.5, "must be an integer >= 1"), ("lower", "releas", "must be release or a number != 0.02 and > -1"), ("rate", "0.0", ABOVE + "!= 0")],
    "in.quasistatic": [("resume", "Yes", "must be yes or no"), ("strain", 0, ABOVE + "!= 0 and > -1"), ("cycles", -1, "must be an integer >= 0"),
                       ("lower", "Release", "must be release"), ("lower", 0.02, "must be release or a number != 0.02"), ("pace", 0, ABOVE + "> 0")],
    "in.torsion": [("angle", 0, ABOVE + "!= 0")], "in.bending": [("increment", 0, ABOVE + "> 0")],
    "in.indent": [("depth", -0.001, ABOVE + "> 0"), ("tool", "bal", "must be ball or flat")], "in.upset": [("strain", -0.3, ABOVE + "> 0 and < 1")],
    "in.extrude": [("ratio", 0.9, ABOVE + "> 1"), ("angle", 95, ABOVE + "> 0 and < 90")], "in.vbend": [("span", 1.2, ABOVE + "> 0 and < 1")],
    "in.blank": [("punch", 0.95, ABOVE + "> 0 and < 0.9"), ("clearance", 0, ABOVE + "> 0 and < 0.5")],
    "in.press": [("axis", "w", "must be x or y or z"), ("base", "glue", "must be plane or held"), ("travel", 0, ABOVE + "> 0")],
    "in.weld": [("press", 0.8, ABOVE + ">= 0 and < 0.7"), ("cut", "half", "must be yes or no")],
    "in.shear": [("rate", 0, ABOVE + "> 0")], "in.taylor": [("integrator", "verlet", WAYS)], "in.impact": [("friction", "on", "must be off or a number >= 0")],
    "in.sliding": [("normal", "jkr", "must be hooke or hertz")], "in.two_spheres": [("rows", 0, "must be an integer >= 1")],
    "in.slab": [("layer", 0.5, ABOVE + "> 0 and < 0.5"), ("temperature_left", 300, ABOVE + "> 0 and != 300"), ("temperature_right", 0, ABOVE + "> 0")],
    "in.adiabatic": [("temperature", 0, ABOVE + "> 0"), ("taylor", 2, ABOVE + ">= 0 and <= 1")],
    "in.specimen": [("shape", "cube", "must be cylinder or block or sheet or region or periodic or mesh")],
}


@pytest.mark.parametrize("deck", OF_DECKS)
def test_a_choice_that_means_nothing(tmp_path, deck):
    for name, value, rule in OF_DECKS[deck]:
        refused(run_lammps(deck, 1, {name: value}, tmp_path), f"ERROR: {deck}: -var {name} {rule}", f", got '{value}'")


def test_metal_does_not_break(tmp_path):
    """What a deck says is what the pair style says."""
    choices = {"specimen": REFERENCE, "plasticity": "isotropic", "contact": "repulsive", "break": 0.05}
    refused(run_lammps("in.traction", 1, choices, tmp_path), "'break 0.05' is for 'plasticity none'", "add 'damage 0.05 0 0 0 0 rupture 0' to the row (pair_coeff), with 'density'")


def test_material_or_coefficients(tmp_path):
    """By one line of all decks."""
    refused(run_lammps("in.traction", 1, {"material": "a.evp:b", "coeff": "80 8 4 3 8 4 0.005 0 1.5"}, tmp_path), "ERROR: in.traction: give -var material or -var coeff, not both")
    assert sum(f"\nevp_choices {deck} implied coeff " in (DECKS / deck).read_text(encoding="utf-8") for deck in OF_DECKS) == len(OF_DECKS) - 2


# ---- controls: what is legal

DEFAULT = f"recorded {BONDS} pairs within alpha"
STATE = "thermo_style custom step pe f_bonds f_bonds[5]"
LEGAL = [  # scene, what it prints, f_bonds and f_bonds[5]
    ({}, DEFAULT, (BONDS, 0)), ({"coeff": "pair_coeff * * +8.0E+1 8 4 3 8 4 5e-3 0 1.5"}, DEFAULT, (BONDS, 0)), ({"coeff": COEFF + "crlf.evp a"}, DEFAULT, (BONDS, 0)),
    ({"style": "pair_style evp/lj contact none overlap 0.2 contact repulsive overlap 0.4"}, "contact repulsive", (BONDS, 0)),
    ({"fix": FIX + "zone 1.4 zone 1.2"}, "recorded 20 pairs within 1.2", (20, 0)), ({"fix": "group nobody empty\nfix bonds nobody evp/bonds"}, "recorded 0 pairs within alpha", (0, 0)),
    ({"then": "delete_atoms group all compress no\ncreate_atoms 1 single 0 0 0\nset group all diameter 0.01"}, "recorded 0 pairs", (0, 0)),
    ({"style": FLOWS + " break none"}, "plasticity isotropic", (BONDS, 0)), ({"style": BREAKS + " break none plasticity isotropic"}, "plasticity isotropic", (BONDS, 0)),
    ({"style": FLOWS + " plasticity none"}, "evp/lj: damping off, contact repulsive, deq", (BONDS, 0)), ({"style": BREAKS + " break none"}, DEFAULT, (BONDS, 0)),
    *(({"fix": FIX + f"file {name}.bonds"}, f"recorded {count} pairs from file", (count, 0)) for name, count in (("one", 1), ("none", 0), ("far", 1))),
    *(({"style": style, "fix": FIX + f"file {name}.bonds", "step": "timestep 1e-12"}, "from file", counts) for style, name, counts in (
        (PARTS["style"], "whole", (2, 0)), (FLOWS, "flowed", (1, 0)), (BREAKS, "broken", (1, 1)), (FLOWS, "left", (2, 1)), (FLOWS, "pushed", (0, 0)))),
    ({"style": FLOWS, "coeff": COEFF + "80 8 4 80 8 4 0.005 0 1.5 flow 0 1"}, DEFAULT, (BONDS, 0)),
    ({"box": TWO_TYPES, "style": BREAKS, "fix": f"set atom 2 type 2\n{FIX}file broken.bonds within type"}, "recorded 1 pairs from file broken.bonds and within type", (1, 1)),
    *(({"box": TWO_TYPES, "fix": (MARKED + f"{file}.bonds {word}").replace("set atom 2 type 2\n", "").replace("mol 12", "mol 7")}, "recorded 1 pairs", (1, 0))
      for file, word in (("one", "within type"), ("type", ""), ("one", "within molecule"), ("molecule", ""))),
]
LEGAL_FILES = {
    "crlf.evp": ROWS.replace(b"\n", b"\r\n")[:-2], "none.bonds": bonds(), "far.bonds": bonds("1 12 0.0101"),
    "whole.bonds": bonds(WHOLE, "2 3 0.0101"),
    "left.bonds": bonds(WHOLE, "contact 3 2 0.0099", SPHERE.format(2), count=1, header=" CONTACTS: 1 ENDED: 1 SPHERES: 1" + COLUMNS),
    **{name: FILES[name] for name in ("one.bonds", "flowed.bonds", "broken.bonds", "pushed.bonds", "type.bonds", "molecule.bonds")},
}


def test_what_is_legal(lmp_decks, tmp_path):
    """Words that come later count, as in LAMMPS' own styles; at rest nothing flows or breaks."""
    for name, content in LEGAL_FILES.items():
        (tmp_path / name).write_bytes(content)
    runs = lmp_decks({number: deck_of({"thermo": STATE, **parts}) for number, (parts, *_) in enumerate(LEGAL)}, 2)
    energies = []
    for (parts, text, counts), run in zip(LEGAL, runs.values()):
        table = run.thermo()
        assert text in run.stdout, (parts, text)
        assert (table["f_bonds"][-1], table["f_bonds[5]"][-1]) == counts, parts
        energies.append(table["PotEng"][-1])
    assert len(set(energies[:3])) == 1, "other spellings of the same row"


# ---- restart files that are cut, changed, or go to a style that would forget

CONTINUE = "read_restart r.restart\n{}\nfix bonds all evp/bonds\nfix move all nve\ntimestep 1e-7\nthermo_style custom step pe press f_bonds f_bonds[1]\nrun 3\n"
CUT, OTHER = "Incomplete or corrupted LAMMPS restart file", "Invalid LAMMPS restart file"
FORGETS = "bonds have flowed or ended, which this pair_style would forget"
FIX_DAMAGED = "Fix bonds evp/bonds: its section of the restart file is damaged"
ATOM_DAMAGED = "Fix bonds evp/bonds: the bonds of atom 1 in the restart file are damaged"
SETTINGS_DAMAGED = "Pair evp/lj: the restart file is damaged in the settings, or from a version of this package that wrote another format"
PLASTIC, TEARING, FORGETFUL = (f"{style}\n{COEFF}{ROW}" for style in (FLOWS, STYLE + "break 0.02", STYLE))


PROPERTY, HEAT = "fix properties all property/atom temperature heatflow ghost yes\n", "\nfix heat all evp/heat every 10\n"
HEAT_DAMAGED = "Fix heat evp/heat: its section of the restart file is damaged"


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """{name: bytes of a restart file} of a body that is at rest, has flowed, or broken, or has flowed and warmed itself."""
    found, warm = {}, {"coeff": f"{COEFF}{ROW} density 2700 capacity 900 soften 293 900 1", "fix": f"{PROPERTY}set group all temperature 300\n{PARTS['fix']}{HEAT}"}
    for name, parts in (("plain", {}), ("flows", {"style": FLOWS}), ("breaks", {"style": STYLE + "break 0.02"}), ("warms", {"style": FLOWS, **warm})):
        folder = tmp_path_factory.mktemp(name)
        moving = {} if name == "plain" else {"then": "velocity all ramp vx 0 300 x 0 0.02 units box\n", "run": "run 105"}
        run_lammps(scene(after="write_restart s.restart", **parts, **moving), cwd=folder).ok()
        found[name] = (folder / "s.restart").read_bytes()
    return found


def after(content, name):
    return content.index(name + b"\0") + len(name) + 1


def at_record(content):
    """Where atom 1's record starts: its ID as recorded, and how many bonds it has."""
    return next(k for k in range(8, len(content) - 16) if content[k:k + 8] == struct.pack("<q", 1) and content[k + 9:k + 16] == bytes(7)
                and struct.unpack_from("<d", content, k - 8)[0] in range(5, 200))


def changed(content, at, bits):
    return content[:at] + bytes([content[at] ^ bits]) + content[at + 1:]


def damaged(plain):
    """Files and what is said: cut, another file, and sizes and flags of our sections changed by one bit."""
    fix, record, settings = after(plain, b"evp/bonds") + 4, at_record(plain), after(plain, b"evp/lj")
    cut = [(plain[:size], OTHER if size < 100 else CUT) for size in (0, 100, len(plain) // 2, len(plain) - 1)]
    return cut + [(b"# EVP bonds COUNT: 0 UNITS: si\n" * 10, OTHER), (changed(plain, fix, 32), FIX_DAMAGED), (changed(plain, fix + 134, 64), FIX_DAMAGED),
                  (changed(plain, record - 2, 8), ATOM_DAMAGED), (changed(plain, record + 8, 2), ATOM_DAMAGED), (changed(plain, record + 13, 128), ATOM_DAMAGED),
                  *((changed(plain, settings + 8 * word + 7, plain[settings + 8 * word + 7] ^ 0x7f), SETTINGS_DAMAGED) for word in (0, 1, 2, 7))]


def test_damaged_restart_files(saved, tmp_path):
    cases = damaged(saved["plain"])
    program = "".join(f"tell('clear', LOAD)\nos.replace('{number}.restart', 'r.restart')\nsay({number}, tell({CONTINUE.format('')!r}), step())\n" for number in range(len(cases)))
    for number, (content, _) in enumerate(cases):
        (tmp_path / f"{number}.restart").write_bytes(content)
    lines = [line for line in run_program(program, tmp_path).stdout.splitlines() if line[:1].isdigit()]
    for (_, text), line in zip(cases, lines, strict=True):
        assert text in line and int(line.split()[-1]) <= 3, line


def sections(content):
    """(from, to, message) of what is ours in a restart file of one type: settings of the pair style, its row, the fixes, what these have of an atom."""
    settings = after(content, b"evp/lj")
    row = settings + 8 * (12 + 1 + 1)  # numbers, the ID of the fix, the seal
    found = [(settings, row, SETTINGS_DAMAGED), (row, row + 91 * 8, "Pair evp/lj: the restart file is damaged in the coefficients of types 1 and 1")]
    atom = at_record(content) - 8
    found.append((atom, atom + 8 * int(struct.unpack_from("<d", content, atom)[0]), ATOM_DAMAGED))
    for style, of_fix in ((b"evp/bonds", FIX_DAMAGED), (b"evp/heat", HEAT_DAMAGED)):
        if style + b"\0" in content:
            fix = after(content, style)
            found.append((fix + 4, fix + 4 + struct.unpack_from("<i", content, fix)[0], of_fix))
    return found


@pytest.mark.parametrize("name", ["plain", "flows", "breaks", "warms"])
def test_each_damaged_number_of_a_restart_file(saved, tmp_path, name):
    """Bits, bytes and whole numbers, by chance: always one error, and the program goes on."""
    again = CONTINUE.format("") if name != "warms" else CONTINUE.format(PROPERTY).replace(PARTS["fix"], PARTS["fix"] + HEAT)
    rng, content, cases = np.random.default_rng(2026), saved[name], []
    for start, end, text in sections(content):
        words = (end - start) // 8
        for kind in range(24):
            word = start + 8 * (kind if kind < words and kind < 10 else int(rng.integers(words)))
            damage = [1 << int(rng.integers(64)), int(rng.integers(1, 256)) << 8 * int(rng.integers(8)), *(
                bits ^ int.from_bytes(content[word:word + 8], "little") for bits in (2**64 - 1, 1, 0x7FF0000000000000))][kind % 5]
            changed_word = (int.from_bytes(content[word:word + 8], "little") ^ damage).to_bytes(8, "little")
            if damage:
                cases.append((content[:word] + changed_word + content[word + 8:], text, (word - start) // 8))
    for number, (damaged_content, *_) in enumerate(cases):
        (tmp_path / f"{number}.restart").write_bytes(damaged_content)
    program = f"for number in range({len(cases)}):\n    tell('clear', LOAD)\n    os.replace(f'{{number}}.restart', 'r.restart')\n    say('case', number, tell({again!r}))\n"
    run = run_program(program, tmp_path)
    lines = [line.split(maxsplit=2)[2] for line in run.stdout.splitlines() if line.startswith("case ")]
    assert run.returncode == 0 and len(lines) == len(cases) > (100 if name == "warms" else 80)
    wrong = [(text, word, line) for (_, text, word), line in zip(cases, lines) if text not in line]
    assert not wrong, wrong[:5]


@pytest.mark.parametrize("name, lines, text", [("plain", "", ATOM_DAMAGED), ("flows", FORGETFUL, FORGETS), ("breaks", FORGETFUL, FORGETS), ("flows", TEARING, FORGETS)])
def test_refused_restarts_on_two_ranks(lmp, saved, tmp_path, name, lines, text):
    content = saved[name]
    (tmp_path / "r.restart").write_bytes(content if lines else changed(content, at_record(content) + 8, 1))
    refused(lmp(CONTINUE.format(lines), ranks=2), text)


def test_restarts_that_continue(lmp_decks, saved, tmp_path):
    for name, content in saved.items():
        (tmp_path / f"{name}.restart").write_bytes(content)
    cases = [("plain", ""), ("flows", ""), ("flows", PLASTIC), ("flows", PLASTIC + " density 2700 damage 0.1 0 0 0 0 rupture 0"), ("breaks", ""), ("breaks", PLASTIC),
             ("plain", PLASTIC), ("plain", TEARING)]
    runs = lmp_decks({case: CONTINUE.format(case[1]).replace("r.restart", f"{case[0]}.restart") for case in cases}, 2)
    assert all(list(run.thermo()["f_bonds"]) == [BONDS] * 2 for run in runs.values())
    assert abs(runs[cases[0]].thermo()["Press"][-1]) < 1.0, "at rest still, in Pa"


# ---- IDs

def spheres(folder, old, new):
    """The data file of three spheres of which one has another ID."""
    write_data(folder / "s.data", 0.0101 * np.outer([0, 1, 2], [1, 0, 0]), [0.005] * 3, [[-0.01, 0.06], [-0.01, 0.01], [-0.01, 0.01]])
    text = (folder / "s.data").read_text(encoding="utf-8")
    (folder / "s.data").write_text(text.replace(f"\n{old} 1 ", f"\n{new} 1 "), encoding="utf-8")
    return {"box": "boundary f f f\nread_data s.data"}


@pytest.mark.parametrize("fix, ranks", [("", 2), ("file none.bonds", 1)])
def test_an_id_given_twice(lmp, tmp_path, fix, ranks):
    """LAMMPS takes such a data file; no record could tell the two apart, near to each other or not."""
    refused(lmp(scene(**spheres(tmp_path, 1, 2), fix=FIX + fix), ranks), "Fix bonds evp/bonds: atom ID 2 is given twice: use 'reset_atoms id'")


def test_a_deleted_partner_of_far_id_and_a_restart(lmp, tmp_path):
    """After the restart LAMMPS' map of IDs ends far below the ID that the records still name."""
    far = spheres(tmp_path, 3, 90000000)
    run = lmp(scene(**far, map="atom_modify map array", after="group far id 90000000\ndelete_atoms group far compress no\nwrite_restart r.restart\nclear\n"
                    + CONTINUE.format("")), ranks=2).ok()
    assert [*run.thermo(0)["f_bonds"], *run.thermo(1)["f_bonds"]] == [2] * 4
    assert list(run.thermo(1)["f_bonds[1]"]) == [1, 1]  # the bond of the deleted atom acts no more
    assert run.thermo(1)["PotEng"][0] == pytest.approx(0.5 * run.thermo(0)["PotEng"][0], rel=1e-5)  # printed digits
