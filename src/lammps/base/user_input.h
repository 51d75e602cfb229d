// SPDX-License-Identifier: GPL-2.0-only
//
// What commands are given: keyword value keyword value ..., and errors where these are wrong.
#pragma once

#include "core/base/text.h"
#include "lammps/base/lammps_names.h"

#include "error.h"
#include "utils.h"

#include <algorithm>
#include <string>
#include <vector>

namespace EVP {

/// Calls f. Stops, naming `who`, where it throws BadInput, which all MPI ranks must do together.
template <class F> void stop_at_bad_input(Error *error, const std::string &who, F &&f)
{
  try {
    f();
  } catch (const BadInput &bad) {
    error->all(FLERR, "{}: {}", who, bad.what());
  }
}

/// A keyword and its value; what it cannot mean throws BadInput.
struct Keyword {
  std::string name, value;

  bool is(const char *other) const { return name == other; }
  double number() const { return parse_number(name, value); }
  void demand(bool holds, const std::string &rule) const
  {
    if (!holds) throw BadInput(name + " " + rule + ", got " + value);
  }
};

/// Calls f(Keyword) for all. Stops, naming `who`, where there is another keyword than those
/// of the list, which are joined by `joint` in the message, where a value is missing, and where f throws
/// BadInput.
template <class F>
void for_each_keyword(Error *error, const std::string &who, int narg, char **arg,
                      const std::vector<std::string> &keys, const char *joint, F &&f)
{
  for (int iarg = 0; iarg < narg; iarg += 2) {
    const std::string key = arg[iarg];
    if (std::find(keys.begin(), keys.end(), key) == keys.end())
      error->all(FLERR, "{}: unknown keyword '{}'; it takes {}", who, key,
                 utils::join_words(keys, joint));
    if (iarg + 1 == narg) error->all(FLERR, "{}: keyword {} needs a value", who, key);
    stop_at_bad_input(error, who, [&] {
      f(Keyword{key, arg[iarg + 1]});
    });
  }
}

}    // namespace EVP
