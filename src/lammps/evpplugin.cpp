/* SPDX-License-Identifier: GPL-2.0-only

   Registration of the styles, and nothing else. */

#include "host_guard.h"

#include "compute_evp_dt.h"
#include "compute_evp_state_atom.h"
#include "fix_dt_evp.h"
#include "fix_evp_bonds.h"
#include "fix_evp_energy.h"
#include "fix_nve_evp.h"
#include "pair_evp_lj.h"
#include "write_evp_bonds.h"

#include "lammpsplugin.h"
#include "version.h"

using namespace LAMMPS_NS;

namespace {

template <class Style> void *create(void *lmp)
{
  return new Style((LAMMPS *) lmp);
}

template <class Style> void *create_with_words(void *lmp, int narg, char **arg)
{
  return new Style((LAMMPS *) lmp, narg, arg);
}

/// Of the two creators a style has one.
struct StyleEntry {
  const char *kind, *name, *info;
  lammpsplugin_factory1 *plain;
  lammpsplugin_factory2 *with_words;
};

const StyleEntry styles[] = {
    {"pair", "evp/lj", "EVP two-regime pair style, Gado et al. 2017", &create<PairEVPLJ>, nullptr},
    {"fix", "evp/bonds", "EVP equilibrium distances of the initial pairs", nullptr,
     &create_with_words<FixEVPBonds>},
    {"fix", "nve/evp", "EVP time integration with implicit damping", nullptr,
     &create_with_words<FixNVEEVP>},
    {"fix", "dt/evp", "EVP step as a fraction of the largest stable one", nullptr,
     &create_with_words<FixDtEVP>},
    {"fix", "evp/energy", "EVP energy ledger", nullptr, &create_with_words<FixEVPEnergy>},
    {"compute", "evp/dt", "EVP largest stable time steps", nullptr,
     &create_with_words<ComputeEVPDt>},
    {"compute", "evp/state/atom", "EVP state of each atom's pairs", nullptr,
     &create_with_words<ComputeEVPStateAtom>},
    {"command", "write_evp_bonds", "EVP bonds as a text file", &create<WriteEVPBonds>, nullptr},
};

}    // namespace

extern "C" void lammpsplugin_init(void *lmp, void *handle, void *regfunc)
{
  EVP::refuse_wrong_host(lmp);

  lammpsplugin_t plugin = {};
  plugin.version = LAMMPS_VERSION;
  plugin.author = "the EVP authors";
  plugin.handle = handle;
  for (const StyleEntry &style : styles) {
    plugin.style = style.kind;
    plugin.name = style.name;
    plugin.info = style.info;
    if (style.plain)
      plugin.creator.v1 = style.plain;
    else
      plugin.creator.v2 = style.with_words;
    ((lammpsplugin_regfunc) regfunc)(&plugin, lmp);
  }
}
