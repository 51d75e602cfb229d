#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Builds the plugin with one line of src/ wrong, each of FAULTS in turn, and checks that the robustness tests fail.

    tests/maintain/faults.py [--only FAULT ...]

Works on a copy of the sources, with the LAMMPS that build/ was configured for (tools/setup.sh). Half a minute per fault on two cores.
Exit code 1 if a test passes in spite of its fault, or the first one fails without any.
"""

import os
import pathlib
import re
import shutil
import sys
import tempfile
from typing import NamedTuple

import tools_path  # noqa: F401  before evp
from study import CHECKOUT, RunError, command_line, errors_in_one_line, output_of, watched
from robustness import collect, run


class Fault(NamedTuple):
    """What a build with it does wrong; words of the names of the robustness tests that must fail; a file of src/, and the text in it that another one replaces."""

    what: str
    tests: list
    file: str
    right: str
    wrong: str


FAULTS = {
    "QUARTER_STIFFNESS": Fault("a quarter of the stiffness in compute evp/dt", ["times critical damping: 0.0"],
                               "lammps/timestep/stable_timesteps.cpp", "state.stiffness_ahead", "0.25 * state.stiffness_ahead"),
    "NO_GAMMA_IN_DT": Fault("gamma left out of compute evp/dt", ["times critical damping: 1.0", "times critical damping: 3.6", "times critical damping: 30.0"],
                            "lammps/timestep/stable_timesteps.cpp", "law.gamma + pair_data.implicit_gamma(p)", "0.0"),
    "ONE_MASS": Fault("one mass for all atoms in compute evp/dt", ["ratio of"],
                      "lammps/timestep/stable_timesteps.cpp", "inverse_mass(atom, force, i)", "inverse_mass(atom, force, 0)"),
    "NO_DT_WARNING": Fault("no warning of a timestep above the limit", ["table 2 at the paper s timestep"],
                           "lammps/timestep/stable_timesteps.cpp", "if (dt > (1.0 + StableTimesteps::ACCURACY) * limit", "if (false"),
    "NO_DISPLACEMENT_LIMIT": Fault("no limit of displacement per step in fix dt/evp", ["table 1 pulled to rupture", "head on impact: 500"],
                                   "lammps/timestep/fix_dt_evp.cpp", "keep_below(by_displacement.dt, DISPLACEMENT)", "(void) by_displacement.dt"),
    "NO_OVERLAP_WARNING": Fault("no warning of overlaps", ["overlap to one half"],
                                "lammps/pairs/pair_data.cpp", "if (all[1] <= 2 * overlaps_told) return all[2];", "return all[2];"),
    "NO_COINCIDENCE_CHECK": Fault("no check for coincident centres", ["coincident centres"],
                                  "lammps/pairs/pair_list_builder.cpp", "if (!(dsq > coincident * coincident))", "if (false)"),
    "HALF_CARRIED": Fault("half of the force carried into the second regime", ["pair swings across xi s", "pair passes dlim back and forth"],
                          "core/law/law.h", "at.is_first ? 0.0 : side", "at.is_first ? 0.0 : 0.5 * side"),
    "HALF_THRESHOLD": Fault("force and energy carried over from half of xi_s", ["threshold strain: 0.001", "threshold strain: 0.05", "threshold strain: 0.3"],
                            "core/law/law.h", "stretched = at(xi_s)", "stretched = at(0.5 * xi_s)"),
    "E2_SHORT": Fault("e2 less by a tenth", ["threshold strain: 1e-06"],
                      "core/law/coefficients.h", "put_laws(i, j, row);\n    } catch", "row.e2 *= 0.9;\n      put_laws(i, j, row);\n    } catch"),
    "WHOLE_EXPONENTS": Fault("whole exponents larger by one", ["exponents: 2 1", "exponents: 24"],
                             "core/law/powers.h", "integer_power(s, (int) p)", "integer_power(s, (int) p + 1)"),
    "FIRST_POWERS": Fault("powers of the first regime in both regimes", ["exponents: 8 4", "exponents: 13.5", "exponents: 24"],
                          "core/law/law.h", "(at.is_first ? first : second).powers(s)", "first.powers(s)"),
    "FAR_AT_ONCE": Fault("pairs beyond their cutoffs are left out of a list within which they meet", ["small spheres beside a large one"],
                         "lammps/pairs/pair_list_builder.h", "+ 2.0 * skin", "+ 0.0 * skin"),
    "DLIM_LONG": Fault("dlim larger by a tenth", ["range alpha"],
                       "lammps/pairs/pair_list_builder.cpp", "dlim = row.alpha", "dlim = 1.1 * row.alpha"),
    "NONZERO_AT_DLIM": Fault("energy not zero at dlim", ["all pairs at dlim"],
                             "core/pairs/pair_block.cpp", "there = at_cutoff.elastic[k] + at_cutoff.second[k]", "there = 0.5 * (at_cutoff.elastic[k] + at_cutoff.second[k])"),
    "JOIN_AT_TOUCH": Fault("a bond that begins rests at R_i + R_j", ["torn and pressed ten times", "head on with join", "rigid block across metal that fails"],
                           "lammps/pairs/pair_histories.cpp", "const double deq = d / (1.0 - std::min(pressed, limit));", "const double deq = contact.cut;"),
    "INSIDE_JOINS": Fault("pairs that are inside when first looked at join", ["nested seam"],
                          "lammps/pairs/pair_list_builder.cpp", "looks_first ? dsq <= inside * inside * sum_radii * sum_radii", "looks_first ? false"),
    "NO_RETURN": Fault("bonds beyond a limit that fell flow in the next step", ["band that heats itself"],
                       "lammps/plasticity/plasticity.cpp", "if (keeps_below && now < before)", "if (false && keeps_below)"),
    "MEAN_LIMIT": Fault("a bond holds as the mean of its spheres", ["band that heats itself"],
                        "core/pairs/pairs.h", "std::min(one, other)", "0.5 * (one + other)"),
    "LATER_COUNTS": Fault("a bond with an atom that comes counts for the older one, too", ["material that comes to a loaded body"],
                          "lammps/volume/volume_forces.h", "return batch(i) == batch(j) ? BOTH", "return true ? BOTH"),
    "NEVER_OPEN": Fault("what is torn by flow heals", ["torn by flow and closed"],
                        "lammps/volume/volume_forces.cpp", "own.strain > law.cavitation && kv_of(i) > 0.0 ? OPENS", "false ? OPENS"),
    "EACH_FOR_ITSELF": Fault("both owners of a pair decide by distances of their own whether it begins or ends", ["join at the very distance"],
                             "core/pairs/pairs.h", "bool has(int j) const { return !empty() && j >= nlocal; }", "bool has(int) const { return false; }"),
    "FRICTION_MOVES_ON": Fault("what slipping pairs remember moves on twice in a step where their heat is found", ["spheres that rub"],
                               "lammps/heat/granular_friction.cpp", "std::copy(remembered.begin(), remembered.end(), values);", ""),
    "LONG_ARMS": Fault("friction of pair granular acts at the radius of each sphere", ["spheres that rub"],
                       "lammps/heat/granular_friction.cpp", "shortens_arms ? 0.5 *", "false ? 0.5 *"),
    "RATE_AT_REST": Fault("a minimization keeps the strain rates of the last run", ["fast bond"],
                          "lammps/heat/fix_evp_heat.cpp", "if (update->whichflag == 2) {", "if (false) {"),
    "LIMITS_FALL_LATE": Fault("a minimization begins with the limits of the last run", ["fast bond"],
                              "lammps/pairs/pair_histories.cpp", "if (std::exchange(starts, false) && is_minimization)", "if (false)"),
    "BEYOND_STRONGEST": Fault("the strain rate takes limits beyond the strongest strain", ["fast bond"],
                              "core/law/limit.h", "std::min(factor * y, most)", "factor * y"),
    "OLD_PLACES": Fault("new atoms have the temperature that their place in the array held", ["come to a hot plate"],
                        "lammps/heat/fix_evp_heat.h", "atom->temperature[i] = 0.0;", "(void) 0;"),
    "OLD_GHOSTS": Fault("ghosts keep the temperatures of others from a neighbor list to the next thermal step", ["heat each other"],
                        "lammps/heat/fix_evp_heat.cpp", "if (neighbor->ago == 0) send_temperatures();", ""),
    "NO_LATENT_HEAT": Fault("no latent heat", ["band that heats itself"],
                            "core/heat/heat.h", "most = mass * row.melt", "most = 0.0"),
    "GAMMA_LONG": Fault("gamma larger by 1e-6", ["free vibration"],
                        "core/law/coefficients.h", "put_laws(i, j, row);\n    } catch", "row.gamma += 1e-6;\n      put_laws(i, j, row);\n    } catch"),
    "VX_OF_PARTNER_ONLY": Fault("damping by v_x of one atom only", ["fragment moving and spinning: explicit"],
                                "core/pairs/pair_block.h", "vx = v[i][0]", "vx = 0.0"),
    "NO_DAMPING_ALONG_Y": Fault("no implicit damping along y", ["fragment moving and spinning: implicit"],
                                "core/damping/dampers.h", "{p.g * over_d,", "{{p.g.x * over_d, 0.0, p.g.z * over_d},"),
    "NO_ROTATION": Fault("implicit damping along the old direction of a rotating pair", ["spinning cube", "spinning top"],
                         "core/damping/dampers.h", "return 2.0 * half_change", "return true ? along : 2.0 * half_change"),
    "ONE_PASS": Fault("rotation of pairs from the last step only", ["spinning top"],
                      "lammps/damping/damping_solver.cpp", "MOST_PASSES = 20", "MOST_PASSES = 1"),
    "NO_IMPLICIT": Fault("no implicit damping", ["hold at constant strain"],
                         "lammps/pairs/pair_data.h", "return any_gamma && implicit_groupbits_;", "return false;"),
    "NULL_IS_PRESCRIBED": Fault("NULL components of fix move enter as prescribed", ["null component"],
                                "lammps/damping/fix_nve_evp.cpp", "    others_groupbits |= move->groupbit;\n", ""),
    "NO_IMAGE_VELOCITIES": Fault("remap v: velocities of periodic images not corrected in implicit damping", ["sheared box"],
                                 "lammps/damping/damping_solver.cpp", "ghosts.forward_comm_velocities(velocities)", "ghosts.forward_comm(velocities)"),
    "NO_WRAPPED_ENERGY": Fault("remap v: kinetic energy of wrapped atoms not in the energy balance", ["sheared box"],
                               "lammps/energy/fix_evp_energy.cpp", "box.add_wrapped(kinetic_here());", ""),
    "NO_WORK_OF_BOX": Fault("remap v: no work of the box by implicit damping", ["sheared box"],
                            "lammps/damping/fix_nve_evp.cpp", "if (image_velocities.empty()) return sum;", "return sum;"),
    "HALF_DISSIPATION": Fault("half of the dissipation of implicit damping in the energy balance", ["off centre impact"],
                              "core/damping/dampers.h", "sum += share(damper) * dissipated", "sum += 0.5 * share(damper) * dissipated"),
    "KINETIC_SHORT": Fault("kinetic energy short by a fifth in the energy balance", ["shaken far beyond xi s"],
                           "lammps/energy/fix_evp_energy.cpp", "return kinetic;", "return 0.8 * kinetic;"),
    "NO_NEW_CONTACTS": Fault("new contacts not in the energy balance", ["head on impact: 1", "head on impact: 30"],
                             "lammps/energy/fix_evp_energy.cpp", "entries[VOLUME] = last", "entries[CONTACTS] = 0.0;\n  entries[VOLUME] = last"),
    "NO_LOST_BONDS": Fault("lost bonds not in the energy balance", ["table 2 pulled to 50 percent"],
                           "lammps/energy/fix_evp_energy.cpp", "entries[LOST] = last", "entries[LOST] = 0.0 * last"),
    "NO_FLOW_IN_COMPRESSION": Fault("no flow of bonds in compression", ["pair cycled far"],
                                    "core/law/law.h", "low = 1.0 - limit", "low = Contact ? 1.0 - limit : 0.0"),
    "CONTACTS_FLOW_IN_TENSION": Fault("contacts flow in tension", ["contact pushed and parted"],
                                      "core/law/law.h", "Contact ? elastic > r || returns : elastic != r", "elastic != r"),
    "D_BY_WRONG_DEQ": Fault("plastic work by the deq before the flow", ["contact pushed and parted", "past its cutoff: 1"],
                            "core/law/law.h", "stored, force * elastic};", "stored, force * r};"),
    "NO_BOND_BREAKS": Fault("no bond breaks", ["bond torn and pushed"],
                            "lammps/pairs/pair_histories.cpp", "  end_bonds();\n", ""),
    "NO_PAIR_IS_LEFT": Fault("a bond that ended is in no volume energy", ["bond that ended is in the volume energy at once"],
                             "lammps/volume/volume_forces.cpp", "bond_ends(const EndingPair &bond)\n{\n", "bond_ends(const EndingPair &bond)\n{\n  return;\n"),
    "NO_FLOW_OF_FAR": Fault("bonds that leave the neighbor list do not flow up to their cutoff", ["past its cutoff"],
                            "lammps/pairs/pair_histories.cpp", "  end_unlisted_bonds();\n", ""),
    "ONE_ATOM_IS_TOLD": Fault("one atom alone is told what has become of a pair", ["flow in a body whose atoms are sorted"],
                              "lammps/pairs/pair_histories.cpp", "      apply(other);\n", ""),
    "DEQ_NOT_WRITTEN_BACK": Fault("deq that has moved is not written back", ["flow in a body whose atoms are sorted"],
                                  "lammps/pairs/pair_histories.cpp", "    records->set(event.i, event.partner, BOND_VALUES[event.line].value, event.deq);", "    (void) event;"),
    "P_NOT_EXCHANGED": Fault("ghosts hold as at first", ["flow across the boundary"],
                             "lammps/pairs/pair_histories.cpp", "  exchange->forward_comm(values);\n",
                             "  for (int i = lists.nlocal; i < lists.nall; i++) values[i][0] = types.limit(atom->type[i])(0.0);\n"),
    "Y_OF_THE_WRONG_SPHERE": Fault("a bond holds as its first sphere", ["flow across the boundary"],
                                   "core/pairs/pairs.h", "std::min(one, other)", "one"),
    "STOPPED_FLOWS": Fault("a minimization that stops at its maximum number of iterations leaves its flow", ["minimization that stops early"],
                           "lammps/bonds/fix_evp_bonds.cpp", "stop == Min::ZEROFORCE", "stop == Min::ZEROFORCE || stop == Min::MAXITER"),
    "BODIES_BONDED": Fault("two bodies are bonded where they are close at the start", ["two bodies brought together", "ball hits block"],
                           "lammps/bonds/bond_recording.cpp", "if (in_different_bodies(atom, within, i, j)) {", "if (false) {"),
    "BODIES_ATTRACT": Fault("attraction between two bodies", ["two bodies brought together: literal", "ball hits block"],
                            "lammps/pairs/pair_list_builder.cpp", "of_contact(sum_radii, dlim, divided)", "of_contact(sum_radii, dlim, false)"),
    "CONTACTS_FLOW_BETWEEN_BODIES": Fault("contacts between two bodies flow", ["two bodies brought together"],
                                          "lammps/pairs/pair_list_builder.cpp", "if (divided) law = input.coefficients->between_bodies(law);", ""),
    "NO_STEERING": Fault("spheres do not approach the flow stress", ["metal that flows along"],
                         "lammps/yield/yield_condition.cpp", "records[i].factor = yielding::next_factor", "(void) yielding::next_factor"),
    "HALF_STRESS": Fault("half of the stress of a sphere", ["metal that flows along"],
                         "core/stress/stress_sums.h", "half[k] = -0.5 *", "half[k] = -0.25 *"),
    "REACTIONS_LOST": Fault("the stress of a sphere without the pairs that others list", ["metal that flows along"],
                            "core/stress/stress_sums.h", "if (partner[k] < nreact) add_values(", "if (false) add_values("),
    "PRESSURE_HARDENS": Fault("bonds that yield under pressure harden", ["pressure alone hardens nothing"],
                              "lammps/yield/yield_condition.cpp", "if (!yielding::hardens(", "if (false && !yielding::hardens("),
    "NOT_TAKEN_OVER": Fault("the volume energy does not take over what bonds no longer carry", ["pressure alone hardens nothing"],
                            "core/volume/volume_energy.h", "const bool yields = taken.bulk > 0.0 &&", "const bool yields = false &&"),
    "DAMAGE_LOST": Fault("spheres keep their limit as they are damaged", ["metal that softens along"],
                         "lammps/failure/failure.cpp", "std::max(failing::LEAST_LIMIT, 1.0 - own.damage)", "1.0"),
    "LATE_FAILURE": Fault("spheres begin to fail by half of the plastic strain around them", ["metal that softens along"],
                          "core/failure/failure.h", "return growth / strain_at_failure(", "return 0.5 * growth / strain_at_failure("),
    "PRESSED_METAL_FAILS": Fault("metal fails under pressure, too", ["pressure alone fails nothing"],
                                 "core/failure/failure.h", "!(growth > 0.0) || triaxiality <= LEAST_TRIAXIALITY", "!(growth > 0.0)"),
    "NEVER_PARTED": Fault("bonds of spheres that have parted do not end", ["bar pulled apart at its notch"],
                          "lammps/failure/failure.h", "return any_parted ? this : nullptr;", "return nullptr;"),
    "SECOND_HALF_STEP": Fault("a limit that falls has acted in both halves of the step", ["bar pulled apart at its notch"],
                              "lammps/pairs/step_work.h", "return -0.5 * force_lost", "return -0.0 * force_lost"),
    "DEBRIS_STICKS": Fault("spheres that have parted join again", ["debris neither sticks"],
                           "lammps/failure/failure.h", "override { return fails(i, j); }", "override { return i == j; }"),
    "UNSTRETCHED_JOIN": Fault("bodies join wherever they are pressed", ["blocks that hit each other"],
                              "core/joining/joining.h", "return exposure >= rule.exposure &&", "return exposure >= 0.0 * rule.exposure &&"),
    "HALF_VOLUME_FORCE": Fault("half of the forces of the volume energy", ["volume energy of a free body"],
                               "core/volume/volume_energy.h", "    return state;", "    state.bonded *= 0.5, state.pulling *= 0.5, state.pushing *= 0.5;\n    return state;"),
}
SAME = re.compile(r"^(LAMMPS_\w+|CMAKE_BUILD_TYPE|MPI_CXX_COMPILER|CMAKE_CXX_COMPILER):\w+=(.+)$", re.M)


def fault_names(test):
    """The faults that a test of this name must fail with."""
    return [name for name, fault in FAULTS.items() if any(words in test for words in fault.tests)]


class Build:
    """The plugin of a copy of the checkout."""

    def __init__(self, folder):
        cache = CHECKOUT / "build" / "CMakeCache.txt"
        if not cache.exists():
            raise RunError(f"no {cache}: run tools/setup.sh first")
        for part in ("src", "cmake", "tools", "CMakeLists.txt"):
            source = CHECKOUT / part
            (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / part)
        self.folder, self.changed = folder / "build", {}
        same = [f"-D{name}={value}" for name, value in SAME.findall(cache.read_text(encoding="utf-8"))]
        output_of(["cmake", "-S", str(folder), "-B", str(self.folder), "-DBUILD_TESTING=off", *same], folder, "CMake")

    def make(self, name=None):
        """With a fault, or without one. RunError where the sources have no such text, and with the compiler's words."""
        for path, text in self.changed.items():
            path.write_text(text, encoding="utf-8")
        self.changed = {}
        if name:
            fault, path = FAULTS[name], self.folder.parent / "src" / FAULTS[name].file
            text = self.changed[path] = path.read_text(encoding="utf-8")
            if text.count(fault.right) != 1:
                raise RunError(f"{name}: src/{fault.file} must have once: {fault.right}")
            path.write_text(text.replace(fault.right, fault.wrong), encoding="utf-8")
        output_of(["cmake", "--build", str(self.folder), "-j", str(os.cpu_count() or 1), "--target", "evpplugin"], self.folder, f"the build with {name}")


def main(words=None):
    parser = command_line(__doc__)
    parser.add_argument("--only", nargs="+", choices=FAULTS, default=list(FAULTS), metavar="FAULT", help="names in FAULTS")
    options = parser.parse_args(words)
    bad = []
    with errors_in_one_line("faults.py"), tempfile.TemporaryDirectory() as name:
        build = Build(pathlib.Path(name))
        lmp = str(build.folder / "lmp")
        tests = [test for test in collect() if test.ranks == 1]
        build.make()
        first = [test for test in tests if options.only[0] in fault_names(test.name)][:1]
        bad += [f"without a fault: {text}" for text, right in run([test.node for test in first], EVP_LMP=lmp).values() if not right]
        for fault in watched("faults", sorted(options.only, key=lambda fault: FAULTS[fault].file)):
            build.make(fault)
            print(f"{fault}: {FAULTS[fault].what}", flush=True)
            found = run([test.node for test in tests if fault in fault_names(test.name)], EVP_LMP=lmp)
            bad += [] if found else [f"{fault} has no test"]
            for (name, _), (text, right) in found.items():
                print(f"    {'PASSES' if right else 'fails, as expected'}: {name}: {text[:150]}", flush=True)
                bad += [f"'{name}' passes with {fault}"] if right else []
    for line in bad:
        print("NOT SEEN: " + line)
    print(f"{len(options.only)} faults, {f'{len(bad)} NOT seen' if bad else 'all seen'}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
