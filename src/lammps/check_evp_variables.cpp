// SPDX-License-Identifier: GPL-2.0-only

#include "check_evp_variables.h"

#include "core/choices.h"
#include "keywords.h"
#include "text_reader.h"

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

  std::string script;
  if (!read_script(script)) {
    if (comm->me == 0)
      error->warning(FLERR,
                     "{}: the input script is not read from a file: names of variables are not "
                     "checked",
                     WHO);
    return;
  }
  const std::vector<std::string> known = EVP::index_variables(script + "\n" + mentioned);
  for (const std::string &name : defined_by_index()) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    if (EVP::mentions(mentioned, name)) continue;
    const std::string nearest = EVP::nearest_name(name, known);
    const std::string hint = nearest.empty() ? "its variables are " + utils::join_words(known, ", ")
                                             : "did you mean " + nearest + "?";
    error->all(FLERR, "{}: -var {}: the input script has no such variable; {}", WHO,
               EVP::shown(name), hint);
  }
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

std::vector<std::string> CheckEVPVariables::defined_by_index() const
{
  std::vector<std::string> names;
  Info info(lmp);
  for (int i = 0; i < input->variable->nvar; i++)
    // the style itself is private to LAMMPS
    if (info.get_variable_info(i).find("style = index") != std::string::npos)
      names.emplace_back(input->variable->names[i]);
  return names;
}

// Collective; false where the script comes from a pipe or, line by line, from a program. LAMMPS reads on where it was.
bool CheckEVPVariables::read_script(std::string &text) const
{
  text.clear();
  int size = -1;
  if (comm->me == 0 && infile) {
    const long place = ftell(infile);
    if (place >= 0 && fseek(infile, 0, SEEK_SET) == 0) {
      char part[4096];
      for (size_t count; (count = fread(part, 1, sizeof(part), infile)) > 0;)
        text.append(part, count);
      const bool whole = !ferror(infile) && text.size() <= (size_t) MAX_FILE_SIZE;
      if (fseek(infile, place, SEEK_SET) != 0)
        error->one(FLERR, "check_evp_variables: cannot go on reading the input script");
      if (whole) size = (int) text.size();
    }
  }
  MPI_Bcast(&size, 1, MPI_INT, 0, world);
  if (size < 0) return false;
  text.resize(size);
  MPI_Bcast(&text[0], size, MPI_CHAR, 0, world);
  return true;
}
