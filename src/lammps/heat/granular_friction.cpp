// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/heat/granular_friction.h"

#include "lammps/base/scene.h"

#include "atom.h"
#include "fix_neigh_history.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "pair.h"

#include <algorithm>
#include <cmath>

namespace EVP {

// Of granular styles the heat of their tangential forces is known where single() tells of these
void GranularFriction::find_styles()
{
  styles.clear();
  pairs.clear();
  for (int n = 1; Pair *const pair = force->pair_match("^gran", 0, n); n++) {
    if (!styles.empty() && pair == styles.back().pair) break;    // the only one, whatever n
    if (!pair->single_enable || pair->single_extra < 4) continue;
    styles.push_back({pair, nullptr, utils::strmatch(force->pair_match_ptr(pair), "^granular")});
    for (Fix *const fix : modify->get_fix_list())
      if (auto *const memory = dynamic_cast<FixNeighHistory *>(fix); memory && memory->pair == pair)
        styles.back().memory = memory;
  }
}

// The tangential forces that act, by single() at the velocities that they were found at. It moves what a pair that slips
// remembers once more: that is put back
void GranularFriction::find_forces()
{
  pairs.clear();
  const int *const type = atom->type;
  for (const auto &[pair, memory, shortens_arms] : styles) {
    const NeighList *const neighbors = pair->list;
    const int width = memory ? memory->get_dnum() : 0;
    for (int ii = 0; ii < neighbors->inum; ii++) {
      const int i = neighbors->ilist[ii];
      for (int jj = 0; jj < neighbors->numneigh[i]; jj++) {
        const int j = neighbors->firstneigh[i][jj] & NEIGHMASK;
        const double weight = force->special_lj[neighbors->firstneigh[i][jj] >> SBBITS & 3];
        const PairGeometry g(scene::rows(atom->x), i, j);
        if (!(g.dsq < pair->cutsq[type[i]][type[j]]) || weight == 0.0) continue;
        double *const values = memory ? memory->firstvalue[i] + (size_t) width * jj : nullptr;
        remembered.assign(values, values + width);
        double normal;
        pair->single(i, j, type[i], type[j], g.dsq, 1.0, 1.0, normal);
        std::copy(remembered.begin(), remembered.end(), values);
        if (pair->svector[3] == 0.0) continue;
        const double d = std::sqrt(g.dsq), radius_i = atom->radius[i], radius_j = atom->radius[j];
        const double shorter = shortens_arms ? 0.5 * (radius_i + radius_j - d) : 0.0;
        pairs.push_back({i, j, Vector(pair->svector) * weight, g * (1.0 / d), radius_i - shorter,
                         radius_j - shorter, 0.0});
      }
    }
  }
}

// Collective. What these forces take, by the velocities of a whole step, which ghosts do not have
void GranularFriction::find_powers()
{
  if (styles.empty()) return;
  const int nlocal = atom->nlocal;
  moving.resize(nlocal + atom->nghost);
  for (int i = 0; i < nlocal; i++) {
    std::copy_n(atom->v[i], 3, moving[i]);
    std::copy_n(atom->omega[i], 3, moving[i] + 3);
  }
  exchange.forward_comm_velocities(moving);
  for (Contact &pair : pairs) {
    const double *const of_i = moving[pair.i], *const of_j = moving[pair.j];
    const Vector spin = Vector(of_i + 3) * pair.arm_i + Vector(of_j + 3) * pair.arm_j,
                 n = pair.along;
    const Vector rotation(spin.y * n.z - spin.z * n.y, spin.z * n.x - spin.x * n.z,
                          spin.x * n.y - spin.y * n.x);
    pair.power = -dot(pair.force, Vector(of_i) - Vector(of_j) - rotation);
  }
}

}    // namespace EVP
