# SPDX-License-Identifier: GPL-2.0-only
"""The files of a public project: workflows and claims of doc/comparison.md whose commands exist and accept their options, dependencies."""

import ast
import importlib.util
import itertools
import os
import pathlib
import re
import shlex
import subprocess

import pytest
import yaml

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
WORKFLOWS = sorted(REPOSITORY.glob(".github/workflows/*.yml"))
OF_SETUP = {"tools/test.sh"}  # hands its options on to tools/setup.sh


def load(path):
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def steps(path):
    """(job, step) of a workflow."""
    return [(job, step) for job in load(path)["jobs"].values() for step in job["steps"]]


def expanded(command, job):
    """The command for each row of the matrix of its job."""
    matrix = job.get("strategy", {}).get("matrix", {})
    names = [name for name in matrix if f"matrix.{name} " in command]
    for values in itertools.product(*(matrix[name] for name in names)):
        text = command
        for name, value in zip(names, values):
            text = text.replace(f"${{{{ matrix.{name} }}}}", str(value))
        yield text


def help_of(program):
    path = REPOSITORY / program
    assert path.is_file() and os.access(path, os.X_OK), f"{program} is not there or cannot be run"
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY / "tools")}
    words = ["python3", "-m", "evp.quickstart"] if program == "tools/quickstart.sh" else [str(path)]
    words = [os.environ.get("PYTHON", "/usr/bin/python3") if word == "python3" else word for word in words]
    if program.endswith(".py"):
        words = [os.environ.get("PYTHON", "/usr/bin/python3"), *words]
    done = subprocess.run([*words, "--help"], capture_output=True, text=True, env=environment, check=False, timeout=60)
    assert done.returncode == 0, f"{program} --help: {done.stderr}"
    return done.stdout


def own_programs(text):
    """(program, options) of the lines of a script that start programs of this repository."""
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words and re.match(r"(tools|tests/maintain|\.ci)/", words[0]) and "*" not in words[0]:
            yield words[0], [word for word in words[1:] if word.startswith("--")], words[1:]


def check_options(program, options, words):
    """The program is there, its help has the options, and those values that are choices."""
    assert os.access(REPOSITORY / program, os.X_OK), f"{program} is not there or cannot be run"
    text = help_of("tools/setup.sh" if program in OF_SETUP else program) if options else ""
    for option in options:
        assert re.search(re.escape(option) + r"\b", text), f"{program} knows no {option}"
        value = words[words.index(option) + 1]
        if option in ("--release", "--compiler", "--sizes", "--tests"):
            assert re.search(re.escape(value) + r"(?!\w)", text), f"{program} {option} knows no {value}"


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflow(path):
    """Jobs run on the Debian of the README, steps do one thing, and each command of ours exists with its options and choices."""
    flow = load(path)
    assert flow["name"] == path.stem and (flow.get("on") or flow[True]), "YAML reads a bare on as true"
    checked = 0
    for job, step in steps(path):
        assert ("run" in step) != ("uses" in step), step
        assert "run" not in step or job.get("container") == "debian:12"
        for command in expanded(step.get("run", ""), job):
            assert "${{" not in command, f"nothing stands for it: {command}"
            for program, options, words in own_programs(command):
                check_options(program, options, words)
                checked += 1
    assert checked or path.name == "site.yml"


def test_commands_of_contributing():
    """Of its blocks, which take too long to be run here."""
    text = "".join(re.findall(r"(?:^    .*\n)+", (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.M))
    found = list(own_programs(text.replace("    ", "")))
    for program, options, words in found:
        check_options(program, options, words)
    assert {"tools/setup.sh", "tools/test.sh", "tests/maintain/releases.sh", "tests/maintain/compare_builds.py"} <= {program for program, _, _ in found}
    assert all((REPOSITORY / path).is_file() for path in re.findall(r"tests/\w+/\w+\.py", text))


def modules_of(node):
    """Names that a node of the syntax tree imports."""
    if isinstance(node, ast.Import):
        return [one.name for one in node.names]
    if isinstance(node, ast.ImportFrom) and not node.level:
        return [node.module]
    return [node.args[0].value] if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "importorskip" else []


def imported(*folders):
    """Third-party modules that the Python below these folders imports."""
    paths = (path for folder in folders for path in (REPOSITORY / folder).rglob("*.py"))
    found = {name.split(".")[0] for path in paths for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) for name in modules_of(node)}
    specs = {name: importlib.util.find_spec(name) for name in found}
    return {name for name, spec in specs.items() if spec and spec.origin and {"site-packages", "dist-packages"} & set(pathlib.Path(spec.origin).parts)}


def test_dependencies_are_those_that_are_imported():
    """Of set-up's lists, and of the recipes, which need what the tools need."""
    text = {name: (REPOSITORY / name).read_text(encoding="utf-8") for name in ("tools/env.sh", "tools/setup_packages.sh", "tools/test.sh", "doc/conf.py")}
    required = set(re.search('^EVP_PYTHON_MODULES="(.+)"$', text["tools/env.sh"], re.M)[1].split())
    optional = set(re.findall(r"^(\w+) python3-", text["tools/setup_packages.sh"], re.M))
    with_others = {"PIL": "matplotlib", "docutils": "sphinx", "pygments": "sphinx"}
    by_name = set(re.findall(r'"(myst_parser|sphinx_rtd_theme)"', text["doc/conf.py"])) | set(re.findall("import (xdist)", text["tools/test.sh"])) | {"flake8"}
    assert {with_others.get(name, name) for name in imported("tools", "tests", "doc")} | by_name == required | optional
    tools = {with_others.get(name, name) for name in imported("tools")} - optional
    assert tools <= required
    conda = yaml.safe_load("".join(line for line in (REPOSITORY / "packaging/conda/meta.yaml").read_text(encoding="utf-8").partition("  run:\n")[2]
                                   .partition("\n\n")[0].splitlines(True) if "{{" not in line))
    spack = (REPOSITORY / "packaging/spack/packages/evp/package.py").read_text(encoding="utf-8")
    assert {name.replace("-base", "") for name in conda if not name.startswith("python ")} == tools == set(re.findall(r'"py-(\w+)"', spack))


COMPARISON = (REPOSITORY / "doc" / "comparison.md").read_text(encoding="utf-8")
CLAIMS = re.findall(r"^\| (.+?) \| `((?:build|tools|doc/studies)/.+?)` \|$", COMPARISON.partition("\n## EVP\n")[2].partition("\n## ")[0], re.M)


@pytest.mark.parametrize("statement, command", CLAIMS, ids=[one[0][:40] for one in CLAIMS])
def test_claim_about_evp_has_a_command(statement, command):
    """Its input script declares each -var, its tool knows each option, its files are there."""
    words = shlex.split(command)
    if words[0] == "build/lmp":
        deck = (REPOSITORY / words[2]).read_text(encoding="utf-8")
        chosen = words[4::3]
        assert words[1] == "-in" and words[3::3] == ["-var"] * len(chosen)
        assert all(re.search(rf"^variable {name} +index ", deck, re.M) for name in chosen), statement
    else:
        text = help_of(words[0])
        assert all(re.search(re.escape(word) + r"\b", text) for word in words if word.startswith("--")), statement
