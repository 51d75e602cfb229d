# SPDX-License-Identifier: GPL-2.0-only
"""tests/maintain/compare_builds.py finds a build equal to itself, and names the first difference of files."""

import compare_builds
import pytest
from compare_builds import compare_all, first_difference
from inputs import BUILD, call


def test_a_build_against_itself(tmp_path):
    """Then a row of one of its files is changed."""
    folder = tmp_path / "kept"
    done = call(compare_builds.main, "--old", BUILD, "--new", BUILD, "bits", "--only", "two_spheres", "--folder", folder)
    assert done.returncode == 0 and "4 compared, 0 differ" in done.stdout, done.stderr
    assert "same     two_spheres_1r/two_spheres.csv\n" in done.stdout and "same     two_spheres_2r/screen (thermo)\n" in done.stdout
    path = folder / "new" / "two_spheres_2r" / "two_spheres.csv"
    path.write_text(path.read_text(encoding="utf-8").replace("\n-0.0199", "\n-0.0198"), encoding="utf-8")
    differing = {name: words for name, words in compare_all(folder) if words}
    name = "two_spheres_2r/two_spheres.csv"
    assert list(differing) == [name] and differing[name].startswith("line 3, column 7: old '-0.0199")


THERMO = "words\n   Step  PotEng\n  0  1.5\n{}  10  2.5\nLoop time of 3 on 1 procs\n"


@pytest.mark.parametrize("name, old, new, words", [
    ("a.log", THERMO.format(""), THERMO.format("WARNING: hot\n").replace("words", "other words").replace("of 3", "of 4"), None),
    ("a.log", THERMO.format(""), THERMO.format("").replace("2.5", "2.6"), "line 3, column 6: old '10 2.5', new '10 2.6'"),
    ("a.log", "   Step  PotEng  CPULeft\n  0  1.5  9\nLoop time of 3\n", "   Step  PotEng  CPULeft\n  0  1.5  8\nLoop time of 4\n", None),
    ("a.csv", "a,b\n1,2\n", "a,b\n1,2\n3,4\n", "old has 2 lines, new has 3"),
    ("a.csv", "a,b\n1,2\n", "a,b\n1,2", r"line 2, column 4: old '1,2\n', new '1,2'"),
])
def test_first_difference(tmp_path, name, old, new, words):
    for folder, text in (("old", old), ("new", new)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text(text, encoding="utf-8")
    assert first_difference(tmp_path / "old" / name, tmp_path / "new" / name) == words
    assert "exists" in first_difference(tmp_path / "old" / name, tmp_path / "nowhere")
