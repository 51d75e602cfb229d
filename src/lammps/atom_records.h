/* SPDX-License-Identifier: GPL-2.0-only

   One record per local atom, which a fix moves with the atoms. */

#ifndef LMP_EVP_ATOM_RECORDS_H
#define LMP_EVP_ATOM_RECORDS_H

#include <cstring>
#include <vector>

namespace EVP {

/// Record: a struct of doubles only. For the functions of the same names of a fix with
/// Atom::add_callback(Atom::GROW).
template <class Record> class AtomRecords {
 public:
  static constexpr int SIZE = sizeof(Record) / sizeof(double);    ///< values per atom
  static_assert(sizeof(Record) == SIZE * sizeof(double), "a record travels as its numbers");

  Record &operator[](int i) { return records[i]; }
  void grow(int nmax) { records.resize(nmax); }
  void copy(int from, int to) { records[to] = records[from]; }
  int pack(int i, double *buf) const
  {
    memcpy(buf, &records[i], sizeof(Record));
    return SIZE;
  }
  int unpack(int i, const double *buf)
  {
    memcpy(&records[i], buf, sizeof(Record));
    return SIZE;
  }
  double memory_usage() const { return (double) records.capacity() * sizeof(Record); }

 private:
  std::vector<Record> records;
};

}    // namespace EVP

#endif
