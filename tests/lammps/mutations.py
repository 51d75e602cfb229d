# SPDX-License-Identifier: GPL-2.0-only
"""What protects each hard case, and how to take it out. tools/mutations.py does so and demands that the case then fails."""

from typing import NamedTuple


class Mutation(NamedTuple):
    """In file, old (which must be there once, or `times`) becomes new; the cases whose names hold one of the words must fail."""

    what: str
    cases: tuple
    file: str
    old: str
    new: str
    times: int = 1


STIFFNESS = ("compute_evp_dt_network.cpp", "std::max(law.stiffness(d, deq), law.stiffness_at_rest(deq))")

MUTATIONS = [
    Mutation("stiffness of compute evp/dt: a quarter", ("times critical damping: 0.0",), STIFFNESS[0], STIFFNESS[1], "0.25 * " + STIFFNESS[1]),
    Mutation("gamma left out of compute evp/dt", ("times critical damping: 1.0", "times critical damping: 3.6", "times critical damping: 30.0"),
             "compute_evp_dt_network.cpp", "law.parameters().gamma + pair->implicit_gamma(packed_pair)", "0.0"),
    Mutation("no warning of a step above the limit", ("table 2 at the paper s step",), "compute_evp_dt.cpp", "update->dt > limit &&", "update->dt > 1e3 * limit &&"),
    Mutation("no rule of speed in fix dt/evp", ("table 1 pulled to rupture", "head on impact: 500"), "fix_dt_evp.cpp", "if (fastest.dt < dt)", "if (fastest.dt < 0.0)"),
    Mutation("stiffness of compute evp/dt: a twentieth", ("head on impact: 1", "head on impact: 30"), STIFFNESS[0], STIFFNESS[1], "0.05 * " + STIFFNESS[1]),
    Mutation("depth of lost bonds not in the ledger", ("table 2 pulled to 50 percent", "pair passes dlim to and fro"), "fix_evp_energy.cpp",
             "sums[3] += weight * law.energy(cut, deq, deq)", "sums[3] += 0.0"),
    Mutation("no warning of overlaps", ("overlap to one half",), "pair_evp_lj_pack.cpp", "const bigint count = all[1];", "const bigint count = 0;"),
    Mutation("half of the force carried into the second regime", ("threshold strain", "pair swings across xi s", "shaken far beyond xi s"), "evp_block.cpp",
             "is_first ? 0.0 : side;", "is_first ? 0.0 : 0.5 * side;"),
    Mutation("dlim a tenth further out", ("range alpha",), "pair_evp_lj_pack.cpp", "row.alpha * sum_radii", "1.1 * row.alpha * sum_radii"),
    Mutation("exponents of the first regime in both", ("exponents",), "evp_law.h", "second(row_in.e2, row_in.m2, row_in.n2)", "second(row_in.e2, row_in.m1, row_in.n1)"),
    Mutation("energy not zero at dlim", ("all pairs at dlim",), "evp_block.cpp", "energy_at(c, cut_is_first,", "0.5 * energy_at(c, cut_is_first,"),
    Mutation("one mass for all in compute evp/dt", ("ratio of",), "compute_evp_dt_network.cpp", "std::sqrt(EVP::scene::inverse_mass(atom, force, i))",
             "std::sqrt(EVP::scene::inverse_mass(atom, force, 0))", 2),
    Mutation("dampers that see one velocity only", ("fragment flying and spinning: explicit",), "evp_kernel.h",
             "dx * (vx - v[j][0]) + dy * (vy - v[j][1]) + dz * (vz - v[j][2])", "dx * vx + dy * vy + dz * vz"),
    Mutation("dampers along x", ("fragment flying and spinning: implicit",), "fix_nve_evp_solve.cpp", "{scale * g.dx, scale * g.dy, scale * g.dz}", "{scale * d, 0.0, 0.0}"),
    Mutation("no implicit damping", ("hold at constant strain",), "pair_evp_lj.h", "return any_gamma && implicit_groupbit;", "return false;"),
    Mutation("a reaction that is larger by 1e-6", ("free vibration",), "evp_kernel.h", "f[j][0] -= px;", "f[j][0] -= 1.000001 * px;"),
    Mutation("no check for coincident centres", ("coincident centres",), "pair_evp_lj_pack.cpp", "if (!(g.dsq > 0.0)) stop_at_one_point(i, j);", ""),
]
