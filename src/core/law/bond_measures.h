// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/law/row.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace EVP {

/// What the recorded bonds of a body say of a pair of atom types; both 0 where no bond joins the two. A type
/// whose particles are bonded with those of other types only has the measures of these bonds.
struct BondMeasure {
  double spacing;         ///< mean deq of the bonds between the types [length]
  double coordination;    ///< bonds per particle of the types that has any, with whatever types

  bool operator==(const BondMeasure &other) const
  {
    return spacing == other.spacing && coordination == other.coordination;
  }
};

/// Place of a pair of types, which count from 1, among those of i <= j.
inline size_t place_of_types(int i, int j)
{
  const size_t low = std::min(i, j) - 1, high = std::max(i, j) - 1;
  return high * (high + 1) / 2 + low;
}

/// The measures of all pairs of types, which count from 1; empty before the bonds are measured.
class BondMeasures {
 public:
  BondMeasures() = default;
  explicit BondMeasures(int n) : ntypes(n), values((size_t) n * (n + 1) / 2, BondMeasure{}) {}

  bool empty() const { return ntypes == 0; }
  bool any_bonds() const
  {
    return std::any_of(values.begin(), values.end(), [](const BondMeasure &measure) {
      return measure.spacing > 0.0;
    });
  }
  BondMeasure &of(int i, int j) { return values[place_of_types(i, j)]; }
  BondMeasure of(int i, int j) const { return values[place_of_types(i, j)]; }

  bool operator==(const BondMeasures &other) const { return values == other.values; }

  /// For restart files: how many words these are in a body of that many types.
  static size_t words_of(int ntypes) { return 1 + (size_t) ntypes * (ntypes + 1); }

  /// 1, or 0 where it is empty, and the measures.
  std::vector<double> words(int ntypes_in) const
  {
    std::vector<double> words = {empty() ? 0.0 : 1.0};
    for (const BondMeasure &measure : values)
      words.insert(words.end(), {measure.spacing, measure.coordination});
    words.resize(words_of(ntypes_in), 0.0);
    return words;
  }

  /// Takes words() of a body of that many types.
  void unpack(const double *words, int ntypes_in)
  {
    *this = BondMeasures(words[0] != 0.0 ? ntypes_in : 0);
    for (BondMeasure &measure : values) {
      measure = {words[1], words[2]};
      words += 2;
    }
  }

 private:
  int ntypes = 0;
  std::vector<BondMeasure> values;    // of i <= j
};

/// Counts particles and bonds of one MPI rank.
class BondCensus {
 public:
  explicit BondCensus(int n) : sums((size_t) n * (n + 3), 0.0), ntypes(n) {}

  /// A particle that has bonds, and their number.
  void add_particle(int type, size_t bonds)
  {
    sums[2 * (type - 1)] += 1.0;
    sums[2 * (type - 1) + 1] += (double) bonds;
  }

  /// A bond of a particle of type i with one of type j; each bond is added from both sides.
  void add_bond(int i, int j, double deq)
  {
    sums[place(i, j)] += 1.0;
    sums[place(i, j) + 1] += deq;
  }

  /// To be added up over all MPI ranks, in place.
  std::vector<double> sums;

  BondMeasures measures() const
  {
    BondMeasures measures(ntypes);
    for (int i = 1; i <= ntypes; i++)
      for (int j = i; j <= ntypes; j++) {
        const double *const a = &sums[2 * (i - 1)], *const b = &sums[2 * (j - 1)];
        double count = sums[place(i, j)], total = sums[place(i, j) + 1];
        if (i == j && count == 0.0)    // those with whatever types
          for (int other = 1; other <= ntypes; other++) {
            count += sums[place(i, other)];
            total += sums[place(i, other) + 1];
          }
        if (count == 0.0) continue;
        measures.of(i, j) = {total / count, i == j ? a[1] / a[0] : (a[1] + b[1]) / (a[0] + b[0])};
      }
    return measures;
  }

 private:
  int ntypes;

  size_t place(int i, int j) const { return 2 * ((size_t) ntypes + place_of_types(i, j)); }
};

/// What coefficients of a row are multiplied by in a body with other bonds than those it holds for.
struct Factors {
  double energies = 1.0;    ///< e1 and e2
  double gamma = 1.0;
  double kv = 1.0;
};

/// Of a row that names its spacing S and coordination Z, in a body that has s and z: the same material,
/// whatever the body. An isotropic body has E = m n e1 (Nb/V)/6 with Nb/V ~ z/s^3; its over-stress at a
/// rate is gamma s^2 (Nb/V)/6; its bulk modulus gains kv N/V ~ kv/s^3.
inline Factors factors_of(const Row &row, const BondMeasure &body)
{
  const double stretch = body.spacing / row.spacing, share = row.coordination / body.coordination;
  const double cubed = stretch * stretch * stretch;
  return {cubed * share, stretch * share, cubed};
}

/// The row with its energies and damping multiplied; its kv stays.
inline Row multiplied(Row row, const Factors &by)
{
  row.e1 *= by.energies;
  row.e2 *= by.energies;
  row.gamma *= by.gamma;
  return row;
}

/// Coefficients of the paper, which hold for 500 spheres in its cylinder (length 0.05 m, radius 0.02 m), as they are for a
/// body with that many spheres per volume [1/m3].
inline Row with_number_density(const Row &row, double spheres)
{
  const double of_paper = 500.0 / (std::acos(-1.0) * 0.02 * 0.02 * 0.05);
  Row of_spacing_one = row;
  of_spacing_one.spacing = of_spacing_one.coordination = 1.0;
  const Factors by = factors_of(of_spacing_one, {std::cbrt(of_paper / spheres), 1.0});
  Row made = multiplied(row, by);
  made.kv *= by.kv;
  return made;
}

/// Of a pair of types without bonds.
inline Factors geometric_mean(const Factors &a, const Factors &b)
{
  return {std::sqrt(a.energies * b.energies), std::sqrt(a.gamma * b.gamma), std::sqrt(a.kv * b.kv)};
}

}    // namespace EVP
