// SPDX-License-Identifier: GPL-2.0-only
//
// Three components at once. Pure C++17, with the vector types of g++ and clang++.

#ifndef EVP_CORE_VECTOR_H
#define EVP_CORE_VECTOR_H

#include <cstring>

namespace EVP {

/// Three components, the first two side by side in a register: compilers do not find this by themselves.
class Vector {
 public:
  Vector() : xy{0.0, 0.0}, z(0.0) {}
  explicit Vector(const double *from) : z(from[2]) { std::memcpy(&xy, from, sizeof(xy)); }

  friend Vector operator+(const Vector &a, const Vector &b) { return {a.xy + b.xy, a.z + b.z}; }
  friend Vector operator-(const Vector &a, const Vector &b) { return {a.xy - b.xy, a.z - b.z}; }
  friend Vector operator*(const Vector &a, double s) { return {a.xy * s, a.z * s}; }
  friend double dot(const Vector &a, const Vector &b)
  {
    const Two p = a.xy * b.xy;
    return p[0] + p[1] + a.z * b.z;
  }
  void add_to(double *to) const { (Vector(to) + *this).store(to); }
  void subtract_from(double *to) const { (Vector(to) - *this).store(to); }

 private:
  typedef double Two __attribute__((vector_size(16)));
  Two xy;
  double z;

  Vector(const Two &xy_in, double z_in) : xy(xy_in), z(z_in) {}
  void store(double *to) const
  {
    std::memcpy(to, &xy, sizeof(xy));
    to[2] = z;
  }
};

}    // namespace EVP

#endif
