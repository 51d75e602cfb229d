// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/powers.h"
#include "core/row.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace EVP {

/// Strains closer to the elastic limit than this are at it: a pair that has just flowed stays as it is, to the last bit,
/// when its force is evaluated again, as after a restart.
constexpr double AT_LIMIT = 4e-15;

/// How a pair flows beyond its elastic limit.
enum class Flow {
  FORGETS,      ///< eq. 8: what flows is stored, and comes back
  STAYS,        ///< plasticity isotropic
  COMPRESSES    ///< the same of a contact, which only repels
};

/// What a pair has flowed so far: the offset q over deq, and k, the sum of |dq| over deq.
struct Offset {
  double q = 0.0, k = 0.0;
};

/// What a pair holds above its energy at deq [energy]: by its elastic strain, and with eq. 8 by flow that it forgets.
struct Stored {
  double elastic, forgotten;
  double total() const { return elastic + forgotten; }
};

/// One regime of a pair (eqs. 1 and 2): energies, and forces times deq, at a strain with s = deq/d = 1/(1 + strain).
template <class Powers> struct Regime {
  double a, e;
  Powers powers;

  Regime(double e_in, double m, double n) : a(m * n * e_in / (m - n)), e(e_in), powers{m, n} {}

  EVP_INLINE double force(double s) const { return force(a, s, powers(s)); }
  EVP_INLINE static double force(double a, double s, PowerPair of_s)
  {
    return a * s * (of_s.sm - of_s.sn);
  }

  /// 1 - s^N at exponents (2 N, N), to the last digits: of it both force and energy are products.
  EVP_INLINE static double opened(double strain, double s)
  {
    return power_minus_1<Powers::lower>(strain) * fixed_power<Powers::lower>(s);
  }

  /// Phi(d) - Phi(deq), accurate to 1e-11 of itself at any strain: no difference of large numbers is left.
  EVP_INLINE double stored(double strain, double s) const
  {
    return e * stored_per_depth(powers, strain, s);
  }

  /// -dF/dd deq^2.
  double stiffness(double s) const
  {
    const PowerPair of_s = powers(s);
    return a * s * s * ((powers.m + 1.0) * of_s.sm - (powers.n + 1.0) * of_s.sn);
  }

 private:
  template <int M, int N>
  EVP_INLINE static double stored_per_depth(FixedPowers<M, N>, double strain, double s)
  {
    const double open = power_minus_1<N>(strain) * fixed_power<N>(s);
    return open * open;
  }
  static double stored_per_depth(const AnyPowers &powers, double strain, double s)
  {
    return with_powers(powers.m, powers.n, powers, [strain, s](const auto &own) -> double {
      if constexpr (std::decay_t<decltype(own)>::are_fixed)
        return stored_per_depth(own, strain, s);
      else {
        const double log_s = -std::log1p(strain), m = own.m, n = own.n;
        return (n * expm1_minus_x(m * log_s) - m * expm1_minus_x(n * log_s)) / (m - n);
      }
    });
  }
};

/// The law of a pair with the coefficients of a row: the only place of eqs. 1, 2 and 8 and of plasticity. A value type;
/// Powers: the exponents of both regimes as a type, or AnyPowers.
///
/// Notation: d distance of the centres, deq the equilibrium distance of the pair, r = d/deq, F > 0 repels.
/// An offset q deq shifts the pair: its elastic strain is r - 1 - q, and F = F_I(d - q deq).
///
/// Eq. 8 is a return map that forgets: beyond xi_s the elastic strain stays there, the rest is an offset found from 0
/// each time, which adds F_II((1 + q) deq), and what it takes counts as stored.
/// With plasticity offsets stay, nothing is added, and the elastic limit grows with k:
/// y(k) = xi_s + h K(k), K = k, or k_s (1 - exp(-k/k_s)) with saturation k_s. h makes the slope beyond it that of eq. 8.
template <class Powers> class Law {
 public:
  Regime<Powers> first, second;
  double xi_s, gamma;
  double hardening, saturation;    ///< h; k_s, 0 where linear

  /// Throws BadInput where a member breaks its rule, or numbers of this law would overflow.
  explicit Law(const Row &row) :
      first(row.e1, row.m1, row.n1), second(row.e2, row.m2, row.n2), xi_s(row.xi_s),
      gamma(row.gamma), saturation(row.saturation)
  {
    const double ratio = row.m2 * row.n2 * row.e2 / (row.m1 * row.n1 * row.e1);
    hardening = ratio < 1.0 ? ratio / (1.0 - ratio)
                            : 0.0;    // with plasticity PairLaw::check_flow() refuses others
    flowing = 1.0 / (1.0 + hardening);
    const auto at = [this](double strain) {
      const double s = 1.0 / (1.0 + strain);
      return Threshold{first.force(s), first.stored(strain, s)};
    };
    stretched = at(xi_s);
    compressed = at(-xi_s);
  }

  // eq. 8

  /// The regime of a pair at r, and 1/s in it.
  struct Place {
    bool is_first, is_stretched;
    double r, shifted;
  };
  EVP_INLINE Place place(double r) const
  {
    const double xi = r - 1.0;
    const bool is_first = std::fabs(xi) <= xi_s;
    return {is_first, xi > 0.0, r, r - (is_first ? 0.0 : std::copysign(xi_s, xi))};
  }

  /// F deq.
  EVP_INLINE double force(const Place &at, double s) const
  {
    // in this order: the other one costs g++ 12 a tenth of the loop
    const double side = at.is_stretched ? stretched.force : compressed.force;
    const double a = at.is_first ? first.a : second.a;
    const double carried = at.is_first ? 0.0 : side;
    return Regime<Powers>::force(a, s, powers_at(at, s)) + carried;
  }

  /// F_I and F_II integrated from deq.
  EVP_INLINE Stored stored(const Place &at, double s) const
  {
    const double xi = at.r - 1.0;
    const double strain = at.is_first ? xi : xi - std::copysign(xi_s, xi);
    double own;
    if constexpr (Powers::are_fixed) {
      const double open = Regime<Powers>::opened(strain, s);
      own = (at.is_first ? first.e : second.e) * open * open;
    } else
      own = (at.is_first ? first : second).stored(strain, s);
    const double carried = at.is_stretched ? stretched.stored : compressed.stored;
    const double force = at.is_stretched ? stretched.force : compressed.force;
    return {at.is_first ? own : carried, at.is_first ? 0.0 : own - force * strain};
  }

  // plasticity

  /// y(k): the largest elastic strain.
  EVP_INLINE double limit(double k) const
  {
    return xi_s + hardening * (saturation == 0.0 ? k : -saturation * std::expm1(-k / saturation));
  }

  /// By how much a pair flows whose elastic strain would be `strain`, with its sign taken out: Delta of
  /// strain - Delta = y(k + Delta), for any increment.
  EVP_INLINE double slip_linear(double strain, double k) const
  {
    const double over = strain - (xi_s + hardening * k);
    return over > AT_LIMIT ? over * flowing : 0.0;
  }
  double slip(double strain, double k) const
  {
    if (saturation == 0.0) return slip_linear(strain, k);
    const double over = strain - limit(k);
    if (!(over > AT_LIMIT)) return 0.0;
    double delta = over * flowing;    // too little, and so is each step of Newton's
    for (int it = 0; it < 100; it++) {
      const double rest = strain - delta - limit(k + delta);
      const double step = rest / (1.0 + hardening * std::exp(-(k + delta) / saturation));
      if (!(step > 0.0) || delta + step == delta) break;
      delta += step;
    }
    return delta;
  }

  /// Dissipated as a pair slips at its limit, whose elastic strain has this sign [energy]: the integral of |F_I| deq dk.
  EVP_INLINE double dissipated(double sign, double k, double slip) const
  {
    if constexpr (Powers::are_fixed)
      if (saturation == 0.0) return dissipated_linear(sign, k, slip);
    return dissipated_by_gauss(sign, k, slip);
  }

  /// The same for linear hardening in closed form, [Phi_I at y(k + slip) - Phi_I at y(k)]/h without cancellation.
  EVP_INLINE double dissipated_linear(double sign, double k, double slip) const
  {
    constexpr int N = Powers::lower;
    const double y = xi_s + hardening * k;
    const double before = sign * y, after = sign * (y + hardening * slip);
    const double both = 1.0 / ((1.0 + before) * (1.0 + after));
    const double s0 = both * (1.0 + after), s1 = both * (1.0 + before);
    const double open = Regime<Powers>::opened(before, s0) + Regime<Powers>::opened(after, s1);
    return first.e * std::fabs(open) * power_quotient<N>(s0, s1) * both * slip;
  }
  double dissipated_by_gauss(double sign, double k, double slip) const
  {
    constexpr double AT[] = {0.0, 0.5384693101056831, 0.9061798459386640};
    constexpr double WEIGHT[] = {128.0 / 225.0, 0.4786286704993665, 0.2369268850561891};
    const double bends = saturation == 0.0
        ? slip
        : std::min(slip, 40.0 * saturation);    // the limit is constant then
    const double end = limit(k + bends);
    const double steep =
        (1.0 + first.powers.m) * (end - limit(k)) / (1.0 + std::min(0.0, sign * end));
    const int parts = 1 + (saturation == 0.0 ? 0 : (int) (2.0 * bends / saturation)) + (int) steep;
    const auto force_at = [this, sign, k](double by) {
      return std::fabs(first.force(1.0 / (1.0 + sign * limit(k + by))));
    };
    const double half = 0.5 * bends / parts;
    double sum = 0.0;
    for (int part = 0; part < parts; part++)
      for (int point = -2; point <= 2; point++) {
        const double at = 2 * part + 1 + std::copysign(AT[std::abs(point)], point);
        sum += WEIGHT[std::abs(point)] * force_at(half * at);
      }
    return half * sum + (slip > bends ? (slip - bends) * force_at(slip) : 0.0);
  }

 private:
  struct Threshold {
    double force, stored;    ///< F_I deq and Phi_I - Phi_I(deq) at ds
  };
  Threshold stretched, compressed;
  double flowing;    // share of an increment beyond the limit that flows

  EVP_INLINE PowerPair powers_at(const Place &at, double s) const
  {
    if constexpr (Powers::are_fixed)
      return first.powers(s);
    else
      return (at.is_first ? first : second).powers(s);
  }
};

/// What the law reads of a pair beside its distance.
struct PairVariables {
  double inv_deq;    ///< 1/deq [1/length]
  Flow flow = Flow::FORGETS;
  Offset offset = {};    ///< of a pair whose flow stays, else 0
};

/// All that the law says of one pair. Forces and stiffness with their units: [energy/length], [energy/length^2].
struct PairState {
  double force;              ///< positive repels
  Stored stored;             ///< [energy]
  double dissipated;         ///< by flow on the way here [energy]
  double stiffness;          ///< -dF/dd, elastic; that of the first regime at xi_s, where it jumps
  double stiffness_ahead;    ///< the largest one that it can have in the steps to come
  Offset offset;             ///< after the flow
  int regime;                ///< 1 or 2 (eq. 8); with plasticity 2 once it has flowed
};

/// The law of a pair for all but the time-step loop.
class PairLaw : public Law<AnyPowers> {
 public:
  Row row;

  /// Throws BadInput where a member breaks its rule, or numbers of this law would overflow.
  explicit PairLaw(const Row &row_in = {}) : Law(checked(row_in)), row(row_in) { check_range(); }

  /// Throws BadInput where the row cannot flow.
  void check_flow() const
  {
    if (!(row.m2 * row.n2 * row.e2 < row.m1 * row.n1 * row.e1))
      throw BadInput(
          "plasticity isotropic needs a second regime less stiff than the first, got m2 n2 e2 = " +
          rounded(row.m2 * row.n2 * row.e2) +
          " and m1 n1 e1 = " + rounded(row.m1 * row.n1 * row.e1) + ": flow would not end");
  }

  /// At r = d/deq.
  PairState state(double r, const PairVariables &pair) const
  {
    PairState now = pair.flow == Flow::FORGETS ? state_forgetting(r) : state_flowing(r, pair);
    now.stiffness_ahead =
        std::max(now.stiffness, now.stiffness_ahead) * pair.inv_deq * pair.inv_deq;
    now.stiffness *= pair.inv_deq * pair.inv_deq;
    now.force *= pair.inv_deq;
    return now;
  }

  /// |K_I(r deq)| with the first regime carried on to any r, which eq. 6 asks for [energy/length^2].
  double first_stiffness(double r, double deq) const
  {
    return std::fabs(first.stiffness(1.0 / r)) / (deq * deq);
  }

  /// The strain where F_I is largest in tension: a limit beyond it softens the pair.
  double strongest_strain() const
  {
    return std::pow((row.m1 + 1.0) / (row.n1 + 1.0), 1.0 / (row.m1 - row.n1)) - 1.0;
  }

 private:
  PairState state_forgetting(double r) const
  {
    PairState now{};
    const Place at = place(r);
    const double s = 1.0 / at.shifted;
    now.force = force(at, s);
    now.stored = stored(at, s);
    now.stiffness = (at.is_first ? first : second).stiffness(s);
    now.stiffness_ahead =
        std::max(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2);    // where regimes begin
    now.regime = at.is_first ? 1 : 2;
    return now;
  }

  PairState state_flowing(double r, const PairVariables &pair) const
  {
    PairState now{};
    const Offset &before = pair.offset;
    const bool is_contact = pair.flow == Flow::COMPRESSES;
    const double strain = r - 1.0 - before.q;
    const double by = slip(is_contact ? -strain : std::fabs(strain), before.k);
    now.offset = {before.q + std::copysign(by, strain), before.k + by};
    const double elastic = r - 1.0 - now.offset.q;
    const double acting = is_contact ? std::min(elastic, 0.0)
                                     : elastic;    // a contact apart does nothing
    const double s = 1.0 / (1.0 + acting);
    now.force = first.force(s);
    now.stored = {first.stored(acting, s), 0.0};
    now.dissipated = by > 0.0 ? dissipated(std::copysign(1.0, strain), before.k, by) : 0.0;
    now.stiffness = elastic > acting ? 0.0 : first.stiffness(s);
    now.stiffness_ahead = row.m1 * row.n1 * row.e1;
    now.regime = now.offset.k > 0.0 ? 2 : 1;
    return now;
  }

  /// Leaves room for distances far from deq and for products of forces.
  void check_range() const
  {
    constexpr double LARGEST = 1e200;
    for (const double d : {1.0 + xi_s, 1.0 - xi_s, 0.5, row.alpha}) {
      const PairState at = state(d, {1.0});
      for (const double value : {at.force, at.stiffness_ahead, at.stored.total(), row.gamma})
        if (!(std::fabs(value) <= LARGEST))
          throw BadInput(
              "these parameters overflow double precision: check e1, e2, gamma and the exponents");
    }
  }
};

}    // namespace EVP
