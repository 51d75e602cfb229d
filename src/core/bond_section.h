// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bond_store.h"

#include <cstring>
#include <vector>

namespace EVP {

/// What restart files hold of the records of all bonds, beside those of each atom.
struct BondSection {
  double zone;      ///< see fix evp/bonds
  bool recorded;    ///< else the numbers that follow are 0
  int64_t count, highest;
  bool with_history;
  Within within;
  BondMeasures measures;    ///< empty where the bonds were not measured

  /// Restart files carry no check of their own, and a changed bit is another material: every section of ours ends with
  /// a checksum.
  std::vector<double> words() const
  {
    std::vector<double> words = {with_history ? FORMAT_WITH_HISTORY : FORMAT, zone,
                                 (double) recorded, (double) count, (double) highest};
    if (!measures.empty()) words[0] += MEASURED;
    if (within != Within::ALL) {
      words[0] += WITH_BODIES;
      words.push_back((double) (int) within);
    }
    words.push_back(checksum(words.data(), (int) words.size()));
    const std::vector<double> more = measures.empty() ? std::vector<double>() : measures.words();
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  /// From the bytes of words(); false where they are damaged or of another format.
  bool take(const char *bytes, int ntypes)
  {
    double words[7];
    memcpy(words, bytes, sizeof(double));
    const bool is_measured = words[0] >= FORMAT + MEASURED;
    if (is_measured) words[0] -= MEASURED;
    const bool divided = words[0] >= FORMAT + WITH_BODIES;
    if (divided) words[0] -= WITH_BODIES;
    with_history = words[0] == FORMAT_WITH_HISTORY;
    if (!with_history && words[0] != FORMAT) return false;
    const int n = divided ? 6 : 5;
    memcpy(words, bytes, (n + 1) * sizeof(double));
    if (words[n] != checksum(words, n)) return false;
    zone = words[1];
    recorded = words[2] != 0.0;
    count = (int64_t) words[3];
    highest = (int64_t) words[4];
    within = divided ? (Within) (int) words[5] : Within::ALL;
    measures = {};
    if (!is_measured) return true;
    std::vector<double> more(BondMeasures(ntypes).words().size());
    memcpy(more.data(), bytes + (n + 1) * sizeof(double), more.size() * sizeof(double));
    return measures.take(more.data(), ntypes);
  }

 private:
  // first of the words; no zone is that large
  static constexpr double FORMAT = 1001.0, FORMAT_WITH_HISTORY = 1002.0;
  static constexpr double WITH_BODIES = 2.0;    // on top, where `within` follows
  static constexpr double MEASURED = 4.0;       // on top, where measures follow the checksum
};

}    // namespace EVP
