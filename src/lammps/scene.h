/* SPDX-License-Identifier: GPL-2.0-only

   What the styles of this package ask of the scene that they are part of, and LAMMPS' headers of it. */

#ifndef LMP_EVP_SCENE_H
#define LMP_EVP_SCENE_H

#include "atom.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "force.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <cstring>
#include <string>

namespace EVP {
namespace scene {

  using namespace LAMMPS_NS;

  /// The fix of that style, nullptr if there is none. Of each style of ours there is one at most.
  inline Fix *find_fix(const Modify *modify, const char *style)
  {
    for (int k = 0; k < modify->nfix; k++)
      if (modify->fix[k] && strcmp(modify->fix[k]->style, style) == 0) return modify->fix[k];
    return nullptr;
  }

  /// Does the fix move its atoms by the forces on them, not along a path of its own?
  inline bool moves_by_forces(const Fix *fix)
  {
    return fix->time_integrate && strcmp(fix->style, "nve/noforce") != 0 &&
        strcmp(fix->style, "move") != 0;
  }

  /// Does the fix keep the contacts of a granular pair style? It acts before atoms migrate, but moves none.
  inline bool keeps_contacts(const Fix *fix)
  {
    return utils::strmatch(fix->style, "_HISTORY$");
  }

  /// Mass of an atom [mass].
  inline double mass(const Atom *atom, int i)
  {
    return atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
  }

  /// Acceleration per force [velocity/time/force], LAMMPS' unit factor included.
  inline double inverse_mass(const Atom *atom, const Force *force, int i)
  {
    return force->ftm2v / mass(atom, i);
  }

  /// LAMMPS' rows of x, v or f as the one block that they are.
  inline const double (*rows(double **array))[3]
  {
    return array ? reinterpret_cast<const double(*)[3]>(array[0]) : nullptr;
  }

  /// The fix offers f_ID and f_ID[1..n], which are intensive, at every step.
  inline void offer_values(Fix *fix, int n)
  {
    fix->scalar_flag = fix->vector_flag = fix->global_freq = 1;
    fix->size_vector = n;
    fix->extscalar = fix->extvector = 0;
  }

  /// Stops, naming `who`, under run_style respa, which does not call all methods of a fix at each step.
  inline void refuse_respa(const Update *update, Error *error, const std::string &who)
  {
    if (utils::strmatch(update->integrate_style, "^respa"))
      error->all(FLERR, "{} does not work with run_style respa: use run_style verlet", who);
  }

  /// Stops, naming `who`, where a box deforms with 'remap v' and moves the images of some atoms only: the
  /// two atoms of a pair would then see different velocities of each other.
  inline void demand_images_that_move(const Domain *domain, Modify *modify, Error *error,
                                      const std::string &who)
  {
    if (!domain->deform_vremap || domain->deform_groupbit == 1) return;
    for (const Fix *fix : modify->get_fix_list())
      if (utils::strmatch(fix->style, "^deform"))
        error->all(
            FLERR,
            "{}: fix {} of style {} has 'remap v' for a part of the atoms, and pairs with the "
            "others would differ in their velocity across the boundary: give it group all",
            who, fix->id, fix->style);
  }

}    // namespace scene
}    // namespace EVP

#endif
