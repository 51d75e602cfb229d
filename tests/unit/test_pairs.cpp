// SPDX-License-Identifier: GPL-2.0-only
//
// Lists of pairs and what changes with them; where pairs are at rest and how far they act.

#include "core/pairs/contacts.h"
#include "pair_cases.h"

#include <algorithm>
#include <cmath>

using namespace EVP;
using namespace pair_cases;

namespace {

/// All that a list says of its pairs, with their particles.
struct Known {
  int i, j, law;
  double inv_deq, cutsq;
  friend bool operator==(const Known &a, const Known &b)
  {
    return a.i == b.i && a.j == b.j && a.law == b.law && a.inv_deq == b.inv_deq &&
        a.cutsq == b.cutsq;
  }
};

std::vector<Known> contents_of(const PairList &list, const Vectors &x)
{
  std::vector<Known> found;
  for_each_pair(list, rows_of(x), [&](const PlacedPair &p) {
    found.push_back({p.i, p.j, p.law, p.inv_deq, p.cutsq});
    EXPECT_EQ(list.owner_of(p.index), p.i);
  });
  return found;
}

}    // namespace

TEST(AtomValues, EachParticleHasItsOwn)
{
  AtomValues values(2, 3, 0.5);
  const double block[] = {1.0, 2.0, 3.0, 4.0};
  values.set_first(2, block);
  values[2][1] = 6.0;
  EXPECT_EQ(std::vector<double>(values.begin(), values.end()),
            (std::vector<double>{1.0, 2.0, 3.0, 4.0, 0.5, 6.0}));
  EXPECT_EQ(values.column(1).of(1), 4.0);
  EXPECT_EQ(values.flat(4), 0.5);

  values.resize(4);
  EXPECT_EQ(values.size(), 4u);
  EXPECT_EQ(values.numbers(), 8u);
  EXPECT_EQ(values[3], values.end() - 2);
  EXPECT_EQ(values[3][0], 0.0);

  values.set_width(2);
  EXPECT_EQ(values.size(), 4u) << "the same width";
  values.set_width(3);
  EXPECT_TRUE(values.empty());
  values.assign(2, 7.0);
  EXPECT_EQ(values.rows()[1][2], 7.0);
}

TEST(PairList, PairsAreTakenOutAndAddedInARun)
{
  std::mt19937 random(3);
  for (const bool plastic : {false, true})
    for (const int outof : {1, 2, 7, 100}) {
      SCOPED_TRACE(std::to_string(plastic) + ", one out of " + std::to_string(outof));
      Cloud cloud({TABLE2, TABLE2}, 600, plastic);
      PairList &list = cloud.lists.bonds;
      std::vector<Known> left = contents_of(list, cloud.x);
      ASSERT_EQ(left.size(), 600u);
      std::vector<int> out;
      for (int k = 0; k < 600; k++)
        if (random() % outof == 0) out.push_back(k);
      list.remove(out);
      for (auto k = out.rbegin(); k != out.rend(); ++k) left.erase(left.begin() + *k);
      EXPECT_EQ(list.size(), left.size());
      EXPECT_EQ(contents_of(list, cloud.x), left);
      for (const PackedRow &row : list.rows) EXPECT_LT(row.first, row.last);

      // the list goes on
      add_row(list, 7, {{9, 1.0, 1.5, 1}, {30, 1.0, 1.5}});
      EXPECT_EQ(list.size(), left.size() + 2);
      EXPECT_EQ(list.pair(left.size()).j, 9);
      EXPECT_EQ(list.owner_of((int) left.size()), 7);
    }
}

TEST(PairList, WithoutFlowThereIsNoRoomForIt)
{
  Cloud cloud({TABLE2}, 600, true);
  PairList &list = cloud.lists.bonds;
  const double with_flow = list.memory_usage();
  EXPECT_TRUE(list.pair(1).flow == Flow::PLASTIC);
  list.clear(BOND_MARGIN, Flow::REVERSIBLE);
  EXPECT_EQ(list.size(), 0u);
  EXPECT_TRUE(list.make_room(600));
  for (const auto *values : {&list.inv_deq_next, &list.dissipated})
    EXPECT_EQ(values->capacity(), 0u);
  EXPECT_EQ(list.any_flow.capacity(), 0u);
  EXPECT_LE(list.memory_usage() + 2 * 600 * sizeof(double), with_flow);
  EXPECT_EQ(list.flow_arrays(0).dissipated, nullptr);
}

TEST(PairList, PairsAreCountedWithoutAWrap)
{
  PairList list(true);
  EXPECT_FALSE(list.make_room(PairList::MOST + 1));
  EXPECT_FALSE(list.make_room(std::numeric_limits<size_t>::max()));
  add_row(list, 0, {{1, 1.0, 1.5}});
  EXPECT_FALSE(list.make_room(PairList::MOST));
  EXPECT_LT(PairList::MOST + 4 * BLOCK_SIZE, (size_t) std::numeric_limits<int>::max());
}

TEST(Margins, LetNoPairFallBetweenTwoDecisions)
{
  EXPECT_LT(NEW_PAIR_MARGIN, RECORD_MARGIN) << "what is just not recorded is no new pair";
  EXPECT_LT(RECORD_MARGIN, BOND_MARGIN) << "what is recorded acts";
  EXPECT_LT(BOND_MARGIN, LIST_MARGIN) << "and the neighbor list holds it";

  // spheres that touch do not interact; of a literal pair at dlim round-off decides nothing
  PairRules rules;
  EXPECT_EQ(rules.contact_margin(false, true), NEW_PAIR_MARGIN);
  EXPECT_EQ(rules.contact_margin(true, false), 0.0);
  rules.contact = Contact::REPULSIVE;
  for (const bool in_different_bodies : {false, true}) {
    EXPECT_EQ(rules.contact_margin(in_different_bodies, true), -NEW_PAIR_MARGIN);
    EXPECT_EQ(rules.contact_margin(in_different_bodies, false), 0.0);
  }
}

TEST(PairRules, SayWherePairsAreAtRestAndHowFarTheyAct)
{
  constexpr double SUM = 2.0, DLIM = 3.0, DEQ = 2.2;
  struct Case {
    Contact contact;
    double within, between;    // cutoffs of contacts in one body and of two
  };
  for (const auto &[contact, within, between] : {Case{Contact::LITERAL, DLIM, SUM},
                                                 {Contact::REPULSIVE, SUM, SUM},
                                                 {Contact::NONE, 0.0, 0.0}}) {
    PairRules rules;
    rules.contact = contact;
    EXPECT_EQ(rules.of_contact(SUM, DLIM, false).cutoff, within);
    EXPECT_EQ(rules.of_contact(SUM, DLIM, true).cutoff, between);
    EXPECT_EQ(rules.of_contact(SUM, DLIM, true).deq, SUM);
    EXPECT_EQ(rules.of_bond(DEQ, DLIM).deq, DEQ);
    EXPECT_EQ(rules.of_bond(DEQ, DLIM).cutoff, DLIM);
    EXPECT_FALSE(rules.has_history());
    EXPECT_TRUE(rules.flow_of_bonds() == Flow::REVERSIBLE &&
                rules.flow_of_contacts() == Flow::REVERSIBLE);
    rules.break_strain = 0.1;
    EXPECT_EQ(rules.of_bond(DEQ, DLIM).cutoff, 1.1 * DEQ);
    EXPECT_EQ(rules.of_bond(2.9, DLIM).cutoff, DLIM);
    // what is left repels up to R_i + R_j, or to where it ended if that is nearer
    for (const auto &[d, rest] : {std::pair(DEQ, SUM), {1.5, 1.5}}) {
      EXPECT_EQ(rules.of_ended(SUM, d).deq, rest);
      EXPECT_EQ(rules.of_ended(SUM, d).cutoff, contact == Contact::NONE ? 0.0 : rest);
    }
    EXPECT_TRUE(rules.has_history());
    rules = {contact, 0.3, true};
    EXPECT_TRUE(rules.has_history());
    // it is like any other once it has been beyond R_i + R_j
    EXPECT_EQ(rules.of_ended(SUM, 1.5).deq, 1.5);
    EXPECT_EQ(rules.of_ended(SUM, 1.5).cutoff, contact == Contact::NONE ? 0.0 : SUM);
    EXPECT_TRUE(rules.flow_of_bonds() == Flow::PLASTIC &&
                rules.flow_of_contacts() == Flow::PLASTIC_CONTACT);
  }
}
