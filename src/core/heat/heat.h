// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/law/row.h"
#include "core/pairs/pair_block.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace EVP {

/// Share of its limit that a sphere keeps at a temperature: 1 - ((T - TREF)/(TMELT - TREF))^M (Johnson and Cook), and no
/// less than a floor.
inline double softening(const Row &row, double temperature)
{
  if (row.soften_tref < 0.0 || !(temperature > row.soften_tref)) return 1.0;
  const double share = (temperature - row.soften_tref) / (row.soften_tmelt - row.soften_tref);
  return std::max(1.0 - std::pow(share, row.soften_m), row.soften_floor);
}

/// What its limit is multiplied by at a plastic strain rate [1/time]: 1 + C ln(rate/RATE0) above RATE0 (Johnson and Cook).
inline double hardening_by_rate(const Row &row, double rate)
{
  return rate > row.rate_rate0 ? 1.0 + row.rate * std::log(rate / row.rate_rate0) : 1.0;
}

/// By how much the lengths of a sphere are larger than at TREF.
inline double thermal_growth(const Row &row, double temperature)
{
  return 1.0 + row.expansion * (temperature - row.expansion_tref);
}

/// The part of a particle in the conductances of its bonds [length^3]: 3 V/z, V its share of the volume of the body; 2 V/z
/// in a plane.
inline double conducting_share(int dimension, double volume, double bonds)
{
  return bonds > 0.0 ? dimension * volume / bonds : 0.0;
}

/// Conductance of a bond between particles that are d apart [power/temperature]: k (share_i + share_j)/d^2, with which
/// the bonds of an isotropic body add up to k. Of two materials k is that of both in series. d counts as no shorter than half
/// of R_i + R_j: the largest stable step would go to zero.
inline double conductance(double k_i, double k_j, double share_i, double share_j, double dsq,
                          double sum_radii)
{
  if (!(k_i > 0.0 && k_j > 0.0)) return 0.0;
  const double in_series = k_i == k_j ? k_i : 2.0 * k_i * k_j / (k_i + k_j);
  return in_series * (share_i + share_j) / std::max(dsq, 0.25 * sum_radii * sum_radii);
}

/// Heat of a particle: what it has taken is in its temperature, and once it melts in its latent heat first.
struct ThermalState {
  double temperature;
  double latent;    ///< taken so far [energy]

  /// Others may have set the temperature: as much latent heat as there is at that one.
  void settle(const Row &row, double mass)
  {
    if (temperature < row.soften_tmelt) latent = 0.0;
    if (temperature > row.soften_tmelt) latent = mass * row.melt;
  }

  /// Takes an energy, which may be negative, where latent heat is settled.
  void take(double energy, const Row &row, double mass)
  {
    const double capacity = mass * row.capacity, most = mass * row.melt;
    if (!(most > 0.0)) {
      temperature += energy / capacity;
      return;
    }
    const double above = capacity * (temperature - row.soften_tmelt) + latent + energy;
    latent = std::clamp(above, 0.0, most);
    temperature = row.soften_tmelt + (above - latent) / capacity;
  }
};

/// Heat of the explicit damping of eq. 4, pair by pair, at the velocities that the forces see.
class DampingHeat final : public PairConsumer {
 public:
  double time = 0.0;    ///< that the damping of a force evaluation stands for
  int nreact = 0;
  AtomValues *generated = nullptr;    ///< of particles and ghosts, one each [energy]

  void operator()(const PairRange &range, PairBlock &block) override
  {
    const int *const partner = range.list.j.data();
    double *const to = generated->data();
    const double half = -0.5 * time;
    range.for_each_row([&](int i, int first, int last) {
      double sum = 0.0;
      for (int n = first; n < last; n++) {
        const int j = partner[n], k = n - range.first;
        const double energy = half * block.damping[k] * block.approach[k];
        sum += energy;
        if (j < nreact) to[j] += energy;
      }
      to[i] += sum;
    });
  }
};

}    // namespace EVP
