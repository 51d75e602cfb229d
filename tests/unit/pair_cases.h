// SPDX-License-Identifier: GPL-2.0-only
//
// What the tests of pairs share: rows, lists that are packed by hand, clouds of pairs.

#ifndef EVP_PAIR_CASES_H
#define EVP_PAIR_CASES_H

#include "core/pairs/pair_block.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace pair_cases {

constexpr double EPSILON = std::numeric_limits<double>::epsilon();

using Vectors = std::vector<std::array<double, 3>>;

inline const double (*rows_of(const Vectors &x))[3]
{
  return reinterpret_cast<const double(*)[3]>(x.data());
}

inline EVP::Row with_exponents(double m1, double n1, double m2, double n2)
{
  return {80, m1, n1, 3, m2, n2, 0.005, 1000, 1.5};
}
inline const EVP::Row TABLE2 = with_exponents(8, 4, 8, 4);

inline std::string name_of(const EVP::Row &row)
{
  std::ostringstream text;
  for (const EVP::Member &member : EVP::MEMBERS)
    text << member.key << " " << row.*member.value << " ";
  return text.str();
}

/// Calls f with each instruction set of this machine in turn, the base first.
template <class F> void on_each_instruction_set(F &&f)
{
  using EVP::InstructionSet;
  for (const auto one : {InstructionSet::BASE, InstructionSet::AVX2, InstructionSet::AVX512}) {
    if (one > EVP::best_instruction_set()) break;
    EVP::instruction_set = one;
    f();
  }
  EVP::instruction_set = EVP::best_instruction_set();
}

struct Pair {
  int j;
  double deq, cutoff;
  int law = 0;
};

/// Packs a row of particle i.
inline void add_row(EVP::PairList &list, int i, const std::vector<Pair> &pairs)
{
  ASSERT_TRUE(list.make_room(pairs.size()));
  size_t n = list.size();
  for (const Pair &pair : pairs) {
    list.inv_deq[n] = 1.0 / pair.deq;
    list.cutsq[n] = list.cutoff_squared(pair.cutoff);
    list.j[n] = pair.j;
    list.law[n] = pair.law;
    n++;
  }
  list.add_row(i, (int) pairs.size());
}

/// 50 points in a unit cube, and npairs bonds and npairs contacts between them, each particle's in two rows. Strains
/// reach beyond the elastic limits both ways, of which each particle has its own; one bond in ten is past its cutoff.
struct Cloud {
  Vectors x, v;
  std::vector<double> limits;
  std::vector<EVP::PairLaw> laws;
  EVP::PairLists lists;

  Cloud(const std::vector<EVP::Row> &rows, int npairs, bool plastic)
  {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const int n = 50;
    for (int i = 0; i < n; i++) {
      x.push_back({unit(random), unit(random), unit(random)});
      v.push_back({unit(random), unit(random), unit(random)});
      limits.push_back(0.004 + 0.02 * unit(random));
    }
    for (const EVP::Row &row : rows) laws.emplace_back(row);
    lists.nlocal = lists.nall = n;
    lists.bonds.clear(EVP::BOND_MARGIN, plastic ? EVP::Flow::PLASTIC : EVP::Flow::REVERSIBLE);
    lists.contacts.clear(EVP::NEW_PAIR_MARGIN,
                         plastic ? EVP::Flow::PLASTIC_CONTACT : EVP::Flow::REVERSIBLE);
    const double range = plastic ? 0.06 : 0.04;
    for (EVP::PairList *list : {&lists.bonds, &lists.contacts})
      for (int i = 0; i < n; i++) {
        std::vector<Pair> halves[2];
        for (int j = i + 1; j < n; j++) {
          const size_t packed = list->size() + halves[0].size() + halves[1].size();
          if ((j % 2 == 0) != list->are_bonds || (int) packed >= npairs) continue;
          const double d = std::sqrt(EVP::PairGeometry(rows_of(x), i, j).dsq);
          const double deq = d / (1.0 + range * (unit(random) - 0.5));
          // a contact that has flowed acts up to its deq, and is flowed up to R_i + R_j
          const double cutoff = plastic && !list->are_bonds ? deq * (j % 3 ? 1.02 : 1.0)
                                                            : d * (0.9 + unit(random));
          halves[j % 4 / 2].push_back({j, deq, cutoff, j % (int) rows.size()});
        }
        for (const auto &half : halves) add_row(*list, i, half);
      }
    for (EVP::PairList *list : {&lists.bonds, &lists.contacts})
      for (const EVP::PackedRow &row : list->rows)
        for (int n = row.first; plastic && n < row.last; n++)
          list->limit[n] = std::min(limits[row.i], limits[list->j[n]]);
  }

  EVP::ParticleView view(Vectors &f, int nreact, bool damping) const
  {
    return {rows_of(x), damping ? rows_of(v) : nullptr, reinterpret_cast<double(*)[3]>(f.data()),
            nreact};
  }
  EVP::BlockLaw block_law(const EVP::PairList &list) const
  {
    std::vector<int> used;
    for (size_t k = 0; k < laws.size(); k++) used.push_back((int) k);
    EVP::BlockLaw law;
    law.assign(laws, used, list.flow());
    return law;
  }

  /// Adds the forces of a list to f.
  void add_forces(EVP::PairList &list, bool damping, int nreact, Vectors &f,
                  std::initializer_list<EVP::PairConsumer *> consumers = {}) const
  {
    accumulate_forces(list, block_law(list), view(f, nreact, damping), consumers);
  }
};

}    // namespace pair_cases

#endif
