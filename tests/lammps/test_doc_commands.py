# SPDX-License-Identifier: GPL-2.0-only
"""Each block of README, CONTRIBUTING and the Howto pages is run here, or named here with the test that uses it, or with the reason why none does.
The tutorial: test_doc_tutorial.py."""

import re
from typing import NamedTuple

import doc_blocks
import numpy as np
import pytest
from lammps_run import REFERENCE, REPOSITORY, run_lammps

PAGES = ("README.md", "CONTRIBUTING.md", *sorted(str(path.relative_to(REPOSITORY)) for path in REPOSITORY.glob("doc/Howto_evp*.rst")))
HOWTO, PAPER, PART, METAL = "doc/Howto_evp.rst", "doc/Howto_evp_paper.rst", "doc/Howto_evp_part.rst", "doc/Howto_evp_metal.rst"
FRICTION, CLUSTER = "doc/Howto_evp_friction.rst", "doc/Howto_evp_cluster.rst"
HEAT, HEAT_FIX = "doc/Howto_evp_heat.rst", "doc/fix_evp_heat.rst"
BLOCKS = [block for page in PAGES for block in doc_blocks.blocks(page)]

# Small bodies and short ways, since what is tested is that the commands work: choices that win over those of the page, by deck.
SHORT = {
    "in.specimen": "-var n 200", "in.traction": "-var strain 0.002 -var row 0.0005", "in.cyclic": "-var strain 0.002 -var rate 100",
    "in.quasistatic": "-var strain 0.001 -var restart 0", "in.torsion": "-var angle 0.002 -var increment 0.001",
    "in.bending": "-var strain 0.002 -var increment 0.001",
}
SPECIMEN = "lmp -in lammps_inputs/in.specimen -var n 200 -var out my.data"
BAR = "lmp -in lammps_inputs/in.specimen -var n 200 -var shape block -var length 0.1 -var width 0.01 -var height 0.02 -var out bar.data"


class Run(NamedTuple):
    """A block that is run: words that only it has, commands before it, choices that differ from SHORT, other words for some of its words, the file
    that it writes last."""

    page: str
    words: str
    written: str
    before: tuple = ()
    short: dict = {}
    texts: tuple = ()


RUNS = (
    Run("README.md", "tools/calibrate.py --E", "part_state.dump", short={"in.quasistatic": "-var strain 0.003"},
        texts=(("tools/body.py lammps_inputs/dog_bone.stl --axis z --unit mm --n 800 --out part.data", "lmp -in lammps_inputs/in.specimen -var out part.data"),
               ("--out my.evp", "--spheres 250 --out my.evp || [ $? -eq 3 ]"))),  # body.py: test_doc_tutorial.py
    Run("README.md", "tools/view.py part_state.dump", "part.png",
        (SPECIMEN.replace("my.data", "part.data"), "lmp -in lammps_inputs/in.quasistatic -var specimen part.data -var material potentials/metals.evp:aluminium_1100O "
         "-var strain 0.001 -var increment 0.00005 -var cycles 1 -var lower release -var restart 0 -var out part")),
    Run(PAPER, "in.specimen -var n 500 -var seed 1", "table2.csv", short={"in.traction": "-var strain 0.001 -var row 0.0005 -var rate 50"}),
    Run(PAPER, "1000 1.5\" -var strain 0.0105", "table2.csv"),
    Run(HOWTO, "-var resume yes", "rest.csv", short={"in.quasistatic": ""}, texts=(("-var strain 0.05", "-var strain 0.0205"),)),
    Run(HOWTO, "in.bending -var specimen bar.data", "bending.csv", (BAR,)),
    Run(PAPER, "tools/curves.py rate", "twin.csv", (SPECIMEN,), {"in.traction": "-var strain 0.01 -var rate 200"}),
    Run(PAPER, "-var integrator implicit", "table2.csv"),
    Run(PART, "-var region plate.region -var out plate.data", "plate.data"),
    Run(METAL, "in.indent -var", "flat.csv", (
        SPECIMEN.replace("my.data", "part.data"),
        "printf '# UNITS: si\\nmymetal 413.894 8 4 2.82104 8 4 0.000750965 0 1.5 spacing 0.00694888 coordination 11.5667 kv 1865.24 density 2700\\n' > my.evp"),
        {"in.indent": "-var increments 2", "in.upset": "-var strain 0.05"}),
    Run(METAL, "--name quick", "my.evp"),
    Run("doc/Howto_evp_contacts.rst", '-var contact "join 1.2 all"', "weld.csv", short={"in.weld": "-var press 0.05 -var pull 0.02"}),
    Run(FRICTION, "in.sliding -var block block.data", "sliding.csv", short={"in.specimen": "-var n 100", "in.sliding": "-var speed 0.3"}),
    Run(HEAT, "in.specimen -var n 500", "my.data"),
)
WALK = "the walk of the page, with fewer spheres"
# (page, test file that uses the block, or '' for none; what it does with it, or why there is none): words that only the block has.
PROJECT, TUTORIAL, CALIBRATE = "tests/tools/test_project_files.py", "tests/lammps/test_doc_tutorial.py", "tests/lammps/test_calibrate_runs.py"
NAMED = {
    ("README.md", "", "set-up and all tests: what continuous integration runs itself, see .github/workflows/ci.yml"): ("tools/quickstart.sh",),
    ("CONTRIBUTING.md", PROJECT, "too long; its commands, options and paths are checked"): ("tools/test.sh ", "evp_find_python", "tests/maintain/releases.sh"),
    (HOWTO, "tests/tools/test_view.py", "runs it as it stands"): ("tools/view.py torn_frames.dump",),
    (PAPER, "", "printed by curves.py rate for 500 spheres; tests/tools/test_rates.py tests the tool"): ("expected at 10/s with E",),
    (PART, TUTORIAL, WALK): ("tools/body.py lammps_inputs/dog_bone.stl", "dog_bone.stl: 1152 triangles", "in.quasistatic -var specimen bone.data",
                             "tools/curves.py numbers bone.csv", "bone.csv   20.868"),
    (PART, "tests/lammps/test_doc_commands.py", "is the file plate.region of the commands above it"): ("region hole cylinder",),
    (PART, "tests/lammps/test_press.py", "runs it with fewer spheres"): ("tools/tool.py lammps_inputs/wedge.stl",),
    (FRICTION, "tests/lammps/test_forming.py", "runs it on a block"): ("region          punch cone",),
    (FRICTION, "tests/lammps/test_granular.py", "runs it"): ("pair_style      hybrid evp/lj",),
    (HEAT, "tests/lammps/test_doc_commands.py", "runs the input scripts, test_heat_*"): ("# grips hold their temperature", "add/heat linear", "expansion 2.3e-5 293"),
    (HEAT, "tests/lammps/test_doc_commands.py", "runs the deck with the file, test_heat_in_a_deck"): ("heat_rows all print", "-var also heat.lmp"),
    (METAL, "", "takes minutes; tests/tools/test_calibration.py tests its keywords and bars, test_failure.py and test_heat.py how spheres fail and soften"): ("--name failing", "--name heated"),
    (CLUSTER, "", "need a cluster"): ("module load lammps\nevp doctor", "#SBATCH"),
    (CLUSTER, "tests/lammps/test_doc_commands.py", "runs the file, test_files_of_a_large_run"): ("dump_modify     parts nfile 2",),
    (METAL, CALIBRATE, "tests the option with another row"): ("tension at 298 K:",),
    (METAL, CALIBRATE, WALK): ("--ranks 1 --name mymetal", "pass 1, elastic: E ", "in.specimen -var n 300", "-var increment 0.00025", "tools/curves.py numbers pull.csv",
                               "pull.csv   76"),
}


def block_of(page, words):
    """The one block of the page with these words."""
    found = [block for block in BLOCKS if block.page == page and words in block.text]
    assert len(found) == 1, f"{len(found)} blocks of {page} hold '{words}'"
    return found[0]


def test_every_block_is_run_or_named():
    known = [block_of(one.page, one.words) for one in RUNS] + [block_of(page, one) for (page, *_), words in NAMED.items() for one in words]
    unknown = [block for block in BLOCKS if block not in known]
    assert not unknown, "run it, or name it with a reason: " + "\n".join(f"{one.page}: {one.text}" for one in unknown)
    assert len(known) == len(set(known)), "a block is named twice"
    for page, test, _ in NAMED:
        if test:
            text = doc_blocks.read(test)
            assert page.rpartition("/")[2] in text or "README" in text and page == "README.md", f"{test} does not read {page}"


@pytest.mark.parametrize("one", RUNS, ids=lambda one: one.words[:30])
def test_commands_work(tmp_path, one):
    doc_blocks.prepare(tmp_path)
    (tmp_path / "plate.region").write_text(block_of(PART, "region hole cylinder").text, encoding="utf-8")
    text = block_of(one.page, one.words).text
    for words, other in one.texts:
        assert words in text
        text = text.replace(words, other)
    commands = [doc_blocks.shorter(command, {**SHORT, **one.short}) for command in doc_blocks.Block(one.page, text).commands()]
    doc_blocks.run([*one.before, *commands], tmp_path)
    assert (tmp_path / one.written).stat().st_size > 50


def test_heat_howto_runs_as_it_stands(tmp_path):
    """All input scripts, on the body of the page: temperatures are those of the page, near its formulas, and the heat account closes."""
    page = doc_blocks.read(HEAT)
    doc_blocks.prepare(tmp_path)
    doc_blocks.run(block_of(HEAT, "in.specimen -var n 500").commands(), tmp_path)
    stretched, cooled = (run_lammps(block_of(HEAT, words).text, 1, {}, tmp_path).ok().thermo() for words in ("# grips hold their temperature", "add/heat linear"))
    means = [float(value) for value in re.search(r"reach ([\d.]+) K on average(?s:.+?)reaches ([\d.]+) K", page).groups()]
    assert [stretched["c_mean"][-1], stretched["f_heat[6]"][-1]] == pytest.approx(means, abs=3.0)
    assert means[0] - 293 == pytest.approx(float(re.search(r"formula above gives ([\d.]+) K", page)[1]), rel=0.1), "less near the grips"
    assert cooled["c_mean"][-1] == pytest.approx(float(re.search(r"mean temperature is ([\d.]+) K", page)[1]), abs=0.1)
    assert cooled["c_mean"][-1] == pytest.approx(float(re.search(r"= ([\d.]+) K\.", page)[1]), abs=1.0)
    held = run_lammps(block_of(HEAT, "expansion 2.3e-5 293").text, 1, {}, tmp_path).ok().stdout
    stresses = [float(value) for value in re.search(r"prints (-[\d.]+) MPa when heated and (-[\d.]+) MPa when pressed", page).groups()]
    assert [1e-6 * float(value) for value in re.findall(r"^(?:heated by 50 K|pressed by 50 ALPHA): (\S+) Pa", held, re.M)] == pytest.approx(stresses, abs=0.06)
    for thermo in (stretched, cooled):
        assert abs(thermo["f_heat"]).max() < 1e-9 * max(abs(thermo["f_heat[1]" if thermo is stretched else "f_heat[2]"]))


def test_heat_in_a_deck(tmp_path):
    """The file of the page, taken in by the deck of the page, of whose commands material and speed are used."""
    (tmp_path / "heat.lmp").write_text(block_of(HEAT, "heat_rows all print").text.replace("lammps_inputs/", f"{REPOSITORY}/lammps_inputs/"), encoding="utf-8")
    command = block_of(HEAT, "-var also heat.lmp").text
    assert "in.upset -var specimen my.data -var material potentials/metals.evp:aluminium_2024T351 -var speed 3 -var also heat.lmp -var out hot" in command
    run_lammps("in.specimen", 1, {"n": 200, "out": "my.data"}, tmp_path).ok()
    material = f"{REPOSITORY}/potentials/metals.evp:aluminium_2024T351"
    run_lammps("in.upset", 1, {"specimen": "my.data", "material": material, "speed": 3, "strain": 0.06, "also": "heat.lmp", "out": "hot"}, tmp_path).ok()
    rows = np.genfromtxt(tmp_path / "hot_heat.csv", delimiter=",", names=True)
    assert rows["mean"][0] == pytest.approx(298.0, abs=0.1) and 308.0 > rows["mean"][-1] > 304.0 and rows["highest"][-1] > rows["mean"][-1]


def test_heat_input_of_the_fix(tmp_path):
    """The crystal of doc/fix_evp_heat.rst prints what the page says."""
    page = doc_blocks.read(HEAT_FIX)
    script = next(one.text for one in doc_blocks.blocks(HEAT_FIX) if "create_atoms" in one.text)
    crystal = run_lammps(script, 2, {}, tmp_path).ok().thermo()
    power, closed = (float(value) for value in re.search(r"left layer: ([\d.]+) W\.(?s:.+?)= ([\d.]+) W", page).groups())
    measured = (crystal["c_out"][-1] - crystal["c_out"][-2]) / (crystal["Time"][-1] - crystal["Time"][-2])
    assert measured == pytest.approx(power, rel=1e-3) and power == pytest.approx(closed, rel=0.01)


def test_files_of_a_large_run(tmp_path):
    """On two ranks: a slice, all spheres in two files, a profile, and the last restart file of the deck, which one rank reads."""
    text = block_of(CLUSTER, "dump_modify     parts nfile 2").text.replace("100 100 10000", "5 10 50").replace("10000", "50")
    (tmp_path / "cluster.lmp").write_text(text, encoding="utf-8")
    run_lammps("in.traction", 2, {"specimen": REFERENCE, "rate": 50, "strain": 0.002, "also": "cluster.lmp"}, tmp_path).ok()
    slice_of, parts = (sum(line.count(" ") > 3 and not line.startswith("ITEM") for line in text.splitlines())
                       for text in ((tmp_path / "slice.dump").read_text(), "".join(path.read_text() for path in tmp_path.glob("parts.50.?.dump"))))
    assert parts == 500 and 10 < slice_of and len((tmp_path / "profile.txt").read_text().splitlines()) > 20
    again = "read_restart traction.0.restart\nfix bonds all evp/bonds\nrun 0\n"
    assert "500 atoms" in run_lammps(again, 1, {}, tmp_path).ok().stdout
