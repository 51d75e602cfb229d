// SPDX-License-Identifier: GPL-2.0-only

#include "bond_source.h"

#include "scene.h"

namespace EVP {

void BondSource::begin_run(const PairRules &rules)
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

void BondSource::update()
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
