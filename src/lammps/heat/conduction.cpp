// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/heat/conduction.h"

#include "core/heat/heat.h"
#include "core/timestep/stiffness_matrix.h"
#include "lammps/base/collective.h"
#include "lammps/base/scene.h"

#include "atom.h"
#include "domain.h"
#include "update.h"

#include <algorithm>
#include <cmath>

namespace EVP {

void Conduction::find_links(const PairLists &lists, const std::vector<Row> &rows, int groupbit)
{
  const int nall = lists.nall, *const type = atom->type;
  nreact = lists.nreact;
  AtomValues bonds(1, nall);    // of each
  for (const PackedRow &row : lists.bonds.rows)
    for (int k = row.first; k < row.last; k++) {
      bonds[row.i][0] += 1.0;
      if (lists.bonds.j[k] < lists.nreact) bonds[lists.bonds.j[k]][0] += 1.0;
    }
  exchange.reverse_comm(bonds);
  shared.assign(nall, 0.0);
  inverse_capacity.assign(nall, 0.0);
  for (int i = 0; i < nall; i++) {
    const Row &row = rows[type[i]];
    const double mass = scene::mass(atom, i);
    if (atom->mask[i] & groupbit) inverse_capacity[i] = 1.0 / (mass * row.capacity);
    if (i >= lists.nlocal) continue;
    if (row.conductivity > 0.0)
      shared[i][0] = conducting_share(domain->dimension, mass / row.density, bonds[i][0]);
    shared[i][1] = atom->temperature[i];
  }
  exchange.forward_comm(shared);
  links.clear();
  for_each_pair(lists.bonds, scene::rows(atom->x), [&](const PlacedPair &p) {
    const double by =
        conductance(rows[type[p.i]].conductivity, rows[type[p.j]].conductivity, shared[p.i][0],
                    shared[p.j][0], p.g.dsq, atom->radius[p.i] + atom->radius[p.j]);
    if (by > 0.0 && !p.is_past_cutoff()) links.push_back({p.i, p.j, by});
  });
}

// Collective. flow: of each atom the sum over its bonds of conductance times difference(i, j)
template <class F> void Conduction::sum_flows(F &&difference)
{
  flow.assign(inverse_capacity.size(), 0.0);
  for (const Link &link : links) {
    flow[link.i][0] += link.conductance * difference(link.i, link.j);
    if (link.j < nreact) flow[link.j][0] += link.conductance * difference(link.j, link.i);
  }
  exchange.reverse_comm(flow);
}

// The largest sum of absolute values in a row of W B^T C^-1 B, which has the same eigenvalues, B being the bonds by atoms and W
// their conductances
double Conduction::eigenvalue_bound()
{
  AtomValues sums(1, inverse_capacity.size());
  sum_flows([](int, int) {
    return 1.0;
  });
  for (int i = 0; i < atom->nlocal; i++) sums[i][0] = flow[i][0] * inverse_capacity[i];
  exchange.forward_comm(sums);
  double most = 0.0;
  for (const Link &link : links) most = std::max(most, sums[link.i][0] + sums[link.j][0]);
  return reduce_all(most, MPI_MAX, world);
}

bool Conduction::is_near_limit(double time)
{
  constexpr int MOST_UNSEEN = 50;
  const double bound = eigenvalue_bound();
  if (!(time * bound > 2.0)) return false;    // mostly it is far below
  // another eigenvalue may grow beneath the bound of the largest one
  if (bound > bound_seen || ++unseen >= MOST_UNSEEN) {
    bound_seen = std::max(bound, bound_seen);
    unseen = 0;
    find_limit();
  }
  return true;
}

void Conduction::find_limit()
{
  constexpr double TOLERANCE = 1e-8;
  constexpr int MOST = 1000;
  const int nlocal = atom->nlocal;
  std::vector<double> start(nlocal, 0.0);
  AtomValues over_root(1, inverse_capacity.size());
  for (int i = 0; i < nlocal; i++)    // any start will do, the same on every number of MPI ranks
    if (inverse_capacity[i] > 0.0) start[i] = std::sin((double) atom->tag[i]);
  const auto apply = [&](const std::vector<double> &in, std::vector<double> &out) {
    for (int i = 0; i < nlocal; i++) over_root[i][0] = in[i] * std::sqrt(inverse_capacity[i]);
    exchange.forward_comm(over_root);
    sum_flows([&](int i, int j) {
      return over_root[i][0] - over_root[j][0];
    });
    for (int i = 0; i < nlocal; i++) out[i] = flow[i][0] * std::sqrt(inverse_capacity[i]);
  };
  const auto dot = [this](const std::vector<double> &a, const std::vector<double> &b) {
    double here = 0.0;
    for (size_t k = 0; k < a.size(); k++) here += a[k] * b[k];
    return exchange.sum(here);
  };
  const double highest = largest_eigenvalue(start, apply, dot, TOLERANCE, MOST).eigenvalue;
  largest = highest > 0.0 ? 2.0 / highest : HUGE_VAL;
  limit_step = update->ntimestep;
}

const AtomValues &Conduction::find_flows()
{
  sum_flows([this](int i, int j) {
    return shared[j][1] - shared[i][1];
  });
  return flow;
}

}    // namespace EVP
