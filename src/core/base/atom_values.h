// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace EVP {

/// One of the values of each particle.
template <class T> class AtomColumn {
 public:
  AtomColumn() = default;
  AtomColumn(T *first_in, size_t width_in) : first(first_in), width(width_in) {}

  T &of(int i) const { return first[width * (size_t) i]; }

 private:
  T *first = nullptr;    // that of particle 0
  size_t width = 0;
};

/// As many values of each particle as the width says. Room is kept, as in a std::vector.
class AtomValues {
 public:
  explicit AtomValues(int width_in, size_t n_in = 0, double value = 0.0) :
      width_((size_t) width_in), n(n_in), values(width_ * n, value)
  {
  }

  int width() const { return (int) width_; }
  size_t size() const { return n; }    ///< of particles
  size_t numbers() const { return values.size(); }
  bool empty() const { return n == 0; }

  /// Those of particle i, which is not checked; where the last ones end, with i = size().
  double *operator[](size_t i) { return values.data() + width_ * i; }
  const double *operator[](size_t i) const { return values.data() + width_ * i; }

  // all of them, particle by particle
  double *data() { return values.data(); }
  const double *data() const { return values.data(); }
  double *begin() { return data(); }
  const double *begin() const { return data(); }
  double *end() { return data() + numbers(); }
  const double *end() const { return data() + numbers(); }
  double &flat(size_t k) { return values[k]; }
  double flat(size_t k) const { return values[k]; }

  /// Of width 3: as LAMMPS' x, v and f, see scene::rows().
  double (*rows())[3] { return reinterpret_cast<double(*)[3]>(data()); }
  const double (*rows() const)[3] { return reinterpret_cast<const double(*)[3]>(data()); }

  AtomColumn<double> column(int c) { return {data() + c, width_}; }
  AtomColumn<const double> column(int c) const { return {data() + c, width_}; }

  void assign(size_t n_in, double value)
  {
    n = n_in;
    values.assign(width_ * n, value);
  }
  void resize(size_t n_in)
  {
    n = n_in;
    values.resize(width_ * n);
  }
  void clear() { resize(0); }

  /// Those of the first particles, which are there, from a block of the same width.
  void set_first(size_t particles, const double *from)
  {
    std::copy_n(from, width_ * particles, begin());
  }

  /// With another width there are none any more.
  void set_width(int width_in)
  {
    if (width_in == width()) return;
    clear();
    width_ = (size_t) width_in;
  }

  // for bytes_of()
  using value_type = double;
  size_t capacity() const { return values.capacity(); }

 private:
  size_t width_, n;
  std::vector<double> values;
};

}    // namespace EVP
