/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/bonds: its life, and what users and the pair style read of the records. How these are made
   is in fix_evp_bonds_record.cpp, how they move with atoms in _atoms.cpp, restart files in _restart.cpp. */

#include "fix_evp_bonds.h"

#include "core/text.h"
#include "pair_evp_lj.h"
#include "scene.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace FixConst;

/* ----------------------------------------------------------------------
   fix ID group evp/bonds [zone Z | file FILE]
------------------------------------------------------------------------- */

FixEVPBonds::FixEVPBonds(LAMMPS *lmp, int narg, char **arg) :
    NodalExchange(lmp, narg, arg), zone(0.0), recorded(false), records_due(false),
    after_restart(modify->nfix_restart_global > 0), restored_late(false), highest_id(0),
    nrecorded(0), most_bonds(0), list(nullptr), pair_counts{}, counted_step(-1)
{
  for (int iarg = 3; iarg < narg; iarg += 2) {
    const std::string key = arg[iarg];
    if (key != "zone" && key != "file")
      error->all(FLERR, "Fix {} evp/bonds: unknown keyword '{}'; it takes zone or file", id, key);
    if (iarg + 1 == narg) error->all(FLERR, "Fix {} evp/bonds: keyword {} needs a value", id, key);
    if (key == "file") {
      file = arg[iarg + 1];
      if (file.empty())
        error->all(FLERR, "Fix {} evp/bonds: the name of the bond file is empty", id);
      continue;
    }
    try {
      zone = EVP::parse_number("zone", arg[iarg + 1]);
    } catch (const EVP::BadInput &bad) {
      error->all(FLERR, "Fix {} evp/bonds: {}", id, bad.what());
    }
    if (!(zone > 1.0))
      error->all(FLERR,
                 "Fix {} evp/bonds: zone must be greater than 1 (pairs with d <= zone (R_i + R_j) "
                 "are recorded), got {}",
                 id, arg[iarg + 1]);
  }
  if (zone > 0.0 && !file.empty())
    error->all(FLERR,
               "Fix {} evp/bonds: the bonds come from the zone or from a file, give one of the two",
               id);
  // a fix that takes the place of one of its name finds none
  if (const Fix *other = EVP::scene::find_fix(modify, style))
    error->all(FLERR,
               "Fix {} evp/bonds: fix {} records bonds already, and a pair has one deq: use one "
               "fix evp/bonds, or 'unfix {}' first",
               id, other->id, other->id);

  restart_global = restart_peratom = 1;
  create_attribute = 1;
  stores_ids = 1;
  maxexchange_dynamic = 1;
  scalar_flag = vector_flag = 1;
  size_vector = 4;
  global_freq = 1;
  extscalar = extvector = 0;

  FixEVPBonds::grow_arrays(atom->nmax);
  make_room_for(1);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

/* ---------------------------------------------------------------------- */

FixEVPBonds::~FixEVPBonds()
{
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);

  // at the end of LAMMPS the pair style goes first
  PairEVPLJ *pair = force ? find_pair() : nullptr;
  if (pair) pair->bonds_recorded_by("");
}

/* ---------------------------------------------------------------------- */

int FixEVPBonds::setmask()
{
  return PRE_FORCE | MIN_PRE_FORCE;
}

/* ---------------------------------------------------------------------- */

PairEVPLJ *FixEVPBonds::find_pair() const
{
  return PairEVPLJ::find(force);
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::init()
{
  const std::string who = fmt::format("Fix {} evp/bonds", id);
  const PairEVPLJ *pair = EVP::scene::require_pair(force, error, who);
  EVP::scene::refuse_respa(update, error, who);

  int most;
  MPI_Allreduce(&most_bonds, &most, 1, MPI_INT, MPI_MAX, world);
  make_room_for(most);

  check_restored();
  counted_step = -1;
  if (recorded)
    check_ids();
  else if (file.empty()) {
    check_zone(pair);
    neighbor->add_request(this, NeighConst::REQ_FULL | NeighConst::REQ_OCCASIONAL);
  }
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::init_list(int /*id*/, NeighList *list_in)
{
  list = list_in;
}

/* ----------------------------------------------------------------------
   the neighbor list ends at alpha (R_i + R_j) plus a skin that must not matter
------------------------------------------------------------------------- */

void FixEVPBonds::check_zone(const PairEVPLJ *pair) const
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      const double alpha = pair->alpha_of(i, j);
      if (alpha > 0.0 && zone > alpha)
        error->all(FLERR,
                   "Fix {} evp/bonds: zone {} reaches beyond what the neighbor list can see, alpha "
                   "= {} of types {} and {}: use a zone of at most alpha",
                   id, zone, alpha, i, j);
    }
}

/* ----------------------------------------------------------------------
   records name atoms by ID: an ID that another atom has now would hand them on
------------------------------------------------------------------------- */

FixEVPBonds::Misplaced FixEVPBonds::find_misplaced() const
{
  Misplaced found = {0, 0};
  for (int i = 0; i < atom->nlocal; i++) {
    const tagint id_now = atom->tag[i];
    if (recorded_as[i] == 0 && id_now <= highest_id) found.newcomer = id_now;
    if (recorded_as[i] != 0 && recorded_as[i] != id_now) found.renumbered = id_now;
  }
  return found;
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::check_ids() const
{
  const Misplaced found = recorded ? find_misplaced() : Misplaced{0, 0};
  tagint here[2] = {found.renumbered, found.newcomer}, any[2];
  MPI_Allreduce(here, any, 2, MPI_LMP_TAGINT, MPI_MAX, world);
  if (any[0] || any[1]) error->all(FLERR, misplaced_message({any[0], any[1]}));
}

/* ---------------------------------------------------------------------- */

std::string FixEVPBonds::misplaced_message(Misplaced atoms) const
{
  const std::string anew = fmt::format(
      "or 'unfix {}' and define it again, which takes the body as it is now for undeformed", id);
  if (atoms.renumbered && restored_late)
    return fmt::format(
        "Fix {} evp/bonds: atom ID {} was given the bonds of another atom: define the fix right "
        "after read_restart, before atoms are deleted; if IDs had changed before the restart file "
        "was written, go back to an earlier one, {}",
        id, atoms.renumbered, anew);
  if (atoms.renumbered)
    return fmt::format(
        "Fix {} evp/bonds: atom ID {} belongs to another atom than when the bonds were recorded: "
        "use 'delete_atoms ... compress no' and no reset_atoms id, {}",
        id, atoms.renumbered, anew);
  return fmt::format(
      "Fix {} evp/bonds: the new atom {} has the ID of a deleted one, whose bonds it would take "
      "over: create atoms before that of the highest ID is deleted, read them by 'read_data ... "
      "add {}', or define 'fix deposit ... id next' before the deletion; {}",
      id, atoms.newcomer, highest_id, anew);
}

/* ---------------------------------------------------------------------- */

std::string FixEVPBonds::how_to_replicate() const
{
  return fmt::format("'unfix {}', replicate, and define the fix again", id);
}

/* ---------------------------------------------------------------------- */

void FixEVPBonds::setup_pre_force(int /*vflag*/)
{
  if (!recorded) record();
}

/* ---------------------------------------------------------------------- */

double FixEVPBonds::find_deq(int i, tagint partner) const
{
  for (const Bond &bond : bonds[i])
    if (bond.partner == partner) return bond.deq;
  return 0.0;
}

/* ---------------------------------------------------------------------- */

FixEVPBonds::Bonds FixEVPBonds::sorted_bonds_of(int i) const
{
  Bonds sorted = bonds[i];
  std::sort(sorted.begin(), sorted.end(), [](const Bond &a, const Bond &b) {
    return a.partner < b.partner;
  });
  return sorted;
}

/* ----------------------------------------------------------------------
   an atom with many partners may have held this place: the next one needs no such room
------------------------------------------------------------------------- */

void FixEVPBonds::give_back_room(int i, size_t needed)
{
  if (bonds[i].capacity() > 2 * needed + 16) Bonds().swap(bonds[i]);
}

/* ----------------------------------------------------------------------
   LAMMPS' buffers for one atom must hold the longest record of any process: the first one says in
   restart files how long that is
------------------------------------------------------------------------- */

void FixEVPBonds::make_room_for(int n)
{
  most_bonds = std::max(most_bonds, n);
  maxexchange = 2 + 2 * most_bonds;
}

/* ----------------------------------------------------------------------
   f_ID: pairs recorded. f_ID[1..4]: beyond dlim, in the second regime, new pairs that
   interact, lowest d/(R_i + R_j)
------------------------------------------------------------------------- */

double FixEVPBonds::compute_scalar()
{
  return (double) nrecorded;
}

/* ---------------------------------------------------------------------- */

double FixEVPBonds::compute_vector(int n)
{
  if (update->whichflag != 0 && counted_step == update->ntimestep) return pair_counts[n];

  const PairEVPLJ *pair = EVP::scene::find_present(force);
  if (!pair && update->whichflag == 0)
    error->all(FLERR,
               "Fix {} evp/bonds: f_{}[{}] needs the pairs of the present atoms: use 'run 0' first "
               "(since the last run atoms moved by more than half the skin, were changed, added or "
               "removed, or a command such as write_data rebuilt the lists of LAMMPS)",
               id, id, n + 1);
  if (pair) {
    const PairEVPLJ::Counts counts = pair->count_pairs();
    pair_counts[0] = nrecorded - counts.bonds_within;
    pair_counts[1] = counts.bonds_second;
    pair_counts[2] = counts.new_pairs;
    pair_counts[3] = counts.lowest_ratio;
    counted_step = update->ntimestep;
  }
  return pair_counts[n];
}
