// SPDX-License-Identifier: GPL-2.0-only
//
// The two-regime Lennard-Jones law of Gado, Charles, Iordanoff, Coupard (CSMA 2017).
// Pure C++17: no LAMMPS, no state beyond one row of the paper's tables.
//
// Notation: d distance of the centres [length], deq the pair's equilibrium distance,
// r = d/deq, force F > 0 repels [energy/length], xi = |r - 1| (eq. 8).

#ifndef EVP_CORE_LAW_H
#define EVP_CORE_LAW_H

#include <algorithm>
#include <cmath>

namespace EVP {

/// One row of the paper's Tables 1 and 2.
struct Row {
  double e1, m1, n1;    ///< first regime: potential depth [energy], exponents m1 > n1 > 0
  double e2, m2, n2;    ///< second regime
  double xi_s;          ///< strain of a pair where the regimes meet, 0 < xi_s < 1
  double gamma;         ///< damping of eq. 4 [force/velocity]
  double alpha;         ///< dlim = alpha (R_i + R_j), alpha > 1
};

inline bool operator==(const Row &a, const Row &b)
{
  return a.e1 == b.e1 && a.m1 == b.m1 && a.n1 == b.n1 && a.e2 == b.e2 && a.m2 == b.m2 &&
      a.n2 == b.n2 && a.xi_s == b.xi_s && a.gamma == b.gamma && a.alpha == b.alpha;
}

/// s^m and s^n, from which force, energy and stiffness are all made.
struct PowerPair {
  double sm, sn;
};

/// s^k by repeated squaring; exact order of operations independent of the compiler.
constexpr double integer_power(double s, int k)
{
  double result = 1.0;
  for (; k > 0; k >>= 1, s *= s)
    if (k & 1) result *= s;
  return result;
}

/// (1 + x)^k - 1 for x > -1, to the last digits where x is near 0.
constexpr double integer_power_minus_1(double x, int k)
{
  double result = 0.0;
  for (; k > 0; k >>= 1, x *= 2.0 + x)
    if (k & 1) result += x * (1.0 + result);
  return result;
}

/// Exponents known to the compiler: straight multiplications, no loop, no branch.
template <int M, int N> struct FixedPowers {
  PowerPair operator()(double s) const { return {power<M>(s), power<N>(s)}; }

 private:
  template <int K> static double power(double s)
  {
    if constexpr (K == 1)
      return s;
    else if constexpr (K % 2 == 0) {
      const double half = power<K / 2>(s);
      return half * half;
    } else
      return s * power<K - 1>(s);
  }
};

/// Any real m > n > 0; integers are multiplied out, pow() serves the others.
class AnyPowers {
 public:
  AnyPowers(double m_in, double n_in) : m(m_in), n(n_in), im(as_integer(m_in)), in(as_integer(n_in))
  {
  }
  PowerPair operator()(double s) const { return {power(s, m, im), power(s, n, in)}; }

 private:
  double m, n;
  int im, in;    // the exponents where they are whole numbers, else 0

  static int as_integer(double p) { return (p <= 1024.0 && p == std::floor(p)) ? (int) p : 0; }
  static double power(double s, double p, int k)
  {
    return k ? integer_power(s, k) : std::pow(s, p);
  }
};

/// Calls f with the powers of (m, n) that the compiler knows; false if it knows none.
template <class F> bool with_fixed_powers(double m, double n, F &&f)
{
  if (m == 8.0 && n == 4.0)
    f(FixedPowers<8, 4>{});
  else if (m == 6.0 && n == 3.0)
    f(FixedPowers<6, 3>{});
  else if (m == 4.0 && n == 2.0)
    f(FixedPowers<4, 2>{});
  else if (m == 2.0 && n == 1.0)
    f(FixedPowers<2, 1>{});
  else if (m == 12.0 && n == 6.0)
    f(FixedPowers<12, 6>{});
  else
    return false;
  return true;
}

/// Calls f with the fastest powers for (m, n): one place decides, every caller is written once.
template <class F> auto with_powers(double m, double n, F &&f)
{
  if (m == 8.0 && n == 4.0) return f(FixedPowers<8, 4>{});
  if (m == 6.0 && n == 3.0) return f(FixedPowers<6, 3>{});
  if (m == 4.0 && n == 2.0) return f(FixedPowers<4, 2>{});
  if (m == 2.0 && n == 1.0) return f(FixedPowers<2, 1>{});
  if (m == 12.0 && n == 6.0) return f(FixedPowers<12, 6>{});
  return f(AnyPowers(m, n));
}

/// e^x - 1 - x [1] to the last digits, where the difference would leave none of them near 0.
inline double expm1_minus_x(double x)
{
  if (std::fabs(x) >= 0.25) return std::expm1(x) - x;
  // the series in two sums, which a processor adds up side by side
  constexpr double EVEN[] = {1.0 / 479001600.0, 1.0 / 3628800.0, 1.0 / 40320.0,
                             1.0 / 720.0,       1.0 / 24.0,      1.0 / 2.0};
  constexpr double ODD[] = {1.0 / 6227020800.0, 1.0 / 39916800.0, 1.0 / 362880.0,
                            1.0 / 5040.0,       1.0 / 120.0,      1.0 / 6.0};
  const double xx = x * x;
  double even = 0.0, odd = 0.0;
  for (int k = 0; k < 6; k++) {
    even = even * xx + EVEN[k];
    odd = odd * xx + ODD[k];
  }
  return xx * (even + x * odd);
}

/// Force, energy and stiffness of one pair type. A value type, built once per row.
class Law {
 public:
  Law() : Law(Row{0.0, 2.0, 1.0, 0.0, 2.0, 1.0, 0.5, 0.0, 1.5}) {}

  /// Requires a row that params.h has checked.
  explicit Law(const Row &row_in) :
      row(row_in), first(row_in.e1, row_in.m1, row_in.n1), second(row_in.e2, row_in.m2, row_in.n2)
  {
    stretched = threshold(row.xi_s);
    compressed = threshold(-row.xi_s);
  }

  const Row &parameters() const { return row; }

  /// What a loop over pairs keeps at hand: with s = 1/(r - offset) and offset 0 in the first
  /// regime, +xi_s or -xi_s in the second (all but xi_s and gamma are energies),
  /// F deq = a s (s^m - s^n) + force, E = em s^m - en s^n + energy - force r.
  struct Constants {
    struct OfRegime {
      double a, em, en;
    };
    struct Carried {
      double force, energy;    ///< added in the second regime only
    };
    double xi_s, gamma;
    OfRegime first, second;
    Carried stretched, compressed;
  };

  Constants constants() const
  {
    return {row.xi_s,
            row.gamma,
            first.constants(),
            second.constants(),
            {stretched.force, stretched.energy},
            {compressed.force, compressed.energy}};
  }

  /// 1 or 2: the regime of a pair at d (eq. 8). [d], [deq]: length.
  int regime(double d, double deq) const { return std::fabs(d / deq - 1.0) <= row.xi_s ? 1 : 2; }

  /// Force at distance d [energy/length], positive when repulsive; zero at d = deq (eqs. 1, 8).
  double force(double d, double deq) const
  {
    const double r = d / deq;
    if (std::fabs(r - 1.0) <= row.xi_s)
      return with_powers(row.m1, row.n1,
                         [&](auto p) {
                           return reduced_force(r, p, p);
                         }) /
          deq;
    return with_powers(row.m2, row.n2,
                       [&](auto p) {
                         return reduced_force(r, p, p);
                       }) /
        deq;
  }

  /// Force times deq [energy] at r = d/deq, for loops that chose their powers beforehand;
  /// both regimes take one division, and the regime is a select (model: s = 1/(r - o)).
  /// Only the powers of the regime in force are used: p1 below xi_s, p2 beyond.
  template <class P1, class P2> double reduced_force(double r, const P1 &p1, const P2 &p2) const
  {
    const double xi = r - 1.0;
    if (std::fabs(xi) <= row.xi_s) {
      const double s = 1.0 / r;
      const PowerPair q = p1(s);
      return first.a * s * (q.sm - q.sn);
    }
    const Threshold &t = xi > 0.0 ? stretched : compressed;
    const double s = 1.0 / (r - t.offset);
    const PowerPair q = p2(s);
    return second.a * s * (q.sm - q.sn) + t.force;
  }

  /// Energy at d minus energy at dcut [energy]: zero at the pair's own cut (eqs. 2, 8 integrated).
  double energy(double d, double deq, double dcut) const
  {
    return reduced_energy(d / deq) - reduced_energy(dcut / deq);
  }

  /// What a pair holds above its energy at deq [energy], up to xi_s and beyond it.
  struct Stored {
    double first, second;
    double total() const { return first + second; }
  };

  /// energy(d, deq, deq) in two parts, right to 1e-11 of each at any strain: d is subtracted from deq
  /// without rounding, and each power from 1 and its slope before they meet.
  Stored stored(double d, double deq) const
  {
    const double opened = d - deq;
    const double xi = opened / deq;
    if (std::fabs(xi) <= row.xi_s) return {first.stored(xi), 0.0};
    const Threshold &t = xi > 0.0 ? stretched : compressed;
    const double beyond = std::fma(-t.offset, deq, opened) / deq;
    return {t.stored, second.stored(beyond) + t.stored_slope * beyond};
  }

  /// -dF/dd [energy/length^2], positive at rest; jumps at xi_s, where the first regime's is given.
  double stiffness(double d, double deq) const
  {
    const double r = d / deq;
    const double xi = r - 1.0;
    if (std::fabs(xi) <= row.xi_s) return first.stiffness(1.0 / r) / (deq * deq);
    const Threshold &t = xi > 0.0 ? stretched : compressed;
    return second.stiffness(1.0 / (r - t.offset)) / (deq * deq);
  }

  /// m1 n1 e1 / deq^2 [energy/length^2]: the stiffness at d = deq.
  double stiffness_at_rest(double deq) const { return row.m1 * row.n1 * row.e1 / (deq * deq); }

  /// The largest stiffness that a pair at d can have in the steps to come [energy/length^2]: that at
  /// d, and those where either regime begins, m1 n1 e1/deq^2 at rest and m2 n2 e2/deq^2 at xi_s.
  double stiffness_ahead(double d, double deq) const
  {
    const double begin = std::max(row.m1 * row.n1 * row.e1, row.m2 * row.n2 * row.e2);
    return std::max(stiffness(d, deq), begin / (deq * deq));
  }

  /// |K_I(r deq)| with the first regime carried on to any r (what eq. 6 asks for) [energy/length^2].
  double first_stiffness(double r, double deq) const
  {
    return std::fabs(first.stiffness(1.0 / r)) / (deq * deq);
  }

 private:
  /// One regime: F deq = a s (s^m - s^n), Phi = e (n s^m - m s^n)/(m - n) at s = deq/d.
  struct Regime {
    double e, m, n, a;
    int square;    // n where Phi + e is the square below, else 0
    Regime(double e_in, double m_in, double n_in) :
        e(e_in), m(m_in), n(n_in), a(m_in * n_in * e_in / (m_in - n_in)),
        square(m_in == 2.0 * n_in && n_in <= 8.0 && n_in == std::floor(n_in) ? (int) n_in : 0)
    {
    }
    Constants::OfRegime constants() const { return {a, e * n / (m - n), e * m / (m - n)}; }
    template <class F> auto with(F &&f) const { return with_powers(m, n, f); }
    PowerPair powers(double s) const
    {
      return with([s](auto p) {
        return p(s);
      });
    }
    double reduced_force(double s) const
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
    double stiffness(double s) const
    {
      const PowerPair q = powers(s);
      return a * s * s * ((m + 1.0) * q.sm - (n + 1.0) * q.sn);
    }
  };

  /// What the second regime carries over from the first at ds, on one side of deq.
  struct Threshold {
    double offset;    ///< ds/deq - 1: +xi_s or -xi_s
    double force;     ///< F_I(ds) deq
    double energy;    ///< makes E continuous at ds: Phi_I(ds) - Phi_II(deq) + F_I(ds) ds
    double stored, stored_slope;    ///< E(ds) - E(deq), dE/dd(ds) deq, to the last digits
  };

  Row row;
  Regime first, second;
  Threshold stretched, compressed;

  Threshold threshold(double offset) const
  {
    const double r = 1.0 + offset;
    const double f = first.reduced_force(1.0 / r);
    return {offset, f, first.energy(1.0 / r) + second.e + f * r, first.stored(offset),
            first.stored_slope(offset)};
  }

  double reduced_energy(double r) const
  {
    const double xi = r - 1.0;
    if (std::fabs(xi) <= row.xi_s) return first.energy(1.0 / r);
    const Threshold &t = xi > 0.0 ? stretched : compressed;
    return second.energy(1.0 / (r - t.offset)) + t.energy - t.force * r;
  }
};

}    // namespace EVP

#endif
