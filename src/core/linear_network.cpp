// SPDX-License-Identifier: GPL-2.0-only

#include "core/linear_network.h"

namespace EVP {

namespace {

  /// A link in a mixed matrix: axial u u^T + across 1.
  struct Stiffness {
    double axial, across;
    Stiffness(const LinearNetwork::Mix &mix, const LinearNetwork::Link &link) :
        across(mix.across * link.across)
    {
      axial = mix.axial * link.axial + mix.damping * link.damping - across;
    }
  };

}    // namespace

void LinearNetwork::assign(std::vector<double> inverse_mass_in, int nreact_in,
                           std::vector<double> start_in)
{
  inverse_mass = std::move(inverse_mass_in);
  nreact = nreact_in;
  start = std::move(start_in);
  all_links.clear();
}

LanczosResult LinearNetwork::largest_eigenvalue(const Mix &mix, double tolerance,
                                                int max_iterations)
{
  double here = 0.0;
  for (const Link &link : all_links)
    here += mix.axial * link.axial + mix.across * link.across + mix.damping * link.damping;
  if (exchange.sum(here) == 0.0) return {0.0, 0, true};

  std::vector<double> vector = start;
  return EVP::largest_eigenvalue(
      vector,
      [&](const auto &in, auto &out) {
        apply(mix, in, out);
      },
      [&](const auto &a, const auto &b) {
        double sum = 0.0;
        for (size_t k = 0; k < a.size(); k++) sum += a[k] * b[k];
        return exchange.sum(sum);
      },
      tolerance, max_iterations);
}

void LinearNetwork::apply(const Mix &mix, const std::vector<double> &in, std::vector<double> &out)
{
  motion.assign(3 * inverse_mass.size(), 0.0);
  for (size_t i = 0; 3 * i < in.size(); i++) {
    const double scale = std::sqrt(inverse_mass[i]);
    for (size_t k = 3 * i; k < 3 * i + 3; k++) motion[k] = scale * in[k];
  }
  exchange.to_ghosts(motion);

  reaction.assign(motion.size(), 0.0);
  for (const Link &link : all_links) {
    const double *vi = &motion[(size_t) 3 * link.i], *vj = &motion[(size_t) 3 * link.j];
    const double dv[3] = {vi[0] - vj[0], vi[1] - vj[1], vi[2] - vj[2]};
    const double along = link.u[0] * dv[0] + link.u[1] * dv[1] + link.u[2] * dv[2];
    const Stiffness k(mix, link);
    for (int c = 0; c < 3; c++) {
      const double y = k.axial * along * link.u[c] + k.across * dv[c];
      reaction[(size_t) 3 * link.i + c] += y;
      if (link.j < nreact) reaction[(size_t) 3 * link.j + c] -= y;
    }
  }
  exchange.to_owners(reaction);
  for (size_t i = 0; 3 * i < out.size(); i++) {
    const double scale = std::sqrt(inverse_mass[i]);
    for (size_t k = 3 * i; k < 3 * i + 3; k++) out[k] = scale * reaction[k];
  }
}

std::vector<double> LinearNetwork::row_sums(const Mix &mix) const
{
  static constexpr int FIRST[] = {0, 1, 2, 0, 0, 1}, SECOND[] = {0, 1, 2, 1, 2, 2};
  // own block, and absolute sums towards free partners
  const std::vector<double> zero(3 * inverse_mass.size(), 0.0);
  std::vector<double> diagonal = zero /* xx yy zz */, off = zero /* xy xz yz */, partners = zero;
  for (const Link &link : all_links) {
    const Stiffness k(mix, link);
    double block[6];
    for (int b = 0; b < 6; b++)
      block[b] = k.axial * link.u[FIRST[b]] * link.u[SECOND[b]] + (b < 3 ? k.across : 0.0);
    const double rows[] = {std::fabs(block[0]) + std::fabs(block[3]) + std::fabs(block[4]),
                           std::fabs(block[1]) + std::fabs(block[3]) + std::fabs(block[5]),
                           std::fabs(block[2]) + std::fabs(block[4]) + std::fabs(block[5])};
    const auto add = [&](int own, int other) {
      for (int c = 0; c < 3; c++) {
        const size_t n = (size_t) 3 * own + c;
        diagonal[n] += block[c];
        off[n] += block[3 + c];
        if (is_free(other)) partners[n] += rows[c];
      }
    };
    add(link.i, link.j);
    if (link.j < nreact) add(link.j, link.i);
  }
  for (std::vector<double> *values : {&diagonal, &off, &partners}) exchange.to_owners(*values);

  std::vector<double> sums(start.size());
  for (size_t n = 0; n < sums.size(); n++) {
    const size_t first = n - n % 3;    // of the particle
    const double xy = std::fabs(off[first]), xz = std::fabs(off[first + 1]);
    const double yz = std::fabs(off[first + 2]);
    const double beside[] = {xy + xz, xy + yz, xz + yz};
    sums[n] = inverse_mass[n / 3] * (std::fabs(diagonal[n]) + beside[n % 3] + partners[n]);
  }
  return sums;
}

double LinearNetwork::memory_usage() const
{
  double bytes = (double) (all_links.capacity() * sizeof(Link));
  for (const auto *values : {&inverse_mass, &start, &motion, &reaction})
    bytes += (double) (values->capacity() * sizeof(double));
  return bytes;
}

}    // namespace EVP
