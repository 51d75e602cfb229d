// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/text.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

namespace EVP {

/// How far the bonds of a sphere hold, over xi_s, by its plastic strain: linear between points, constant beyond the last.
struct FlowTable {
  static constexpr int MOST = 32;
  int64_t n = 0;    ///< points, 0 without a table
  double p[MOST] = {}, y[MOST] = {};

  double operator()(double strain) const
  {
    const auto next = (int) (std::upper_bound(p, p + n, strain) - p);
    if (next == n) return y[n - 1];
    const double share = (strain - p[next - 1]) / (p[next] - p[next - 1]);
    return y[next - 1] + share * (y[next] - y[next - 1]);
  }

  bool operator==(const FlowTable &other) const
  {
    return n == other.n && std::equal(p, p + n, other.p) && std::equal(y, y + n, other.y);
  }
};

/// The coefficients of a pair of types (Tables 1 and 2), and what a row may go on with, by keyword. Without any: no force.
struct Row {
  // first regime: potential depth [energy], exponents m1 > n1 > 0; second regime
  double e1 = 0.0, m1 = 2.0, n1 = 1.0;
  double e2 = 0.0, m2 = 2.0, n2 = 1.0;
  double xi_s = 0.5;     ///< strain of a pair where the regimes meet, 0 < xi_s < 1
  double gamma = 0.0;    ///< damping of eq. 4 [force/velocity]
  double alpha = 1.5;    ///< dlim = alpha (R_i + R_j), alpha > 1

  double spacing = 0.0,
         coordination = 0.0;    ///< of the bodies that it holds for: core/bond_measures.h
  double kv = 0.0;              ///< of fix evp/volume [energy]
  double density = 0.0;         ///< of the solid [mass/volume]
  FlowTable flow = {};          ///< with plasticity
  double yield = 0.0;           ///< flow stress where the limit is xi_s [pressure]; 0: none
  // ductile failure (Johnson and Cook): strain at initiation, below 0: none; then opening or energy of rupture, below 0: none
  double damage_d1 = -1.0, damage_d2 = 0.0, damage_d3 = 0.0, damage_d4 = 0.0, damage_d5 = 0.0;
  double rupture = -1.0;           ///< [length]
  double rupture_energy = -1.0;    ///< [energy/area]
  double limit_own =
      0.0;    ///< 1: its pairs hold by xi_s, whatever their spheres have gone through

  // of fix evp/heat
  double conductivity = 0.0;    ///< of the solid [power/length/temperature]
  double capacity = 0.0;        ///< [energy/mass/temperature]
  double soften_tref = -1.0;    ///< limits fall from here on; below 0: never. [temperature]
  double soften_tmelt = 0.0;    ///< to soften_floor here
  double soften_m = 1.0;        ///< exponent of softening()
  double soften_floor = 0.02;
  double melt = 0.0;    ///< latent heat at soften_tmelt [energy/mass]
  double rate = 0.0;    ///< limits grow by this times the logarithm of the plastic strain rate
  double rate_rate0 = 1.0;        ///< over this, from there on [1/time]
  double expansion = 0.0;         ///< of lengths [1/temperature], from
  double expansion_tref = 0.0;    ///< this temperature on

  /// Does the row name the bodies that it holds for? Both or none: parse_row() sees to that.
  bool is_scaled() const { return spacing > 0.0; }

  /// Flow stress of a sphere whose bonds flow at this strain [pressure], which is infinite without a row; 0 without `yield`.
  double flow_stress(double limit) const { return yield > 0.0 ? yield * limit / xi_s : 0.0; }
};

/// m - n must be at least this, and this share of m: the force is a difference of s^m and s^n, which
/// round-off then changes by less than 1e-8 of itself at a strain of 1e-3.
constexpr double EXPONENTS_APART = 1e-4;

/// Lengths of pairs change by no more than this share as they warm: so much farther the neighbor list reaches.
constexpr double MOST_EXPANSION = 0.05;

constexpr double HIGHEST_KV = 1.0e100;    // whose squares and forces are finite

struct Member {
  const char *key;    ///< in rows, messages, and for fix adapt
  double Row::*value;
  void (*check)(const Row &row, const Member *self);    ///< throws BadInput
  /// Of a keyword with several numbers: is this one of its further numbers, and may it be left out?
  enum Place { HEAD, FURTHER, OPTIONAL } place = HEAD;

  /// The first number of its keyword.
  const Member *head() const { return place == HEAD ? this : (this - 1)->head(); }
};

/// The rules of the members.
namespace rule {
  inline void demand(bool holds, const Row &row, const Member *self, const std::string &rule)
  {
    if (!holds) throw BadInput(self->key + (" " + rule) + ", got " + rounded(row.*self->value));
  }
  inline void not_negative(const Row &row, const Member *self)
  {
    demand(row.*self->value >= 0.0, row, self, "must be zero or positive");
  }
  inline void larger_exponent(const Row &row, const Member *self)
  {
    const double m = row.*self->value;
    if (!(m <= 200.0))
      throw BadInput(std::string("exponent ") + self->key + " must not exceed 200, got " +
                     rounded(m) + ": steeper laws overflow; the paper uses 2 to 8");
  }
  inline void smaller_exponent(const Row &row, const Member *self)
  {
    const Member *const larger = self - 1;    // it stands in front
    const std::string m_key = larger->key, n_key = self->key;
    const double m = row.*larger->value, n = row.*self->value;
    if (!(m > n && n > 0.0))
      throw BadInput("exponents must satisfy " + m_key + " > " + n_key + " > 0, got " + m_key +
                     " = " + rounded(m) + " and " + n_key + " = " + rounded(n));
    const double least = EXPONENTS_APART * std::max(m, 1.0);
    if (m - n < least)
      throw BadInput("exponents too close: " + m_key + " - " + n_key + " = " + rounded(m - n) +
                     ", must be at least " + rounded(least) + " (0.0001, and 0.0001 of " + m_key +
                     "): the force would be round-off");
  }
  inline void strain(const Row &row, const Member *self)
  {
    demand(row.*self->value > 0.0 && row.*self->value < 1.0, row, self,
           "must lie between 0 and 1 (a strain of the pair; the paper takes 0.005)");
  }
  inline void cutoff_ratio(const Row &row, const Member *self)
  {
    const std::string what = " (dlim = alpha (R_i + R_j); the paper takes 1.5)";
    demand(row.*self->value > 1.0, row, self, "must be greater than 1" + what);
    demand(row.*self->value <= 100.0, row, self, "must not exceed 100" + what);
  }
  inline void positive(const Row &row, const Member *self)
  {
    demand(row.*self->value > 0.0, row, self, "must be positive");
  }
  inline void above_zero_temperature(const Row &row, const Member *self)
  {
    demand(row.*self->value >= 0.0, row, self, "must be a temperature of 0 or more");
  }
  inline void melting_temperature(const Row &row, const Member *self)
  {
    demand(row.*self->value > row.soften_tref, row, self,
           "must lie above TREF = " + rounded(row.soften_tref));
  }
  inline void share(const Row &row, const Member *self)
  {
    demand(row.*self->value > 0.0 && row.*self->value < 1.0, row, self,
           "must lie between 0 and 1 (the share of the limit that is left when it melts)");
  }
  inline void latent_heat(const Row &row, const Member *self)
  {
    positive(row, self);
    if (row.soften_tref < 0.0)
      throw BadInput("melt needs soften TREF TMELT M in front of it, which says where it melts");
  }
  inline void triaxiality_exponent(const Row &row, const Member *self)
  {
    demand(row.*self->value <= 0.0, row, self,
           "must be zero or negative, as a metal is less ductile under tension (tables that "
           "take compression as positive have the other sign)");
  }
  inline void share_of_rate(const Row &row, const Member *self)
  {
    if (row.*self->value != 0.0 && !(row.rate > 0.0))
      throw BadInput(
          "damage with D4 needs rate C RATE0 in front of it, which says over which rate");
  }
  inline void share_of_heat(const Row &row, const Member *self)
  {
    not_negative(row, self);
    if (row.*self->value != 0.0 && row.soften_tref < 0.0)
      throw BadInput("damage with D5 needs soften TREF TMELT M in front of it, which says between "
                     "which temperatures");
  }
  inline void volume_stiffness(const Row &row, const Member *self)
  {
    demand(row.*self->value >= 0.0 && row.*self->value <= HIGHEST_KV, row, self,
           "must lie between 0 and 1e100 (an energy per atom, for fix evp/volume row)");
  }
}    // namespace rule

/// All members, an m in front of its n, in the order of the paper's tables, which is that of files and commands; then
/// those that a keyword gives, with the default of Row where it does not.
constexpr Member MEMBERS[] = {
    {"e1", &Row::e1, rule::not_negative},
    {"m1", &Row::m1, rule::larger_exponent},
    {"n1", &Row::n1, rule::smaller_exponent},
    {"e2", &Row::e2, rule::not_negative},
    {"m2", &Row::m2, rule::larger_exponent},
    {"n2", &Row::n2, rule::smaller_exponent},
    {"xi_s", &Row::xi_s, rule::strain},
    {"gamma", &Row::gamma, rule::not_negative},
    {"alpha", &Row::alpha, rule::cutoff_ratio},
    {"spacing", &Row::spacing, rule::positive},
    {"coordination", &Row::coordination, rule::positive},
    {"kv", &Row::kv, rule::volume_stiffness},
    {"density", &Row::density, rule::positive},
    {"yield", &Row::yield, rule::positive},
    {"conductivity", &Row::conductivity, rule::positive},
    {"capacity", &Row::capacity, rule::positive},
    {"soften", &Row::soften_tref, rule::above_zero_temperature},
    {"soften_tmelt", &Row::soften_tmelt, rule::melting_temperature, Member::FURTHER},
    {"soften_m", &Row::soften_m, rule::positive, Member::FURTHER},
    {"soften_floor", &Row::soften_floor, rule::share, Member::OPTIONAL},
    {"melt", &Row::melt, rule::latent_heat},
    {"rate", &Row::rate, rule::positive},
    {"rate_rate0", &Row::rate_rate0, rule::positive, Member::FURTHER},
    {"expansion", &Row::expansion, rule::positive},
    {"expansion_tref", &Row::expansion_tref, rule::above_zero_temperature, Member::FURTHER},
    {"damage", &Row::damage_d1, rule::not_negative},
    {"damage_d2", &Row::damage_d2, rule::not_negative, Member::FURTHER},
    {"damage_d3", &Row::damage_d3, rule::triaxiality_exponent, Member::FURTHER},
    {"damage_d4", &Row::damage_d4, rule::share_of_rate, Member::FURTHER},
    {"damage_d5", &Row::damage_d5, rule::share_of_heat, Member::FURTHER},
    {"rupture", &Row::rupture, rule::not_negative},
    {"rupture energy", &Row::rupture_energy, rule::positive}};
constexpr int NMEMBERS = (int) std::size(MEMBERS);
constexpr int NREQUIRED = 9;    // those in front, without a keyword

/// Is the member required, or another than its default?
inline bool is_given(const Row &row, const Member &member)
{
  const Member &head = *member.head();    // whose further numbers may be their defaults
  return &head < MEMBERS + NREQUIRED || row.*head.value != Row{}.*head.value;
}

/// The strain of a bond where -F d is largest: one that holds so far would flow without an end.
inline double strongest_strain(const Row &row)
{
  return std::pow(row.m1 / row.n1, 1.0 / (row.m1 - row.n1)) - 1.0;
}

/// Throws BadInput where the flow table of the row breaks a rule.
inline void check_flow(const Row &row)
{
  const FlowTable &flow = row.flow;
  if (flow.n > 0 && (flow.p[0] != 0.0 || flow.y[0] != 1.0))
    throw BadInput("flow must begin with 0 1 (the limit xi_s at no plastic strain), got " +
                   rounded(flow.p[0]) + " " + rounded(flow.y[0]));
  for (int k = 0; k < flow.n; k++) {
    if (k > 0 && !(flow.p[k] > flow.p[k - 1]))
      throw BadInput("plastic strains of flow must ascend, got " + rounded(flow.p[k]) + " after " +
                     rounded(flow.p[k - 1]));
    if (!(flow.y[k] > 0.0 && row.xi_s * flow.y[k] < strongest_strain(row)))
      throw BadInput(
          "limits of flow must be positive and below " + rounded(strongest_strain(row) / row.xi_s) +
          " (with xi_s the strain where a bond is strongest), got " + rounded(flow.y[k]));
  }
}

/// The row as numbers, for restart files: members, `limit own`, and the flow table with all its points.
inline std::vector<double> words_of(const Row &row)
{
  std::vector<double> words;
  for (const Member &member : MEMBERS) words.push_back(row.*member.value);
  words.push_back(row.limit_own);
  words.push_back((double) row.flow.n);
  words.insert(words.end(), std::begin(row.flow.p), std::end(row.flow.p));
  words.insert(words.end(), std::begin(row.flow.y), std::end(row.flow.y));
  return words;
}
constexpr int ROW_WORDS = NMEMBERS + 2 + 2 * FlowTable::MOST;

/// The row of words_of(); throws BadInput where it is none.
inline Row row_of_words(const double *words)
{
  Row row;
  for (const Member &member : MEMBERS) row.*member.value = *words++;
  row.limit_own = *words++;
  if (!(*words >= 0.0 && *words <= FlowTable::MOST)) throw BadInput("no such flow table");
  row.flow.n = (int64_t) *words++;
  std::copy_n(words, FlowTable::MOST, row.flow.p);
  std::copy_n(words + FlowTable::MOST, FlowTable::MOST, row.flow.y);
  return row;
}

/// The row; throws BadInput where a member breaks its rule.
inline const Row &checked(const Row &row)
{
  if (row.limit_own != 0.0 && !(row.xi_s < strongest_strain(row)))
    throw BadInput("limit own needs xi_s below " + rounded(strongest_strain(row)) +
                   ", where a bond is strongest, got " + rounded(row.xi_s));
  for (const Member &member : MEMBERS)
    if (is_given(row, member)) member.check(row, &member);
  check_flow(row);
  return row;
}

inline bool operator==(const Row &a, const Row &b)
{
  return a.flow == b.flow && a.limit_own == b.limit_own &&
      std::all_of(std::begin(MEMBERS), std::end(MEMBERS), [&](const Member &member) {
           return a.*member.value == b.*member.value;
         });
}

/// The member with that key, nullptr if there is none.
inline const Member *find_member(const std::string &key)
{
  for (const Member &member : MEMBERS)
    if (key == member.key) return &member;
  return nullptr;
}

/// The keys of some members, or keywords, for messages.
inline std::string keys_of(const Member *first, const Member *last, const char *between)
{
  std::string keys;
  for (; first != last; first++)
    if (first->place == Member::HEAD)
      keys += (keys.empty() ? "" : between) + std::string(first->key);
  return keys;
}

/// "e1 m1 ... alpha", for messages.
inline std::string row_keys()
{
  return keys_of(MEMBERS, MEMBERS + NREQUIRED, " ");
}

}    // namespace EVP
