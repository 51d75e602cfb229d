/* SPDX-License-Identifier: GPL-2.0-only

   Pair style evp/lj: forces, single(), counts. Packing of the neighbor list is in
   pair_evp_lj_pack.cpp, what users type in _coeff.cpp, what a run needs in _setup.cpp, velocities of
   ghosts in _velocities.cpp, what may be asked between runs in _present.cpp, restarts in _restart.cpp. */

#include "pair_evp_lj.h"

#include "core/tallies.h"
#include "fix_evp_bonds.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "output.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using EVP::scene::rows;

namespace {

/// Hands energies and forces to LAMMPS pair by pair: for per-atom values and compute */tally.
class PairTally {
 public:
  static constexpr bool active = true;
  const bool energy;

  PairTally(PairEVPLJ *style_in, int nlocal_in, int newton_in, bool energy_in) :
      energy(energy_in), style(style_in), nlocal(nlocal_in), newton(newton_in)
  {
  }
  void operator()(const EVP::PairRange &range, const EVP::Block &block) const
  {
    const EVP::PackedPairs &pairs = style->packed_pairs().pairs;
    range.for_each_row([&](int i, int first, int last) {
      for (int k = first; k < last; k++) {
        const int b = k - range.first;
        style->ev_tally(i, pairs.j()[k], nlocal, newton, energy ? block.energy[b] : 0.0, 0.0,
                        block.force[b], block.xy[2 * b], block.xy[2 * b + 1], block.z[b]);
      }
    });
  }

 private:
  PairEVPLJ *style;
  int nlocal, newton;
};

}    // namespace

/* ---------------------------------------------------------------------- */

PairEVPLJ *PairEVPLJ::find(Force *force)
{
  return dynamic_cast<PairEVPLJ *>(force->pair_match("evp/lj", 1));
}

/* ---------------------------------------------------------------------- */

void PairEVPLJ::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);

  const bool together = neighbor->ago == 0 || repack;
  if (together || (radii_vary && radii_changed())) pack(together);

  const bool damps = damping_acts() && explicit_damping;
  if (damps) send_velocities();
  velocities_sent = damps;
  if (damps)
    compute_forces<true>();
  else
    compute_forces<false>();

  const bool summed = vflag_fdotr;    // the sum clears its flag
  if (summed) virial_fdotr_compute();

  // a sum that LAMMPS asked for anyway shows whether any force is not a number
  if ((eflag_either && !std::isfinite(eng_vdwl)) || (summed && !std::isfinite(virial[0])))
    stop_at_blow_up();
}

/* ----------------------------------------------------------------------
   the run is lost: say where it began, and what there is to go back to
------------------------------------------------------------------------- */

void PairEVPLJ::stop_at_blow_up() const
{
  // where an atom is lost all its pairs are: name that atom first
  std::string culprit;
  for (int i = 0; i < atom->nlocal && culprit.empty(); i++) {
    const double *x = atom->x[i], *v = atom->v[i];
    if (!std::isfinite(x[0] + x[1] + x[2] + v[0] + v[1] + v[2]))
      culprit = fmt::format("first atom {}, whose place or velocity is none", atom->tag[i]);
  }
  for (const auto &row : packed.rows)
    for (int k = row.first; k < row.last && culprit.empty(); k++) {
      const EVP::PackedPair &pair = packed.pairs[k];
      const EVP::PairGeometry g(rows(atom->x), row.i, pair.j);
      const double *f = atom->f[row.i];
      if (std::isfinite(g.dsq + f[0] + f[1] + f[2])) continue;
      const double d = std::sqrt(g.dsq), deq = 1.0 / pair.inv_deq;
      culprit = fmt::format("first atoms {} and {} at d = {:.6g}, deq = {:.6g}, {} regime",
                            atom->tag[row.i], atom->tag[pair.j], d, deq,
                            law_of(pair).regime(d, deq) == 1 ? "first" : "second");
    }
  if (culprit.empty()) culprit = "no pair of this process";
  const bigint saved = output ? output->last_restart : -1;
  error->one(
      FLERR,
      "Pair evp/lj: forces are not numbers any more at step {} with timestep {:.6g}; {}: the "
      "step is above the limit (see compute evp/dt) or the motion too fast for it (see fix "
      "dt/evp); last restart file: {}",
      update->ntimestep, update->dt, culprit, saved >= 0 ? fmt::format("step {}", saved) : "none");
}

/* ---------------------------------------------------------------------- */

template <bool Damping> void PairEVPLJ::compute_forces()
{
  if (packed.rows.empty()) return;

  const int newton = force->newton_pair;
  const EVP::ParticleView view = {rows(atom->x), rows(atom->v),
                                  reinterpret_cast<double(*)[3]>(atom->f[0]),
                                  newton ? packed.nall : packed.nlocal};
  const bool energy = eflag_either != 0;
  if (!evflag)
    EVP::accumulate_forces<Damping>(packed, coefficients.block_law(), view, EVP::NoTally());
  else if (eflag_atom || vflag_atom || cvflag_atom || num_tally_compute > 0)
    EVP::accumulate_forces<Damping>(packed, coefficients.block_law(), view,
                                    PairTally(this, packed.nlocal, newton, energy));
  else {
    EVP::SumTally sums(packed, view.nreact, energy, vflag_global != 0);
    EVP::accumulate_forces<Damping>(packed, coefficients.block_law(), view, sums);
    eng_vdwl += sums.total_energy();
    for (int k = 0; k < 6; k++) virial[k] += sums.total_virial(k);
  }
}

/* ---------------------------------------------------------------------- */

bool PairEVPLJ::is_implicit(int i, int j) const
{
  return (atom->mask[i] | atom->mask[j]) & implicit_groupbit;
}

/* ---------------------------------------------------------------------- */

double PairEVPLJ::implicit_gamma(const EVP::PackedPair &pair) const
{
  return coefficients.gamma_elsewhere(pair.law);
}

/* ---------------------------------------------------------------------- */

const EVP::PairList &PairEVPLJ::packed_pairs() const
{
  if (!is_packed())
    error->one(FLERR,
               "Pair evp/lj has not seen the present neighbor list yet: use its fixes and computes "
               "in a run, after the forces of the step");
  return packed;
}

/* ---------------------------------------------------------------------- */

double PairEVPLJ::single(int i, int j, int itype, int jtype, double rsq, double /*factor_coul*/,
                         double factor_lj, double &fforce)
{
  // pair_write asks for two particles that need not exist, of pairs that have no deq of their own
  fforce = 0.0;
  if (std::max(i, j) >= atom->nlocal + atom->nghost) return 0.0;

  double deq = 0.0;
  if (bonds) deq = i < atom->nlocal ? bonds->find_deq(i, atom->tag[j]) : 0.0;
  if (bonds && deq == 0.0 && j < atom->nlocal) deq = bonds->find_deq(j, atom->tag[i]);
  const bool is_bond = deq > 0.0;

  const EVP::Law &law = coefficients.law(coefficients.index(itype, jtype));
  const double sum_radii = atom->radius[i] + atom->radius[j];
  if (!is_bond) deq = sum_radii;
  const bool repels_only = !is_bond && settings_now.contact == Contact::REPULSIVE;
  const double cut = repels_only ? sum_radii : law.parameters().alpha * sum_radii;

  const double d = std::sqrt(rsq);
  const bool acts =
      rsq <= EVP::reach_squared(cut, is_bond ? EVP::BOND_MARGIN : new_pair_margin()) &&
      factor_lj != 0.0 && (is_bond || settings_now.contact != Contact::NONE);
  svector[0] = deq;
  svector[1] = (d - deq) / deq;
  svector[2] = acts ? law.regime(d, deq) : 0.0;

  if (!acts) return 0.0;
  fforce = law.force(d, deq) / d;
  if (damping_acts() && (comm->ghost_velocity || velocities_sent) && !is_implicit(i, j)) {
    const EVP::PairGeometry g(rows(atom->x), i, j);
    fforce += EVP::damping_over_distance(law.parameters().gamma, g, atom->v[i], atom->v[j]);
  }
  return law.energy(d, deq, cut);
}

/* ---------------------------------------------------------------------- */

PairEVPLJ::Counts PairEVPLJ::count_pairs() const
{
  double sums[3] = {0.0, 0.0, 0.0}, lowest = HUGE_VAL;
  const double(*x)[3] = rows(atom->x);
  for (const auto &row : packed.rows)
    for (int k = row.first; k < row.last; k++) {
      const EVP::PackedPair &pair = packed.pairs[k];
      const EVP::PairGeometry g(x, row.i, pair.j);
      const double d = std::sqrt(g.dsq);
      lowest = std::min(lowest, d / (atom->radius[row.i] + atom->radius[pair.j]));
      if (g.dsq > pair.cutsq) continue;

      // without newton both owners of a pair across processes hold it
      const double weight = (!force->newton_pair && pair.j >= packed.nlocal) ? 0.5 : 1.0;
      if (!pair.is_bond)
        sums[2] += weight;
      else {
        sums[0] += weight;
        if (law_of(pair).regime(d, 1.0 / pair.inv_deq) == 2) sums[1] += weight;
      }
    }

  double all[3], lowest_all;
  MPI_Allreduce(sums, all, 3, MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(&lowest, &lowest_all, 1, MPI_DOUBLE, MPI_MIN, world);
  return {all[0], all[1], all[2], lowest_all < HUGE_VAL ? lowest_all : 0.0};
}

/* ---------------------------------------------------------------------- */

double PairEVPLJ::memory_usage()
{
  double bytes = Pair::memory_usage();
  bytes += packed.memory_usage();
  bytes += coefficients.memory_usage();
  return bytes;
}
