// SPDX-License-Identifier: GPL-2.0-only
//
// Values per atom of fixes, computes and the pair style: exchanged between MPI ranks, and kept with their atoms.
#pragma once

#include "core/base/simd.h"
#include "core/pairs/pairs.h"
#include "lammps/base/collective.h"
#include "lammps/base/lammps_names.h"

#include "atom.h"
#include "comm.h"
#include "compute.h"
#include "domain.h"
#include "fix.h"
#include "force.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace EVP {

/// The edges of a periodic box, or what is linear in them, as LAMMPS orders them: xx yy zz yz xz xy.
using Edges = std::array<double, 6>;

/// How far a periodic image is from its atom, or how fast it moves with a box of these rates. pbc: that
/// of LAMMPS' communication.
inline std::array<double, 3> image_shift(const double *edges, const int *pbc)
{
  return {pbc[0] * edges[0] + pbc[5] * edges[5] + pbc[4] * edges[4],
          pbc[1] * edges[1] + pbc[3] * edges[3], pbc[2] * edges[2]};
}

/// A Fix or Compute that exchanges values of atoms and ghosts: at most comm_forward of them per atom
/// from owners to ghosts, comm_reverse of them from ghosts to owners, as LAMMPS has made its buffers;
/// three by default.
template <class Base> class WithPerAtomComm : public Base, public PerAtomComm {
 public:
  WithPerAtomComm(LAMMPS *lmp, int narg, char **arg) :
      Base(lmp, narg, arg), who(std::string(std::is_same_v<Base, Fix> ? "Fix " : "Compute ") +
                                this->id + " " + this->style)
  {
    this->comm_forward = this->comm_reverse = 3;
  }

  void forward_comm(AtomValues &values) override
  {
    set_exchanged(values, this->comm_forward);
    this->comm->forward_comm(this, values.width());
  }

  /// Periodic images move with a box that deforms with 'remap v', all atoms being in its group.
  void forward_comm_velocities(AtomValues &velocities) override
  {
    if (this->domain->deform_vremap)
      forward_comm_images(velocities, this->domain->h_rate);
    else
      forward_comm(velocities);
  }

  /// Collective. Ghosts take the values of their owners and, periodic images, to the first three what is
  /// between them and their owners in a box of these edges.
  void forward_comm_images(AtomValues &values, const double *edges)
  {
    if (values.width() < 3)
      this->error->one(FLERR, "{}: {} values per atom cannot be shifted by periods", who,
                       values.width());
    shifted_by = edges;
    forward_comm(values);
    shifted_by = nullptr;
  }

  void reverse_comm(AtomValues &values) override
  {
    if (!this->force->newton_pair) return;
    set_exchanged(values, this->comm_reverse);
    this->comm->reverse_comm(this, values.width());
  }

  double sum(double here) override { return reduce_all(here, MPI_SUM, this->world); }

  int pack_forward_comm(int n, int *indices, double *buf, int pbc_flag, int *pbc) override
  {
    const AtomValues &values = *exchanged;
    const int width = values.width();
    for (int k = 0; k < n; k++) std::copy_n(values[indices[k]], width, buf + k * width);
    if (shifted_by && pbc_flag) {
      const auto shift = image_shift(shifted_by, pbc);
      for (int k = 0; k < n; k++)
        for (int c = 0; c < 3; c++) buf[k * width + c] += shift[c];
    }
    return n * width;
  }

  void unpack_forward_comm(int n, int first, double *buf) override
  {
    std::copy_n(buf, n * exchanged->width(), (*exchanged)[first]);
  }

  int pack_reverse_comm(int n, int first, double *buf) override
  {
    const int width = exchanged->width();
    std::copy_n((*exchanged)[first], n * width, buf);
    return n * width;
  }

  void unpack_reverse_comm(int n, int *indices, double *buf) override
  {
    AtomValues &values = *exchanged;
    const int width = values.width();
    for (int k = 0; k < n; k++, buf += width) {
      double *const own = values[indices[k]];
      for (int c = 0; c < width; c++) own[c] += buf[c];
    }
  }

 protected:
  const std::string who;    ///< in messages: Fix or Compute, its ID and style

 private:
  AtomValues *exchanged = nullptr;
  const double *shifted_by = nullptr;    // edges, for periodic images

  // more than LAMMPS' buffers hold, or of other atoms, would lie out of bounds
  void set_exchanged(AtomValues &values, int most)
  {
    if (values.width() > most)
      this->error->one(FLERR, "{}: {} values per atom to exchange, but its buffers are for {}", who,
                       values.width(), most);
    if (values.size() != (size_t) (this->atom->nlocal + this->atom->nghost))
      this->error->one(FLERR, "{}: values to exchange are of {} atoms and ghosts, not of {}", who,
                       values.size(), this->atom->nlocal + this->atom->nghost);
    exchanged = &values;
  }
};

/// A Fix with one record per local atom, which goes where its atom goes; set_arrays(i) makes a new one.
/// None is kept, and nothing done, before keep_records(). Callbacks of LAMMPS are those of the fix.
/// Record: a struct of doubles only.
template <class Base, class Record> class AtomRecords : public Base {
 public:
  AtomRecords(LAMMPS *lmp, int narg, char **arg) : Base(lmp, narg, arg) {}

  void grow_arrays(int nmax) override { records.resize(kept ? nmax : 0); }
  void copy_arrays(int i, int j, int /*delflag*/) override
  {
    if (kept) records[j] = records[i];
  }
  int pack_exchange(int i, double *buf) override
  {
    if (kept) memcpy(buf, &records[i], sizeof(Record));
    return kept ? SIZE : 0;
  }
  int unpack_exchange(int i, double *buf) override
  {
    if (kept) memcpy(&records[i], buf, sizeof(Record));
    return kept ? SIZE : 0;
  }
  double memory_usage() override { return bytes_of(records); }

 protected:
  std::vector<Record> records;

  /// From now on: makes the records of the atoms here.
  void keep_records()
  {
    kept = true;
    this->create_attribute = 1;
    this->maxexchange = SIZE;
    this->grow_arrays(this->atom->nmax);
    for (int i = 0; i < this->atom->nlocal; i++) this->set_arrays(i);
  }
  bool keeps_records() const { return kept; }

 private:
  static constexpr int SIZE = sizeof(Record) / sizeof(double);
  static_assert(sizeof(Record) == SIZE * sizeof(double), "a record travels as its numbers");
  bool kept = false;
};

}    // namespace EVP
