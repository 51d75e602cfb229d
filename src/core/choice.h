// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#include "text.h"

#include <cmath>
#include <sstream>
#include <string>

namespace EVP {

/// A choice of an input script: NAME, NAME? which need not be defined, or NAME with rules, joined by commas: =WORD|WORD, >X,
/// >=X, <X, <=X, !=X, number, integer.
struct Choice {
  std::string name, rules;
  bool optional;

  explicit Choice(const std::string &text) :
      name(text.substr(0, text.find_first_of("?,=<>!"))), rules(text.substr(name.size())),
      optional(!rules.empty() && rules[0] == '?')
  {
    if (optional) rules.erase(0, 1);
  }

  /// Throws BadInput where the value is neither one of the words nor a number within the bounds. is_group: it is the
  /// number of atoms of a group.
  void check(const std::string &value, bool is_group = false) const
  {
    if (rules.empty()) return;
    double number = 0.0;
    bool listed = false, takes_numbers = false, holds = take_number(value, number);
    std::string words, kind = "a number", bounds, rule, word;
    for (std::istringstream all(rules); std::getline(all, rule, ',');) {
      if (rule.empty()) continue;
      const std::string sign = rule.substr(0, rule.find_first_not_of("<>=!"));
      if (rule[0] == '=' && rule.size() > 1) {
        for (std::istringstream some(rule.substr(1)); std::getline(some, word, '|');) {
          listed = listed || value == word;
          words += (words.empty() ? "" : " or ") + word;
        }
        continue;
      }
      takes_numbers = true;
      if (rule == "integer") {
        kind = "an integer";
        holds = holds && number == std::floor(number);
      } else if (rule != "number") {
        double bound = 0.0;
        if (!take_number(rule.substr(sign.size()), bound) || !is_sign(sign))
          throw BadInput("choice " + name + ": unknown rule '" + shown(rule) + "'");
        holds = holds && is_within(number, sign, bound);
        bounds += (bounds.empty() ? " " : " and ") + sign + " " + rule.substr(sign.size());
      }
    }
    if (listed || (takes_numbers && holds)) return;
    if (takes_numbers) words += (words.empty() ? "" : " or ") + kind + bounds;
    if (is_group)
      throw BadInput("the number of atoms of group " + name + " must be " + words + ", got " +
                     value + ": give the body more spheres, or another length");
    throw BadInput("-var " + name + " must be " + words + ", got '" + shown(value) + "'");
  }

 private:
  static bool is_sign(const std::string &sign)
  {
    return sign == ">" || sign == ">=" || sign == "<" || sign == "<=" || sign == "!=";
  }
  static bool is_within(double number, const std::string &sign, double bound)
  {
    if (sign == ">") return number > bound;
    if (sign == ">=") return number >= bound;
    if (sign == "<") return number < bound;
    if (sign == "<=") return number <= bound;
    return number != bound;
  }
};

}    // namespace EVP
