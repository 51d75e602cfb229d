/* SPDX-License-Identifier: GPL-2.0-only

   Fix evp/energy: its life, what users read of it, the data of atoms. The sums are in
   fix_evp_energy_sums.cpp. */

#include "fix_evp_energy.h"

#include "fix_nve_evp.h"
#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "domain.h"
#include "error.h"
#include "memory.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;

/* ---------------------------------------------------------------------- */

FixEVPEnergy::FixEVPEnergy(LAMMPS *lmp, int narg, char **arg) :
    NodalExchange(lmp, narg, arg), pair(nullptr), implicit(nullptr), driven_groupbits(0),
    started(false), dt_step(0.0), start{}, last{}, dissipated_at_begin(0.0), taken(0.0), ledger{},
    past(nullptr)
{
  if (narg != 3)
    error->all(FLERR, "Fix {} evp/energy takes no further words, got '{}'", id, arg[3]);
  if (igroup != 0)
    error->all(FLERR,
               "Fix {} evp/energy needs group all: the balance of a part is not closed by its own "
               "entries",
               id);
  nevery = 1;
  create_attribute = 1;
  maxexchange = PAST_SIZE;
  scalar_flag = vector_flag = 1;
  size_vector = NENTRIES;
  global_freq = 1;
  extscalar = extvector = 0;

  FixEVPEnergy::grow_arrays(atom->nmax);
  for (int i = 0; i < atom->nlocal; i++) FixEVPEnergy::set_arrays(i);
  atom->add_callback(Atom::GROW);
}

/* ---------------------------------------------------------------------- */

FixEVPEnergy::~FixEVPEnergy()
{
  atom->delete_callback(id, Atom::GROW);
  memory->destroy(past);
}

/* ---------------------------------------------------------------------- */

int FixEVPEnergy::setmask()
{
  return POST_INTEGRATE | END_OF_STEP;
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::init()
{
  const std::string who = fmt::format("Fix {} evp/energy", id);
  pair = PairNetwork::require(force, error, who);
  EVP::scene::refuse_respa(update, error, who);
  if (domain->deform_vremap)
    error->all(FLERR,
               "Fix {} evp/energy does not know the velocity of a deforming box: use fix deform "
               "without 'remap v'",
               id);
  driven_groupbits = 0;
  implicit = nullptr;
  for (const Fix *other : modify->get_fix_list()) {
    if (EVP::scene::moves_by_forces(other)) driven_groupbits |= other->groupbit;
    if (strcmp(other->style, "nve/evp") == 0) implicit = dynamic_cast<const FixNVEEVP *>(other);
  }
}

/* ----------------------------------------------------------------------
   what acts in the first half step is not known yet: fixes that are defined after this one may add
   forces and change dt
------------------------------------------------------------------------- */

void FixEVPEnergy::setup(int /*vflag*/)
{
  if (update->whichflag != 1) return;
  find_depths(pair->packed_pairs());    // the pair style may be another than in the last run
  if (!started) find_largest_depth();
  evaluate(true);
  if (!started) start = last;
  started = true;
  update_states();
  remember_places();
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::post_integrate()
{
  dt_step = update->dt;
  dissipated_at_begin = dissipated_in_half_step(true);
  remember_forces();
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::end_of_step()
{
  evaluate(false);
  advance();
  update_states();
  remember_places();
}

/* ----------------------------------------------------------------------
   f_ID: energy imbalance. f_ID[1..8], changes since the start: kinetic, stored in bonds up to xi_s
   and beyond it, spent on lost bonds, new contacts; dissipated by gamma; work of the movers, of all
   other forces
------------------------------------------------------------------------- */

double FixEVPEnergy::compute_scalar()
{
  double imbalance = 0.0;
  for (const Entry entry : {KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED})
    imbalance += ledger[entry];
  return imbalance - ledger[MOVERS] - ledger[OTHERS];
}

/* ---------------------------------------------------------------------- */

double FixEVPEnergy::compute_vector(int n)
{
  return ledger[n];
}

/* ---------------------------------------------------------------------- */

double FixEVPEnergy::memory_usage()
{
  double bytes = (double) PAST_SIZE * atom->nmax * sizeof(double) + stored.memory_usage();
  for (const auto *values : {&velocities, &pair_force, &damping_force})
    bytes += (double) values->capacity() * sizeof(double);
  return bytes;
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::grow_arrays(int nmax)
{
  static_assert(sizeof(Past) == PAST_SIZE * sizeof(double), "a Past travels as its numbers");
  memory->grow(past, nmax, PAST_SIZE, "evp/energy:past");
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::copy_arrays(int i, int j, int /*delflag*/)
{
  std::copy_n(past[i], PAST_SIZE, past[j]);
}

/* ----------------------------------------------------------------------
   an atom that comes during a run brings no work with it
------------------------------------------------------------------------- */

void FixEVPEnergy::set_arrays(int i)
{
  std::fill_n(past[i], PAST_SIZE, 0.0);
  domain->unmap(atom->x[i], atom->image[i], past[i]);
}

/* ---------------------------------------------------------------------- */

int FixEVPEnergy::pack_exchange(int i, double *buf)
{
  std::copy_n(past[i], PAST_SIZE, buf);
  return PAST_SIZE;
}

/* ---------------------------------------------------------------------- */

int FixEVPEnergy::unpack_exchange(int i, double *buf)
{
  std::copy_n(buf, PAST_SIZE, past[i]);
  return PAST_SIZE;
}
