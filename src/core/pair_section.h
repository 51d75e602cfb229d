// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/bytes.h"
#include "core/pair_rules.h"

#include <string>
#include <vector>

namespace EVP {

/// What restart files hold of a pair style in front of its rows.
struct PairSection {
  PairRules rules;
  std::string recorder;    ///< ID of the fix that recorded the bonds, empty without

  /// Words that stand first, whatever follows.
  static constexpr size_t NFIRST = 4;

  std::vector<double> words() const
  {
    std::vector<double> words = {rules.has_history() ? FORMAT_WITH_HISTORY : FORMAT,
                                 (double) (int) rules.contact, rules.overlap,
                                 (double) recorder.size()};
    words.insert(words.end(), recorder.begin(), recorder.end());
    if (rules.has_history()) words.insert(words.end(), {(double) rules.flows, rules.break_strain});
    words.push_back(checksum(words.data(), (int) words.size()));
    return words;
  }

  /// Number of the words that follow the first ones; 0 where these are damaged or of another format.
  static size_t count_more(const std::vector<double> &words)
  {
    if (words[0] != FORMAT && words[0] != FORMAT_WITH_HISTORY) return 0;
    if (!(words[3] >= 0.0 && words[3] <= LONGEST_ID)) return 0;
    return (size_t) words[3] + (words[0] == FORMAT_WITH_HISTORY ? 3 : 1);
  }

  /// From all of them; false where they are damaged.
  bool take(const std::vector<double> &words)
  {
    const auto last = words.end() - 1, id = words.begin() + NFIRST, id_end = id + (int) words[3];
    if (*last != checksum(words.data(), (int) words.size() - 1)) return false;
    rules = {(Contact) (int) words[1], words[2]};
    if (words[0] == FORMAT_WITH_HISTORY) {
      rules.flows = id_end[0] != 0.0;
      rules.break_strain = id_end[1];
    }
    recorder = {id, id_end};
    return true;
  }

 private:
  static constexpr double FORMAT = 1003.0, FORMAT_WITH_HISTORY = 1004.0;    // first of the words
  static constexpr double LONGEST_ID = 1000;
};

}    // namespace EVP
