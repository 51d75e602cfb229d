// SPDX-License-Identifier: GPL-2.0-only
//
// Values per atom between MPI ranks, for the fixes and computes of this package and their companions.
#pragma once

#include "box_motion.h"
#include "collective.h"
#include "core/per_atom_comm.h"
#include "lammps_names.h"

#include "comm.h"
#include "compute.h"
#include "domain.h"
#include "fix.h"
#include "force.h"

#include <algorithm>
#include <string>
#include <type_traits>

namespace EVP {

/// A Fix or Compute that exchanges values of atoms and ghosts: comm_forward of them per atom from
/// owners to ghosts, comm_reverse of them from ghosts to owners; three by default.
template <class Base> class WithPerAtomComm : public Base, public PerAtomComm {
 public:
  WithPerAtomComm(LAMMPS *lmp, int narg, char **arg) :
      Base(lmp, narg, arg), who(std::string(std::is_same_v<Base, Fix> ? "Fix " : "Compute ") +
                                this->id + " " + this->style)
  {
    this->comm_forward = this->comm_reverse = 3;
  }

  void forward_comm(Values &values) override
  {
    exchanged = &values;
    this->comm->forward_comm(this);
  }

  /// Periodic images move with a box that deforms with 'remap v', all atoms being in its group.
  void forward_comm_velocities(Values &velocities) override
  {
    if (this->domain->deform_vremap)
      forward_comm_images(velocities, this->domain->h_rate);
    else
      forward_comm(velocities);
  }

  /// Collective. Ghosts take the values of their owners and, periodic images, what is between them and
  /// their owners in a box of these edges.
  void forward_comm_images(Values &values, const double *edges)
  {
    shifted_by = edges;
    forward_comm(values);
    shifted_by = nullptr;
  }

  void reverse_comm(Values &values) override
  {
    if (!this->force->newton_pair) return;
    exchanged = &values;
    this->comm->reverse_comm(this);
  }

  double sum(double here) override { return reduce_all(here, MPI_SUM, this->world); }

  int pack_forward_comm(int n, int *indices, double *buf, int pbc_flag, int *pbc) override
  {
    const int width = this->comm_forward;
    for (int k = 0; k < n; k++) std::copy_n(values_of(indices[k], width), width, buf + k * width);
    if (shifted_by && pbc_flag) {
      const auto shift = image_shift(shifted_by, pbc);
      for (int k = 0; k < n; k++)
        for (int c = 0; c < 3; c++) buf[k * width + c] += shift[c];
    }
    return n * width;
  }

  void unpack_forward_comm(int n, int first, double *buf) override
  {
    const int width = this->comm_forward;
    std::copy_n(buf, n * width, values_of(first, width));
  }

  int pack_reverse_comm(int n, int first, double *buf) override
  {
    const int width = this->comm_reverse;
    std::copy_n(values_of(first, width), n * width, buf);
    return n * width;
  }

  void unpack_reverse_comm(int n, int *indices, double *buf) override
  {
    const int width = this->comm_reverse;
    for (int k = 0; k < n; k++, buf += width) {
      double *const own = values_of(indices[k], width);
      for (int c = 0; c < width; c++) own[c] += buf[c];
    }
  }

 protected:
  const std::string who;    ///< in messages: Fix or Compute, its ID and style

 private:
  Values *exchanged = nullptr;
  const double *shifted_by = nullptr;    // edges, for periodic images

  /// Where those of an atom begin; first may be behind the last one where nothing is sent.
  double *values_of(int first, int width) const
  {
    return exchanged->data() + (size_t) width * first;
  }
};

}    // namespace EVP
