// SPDX-License-Identifier: GPL-2.0-only

#include "core/linear_network.h"

#include <numeric>

namespace EVP {

// A link in a mixed matrix is axial u u^T + across 1.
static double across_of(const LinearNetwork::Mix &mix, const LinearNetwork::Link &link)
{
  return mix.across * link.across;
}

static double axial_of(const LinearNetwork::Mix &mix, const LinearNetwork::Link &link)
{
  return mix.axial * link.axial + mix.damping * link.damping - across_of(mix, link);
}

LanczosResult LinearNetwork::largest_eigenvalue(const Mix &mix, double tolerance,
                                                int max_iterations)
{
  double here = 0.0;
  for (const Link &link : links)
    here += mix.axial * link.axial + mix.across * link.across + mix.damping * link.damping;
  if (exchange.sum(here) == 0.0) return {0.0, 0, true};

  std::vector<double> vector = start;
  return EVP::largest_eigenvalue(
      vector,
      [&](const auto &in, auto &out) {
        apply(mix, in, out);
      },
      [&](const auto &a, const auto &b) {
        return exchange.sum(std::inner_product(a.begin(), a.end(), b.begin(), 0.0));
      },
      tolerance, max_iterations);
}

void LinearNetwork::apply(const Mix &mix, const std::vector<double> &in, std::vector<double> &out)
{
  const auto scale = [this](const std::vector<double> &from, std::vector<double> &to) {
    for (size_t i = 0; 3 * i < start.size(); i++) {
      const double root = std::sqrt(inverse_mass[i]);
      for (size_t k = 3 * i; k < 3 * i + 3; k++) to[k] = root * from[k];
    }
  };
  motion.assign(3 * inverse_mass.size(), 0.0);
  scale(in, motion);
  exchange.to_ghosts(motion);

  reaction.assign(motion.size(), 0.0);
  for (const Link &link : links) {
    const double *vi = &motion[(size_t) 3 * link.i], *vj = &motion[(size_t) 3 * link.j];
    const double dv[] = {vi[0] - vj[0], vi[1] - vj[1], vi[2] - vj[2]};
    const double along = link.u[0] * dv[0] + link.u[1] * dv[1] + link.u[2] * dv[2];
    const double across = across_of(mix, link), axial = axial_of(mix, link);
    for (int c = 0; c < 3; c++) {
      const double y = axial * along * link.u[c] + across * dv[c];
      reaction[(size_t) 3 * link.i + c] += y;
      if (link.j < nreact) reaction[(size_t) 3 * link.j + c] -= y;
    }
  }
  exchange.to_owners(reaction);
  scale(reaction, out);
}

std::vector<double> LinearNetwork::row_sums(const Mix &mix) const
{
  // per particle: own block xx yy zz, xy xz yz, and absolute row sums towards free partners
  std::vector<double> diagonal(3 * inverse_mass.size(), 0.0), off = diagonal, partners = diagonal;
  for (const Link &link : links) {
    const double across = across_of(mix, link), axial = axial_of(mix, link);
    const auto product = [&](int a, int b) {
      return axial * link.u[a] * link.u[b];
    };
    const double own[] = {product(0, 0) + across, product(1, 1) + across, product(2, 2) + across};
    const double beside[] = {product(0, 1), product(0, 2), product(1, 2)};
    const double xy = std::fabs(beside[0]), xz = std::fabs(beside[1]), yz = std::fabs(beside[2]);
    const double rows[] = {std::fabs(own[0]) + xy + xz, std::fabs(own[1]) + xy + yz,
                           std::fabs(own[2]) + xz + yz};
    const auto add = [&](int i, int j) {
      for (int c = 0; c < 3; c++) {
        diagonal[(size_t) 3 * i + c] += own[c];
        off[(size_t) 3 * i + c] += beside[c];
        if (is_free(j)) partners[(size_t) 3 * i + c] += rows[c];
      }
    };
    add(link.i, link.j);
    if (link.j < nreact) add(link.j, link.i);
  }
  for (std::vector<double> *values : {&diagonal, &off, &partners}) exchange.to_owners(*values);

  std::vector<double> sums(start.size());
  for (size_t n = 0; n < sums.size(); n++) {
    const double *b = &off[n - n % 3];
    const double xy = std::fabs(b[0]), xz = std::fabs(b[1]), yz = std::fabs(b[2]);
    const double beside[] = {xy + xz, xy + yz, xz + yz};
    sums[n] = inverse_mass[n / 3] * (std::fabs(diagonal[n]) + beside[n % 3] + partners[n]);
  }
  return sums;
}

double LinearNetwork::memory_usage() const
{
  double bytes = (double) (links.capacity() * sizeof(Link));
  for (const auto *values : {&inverse_mass, &start, &motion, &reaction})
    bytes += (double) (values->capacity() * sizeof(double));
  return bytes;
}

}    // namespace EVP
