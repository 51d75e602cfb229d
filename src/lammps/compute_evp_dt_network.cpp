/* SPDX-License-Identifier: GPL-2.0-only

   Compute evp/dt: the network of interacting pairs, its matrices and their bounds.
   The steps that follow from them are in compute_evp_dt.cpp. */

#include "compute_evp_dt.h"

#include "core/lanczos.h"
#include "pair_network.h"
#include "scene.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

using namespace LAMMPS_NS;

static constexpr int MAX_ITERATIONS = 500;

/* ----------------------------------------------------------------------
   stiffness from the law, never below that where either regime begins: a pair may
   be back in the first regime, or in a stiffer second one, within a step
------------------------------------------------------------------------- */

void ComputeEVPDt::collect_links()
{
  pair = PairNetwork::find_present(force);
  if (!pair)
    error->all(FLERR,
               "Compute {} evp/dt needs the pairs of the present positions: print c_{} with "
               "thermo_style in a 'run 0' first",
               id, id);

  links.clear();
  const auto x = EVP::scene::rows(atom->x);
  const EVP::PairList &list = pair->packed_pairs();
  for (const auto &row : list.rows)
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &packed_pair = list.pairs[n];
      const int i = row.i, j = packed_pair.j;
      if (!is_free(i) && !is_free(j)) continue;
      const EVP::PairGeometry g(x, i, j);
      if (g.dsq > packed_pair.cutsq) continue;

      const EVP::Law &law = pair->law_of(packed_pair);
      const double d = std::sqrt(g.dsq), deq = 1.0 / packed_pair.inv_deq;
      links.push_back({i,
                       j,
                       {g.dx / d, g.dy / d, g.dz / d},
                       law.stiffness_ahead(d, deq),
                       std::max(0.0, -law.force(d, deq) / d),
                       law.parameters().gamma + pair->implicit_gamma(packed_pair)});
    }
}

/* ----------------------------------------------------------------------
   of M^-1/2 (mix of the stiffness and damping matrices) M^-1/2 over the free atoms
------------------------------------------------------------------------- */

double ComputeEVPDt::largest_eigenvalue(const Mix &mix)
{
  double here = 0.0, total;
  for (const Link &link : links)
    here += mix.axial * link.axial + mix.across * link.across + mix.damping * link.damping;
  MPI_Allreduce(&here, &total, 1, MPI_DOUBLE, MPI_SUM, world);
  if (total == 0.0) return 0.0;

  // any start will do; this one is the same on every number of processes
  std::vector<double> start((size_t) 3 * atom->nlocal, 0.0);
  for (int i = 0; i < atom->nlocal; i++)
    for (int c = 0; c < 3 && is_free(i); c++) {
      uint64_t z = 0x9e3779b97f4a7c15ULL * (3 * (uint64_t) atom->tag[i] + c + 1);
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
      start[(size_t) 3 * i + c] = (double) ((z ^ (z >> 27)) >> 11) * 0x1.0p-53 - 0.5;
    }

  const EVP::LanczosResult found = EVP::largest_eigenvalue(
      start,
      [&](const auto &in, auto &out) {
        apply(mix, in, out);
      },
      [&](const auto &a, const auto &b) {
        double sum = 0.0, all;
        for (size_t k = 0; k < a.size(); k++) sum += a[k] * b[k];
        MPI_Allreduce(&sum, &all, 1, MPI_DOUBLE, MPI_SUM, world);
        return all;
      },
      TOLERANCE, MAX_ITERATIONS);
  if (!found.converged && !unsettled_warned) {
    unsettled_warned = true;
    if (comm->me == 0)
      error->warning(FLERR,
                     "Compute {} evp/dt: an eigenvalue did not settle in {} iterations, the steps "
                     "may be too large: keep to c_{}[5], which is safe",
                     id, found.iterations, id);
  }
  return found.eigenvalue;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::apply(const Mix &mix, const std::vector<double> &in, std::vector<double> &out)
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  motion.assign((size_t) 3 * nall, 0.0);
  for (int i = 0; i < nlocal; i++) {
    const double scale = is_free(i) ? std::sqrt(EVP::scene::inverse_mass(atom, force, i)) : 0.0;
    for (int c = 0; c < 3; c++) motion[(size_t) 3 * i + c] = scale * in[(size_t) 3 * i + c];
  }
  to_ghosts(motion);

  const int nreact = force->newton_pair ? nall : nlocal;
  reaction.assign((size_t) 3 * nall, 0.0);
  for (const Link &link : links) {
    const double *vi = &motion[(size_t) 3 * link.i], *vj = &motion[(size_t) 3 * link.j];
    const double dv[3] = {vi[0] - vj[0], vi[1] - vj[1], vi[2] - vj[2]};
    const double along = link.u[0] * dv[0] + link.u[1] * dv[1] + link.u[2] * dv[2];
    const double across = mix.across * link.across;
    const double axial = mix.axial * link.axial + mix.damping * link.damping - across;
    for (int c = 0; c < 3; c++) {
      const double y = axial * along * link.u[c] + across * dv[c];
      reaction[(size_t) 3 * link.i + c] += y;
      if (link.j < nreact) reaction[(size_t) 3 * link.j + c] -= y;
    }
  }
  to_owners(reaction);

  for (int i = 0; i < nlocal; i++) {
    const double scale = is_free(i) ? std::sqrt(EVP::scene::inverse_mass(atom, force, i)) : 0.0;
    for (int c = 0; c < 3; c++) out[(size_t) 3 * i + c] = scale * reaction[(size_t) 3 * i + c];
  }
}

/* ----------------------------------------------------------------------
   Gershgorin rows of the assembled matrices of the free atoms: every eigenvalue
   of M^-1 (dt^2 K + 2 dt C) is below its largest row sum
------------------------------------------------------------------------- */

double ComputeEVPDt::row_sum_step()
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  const int nreact = force->newton_pair ? nall : nlocal;
  static constexpr int FIRST[6] = {0, 1, 2, 0, 0, 1}, SECOND[6] = {0, 1, 2, 1, 2, 2};

  // per matrix: own block (xx yy zz) (xy xz yz), and absolute sums towards free partners
  std::vector<double> part[2][3];
  for (int matrix = 0; matrix < 2; matrix++) {
    for (auto &values : part[matrix]) values.assign((size_t) 3 * nall, 0.0);
    for (const Link &link : links) {
      const double across = matrix == 0 ? link.across : 0.0;
      const double axial = (matrix == 0 ? link.axial : link.damping) - across;
      double block[6];
      for (int b = 0; b < 6; b++)
        block[b] = axial * link.u[FIRST[b]] * link.u[SECOND[b]] + (b < 3 ? across : 0.0);
      const double rows[3] = {std::fabs(block[0]) + std::fabs(block[3]) + std::fabs(block[4]),
                              std::fabs(block[1]) + std::fabs(block[3]) + std::fabs(block[5]),
                              std::fabs(block[2]) + std::fabs(block[4]) + std::fabs(block[5])};
      const auto add = [&](int own, int other) {
        for (int c = 0; c < 3; c++) {
          part[matrix][0][(size_t) 3 * own + c] += block[c];
          part[matrix][1][(size_t) 3 * own + c] += block[3 + c];
          if (is_free(other)) part[matrix][2][(size_t) 3 * own + c] += rows[c];
        }
      };
      add(link.i, link.j);
      if (link.j < nreact) add(link.j, link.i);
    }
    for (auto &values : part[matrix]) to_owners(values);
  }

  double here = NO_LIMIT, dt;
  for (int i = 0; i < nlocal; i++) {
    if (!is_free(i)) continue;
    for (int c = 0; c < 3; c++) {
      double sum[2];
      for (int matrix = 0; matrix < 2; matrix++) {
        const double *off = &part[matrix][1][(size_t) 3 * i];
        const double beside[3] = {std::fabs(off[0]) + std::fabs(off[1]),
                                  std::fabs(off[0]) + std::fabs(off[2]),
                                  std::fabs(off[1]) + std::fabs(off[2])};
        sum[matrix] = std::fabs(part[matrix][0][(size_t) 3 * i + c]) + beside[c] +
            part[matrix][2][(size_t) 3 * i + c];
      }
      here = std::min(here,
                      root_of(sum[0] * EVP::scene::inverse_mass(atom, force, i),
                              sum[1] * EVP::scene::inverse_mass(atom, force, i)));
    }
  }
  MPI_Allreduce(&here, &dt, 1, MPI_DOUBLE, MPI_MIN, world);
  return dt;
}
