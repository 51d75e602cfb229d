# SPDX-License-Identifier: GPL-2.0-only
"""tools/cost.py: the steps of its forecast are those of the whole run, its errors those of doc/accuracy_errors.csv; it leaves no file."""

import csv
import os
import re
import subprocess
import sys

import pytest
from lammps_run import LMP, REFERENCE, REPOSITORY
from small_bodies import head, pair

DECKS = REPOSITORY / "lammps_inputs"
ALUMINIUM = REPOSITORY / "potentials" / "metals.evp:aluminium_2024T351"
with open(REPOSITORY / "doc" / "accuracy_errors.csv", newline="", encoding="utf-8") as source:
    MEASURED = {(row["deck"], row["load"], row["choice"], float(row["value"])): float(row["error_percent"]) for row in csv.DictReader(source)}


def cost(folder, *words):
    """The tool, which leaves its folder as it is."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    done = subprocess.run([sys.executable, str(REPOSITORY / "tools" / "cost.py"), *map(str, words)], cwd=folder, text=True, timeout=120, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env={**os.environ, "EVP_LMP": str(LMP)})
    assert before == {path.name: path.read_bytes() for path in folder.iterdir()}
    return done


def test_steps_of_a_run(tmp_path, lmp):
    choices = "-var", "specimen", REFERENCE, "-var", "rate", "0.5"
    said = cost(tmp_path, "--seconds", "1", "--ranks", 2, DECKS / "in.traction", *choices).stdout
    steps, each, minutes, seconds = re.search(r"500 spheres, 2 MPI ranks: (\d+) steps of (\S+) ms: (?:(\d+) min )?(\d+) s\n", said).groups()
    whole = 60 * int(minutes or 0) + int(seconds)
    assert abs(whole - 1e-3 * int(steps) * float(each)) <= 0.5 + 0.01 * whole
    told = lmp("in.traction", variables={"specimen": REFERENCE, "rate": "0.5", "strain": "1e-4", "out": "short"}).stdout
    assert int(steps) == 200 * int(re.search(r"largest stable one, (\d+) steps", told)[1])  # of a strain of 0.02
    error = MEASURED["in.traction", "Tension to 2 % at 1/s", "dtfraction", 0.4]
    assert f"dtfraction 0.4 {error:.2g} %, 500 spheres 11 %, packing of 500" in said


def test_minimizations_and_effects(tmp_path):
    choices = "-var", "specimen", REFERENCE, "-var", "material", ALUMINIUM, "-var", "cycles", "1", "-var", "pace", "0.05"
    said = cost(tmp_path, "--seconds", "1", DECKS / "in.quasistatic", *choices).stdout
    assert re.search(r"500 spheres, 1 MPI rank: about \d+ s to go", said)
    shares = dict(re.findall(r"(Pair|Modify|Neigh) (\d+) %", said))
    assert 50 < sum(map(int, shares.values())) <= 101
    assert 5 < int(re.search(r"(\d+) % of a step for fix volume evp/volume", said)[1]) < 95
    # below the smallest pace that was measured: its error
    smallest = min(value for deck, load, choice, value in MEASURED if (deck, load, choice) == ("in.quasistatic", "Tension to 2 % and back", "pace"))
    error = MEASURED["in.quasistatic", "Tension to 2 % and back", "pace", smallest]
    assert f"as measured in 'Tension to 2 % and back': pace 0.05 below {error:.2g} %" in said


def test_a_script_that_ends_at_once(tmp_path, lmp):
    choices = {"specimen": REFERENCE, "strain": "2e-4", "increment": "1e-4"}
    said = cost(tmp_path, "--seconds", "5", DECKS / "in.quasistatic", *(word for name, value in choices.items() for word in ("-var", name, value))).stdout
    lmp("in.quasistatic", variables={**choices, "out": "pulled"}, flags=["-log", "told"]).ok()
    iterations = re.findall(r"^Loop time of .* for (\d+) steps", (tmp_path / "told").read_text(encoding="utf-8"), re.M)
    assert f"it ended within this time, after {sum(map(int, iterations))} iterations in" in said


def test_legs_whose_length_is_found_on_the_way(tmp_path, lmp):
    """The first leg alone is counted; a rate beyond those that were measured, and what the script warns of, are told."""
    choices = "-var", "specimen", REFERENCE, "-var", "material", ALUMINIUM, "-var", "cycles", "2"
    said = cost(tmp_path, "--seconds", "1", DECKS / "in.cyclic", *choices, "-var", "rate", "1", "-var", "strian", "0.1").stdout
    steps = int(re.search(r"at most (\d+) steps of .* for the first 1 of 4 runs, and the others on top\n", said)[1])
    told = lmp("in.traction", variables={"specimen": REFERENCE, "material": ALUMINIUM, "rate": "100", "out": "pulled"}).stdout
    timestep, share = map(float, re.search(r"timestep (\S+) s = (\S+) of the largest stable one", told).groups())
    assert steps == pytest.approx(0.02 / (0.4 * timestep / share), rel=0.05)  # of a strain of 0.02 at 1/s
    assert "rate 1 below" in said and "WARNING: in.cyclic has no choice 'strian'" in said


OWN = head(boundary="s s s", skin=0.0004) + pair(contact="none plasticity isotropic") + """fix integrate all nve
fix energy all evp/energy
dump all all custom 1000 own.dump id x
timestep 1e-7
minimize 0 1e-6 100 1000
run 3000
run 200000 upto
print "WARNING: nothing rests"
write_data end.data
"""


def test_a_script_of_ones_own(tmp_path):
    """Its results stay what they are, its minimization is no step, 'upto' counts from the start, and what it warns of once its run was cut short is not told."""
    (tmp_path / "body.data").write_bytes(REFERENCE.read_bytes())
    for name in ("own.dump", "end.data", "log.lammps"):
        (tmp_path / name).write_text("mine", encoding="utf-8")
    (tmp_path / "own.in").write_text(OWN, encoding="utf-8")
    done = cost(tmp_path, "--seconds", "1", "own.in")
    assert re.search(r"own.in, 500 spheres, 1 MPI rank: 200000 steps of \S+ ms: .*, and \d+ s of minimization so far\n", done.stdout), done.stdout
    assert re.search(r"\d+ % of a step for fix energy evp/energy", done.stdout) and "not measured for this script" in done.stdout
    assert "nothing rests" not in done.stdout


@pytest.mark.parametrize("words, expected", [
    (["none.in"], "there is no file"),
    ([DECKS / "in.traction", "-var", "specimen", "none.data"], "in.traction failed .*none.data"),
    (["--seconds", "0", DECKS / "in.traction"], "argument --seconds: give a whole number of 1 or more, got 0"),
])
def test_what_does_not_run(tmp_path, words, expected):
    done = cost(tmp_path, *words)
    assert done.returncode and re.search(expected, done.stdout) and "Traceback" not in done.stdout
