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
  pair_work.stored.assign(*network);    // the pair style may be another than in the last run
  if (!started) {
    // for all instants that are compared with the start
    pair_work.stored.set_largest_depth(
        EVP::reduce_all(pair_work.stored.total_depth(), MPI_SUM, world));
  }
  evaluate(true);
  if (!started) start = last;
  started = true;
  end_instant();
}

void FixEVPEnergy::post_integrate()
{
  dt_step = update->dt;
  dissipated_at_begin = dissipated_in_half_step(true);
  for (int i = 0; i < atom->nlocal; i++) records[i].forces = forces_on(i);
}

void FixEVPEnergy::end_of_step()
{
  evaluate(false);
  advance();
  end_instant();
}

// velocity per force in half a step; none where forces do not move the atom
double FixEVPEnergy::half_kick(int i) const
{
  return is_driven(i) ? 0.5 * dt_step * EVP::scene::inverse_mass(atom, force, i) : 0.0;
}

// does fix nve/evp solve for the damping?
bool FixEVPEnergy::is_solved() const
{
  return implicit && network->damps_implicitly();
}

// last, and the forces of the pairs on local atoms.
// Within a run the pair style saw the half-step velocities, at set-up those of the atoms.
// A bond's energy counts from its rest; what it cost to take one beyond dlim stays in the balance as
// the depth that is missing
void FixEVPEnergy::evaluate(bool at_setup)
{
  const EVP::PairList &list = network->packed_pairs();
  const bool damps = network->damps_explicitly();

  Instant here{};    // of this MPI rank
  pair_work.velocity.resize((size_t) 3 * list.nall);
  for (int i = 0; i < atom->nlocal; i++) {
    const double half = at_setup ? 0.0 : half_kick(i);
    const double weight = is_driven(i) ? 0.5 * force->mvv2e * EVP::scene::mass(atom, i) : 0.0;
    for (int c = 0; c < 3; c++) {
      const double v = atom->v[i][c];
      pair_work.velocity[(size_t) 3 * i + c] = v - half * atom->f[i][c];
      here.kinetic += weight * v * v;    // movers enter by their work only
    }
  }
  if (damps) to_ghosts(pair_work.velocity);

  const int nreact = force->newton_pair ? list.nall : list.nlocal;
  here.pairs = pair_work.evaluate(*network, EVP::scene::rows(atom->x), nreact);
  to_owners(pair_work.force);
  if (damps) to_owners(pair_work.damping);
  static_assert(sizeof(Instant) % sizeof(double) == 0, "an Instant is a row of numbers");
  MPI_Allreduce(&here, &last, sizeof(Instant) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
}

EVP::AtomForces FixEVPEnergy::forces_on(int i) const
{
  EVP::AtomForces now;
  for (int c = 0; c < 3; c++) {
    const size_t k = (size_t) 3 * i + c;
    const double of_pairs =
        pair_work.force[k] + (is_solved() ? implicit->applied_damping()[k] : 0.0);
    now.damping[c] = pair_work.damping[k];
    now.working[c] = is_driven(i) ? atom->f[i][c] - now.damping[c] - of_pairs : of_pairs;
  }
  return now;
}

// on this MPI rank, by the damping of driven atoms over the half step before or after the present positions.
// At the beginning of a step atoms hold the half-step velocity by now, at its end that of the full step:
// of either the mean over the half step is half of its kick away
double FixEVPEnergy::dissipated_in_half_step(bool at_begin) const
{
  double sum = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_driven(i)) continue;
    const double half = half_kick(i);
    for (int c = 0; c < 3; c++)
      sum -= pair_work.damping[(size_t) 3 * i + c] * (atom->v[i][c] - 0.5 * half * atom->f[i][c]);
  }
  if (is_solved()) sum += at_begin ? implicit->power_after() : implicit->power_before();
  return 0.5 * dt_step * sum;
}

// Works and dissipation of the step that ends. What damping gives back where a velocity turns within a
// step is deducted from what it takes next
void FixEVPEnergy::advance()
{
  double dissipated = dissipated_at_begin + dissipated_in_half_step(false);
  double movers = 0.0, others = 0.0;    // on this MPI rank, as dissipated
  for (int i = 0; i < atom->nlocal; i++) {
    const EVP::AtomPast &then = records[i];
    const EVP::AtomForces now = forces_on(i);
    double x[3];
    domain->unmap(atom->x[i], atom->image[i], x);
    for (int c = 0; c < 3; c++) {
      const double dx = x[c] - then.x[c];
      const double work = 0.5 * (then.forces.working[c] + now.working[c]) * dx;
      if (is_driven(i))
        others += work;
      else {
        const double damped = 0.5 * (then.forces.damping[c] + now.damping[c]) * dx;
        dissipated -= damped;
        movers -= work + damped;
      }
    }
  }
  const auto all = EVP::reduce_all(std::array{dissipated, movers, others}, MPI_SUM, world);
  taken += all[0];
  entries[DISSIPATED] = std::max(entries[DISSIPATED], taken);
  entries[MOVERS] += all[1];
  entries[OTHERS] += all[2];
}

// what is held at the end of a step, and where the next one begins
void FixEVPEnergy::end_instant()
{
  entries[KINETIC] = last.kinetic - start.kinetic;
  entries[FIRST] = last.pairs.first - start.pairs.first;
  entries[SECOND] = last.pairs.second - start.pairs.second;
  entries[LOST] = EVP::StoredEnergy::lost(start.pairs, last.pairs);
  entries[CONTACTS] = EVP::StoredEnergy::of_contacts(start.pairs, last.pairs);
  for (int i = 0; i < atom->nlocal; i++) domain->unmap(atom->x[i], atom->image[i], records[i].x);
}

// f_ID: energy imbalance. f_ID[1..8], changes since the start: kinetic, stored in bonds up to xi_s
// and beyond it, spent on lost bonds, new contacts; dissipated by gamma; work of the movers, of all
// other forces
double FixEVPEnergy::compute_scalar()
{
  double imbalance = 0.0;
  for (const Entry entry : {KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED})
    imbalance += entries[entry];
  return imbalance - entries[MOVERS] - entries[OTHERS];
}

// an atom that comes during a run brings no work with it
void FixEVPEnergy::set_arrays(int i)
{
  records[i] = {};
  domain->unmap(atom->x[i], atom->image[i], records[i].x);
}
