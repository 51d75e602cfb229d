// SPDX-License-Identifier: GPL-2.0-only
//
// The loop of force_loop.h and block_law.cpp once more, with its floating-point types left open:
// what less than double would save, and what it would spoil. One law with the exponents 8 and 4, no
// damping, no energy. Must be compiled as block_law.cpp is: see levels.h.

#ifndef EVP_TEST_PRECISION_H
#define EVP_TEST_PRECISION_H

#include "core/force_loop.h"

#include <array>
#include <type_traits>
#include <vector>

namespace precision {

using Vectors = std::vector<std::array<double, 3>>;

/// Types of: positions in memory; relative positions and what the list holds of a pair; the law;
/// the sums of forces. Where pairs are kept finer than the law is, r^2 - 1 is still formed finely.
template <class PositionType, class PairType, class LawType, class SumType> struct Types {
  using Position = PositionType;
  using Pair = PairType;
  using Real = LawType;
  using Sum = SumType;
  static constexpr bool strain_first = !std::is_same_v<Pair, Real>;
};
using Double = Types<double, double, double, double>;
using StrainFirst = Types<double, double, float, double>;
using Mixed = Types<double, float, float, double>;
using FloatPositions = Types<float, float, float, double>;
using Single = Types<float, float, float, float>;

template <class T> struct Block {
  static constexpr int SIZE = EVP::Block::SIZE;
  using Pair = typename T::Pair;

  int n;
  const Pair *inv_deq, *cutsq;
  alignas(64) Pair xy[2 * SIZE];
  alignas(64) Pair z[SIZE];
  alignas(64) Pair force[SIZE];
};

/// Law::Constants in another type.
template <class Real> struct Constants {
  Real xi_s, first, second, stretched, compressed;
  explicit Constants(const EVP::Law::Constants &c) :
      xi_s((Real) c.xi_s), first((Real) c.first.a), second((Real) c.second.a),
      stretched((Real) c.stretched.force), compressed((Real) c.compressed.force)
  {
  }
};

/// As in block_law.cpp, operation by operation.
template <class T>
EVP_INLINE void evaluate_plain(const Constants<typename T::Real> &constants, Block<T> &block)
{
  using Real = typename T::Real;
  const Constants<Real> c = constants;
  const Real *const inv_deq = block.inv_deq;
  const Real *const cutsq = block.cutsq;
  const int n = block.n;
  EVP_INDEPENDENT
  for (int k = 0; k < n; k++) {
    const Real x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
    const Real dsq = x * x + y * y + z * z;
    const Real d = std::sqrt(dsq);
    const Real r = d * inv_deq[k];
    const Real xi = r - Real(1);
    const bool is_first = std::fabs(xi) <= c.xi_s;
    const Real offset = is_first ? Real(0) : std::copysign(c.xi_s, xi);
    const Real shifted = r - offset;
    const Real w = Real(1) / (shifted * d);
    const Real s = w * d;
    const Real inv_d = w * shifted;
    const Real s2 = s * s, s4 = s2 * s2, s8 = s4 * s4;
    const Real side = xi > Real(0) ? c.stretched : c.compressed;
    const Real a = is_first ? c.first : c.second;
    const Real carried = is_first ? Real(0) : side;
    const Real f = (a * s * (s8 - s4) + carried) * (inv_deq[k] * inv_d);
    block.force[k] = dsq > cutsq[k] ? Real(0) : f;
  }
}

/// r^2 - 1 in double and all that follows in float, written so that nothing cancels any more:
/// xi = (r^2 - 1)/(1 + r), and s^8 - s^4 = s^4 (s - 1)(s + 1)(s^2 + 1).
template <class T>
EVP_INLINE void evaluate_strain_first(const Constants<typename T::Real> &constants, Block<T> &block)
{
  using Real = typename T::Real;
  using Pair = typename T::Pair;
  const Constants<Real> c = constants;
  const Pair *const inv_deq = block.inv_deq;
  const Pair *const cutsq = block.cutsq;
  const int n = block.n;
  EVP_INDEPENDENT
  for (int k = 0; k < n; k++) {
    const Pair x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
    const Pair dsq = x * x + y * y + z * z;
    const Pair inv_sq = inv_deq[k] * inv_deq[k];
    const Real excess = (Real) (dsq * inv_sq - Pair(1));
    const Real r = std::sqrt(Real(1) + excess);
    const Real xi = excess / (Real(1) + r);
    const bool is_first = std::fabs(xi) <= c.xi_s;
    const Real offset = is_first ? Real(0) : std::copysign(c.xi_s, xi);
    const Real shifted = r - offset;
    const Real w = Real(1) / (shifted * r);
    const Real s = w * r;
    const Real s2 = s * s, s4 = s2 * s2;
    const Real difference = s4 * ((offset - xi) * s) * (s + Real(1)) * (s2 + Real(1));
    const Real side = xi > Real(0) ? c.stretched : c.compressed;
    const Real a = is_first ? c.first : c.second;
    const Real carried = is_first ? Real(0) : side;
    const Real f = (a * s * difference + carried) * (w * shifted);
    block.force[k] = dsq > cutsq[k] ? Pair(0) : (Pair) f * inv_sq;
  }
}

template <class T>
EVP_INLINE void evaluate(const Constants<typename T::Real> &constants, Block<T> &block)
{
  if constexpr (T::strain_first)
    evaluate_strain_first<T>(constants, block);
  else
    evaluate_plain<T>(constants, block);
}

template <class T> void evaluate_base(const Constants<typename T::Real> &c, Block<T> &block)
{
  evaluate<T>(c, block);
}
#if EVP_HAS_LEVELS
template <class T>
EVP_AVX2 void evaluate_avx2(const Constants<typename T::Real> &c, Block<T> &block)
{
  evaluate<T>(c, block);
}
template <class T>
EVP_AVX512 void evaluate_avx512(const Constants<typename T::Real> &c, Block<T> &block)
{
  evaluate<T>(c, block);
}
#endif

template <class T> using Function = void (*)(const Constants<typename T::Real> &, Block<T> &);

template <class T> Function<T> function_for(EVP::Level level)
{
#if EVP_HAS_LEVELS
  if (level == EVP::Level::AVX512) return evaluate_avx512<T>;
  if (level == EVP::Level::AVX2) return evaluate_avx2<T>;
#endif
  (void) level;
  return evaluate_base<T>;
}

/// As ParticleView.
template <class T> struct View {
  const typename T::Position (*x)[3];
  typename T::Sum (*f)[3];
  int nreact;
};

template <class T>
void gather(const EVP::PairList &list, const View<T> &view, const EVP::PairRange &range,
            Block<T> &block)
{
  using Pair = typename T::Pair;
  using Position = typename T::Position;
  const int *const partner = list.pairs.j();
  const auto *const x = view.x;
  range.for_each_row([&](int i, int first, int last) {
    const Position xi = x[i][0], yi = x[i][1], zi = x[i][2];
    EVP_UNROLL
    for (int k = first; k < last; k++) {
      const int j = partner[k], b = k - range.first;
      const Position dx = xi - x[j][0], dy = yi - x[j][1], dz = zi - x[j][2];
      block.xy[2 * b] = (Pair) dx;
      block.xy[2 * b + 1] = (Pair) dy;
      block.z[b] = (Pair) dz;
    }
  });
}

template <class T>
void scatter(const EVP::PairList &list, const View<T> &view, const EVP::PairRange &range,
             const Block<T> &block)
{
  using Sum = typename T::Sum;
  const int *const partner = list.pairs.j();
  auto *const f = view.f;
  const int nreact = view.nreact;
  range.for_each_row([&](int i, int first, int last) {
    Sum fx = 0, fy = 0, fz = 0;
    EVP_UNROLL
    for (int k = first; k < last; k++) {
      const int j = partner[k], b = k - range.first;
      const Sum px = block.xy[2 * b] * block.force[b];
      const Sum py = block.xy[2 * b + 1] * block.force[b];
      const Sum pz = block.z[b] * block.force[b];
      fx += px;
      fy += py;
      fz += pz;
      if (j < nreact) {
        f[j][0] -= px;
        f[j][1] -= py;
        f[j][2] -= pz;
      }
    }
    f[i][0] += fx;
    f[i][1] += fy;
    f[i][2] += fz;
  });
}

/// The loop over a list in the types T, with what it needs in these types.
template <class T> class Loop {
 public:
  using Position = typename T::Position;
  using Pair = typename T::Pair;
  using Sum = typename T::Sum;

  Loop(const EVP::PairList &list_in, const EVP::Law &law, size_t particles) :
      list(list_in), constants(law.constants()), x(particles), f(particles)
  {
    const size_t n = list.pairs.size();
    inv_deq.assign(list.pairs.inv_deq(), list.pairs.inv_deq() + n);
    cutsq.assign(list.pairs.cutsq(), list.pairs.cutsq() + n);
  }

  void use(EVP::Level level) { function = function_for<T>(level); }

  void take_positions(const Vectors &from)
  {
    for (size_t i = 0; i < x.size(); i++)
      for (int c = 0; c < 3; c++) x[i][c] = (Position) from[i][c];
  }

  void clear_forces() { std::fill(f.begin(), f.end(), std::array<Sum, 3>{}); }

  void add_forces_to(Vectors &to) const
  {
    for (size_t i = 0; i < f.size(); i++)
      for (int c = 0; c < 3; c++) to[i][c] += f[i][c];
  }

  /// As accumulate_forces.
  void accumulate()
  {
    const int npairs = (int) list.pairs.size();
    const View<T> view = {reinterpret_cast<const Position(*)[3]>(x.data()),
                          reinterpret_cast<Sum(*)[3]>(f.data()), (int) f.size()};
    Block<T> block;
    EVP::PairRange range = {list.rows.data(), 0, 0};
    for (; range.first < npairs; range.first = range.last) {
      range.last = std::min(range.first + Block<T>::SIZE, npairs);
      while (range.row->last <= range.first) range.row++;
      block.n = range.last - range.first;
      block.inv_deq = inv_deq.data() + range.first;
      block.cutsq = cutsq.data() + range.first;
      gather<T>(list, view, range, block);
      function(constants, block);
      scatter<T>(list, view, range, block);
    }
  }

 private:
  const EVP::PairList &list;
  const Constants<typename T::Real> constants;
  Function<T> function = function_for<T>(EVP::best_level());
  std::vector<std::array<Position, 3>> x;
  std::vector<std::array<Sum, 3>> f;
  std::vector<Pair> inv_deq, cutsq;
};

}    // namespace precision

#endif
