// SPDX-License-Identifier: GPL-2.0-only

#include "check_evp_variables.h"

#include "collective.h"
#include "core/choices.h"
#include "own_process.h"
#include "user_input.h"

#include "comm.h"
#include "error.h"
#include "info.h"
#include "input.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <cstdio>

using namespace LAMMPS_NS;
using EVP::Reading;

static constexpr const char *WHO = "check_evp_variables";
static constexpr int MAX_FILE_SIZE = 1 << 24;

void CheckEVPVariables::command(int narg, char **arg)
{
  std::string mentioned;    // by the files that the script includes
  EVP::for_each_keyword(error, WHO, narg, arg, {"path", "include"}, " or ", [&](const auto &key) {
    const std::string path = path_of(key.value);
    std::string text;
    // a file that is missing is named by the command that includes it
    if (key.is("include") && EVP::read_text(path, MAX_FILE_SIZE, text, world) == Reading::DONE)
      mentioned += text + "\n";
  });

  EVP::stop_at_bad_input(error, WHO, [&] {
    std::string wrong;
    if (comm->me == 0) wrong = first_with_plus();
    if (comm->me == 0 && wrong.empty()) wrong = first_unknown(mentioned);
    EVP::throw_together(wrong, world);
  });
}

// What is wrong with the first name that no script knows; empty where all are known. Of rank 0.
std::string CheckEVPVariables::first_unknown(const std::string &mentioned) const
{
  const std::vector<std::string> given = given_by_var();
  if (given.empty()) return "";
  std::string script;
  if (!infile || !EVP::text_of(fileno(infile), MAX_FILE_SIZE, script)) {
    error->warning(FLERR,
                   "{}: the input script is not read from a file: names of variables are not "
                   "checked",
                   WHO);
    return "";
  }
  // scripts that include this one, and files that it includes, have variables of their own
  const std::string others = EVP::open_texts(MAX_FILE_SIZE, fileno(infile)) + mentioned;
  const std::vector<std::string> known = EVP::index_variables(script + "\n" + others);
  for (const std::string &name : given) {
    if (EVP::uses_variable(script, name) || EVP::mentions(others, name)) continue;
    const std::string nearest = EVP::nearest_name(name, known);
    const std::string hint = known.empty() ? "it has none"
        : nearest.empty()                  ? "its variables are " + utils::join_words(known, ", ")
                                           : "did you mean " + nearest + "?";
    return "-var " + EVP::shown(name) + ": the input script has no such variable; " + hint;
  }
  return "";
}

// What is wrong with the first number that LAMMPS' command 'if' does not take for one; empty without. Of rank 0.
std::string CheckEVPVariables::first_with_plus() const
{
  for (const std::string &name : given_by_var()) {
    const std::string value = input->variable->retrieve(name.c_str());
    if (value[0] == '+' && EVP::is_number(value))
      return "-var " + EVP::shown(name) + ": a number must not begin with +, got " +
          EVP::shown(value) + ": give " + EVP::shown(value.substr(1));
  }
  return "";
}

// The value of a variable; throws BadInput unless it is one word.
std::string CheckEVPVariables::path_of(const std::string &name) const
{
  const char *const value =
      input->variable->find(name.c_str()) < 0 ? nullptr : input->variable->retrieve(name.c_str());
  if (!value) throw EVP::BadInput("there is no variable " + EVP::shown(name));
  const std::string path = value;
  if (path.empty()) throw EVP::BadInput("-var " + name + " is empty: give the path of a file");
  if (path.find_first_of(" \t\"'#&$") != std::string::npos)
    throw EVP::BadInput(
        "-var " + name + " '" + EVP::shown(path) +
        "': in an input script a path must have no blank, quote, #, & or $; rename "
        "the file or folder, or run LAMMPS in the folder and give a path from there");
  return path;
}

// Those of style index that the command line names: others are of a script, or of a program that runs LAMMPS.
std::vector<std::string> CheckEVPVariables::given_by_var() const
{
  const std::vector<std::string> words = EVP::command_line();
  std::vector<std::string> names;
  Info info(lmp);
  for (size_t k = 1; k < words.size(); k++) {
    if (words[k - 1] != "-var" && words[k - 1] != "-v") continue;
    const int i = input->variable->find(words[k].c_str());
    // the style itself is private to LAMMPS
    if (i >= 0 && info.get_variable_info(i).find("style = index") != std::string::npos)
      names.push_back(words[k]);
  }
  return names;
}
