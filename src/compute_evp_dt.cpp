/* SPDX-License-Identifier: GPL-2.0-only */

#include "compute_evp_dt.h"

#include "evp_lanczos.h"
#include "lammps_compat.h"
#include "pair_evp_lj.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

using namespace LAMMPS_NS;

static constexpr double NO_LIMIT = 1.0e20;     // nothing interacts: any step is stable
static constexpr double TOLERANCE = 1.0e-4;    // of an eigenvalue; half of it in the step
static constexpr int MAX_ITERATIONS = 500;

/// Positive root of dt^2 a + 2 dt b = 4 (velocity Verlet with damping at half-step velocities).
static double root_of(double a, double b)
{
  const double sum = b + std::sqrt(b * b + 4.0 * a);
  return sum > 0.0 ? 4.0 / sum : NO_LIMIT;
}

/* ---------------------------------------------------------------------- */

ComputeEVPDt::ComputeEVPDt(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), pair(nullptr), computed_step(-1), warned(false),
    unsettled_warned(false)
{
  if (narg != 3)
    error->all(FLERR, "Compute {} evp/dt takes no further words, got '{}'", id, arg[3]);
  scalar_flag = vector_flag = 1;
  extscalar = extvector = 0;
  size_vector = 5;
  comm_forward = comm_reverse = 3;
  dynamic_group_allow = 0;
  vector = new double[size_vector];
  for (int k = 0; k < size_vector; k++) vector[k] = 0.0;
}

/* ---------------------------------------------------------------------- */

ComputeEVPDt::~ComputeEVPDt()
{
  delete[] vector;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::init()
{
  pair = PairEVPLJ::find(force);
  if (!pair)
    error->all(FLERR, "Compute {} evp/dt needs pair style evp/lj, found '{}'", id,
               force->pair_style ? force->pair_style : "none");
  warned = unsettled_warned = false;
  computed_step = -1;
}

/* ----------------------------------------------------------------------
   before the first step: a step above the limit runs, but not unnoticed
------------------------------------------------------------------------- */

void ComputeEVPDt::setup()
{
  if (update->whichflag != 1 || warned) return;
  for (int k = 0; k < modify->nfix; k++)
    if (strcmp(modify->fix[k]->style, "dt/evp") == 0) return;    // sets the step itself
  warned = true;
  const double limit = compute_scalar();
  if (update->dt > limit && comm->me == 0)
    error->warning(
        FLERR,
        "The step {:.6g} is {:.4g} times the largest stable step {:.6g} of compute {} "
        "evp/dt: the run is unstable, or silently wrong; use a timestep of at most {:.4g}",
        update->dt, update->dt / limit, limit, id, 0.8 * limit);
}

/* ---------------------------------------------------------------------- */

double ComputeEVPDt::compute_scalar()
{
  compute_vector();
  invoked_scalar = update->ntimestep;
  scalar = all_implicit() ? vector[2] : vector[1];
  return scalar;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::compute_vector()
{
  // set-up, thermo and fix dt/evp may all ask at one step
  if (update->whichflag != 0 && computed_step == update->ntimestep) return;
  computed_step = update->ntimestep;
  invoked_vector = update->ntimestep;
  collect_links();

  const double lambda_k = largest_eigenvalue({1.0, 1.0, 0.0});
  const double lambda_c = largest_eigenvalue({0.0, 0.0, 1.0});
  const double lambda_across = largest_eigenvalue({0.0, 1.0, 0.0});
  const double lambda_axial = lambda_across > 0.0 ? largest_eigenvalue({1.0, 0.0, 0.0}) : lambda_k;

  vector[0] = root_of(lambda_k, 0.0);
  vector[1] = explicit_step(lambda_k, lambda_c);
  vector[2] = implicit_step(lambda_axial, lambda_across);
  vector[3] = paper_step();
  vector[4] = row_sum_step();
}

/* ----------------------------------------------------------------------
   does fix nve/evp integrate all the free atoms?
------------------------------------------------------------------------- */

bool ComputeEVPDt::all_implicit() const
{
  int bit = 0;
  for (int k = 0; k < modify->nfix; k++)
    if (strcmp(modify->fix[k]->style, "nve/evp") == 0) bit = modify->fix[k]->groupbit;
  int outside = 0, any;
  for (int i = 0; i < atom->nlocal; i++)
    if (is_free(i) && !(atom->mask[i] & bit)) outside = 1;
  MPI_Allreduce(&outside, &any, 1, MPI_INT, MPI_MAX, world);
  return !any;
}

/* ---------------------------------------------------------------------- */

bool ComputeEVPDt::is_free(int i) const
{
  return atom->mask[i] & groupbit;
}

/* ----------------------------------------------------------------------
   acceleration per force [velocity/time/force], LAMMPS' unit factor included
------------------------------------------------------------------------- */

double ComputeEVPDt::inverse_mass(int i) const
{
  return force->ftm2v / (atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]]);
}

/* ----------------------------------------------------------------------
   stiffness from the law, never below that at rest: a pair in the soft second
   regime may be back in the first within a step
------------------------------------------------------------------------- */

void ComputeEVPDt::collect_links()
{
  pair = PairEVPLJ::find(force);    // between runs it may be another than at init()
  int packed = pair && pair->is_packed(), all_packed;
  MPI_Allreduce(&packed, &all_packed, 1, MPI_INT, MPI_MIN, world);
  if (!all_packed)
    error->all(FLERR,
               "Compute {} evp/dt needs the pairs of the present positions: print c_{} with "
               "thermo_style in a 'run 0' first",
               id, id);

  links.clear();
  const auto x = reinterpret_cast<const double(*)[3]>(atom->x[0]);
  for (const auto &row : pair->packed_pairs().rows)
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &packed_pair = pair->packed_pairs().pairs[n];
      const int i = row.i, j = packed_pair.j;
      if (!is_free(i) && !is_free(j)) continue;
      const EVP::PairGeometry g(x, i, j);
      if (g.dsq > packed_pair.cutsq) continue;

      const EVP::Law &law = pair->law_of(packed_pair);
      const double d = std::sqrt(g.dsq), deq = 1.0 / packed_pair.inv_deq;
      links.push_back({i,
                       j,
                       {g.dx / d, g.dy / d, g.dz / d},
                       std::max(law.stiffness(d, deq), law.stiffness_at_rest(deq)),
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
      start[3 * i + c] = (double) ((z ^ (z >> 27)) >> 11) * 0x1.0p-53 - 0.5;
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
  nodal.assign((size_t) 3 * nall, 0.0);
  for (int i = 0; i < nlocal; i++) {
    const double scale = is_free(i) ? std::sqrt(inverse_mass(i)) : 0.0;
    for (int c = 0; c < 3; c++) nodal[3 * i + c] = scale * in[3 * i + c];
  }
  EVP::compat::forward_comm(comm, this);

  const int nreact = force->newton_pair ? nall : nlocal;
  result.assign((size_t) 3 * nall, 0.0);
  for (const Link &link : links) {
    const double *vi = &nodal[(size_t) 3 * link.i], *vj = &nodal[(size_t) 3 * link.j];
    const double dv[3] = {vi[0] - vj[0], vi[1] - vj[1], vi[2] - vj[2]};
    const double along = link.u[0] * dv[0] + link.u[1] * dv[1] + link.u[2] * dv[2];
    const double across = mix.across * link.across;
    const double axial = mix.axial * link.axial + mix.damping * link.damping - across;
    for (int c = 0; c < 3; c++) {
      const double y = axial * along * link.u[c] + across * dv[c];
      result[(size_t) 3 * link.i + c] += y;
      if (link.j < nreact) result[(size_t) 3 * link.j + c] -= y;
    }
  }
  sum_to_owners(result);

  for (int i = 0; i < nlocal; i++) {
    const double scale = is_free(i) ? std::sqrt(inverse_mass(i)) : 0.0;
    for (int c = 0; c < 3; c++) out[3 * i + c] = scale * result[3 * i + c];
  }
}

/* ----------------------------------------------------------------------
   dt with lambda_max(M^-1 (dt^2 K + 2 dt C)) = 4. The root with the two largest
   eigenvalues taken apart is below it, and where damping and stiffness peak in
   different modes by much; each correction lies between those of a pure
   stiffness and of a pure damper
------------------------------------------------------------------------- */

double ComputeEVPDt::explicit_step(double lambda_k, double lambda_c)
{
  double dt = root_of(lambda_k, lambda_c);
  if (lambda_c == 0.0) return dt;
  for (int it = 0; it < 10; it++) {
    const double stiff = dt * dt * lambda_k, viscous = 2.0 * dt * lambda_c;
    const double value = largest_eigenvalue({dt * dt, dt * dt, 2.0 * dt});
    const double power = (2.0 * stiff + viscous) / (stiff + viscous);
    dt *= std::pow(4.0 / value, 1.0 / power);
    if (std::fabs(value / 4.0 - 1.0) < 10.0 * TOLERANCE) return dt;
  }
  return root_of(lambda_k, lambda_c);    // below the limit in any case
}

/* ----------------------------------------------------------------------
   sufficient for dt^2 K <= 4 M + 2 dt C: with C >= a K_axial,
   (dt^2 - 2 a dt) lambda_axial + dt^2 lambda_across <= 4 where dt >= 2 a, and
   dt^2 lambda_across <= 4 below, where the damping outweighs the axial stiffness
------------------------------------------------------------------------- */

double ComputeEVPDt::implicit_step(double lambda_axial, double lambda_across) const
{
  double here = NO_LIMIT, a;
  for (const Link &link : links)
    if (link.axial > 0.0) here = std::min(here, link.damping / link.axial);
  MPI_Allreduce(&here, &a, 1, MPI_DOUBLE, MPI_MIN, world);

  const double sum = lambda_axial + lambda_across;
  if (sum == 0.0) return NO_LIMIT;
  if (a * a * lambda_across > 1.0) return root_of(lambda_across, 0.0);
  const double b = a * lambda_axial;
  return (b + std::sqrt(b * b + 4.0 * sum)) / sum;
}

/* ----------------------------------------------------------------------
   eqs. 6 and 7: overlap of 0.3, deq = R_i + R_j; knows neither coordination nor gamma
------------------------------------------------------------------------- */

double ComputeEVPDt::paper_step() const
{
  double here = NO_LIMIT, dt;
  for (const auto &row : pair->packed_pairs().rows)
    for (int n = row.first; n < row.last; n++) {
      const EVP::PackedPair &packed_pair = pair->packed_pairs().pairs[n];
      const int i = row.i, j = packed_pair.j;
      if (!is_free(i) && !is_free(j)) continue;
      const EVP::PairGeometry g(reinterpret_cast<const double(*)[3]>(atom->x[0]), i, j);
      if (g.dsq > packed_pair.cutsq) continue;
      const double k =
          pair->law_of(packed_pair).first_stiffness(0.7, atom->radius[i] + atom->radius[j]);
      const double w = std::max(inverse_mass(i), inverse_mass(j));
      if (k > 0.0) here = std::min(here, 1.0 / std::sqrt(k * w));
    }
  MPI_Allreduce(&here, &dt, 1, MPI_DOUBLE, MPI_MIN, world);
  return dt;
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
    for (auto &values : part[matrix]) sum_to_owners(values);
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
        sum[matrix] =
            std::fabs(part[matrix][0][3 * i + c]) + beside[c] + part[matrix][2][3 * i + c];
      }
      here = std::min(here, root_of(sum[0] * inverse_mass(i), sum[1] * inverse_mass(i)));
    }
  }
  MPI_Allreduce(&here, &dt, 1, MPI_DOUBLE, MPI_MIN, world);
  return dt;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::sum_to_owners(std::vector<double> &values)
{
  if (!force->newton_pair) return;
  nodal.swap(values);
  EVP::compat::reverse_comm(comm, this);
  nodal.swap(values);
}

/* ---------------------------------------------------------------------- */

int ComputeEVPDt::pack_forward_comm(int n, int *indices, double *buf, int /*pbc_flag*/,
                                    int * /*pbc*/)
{
  int m = 0;
  for (int k = 0; k < n; k++)
    for (int c = 0; c < 3; c++) buf[m++] = nodal[(size_t) 3 * indices[k] + c];
  return m;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::unpack_forward_comm(int n, int first, double *buf)
{
  std::copy_n(buf, 3 * n, &nodal[(size_t) 3 * first]);
}

/* ---------------------------------------------------------------------- */

int ComputeEVPDt::pack_reverse_comm(int n, int first, double *buf)
{
  std::copy_n(&nodal[(size_t) 3 * first], 3 * n, buf);
  return 3 * n;
}

/* ---------------------------------------------------------------------- */

void ComputeEVPDt::unpack_reverse_comm(int n, int *indices, double *buf)
{
  int m = 0;
  for (int k = 0; k < n; k++)
    for (int c = 0; c < 3; c++) nodal[(size_t) 3 * indices[k] + c] += buf[m++];
}

/* ---------------------------------------------------------------------- */

double ComputeEVPDt::memory_usage()
{
  return (double) links.capacity() * sizeof(Link) +
      (double) (nodal.capacity() + result.capacity()) * sizeof(double);
}
