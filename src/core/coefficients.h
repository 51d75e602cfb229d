// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_CORE_COEFFICIENTS_H
#define EVP_CORE_COEFFICIENTS_H

#include "core/block_law.h"
#include "core/bytes.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace EVP {

/// A Row per pair of atom types, which count from 1, and two laws made of it: the law itself, and its
/// twin without gamma for pairs whose damping fix nve/evp takes over.
class Coefficients {
 public:
  Coefficients() = default;
  Coefficients(const Coefficients &) = delete;    // tables point into values
  Coefficients &operator=(const Coefficients &) = delete;

  void resize(int ntypes)
  {
    n = ntypes + 1;
    values.assign((size_t) NMEMBERS * n * n, 0.0);
    for (int k = 0; k < NMEMBERS; k++) {
      tables[k].resize(n);
      for (int i = 0; i < n; i++) tables[k][i] = &values[((size_t) k * n + i) * n];
    }
    laws.assign((size_t) 2 * n * n, Law());
  }

  void set(int i, int j, const Row &row)
  {
    for (int k = 0; k < NMEMBERS; k++) tables[k][i][j] = tables[k][j][i] = row.*MEMBERS[k].value;
  }

  /// What pair_coeff or fix adapt wrote, which goes over i <= j only.
  Row row(int i, int j) const
  {
    Row row{};
    for (int k = 0; k < NMEMBERS; k++)
      row.*MEMBERS[k].value = tables[k][std::min(i, j)][std::max(i, j)];
    return row;
  }

  /// The [type][type] table of a member for fix adapt to write into, nullptr if there is none of
  /// this name.
  double **table(const std::string &key)
  {
    for (int k = 0; k < NMEMBERS; k++)
      if (key == MEMBERS[k].key) return tables[k].data();
    return nullptr;
  }

  /// A row and its checksum, for restart files.
  using Words = std::array<double, NMEMBERS + 1>;
  Words words(int i, int j) const
  {
    Words words;
    for (int k = 0; k < NMEMBERS; k++) words[k] = tables[k][i][j];
    words[NMEMBERS] = checksum(words.data(), NMEMBERS);
    return words;
  }

  /// False where the words are damaged.
  bool set(int i, int j, const Words &words)
  {
    if (words[NMEMBERS] != checksum(words.data(), NMEMBERS)) return false;
    for (int k = 0; k < NMEMBERS; k++) tables[k][i][j] = tables[k][j][i] = words[k];
    return true;
  }

  /// Makes both laws of a pair of types from its row as it is now; throws BadInput. They stay
  /// until the next call, whatever becomes of the row.
  const Row &make_law(int i, int j)
  {
    Row row = this->row(i, j);
    set(i, j, row);
    laws[index(i, j)] = laws[index(j, i)] = Law(row);
    row.gamma = 0.0;
    laws[undamped(index(i, j))] = laws[undamped(index(j, i))] = Law(row);
    return law(index(i, j)).parameters();
  }

  /// Of a law: those of type i with all types j stand in a row.
  int index(int i, int j) const { return i * n + j; }
  const Law &law(int index) const { return laws[index]; }

  /// Index of the twin without gamma.
  int undamped(int index) const { return index + n * n; }

  /// gamma that a twin lacks [force/velocity], 0 for a law that has its own.
  double gamma_elsewhere(int index) const
  {
    return index < n * n ? 0.0 : laws[index - n * n].parameters().gamma;
  }

  /// Chooses the loop over blocks of pairs. handles(i, j): are there pairs of these types? twins:
  /// some of them take the twin, which matters only beside others that have their gamma. flows: see
  /// BlockLaw::assign().
  template <class Handles> void choose_block_law(Handles &&handles, bool twins, bool flows)
  {
    used.clear();    // keeps its room: packing allocates nothing
    for (int i = 1; i < n; i++)
      for (int j = i; j < n; j++) {
        if (!handles(i, j)) continue;
        used.push_back(index(i, j));
        if (twins) used.push_back(undamped(index(i, j)));
      }
    block.assign(laws, used, flows);
  }
  const BlockLaw &block_law() const { return block; }

  /// Indices of the laws that pairs can have, since choose_block_law().
  const std::vector<int> &laws_in_use() const { return used; }

  double memory_usage() const { return bytes_of(values, laws, used, block.constants); }

 private:
  int n = 0;                                             // atom types and one more
  std::vector<double> values;                            // of all members
  std::array<std::vector<double *>, NMEMBERS> tables;    // [type][type] of each
  std::vector<Law> laws;                                 // of all pairs of types, then their twins
  std::vector<int> used;                                 // indices of the laws that pairs can have
  BlockLaw block;
};

}    // namespace EVP

#endif
