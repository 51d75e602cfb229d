# SPDX-License-Identifier: GPL-2.0-only
"""The bonds as a network of springs and dashpots: largest stable time steps.

Linearised about the present positions; atoms that are not free are prescribed, so that only the
free-free block of each matrix matters. Reading 8 of the project's model notes: one mode under
velocity Verlet with damping at half-step velocities is stable while dt^2 k + 2 dt c < 4.
"""

import itertools

import numpy as np
import scipy.optimize
import scipy.sparse
import scipy.sparse.linalg

from . import law
from .brute import interactions

_DENSE = 60  # below this many rows a dense eigenvalue solver is quicker and cannot fail


def pair_stiffness(d, deq, row):
    """Axial and transverse stiffness of each pair [energy/length^2].

    Axial: the present -dF/dd, but never below that of either potential at its own minimum, m1 n1 e1/deq^2 and m2 n2 e2/deq^2, since the pair may be there
    within the step. Transverse: tension/d, zero for a pair that is pushed."""
    beyond_threshold = law.potential_stiffness(deq, deq, row.e2, row.m2, row.n2)
    least = np.maximum(law.stiffness_at_rest(deq, row), beyond_threshold)
    axial = np.maximum(law.stiffness(d, deq, row), least)
    return axial, np.maximum(0.0, -law.force(d, deq, row) / d)


def assemble(pairs, axial, transverse, free):
    """Free-free block (3F,3F) of sum over pairs of axial uu + transverse (1 - uu), csr matrix."""
    unit = pairs.r / pairs.d[:, None]
    along = unit[:, :, None] * unit[:, None, :]
    blocks = axial[:, None, None] * along + transverse[:, None, None] * (np.eye(3) - along)
    place = np.full(len(free), -1)
    place[free] = np.arange(np.sum(free))
    rows, columns, values = [], [], []
    for a, b in itertools.product((pairs.i, pairs.j), repeat=2):
        p, q = place[a], place[b]
        keep = (p >= 0) & (q >= 0)
        shape = (int(np.sum(keep)), 3, 3)
        rows.append(np.broadcast_to((3 * p[keep, None] + np.arange(3))[:, :, None], shape))
        columns.append(np.broadcast_to((3 * q[keep, None] + np.arange(3))[:, None, :], shape))
        values.append((1.0 if a is b else -1.0) * blocks[keep])
    flat = [np.concatenate([part.ravel() for part in g]) for g in (values, rows, columns)]
    size = 3 * int(np.sum(free))
    return scipy.sparse.coo_matrix((flat[0], flat[1:]), shape=(size, size)).tocsr()


def largest_eigenvalue(matrix):
    """Largest eigenvalue of a symmetric positive semidefinite sparse matrix; 0 if it is empty."""
    size = matrix.shape[0]
    if size == 0 or matrix.nnz == 0:
        return 0.0
    if size <= _DENSE:
        return float(np.linalg.eigvalsh(matrix.toarray())[-1])
    start = np.random.default_rng(1).standard_normal(size)
    return float(scipy.sparse.linalg.eigsh(matrix, 1, which="LA", v0=start, tol=1e-12)[0][0])


def _scaled(matrix, mass):
    """M^-1/2 A M^-1/2, which has the eigenvalues of M^-1 A and is symmetric."""
    half = scipy.sparse.diags(np.repeat(1.0 / np.sqrt(mass), 3))
    return half @ matrix @ half


def stable_step(k, c):
    """Positive root of dt^2 k + 2 dt c = 4 [time]; inf where both are zero. Arrays allowed."""
    with np.errstate(divide="ignore"):
        return np.divide(4.0, c + np.sqrt(c * c + 4.0 * k))


def step_limits(x, radius, mass, rows, bonds, contact, free_mask):
    """Largest stable steps of the interacting pairs of one type now; arguments as in brute.brute_force.

    mass (N,); free_mask (N,) bool: False for atoms with a prescribed motion. Returns a dict:
      dt_elastic     2 over the root of the largest eigenvalue of M^-1 K
      dt_explicit    dt at which the largest eigenvalue of M^-1 (dt^2 K + 2 dt C) is 4
      dt_eq7         eq. 7 over the pairs with a free atom; it knows neither neighbours nor gamma
      dt_rows        dt^2 RK + 2 dt RC = 4 with Gershgorin's row sums, least over rows
    All steps are inf where nothing limits them.
    """
    free, mass = np.asarray(free_mask, dtype=bool), np.asarray(mass, dtype=float)
    pairs, deq, _, _, row = interactions(x, radius, rows, bonds, contact)
    axial, transverse = pair_stiffness(pairs.d, deq, row)
    k_matrix, c_matrix = assemble(pairs, axial, transverse, free), assemble(pairs, row.gamma, np.zeros_like(axial), free)
    scaled_k, scaled_c = _scaled(k_matrix, mass[free]), _scaled(c_matrix, mass[free])
    lam_k, lam_c = largest_eigenvalue(scaled_k), largest_eigenvalue(scaled_c)
    upper = float(min(stable_step(lam_k, 0.0), stable_step(0.0, lam_c)))
    dt_explicit = upper
    if lam_c > 0.0 and lam_k > 0.0:

        def excess(dt):
            return largest_eigenvalue(dt * dt * scaled_k + 2.0 * dt * scaled_c) - 4.0

        lower = float(stable_step(lam_k, lam_c))  # safe: eigenvalues of a sum add at most
        ends = lower * (1 - 1e-9), upper * (1 + 1e-9)
        dt_explicit = scipy.optimize.brentq(excess, *ends, rtol=1e-10)

    moves = free[pairs.i] | free[pairs.j]
    lighter = np.minimum(mass[pairs.i], mass[pairs.j])
    k_max = law.largest_stiffness(pairs.contact_distance, row)
    with np.errstate(divide="ignore"):
        eq7 = np.sqrt(lighter / k_max)[moves]
    # sums of |entries| over the rows of M^-1 A: Gershgorin's bound on its eigenvalues
    by_rows = stable_step(*(np.asarray(abs(matrix).sum(axis=1)).ravel() / np.repeat(mass[free], 3) for matrix in (k_matrix, c_matrix)))
    return {"dt_elastic": float(stable_step(lam_k, 0.0)), "dt_explicit": float(dt_explicit), "dt_eq7": float(np.min(eq7, initial=np.inf)),
            "dt_rows": float(np.min(by_rows, initial=np.inf))}
