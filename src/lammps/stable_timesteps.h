// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/stiffness_matrix.h"
#include "lammps_names.h"
#include "pair_data.h"

#include <vector>

namespace EVP {

/// Largest stable timesteps of the network of pairs that interact now, see doc/compute_evp_dt.rst.
class StableTimesteps : protected Pointers {
 public:
  static constexpr double NO_LIMIT = 1.0e20;     ///< nothing interacts: any timestep is stable
  static constexpr double TOLERANCE = 1.0e-4;    ///< of an eigenvalue; half of it in dt
  static constexpr double ACCURACY = 1.0e-3;     ///< of what the explicit limit is corrected to
  static constexpr int MAX_ITERATIONS = 500;

  /// exchange: of three values per atom and ghost.
  StableTimesteps(LAMMPS *lmp, PerAtomComm &exchange) : Pointers(lmp), linear(exchange) {}

  /// Atoms of the first groups and of none of the others, as bits. The rest is held.
  struct FreeAtoms {
    int groups, held_groups = 0;
    bool has(int mask) const { return (mask & groups) && !(mask & held_groups); }
  };

  /// Collective. The network at the present positions. The pairs must be packed, and their volume energy evaluated.
  void linearise(const PairData &, const FreeAtoms &);

  // all collective, after linearise()

  double undamped_dt() { return root_of(lambda_k(), 0.0); }    ///< velocity Verlet, no damping
  double explicit_dt();                                        ///< velocity Verlet
  double implicit_dt();                                        ///< a lower bound, fix nve/evp
  double row_sum_dt() const;                                   ///< not above explicit_dt()

  /// Of the integrator that there is: implicit_dt() if fix nve/evp integrates all the free atoms that interact.
  double present_dt() { return all_implicit() ? implicit_dt() : explicit_dt(); }
  bool all_implicit() const;

  /// Is a timestep below explicit_dt()? Takes one eigenvalue only.
  bool is_stable_explicitly(double dt)
  {
    return largest_eigenvalue({dt * dt, dt * dt, 2.0 * dt, dt * dt}) <= 4.0;
  }

  /// Of the paper, eqs. 6 and 7.
  double paper_dt() const { return paper; }

  /// Did all eigenvalues converge that were computed since linearise()?
  bool converged() const { return all_converged; }

  /// Of a pair in the network [force/length].
  struct Stiffness {
    double axial, across;
  };
  static Stiffness stiffness_of(const PairData &, const PlacedPair &);

  double memory_usage() const { return linear.memory_usage(); }

 private:
  StiffnessMatrix linear;
  std::vector<double>
      above_volume;           // axial stiffness that is not below the volume energy's, by link
  double paper = NO_LIMIT;    // eqs. 6 and 7
  double stiffest = -1.0;     // lambda_k(), negative before it is known
  bool all_converged = true;

  static double root_of(double a, double b);
  void take_atoms(const VolumeForces *, const FreeAtoms &);
  std::vector<double> take_pairs(const PairData &);
  double largest_eigenvalue(const StiffnessMatrix::Mix &);
  double lambda_k();
};

}    // namespace EVP
