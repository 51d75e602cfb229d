// SPDX-License-Identifier: GPL-2.0-only
//
// What the styles of this package ask of the scene that they are part of, and LAMMPS' headers of it.
#pragma once

#include "core/pairs/contacts.h"
#include "lammps/base/lammps_names.h"

#include "atom.h"
#include "atom_vec.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "force.h"
#include "input.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>

namespace EVP {

class BondStore;

/// The fix with the records of the bonds.
class HasBondStore {
 public:
  virtual std::shared_ptr<const BondStore> records() const = 0;

 protected:
  ~HasBondStore() = default;
};

/// Are two atoms or ghosts of two bodies, as they are now? One without a molecule, which has the ID 0, is of none.
inline bool in_different_bodies(const Atom *atom, BodyRule within, int i, int j)
{
  if (within == BodyRule::MOLECULE && atom->molecule)
    return atom->molecule[i] != atom->molecule[j] || atom->molecule[i] == 0;
  return within == BodyRule::TYPE && atom->type[i] != atom->type[j];
}

/// What is missing where atoms and ghosts must have molecule IDs, with the remedy; empty if they have.
inline std::string missing_molecules(const LAMMPS *lmp)
{
  const std::string remedy = "'fix ID all property/atom mol ghost yes'";
  if (!lmp->atom->molecule)
    return "within molecule needs atoms with molecule IDs: define " + remedy +
        " before it, also after read_restart, or use an atom style that has them, such as "
        "'atom_style hybrid sphere molecular'";

  const auto &sent = lmp->atom->avec->fields_border;
  if (std::find(sent.begin(), sent.end(), "molecule") != sent.end()) return "";
  for (const Fix *fix : lmp->modify->get_fix_list())
    if (utils::strmatch(fix->style, "^property/atom") && fix->comm_border > 0) return "";
  return "within molecule needs ghost atoms that know their molecule IDs: use " + remedy;
}

namespace scene {

  /// The fix of that style, nullptr if there is none. Of each style of ours there is one at most.
  inline Fix *find_fix(const Modify *modify, const char *style)
  {
    for (int k = 0; k < modify->nfix; k++)
      if (modify->fix[k] && strcmp(modify->fix[k]->style, style) == 0) return modify->fix[k];
    return nullptr;
  }

  /// Stops, naming `who`, where there is another fix of this style. One that it replaces is gone by now.
  inline void demand_only_one(const Modify *modify, Error *error, const Fix *self,
                              const std::string &who)
  {
    for (int k = 0; k < modify->nfix; k++)
      if (const Fix *other = modify->fix[k];
          other && other != self && strcmp(other->style, self->style) == 0)
        error->all(FLERR,
                   "{}: fix {} is of this style too, but only one is allowed: 'unfix {}' first",
                   who, other->id, other->id);
  }

  /// Those of the bonds, nullptr without their fix.
  inline std::shared_ptr<const BondStore> find_records(const Modify *modify)
  {
    for (int k = 0; k < modify->nfix; k++)
      if (const auto *const owner = dynamic_cast<const HasBondStore *>(modify->fix[k]))
        return owner->records();
    return nullptr;
  }

  inline bool is_ours(const char *style)
  {
    return utils::strmatch(style, "/evp$") || utils::strmatch(style, "^evp/");
  }

  /// Is this a run of at least one step? False for minimizations, 'run 0', and rerun, where LAMMPS keeps the steps
  /// of the last run.
  inline bool makes_steps(const LAMMPS *lmp)
  {
    const Update *const update = lmp->update;
    const char *const command = lmp->input->command;
    return update->whichflag == 1 && update->nsteps > 0 &&
        update->laststep == update->firststep + update->nsteps &&
        !(command && strcmp(command, "rerun") == 0);
  }

  /// Does the fix move its atoms by the forces on them, not along a path of its own?
  inline bool integrates_atoms(const Fix *fix)
  {
    return fix->time_integrate && !utils::strmatch(fix->style, "noforce$") &&
        !utils::strmatch(fix->style, "move$");
  }

  /// Does the fix prescribe forces on its atoms, so that they do not follow those of a pair style alone?
  inline bool holds_atoms(const Fix *fix)
  {
    for (const char *pattern : {"^setforce", "^lineforce", "^planeforce", "^aveforce", "^freeze"})
      if (utils::strmatch(fix->style, pattern)) return true;
    return false;
  }

  inline double mass(const Atom *atom, int i)
  {
    return atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
  }

  /// Acceleration per force [velocity/time/force], LAMMPS' unit factor included.
  inline double inverse_mass(const Atom *atom, const Force *force, int i)
  {
    return force->ftm2v / mass(atom, i);
  }

  /// Has special_bonds the weight 0 for this entry of a neighbor list?
  inline bool is_excluded(const Force *force, int neighbor)
  {
    return force->special_lj[neighbor >> SBBITS & 3] == 0.0;
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

  /// Stops, naming `who`, in 'dimension 2', where `what` would be wrong in silence.
  inline void demand_three_dimensions(const Domain *domain, Error *error, const std::string &who,
                                      const std::string &what, const std::string &remedy)
  {
    if (domain->dimension == 2)
      error->all(FLERR,
                 "{}: {} holds for three-dimensional bodies, but 'dimension 2' is in force: {}",
                 who, what, remedy);
  }

}    // namespace scene
}    // namespace EVP
