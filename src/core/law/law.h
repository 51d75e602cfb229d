// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law/powers.h"
#include "core/law/row.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace EVP {

/// How a pair flows beyond its elastic limit.
enum class Flow {
  REVERSIBLE,        ///< eq. 8: what flows is stored, and comes back
  PLASTIC,           ///< plasticity isotropic: deq moves
  PLASTIC_CONTACT    ///< the same of a contact, which only repels
};

/// With plasticity a pair is at its limit from this share of it on. Limits move on in steps of time, and a pair that flows
/// is a little below its limit after each of them.
constexpr double AT_LIMIT = 0.99;

// Where a contact has flowed by more than this share its deq is not R_i + R_j.
constexpr double CONTACT_MARGIN = 1.0e-12;

/// ln(a/b), to the last digits: by how much a pair flows. The series is for numbers that differ by less than a tenth.
EVP_INLINE double log_of_close_ratio(double a, double b)
{
  const double z = (a - b) / (a + b), zz = z * z;
  return 2.0 * z *
      (1.0 + zz * (1.0 / 3.0 + zz * (1.0 / 5.0 + zz * (1.0 / 7.0 + zz * (1.0 / 9.0 + zz / 11.0)))));
}
EVP_INLINE bool are_close(double a, double b)
{
  return std::fabs(a - b) < 0.1 * b;
}
inline double log_of_ratio(double a, double b)
{
  return are_close(a, b) ? log_of_close_ratio(a, b) : std::log1p((a - b) / b);
}

/// What a pair holds above its energy at deq [energy]: by its elastic strain, and with eq. 8 by its reversible flow.
struct Stored {
  double elastic, second;
  double total() const { return elastic + second; }
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
  EVP_INLINE static double stored_per_depth(Powers84, double strain, double s)
  {
    const double open = Powers84::one_minus_sn(strain, s);
    return open * open;
  }
  static double stored_per_depth(const AnyPowers &any, double strain, double s)
  {
    const double m = any.m, n = any.n;
    if (Powers84::are(m, n)) return stored_per_depth(Powers84(), strain, s);
    const double log_s = -std::log1p(strain);
    return (n * expm1_minus_x(m * log_s) - m * expm1_minus_x(n * log_s)) / (m - n);
  }
};

/// The law of a pair with the coefficients of a row: the only place of eqs. 1, 2 and 8 and of plasticity. A value type;
/// Powers: the exponents of both regimes as a type, or AnyPowers.
///
/// Notation: d distance of the centres, deq the equilibrium distance of the pair, r = d/deq, F > 0 repels.
///
/// With plasticity there is the first regime alone, at the elastic r, which is within 1 -+ y, y being the limit that the spheres
/// of the pair have: beyond it deq moves, so that d/deq is there. F d and what is stored do not change as a pair flows.
template <class Powers> class Law {
 public:
  Regime<Powers> first, second;
  double xi_s, gamma;

  /// Throws BadInput where a member breaks its rule, or numbers of this law would overflow.
  explicit Law(const Row &row) :
      first(row.e1, row.m1, row.n1), second(row.e2, row.m2, row.n2), xi_s(row.xi_s),
      gamma(row.gamma)
  {
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
      const double open = Powers::one_minus_sn(strain, s);
      own = (at.is_first ? first.e : second.e) * open * open;
    } else
      own = (at.is_first ? first : second).stored(strain, s);
    const double carried = at.is_stretched ? stretched.stored : compressed.stored;
    const double force = at.is_stretched ? stretched.force : compressed.force;
    return {at.is_first ? own : carried, at.is_first ? 0.0 : own - force * strain};
  }

  // plasticity

  /// A pair whose flow stays.
  struct Flowed {
    double elastic;          ///< r after the flow, within the limit; of a contact that is apart 1
    double inv_deq;          ///< after the flow
    double force, stored;    ///< F deq and the energy above deq [energy]
    double force_d;          ///< F d [energy]
  };

  /// Return mapping of a pair at r: deq moves until d/deq is within 1 -+ limit. A contact flows in compression only; one that
  /// is past its cutoff rests at R_i + R_j again. inv_deq: before the flow. inverses(elastic): {1/elastic, elastic/d}.
  /// Stores: is `stored` asked for?
  template <bool Contact, bool Stores, class F>
  EVP_INLINE Flowed flow(double r, double limit, bool past_cutoff, double inv_deq,
                         F &&inverses) const
  {
    const double low = 1.0 - limit, high = Contact ? 1.0 : 1.0 + limit;
    const double elastic = r < low ? low : r > high ? high : r;
    const bool returns = past_cutoff && r > 1.0 + CONTACT_MARGIN;
    const bool flows = Contact ? elastic > r || returns : elastic != r;
    const auto [s, inv_deq_flowed] = inverses(elastic);
    const double inv_deq_next = flows ? inv_deq_flowed : inv_deq;
    const double force = first.force(s);
    const double stored = Stores ? first.stored(elastic - 1.0, s) : 0.0;
    return {elastic, inv_deq_next, force, stored, force * elastic};
  }

  /// Dissipated by that flow [energy]: the integral of |F| along d, as F d stays. log_ratio: ln(r/elastic).
  EVP_INLINE static double dissipated(double force_d, double log_ratio)
  {
    return std::fabs(force_d * log_ratio);
  }

 private:
  struct Threshold {
    double force, stored;    ///< F_I deq and Phi_I - Phi_I(deq) at ds
  };
  Threshold stretched, compressed;

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
  Flow flow = Flow::REVERSIBLE;
  double limit = 0.0;    ///< how far it holds, where flow stays
  double cut = 0.0;      ///< distance beyond which nothing acts [length]
};

/// All that the law says of one pair. Forces and stiffness with their units: [energy/length], [energy/length^2].
struct PairState {
  double force;              ///< positive repels
  Stored stored;             ///< [energy]
  double dissipated;         ///< by flow on the way here [energy]
  double stiffness;          ///< -dF/dd, elastic; that of the first regime at xi_s, where it jumps
  double stiffness_ahead;    ///< the largest one that it can have in the steps to come
  double inv_deq;            ///< after the flow [1/length]
  int regime;                ///< 1 or 2 (eq. 8); with plasticity 2 at its limit
};

/// The law of a pair for all but the time-step loop.
class PairLaw : public Law<AnyPowers> {
 public:
  Row row;
  double
      own_limit;    ///< of pairs that hold by it, whatever their spheres have gone through; else 0

  /// Throws BadInput where a member breaks its rule, or numbers of this law would overflow.
  explicit PairLaw(const Row &row_in = {}, double own_limit_in = 0.0) :
      Law(checked(row_in)), row(row_in), own_limit(own_limit_in)
  {
    check_range();
  }

  /// At r = d/deq; past its cutoff a pair is at r = cut/deq.
  PairState state(double r, const PairVariables &pair) const
  {
    PairState now = pair.flow == Flow::REVERSIBLE ? state_reversible(r)
        : pair.flow == Flow::PLASTIC              ? state_flowing<false>(r, pair)
                                                  : state_flowing<true>(r, pair);
    now.inv_deq *= pair.inv_deq;
    const double per_square = now.inv_deq * now.inv_deq;
    now.stiffness_ahead = std::max(now.stiffness, now.stiffness_ahead) * per_square;
    now.stiffness *= per_square;
    now.force *= now.inv_deq;
    return now;
  }

  /// |K_I(r deq)| with the first regime carried on to any r, which eq. 6 asks for [energy/length^2].
  double first_stiffness(double r, double deq) const
  {
    return std::fabs(first.stiffness(1.0 / r)) / (deq * deq);
  }

 private:
  PairState state_reversible(double r) const
  {
    PairState now{};
    now.inv_deq = 1.0;
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

  // lengths over deq
  template <bool Contact> PairState state_flowing(double r, const PairVariables &pair) const
  {
    const bool past_cutoff = r >= pair.cut * pair.inv_deq;
    const auto at = flow<Contact, true>(r, pair.limit, past_cutoff, 1.0, [r](double elastic) {
      return std::pair(1.0 / elastic, elastic / r);
    });
    PairState now{};
    now.inv_deq = at.inv_deq;
    now.force = at.force;
    now.stored = {at.stored, 0.0};
    now.dissipated = dissipated(at.force_d, log_of_ratio(r, at.elastic));
    now.stiffness = Contact && r > 1.0 ? 0.0 : first.stiffness(1.0 / at.elastic);
    now.stiffness_ahead = row.m1 * row.n1 * row.e1;
    now.regime = std::fabs(at.elastic - 1.0) >= AT_LIMIT * pair.limit ? 2 : 1;
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
