// SPDX-License-Identifier: GPL-2.0-only
//
// The loop of the timestep over bonds and contacts against PairLaw::state() pair by pair, and what the energy balance
// takes from it.

#include "core/energy/energy_balance.h"
#include "pair_cases.h"

#include <limits>
#include <optional>
#include <utility>

using namespace EVP;
using namespace pair_cases;

namespace {

constexpr double ROUND_OFF = 1e-13;    // of the largest terms

Row scaled(Row row, double energies, double gamma)
{
  row.e1 *= energies;
  row.e2 *= energies * energies;
  row.gamma *= gamma;
  row.xi_s *= 1.2;
  return row;
}

// one law, several with the same exponents, and exponents of their own
const std::vector<std::vector<Row>> LAWS = {
    {TABLE2},
    {with_exponents(6, 3, 6, 3)},
    {with_exponents(4, 2, 4, 2)},
    {with_exponents(2, 1, 2, 1)},
    {with_exponents(12, 6, 12, 6)},
    {with_exponents(9, 5, 9, 5)},
    {with_exponents(8, 4, 6, 3)},
    {with_exponents(8.5, 4.25, 7.5, 2.5)},
    {TABLE2, scaled(TABLE2, 0.5, 0.0), scaled(with_exponents(8, 4, 8, 4), 2.0, 0.3)},
    {TABLE2, with_exponents(6, 3, 4, 2)},
    {with_exponents(9, 5, 9, 5), scaled(with_exponents(9, 5, 9, 5), 0.5, 0.3)}};

struct PairResult {
  double force, damping, elastic, second, at_cutoff, potential, inv_deq_next, spent;
  friend bool operator==(const PairResult &a, const PairResult &b)
  {
    return a.force == b.force && a.damping == b.damping && a.elastic == b.elastic &&
        a.second == b.second && a.at_cutoff == b.at_cutoff && a.potential == b.potential &&
        a.inv_deq_next == b.inv_deq_next && a.spent == b.spent;
  }
};

/// Saves what the kernel says of each pair, and sums it.
struct Saved final : PairConsumer {
  PairSums sums;
  const bool damping;
  std::vector<PairResult> pairs = {};

  Saved(int nreact, bool damping_in, bool incremental = false) :
      sums(nreact, true, true, incremental), damping(damping_in)
  {
  }
  void ask(const PairList &list, BlockLaw::Asked &asked) const override { sums.ask(list, asked); }
  void operator()(const PairRange &range, PairBlock &block) override
  {
    EXPECT_EQ((int) pairs.size(), range.first);
    for (int k = 0; k < block.n; k++) {
      const bool moves = block.flow.any_flow && *block.flow.any_flow;
      pairs.push_back({block.force[k], damping ? block.damping[k] : 0.0, block.elastic[k],
                       block.second[k], block.at_cutoff[k], block.potential[k],
                       moves ? block.flow.inv_deq_next[k] : block.inv_deq[k],
                       moves ? block.flow.dissipated[k] : 0.0});
    }
    sums(range, block);
  }
};

constexpr int ALL = 50, WITHOUT_GHOSTS = 40;    // particles that take reactions

/// By how many boxes a ghost is away from its owner.
double image_of(int j, int c)
{
  return j < WITHOUT_GHOSTS ? 0.0 : (3 * j + c) % 4 - 1;
}

/// What the law says of the pairs of a list, and the sums over them. Errors are measured by sums of the terms' sizes.
struct Expected {
  struct PairScale {
    double force, energy;
  };
  std::vector<PairResult> pairs;
  std::vector<PairScale> scales;
  Vectors f, damping;
  std::vector<double> force_scales;
  double energy = 0.0, energy_scale = 0.0, virial[6] = {}, virial_scale = 0.0;
  std::vector<int> past;
  int interacting = 0, beyond_limit = 0;
  PairWork::Sums work = {};
  double through[6] = {}, damping_through[6] = {};

  Expected(const Cloud &cloud, const PairList &list, bool damped, bool incremental, int nreact) :
      f(ALL, {0, 0, 0}), damping(f), force_scales(ALL, 0.0)
  {
    for_each_pair(list, rows_of(cloud.x), [&](const PlacedPair &p) {
      const PairLaw &law = cloud.laws[p.law];
      const Row &row = law.row;
      const PairState now = law.state(p.ratio(), p);
      const bool is_past = p.is_past_cutoff(), flows = p.flow != Flow::REVERSIBLE;
      PairResult pair = {};
      if (is_past)
        past.push_back(p.index);
      else {
        if (damped)
          pair.damping =
              damping_over_distance(row.gamma, p.g, cloud.v[p.i].data(), cloud.v[p.j].data());
        if (!p.acts()) pair.damping = 0.0;
        pair.force = now.force / p.distance() + pair.damping;
        interacting++;
        beyond_limit += flows ? now.dissipated > 0.0 : now.regime == 2;
      }
      pair.elastic = now.stored.elastic;
      pair.second = now.stored.second;
      if (!flows) pair.at_cutoff = law.state(p.cut * p.inv_deq, {1.0}).stored.total();
      if (!is_past || (flows && incremental)) pair.potential = now.stored.total() - pair.at_cutoff;
      pair.inv_deq_next = p.inv_deq;
      if (flows) {
        pair.inv_deq_next = now.inv_deq;
        pair.spent = now.dissipated;
        if (incremental) pair.potential += now.dissipated;
      }
      pairs.push_back(pair);
      const double scale = row.m1 * row.n1 * row.e1 * p.inv_deq + row.gamma;
      scales.push_back({scale / p.distance(), row.m1 * row.e1});
      add(p, scale, nreact);
    });
  }

  void add(const PlacedPair &p, double scale, int nreact)
  {
    const PairResult &pair = pairs.back();
    const double w = p.j < nreact ? 1.0 : 0.5, g[3] = {p.g.x, p.g.y, p.g.z};
    for (const int i : {p.i, p.j}) force_scales[i] += scale;
    virial_scale += scale * p.distance();
    energy += w * pair.potential;
    energy_scale += scales.back().energy;
    for (int c = 0; c < 6; c++) {
      const int a[6] = {0, 1, 2, 0, 0, 1}, b[6] = {0, 1, 2, 1, 2, 2};
      virial[c] += w * pair.force * g[a[c]] * g[b[c]];
      const int to[6] = {0, 1, 2, 5, 4, 3};    // the other order of the mixed ones
      through[to[c]] += w * pair.force * g[a[c]] * image_of(p.j, b[c]);
      damping_through[to[c]] += w * pair.damping * g[a[c]] * image_of(p.j, b[c]);
    }
    for (int c = 0; c < 3; c++) {
      f[p.i][c] += pair.force * g[c];
      damping[p.i][c] += pair.damping * g[c];
      if (p.j >= nreact) continue;
      f[p.j][c] -= pair.force * g[c];
      damping[p.j][c] -= pair.damping * g[c];
    }
    const double inside = p.is_past_cutoff() ? 0.0 : w;
    (p.is_bond ? work.elastic : work.contacts) += inside * pair.elastic;
    (p.is_bond ? work.second : work.contacts) += inside * pair.second;
    if (p.is_bond)
      work.past_cutoff += (w - inside) * (pair.elastic + pair.second);
    else
      work.contacts_at_cutoff += inside * pair.at_cutoff;
    work.plastic += w * pair.spent;
  }

  void compare(const Saved &found, const Vectors &found_f) const
  {
    ASSERT_EQ(found.pairs.size(), pairs.size());
    for (size_t k = 0; k < pairs.size(); k++) {
      const PairResult &now = found.pairs[k], &law = pairs[k];
      SCOPED_TRACE("pair " + std::to_string(k));
      for (const auto value : {&PairResult::force, &PairResult::damping})
        EXPECT_NEAR(now.*value, law.*value, ROUND_OFF * scales[k].force);
      for (const auto value : {&PairResult::elastic, &PairResult::second, &PairResult::at_cutoff,
                               &PairResult::potential, &PairResult::spent})
        EXPECT_NEAR(now.*value, law.*value, ROUND_OFF * scales[k].energy);
      EXPECT_NEAR(now.inv_deq_next, law.inv_deq_next, 1e-15 * law.inv_deq_next);
    }
    for (size_t i = 0; i < f.size(); i++)
      for (int c = 0; c < 3; c++)
        EXPECT_NEAR(found_f[i][c], f[i][c], ROUND_OFF * force_scales[i]) << "particle " << i;
    EXPECT_NEAR(found.sums.energies.total(), energy, ROUND_OFF * energy_scale);
    for (int c = 0; c < 6; c++)
      EXPECT_NEAR(found.sums.virials[c].total(), virial[c], ROUND_OFF * virial_scale);
  }
};

/// Calls f(cloud, list) for bonds and contacts of eq. 8 and of plasticity.
template <class F> void for_each_list(const std::vector<Row> &rows, int npairs, F &&f)
{
  for (const bool plastic : {false, true}) {
    Cloud cloud(rows, npairs, plastic);
    for (PairList *list : {&cloud.lists.bonds, &cloud.lists.contacts}) {
      SCOPED_TRACE(std::to_string(rows.size()) + " laws, " + name_of(rows.back()) +
                   (plastic ? "plastic " : "") + (list->are_bonds ? "bonds" : "contacts"));
      f(cloud, *list);
    }
  }
}

}    // namespace

// Ghosts, the last ten particles, take no reaction where newton is off, and their pairs count half.
TEST(Kernel, EqualsTheLawPairByPair)
{
  constexpr int SIZE = PairBlock::SIZE, MOST = 600;
  for (const auto &rows : LAWS)
    for (const int npairs : {0, 1, 7, 8, 9, SIZE - 1, SIZE, SIZE + 1, 2 * SIZE, MOST})
      for_each_list(rows, npairs, [&](const Cloud &cloud, PairList &list) {
        ASSERT_EQ((int) list.size(), npairs);
        for (const bool damping : {false, true})
          for (const bool incremental : {false, true})
            for (const int nreact : {ALL, WITHOUT_GHOSTS}) {
              const Expected expected(cloud, list, damping, incremental, nreact);
              Vectors f(ALL, {0, 0, 0});
              EndingBonds ending;
              Saved found(nreact, damping, incremental);
              cloud.add_forces(list, damping, nreact, f, {&ending, &found});
              expected.compare(found, f);
              EXPECT_EQ(ending.found, expected.past);
              if (npairs < MOST) continue;    // control: what is tested is there
              EXPECT_GT(expected.past.size(), 20u);
              EXPECT_GT(expected.beyond_limit, 100);
              EXPECT_GT(expected.interacting - expected.beyond_limit, 50);
            }
      });
}

// A contact that has flowed has a gap from its deq to R_i + R_j, its cutoff; beyond that it rests there again.
TEST(Kernel, EqualsTheLawAtAllDistances)
{
  int gaps = 0, returned = 0, flowed = 0, past = 0;
  for (const Row &row : {TABLE2, with_exponents(7.5, 3.2, 7.5, 3.2)})
    for (const Flow flow : {Flow::REVERSIBLE, Flow::PLASTIC, Flow::PLASTIC_CONTACT})
      for (const double cutoff : {1.0, 1.02, 1.5})
        for (const double limit : {0.0, 0.001, 0.005, 0.05}) {
          const double deq = 0.00973;
          const bool is_contact = flow == Flow::PLASTIC_CONTACT;
          SCOPED_TRACE(name_of(row) + "flow " + std::to_string((int) flow) + ", cutoff " +
                       std::to_string(cutoff) + ", limit " + std::to_string(limit));
          Vectors x = {{0, 0, 0}};
          std::vector<Pair> pairs;
          for (const double r :
               {0.5,    0.9,   0.95,  0.951,  0.994,  0.996, 0.9989, 0.9991, 1.0, 1.0005,
                1.0011, 1.004, 1.006, 1.0199, 1.0201, 1.04,  1.06,   1.4999, 1.6, 3.0}) {
            x.push_back({r * deq, 0, 0});
            pairs.push_back({(int) x.size() - 1, deq, cutoff * deq});
          }
          PairList list(!is_contact);
          list.clear(is_contact ? 0.0 : BOND_MARGIN, flow);
          add_row(list, 0, pairs);
          if (list.is_plastic()) std::fill(list.limit.begin(), list.limit.end(), limit);

          const PairLaw law(row);
          BlockLaw block_law;
          block_law.assign({law}, {0}, flow);
          Vectors f(x.size(), {0, 0, 0});
          Saved found((int) x.size(), false, true);
          accumulate_forces(
              list, block_law,
              {rows_of(x), nullptr, reinterpret_cast<double(*)[3]>(f.data()), (int) x.size()},
              {&found});
          ASSERT_EQ(found.pairs.size(), pairs.size());
          for_each_pair(list, rows_of(x), [&](const PlacedPair &p) {
            const PairState now = law.state(p.ratio(), p);
            const PairResult &in_loop = found.pairs[p.index];
            SCOPED_TRACE("d/deq = " + std::to_string(p.distance() / deq));
            const double off = ROUND_OFF * row.m1 * row.n1 * row.e1;
            EXPECT_NEAR(in_loop.force, p.acts() ? now.force / p.distance() : 0.0,
                        off / (deq * deq));
            EXPECT_NEAR(in_loop.elastic, now.stored.elastic, off);
            EXPECT_NEAR(in_loop.second, now.stored.second, off);
            if (flow == Flow::REVERSIBLE) return;
            EXPECT_NEAR(in_loop.spent, now.dissipated, off);
            EXPECT_NEAR(in_loop.inv_deq_next, now.inv_deq, 1e-15 * now.inv_deq);
            EXPECT_EQ(in_loop.inv_deq_next == p.inv_deq, now.inv_deq == p.inv_deq);
            flowed += now.dissipated > 0.0;
            past += p.is_bond && p.is_past_cutoff();
            if (!is_contact || p.distance() < 1.0001 * deq) return;
            EXPECT_EQ(now.force, 0.0);
            EXPECT_EQ(now.stored.total(), 0.0);
            EXPECT_EQ(now.dissipated, 0.0);
            const bool returns = p.is_past_cutoff() && cutoff > 1.0;
            EXPECT_NEAR(now.inv_deq * deq, returns ? 1.0 / cutoff : 1.0, 1e-15);
            (returns ? returned : gaps)++;
          });
        }
  EXPECT_GT(flowed, 100);
  EXPECT_GT(past, 100);
  EXPECT_GT(gaps, 100);
  EXPECT_GT(returned, 50);
}

// Whatever keeps the others from it.
TEST(Kernel, FindsPairsThatMeetAndThoseThatAreApart)
{
  for_each_list(LAWS.front(), 600, [&](const Cloud &cloud, PairList &list) {
    list.joins = true;
    for (size_t k = 0; k < list.size(); k++) list.join.push_back((char) (k % 3));
    EVP::BeginningBonds begins;
    std::vector<double> ratios;
    EVP::for_each_pair(list, rows_of(cloud.x), [&](const EVP::PlacedPair &p) {
      ratios.push_back(p.g.dsq / p.cutsq);
    });
    std::sort(ratios.begin(), ratios.end());
    begins.within = ratios[200];
    begins.apart = ratios[400];
    std::vector<int> found, released, entered;
    std::vector<double> squared_distances;
    EVP::for_each_pair(list, rows_of(cloud.x), [&](const EVP::PlacedPair &p) {
      if (list.join[p.index] == 0 && p.g.dsq <= begins.within * p.cutsq) {
        found.push_back(p.index);
        squared_distances.push_back(p.g.dsq);
      }
      if (list.join[p.index] == PairList::OF_TWO_BODIES && p.g.dsq <= begins.within * p.cutsq)
        entered.push_back(p.index);
      if ((list.join[p.index] & PairList::NOT_BEFORE_APART) && p.g.dsq > begins.apart * p.cutsq)
        released.push_back(p.index);
    });
    on_each_instruction_set([&] {
      Vectors f(ALL, {0, 0, 0});
      begins.clear();
      cloud.add_forces(list, false, ALL, f, {&begins});
      if (!list.are_bonds && !list.is_plastic()) return;    // blocks without a force are left out
      EXPECT_EQ(begins.found, found);
      EXPECT_EQ(begins.released, released);
      EXPECT_EQ(begins.entered, entered);
      EXPECT_EQ(begins.squared_distances, squared_distances);
    });
    EXPECT_GT(found.size(), 20u);
    EXPECT_GT(released.size(), 20u);
    EXPECT_GT(entered.size(), 20u);
  });
}

// Timesteps with energy and those without must move the particles alike, and so must all machines.
TEST(Kernel, TheSameBitsWithTallyAndOnEveryInstructionSet)
{
  for (const auto &rows : LAWS)
    for_each_list(rows, 600, [&](const Cloud &cloud, PairList &list) {
      for (const bool damping : {false, true}) {
        Vectors base;
        std::optional<Saved> first;
        on_each_instruction_set([&] {
          Vectors bare(ALL, {0, 0, 0}), with_tally = bare;
          cloud.add_forces(list, damping, ALL, bare);
          Saved found(ALL, damping);
          cloud.add_forces(list, damping, ALL, with_tally, {&found});
          if (!first) {
            base = bare;
            first.emplace(found);
          }
          EXPECT_EQ(bare, base);
          EXPECT_EQ(with_tally, base);
          EXPECT_EQ(found.pairs, first->pairs);
          EXPECT_EQ(found.sums.energies.total(), first->sums.energies.total());
          for (int c = 0; c < 6; c++)
            EXPECT_EQ(found.sums.virials[c].total(), first->sums.virials[c].total());
        });
      }
    });
}

// One law for all pairs is looked up nowhere: the same numbers as when each pair names it.
TEST(Kernel, OneLawGivesTheSameBitsAsTheSameLawForEachPair)
{
  Row further = TABLE2;
  further.alpha = 1.6;    // another row, in what the law does not read
  for_each_list({TABLE2, further}, 600, [&](const Cloud &cloud, PairList &list) {
    Vectors each(ALL, {0, 0, 0}), one = each;
    cloud.add_forces(list, true, ALL, each);
    BlockLaw law;
    law.assign(cloud.laws, {1}, list.flow());
    accumulate_forces(list, law, cloud.view(one, ALL, true));
    EXPECT_EQ(one, each);
  });
}

// A blow-up must show.
TEST(Kernel, NonFinitePositionsGiveNonFiniteForces)
{
  for (const auto &rows : {LAWS[0], LAWS[8], LAWS[9]})
    for_each_list(rows, 600, [&](Cloud &cloud, PairList &list) {
      cloud.x[3][1] = std::nan("");
      on_each_instruction_set([&] {
        Vectors f(ALL, {0, 0, 0});
        cloud.add_forces(list, false, ALL, f);
        EXPECT_TRUE(std::isnan(f[3][1]));
      });
    });
}

// Touching spheres in a lattice have neighbors at their cutoff but for the round-off of the positions. There the
// potential is zero, and only past the margin does the pair cease to act.
TEST(Kernel, RoundOffAtTheCutoffDecidesNothing)
{
  const double cutoff = 1.5;
  for (const Row &row : {TABLE2, with_exponents(9, 5, 9, 5)})
    for (const bool is_bond : {false, true})
      for (const double off : {-8 * EPSILON, 0.0, 8 * EPSILON, 1e-10, 1e-8, 1e-6}) {
        SCOPED_TRACE(std::to_string(is_bond) + " " + std::to_string(off));
        const double d = cutoff * (1.0 + off), pull = -PairLaw(row).state(cutoff, {1.0}).force;
        const double x[2][3] = {{0, 0, 0}, {d, 0, 0}};
        Vectors f(2, {0, 0, 0});
        PairList list(is_bond);
        list.clear(is_bond ? BOND_MARGIN : NEW_PAIR_MARGIN, Flow::REVERSIBLE);
        add_row(list, 0, {{1, 1.0, cutoff}});
        EXPECT_NEAR(list.pair(0).cut, cutoff, 4 * EPSILON * cutoff);
        BlockLaw law;
        law.assign({PairLaw(row)}, {0}, list.flow());
        PairSums tally(2, true, false);
        accumulate_forces(list, law, {x, nullptr, reinterpret_cast<double(*)[3]>(f.data()), 2},
                          {&tally});
        EXPECT_NEAR(f[0][0], off < 1e-9 ? pull : 0.0, 1e-8);
        EXPECT_NEAR(tally.energies.total(), off < 1e-9 ? pull * cutoff * off : 0.0, 1e-12);
      }
}

namespace {

/// An evaluation of both lists as the pair style makes it.
Vectors evaluate(Cloud &cloud, PairWork &work, bool damping, int nreact)
{
  Vectors f(ALL, {0.5, 0.25, 1.0});
  work.begin(ALL, cloud.view(f, nreact, damping));
  for (PairList *list : {&cloud.lists.bonds, &cloud.lists.contacts})
    cloud.add_forces(*list, damping, nreact, f, {&work});
  work.finish(cloud.view(f, nreact, damping));
  return f;
}

}    // namespace

// f is that of the loop without the balance, bit by bit, whatever was in it.
TEST(PairWork, SumsWhatTheLawSaysAndSeparatesForces)
{
  for (const auto &rows : LAWS)
    for (const bool plastic : {false, true})
      for (const bool damping : {false, true})
        for (const int nreact : {ALL, WITHOUT_GHOSTS}) {
          SCOPED_TRACE(name_of(rows.back()) + (plastic ? "plastic" : "") +
                       (damping ? ", damped" : ""));
          Cloud cloud(rows, 600, plastic);
          PairLists &lists = cloud.lists;
          Vectors plain(ALL, {0.5, 0.25, 1.0});
          for (PairList *list : {&lists.bonds, &lists.contacts})
            cloud.add_forces(*list, damping, nreact, plain);
          PairWork work;
          work.images.resize(ALL);
          for (int i = 0; i < ALL; i++)
            for (int c = 0; c < 3; c++) work.images[i][c] = image_of(i, c);
          EXPECT_EQ(evaluate(cloud, work, damping, nreact), plain);
          EXPECT_EQ(work.damping.empty(), !damping);

          const Expected bonds(cloud, lists.bonds, damping, false, nreact);
          const Expected contacts(cloud, lists.contacts, damping, false, nreact);
          for (int n = 0; n < 3 * nreact; n++) {
            const int i = n / 3, c = n % 3;
            const double off = ROUND_OFF * (bonds.force_scales[i] + contacts.force_scales[i] + 1.0);
            EXPECT_NEAR(work.force[i][c], bonds.f[i][c] + contacts.f[i][c], off);
            if (damping) {
              EXPECT_NEAR(work.damping[i][c], bonds.damping[i][c] + contacts.damping[i][c], off);
            }
          }
          using Sums = PairWork::Sums;
          const Sums found = work.sums();
          for (const auto value : {&Sums::elastic, &Sums::second, &Sums::contacts,
                                   &Sums::contacts_at_cutoff, &Sums::past_cutoff, &Sums::plastic})
            EXPECT_NEAR(found.*value, bonds.work.*value + contacts.work.*value,
                        ROUND_OFF * (bonds.energy_scale + contacts.energy_scale));
          EXPECT_EQ(found.plastic > 0.0, plastic);
          EXPECT_EQ(found.second > 0.0, !plastic);
          EXPECT_GT(found.past_cutoff, 0.0);
          for (int c = 0; c < 6; c++) {
            const double off = ROUND_OFF * (bonds.virial_scale + contacts.virial_scale);
            EXPECT_NEAR(work.through.whole[c], bonds.through[c] + contacts.through[c], off);
            EXPECT_NEAR(work.through.damping[c],
                        bonds.damping_through[c] + contacts.damping_through[c], off);
            EXPECT_NE(bonds.through[c], 0.0);
          }
        }
}
