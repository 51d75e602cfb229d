// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/energy/energy_balance.h"
#include "lammps/base/per_atom.h"
#include "lammps/base/scene.h"
#include "lammps/pairs/effect.h"
#include "lammps/pairs/pair_data.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

namespace EVP {

/// What acts on an atom at an end of a step [force].
struct AtomForces {
  double working[3];    ///< on a prescribed atom the forces of pairs; else all forces but those
  double damping[3];    ///< explicit one, which is in neither
};

/// Forces on local atoms: all; those of the pairs, explicit damping included; that damping, and that of fix nve/evp, nullptr
/// without. others: other forces may act beside these. An atom is integrated if forces move it, else its motion is prescribed.
struct ActingForces {
  const double (*whole)[3], (*of_pairs)[3], (*damping)[3], (*solved)[3];
  bool others;

  /// Can anything do work on the atom that is an entry of the balance?
  bool work_on(bool integrated) const { return others || !integrated; }

  EVP_INLINE void find(int i, bool integrated, AtomForces &now) const
  {
    for (int c = 0; c < 3; c++) {
      double of_ours = whole[i][c];
      if (others) of_ours = of_pairs[i][c] + (solved ? solved[i][c] : 0.0);
      if (integrated)
        now.working[c] = whole[i][c] - of_ours;
      else {
        now.damping[c] = damping ? damping[i][c] : 0.0;
        now.working[c] = of_ours - now.damping[c];
      }
    }
  }

  /// By the explicit damping of an integrated atom over the half step before or after the present positions, in the mean
  /// [energy/time]. At the beginning of a step atom->v is that of the half step by now, at its end that of the full
  /// step: of either the mean over the half step is half of its kick away.
  double dissipated(const Atom *atom, const Force *force, double dt, int i) const
  {
    if (!damping) return 0.0;
    const double quarter = 0.25 * dt * scene::inverse_mass(atom, force, i);
    const double *const v = atom->v[i], *const f = whole[i];
    double sum = 0.0;
    for (int c = 0; c < 3; c++) sum -= damping[i][c] * (v[c] - quarter * f[c]);
    return sum;
  }
};

/// Edges for which image_shift() is the number of boxes along each of them.
constexpr Edges COUNT_OF_BOXES = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};

/// How far the unwrapped position of an atom is away, in a box of these edges.
inline std::array<double, 3> unwrapping(const Edges &edges, imageint image)
{
  const int n[3] = {(int) (image & IMGMASK) - IMGMAX, (int) (image >> IMGBITS & IMGMASK) - IMGMAX,
                    (int) (image >> IMG2BITS) - IMGMAX};
  const int pbc[6] = {n[0], n[1], n[2], n[2], n[2], n[1]};
  return image_shift(edges.data(), pbc);
}

/// Of forces times counts of boxes, see PairWork::through.
inline double work_of(const Edges &through, const Edges &moved)
{
  double sum = 0.0;
  for (int c = 0; c < 6; c++) sum += through[c] * moved[c];
  return sum;
}

/// The work of a box that deforms with 'remap v', from one force evaluation to the next: on pairs across its boundary;
/// by the forces on atoms whose unwrapped positions it shifts, though the atoms do not move; and on atoms that are
/// wrapped, whose velocity changes. Energies of this MPI rank.
class BoxWork {
 public:
  explicit BoxWork(const PairWork &pairs_in) : pairs(pairs_in) {}

  bool acts = false;       ///< in this run
  Edges edges{};           ///< of the box at the present forces
  double kinetic = 0.0;    ///< before atoms are wrapped

  /// A box that deformed in the run before moves once more, at the set-up of this one.
  void begin_run(bool deforms)
  {
    acts = deforms || deformed;
    deformed = deforms;
    if (!acts) before = false;
  }

  /// At set-up, as LAMMPS moves the box after the last forces of a run: returns the work since these, 0 where they were
  /// of a run without.
  double begin(const Domain *domain)
  {
    move_to(domain);
    const double done = std::exchange(gained_by_wrapping, 0.0) + through_moved();
    set_through();
    return std::exchange(before, true) ? done + through_moved() : 0.0;
  }

  /// By damping forces across the boundary over half a step dt. They act at the rates of the box that dampers see, which
  /// in single steps are not those at which LAMMPS moves it.
  double by_damping(double dt) const { return 0.5 * dt * work_of(pairs.through.damping, rates); }

  /// Where the box is about to be that of the next forces. damping, solved: work by explicit and implicit damping in the
  /// half step before.
  void begin_step(const Domain *domain, double damping, double solved)
  {
    move_to(domain);
    done = damping + through_moved() + solved;
    prescribed = others = 0.0;
  }

  /// At the next forces: work of the step. damping: that in the half step after.
  double end_step(double damping)
  {
    set_through();
    return done + std::exchange(gained_by_wrapping, 0.0) + damping + through_moved();
  }

  /// Half of what a force would do on an atom along with its unwrapped position.
  double along(imageint image, const double *f) const
  {
    const auto shift = unwrapping(moved, image);
    return 0.5 * (f[0] * shift[0] + f[1] * shift[1] + f[2] * shift[2]);
  }

  /// What these do in the step that begins, by the forces on each atom. add() returns that of damping on prescribed ones.
  double prescribed = 0.0, others = 0.0;
  double add(imageint image, bool integrated, const AtomForces &now)
  {
    const double working = along(image, now.working);
    if (integrated) {
      others -= working;
      return 0.0;
    }
    const double damping = along(image, now.damping);
    prescribed += working + damping;
    return damping;
  }

  /// At a neighbor build: LAMMPS may have flipped the box, of which tilts alone change, and has wrapped atoms.
  void set_edges(const Domain *domain) { std::copy_n(domain->h, 6, edges.begin()); }
  void add_wrapped(double kinetic_now) { gained_by_wrapping += kinetic_now - kinetic; }

 private:
  const PairWork &pairs;
  bool deformed = false;              // in the last run?
  bool before = false;                // at the last forces?
  Edges rates{};                      // at the present forces, those of LAMMPS
  Edges moved{};                      // edges, since the forces before
  Edges through{};                    // without damping, of the last forces
  double gained_by_wrapping = 0.0;    // kinetic energy, since the last step
  double done = 0.0;                  // so far, in the step under way

  // at a set-up, or where the box is about to be that of the next forces
  void move_to(const Domain *domain)
  {
    for (int c = 0; c < 6; c++) moved[c] = domain->h[c] - edges[c];
    std::copy_n(domain->h_rate, 6, rates.begin());
    set_edges(domain);
  }

  double through_moved() const { return 0.5 * work_of(through, moved); }
  void set_through()
  {
    through = pairs.through.whole;
    for (int c = 0; c < 6; c++) through[c] -= pairs.through.damping[c];
  }
};

/// An atom at the beginning of a step.
struct AtomPast {
  double x[3];    ///< unwrapped
  AtomForces forces;
};

}    // namespace EVP

namespace LAMMPS_NS {

/// The energy balance: where the work that is put into a body goes, from its definition on.
///
/// Exact for the leapfrog but for the trapezoid of the pair forces. Each step is taken from its own half
/// kicks, with its own dt and the damping that was applied in it, whichever fix changed them before.
/// The force loop of the pair style sets the energies of pairs and their forces in `work`.
class FixEVPEnergy :
    public EVP::AtomRecords<EVP::WithPerAtomComm<Fix>, EVP::AtomPast>,
    public EVP::EffectOfFix {
 public:
  FixEVPEnergy(class LAMMPS *, int, char **);
  ~FixEVPEnergy() override { atom->delete_callback(id, Atom::GROW); }

  int setmask() override
  {
    using namespace FixConst;
    return POST_INTEGRATE | PRE_EXCHANGE | PRE_NEIGHBOR | END_OF_STEP;
  }
  void init() override;
  void setup(int) override;
  void post_integrate() override;
  void pre_exchange() override;
  void setup_pre_neighbor() override { set_images(); }
  void pre_neighbor() override;
  void end_of_step() override;

  double compute_scalar() override;
  double compute_vector(int n) override;
  double memory_usage() override { return AtomRecords::memory_usage() + work.memory_usage(); }
  void set_arrays(int) override;

  void write_restart(FILE *) override;
  void restart(char *) override;

  // see EVP::Effect

  bool begin_run(EVP::PairData &) override;
  bool follows_unlisted_bonds() const override { return true; }
  void unlisted_bonds_found(const std::vector<EVP::UnlistedBond> &) override;
  void before_forces(const EVP::ParticleView &) override;
  EVP::PairConsumer *reads_forces(const EVP::PairList &) override
  {
    return reads ? &work : nullptr;
  }
  void after_forces(const EVP::ParticleView &view) override
  {
    if (reads) work.finish(view);
  }
  void bond_ends(const EVP::EndingPair &pair) override
  {
    work.end(pair.stored, EVP::rank_share(pair.j, pair_data->lists().nreact));
  }
  void contact_joins(const EVP::EndingPair &pair) override { bond_ends(pair); }
  void unlisted_bonds_end(const std::vector<EVP::UnlistedBond> &) override
  {
    work.end_beyond_list();
  }
  bool takes_dissipated() const override { return true; }
  void add_dissipated(double energy) override { work.add_dissipated(energy); }
  void add_grown(double energy) override { work.add_grown(energy); }
  bool asks_for_powers() const override { return true; }

 private:
  enum Entry {
    KINETIC,
    FIRST,
    SECOND,
    LOST,
    CONTACTS,
    DISSIPATED,
    PRESCRIBED,
    OTHERS,
    PLASTIC,
    ENDED = PLASTIC + 2,    // f_ID[10] is 0, for the numbers of the others
    VOLUME,
    BOX,
    GROWN,
    NENTRIES
  };

  /// Energies of atoms and pairs at one instant.
  struct Instant {
    double kinetic, volume;
    EVP::PairWork::Sums pairs;
  };

  /// What happens in steps [energy].
  struct Works {
    double dissipated, prescribed, others, box, plastic, grown;
  };

  /// Of an MPI rank or of all: now, and since the start.
  struct Totals {
    Instant instant;
    Works works;
  };

  EVP::PairData *pair_data = nullptr;
  Fix *bonds = nullptr;                            // fix evp/bonds, if there is one
  const EVP::SolvedDamping *implicit = nullptr;    // if there is some
  int integrated_groupbits = 0;                    // groups of the fixes that move atoms by forces
  bool started = false;
  double dt_step = 0.0;       // of the step under way: at its end another fix may have changed it
  Instant start{};            // of all MPI ranks
  Totals now{};               // of this one
  bigint summed_step = -1;    // step that the entries are of
  double dissipated_at_begin = 0.0;    // of the step under way, on this MPI rank

  double entries[NENTRIES] = {};
  EVP::PairWork work;
  bool reads = false;    // the forces of the evaluation under way
  EVP::BoxWork box{work};

  bool is_integrated(int i) const { return atom->mask[i] & integrated_groupbits; }
  EVP::ActingForces acting_forces() const;
  bool is_solved() const { return implicit && pair_data->damps_implicitly(); }
  bool others_act() const;
  void reverse_comm_forces();
  Instant instant_here() const;
  double kinetic_here() const;
  double damping_of_box() const;
  void set_images();
  Totals over_all_ranks(Totals totals) const;
  Works works_of_step();
  void unwrap(int i, double *x) const;
  void sum_up();
};

}    // namespace LAMMPS_NS
