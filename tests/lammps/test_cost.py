# SPDX-License-Identifier: GPL-2.0-only
"""tools/cost.py: the steps of its forecast are those of the whole run, its errors those of doc/accuracy_errors.csv; it leaves no file."""

import csv
import os
import re
import subprocess
import sys

import pytest
from lammps_run import LMP, REFERENCE, REPOSITORY, packed
from small_bodies import head, pair

DECKS = REPOSITORY / "lammps_inputs"
ALUMINIUM = REPOSITORY / "potentials" / "metals.evp:aluminium_2024T351"
with open(REPOSITORY / "doc" / "accuracy_errors.csv", newline="", encoding="utf-8") as source:
    MEASURED = {(row["deck"], row["load"], row["choice"], float(row["value"])): float(row["error_percent"]) for row in csv.DictReader(source)}
UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0, "ms": 1e-3, "MB": 1.0, "GB": 1e3}
plate = packed("plate.data", n=3000, shape="block", length=0.026, width=0.022, height=0.005)


def cost(folder, *words):
    """The tool, which leaves its folder as it is."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    done = subprocess.run([sys.executable, str(REPOSITORY / "tools" / "cost.py"), *map(str, words)], cwd=folder, text=True, timeout=120, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env={**os.environ, "EVP_LMP": str(LMP)})
    assert before == {path.name: path.read_bytes() for path in folder.iterdir()}
    return done


def value(cell):
    """A cell in s or MB; as it is where it has other words."""
    words = cell.split()
    if len(words) % 2 == 0 and all(word in UNITS for word in words[1::2]):
        return sum(float(number) * UNITS[unit] for number, unit in zip(words[::2], words[1::2]))
    return float(cell) if re.fullmatch(r"[\d.e+-]+", cell) else cell


def table(said):
    """[{title: value}] of the table."""
    lines = [re.split(r"\s{2,}", line.strip()) for line in said.partition("spheres  ")[2].splitlines()]
    titles = ["spheres", *lines[0]]
    return [dict(zip(titles, map(value, line))) for line in lines[1:] if len(line) == len(titles)]


def test_steps_of_a_run(tmp_path, lmp):
    choices = "-var", "specimen", REFERENCE, "-var", "rate", "0.5", "-var", "strian", "0.1"
    said = cost(tmp_path, "--seconds", "1", DECKS / "in.traction", *choices).stdout
    (row,) = table(said)
    assert [row[name] for name in ("spheres", "ranks", "hosts", "row")] == [500, 1, 1, "measured"] and 10 < row["memory of a host"] < 500
    assert row["time"] == pytest.approx(row["steps"] * row["a step"], abs=0.6, rel=0.02)
    assert row["core hours"] == pytest.approx(row["steps"] * row["a step"] / 3600, rel=0.3)
    told = lmp("in.traction", variables={"specimen": REFERENCE, "rate": "0.5", "strain": "1e-4", "out": "short"}).stdout
    assert row["steps"] == 200 * int(re.search(r"largest stable one, (\d+) steps", told)[1])  # of a strain of 0.02
    error = MEASURED["in.traction", "Tension to 2 % at 1/s", "dtfraction", 0.4]
    assert f"dtfraction 0.4 {error:.2g} %, 500 spheres 11 %, packing of 500" in said and "there is no variable strian in in.traction" in said


def test_other_bodies_and_ranks(tmp_path):
    """Eight times the spheres: twice the steps, each eight times as long. More ranks than cores: by the formula of the performance page."""
    choices = "-var", "specimen", REFERENCE, "-var", "rate", "0.5"
    said = cost(tmp_path, "--seconds", "1", "--n", 4000, "--ranks", 1, 2, 4096, "--hosts", 1, DECKS / "in.traction", *choices).stdout
    rows = {(row["spheres"], row["ranks"]): row for row in table(said)}
    cores = max(ranks for n, ranks in rows if n == 500)
    assert set(rows) == {(500, ranks) for ranks in {1, min(2, cores), cores}} | {(4000, ranks) for ranks in (1, 2, 4096)}
    few, many = rows[500, 1], rows[4000, 1]
    assert many["steps"] == 2 * few["steps"] and many["a step"] == pytest.approx(8 * few["a step"], rel=0.01) and many["row"] == "scaled"
    host, surface = map(float, re.search(r"r of them on each host: 1/\(1 \+ (\S+) \(r - 1\) \+ (\S+) \(R/N\)\^\(1/3\)\)", (REPOSITORY / "doc" / "performance.md").read_text(encoding="utf-8")).groups())
    speed = {(n, ranks): ranks / (1 + host * (ranks - 1) + surface * (ranks / n) ** (1 / 3)) if ranks > 1 else 1.0 for n, ranks in ((500, cores), (4000, 4096))}
    by_model = rows[4000, 4096]
    assert by_model["a step"] == pytest.approx(rows[500, cores]["a step"] * 8 * speed[500, cores] / speed[4000, 4096], rel=0.02)
    assert by_model["row"] == "scaled, ranks by the model" and f"{100 * speed[4000, 4096] / 4096:.0f} % on 4096 MPI ranks" in said
    assert cost(tmp_path, "--ranks", 2, "--hosts", 4, DECKS / "in.traction").returncode == 2


def test_minimizations_and_effects(tmp_path):
    choices = "-var", "specimen", REFERENCE, "-var", "material", ALUMINIUM, "-var", "cycles", "1", "-var", "pace", "0.05"
    said = cost(tmp_path, "--seconds", "1", DECKS / "in.quasistatic", *choices).stdout
    share = float(re.search(r"measured: (\S+) % of the steps of in.quasistatic", said)[1])
    assert 1 < share < 100 and table(said)[0]["steps"] > 80 * 20  # of 80 increments
    shares = dict(re.findall(r"(Pair|Modify|Neigh) (\d+) %", said))
    assert 50 < sum(map(int, shares.values())) <= 101
    assert 5 < int(re.search(r"(\d+) % of a step for fix volume evp/volume", said)[1]) < 95
    # below the smallest pace that was measured: its error
    smallest = min(value for deck, load, choice, value in MEASURED if (deck, load, choice) == ("in.quasistatic", "Tension to 2 % and back", "pace"))
    error = MEASURED["in.quasistatic", "Tension to 2 % and back", "pace", smallest]
    assert f"as measured in 'Tension to 2 % and back': pace 0.05 below {error:.2g} %" in said


def test_a_script_that_ends_at_once(tmp_path, lmp):
    """By a whole command, of a run that is to be resumed."""
    choices = {"specimen": REFERENCE, "strain": "2e-4", "increment": "1e-4"}
    words = [LMP, "-echo", "none", "-in", DECKS / "in.quasistatic", *(word for name, value in choices.items() for word in ("-var", name, value)), "-var", "resume", "yes"]
    said = cost(tmp_path, "--seconds", "5", *words).stdout
    assert "of the whole run, with what is done of it: as by -var resume no" in said
    lmp("in.quasistatic", variables={**choices, "out": "pulled"}, flags=["-log", "told"]).ok()
    iterations = re.findall(r"^Loop time of .* for (\d+) steps", (tmp_path / "told").read_text(encoding="utf-8"), re.M)
    assert table(said)[0]["steps"] == sum(map(int, iterations)) and "measured: 100 % of the steps" in said


def test_runs_in_legs(tmp_path, lmp):
    """All legs count, and what the script warns of is told."""
    choices = {"specimen": REFERENCE, "material": ALUMINIUM, "cycles": "2", "rate": "200", "strain": "0.02"}
    said = cost(tmp_path, "--seconds", "1", DECKS / "in.cyclic", *(word for name, value in choices.items() for word in ("-var", name, value)), "-var", "strian", "0.1").stdout
    lmp("in.cyclic", variables={**choices, "out": "pulled"}, flags=["-log", "told"]).ok()
    steps = re.findall(r"^Loop time of .* for (\d+) steps", (tmp_path / "told").read_text(encoding="utf-8"), re.M)
    assert table(said)[0]["steps"] == pytest.approx(sum(map(int, steps)), abs=50) and "at most: " in said
    error = MEASURED["in.cyclic", "Tension to 2 % and back", "rate", 200.0]
    assert f"rate 200 {error:.2g} %" in said and "WARNING: in.cyclic has no choice 'strian'" in said


def test_runs_of_which_each_has_its_timestep(tmp_path, plate, lmp):
    """in.stir has one for each tenth of a turn: its steps go by the time that is left. in.seam pulls two strips, each by the same number of steps."""
    said = cost(tmp_path, "--seconds", "2", DECKS / "in.stir", "-var", "specimen", plate, "-var", "turns", "8").stdout
    turn = int(re.search(r"a turn takes \S+ s, (\d+) steps at first", lmp("in.stir", variables={"specimen": plate, "dwell": "0", "turns": "0", "out": "stir"}).stdout)[1])
    assert 0.9 * 9 * turn < table(said)[0]["steps"] < 1.5 * 9 * turn
    choices = {"stirred": "stir", "from": "0.014", "to": "0.019"}
    said = cost(tmp_path, "--seconds", "1", DECKS / "in.seam", *(word for name, value in choices.items() for word in ("-var", name, value))).stdout
    lmp("in.seam", variables={**choices, "strain": "0.01", "out": "seam"}, flags=["-log", "told"]).ok()
    steps = re.findall(r"^Loop time of .* for (\d+) steps", (tmp_path / "told").read_text(encoding="utf-8"), re.M)
    assert table(said)[0]["steps"] == pytest.approx(0.3 / 0.01 * sum(map(int, steps)), rel=0.05)


OWN = head(boundary="s s s", skin=0.0004) + pair(contact="none plasticity isotropic") + """fix integrate all nve
fix energy all evp/energy
dump all all custom 1000 own.dump id x
timestep 1e-7
minimize 0 1e-6 100 1000
{runs}
print "WARNING: nothing rests"
write_data end.data
"""
FOUR = """\
variable nsteps equal 200000
variable piece loop 4
label piece
if "${piece} > 0" then "run $(v_nsteps/4*v_piece) upto every 1000 'variable x equal 1'"
next piece
jump SELF piece"""


@pytest.mark.parametrize("runs", ["run 3000\nrun 200000 upto", FOUR])
def test_a_script_of_ones_own(tmp_path, runs):
    """Its results stay what they are, its minimization is no step, 'upto' counts from the start, and what it warns of once its run was cut short is not told."""
    (tmp_path / "body.data").write_bytes(REFERENCE.read_bytes())
    for name in ("own.dump", "end.data", "log.lammps"):
        (tmp_path / name).write_text("mine", encoding="utf-8")
    (tmp_path / "own.in").write_text(OWN.replace("{runs}", runs), encoding="utf-8")
    said = cost(tmp_path, "--seconds", "1", "--n", 4000, "own.in").stdout
    assert [(row["spheres"], row["steps"], row["row"]) for row in table(said)] == [(500, 200000, "measured"), (4000, 200000, "scaled")], said
    assert re.search(r"\d+ % of a step for fix energy evp/energy", said) and "not measured for this script" in said
    assert "nothing rests" not in said


@pytest.mark.parametrize("words, expected", [
    (["none.in"], "there is no file"),
    ([DECKS / "in.traction", "-var", "specimen", "none.data"], "in.traction failed .*none.data"),
    (["--seconds", "0", DECKS / "in.traction"], "argument --seconds: give a whole number of 1 or more, got 0"),
])
def test_what_does_not_run(tmp_path, words, expected):
    done = cost(tmp_path, *words)
    assert done.returncode and re.search(expected, done.stdout) and "Traceback" not in done.stdout
