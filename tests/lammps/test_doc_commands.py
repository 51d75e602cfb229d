# SPDX-License-Identifier: GPL-2.0-only
"""Each block of README, CONTRIBUTING and the Howto pages is run here, or named here with the test that uses it, or with the reason why none does."""

import importlib.util
from typing import NamedTuple

import doc_blocks
import pytest
from evp import surface
from lammps_run import REPOSITORY

PAGES = ("README.md", "CONTRIBUTING.md", *sorted(str(path.relative_to(REPOSITORY)) for path in REPOSITORY.glob("doc/Howto_evp*.rst")))
HOWTO, PART, METAL = "doc/Howto_evp.rst", "doc/Howto_evp_part.rst", "doc/Howto_evp_metal.rst"
DOCTOR, FRICTION = "doc/Howto_evp_doctor.rst", "doc/Howto_evp_friction.rst"
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
    Run("README.md", "tools/view.py part_state.dump", "part.png", short={"in.quasistatic": "-var strain 0.001"},
        texts=(("--n 800", "--n 300"), ("aluminium_2024T351", "aluminium_1100O"))),  # the softest row: its increment is fine enough
    Run("README.md", "in.specimen -var n 2000 -var seed 7", "back.csv"),
    Run(HOWTO, "in.specimen -var n 500 -var seed 1", "table2.csv", short={"in.traction": "-var strain 0.001 -var row 0.0005 -var rate 50"}),
    Run(HOWTO, "1000 1.5\" -var strain 0.0105", "table2.csv"),
    Run(HOWTO, "-var resume yes", "rest.csv", short={"in.quasistatic": ""}, texts=(("-var strain 0.05", "-var strain 0.0205"),)),
    Run(HOWTO, "in.bending -var specimen bar.data", "bending.csv", (BAR,)),
    Run(HOWTO, "tools/curves.py cycle", "unloading.png", (SPECIMEN,), {"in.cyclic": "-var rate 100 -var strain 0.006", "in.quasistatic": "-var strain 0.006"}),
    Run(HOWTO, "tools/curves.py rate", "twin.csv", (SPECIMEN,), {"in.traction": "-var strain 0.02 -var rate 100"}),
    Run(HOWTO, "-var integrator implicit", "table2.csv"),
    Run(PART, "-var region plate.region -var out plate.data", "plate.data", ("@region",)),
    Run(METAL, "in.indent -var", "flat.csv", (
        SPECIMEN.replace("my.data", "part.data"),
        "printf '# UNITS: si\\nmymetal 413.894 8 4 2.82104 8 4 0.000750965 0 1.5 spacing 0.00694888 coordination 11.5667 kv 1865.24 density 2700\\n' > my.evp"),
        {"in.indent": "-var increments 2", "in.upset": "-var strain 0.05"}),
    Run(FRICTION, "in.sliding -var block block.data", "sliding.csv", short={"in.specimen": "-var n 100", "in.sliding": "-var speed 0.3"}),
)
WALK = "the walk of the page, with fewer spheres"
# (page, words that only this block has): (test file that uses it, or '' for none; what it does with it, or why there is none).
NAMED = {
    ("README.md", "tools/quickstart.sh"): ("", "set-up and all tests: what continuous integration runs itself, see .github/workflows/ci.yml"),
    ("README.md", "cmake --install build"): ("", "paths of the reader; tests/tools/test_install.py installs, tests/lammps/test_host_guard.py builds"),
    ("README.md", "units           si"): ("tests/lammps/test_readme.py", "runs the input script"),
    ("CONTRIBUTING.md", "tools/test.sh "): ("tests/tools/test_project_files.py", "too long; its commands and options are checked"),
    ("CONTRIBUTING.md", "evp_find_python"): ("tests/tools/test_project_files.py", "starts tests, as tools/test.sh does; its paths are checked"),
    ("CONTRIBUTING.md", "tests/maintain/releases.sh"): ("tests/tools/test_project_files.py", "too long; its commands and options are checked"),
    (HOWTO, "tools/view.py torn_frames.dump"): ("tests/tools/test_view_page.py", "runs it as it stands"),
    (HOWTO, "expected at 10/s with E"): ("", "printed by curves.py rate for 500 spheres; tests/tools/test_rates.py tests the tool"),
    (PART, "tools/body.py tests/data/parts/dog_bone.stl"): ("tests/lammps/test_body_tool.py", WALK),
    (PART, "dog_bone.stl: 1152 triangles"): ("tests/lammps/test_body_tool.py", WALK),
    (PART, "in.quasistatic -var specimen bone.data"): ("tests/lammps/test_body_tool.py", WALK),
    (PART, "tools/curves.py numbers bone.csv"): ("tests/lammps/test_body_tool.py", WALK),
    (PART, "bone.csv   20.868"): ("tests/lammps/test_body_tool.py", WALK),
    (PART, "region hole cylinder"): ("tests/lammps/test_doc_commands.py", "is the file plate.region of the commands above it"),
    (FRICTION, "pair_style      hybrid evp/lj"): ("tests/lammps/test_granular.py", "runs it"),
    (DOCTOR, "evp doctor --lmp /path/to/lmp"): ("tests/tools/test_doctor.py", "paths of the reader; each option is tested"),
    (DOCTOR, "FAULT        plugin path"): ("tests/tools/test_doctor.py", "written by doc/studies/doctor_page.py; compared with a run"),
    (DOCTOR, "Healthy: lmp loads"): ("", "written by doc/studies/doctor_page.py, like the block above it"),
    (DOCTOR, "strings evpplugin.so"): ("", "binutils are no part of the setup; tests/tools/test_doctor.py reads the same text"),
    (METAL, "--ranks 1 --name mymetal"): ("tests/lammps/test_calibrate_runs.py", WALK),
    (METAL, "--body bar.data"): ("tests/lammps/test_calibrate_runs.py", "runs these options, with a bar of its own and fewer spheres"),
    (METAL, "run 1: E "): ("tests/lammps/test_calibrate_runs.py", WALK),
    (METAL, "in.specimen -var n 300"): ("tests/lammps/test_calibrate_runs.py", WALK),
    (METAL, "-var increment 0.00025"): ("tests/lammps/test_calibrate_runs.py", WALK),
    (METAL, "tools/curves.py numbers pull.csv"): ("tests/lammps/test_calibrate_runs.py", WALK),
    (METAL, "pull.csv   68.952"): ("tests/lammps/test_calibrate_runs.py", WALK),
}


def block_of(page, words):
    """The one block of the page with these words."""
    found = [block for block in BLOCKS if block.page == page and words in block.text]
    assert len(found) == 1, f"{len(found)} blocks of {page} hold '{words}'"
    return found[0]


def test_every_block_is_run_or_named():
    known = [block_of(one.page, one.words) for one in RUNS] + [block_of(*key) for key in NAMED]
    unknown = [block for block in BLOCKS if block not in known]
    assert not unknown, "run it, or name it with a reason: " + "\n".join(f"{one.page}: {one.text}" for one in unknown)
    assert len(known) == len(set(known)), "a block is named twice"
    for (page, _), (test, reason) in NAMED.items():
        assert reason
        if test:
            text = doc_blocks.read(test)
            assert page.rpartition("/")[2] in text or "README" in text and page == "README.md", f"{test} does not read {page}"


def test_a_new_block_is_noticed(tmp_path, monkeypatch):
    """In each of the ways in which a page can have one."""
    monkeypatch.setattr(doc_blocks, "REPOSITORY", tmp_path)
    (tmp_path / "a.md").write_text("text\n\n    one\n    two\n\n```bash\nthree \\\n  four\n```\n", encoding="utf-8")
    (tmp_path / "a.rst").write_text("text::\n\n   one\n\nmore\n\n.. parsed-literal::\n\n   two\n\n.. code-block:: bash\n   :caption: c\n\n   three\n"
                                    "\n   four\n\n.. math::\n\n   x\n\nend\n", encoding="utf-8")
    assert [one.text for one in doc_blocks.blocks("a.md")] == ["one\ntwo\n", "three \\\n  four\n"]
    assert doc_blocks.blocks("a.md")[1].commands() == ["three    four"]
    assert [one.text for one in doc_blocks.blocks("a.rst")] == ["one\n", "two\n", "three\n\nfour\n"]


def runs():
    """RUNS as parameters; tools/body.py, and so a block with it, needs Open3D."""
    absent = pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="no open3d: " + surface.OPEN3D)
    return [pytest.param(one, id=one.words[:30], marks=[absent] if "tools/body.py" in block_of(one.page, one.words).text else []) for one in RUNS]


@pytest.mark.parametrize("one", runs())
def test_commands_work(tmp_path, one):
    doc_blocks.prepare(tmp_path)
    before = list(one.before)
    if "@region" in before:
        (tmp_path / "plate.region").write_text(block_of(PART, "region hole cylinder").text, encoding="utf-8")
        before.remove("@region")
    short = {**SHORT, **one.short}
    text = block_of(one.page, one.words).text
    for words, other in one.texts:
        assert words in text
        text = text.replace(words, other)
    commands = [doc_blocks.shorter(command, short) for command in doc_blocks.Block(one.page, text).commands()]
    doc_blocks.run([*before, *commands], tmp_path)
    assert (tmp_path / one.written).stat().st_size > 50
