// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/text.h"
#include "core/pairs/pairs.h"

#include <algorithm>
#include <string>

namespace EVP {

/// What acts between two particles that were not recorded as a pair.
enum class Contact : int { LITERAL, REPULSIVE, NONE, JOIN };
constexpr const char *CONTACTS[] = {"literal", "repulsive", "none", "join"};    ///< for users

/// A pair that was within the distance where pairs join, without a bond, may join once it has been beyond this times
/// it.
constexpr double APART = 1.05;

/// Contacts between two bodies stay in the first regime up to this strain: solids that touch yield inside. A contact plane
/// has fewer pairs than a plane of the body and would flow first, until the spheres on both sides run into each other.
constexpr double LIMIT_BETWEEN_BODIES = 0.5;

/// With contact join: pairs that come within this times R_i + R_j become bonds; all: those of two bodies too, or those of them that
/// meet a criterion, see joining.
struct JoinRule {
  double within = 0.0;
  bool all = false;
  double exposure = 0.0;    ///< share of the surfaces that must be new; 0: there is no criterion
  double pressure = 0.0;    ///< over the flow stress

  /// Are the same pairs inside?
  bool operator==(const JoinRule &other) const
  {
    return within == other.within && all == other.all;
  }
};

/// Where a pair is at rest, and the distance up to which it acts; nothing where that is 0 [length].
struct Span {
  double deq, cutoff;
};

/// Steps between two updates of plastic strains and limits, unless given: of explicit ones. Those of fix nve/evp are longer,
/// and each is followed by an update.
constexpr int UPDATE_EVERY = 10;

/// The settings of the pair style that hold for all pairs: what bonds do beyond their law, and what pairs do that are
/// no bonds.
struct PairRules {
  Contact contact = Contact::LITERAL;
  double overlap = 0.3;         ///< warn below d = (1 - overlap) (R_i + R_j)
  bool plastic = false;         ///< plasticity isotropic: flow beyond the elastic limit stays
  double break_strain = 0.0;    ///< of eq. 8 bonds break beyond (1 + this) deq; 0: never
  JoinRule join = {1.2};        ///< used with contact join
  int update = 0;    ///< steps between two updates of plastic strains and limits; 0: not given

  bool joins() const { return contact == Contact::JOIN; }
  bool breaks() const { return break_strain > 0.0; }

  /// Do pairs of two bodies join by a criterion, and not as soon as they are near?
  bool asks_to_join() const { return joins() && join.exposure > 0.0; }
  bool joins_bodies_at_once() const { return join.all && !asks_to_join(); }

  int update_every(bool implicit) const { return update ? update : implicit ? 1 : UPDATE_EVERY; }

  /// Do bonds flow, or end?
  bool has_history() const { return plastic || breaks(); }

  Flow flow_of_bonds() const { return plastic ? Flow::PLASTIC : Flow::REVERSIBLE; }
  Flow flow_of_contacts() const { return plastic ? Flow::PLASTIC_CONTACT : Flow::REVERSIBLE; }

  /// dlim: alpha (R_i + R_j).
  Span of_bond(double deq, double dlim) const
  {
    return {deq, breaks() ? std::min(dlim, (1.0 + break_strain) * deq) : dlim};
  }

  /// Of a pair that was never a bond. Those of two bodies only repel.
  Span of_contact(double sum_radii, double dlim, bool in_different_bodies) const
  {
    if (contact == Contact::NONE) return {sum_radii, 0.0};
    return {sum_radii, only_repels(in_different_bodies) ? sum_radii : dlim};
  }
  bool only_repels(bool in_different_bodies) const
  {
    return contact == Contact::REPULSIVE || contact == Contact::JOIN || in_different_bodies;
  }

  /// What is left of a bond that ended at d repels below R_i + R_j, or, where the spheres still overlap there, below d: its
  /// end makes no force and no energy. Of eq. 8 it ends at (1 + XI) deq.
  Span of_ended(double sum_radii, double d) const
  {
    const double rest = std::min(sum_radii, d);
    return {rest, contact == Contact::NONE ? 0.0 : plastic ? sum_radii : rest};
  }

  /// Margin of the cutoffs of contacts. One that only repels has no force there but that of damping: spheres that touch do
  /// not interact.
  double contact_margin(bool in_different_bodies, bool any_damping) const
  {
    if (!only_repels(in_different_bodies)) return NEW_PAIR_MARGIN;
    return any_damping ? -NEW_PAIR_MARGIN : 0.0;
  }
};

/// Which atoms are one body: all, those of one type, or those of one molecule. Pairs of two bodies are not recorded, and
/// only repel.
enum class BodyRule : int { ALL, TYPE, MOLECULE };
constexpr const char *BODY_RULES[] = {"all", "type", "molecule"};    ///< users give the last two

/// Throws BadInput.
inline BodyRule parse_body_rule(const std::string &word)
{
  for (const BodyRule one : {BodyRule::TYPE, BodyRule::MOLECULE})
    if (word == BODY_RULES[(int) one]) return one;
  throw BadInput("within must be type or molecule (which atoms are one body), got '" + shown(word) +
                 "'");
}

}    // namespace EVP
