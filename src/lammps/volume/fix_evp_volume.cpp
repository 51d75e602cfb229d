// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/volume/fix_evp_volume.h"

#include "lammps/base/collective.h"
#include "lammps/base/scene.h"
#include "lammps/base/user_input.h"
#include "lammps/pairs/pair_data.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace EVP;

// fix ID group evp/volume KV [KV ...] | row [cavitation STRAIN|none] [across yes|no]
FixEVPVolume::FixEVPVolume(LAMMPS *lmp, int narg, char **arg) : WithPerAtomComm(lmp, narg, arg)
{
  scene::demand_three_dimensions(domain, error, who, "the volume strain",
                                 "use 'dimension 3', or leave the fix out");
  VolumeLaw law;
  bool across = false;
  const auto is_keyword = [arg](int k) {
    return strcmp(arg[k], "cavitation") == 0 || strcmp(arg[k], "across") == 0;
  };
  int end = narg;
  while (end >= 5 && is_keyword(end - 2)) end -= 2;
  const int given = end - 3, ntypes = atom->ntypes;
  if (given != 1 && given != ntypes)
    error->all(FLERR,
               "{}: expected one KV, or one for each of the {} atom types, got {}; or the word "
               "row, where they are those of the rows of the pair style",
               who, ntypes, given);
  const bool from_rows = given == 1 && strcmp(arg[3], "row") == 0;
  std::vector<double> kv(from_rows ? 0 : ntypes + 1, 0.0);
  stop_at_bad_input(error, who, [&] {
    for (int type = 1; !from_rows && type <= ntypes; type++) {
      const Keyword word = {"KV", arg[given == 1 ? 3 : 2 + type]};
      kv[type] = word.number();
      word.demand(kv[type] >= 0.0 && kv[type] <= HIGHEST_KV,
                  "must lie between 0 and 1e100 (an energy per atom)");
    }
    for (int k = end; k < narg; k += 2) {
      const Keyword word = {arg[k], arg[k + 1]};
      if (word.is("across")) {
        word.demand(word.value == "yes" || word.value == "no", "must be yes or no");
        across = word.value == "yes";
        continue;
      }
      law.cavitation = word.value == "none" ? VolumeLaw::NEVER : word.number();
      word.demand(law.cavitation > 0.0, "must be a volume strain above 0, or none");
    }
  });
  scene::demand_only_one(modify, error, this, who);

  comm_forward = VolumeForces::MOST_PULLS;
  comm_reverse = VolumeForces::MOST_DENSITIES;
  create_attribute = 1;
  energy_global_flag = energy_peratom_flag = thermo_energy = 1;
  scene::offer_values(this, (int) strains.size());
  peratom_flag = peratom_freq = 1;
  size_peratom_cols = 0;

  forces = std::make_shared<VolumeForces>(this, lmp, who, kv, *this);
  forces->law = law;
  forces->across = across;
  FixEVPVolume::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
}

void FixEVPVolume::init()
{
  PairData::require(force, error, who);
  scene::refuse_respa(update, error, who);
  strains_step = -1;
  if (!forces->acts()) {
    std::fill(shown.begin(), shown.end(), 0.0);
    return;
  }
  if (!scene::find_fix(modify, "evp/bonds"))
    error->all(FLERR,
               "{} needs fix evp/bonds, from whose bonds the volume strain is computed: define one "
               "before the run",
               who);
}

void FixEVPVolume::post_force(int /*vflag*/)
{
  strains_step = -1;
  const int nlocal = forces->acts() ? atom->nlocal : 0;
  for (int i = 0; i < nlocal; i++) shown[i] = forces->strain(i);
  const bool per_atom = update->eflag_atom == update->ntimestep;
  ev_init(per_atom ? ENERGY_ATOM : ENERGY_NONE, VIRIAL_NONE);
  for (int i = 0; eflag_atom && i < nlocal; i++) eatom[i] = forces->energy(i);
}

void FixEVPVolume::grow_arrays(int nmax)
{
  shown.resize(nmax);
  vector_atom = shown.data();
}

double FixEVPVolume::compute_vector(int n)
{
  if (strains_step == update->ntimestep) return strains[n];
  std::array<double, 3> sums{};                               // of theta, atoms, atoms beyond
  std::array<double, 2> extremes = {-HUGE_VAL, -HUGE_VAL};    // of minus theta and theta
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit) || !forces->has_strain(i)) continue;
    const double theta = forces->strain(i);
    sums[0] += theta;
    sums[1] += 1.0;
    sums[2] += theta > forces->law.cavitation;
    extremes = {std::max(extremes[0], -theta), std::max(extremes[1], theta)};
  }
  sums = reduce_all(sums, MPI_SUM, world);
  extremes = reduce_all(extremes, MPI_MAX, world);
  strains = {0.0, 0.0, 0.0, 0.0};
  if (sums[1] > 0.0) strains = {sums[0] / sums[1], -extremes[0], extremes[1], sums[2]};
  strains_step = update->ntimestep;
  return strains[n];
}
