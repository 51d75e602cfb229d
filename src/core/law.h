// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law_constants.h"
#include "core/regime.h"
#include "core/row.h"
#include "core/stored_form.h"

#include <algorithm>
#include <cmath>

namespace EVP {

/// Most offset/deq that a bond keeps, see Law::cap(): there is no limit.
constexpr double BOND_CAP = 1e300;

/// Where flow stays, alpha is above this: the cuts of pairs that only repel are at 1 but for a margin of
/// 0.5e-9, and must not be taken for those of others.
constexpr double LEAST_FLOW_ALPHA = 1.0 + 1e-8;

/// Does a pair that is no bond end where it is at rest, so that it only repels?
inline bool only_repels(double cutsq, double inv_deq)
{
  return cutsq * (inv_deq * inv_deq) < LEAST_FLOW_ALPHA;
}

/// The two-regime Lennard-Jones law of Gado, Charles, Iordanoff, Coupard (CSMA 2017): force, energy and
/// stiffness of one pair type. A value type, built once per row.
///
/// Notation: d distance of the centres [length], deq the pair's equilibrium distance, r = d/deq,
/// force F > 0 repels [energy/length], xi = |r - 1| (eq. 8).
class Law {
 public:
  /// Of a pair of types without a row: no force.
  Law() : Law(Row{0.0, 2.0, 1.0, 0.0, 2.0, 1.0, 0.5, 0.0, 1.5}) {}

  /// Throws BadInput where a member breaks its rule, or numbers of this law would overflow.
  explicit Law(const Row &row_in) :
      row(row_in), first(row_in.e1, row_in.m1, row_in.n1), second(row_in.e2, row_in.m2, row_in.n2)
  {
    for (const Member &member : MEMBERS) member.check(row, &member);
    stretched = threshold(row.xi_s);
    compressed = threshold(-row.xi_s);
    loop = {row.xi_s,          row.gamma,          first.constants(), second.constants(),
            stretched.carried, compressed.carried, repelled_offset()};
    lowest = stiffer_offset();
    check_range();
  }

  const Row &parameters() const { return row; }
  const LawConstants &constants() const { return loop; }

  /// 1 or 2: the regime of a pair at d (eq. 8), or, with p = q/deq before, whether it is in the first and has
  /// never flowed. [d], [deq]: length.
  int regime(double d, double deq, double p = 0.0) const
  {
    return p == 0.0 && loop.point(d / deq).is_first ? 1 : 2;
  }

  /// Force at distance d [energy/length], positive when repulsive; zero at d = deq (eqs. 1, 8).
  double force(double d, double deq) const
  {
    const double r = d / deq, xi = r - 1.0;
    if (std::fabs(xi) <= row.xi_s) return first.force(1.0 / r) / deq;
    const Threshold &t = beyond(xi);
    return (second.force(1.0 / (r - t.offset)) + t.carried.force) / deq;
  }

  /// Energy at d minus energy at dcut [energy]: zero at the pair's own cut (eqs. 2, 8 integrated).
  double energy(double d, double deq, double dcut) const
  {
    return reduced_energy(d / deq) - reduced_energy(dcut / deq);
  }

  /// energy(d, deq, deq) in two parts, accurate to 1e-11 of each at any strain: d - deq is exact, and 1
  /// and the slope are taken out of each power before the powers are subtracted.
  Stored stored(double d, double deq) const
  {
    const double opened = d - deq;
    const double xi = opened / deq;
    if (std::fabs(xi) <= row.xi_s) return {first.stored(xi), 0.0};
    const Threshold &t = beyond(xi);
    const double rest = std::fma(-t.offset, deq, opened) / deq;
    return {t.stored, second.stored(rest) + t.stored_slope * rest};
  }

  /// The same of a pair with the offset p = q/deq after its return map: with e = d - q,
  /// Phi_I(e) - Phi_I(deq), and as hardening Phi_II(deq + q) - Phi_II(deq) - F_II(deq + q) (e - deq).
  Stored stored(double d, double deq, double p) const
  {
    const double elastic = (d - deq) / deq - p;
    return {first.stored(elastic), 0.0, second.stored(p) + second.stored_slope(p) * elastic};
  }

  /// Dissipated as the offset flows from p0 to p1 [energy], on the side ds = (1 + s xi_s) deq with s the
  /// sign of p1 - p0: -F_I(ds) (q1 - q0) + [F_II(deq + q1) - F_II(deq + q0)] (ds - deq). Negative
  /// below lowest_offset(), where the second regime is so much the stiffer that a flow sets energy free.
  double dissipated(double p0, double p1) const
  {
    const Threshold &t = beyond(p1 - p0);
    return t.stored_slope * (p1 - p0) - second.slope_change(p0, p1) * t.offset;
  }

  StoredForm stored_form() const
  {
    return {row.xi_s,
            row.gamma,
            row.e1,
            row.e2,
            second.a,
            {stretched.stored, stretched.stored_slope},
            {compressed.stored, compressed.stored_slope}};
  }

  /// N of the stored_form(), 0 where the law has none.
  int stored_power() const { return first.square == second.square ? first.square : 0; }

  /// -dF/dd [energy/length^2], positive at rest; jumps at xi_s, where the first regime's is given.
  double stiffness(double d, double deq) const
  {
    const double r = d / deq, xi = r - 1.0;
    if (std::fabs(xi) <= row.xi_s) return first.stiffness(1.0 / r) / (deq * deq);
    return second.stiffness(1.0 / (r - beyond(xi).offset)) / (deq * deq);
  }

  /// The largest stiffness that a pair at d can have in the steps to come [energy/length^2]: that at
  /// d, and those where either regime begins, m1 n1 e1/deq^2 at rest and m2 n2 e2/deq^2 at xi_s.
  double stiffness_ahead(double d, double deq) const
  {
    return std::max(stiffness(d, deq), stiffness_at_begin() / (deq * deq));
  }

  // With flow that stays: q = p deq is the offset of a pair, e = d - q its elastic part, within
  // (1 +- xi_s) deq; F = F_I(e) + F_II(deq + q)

  /// Throws BadInput where flow of this law would create energy from the start, or contacts that only
  /// repel would look like others. literal: new pairs act up to dlim, where the energy of one that has flowed
  /// is that of eq. 8 beyond xi_s only.
  void check_flow(bool literal) const
  {
    const double least = std::min(compressed.carried.force, -stretched.carried.force);
    if (row.e2 > 0.0 && !(row.xi_s * row.m2 * row.n2 * row.e2 < least))
      throw BadInput("unload elastic needs a second regime less stiff than the first, got m2 n2 e2 "
                     "= " +
                     rounded(row.m2 * row.n2 * row.e2) + " against m1 n1 e1 = " +
                     rounded(row.m1 * row.n1 * row.e1) + ": flow would create energy");
    if (!(row.alpha > LEAST_FLOW_ALPHA))
      throw BadInput("unload elastic needs an alpha above 1 + 1e-8, got 1 + " +
                     rounded(row.alpha - 1.0) + ": bonds and contacts would end at rest");
    if (literal && !(row.alpha - 1.0 > row.xi_s))
      throw BadInput(
          "unload elastic with contact literal needs an alpha above 1 + xi_s, got alpha = " +
          rounded(row.alpha) + " with xi_s = " + rounded(row.xi_s) +
          ": new pairs that have flowed would lose energy at dlim; use a larger alpha, or "
          "contact repulsive or none");
  }

  /// Lowest offset/deq to which flow dissipates: below, the second regime is the stiffer.
  double lowest_offset() const { return lowest; }

  /// Offset/deq at d of a pair that had p before.
  double flowed(double d, double deq, double p) const { return loop.flowed(d / deq, p); }

  /// What a pair keeps of flowed(), no more than cap, or than p where that is more.
  double kept(double flowed, double p, double cap) const { return loop.kept(flowed, p, cap); }

  /// A bond keeps all. A new contact flows in compression only: back to 0 at most, or where it only
  /// repels to where its force vanishes.
  double cap(bool is_bond, bool repels_only) const
  {
    return is_bond ? BOND_CAP : (repels_only ? loop.repelled : 0.0);
  }

  /// Where a pair of offset p flows at r = d/deq, and what that dissipates [energy].
  struct Flow {
    double offset, spent;
  };
  Flow flow(double r, double p, double cap) const
  {
    const double next = loop.kept(loop.flowed(r, p), p, cap);
    return {next, dissipated(p, next)};
  }

  /// Force at d of a pair that had p before [energy/length].
  double force(double d, double deq, double p) const
  {
    return flow_force(d, deq, flowed(d, deq, p));
  }

  /// Force at d of a pair that has flowed to p there [energy/length].
  double flow_force(double d, double deq, double p) const
  {
    return (first.force(1.0 / (d / deq - p)) + second.force(1.0 / (1.0 + p))) / deq;
  }

  /// Stored at d by a pair that has flowed to p there, up to a constant [energy].
  double flow_energy(double d, double deq, double p) const
  {
    const double e = d / deq - p, s_flow = 1.0 / (1.0 + p);
    return first.energy(1.0 / e) + second.energy(s_flow) - second.force(s_flow) * (e - 1.0);
  }

  /// Energy of a pair that has p before, at d within its cut, above that at its cut [energy].
  /// incremental: with what flow from p dissipates, which makes it a potential of d.
  double flow_energy(double d, double deq, double p, double dcut, double cap,
                     bool incremental) const
  {
    const double now = flowed(d, deq, p), keeps = kept(now, p, cap);
    double energy = incremental ? dissipated(p, keeps) : 0.0;
    if (cap < 0.0) {
      const double slack = slack_strain(keeps);    // no force and no work beyond
      return energy + flow_energy(std::min(d / deq, slack + keeps), 1.0, keeps) -
          flow_energy(1.0, 1.0, 0.0);
    }
    energy += flow_energy(d, deq, now) + dissipated(keeps, now);
    const double at_cut = flowed(dcut, deq, incremental ? p : now);
    const double keeps_there = kept(at_cut, incremental ? p : keeps, cap);
    return energy - flow_energy(dcut, deq, at_cut) - dissipated(keeps_there, at_cut);
  }

  /// Held above rest at deq without an offset by a pair with the offset p that only repels, where its
  /// force has vanished [energy].
  double locked(double p) const { return stored(p + slack_strain(p), 1.0, p).total(); }

  /// -dF/dd of the flowing law [energy/length^2], see stiffness_ahead().
  double stiffness_ahead(double d, double deq, double p) const
  {
    const double now = flowed(d, deq, p);
    return std::max({first.stiffness(1.0 / (d / deq - now)), second.stiffness(1.0 / (1.0 + now)),
                     stiffness_at_begin()}) /
        (deq * deq);
  }

  /// |K_I(r deq)| with the first regime carried on to any r (what eq. 6 asks for) [energy/length^2].
  double first_stiffness(double r, double deq) const
  {
    return std::fabs(first.stiffness(1.0 / r)) / (deq * deq);
  }

 private:
  /// What the second regime carries over from the first at ds, on one side of deq: F_I(ds) deq, and
  /// what makes E continuous there, Phi_I(ds) - Phi_II(deq) + F_I(ds) ds.
  struct Threshold {
    double offset;    ///< ds/deq - 1: +xi_s or -xi_s
    LawConstants::Carried carried;
    double stored, stored_slope;    ///< E(ds) - E(deq), dE/dd(ds) deq, to the last digits
  };

  Row row;
  Regime first, second;
  Threshold stretched, compressed;
  LawConstants loop;
  double lowest;    // see lowest_offset()

  double stiffness_at_begin() const    // of either regime, the larger, times deq^2
  {
    return std::max(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2);
  }

  const Threshold &beyond(double xi) const { return xi > 0.0 ? stretched : compressed; }

  Threshold threshold(double offset) const
  {
    const double r = 1.0 + offset, s = 1.0 / r, f = first.force(s);
    return {offset,
            {f, first.energy(s) + second.e + f * r},
            first.stored(offset),
            first.stored_slope(offset)};
  }

  /// Where `above` turns from true to false between low and high; low if it is false everywhere.
  template <class F> static double bisect(double low, double high, F &&above)
  {
    for (int k = 0; k < 60; k++) {
      const double middle = 0.5 * (low + high);
      (above(middle) ? low : high) = middle;
    }
    return low;
  }

  /// Offset at which a pair that only repels and flows back has no force left.
  double repelled_offset() const
  {
    if (row.e2 == 0.0) return -1.0;    // of pairs of types without a row too, which may be many
    return bisect(-1.0, 0.0, [this](double p) {
      return second.force(1.0 / (1.0 + p)) > -stretched.carried.force;
    });
  }

  double stiffer_offset() const
  {
    if (row.e2 == 0.0) return -1.0;
    return bisect(-1.0, 0.0, [this](double p) {
      return row.xi_s * second.stiffness(1.0 / (1.0 + p)) > compressed.carried.force;
    });
  }

  /// e/deq from 1 on at which the force of a pair with offset p vanishes; 1 + xi_s where it does not.
  double slack_strain(double p) const
  {
    const double pushes = second.force(1.0 / (1.0 + p));
    return bisect(1.0, 1.0 + row.xi_s, [&](double e) {
      return first.force(1.0 / e) + pushes > 0.0;
    });
  }

  double reduced_energy(double r) const
  {
    const double xi = r - 1.0;
    if (std::fabs(xi) <= row.xi_s) return first.energy(1.0 / r);
    const Threshold &t = beyond(xi);
    return second.energy(1.0 / (r - t.offset)) + t.carried.energy - t.carried.force * r;
  }

  /// Leaves room for distances far from deq and for products of forces.
  void check_range() const
  {
    constexpr double LARGEST = 1e200;
    for (const double value : {force(1.0 + row.xi_s, 1.0), force(1.0 - row.xi_s, 1.0),
                               force(0.5, 1.0), stiffness(0.5, 1.0), stiffness_ahead(1.0, 1.0),
                               energy(1.0, 1.0, row.alpha), energy(0.5, 1.0, row.alpha), row.gamma})
      if (!(std::fabs(value) <= LARGEST))
        throw BadInput(
            "these parameters overflow double precision: check e1, e2, gamma and the exponents");
  }
};

}    // namespace EVP
