// SPDX-License-Identifier: GPL-2.0-only

#ifndef EVP_CORE_COEFFICIENTS_H
#define EVP_CORE_COEFFICIENTS_H

#include "core/block_law.h"
#include "core/law.h"
#include "core/params.h"

#include <vector>

namespace EVP {

class Coefficients {
 public:
  void resize(int ntypes)
  {
    n = ntypes + 1;
    for (auto &t : tables) t.assign((size_t) n * n, 0.0);
    for (int k = 0; k < 9; k++) {
      pointers[k].resize(n);
      for (int i = 0; i < n; i++) pointers[k][i] = &tables[k][(size_t) i * n];
    }
    laws.assign((size_t) 2 * n * n, Law());
  }
  void set(int i, int j, const Row &row)
  {
    const double v[] = {row.e1, row.m1,   row.n1,    row.e2,   row.m2,
                        row.n2, row.xi_s, row.gamma, row.alpha};
    for (int k = 0; k < 9; k++) pointers[k][i][j] = pointers[k][j][i] = v[k];
  }
  Row row(int i, int j) const
  {
    double v[9];
    for (int k = 0; k < 9; k++) v[k] = pointers[k][i][j];
    return {v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]};
  }
  double **table(int k) { return pointers[k].data(); }
  double alpha(int i, int j) const { return n ? pointers[8][i][j] : 0.0; }
  void make_law(int i, int j)
  {
    set(i, j, row(i, j));
    Row r = row(i, j);
    laws[index(i, j)] = laws[index(j, i)] = Law(r);
    r.gamma = 0.0;
    laws[undamped(index(i, j))] = laws[undamped(index(j, i))] = Law(r);
  }
  int index(int i, int j) const { return i * n + j; }
  int undamped(int law) const { return law + n * n; }
  const Law &law(int k) const { return laws[k]; }
  double gamma_elsewhere(int k) const
  {
    return k < n * n ? 0.0 : laws[k - n * n].parameters().gamma;
  }
  void make_block_law(std::vector<int> used, bool mixed)
  {
    bool alike = !mixed;
    for (const int k : used) alike = alike && laws[k].parameters() == laws[used[0]].parameters();
    if (alike && !used.empty()) used.resize(1);
    if (mixed)
      for (int k = (int) used.size() - 1; k >= 0; k--) used.push_back(n * n + used[k]);
    block.assign(laws, used);
  }
  const BlockLaw &block_law() const { return block; }
  double memory_usage() const { return 0.0; }
  const std::vector<Law> &all() const { return laws; }

 private:
  int n = 0;
  std::vector<double> tables[9];
  std::vector<double *> pointers[9];
  std::vector<Law> laws;
  BlockLaw block;
};

}    // namespace EVP

#endif
