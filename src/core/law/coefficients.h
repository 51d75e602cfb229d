// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/simd.h"
#include "core/law/bond_measures.h"
#include "core/pairs/contacts.h"
#include "core/pairs/pair_block.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace EVP {

/// A Row per pair of atom types, which count from 1, and the laws made of it: the law itself, that of contacts between
/// two bodies, which stay elastic, and of both the twin without gamma for pairs whose damping fix nve/evp takes over. A
/// row that names the bodies it holds for is kept as given; its laws are those of the body whose bonds were measured.
class Coefficients {
 public:
  Coefficients() = default;
  Coefficients(const Coefficients &) = delete;    // tables point into values
  Coefficients &operator=(const Coefficients &) = delete;

  void resize(int ntypes)
  {
    n = ntypes + 1;
    values.assign((size_t) NREQUIRED * n * n, 0.0);
    for (int k = 0; k < NREQUIRED; k++) {
      tables[k].resize(n);
      for (int i = 0; i < n; i++) tables[k][i] = &values[((size_t) k * n + i) * n];
    }
    rows.assign((size_t) n * n, Row());
    laws.assign((size_t) 4 * n * n, PairLaw());
    has_chosen = false;
  }

  void set(int i, int j, const Row &row)
  {
    for (int k = 0; k < NREQUIRED; k++) tables[k][i][j] = tables[k][j][i] = row.*MEMBERS[k].value;
    rows[index(i, j)] = rows[index(j, i)] = row;
  }

  /// As pair_coeff or fix adapt wrote it; fix adapt writes for i <= j only.
  Row row(int i, int j) const
  {
    Row row = rows[index(i, j)];
    for (int k = 0; k < NREQUIRED; k++)
      row.*MEMBERS[k].value = tables[k][std::min(i, j)][std::max(i, j)];
    return row;
  }

  /// The [type][type] table of a required member for fix adapt to write into, nullptr if there is none of
  /// this name.
  double **table(const std::string &key)
  {
    const Member *const member = find_member(key);
    return member && member < MEMBERS + NREQUIRED ? tables[member - MEMBERS].data() : nullptr;
  }

  // the body that laws are made for

  /// Does any row name the bodies that it holds for?
  bool any_scaled() const
  {
    return std::any_of(rows.begin(), rows.end(), [](const Row &row) {
      return row.is_scaled();
    });
  }

  /// Takes the measures of the bonds, empty ones where there are none. True where they differ from those
  /// that laws were made with: the laws of all pairs of types must be made anew.
  bool set_measures(const BondMeasures &now)
  {
    if (measures == now) return false;
    measures = now;
    return true;
  }
  const BondMeasures &measured() const { return measures; }

  /// Where the factors of a pair of types come from.
  enum class Source { AS_GIVEN, OWN_BONDS, LIKE_TYPES };
  struct Scaling {
    Source source = Source::AS_GIVEN;
    Factors factors;
  };

  /// What the row of a pair of types is multiplied by. One without bonds between its types takes the
  /// geometric mean of the factors of its like types, or of the one that has factors; throws BadInput.
  Scaling scaling(int i, int j) const
  {
    if (measures.empty() || !row(i, j).is_scaled()) return {};
    const Scaling own = own_scaling(i, j);
    if (i == j || own.source == Source::OWN_BONDS) return own;
    const Scaling a = own_scaling(i, i), b = own_scaling(j, j);
    if (a.source == Source::AS_GIVEN && b.source == Source::AS_GIVEN) return {};
    if (a.source == Source::AS_GIVEN) return {Source::LIKE_TYPES, b.factors};
    if (b.source == Source::AS_GIVEN) return {Source::LIKE_TYPES, a.factors};
    return {Source::LIKE_TYPES, geometric_mean(a.factors, b.factors)};
  }

  /// KV of the atoms of a type in the body [energy]; throws BadInput.
  double kv(int type) const
  {
    const double given = row(type, type).kv;
    if (given == 0.0) return 0.0;
    const double kv = given * scaling(type, type).factors.kv;
    if (!(kv <= HIGHEST_KV))
      throw BadInput("kv must not exceed 1e100 in the body, got " + rounded(kv) +
                     ": is the spacing of the row in the unit of the input script?");
    return kv;
  }

  /// What the bonds of a sphere of a type store as the body is compressed, over half of the square of its volume strain, in an affine
  /// motion [energy]; 0 of types without `yield`.
  double bulk_of_bonds(int type) const
  {
    const Row given = row(type, type);
    return given.yield == 0.0 ? 0.0
                              : given.m1 * given.n1 * given.e1 * given.coordination / 18.0 *
            scaling(type, type).factors.kv;
  }

  /// Makes the laws of a pair of types from its row and the measures as they are now; throws BadInput.
  /// They stay until the next call, whatever becomes of both.
  const Row &make_law(int i, int j)
  {
    Row row = this->row(i, j);
    set(i, j, row);
    const Scaling scale = scaling(i, j);
    if (scale.source != Source::AS_GIVEN) {
      (void) PairLaw(row);    // the rules are those of the numbers as given
      row = multiplied(row, scale.factors);
    }
    try {
      put_laws(i, j, row);
    } catch (const BadInput &) {
      if (scale.source == Source::AS_GIVEN) throw;
      throw BadInput("for the spacing of the body e1 and e2 of the row are multiplied by " +
                     shortest_text(scale.factors.energies) + " and gamma by " +
                     shortest_text(scale.factors.gamma) +
                     ", and overflow double precision: is the spacing of the row in the unit of "
                     "the input script?");
    }
    has_chosen = false;
    return law(index(i, j)).row;
  }

  /// Of a law: those of type i with all types j stand in a row.
  int index(int i, int j) const { return i * n + j; }
  const PairLaw &law(int index) const { return laws[index]; }

  /// Index of the twin without gamma, and of the law between two bodies.
  int undamped(int index) const { return index + 2 * n * n; }
  int between_bodies(int index) const { return index + n * n; }

  /// That of a bond whose contact has this one.
  int within_body(int index) const { return index - index / (n * n) % 2 * (n * n); }

  /// As the row of a law has it, also between two bodies.
  double xi_s(int index) const { return laws[index % (n * n)].xi_s; }

  /// gamma that a twin lacks [force/velocity], 0 for a law that has its own.
  double gamma_elsewhere(int index) const
  {
    return index < 2 * n * n ? 0.0 : laws[index - 2 * n * n].gamma;
  }

  /// Chooses the loops over blocks of bonds and of contacts. handles(i, j): are there pairs of these types? twins:
  /// some of them take the twin, which matters only beside others that have their gamma. divided: there are two bodies.
  template <class Handles>
  void choose_block_laws(Handles &&handles, bool twins, bool divided, Flow flow_of_bonds,
                         Flow flow_of_contacts)
  {
    std::swap(used, used_before);    // they keep their room: packing allocates nothing
    for (auto &own : used) own.clear();
    for (int i = 1; i < n; i++)
      for (int j = i; j < n; j++) {
        if (!handles(i, j)) continue;
        const auto use = [&](std::vector<int> &of, int law) {
          of.push_back(law);
          if (twins) of.push_back(undamped(law));
        };
        for (auto &own : used) use(own, index(i, j));
        if (divided) use(used[1], between_bodies(index(i, j)));
      }
    const std::array now = {flow_of_bonds, flow_of_contacts};
    if (used == used_before && now == flows && has_chosen) return;
    flows = now;
    has_chosen = true;
    for (int k = 0; k < 2; k++) blocks[k].assign(laws, used[k], flows[k]);
  }
  const BlockLaw &block_law(const PairList &list) const { return blocks[list.are_bonds ? 0 : 1]; }

  double memory_usage() const { return bytes_of(values, rows, laws); }

 private:
  int n = 0;                                              // atom types and one more
  std::vector<double> values;                             // of the required members
  std::array<std::vector<double *>, NREQUIRED> tables;    // [type][type] of each
  std::vector<Row> rows;        // [type][type] as pair_coeff gave them, the rest of their members
  BondMeasures measures;        // of the body
  std::vector<PairLaw> laws;    // of all pairs of types, between bodies, then the twins of both
  std::array<std::vector<int>, 2> used, used_before;    // laws that bonds and contacts can have
  std::array<Flow, 2> flows{};
  std::array<BlockLaw, 2> blocks;    // of bonds, of contacts
  bool has_chosen = false;

  // throws BadInput
  void put_laws(int i, int j, Row row)
  {
    for (const bool damped : {true, false}) {
      if (!damped) row.gamma = 0.0;
      Row elastic = row;
      elastic.xi_s = std::max(row.xi_s, LIMIT_BETWEEN_BODIES);
      elastic.flow = {};
      elastic.limit_own = 0.0;
      for (const int own : {index(i, j), index(j, i)}) {
        const int k = damped ? own : undamped(own);
        laws[k] = PairLaw(row, row.limit_own != 0.0 ? row.xi_s : 0.0);
        laws[between_bodies(k)] = PairLaw(elastic, elastic.xi_s);
      }
    }
  }

  Scaling own_scaling(int i, int j) const
  {
    const Row given = row(i, j);
    const BondMeasure body = measures.of(i, j);
    if (!given.is_scaled() || body.spacing == 0.0) return {};
    return {Source::OWN_BONDS, factors_of(given, body)};
  }
};

}    // namespace EVP
