// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/commands/commands.h"

#include "core/law/bond_measures.h"
#include "lammps/base/atom_directory.h"
#include "lammps/base/collective.h"
#include "lammps/base/output_claim.h"
#include "lammps/base/saved_run.h"
#include "lammps/base/scene.h"
#include "lammps/base/script_variables.h"
#include "lammps/base/user_input.h"
#include "lammps/bonds/fix_evp_bonds.h"

#include "comm.h"
#include "group.h"
#include "input.h"
#include "library.h"
#include "math_const.h"
#include "variable.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <tuple>
#include <vector>

using namespace LAMMPS_NS;
using namespace EVP;

static constexpr size_t CHUNK = 1 << 24;    // bytes of text per message

void WriteEVPBonds::command(int narg, char **arg)
{
  if (narg != 1) error->all(FLERR, "write_evp_bonds: expected one argument, the file to write");
  const BondStore &records = find_records();
  BondHeader header = {};
  std::string text = lines_of_pairs(records, header) + lines_of_spheres(records, header);
  const auto [ended, failed, begun] = records.counts();
  const auto sums =
      reduce_all(std::array{header.bonds, header.contacts, header.spheres, ended, failed, begun},
                 MPI_SUM, world);
  header = {sums[0],
            records.within,
            records.zone,
            sums[1],
            sums[2],
            {sums[3], sums[4], sums[5]},
            records.joins_by,
            records.measures.empty() ? std::vector<double>{} : records.measures.words(atom->ntypes),
            header.columns};
  if (comm->me == 0) text = bond_header(header, update->unit_style) + "\n" + text;

  const std::string name = utils::star_subst(arg[0], update->ntimestep, 0);
  // the file appears under its name only when it is whole
  const std::string unfinished = name + ".part";
  FILE *fp = comm->me == 0 ? fopen(unfinished.c_str(), "wb") : nullptr;
  bool good = write_in_order_of_ranks(text, fp);
  if (fp) {
    good = fclose(fp) == 0 && good && rename(unfinished.c_str(), name.c_str()) == 0;
    if (!good) remove(unfinished.c_str());
  }
  if (!on_all(good, world))
    error->all(FLERR, "write_evp_bonds: cannot write '{}': check the folder and the free space",
               name);
  if (comm->me == 0)
    utils::logmesg(lmp, "write_evp_bonds: {} bonds written to {}\n", header.bonds, name);
}

const BondStore &WriteEVPBonds::find_records() const
{
  auto *bonds = dynamic_cast<FixEVPBonds *>(scene::find_fix(modify, "evp/bonds"));
  if (!bonds)
    error->all(FLERR, "write_evp_bonds: there is no fix evp/bonds, hence no bonds to write");
  if (!bonds->records()->has_recorded())
    error->all(FLERR,
               "write_evp_bonds: fix {} has not recorded yet, it does so at the first setup: use "
               "'run 0' before",
               bonds->id);
  bonds->return_histories();
  bonds->check_ids();
  return *bonds->records();
}

// Both atoms have the record of a pair: that with the lower ID writes it, unless its partner was deleted, which a reader could
// not find.
std::string WriteEVPBonds::lines_of_pairs(const BondStore &records, BondHeader &header) const
{
  std::vector<BondLine> lines;
  std::vector<tagint> partners;
  const auto add = [&](const BondLine &pair) {
    if (pair.id > pair.bond.partner) return;
    lines.push_back(pair);
    partners.push_back((tagint) pair.bond.partner);
  };
  for (int i = 0; i < atom->nlocal; i++)
    for (const EVP::BondRecord &bond : records.of(i)) {
      const Remembered *const remembered = records.find_remembered(i, bond.partner);
      const bool joined = remembered && remembered->kind == Remembered::JOINED;
      add({atom->tag[i], bond, joined ? remembered->kind : BondLine::BOND});
    }
  for (int i = 0; records.has_history() && i < atom->nlocal; i++)
    for (const Remembered &one : records.remembered_of(i))
      if (!records.find(i, one.partner)) add({atom->tag[i], {one.partner, one.deq}, one.kind});
  const AtomDirectory directory(lmp, partners);

  std::string text;
  for (const BondLine &pair : lines) {
    if (directory.entries.at((tagint) pair.bond.partner).type == 0) continue;
    text += bond_text(pair);
    (pair.is_bond() ? header.bonds : header.contacts)++;
  }
  return text;
}

// Of those that the bonds do not tell everything of: one of whose values has changed since the recording
std::string WriteEVPBonds::lines_of_spheres(const BondStore &records, BondHeader &header) const
{
  const auto &groups = records.all_groups();
  bool needs_all = false;
  std::vector<BondStore::Place> places;
  for (const auto &[effect, group] : groups) {
    needs_all = needs_all || (group->needs & ALL_SPHERES);
    for (size_t k = 0; k < group->lines.size(); k++) {
      const SphereValue &value = group->lines[k];
      if (value.range == Range::NOT_IN_FILES) continue;
      places.push_back({group.get(), k});
      header.columns += (header.columns.empty() ? "" : ",") + std::string(value.name);
    }
  }
  const auto has_changed = [&](int i) {
    return std::any_of(groups.begin(), groups.end(), [&](const auto &one) {
      return one.second->has_changed(i, records.of(i).size());
    });
  };
  bool any = false;
  for (int i = 0; i < atom->nlocal; i++) any = any || has_changed(i);
  const bool all = on_any(any, world) && needs_all;
  std::string text;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!all && !has_changed(i)) continue;
    SphereLine line = {atom->tag[i], {}};
    for (const BondStore::Place &place : places) line.values.push_back(place.of(i));
    text += sphere_text(line);
    header.spheres++;
  }
  return text;
}

// To the file of the first rank, which stays as it is if nullptr; false there if it cannot be written.
bool WriteEVPBonds::write_in_order_of_ranks(const std::string &text, FILE *fp) const
{
  if (comm->me > 0) {    // an empty message is the last one
    for (size_t done = 0; done < text.size(); done += CHUNK)
      MPI_Send(&text[done], (int) std::min(CHUNK, text.size() - done), MPI_CHAR, 0, 0, world);
    MPI_Send(nullptr, 0, MPI_CHAR, 0, 0, world);
    return true;
  }
  bool good = fp && fwrite(text.data(), 1, text.size(), fp) == text.size();
  std::vector<char> received(comm->nprocs > 1 ? CHUNK : 0);
  for (int source = 1; source < comm->nprocs; source++)
    for (int size = 1; size > 0;) {
      MPI_Status status;
      MPI_Recv(received.data(), (int) CHUNK, MPI_CHAR, source, 0, world, &status);
      MPI_Get_count(&status, MPI_CHAR, &size);
      good = good && fwrite(received.data(), 1, size, fp) == (size_t) size;
    }
  return good;
}

// read_evp_row FILE:ROW PREFIX, or FILE ROW PREFIX, or e1 m1 ... alpha [keyword value ...] PREFIX, where the numbers
// may be one quoted word; then [set KEY NUMBER] ... [body GROUP VOLUME SOLID_FRACTION]
void ReadEVPRow::command(int narg, char **arg)
{
  char **body = nullptr;
  std::vector<char **> changes;    // the last one in front
  if (narg > 5 && strcmp(arg[narg - 4], "body") == 0) body = arg + (narg -= 4) + 1;
  while (narg > 4 && strcmp(arg[narg - 3], "set") == 0) changes.push_back(arg + (narg -= 3) + 1);
  if (narg < 2)
    error->all(FLERR,
               "read_evp_row: expected at least two arguments, a row (FILE:ROW or its numbers) and "
               "the prefix of the variables, got {}",
               narg);
  std::vector<std::string> words = {arg, arg + narg - 1};
  if (words.size() == 1 && words[0].find(':') == std::string::npos) words = split_words(words[0]);

  const std::string prefix = arg[narg - 1];
  const auto set = [&](const std::string &name, const std::string &value) {
    set_script_variable(lmp, "read_evp_row", prefix + "_" + name, value,
                        "give another prefix than '" + prefix + "', or rename that variable");
  };
  Row row;
  stop_at_bad_input(error, "read_evp_row", [&] {
    row = read_row(lmp, words);
    for (auto at = changes.rbegin(); at != changes.rend(); ++at)
      set_number(row, (*at)[0], (*at)[1]);
    if (!body) return;
    const Spheres spheres = spheres_of(body);
    set("diameter", rounded(spheres.diameter, 15));
    if (!row.is_scaled()) row = with_number_density(row, spheres.number_density);
  });
  for (const Member &member : MEMBERS) {
    std::string name = member.key;
    std::replace(name.begin(), name.end(), ' ', '_');
    set(name, shortest_text(row.*member.value));
  }
  set("words", row_text(row));
  std::string key = row_text(row);    // 'if' compares words of letters, digits and _ alone
  for (char &c : key)
    if (!isalnum((unsigned char) c)) c = c == '.' ? 'p' : c == '-' ? 'm' : '_';
  set("key", key);
}

// Throws BadInput where rows have no such number, or this one breaks a rule with it.
void ReadEVPRow::set_number(Row &row, const std::string &key, const std::string &number)
{
  const Member *const member = find_member(key);
  if (!member)
    throw BadInput("set: a row has no number '" + shown(key) + "': it has " +
                   keys_of(MEMBERS, std::end(MEMBERS), ", "));
  if (member->place != Member::HEAD && !is_given(row, *member))
    throw BadInput("set: the row has no keyword " + std::string(member->head()->key) +
                   ", of which " + key + " is a number: give the row that keyword");
  row.*member->value = parse_number(key, number);
  (void) PairLaw(row);
}

// Collective. Those of a group, whose volumes must be those of the body. words: group, volume, solid fraction
ReadEVPRow::Spheres ReadEVPRow::spheres_of(char **words) const
{
  if (strcmp(update->unit_style, "si") != 0)
    throw BadInput("body is about that of the paper, in units si: leave 'body' out, and give the "
                   "coefficients of your own body");
  const int igroup = group->find(words[0]);
  if (!atom->radius_flag) throw BadInput("body: there are no spheres yet");
  if (igroup < 0) throw BadInput(fmt::format("body: there is no group '{}'", words[0]));
  const Keyword volume = {"body: the volume", words[1]},
                fraction = {"body: the solid fraction", words[2]};
  const double inside = volume.number(), solid = fraction.number();
  volume.demand(inside > 0.0, "must be positive");
  fraction.demand(solid > 0.0 && solid <= 1.0, "must lie between 0 and 1");
  double of_spheres = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & group->bitmask[igroup])
      of_spheres += 4.0 / 3.0 * MathConst::MY_PI * std::pow(atom->radius[i], 3);
  of_spheres = reduce_all(of_spheres, MPI_SUM, world);
  if (std::fabs(of_spheres / (inside * solid) - 1.0) > 0.02)
    throw BadInput(fmt::format(
        "the spheres of group {} have a volume of {:.5g} m3, but a solid fraction of {} in a body "
        "of {} m3 makes {:.5g} m3: check the numbers in FILE.body, which are in m",
        words[0], of_spheres, words[2], words[1], inside * solid));
  const auto count = (double) group->count(igroup);
  return {count / inside, std::pow(6 * solid * inside / (MathConst::MY_PI * count), 1.0 / 3.0)};
}

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
  if (!output.empty()) claim(arg[0], output, prefix);
  if (is_resumable) find_saved_run(arg[0], kept, prefix);
  if (comm->me == 0) utils::logmesg(lmp, line + "\n");
  char name[256] = {};
  for (int k = 0;
       only && comm->me == 0 && lammps_id_name(lmp, "variable", k, name, sizeof(name) - 1); k++)
    if (std::find(known.begin(), known.end(), name) == known.end())
      error->warning(FLERR, "{} has no choice '{}': -var {} has no effect", arg[0], name, name);
  if (ends) set_here();
}

namespace {

// Atoms that are minimized move without such a fix, but LAMMPS warns at each 'run 0'.
constexpr const char *HARMLESS = "No fixes with time integration";

/// While it lives, only warnings, what EVP says, and all that follows an error, come to the screen: at once, as another MPI rank
/// may end this one.
class HiddenScreen {
 public:
  HiddenScreen(FILE *&screen_in, Error *error_in) :
      screen(screen_in), shown(screen_in), hidden(shown ? open() : nullptr), error(error_in)
  {
    if (!hidden) return;    // all is shown
    setvbuf(hidden, nullptr, _IOLBF, BUFSIZ);
    screen = hidden;
  }
  ~HiddenScreen()
  {
    screen = shown;
    if (!hidden) return;
    fclose(hidden);
    if (!line.empty()) show();
  }
  HiddenScreen(const HiddenScreen &) = delete;
  HiddenScreen &operator=(const HiddenScreen &) = delete;

 private:
  FILE *&screen;
  FILE *const shown, *const hidden;
  Error *const error;
  std::string line;    // that is not whole yet
  bool failed = false;

  FILE *open()
  {
#if defined(__linux__)
    cookie_io_functions_t functions = {};
    functions.write = [](void *self, const char *text, size_t size) {
      static_cast<HiddenScreen *>(self)->add(text, size);
      return (ssize_t) size;
    };
    return fopencookie(this, "w", functions);
#else
    const auto write = [](void *self, const char *text, int size) {
      static_cast<HiddenScreen *>(self)->add(text, (size_t) size);
      return size;
    };
    return funopen(this, nullptr, write, nullptr, nullptr);
#endif
  }
  void add(const char *text, size_t size)
  {
    for (const char *c = text; c < text + size; c++) {
      line += *c;
      if (*c == '\n') show();
    }
  }
  void show()
  {
    failed = failed || utils::strmatch(line, "^ERROR");
    bool warns = utils::strmatch(line, "^WARNING");
    if (warns && line.find(HARMLESS) != std::string::npos) {
      warns = false;
      error->set_numwarn(error->get_numwarn() - 1);    // LAMMPS shows the first hundred
    }
    const bool ours = utils::strmatch(line, "^evp/lj:") || utils::strmatch(line, "^pair evp/lj:") ||
        utils::strmatch(line, "^fix evp/");
    if (failed || warns || ours) {
      fputs(line.c_str(), shown);
      fflush(shown);
    }
    line.clear();
  }
};

std::string in_quotes(const std::string &word)
{
  if (!word.empty() && word.find_first_of(" \t#&$") == std::string::npos) return word;
  return "\"" + word + "\"";
}

}    // namespace

void EVPQuietly::command(int narg, char **arg)
{
  if (narg < 1) error->all(FLERR, "evp_quietly: expected a command and its arguments");
  // LAMMPS replaces letters outside ASCII in a line, but not in the variables of it
  std::string line, words;
  for (int i = 0; i < narg; i++) {
    std::string word = arg[i];
    if (utils::has_utf8(word) && in_quotes(word) == word) {
      const std::string name = "evp_quietly_" + std::to_string(i);
      set_script_variable(lmp, "evp_quietly", name, arg[i], "rename it");
      word = "${" + name + "}";
      words += " " + name;
    } else
      word = in_quotes(word);
    line += word + " ";
  }

  const HiddenScreen until_it_ends(lmp->screen, error);
  input->one(line);
  for (const std::string &name : split_words(words)) input->variable->set(name + " delete");
}
