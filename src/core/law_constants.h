// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/powers.h"
#include "core/simd.h"

#include <cmath>

namespace EVP {

/// The law for a loop over blocks of pairs, which has selects where those of Law have
/// branches: on the base instruction set a select of doubles is a branch too, one that is often
/// mispredicted, and pairs one by one take 1.3 times their time with it.
///
/// With s = 1/(r - offset) and offset 0 in the first regime, +xi_s or -xi_s in the second,
/// F deq = a s (s^m - s^n) + force, E = em s^m - en s^n + energy - force r. All but xi_s and gamma
/// are energies.
struct LawConstants {
  struct OfRegime {
    double a, em, en;
  };
  struct Carried {
    double force, energy;    ///< added in the second regime only
  };
  double xi_s, gamma;
  OfRegime first, second;
  Carried stretched, compressed;
  double repelled;    ///< see Law::kept()

  /// Where on the law a pair is.
  struct Point {
    bool is_first, is_stretched;
    double r, shifted;    ///< d/deq; 1/s
  };
  EVP_INLINE Point point(double r) const
  {
    const double xi = r - 1.0;
    const bool is_first = std::fabs(xi) <= xi_s;
    return {is_first, xi > 0.0, r, r - (is_first ? 0.0 : std::copysign(xi_s, xi))};
  }

  /// F deq [energy], from s and its powers there.
  EVP_INLINE double force(const Point &at, double s, PowerPair q) const
  {
    // in this order: the other one costs g++ 12 a tenth of the loop
    const double side = at.is_stretched ? stretched.force : compressed.force;
    const double a = at.is_first ? first.a : second.a;
    const double carried = at.is_first ? 0.0 : side;
    return a * s * (q.sm - q.sn) + carried;
  }

  /// E up to a constant [energy], from the powers of s there.
  EVP_INLINE double energy(const Point &at, PowerPair q) const
  {
    const double em = at.is_first ? first.em : second.em;
    const double en = at.is_first ? first.en : second.en;
    const double constant = at.is_stretched ? stretched.energy : compressed.energy;
    const double slope = at.is_stretched ? stretched.force : compressed.force;
    return em * q.sm - en * q.sn + (at.is_first ? 0.0 : constant - slope * at.r);
  }

  // with flow that stays (model of `unload elastic`): p = q/deq is the offset of a pair, e = r - p
  // its elastic part

  /// The return map: the offset that a pair with p has at r.
  EVP_INLINE double flowed(double r, double p) const
  {
    const double low = r - (1.0 + xi_s), high = r - (1.0 - xi_s);
    return p < low ? low : (p > high ? high : p);
  }

  /// What is kept of it, see Law::kept().
  EVP_INLINE double kept(double flowed, double p, double cap) const
  {
    const double most = p > cap ? p : cap;
    return flowed < most ? flowed : most;
  }

  /// Both parts of F deq [energy], from s = 1/e and 1/(1 + p) and their powers.
  EVP_INLINE double first_force(double s, PowerPair q) const { return first.a * s * (q.sm - q.sn); }
  EVP_INLINE double flow_force(double s, PowerPair q) const { return second.a * s * (q.sm - q.sn); }

  /// Stored energy up to a constant [energy].
  EVP_INLINE double energy(double e, PowerPair q, double s_flow, PowerPair q_flow) const
  {
    return first.em * q.sm - first.en * q.sn + second.em * q_flow.sm - second.en * q_flow.sn -
        second.a * s_flow * (q_flow.sm - q_flow.sn) * (e - 1.0);
  }

  /// Dissipated from p0 to p1 [energy], f_flow: forces of the second regime at 1 + p there, times deq.
  EVP_INLINE double dissipated(double p0, double f_flow0, double p1, double f_flow1) const
  {
    const bool is_stretched = p1 > p0;
    const double f = is_stretched ? stretched.force : compressed.force;
    return (is_stretched ? xi_s : -xi_s) * (f_flow1 - f_flow0) - f * (p1 - p0);
  }
};

}    // namespace EVP
