// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/energy_balance.h"
#include "scene.h"

#include <type_traits>

namespace EVP {

/// What acts on an atom at an end of a step [force].
struct AtomForces {
  double working[3];    ///< on a prescribed atom the forces of pairs; else all forces but those
  double damping[3];    ///< explicit one, which is in neither
};

/// Forces on local atoms: all; those of the pairs, explicit damping included; that damping; that of fix nve/evp, nullptr
/// without. Damps: there is explicit damping. Others: other forces may act beside these. An atom is integrated if forces move
/// it, else its motion is prescribed.
template <bool Damps, bool Others> struct ActingForces {
  const double *whole, *of_pairs, *damping, *solved;

  /// Can anything do work on the atom that is an entry of the balance?
  bool work_on(bool integrated) const { return Others || !integrated; }

  EVP_INLINE void find(int i, bool integrated, AtomForces &now) const
  {
    const size_t first = (size_t) 3 * i;
    for (int c = 0; c < 3; c++) {
      double of_ours = whole[first + c];
      if constexpr (Others) of_ours = of_pairs[first + c] + (solved ? solved[first + c] : 0.0);
      if (integrated)
        now.working[c] = whole[first + c] - of_ours;
      else {
        now.damping[c] = Damps ? damping[first + c] : 0.0;
        now.working[c] = of_ours - now.damping[c];
      }
    }
  }

  /// By the explicit damping of an integrated atom over the half step before or after the present positions, in the mean
  /// [energy/time]. At the beginning of a step atoms hold the half-step velocity by now, at its end that of the full
  /// step: of either the mean over the half step is half of its kick away.
  double dissipated(const Atom *atom, const Force *force, double dt, int i) const
  {
    if constexpr (!Damps) return 0.0;
    const double quarter = 0.25 * dt * scene::inverse_mass(atom, force, i);
    const size_t first = (size_t) 3 * i;
    const double *const v = atom->v[0] + first, *const f = whole + first;
    double sum = 0.0;
    for (int c = 0; c < 3; c++) sum -= damping[first + c] * (v[c] - quarter * f[c]);
    return sum;
  }
};

/// Calls f(ActingForces) with those of the last force evaluation.
template <class F>
void with_acting_forces(const PairWork &pairs, const double *whole, const double *solved, F &&f)
{
  const auto call = [&](auto damps, auto others) {
    f(ActingForces<damps, others>{whole, pairs.force.data(), pairs.damping.data(), solved});
  };
  using std::false_type, std::true_type;
  if (pairs.damping.empty())
    pairs.separates ? call(false_type(), true_type()) : call(false_type(), false_type());
  else
    pairs.separates ? call(true_type(), true_type()) : call(true_type(), false_type());
}

}    // namespace EVP
