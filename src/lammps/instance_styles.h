// SPDX-License-Identifier: GPL-2.0-only
/// LAMMPS' list of plugins belongs to the process, its styles to the instance: a style that another instance has loaded
/// is ignored by LAMMPS where this one loads it, and stays unknown here.
#pragma once

#include "force.h"
#include "input.h"
#include "lammpsplugin.h"
#include "library.h"
#include "modify.h"

#include <cstring>
#include <type_traits>

namespace {

/// Has an instance of this process loaded a style of that kind and name?
bool is_listed(const char *kind, const char *name)
{
  char listed_kind[64], listed_name[64];
  for (int k = 0; k < lammps_plugin_count(); k++)
    if (lammps_plugin_name(k, listed_kind, listed_name, sizeof(listed_kind)) &&
        std::strcmp(kind, listed_kind) == 0 && std::strcmp(name, listed_name) == 0)
      return true;
  return false;
}

/// Makes the style known to this instance, as LAMMPS does. False if it is known, or of no kind of ours.
bool make_known(LAMMPS_NS::LAMMPS *lmp, const lammpsplugin_t &style)
{
  using namespace LAMMPS_NS;
  const auto is = [&](const char *kind) {
    return std::strcmp(style.style, kind) == 0;
  };
  const auto add = [&](auto *styles, auto *creator) {
    using Creator = typename std::remove_pointer_t<decltype(styles)>::mapped_type;
    return styles->emplace(style.name, (Creator) creator).second;
  };
  if (is("pair")) return add(lmp->force->pair_map, style.creator.v1);
  if (is("fix")) return add(lmp->modify->fix_map, style.creator.v2);
  if (is("compute")) return add(lmp->modify->compute_map, style.creator.v2);
  if (is("command")) return add(lmp->input->command_map, style.creator.v1);
  return false;
}

}    // namespace
