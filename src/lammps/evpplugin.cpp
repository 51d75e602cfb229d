// SPDX-License-Identifier: GPL-2.0-only
// Registration of the styles, and nothing else.

#include "lammps/host_guard.h"

#include "lammps/bonds/compute_evp_fragment_atom.h"
#include "lammps/bonds/compute_evp_state_atom.h"
#include "lammps/bonds/fix_evp_bonds.h"
#include "lammps/commands/evp_choices.h"
#include "lammps/commands/evp_quietly.h"
#include "lammps/commands/read_evp_row.h"
#include "lammps/commands/write_evp_bonds.h"
#include "lammps/damping/fix_nve_evp.h"
#include "lammps/energy/fix_evp_energy.h"
#include "lammps/heat/fix_evp_heat.h"
#include "lammps/pairs/pair_evp_lj.h"
#include "lammps/timestep/compute_evp_dt.h"
#include "lammps/timestep/fix_dt_evp.h"
#include "lammps/volume/fix_evp_volume.h"

#include "comm.h"
#include "force.h"
#include "input.h"
#include "lammpsplugin.h"
#include "modify.h"
#include "version.h"

#include <cstring>
#include <type_traits>

using namespace LAMMPS_NS;

// of PLUGIN/plugin.h, which is not on the include path: the place in LAMMPS' list, -1 if it is not there
namespace LAMMPS_NS {
int plugin_find(const char *kind, const char *name);
}

namespace {

/// Makes the style known to this instance, as LAMMPS does. False if it is known, or of no kind of ours.
bool make_known(LAMMPS *lmp, const lammpsplugin_t &style)
{
  const auto is = [&](const char *kind) {
    return std::strcmp(style.style, kind) == 0;
  };
  const auto add = [&](auto *styles, auto *creator) {
    using Creator = typename std::remove_pointer_t<decltype(styles)>::mapped_type;
    return styles->emplace(style.name, (Creator) creator).second;
  };
  if (is("pair")) return add(lmp->force->pair_map, style.creator.v1);
  if (is("fix")) return add(lmp->modify->fix_map, style.creator.v2);
  if (is("compute")) return add(lmp->modify->compute_map, style.creator.v2);
  if (is("command")) return add(lmp->input->command_map, style.creator.v1);
  return false;
}

template <class Style, class... Arguments> void *create(void *lmp, Arguments... arguments)
{
  return new Style((LAMMPS *) lmp, arguments...);
}

}    // namespace

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
  const auto add = [&](const char *kind, const char *name, auto *creator, const char *info) {
    plugin.style = kind;
    plugin.name = name;
    if constexpr (std::is_same_v<decltype(creator), lammpsplugin_factory1 *>)
      plugin.creator.v1 = creator;
    else
      plugin.creator.v2 = creator;
    plugin.info = info;
    // LAMMPS' list of plugins belongs to the process, its styles to the instance: a style that another instance has
    // loaded is ignored by LAMMPS where this one loads it, and would stay unknown here
    if (plugin_find(kind, name) < 0 || !make_known((LAMMPS *) lmp, plugin))
      ((lammpsplugin_regfunc) regfunc)(&plugin, lmp);
  };
  add("pair", "evp/lj", create<PairEVPLJ>, "EVP two-regime pair style, Gado et al. 2017");
  add("command", "write_evp_bonds", create<WriteEVPBonds>, "EVP bonds as a text file");
  add("command", "read_evp_row", create<ReadEVPRow>, "EVP row of coefficients as variables");
  add("command", "evp_choices", create<EVPChoices>,
      "EVP choices of an input script and their rules");
  add("command", "evp_quietly", create<EVPQuietly>, "EVP command whose output is for the log file");
  add("fix", "evp/bonds", create<FixEVPBonds, int, char **>,
      "EVP equilibrium distances of the initial pairs");
  add("fix", "nve/evp", create<FixNVEEVP, int, char **>,
      "EVP time integration with implicit damping");
  add("fix", "dt/evp", create<FixDtEVP, int, char **>,
      "EVP timestep size as a fraction of the largest stable one");
  add("fix", "evp/energy", create<FixEVPEnergy, int, char **>, "EVP energy balance");
  add("fix", "evp/heat", create<FixEVPHeat, int, char **>, "EVP heat of deformation");
  add("fix", "evp/volume", create<FixEVPVolume, int, char **>, "EVP volume energy");
  add("compute", "evp/dt", create<ComputeEVPDt, int, char **>, "EVP largest stable timestep size");
  add("compute", "evp/fragment/atom", create<ComputeEVPFragmentAtom, int, char **>,
      "EVP fragment that each atom is in");
  add("compute", "evp/state/atom", create<ComputeEVPStateAtom, int, char **>,
      "EVP state of each atom's pairs");
}
