// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/energy/fix_evp_energy.h"

#include "lammps/base/collective.h"
#include "lammps/base/restart_file.h"

#include "domain.h"
#include "group.h"

using namespace LAMMPS_NS;
using namespace EVP;

static constexpr double RESTART_FORMAT = 2013;    // first word of our section in restart files

FixEVPEnergy::FixEVPEnergy(LAMMPS *lmp, int narg, char **arg) : AtomRecords(lmp, narg, arg)
{
  if (narg != 3) error->all(FLERR, "{}: unexpected argument '{}'", who, arg[3]);
  if (igroup != 0)
    error->all(FLERR,
               "{} needs group all: the energy balance of a part of the atoms does not close", who);
  scene::demand_only_one(modify, error, this, who);
  restart_global = 1;
  nevery = 1;
  scene::offer_values(this, NENTRIES);
  keep_records();
  atom->add_callback(Atom::GROW);
}

void FixEVPEnergy::init()
{
  pair_data = PairData::require(force, error, who);
  scene::refuse_respa(update, error, who);
  bonds = scene::find_fix(modify, "evp/bonds");
  implicit = nullptr;
  pair_data->effects.for_each([this](const Effect &one) {
    if (one.solved_damping()) implicit = one.solved_damping();
  });
  integrated_groupbits = 0;
  for (const Fix *other : modify->get_fix_list())
    if (scene::integrates_atoms(other)) integrated_groupbits |= other->groupbit;
  work.separates = others_act();
  box.begin_run(domain->deform_vremap);
  if (box.acts)
    box.kinetic = kinetic_here();    // set-up wraps atoms
  else
    work.images.clear();
}

// a minimization has no energy balance
bool FixEVPEnergy::begin_run(PairData &pairs)
{
  work.forget();
  work.bonds_end = pairs.rules().has_history();
  return update->whichflag != 2;
}

// a bond of two MPI ranks counts half on each
void FixEVPEnergy::unlisted_bonds_found(const std::vector<UnlistedBond> &bonds)
{
  work.beyond_list = {};
  for (const UnlistedBond &bond : bonds) {
    work.beyond_list.stored.elastic += 0.5 * bond.state.stored.elastic;
    work.beyond_list.stored.second += 0.5 * bond.state.stored.second;
    work.beyond_list.dissipated += 0.5 * bond.state.dissipated;
  }
}

// the first forces of a step
void FixEVPEnergy::before_forces(const ParticleView &view)
{
  reads = !work.is_evaluated();
  if (reads) work.begin(pair_data->lists().nall, view);
}

// May anything but this pair style and fix nve/evp add to f, or may atoms change from integrated to prescribed during the run?
bool FixEVPEnergy::others_act() const
{
  using namespace FixConst;
  if (force->pair_match("evp/lj", 1) != force->pair) return true;    // one of several
  if (force->bond || force->angle || force->dihedral || force->improper || force->kspace)
    return true;
  for (int k = 0; k < modify->nfix; k++) {
    const char *const other = modify->fix[k]->style;
    if (!scene::is_ours(other) && (modify->fmask[k] & (PRE_FORCE | PRE_REVERSE | POST_FORCE)))
      return true;
    if (utils::strmatch(other, "^python")) return true;    // at any time
    if (group->dynamic[modify->fix[k]->igroup]) return true;
  }
  return false;
}

// what acts in the first half step is not known yet: fixes that are defined after this one may add
// forces and change dt
void FixEVPEnergy::setup(int /*vflag*/)
{
  if (update->whichflag != 1) return;
  reverse_comm_forces();
  if (box.acts) {
    const double done = box.begin(domain);
    if (started) now.works.box += done;
  }
  now.instant = instant_here();
  // flow that is due is in no deq yet, and the stored energies are those after it: what it will
  // dissipate in the first step, is still stored in the pairs
  now.instant.pairs.elastic += now.instant.pairs.plastic;
  summed_step = -1;
  if (!started) start = over_all_ranks(now).instant;
  started = true;
  for (int i = 0; i < atom->nlocal; i++) unwrap(i, records[i].x);
}

// of the forces since the last call; there are none where rerun ends its step right after set-up
void FixEVPEnergy::reverse_comm_forces()
{
  if (!work.claim()) return;
  if (!work.force.empty()) reverse_comm(work.force);
  if (!work.damping.empty()) reverse_comm(work.damping);
}

void FixEVPEnergy::unwrap(int i, double *x) const
{
  if (!box.acts) return domain->unmap(atom->x[i], atom->image[i], x);
  const auto shift = unwrapping(box.edges, atom->image[i]);
  for (int c = 0; c < 3; c++) x[c] = atom->x[i][c] + shift[c];
}

// of the last force evaluation
ActingForces FixEVPEnergy::acting_forces() const
{
  return {scene::rows(atom->f), work.force.rows(),
          work.damping.empty() ? nullptr : work.damping.rows(),
          is_solved() ? implicit->applied_damping().rows() : nullptr, work.separates};
}

// work of a box that deforms on the dampers of fix nve/evp, over half a step
double FixEVPEnergy::damping_of_box() const
{
  return is_solved() ? 0.5 * dt_step * implicit->power_of_box() : 0.0;
}

double FixEVPEnergy::kinetic_here() const
{
  double kinetic = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!is_integrated(i)) continue;    // prescribed ones enter by their work only
    const double weight = 0.5 * force->mvv2e * scene::mass(atom, i);
    const double *const v = atom->v[i];
    kinetic += weight * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  return kinetic;
}

// on this MPI rank
FixEVPEnergy::Instant FixEVPEnergy::instant_here() const
{
  double of_effects = 0.0, dissipated = 0.0;
  pair_data->effects.for_each([&](const Effect &one) {
    of_effects += one.energy();
    dissipated += one.dissipated();
  });
  Instant now = {kinetic_here(), of_effects, work.sums()};
  now.pairs.plastic += dissipated;
  return now;
}

FixEVPEnergy::Totals FixEVPEnergy::over_all_ranks(Totals totals) const
{
  static_assert(sizeof(Totals) % sizeof(double) == 0, "Totals are a row of numbers");
  MPI_Allreduce(MPI_IN_PLACE, &totals, sizeof(Totals) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
  return totals;
}

// of the step that ends, on this MPI rank; sets the records to the positions where the next one begins
FixEVPEnergy::Works FixEVPEnergy::works_of_step()
{
  double dissipated = 0.0, damped = 0.0, prescribed = 0.0, others = 0.0;
  const ActingForces forces = acting_forces();
  for (int i = 0; i < atom->nlocal; i++) {
    const bool integrated = is_integrated(i);
    if (integrated) dissipated += forces.dissipated(atom, force, dt_step, i);
    if (!forces.work_on(integrated)) continue;
    AtomPast &then = records[i];
    AtomForces now{};
    double x[3], done = 0.0;
    forces.find(i, integrated, now);
    unwrap(i, x);
    for (int c = 0; c < 3; c++)
      done += 0.5 * (then.forces.working[c] + now.working[c]) * (x[c] - then.x[c]);
    if (box.acts) {
      done -= box.along(atom->image[i], now.working);
      damped += box.along(atom->image[i], now.damping);
    }
    if (integrated)
      others += done;
    else {
      prescribed -= done;
      for (int c = 0; c < 3; c++)
        damped -= 0.5 * (then.forces.damping[c] + now.damping[c]) * (x[c] - then.x[c]);
    }
    std::copy_n(x, 3, then.x);
  }
  dissipated *= 0.5 * dt_step;
  if (is_solved()) dissipated += 0.5 * dt_step * implicit->power_before();

  double of_box = 0.0;
  if (box.acts) {
    const double by_damping = box.by_damping(dt_step);
    dissipated += by_damping;
    prescribed += box.prescribed;
    others += box.others;
    of_box = box.end_step(by_damping) + damping_of_box();
  }
  return {dissipated_at_begin + dissipated + damped, prescribed + damped, others, of_box, 0.0, 0.0};
}

void FixEVPEnergy::post_integrate()
{
  dt_step = update->dt;
  double by_damping = 0.0, damped = 0.0;    // of a moving box: across its boundary, of prescribed
  if (box.acts) {
    by_damping = box.by_damping(dt_step);    // at the rates of these forces
    box.begin_step(domain, by_damping, damping_of_box());
  }
  const ActingForces forces = acting_forces();
  dissipated_at_begin = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    const bool integrated = is_integrated(i);
    if (integrated) dissipated_at_begin += forces.dissipated(atom, force, dt_step, i);
    if (!forces.work_on(integrated)) continue;
    AtomForces &now = records[i].forces;
    forces.find(i, integrated, now);
    if (box.acts) damped += box.add(atom->image[i], integrated, now);
  }
  dissipated_at_begin = 0.5 * dt_step * dissipated_at_begin + by_damping + damped;
  if (is_solved()) dissipated_at_begin += 0.5 * dt_step * implicit->power_after();
}

void FixEVPEnergy::pre_exchange()
{
  if (box.acts) box.kinetic = kinetic_here();
}

void FixEVPEnergy::pre_neighbor()
{
  if (box.acts) box.set_edges(domain);
  set_images();
}

// atoms have been wrapped, which changes their velocity, and ghosts are those of the forces to come
void FixEVPEnergy::set_images()
{
  if (!box.acts) return;
  box.add_wrapped(kinetic_here());
  work.images.assign(atom->nlocal + atom->nghost, 0.0);
  forward_comm_images(work.images, COUNT_OF_BOXES.data());
}

void FixEVPEnergy::end_of_step()
{
  if (bonds) bonds->end_of_step();    // whichever comes first
  reverse_comm_forces();
  now.instant = instant_here();
  const Works step = works_of_step();
  now.works.dissipated += step.dissipated;
  now.works.prescribed += step.prescribed;
  now.works.others += step.others;
  now.works.box += step.box;
  now.works.plastic += now.instant.pairs.plastic;
  now.works.grown += now.instant.pairs.grown;
  summed_step = -1;
}

// Collective, where someone asks: of all MPI ranks, at the end of the last step. Where a velocity changes its sign within a
// step, the power of its damping may be negative: DISSIPATED waits until the sum has grown beyond it
void FixEVPEnergy::sum_up()
{
  if (summed_step == update->ntimestep) return;
  summed_step = update->ntimestep;
  const auto [last, works] = over_all_ranks(now);
  entries[DISSIPATED] = std::max(entries[DISSIPATED], works.dissipated);
  entries[PRESCRIBED] = works.prescribed;
  entries[OTHERS] = works.others;
  entries[BOX] = works.box;
  entries[PLASTIC] = works.plastic;
  entries[GROWN] = works.grown;
  entries[KINETIC] = last.kinetic - start.kinetic;
  entries[FIRST] = last.pairs.elastic - start.pairs.elastic;
  entries[SECOND] = last.pairs.second - start.pairs.second;
  entries[LOST] = last.pairs.past_cutoff - start.pairs.past_cutoff;
  entries[ENDED] = last.pairs.ended - start.pairs.ended;
  entries[CONTACTS] = (last.pairs.contacts - start.pairs.contacts) -
      (last.pairs.contacts_at_cutoff - start.pairs.contacts_at_cutoff);
  entries[VOLUME] = last.volume - start.volume;
}

// f_ID: energy imbalance. f_ID[1..14], changes since the start: kinetic, stored in bonds up to xi_s
// and above it, spent on lost bonds, new contacts; dissipated by gamma; work on prescribed atoms, of all
// other forces; dissipated by flow, 0, lost with bonds that ended, volume energy; work of
// a box that deforms; gained as pairs grew by their temperature
double FixEVPEnergy::compute_scalar()
{
  sum_up();
  double imbalance = 0.0;
  for (const Entry entry :
       {KINETIC, FIRST, SECOND, LOST, CONTACTS, DISSIPATED, PLASTIC, ENDED, VOLUME})
    imbalance += entries[entry];
  return imbalance - entries[PRESCRIBED] - entries[OTHERS] - entries[BOX] - entries[GROWN];
}

double FixEVPEnergy::compute_vector(int n)
{
  sum_up();
  return entries[n];
}

// no work is done on an atom before it comes
void FixEVPEnergy::set_arrays(int i)
{
  records[i] = {};
  unwrap(i, records[i].x);
}

void FixEVPEnergy::write_restart(FILE *fp)
{
  Totals all = over_all_ranks(now);
  const double ended = all.instant.pairs.ended;    // the next run counts from 0
  all.instant = start;
  all.instant.pairs.ended -= ended;
  all.works.dissipated = std::max(entries[DISSIPATED], all.works.dissipated);
  const auto *const numbers = reinterpret_cast<const double *>(&all);
  std::vector<double> words = {RESTART_FORMAT, (double) started};
  words.insert(words.end(), numbers, numbers + sizeof(all) / sizeof(double));
  seal(words);
  if (comm->me == 0) restart_file::write_section(fp, words);
}

void FixEVPEnergy::restart(char *buf)
{
  const auto *words = reinterpret_cast<const double *>(buf);
  Totals all{};
  constexpr size_t SIZE = sizeof(all) / sizeof(double);
  if (words[0] != RESTART_FORMAT || !is_sealed(words, 2 + SIZE + 1))
    restart_file::stop_at_damaged_section(error,
                                          who + ": its section of the restart file is damaged");
  started = words[1] != 0.0;
  std::copy_n(words + 2, SIZE, reinterpret_cast<double *>(&all));
  start = all.instant;
  entries[DISSIPATED] = all.works.dissipated;
  if (comm->me == 0) now.works = all.works;
}
