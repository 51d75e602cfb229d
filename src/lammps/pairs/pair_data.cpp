// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/pairs/pair_data.h"

#include "lammps/base/scene.h"

#include "atom_vec.h"
#include "domain.h"
#include "fix_deform.h"
#include "neigh_list.h"
#include "pair.h"

#include <cmath>

namespace EVP {

using scene::rows;

void BondSource::begin_run(const PairRules &rules)
{
  update();
  const Fix *fix = scene::find_fix(modify, "evp/bonds");
  store = scene::find_records(modify);
  if (!recorder.empty() && (!records() || recorder != fix->id))
    error->all(FLERR,
               "Pair evp/lj: the bonds were recorded by fix {}, whose records are not here: define "
               "'fix {} all evp/bonds' right after read_restart and before the run, or start again "
               "with 'pair_style none' and 'pair_style evp/lj'",
               recorder, recorder);
  if (records()) recorder = fix->id;
  if (rules.has_history() && !fix)
    error->all(
        FLERR,
        "Pair evp/lj: {} needs fix evp/bonds, which stores the history of the bonds: define it "
        "before the run",
        rules.plastic ? "plasticity isotropic" : "break");
}

void BondSource::update()
{
  if (!store) return;
  if (store->is_closed()) {
    if (!recorder.empty()) dropped = recorder;
    recorder.clear();
    store.reset();
  } else if (store->has_recorded() && recorder.empty())
    recorder = scene::find_fix(modify, "evp/bonds")->id;
}

PairData::PairData(LAMMPS *lmp, Coefficients &coefficients_in) :
    Pointers(lmp), types(lmp, coefficients_in), source(lmp),
    histories(lmp, lists_, coefficients_in, rules_, types, effects), coefficients_(coefficients_in),
    builder(lmp), snapshot(lmp)
{
}

void PairData::set_rules(const PairRules &given)
{
  rules_ = given;
  effects_of_rules = make_effects(lmp, *this);
}

// those of the rules first
std::vector<std::shared_ptr<Effect>> PairData::find_effects() const
{
  std::vector<std::shared_ptr<Effect>> found = effects_of_rules;
  for (Fix *const fix : modify->get_fix_list())
    if (auto *const owner = dynamic_cast<HasEffect *>(fix)) found.push_back(owner->effect());
  return found;
}

PairData *PairData::find(Force *force)
{
  auto *const owner = dynamic_cast<HasPairData *>(force->pair_match("evp/lj", 1));
  return owner ? owner->get_pair_data() : nullptr;
}

PairData *PairData::require(Force *force, Error *error, const std::string &who)
{
  PairData *pair_data = find(force);
  if (!pair_data)
    error->all(FLERR, "{} needs pair style evp/lj, found '{}'", who,
               force->pair_style ? force->pair_style : "none");
  return pair_data;
}

PairData *PairData::require_present(Force *force, Error *error, const std::string &who)
{
  PairData *pair_data = find(force);
  if (!pair_data || !pair_data->is_present())
    error->all(FLERR,
               "{} needs the pairs of the current atoms: use 'run 0' first (since the last run "
               "atoms moved by more than half the skin, were changed, added or removed, or a "
               "command such as write_data rebuilt the lists of LAMMPS)",
               who);
  return pair_data;
}

const PairLists &PairData::packed_pairs() const
{
  if (!is_packed())
    error->one(FLERR,
               "Pair evp/lj has not seen the current neighbor list yet: use its fixes and computes "
               "in a run, after the forces of the step");
  return lists_;
}

PackedPair PairData::pair_between(int i, int j, int itype, int jtype) const
{
  if (std::max(i, j) >= atom->nlocal + atom->nghost || !snapshot.matches_list())
    error->one(FLERR,
               "Pair evp/lj has not seen the current neighbor list yet: use 'run 0' before the "
               "forces of single pairs are asked for; pair_write has no pair with a deq");
  if (rows_build != lists_.build) {
    rows_build = lists_.build;
    rows_of_atoms.assign(lists_.nlocal, {});
    for (const PairList *list : {&lists_.bonds, &lists_.contacts})
      for (const PackedRow &row : list->rows) rows_of_atoms[row.i].push_back({list, row});
  }
  for (const auto &[own, other] : {std::pair(i, j), std::pair(j, i)}) {
    if (own >= lists_.nlocal) continue;
    for (const auto &[list, row] : rows_of_atoms[own])
      for (int k = row.first; k < row.last; k++)
        if (atom->tag[list->j[k]] == atom->tag[other]) return list->pair(k);
  }
  PackedPair none{};    // at rest where the spheres touch
  none.inv_deq = 1.0 / (atom->radius[i] + atom->radius[j]);
  none.cutsq = -1.0;
  none.law = coefficients_.index(itype, jtype);
  return none;
}

// Has an effect that adds forces come or gone since the last run?
bool PairData::forces_have_changed() const
{
  std::vector<const Effect *> then, now;
  effects.for_each([&](const Effect &one) {
    if (one.needs_bonds()) then.push_back(&one);
  });
  for (const auto &one : find_effects())
    if (one->needs_bonds()) now.push_back(one.get());
  return then != now;
}

size_t PairData::add_column_of(double BondRecord::*value)
{
  PairList &bonds = lists_.bonds;
  const size_t column = bonds.add_column(BondRecord{}.*value, false, line_of(value));
  std::vector<double> &values = bonds.columns[column].values;
  for (const PackedRow &row : bonds.rows)
    for (int k = row.first; k < row.last; k++)
      if (const BondRecord *const own = this->bonds()->find(row.i, atom->tag[bonds.j[k]]))
        values[k] = own->*value;
  return column;
}

bool PairData::is_packed() const
{
  if (!snapshot.matches_list()) return false;
  if (update->whichflag != 0) return true;
  return !repack_due && source.version() == source_version && !forces_have_changed() &&
      snapshot.matches_atoms() && !(bonds() && bonds()->find_misplaced(atom->tag, atom->nlocal));
}

// Does a fix move atoms with the box at the end of a step, when ghosts are no longer updated?
static bool moves_atoms_with_box(const Modify *modify, const Domain *domain)
{
  for (int k = 0; domain->box_change && k < modify->nfix; k++) {
    const Fix *const fix = modify->fix[k];
    if (!fix->box_change || !(modify->fmask[k] & FixConst::END_OF_STEP)) continue;
    const auto *const deform = dynamic_cast<const FixDeform *>(fix);
    if (!deform || deform->remapflag == Domain::X_REMAP) return true;
  }
  return false;
}

namespace {

  /// Style of each edge and tilt, which the fix tells nobody but its heirs.
  struct DeformStyles : public FixDeform {
    static int of(const FixDeform *fix, int k) { return (fix->*&DeformStyles::set)[k].style; }
  };

  // Of edges whose length follows from volume or pressure, as those of keyword box of fix deform/pressure, which have no
  // style of their own, LAMMPS stores a strain rate in place of the rate of the length
  bool has_wrong_rate(const FixDeform *fix, int edge)
  {
    const int style = DeformStyles::of(fix, edge);
    return fix->dimflag[edge] &&
        (style == FixDeform::NONE || style == FixDeform::VOLUME || style == FixDeform::PRESSURE ||
         style == FixDeform::PMEAN);
  }

}    // namespace

void PairData::stop_at_wrong_box_rates() const
{
  for (const Fix *fix : modify->get_fix_list()) {
    const auto *const deform = dynamic_cast<const FixDeform *>(fix);
    if (!deform || deform->remapflag != Domain::V_REMAP) continue;
    for (int edge = 0; edge < 3; edge++)
      if (has_wrong_rate(deform, edge))
        error->all(FLERR,
                   "Pair evp/lj: damping needs the rate of edge {} of the box, but where volume or "
                   "pressure set an edge, 'remap v' of fix {} of style {} has a wrong one: use "
                   "erate or trate, with rates that keep the volume, or 'remap x'",
                   "xyz"[edge], fix -> id, fix -> style);
  }
}

bool PairData::is_present()
{
  if (!on_all(is_packed(), world)) return false;
  const bool in_run = update->whichflag != 0;
  if (!in_run && !snapshot.matches_commands()) return false;
  if (!in_run || moves_atoms_with_box(modify, domain)) comm->forward_comm();
  return in_run || !snapshot.moved_too_far();
}

std::array<double, 4> PairData::count_pairs() const
{
  std::array<double, 3> sums{};
  double lowest = HUGE_VAL;
  for_each_pair(lists_, rows(atom->x), [&](const PlacedPair &p) {
    const double d = p.distance();
    lowest = std::min(lowest, d / (atom->radius[p.i] + atom->radius[p.j]));
    if (!p.acts()) return;

    const double weight = rank_share(p.j, lists_.nreact);
    sums[p.is_bond ? 0 : 2] += weight;
    if (p.is_bond && state_of(p).regime == 2) sums[1] += weight;
  });

  sums = reduce_all(sums, MPI_SUM, world);
  lowest = reduce_all(lowest, MPI_MIN, world);
  return {sums[0], sums[1], sums[2], lowest < HUGE_VAL ? lowest : 0.0};
}

// a run that ended in an error, which a program has caught, has not told the records of its last steps
void PairData::end_broken_run()
{
  if (!histories.are_due()) return;
  if (!bonds() || source.version() != source_version) return histories.drop();
  if (on_all(snapshot.matches_list() && snapshot.matches_atoms() && snapshot.matches_commands(),
             world))
    scene::find_fix(modify, "evp/bonds")->pre_exchange();
  else
    error->all(FLERR,
               "Pair evp/lj: the flow since the last neighbor build of a run that ended in an "
               "error is lost, as atoms have changed since: go on from a restart file");
}

void PairData::begin_run()
{
  source.begin_run(rules_);
  end_broken_run();
  types.begin_run(bonds());    // for init_one()
  effects.clear();
  implicit_groupbits_ = 0;
  for (const auto &one : find_effects()) {
    one->rows_scaled(coefficients_);
    if (!one->begin_run(*this)) continue;
    effects.add(one);
    implicit_groupbits_ |= one->damped_groupbits();
  }
  any_gamma = scene_checked = any_unlisted = false;
  repack_due = true;
  snapshot.forget();
}

double PairData::handle(int i, int j)
{
  const Row row = types.make(i, j, rules_.plastic);
  repack();
  if (row.gamma > 0.0) any_gamma = true;    // fix adapt may have switched it on
  if (rules_.joins() && !(row.alpha > APART * rules_.join.within))
    error->all(FLERR,
               "Pair evp/lj, types {} and {}: contact join {} needs an alpha above {:.4g}, as a "
               "bond that ends at dlim must be apart, got {}: give a smaller distance to join",
               i, j, rules_.join.within, APART * rules_.join.within, row.alpha);
  return types.handle(i, j, row.alpha * (may_grow(i) || may_grow(j) ? 1.0 + MOST_EXPANSION : 1.0));
}

// by the row of the like type, whatever that of the pair has
bool PairData::may_grow(int type) const
{
  return row_of(type).expansion > 0.0 && effects.any([](const Effect &one) {
    return one.uses(&Row::expansion);
  });
}

// those that damp, or the others
std::string PairData::describe_effects(bool that_damp) const
{
  std::string text;
  effects.for_each([&](const Effect &one) {
    if ((one.damped_groupbits() != 0) == that_damp) text += one.describe();
  });
  return text;
}

// one line of the active effects, again only when it changes
void PairData::report()
{
  std::string line = "evp/lj: ";
  if (!any_gamma)
    line += "damping off";
  else
    line += !damping_acts()  ? std::string("damping off (minimization)")
        : damps_implicitly() ? "damping" + describe_effects(true)
                             : "damping on";
  line += fmt::format(", contact {}", CONTACTS[(int) rules_.contact]);
  if (rules_.joins()) line += fmt::format(" within {} (R_i + R_j)", rules_.join.within);
  line += source.has_fix()
      ? fmt::format(", deq of bonds from fix {}", scene::find_fix(modify, "evp/bonds")->id)
      : ", no fix evp/bonds: every pair has deq = R_i + R_j";
  if (within() != BodyRule::ALL)
    line +=
        fmt::format(" within {} (bodies {})", BODY_RULES[(int) within()],
                    rules_.contact == Contact::NONE         ? "do not interact"
                        : rules_.joins() && rules_.join.all ? "repel each other, or join"
                                                            : "only repel each other, elastically");
  if (rules_.plastic) line += ", plasticity isotropic";
  if (rules_.update) line += fmt::format(", limits updated every {} steps", rules_.update);
  if (rules_.breaks())
    line += fmt::format(", bonds break beyond {} deq", 1.0 + rules_.break_strain);
  line += describe_effects(false);
  line += types.find_inactive_keywords(rules_.plastic, effects);
  line += fmt::format(", overlap warning above {} (R_i + R_j)\n", rules_.overlap);

  if (line == std::exchange(last_report, line) || comm->me) return;
  utils::logmesg(lmp, line);
  if (!source.has_fix() && rules_.contact == Contact::NONE)
    error->warning(FLERR,
                   "Pair evp/lj with contact none and without fix evp/bonds: no pair interacts; "
                   "define the fix, or choose another contact");
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (types.handles(i, j) && alpha_of(i, j) < 1.4 && rules_.contact == Contact::LITERAL)
        error->warning(FLERR,
                       "Pair evp/lj, types {} and {}: alpha = {} is below 1.4, where literal new "
                       "contacts can pull the body together; use contact repulsive or none",
                       i, j, alpha_of(i, j));
}

bool PairData::prepare(const NeighList *neighbors)
{
  const bool due = neighbor->ago == 0 || repack_due || source.version() != source_version ||
      (!atom->avec->comm_x_only && on_any(snapshot.radii_changed(), world));
  const bool is_first = due && pack(neighbors);
  histories.begin_forces();
  return is_first;
}

// Returns whether it is the first one of a run.
bool PairData::pack(const NeighList *neighbors)
{
  // after the recording, write_restart and the like make LAMMPS replace the list, which 'run pre no' does not build
  if (atom->nlocal && neighbors->inum == 0 && !neighbors->listskip && !neighbor->includegroup)
    error->one(
        FLERR,
        "Pair evp/lj: a command has replaced the neighbor list since the last run: omit 'pre no'");
  const bool is_first = !scene_checked;
  source.update();
  if (types.rescale_if_measures_changed(bonds(), rules_.plastic))
    effects.for_each([this](Effect &one) {
      one.rows_scaled(coefficients_);
    });
  if (is_first) {    // now that all pairs of types are known
    scene_checked = true;
    report();
    types.report(rules_.plastic, effects);
  }
  if (is_first && damping_acts()) stop_at_wrong_box_rates();
  lists_.common_build++;
  types.check_radii();
  const bool same_list = snapshot.matches_list() && source.version() == source_version;
  // with the same neighbor list the records have not been told of what changed
  if (histories.are_due() && snapshot.matches_list())
    scene::find_fix(modify, "evp/bonds")->pre_exchange();
  snapshot.note_atoms(!atom->avec->comm_x_only);
  lists_.growth.clear();
  lists_.nlocal = atom->nlocal;
  lists_.nall = atom->nlocal + atom->nghost;
  lists_.nreact = force->newton_pair ? lists_.nall : lists_.nlocal;
  repack_due = false;
  source_version = source.version();
  const bool looks_first = rules_.joins() && bonds() && !(bonds()->joins_by == rules_.join);
  const PairListBuilder::Found found =
      builder.build({neighbors, &coefficients_, bonds(), rules_, within(), any_gamma,
                     implicit_groupbits_, looks_first},
                    lists_);
  if (looks_first) histories.note_look();
  if (!rules_.joins() && bonds()) histories.store().joins_by = {};
  if (is_first && bonds()) types.check(lists_.bonds, effects);
  snapshot.finish();
  if (!bonds()) effects.drop_those_that_need_bonds();    // these have gone since the last set-up
  histories.note_packing();
  const bigint without_pair = agree_on_pairs(found, same_list);
  if (!same_list) {    // else the same bonds are far
    histories.clear_unlisted();
    if (any_unlisted) find_unlisted(without_pair);
  }
  held_beyond_list = 0.0;
  for (const UnlistedBond &bond :
       histories.unlisted_bonds())    // a bond of two MPI ranks counts half on each
    if (is_incremental() && rules_.plastic)
      held_beyond_list += 0.5 * (bond.state.stored.total() + bond.state.dissipated);
  effects.for_each([&](Effect &one) {
    one.pairs_packed(neighbors);
    one.unlisted_bonds_found(histories.unlisted_bonds());
  });

  coefficients_.choose_block_laws(
      [this](int i, int j) {
        return types.handles(i, j);
      },
      explicit_damping && implicit_groupbits_, within() != BodyRule::ALL, rules_.flow_of_bonds(),
      rules_.flow_of_contacts());
  return is_first;
}

// Collective. LAMMPS takes excluded pairs for such that never act: their bonds would be second where they are
void PairData::find_unlisted(bigint records_without_pair)
{
  const bigint explained = reduce_all((bigint) histories.find_unlisted(), MPI_SUM, world);
  if (explained < records_without_pair && neighbor->ago == 0)
    error->all(FLERR,
               "Pair evp/lj: {} bonds are kept out of the neighbor list by neigh_modify exclude or "
               "include, or by a special_bonds weight of 0, set after they were recorded: undo it, "
               "or use it before fix evp/bonds records, so that these pairs are no bonds",
               (records_without_pair - explained + 1) / 2);
}

void PairData::commit(bool at_rest)
{
  const auto find_anew = [this] {
    const ParticleView view = {positions(), nullptr, nullptr, lists_.nreact};
    effects.for_each([&](Effect &one) {
      one.before_forces(view);
    });
  };
  if (at_rest) {
    histories.find_next();
    find_anew();
  }
  histories.commit();
  if (!at_rest || !rules_.plastic) return;
  histories.update_effects(Sharing::UPDATED);
  find_anew();
  effects.for_each([](Effect &one) {
    one.committed();
  });
}

// Collective. All MPI ranks agree on what any of them has found in its pairs; warns of overlaps, and again when there are
// twice as many. Returns how many records of bonds have no pair in the list, of those of both atoms.
bigint PairData::agree_on_pairs(const PairListBuilder::Found &found, bool same_list)
{
  const bool asks =
      bonds() && (rules_.has_history() || effects.any(&Effect::follows_unlisted_bonds));
  const bigint without = asks ? bonds()->count_sides(atom->nlocal) - found.bond_sides : 0;
  const auto all =
      reduce_all(std::array{(bigint) found.damped, found.overlaps.count, without}, MPI_SUM, world);
  explicit_damping = all[0] > 0;
  if (!same_list) any_unlisted = all[2] > 0;
  if (all[1] <= 2 * overlaps_told) return all[2];
  overlaps_told = all[1];

  PairListBuilder::Overlaps overlaps = found.overlaps;
  const int first = reduce_all(overlaps.count ? comm->me : comm->nprocs, MPI_MIN, world);
  MPI_Bcast(&overlaps, sizeof(overlaps), MPI_BYTE, first, world);
  if (comm->me == 0)
    error->warning(FLERR,
                   "Pair evp/lj: {} pairs overlap by more than {} (R_i + R_j), first atoms {} and "
                   "{} at d = {:.6g}, deq = {:.6g}, at step {} with timestep {:.6g}: "
                   "the law has no hard core, so check timestep, speed and load",
                   all[1], rules_.overlap, overlaps.id_i, overlaps.id_j, overlaps.d, overlaps.deq,
                   update->ntimestep, update->dt);
  return all[2];
}

}    // namespace EVP
