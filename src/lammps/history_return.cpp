// SPDX-License-Identifier: GPL-2.0-only

#include "history_return.h"

#include "atom.h"
#include "comm.h"
#include "force.h"
#include "irregular.h"

#include <vector>

using namespace LAMMPS_NS;
using EVP::BondStore;

namespace {

/// Calls f(i, j, is_record, history) for the pairs of the list that have one.
template <class F> void for_each_changed(const EVP::PairList &list, F &&f)
{
  const EVP::PackedPairs &pairs = list.pairs;
  for (const EVP::PackedRow &row : list.rows)
    for (int k = row.first; pairs.has_flow() && k < row.last; k++) {
      const bool is_bond = pairs.slot[k] >= 0;
      EVP::PairHistory h = pairs.history_of(k);
      h.broken = 0.0;    // of what is left of such a bond
      if (!(h == EVP::PairHistory{})) f(row.i, pairs.j[k], is_bond, h);
    }
}

}    // namespace

void LAMMPS_NS::return_histories(LAMMPS *lmp, const EVP::PairList &list,
                                 const std::vector<EVP::BrokenBond> &broken, BondStore &store,
                                 EVP::GhostExchange &exchange)
{
  const Atom *atom = lmp->atom;
  const tagint *tag = atom->tag;
  const int nlocal = atom->nlocal, newton = lmp->force->newton_pair;

  EVP::GhostExchange::Nodal owner((size_t) 3 * (nlocal + atom->nghost),
                                  0.0);    // rank, local index
  for (int i = 0; i < nlocal; i++) {
    owner[(size_t) 3 * i] = lmp->comm->me;
    owner[(size_t) 3 * i + 1] = i;
  }
  exchange.to_ghosts(owner);

  store.clear_contacts();
  std::vector<EVP::HistoryOfPair> messages;
  std::vector<int> ranks;
  const auto send = [&](int i, int j, bool is_record, const EVP::PairHistory &h) {
    if (j < nlocal) {
      store.take({i, is_record, tag[j], h});
      store.take({j, is_record, tag[i], h});
    } else if (newton || tag[i] < tag[j]) {
      store.take({i, is_record, tag[j], h});
      ranks.push_back((int) owner[(size_t) 3 * j]);
      messages.push_back({(int) owner[(size_t) 3 * j + 1], is_record, tag[i], h});
    }
  };
  // either copy of a bond may have met its cut-off alone, by round-off: that breaks both
  std::vector<EVP::HistoryOfPair> deferred;
  for (const EVP::BrokenBond &bond : broken) {
    const EVP::PairHistory h = {0.0, bond.work, 1.0};
    if (bond.j < nlocal || newton || tag[bond.i] < tag[bond.j]) {
      send(bond.i, bond.j, true, h);
      continue;
    }
    ranks.push_back((int) owner[(size_t) 3 * bond.j]);
    messages.push_back({(int) owner[(size_t) 3 * bond.j + 1], true, tag[bond.i], h});
    deferred.push_back({bond.i, true, tag[bond.j], h});
  }
  for_each_changed(list, send);

  Irregular irregular(lmp);
  const int n = irregular.create_data((int) messages.size(), ranks.data(), 1);
  std::vector<EVP::HistoryOfPair> received(n);
  irregular.exchange_data((char *) messages.data(), sizeof(EVP::HistoryOfPair),
                          (char *) received.data());
  irregular.destroy_data();
  for (const EVP::HistoryOfPair &m : received) store.take(m);
  for (const EVP::HistoryOfPair &m : deferred) store.take(m);
}
