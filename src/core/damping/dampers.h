// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"
#include "core/pairs/pairs.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace EVP {

/// Mean separation rate (|r + dt v| - d)/dt of a pair over a timestep of constant relative velocity v from
/// r, d = |r|, times sqrt(gamma). Without the cancellation of the two distances.
///
/// It is u.v + dt (v^2 - o^2)/(2 d): a pair that rotates without strain (o = 0) has u.v = -dt v^2/(2 d).
///
/// along: sqrt(gamma) u.v, u the direction of r. speed_sq: v^2. half_step: sqrt(gamma) dt/(2 d),
/// negative for the timestep that ended at r. inv_gamma: 1/gamma.
inline double separation_rate(double along, double speed_sq, double half_step, double inv_gamma)
{
  const double half_change = along + half_step * speed_sq;                    // of d^2, over d dt
  const double ratio_sq = 1.0 + 4.0 * inv_gamma * half_step * half_change;    // of the distances
  return 2.0 * half_change / (1.0 + std::sqrt(std::max(ratio_sq, 0.0)));
}

/// The dashpots of one MPI rank, along the directions u at the last force evaluation: later positions
/// may have changed.
///
/// With w = sqrt(gamma) u, a rate is sqrt(gamma) times the mean speed at which a pair separates over a
/// timestep: w.v and what rotation adds, v the relative velocity at its end. The dashpot pulls at i with
/// -rate w, so that C is the sum of w w^T, and dissipates the power rate^2. Velocities and forces are
/// those of atoms and ghosts.
class Dampers {
 public:
  struct Damper {
    Vector w;
    int j;       ///< partner, local or ghost
    int pair;    ///< its PlacedPair::number
  };

  void clear() { rows.clear(); }

  /// Drops forces and rotation of the last timestep, as where the list was built anew.
  void reset() { last_build = -1; }
  bool are_of(const PairLists &list) const { return list.build == last_build; }

  /// The damped pairs within their cutoffs. gamma_of(pair): 0 where it has no dashpot.
  template <class F> void collect(const PairLists &list, const double (*x)[3], F &&gamma_of)
  {
    const size_t most = list.size();
    if (list.build != last_build)
      for (std::vector<double> *of_pairs : {&last_force, &last_rotation})
        of_pairs->assign(most, 0.0);
    last_build = list.build;
    nreact = list.nreact;
    rows.clear();
    dampers.resize(most);
    scale.resize(most);
    int law = -1, i = -1, n = 0;
    double root = 0.0;    // sqrt(gamma) of that law
    for_each_pair(list, x, [&](const PlacedPair &p) {
      if (p.law != law) {
        law = p.law;
        root = std::sqrt(gamma_of(p));
      }
      if (root == 0.0 || !p.acts()) return;
      const double over_d = root / p.distance();
      dampers[n] = {p.g * over_d, p.j, p.number};
      scale[n] = over_d;
      if (p.i != i) rows.push_back({i = p.i, n, n});
      rows.back().last = ++n;
    });
  }

  /// Calls f(i, Damper, force over w on i in the last timestep) for each dashpot.
  template <class F> void for_each(F &&f) const
  {
    for (const PackedRow &row : rows)
      for (int k = row.first; k < row.last; k++) f(row.i, dampers[k], last_force[dampers[k].pair]);
  }

  /// Part of a pair that counts on this rank: without newton both owners of a pair across ranks have it.
  double share(const Damper &damper) const { return rank_share(damper.j, nreact); }
  bool takes_reaction(const Damper &damper) const { return damper.j < nreact; }

  /// Adds the forces of the last timestep along the present directions.
  void add_last_forces(AtomValues &forces) const
  {
    for_each([&](int i, const Damper &damper, double along) {
      const Vector force = damper.w * along;
      force.add_to(forces[i]);
      if (takes_reaction(damper)) force.subtract_from(forces[damper.j]);
    });
  }

  /// y = C v
  void multiply(const AtomValues &v, AtomValues &y) const
  {
    react(v, y, [](int, const Vector &w, const Vector &dv) {
      return dot(w, dv);
    });
  }

  /// y = C v and what rotation adds over a timestep dt if pairs rotate as fast as in the last one.
  void multiply_rotating(const AtomValues &v, AtomValues &y, double dt)
  {
    if (dt_rotation > 0.0 && dt != dt_rotation)
      for (double &rotation : last_rotation) rotation *= dt / dt_rotation;
    dt_rotation = dt;
    react(v, y, [this](int k, const Vector &w, const Vector &dv) {
      return dot(w, dv) + last_rotation[dampers[k].pair];
    });
  }

  /// Minus the forces over a timestep dt that ends with v, which are kept with their rotation. Returns the
  /// square of half the largest angle by which a pair rotates in the timestep.
  double rotate(const AtomValues &v, AtomValues &y, double dt)
  {
    const double half_dt = 0.5 * dt;
    double rotated = 0.0;
    react(v, y, [&](int k, const Vector &w, const Vector &dv) {
      const int p = dampers[k].pair;
      const double along = dot(w, dv), inv_gamma = 1.0 / dot(w, w);
      const double half_step = half_dt * scale[k];
      const double rate = separation_rate(along, dot(dv, dv), half_step, inv_gamma);
      const double rotation = rate - along;
      rotated = std::max(rotated, half_step * rotation * inv_gamma);
      last_rotation[p] = rotation;
      last_force[p] = -rate;
      return rate;
    });
    return rotated;
  }

  /// Adds to each atom the squares of the terms of the forces of its row, of which rounding leaves some
  /// digits only.
  void add_noise(std::vector<double> &noise) const
  {
    for_each([&](int i, const Damper &damper, double last) {
      const Vector w = damper.w;
      const double rotation = last_rotation[damper.pair], along = last + rotation;
      noise[i] += dot(w, w) * (along * along + rotation * rotation);
    });
  }

  /// Rates over the timestep dt that ended here with mean velocities v, or now with dt = 0.
  void find_rates(const AtomValues &v, double dt)
  {
    rate_before.resize(count());
    for (const PackedRow &row : rows)
      for (int k = row.first; k < row.last; k++) {
        const Vector w = dampers[k].w;
        const Vector dv = Vector(v[row.i]) - Vector(v[dampers[k].j]);
        rate_before[k] =
            separation_rate(dot(w, dv), dot(dv, dv), -0.5 * dt * scale[k], 1.0 / dot(w, w));
      }
    rate_now = rate_before;
  }

  /// Rates now: the mean of those before and after.
  void find_mean_rates()
  {
    for (int k = 0; k < count(); k++)
      rate_now[k] = 0.5 * (rate_before[k] - last_force[dampers[k].pair]);
  }

  /// Power that is dissipated in the mean over half a timestep, before the present positions or after
  /// them [energy/time]. Requires find_rates() for these dashpots.
  double power(bool after) const
  {
    double sum = 0.0;
    for_each_power(after, [&](int, const Damper &damper, double dissipated) {
      sum += share(damper) * dissipated;
    });
    return sum;
  }

  /// Calls f(i, damper, that power of it) for all.
  template <class F> void for_each_power(bool after, F &&f) const
  {
    for (const PackedRow &row : rows)
      for (int k = row.first; k < row.last; k++) {
        const double rate = -last_force[dampers[k].pair];
        const double mean = 0.5 * (rate_now[k] + (after ? rate : rate_before[k]));
        f(row.i, dampers[k], rate * mean);
      }
  }

  double memory_usage() const
  {
    return bytes_of(dampers, rows, scale, last_force, last_rotation, rate_before, rate_now);
  }

 private:
  std::vector<Damper> dampers;    // with room to spare
  std::vector<PackedRow> rows;
  // of each dashpot: sqrt(gamma)/d, and the rates over the last timestep and at the present positions
  std::vector<double> scale, rate_before, rate_now;
  // over w, and the part of a rate; by index in the packed list
  std::vector<double> last_force, last_rotation;
  double dt_rotation = 0.0;    // timestep of last_rotation
  long last_build = -1;
  int nreact = 0;    // atoms below take reactions

  int count() const { return rows.empty() ? 0 : rows.back().last; }

  /// y = the sum of rate(k, w, relative velocity) w over the dashpots.
  template <class F> void react(const AtomValues &v, AtomValues &y, F &&rate) const
  {
    y.assign(v.size(), 0.0);
    const auto *const all = v.rows();
    auto *const forces = y.rows();
    for (const PackedRow &row : rows) {
      const Vector vi(all[row.i]);
      Vector yi;
      for (int k = row.first; k < row.last; k++) {
        const Damper &damper = dampers[k];
        const Vector w = damper.w;
        const Vector force = w * rate(k, w, vi - Vector(all[damper.j]));
        yi = yi + force;
        if (takes_reaction(damper)) force.subtract_from(forces[damper.j]);
      }
      yi.add_to(forces[row.i]);
    }
  }
};

}    // namespace EVP
