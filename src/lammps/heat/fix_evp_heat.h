// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bonds/bond_store.h"
#include "core/heat/heat.h"
#include "core/heat/heat_record.h"
#include "lammps/base/keeps_values.h"
#include "lammps/base/per_atom.h"
#include "lammps/base/scene.h"
#include "lammps/pairs/pair_data.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Heat of deformation: what pairs dissipate warms their atoms, flows along the bonds and softens them. Temperatures and the
/// heat flow of others are LAMMPS' own, of fix property/atom.
class FixEVPHeat :
    public EVP::WithPerAtomComm<Fix>,
    public EVP::KeepsValues,
    public EVP::Heat,
    public EVP::Shares<EVP::Heat> {
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
  void post_force(int) override { find_friction(); }
  void end_of_step() override;

  // f_ID: imbalance of the account. f_ID[1..7], heat since the start: of work, of others' heatflow, out at atoms that hold
  // their temperature, waiting, in the atoms; highest temperature, largest stable thermal step. Per atom: out at it
  double compute_scalar() override;
  double compute_vector(int) override;

  std::shared_ptr<EVP::Heat> share() const override { return shown; }
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

  // what the pairs call, see EVP::Heat
  void add_plastic(int i, double energy) override;
  void note_packing(const EVP::PairLists &) override;
  void bring_home() override;
  bool is_due() const override { return update->ntimestep % every == 0; }
  void hand_out(const EVP::PairLists &) override;
  void take_strain(int i, double p) override;
  void take_factors() override;
  bool factors_are_old() const override;
  double factor(int i) const override { return records[i].factor; }
  double take_damping_time() override { return std::exchange(damping_time, 0.0); }

 private:
  enum Account { OF_WORK, OF_OTHERS, OUT, WAITING, STORED, NACCOUNTS };

  /// A pair style that tells of its friction, and where it keeps what its pairs remember: nullptr where they do not.
  struct Granular {
    class Pair *pair;
    class FixNeighHistory *memory;
    bool shortens_arms;    // is the point of contact within the overlap?
  };

  /// Two spheres that rub: the tangential force on i, where it acts, what it takes.
  struct FrictionPair {
    int i, j;
    EVP::Vector force, along;
    double arm_i, arm_j;
    double power;    // at the velocities at the end of the step [energy/time]
  };

  /// A bond that conducts.
  struct Link {
    int i, j;
    double conductance;
  };

  int every = 100;
  double of_plastic = 0.9;    // share of plastic work that is heat (Taylor and Quinney)
  std::shared_ptr<EVP::Heat> shown{this, [](auto *) {
                                   }};    // for the pairs, gone with the fix
  EVP::PairData *pair_data = nullptr;
  std::vector<EVP::Row> rows;    // by type
  EVP::SphereRecords<EVP::HeatRecord> records;
  bool has_records = false;    // kept in a run before, or in the restart file
  bool begun = false;          // softening follows temperatures
  std::vector<Granular> granular;
  std::vector<FrictionPair> friction_pairs;    // by the forces of now
  Values moving, remembered;    // velocities and rates of rotation of atoms and ghosts; of a pair
  bool others_pairs = false;    // may a pair style add to heatflow, of ghosts too?
  int others_groupbits = 0;     // of fixes heat/flow

  double since_limits = 0.0;    // since limits moved on last [time]
  double elapsed = 0.0;         // since heat was handed out last [time]
  double damping_time = 0.0;    // see take_damping_time()
  double step_time = 0.0;       // that of the step, which other fixes may change at its end
  bool stepping = false;        // not in rerun, which has no time
  std::array<double, NACCOUNTS> account{};    // of this MPI rank, but WAITING [energy]
  bool is_packed = false;                     // generated is there

  std::vector<Link> links;
  Values shared, flow;        // conducting share and temperature; what flows to each [energy/time]
  Values inverse_capacity;    // of atoms and ghosts, 0 where the temperature is held
  double limit = 0.0;         // largest stable thermal step [time]
  double bound_seen = 0.0;    // bound of the eigenvalue that it was found at, in this run
  int unseen = 0;             // times that heat was handed out near the limit since
  bigint limit_step = -1;     // step that it was found at
  std::vector<double> through;    // of the records, what went out at each atom: for f_ID
  bool limit_told = false;
  std::string last_unlike;

  double factor_now(int i) const
  {
    const EVP::Row &row = rows[atom->type[i]];
    return EVP::softening(row, atom->temperature[i]) * EVP::hardening_by_rate(row, records[i].rate);
  }
  bool is_free(int i) const { return atom->mask[i] & groupbit; }
  void check_atoms(const EVP::BondStore &) const;
  bool reads_temperatures() const;
  void send_temperatures();
  void warm_new_atoms(const EVP::PairLists &);
  void find_granular_styles();
  void find_friction();
  void find_powers();
  void add_friction();
  void report_unlike_types();
  void find_links(const EVP::PairLists &);
  template <class F> void sum_flows(F &&difference);
  double eigenvalue_bound();
  void find_limit();
  void check_step(double step);
  std::array<double, NACCOUNTS> all_accounts();
};

}    // namespace LAMMPS_NS
