// SPDX-License-Identifier: GPL-2.0-only
#pragma once

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

/// What pairs leave on the particles of one MPI rank, and what their limits are multiplied by. That of fix evp/heat.
class Heat {
 public:
  std::vector<double> generated;    ///< what was added, by particles and ghosts [energy]

  /// Half to each particle of a pair, to the second one where it takes reactions [energy].
  void add(int i, int j, bool takes_reaction, double energy)
  {
    generated[i] += 0.5 * energy;
    if (takes_reaction) generated[j] += 0.5 * energy;
  }

  /// Half of what a pair of own particle i has dissipated by flow [energy].
  virtual void add_plastic(int i, double energy) = 0;

  /// Collective. The pairs were packed. Particles that have come without a temperature get one.
  virtual void note_packing(const PairLists &) = 0;

  /// Collective. What was added goes to the owners: before particles migrate.
  virtual void bring_home() = 0;

  /// Is it handed out before the forces of this step?
  virtual bool is_due() const = 0;

  /// Collective. Conducts by the bonds at the present positions, and hands out what was brought home.
  virtual void hand_out(const PairLists &) = 0;

  /// Plastic strain of own particle i, each time before limits move on.
  virtual void take_strain(int i, double p) = 0;

  /// Limits follow the temperatures and strain rates of now.
  virtual void take_factors() = 0;

  /// Would that change any of an own particle?
  virtual bool factors_are_old() const = 0;

  /// What the limit of own particle i is multiplied by, as of then.
  virtual double factor(int i) const = 0;

  /// Time that the explicit damping of the next forces stands for, once in a step; then and outside of steps 0.
  virtual double take_damping_time() = 0;

 protected:
  ~Heat() = default;
};

/// Heat of the explicit damping of eq. 4, pair by pair, at the velocities that the forces see.
class DampingHeat final : public PairConsumer {
 public:
  /// heat: nullptr without
  DampingHeat(Heat *heat_in, int nreact_in) :
      heat(heat_in), nreact(nreact_in), time(heat ? heat->take_damping_time() : 0.0)
  {
  }

  void operator()(const PairRange &range, PairBlock &block) override
  {
    const int *const partner = range.list.j.data();
    double *const to = heat->generated.data();
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
  bool acts() const { return time > 0.0; }

 private:
  Heat *const heat;
  const int nreact;
  const double time;
};

}    // namespace EVP
