// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/powers.h"
#include "core/simd.h"

#include <algorithm>
#include <cmath>

namespace EVP {

/// What a pair holds above its energy at deq [energy], up to xi_s and beyond it, or by hardening.
struct Stored {
  double first, second;
  double hardening = 0.0;
  double total() const { return first + second + hardening; }
};

/// Law::stored() and dissipated() for a loop over blocks of pairs, of a law whose exponents are (2 N, N) in
/// both regimes. Then a regime stores e (1 - s^N)^2, with the slope a s^(N+1) (1 - s^N), s = deq/d: no
/// difference of large numbers is left, and no transcendental function.
struct StoredForm {
  struct Side {
    double stored, slope;    ///< E(ds) - E(deq), dE/dd(ds) deq
  };
  double xi_s, gamma, e1, e2, a2;
  Side stretched, compressed;

  /// 1 - s^N at s = 1/(1 + strain).
  template <int N> EVP_INLINE static double opened(double strain, double s)
  {
    return power_minus_1<N>(strain) * FixedPowers<2 * N, N>::template power<N>(s);
  }

  /// Where on the law a pair is at the strain xi. 0 or 1 where others have a condition: of those, selects
  /// between results, compilers make branches here.
  struct Point {
    double is_second, is_stretched;
    double strain;    ///< in its regime
  };
  EVP_INLINE Point point(double xi) const
  {
    const double rest = xi - std::min(std::max(xi, -xi_s), xi_s);
    const double is_second = rest != 0.0 ? 1.0 : 0.0;
    return {is_second, xi > 0.0 ? 1.0 : 0.0, rest + (1.0 - is_second) * xi};
  }

  /// Law::stored(d, deq) there. s: 1/(1 + strain).
  template <int N> EVP_INLINE Stored stored(const Point &at, double s) const
  {
    const double second = at.is_second, first = 1.0 - second;
    const double in_tension = at.is_stretched, pressed = 1.0 - in_tension;
    const double q = opened<N>(at.strain, s);
    const double energy = (first * e1 + second * e2) * q * q;
    const double carried = in_tension * stretched.stored + pressed * compressed.stored;
    const double slope = in_tension * stretched.slope + pressed * compressed.slope;
    return {first * energy + second * carried, second * (energy + slope * at.strain)};
  }
  template <int N> EVP_INLINE Stored stored(double xi) const
  {
    const Point at = point(xi);
    return stored<N>(at, 1.0 / (1.0 + at.strain));
  }

  /// Law::stored(d, deq, p), and what a new pair holds there: it flows in compression only, and stretched it
  /// has followed eq. 8 from an offset of 0.
  struct AfterFlow {
    double first, hardening, contact;
  };
  /// elastic: xi - p.
  template <int N> EVP_INLINE AfterFlow stored_after_flow(double elastic, double p) const
  {
    const double both = 1.0 / ((1.0 + elastic) * (1.0 + p));
    const double q1 = opened<N>(elastic, both * (1.0 + p));
    const double s = both * (1.0 + elastic), q2 = opened<N>(p, s);
    const double slope = a2 * s * FixedPowers<2 * N, N>::template power<N>(s) * q2;
    const double in_first = e1 * q1 * q1, in_second = e2 * q2 * q2;
    const double hardening = in_second + slope * elastic;
    const double is_stretched = p > 0.0 ? 1.0 : 0.0;
    const double reversible = in_second + stretched.slope * p;
    return {in_first, hardening,
            in_first + is_stretched * reversible + (1.0 - is_stretched) * hardening};
  }

  /// Law::dissipated(p0, p1), 0 where that is negative.
  template <int N> EVP_INLINE double dissipated(double p0, double p1) const
  {
    const double both = 1.0 / ((1.0 + p0) * (1.0 + p1)), flow = p1 - p0;
    const double s0 = both * (1.0 + p1), s1 = both * (1.0 + p0);
    const double stiffness =
        a2 * both * (power_quotient<2 * N + 1>(s0, s1) - power_quotient<N + 1>(s0, s1));
    const double slope = flow > 0.0 ? stretched.slope : compressed.slope;
    const double back = stiffness * std::copysign(xi_s, flow);
    return std::max(0.0, flow * (slope - back));
  }
};

}    // namespace EVP
