// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/bonds/fix_evp_bonds.h"

#include "lammps/base/atom_directory.h"
#include "lammps/base/collective.h"
#include "lammps/base/restart_file.h"
#include "lammps/base/scene.h"
#include "lammps/base/user_input.h"
#include "lammps/bonds/bond_recording.h"

#include "comm.h"
#include "domain.h"
#include "group.h"
#include "min.h"
#include "my_page.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace EVP;

static constexpr double RESTART_FORMAT = 2012;    // first word of our section in restart files
static constexpr size_t SECTION = 12;             // words of it in front of the measures

// fix ID group evp/bonds [zone Z | file FILE] [within type|molecule] [new yes|no] [events FILE]
FixEVPBonds::FixEVPBonds(LAMMPS *lmp, int narg, char **arg) :
    WithPerAtomComm(lmp, narg, arg), after_restart(modify->nfix_restart_global > 0)
{
  for_each_keyword(
      error, who, narg - 3, arg + 3, {"zone", "file", "within", "new", "events"}, " or ",
      [this](const Keyword &word) {
        if (word.is("within")) {
          bonds->within = parse_body_rule(word.value);
        } else if (word.is("new")) {
          word.demand(word.value == "yes" || word.value == "no",
                      "must be yes (atoms that come later get bonds where they come) or no");
          takes_new = word.value == "yes";
        } else if (word.is("events")) {
          events = std::make_unique<EventFile>(this->lmp, who, word.value);
        } else if (word.is("zone")) {
          zone = word.number();
          word.demand(zone > 1.0,
                      "must be greater than 1 (pairs with d <= zone (R_i + R_j) are recorded)");
        } else {
          word.demand(!word.value.empty(), "must be the name of a bond file");
          file = word.value;
        }
      });
  if (zone > 0.0 && !file.empty())
    error->all(FLERR, "{}: the bonds come from the zone or from a file, give one of the two", who);
  scene::demand_only_one(modify, error, this, who);

  comm_forward = comm_reverse = 12;    // as many as effects exchange, see PairHistories::share()
  restart_global = restart_peratom = 1;
  create_attribute = 1;
  stores_ids = 1;
  maxexchange_dynamic = 1;
  scene::offer_values(this, 8);
  nevery = 1;

  FixEVPBonds::grow_arrays(atom->nmax);
  maxexchange = bonds->most_words();
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

FixEVPBonds::~FixEVPBonds()
{
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  bonds->close();
}

// fix_modify ID plastic_strain GROUP P
int FixEVPBonds::modify_param(int narg, char **arg)
{
  if (strcmp(arg[0], "plastic_strain") != 0) return 0;
  if (narg < 3)
    error->all(FLERR, "{}: fix_modify plastic_strain needs a group and a plastic strain", who);
  const int given_group = group->find(arg[1]);
  if (given_group < 0)
    error->all(FLERR, "{}: fix_modify plastic_strain: there is no group '{}'", who, arg[1]);
  stop_at_bad_input(error, who, [&] {
    const Keyword strain = {"plastic_strain", arg[2]};
    strain.demand(strain.number() >= 0.0, "must be zero or positive");
    bonds->keep_given(true);
    for (int i = 0; i < atom->nlocal; i++)
      if (atom->mask[i] & group->bitmask[given_group]) bonds->given(i) = strain.number();
  });
  set_exchange_room();
  return 3;
}

void FixEVPBonds::init()
{
  scene::refuse_respa(update, error, who);

  stepping = false;
  ended_step = -1;
  keep_values();
  pair_data->histories.begin_run(bonds.get(), this, events != nullptr);

  if (bonds->within == BodyRule::MOLECULE) {
    const std::string missing = missing_molecules(lmp);
    if (!missing.empty()) error->all(FLERR, "{}: {}", who, missing);
  }
  counted_step = -1;
  // in each run, though only the first may build it: where requests differ LAMMPS makes all lists anew, and those of granular
  // styles lose their history
  neighbor->add_request(this, NeighConst::REQ_FULL | NeighConst::REQ_OCCASIONAL);
  if (bonds->has_recorded()) {
    check_ids();
    measure();
  } else if (file.empty())
    check_zone();
  if (events) events->begin(restarted_at);
}

void FixEVPBonds::keep_values()
{
  pair_data = PairData::require(force, error, who);
  check_history();
  bonds->keep_history(pair_data->rules().has_history());
  for (const auto &effect : pair_data->find_effects()) effect->keep_values(*bonds);
  bonds->drop_unclaimed();
  set_exchange_room();
}

// flow and breaking are known to the pair style in force only
void FixEVPBonds::check_history() const
{
  const auto &rules = pair_data->rules();
  if (events && !rules.has_history())
    error->all(
        FLERR,
        "{}: events are those of bonds that end or begin, which the pair_style in force does "
        "not have: give it 'plasticity isotropic' or 'break'",
        who);
  const bool loses_history = (!rules.plastic && bonds->has_flowed(atom->nlocal)) ||
      (!rules.has_history() && bonds->counts().ended > 0);
  if (on_any(loses_history, world))
    error->all(FLERR,
               "{}: bonds have flowed or ended, which this pair_style would forget: give it the "
               "'plasticity' and 'break' that it had",
               who);
  if (!rules.plastic && bonds->has_given())
    error->all(FLERR,
               "{}: fix_modify plastic_strain needs 'plasticity isotropic' of the pair style", who);
  const bool heats = pair_data->effects.any(&Effect::takes_heat);
  if (!rules.has_history() && !heats) return;
  for (int k = 0; k < modify->nfix && modify->fix[k] != this; k++) {
    const Fix *const other = modify->fix[k];
    if ((modify->fmask[k] & FixConst::PRE_EXCHANGE) && !scene::is_ours(other->style) &&
        !utils::strmatch(other->style, "_HISTORY$"))    // those of granular styles move no atoms
      error->all(FLERR,
                 "{} must be defined before fix {} {}, which may move, add or delete atoms before "
                 "it has kept {}",
                 who, other->id, other->style,
                 rules.has_history() ? "how bonds have flowed or ended"
                                     : "what heats them, for fix evp/heat");
  }
}

void FixEVPBonds::return_histories()
{
  PairData *const now = PairData::find(force);
  if (now) now->return_histories(*bonds);
  if (!bonds->has_history()) return;
  if (now && events) events->write(now->histories.events);
  set_exchange_room();
}

void FixEVPBonds::end_of_step()
{
  counted_step = -1;    // what a fix before this one has asked for
  if (ended_step == update->ntimestep) return;
  ended_step = update->ntimestep;
  if (bonds->has_history() && !stepping)
    error->all(FLERR,
               "{}: rerun does not know how bonds have flowed or ended: use 'plasticity none' and "
               "'break none', or dumps of the values in the run itself",
               who);
  stepping = false;
  pair_data->commit(false);
}

// collective; without any force cg finds no direction that is downhill
static bool is_at_rest(Min *minimizer, double force_tolerance)
{
  const int stop = minimizer->stop_condition;
  if (stop == Min::DOWNHILL) return std::sqrt(minimizer->fnorm_sqr()) <= force_tolerance;
  return stop == Min::ETOL || stop == Min::FTOL || stop == Min::ZEROFORCE;
}

// a minimizer tries many places, of which only the last one is a state of the body, and that only
// where it came to rest
void FixEVPBonds::post_run()
{
  stepping = false;
  if (update->whichflag == 2 && bonds->has_history()) {
    if (is_at_rest(update->minimize, update->ftol))
      pair_data->commit(true);
    else
      warn_of_stop(update->minimize->stopstr);
  }
  return_histories();
}

void FixEVPBonds::warn_of_stop(const char *stop)
{
  if (stop_warned || !on_any(pair_data->histories.would_change(), world)) return;
  stop_warned = true;
  if (comm->me == 0)
    error->warning(
        FLERR,
        "{}: a minimization stopped by '{}', not at rest: bonds that are due to flow or break stay "
        "as they were before it, until one meets its energy or force tolerance: use larger maxiter "
        "and maxeval, a larger ftol, or another min_style (said once)",
        who, stop);
}

// the neighbor list ends at alpha (R_i + R_j) plus a skin that must not matter
void FixEVPBonds::check_zone() const
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      const double alpha = pair_data->alpha_of(i, j);
      if (alpha > 0.0 && zone > alpha)
        error->all(FLERR,
                   "{}: zone {} reaches beyond what the neighbor list can see, alpha = {} of types "
                   "{} and {}: use a zone of at most alpha",
                   who, zone, alpha, i, j);
    }
}

// at each neighbor build: stops where a deq would go to another atom, or to a second image of its own
void FixEVPBonds::pre_neighbor()
{
  if (!bonds->has_recorded()) return;
  if (const int64_t misplaced = bonds->find_misplaced(atom->tag, atom->nlocal))
    error->one(FLERR, misplaced_message(misplaced));
  warn_of_new_atoms();
  if (const PairData *pair_data = PairData::find(force)) check_box(pair_data);
}

// once, at the first neighbor build that has any
void FixEVPBonds::warn_of_new_atoms()
{
  constexpr bigint WARNED = -2;
  if (takes_new || natoms_seen == WARNED || natoms_seen == atom->natoms || bonds->count() == 0)
    return;
  natoms_seen = atom->natoms;
  const bigint count =
      reduce_all((bigint) bonds->count_new(atom->mask, groupbit, atom->nlocal), MPI_SUM, world);
  if (count == 0) return;
  natoms_seen = WARNED;
  if (comm->me == 0)
    error->warning(FLERR,
                   "{}: {} atoms of its group came after the bonds were recorded, and have none: "
                   "use the keyword 'new yes', or create atoms that are to be bonded before the "
                   "first run (said once)",
                   who, count);
}

void FixEVPBonds::check_box(const PairData *pair_data) const
{
  // a box of two cutoffs but for round-off will do
  const double longest = pair_data->types.longest_cutoff() * (1.0 - 2.0 * LIST_MARGIN);
  const double *h = domain->h_inv;    // its rows are the reciprocals of the box's heights
  const double height[3] = {1.0 / std::sqrt(h[0] * h[0] + h[5] * h[5] + h[4] * h[4]),
                            1.0 / std::sqrt(h[1] * h[1] + h[3] * h[3]), 1.0 / h[2]};
  for (int c = 0; c < domain->dimension; c++)
    if (domain->periodicity[c] && height[c] < 2.0 * longest)
      error->all(FLERR,
                 "{}: the periodic box is {:.6g} high along {}, less than two cutoffs of {:.6g}, "
                 "so that a bond could meet its atom in two images: {}",
                 who, height[c], "xyz"[c], longest, remedy_of_images(this));
}

void FixEVPBonds::check_ids() const
{
  const int64_t found = reduce_all(bonds->find_misplaced(atom->tag, atom->nlocal), MPI_MAX, world);
  if (found) error->all(FLERR, misplaced_message(found));
}

std::string FixEVPBonds::misplaced_message(int64_t id_found) const
{
  return fmt::format(
      "{}: atom ID {} is not the atom that was recorded under this ID, and would take its bonds "
      "over: use 'delete_atoms ... compress no', no reset_atoms id, 'read_data ... add {}' or 'fix "
      "deposit ... id next', and define the fix right after read_restart",
      who, id_found, bonds->highest_id());
}

void FixEVPBonds::setup_pre_force(int /*vflag*/)
{
  if (!bonds->has_recorded())
    record();
  else
    record_new_atoms();
}

void FixEVPBonds::pre_force(int /*vflag*/)
{
  stepping = true;
  if (neighbor->ago == 0) record_new_atoms();
  pair_data->histories.begin_step();
}

// before the forces that see them first
void FixEVPBonds::record_new_atoms()
{
  if (!takes_new && !pair_data->rules().joins()) return;
  std::vector<char> are_new(atom->nlocal);
  for (int i = 0; i < atom->nlocal; i++) are_new[i] = bonds->is_unseen(i);
  if (!on_any(std::count(are_new.begin(), are_new.end(), 1) > 0, world)) return;
  BondRecording recording(lmp, this, who, bonds->within);
  stop_at_bad_input(error, who, [&] {
    record_from_list(recording, bonds.get());
  });
  recording.add_to(*bonds, takes_new);
  set_exchange_room();
  pair_data->effects.for_each([&](Effect &one) {
    one.atoms_recorded(are_new);
  });
}

void FixEVPBonds::record_from_list(BondRecording &recording, const BondStore *store)
{
  neighbor->build_one(list);
  recording.record_zone(list, zone, pair_data, *this, store);
  if (list->copy) return;    // of another one, which has the memory
  // by LAMMPS itself, whose pages are larger where it was compiled with OpenMP
  list->ipage->init(neighbor->oneatom, neighbor->pgsize);
  list->inum = 0;    // nor does LAMMPS count these neighbors
}

void FixEVPBonds::record()
{
  if (const tagint twice = AtomDirectory(lmp).twice)
    error->all(FLERR,
               "{}: atom ID {} is given twice: use 'reset_atoms id' or correct the data file", who,
               twice);
  BondRecording recording(lmp, this, who, bonds->within);
  stop_at_bad_input(error, who, [&] {
    if (!file.empty()) return recording.record_file(file, pair_data->rules());
    record_from_list(recording, nullptr);
  });
  check_box(pair_data);
  recording.give_to(*bonds);
  set_exchange_room();
  measure();

  if (comm->me == 0 && file.empty() && (after_restart || !pair_data->source.dropped.empty()))
    error->warning(FLERR,
                   "{} takes the current shape of the body as undeformed and free of stress, "
                   "though bonds may have been recorded before: to keep these, give the fix the ID "
                   "that it had in the restart file, or use write_evp_bonds and the keyword file",
                   who);
  recording.report(*bonds, pair_data->rules().contact != Contact::NONE);
}

// once, where a row of the pair style needs it
void FixEVPBonds::measure()
{
  if (pair_data->wants_measures() && bonds->measures.empty())
    bonds->measures = measure_bonds(lmp, *bonds);
}

double FixEVPBonds::compute_vector(int n)
{
  if (n > 3) {
    const auto [ended, failed, begun] = counts();
    return (double) std::array{ended, begun, failed, ended - failed}[n - 4];
  }
  if (update->whichflag != 0 &&
      (counted_step == update->ntimestep || !on_all(pair_data->is_packed(), world)))
    return pair_counts[n];

  pair_counts = PairData::require_present(force, error, fmt::format("{}: f_{}[{}]", who, id, n + 1))
                    ->count_pairs();
  const auto [ended, failed, begun] = counts();
  pair_counts[0] = (double) (bonds->count() + begun - ended) - pair_counts[0];
  counted_step = update->ntimestep;
  return pair_counts[n];
}

// Collective. Of all MPI ranks
BondCounts FixEVPBonds::counts()
{
  if (!bonds->has_history()) return {};
  return_histories();
  const auto [ended, failed, begun] = bonds->counts();
  const auto sums = reduce_all(std::array{ended, failed, begun}, MPI_SUM, world);
  return {sums[0], sums[1], sums[2]};
}

int FixEVPBonds::unpack_exchange(int i, double *buf)
{
  const int words = bonds->unpack(i, buf);
  maxexchange = std::max(maxexchange, words);
  return words;
}

void FixEVPBonds::write_restart(FILE *fp)
{
  return_histories();
  const auto [ended, failed, begun] = counts();
  std::vector<double> groups = bonds->pack_groups();
  seal(groups);
  std::vector<double> words = {RESTART_FORMAT,
                               bonds->zone,
                               (double) bonds->has_recorded(),
                               (double) bonds->count(),
                               (double) bonds->highest_id(),
                               (double) (int) bonds->within,
                               (double) ended,
                               (double) failed,
                               (double) begun,
                               bonds->joins_by.within,
                               (double) bonds->joins_by.all,
                               (double) groups.size()};
  const std::vector<double> measures = bonds->measures.words(atom->ntypes);
  words.insert(words.end(), measures.begin(), measures.end());
  seal(words);    // their number is known, and says that of the others
  words.insert(words.end(), groups.begin(), groups.end());
  if (comm->me == 0) restart_file::write_section(fp, words);
}

void FixEVPBonds::restart(char *buf)
{
  const auto *words = reinterpret_cast<const double *>(buf);
  const size_t sealed = SECTION + BondMeasures::words_of(atom->ntypes) + 1;
  const auto is_whole = [&] {
    return words[0] == RESTART_FORMAT && is_sealed(words, sealed) &&
        is_sealed(words + sealed, (size_t) words[SECTION - 1]);
  };
  if (!is_whole())
    restart_file::stop_at_damaged_section(error,
                                          who + ": its section of the restart file is damaged");
  after_restart = false;    // this is the fix that the file knows
  restarted_at = update->ntimestep;
  const bool recorded = words[2] != 0.0;
  stop_at_bad_input(error, who, [&] {
    bonds->unpack_groups(words + sealed);
  });
  const BodyRule given = bonds->within, kept = (BodyRule) (int) words[5];
  if (recorded || given == BodyRule::ALL) bonds->within = kept;
  bonds->restore(recorded, (int64_t) words[3], (int64_t) words[4],
                 comm->me == 0
                     ? BondCounts{(int64_t) words[6], (int64_t) words[7], (int64_t) words[8]}
                     : BondCounts{});
  bonds->joins_by = {words[9], words[10] != 0.0};
  bonds->measures.unpack(words + SECTION, atom->ntypes);
  const bool differs = !file.empty() || (zone > 0.0 && zone != words[1]) ||
      (given != BodyRule::ALL && given != kept);
  if (recorded && comm->me == 0 && differs)
    utils::logmesg(lmp,
                   "fix evp/bonds {}: the bonds are those of the restart file, not of the 'zone', "
                   "'file' or 'within' given here\n",
                   id);
  bonds->zone = zone = words[1];
  PairData *pair_data = PairData::find(force);
  if (pair_data && recorded) pair_data->source.set_store(bonds);
}

int FixEVPBonds::pack_restart(int i, double *buf)
{
  // the first word is read as a plain number by every fix that skips this record
  const int n = 1 + bonds->pack(i, buf + 1);
  buf[0] = n + 1;
  buf[n] = seal_of(buf, n);
  return n + 1;
}

void FixEVPBonds::unpack_restart(int nlocal, int nth)
{
  double *record = restart_file::find_record(atom, nlocal, nth);
  const size_t n = record ? (size_t) record[0] : 0;
  if (n < 2 || !bonds->fits(record + 1, n - 2))
    restart_file::stop_at_damaged_record(
        error,
        fmt::format("{}: the bonds of atom {} in the restart file are damaged", who,
                    atom->tag[nlocal]));
  unpack_exchange(nlocal, record + 1);
}
