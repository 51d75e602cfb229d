# SPDX-License-Identifier: GPL-2.0-only
"""doc/studies/study.py: pages from templates, runs that are kept, and a template for each study."""

import re
import string

import pytest
import study


def test_runs_are_kept_until_their_command_changes(tmp_path):
    runs = study.Runs(tmp_path)
    words = ["bash", "-c", "echo x >> count; wc -l < count"]
    assert [int(runs.keep("a", words)) for _ in range(3)] == [1, 1, 1]
    assert int(runs.keep("a", [*words, "other"])) == 2
    with pytest.raises(study.RunError, match="b failed .exit 3."):
        runs.keep("b", ["bash", "-c", "exit 3"])
    assert not (tmp_path / "b.log").exists()


def test_page_of_a_template(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(study, "STUDIES", tmp_path)
    (tmp_path / "any.md").write_text("# $title\n\n$rows\n\n`$command` costs 5 $$\n", encoding="utf-8")
    one = study.Study("text", "any", spheres=[1, 2], xi=0.5).parse(["--spheres", "3", "--work", str(tmp_path / "w"), "--out", str(tmp_path / "out.md")])
    assert (one.spheres, one.xi) == ([3], 0.5)
    one.write(title="A", rows=(("a", "b"), [(1, 2)]))
    assert one.out.read_text(encoding="utf-8") == "# A\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n`doc/studies/any.py --spheres 3` costs 5 $\n" == capsys.readouterr().out
    with pytest.raises(ValueError, match="any.md has .rows, which any.py does not give"):
        one.write(title="A")


@pytest.mark.parametrize("template", sorted(study.STUDIES.glob("*.md")), ids=lambda path: path.stem)
def test_each_template_has_a_page_that_is_written_from_it(template):
    """The lines without a value stand in the page as they are, unless it says that it is to be measured again."""
    page = (study.STUDIES.parent / template.name).read_text(encoding="utf-8")
    for line in template.read_text(encoding="utf-8").splitlines():
        if "$" not in line.replace("$$", "") and "to be measured again" not in page:
            assert line.replace("$$", "$") in page, f"run doc/studies/{template.stem}.py: {line}"
    names = set(re.findall(r"(?<!\$)\$(\w+)", template.read_text(encoding="utf-8"))) - {"command"}
    source = template.with_suffix(".py").read_text(encoding="utf-8")
    assert names and all(re.search(rf"\b{name}\b", source) for name in names), names
    assert string.Template(template.read_text(encoding="utf-8")).safe_substitute()
