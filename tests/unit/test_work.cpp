// SPDX-License-Identifier: GPL-2.0-only
//
// What the force loop finds for the energy balance: energies with and without offsets, flow, forces.

#include "core/work_tally.h"
#include "kernel_cases.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using EVP::Law;
using EVP::Row;
using EVP::StoredEnergy;
using kernel_cases::Cloud;
using kernel_cases::Vectors;
using Exact = long double;

namespace {

const std::vector<Row> ROWS = {
    {80, 8, 4, 3, 8, 4, 0.005, 1000, 1.5}, {80, 6, 3, 3, 6, 3, 0.005, 7, 1.5},
    {80, 4, 2, 3, 4, 2, 0.012, 7, 1.5},    {80, 2, 1, 3, 2, 1, 0.005, 7, 1.5},
    {80, 12, 6, 3, 12, 6, 0.005, 7, 1.5},  {80, 7.5, 3.2, 3, 7.5, 3.2, 0.005, 7, 1.5},
    {80, 8, 4, 3, 6, 3, 0.012, 7, 2.0},
};

// one regime at r = d/deq, in the arithmetic of 64 bits
Exact phi(Exact e, Exact m, Exact n, Exact r)
{
  return e * (n * std::pow(r, -m) - m * std::pow(r, -n)) / (m - n);
}
Exact force(Exact e, Exact m, Exact n, Exact r)    // times deq
{
  return m * n * e / (m - n) * (std::pow(r, -m - 1) - std::pow(r, -n - 1));
}
Exact phi_2(const Row &r, Exact p)
{
  return phi(r.e2, r.m2, r.n2, 1 + p) + r.e2;
}
Exact force_2(const Row &r, Exact p)
{
  return force(r.e2, r.m2, r.n2, 1 + p);
}

/// Psi of model and dissipation, as they are defined.
Exact psi_first(const Row &r, Exact elastic)
{
  return phi(r.e1, r.m1, r.n1, 1 + elastic) + r.e1;
}
Exact psi_hardening(const Row &r, Exact elastic, Exact p)
{
  return phi_2(r, p) - force_2(r, p) * elastic;
}
Exact dissipated(const Row &r, Exact p0, Exact p1)
{
  const Exact ds = p1 > p0 ? r.xi_s : -r.xi_s;
  return -force(r.e1, r.m1, r.n1, 1 + ds) * (p1 - p0) + (force_2(r, p1) - force_2(r, p0)) * ds;
}

/// A cloud whose pairs have offsets and their next ones after the return map.
struct Flowing {
  Cloud cloud;
  std::vector<double> deq, offset, next, cap, unused;
  std::vector<char> moves;
  explicit Flowing(const std::vector<Row> &rows) : cloud(kernel_cases::make_cloud(rows, 700))
  {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    cloud.list.nall = (int) cloud.x.size();
    const auto x = reinterpret_cast<const double(*)[3]>(cloud.x.data());
    EVP::for_each_pair(cloud.list, x, [&](const EVP::PlacedPair &p) {
      const double xi_s = cloud.laws[p.law].parameters().xi_s;
      deq.push_back(1.0 / p.inv_deq);
      const double xi = (p.distance() - deq.back()) / deq.back(), q = 0.02 * unit(random);
      offset.push_back(p.is_bond() ? q : std::min(q, 0.0));
      const double mapped = std::clamp(offset.back(), xi - xi_s, xi + xi_s);
      next.push_back(p.is_beyond() ? offset.back() : p.is_bond() ? mapped : std::min(mapped, 0.0));
      cap.push_back(cloud.laws[p.law].cap(p.is_bond(), false));
    });
    unused.resize(deq.size());
    moves.resize(deq.size() / EVP::BLOCK_SIZE + 1);
  }

  EVP::PairWork work;
  Vectors run(EVP::Level level, bool flows, bool damps, int nreact)
  {
    Vectors f(cloud.x.size(), {0.5, 0.25, 1.0});
    const auto distances = [this] {
      return deq;
    };
    const EVP::BlockLaw law = kernel_cases::block_law(cloud, level);
    EVP::ParticleView view = cloud.view(f, nreact);
    if (flows)
      view.histories.flow = {offset.data(), unused.data(), cap.data(),
                             next.data(),   unused.data(), moves.data()};
    work.forget();
    if (damps)
      work.accumulate_forces<true>(cloud.list, law, view, EVP::NoTally(), distances);
    else
      work.accumulate_forces<false>(cloud.list, law, view, EVP::NoTally(), distances);
    return f;
  }
};

std::vector<EVP::Level> levels()
{
  std::vector<EVP::Level> found = {EVP::Level::BASE};
  if (EVP::best_level() != EVP::Level::BASE) found.push_back(EVP::Level::AVX2);
  if (EVP::best_level() == EVP::Level::AVX512) found.push_back(EVP::Level::AVX512);
  return found;
}

std::vector<std::vector<Row>> mixtures()
{
  std::vector<std::vector<Row>> found;
  for (const Row &row : ROWS) {
    Row other = row;
    other.e1 *= 1.5;
    other.xi_s *= 0.5;
    found.push_back({row});
    found.push_back({row, other});
  }
  found.push_back({ROWS[0], ROWS[5]});
  return found;
}

}    // namespace

TEST(Flow, StoresAndDissipatesWhatIsDefined)
{
  for (const Row &row : ROWS) {
    const Law law(row);
    for (const double p : {-0.1, -0.011, -1e-3, 0.0, 2e-3, 0.03, 0.4})
      for (const double share : {-1.0, -0.6, 0.3, 1.0}) {
        const double deq = 0.0117, d = deq * (1.0 + p + share * row.xi_s);
        const EVP::Stored found = law.stored(d, deq, p);
        const Exact elastic = ((Exact) d - deq) / deq - p;
        EXPECT_NEAR(found.first, (double) psi_first(row, elastic), 1e-12 * found.first);
        const double scale =
            (double) phi_2(row, p) + std::fabs((double) (force_2(row, p) * elastic));
        EXPECT_NEAR(found.hardening, (double) psi_hardening(row, elastic, p),
                    1e-12 * scale + 1e-17);
        EXPECT_EQ(found.second, 0.0);
        for (const double flow : {1e-13, 1e-7, 1e-3, 0.05}) {
          const double next = p + flow * (share > 0 ? 1 : -1);
          const Exact expected = dissipated(row, p, next);
          EXPECT_GT(expected, 0.0L);
          EXPECT_NEAR(law.dissipated(p, next), (double) expected,
                      2e-13 * (double) expected + 1e-18 * row.e2);
        }
      }
  }
}

TEST(Flow, WithoutOffsetIsTheFirstRegime)
{
  const Law law(ROWS[0]);
  for (const double xi : {-0.004, -1e-9, 3e-6, 0.005}) {
    const double d = 0.0117 * (1.0 + xi);
    EXPECT_EQ(law.stored(d, 0.0117, 0.0).total(), law.stored(d, 0.0117).total());
  }
}

// Below lowest_offset(), and of a second regime that is the stiffer, flow sets energy free.
TEST(Flow, DissipatesAboveTheLowestOffset)
{
  const Law law(ROWS[0]), stiffer({3, 8, 4, 80, 8, 4, 0.005, 0, 1.5});
  const double lowest = law.lowest_offset();
  EXPECT_NEAR(lowest, -0.238, 5e-4);
  EXPECT_GT(law.dissipated(lowest + 1e-4, lowest + 5e-5), 0.0);
  EXPECT_LT(law.dissipated(lowest - 5e-5, lowest - 1e-4), 0.0);
  EXPECT_LT(dissipated(ROWS[0], -0.3L, -0.31L), 0.0L);
  EXPECT_EQ(law.dissipated(0.1, 0.1), 0.0);
  EXPECT_NO_THROW(law.check_flow(false));
  EXPECT_THROW(stiffer.check_flow(false), EVP::BadInput);
}

// Nothing holds a second regime that has no first; without either no force acts.
TEST(Flow, NeedsAFirstRegimeWhereThereIsASecond)
{
  EXPECT_THROW(Law({0, 8, 4, 3, 8, 4, 0.005, 0, 1.5}).check_flow(false), EVP::BadInput);
  EXPECT_NO_THROW(Law({0, 8, 4, 0, 8, 4, 0.005, 0, 1.5}).check_flow(false));
  EXPECT_NO_THROW(Law({80, 8, 4, 0, 8, 4, 0.005, 0, 1.5}).check_flow(false));
  EXPECT_EQ(Law().lowest_offset(), -1.0);
}

// At any alpha at which pairs may flow, a contact to dlim is none that ends at rest.
TEST(Flow, TellsContactsThatOnlyRepel)
{
  const double sum_radii = 0.01, inv_deq = 1.0 / sum_radii;
  const auto cutsq = [&](double alpha, double margin) {
    return EVP::reach_squared(alpha * sum_radii, margin);
  };
  for (const double margin : {-EVP::NEW_PAIR_MARGIN, 0.0, EVP::NEW_PAIR_MARGIN}) {
    EXPECT_TRUE(EVP::only_repels(cutsq(1.0, margin), inv_deq));
    for (const double above : {2e-16, 1e-9, 9e-9, 1.1e-8, 1e-7, 4e-7, 1e-3}) {
      const double alpha = 1.0 + above;
      const Law law({80, 8, 4, 3, 8, 4, 0.005, 0, alpha});
      SCOPED_TRACE(above);
      if (above < 1e-8)
        EXPECT_THROW(law.check_flow(false), EVP::BadInput);
      else {
        EXPECT_NO_THROW(law.check_flow(false));
        EXPECT_THROW(law.check_flow(true), EVP::BadInput) << "up to 1 + xi_s";
        EXPECT_FALSE(EVP::only_repels(cutsq(alpha, margin), inv_deq));
      }
    }
  }
}

// -F dd = dPsi + D along eight reversals, by parts that are elastic or flow.
TEST(Flow, WorkIsStoredOrDissipated)
{
  for (const Row &row : ROWS) {
    const Law law(row);
    double p = 0.0, spent = 0.0, xi = 0.0;
    Exact work = 0.0;
    for (const double to : {0.03, -0.02, 0.06, 0.01, 0.05, -0.04, 0.0, 0.02}) {
      const double ds = to > xi ? row.xi_s : -row.xi_s;
      const double turn = p + ds;    // where flow begins
      const bool flows = to > xi ? to > turn : to < turn;
      const double end = flows ? turn : to;
      work += psi_first(row, (Exact) end - p) - psi_first(row, (Exact) xi - p) -
          force_2(row, p) * ((Exact) end - xi);
      if (flows) {
        const double next = to - ds;
        work += -force(row.e1, row.m1, row.n1, 1 + (Exact) ds) * ((Exact) next - p) +
            phi_2(row, next) - phi_2(row, p);
        spent += law.dissipated(p, next);
        p = next;
      }
      xi = to;
      const double held = law.stored(1.0 + xi, 1.0, p).total();
      EXPECT_NEAR(held + spent, (double) work, 1e-12 * (double) work);
    }
    EXPECT_GT(spent, 0.0);
  }
}

// every instruction set and exponent, one and two laws, with and without offsets
TEST(PairWork, BlocksSumWhatTheLawSaysPairByPair)
{
  for (const auto &rows : mixtures())
    for (const bool flows : {false, true}) {
      Flowing bodies(rows);
      const int nreact = 40;
      StoredEnergy::Sums plain{};
      int flowing = 0, stretched_contacts = 0;
      const auto x = reinterpret_cast<const double(*)[3]>(bodies.cloud.x.data());
      EVP::for_each_pair(bodies.cloud.list, x, [&](const EVP::PlacedPair &pair) {
        const Law &law = bodies.cloud.laws[pair.law];
        const double w = pair.j < nreact ? 1.0 : 0.5, d = std::min(pair.distance(), pair.cut);
        const double deq = bodies.deq[pair.index], xi = (d - deq) / deq;
        const double xi_s = law.parameters().xi_s, offset = bodies.offset[pair.index];
        const double p = std::clamp(offset, xi - xi_s, xi + xi_s);
        if (pair.is_beyond()) {    // a contact that has flowed does so up to its end
          if (flows && !pair.is_bond() && offset < 0.0)
            plain.plastic += w * std::max(0.0, law.dissipated(offset, std::min(p, 0.0)));
          return;
        }
        const bool is_eq_8 = !flows || (!pair.is_bond() && p > 0.0);
        const EVP::Stored now = is_eq_8 ? law.stored(d, deq) : law.stored(d, deq, p);
        stretched_contacts += !pair.is_bond() && p > 0.0;
        (pair.is_bond() ? plain.first : plain.contacts) +=
            w * (pair.is_bond() ? now.first : now.total());
        if (pair.is_bond()) {
          plain.second += w * now.second;
          plain.hardening += w * now.hardening;
        }
        if (flows) plain.plastic += w * law.dissipated(offset, bodies.next[pair.index]);
        flowing += bodies.next[pair.index] != offset;
      });
      EXPECT_GT(flowing, 100);
      EXPECT_GT(stretched_contacts, 10);
      StoredEnergy::Sums base{};
      for (const EVP::Level level : levels()) {
        bodies.run(level, flows, false, nreact);
        const StoredEnergy::Sums found = bodies.work.stored.sums();
        const double all = plain.first + plain.second + plain.contacts + plain.hardening;
        EXPECT_NEAR(found.first, plain.first, 1e-13 * plain.first);
        EXPECT_NEAR(found.second, plain.second, 1e-13 * all);
        EXPECT_NEAR(found.contacts, plain.contacts, 1e-13 * all);
        EXPECT_NEAR(found.hardening, plain.hardening, 1e-13 * all);
        EXPECT_NEAR(found.plastic, plain.plastic, 1e-13 * plain.plastic);
        if (level == EVP::Level::BASE) base = found;
        EXPECT_EQ(found.first, base.first);
        EXPECT_EQ(found.second, base.second);
        EXPECT_EQ(found.contacts, base.contacts);
        EXPECT_EQ(found.hardening, base.hardening);
        EXPECT_EQ(found.plastic, base.plastic);
        EXPECT_EQ(found.bonds_depth.rest, base.bonds_depth.rest);
      }
    }
}

// f is that of the loop without the balance, bit by bit, whatever was in it
TEST(PairWork, SeparatesForcesAndChangesNone)
{
  for (const auto &rows : mixtures())
    for (const bool damps : {false, true}) {
      Flowing bodies(rows);
      const int nreact = (int) bodies.cloud.x.size();
      const EVP::BlockLaw law = kernel_cases::block_law(bodies.cloud);
      Vectors f(bodies.cloud.x.size(), {0.5, 0.25, 1.0});
      if (damps)
        EVP::accumulate_forces<true>(bodies.cloud.list, law, bodies.cloud.view(f, nreact),
                                     EVP::NoTally());
      else
        EVP::accumulate_forces<false>(bodies.cloud.list, law, bodies.cloud.view(f, nreact),
                                      EVP::NoTally());
      EXPECT_EQ(bodies.run(EVP::best_level(), false, damps, nreact), f);

      const auto whole = kernel_cases::plain_sum(bodies.cloud, damps, nreact);
      const auto undamped = kernel_cases::plain_sum(bodies.cloud, false, nreact);
      EXPECT_EQ(bodies.work.damping.empty(), !damps);
      for (size_t i = 0; i < f.size(); i++)
        for (int c = 0; c < 3; c++) {
          const double off = 1e-13 * (whole.force_scale[i] + 1.0);
          EXPECT_NEAR(bodies.work.force[3 * i + c], whole.f[i][c], off);
          if (damps) {
            EXPECT_NEAR(bodies.work.damping[3 * i + c], whole.f[i][c] - undamped.f[i][c], off);
          }
        }
    }
}

// a command that tries out something at the same step does not count
TEST(PairWork, TheFirstEvaluationOfAStepCounts)
{
  Flowing bodies({ROWS[0]});
  const int nreact = (int) bodies.cloud.x.size();
  bodies.run(EVP::best_level(), false, false, nreact);
  const double first = bodies.work.stored.sums().first;
  Vectors f(bodies.cloud.x.size()), moved = bodies.cloud.x;
  for (auto &x : moved) x[0] *= 1.001;
  const EVP::ParticleView view = {reinterpret_cast<const double(*)[3]>(moved.data()), nullptr,
                                  reinterpret_cast<double(*)[3]>(f.data()), nreact};
  const EVP::BlockLaw law = kernel_cases::block_law(bodies.cloud);
  const auto evaluate = [&] {
    bodies.work.accumulate_forces<false>(bodies.cloud.list, law, view, EVP::NoTally(), [&] {
      return bodies.deq;
    });
  };
  evaluate();
  EXPECT_EQ(bodies.work.stored.sums().first, first);
  EXPECT_TRUE(bodies.work.take());
  EXPECT_FALSE(bodies.work.take());
  evaluate();
  EXPECT_NE(bodies.work.stored.sums().first, first);
}
