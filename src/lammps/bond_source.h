// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"
#include "core/contacts.h"
#include "scene.h"

#include <memory>
#include <string>

namespace EVP {

/// Where the pair style gets the records of its bonds: from the fix evp/bonds that recorded them and no other, since to
/// continue without them would change the material.
class BondSource : protected Pointers {
 public:
  using Pointers::Pointers;

  /// At set-up: those of the fix there is. Stops where another one recorded, or where the rules need one.
  void begin_run(const PairRules &);

  /// Takes note of records that are new, or gone with their fix.
  void update();

  /// Records came with a restart file: should their fix go before the next run, update() learns it.
  void set_store(const std::shared_ptr<const BondStore> &restored) { store = restored; }

  /// The records, nullptr before the recording and without fix evp/bonds.
  const BondStore *records() const
  {
    return store && store->has_recorded() ? store.get() : nullptr;
  }

  /// Is there a fix evp/bonds?
  bool has_fix() const { return store != nullptr; }

  BodyRule within() const { return store ? store->within() : BodyRule::ALL; }

  /// See BondStore::version(), 0 without.
  long version() const { return store ? store->version() : 0; }

  /// Do the records have histories just where the rules ask for these?
  bool is_compatible(const PairRules &rules) const
  {
    return !store || store->has_history() == rules.has_history();
  }

  /// ID of the fix that recorded, as of the last update(); empty without.
  std::string recorder;

  /// The last fix whose records of this body are gone, empty if there was none.
  std::string dropped;

 private:
  std::shared_ptr<const BondStore> store;
};

inline void BondSource::begin_run(const PairRules &rules)
{
  update();
  const Fix *fix = scene::find_fix(modify, "evp/bonds");
  store = scene::find_shared<const BondStore>(modify, "evp/bonds", "bonds");
  if (!recorder.empty() && (!records() || recorder != fix->id))
    error->all(FLERR,
               "Pair evp/lj: the bonds were recorded by fix {}, whose records are not here: define "
               "'fix {} all evp/bonds' right after read_restart and before the run, or start again "
               "with 'pair_style none' and 'pair_style evp/lj'",
               recorder, recorder);
  if (records()) recorder = fix->id;
  if (rules.has_history() && !fix)
    error->all(FLERR, "Pair evp/lj: {} needs fix evp/bonds, which stores the history of the bonds",
               rules.plastic ? "plasticity isotropic" : "break");
}

inline void BondSource::update()
{
  if (!store) return;
  if (store->is_closed()) {
    if (!recorder.empty()) dropped = recorder;
    recorder.clear();
    store.reset();
  } else if (store->has_recorded() && recorder.empty())
    recorder = scene::find_fix(modify, "evp/bonds")->id;
}

}    // namespace EVP
