// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_store.h"
#include "core/heat/heat.h"
#include "core/heat/heat_record.h"
#include "lammps/base/per_atom.h"
#include "lammps/base/scene.h"
#include "lammps/heat/conduction.h"
#include "lammps/heat/granular_friction.h"
#include "lammps/pairs/effect.h"
#include "lammps/pairs/pair_data.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Heat of deformation: what pairs dissipate warms their atoms, flows along the bonds and softens them. Temperatures and the
/// heat flow of others are LAMMPS' own, of fix property/atom.
class FixEVPHeat : public EVP::WithPerAtomComm<Fix>, public EVP::EffectOfFix {
 public:
  FixEVPHeat(class LAMMPS *, int, char **);
  ~FixEVPHeat() override;

  int setmask() override
  {
    using namespace FixConst;
    return INITIAL_INTEGRATE | PRE_FORCE | POST_FORCE | END_OF_STEP;
  }
  void init() override;
  void setup_pre_force(int) override { send_temperatures(); }
  void setup(int) override;
  void initial_integrate(int) override;
  void pre_force(int) override;
  void post_force(int) override { friction.find_forces(); }
  void end_of_step() override;

  // f_ID: imbalance of the account. f_ID[1..7], heat since the start: of work, of others' heatflow, out at atoms that hold
  // their temperature, waiting, in the atoms; highest temperature, largest stable thermal step. Per atom: out at it
  double compute_scalar() override;
  double compute_vector(int) override;

  void keep_values(EVP::BondStore &) override;

  void grow_arrays(int nmax) override
  {
    through.resize(nmax);
    vector_atom = through.data();
  }
  void copy_arrays(int i, int j, int /*delflag*/) override { through[j] = through[i]; }
  void set_arrays(int i) override
  {
    through[i] = 0.0;
    // what a deleted atom or a ghost had is there
    if (atom->temperature && !reads_temperatures()) atom->temperature[i] = 0.0;
  }
  int pack_exchange(int i, double *buf) override
  {
    *buf = through[i];
    return 1;
  }
  int unpack_exchange(int i, double *buf) override
  {
    through[i] = *buf;
    return 1;
  }
  double memory_usage() override;

  void write_restart(FILE *) override;
  void restart(char *) override;

  // see EVP::Effect

  bool uses(double EVP::Row::*member) const override
  {
    return std::find(std::begin(OF_HEAT), std::end(OF_HEAT), member) != std::end(OF_HEAT);
  }
  void atoms_recorded(const std::vector<char> &are_new) override { came = are_new; }
  void pairs_packed(const class NeighList *) override;
  bool is_due() const override { return update->ntimestep % every == 0; }
  bool was_changed() const override;
  void begin_update() override;
  void update_effect() override;
  void strains_updated(const EVP::BondStore &, bool have_flowed) override;
  void multiply_limits(std::vector<double> &) const override;
  int shared_width(EVP::Sharing) const override { return expands; }
  void put_shared(EVP::Sharing, const EVP::ValuesOfAtoms &) const override;
  void set_shared(EVP::Sharing, const EVP::ValuesOfAtoms &) override;
  void before_forces(const EVP::ParticleView &) override;
  EVP::PairConsumer *reads_forces(const EVP::PairList &) override;
  void bond_ends(const EVP::EndingPair &pair) override
  {
    add_heat(pair.i, pair.j, pair.j < pair_data->lists().nreact, pair.stored.total());
  }
  void contact_joins(const EVP::EndingPair &pair) override { bond_ends(pair); }
  void unlisted_bonds_end(const std::vector<EVP::UnlistedBond> &) override;
  void return_to_records(bool) override { collect_heat(); }
  bool takes_heat() const override { return true; }
  void add_plastic_work(const std::vector<double> &) override;
  void add_heat(int i, int j, bool j_takes, double energy) override
  {
    generated[i][0] += 0.5 * energy;
    if (j_takes) generated[j][0] += 0.5 * energy;
  }
  bool asks_for_powers() const override { return true; }

 private:
  static constexpr double EVP::Row::*OF_HEAT[] = {
      &EVP::Row::conductivity, &EVP::Row::capacity,      &EVP::Row::soften_tref,
      &EVP::Row::soften_tmelt, &EVP::Row::soften_m,      &EVP::Row::soften_floor,
      &EVP::Row::melt,         &EVP::Row::rate,          &EVP::Row::rate_rate0,
      &EVP::Row::expansion,    &EVP::Row::expansion_tref};
  enum Account { OF_WORK, OF_OTHERS, OUT, WAITING, STORED, NACCOUNTS };

  int every = 100;
  double of_plastic = 0.9;    // share of plastic work that is heat (Taylor and Quinney)
  EVP::PairData *pair_data = nullptr;
  std::vector<EVP::Row> rows;    // by type
  EVP::SphereRecords<EVP::HeatRecord> records;
  bool has_records = false;    // kept in a run before, or in the restart file
  bool begun = false;          // softening follows temperatures
  bool expands = false;        // the row of any type has an expansion
  EVP::GranularFriction friction;
  EVP::Conduction conduction;
  bool others_pairs = false;    // may a pair style add to heatflow, of ghosts too?
  int others_groupbits = 0;     // of fixes heat/flow

  double since_limits = 0.0;    // since limits moved on last [time]
  double elapsed = 0.0;         // since heat was handed out last [time]
  double damping_time =
      0.0;    // of a step, that the explicit damping of its first forces stands for
  EVP::DampingHeat damping_heat;
  // heat of pairs since it was collected, with ghosts [energy]
  EVP::AtomValues generated{1};
  double step_time = 0.0;    // that of the step, which other fixes may change at its end
  bool stepping = false;     // not in rerun, which has no time
  std::array<double, NACCOUNTS> account{};    // of this MPI rank, but WAITING [energy]
  bool is_packed = false;                     // generated is there

  std::vector<double> through;    // of the records, what went out at each atom: for f_ID
  std::vector<char> came;         // own atoms that have just been recorded; empty without
  bool limit_told = false;
  std::string last_unlike;

  double factor_now(int i) const
  {
    const EVP::Row &row = rows[atom->type[i]];
    return EVP::softening(row, atom->temperature[i]) * EVP::hardening_by_rate(row, records[i].rate);
  }
  double growth_now(int i) const
  {
    return EVP::thermal_growth(rows[atom->type[i]], atom->temperature[i]);
  }
  void stop_at_growth() const;
  void grow_new_atoms(std::vector<double> &growth);
  bool is_free(int i) const { return atom->mask[i] & groupbit; }
  void check_atoms(const EVP::BondStore &) const;
  bool reads_temperatures() const;
  void send_temperatures();
  void collect_heat();
  void conduct();
  void warm_new_atoms(const EVP::PairLists &);
  void add_friction();
  void report_unlike_types();
  void check_step(double step);
  std::array<double, NACCOUNTS> all_accounts();
};

}    // namespace LAMMPS_NS
