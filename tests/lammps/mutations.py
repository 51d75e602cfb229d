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


SIZE_OF_STRAIN = "Contact ? -strain : std::fabs(strain);"
STIFFNESS = ("stable_timesteps.cpp", "state.stiffness_ahead")

MUTATIONS = [
    Mutation("a quarter of the stiffness in compute evp/dt", ("times critical damping: 0.0",), STIFFNESS[0], STIFFNESS[1], "0.25 * " + STIFFNESS[1]),
    Mutation("gamma left out of compute evp/dt", ("times critical damping: 1.0", "times critical damping: 3.6", "times critical damping: 30.0"),
             "stable_timesteps.cpp", "law.gamma + pair_data.implicit_gamma(p)", "0.0"),
    Mutation("no warning of a timestep above the limit", ("table 2 at the paper s timestep",), "stable_timesteps.cpp",
             "if (dt > (1.0 + StableTimesteps::ACCURACY) * limit &&", "if (dt > 1e3 * limit &&"),
    Mutation("no limit of displacement per step in fix dt/evp", ("table 1 pulled to rupture", "head on impact: 500"), "fix_dt_evp.cpp", "if (opening.dt < dt) {", "if (opening.dt < 0.0) {"),
    Mutation("new contacts not in the energy balance", ("head on impact: 1", "head on impact: 30"), "fix_evp_energy.cpp",
             "(last.pairs.contacts - start.pairs.contacts) -\n      (last.pairs.contacts_at_cutoff - start.pairs.contacts_at_cutoff);", "0.0;"),
    Mutation("lost bonds not in the energy balance", ("table 2 pulled to 50 percent",), "fix_evp_energy.cpp",
             "entries[LOST] = left + (ends ? 0.0 : past + broken);", "entries[LOST] = left;"),
    Mutation("no warning of overlaps", ("overlap to one half",), "pair_data.cpp", "if (all[1] == 0 || overlap_warned) return;", "return;"),
    Mutation("half of the force carried into the second regime", ("pair swings across xi s", "pair passes dlim back and forth"), "law.h",
             "at.is_first ? 0.0 : side;", "at.is_first ? 0.0 : 0.5 * side;"),
    Mutation("kinetic energy short by a fifth in the energy balance", ("shaken far beyond xi s",), "fix_evp_energy.cpp",
             "0.5 * force->mvv2e * EVP::scene::mass", "0.4 * force->mvv2e * EVP::scene::mass"),
    Mutation("half of the force carried over from the threshold", ("threshold strain: 0.001", "threshold strain: 0.05", "threshold strain: 0.3"), "law.h",
             "Threshold{first.force(s)", "Threshold{0.5 * first.force(s)"),
    Mutation("e2 less by a tenth", ("threshold strain: 1e-06",), "law.h", "second(row.e2, row.m2, row.n2, powers2)", "second(0.9 * row.e2, row.m2, row.n2, powers2)"),
    Mutation("exponents 4 2 in place of 2 1", ("exponents: 2 1",), "powers.h", "return f(FixedPowers<2, 1>{});", "return f(FixedPowers<4, 2>{});"),
    Mutation("dlim larger by a tenth", ("range alpha",), "pair_list_builder.cpp", "row.alpha * sum_radii", "1.1 * row.alpha * sum_radii"),
    Mutation("exponents of the first regime in both regimes", ("exponents: 8 4", "exponents: 13.5", "exponents: 24"), "law.h",
             "second(row.e2, row.m2, row.n2, powers2)", "second(row.e2, row.m1, row.n1, powers1)"),
    Mutation("energy not zero at dlim", ("all pairs at dlim",), "pair_block.cpp", "- block.at_cutoff[k];", "- 0.5 * block.at_cutoff[k];"),
    Mutation("one mass for all atoms in compute evp/dt", ("ratio of",), "stable_timesteps.cpp", "linear.inverse_mass[i] = scene::inverse_mass(atom, force, i)",
             "linear.inverse_mass[i] = scene::inverse_mass(atom, force, 0)"),
    Mutation("damping by the velocity of one atom only", ("fragment moving and spinning: explicit",), "pair_block.h",
             "dx * (vx - v[j][0]) + dy * (vy - v[j][1]) + dz * (vz - v[j][2])", "dx * vx + dy * vy + dz * vz"),
    Mutation("damping along x", ("fragment moving and spinning: implicit",), "dampers.h", "over_d * p.g.dy,", "0.0,"),
    Mutation("damping along the old direction of a rotating pair", ("spinning cube", "spinning top"), "dampers.h",
             "return 2.0 * half_change / (1.0 + std::sqrt(std::max(ratio_sq, 0.0)));", "return along + 0.0 * half_change * ratio_sq;"),
    Mutation("half of the dissipation of implicit damping in the energy balance", ("off centre impact",), "dampers.h",
             "share(dampers[k]) * rate", "0.5 * share(dampers[k]) * rate"),
    Mutation("rotation of pairs from the last step only", ("spinning top",), "damping_solver.cpp", "MOST_PASSES = 20;", "MOST_PASSES = 1;"),
    Mutation("no implicit damping", ("hold at constant strain",), "pair_data.h", "return any_gamma && implicit_groupbit;", "return false;"),
    Mutation("NULL components of fix move enter as prescribed", ("null component",), "fix_nve_evp.cpp", "others_groupbits |= other->groupbit;\n    }\n}", "}\n}"),
    Mutation("gamma larger by 1e-6", ("free vibration",), "coefficients.h",
             "laws[index(i, j)] = laws[index(j, i)] = PairLaw(row);", "laws[index(i, j)] = laws[index(j, i)] = PairLaw((row.gamma += 1e-6, row));"),
    Mutation("no check for coincident centres", ("coincident centres",), "pair_list_builder.cpp", "if (!(dsq > coincident * coincident))", "if (dsq < 0.0)"),
    Mutation("no flow in compression", ("pair cycled far",), "pair_block.cpp", SIZE_OF_STRAIN, "Contact ? -strain : strain;", 2),
    Mutation("contacts flow in tension", ("contact pushed and parted",), "pair_block.cpp", SIZE_OF_STRAIN, "std::fabs(strain);", 2),
    Mutation("no bond breaks", ("bond torn and pushed",), "pair_histories.cpp", "break_bonds(past, work);", "(void) work;"),
    Mutation("bonds that leave the neighbor list do not flow up to their cutoff", ("past its cutoff",), "pair_data.h",
             "    pair_histories.settle_missing(records, work.get(), moves);", ""),
    Mutation("the history of a pair is kept at one atom only", ("flow in a body whose atoms are sorted",), "pair_histories.cpp", "records.take({j, is_record, tag[i], h});", ""),
    Mutation("every minimization leaves its flow", ("minimization that stops early",), "fix_evp_bonds.cpp", "if (stop == Min::ETOL || stop == Min::FTOL || stop == Min::ZEROFORCE)", "if (stop >= 0)"),
    Mutation("two bodies are bonded where they are close at the start", ("two bodies brought together", "ball hits block"), "bond_recording.cpp",
             "if (bodies.in_different_bodies(i, j)) {", "if (bodies.in_different_bodies(i, j) && false) {"),
    Mutation("attraction between two bodies", ("two bodies brought together: literal", "ball hits block"), "pair_list_builder.cpp",
             "!broken && view.bodies.in_different_bodies(i, j)", "!broken && false && view.bodies.in_different_bodies(i, j)"),
    Mutation("half of the forces of the volume energy", ("volume energy of a free body",), "volume_energy.h", "3.0 * kv * strain / weight_sum", "1.5 * kv * strain / weight_sum"),
    Mutation("remap v: velocities of periodic images not corrected in implicit damping", ("sheared box",), "damping_solver.cpp",
             "ghosts.forward_comm_velocities(velocities);", "ghosts.forward_comm(velocities);"),
    Mutation("remap v: kinetic energy of wrapped atoms not in the energy balance", ("sheared box",), "step_work.h", "carried += kinetic_now - kinetic;", ""),
    Mutation("remap v: no work of the box by implicit damping", ("sheared box",), "fix_nve_evp.cpp", "sum += dampers.share(damper) * along *", "sum += 0.0 * along *"),
]
