// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/pairs/pair_evp_lj.h"

#include "core/law/row_text.h"
#include "core/pairs/pair_block.h"
#include "lammps/base/per_atom.h"
#include "lammps/base/restart_file.h"
#include "lammps/base/scene.h"
#include "lammps/base/user_input.h"

#include "comm.h"
#include "memory.h"
#include "neighbor.h"
#include "output.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>

using namespace LAMMPS_NS;
using namespace EVP;
using scene::rows;

static constexpr double RESTART_FORMAT = 2014;    // first word of our section in restart files
static constexpr double LONGEST_ID = 1000;
static constexpr size_t SETTINGS = 12;    // words of it in front of the ID of the fix that recorded

static size_t words_of_text(size_t length)
{
  return (length + sizeof(double) - 1) / sizeof(double);
}

namespace {

/// Hands energies and forces to LAMMPS pair by pair: for per-atom values and compute */tally.
class PairTally final : public PairConsumer {
 public:
  PairTally(Pair *style_in, int nlocal_in, int newton_in, bool potential_in, bool incremental_in) :
      style(style_in), nlocal(nlocal_in), newton(newton_in), potential(potential_in),
      incremental(incremental_in)
  {
  }

  void ask(const PairList &, BlockLaw::Asked &asked) const override
  {
    asked.potential |= potential;
    asked.incremental |= incremental;
  }

  void operator()(const PairRange &range, PairBlock &block) override
  {
    range.for_each_row([&](int i, int first, int last) {
      for (int k = first; k < last; k++) {
        const int b = k - range.first;
        style->ev_tally(i, range.list.j[k], nlocal, newton, potential ? block.potential[b] : 0.0,
                        0.0, block.force[b], block.xy[2 * b], block.xy[2 * b + 1], block.z[b]);
      }
    });
  }

 private:
  Pair *const style;
  const int nlocal, newton;
  const bool potential, incremental;
};

}    // namespace

PairEVPLJ::PairEVPLJ(LAMMPS *lmp) : Pair(lmp), pair_data(lmp, coefficients)
{
  comm_forward = 3;    // velocities
  single_extra = NVALUES;
  svector = new double[NVALUES];
}

PairEVPLJ::~PairEVPLJ()
{
  delete[] svector;
  memory->destroy(setflag);
  memory->destroy(cutsq);
}

void PairEVPLJ::allocate()
{
  allocated = 1;
  const int n = atom->ntypes + 1;
  memory->create(setflag, n, n, "pair:setflag");
  memory->create(cutsq, n, n, "pair:cutsq");
  std::fill_n(setflag[0], n * n, 0);
  std::fill_n(cutsq[0], n * n, 0.0);
  coefficients.resize(atom->ntypes);
}

// Takes out of words, from the k-th on: [exposure Y0 [pressure S0]]
void PairEVPLJ::take_joining_criterion(std::vector<char *> &words, int k, JoinRule &join) const
{
  const auto take = [&](const char *name, double most, const char *rule) {
    double value = 0.0;
    if (k == (int) words.size() || strcmp(words[k], name) != 0) return value;
    if (k + 1 == (int) words.size() || !is_number(words[k + 1], value) ||
        !(value > 0.0 && value < most))
      error->all(FLERR, "Pair style evp/lj: {} of contact join must be {}, got {}", name, rule,
                 k + 1 == (int) words.size() ? "nothing" : words[k + 1]);
    words.erase(words.begin() + k, words.begin() + k + 2);
    return value;
  };
  join.exposure = take("exposure", 1.0,
                       "the share of two surfaces that is new when they bond, above 0 and below 1");
  if (join.exposure > 0.0)
    join.pressure = take("pressure", HUGE_VAL, "a positive number of flow stresses");
}

// pair_style evp/lj [contact literal|repulsive|none|join [BETA] [all [exposure Y0 [pressure S0]]]] [overlap 0.3]
//   [plasticity none|isotropic] [break none|XI] [update N]
void PairEVPLJ::settings(int narg, char **arg)
{
  PairRules chosen;
  std::vector<char *> words(arg, arg + narg);
  for (int k = 0; k + 2 < (int) words.size(); k += 2) {    // of contact join
    if (strcmp(words[k], "contact") != 0 || strcmp(words[k + 1], "join") != 0) continue;
    chosen.join = PairRules().join;
    const auto next = words.begin() + k + 2;
    if (double within; is_number(*next, within)) {
      if (!(within >= 1.0))
        error->all(FLERR,
                   "Pair style evp/lj: contact join must have a distance over R_i + R_j of 1 or "
                   "more, got {}",
                   *next);
      chosen.join.within = within;
      words.erase(next);
    }
    if (k + 2 == (int) words.size() || strcmp(words[k + 2], "all") != 0) continue;
    chosen.join.all = true;
    words.erase(words.begin() + k + 2);
    take_joining_criterion(words, k + 2, chosen.join);
  }
  for (const char *const word : words)
    if (strcmp(word, "exposure") == 0 || strcmp(word, "pressure") == 0)
      error->all(
          FLERR,
          "Pair style evp/lj: '{}' must stand in contact join [BETA] all exposure Y0 [pressure "
          "S0], once",
          word);
  for_each_keyword(
      error, "Pair style evp/lj", (int) words.size(), words.data(),
      {"contact", "overlap", "plasticity", "break", "update"}, " and ", [&](const Keyword &word) {
        if (word.is("contact")) {
          const auto *found = std::find(std::begin(CONTACTS), std::end(CONTACTS), word.value);
          if (found == std::end(CONTACTS))
            throw BadInput("contact must be literal, repulsive, none or join, got '" + word.value +
                           "'");
          chosen.contact = (Contact) (found - CONTACTS);
        } else if (word.is("plasticity")) {
          word.demand(word.value == "none" || word.value == "isotropic",
                      "must be none (the paper's law) or isotropic (permanent flow)");
          chosen.plastic = word.value == "isotropic";
        } else if (word.is("break")) {
          if (word.value == "none") {
            chosen.break_strain = 0.0;
            return;
          }
          chosen.break_strain = word.number();
          word.demand(chosen.break_strain > 0.0 && std::isfinite(chosen.break_strain),
                      "must be none or a positive strain, at which bonds break for good");
        } else if (word.is("update")) {
          const double steps = word.number();
          word.demand(steps >= 1.0 && steps <= 1.0e9 && steps == std::floor(steps),
                      "must be an integer from 1 to 1e9 (steps between two updates of plastic "
                      "strains and elastic limits)");
          chosen.update = (int) steps;
        } else {
          chosen.overlap = word.number();
          word.demand(
              chosen.overlap > 0.0 && chosen.overlap <= 1.0,
              "must lie in (0, 1] (the fraction of R_i + R_j above which overlaps are warned of)");
        }
      });
  if (chosen.plastic && chosen.contact == Contact::LITERAL)
    error->all(FLERR,
               "Pair style evp/lj: 'plasticity isotropic' and 'contact literal' together create "
               "energy: add 'contact repulsive' or 'contact none'");
  if (chosen.joins() && !chosen.plastic)
    error->all(FLERR,
               "Pair style evp/lj: 'contact join' needs 'plasticity isotropic': add it, or use "
               "another contact");
  if (chosen.update && !chosen.plastic)
    error->all(FLERR,
               "Pair style evp/lj: 'update {}' needs 'plasticity isotropic', without which there "
               "are no plastic strains: add it, or leave 'update' out",
               chosen.update);
  pair_data.set_rules(chosen);
  pair_data.repack();
  offer_pair_values();
}

// pair_coeff I J e1 m1 n1 e2 m2 n2 xi_s gamma alpha [keyword value ...], or pair_coeff I J FILE ROW,
// or pair_coeff I J FILE:ROW
void PairEVPLJ::coeff(int narg, char **arg)
{
  if (!allocated) allocate();

  // before the types, which are taken for numbers of the row where they are missing
  Row row;
  stop_at_bad_input(error, "Pair evp/lj", [&] {
    row = read_row(lmp, {arg + 2, arg + narg});
  });
  if (row.is_scaled())
    scene::demand_three_dimensions(
        domain, error, "Pair evp/lj", "the scaling of a row by 'spacing' and 'coordination'",
        fmt::format("use 'dimension 3', or give the {} numbers of the row alone", NREQUIRED));
  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);

  bool any = false;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      coefficients.set(i, j, row);
      setflag[i][j] = 1;
      any = true;
    }
  pair_data.repack();
  if (!any)
    error->all(FLERR, "Pair evp/lj: pair_coeff {} {} names no pair of types I <= J", arg[0],
               arg[1]);
}

void PairEVPLJ::init_style()
{
  if (!atom->radius_flag)
    error->all(FLERR, "Pair evp/lj needs particles with a radius: use 'atom_style sphere'");
  if (utils::strmatch(force->pair_style, "^hybrid/scaled"))
    error->all(FLERR,
               "Pair evp/lj does not work in pair_style hybrid/scaled, which multiplies forces but "
               "not energies, damping, flow and the stable timestep: use hybrid/overlay, and "
               "multiply e1, e2 and gamma of the row");
  if (PairData::find(force) != &pair_data)
    error->all(FLERR,
               "Pair evp/lj can be one sub-style of pair_style hybrid only, as a pair has one deq: "
               "give its types rows of their own instead");
  if (!atom->tag_enable)
    error->all(FLERR, "Pair evp/lj needs atom IDs: remove 'atom_modify id no'");
  const PairRules &rules = pair_data.rules();
  if (rules.plastic && rules.breaks())
    error->all(FLERR,
               "Pair evp/lj: 'break {0}' is for 'plasticity none'; with 'plasticity isotropic' "
               "leave it out, and add 'damage {0} 0 0 0 0 rupture 0' to the row (pair_coeff), with "
               "'density'",
               rules.break_strain);
  pair_data.begin_run();
  neighbor->add_request(this);
}

double PairEVPLJ::init_one(int i, int j)
{
  if (!setflag[i][j])
    error->all(FLERR,
               "Pair evp/lj does not mix unlike types: give 'pair_coeff {} {}' a row of its own", i,
               j);
  return pair_data.handle(i, j);
}

void PairEVPLJ::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);

  if (pair_data.prepare(list)) warn_of_timestep(lmp, pair_data);
  const bool damps = pair_data.damping_acts() && pair_data.damps_explicitly();
  if (damps && !comm->ghost_velocity) comm->forward_comm(this);
  velocities_sent = damps;
  sum_forces(damps);

  if (eflag_global) eng_vdwl += pair_data.energy_beyond_list();
  const bool summed = vflag_fdotr;    // the sum clears its flag
  if (summed) virial_fdotr_compute();

  // a sum that LAMMPS asked for anyway shows whether any force is non-finite
  if ((eflag_either && !std::isfinite(eng_vdwl)) || (summed && !std::isfinite(virial[0])))
    stop_at_blow_up();
}

// Velocities of ghosts. Periodic images move with a box that deforms with 'remap v'.
int PairEVPLJ::pack_forward_comm(int n, int *indices, double *buf, int pbc_flag, int *pbc)
{
  std::array<double, 3> image{};
  if (pbc_flag && domain->deform_vremap) image = image_shift(domain->h_rate, pbc);
  for (int k = 0; k < n; k++) {
    const int i = indices[k];
    const bool moves = atom->mask[i] & domain->deform_groupbit;
    for (int c = 0; c < 3; c++) buf[3 * k + c] = atom->v[i][c] + (moves ? image[c] : 0.0);
  }
  return 3 * n;
}

void PairEVPLJ::unpack_forward_comm(int n, int first, double *buf)
{
  if (n > 0) std::copy_n(buf, (size_t) 3 * n, atom->v[first]);
}

// names where it began, and the restart file to go back to
void PairEVPLJ::stop_at_blow_up() const
{
  // where an atom is lost all its pairs are: name that atom first
  std::string culprit;
  for (int i = 0; i < atom->nlocal && culprit.empty(); i++) {
    const double *x = atom->x[i], *v = atom->v[i];
    if (!std::isfinite(x[0] + x[1] + x[2] + v[0] + v[1] + v[2]))
      culprit =
          fmt::format("first atom {}, whose position or velocity is non-finite", atom->tag[i]);
  }
  for_each_pair(pair_data.packed_pairs(), rows(atom->x), [&](const PlacedPair &p) {
    const double *f = atom->f[p.i];
    if (!culprit.empty() || std::isfinite(p.g.dsq + f[0] + f[1] + f[2])) return;
    culprit = fmt::format("first atoms {} and {} at d = {:.6g}, deq = {:.6g}", atom->tag[p.i],
                          atom->tag[p.j], p.distance(), 1.0 / p.inv_deq);
  });
  if (culprit.empty()) culprit = "no pair of this MPI rank";
  const bigint saved = output ? output->last_restart : -1;
  error->one(FLERR,
             "Pair evp/lj: non-finite forces (NaN or Inf) at step {} with timestep {:.6g}; {}: the "
             "timestep is above the limit (see compute evp/dt) or the motion too fast for it (see "
             "fix dt/evp); last restart file: {}",
             update->ntimestep, update->dt, culprit,
             saved >= 0 ? fmt::format("step {}", saved) : "none");
}

void PairEVPLJ::sum_forces(bool damps)
{
  PairLists &lists = pair_data.lists();
  const Effects &effects = pair_data.effects;
  ParticleView view = {rows(atom->x), damps ? rows(atom->v) : nullptr,
                       reinterpret_cast<double(*)[3]>(atom->f ? atom->f[0] : nullptr),
                       lists.nreact};
  effects.for_each([&](Effect &one) {
    one.before_forces(view);
  });

  const bool energy = eflag_either != 0, incremental = pair_data.is_incremental();
  const bool each = eflag_atom || vflag_atom || cvflag_atom || num_tally_compute > 0;
  PairTally tally(this, lists.nlocal, force->newton_pair, energy, incremental);
  // consumers has those that change forces, and only reads from then on
  const auto add = [&](PairList &list, const BlockLaw &law) {
    PairSums sums(lists.nreact, energy, vflag_global != 0, incremental);
    if (evflag) consumers.push_back(each ? static_cast<PairConsumer *>(&tally) : &sums);
    effects.for_each([&](Effect &one) {
      if (PairConsumer *const reader = one.reads_forces(list)) consumers.push_back(reader);
    });
    accumulate_forces(list, law, view, consumers);
    eng_vdwl += sums.energies.total();
    for (int k = 0; k < 6; k++) virial[k] += sums.virials[k].total();
    consumers.clear();
  };
  const auto add_own = [&](PairList &list, PairConsumer *changing) {
    effects.for_each([&](Effect &one) {
      if (PairConsumer *const adder = one.adds_forces(list)) consumers.push_back(adder);
    });
    if (changing) consumers.push_back(changing);
    add(list, coefficients.block_law(list));
  };
  add_own(lists.bonds, pair_data.histories.ending_to_find());
  add_own(lists.contacts, pair_data.histories.beginning_to_find());
  view.v = nullptr;
  effects.for_each([&](Effect &one) {
    one.for_each_further_list([&](PairList &list, PairConsumer &adder) {
      consumers.push_back(&adder);
      add(list, {});
    });
  });
  effects.for_each([&](Effect &one) {
    one.after_forces(view);
  });
}

double PairEVPLJ::single(int i, int j, int itype, int jtype, double rsq, double /*factor_coul*/,
                         double factor_lj, double &fforce)
{
  fforce = 0.0;
  const PackedPair pair = pair_data.pair_between(i, j, itype, jtype);
  const PairLaw &law = pair_data.law_of(pair);
  const double d = std::sqrt(rsq), deq = 1.0 / pair.inv_deq;
  const PairState now = law.state(d * pair.inv_deq, pair);
  const bool is_apart = pair.flow == Flow::PLASTIC_CONTACT && d > deq;
  const bool acts = rsq <= pair.cutsq && factor_lj != 0.0 && !is_apart;
  svector[0] = deq;
  svector[1] = (d - deq) / deq;
  svector[2] = acts ? now.regime : 0.0;

  if (factor_lj != 0.0)
    pair_data.effects.for_each([&](const Effect &one) {
      fforce += one.force_between(i, j, d, pair) / d;
    });
  if (!acts) return 0.0;
  fforce += now.force / d;
  if (pair_data.damping_acts() && (comm->ghost_velocity || velocities_sent)) {
    const PairGeometry g(rows(atom->x), i, j);
    fforce += damping_over_distance(law.gamma, g, atom->v[i], atom->v[j]);
  }
  if (pair.flow != Flow::REVERSIBLE)
    return now.stored.total() + (pair_data.is_incremental() ? now.dissipated : 0.0);
  return now.stored.total() - law.state(pair.cut * pair.inv_deq, pair).stored.total();
}

// restart files hold settings, the fix that recorded, and per pair of types whether there is a row, and the row; each sealed
void PairEVPLJ::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      std::vector<double> words = words_of(coefficients.row(i, j));
      words.push_back(setflag[i][j]);
      seal(words);
      fwrite(words.data(), sizeof(double), words.size(), fp);
    }
}

// Appends so many words
void PairEVPLJ::read_together(FILE *fp, std::vector<double> &words, size_t n) const
{
  words.resize(words.size() + n);
  double *const read = &words[words.size() - n];
  if (comm->me == 0) utils::sfread(FLERR, read, sizeof(double), n, fp, nullptr, error);
  MPI_Bcast(read, (int) n, MPI_DOUBLE, 0, world);
}

void PairEVPLJ::stop_at_damage(const std::string &where) const
{
  restart_file::stop_at_damaged_section(error,
                                        "Pair evp/lj: the restart file is damaged in the " + where);
}

void PairEVPLJ::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      std::vector<double> words;
      read_together(fp, words, ROW_WORDS + 2);
      if (!is_sealed(words.data(), words.size()))
        stop_at_damage(fmt::format("coefficients of types {} and {}", i, j));
      setflag[i][j] = (int) words[ROW_WORDS];
      if (setflag[i][j]) coefficients.set(i, j, row_of_words(words.data()));
    }
}

void PairEVPLJ::write_restart_settings(FILE *fp)
{
  pair_data.source.update();
  const PairRules &rules = pair_data.rules();
  const std::string &recorder = pair_data.source.recorder;
  std::vector<double> words = {RESTART_FORMAT,          ROW_WORDS,
                               (double) rules.contact,  rules.overlap,
                               (double) rules.plastic,  rules.break_strain,
                               rules.join.within,       (double) recorder.size(),
                               (double) rules.join.all, (double) rules.update,
                               rules.join.exposure,     rules.join.pressure};
  words.resize(SETTINGS + words_of_text(recorder.size()), 0.0);
  memcpy(&words[SETTINGS], recorder.data(), recorder.size());
  seal(words);
  fwrite(words.data(), sizeof(double), words.size(), fp);
}

void PairEVPLJ::read_restart_settings(FILE *fp)
{
  std::vector<double> words;
  read_together(fp, words, SETTINGS);
  if (words[0] != RESTART_FORMAT || words[1] != ROW_WORDS ||
      !(words[7] >= 0.0 && words[7] <= LONGEST_ID))
    stop_at_damage("settings");
  const auto length = (size_t) words[7];
  read_together(fp, words, words_of_text(length) + 1);
  if (!is_sealed(words.data(), words.size())) stop_at_damage("settings");
  pair_data.set_rules({(Contact) (int) words[2],
                       words[3],
                       words[4] != 0.0,
                       words[5],
                       {words[6], words[8] != 0.0, words[10], words[11]},
                       (int) words[9]});
  pair_data.source.recorder.assign((const char *) &words[SETTINGS], length);
  offer_pair_values();
}

void *PairEVPLJ::extract(const char *name, int &dim)
{
  dim = 2;
  return strcmp(name, "alpha") == 0 ? nullptr : coefficients.table(name);    // cutoffs stay
}
