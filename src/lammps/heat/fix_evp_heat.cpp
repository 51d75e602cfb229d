// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/heat/fix_evp_heat.h"

#include "lammps/base/collective.h"
#include "lammps/base/restart_file.h"
#include "lammps/base/scene.h"
#include "lammps/base/user_input.h"
#include "lammps/bonds/fix_evp_bonds.h"
#include "lammps/heat/expansion.h"

#include "comm.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;
using namespace EVP;

static constexpr double RESTART_FORMAT = 2012;    // first word of our section in restart files
static constexpr double RATE_STEPS = 100.0;       // over which strain rates are smoothed

// fix ID group evp/heat [every 100] [taylor 0.9]
FixEVPHeat::FixEVPHeat(LAMMPS *lmp, int narg, char **arg) :
    WithPerAtomComm(lmp, narg, arg), friction(lmp, *this), conduction(lmp, *this)
{
  for_each_keyword(error, who, narg - 3, arg + 3, {"every", "taylor"}, " and ",
                   [this](const Keyword &word) {
                     const double value = word.number();
                     if (word.is("every")) {
                       word.demand(value >= 1.0 && value <= 1.0e9 && value == std::floor(value),
                                   "must be an integer from 1 to 1e9 (steps)");
                       every = (int) value;
                     } else {
                       word.demand(value >= 0.0 && value <= 1.0,
                                   "must lie between 0 and 1 (share of plastic work that is heat)");
                       of_plastic = value;
                     }
                   });
  scene::demand_only_one(modify, error, this, who);
  comm_forward = GranularFriction::WIDTH;    // no others are wider
  comm_reverse = 2;                          // see warm_new_atoms()
  dynamic_group_allow = 0;
  restart_global = 1;
  nevery = 1;
  scene::offer_values(this, NACCOUNTS + 2);
  peratom_flag = peratom_freq = 1;
  size_peratom_cols = 0;
  create_attribute = 1;
  maxexchange = 1;
  FixEVPHeat::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
}

FixEVPHeat::~FixEVPHeat()
{
  atom->delete_callback(id, Atom::GROW);
}

// those of a fix that is gone are not those of this one
void FixEVPHeat::keep_values(BondStore &store)
{
  if (!std::exchange(has_records, true)) store.keep<HeatRecord>(false);
  begun = begun && store.has<HeatRecord>();
  store.keep<HeatRecord>(true);
  records = store.columns<HeatRecord>();
}

void FixEVPHeat::init()
{
  pair_data = PairData::require(force, error, who);
  scene::refuse_respa(update, error, who);
  auto *const bonds = dynamic_cast<FixEVPBonds *>(scene::find_fix(modify, "evp/bonds"));
  if (!bonds)
    error->all(FLERR,
               "{} needs fix evp/bonds, along whose bonds heat flows: define one before the run",
               who);
  if (!atom->temperature_flag || !atom->heatflow_flag)
    error->all(FLERR,
               "{} needs atoms with a temperature and a heat flow: define 'fix ID all "
               "property/atom temperature heatflow ghost yes' and 'set group all temperature T' "
               "before it",
               who);
  rows.resize(1);
  for (int type = 1; type <= atom->ntypes; type++) rows.push_back(pair_data->row_of(type));
  expands = std::any_of(rows.begin(), rows.end(), [](const Row &row) {
    return row.expansion > 0.0;
  });
  others_pairs = force->pair_match("evp/lj", 1) != force->pair;
  others_groupbits = 0;
  for (const Fix *other : modify->get_fix_list())
    if (utils::strmatch(other->style, "^heat/flow")) others_groupbits |= other->groupbit;
  check_atoms(*bonds->records());
  bonds->keep_values();
  friction.find_styles();
  conduction.begin_run();
  damping_time = 0.0;
  stepping = false;
  is_packed = false;    // a run brings home what it has added; ghosts may be others since
  generated.clear();
  if (update->whichflag == 2) {    // at rest nothing flows
    since_limits = 0.0;
    for (int i = 0; i < atom->nlocal; i++) records[i].rate = 0.0;
  }
  // bonds that are there may hold too much: the first step sees to that, and to its work
  if (!std::exchange(begun, true) && !bonds->records()->has_recorded()) update_effect();
  report_unlike_types();
}

// by the smallest ID, so that any number of MPI ranks says the same. Atoms that came after the recording may get a temperature
// from their bonds, see warm_new_atoms()
void FixEVPHeat::check_atoms(const BondStore &bonds) const
{
  enum { TEMPERATURE, TWICE, ROW, N };
  std::array<tagint, N> first;
  first.fill(MAXTAGINT);
  for (int i = 0; i < atom->nlocal; i++) {
    const Row &row = rows[atom->type[i]];
    const auto note = [&](int what) {
      first[what] = std::min(first[what], atom->tag[i]);
    };
    const double temperature = atom->temperature[i];
    const bool has_none = temperature == 0.0 && bonds.has_recorded() && bonds.is_new(i);
    if (!(temperature > 0.0 && std::isfinite(temperature)) && !has_none) note(TEMPERATURE);
    if (is_free(i) && (atom->mask[i] & others_groupbits)) note(TWICE);
    if ((is_free(i) && row.capacity == 0.0) || (row.conductivity > 0.0 && row.density == 0.0))
      note(ROW);
  }
  first = reduce_all(first, MPI_MIN, world);
  if (first[TEMPERATURE] < MAXTAGINT)
    error->all(
        FLERR,
        "{}: the temperature of atom {} is not set (zero), negative or not finite: use 'set ... "
        "temperature T' with a positive T before the run; after read_restart define fix "
        "property/atom first, with the ID that it had",
        who, first[TEMPERATURE]);
  if (first[TWICE] < MAXTAGINT)
    error->all(FLERR,
               "{}: atom {} is of a fix heat/flow too, which would warm it a second time: leave "
               "it to one of the two",
               who, first[TWICE]);
  if (first[ROW] < MAXTAGINT)
    error->all(
        FLERR,
        "{}: the row of the type of atom {} lacks what heat needs: add 'capacity CP' and, with "
        "'conductivity K', 'density RHO' of the solid, or leave atoms that are to hold "
        "their temperature out of the group",
        who, first[ROW]);
}

void FixEVPHeat::report_unlike_types()
{
  std::string line;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i + 1; j <= atom->ntypes; j++) {
      const Row row = pair_data->row_of(i, j);
      bool any = false, differs = false;
      for (const auto member : OF_HEAT) {
        any = any || row.*member != Row{}.*member;
        differs = differs || row.*member != rows[i].*member || row.*member != rows[j].*member;
      }
      if (any && differs) line += fmt::format("{}{} {}", line.empty() ? "" : ", ", i, j);
    }
  if (line == std::exchange(last_unlike, line) || line.empty() || comm->me) return;
  utils::logmesg(lmp,
                 "fix evp/heat {}: conductivity, capacity, soften, melt, rate and expansion of the "
                 "rows of types {} are not used: those of like types hold\n",
                 id, line);
}

void FixEVPHeat::setup(int /*vflag*/)
{
  for (int i = 0; i < atom->nlocal; i++) through[i] = records[i].out;
  if (update->whichflag != 1) return;
  friction.find_forces();
  friction.find_powers();
  conduction.find_links(pair_data->packed_pairs(), rows, groupbit);
  const double step = every * update->dt;
  const bool is_near = step * conduction.eigenvalue_bound() > 2.0,
             is_first = !std::exchange(limit_told, true);
  if (is_near || is_first) conduction.find_limit();
  if (is_first && comm->me == 0)
    utils::logmesg(lmp,
                   "fix evp/heat {}: largest stable thermal step {:.6g}, every {} steps of {:.6g}: "
                   "{:.6g}\n",
                   id, conduction.limit(), every, update->dt, step);
  if (is_near && scene::makes_steps(lmp)) check_step(step);
}

void FixEVPHeat::initial_integrate(int /*vflag*/)
{
  step_time = update->dt;
  add_friction();
}

// heat flow is that of one step: LAMMPS' styles add to it
void FixEVPHeat::pre_force(int /*vflag*/)
{
  stepping = true;
  elapsed += update->dt;
  since_limits += update->dt;
  damping_time = update->dt;
  if (neighbor->ago == 0) send_temperatures();
  if (!others_groupbits)
    std::fill_n(atom->heatflow, atom->nlocal + atom->nghost, 0.0);    // else fix heat/flow does
}

void FixEVPHeat::end_of_step()
{
  damping_time = 0.0;
  if (!std::exchange(stepping, false)) return;
  friction.find_powers();
  add_friction();
  const int nlocal = atom->nlocal;
  double *const heatflow = atom->heatflow;
  if (others_pairs && !others_groupbits) {
    AtomValues of_ghosts(1, nlocal + atom->nghost);
    of_ghosts.set_first(of_ghosts.size(), heatflow);
    reverse_comm(of_ghosts);
    std::copy_n(of_ghosts.begin(), nlocal, heatflow);
  }
  for (int i = 0; i < nlocal; i++) {
    through[i] = records[i].out;
    if (heatflow[i] == 0.0 || (atom->mask[i] & others_groupbits)) continue;
    const double energy = step_time * heatflow[i];
    records[i].waiting += energy;
    account[OF_OTHERS] += energy;
  }
}

// What friction takes in half a step: that which its forces end, or begin
void FixEVPHeat::add_friction()
{
  for (const GranularFriction::Contact &pair : friction.contacts())
    add_heat(pair.i, pair.j, pair.j < atom->nlocal || force->newton_pair,
             0.5 * step_time * pair.power);
}

void FixEVPHeat::add_plastic_work(const std::vector<double> &work)
{
  for (size_t i = 0; i < work.size(); i++) {
    const double heat = of_plastic * work[i];
    records[i].waiting += heat;
    account[OF_WORK] += heat;
  }
}

void FixEVPHeat::before_forces(const ParticleView &view)
{
  damping_heat.time = view.v ? std::exchange(damping_time, 0.0) : 0.0;
  damping_heat.nreact = view.nreact;
  damping_heat.generated = &generated;
}

// pairs without a law have no damping
PairConsumer *FixEVPHeat::reads_forces(const PairList &list)
{
  const PairLists &lists = pair_data->lists();
  const bool has_law = &list == &lists.bonds || &list == &lists.contacts;
  return has_law && damping_heat.time > 0.0 ? &damping_heat : nullptr;
}

void FixEVPHeat::unlisted_bonds_end(const std::vector<UnlistedBond> &bonds)
{
  for (const UnlistedBond &bond : bonds) add_heat(bond.i, -1, false, bond.state.stored.total());
}

void FixEVPHeat::pairs_packed(const NeighList *)
{
  const PairLists &lists = pair_data->lists();
  generated.resize(lists.nall);    // all of them 0 where the list is another
  is_packed = true;
  warm_new_atoms(lists);
}

// Collective. To ghosts, whose temperatures pair styles of others read, whether fix property/atom sends them or not
void FixEVPHeat::send_temperatures()
{
  if (!others_pairs) return;
  AtomValues sent(1, atom->nlocal + atom->nghost);
  sent.set_first(atom->nlocal, atom->temperature);
  forward_comm(sent);
  for (int i = atom->nlocal; i < atom->nlocal + atom->nghost; i++)
    atom->temperature[i] = sent[i][0];
}

// Does the command that makes atoms give them temperatures, which LAMMPS sets first?
bool FixEVPHeat::reads_temperatures() const
{
  const Input *const input = lmp->input;
  if (!input->command || strcmp(input->command, "read_data") != 0) return false;
  for (int k = 0; k + 1 < input->narg; k++) {
    const Fix *const fix =
        strcmp(input->arg[k], "fix") == 0 ? modify->get_fix_by_id(input->arg[k + 1]) : nullptr;
    if (fix && utils::strmatch(fix->style, "^property/atom")) return true;
  }
  return false;
}

// Collective. Atoms that came without a temperature get the mean of the atoms that they are bonded to; where these have none
// either, from the next ones inwards
void FixEVPHeat::warm_new_atoms(const PairLists &lists)
{
  double *const temperature = atom->temperature;
  const auto first_without = [&] {
    tagint first = MAXTAGINT;
    for (int i = 0; i < lists.nlocal; i++)
      if (temperature[i] == 0.0) first = std::min(first, atom->tag[i]);
    return reduce_all(first, MPI_MIN, world);
  };
  tagint without = first_without();
  if (without == MAXTAGINT) return;
  AtomValues known(1, lists.nall), sums(2);    // temperature; of those around it, and their number
  for (bool any = true; any && without < MAXTAGINT; without = first_without()) {
    known.set_first(lists.nlocal, temperature);
    forward_comm(known);
    sums.assign(lists.nall, 0.0);
    const auto give = [&](int from, int to) {
      if (known[to][0] > 0.0 || known[from][0] == 0.0) return;
      sums[to][0] += known[from][0];
      sums[to][1] += 1.0;
    };
    for_each_pair(lists.bonds, scene::rows(atom->x), [&](const PlacedPair &p) {
      give(p.j, p.i);
      if (p.j < lists.nreact) give(p.i, p.j);
    });
    reverse_comm(sums);
    any = false;
    for (int i = 0; i < lists.nlocal; i++) {
      if (sums[i][1] == 0.0) continue;
      temperature[i] = sums[i][0] / sums[i][1];
      records[i].factor = factor_now(i);
      any = true;
    }
    any = on_any(any, world);
  }
  if (without < MAXTAGINT)
    error->all(
        FLERR,
        "{}: atom {} came without a temperature, and has no bond to an atom that has one: use "
        "'set ... temperature T' after it was created, or the keyword 'new yes' of fix "
        "evp/bonds and place it where it is bonded",
        who, without);
  send_temperatures();
}

// Collective. What pairs have left goes to the owners: before atoms migrate
void FixEVPHeat::collect_heat()
{
  if (!is_packed) return;
  reverse_comm(generated);
  const int nlocal = std::min((int) generated.size(), atom->nlocal);
  for (int i = 0; i < nlocal; i++) {
    records[i].waiting += generated[i][0];
    account[OF_WORK] += generated[i][0];
  }
  std::fill(generated.begin(), generated.end(), 0.0);
}

void FixEVPHeat::strains_updated(const BondStore &store, bool have_flowed)
{
  for (int i = 0; i < atom->nlocal; i++) {
    HeatRecord &own = records[i];
    const double p = store.sphere(i).p;
    if (have_flowed && own.strain >= 0.0 && since_limits > 0.0) {
      const double share = std::min(1.0, since_limits / (RATE_STEPS * update->dt));
      own.rate += share * ((p - own.strain) / since_limits - own.rate);
    }
    own.strain = p;
  }
}

void FixEVPHeat::multiply_limits(std::vector<double> &factors) const
{
  for (size_t i = 0; i < factors.size(); i++) factors[i] *= records[i].factor;
}

void FixEVPHeat::put_shared(Sharing, const ValuesOfAtoms &values) const
{
  for (int i = 0; i < atom->nlocal; i++) values[i][0] = records[i].growth;
}

void FixEVPHeat::set_shared(Sharing when, const ValuesOfAtoms &values)
{
  Growth growth(pair_data->lists().nall);
  for (size_t i = 0; i < growth.size(); i++) growth[i] = values[(int) i][0];
  if (when == Sharing::PACKED) {
    grow_new_atoms(growth);
    return grow_packed_pairs(*pair_data, growth);
  }
  if (!on_any(growth != pair_data->lists().growth, world)) return;
  const double gained = grow_pairs(*pair_data, growth);
  pair_data->effects.for_each([gained](Effect &one) {
    one.add_grown(gained);
  });
}

// Collective. Atoms that came later are bonded without a force at the temperatures of now
void FixEVPHeat::grow_new_atoms(Growth &growth)
{
  const int nlocal = atom->nlocal, nall = (int) growth.size();
  if (!on_any(!came.empty(), world)) return;
  came.resize(nlocal);
  PairLists &lists = pair_data->lists();
  warm_new_atoms(lists);
  AtomValues sent(2, nall);    // growth; has it come?
  for (int i = 0; i < nlocal; i++) {
    if (came[i]) records[i].growth = growth_now(i);
    sent[i][0] = records[i].growth;
    sent[i][1] = came[i];
  }
  came.clear();
  stop_at_growth();
  forward_comm(sent);
  for (int k = 0; k < nall; k++) growth[k] = sent[k][0];
  rest_at_growth(*pair_data, growth, [&sent](int k) {
    return sent[k][1] > 0.0;
  });
}

// Collective
void FixEVPHeat::stop_at_growth() const
{
  if (!expands) return;
  tagint first = MAXTAGINT;
  double most = 0.0;    // off 1
  for (int i = 0; i < atom->nlocal; i++) {
    const double off = std::fabs(records[i].growth - 1.0);
    if (off <= MOST_EXPANSION) continue;
    first = std::min(first, atom->tag[i]);
    most = std::max(most, off);
  }
  first = reduce_all(first, MPI_MIN, world);
  if (first == MAXTAGINT) return;
  most = reduce_all(most, MPI_MAX, world);
  error->all(
      FLERR,
      "{}: expansion would change the size of atoms by up to {:.4g} of it, first atom {}: more "
      "than {}: check their temperatures, and ALPHA and TREF of their row",
      who, most, first, MOST_EXPANSION);
}

// limits and lengths follow the temperatures and strain rates of now
void FixEVPHeat::update_effect()
{
  since_limits = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    records[i].factor = factor_now(i);
    records[i].growth = growth_now(i);
  }
  stop_at_growth();
}

bool FixEVPHeat::was_changed() const
{
  bool is_old = false;
  for (int i = 0; i < atom->nlocal; i++)
    is_old = is_old || records[i].factor != factor_now(i) || records[i].growth != growth_now(i);
  return is_old;
}

void FixEVPHeat::check_step(double step)
{
  const double limit = conduction.limit();
  if (!(step > limit)) return;
  const double most = std::floor(every * limit / step);
  error->all(FLERR,
             "{}: heat is handed out every {:.6g}, above the largest stable thermal step {:.6g}: "
             "temperatures would grow without end: {}",
             who, step, limit,
             most >= 1.0 ? fmt::format("use 'every {:.0f}' or less", most)
                         : "use a smaller timestep");
}

void FixEVPHeat::begin_update()
{
  if (update->whichflag == 1 && is_due()) conduct();
}

// Collective. By the bonds at the present positions; what was collected comes into the temperatures
void FixEVPHeat::conduct()
{
  const double time = std::exchange(elapsed, 0.0);
  collect_heat();
  conduction.find_links(pair_data->lists(), rows, groupbit);
  if (conduction.is_near_limit(time)) check_step(time);
  const AtomValues &flow = conduction.find_flows();
  for (int i = 0; i < atom->nlocal; i++) {
    const double energy = time * flow[i][0] + std::exchange(records[i].waiting, 0.0);
    if (!is_free(i)) {
      account[OUT] += energy;
      records[i].out += energy;
      continue;
    }
    if (energy == 0.0) continue;
    const Row &row = rows[atom->type[i]];
    const double mass = scene::mass(atom, i);
    ThermalState now = {atom->temperature[i], records[i].latent};
    now.settle(row, mass);
    const ThermalState before = now;
    now.take(energy, row, mass);
    account[STORED] +=
        mass * row.capacity * (now.temperature - before.temperature) + now.latent - before.latent;
    atom->temperature[i] = now.temperature;
    records[i].latent = now.latent;
    if (!(now.temperature >= 0.0 && std::isfinite(now.temperature)))
      error->one(
          FLERR,
          "{}: the temperature of atom {} is {:.6g} at step {}: more heat flows out of it by "
          "other styles than it has, or forces are not finite",
          who, atom->tag[i], now.temperature, update->ntimestep);
  }
  send_temperatures();
}

// Collective
std::array<double, FixEVPHeat::NACCOUNTS> FixEVPHeat::all_accounts()
{
  account[WAITING] = 0.0;
  const auto bonds = scene::find_records(modify);
  if (has_records && bonds && bonds->has<HeatRecord>()) {
    const auto kept = bonds->columns<HeatRecord>();
    for (int i = 0; i < atom->nlocal; i++) account[WAITING] += kept[i].waiting;
  }
  return reduce_all(account, MPI_SUM, world);
}

double FixEVPHeat::compute_scalar()
{
  const auto all = all_accounts();
  return all[OF_WORK] + all[OF_OTHERS] - all[OUT] - all[WAITING] - all[STORED];
}

double FixEVPHeat::compute_vector(int n)
{
  if (n < NACCOUNTS) return all_accounts()[n];
  if (n > NACCOUNTS) {
    if (!conduction.has_limit_of_now() && update->whichflag == 1 &&
        on_all(pair_data->is_packed(), world)) {
      conduction.find_links(pair_data->packed_pairs(), rows, groupbit);
      conduction.find_limit();
    }
    return conduction.limit();
  }
  double highest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    if (is_free(i)) highest = std::max(highest, atom->temperature[i]);
  return reduce_all(highest, MPI_MAX, world);
}

double FixEVPHeat::memory_usage()
{
  return bytes_of(through, came, generated) + conduction.memory_usage() + friction.memory_usage();
}

void FixEVPHeat::write_restart(FILE *fp)
{
  if (Fix *const bonds = scene::find_fix(modify, "evp/bonds"))
    bonds->pre_exchange();    // what pairs have dissipated so far
  const auto all = all_accounts();
  std::vector<double> words = {RESTART_FORMAT, elapsed, since_limits};
  words.insert(words.end(), all.begin(), all.end());
  seal(words);
  if (comm->me == 0) restart_file::write_section(fp, words);
}

void FixEVPHeat::restart(char *buf)
{
  const auto *words = reinterpret_cast<const double *>(buf);
  if (words[0] != RESTART_FORMAT || !is_sealed(words, 3 + NACCOUNTS + 1))
    restart_file::stop_at_damaged_section(error,
                                          who + ": its section of the restart file is damaged");
  elapsed = words[1];
  since_limits = words[2];
  begun = has_records = true;
  if (comm->me == 0) std::copy_n(words + 3, account.size(), account.begin());
}
