// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/commands/evp_choices.h"

#include "lammps/base/collective.h"
#include "lammps/base/script_variables.h"
#include "lammps/base/user_input.h"
#include "lammps/commands/output_claim.h"
#include "lammps/commands/saved_run.h"

#include "comm.h"
#include "group.h"
#include "input.h"
#include "library.h"
#include "variable.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <tuple>
#include <vector>

using namespace LAMMPS_NS;
using namespace EVP;

namespace {

/// A choice of an input script: NAME, NAME? which need not be defined, or NAME with rules, joined by commas: =WORD|WORD, >X,
/// >=X, <X, <=X, !=X, number, integer; or the rule name: of a file or folder, or the numbers of a row; or output: a name with
/// which all files begin that the script writes. The rule free: a run may be resumed with another value.
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
    if (rules == ",name" || is_output()) return check_name(value);
    double number = 0.0;
    bool listed = false, takes_numbers = false, holds = is_number(value, number);
    std::string words, kind = "a number", bounds, rule, word;
    for (std::istringstream all(rules); std::getline(all, rule, ',');) {
      if (rule.empty() || rule == "free") continue;
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
        if (!is_number(rule.substr(sign.size()), bound) || !is_sign(sign))
          throw BadInput("choice " + name + ": unknown rule '" + shown(rule) + "'");
        holds = holds && is_within(number, sign, bound);
        bounds += (bounds.empty() ? " " : " and ") + sign + " " + rule.substr(sign.size());
      }
    }
    if (listed || (takes_numbers && holds)) return;
    if (takes_numbers) words += (words.empty() ? "" : " or ") + kind + bounds;
    if (is_group)
      throw BadInput("the number of atoms of group " + name + " must be " + words + ", got " +
                     value + ": give the body more spheres, or another size");
    throw BadInput("-var " + name + " must be " + words + ", got '" + shown(value) + "'");
  }

  bool is_output() const { return rules == ",output"; }
  bool takes_integers() const { return rules.find("integer") != std::string::npos; }
  bool is_free() const
  {
    return name == "resume" || name == "also" || is_output() ||
        rules.find(",free") != std::string::npos;
  }

 private:
  // LAMMPS splits some of its commands at blanks, and names reach the shell, too
  void check_name(const std::string &value) const
  {
    const std::vector<std::string> words = split_words(value);
    double number;
    if (!is_output() && !words.empty() && is_number(words[0], number)) return;
    if (value.empty() || value.find_first_of(" \t\r\n\"'`#$&|;<>()\\*?%") != std::string::npos)
      throw BadInput("-var " + name +
                     " must be a name without blanks and any of \"'`#$&|;<>()\\*?%, got '" +
                     shown(value) + "': rename the file or folder, or use another one");
  }
  static bool is_sign(const std::string &sign)
  {
    return sign == ">" || sign == ">=" || sign == "<" || sign == "<=" || sign == "!=";
  }
  static bool is_within(double number, const std::string &sign, double bound)
  {
    if (number == bound) return sign == ">=" || sign == "<=";
    return sign == "!=" || (sign[0] == '>' ? number > bound : number < bound);
  }
};

}    // namespace

// What -var material and -var plasticity mean for choices whose defaults follow.
void EVPChoices::set_implied(int narg, char **arg) const
{
  Variable *const variable = input->variable;
  const char *const row = variable->retrieve("material");
  if (row && variable->find("coeff") >= 0)
    error->all(FLERR, "{}: give -var material or -var coeff, not both", arg[0]);
  stop_at_bad_input(error, arg[0], [&] {
    if (row) Choice("material,name").check(row);
  });
  for (int k = 2; k < narg; k++) {
    const std::string name = arg[k];
    const char *const plasticity = variable->retrieve("plasticity");
    const char *value = nullptr;
    if (name == "coeff")
      value = row;
    else if (name == "plasticity")
      value = row ? "isotropic" : nullptr;
    else if (name == "contact")
      value = plasticity && strcmp(plasticity, "isotropic") == 0 ? "join" : nullptr;
    else
      error->all(FLERR,
                 "evp_choices: implied takes coeff, plasticity, contact, not '{}': define it by "
                 "'variable {} index VALUE'",
                 name, name);
    if (value) variable->set(fmt::format("{} index \"{}\"", name, value));
  }
}

// 1e3 and 1000.0 become 1000, which is what other commands of LAMMPS take
void EVPChoices::write_as_integer(const std::string &name, const std::string &value) const
{
  constexpr double LARGEST = 9007199254740992.0;    // all integers up to 2^53 are numbers
  double number;
  if (!is_number(value, number) || number != std::floor(number) || std::fabs(number) > LARGEST)
    return;
  const std::string plain = std::to_string((bigint) number);
  if (plain == value) return;
  input->variable->set(name + " delete");
  input->variable->set(name + " index " + plain);
}

// Collective. Two runs that write the same files would mix them.
void EVPChoices::claim(const char *script, const std::string &name, const std::string &value) const
{
  if (!on_all(comm->me > 0 || claim_output(value), world))
    error->all(FLERR,
               "{}: another run, which has not ended, writes files that begin with {}: wait for "
               "its end, or give another -var {}",
               script, value, name);
}

// Collective. The folder of the input script that is being read, for its includes, unless -var here gives it; the present one
// where it is not known
void EVPChoices::set_here() const
{
  if (is_variable_of_user(lmp, "here")) return;
  char path[4096] = "";
  if (comm->me == 0 && infile) platform::guesspath(infile, path, sizeof(path) - 1);
  MPI_Bcast(path, sizeof(path), MPI_CHAR, 0, world);
  const std::string folder = path[0] == '/' ? platform::path_dirname(path) : ".";
  set_script_variable(lmp, "evp_choices", "here", folder, "rename it");
}

// Collective. Defines `choices`, the first line of PREFIX.resume, of texts 'NAME VALUE', and `state`, K of the restart file from
// which a run is resumed. Stops where that is a run with other choices.
void EVPChoices::find_saved_run(const std::string &script, const std::vector<std::string> &texts,
                                const std::string &prefix) const
{
  const char *const resume = input->variable->retrieve("resume");
  const bool resumes = resume && strcmp(resume, "yes") == 0;
  SavedRun saved;
  if (resumes && comm->me == 0) saved = read_saved_run(prefix);
  std::string line = script, complaint;
  for (const std::string &text : texts) {
    line += (line == script ? ": " : ", ") + text;
    const bool is_same = saved.choices.rfind(line, 0) == 0 &&
        (saved.choices.size() == line.size() || saved.choices[line.size()] == ',');
    if (complaint.empty() && !is_same)
      complaint =
          fmt::format("{}.resume is of a run with another '{}': give the choices of that run",
                      prefix, text.substr(0, text.find(' ')));
  }
  if (saved.choices.rfind(script + ":", 0) != 0)
    complaint = fmt::format("{}.resume is of another input script", prefix);
  if (saved.choices.empty() || saved.state < 0)
    complaint =
        fmt::format("no run has saved a state in {}.resume and {}.K.restart: give -var resume no",
                    prefix, prefix);
  if (comm->me > 0 || !resumes) complaint.clear();
  broadcast(complaint, 0, world);
  if (!complaint.empty()) error->all(FLERR, "{}: {}", script, complaint);
  set_script_variable(lmp, "evp_choices", "choices", line, "rename it");
  const int state = reduce_all(saved.state, MPI_MAX, world);
  set_script_variable(lmp, "evp_choices", "state", std::to_string(std::max(state, 0)), "rename it");
}

// evp_choices SCRIPT NAME[?][RULE[,RULE ...]] ... [only], or evp_choices SCRIPT implied NAME ...
void EVPChoices::command(int narg, char **arg)
{
  if (narg < 2)
    error->all(FLERR,
               "evp_choices: expected at least two arguments, the name of the input script and its "
               "choices, got {}",
               narg);
  if (strcmp(arg[1], "implied") == 0) return set_implied(narg, arg);
  std::string line = arg[0];
  const bool ends = strcmp(arg[narg - 1], "only") == 0;
  const char *const also = input->variable->retrieve("also");    // a file, maybe with choices
  const bool only = ends && (!also || strcmp(also, "/dev/null") == 0);
  std::vector<std::string> known = {"here", "choices", "state"};
  std::string output, prefix;    // name and value of the choice with that rule
  bool is_resumable = false;
  std::vector<std::string> kept;    // that a run which is resumed must have again
  for (int k = 1; k < narg - ends; k++) {
    const Choice choice(arg[k]);
    known.push_back(choice.name);
    is_resumable = is_resumable || choice.name == "resume";
    const char *value = input->variable->retrieve(choice.name.c_str());
    const int igroup = value ? -1 : group->find(choice.name);
    const std::string atoms = std::to_string(igroup < 0 ? 0 : group->count(igroup));
    if (igroup >= 0) value = atoms.c_str();
    if (!value && choice.optional) continue;
    if (!value)
      error->all(FLERR,
                 "{}: there is no variable '{}': define it before, by 'variable {} index VALUE'",
                 arg[0], choice.name, choice.name);
    stop_at_bad_input(error, arg[0], [&] {
      choice.check(value, igroup >= 0);
    });
    line += fmt::format("{} {} {}", line == arg[0] ? ":" : ",", choice.name, value);
    if (!choice.is_free()) kept.push_back(choice.name + " " + value);
    if (choice.is_output()) std::tie(output, prefix) = std::tie(choice.name, value);
    if (choice.takes_integers() && igroup < 0) write_as_integer(choice.name, value);
  }
  if (is_resumable) find_saved_run(arg[0], kept, prefix);
  if (!output.empty()) claim(arg[0], output, prefix);
  if (comm->me == 0) utils::logmesg(lmp, line + "\n");
  char name[256] = {};
  for (int k = 0;
       only && comm->me == 0 && lammps_id_name(lmp, "variable", k, name, sizeof(name) - 1); k++)
    if (std::find(known.begin(), known.end(), name) == known.end())
      error->warning(FLERR, "{} has no choice '{}': -var {} has no effect", arg[0], name, name);
  if (ends) set_here();
}
