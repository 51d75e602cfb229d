# SPDX-License-Identifier: GPL-2.0-only
"""read_evp_row, evp_quietly and evp_choices as commands: rows typed or from a file; what a quiet command shows; variables that are no choice."""

import os
import re
import signal
import subprocess

import numpy as np
import pytest
from hostile import scene
from lammps_run import LMP, run_lammps

TABLE1 = "80 8 4 3 8 4 0.005 0 1.5"
NUMBERS = "e1 m1 n1 e2 m2 n2 xi_s gamma alpha spacing coordination kv density".split()


def values(run, prefix):
    """{name: number} of what row_deck() prints."""
    return {name: float(word) for name, word in re.findall(rf"^{prefix}_((?!key)\w+) = (\S+)$", run.ok().stdout, re.M)}


def row_deck(words, prefix, more=""):
    return f"units si\nread_evp_row {words} {prefix} {more}\n" + "".join(f'print "{prefix}_{name} = ${{{prefix}_{name}}}"\n' for name in (*NUMBERS, "key"))


def test_rows_from_a_file_and_typed_are_one(lmp, tmp_path):
    table = "0 1 0.1 1.30000000000000004 2 0.5"
    row = f"80.1 8 4 3 8 4 0.005 1000 1.5 kv 0.30000000000000004 spacing 0.0102 flow {table} coordination 11.9 density 2700"
    (tmp_path / "good.evp").write_text(f"# UNITS: si\na {row}\n")
    words = {"a": "good.evp:a", "b": "./good.evp:a", "c": "good.evp a", "d": row, "e": f'"{row}"', "f": f"'{row}'", "plain": TABLE1}
    run = lmp("".join(row_deck(row, prefix) for prefix, row in words.items()), 2)
    *found, plain = (values(run, prefix) for prefix in words)
    assert found == [found[0]] * 6 and list(found[0]) == NUMBERS
    assert found[0]["e1"] == 80.1 and found[0]["kv"] == 0.30000000000000004 and found[0]["density"] == 2700
    key = "80p1_8_4_3_8_4_0p005_1000_1p5_spacing_0p0102_coordination_11p9_kv_0p30000000000000004_density_2700_flow_0_1_0p1_1p3_2_0p5"
    assert re.findall(r"^\w_key = (.*)$", run.stdout, re.M) == 6 * [key] and "\nplain_key = 80_8_4_3_8_4_0p005_0_1p5\n" in run.stdout
    assert plain["alpha"] == 1.5 and plain["spacing"] == plain["coordination"] == plain["kv"] == plain["density"] == 0


def test_a_row_of_the_paper_in_a_body_of_more_spheres(lmp):
    """Stiffness goes with e/deq^3, damping with gamma/deq; a row with a spacing is left to the bonds of the body."""
    spheres, row, scaled = 4e7, "80 8 4 3 8 4 0.005 1000 1.5 kv 300 flow 0 1 0.1 2", TABLE1 + " spacing 0.01 coordination 12"
    text = row_deck(row, "paper") + "atom_style sphere\nregion box block 0 0.2 0 0.2 0 0.2\ncreate_box 1 box\ncreate_atoms 1 random 8 7 NULL overlap 0.01\nset group all diameter 0.002\n"
    body = f"body all {8 / spheres:.17g} {np.pi / 6 * 0.002**3 * spheres:.5g}"
    text += row_deck(row, "more", body).removeprefix("units si\n") + row_deck(scaled, "own", body).removeprefix("units si\n")
    run = lmp(text + "print 'more_diameter = ${more_diameter}'\npair_style evp/lj\npair_coeff * * ${more_words}\n")
    paper, more, own = (values(run, name) for name in ("paper", "more", "own"))
    assert more.pop("diameter") == pytest.approx(0.002, rel=1e-5)
    finer = spheres * np.pi * 0.02**2 * 0.05 / 500
    assert more == pytest.approx({**paper, "e1": 80 / finer, "e2": 3 / finer, "kv": 300 / finer, "gamma": 1000 / finer ** (1 / 3)}, rel=1e-14)
    assert own["e1"] == 80 and own["spacing"] == 0.01 and run.stdout.count("_flow_0_1_0p1_2\n") == 2


def test_a_number_of_a_row_is_set(lmp, tmp_path):
    """Whether the row has it or not, in the order given; 0 takes a keyword out."""
    (tmp_path / "a.evp").write_text(f"# UNITS: si\na {TABLE1} kv 3 soften 298 775 1\n", encoding="utf-8")
    decks = {"kv 7": "_kv_7_soften_298_775_1", "kv 0": "_soften_298_775_1", "density 2700": "_kv_3_density_2700_soften_298_775_1",
             "soften_tmelt 1000 set soften 800 set kv 0": "_soften_800_1000_1", "soften_m 2": "_kv_3_soften_298_775_2"}
    text = "units si\n" + "".join(f"read_evp_row a.evp:a x set {words}\nprint '{words} = ${{x_key}}'\n" for words in decks)
    said = lmp(text, 2).ok().stdout
    for words, key in decks.items():
        assert f"\n{words} = 80_8_4_3_8_4_0p005_0_1p5{key}_0p02\n" in said
    for words, message in (("pitch 1", "set: a row has no number 'pitch': it has e1, m1"), ("rate_rate0 1", "set: the row has no keyword rate, of which rate_rate0"),
                           ("kv -1", "kv must lie between 0 and 1e100"), ("soften 800", "soften_tmelt must lie above TREF = 800"), ("xi_s x", "xi_s must be a finite")):
        run = lmp(f"units si\nread_evp_row a.evp:a x set {words}\n")
        assert run.returncode == 1 and f"read_evp_row: {message}" in " ".join(run.stdout.split()), run.stdout[-300:]


@pytest.mark.parametrize("command, key", [
    (f"read_evp_row {TABLE1} kv 1 density 2700 kv 2 x", "kv"), ("read_evp_row density.evp:a x", "density"), ("read_evp_row flow.evp a x", "flow"),
    (f"pair_style evp/lj\npair_coeff * * {TABLE1} limit own limit own", "limit"), ("pair_style evp/lj\npair_coeff * * limit.evp:first", "limit")])
def test_a_keyword_of_a_row_is_not_given_twice(lmp, tmp_path, command, key):
    """Not even with the same value, nor in another row of the file."""
    for name, more in {"density": "density 1 density 1", "flow": "flow 0 1 flow 0 1 1 2", "limit": "limit own kv 2 limit own"}.items():
        (tmp_path / f"{name}.evp").write_text(f"# UNITS: si\nfirst {TABLE1}\na {TABLE1} {more}\n", encoding="utf-8")
    run = lmp("units si\natom_style sphere\nregion box block 0 1 0 1 0 1\ncreate_box 1 box\n" + command + "\n", 2)
    assert run.returncode == 1 and f"keyword {key} of a row is given twice: leave one out" in " ".join(run.stdout.split()), run.stdout[-300:]


OWN = "there is a variable '{}' already, which would be overwritten: "


@pytest.mark.parametrize("style", ["string mine", "index mine", "equal 3", "loop 3"])
def test_a_variable_of_the_users_is_not_overwritten(lmp, style):
    """By the titles of a compute, nor by a row; what these have set themselves may be set again, after clear too. evp_choices takes a folder `here` as it is."""
    compute = scene(run="compute s all evp/state/atom")
    for name, command, remedy in (("s_titles", compute, "give the compute another ID"), ("row_kv", f"read_evp_row {TABLE1} row", "give another prefix than 'row'"),
                                  ("row_words", f"units si\nread_evp_row {TABLE1} row", "rename that variable")):
        run = lmp(f"variable {name} {style}\n{command}\n")
        assert run.returncode == 1 and OWN.format(name) in " ".join(run.stdout.split()) and remedy in run.stdout, run.stdout[-400:]
    twice = f"read_evp_row {TABLE1} row\nread_evp_row 81 8 4 3 8 4 0.005 0 1.5 row\n"
    again = lmp(f"{twice}{compute}uncompute s\ncompute s all evp/state/atom plastic_work\nclear\n{twice}{compute}print 'e1 ${{row_e1}} ${{s_titles}}'\n").ok().stdout
    assert "e1 81 colname c_s[1] bonds" in again
    if style.startswith(("string", "index")):
        assert "\nhere mine\n" in lmp(f"variable out index a\nvariable here {style}\nevp_choices in.x out,name only\nprint 'here ${{here}}'\n").ok().stdout


SCENE = "region box block 0 1 0 1 0 1\ncreate_box 1 box\ncreate_atoms 1 single 0.5 0.5 0.5\nmass 1 1.0\npair_style zero 0.1\npair_coeff * *\n"


def test_what_came_before_a_quiet_command_is_shown_at_once(tmp_path):
    """In a file, too, whose lines LAMMPS keeps back: a tool reads there how far a run is."""
    (tmp_path / "in.x").write_text('print "so far"\nevp_quietly shell cp screen copy\n', encoding="utf-8")
    with open(tmp_path / "screen", "w", encoding="utf-8") as screen:
        subprocess.run([LMP, "-log", "none", "-in", "in.x"], cwd=tmp_path, stdin=subprocess.DEVNULL, stdout=screen, check=True)
    assert "\nso far\n" in (tmp_path / "copy").read_text(encoding="utf-8")


def test_a_quiet_command_shows_its_warnings(lmp):
    """The run is made, with blanks and variables in its words. Lines of EVP are shown, the warning of LAMMPS that nothing moves is not."""
    text = SCENE + 'variable word string "a b"\nvariable n equal 3\nevp_quietly run ${n} every 1 "print \'${word}\'"\nprint "step $(step)"\n'
    loud, quiet = (lmp(text.replace("evp_quietly ", word), 2).ok().stdout for word in ("", "evp_quietly "))
    assert "\nstep 3\n" in loud and "\nstep 3\n" in quiet and "Loop time" in loud and "Loop time" not in quiet and "\na b\n" not in quiet
    assert "WARNING: No fixes with time integration" in loud and "WARNING" not in quiet
    spoken = lmp(scene(run="evp_quietly run 3"), 2).ok().stdout
    assert "\nfix evp/bonds bonds: recorded " in spoken and "\nevp/lj: damping off" in spoken and "perpetual" not in spoken
    warned = lmp(SCENE + "thermo_modify norm no\nevp_quietly thermo_style one\n", 2).ok().stdout
    assert "WARNING: New thermo_style command" in warned


@pytest.mark.parametrize("command, ranks, message", [
    ("", 1, "ERROR: evp_quietly: expected a command and its arguments"), ("no_such_command", 2, "ERROR: Unknown command: no_such_command"),
    ("run fast", 1, "ERROR: Expected integer parameter instead of 'fast'")])
def test_errors_of_a_quiet_command_are_shown_once(lmp, command, ranks, message):
    run = lmp(SCENE + f"evp_quietly {command}\n", ranks)
    assert run.returncode != 0 and run.stdout.count("ERROR") == 1 and message in run.stdout, run.stdout[-500:]


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_a_quiet_command_said_before_another_rank_ended_it(lmp, ranks):
    """The warning that says why, of the first MPI rank, and the error of the last one, whose sphere has grown; and with them nothing that is to be hidden."""
    text = f"""units si
atom_style sphere 1
atom_modify map yes
boundary f f f
processors {ranks} 1 1
region box block -5 5 -1 1 -1 1
create_box 1 box
create_atoms 1 single -3 0 0
create_atoms 1 single 3 0 0
set group all diameter 1.0 density 1.0
pair_style evp/lj contact repulsive
pair_coeff * * {TABLE1}
neighbor 0.3 bin
fix move all nve
group grows id 2
variable size equal 1+0.2*step
fix grow grows adapt 1 atom diameter v_size
create_atoms 1 single 4.2 0 0
set group all diameter 1.0 density 1.0
fix bonds all evp/bonds
timestep 1e3
evp_quietly run 10
"""
    run = lmp(text, ranks)
    assert run.returncode != 0 and re.search(r"^ERROR.*: the radius of atom 2 is 0\.6, but the cutoff was set for at most 0\.5", run.stdout, re.M), run.stdout[-500:]
    assert re.search(r"^WARNING: Pair evp/lj: the timestep 1000 is \S+ times the largest stable timestep", run.stdout, re.M)
    assert "\nevp/lj: damping off" in run.stdout and "perpetual" not in run.stdout and "Step" not in run.stdout


@pytest.mark.parametrize("also, warned", [("/dev/null", ["wdth"]), ("more.lmp", [])])
def test_a_variable_that_is_no_choice_is_warned_of(lmp, also, warned):
    """Where there is no further file of commands, which may read it."""
    text = f"variable wdth index 3\nvariable width index 2\nvariable also index {also}\nevp_choices in.x width>0 height? also only\nevp_choices in.x.resume width\n"
    run = lmp(text, 2).ok()
    assert f"in.x: width 2, also {also}\n" in run.stdout
    assert re.findall(r"WARNING: in\.x has no choice '(\w+)': -var \1 has no effect", run.stdout) == warned


@pytest.mark.parametrize("given, names, found", [
    ({}, "coeff plasticity contact", ""), ({"plasticity": "isotropic"}, "coeff plasticity contact", "contact join"),
    ({"material": "a.evp:b"}, "coeff plasticity contact", "coeff a.evp:b contact join"), ({"material": "a.evp:b"}, "coeff", "coeff a.evp:b"),
    ({"material": "a.evp:b", "plasticity": "none"}, "coeff plasticity contact", "coeff a.evp:b"), ({"plasticity": "isotropic", "contact": "none"}, "contact", "contact none"),
    ({"plasticity": "isotropic"}, "coeff", "")])
def test_choices_that_are_implied(lmp, given, names, found):
    """Those that are given stay, those that are not named are not defined."""
    text = "".join(f"variable {name} index {value}\n" for name, value in given.items()) + f"evp_choices in.x implied {names}\n"
    run = lmp(text + "evp_choices in.x is? coeff? contact?\n").ok()
    assert re.search(r"^in\.x:?(.*)$", run.stdout, re.M)[1].replace(",", "").strip() == found


# ---- names, and whole numbers, as people write them ----

NAMED = {"in.specimen": ["out", "region", "mesh"], "in.traction": ["specimen", "material", "out", "also"], "in.impact": ["plate", "ball", "out"],
         "in.sliding": ["block", "material"], "in.two_spheres": ["out"], "in.quasistatic": ["specimen", "coeff", "out"], "in.upset": ["out", "specimen"]}
BAD_NAMES = ["my pull", "a folder/file.evp:row", "with\ttab", "a#b", "a;b", "$x", "it's", '"quoted"', "a&b", "*", "50%", "(1)", ""]


@pytest.mark.parametrize("deck", NAMED)
def test_names_that_lammps_would_take_apart_are_refused(tmp_path, deck):
    """By one error that says which, before anything is written; what is there stays."""
    (tmp_path / "my").write_text("a result of yesterday", encoding="utf-8")
    for k, choice in enumerate(NAMED[deck]):
        for bad in BAD_NAMES if deck == "in.specimen" and choice == "out" else BAD_NAMES[k:k + 1]:
            run = run_lammps(deck, 1, {choice: bad}, tmp_path)
            said = " ".join(run.stdout.split())
            assert run.returncode == 1 and f"ERROR: {deck}: -var {choice} must be a name without blanks" in said and "rename the file or folder" in said, (choice, bad, said[-500:])
            assert [path.name for path in tmp_path.iterdir()] == ["my"], (choice, bad)
    assert (tmp_path / "my").read_text(encoding="utf-8") == "a result of yesterday"


@pytest.mark.parametrize("folder, out", [("", "zug_é"), ("Prüfung/", "ロッド"), ("a.b-c_d/", "p+q@r,s")])
def test_names_in_any_alphabet(tmp_path, folder, out):
    """All files begin with the prefix, restart files too, from which a run goes on; a blank in the folder where it runs does no harm."""
    here = tmp_path / "my runs"
    (here / folder).mkdir(parents=True)
    run_lammps("in.specimen", 1, {"n": 120, "out": f"{folder}body.data"}, here).ok()
    more = {"specimen": f"{folder}body.data", "strain": 0.001, "increment": 0.0005, "out": f"{folder}{out}"}
    run_lammps("in.quasistatic", 1, more, here).ok()
    left = {path.name for path in (here / folder).iterdir() if path.is_file()} - {"body.data", "body.data.body"}
    assert left == {out + end for end in (".csv", ".resume", ".0.restart", ".1.restart", "_state.dump")}
    run_lammps("in.quasistatic", 1, {**more, "strain": 0.0015, "resume": "yes"}, here).ok()
    assert len((here / f"{folder}{out}.csv").read_text(encoding="utf-8").splitlines()) == 5, "a header, and rows 0 to 3"


def test_whole_numbers_as_people_write_them(tmp_path):
    """The same file of each."""
    texts = []
    for n, seed in (("120", "7"), ("1.2e2", "7.0"), ("120.", "0.7e1")):
        run_lammps("in.specimen", 1, {"n": n, "seed": seed, "out": "body.data"}, tmp_path).ok()
        texts.append((tmp_path / "body.data").read_bytes())
    assert texts[0] == texts[1] == texts[2]
    run = run_lammps("in.specimen", 1, {"n": "120.5", "out": "other.data"}, tmp_path)
    assert run.returncode == 1 and "-var n must be an integer >= 1, got '120.5'" in run.stdout and not (tmp_path / "other.data").exists()
    run_lammps("in.quasistatic", 1, {"specimen": "body.data", "strain": 0.001, "increment": 0.0005, "cycles": "1e0", "out": "one"}, tmp_path).ok()
    run_lammps("in.quasistatic", 1, {"specimen": "body.data", "strain": 0.001, "increment": 0.0005, "cycles": "1", "out": "two"}, tmp_path).ok()
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()


def test_the_folder_of_a_script(tmp_path):
    """An include beside it is found from any folder; by a pipe the folder is not known, and is the present one."""
    folder = tmp_path / "my d\u00ebcks"
    folder.mkdir()
    (folder / "in.x").write_text('variable out index a\nevp_choices in.x out,output only\ninclude "${here}/part.lmp"\n', encoding="utf-8")
    (folder / "part.lmp").write_text('print "beside it"\n', encoding="utf-8")
    for ranks in (1, 2):
        assert "beside it" in run_lammps(folder / "in.x", ranks, {}, tmp_path).ok().stdout
    (tmp_path / "part.lmp").write_text('print "of the present folder"\n', encoding="utf-8")
    for start, said in ((f"{LMP} -log none < '{folder}/in.x'", "beside it"), (f"cat '{folder}/in.x' | {LMP} -log none", "of the present folder")):
        assert said in subprocess.run(start, shell=True, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    told = f"cat '{folder}/in.x' | {LMP} -log none -var here '{folder}'"
    shown = subprocess.run(told, shell=True, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "beside it" in shown and "WARNING" not in shown


# ---- one prefix, two runs ----

HELD = 'variable out index c\nevp_choices in.held out,output only\nprint "a,b" file c.csv screen no\nshell touch ready\nshell sleep 120\n'
TAKEN = "another run, which has not ended, writes files that begin with"


def test_a_prefix_is_that_of_one_run(tmp_path):
    """While it lasts, for another script and by another path; a run that was killed has none. Nothing is written."""
    run_lammps("in.specimen", 1, {"n": 120, "out": "body.data"}, tmp_path).ok()
    (tmp_path / "in.held").write_text(HELD, encoding="utf-8")
    more = {"specimen": "body.data", "strain": 0.001, "increment": 0.0005}
    with subprocess.Popen([LMP, "-log", "none", "-in", "in.held"], cwd=tmp_path, stdout=subprocess.DEVNULL, start_new_session=True) as held:
        try:
            while not (tmp_path / "ready").exists():
                assert held.poll() is None
            for deck, ranks, out in (("in.quasistatic", 2, "c"), ("in.cyclic", 1, tmp_path / "c"), ("in.specimen", 1, "c")):
                run = run_lammps(deck, ranks, {**(more if deck == "in.quasistatic" else {"specimen": "body.data"}), "out": out}, tmp_path)
                assert run.returncode == 1 and f"{deck}: {TAKEN} {out}: wait for its end, or give another -var out" in " ".join(run.stdout.split()), run.stdout[-300:]
            run_lammps("in.quasistatic", 1, {**more, "out": "d"}, tmp_path).ok()
            assert (tmp_path / "c.csv").read_text(encoding="utf-8") == "a,b\n" and not (tmp_path / "c.resume").exists()
        finally:
            os.killpg(held.pid, signal.SIGKILL)
    run_lammps("in.quasistatic", 1, {**more, "out": "c"}, tmp_path).ok()
    assert len((tmp_path / "c.csv").read_text(encoding="utf-8").splitlines()) == 4 and not list(tmp_path.glob("*.lock"))


def test_two_partitions_with_one_prefix(lmp):
    """The same deck twice at the same time; with prefixes of their own both run."""
    text = 'variable out world {}\nevp_choices in.x out,output only\nprint "ran" file ${{out}}.csv\n'
    flags = ("-partition", "1", "1")
    one = lmp(text.format("c c"), 2, flags=flags)
    assert one.returncode != 0 and not (one.folder / "d.csv").exists()
    lmp(text.format("c d"), 2, flags=flags).ok()
    assert (one.folder / "d.csv").read_text(encoding="utf-8") == "ran\n"
