// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/timestep/stiffness_matrix.h"
#include "lammps/base/lammps_names.h"
#include "lammps/pairs/pair_data.h"

namespace EVP {

/// Largest stable timesteps of the pairs that interact now, see doc/compute_evp_dt.rst.
class StableTimesteps : protected Pointers {
 public:
  static constexpr double NO_LIMIT = 1.0e20;     ///< nothing interacts: any timestep is stable
  static constexpr double TOLERANCE = 1.0e-4;    ///< of an eigenvalue; half of it in dt
  static constexpr double ACCURACY = 1.0e-3;     ///< of what the explicit limit is corrected to
  static constexpr int MAX_ITERATIONS = 500;

  /// exchange: of up to three values per atom.
  StableTimesteps(LAMMPS *lmp, PerAtomComm &exchange) : Pointers(lmp), linear(exchange) {}

  /// Atoms of the first groups and of none of the others, as bits. The rest is held.
  struct FreeAtoms {
    int groups, held_groups = 0;
    bool has(int mask) const { return (mask & groups) && !(mask & held_groups); }
  };

  /// Collective. The pairs at the present positions. The pairs must be packed, and their volume energy evaluated.
  void linearise(const PairData &, const FreeAtoms &);

  // all collective, after linearise()

  double undamped_dt() { return root_of(lambda_k(), 0.0); }    ///< velocity Verlet, no damping
  double explicit_dt();                                        ///< velocity Verlet
  double implicit_dt();                                        ///< a lower bound, fix nve/evp
  /// Not above explicit_dt(); without the damping not above undamped_dt().
  double row_sum_dt(bool with_damping = true) const;

  /// The largest stable timestep: implicit_dt() where fix nve/evp integrates all the free atoms that interact, else
  /// explicit_dt().
  double limit() { return all_implicit() ? implicit_dt() : explicit_dt(); }
  bool all_implicit() const;

  /// Not above limit(), and without any eigenvalue.
  double bound() const;

  /// Is a timestep below explicit_dt()? Takes one eigenvalue only.
  bool is_stable_explicitly(double dt)
  {
    return largest_eigenvalue({dt * dt, dt * dt, 2.0 * dt, dt * dt}) <= 4.0;
  }

  /// Of the paper, eqs. 6 and 7: overlap of 0.3, deq = R_i + R_j; knows neither coordination nor gamma.
  double paper_dt(const PairData &) const;

  /// Did all eigenvalues converge that were computed since linearise()?
  bool converged() const { return all_converged; }

  double memory_usage() const { return linear.memory_usage(); }

 private:
  StiffnessMatrix linear;
  int implicit_groupbits = 0;         // of atoms whose pairs are damped implicitly
  double least_damping = NO_LIMIT;    // of the damped links, over their axial stiffness [time]
  bool any_damped = false;
  bool any_undamped = false;    // is there a stiff link without damping?
  double stiffest = -1.0;       // lambda_k(), negative before it is known
  bool all_converged = true;

  static double root_of(double a, double b);
  double highest_row_sum(const StiffnessMatrix::Mix &) const;
  double implicit_dt(double lambda_axial, double lambda_rest, double undamped) const;
  void set_atoms(const FreeAtoms &);
  void set_pairs(const PairData &);
  double largest_eigenvalue(const StiffnessMatrix::Mix &);
  double lambda_k();
};

/// Collective, at the set-up of a run, with the packed pairs at the present positions. Warns of a timestep above the largest
/// stable one. Atoms that do not follow the forces on them are held.
void warn_of_timestep(LAMMPS *, const PairData &);

}    // namespace EVP
