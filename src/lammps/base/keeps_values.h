// SPDX-License-Identifier: GPL-2.0-only
#pragma once

namespace EVP {

class BondStore;

/// A fix that keeps values of each sphere, with the records of fix evp/bonds.
class KeepsValues {
 public:
  /// At each set-up, also twice: by BondStore::keep(). Values that nobody keeps then are dropped.
  virtual void keep_values(BondStore &) = 0;

 protected:
  ~KeepsValues() = default;
};

}    // namespace EVP
