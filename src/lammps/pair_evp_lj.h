/* SPDX-License-Identifier: GPL-2.0-only */

#ifdef PAIR_CLASS
// clang-format off
PairStyle(evp/lj,PairEVPLJ);
// clang-format on
#else

#ifndef LMP_PAIR_EVP_LJ_H
#define LMP_PAIR_EVP_LJ_H

#include "core/coefficients.h"
#include "core/force_loop.h"
#include "pair.h"

#include <cstdint>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Two-regime Lennard-Jones forces with an equilibrium distance per recorded pair (paper eqs. 1-8).
class PairEVPLJ : public Pair {
 public:
  /// What acts between two particles that were not recorded as a pair.
  enum class Contact : int { LITERAL, REPULSIVE, NONE };

  /// Pairs of the current neighbor list at the current positions, over all processes.
  struct Counts {
    double bonds_within;    ///< recorded pairs with d <= dlim
    double bonds_second;    ///< of these in the second regime
    double new_pairs;       ///< pairs not recorded that interact
    double lowest_ratio;    ///< smallest d/(R_i + R_j) of the packed pairs; 0 if there are none
  };

  PairEVPLJ(class LAMMPS *);
  ~PairEVPLJ() override;

  /// The pair style in force, alone or in pair_style hybrid; nullptr if it is another. A pair_style
  /// command deletes it, so what may be asked between runs must look again.
  static PairEVPLJ *find(class Force *);

  void compute(int, int) override;
  double single(int, int, int, int, double, double, double, double &) override;
  void settings(int, char **) override;
  void coeff(int, char **) override;
  void init_style() override;
  double init_one(int, int) override;

  void write_restart(FILE *) override;
  void read_restart(FILE *) override;
  void write_restart_settings(FILE *) override;
  void read_restart_settings(FILE *) override;
  void write_data(FILE *) override;
  void write_data_all(FILE *) override;

  void *extract(const char *, int &) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  double memory_usage() override;

  /// dlim/(R_i + R_j) of a pair of atom types, 0 where this style does not act. Known after init().
  double alpha_of(int itype, int jtype) const;

  /// The same as the coefficients have it, before init() too.
  double alpha_given(int itype, int jtype) const;

  /// Called by fix evp/bonds: ID is the fix that holds the records, empty when it goes.
  void bonds_recorded_by(const std::string &id);

  /// The last fix whose records of this body are gone, empty if there was none.
  const std::string &bonds_dropped_by() const { return dropped_bonds_id; }

  /// The packed pairs and their laws. Stops unless is_packed(), so take it out of loops.
  const EVP::PairList &packed_pairs() const;

  /// deq of each packed pair as it was recorded [length]: 1/deq of the list has lost its last bit.
  std::vector<double> rest_distances() const;
  const EVP::Law &law_of(const EVP::PackedPair &pair) const { return coefficients.law(pair.law); }

  /// Were the pairs packed from the neighbor list as it is now, and from the atoms here?
  bool is_packed() const;

  /// Collective. Are the packed pairs all pairs of the present positions? Between runs ghosts are
  /// brought to these, and atoms must not have moved further than the neighbor list allows.
  bool is_present();

  /// True where fix nve/evp takes over the damping of some pairs, those with an atom of its group.
  bool damps_implicitly() const { return any_gamma && implicit_groupbit; }

  /// False where no pair at all has damping of this style's own. The same on all processes.
  bool damps_explicitly() const { return explicit_damping; }

  /// gamma of a pair that fix nve/evp damps [force/velocity], 0 for the others. Its law has none.
  double implicit_gamma(const EVP::PackedPair &pair) const;

  /// The fix that holds the records, nullptr without.
  const class FixEVPBonds *bonds_fix() const { return bonds; }

  /// Collective. Requires is_present().
  Counts count_pairs() const;

 private:
  struct Settings {
    Contact contact;
    double overlap;    // warn below d = (1 - overlap) (R_i + R_j)
  } settings_now;

  static constexpr int NVALUES = 3;              // p1 p2 p3 of compute pair/local
  EVP::Coefficients coefficients;                // and the laws made of them
  std::vector<double> max_radius, min_radius;    // per type, when the cut-offs were set
  std::vector<double> reach;    // cut-offs that the neighbor list has, below 0 where not served
  bool any_gamma;
  bool scene_checked;       // in this run, see check_scene()
  int implicit_groupbit;    // of fix nve/evp, 0 without

  std::string bonds_id;            // fix that recorded the bonds; empty: none did
  std::string dropped_bonds_id;    // fix that had recorded and was unfixed
  class FixEVPBonds *bonds;        // the fix of bonds_id, nullptr without
  std::string last_report;

  // pairs that overlap beyond the limit, found while packing
  struct Overlaps {
    bigint count = 0;
    tagint tag_i = 0, tag_j = 0;
    double d = 0.0, deq = 0.0;
    int regime = 0;
  };
  bool overlap_warned;

  EVP::PairList packed;
  bool velocities_sent;                 // to ghosts, for the last forces
  bool explicit_damping;                // a packed pair of any process is damped by this style
  bigint packed_call, packed_step;      // of the neighbor list that was packed
  uint64_t packed_atoms;                // which atoms it was, see fingerprint_of_atoms()
  const class Comm *built_comm;         // which had made the ghosts,
  double built_skin;                    // and the skin,
  bool lammps_notes;                    // and where the atoms were: LAMMPS knows,
  std::vector<double> built_x;          // or this style, with ghosts
  bool sends_positions;                 // not velocities, in pack_forward_comm()
  int updated_ghosts;                   // by the last exchange of positions
  bool repack;                          // coefficients changed since then
  bool radii_vary;                      // and radii may at every step ('atom_style sphere 1')
  std::vector<double> packed_radius;    // where they may: those of the packing, with ghosts

  void allocate();
  void offer_pair_values();
  bool is_implicit(int i, int j) const;
  EVP::Row row_from_file(const char *file, const char *name) const;
  bool damping_acts() const;
  void check_host_settings() const;
  void find_bonds();
  void find_implicit_group();
  void find_max_radii();
  bool serves(int itype, int jtype) const;
  void check_scene();
  void send_velocities();
  void report_settings();

  // one that only repels has no force at its cut but that of damping: spheres that touch do not interact
  double new_pair_margin() const
  {
    if (settings_now.contact != Contact::REPULSIVE) return EVP::NEW_PAIR_MARGIN;
    return any_gamma ? -EVP::NEW_PAIR_MARGIN : 0.0;
  }
  void pack(bool together);
  void agree_on_pairs(bool damped, Overlaps);
  bool radii_changed() const;
  uint64_t fingerprint_of_atoms() const;
  void note_positions();
  bool moved_too_far();
  bool update_ghosts();
  int pack_positions(int, const int *, double *, int, const int *) const;
  int pack_velocities(int, const int *, double *, int, const int *) const;
  void check_weights() const;
  bool pack_row(int i, Overlaps &overlaps);
  void count_overlap(int i, int j, double deq, int law, Overlaps &overlaps) const;
  void stop_where_centres_coincide(int i, int j) const;
  void check_radii() const;
  void check_bonds() const;
  template <bool Damping> void compute_forces();
  void stop_at_blow_up() const;
};

}    // namespace LAMMPS_NS

#endif
#endif
