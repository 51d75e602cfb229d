// SPDX-License-Identifier: GPL-2.0-only
//
// The law over a block of pairs, compiled once per instruction set. This file must be compiled with
// -ffp-contract=off: a fused multiply-add on one machine only would give it other numbers.

#include "core/block_law.h"

#include "core/levels.h"

#include <algorithm>
#include <cmath>

namespace EVP {

namespace {

  /// The constants of the laws of a block, pair by pair, or the only ones that there are.
  template <bool Many> class ConstantsOf {
   public:
    EVP_INLINE ConstantsOf(const BlockLaw &law, const Block &block) : only(law.constants[0])
    {
      if constexpr (Many) {
        const Law::Constants *const table = law.constants.data();
        for (int k = 0; k < block.n; k++) own[k] = &table[block.kind[k] >> 1];
      }
    }
    EVP_INLINE const Law::Constants &operator[](int k) const { return Many ? *own[k] : only; }

   private:
    const Law::Constants only;
    const Law::Constants *own[Many ? Block::SIZE : 1];
  };

  /// E(r) up to a constant [energy], from s and its powers.
  EVP_INLINE double energy_at(const Law::Constants &c, bool is_first, bool is_stretched, double r,
                              PowerPair q)
  {
    const double em = is_first ? c.first.em : c.second.em;
    const double en = is_first ? c.first.en : c.second.en;
    const double constant = is_stretched ? c.stretched.energy : c.compressed.energy;
    const double slope = is_stretched ? c.stretched.force : c.compressed.force;
    return em * q.sm - en * q.sn + (is_first ? 0.0 : constant - slope * r);
  }

  /// All pairs of a block whose laws share the powers P.
  template <class P, bool Many, bool Damping, bool Energy>
  EVP_INLINE void evaluate(const BlockLaw &law, Block &block)
  {
    const P powers;
    const ConstantsOf<Many> constants(law, block);
    const double *const inv_deq = block.inv_deq;
    const double *const cutsq = block.cutsq;
    const int *const kind = block.kind;
    const double of_new = block.margin_removed[0], of_bond = block.margin_removed[1];
    const int n = block.n;

    EVP_INDEPENDENT
    for (int k = 0; k < n; k++) {
      const Law::Constants &c = constants[k];
      const double x = block.xy[2 * k], y = block.xy[2 * k + 1], z = block.z[k];
      const double dsq = x * x + y * y + z * z;
      const double d = std::sqrt(dsq);
      const double r = d * inv_deq[k];
      const double xi = r - 1.0;
      const bool is_first = std::fabs(xi) <= c.xi_s;
      const bool is_stretched = xi > 0.0;

      // 1/d and s = 1/(r - offset) from one division
      const double offset = is_first ? 0.0 : std::copysign(c.xi_s, xi);
      const double shifted = r - offset;
      const double w = 1.0 / (shifted * d);
      const double s = w * d;
      const double inv_d = w * shifted;
      const PowerPair q = powers(s);

      const double side = is_stretched ? c.stretched.force : c.compressed.force;
      const double a = is_first ? c.first.a : c.second.a;
      const double carried = is_first ? 0.0 : side;
      double f = (a * s * (q.sm - q.sn) + carried) * (inv_deq[k] * inv_d);
      if constexpr (Damping) f -= c.gamma * block.approach[k] * (inv_d * inv_d);
      block.force[k] = dsq > cutsq[k] ? 0.0 : f;

      if constexpr (Energy) {
        const double rc = std::sqrt(cutsq[k]) * inv_deq[k] * (kind[k] & 1 ? of_bond : of_new);
        const double xic = rc - 1.0;
        const bool cut_is_first = std::fabs(xic) <= c.xi_s;
        const double cut_offset = cut_is_first ? 0.0 : std::copysign(c.xi_s, xic);
        const PowerPair qc = powers(1.0 / (rc - cut_offset));
        const double e = energy_at(c, is_first, is_stretched, r, q) -
            energy_at(c, cut_is_first, xic > 0.0, rc, qc);
        block.energy[k] = dsq > cutsq[k] ? 0.0 : e;
      }
    }
  }

  /// Laws with exponents of their own, or others than the fixed ones: pair by pair.
  template <bool Damping, bool Energy> void evaluate_any(const BlockLaw &law, Block &block)
  {
    for (int k = 0; k < block.n; k++) {
      const double *const xy = block.xy + 2 * k;
      const double dsq = xy[0] * xy[0] + xy[1] * xy[1] + block.z[k] * block.z[k];
      block.force[k] = block.energy[k] = 0.0;
      if (dsq > block.cutsq[k]) continue;
      const Law &own = law.laws[block.kind[k] >> 1];
      const double d = std::sqrt(dsq), inv_deq = block.inv_deq[k];
      block.force[k] = own.force(d * inv_deq, 1.0) * inv_deq / d;
      if constexpr (Damping) block.force[k] -= own.parameters().gamma * block.approach[k] / dsq;
      if constexpr (Energy)
        block.energy[k] = own.energy(d * inv_deq, 1.0,
                                     std::sqrt(block.cutsq[k]) * inv_deq *
                                         block.margin_removed[block.kind[k] & 1]);
    }
  }

  template <class P, bool Many, bool Damping, bool Energy>
  void evaluate_base(const BlockLaw &law, Block &block)
  {
    evaluate<P, Many, Damping, Energy>(law, block);
  }

#if EVP_HAS_LEVELS
  template <class P, bool Many, bool Damping, bool Energy>
  EVP_AVX2 void evaluate_avx2(const BlockLaw &law, Block &block)
  {
    evaluate<P, Many, Damping, Energy>(law, block);
  }

  template <class P, bool Many, bool Damping, bool Energy>
  EVP_AVX512 void evaluate_avx512(const BlockLaw &law, Block &block)
  {
    evaluate<P, Many, Damping, Energy>(law, block);
  }
#endif

  template <class P, bool Many, bool Damping, bool Energy>
  BlockLaw::Function function_for(Level level)
  {
#if EVP_HAS_LEVELS
    if (level == Level::AVX512) return evaluate_avx512<P, Many, Damping, Energy>;
    if (level == Level::AVX2) return evaluate_avx2<P, Many, Damping, Energy>;
#endif
    (void) level;
    return evaluate_base<P, Many, Damping, Energy>;
  }

  template <class P, bool Many>
  void choose_functions(BlockLaw::Function (&functions)[2][2], Level level)
  {
    functions[0][0] = function_for<P, Many, false, false>(level);
    functions[0][1] = function_for<P, Many, false, true>(level);
    functions[1][0] = function_for<P, Many, true, false>(level);
    functions[1][1] = function_for<P, Many, true, true>(level);
  }

}    // namespace

void BlockLaw::assign(const std::vector<Law> &laws_in, const std::vector<int> &used, Level level)
{
  laws = laws_in;
  constants.clear();
  for (const Law &law : laws) constants.push_back(law.constants());
  functions[0][0] = evaluate_any<false, false>;
  functions[0][1] = evaluate_any<false, true>;
  functions[1][0] = evaluate_any<true, false>;
  functions[1][1] = evaluate_any<true, true>;
  if (used.empty()) return;
  const Row &row = laws[used.front()].parameters();
  constants.front() = laws[used.front()].constants();

  bool common = row.m2 == row.m1 && row.n2 == row.n1;
  for (const int k : used) {
    const Row &other = laws[k].parameters();
    common = common && other.m1 == row.m1 && other.n1 == row.n1 && other.m2 == row.m1 &&
        other.n2 == row.n1;
  }
  const bool many = used.size() > 1;
  if (common)
    with_fixed_powers(row.m1, row.n1, [&](auto powers) {
      using P = decltype(powers);
      if (many)
        choose_functions<P, true>(functions, level);
      else
        choose_functions<P, false>(functions, level);
    });
}

}    // namespace EVP
