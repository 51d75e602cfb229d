/* SPDX-License-Identifier: GPL-2.0-only

   Registration of the styles, and nothing else. */

#include "host_guard.h"

#include "compute_evp_dt.h"
#include "compute_evp_state_atom.h"
#include "fix_dt_evp.h"
#include "fix_evp_bonds.h"
#include "fix_evp_energy.h"
#include "fix_nve_evp.h"
#include "lammps_compat.h"
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

}    // namespace

extern "C" void lammpsplugin_init(void *lmp, void *handle, void *regfunc)
{
  EVP::refuse_wrong_host(lmp);
  EVP::compat::show_last_words(((LAMMPS *) lmp)->output, ((LAMMPS *) lmp)->screen);

  const auto add = (lammpsplugin_regfunc) regfunc;
  lammpsplugin_t plugin = {};
  plugin.version = LAMMPS_VERSION;
  plugin.author = "the EVP authors";
  plugin.handle = handle;

  plugin.style = "pair";
  plugin.name = "evp/lj";
  plugin.info = "EVP two-regime pair style, Gado et al. 2017";
  plugin.creator.v1 = &create<PairEVPLJ>;
  add(&plugin, lmp);

  plugin.style = "fix";
  plugin.name = "evp/bonds";
  plugin.info = "EVP equilibrium distances of the initial pairs";
  plugin.creator.v2 = &create_with_words<FixEVPBonds>;
  add(&plugin, lmp);

  plugin.name = "nve/evp";
  plugin.info = "EVP time integration with implicit damping";
  plugin.creator.v2 = &create_with_words<FixNVEEVP>;
  add(&plugin, lmp);

  plugin.name = "dt/evp";
  plugin.info = "EVP step as a fraction of the largest stable one";
  plugin.creator.v2 = &create_with_words<FixDtEVP>;
  add(&plugin, lmp);

  plugin.name = "evp/energy";
  plugin.info = "EVP energy ledger";
  plugin.creator.v2 = &create_with_words<FixEVPEnergy>;
  add(&plugin, lmp);

  plugin.style = "compute";
  plugin.name = "evp/dt";
  plugin.info = "EVP largest stable time steps";
  plugin.creator.v2 = &create_with_words<ComputeEVPDt>;
  add(&plugin, lmp);

  plugin.name = "evp/state/atom";
  plugin.info = "EVP state of each atom's pairs";
  plugin.creator.v2 = &create_with_words<ComputeEVPStateAtom>;
  add(&plugin, lmp);

  plugin.style = "command";
  plugin.name = "write_evp_bonds";
  plugin.info = "EVP bonds as a text file";
  plugin.creator.v1 = &create<WriteEVPBonds>;
  add(&plugin, lmp);
}
