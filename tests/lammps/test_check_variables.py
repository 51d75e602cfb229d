# SPDX-License-Identifier: GPL-2.0-only
"""check_evp_variables: a misspelled -var stops a run, in its own script, in each deck and on two ranks; what is known does not."""

import re
import subprocess

import pytest
from common_bodies import REFERENCE
from lammps_run import DECKS, LMP, REPOSITORY, run_lammps

SCRIPT = "variable strain index 0.02\nvariable rate index 10\nvariable also index more.lmp\n{}\nvariable later index 1\nprint 'rate ${{rate}}, done'\n"
ALL = sorted(path.name for path in DECKS.glob("in.*"))


def error_of(run):
    """The text of the one error of a run that was stopped."""
    lines = [line for line in run.stdout.splitlines() if line.startswith("ERROR")]
    assert run.returncode == 1 and len(lines) == 1, run.stdout[-800:]
    return lines[0]


def run_script(lmp, command="check_evp_variables", ranks=1, **variables):
    return lmp(SCRIPT.format(command), ranks, variables)


@pytest.mark.parametrize("ranks", [1, 2])
def test_known_names_pass_and_the_script_goes_on_where_it_was(lmp, ranks):
    run = run_script(lmp, ranks=ranks, rate=3, later=2).ok()
    assert run.stdout.count("rate 3, done") == 1 and not run.warnings()


@pytest.mark.parametrize("name, ranks, hint", [
    ("streain", 2, "did you mean strain?"), ("Rate", 1, "did you mean rate?"), ("sratin", 1, "did you mean strain?"), ("ltaer", 1, "did you mean later?"),
    ("temperature", 1, "its variables are strain, rate, also, later")])
def test_another_name_stops_with_the_nearest(lmp, name, ranks, hint):
    assert f"-var {name}: the input script has no such variable; {hint}" in error_of(run_script(lmp, ranks=ranks, **{name: 5}))


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_number_with_a_plus_is_refused(lmp, ranks):
    """LAMMPS' 'if' does not take it for a number; a word with one is none."""
    assert "-var rate: a number must not begin with +, got +5e2: give 5e2" in error_of(run_script(lmp, ranks=ranks, rate="+5e2"))
    assert "-var samples: a number must not begin with +" in error_of(lmp("in.traction", ranks, {"specimen": REFERENCE, "samples": "+5"}))
    run_script(lmp, ranks=ranks, rate="+a").ok()


def test_variables_of_other_styles_are_left_alone(lmp):
    lmp("variable n loop 2\nvariable s string a\nvariable e equal 1\nvariable rate index 1\ncheck_evp_variables\nprint 'done'\n").ok()


@pytest.mark.parametrize("text, accepted", [("print ${count}", True), ("variable a equal 2*v_count", True), ("print ${counts}", False),
                                            ("variable recount index 1", False)])
def test_names_of_an_included_file(lmp, tmp_path, text, accepted):
    (tmp_path / "more.lmp").write_text(text + "\n", encoding="utf-8")
    run = run_script(lmp, "check_evp_variables include also", count=4)
    if accepted:
        run.ok()
    else:
        assert "-var count: the input script has no such variable" in error_of(run)


OUTER = "variable seed index 1 2\nlabel again\n{}\ninclude in.inner\nnext seed\njump SELF again\n"
INNER = "variable strain index 0.02\ncheck_evp_variables\nprint 'strain ${strain}, done'\n"


@pytest.mark.parametrize("ranks, variables, line", [(1, {}, ""), (2, {"seed": 7}, ""), (1, {"tag": "a"}, "print ${tag}"), (2, {"strain": 1}, "")])
def test_a_script_may_include_this_one(lmp, tmp_path, ranks, variables, line):
    """Its own variables are known, those that -var sets too, and those that it defines are none of -var's."""
    (tmp_path / "in.inner").write_text(INNER, encoding="utf-8")
    run = lmp(OUTER.format(line), ranks, variables).ok()
    assert run.stdout.count(f"strain {variables.get('strain', 0.02)}, done") == (1 if "seed" in variables else 2)


def test_a_misspelled_name_is_found_below_a_script_that_includes_this_one(lmp, tmp_path):
    (tmp_path / "in.inner").write_text(INNER, encoding="utf-8")
    assert "-var sed: the input script has no such variable; did you mean" in error_of(lmp(OUTER.format(""), 1, {"sed": 3}))


@pytest.mark.parametrize("script", [
    "variable rate &\n  index 1\n", "variable rate loop 3\n", "variable rate world 5\n", "print ${rate}\n", "variable twice equal 2*v_rate\n",
    "if $(is_defined(variable,rate)) then 'print given'\n", "if 1 then 'variable rate index 2'\n"])
def test_other_ways_to_define_or_to_read_a_variable(lmp, script):
    lmp(script + "check_evp_variables\nprint 'done'\n", variables={"rate": 4}).ok()


def test_a_word_of_a_comment_is_no_variable(lmp):
    message = error_of(lmp("variable cycles index 0    # a cycle is a load and its release\ncheck_evp_variables\n", variables={"cycle": 1}))
    assert message.count("-var cycle: the input script has no such variable; did you mean cycles?") == 1


def test_a_variable_that_the_script_defines_is_not_of_the_command_line(lmp, tmp_path):
    (tmp_path / "in.next").write_text("check_evp_variables\nprint 'done'\n", encoding="utf-8")
    lmp("variable late index 2\njump in.next\n").ok()


def test_an_included_file_that_is_missing_has_no_names(lmp):
    run_script(lmp, "check_evp_variables include also").ok()


@pytest.mark.parametrize("value, message", [("my run", "-var also 'my run': in an input script a path must have no blank"), ("a#b", "must have no blank, quote, #"),
                                            ("", "-var also is empty")])
def test_paths_that_commands_would_split(lmp, value, message):
    assert message in error_of(run_script(lmp, "check_evp_variables path also", also=value))


@pytest.mark.parametrize("command, message", [("check_evp_variables path none", "there is no variable none"), ("check_evp_variables path", "keyword path needs a value"),
                                              ("check_evp_variables file also", "unknown keyword 'file'; it takes path or include")])
def test_misuse(lmp, command, message):
    assert message in error_of(run_script(lmp, command))


def test_a_script_from_a_pipe_is_not_checked(tmp_path):
    """It cannot be read twice: a warning, and the run goes on."""
    done = subprocess.run([str(LMP), "-log", "none", "-var", "streain", "1"], input=SCRIPT.format("check_evp_variables"), cwd=tmp_path,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=True)
    assert "names of variables are not checked" in done.stdout and "rate 10, done" in done.stdout


@pytest.mark.parametrize("deck", ALL)
def test_each_deck_stops_at_a_misspelled_choice_and_at_a_blank(tmp_path, deck):
    """Before it reads anything, and leaves no file."""
    found = error_of(run_lammps(deck, 1, {"ouut": "x"}, tmp_path))
    assert "-var ouut: the input script has no such variable; did you mean out?" in found
    assert "-var out 'my run'" in error_of(run_lammps(deck, 1, {"out": "my run"}, tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_choices_of_frames_are_known(tmp_path):
    variables = {"specimen": REFERENCE, "also": DECKS / "frames.lmp", "out": "a", "rate": 100, "strain": 0.0002}
    run_lammps("in.traction", 1, {**variables, "frames": 2}, tmp_path).ok()
    assert "-var framse: the input script has no such variable; did you mean frames?" in error_of(run_lammps("in.traction", 1, {**variables, "framse": 2}, tmp_path))


def test_example_of_the_page(lmp, tmp_path):
    page = (REPOSITORY / "doc" / "check_evp_variables.rst").read_text(encoding="utf-8")
    script = re.search(r"with the file \*in.pull\*\n\n.. code-block:: LAMMPS\n\n((?:   .*\n)+)", page)[1]
    (tmp_path / "in.pull").write_text(script.replace("   ", "", 1).replace("\n   ", "\n"), encoding="utf-8")
    lmp(tmp_path / "in.pull").ok()
    message = re.search(r"stops with \*(.*?)\*", page)[1]
    assert message in error_of(lmp(tmp_path / "in.pull", variables={"streain": 0.03}))
