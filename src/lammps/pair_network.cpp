// SPDX-License-Identifier: GPL-2.0-only

#include "pair_network.h"

#include "atom_bodies.h"
#include "collective.h"
#include "history_return.h"
#include "keywords.h"
#include "scaling_report.h"
#include "scene.h"

#include "atom_vec.h"
#include "comm.h"
#include "neighbor.h"
#include "pair.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using EVP::Contact;
using EVP::scene::rows;

PairNetwork::PairNetwork(LAMMPS *lmp, Pair *style, EVP::Coefficients &coefficients_in) :
    Pointers(lmp), ghosts(lmp, style), cuts(lmp), coefficients(coefficients_in), builder(lmp),
    snapshot(lmp)
{
}

PairNetwork *PairNetwork::find(Force *force)
{
  int dim;
  Pair *pair = force->pair_match("evp/lj", 1);
  return pair ? (PairNetwork *) pair->extract("network", dim) : nullptr;
}

PairNetwork *PairNetwork::require(Force *force, Error *error, const std::string &who)
{
  PairNetwork *network = find(force);
  if (!network)
    error->all(FLERR, "{} needs pair style evp/lj, found '{}'", who,
               force->pair_style ? force->pair_style : "none");
  return network;
}

PairNetwork *PairNetwork::find_present(Force *force)
{
  PairNetwork *network = find(force);
  return network && network->is_present() ? network : nullptr;
}

const EVP::PairList &PairNetwork::packed_pairs() const
{
  if (!is_packed())
    error->one(FLERR,
               "Pair evp/lj has not seen the present neighbor list yet: use its fixes and computes "
               "in a run, after the forces of the step");
  return list;
}

std::vector<double> PairNetwork::rest_distances() const
{
  std::vector<double> distances(packed_pairs().pairs.size());
  EVP::for_each_pair(list, rows(atom->x), [&](const EVP::PlacedPair &p) {
    const double recorded = p.has_record() ? store->of(p.i)[p.record()].deq : 0.0;
    const double sum_radii = atom->radius[p.i] + atom->radius[p.j];
    distances[p.index] = p.is_bond() ? recorded
        : p.has_record()             ? rules.rest_of_broken(sum_radii, recorded)
                                     : sum_radii;
  });
  return distances;
}

bool PairNetwork::is_packed() const
{
  if (!snapshot.matches_list()) return false;
  if (update->whichflag != 0) return true;
  const long version = store ? store->version() : 0;
  return !repack_due && version == store_version && volume() == VolumeForces::find(modify).get() &&
      snapshot.matches_atoms() && !(store && store->find_misplaced(atom->tag, atom->nlocal));
}

bool PairNetwork::is_present()
{
  const bool all = EVP::on_all(is_packed(), world);
  if (!all || update->whichflag != 0) return all;
  return snapshot.matches_commands() && ghosts.send_positions() && !snapshot.moved_too_far();
}

PairNetwork::Counts PairNetwork::count_pairs() const
{
  std::array<double, 3> sums{};
  double lowest = HUGE_VAL;
  EVP::for_each_pair(list, rows(atom->x), [&](const EVP::PlacedPair &p) {
    const double d = p.distance();
    lowest = std::min(lowest, d / (atom->radius[p.i] + atom->radius[p.j]));
    if (p.is_beyond()) return;

    const double weight = EVP::rank_share(p.j, list.nreact(force->newton_pair));
    sums[p.is_bond() ? 0 : 2] += weight;
    if (p.is_bond() && law_of(p).regime(d, 1.0 / p.inv_deq, p.offset) == 2) sums[1] += weight;
  });

  sums = EVP::reduce_all(sums, MPI_SUM, world);
  lowest = EVP::reduce_all(lowest, MPI_MIN, world);
  return {sums[0], sums[1], sums[2], lowest < HUGE_VAL ? lowest : 0.0};
}

void PairNetwork::begin_run()
{
  rules_of_run = rules;
  if (EVP::on_any(histories_due, world)) {
    histories_due = false;
    newly_broken.clear();
    error->all(
        FLERR,
        "Pair evp/lj: the last run ended in an error, so that flow and broken bonds since its "
        "last neighbor build are lost: go back to a restart file");
  }
  flow_warned = false;
  cuts.begin_run();
  find_bonds();
  take_measures();    // for the laws of init_one()
  find_work();
  const Fix *implicit = EVP::scene::find_fix(modify, "nve/evp");
  implicit_groupbit = implicit ? implicit->groupbit : 0;
  take_kv();
  volume_ = VolumeForces::find(modify);
  any_gamma = scene_checked = overlap_warned = false;
  repack_due = true;
  snapshot.forget();
}

// once there were records, going on without them would silently change the material
void PairNetwork::find_bonds()
{
  note_bonds();
  int dim;
  Fix *fix = EVP::scene::find_fix(modify, "evp/bonds");
  store = fix ? *(std::shared_ptr<const EVP::BondStore> *) fix->extract("bonds", dim) : nullptr;
  const bool kept = bonds() != nullptr;
  if (!bonds_id.empty() && (!kept || bonds_id != fix->id))
    error->all(FLERR,
               "Pair evp/lj: the bonds were recorded by fix {}, whose records are not here: define "
               "'fix {} all evp/bonds' right after read_restart and before the run, or start anew "
               "with 'pair_style none' and 'pair_style evp/lj'",
               bonds_id, bonds_id);
  if (kept) bonds_id = fix->id;
  if (rules.has_history() && !fix)
    error->all(FLERR,
               "Pair evp/lj: {} needs fix evp/bonds, which keeps what bonds have gone through",
               rules.flows ? "unload elastic" : "break");
}

// a minimization has no energy balance
void PairNetwork::find_work()
{
  int dim;
  Fix *fix = update->whichflag == 2 ? nullptr : EVP::scene::find_fix(modify, "evp/energy");
  work = fix ? *(std::shared_ptr<EVP::PairWork> *) fix->extract("work", dim) : nullptr;
  if (work) work->forget();
}

// records are new, or closed since their fix is gone: then this style goes on without bonds
void PairNetwork::note_bonds()
{
  if (!store) return;
  if (store->is_closed()) {
    if (!bonds_id.empty()) dropped_bonds_id = bonds_id;
    bonds_id.clear();
    store.reset();
    repack_due = true;
  } else if (store->has_recorded() && bonds_id.empty())
    bonds_id = EVP::scene::find_fix(modify, "evp/bonds")->id;
}

EVP::Row PairNetwork::make_law(int i, int j)
{
  EVP::Row row;
  EVP::stop_at_bad_input(error, fmt::format("Pair evp/lj, types {} and {}", i, j), [&] {
    row = coefficients.make_law(i, j);
    if (rules.flows) coefficients.law(coefficients.index(i, j)).check_flow();
  });
  return row;
}

double PairNetwork::handle(int i, int j)
{
  const EVP::Row row = make_law(i, j);
  repack();
  if (row.gamma > 0.0) any_gamma = true;    // fix adapt may have switched it on
  return cuts.handle(i, j, row.alpha);
}

// of the atoms into bodies, for report()
std::string PairNetwork::division() const
{
  if (within() == EVP::Within::ALL) return "";
  return fmt::format(" within {} (bodies {})", EVP::WITHINS[(int) within()],
                     rules.contact == Contact::NONE ? "do not interact" : "only repel each other");
}

bool PairNetwork::take_measures()
{
  static const EVP::BondMeasures none;    // a packing allocates nothing
  return coefficients.take_measures(bonds() ? bonds()->measures() : none);
}

// the bonds were recorded, or went, after init_one() made the laws
void PairNetwork::scale_laws()
{
  if (!take_measures()) return;
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (cuts.handles(i, j)) make_law(i, j);
  take_kv();
}

void PairNetwork::take_kv()
{
  VolumeForces::take_kv(modify, [this](int type) {
    double kv = 0.0;
    EVP::stop_at_bad_input(error, fmt::format("Pair evp/lj, types {} and {}", type, type), [&] {
      kv = coefficients.kv(type);
    });
    return kv;
  });
}

// again only when it changes
void PairNetwork::report_scaling()
{
  if (!wants_measures()) return;
  const std::string lines = describe_scaling(coefficients, cuts, atom->ntypes);
  if (lines == last_scaling) return;
  last_scaling = lines;
  if (comm->me) return;
  if (coefficients.measured().any_bonds())
    utils::logmesg(lmp, lines);
  else
    error->warning(FLERR,
                   "Pair evp/lj: a row names the spacing and coordination that it holds for, but "
                   "there are no bonds to compare with: coefficients are taken as given; define "
                   "fix evp/bonds to scale them");
}

// types may have been set since the bonds were recorded
void PairNetwork::check_scaling() const
{
  if (!bonds() || !wants_measures()) return;
  const int n = atom->ntypes + 1;
  std::vector<char> unknown((size_t) n * n, 0);
  for (int i = 1; i < n; i++)
    for (int j = 1; j < n; j++)
      unknown[(size_t) i * n + j] = coefficients.keywords(i, j).is_scaled() &&
          coefficients.scaling(i, j).source == EVP::Coefficients::Source::AS_GIVEN;

  const bool has_kv = volume() && volume()->is_of_rows();
  int first = 0;    // type, of the pair of types or of the KV
  EVP::for_each_pair(list, rows(atom->x), [&](const EVP::PlacedPair &p) {
    if (!p.is_bond()) return;
    const int a = atom->type[p.i], b = atom->type[p.j];
    if (unknown[(size_t) a * n + b]) first = std::max(a, b);
    for (const int type : {a, b})
      if (has_kv && unknown[(size_t) type * n + type] && coefficients.keywords(type, type).kv > 0.0)
        first = type;
  });
  first = EVP::reduce_all(first, MPI_MAX, world);
  if (first)
    error->all(FLERR,
               "Pair evp/lj: atoms of type {} have bonds, but had another type when the bonds were "
               "measured, so that nothing says what the row of this type is to be multiplied by: "
               "set types before the bonds are recorded, or give type {} a row without spacing and "
               "coordination",
               first, first);
}

// one line of the active effects, again only when it changes
void PairNetwork::report()
{
  std::string line = "evp/lj: ";
  if (!any_gamma)
    line += "damping off";
  else
    line += !damping_acts()  ? "damping off (minimization)"
        : damps_implicitly() ? "damping by fix nve/evp"
                             : "damping on";
  line += fmt::format(", new contacts {}", EVP::CONTACTS[(int) rules.contact]);
  line += store ? fmt::format(", deq of bonds from fix {}{}",
                              EVP::scene::find_fix(modify, "evp/bonds")->id, division())
                : ", no fix evp/bonds: every pair has deq = R_i + R_j";
  if (rules.flows) line += ", unload elastic (kinematic hardening)";
  if (rules.breaks()) line += fmt::format(", bonds break beyond {} deq", 1.0 + rules.break_strain);
  if (volume())
    line +=
        fmt::format(", volume energy from fix {}", EVP::scene::find_fix(modify, "evp/volume")->id);
  line += fmt::format(", overlap warned of beyond {} (R_i + R_j)\n", rules.overlap);

  if (line == last_report) return;
  last_report = line;
  if (comm->me) return;
  utils::logmesg(lmp, line);
  if (!store && rules.contact == Contact::NONE)
    error->warning(FLERR,
                   "Pair evp/lj with contact none and without fix evp/bonds: nothing acts at all");
  if (rules.breaks() && rules.contact == Contact::NONE)
    error->warning(FLERR,
                   "Pair evp/lj with break and contact none: atoms whose bond broke pass through "
                   "each other; contact repulsive keeps them apart");
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (cuts.handles(i, j) && alpha_of(i, j) < 1.4 && rules.contact == Contact::LITERAL)
        error->warning(FLERR,
                       "Pair evp/lj, types {} and {}: alpha = {} is below 1.4, where literal new "
                       "contacts can pull the body together; use contact repulsive or none",
                       i, j, alpha_of(i, j));
}

// packing: by all MPI ranks with a new neighbor list, new bonds or new coefficients; where radii
// may change at any step, a rank whose own did packs alone
void PairNetwork::pack_if_due(const NeighList *neighbors)
{
  if (neighbor->ago == 0 || repack_due || (store && store->version() != store_version))
    pack(neighbors, true);
  else if (!atom->avec->comm_x_only && snapshot.radii_changed())
    pack(neighbors, false);
}

void PairNetwork::pack(const NeighList *neighbors, bool collective)
{
  const bool is_first = collective && !scene_checked;
  if (collective) {
    note_bonds();
    scale_laws();
    if (!scene_checked) {    // now that all pairs of types are known
      scene_checked = true;
      report();
      report_scaling();
      cuts.admit_all_radii_elsewhere();
    }
    check_weights();
    check_rules();
    if (within() == EVP::Within::MOLECULE && !atom->molecule)
      error->all(FLERR, "Pair evp/lj: fix evp/bonds {}", missing_molecules(lmp));
    list.common_build++;
  }
  // with a new neighbor list fix evp/bonds has looked
  if (bonds() && snapshot.matches_list() && store->find_misplaced(atom->tag, atom->nlocal))
    error->one(
        FLERR,
        "Pair evp/lj: IDs of atoms have changed since the last neighbor build, so that bonds "
        "would go to other atoms: use 'run' with 'pre yes'");
  cuts.check_radii();
  const bool carries = histories_due && snapshot.matches_list();
  snapshot.take_atoms(!atom->avec->comm_x_only, within() == EVP::Within::MOLECULE);
  list.nlocal = atom->nlocal;
  list.nall = atom->nlocal + atom->nghost;
  repack_due = false;
  store_version = store ? store->version() : 0;
  // with the same neighbor list the records have not been told of what changed
  const EVP::PairList before = carries ? list : EVP::PairList();
  const PairListBuilder::Found found = builder.build(
      {neighbors, &coefficients, bonds(), rules, within(), new_pair_margin(rules.contact),
       new_pair_margin(Contact::REPULSIVE), implicit_groupbit},
      list);
  beyond.clear();
  if (is_first) check_scaling();
  snapshot.finish();
  if (!bonds()) volume_.reset();    // they went since the last set-up
  if (volume()) volume()->pack(list, *bonds(), coefficients, collective);
  if (carries) carry_histories(before);
  if (collective) agree_on_pairs(found, !carries);

  coefficients.choose_block_law(
      [this](int i, int j) {
        return cuts.handles(i, j);
      },
      explicit_damping && implicit_groupbit, rules.flows);
}

void PairNetwork::commit(bool at_rest)
{
  histories_due = true;
  if (at_rest) find_histories();
  if (rules.flows) list.pairs.commit();
  if (rules.breaks()) break_bonds();
}

// what the force loop finds, at the present positions
void PairNetwork::find_histories()
{
  beyond.clear();
  EVP::PackedPairs &pairs = list.pairs;
  std::fill(pairs.moves.begin(), pairs.moves.end(), 1);
  EVP::for_each_pair(list, rows(atom->x), [&](const EVP::PlacedPair &p) {
    if (rules.breaks() && p.is_bond() && p.is_beyond()) beyond.push_back(p.index);
    if (!rules.flows) return;
    const EVP::Law &law = law_of(p);
    const double r = std::min(p.distance(), p.cut) * p.inv_deq;    // so far a bond flows
    const bool ended = p.is_beyond() && !p.is_bond();
    const double kept = law.kept(law.flowed(r, 1.0, p.offset), p.offset, pairs.cap[p.index]);
    pairs.next_offset[p.index] = ended ? EVP::CONTACT_ENDED : kept;
    pairs.spent[p.index] = ended ? -pairs.work[p.index] : law.dissipated(p.offset, kept);
  });
}

void PairNetwork::break_bonds()
{
  for (const int k : beyond) {
    const EVP::PackedPair pair = list.pairs[k];
    if (!pair.is_bond()) continue;
    const auto row = std::upper_bound(list.rows.begin(), list.rows.end(), k,
                                      [](int index, const EVP::PackedRow &r) {
                                        return index < r.last;
                                      });
    newly_broken.push_back({row->i, pair.j, list.pairs.history_of(k).work});
    if (work) work->stored.note_broken(list, k, pair.offset, rest_of_broken(row->i, pair));
    turn_into_contact(row->i, k);
  }
  beyond.clear();
}

// 0 where nothing is left
double PairNetwork::rest_of_broken(int i, const EVP::PackedPair &bond) const
{
  if (rules.contact == Contact::NONE) return 0.0;
  return rules.rest_of_broken(atom->radius[i] + atom->radius[bond.j], 1.0 / bond.inv_deq);
}

double PairNetwork::cut_of_bond(int i, int j, double deq) const
{
  const double dlim = alpha_of(atom->type[i], atom->type[j]) * (atom->radius[i] + atom->radius[j]);
  return rules.breaks() ? std::min(dlim, (1.0 + rules.break_strain) * deq) : dlim;
}

void PairNetwork::turn_into_contact(int i, int k)
{
  const EVP::PackedPair pair = list.pairs[k];
  list.pairs.turn_into_contact(k, rest_of_broken(i, pair), law_of(pair).cap(false, true));
  if (volume()) volume()->drop(k);
}

// from the list that was packed before from the same neighbor list
void PairNetwork::carry_histories(const EVP::PairList &before)
{
  std::vector<const EVP::PackedRow *> row_of(list.nlocal, nullptr);
  for (const EVP::PackedRow &row : before.rows) row_of[row.i] = &row;
  for (const EVP::PackedRow &row : list.rows)
    for (int k = row.first; row_of[row.i] && k < row.last; k++) {
      const int old = EVP::find_pair(before, *row_of[row.i], [&](int j) {
        return j == list.pairs.j[k];
      });
      if (old < 0) continue;
      const EVP::PairHistory history = before.pairs.history_of(old);
      if (history.broken != 0.0 && list.pairs[k].is_bond()) turn_into_contact(row.i, k);
      if (!rules.flows) continue;
      list.pairs.take_history(k, history);
    }
}

void PairNetwork::return_histories(EVP::BondStore &records, EVP::GhostExchange &exchange)
{
  if (!histories_due) return;
  histories_due = false;
  if (!EVP::on_all(snapshot.matches_list(), world))
    error->all(
        FLERR,
        "Pair evp/lj: atoms were added or deleted before it could keep how bonds have flowed "
        "or broken: define fix evp/bonds before all fixes that do so");
  LAMMPS_NS::return_histories(lmp, list, newly_broken, records, exchange);
  newly_broken.clear();
  warn_of_low_offsets();
}

// once per run
void PairNetwork::warn_of_low_offsets()
{
  if (!rules.flows || flow_warned) return;
  double lowest = -1.0;
  for (const int law : coefficients.laws_in_use())
    lowest = std::max(lowest, coefficients.law(law).lowest_offset());
  bool too_low = false;
  for (size_t k = 0; k < list.pairs.size(); k++) too_low = too_low || list.pairs.offset[k] < lowest;
  flow_warned = EVP::on_any(too_low, world);
  if (flow_warned && comm->me == 0)
    error->warning(FLERR,
                   "Pair evp/lj: pairs have flowed in compression to q below {:.3g} deq, where the "
                   "second regime is the stiffer, so that further flow creates energy: check load "
                   "and overlap",
                   lowest);
}

EVP::PairHistory PairNetwork::history_of(int i, int j) const
{
  if (!rules.has_history()) return {};
  if (snapshot.matches_list()) {
    if (row_index_build != list.build) {
      row_index_build = list.build;
      row_index.assign(list.nlocal, -1);
      for (size_t r = 0; r < list.rows.size(); r++) row_index[list.rows[r].i] = (int) r;
    }
    for (const auto &[own, other] : {std::pair(i, j), std::pair(j, i)}) {
      if (own >= list.nlocal || row_index[own] < 0) continue;
      const tagint partner = atom->tag[other];
      const int k = EVP::find_pair(list, list.rows[row_index[own]], [&](int at) {
        return atom->tag[at] == partner;
      });
      if (k >= 0) return list.pairs.history_of(k);
    }
  }
  if (store && store->has_history())
    for (const auto &[own, other] : {std::pair(i, j), std::pair(j, i)}) {
      if (own >= atom->nlocal) continue;
      const int slot = store->slot_of(own, atom->tag[other]);
      if (slot < 0) continue;
      const EVP::PairHistory history = store->histories_of(own)[slot];
      if (history.broken != 0.0) return {0.0, 0.0, 1.0};    // as of what is left in the list
      return history;
    }
  return {};
}

Contact PairNetwork::contact_between(int i, int j) const
{
  const bool repel = rules.contact != Contact::NONE && AtomBodies(atom, within()).apart(i, j);
  return repel ? Contact::REPULSIVE : rules.contact;
}

// one that only repels has no force at its cut but that of damping: spheres that touch do not interact
double PairNetwork::new_pair_margin(Contact contact) const
{
  if (contact != Contact::REPULSIVE) return EVP::NEW_PAIR_MARGIN;
  return any_gamma ? -EVP::NEW_PAIR_MARGIN : 0.0;
}

// what the pairs of any MPI rank ask of all; overlaps are warned of once per run
void PairNetwork::agree_on_pairs(const PairListBuilder::Found &found, bool records_are_current)
{
  const bigint sides =
      rules.breaks() && bonds() ? found.bond_sides + bonds()->count_broken(atom->nlocal) : 0;
  const auto all = EVP::reduce_all(std::array{(bigint) found.damped, found.overlaps.count, sides},
                                   MPI_SUM, world);
  explicit_damping = all[0] > 0;
  bonds_missing = rules.breaks() && bonds() && records_are_current && all[2] < 2 * bonds()->count();
  if (all[1] == 0 || overlap_warned) return;
  overlap_warned = true;

  PairListBuilder::Overlaps overlaps = found.overlaps;
  const int first = EVP::reduce_all(overlaps.count ? comm->me : comm->nprocs, MPI_MIN, world);
  MPI_Bcast(&overlaps, sizeof(overlaps), MPI_BYTE, first, world);
  if (comm->me == 0)
    error->warning(
        FLERR,
        "Pair evp/lj: {} pairs overlap by more than {} (R_i + R_j), first atoms {} and {} "
        "at d = {:.6g}, deq = {:.6g}, {} regime, at step {} with timestep {:.6g}: the law has no "
        "hard core, so check timestep, speed and load",
        all[1], rules.overlap, overlaps.id_i, overlaps.id_j, overlaps.d, overlaps.deq,
        overlaps.regime == 1 ? "first" : "second", update->ntimestep, update->dt);
}

// with 'pre no' nobody has looked since at what a new pair_style command says
void PairNetwork::check_rules() const
{
  const bool same =
      rules.flows == rules_of_run.flows && rules.break_strain == rules_of_run.break_strain;
  if (!same || (store && store->has_history() != rules.has_history()))
    error->all(FLERR,
               "Pair evp/lj: 'unload' or 'break' has changed since the last set-up: use 'run' with "
               "'pre yes'");
}

// of special_bonds, or of the pair special option of this sub-style of pair_style hybrid
void PairNetwork::check_weights() const
{
  for (int k = 1; k < 4; k++)
    if (force->special_lj[k] != 0.0 && force->special_lj[k] != 1.0)
      error->all(FLERR,
                 "Pair evp/lj takes special_bonds weights 0 or 1 only, got {}: the force of a pair "
                 "is whole or absent",
                 force->special_lj[k]);
}
