# SPDX-License-Identifier: GPL-2.0-only
"""What includes what in src/: the core knows no LAMMPS, and arrows point one way."""

import graphlib
import re

import pytest
from evp.run import CHECKOUT

SOURCES = CHECKOUT / "src"
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
            found = [place / name for place in (SOURCES, path.parent) if (place / name).exists()]
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
    users = {node for node, others in own.items() if "core/powers" in others}
    assert len(own) > 30 and "core/law" in users and users <= {"core/law", "core/pair_block"}


@pytest.mark.parametrize("style", ["pair_evp_lj", "fix_evp_bonds"])
def test_the_pair_style_and_the_bonds_fix_do_not_know_each_other(style):
    own, _ = include_graph()
    reached, left = set(), [f"lammps/{style}"]
    while left:
        node = left.pop()
        reached.add(node)
        left += [other for other in own[node] if other not in reached]
    styles = [node for node in reached if node.split("/")[1].startswith(STYLES)]
    assert styles == [f"lammps/{style}"]
