/* SPDX-License-Identifier: GPL-2.0-only */

#include "fix_evp_energy.h"

#include "fix_nve_evp.h"
#include "lammps_compat.h"
#include "pair_evp_lj.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;

/* ---------------------------------------------------------------------- */

FixEVPEnergy::FixEVPEnergy(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), pair(nullptr), implicit(nullptr), driven_groupbits(0), started(false),
    depth_at_start(0.0), dt_step(0.0), start{}, last{}, ledger{}, past(nullptr)
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
  comm_forward = comm_reverse = 3;
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
  pair = PairEVPLJ::find(force);
  if (!pair)
    error->all(FLERR, "Fix {} evp/energy needs pair style evp/lj, found '{}'", id,
               force->pair_style ? force->pair_style : "none");
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "Fix {} evp/energy does not work with run_style respa: use run_style verlet",
               id);
  if (domain->deform_vremap)
    error->all(FLERR,
               "Fix {} evp/energy does not know the velocity of a deforming box: use fix deform "
               "without 'remap v'",
               id);
  driven_groupbits = 0;
  implicit = nullptr;
  bool after_this = false;
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *other = modify->fix[k];
    if (other == this) after_this = true;
    if (after_this && strcmp(other->style, "nve/evp") == 0)
      error->all(FLERR,
                 "Fix {} evp/energy reads at set-up the damping that fix {} nve/evp has applied by "
                 "then: define it after that fix ('unfix {}' and define it again)",
                 id, other->id, id);
    const bool prescribes = strcmp(other->style, "nve/noforce") == 0 ||
        strcmp(other->style, "move") == 0;
    if (other->time_integrate && !prescribes) driven_groupbits |= other->groupbit;
    if (strcmp(other->style, "nve/evp") == 0) implicit = dynamic_cast<const FixNVEEVP *>(other);
  }
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::setup(int /*vflag*/)
{
  if (update->whichflag != 1) return;
  dt_step = update->dt;
  find_velocities(true);
  const Instant now = evaluate();
  if (!started) {
    start = now;
    depth_at_start = now.depth;
    started = true;
  }
  last = now;
  remember();
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::post_integrate()
{
  dt_step = update->dt;
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::end_of_step()
{
  find_velocities(false);
  const Instant now = evaluate();
  advance(now, dt_step);
  last = now;
  remember();
}

/* ---------------------------------------------------------------------- */

bool FixEVPEnergy::is_driven(int i) const
{
  return atom->mask[i] & driven_groupbits;
}

/* ----------------------------------------------------------------------
   Between steps atoms hold the mean of the two half-step velocities, and f what
   takes one to the other. At set-up the pair style saw the mean itself.
------------------------------------------------------------------------- */

void FixEVPEnergy::find_velocities(bool at_setup)
{
  const size_t nall = atom->nlocal + atom->nghost;
  for (auto *velocity : {&mean, &before, &after}) velocity->resize(3 * nall);
  for (int i = 0; i < atom->nlocal; i++) {
    const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
    const double half = is_driven(i) ? 0.5 * dt_step * force->ftm2v / mass : 0.0;
    for (int c = 0; c < 3; c++) {
      const size_t k = (size_t) 3 * i + c;
      mean[k] = atom->v[i][c];
      before[k] = at_setup ? mean[k] : mean[k] - half * atom->f[i][c];
      after[k] = mean[k] + half * atom->f[i][c];
    }
  }
  for (auto *velocity : {&mean, &before}) to_ghosts(*velocity);    // what the dampers ask of pairs
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::to_ghosts(std::vector<double> &values)
{
  exchanged.swap(values);
  EVP::compat::forward_comm(comm, this);
  exchanged.swap(values);
}

/* ----------------------------------------------------------------------
   pair_force is left with the force of the pairs, damping included, on local atoms.
   A bond's energy counts from its rest; what it cost to take one beyond dlim
   stays in the ledger as the depth that is missing
------------------------------------------------------------------------- */

FixEVPEnergy::Instant FixEVPEnergy::evaluate()
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  const int nreact = force->newton_pair ? nall : nlocal;
  pair_force.assign((size_t) 3 * nall, 0.0);

  double sums[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, all[6];
  for (int i = 0; i < nlocal; i++) {
    if (!is_driven(i)) continue;    // the energy of a mover is its own affair
    const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
    for (int c = 0; c < 3; c++) {
      const size_t k = (size_t) 3 * i + c;
      const double kick = after[k] - mean[k];
      sums[0] += 0.5 * force->mvv2e * mass * (mean[k] * mean[k] + kick * kick);
    }
  }

  const EVP::PackedList &list = pair->packed_pairs();
  const auto x = reinterpret_cast<const double(*)[3]>(atom->x[0]);
  for (const auto &row : list.rows)
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &p = list.pairs[n];
      const int i = row.i, j = p.j;
      const EVP::PairGeometry g(x, i, j);
      if (g.dsq > p.cutsq) continue;
      // without newton both owners of a pair across processes hold it
      const double weight = j < nreact ? 1.0 : 0.5;
      const double d = std::sqrt(g.dsq), deq = 1.0 / p.inv_deq, cut = std::sqrt(p.cutsq);

      const EVP::Law &law = pair->law_of(p);
      if (p.is_bond) {
        const double xi_s = law.parameters().xi_s;
        const double xi = std::min(std::max(d / deq - 1.0, -xi_s), xi_s);
        const double first = law.energy(deq * (1.0 + xi), deq, deq);
        sums[1] += weight * first;
        sums[2] += weight * (law.energy(d, deq, deq) - first);
        sums[3] += weight * law.energy(cut, deq, deq);
      } else
        sums[4] += weight * law.energy(d, deq, cut);

      double over_d = law.force(d, deq) / d;
      const double gamma = law.parameters().gamma;    // without that of implicit pairs
      if (gamma > 0.0) {
        const double damping =
            EVP::damping_over_distance(gamma, g, &before[(size_t) 3 * i], &before[(size_t) 3 * j]);
        const double *vi = &mean[(size_t) 3 * i], *vj = &mean[(size_t) 3 * j];
        sums[5] -= weight * damping *
            (g.dx * (vi[0] - vj[0]) + g.dy * (vi[1] - vj[1]) + g.dz * (vi[2] - vj[2]));
        over_d += damping;
      }
      const double f[3] = {over_d * g.dx, over_d * g.dy, over_d * g.dz};
      for (int c = 0; c < 3; c++) {
        pair_force[(size_t) 3 * i + c] += f[c];
        if (j < nreact) pair_force[(size_t) 3 * j + c] -= f[c];
      }
    }

  if (force->newton_pair) {
    exchanged.swap(pair_force);
    EVP::compat::reverse_comm(comm, this);
    exchanged.swap(pair_force);
  }
  if (implicit && pair->damps_implicitly())
    for (int i = 0; i < nlocal; i++)
      for (int c = 0; c < 3; c++) {
        const size_t k = (size_t) 3 * i + c;
        const double damping = implicit->applied_damping()[k];
        sums[5] -= damping * mean[k];
        pair_force[k] += damping;
      }
  MPI_Allreduce(sums, all, 6, MPI_DOUBLE, MPI_SUM, world);
  return {all[0], all[1], all[2], all[3], all[4], all[5]};
}

/* ----------------------------------------------------------------------
   from the last step to this one
------------------------------------------------------------------------- */

void FixEVPEnergy::advance(const Instant &now, double dt)
{
  double work[2] = {0.0, 0.0}, all[2];    // of the movers, of other forces
  for (int i = 0; i < atom->nlocal; i++) {
    Past then;
    memcpy(&then, past[i], sizeof(then));
    double x[3];
    domain->unmap(atom->x[i], atom->image[i], x);
    for (int c = 0; c < 3; c++) {
      const double dx = x[c] - then.x[c], pairs = pair_force[(size_t) 3 * i + c];
      if (is_driven(i))
        work[1] += 0.5 * (then.others[c] + atom->f[i][c] - pairs) * dx;
      else
        work[0] -= 0.5 * (then.pairs[c] + pairs) * dx;
    }
  }
  MPI_Allreduce(work, all, 2, MPI_DOUBLE, MPI_SUM, world);

  ledger[KINETIC] = now.kinetic - start.kinetic;
  ledger[FIRST] = now.first - start.first;
  ledger[SECOND] = now.second - start.second;
  ledger[LOST] = depth_at_start - now.depth;
  ledger[CONTACTS] = now.contacts - start.contacts;
  ledger[DISSIPATED] += 0.5 * dt * (last.dissipation + now.dissipation);
  ledger[MOVERS] += all[0];
  ledger[OTHERS] += all[1];
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::remember()
{
  for (int i = 0; i < atom->nlocal; i++) {
    Past now;
    domain->unmap(atom->x[i], atom->image[i], now.x);
    for (int c = 0; c < 3; c++) {
      now.pairs[c] = pair_force[(size_t) 3 * i + c];
      now.others[c] = atom->f[i][c] - now.pairs[c];
    }
    memcpy(past[i], &now, sizeof(now));
  }
}

/* ----------------------------------------------------------------------
   f_ID: what the ledger is open by. f_ID[1..8], changes since the start: kinetic, stored in
   bonds up to xi_s and beyond it, spent on lost bonds, new contacts; dissipated by gamma;
   work of the movers, of all other forces
------------------------------------------------------------------------- */

double FixEVPEnergy::compute_scalar()
{
  double open = 0.0;
  for (const Entry entry : {KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED})
    open += ledger[entry];
  return open - ledger[MOVERS] - ledger[OTHERS];
}

/* ---------------------------------------------------------------------- */

double FixEVPEnergy::compute_vector(int n)
{
  return ledger[n];
}

/* ---------------------------------------------------------------------- */

double FixEVPEnergy::memory_usage()
{
  double bytes = (double) PAST_SIZE * atom->nmax * sizeof(double);
  for (const auto *values : {&exchanged, &mean, &before, &after, &pair_force})
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

/* ---------------------------------------------------------------------- */

int FixEVPEnergy::pack_forward_comm(int n, int *indices, double *buf, int /*pbc_flag*/,
                                    int * /*pbc*/)
{
  for (int k = 0; k < n; k++) std::copy_n(&exchanged[(size_t) 3 * indices[k]], 3, buf + 3 * k);
  return 3 * n;
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::unpack_forward_comm(int n, int first, double *buf)
{
  std::copy_n(buf, 3 * n, &exchanged[(size_t) 3 * first]);
}

/* ---------------------------------------------------------------------- */

int FixEVPEnergy::pack_reverse_comm(int n, int first, double *buf)
{
  std::copy_n(&exchanged[(size_t) 3 * first], 3 * n, buf);
  return 3 * n;
}

/* ---------------------------------------------------------------------- */

void FixEVPEnergy::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++)
    for (int c = 0; c < 3; c++) exchanged[(size_t) 3 * indices[k] + c] += buf[3 * k + c];
}
