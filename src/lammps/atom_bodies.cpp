// SPDX-License-Identifier: GPL-2.0-only

#include "atom_bodies.h"

#include "collective.h"

#include "atom_vec.h"
#include "error.h"
#include "fix.h"
#include "lammps.h"
#include "modify.h"

#include <algorithm>

namespace EVP {

std::string missing_molecules(const LAMMPS *lmp)
{
  const std::string remedy = "'fix ID all property/atom mol ghost yes'";
  if (!lmp->atom->molecule)
    return "within molecule needs atoms with molecule IDs: define " + remedy +
        " before it, also after read_restart, or use an atom style that has them, such as "
        "'atom_style hybrid sphere molecular'";

  const auto &sent = lmp->atom->avec->fields_border;
  if (std::find(sent.begin(), sent.end(), "molecule") != sent.end()) return "";
  for (const Fix *fix : lmp->modify->get_fix_list())
    if (utils::strmatch(fix->style, "^property/atom") && fix->comm_border > 0) return "";
  return "within molecule needs ghost atoms that know their molecule IDs: use " + remedy;
}

}    // namespace EVP
