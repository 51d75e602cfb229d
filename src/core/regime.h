// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law_constants.h"
#include "core/powers.h"

#include <cmath>

namespace EVP {

/// One regime: F deq = a s (s^m - s^n), Phi = e (n s^m - m s^n)/(m - n) at s = deq/d.
struct Regime {
  double e, m, n, a;
  int square;    // n where Phi + e is the square below, else 0
  Regime(double e_in, double m_in, double n_in) :
      e(e_in), m(m_in), n(n_in), a(m_in * n_in * e_in / (m_in - n_in)),
      square(m_in == 2.0 * n_in && n_in <= 8.0 && n_in == std::floor(n_in) ? (int) n_in : 0)
  {
  }
  LawConstants::OfRegime constants() const { return {a, e * n / (m - n), e * m / (m - n)}; }
  PowerPair powers(double s) const
  {
    return with_powers(m, n, [s](auto p) {
      return p(s);
    });
  }
  double force(double s) const    // times deq
  {
    const PowerPair q = powers(s);
    return a * s * (q.sm - q.sn);
  }
  double energy(double s) const
  {
    const PowerPair q = powers(s);
    return e * (n * q.sm - m * q.sn) / (m - n);
  }
  double stored(double strain) const    // energy above that at deq, d = (1 + strain) deq
  {
    // e (1 - s^n)^2, without a transcendental function
    if (square && std::fabs(strain) <= 0.25) {
      const double p = integer_power_minus_1(strain, square), q = p / (1.0 + p);
      return e * q * q;
    }
    const double log_s = -std::log1p(strain);
    return e * (n * expm1_minus_x(m * log_s) - m * expm1_minus_x(n * log_s)) / (m - n);
  }
  double stored_slope(double strain) const
  {
    const double log_s = -std::log1p(strain);
    return -a * std::exp((n + 1.0) * log_s) * std::expm1((m - n) * log_s);
  }
  double slope_change(double p0, double p1) const    // stored_slope(p1) - stored_slope(p0)
  {
    const double log_s = -std::log1p(p0), turn = -std::log1p((p1 - p0) / (1.0 + p0));
    return -a *
        (std::exp((m + 1.0) * log_s) * std::expm1((m + 1.0) * turn) -
         std::exp((n + 1.0) * log_s) * std::expm1((n + 1.0) * turn));
  }
  double stiffness(double s) const
  {
    const PowerPair q = powers(s);
    return a * s * s * ((m + 1.0) * q.sm - (n + 1.0) * q.sn);
  }
};

}    // namespace EVP
