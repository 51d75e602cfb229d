// SPDX-License-Identifier: GPL-2.0-only
// Registration of the styles, and nothing else.

#include "host_guard.h"
#include "instance_styles.h"
#include "plugin_facts.h"

#include "check_evp_variables.h"
#include "compute_evp_dt.h"
#include "compute_evp_state_atom.h"
#include "fix_dt_evp.h"
#include "fix_evp_bonds.h"
#include "fix_evp_energy.h"
#include "fix_evp_volume.h"
#include "fix_nve_evp.h"
#include "pair_evp_lj.h"
#include "read_evp_body.h"
#include "read_evp_row.h"
#include "write_evp_bonds.h"

#include "comm.h"
#include "lammpsplugin.h"
#include "version.h"

using namespace LAMMPS_NS;

template <class Style> static void *create(void *lmp)
{
  return new Style((LAMMPS *) lmp);
}

template <class Style> static void *create_with_arguments(void *lmp, int narg, char **arg)
{
  return new Style((LAMMPS *) lmp, narg, arg);
}

extern "C" __attribute__((visibility("default"))) void lammpsplugin_init(void *lmp, void *handle,
                                                                         void *regfunc)
{
  refuse_wrong_host(lmp);
  if (((LAMMPS *) lmp)->comm->me == 0)
    utils::logmesg((LAMMPS *) lmp, "EVP " EVP_VERSION " for LAMMPS " LAMMPS_VERSION "\n");

  lammpsplugin_t plugin = {};
  plugin.version = LAMMPS_VERSION;
  plugin.author = "the authors of EVP " EVP_VERSION;
  plugin.handle = handle;
  const auto add = [&](const char *kind, const char *name, const char *info) {
    plugin.style = kind;
    plugin.name = name;
    plugin.info = info;
    if (!is_listed(kind, name) || !make_known((LAMMPS *) lmp, plugin))
      ((lammpsplugin_regfunc) regfunc)(&plugin, lmp);
  };
  plugin.creator.v1 = &create<PairEVPLJ>;
  add("pair", "evp/lj", "EVP two-regime pair style, Gado et al. 2017");
  plugin.creator.v1 = &create<WriteEVPBonds>;
  add("command", "write_evp_bonds", "EVP bonds as a text file");
  plugin.creator.v1 = &create<ReadEVPRow>;
  add("command", "read_evp_row", "EVP row of coefficients as variables");
  plugin.creator.v1 = &create<ReadEVPBody>;
  add("command", "read_evp_body", "EVP dimensions of a body as variables");
  plugin.creator.v1 = &create<CheckEVPVariables>;
  add("command", "check_evp_variables", "EVP names of variables set by -var");
  plugin.creator.v2 = &create_with_arguments<FixEVPBonds>;
  add("fix", "evp/bonds", "EVP equilibrium distances of the initial pairs");
  plugin.creator.v2 = &create_with_arguments<FixNVEEVP>;
  add("fix", "nve/evp", "EVP time integration with implicit damping");
  plugin.creator.v2 = &create_with_arguments<FixDtEVP>;
  add("fix", "dt/evp", "EVP timestep size as a fraction of the largest stable one");
  plugin.creator.v2 = &create_with_arguments<FixEVPEnergy>;
  add("fix", "evp/energy", "EVP energy balance");
  plugin.creator.v2 = &create_with_arguments<FixEVPVolume>;
  add("fix", "evp/volume", "EVP volume energy");
  plugin.creator.v2 = &create_with_arguments<ComputeEVPDt>;
  add("compute", "evp/dt", "EVP largest stable timestep size");
  plugin.creator.v2 = &create_with_arguments<ComputeEVPStateAtom>;
  add("compute", "evp/state/atom", "EVP state of each atom's pairs");
}
