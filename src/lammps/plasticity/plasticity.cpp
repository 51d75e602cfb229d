// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/plasticity/plasticity.h"

#include "atom.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace EVP {

// what ghosts have summed; bonds that have ended wait until the records are told
void Plasticity::collect_sums()
{
  const int nlocal = pairs.lists().nlocal;
  pairs.exchange().reverse_comm(sums.values);
  work.resize(nlocal);
  for (int i = 0; i < nlocal; i++) {
    work[i] = std::exchange(sums.of(i, FlowSums::WORK), 0.0);
    Sphere &own = pairs.store().sphere(i);
    own.slip += std::exchange(sums.of(i, FlowSums::SLIP), 0.0);
    own.work += work[i];
  }
  pairs.effects.for_each([&](Effect &other) {
    other.add_plastic_work(work);
  });
  std::fill(sums.values[nlocal], sums.values.end(), 0.0);
}

void Plasticity::update_effect()
{
  BondStore &store = pairs.store();
  were_given = store.has_given();
  const int nlocal = pairs.lists().nlocal;
  std::vector<double> shares(nlocal, 1.0);
  pairs.effects.for_each([&](const Effect &other) {
    other.multiply_hardening(shares);
  });
  for (int i = 0; i < nlocal; i++)
    store.sphere(i).move_on((double) store.of(i).size() - sums.of(i, FlowSums::ENDED), shares[i]);
  pairs.effects.for_each([&](Effect &other) {
    other.strains_updated(store, true);
  });
  if (!were_given) return;
  for (int i = 0; i < nlocal; i++)
    if (store.given(i) >= 0.0) store.sphere(i).p = store.given(i);
  store.keep_given(false);
  pairs.effects.for_each([&](Effect &other) {
    other.strains_updated(store, false);
  });
}

void Plasticity::put_shared(Sharing, const ValuesOfAtoms &values) const
{
  std::vector<double> factors(pairs.lists().nlocal, 1.0);
  pairs.effects.for_each([&](const Effect &other) {
    other.multiply_limits(factors);
  });
  std::vector<double> of_bonds(weakens() ? factors.size() : 0, 1.0);
  if (!of_bonds.empty())
    pairs.effects.for_each([&](const Effect &other) {
      other.multiply_limits_of_bonds(of_bonds);
    });
  for (int i = 0; i < pairs.lists().nlocal; i++) {
    const double p = pairs.store().sphere(i).p, limit = pairs.limit_of(i)(p, factors[i]);
    values[i][0] = of_bonds.empty() ? limit : limit * of_bonds[i];
    if (!of_bonds.empty()) values[i][1] = limit;
  }
}

void Plasticity::set_shared(Sharing when, const ValuesOfAtoms &values)
{
  PairLists &lists = pairs.lists();
  const bool apart = weakens();
  lists.limits.resize(lists.nall);
  lists.contact_limits.resize(apart ? lists.nall : 0);
  for (int i = 0; i < lists.nall; i++) {
    lists.limits[i] = values[i][0];
    if (apart) lists.contact_limits[i] = values[i][1];
  }
  set_limits(when != Sharing::PACKED);
}

// Of pairs, by those of the spheres. keeps_below: where they have become smaller, flow brings the pair below them
void Plasticity::set_limits(bool keeps_below)
{
  PairLists &lists = pairs.lists();
  double dissipated = 0.0;
  if (keeps_below)
    step_work.begin(lists, pairs.effects, pairs.exchange());
  else
    step_work.skip();
  for (PairList *list : {&lists.bonds, &lists.contacts}) {
    for (const PackedRow &row : list->rows)
      for (int n = row.first; n < row.last; n++) {
        const double own = pairs.coefficients().law(list->law[n]).own_limit;
        const double now = lists.limit_of(*list, own, row.i, list->j[n]);
        const double before = std::exchange(list->limit[n], now);
        if (keeps_below && now < before) dissipated += keep_below_limit(*list, row.i, n, before);
      }
  }
  if (dissipated > 0.0)
    pairs.effects.for_each([&](Effect &other) {
      other.add_dissipated(dissipated);
    });
}

// At the distance of now: what a pair stores beyond its limit is dissipated. It adds to the plastic strain, but not to one that was
// given. Returns the part of this MPI rank
double Plasticity::keep_below_limit(PairList &list, int i, int n, double before)
{
  const int nreact = pairs.lists().nreact;
  const PackedPair pair = list.pair(n);
  const PlacedPair p{pair, i, n, n, PairGeometry(pairs.positions(), i, pair.j)};
  const PairLaw &law = pairs.law_of(p);
  PairVariables was = p;
  was.limit = before;
  const PairState then = law.state(p.ratio(), was), now = law.state(p.ratio(), p);
  if (now.inv_deq == p.inv_deq) return 0.0;
  const double dissipated = then.dissipated + then.stored.elastic - now.stored.elastic;
  if (p.is_bond && !were_given)
    sums.add(i, p.j, nreact, FlowSums::SLIP, std::fabs(log_of_ratio(now.inv_deq, p.inv_deq)));
  sums.add(i, p.j, nreact, FlowSums::WORK, 0.5 * dissipated);
  list.inv_deq[n] = now.inv_deq;
  return rank_share(p.j, nreact) * (dissipated - step_work.of(p, then.force - now.force));
}

void Plasticity::commit()
{
  PairLists &lists = pairs.lists();
  for (PairList *list : {&lists.bonds, &lists.contacts}) commit_flow(*list, lists.nreact, sums);
}

void Plasticity::unlisted_bonds_end(const std::vector<UnlistedBond> &bonds)
{
  for (const UnlistedBond &bond : bonds) {
    sums.of(bond.i, FlowSums::ENDED) += 1.0;
    sums.of(bond.i, FlowSums::WORK) += 0.5 * bond.state.dissipated;
    sums.of(bond.i, FlowSums::SLIP) += std::fabs(log_of_ratio(bond.state.inv_deq, 1.0 / bond.deq));
  }
}

void Plasticity::return_to_records(bool are_due)
{
  if (!are_due) return;
  collect_sums();
  for (int i = 0; i < pairs.lists().nlocal; i++) sums.of(i, FlowSums::ENDED) = 0.0;
}

}    // namespace EVP
