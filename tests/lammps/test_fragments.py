# SPDX-License-Identifier: GPL-2.0-only
"""compute evp/fragment/atom against the connected parts of the bonds that write_evp_bonds lists."""

import numpy as np
import pytest
from evp import law
from flowing import read_pairs
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from small_bodies import dump, head, lattice_body, pair, velocities, write_body

PULL = velocities("9000*(x-0.04)", "100*sin(90*x)", "6000*(z-0.02)")
COMPUTE = "compute part all evp/fragment/atom\ngroup some id > 30\ncompute some some evp/fragment/atom\n"


def parts_of(bonds, ids):
    """The lowest ID of the part of each atom (N,), of the atoms with these IDs, which their bonds hold together; 0 of the others."""
    kept = np.array([pair for pair in bonds if set(pair) <= ids])
    n = max(ids)
    _, part = connected_components(coo_matrix((np.ones(len(kept)), kept.T - 1), (n, n)), directed=False)
    lowest = {}
    for one in sorted(ids):
        lowest.setdefault(part[one - 1], one)
    return np.array([lowest[part[k]] if k + 1 in ids else 0 for k in range(n)])


@pytest.mark.parametrize("ranks, newton", [(1, "on"), (2, "off"), (4, "on"), (4, "off")])
def test_a_body_that_is_torn(lmp, tmp_path, ranks, newton):
    """It parts into many fragments, some of them across the boundary of the box and of MPI ranks. A group is connected by its own bonds alone."""
    body = lattice_body((8, 4, 4), periodic="y")
    write_body(tmp_path / "body.data", body)
    text = head(newton, "s p s") + pair(law.TABLE1, "none break 0.02") + PULL + "fix move all nve\ntimestep 3e-7\n" + COMPUTE
    run = lmp(text + dump(every=200, columns="x y z c_part c_some") + "run 200\nwrite_evp_bonds end.bonds\n", ranks).ok()
    last, everyone = run.dump("all.dump")[-1], set(range(1, len(body.x) + 1))
    bonds = list(read_pairs(tmp_path / "end.bonds").bonds)
    wanted = parts_of(bonds, everyone)
    assert np.array_equal(last["c_part"], wanted)
    assert np.array_equal(last["c_some"], parts_of(bonds, everyone - set(range(1, 31))))
    sizes = np.unique(wanted, return_counts=True)[1]
    assert len(sizes) > 5 and np.sum(sizes > 3) > 2, "control"
