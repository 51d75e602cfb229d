// SPDX-License-Identifier: GPL-2.0-only
//
// The law over a block of pairs, compiled once per instruction set. This file must be compiled with
// -ffp-contract=off: a fused multiply-add on one machine only would give it other numbers.

#include "core/block_law.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace EVP {

namespace {

  /// The constants of the laws of a block: of each pair, or one entry where all laws are alike.
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
      const auto at = c.point(r);

      // 1/d and s = 1/(r - offset) from one division
      const double w = 1.0 / (at.shifted * d);
      const double s = w * d;
      const double inv_d = w * at.shifted;
      const PowerPair q = powers(s);

      double f = c.force(at, s, q) * (inv_deq[k] * inv_d);
      if constexpr (Damping) f -= c.gamma * block.approach[k] * (inv_d * inv_d);
      block.force[k] = dsq > cutsq[k] ? 0.0 : f;

      if constexpr (Energy) {
        const double rc = std::sqrt(cutsq[k]) * inv_deq[k] * (kind[k] & 1 ? of_bond : of_new);
        const auto cut = c.point(rc);
        const double e = c.energy(at, q) - c.energy(cut, powers(1.0 / cut.shifted));
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
  BlockLaw::Function function_for([[maybe_unused]] Level level)
  {
    if constexpr (std::is_same_v<P, AnyPowers>) return evaluate_any<Damping, Energy>;
#if EVP_HAS_LEVELS
    else if (level == Level::AVX512)
      return evaluate_avx512<P, Many, Damping, Energy>;
    else if (level == Level::AVX2)
      return evaluate_avx2<P, Many, Damping, Energy>;
#endif
    else
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
  laws = laws_in.data();
  constants.clear();
  if (used.empty()) return;    // no pair to go over

  const Row &row = laws[used.front()].parameters();
  bool alike = true, common_powers = true;
  for (const int k : used) {
    const Row &own = laws[k].parameters();
    alike = alike && own == row;
    common_powers = common_powers && own.m1 == row.m1 && own.n1 == row.n1 && own.m2 == row.m1 &&
        own.n2 == row.n1;
  }
  if (alike)
    constants.push_back(laws[used.front()].constants());
  else
    for (const Law &law : laws_in) constants.push_back(law.constants());

  with_powers(common_powers ? row.m1 : 0.0, row.n1, [&](auto powers) {
    using P = decltype(powers);
    if (alike)
      choose_functions<P, false>(functions, level);
    else
      choose_functions<P, true>(functions, level);
  });
}

}    // namespace EVP
