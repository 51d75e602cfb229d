/* SPDX-License-Identifier: GPL-2.0-only

   Values per atom between the processes, for the fixes and computes of this package. */

#ifndef LMP_EVP_NODAL_EXCHANGE_H
#define LMP_EVP_NODAL_EXCHANGE_H

#include "core/bodies.h"

#include "comm.h"
#include "compute.h"
#include "fix.h"
#include "force.h"

#include <algorithm>
#include <vector>

namespace LAMMPS_NS {

/// A Fix or Compute that exchanges values of atoms and ghosts: comm_forward of them per atom from
/// owners to ghosts, comm_reverse of them summed from ghosts into owners; three unless it says else.
template <class Base> class NodalExchange : public Base {
 public:
  NodalExchange(LAMMPS *lmp, int narg, char **arg) : Base(lmp, narg, arg)
  {
    this->comm_forward = this->comm_reverse = 3;
  }

  int pack_forward_comm(int n, int *indices, double *buf, int /*pbc_flag*/, int * /*pbc*/) override
  {
    const int width = this->comm_forward;
    for (int k = 0; k < n; k++, buf += width) std::copy_n(values_of(indices[k], width), width, buf);
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
    if (lowest) {
      for (int k = 0; k < n; k++)
        fell = EVP::NodeSets::lower(exchanged->data() + (size_t) width * indices[k],
                                    buf + (size_t) width * k, width) ||
            fell;
      return;
    }
    for (int k = 0; k < n; k++)
      for (int c = 0; c < width; c++)
        (*exchanged)[(size_t) width * indices[k] + c] += buf[(size_t) width * k + c];
  }

 protected:
  using Nodal = std::vector<double>;    ///< a fixed number of values per atom and ghost

  /// Collective. Ghosts take the values of their owners.
  void to_ghosts(Nodal &values)
  {
    exchanged = &values;
    this->comm->forward_comm(this);
  }

  /// Collective. Owners add what their ghosts hold; nothing where ghosts take no reactions.
  void to_owners(Nodal &values)
  {
    if (!this->force->newton_pair) return;
    exchanged = &values;
    this->comm->reverse_comm(this);
  }

  /// Collective. Owners take the lowest of their values and those of their ghosts, whether ghosts
  /// take reactions or not. Returns whether a value on this process fell.
  bool lower_owners(Nodal &values)
  {
    exchanged = &values;
    lowest = true;
    fell = false;
    this->comm->reverse_comm(this);
    lowest = false;
    return fell;
  }

 private:
  Nodal *exchanged = nullptr;
  bool lowest = false, fell = false;

  /// Where those of an atom begin; first may be behind the last one where nothing is sent.
  double *values_of(int first, int width) const
  {
    return exchanged->data() + (size_t) width * first;
  }
};

}    // namespace LAMMPS_NS

#endif
