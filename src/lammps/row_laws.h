// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/coefficients.h"
#include "cutoffs.h"
#include "volume_forces.h"

#include <string>

namespace EVP {

/// Makes the laws of the rows for the body whose bonds were measured, and tells users what the rows that name the
/// bodies they hold for are multiplied by in this one.
class RowLaws : protected Pointers {
 public:
  RowLaws(LAMMPS *lmp, Coefficients &coefficients_in, const Cutoffs &cuts_in) :
      Pointers(lmp), coefficients(coefficients_in), cuts(cuts_in)
  {
  }

  /// At set-up, for the laws to come. bonds: nullptr without.
  void begin_run(const BondStore *bonds)
  {
    take_measures(bonds);
    take_kv();
  }

  /// Makes both laws of two types and returns the row that they are of. plastic: it must be able to flow.
  Row make(int i, int j, bool plastic);

  /// At a packing: the bonds were recorded, or went, after the laws were made.
  void rescale_if_measures_changed(const BondStore *bonds, bool plastic);

  /// At the set-up of a run. Warns where a row has a volume energy and there is no fix evp/volume. Again only when it changes.
  void report();

  /// Collective. Stops where bonds join types that had none when they were measured: types may have been set since.
  void check(const PairList &, const VolumeForces *) const;

 private:
  Coefficients &coefficients;
  const Cutoffs &cuts;
  std::string last_report, last_kv_warning;

  bool take_measures(const BondStore *);
  void take_kv();
  template <class F> void stop_at_bad_row(int i, int j, F &&f) const;
  std::string describe() const;
  std::string describe(int i, int j, bool with_kv) const;
  std::string find_inactive_kv() const;
  void warn(const std::string &warning, std::string &last) const;
};

}    // namespace EVP
