// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/base/atom_values.h"
#include "core/law/row.h"
#include "core/pairs/pairs.h"
#include "lammps/base/lammps_names.h"
#include "lammps/pairs/pair_data.h"

#include "update.h"

#include <vector>

namespace EVP {

/// Heat that flows along the bonds, C dT/dt = -G T, and its largest stable thermal step, 2/lambda_max of C^-1/2 G C^-1/2.
class Conduction : protected Pointers {
 public:
  Conduction(LAMMPS *lmp, PerAtomComm &exchange_in) : Pointers(lmp), exchange(exchange_in) {}

  void begin_run() { bound_seen = 0.0; }
  /// Collective. The bonds that conduct at the present positions, and the temperatures. rows: by type, from 1; groupbit: of
  /// atoms whose temperature is not held.
  void find_links(const PairLists &, const std::vector<Row> &rows, int groupbit);

  // of the links found last

  /// Collective. No eigenvalue of C^-1 G is larger.
  double eigenvalue_bound();
  /// Collective.
  void find_limit();
  /// Collective. May this time be above the largest stable thermal step? That is found anew where it may have changed.
  bool is_near_limit(double time);
  /// Largest stable thermal step [time], as it was found last.
  double limit() const { return largest; }
  bool has_limit_of_now() const { return limit_step == update->ntimestep; }
  /// Collective. To each atom [energy/time].
  const AtomValues &find_flows();

  double memory_usage() const { return bytes_of(links, shared, flow, inverse_capacity); }

 private:
  struct Link {
    int i, j;
    double conductance;
  };

  PerAtomComm &exchange;
  std::vector<Link> links;
  int nreact = 0;                          // atoms and ghosts that take flows
  AtomValues shared{2};                    // conducting share and temperature
  AtomValues flow{1};                      // to each [energy/time]
  std::vector<double> inverse_capacity;    // 0 where the temperature is held
  double largest = 0.0;                    // thermal step [time]
  double bound_seen = 0.0;    // bound of the eigenvalue that it was found at, in this run
  int unseen = 0;             // times that it was near since
  bigint limit_step = -1;     // step that it was found at

  template <class F> void sum_flows(F &&difference);
};

}    // namespace EVP
