// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "core/text.h"

namespace EVP {

/// Which atoms are one body: all, those of one type, or those of one molecule. Pairs of two bodies are
/// not recorded, and only repel.
enum class Within : int { ALL, TYPE, MOLECULE };
constexpr const char *WITHINS[] = {"all", "type", "molecule"};    ///< users give the last two

/// Throws BadInput.
inline Within parse_within(const std::string &word)
{
  for (const Within one : {Within::TYPE, Within::MOLECULE})
    if (word == WITHINS[(int) one]) return one;
  throw BadInput("within must be type or molecule (which atoms are one body), got '" + shown(word) +
                 "'");
}

}    // namespace EVP
