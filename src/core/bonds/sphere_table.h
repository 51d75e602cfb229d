// SPDX-License-Identifier: GPL-2.0-only
//
// What spheres keep, as MEMBERS in core/law/row.h is what a row has: each value is one line of a table, beside the record
// that holds it. Restart files, bond files, migration and compute evp/state/atom loop over the lines.
#pragma once

#include "core/base/text.h"

#include <cstddef>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace EVP {

/// What a bond file may give for a value, beside what it is at recording.
enum class Range {
  ANY,
  NOT_NEGATIVE,
  POSITIVE,
  COUNT,          ///< a whole number
  BATCH,          ///< the same; the first batch is as at recording
  NOT_IN_FILES    ///< nothing: only restart files have it
};

/// Of a value at recording: the number of bonds of the sphere.
constexpr double ITS_BONDS = std::numeric_limits<double>::infinity();

/// The same: 0, and soon what the bonds say. Hence no value tells that it has changed.
constexpr double BY_BONDS = -std::numeric_limits<double>::infinity();

/// A line: one value that a sphere keeps.
struct SphereValue {
  const char
      *name;    ///< in bond files and for compute evp/state/atom; of all tables no two are the same
  const char *unit;       ///< in words, 1 without
  double at_recording;    ///< also of an atom that is new
  Range range;
  bool shown;    ///< by compute evp/state/atom

  double first(size_t bonds) const
  {
    return at_recording == ITS_BONDS ? (double) bonds
        : at_recording == BY_BONDS   ? 0.0
                                     : at_recording;
  }

  /// Is it another than at the recording of this many bonds?
  bool has_changed(double now, size_t bonds) const
  {
    if (range == Range::NOT_IN_FILES || at_recording == BY_BONDS) return false;
    return range == Range::BATCH ? now > 1.0 : now != first(bonds);
  }
};

/// What some records need beside their own sphere.
enum Needs : unsigned {
  NOTHING_ELSE = 0,
  ALL_SPHERES = 1,    ///< once a sphere has changed, bond files must have all
  JOINED_BONDS = 2    ///< that bonds which began are told from others
};

/// The lines of a record, a struct of doubles, in the order of its members.
struct SphereTable {
  const SphereValue *values;
  size_t width;
  unsigned needs;

  const SphereValue *begin() const { return values; }
  const SphereValue *end() const { return values + width; }
};

template <class Record> constexpr SphereTable table_of()
{
  constexpr size_t width = std::size(Record::TABLE);
  static_assert(std::is_standard_layout_v<Record> && std::is_trivially_copyable_v<Record> &&
                    sizeof(Record) == width * sizeof(double),
                "a record has one line for each of its numbers, and nothing else");
  return {Record::TABLE, width, Record::NEEDS};
}

/// All tables that this plugin has, by name.
inline std::map<std::string, SphereTable> &sphere_tables()
{
  static std::map<std::string, SphereTable> all;
  return all;
}

/// Stands beside each record, as the value of a variable.
template <class Record> bool add_table()
{
  return sphere_tables().emplace(Record::NAME, table_of<Record>()).second;
}

/// The line of that name, nullptr if no sphere keeps such a value.
inline const SphereValue *find_sphere_value(const std::string &name)
{
  for (const auto &[group, table] : sphere_tables())
    for (const SphereValue &value : table)
      if (name == value.name) return &value;
  return nullptr;
}

/// The names of some lines, for messages and files.
template <class Lines, class F>
std::string names_of(const Lines &lines, const char *between, F &&is_wanted)
{
  std::string names;
  for (const auto &line : lines)
    if (is_wanted(line)) names += (names.empty() ? "" : between) + std::string(line.name);
  return names;
}
template <class Lines> std::string names_of(const Lines &lines, const char *between)
{
  return names_of(lines, between, [](const auto &) {
    return true;
  });
}

/// Throws BadInput unless a bond file may give this for it.
inline void check_range(const char *name, Range range, double value)
{
  const auto demand = [&](bool holds, const char *rule) {
    if (!holds)
      throw BadInput(name + (" must be " + std::string(rule)) + ", got " + rounded(value));
  };
  constexpr double MOST = 9007199254740992.0;    // whole numbers up to it are exact
  if (range == Range::POSITIVE) demand(value > 0.0, "positive");
  if (range == Range::NOT_NEGATIVE) demand(value >= 0.0, "zero or positive");
  if (range == Range::COUNT || range == Range::BATCH)
    demand(value >= 0.0 && value <= MOST && value == (double) (long long) value,
           "a whole number, zero or positive");
}

/// The values of a table, of all atoms.
struct SphereGroup {
  std::string columns;               ///< their names, by commas
  std::vector<SphereValue> lines;    ///< as many as an atom has values
  unsigned needs = NOTHING_ELSE;
  bool claimed = false;    ///< by its effect, since the last BondStore::drop_unclaimed()
  std::vector<double> values = {};

  double *of(int i) { return values.data() + lines.size() * (size_t) i; }
  const double *of(int i) const { return values.data() + lines.size() * (size_t) i; }
  void clear(int i, size_t bonds)
  {
    for (size_t k = 0; k < lines.size(); k++) of(i)[k] = lines[k].first(bonds);
  }
  bool has_changed(int i, size_t bonds) const
  {
    for (size_t k = 0; k < lines.size(); k++)
      if (lines[k].has_changed(of(i)[k], bonds)) return true;
    return false;
  }
};

/// The records of a group. Take it before a loop: it holds as long as the group is kept.
template <class Record> class SphereRecords {
 public:
  SphereRecords() = default;
  explicit SphereRecords(std::shared_ptr<SphereGroup> group_in) : group(std::move(group_in)) {}

  explicit operator bool() const { return group != nullptr; }
  Record &operator[](int i) const
  {
    constexpr size_t width = sizeof(Record) / sizeof(double);
    return reinterpret_cast<Record &>(group->values[width * (size_t) i]);
  }

 private:
  std::shared_ptr<SphereGroup> group;
};

}    // namespace EVP
