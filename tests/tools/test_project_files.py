# SPDX-License-Identifier: GPL-2.0-only
"""The files of a public project: workflows and claims of doc/comparison.md whose commands exist and accept their options, dependencies; flake8 by
setup.cfg on all Python of the checkout, and no test that asserts a time; short decks; what includes what in src/."""

import ast
import functools
import graphlib
import importlib.util
import itertools
import os
import pathlib
import re
import shlex
import subprocess
import sys

import pytest
import yaml
from evp.run import CHECKOUT as REPOSITORY
from evp.run import DECKS

WORKFLOWS = sorted(REPOSITORY.glob(".github/workflows/*.yml"))
CHOICES = {"--release", "--compiler", "--sizes", "--tests"}


@functools.lru_cache(maxsize=None)
def help_of(program):
    path = REPOSITORY / program
    python = os.environ.get("PYTHON", "/usr/bin/python3")
    path = path.with_name("quickstart.py") if program == "tools/quickstart.sh" else path
    words = [python, path] if path.suffix == ".py" else [path]
    return subprocess.run([*words, "--help"], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(REPOSITORY / "tools")}, check=True, timeout=60).stdout


def check_commands(text):
    """The programs of this repository that the lines of a script start: each is there, its help has the options, and those values that are choices."""
    programs = []
    for words in (shlex.split(line, comments=True) for line in text.replace("\\\n", " ").splitlines()):
        if not words or not re.match(r"(tools|tests/maintain|\.ci)/", words[0]) or "*" in words[0]:
            continue
        program, options = words[0], [word for word in words if word.startswith("--")]
        assert os.access(REPOSITORY / program, os.X_OK), f"{program} is not there or cannot be run"
        known = help_of("tools/setup.sh" if program == "tools/test.sh" else program) if options else ""  # it hands its options on
        for option in options:
            value = words[words.index(option) + 1] if option in CHOICES else ""
            assert all(re.search(re.escape(word) + r"(?!\w)", known) for word in (option, value)), f"{program} knows no {option} {value}"
        programs.append(program)
    return programs


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflow(path):
    """Jobs run on the Debian of the README, steps do one thing, and each command of ours exists with its options and choices."""
    flow = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert flow["name"] == path.stem and (flow.get("on") or flow[True]), "YAML reads a bare on as true"
    programs = []
    for job, step in ((job, step) for job in flow["jobs"].values() for step in job["steps"]):
        assert ("run" in step) != ("uses" in step), step
        assert "run" not in step or job.get("container") == "debian:12"
        matrix = job.get("strategy", {}).get("matrix", {})
        for values in itertools.product(*matrix.values()):
            text = step.get("run", "")
            for name, value in zip(matrix, values):
                text = text.replace(f"${{{{ matrix.{name} }}}}", str(value))
            assert "${{" not in text, f"nothing stands for it: {text}"
            programs += check_commands(text)
    assert programs or path.name == "site.yml"


def test_commands_of_contributing():
    """Of its blocks, which take too long to be run here."""
    text = "".join(re.findall(r"(?:^    .*\n)+", (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.M))
    assert {"tools/setup.sh", "tools/test.sh", "tests/maintain/releases.sh", "tests/maintain/compare_builds.py"} <= set(check_commands(text.replace("    ", "")))
    assert all((REPOSITORY / path).is_file() for path in re.findall(r"tests/\w+/\w+\.py", text))


def imported(*folders):
    """Third-party modules that the Python below these folders imports."""
    text = "\n".join(path.read_text(encoding="utf-8") for folder in folders for path in (REPOSITORY / folder).rglob("*.py"))
    found = set(re.findall(r"""(?:^ *(?:from|import) |importorskip\(")(\w+)""", text, re.M))
    specs = {name: importlib.util.find_spec(name) for name in found}
    return {name for name, spec in specs.items() if spec and spec.origin and {"site-packages", "dist-packages"} & set(pathlib.Path(spec.origin).parts)}


def test_dependencies_are_those_that_are_imported():
    """Of set-up's lists, and of the recipes, which need what the tools need."""
    text = {name: (REPOSITORY / name).read_text(encoding="utf-8") for name in ("tools/env.sh", "tools/setup_steps.sh", "tools/test.sh", "doc/conf.py")}
    required = set(re.search('^EVP_PYTHON_MODULES="(.+)"$', text["tools/env.sh"], re.M)[1].split())
    optional = set(re.findall(r"^(\w+) python3-", text["tools/setup_steps.sh"], re.M))
    with_others = {"PIL": "matplotlib", "docutils": "sphinx", "pygments": "sphinx"}
    by_name = set(re.findall(r'"(myst_parser|sphinx_rtd_theme)"', text["doc/conf.py"])) | set(re.findall("import (xdist)", text["tools/test.sh"])) | {"flake8"}
    assert {with_others.get(name, name) for name in imported("tools", "tests", "doc")} | by_name == required | optional
    tools = {with_others.get(name, name) for name in imported("tools")} - optional
    assert tools <= required
    conda = yaml.safe_load("".join(line for line in (REPOSITORY / "packaging/conda/meta.yaml").read_text(encoding="utf-8").partition("  run:\n")[2]
                                   .partition("\n\n")[0].splitlines(True) if "{{" not in line))
    spack = (REPOSITORY / "packaging/spack/packages/evp/package.py").read_text(encoding="utf-8")
    assert {name.replace("-base", "") for name in conda if not name.startswith("python ")} == tools == set(re.findall(r'"py-(\w+)"', spack))


def test_flake8_finds_nothing():
    words = [sys.executable, "-m", "flake8", "tools", "tests", "doc"]
    found = subprocess.run(words, cwd=REPOSITORY, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert "No module named" not in found.stderr, "flake8 is missing: apt-get install python3-flake8, or pip install flake8"
    assert found.returncode == 0 and not found.stdout, found.stdout


CLOCKS = {"monotonic", "perf_counter", "process_time", "time"}


def elapsed_times(source):
    """Lines that assert something of the difference of a clock and an earlier reading, or of a measured time that a tool has written."""
    names = [node for statement in ast.walk(ast.parse(source)) if isinstance(statement, ast.Assert) for node in ast.walk(statement)]
    clocks = [node for node in names if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub) and isinstance(node.left, ast.Call)
              and isinstance(node.left.func, ast.Attribute) and node.left.func.attr in CLOCKS]
    written = [node for node in names if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "seconds"]
    return [node.lineno for node in clocks + written]


def test_no_test_asserts_a_time():
    """On a loaded machine it fails; steps and evaluations can be counted, and times belong to doc/studies/bench.py."""
    found = {str(path.relative_to(REPOSITORY)): elapsed_times(path.read_text(encoding="utf-8")) for path in REPOSITORY.glob("tests/**/*.py")}
    assert not {path: lines for path, lines in found.items() if lines}
    assert elapsed_times("assert time.monotonic() - start < 5\nassert seconds(a) > seconds(b)\nassert end < 3") == [1, 2, 2], "control"


COMPARISON = (REPOSITORY / "doc" / "comparison.md").read_text(encoding="utf-8")
CLAIMS = re.findall(r"^\| (.+?) \| `((?:build|tools|doc/studies)/.+?)` \|$", COMPARISON.partition("\n## EVP\n")[2].partition("\n## ")[0], re.M)


@pytest.mark.parametrize("statement, command", CLAIMS, ids=[one[0][:40] for one in CLAIMS])
def test_claim_about_evp_has_a_command(statement, command):
    """Its input script declares each -var, its tool knows each option, its files are there."""
    words = shlex.split(command)
    if words[0] == "build/lmp":
        deck, chosen = (REPOSITORY / words[2]).read_text(encoding="utf-8"), words[4::3]
        assert words[1] == "-in" and words[3::3] == ["-var"] * len(chosen) and all(re.search(rf"^variable {name} +index ", deck, re.M) for name in chosen), statement
    else:
        text = help_of(words[0])
        assert all(re.search(re.escape(word) + r"\b", text) for word in words if word.startswith("--")), statement


# ---- decks ----

TEXT = {path.name: path.read_text(encoding="utf-8") for path in sorted(DECKS.glob("in.*"))}
PLAIN = ("in.pull", "in.metal", "in.ball")
CHOOSING = [name for name in TEXT if name not in PLAIN]
LOADS = ("in.traction", "in.cyclic", "in.quasistatic", "in.torsion", "in.bending")


def choices(name):
    """{choice: its line, and a comment above it} of a deck."""
    head = re.split(r"\nevp_choices \S+ (?!implied)", TEXT[name].partition("# -------- choices")[2])[0].replace("&\n", "")
    return {found[1]: found[0] for found in re.finditer(r"^(?:# .*\n)?variable +(\w+) +index .*$", head, re.M)}


def included(text):
    """Texts of the files that a deck includes, and of those that they do."""
    parts = [(DECKS / f"{part}.lmp").read_text(encoding="utf-8") for part in re.findall(r"\${here}/(\w+)\.lmp", text)]
    return "".join(part + included(part) for part in parts)


def test_decks_have_no_line_that_is_cut_off():
    """A comment stands beside a statement where both fit in 100 columns. No choice in the decks that stand first."""
    quoted = re.compile(r'"[^"]*"|\'[^\']*\'')
    long = [f"{path.name}:{k}" for path in sorted([*DECKS.glob("in.*"), *DECKS.rglob("*.lmp")]) for k, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
            if len(line) > 160 or len(line) > 100 and re.match("[^#]+# ", quoted.sub("", line))]
    assert not long and not any(re.search(r"^if | index |\${", TEXT[name], flags=re.M) for name in PLAIN)


@pytest.mark.parametrize("name", CHOOSING)
def test_about_twelve_choices_which_one_command_prints(name):
    """It warns of others, such as a misspelled -var."""
    found = choices(name)
    assert 3 < len(found) <= 14
    printed = re.search(rf"^evp_choices +{re.escape(name)} (?!implied)((?:.*&\n)*.*)$", TEXT[name], flags=re.M)[1].replace("&\n", "")
    *printed, last = printed.split()
    assert {re.match(r"\w*", word)[0] for word in printed if "?" not in word} - {"coeff_ball", "coeff_particle", "coeff_right"} == set(found) and last == "only"
    body = TEXT[name].partition(" only\n")[2]
    body += included(body)
    assert all("# " in line and re.search(rf"\$\{{{choice}\}}|\bv_{choice}\b", body) for choice, line in found.items()), "each is explained and used"


def test_what_decks_and_frames_tell_each_other():
    """frames.lmp needs to know how long a deck with the choice `also` is; it reads nothing else that no variable of its own has, and defines nothing of theirs."""
    def defined(text):
        return set(re.findall(r'^ *variable +(\w+)|"variable (\w+)', text, re.M))

    frames = re.sub(r"#.*", "", (DECKS / "frames.lmp").read_text(encoding="utf-8"))
    own = {"".join(names) for names in defined(frames)}
    given = set(re.findall(r"is_defined\(variable,(\w+)\)", frames)) | {"k", "out"}  # k goes with last
    assert set(re.findall(r"\bv_(\w+)|\$\{(\w+)\}", frames)) <= {pair for name in own | given for pair in ((name, ""), ("", name))}
    for name, text in TEXT.items():
        if "include         ${also}" not in text:
            continue
        whole = text + included(text)
        theirs = {"".join(names) for names in defined(re.sub(r"#.*", "", whole))}
        assert theirs & {"last", "nsteps", "duration"} and not theirs & own, name
        assert "last" not in theirs or "k" in theirs, name


def test_load_decks_take_body_and_material_by_the_same_lines():
    """So that in.traction stands for them in tests/lammps/test_body_file.py."""
    choices = re.search(r"^variable specimen .*?^variable break .*?$", TEXT["in.traction"], re.M | re.S)[0]
    text = {name: TEXT[name].replace(f"evp_choices {name} ", "evp_choices in.traction ") for name in LOADS}
    assert all(choices in text[name] and "${here}/body.lmp" in text[name] for name in LOADS)


# ---- src/: the core knows no LAMMPS, and arrows point one way ----

SOURCES = REPOSITORY / "src"
INCLUDE = re.compile(r'^#include "([^"]+)"', re.M)
STYLES = ("pair_evp", "fix_", "compute_", "commands")


def node_of(path):
    """A header and its .cpp are one node, named by folder and stem."""
    return str(path.relative_to(SOURCES).with_suffix(""))


def include_graph():
    """Node: nodes of src/ that it includes, and names of headers from elsewhere."""
    own, foreign = {}, {}
    for path in sorted(SOURCES.rglob("*.*")):
        node = node_of(path)
        for name in INCLUDE.findall(path.read_text(encoding="utf-8")):
            found = [SOURCES / name] if (SOURCES / name).exists() else []
            if found:
                own.setdefault(node, set()).add(node_of(found[0]))
            else:
                foreign.setdefault(node, set()).add(name)
        own.setdefault(node, set()).discard(node)
    return own, foreign


def test_the_core_includes_nothing_but_the_core():
    own, foreign = include_graph()
    core = [node for node in own if node.startswith("core/")]
    assert len(core) > 10
    for node in core:
        assert not foreign.get(node), f"{node} includes {foreign[node]}"
        assert all(other.startswith("core/") for other in own[node]), f"{node} includes {own[node]}"


def test_includes_have_no_circle_and_powers_are_for_the_law_and_the_kernel_alone():
    own, _ = include_graph()
    graphlib.TopologicalSorter(own).prepare()  # CycleError names the circle
    users = {node for node, others in own.items() if "core/law/powers" in others}
    assert len(own) > 30 and "core/law/law" in users and users <= {"core/law/law", "core/pairs/pair_block"}


@pytest.mark.parametrize("style", ["pairs/pair_evp_lj", "bonds/fix_evp_bonds"])
def test_the_pair_style_and_the_bonds_fix_do_not_know_each_other(style):
    own, _ = include_graph()
    reached, left = set(), [f"lammps/{style}"]
    while left:
        node = left.pop()
        reached.add(node)
        left += [other for other in own[node] if other not in reached]
    styles = [node for node in reached if node.split("/")[-1].startswith(STYLES)]
    assert styles == [f"lammps/{style}"]
