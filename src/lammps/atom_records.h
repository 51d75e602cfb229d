// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/simd.h"
#include "lammps_names.h"

#include "atom.h"
#include "fix.h"

#include <cstring>
#include <vector>

namespace EVP {

/// A Fix with one record per local atom, which goes where its atom goes; set_arrays(i) makes a new one.
/// None is kept, and nothing done, before keep_records().
/// Record: a struct of doubles only.
template <class Base, class Record> class AtomRecords : public Base {
 public:
  AtomRecords(LAMMPS *lmp, int narg, char **arg) : Base(lmp, narg, arg) {}
  ~AtomRecords() override
  {
    if (following) this->atom->delete_callback(this->id, Atom::GROW);
  }

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

  /// Last in the constructor of the fix, which may stop before: LAMMPS takes it from there only.
  void follow_atoms()
  {
    this->atom->add_callback(Atom::GROW);
    following = true;
  }

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
  bool following = false, kept = false;
};

}    // namespace EVP
