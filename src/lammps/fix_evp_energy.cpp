// SPDX-License-Identifier: GPL-2.0-only

#include "fix_evp_energy.h"

#include "collective.h"
#include "fix_nve_evp.h"
#include "pair_network.h"
#include "scene.h"

#include "domain.h"

#include <algorithm>

using namespace LAMMPS_NS;

FixEVPEnergy::FixEVPEnergy(LAMMPS *lmp, int narg, char **arg) : AtomRecords(lmp, narg, arg)
{
  if (narg != 3) error->all(FLERR, "{}: unexpected argument '{}'", who, arg[3]);
  if (igroup != 0)
    error->all(FLERR, "{} needs group all: the balance of a part is not closed by its own entries",
               who);
  nevery = 1;
  EVP::scene::offer_values(this, NENTRIES);
  follow_atoms();
  keep_records();
}

void FixEVPEnergy::init()
{
  network = PairNetwork::require(force, error, who);
  EVP::scene::refuse_respa(update, error, who);
  if (domain->deform_vremap)
    error->all(FLERR,
               "{} does not know the velocity of a deforming box: use fix deform without 'remap v'",
               who);
  implicit = dynamic_cast<const FixNVEEVP *>(EVP::scene::find_fix(modify, "nve/evp"));
  driven_groupbits = 0;
  for (const Fix *other : modify->get_fix_list())
    if (EVP::scene::moves_by_forces(other)) driven_groupbits |= other->groupbit;
}

// what acts in the first half step is not known yet: fixes that are defined after this one may add
// forces and change dt
void FixEVPEnergy::setup(int /*vflag*/)
{
  if (update->whichflag != 1) return;
  if (!started)    // for all instants that are compared with the start
    work->stored.set_largest_depth(
        EVP::reduce_all(work->stored.total_depth(), MPI_SUM, world), network->packed_pairs());
  take_work();
  last = over_all_ranks({instant_here(), {}}).instant;
  if (!started) start = last;
  started = true;
  end_instant();
}

void FixEVPEnergy::post_integrate()
{
  dt_step = update->dt;
  const double *const solved = solved_damping();
  for (int i = 0; i < atom->nlocal; i++) records[i].forces = forces_on(i, solved);
  dissipated_at_begin = dissipated_in_half_step();
  if (solved) dissipated_at_begin += 0.5 * dt_step * implicit->power_after();
}

// What damping gives back where a velocity turns within a step is deducted from what it takes next
void FixEVPEnergy::end_of_step()
{
  take_work();
  const Totals now = over_all_ranks({instant_here(), works_of_step()});
  last = now.instant;
  taken += now.works.dissipated;
  entries[DISSIPATED] = std::max(entries[DISSIPATED], taken);
  entries[MOVERS] += now.works.movers;
  entries[OTHERS] += now.works.others;
  entries[PLASTIC] += now.instant.pairs.plastic;
  entries[BROKEN] += now.works.broken;
  end_instant();
}

// where the force loop went over the pairs since; not so where rerun ends its step right after set-up
void FixEVPEnergy::take_work()
{
  if (!work->take()) return;
  to_owners(work->force);
  if (!work->damping.empty()) to_owners(work->damping);
}

// velocity per force in half a step; none where forces do not move the atom
double FixEVPEnergy::half_kick(int i) const
{
  return is_driven(i) ? 0.5 * dt_step * EVP::scene::inverse_mass(atom, force, i) : 0.0;
}

// what fix nve/evp adds to f, nullptr where it damps nothing
const double *FixEVPEnergy::solved_damping() const
{
  return implicit && network->damps_implicitly() ? implicit->applied_damping().data() : nullptr;
}

// on this MPI rank.
// A bond's energy counts from its rest; what it cost to take one beyond dlim stays in the balance as
// the depth that is missing
FixEVPEnergy::Instant FixEVPEnergy::instant_here() const
{
  double kinetic = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_driven(i)) continue;    // movers enter by their work only
    const double weight = 0.5 * force->mvv2e * EVP::scene::mass(atom, i);
    const double *const v = atom->v[i];
    kinetic += weight * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  return {kinetic, volume_energy(), work->stored.sums()};
}

// energy that atoms hold by the change of their volume, on this MPI rank: there is none yet
double FixEVPEnergy::volume_energy() const
{
  return 0.0;
}

// what bonds stored that broke in the step under way, on this MPI rank: none breaks yet
double FixEVPEnergy::released_by_broken_bonds() const
{
  return 0.0;
}

FixEVPEnergy::Totals FixEVPEnergy::over_all_ranks(Totals totals) const
{
  static_assert(sizeof(Totals) % sizeof(double) == 0, "Totals are a row of numbers");
  MPI_Allreduce(MPI_IN_PLACE, &totals, sizeof(Totals) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
  return totals;
}

EVP::AtomForces FixEVPEnergy::forces_on(int i, const double *solved) const
{
  const size_t first = (size_t) 3 * i;
  const double *const damping = work->damping.empty() ? nullptr : &work->damping[first];
  const double *const pairs = &work->force[first];    // damping included
  const bool driven = is_driven(i);
  EVP::AtomForces now;
  for (int c = 0; c < 3; c++) {
    now.damping[c] = damping ? damping[c] : 0.0;
    const double by_fix = solved ? solved[first + c] : 0.0;
    now.working[c] =
        driven ? atom->f[i][c] - pairs[c] - by_fix : pairs[c] - now.damping[c] + by_fix;
  }
  return now;
}

// on this MPI rank, by the explicit damping of driven atoms over the half step before or after the present
// positions. At the beginning of a step atoms hold the half-step velocity by now, at its end that of the full
// step: of either the mean over the half step is half of its kick away
double FixEVPEnergy::dissipated_in_half_step() const
{
  double sum = 0.0;
  if (work->damping.empty()) return sum;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_driven(i)) continue;
    const double half = half_kick(i);
    for (int c = 0; c < 3; c++)
      sum -= work->damping[(size_t) 3 * i + c] * (atom->v[i][c] - 0.5 * half * atom->f[i][c]);
  }
  return 0.5 * dt_step * sum;
}

// of the step that ends, on this MPI rank
FixEVPEnergy::Works FixEVPEnergy::works_of_step() const
{
  const double *const solved = solved_damping();
  Works works{};
  works.broken = released_by_broken_bonds();
  works.dissipated = dissipated_at_begin + dissipated_in_half_step();
  if (solved) works.dissipated += 0.5 * dt_step * implicit->power_before();
  for (int i = 0; i < atom->nlocal; i++) {
    const EVP::AtomPast &then = records[i];
    const EVP::AtomForces now = forces_on(i, solved);
    double x[3], work_done = 0.0, damped = 0.0;
    unwrap(i, x);
    for (int c = 0; c < 3; c++) {
      const double dx = x[c] - then.x[c];
      work_done += 0.5 * (then.forces.working[c] + now.working[c]) * dx;
      damped += 0.5 * (then.forces.damping[c] + now.damping[c]) * dx;
    }
    if (is_driven(i))
      works.others += work_done;
    else {
      works.dissipated -= damped;
      works.movers -= work_done + damped;
    }
  }
  return works;
}

// as Domain::unmap, which most atoms have no need of
void FixEVPEnergy::unwrap(int i, double *x) const
{
  constexpr imageint HOME =
      ((imageint) IMGMAX << IMG2BITS) | ((imageint) IMGMAX << IMGBITS) | IMGMAX;
  if (atom->image[i] == HOME)
    std::copy_n(atom->x[i], 3, x);
  else
    domain->unmap(atom->x[i], atom->image[i], x);
}

// what is held at the end of a step, and where the next one begins
void FixEVPEnergy::end_instant()
{
  entries[KINETIC] = last.kinetic - start.kinetic;
  entries[FIRST] = last.pairs.first - start.pairs.first;
  entries[SECOND] = last.pairs.second - start.pairs.second;
  entries[LOST] = EVP::StoredEnergy::lost(start.pairs, last.pairs);
  entries[CONTACTS] = EVP::StoredEnergy::of_contacts(start.pairs, last.pairs);
  entries[HARDENING] = last.pairs.hardening - start.pairs.hardening;
  entries[VOLUME] = last.volume - start.volume;
  for (int i = 0; i < atom->nlocal; i++) unwrap(i, records[i].x);
}

// f_ID: energy imbalance. f_ID[1..12], changes since the start: kinetic, stored in bonds up to xi_s
// and beyond it, spent on lost bonds, new contacts; dissipated by gamma; work of the movers, of all
// other forces; dissipated by flow, stored by hardening, released by broken bonds, volume energy
double FixEVPEnergy::compute_scalar()
{
  double imbalance = 0.0;
  for (const Entry entry : {KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED, PLASTIC, HARDENING,
                            BROKEN, VOLUME})
    imbalance += entries[entry];
  return imbalance - entries[MOVERS] - entries[OTHERS];
}

// an atom that comes during a run brings no work with it
void FixEVPEnergy::set_arrays(int i)
{
  records[i] = {};
  unwrap(i, records[i].x);
}
